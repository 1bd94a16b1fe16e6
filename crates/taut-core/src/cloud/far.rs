//! Rows that lie so far off that the other rows lose their digits beside them.

use crate::Vector;

/// Ratio of distances from which on a row belongs no longer to the cloud: it lies this many times
/// as far off as all that are nearer. Rounding so far out is 1e-9 of the extent of the other rows,
/// coarser than any of their lengths is asked for.
const FAR_RATIO: f64 = 1e7;
/// The rows of the smallest coordinates, one in this many, tell where the cloud is: values that
/// stand for missing data are larger than the data.
const SMALLEST_ROWS: usize = 10;
/// Least number of the nearer rows, or half of the rows where there are fewer.
const FEW: usize = 8;

/// Leaves out the rows beyond a gap across which the nearer rows cannot be told apart to the digits
/// that lengths are found to. It leaves out more than half of the rows only where all of those left
/// out hold one and the same largest value, which stands for missing data.
pub(super) fn leave_out<const D: usize>(rows: &mut Vec<(Vector<D>, u32)>) {
    let Some(farthest) = bound(rows) else {
        return;
    };
    let home = home(rows);
    let is_far = |row: &(Vector<D>, u32)| distance(&row.0, &home) > farthest;
    let mut values = rows
        .iter()
        .filter(|row| is_far(row))
        .map(|row| row.0.amax());
    let first = values.next();
    let count = 1 + values.clone().count();
    if 2 * count <= rows.len() || values.all(|value| Some(value) == first) {
        rows.retain(|row| !is_far(row));
    }
}

/// The largest distance from [`home`] of the rows to be kept; `None` where all are kept.
fn bound<const D: usize>(rows: &[(Vector<D>, u32)]) -> Option<f64> {
    if rows.len() < 3 {
        return None;
    }
    let least = (rows.len() / SMALLEST_ROWS).max(FEW.min(rows.len() / 2));
    let home = home(rows);
    let mut distances: Vec<f64> = rows.iter().map(|row| distance(&row.0, &home)).collect();
    let farthest = distances.iter().copied().fold(0.0, f64::max);
    let (_, nearer, _) = distances.select_nth_unstable_by(least - 1, f64::total_cmp);
    // If there is no gap as wide between that row and the farthest, there is none anywhere.
    if farthest <= FAR_RATIO * *nearer {
        return None;
    }
    distances.sort_unstable_by(f64::total_cmp);
    let beyond = |pair: &[f64]| pair[0] > 0.0 && pair[1] > FAR_RATIO * pair[0];
    let gaps = distances.windows(2).enumerate().skip(least - 1);
    let mut gaps = gaps.filter(|(_, pair)| beyond(pair));
    gaps.next().map(|(_, pair)| pair[0])
}

/// The median, coordinate by coordinate, of the rows of the smallest coordinates.
fn home<const D: usize>(rows: &[(Vector<D>, u32)]) -> Vector<D> {
    let mut sizes: Vec<f64> = rows.iter().map(|row| row.0.amax()).collect();
    let few = (rows.len() / SMALLEST_ROWS).min(rows.len() - 1);
    let small = *sizes.select_nth_unstable_by(few, f64::total_cmp).1;
    let smallest = rows.iter().filter(|row| row.0.amax() <= small);
    let smallest: Vec<&Vector<D>> = smallest.map(|row| &row.0).collect();
    let middle = smallest.len() / 2;
    Vector::from_fn(|axis, _| {
        let mut column: Vec<f64> = smallest.iter().map(|point| point[axis]).collect();
        *column.select_nth_unstable_by(middle, f64::total_cmp).1
    })
}

/// The largest difference of coordinates, which is finite or infinite but always a number.
fn distance<const D: usize>(a: &Vector<D>, b: &Vector<D>) -> f64 {
    (a - b).amax()
}

#[cfg(test)]
mod tests {
    use crate::Vector;
    use crate::cloud::Cloud;

    /// Points of the unit sphere on a spiral.
    fn sphere(count: usize) -> Vec<f64> {
        let point = |i: usize| {
            let z = 1.0 - (2 * i + 1) as f64 / count as f64;
            let (sin, cos) = (2.399_963 * i as f64).sin_cos();
            let radius = (1.0 - z * z).sqrt();
            [radius * cos, radius * sin, z]
        };
        (0..count).flat_map(point).collect()
    }

    #[test]
    fn values_for_missing_data_are_left_out_and_counted() {
        for value in [-3.402_823_5e38, -1.797_693e308, 1e30, -1e32, f64::MAX] {
            for spoilt in [vec![0], vec![7, 19], (5..40).collect::<Vec<usize>>()] {
                let mut rows = sphere(200);
                spoilt.iter().for_each(|i| rows[3 * i + 2] = value);
                let cloud = Cloud::<3>::new(&rows, 3).expect("a cloud");
                assert_eq!(
                    (cloud.far, cloud.points.len()),
                    (spoilt.len(), 200 - spoilt.len())
                );
                assert!(cloud.centre.norm() < 0.2);
                let left = (0..200).filter(|i| cloud.point_of_row[*i].is_none());
                assert!(left.eq(spoilt.iter().copied()), "{value:e}");
            }
        }
    }

    #[test]
    fn most_rows_may_miss_their_height() {
        let mut rows = sphere(200);
        for row in rows.chunks_mut(3) {
            row[0] += 6.5e6;
        }
        (0..150).for_each(|i| rows[3 * i + 2] = -3.402_823_5e38);
        let cloud = Cloud::<3>::new(&rows, 3).expect("a cloud");
        assert_eq!((cloud.far, cloud.points.len()), (150, 50));
    }

    #[test]
    fn what_lies_far_off_with_digits_to_spare_is_kept() {
        // The far rows are a second sphere, a million radii off, of as few as one point; then there
        // are map coordinates.
        for (count, far) in [(1, 1e6), (50, 1e6), (200, 1e6), (3, 5e6)] {
            let mut rows = sphere(200);
            for row in sphere(count).chunks(3) {
                rows.extend([row[0] + far, row[1], row[2]]);
            }
            let cloud = Cloud::<3>::new(&rows, 3).expect("a cloud");
            assert_eq!((cloud.far, cloud.points.len()), (0, 200 + count), "{far:e}");
        }
        let moved: Vec<f64> = sphere(200).iter().map(|v| v + 1e12).collect();
        assert_eq!(Cloud::<3>::new(&moved, 3).expect("a cloud").far, 0);
        // Many rows repeat one place, and others lie about it at a distance of rounding.
        let mut heaped = vec![0.0; 180];
        heaped[3..30].fill(1e-12);
        heaped.extend(sphere(100));
        let cloud = Cloud::<3>::new(&heaped, 3).expect("a cloud");
        assert_eq!((cloud.far, cloud.rows[0]), (0, 0));
        assert_eq!(cloud.points[0], Vector::<3>::zeros() - cloud.centre);
    }
}
