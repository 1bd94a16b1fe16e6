//! Samples of an implicit surface, grown from starts.
//!
//! Each sample throws candidates one spacing away along the surface; a candidate is kept unless a
//! sample of the same sheet lies too near (dart throwing by expansion: Bridson, "Fast Poisson Disk
//! Sampling in Arbitrary Dimensions", SIGGRAPH 2007 sketches). The spacing shrinks where the
//! surface curves.

use std::collections::HashMap;

use crate::guess::sampling::MANY_DIMENSIONS;
use crate::guess::sampling::join::is_foretold;
use crate::guess::sampling::region::Region;
use crate::guess::sampling::walk::{Walker, is_clear};
use crate::surface::Surface;
use crate::surface::implicit::{Equations, ImplicitSurface};
use crate::{Matrix, Vector};

/// A sample: its point, its normal and tangent frame, and the spacing there.
#[derive(Clone, Debug)]
pub(super) struct Sample<const D: usize> {
    pub point: Vector<D>,
    /// An orthonormal basis: columns 0..m are normal, m..D tangent.
    pub basis: Matrix<D>,
    /// The spacing of samples here, in the input's units.
    pub spacing: f64,
    /// The spacing that the surface's turning alone would give, in the input's units.
    pub by_turning: f64,
    /// Distance to the next sheet, as far as it was looked for, in the input's units.
    pub gap: f64,
    /// Whether the surface goes on from here to where there is no sample.
    pub open: bool,
}

/// The samples that were grown.
pub(super) struct Grown<const D: usize> {
    pub samples: Vec<Sample<D>>,
    /// Pairs of samples with a walk from one to the other.
    pub links: Vec<[u32; 2]>,
    /// Whether the surface goes on beyond the region.
    pub clipped: bool,
    /// Whether the growth was stopped before it ended by itself.
    pub stopped: bool,
}

/// Number of samples at which growth stops, in up to three dimensions.
const MOST_SAMPLES: usize = 6000;
/// Number of samples at which growth stops in four and more dimensions, where no number of samples
/// covers a surface: these only suggest ways.
const MOST_SUGGESTIONS: usize = 400;
/// Most that the surface turns within one spacing in four and more dimensions, in radians, before
/// the factor for the dimension.
const WIDE_TURNING: f64 = 1.0;
/// Most that the surface turns within one spacing in up to three dimensions, in radians.
const SAMPLE_TURNING: f64 = 0.6;
/// The least spacing, as a share of the mean so far: sharp edges and tips must not take all
/// samples.
const FINEST: f64 = 0.25;
/// Least distance between two samples of one sheet, as a share of the smaller spacing.
const EXCLUSION: f64 = 0.7;
/// Number of candidates thrown per sample and tangent dimension, in three and more dimensions.
const THROWS: usize = 5;

/// Grows samples of the given spacing from the starts; a start is used only where no sample is near
/// it.
pub(super) fn grow<const D: usize, E: Equations<D>>(
    surface: &ImplicitSurface<D, E>,
    starts: &[Vector<D>],
    region: &Region<D>,
    spacing: f64,
) -> Grown<D> {
    let k = surface.intrinsic_dimension();
    let most = if k < MANY_DIMENSIONS {
        MOST_SAMPLES
    } else {
        MOST_SUGGESTIONS
    };
    let mut found = Thrown {
        walker: Walker::new(surface),
        samples: Vec::new(),
        buckets: HashMap::new(),
        spacing,
        sum: 0.0,
    };
    let mut links = Vec::new();
    let mut clipped = false;
    let mut next = 0;
    for start in starts {
        found.keep(start);
        while next < found.samples.len() && found.samples.len() < most {
            let from = found.samples[next].clone();
            for direction in directions::<D>(k, next) {
                let mut tangent = Vector::zeros();
                for j in 0..k {
                    tangent += from.basis.column(D - k + j) * direction[j];
                }
                let point = found
                    .walker
                    .shoot(&from.point, &tangent, from.spacing, from.gap);
                let end = point.and_then(|point| {
                    let inside = region.holds(&point);
                    clipped |= !inside;
                    inside.then(|| found.keep(&point)).flatten()
                });
                // Where no sample can be put, the surface goes on unsampled.
                match end {
                    Some(end) => links.push([next as u32, end]),
                    None => found.samples[next].open = true,
                }
            }
            next += 1;
        }
    }
    let stopped = next < found.samples.len();
    for sample in &mut found.samples[next..] {
        sample.open = true;
    }
    Grown {
        samples: found.samples,
        links,
        clipped,
        stopped,
    }
}

/// The sample at a point of the surface, its gap not yet looked for; `None` where there is no
/// tangent space.
pub(super) fn measure<const D: usize, E: Equations<D>>(
    walker: &mut Walker<'_, D, E>,
    point: &Vector<D>,
    spacing: f64,
) -> Option<Sample<D>> {
    if !walker.look(point) {
        return None;
    }
    let k = walker.scratch.intrinsic_dimension();
    // The bound of the curvature adds up the normal curvatures of all directions.
    let turning = if k < MANY_DIMENSIONS {
        SAMPLE_TURNING
    } else {
        WIDE_TURNING * (k as f64).sqrt()
    };
    let by_turning = turning / walker.scratch.curvature_bound();
    Some(Sample {
        point: *point,
        basis: walker.scratch.basis,
        spacing: by_turning.min(spacing),
        by_turning,
        gap: f64::INFINITY,
        open: false,
    })
}

/// Whether the normals at two points agree well enough for the points to lie on one sheet.
pub(super) fn same_side<const D: usize>(a: &Matrix<D>, b: &Matrix<D>, m: usize) -> bool {
    (0..m).all(|i| {
        let normal = a.column(i);
        let kept: f64 = (0..m).map(|j| normal.dot(&b.column(j)).powi(2)).sum();
        kept > 0.1 && (m > 1 || normal.dot(&b.column(0)) > 0.0)
    })
}

/// Unit directions in k dimensions, spread by a low-discrepancy sequence that differs from sample
/// to sample.
fn directions<const D: usize>(k: usize, sample: usize) -> Vec<[f64; D]> {
    let mut all = Vec::new();
    if k == 1 {
        for sign in [1.0, -1.0] {
            let mut direction = [0.0; D];
            direction[0] = sign;
            all.push(direction);
        }
        return all;
    }
    if k == 2 {
        let turn = 0.61803398875 * sample as f64;
        for i in 0..7 {
            let angle = std::f64::consts::TAU * (i as f64 / 7.0 + turn);
            let mut direction = [0.0; D];
            (direction[1], direction[0]) = angle.sin_cos();
            all.push(direction);
        }
        return all;
    }
    // These are Gaussian deviates by Box-Muller from a fixed generator.
    let mut state = 0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(sample as u64 + 1);
    let mut uniform = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        ((state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    };
    for _ in 0..THROWS * k {
        let mut direction = [0.0; D];
        for value in &mut direction[..k] {
            *value = (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos();
        }
        let norm = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        for value in &mut direction {
            *value /= norm;
        }
        all.push(direction);
    }
    all
}

/// Samples in buckets of their first three coordinates.
struct Thrown<'a, const D: usize, E> {
    walker: Walker<'a, D, E>,
    samples: Vec<Sample<D>>,
    buckets: HashMap<[i64; 3], Vec<u32>>,
    spacing: f64,
    /// Sum of the spacings that turning and `spacing` alone would give the samples.
    sum: f64,
}

impl<const D: usize, E: Equations<D>> Thrown<'_, D, E> {
    /// The bucket that holds a point.
    fn bucket(&self, x: &Vector<D>) -> [i64; 3] {
        std::array::from_fn(|i| {
            if i < D {
                (x[i] / self.spacing).floor() as i64
            } else {
                0
            }
        })
    }

    /// The sample at a point: one that crowds its sheet there, or a new one. `None` where there can
    /// be none.
    fn keep(&mut self, point: &Vector<D>) -> Option<u32> {
        let mut sample = measure(&mut self.walker, point, self.spacing)?;
        let natural = sample.spacing;
        let mean = self.sum / self.samples.len().max(1) as f64;
        sample.spacing = natural.max(FINEST * mean);
        let crowding = self.crowding(&sample);
        if crowding.is_some() {
            return crowding;
        }
        if !self.walker.look(point) {
            return None;
        }
        sample.gap = self
            .walker
            .gap(point, sample.spacing.min(sample.by_turning));
        self.sum += natural;
        let bucket = self.bucket(point);
        let index = self.samples.len() as u32;
        self.buckets.entry(bucket).or_default().push(index);
        self.samples.push(sample);
        Some(index)
    }

    /// A sample that lies too near on the same sheet.
    fn crowding(&mut self, sample: &Sample<D>) -> Option<u32> {
        let [x, y, z] = self.bucket(&sample.point);
        let geometry = self.walker.scratch.clone();
        let codimension = geometry.codimension;
        for i in -1..=1 {
            for j in -1..=1 {
                for l in -1..=1 {
                    let Some(list) = self.buckets.get(&[x + i, y + j, z + l]) else {
                        continue;
                    };
                    for index in list {
                        let other = &self.samples[*index as usize];
                        let apart = EXCLUSION * sample.spacing.min(other.spacing);
                        let offset = other.point - sample.point;
                        if offset.norm_squared() < apart * apart
                            && same_side(&sample.basis, &other.basis, codimension)
                            && (is_clear(&offset, other.gap)
                                || is_foretold(&geometry, sample, other)
                                    && self.walker.walks(&other.point, &sample.point, other.gap))
                        {
                            return Some(*index);
                        }
                    }
                }
            }
        }
        None
    }
}
