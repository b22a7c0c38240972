//! How a cell is to be opened.

use super::Stdlib;
use crate::execution::calibrate::Switches;
use crate::lab::{LabSettings, Spot};
use crate::language::Source;
use crate::motion::free::Means;

/// How many candidates are rehearsed at most unless somebody says otherwise. Chosen: two cores rehearse four pours in
/// the time that the arm needs for one; more pay where things stand close together.
pub const CANDIDATES: usize = 4;

/// How to open a cell.
#[derive(Debug, Clone)]
pub struct Options {
    /// `lab` or `twin`, or what an arm elsewhere is called.
    pub robot: String,
    /// A `.task` file with a scene, as path and text; the kitchen when `None`.
    pub scene: Option<Source>,
    /// A user's script whose items come with the library, as path and text.
    pub script: Option<Source>,
    /// The lab's settings.
    pub lab: LabSettings,
    /// The stdlib.
    pub stdlib: Stdlib,
    /// All chance comes from this.
    pub seed: u64,
    /// Which regressions are in force.
    pub switches: Switches,
    /// How many candidates are rehearsed at most for one attempt, 1 or more; [`CANDIDATES`] unless there is a reason.
    pub candidates: usize,
    /// How free motions are found.
    pub means: Means,
    /// Whether the laboratory's arm moves no faster than time passes by `clock`.
    pub is_real_time: bool,
    /// Returns seconds since some instant; only differences are used.
    pub clock: fn() -> f64,
}

impl Options {
    /// Puts a thing of the laboratory at a place of the table, m, turned by `yaw`, rad, instead of where chance has it.
    pub fn put(&mut self, name: &str, x: f64, y: f64, yaw: f64) {
        let spot = Spot { x_m: x, y_m: y, yaw_rad: yaw };
        self.lab.placement.fixed.insert(name.to_owned(), spot);
    }
}
