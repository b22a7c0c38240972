//! A file of points: where each is, and where a picture shows it; with what is known of the camera beside it.
//!
//! The table is that of regression 2, `x[m],y[m],z[m],u[px],v[px],view`, with `t[s]` where things move and `point`
//! (a name) where several move at once. `POINTS.extrinsics.json` says where the camera stood in each view,
//! `POINTS.json` what the camera is: `{"camera": {"fx_px": .., "fy_px": .., "cx_px": .., "cy_px": .., "k1": ..},
//! "world_from_camera": {..}, "noise": {"px": ..}}`. Files are opened by the caller.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Vector2, Vector3};
use serde::Deserialize;

use super::lens::Lens;
use super::{error, wording};
use crate::alignment::files::{Extrinsics, read_extrinsics};
use crate::discovery::recording::{Error, Map, Sheet};
use crate::units::{self, Dimension};
use crate::world::camera_file;
use crate::world::{Pose, frame};

/// The columns without which a table is none of points.
const NEEDED: [&str; 5] = ["x", "y", "z", "u", "v"];

/// One point in one picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Line of the file, from 1.
    pub line: usize,
    /// Index into [`Points::views`].
    pub view: usize,
    /// Where it is, m.
    pub point: Vector3<f64>,
    /// Where the picture shows it, px.
    pub pixel: Vector2<f64>,
    /// When, s.
    pub time: Option<f64>,
    /// Which of several moving points it is.
    pub label: Option<String>,
}

/// What is known of the camera.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Known {
    /// Its inside.
    pub lens: Option<Lens>,
    /// Where it stands, for all views.
    pub world_from_camera: Option<Isometry3<f64>>,
    /// Noise of one pixel coordinate, px.
    pub noise_px: Option<f64>,
}

/// Points and where they are seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Points {
    /// The file's name, for messages.
    pub name: String,
    /// The points, in the file's order.
    pub rows: Vec<Row>,
    /// Names of the views, in the order in which they first appear.
    pub views: Vec<String>,
    /// World from camera, a view each, where the extrinsics are known.
    pub poses: Option<Vec<Isometry3<f64>>>,
    /// What the file beside it says of the camera.
    pub known: Known,
    /// What was assumed, one sentence each.
    pub notes: Vec<String>,
}

/// Most rows that are judged; of more, those that lie evenly over the file.
const MOST_ROWS: usize = 50_000;
/// Most pictures of one file: each has a pose of its own, and all are fitted at once.
const MOST_VIEWS: usize = 1000;

/// Returns whether a CSV text is a table of points and their pixels, going by its header.
pub fn is_points(text: &str, map: &Map) -> bool {
    let text = text.trim_start_matches('\u{feff}');
    let Some(header) = text.lines().find(|line| !line.trim_start().starts_with('#')) else {
        return false;
    };
    let names: Vec<String> = header
        .split(',')
        .map(|cell| {
            let bare = cell.split('[').next().unwrap_or_default().trim().to_owned();
            map.apply(cell, units::Column { name: bare, unit: None }).0.name
        })
        .collect();
    NEEDED.iter().all(|needed| names.iter().any(|name| name == needed))
}

/// A column that is used: where it stands and the factor to SI.
#[derive(Clone, Copy)]
struct Place {
    at: usize,
    factor: f64,
}

/// Reads where each name stands, in SI.
fn places(
    name: &str,
    columns: &[units::Column],
    notes: &mut Vec<String>,
) -> Result<BTreeMap<String, Place>, Error> {
    let mut places = BTreeMap::new();
    for (at, column) in columns.iter().enumerate() {
        let expected = match column.name.as_str() {
            "x" | "y" | "z" => Dimension::LENGTH,
            "u" | "v" => Dimension::PIXEL,
            "t" => Dimension::TIME,
            _ => Dimension::NONE,
        };
        let wanted = expected != Dimension::NONE;
        let factor = match column.unit {
            Some(unit) if wanted && unit.dimension != expected => {
                return Err(error::column_unit(&column.name, unit.dimension, expected, name));
            }
            Some(unit) => unit.factor,
            None => {
                if wanted {
                    notes.push(wording::no_unit(name, &column.name, expected));
                }
                1.0
            }
        };
        places.insert(column.name.clone(), Place { at, factor });
    }
    for needed in NEEDED {
        if !places.contains_key(needed) {
            return Err(error::no_column(needed, name));
        }
    }
    Ok(places)
}

impl Points {
    /// Reads a table of points, and the texts of the files beside it: (name, text) of `POINTS.json`, of
    /// `POINTS.extrinsics.json`.
    ///
    /// # Errors
    ///
    /// An [`Error`] for a text that is no such table, a unit that measures something else, a cell that is not a
    /// finite number, or a file beside it that cannot be read.
    pub fn read(
        name: &str,
        text: &str,
        sidecar: Option<(&str, &str)>,
        extrinsics: Option<(&str, &str)>,
        map: &Map,
    ) -> Result<Self, Error> {
        let mut points = table(name, text, map)?;
        if let Some((place, text)) = sidecar {
            points.known = known(place, text)?;
        }
        if let Some((place, text)) = extrinsics {
            let poses = read_extrinsics(text).map_err(|why| error::extrinsics(&why, place))?;
            points.poses = Some(points.view_poses(place, &poses)?);
        }
        Ok(points)
    }

    fn view_poses(&self, place: &str, poses: &Extrinsics) -> Result<Vec<Isometry3<f64>>, Error> {
        let pose = |view: &String| {
            poses.get(view).map(|pose| *pose.isometry()).ok_or_else(|| {
                let found: Vec<&str> = poses.keys().map(String::as_str).collect();
                error::view_without_pose(view, &found, place)
            })
        };
        self.views.iter().map(pose).collect()
    }
}

fn table(name: &str, text: &str, map: &Map) -> Result<Points, Error> {
    let is = ("points are", "x[m],y[m],z[m],u[px],v[px],view");
    let sheet = Sheet::read(name, text, map, is)?;
    let mut notes = Vec::new();
    let places = places(name, &sheet.columns, &mut notes)?;
    let mut points = Points {
        name: name.to_owned(),
        rows: Vec::new(),
        views: Vec::new(),
        poses: None,
        known: Known::default(),
        notes,
    };
    let rows = sheet.rows.len();
    let every = rows.div_ceil(MOST_ROWS).max(1);
    if every > 1 {
        points.notes.push(wording::thinned(name, rows, every));
    }
    let mut views: BTreeMap<String, usize> = BTreeMap::new();
    for (line, record) in sheet.rows.into_iter().step_by(every) {
        let number = |column: &str| -> Result<f64, Error> {
            let place = places[column];
            let cell = record.get(place.at).unwrap_or_default();
            cell.parse::<f64>()
                .ok()
                .filter(|value| value.is_finite())
                .map(|v| v * place.factor)
                .ok_or_else(|| error::not_finite(cell, column, name, line))
        };
        let word = |column: &str| {
            places.get(column).map(|place| record.get(place.at).unwrap_or_default().to_owned())
        };
        let view = word("view").unwrap_or_else(|| "1".into());
        let view = *views.entry(view).or_insert_with_key(|view| {
            points.views.push(view.clone());
            points.views.len() - 1
        });
        if points.views.len() > MOST_VIEWS {
            return Err(error::too_many_views(MOST_VIEWS, name, line));
        }
        points.rows.push(Row {
            line,
            view,
            point: Vector3::new(number("x")?, number("y")?, number("z")?),
            pixel: Vector2::new(number("u")?, number("v")?),
            time: if places.contains_key("t") { Some(number("t")?) } else { None },
            label: word("point"),
        });
    }
    if points.rows.is_empty() {
        return Err(error::no_rows(name));
    }
    Ok(points)
}

#[derive(Deserialize, Default)]
struct RawNoise {
    px: Option<f64>,
}

#[derive(Deserialize)]
struct Raw {
    world_from_camera: Option<Pose<frame::World, frame::Camera>>,
    #[serde(default)]
    noise: RawNoise,
}

/// Reads `POINTS.json`. What `trueup camera calibrate --write` and `trueup align intrinsics --json` give serves as well.
fn known(place: &str, text: &str) -> Result<Known, Error> {
    let no_sidecar = |why: serde_json::Error| error::no_sidecar(&why, place);
    let value: serde_json::Value = serde_json::from_str(text).map_err(no_sidecar)?;
    let is_told = |key: &str| value.get(key).is_some_and(|value| !value.is_null());
    let camera = if is_told("camera") || is_told("fx_px") {
        Some(camera_file::read(text).map_err(|why| error::no_sidecar(&why, place))?)
    } else {
        None
    };
    let raw: Raw = serde_json::from_value(value).map_err(no_sidecar)?;
    let lens = camera.map(|camera| Lens::from(camera.intrinsics));
    if let Some(noise) = raw.noise.px
        && !(noise > 0.0 && noise.is_finite())
    {
        return Err(error::no_noise(noise, place));
    }
    let stands = raw.world_from_camera.or(camera.and_then(|camera| camera.world_from_camera));
    let world_from_camera = stands.map(|pose| *pose.isometry());
    Ok(Known { lens, world_from_camera, noise_px: raw.noise.px })
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "x[cm],y[m],z[m],u[px],v[px],view\n10,0,0,1,2,a\n20,0,0,3,4,b\n";

    fn read(text: &str) -> Result<Points, Error> {
        Points::read("p.csv", text, None, None, &Map::default())
    }

    #[test]
    fn units_and_views_are_read() {
        let points = read(GOOD).unwrap();
        assert!((points.rows[1].point.x - 0.2).abs() < 1e-12);
        assert_eq!((points.views.len(), points.rows[1].view), (2, 1));
        assert!(is_points(GOOD, &Map::default()));
        assert!(!is_points("t[s],q_1[rad]\n", &Map::default()));
        let map = Map::parse("px_u=u[px]").unwrap();
        assert!(is_points("x[m],y[m],z[m],px_u,v[px]\n", &map));
    }

    #[test]
    fn what_is_wrong_is_told_with_its_place() {
        let cases = [
            ("x[m],y[m],z[m],u[px]\n", "no column `v`"),
            ("x[rad],y[m],z[m],u[px],v[px]\n", "must be a length"),
            ("x[m],y[m],z[m],u[px],v[px]\n", "no rows"),
            ("x[m],y[m],z[m],u[px],v[px]\n1,2,3,nan,5\n", "`nan` is not a finite number"),
            ("x[m],y[m],z[m],u[px],v[px]\n1,2,3\n", "3 cells"),
        ];
        for (text, says) in cases {
            let error = read(text).unwrap_err();
            assert!(error.what.contains(says), "{error}");
            assert!(!error.help.is_empty() && error.place.starts_with("p.csv"));
        }
    }

    #[test]
    fn the_camera_may_be_the_answer_of_a_calibration() {
        let flat = r#"{"fx_px": 800, "fy_px": 810, "cx_px": 320, "cy_px": 240, "k1": -0.2, "rms_px": 0.1}"#;
        let read = known("p.json", flat).unwrap().lens.unwrap();
        assert_eq!((read.fy, read.k[0]), (810.0, -0.2));
        let nested =
            r#"{"camera": {"fx_px": 800, "cx_px": 320, "cy_px": 240}, "noise": {"px": 0.3}}"#;
        let read = known("p.json", nested).unwrap();
        assert_eq!((read.lens.unwrap().fy, read.noise_px), (800.0, Some(0.3)));
        assert!(known("p.json", r#"{"camera": {"fx_px": -1, "cx_px": 0, "cy_px": 0}}"#).is_err());
        assert!(known("p.json", r#"{"noise": {"px": 0}}"#).is_err());
    }
}
