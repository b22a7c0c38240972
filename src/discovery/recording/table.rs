//! The text of a CSV file → columns in SI.

use crate::units::{self, Dimension, Unit};

use super::{BadCell, Column, Error, Map, Recording, Sidecar};

/// Fewest rows that say anything about change over time.
const LEAST_ROWS: usize = 3;

/// Reads the header and every row.
pub(super) fn read(
    name: &str,
    text: &str,
    sidecar: Sidecar,
    map: &Map,
) -> Result<Recording, Error> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let mut rows = reader.records();
    let not_a_table = |error: csv::Error| {
        Error::new(
            format!("not a table: {error}"),
            name,
            "a recording is a CSV file with one header line",
        )
    };
    let header = match rows.next() {
        Some(row) => row.map_err(not_a_table)?,
        None => {
            return Err(Error::new(
                "the file is empty",
                name,
                "a recording has a header line such as `t[s],q_1[rad]` and a row per sample",
            ));
        }
    };
    let headers: Vec<String> = header.iter().map(str::to_owned).collect();
    if let Some(theirs) = map.unused(&headers) {
        return Err(Error::new(
            format!("`--map` renames `{theirs}`, which is not a column"),
            format!("{name}:1"),
            format!("the columns are {}", headers.join(", ")),
        ));
    }
    let mut columns: Vec<Column> = Vec::with_capacity(headers.len());
    for header in &headers {
        // A header that the map knows as a whole need not be one of ours.
        let read = match units::parse_column(header) {
            Ok(column) => column,
            Err(_) if map.knows(header) => units::Column { name: header.clone(), unit: None },
            Err(error) => {
                return Err(Error::new(
                    error.to_string(),
                    format!("{name}:1, column `{header}`"),
                    "write `name[unit]`, or rename it with `--map 'THEIRS=OURS[unit]'`",
                ));
            }
        };
        let (column, _) = map.apply(header, read);
        if columns.iter().any(|other| other.name == column.name) {
            return Err(Error::new(
                format!("two columns are called `{}`", column.name),
                format!("{name}:1"),
                "rename one of them, in the file or with `--map`",
            ));
        }
        columns.push(Column {
            name: column.name,
            unit: column.unit,
            values: Vec::new(),
            bad: None,
        });
    }
    let clock = time_column(name, &columns)?;
    let mut lines: Vec<usize> = Vec::new();
    for row in rows {
        let row = row.map_err(not_a_table)?;
        let line = row.position().map_or(0, |at| at.line() as usize);
        if row.len() == 1 && row.get(0).is_some_and(str::is_empty) {
            continue;
        }
        if row.len() != columns.len() {
            return Err(Error::new(
                format!("the row has {} cells, the header {}", row.len(), columns.len()),
                format!("{name}:{line}"),
                "every row must have a cell per column; was the file cut off while being written?",
            ));
        }
        lines.push(line);
        for (column, cell) in columns.iter_mut().zip(row.iter()) {
            let factor = column.unit.map_or(1.0, |unit| unit.factor);
            let value = cell.parse::<f64>().unwrap_or(f64::NAN) * factor;
            if !value.is_finite() && column.bad.is_none() {
                column.bad = Some(BadCell { line, text: cell.to_owned() });
            }
            column.values.push(if value.is_finite() { value } else { f64::NAN });
        }
    }
    if lines.len() < LEAST_ROWS {
        let rows = match lines.len() {
            0 => "there are no rows".to_owned(),
            1 => "there is one row".to_owned(),
            n => format!("there are {n} rows"),
        };
        return Err(Error::new(
            format!("{rows}; nothing can be said from fewer than {LEAST_ROWS}"),
            name,
            "record for longer: a gap needs motion to show",
        ));
    }
    let time = columns.remove(clock);
    if let Some(bad) = &time.bad {
        return Err(Error::new(
            format!("`{}` is not a time", bad.text),
            format!("{name}:{}, column `t`", bad.line),
            "every row needs a finite time",
        ));
    }
    let mut notes = Vec::new();
    if time.unit.is_none() {
        notes.push(format!("{name}: `t` has no unit; seconds are assumed"));
    }
    let keep = increasing(name, &time.values, &columns, &lines)?;
    let dropped = keep.iter().filter(|keep| !**keep).count();
    if dropped > 0 {
        notes.push(format!("{name}: {dropped} rows repeat the one before them and are left out"));
    }
    let kept = |values: &[f64]| -> Vec<f64> {
        values.iter().zip(&keep).filter(|(_, keep)| **keep).map(|(value, _)| *value).collect()
    };
    let time = kept(&time.values);
    if time.len() < LEAST_ROWS {
        return Err(Error::new(
            format!("only {} rows differ", time.len()),
            name,
            "record while the machine moves",
        ));
    }
    let columns = columns.into_iter().map(|c| Column { values: kept(&c.values), ..c }).collect();
    let recording = Recording { name: name.into(), time, columns, sidecar, notes };
    told(recording)
}

/// Finds the time among the columns.
fn time_column(name: &str, columns: &[Column]) -> Result<usize, Error> {
    let Some(clock) = columns.iter().position(|column| column.name == "t") else {
        let first = columns.first().map_or("", |column| column.name.as_str());
        return Err(Error::new(
            "there is no time column `t[s]`",
            format!("{name}:1"),
            format!("if time is another column, say so: `--map '{first}=t[s]'`"),
        ));
    };
    if let Some(unit) = columns[clock].unit
        && unit.dimension != Dimension::TIME
    {
        return Err(Error::new(
            format!("`t` is in {}, which is not a time", unit.dimension.si()),
            format!("{name}:1, column `t`"),
            "write `t[s]` or `t[ms]`",
        ));
    }
    Ok(clock)
}

/// Says which rows to keep: a row that repeats the one before it, time included, is a logger's stutter.
fn increasing(
    name: &str,
    time: &[f64],
    columns: &[Column],
    lines: &[usize],
) -> Result<Vec<bool>, Error> {
    let mut keep = vec![true; time.len()];
    for i in 1..time.len() {
        if time[i] > time[i - 1] {
            continue;
        }
        let same = |column: &Column| column.values[i].to_bits() == column.values[i - 1].to_bits();
        let place = format!("{name}:{}, column `t`", lines[i]);
        if time[i] < time[i - 1] {
            return Err(Error::new(
                format!("time goes back from {} s to {} s", time[i - 1], time[i]),
                place,
                "sort the rows by time; if the clock was reset, cut the file there",
            ));
        }
        if !columns.iter().all(same) {
            return Err(Error::new(
                format!("two different rows are of the same time, {} s", time[i]),
                place,
                "give each row its own time; is the time rounded too coarsely?",
            ));
        }
        keep[i] = false;
    }
    Ok(keep)
}

/// Checks the units of the names that an arm's recording gives a meaning, and notes gaps in time.
fn told(mut recording: Recording) -> Result<Recording, Error> {
    for column in &recording.columns {
        let Some(expected) = meaning(&column.name) else { continue };
        match column.unit {
            Some(Unit { dimension, .. }) if dimension != expected => {
                return Err(Error::new(
                    format!(
                        "column `{}` is in {}, but it must be {}",
                        column.name,
                        dimension.si(),
                        expected.words()
                    ),
                    format!("{}:1, column `{}`", recording.name, column.name),
                    format!(
                        "write `{}[{}]`, or correct it with `--map`",
                        column.name,
                        expected.si()
                    ),
                ));
            }
            _ => {}
        }
    }
    let step = recording.step();
    let gaps = recording.time.windows(2).filter(|pair| pair[1] - pair[0] > 5.0 * step).count();
    if gaps > 0 {
        let note = format!("{}: time jumps in {gaps} places", recording.name);
        recording.notes.push(note);
    }
    Ok(recording)
}

/// Returns what a column of an arm's recording measures: `q_1` an angle, `tcp_x` a length.
fn meaning(name: &str) -> Option<Dimension> {
    if let "tcp_x" | "tcp_y" | "tcp_z" | "object_x" | "object_y" | "object_z" | "gripper" = name {
        return Some(Dimension::LENGTH);
    }
    let (stem, number) = name.rsplit_once('_')?;
    number.parse::<usize>().ok()?;
    Some(match stem {
        "q_cmd" | "q" => Dimension::ANGLE,
        "dq" | "dq_cmd" => Dimension::ANGULAR_SPEED,
        "tau" => Dimension::TORQUE,
        "current" => Dimension::CURRENT,
        _ => return None,
    })
}
