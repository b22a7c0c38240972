//! Analytic open vessels: a prism with a floor, walls of some thickness and an open top.
//!
//! A particle knows for each vessel whether it is inside. The only way in is through the mouth:
//! [`Vessel::confine`] looks at the path since the last step, relative to the moving vessel. What is inside stays
//! there ([`Vessel::under_lid`]) until the rim lets go of it. So nothing crosses a wall, however fast, and also when the
//! lip of one vessel dips below the rim of another.

use std::sync::Arc;

use nalgebra::{Isometry3, Vector3};

use crate::twin::basin::Basin;
use crate::twin::hold::Hold;
use crate::world::{Object, Profile, Shape};

/// The outline of a prism, seen from above.
#[derive(Debug, Clone, PartialEq)]
enum Outline {
    /// Half edge lengths, m.
    Box(f32, f32),
    /// Radius, m.
    Round(f32),
    /// Radii over heights, m.
    Turned(Turned),
}

/// A round outline whose radius changes with the height.
#[derive(Debug, Clone, PartialEq)]
struct Turned {
    profile: Arc<Profile>,
    /// How high its foot is, m.
    foot: f32,
    /// How much larger it is, m.
    grown: f32,
}

impl Turned {
    fn radius_at(&self, z: f32) -> f32 {
        (self.profile.radius_at(f64::from(z - self.foot)) as f32 + self.grown).max(0.0)
    }
}

impl Outline {
    /// Returns the outline moved outwards by `d` m.
    fn grown(&self, d: f32) -> Self {
        match *self {
            Self::Box(x, y) => Self::Box((x + d).max(0.0), (y + d).max(0.0)),
            Self::Round(r) => Self::Round((r + d).max(0.0)),
            Self::Turned(ref turned) => {
                Self::Turned(Turned { grown: turned.grown + d, ..turned.clone() })
            }
        }
    }

    fn contains(&self, p: &Vector3<f32>) -> bool {
        match *self {
            Self::Box(x, y) => p.x.abs() <= x && p.y.abs() <= y,
            Self::Round(r) => p.x * p.x + p.y * p.y <= r * r,
            Self::Turned(ref turned) => Self::Round(turned.radius_at(p.z)).contains(p),
        }
    }

    /// Moves a point that is outside onto the outline.
    fn pull_in(&self, p: &mut Vector3<f32>) {
        match *self {
            Self::Box(x, y) => {
                p.x = p.x.clamp(-x, x);
                p.y = p.y.clamp(-y, y);
            }
            Self::Round(r) => {
                let d = across(p);
                if d > r {
                    p.x *= r / d;
                    p.y *= r / d;
                }
            }
            Self::Turned(ref turned) => Self::Round(turned.radius_at(p.z)).pull_in(p),
        }
    }

    /// Moves a point that is inside onto the nearest place of the outline.
    fn push_out(&self, p: &mut Vector3<f32>) {
        match *self {
            Self::Box(x, y) => {
                if x - p.x.abs() < y - p.y.abs() {
                    p.x = x.copysign(p.x);
                } else {
                    p.y = y.copysign(p.y);
                }
            }
            Self::Round(r) => {
                let d = across(p);
                if d > 1e-9 {
                    p.x *= r / d;
                    p.y *= r / d;
                } else {
                    p.x = r;
                }
            }
            Self::Turned(ref turned) => Self::Round(turned.radius_at(p.z)).push_out(p),
        }
    }
}

/// Returns the distance from the axis, m; lengths here are far from where `hypot` would be needed.
fn across(p: &Vector3<f32>) -> f32 {
    (p.x * p.x + p.y * p.y).sqrt()
}

/// A vessel in its own frame: origin at the centre of its base, z up.
#[derive(Debug, Clone)]
pub struct Vessel {
    inner: Outline,
    outer: Outline,
    floor: f32,
    rim: f32,
    inside: Shape,
    /// What it holds at a tilt.
    hold: Arc<Hold>,
    basin: Arc<Basin>,
}

impl Vessel {
    /// Returns the vessel an object is, if it is one.
    pub fn new(object: &Object) -> Option<Self> {
        let outline = |shape: &Shape, foot: f64| match (shape, shape.faces()) {
            (Shape::Lathe { profile }, _) => {
                let profile = Arc::new(*profile);
                Outline::Turned(Turned { profile, foot: foot as f32, grown: 0.0 })
            }
            (_, Some([x, y])) => Outline::Box((x / 2.0) as f32, (y / 2.0) as f32),
            (_, None) => Outline::Round(shape.inner_radius() as f32),
        };
        Some(Self {
            inner: outline(&object.inside()?, object.cavity?.wall),
            outer: outline(&object.shape, 0.0),
            floor: object.cavity?.wall as f32,
            rim: object.shape.height() as f32,
            inside: object.inside()?,
            hold: Arc::new(Hold::of(object)?),
            basin: Arc::new(Basin::new(&object.shape, object.cavity?.wall)),
        })
    }

    /// Returns the solid that is hollow.
    pub(super) fn inside(&self) -> &Shape {
        &self.inside
    }

    /// Returns its inside, to ask how liquid stands there.
    pub(super) fn basin(&self) -> Arc<Basin> {
        Arc::clone(&self.basin)
    }

    /// Returns what it holds at a tilt.
    pub(super) fn hold(&self) -> &Hold {
        &self.hold
    }

    /// Returns the volume to the rim, m³.
    pub fn volume(&self) -> f32 {
        self.area() * (self.rim - self.floor)
    }

    /// Returns the height of the rim above the base, m.
    pub fn rim(&self) -> f32 {
        self.rim
    }

    /// Returns the radius about the origin that contains the vessel, m.
    pub fn bound(&self) -> f32 {
        let across = match self.outer {
            Outline::Box(x, y) => x.hypot(y),
            Outline::Round(r) => r,
            Outline::Turned(ref turned) => turned.profile.widest() as f32 + turned.grown,
        };
        across.hypot(self.rim)
    }

    /// Returns the area of the inside across, m²; its mean over the height.
    pub fn area(&self) -> f32 {
        match self.inner {
            Outline::Box(x, y) => 4.0 * x * y,
            Outline::Round(r) => std::f32::consts::PI * r * r,
            Outline::Turned(ref turned) => {
                (turned.profile.volume() / turned.profile.height()) as f32
            }
        }
    }

    /// Returns whether a point (in the vessel's frame) lies between floor and rim, inside the walls.
    pub fn holds(&self, p: &Vector3<f32>) -> bool {
        p.z < self.rim && p.z >= 0.0 && self.inner.grown(1e-5).contains(p)
    }

    /// Returns the place beside the wall, just below the rim, that is nearest to a point on the lip; `gap` m
    /// is kept from the wall.
    pub fn beside_lip(&self, p: &Vector3<f32>, gap: f32) -> Vector3<f32> {
        let mut place = *p;
        let hull = self.outer.grown(gap);
        if hull.contains(&place) {
            hull.push_out(&mut place);
        } else {
            hull.pull_in(&mut place);
        }
        place.z = self.rim - gap;
        place
    }

    /// Returns the place on the lip on the side of `down` (in the vessel's frame), `along` it from -0.5 to 0.5, with
    /// a `gap` (m) over the rim.
    pub(super) fn on_lip(&self, down: &Vector3<f32>, along: f32, gap: f32) -> Vector3<f32> {
        // Nine tenths of an edge, or a sixth of the way round: further aside the lip is higher.
        let around = |r: f32| {
            let turn = down.y.atan2(down.x) + along * std::f32::consts::FRAC_PI_3;
            (r * turn.cos(), r * turn.sin())
        };
        let (x, y) = match self.outer {
            Outline::Box(x, y) if down.x.abs() > down.y.abs() => {
                (x.copysign(down.x), 1.8 * along * y)
            }
            Outline::Box(x, y) => (1.8 * along * x, y.copysign(down.y)),
            Outline::Round(r) => around(r),
            Outline::Turned(ref turned) => around(turned.radius_at(self.rim)),
        };
        Vector3::new(x, y, self.rim + gap)
    }

    /// Returns the nearest place inside, `margin` m from walls, floor and a lid on the rim.
    pub(super) fn under_lid(&self, p: &Vector3<f32>, margin: f32) -> Vector3<f32> {
        let mut kept = *p;
        kept.z = kept.z.clamp(self.floor + margin, self.rim - margin);
        self.inner.grown(-margin).pull_in(&mut kept);
        kept
    }

    /// Returns where a particle may be that was outside at `from` and wants to be at `to` (both in the vessel's
    /// frame, then and now), and whether it is inside now. `margin` m is kept from the surfaces.
    pub fn confine(
        &self,
        from: &Vector3<f32>,
        to: &Vector3<f32>,
        margin: f32,
    ) -> (Vector3<f32>, bool) {
        if self.enters(from, to) {
            return (self.under_lid(to, margin), true);
        }
        let mut p = *to;
        let hull = self.outer.grown(margin);
        if p.z >= self.rim || p.z <= -margin || !hull.contains(&p) {
            return (p, false);
        }
        // It came into the walls from outside: on top of the rim, from below, or through the side.
        if from.z >= self.rim && self.outer.contains(&self.at_rim(from, to)) {
            p.z = self.rim;
        } else if from.z <= -margin && self.outer.contains(from) {
            p.z = -margin;
        } else {
            hull.push_out(&mut p);
        }
        (p, false)
    }

    /// Returns whether a path from outside goes down through the mouth.
    fn enters(&self, from: &Vector3<f32>, to: &Vector3<f32>) -> bool {
        from.z >= self.rim && to.z < self.rim && self.inner.contains(&self.at_rim(from, to))
    }

    /// Returns where a downward path passes the rim's plane.
    fn at_rim(&self, from: &Vector3<f32>, to: &Vector3<f32>) -> Vector3<f32> {
        let drop = from.z - to.z;
        let t = if drop > 1e-9 { ((from.z - self.rim) / drop).clamp(0.0, 1.0) } else { 1.0 };
        from + (to - from) * t
    }
}

/// Returns a pose in single precision.
pub(super) fn single(pose: &Isometry3<f64>) -> Isometry3<f32> {
    pose.cast()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::object;

    fn vessel(shape: Shape) -> Vessel {
        Vessel::new(&object::vessel(shape, 1e-3)).unwrap()
    }

    fn jar() -> Vessel {
        vessel(Shape::Cuboid { size: Vector3::new(0.066, 0.066, 0.14) })
    }

    fn cup() -> Vessel {
        vessel(Shape::Cylinder { radius: 0.08, height: 0.095 })
    }

    #[test]
    fn what_is_inside_stays_between_walls_floor_and_lid() {
        let inside = Vector3::new(0.02, 0.0, 0.05);
        for vessel in [jar(), cup()] {
            assert_eq!(vessel.under_lid(&inside, 0.001), inside);
            for to in [
                Vector3::new(0.2, 0.0, 0.05),
                Vector3::new(0.02, -0.3, 0.07),
                Vector3::new(0.0, 0.0, -0.1),
                Vector3::new(0.5, 0.0, 0.2),
            ] {
                let p = vessel.under_lid(&to, 0.001);
                assert!(vessel.inner.contains(&p) && vessel.holds(&p), "{to:?} became {p:?}");
                assert!(p.z >= vessel.floor, "{to:?} became {p:?}");
            }
        }
    }

    #[test]
    fn no_path_enters_through_a_wall_but_any_through_the_mouth() {
        for vessel in [jar(), cup()] {
            let target = Vector3::new(0.0, 0.01, 0.05);
            for from in [
                Vector3::new(0.2, 0.0, 0.05),
                Vector3::new(0.0, 0.0, -0.05),
                Vector3::new(0.2, 0.0, vessel.rim + 0.001),
            ] {
                let (p, inside) = vessel.confine(&from, &target, 0.001);
                assert!(!inside && !vessel.holds(&p), "{from:?} became {p:?}");
            }
            let above = Vector3::new(0.0, 0.01, vessel.rim + 0.02);
            assert_eq!(vessel.confine(&above, &target, 0.001), (target, true));
        }
    }

    #[test]
    fn a_drop_on_the_rim_stays_on_the_rim() {
        let from = Vector3::new(0.0315, 0.0, 0.142);
        let (p, inside) = jar().confine(&from, &Vector3::new(0.0315, 0.0, 0.13), 0.001);
        assert!(!inside && (p.z - 0.14).abs() < 1e-6);
    }
}
