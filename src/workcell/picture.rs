//! Pictures of the twin: what the aligned camera would see if the twin were all there is.

use image::RgbImage;

use crate::twin::Twin;
use crate::twin::render::{ArmLook, Options, View, render};
use crate::world::Camera;

/// Returns the name, without ending, of the picture after step `number`: `03-after-real`.
pub fn after(number: usize, whose: &str) -> String {
    format!("{number:02}-after-{whose}")
}

/// Returns the name, without ending, of the picture before step `number`: `03-before-real`.
pub fn before(number: usize, whose: &str) -> String {
    format!("{number:02}-before-{whose}")
}

/// Returns what there is to draw of a twin now.
pub fn view(twin: &Twin, look: &ArmLook) -> View {
    View::of(twin.scene(), &twin.state(), look, &twin.link_poses())
        .with_water(&twin.water(), twin.fluid().radius())
}

/// Draws a view through a camera, small enough to keep a whole run of them.
pub fn draw(camera: &Camera, view: &View) -> RgbImage {
    render(camera, view, &Options { edge_samples: 4, shadows: true }).colour
}
