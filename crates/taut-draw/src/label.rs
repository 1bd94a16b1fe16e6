//! Scale bar and caption, in a strip below the cloud.

use ab_glyph::{Font, FontRef, Glyph, PxScale, ScaleFont, point};

use crate::camera::Camera;
use crate::canvas::Canvas;
use crate::scene::Scene;

/// Height of letters (a line of text) against the picture's height, and its least value.
const TEXT: f64 = 0.026;
const SMALLEST_TEXT: f64 = 13.0;
/// Height of the strip, in lines of text.
const STRIP: f64 = 1.5;
/// The scale bar takes at most this share of the picture's width.
const LONGEST_BAR: f64 = 0.22;
const INK: [f32; 3] = [0.13, 0.13, 0.15];

/// Pixels that scale bar and caption need at the bottom.
pub(crate) fn footer_height(scene: &Scene, height: usize) -> f64 {
    if scene.unit.is_none() && scene.caption.is_none() {
        return 0.0;
    }
    STRIP * text_size(height)
}

fn text_size(height: usize) -> f64 {
    (TEXT * height as f64).max(SMALLEST_TEXT)
}

/// Draws the scale bar to the left and the caption to the right.
pub(crate) fn draw_footer(canvas: &mut Canvas, scene: &Scene, camera: &Camera) {
    let Ok(font) = FontRef::try_from_slice(dejavu::sans::regular()) else {
        return;
    };
    let size = text_size(canvas.height) as f32;
    let baseline = canvas.height as f32 - 0.75 * size;
    let mut left = 0.9 * size;
    if let Some(unit) = &scene.unit {
        let bar = ScaleBar::new(camera.pixels_per_unit(), canvas.width as f64, unit);
        left = bar.draw(canvas, &font, size, left, baseline) + 1.5 * size;
    }
    if let Some(caption) = &scene.caption {
        let room = canvas.width as f32 - left - 0.9 * size;
        draw_caption(canvas, &font, caption, size, room, baseline);
    }
}

/// A round length and what is written beside it.
#[derive(Debug, PartialEq)]
struct ScaleBar {
    pixels: f64,
    text: String,
}

impl ScaleBar {
    /// The largest of 1, 2, 5, 10, ... that the picture has room for.
    fn new(pixels_per_unit: f64, width: f64, unit: &str) -> Self {
        let longest = LONGEST_BAR * width / pixels_per_unit;
        let (digit, exponent) = round_at_most(longest);
        let number = number_text(digit, exponent);
        Self {
            pixels: length(digit, exponent) * pixels_per_unit,
            text: format!("{number} {unit}").trim_end().to_owned(),
        }
    }

    /// Returns the first free column to the right.
    fn draw(
        &self,
        canvas: &mut Canvas,
        font: &FontRef<'_>,
        size: f32,
        left: f32,
        baseline: f32,
    ) -> f32 {
        let thickness = (size * 0.09).round().max(1.0) as i64;
        let tick = (size * 0.28).round() as i64;
        let middle = (baseline - 0.30 * size).round() as i64;
        let (first, last) = (
            left.round() as i64,
            (left + self.pixels as f32).round() as i64,
        );
        fill(canvas, first..last, middle..middle + thickness);
        for column in [first, last - thickness] {
            fill(
                canvas,
                column..column + thickness,
                middle - tick..middle + thickness + tick,
            );
        }
        let text = Line::new(font, &self.text, size);
        let start = last as f32 + 0.5 * size;
        text.draw(canvas, font, start, baseline);
        start + text.width
    }
}

fn length(digit: i32, exponent: i32) -> f64 {
    f64::from(digit) * 10.0_f64.powi(exponent)
}

/// Digit and power of ten of the largest of 1, 2, 5, 10, ... that is not longer.
fn round_at_most(longest: f64) -> (i32, i32) {
    let exponent = longest.log10().floor() as i32;
    let mut digits = [5, 2, 1].into_iter();
    match digits.find(|digit| length(*digit, exponent) <= longest) {
        Some(digit) => (digit, exponent),
        None => (5, exponent - 1),
    }
}

/// The largest of ..., 1, 2, 5, 10, ... that is not longer; 1 where none is.
#[must_use]
pub fn round_length(longest: f64) -> f64 {
    if !(longest.is_normal() && longest > 0.0) {
        return 1.0;
    }
    let (digit, exponent) = round_at_most(longest);
    // A quotient of whole numbers is the nearest to the decimal fraction.
    match exponent {
        0.. => length(digit, exponent),
        _ => f64::from(digit) / 10.0_f64.powi(-exponent),
    }
}

/// Plain digits from 0.001 to 50,000; powers of ten beyond.
fn number_text(digit: i32, exponent: i32) -> String {
    if (0..=4).contains(&exponent) {
        return format!("{digit}{}", "0".repeat(exponent as usize));
    }
    if (-3..0).contains(&exponent) {
        return format!("0.{}{digit}", "0".repeat((-exponent - 1) as usize));
    }
    let power: String = exponent.to_string().chars().map(superscript).collect();
    match digit {
        1 => format!("10{power}"),
        _ => format!("{digit}\u{b7}10{power}"),
    }
}

fn superscript(character: char) -> char {
    match character {
        '-' => '\u{207b}',
        '1' => '\u{b9}',
        '2' => '\u{b2}',
        '3' => '\u{b3}',
        digit => char::from_u32(0x2070 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
    }
}

fn fill(canvas: &mut Canvas, columns: std::ops::Range<i64>, rows: std::ops::Range<i64>) {
    for y in rows {
        for x in columns.clone() {
            canvas.blend(x, y, INK, 1.0);
        }
    }
}

/// Right-aligned; smaller where the room is short, and cut where it is very short.
fn draw_caption(
    canvas: &mut Canvas,
    font: &FontRef<'_>,
    caption: &str,
    size: f32,
    room: f32,
    baseline: f32,
) {
    let right = canvas.width as f32 - 0.9 * size;
    let natural = Line::new(font, caption, size).width;
    let smaller = size * (room / natural.max(1.0)).clamp(0.6, 1.0);
    let mut text = caption.trim().replace(char::is_control, " ");
    let mut line = Line::new(font, &text, smaller);
    while line.width > room && !text.is_empty() {
        text.pop();
        line = Line::new(font, &format!("{}\u{2026}", text.trim_end()), smaller);
    }
    line.draw(canvas, font, right - line.width, baseline);
}

/// Glyphs set in a line from 0.
struct Line {
    glyphs: Vec<Glyph>,
    width: f32,
}

impl Line {
    fn new(font: &FontRef<'_>, text: &str, size: f32) -> Self {
        let scale = PxScale::from(size);
        let scaled = font.as_scaled(scale);
        let mut glyphs: Vec<Glyph> = Vec::new();
        let mut width = 0.0;
        for character in text.chars() {
            let id = scaled.glyph_id(character);
            if let Some(before) = glyphs.last() {
                width += scaled.kern(before.id, id);
            }
            glyphs.push(id.with_scale_and_position(scale, point(width, 0.0)));
            width += scaled.h_advance(id);
        }
        Self { glyphs, width }
    }

    fn draw(&self, canvas: &mut Canvas, font: &FontRef<'_>, left: f32, baseline: f32) {
        for glyph in &self.glyphs {
            let mut placed = glyph.clone();
            placed.position.x += left.round();
            placed.position.y = baseline.round();
            let Some(outline) = font.outline_glyph(placed) else {
                continue;
            };
            let corner = outline.px_bounds().min;
            outline.draw(|x, y, opacity| {
                let (x, y) = (
                    corner.x as i64 + i64::from(x),
                    corner.y as i64 + i64::from(y),
                );
                canvas.blend(x, y, INK, opacity);
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_bars_are_round_and_fit() {
        for (pixels_per_unit, text) in [
            (1.0, "200 m"),
            (0.9, "200 m"),
            (300.0, "0.5 m"),
            (7e5, "2\u{b7}10\u{207b}\u{2074} m"),
            (1e-8, "2\u{b7}10\u{b9}\u{2070} m"),
        ] {
            let bar = ScaleBar::new(pixels_per_unit, 1000.0, "m");
            assert_eq!(bar.text, text, "{pixels_per_unit}");
            assert!((80.0..=220.0).contains(&bar.pixels), "{bar:?}");
        }
        assert_eq!(ScaleBar::new(1.0, 1000.0, "").text, "200");
    }
}
