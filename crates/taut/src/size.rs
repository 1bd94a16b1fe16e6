//! The dimension of space becomes a type.

/// Calls a function with the smallest size of vectors that holds `dimension` coordinates;
/// `$otherwise` makes an error of a number of coordinates that none holds. Each size costs a minute
/// of compilation, and a padded coordinate costs a question some of its speed.
#[doc(hidden)]
#[macro_export]
macro_rules! by_size {
    ($dimension:expr, $otherwise:expr, $function:ident $(<$further:ident>)? ($($arguments:tt)*)) => {
        match $dimension {
            1..=3 => $function::<3 $(, $further)?>($($arguments)*),
            4..=6 => $function::<6 $(, $further)?>($($arguments)*),
            7..=16 => $function::<16 $(, $further)?>($($arguments)*),
            found => Err($otherwise(found)),
        }
    };
}

use taut_core::Vector;

use crate::Error;

/// The dimension of a surface that was asked for, or else that of a surface in space.
///
/// # Errors
/// [`Error::Dimension`].
pub fn intrinsic_dimension<const D: usize>(
    asked: Option<usize>,
    coordinates: usize,
) -> Result<usize, Error> {
    let most = coordinates.min(D - 1);
    let usual = (2..=3).contains(&coordinates).then_some(2);
    let found = asked.or(usual);
    let fits = found.filter(|found| (1..=most).contains(found));
    fits.ok_or(Error::Dimension {
        found,
        most,
        coordinates,
    })
}

/// A point in the engine's size, padded with zeros.
#[must_use]
pub fn padded<const D: usize>(point: &[f64]) -> Vector<D> {
    let mut vector = Vector::<D>::zeros();
    vector.as_mut_slice()[..point.len()].copy_from_slice(point);
    vector
}

/// The coordinates of a vector without its padding.
#[must_use]
pub fn coordinates<const D: usize>(vector: &Vector<D>, dimension: usize) -> Vec<f64> {
    vector.as_slice()[..dimension].to_vec()
}

/// The coordinates of vectors about an origin, row-major and without their padding.
#[must_use]
pub fn flat<const D: usize>(
    vectors: &[Vector<D>],
    origin: &Vector<D>,
    dimension: usize,
) -> Vec<f64> {
    let moved = vectors.iter().map(|vector| vector + origin);
    moved
        .flat_map(|vector| coordinates(&vector, dimension))
        .collect()
}
