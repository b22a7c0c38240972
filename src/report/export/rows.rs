//! The recording of an arm as it stands in a run folder: rows of numbers in SI.

use super::Error;

/// The recording of an arm: the columns' headings, `q_1[rad]`, and its rows in SI.
pub(super) struct Rows {
    headings: Vec<String>,
    pub(super) rows: Vec<Vec<f64>>,
}

/// Returns the name of a column without its unit.
fn name(heading: &str) -> &str {
    heading.split('[').next().unwrap_or_default()
}

impl Rows {
    /// Reads a run's `arm.csv`; none of an empty text.
    pub(super) fn read(text: &str) -> Result<Self, Error> {
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let headings = reader.headers()?.iter().map(str::to_owned).collect();
        let mut rows = Vec::new();
        for (n, record) in reader.records().enumerate() {
            let number = |text: &str| {
                text.parse().map_err(|_| Error::Cell { line: n + 2, text: text.to_owned() })
            };
            rows.push(record?.iter().map(number).collect::<Result<Vec<f64>, _>>()?);
        }
        Ok(Self { headings, rows })
    }

    /// Returns the places of `stem_1`, `stem_2`, … among the columns.
    pub(super) fn group(&self, stem: &str) -> Vec<usize> {
        (1..).map_while(|n| self.column(&format!("{stem}_{n}"))).collect()
    }

    /// Returns the place of a column.
    pub(super) fn column(&self, wanted: &str) -> Option<usize> {
        self.headings.iter().position(|heading| name(heading) == wanted)
    }

    /// Returns whether a column is in a unit, as its heading says.
    #[cfg(feature = "arrow")]
    pub(super) fn is_in(&self, place: usize, unit: &str) -> bool {
        let heading = self.headings.get(place).map_or("", String::as_str);
        heading.split_once('[').is_some_and(|(_, rest)| rest.strip_suffix(']') == Some(unit))
    }
}

/// Returns the time of a row, s.
pub(super) fn time(row: &[f64]) -> f64 {
    row.first().copied().unwrap_or_default()
}

/// Returns the values at some places of a row.
pub(super) fn values(row: &[f64], places: &[usize]) -> Vec<f64> {
    places.iter().filter_map(|&place| row.get(place).copied()).collect()
}
