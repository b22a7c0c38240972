//! `trueup camera`: find objects in a picture; cut things out of one; calibrate a camera from pictures of a board.

pub(in crate::cli) mod calibrate;
mod masks;
mod segment;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::alignment::camera_fit::Priors;
use crate::alignment::decode;
use crate::alignment::vision::{self, Options, Sighting};
use crate::execution::calibrate::{self as marks, Switches};
use crate::files::write;
use crate::masks::Where;
use crate::report::{self, Failure, Style};
use crate::world::camera_file::{self, CameraFile};
use crate::world::{Camera, Scene};
use clap::{Args, Subcommand};
use image::{GrayImage, RgbImage};

use super::answer::see::Answer;
use super::inputs::{read, scene};
use crate::report::exit::Exit;
use masks::{Asked, MasksArgs};

#[derive(Debug, Subcommand)]
pub(super) enum CameraCommand {
    /// Find the scene's objects in a picture: mask, key points, pose, confidence.
    See(SeeArgs),
    /// Find what is inside a camera from pictures of a board: focal lengths, centre, lens.
    Calibrate(calibrate::CalibrateArgs),
    /// Cut a thing out of a picture, from a box, a point or a rough mask: its mask and contour, without a pose.
    Segment(segment::SegmentArgs),
}

#[derive(Debug, Args)]
pub(super) struct SeeArgs {
    /// The picture (PNG or JPEG).
    image: PathBuf,
    /// The camera as calibrated: what `camera calibrate --write` or `align intrinsics --json` gives, or
    /// `{"camera": {"intrinsics": .., "world_from_camera": ..}}`. What it does not tell, the scene's marks in the picture
    /// do, if they are seen.
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Where masks and an annotated copy of the picture go.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    masks: MasksArgs,
}

/// The camera that took a picture.
pub(super) struct Taken {
    /// Where it stands, and what is inside.
    pub(super) camera: Camera,
    /// How far it may be off where the scene's guess of it had to be believed.
    pub(super) guess: Option<Priors>,
}

/// How far a scene's guess of the camera may be off; a calibration knows what is inside.
fn guessed(scene: &Scene) -> Taken {
    let by_eye = Priors::by_eye();
    let known = Priors { focal: 0.0, principal: 0.0, ..by_eye };
    let guess = if scene.calibration.is_some() { known } else { by_eye };
    Taken { camera: scene.camera, guess: Some(guess) }
}

/// Aligns the scene's camera by the table's dots where there are enough of them; says so where not.
fn aligned(image: &RgbImage, scene: &Scene, style: Style) -> Taken {
    match marks::from_marks(image, scene, Switches::default()) {
        Ok(found) => {
            for note in found.notes {
                style.note(&format!("  {note}"));
            }
            Taken { camera: found.camera, guess: None }
        }
        Err(error) => {
            style.note(&format!(
                "warning: the scene's guess of the camera is believed, and places may be centimetres \
                 off: {error}"
            ));
            guessed(scene)
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
    match command {
        CameraCommand::See(args) => see(args, scene, style),
        CameraCommand::Calibrate(args) => calibrate::calibrate(args, style),
        CameraCommand::Segment(args) => segment::segment_picture(args, style),
    }
}

/// The camera that took the picture: as calibrated, as far as a file says, the rest by the scene's marks.
pub(super) fn calibrated(
    file: Option<&Path>,
    image: &RgbImage,
    mut scene: Scene,
    style: Style,
) -> Result<Taken, Failure> {
    if let Some(path) = file {
        let CameraFile { mut intrinsics, world_from_camera } = calibration(path)?;
        if (intrinsics.width, intrinsics.height) == (0, 0) {
            (intrinsics.width, intrinsics.height) = image.dimensions();
        }
        if let Some(world_from_camera) = world_from_camera {
            let camera = Camera { intrinsics, world_from_camera };
            return Ok(Taken { camera, guess: None });
        }
        // The file knows what is inside better than one picture of the table does.
        scene.camera.intrinsics = intrinsics;
        scene.calibration = Some(path.display().to_string());
    }
    let sensor = (scene.camera.intrinsics.width, scene.camera.intrinsics.height);
    // A picture of another size is refused where it is looked at, in one message.
    if image.dimensions() != sensor {
        return Ok(guessed(&scene));
    }
    Ok(aligned(image, &scene, style))
}

/// Reads a calibrated camera, with an error that says what is wrong with the file.
pub(super) fn calibration(path: &Path) -> Result<CameraFile, Failure> {
    camera_file::read(&read(path)?).map_err(|error| {
        Failure::input("camera::calibration", format!("not a calibration: {error}"))
            .at(path.display().to_string())
            .help(
                "`camera calibrate --write FILE` makes one; by hand it is \
                 {\"camera\": {\"intrinsics\": .., \"world_from_camera\": ..}}",
            )
    })
}

fn see(args: &SeeArgs, scene: Option<&PathBuf>, style: Style) -> Result<Exit, Failure> {
    let scene = self::scene(scene.map(PathBuf::as_path), style)?;
    let place = args.image.display().to_string();
    let image = picture(&args.image)?;
    let others = masks::opened(&args.masks, style)?;
    let Taken { camera, .. } =
        calibrated(args.calibration.as_deref(), &image, scene.clone(), style)?;
    let look =
        vision::Look::new(&image, &camera, &scene).map_err(|error| unused(&error).at(&place))?;
    note_colour(&look, style);
    let mut sightings = look.see(&Options::default());
    if let Some(others) = &others {
        let masks = offered(others, &image, &sightings)?;
        if !masks.is_empty() {
            sightings = look.see(&Options { masks, ..Options::default() });
        }
    }
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
        style.document(&Answer::new(&sightings, others.is_some(), |sighting| {
            let dir = args.out.as_ref()?;
            sighting.mask.as_ref()?;
            Some(dir.join(format!("{}-mask.png", sighting.name)).display().to_string())
        }));
    } else {
        for sighting in &sightings {
            style.say(report::sighting(sighting));
            if let Some(others) = &others {
                style.say(report::whose_mask(sighting, &others.name));
            }
        }
    }
    let all = sightings.iter().all(|sighting| sighting.found);
    Ok(if all { Exit::Yes } else { Exit::No })
}

/// Says of a picture without colour that it has none.
pub(super) fn note_colour(look: &vision::Look<'_>, style: Style) {
    if !look.has_colour() {
        style.note(vision::NO_COLOUR);
    }
}

/// Tells of a picture that cannot be used.
pub(super) fn unused(error: &vision::Error) -> Failure {
    let failure = Failure::input("camera::picture", error.to_string());
    if matches!(error, vision::Error::WrongSize { .. }) {
        return failure.help(
            "name the camera that took it: `--calibration FILE`, or its scene: `--scene FILE.task`; without these it is the kitchen's",
        );
    }
    failure
}

/// How much larger a box is that somebody else is given than what was seen in it, on each side as a share: as one drawn by hand.
const ROOM: f64 = 0.15;

/// Asks somebody else for masks of the things, each where it was seen or would most probably be.
fn offered(
    others: &Asked,
    image: &RgbImage,
    sightings: &[Sighting],
) -> Result<BTreeMap<String, Vec<GrayImage>>, Failure> {
    let (w, h) = (f64::from(image.width()) - 1.0, f64::from(image.height()) - 1.0);
    let place = |seen: &Sighting| {
        let [u0, v0, u1, v1] = seen.bbox;
        let (du, dv) = (ROOM * (u1 - u0), ROOM * (v1 - v0));
        let bounds = [(u0 - du).max(0.0), (v0 - dv).max(0.0), (u1 + du).min(w), (v1 + dv).min(h)];
        // What is nowhere has no box.
        (bounds[2] - bounds[0] > 1.0 && bounds[3] - bounds[1] > 1.0)
            .then(|| (seen.name.clone(), Where::Box(bounds)))
    };
    let (names, places): (Vec<String>, Vec<Where>) = sightings.iter().filter_map(place).unzip();
    let mut masks: BTreeMap<String, Vec<GrayImage>> = BTreeMap::new();
    if places.is_empty() {
        return Ok(masks);
    }
    for found in others.ask(image, &places)? {
        let name = found.of.and_then(|of| names.get(of));
        if let Some(name) = name.filter(|_| found.mask.pixels().any(|pixel| pixel.0[0] > 0)) {
            masks.entry(name.clone()).or_default().push(found.mask);
        }
    }
    Ok(masks)
}

fn unwritten(path: &Path) -> impl Fn(std::io::Error) -> Failure {
    move |error| Failure::unwritten(path, &error)
}
