//! The text of a CSV file → columns with names and units, and rows of as many cells.
//!
//! What the cells mean is the business of whoever reads them: measurements over time (`table`), or points
//! and their pixels ([`crate::discovery::camera::points`]).

use std::collections::BTreeSet;

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
        Ok(Self { columns, rows })
    }
}

/// How a table is written.
struct Written {
    /// What stands between two cells.
    delimiter: u8,
    /// Whether a comma stands where others write a point.
    has_decimal_commas: bool,
}

impl Written {
    /// Semicolons stand between cells where the header has some and no comma. Then commas stand for points where no cell has a
    /// point: a table with both is read as it stands.
    fn of(text: &str) -> Self {
        let mut lines = text.lines().filter(|line| !line.starts_with('#') && !line.is_empty());
        let header = lines.next().unwrap_or_default();
        if !header.contains(';') || header.contains(',') {
            return Self { delimiter: b',', has_decimal_commas: false };
        }
        let has_decimal_commas = !lines.any(|line| line.contains('.'));
        Self { delimiter: b';', has_decimal_commas }
    }
}

/// Most columns of a table; a robot with every channel has a hundred.
const MOST_COLUMNS: usize = 200_000;

/// Reads a text and calls `each` with the columns, the line of the file and the cells of every row, so that nobody
/// need hold what he does not want; arguments and errors are those of [`Sheet::read`].
pub(super) fn each_row(
    name: &str,
    text: &str,
    map: &Map,
    (is, header): (&str, &str),
    mut each: impl FnMut(&[units::Column], usize, &csv::StringRecord),
) -> Result<Vec<units::Column>, Error> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    // Counted before any is read: one line may hold them all.
    let cells = text.bytes().filter(|byte| matches!(byte, b',' | b';' | b'\n')).count();
    if cells > MOST_VALUES {
        return Err(too_much(name, cells));
    }
    let Written { delimiter, has_decimal_commas } = Written::of(text);
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
    let mut columns: Vec<units::Column> = Vec::with_capacity(headers.len());
    let mut names: BTreeSet<String> = BTreeSet::new();
    for header in &headers {
        // A header that the map knows as a whole need not be one of ours.
        let read = match units::parse_column(header) {
            Ok(column) => column,
            Err(_) if map.knows(header) => units::Column { name: header.clone(), unit: None },
            Err(error) => {
                return Err(Flaw::Header(error).at(format!("{name}:1, column `{header}`")));
            }
        };
        let (column, _) = map.apply(header, read);
        if !names.insert(column.name.clone()) {
            return Err(Flaw::SameName(column.name).at(format!("{name}:1")));
        }
        columns.push(column);
    }
    Ok(columns)
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
