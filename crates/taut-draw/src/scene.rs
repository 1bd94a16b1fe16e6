//! What is to be drawn: points, paths, markers and words.

use crate::error::DrawError;
use crate::neighbours;

/// Line colours that people with any common form of colour blindness can tell apart, on white
/// and on grey: those of Okabe and Ito, "Color universal design", 2008, without the yellow.
pub const PALETTE: [[u8; 3]; 6] = [
    [213, 94, 0],
    [0, 114, 178],
    [0, 158, 115],
    [204, 121, 167],
    [230, 159, 0],
    [86, 180, 233],
];

/// The colour of points that nothing else colours, and where those of levels begin: light must show
/// on them.
const PLAIN: [u8; 3] = [205, 209, 214];
const DARKEST: f64 = 0.12;

/// Colours of the points, as sRGB.
#[derive(Debug, Clone, PartialEq)]
pub enum Colours {
    /// All points alike.
    Uniform([u8; 3]),
    /// One a point.
    PerPoint(Vec<[u8; 3]>),
}

/// Radii of the discs that stand for the points, in scene units.
#[derive(Debug, Clone, PartialEq)]
pub enum Radii {
    /// All points alike.
    Uniform(f64),
    /// One a point, as uneven scans need it.
    PerPoint(Vec<f64>),
}

/// A polyline over the points.
#[derive(Debug, Clone, PartialEq)]
pub struct ScenePath {
    /// Nodes, in scene units.
    pub points: Vec<[f64; 3]>,
    /// Colour, as sRGB.
    pub colour: [u8; 3],
    /// Width in pixels; `None` takes one that suits the picture's size.
    pub width_pixels: Option<f64>,
}

/// A dot, for the ends of a path and the like.
#[derive(Debug, Clone, PartialEq)]
pub struct Marker {
    /// Place, in scene units.
    pub position: [f64; 3],
    /// Colour, as sRGB.
    pub colour: [u8; 3],
    /// Radius in pixels; `None` takes one that suits the picture's size.
    pub radius_pixels: Option<f64>,
}

/// A number at each point, shown by lines on which it is a multiple of an interval.
#[derive(Debug, Clone, PartialEq)]
pub struct Levels {
    /// One a point; not finite where there is none.
    pub values: Vec<f64>,
    /// By how much the value grows along each axis of the scene, one a point.
    pub gradients: Vec<[f64; 3]>,
    /// Between lines; more than 0.
    pub interval: f64,
}

/// Colours that tell numbers apart, dark for the least and bright for the largest; grey where one
/// is not finite.
#[must_use]
pub fn level_colours(values: &[f64]) -> Vec<[u8; 3]> {
    let finite = values.iter().copied().filter(|v| v.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    let colour = |value: &f64| {
        if !value.is_finite() {
            return PLAIN;
        }
        let share = (value - low) / (high - low).max(f64::MIN_POSITIVE);
        colorous::VIRIDIS
            .eval_continuous(DARKEST + (1.0 - DARKEST) * share)
            .as_array()
    };
    values.iter().map(colour).collect()
}

/// All that a picture shows.
///
/// [`Scene::new`] and [`Scene::with_normals`] fill it from points alone; the fields may then be
/// changed. The attributes of points with a non-finite coordinate are ignored.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Points, in scene units.
    pub points: Vec<[f64; 3]>,
    /// Normals, one a point. Neither their sign nor their length matters. Where a normal is
    /// missing (not finite, or zero, or all are `None`) the disc faces the viewer.
    pub normals: Option<Vec<[f64; 3]>>,
    /// Colours of the points.
    pub colours: Colours,
    /// Radii of the discs.
    pub radii: Radii,
    /// Isolines on the surface of the points.
    pub levels: Option<Levels>,
    /// Lines over the points.
    pub paths: Vec<ScenePath>,
    /// Dots over the points.
    pub markers: Vec<Marker>,
    /// Name of the unit of length, for the scale bar: `Some("m")`, or `Some("")` where the unit
    /// has no name. `None` draws no scale bar.
    pub unit: Option<String>,
    /// One line of text below the picture.
    pub caption: Option<String>,
}

impl Scene {
    /// A scene of light grey points whose normals and spacing are estimated from each point's
    /// twelve nearest neighbours, with a scale bar without a unit.
    ///
    /// # Errors
    ///
    /// [`DrawError::Empty`] where no point is finite.
    ///
    /// # Complexity
    ///
    /// O(n log n): about two seconds for a million points on two cores.
    pub fn new(points: Vec<[f64; 3]>) -> Result<Self, DrawError> {
        let local = neighbours::local_shape(&points)?;
        Ok(Self::from_parts(points, local.normals, local.radii))
    }

    /// The same with normals that are known: one a point, of any length and sign.
    ///
    /// # Errors
    ///
    /// [`DrawError::Empty`] where no point is finite, [`DrawError::Count`] where there are not as
    /// many normals as points.
    pub fn with_normals(points: Vec<[f64; 3]>, normals: Vec<[f64; 3]>) -> Result<Self, DrawError> {
        expect_count("normals", normals.len(), points.len())?;
        let local = neighbours::local_shape(&points)?;
        Ok(Self::from_parts(points, normals, local.radii))
    }

    fn from_parts(points: Vec<[f64; 3]>, normals: Vec<[f64; 3]>, radii: Vec<f64>) -> Self {
        Self {
            points,
            normals: Some(normals),
            colours: Colours::Uniform(PLAIN),
            radii: Radii::PerPoint(radii),
            levels: None,
            paths: Vec::new(),
            markers: Vec::new(),
            unit: Some(String::new()),
            caption: None,
        }
    }

    /// Adds a path in the next colour of [`PALETTE`], with a dot at each end.
    pub fn add_path(&mut self, points: Vec<[f64; 3]>) {
        let colour = PALETTE[self.paths.len() % PALETTE.len()];
        let ends = points.first().into_iter().chain(points.last());
        self.markers.extend(ends.map(|&position| Marker {
            position,
            colour,
            radius_pixels: None,
        }));
        self.paths.push(ScenePath {
            points,
            colour,
            width_pixels: None,
        });
    }

    /// Colours the points by a number and draws its isolines; points without a finite one stay
    /// grey.
    pub fn show_levels(&mut self, levels: Levels) {
        self.colours = Colours::PerPoint(level_colours(&levels.values));
        self.levels = Some(levels);
    }

    /// Radius of the disc of point `index`, in scene units.
    pub(crate) fn radius(&self, index: usize) -> f64 {
        match &self.radii {
            Radii::Uniform(radius) => *radius,
            Radii::PerPoint(radii) => radii[index],
        }
    }

    /// Colour of point `index`.
    pub(crate) fn colour(&self, index: usize) -> [u8; 3] {
        match &self.colours {
            Colours::Uniform(colour) => *colour,
            Colours::PerPoint(colours) => colours[index],
        }
    }

    /// Unit normal of point `index`, where it has one.
    pub(crate) fn normal(&self, index: usize) -> Option<[f64; 3]> {
        unit(self.normals.as_ref()?[index])
    }

    /// Indices of the points that can be drawn.
    pub(crate) fn finite_points(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.points.len()).filter(|&index| is_finite(self.points[index]))
    }

    /// Checks what every other function of this crate relies on.
    pub(crate) fn check(&self) -> Result<(), DrawError> {
        let expected = self.points.len();
        if let Some(normals) = &self.normals {
            expect_count("normals", normals.len(), expected)?;
        }
        if let Some(levels) = &self.levels {
            expect_count("levels", levels.values.len(), expected)?;
            expect_count("gradients of levels", levels.gradients.len(), expected)?;
        }
        if let Colours::PerPoint(colours) = &self.colours {
            expect_count("colours", colours.len(), expected)?;
        }
        if let Radii::PerPoint(radii) = &self.radii {
            expect_count("radii", radii.len(), expected)?;
        }
        let mut points = self.finite_points().peekable();
        if points.peek().is_none() {
            return Err(DrawError::Empty { points: expected });
        }
        match points.find(|&index| !(self.radius(index) > 0.0 && self.radius(index).is_finite())) {
            Some(index) => Err(DrawError::Radius {
                index,
                radius: self.radius(index),
            }),
            None => Ok(()),
        }
    }
}

fn expect_count(attribute: &'static str, found: usize, expected: usize) -> Result<(), DrawError> {
    if found == expected {
        return Ok(());
    }
    Err(DrawError::Count {
        attribute,
        found,
        expected,
    })
}

pub(crate) fn is_finite(point: [f64; 3]) -> bool {
    point.iter().all(|coordinate| coordinate.is_finite())
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn subtract(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `vector` at length 1; `None` for zero or non-finite vectors.
pub(crate) fn unit(vector: [f64; 3]) -> Option<[f64; 3]> {
    let largest = vector.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
    if !(is_finite(vector) && largest > 0.0) {
        return None;
    }
    let scaled = vector.map(|c| c / largest);
    let length = dot(scaled, scaled).sqrt();
    Some(scaled.map(|c| c / length))
}
