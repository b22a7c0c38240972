//! Frames as types: a pose `Pose<To, From>` carries points of `From` into `To`.
//!
//! A pose is named `to_from_from` (`world_from_camera`) and equal names meet when poses are composed:
//! `world_from_tool = world_from_base * base_from_tool`. Composing frames that do not meet is a type
//! error. Objects are named at run time, so they share the one marker [`Object`].
//!
//! Lengths in m, angles in rad. Quaternions in files are `[w, x, y, z]`.

use std::fmt;
use std::marker::PhantomData;
use std::ops::Mul;

use nalgebra::{Isometry3, Matrix3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

macro_rules! frames {
    ($($(#[$doc:meta])* $name:ident),* $(,)?) => {
        $($(#[$doc])* #[derive(Debug, Clone, Copy, PartialEq, Eq)] pub enum $name {})*
    };
}

frames! {
    /// The table: origin on its top, z up.
    World,
    /// The robot's base link.
    Base,
    /// The robot's flange (`end_effector_link`).
    Flange,
    /// The tool centre point between the finger pads (`tool_frame`), z forward, jaws open along x.
    Tool,
    /// A camera: x right, y down, z forward.
    Camera,
    /// A printed board: origin at its first inner corner, x along a row, y along a column.
    Board,
    /// Any object: origin at the centre of its base, z along its axis of symmetry, up when it stands.
    Object,
}

/// Returns `m v`, written out: rays, bodies and links ask for it some hundred million times, and the general product
/// is a loop over columns.
#[inline]
pub fn times(m: &Matrix3<f64>, v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(
        m.m11 * v.x + m.m12 * v.y + m.m13 * v.z,
        m.m21 * v.x + m.m22 * v.y + m.m23 * v.z,
        m.m31 * v.x + m.m32 * v.y + m.m33 * v.z,
    )
}

/// Returns `mᵀ v`: for a rotation, `v` turned back.
#[inline]
pub fn turned_back(m: &Matrix3<f64>, v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(
        m.m11 * v.x + m.m21 * v.y + m.m31 * v.z,
        m.m12 * v.x + m.m22 * v.y + m.m32 * v.z,
        m.m13 * v.x + m.m23 * v.y + m.m33 * v.z,
    )
}

/// A rigid motion that carries points given in `From` into `To`.
pub struct Pose<To, From> {
    isometry: Isometry3<f64>,
    frames: PhantomData<fn(From) -> To>,
}

/// A point given in frame `F`, m.
pub struct Point<F> {
    coords: Point3<f64>,
    frame: PhantomData<fn() -> F>,
}

impl<To, From> Pose<To, From> {
    /// Names the frames of a bare isometry.
    pub fn new(isometry: Isometry3<f64>) -> Self {
        Self { isometry, frames: PhantomData }
    }

    /// Returns the pose whose frames coincide.
    pub fn identity() -> Self {
        Self::new(Isometry3::identity())
    }

    /// Returns the pose of `From`'s origin at `xyz` (m, in `To`) turned by `rotation`.
    pub fn from_parts(xyz: Vector3<f64>, rotation: UnitQuaternion<f64>) -> Self {
        Self::new(Isometry3::from_parts(Translation3::from(xyz), rotation))
    }

    /// Returns the pose of an upright frame at `(x, y, z)` m turned by `yaw` rad about z.
    pub fn upright(x: f64, y: f64, z: f64, yaw: f64) -> Self {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
        Self::from_parts(Vector3::new(x, y, z), turn)
    }

    /// Returns the bare isometry.
    pub fn isometry(&self) -> &Isometry3<f64> {
        &self.isometry
    }

    /// Returns `From`'s origin in `To`, m.
    pub fn origin(&self) -> Vector3<f64> {
        self.isometry.translation.vector
    }

    /// Returns the rotation part.
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        self.isometry.rotation
    }

    /// Returns `From`'s x, y or z axis (`0`, `1`, `2`) in `To`.
    pub fn axis(&self, i: usize) -> Vector3<f64> {
        let mut e = Vector3::zeros();
        e[i] = 1.0;
        self.isometry.rotation * e
    }

    /// Returns the pose that undoes this one.
    #[must_use]
    pub fn inverse(&self) -> Pose<From, To> {
        Pose::new(self.isometry.inverse())
    }

    /// Returns the turn about z, rad, of the `From` x axis as seen from above in `To`.
    pub fn yaw(&self) -> f64 {
        let x = self.axis(0);
        x.y.atan2(x.x)
    }

    /// Returns the angle between the z axes of the two frames, rad, 0 when upright.
    pub fn tilt(&self) -> f64 {
        self.axis(2).z.clamp(-1.0, 1.0).acos()
    }
}

impl<A, B, C> Mul<Pose<B, C>> for Pose<A, B> {
    type Output = Pose<A, C>;
    fn mul(self, rhs: Pose<B, C>) -> Pose<A, C> {
        Pose::new(self.isometry * rhs.isometry)
    }
}

impl<A, B> Mul<Point<B>> for Pose<A, B> {
    type Output = Point<A>;
    fn mul(self, rhs: Point<B>) -> Point<A> {
        Point { coords: self.isometry * rhs.coords, frame: PhantomData }
    }
}

impl<F> Point<F> {
    /// Returns the point at `(x, y, z)` m.
    pub fn new(x: f64, y: f64, z: f64) -> Self {
        Self { coords: Point3::new(x, y, z), frame: PhantomData }
    }

    /// Returns the bare coordinates, m.
    pub fn coords(&self) -> Vector3<f64> {
        self.coords.coords
    }
}

impl<F> From<Vector3<f64>> for Point<F> {
    fn from(v: Vector3<f64>) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}

// The derives would ask the frame markers for the same traits, so these are written out.
impl<To, From> Clone for Pose<To, From> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<To, From> Copy for Pose<To, From> {}
impl<To, From> PartialEq for Pose<To, From> {
    fn eq(&self, other: &Self) -> bool {
        self.isometry == other.isometry
    }
}
impl<To, From> fmt::Debug for Pose<To, From> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (t, r) = (self.origin(), self.rotation());
        write!(
            f,
            "Pose(xyz [{:.4} {:.4} {:.4}] m, wxyz [{:.4} {:.4} {:.4} {:.4}])",
            t.x, t.y, t.z, r.w, r.i, r.j, r.k
        )
    }
}
impl<F> Clone for Point<F> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<F> Copy for Point<F> {}
impl<F> PartialEq for Point<F> {
    fn eq(&self, other: &Self) -> bool {
        self.coords == other.coords
    }
}
impl<F> fmt::Debug for Point<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Point({:.4} {:.4} {:.4} m)", self.coords.x, self.coords.y, self.coords.z)
    }
}

/// A quaternion of four zeros, or of numbers that are none.
#[derive(Debug, thiserror::Error)]
#[error("quat_wxyz is not a rotation: its norm is 0")]
struct NoRotation;

/// How a pose stands in a file: `{"xyz_m": [..], "quat_wxyz": [..]}`.
#[derive(Serialize, Deserialize)]
struct PoseFile {
    xyz_m: [f64; 3],
    quat_wxyz: [f64; 4],
}

impl<To, From> Serialize for Pose<To, From> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (t, r) = (self.origin(), self.rotation());
        PoseFile { xyz_m: [t.x, t.y, t.z], quat_wxyz: [r.w, r.i, r.j, r.k] }.serialize(serializer)
    }
}

impl<'de, To, From> Deserialize<'de> for Pose<To, From> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let file = PoseFile::deserialize(deserializer)?;
        let [w, x, y, z] = file.quat_wxyz;
        let q = Quaternion::new(w, x, y, z);
        let norm = q.norm();
        if !(norm > 1e-6 && norm.is_finite()) {
            return Err(serde::de::Error::custom(NoRotation));
        }
        // What this program wrote comes back as the same bits.
        let is_unit = (norm - 1.0).abs() < 1e-12;
        let turn = if is_unit {
            UnitQuaternion::new_unchecked(q)
        } else {
            UnitQuaternion::from_quaternion(q)
        };
        Ok(Self::from_parts(Vector3::from(file.xyz_m), turn))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_and_its_inverse_cancel() {
        let pose: Pose<World, Camera> = Pose::from_parts(
            Vector3::new(0.3, -0.2, 1.1),
            UnitQuaternion::from_euler_angles(0.3, -0.7, 2.0),
        );
        let there: Point<World> = pose * Point::new(0.1, 0.2, 0.9);
        let back = pose.inverse() * there;
        assert!((back.coords() - Vector3::new(0.1, 0.2, 0.9)).norm() < 1e-12);
    }

    #[test]
    fn a_pose_survives_its_file() {
        let pose: Pose<World, Object> = Pose::upright(0.5, 0.1, 0.0, 0.4);
        let text = serde_json::to_string(&pose).unwrap();
        let again: Pose<World, Object> = serde_json::from_str(&text).unwrap();
        assert_eq!(again, pose, "bit for bit");
        let long: Pose<World, Object> =
            serde_json::from_str(r#"{"xyz_m": [0, 0, 0], "quat_wxyz": [2, 0, 0, 0]}"#).unwrap();
        assert!((long.rotation().norm() - 1.0).abs() < 1e-15);
    }
}
