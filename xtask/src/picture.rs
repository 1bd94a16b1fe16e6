//! Whether a file is a whole PNG picture.

use std::path::Path;

const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";
/// The closing chunk: no data, its name, its sum.
const END: &[u8] = b"\0\0\0\0IEND\xaeB`\x82";

/// Checks that `file` begins and ends as a PNG picture and has a width and a height; says what is
/// wrong if not.
pub fn check(file: &Path) -> Result<(), String> {
    let name = file.display();
    let bytes = std::fs::read(file).map_err(|error| format!("{name}: no picture: {error}"))?;
    match size(&bytes) {
        Some([width, height]) if width > 0 && height > 0 => {
            println!(
                "{name}: {width} x {height} pixels, {} KiB",
                bytes.len() / 1024
            );
            Ok(())
        }
        _ => Err(format!(
            "{name}: found {} bytes that are no PNG picture",
            bytes.len()
        )),
    }
}

/// Width and height as the first chunk, IHDR, tells them.
fn size(bytes: &[u8]) -> Option<[u32; 2]> {
    let header = bytes.strip_prefix(SIGNATURE)?.strip_suffix(END)?;
    let rest = header.strip_prefix(b"\0\0\0\x0dIHDR")?;
    let (width, rest) = rest.split_first_chunk()?;
    let (height, _) = rest.split_first_chunk()?;
    Some([*width, *height].map(u32::from_be_bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_the_size_of_whole_pictures_only() {
        let header = b"\0\0\0\x0dIHDR\0\0\x06\x40\0\0\x04\xb0\x08\x02\0\0\0";
        let whole = [SIGNATURE, header, END].concat();
        assert_eq!(size(&whole), Some([1600, 1200]));
        assert_eq!(size(&whole[..whole.len() - 1]), None);
        assert_eq!(size(&whole[1..]), None);
        assert_eq!(size(b""), None);
    }
}
