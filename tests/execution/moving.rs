//! An arm beside something that moves by itself: it stops before it comes near, waits, and goes on; or gives way. How near it came is
//! reckoned here from where the laboratory's ball truly was, at every tick.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::Vector3;
use trueup::arm::{Arm, Cancel, DeviceError, Feedback, Grip};
use trueup::execution::body::{Body, Sight};
use trueup::execution::context::ActionContext;
use trueup::execution::decisions::DecisionLog;
use trueup::execution::lab_arm::{self, LabArm};
use trueup::execution::script::{ScriptError, Scripts};
use trueup::lab::{Lab, LabSettings, Passer, Spot};
use trueup::motion::collision::CollisionWorld;
use trueup::motion::free::Means;
use trueup::motion::separation::Separation;
use trueup::trace::{Event, Observer};
use trueup::world::WorldState;

use crate::kitchen;

/// What was told and how the arm was, tick by tick.
#[derive(Default)]
struct Told {
    ticks: Vec<Feedback>,
    notes: Vec<String>,
}

impl Observer for Told {
    fn event(&mut self, event: &Event) {
        match event {
            Event::Tick(feedback) => self.ticks.push(feedback.clone()),
            Event::Note { text, .. } => self.notes.push(text.clone()),
            _ => {}
        }
    }
}

/// The laboratory's arm, with things where they were put.
struct Bench {
    arm: LabArm,
    state: WorldState,
}

struct Still(WorldState);

impl Sight for Still {
    fn state(&mut self, feedback: &Feedback) -> WorldState {
        WorldState { time: feedback.time, q: feedback.q.clone(), ..self.0.clone() }
    }

    fn contact(&self, _: &str, _: &str) -> Option<bool> {
        None
    }
}

impl Body for Bench {
    fn arm(&mut self) -> &mut dyn Arm {
        &mut self.arm
    }

    fn state(&mut self) -> Result<WorldState, DeviceError> {
        let feedback = self.arm.feedback()?;
        Ok(Still(self.state.clone()).state(&feedback))
    }

    fn sight(&self) -> Box<dyn Sight> {
        Box::new(Still(self.state.clone()))
    }

    fn look(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    fn gripped(&mut self, _: Grip, _: Option<&str>) -> Result<(), DeviceError> {
        Ok(())
    }

    fn weighed(&mut self, _: f64) {}

    fn contact(&mut self, _: &str, _: &str) -> Option<bool> {
        None
    }
}

const JAR: [f64; 3] = [0.45, -0.33, 0.0];
const CUP: [f64; 3] = [0.45, 0.33, 0.0];

/// Home, with joint 1 turned.
fn home(turned: f64) -> [f64; 7] {
    let mut q = kitchen::HOME;
    q[0] += turned;
    q
}

/// Where the tool is half-way from one side to the other, m.
fn half_way() -> Vector3<f64> {
    super::cell().tool_pose(&home(0.0)).origin()
}

/// A ball on its way from corner to corner.
fn ball(corners: &[Vector3<f64>], speed_m_s: f64, begins_s: f64) -> Passer {
    Passer {
        name: "hand".into(),
        radius_m: 0.08,
        way_m: corners.iter().map(|corner| (*corner).into()).collect(),
        speed_m_s,
        begins_s,
        colour: [70, 110, 190],
    }
}

/// What came of a free motion from one side to the other.
struct Went {
    told: Told,
    result: Result<(), ScriptError>,
    /// The least true distance to the ball while the arm moved, m, and altogether.
    least: f64,
    ever: f64,
    /// How far each joint is from the end at most, rad.
    off: f64,
}

/// Turns joint 1 from -0.6 to 0.6 rad, freely, beside a ball.
fn goes(passer: &Passer, means: Means, is_watched: bool) -> Went {
    let mut cell = super::cell();
    cell.means = means;
    let mut settings = LabSettings::perfect();
    for (name, [x_m, y_m, yaw_rad]) in [("jar", JAR), ("cup", CUP)] {
        settings.placement.fixed.insert(name.into(), Spot { x_m, y_m, yaw_rad });
    }
    settings.start.q_rad = home(-0.6).to_vec();
    settings.moving = vec![passer.clone()];
    settings.switches.readings = true;
    if !is_watched {
        settings.watch.late_s = 10.0;
    }
    let mut state = kitchen::state(JAR, CUP);
    state.q = home(-0.6).to_vec();
    let lab = Lab::new(&cell.robot, &cell.scene, settings, 3).unwrap();
    let arm = lab_arm::connect(Arc::new(Mutex::new(lab)), &cell.robot);
    let told = Arc::new(Mutex::new(Told::default()));
    let context = ActionContext::new(
        cell.clone(),
        Box::new(Bench { arm, state }),
        home(-0.6).to_vec(),
        DecisionLog::recording(),
        (1, 0),
        Cancel::default(),
        told.clone(),
    );
    let mut scripts = Scripts::new(context);
    let goal = home(0.6);
    let script = format!("arm.move_to({goal:?});");
    let result = scripts.run("test.rhai", &script, &BTreeMap::new());
    drop(scripts);
    let told = std::mem::take(&mut *told.lock().unwrap_or_else(PoisonError::into_inner));
    let separation = Separation::of(&CollisionWorld::new(&cell.robot));
    let (mut least, mut ever) = (f64::INFINITY, f64::INFINITY);
    for tick in &told.ticks {
        let apart = separation.distance(&tick.q, &place(passer, tick.time), passer.radius_m);
        ever = ever.min(apart);
        if tick.dq.iter().any(|dq| dq.abs() > 0.1) {
            least = least.min(apart);
        }
    }
    let end = told.ticks.last().unwrap();
    let off = end.q.iter().zip(goal).map(|(q, goal)| (q - goal).abs()).fold(0.0, f64::max);
    Went { told, result, least, ever, off }
}

/// Where the ball is at `time`, worked out again.
fn place(passer: &Passer, time: f64) -> Vector3<f64> {
    let mut left = (time - passer.begins_s).max(0.0) * passer.speed_m_s;
    let corners: Vec<Vector3<f64>> = passer.way_m.iter().map(|c| Vector3::from(*c)).collect();
    for leg in corners.windows(2) {
        let length = (leg[1] - leg[0]).norm();
        if left < length {
            return leg[0] + (leg[1] - leg[0]) * (left / length);
        }
        left -= length;
    }
    corners[corners.len() - 1]
}

/// A hand that comes down into the way, rests there for a moment, and goes up again.
fn comes_and_goes() -> Passer {
    let at = half_way();
    let up = |by: f64| at + Vector3::new(0.0, 0.0, by);
    // It is there after a second, and for half a second more.
    ball(&[up(0.2), at, up(-0.05), at, up(1.0)], 0.2, 0.0)
}

#[test]
fn the_arm_stops_for_a_hand_in_its_way_and_goes_on_when_it_has_passed() {
    let passer = comes_and_goes();
    let unseen = goes(&passer, Means::Rrt, false);
    assert!(unseen.result.is_ok() && unseen.ever < 0.0, "{} m: never in the way", unseen.ever);
    assert!(unseen.told.notes.is_empty(), "{:?}", unseen.told.notes);
    let seen = goes(&passer, Means::Rrt, true);
    assert!(seen.result.is_ok(), "{:?}", seen.result);
    assert!(seen.off < 0.01, "{} rad from its end", seen.off);
    assert!(seen.least > 0.05, "{} m", seen.least);
    let notes = &seen.told.notes;
    assert!(notes.iter().any(|note| note.contains("the arm waits: `hand`")), "{notes:?}");
    let goes_on = |note: &&String| note.contains("the arm goes on after");
    assert!(notes.iter().any(|note| goes_on(&note)), "{notes:?}");
    // Why it goes on is one of two, and neither is that the hand has passed.
    let says_why = |note: &String| {
        note.ends_with("its way is clear of `hand`") || note.contains("leads no nearer to `hand`")
    };
    assert!(notes.iter().filter(goes_on).all(says_why), "{notes:?}");
    assert!(!notes.iter().any(|note| note.contains("touched")), "{notes:?}");
}

/// A hand that comes into the way faster than the arm stops, and stays there.
#[test]
fn what_reaches_an_arm_that_moves_is_told_once() {
    let at = half_way();
    let passer = ball(&[at + Vector3::new(0.5, 0.0, 0.0), at], 2.0, 0.35);
    let went = goes(&passer, Means::Rrt, true);
    assert!(went.least < 0.0, "{} m: never reached", went.least);
    let touched = |note: &&String| note.starts_with("`hand` touched the arm while it moved");
    assert_eq!(went.told.notes.iter().filter(touched).count(), 1, "{:?}", went.told.notes);
}

#[test]
fn what_stays_in_the_way_is_waited_for_twenty_seconds_and_told() {
    let at = half_way();
    let passer = ball(&[at + Vector3::new(0.0, 0.0, 0.5), at], 0.5, 0.0);
    let went = goes(&passer, Means::Rrt, true);
    let error = went.result.unwrap_err().to_string();
    assert!(error.contains("`hand` has been in the way for 20 s"), "{error}");
    assert!(went.least > 0.05 && went.ever > 0.0, "{} {} m", went.least, went.ever);
}

#[test]
fn by_policies_the_arm_goes_round_what_stays_in_its_way_and_lets_pass_what_crosses_it() {
    let at = half_way();
    let stays = ball(&[at + Vector3::new(0.0, 0.0, 0.5), at], 0.5, 0.0);
    let went = goes(&stays, Means::Rmpflow, true);
    assert!(went.result.is_ok(), "{:?} {:?}", went.result, went.told.notes);
    assert!(went.off < 0.01 && went.ever > 0.02, "{} rad, {} m", went.off, went.ever);
    let came = goes(&comes_and_goes(), Means::Rmpflow, true);
    assert!(came.result.is_ok(), "{:?} {:?}", came.result, came.told.notes);
    assert!(came.off < 0.01 && came.ever > 0.02, "{} rad, {} m", came.off, came.ever);
    let notes = &came.told.notes;
    assert!(notes.iter().any(|note| note.contains("gives way")), "{notes:?}");
}
