//! Seeing on real photographs: finds the `ViSP` cube and tube, and prepares `trueup camera see` for them.
//!
//! `cargo run --example camera_see -- OUT` reads the sequence in place, writes to OUT the scene
//! (`visp.task`), a calibration per frame (`calibration_0000.json`: the table is the sheet the solids stand
//! on, which is lifted a little on the way), and a picture of what was seen; it prints the distance to the
//! reference. Then: `trueup camera see image0080.png --scene OUT/visp.task
//! --calibration OUT/calibration_0080.json`.
#![expect(clippy::print_stdout, reason = "an example talks to a person")]
#![expect(clippy::unwrap_used, reason = "an example that cannot go on may say so by panicking")]

use std::path::PathBuf;

use trueup::alignment::vision::{Options, annotate, see};

#[path = "../tests/alignment_vision/visp.rs"]
mod visp;

/// The scene in the task language; the camera is a guess that the calibration replaces.
const SCENE: &str = "\
/// A printed cube and a grey tube, taller than the picture, on a sheet of paper on a desk.
scene visp {
    table: Surface = box(80 cm, 80 cm, 2 cm) at (0 m, 0.10 m) { colour \"#aaaaaa\" }
    cube:  Block   = cuboid(84 mm, 84 mm, 84 mm) { mass 200 g  looks \"printed cube\"  colour \"#808080\" }
    tube:  Block   = cylinder(radius 40 mm, height 350 mm) { mass 200 g  looks \"grey tube\"  colour \"#808080\" }
    camera still { image 640 x 480  focal ~ 545 px  at (0 m, -0.40 m, 0.43 m) looking (0 m, 0 m, 0 m) }
    robot gen3_2f85 at (0 m, 0 m, 0 m)
}
";

fn main() {
    let Some(folder) = visp::folder() else {
        println!("skipped: shared/data/public/visp_cube_cylinder is not here");
        return;
    };
    let out = std::env::args().nth(1).map(PathBuf::from);
    if let Some(out) = &out {
        std::fs::create_dir_all(out).unwrap();
        std::fs::write(out.join("visp.task"), SCENE).unwrap();
    }
    // One frame without an output folder, so that the tests can run this example quickly.
    let last = if out.is_some() { 200 } else { 0 };
    for frame in (0..=last).step_by(20) {
        let visp = visp::Visp::read(&folder, Some(frame));
        let image = visp.image(frame);
        let seen = see(&image, &visp.camera, &visp.scene, &Options::default()).unwrap();
        let (cube, axis) = visp.truth(frame);
        for (s, truth) in seen.iter().zip([cube.origin(), axis]) {
            match s.world_from_object {
                Some(pose) => println!(
                    "frame {frame:3} {}: {:.1} mm from the reference, std {:.1} mm, confidence {:.2}",
                    s.name,
                    1e3 * (pose.origin() - truth).xy().norm(),
                    1e3 * s.std,
                    s.confidence
                ),
                None => {
                    println!("frame {frame:3} {}: {}", s.name, s.reason.as_deref().unwrap_or("?"));
                }
            }
        }
        if let Some(out) = &out {
            let calibration = serde_json::json!({ "camera": visp.camera });
            let text = serde_json::to_string_pretty(&calibration).unwrap();
            std::fs::write(out.join(format!("calibration_{frame:04}.json")), text).unwrap();
            annotate(&image, &seen).save(out.join(format!("seen_{frame:04}.png"))).unwrap();
        }
    }
    let visp = visp::Visp::read(&folder, None);
    let (cube, axis) = visp.published();
    let seen = see(&visp.image(0), &visp.camera, &visp.scene, &Options::default()).unwrap();
    for (s, truth) in seen.iter().zip([cube.origin(), axis]) {
        let far = s.world_from_object.map(|pose| 1e3 * (pose.origin() - truth).xy().norm());
        println!("frame   0 {}: {far:.1?} mm from the published pose", s.name);
    }
    if let Some(out) = &out {
        println!("scene and calibrations of {} are in {}", visp.folder.display(), out.display());
    }
}
