//! The text of a CSV file → columns with names and units, and rows of as many cells.
//!
//! What the cells mean is the business of whoever reads them: measurements over time (`table`), or points
//! and their pixels ([`crate::discovery::camera::points`]).

use std::collections::BTreeSet;

use super::arrays::Arrays;
use super::written::{Uneven, Written};
use super::{Error, Flaw, MOST_VALUES, Map, too_much};
use crate::units::{self, Unit};

/// A table of text.
pub(in crate::discovery) struct Sheet {
    /// The columns, renamed, in the file's order; no two bear one name.
    pub(in crate::discovery) columns: Vec<units::Column>,
    /// Line of the file, from 1, and a cell per column.
    pub(in crate::discovery) rows: Vec<(usize, csv::StringRecord)>,
}

impl Sheet {
    /// Reads a text. `is` says what the file should be, for the error that it is no table; `header` shows how
    /// it could begin.
    ///
    /// # Errors
    ///
    /// An [`Error`] for a text that is empty or no table, a column that the map renames and the file does not
    /// have, a header whose unit does not exist, two columns of one name, or a row with more or fewer cells.
    pub(in crate::discovery) fn read(
        name: &str,
        text: &str,
        map: &Map,
        (is, header): (&str, &str),
    ) -> Result<Self, Error> {
        let mut rows = Vec::new();
        let columns = each_row(name, text, map, (is, header), |_, line, record| {
            rows.push((line, record.clone()));
        })?;
        let mut names: BTreeSet<String> = BTreeSet::new();
        for column in &columns {
            if !names.insert(column.name.clone()) {
                return Err(Flaw::SameName(column.name.clone()).at(format!("{name}:1")));
            }
        }
        Ok(Self { columns, rows })
    }
}

/// Most columns of a table; a robot with every channel has a hundred.
pub(super) const MOST_COLUMNS: usize = 200_000;

/// Reads a text and calls `each` with the columns, the line of the file and the cells of every row, so that nobody
/// need hold what he does not want; arguments and errors are those of [`Sheet::read`], but columns may bear one name.
pub(super) fn each_row(
    name: &str,
    text: &str,
    map: &Map,
    (is, header): (&str, &str),
    mut each: impl FnMut(&[units::Column], usize, &csv::StringRecord),
) -> Result<Vec<units::Column>, Error> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let Written { text, delimiter, has_decimal_commas } = Written::of(text).map_err(|uneven| {
        let Uneven { line, cells, columns } = uneven;
        Flaw::PartedBySpaces(cells, columns).at(format!("{name}:{line}"))
    })?;
    // Counted before any is read: one line may hold them all.
    let cells = text.bytes().filter(|byte| *byte == delimiter || *byte == b'\n').count();
    if cells > MOST_VALUES {
        return Err(too_much(name, cells));
    }
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let mut record = csv::StringRecord::new();
    let no_table =
        |error: csv::Error| Flaw::NoTable { is: is.to_owned(), why: error.to_string() }.at(name);
    if !reader.read_record(&mut record).map_err(no_table)? {
        return Err(Flaw::Empty { is: is.to_owned(), header: header.to_owned() }.at(name));
    }
    if record.len() > MOST_COLUMNS {
        let flaw = Flaw::TooManyColumns(record.len(), MOST_COLUMNS);
        return Err(flaw.at(format!("{name}:1")));
    }
    let mut columns = columns(name, &record, map)?;
    let mut is_first = true;
    while reader.read_record(&mut record).map_err(no_table)? {
        let line = record.position().map_or(0, |at| at.line() as usize);
        if record.len() == 1 && record.get(0).is_some_and(str::is_empty) {
            continue;
        }
        if record.len() != columns.len() {
            let flaw = Flaw::Ragged(record.len(), columns.len());
            return Err(flaw.at(format!("{name}:{line}")));
        }
        if has_decimal_commas {
            record = record.iter().map(|cell| cell.replacen(',', ".", 1)).collect();
        }
        if std::mem::take(&mut is_first) && is_words(&record) {
            let wrong = |cell| Flaw::SecondHeader(cell).at(format!("{name}:{line}"));
            take_units(&mut columns, &record).map_err(wrong)?;
            continue;
        }
        each(&columns, line, &record);
    }
    Ok(columns)
}

/// Reads the header.
fn columns(name: &str, header: &csv::StringRecord, map: &Map) -> Result<Vec<units::Column>, Error> {
    let headers: Vec<String> = header.iter().map(str::to_owned).collect();
    if let Some(theirs) = map.unused(&headers) {
        let flaw = Flaw::NotRenamed { theirs: theirs.to_owned(), headers };
        return Err(flaw.at(format!("{name}:1")));
    }
    let arrays = Arrays::among(&headers);
    let mut columns: Vec<units::Column> = Vec::with_capacity(headers.len());
    for (at, header) in headers.iter().enumerate() {
        let wrong = |error| Flaw::Header(error).at(format!("{name}:1, column `{header}`"));
        let column = if let Some((element, number)) = arrays.element(header) {
            let unit = element.unit.map(Unit::logged).transpose().map_err(wrong)?;
            map.of_element(header, (&element, number), unit)
        } else {
            // A header that the map knows as a whole need not be one of ours.
            let read = match units::parse_column(header) {
                Ok(column) => column,
                // The index of a table of pandas, or a comma at the end of each line.
                Err(_) if header.is_empty() => unnamed(at),
                Err(_) if map.knows(header) => units::Column { name: header.clone(), unit: None },
                Err(error) => return Err(wrong(error)),
            };
            map.apply(header, read).0
        };
        columns.push(column);
    }
    Ok(columns)
}

/// A column that bears no name is called by its place, `at` counted from 0.
fn unnamed(at: usize) -> units::Column {
    units::Column { name: format!("column_{}", at + 1), unit: None }
}

/// Returns whether cells say something and none of them is a number.
fn is_words(row: &csv::StringRecord) -> bool {
    row.iter().any(|cell| !cell.is_empty()) && row.iter().all(|cell| cell.parse::<f64>().is_err())
}

/// Takes the units of a second header line, bare or in brackets; where the first has one it is the same. Errors with the first cell
/// that is none, or another.
fn take_units(columns: &mut [units::Column], row: &csv::StringRecord) -> Result<(), String> {
    for (column, cell) in columns.iter_mut().zip(row).filter(|(_, cell)| !cell.is_empty()) {
        let read = Unit::logged(cell.trim_matches(['[', ']'])).ok();
        column.unit = read.filter(|unit| column.unit.is_none_or(|own| own == *unit));
        if column.unit.is_none() {
            return Err(cell.to_owned());
        }
    }
    Ok(())
}
