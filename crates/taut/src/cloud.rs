//! A point cloud ready for work: finite, distinct, centred points, and the way back to the input rows.

use rayon::prelude::*;

use crate::Vector;
use crate::error::Error;

/// Finite, distinct points of R^D about their centre, with the map to and from input rows.
#[derive(Clone, Debug)]
pub struct Cloud<const D: usize> {
    /// Distinct finite points minus [`centre`](Self::centre), in input order.
    pub points: Vec<Vector<D>>,
    /// What was subtracted: large map coordinates lose no digits in what follows.
    pub centre: Vector<D>,
    /// The first input row of each point.
    pub rows: Vec<u32>,
    /// The point of each input row; `None` for rows with a value that is not finite.
    pub point_of_row: Vec<Option<u32>>,
    /// Rows dropped because a value is not finite.
    pub non_finite: usize,
    /// Rows that repeat an earlier row's coordinates.
    pub duplicates: usize,
}

impl<const D: usize> Cloud<D> {
    /// Sorts out input rows of `dimension` <= D coordinates each (missing coordinates are zero, which
    /// changes no distance).
    ///
    /// # Errors
    /// [`Error::TooFewPoints`] below 2 finite rows, [`Error::AllCoincide`] if all are one point,
    /// [`Error::TooManyPoints`] past 2^32 - 1 rows.
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
            .into_par_iter()
            .map(|i| (row(i), i as u32))
            .filter(|(point, _)| point.iter().all(|v| v.is_finite()))
            .collect();
        let non_finite = count - finite.len();
        if finite.len() < 2 {
            return Err(Error::TooFewPoints {
                found: finite.len(),
                needed: 2,
            });
        }
        finite.par_sort_unstable_by(|a, b| {
            let order =
                a.0.iter()
                    .zip(b.0.iter())
                    .map(|(x, y)| x.total_cmp(&(y + 0.0)));
            order
                .fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
                .then(a.1.cmp(&b.1))
        });
        // The first row of each run of equal points stands for all of them.
        let mut representative = vec![u32::MAX; count];
        let mut first = finite[0];
        let mut distinct = 0;
        for (point, index) in &finite {
            if *point != first.0 || *index == first.1 {
                first = (*point, *index);
                distinct += 1;
            }
            representative[*index as usize] = first.1;
        }
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
            duplicates,
        })
    }
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
