//! Whether an arm follows its commands as the controller of the sidecar makes it, told by names that stand for another one.
//!
//! A controller that feeds speed, acceleration or torque forward keeps the arm nearer to its commands than one that only looks
//! back. Simulated with the latter the drive seems to give more than it was asked for, and the sensor to show as much more: together
//! they are larger gains of the controller. Rotors seem lighter, for what moves them was fed forward.

use super::explain::ArmGap;
use super::term::{Law, Term};
use crate::discovery::selection::{Hypothesis, Residuals as _};

/// Gains that differ by less than this part are one.
const ALIKE: f64 = 0.03;

/// A rotor is lighter by more than this many of its standard deviations.
const SURE: f64 = 3.0;

/// So many rotors are not all lighter than they are known to be.
const LIGHTER: usize = 2;

/// Returns whether an arm is simulated with its controller.
pub(super) fn is_driven(gap: &ArmGap) -> bool {
    gap.train.iter().all(|model| model.course.closed_loop)
}

/// Returns the joints, from 0, at which a hypothesis stands for another controller.
pub(super) fn driven_otherwise(gap: &ArmGap, best: &Hypothesis<Term>) -> Vec<usize> {
    if !is_driven(gap) {
        return Vec::new();
    }
    let mut from = gap.nuisance().len();
    let first = best.terms.iter().map(|term| {
        let at = from;
        from += gap.specs(term).len();
        (*term, best.parameters[at], best.covariance[(at, at)].max(0.0).sqrt())
    });
    of_another(&first.collect::<Vec<_>>())
}

/// Returns the same of effects with the first number of each and its standard deviation.
fn of_another(effects: &[(Term, f64, f64)]) -> Vec<usize> {
    let gain = |law, joint| {
        effects.iter().find(|(term, ..)| *term == Term { law, joint }).map(|(_, gain, _)| *gain)
    };
    let is_stiffer = |joint: &usize| {
        let both = gain(Law::ActuatorGain, *joint).zip(gain(Law::TorqueGain, *joint));
        both.is_some_and(|(drive, sensor)| (drive - sensor).abs() < ALIKE * drive.abs())
    };
    let driven = effects.iter().filter(|(term, ..)| term.law == Law::ActuatorGain);
    let mut joints: Vec<usize> = driven.map(|(term, ..)| term.joint).filter(is_stiffer).collect();
    let lighter = effects
        .iter()
        .filter(|(term, inertia, std)| term.law == Law::Armature && *inertia < -SURE * std);
    let lighter: Vec<usize> = lighter.map(|(term, ..)| term.joint).collect();
    if !joints.is_empty() || lighter.len() >= LIGHTER {
        joints.extend(lighter);
    }
    joints.sort_unstable();
    joints.dedup();
    joints
}

#[cfg(test)]
mod tests {
    use super::*;

    fn effect(law: Law, joint: usize, number: f64) -> (Term, f64, f64) {
        (Term { law, joint }, number, 0.01)
    }

    /// A computed torque under the name of a position loop: a gain of 2.33 of the drive and one of 2.32 of its sensor, and rotors
    /// lighter than the sidecar says.
    #[test]
    fn a_drive_and_a_sensor_off_by_the_same_factor_are_another_controller() {
        let drive = effect(Law::ActuatorGain, 0, 2.33);
        let sensor = effect(Law::TorqueGain, 0, 2.32);
        let light = |joint| effect(Law::Armature, joint, -0.065);
        assert_eq!(of_another(&[drive, sensor, light(1)]), [0, 1]);
        assert_eq!(of_another(&[light(1), light(2)]), [1, 2]);
        // Each by itself is what it says.
        assert!(of_another(&[drive]).is_empty() && of_another(&[sensor, light(1)]).is_empty());
        let other = effect(Law::TorqueGain, 0, 1.2);
        assert!(of_another(&[drive, other]).is_empty(), "two faults");
        let heavier = [1, 2].map(|joint| effect(Law::Armature, joint, 0.065));
        assert!(of_another(&heavier).is_empty());
    }
}
