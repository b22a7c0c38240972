//! The door between the wire's units and the program's: degrees and 0..360 stop here.
//!
//! The arm reports every joint between 0 and 360 deg. Inside, a joint that turns without end keeps
//! counting: it is read as the turn nearest to where it was last.

use std::f64::consts::TAU;

/// Returns an angle of the wire, deg, as the turn nearest to `near`, rad.
pub fn from_wire(degrees: f32, near: f64) -> f64 {
    nearest(f64::from(degrees).to_radians(), near)
}

/// Returns an angle, rad, in 0..360 deg, as the arm reports it.
pub fn to_wire(angle: f64) -> f32 {
    let degrees = angle.to_degrees().rem_euclid(360.0) as f32;
    // Just below a whole turn rounds up to one.
    if degrees >= 360.0 { 0.0 } else { degrees }
}

/// Returns `angle` turned by whole turns to within half a turn of `near`, all in rad.
pub fn nearest(angle: f64, near: f64) -> f64 {
    let off = (angle - near).rem_euclid(TAU);
    near + if off > std::f64::consts::PI { off - TAU } else { off }
}

/// Returns speeds or plain angles, rad, as deg on the wire.
pub fn speeds_to_wire(speeds: &[f64]) -> Vec<f32> {
    speeds.iter().map(|speed| speed.to_degrees() as f32).collect()
}
