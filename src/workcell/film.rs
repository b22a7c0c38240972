//! The film of a run in its folder: small pictures of camera and twin at a steady rate while the arm moved, and a table
//! of what they show.
//!
//! `film/0001-real.jpg` and `film/0001-twin.jpg` are a moment; `film/film.csv` has a row for each with the arm's time, the
//! step, and the water in the twin's vessels, which no camera shows. How they are taken is the affair of `filming`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::files::read;
use crate::trace::Still;

/// The folder of a film in a run folder.
pub const FOLDER: &str = "film";
/// The table in it.
pub const TABLE: &str = "film.csv";

/// A moment of a film as its table has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Its place, from 1.
    pub number: usize,
    /// The arm's time, s.
    pub time: f64,
    /// The step that runs.
    pub step: usize,
    /// Water in the twin, mL, by the table's columns: its vessels, and `spilt`.
    pub water_ml: Vec<f64>,
}

/// A film as its table tells it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Film {
    /// What of the twin's water is told of: its vessels, and `spilt`.
    pub vessels: Vec<String>,
    /// In order.
    pub moments: Vec<Moment>,
}

/// Returns the file of a picture: `whose` is `real` or `twin`.
pub fn picture(run: &Path, number: usize, whose: &str) -> PathBuf {
    run.join(FOLDER).join(format!("{number:04}-{whose}.jpg"))
}

/// Returns the first line of the table for a film that begins with `still`.
pub(super) fn header(still: &Still) -> String {
    let mut line = "number,t[s],step".to_owned();
    for (name, _) in &still.water {
        let _ = write!(line, ",{name}[mL]");
    }
    line + ",spilt[mL]\n"
}

/// Returns the line of a moment.
pub(super) fn row(still: &Still) -> String {
    let mut line = format!("{},{:.3},{}", still.number, still.time, still.step);
    for volume in still.water.iter().map(|(_, volume)| volume).chain([&still.spilt]) {
        let _ = write!(line, ",{:.2}", volume * 1e6);
    }
    line + "\n"
}

/// Reads the film of a run folder; an empty one when there is none. A line that is cut off ends it.
pub fn read(run: &Path) -> Film {
    let Ok(text) = read::text(&run.join(FOLDER).join(TABLE)) else { return Film::default() };
    let mut lines = text.lines();
    let bare = |column: &str| column.split('[').next().unwrap_or_default().to_owned();
    let vessels: Vec<String> =
        lines.next().unwrap_or_default().split(',').skip(3).map(bare).collect();
    let moments = lines.map_while(|line| {
        let mut cells = line.split(',');
        let moment = Moment {
            number: cells.next()?.parse().ok()?,
            time: cells.next()?.parse().ok()?,
            step: cells.next()?.parse().ok()?,
            water_ml: cells.map(str::parse).collect::<Result<_, _>>().ok()?,
        };
        (moment.water_ml.len() == vessels.len()).then_some(moment)
    });
    Film { moments: moments.collect(), vessels }
}
