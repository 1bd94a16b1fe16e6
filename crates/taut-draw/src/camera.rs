//! Where the picture is taken from.

use crate::error::DrawError;
use crate::label;
use crate::scene::{Scene, dot, is_finite, subtract, unit};
use crate::viewpoint;

/// Share of the picture's smaller side left free on each side.
const MARGIN: f64 = 0.035;

/// An orthographic camera: lengths across the line of sight are to scale everywhere.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// The scene point in the middle of the free part of the picture.
    centre: [f64; 3],
    view: View,
    pixels_per_unit: f64,
    /// Where `centre` lies in the picture, in pixels.
    middle: [f64; 2],
    width: u32,
    height: u32,
}

/// Three orthonormal directions of the picture, in the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct View {
    pub right: [f64; 3],
    pub down: [f64; 3],
    /// From the scene to the viewer.
    pub toward: [f64; 3],
}

impl View {
    /// Looking from `from` at the scene, with `up` upwards; another direction goes up where the
    /// two are parallel.
    pub(crate) fn new(from: [f64; 3], up: [f64; 3]) -> Result<Self, DrawError> {
        let toward = direction("view", from)?;
        let up = direction("up", up)?;
        let mut others = [[0.0; 3]; 3];
        for axis in 0..3 {
            others[axis][axis] = 1.0;
        }
        let candidates = [up, others[1], others[2], others[0]];
        let right = candidates
            .iter()
            .map(|&candidate| cross(candidate, toward))
            .find(|across| dot(*across, *across) > 1e-6)
            .and_then(unit)
            .ok_or(DrawError::Direction {
                name: "up",
                direction: up,
            })?;
        Ok(Self {
            right,
            down: cross(right, toward),
            toward,
        })
    }

    /// Components to the right, downwards and toward the viewer.
    pub(crate) fn turn(&self, vector: [f64; 3]) -> [f64; 3] {
        [
            dot(vector, self.right),
            dot(vector, self.down),
            dot(vector, self.toward),
        ]
    }
}

impl Camera {
    /// A camera that looks from `direction` (from the scene to the viewer; its length does not
    /// matter) and sees all points and paths as large as the picture allows. Space is left for
    /// the scale bar and the caption if the scene has one by now.
    ///
    /// # Errors
    ///
    /// [`DrawError::Size`], [`DrawError::Direction`], and those of [`crate::render`].
    pub fn fit(
        scene: &Scene,
        direction: [f64; 3],
        up: [f64; 3],
        width: u32,
        height: u32,
    ) -> Result<Self, DrawError> {
        let sides = 16..=16384;
        if !(sides.contains(&width) && sides.contains(&height)) {
            return Err(DrawError::Size { width, height });
        }
        scene.check()?;
        let view = View::new(direction, up)?;
        let frame = Frame::new(scene, &view);
        let margin = MARGIN * f64::from(width.min(height));
        let footer = label::footer_height(scene, height as usize);
        let free = [
            f64::from(width) - 2.0 * margin,
            f64::from(height) - 2.0 * margin - footer,
        ];
        let scales = [0, 1].map(|axis| free[axis].max(1.0) / (frame.high[axis] - frame.low[axis]));
        let middle = [f64::from(width) / 2.0, (f64::from(height) - footer) / 2.0];
        Ok(Self {
            centre: frame.centre(&view),
            view,
            pixels_per_unit: scales[0].min(scales[1]),
            middle,
            width,
            height,
        })
    }

    /// A camera whose direction is chosen among several dozen: the paths are in front of the
    /// points and seen broadside as far as possible; without paths, much of the cloud is seen.
    ///
    /// # Errors
    ///
    /// As [`Camera::fit`].
    pub fn automatic(
        scene: &Scene,
        up: [f64; 3],
        width: u32,
        height: u32,
    ) -> Result<Self, DrawError> {
        scene.check()?;
        let direction = viewpoint::best_direction(scene, up)?;
        Self::fit(scene, direction, up, width, height)
    }

    /// The direction from the scene to the viewer, of length 1.
    #[must_use]
    pub fn direction(&self) -> [f64; 3] {
        self.view.toward
    }

    /// Pixels that a length of 1 across the line of sight takes.
    #[must_use]
    pub fn pixels_per_unit(&self) -> f64 {
        self.pixels_per_unit
    }

    /// Place of a scene point in the picture, all three in pixels: to the right and down from the
    /// upper left corner, and the depth away from the viewer.
    #[must_use]
    pub fn project(&self, point: [f64; 3]) -> [f64; 3] {
        let [x, y, toward] = self.view.turn(subtract(point, self.centre));
        [
            self.middle[0] + x * self.pixels_per_unit,
            self.middle[1] + y * self.pixels_per_unit,
            -toward * self.pixels_per_unit,
        ]
    }

    pub(crate) fn view(&self) -> &View {
        &self.view
    }

    pub(crate) fn width(&self) -> usize {
        self.width as usize
    }

    pub(crate) fn height(&self) -> usize {
        self.height as usize
    }
}

/// The box of a scene in a view's directions, relative to a point of the scene.
struct Frame {
    origin: [f64; 3],
    low: [f64; 3],
    high: [f64; 3],
}

impl Frame {
    fn new(scene: &Scene, view: &View) -> Self {
        let discs = scene
            .finite_points()
            .map(|index| (scene.points[index], scene.radius(index)));
        let lines = scene.paths.iter().flat_map(|path| &path.points);
        let dots = scene.markers.iter().map(|marker| &marker.position);
        let places = lines.chain(dots).filter(|point| is_finite(**point));
        let mut origin = None;
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for (point, radius) in discs.chain(places.map(|&point| (point, 0.0))) {
            let place = view.turn(subtract(point, *origin.get_or_insert(point)));
            for axis in 0..3 {
                low[axis] = low[axis].min(place[axis] - radius);
                high[axis] = high[axis].max(place[axis] + radius);
            }
        }
        Self {
            origin: origin.unwrap_or_default(),
            low,
            high,
        }
    }

    /// The middle of the box, in the scene.
    fn centre(&self, view: &View) -> [f64; 3] {
        let half: [f64; 3] = std::array::from_fn(|axis| (self.low[axis] + self.high[axis]) / 2.0);
        std::array::from_fn(|c| {
            self.origin[c]
                + half[0] * view.right[c]
                + half[1] * view.down[c]
                + half[2] * view.toward[c]
        })
    }
}

fn direction(name: &'static str, direction: [f64; 3]) -> Result<[f64; 3], DrawError> {
    unit(direction).ok_or(DrawError::Direction { name, direction })
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_view_is_right_handed_with_up_upwards() {
        let view = View::new([0.0, -3.0, 0.0], [0.0, 0.0, 2.0]).unwrap();
        assert_eq!(view.right, [1.0, 0.0, 0.0]);
        assert_eq!(view.down, [0.0, 0.0, -1.0]);
        assert_eq!(view.toward, [0.0, -1.0, 0.0]);
    }

    #[test]
    fn the_view_along_up_is_possible() {
        let view = View::new([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]).unwrap();
        assert_eq!(view.down, [0.0, -1.0, 0.0]);
    }

    #[test]
    fn far_scenes_are_centred() {
        let points = vec![[5e6, 5e6, 10.0], [5e6 + 2.0, 5e6, 11.0]];
        let scene = Scene::new(points).unwrap();
        let camera = Camera::fit(&scene, [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], 200, 100).unwrap();
        let [x, y, _] = camera.project([5e6 + 1.0, 5e6, 10.5]);
        assert!((x - 100.0).abs() < 1e-6, "{x}");
        assert!(y < 50.0, "the footer takes room below: {y}");
    }
}
