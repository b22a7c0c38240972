//! A run folder → one file for other programs: messages of ROS 2 in an MCAP file, an RRD file for Rerun, or a table.
//!
//! Only what the folder holds is written; nothing is computed anew but where the arm's links are. Times are the arm's own, s since its clock
//! began, as in `arm.csv`. Files are read and written by whoever calls.

mod table;
#[cfg(any(feature = "bags", feature = "arrow"))]
mod rows;
#[cfg(feature = "bags")]
mod bag;
#[cfg(feature = "bags")]
mod ros;
#[cfg(feature = "arrow")]
mod rrd;

#[cfg(feature = "bags")]
pub use bag::bag;
#[cfg(feature = "arrow")]
pub use rrd::rrd;
pub use table::table;

use crate::workcell::Run;
use crate::workcell::film::Film;
use crate::workcell::links::Links;

/// What of a run folder is written.
pub struct Material<'a> {
    /// The run.
    pub run: &'a Run,
    /// The text of its `arm.csv`; empty when nothing was recorded.
    pub arm: &'a str,
    /// Returns the bytes of a picture, a JPEG or PNG file, by its name without ending: `03-after-real`.
    pub picture: &'a dyn Fn(&str) -> Option<Vec<u8>>,
    /// The table of its film.
    pub film: &'a Film,
    /// Returns the bytes of a moment's picture, a JPEG file: of the camera (`real`) or the `twin`.
    pub still: &'a dyn Fn(usize, &str) -> Option<Vec<u8>>,
    /// The lines of its `events.jsonl`.
    pub events: &'a str,
    /// Where the links of its arm are, if that is known.
    pub links: Option<&'a Links>,
    /// The text of a sidecar with what the run says of the arm's recording, if that is known.
    pub sidecar: Option<&'a str>,
}

/// Why a run cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The recording of the arm is not what a run folder holds.
    #[error("`arm.csv` cannot be read: {0}")]
    Arm(#[from] csv::Error),
    /// A row of it is not a number where one belongs.
    #[error("`arm.csv`, line {line}: `{text}` is not a number")]
    Cell {
        /// Line of the file, from 1.
        line: usize,
        /// As written.
        text: String,
    },
    /// The file cannot be put together.
    #[error("the file cannot be put together: {0}")]
    Format(String),
}
