//! A finished picture and its PNG file.

use std::fs;
use std::io::Write;
use std::path::Path;

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

    /// Writes the picture as PNG.
    ///
    /// A reader sees the old file or the new one, never a part: the bytes go to a temporary file
    /// in the same folder, which then takes the name. A link is followed; what is no plain file
    /// (a pipe, say) is written in place.
    ///
    /// # Errors
    ///
    /// [`DrawError::Encode`], [`DrawError::Write`].
    pub fn write_png(&self, path: &Path) -> Result<(), DrawError> {
        let bytes = self.to_png_bytes()?;
        write_whole(path, &bytes).map_err(|source| DrawError::Write {
            path: path.to_owned(),
            source,
        })
    }
}

fn write_whole(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    if fs::metadata(&target).is_ok_and(|data| !data.is_file()) {
        return fs::OpenOptions::new()
            .write(true)
            .open(&target)?
            .write_all(bytes);
    }
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut file = temporary_file(folder)?;
    file.write_all(bytes)?;
    file.persist(&target)?;
    Ok(())
}

/// A temporary file with the access rights of a file made the ordinary way.
fn temporary_file(folder: &Path) -> std::io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".taut-").suffix(".png");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}
