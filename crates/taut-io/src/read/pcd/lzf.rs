//! LZF, the compression of PCD bodies, after the format of Marc Lehmann's liblzf: literal runs of
//! up to 32 bytes, and back references of 3 to 264 bytes at most 8192 bytes back.

/// What is wrong with a compressed stream, and where.
pub(super) struct LzfError {
    pub(super) offset: usize,
    pub(super) found: String,
}

/// Unpacks to exactly `size` bytes. No more memory is held than the stream has earned so far: a
/// byte of it unpacks to at most 264.
pub(super) fn decompress(packed: &[u8], size: usize) -> Result<Vec<u8>, LzfError> {
    const LONGEST_PER_BYTE: usize = 264;
    let mut output = Vec::with_capacity(size.min(packed.len().saturating_mul(LONGEST_PER_BYTE)));
    let mut position = 0;
    let error = |offset, found: &str| LzfError {
        offset,
        found: found.to_owned(),
    };
    while let Some(control) = packed.get(position).map(|byte| usize::from(*byte)) {
        let start = position;
        position += 1;
        let ended = || error(start, "the stream's end inside a run");
        if control < 32 {
            let literal = packed
                .get(position..=position + control)
                .ok_or_else(ended)?;
            output.extend_from_slice(literal);
            position += literal.len();
        } else {
            let mut next = || {
                let byte = packed
                    .get(position)
                    .map(|byte| usize::from(*byte))
                    .ok_or_else(ended)?;
                position += 1;
                Ok(byte)
            };
            let mut length = (control >> 5) + 2;
            if length == 9 {
                length += next()?;
            }
            let back = ((control & 31) << 8) + next()? + 1;
            let from = output
                .len()
                .checked_sub(back)
                .ok_or_else(|| error(start, "a reference to before the data"))?;
            for index in from..from + length {
                output.push(output[index]);
            }
        }
        if output.len() > size {
            return Err(error(start, "more data than declared"));
        }
    }
    if output.len() < size {
        let found = format!("{} of {size} bytes", output.len());
        return Err(error(packed.len(), &found));
    }
    Ok(output)
}

#[cfg(test)]
mod tests {
    use super::decompress;

    #[test]
    fn references_may_overlap() {
        assert_eq!(
            decompress(&[1, b'a', b'b', 0x40, 1], 6).ok(),
            Some(b"ababab".to_vec())
        );
        assert_eq!(
            decompress(&[0, b'a', 0xe0, 255, 0], 265).ok(),
            Some(vec![b'a'; 265])
        );
    }

    #[test]
    fn wrong_streams_are_told() {
        for (packed, size) in [
            (&[0x20, 1][..], 3),
            (&[2, b'a'], 3),
            (&[0, b'a'], 2),
            (&[1, 1, 1], 1),
            (&[0xe0], 9),
        ] {
            assert!(decompress(packed, size).is_err());
        }
    }
}
