//! A table of text → columns in SI, a recording for each run.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use crate::units::{Dimension, Unit};

use super::sheet::each_row;
use super::{BadCell, Column, Error, FINEST, Flaw, LATEST, Map, Recording, Sidecar, wording};
use crate::plain::shortened;

/// Fewest rows that say anything about change over time.
const LEAST_ROWS: usize = 3;

/// Reads every row; where the clock starts again, a new recording begins.
pub(super) fn read(
    name: &str,
    text: &str,
    sidecar: &Sidecar,
    map: &Map,
) -> Result<Vec<Recording>, Error> {
    let (mut columns, lines) = columns(name, text, map)?;
    let blank = leave_out_blank(&mut columns);
    let several = columns.iter().filter(|column| column.is_one_of_several);
    let several: Vec<String> = several.map(|column| column.name.clone()).collect();
    let has = |stem: &str| columns.iter().any(|column| column.name == stem);
    let is_poses = !has("t") && has("q_1") && (has("tcp_x") || has("tau_1"));
    if is_poses {
        // Poses have no order: which row it is does for a time.
        let values = (0..lines.len()).map(|row| row as f64).collect();
        let (unit, bad) = (None, Vec::new());
        let (name, n_bad, is_one_of_several) = ("t".into(), 0, false);
        columns.push(Column { name, unit, values, bad, n_bad, is_one_of_several });
    }
    let clock = time_column(name, &columns)?;
    let time = columns.remove(clock);
    check_time(name, &time, &lines)?;
    let runs = runs(&time.values);
    let n = runs.len();
    if n > MOST_RUNS {
        return Err(Flaw::TooManyRuns(n - 1, MOST_RUNS).at(format!("{name}, column `t`")));
    }
    let mut recordings = Vec::with_capacity(n);
    for (i, rows) in runs.into_iter().enumerate() {
        let name = if n == 1 { name.to_owned() } else { wording::run_of(name, i + 1, n) };
        let (time, lines) = (&time.values[rows.clone()], &lines[rows.clone()]);
        let cut = if n == 1 {
            std::mem::take(&mut columns)
        } else {
            columns.iter().map(|column| part(column, rows.clone(), lines)).collect()
        };
        recordings.push(one(&name, time, cut, lines, sidecar)?);
    }
    let mut notes = Vec::new();
    if !blank.is_empty() {
        notes.push(wording::blank(name, &blank));
    }
    if !several.is_empty() {
        notes.push(wording::one_of_several(name, &several));
    }
    if is_poses {
        notes.push(wording::rows_are_poses(name));
    } else if time.unit.is_none() {
        notes.push(wording::seconds_assumed(name));
    }
    if n > 1 {
        let rows = || recordings.iter().map(Recording::n_rows);
        let (least, most) = (rows().min().unwrap_or(0), rows().max().unwrap_or(0));
        notes.push(wording::several_runs(name, n, least, most));
    }
    recordings[0].notes.splice(0..0, notes);
    Ok(recordings)
}

/// Most runs in one file.
const MOST_RUNS: usize = 100;

/// Cells of a column that are kept as they are written, where they are no numbers: of each run the first few are
/// told.
const KEPT: usize = 10_000;

/// Reads every column into SI, and the line of each row.
fn columns(name: &str, text: &str, map: &Map) -> Result<(Vec<Column>, Vec<usize>), Error> {
    let mut lines = Vec::new();
    let mut values: Vec<Vec<f64>> = Vec::new();
    let mut bad: Vec<Vec<BadCell>> = Vec::new();
    let mut n_kept = 0;
    let is = ("a recording is", "t[s],q_1[rad]");
    let columns = each_row(name, text, map, is, |columns, line, row| {
        values.resize(columns.len(), Vec::new());
        bad.resize(columns.len(), Vec::new());
        for (at, (cell, column)) in row.iter().zip(columns).enumerate() {
            let factor = column.unit.map_or(1.0, |unit| unit.factor);
            let value = cell.parse::<f64>().map_or(f64::NAN, |v| v * factor);
            let is_finite = value.is_finite();
            values[at].push(if is_finite { value } else { f64::NAN });
            if !is_finite && (n_kept < KEPT || bad[at].is_empty()) {
                n_kept += 1;
                bad[at].push(BadCell { line, text: shortened(cell, LONGEST_CELL).into_owned() });
            }
        }
        lines.push(line);
    })?;
    values.resize(columns.len(), Vec::new());
    bad.resize(columns.len(), Vec::new());
    let columns = columns.into_iter().zip(values).zip(bad).map(|((column, values), bad)| {
        let n_bad = values.iter().filter(|value| value.is_nan()).count();
        let (name, unit) = (column.name, column.unit);
        Column { name, unit, values, bad, n_bad, is_one_of_several: false }
    });
    Ok((each_name_once(name, columns.collect())?, lines))
}

/// Leaves one column of several that bear one name, marked: whoever asks for it is told. A clock, and what a name says of an arm, is
/// asked for by everyone, so of that there may be one only.
fn each_name_once(name: &str, columns: Vec<Column>) -> Result<Vec<Column>, Error> {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for column in &columns {
        *counts.entry(column.name.clone()).or_default() += 1;
    }
    let is_several = |column: &Column| counts.get(&column.name).is_some_and(|count| *count > 1);
    let mut kept: Vec<Column> = Vec::with_capacity(columns.len());
    let mut told: BTreeSet<String> = BTreeSet::new();
    for mut column in columns {
        if is_several(&column) {
            if column.name == "t" || meaning(&column.name).is_some() {
                return Err(Flaw::SameName(column.name).at(format!("{name}:1")));
            }
            column.is_one_of_several = true;
            if !told.insert(column.name.clone()) {
                continue;
            }
        }
        kept.push(column);
    }
    Ok(kept)
}

/// Leaves out what an arm's recording has columns for and does not say: columns without a number, if all of their kind are (`q_1`
/// and `q_2`, `tcp_x` and `tcp_y`), and all speeds, which a motion can do without, if one is. Returns their names.
fn leave_out_blank(columns: &mut Vec<Column>) -> Vec<String> {
    let mut kinds: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    for column in columns.iter() {
        let (all, blank) = kinds.entry(kind(&column.name)).or_default();
        *all += 1;
        *blank += usize::from(column.is_blank());
    }
    let is_left_out = |column: &Column| {
        let kind = kind(&column.name);
        let (all, blank) = kinds.get(kind).copied().unwrap_or_default();
        let is_known = meaning(&column.name).is_some() || column.name == "mass";
        is_known && blank > 0 && (blank == all || kind == "dq")
    };
    let left_out: Vec<bool> = columns.iter().map(is_left_out).collect();
    let (mut left, mut names) = (left_out.iter(), Vec::new());
    columns.retain(|column| {
        let is_left_out = left.next().is_some_and(|is_left_out| *is_left_out);
        names.extend(is_left_out.then(|| column.name.clone()));
        !is_left_out
    });
    names
}

/// Returns the name that columns of a kind share: `tau` of `tau_4`.
fn kind(name: &str) -> &str {
    let is_one = |end: &str| end.parse::<usize>().is_ok() || matches!(end, "x" | "y" | "z");
    name.rsplit_once('_').filter(|(_, end)| is_one(end)).map_or(name, |(kind, _)| kind)
}

/// Characters of a cell that are told.
const LONGEST_CELL: usize = 60;

/// Returns the rows of a column that are one run's, `lines` their lines in the file.
fn part(column: &Column, rows: Range<usize>, lines: &[usize]) -> Column {
    let values = column.values[rows].to_vec();
    let n_bad = values.iter().filter(|value| value.is_nan()).count();
    let is_inside =
        |bad: &&BadCell| lines.first() <= Some(&bad.line) && Some(&bad.line) <= lines.last();
    let mut bad: Vec<BadCell> = column.bad.iter().filter(is_inside).cloned().collect();
    if bad.is_empty() && n_bad > 0 {
        // One of very many, and not kept as it was written.
        let row = values.iter().position(|value| value.is_nan()).unwrap_or(0);
        bad.push(BadCell { line: lines[row], text: "…".into() });
    }
    let (name, unit) = (column.name.clone(), column.unit);
    Column { name, unit, values, bad, n_bad, is_one_of_several: column.is_one_of_several }
}

/// Refuses a clock that shows what no clock shows.
fn check_time(name: &str, time: &Column, lines: &[usize]) -> Result<(), Error> {
    if let Some(bad) = time.bad.first() {
        let flaw = Flaw::NotATime(bad.text.clone());
        return Err(flaw.at(format!("{name}:{}, column `t`", bad.line)));
    }
    match time.values.iter().position(|t| t.abs() > LATEST) {
        Some(row) => {
            let flaw = Flaw::NoClockShows(time.values[row], LATEST);
            Err(flaw.at(format!("{name}:{}, column `t`", lines[row])))
        }
        None => Ok(()),
    }
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
        return Err(Flaw::TooFewRows { n: time.len(), least: LEAST_ROWS }.at(name));
    }
    let mut notes = Vec::new();
    let keep = increasing(name, time, &columns, lines)?;
    let dropped = keep.iter().filter(|keep| !**keep).count();
    if dropped > 0 {
        notes.push(wording::rows_repeat(name, dropped));
    }
    let kept = |values: &[f64]| -> Vec<f64> {
        values.iter().zip(&keep).filter(|(_, keep)| **keep).map(|(value, _)| *value).collect()
    };
    let time = kept(time);
    if time.len() < LEAST_ROWS {
        return Err(Flaw::TooFewDiffer(time.len()).at(name));
    }
    let columns = columns.into_iter().map(|c| Column { values: kept(&c.values), ..c }).collect();
    let lines = lines.iter().zip(&keep).filter(|(_, keep)| **keep).map(|(line, _)| *line).collect();
    told(Recording { name: name.into(), time, lines, columns, sidecar: sidecar.clone(), notes })
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
fn time_column(name: &str, columns: &[Column]) -> Result<usize, Error> {
    let Some(clock) = columns.iter().position(|column| column.name == "t") else {
        let first = columns.first().map(|column| column.name.clone());
        return Err(Flaw::NoClock(first.unwrap_or_default()).at(format!("{name}:1")));
    };
    if let Some(unit) = columns[clock].unit
        && unit.dimension != Dimension::TIME
    {
        let flaw = Flaw::ClockUnit { is: unit.dimension };
        return Err(flaw.at(format!("{name}:1, column `t`")));
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
            return Err(Flaw::GoesBack(time[i - 1], time[i]).at(place));
        }
        if !columns.iter().all(same) {
            return Err(Flaw::SameTime(time[i]).at(place));
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
            // Which joints slide is known to whoever has the robot.
            Some(Unit { dimension, .. })
                if dimension != expected && expected.of_sliding() != Some(dimension) =>
            {
                let name = column.name.clone();
                let flaw = Flaw::ColumnUnit { name, is: dimension, expected };
                return Err(flaw.at(format!("{}:1, column `{}`", recording.name, column.name)));
            }
            _ => {}
        }
    }
    let step = recording.step();
    if step < FINEST {
        return Err(Flaw::TooFine(step).at(format!("{}, column `t`", recording.name)));
    }
    let gaps = recording.time.windows(2).filter(|pair| pair[1] - pair[0] > 5.0 * step).count();
    if gaps > 0 {
        let note = wording::time_jumps(&recording.name, gaps);
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

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(csv: &str) -> Result<Recording, Error> {
        Recording::read("r.csv", csv, None, &Map::default())
    }

    #[test]
    fn several_columns_of_one_name_stop_whoever_asks_for_one() {
        let recording = asked("t[s],u[V],i[mA],i[mA]\n0,1,2,3\n1,2,3,4\n2,3,4,5\n").unwrap();
        assert!(recording.column("u", Dimension::VOLTAGE).is_ok());
        let told = recording.column("i", Dimension::CURRENT).unwrap_err();
        assert!(told.what.contains("two columns are called `i`"), "{told:?}");
        let notes = recording.notes.join("; ");
        assert!(notes.contains("several columns bear one name: `i`"), "{notes}");
        let clocks = asked("t[s],u,t[ms]\n0,1,0\n1,2,1000\n2,3,2000\n").unwrap_err();
        assert!(clocks.what.contains("two columns are called `t`"), "{clocks:?}");
    }

    #[test]
    fn a_stamp_is_told_which_form_would_do() {
        let stamped =
            "t[s],u\n2026-01-01T10:00:00.0,1\n2026-01-01T10:00:01.0,2\n2026-01-01T10:00:02.0,3\n";
        let told = asked(stamped).unwrap_err();
        assert!(told.help.contains("seconds since the first row"), "{told:?}");
        let other = asked("t[s],u\n0,1\nsoon,2\n2,3\n").unwrap_err();
        assert!(other.help.contains("finite time"), "{other:?}");
    }
}
