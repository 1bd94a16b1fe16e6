//! The paper's surface of a point cloud: moving least squares, (13)-(16).
//!
//! With theta(r) = exp(-r^2 / h^2) (14), the foot of q_0 is the q = q_0 + lambda n at which an
//! alternation between (15) and (16) settles. In (15), n is the eigenvector of the least eigenvalue
//! of the covariance about q weighted by theta. In (16), lambda is the nearest minimum of sum
//! theta(|p_i - q|) <n, p_i - q>^2. At the end lambda = 0, so the surface is the zero set of
//!
//! F(x) = - sum w_i d_i (1 - d_i^2 / h^2) / sum w_i,  w_i = theta(|p_i - x|),  d_i = <n(x),
//! p_i - x>,
//!
//! which gives it an exact normal (grad F, which differs from the n of (15) by O(h^2)). In
//! codimension m there are m least eigenvalues, n is a matrix, and lambda, d and F are vectors.
//! Planes are fitted (degree 1): the surface lies O(h^2) off the one sampled, (kappa_1 + kappa_2)
//! h^2 / 4 towards its centres of curvature, and lengths err accordingly. It is the paper's
//! reference; lengths should be measured on the [atlas](crate::surface::atlas).
//!
//! What the paper leaves open is decided as follows. Weights end at 5 h, where they are 1e-11. Only
//! points of the same sheet take part, those of charts reached from the node's own chart along the
//! atlas's graph. A q_0 more than h / 2 from the chart is first put onto the chart, because (15)
//! finds the normal only near the points.

use thiserror::Error;

use crate::error;
use crate::geodesics::Geodesics;
use crate::guess::Guide;
use crate::guess::graph::Graph;
use crate::surface::atlas::{Atlas, ChartIndex, Lists};
use crate::surface::level_set::LevelSet;
use crate::surface::{Geometry, Node, Surface};
use crate::{Matrix, Vector, parallel};

/// The spacing h that is used unless one is given, in median distances between neighbouring points.
const SPACINGS: f64 = 1.5;
/// The largest spacing h, in median distances between neighbouring points.
const MOST_SPACINGS: f64 = 10.0;
/// Distance beyond which points take no part, in h.
const CUTOFF_WEIGHTS: f64 = 5.0;
/// Most alternations between (15) and (16).
const MOST_ALTERNATIONS: usize = 60;
/// Most steps of Newton's method to solve (16).
const MOST_NEWTON_STEPS: usize = 30;
/// Step of the differences of the normal, in h: they err by its square.
const NORMAL_DIFFERENCE: f64 = 1e-4;

/// The error for a spacing h that is not a length, or is so long that every point would take part
/// in every fit.
#[derive(Clone, Debug, Error, PartialEq)]
#[error(
    "the spacing h of moving least squares is {found}, expected a length above 0 and up to {largest}"
)]
pub struct BadSpacing {
    /// The value given.
    pub found: f64,
    /// The largest value that is accepted, 10 median spacings: every fit costs the points within 5
    /// h.
    pub largest: f64,
}

/// The moving least squares surface of a cloud.
pub struct MovingLeastSquares<const D: usize> {
    atlas: Atlas<D>,
    h: f64,
    /// For each chart, the points of its cell.
    owned: Lists,
    /// For each chart, the distance from its origin to the farthest of its points.
    extents: Vec<f64>,
    /// For each chart, the charts of its sheet whose points may take part at a node of its cell.
    around: Lists,
}

/// The weighted plane through a point, (15): the covariance's eigenvectors by ascending eigenvalue,
/// the first m of them normal, and the sum of the weights.
struct Plane<const D: usize> {
    vectors: Matrix<D>,
    eigenvalues: [f64; D],
    weight: f64,
}

impl<const D: usize> MovingLeastSquares<D> {
    /// The moving least squares surface of the atlas's points; `h` is in the input's units, or 1.5
    /// median spacings if `None`.
    ///
    /// # Errors
    /// [`BadSpacing`] where `h` is not a length between 0 and 10 median spacings.
    ///
    /// O(n) times the number of charts within 5 h.
    pub fn new(atlas: Atlas<D>, h: Option<f64>) -> Result<Self, BadSpacing> {
        let spacing = median_spacing(&atlas);
        let h = h.unwrap_or(SPACINGS * spacing);
        let largest = MOST_SPACINGS * spacing;
        if h.is_nan() || h <= 0.0 || h > largest {
            return Err(BadSpacing { found: h, largest });
        }
        let mut cells = vec![Vec::new(); atlas.charts.len()];
        for (point, owner) in (0..atlas.cloud.points.len() as u32).zip(&atlas.owners) {
            cells[*owner as usize].push(point);
        }
        let extents: Vec<f64> = cells
            .iter()
            .zip(&atlas.charts)
            .map(|(cell, chart)| {
                let gap = |p: &u32| (atlas.cloud.points[*p as usize] - chart.origin).norm();
                cell.iter().map(gap).fold(0.0, f64::max)
            })
            .collect();
        let around = parallel::map(atlas.charts.len(), |home| {
            sheet_around(&atlas, &extents, home as u32, CUTOFF_WEIGHTS * h)
        });
        Ok(Self {
            owned: Lists::new(cells.iter().map(|cell| cell.iter().copied())),
            around: Lists::new(around.iter().map(|list| list.iter().copied())),
            atlas,
            h,
            extents,
        })
    }

    /// The anticipated spacing h, in the input's units.
    #[must_use]
    pub fn h(&self) -> f64 {
        self.h
    }

    /// The atlas that keeps the sheets apart.
    #[must_use]
    pub fn atlas(&self) -> &Atlas<D> {
        &self.atlas
    }

    /// The node of an input row, projected onto the surface.
    ///
    /// # Errors
    /// The errors of [`Atlas::node_of_row`], and [`Error::NoFoot`](error::Error::NoFoot) where the
    /// projection does not arrive.
    pub fn node_of_row(&self, row: usize) -> Result<Node<D, ChartIndex>, error::Error> {
        self.projected(&self.atlas.node_of_row(row)?)
    }

    /// The node nearest to a point given in the input's coordinates.
    ///
    /// # Errors
    /// The errors of [`Atlas::node_near`], and [`Error::NoFoot`](error::Error::NoFoot) where the
    /// projection does not arrive.
    pub fn node_near(&self, x: &Vector<D>) -> Result<Node<D, ChartIndex>, error::Error> {
        self.projected(&self.atlas.node_near(x)?)
    }

    /// A node of the atlas, projected onto this surface.
    fn projected(&self, node: &Node<D, ChartIndex>) -> Result<Node<D, ChartIndex>, error::Error> {
        let mut place = node.place;
        let mut scratch = Geometry::new(D - self.atlas.intrinsic_dimension());
        match self.foot(&node.point, &mut place, &mut scratch) {
            Some(point) => Ok(Node { point, place }),
            None => Err(error::Error::NoFoot {
                point: format!("{:?}", (node.point + self.atlas.cloud.centre).as_slice()),
                reason: "too few points lie within the spacing h of moving least squares; give a larger h",
            }),
        }
    }

    /// Gathers the points that take part at `x`, relative to it.
    fn gather(&self, x: &Vector<D>, place: ChartIndex, offsets: &mut Vec<Vector<D>>) {
        offsets.clear();
        let cutoff = CUTOFF_WEIGHTS * self.h;
        for chart in self.around.of(place) {
            let reach = cutoff + self.extents[*chart as usize];
            let origin = self.atlas.charts[*chart as usize].origin;
            if (origin - x).norm_squared() > reach * reach {
                continue;
            }
            for point in self.owned.of(*chart) {
                let offset = self.atlas.cloud.points[*point as usize] - x;
                if offset.norm_squared() <= cutoff * cutoff {
                    offsets.push(offset);
                }
            }
        }
    }

    /// The weight theta of (14), by the square of its argument.
    fn weight(&self, squared: f64) -> f64 {
        (-squared / (self.h * self.h)).exp()
    }

    /// The plane of (15); `None` where the points determine no plane.
    fn plane(&self, offsets: &[Vector<D>]) -> Option<Plane<D>> {
        let m = D - self.atlas.intrinsic_dimension();
        let mut covariance = Matrix::<D>::zeros();
        let mut weight = 0.0;
        for offset in offsets {
            let w = self.weight(offset.norm_squared());
            weight += w;
            covariance += offset * (offset * w).transpose();
        }
        if weight.is_nan() || weight <= f64::MIN_POSITIVE {
            return None;
        }
        covariance /= weight;
        let eigen = nalgebra::SymmetricEigen::try_new(
            nalgebra::DMatrix::from_column_slice(D, D, covariance.as_slice()),
            f64::EPSILON,
            200,
        )?;
        let mut order: [usize; D] = std::array::from_fn(|i| i);
        order.sort_unstable_by(|a, b| {
            let values = &eigen.eigenvalues;
            values[*a].total_cmp(&values[*b]).then(a.cmp(b))
        });
        let eigenvalues = order.map(|j| eigen.eigenvalues[j]);
        let gap = eigenvalues[m] - eigenvalues[m - 1];
        if gap.is_nan() || gap <= 1e-6 * eigenvalues[D - 1] {
            return None;
        }
        Some(Plane {
            vectors: Matrix::from_fn(|i, j| eigen.eigenvectors[(i, order[j])]),
            eigenvalues,
            weight,
        })
    }

    /// The shift n lambda of (16), by Newton's method on the derivative: for each |lambda_a| <= h,
    /// the minimum that is nearest to 0.
    fn shift(&self, offsets: &[Vector<D>], plane: &Plane<D>) -> Vector<D> {
        let m = D - self.atlas.intrinsic_dimension();
        let inverse = 1.0 / (self.h * self.h);
        let mut lambda = Vector::<D>::zeros();
        for _ in 0..MOST_NEWTON_STEPS {
            let mut moved = 0.0_f64;
            for a in 0..m {
                let (mut first, mut second, mut mean, mut sum) = (0.0, 0.0, 0.0, 0.0);
                let at = plane.vectors * lambda;
                let normal = plane.vectors.column(a);
                for offset in offsets {
                    let rest = offset - at;
                    let w = self.weight(rest.norm_squared());
                    let u = rest.dot(&normal);
                    let square = u * u * inverse;
                    let all = self.squared_height(&rest, plane) * inverse;
                    first += w * u * (all - 1.0);
                    second += w * (1.0 - all - 4.0 * square + 2.0 * square * all);
                    mean += w * u;
                    sum += w;
                }
                if sum <= 0.0 {
                    return Vector::repeat(f64::NAN);
                }
                // Where the sum is not convex, the minimum of (16) lies towards the mean.
                let convex = second > 0.1 * sum;
                let step = if convex { -first / second } else { mean / sum };
                let next = (lambda[a] + step).clamp(-self.h, self.h);
                moved = moved.max((next - lambda[a]).abs());
                lambda[a] = next;
            }
            if moved <= f64::EPSILON * self.h {
                break;
            }
        }
        plane.vectors * lambda
    }

    /// |d|^2 of an offset.
    fn squared_height(&self, offset: &Vector<D>, plane: &Plane<D>) -> f64 {
        let m = D - self.atlas.intrinsic_dimension();
        (0..m)
            .map(|a| offset.dot(&plane.vectors.column(a)).powi(2))
            .sum()
    }

    /// The gradients of F, up to a factor that is constant to first order on the surface.
    fn gradients(
        &self,
        x: &Vector<D>,
        place: ChartIndex,
        offsets: &mut Vec<Vector<D>>,
        out: &mut [Vector<D>],
    ) -> Option<()> {
        self.gather(x, place, offsets);
        let plane = self.plane(offsets)?;
        let m = out.len();
        let inverse = 1.0 / (self.h * self.h);
        // Eigenvectors have no sign, and none of a pair of equal eigenvalues is distinguished.
        // Components of n F along the home chart's normals do not depend on them.
        let home = self.atlas.charts[place as usize]
            .frame
            .tr_mul(&plane.vectors);
        out.fill(Vector::zeros());
        for a in 0..m {
            let normal = plane.vectors.column(a);
            // F_a = -sum w d_a (1 - |d|^2 / h^2) / sum w has a derivative at fixed n, which is
            // computed here, and derivatives by the normals, `by_normal`.
            let mut direct = Vector::zeros();
            let mut by_normal = [Vector::<D>::zeros(); D];
            for offset in offsets.iter() {
                let w = self.weight(offset.norm_squared());
                let d = offset.dot(&normal);
                let rest = 1.0 - self.squared_height(offset, &plane) * inverse;
                direct += offset * (2.0 * inverse * w * d * rest);
                for (b, by) in by_normal[..m].iter_mut().enumerate() {
                    let other = plane.vectors.column(b);
                    let mut slope = -2.0 * inverse * d * offset.dot(&other);
                    if a == b {
                        slope += rest;
                    }
                    direct -= other * (w * slope);
                    *by += offset * (w * slope);
                }
            }
            // The derivatives by the normals are multiplied by how those eigenvectors turn:
            // dn_b = -(C - eigenvalue_b)^+ dC n_b.
            let mut turning = Vector::zeros();
            for (b, by) in by_normal[..m].iter().enumerate() {
                let mut y = Vector::zeros();
                for j in m..D {
                    let vector = plane.vectors.column(j);
                    y += vector * (vector.dot(by) / (plane.eigenvalues[j] - plane.eigenvalues[b]));
                }
                let other = plane.vectors.column(b);
                for offset in offsets.iter() {
                    let w = self.weight(offset.norm_squared());
                    let (d, along) = (offset.dot(&other), offset.dot(&y));
                    turning += offset * (2.0 * inverse * w * along * d)
                        - y * (w * d)
                        - other * (w * along);
                }
            }
            let gradient = (turning / plane.weight - direct) / plane.weight;
            for (i, component) in out.iter_mut().enumerate() {
                *component += gradient * home[(i, a)];
            }
        }
        Some(())
    }
}

/// The median over the charts of the distance between neighbouring points.
fn median_spacing<const D: usize>(atlas: &Atlas<D>) -> f64 {
    let mut spacings: Vec<f64> = atlas.charts.iter().map(|chart| chart.spacing).collect();
    let middle = spacings.len() / 2;
    *spacings.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The charts whose points may lie within `cutoff` of a point of the home chart's cell. They are
/// reached along the atlas's graph without leaving that ball or turning a single normal by a right
/// angle.
fn sheet_around<const D: usize>(
    atlas: &Atlas<D>,
    extents: &[f64],
    home: u32,
    cutoff: f64,
) -> Vec<u32> {
    let chart = &atlas.charts[home as usize];
    let one_normal = atlas.intrinsic_dimension() + 1 == D;
    let home_normal = chart.frame.column(0).into_owned();
    let mut reached = std::collections::BTreeMap::from([(home, home_normal)]);
    let mut queue = vec![home];
    while let Some(current) = queue.pop() {
        let normal = reached[&current];
        for next in atlas.neighbours.of(current) {
            let other = &atlas.charts[*next as usize];
            let column = other.frame.column(0);
            let carried = column * 1.0_f64.copysign(column.dot(&normal));
            let gap = (other.origin - chart.origin).norm();
            if gap <= cutoff + chart.radius + extents[*next as usize]
                && (!one_normal || carried.dot(&home_normal) > 0.0)
                && !reached.contains_key(next)
            {
                reached.insert(*next, carried);
                queue.push(*next);
            }
        }
    }
    reached.into_keys().collect()
}

impl<const D: usize> Surface<D> for MovingLeastSquares<D> {
    type Place = ChartIndex;

    fn intrinsic_dimension(&self) -> usize {
        self.atlas.intrinsic_dimension()
    }

    fn origin(&self) -> Vector<D> {
        self.atlas.cloud.centre
    }

    fn foot(
        &self,
        x: &Vector<D>,
        place: &mut ChartIndex,
        _scratch: &mut Geometry<D>,
    ) -> Option<Vector<D>> {
        if !self.atlas.locate(x, place) {
            return None;
        }
        let m = D - self.atlas.intrinsic_dimension();
        let mut heights = [0.0; D];
        let chart = &self.atlas.charts[*place as usize];
        chart.offsets(&self.atlas.monomials, x, &mut heights[..m]);
        let height = chart.frame * Vector::from(heights);
        let near = height.norm() <= 0.5 * self.h;
        let mut q = if near { *x } else { x - height };
        let mut offsets = Vec::new();
        let mut last = f64::INFINITY;
        for _ in 0..MOST_ALTERNATIONS {
            if !self.atlas.locate(&q, place) {
                return None;
            }
            self.gather(&q, *place, &mut offsets);
            let plane = self.plane(&offsets)?;
            let shift = self.shift(&offsets, &plane);
            q += shift;
            let size = shift.norm();
            let rounding = 4.0 * f64::EPSILON * q.amax();
            if size <= rounding || (size >= 0.5 * last && size <= 64.0 * rounding) {
                return Some(q);
            }
            last = size;
        }
        None
    }

    fn geometry(&self, x: &Vector<D>, place: ChartIndex, out: &mut Geometry<D>) -> bool {
        let m = out.codimension;
        let mut offsets = Vec::new();
        if self
            .gradients(x, place, &mut offsets, &mut out.gradients)
            .is_none()
            || !out.factor()
        {
            return false;
        }
        let Some(plane) = self.plane(&offsets) else {
            return false;
        };
        let shift = self.shift(&offsets, &plane);
        for (value, gradient) in out.values.iter_mut().zip(&out.gradients) {
            *value = -gradient.dot(&shift);
        }
        // There is no closed-form second derivative, so central differences of the gradients are
        // taken along the tangents.
        let step = NORMAL_DIFFERENCE * self.h;
        let (mut ahead, mut behind) = ([Vector::zeros(); D], [Vector::zeros(); D]);
        out.hessians.fill(Matrix::zeros());
        for j in 0..D - m {
            let t = out.tangent(j);
            let mut at = |shift: f64, into: &mut [Vector<D>]| {
                self.gradients(&(x + t * shift), place, &mut offsets, into)
            };
            if at(step, &mut ahead[..m]).is_none() || at(-step, &mut behind[..m]).is_none() {
                return false;
            }
            for a in 0..m {
                let slope = (ahead[a] - behind[a]) / (4.0 * step) * t.transpose();
                out.hessians[a] += slope + slope.transpose();
            }
        }
        true
    }

    fn beyond_rim(&self, x: &Vector<D>, place: ChartIndex) -> Option<(f64, Vector<D>)> {
        self.atlas.beyond_rim(x, place)
    }

    fn rim(&self) -> Vec<(Node<D, ChartIndex>, Vector<D>, f64)> {
        self.atlas.rim()
    }

    fn resolution(&self, place: ChartIndex) -> f64 {
        self.atlas.resolution(place)
    }
}

impl<const D: usize> Guide<D> for MovingLeastSquares<D> {
    fn entrances(&self, node: &Node<D, ChartIndex>, visit: &mut dyn FnMut(u32)) {
        self.atlas.entrances(node, visit);
    }
}

impl<const D: usize> Geodesics<D, MovingLeastSquares<D>> {
    /// Makes the moving least squares surface of an atlas's points ready for path queries; `h` is
    /// in the input's units, or 1.5 median spacings if `None`.
    ///
    /// # Errors
    /// The errors of [`MovingLeastSquares::new`].
    pub fn of_mls(atlas: Atlas<D>, h: Option<f64>) -> Result<Self, BadSpacing> {
        let surface = MovingLeastSquares::new(atlas, h)?;
        let atlas = &surface.atlas;
        let origins = atlas.charts.iter().zip(0..);
        let nodes = origins
            .map(|(chart, place)| Node {
                point: chart.origin,
                place,
            })
            .collect();
        let lists = (0..atlas.neighbours.len() as u32).map(|i| atlas.neighbours.of(i));
        let graph = Graph::new(nodes, lists);
        Ok(Self::with_graph(surface, graph))
    }
}

#[cfg(test)]
mod tests;
