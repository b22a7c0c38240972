//! `poses.csv`: where the robot was at each picture, in the forms that robots and their programs write.
//!
//! CSV with one header line, columns `name[unit]` in any order, one row a picture: `x`, `y`, `z` in m, cm, mm or in, and
//! either a quaternion `qw,qx,qy,qz` without a unit, a rotation vector `rx,ry,rz`, or `roll,pitch,yaw` about the fixed x, then
//! y, then z, in rad or deg. A pose is the flange's in the base (`base_from_flange`). A column `file` names the picture;
//! without one, rows and pictures are paired in order. [`Table::readings`] are the ways in which such tables are most often
//! misunderstood, tried when a table does not fit its pictures.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

use crate::world::{Pose, frame};

/// Why a table of poses cannot be read. Rows are counted from 1, without the header.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The text is not CSV.
    #[error("row {row}: {why}")]
    Csv {
        /// Which row; 0 for the header.
        row: usize,
        /// What the CSV reader says.
        why: String,
    },
    /// There are no rows.
    #[error("the table is empty: expected a header `{HEADER}` and a row for each picture")]
    Empty,
    /// A column is missing.
    #[error("no column `{column}`; the header has {found}; expected `{HEADER}`")]
    Missing {
        /// Its name.
        column: &'static str,
        /// The columns there are.
        found: String,
    },
    /// There is no rotation, or more than one.
    #[error(
        "the header has {found}; a rotation is one of `qw,qx,qy,qz`, `rx[rad],ry[rad],rz[rad]` (a rotation vector) or \
         `roll[deg],pitch[deg],yaw[deg]` (about the fixed x, then y, then z)"
    )]
    Rotation {
        /// The columns there are.
        found: String,
    },
    /// Two columns have one name.
    #[error("column `{column}` stands in the header twice")]
    Twice {
        /// The name.
        column: String,
    },
    /// A column without a unit, or with a wrong one.
    #[error("column `{column}` {found}; write `{column}[{expected}]`")]
    Unit {
        /// The column.
        column: &'static str,
        /// What its unit is.
        found: String,
        /// Units it may have.
        expected: &'static str,
    },
    /// A cell is not a number.
    #[error("row {row}, column `{column}`: `{text}` is not a finite number")]
    Cell {
        /// Which row.
        row: usize,
        /// Which column.
        column: &'static str,
        /// What stands there.
        text: String,
    },
    /// A quaternion of another length than 1.
    #[error("row {row}: the quaternion's length is {length:.3}, not 1")]
    Length {
        /// Which row.
        row: usize,
        /// Its length.
        length: f64,
    },
}

const HEADER: &str = "file,x[m],y[m],z[m],qw,qx,qy,qz";
/// A quaternion's length may be off by this: four decimals leave 1e-4.
const QUATERNION: f64 = 0.01;

/// How a table writes rotations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Quaternion,
    Vector,
    RollPitchYaw,
}

impl Form {
    const ALL: [Self; 3] = [Self::Quaternion, Self::Vector, Self::RollPitchYaw];

    fn columns(self) -> &'static [&'static str] {
        match self {
            Self::Quaternion => &["qw", "qx", "qy", "qz"],
            Self::Vector => &["rx", "ry", "rz"],
            Self::RollPitchYaw => &["roll", "pitch", "yaw"],
        }
    }
}

/// A table of poses as it was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// The pictures' names, if there is a column for them.
    pub files: Option<Vec<String>>,
    form: Form,
    /// The unit of angles in rad; of a quaternion 1.
    angle: f64,
    /// The unit of positions, as written.
    pub length_unit: String,
    /// Position in m and rotation as written.
    rows: Vec<(Vector3<f64>, Vec<f64>)>,
}

/// Another way to understand a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Reading {
    /// Angles in the other unit.
    #[error("its angles are in rad, not in deg")]
    Radians,
    /// Angles in the other unit.
    #[error("its angles are in deg, not in rad")]
    Degrees,
    /// The inverse of each pose.
    #[error(
        "its poses are the base's in the flange (flange_from_base), not the flange's in the base"
    )]
    Inverse,
    /// The real part last.
    #[error("its quaternions are in the order x, y, z, w")]
    RealLast,
    /// The real part first.
    #[error("its quaternions are in the order w, x, y, z")]
    RealFirst,
    /// Three angles that are a vector.
    #[error("its three angles are a rotation vector (`rx,ry,rz`)")]
    Vector,
    /// A vector that is three angles.
    #[error(
        "its rotations are roll, pitch and yaw about the fixed x, then y, then z (`roll,pitch,yaw`)"
    )]
    RollPitchYaw,
    /// Three angles about axes that move along.
    #[error("its angles are about the moving x, then y, then z")]
    Moving,
    /// Poses in the other order.
    #[error("its poses are in the reverse order of the pictures")]
    Reversed,
}

/// A pose of a table.
pub type FlangePose = Pose<frame::Base, frame::Flange>;

impl Table {
    /// Reads a table.
    ///
    /// # Errors
    ///
    /// [`Error`], saying which row and column.
    pub fn read(text: &str) -> Result<Self, Error> {
        let text = text.trim_start_matches('\u{feff}');
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_reader(text.as_bytes());
        let csv = |row| move |e: csv::Error| Error::Csv { row, why: e.to_string() };
        let header = Header::new(&reader.headers().map_err(csv(0))?.clone())?;
        let form = header.form()?;
        let file = ["file", "picture", "image"].iter().find_map(|name| header.place(name));
        let mut places = Vec::new();
        let mut length = 1.0;
        for column in ["x", "y", "z"] {
            let (place, factor) = header.column(column, &LENGTHS, "m")?;
            places.push((column, place, factor));
            length = factor;
        }
        let mut angle = 1.0;
        for &column in form.columns() {
            let units: &[(&str, f64)] = if form == Form::Quaternion { &NONE } else { &ANGLES };
            let (place, factor) =
                header.column(column, units, if form == Form::Quaternion { "1" } else { "deg" })?;
            // Rotations stay as written, for other readings of them.
            places.push((column, place, 1.0));
            angle = factor;
        }
        let mut table = Self {
            files: file.map(|_| Vec::new()),
            form,
            angle,
            length_unit: LENGTHS
                .iter()
                .find(|u| (u.1 - length).abs() < 1e-12)
                .map_or("m", |u| u.0)
                .into(),
            rows: Vec::new(),
        };
        for (i, record) in reader.records().enumerate() {
            let row = i + 1;
            let record = record.map_err(csv(row))?;
            let mut numbers = Vec::with_capacity(places.len());
            for &(column, place, factor) in &places {
                let cell = record.get(place).unwrap_or_default();
                match cell.parse::<f64>() {
                    Ok(value) if value.is_finite() => numbers.push(value * factor),
                    _ => return Err(Error::Cell { row, column, text: cell.to_string() }),
                }
            }
            if let (Some(files), Some(place)) = (&mut table.files, file) {
                files.push(record.get(place).unwrap_or_default().to_string());
            }
            let rotation = numbers.split_off(3);
            if form == Form::Quaternion {
                let length = rotation.iter().map(|v| v * v).sum::<f64>().sqrt();
                if (length - 1.0).abs() > QUATERNION {
                    return Err(Error::Length { row, length });
                }
            }
            table.rows.push((Vector3::new(numbers[0], numbers[1], numbers[2]), rotation));
        }
        if table.rows.is_empty() { Err(Error::Empty) } else { Ok(table) }
    }

    /// Returns how many rows there are.
    pub fn n_rows(&self) -> usize {
        self.rows.len()
    }

    /// Returns the poses of the flange in the base, row by row.
    pub fn poses(&self) -> Vec<FlangePose> {
        self.rows.iter().map(|(p, r)| posed(*p, turn(self.form, r, self.angle))).collect()
    }

    /// Returns the other ways to understand the table, with the poses that it then has.
    pub fn readings(&self) -> Vec<(Reading, Vec<FlangePose>)> {
        let as_if = |form: Form, angle: f64| {
            let each = self.rows.iter().map(|(p, r)| posed(*p, turn(form, r, angle)));
            each.collect::<Vec<_>>()
        };
        let is_degrees = (self.angle - 1.0).abs() > 1e-9;
        let (unit, other) =
            if is_degrees { (Reading::Radians, 1.0) } else { (Reading::Degrees, PI / 180.0) };
        let mut all = vec![(Reading::Inverse, self.poses().iter().map(inverse).collect())];
        match self.form {
            Form::Quaternion => {
                // Names that stand over numbers in the other order.
                let reordered = |order: [usize; 4]| {
                    let each = self
                        .rows
                        .iter()
                        .map(|(p, r)| posed(*p, turn(self.form, &order.map(|i| r[i]), 1.0)));
                    each.collect::<Vec<_>>()
                };
                all.push((Reading::RealLast, reordered([3, 0, 1, 2])));
                all.push((Reading::RealFirst, reordered([1, 2, 3, 0])));
            }
            Form::Vector => {
                all.push((unit, as_if(Form::Vector, other)));
                all.push((Reading::RollPitchYaw, as_if(Form::RollPitchYaw, self.angle)));
            }
            Form::RollPitchYaw => {
                all.push((unit, as_if(Form::RollPitchYaw, other)));
                all.push((Reading::Vector, as_if(Form::Vector, self.angle)));
                let each = self.rows.iter().map(|(p, r)| {
                    let [x, y, z] = [r[0], r[1], r[2]].map(|v| v * self.angle);
                    // About the moving axes is about the fixed ones in the reverse order.
                    let turn =
                        about(Vector3::x(), x) * about(Vector3::y(), y) * about(Vector3::z(), z);
                    posed(*p, turn)
                });
                all.push((Reading::Moving, each.collect()));
            }
        }
        // Names can stand in the wrong order as rows can.
        all.push((Reading::Reversed, self.poses().into_iter().rev().collect()));
        all
    }
}

const LENGTHS: [(&str, f64); 4] = [("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("in", 0.0254)];
const ANGLES: [(&str, f64); 2] = [("rad", 1.0), ("deg", PI / 180.0)];
const NONE: [(&str, f64); 2] = [("", 1.0), ("1", 1.0)];

struct Header {
    columns: Vec<(String, Option<String>)>,
}

impl Header {
    fn new(record: &csv::StringRecord) -> Result<Self, Error> {
        if record.iter().all(str::is_empty) {
            return Err(Error::Empty);
        }
        let mut columns: Vec<(String, Option<String>)> = Vec::new();
        for cell in record {
            let (name, unit) = match cell.split_once('[') {
                Some((name, unit)) => {
                    (name.trim(), Some(unit.trim_end_matches(']').trim().to_owned()))
                }
                None => (cell.trim(), None),
            };
            if columns.iter().any(|(other, _)| other == name) {
                return Err(Error::Twice { column: name.into() });
            }
            columns.push((name.into(), unit));
        }
        Ok(Self { columns })
    }

    fn found(&self) -> String {
        let names: Vec<String> = self.columns.iter().map(|(name, _)| format!("`{name}`")).collect();
        names.join(", ")
    }

    fn place(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|(other, _)| other == name)
    }

    fn form(&self) -> Result<Form, Error> {
        let has = |form: &Form| form.columns().iter().any(|name| self.place(name).is_some());
        let forms: Vec<Form> = Form::ALL.into_iter().filter(has).collect();
        match forms[..] {
            [form] => Ok(form),
            _ => Err(Error::Rotation { found: self.found() }),
        }
    }

    /// Where a column stands and how many SI units its unit is.
    fn column(
        &self,
        column: &'static str,
        units: &[(&str, f64)],
        expected: &'static str,
    ) -> Result<(usize, f64), Error> {
        let place =
            self.place(column).ok_or_else(|| Error::Missing { column, found: self.found() })?;
        let unit = self.columns[place].1.as_deref();
        let factor = units.iter().find(|(name, _)| *name == unit.unwrap_or_default());
        let found = || unit.map_or("has no unit".into(), |unit| format!("is in `{unit}`"));
        factor.map(|(_, factor)| (place, *factor)).ok_or_else(|| Error::Unit {
            column,
            found: found(),
            expected,
        })
    }
}

fn posed(place: Vector3<f64>, turn: UnitQuaternion<f64>) -> FlangePose {
    Pose::new(Isometry3::from_parts(Translation3::from(place), turn))
}

fn inverse(pose: &FlangePose) -> FlangePose {
    Pose::new(pose.isometry().inverse())
}

fn about(axis: Vector3<f64>, angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(axis * angle)
}

/// A rotation from its numbers; missing ones are 0.
fn turn(form: Form, r: &[f64], angle: f64) -> UnitQuaternion<f64> {
    let at = |i: usize| r.get(i).copied().unwrap_or(0.0);
    match form {
        Form::Quaternion => {
            UnitQuaternion::try_new(Quaternion::new(at(0), at(1), at(2), at(3)), 1e-9)
                .unwrap_or_else(UnitQuaternion::identity)
        }
        Form::Vector => UnitQuaternion::from_scaled_axis(Vector3::new(at(0), at(1), at(2)) * angle),
        Form::RollPitchYaw => {
            UnitQuaternion::from_euler_angles(at(0) * angle, at(1) * angle, at(2) * angle)
        }
    }
}
