//! Every effect that an arm might lack, given what was recorded and what is left unexplained.
//!
//! Laws with a shape (the order of a ripple, the width of a hysteresis) need somewhere to begin: orders
//! and frequencies come from a scan of the residual, the others from a few values spread over what is
//! physically sensible.

use super::chain::Chain;
use super::channels::Quantity;
use super::scan::Scan;
use super::simulate::Model;
use super::term::{Feature, Law, SHIFTS, Term};
use crate::discovery::finding::{SIGNIFICANT, above_noise};
use crate::discovery::selection::{Candidate, Set, sum_of_squares};

/// What an effect without a name must explain more, in the units of the criterion: there are many more
/// formulas than names. Chosen: a factor of 400 in odds.
const UNNAMED: f64 = 12.0;

/// Where the creep of dry friction, a formula's as well, begins to be fitted, rad/s: slow against any motion on purpose.
const CREEP: f64 = 1e-3;

/// An axis nearer to the vertical than this is along it, rad: machines are set up with a level.
const UPRIGHT: f64 = 0.02;

/// Returns the effects to try on top of `present`, at `joints` and on the whole arm; `left` are the
/// residuals in units of noise.
pub fn candidates(
    model: &Model,
    present: &[Term],
    left: &[f64],
    joints: impl Iterator<Item = usize>,
) -> Vec<Candidate<Term>> {
    let joints: Vec<usize> = joints.collect();
    let mut draft = Draft::new(model);
    for &j in &joints {
        if draft.has_effort() {
            draft.torques(j, left);
        }
        draft.torque_sensor(j);
        if draft.has(Quantity::Tip) {
            draft.geometry(j);
        }
    }
    draft.whole_arm(&joints);
    if draft.has_effort() && !draft.is_closed {
        draft.together(&joints);
    }
    let mut found = draft.found;
    found.retain(|candidate| !present.contains(&candidate.term));
    found
}

/// The candidates so far, and what decides which of them could show.
struct Draft<'m> {
    model: &'m Model,
    found: Vec<Candidate<Term>>,
    /// Whether the motion is simulated.
    is_closed: bool,
    /// Where the creep of dry friction begins, rad/s.
    creeps: &'static [f64],
}

impl<'m> Draft<'m> {
    fn new(model: &'m Model) -> Self {
        let is_closed = model.course.closed_loop;
        Self {
            model,
            found: Vec::new(),
            is_closed,
            // A motion that is simulated shows creep as such; along a measured one only the rows about standstill
            // do, and a fit that begins on their wrong side stays there.
            creeps: if is_closed { &[CREEP] } else { &[CREEP, 4.0 * CREEP, 16.0 * CREEP] },
        }
    }

    fn has(&self, quantity: Quantity) -> bool {
        self.model.course.data.has(quantity)
    }

    /// Returns whether a torque at a joint shows anywhere.
    fn has_effort(&self) -> bool {
        self.is_closed || self.has(Quantity::Torque)
    }

    /// Adds a law that begins at each of `starts`, at nothing without any, and must explain `surcharge` more.
    fn add(&mut self, law: Law, joint: usize, starts: Vec<Vec<f64>>, surcharge: f64) {
        let starts = if starts.is_empty() { vec![neutral(law)] } else { starts };
        let term = Term { law, joint };
        self.found.push(Candidate { term, with: Vec::new(), starts, surcharge });
    }

    /// Adds laws that begin at nothing.
    fn plain(&mut self, laws: &[Law], joint: usize) {
        for &law in laws {
            self.add(law, joint, Vec::new(), 0.0);
        }
    }

    /// Adds what acts as a torque in a joint.
    fn torques(&mut self, j: usize, left: &[f64]) {
        let smooth =
            [Law::Viscous, Law::Quadratic, Law::Armature, Law::Stiffness, Law::CubicStiffness];
        self.plain(&smooth, j);
        self.dry(j);
        let scan = Scan::new(self.model, j, left);
        let orders = scan.orders();
        if !orders.is_empty() {
            self.add(Law::Ripple, j, shaped(Law::Ripple, &orders), 0.0);
        }
        self.add(Law::Periodic, j, shaped(Law::Periodic, &scan.frequencies()), 0.0);
        if shows(self.model, left, j) {
            for (law, starts) in formulas(&scan.edges(), &orders, self.is_closed) {
                self.add(law, j, starts, UNNAMED);
            }
        }
        // Along a measured motion it is a gain of the sensor.
        if self.is_closed || !self.has(Quantity::Position) {
            self.plain(&[Law::ActuatorGain], j);
        }
        let most = scan.largest_torque;
        let limits: Vec<Vec<f64>> =
            [0.97, 0.9, 0.8, 0.65, 0.5, 0.35].iter().map(|part| vec![part * most]).collect();
        if most > 0.0 {
            self.add(Law::Saturation, j, limits, 0.0);
        }
    }

    /// Adds friction that holds, or remembers.
    fn dry(&mut self, j: usize) {
        let from = self.creeps;
        let creeps = |before: &[f64]| {
            from.iter().map(|creep| [before, &[*creep]].concat()).collect::<Vec<_>>()
        };
        self.add(Law::Coulomb, j, creeps(&[0.0]), 0.0);
        if self.is_closed {
            // Along a measured motion the two corners look the same.
            self.add(Law::SmoothCoulomb, j, creeps(&[0.0]), 0.0);
        }
        self.add(Law::Asymmetric, j, creeps(&[0.0, 0.0]), 0.0);
        let peaks = [0.02, 0.08, 0.3].map(|speed| vec![0.0, 0.0, speed, CREEP]);
        self.add(Law::Stribeck, j, peaks.to_vec(), 0.0);
        self.add(Law::Hysteresis, j, shaped(Law::Hysteresis, &[0.004, 0.02, 0.1]), 0.0);
    }

    /// Adds what only a torque sensor shows.
    fn torque_sensor(&mut self, j: usize) {
        if !self.has(Quantity::Torque) {
            return;
        }
        // What the first link weighs no joint about the vertical feels.
        if !self.is_closed && (1..self.model.course.plant.n).contains(&j) {
            self.plain(&[Law::LinkMass], j);
        }
        self.plain(&[Law::TorqueOffset, Law::TorqueGain, Law::TorqueDrift], j);
    }

    /// Adds what the tip shows of a joint.
    fn geometry(&mut self, j: usize) {
        // From no gap to a wide one: where contact is lost and made again does not change evenly.
        let widths = [0.0, 0.004, 0.012, 0.03].map(|width| vec![width]);
        self.add(Law::Backlash, j, widths.to_vec(), 0.0);
        self.plain(&[Law::ZeroOffset, Law::Compliance], j);
        // Where the first joint sits in the base is where the tracker sees the base.
        if j > 0 {
            self.plain(&[Law::LinkLength], j);
        }
        if !self.is_closed && !self.has(Quantity::Position) {
            self.plain(&[Law::ServoSag], j);
        }
    }

    /// Adds what is of no joint, and zeros where only torques show them.
    fn whole_arm(&mut self, joints: &[usize]) {
        let model = self.model;
        if !self.has(Quantity::Tip) && model.feels_zeros() {
            // About an axis that gravity is along a zero of the first joint weighs nothing.
            let first = usize::from(!weighs_on_first(&model.arm.chain));
            for &j in joints.iter().filter(|&&j| j >= first) {
                self.plain(&[Law::ZeroOffset], j);
            }
        }
        if self.has_effort() {
            self.plain(&[Law::Payload, Law::BaseTilt], 0);
        }
        if self.is_closed
            || (!model.course.data.commands.is_empty() && !self.has(Quantity::Position))
        {
            self.plain(&[Law::CommandDelay], 0);
        }
        for quantity in [Quantity::Position, Quantity::Speed, Quantity::Torque, Quantity::Tip] {
            if self.has(quantity) && model.is_predicted(quantity) {
                self.plain(&[Law::SensorDelay(quantity)], 0);
            }
        }
        if self.has(Quantity::Tip) {
            self.plain(&[Law::ToolOffset], 0);
            self.plain(&SHIFTS.map(Law::CameraShift), 0);
        }
    }

    /// Adds laws that are tried at once: the friction of a real joint is dry and fluid at once, and its sensor has an
    /// offset. Where the motion is measured nothing else tells the three from one law that bends, or differs with
    /// direction. And a spring rests where it was mounted, which is rarely where the joint's angle is zero: beside an offset
    /// its rest is anywhere.
    fn together(&mut self, joints: &[usize]) {
        for &joint in joints {
            for with in [&[Law::Viscous][..], &[Law::Viscous, Law::TorqueOffset]] {
                self.found.push(Candidate {
                    term: Term { law: Law::Coulomb, joint },
                    with: with.iter().map(|&law| Term { law, joint }).collect(),
                    starts: self.creeps.iter().map(|creep| vec![0.0, *creep]).collect(),
                    surcharge: 0.0,
                });
            }
            self.found.push(Candidate {
                term: Term { law: Law::Stiffness, joint },
                with: vec![Term { law: Law::TorqueOffset, joint }],
                starts: vec![neutral(Law::Stiffness)],
                surcharge: 0.0,
            });
        }
    }
}

/// Returns whether the whole arm weighs otherwise on its joints once it is turned about the first of them: not where that slides,
/// or gravity is along its axis.
fn weighs_on_first(chain: &Chain) -> bool {
    let first = chain.bodies.first().filter(|body| !body.slides);
    first.is_some_and(|body| {
        let axis = body.parent_from_body.rotation * body.axis.into_inner();
        axis.cross(&chain.gravity).norm() > UPRIGHT * chain.gravity.norm()
    })
}

/// Returns the parameters at which a law does nothing.
fn neutral(law: Law) -> Vec<f64> {
    law.specs().iter().map(|spec| spec.neutral.unwrap_or(0.0)).collect()
}

/// Returns whether more than noise is left of what a joint's own sensors read, or it has none: a torque without a name shows
/// there before it shows anywhere else.
fn shows(model: &Model, left: &[f64], joint: usize) -> bool {
    let rows = model.course.data.n_rows();
    let channels = model.course.data.channels.iter().filter(|c| model.is_predicted(c.quantity));
    let own = channels.enumerate().filter(|(_, c)| c.quantity != Quantity::Tip && c.index == joint);
    let mut has_own = false;
    own.fold(false, |shows, (at, channel)| {
        has_own = true;
        let sum = sum_of_squares(&left[at * rows..(at + 1) * rows]);
        shows || above_noise(sum, model.judged(channel, Set::Train)) > SIGNIFICANT
    }) || !has_own
}

/// How fast what warms up fades, to begin with, s.
const FADES: [f64; 1] = [8.0];

/// Returns the words of a formula for a torque without a name, each with where its shape begins.
fn formulas(edges: &[f64], orders: &[f64], closed: bool) -> Vec<(Law, Vec<Vec<f64>>)> {
    use Feature::{
        Cosine, Decay, FrictionTimesCosine, FrictionTimesDistance, FrictionTimesLoad,
        FrictionTimesSine, One, PositionTimesSpeed, RootSpeed, Sine, SpeedCubed, Square, Time,
    };
    let mut words = vec![
        Square,
        Sine(1.0),
        Cosine(1.0),
        Sine(2.0),
        Cosine(2.0),
        PositionTimesSpeed,
        FrictionTimesDistance,
        FrictionTimesSine,
        FrictionTimesCosine,
        SpeedCubed,
        RootSpeed,
        Decay(1.0),
        Decay(5.0),
        FrictionTimesLoad,
    ];
    if closed {
        // Where torque is all that shows, a constant and a trend of it have names.
        words.extend([One, Time]);
    }
    let shapes = [
        (Law::Above, edges),
        (Law::Below, edges),
        (Law::LoadRipple, &orders[..orders.len().min(1)]),
        (Law::FadingFluid, &FADES),
    ];
    let shapes = shapes.into_iter().filter(|(_, shapes)| !shapes.is_empty());
    let shapes = shapes.map(|(law, shapes)| (law, shaped(law, shapes)));
    let fading = FADES.iter().map(|time| vec![0.0, *time, CREEP]).collect();
    let of_word = |word: Feature| {
        let starts = if word.is_friction() { vec![vec![0.0, CREEP]] } else { Vec::new() };
        (Law::Feature(word), starts)
    };
    shapes.chain([(Law::FadingDry, fading)]).chain(words.into_iter().map(of_word)).collect()
}

/// Returns the law doing nothing in each of the given shapes; its last parameter is the shape.
fn shaped(law: Law, shapes: &[f64]) -> Vec<Vec<f64>> {
    shapes
        .iter()
        .map(|shape| {
            let mut start = neutral(law);
            if let Some(last) = start.last_mut() {
                *last = *shape;
            }
            start
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::motion::Robot;
    use crate::motion::dynamics::GRAVITY;

    #[test]
    fn an_arm_weighs_on_its_first_joint_where_the_axis_lies() {
        let mut chain = Chain::new(&Robot::gen3(), None, -GRAVITY * Vector3::z()).unwrap();
        assert!(!weighs_on_first(&chain));
        chain.gravity = Vector3::new(GRAVITY, 0.0, 0.0);
        assert!(weighs_on_first(&chain));
        chain.bodies[0].slides = true;
        assert!(!weighs_on_first(&chain));
    }
}
