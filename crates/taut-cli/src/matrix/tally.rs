//! How the pairs of a table came out.

use serde::{Deserialize, Serialize};
use taut_core::result::Status;

use crate::answer::{FoundPath, Outcome};
use crate::exit::Exit;

/// Counts of pairs, and the largest error among them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tally {
    pub pairs: u64,
    /// Pairs that nothing connects.
    pub no_path: u64,
    pub not_converged: u64,
    /// Pairs whose length or error is unknown, or whether they are connected.
    pub unknown: u64,
    /// Largest estimated error of a length, relative, among those known.
    pub largest_error: f64,
}

impl Tally {
    /// Counts a path.
    pub fn add(&mut self, path: &FoundPath) {
        self.pairs += 1;
        match path.outcome {
            Outcome::Asked(Status::NoPath) => {
                self.no_path += 1;
                return;
            }
            Outcome::Asked(Status::Converged) => {}
            _ => self.not_converged += 1,
        }
        let (length, error) = (length(path), error(path));
        if error.is_nan() {
            self.unknown += 1;
        } else if length > 0.0 {
            self.largest_error = self.largest_error.max(error / length);
        }
    }

    /// Both together.
    pub fn and(self, other: Self) -> Self {
        Self {
            pairs: self.pairs + other.pairs,
            no_path: self.no_path + other.no_path,
            not_converged: self.not_converged + other.not_converged,
            unknown: self.unknown + other.unknown,
            largest_error: self.largest_error.max(other.largest_error),
        }
    }

    pub fn exit(&self) -> Exit {
        if self.not_converged > 0 {
            Exit::NotConverged
        } else if self.no_path > 0 {
            Exit::NoPath
        } else {
            Exit::Success
        }
    }
}

/// The length of a path as a table has it: infinite where nothing connects the ends, not a number
/// where it is unknown.
pub fn length(path: &FoundPath) -> f64 {
    match path.outcome {
        Outcome::Asked(Status::NoPath) => f64::INFINITY,
        _ => path.length.unwrap_or(f64::NAN),
    }
}

/// The estimated error of the length, of path and surface together; not a number where it is
/// unknown or nothing connects the ends.
pub fn error(path: &FoundPath) -> f64 {
    let both = path.length.and(path.length_error).zip(path.surface_error);
    both.map_or(f64::NAN, |(path, surface)| path + surface)
}
