//! The tables that the alignment commands read, as in `INTERFACES.md`: pairs of pixels, points with pixels
//! and views, pairs of points.
//!
//! A table is CSV with one header line, columns `name[unit]` in any order. Lengths may be in m, cm, mm or
//! in and come out in m; pixels in px. A column that is not asked for is ignored. Rows are counted from 1
//! in messages, the header not counted, as a person sees them.

use std::collections::BTreeMap;
use std::fmt::Write;

use nalgebra::Vector3;

use super::image_map;
use super::intrinsics::View;
use super::offset;
use crate::world::{Pixel, Point, Pose, frame};

/// Why a table cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The text is not CSV.
    #[error("row {row}: {why}")]
    Csv {
        /// Which row, from 1; 0 for the header.
        row: usize,
        /// What the CSV reader says.
        why: String,
    },
    /// There are no rows.
    #[error("the table is empty: expected a header `{expected}` and rows below it")]
    Empty {
        /// The header expected.
        expected: String,
    },
    /// A column is missing.
    #[error("no column `{column}`; the header has {found}; expected `{expected}`")]
    MissingColumn {
        /// The name that is missing.
        column: &'static str,
        /// The columns found.
        found: String,
        /// The header expected.
        expected: String,
    },
    /// Two columns have the same name.
    #[error("column `{column}` stands in the header twice")]
    TwiceColumn {
        /// The name.
        column: String,
    },
    /// A column has no unit, or not one of its kind.
    #[error("column `{column}` {found}; write `{column}[{expected}]`")]
    Unit {
        /// The column.
        column: &'static str,
        /// What its unit is.
        found: String,
        /// The unit to write.
        expected: &'static str,
    },
    /// A cell is not a number.
    #[error("row {row}, column `{column}`: `{text}` is not a finite number")]
    Cell {
        /// Which row, from 1.
        row: usize,
        /// Which column.
        column: &'static str,
        /// What stands there.
        text: String,
    },
    /// The extrinsics file is not as expected.
    #[error(
        "the extrinsics are not readable: {why}; expected \
         {{\"VIEW\": {{\"xyz_m\": [x, y, z], \"quat_wxyz\": [w, x, y, z]}}, ..}}"
    )]
    Extrinsics {
        /// What is wrong.
        why: String,
    },
    /// What stands under a view is no pose.
    #[error(
        "the extrinsics are not readable: view `{view}` is not a pose; expected \
         {{\"VIEW\": {{\"xyz_m\": [x, y, z], \"quat_wxyz\": [w, x, y, z]}}, ..}}"
    )]
    NoPose {
        /// The view's name.
        view: String,
    },
    /// A view has no extrinsics while others have.
    #[error("view `{view}` has no `world_from_camera` in the extrinsics; they have {found}")]
    MissingView {
        /// The view.
        view: String,
        /// The views in the file.
        found: String,
    },
}

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Pixel,
    Length,
}

impl Kind {
    fn unit(self) -> &'static str {
        match self {
            Self::Pixel => "px",
            Self::Length => "m",
        }
    }

    /// Returns the factor to SI, `None` for another kind's unit.
    fn factor(self, unit: &str) -> Option<f64> {
        match (self, unit) {
            (Self::Pixel, "px") | (Self::Length, "m") => Some(1.0),
            (Self::Length, "cm") => Some(0.01),
            (Self::Length, "mm") => Some(0.001),
            (Self::Length, "in") => Some(0.0254),
            _ => None,
        }
    }
}

type Column = (&'static str, Kind);

fn header(columns: &[Column]) -> String {
    let mut text = String::new();
    for (i, (name, kind)) in columns.iter().enumerate() {
        let comma = if i > 0 { "," } else { "" };
        write!(text, "{comma}{name}[{}]", kind.unit()).expect("writing to a string cannot fail");
    }
    text
}

/// A column's name and unit: `u[px]` is `u` in `px`.
fn split(cell: &str) -> (&str, Option<&str>) {
    let cell = cell.trim();
    match cell.split_once('[') {
        Some((name, unit)) => (name.trim(), unit.strip_suffix(']').map(str::trim)),
        None => (cell, None),
    }
}

/// The numbers of a table in SI, a row each in the order of `columns`, and the text of column `label`.
struct Table {
    rows: Vec<Vec<f64>>,
    labels: Option<Vec<String>>,
}

fn read(text: &str, columns: &[Column], label: Option<&str>) -> Result<Table, Error> {
    // A byte order mark, as spreadsheets write it, is no part of the first name.
    let text = text.trim_start_matches('\u{feff}');
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let found = reader.headers().map_err(|e| Error::Csv { row: 0, why: e.to_string() })?.clone();
    if found.iter().all(str::is_empty) {
        return Err(Error::Empty { expected: header(columns) });
    }
    let mut at: BTreeMap<&str, (usize, Option<&str>)> = BTreeMap::new();
    for (i, cell) in found.iter().enumerate() {
        let (name, unit) = split(cell);
        if at.insert(name, (i, unit)).is_some() {
            return Err(Error::TwiceColumn { column: name.to_string() });
        }
    }
    let mut places = Vec::new();
    for &(column, kind) in columns {
        let Some(&(place, unit)) = at.get(column) else {
            let found: Vec<String> = found.iter().map(|c| format!("`{c}`")).collect();
            let found = found.join(", ");
            return Err(Error::MissingColumn { column, found, expected: header(columns) });
        };
        let factor = unit.and_then(|unit| kind.factor(unit)).ok_or_else(|| Error::Unit {
            column,
            found: unit.map_or("has no unit".to_string(), |u| format!("is in `{u}`")),
            expected: kind.unit(),
        })?;
        places.push((column, place, factor));
    }
    let label = label.and_then(|label| at.get(label)).map(|(place, _)| *place);
    let mut table = Table { rows: Vec::new(), labels: label.map(|_| Vec::new()) };
    for (i, record) in reader.records().enumerate() {
        let row = i + 1;
        let record = record.map_err(|e| Error::Csv { row, why: e.to_string() })?;
        let mut numbers = Vec::with_capacity(places.len());
        for &(column, place, factor) in &places {
            let cell = record.get(place).unwrap_or_default();
            match cell.parse::<f64>() {
                Ok(value) if value.is_finite() => numbers.push(value * factor),
                _ => return Err(Error::Cell { row, column, text: cell.to_string() }),
            }
        }
        table.rows.push(numbers);
        if let (Some(labels), Some(place)) = (&mut table.labels, label) {
            labels.push(record.get(place).unwrap_or_default().to_string());
        }
    }
    if table.rows.is_empty() {
        return Err(Error::Empty { expected: header(columns) });
    }
    Ok(table)
}

/// Reads the pairs of regression 1: `u_x[px],u_y[px],v_x[px],v_y[px]`, real pixel and twin pixel.
///
/// # Errors
///
/// [`Error`], saying which row and column.
pub fn read_map_pairs(text: &str) -> Result<Vec<image_map::Pair>, Error> {
    Ok(read_ranked_pairs(text)?.0)
}

/// Reads the pairs of regression 1, and what stands in a column `score` where there is one: the higher, the likelier right.
///
/// # Errors
///
/// [`Error`], saying which row and column.
pub fn read_ranked_pairs(text: &str) -> Result<(Vec<image_map::Pair>, Option<Vec<f64>>), Error> {
    let columns = ["u_x", "u_y", "v_x", "v_y"].map(|name| (name, Kind::Pixel));
    let table = read(text, &columns, Some("score"))?;
    let pair = |r: &Vec<f64>| image_map::Pair {
        real: Pixel::new(r[0], r[1]),
        twin: Pixel::new(r[2], r[3]),
    };
    let score = |(i, text): (usize, &String)| match text.parse::<f64>() {
        Ok(score) if score.is_finite() => Ok(score),
        _ => Err(Error::Cell { row: i + 1, column: "score", text: text.clone() }),
    };
    let scores = table.labels.as_ref().map(|all| all.iter().enumerate().map(score).collect());
    Ok((table.rows.iter().map(pair).collect(), scores.transpose()?))
}

/// Reads the pairs of regression 3: `xs[m],ys[m],zs[m],xr[m],yr[m],zr[m]`.
///
/// # Errors
///
/// [`Error`], saying which row and column.
pub fn read_offset_pairs(text: &str) -> Result<Vec<offset::Pair>, Error> {
    let columns = ["xs", "ys", "zs", "xr", "yr", "zr"].map(|name| (name, Kind::Length));
    let table = read(text, &columns, None)?;
    let pair = |r: &Vec<f64>| offset::Pair {
        said: Vector3::new(r[0], r[1], r[2]),
        real: Vector3::new(r[3], r[4], r[5]),
    };
    Ok(table.rows.iter().map(pair).collect())
}

/// Reads the points of regression 2: `x[m],y[m],z[m],u[px],v[px],view`, and the text of
/// `POINTS.extrinsics.json` where there is one.
///
/// Views come in the order in which they first appear; without a column `view` there is one, named `1`.
///
/// # Errors
///
/// [`Error`], saying which row and column, or which view.
pub fn read_views(text: &str, extrinsics: Option<&str>) -> Result<Vec<View>, Error> {
    let columns = [
        ("x", Kind::Length),
        ("y", Kind::Length),
        ("z", Kind::Length),
        ("u", Kind::Pixel),
        ("v", Kind::Pixel),
    ];
    let table = read(text, &columns, Some("view"))?;
    let mut poses = match extrinsics {
        Some(text) => Some(read_extrinsics(text)?),
        None => None,
    };
    let mut views: Vec<View> = Vec::new();
    let mut at: BTreeMap<String, usize> = BTreeMap::new();
    for (i, r) in table.rows.iter().enumerate() {
        let name = table.labels.as_ref().map_or("1".to_string(), |labels| labels[i].clone());
        let view = if let Some(&view) = at.get(&name) {
            view
        } else {
            let world_from_camera = match &mut poses {
                None => None,
                Some(poses) => Some(poses.remove(&name).ok_or_else(|| Error::MissingView {
                    view: name.clone(),
                    found: poses.keys().cloned().collect::<Vec<_>>().join(", "),
                })?),
            };
            at.insert(name.clone(), views.len());
            views.push(View { name, points: Vec::new(), world_from_camera });
            views.len() - 1
        };
        views[view].points.push((Point::new(r[0], r[1], r[2]), Pixel::new(r[3], r[4])));
    }
    Ok(views)
}

/// The pose of every view, by its name.
pub type Extrinsics = BTreeMap<String, Pose<frame::World, frame::Camera>>;

/// Reads the text of `POINTS.extrinsics.json`: the pose of every view, also where it stands under a key
/// `world_from_camera`.
///
/// # Errors
///
/// [`Error::Extrinsics`] or [`Error::NoPose`].
pub fn read_extrinsics(text: &str) -> Result<Extrinsics, Error> {
    #[derive(serde::Deserialize)]
    #[serde(untagged)]
    enum Entry {
        Named { world_from_camera: Pose<frame::World, frame::Camera> },
        Bare(Pose<frame::World, frame::Camera>),
    }
    let file: BTreeMap<String, serde_json::Value> =
        serde_json::from_str(text).map_err(|e| Error::Extrinsics { why: e.to_string() })?;
    let mut poses = BTreeMap::new();
    for (view, value) in file {
        let Ok(entry) = serde_json::from_value(value) else { return Err(Error::NoPose { view }) };
        let (Entry::Named { world_from_camera: pose } | Entry::Bare(pose)) = entry;
        poses.insert(view, pose);
    }
    Ok(poses)
}
