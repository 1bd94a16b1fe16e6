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
                let near: Vec<&[u32]> = lists.collect();
                // A chart at the rim has points on one side only, which makes them seem sparser.
                let spacings = neighbours
                    .of(i as u32)
                    .iter()
                    .map(|j| charts[*j as usize].spacing);
                let spacing = spacings.fold(f64::INFINITY, f64::min);
                let discs = own[i].iter();
                let discs = discs.filter_map(|p| disc(&charts[i], *p, &near, points, directions));
                discs.map(|disc| Disc { spacing, ..disc }).collect()
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

/// The disc amid the empty directions at a point, if there is one.
fn disc<const D: usize>(
    chart: &Chart<D>,
    point: u32,
    near: &[&[u32]],
    points: &[Vector<D>],
    mut free: [(f64, f64, bool); DIRECTIONS],
) -> Option<Disc<D>> {
    let m = D - 2;
    let radius = DISC_SPACINGS * chart.spacing;
    let origin = points[point as usize];
    let mut left = DIRECTIONS;
    for other in near.iter().flat_map(|list| list.iter()) {
        let offset = points[*other as usize] - origin;
        let u = offset.dot(&chart.frame.column(m));
        let v = offset.dot(&chart.frame.column(m + 1));
        let squared = u * u + v * v;
        if *other == point || squared >= 4.0 * radius * radius {
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
    if norm < 1e-9 {
        // Empty all round: a lone point bounds nothing.
        return None;
    }
    let outward = chart.frame.column(m) * (x / norm) + chart.frame.column(m + 1) * (y / norm);
    Some(Disc {
        centre: origin + outward * radius,
        outward,
        radius,
        spacing: chart.spacing,
    })
}

/// Unit directions, all marked as empty.
fn directions() -> [(f64, f64, bool); DIRECTIONS] {
    std::array::from_fn(|i| {
        let angle = std::f64::consts::TAU * i as f64 / DIRECTIONS as f64;
        (angle.cos(), angle.sin(), true)
    })
}
