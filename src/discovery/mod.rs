//! Where twin and measurement disagree, and what the twin lacks: the name, the place, the size.
//!
//! Recordings come in, a [`finding::Finding`] goes out; [`investigate`] is the door. It reasons like this.
//! Noise first: every channel's residual is divided by its noise, given or estimated, so that what is
//! left after a right explanation is 1. Then the model is simulated again with every effect of the
//! [`vocabulary`] at every place, and the one that explains most is added, fitted, and judged on data
//! it was not fitted to; so on until nothing pays ([`selection`]). An effect that cannot be told from
//! another is not named but reported as a doubt, and what no name fits as a formula, or as unknown.
//! Every verdict says how sure it is; a refusal says why.
//!
//! [`recording`] reads measured data, [`robot`] simulates arms, [`pour`] a vessel and a scale, [`held`] a thing in
//! the hand, [`equation`] models given by their equations.
//! Nothing here knows the truth of the lab: recordings are all it sees.
//!
//! ```
//! use trueup::discovery::equation::{Options, investigate};
//! use trueup::discovery::recording::{Map, Recording};
//!
//! // A cart that is pushed and coasts, and a model without what brakes it.
//! let model = "model cart {
//!     input u: N
//!     state x: m = free, v: m/s = free
//!     x' = v
//!     v' = u/(1.5 kg)
//!     output x = x
//! }";
//! let measured = |start: f64| {
//!     let mut rows = String::from("t[s],u[N],x[m]");
//!     let (mut x, mut v) = (0.0, start);
//!     for k in 0..400_u32 {
//!         let t = 0.01 * f64::from(k);
//!         let push = 3.0 * (2.0 * t + start).sin();
//!         // The last digit of the sensor.
//!         rows += &format!("\n{t},{push},{:.4}", x);
//!         for _ in 0..100 {
//!             v += 1e-4 * (push - 2.0 * v) / 1.5;
//!             x += 1e-4 * v;
//!         }
//!     }
//!     Recording::read("cart", &rows, None, &Map::default()).unwrap()
//! };
//! let recordings = [measured(0.0), measured(1.0)];
//! let found = investigate("cart.task", model, "", &recordings, &Options::default(), &mut |_, _| {}).unwrap();
//! assert_eq!(found.finding.effects[0].name, "linear_damping");
//! ```

mod investigation;
mod why;
pub mod vocabulary;
pub mod finding;
pub mod recording;
pub mod selection;
pub mod resample;
mod wording;
pub mod pour;
pub mod held;
pub mod robot;
pub mod camera;
pub mod model_file;
pub mod equation;

use std::borrow::Cow;

use crate::language::ast::EffectItem;
use crate::motion::Robot;
use crate::world::Scene;
pub use investigation::{Against, Investigation, Options, Trace};
use investigation::{by_channel, rms_judged};
use recording::{Error, Recording};
pub use why::{COUNT, Row, Why};

/// What the recordings are of.
#[derive(Debug, Clone, Copy)]
pub enum Subject<'a> {
    /// An arm, and the effects its twin knows already.
    Arm(&'a Robot, &'a [EffectItem]),
    /// Pours among the things of a scene, and the effects its twin knows already.
    Pours(&'a Scene, &'a [EffectItem]),
    /// A thing of a scene in an arm's hand, and the effects its twin knows already.
    Held(&'a Robot, &'a Scene, &'a [EffectItem]),
}

impl Subject<'_> {
    /// How long all recordings together may be, s, and how many rows they may have: what is simulated on a grid of
    /// time must fit in memory.
    fn most(self) -> (f64, usize) {
        match self {
            // A grid of 5 ms, or steps of 2 ms, and some 10 kB a row where a motion was measured.
            Self::Arm(..) | Self::Held(..) => (900.0, 250_000),
            // Steps of 20 ms, integrated anew at every trial of an effect.
            Self::Pours(..) => (3600.0, 250_000),
        }
    }
}

/// Returns of each recording what can be looked at; all of it unless together they are too long.
fn within(recordings: &[Recording], (longest, most): (f64, usize)) -> Cow<'_, [Recording]> {
    let duration: f64 = recordings.iter().map(Recording::duration).sum();
    let rows: usize = recordings.iter().map(Recording::n_rows).sum();
    let n = recordings.len();
    let each = (
        if duration > longest { longest / n as f64 } else { f64::INFINITY },
        if rows > most { most / n } else { usize::MAX },
    );
    let cut: Vec<Option<Recording>> = recordings.iter().map(|r| r.within(each.0, each.1)).collect();
    if cut.iter().all(Option::is_none) {
        return Cow::Borrowed(recordings);
    }
    let kept = cut.into_iter().zip(recordings);
    kept.map(|(cut, whole)| cut.unwrap_or_else(|| whole.clone())).collect()
}

/// Finds what the subject's model lacks. `progress` is told what is being done and which part is done.
///
/// # Errors
///
/// An [`Error`] for recordings that are not of the subject, too short ones, or a model that runs away.
pub fn investigate(
    recordings: &[Recording],
    subject: Subject<'_>,
    options: &Options,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<Investigation, Error> {
    let mut found = investigated(recordings, subject, options, progress)?;
    by_channel(&mut found.finding, &found.traces);
    found.finding.notes = merged(&found.finding.notes, recordings);
    Ok(found)
}

/// Says once what was noted of several recordings alike.
fn merged(notes: &[String], recordings: &[Recording]) -> Vec<String> {
    let mut told: Vec<(Vec<&str>, &str)> = Vec::new();
    for note in notes {
        let split = recordings.iter().find_map(|recording| {
            let rest = note.strip_prefix(&recording.name)?.strip_prefix(": ")?;
            Some((Some(recording.name.as_str()), rest))
        });
        let (name, rest) = split.unwrap_or((None, note));
        match told.iter_mut().find(|(of, other)| *other == rest && of.is_empty() == name.is_none())
        {
            Some((of, _)) => of.extend(name.filter(|name| !of.contains(name))),
            None => told.push((name.into_iter().collect(), rest)),
        }
    }
    let line = |(of, rest): (Vec<&str>, &str)| {
        if of.is_empty() { rest.to_owned() } else { format!("{}: {rest}", of.join(", ")) }
    };
    told.into_iter().map(line).collect()
}

fn investigated(
    recordings: &[Recording],
    subject: Subject<'_>,
    options: &Options,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<Investigation, Error> {
    if recordings.is_empty() {
        return Err(wording::no_recording());
    }
    if let Subject::Arm(robot, known) = subject
        && recordings.iter().all(|recording| robot::are_poses(recording, robot.n_joints()))
    {
        let (holdout, search) = (options.holdout, &options.search);
        return robot::at_poses(robot, known, recordings, holdout, search, progress);
    }
    if let Subject::Arm(robot, _) = subject {
        let check = |recording| robot::check_clock(recording, robot.n_joints());
        recordings.iter().try_for_each(check)?;
    }
    let recordings = &*within(recordings, subject.most());
    let (robot, known) = match subject {
        Subject::Pours(scene, known) => {
            return pour::investigate(scene, known, recordings, &options.search, progress);
        }
        Subject::Held(robot, scene, known) => {
            return held::investigate(robot, scene, known, recordings, &options.search, progress);
        }
        Subject::Arm(robot, known) => (robot, known),
    };
    let parts;
    let (train, heldout) = match recordings {
        [one] => {
            parts = one.split(options.holdout)?;
            (std::slice::from_ref(&parts.0), std::slice::from_ref(&parts.1))
        }
        several => several.split_at(several.len() - 1),
    };
    robot::investigate(robot, known, train, heldout, &options.search, progress)
}
