//! `trueup scene from PHOTO`: what stands on the table, measured and written down as a scene to edit.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use image::RgbImage;

use crate::alignment::camera_fit::Priors;
use crate::alignment::measure::Measured;
use crate::alignment::outline::{Outline, Projector};
use crate::alignment::overlay;
use crate::alignment::vision::{self, Options, Sighting};
use crate::files::write;
use crate::report::exit::Exit;
use crate::report::{self, Failure, Style};
use crate::scene::SOLID_DENSITY;
use crate::scene::write::to_text;
use crate::world::colour::colour_word;
use crate::world::{Camera, Material, Object, Scene, Shape};

use super::camera::{Taken, calibrated, note_colour, picture, unused};
use super::inputs;

#[derive(Debug, Subcommand)]
pub(super) enum SceneCommand {
    /// Write the scene that a photograph shows: what stands on the table is measured.
    From(FromArgs),
}

#[derive(Debug, Args)]
pub(super) struct FromArgs {
    /// The photograph (PNG or JPEG). Table, printed dots, camera and robot are those of `--scene`; of its things those that
    /// are seen stay as declared, all others are measured.
    image: PathBuf,
    /// The camera as calibrated, as for `camera see`.
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// The scene file to write; its name is the scene's.
    #[arg(long, value_name = "FILE", default_value = "photographed.task")]
    out: PathBuf,
    /// A copy of the photograph with what was measured drawn over it.
    #[arg(long, value_name = "FILE")]
    drawn: Option<PathBuf>,
}

/// So probable a thing of the scene must be to stay as declared: what `docs/seeing.md` calls sure.
const SURE: f64 = 0.9;

/// `trueup scene ...`.
pub(super) fn scene(
    command: &SceneCommand,
    base: Option<&PathBuf>,
    style: Style,
) -> Result<Exit, Failure> {
    let SceneCommand::From(args) = command;
    from(args, base.map(PathBuf::as_path), style)
}

fn from(args: &FromArgs, base: Option<&Path>, style: Style) -> Result<Exit, Failure> {
    let folder = base.and_then(Path::parent).unwrap_or(Path::new(""));
    let mut base = inputs::scene(base, style)?;
    let named = base.calibration.take().map(|file| folder.join(file));
    base.calibration = args.calibration.clone().or(named).map(|file| beside(&args.out, &file));
    let name = name_of(&args.out)?;
    if args.out.exists() {
        return Err(Failure::there(&args.out));
    }
    let image = picture(&args.image)?;
    let Taken { camera, guess } =
        calibrated(args.calibration.as_deref(), &image, base.clone(), style)?;
    let wrong = |error: vision::Error| unused(&error).at(args.image.display().to_string());
    let look = vision::Look::new(&image, &camera, &base).map_err(wrong)?;
    note_colour(&look, style);
    let mut seen = look.see(&Options::default());
    seen.retain(|sighting| sighting.found && sighting.confidence >= SURE);
    let (mut things, mut missed, mut boxes) = (Vec::new(), Vec::new(), Vec::new());
    for region in look.unexplained_regions(&seen, &Options::default()) {
        match look.measured_in(region.in_picture) {
            Ok(found) => things.push(match guess {
                Some(guess) => doubted(found, &guess, &camera),
                None => found,
            }),
            Err(why) => {
                missed.push((region.bound.at, why));
                boxes.push(region.in_picture);
            }
        }
    }
    // From left to right, as a person would count them.
    things
        .sort_by(|a, b| b.world_from_object.origin().y.total_cmp(&a.world_from_object.origin().y));
    let (scene, comments) = described(&base, &name, &camera, &seen, &things);
    let mut doc = format!("What stood on the table of `{}` in a photograph.", base.name);
    if guess.is_some() {
        doc += " The camera could not be aligned: where it stands is a guess, places and sizes may be centimetres off.";
    }
    let text = to_text(&scene, &doc, &comments);
    write::replace(&args.out, &text).map_err(|error| Failure::unwritten(&args.out, &error))?;
    if let Some(path) = &args.drawn {
        let mut drawn = drawn(&image, &camera, &seen, &things);
        for held in boxes {
            overlay::unmeasured(&mut drawn, held);
        }
        write::picture(path, &drawn).map_err(|error| Failure::unwritten(path, &error))?;
    }
    let names: Vec<&str> = scene.objects.iter().map(|o| o.name.as_str()).skip(seen.len()).collect();
    let measured: Vec<(&str, &Measured)> = names.into_iter().zip(&things).collect();
    if style.json {
        style.document(&super::answer::measured::Answer::new(&args.out, &seen, &measured, &missed));
    } else {
        style.say(report::measured(&seen, &measured, &missed));
        style.say(format!("{} is written; edit it, then `trueup --scene {0}`", args.out.display()));
    }
    let is_answered = guess.is_none() && !scene.objects.is_empty() && missed.is_empty();
    Ok(if is_answered { Exit::Yes } else { Exit::No })
}

/// A thing measured with a camera that is only guessed: its place and sizes are as uncertain as that makes them.
fn doubted(mut thing: Measured, guess: &Priors, camera: &Camera) -> Measured {
    let spread = guess.on_table(camera, thing.world_from_object.origin().xy());
    let sizes = match &thing.shape {
        Shape::Cuboid { size } => [size.x, size.y, size.z],
        // Only boxes and cans are measured.
        round => [round.outer_radius(), round.outer_radius(), round.height()],
    };
    thing.std = thing.std.hypot(spread.place);
    for (std, size) in thing.size_std.iter_mut().zip(sizes) {
        *std = std.hypot(spread.length * size);
    }
    thing
}

/// How a scene that is written to `out` names a file.
fn beside(out: &Path, file: &Path) -> String {
    let folder = |path: &Path| path.parent().map(Path::to_path_buf).unwrap_or_default();
    let name = file.file_name().map(Path::new).filter(|_| folder(out) == folder(file));
    let whole = || std::path::absolute(file).unwrap_or_else(|_| file.to_path_buf());
    name.map_or_else(whole, Path::to_path_buf).display().to_string()
}

/// The scene's name: that of its file.
fn name_of(path: &Path) -> Result<String, Failure> {
    let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    let is_name = stem.starts_with(|c: char| c.is_ascii_lowercase())
        && stem.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    if is_name {
        return Ok(stem.to_owned());
    }
    Err(Failure::input("new::name", format!("`{stem}` is not a name"))
        .at(path.display().to_string())
        .help("lower-case letters, digits and `_`, a letter first, such as `breakfast.task`"))
}

/// Returns the scene with what was seen and measured, and what to say of each thing.
fn described(
    base: &Scene,
    name: &str,
    camera: &Camera,
    seen: &[Sighting],
    things: &[Measured],
) -> (Scene, Vec<(String, String)>) {
    let mut objects: Vec<Object> =
        seen.iter().filter_map(|sighting| base.object(&sighting.name).cloned()).collect();
    let mut comments = Vec::new();
    for thing in things {
        let word = colour_word(thing.colour);
        // Only boxes and cans are measured.
        let form = if thing.shape.faces().is_some() { "box" } else { "can" };
        let is_taken = |name: &str| objects.iter().any(|object| object.name == name);
        let plain = format!("{word}_{form}");
        let numbered = (2..).map(|n| format!("{plain}_{n}"));
        let name = std::iter::once(plain.clone()).chain(numbered).find(|name| !is_taken(name));
        let name = name.unwrap_or(plain);
        let worst = thing.size_std.iter().fold(0.0_f64, |worst, std| worst.max(*std));
        comments.push((
            name.clone(),
            format!("sizes ± {:.1} mm; its mass is a guess, its inside unknown", worst * 1e3),
        ));
        objects.push(Object {
            name,
            kind: "Graspable".into(),
            shape: thing.shape.clone(),
            cavity: None,
            looks: format!("{word} {form}"),
            material: Material::Opaque,
            colour: thing.colour,
            mass: (SOLID_DENSITY * thing.shape.volume()).max(1e-3),
        });
    }
    let scene = Scene { name: name.to_owned(), objects, camera: *camera, ..base.clone() };
    (scene, comments)
}

/// Returns the photograph with outlines of what was seen and measured.
fn drawn(image: &RgbImage, camera: &Camera, seen: &[Sighting], things: &[Measured]) -> RgbImage {
    let mut drawn = vision::annotate(image, seen);
    let view = Projector::new(camera);
    for (k, thing) in things.iter().enumerate() {
        let outline = Outline::new(&view, &thing.shape, &thing.world_from_object, 2);
        let hull: Vec<[f64; 2]> = outline.hull.iter().map(|p| [p.x, p.y]).collect();
        overlay::outline(&mut drawn, &hull, seen.len() + k);
    }
    drawn
}
