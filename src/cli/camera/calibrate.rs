//! `trueup camera calibrate`: photographs of a chessboard → the camera, with what it lacks.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::alignment;
use crate::alignment::chessboard::{self, Board};
use crate::alignment::decode;
use crate::alignment::intrinsics::coverage::Coverage;
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
    /// The board: inner corners across and down, and the side of a square: `chessboard:9x6:25mm`.
    #[arg(long, value_parser = board)]
    board: Board,
    /// Which terms of the lens are fitted; `auto` keeps those that the pictures pay for.
    #[arg(
        long,
        default_value = "auto",
        value_parser = ["auto", "none", "k1", "k1k2", "k1k2k3", "k1p1p2", "k1k2p1p2", "k1k2p1p2k3"]
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

/// Reads `chessboard:9x6:25mm`.
pub(in crate::cli) fn board(text: &str) -> Result<Board, String> {
    let form =
        "write it as chessboard:9x6:25mm: inner corners across and down, and the side of a square";
    let parts: Vec<&str> = text.split(':').map(str::trim).collect();
    let ["chessboard", size, side] = parts[..] else { return Err(form.into()) };
    let (columns, rows) = size.split_once(['x', '×']).ok_or(form)?;
    let count = |text: &str| text.trim().parse::<usize>().map_err(|_| form.to_owned());
    let digits = side.trim_end_matches(|c: char| c.is_alphabetic() || c.is_whitespace());
    let value: f64 = digits.parse().map_err(|_| form.to_owned())?;
    let unit = Unit::parse(&side[digits.len()..]).map_err(|error| error.to_string())?;
    let side = unit.of(value);
    if side.dimension != Dimension::LENGTH {
        return Err(format!("the side of a square needs a unit of length; {form}"));
    }
    Board::new(count(columns)?, count(rows)?, side.value).map_err(|error| error.to_string())
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
    let (fit, compared) = match Distortion::from_name(&args.distortion) {
        Some(distortion) => {
            let options = intrinsics::Options { distortion, ..options };
            intrinsics::calibrate(&views, &options).map(|fit| (fit, Vec::new()))
        }
        None => lens::choose(&views, &options),
    }
    .map_err(|error| refused(&error, &views, &pictures))?;
    let coverage = Coverage::of(&fit, &views);
    let answer = Answer::new(&fit, &coverage, &compared, &args.board, &pictures);
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
        style.say(calibrated::text(&fit, &coverage, &compared, &pictures).trim_end());
        for path in args.write.iter().chain(args.out.as_ref()) {
            style.say(format!("written: {}", path.display()));
        }
    }
    Ok(Exit::Yes)
}

fn save(path: &Path, answer: &Answer) -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(answer)
        .map_err(|error| Failure::input("json", error.to_string()))?;
    write::replace(path, text + "\n").map_err(unwritten(path))
}

/// Looks for the board in every picture. A picture that cannot be used says why, and the others go on.
pub(in crate::cli) fn look(
    images: &[PathBuf],
    board: &Board,
) -> (Vec<Picture>, Vec<View>, Option<(u32, u32)>) {
    let (mut pictures, mut views, mut size) = (Vec::new(), Vec::new(), None);
    let points = board.points();
    for path in images {
        let name = path.display().to_string();
        let seen = match decode::read(path) {
            Err(error) => Seen::Unreadable(format!("cannot be read: {error}")),
            Ok(image) if size.is_some_and(|size| size != image.dimensions()) => {
                Seen::OtherSize(image.dimensions())
            }
            Ok(image) => match chessboard::find(&image, board) {
                Err(why) => Seen::NotFound(why),
                Ok(corners) => {
                    // The size is that of the first picture that shows the board.
                    size = Some(image.dimensions());
                    let points = points.iter().copied().zip(corners).collect();
                    views.push(View { name: name.clone(), points, world_from_camera: None });
                    Seen::Board(views.len() - 1)
                }
            },
        };
        pictures.push(Picture { name, seen });
    }
    (pictures, views, size)
}

/// Says that no picture shows the board, and what each shows.
pub(in crate::cli) fn unseen(board: &Board, pictures: &[Picture]) -> Failure {
    let Board { columns, rows, .. } = board;
    let each: Vec<String> = pictures.iter().map(Picture::to_string).collect();
    let message =
        format!("no picture shows a board of {columns}x{rows} inner corners: {}", each.join("; "));
    Failure::input("camera::board", message).help(
        "--board counts inner corners, where four squares meet: a board of 10x7 squares has 9x6; the whole board \
         must be in the picture, with a white margin",
    )
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
        let read = board("chessboard:9x6:25mm").unwrap();
        assert_eq!((read.columns, read.rows), (9, 6));
        assert!((read.square - 0.025).abs() < 1e-15);
        assert_eq!(board("chessboard: 9×6 : 2.5 cm").unwrap(), read);
        for wrong in ["", "9x6:25mm", "chessboard:9x6", "chessboard:9x6:25", "chessboard:9x6:25kg"]
        {
            assert!(board(wrong).is_err(), "{wrong}");
        }
        for wrong in ["chessboard:1x6:25mm", "chessboard:9x999:25mm", "chessboard:9x6:-1mm"] {
            assert!(board(wrong).is_err(), "{wrong}");
        }
    }
}
