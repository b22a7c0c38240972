//! Why a cell could not be calibrated, worded for people: what was in the picture, where the arm came to, what would help.

use super::Failure;
use crate::alignment::vision;
use crate::execution::calibrate::{self, Visited};

/// Words why a cell could not be calibrated.
pub(super) fn uncalibrated(error: &calibrate::Error, words: String) -> Failure {
    match error {
        calibrate::Error::Picture(vision::Error::NoMarks { .. }) => {
            Failure::no("align::failed", words)
                .help("print more dots, spread over the table, and write their centres into the scene's `marks`")
        }
        calibrate::Error::Unseen(visited) => {
            Failure::no("align::failed", words).help(more_to_see(visited))
        }
        calibrate::Error::NoMarker => Failure::no("align::failed", words).help(BALL),
        calibrate::Error::Picture(vision::Error::WrongSize { .. }) => {
            Failure::unavailable("camera::picture", words).help(
                "let the camera take pictures of that size, or give the scene's `camera` the size that it takes",
            )
        }
        _ => Failure::no("align::failed", words)
            .help("is the table in the picture, and do its dots match the scene's `marks`?"),
    }
}

/// What helps when there is no ball to be seen.
const BALL: &str = "is the ball on the link, at the place, of the size and colour that `[marker]` of the robot's `robot.toml` says, on a \
                    side the camera sees? `--without-regression 3` does without it";

/// Returns what would let the marker be seen at more points.
fn more_to_see(visited: &Visited) -> &'static str {
    let Visited { reached, outside, out_of_reach, points, needed, .. } = *visited;
    if points - outside < needed {
        "let the camera see more of what is over the table before the arm, and write into the scene's `camera` from where it \
         does; `--without-regression 3` does without it"
    } else if reached < needed && points - outside - out_of_reach < needed {
        "`--without-regression 3` does without it: the arm is taken at its word. To calibrate it, bring these points into its reach: does \
         the scene's `robot` stand where it says, at that height over the table?"
    } else if reached < needed {
        "make room over the table before the arm; does the scene's `robot` stand where it says, at that height over the table? \
         `--without-regression 3` does without it"
    } else {
        BALL
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An arm that came to 4 of 30 points was asked about the colour of its ball, a SCARA, which takes no level pose, for room over
    /// the table.
    #[test]
    fn the_help_fits_why_the_marker_was_not_seen() {
        let told = |seen, reached, outside, out_of_reach| {
            let in_the_way = 30 - reached - outside - out_of_reach;
            let (points, needed) = (30, 6);
            let visited =
                Visited { seen, reached, outside, out_of_reach, in_the_way, points, needed };
            let error = calibrate::Error::Unseen(visited);
            let failure = uncalibrated(&error, error.to_string());
            (failure.message, failure.help.unwrap())
        };
        assert!(told(4, 4, 0, 6).1.starts_with("make room over the table"));
        assert!(told(0, 2, 28, 0).1.starts_with("let the camera see more"));
        assert!(told(0, 26, 4, 0).1.starts_with("is the ball on the link"));
        let (what, help) = told(0, 0, 7, 23);
        assert!(what.contains("took none of the poses"), "{what}");
        assert!(what.contains("23 out of reach, 7 outside the picture"), "{what}");
        assert!(help.starts_with("`--without-regression 3`"), "{help}");
    }
}
