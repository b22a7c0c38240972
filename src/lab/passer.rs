//! What moves through the laboratory by itself: balls on straight ways, such as a hand that reaches across the table.
//!
//! They are in the pictures, and whoever watches tells of them. They push nothing and are pushed by nothing: what would have been
//! a blow is an overlap.

use nalgebra::{Isometry3, Vector3};

use super::sensor;
use super::settings::{Passer, Watch};
use crate::twin::render::{Body, Paint, Shape};
use crate::world::Mover;

impl Passer {
    /// Returns where it is at `time` (s), m; nothing where its way has no corner.
    fn at(&self, time: f64) -> Option<Vector3<f64>> {
        let mut left = (time - self.begins_s).max(0.0) * self.speed_m_s;
        let mut corners = self.way_m.iter().map(|corner| Vector3::from(*corner));
        let mut here = corners.next()?;
        for next in corners {
            let leg = next - here;
            let length = leg.norm();
            if left < length {
                return Some(here + leg * (left / length));
            }
            left -= length;
            here = next;
        }
        Some(here)
    }

    /// Returns it as it is drawn at `time`, s.
    pub(super) fn body(&self, time: f64) -> Option<Body> {
        Some(Body {
            name: self.name.clone(),
            shape: Shape::Sphere(self.radius_m),
            world_from_body: Isometry3::from(self.at(time)?),
            paint: Paint::opaque(self.colour, 0.2),
        })
    }
}

/// Returns what whoever watches says at `time` (s): what was seen at the last look that is told by then. `key` chooses the noise
/// of a look.
pub(super) fn told(
    passers: &[Passer],
    watch: &Watch,
    is_noisy: bool,
    time: f64,
    key: impl Fn(u64) -> u64,
) -> Vec<Mover> {
    // Half a rounding error before a look it is that look.
    let look = ((time - watch.late_s) / watch.every_s + 1e-9).floor();
    if look < 0.0 {
        return Vec::new();
    }
    let seen_at = look * watch.every_s;
    let sigma = if is_noisy { watch.sigma_m } else { 0.0 };
    let told = passers.iter().enumerate().filter_map(|(which, passer)| {
        let off = |axis: usize| sigma * sensor::noise(key(look as u64), (which * 3 + axis) as u64);
        Some(Mover {
            name: passer.name.clone(),
            at: passer.at(seen_at)? + Vector3::new(off(0), off(1), off(2)),
            radius: passer.radius_m,
            age: time - seen_at,
        })
    });
    told.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_waits_goes_from_corner_to_corner_and_stays() {
        let passer = Passer {
            name: "hand".into(),
            radius_m: 0.08,
            way_m: vec![[0.0, 0.0, 0.3], [0.4, 0.0, 0.3], [0.4, 0.2, 0.3]],
            speed_m_s: 0.1,
            begins_s: 2.0,
            colour: [0; 3],
        };
        for (time, at) in [
            (0.0, [0.0, 0.0, 0.3]),
            (3.0, [0.1, 0.0, 0.3]),
            (7.0, [0.4, 0.1, 0.3]),
            (60.0, [0.4, 0.2, 0.3]),
        ] {
            assert!((passer.at(time).unwrap() - Vector3::from(at)).norm() < 1e-12, "{time}");
        }
        let watch = Watch::default();
        let told =
            |time: f64| told(std::slice::from_ref(&passer), &watch, false, time, |look| look);
        assert!(told(0.04).is_empty(), "nothing was told yet");
        let late = told(3.06);
        // The look at 3 s is told at 3.05 s.
        assert!((late[0].age - 0.06).abs() < 1e-9 && (late[0].at.x - 0.1).abs() < 1e-9, "{late:?}");
    }
}
