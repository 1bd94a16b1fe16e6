//! Lists of pairs, sites and numbers.

use taut_io::{Pairs, Sources, read_numbers, read_pairs_from, read_sources};

use crate::readers::in_file;

pub fn lists(bytes: &[u8]) {
    match read_pairs_from(bytes, "pairs") {
        Ok(Pairs::Indices(pairs)) => {
            assert!(!pairs.is_empty() && 4 * pairs.len() <= bytes.len() + 1)
        }
        Ok(Pairs::Coordinates { dimension, values }) => {
            assert!(dimension >= 2 && !values.is_empty());
            assert_eq!(values.len() % (2 * dimension), 0);
            assert!(2 * values.len() <= bytes.len() + 1);
            assert!(values.iter().all(|value| value.is_finite()));
        }
        Err(error) => assert!(error.to_string().contains("pairs"), "{error}"),
    }
    for suffix in [".txt", ".csv"] {
        in_file(suffix, bytes, |file| match read_sources(file) {
            Ok(Sources::Rows(rows)) => {
                assert!(2 * rows.len() <= bytes.len() + 1);
            }
            Ok(Sources::Points(points)) => {
                assert!(points.dimension >= 2 && points.rows() > 0);
                assert!(points.coordinates.len() <= bytes.len());
            }
            Err(error) => assert!(error.to_string().contains(suffix), "{error}"),
        });
    }
    in_file(".txt", bytes, |file| match read_numbers(file) {
        Ok(numbers) => {
            assert!(numbers.columns >= 1 && !numbers.values.is_empty());
            assert_eq!(numbers.values.len() % numbers.columns, 0);
            assert!(2 * numbers.values.len() <= bytes.len() + 1);
            assert!(numbers.values.iter().all(|value| !value.is_nan()));
        }
        Err(error) => assert!(error.to_string().contains(".txt"), "{error}"),
    });
}
