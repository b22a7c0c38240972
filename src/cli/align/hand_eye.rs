//! `trueup align hand-eye`: a table of poses and pictures of a board → where the camera sits.

use std::cmp::Ordering;
use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use crate::alignment::boards::Target;
use crate::alignment::hand_eye::table::{FlangePose, Reading, Table};
use crate::alignment::hand_eye::{self, Error, HandEye, Known, Mount, Options, View};
use crate::alignment::intrinsics::{self, lens};
use crate::files::write;
use crate::report::calibrated::{Picture, Seen};
use crate::report::exit::Exit;
use crate::report::{self, Failure, Style};

use super::super::answer::hand_eye::Answer;
use super::super::camera::calibrate::{look, refused, target, unseen};
use super::super::camera::calibration;
use super::super::inputs::{read, scene};

#[derive(Debug, Args)]
pub(in crate::cli) struct HandEyeArgs {
    /// Poses of the flange in the base, a row for each picture: `file,x[m],y[m],z[m],qw,qx,qy,qz`; instead of the quaternion
    /// `rx[rad],ry[rad],rz[rad]`, a rotation vector, or `roll[deg],pitch[deg],yaw[deg]` about the fixed x, then y, then z. Without
    /// `file` rows and pictures are paired in the order of the pictures' names.
    poses: PathBuf,
    /// The pictures, or folders with them (PNG or JPEG).
    #[arg(required = true)]
    photos: Vec<PathBuf>,
    /// The board, as `camera calibrate` takes it: `chessboard:9x6:25mm`, `charuco:7x5:40mm:30mm:4x4_50`,
    /// `aprilgrid:6x6:88mm:0.3`, `circles:7x6:20mm` or `acircles:4x11:20mm`. Of boards with tags a part in a picture will do.
    #[arg(long, value_parser = target)]
    board: Target,
    /// The camera as `camera calibrate --write` made it; without it, it is calibrated from the same pictures.
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Where the camera is: on the wrist, the board standing still, or fixed, the board in the hand. Left out, the
    /// pictures tell.
    #[arg(long, value_name = "WHERE")]
    camera: Option<Where>,
    /// Where the answer goes; a file for `camera see --calibration`, too (with `--scene`, a fixed camera's place with it).
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Where {
    Wrist,
    Fixed,
}

/// Pictures with their poses, and what could not be used.
struct Paired {
    photos: Vec<PathBuf>,
    /// The row of each picture.
    rows: Vec<usize>,
    left: Vec<(String, String)>,
}

/// `trueup align hand-eye ...`.
pub(super) fn hand_eye(
    args: &HandEyeArgs,
    scene_file: Option<&PathBuf>,
    style: Style,
) -> Result<Exit, Failure> {
    let place = args.poses.display().to_string();
    let table = Table::read(&read(&args.poses)?)
        .map_err(|error| Failure::input("align::table", error.to_string()).at(&place))?;
    let Paired { photos, rows, mut left } = paired(args, &table)?;
    let (pictures, boards, size) = look(&photos, &args.board);
    let Some(size) = size.filter(|_| !boards.is_empty()) else {
        return Err(unseen(&args.board, &pictures));
    };
    let camera = known(args, &boards, &pictures, size)?;
    let poses = table.poses();
    let views = |poses: &[FlangePose]| -> Vec<View> {
        let each = pictures.iter().zip(&rows).filter_map(|(picture, &row)| match picture.seen {
            Seen::Board(view) => Some(View {
                name: picture.name.clone(),
                base_from_flange: poses[row],
                points: boards[view].points.clone(),
            }),
            _ => None,
        });
        each.collect()
    };
    left.extend(pictures.iter().filter_map(|p| p.why_not().map(|why| (p.name.clone(), why))));
    let mount = args.camera.map(|at| match at {
        Where::Wrist => Mount::Wrist,
        Where::Fixed => Mount::Fixed,
    });
    let options = Options { board: args.board.clone(), mount };
    let answer = hand_eye::solve(&views(&poses), &camera, &options).map_err(|error| {
        let other =
            |poses: &[FlangePose]| hand_eye::solve(&views(poses), &camera, &options).is_ok();
        failure(&error, &table, mount, &other).at(&place)
    })?;
    told(args, &answer, &left, scene_file, style)
}

/// Prints the answer and writes its file.
fn told(
    args: &HandEyeArgs,
    answer: &HandEye,
    left: &[(String, String)],
    scene_file: Option<&PathBuf>,
    style: Style,
) -> Result<Exit, Failure> {
    let world_from_base = match scene_file {
        Some(path) if answer.mount == Mount::Fixed => {
            Some(scene(Some(path.as_path()), style)?.world_from_base)
        }
        _ => None,
    };
    let document = Answer::new(answer, left, world_from_base);
    if let Some(path) = &args.out {
        let text = serde_json::to_string_pretty(&document)
            .map_err(|error| Failure::input("json", error.to_string()))?;
        write::replace(path, text + "\n").map_err(|error| Failure::unwritten(path, &error))?;
    }
    if style.json {
        style.document(&document);
    } else {
        style.say(report::hand_eye::text(answer, left).trim_end());
        if let Some(path) = &args.out {
            style.say(format!("written: {}", path.display()));
        }
    }
    Ok(if answer.square.is_wrong { Exit::No } else { Exit::Yes })
}

/// The camera from its file, or from the pictures.
fn known(
    args: &HandEyeArgs,
    boards: &[intrinsics::View],
    pictures: &[Picture],
    size: (u32, u32),
) -> Result<Known, Failure> {
    if let Some(path) = &args.calibration {
        let mut intrinsics = calibration(path)?.intrinsics;
        if (intrinsics.width, intrinsics.height) == (0, 0) {
            (intrinsics.width, intrinsics.height) = size;
        }
        let (w, h) = (intrinsics.width, intrinsics.height);
        if (w, h) != size {
            let message = format!(
                "the camera was calibrated at {w} x {h} px, the pictures are {} x {} px",
                size.0, size.1
            );
            return Err(Failure::input("camera::picture", message)
                .at(path.display().to_string())
                .help("calibrate it at the size of these pictures, or leave `--calibration` out"));
        }
        return Ok(Known { intrinsics, covariance: nalgebra::SMatrix::zeros() });
    }
    let options = intrinsics::Options {
        skew: Some(false),
        image_size: Some(size),
        ..intrinsics::Options::default()
    };
    let (fit, _) = lens::choose(boards, &options).map_err(|error| {
        let failure = refused(&error, boards, pictures);
        failure.help(
            "calibrate the camera with `camera calibrate` from pictures with the board tilted by 30 to 45 deg to \
             different sides, and give `--calibration FILE`",
        )
    })?;
    Ok(Known { intrinsics: fit.intrinsics, covariance: fit.covariance })
}

/// Finds the picture of each row.
fn paired(args: &HandEyeArgs, table: &Table) -> Result<Paired, Failure> {
    let photos = listed(&args.photos)?;
    let Some(files) = &table.files else {
        if photos.len() != table.n_rows() {
            let message = format!(
                "{} rows of poses and {} pictures cannot be paired in order",
                table.n_rows(),
                photos.len()
            );
            return Err(Failure::input("align::pictures", message)
                .at(args.poses.display().to_string())
                .help("add a column `file` with the name of each row's picture"));
        }
        let rows = (0..photos.len()).collect();
        return Ok(Paired { photos, rows, left: Vec::new() });
    };
    let name = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned());
    let (mut found, mut rows, mut left) = (Vec::new(), Vec::new(), Vec::new());
    for (row, file) in files.iter().enumerate() {
        let wanted = name(Path::new(file));
        match photos.iter().find(|photo| name(photo) == wanted && wanted.is_some()) {
            Some(photo) if found.contains(photo) => {
                left.push((
                    file.clone(),
                    format!("row {}: the picture has a row already", row + 1),
                ));
            }
            Some(photo) => {
                found.push(photo.clone());
                rows.push(row);
            }
            None => left.push((file.clone(), format!("row {}: no such picture is given", row + 1))),
        }
    }
    for photo in photos.iter().filter(|photo| !found.contains(photo)) {
        left.push((photo.display().to_string(), "no row names it".into()));
    }
    if found.is_empty() {
        let message = "no row of the table names a picture that is given".to_owned();
        return Err(Failure::input("align::pictures", message)
            .at(args.poses.display().to_string())
            .help(format!("the first row names `{}`", files.first().map_or("", String::as_str))));
    }
    Ok(Paired { photos: found, rows, left })
}

/// The pictures named, those of folders in the order of their names, with numbers by their value.
fn listed(places: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut photos = Vec::new();
    for place in places {
        if !place.is_dir() {
            photos.push(place.clone());
            continue;
        }
        let entries = fs::read_dir(place).map_err(|error| Failure::unread(place, &error))?;
        let mut inside: Vec<PathBuf> = entries
            .filter_map(Result::ok)
            .map(|entry| entry.path())
            .filter(|path| is_picture(path))
            .collect();
        inside.sort_by(|a, b| natural(&a.to_string_lossy(), &b.to_string_lossy()));
        photos.extend(inside);
    }
    if photos.is_empty() {
        let names: Vec<String> = places.iter().map(|place| place.display().to_string()).collect();
        return Err(Failure::input(
            "align::pictures",
            format!("no picture in {}", names.join(", ")),
        )
        .help("PNG and JPEG pictures can be read"));
    }
    Ok(photos)
}

fn is_picture(path: &Path) -> bool {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    path.is_file() && matches!(ending.as_deref(), Some("png" | "jpg" | "jpeg"))
}

/// Orders names as a person does: `a2` before `a10`.
fn natural(a: &str, b: &str) -> Ordering {
    let (mut a, mut b) = (a, b);
    let number = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    loop {
        let (m, n) = (number(a), number(b));
        if m > 0 && n > 0 {
            let (x, y) = (a[..m].trim_start_matches('0'), b[..n].trim_start_matches('0'));
            let order = x.len().cmp(&y.len()).then(x.cmp(y));
            if order != Ordering::Equal {
                return order;
            }
            (a, b) = (&a[m..], &b[n..]);
            continue;
        }
        let (mut p, mut q) = (a.chars(), b.chars());
        match (p.next(), q.next()) {
            (Some(x), Some(y)) if x == y => (a, b) = (p.as_str(), q.as_str()),
            (x, y) => return x.cmp(&y),
        }
    }
}

/// Words why there is no answer; for a table that does not fit, or whose turns tell nothing, whether it would if it were read
/// another way.
fn failure(
    error: &Error,
    table: &Table,
    said: Option<Mount>,
    fits: &dyn Fn(&[FlangePose]) -> bool,
) -> Failure {
    let reading = match error {
        Error::NoFit { .. } | Error::NotTurned { .. } | Error::OneAxis { .. } => {
            table.readings().into_iter().find(|(_, poses)| fits(poses)).map(|(reading, _)| reading)
        }
        _ => None,
    };
    if let Some(reading) = reading {
        let message = match error {
            Error::NoFit { .. } => error.to_string(),
            _ => {
                format!("poses and pictures do not belong together: as the table is read, {error}")
            }
        };
        // A camera on the wrist has the equations of a fixed one with each pose inverted: no picture tells which was meant.
        let help = match (reading, said) {
            (Reading::Inverse, Some(Mount::Fixed)) => {
                format!("the table would fit with `--camera wrist`, or if {reading}")
            }
            (Reading::Inverse, Some(Mount::Wrist)) => {
                format!("the table would fit if {reading}, or with `--camera fixed`")
            }
            _ => format!("the table would fit if {reading}"),
        };
        return Failure::input("align::poses", message).help(help);
    }
    let turned = "take pictures with the wrist turned by 20 to 40 deg about two or more axes, the board in each";
    let code = match error {
        Error::TooFew { .. } | Error::NotTurned { .. } | Error::OneAxis { .. } => "align::motions",
        Error::NoFit { .. } | Error::LengthUnit { .. } => "align::poses",
        Error::WhichMount { .. } => "align::mount",
        Error::NoBoard { .. } | Error::Fit(_) => "align::degenerate",
    };
    let help = match error {
        Error::TooFew { .. } => {
            "take ten or more pictures, the wrist turned by 20 to 40 deg to another side in each"
                .into()
        }
        Error::NotTurned { .. } => turned.into(),
        Error::OneAxis { mount, .. } => format!(
            "take pictures with the wrist turned by 20 to 40 deg about another axis of the {} frame; an arm that cannot \
             needs the camera's place along the axis measured by hand",
            mount.carrier()
        ),
        Error::LengthUnit { times } => {
            let unit = &table.length_unit;
            format!("the header says {unit}; {}", likely_unit(unit, *times))
        }
        Error::WhichMount { .. } => "say `--camera wrist` or `--camera fixed`".into(),
        Error::NoFit { mount, .. } => format!(
            "does every row belong to its picture (without a column `file`, rows go with the pictures in the order of \
             their names)? Is the camera {mount}? Are the poses the flange's in the base, in the units of the header?"
        ),
        Error::NoBoard { .. } | Error::Fit(_) => "is `--board` right? leave the picture out".into(),
    };
    Failure::input(code, error.to_string()).help(help)
}

/// What a header should say whose numbers are so many times too large.
fn likely_unit(unit: &str, times: f64) -> String {
    let metres = [("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("in", 0.0254)];
    let said = metres.iter().find(|(name, _)| *name == unit).map_or(1.0, |(_, metres)| *metres);
    let near = |(_, metres): &&(&str, f64)| ((said / metres / times).ln()).abs();
    let likely = metres.iter().min_by(|a, b| near(a).total_cmp(&near(b)));
    let name = likely.map_or("mm", |(name, _)| *name);
    format!("the numbers look like {name}: write `x[{name}]`, `y[{name}]`, `z[{name}]`")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_count_by_their_value() {
        let mut names = ["b1", "a10", "a2", "a02b", "a"];
        names.sort_by(|a, b| natural(a, b));
        assert_eq!(names, ["a", "a2", "a02b", "a10", "b1"]);
    }

    /// Right poses of a camera on the wrist with `--camera fixed` were told to be inverse ones, and nothing else.
    #[test]
    fn poses_that_fit_when_inverted_fit_the_other_mount_as_well() {
        let table =
            Table::read("x[m],y[m],z[m],qw,qx,qy,qz\n0.5,0,0.3,1,0,0,0\n0.4,0,0.3,0,1,0,0\n")
                .unwrap();
        let help = |mount, said| {
            let error = Error::NoFit { mount, rotation: 0.5, position: 0.2 };
            failure(&error, &table, said, &|_: &[FlangePose]| true).help.unwrap()
        };
        let fixed = help(Mount::Fixed, Some(Mount::Fixed));
        assert!(fixed.starts_with("the table would fit with `--camera wrist`, or if"), "{fixed}");
        assert!(fixed.contains("flange_from_base"), "{fixed}");
        let wrist = help(Mount::Wrist, Some(Mount::Wrist));
        assert!(wrist.contains("flange_from_base"), "{wrist}");
        assert!(wrist.ends_with(", or with `--camera fixed`"), "{wrist}");
        assert!(!help(Mount::Wrist, None).contains("--camera"));
    }

    #[test]
    fn a_unit_follows_from_its_ratio() {
        assert!(likely_unit("m", 1010.0).contains("x[mm]"));
        assert!(likely_unit("mm", 0.00098).contains("x[m]"));
        assert!(likely_unit("cm", 9.9).contains("x[mm]"));
        assert!(likely_unit("m", 39.4).contains("x[in]"));
        assert!(likely_unit("in", 0.0254).contains("x[m]"));
    }
}
