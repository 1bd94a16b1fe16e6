//! Every file of the shared data answers what its README says. Skips where the folder is absent.

use std::path::{Path, PathBuf};

use taut_io::{Place, PointSet, ReadError, ReadOptions, read};

fn data() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no folder {}", folder.display());
    None
}

fn load(folder: &Path, name: &str) -> PointSet {
    read(&folder.join(name), &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn bounds(points: &PointSet) -> [[f64; 2]; 3] {
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for row in points
        .coordinates
        .chunks_exact(3)
        .filter(|row| row.iter().all(|value| value.is_finite()))
    {
        for (bound, value) in bounds.iter_mut().zip(row) {
            *bound = [bound[0].min(*value), bound[1].max(*value)];
        }
    }
    bounds
}

/// Name, rows, smallest and greatest coordinates, and half a unit of their last digit.
type Expected = (&'static str, usize, [f64; 3], [f64; 3], f64);

const REAL: [Expected; 16] = [
    (
        "bunny.ply",
        35947,
        [-0.0946899, 0.0329874, -0.0618736],
        [0.0610091, 0.187321, 0.0587997],
        1e-6,
    ),
    (
        "bunny.stl",
        34834,
        [-0.09469, -0.0588, 0.032987],
        [0.061009, 0.061874, 0.187321],
        1e-6,
    ),
    (
        "camel.off",
        9770,
        [-0.152856, -0.489256, -0.5],
        [0.152856, 0.489256, 0.5],
        1e-6,
    ),
    (
        "camel.pcd",
        9770,
        [-0.152856, -0.489256, -0.5],
        [0.152856, 0.489256, 0.5],
        1e-6,
    ),
    (
        "hand.obj",
        4780,
        [-0.578565, -0.806256, -0.286928],
        [0.578565, 0.763502, 0.286928],
        1e-6,
    ),
    (
        "eight_g2.ply",
        20286,
        [-0.235654, -0.100997, -0.491279],
        [0.235654, 0.101584, 0.491279],
        1e-6,
    ),
    (
        "elephant_g3.off",
        44460,
        [-0.358822, -0.499404, -0.300133],
        [0.358436, 0.497472, 0.299583],
        1e-6,
    ),
    (
        "armadillo.off",
        26002,
        [-63.5004, -54.2018, -57.7043],
        [63.5176, 97.1076, 57.7187],
        1e-4,
    ),
    (
        "dragon.ply",
        437_645,
        [-0.108324, 0.0527295, -0.0504143],
        [0.0965662, 0.197173, 0.0412075],
        1e-6,
    ),
    (
        "kitten.xyz",
        5210,
        [-0.325311, -0.499731, -0.29561],
        [0.325692, 0.4989, 0.294955],
        1e-6,
    ),
    (
        "rops_scan.pcd",
        32087,
        [-0.41984, -0.24034, -1.4022],
        [0.40617, 0.24871, -1.0098],
        1e-5,
    ),
    (
        "table_mug_stereo.pcd",
        307_200,
        [-0.45643, -0.51074, 0.69001],
        [0.71518, 0.17923, 2.5927],
        1e-4,
    ),
    (
        "autzen_trim.las",
        110_000,
        [636001.76, 848935.20, 406.26],
        [637179.22, 849497.90, 520.51],
        1e-6,
    ),
    (
        "lone_star.laz",
        518_862,
        [515368.60, 4918340.36, 2322.9],
        [515401.04, 4918381.12, 2338.58],
        6e-3,
    ),
    (
        "pump.e57",
        155_201,
        [-2.90376, -5.3011, -1.8997],
        [1.7216, -0.792648, 1.843],
        1e-4,
    ),
    (
        "roll.ply",
        58000,
        [-0.722574, -0.738821, 0.00400883],
        [0.754916, 0.706326, 0.99599],
        1e-6,
    ),
];

#[test]
fn real_files_load() {
    let Some(folder) = data() else { return };
    for (name, rows, low, high, half_digit) in REAL {
        let points = load(&folder, name);
        assert_eq!((points.rows(), points.dimension), (rows, 3), "{name}");
        for (axis, bound) in bounds(&points).iter().enumerate() {
            let off = (bound[0] - low[axis])
                .abs()
                .max((bound[1] - high[axis]).abs());
            assert!(off <= half_digit, "{name}, axis {axis}: {bound:?}");
        }
    }
}

#[test]
fn only_kitten_has_normals_and_they_are_unit() {
    let Some(folder) = data() else { return };
    for (name, ..) in REAL {
        let points = load(&folder, name);
        assert_eq!(points.normals.is_some(), name == "kitten.xyz", "{name}");
        for normal in points
            .normals
            .iter()
            .flat_map(|normals| normals.chunks_exact(3))
        {
            let length = normal.iter().map(|value| value * value).sum::<f64>().sqrt();
            assert!((length - 1.0).abs() < 1e-4, "{name}: {length}");
        }
    }
}

#[test]
fn twins_agree_and_nan_rows_stay() {
    let Some(folder) = data() else { return };
    let (off, pcd) = (load(&folder, "camel.off"), load(&folder, "camel.pcd"));
    for (exact, single) in off.coordinates.iter().zip(&pcd.coordinates) {
        assert!((exact - single).abs() <= 1.5e-8);
    }
    let scene = load(&folder, "table_mug_stereo.pcd");
    let finite = scene
        .coordinates
        .chunks_exact(3)
        .filter(|row| row.iter().all(|value| value.is_finite()));
    assert_eq!(finite.count(), 209_280);
}

#[test]
fn class_filter_keeps_original_rows() {
    let Some(folder) = data() else { return };
    let file = folder.join("autzen_trim.las");
    let all = load(&folder, "autzen_trim.las");
    let ground = ReadOptions {
        classes: vec![2],
        ..ReadOptions::default()
    };
    let ground = read(&file, &ground).unwrap();
    let rows = ground.rows_kept.as_ref().unwrap();
    assert!(!rows.is_empty() && rows.len() < all.rows());
    for (row, kept) in ground.coordinates.chunks_exact(3).zip(rows) {
        assert_eq!(row, &all.coordinates[3 * kept..][..3]);
    }
    let absent = ReadOptions {
        classes: vec![31],
        ..ReadOptions::default()
    };
    assert!(
        read(&file, &absent)
            .unwrap_err()
            .to_string()
            .contains("2 (")
    );
    let error = read(&folder.join("camel.off"), &absent).unwrap_err();
    assert!(matches!(error, ReadError::ClassesWithoutLas { .. }));
}

#[test]
fn malformed_files_are_told_where_and_why() {
    let Some(folder) = data() else { return };
    let folder = folder.join("bad");
    let lines = [
        ("trunc_header.ply", 5, "proper"),
        ("wrong_count.off", 422, "declared 500"),
        ("mixed_columns.xyz", 7, "2 columns"),
        ("bad_fields.pcd", 4, "2 entries in SIZE"),
    ];
    let bytes = [
        ("trunc_body_le.ply", 3878, "313"),
        ("huge_count.ply", 247, "1099511627776"),
        ("garbage.xyz", 0, "not text"),
        ("wrong_dtype.npy", 10, "c16"),
        ("huge_shape.npy", 128, "1099511627776"),
        ("bad_compressed.pcd", 152, "4294967280"),
        ("trunc.las", 427, "1000000"),
    ];
    let lines = lines.map(|(name, line, text)| (name, Place::Line(line), text));
    let bytes = bytes.map(|(name, offset, text)| (name, Place::Byte(offset), text));
    for (name, place, text) in lines.into_iter().chain(bytes) {
        let error = read(&folder.join(name), &ReadOptions::default()).unwrap_err();
        assert!(
            matches!(&error, ReadError::Malformed { place: found, .. } if *found == place),
            "{error}"
        );
        let message = error.to_string();
        assert!(
            message.contains(text) && message.contains(name),
            "{message}"
        );
        println!("{message}");
    }
}

#[test]
fn empty_and_unknown_files_are_told() {
    let Some(folder) = data() else { return };
    let answer = |name: &str| read(&folder.join("bad").join(name), &ReadOptions::default());
    assert!(matches!(answer("empty.ply"), Err(ReadError::Empty { .. })));
    assert!(matches!(
        answer("zero_points.ply"),
        Err(ReadError::NoPoints { .. })
    ));
    let unknown = answer("unknown.foo").unwrap_err();
    let message = unknown.to_string();
    assert!(
        message.contains("ply, obj, off") && message.contains("--format"),
        "{message}"
    );
    let named = ReadOptions {
        format: "XYZ".parse().ok(),
        ..ReadOptions::default()
    };
    let points = read(&folder.join("bad/unknown.foo"), &named).unwrap();
    assert_eq!(points.rows(), 50);
}

#[test]
fn odd_but_valid_files_load_whole() {
    let Some(folder) = data() else { return };
    let folder = folder.join("bad");
    let files = [
        ("nan_inf.ply", 500),
        ("one_point.xyz", 1),
        ("all_identical.xyz", 50),
        ("collinear.xyz", 100),
        ("two_components.ply", 1000),
        ("duplicates.xyz", 800),
    ];
    for (name, rows) in files {
        assert_eq!(load(&folder, name).rows(), rows, "{name}");
    }
    let odd = load(&folder, "nan_inf.ply");
    let not_finite: Vec<usize> = odd
        .coordinates
        .chunks_exact(3)
        .enumerate()
        .filter_map(|(index, row)| row.iter().any(|value| !value.is_finite()).then_some(index))
        .collect();
    assert_eq!(not_finite, [10, 20, 30]);
}
