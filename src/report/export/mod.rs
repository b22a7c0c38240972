//! A run folder → one file for other programs: messages of ROS 2 in an MCAP file, or a table.
//!
//! Only what the folder holds is written; nothing is computed anew. Times are the arm's own, s since its clock
//! began, as in `arm.csv`. Files are read and written by whoever calls.

mod table;
#[cfg(feature = "bags")]
mod bag;
#[cfg(feature = "bags")]
mod ros;

#[cfg(feature = "bags")]
pub use bag::bag;
pub use table::table;

use crate::workcell::Run;

/// What of a run folder is written.
pub struct Material<'a> {
    /// The run.
    pub run: &'a Run,
    /// The text of its `arm.csv`; empty when nothing was recorded.
    pub arm: &'a str,
    /// Returns the bytes of a picture, a PNG file, by its name without ending: `03-after-real`.
    pub picture: &'a dyn Fn(&str) -> Option<Vec<u8>>,
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

/// The recording of an arm: the columns' names, without units, and its rows in SI.
struct Rows {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Rows {
    /// Reads a run's `arm.csv`.
    fn read(text: &str) -> Result<Self, Error> {
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let name = |header: &str| header.split('[').next().unwrap_or_default().to_owned();
        let names = reader.headers()?.iter().map(name).collect();
        let mut rows = Vec::new();
        for (n, record) in reader.records().enumerate() {
            let number = |text: &str| {
                text.parse().map_err(|_| Error::Cell { line: n + 2, text: text.to_owned() })
            };
            rows.push(record?.iter().map(number).collect::<Result<Vec<f64>, _>>()?);
        }
        Ok(Self { names, rows })
    }

    /// Returns the places of `stem_1`, `stem_2`, … among the columns.
    fn group(&self, stem: &str) -> Vec<usize> {
        let at = |n: usize| self.names.iter().position(|name| *name == format!("{stem}_{n}"));
        (1..).map_while(at).collect()
    }

    /// Returns the place of a column.
    fn column(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|known| known == name)
    }
}
