//! A point cloud ready for work: finite, distinct, centred points, and the way back to the input
//! rows.
//!
//! Rows with a value that is not finite are dropped, rows that lie far too far off are left out
//! (`far`), and repeated rows are merged. The points are moved so that the centre of their box is
//! the origin.

use rayon::slice::ParallelSliceMut;

use crate::error::Error;
use crate::{Vector, parallel};

mod far;

/// Extents of clouds, in the input's units, whose lengths can be squared and multiplied without
/// leaving the range of numbers.
const EXTENTS: std::ops::RangeInclusive<f64> = 1e-50..=1e50;

/// Finite, distinct points of R^D about their centre, with the maps to and from input rows.
#[derive(Clone, Debug)]
pub struct Cloud<const D: usize> {
    /// The distinct finite points minus [`centre`](Self::centre), in input order.
    pub points: Vec<Vector<D>>,
    /// The vector that was subtracted from the rows, so that large map coordinates lose no digits
    /// in what follows.
    pub centre: Vector<D>,
    /// The first input row of each point.
    pub rows: Vec<u32>,
    /// The point of each input row; `None` for rows with a value that is not finite and for those
    /// left out as too far.
    pub point_of_row: Vec<Option<u32>>,
    /// The number of rows dropped because a value is not finite.
    pub non_finite: usize,
    /// The number of rows left out because they lie so far off that the other rows would lose their
    /// digits beside them: 1e7 times as far as any of the others. Values that stand for missing
    /// data, such as -3.4e38, are found in this way.
    pub far: usize,
    /// The number of rows that repeat an earlier row's coordinates.
    pub duplicates: usize,
}

impl<const D: usize> Cloud<D> {
    /// Sorts out input rows of `dimension` <= D coordinates each; missing coordinates are zero,
    /// which changes no distance.
    ///
    /// # Errors
    /// [`Error::TooFewPoints`] below 2 finite rows, [`Error::AllCoincide`] if all are one point,
    /// [`Error::TooManyPoints`] past 2^32 - 1 rows. [`Error::BadExtent`] if the rows reach less far
    /// than 1e-50 or farther than 1e50, because squares and products of lengths must not overflow.
    ///
    /// O(n log n).
    pub fn new(coordinates: &[f64], dimension: usize) -> Result<Self, Error> {
        assert!(
            dimension <= D && dimension > 0,
            "1 to {D} coordinates per row"
        );
        let count = coordinates.len() / dimension;
        if u32::try_from(count).is_err() || count == u32::MAX as usize {
            return Err(Error::TooManyPoints { found: count });
        }
        let row = |i: usize| {
            let mut point = Vector::<D>::zeros();
            point.as_mut_slice()[..dimension]
                .copy_from_slice(&coordinates[i * dimension..(i + 1) * dimension]);
            point
        };
        let mut finite: Vec<(Vector<D>, u32)> = (0..count)
            .map(|i| (row(i), i as u32))
            .filter(|(point, _)| point.iter().all(|v| v.is_finite()))
            .collect();
        let non_finite = count - finite.len();
        far::leave_out(&mut finite);
        let far = count - non_finite - finite.len();
        if finite.len() < 2 {
            return Err(Error::TooFewPoints {
                found: finite.len(),
                needed: 2,
            });
        }
        let representative = representatives(&finite, count);
        let distinct = finite
            .iter()
            .filter(|(_, index)| representative[*index as usize] == *index)
            .count();
        let duplicates = finite.len() - distinct;
        if distinct < 2 {
            return Err(Error::AllCoincide {
                found: finite.len(),
            });
        }
        let (mut low, mut high) = (finite[0].0, finite[0].0);
        for (point, _) in &finite {
            low = low.inf(point);
            high = high.sup(point);
        }
        let extent = high.zip_fold(&low, 0.0, |most: f64, high, low| most.max(high - low));
        if !EXTENTS.contains(&extent) {
            return Err(Error::BadExtent { found: extent });
        }
        let centre = low + (high - low) * 0.5;
        let mut rows = Vec::with_capacity(distinct);
        let mut points = Vec::with_capacity(distinct);
        let mut point_of_row = vec![None; count];
        for i in 0..count {
            let first = representative[i];
            if first == i as u32 {
                point_of_row[i] = Some(rows.len() as u32);
                points.push(row(i) - centre);
                rows.push(i as u32);
            } else if first != u32::MAX {
                point_of_row[i] = point_of_row[first as usize];
            }
        }
        Ok(Self {
            points,
            centre,
            rows,
            point_of_row,
            non_finite,
            far,
            duplicates,
        })
    }
}

impl<const D: usize> Cloud<D> {
    /// Why a row has no point, in words for a message.
    pub(crate) fn why_dropped(&self) -> &'static str {
        match (self.non_finite, self.far) {
            (_, 0) => "the row was dropped because a value is not finite",
            (0, _) => "the row was left out because it lies 1e7 times as far off as the others",
            _ => {
                "the row was left out because a value is not finite or it lies 1e7 times as far off as the others"
            }
        }
    }
}

/// For each of `count` rows, the first row of the same coordinates among those given, in order;
/// `u32::MAX` for rows that are not given. Equal rows meet where the rows are sorted by a hash of
/// their coordinates.
fn representatives<const D: usize>(finite: &[(Vector<D>, u32)], count: usize) -> Vec<u32> {
    let mut hashed = parallel::map(finite.len(), |i| (hash(&finite[i].0), i as u32));
    hashed.par_sort_unstable();
    let mut representative = vec![u32::MAX; count];
    for alike in hashed.chunk_by(|a, b| a.0 == b.0) {
        for (i, (_, place)) in alike.iter().enumerate() {
            let (point, index) = &finite[*place as usize];
            let earlier = alike[..i].iter().map(|(_, place)| &finite[*place as usize]);
            let first = earlier.into_iter().find(|other| other.0 == *point);
            representative[*index as usize] = first.map_or(*index, |other| other.1);
        }
    }
    representative
}

/// A hash of coordinates, equal for 0 and -0: the finaliser of MurmurHash3 (Appleby 2011) over
/// their bits.
fn hash<const D: usize>(point: &Vector<D>) -> u64 {
    point.iter().fold(0, |hash: u64, value| {
        let mut mixed = hash ^ (value + 0.0).to_bits();
        mixed = (mixed ^ (mixed >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
        mixed = (mixed ^ (mixed >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
        (mixed ^ (mixed >> 33)).wrapping_add(0x9e37_79b9_7f4a_7c15)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drops_counts_and_remembers() {
        let rows = [
            [5e6, 1.0],
            [f64::NAN, 0.0],
            [5e6 + 2.0, 1.0],
            [5e6, 1.0],
            [0.0, f64::INFINITY],
            [5e6, 3.0],
        ];
        let cloud = Cloud::<3>::new(&rows.concat(), 2).expect("good");
        assert_eq!((cloud.non_finite, cloud.duplicates), (2, 1));
        assert_eq!(cloud.rows, [0, 2, 5]);
        assert_eq!(
            cloud.point_of_row,
            [Some(0), None, Some(1), Some(0), None, Some(2)]
        );
        assert_eq!(cloud.centre, Vector::<3>::new(5e6 + 1.0, 2.0, 0.0));
        assert_eq!(cloud.points[2], Vector::<3>::new(-1.0, 1.0, 0.0));
    }

    #[test]
    fn sizes_whose_squares_are_no_numbers_are_refused() {
        for scale in [1e-300, 1e-60, 1e60, 1e300] {
            let rows = [0.0, 1.0, 2.0, 3.0, 1.0, 4.0].map(|v| v * scale);
            let refused = Cloud::<3>::new(&rows, 3).err();
            assert_eq!(refused, Some(Error::BadExtent { found: 3.0 * scale }));
        }
    }

    #[test]
    fn refuses_what_is_no_cloud() {
        assert!(matches!(
            Cloud::<3>::new(&[1.0, 2.0, 3.0], 3),
            Err(Error::TooFewPoints { found: 1, .. })
        ));
        assert!(matches!(
            Cloud::<3>::new(&[1.0; 30], 3),
            Err(Error::AllCoincide { found: 10 })
        ));
    }
}
