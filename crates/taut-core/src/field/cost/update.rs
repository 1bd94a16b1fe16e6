//! The least cost at a point by a straight step through a segment between two points whose least
//! costs are known.

use crate::Vector;
use crate::field::cost::Slope;
use crate::field::rays::frame::{Frame, ON_SURFACE};

/// What is known at a point: the cost per length there, the least cost and its gradient.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known<'a, const D: usize> {
    pub point: Vector<D>,
    /// The frame with the second fundamental form at the point; `None` where segments that end
    /// there are not to follow the surface.
    pub frame: Option<&'a Frame<D>>,
    /// The cost per length at the point.
    pub rate: f64,
    /// The least cost at the point.
    pub cost: f64,
    /// The gradient of the cost; `None` where costs between points are to be linear.
    pub gradient: Option<Vector<D>>,
}

/// A point that steps lead to.
#[derive(Clone, Copy)]
pub(crate) struct Target<'a, const D: usize> {
    pub point: &'a Vector<D>,
    /// The cost per length at the point.
    pub rate: f64,
    pub frame: Option<&'a Frame<D>>,
    pub slope: Slope,
    /// Whether costs are lengths; steps and segments are then geodesics of the surface, as seen
    /// from their ends.
    pub is_length: bool,
}

/// Largest share by which an arc is longer than its chord; where the surface curves more, chords
/// tell nothing of arcs.
const MOST_ARC: f64 = 0.2;

impl<const D: usize> Target<'_, D> {
    /// The cost per rate of a step that ends here, and its gradient by the step. The step is an arc
    /// that curves as the surface does here, and is 1 + (curvature * chord)^2 / 24 times as long as
    /// its chord.
    fn step(&self, step: &Vector<D>) -> (f64, Vector<D>) {
        let (length, gradient) = self.slope.step(step);
        let squared = step.norm_squared();
        let Some(frame) = self.frame.filter(|_| squared > 0.0) else {
            return (length, gradient);
        };
        if self.is_length {
            return arc(frame, step);
        }
        let along = frame.coordinates(step);
        let longer = frame.second_form(along, along).norm_squared() / (24.0 * squared);
        let stretch = 1.0 + longer.min(MOST_ARC);
        (length * stretch, gradient * stretch)
    }
}

/// The length of the geodesic that arrives at a frame by a step, and its direction there.
fn arc<const D: usize>(frame: &Frame<D>, step: &Vector<D>) -> (f64, Vector<D>) {
    let back = frame.vector(frame.log(&(frame.point - step), ON_SURFACE));
    let (chord, length) = (step.norm(), back.norm());
    let direction = -back / length.max(f64::MIN_POSITIVE);
    (length.clamp(chord, (1.0 + MOST_ARC) * chord), direction)
}

/// A way to a point through a segment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Way<const D: usize> {
    pub cost: f64,
    pub gradient: Vector<D>,
    /// The last step of the way, from the segment to the point.
    pub step: Vector<D>,
    /// Where on the segment the last step begins, from 0 to 1.
    pub share: f64,
}

/// Number of equal parts of a segment at whose ends the costs are compared.
const STARTS: usize = 4;
/// Most steps of false position between two starts on a segment.
const REFINEMENTS: usize = 6;

/// Largest difference of a slope from the mean slope of a segment, in costs per length, for the
/// cost to be cubic.
const KINK: f64 = 0.3;

/// A segment as it is seen from a point that steps lead to.
struct Segment<'a, const D: usize> {
    to: &'a Target<'a, D>,
    ends: [&'a Known<'a, D>; 2],
    chord: Vector<D>,
    /// The second derivative of the curve on the surface along the segment; 0 where the segment is
    /// straight.
    second: Vector<D>,
    /// The coefficients a, b, c and d of the cost along the segment, a + b t + c t^2 + d t^3.
    cubic: [f64; 4],
}

impl<const D: usize> Segment<'_, D> {
    /// The cost by way of a place on the segment, its derivative along the segment, and the step
    /// from that place.
    fn at(&self, t: f64) -> (f64, f64, Vector<D>) {
        let [a, b, c, d] = self.cubic;
        let start = self.chord * t - self.second * (0.5 * t * (1.0 - t));
        let step = self.to.point - self.ends[0].point - start;
        let forwards = self.chord - self.second * (0.5 - t);
        let (length, gradient) = self.to.step(&step);
        let rates = self.ends[1].rate - self.ends[0].rate;
        let rate = 0.5 * (self.to.rate + self.ends[0].rate + t * rates);
        let cost = a + t * (b + t * (c + t * d)) + rate * length;
        let along = b + t * (2.0 * c + t * 3.0 * d);
        let change = along + 0.5 * rates * length - rate * gradient.dot(&forwards);
        (cost, change, step)
    }

    /// The place on the segment through which the cost is least.
    fn least(&self) -> f64 {
        let mut best = (f64::INFINITY, 0);
        let mut tried = [(0.0, 0.0); STARTS + 1];
        for (i, tried) in tried.iter_mut().enumerate() {
            let (cost, change, _) = self.at(i as f64 / STARTS as f64);
            *tried = (cost, change);
            if cost < best.0 {
                best = (cost, i);
            }
        }
        let (i, change) = (best.1, tried[best.1].1);
        let other = if change < 0.0 {
            (i < STARTS).then(|| i + 1)
        } else {
            i.checked_sub(1)
        };
        let place = |i: usize| i as f64 / STARTS as f64;
        let Some(other) = other.filter(|o| tried[*o].1 * change < 0.0) else {
            return place(i);
        };
        let (mut low, mut high) = ((place(i), change), (place(other), tried[other].1));
        let mut t = low.0;
        // False position halves the weight of an end that stays (the Illinois method).
        for _ in 0..REFINEMENTS {
            t = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let change = self.at(t).1;
            if change * high.1 < 0.0 {
                low = high;
            } else {
                low.1 *= 0.5;
            }
            high = (t, change);
            if change == 0.0 {
                break;
            }
        }
        t
    }
}

/// The least way to a point through the segment between two known points, or from one of them if
/// both are the same.
pub(crate) fn through<const D: usize>(to: &Target<D>, from: [&Known<'_, D>; 2]) -> Way<D> {
    let rate = to.rate;
    let [a, b] = from;
    let chord = b.point - a.point;
    let rise = b.cost - a.cost;
    let (along, second) = along_surface(to, from, &chord);
    let slope = |end: &Known<D>, along: &Vector<D>| end.gradient.map_or(rise, |g| g.dot(along));
    let slopes = [slope(a, &along[0]), slope(b, &along[1])];
    // Slopes may make valleys of the cost with a kink, where a cubic would be too low.
    let most = KINK * 0.5 * (a.rate + b.rate) * chord.norm();
    let smooth =
        to.slope == Slope::Level || slopes.iter().all(|slope| (slope - rise).abs() <= most);
    let slopes = if smooth { slopes } else { [rise; 2] };
    let segment = Segment {
        to,
        ends: from,
        chord,
        second,
        cubic: [
            a.cost,
            slopes[0],
            3.0 * rise - 2.0 * slopes[0] - slopes[1],
            slopes[0] + slopes[1] - 2.0 * rise,
        ],
    };
    let share = if chord.norm_squared() == 0.0 {
        0.0
    } else {
        segment.least()
    };
    let (cost, _, step) = segment.at(share);
    let (length, direction) = to.step(&step);
    if to.is_length {
        return Way {
            cost,
            gradient: direction,
            step,
            share,
        };
    }
    let start = a.rate + share * (b.rate - a.rate);
    // The gradient changes along the way by the gradient of the cost per length, which is known in
    // the triangle.
    let change = gradient_in_triangle(to.point - a.point, chord, rate - a.rate, b.rate - a.rate);
    let gradient = direction * (0.5 * (start + rate)) + change * (0.5 * length);
    let along = gradient.dot(&step);
    let scale = if along > 0.0 {
        rate * length / along
    } else {
        0.0
    };
    let gradient = if scale > 0.5 && scale < 2.0 {
        gradient * scale
    } else {
        direction * rate
    };
    Way {
        cost,
        gradient,
        step,
        share,
    }
}

/// The derivatives, at the ends of a segment, of the curve on the surface along it, and the curve's
/// mean second derivative. They are those of a straight line where costs are not lengths or the
/// surface's curvature is unknown.
fn along_surface<const D: usize>(
    to: &Target<D>,
    [a, b]: [&Known<'_, D>; 2],
    chord: &Vector<D>,
) -> ([Vector<D>; 2], Vector<D>) {
    let frames = a.frame.zip(b.frame).filter(|_| to.is_length);
    let Some((first, last)) = frames else {
        return ([*chord; 2], Vector::zeros());
    };
    let ahead = arc(last, chord);
    let back = arc(first, &-chord);
    let seconds = [first, last].map(|frame| {
        let along = frame.coordinates(chord);
        frame.second_form(along, along)
    });
    let mean = (seconds[0] + seconds[1]) * 0.5;
    // A second derivative longer than the chord itself tells nothing of the curve.
    let second = if mean.norm_squared() <= chord.norm_squared() {
        mean
    } else {
        Vector::zeros()
    };
    ([-back.1 * back.0, ahead.1 * ahead.0], second)
}

/// The gradient of the linear function that changes by `du` along u and by `dv` along v; 0 where u
/// and v are nearly parallel.
fn gradient_in_triangle<const D: usize>(u: Vector<D>, v: Vector<D>, du: f64, dv: f64) -> Vector<D> {
    let (uu, uv, vv) = (u.dot(&u), u.dot(&v), v.dot(&v));
    let determinant = uu * vv - uv * uv;
    if determinant <= 0.02 * uu * vv {
        return Vector::zeros();
    }
    u * ((vv * du - uv * dv) / determinant) + v * ((uu * dv - uv * du) / determinant)
}
