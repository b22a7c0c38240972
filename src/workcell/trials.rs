//! Trials in laboratories drawn one after the other, counted as the paper counts them.
//!
//! A trial is one run with one seed. Its columns: *pick up*, something was held off the table after some step,
//! as measured; *pour water*, at least 90 % of all water on the scales is in the target; *success (soft)*, the
//! task is done (and, where it pours, the water poured) and no more than a little is spilt; *success (hard)*,
//! the same with nothing spilt.
//!
//! Source: Zeng, Zhao and Wu, Table 2; Wilson, "Probable inference, the law of succession, and statistical
//! inference", 1927.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::matching::Matching;
use super::{Aims, Ending, Error, Run, wording};
use crate::execution::calibrate::Switches;
use crate::trace::{Deed, StepRecord};
use crate::world::WorldState;

/// The share of the water that has to arrive.
const POURED: f64 = 0.9;
/// Higher than this a thing is off the table, m: twice the 5 mm within which `upright` counts it as standing there.
const OFF_THE_TABLE: f64 = 0.01;
/// Less than a particle of the water, mL: nothing.
const NOTHING: f64 = 0.1;

/// One trial: a line of a results file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// The laboratory it was tried in.
    pub seed: u64,
    /// The regressions that were left out.
    pub without: Vec<u8>,
    /// Fingerprint of everything else that was given: task, scene, laboratory's settings, robot, version.
    pub setup: String,
    /// The call.
    pub task: String,
    /// How it ended; `None` when it was given up before the first step.
    pub outcome: Option<Ending>,
    /// Whether something was held off the table; `None` for a task that holds nothing.
    pub picked: Option<bool>,
    /// Whether the water arrived; `None` for a task that pours nothing.
    pub poured: Option<bool>,
    /// Water in the target, mL.
    pub in_target_ml: Option<f64>,
    /// Water on the table, mL.
    pub spilt_ml: Option<f64>,
    /// Why it did not succeed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// How well the twin matched what was measured before the first step (Eq. 1).
    #[serde(default, rename = "match", skip_serializing_if = "Option::is_none")]
    pub matching: Option<Matching>,
    /// Wall time of all of it, s.
    pub total_s: f64,
    /// Time the arm itself took over its steps, s of arm time.
    pub arm_s: f64,
    /// The run folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub run_dir: Option<String>,
}

impl Trial {
    /// Returns a trial that ended before there was a run to speak of: what its task aims at has failed.
    pub fn refused(
        seed: u64,
        switches: Switches,
        task: &str,
        aims: Aims,
        why: &Error,
        total_s: f64,
    ) -> Self {
        Self {
            seed,
            without: left_out(switches),
            setup: String::new(),
            task: task.to_owned(),
            outcome: None,
            picked: aims.holds.then_some(false),
            poured: aims.pours.then_some(false),
            in_target_ml: None,
            spilt_ml: None,
            reason: Some(why.to_string()),
            matching: None,
            total_s,
            arm_s: 0.0,
            run_dir: None,
        }
    }

    /// Returns what a run counts for.
    pub fn of(run: &Run, switches: Switches) -> Self {
        let Aims { holds, pours: is_pour } = run.aims.unwrap_or_else(|| aims(run));
        let held = run.steps.iter().any(|step| is_off_the_table(&step.measured));
        let water = run.water.as_ref();
        let poured = water.filter(|_| is_pour).map(|water| {
            let all = water.in_target_ml + water.in_source_ml + water.spilt_ml;
            all > 0.0 && water.in_target_ml >= POURED * all
        });
        Self {
            seed: run.seed,
            without: left_out(switches),
            setup: String::new(),
            task: run.task.clone(),
            outcome: Some(run.outcome),
            picked: holds.then_some(held),
            poured,
            in_target_ml: water.filter(|_| is_pour).map(|water| water.in_target_ml),
            spilt_ml: water.map(|water| water.spilt_ml),
            reason: run.reason.clone(),
            matching: run.matching.clone(),
            total_s: run.timing_s.total,
            arm_s: run.steps.iter().map(|step| step.interval_s[1] - step.interval_s[0]).sum(),
            run_dir: run.run_dir.clone(),
        }
    }

    /// Returns the trial as one that was ended because it took longer than `seconds`; what its task aims at and
    /// was not come to has failed.
    #[must_use]
    pub fn not_within(self, seconds: f64, aims: Aims) -> Self {
        let reason = Some(wording::not_within(seconds));
        let picked = self.picked.or(aims.holds.then_some(false));
        let poured = self.poured.or(aims.pours.then_some(false));
        Self { outcome: Some(Ending::Failure), picked, poured, reason, ..self }
    }

    /// Whether the task was done with no more than `leak` mL on the table.
    fn succeeded(&self, leak: f64) -> bool {
        self.outcome == Some(Ending::Success)
            && self.poured != Some(false)
            && self.spilt_ml.is_none_or(|spilt| spilt <= leak)
    }

    /// Whether the task was done with nothing on the table.
    pub fn is_clean(&self) -> bool {
        self.succeeded(NOTHING)
    }
}

/// Whether something is held, and off the table.
fn is_off_the_table(state: &WorldState) -> bool {
    let held = state.held.as_deref().and_then(|name| state.object(name)?.world_from_object);
    held.is_some_and(|pose| pose.origin().z > OFF_THE_TABLE)
}

/// Returns what the steps of an older record did.
fn aims(run: &Run) -> Aims {
    let did = |is_it: fn(&Deed) -> bool| run.steps.iter().flat_map(StepRecord::deeds).any(is_it);
    Aims {
        holds: did(|deed| matches!(deed, Deed::Took { .. })),
        pours: did(|deed| matches!(deed, Deed::Turned { .. })),
    }
}

/// Returns the numbers of the regressions that are out of force.
pub fn left_out(switches: Switches) -> Vec<u8> {
    let all = [(1, switches.camera), (2, switches.intrinsics), (3, switches.offset)];
    all.into_iter().filter(|(_, is_on)| !is_on).map(|(number, _)| number).collect()
}

/// So many of so many, with the interval that Wilson's score gives at 95 %.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Share {
    /// How many.
    pub of: usize,
    /// How many of them.
    pub yes: usize,
    /// The interval of the share.
    pub wilson_95: [f64; 2],
}

impl Share {
    /// Returns so many of so many.
    pub fn counted(yes: usize, of: usize) -> Self {
        Self { of, yes, wilson_95: wilson(yes, of) }
    }

    /// Counts; `None` without anything to count.
    pub fn of(all: impl Iterator<Item = bool>) -> Option<Self> {
        let (mut of, mut yes) = (0, 0);
        for one in all {
            of += 1;
            yes += usize::from(one);
        }
        (of > 0).then(|| Self::counted(yes, of))
    }
}

/// Returns Wilson's interval at 95 %.
fn wilson(yes: usize, of: usize) -> [f64; 2] {
    // The 0.975 quantile of the normal distribution.
    const Z: f64 = 1.959_963_984_540_054;
    let n = of as f64;
    let p = yes as f64 / n;
    let middle = p + Z * Z / (2.0 * n);
    let half = Z * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
    let scale = 1.0 + Z * Z / n;
    [((middle - half) / scale).max(0.0), ((middle + half) / scale).min(1.0)]
}

/// Mean and standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// The mean.
    pub mean: f64,
    /// The standard deviation of a single one, by n - 1; 0 of one alone.
    pub std: f64,
    /// Of how many.
    pub n: usize,
}

impl Spread {
    /// Returns it of some numbers; `None` of none.
    pub fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let values: Vec<f64> = values.collect();
        let n = values.len();
        if n == 0 {
            return None;
        }
        let mean = values.iter().sum::<f64>() / n as f64;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        let std = if n > 1 { (squares / (n - 1) as f64).sqrt() } else { 0.0 };
        Some(Self { mean, std, n })
    }
}

/// One row of the table: one way of doing it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// `all regressions`, `without regression 1`.
    pub method: String,
    /// The regressions that were left out.
    pub without: Vec<u8>,
    /// How many trials.
    pub n: usize,
    /// Something was held off the table.
    pub pick_up: Option<Share>,
    /// The water arrived.
    pub pour_water: Option<Share>,
    /// Done, with a little spilt at most.
    pub success_soft: Option<Share>,
    /// Done, with nothing spilt.
    pub success_hard: Option<Share>,
    /// Wall time of a trial, s.
    pub total_s: Option<Spread>,
    /// Arm time of a trial that carried out steps, s.
    pub arm_s: Option<Spread>,
    /// Water in the target of trials that poured, mL.
    pub in_target_ml: Option<Spread>,
    /// Water on the table, mL.
    pub spilt_ml: Option<Spread>,
    /// What the other trials came to, by seed.
    pub failures: Vec<Failed>,
}

/// A trial that did not end cleanly.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Failed {
    /// Its laboratory.
    pub seed: u64,
    /// What became of it.
    pub reason: String,
    /// Water on the table, mL.
    pub spilt_ml: Option<f64>,
}

/// Counts trials, one row for each set of regressions left out, fewest first; `leak` is what a soft success
/// may spill, mL. Of trials of the same seed the last counts.
pub fn table(trials: &[Trial], leak: f64) -> Vec<Row> {
    let mut sets: BTreeMap<(usize, Vec<u8>), BTreeMap<u64, &Trial>> = BTreeMap::new();
    for trial in trials {
        let key = (trial.without.len(), trial.without.clone());
        sets.entry(key).or_default().insert(trial.seed, trial);
    }
    sets.into_iter().map(|((_, without), trials)| row(without, &trials, leak)).collect()
}

fn row(without: Vec<u8>, trials: &BTreeMap<u64, &Trial>, leak: f64) -> Row {
    let all = || trials.values().copied();
    // Before the first step nobody has picked up or poured anything, if the task would have.
    let is_known = |of: fn(&Trial) -> Option<bool>| all().any(|trial| of(trial).is_some());
    let counted = |of: fn(&Trial) -> Option<bool>| {
        let share = Share::of(all().map(|trial| of(trial) == Some(true)));
        share.filter(|_| is_known(of))
    };
    let failures = all().filter(|trial| !trial.is_clean()).map(|trial| Failed {
        seed: trial.seed,
        reason: trial.reason.clone().unwrap_or_else(|| wording::not_clean(trial.poured)),
        spilt_ml: trial.spilt_ml,
    });
    Row {
        method: wording::method(&without),
        n: trials.len(),
        pick_up: counted(|trial| trial.picked),
        pour_water: counted(|trial| trial.poured),
        success_soft: Share::of(all().map(|trial| trial.succeeded(leak))),
        success_hard: Share::of(all().map(Trial::is_clean)),
        total_s: Spread::of(all().map(|trial| trial.total_s)),
        arm_s: Spread::of(all().map(|trial| trial.arm_s).filter(|time| *time > 0.0)),
        in_target_ml: Spread::of(
            all().filter(|trial| trial.poured == Some(true)).filter_map(|t| t.in_target_ml),
        ),
        spilt_ml: Spread::of(all().filter_map(|trial| trial.spilt_ml)),
        failures: failures.collect(),
        without,
    }
}
