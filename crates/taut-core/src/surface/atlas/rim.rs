//! Rims (the boundary of the surface) and holes: where the data ends.
//!
//! The known extent of a surface is what no empty disc reaches. Such a disc lies in the tangent
//! plane, has a radius of a few spacings, touches a point and holds none (the alpha shape of
//! Edelsbrunner, Kirkpatrick, Seidel 1983). In an evenly sampled sheet such a disc does not fit
//! anywhere; along a rim it rolls. A path may sink into an empty disc only against a force.

use crate::surface::atlas::Lists;
use crate::surface::atlas::build::{Built, Draft};
use crate::surface::atlas::chart::Chart;
use crate::{Vector, parallel};

/// Radius of the discs, in spacings: holes narrower than twice that are not seen.
pub(crate) const DISC_SPACINGS: f64 = 2.5;
/// Least number of discs that reach one another; fewer are a thin spot in the sampling, because a
/// hole wide enough for a disc has a rim of six of its radii.
const FEWEST_DISCS: usize = 6;
/// Largest distance, in radii, to the centres of discs that a rim goes on to: an empty disc may
/// touch points that are twice its radius apart.
const FARTHEST_DISC: f64 = 2.0;
/// Number of cells of points along the longest chord that is looked at.
const CELLS_A_CHORD: f64 = 3.0;
/// The bits of all eighths of the plane.
const ALL_EIGHTHS: u64 = 0xFF;
/// Most cells of points along a chart.
const MOST_CELLS: f64 = 64.0;
/// Number of directions in which a disc may touch a point.
const DIRECTIONS: usize = 24;

/// An empty disc at the rim.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Disc<const D: usize> {
    pub centre: Vector<D>,
    /// Unit direction from the point that the disc touches to its centre.
    pub outward: Vector<D>,
    pub radius: f64,
    /// The length of rim that the point which the disc touches stands for, in the input's units.
    pub share: f64,
}

impl<const D: usize> Disc<D> {
    /// The point of the cloud at the rim that the disc touches.
    pub fn touched(&self) -> Vector<D> {
        self.centre - self.outward * self.radius
    }

    /// How deep `x` lies in the disc, and the direction in which the depth grows. In the half at
    /// the rim it points towards the centre; beyond, it points outwards, so that no point is pushed
    /// through to the other side.
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
    /// Rolls the discs round every point of a surface (k = 2); on curves and solids no rim is
    /// known.
    pub(super) fn new(draft: &Draft<D>, neighbours: &Lists) -> Self {
        let (charts, cloud) = (&draft.built, &draft.tree.points);
        if draft.monomials.variables != 2 {
            return Self {
                starts: vec![0; charts.len() + 1],
                discs: Vec::new(),
            };
        }
        let directions = directions();
        let of = |(flat, cells): &mut (Vec<Flat>, Cells), i: usize| -> Vec<Disc<D>> {
            let Built { chart, own, .. } = &charts[i];
            let near = neighbours.of(i as u32).iter();
            let points = near.flat_map(|near| &charts[*near as usize].own);
            flat.clear();
            flat.extend(points.map(|p| self::flat(chart, &cloud[*p as usize])));
            // The chart itself is the first of its neighbours.
            cells.fill(flat, own.len(), chord(chart));
            let own = own.iter().enumerate();
            let open = own.filter(|(place, _)| !cells.enclosed(&flat[*place]));
            let discs = open.filter_map(|(place, p)| {
                let (x, y) = free_side(chart, place, flat, directions)?;
                Some(disc(chart, &cloud[*p as usize], x, y))
            });
            discs.collect()
        };
        let lists = parallel::map_with(charts.len(), Default::default, of);
        let kept = chains(&lists, neighbours);
        let mut kept: Vec<Vec<Disc<D>>> = lists
            .iter()
            .zip(kept)
            .map(|(list, kept)| {
                let kept = list.iter().zip(kept).filter(|(_, kept)| *kept);
                kept.map(|(disc, _)| *disc).collect()
            })
            .collect();
        measure(&mut kept, charts, neighbours);
        Self::of_lists(&kept)
    }

    /// The rim whose discs are given by chart.
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

    /// The discs of groups of charts, in one list for each group.
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

    /// Estimated length of all rims, in the input's units.
    pub fn length(&self) -> f64 {
        self.discs.iter().fold(0.0, |sum, disc| sum + disc.share)
    }
}

/// Which discs make a rim. These are the discs of chains of at least [`FEWEST_DISCS`], each centre
/// within the radius of the next, and the discs to which such a chain goes on where points at the
/// rim are far apart.
fn chains<const D: usize>(lists: &[Vec<Disc<D>>], neighbours: &Lists) -> Vec<Vec<bool>> {
    let none = || lists.iter().map(|list| vec![false; list.len()]).collect();
    // This adds to a chain, from its discs on, what they reach and no chain has taken.
    let extend = |chain: &mut Vec<(usize, usize)>, taken: &mut Vec<Vec<bool>>, radii: f64| {
        let mut next = 0;
        while let Some((chart, i)) = chain.get(next).copied() {
            next += 1;
            let disc = &lists[chart][i];
            for other in neighbours.of(chart as u32).iter().map(|c| *c as usize) {
                for (j, there) in lists[other].iter().enumerate() {
                    let gap = (there.centre - disc.centre).norm();
                    if !taken[other][j] && gap <= radii * disc.radius {
                        taken[other][j] = true;
                        chain.push((other, j));
                    }
                }
            }
        }
    };
    let (mut taken, mut kept): (Vec<Vec<bool>>, Vec<Vec<bool>>) = (none(), none());
    let mut rims = Vec::new();
    for first in 0..lists.len() {
        for i in 0..lists[first].len() {
            if taken[first][i] {
                continue;
            }
            taken[first][i] = true;
            let mut chain = vec![(first, i)];
            extend(&mut chain, &mut taken, 1.0);
            if chain.len() >= FEWEST_DISCS {
                for (chart, i) in &chain {
                    kept[*chart][*i] = true;
                }
                rims.extend(chain);
            }
        }
    }
    extend(&mut rims, &mut kept, FARTHEST_DISC);
    kept
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
    let shares: Vec<Vec<f64>> = parallel::map(known.len(), |i| {
        let discs = known[i].iter();
        discs.map(|disc| share(i as u32, disc)).collect()
    });
    for (disc, share) in lists.iter_mut().flatten().zip(shares.concat()) {
        disc.share = share;
    }
}

/// A point in a chart's tangent plane.
type Flat = (f64, f64);

/// A point in the coordinates of a chart's tangent plane.
fn flat<const D: usize>(chart: &Chart<D>, point: &Vector<D>) -> Flat {
    let offset = point - chart.origin;
    let along = |column: usize| offset.dot(&chart.frame.column(column));
    (along(D - 2), along(D - 1))
}

/// The longest chord of a disc between directions a quarter of a turn apart, less a little.
fn chord<const D: usize>(chart: &Chart<D>) -> f64 {
    1.99_f64.sqrt() * DISC_SPACINGS * chart.spacing
}

/// Points of a plane in square cells, row by row.
#[derive(Default)]
struct Cells {
    chord: f64,
    size: f64,
    low: Flat,
    wide: usize,
    starts: Vec<u32>,
    points: Vec<Flat>,
    places: Vec<(u32, Flat)>,
}

impl Cells {
    /// Takes the points within a chord of the box about the first `own` points.
    fn fill(&mut self, all: &[Flat], own: usize, chord: f64) {
        let outwards = |pick: fn(f64, f64) -> f64, chord: f64| {
            let first = all[0];
            let corner = all[..own].iter();
            let corner = corner.fold(first, |c, p| (pick(c.0, p.0), pick(c.1, p.1)));
            (corner.0 + chord, corner.1 + chord)
        };
        let (low, high) = (outwards(f64::min, -chord), outwards(f64::max, chord));
        let extent = (high.0 - low.0).max(high.1 - low.1);
        (self.chord, self.low) = (chord, low);
        self.size = (chord / CELLS_A_CHORD).max(extent / MOST_CELLS);
        self.wide = (extent / self.size) as usize + 1;
        let (low, size, wide) = (self.low, self.size, self.wide);
        let inside = |p: &&Flat| p.0 >= low.0 && p.0 <= high.0 && p.1 >= low.1 && p.1 <= high.1;
        let cell = |p: &Flat| {
            let [column, row] = [p.0 - low.0, p.1 - low.1].map(|v| (v / size) as usize);
            (row * wide + column) as u32
        };
        self.places.clear();
        let inner = all.iter().filter(inside);
        self.places.extend(inner.map(|p| (cell(p), *p)));
        self.starts.clear();
        self.starts.resize(wide * wide + 1, 0);
        for (cell, _) in &self.places {
            self.starts[*cell as usize + 1] += 1;
        }
        for cell in 0..wide * wide {
            self.starts[cell + 1] += self.starts[cell];
        }
        self.points.resize(self.places.len(), (0.0, 0.0));
        // The cells are filled from the back, so that every cell's end becomes its start.
        for (cell, point) in &self.places {
            let end = &mut self.starts[*cell as usize + 1];
            *end -= 1;
            self.points[*end as usize] = *point;
        }
        self.starts.remove(0);
        self.starts.push(self.places.len() as u32);
    }

    /// Whether there is a near point in each eighth of the plane round a point, which leaves no
    /// room for a disc. One of them lies within half a right angle of the direction of the disc's
    /// centre, and is nearer than the chord.
    fn enclosed(&self, origin: &Flat) -> bool {
        let farthest = (self.chord / self.size).ceil() as usize;
        // Most points are enclosed by the nearest ones.
        (1..=farthest).any(|reach| self.eighths(origin, reach) == ALL_EIGHTHS)
    }

    /// The eighths of the plane round a point that hold a near point in the cells up to `reach`
    /// cells away, as bits.
    fn eighths(&self, origin: &Flat, reach: usize) -> u64 {
        let [column, row] =
            [origin.0 - self.low.0, origin.1 - self.low.1].map(|v| (v / self.size) as usize);
        let columns = column.saturating_sub(reach)..=(column + reach).min(self.wide - 1);
        let squared_chord = self.chord * self.chord;
        let mut eighths = 0;
        // The rows come in the order of their distance.
        let rows = (0..=2 * reach)
            .map(|i| (row + i.div_ceil(2) * (i % 2)).checked_sub(i / 2 * (1 - i % 2)));
        for row in rows.flatten().filter(|row| *row < self.wide) {
            let [first, last] = [*columns.start(), *columns.end() + 1]
                .map(|column| self.starts[row * self.wide + column] as usize);
            for (x, y) in &self.points[first..last] {
                let (u, v) = (x - origin.0, y - origin.1);
                let squared = u * u + v * v;
                // Whether a point is near cannot be predicted, and costs less without a branch.
                let near = u64::from(squared < squared_chord) & u64::from(squared > 0.0);
                let signs = [u, v].map(|coordinate| coordinate.to_bits() >> 63);
                let eighth = signs[0] | signs[1] << 1 | u64::from(u.abs() < v.abs()) << 2;
                eighths |= near << eighth;
            }
            if eighths == ALL_EIGHTHS {
                break;
            }
        }
        eighths
    }
}

/// The unit direction in the middle of those in which an empty disc touches a point, if there are
/// any.
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
    // Where all directions are empty, the point is alone and bounds nothing.
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
