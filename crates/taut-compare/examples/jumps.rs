use std::f64::consts::PI;
use rayon::prelude::*;
use taut::cloud::Cloud;
use taut::field::{Fields, Settings, Source};
use taut::geodesics::Geodesics;
use taut::surface::atlas::Atlas;
use taut_compare::shooting::Fan;
use taut_compare::surface::{Ellipsoid, StarShaped, Surface, Torus};
use taut_compare::generate;
use num_dual::DualNum;

fn run<S: Surface>(name: &str, shape: &S, points: Vec<[f64; 3]>, area: f64, longest: f64, source: usize, stride: usize) {
    let spacing = (area / points.len() as f64).sqrt();
    let cloud = Cloud::<3>::new(points.as_flattened(), 3).unwrap();
    let geodesics = Geodesics::of_atlas(Atlas::new(cloud, 2).unwrap());
    let fields = Fields::of_cloud(&geodesics).unwrap();
    let node = geodesics.surface().node_of_row(source).unwrap();
    let t = std::time::Instant::now();
    let field = fields.from(&[Source { node, start: 0.0 }], &Settings::default()).unwrap();
    let values = fields.at_points(&field);
    let seconds = t.elapsed().as_secs_f64();
    // jumps
    let mut jumps = 0;
    let mut jumpers = vec![];
    let cells = {
        let mut m: std::collections::HashMap<[i64; 3], Vec<usize>> = Default::default();
        for (i, p) in points.iter().enumerate() { m.entry(p.map(|x| (x / (2.0 * spacing)).floor() as i64)).or_default().push(i); }
        m
    };
    let near = |i: usize| {
        let c = points[i].map(|x| (x / (2.0 * spacing)).floor() as i64);
        let mut out = vec![];
        for a in -1..=1 { for b in -1..=1 { for d in -1..=1 { if let Some(l) = cells.get(&[c[0] + a, c[1] + b, c[2] + d]) { out.extend(l.iter().copied()); } } } }
        out
    };
    let dist = |i: usize, j: usize| (0..3).map(|k| (points[i][k] - points[j][k]).powi(2)).sum::<f64>().sqrt();
    let mut excess_most: f64 = 0.0;
    for i in 0..points.len() {
        let mut worst: f64 = 0.0;
        for j in near(i) {
            let d = dist(i, j);
            if d < 2.0 * spacing { worst = worst.max((values[i].distance - values[j].distance).abs() - 1.002 * d); }
        }
        excess_most = excess_most.max(worst);
        if worst > 0.01 * spacing { jumps += 1; jumpers.push(i); }
    }
    let fan = Fan::new(shape, points[source], longest);
    let jumper: std::collections::HashSet<usize> = jumpers.iter().copied().collect();
    let rows: Vec<usize> = (0..points.len()).filter(|i| i % stride == 1 || jumper.contains(i)).collect();
    let mut truth: Vec<(usize, f64)> = rows.into_par_iter().filter_map(|i| Some((i, fan.distance(points[i], longest)?))).collect();
    truth.retain(|t| t.1 > 8.0 * spacing);
    let mut errors: Vec<(f64, f64, usize, f64)> = truth.iter().map(|(i, t)| ((values[*i].distance - t).abs() / t, (values[*i].distance - t).abs() / values[*i].error, *i, *t)).collect();
    errors.sort_by(|a, b| b.0.total_cmp(&a.0));
    let sampled: Vec<_> = errors.iter().filter(|e| e.2 % stride == 1).collect();
    let mean = sampled.iter().map(|e| e.0).sum::<f64>() / sampled.len() as f64;
    let covered = sampled.iter().filter(|e| e.1 <= 1.0).count() as f64 / sampled.len() as f64;
    let over = errors.iter().map(|e| e.1).fold(0.0, f64::max);
    println!("{name} src {source}: field {seconds:.3} s, spacing {spacing:.4}, jumps {jumps} (most {:.1} spacings), error mean {mean:.2e} p99 {:.2e} max {:.2e}, covered {covered:.4}, worst over claim {over:.1}, carried {} unreached {}", excess_most / spacing, sampled[sampled.len() / 100].0, errors[0].0, field.carried_nodes(), field.unreached_nodes());
    for th in [1e-4, 3e-4, 1e-3, 3e-3] {
        let doubtful = values.iter().filter(|v| v.error > th * v.distance && v.distance > 8.0 * spacing).count();
        let rest = errors.iter().filter(|e| values[e.2].error <= th * values[e.2].distance).map(|e| e.0).fold(0.0, f64::max);
        println!("     threshold {th:.0e}: {doubtful} doubtful, max error of the rest {rest:.2e}");
    }
    if std::env::var_os("WORST").is_some() {
        for e in errors.iter().take(15) {
            let atlas = geodesics.surface();
            let v = &values[e.2];
            let path = geodesics.path(&node, &atlas.node_of_row(e.2).unwrap(), &taut::correction::Settings::default());
            println!("   row {} {:?}: {:.5} ± {:.5} truth {:.5} path {:.5} {}", e.2, points[e.2].map(|x| (x * 1e3).round() / 1e3), v.distance, v.error, e.3, path.length, path.status);
        }
    }
}

fn main() {
    let n: usize = std::env::args().nth(1).map_or(20000, |s| s.parse().unwrap());
    let seeds: u64 = std::env::args().nth(2).map_or(1, |s| s.parse().unwrap());
    let stride: usize = std::env::args().nth(3).map_or(20, |s| s.parse().unwrap());
    for seed in 1..=seeds {
        for source in [0, 7, 1234] {
            if std::env::var_os("WAVY").is_none() {
            let axes = [2.0, 1.3, 0.8];
            let shape = Ellipsoid { semi_axes: axes };
            run("ellipsoid", &shape, generate::ellipsoid(n, axes, seed), 23.2, 6.0, source, stride);
            }
            let shape = StarShaped { radius: |u| (u[0] * 4.0).sin() * (u[1] * 3.0 + 1.0).sin() * (u[2] * 4.0).sin() * 0.1 + 1.0, reach: 0.2 };
            run("wavy", &shape, generate::star_shaped(n, &shape, 2.0, seed), 13.6, 5.0, source, stride);
            let shape = Torus { major: 2.0, minor: 0.7 };
            run("torus", &shape, generate::torus(n, &shape, seed).points, 4.0 * PI * PI * 1.4, 8.0, source, stride);
        }
    }
}
