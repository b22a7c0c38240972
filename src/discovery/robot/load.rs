//! What the hand carried for a while, as far as it is known: a vessel with what was in it, from grasp to release.
//!
//! The torque of a kilogram at its place is worked out once along the recording; how heavy it was, and how much
//! lighter it became while it was poured from, only scales that.

use nalgebra::Vector3;

use super::chain::PointMass;
use super::plant::{Arm, Plant};
use crate::discovery::recording::sidecar::Carried;

/// A thing that is carried in some recordings, the same in all.
#[derive(Debug, Clone, PartialEq)]
pub struct Thing {
    /// Its name in the scene.
    pub name: String,
    /// Its mass without what is in it, kg, as the model has it.
    pub mass: f64,
}

/// One stretch of carrying, laid out along a recording.
#[derive(Debug, Clone)]
pub struct Load {
    /// Which of the things.
    pub thing: usize,
    /// Torque the arm needs for each kilogram while it is carried, at every grid point, `len × n`, N·m/kg.
    pub per_kilogram: Vec<f64>,
    /// What was carried, vessel and contents, at every grid point, kg.
    pub mass: Vec<f64>,
    /// Between these times nobody can say who bears it, s.
    pub unsure: [[f64; 2]; 2],
}

impl Load {
    /// Lays out a stretch; `thing` is which of the things it is of, of mass `mass` without contents, kg.
    pub fn new(arm: &Arm, plant: &Plant, carried: &Carried, thing: usize, mass: f64) -> Self {
        let (body, tip) = (arm.chain.n() - 1, arm.chain.body_from_tip);
        let place = (tip * nalgebra::Point3::from(Vector3::from(carried.com_m))).coords;
        let point = PointMass { body, mass: 1.0, moment: place };
        let mut per_kilogram = plant.column(arm, |chain| chain.add_point(&point), 1.0);
        let mut masses = vec![0.0; plant.len];
        for (k, total) in masses.iter_mut().enumerate() {
            let time = plant.start + k as f64 * plant.step;
            // Where nobody can say, the fingers have it already; those rows are not judged.
            if (carried.taken_s[0]..carried.left_s[1]).contains(&time) {
                *total = mass + contents(&carried.contents_kg, time);
            } else {
                per_kilogram[k * plant.n..(k + 1) * plant.n].fill(0.0);
            }
        }
        Self { thing, per_kilogram, mass: masses, unsure: [carried.taken_s, carried.left_s] }
    }

    /// Returns whether nobody can say at `time` who bears it.
    pub fn is_unsure(&self, time: f64) -> bool {
        self.unsure.iter().any(|[from, to]| (*from..=*to).contains(&time))
    }
}

/// Returns what was inside at a time, kg: linear between what was told, and as at the ends beyond.
fn contents(told: &[[f64; 2]], time: f64) -> f64 {
    let after = told.partition_point(|[t, _]| *t <= time);
    match (after.checked_sub(1).map(|at| told[at]), told.get(after)) {
        (None, None) => 0.0,
        (Some([_, kg]), None) => kg,
        (None, Some([_, kg])) => *kg,
        (Some([t0, a]), Some([t1, b])) => a + (b - a) * (time - t0) / (t1 - t0).max(1e-9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contents_are_linear_between_what_was_told() {
        let told = [[1.0, 0.2], [3.0, 0.1]];
        for (time, kg) in [(0.0, 0.2), (1.0, 0.2), (2.0, 0.15), (3.0, 0.1), (9.0, 0.1)] {
            assert!((contents(&told, time) - kg).abs() < 1e-12, "{time}");
        }
        assert!(contents(&[], 1.0).abs() < 1e-12);
    }
}
