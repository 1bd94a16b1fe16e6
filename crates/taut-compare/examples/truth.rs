//! True geodesic lengths for pairs of points on a named shape.
//!
//! `cargo run --release -p taut-compare --example truth -- torus:1,0.4 < pairs.txt`
//!
//! Each line holds the coordinates of both points, separated by blanks or commas; a length is
//! printed for each, in the units of the points. Shapes: sphere:R (any dimension),
//! spheroid:EQUATORIAL,POLAR (nearly round), torus:R,r, ellipsoid:a,b,c, flat-torus:R0,R1,
//! rotations, cylinder:R, cone:HALF_ANGLE, hole:R, sheet (parameters of a roll). With a second
//! argument LONGEST, torus and ellipsoid print every geodesic up to that length on the pair's line.

use std::error::Error;
use std::io::{BufRead, stdin};

use taut_compare::closed_form;
use taut_compare::revolution::Spheroid;
use taut_compare::shooting::{geodesics, shortest};
use taut_compare::surface::{Ellipsoid, Surface, Torus};

type Distance = Box<dyn Fn(&[f64], &[f64]) -> Result<Vec<f64>, Box<dyn Error>>>;

fn closed<const D: usize>(distance: impl Fn(&[f64; D], &[f64; D]) -> f64 + 'static) -> Distance {
    Box::new(move |p, q| Ok(vec![distance(p.try_into()?, q.try_into()?)]))
}

fn shot(surface: impl Surface + 'static, longest: Option<f64>) -> Distance {
    Box::new(move |p, q| {
        let (p, q) = (p.try_into()?, q.try_into()?);
        let found = match longest {
            Some(longest) => geodesics(&surface, p, q, longest),
            None => vec![shortest(&surface, p, q).ok_or("no geodesic converged")?],
        };
        Ok(found.iter().map(|geodesic| geodesic.length).collect())
    })
}

fn shape(text: &str, longest: Option<f64>) -> Result<Distance, Box<dyn Error>> {
    let (name, numbers) = text.split_once(':').unwrap_or((text, ""));
    let numbers = numbers
        .split(',')
        .filter(|n| !n.is_empty())
        .map(str::parse)
        .collect::<Result<Vec<f64>, _>>()?;
    Ok(match (name, numbers.as_slice()) {
        ("sphere", &[radius]) => Box::new(move |p, q| Ok(vec![closed_form::sphere(radius, p, q)])),
        ("spheroid", &[equatorial, polar]) => {
            let spheroid = Spheroid::new(equatorial, polar);
            closed(move |p, q| spheroid.distance(p, q))
        }
        ("torus", &[major, minor]) => shot(Torus { major, minor }, longest),
        ("ellipsoid", &[a, b, c]) => shot(
            Ellipsoid {
                semi_axes: [a, b, c],
            },
            longest,
        ),
        ("flat-torus", &[r0, r1]) => closed(move |p, q| closed_form::flat_torus([r0, r1], p, q)),
        ("rotations", []) => closed(closed_form::rotations),
        ("cylinder", &[radius]) => closed(move |p, q| closed_form::cylinder(radius, p, q)),
        ("cone", &[half_angle]) => closed(move |p, q| closed_form::cone(half_angle, p, q)),
        ("hole", &[radius]) => closed(move |p, q| closed_form::plane_with_hole(radius, p, q)),
        ("sheet", []) => closed(closed_form::sheet),
        _ => {
            return Err(format!(
                "{text}: expected a shape such as torus:1,0.4 (see the top of this example)"
            )
            .into());
        }
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let name = arguments
        .first()
        .ok_or("expected a shape such as torus:1,0.4")?;
    let longest = arguments.get(1).map(|text| text.parse()).transpose()?;
    let distance = shape(name, longest)?;
    for (row, line) in stdin().lock().lines().enumerate() {
        let line = line?;
        let fields = line
            .split(|c: char| c == ',' || c.is_whitespace())
            .filter(|field| !field.is_empty());
        let numbers = fields.map(str::parse).collect::<Result<Vec<f64>, _>>()?;
        if numbers.len() % 2 == 1 {
            return Err(format!(
                "line {}: {} numbers, expected two points",
                row + 1,
                numbers.len()
            )
            .into());
        }
        let (p, q) = numbers.split_at(numbers.len() / 2);
        let lengths = distance(p, q).map_err(|error| format!("line {}: {error}", row + 1))?;
        println!(
            "{}",
            lengths
                .iter()
                .map(f64::to_string)
                .collect::<Vec<_>>()
                .join(" ")
        );
    }
    Ok(())
}
