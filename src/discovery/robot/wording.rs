//! What is said of an arm: the equations of its effects, and the sentences of an answer. Numbers come in, nothing is
//! decided here; why there is no answer is said in [`super::error`].

use std::fmt;

use super::term::{Feature, Law, Term};
use crate::discovery::finding::{Effect, ParameterEstimate};
use crate::discovery::vocabulary::TRACKER;
use crate::discovery::wording::{NO_MORE, fits_worse, left_aside, percent};
use crate::units::significant;

pub(super) use crate::discovery::wording::Explained;

/// Said while the links' numbers are fitted.
pub(super) const IDENTIFYING: &str = "identifying the links";
/// Said while the answer is put together.
pub(super) const WRITING: &str = "writing the answer";
/// Said while the noise of poses is judged.
pub(super) const JUDGING_NOISE: &str = "judging the noise";
/// What a channel follows whose gap is noise.
pub(super) const NOTHING_BEYOND_NOISE: &str = "nothing beyond noise";
/// What names a gap that nothing explains.
pub(super) const NO_FORMULA: &str = "no formula predicts data it was not fitted to";
/// That there are leads at most.
pub(super) const NOTHING_EXPLAINS: &str = "no effect that has a name, and no formula, explains it";
/// What poses say when nothing is missing.
pub(super) const POSES_ARE_NOISE: &str = "measured minus model is noise at every pose";
/// The same once the geometry is identified.
pub(super) const POSES_ARE_NOISE_NOW: &str = "once the geometry is identified, measured minus model is noise at every pose, also at those held out";
/// What to do when poses do not tell effects apart.
pub(super) const MORE_POSES: &str =
    "these poses do not tell them apart: add poses in which the joints stand otherwise";

/// Mass and moment of a load on the last body.
pub(super) const OF_LOAD: [&str; 4] = [
    "the mass of the load",
    "the moment of the load along x",
    "the moment of the load along y",
    "the moment of the load along z",
];

/// The load at a joint, from 0, as a state.
pub(super) fn load_at(joint: usize) -> String {
    format!("the load at joint_{}", joint + 1)
}

/// On which state what is left of a channel depends most, and which part a curve over it would take away.
pub(super) fn depends_on(channel: &str, state: &str, part: f64) -> String {
    format!(
        "what is left at {channel} depends most on {state}: a curve over it would take {} % of it away; `--out DIR` draws it",
        percent(part)
    )
}

/// What the drives turn an ampere into with one standard deviation, N·m/A, joint by joint, `None` where the motion does not tell;
/// and how heavy what they all bore was, kg.
pub(super) fn currents(constants: &[Option<(f64, f64)>], load: Option<(f64, f64)>) -> String {
    let told =
        |(value, std): (f64, f64)| format!("{} ± {}", significant(value, 3), significant(std, 1));
    let each = constants.iter().map(|k| k.map_or_else(|| "not told".to_owned(), told));
    let each: Vec<String> = each.collect();
    let beside = load.map_or_else(String::new, |mass| {
        format!("beside a load of {} kg that all joints bear, ", told(mass))
    });
    let open = if constants.contains(&None) {
        "; where it is not told nothing is said of the joint: friction, a rotor and the constant may all be larger there"
    } else {
        ""
    };
    format!(
        "torques are currents: what the drives turn an ampere into is fitted to the arm's file, {beside}joint by joint {} N·m/A; \
         what it is off by, every torque here is (`torque_constant_nm_per_a` in the sidecar says it){open}",
        each.join(", ")
    )
}

/// By which number recordings are of two machines.
pub(super) fn of_two_machines((what, unit): (String, &str), fitted: f64, held_out: f64) -> String {
    format!(
        "{what} is {} {unit} in the recordings fitted and {} {unit} in those held out",
        significant(fitted, 3),
        significant(held_out, 3)
    )
}

/// That recordings are not of one machine; `words` say by what.
pub(super) fn no_one_machine(words: &str) -> String {
    format!(
        "{words}; no model of one machine holds for both, so nothing is looked for: compare recordings of the \
         same arm, with the same load in the same place"
    )
}

/// That some recordings bear so much more than the others, kg, with its standard deviation.
pub(super) fn bear_more(who: &[&str], mass: f64, std: f64) -> String {
    let bear = if who.len() == 1 { "bears" } else { "bear" };
    format!(
        "{} {bear} {} ± {} kg more at the tool than the others; with it one model holds for all of them, so nothing else \
         is looked for: compare recordings with the same load",
        who.join(", "),
        significant(mass, 3),
        significant(std, 1)
    )
}

/// That these recordings were held out and the others fitted, since two machines describe the two sets best.
pub(super) fn parted(who: &[&str]) -> String {
    format!(
        "no model of one machine was found for all recordings, so {} {} held out and the others are fitted: so parted, two machines \
         leave least",
        who.join(", "),
        if who.len() > 1 { "are" } else { "is" }
    )
}

/// That a number is another in each recording.
pub(super) fn differs((what, unit): &(String, &str), values: &[(&str, f64)]) -> String {
    let told = |(name, value): &(&str, f64)| format!("{} {unit} in {name}", significant(*value, 2));
    let all: Vec<String> = values.iter().map(told).collect();
    format!("{what} differs between the recordings, each by itself: {}", all.join(", "))
}

/// Which number of a link is furthest from the file's, in units of what files are usually off by.
pub(super) fn far_off(parameter: &str, link: &str, by: f64) -> String {
    format!(
        "the {parameter} of {link} is {} times as far from the file's as a file's numbers usually are: check the robot's file, the \
         units of the torques and the gains of the drives first",
        significant(by, 2)
    )
}

/// That the links' numbers came first.
pub(super) fn links_first() -> String {
    "the numbers of the links are identified first; what is missing is looked for beside them"
        .into()
}

/// That what was found is not told, because the data held out are described better without it.
pub(super) fn not_borne_out() -> String {
    "what explains the data fitted leaves more of those held out than the model as it was, so none of it is told".into()
}

/// That so many effects, which take next to nothing of the gap, are not told.
pub(super) fn too_little_for_a_list(n_effects: usize) -> String {
    format!(
        "{n_effects} effects that together take less than a tenth of the gap on data held out, noise taken out, are no list of what \
         is missing, so none of them is told"
    )
}

/// At which joints, from 0, the arm follows its commands as the controller does not make it.
pub(super) fn another_controller(joints: &[usize]) -> String {
    let joints: Vec<String> = joints.iter().map(|joint| format!("joint_{}", joint + 1)).collect();
    format!(
        "{}: the arm follows its commands otherwise than the controller of the sidecar makes it, as if the drive and its sensor were \
         off by the same factor, or rotors lighter than known; that is how another controller looks: larger gains, or speed, \
         acceleration or torque fed forward. Check `controller`; without it in the sidecar the motion is taken as measured, and \
         torques are judged along it",
        joints.join(", ")
    )
}

/// That nobody knows how the arm is driven.
pub(super) fn no_controller(recording: &str) -> String {
    format!(
        "{recording}: no controller is known; torque and tip are judged along the measured motion"
    )
}

/// That the simulation with the controller leaves so many noises, and the measured motion tells more.
pub(super) fn along_instead(left: f64) -> String {
    let left = significant(left, 2);
    format!(
        "simulated with its controller the arm leaves {left} times the noise of the data held out; along the measured motion \
         less stays, and what is told is what its torques say there: check also the stamps of the rows and the gains of the controller"
    )
}

/// That the simulation with the controller runs away, and the measured motion does not.
pub(super) fn along_of_runaway() -> String {
    "simulated with its controller the arm runs away from what was measured; what is told is what its torques say along the \
     measured motion: check also the gains of the controller"
        .into()
}

/// An effect of a model by name and place.
pub(super) fn effect(name: &str, at: &str) -> String {
    format!("effect {name}({at})")
}

/// That a known effect is of something else.
pub(super) fn not_of_the_arm(name: &str, at: &str) -> String {
    left_aside((name, at), "is not of the arm", TRACKER)
}

/// That torques are read so many s late, or early, and that it is taken into account.
pub(super) fn read_late(delay: f64) -> String {
    let when = if delay > 0.0 { "late" } else { "early" };
    format!(
        "torques are read {:.1} ms {when} beside the motion, less than half a row: taken into account",
        delay.abs() * 1e3
    )
}

/// That the data fitted and those held out changed places.
pub(super) fn exchanged() -> String {
    "the data to fit show nothing beyond noise, the data held out do: their roles were exchanged"
        .into()
}

/// What would settle a doubt: a motion in which the effects differ by so many standard deviations, or no motion at all.
pub(super) fn in_proposed_motion(separation: Option<f64>) -> String {
    match separation {
        Some(sigma) => format!(
            "; in the motion proposed they differ by {} standard deviations",
            significant(sigma, 2)
        ),
        None => "; no motion of the arm tells them apart in these channels: measure something \
                 else, such as a second marker on the base or the table"
            .into(),
    }
}

/// That no channel but these stays as it was.
pub(super) fn stays_at(channels: &[&str]) -> String {
    format!(
        "most of the gap stays at {}: check these columns first (order, sign, unit), then the gains of their drives",
        channels.join(", ")
    )
}

/// That what is left is not noise, in standard deviations of its sum of squares.
pub(super) fn still_above_noise(left: f64) -> String {
    format!(
        "what is left is still above noise ({left:.0} standard deviations of its sum of squares)"
    )
}

/// Which effects are in doubt.
pub(super) fn equally_well(effects: &[Effect]) -> String {
    let doubtful = effects.iter().filter(|effect| effect.indistinguishable);
    let names: Vec<String> = doubtful.map(|e| format!("{}({})", e.name, e.at)).collect();
    format!("{} explain these data equally well", names.join(" and "))
}

/// Why another name for the same was not taken.
pub(super) enum WhyNot {
    /// A gain of the drive is one of the sensor where no command was recorded.
    NoCommands,
    /// The data say the same of both.
    Tied,
    /// Its criterion is so much higher.
    FitsWorse(f64),
    /// It can do all that the one chosen can, and its further numbers explain too little more.
    Richer,
    /// The base moved, or the tracker.
    SeenFromTheOtherSide,
}

impl fmt::Display for WhyNot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoCommands => f.write_str(
                "not distinguishable without the commands of the drive: only they tell whether \
                 the drive gives less or the sensor shows more",
            ),
            Self::Tied => {
                f.write_str("explains the data as well; the motion does not tell the two apart")
            }
            Self::FitsWorse(by) => f.write_str(&fits_worse(*by, "data")),
            Self::Richer => f.write_str(NO_MORE),
            Self::SeenFromTheOtherSide => f.write_str(
                "the same rigid transform seen from the other side: only a second marker that does \
                 not move with the arm tells which of the two moved",
            ),
        }
    }
}

/// What a search came to.
pub(super) enum Reason<'a> {
    /// Nothing is left but noise.
    Noise,
    /// What is left is coloured noise, this part of the signal.
    Coloured(f64),
    /// What is left is so many standard deviations above noise, and nothing explains it.
    Unexplained(f64),
    /// The data do not tell effects apart.
    Doubt,
    /// What was found leaves most; `at` says where.
    TooLittle { explained: f64, rest: f64, at: &'a str },
    /// No name, but a formula.
    Formula(Explained),
    /// One effect.
    One(&'a Effect, Explained),
    /// So many effects.
    Several(usize, Explained),
}

impl fmt::Display for Reason<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Noise => f.write_str(
                "measured minus model is noise, and no effect explains any of it on data it was not \
                 fitted to",
            ),
            Self::Coloured(part) => write!(
                f,
                "measured minus model is coloured noise, correlated from row to row: it is {} % of the signal, as \
                 large throughout, and no effect explains any of it on data it was not fitted to",
                percent(*part)
            ),
            Self::Unexplained(left) => write!(
                f,
                "the gap is {left:.0} standard deviations above noise, but no effect and no formula \
                 predicts data it was not fitted to"
            ),
            Self::Doubt => f.write_str(
                "several effects explain the data equally well; the motion does not tell them apart",
            ),
            Self::TooLittle { explained, rest, at } => write!(
                f,
                "what was found explains only {} % of the gap on data held out and leaves {} times \
                 the noise, most of it at {at}; check first the units and the signs of the columns, the robot's file, \
                 its mounting and the gains of the drives",
                percent(explained.max(0.0)),
                significant(*rest, 2)
            ),
            Self::Formula(explained) => write!(
                f,
                "no named effect explains the gap; the formula explains {explained}, also on data held out"
            ),
            Self::One(effect, explained) => write!(
                f,
                "{} at {} explains {explained}, also on data held out",
                effect.name, effect.at
            ),
            Self::Several(n, explained) => {
                write!(f, "{n} effects together explain {explained}, also on data held out")
            }
        }
    }
}

/// How many poses are for what.
pub(super) fn poses(fitted: usize, held_out: usize) -> String {
    format!("each row is a pose at rest: {fitted} are fitted, {held_out} held out")
}

/// How many numbers of a geometry are told, and what is left, m an axis.
pub(super) fn geometry(count: usize, rank: usize, determined: f64, left: f64) -> String {
    format!(
        "of the {count} numbers of the geometry {rank} show by themselves; the poses determine {determined:.0}, the rest is the file's; \
         what is left is {} mm an axis",
        significant(1e3 * left, 2)
    )
}

/// Where the base stands in the tracker's frame, m and rad (roll, pitch, yaw).
pub(super) fn tracker(place: [f64; 3], (roll, pitch, yaw): (f64, f64, f64)) -> String {
    let [x, y, z] = place;
    format!(
        "the tracker's frame is not the base's: the base stands at ({x:.3}, {y:.3}, {z:.3}) m in it, turned by roll {roll:.3}, \
         pitch {pitch:.3}, yaw {yaw:.3} rad; the tips are estimates from the base"
    )
}

/// Writes a number with its unit, three digits.
fn number(value: f64, unit: &str) -> String {
    let text = significant(value, 3);
    if unit.is_empty() { text } else { format!("{text} {unit}") }
}

/// Writes what the effect adds to the model. Torques are what the motor must give more than modelled.
pub fn equation(term: &Term, estimates: &[ParameterEstimate]) -> String {
    let j = term.joint + 1;
    let v = |i: usize| estimates.get(i).map_or(0.0, |(_, value, _, _)| *value);
    let unit = |i: usize| estimates.get(i).map_or("", |(.., unit)| unit.as_str());
    let n = |i: usize| number(v(i), unit(i));
    let minus = |i: usize| number(-v(i), unit(i));
    match term.law {
        Law::Coulomb | Law::SmoothCoulomb => format!("tau_{j} += {} * sign(dq_{j})", n(0)),
        Law::Viscous => format!("tau_{j} += {} * dq_{j}", n(0)),
        Law::Quadratic => format!("tau_{j} += {} * dq_{j}*abs(dq_{j})", n(0)),
        Law::Stribeck => format!(
            "tau_{j} += ({} + {} * exp(-(dq_{j}/({}))^2)) * sign(dq_{j})",
            n(0),
            number(v(1) - v(0), unit(0)),
            n(2)
        ),
        Law::Asymmetric => {
            format!("tau_{j} += {} where dq_{j} > 0, {} where dq_{j} < 0", n(0), minus(1))
        }
        Law::Payload => format!(
            "tau += J_c(q)' * {} * (ddx_c - g), c = ({}, {}, {}) m in the tip's frame",
            n(0),
            significant(v(1), 3),
            significant(v(2), 3),
            significant(v(3), 3)
        ),
        Law::ObjectMass => {
            format!(
                "tau += J_c(q)' * m * (ddx_c - g) from grasp to release, m = {} + contents",
                n(0)
            )
        }
        Law::LinkMass => format!("the link after joint {j} weighs {} more", n(0)),
        Law::Armature => format!("tau_{j} += {} * ddq_{j}", n(0)),
        Law::BaseTilt => {
            format!("gravity = R(roll {}, pitch {})' * gravity", n(0), n(1))
        }
        Law::TorqueOffset => format!("measured tau_{j} = tau_{j} + {}", n(0)),
        Law::TorqueGain => format!("measured tau_{j} = {} * tau_{j}", n(0)),
        Law::TorqueDrift => format!("measured tau_{j} = tau_{j} + {} * t", n(0)),
        Law::Ripple => {
            format!("tau_{j} -= {} * sin({} * q_{j} + {})", n(0), significant(v(1), 4), n(2))
        }
        Law::Periodic => {
            format!("tau_{j} -= {} * sin(2*pi * {} * t + {})", n(0), n(1), n(2))
        }
        Law::Compliance => format!("link angle {j} = q_{j} - {} * load_{j}", n(0)),
        Law::ServoSag => format!("q_{j} = q_cmd_{j} - {} * load_{j}", n(0)),
        Law::Backlash => {
            format!("link angle {j} = q_{j} + gap, abs(gap) <= {}", number(v(0) / 2.0, unit(0)))
        }
        Law::CommandDelay => format!("q_cmd acts {} late", n(0)),
        Law::ActuatorGain => format!("torque at joint {j} = {} * tau_{j}", n(0)),
        Law::Saturation => format!("abs(tau_{j}) <= {}", n(0)),
        Law::SensorDelay(quantity) => format!("{}(t) is of t - {}", quantity.stem(), n(0)),
        Law::ZeroOffset => format!("joint angle {j} = q_{j} + {}", n(0)),
        Law::LinkLength => format!(
            "joint {j} sits ({}, {}, {}) m further in the frame of the link before it",
            significant(v(0), 3),
            significant(v(1), 3),
            significant(v(2), 3)
        ),
        Law::ToolOffset => format!(
            "tip = flange + R * ({}, {}, {}) m",
            significant(v(0), 3),
            significant(v(1), 3),
            significant(v(2), 3)
        ),
        Law::CameraShift(_) => {
            let parts: Vec<String> = estimates
                .iter()
                .map(|(name, value, _, unit)| format!("{name} {}", number(*value, unit)))
                .collect();
            format!("tcp = R * tip + d with {}", parts.join(", "))
        }
        Law::Hysteresis => {
            format!("tau_{j} += {} * z, {} * dz/dt = dq_{j} - abs(dq_{j})*z*abs(z)", n(0), n(1))
        }
        Law::Stiffness => format!("tau_{j} += {} * q_{j}", n(0)),
        Law::CubicStiffness => format!("tau_{j} += {} * q_{j}^3", n(0)),
        Law::Above => format!("tau_{j} += {} * max(0, q_{j} - {})", n(0), n(1)),
        Law::Below => format!("tau_{j} += {} * max(0, {} - q_{j})", n(0), n(1)),
        Law::LoadRipple => format!(
            "tau_{j} += {} * load_{j} * sin({} * q_{j} + {})",
            minus(0),
            significant(v(1), 4),
            n(2)
        ),
        Law::FadingDry => format!("tau_{j} += {} * sign(dq_{j})*exp(-t / ({}))", n(0), n(1)),
        Law::FadingFluid => format!("tau_{j} += {} * dq_{j}*exp(-t / ({}))", n(0), n(1)),
        Law::Feature(feature) => {
            format!("tau_{j} += {} * {}", n(0), shape(feature, j))
        }
    }
}

/// Writes a feature as a formula.
fn shape(feature: Feature, j: usize) -> String {
    match feature {
        Feature::Square => format!("q_{j}^2"),
        Feature::Sine(k) => format!("sin({} * q_{j})", significant(k, 4)),
        Feature::Cosine(k) => format!("cos({} * q_{j})", significant(k, 4)),
        Feature::PositionTimesSpeed => format!("q_{j}*abs(dq_{j})"),
        Feature::SpeedCubed => format!("dq_{j}^3"),
        Feature::RootSpeed => format!("sqrt(abs(dq_{j}))*sign(dq_{j})"),
        Feature::Decay(tau) => format!("exp(-t / ({} s))", significant(tau, 3)),
        Feature::Time => "t".into(),
        Feature::One => "1".into(),
        Feature::FrictionTimesDistance => format!("abs(q_{j})*sign(dq_{j})"),
        Feature::FrictionTimesSine => format!("sin(q_{j})*sign(dq_{j})"),
        Feature::FrictionTimesCosine => format!("cos(q_{j})*sign(dq_{j})"),
        Feature::FrictionTimesLoad => format!("abs(load_{j})*sign(dq_{j})"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_recording_bears_and_several_bear() {
        assert!(bear_more(&["b"], 0.999, 0.001).starts_with("b bears 0.999 ± 0.001 kg more"));
        assert!(bear_more(&["b", "c"], 0.999, 0.001).starts_with("b, c bear 0.999"));
    }
}
