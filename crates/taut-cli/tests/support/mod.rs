//! Runs the command and makes clouds whose distances are known.
#![allow(dead_code)]

pub mod case;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::Value;

pub fn taut(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_taut"))
        .args(arguments)
        .output()
        .expect("the command runs")
}

/// Runs the command with text on standard input.
pub fn taut_reading(arguments: &[&str], input: &str) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_taut"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    let mut stdin = child.stdin.take().expect("a pipe");
    stdin.write_all(input.as_bytes()).expect("it reads");
    drop(stdin);
    child.wait_with_output().expect("it ends")
}

pub fn code(output: &Output) -> i32 {
    output.status.code().expect("ended by itself")
}

pub fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("UTF-8")
}

/// The JSON objects on standard output, after checking the exit code.
pub fn objects(output: &Output, expected: i32) -> Vec<Value> {
    assert_eq!(code(output), expected, "{}", text(&output.stderr));
    text(&output.stdout)
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect()
}

pub fn object(output: &Output, expected: i32) -> Value {
    let mut objects = objects(output, expected);
    assert_eq!(objects.len(), 1);
    objects.remove(0)
}

pub fn number(object: &Value, key: &str) -> f64 {
    object[key]
        .as_f64()
        .unwrap_or_else(|| panic!("{key} in {object}"))
}

/// Random points on the sphere of radius 1 about `centre`.
pub fn sphere(count: usize, centre: [f64; 3], seed: u64) -> Vec<[f64; 3]> {
    let mut random = Pcg64::seed_from_u64(seed);
    (0..count)
        .map(|_| {
            let height = 2.0 * random.random::<f64>() - 1.0;
            let angle = std::f64::consts::TAU * random.random::<f64>();
            let across = (1.0 - height * height).sqrt();
            let point = [across * angle.cos(), across * angle.sin(), height];
            std::array::from_fn(|i| centre[i] + point[i])
        })
        .collect()
}

pub fn write_points(file: &Path, points: &[[f64; 3]]) {
    let rows: Vec<String> = points
        .iter()
        .map(|[x, y, z]| format!("{x:?} {y:?} {z:?}"))
        .collect();
    std::fs::write(file, rows.join("\n")).expect("written");
}

/// The angle between two points of the unit sphere.
pub fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let cross = [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ];
    let dot: f64 = a.iter().zip(&b).map(|(x, y)| x * y).sum();
    cross.iter().map(|c| c * c).sum::<f64>().sqrt().atan2(dot)
}

/// The folder of shared test data, where it is present.
pub fn shared_data() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: {} is absent", folder.display());
    None
}
