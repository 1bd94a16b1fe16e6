//! Claims on clouds with noise, outliers and close sheets against truth, and what is said where no
//! claim can be made.

use std::f64::consts::TAU;

use taut_core::cloud::Cloud;
use taut_core::correction;
use taut_core::field::{Fields, Settings, Source};
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::Atlas;
use taut_core::surface::atlas::doubts::Doubt;

/// Uniform and normal deviates from a fixed linear congruential generator.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.next()).ln()).sqrt() * (TAU * self.next()).cos()
    }

    fn direction(&mut self) -> [f64; 3] {
        let (z, angle) = (2.0 * self.next() - 1.0, TAU * self.next());
        let radius = (1.0 - z * z).sqrt();
        [radius * angle.cos(), radius * angle.sin(), z]
    }
}

fn geodesics<const D: usize>(points: &[[f64; D]], dimension: usize) -> Geodesics<D, Atlas<D>> {
    let cloud = Cloud::<D>::new(points.as_flattened(), D).expect("a cloud");
    Geodesics::of_atlas(Atlas::new(cloud, dimension).expect("a surface"))
}

fn angle(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let cross =
        [0, 1, 2].map(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]);
    let sine = cross.iter().map(|v| v * v).sum::<f64>().sqrt();
    sine.atan2(a.iter().zip(b).map(|(x, y)| x * y).sum())
}

/// Errors and claims: how many are covered, and the largest error over its claim.
struct Claims {
    count: f64,
    covered: f64,
    worst: f64,
}

impl Claims {
    fn new() -> Self {
        Self {
            count: 0.0,
            covered: 0.0,
            worst: 0.0,
        }
    }

    fn add(&mut self, error: f64, claim: f64) {
        self.count += 1.0;
        self.covered += f64::from(u8::from(error <= claim));
        self.worst = self.worst.max(error / claim);
    }

    fn check(&self, share: f64, name: &str) {
        let covered = self.covered / self.count;
        assert!(
            self.count > 50.0 && covered >= share,
            "{name}: {covered} covered"
        );
        assert!(self.worst <= 20.0, "{name}: {} times the claim", self.worst);
    }
}

/// Claims of paths and fields between the first `inliers` points of the unit sphere, known by their
/// directions.
fn judge(points: &[[f64; 3]], inliers: usize, name: &str) -> Geodesics<3, Atlas<3>> {
    let geodesics = geodesics(points, 2);
    let node = |row: usize| geodesics.surface().node_of_row(row);
    let mut paths = Claims::new();
    for i in 0..100 {
        let (from, to) = (31 * i % inliers, (977 * i + 411) % inliers);
        let (Ok(a), Ok(b)) = (node(from), node(to)) else {
            continue;
        };
        let path = geodesics.path(&a, &b, &correction::Settings::default());
        if path.converged() {
            let error = (path.length - angle(&points[from], &points[to])).abs();
            paths.add(error, path.length_error + path.surface_error);
        }
    }
    paths.check(0.95, &format!("{name}, paths"));
    let fields = Fields::of_cloud(&geodesics).expect("fields");
    let mut claims = Claims::new();
    for source in [0, inliers / 2] {
        let at = Source {
            node: node(source).expect("a foot"),
            start: 0.0,
        };
        let field = fields.from(&[at], &Settings::default()).expect("a field");
        for (i, value) in fields.at_points(&field).iter().enumerate().take(inliers) {
            if i != source && value.distance.is_finite() {
                assert!(
                    value.error > 0.0,
                    "{name}: {} is claimed exact",
                    value.distance
                );
                claims.add(
                    (value.distance - angle(&points[source], &points[i])).abs(),
                    value.error,
                );
            }
        }
    }
    claims.check(0.95, &format!("{name}, fields"));
    geodesics
}

#[test]
fn noise_is_claimed() {
    let count = 4000;
    let spacing = (2.0 * TAU / f64::from(count)).sqrt();
    for (seed, noise) in [(1, 0.25), (2, 0.5), (3, 1.0)] {
        let mut random = Random(seed);
        let point = |_| {
            let radius = 1.0 + noise * spacing * random.normal();
            random.direction().map(|v| v * radius)
        };
        let points: Vec<[f64; 3]> = (0..count).map(point).collect();
        judge(&points, points.len(), &format!("noise of {noise} spacings"));
    }
}

#[test]
fn outliers_neither_pull_the_surface_nor_pass_for_points_of_it() {
    let count = 5000;
    let spacing = (2.0 * TAU / f64::from(count)).sqrt();
    for (seed, outliers) in [(4, 50), (5, 150)] {
        let mut random = Random(seed);
        let mut points: Vec<[f64; 3]> = (0..count).map(|_| random.direction()).collect();
        points.extend((0..outliers).map(|_| [0; 3].map(|_| 2.0 * random.next() - 1.0)));
        let inliers = count as usize;
        let geodesics = judge(&points, inliers, &format!("{outliers} outliers"));
        let atlas = geodesics.surface();
        let off = |row: usize| {
            let node = atlas.node_of_row(row).ok()?;
            let point = atlas.cloud().points[row];
            atlas.spacings_off(&node, (node.point - point).norm())
        };
        let mistaken = (0..inliers).filter_map(off).count();
        assert!(
            mistaken * 500 <= inliers,
            "{mistaken} points of the surface are said to be off it"
        );
        let height = |point: &[f64; 3]| point.iter().map(|v| v * v).sum::<f64>().sqrt() - 1.0;
        let strewn = (inliers..points.len()).filter(|row| {
            height(&points[*row]).abs() > 0.5 * spacing && atlas.node_of_row(*row).is_ok()
        });
        let told: Vec<bool> = strewn.map(|row| off(row).is_some()).collect();
        let untold = told.iter().filter(|told| !**told).count();
        assert!(
            untold * 10 <= told.len(),
            "{untold} of {} outliers untold",
            told.len()
        );
        let found = atlas.report().outliers;
        assert!(
            found.abs_diff(outliers) * 10 <= outliers,
            "{found} of {outliers} found"
        );
    }
}

#[test]
fn sheets_that_noise_may_join_are_told() {
    let mut random = Random(6);
    let mut sheet = |height: f64, noise: f64| -> Vec<[f64; 3]> {
        let point = |_| [0.0; 2].map(|_| random.next());
        let places: Vec<[f64; 2]> = (0..4000).map(point).collect();
        places
            .iter()
            .map(|[x, y]| [*x, *y, height + noise * random.normal()])
            .collect()
    };
    let spacing = 1.0 / 4000_f64.sqrt();
    for (gap, noise, is_told) in [
        (3.0, 0.25, true),
        (5.0, 0.5, false),
        (4.0, 0.0, false),
        (0.0, 0.25, false),
    ] {
        let mut points = sheet(0.0, noise * spacing);
        if gap > 0.0 {
            points.extend(sheet(gap * spacing, noise * spacing));
        }
        let geodesics = geodesics(&points, 2);
        let doubts = geodesics.surface().doubts();
        let told = doubts
            .iter()
            .any(|doubt| matches!(doubt, Doubt::NearSheet { .. }));
        let apart = geodesics.component_sizes().len() > 1;
        assert!(
            told == is_told || apart && gap > 0.0,
            "gap {gap}, noise {noise}: {doubts:?}"
        );
    }
}

/// A roll of one and a half turns in R^4, aslant to the axes.
fn roll(count: usize, noise: f64) -> Vec<[f64; 4]> {
    let mut random = Random(7);
    (0..count)
        .map(|_| {
            let angle = 2.0 + 9.0 * random.next();
            let radius = 0.2 * angle;
            let flat = [
                radius * angle.cos(),
                radius * angle.sin(),
                4.0 * random.next(),
                0.0,
            ];
            let [x, y, z, w] = flat.map(|v| v + noise * random.normal());
            let (c, s) = (0.8, 0.6);
            [c * x - s * w, c * y + s * z, c * z - s * y, c * w + s * x]
        })
        .collect()
}

#[test]
fn dimensions_that_the_points_do_not_have_are_told() {
    let dimension = |points: &[[f64; 4]], taken: usize| {
        let geodesics = geodesics(points, taken);
        let doubts = geodesics.surface().doubts();
        doubts.iter().find_map(|doubt| match doubt {
            Doubt::Dimension { suggested, .. } => Some(*suggested),
            Doubt::NearSheet { .. } => None,
        })
    };
    for noise in [0.0, 0.02] {
        let points = roll(4000, noise);
        assert_eq!(dimension(&points, 2), None);
        assert_eq!(dimension(&points, 3), Some(2));
    }
    let mut random = Random(8);
    let three_sphere: Vec<[f64; 4]> = (0..4000)
        .map(|_| {
            let x = [0; 4].map(|_| random.normal());
            let length = x.iter().map(|v| v * v).sum::<f64>().sqrt();
            x.map(|v| v / length)
        })
        .collect();
    assert_eq!(dimension(&three_sphere, 3), None);
    assert_eq!(dimension(&three_sphere, 2), Some(3));
    assert_eq!(dimension(&three_sphere, 1), Some(3));
}
