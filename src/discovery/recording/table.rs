//! A table of text → columns in SI, a recording for each run.

use std::ops::Range;

use crate::units::{self, Dimension, Unit};

use super::sheet::Sheet;
use super::{BadCell, Column, Error, Map, Recording, Sidecar};

/// Fewest rows that say anything about change over time.
const LEAST_ROWS: usize = 3;

/// Reads every row; where the clock starts again, a new recording begins.
pub(super) fn read(
    name: &str,
    text: &str,
    sidecar: &Sidecar,
    map: &Map,
) -> Result<Vec<Recording>, Error> {
    let sheet = Sheet::read(name, text, map, ("a recording is", "t[s],q_1[rad]"))?;
    let clock = time_column(name, &sheet.columns)?;
    let cells = |at: usize| sheet.rows.iter().map(move |(_, row)| row.get(at).unwrap_or_default());
    let mut columns: Vec<Column> = sheet
        .columns
        .iter()
        .enumerate()
        .map(|(at, column)| {
            let factor = column.unit.map_or(1.0, |unit| unit.factor);
            let value = |cell: &str| cell.parse::<f64>().map_or(f64::NAN, |v| v * factor);
            let values = cells(at).map(value).map(|v| if v.is_finite() { v } else { f64::NAN });
            let (name, unit) = (column.name.clone(), column.unit);
            Column { name, unit, values: values.collect(), bad: Vec::new() }
        })
        .collect();
    for (at, column) in columns.iter_mut().enumerate() {
        let read = sheet.rows.iter().zip(&column.values).filter(|(_, value)| value.is_nan());
        let bad = read.map(|((line, row), _)| BadCell {
            line: *line,
            text: row.get(at).unwrap_or_default().to_owned(),
        });
        column.bad = bad.collect();
    }
    let lines: Vec<usize> = sheet.rows.iter().map(|(line, _)| *line).collect();
    let time = columns.remove(clock);
    if let Some(bad) = time.bad.first() {
        return Err(Error::new(
            format!("`{}` is not a time", bad.text),
            format!("{name}:{}, column `t`", bad.line),
            "every row needs a finite time",
        ));
    }
    let runs = runs(&time.values);
    let n = runs.len();
    let mut recordings = Vec::with_capacity(n);
    for (i, rows) in runs.into_iter().enumerate() {
        let name = if n == 1 { name.to_owned() } else { format!("{name}, run {} of {n}", i + 1) };
        let within = lines.get(rows.start).copied().unwrap_or(0)
            ..lines.get(rows.end).copied().unwrap_or(usize::MAX);
        let cut = columns.iter().map(|column| Column {
            values: column.values[rows.clone()].to_vec(),
            bad: column.bad.iter().filter(|bad| within.contains(&bad.line)).cloned().collect(),
            name: column.name.clone(),
            unit: column.unit,
        });
        let (time, lines) = (&time.values[rows.clone()], &lines[rows.clone()]);
        recordings.push(one(&name, time, cut.collect(), lines, sidecar)?);
    }
    let mut notes = Vec::new();
    if time.unit.is_none() {
        notes.push(format!("{name}: `t` has no unit; seconds are assumed"));
    }
    if n > 1 {
        let rows = || recordings.iter().map(Recording::n_rows);
        let (least, most) = (rows().min().unwrap_or(0), rows().max().unwrap_or(0));
        notes.push(format!(
            "{name}: its clock starts again, so it is read as {n} recordings of {least} to {most} rows"
        ));
    }
    recordings[0].notes.splice(0..0, notes);
    Ok(recordings)
}

/// Makes a recording of the rows of one run.
fn one(
    name: &str,
    time: &[f64],
    columns: Vec<Column>,
    lines: &[usize],
    sidecar: &Sidecar,
) -> Result<Recording, Error> {
    if time.len() < LEAST_ROWS {
        let rows = match time.len() {
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
    let mut notes = Vec::new();
    let keep = increasing(name, time, &columns, lines)?;
    let dropped = keep.iter().filter(|keep| !**keep).count();
    if dropped > 0 {
        notes.push(format!("{name}: {dropped} rows repeat the one before them and are left out"));
    }
    let kept = |values: &[f64]| -> Vec<f64> {
        values.iter().zip(&keep).filter(|(_, keep)| **keep).map(|(value, _)| *value).collect()
    };
    let time = kept(time);
    if time.len() < LEAST_ROWS {
        return Err(Error::new(
            format!("only {} rows differ", time.len()),
            name,
            "record while the machine moves",
        ));
    }
    let columns = columns.into_iter().map(|c| Column { values: kept(&c.values), ..c }).collect();
    told(Recording { name: name.into(), time, columns, sidecar: sidecar.clone(), notes })
}

/// Fewest rows of a run before its clock starts again: fewer are rows in disorder.
const LEAST_RUN: usize = 10;
/// A clock that starts again begins where it began before, to this part of the run, or earlier, where the
/// first rows of that run were left out.
const NEAR: f64 = 0.1;

/// The rows of each run: a logger that writes several runs into one file starts its clock again with each.
/// A single row out of order is none: after it time goes on where it was. Nor are two halves that were
/// exchanged: the second ends where the first begins.
fn runs(time: &[f64]) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut from = 0;
    for i in 1..time.len() {
        let (begin, before) = (time[from], time[i - 1]);
        if time[i] >= before || i - from < LEAST_RUN {
            continue;
        }
        let near = NEAR * (before - begin);
        let rises = time[i..].windows(2).take_while(|pair| pair[1] >= pair[0]).count();
        let passes = time[i + rises] > begin + near;
        let goes_on = rises + 1 >= LEAST_ROWS && time[i + LEAST_ROWS - 1] < before;
        let again = (time[i] - begin).abs() < near || time[i] < begin && passes;
        if again && goes_on {
            runs.push(from..i);
            from = i;
        }
    }
    runs.push(from..time.len());
    runs
}

/// Finds the time among the columns.
fn time_column(name: &str, columns: &[units::Column]) -> Result<usize, Error> {
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
                "sort the rows by time; a clock that starts again for another run goes back to where it began",
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
