//! `trueup camera`: find objects in a picture.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use image::RgbImage;
use serde::Deserialize;

use crate::alignment::decode;
use crate::alignment::vision::{self, Options};
use crate::execution::calibrate::{self, Switches};
use crate::files::write;
use crate::language::{self, Source};
use crate::report::{self, Failure, Style};
use crate::workcell;
use crate::world::{Camera, Scene};

use super::answer::see::Answer;
use super::inputs::read;
use crate::report::exit::Exit;

#[derive(Debug, Subcommand)]
pub(super) enum CameraCommand {
    /// Find the scene's objects in a picture: mask, key points, pose, confidence.
    See(SeeArgs),
}

#[derive(Debug, Args)]
pub(super) struct SeeArgs {
    /// The picture (PNG or JPEG).
    image: PathBuf,
    /// The camera as calibrated: `{"camera": {"intrinsics": .., "world_from_camera": ..}}`. Without it the
    /// camera is aligned by the scene's marks in the picture, if they are seen.
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Where masks and an annotated copy of the picture go.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// The part of a calibration file that seeing needs.
#[derive(Debug, Deserialize)]
struct CalibrationFile {
    camera: Camera,
}

/// Aligns the scene's camera by the table's dots where there are enough of them; says so where not.
fn aligned(image: &RgbImage, scene: &Scene, style: Style) -> Camera {
    match calibrate::from_marks(image, scene, Switches::default()) {
        Ok((camera, notes)) => {
            for note in notes {
                style.note(&format!("  {note}"));
            }
            camera
        }
        Err(error) => {
            style.note(&format!(
                "warning: the scene's guess of the camera is believed, and places may be centimetres \
                 off: {error}"
            ));
            scene.camera
        }
    }
}

/// Reads a picture, with an error that says which and why.
pub(super) fn picture(path: &Path) -> Result<RgbImage, Failure> {
    decode::read(path).map_err(|error| {
        let place = path.display().to_string();
        Failure::input("io::image", format!("cannot read the picture {place}: {error}"))
            .at(place)
            .help("PNG and JPEG pictures can be read")
    })
}

/// `trueup camera ...`.
pub(super) fn camera(
    command: &CameraCommand,
    scene: Option<&PathBuf>,
    style: Style,
) -> Result<Exit, Failure> {
    let CameraCommand::See(args) = command;
    let library = workcell::library(&workcell::Stdlib::embedded());
    let scene = match scene {
        None => workcell::scene_of(&library, None),
        Some(path) => {
            let source = Source::new(path.display().to_string(), read(path)?);
            let (_, diagnostics) = language::parse(&source.text);
            if diagnostics.iter().any(language::Diagnostic::is_error) {
                return Err(report::text_failure(&diagnostics, &source, style));
            }
            let mut library = library;
            let file = library.add(source);
            workcell::scene_of(&library, Some(file))
        }
    };
    let scene = scene.map_err(|error| report::cell_failure(&error, style))?;
    let place = args.image.display().to_string();
    let image = picture(&args.image)?;
    let sensor = (scene.camera.intrinsics.width, scene.camera.intrinsics.height);
    let camera = match &args.calibration {
        // A picture of another size is refused below, in one message.
        None if image.dimensions() != sensor => scene.camera,
        None => aligned(&image, &scene, style),
        Some(path) => {
            let place = path.display().to_string();
            serde_json::from_str::<CalibrationFile>(&read(path)?)
                .map_err(|error| {
                    Failure::input("camera::calibration", format!("not a calibration: {error}"))
                        .at(place)
                        .help("it holds {\"camera\": {\"intrinsics\": .., \"world_from_camera\": ..}}")
                })?
                .camera
        }
    };
    let sightings = vision::see(&image, &camera, &scene, &Options::default())
        .map_err(|error| Failure::input("camera::picture", error.to_string()).at(&place))?;
    if let Some(dir) = &args.out {
        std::fs::create_dir_all(dir).map_err(unwritten(dir))?;
        for sighting in &sightings {
            if let Some(mask) = &sighting.mask {
                let path = dir.join(format!("{}-mask.png", sighting.name));
                write::picture(&path, mask).map_err(unwritten(&path))?;
            }
        }
        let path = dir.join("seen.png");
        write::picture(&path, &vision::annotate(&image, &sightings)).map_err(unwritten(&path))?;
    }
    if style.json {
        style.document(&Answer::new(&sightings, |sighting| {
            let dir = args.out.as_ref()?;
            sighting.mask.as_ref()?;
            Some(dir.join(format!("{}-mask.png", sighting.name)).display().to_string())
        }));
    } else {
        for sighting in &sightings {
            style.say(report::sighting(sighting));
        }
    }
    let all = sightings.iter().all(|sighting| sighting.found);
    Ok(if all { Exit::Yes } else { Exit::No })
}

fn unwritten(path: &Path) -> impl Fn(std::io::Error) -> Failure {
    move |error| Failure::unwritten(path, &error)
}
