//! Which settings make sense: every number within bounds that a laboratory can be built in.

use std::f64::consts::PI;

use super::settings::{LabSettings, Range};
use super::{Error, Unsound};
use crate::world::Mover;

impl LabSettings {
    /// Says what makes no sense.
    ///
    /// # Errors
    ///
    /// [`Error::Settings`] names the first such key.
    pub fn check(&self) -> Result<(), Error> {
        let (camera, lens, sensor, light) = (&self.camera, &self.lens, &self.sensor, &self.light);
        size("camera.position_sigma_m", camera.position_sigma_m, 1.0)?;
        size("camera.turn_sigma_rad", camera.turn_sigma_rad, PI)?;
        // Beyond these no lens maps the picture's corners to one place each.
        range("lens.focal", lens.focal, [-0.9, 9.0])?;
        range("lens.aspect", lens.aspect, [-0.5, 1.0])?;
        range("lens.principal_px", lens.principal_px, [-2000.0, 2000.0])?;
        range("lens.k1", lens.k1, [-2.0, 2.0])?;
        range("lens.k2", lens.k2, [-2.0, 2.0])?;
        within("sensor.full_well", sensor.full_well, [1.0, 1e9])?;
        size("sensor.read_noise", sensor.read_noise, 1.0)?;
        // A wider blur than this takes longer to draw than to see that nothing is left to be seen.
        size("sensor.blur_px", sensor.blur_px, 50.0)?;
        range("sensor.vignetting", sensor.vignetting, [0.0, 1.0])?;
        range("sensor.white_balance", sensor.white_balance, [-0.9, 9.0])?;
        range("sensor.exposure", sensor.exposure, [-0.9, 9.0])?;
        size("light.turn_sigma_rad", light.turn_sigma_rad, PI)?;
        range("light.lamp", light.lamp, [-1.0, 9.0])?;
        range("light.room", light.room, [-1.0, 9.0])?;
        let (joints, mounting, readings) = (&self.joints, &self.mounting, &self.readings);
        size("joints.zero_sigma_rad", joints.zero_sigma_rad, PI)?;
        range("joints.coulomb_nm", joints.coulomb_nm, [0.0, 1e3])?;
        range("joints.viscous_nm_s_per_rad", joints.viscous_nm_s_per_rad, [0.0, 1e4])?;
        range("joints.compliance_rad_per_nm", joints.compliance_rad_per_nm, [0.0, 0.1])?;
        range("joints.uncompensated", joints.uncompensated, [0.0, 1.0])?;
        size("mounting.tool_sigma_m", mounting.tool_sigma_m, 0.5)?;
        size("mounting.base_sigma_m", mounting.base_sigma_m, 1.0)?;
        size("mounting.base_turn_sigma_rad", mounting.base_turn_sigma_rad, PI)?;
        range("latency.command_s", self.latency.command_s, [0.0, 1.0])?;
        size("readings.q_sigma_rad", readings.q_sigma_rad, 1.0)?;
        size("readings.q_step_rad", readings.q_step_rad, 1.0)?;
        size("readings.dq_sigma_rad_s", readings.dq_sigma_rad_s, 10.0)?;
        size("readings.tau_sigma_nm", readings.tau_sigma_nm, 1e3)?;
        range("readings.tau_bias_nm", readings.tau_bias_nm, [-1e3, 1e3])?;
        size("readings.opening_sigma_m", readings.opening_sigma_m, 0.1)?;
        let (things, placement) = (&self.things, &self.placement);
        range("things.pad_friction", things.pad_friction, [0.0, 10.0])?;
        range("things.table_friction", things.table_friction, [0.0, 10.0])?;
        range("things.drawer_n", things.drawer_n, [0.0, 1e4])?;
        range("things.mass", things.mass, [-0.9, 100.0])?;
        range("things.fill", things.fill, [-1.0, 10.0])?;
        let people = &self.people;
        range("people.delay_s", people.delay_s, [0.0, 600.0])?;
        range("people.pull_n", people.pull_n, [0.0, 200.0])?;
        within("people.comes", people.comes, [0.0, 1.0])?;
        range("placement.radius_m", placement.radius_m, [0.0, 10.0])?;
        size("placement.side_rad", placement.side_rad, PI)?;
        range("placement.apart_m", placement.apart_m, [0.0, 10.0])?;
        size("placement.edge_m", placement.edge_m, 1.0)?;
        size("placement.mark_m", placement.mark_m, 1.0)?;
        for (joint, q) in self.start.q_rad.iter().enumerate() {
            within(&format!("start.q_rad[{joint}]"), *q, [-4.0 * PI, 4.0 * PI])?;
        }
        size("start.opening_m", self.start.opening_m.unwrap_or(0.0), 1.0)?;
        size("scale.sigma_kg", self.scale.sigma_kg, 10.0)?;
        size("scale.step_kg", self.scale.step_kg, 10.0)?;
        for (number, thing) in self.clutter.iter().enumerate() {
            for (axis, size) in ["x", "y", "z"].iter().zip(thing.size_m) {
                within(&format!("clutter[{number}].size_m.{axis}"), size, [1e-3, 1.0])?;
            }
            within(&format!("clutter[{number}].mass_kg"), thing.mass_kg, [1e-3, 100.0])?;
        }
        size("watch.late_s", self.watch.late_s, 10.0)?;
        within("watch.every_s", self.watch.every_s, [1e-3, 10.0])?;
        size("watch.sigma_m", self.watch.sigma_m, 1.0)?;
        if self.moving.len() > Mover::MOST {
            let (value, most) = (self.moving.len() as f64, Mover::MOST as f64);
            within("moving", value, [0.0, most])?;
        }
        for (number, passer) in self.moving.iter().enumerate() {
            let is_another = self.moving[..number].iter().any(|other| other.name == passer.name);
            if passer.name.is_empty() || is_another {
                return Err(Unsound::NoName(number).into());
            }
            let key = |what: &str| format!("moving[{number}].{what}");
            within(&key("radius_m"), passer.radius_m, [1e-3, Mover::LARGEST])?;
            within(&key("speed_m_s"), passer.speed_m_s, [0.0, 10.0])?;
            within(&key("begins_s"), passer.begins_s, [0.0, 86_400.0])?;
            within(&key("way_m (corners)"), passer.way_m.len() as f64, [1.0, 1e3])?;
            for x in passer.way_m.iter().flatten() {
                within(&key("way_m"), *x, [-10.0, 10.0])?;
            }
        }
        self.laws()?;
        for (name, spot) in &placement.fixed {
            let key = |what: &str| format!("placement.fixed.{name}.{what}");
            within(&key("x_m"), spot.x_m, [-10.0, 10.0])?;
            within(&key("y_m"), spot.y_m, [-10.0, 10.0])?;
            within(&key("yaw_rad"), spot.yaw_rad, [-4.0 * PI, 4.0 * PI])?;
        }
        Ok(())
    }
}

/// Says that a number is not between the least and the most that makes sense; NaN is not.
pub(super) fn within(key: &str, value: f64, allowed: Range) -> Result<(), Error> {
    if (allowed[0]..=allowed[1]).contains(&value) {
        return Ok(());
    }
    Err(Unsound::Outside { key: key.to_owned(), value, allowed }.into())
}

/// As [`within`], from 0 on.
fn size(key: &str, value: f64, most: f64) -> Result<(), Error> {
    within(key, value, [0.0, most])
}

/// Says that a draw is turned round, or reaches out of what makes sense.
fn range(key: &str, range: Range, allowed: Range) -> Result<(), Error> {
    let ([low, high], all) = (range, allowed[0]..=allowed[1]);
    if all.contains(&low) && all.contains(&high) && low <= high {
        return Ok(());
    }
    Err(Unsound::Turned { key: key.to_owned(), range, allowed }.into())
}
