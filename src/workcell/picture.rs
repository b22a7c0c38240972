//! Pictures of the twin: what the aligned camera would see if the twin were all there is.

use std::path::{Path, PathBuf};

use image::RgbImage;

use crate::twin::Twin;
use crate::twin::render::{self, ArmLook, Options, View};
use crate::world::Camera;

/// How files of pictures end.
pub(super) const ENDING: &str = "jpg";

/// Returns the name, without ending, of the picture after step `number`: `03-after-real`.
pub fn after(number: usize, whose: &str) -> String {
    format!("{number:02}-after-{whose}")
}

/// Returns the name, without ending, of the picture before step `number`: `03-before-real`.
pub fn before(number: usize, whose: &str) -> String {
    format!("{number:02}-before-{whose}")
}

/// Returns the file of a picture of a run folder by its name without ending. Runs of earlier versions have PNG files.
pub fn file(run: &Path, name: &str) -> PathBuf {
    let at = |ending: &str| run.join("frames").join(format!("{name}.{ending}"));
    let earlier = at("png");
    if earlier.is_file() { earlier } else { at(ENDING) }
}

/// Returns what there is to draw of a twin now.
pub fn view(twin: &Twin, look: &ArmLook) -> View {
    View::of(twin.scene(), &twin.state(), look, &twin.link_poses())
        .with_water(&twin.water(), twin.fluid().radius())
}

/// Draws a view through a camera, small enough to keep a whole run of them.
pub fn draw(camera: &Camera, view: &View) -> RgbImage {
    render::picture(camera, view, &Options { edge_samples: 4, ..Options::default() })
}

/// Draws a view through a small camera, quickly: for the film.
pub(super) fn draw_small(camera: &Camera, view: &View) -> RgbImage {
    render::picture(camera, view, &Options::film())
}
