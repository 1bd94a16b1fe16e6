//! One number of each record by its name: the intensity, or an extra dimension (LAS 1.4, table 24).

use las::{Header, PointData};

use crate::error::Fault;

const USER: &str = "LASF_Spec";
const EXTRA_BYTES: u16 = 4;
pub(crate) const DESCRIPTOR: usize = 192;
const INTENSITY: &str = "intensity";

/// A number of a record.
pub(super) enum Dimension {
    Intensity,
    Extra(Extra),
}

/// Bytes behind the others of a record.
pub(super) struct Extra {
    /// Where they begin, counted from the end of the record.
    before_end: usize,
    kind: Kind,
    scale: f64,
    offset: f64,
    /// The number that stands for none.
    none: Option<f64>,
}

/// How a number is kept.
#[derive(Clone, Copy)]
enum Kind {
    Unsigned(usize),
    Signed(usize),
    Single,
    Double,
}

impl Kind {
    /// By the code of a descriptor; `None` for bytes without a meaning and for arrays, which are
    /// deprecated.
    fn of_code(code: u8) -> Option<Self> {
        Some(match code {
            1 => Self::Unsigned(1),
            2 => Self::Signed(1),
            3 => Self::Unsigned(2),
            4 => Self::Signed(2),
            5 => Self::Unsigned(4),
            6 => Self::Signed(4),
            7 => Self::Unsigned(8),
            8 => Self::Signed(8),
            9 => Self::Single,
            10 => Self::Double,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::Unsigned(size) | Self::Signed(size) => size,
            Self::Single => 4,
            Self::Double => 8,
        }
    }

    /// The number at the start of some bytes, which are as many or more.
    fn number(self, bytes: &[u8]) -> f64 {
        let mut wide = [0; 8];
        let size = self.size().min(bytes.len());
        wide[..size].copy_from_slice(&bytes[..size]);
        let unsigned = u64::from_le_bytes(wide);
        let unused = 64 - 8 * self.size() as u32;
        match self {
            Self::Unsigned(_) => unsigned as f64,
            Self::Signed(_) => (((unsigned << unused) as i64) >> unused) as f64,
            Self::Single => f64::from(f32::from_bits(unsigned as u32)),
            Self::Double => f64::from_bits(unsigned),
        }
    }
}

/// A descriptor of extra bytes.
struct Descriptor<'a>(&'a [u8; DESCRIPTOR]);

impl Descriptor<'_> {
    fn name(&self) -> String {
        let name = self.0[4..36].split(|byte| *byte == 0).next();
        String::from_utf8_lossy(name.unwrap_or_default()).into_owned()
    }

    fn code(&self) -> u8 {
        self.0[2]
    }

    /// Bytes in a record: where the code says none, as many as the options do, or of the numbers of
    /// an array.
    fn size(&self) -> usize {
        match (self.code(), self.0[3]) {
            (0, size) => usize::from(size),
            (code @ 11..=30, _) => {
                let numbers = usize::from((code - 1) / 10) + 1;
                Kind::of_code((code - 1) % 10 + 1).map_or(0, |kind| numbers * kind.size())
            }
            (code, _) => Kind::of_code(code).map_or(0, Kind::size),
        }
    }

    fn double(&self, at: usize, option: u8) -> Option<f64> {
        let is_meant = self.0[3] & option != 0;
        is_meant.then(|| Kind::Double.number(&self.0[at..]))
    }

    /// The dimension, if it is a number, so many bytes before the end of a record.
    fn dimension(&self, before_end: usize) -> Option<Extra> {
        let kind = Kind::of_code(self.code())?;
        let none = match kind {
            Kind::Unsigned(_) => Kind::Unsigned(8),
            Kind::Signed(_) => Kind::Signed(8),
            Kind::Single | Kind::Double => Kind::Double,
        };
        Some(Extra {
            before_end,
            kind,
            scale: self.double(112, 8).unwrap_or(1.0),
            offset: self.double(136, 16).unwrap_or(0.0),
            none: (self.0[3] & 1 != 0).then(|| none.number(&self.0[40..])),
        })
    }
}

/// Bytes that descriptors speak of.
pub(crate) fn descriptors_size(descriptors: &[[u8; DESCRIPTOR]]) -> usize {
    let sizes = descriptors.iter().map(|bytes| Descriptor(bytes).size());
    sizes.sum()
}

/// The names of described dimensions.
pub(crate) fn names(descriptors: &[[u8; DESCRIPTOR]]) -> Vec<String> {
    let names = descriptors.iter().map(|bytes| Descriptor(bytes).name());
    names.collect()
}

impl Dimension {
    /// The dimension of a name that a header describes.
    pub(super) fn of_name(header: &Header, name: &str) -> Result<Self, Fault> {
        if name.eq_ignore_ascii_case(INTENSITY) {
            return Ok(Self::Intensity);
        }
        let records = header.all_vlrs();
        let bytes = records
            .filter(|vlr| vlr.user_id == USER && vlr.record_id == EXTRA_BYTES)
            .flat_map(|vlr| vlr.data.as_chunks::<DESCRIPTOR>().0);
        let mut before_end = usize::from(header.point_format().extra_bytes);
        let mut names = vec![INTENSITY.to_owned()];
        for descriptor in bytes.map(Descriptor) {
            let found = descriptor.dimension(before_end);
            let Some(rest) = before_end.checked_sub(descriptor.size()) else {
                break;
            };
            before_end = rest;
            let Some(found) = found else { continue };
            if descriptor.name() == name {
                return Ok(Self::Extra(found));
            }
            names.push(descriptor.name());
        }
        Err(Fault::no_column(name, names.iter().map(String::as_str)))
    }

    /// The numbers of records, not a number where there is none.
    pub(super) fn values<'a>(
        &'a self,
        records: &'a PointData,
    ) -> Box<dyn Iterator<Item = f64> + 'a> {
        match self {
            Self::Intensity => Box::new(records.intensity().map(f64::from)),
            Self::Extra(extra) => {
                let length = records.record_len();
                let start = length.saturating_sub(extra.before_end);
                let each = records.raw_bytes().chunks_exact(length);
                Box::new(each.map(move |record| extra.value(&record[start..])))
            }
        }
    }
}

impl Extra {
    fn value(&self, bytes: &[u8]) -> f64 {
        let number = self.kind.number(bytes);
        if self.none == Some(number) {
            return f64::NAN;
        }
        self.offset + self.scale * number
    }
}
