//! Tables that `robot fk | ik | dynamics` are given: comma-separated values → joint positions, or poses.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use crate::motion::Error;
use crate::motion::robot::Robot;
use crate::units::{self, Unit};
use crate::world::frame::{Base, Flange, Pose};

/// Places and sizes are taken up to this, m: no arm is moved in a space larger than that, and no number of this
/// size is lost in another's rounding.
pub(super) const FARTHEST: f64 = 1e3;

/// A quaternion's length may be off from 1 by this. Chosen: four numbers rounded to two decimals are off by no more.
const OFF_UNIT: f64 = 1e-2;

/// Refuses a quaternion, whose numbers are called `names`, that is not of length 1: it is no rotation, or not the one that was meant.
///
/// # Errors
///
/// What is wrong with it, in words.
pub(super) fn check_turn(names: &str, turn: &Quaternion<f64>) -> Result<(), String> {
    let length = turn.norm();
    if (length - 1.0).abs() > OFF_UNIT {
        return Err(format!("the quaternion {names} has length {length:.4}, not 1"));
    }
    Ok(())
}

/// Reads rows of numbers: comma-separated values, one row a line, with or without a header line. With a
/// header, the columns named in `columns` are taken (units in brackets may follow a name, `q_1[deg]`); without, or
/// when the header has none of these names, there must be just so many columns. Blank lines and `#` lines
/// are passed over.
///
/// # Errors
///
/// [`Error::Input`] with the line of what is wrong.
pub fn rows(text: &str, columns: &[&str]) -> Result<Vec<Vec<f64>>, Error> {
    let fail = |what: String| Err(Error::Input { what });
    let mut picks: Option<Vec<(usize, f64)>> = None;
    let mut rows = Vec::new();
    let text = text.trim_start_matches('\u{feff}');
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let header = rows.is_empty()
            && picks.is_none()
            && cells.iter().all(|cell| cell.parse::<f64>().is_err());
        if header {
            let names: Vec<&str> =
                cells.iter().map(|cell| cell.split('[').next().unwrap_or(cell).trim()).collect();
            let found: Vec<usize> = columns
                .iter()
                .filter_map(|wanted| names.iter().position(|name| same_name(name, wanted)))
                .collect();
            let found = match found.len() {
                n if n == columns.len() => found,
                0 if names.len() == columns.len() => (0..columns.len()).collect(),
                _ => {
                    return fail(format!(
                        "line {}: the header needs the columns {}",
                        index + 1,
                        columns.join(", ")
                    ));
                }
            };
            let mut scaled = Vec::with_capacity(found.len());
            for column in found {
                match factor(cells[column]) {
                    Ok(factor) => scaled.push((column, factor)),
                    Err(error) => return fail(format!("line {}: {error}", index + 1)),
                }
            }
            picks = Some(scaled);
            continue;
        }
        let picked: Vec<(usize, f64)> =
            picks.clone().unwrap_or_else(|| (0..cells.len()).map(|column| (column, 1.0)).collect());
        if picks.is_none() && cells.len() != columns.len() {
            return fail(format!(
                "line {}: {} numbers where {} are needed ({})",
                index + 1,
                cells.len(),
                columns.len(),
                columns.join(", ")
            ));
        }
        let mut row = Vec::with_capacity(picked.len());
        for &(column, factor) in &picked {
            let Some(cell) = cells.get(column) else {
                return fail(format!("line {}: it has only {} columns", index + 1, cells.len()));
            };
            match cell.parse::<f64>() {
                Ok(value) if value.is_finite() => row.push(value * factor),
                _ => return fail(format!("line {}: {cell:?} is not a finite number", index + 1)),
            }
        }
        rows.push(row);
    }
    if rows.is_empty() {
        return fail("there are no numbers in it".into());
    }
    Ok(rows)
}

/// Returns what numbers below a header are multiplied by to be in SI: 1 where it has no unit.
fn factor(header: &str) -> Result<f64, units::Error> {
    let unit = header.split_once('[').map(|(_, rest)| rest.trim_end_matches(']'));
    Ok(unit.map(Unit::parse).transpose()?.map_or(1.0, |unit| unit.of(1.0).value))
}

/// Reads rows of joint positions for a robot: columns `q1` … `qn` (or `q_1[deg]`), in rad (m for what slides).
///
/// # Errors
///
/// As [`rows`].
pub fn joint_rows(robot: &Robot, text: &str) -> Result<Vec<Vec<f64>>, Error> {
    let names: Vec<String> = (1..=robot.n_joints()).map(|i| format!("q{i}")).collect();
    rows(text, &names.iter().map(String::as_str).collect::<Vec<_>>())
}

/// Reads rows of poses: columns `x`, `y`, `z` (m), `qw`, `qx`, `qy`, `qz`.
///
/// # Errors
///
/// As [`rows`], and for a quaternion that is no rotation.
pub fn pose_rows(text: &str) -> Result<Vec<Pose<Base, Flange>>, Error> {
    rows(text, &["x", "y", "z", "qw", "qx", "qy", "qz"])?
        .iter()
        .enumerate()
        .map(|(index, row)| {
            if let Some(far) = row[..3].iter().find(|x| x.abs() > FARTHEST) {
                let what = format!(
                    "pose {}: it is at {far:?} m; up to {FARTHEST} m from the base can be",
                    index + 1
                );
                return Err(Error::Input { what });
            }
            let q = Quaternion::new(row[3], row[4], row[5], row[6]);
            check_turn("qw, qx, qy, qz", &q).map_err(|fault| {
                let what = format!("pose {}: {fault}", index + 1);
                Error::Input { what }
            })?;
            Ok(Pose::new(Isometry3::from_parts(
                Translation3::new(row[0], row[1], row[2]),
                UnitQuaternion::from_quaternion(q),
            )))
        })
        .collect()
}

/// Whether a column's name is the wanted one, up to case, `_`, and a leading `p` for positions.
fn same_name(name: &str, wanted: &str) -> bool {
    let plain = |s: &str| s.to_lowercase().replace('_', "");
    let (name, wanted) = (plain(name), plain(wanted));
    name == wanted || name == format!("p{wanted}")
}
