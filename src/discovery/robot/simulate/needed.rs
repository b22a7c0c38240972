//! The torque an arm needs more than modelled, as effects on its bodies add to it.
//!
//! It is linear in what the bodies weigh, and in gravity and where they sit, so it is added up from torque columns that the model
//! computes once: of each change by itself, and of one that makes bodies heavier beside one that moves them, since a load on a base
//! that leans pulls elsewhere than the file's bodies do. Two that move them are taken one by one: both are small.

use std::sync::Arc as Shared;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::super::chain::{Chain, PointMass};
use super::super::term::{Law, Term};
use super::model::{ColumnKey, Model};

/// Angles and lengths so small that torques are linear in them, rad or m.
const LITTLE: f64 = 1e-3;

/// The six entries of a symmetric matrix.
const ENTRIES: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// The torque needed beside what the model says, by grid point.
pub(super) struct Needed<'a> {
    model: &'a Model,
    by_point: Vec<f64>,
    /// What bodies weigh more, each by so much.
    heavier: Vec<(Heavier, f64)>,
    /// How bodies are moved, each by so much.
    elsewhere: Vec<(Elsewhere, f64)>,
}

/// One unit more of what a body weighs.
#[derive(Clone, Copy)]
enum Heavier {
    /// A body of its own mass, kg.
    Thicker(usize),
    /// A mass at a body's origin, kg.
    Mass(usize),
    /// Mass times place along an axis of a body, kg·m.
    Moment(usize, usize),
    /// What a point adds to a body's inertia, by one entry of `m c cᵀ`, kg·m².
    Inertia(usize, usize),
}

/// A way in which bodies stand otherwise to gravity.
#[derive(Clone, Copy)]
enum Elsewhere {
    /// More gravity along an axis of the base, m/s².
    Gravity(usize),
    /// A joint that sits elsewhere along an axis of the link before it, m.
    Length(usize, usize),
    /// A joint whose link stands elsewhere than its encoder says, rad or m.
    Turned(usize),
}

impl<'a> Needed<'a> {
    /// Returns whether a law changes what the bodies need.
    pub(super) fn is_of(model: &Model, law: Law) -> bool {
        use Law::{Armature, BaseTilt, LinkLength, LinkMass, ObjectMass, Payload, ZeroOffset};
        match law {
            Payload | LinkMass | ObjectMass | Armature | BaseTilt | LinkLength => true,
            ZeroOffset => model.feels_zeros(),
            _ => false,
        }
    }

    /// Returns what carrying took, as far as it is known.
    pub(super) fn of_carried(model: &'a Model) -> Self {
        let mut by_point = model.carried.to_vec();
        by_point.resize(model.course.plant.len * model.course.plant.n, 0.0);
        Self { model, by_point, heavier: Vec::new(), elsewhere: Vec::new() }
    }

    /// Adds an effect by itself.
    pub(super) fn add(&mut self, term: &Term, p: &[f64]) {
        let j = term.joint;
        match term.law {
            Law::Payload => self.payload(p),
            Law::LinkMass => self.link_mass(j, p[0]),
            Law::ObjectMass => {
                for load in self.model.loads.iter().filter(|load| load.thing == j) {
                    accumulate(&mut self.by_point, &load.per_kilogram, p[0]);
                }
            }
            Law::Armature => self.rotor(j, p[0]),
            Law::BaseTilt => self.tilt(p),
            Law::ZeroOffset => self.turned(j, p[0]),
            Law::LinkLength => {
                for (axis, by) in p.iter().enumerate() {
                    self.moved(Elsewhere::Length(j, axis), *by);
                }
            }
            _ => {}
        }
    }

    /// Returns all of it, by grid point: with what the effects take together beyond each by itself.
    pub(super) fn together(mut self) -> Vec<f64> {
        for (heavier, more) in &self.heavier {
            for (elsewhere, by) in &self.elsewhere {
                let column = self.model.crossed(*heavier, *elsewhere);
                accumulate(&mut self.by_point, &column, more * by);
            }
        }
        self.by_point
    }

    fn weighs(&mut self, heavier: Heavier, more: f64) {
        let column = self.model.column(heavier.key(), 1.0, |chain| heavier.change(chain));
        accumulate(&mut self.by_point, &column, more);
        // How something is spread feels no gravity.
        if !matches!(heavier, Heavier::Inertia(..)) {
            self.heavier.push((heavier, more));
        }
    }

    fn moved(&mut self, elsewhere: Elsewhere, by: f64) {
        let unit = elsewhere.unit();
        let column = self.model.column(elsewhere.key(), unit, |chain| elsewhere.change(chain));
        accumulate(&mut self.by_point, &column, by);
        self.elsewhere.push((elsewhere, by));
    }

    /// A link weighs more, kg; its own mass tells how the new one is spread.
    fn link_mass(&mut self, j: usize, more: f64) {
        let own = self.model.arm.chain.bodies[j].mass;
        if own > 0.0 {
            self.weighs(Heavier::Thicker(j), more / own);
        }
    }

    /// A joint has a rotor, kg·m².
    fn rotor(&mut self, j: usize, inertia: f64) {
        let plant = &self.model.course.plant;
        for (row, ddq) in self.by_point.chunks_mut(plant.n).zip(plant.ddq.chunks(plant.n)) {
            row[j] += inertia * ddq[j];
        }
    }

    /// The base leans by roll and pitch, rad.
    fn tilt(&mut self, p: &[f64]) {
        let gravity = &self.model.arm.chain.gravity;
        let tilt = nalgebra::Rotation3::from_euler_angles(p[0], p[1], 0.0);
        let along = tilt.inverse_transform_vector(gravity) - gravity;
        for axis in 0..3 {
            self.moved(Elsewhere::Gravity(axis), along[axis]);
        }
    }

    /// A point mass is linear in mass and mass times place.
    fn payload(&mut self, p: &[f64]) {
        let body = self.model.arm.chain.n() - 1;
        let tip = self.model.arm.chain.body_from_tip;
        // First moment about the body's origin, in its axes.
        let mass = p[0];
        let moment = tip.rotation * Vector3::new(p[1], p[2], p[3]) + mass * tip.translation.vector;
        // A mass of nothing has no place; its inertia is nothing too.
        let place = if mass.abs() > 1e-3 { moment / mass } else { Vector3::zeros() };
        self.weighs(Heavier::Mass(body), mass);
        for axis in 0..3 {
            self.weighs(Heavier::Moment(body, axis), moment[axis]);
        }
        for (at, (i, k)) in ENTRIES.into_iter().enumerate() {
            self.weighs(Heavier::Inertia(body, at), mass * place[i] * place[k]);
        }
    }

    /// The links stand elsewhere than the encoder says, so they weigh otherwise.
    fn turned(&mut self, joint: usize, by: f64) {
        let plant = &self.model.course.plant;
        for (at, to) in self.by_point.iter_mut().enumerate() {
            *to += plant.stiffness[at * plant.n + joint] * by;
        }
        self.elsewhere.push((Elsewhere::Turned(joint), by));
    }
}

impl Heavier {
    fn key(self) -> ColumnKey {
        match self {
            Self::Mass(body) => (2, body, 0),
            Self::Moment(body, axis) => (2, body, axis as u8 + 1),
            Self::Inertia(body, at) => (3, body, at as u8),
            Self::Thicker(body) => (4, body, 0),
        }
    }

    fn change(self, chain: &mut Chain) {
        match self {
            Self::Thicker(body) => chain.bodies[body].thicken(1.0),
            Self::Mass(body) => {
                chain.add_point(&PointMass { body, mass: 1.0, moment: Vector3::zeros() });
            }
            Self::Moment(body, axis) => {
                let mut moment = Vector3::zeros();
                moment[axis] = 1.0;
                chain.add_point(&PointMass { body, mass: 0.0, moment });
            }
            Self::Inertia(body, at) => {
                let inertia = &mut chain.bodies[body].inertia;
                // -[c]×[c]× = |c|² 1 - c cᵀ, entry by entry of c cᵀ.
                let (i, k) = ENTRIES[at];
                if i == k {
                    for d in (0..3).filter(|d| *d != i) {
                        inertia[(d, d)] += 1.0;
                    }
                } else {
                    inertia[(i, k)] -= 1.0;
                    inertia[(k, i)] -= 1.0;
                }
            }
        }
    }
}

impl Elsewhere {
    fn key(self) -> ColumnKey {
        match self {
            Self::Gravity(axis) => (0, 0, axis as u8),
            Self::Length(joint, axis) => (1, joint, axis as u8),
            Self::Turned(joint) => (5, joint, 0),
        }
    }

    /// How much [`Self::change`] does, m/s², m or rad.
    fn unit(self) -> f64 {
        if matches!(self, Self::Gravity(_)) { 1.0 } else { LITTLE }
    }

    fn change(self, chain: &mut Chain) {
        match self {
            Self::Gravity(axis) => chain.gravity[axis] += 1.0,
            Self::Length(joint, axis) => lengthen(chain, joint, axis, LITTLE),
            Self::Turned(joint) => {
                let body = &mut chain.bodies[joint];
                let axis = body.axis.into_inner() * LITTLE;
                let by = if body.slides {
                    Isometry3::from_parts(Translation3::from(axis), UnitQuaternion::identity())
                } else {
                    Isometry3::from_parts(Translation3::identity(), UnitQuaternion::new(axis))
                };
                body.sit(body.parent_from_body * by);
            }
        }
    }
}

impl Model {
    /// Returns what one unit of each takes beyond both by themselves, by grid point, computed once.
    fn crossed(&self, heavier: Heavier, elsewhere: Elsewhere) -> Shared<Vec<f64>> {
        let key = (heavier.key(), elsewhere.key());
        self.crosses.of(key, |_| {
            let mut moved = self.arm.clone();
            elsewhere.change(&mut moved.chain);
            let there = self.course.plant.column(&moved, |chain| heavier.change(chain), 1.0);
            let here = self.column(heavier.key(), 1.0, |chain| heavier.change(chain));
            let pairs = there.iter().zip(&*here);
            pairs.map(|(there, here)| (there - here) / elsewhere.unit()).collect()
        })
    }
}

fn accumulate(by_point: &mut [f64], column: &[f64], factor: f64) {
    if factor.abs() > 0.0 {
        for (to, value) in by_point.iter_mut().zip(column) {
            *to += factor * value;
        }
    }
}

/// Moves joint `j` along one axis of the link before it, m.
pub(super) fn lengthen(chain: &mut Chain, j: usize, axis: usize, by: f64) {
    let mut shift = Vector3::zeros();
    shift[axis] = by;
    chain.bodies[j].parent_from_body.translation.vector += shift;
}
