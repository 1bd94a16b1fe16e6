//! Rims and holes: where the data ends.
//!
//! The known extent of a surface is what no empty disc reaches: a disc in the tangent plane, of a few
//! spacings' radius, that touches a point and holds none (the alpha shape of Edelsbrunner,
//! Kirkpatrick, Seidel 1983). In an evenly sampled sheet such a disc does not fit anywhere; along a
//! rim it rolls. A path may sink into an empty disc only against a force.

use rayon::prelude::*;

use crate::Vector;
use crate::surface::atlas::Lists;
use crate::surface::atlas::chart::Chart;

/// Radius of the discs in spacings: holes narrower than twice that are not seen.
pub(crate) const DISC_SPACINGS: f64 = 2.5;
/// Fewer discs than this that reach one another are a thin spot in the sampling: a hole wide enough for
/// a disc has a rim of six of its radii.
const FEWEST: usize = 6;
/// Directions in which a disc may touch a point.
const DIRECTIONS: usize = 24;

/// An empty disc at the rim.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Disc<const D: usize> {
    pub centre: Vector<D>,
    /// Unit direction from the point it touches to the centre.
    pub outward: Vector<D>,
    pub radius: f64,
    /// Distance between neighbouring points there.
    pub spacing: f64,
}

impl<const D: usize> Disc<D> {
    /// How deep `x` lies in the disc, and the direction inwards: towards the centre in the half at the
    /// rim, outwards beyond, so that no point is pushed through to the other side.
    pub fn depth(&self, x: &Vector<D>) -> Option<(f64, Vector<D>)> {
        let offset = self.centre - x;
        let distance = offset.norm();
        if distance >= self.radius {
            return None;
        }
        let past = -offset.dot(&self.outward);
        if past > 0.0 || distance == 0.0 {
            return Some((self.radius - distance + 2.0 * past, self.outward));
        }
        Some((self.radius - distance, offset / distance))
    }
}

/// The empty discs at each chart's points, in the chart's list.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rim<const D: usize> {
    starts: Vec<u32>,
    discs: Vec<Disc<D>>,
}

impl<const D: usize> Rim<D> {
    /// Rolls the discs round every point. For surfaces (k = 2); on curves and solids no rim is known.
    /// `own` lists each chart's points.
    pub fn new(
        charts: &[Chart<D>],
        own: &[Vec<u32>],
        points: &[Vector<D>],
        neighbours: &Lists,
        intrinsic_dimension: usize,
    ) -> Self {
        if intrinsic_dimension != 2 {
            return Self {
                starts: vec![0; charts.len() + 1],
                discs: Vec::new(),
            };
        }
        let directions = directions();
        let lists: Vec<Vec<Disc<D>>> = (0..charts.len())
            .into_par_iter()
            .map(|i| {
                let lists = neighbours
                    .of(i as u32)
                    .iter()
                    .map(|j| own[*j as usize].as_slice());
                let near = lists.flatten();
                let flat: Vec<Flat> = near
                    .map(|p| flat(&charts[i], &points[*p as usize]))
                    .collect();
                // A chart at the rim has points on one side only, which makes them seem sparser.
                let spacings = neighbours
                    .of(i as u32)
                    .iter()
                    .map(|j| charts[*j as usize].spacing);
                let spacing = spacings.fold(f64::INFINITY, f64::min);
                // The chart itself is the first of its neighbours.
                let own = (0..own[i].len()).zip(&own[i]);
                let open = own.filter(|(place, _)| !enclosed(&charts[i], *place, &flat));
                let discs = open.filter_map(|(place, p)| {
                    let (x, y) = free_side(&charts[i], place, &flat, directions)?;
                    Some(disc(&charts[i], &points[*p as usize], x, y, spacing))
                });
                discs.collect()
            })
            .collect();
        let whole = chains(&lists, neighbours);
        let mut starts = vec![0];
        let mut discs = Vec::new();
        for (list, whole) in lists.iter().zip(whole) {
            let kept = list.iter().zip(whole).filter(|(_, size)| *size >= FEWEST);
            discs.extend(kept.map(|(disc, _)| *disc));
            starts.push(discs.len() as u32);
        }
        Self { starts, discs }
    }

    /// Whether the surface goes on everywhere.
    pub fn is_empty(&self) -> bool {
        self.discs.is_empty()
    }

    /// The discs at a chart's points.
    pub fn of(&self, chart: u32) -> &[Disc<D>] {
        let i = chart as usize;
        &self.discs[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    /// Estimated length of all rims: a spacing for every point on one.
    pub fn length(&self) -> f64 {
        self.discs.iter().fold(0.0, |sum, disc| sum + disc.spacing)
    }
}

/// For each disc the number of those that reach one another from it, each centre within the radius of
/// the next, itself included.
fn chains<const D: usize>(lists: &[Vec<Disc<D>>], neighbours: &Lists) -> Vec<Vec<usize>> {
    let mut sizes: Vec<Vec<usize>> = lists.iter().map(|list| vec![0; list.len()]).collect();
    for first in 0..lists.len() {
        for i in 0..lists[first].len() {
            if sizes[first][i] > 0 {
                continue;
            }
            let mut chain = vec![(first, i)];
            sizes[first][i] = 1;
            let mut next = 0;
            while let Some((chart, i)) = chain.get(next).copied() {
                next += 1;
                let disc = &lists[chart][i];
                for other in neighbours.of(chart as u32).iter().map(|c| *c as usize) {
                    for (j, there) in lists[other].iter().enumerate() {
                        let gap = (there.centre - disc.centre).norm();
                        if sizes[other][j] == 0 && gap <= disc.radius {
                            sizes[other][j] = 1;
                            chain.push((other, j));
                        }
                    }
                }
            }
            for (chart, i) in &chain {
                sizes[*chart][*i] = chain.len();
            }
        }
    }
    sizes
}

/// A point in a chart's tangent plane.
type Flat = (f64, f64);

fn flat<const D: usize>(chart: &Chart<D>, point: &Vector<D>) -> Flat {
    let offset = point - chart.origin;
    let along = |column: usize| offset.dot(&chart.frame.column(column));
    (along(D - 2), along(D - 1))
}

/// Whether there is a point near in each eighth of the plane round a point, which leaves no room for a
/// disc: one within half a right angle of the direction of its centre and nearer than the chord.
fn enclosed<const D: usize>(chart: &Chart<D>, place: usize, near: &[Flat]) -> bool {
    let chord = 1.99 * (DISC_SPACINGS * chart.spacing).powi(2);
    let origin = near[place];
    let mut eighths = 0_u8;
    for (x, y) in near {
        let (u, v) = (x - origin.0, y - origin.1);
        let squared = u * u + v * v;
        // Whether a point is near is a toss-up, and costs less without a branch.
        let near = u8::from(squared < chord) & u8::from(squared > 0.0);
        let eighth = u8::from(u < 0.0) | u8::from(v < 0.0) << 1 | u8::from(u.abs() < v.abs()) << 2;
        eighths |= near << eighth;
        if eighths == u8::MAX {
            return true;
        }
    }
    false
}

/// The unit direction amid those in which an empty disc touches a point, if there are any.
fn free_side<const D: usize>(
    chart: &Chart<D>,
    place: usize,
    near: &[Flat],
    mut free: [(f64, f64, bool); DIRECTIONS],
) -> Option<Flat> {
    let radius = DISC_SPACINGS * chart.spacing;
    let origin = near[place];
    let mut left = DIRECTIONS;
    for (i, (x, y)) in near.iter().enumerate() {
        let (u, v) = (x - origin.0, y - origin.1);
        let squared = u * u + v * v;
        if i == place || squared >= 4.0 * radius * radius {
            continue;
        }
        for (x, y, empty) in &mut free {
            if *empty && squared < 2.0 * radius * (u * *x + v * *y) {
                *empty = false;
                left -= 1;
            }
        }
        if left == 0 {
            return None;
        }
    }
    let (x, y) = free
        .iter()
        .filter(|f| f.2)
        .fold((0.0, 0.0), |(x, y), f| (x + f.0, y + f.1));
    let norm = x.hypot(y);
    // Empty all round: a lone point bounds nothing.
    (norm >= 1e-9).then(|| (x / norm, y / norm))
}

/// The disc that touches a point in a direction of the chart's plane.
fn disc<const D: usize>(
    chart: &Chart<D>,
    point: &Vector<D>,
    x: f64,
    y: f64,
    spacing: f64,
) -> Disc<D> {
    let radius = DISC_SPACINGS * chart.spacing;
    let outward = chart.frame.column(D - 2) * x + chart.frame.column(D - 1) * y;
    Disc {
        centre: point + outward * radius,
        outward,
        radius,
        spacing,
    }
}

/// Unit directions, all marked as empty.
fn directions() -> [(f64, f64, bool); DIRECTIONS] {
    std::array::from_fn(|i| {
        let angle = std::f64::consts::TAU * i as f64 / DIRECTIONS as f64;
        (angle.cos(), angle.sin(), true)
    })
}
