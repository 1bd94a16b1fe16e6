//! Points between rows, where points lie much nearer to each other along a row than across rows.
//!
//! Such rows are rings of points about a limb, scan lines, and long thin triangles. The nearest
//! points of each point lie on its own row, and no ball of points is a patch of the surface. The
//! neighbours of such a point are those whose Voronoi cells on the tangent plane touch its own,
//! however far they lie; the plane is the one on which neighbours surround the point most closely.
//! Where two points have each other as neighbours far apart, points are put between them, on the
//! cubic that leaves both along their tangent planes (the edge of a curved PN triangle: Vlachos,
//! Peters, Boyd, Mitchell 2001). Charts are then fitted to all points as usual. Nothing is put at
//! rims (the boundary of the surface).

use crate::spatial::tree::{Neighbour, Tree};
use crate::surface::atlas::rim::DISC_SPACINGS;
use crate::surface::atlas::sheets::{self, SECTORS};
use crate::{Vector, parallel};

/// Largest cosine of the angle between two points for them to be seen on opposite sides.
const OPPOSITE: f64 = -0.5;
/// Number of points that may be neighbours across rows.
const ROW_NEIGHBOURS: usize = 63;
/// Distance of neighbours, in distances of points on a row, above which points are put between
/// them.
const LONG: f64 = 2.0;
/// Share of added points below which none are added: random points have some neighbours as on rows
/// too, and would add a fiftieth.
const BY_CHANCE: f64 = 0.1;
/// Number of normals over a hemisphere that are tried.
const NORMALS: usize = 40;
/// Angles, in radians, by which the best of the normals is then turned to better it.
const TURNS: [f64; 4] = [0.25, 0.12, 0.06, 0.03];
/// Factor by which a point's height over the plane counts more than its distance along it.
const HEIGHT: f64 = 4.0;
/// Largest slope at which a neighbour may be seen from a point over its plane (the tangent of 40
/// degrees).
const STEEP: f64 = 0.84;
/// Least cosine of the angle between the normals of neighbours on one sheet.
const ALIGNED_NEIGHBOURS: f64 = 0.5;

type Point = Vector<3>;

/// The tangent plane of a point on a row, and its neighbours.
struct Star {
    normal: Point,
    /// Distance between points on its row, in the input's units.
    step: f64,
    /// The longest distance to a neighbour across which the surface is known to go on, in the
    /// input's units.
    longest: f64,
    /// The neighbours, as tree indices.
    neighbours: Vec<u32>,
}

/// Points between the rows on which the points in `looked_at` (tree indices, ascending) lie, on
/// surfaces in space; there are none in other dimensions. O(log n) for each.
pub(super) fn between<const D: usize>(tree: &Tree<D>, looked_at: &[u32]) -> Vec<Vector<D>> {
    if D != 3 {
        return Vec::new();
    }
    let of = |found: &mut Vec<Neighbour>, i: usize| star(tree, looked_at[i], found);
    let stars = parallel::map_with(looked_at.len(), Vec::new, of);
    let star = |point: u32| {
        let place = looked_at.binary_search(&point).ok()?;
        stars[place].as_ref()
    };
    let mut added = Vec::new();
    for (i, a) in looked_at.iter().zip(&stars) {
        let Some(a) = a else { continue };
        for j in a.neighbours.iter().filter(|j| *j > i) {
            let Some(b) = star(*j).filter(|b| b.neighbours.contains(i)) else {
                continue;
            };
            let ends = [*i, *j].map(|p| in_space(&tree.points[p as usize]));
            let length = (ends[1] - ends[0]).norm();
            let pieces = (length / (LONG * a.step.max(b.step))).ceil();
            let known = length <= a.longest.min(b.longest);
            if pieces > 1.0 && known && a.normal.dot(&b.normal).abs() >= ALIGNED_NEIGHBOURS {
                let inner = 1..pieces as usize;
                let at = |l| cubic(ends, [a.normal, b.normal], l as f64 / pieces);
                added.extend(inner.map(at).map(|x| Vector::from_fn(|axis, _| x[axis])));
            }
        }
    }
    if (added.len() as f64) < BY_CHANCE * looked_at.len() as f64 {
        added.clear();
    }
    added
}

/// A point of R^D as a point of space.
fn in_space<const D: usize>(x: &Vector<D>) -> Point {
    Point::from_fn(|axis, _| x[axis])
}

/// The star of a point; `None` where it lies on no row or at a rim.
fn star<const D: usize>(tree: &Tree<D>, point: u32, found: &mut Vec<Neighbour>) -> Option<Star> {
    let centre = &tree.points[point as usize];
    tree.nearest(centre, ROW_NEIGHBOURS + 1, found);
    let offset = |n: &Neighbour| in_space(&(tree.points[n.index as usize] - centre));
    let near: Vec<Neighbour> = found.iter().filter(|n| n.index != point).copied().collect();
    let offsets: Vec<Point> = near.iter().map(offset).collect();
    let step = row_step(&offsets)?;
    let mut normal = surrounding_plane(&offsets);
    let mut touching = Vec::new();
    for _ in 0..2 {
        touching = touching_cells(&offsets, &normal);
        normal = mean_normal(&offsets, &touching).unwrap_or(normal);
    }
    // At a rim nothing bounds the cell, and the plane may be one across the mouth of a limb.
    let touching: Vec<usize> = touching.into_iter().collect::<Option<_>>()?;
    Some(Star {
        normal,
        step,
        longest: 2.0 * DISC_SPACINGS * sheets::spacing(found, 2),
        neighbours: touching
            .into_iter()
            .map(|place| near[place].index)
            .collect(),
    })
}

/// The distance between points on the row of the origin. The two points nearest to the origin lie
/// on opposite sides of it, which they seldom do by chance; `None` where they do not.
fn row_step(nearest_first: &[Point]) -> Option<f64> {
    let (first, second) = (nearest_first.first()?, nearest_first.get(1)?);
    let lengths = first.norm() * second.norm();
    (first.dot(second) < OPPOSITE * lengths).then(|| second.norm())
}

/// The normal of the plane on which the points surround the origin most closely: the mean over
/// directions of the logarithm of the distance to the nearest point is least.
fn surrounding_plane(offsets: &[Point]) -> Point {
    let golden = std::f64::consts::PI * (1.0 + 5.0_f64.sqrt());
    let spiral = (0..NORMALS).map(|i| {
        let z = (i as f64 + 0.5) / NORMALS as f64;
        let (radius, angle) = ((1.0 - z * z).sqrt(), golden * i as f64);
        Point::from([radius * angle.cos(), radius * angle.sin(), z])
    });
    let farthest = offsets.iter().map(|o| o.norm_squared()).fold(0.0, f64::max);
    let mut best = (f64::INFINITY, Point::zeros());
    let consider = |best: &mut (f64, Point), normal: Point| {
        let distance = surrounding_distance(offsets, &normal, 4.0 * farthest);
        if distance < best.0 {
            *best = (distance, normal);
        }
    };
    for normal in spiral {
        consider(&mut best, normal);
    }
    for step in TURNS {
        let centre = best.1;
        let [first, second] = plane(&centre);
        for eighth in 0..8 {
            let angle = f64::from(eighth) * std::f64::consts::FRAC_PI_4;
            let turned = centre + (first * angle.cos() + second * angle.sin()) * step;
            consider(&mut best, turned.normalize());
        }
    }
    best.1
}

/// Sum of the logarithms of the squared distances to the nearest point in each direction of a
/// plane, where `none` stands for a direction without points.
fn surrounding_distance(offsets: &[Point], normal: &Point, none: f64) -> f64 {
    let [first, second] = plane(normal);
    let mut nearest = [none; SECTORS];
    for offset in offsets {
        let (x, y) = (offset.dot(&first), offset.dot(&second));
        let height = HEIGHT * offset.dot(normal);
        let sector = &mut nearest[sheets::sector(x, y)];
        *sector = sector.min(x * x + y * y + height * height);
    }
    nearest.iter().map(|squared| squared.ln()).sum()
}

/// An orthonormal basis of the plane with a normal.
fn plane(normal: &Point) -> [Point; 2] {
    let axis = normal.iamin();
    let first = Point::ith(axis, 1.0).cross(normal).normalize();
    [first, normal.cross(&first)]
}

/// A corner of a Voronoi cell, and the point beyond the side that starts there (`None` for the
/// bounds).
type Corner = ([f64; 2], Option<usize>);

/// The points whose Voronoi cells on a plane touch the origin's cell, in order round it; `None` for
/// the bounds. Points keep their direction and, nearly, their distance on the surface.
fn touching_cells(offsets: &[Point], normal: &Point) -> Vec<Option<usize>> {
    let [first, second] = plane(normal);
    let bound = 4.0 * offsets.iter().map(|o| o.norm()).fold(0.0, f64::max);
    let square = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let mut cell: Vec<Corner> = square.map(|[x, y]| ([x * bound, y * bound], None)).into();
    for (place, offset) in offsets.iter().enumerate() {
        let (x, y) = (offset.dot(&first), offset.dot(&second));
        let (along, height) = (x.hypot(y), offset.dot(normal));
        if height.abs() <= STEEP * along {
            let stretched = along.hypot(2.0 * height) / along;
            cell = clipped(&cell, [x * stretched, y * stretched], place);
        }
    }
    cell.into_iter().map(|corner| corner.1).collect()
}

/// The part of a convex cell that is nearer to the origin than to a point.
fn clipped(cell: &[Corner], point: [f64; 2], place: usize) -> Vec<Corner> {
    let [x, y] = point;
    let beyond = |corner: &Corner| (corner.0[0] - 0.5 * x) * x + (corner.0[1] - 0.5 * y) * y;
    let mut kept = Vec::with_capacity(cell.len() + 1);
    for (i, here) in cell.iter().enumerate() {
        let next = &cell[(i + 1) % cell.len()];
        let (a, b) = (beyond(here), beyond(next));
        if a <= 0.0 {
            kept.push(*here);
        }
        if (a <= 0.0) != (b <= 0.0) {
            let t = a / (a - b);
            let cut = [0, 1].map(|axis| here.0[axis] + (next.0[axis] - here.0[axis]) * t);
            kept.push((cut, if a <= 0.0 { Some(place) } else { here.1 }));
        }
    }
    kept
}

/// The mean normal of the triangles between successive neighbours, weighted by their angles.
fn mean_normal(offsets: &[Point], round: &[Option<usize>]) -> Option<Point> {
    let next = round.iter().cycle().skip(1);
    let sum = round.iter().zip(next).filter_map(|(a, b)| {
        let (a, b) = (offsets[(*a)?].normalize(), offsets[(*b)?].normalize());
        a.cross(&b)
            .try_normalize(0.0)
            .map(|n| n * a.dot(&b).clamp(-1.0, 1.0).acos())
    });
    sum.fold(Point::zeros(), |sum, n| sum + n)
        .try_normalize(0.0)
}

/// A point of the cubic between two points that leaves both along their planes, as a circle would.
fn cubic(ends: [Point; 2], normals: [Point; 2], t: f64) -> Point {
    let handle = |normal: &Point, chord: Point| {
        let flat = chord - normal * chord.dot(normal);
        let (length, along) = (chord.norm(), flat.norm());
        if along < 0.3 * length {
            return chord / 3.0;
        }
        flat * (2.0 / 3.0) / (along * (1.0 / length + along / (length * length)))
    };
    let chord = ends[1] - ends[0];
    let first = ends[0] + handle(&normals[0], chord);
    let second = ends[1] + handle(&normals[1], -chord);
    let s = 1.0 - t;
    ends[0] * (s * s * s)
        + first * (3.0 * s * s * t)
        + second * (3.0 * s * t * t)
        + ends[1] * (t * t * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten rings of twenty points about a cylinder of radius 1, `apart` from each other; every
    /// other ring is turned by half a step.
    fn rings(apart: f64) -> Vec<Point> {
        let ring = |i: usize| {
            (0..20).map(move |j| {
                let angle = (j as f64 + 0.5 * (i % 2) as f64) * std::f64::consts::TAU / 20.0;
                Point::from([angle.cos(), angle.sin(), i as f64 * apart])
            })
        };
        (0..10).flat_map(ring).collect()
    }

    fn added(points: &[Point]) -> Vec<Point> {
        let all: Vec<u32> = (0..points.len() as u32).collect();
        between(&Tree::new(points), &all)
    }

    #[test]
    fn rings_six_steps_apart_are_joined_by_points_on_the_cylinder() {
        let points = rings(2.0);
        let added = added(&points);
        for x in &added {
            assert!((x[0].hypot(x[1]) - 1.0).abs() < 0.01, "{x}");
            assert!((0.0..=18.0).contains(&x[2]), "{x}");
        }
        // Within the rings no place is farther from a point than two steps.
        for i in 0..400 {
            let angle = f64::from(i) * 0.7;
            let place = Point::from([angle.cos(), angle.sin(), 2.0 + 0.035 * f64::from(i)]);
            let nearest = |points: &[Point]| {
                let gaps = points.iter().map(|p| (p - place).norm());
                gaps.fold(f64::INFINITY, f64::min)
            };
            assert!(nearest(&points).min(nearest(&added)) < 0.63, "{place}");
        }
    }

    #[test]
    fn nothing_is_put_between_points_as_near_across_rows_as_along_them() {
        assert!(added(&rings(0.3)).is_empty());
    }

    #[test]
    fn rings_too_far_apart_to_be_one_surface_stay_apart() {
        assert!(added(&rings(8.0)).is_empty());
    }
}
