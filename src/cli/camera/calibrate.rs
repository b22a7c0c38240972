//! `trueup camera calibrate`: photographs of a board → the camera, with what it lacks.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::alignment;
use crate::alignment::boards::Target;
use crate::alignment::boards::charuco::{self, Charuco};
use crate::alignment::boards::circles::Circles;
use crate::alignment::boards::tag_grid::TagGrid;
use crate::alignment::boards::tags::Family;
use crate::alignment::chessboard::Board;
use crate::alignment::decode;
use crate::alignment::intrinsics::coverage::{Coverage, OtherGap};
use crate::alignment::intrinsics::strays::{self, Without};
use crate::alignment::intrinsics::{self, Distortion, View, lens};
use crate::files::write;
use crate::report::calibrated::{self, Picture, Seen};
use crate::report::exit::Exit;
use crate::report::{Failure, Style};
use crate::units::{Dimension, Unit};

use super::super::answer::calibrate::Answer;
use super::unwritten;

#[derive(Debug, Args)]
pub(in crate::cli) struct CalibrateArgs {
    /// The pictures (PNG or JPEG), all of one camera at one focus.
    #[arg(required = true)]
    images: Vec<PathBuf>,
    /// The board: `chessboard:9x6:25mm` (inner corners across and down, side of a square), `charuco:7x5:40mm:30mm:4x4_50`
    /// (squares across and down, their side, the tags' side, the tags), `aprilgrid:6x6:88mm:0.3` (tags across and up,
    /// their side, the gap as a part of it), `circles:7x6:20mm`, or `acircles:4x11:20mm` (every second row shifted).
    #[arg(long, value_parser = target)]
    board: Target,
    /// Which terms of the lens are fitted; `auto` keeps those that the pictures pay for. `fisheye` is `k1` to `k4` of the angle from the
    /// axis, for wide lenses.
    #[arg(
        long,
        default_value = "auto",
        value_parser = [
            "auto", "none", "k1", "k1k2", "k1k2k3", "k1p1p2", "k1k2p1p2", "k1k2p1p2k3", "fisheye-none", "fisheye-k1",
            "fisheye-k1k2", "fisheye-k1k2k3", "fisheye"
        ]
    )]
    distortion: String,
    /// Fit a skew of the sensor as well; takes three pictures.
    #[arg(long)]
    skew: bool,
    /// Where the calibration goes; `camera see --calibration` and `gap` read it.
    #[arg(long, value_name = "FILE")]
    write: Option<PathBuf>,
    /// Where `corners.svg` goes: the corners of all pictures over the picture's frame, with their residuals.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Reads a board of any kind.
pub(in crate::cli) fn target(text: &str) -> Result<Target, String> {
    let parts: Vec<&str> = text.split(':').map(str::trim).collect();
    let named = |name: &str| {
        let unknown =
            || format!("there are no tags called {name}; there are {}", Family::names().join(", "));
        Family::named(name).ok_or_else(unknown)
    };
    let said = |error: charuco::BadBoard| error.to_string();
    match parts[..] {
        ["chessboard", size, side] => {
            let (columns, rows) = counts(size)?;
            let board = Board::new(columns, rows, length(side)?);
            board.map(Target::Chessboard).map_err(|error| error.to_string())
        }
        ["charuco", size, square, tag, family] => {
            let (columns, rows) = counts(size)?;
            let (square, tag) = (length(square)?, length(tag)?);
            let board = Charuco::new(columns, rows, square, tag, named(family)?);
            board.map(Target::Charuco).map_err(said)
        }
        ["aprilgrid", size, tag, gap, ref family @ ..] if family.len() < 2 => {
            let (columns, rows) = counts(size)?;
            let family = named(family.first().copied().unwrap_or("36h11"))?;
            let gap = gap.parse().map_err(|_| FORMS.to_owned())?;
            let board = TagGrid::new(columns, rows, length(tag)?, gap, family);
            board.map(Target::Tags).map_err(said)
        }
        [kind @ ("circles" | "acircles"), size, step] => {
            let (columns, rows) = counts(size)?;
            let board = Circles::new(columns, rows, length(step)?, kind == "acircles");
            board.map(Target::Circles).map_err(said)
        }
        _ => Err(FORMS.into()),
    }
}

/// How a board is written.
const FORMS: &str = "write it as chessboard:9x6:25mm (inner corners across and down, side of a square), \
    charuco:7x5:40mm:30mm:4x4_50, aprilgrid:6x6:88mm:0.3, circles:7x6:20mm or acircles:4x11:20mm";

fn counts(text: &str) -> Result<(usize, usize), String> {
    let (columns, rows) = text.split_once(['x', '×']).ok_or(FORMS)?;
    let count = |text: &str| text.trim().parse().map_err(|_| FORMS.to_owned());
    Ok((count(columns)?, count(rows)?))
}

fn length(text: &str) -> Result<f64, String> {
    let digits = text.trim_end_matches(|c: char| c.is_alphabetic() || c.is_whitespace());
    let value: f64 = digits.parse().map_err(|_| FORMS.to_owned())?;
    let unit = Unit::parse(&text[digits.len()..]).map_err(|error| error.to_string())?;
    let length = unit.of(value);
    if length.dimension != Dimension::LENGTH {
        return Err(format!("`{text}` needs a unit of length; {FORMS}"));
    }
    Ok(length.value)
}

/// `trueup camera calibrate ...`.
pub(super) fn calibrate(args: &CalibrateArgs, style: Style) -> Result<Exit, Failure> {
    let (pictures, views, size) = look(&args.images, &args.board);
    let Some(size) = size.filter(|_| !views.is_empty()) else {
        return Err(unseen(&args.board, &pictures));
    };
    let options = intrinsics::Options {
        skew: Some(args.skew),
        image_size: Some(size),
        ..intrinsics::Options::default()
    };
    let distortion = Distortion::from_name(&args.distortion);
    let fitted = |views: &[View]| match distortion {
        Some(distortion) => {
            let options = intrinsics::Options { distortion, ..options };
            intrinsics::calibrate(views, &options).map(|fit| (fit, Vec::new()))
        }
        None => lens::choose(views, &options),
    };
    let found =
        strays::without(&views, fitted).map_err(|error| refused(&error, &views, &pictures))?;
    let Without { fit: (fit, compared), views, strays } = found;
    let mut coverage = Coverage::of(&fit, &views);
    if let Target::Tags(grid) = &args.board {
        coverage.other_gap = other_gap(grid, &views, fit.rms_px, |views| {
            fitted(views).ok().map(|(fit, _)| fit.rms_px)
        });
    }
    let answer = Answer::new(&fit, &coverage, &compared, &args.board, &pictures, &strays);
    if let Some(dir) = &args.out {
        std::fs::create_dir_all(dir).map_err(unwritten(dir))?;
        let path = dir.join("corners.svg");
        write::replace(&path, calibrated::drawing(&fit, &views)).map_err(unwritten(&path))?;
    }
    if let Some(path) = &args.write {
        save(path, &answer)?;
    }
    if style.json {
        style.document(&answer);
    } else {
        style.say(calibrated::text(&fit, &coverage, &compared, &pictures, &strays).trim_end());
        for path in args.write.iter().chain(args.out.as_ref()) {
            style.say(format!("written: {}", path.display()));
        }
    }
    Ok(if coverage.other_gap.is_some() { Exit::No } else { Exit::Yes })
}

/// The corners must fit to less than this part of what they are off with the gap that was said. Chosen: what differs by no more is a
/// lens, or a sheet that is not flat.
const BETTER: f64 = 0.5;

/// Returns the gap of a grid of tags where it is not the one that was said; `rms_px` is how far corners are off with that, `again`
/// how far they are in views that have another.
fn other_gap(
    grid: &TagGrid,
    views: &[View],
    rms_px: f64,
    again: impl Fn(&[View]) -> Option<f64>,
) -> Option<OtherGap> {
    let seen = grid.other_gap(views.iter().map(|view| &view.points))?;
    let spaced: Vec<View> = views
        .iter()
        .map(|view| View { points: grid.spaced(seen, &view.points), ..view.clone() })
        .collect();
    let better_px = again(&spaced)?;
    (better_px < BETTER * rms_px).then_some(OtherGap { said: grid.gap, seen, rms_px, better_px })
}

fn save(path: &Path, answer: &Answer) -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(answer)
        .map_err(|error| Failure::input("json", error.to_string()))?;
    write::replace(path, text + "\n").map_err(unwritten(path))
}

/// Looks for the board in every picture. A picture that cannot be used says why, and the others go on.
pub(in crate::cli) fn look(
    images: &[PathBuf],
    board: &Target,
) -> (Vec<Picture>, Vec<View>, Option<(u32, u32)>) {
    let (mut pictures, mut views, mut size) = (Vec::new(), Vec::new(), None);
    for path in images {
        let name = path.display().to_string();
        let seen = match decode::read(path) {
            Err(error) => Seen::Unreadable(format!("cannot be read: {error}")),
            Ok(image) if size.is_some_and(|size| size != image.dimensions()) => {
                Seen::OtherSize(image.dimensions())
            }
            Ok(image) => match board.find(&image) {
                Err(why) => Seen::NotFound(why),
                Ok(points) => {
                    // The size is that of the first picture that shows the board.
                    size = Some(image.dimensions());
                    if let Some(same) = views.iter().find(|view: &&View| view.points == points) {
                        Seen::SameAs(same.name.clone())
                    } else {
                        views.push(View { name: name.clone(), points, world_from_camera: None });
                        Seen::Board(views.len() - 1)
                    }
                }
            },
        };
        pictures.push(Picture { name, seen });
    }
    (pictures, views, size)
}

/// Says that no picture shows the board, and what each shows.
pub(in crate::cli) fn unseen(board: &Target, pictures: &[Picture]) -> Failure {
    let each = pictures.iter().map(Picture::to_string).collect::<Vec<_>>().join("; ");
    // What all of them show is said once.
    let of_all = pictures.first().and_then(Picture::why_not).filter(|why| {
        pictures.len() > 1 && pictures.iter().all(|other| other.why_not().as_ref() == Some(why))
    });
    let each = of_all.map_or(each, |why| format!("{why}, in all {} pictures", pictures.len()));
    let (what, help) = match board {
        Target::Chessboard(Board { columns, rows, .. }) => (
            format!("a board of {columns}x{rows} inner corners"),
            "--board counts inner corners, where four squares meet: a board of 10x7 squares has 9x6; the whole board must \
             be in the picture, with a white margin",
        ),
        Target::Charuco(_) => (
            "the board".into(),
            "--board says squares across and down, the sides of squares and of tags, and which tags they are: \
             charuco:7x5:40mm:30mm:4x4_50",
        ),
        Target::Tags(_) => (
            "the board".into(),
            "--board says tags across and up, their side with the dark frame, and the gap as a part of it: \
             aprilgrid:6x6:88mm:0.3",
        ),
        Target::Circles(Circles { columns, rows, .. }) => (
            format!("{columns}x{rows} circles"),
            "every circle must be in the picture, dark on bright; acircles has every second row shifted",
        ),
    };
    let message = format!("no picture shows {what}: {each}");
    Failure::input("camera::board", message).help(help)
}

/// Says why the pictures do not determine the camera.
pub(in crate::cli) fn refused(
    error: &alignment::Error,
    views: &[View],
    pictures: &[Picture],
) -> Failure {
    let left_out: Vec<String> = pictures
        .iter()
        .filter(|picture| !matches!(picture.seen, Seen::Board(_)))
        .map(Picture::to_string)
        .collect();
    let left_out =
        if left_out.is_empty() { String::new() } else { format!(" ({})", left_out.join("; ")) };
    let message = format!("the camera cannot be calibrated: {error}{left_out}");
    let names: Vec<&str> = views.iter().map(|view| view.name.as_str()).collect();
    Failure::input("camera::views", message).at(names.join(", ")).help(
        "take five or more pictures with the board tilted by 30 to 45 deg, to the left, to the right, up and down, and \
         in all parts of the picture",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_is_read_with_its_unit() {
        let read = |text: &str| match target(text) {
            Ok(Target::Chessboard(board)) => board,
            other => panic!("{text}: {other:?}"),
        };
        let board = read("chessboard:9x6:25mm");
        assert_eq!((board.columns, board.rows), (9, 6));
        assert!((board.square - 0.025).abs() < 1e-15);
        assert_eq!(read("chessboard: 9×6 : 2.5 cm"), board);
        for good in
            ["charuco:7x5:40mm:30mm:DICT_4X4_50", "aprilgrid:6x6:88mm:0.3", "acircles:4x11:2cm"]
        {
            target(good).unwrap();
        }
        for wrong in [
            "charuco:7x5:40mm:50mm:4x4_50",
            "charuco:17x15:40mm:30mm:4x4_50",
            "charuco:7x5:40mm:30mm:3x3_5",
            "aprilgrid:6x6:88mm",
            "circles:2x2:1cm",
            "",
            "9x6:25mm",
            "chessboard:9x6",
            "chessboard:9x6:25",
            "chessboard:9x6:25kg",
            "chessboard:1x6:25mm",
            "chessboard:9x999:25mm",
            "chessboard:9x6:-1mm",
        ] {
            assert!(target(wrong).is_err(), "{wrong}");
        }
    }
}
