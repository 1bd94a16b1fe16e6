//! A geodesic shot from a point of a two-dimensional surface, with its Jacobi field, and how it
//! passes a target.
//!
//! x'' = II(x', x') and J'' = -K J are integrated to a tolerance that tells apart ways to nearly
//! conjugate points.

use crate::Vector;
use crate::geodesics::runge_kutta::{FIFTH, STAGES, THIRD};
use crate::surface::{Geometry, Node, Surface};

/// A place on a ray, with the geometry and the Jacobi field there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Knot<const D: usize, P> {
    /// Length of the ray from the source, in the input's units.
    pub length: f64,
    pub point: Vector<D>,
    /// The unit tangent along the ray.
    pub ahead: Vector<D>,
    /// The unit tangent at a right angle to the ray, to the same side all along.
    pub side: Vector<D>,
    /// The normal curvature vector II(x', x') of the ray.
    pub normal_curvature: Vector<D>,
    /// A bound of the normal curvatures of the surface here.
    pub curvature: f64,
    /// The Gauss curvature here.
    gauss: f64,
    /// The Jacobi field J and its derivative J'; at the source they are 0 and 1.
    pub jacobi: [f64; 2],
    pub place: P,
}

/// The place where a ray is nearest to the target.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pass<const D: usize, P> {
    pub knot: Knot<D, P>,
    /// How far the target lies to the side of the ray, in the input's units, with a sign.
    pub miss: f64,
    /// Whether the ray has no conjugate point before this place.
    pub minimal: bool,
}

/// A ray with the places where it passes the target.
#[derive(Clone, Debug)]
pub(crate) struct Ray<const D: usize, P> {
    /// The angle at which the ray leaves its source, in radians.
    pub angle: f64,
    pub knots: Vec<Knot<D, P>>,
    pub passes: Vec<Pass<D, P>>,
    /// Length at the first conjugate point; infinite where there is none.
    pub conjugate: f64,
    /// Whether the ray was followed to its full length.
    pub complete: bool,
}

/// The target that rays are shot at.
pub(crate) struct Aim<'a, const D: usize, S: Surface<D>> {
    pub surface: &'a S,
    pub target: Node<D, S::Place>,
    /// The size of the problem, which is the length of the shortest path known: errors are relative
    /// to it.
    pub scale: f64,
}

/// Longest step, in radii of curvature.
const LONGEST_SWEEP_STEP: f64 = 0.6;
/// Longest step, in radii of charts.
const CHARTS: f64 = 8.0;
/// Shortest step, as a share of the longest: a ray ends where steps must be shorter.
const SHORTEST_SWEEP_STEP: f64 = 1e-4;
/// Most steps of one ray, tried ones included.
const MOST_SWEEP_STEPS: usize = 5_000;
/// Largest distance of the target from a ray that passes it, in radii of curvature.
const NEAR_PASS: f64 = 0.5;
/// Weight of the error of the Jacobi field in the error of a step.
const SPREADING: f64 = 0.1;
/// Distance along the ray, as a share of the scale, at which a pass is found: the miss changes by
/// its square only.
const PASS_FOUND: f64 = 1e-13;
/// Most tries to find a pass.
const MOST_TRIES: usize = 8;
/// Relative distance from a pass at which a conjugate point may lie behind the pass.
const AT_CONJUGATE: f64 = 1e-3;
/// Relative error of steps below which it is useless to go, per unit of the surface's height error
/// over a chart's radius.
const ROUGH_SWEEP_STEP: f64 = 1.0;

/// A step of a ray.
pub(crate) struct Step<K> {
    /// The knot where the step ends.
    pub end: K,
    /// Estimated error of the step, in the input's units.
    pub error: f64,
    /// Whether a crease lies on the step.
    pub is_creased: bool,
}

/// The state that is integrated: position, velocity, J and J'.
#[derive(Clone, Copy)]
pub(crate) struct State<const D: usize> {
    pub x: Vector<D>,
    pub v: Vector<D>,
    pub j: [f64; 2],
}

impl<const D: usize> State<D> {
    /// The state moved by a step along the weighted sum of slopes.
    pub fn moved(&self, step: f64, slopes: &[Self], weights: &[f64]) -> Self {
        let mut moved = *self;
        for (slope, weight) in slopes.iter().zip(weights) {
            let share = step * weight;
            moved.x += slope.x * share;
            moved.v += slope.v * share;
            moved.j[0] += slope.j[0] * share;
            moved.j[1] += slope.j[1] * share;
        }
        moved
    }
}

impl<const D: usize, S: Surface<D>> Aim<'_, D, S> {
    /// Relative error below which it is useless to go, by the surface's own error at both ends.
    pub fn roughness(&self, from: &Node<D, S::Place>) -> f64 {
        let at = |place: S::Place| {
            let resolution = self.surface.resolution(place);
            if resolution > 0.0 {
                ROUGH_SWEEP_STEP * self.surface.height_error(place) / resolution
            } else {
                0.0
            }
        };
        at(from.place).max(at(self.target.place))
    }

    /// Takes the geometry at a point near the surface; `place` is brought up to date.
    fn geometry_at(
        &self,
        x: &Vector<D>,
        place: &mut S::Place,
        geometry: &mut Geometry<D>,
    ) -> Option<()> {
        let surface = self.surface;
        let known =
            surface.find_place(x, place, geometry) && surface.cheap_geometry(x, *place, geometry);
        known.then_some(())
    }

    /// The start of the ray that leaves a point at an angle, counted from its first tangent to its
    /// second.
    fn start(
        &self,
        from: &Node<D, S::Place>,
        angle: f64,
        geometry: &mut Geometry<D>,
    ) -> Option<Knot<D, S::Place>> {
        let mut place = from.place;
        self.geometry_at(&from.point, &mut place, geometry)?;
        let (e, f) = (geometry.tangent(0), geometry.tangent(1));
        let (sin, cos) = angle.sin_cos();
        let ahead = e * cos + f * sin;
        let side = f * cos - e * sin;
        Some(knot(
            0.0,
            from.point,
            [ahead, side],
            [0.0, 1.0],
            place,
            geometry,
        ))
    }

    /// The ray that leaves a point at an angle, up to a length; `None` where the point has no
    /// tangent plane.
    pub fn shoot(
        &self,
        from: &Node<D, S::Place>,
        angle: f64,
        longest: f64,
        tolerance: f64,
    ) -> Option<Ray<D, S::Place>> {
        let mut geometry = Geometry::new(D - 2);
        let mut last = self.start(from, angle, &mut geometry)?;
        let mut ray = Ray {
            angle,
            knots: vec![last],
            passes: Vec::new(),
            conjugate: f64::INFINITY,
            complete: false,
        };
        let mut step = f64::INFINITY;
        for _ in 0..MOST_SWEEP_STEPS {
            if last.length >= longest {
                ray.complete = true;
                break;
            }
            let resolution = self.surface.resolution(last.place);
            let mut most = LONGEST_SWEEP_STEP / last.curvature.max(1.0 / self.scale);
            let mut allowed = tolerance;
            if resolution > 0.0 {
                most = most.min(CHARTS * resolution);
                allowed = allowed
                    .max(ROUGH_SWEEP_STEP * self.surface.height_error(last.place) / resolution);
            }
            // The last step ends just beyond the length asked for, so that the loop ends there.
            step = step.min(most).min(longest - last.length + 1e-9 * longest);
            let taken = self.advance(&last, step, &mut geometry);
            let Some(Step {
                end: next,
                error,
                is_creased,
            }) = taken
            else {
                step *= 0.5;
                if step < SHORTEST_SWEEP_STEP * most {
                    break;
                }
                continue;
            };
            let excess = error / (allowed * step);
            let change = 0.9 * excess.max(1e-6).powf(-1.0 / 7.0);
            if excess > 1.0 && step > SHORTEST_SWEEP_STEP * most {
                step *= change.max(0.2);
                continue;
            }
            if is_creased {
                step *= 0.5;
                if step < SHORTEST_SWEEP_STEP * most {
                    break;
                }
                continue;
            }
            if self.surface.beyond_rim(&next.point, next.place).is_some() {
                break;
            }
            if ray.conjugate.is_infinite() && next.jacobi[0] <= 0.0 {
                let share = last.jacobi[0] / (last.jacobi[0] - next.jacobi[0]);
                ray.conjugate = last.length + share * (next.length - last.length);
            }
            self.pass(
                [&last, &next],
                &mut ray,
                PASS_FOUND.max(0.1 * tolerance),
                &mut geometry,
            );
            last = next;
            ray.knots.push(last);
            step *= change.min(3.0);
        }
        Some(ray)
    }

    /// The nodes at ascending lengths on a ray, each by a step from the knot before it; `None`
    /// where a step gets lost.
    pub fn nodes_at(
        &self,
        ray: &Ray<D, S::Place>,
        lengths: impl Iterator<Item = f64>,
    ) -> Option<Vec<Node<D, S::Place>>> {
        let mut geometry = Geometry::new(D - 2);
        let mut last = *ray.knots.first()?;
        let node_at = |length: f64| {
            let before = ray.knots.partition_point(|knot| knot.length <= length);
            if let Some(knot) = before.checked_sub(1).and_then(|i| ray.knots.get(i))
                && knot.length > last.length
            {
                last = *knot;
            }
            last = self
                .advance(&last, length - last.length, &mut geometry)?
                .end;
            let (point, place) = (last.point, last.place);
            Some(Node { point, place })
        };
        lengths.map(node_at).collect()
    }

    /// One step; `None` where it leaves what is known of the surface.
    fn advance(
        &self,
        from: &Knot<D, S::Place>,
        step: f64,
        geometry: &mut Geometry<D>,
    ) -> Option<Step<Knot<D, S::Place>>> {
        let start = State {
            x: from.point,
            v: from.ahead,
            j: from.jacobi,
        };
        let mut slopes = [start; 12];
        slopes[0] = State {
            x: from.ahead,
            v: from.normal_curvature,
            j: [from.jacobi[1], -from.gauss * from.jacobi[0]],
        };
        let mut place = from.place;
        let mut stage = start;
        for (i, weights) in STAGES.iter().enumerate() {
            stage = start.moved(step, &slopes[..=i], weights);
            self.geometry_at(&stage.x, &mut place, geometry)?;
            if let Some(slope) = slopes.get_mut(i + 1) {
                *slope = State {
                    x: stage.v,
                    v: geometry.normal_curvature(&stage.v),
                    j: [
                        stage.j[1],
                        -gauss(&geometry.second_fundamental_form()) * stage.j[0],
                    ],
                };
            }
        }
        let error_by = |weights| {
            let end = start.moved(step, &slopes, weights);
            (end.x - start.x).norm() + SPREADING * (end.j[0] - start.j[0]).abs()
        };
        // The error estimate combines both embedded formulae, as the code DOP853 does.
        let (fifth, third) = (error_by(&FIFTH), error_by(&THIRD));
        let error = if fifth > 0.0 {
            fifth * fifth / fifth.hypot(0.1 * third)
        } else {
            0.0
        };
        let off = geometry.pseudo_inverse(&geometry.values);
        let ahead = geometry.project(&stage.v).try_normalize(0.5)?;
        let (e, f) = (geometry.tangent(0), geometry.tangent(1));
        let side = f * e.dot(&ahead) - e * f.dot(&ahead);
        let side = if side.dot(&from.side) < 0.0 {
            -side
        } else {
            side
        };
        let point = stage.x - off;
        let followed = (point - from.point).norm() <= 1.001 * step && off.norm() <= 0.1 * step;
        if !(error.is_finite() && followed) {
            return None;
        }
        let length = from.length + step;
        let next = knot(length, point, [ahead, side], stage.j, place, geometry);
        let turning = from.curvature.max(next.curvature) * step;
        let is_creased = self.surface.resolution(place) == 0.0
            && (geometry.is_creased([&stage.v], 0.0) || geometry.is_creased([&from.side], turning));
        Some(Step {
            end: next,
            error,
            is_creased,
        })
    }

    /// Notes the place where a step passes the target, if it does.
    fn pass(
        &self,
        [from, to]: [&Knot<D, S::Place>; 2],
        ray: &mut Ray<D, S::Place>,
        found: f64,
        geometry: &mut Geometry<D>,
    ) {
        let ahead = |k: &Knot<D, S::Place>| (self.target.point - k.point).dot(&k.ahead);
        let (before, after) = (ahead(from), ahead(to));
        if !(before > 0.0 && after <= 0.0) {
            return;
        }
        let reach = NEAR_PASS / to.curvature.max(1.0 / self.scale);
        if (self.target.point - to.point).norm() > reach + (to.length - from.length) {
            return;
        }
        let whole = to.length - from.length;
        let mut step = whole * before / (before - after);
        let mut at = *to;
        // Newton's method along the ray: a place is abreast of the target where no way is left
        // ahead.
        for _ in 0..MOST_TRIES {
            let Some(Step { end: there, .. }) =
                self.advance(from, step.clamp(0.0, 1.1 * whole), geometry)
            else {
                return;
            };
            at = there;
            let left = ahead(&at);
            if left.abs() <= found * self.scale {
                break;
            }
            step += left;
        }
        let gap = self.target.point - at.point;
        let miss = gap.dot(&at.side);
        let height = (gap - at.ahead * gap.dot(&at.ahead) - at.side * miss).norm();
        let slack = 1e-7 * self.scale + 10.0 * self.surface.height_error(at.place);
        if gap.norm() > reach || height > at.curvature * gap.norm_squared() + slack {
            return;
        }
        ray.passes.push(Pass {
            knot: at,
            miss,
            minimal: ray.conjugate > (1.0 - AT_CONJUGATE) * at.length,
        });
    }
}

/// A knot with what the geometry tells.
fn knot<const D: usize, P>(
    length: f64,
    point: Vector<D>,
    [ahead, side]: [Vector<D>; 2],
    jacobi: [f64; 2],
    place: P,
    geometry: &Geometry<D>,
) -> Knot<D, P> {
    let form = geometry.second_fundamental_form();
    let [first, both, last] = form.map(|normal_curvature| normal_curvature.norm_squared());
    Knot {
        length,
        point,
        ahead,
        side,
        normal_curvature: geometry.normal_curvature(&ahead),
        curvature: (first + 2.0 * both + last).sqrt(),
        gauss: gauss(&form),
        jacobi,
        place,
    }
}

/// The Gauss curvature, from the second fundamental form.
fn gauss<const D: usize>(form: &[Vector<D>; 3]) -> f64 {
    form[0].dot(&form[2]) - form[1].norm_squared()
}

impl<const D: usize, P: Copy> Ray<D, P> {
    /// The pass nearest to a length along the ray.
    pub fn pass_near(&self, length: f64) -> Option<&Pass<D, P>> {
        let off = |pass: &&Pass<D, P>| (pass.knot.length - length).abs();
        self.passes.iter().min_by(|a, b| off(a).total_cmp(&off(b)))
    }

    /// Whether no ray within half of `turn`, in radians, to either side comes to the target before
    /// a conjugate point, except where this ray passes it. Neighbouring rays run J times their
    /// angle apart.
    pub fn clears(&self, target: &Vector<D>, turn: f64) -> bool {
        self.knots.windows(2).all(|pair| {
            let [a, b] = pair else { return true };
            let passed = |pass: &Pass<D, P>| {
                pass.knot.length >= a.length && pass.knot.length <= 1.001 * b.length
            };
            if a.length >= self.conjugate || self.passes.iter().any(passed) {
                return true;
            }
            let spread = a.jacobi[0].abs().max(b.jacobi[0].abs());
            let ends = (target - a.point).norm().min((target - b.point).norm());
            let passes =
                (target - a.point).dot(&a.ahead) > 0.0 && (target - b.point).dot(&b.ahead) <= 0.0;
            let nearest = if passes {
                let chord = b.point - a.point;
                let along = (target - a.point).dot(&chord) / chord.norm_squared();
                let step = b.length - a.length;
                let sagitta = 0.125 * a.curvature.max(b.curvature) * step * step;
                (target - a.point - chord * along.clamp(0.0, 1.0)).norm() - sagitta
            } else {
                ends
            };
            nearest > 0.75 * turn * spread
        })
    }
}
