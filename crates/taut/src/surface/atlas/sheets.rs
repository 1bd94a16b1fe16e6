//! Neighbourhoods that stay on one sheet.
//!
//! Points near in space may belong to another layer. A neighbourhood grows outwards from a tangent
//! plane found at the smallest scale where the points are flat; at each size the heights over the
//! model fitted so far are sorted, and an empty interval well wider than the scatter on either side
//! separates this sheet from the next. Noise fills such intervals, so a noisy sheet is kept whole.

use crate::spatial::tree::{Neighbour, Tree};
use crate::surface::atlas::fit::{Factored, Samples};
use crate::surface::atlas::polynomial::Monomials;
use crate::{Matrix, Vector};

/// Points of one sheet around a seed.
#[derive(Clone, Debug)]
pub(crate) struct Neighbourhood<const D: usize> {
    /// Points of the sheet, as tree indices, nearest first; holds the seed unless it is an outlier.
    pub members: Vec<u32>,
    /// Orthonormal frame: columns 0..m normal, m..D tangent.
    pub frame: Matrix<D>,
}

/// Root of (scatter across / scatter along) below which points count as flat.
const FLAT: f64 = 0.25;
/// An empty interval of heights separates sheets when it is wider than this many deviations of the
/// sheet's own heights ...
const GAP_DEVIATIONS: f64 = 4.0;
/// ... and than this many spacings.
const GAP_SPACINGS: f64 = 0.4;

/// Points that may surround a seed on a plane, ...
const SURROUNDING_POINTS: usize = 24;
/// ... the height over it up to which they count as on it, in spacings, ...
const THICKNESS: f64 = 0.5;
/// ... the directions in it that are told apart, ...
const SECTORS: usize = 8;
/// ... and how many of them hold points where the plane is the sheet's.
const SURROUNDED: usize = 6;

/// Grows the sheet around the tree's point `seed` to `wanted` points; `None` where there is no
/// tangent space (points on a line).
pub(crate) fn grow<const D: usize>(
    tree: &Tree<D>,
    monomials: &Monomials,
    seed: u32,
    wanted: usize,
    found: &mut Vec<Neighbour>,
) -> Option<Neighbourhood<D>> {
    let origin = tree.points[seed as usize];
    let mut reach = wanted + wanted / 8 + 4;
    loop {
        tree.nearest(&origin, reach, found);
        let neighbourhood = grow_within(tree, monomials, &origin, wanted, found)?;
        let complete = neighbourhood.members.len() >= wanted || found.len() < reach;
        if complete || reach >= 6 * wanted {
            return Some(neighbourhood);
        }
        reach *= 2;
    }
}

fn grow_within<const D: usize>(
    tree: &Tree<D>,
    monomials: &Monomials,
    origin: &Vector<D>,
    wanted: usize,
    found: &[Neighbour],
) -> Option<Neighbourhood<D>> {
    let k = monomials.variables;
    let point = |n: &Neighbour| tree.points[n.index as usize];
    let spacing = spacing(found, k);
    let (mut members, frame) = first_plane(tree, k, found)?;
    let mut model = Model::plane(tree, &members, &frame, k);
    let mut size = members.len();
    loop {
        size = (size + size / 2 + 1).min(found.len());
        let mut heights: Vec<(f64, u32)> = found[..size]
            .iter()
            .map(|n| (model.height(monomials, origin, &frame, &point(n)), n.index))
            .collect();
        heights.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let kept = one_sheet(&heights, model.deviation, spacing);
        let mut is_kept: Vec<u32> = kept.iter().map(|h| h.1).collect();
        is_kept.sort_unstable();
        members.clear();
        members.extend(
            found[..size]
                .iter()
                .map(|n| n.index)
                .filter(|i| is_kept.binary_search(i).is_ok()),
        );
        members.truncate(wanted);
        if members.len() <= k + 1 {
            return None;
        }
        model = Model::fit(tree, monomials, origin, &members, &frame)?;
        if size == found.len() || members.len() >= wanted {
            return Some(Neighbourhood { members, frame });
        }
    }
}

/// The distance of neighbouring points if spread evenly, from the eighth-nearest neighbour.
fn spacing(found: &[Neighbour], k: usize) -> f64 {
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

/// The smallest flat neighbourhood: its points and its frame. On surfaces in space its plane's points
/// must surround the seed too: an arc of points about a thin limb is flat as well.
fn first_plane<const D: usize>(
    tree: &Tree<D>,
    k: usize,
    found: &[Neighbour],
) -> Option<(Vec<u32>, Matrix<D>)> {
    let around = (k == 2 && D == 3).then(|| Around::new(tree, found));
    let mut flattest: Option<(Vec<u32>, Principal<D>)> = None;
    let mut size = k + 4;
    while size <= found.len().min(40) || flattest.is_none() {
        let size_here = size.min(found.len());
        let indices: Vec<u32> = found[..size_here].iter().map(|n| n.index).collect();
        if let Some(principal) = Principal::new(tree, &indices, k) {
            if principal.flatness < FLAT
                && around
                    .as_ref()
                    .is_none_or(|a| a.sectors(&principal.frame) >= SURROUNDED)
            {
                return Some((indices, principal.frame));
            }
            if flattest
                .as_ref()
                .is_none_or(|f| principal.flatness < f.1.flatness)
            {
                flattest = Some((indices, principal));
            }
        }
        if size >= found.len() {
            break;
        }
        size += size / 2;
    }
    let surrounded = around.and_then(|around| around.plane(found));
    surrounded.or_else(|| flattest.map(|(indices, principal)| (indices, principal.frame)))
}

/// The principal components of some points.
struct Principal<const D: usize> {
    /// Columns by ascending scatter: normals first.
    frame: Matrix<D>,
    /// Root of (scatter across / least scatter along) the first k.
    flatness: f64,
}

impl<const D: usize> Principal<D> {
    /// `None` where fewer than k directions have extent.
    fn new(tree: &Tree<D>, indices: &[u32], k: usize) -> Option<Self> {
        let count = indices.len() as f64;
        let mean = indices.iter().fold(Vector::<D>::zeros(), |sum, i| {
            sum + tree.points[*i as usize]
        }) / count;
        let mut covariance = Matrix::<D>::zeros();
        for i in indices {
            let offset = tree.points[*i as usize] - mean;
            covariance += offset * offset.transpose();
        }
        let eigen = nalgebra::SymmetricEigen::try_new(
            nalgebra::DMatrix::from_column_slice(D, D, covariance.as_slice()),
            f64::EPSILON,
            200,
        )?;
        let mut order: Vec<usize> = (0..D).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
        let mut frame = Matrix::<D>::zeros();
        for (column, source) in order.iter().enumerate() {
            for row in 0..D {
                frame[(row, column)] = eigen.eigenvectors[(row, *source)];
            }
        }
        let scatter = |i: usize| eigen.eigenvalues[order[i]].max(0.0);
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

/// The near neighbours of a seed in space, as offsets in spacings: which planes do they surround it on?
///
/// Each of [`SECTORS`] directions in a plane counts by the nearest point in it alone, so that neither
/// the many points along a scan line nor those of other layers outvote the few of the sheet.
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
                let sector = usize::from(y < 0.0) * 4
                    + usize::from(x < 0.0) * 2
                    + usize::from(x.abs() < y.abs());
                let weight = (1.0 - height * height) / (1.0 + offset.norm_squared());
                sectors[sector] = sectors[sector].max(weight);
            }
        }
        sectors
    }

    /// The number of sectors in which a plane has points.
    fn sectors(&self, frame: &Matrix<D>) -> usize {
        self.weights(frame).iter().filter(|w| **w > 0.0).count()
    }

    /// The plane through the seed and two neighbours on which they surround it best, and the points
    /// on it: for seeds between close layers, on thin limbs or on scan lines.
    fn plane(&self, found: &[Neighbour]) -> Option<(Vec<u32>, Matrix<D>)> {
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
                let occupied = weights.iter().filter(|w| **w > 0.0).count() as f64 / SECTORS as f64;
                let support = occupied * occupied * weights.iter().sum::<f64>();
                if best.is_none_or(|(most, _)| support > most) {
                    best = Some((support, frame));
                }
            }
        }
        let (_, frame) = best?;
        let on_plane = found
            .iter()
            .zip(&self.offsets)
            .filter(|(_, offset)| offset.dot(&frame.column(0)).abs() <= THICKNESS);
        let members: Vec<u32> = on_plane.map(|(n, _)| n.index).collect();
        (members.len() >= 4).then_some((members, frame))
    }
}

/// Fills columns from `first` on so that the matrix is orthonormal.
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

/// The run of sorted heights around the one nearest zero that no wide gap interrupts.
fn one_sheet(heights: &[(f64, u32)], deviation: f64, spacing: f64) -> &[(f64, u32)] {
    let gap = (GAP_DEVIATIONS * deviation).max(GAP_SPACINGS * spacing);
    let middle = (0..heights.len())
        .min_by(|a, b| heights[*a].0.abs().total_cmp(&heights[*b].0.abs()))
        .unwrap_or(0);
    let mut first = middle;
    while first > 0 && heights[first].0 - heights[first - 1].0 <= gap {
        first -= 1;
    }
    let mut last = middle;
    while last + 1 < heights.len() && heights[last + 1].0 - heights[last].0 <= gap {
        last += 1;
    }
    &heights[first..=last]
}

/// The sheet as known so far: a plane or a quadric.
struct Model {
    coefficients: Vec<f64>,
    scale: f64,
    /// Scatter of the members about it.
    deviation: f64,
}

impl Model {
    fn plane<const D: usize>(tree: &Tree<D>, members: &[u32], frame: &Matrix<D>, k: usize) -> Self {
        let m = D - k;
        let mut constants = vec![0.0; m];
        for i in members {
            let local =
                frame.tr_mul(&(tree.points[*i as usize] - tree.points[members[0] as usize]));
            for a in 0..m {
                constants[a] += local[a] / members.len() as f64;
            }
        }
        let mut model = Self {
            coefficients: constants,
            scale: 1.0,
            deviation: 0.0,
        };
        model.deviation = model.scatter(members.iter().map(|i| {
            let local =
                frame.tr_mul(&(tree.points[*i as usize] - tree.points[members[0] as usize]));
            (0..m)
                .map(|a| (local[a] - model.coefficients[a]).powi(2))
                .sum::<f64>()
                .sqrt()
        }));
        model
    }

    /// Standard deviation by the median of absolute deviations.
    fn scatter(&self, residuals: impl Iterator<Item = f64>) -> f64 {
        let mut sorted: Vec<f64> = residuals.map(f64::abs).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        1.4826 * sorted[sorted.len() / 2]
    }

    /// Signed height over the model for one normal, the size of the height for several.
    fn height<const D: usize>(
        &self,
        monomials: &Monomials,
        origin: &Vector<D>,
        frame: &Matrix<D>,
        x: &Vector<D>,
    ) -> f64 {
        let k = monomials.variables;
        let m = D - k;
        let local = frame.tr_mul(&(x - origin));
        let mut u = [0.0; D];
        for j in 0..k {
            u[j] = local[m + j] / self.scale;
        }
        let count = self.coefficients.len() / m;
        // A quadric of up to 16 variables has 153 coefficients.
        let mut values = [0.0; 160];
        monomials.values(&u[..k], &mut values[..count]);
        let height = |a: usize| {
            let c = &self.coefficients[a * count..(a + 1) * count];
            local[a] - c.iter().zip(&values).map(|(c, v)| c * v).sum::<f64>()
        };
        if m == 1 {
            height(0)
        } else {
            (0..m).map(|a| height(a).powi(2)).sum::<f64>().sqrt()
        }
    }

    /// Fits members: a plane while few, then a quadric, over the frame's tangent plane.
    fn fit<const D: usize>(
        tree: &Tree<D>,
        monomials: &Monomials,
        origin: &Vector<D>,
        members: &[u32],
        frame: &Matrix<D>,
    ) -> Option<Self> {
        let k = monomials.variables;
        let degree = if members.len() >= 2 * monomials.count(2) {
            2
        } else {
            1
        };
        let samples = samples(tree, origin, members, frame, k);
        let fitted = Factored::new(monomials, degree, &samples.0)?;
        let mut model = Self {
            coefficients: fitted.coefficients(monomials, fitted.degree),
            scale: samples.1,
            deviation: 0.0,
        };
        model.deviation = model.scatter(
            members
                .iter()
                .map(|i| model.height(monomials, origin, frame, &tree.points[*i as usize])),
        );
        Some(model)
    }
}

/// Heights over tangent coordinates about `origin`, weighted towards it; and the coordinates' scale.
pub(crate) fn samples<const D: usize>(
    tree: &Tree<D>,
    origin: &Vector<D>,
    members: &[u32],
    frame: &Matrix<D>,
    k: usize,
) -> (Samples, f64) {
    let m = D - k;
    let mut coordinates = Vec::with_capacity(members.len() * k);
    let mut heights = Vec::with_capacity(members.len() * m);
    let mut farthest = 0.0_f64;
    for i in members {
        let local = frame.tr_mul(&(tree.points[*i as usize] - origin));
        heights.extend_from_slice(&local.as_slice()[..m]);
        coordinates.extend_from_slice(&local.as_slice()[m..]);
        let u = &coordinates[coordinates.len() - k..];
        farthest = farthest.max(u.iter().map(|v| v * v).sum());
    }
    let scale = farthest.sqrt().max(f64::MIN_POSITIVE);
    for value in &mut coordinates {
        *value /= scale;
    }
    let weights = coordinates
        .chunks(k)
        .map(|u| {
            let squared: f64 = u.iter().map(|v| v * v).sum();
            (1.0 - 0.9 * squared).powi(2)
        })
        .collect();
    (
        Samples {
            coordinates,
            heights,
            weights,
        },
        scale,
    )
}
