//! Small files that jobs read and the command cannot make. Only arithmetic that rounds alike
//! everywhere is used.

use std::fmt::Write;
use std::path::Path;

/// Lists that go with the clouds of the jobs.
const LISTS: [(&str, &str); 8] = [
    ("pairs.txt", "# from to\n0 400\n17 233\n599 3\n250 250\n"),
    (
        "ends.txt",
        "1 0 0  0 1 0\n0 0 1  0.6 0 -0.8\n0 5 0  1 0 0\n",
    ),
    ("rows.txt", "0\n31\n62\n93\n124\n155\n186\n217\n248\n279\n"),
    ("wells.txt", "1.4 0 0 0.25\n-1.4 0 0 0\n0 0.6 0 0.5\n"),
    (
        "seam.txt",
        "1.4 0 0\n0 1.4 0\n-1.4 0 0\n0 -1.4 0\n1.4 0 0\n",
    ),
    ("at.txt", "0 1.4 0\n0 1 0.4\n-0.6 0 0\n1 0 -0.4\n5 5 5\n"),
    ("vectors.txt", "0 1 0\n0 0 0.5\n0 0.7 -0.7\n0 2 2\n1 0 0\n"),
    ("lake.txt", "-0.3 -0.5\n0.4 -0.4\n0.2 0.6\n-0.2 0.3\n"),
];

/// Writes all of them into a folder.
pub fn write(folder: &Path) -> Result<(), String> {
    let clouds = [
        ("square.csv", square()),
        ("noisy.xyz", noisy_sphere()),
        ("ten.xyz", in_ten_dimensions()),
    ];
    let lists = LISTS.map(|(name, text)| (name, text.to_owned()));
    for (name, text) in clouds.into_iter().chain(lists) {
        let file = folder.join(name);
        std::fs::write(&file, text)
            .map_err(|error| format!("{}: cannot be written: {error}", file.display()))?;
    }
    Ok(())
}

/// Points of the plane round a hole, with a cost that grows along the first axis.
fn square() -> String {
    let mut text = "x1,x2,cost\n".to_owned();
    let mut random = Random(1);
    for [u, v] in jittered(32, &mut random) {
        let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        if x * x + y * y > 0.09 {
            line(&mut text, &[x, y, 1.0 + u], ",");
        }
    }
    text
}

/// Points about the unit sphere, off it by up to 0.05: their spacing is 0.13.
fn noisy_sphere() -> String {
    let mut text = String::new();
    let mut random = Random(2);
    let mut count = 0;
    while count < 800 {
        let point: [f64; 3] = std::array::from_fn(|_| 2.0 * random.next() - 1.0);
        let length = point.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length > 0.1 && length < 1.0 {
            let radius = 1.0 + 0.1 * (random.next() - 0.5);
            line(&mut text, &point.map(|x| x * radius / length), " ");
            count += 1;
        }
    }
    text
}

/// Points of the graph of polynomials over a square: a surface in R^10.
fn in_ten_dimensions() -> String {
    let mut text = String::new();
    let mut random = Random(3);
    for [u, v] in jittered(24, &mut random) {
        let point = [
            u,
            v,
            u * v,
            u * u,
            v * v,
            u * u * v,
            u * v * v,
            0.5 * u * u * u,
            0.5 * v * v * v,
            u - v,
        ];
        line(&mut text, &point, " ");
    }
    text
}

/// One point at random in each cell of a grid on the unit square.
fn jittered(side: u32, random: &mut Random) -> Vec<[f64; 2]> {
    let cells = (0..side).flat_map(|i| (0..side).map(move |j| [i, j]));
    cells
        .map(|cell| cell.map(|i| (f64::from(i) + random.next()) / f64::from(side)))
        .collect()
}

fn line(text: &mut String, numbers: &[f64], separator: &str) {
    let words: Vec<String> = numbers.iter().map(f64::to_string).collect();
    // Writing to a string does not fail.
    let _ = writeln!(text, "{}", words.join(separator));
}

/// Knuth's linear congruential generator of MMIX.
struct Random(u64);

impl Random {
    /// A number from 0 to 1, 1 left out.
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        // The high 32 bits: the low ones repeat soon.
        f64::from((self.0 >> 32) as u32) / 2f64.powi(32)
    }
}
