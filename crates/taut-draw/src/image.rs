//! A finished picture and its PNG.

use crate::error::DrawError;

/// A picture: rows from the top, three sRGB bytes a pixel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    width: u32,
    height: u32,
    bytes: Vec<u8>,
}

impl Image {
    pub(crate) fn new(width: u32, height: u32, bytes: Vec<u8>) -> Self {
        Self {
            width,
            height,
            bytes,
        }
    }

    /// Pixels across.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Pixels down.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All pixels, row by row from the top, three bytes each.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Colour of the pixel in column `x` and row `y`, both from 0 at the upper left; `None`
    /// outside the picture.
    #[must_use]
    pub fn pixel(&self, x: u32, y: u32) -> Option<[u8; 3]> {
        if x >= self.width || y >= self.height {
            return None;
        }
        let start = 3 * (y as usize * self.width as usize + x as usize);
        Some([
            self.bytes[start],
            self.bytes[start + 1],
            self.bytes[start + 2],
        ])
    }

    /// The picture as the contents of a PNG file (8 bits, RGB, sRGB).
    ///
    /// # Errors
    ///
    /// [`DrawError::Encode`] where the encoder fails, say for lack of memory.
    pub fn to_png_bytes(&self) -> Result<Vec<u8>, DrawError> {
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.bytes)?;
        writer.finish()?;
        Ok(out)
    }
}
