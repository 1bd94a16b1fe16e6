//! The picture while it is being drawn.

use crate::image::Image;

/// Pixels with sRGB-coded channels in 0..=1, so that lines and letters blend as eyes expect.
pub(crate) struct Canvas {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<[f32; 3]>,
}

impl Canvas {
    /// Lays `colour` over a pixel with the given opacity; places outside the picture are ignored.
    pub(crate) fn blend(&mut self, x: i64, y: i64, colour: [f32; 3], opacity: f32) {
        let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else {
            return;
        };
        if x >= self.width || y >= self.height {
            return;
        }
        let pixel = &mut self.pixels[y * self.width + x];
        for channel in 0..3 {
            pixel[channel] += (colour[channel] - pixel[channel]) * opacity.clamp(0.0, 1.0);
        }
    }

    /// Rounds to bytes.
    pub(crate) fn into_image(self) -> Image {
        let bytes = self
            .pixels
            .iter()
            .flatten()
            .map(|channel| (channel.clamp(0.0, 1.0) * 255.0).round() as u8)
            .collect();
        Image::new(self.width as u32, self.height as u32, bytes)
    }
}

/// sRGB bytes as channels in 0..=1.
pub(crate) fn coded(colour: [u8; 3]) -> [f32; 3] {
    colour.map(|byte| f32::from(byte) / 255.0)
}

/// `a` for 0, `b` for 1, in between otherwise.
pub(crate) fn mix(a: [f32; 3], b: [f32; 3], share: f32) -> [f32; 3] {
    std::array::from_fn(|channel| a[channel] + (b[channel] - a[channel]) * share)
}

/// Light of an sRGB-coded channel (IEC 61966-2-1).
pub(crate) fn decode(coded: f32) -> f32 {
    if coded <= 0.04045 {
        coded / 12.92
    } else {
        ((coded + 0.055) / 1.055).powf(2.4)
    }
}

/// The sRGB code of a channel's light.
pub(crate) fn encode(light: f32) -> f32 {
    if light <= 0.003_130_8 {
        light * 12.92
    } else {
        1.055 * light.powf(1.0 / 2.4) - 0.055
    }
}
