//! Loops on all threads whose results come in order, whatever the number of threads.
//!
//! Closures are called through a reference: rayon's adapters, compiled anew for each closure on
//! each size of surface, were more than half of all code.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

/// Number of parts of a loop for each thread; there are many, because some take longer than others.
const PARTS: usize = 32;

/// The values of a function at 0 to `count - 1`.
pub fn map<T: Send>(count: usize, value: impl Fn(usize) -> T + Sync) -> Vec<T> {
    in_parts(count, &|range, values| {
        for i in range {
            values.push(value(i));
        }
    })
}

/// The values of a function at 0 to `count - 1`, as [`map`] gives them, with scratch space for the
/// function. The space is made anew for each part of the loop, and values must not depend on it.
pub fn map_with<S, T: Send>(
    count: usize,
    scratch: impl Fn() -> S + Sync,
    value: impl Fn(&mut S, usize) -> T + Sync,
) -> Vec<T> {
    in_parts(count, &|range, values| {
        let mut scratch = scratch();
        for i in range {
            values.push(value(&mut scratch, i));
        }
    })
}

/// The values that a function adds for each part of 0 to `count - 1`, in order.
fn in_parts<T: Send>(count: usize, add: &(dyn Fn(Range<usize>, &mut Vec<T>) + Sync)) -> Vec<T> {
    let parts = count.min(PARTS * rayon::current_num_threads());
    let found: Vec<Mutex<Vec<T>>> = (0..parts).map(|_| Mutex::default()).collect();
    for_each(parts, &|part| {
        let range = part * count / parts..(part + 1) * count / parts;
        let mut values = Vec::with_capacity(range.len());
        add(range, &mut values);
        *found[part].lock().unwrap_or_else(PoisonError::into_inner) = values;
    });
    let mut all = Vec::with_capacity(count);
    for part in found {
        all.append(&mut part.into_inner().unwrap_or_else(PoisonError::into_inner));
    }
    all
}

/// Does something for each of 0 to `count - 1`.
pub fn for_each(count: usize, act: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().for_each(act);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_in_order() {
        for count in [0, 1, 7, 1000] {
            let squares: Vec<usize> = (0..count).map(|i| i * i).collect();
            assert_eq!(map(count, |i| i * i), squares);
            let found = map_with(count, Vec::new, |seen, i| {
                seen.push(i);
                i * seen[seen.len() - 1]
            });
            assert_eq!(found, squares);
        }
    }
}
