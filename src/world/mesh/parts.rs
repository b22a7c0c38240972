//! The convex parts of a mesh: what touches others and what is kept clear of.
//!
//! Where to cut is `V-HACD`'s to say, on voxels. Its hulls are of voxels too, so they only decide which part a piece of the
//! surface belongs to: every triangle, cut small, goes whole to the part it is least outside of, and a part is the hull of
//! its triangles. So the parts together contain all of the surface, and no part is larger than its triangles make it.
//!
//! Source: Mamou and Ghorbel, "A simple and efficient approach for 3D mesh approximate convex decomposition", ICIP 2009;
//! the implementation is parry's.

use nalgebra::Vector3;
use rapier3d_f64::parry::glamx::DVec3;
use rapier3d_f64::parry::transformation::try_convex_hull;
use rapier3d_f64::parry::transformation::vhacd::{VHACD, VHACDParameters};

use super::engine;
use super::read::Triangle;
use super::surface::{bounds, enclosed};

/// A hull that is larger than its mesh by less than this share stands for it whole. Chosen: the round edges and small
/// dents of a part that is meant to be convex; with twice as much a step of a fifth of the height is filled.
const CONVEX: f64 = 0.03;
/// Voxels along the longest side. Chosen: 48 of a thing of 10 cm are 2 mm, the room that a finger keeps is 4; with twice as
/// many the cut takes eight times as long and lies elsewhere by half of that.
const VOXELS: u32 = 48;
/// At most so many parts, and how much of the volume a hull may enclose beside the mesh, as a share. Chosen: a ring or a
/// handle is six to eight pieces; every part is one more solid in each look of a search.
const MOST_PARTS: u32 = 12;
const CONCAVITY: f64 = 0.01;
/// The longest side of a piece of the surface, as a share of the mesh's own: what a part may at most be larger by than
/// where `V-HACD` cut.
const PIECE: f64 = 1.0 / 24.0;

/// Returns hulls that contain all of a surface, by their corners, m.
pub(super) fn of(corners: &[Vector3<f64>], triangles: &[[u32; 3]]) -> Vec<Vec<Vector3<f64>>> {
    let whole = hull(corners);
    let (volume, _) = enclosed(corners, triangles);
    if volume_of(corners).is_none_or(|hull| hull < (1.0 + CONVEX) * volume) {
        return vec![whole];
    }
    let (low, high) = bounds(corners.iter());
    let largest = (high - low).max();
    let parameters = VHACDParameters {
        concavity: CONCAVITY,
        resolution: VOXELS,
        max_convex_hulls: MOST_PARTS,
        ..VHACDParameters::default()
    };
    let points: Vec<DVec3> = corners.iter().map(engine).collect();
    let cut = VHACD::decompose(&parameters, &points, triangles, false);
    let cells: Vec<Cell> = cut.compute_convex_hulls(1).iter().filter_map(Cell::of).collect();
    if cells.is_empty() {
        return vec![whole];
    }
    let mut own: Vec<Vec<Vector3<f64>>> = cells.iter().map(|cell| vec![cell.middle]).collect();
    for triangle in triangles {
        for piece in pieces(triangle.map(|corner| corners[corner as usize]), PIECE * largest) {
            let outside = |cell: &Cell| piece.iter().map(|p| cell.beyond(p)).fold(0.0, f64::max);
            let nearest = (0..cells.len()).min_by(|a, b| {
                // What is inside several goes to the one whose middle is nearest.
                let far = |k: usize| (piece[0] - cells[k].middle).norm();
                let (x, y) = (outside(&cells[*a]), outside(&cells[*b]));
                x.total_cmp(&y).then(far(*a).total_cmp(&far(*b)))
            });
            own[nearest.unwrap_or(0)].extend(piece);
        }
    }
    // A part to which no surface fell is inside others.
    own.iter().filter(|points| points.len() > 1).map(|points| hull(points)).collect()
}

/// Returns the corners of the convex hull of points; the points themselves where they enclose nothing.
pub(super) fn hull(points: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let engines: Vec<DVec3> = points.iter().map(engine).collect();
    try_convex_hull(&engines).map_or_else(
        |_| points.to_vec(),
        |(corners, _)| corners.iter().map(|p| Vector3::new(p.x, p.y, p.z)).collect(),
    )
}

/// Returns the volume of the convex hull of points, m³.
fn volume_of(points: &[Vector3<f64>]) -> Option<f64> {
    let engines: Vec<DVec3> = points.iter().map(engine).collect();
    let (corners, triangles) = try_convex_hull(&engines).ok()?;
    let corners: Vec<Vector3<f64>> = corners.iter().map(|p| Vector3::new(p.x, p.y, p.z)).collect();
    Some(enclosed(&corners, &triangles).0)
}

/// Cuts a triangle into pieces with no side longer than `most` m.
pub(super) fn pieces(triangle: Triangle, most: f64) -> Vec<Triangle> {
    let (mut whole, mut small) = (vec![triangle], Vec::new());
    while let Some(piece) = whole.pop() {
        match halved(&piece, most) {
            Some(halves) => whole.extend(halves),
            None => small.push(piece),
        }
    }
    small
}

/// A triangle cut in two across its longest side, when that is longer than `most` m.
fn halved(triangle: &Triangle, most: f64) -> Option<[Triangle; 2]> {
    let side = |k: usize| (triangle[(k + 1) % 3] - triangle[k]).norm();
    let k = (0..3).max_by(|a, b| side(*a).total_cmp(&side(*b)))?;
    let [a, b, c] = [0, 1, 2].map(|i| triangle[(k + i) % 3]);
    let middle = (a + b) / 2.0;
    (side(k) > most).then_some([[a, middle, c], [middle, b, c]])
}

/// A hull of voxels by its faces.
struct Cell {
    /// Outward normals and how far along them the faces are.
    faces: Vec<(Vector3<f64>, f64)>,
    middle: Vector3<f64>,
}

impl Cell {
    fn of((points, triangles): &(Vec<DVec3>, Vec<[u32; 3]>)) -> Option<Self> {
        let points: Vec<Vector3<f64>> =
            points.iter().map(|p| Vector3::new(p.x, p.y, p.z)).collect();
        let middle = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
        let faces: Vec<(Vector3<f64>, f64)> = triangles
            .iter()
            .filter_map(|t| {
                let [a, b, c] = t.map(|corner| points[corner as usize]);
                let normal = (b - a).cross(&(c - a)).try_normalize(0.0)?;
                Some((normal, normal.dot(&a)))
            })
            .collect();
        (faces.len() >= 4).then_some(Self { faces, middle })
    }

    /// Returns how far a point is outside the faces, m; 0 inside.
    fn beyond(&self, p: &Vector3<f64>) -> f64 {
        self.faces.iter().map(|(normal, at)| normal.dot(p) - at).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Mesh, drawn_out, step};
    use super::*;

    /// How far a point is outside the hull of others, m.
    fn outside(part: &[Vector3<f64>], p: &Vector3<f64>) -> f64 {
        let points: Vec<DVec3> = part.iter().map(engine).collect();
        let hull = try_convex_hull(&points).unwrap();
        Cell::of(&hull).unwrap().beyond(p)
    }

    #[test]
    fn no_point_of_the_surface_is_outside_all_parts_and_the_step_stays_free() {
        let step = step();
        let parts = step.parts();
        assert!((2..=4).contains(&parts.len()), "{}", parts.len());
        for t in step.triangles() {
            let [a, b, c] = t.map(|corner| step.corners()[corner as usize]);
            for i in 0..=20 {
                for j in 0..=20 - i {
                    let (u, v) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
                    let p = a + (b - a) * u + (c - a) * v;
                    let off = parts.iter().map(|part| outside(part, &p));
                    assert!(off.fold(f64::INFINITY, f64::min) < 1e-9, "{p:?}");
                }
            }
        }
        // Over the lower half, more than a piece of the surface away from the step.
        for at in [Vector3::new(0.01, 0.0, 0.045), Vector3::new(0.03, 0.01, 0.036)] {
            assert!(parts.iter().all(|part| outside(part, &at) > 1e-3), "{at:?}");
        }
    }

    #[test]
    fn parts_are_the_same_every_time_and_one_of_what_is_convex() {
        assert_eq!(step().parts(), step().parts());
        let block = drawn_out(&[(0.0, 0.0), (80.0, 0.0), (80.0, 30.0), (0.0, 30.0)], 50.0);
        assert_eq!(Mesh::new("a.stl", &block, 1e-3).unwrap().parts().len(), 1);
    }
}
