//! Models whose numbers were changed: what a fuzzer of text would seldom get past the parser.

use std::sync::LazyLock;

use taut_core::cloud::Cloud;
use taut_core::surface::atlas::{Atlas, FitSettings, Model, ModelChart};

use crate::Bytes;
use crate::models::through;

/// A cap of a paraboloid with a hole: charts, rims and all.
static MODELS: LazyLock<[Model; 2]> = LazyLock::new(|| [of_cap(6, 0.02), of_cap(5, 1e-3)]);

fn of_cap(side: i32, accuracy: f64) -> Model {
    let place = |i: i32| f64::from(i) / f64::from(side);
    let grid = (-side..=side).flat_map(|i| (-side..=side).map(move |j| (place(i), place(j))));
    let rows = grid
        .filter(|(x, y)| (0.1..1.0).contains(&(x * x + y * y)))
        .flat_map(|(x, y)| [x, y, 0.4 * (x * x - 0.7 * y * y)]);
    let cloud = Cloud::<3>::new(&rows.collect::<Vec<_>>(), 3).unwrap();
    let settings = FitSettings {
        accuracy: Some(accuracy),
        ..FitSettings::default()
    };
    Atlas::fit(cloud, 2, &settings).unwrap().0.to_model()
}

pub fn edits(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let mut model = MODELS[usize::from(bytes.byte() % 2)].clone();
    for _ in 0..MOST {
        if bytes.is_empty() {
            break;
        }
        edit(&mut model, &mut bytes);
    }
    through(&model);
}

const MOST: usize = 12;

fn edit(model: &mut Model, bytes: &mut Bytes<'_>) {
    let header = &mut model.header;
    let (what, index) = (bytes.byte(), usize::from(bytes.byte()));
    match what % 16 {
        0 => change(&mut header.detail, bytes),
        1 => change_one(&mut header.centre, bytes),
        2 => model.charts.truncate(index),
        what => {
            let count = model.charts.len().max(1);
            if let Some(chart) = model.charts.get_mut(index % count) {
                edit_chart(chart, what, bytes);
            }
        }
    }
}

fn edit_chart(chart: &mut ModelChart, what: u8, bytes: &mut Bytes<'_>) {
    match what {
        3 => change_one(&mut chart.origin, bytes),
        4 => turn(chart, bytes),
        5 => change(&mut chart.radius, bytes),
        6 => change(&mut chart.scale, bytes),
        7 => chart.degree = bytes.byte() % 12,
        8 | 9 => {
            for list in &mut chart.coefficients {
                change_one(list, bytes);
            }
        }
        10 => change(&mut chart.spacing, bytes),
        11 => change(&mut chart.residual, bytes),
        12 => change(&mut chart.height_error, bytes),
        13 => {
            let (place, value) = (bytes.byte(), bytes.byte());
            let count = chart.neighbours.len().max(1);
            if let Some(neighbour) = chart.neighbours.get_mut(usize::from(place) % count) {
                *neighbour = value.into();
            }
        }
        14 => {
            let place = usize::from(bytes.byte()) % chart.sides.len().max(1);
            if let Some(side) = chart.sides.get_mut(place) {
                *side = -*side;
            }
        }
        _ => {
            let count = chart.rim.len().max(1);
            if let Some(disc) = chart.rim.get_mut(usize::from(bytes.byte()) % count) {
                change_one(&mut disc.centre, bytes);
                change(&mut disc.radius, bytes);
                change(&mut disc.share, bytes);
            }
        }
    }
}

/// Turns the frame in the plane of two of its vectors.
fn turn(chart: &mut ModelChart, bytes: &mut Bytes<'_>) {
    let (sin, cos) = bytes.fine().sin_cos();
    let (first, second) = [(0, 1), (1, 2), (2, 0)][usize::from(bytes.byte()) % 3];
    for axis in 0..3 {
        let (a, b) = (chart.frame[first][axis], chart.frame[second][axis]);
        chart.frame[first][axis] = cos * a - sin * b;
        chart.frame[second][axis] = sin * a + cos * b;
    }
}

fn change_one(values: &mut [f64], bytes: &mut Bytes<'_>) {
    let place = usize::from(bytes.byte()) % values.len().max(1);
    if let Some(value) = values.get_mut(place) {
        change(value, bytes);
    }
}

/// Changes a number a little, by orders of magnitude, or to any other.
fn change(value: &mut f64, bytes: &mut Bytes<'_>) {
    match bytes.byte() % 5 {
        0 => *value *= 1.0 + bytes.small() / 128.0,
        1 => *value *= 1.2_f64.powf(bytes.small()),
        2 => *value *= bytes.magnitude(),
        3 => *value += bytes.fine(),
        _ => *value = bytes.any(),
    }
}
