//! `RECORDING.json`: what is known of the machine that made a recording. Every key is optional.
//!
//! A run that is exported brings its own, beside a table or as metadata of a bag: [`Sidecar::text`].

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::{Error, Flaw, Segment, SidecarFlaw};

/// The name of the metadata record of a bag that holds its sidecar.
pub const METADATA: &str = "trueup.sidecar";

/// The key of its text in that record.
pub const TEXT: &str = "json";

/// What a sidecar says of who wrote it, if that was an export.
const EXPORTED: &str = "trueup export";

/// Which side of the gear the torque is measured on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TorqueSensor {
    /// Current times motor constant: friction and rotor inertia are in it.
    #[default]
    Motor,
    /// Past the gear: they are not.
    Link,
}

/// A joint controller: `tau = kp (q_cmd - q) + kd (dq_cmd - dq) + gravity(q_cmd)`, clipped.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Controller {
    /// Its kind: `pd_with_gravity`, or `pd` without the gravity term.
    #[serde(rename = "type")]
    pub kind: String,
    /// Gain on position, N·m/rad.
    pub kp_nm_per_rad: Vec<f64>,
    /// Gain on speed, N·m·s/rad.
    pub kd_nm_s_per_rad: Vec<f64>,
    /// Largest torque, N·m; none if empty.
    #[serde(default)]
    pub torque_limit_nm: Vec<f64>,
    /// How often it runs, Hz.
    #[serde(default = "usual_rate")]
    pub rate_hz: f64,
}

fn usual_rate() -> f64 {
    1000.0
}

/// One standard deviation for all, or one each.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum PerChannel {
    /// The same for every channel.
    One(f64),
    /// One per channel.
    Each(Vec<f64>),
}

impl PerChannel {
    /// Returns the value of a channel, counted from 0.
    pub fn of(&self, channel: usize) -> Option<f64> {
        match self {
            Self::One(value) => Some(*value),
            Self::Each(values) => values.get(channel).copied(),
        }
    }

    /// Returns the values that are written down: one, or one per channel.
    pub fn values(&self) -> &[f64] {
        match self {
            Self::One(value) => std::slice::from_ref(value),
            Self::Each(values) => values,
        }
    }
}

/// Gravity as it is written down, m/s²: how strong it is along the base's -z, or a vector in the base's axes.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(untagged, expecting = "`gravity_m_s2` is a number or three: x, y, z of the base")]
enum WrittenGravity {
    Down(f64),
    Vector([f64; 3]),
}

impl WrittenGravity {
    fn vector(self) -> [f64; 3] {
        match self {
            Self::Down(strength) => [0.0, 0.0, -strength],
            Self::Vector(vector) => vector,
        }
    }
}

/// Standard deviations of the sensors' noise.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default)]
pub struct NoiseLevels {
    /// Of joint positions, rad.
    pub q_rad: Option<PerChannel>,
    /// Of joint speeds, rad/s.
    pub dq_rad_s: Option<PerChannel>,
    /// Of joint torques, N·m.
    pub tau_nm: Option<PerChannel>,
    /// Of the tip's position, m.
    pub tcp_m: Option<PerChannel>,
}

/// What is known of the machine.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sidecar {
    /// A robot of the stdlib, or a URDF file.
    pub robot: Option<String>,
    /// The link whose position `tcp_*` is.
    pub tip: Option<String>,
    /// Which side of the gear `tau_*` is measured on.
    pub torque_sensor: TorqueSensor,
    /// Gravity, m/s², base axes: along -z for an arm that stands, along +z for one that hangs.
    pub gravity: Option<[f64; 3]>,
    /// Rotor inertia of each joint as seen at the joint, kg·m².
    pub armature: Vec<f64>,
    /// Zeros of the encoders that are known: real angle less the reported one, rad, a joint each; none for none.
    pub zero_offset: Vec<f64>,
    /// What each drive turns an ampere into, N·m at the joint; below 0 where its current counts the other way.
    pub torque_constant: Option<PerChannel>,
    /// The controller, if known.
    pub controller: Option<Controller>,
    /// Noise of the sensors.
    pub noise: NoiseLevels,
    /// Step of the encoders, rad.
    pub encoder_step: Option<f64>,
    /// Stretches of time with a name.
    pub segments: Vec<Segment>,
    /// Which vessels a pour was between.
    pub pour: Option<Vessels>,
    /// What was held, in a recording of its places.
    pub held: Option<HeldObject>,
    /// What the hand carried, in a recording of torques.
    pub carried: Vec<Carried>,
    /// When the arm pushed, pulled or pressed, nobody knows how hard: its torques are not judged then.
    pub contacts: Vec<Segment>,
}

/// What the hand carried for a while, as far as it is known.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Carried {
    /// Its name in the scene.
    pub object: String,
    /// It was taken between these times, s: before the first the table bears it, after the second the hand.
    pub taken_s: [f64; 2],
    /// It was left between these times, s.
    pub left_s: [f64; 2],
    /// Its mass without what is in it, kg.
    pub mass_kg: f64,
    /// What was in it, kg, as pairs of time and mass; linear between them.
    #[serde(default)]
    pub contents_kg: Vec<[f64; 2]>,
    /// Where its middle of mass was, in the frame of the tip, m.
    pub com_m: [f64; 3],
}

impl Carried {
    /// Returns what is wrong with it, if anything is.
    fn mistake(&self) -> Option<SidecarFlaw> {
        let times = [self.taken_s[0], self.taken_s[1], self.left_s[0], self.left_s[1]];
        let rows: Vec<f64> = self.contents_kg.iter().map(|[time, _]| *time).collect();
        let numbers = self.contents_kg.iter().flatten().chain(&self.com_m).chain(&times);
        if !numbers.chain([&self.mass_kg]).all(|value| value.is_finite()) {
            return Some(SidecarFlaw::CarriedNumbers);
        }
        if !times.is_sorted() || !rows.is_sorted() {
            return Some(SidecarFlaw::CarriedTimes(self.object.clone()));
        }
        (self.mass_kg < 0.0).then_some(SidecarFlaw::CarriedMass(self.mass_kg))
    }
}

/// The vessels of a pour, by their names in the scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Vessels {
    /// The one poured from.
    pub source: String,
    /// The one on the scale.
    pub target: String,
    /// What the source held at first, as scales said afterwards, m³.
    #[serde(default)]
    pub held_m3: Option<f64>,
    /// What the source was believed to hold at first, m³; without it what the scene fills it with.
    #[serde(default)]
    pub first_m3: Option<f64>,
    /// What the target held at first, m³; without it nothing.
    #[serde(default)]
    pub there_m3: Option<f64>,
    /// What was beside both vessels at the end, m³.
    #[serde(default)]
    pub spilt_m3: Option<f64>,
    /// What the hand bore before it poured, by the joints' torques: the source with what was in it, kg.
    #[serde(default)]
    pub borne_kg: Option<f64>,
}

/// Which point of a thing a recording's `object_x, object_y, object_z` is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// The middle of what it stands on, as everywhere in a scene.
    #[default]
    Base,
    /// The middle of it.
    Centre,
    /// The middle of its top.
    Top,
}

/// What is known of the thing in the hand.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default)]
pub struct HeldObject {
    /// Its name in the scene.
    pub object: Option<String>,
    /// Its mass with all that is in it, kg; the scene's if it is not given.
    pub mass_kg: Option<f64>,
    /// The force of one finger on it, N.
    pub squeeze_n: Option<f64>,
    /// Which point of it was followed.
    pub origin: Origin,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Raw {
    robot: Option<String>,
    tip: Option<String>,
    torque_sensor: TorqueSensor,
    gravity_m_s2: Option<WrittenGravity>,
    armature_kg_m2: Option<PerChannel>,
    zero_offset_rad: Vec<f64>,
    torque_constant_nm_per_a: Option<PerChannel>,
    controller: Option<Controller>,
    noise: NoiseLevels,
    encoder_step_rad: Option<f64>,
    segments: Vec<RawSegment>,
    pour: Option<Vessels>,
    held: Option<HeldObject>,
    carried: Vec<Carried>,
    contacts: Vec<RawSegment>,
}

#[derive(Serialize, Deserialize)]
struct RawSegment {
    name: String,
    from_s: f64,
    to_s: f64,
}

impl RawSegment {
    fn of(segment: &Segment) -> Self {
        Self { name: segment.name.clone(), from_s: segment.from, to_s: segment.to }
    }

    fn read(self) -> Segment {
        Segment { name: self.name, from: self.from_s, to: self.to_s }
    }
}

/// What a run says of its recording, as it is written.
#[derive(Serialize)]
struct Told<'a> {
    written_by: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    robot: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    tip: Option<&'a str>,
    torque_sensor: TorqueSensor,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    zero_offset_rad: &'a [f64],
    segments: Vec<RawSegment>,
    carried: &'a [Carried],
    contacts: Vec<RawSegment>,
}

/// Returns whether the text of a sidecar was written by an export: [`Sidecar::text`].
pub fn is_exported(text: &str) -> bool {
    let read = serde_json::from_str::<serde_json::Value>(text);
    read.is_ok_and(|value| value["written_by"] == EXPORTED)
}

impl Sidecar {
    /// Reads the file beside a recording, (name, text), if there is one.
    pub(super) fn beside(file: Option<(&str, &str)>) -> Result<Self, Error> {
        file.map_or_else(|| Ok(Self::default()), |(name, text)| Self::read(name, text))
    }

    /// Returns as JSON what a run says of its recording: robot and tip, the side of the gear, calibrated zeros, steps, what was
    /// carried, and when the arm leaned on something. [`Self::read`] reads it.
    pub fn text(&self) -> String {
        let told = Told {
            written_by: EXPORTED,
            robot: self.robot.as_deref(),
            tip: self.tip.as_deref(),
            torque_sensor: self.torque_sensor,
            zero_offset_rad: &self.zero_offset,
            segments: self.segments.iter().map(RawSegment::of).collect(),
            carried: &self.carried,
            contacts: self.contacts.iter().map(RawSegment::of).collect(),
        };
        serde_json::to_string(&told).expect("words, numbers and lists of them are JSON")
    }

    /// Returns it by a clock that shows `by` s more.
    #[cfg(feature = "bags")]
    pub(super) fn later(mut self, by: f64) -> Self {
        for segment in self.segments.iter_mut().chain(&mut self.contacts) {
            segment.from += by;
            segment.to += by;
        }
        for carried in &mut self.carried {
            for time in carried.taken_s.iter_mut().chain(&mut carried.left_s) {
                *time += by;
            }
            for [time, _] in &mut carried.contents_kg {
                *time += by;
            }
        }
        self
    }

    /// Reads the JSON text of a sidecar. Keys it does not know are left alone.
    ///
    /// # Errors
    ///
    /// An [`Error`] for text that is not JSON, a value of the wrong type, a gain or noise that is
    /// negative or not finite.
    pub fn read(name: &str, text: &str) -> Result<Self, Error> {
        let wrong = |flaw: SidecarFlaw| Flaw::Sidecar(flaw).at(name);
        let raw: Raw = serde_json::from_str(text)
            .map_err(|error| wrong(SidecarFlaw::NoSidecar(error.to_string())))?;
        let levels = [
            ("noise.q_rad", &raw.noise.q_rad),
            ("noise.dq_rad_s", &raw.noise.dq_rad_s),
            ("noise.tau_nm", &raw.noise.tau_nm),
            ("noise.tcp_m", &raw.noise.tcp_m),
            ("armature_kg_m2", &raw.armature_kg_m2),
        ];
        for (key, level) in levels {
            let values = level.as_ref().map_or(&[][..], PerChannel::values);
            if let Some(value) = values.iter().find(|value| !value.is_finite() || **value < 0.0) {
                return Err(wrong(SidecarFlaw::Negative(key, *value)));
            }
        }
        if let Some(controller) = &raw.controller {
            let gains = [
                ("kp_nm_per_rad", &controller.kp_nm_per_rad),
                ("kd_nm_s_per_rad", &controller.kd_nm_s_per_rad),
                ("torque_limit_nm", &controller.torque_limit_nm),
            ];
            for (key, values) in gains {
                if let Some(value) = values.iter().find(|v| !v.is_finite() || **v < 0.0) {
                    return Err(wrong(SidecarFlaw::NegativeGain(key, *value)));
                }
            }
            if controller.kp_nm_per_rad.len() != controller.kd_nm_s_per_rad.len() {
                return Err(wrong(SidecarFlaw::UnequalGains));
            }
            if !(controller.rate_hz.is_finite() && controller.rate_hz > 0.0) {
                let (key, rate) = ("controller.rate_hz", controller.rate_hz);
                return Err(wrong(SidecarFlaw::NotPositive(key, rate)));
            }
        }
        let held = raw
            .held
            .iter()
            .flat_map(|held| [("held.mass_kg", held.mass_kg), ("held.squeeze_n", held.squeeze_n)]);
        for (key, value) in held {
            if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
                return Err(wrong(SidecarFlaw::NotPositive(key, value)));
            }
        }
        if let Some(mistake) = raw.carried.iter().find_map(Carried::mistake) {
            return Err(wrong(mistake));
        }
        if let Some(zero) =
            raw.zero_offset_rad.iter().find(|zero| zero.abs().total_cmp(&PI).is_gt())
        {
            return Err(wrong(SidecarFlaw::NotAngle("zero_offset_rad", *zero)));
        }
        let gravity = raw.gravity_m_s2.map(WrittenGravity::vector);
        if gravity.iter().flatten().any(|part| !part.is_finite()) {
            return Err(wrong(SidecarFlaw::Gravity));
        }
        let [segments, contacts] =
            [raw.segments, raw.contacts].map(|all| all.into_iter().map(RawSegment::read).collect());
        let armature = match raw.armature_kg_m2 {
            None => Vec::new(),
            // More joints than any arm has; each takes what it needs.
            Some(PerChannel::One(value)) => vec![value; 64],
            Some(PerChannel::Each(values)) => values,
        };
        Ok(Self {
            robot: raw.robot,
            tip: raw.tip,
            torque_sensor: raw.torque_sensor,
            gravity,
            armature,
            zero_offset: raw.zero_offset_rad,
            torque_constant: raw.torque_constant_nm_per_a,
            controller: raw.controller,
            noise: raw.noise,
            encoder_step: raw.encoder_step_rad,
            segments,
            pour: raw.pour,
            held: raw.held,
            carried: raw.carried,
            contacts,
        })
    }
}
