//! Who decides between the steps of a performance: the hook that stepping, breakpoints and the page use.
//!
//! A [`Conductor`] is asked before a step and after it, while the arm holds still, and may take as long as
//! it likes to answer. It is asked only where an arm may be left standing ([`unsafe_hold`]): never inside
//! `together`, never while what it carries is tilted. Before the lines of a script that act it may be asked as
//! well ([`Conductor::within`]), by the same rule. Rehearsals ask nobody. A [`Dial`] slows the arm down
//! and is no part of stepping: either works without the other.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use serde::{Deserialize, Serialize};

use crate::graph::parse_graph::{Condition, ParseGraph, Step};
use crate::language::text;
use crate::world::{Scene, WorldState};

use super::wording;
use crate::trace::Line;
use crate::trace::{Measure, StepRecord};

/// Says whether a condition holds now, and by how much it holds (positive) or fails.
pub type Judge<'a> = dyn Fn(&Condition) -> (Option<bool>, Option<Measure>) + 'a;

/// What a conductor says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Word {
    /// The run goes on.
    Go,
    /// The run ends here as one that a person stopped; the arm holds its position.
    Stop,
}

/// A condition of a step, and what it is worth before the step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stated {
    /// With its arguments filled in: `holding(jar)`.
    pub text: String,
    /// Whether it holds now; `None` is unknown.
    pub truth: Option<bool>,
    /// By how much it holds (positive) or fails now.
    pub margin: Option<Measure>,
    /// Whether it puts a question to people. Whoever asks one blind does not show `truth` and `margin`.
    pub asks: bool,
}

/// A sub-task, a branch or a block that a step is part of.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    /// Its path in the graph: `pour/pick`.
    pub path: String,
    /// As people read it: `pick(jar)`, or the last part of its path.
    pub label: String,
    /// Whether it is the branch of an Or that was chosen.
    pub is_branch: bool,
    /// The number of its first step in the run.
    pub first: usize,
    /// The number of its last step in the run.
    pub last: usize,
}

/// A `break` in the text before a step.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Mark {
    /// Its condition, if it has one.
    pub when: Option<String>,
    /// Whether it pauses now: always without a condition, and where nobody knows what it is worth.
    pub holds: bool,
}

/// A step that comes later.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Later {
    /// Its number in the run.
    pub number: usize,
    /// Its node's path in the graph.
    pub path: String,
    /// As a call.
    pub action: String,
}

/// A step that is about to begin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ahead {
    /// Its place in the run, from 1; the number of its [`StepRecord`].
    pub number: usize,
    /// How many steps the run has as planned now.
    pub of: usize,
    /// Its node's path in the graph.
    pub path: String,
    /// As a call: `grasp(jar, side)`.
    pub action: String,
    /// Where it is written, `tasks/std.task:188`, when that is known.
    pub place: Option<String>,
    /// The script it runs, if any.
    pub script: Option<String>,
    /// What it is part of, outermost first: the task called, its sub-tasks, branches and blocks.
    pub parts: Vec<Part>,
    /// What must hold before it.
    pub needs: Vec<Stated>,
    /// What must hold throughout.
    pub keeps: Vec<Stated>,
    /// What it makes true.
    pub gives: Vec<Stated>,
    /// A breakpoint in the text before it.
    pub mark: Option<Mark>,
    /// The steps after it, as planned now.
    pub later: Vec<Later>,
}

impl Ahead {
    /// Describes step `index` of `pg` as step `number` of a run; `judge` says what a condition is worth
    /// now, `label` how a node is called.
    pub fn of(
        pg: &ParseGraph,
        index: usize,
        number: usize,
        judge: &Judge<'_>,
        label: &dyn Fn(&str) -> Option<String>,
    ) -> Self {
        let step = &pg.steps[index];
        // A task and the action it ends in often state the same.
        let stated = |all: &[Condition]| {
            let mut told: Vec<Stated> = Vec::new();
            for condition in all {
                if told.iter().all(|other| other.text != condition.text) {
                    told.push(state(condition, judge));
                }
            }
            told
        };
        Self {
            number,
            of: number + pg.steps.len() - index - 1,
            path: step.path.clone(),
            action: step.text.clone(),
            place: None,
            script: step.script.clone(),
            parts: parts(pg, index, number, label),
            needs: stated(&step.needs),
            keeps: stated(&step.keeps),
            gives: stated(&step.gives),
            mark: step
                .pause
                .as_ref()
                .map(|pause| Mark { when: pause.when.as_ref().map(text::expr), holds: true }),
            later: (index + 1..pg.steps.len())
                .map(|i| Later {
                    number: number + i - index,
                    path: pg.steps[i].path.clone(),
                    action: pg.steps[i].text.clone(),
                })
                .collect(),
        }
    }

    /// Returns whether it is part of what is done about a failure.
    pub fn is_recovery(&self) -> bool {
        self.path.split('/').any(|part| part.starts_with("on_failure"))
    }

    /// Returns what it is part of, without the whole run: outermost first.
    pub fn inside(&self) -> &[Part] {
        self.parts.get(1..).unwrap_or_default()
    }
}

fn state(condition: &Condition, judge: &Judge<'_>) -> Stated {
    let (truth, margin) = judge(condition);
    Stated { text: condition.text.clone(), truth, margin, asks: !condition.asks.is_empty() }
}

/// Returns what a step is part of, by its path: `pour/pick/either.level_side/grasp` is part of `pour`, of
/// `pour/pick` and of the branch `level_side`.
fn parts(
    pg: &ParseGraph,
    index: usize,
    number: usize,
    label: &dyn Fn(&str) -> Option<String>,
) -> Vec<Part> {
    let path = &pg.steps[index].path;
    let ends = path.match_indices('/').map(|(at, _)| at);
    ends.map(|end| {
        let above = &path[..end];
        let inside: Vec<usize> = pg.steps_of(above).collect();
        let number_of =
            |step: Option<&usize>| (number + step.unwrap_or(&index)).saturating_sub(index);
        let name = above.rsplit('/').next().unwrap_or(above);
        let (name, is_branch) = match name.rsplit_once('.') {
            Some((_, branch)) => (branch, true),
            None => (name, false),
        };
        Part {
            path: above.to_owned(),
            label: label(above).unwrap_or_else(|| name.to_owned()),
            is_branch,
            first: number_of(inside.first()),
            last: number_of(inside.last()),
        }
    })
    .collect()
}

/// Someone who decides, between the steps of a performance, whether it goes on.
pub trait Conductor: Send {
    /// Is told that a run begins: the call, and the folder it is kept in.
    fn begins(&mut self, _task: &str, _run_dir: Option<&Path>) {}

    /// Returns whether it tells of the steps itself, so that nobody else prints what a step came to before
    /// a question about it was answered.
    fn tells(&self) -> bool {
        false
    }

    /// Is asked before a step, the arm holding still. May block; whoever blocks looks at the cell's wish
    /// to stop now and then, and returns when there is one.
    fn before(&mut self, ahead: &Ahead) -> Word;

    /// Is told that a step begins about which nobody is asked, and why the arm cannot be left standing
    /// there: `inside a together`, `the jar is tilted by 62 deg`. Must return at once.
    fn passing(&mut self, _ahead: &Ahead, _why: &str) {}

    /// Is asked before a line of a step's script that acts, the arm holding still; may block. Where the arm
    /// cannot be left standing, `why` says why not: then it must return at once.
    fn within(&mut self, _ahead: &Ahead, _line: &Line, _why: Option<&str>) -> Word {
        Word::Go
    }

    /// Is asked after a step, the arm holding still; may block. Of steps that ended where the arm cannot
    /// be left, it is asked at the next place where it can, or when the run is over, in their order.
    fn after(&mut self, _ahead: &Ahead, _record: &StepRecord) -> Word {
        Word::Go
    }
}

/// How far a carried vessel may lean and still be left standing about, rad: `level` of the stdlib.
const LEVEL: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// Returns why the arm must not be left standing before step `next`, `before` being the step carried out
/// last; `None` where it may.
pub fn unsafe_hold(
    before: Option<&Step>,
    next: Option<&Step>,
    state: &WorldState,
    scene: &Scene,
) -> Option<String> {
    let group = next.and_then(|step| step.together.as_ref());
    if group.is_some() && group == before.and_then(|step| step.together.as_ref()) {
        return Some(wording::inside_together());
    }
    let held = state.held.as_deref()?;
    scene.object(held)?.cavity.as_ref()?;
    match state.object(held)?.world_from_object.map(|pose| pose.tilt()) {
        Some(tilt) if tilt <= LEVEL => None,
        tilt => Some(wording::leans(held, tilt)),
    }
}

/// A speed dial, from 1 to 100 %: how much of the planned speed the arm uses. Cloning shares it.
///
/// It only ever slows down, so what the limits allow is allowed still. Turning a vessel to pour keeps its
/// own rate: a slower tilt pours more by the time it has come as far.
#[derive(Debug, Clone)]
pub struct Dial(Arc<AtomicU8>);

impl Default for Dial {
    fn default() -> Self {
        Self(Arc::new(AtomicU8::new(100)))
    }
}

impl Dial {
    /// Turns it to `percent`, at least 1 and at most 100.
    pub fn turn(&self, percent: u8) {
        self.0.store(percent.clamp(1, 100), Ordering::SeqCst);
    }

    /// Returns where it stands, percent.
    pub fn percent(&self) -> u8 {
        self.0.load(Ordering::SeqCst)
    }

    /// Returns how many times as long a motion takes.
    pub fn stretch(&self) -> f64 {
        100.0 / f64::from(self.percent())
    }
}
