//! Writes well-formed inputs of every target into `fuzz/corpus`, for fuzzers to begin with.

#![expect(clippy::unwrap_used, reason = "a tool fails by panicking")]

use std::io::Cursor;
use std::path::Path;

use taut_core::cloud::Cloud;
use taut_core::surface::atlas::{Atlas, FitSettings};
use taut_io::{Polyline, write_polylines};

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    let mut inputs = written();
    inputs.extend(texts());
    inputs.extend(scans());
    inputs.extend(formulas());
    inputs.extend(numbers());
    inputs.push(("model", "cap", model()));
    for (target, name, bytes) in inputs {
        let folder = root.join(target);
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join(name), bytes).unwrap();
    }
}

type Input = (&'static str, &'static str, Vec<u8>);

/// What our own writers write.
fn written() -> Vec<Input> {
    let path = Polyline {
        dimension: 3,
        points: &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 2.0, 0.5],
        normals: Some(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0]),
        arc_length: &[0.0, 1.0, 3.1],
        level: None,
    };
    let folder = tempfile::tempdir().unwrap();
    let of = |target: &'static str| {
        let file = folder.path().join(format!("path.{target}"));
        write_polylines(&file, &[path]).unwrap();
        (target, "path", std::fs::read(&file).unwrap())
    };
    ["ply", "obj", "csv", "npy"].map(of).to_vec()
}

fn texts() -> Vec<Input> {
    let ply = "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int a\nelement vertex 1\nproperty float x\n\
               property float y\nproperty float z\nproperty float cost\nend_header\n3 0 0 0\n1 2 3 4\n";
    let big = [
        &b"ply\nformat binary_big_endian 1.0\nelement vertex 2\nproperty short x\nproperty uchar y\nproperty double z\nend_header\n"[..],
        &[0, 1, 2, 63, 240, 0, 0, 0, 0, 0, 0, 0, 4, 5, 63, 224, 0, 0, 0, 0, 0, 0],
    ]
    .concat();
    let stl = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 1\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\nendsolid s\n";
    let npy = |descr: &str, order: &str, body: &[u8]| {
        let text = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': (2, 3), }}\n");
        let length = (text.len() as u16).to_le_bytes();
        [&b"\x93NUMPY\x01\x00"[..], &length, text.as_bytes(), body].concat()
    };
    vec![
        ("ply", "text", ply.into()),
        ("ply", "big_endian", big),
        (
            "obj",
            "normals",
            b"v 0 0 0\nv 1 0 0\nvn 0 0 1\nvn 0 1 0\nf 1//1 2//2 1//1\n".into(),
        ),
        (
            "off",
            "normals",
            b"NOFF\n2 1 0\n1 2 3 0 0 1\n4 5 6 0 1 0\n1 0\n".into(),
        ),
        (
            "off",
            "colours",
            b"COFF # c\n1 0 0\n1 2 3 255 0 0 1\n".into(),
        ),
        ("stl", "text", stl.into()),
        (
            "stl",
            "binary",
            [vec![0; 80], vec![2, 0, 0, 0], vec![7; 100]].concat(),
        ),
        ("xyz", "normals", b"1 2 3 0 0 1\n4 5 6 0 1 0\n".into()),
        ("xyz", "names", b"x,y,z,cost\n1,2,3,4\n5,6,7,8\n".into()),
        (
            "csv",
            "names",
            b"label;\"Z\";y;x;cost\na;3;2;1;1\nb;6;5;4;2\n".into(),
        ),
        (
            "csv",
            "four",
            b"x1 x2 x3 x4 n1 n2 n3 n4\n1 2 3 4 0 0 0 1\n".into(),
        ),
        ("npy", "f4", npy("<f4", "False", &[1; 24])),
        ("npy", "f8_columns", npy(">f8", "True", &[63; 48])),
        ("lists", "rows", b"# rows\n12\n7\n0\n".into()),
        ("lists", "pairs", b"0 12\n3 7 # last\n".into()),
        (
            "lists",
            "points",
            b"0, 0, 1, 1, 1.5, 1\n// c\n1,2,3,4,5,6\n".into(),
        ),
        ("lists", "values", b"x;y;z\n1;2;3\n4;5;6\n".into()),
        ("pcd", "text", pcd("ascii", b"1 2 3 9\n4 5 6 nan\n")),
        ("pcd", "binary", pcd("binary", &[1; 32])),
        ("pcd", "packed", packed()),
    ]
}

fn pcd(data: &str, body: &[u8]) -> Vec<u8> {
    let header = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z i\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ";
    [header.as_bytes(), data.as_bytes(), b"\n", body].concat()
}

/// 32 bytes: one literal and 31 copies of it.
fn packed() -> Vec<u8> {
    let stream = [0, 7, 0xe0, 22, 0];
    let sizes = [(stream.len() as u32).to_le_bytes(), 32_u32.to_le_bytes()].concat();
    pcd("binary_compressed", &[&sizes[..], &stream].concat())
}

fn scans() -> Vec<Input> {
    let mut scans: Vec<Input> = vec![("e57", "scan", e57())];
    let formats = [
        ("0", 0, false),
        ("3", 3, false),
        ("6", 6, false),
        ("8", 8, false),
        ("0_packed", 0, true),
        ("1_packed", 1, true),
        ("3_packed", 3, true),
        ("6_packed", 6, true),
        ("7_packed", 7, true),
        ("8_packed", 8, true),
    ];
    for (name, format, is_packed) in formats {
        let bytes = las(format, is_packed);
        scans.extend(["las", "copies"].map(|target| (target, name, bytes.clone())));
    }
    scans
}

/// Nine points.
fn las(format: u8, is_packed: bool) -> Vec<u8> {
    let mut builder = las::Builder::from((1, if format < 6 { 2 } else { 4 }));
    builder.point_format = las::point::Format::new(format).unwrap();
    builder.point_format.is_compressed = is_packed;
    let header = builder.into_header().unwrap();
    let mut writer = las::Writer::new(Cursor::new(Vec::new()), header).unwrap();
    let point_format = las::point::Format::new(format).unwrap();
    for index in 0..9_u16 {
        let x = f64::from(index);
        writer
            .write_point(las::Point {
                x,
                y: x * x,
                z: 0.5,
                intensity: 7 * index,
                gps_time: point_format.has_gps_time.then_some(1e5 + x),
                color: point_format
                    .has_color
                    .then(|| las::Color::new(index, 2, 300)),
                nir: point_format.has_nir.then_some(index),
                ..las::Point::default()
            })
            .unwrap();
    }
    writer.into_inner().unwrap().into_inner()
}

fn e57() -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut writer = e57::E57Writer::new(&mut bytes, "file").unwrap();
    let integer = |max| e57::RecordDataType::ScaledInteger {
        min: 0,
        max,
        scale: 0.01,
        offset: 0.0,
    };
    let record = |name, data_type| e57::Record { name, data_type };
    let prototype = vec![
        e57::Record::CARTESIAN_X_F64,
        e57::Record::CARTESIAN_Y_F32,
        record(e57::RecordName::CartesianZ, integer(1000)),
        record(
            e57::RecordName::CartesianInvalidState,
            e57::RecordDataType::Integer { min: 0, max: 2 },
        ),
    ];
    let mut scan = writer.add_pointcloud("scan", prototype).unwrap();
    for index in 0..4_u8 {
        let x = e57::RecordValue::Double(f64::from(index));
        let y = e57::RecordValue::Single(0.5);
        let z = e57::RecordValue::ScaledInteger(i64::from(index));
        let state = e57::RecordValue::Integer(if index == 1 { 2 } else { 0 });
        scan.add_point(vec![x, y, z, state]).unwrap();
    }
    scan.finalize().unwrap();
    writer.finalize().unwrap();
    drop(writer);
    bytes.into_inner()
}

fn formulas() -> Vec<Input> {
    let of = |(name, text): (&'static str, &str)| ("formula", name, text.into());
    [
        ("sphere", "x^2 + y^2 + z^2 = 1"),
        ("torus", "(sqrt(x**2 + y**2) - 2)^2 + z^2 - 0.25"),
        (
            "functions",
            "atan2(y, x) * exp(-sin(3*z)) + min(abs(x), cosh(y), 2.5e-1) = log(1 + sign(z))",
        ),
        ("powers", "x^0.5 + y^-1.5 - 2^z + pow(x, y)"),
        ("two", "x1^2 + x2^2 - 1\nx3^2 + x4^2 - 1\n"),
        (
            "wave",
            "tan(asin(x/3)) - acos(y)*sinh(pi*z)/tanh(e) = max(x, y, z)",
        ),
    ]
    .map(of)
    .to_vec()
}

/// Bytes that are numbers: of points of clouds, and of edits of models.
fn numbers() -> Vec<Input> {
    let mut random = 1_u32;
    let mut byte = move || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (random >> 24) as u8
    };
    let mut inputs: Vec<Input> = Vec::new();
    for target in ["atlas", "field", "fit"] {
        for (name, choices, each) in [
            ("whole", 4, 3),
            ("fine", 5, 6),
            ("magnitudes", 6, 6),
            ("any", 7, 24),
            ("curve", 1, 6),
            ("rays", 4 | 2 << 3 | 1, 6),
            ("slopes", 4 | 1 << 3, 3),
        ] {
            let count = 25;
            let mut bytes = vec![choices, count - 3, 0, 0];
            bytes.extend((0..usize::from(count) * each).map(|_| byte()));
            inputs.push((target, name, bytes));
        }
        inputs.push((target, "spiral", vec![5, 50, 0, 0]));
        let grid = (0..7_u8).flat_map(|i| (0..7_u8).map(move |j| (i, j)));
        let flat = grid.clone().flat_map(|(i, j)| [i, j, 0]);
        inputs.push((
            target,
            "flat",
            [4, 46, 0, 0].into_iter().chain(flat).collect(),
        ));
        let bowl = grid.flat_map(|(i, j)| {
            let [x, y] = [i, j].map(|v| f64::from(v) - 3.0);
            [x, y, 0.1 * (x * x + y * y)].map(|v| ((256.0 * v) as i16).to_le_bytes())
        });
        let bowl: Vec<u8> = bowl.flatten().collect();
        for (name, choices) in [("bowl", 5), ("bowl_rays", 5 | 2 << 3)] {
            inputs.push((target, name, [&[choices, 46, 0, 0][..], &bowl].concat()));
        }
    }
    for (name, count) in [("one", 5), ("few", 20), ("many", 80)] {
        inputs.push(("edits", name, (0..count).map(|_| byte()).collect()));
    }
    inputs
}

/// A model's file as the command writes it.
fn model() -> Vec<u8> {
    let place = |i: i32| f64::from(i) / 5.0;
    let grid = (-5..=5).flat_map(|i| (-5..=5).map(move |j| (place(i), place(j))));
    let rows = grid.flat_map(|(x, y)| [x, y, 0.4 * (x * x - 0.7 * y * y)]);
    let cloud = Cloud::<3>::new(&rows.collect::<Vec<_>>(), 3).unwrap();
    let settings = FitSettings {
        accuracy: Some(0.05),
        ..FitSettings::default()
    };
    let model = Atlas::fit(cloud, 2, &settings).unwrap().0.to_model();
    let mut text = format!(
        "{{\"format\":\"taut model\",\"version\":1,\"coordinates\":3,\"charts\":{},\"atlas\":{}}}\n",
        model.charts.len(),
        serde_json::to_string(&model.header).unwrap()
    );
    for chart in &model.charts {
        text += &serde_json::to_string(chart).unwrap();
        text.push('\n');
    }
    text.into()
}
