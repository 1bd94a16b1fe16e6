//! Pictures of point clouds with paths over them, drawn in software: no GPU, no display.
//!
//! Points become overlapping oriented discs (surface splatting: Botsch, Hornung, Zwicker,
//! Kobbelt, "High-quality surface splatting on today's GPUs", 2005): a first pass finds the front
//! of the surface, a second blends colours and normals of all discs that lie on it. Light comes
//! from the camera and from the upper left; creases and gaps between layers are darkened (ambient
//! occlusion in screen space). A path lies over the surface as a smooth line; where it runs
//! behind the surface it is dashed, thinner and paler.
//!
//! The same scene gives the same bytes on any number of threads.
//!
//! ```
//! use taut_draw::{Camera, Scene, Style, render};
//!
//! # fn main() -> Result<(), taut_draw::DrawError> {
//! let helix = |t: f64| [t.cos(), t.sin(), 0.1 * t];
//! let points = (0..5000).map(|i| helix(f64::from(i) * 0.01)).collect();
//! let mut scene = Scene::new(points)?;
//! scene.add_path((0..100).map(|i| helix(f64::from(i) * 0.1)).collect());
//! scene.caption = Some("length 9.95".to_owned());
//! let camera = Camera::automatic(&scene, [0.0, 0.0, 1.0], 320, 240)?;
//! let image = render(&scene, &camera, &Style::default())?;
//! assert_eq!((image.width(), image.height()), (320, 240));
//! # Ok(())
//! # }
//! ```

mod camera;
mod canvas;
mod error;
mod image;
mod label;
mod line;
mod neighbours;
mod projection;
mod scene;
mod shade;
mod splat;
mod viewpoint;

pub use camera::Camera;
pub use error::DrawError;
pub use image::Image;
pub use label::round_length;
pub use projection::Projection;
pub use scene::{Colours, Levels, Marker, PALETTE, Radii, Scene, ScenePath, level_colours};
pub use shade::Style;

/// Draws `scene` as `camera` sees it.
///
/// The picture has the size that the camera was made for. Rows of points with a non-finite
/// coordinate are left out, and so are the nodes of a path that have one.
///
/// # Errors
///
/// [`DrawError::Empty`] where no point is finite, [`DrawError::Count`] where normals, colours or
/// radii are not as many as the points, [`DrawError::Radius`] where a disc has no positive radius.
///
/// # Complexity
///
/// O(points x pixels of a disc + pixels x samples a pixel), and about 24 bytes a sample.
pub fn render(scene: &Scene, camera: &Camera, style: &Style) -> Result<Image, DrawError> {
    scene.check()?;
    let surface = splat::splat(scene, camera, style.samples());
    let mut canvas = shade::shade(&surface, style);
    line::draw_paths(&mut canvas, scene, camera, &surface, style);
    label::draw_footer(&mut canvas, scene, camera);
    Ok(canvas.into_image())
}
