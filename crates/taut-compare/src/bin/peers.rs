//! This library beside its peers, in one run of a harness that measures them on the same clouds:
//! `cargo run --release -p taut-compare --features measure --bin peers -- HARNESS PYTHON STAGES`,
//! the folder of `run_all.py`, the Python that it needs, and its stages, such as
//! `field10k,field100k`. Prints times and errors, and the ratio of times, as a table. Without the
//! folder it says so and ends well.
//!
//! The harness calls this command back, `--field POINTS SOURCE OUT`, for the distances from a row
//! to all others.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use serde_json::Value;
use taut_core::cloud::Cloud;
use taut_core::field::{Fields, Settings, Source};
use taut_core::geodesics::Geodesics;
use taut_core::surface::atlas::Atlas;

type Failure = Box<dyn std::error::Error>;

const FIELD: &str = "--field";
const NAME: &str = "taut";
/// Fields measured for the best time of a later one.
const LATER: usize = 5;

/// Writes the distances from a row, and tells the seconds of set-up (with what the first field does
/// for all) and of a later field as the harness reads them.
fn field(points: &Path, source: usize, out: &Path) -> Result<(), Failure> {
    let set = taut_io::read(points, &taut_io::ReadOptions::default())?;
    let start = Instant::now();
    let cloud = Cloud::<3>::new(&set.coordinates, set.dimension)?;
    let geodesics = Geodesics::of_atlas(Atlas::new(cloud, 2)?);
    let fields = Fields::of_cloud(&geodesics)?;
    let node = geodesics.surface().node_of_row(source)?;
    let one = || -> Result<_, Failure> {
        let field = fields.from(&[Source { node, start: 0.0 }], &Settings::default())?;
        Ok(fields.at_points(&field))
    };
    let mut values = one()?;
    let first = start.elapsed().as_secs_f64();
    let mut later = f64::INFINITY;
    for _ in 0..LATER {
        let start = Instant::now();
        values = one()?;
        later = later.min(start.elapsed().as_secs_f64());
    }
    let rows = &geodesics.surface().cloud().point_of_row;
    let distances: Vec<f64> = rows
        .iter()
        .map(|point| point.map_or(f64::NAN, |point| values[point as usize].distance))
        .collect();
    taut_io::write_points(out, 1, &distances, None)?;
    println!("{{\"setup_s\": {}, \"query_s\": {later}}}", first - later);
    Ok(())
}

fn compare(harness: &Path, python: &str, stages: &str) -> Result<(), Failure> {
    let script = harness.join("run_all.py");
    if !script.exists() {
        println!("skipped: there is no {}", script.display());
        return Ok(());
    }
    let folder: PathBuf = std::env::temp_dir().join(format!("taut-peers-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let (competitors, results) = (folder.join("competitors.json"), folder.join("results.json"));
    let this = std::env::current_exe()?;
    let command = format!(
        "'{}' {FIELD} {{points_npy}} {{source}} {{out_npy}}",
        this.display()
    );
    std::fs::write(
        &competitors,
        serde_json::json!([{ "name": NAME, "field_cmd": command }]).to_string(),
    )?;
    let status = Command::new(python)
        .arg(&script)
        .args(["--stages", stages])
        .arg("--competitors")
        .arg(&competitors)
        .arg("--out")
        .arg(&results)
        .status()?;
    if !status.success() {
        return Err(format!("the harness ended with {status}").into());
    }
    let rows: Vec<Value> = serde_json::from_slice(&std::fs::read(&results)?)?;
    std::fs::remove_dir_all(&folder)?;
    print_table(&rows);
    Ok(())
}

/// A line for each measurement of a field, times over this library's on the same cloud behind them.
fn print_table(rows: &[Value]) {
    let text = |row: &Value, key: &str| row[key].as_str().unwrap_or("-").to_owned();
    let number = |row: &Value, key: &str| row[key].as_f64().unwrap_or(f64::NAN);
    println!("| cloud | peer | set-up s | x | query s | x | mean error | max error |");
    println!("|---|---|---|---|---|---|---|---|");
    for row in rows.iter().filter(|row| row["task"] == "field") {
        let ours = rows
            .iter()
            .find(|other| other["peer"] == NAME && other["case"] == row["case"]);
        let ratio = |key: &str| ours.map_or(f64::NAN, |ours| number(row, key) / number(ours, key));
        let peer = format!("{} {}", text(row, "peer"), text(row, "mesh"));
        match row["error"].as_str() {
            Some(error) => println!("| {} | {peer} | {error} ||||||", text(row, "case")),
            None => println!(
                "| {} | {peer} | {:.4} | {:.1} | {:.4} | {:.1} | {:.1e} | {:.1e} |",
                text(row, "case"),
                number(row, "setup_s"),
                ratio("setup_s"),
                number(row, "query_s"),
                ratio("query_s"),
                number(row, "mean_far"),
                number(row, "max_far"),
            ),
        }
    }
}

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments[..] {
        [FIELD, points, source, out] => field(Path::new(points), source.parse()?, Path::new(out)),
        [harness, python, stages] => compare(Path::new(harness), python, stages),
        _ => Err("HARNESS PYTHON STAGES".into()),
    }
}
