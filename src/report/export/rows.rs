//! The recording of an arm as it stands in a run folder: rows of numbers in SI.

use super::Error;

/// The recording of an arm: the columns' names, without units, and its rows in SI.
pub(super) struct Rows {
    names: Vec<String>,
    pub(super) rows: Vec<Vec<f64>>,
}

impl Rows {
    /// Reads a run's `arm.csv`; none of an empty text.
    pub(super) fn read(text: &str) -> Result<Self, Error> {
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
    pub(super) fn group(&self, stem: &str) -> Vec<usize> {
        let at = |n: usize| self.names.iter().position(|name| *name == format!("{stem}_{n}"));
        (1..).map_while(at).collect()
    }

    /// Returns the place of a column.
    pub(super) fn column(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|known| known == name)
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
