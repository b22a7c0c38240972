//! Pictures of the twin: what the aligned camera would see if the twin were all there is.

use image::RgbImage;

use crate::twin::Twin;
use crate::twin::render::{ArmLook, Options, View, render};
use crate::world::{Camera, Scene, WorldState};

/// Returns what there is to draw of a twin now.
pub fn view(twin: &Twin, look: &ArmLook) -> View {
    let links: Vec<_> =
        twin.link_poses().into_iter().map(|(name, pose)| (name.to_owned(), pose)).collect();
    let water: Vec<[f32; 3]> = twin.water().iter().map(|p| [p.x, p.y, p.z]).collect();
    View::of(twin.scene(), &twin.state(), look, &links)
        .with_water(&water, twin.fluid().radius())
}

/// Draws a view through a camera, small enough to keep a whole run of them.
pub fn draw(camera: &Camera, view: &View) -> RgbImage {
    render(camera, view, &Options { edge_samples: 4, shadows: true }).colour
}
