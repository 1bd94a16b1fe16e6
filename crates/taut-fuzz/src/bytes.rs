//! Numbers out of bytes, as many as there are.

/// Bytes that are used up from the front; behind the last one come zeros.
pub struct Bytes<'a>(pub &'a [u8]);

impl Bytes<'_> {
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn byte(&mut self) -> u8 {
        self.take::<1>()[0]
    }

    pub fn take<const N: usize>(&mut self) -> [u8; N] {
        let mut taken = [0; N];
        let count = N.min(self.0.len());
        let (front, rest) = self.0.split_at(count);
        taken[..count].copy_from_slice(front);
        self.0 = rest;
        taken
    }

    /// A whole number from -128 to 127.
    pub fn small(&mut self) -> f64 {
        f64::from(i8::from_le_bytes(self.take()))
    }

    /// A multiple of 1/256 from -128 to 128.
    pub fn fine(&mut self) -> f64 {
        f64::from(i16::from_le_bytes(self.take())) / 256.0
    }

    /// A power of ten from 1e-300 to 1e300, 1 for the byte 0.
    pub fn magnitude(&mut self) -> f64 {
        10_f64.powf(self.small() * (300.0 / 128.0))
    }

    /// Any number at all, infinite ones and NaN as well.
    pub fn any(&mut self) -> f64 {
        f64::from_le_bytes(self.take())
    }
}
