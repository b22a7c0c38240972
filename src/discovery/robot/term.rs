//! The effects an arm may lack, as the simulation understands them: a law and its seat.

use super::channels::Quantity;
use super::load::Thing;
use crate::discovery::selection::ParameterSpec;
use crate::discovery::vocabulary::TRACKER;

/// What a feature of an unnamed torque looks at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Feature {
    /// `q²`.
    Square,
    /// `sin(k q)`.
    Sine(f64),
    /// `cos(k q)`.
    Cosine(f64),
    /// `q·|dq|`.
    PositionTimesSpeed,
    /// `dq³`.
    SpeedCubed,
    /// `sqrt(|dq|)·sign(dq)`.
    RootSpeed,
    /// `exp(-t/τ)`.
    Decay(f64),
    /// `t`: a load that grows.
    Time,
    /// `1`: a constant load.
    One,
    /// `sign(dq)·|q|`: friction that grows away from zero.
    FrictionTimesDistance,
    /// `sign(dq)·sin(q)`: friction of a gear that does not run true.
    FrictionTimesSine,
    /// `sign(dq)·cos(q)`: the other part of it.
    FrictionTimesCosine,
    /// `sign(dq)·|load|`: friction that grows with what the gear bears.
    FrictionTimesLoad,
}

/// What an effect does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// `-torque·sign(dq)`, with a sharp corner where the joint sticks.
    Coulomb,
    /// `-torque·sign(dq)`, with a smooth one.
    SmoothCoulomb,
    /// `-coefficient·dq`.
    Viscous,
    /// `-coefficient·dq·|dq|`.
    Quadratic,
    /// Coulomb with a peak: `torque + (stiction - torque)·exp(-(dq/velocity)²)`.
    Stribeck,
    /// Coulomb that differs with direction.
    Asymmetric,
    /// A mass fixed to the last body (mass and position in the tip's frame).
    Payload,
    /// A link is heavier than its file says, its mass spread as it was.
    LinkMass,
    /// A thing that is carried for a while is heavier than modelled; which of them is the term's `joint`.
    ObjectMass,
    /// Rotor inertia.
    Armature,
    /// Gravity turned by roll and pitch of the base.
    BaseTilt,
    /// A constant on the torque channel.
    TorqueOffset,
    /// A factor on the torque channel.
    TorqueGain,
    /// A bias of the torque channel that grows from the first row.
    TorqueDrift,
    /// `amplitude·sin(order·q + phase)` at the joint.
    Ripple,
    /// A spring between encoder and link.
    Compliance,
    /// `q = q_cmd - compliance·load`, for arms whose controller is not known.
    ServoSag,
    /// Play between encoder and link.
    Backlash,
    /// Commands act late.
    CommandDelay,
    /// The drive delivers this part of the torque asked for.
    ActuatorGain,
    /// The drive's torque is clipped.
    Saturation,
    /// A group of channels is late.
    SensorDelay(Quantity),
    /// The joint stands at encoder + angle.
    ZeroOffset,
    /// The link before the joint is longer: the joint sits elsewhere in that link's frame.
    LinkLength,
    /// The tip is elsewhere in the tip's frame.
    ToolOffset,
    /// The tracker stands elsewhere: shift and turn about the base's origin. One flag per
    /// `x, y, z, roll, pitch, yaw`: only what is set is free.
    CameraShift([bool; 6]),
    /// Bouc-Wen: `-torque·z`, `width·ż = dq - |dq|·z·|z|`.
    Hysteresis,
    /// `-coefficient·q`.
    Stiffness,
    /// `-coefficient·q³`.
    CubicStiffness,
    /// `amplitude·sin(2π·frequency·t + phase)`.
    Periodic,
    /// A torque without a name: one feature times a coefficient.
    Feature(Feature),
    /// A one-sided spring: `coefficient·max(0, q - q0)`.
    Above,
    /// The other side: `coefficient·max(0, q0 - q)`.
    Below,
    /// `load·(sine·sin(order·q) + cosine·cos(order·q))`: a gear that gives and takes where it bears.
    LoadRipple,
    /// `-coefficient·sign(dq)·exp(-t/time)`: dry friction of a gear that warms up.
    FadingDry,
    /// `-coefficient·dq·exp(-t/time)`: the same of its grease.
    FadingFluid,
}

/// An effect at its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Term {
    /// What it does.
    pub law: Law,
    /// At which joint, from 0; for effects of the whole arm, 0; of things carried, which of them.
    pub joint: usize,
}

const fn spec(
    name: &'static str,
    unit: &'static str,
    scale: f64,
    range: (f64, f64),
    neutral: Option<f64>,
) -> ParameterSpec {
    ParameterSpec { name, unit, scale, range, neutral, least: 0.0 }
}

const ANY: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);
const UP: (f64, f64) = (0.0, f64::INFINITY);

/// Names of the shift's six numbers.
const SHIFT: [ParameterSpec; 6] = [
    spec("x", "m", 1e-3, ANY, Some(0.0)),
    spec("y", "m", 1e-3, ANY, Some(0.0)),
    spec("z", "m", 1e-3, ANY, Some(0.0)),
    spec("roll", "rad", 1e-3, ANY, Some(0.0)),
    spec("pitch", "rad", 1e-3, ANY, Some(0.0)),
    spec("yaw", "rad", 1e-3, ANY, Some(0.0)),
];

/// Which numbers of a tracker's shift are tried free together: all, as it stands on a level floor, shifts, its turn about the
/// vertical, turns.
pub const SHIFTS: [[bool; 6]; 5] = [
    [true, true, true, true, true, true],
    [true, true, true, false, false, true],
    [true, true, true, false, false, false],
    [false, false, false, false, false, true],
    [false, false, false, true, true, true],
];

/// A number beyond this part of its range is at the end of it: what fits lies beyond.
pub const WITHIN: f64 = 0.99;

/// A sensor or a drive that says twice or half of what it should is not overlooked.
pub const SENSIBLE_GAIN: std::ops::Range<f64> = 0.5..2.0;

/// How far a base may be tilted, rad: a little further than one on a wall is.
const TILTED: (f64, f64) = (-1.65, 1.65);

/// The speed below which dry friction gives way.
const CREEP: &str = "creep";

/// What has no name.
const UNKNOWN: &str = "unknown";

impl Law {
    /// Returns whether the law acts on one joint's torque or its reading, and on nothing else while the
    /// motion is given.
    pub fn is_local(self) -> bool {
        matches!(
            self,
            Self::Coulomb
                | Self::SmoothCoulomb
                | Self::Asymmetric
                | Self::Stribeck
                | Self::Viscous
                | Self::Quadratic
                | Self::Armature
                | Self::Stiffness
                | Self::CubicStiffness
                | Self::Hysteresis
                | Self::Ripple
                | Self::Periodic
                | Self::Above
                | Self::Below
                | Self::LoadRipple
                | Self::FadingDry
                | Self::FadingFluid
                | Self::Feature(_)
                | Self::TorqueOffset
                | Self::TorqueGain
                | Self::TorqueDrift
                | Self::ActuatorGain
                | Self::Saturation
        )
    }

    /// Returns whether the law is mechanics or geometry, which hold exactly, rather than a description of
    /// what gears and drives do.
    pub fn is_exact(self) -> bool {
        matches!(
            self,
            Self::Payload
                | Self::LinkMass
                | Self::ObjectMass
                | Self::Armature
                | Self::BaseTilt
                | Self::ZeroOffset
                | Self::LinkLength
                | Self::ToolOffset
                | Self::CameraShift(_)
                | Self::TorqueOffset
                | Self::TorqueGain
        )
    }

    /// Returns whether it is a formula rather than a law with a name.
    pub fn is_formula(self) -> bool {
        self.name() == UNKNOWN
    }

    /// Returns the name in the vocabulary.
    pub fn name(self) -> &'static str {
        match self {
            Self::Coulomb | Self::SmoothCoulomb => "coulomb_friction",
            Self::Viscous => "viscous_friction",
            Self::Quadratic => "quadratic_friction",
            Self::Stribeck => "stribeck_friction",
            Self::Asymmetric => "asymmetric_friction",
            Self::Payload => "payload",
            Self::LinkMass => "link_mass",
            Self::ObjectMass => "object_mass",
            Self::Armature => "armature",
            Self::BaseTilt => "base_tilt",
            Self::TorqueOffset => "torque_offset",
            Self::TorqueGain => "torque_gain",
            Self::TorqueDrift => "torque_drift",
            Self::Ripple => "torque_ripple",
            Self::Compliance => "joint_compliance",
            Self::ServoSag => "servo_sag",
            Self::Backlash => "backlash",
            Self::CommandDelay => "command_delay",
            Self::ActuatorGain => "actuator_gain",
            Self::Saturation => "saturation",
            Self::SensorDelay(_) => "sensor_delay",
            Self::ZeroOffset => "joint_zero_offset",
            Self::LinkLength => "link_length",
            Self::ToolOffset => "tool_offset",
            Self::CameraShift(_) => "camera_shift",
            Self::Hysteresis => "hysteresis",
            Self::Stiffness => "linear_stiffness",
            Self::CubicStiffness => "cubic_stiffness",
            Self::Periodic => "periodic_disturbance",
            Self::Feature(_)
            | Self::Above
            | Self::Below
            | Self::LoadRipple
            | Self::FadingDry
            | Self::FadingFluid => UNKNOWN,
        }
    }

    /// Returns its parameters in order, as they are fitted: linear wherever they can be. What they are
    /// called in a model file is [`super::wording`]'s business.
    pub fn specs(self) -> Vec<ParameterSpec> {
        let torque = spec("torque", "N*m", 0.05, UP, Some(0.0));
        // Below this speed dry friction gives way like a thick fluid: a held joint creeps.
        let creep = spec(CREEP, "rad/s", 2e-4, (1e-5, 0.05), None);
        let length = |name| spec(name, "m", 1e-3, ANY, Some(0.0));
        match self {
            Self::Coulomb | Self::SmoothCoulomb => vec![torque, creep],
            Self::Viscous => {
                vec![spec("coefficient", "N*m*s/rad", 0.1, UP, Some(0.0))]
            }
            Self::Quadratic => {
                vec![spec("coefficient", "N*m*s^2/rad^2", 0.1, UP, Some(0.0))]
            }
            Self::Stribeck => vec![
                torque,
                spec("peak", "N*m", 0.05, UP, Some(0.0)),
                spec("velocity", "rad/s", 0.005, (0.002, 1.0), None),
                creep,
            ],
            // One side may help the motion as long as both together resist: a constant load is in it.
            Self::Asymmetric => vec![
                spec("forward", "N*m", 0.05, ANY, Some(0.0)),
                spec("backward", "N*m", 0.05, ANY, Some(0.0)),
                creep,
            ],
            Self::Payload => vec![
                spec("mass", "kg", 0.02, ANY, Some(0.0)),
                spec("moment_x", "kg*m", 2e-3, ANY, Some(0.0)),
                spec("moment_y", "kg*m", 2e-3, ANY, Some(0.0)),
                spec("moment_z", "kg*m", 2e-3, ANY, Some(0.0)),
            ],
            Self::LinkMass => vec![spec("mass", "kg", 0.02, ANY, Some(0.0))],
            // A sip more or less, or what sticks to the outside.
            Self::ObjectMass => {
                vec![ParameterSpec { least: 5e-3, ..spec("mass", "kg", 0.02, ANY, Some(0.0)) }]
            }
            Self::Armature => vec![spec("inertia", "kg*m^2", 0.01, ANY, Some(0.0))],
            Self::BaseTilt => vec![
                spec("roll", "rad", 1e-3, TILTED, Some(0.0)),
                spec("pitch", "rad", 1e-3, TILTED, Some(0.0)),
            ],
            Self::TorqueOffset => vec![spec("torque", "N*m", 0.05, ANY, Some(0.0))],
            Self::TorqueGain => vec![spec("gain", "", 0.01, (-10.0, 10.0), Some(1.0))],
            Self::TorqueDrift => vec![spec("rate", "N*m/s", 0.01, ANY, Some(0.0))],
            Self::Ripple => vec![
                spec("sine", "N*m", 0.05, ANY, Some(0.0)),
                spec("cosine", "N*m", 0.05, ANY, Some(0.0)),
                spec("order", "", 0.02, (0.3, 400.0), None),
            ],
            Self::Compliance | Self::ServoSag => {
                vec![spec("compliance", "rad/(N*m)", 5e-5, UP, Some(0.0))]
            }
            Self::Backlash => vec![spec("width", "rad", 1e-3, UP, Some(0.0))],
            // A controller samples once a millisecond or slower: what happens within is not modelled.
            Self::CommandDelay | Self::SensorDelay(_) => {
                let delay = spec("delay", "s", 1e-3, (-0.5, 0.5), Some(0.0));
                vec![ParameterSpec { least: 1e-3, ..delay }]
            }
            Self::ActuatorGain => vec![spec("gain", "", 0.01, (0.1, 5.0), Some(1.0))],
            Self::Saturation => vec![spec("limit", "N*m", 0.05, (1e-3, 1e4), None)],
            Self::ZeroOffset => vec![spec("angle", "rad", 1e-3, ANY, Some(0.0))],
            Self::LinkLength | Self::ToolOffset => vec![length("dx"), length("dy"), length("dz")],
            Self::CameraShift(free) => {
                SHIFT.iter().zip(free).filter(|(_, free)| *free).map(|(spec, _)| *spec).collect()
            }
            Self::Hysteresis => vec![torque, spec("width", "rad", 2e-3, (1e-4, 3.0), None)],
            Self::Stiffness => vec![spec("coefficient", "N*m/rad", 0.1, ANY, Some(0.0))],
            Self::CubicStiffness => vec![spec("coefficient", "N*m/rad^3", 0.1, ANY, Some(0.0))],
            Self::Periodic => vec![
                spec("sine", "N*m", 0.05, ANY, Some(0.0)),
                spec("cosine", "N*m", 0.05, ANY, Some(0.0)),
                spec("frequency", "Hz", 2e-3, (0.01, 500.0), None),
            ],
            Self::Feature(feature) => {
                let coefficient = spec("coefficient", "", 0.05, ANY, Some(0.0));
                if feature.is_friction() { vec![coefficient, creep] } else { vec![coefficient] }
            }
            Self::LoadRipple => vec![
                spec("sine", "", 0.01, ANY, Some(0.0)),
                spec("cosine", "", 0.01, ANY, Some(0.0)),
                spec("order", "", 0.02, (0.3, 400.0), None),
            ],
            // What fades within a few rows, or over hours, is something else.
            Self::FadingDry => vec![torque, spec("time", "s", 0.5, (0.5, 1e3), None), creep],
            Self::FadingFluid => vec![
                spec("coefficient", "N*m*s/rad", 0.1, UP, Some(0.0)),
                spec("time", "s", 0.5, (0.5, 1e3), None),
            ],
            Self::Above | Self::Below => vec![
                spec("coefficient", "N*m/rad", 0.05, ANY, Some(0.0)),
                spec("q0", "rad", 0.01, ANY, None),
            ],
        }
    }

    /// Returns whether a number of the law's shape is at an end of its range, so that what fits lies beyond it and is something
    /// else. Friction may give way as sharply or as softly as it likes.
    pub fn has_run_out(self, parameters: &[f64]) -> bool {
        let is_at_end = |(spec, value): (&ParameterSpec, &f64)| {
            let (low, high) = spec.range;
            let is_shape = spec.neutral.is_none() && spec.name != CREEP && high.is_finite();
            is_shape && !(low / WITHIN..WITHIN * high).contains(value)
        };
        self.specs().iter().zip(parameters).any(is_at_end)
    }

    /// Returns whether the law changes the motion or the torques, rather than only what sensors say.
    pub fn moves(self) -> bool {
        !matches!(
            self,
            Self::TorqueOffset
                | Self::TorqueGain
                | Self::TorqueDrift
                | Self::SensorDelay(_)
                | Self::ToolOffset
                | Self::CameraShift(_)
        )
    }

    /// Returns whether the law acts at one joint rather than on the whole arm.
    pub fn is_at_joint(self) -> bool {
        !matches!(
            self,
            Self::Payload
                | Self::ObjectMass
                | Self::BaseTilt
                | Self::CommandDelay
                | Self::SensorDelay(_)
                | Self::ToolOffset
                | Self::CameraShift(_)
        )
    }
}

impl Term {
    /// Returns whether it can do all that `special` can, on an arm of `n` joints.
    pub fn contains(&self, special: &Self, n: usize) -> bool {
        use Law::{Asymmetric, CameraShift, Coulomb, SmoothCoulomb, Stribeck};
        match (self.law, special.law) {
            (Law::Payload, Law::LinkMass) => special.joint + 1 == n,
            (Asymmetric | Stribeck, Coulomb | SmoothCoulomb) => self.joint == special.joint,
            (CameraShift(a), CameraShift(b)) => a.iter().zip(b).all(|(a, b)| *a || !b),
            _ => false,
        }
    }

    /// Returns the name of its seat; `things` are what was carried.
    pub fn site(&self, things: &[Thing]) -> String {
        match self.law {
            Law::ObjectMass => {
                things.get(self.joint).map_or_else(|| "object".into(), |thing| thing.name.clone())
            }
            Law::Payload | Law::ToolOffset => "tool".into(),
            Law::BaseTilt => "base".into(),
            Law::CommandDelay => "robot".into(),
            Law::CameraShift(_) => "camera".into(),
            Law::SensorDelay(quantity) => quantity.stem().into(),
            _ => format!("joint_{}", self.joint + 1),
        }
    }

    /// Returns the name of its seat in a model file, which tells a tracker from the scene's camera.
    pub fn seat(&self, things: &[Thing]) -> String {
        match self.law {
            Law::CameraShift(_) => TRACKER.into(),
            _ => self.site(things),
        }
    }
}

impl Feature {
    /// Returns whether it is dry friction, whose level goes by a state: it gives way about standstill as all dry friction does, and
    /// resists the motion where its coefficient is positive.
    pub fn is_friction(self) -> bool {
        matches!(
            self,
            Self::FrictionTimesDistance
                | Self::FrictionTimesSine
                | Self::FrictionTimesCosine
                | Self::FrictionTimesLoad
        )
    }

    /// Returns the feature's value where the joint bears `load`, N·m; of friction without the sign of the speed.
    pub fn value(self, q: f64, dq: f64, time: f64, load: f64) -> f64 {
        match self {
            Self::Square => q * q,
            Self::Sine(k) => (k * q).sin(),
            Self::Cosine(k) => (k * q).cos(),
            Self::PositionTimesSpeed => q * dq.abs(),
            Self::SpeedCubed => dq.powi(3),
            Self::RootSpeed => dq.abs().sqrt() * dq.signum(),
            Self::Decay(tau) => (-time / tau).exp(),
            Self::Time => time,
            Self::One => 1.0,
            Self::FrictionTimesDistance => q.abs(),
            Self::FrictionTimesSine => q.sin(),
            Self::FrictionTimesCosine => q.cos(),
            Self::FrictionTimesLoad => load.abs(),
        }
    }
}

/// Returns each effect with its parameters.
pub fn of_each<'a>(
    terms: &'a [Term],
    mut parameters: &'a [f64],
) -> impl Iterator<Item = (&'a Term, &'a [f64])> {
    terms.iter().map(move |term| {
        let (own, others) = parameters.split_at(term.law.specs().len());
        parameters = others;
        (term, own)
    })
}

/// Returns the effects of a kind with their parameters.
pub fn only(
    terms: &[Term],
    parameters: &[f64],
    is_wanted: impl Fn(Law) -> bool,
) -> (Vec<Term>, Vec<f64>) {
    let mut wanted = (Vec::new(), Vec::new());
    for (term, own) in of_each(terms, parameters).filter(|(term, _)| is_wanted(term.law)) {
        wanted.0.push(*term);
        wanted.1.extend_from_slice(own);
    }
    wanted
}
