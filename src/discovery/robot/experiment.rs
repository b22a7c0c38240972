//! The motion that would settle a doubt: of some within the arm's limits, the one in which rivals differ most.
//!
//! Each motion is simulated with both rivals as they were fitted; what the second could take back by other
//! sizes of its effects does not count as a difference. Motions are sums of a few sines that begin and
//! end at rest: slow ones, fast ones, and ones about the upright arm, where gravity changes sign.
//!
//! Source: the criterion is that of Atkinson and Fedorov, "The design of experiments for discriminating
//! between two rival models", 1975; the motions are those of Swevers et al. 1997.

use std::fmt::Write as _;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::channels::{Channel, Data};
use super::plant::Course;
use super::simulate::Model;
use super::term::Term;
use crate::discovery::selection::{Hypothesis, left_after, sum_of_squares};
use crate::motion::robot::JointLimits;

/// How long the motion is, s, and how many rows a second it has.
const LENGTH: f64 = 12.0;
const RATE: f64 = 100.0;

/// How many motions are compared.
const TRIED: usize = 12;

/// Part of a joint's speed limit that is used, and of its range.
const PART_OF_SPEED: f64 = 0.6;
const PART_OF_RANGE: f64 = 0.7;

/// A joint that turns without end is kept within this, rad.
const ENDLESS: f64 = 2.5;

/// Rivals that differ by less than this (in the sum of squares) in every motion are not told apart by any:
/// five standard deviations.
const TOLD_APART: f64 = 25.0;

/// A motion that tells two hypotheses apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// The commands as a recording: `t[s],q_cmd_1[rad],…`.
    pub csv: String,
    /// By how much the rivals differ in it, in standard deviations.
    pub separation: f64,
}

/// Returns the motion in which the two differ most, `None` if they hardly differ in any.
pub fn settle(
    like: &Model,
    limits: &[JointLimits],
    rivals: [&Hypothesis<Term>; 2],
    seed: u64,
) -> Option<Experiment> {
    if !like.course.closed_loop {
        return None;
    }
    let mut rng = StdRng::seed_from_u64(seed);
    let mut best: Option<(f64, Vec<Vec<f64>>)> = None;
    for number in 0..TRIED {
        let commands = motion(limits, number, &mut rng);
        let Some(differs) = difference(like, &commands, rivals) else { continue };
        if best.as_ref().is_none_or(|(most, _)| differs > *most) {
            best = Some((differs, commands));
        }
    }
    let (differs, commands) = best?;
    let slides: Vec<bool> = (0..commands.len()).map(|j| like.arm.chain.slides(j)).collect();
    let separation = differs.sqrt();
    (differs > TOLD_APART).then(|| Experiment { csv: csv(&commands, &slides), separation })
}

/// Draws a motion, one list of rows per joint, rad.
fn motion(limits: &[JointLimits], number: usize, rng: &mut StdRng) -> Vec<Vec<f64>> {
    let rows = (LENGTH * RATE) as usize;
    // Slow, middling and fast in turn.
    let pace = [0.25, 0.6, 1.0][number % 3];
    limits
        .iter()
        .map(|joint| {
            let (low, high) = if joint.continuous || !joint.lower.is_finite() {
                (-ENDLESS, ENDLESS)
            } else {
                (joint.lower, joint.upper)
            };
            let half = 0.5 * PART_OF_RANGE * (high - low);
            // Every other motion is about the middle of the range, where an upright arm balances.
            let wander = if number.is_multiple_of(2) { 0.0 } else { 0.4 };
            let centre = 0.5 * (low + high) + wander * half * (2.0 * rng.random::<f64>() - 1.0);
            let waves: Vec<(f64, f64, f64)> = (1..=4)
                .map(|k| {
                    let frequency = f64::from(k) * pace * (0.1 + 0.1 * rng.random::<f64>());
                    (
                        rng.random::<f64>() + 0.2,
                        frequency,
                        std::f64::consts::TAU * rng.random::<f64>(),
                    )
                })
                .collect();
            let sum: f64 = waves.iter().map(|(a, ..)| a).sum();
            let speed: f64 =
                waves.iter().map(|(a, f, _)| a * f * std::f64::consts::TAU).sum::<f64>() / sum;
            // The window that lets it begin and end at rest adds to the speed; a tenth is spare for it.
            let fits = PART_OF_SPEED * joint.velocity / speed.max(1e-9) * 0.9;
            let amplitude = (half * (1.0 - wander)).min(fits);
            (0..rows)
                .map(|row| {
                    let t = row as f64 / RATE;
                    let rest = (t / 2.0).min((LENGTH - t) / 2.0).clamp(0.0, 1.0);
                    // A smooth step: no jump of speed or acceleration.
                    let window = rest.powi(3) * (10.0 - 15.0 * rest + 6.0 * rest * rest);
                    let wave: f64 = waves
                        .iter()
                        .map(|(a, f, phase)| a * (std::f64::consts::TAU * f * t + phase).sin())
                        .sum();
                    centre + amplitude * window * wave / sum
                })
                .collect()
        })
        .collect()
}

/// Returns the sum of squares by which the predictions differ, less what other sizes could take back.
fn difference(like: &Model, commands: &[Vec<f64>], rivals: [&Hypothesis<Term>; 2]) -> Option<f64> {
    let rows = commands.first()?.len();
    let channels = like
        .course
        .data
        .channels
        .iter()
        .map(|channel| Channel { values: vec![0.0; rows], unread: Vec::new(), ..channel.clone() })
        .collect();
    let data = Data {
        n: commands.len(),
        time: (0..rows).map(|row| row as f64 / RATE).collect(),
        commands: commands.to_vec(),
        channels,
        notes: Vec::new(),
        are_currents: false,
        of_currents: false,
    };
    let model = Model::new(like.arm.clone(), Course::new(&like.arm, data), Vec::new());
    let [first, second] = rivals;
    let own = model.own().len();
    let read = |terms: &[Term], all: &[f64]| model.residuals(&all[..own], terms, &all[own..]);
    let truth = read(&first.terms, &first.parameters)?;
    let other = read(&second.terms, &second.parameters)?;
    let apart: Vec<f64> = other.iter().zip(&truth).map(|(a, b)| a - b).collect();
    let specs: Vec<_> = second.terms.iter().flat_map(|term| term.law.specs()).collect();
    let mut columns = Vec::new();
    for (i, spec) in specs.iter().enumerate() {
        let mut moved = second.parameters.clone();
        moved[own + i] += spec.scale;
        let at = read(&second.terms, &moved)?;
        columns
            .push(at.iter().zip(&other).map(|(a, b)| (a - b) / spec.scale).collect::<Vec<f64>>());
    }
    let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    Some(left_after(&columns, &apart).unwrap_or_else(|| sum_of_squares(&apart)))
}

/// Writes commands as a table; `slides` says which joints are in m.
fn csv(commands: &[Vec<f64>], slides: &[bool]) -> String {
    let mut text = "t[s]".to_owned();
    for (joint, slides) in slides.iter().enumerate() {
        let unit = if *slides { "m" } else { "rad" };
        let _ = write!(text, ",q_cmd_{}[{unit}]", joint + 1);
    }
    text.push('\n');
    for row in 0..commands.first().map_or(0, Vec::len) {
        let _ = write!(text, "{:.3}", row as f64 / RATE);
        for joint in commands {
            let _ = write!(text, ",{:.6}", joint[row]);
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::Robot;

    #[test]
    fn a_joint_that_slides_is_sent_in_m() {
        let text = csv(&[vec![0.1], vec![0.2]], &[false, true]);
        assert_eq!(text.lines().next(), Some("t[s],q_cmd_1[rad],q_cmd_2[m]"));
    }

    #[test]
    fn motions_stay_within_range_and_speed_and_begin_and_end_at_rest() {
        let robot = Robot::gen3();
        let mut rng = StdRng::seed_from_u64(3);
        for number in 0..TRIED {
            for (joint, values) in
                robot.joints().iter().zip(motion(robot.joints(), number, &mut rng))
            {
                for q in &values {
                    assert!(joint.continuous || (*q > joint.lower && *q < joint.upper));
                }
                for pair in values.windows(2) {
                    assert!((pair[1] - pair[0]).abs() * RATE < joint.velocity, "{}", joint.name);
                }
                let speed = |a: usize, b: usize| (values[b] - values[a]).abs() * RATE;
                assert!(speed(0, 1) < 1e-2 && speed(values.len() - 2, values.len() - 1) < 1e-2);
            }
        }
    }
}
