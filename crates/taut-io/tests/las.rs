//! LAS and LAZ written beside others: every point format and version, read back by us and by laspy.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use taut_io::{Column, Content, PointTable, ReadOptions, check_output, read, write_table};

/// Bytes of a record of each point format.
const SIZES: [u16; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];
const ROWS: usize = 300;
const SCALE: f64 = 0.01;
const OFFSET: f64 = 1000.0;

/// The highest point format of each minor version.
const FORMATS: [u8; 5] = [1, 1, 3, 5, 10];

struct Random(u64);

impl Random {
    fn next(&mut self) -> u8 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 56) as u8
    }
}

/// A file with two undescribed extra bytes in each record, a record beside the points, wave forms
/// from version 1.3 on, and two extended records in version 1.4.
struct Scan {
    bytes: Vec<u8>,
    /// One after the other.
    records: Vec<u8>,
    record: usize,
}

const WAVES: &[u8] = b"the wave forms";
const BESIDE: &[u8] = b"a coordinate system";

fn scan(minor: u8, format: u8) -> Scan {
    let mut random = Random(u64::from(minor) * 100 + u64::from(format));
    let record = usize::from(SIZES[usize::from(format)]) + 2;
    let mut records = Vec::new();
    for row in 0..ROWS {
        let mut bytes: Vec<u8> = (0..record).map(|_| random.next()).collect();
        for axis in 0..3 {
            let value = (row as i32 - 100) * (axis as i32 + 1) + i32::from(random.next());
            bytes[4 * axis..4 * axis + 4].copy_from_slice(&value.to_le_bytes());
        }
        let returns = if format < 6 { 5 } else { 15 };
        let number = 1 + random.next() % returns;
        bytes[14] = if format < 6 {
            number | returns << 3
        } else {
            number | returns << 4
        };
        let time_at = [0, 20, 0, 20, 20, 20, 22, 22, 22, 22, 22][usize::from(format)];
        if time_at > 0 {
            // Times of some three sequences.
            let time = 1e5 * f64::from(random.next() % 3) + row as f64 * 1e-3;
            bytes[time_at..time_at + 8].copy_from_slice(&time.to_le_bytes());
        }
        records.extend(bytes);
    }
    let header_size = [227, 227, 227, 235, 375][usize::from(minor)];
    let mut bytes = vec![0; header_size];
    bytes[..4].copy_from_slice(b"LASF");
    let is_with_waves = minor >= 3;
    bytes[6] = if is_with_waves { 2 } else { 0 };
    bytes[8] = 77;
    (bytes[24], bytes[25]) = (1, minor);
    bytes[26..30].copy_from_slice(b"test");
    let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
    put(94, &(header_size as u16).to_le_bytes());
    let signature: &[u8] = if minor == 0 { &[0xdd, 0xcc] } else { &[] };
    let points_at = header_size + 54 + BESIDE.len() + signature.len();
    put(96, &(points_at as u32).to_le_bytes());
    put(100, &1_u32.to_le_bytes());
    put(104, &[format]);
    put(105, &(record as u16).to_le_bytes());
    if format < 6 {
        put(107, &(ROWS as u32).to_le_bytes());
    }
    for axis in 0..3 {
        put(131 + 8 * axis, &SCALE.to_le_bytes());
        put(155 + 8 * axis, &OFFSET.to_le_bytes());
    }
    let behind = points_at + records.len();
    let extended = behind + 60 + WAVES.len();
    if is_with_waves {
        put(227, &(behind as u64).to_le_bytes());
    }
    if minor >= 4 {
        put(235, &(extended as u64).to_le_bytes());
        put(243, &2_u32.to_le_bytes());
        put(247, &(ROWS as u64).to_le_bytes());
    }
    bytes.extend(variable("LASF_Projection", 34735, BESIDE, false));
    bytes.extend(signature);
    bytes.extend(&records);
    if is_with_waves {
        bytes.extend(variable("LASF_Spec", 65535, WAVES, true));
    }
    if minor >= 4 {
        bytes.extend(variable("first", 1, b"one", true));
        bytes.extend(variable("second", 2, b"", true));
    }
    Scan {
        bytes,
        records,
        record,
    }
}

fn variable(user: &str, id: u16, data: &[u8], is_extended: bool) -> Vec<u8> {
    let mut bytes = vec![0; if is_extended { 60 } else { 54 }];
    bytes[2..2 + user.len()].copy_from_slice(user.as_bytes());
    bytes[18..20].copy_from_slice(&id.to_le_bytes());
    bytes[20..22].copy_from_slice(&(data.len() as u16).to_le_bytes());
    bytes.extend(data);
    bytes
}

fn columns_of(scan: &Scan, rows: Option<&[usize]>) -> ([Vec<f64>; 2], Vec<u8>) {
    let all: Vec<usize> = (0..ROWS).collect();
    let rows = rows.unwrap_or(&all);
    let distance: Vec<f64> = rows.iter().map(|row| *row as f64 * 0.25).collect();
    let error: Vec<f64> = rows.iter().map(|row| 1.0 / (1.0 + *row as f64)).collect();
    let mut records = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        records.extend(&scan.records[scan.record * row..][..scan.record]);
        records.extend(distance[i].to_le_bytes());
        records.extend(error[i].to_le_bytes());
    }
    ([distance, error], records)
}

fn write(out: &Path, original: &Path, columns: &[Vec<f64>; 2], rows: Option<&[usize]>) {
    let [distance, error] = columns;
    let columns = [("distance", distance), ("error", error)];
    let columns = columns.map(|(name, values)| Column { name, values });
    let table = PointTable {
        dimension: 3,
        coordinates: &vec![0.0; 3 * distance.len()],
        normals: None,
        columns: &columns,
        colours: None,
    };
    let content = Content::Table {
        original: Some(original),
        columns: 2,
    };
    check_output(out, content, Some(3)).unwrap();
    write_table(out, &table, Some(original), rows).unwrap();
}

fn number(bytes: &[u8], at: usize, size: usize) -> u64 {
    let mut wide = [0; 8];
    wide[..size].copy_from_slice(&bytes[at..at + size]);
    u64::from_le_bytes(wide)
}

/// Compares a written file with what it should hold.
fn check(file: &Path, minor: u8, format: u8, columns: &[Vec<f64>; 2]) {
    let named = |name: &str| ReadOptions {
        column: Some(name.to_owned()),
        ..ReadOptions::default()
    };
    let rows = columns[0].len();
    for (name, values) in [("distance", &columns[0]), ("error", &columns[1])] {
        let found = read(file, &named(name)).unwrap();
        assert_eq!(found.rows(), rows, "{}", file.display());
        assert_eq!(found.column.as_ref(), Some(values), "{}", file.display());
        // The header's box holds the points and no more.
        let bytes = fs::read(file).unwrap();
        for axis in 0..3 {
            let along = || found.coordinates.iter().skip(axis).step_by(3).copied();
            let high = f64::from_bits(number(&bytes, 179 + 16 * axis, 8));
            let low = f64::from_bits(number(&bytes, 187 + 16 * axis, 8));
            assert!((along().fold(f64::NEG_INFINITY, f64::max) - high).abs() < 1e-9);
            assert!((along().fold(f64::INFINITY, f64::min) - low).abs() < 1e-9);
        }
    }
    let bytes = fs::read(file).unwrap();
    assert_eq!(
        (bytes[25], bytes[104] & 0x3f, bytes[8]),
        (minor, format, 77)
    );
    let is_packed = file.extension().unwrap() == "laz";
    assert_eq!(bytes[104] & 0x80 != 0, is_packed);
    let short = if format < 6 { rows as u64 } else { 0 };
    assert_eq!(number(&bytes, 107, 4), short);
    assert_eq!(
        (0..5).map(|i| number(&bytes, 111 + 4 * i, 4)).sum::<u64>(),
        short
    );
    if minor >= 4 {
        assert_eq!(number(&bytes, 247, 8), rows as u64);
        let returns: u64 = (0..15).map(|i| number(&bytes, 255 + 8 * i, 8)).sum();
        assert_eq!(returns, rows as u64);
        assert_eq!(number(&bytes, 243, 4), 2);
        let first = number(&bytes, 235, 8) as usize;
        assert_eq!(
            &bytes[first..],
            [
                variable("first", 1, b"one", true),
                variable("second", 2, b"", true)
            ]
            .concat()
        );
    }
    if minor >= 3 {
        let waves = number(&bytes, 227, 8) as usize;
        assert!(bytes[waves..].starts_with(&variable("LASF_Spec", 65535, WAVES, true)));
    }
    let contains = |text: &[u8]| bytes.windows(text.len()).any(|found| found == text);
    assert!(contains(BESIDE));
    assert_eq!(contains(b"laszip encoded"), is_packed, "{}", file.display());
}

/// Writes every point format of every version from LAS and from LAZ into LAS and LAZ, all rows and
/// some; answers the files, beside each of which lies one of its records as bytes.
fn written(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let some: Vec<usize> = (0..ROWS).filter(|row| row % 3 == 1).collect();
    for minor in 0..=4 {
        for format in 0..=FORMATS[usize::from(minor)] {
            let scan = scan(minor, format);
            let name = |what: &str| folder.join(format!("1.{minor}-{format}-{what}"));
            let original = name("original.las");
            fs::write(&original, &scan.bytes).unwrap();
            for (what, from, rows) in [
                ("las-las.las", "original.las", None),
                ("las-laz.laz", "original.las", None),
                ("las-some.las", "original.las", Some(&some[..])),
                ("las-some.laz", "original.las", Some(&some[..])),
            ] {
                let (columns, records) = columns_of(&scan, rows);
                let file = name(what);
                write(&file, &name(from), &columns, rows);
                check(&file, minor, format, &columns);
                fs::write(file.with_extension("raw"), records).unwrap();
                files.push(file);
            }
            // A packed original: the one just written, whose columns have the names already.
            for what in ["laz-las.las", "laz-laz.laz"] {
                let ([distance, error], _) = columns_of(&scan, None);
                let doubled =
                    [distance, error].map(|values| values.iter().map(|v| 2.0 * v).collect());
                let file = name(what);
                write(&file, &name("las-laz.laz"), &doubled, None);
                let named = |name: &str| ReadOptions {
                    column: Some(name.to_owned()),
                    ..ReadOptions::default()
                };
                assert_eq!(
                    read(&file, &named("distance_2")).unwrap().column.unwrap(),
                    doubled[0]
                );
                assert_eq!(
                    read(&file, &named("error_2")).unwrap().column.unwrap(),
                    doubled[1]
                );
                let before = fs::read(name("las-laz.raw")).unwrap();
                let mut records = Vec::new();
                for (row, bytes) in before.chunks_exact(scan.record + 16).enumerate() {
                    records.extend(bytes);
                    doubled
                        .iter()
                        .for_each(|values| records.extend(values[row].to_le_bytes()));
                }
                fs::write(file.with_extension("raw"), records).unwrap();
                files.push(file);
            }
        }
    }
    files
}

#[test]
fn every_point_format_and_version_is_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let files = written(folder.path());
    assert_eq!(files.len(), 6 * (2 + 2 + 4 + 6 + 11));
    let python = match laspy() {
        Ok(python) => python,
        Err(why) => {
            println!("not read back by laspy: {why}");
            return;
        }
    };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/las/read_back.py");
    let found = Command::new(python)
        .arg(script)
        .args(&files)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&found.stdout);
    print!("{text}");
    assert!(
        found.status.success(),
        "{text}{}",
        String::from_utf8_lossy(&found.stderr)
    );
}

/// A Python with laspy and two libraries that unpack LAZ, one of which shares nothing with ours; or
/// why there is none.
fn laspy() -> Result<PathBuf, String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("laspy");
    let python = folder.join(if cfg!(windows) {
        "Scripts/python.exe"
    } else {
        "bin/python"
    });
    let run = |program: &Path, arguments: &[&str]| {
        let found = Command::new(program).args(arguments).output();
        let found =
            found.map_err(|error| format!("{} does not run: {error}", program.display()))?;
        match found.status.success() {
            true => Ok(()),
            false => Err(format!(
                "{} {}: {}",
                program.display(),
                arguments.join(" "),
                String::from_utf8_lossy(&found.stderr)
                    .lines()
                    .last()
                    .unwrap_or_default()
            )),
        }
    };
    let is_there = || run(&python, &["-c", "import laspy, lazrs, laszip"]);
    if is_there().is_err() {
        let system = Path::new(if cfg!(windows) { "python" } else { "python3" });
        run(system, &["-m", "venv", &folder.to_string_lossy()])?;
        let packages = ["-m", "pip", "install", "--quiet", "laspy[lazrs,laszip]"];
        run(&python, &packages)?;
        is_there()?;
    }
    Ok(python)
}

#[test]
fn what_cannot_be_written_is_refused_before() {
    let folder = tempfile::tempdir().unwrap();
    let original = folder.path().join("original.las");
    let check = |name: &str, original: Option<&Path>, columns| {
        let content = Content::Table { original, columns };
        check_output(&folder.path().join(name), content, Some(3)).map_err(|error| error.to_string())
    };
    let refused = |name: &str, original: Option<&Path>, columns, why: &str| {
        let message = check(name, original, columns).unwrap_err();
        assert!(message.contains(why), "{message}");
    };
    fs::write(&original, scan(4, 8).bytes).unwrap();
    check("out.laz", Some(&original), 3).unwrap();
    refused("out.las", None, 3, "come from no LAS");
    refused(
        "out.las",
        Some(Path::new("points.ply")),
        3,
        "come from no LAS",
    );
    refused("out.las", Some(&original), 9000, "more than 65535");
    refused("out.xlsx", None, 3, "expected one of");
    refused("none/out.csv", None, 3, "cannot be written");
    // An unknown point format, and descriptors of more bytes than there are.
    let mut bytes = scan(4, 8).bytes;
    bytes[104] = 11;
    fs::write(&original, &bytes).unwrap();
    refused("out.laz", Some(&original), 3, "format number: 11");
    let mut bytes = scan(2, 1).bytes;
    let described = variable(
        "LASF_Spec",
        4,
        &{
            let mut bytes = [0; 192];
            bytes[2] = 10;
            bytes
        },
        false,
    );
    let points_at = number(&bytes, 96, 4) + described.len() as u64;
    bytes.splice(227..227, described);
    bytes[96..100].copy_from_slice(&(points_at as u32).to_le_bytes());
    bytes[100] = 2;
    fs::write(&original, &bytes).unwrap();
    refused(
        "out.laz",
        Some(&original),
        3,
        "descriptors of 8 extra bytes",
    );
}
