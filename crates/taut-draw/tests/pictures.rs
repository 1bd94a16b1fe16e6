//! Pictures against what they must show.

use std::f64::consts::TAU;

use taut_draw::{Camera, DrawError, Image, Levels, Marker, PALETTE, Radii, Scene, Style, render};

const FRONT: [f64; 3] = [0.0, -1.0, 0.0];
const UP: [f64; 3] = [0.0, 0.0, 1.0];

/// Evenly spread points of the unit sphere (a Fibonacci spiral).
fn sphere(count: u32) -> Vec<[f64; 3]> {
    let turn = TAU * (3.0 - 5.0_f64.sqrt()) / 2.0;
    let point = |i: u32| {
        let height = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let across = (1.0 - height * height).sqrt();
        let angle = turn * f64::from(i);
        [across * angle.cos(), across * angle.sin(), height]
    };
    (0..count).map(point).collect()
}

/// A sphere without any words below it.
fn bare_sphere(count: u32) -> Result<Scene, DrawError> {
    let mut scene = Scene::new(sphere(count))?;
    scene.unit = None;
    Ok(scene)
}

/// Half a circle of radius 1.005 at height 0.3, before (-1) or behind (1) the sphere.
fn half_circle(side: f64) -> Vec<[f64; 3]> {
    let point = |i: u32| {
        let angle = TAU * (0.03 + 0.44 * f64::from(i) / 100.0);
        let across = 1.005 * (1.0_f64 - 0.09).sqrt();
        [across * angle.cos(), side * across * angle.sin(), 0.3]
    };
    (0..=100).map(point).collect()
}

fn brightness([r, g, b]: [u8; 3]) -> f64 {
    (f64::from(r) + f64::from(g) + f64::from(b)) / 765.0
}

/// How many pixels are orange, as paths in the first colour of the palette are: those much
/// redder than blue, and of them those in full colour.
fn orange_pixels(image: &Image) -> (usize, usize) {
    let excess = |[r, _, b]: [u8; 3]| i32::from(r) - i32::from(b);
    let full = excess(PALETTE[0]);
    let pixels = || {
        image
            .as_bytes()
            .chunks_exact(3)
            .map(|p| excess([p[0], p[1], p[2]]))
    };
    let any = pixels().filter(|&e| e > 40).count();
    let strong = pixels().filter(|&e| e > full * 7 / 10).count();
    (any, strong)
}

#[test]
fn a_sphere_is_a_shaded_disc() {
    let scene = bare_sphere(20_000).unwrap();
    let camera = Camera::fit(&scene, FRONT, UP, 400, 300).unwrap();
    let image = render(&scene, &camera, &Style::default()).unwrap();
    let radius = camera.pixels_per_unit();
    let (mut inside, mut wrong) = (0, 0);
    let (mut lit, mut dark) = (0.0, 0.0);
    for y in 0..300 {
        for x in 0..400 {
            let [dx, dy] = [f64::from(x) + 0.5 - 200.0, f64::from(y) + 0.5 - 150.0];
            let distance = dx.hypot(dy);
            let pixel = image.pixel(x, y).unwrap();
            if (distance - radius).abs() < 2.0 {
                continue;
            }
            let covered = pixel != [255; 3];
            wrong += usize::from(covered != (distance < radius));
            inside += usize::from(covered);
            if distance < 0.9 * radius && dx < 0.0 && dy < 0.0 {
                lit += brightness(pixel);
            }
            if distance < 0.9 * radius && dx > 0.0 && dy > 0.0 {
                dark += brightness(pixel);
            }
        }
    }
    assert!(inside > 50_000, "the sphere fills the picture: {inside}");
    assert_eq!(wrong, 0, "pixels two and more away from the outline");
    assert!(
        lit > 1.08 * dark,
        "light comes from the upper left: {lit} {dark}"
    );
}

#[test]
fn a_smooth_surface_shows_no_grain() {
    let scene = bare_sphere(20_000).unwrap();
    let camera = Camera::fit(&scene, FRONT, UP, 400, 300).unwrap();
    let image = render(&scene, &camera, &Style::default()).unwrap();
    let reach = (0.6 * camera.pixels_per_unit()) as u32;
    for y in 150 - reach..150 + reach {
        for x in 200 - reach..200 + reach {
            let here = brightness(image.pixel(x, y).unwrap());
            let right = brightness(image.pixel(x + 1, y).unwrap());
            assert!((here - right).abs() < 0.02, "{x} {y}: {here} {right}");
        }
    }
}

/// Isolines of the height are parallels: between the poles the middle column crosses seven, evenly
/// spaced.
#[test]
fn isolines_lie_where_the_level_is_a_multiple() {
    let mut scene = bare_sphere(5000).unwrap();
    let heights = scene.points.iter().map(|point| point[2]);
    let levels = Levels {
        values: heights.collect(),
        gradients: scene
            .points
            .iter()
            .map(|[x, y, z]| [-x * z, -y * z, 1.0 - z * z])
            .collect(),
        interval: 0.25,
    };
    scene.show_levels(levels);
    let camera = Camera::fit(&scene, FRONT, UP, 400, 400).unwrap();
    let image = render(&scene, &camera, &Style::default()).unwrap();
    let column: Vec<f64> = (0..400)
        .map(|y| brightness(image.pixel(200, y).unwrap()))
        .collect();
    let is_dark = |y: usize| column[y] < 0.9 * column[y - 5].min(column[y + 5]);
    let lines: Vec<usize> = (40..360)
        .filter(|y| is_dark(*y) && !is_dark(y - 1))
        .collect();
    assert_eq!(lines.len(), 7, "{lines:?}");
    let apart = lines.windows(2).map(|pair| pair[1] - pair[0]);
    let expected = 0.25 * camera.pixels_per_unit();
    for step in apart {
        assert!((step as f64 - expected).abs() <= 2.0, "{lines:?}");
    }
}

#[test]
fn a_path_before_the_sphere_is_strong_and_one_behind_is_dim() {
    let draw = |side: f64| {
        let mut scene = bare_sphere(20_000).unwrap();
        scene.add_path(half_circle(side));
        scene.markers.clear();
        let camera = Camera::fit(&scene, FRONT, UP, 600, 450).unwrap();
        orange_pixels(&render(&scene, &camera, &Style::default()).unwrap())
    };
    let ((front, front_strong), (back, back_strong)) = (draw(-1.0), draw(1.0));
    assert!(front_strong > 500, "{front_strong} of {front}");
    assert!(back > 150, "hidden parts still show: {back}");
    assert!(
        back < front / 2,
        "and are thinner and dashed: {back} {front}"
    );
    assert!(
        back_strong < back / 10,
        "and paler: {back_strong} of {back}"
    );
}

#[test]
fn a_coarse_chord_does_not_sink_into_the_surface() {
    let mut scene = bare_sphere(100_000).unwrap();
    let coarse = half_circle(-1.0).into_iter().step_by(10).collect();
    scene.add_path(coarse);
    let camera = Camera::fit(&scene, FRONT, UP, 600, 450).unwrap();
    let (_, strong) = orange_pixels(&render(&scene, &camera, &Style::default()).unwrap());
    assert!(strong > 500, "{strong}");
}

#[test]
fn the_automatic_camera_shows_the_path() {
    let mut scene = bare_sphere(5000).unwrap();
    scene.add_path(half_circle(1.0));
    let camera = Camera::automatic(&scene, UP, 320, 240).unwrap();
    let [_, y, _] = camera.direction();
    assert!(
        y > 0.5,
        "the path lies at positive y: {:?}",
        camera.direction()
    );
}

#[test]
fn flat_clouds_are_seen_face_on() {
    let points = (0..900)
        .map(|i| [f64::from(i % 30), f64::from(i / 30), 0.0])
        .collect();
    let scene = Scene::new(points).unwrap();
    let camera = Camera::automatic(&scene, UP, 320, 240).unwrap();
    assert!((camera.direction()[2] - 1.0).abs() < 1e-9);
}

#[test]
fn one_thread_or_two_draw_the_same_bytes() {
    let draw = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let mut scene = Scene::new(sphere(30_000)).unwrap();
            scene.add_path(half_circle(-1.0));
            scene.caption = Some("length 2.6".to_owned());
            let camera = Camera::automatic(&scene, UP, 300, 200).unwrap();
            render(&scene, &camera, &Style::default()).unwrap()
        })
    };
    assert!(draw(1) == draw(2));
}

#[test]
fn the_png_holds_the_pixels() {
    let scene = Scene::new(sphere(500)).unwrap();
    let camera = Camera::fit(&scene, FRONT, UP, 64, 48).unwrap();
    let image = render(&scene, &camera, &Style::default()).unwrap();
    let bytes = image.to_png_bytes().unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes))
        .read_info()
        .unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((info.width, info.height), (64, 48));
    assert_eq!(pixels, image.as_bytes());
}

#[test]
fn points_that_are_not_finite_change_nothing() {
    let clean = bare_sphere(2000).unwrap();
    let mut points = sphere(2000);
    points.insert(77, [f64::NAN, 0.0, 0.0]);
    points.push([0.0, f64::INFINITY, 0.0]);
    let mut dirty = Scene::new(points).unwrap();
    dirty.unit = None;
    dirty.add_path(vec![[f64::NAN; 3], [f64::NAN; 3]]);
    let camera = Camera::fit(&dirty, FRONT, UP, 120, 90).unwrap();
    assert_eq!(camera, Camera::fit(&clean, FRONT, UP, 120, 90).unwrap());
    let style = Style::default();
    assert!(render(&dirty, &camera, &style).unwrap() == render(&clean, &camera, &style).unwrap());
}

#[test]
fn scenes_that_cannot_be_drawn_say_why() {
    assert!(matches!(
        Scene::new(Vec::new()),
        Err(DrawError::Empty { points: 0 })
    ));
    assert!(matches!(
        Scene::new(vec![[f64::NAN; 3]; 3]),
        Err(DrawError::Empty { points: 3 })
    ));
    let fit = |scene: &Scene| Camera::fit(scene, FRONT, UP, 100, 100).map(|_| ());
    let good = Scene::new(sphere(10)).unwrap();
    let mut scene = good.clone();
    scene.radii = Radii::Uniform(0.0);
    assert!(matches!(
        fit(&scene),
        Err(DrawError::Radius { index: 0, .. })
    ));
    scene.radii = Radii::PerPoint(vec![1.0; 9]);
    let error = fit(&scene).unwrap_err();
    assert_eq!(
        error.to_string(),
        "9 radii for 10 points; give one for each point, in the same order"
    );
    assert!(matches!(
        Camera::fit(&good, [0.0; 3], UP, 100, 100),
        Err(DrawError::Direction { name: "view", .. })
    ));
    assert!(matches!(
        Camera::fit(&good, FRONT, UP, 100, 8),
        Err(DrawError::Size {
            width: 100,
            height: 8
        })
    ));
}

#[test]
fn one_point_and_coinciding_points_can_be_drawn() {
    for points in [vec![[5e6, 0.0, 1.0]], vec![[1e-9, 2.0, 3.0]; 40]] {
        let mut scene = Scene::new(points.clone()).unwrap();
        scene.markers.push(Marker {
            position: points[0],
            colour: PALETTE[1],
            radius_pixels: Some(4.0),
        });
        let camera = Camera::automatic(&scene, UP, 64, 64).unwrap();
        let image = render(&scene, &camera, &Style::default()).unwrap();
        let [x, y, _] = camera.project(points[0]);
        assert_eq!(image.pixel(x as u32, y as u32), Some(PALETTE[1]));
    }
}
