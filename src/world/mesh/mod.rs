//! A closed surface of triangles as the shape of a thing: what a scanner, a maker's drawing or a modeller's file gives.
//!
//! In: triangles of a file and what one of its numbers is in m. Out: a solid that stands as in its file, its lowest point at
//! height 0 and the middle of the box around it on the axis, so that a mesh has its origin where every other shape has its
//! own. Everything else that is asked of a shape is derived from the triangles: sizes and mass here, the convex parts that
//! touch and are kept clear of in `parts`, the lines that an eye sees in `lines`, what is between two fingers in
//! [`section`]. Reading files is [`read`]'s. A mesh holds no water: its inside is not looked for.

mod footprint;
pub mod lines;
mod parts;
pub mod read;
pub mod section;
mod surface;

use std::fmt;
use std::sync::OnceLock;

use nalgebra::{Rotation3, Vector2, Vector3};
use rapier3d_f64::parry::glamx::DVec3;
use rapier3d_f64::parry::query::{PointQuery, Ray, RayCast};
use rapier3d_f64::parry::shape::TriMesh;
use serde::{Deserialize, Serialize};

use footprint::{beyond, polygon};
use lines::{Aspects, Edge};
use read::Triangle;
use surface::{bounds, closed, enclosed, welded};

/// So many triangles a thing of a scene has at most: every photograph is compared with all of them, and 20,000 of a thing
/// of 10 cm are smaller than a pixel of the kitchen's camera.
pub const MOST: usize = 20_000;
/// Corners nearer than this share of the largest side are one: STL repeats each corner in single precision (6e-8).
const SAME: f64 = 1e-6;
/// The largest and the smallest side of a thing, m: a scene's other shapes have no side above 2 m either, and nothing
/// smaller than 2 mm has a place in a picture.
const LARGEST_SIDE: f64 = 2.0;
const SMALLEST_SIDE: f64 = 2e-3;
/// A shape looks the same after a turn when no corner is farther from the surface then, as a share of its radius, and m.
/// Chosen: 2 % are what 16 sides of a cylinder are off, half a millimetre what is smaller than a pixel.
const ALIKE: f64 = 0.02;
const ALIKE_LEAST: f64 = 5e-4;
/// Turns that are asked: two parts of a full turn up to twelve; and two that are no part of one, after which only what is
/// round looks the same, rad.
const MOST_ALIKE: u32 = 12;
const ODD_TURNS: [f64; 2] = [1.0, 0.37];
/// What lies so far below the top is part of it, as a share of the height: a face that is level to half a degree.
const TOP: f64 = 0.01;

/// Why triangles are no solid thing.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Fault {
    /// More than are compared with a picture.
    #[error("it has {0} triangles, more than {MOST}")]
    TooMany(usize),
    /// Edges with a triangle on one side only.
    #[error("it is not closed: {open} of its {all} edges have a triangle on one side only")]
    Open {
        /// Such edges.
        open: usize,
        /// All of them.
        all: usize,
    },
    /// Triangles that face different ways.
    #[error(
        "{turned} of its {all} edges have one triangle that faces outwards and one that faces inwards"
    )]
    Turned {
        /// Edges between two that do not agree.
        turned: usize,
        /// All of them.
        all: usize,
    },
    /// It encloses nothing.
    #[error("it encloses no volume")]
    Flat,
    /// Its largest side, m.
    #[error("its largest side would be {0:.3} m")]
    Large(f64),
    /// Its largest side, m.
    #[error("its largest side would be {:.4} mm", .0 * 1e3)]
    Small(f64),
}

/// A closed surface that stands on the plane z = 0, the middle of the box around it on the axis; m.
pub struct Mesh {
    file: String,
    unit: f64,
    corners: Vec<Vector3<f64>>,
    triangles: Vec<[u32; 3]>,
    /// Of each triangle, outwards; zero for one without area.
    normals: Vec<Vector3<f64>>,
    edges: Vec<Edge>,
    size: Vector3<f64>,
    volume: f64,
    middle: Vector3<f64>,
    /// Points of its convex hull.
    hull: Vec<Vector3<f64>>,
    surface: TriMesh,
    symmetry: OnceLock<f64>,
    least_between: OnceLock<Option<f64>>,
    parts: OnceLock<Vec<Vec<Vector3<f64>>>>,
    aspects: Aspects,
}

/// Where a line of sight meets a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Met {
    /// How far along, in lengths of the direction.
    pub far: f64,
    /// Which triangle.
    pub triangle: usize,
    /// Whether it is met from inside.
    pub from_inside: bool,
}

/// What is kept of a mesh in files.
#[derive(Serialize, Deserialize)]
struct Kept {
    file: String,
    unit_m: f64,
    corners_m: Vec<Vector3<f64>>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Makes a thing of a file's triangles, in the file's numbers, each of which is `unit` m.
    ///
    /// # Errors
    ///
    /// [`Fault`] says why they are none.
    pub fn new(file: &str, triangles: &[Triangle], unit: f64) -> Result<Self, Fault> {
        if triangles.len() > MOST {
            return Err(Fault::TooMany(triangles.len()));
        }
        let (low, high) = bounds(triangles.iter().flatten());
        let largest = (high - low).max() * unit;
        if largest > LARGEST_SIDE {
            return Err(Fault::Large(largest));
        }
        if largest < SMALLEST_SIDE {
            return Err(Fault::Small(largest));
        }
        let stands = Vector3::new(0.5 * (low.x + high.x), 0.5 * (low.y + high.y), low.z);
        let (corners, triangles) = welded(triangles, (high - low).max() * SAME);
        let corners = corners.into_iter().map(|corner| (corner - stands) * unit).collect();
        Self::of_corners(file, unit, corners, triangles)
    }

    /// Makes the surface of several closed bodies, which may overlap, where they stand; `parts` are convex and cover them, m.
    pub(super) fn of_parts(
        triangles: &[Triangle],
        parts: Vec<Vec<Vector3<f64>>>,
    ) -> Result<Self, Fault> {
        let (low, high) = bounds(triangles.iter().flatten());
        let (corners, triangles) = welded(triangles, (high - low).max() * SAME);
        let mut mesh = Self::of_corners("", 1.0, corners, triangles)?;
        mesh.parts = OnceLock::from(parts);
        Ok(mesh)
    }

    fn of_corners(
        file: &str,
        unit: f64,
        corners: Vec<Vector3<f64>>,
        mut triangles: Vec<[u32; 3]>,
    ) -> Result<Self, Fault> {
        let flat = corners.is_empty() || triangles.is_empty();
        let (low, high) = bounds(corners.iter());
        let size = high - low;
        if flat || size.min() <= 0.0 {
            return Err(Fault::Flat);
        }
        closed(&triangles)?;
        let (mut volume, mut middle) = enclosed(&corners, &triangles);
        if volume < 0.0 {
            // All of it was inside out.
            for t in &mut triangles {
                t.swap(1, 2);
            }
            (volume, middle) = enclosed(&corners, &triangles);
        }
        // A thousandth of the box around it: a sheet without thickness that is closed in itself.
        if volume < 1e-3 * size.product() {
            return Err(Fault::Flat);
        }
        let at = |t: &[u32; 3]| t.map(|corner| corners[corner as usize]);
        let normals: Vec<Vector3<f64>> = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = at(t);
                (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default()
            })
            .collect();
        let points = corners.iter().map(engine).collect();
        let surface = TriMesh::new(points, triangles.clone()).map_err(|_| Fault::Flat)?;
        let edges = lines::edges(&corners, &triangles, &normals);
        let hull = parts::hull(&corners);
        Ok(Self {
            file: file.to_owned(),
            unit,
            normals,
            edges,
            size,
            volume,
            middle,
            hull,
            surface,
            symmetry: OnceLock::new(),
            least_between: OnceLock::new(),
            parts: OnceLock::new(),
            aspects: Aspects::default(),
            corners,
            triangles,
        })
    }

    /// Returns the file it was read from, as the scene names it.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Returns what one number of the file is, m.
    pub fn unit(&self) -> f64 {
        self.unit
    }

    /// Returns its corners, m.
    pub fn corners(&self) -> &[Vector3<f64>] {
        &self.corners
    }

    /// Returns its triangles: three corners each, against the clock seen from outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Returns the outward normals of its triangles; zero for one without area.
    pub fn normals(&self) -> &[Vector3<f64>] {
        &self.normals
    }

    /// Returns the sides of the box around it, m.
    pub fn size(&self) -> Vector3<f64> {
        self.size
    }

    /// Returns what it encloses, m³.
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Returns the middle of what it encloses, m.
    pub fn middle(&self) -> Vector3<f64> {
        self.middle
    }

    /// Returns the corners of its convex hull, m.
    pub fn hull(&self) -> &[Vector3<f64>] {
        &self.hull
    }

    /// Returns the radius of the upright cylinder about its axis that just contains it, m.
    pub fn outer_radius(&self) -> f64 {
        self.hull.iter().map(|p| p.xy().norm()).fold(0.0, f64::max)
    }

    /// Returns the convex polygon that it covers seen from above, in order, m.
    pub fn footprint(&self) -> Vec<Vector2<f64>> {
        polygon(self.hull.iter().map(Vector3::xy).collect())
    }

    /// Returns how far inside the edge of its top a point `x`, `y` is, seen from above, m; negative outside.
    pub fn inset(&self, x: f64, y: f64) -> f64 {
        let least = self.size.z * (1.0 - TOP);
        let top = polygon(self.hull.iter().filter(|p| p.z >= least).map(Vector3::xy).collect());
        -beyond(&top, Vector2::new(x, y))
    }

    /// Returns how far a point `x`, `y` is from it, seen from above, m; 0 where it is below it.
    pub fn beside(&self, x: f64, y: f64) -> f64 {
        beyond(&self.footprint(), Vector2::new(x, y)).max(0.0)
    }

    /// Returns the angle, rad, by which it may be turned about its axis without looking different; 0 when any turn looks
    /// the same.
    pub fn symmetry(&self) -> f64 {
        *self.symmetry.get_or_init(|| {
            let near = (ALIKE * self.outer_radius()).max(ALIKE_LEAST);
            let same = |turn: f64| {
                let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), turn);
                self.corners.iter().all(|corner| {
                    let turned = engine(&(turn * corner));
                    let on = self.surface.project_local_point(turned, false).point;
                    (on - turned).length() <= near
                })
            };
            if ODD_TURNS.into_iter().all(same) {
                return 0.0;
            }
            let part = |k: u32| std::f64::consts::TAU / f64::from(k);
            (2..=MOST_ALIKE).rev().map(part).find(|turn| same(*turn)).unwrap_or(part(1))
        })
    }

    /// Returns convex hulls that together contain all of its surface, by their corners, m.
    pub fn parts(&self) -> &[Vec<Vector3<f64>>] {
        self.parts.get_or_init(|| parts::of(&self.corners, &self.triangles))
    }

    /// Returns points all over it, none farther from the next than a tenth of its largest side, m.
    pub fn spread(&self) -> Vec<Vector3<f64>> {
        let most = 0.1 * self.size.max();
        let whole = |t: &[u32; 3]| t.map(|corner| self.corners[corner as usize]);
        let pieces = self.triangles.iter().flat_map(|t| parts::pieces(whole(t), most));
        let mut points: Vec<Vector3<f64>> = pieces.flatten().collect();
        points.sort_by(|a, b| {
            a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z))
        });
        points.dedup();
        points
    }

    /// Returns where a line of sight first meets it, from `from` on.
    pub fn meets(&self, from: &Vector3<f64>, along: &Vector3<f64>, least: f64) -> Option<Met> {
        let start = from + along * least;
        let ray = Ray::new(engine(&start), engine(along));
        let met = self.surface.cast_local_ray_and_get_normal(&ray, f64::MAX, false)?;
        let triangle = met.subshape as usize;
        let from_inside = self.normals[triangle].dot(along) > 0.0;
        Some(Met { far: least + met.time_of_impact, triangle, from_inside })
    }

    /// Returns it larger by factors: across, and in height.
    #[must_use]
    pub fn scaled(&self, wide: f64, high: f64) -> Option<Self> {
        let by = Vector3::new(wide, wide, high);
        let corners = self.corners.iter().map(|corner| corner.component_mul(&by)).collect();
        Self::of_corners(&self.file, self.unit, corners, self.triangles.clone()).ok()
    }
}

impl fmt::Debug for Mesh {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.size.map(|side| side * 1e3).into();
        let (file, n) = (&self.file, self.triangles.len());
        write!(f, "Mesh({file}, {x:.1}x{y:.1}x{z:.1} mm, {n})")
    }
}

impl PartialEq for Mesh {
    fn eq(&self, other: &Self) -> bool {
        self.corners == other.corners && self.triangles == other.triangles
    }
}

impl Serialize for Mesh {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let kept = Kept {
            file: self.file.clone(),
            unit_m: self.unit,
            corners_m: self.corners.clone(),
            triangles: self.triangles.clone(),
        };
        kept.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Mesh {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        use serde::de::Error;
        let kept = Kept::deserialize(deserializer)?;
        let n = kept.corners_m.len();
        if kept.triangles.iter().flatten().any(|corner| *corner as usize >= n) {
            return Err(D::Error::custom(Fault::Flat));
        }
        Self::of_corners(&kept.file, kept.unit_m, kept.corners_m, kept.triangles)
            .map_err(D::Error::custom)
    }
}

/// Returns the engine's vector.
fn engine(v: &Vector3<f64>) -> DVec3 {
    DVec3::new(v.x, v.y, v.z)
}

/// A block and a step on it, for tests: 80 x 50 mm at the foot, 30 mm high, and 30 mm more over the lower half of x.
#[cfg(test)]
pub(crate) fn step() -> Mesh {
    let outline = [(0.0, 0.0), (80.0, 0.0), (80.0, 30.0), (30.0, 30.0), (30.0, 60.0), (0.0, 60.0)];
    Mesh::new("step.obj", &drawn_out(&outline, 50.0), 1e-3).expect("a step is a solid")
}

/// An outline in x and z drawn out along y, for tests: triangles of the file's numbers.
#[cfg(test)]
pub(crate) fn drawn_out(outline: &[(f64, f64)], deep: f64) -> Vec<Triangle> {
    let at = |k: usize, y: f64| {
        let (x, z) = outline[k % outline.len()];
        Vector3::new(x, y, z)
    };
    let n = outline.len();
    let mut triangles = Vec::new();
    for k in 0..n {
        triangles.push([at(k, 0.0), at(k + 1, 0.0), at(k + 1, deep)]);
        triangles.push([at(k, 0.0), at(k + 1, deep), at(k, deep)]);
    }
    // Ears: the outlines of the tests are seen whole from their first corner.
    for k in 1..n - 1 {
        triangles.push([at(0, 0.0), at(k + 1, 0.0), at(k, 0.0)]);
        triangles.push([at(0, deep), at(k, deep), at(k + 1, deep)]);
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_stands_on_its_lowest_point_and_has_its_own_volume() {
        let step = step();
        assert!((step.size() - Vector3::new(0.08, 0.05, 0.06)).norm() < 1e-12);
        let volume = 0.08 * 0.05 * 0.03 + 0.03 * 0.05 * 0.03;
        assert!((step.volume() - volume).abs() < 1e-12);
        let middle: Vector3<f64> = (0.08 * 0.05 * 0.03 * Vector3::new(0.0, 0.0, 0.015)
            + 0.03 * 0.05 * 0.03 * Vector3::new(-0.025, 0.0, 0.045))
            / volume;
        assert!((step.middle() - middle).norm() < 1e-12);
        let (low, high) = bounds(step.corners().iter());
        assert!((low - Vector3::new(-0.04, -0.025, 0.0)).norm() < 1e-12);
        assert!((high - Vector3::new(0.04, 0.025, 0.06)).norm() < 1e-12);
        // Its top is the upper step alone.
        assert!((step.inset(-0.025, 0.0) - 0.015).abs() < 1e-9 && step.inset(0.02, 0.0) < 0.0);
        assert!((step.beside(0.05, 0.0) - 0.01).abs() < 1e-9 && step.beside(0.02, 0.0) == 0.0);
    }

    #[test]
    fn what_is_no_solid_is_refused_with_the_reason() {
        let outline = [(0.0, 0.0), (80.0, 0.0), (80.0, 30.0), (0.0, 30.0)];
        let whole = drawn_out(&outline, 50.0);
        let made = |triangles: &[Triangle], unit: f64| Mesh::new("a.stl", triangles, unit);
        assert_eq!(made(&whole, 1.0).unwrap_err(), Fault::Large(80.0));
        assert!(
            matches!(made(&whole, 1e-6), Err(Fault::Small(side)) if (side - 8e-5).abs() < 1e-12)
        );
        assert_eq!(made(&whole[1..], 1e-3).unwrap_err(), Fault::Open { open: 3, all: 18 });
        let mut turned = whole.clone();
        turned[0].swap(1, 2);
        assert_eq!(made(&turned, 1e-3).unwrap_err(), Fault::Turned { turned: 3, all: 18 });
        let inside_out: Vec<Triangle> = whole.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        assert!((made(&inside_out, 1e-3).unwrap().volume() - 1.2e-4).abs() < 1e-12);
        assert_eq!(made(&vec![whole[0]; MOST + 1], 1e-3).unwrap_err(), Fault::TooMany(MOST + 1));
    }

    #[test]
    fn turns_after_which_it_looks_the_same_are_found() {
        use std::f64::consts::{FRAC_PI_2, PI, TAU};
        let block = |x: f64, y: f64| {
            let triangles = drawn_out(&[(0.0, 0.0), (x, 0.0), (x, 30.0), (0.0, 30.0)], y);
            Mesh::new("a.stl", &triangles, 1e-3).unwrap()
        };
        assert!((block(50.0, 50.0).symmetry() - FRAC_PI_2).abs() < 1e-12);
        assert!((block(80.0, 50.0).symmetry() - PI).abs() < 1e-12);
        assert!((step().symmetry() - TAU).abs() < 1e-12);
    }

    #[test]
    fn a_line_of_sight_meets_the_nearest_face() {
        let step = step();
        let met = step.meets(&Vector3::new(0.02, 0.0, 1.0), &-Vector3::z(), 0.0).unwrap();
        assert!((met.far - 0.97).abs() < 1e-9 && !met.from_inside);
        assert!((step.normals()[met.triangle] - Vector3::z()).norm() < 1e-12);
        let inside = step.meets(&Vector3::new(0.0, 0.0, 0.01), &Vector3::z(), 0.0).unwrap();
        assert!((inside.far - 0.02).abs() < 1e-9 && inside.from_inside);
        assert!(step.meets(&Vector3::new(0.05, 0.0, 1.0), &-Vector3::z(), 0.0).is_none());
    }

    #[test]
    fn what_is_written_is_read_again() {
        let step = step();
        let text = serde_json::to_string(&step).unwrap();
        let again: Mesh = serde_json::from_str(&text).unwrap();
        assert!(again == step && again.file() == "step.obj" && (again.unit() - 1e-3).abs() < 1e-12);
        assert!(
            serde_json::from_str::<Mesh>(
                &text.replace("\"triangles\":[[", "\"triangles\":[[99,0,1],[")
            )
            .is_err()
        );
    }
}
