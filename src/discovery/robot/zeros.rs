//! How far the zero of an encoder may be off.
//!
//! An arm goes where it is sent by the same encoder, so a zero that is off by much is seen by whoever looks. In torques alone a
//! large one is not seen but computed: where gravity hardly acts about a joint, it takes away what its sensors show too much.

use std::f64::consts::{PI, TAU};

/// The lowest ratio of the gears in arms, of motor to joint: strain wave gears come from 30 up (catalogue of Harmonic Drive SE,
/// series CSG and CSF), most arms have 50 to 160.
const LOWEST_RATIO: f64 = 30.0;

/// Returns how far the zero of an encoder may be off, rad: where the tip is seen, by any angle; else by no more than it is off
/// when the index pulse of the motor's encoder is found one turn of the motor too early or too late.
pub(super) fn largest(sees_tip: bool) -> f64 {
    if sees_tip { PI } else { TAU / LOWEST_RATIO }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The zero of a last joint was told as 0.48 and 0.65 rad, which were errors of its torque sensor.
    #[test]
    fn torques_alone_show_no_zero_that_anybody_would_see() {
        assert!(largest(false) < 0.4 && largest(true) > 3.0);
        // A turn of the motor before the usual gear, and what calibrations of arms find.
        assert!([TAU / 50.0, TAU / 100.0, 0.03, 0.01].iter().all(|zero| *zero < largest(false)));
    }
}
