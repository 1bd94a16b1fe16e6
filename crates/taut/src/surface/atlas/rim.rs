//! Rims and holes: where the data ends.
//!
//! The known extent of a surface is what no empty disc reaches: a disc in the tangent plane, of a few
//! spacings' radius, that touches a point and holds none (the alpha shape of Edelsbrunner,
//! Kirkpatrick, Seidel 1983). In an evenly sampled sheet such a disc does not fit anywhere; along a
//! rim it rolls. A path may sink into an empty disc only against a force.

use rayon::prelude::*;

use crate::Vector;
use crate::surface::atlas::Lists;
use crate::surface::atlas::build::{Built, Draft};
use crate::surface::atlas::chart::Chart;

/// Radius of the discs in spacings: holes narrower than twice that are not seen.
pub(crate) const DISC_SPACINGS: f64 = 2.5;
/// Fewer discs than this that reach one another are a thin spot in the sampling: a hole wide enough for
/// a disc has a rim of six of its radii.
const FEWEST: usize = 6;
/// Charts nearest to a point that usually leave no room for a disc; the others are looked at where they do.
const ENCLOSING: usize = 8;
/// Directions in which a disc may touch a point.
const DIRECTIONS: usize = 24;

/// An empty disc at the rim.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Disc<const D: usize> {
    pub centre: Vector<D>,
    /// Unit direction from the point it touches to the centre.
    pub outward: Vector<D>,
    pub radius: f64,
    /// The length of rim that the point which it touches stands for.
    pub share: f64,
}

impl<const D: usize> Disc<D> {
    /// The point of the cloud at the rim.
    fn touched(&self) -> Vector<D> {
        self.centre - self.outward * self.radius
    }

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
    pub(super) fn new(draft: &Draft<D>, neighbours: &Lists) -> Self {
        let (charts, cloud) = (&draft.built, &draft.tree.points);
        if draft.monomials.variables != 2 {
            return Self {
                starts: vec![0; charts.len() + 1],
                discs: Vec::new(),
            };
        }
        let directions = directions();
        let lists: Vec<Vec<Disc<D>>> = charts
            .par_iter()
            .zip(0..charts.len() as u32)
            .map_init(Vec::new, |flat, (built, i)| {
                let chart = &built.chart;
                let flattened = |points: &[u32], flat: &mut Vec<Flat>| {
                    flat.extend(
                        points
                            .iter()
                            .map(|p| self::flat(chart, &cloud[*p as usize])),
                    );
                };
                flat.clear();
                let near = neighbours.of(i).iter().map(|j| &charts[*j as usize].own);
                let (nearest, rest) = (near.clone().take(ENCLOSING), near.skip(ENCLOSING));
                nearest.for_each(|own| flattened(own, flat));
                // The chart itself is the first of its neighbours.
                let mut open: Vec<usize> = (0..built.own.len())
                    .filter(|place| !enclosed(chart, *place, flat))
                    .collect();
                if open.is_empty() {
                    return Vec::new();
                }
                rest.for_each(|own| flattened(own, flat));
                open.retain(|place| !enclosed(chart, *place, flat));
                let discs = open.into_iter().filter_map(|place| {
                    let (x, y) = free_side(chart, place, flat, directions)?;
                    Some(disc(chart, &cloud[built.own[place] as usize], x, y))
                });
                discs.collect()
            })
            .collect();
        let whole = chains(&lists, neighbours);
        let mut kept: Vec<Vec<Disc<D>>> = lists
            .iter()
            .zip(whole)
            .map(|(list, whole)| {
                let kept = list.iter().zip(whole).filter(|(_, size)| *size >= FEWEST);
                kept.map(|(disc, _)| *disc).collect()
            })
            .collect();
        measure(&mut kept, charts, neighbours);
        Self::of_lists(&kept)
    }

    /// Discs by chart.
    pub(super) fn of_lists(lists: &[Vec<Disc<D>>]) -> Self {
        let mut starts = vec![0];
        for list in lists {
            starts.push(starts[starts.len() - 1] + list.len() as u32);
        }
        Self {
            starts,
            discs: lists.concat(),
        }
    }

    /// The discs of groups of charts, each in one list.
    pub(super) fn grouped(&self, groups: &[Vec<u32>]) -> Self {
        let group = |group: &Vec<u32>| {
            group
                .iter()
                .flat_map(|chart| self.of(*chart))
                .copied()
                .collect()
        };
        Self::of_lists(&groups.iter().map(group).collect::<Vec<_>>())
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

    /// Estimated length of all rims.
    pub fn length(&self) -> f64 {
        self.discs.iter().fold(0.0, |sum, disc| sum + disc.share)
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

/// Gives each disc its share of the rim: half the way to the next points on it, on either side.
fn measure<const D: usize>(lists: &mut [Vec<Disc<D>>], charts: &[Built<D>], neighbours: &Lists) {
    let known = &*lists;
    let share = |chart: u32, disc: &Disc<D>| {
        let near = neighbours.of(chart).iter();
        let touched = near.flat_map(|j| &known[*j as usize]).map(Disc::touched);
        let frame = &charts[chart as usize].chart.frame;
        let plane = [D - 2, D - 1].map(|column| frame.column(column).into_owned());
        let [x, y] = [0, 1].map(|axis| disc.outward.dot(&plane[axis]));
        let along = plane[1] * x - plane[0] * y;
        // Two points on one disc are no farther apart than its diameter.
        let mut gaps = [2.0 * disc.radius; 2];
        for offset in touched.map(|point| point - disc.touched()) {
            let side = usize::from(offset.dot(&along) > 0.0);
            let gap = offset.norm();
            if gap > 0.0 {
                gaps[side] = gaps[side].min(gap);
            }
        }
        0.5 * (gaps[0] + gaps[1])
    };
    let shares: Vec<Vec<f64>> = (0..known.len() as u32)
        .into_par_iter()
        .map(|i| {
            known[i as usize]
                .iter()
                .map(|disc| share(i, disc))
                .collect()
        })
        .collect();
    for (disc, share) in lists.iter_mut().flatten().zip(shares.concat()) {
        disc.share = share;
    }
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
fn disc<const D: usize>(chart: &Chart<D>, point: &Vector<D>, x: f64, y: f64) -> Disc<D> {
    let radius = DISC_SPACINGS * chart.spacing;
    let outward = chart.frame.column(D - 2) * x + chart.frame.column(D - 1) * y;
    Disc {
        centre: point + outward * radius,
        outward,
        radius,
        share: 0.0,
    }
}

/// Unit directions, all marked as empty.
fn directions() -> [(f64, f64, bool); DIRECTIONS] {
    std::array::from_fn(|i| {
        let angle = std::f64::consts::TAU * i as f64 / DIRECTIONS as f64;
        (angle.cos(), angle.sin(), true)
    })
}
