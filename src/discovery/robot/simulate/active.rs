//! The effects of a list sorted by where they act: on the command, in a joint, on the bodies, at a sensor.
//!
//! What changes the bodies is added up in `needed`.

use std::collections::BTreeMap;
use std::sync::Arc as Shared;

use nalgebra::{Matrix3, Vector3};

use super::super::chain::MOST_JOINTS;
use super::super::channels::Quantity;
use super::super::term::{Law, Term, of_each, only};
use super::friction::{By, Dry, Loop, Smooth};
use super::model::Model;
use super::needed::Needed;

/// The effects sorted by where they act.
pub(super) struct ActiveEffects {
    pub(super) delay: f64,
    pub(super) gain: [f64; MOST_JOINTS],
    pub(super) limit: [f64; MOST_JOINTS],
    pub(super) dry: Vec<Dry>,
    pub(super) smooth: Vec<(usize, Smooth)>,
    pub(super) loops: Vec<Loop>,
    /// Torque the arm needs more than modelled, by grid point; empty where that is nothing.
    pub(super) needed: Shared<Vec<f64>>,
    pub(super) zero: [f64; MOST_JOINTS],
    pub(super) compliance: [f64; MOST_JOINTS],
    pub(super) sag: [f64; MOST_JOINTS],
    pub(super) play: [f64; MOST_JOINTS],
    pub(super) torque_gain: [f64; MOST_JOINTS],
    pub(super) torque_offset: [f64; MOST_JOINTS],
    pub(super) torque_drift: [f64; MOST_JOINTS],
    pub(super) lengths: [Vector3<f64>; MOST_JOINTS],
    pub(super) has_lengths: bool,
    pub(super) tool: Vector3<f64>,
    pub(super) shift: Vector3<f64>,
    pub(super) turn: Matrix3<f64>,
    pub(super) late: BTreeMap<Quantity, f64>,
}

/// What acts in one joint, in the order of its effects.
#[derive(Debug, PartialEq)]
pub(super) struct AtJoint {
    pub(super) gain: f64,
    pub(super) limit: f64,
    pub(super) sag: f64,
    pub(super) play: f64,
    pub(super) smooth: Vec<Smooth>,
    pub(super) loops: Vec<Loop>,
    pub(super) dry: Vec<Dry>,
}

impl ActiveEffects {
    /// Sorts effects by where they act.
    pub(super) fn sorted(model: &Model, terms: &[Term], parameters: &[f64]) -> Self {
        let mut active = Self {
            delay: 0.0,
            gain: [1.0; MOST_JOINTS],
            limit: [f64::INFINITY; MOST_JOINTS],
            dry: Vec::new(),
            smooth: Vec::new(),
            loops: Vec::new(),
            needed: Shared::clone(&model.carried),
            zero: [0.0; MOST_JOINTS],
            compliance: [0.0; MOST_JOINTS],
            sag: [0.0; MOST_JOINTS],
            play: [0.0; MOST_JOINTS],
            torque_gain: [1.0; MOST_JOINTS],
            torque_offset: [0.0; MOST_JOINTS],
            torque_drift: [0.0; MOST_JOINTS],
            lengths: [Vector3::zeros(); MOST_JOINTS],
            has_lengths: false,
            tool: Vector3::zeros(),
            shift: Vector3::zeros(),
            turn: Matrix3::identity(),
            late: BTreeMap::new(),
        };
        if let Some(controller) = &model.arm.controller {
            for (limit, known) in active.limit.iter_mut().zip(&controller.torque_limit_nm) {
                *limit = *known;
            }
        }
        for (term, p) in of_each(terms, parameters) {
            active.add(term, p);
        }
        let bears = |law| Needed::is_of(model, law);
        let (terms, parameters) = only(terms, parameters, bears);
        if !terms.is_empty() {
            active.needed = model.borne.of((terms, parameters), |(terms, parameters)| {
                let mut needed = Needed::of_carried(model);
                of_each(terms, parameters).for_each(|(term, p)| needed.add(term, p));
                needed.together()
            });
        }
        active
    }

    /// Returns what acts in joint `j`.
    pub(super) fn at(&self, j: usize) -> AtJoint {
        AtJoint {
            gain: self.gain[j],
            limit: self.limit[j],
            sag: self.sag[j],
            play: self.play[j],
            smooth: self.smooth.iter().filter(|(own, _)| *own == j).map(|(_, law)| *law).collect(),
            loops: self.loops.iter().filter(|own| own.joint == j).copied().collect(),
            dry: self.dry.iter().filter(|own| own.joint == j).copied().collect(),
        }
    }

    fn add(&mut self, term: &Term, p: &[f64]) {
        let j = term.joint;
        let sharp = matches!(term.law, Law::Coulomb);
        let dry = |forward, backward, peak, velocity, creep| Dry {
            sharp,
            joint: j,
            forward,
            backward,
            peak,
            velocity,
            creep,
            by: By::Nothing,
        };
        let even = |level, creep| dry(level, level, 0.0, 1.0, creep);
        match term.law {
            Law::Coulomb | Law::SmoothCoulomb => self.dry.push(even(p[0], p[1])),
            Law::Asymmetric => self.dry.push(dry(p[0], p[1], 0.0, 1.0, p[2])),
            Law::Stribeck => self.dry.push(dry(p[0], p[0], p[1], p[2], p[3])),
            Law::Viscous => self.smooth.push((j, Smooth::Viscous(p[0]))),
            Law::Quadratic => self.smooth.push((j, Smooth::Quadratic(p[0]))),
            Law::Ripple => {
                let ripple = Smooth::Ripple { sine: p[0], cosine: p[1], order: p[2] };
                self.smooth.push((j, ripple));
            }
            Law::Periodic => {
                let hum = Smooth::Periodic { sine: p[0], cosine: p[1], frequency: p[2] };
                self.smooth.push((j, hum));
            }
            Law::Stiffness => self.smooth.push((j, Smooth::Stiffness(p[0]))),
            Law::CubicStiffness => self.smooth.push((j, Smooth::Cubic(p[0]))),
            Law::Feature(feature) if feature.is_friction() => {
                self.dry.push(Dry { by: By::State(feature), ..even(p[0], p[1]) });
            }
            Law::Feature(feature) => self.smooth.push((j, Smooth::Feature(feature, p[0]))),
            Law::Above => self.smooth.push((j, Smooth::Above(p[0], p[1]))),
            Law::Below => self.smooth.push((j, Smooth::Below(p[0], p[1]))),
            Law::LoadRipple => {
                let ripple = Smooth::LoadRipple { sine: p[0], cosine: p[1], order: p[2] };
                self.smooth.push((j, ripple));
            }
            Law::FadingDry => self.dry.push(Dry { by: By::Fading(p[1]), ..even(p[0], p[2]) }),
            Law::FadingFluid => self.smooth.push((j, Smooth::FadingFluid(p[0], p[1]))),
            Law::Hysteresis => {
                self.loops.push(Loop { joint: j, torque: p[0], width: p[1], z: 0.0 });
            }
            Law::TorqueOffset => self.torque_offset[j] += p[0],
            Law::TorqueGain => self.torque_gain[j] *= p[0],
            Law::TorqueDrift => self.torque_drift[j] += p[0],
            Law::Compliance => self.compliance[j] += p[0],
            Law::ServoSag => self.sag[j] += p[0],
            Law::Backlash => self.play[j] += p[0],
            Law::CommandDelay => self.delay += p[0],
            Law::ActuatorGain => self.gain[j] *= p[0],
            Law::Saturation => self.limit[j] = self.limit[j].min(p[0]),
            Law::SensorDelay(quantity) => *self.late.entry(quantity).or_insert(0.0) += p[0],
            Law::ZeroOffset => self.zero[j] += p[0],
            Law::LinkLength => {
                self.lengths[j] += Vector3::new(p[0], p[1], p[2]);
                self.has_lengths = true;
            }
            Law::ToolOffset => self.tool += Vector3::new(p[0], p[1], p[2]),
            Law::CameraShift(free) => self.shifted(free, p),
            // What the bodies need more.
            Law::Payload | Law::LinkMass | Law::ObjectMass | Law::Armature | Law::BaseTilt => {}
        }
    }

    /// The tracker stands elsewhere; `p` are those of its six numbers that are free.
    fn shifted(&mut self, free: [bool; 6], p: &[f64]) {
        let mut all = [0.0; 6];
        let mut values = p.iter();
        for (value, _) in all.iter_mut().zip(free).filter(|(_, free)| *free) {
            *value = values.next().copied().unwrap_or(0.0);
        }
        self.shift += Vector3::new(all[0], all[1], all[2]);
        let turn = nalgebra::Rotation3::from_euler_angles(all[3], all[4], all[5]);
        self.turn *= turn.matrix();
    }
}
