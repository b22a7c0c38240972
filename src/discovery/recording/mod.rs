//! A recording: columns over time in SI, with what is known of the machine that made it.
//!
//! [`Recording::read`] takes the text of a CSV file and of the sidecar beside it, `Recording::read_bag` a
//! ROS 2 bag, `Bag` one in several files (feature `bags`); [`map`] renames columns.
//! What is wrong with a file is an error that says which line and which column and what would help. A
//! column nobody asks for may hold anything, and several may bear one name: both are told only by [`Recording::column`].
//! Files are opened by the caller.

mod arrays;
mod columns;
mod error;
#[cfg(feature = "bags")]
mod bag;
#[cfg(feature = "bags")]
mod records;
pub mod map;
pub mod noise;
pub mod sidecar;
mod sheet;
mod table;
mod wording;
mod written;

use std::collections::BTreeSet;

use crate::units::Dimension;

#[cfg(feature = "bags")]
pub use bag::Bag;
pub use columns::{BadCell, Column, Recording, Segment};
use columns::{FINEST, LATEST, MOST_VALUES, too_much};
pub use error::{BagFlaw, BrokenBag, BrokenMessage, Error, Flaw, MapFlaw, SidecarFlaw};
pub use map::Map;
pub(super) use sheet::Sheet;
pub use sidecar::Sidecar;

/// What the cells of a column may hold.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Cells {
    Numbers,
    /// Numbers, or nothing.
    NumbersOrBlank,
}

/// No sensor shows more than this, SI; chosen: a thousand times the stress, Pa, at which the best steel gives way.
const MOST_SHOWN: f64 = 1e12;

/// Returns the median step between rows, s; 1 of a single row.
pub fn usual_step(time: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.is_empty() {
        return 1.0;
    }
    let middle = steps.len() / 2;
    *steps.select_nth_unstable_by(middle, f64::total_cmp).1
}

impl Recording {
    /// Reads a recording: the text of its CSV file, of the sidecar beside it if there is one, and how
    /// the columns are to be called.
    ///
    /// # Errors
    ///
    /// An [`Error`] for a text that is not a table, has fewer than three rows, no time column, a time
    /// that is not finite or does not increase, two columns of one name, a unit that does not exist or
    /// cannot be a time, a sidecar that is not one, or several runs in one file.
    pub fn read(
        name: &str,
        csv: &str,
        sidecar: Option<(&str, &str)>,
        map: &Map,
    ) -> Result<Self, Error> {
        let mut runs = Self::read_runs(name, csv, sidecar, map)?;
        match (runs.pop(), runs.len()) {
            (Some(only), 0) => Ok(only),
            (_, before) => Err(Flaw::SeveralRuns(before + 1).at(name)),
        }
    }

    /// Reads a file that may hold several runs, each with a clock that starts again: a recording each, in the
    /// file's order.
    ///
    /// # Errors
    ///
    /// As [`Self::read`], several runs excepted.
    pub fn read_runs(
        name: &str,
        csv: &str,
        sidecar: Option<(&str, &str)>,
        map: &Map,
    ) -> Result<Vec<Self>, Error> {
        table::read(name, csv, &Sidecar::beside(sidecar)?, map)
    }

    /// Reads the joint states of a ROS 2 bag in one MCAP file, `q_NAME`, `dq_NAME`, `tau_NAME` for every joint by the
    /// bag's name; topics that speak of a command give `q_cmd_NAME`. The sidecar and the map are as for
    /// [`Self::read`].
    ///
    /// # Errors
    ///
    /// An [`Error`] for bytes that are no MCAP file, a bag without joint states, or a sidecar that is not
    /// one.
    #[cfg(feature = "bags")]
    pub fn read_bag(
        name: &str,
        bytes: &[u8],
        sidecar: Option<(&str, &str)>,
        map: &Map,
    ) -> Result<Self, Error> {
        let mut bag = Bag::default();
        bag.add(name, bytes)?;
        bag.recording(name, sidecar, map)
    }

    /// Gives columns that bear a joint's name the joint's number: `q_elbow` becomes `q_3` if `elbow` is the
    /// third of `joints`.
    pub fn number_joints(&mut self, joints: &[String]) {
        for column in &mut self.columns {
            let stems = ["q_cmd", "dq_cmd", "tau_cmd", "q", "dq", "tau", "current"];
            let numbered = stems.iter().find_map(|stem| {
                let joint = column.name.strip_prefix(stem)?.strip_prefix('_')?;
                let index = joints.iter().position(|known| known == joint)?;
                Some(format!("{stem}_{}", index + 1))
            });
            if let Some(name) = numbered {
                column.name = name;
            }
        }
    }

    /// Returns the number of rows.
    pub fn n_rows(&self) -> usize {
        self.time.len()
    }

    /// Returns the time from the first row to the last, s.
    pub fn duration(&self) -> f64 {
        self.time[self.n_rows() - 1] - self.time[0]
    }

    /// Returns the most common step of time (the median), s.
    pub fn step(&self) -> f64 {
        usual_step(&self.time)
    }

    /// Returns whether there is a column of that name.
    pub fn has(&self, name: &str) -> bool {
        self.columns.iter().any(|column| column.name == name)
    }

    /// Returns the values of a column in SI, of the given dimension.
    ///
    /// A header without a unit is taken to be in SI.
    ///
    /// # Errors
    ///
    /// An [`Error`] if there is no such column, or several, its unit measures something else, or cells of it are not
    /// finite numbers.
    pub fn column(&self, name: &str, dimension: Dimension) -> Result<&[f64], Error> {
        self.column_of(name, [dimension; 2], Cells::Numbers)
    }

    /// As [`Self::column`], but cells may be blank and are NaN then, as long as some are not.
    ///
    /// # Errors
    ///
    /// As [`Self::column`], and if next to nothing is left.
    pub fn column_with_blanks(&self, name: &str, dimension: Dimension) -> Result<&[f64], Error> {
        self.column_of(name, [dimension; 2], Cells::NumbersOrBlank)
    }

    /// As [`Self::column`], of one of two dimensions, of which the first is told.
    fn column_of(&self, name: &str, either: [Dimension; 2], cells: Cells) -> Result<&[f64], Error> {
        let [dimension, _] = either;
        let Some(column) = self.columns.iter().find(|column| column.name == name) else {
            let known = self.columns.iter().map(|column| column.name.clone()).take(40).collect();
            return Err(Flaw::NoColumn { name: name.to_owned(), known, dimension }.at(&self.name));
        };
        if column.is_one_of_several {
            return Err(Flaw::SameName(name.to_owned()).at(format!("{}:1", self.name)));
        }
        if let Some(unit) = column.unit
            && !either.contains(&unit.dimension)
        {
            let (is, expected) = (unit.dimension, dimension);
            let flaw = Flaw::ColumnUnit { name: name.to_owned(), is, expected };
            return Err(flaw.at(format!("{}:1, column `{name}`", self.name)));
        }
        let is_fine = cells == Cells::NumbersOrBlank && column.has_numbers_or_blanks();
        if let Some((first, others)) = column.bad.split_first().filter(|_| !is_fine) {
            let lines = others.iter().map(|bad| bad.line).collect();
            let is_other = |c: &&Column| c.name != name && (1..c.values.len()).contains(&c.n_bad);
            let others = self.columns.iter().filter(is_other).map(|c| c.name.clone()).collect();
            let (text, n) = (first.text.clone(), column.n_bad - 1);
            let flaw = Flaw::NotFinite { text, lines, n, others };
            return Err(flaw.at(format!("{}:{}, column `{name}`", self.name, first.line)));
        }
        Ok(&column.values)
    }

    /// Returns what is wrong with the first of some columns in which a value is larger than any sensor shows, if there is one.
    pub fn no_reading<'n>(&self, names: impl Iterator<Item = &'n String>) -> Option<Error> {
        let of_name = |name: &String| self.columns.iter().find(|column| column.name == *name);
        names.filter_map(of_name).find_map(|column| {
            let row = column.values.iter().position(|value| value.abs() > MOST_SHOWN)?;
            let (value, t) = (column.values[row], self.time[row]);
            let flaw = Flaw::NoReading { value, is: column.unit.map(|unit| unit.dimension), t };
            Some(flaw.at(format!("{}, column `{}`", self.name, column.name)))
        })
    }

    /// Returns the columns `stem_1` to `stem_n`, or `None` if there is not one of them. A joint's column may also be one
    /// of a joint that slides, m for rad; [`Self::check_joints`] says whether it is.
    ///
    /// # Errors
    ///
    /// As [`Self::column`], and if some of the `n` are there and others are not.
    pub fn group(
        &self,
        stem: &str,
        n: usize,
        dimension: Dimension,
    ) -> Result<Option<Vec<&[f64]>>, Error> {
        self.group_of((stem, n), dimension, Cells::Numbers)
    }

    /// As [`Self::group`], but cells may be blank, as for [`Self::column_with_blanks`].
    ///
    /// # Errors
    ///
    /// As [`Self::group`] and [`Self::column_with_blanks`].
    pub fn group_with_blanks(
        &self,
        stem: &str,
        n: usize,
        dimension: Dimension,
    ) -> Result<Option<Vec<&[f64]>>, Error> {
        self.group_of((stem, n), dimension, Cells::NumbersOrBlank)
    }

    fn group_of(
        &self,
        (stem, n): (&str, usize),
        dimension: Dimension,
        cells: Cells,
    ) -> Result<Option<Vec<&[f64]>>, Error> {
        let name = |i: usize| format!("{stem}_{i}");
        if (1..=n).all(|i| !self.has(&name(i))) {
            return Ok(None);
        }
        let either = [dimension, dimension.of_sliding().unwrap_or(dimension)];
        let of = |i: usize| self.column_of(&name(i), either, cells);
        (1..=n).map(of).collect::<Result<_, _>>().map(Some)
    }

    /// Checks that only joints that slide are recorded in m, m/s and N; `slides` says for each joint whether it does.
    ///
    /// # Errors
    ///
    /// An [`Error`] for a joint that turns and has such a unit.
    pub fn check_joints(&self, slides: &[bool]) -> Result<(), Error> {
        let all = [
            ("q", Dimension::ANGLE),
            ("q_cmd", Dimension::ANGLE),
            ("dq", Dimension::ANGULAR_SPEED),
            ("tau", Dimension::TORQUE),
        ];
        for (joint, _) in slides.iter().enumerate().filter(|(_, slides)| !**slides) {
            for (stem, expected) in all {
                let name = format!("{stem}_{}", joint + 1);
                let column = self.columns.iter().find(|column| column.name == name);
                let is = column.and_then(|column| column.unit).map(|unit| unit.dimension);
                if let Some(is) = is.filter(|is| Some(*is) == expected.of_sliding()) {
                    let place = format!("{}:1, column `{name}`", self.name);
                    return Err(Flaw::ColumnUnit { name, is, expected }.at(place));
                }
            }
        }
        Ok(())
    }

    /// Returns how many columns `stem_1`, `stem_2`, … follow each other without a gap.
    pub fn group_len(&self, stem: &str) -> usize {
        let names: BTreeSet<&str> = self.columns.iter().map(|c| c.name.as_str()).collect();
        (1..=names.len()).take_while(|i| names.contains(&*format!("{stem}_{i}"))).count()
    }

    /// Returns as much of its beginning as lasts `longest` s, and of that as many rows, evenly taken, as `most`
    /// allows; says so in its notes. A model that is simulated on a grid of time is as large as the time is long,
    /// and one stray stamp may be a year away. `None` where it is all of it.
    pub fn within(&self, longest: f64, most: usize) -> Option<Self> {
        let rows = self.n_rows();
        let end = self.time.partition_point(|t| t - self.time[0] <= longest);
        let every = end.div_ceil(most.max(1)).max(1);
        if end == rows && every == 1 {
            return None;
        }
        let mut told = Vec::new();
        if end < rows {
            let judged = self.time[end - 1] - self.time[0];
            let pause = self.time[end] - self.time[end - 1];
            told.push(wording::only_the_first(self.duration(), (judged, end), rows, pause));
        }
        if every > 1 {
            told.push(wording::thinned(end, every));
        }
        let cut = |values: &[f64]| values[..end].iter().step_by(every).copied().collect();
        let columns = self.columns.iter().map(|column| Column {
            values: cut(&column.values),
            name: column.name.clone(),
            unit: column.unit,
            bad: column.bad.clone(),
            n_bad: column.n_bad,
            is_one_of_several: column.is_one_of_several,
        });
        let mut notes = self.notes.clone();
        notes.push(format!("{}: {}", self.name, told.join("; ")));
        Some(Self {
            name: self.name.clone(),
            time: cut(&self.time),
            lines: self.lines.iter().take(end).step_by(every).copied().collect(),
            columns: columns.collect(),
            sidecar: self.sidecar.clone(),
            notes,
        })
    }

    /// Splits off the last part of the rows, `fraction` of them: (to fit, to hold out).
    ///
    /// # Errors
    ///
    /// An [`Error`] if one of the two would have fewer than three rows.
    pub fn split(&self, fraction: f64) -> Result<(Self, Self), Error> {
        let n = self.n_rows();
        let cut = ((n as f64) * (1.0 - fraction)).round() as usize;
        if cut < 3 || n < cut + 3 {
            return Err(Flaw::NotSplit(n).at(&self.name));
        }
        let part = |from: usize, to: usize, what: &str| {
            let columns = self.columns.iter().map(|column| Column {
                values: column.values[from..to].to_vec(),
                name: column.name.clone(),
                unit: column.unit,
                bad: column.bad.clone(),
                n_bad: column.n_bad,
                is_one_of_several: column.is_one_of_several,
            });
            Self {
                name: format!("{} ({what})", self.name),
                time: self.time[from..to].to_vec(),
                lines: self.lines.iter().take(to).skip(from).copied().collect(),
                columns: columns.collect(),
                sidecar: self.sidecar.clone(),
                notes: Vec::new(),
            }
        };
        let mut train = part(0, cut, "first part");
        train.notes.clone_from(&self.notes);
        Ok((train, part(cut, n, "last part")))
    }
}
