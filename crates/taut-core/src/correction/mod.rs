//! Correction: a first guess is pulled taut to a tolerance [3.3].
//!
//! A guess is first straightened as a coarse polyline, which tells its length roughly. The
//! candidates that could be shortest are then put on polynomial elements, which are refined until
//! the estimated error of the length is within the tolerance. The result is a path with its error
//! estimates and its status.

pub(crate) mod band;
pub(crate) mod curve;
mod dents;
pub(crate) mod element;
pub(crate) mod flow;
pub(crate) mod length;
pub(crate) mod newton;
pub(crate) mod nodes;
mod rough;
mod straight;

pub(crate) use straight::{Straight, shares};

use crate::Vector;
use crate::correction::curve::Curve;
use crate::correction::newton::{Solved, Solver};
use crate::correction::rough::Rough;
use crate::result::{Path, Status};
use crate::surface::{Node, Surface, crease};

/// The method by which a guess is pulled taut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scheme {
    /// Newton's method on spectral elements.
    #[default]
    Newton,
    /// The paper's geodesic curvature flow (10) on a polyline, with nodes spread by (17)-(18). It
    /// is of second order, and kept for comparison.
    Flow,
}

/// What the correction may spend and must reach.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Largest relative error of the length.
    pub tolerance: f64,
    /// Most nodes of a path.
    pub most_nodes: usize,
    /// The method by which a guess is pulled taut.
    pub scheme: Scheme,
    /// Whether to shoot rays in all directions to find out whether the shortest path found is the
    /// shortest there is. It takes some milliseconds a path, and works on surfaces of dimension 2
    /// given by equations or clean clouds. Where the ends are nearly conjugate, it is done in any
    /// case.
    pub prove_shortest: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            tolerance: 1e-6,
            most_nodes: 8192,
            scheme: Scheme::Newton,
            prove_shortest: false,
        }
    }
}

/// A path that is being pulled taut, between levels.
#[derive(Clone)]
pub(crate) struct Taut<const D: usize, P> {
    pub curve: Curve<D, P>,
    pub level: Solved,
    pub steps: usize,
}

impl<const D: usize, P: Copy> Taut<D, P> {
    pub fn length(&self) -> f64 {
        self.level.measure.length
    }

    /// Whether two straightened paths are one: their lengths differ by at most the share
    /// `relative`, and their middles lie together.
    pub fn runs_with(&self, other: &Self, relative: f64) -> bool {
        (self.length() - other.length()).abs() <= relative * self.length()
            && (self.halfway() - other.halfway()).norm() <= 0.02 * self.length()
    }

    /// The place halfway along the path's chords.
    pub fn halfway(&self) -> Vector<D> {
        curve::halfway(self.curve.nodes.iter().map(|node| node.point))
    }
}

/// Turning per segment of the first polyline, in radians: fine enough to stay on its sheet of the
/// surface, and coarse enough that a zigzag guess is smoothed by a few steps.
const COARSE_TURNING: f64 = 0.4;
/// Least number of segments of the first polyline.
const COARSE_SEGMENTS: usize = 8;
/// Most times that the first polyline is tried, each time finer because a segment left the surface.
const MOST_COARSE_LEVELS: usize = 4;
/// Turning per element of the final path, in radians.
pub(crate) const ELEMENT_TURNING: f64 = 1.6;
/// Relative error of the length of a straightened polyline, by arcs (19) on segments that turn by
/// [`COARSE_TURNING`].
const COARSE_ERROR: f64 = 0.01;
/// Factor of the estimated error of elements whose modes fall slowly, on equations.
const SLOW: f64 = 16.0;
/// Most Newton steps on a polyline.
const MOST_POLYLINE_STEPS: usize = 25;
/// Most Newton steps per level of the final path; a path that is not taut after them may need more
/// nodes first.
const LEVEL_STEPS: usize = 12;
/// Relative error of the length that Newton may leave on the cheap view of a surface, far above the
/// error of that view.
const ROUGH_TOLERANCE: f64 = 1e-7;
/// Most Newton steps on the cheap view of a surface.
const ROUGH_STEPS: usize = 6;
/// Most escapes from saddles.
const MOST_ESCAPES: usize = 4;
/// Most levels of the final path, between which elements are halved.
const MOST_ELEMENT_LEVELS: usize = 10;

/// Pulls a guess roughly taut on a polyline: enough to tell its length to a few parts in a
/// thousand.
///
/// A polyline can shorten itself by leaping through space from one part of the surface to another.
/// Where one does, it is begun anew with twice the segments. `None` where the guess cannot be
/// followed.
pub(crate) fn straighten<const D: usize, S: Surface<D>>(
    surface: &S,
    guess: &[Node<D, S::Place>],
    solver: &mut Solver<D, S::Place>,
) -> Option<Straight<D, S::Place>> {
    let surface = &Rough(surface);
    let profile = nodes::profile(surface, guess, &mut solver.scratch);
    let mut segments = ((profile.turning / COARSE_TURNING).ceil() as usize).max(COARSE_SEGMENTS);
    let mut steps = 0;
    let mut levels = 1;
    loop {
        let knots = if profile.length > 0.0 {
            profile.knots(segments)
        } else {
            vec![0.0, 1.0]
        };
        let mut curve = nodes::resample(surface, guess, &profile, &knots, &mut solver.scratch);
        let mut level = straighten_polyline(surface, &mut curve, solver)?;
        steps += level.steps;
        if levels == MOST_COARSE_LEVELS || !nodes::leaps(surface, &curve, &mut solver.scratch) {
            let profile = nodes::profile(surface, &curve.nodes, &mut solver.scratch);
            level.measure.length = length::arcs(&profile);
            let spread = straight::spread(surface, &curve, &profile, solver);
            let taut = Taut {
                curve,
                level,
                steps,
            };
            return Some(Straight {
                taut,
                profile,
                spread,
            });
        }
        segments *= 2;
        levels += 1;
    }
}

/// Newton's method on a polyline, with escapes from saddles.
fn straighten_polyline<const D: usize, S: Surface<D>>(
    surface: &S,
    curve: &mut Curve<D, S::Place>,
    solver: &mut Solver<D, S::Place>,
) -> Option<Solved> {
    let mut level = solver.solve(surface, curve, 1e-3, MOST_POLYLINE_STEPS)?;
    let mut steps = level.steps;
    for _ in 0..MOST_ESCAPES {
        if level.index == Some(0) || solver.escape(surface, curve).is_none() {
            break;
        }
        level = solver.solve(surface, curve, 1e-3, MOST_POLYLINE_STEPS)?;
        steps += level.steps;
    }
    level.steps = steps;
    Some(level)
}

/// Pulls a straightened path taut to the tolerance: on elements of higher degree, with spans by
/// curvature, which are halved until the error estimate is met.
///
/// Returns the path as far as it got; the status says whether it converged.
pub(crate) fn tighten<const D: usize, S: Surface<D>>(
    surface: &S,
    straight: Straight<D, S::Place>,
    settings: &Settings,
    solver: &mut Solver<D, S::Place>,
) -> Path<D> {
    if settings.scheme == Scheme::Flow {
        return flow::flow(surface, &straight.taut.curve.nodes, settings, solver);
    }
    let Straight {
        mut taut, profile, ..
    } = straight;
    let start_steps = taut.steps;
    if taut.level.measure.energy == 0.0 {
        return finish(surface, taut, Status::Converged, 0.0, solver);
    }
    let digits = -settings.tolerance.log10();
    let degree = ((3.0 + 0.8 * digits).round() as usize).clamp(4, element::MAXIMUM_DEGREE - 2);
    let detail = surface.detail();
    let by_detail = if detail > 0.0 {
        profile.length / detail
    } else {
        1.0
    };
    let elements = (profile.turning / ELEMENT_TURNING).max(by_detail).ceil() as usize;
    let elements = elements.clamp(1, (settings.most_nodes / (2 * degree)).max(1));
    let mut knots = spans_of(&taut.curve, &profile.knots(elements));
    let mut steps = start_steps;
    let mut escapes = 0;
    let mut error = COARSE_ERROR;
    // On clouds, the surface's own error covers this.
    let is_exact = surface.resolution(taut.curve.nodes[0].place) == 0.0;
    let slow = if is_exact { SLOW } else { 1.0 };
    // A level pulls the path taut on its elements, leaves a saddle if it is on one, or halves
    // elements that err.
    for _ in 0..MOST_ELEMENT_LEVELS {
        let roughly_taut = roughly_taut(surface, &taut, degree, &knots, solver);
        if let Some((_, more)) = roughly_taut {
            steps += more;
        }
        let refitted = roughly_taut.map(|(curve, _)| curve).or_else(|| {
            let scratch = &mut solver.scratch;
            taut.curve.refit(surface, degree, &knots, scratch)
        });
        let Some(mut curve) = refitted else {
            return finish(surface, taut, Status::OffSurface, error, solver);
        };
        let newton_tolerance = (0.01 * settings.tolerance).max(1e-15);
        let Some(level) = solver.solve(surface, &mut curve, newton_tolerance, LEVEL_STEPS) else {
            return finish(surface, taut, Status::OffSurface, error, solver);
        };
        steps += level.steps;
        taut = Taut {
            curve,
            level,
            steps,
        };
        if level.index.is_some_and(|index| index > 0)
            && escapes < MOST_ESCAPES
            && solver.escape(surface, &mut taut.curve).is_some()
        {
            escapes += 1;
            continue;
        }
        let energy = level.measure.energy;
        let tails = length::tails(&taut.curve, energy, slow);
        error = relative_error(&taut, tails.iter().sum());
        if error <= settings.tolerance && level.converged {
            return finish(surface, taut, Status::Converged, error, solver);
        }
        let share = 0.25 * settings.tolerance / tails.len() as f64;
        let marked: Vec<bool> = tails.iter().map(|tail| *tail > share).collect();
        let added = marked.iter().filter(|m| **m).count();
        if added == 0 && !level.converged {
            return finish(surface, taut, Status::NotTaut, error, solver);
        }
        if added == 0 || taut.curve.nodes.len() + added * degree > settings.most_nodes {
            return finish(surface, taut, Status::NotResolved, error, solver);
        }
        knots = nodes::insert(&taut.curve.spans, &marked);
    }
    finish(surface, taut, Status::NotResolved, error, solver)
}

/// The path on new elements, pulled taut on the cheap view of the surface and then put onto the
/// surface itself, with the number of steps taken. As a rule Newton has one step left then. `None`
/// where there is no cheap view or where this fails.
fn roughly_taut<const D: usize, S: Surface<D>>(
    surface: &S,
    taut: &Taut<D, S::Place>,
    degree: usize,
    knots: &[f64],
    solver: &mut Solver<D, S::Place>,
) -> Option<(Curve<D, S::Place>, usize)> {
    if !surface.has_cheap_view() {
        return None;
    }
    let rough = &Rough(surface);
    let refitted = taut.curve.refit(rough, degree, knots, &mut solver.scratch);
    let mut curve = refitted?;
    let level = solver.solve(rough, &mut curve, ROUGH_TOLERANCE, ROUGH_STEPS)?;
    let last = curve.nodes.len() - 1;
    for node in &mut curve.nodes[1..last] {
        node.point = surface.foot(&node.point, &mut node.place, &mut solver.scratch)?;
    }
    Some((curve, level.steps))
}

/// The parameters of the curve at which it has run given fractions of its length.
fn spans_of<const D: usize, P: Copy>(curve: &Curve<D, P>, fractions: &[f64]) -> Vec<f64> {
    let lengths: Vec<f64> = curve
        .nodes
        .windows(2)
        .map(|pair| (pair[1].point - pair[0].point).norm())
        .collect();
    let total: f64 = lengths.iter().sum();
    let shares: Vec<f64> = lengths.iter().map(|l| l / total).collect();
    let parameters = curve.parameters();
    let mut at = curve::Cursor::new(&shares);
    let mut knots: Vec<f64> = fractions
        .iter()
        .map(|fraction| {
            let (i, local) = at.seek(*fraction);
            parameters[i] + 0.5 * (1.0 + local) * (parameters[i + 1] - parameters[i])
        })
        .collect();
    if let Some(last) = knots.last_mut() {
        *last = 1.0;
    }
    knots
}

/// Estimated relative error of the length. It adds the energy's tail (half of it would be the
/// length's share; four times that covers spheres, tori and ellipsoids at every degree), what
/// Newton left, and rounding.
fn relative_error<const D: usize, P: Copy>(taut: &Taut<D, P>, tail: f64) -> f64 {
    let size = taut
        .curve
        .nodes
        .iter()
        .map(|node| node.point.amax())
        .fold(0.0, f64::max);
    let rounding = f64::EPSILON * (16.0 + 4.0 * size / taut.level.measure.length);
    2.0 * tail + taut.level.left.clamp(0.0, 1.0) + rounding
}

/// The finished path: nodes, normals and arc lengths, with its errors and what was reached.
fn finish<const D: usize, S: Surface<D>>(
    surface: &S,
    taut: Taut<D, S::Place>,
    status: Status,
    relative_error: f64,
    solver: &mut Solver<D, S::Place>,
) -> Path<D> {
    let length = taut.level.measure.length;
    let mut path = Path {
        status,
        length,
        length_error: if length > 0.0 {
            relative_error * length
        } else {
            0.0
        },
        surface_error: 0.0,
        stable: taut.level.index == Some(0),
        shortest: false,
        max_geodesic_curvature: 0.0,
        max_off_surface: 0.0,
        steps: taut.steps,
        points: Vec::with_capacity(taut.curve.nodes.len()),
        normals: Vec::with_capacity(taut.curve.nodes.len()),
        arc_length: taut.curve.arc_lengths(),
    };
    let mut height_errors = length::HeightErrors::default();
    let mut along_rim = Vec::new();
    let mut creases = crease::Search::new();
    let last = taut.curve.nodes.len() - 1;
    solver.weigh_pulls(&taut.curve);
    for (i, node) in taut.curve.nodes.iter().enumerate() {
        let known = solver.recall(i, last + 1)
            || surface.geometry(&node.point, node.place, &mut solver.scratch);
        let normal = if known {
            if (1..last).contains(&i) {
                let curvature = solver.geodesic_curvature(i);
                path.max_geodesic_curvature = path.max_geodesic_curvature.max(curvature);
            }
            let (before, after) = (i.saturating_sub(1), (i + 1).min(last));
            let stretch = 0.5 * (path.arc_length[after] - path.arc_length[before]);
            let chord = taut.curve.nodes[after].point - taut.curve.nodes[before].point;
            let tangent = solver.scratch.project(&chord);
            if stretch > 0.0 && tangent.norm() > 0.0 {
                let curvature = solver.scratch.normal_curvature(&tangent.normalize()).norm();
                let nodes = [before, i, after].map(|i| &taut.curve.nodes[i]);
                let (error, radius) = (
                    surface.height_error_along(nodes),
                    surface.resolution(node.place),
                );
                height_errors.add(stretch, curvature, error, radius);
                if surface.beyond_rim(&node.point, node.place).is_some() {
                    along_rim.push((stretch, radius));
                }
            }
            creases.visit(surface, node, &solver.scratch);
            let normal = solver.scratch.normal(0);
            // This comes last, as it takes the frame's memory.
            let off = solver.scratch.step_off();
            let off = off.map_or(f64::INFINITY, |step| step.norm());
            path.max_off_surface = path.max_off_surface.max(off);
            normal
        } else {
            path.max_off_surface = f64::INFINITY;
            Vector::zeros()
        };
        path.points.push(node.point);
        path.normals.push(normal);
    }
    if creases.found {
        path.length_error = f64::INFINITY;
        if path.status == Status::Converged {
            path.status = Status::NotResolved;
        }
    }
    for (stretch, radius) in along_rim {
        height_errors.add_rim(stretch, path.max_geodesic_curvature, radius);
    }
    path.surface_error = height_errors.length_error()
        + dents::detour(
            surface,
            &taut.curve.nodes,
            &path.arc_length,
            &mut solver.scratch,
        );
    path
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::implicit::{Equation, ImplicitSurface};
    use crate::{Matrix, Vector};

    #[test]
    fn great_circles_converge_to_each_tolerance() {
        let sphere = ImplicitSurface::new(
            Equation(|x: &Vector<3>| (x.dot(x) - 1.0, x * 2.0, Matrix::<3>::identity() * 2.0)),
            1.0,
        );
        let mut solver = Solver::new(1);
        let a = Vector::<3>::new(1.0, 0.0, 0.0);
        for angle in [0.1f64, 1.0, 2.0, 3.0, std::f64::consts::PI] {
            let b = Vector::<3>::new(angle.cos(), angle.sin() * 0.6, angle.sin() * 0.8);
            let c = (a + b + Vector::<3>::new(0.1, 0.2, 0.5)).normalize();
            let guess = [a, c, b].map(|point| Node { point, place: () });
            for tolerance in [1e-3, 1e-6, 1e-9, 1e-12] {
                let coarse = straighten(&sphere, &guess, &mut solver).expect("a path");
                let settings = Settings {
                    tolerance,
                    ..Settings::default()
                };
                let path = tighten(&sphere, coarse, &settings, &mut solver);
                let error = (path.length / angle - 1.0).abs();
                assert!(
                    path.converged()
                        && error <= tolerance
                        && path.length_error >= (path.length - angle).abs()
                );
            }
        }
    }
}
