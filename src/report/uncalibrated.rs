//! Why a cell could not be calibrated, worded for people: what was in the picture, where the arm came to, what would help.

use super::Failure;
use crate::alignment::vision;
use crate::execution::calibrate;

/// Words why a cell could not be calibrated.
pub(super) fn uncalibrated(error: &calibrate::Error, words: String) -> Failure {
    match error {
        calibrate::Error::Picture(vision::Error::NoMarks { .. }) => {
            Failure::no("align::failed", words)
                .help("print more dots, spread over the table, and write their centres into the scene's `marks`")
        }
        calibrate::Error::Unseen { outside, visited, needed, .. } if visited - outside < *needed => {
            Failure::no("align::failed", words).help(
                "let the camera see more of what is over the table before the arm, and write into the scene's `camera` from where it \
                 does; `--without-regression 3` does without it",
            )
        }
        calibrate::Error::Unseen { reached, needed, .. } if reached < needed => {
            Failure::no("align::failed", words).help(
                "make room over the table before the arm; does the scene's `robot` stand where it says, at that height over the table? \
                 `--without-regression 3` does without it",
            )
        }
        calibrate::Error::Unseen { .. } | calibrate::Error::NoMarker => {
            Failure::no("align::failed", words).help(
                "is the ball on the link, at the place, of the size and colour that `[marker]` of the robot's `robot.toml` says, on a \
                 side the camera sees? `--without-regression 3` does without it",
            )
        }
        calibrate::Error::Picture(vision::Error::WrongSize { .. }) => {
            Failure::unavailable("camera::picture", words).help(
                "let the camera take pictures of that size, or give the scene's `camera` the size that it takes",
            )
        }
        _ => Failure::no("align::failed", words)
            .help("is the table in the picture, and do its dots match the scene's `marks`?"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An arm that came to 4 of 30 points was asked about the colour of its ball.
    #[test]
    fn the_help_fits_why_the_marker_was_not_seen() {
        let help = |seen, reached, outside| {
            let error = calibrate::Error::Unseen { seen, reached, outside, visited: 30, needed: 6 };
            uncalibrated(&error, error.to_string()).help.unwrap()
        };
        assert!(help(4, 4, 0).starts_with("make room over the table"));
        assert!(help(0, 3, 28).starts_with("let the camera see more"));
        assert!(help(0, 27, 4).starts_with("is the ball on the link"));
    }
}
