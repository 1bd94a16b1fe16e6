//! Neighbourhoods that stay on one sheet.
//!
//! Points near in space may belong to another layer. A neighbourhood grows outwards from a tangent
//! plane found at the smallest scale where the points are flat. At each size the heights over the
//! model fitted so far are sorted, and an empty interval well wider than the scatter on either side
//! separates this sheet from the next. Noise fills such intervals, so a noisy sheet is kept whole.

use std::ops::RangeInclusive;

use crate::spatial::principal;
use crate::spatial::tree::{Neighbour, Tree};
use crate::surface::atlas::fit::{LeastSquares, Samples};
use crate::surface::atlas::polynomial::Monomials;
use crate::{Matrix, Vector};

/// Points of one sheet around a seed.
#[derive(Clone, Debug)]
pub(crate) struct Neighbourhood<const D: usize> {
    /// Points of the sheet, as tree indices, nearest first; they hold the seed unless it is an
    /// outlier.
    pub members: Vec<u32>,
    /// An orthonormal frame: columns 0..m are normal, m..D tangent.
    pub frame: Matrix<D>,
}

/// Root of (scatter across / scatter along) below which points count as flat.
const FLAT_SCATTER: f64 = 0.25;
/// Least width of an empty interval of heights that separates sheets, in deviations of the sheet's
/// own heights.
const GAP_DEVIATIONS: f64 = 4.0;
/// Least width of an empty interval of heights that separates sheets, in spacings.
const GAP_SPACINGS: f64 = 0.4;

/// Number of points that may surround a seed on a plane.
const SURROUNDING_POINTS: usize = 24;
/// Height over a plane up to which points count as on it, in spacings.
const THICKNESS: f64 = 0.5;
/// Number of directions in a plane that are told apart.
pub(super) const SECTORS: usize = 8;
/// Number of directions that must hold points where a plane is the sheet's.
const SURROUNDED: usize = 6;

/// Number of points of a search that its first plane looks at: more do not change it.
const FIRST_POINTS: usize = 32;

/// The memory of everything that is computed for a chart, kept for the next one.
#[derive(Default)]
pub(crate) struct Workspace<const D: usize> {
    found: Vec<Neighbour>,
    /// The found points in the frame of the first plane.
    local: Vec<Vector<D>>,
    /// The sheet's points, as places among those found.
    kept: Vec<u32>,
    heights: Vec<f64>,
    sorted: Vec<f64>,
    model: SheetHeights,
    pub samples: Samples,
    pub fit: LeastSquares,
    /// The points that lie far off the others, as places among the points last fitted.
    pub strays: Vec<u32>,
}

/// Where a sheet starts: places of points among those found, and their frame.
type Start<const D: usize> = (Vec<u32>, Matrix<D>);

/// The sheet around a seed, at any size.
pub(crate) struct Sheet<'a, const D: usize> {
    pub tree: &'a Tree<D>,
    pub monomials: &'a Monomials,
    /// The tree's point at which the sheet starts.
    pub seed: u32,
    start: Option<Start<D>>,
}

impl<'a, const D: usize> Sheet<'a, D> {
    pub fn new(tree: &'a Tree<D>, monomials: &'a Monomials, seed: u32) -> Self {
        Self {
            tree,
            monomials,
            seed,
            start: None,
        }
    }

    /// Grows the sheet to `wanted` points; `None` where there is no tangent space, as for points on
    /// a line.
    pub fn grow(
        &mut self,
        wanted: usize,
        workspace: &mut Workspace<D>,
    ) -> Option<Neighbourhood<D>> {
        let origin = self.tree.points[self.seed as usize];
        let mut reach = wanted + wanted / 8 + 4;
        loop {
            self.tree.nearest(&origin, reach, &mut workspace.found);
            let found = workspace.found.len();
            let known = self.start.clone().filter(|_| found >= FIRST_POINTS);
            let (members, frame) = match known {
                Some(start) => start,
                None => first_plane(self.tree, self.monomials.variables, &workspace.found)?,
            };
            workspace.place(self.tree, &origin, &frame);
            workspace.kept.clone_from(&members);
            if members.len() <= FIRST_POINTS && FIRST_POINTS <= found {
                self.start = Some((members, frame));
            }
            workspace.grow(self.monomials, wanted)?;
            let complete = workspace.kept.len() >= wanted || found < reach;
            if complete || reach >= 6 * wanted {
                let kept = workspace.kept.iter();
                return Some(Neighbourhood {
                    members: kept.map(|i| workspace.found[*i as usize].index).collect(),
                    frame,
                });
            }
            reach *= 2;
        }
    }
}

impl<const D: usize> Workspace<D> {
    /// Whether the neighbourhood last grown holds all points that are as near as its farthest, so
    /// that no other sheet comes by.
    pub fn alone(&self) -> bool {
        self.kept.iter().copied().eq(0..self.kept.len() as u32)
    }

    /// Puts the found points into the frame of the first plane.
    fn place(&mut self, tree: &Tree<D>, origin: &Vector<D>, frame: &Matrix<D>) {
        let point = |n: &Neighbour| tree.points[n.index as usize];
        let found = self.found.iter();
        self.local.clear();
        self.local
            .extend(found.map(|n| frame.tr_mul(&(point(n) - origin))));
    }

    /// Grows the kept points within those found, to `wanted` at most.
    fn grow(&mut self, monomials: &Monomials, wanted: usize) -> Option<()> {
        let k = monomials.variables;
        let wide = GAP_SPACINGS * spacing(&self.found, k);
        let all = self.found.len();
        let mut size = self.kept.len();
        self.set_plane(k);
        loop {
            size = (size + size / 2 + 1).min(all);
            if self.spread(k, size, wide) <= wide && self.heights.len() == all {
                // No other sheet fits between the points, however many of them are looked at.
                size = all;
            }
            let gap = (GAP_DEVIATIONS * self.model.deviation).max(wide);
            let heights = &self.heights[..size];
            let sheet = one_sheet(heights, gap, &mut self.sorted);
            self.kept.clear();
            let kept = (0..size as u32).filter(|i| sheet.contains(&heights[*i as usize]));
            self.kept.extend(kept.take(wanted));
            if self.kept.len() <= k + 1 {
                return None;
            }
            if size == all || self.kept.len() >= wanted {
                return Some(());
            }
            self.fit_model(monomials)?;
        }
    }

    /// Computes the heights over the model of the first `size` points found, and of those after
    /// them while they certainly keep within one sheet, less than `wide` apart. Returns the spread
    /// of all these heights.
    fn spread(&mut self, k: usize, size: usize, wide: f64) -> f64 {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        self.heights.clear();
        for (i, local) in self.local.iter().enumerate() {
            if i >= size && high - low > wide {
                break;
            }
            let height = self.model.height(k, local);
            (low, high) = (low.min(height), high.max(height));
            self.heights.push(height);
        }
        high - low
    }

    /// Sets the model to the plane at the mean height of the kept points.
    fn set_plane(&mut self, k: usize) {
        let m = D - k;
        let kept = || self.kept.iter().map(|i| &self.local[*i as usize]);
        let sum = kept().fold(Vector::<D>::zeros(), |sum, local| sum + local);
        let mean = sum / self.kept.len() as f64;
        self.model.scale = 1.0;
        self.model.coefficients.clear();
        self.model.coefficients.extend(mean.iter().take(m));
        let deviations = kept().map(|local| {
            let squares = (0..m).map(|a| (local[a] - mean[a]).powi(2));
            squares.sum::<f64>().sqrt()
        });
        self.model.deviation = scatter(deviations, &mut self.sorted);
    }

    /// Fits the kept points over the frame's tangent plane: by a plane while they are few, then by
    /// a quadric.
    fn fit_model(&mut self, monomials: &Monomials) -> Option<()> {
        let k = monomials.variables;
        let degree = if self.kept.len() >= 2 * monomials.count(2) {
            2
        } else {
            1
        };
        let kept = self.kept.iter().map(|i| self.local[*i as usize]);
        self.model.scale = self.samples.set(D - k, kept);
        let degree = self.fit.factor(monomials, degree, &self.samples)?;
        self.fit
            .coefficients(monomials, degree, &mut self.model.coefficients);
        let model = &self.model;
        let kept = self.kept.iter().map(|i| &self.local[*i as usize]);
        let residuals = kept.map(|local| model.height(k, local).abs());
        self.model.deviation = scatter(residuals, &mut self.sorted);
        Some(())
    }
}

/// The distance between neighbouring points if they were spread evenly, from the eighth-nearest
/// neighbour.
pub(super) fn spacing(found: &[Neighbour], k: usize) -> f64 {
    let last = found.len().min(9) - 1;
    let ball = unit_ball(k);
    found[last].squared.sqrt() * (ball / last as f64).powf(1.0 / k as f64)
}

/// Volume of the unit ball of R^k.
pub(crate) fn unit_ball(k: usize) -> f64 {
    match k {
        0 => 1.0,
        1 => 2.0,
        _ => unit_ball(k - 2) * std::f64::consts::TAU / k as f64,
    }
}

/// The smallest flat neighbourhood: its points and its frame. On surfaces in space the points of
/// its plane must surround the seed as well, because an arc of points about a thin limb is flat
/// too.
fn first_plane<const D: usize>(tree: &Tree<D>, k: usize, found: &[Neighbour]) -> Option<Start<D>> {
    let around = (k == 2 && D == 3).then(|| Around::new(tree, found));
    let mut flattest: Option<(usize, Principal<D>)> = None;
    let first = |size: usize| (0..size as u32).collect();
    let mut size = k + 4;
    while size <= found.len().min(FIRST_POINTS) || flattest.is_none() {
        let size_here = size.min(found.len());
        if let Some(principal) = Principal::new(tree, &found[..size_here], k) {
            if principal.flatness < FLAT_SCATTER
                && around
                    .as_ref()
                    .is_none_or(|a| a.sectors(&principal.frame) >= SURROUNDED)
            {
                return Some((first(size_here), principal.frame));
            }
            if flattest
                .as_ref()
                .is_none_or(|f| principal.flatness < f.1.flatness)
            {
                flattest = Some((size_here, principal));
            }
        }
        if size >= found.len() {
            break;
        }
        size += size / 2;
    }
    let surrounded = around.and_then(|around| around.plane());
    surrounded.or_else(|| flattest.map(|(size, principal)| (first(size), principal.frame)))
}

/// The principal components of some points.
struct Principal<const D: usize> {
    /// The principal directions in columns, by ascending scatter: normals first.
    frame: Matrix<D>,
    /// Root of (scatter across / least scatter along) for the first k directions.
    flatness: f64,
}

impl<const D: usize> Principal<D> {
    /// The principal components of the points found; `None` where fewer than k directions have
    /// extent.
    fn new(tree: &Tree<D>, found: &[Neighbour], k: usize) -> Option<Self> {
        let points = found.iter().map(|n| tree.points[n.index as usize]);
        let (values, frame) = principal::eigen(&principal::scatter(points))?;
        let scatter = |i: usize| values[i].max(0.0);
        let (across, along, longest) = (scatter(D - k - 1), scatter(D - k), scatter(D - 1));
        if along <= 1e-10 * longest || longest == 0.0 {
            return None;
        }
        Some(Self {
            frame,
            flatness: (across / along).sqrt(),
        })
    }
}

/// The near neighbours of a seed in space, as offsets in spacings, which tell the planes on which
/// they surround the seed.
///
/// Each of [`SECTORS`] directions in a plane counts by the nearest point in it alone, so that
/// neither the many points along a scan line nor those of other layers outvote the few of the
/// sheet.
struct Around<const D: usize> {
    offsets: Vec<Vector<D>>,
}

impl<const D: usize> Around<D> {
    fn new(tree: &Tree<D>, found: &[Neighbour]) -> Self {
        let spacing = spacing(found, 2);
        let point = |n: &Neighbour| tree.points[n.index as usize];
        let near = found.iter().take(SURROUNDING_POINTS);
        Self {
            offsets: near
                .map(|n| (point(n) - point(&found[0])) / spacing)
                .collect(),
        }
    }

    /// The weight of the nearest point on a plane in each sector.
    fn weights(&self, frame: &Matrix<D>) -> [f64; SECTORS] {
        let mut sectors = [0.0_f64; SECTORS];
        for offset in &self.offsets[1..] {
            let height = offset.dot(&frame.column(0)) / THICKNESS;
            if height.abs() < 1.0 {
                let (x, y) = (offset.dot(&frame.column(1)), offset.dot(&frame.column(2)));
                let weight = (1.0 - height * height) / (1.0 + offset.norm_squared());
                let sector = &mut sectors[sector(x, y)];
                *sector = sector.max(weight);
            }
        }
        sectors
    }

    /// The number of sectors in which a plane has points.
    fn sectors(&self, frame: &Matrix<D>) -> usize {
        occupied(&self.weights(frame))
    }

    /// The plane through the seed and two neighbours on which the neighbours surround the seed
    /// best, and the points on it. It serves seeds between close layers, on thin limbs or on scan
    /// lines.
    fn plane(&self) -> Option<Start<D>> {
        let mut best: Option<(f64, Matrix<D>)> = None;
        for (a, first) in self.offsets.iter().enumerate().skip(1) {
            for second in &self.offsets[1..a] {
                let mut normal = Vector::<D>::zeros();
                for i in 0..3 {
                    let (j, l) = ((i + 1) % 3, (i + 2) % 3);
                    normal[i] = first[j] * second[l] - first[l] * second[j];
                }
                let area = normal.norm();
                if area <= 0.3 * first.norm() * second.norm() {
                    continue;
                }
                let mut frame = Matrix::<D>::zeros();
                frame.set_column(0, &(normal / area));
                complete(&mut frame, 1);
                let weights = self.weights(&frame);
                let share = occupied(&weights) as f64 / SECTORS as f64;
                let support = share * share * weights.iter().sum::<f64>();
                if best.is_none_or(|(most, _)| support > most) {
                    best = Some((support, frame));
                }
            }
        }
        let (_, frame) = best?;
        let on_plane = (0..)
            .zip(&self.offsets)
            .filter(|(_, offset)| offset.dot(&frame.column(0)).abs() <= THICKNESS);
        let members: Vec<u32> = on_plane.map(|(place, _)| place).collect();
        (members.len() >= 4).then_some((members, frame))
    }
}

/// The index of the sector, one of [`SECTORS`], in which a direction of a plane lies.
pub(super) fn sector(x: f64, y: f64) -> usize {
    usize::from(y < 0.0) * 4 + usize::from(x < 0.0) * 2 + usize::from(x.abs() < y.abs())
}

/// The number of sectors with a weight.
fn occupied(weights: &[f64; SECTORS]) -> usize {
    weights.iter().filter(|w| **w > 0.0).count()
}

/// Fills the columns from `first` on so that the matrix is orthonormal.
pub(crate) fn complete<const D: usize>(frame: &mut Matrix<D>, first: usize) {
    for column in first..D {
        let mut best = Vector::<D>::zeros();
        for axis in 0..D {
            let mut candidate = Vector::<D>::zeros();
            candidate[axis] = 1.0;
            for _ in 0..2 {
                for done in 0..column {
                    let d = frame.column(done).into_owned();
                    candidate -= d * d.dot(&candidate);
                }
            }
            if candidate.norm_squared() > best.norm_squared() {
                best = candidate;
            }
        }
        frame.set_column(column, &best.normalize());
    }
}

/// The run of heights around the one nearest zero that no interval wider than `gap` interrupts.
fn one_sheet(heights: &[f64], gap: f64, sorted: &mut Vec<f64>) -> RangeInclusive<f64> {
    let (low, high) = heights
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| {
            (low.min(*h), high.max(*h))
        });
    if high - low <= gap {
        return low..=high;
    }
    sorted.clear();
    sorted.extend_from_slice(heights);
    sorted.sort_unstable_by(f64::total_cmp);
    let middle = (0..sorted.len())
        .min_by(|a, b| sorted[*a].abs().total_cmp(&sorted[*b].abs()))
        .unwrap_or(0);
    let mut first = middle;
    while first > 0 && sorted[first] - sorted[first - 1] <= gap {
        first -= 1;
    }
    let mut last = middle;
    while last + 1 < sorted.len() && sorted[last + 1] - sorted[last] <= gap {
        last += 1;
    }
    sorted[first]..=sorted[last]
}

/// Standard deviation by the median of absolute deviations.
fn scatter(deviations: impl Iterator<Item = f64>, memory: &mut Vec<f64>) -> f64 {
    memory.clear();
    memory.extend(deviations);
    let middle = memory.len() / 2;
    1.4826 * *memory.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The sheet as known so far: a plane or a quadric.
#[derive(Default)]
struct SheetHeights {
    coefficients: Vec<f64>,
    scale: f64,
    /// Scatter of the members about the model.
    deviation: f64,
}

impl SheetHeights {
    /// Height over the model of a point in the frame: signed for one normal, the size of the height
    /// for several.
    fn height<const D: usize>(&self, k: usize, local: &Vector<D>) -> f64 {
        let m = D - k;
        let mut u = [0.0; D];
        for j in 0..k {
            u[j] = local[m + j] / self.scale;
        }
        let count = self.coefficients.len() / m;
        let height =
            |a: usize| local[a] - quadric(&self.coefficients[a * count..(a + 1) * count], &u[..k]);
        if m == 1 {
            height(0)
        } else {
            (0..m).map(|a| height(a).powi(2)).sum::<f64>().sqrt()
        }
    }
}

/// A polynomial of degree 0, 1 or 2, by the order of its [`Monomials`].
fn quadric(coefficients: &[f64], u: &[f64]) -> f64 {
    let k = u.len();
    let (constant, higher) = (coefficients[0], &coefficients[1..]);
    let mut value = constant + higher.iter().zip(u).map(|(c, u)| c * u).sum::<f64>();
    let mut second = higher.get(k..).unwrap_or_default();
    for i in 0..k {
        for (c, v) in second.iter().zip(&u[i..]) {
            value += c * v * u[i];
        }
        second = second.get(k - i..).unwrap_or_default();
    }
    value
}
