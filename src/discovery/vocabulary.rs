//! The names of what a twin can lack: kind, how common it is, where it may sit, its parameters with units.
//!
//! One table, [`KINDS`]. A model file holds an effect as `name(at) { parameter = value unit }`, `gap`
//! names it, JSON prints it: all three take their words from here. How an effect acts on a motion is
//! the business of whoever simulates it ([`super::robot`] for arms, `equation` for models).
//!
//! Where the field has a name, it is the field's name: Olsson et al., "Friction Models and Friction
//! Compensation", 1998 (friction); Brown 1966 (lenses); Bouc 1967, Wen 1976 (hysteresis).

use crate::language::ast::{Name, TwinItem};
use crate::language::{Diagnostic, nearest};
use crate::units::Unit;

/// Where an effect may sit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SiteKind {
    /// `joint_n`.
    Joint,
    /// The name of a link, or `tool` for what is mounted on the last one.
    Link,
    /// `robot`: all of it.
    Robot,
    /// `base`.
    Base,
    /// `tool`.
    Tool,
    /// A measured channel: `q`, `dq`, `tau`, `tcp`.
    Channel,
    /// A camera or tracker.
    Camera,
    /// The table.
    Table,
    /// An object of the scene.
    Object,
    /// The gripper.
    Gripper,
    /// A state of a model.
    State,
    /// An input of a model.
    Input,
    /// An output of a model.
    Output,
    /// Anywhere at all.
    Anywhere,
}

/// One parameter of a kind of effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ParameterKind {
    /// Its name.
    pub name: &'static str,
    /// Its SI unit as the language writes it; empty for a plain number, `?` where it depends on the
    /// state or output it sits at.
    pub unit: &'static str,
    /// The names of its components in a model file when it is a vector; empty for a number.
    pub components: &'static [&'static str],
}

/// How common an effect is beside others that fit equally well, before anything is measured: judged by what commissioning and
/// laboratory benches meet. Chosen, not measured: three steps are all that such odds are good for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Odds {
    /// What moves rubs and weighs, what measures has a zero and a scale.
    Common,
    /// One in ten of those.
    Uncommon,
    /// One in a hundred.
    Rare,
}

impl Odds {
    /// Returns what naming such an effect costs in the criterion: -2 ln of the odds.
    pub fn price(self) -> f64 {
        let odds: f64 = match self {
            Self::Common => 1.0,
            Self::Uncommon => 0.1,
            Self::Rare => 0.01,
        };
        -2.0 * odds.ln()
    }
}

/// A kind of effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kind {
    /// Its name, for ever.
    pub name: &'static str,
    /// How common it is beside the others.
    pub odds: Odds,
    /// Where it may sit.
    pub sites: &'static [SiteKind],
    /// Its parameters.
    pub parameters: &'static [ParameterKind],
    /// What it does, in words.
    pub does: &'static str,
    /// How it shows in a residual.
    pub shows: &'static str,
}

const fn number(name: &'static str, unit: &'static str) -> ParameterKind {
    ParameterKind { name, unit, components: &[] }
}

const COM: ParameterKind =
    ParameterKind { name: "com", unit: "m", components: &["com_x", "com_y", "com_z"] };
const XYZ: ParameterKind = ParameterKind { name: "xyz", unit: "m", components: &["x", "y", "z"] };
const RPY: ParameterKind =
    ParameterKind { name: "rpy", unit: "rad", components: &["roll", "pitch", "yaw"] };

const fn kind(
    name: &'static str,
    odds: Odds,
    sites: &'static [SiteKind],
    parameters: &'static [ParameterKind],
    does: &'static str,
    shows: &'static str,
) -> Kind {
    Kind { name, odds, sites, parameters, does, shows }
}

/// Every effect that has a name.
pub const KINDS: &[Kind] = &[
    // Robot: effort.
    kind(
        "coulomb_friction",
        Odds::Common,
        &[SiteKind::Joint, SiteKind::State],
        &[number("torque", "N*m"), number("creep", "rad/s")],
        "friction of constant size against the motion",
        "a two-level square with sign(dq)",
    ),
    kind(
        "viscous_friction",
        Odds::Common,
        &[SiteKind::Joint, SiteKind::State],
        &[number("coefficient", "N*m*s/rad")],
        "friction that grows with speed",
        "proportional to dq",
    ),
    kind(
        "quadratic_friction",
        Odds::Uncommon,
        &[SiteKind::Joint, SiteKind::State],
        &[number("coefficient", "N*m*s^2/rad^2")],
        "friction that grows with the square of speed",
        "grows with dq*abs(dq)",
    ),
    kind(
        "stribeck_friction",
        Odds::Uncommon,
        &[SiteKind::Joint, SiteKind::State],
        &[
            number("torque", "N*m"),
            number("stiction", "N*m"),
            number("velocity", "rad/s"),
            number("creep", "rad/s"),
        ],
        "friction with a peak at breakaway that dies with speed",
        "largest just above standstill",
    ),
    kind(
        "asymmetric_friction",
        Odds::Uncommon,
        &[SiteKind::Joint, SiteKind::State],
        &[number("forward", "N*m"), number("backward", "N*m"), number("creep", "rad/s")],
        "friction that differs with direction",
        "two levels that are not symmetric about 0",
    ),
    kind(
        "payload",
        Odds::Common,
        &[SiteKind::Link, SiteKind::Tool],
        &[number("mass", "kg"), COM],
        "a mass that the model lacks",
        "gravity and inertia of one point mass over all joints before it",
    ),
    kind(
        "link_mass",
        Odds::Common,
        &[SiteKind::Joint],
        &[number("mass", "kg")],
        "the link after the joint is heavier than modelled, its mass spread as before",
        "gravity and inertia of that link over all joints before it",
    ),
    kind(
        "armature",
        Odds::Common,
        &[SiteKind::Joint],
        &[number("inertia", "kg*m^2")],
        "rotor inertia",
        "proportional to ddq of that joint",
    ),
    kind(
        "base_tilt",
        Odds::Uncommon,
        &[SiteKind::Base],
        &[number("roll", "rad"), number("pitch", "rad")],
        "the base is tilted, so gravity is not along its -z",
        "like a turned gravity vector",
    ),
    kind(
        "torque_offset",
        Odds::Common,
        &[SiteKind::Joint],
        &[number("torque", "N*m")],
        "bias of the torque sensor",
        "constant",
    ),
    kind(
        "torque_gain",
        Odds::Uncommon,
        &[SiteKind::Joint],
        &[number("gain", "")],
        "scale error of the torque sensor or the motor constant",
        "proportional to the predicted torque",
    ),
    kind(
        "torque_drift",
        Odds::Uncommon,
        &[SiteKind::Joint],
        &[number("rate", "N*m/s")],
        "bias of the torque sensor that grows",
        "proportional to t",
    ),
    kind(
        "torque_ripple",
        Odds::Uncommon,
        &[SiteKind::Joint],
        &[number("amplitude", "N*m"), number("order", ""), number("phase", "rad")],
        "torque periodic in the joint angle",
        "periodic in q",
    ),
    // Robot: motion.
    kind(
        "joint_compliance",
        Odds::Uncommon,
        &[SiteKind::Joint],
        &[number("compliance", "rad/(N*m)")],
        "a gear that gives between encoder and link",
        "the tip sags with load; the encoder does not see it",
    ),
    kind(
        "servo_sag",
        Odds::Uncommon,
        &[SiteKind::Joint],
        &[number("compliance", "rad/(N*m)")],
        "a position loop of finite gain",
        "q - q_cmd proportional to the load torque",
    ),
    kind(
        "backlash",
        Odds::Uncommon,
        &[SiteKind::Joint],
        &[number("width", "rad")],
        "play between encoder and link",
        "the tip shifts when the load changes sign",
    ),
    kind(
        "command_delay",
        Odds::Uncommon,
        &[SiteKind::Robot],
        &[number("delay", "s")],
        "commands act late",
        "every tracking residual is a shift in time",
    ),
    kind(
        "actuator_gain",
        Odds::Uncommon,
        &[SiteKind::Joint],
        &[number("gain", "")],
        "the drive delivers gain times the torque asked for",
        "asked torque and model differ by a factor",
    ),
    kind(
        "saturation",
        Odds::Uncommon,
        &[SiteKind::Joint],
        &[number("limit", "N*m")],
        "the drive's torque is clipped",
        "only above a level",
    ),
    kind(
        "sensor_delay",
        Odds::Uncommon,
        &[SiteKind::Channel],
        &[number("delay", "s")],
        "a channel is late",
        "that channel alone is shifted in time",
    ),
    kind(
        "encoder_quantization",
        Odds::Uncommon,
        &[SiteKind::Joint],
        &[number("step", "rad")],
        "an encoder with coarse steps",
        "a saw-tooth in q",
    ),
    // Robot: geometry.
    kind(
        "joint_zero_offset",
        Odds::Uncommon,
        &[SiteKind::Joint],
        &[number("angle", "rad")],
        "the joint stands at encoder + angle",
        "tip error as J_j(q)*angle",
    ),
    kind(
        "link_length",
        Odds::Uncommon,
        &[SiteKind::Joint, SiteKind::Link],
        &[number("dx", "m"), number("dy", "m"), number("dz", "m")],
        "a dimension of the link is off",
        "tip error fixed in that link's frame",
    ),
    kind(
        "tool_offset",
        Odds::Uncommon,
        &[SiteKind::Tool],
        &[number("dx", "m"), number("dy", "m"), number("dz", "m")],
        "the tip is elsewhere in the flange frame",
        "tip error fixed in the flange frame",
    ),
    kind(
        "base_shift",
        Odds::Uncommon,
        &[SiteKind::Base],
        &[XYZ, RPY],
        "the base is not where it is assumed to be",
        "tip error is one rigid transform",
    ),
    // Camera.
    kind(
        "radial_distortion",
        Odds::Uncommon,
        &[SiteKind::Camera],
        &[number("k1", ""), number("k2", "")],
        "barrel or pincushion",
        "radial, grows as r^3",
    ),
    kind(
        "tangential_distortion",
        Odds::Uncommon,
        &[SiteKind::Camera],
        &[number("p1", ""), number("p2", "")],
        "a decentred lens",
        "as in Brown's model",
    ),
    kind(
        "focal_error",
        Odds::Uncommon,
        &[SiteKind::Camera],
        &[number("fx_scale", ""), number("fy_scale", "")],
        "the focal length is off",
        "linear in image coordinates",
    ),
    kind(
        "principal_point_shift",
        Odds::Uncommon,
        &[SiteKind::Camera],
        &[number("du", "px"), number("dv", "px")],
        "the centre of the picture is off",
        "constant",
    ),
    kind(
        "camera_shift",
        Odds::Uncommon,
        &[SiteKind::Camera],
        &[XYZ, RPY],
        "the camera or tracker is not where it is assumed to be",
        "one rigid transform of all it sees",
    ),
    kind(
        "table_tilt",
        Odds::Uncommon,
        &[SiteKind::Table],
        &[number("roll", "rad"), number("pitch", "rad"), number("height", "m")],
        "the plane is not where it was assumed",
        "back-projected points are off along the ray",
    ),
    kind(
        "image_delay",
        Odds::Uncommon,
        &[SiteKind::Camera],
        &[number("delay", "s")],
        "old pictures",
        "object error along its velocity",
    ),
    kind(
        "rolling_shutter",
        Odds::Uncommon,
        &[SiteKind::Camera],
        &[number("row_time", "s")],
        "rows are read in turn",
        "proportional to v times velocity",
    ),
    // Objects and liquid.
    kind(
        "object_mass",
        Odds::Common,
        &[SiteKind::Object],
        &[number("mass", "kg")],
        "heavier or lighter than modelled",
        "effort step at lift",
    ),
    kind(
        "object_size",
        Odds::Uncommon,
        &[SiteKind::Object],
        &[number("dx", "m"), number("dy", "m"), number("dz", "m")],
        "a wrong dimension",
        "contact earlier or later; contour scale",
    ),
    kind(
        "grip_slip",
        Odds::Uncommon,
        &[SiteKind::Gripper],
        &[number("rate", "m/s"), number("friction", "")],
        "the object creeps in the fingers, always or only under load",
        "pose drifts while held",
    ),
    kind(
        "liquid_volume",
        Odds::Uncommon,
        &[SiteKind::Object],
        &[number("volume", "m^3")],
        "another fill",
        "flow starts at another tilt",
    ),
    kind(
        "liquid_viscosity",
        Odds::Uncommon,
        &[SiteKind::Object],
        &[number("viscosity", "Pa*s")],
        "slow flow",
        "the volume curve lags and stretches",
    ),
    kind(
        "lip_dribble",
        Odds::Uncommon,
        &[SiteKind::Object],
        &[number("volume", "m^3"), number("delay", "s")],
        "liquid runs on after the vessel is upright",
        "volume still rises after the tilt back",
    ),
    kind(
        "overflow",
        Odds::Common,
        &[SiteKind::State, SiteKind::Object],
        &[number("level", "?"), number("share", "")],
        "a vessel is full",
        "the state clips at a level; the excess may go on",
    ),
    // Any model or signal.
    kind(
        "output_offset",
        Odds::Common,
        &[SiteKind::Output],
        &[number("value", "?")],
        "bias of a sensor",
        "constant",
    ),
    kind(
        "output_gain",
        Odds::Common,
        &[SiteKind::Output],
        &[number("gain", "")],
        "scale error of a sensor",
        "proportional to the output",
    ),
    kind(
        "output_drift",
        Odds::Rare,
        &[SiteKind::Output],
        &[number("rate", "?")],
        "bias of a sensor that grows",
        "proportional to t",
    ),
    kind(
        "input_offset",
        Odds::Common,
        &[SiteKind::Input],
        &[number("value", "?")],
        "the actuator adds a constant to the command",
        "as the response to a constant input",
    ),
    kind(
        "input_gain",
        Odds::Common,
        &[SiteKind::Input],
        &[number("gain", "")],
        "the actuator delivers gain times the command",
        "as the response to the input itself",
    ),
    kind(
        "input_delay",
        Odds::Uncommon,
        &[SiteKind::Input],
        &[number("delay", "s")],
        "the command acts late",
        "as the response to the input's derivative",
    ),
    kind(
        "input_saturation",
        Odds::Rare,
        &[SiteKind::Input],
        &[number("limit", "?")],
        "the command is clipped",
        "only above a level",
    ),
    kind(
        "input_deadzone",
        Odds::Uncommon,
        &[SiteKind::Input],
        &[number("width", "?")],
        "small commands do nothing",
        "only near zero",
    ),
    kind(
        "output_saturation",
        Odds::Rare,
        &[SiteKind::Output],
        &[number("limit", "?")],
        "the sensor reads no more than its limit",
        "only above a level",
    ),
    kind(
        "asymmetric_damping",
        Odds::Uncommon,
        &[SiteKind::State, SiteKind::Input],
        &[number("forward", "?"), number("backward", "?")],
        "a force proportional to a velocity that differs with direction",
        "two slopes that meet at 0",
    ),
    kind(
        "linear_damping",
        Odds::Common,
        &[SiteKind::State],
        &[number("coefficient", "?")],
        "a force against a velocity",
        "proportional to the velocity",
    ),
    kind(
        "quadratic_drag",
        Odds::Common,
        &[SiteKind::State],
        &[number("coefficient", "?")],
        "a force against the square of a velocity",
        "grows with v*abs(v)",
    ),
    kind(
        "dry_friction",
        Odds::Common,
        &[SiteKind::State],
        &[number("coefficient", "?")],
        "a force of constant size against a velocity",
        "a square with sign(v)",
    ),
    kind(
        "linear_stiffness",
        Odds::Uncommon,
        &[SiteKind::State, SiteKind::Joint],
        &[number("coefficient", "?")],
        "a restoring force",
        "proportional to the displacement",
    ),
    kind(
        "cubic_stiffness",
        Odds::Uncommon,
        &[SiteKind::State, SiteKind::Joint],
        &[number("coefficient", "?")],
        "a restoring force that hardens",
        "grows with the cube of the displacement",
    ),
    kind(
        "hysteresis",
        Odds::Rare,
        &[SiteKind::Joint, SiteKind::State],
        &[
            number("torque", "N*m"),
            number("alpha", ""),
            number("width", "rad"),
            number("n", ""),
            number("skew", ""),
        ],
        "a force that remembers the path, not the speed (Bouc-Wen)",
        "loops of force against displacement",
    ),
    kind(
        "lag",
        Odds::Uncommon,
        &[SiteKind::Output, SiteKind::Input],
        &[number("time", "s")],
        "a first-order lag",
        "late and smoothed",
    ),
    kind(
        "periodic_disturbance",
        Odds::Rare,
        &[SiteKind::State, SiteKind::Joint],
        &[number("amplitude", "?"), number("frequency", "Hz"), number("phase", "rad")],
        "hum",
        "a line in the spectrum of the residual",
    ),
    kind(
        "unknown",
        Odds::Uncommon,
        &[SiteKind::Anywhere],
        &[],
        "something none of the names covers, given by the formula that fits",
        "whatever the formula says",
    ),
];

/// Returns the kind of that name.
pub fn kind_named(name: &str) -> Option<&'static Kind> {
    KINDS.iter().find(|kind| kind.name == name)
}

impl Kind {
    /// Returns every number of the kind in order, with its name in a model file and its unit: a vector
    /// counts once per component.
    pub fn numbers(&self) -> impl Iterator<Item = (&'static str, &'static str)> {
        self.parameters.iter().flat_map(|parameter| {
            let one = parameter.components.is_empty().then_some((parameter.name, parameter.unit));
            one.into_iter().chain(parameter.components.iter().map(|name| (*name, parameter.unit)))
        })
    }
}

/// Returns what is wrong with the effects of a twin: a name nobody knows, a seat such an effect cannot
/// have, a parameter it does not have or of another unit.
pub fn check(twin: &TwinItem) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for effect in &twin.effects {
        let Some(kind) = kind_named(&effect.name.text) else {
            let names = KINDS.iter().map(|kind| kind.name);
            found.push(unknown("effect", &effect.name, nearest(&effect.name.text, names)));
            continue;
        };
        if kind.sites == [SiteKind::Joint] && !is_joint(&effect.at.text) {
            let message = format!("`{}` sits at a joint", kind.name);
            found.push(
                Diagnostic::error("task::effect", effect.at.span, message, "not a joint")
                    .help("write `joint_1`, `joint_2`, …, counted from the base"),
            );
        }
        for parameter in &effect.parameters {
            let name = &parameter.name.text;
            let known = kind.numbers().find(|(known, _)| known == name);
            let Some((_, unit)) = known else {
                let names = || kind.numbers().map(|(name, _)| name);
                // An effect that is a formula has the parameters of its formula.
                if names().next().is_none() {
                    continue;
                }
                let what = format!("parameter of `{}` called", kind.name);
                let near = nearest(name, names());
                let list = names().collect::<Vec<_>>().join(", ");
                let diagnostic = unknown(&what, &parameter.name, near);
                found.push(match near {
                    Some(_) => diagnostic,
                    None => diagnostic.help(format!("it has: {list}")),
                });
                continue;
            };
            let Ok(unit) = Unit::parse(unit) else { continue };
            let given = parameter.value.quantity.dimension;
            if given != unit.dimension {
                let message = format!(
                    "`{name}` is {}, and this is {}",
                    unit.dimension.words(),
                    given.words()
                );
                found.push(
                    Diagnostic::error(
                        "task::effect",
                        parameter.value.span,
                        message,
                        "another unit",
                    )
                    .help(format!("write it in {}", unit.dimension.si())),
                );
            }
        }
    }
    found
}

fn is_joint(at: &str) -> bool {
    at.strip_prefix("joint_").is_some_and(|n| n.parse::<u32>().is_ok_and(|n| n > 0))
}

fn unknown(what: &str, name: &Name, near: Option<&str>) -> Diagnostic {
    let message = format!("there is no {what} `{}`", name.text);
    let found = Diagnostic::error("task::effect", name.span, message, "not in the vocabulary");
    match near {
        Some(near) => found.did_you_mean(near),
        None => found.help("`docs/gap.md` lists the effects that have a name"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_units_exist() {
        for (at, kind) in KINDS.iter().enumerate() {
            assert!(KINDS[..at].iter().all(|other| other.name != kind.name), "{}", kind.name);
            assert!(!kind.sites.is_empty(), "{}", kind.name);
            for (_, unit) in kind.numbers().filter(|(_, unit)| *unit != "?") {
                assert!(Unit::parse(unit).is_ok(), "{}: {unit}", kind.name);
            }
        }
    }

    #[test]
    fn vectors_are_counted_by_component() {
        let names: Vec<_> = kind_named("payload").unwrap().numbers().map(|(n, _)| n).collect();
        assert_eq!(names, ["mass", "com_x", "com_y", "com_z"]);
        assert!(kind_named("gremlins").is_none());
    }
}
