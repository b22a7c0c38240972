//! A mesh met by rays: where, and how its surface lies there.
//!
//! A surface that bends little from one triangle to the next stands for a smooth one: its normal changes evenly over a
//! triangle, so that light does not show the triangles. Where it bends more there is an edge.
//!
//! Source: Phong, "Illumination for computer generated pictures", CACM 1975 (normals between corners).

use std::sync::Arc;

use nalgebra::Vector3;

use crate::world::Mesh;

/// A bend by less is smooth, as a cosine: 30 deg, the sides of a cylinder of twelve.
const SMOOTH: f64 = 0.866;
/// What is met nearer than this, along a ray, is where the ray begins, m.
const OWN: f64 = 1e-6;

/// A closed surface with the normals at the corners of its triangles.
#[derive(Debug, Clone)]
pub(super) struct Surface {
    mesh: Arc<Mesh>,
    normals: Arc<Vec<[Vector3<f64>; 3]>>,
    /// Of each triangle a number that its smooth neighbours have too.
    faces: Arc<Vec<u8>>,
}

impl Surface {
    pub(super) fn new(mesh: Arc<Mesh>) -> Self {
        let flat = mesh.normals();
        let corners = mesh.corners();
        let mut at: Vec<Vec<usize>> = vec![Vec::new(); corners.len()];
        for (face, t) in mesh.triangles().iter().enumerate() {
            for corner in t {
                at[*corner as usize].push(face);
            }
        }
        let area = |face: usize| {
            let [a, b, c] = mesh.triangles()[face].map(|corner| corners[corner as usize]);
            (b - a).cross(&(c - a)).norm()
        };
        let normals = mesh.triangles().iter().enumerate().map(|(face, t)| {
            t.map(|corner| {
                let alike =
                    at[corner as usize].iter().filter(|o| flat[**o].dot(&flat[face]) > SMOOTH);
                let sum: Vector3<f64> = alike.map(|o| flat[*o] * area(*o)).sum();
                sum.try_normalize(0.0).unwrap_or(flat[face])
            })
        });
        // Directions in 6 x 5 x 5 steps: faces that meet in an edge differ in one.
        let faces = flat.iter().map(|n| {
            let [x, y, z] = [(n.x, 2.9), (n.y, 2.4), (n.z, 2.4)]
                .map(|(share, steps)| ((share + 1.0) * steps).floor() as u8);
            (x * 5 + y) * 5 + z
        });
        Self { normals: Arc::new(normals.collect()), faces: Arc::new(faces.collect()), mesh }
    }

    /// Returns the corners of the box around it, m.
    pub(super) fn bounds(&self) -> (Vector3<f64>, Vector3<f64>) {
        let half = self.mesh.size() / 2.0;
        (Vector3::new(-half.x, -half.y, 0.0), Vector3::new(half.x, half.y, 2.0 * half.z))
    }

    /// Returns where a ray first meets it beyond `least`, the normal there and the number of the face.
    pub(super) fn hit(
        &self,
        o: Vector3<f64>,
        d: Vector3<f64>,
        least: f64,
    ) -> Option<(f64, Vector3<f64>, u8)> {
        let met = self.mesh.meets(&o, &d, least.max(0.0))?;
        let at = o + d * met.far;
        let [a, b, c] =
            self.mesh.triangles()[met.triangle].map(|k| self.mesh.corners()[k as usize]);
        let (ab, ac, ap) = (b - a, c - a, at - a);
        let flat = self.mesh.normals()[met.triangle];
        let whole = ab.cross(&ac).dot(&flat).max(1e-18);
        let v = (ap.cross(&ac).dot(&flat) / whole).clamp(0.0, 1.0);
        let w = (ab.cross(&ap).dot(&flat) / whole).clamp(0.0, 1.0);
        let [x, y, z] = self.normals[met.triangle];
        let smooth = x * (1.0 - v - w) + y * v + z * w;
        let normal = smooth.try_normalize(1e-9).unwrap_or(flat);
        // At its rim a smooth normal may point away from the eye.
        let normal = if normal.dot(&d) > 0.0 && !met.from_inside { flat } else { normal };
        Some((met.far, normal, self.faces[met.triangle]))
    }

    /// Returns whether a point is inside.
    pub(super) fn holds(&self, p: Vector3<f64>) -> bool {
        self.mesh.meets(&p, &Vector3::z(), 0.0).is_some_and(|met| met.from_inside)
    }

    /// Returns whether it stands between a point and what lies far along a direction.
    pub(super) fn blocks(&self, o: Vector3<f64>, d: Vector3<f64>) -> bool {
        self.mesh.meets(&o, &d, OWN).is_some()
    }
}
