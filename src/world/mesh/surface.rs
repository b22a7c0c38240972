//! Triangles of a file → a surface: corners that are one are joined, and it is asked whether it is closed and what it encloses.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::Fault;
use super::read::Triangle;

/// Returns the least and the greatest coordinates of points.
pub(super) fn bounds<'a>(
    points: impl Iterator<Item = &'a Vector3<f64>>,
) -> (Vector3<f64>, Vector3<f64>) {
    let none = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    points.fold(none, |(low, high), p| (low.inf(p), high.sup(p)))
}

/// Makes corners that lie within `same` of each other one; triangles that lose a corner by it are left out.
pub(super) fn welded(triangles: &[Triangle], same: f64) -> (Vec<Vector3<f64>>, Vec<[u32; 3]>) {
    let mut known: BTreeMap<[i64; 3], u32> = BTreeMap::new();
    let mut corners = Vec::new();
    let mut number = |p: &Vector3<f64>| {
        // What lies on the border between two cells is looked for in both.
        let cell = |shift: f64| {
            let at = p.map(|x| (x / same + shift).floor());
            [at.x as i64, at.y as i64, at.z as i64]
        };
        let (here, there) = (cell(0.0), cell(0.5));
        let [low, high] = [here, there].map(|c| [2 * c[0], 2 * c[1], 2 * c[2]]);
        let high = high.map(|c| c + 1);
        let found = known.get(&low).or_else(|| known.get(&high)).copied();
        let number = found.unwrap_or_else(|| {
            corners.push(*p);
            (corners.len() - 1) as u32
        });
        known.entry(low).or_insert(number);
        known.entry(high).or_insert(number);
        number
    };
    let numbered: Vec<[u32; 3]> =
        triangles.iter().map(|t| [number(&t[0]), number(&t[1]), number(&t[2])]).collect();
    let whole = numbered.into_iter().filter(|[a, b, c]| a != b && b != c && a != c).collect();
    (corners, whole)
}

/// Asks whether every edge has as many triangles on one side as on the other.
pub(super) fn closed(triangles: &[[u32; 3]]) -> Result<(), Fault> {
    // How often an edge is passed upwards less how often downwards, and how often at all.
    let mut passed: BTreeMap<(u32, u32), (i32, u32)> = BTreeMap::new();
    for t in triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            let edge = passed.entry((a.min(b), a.max(b))).or_default();
            edge.0 += if a < b { 1 } else { -1 };
            edge.1 += 1;
        }
    }
    let all = passed.len();
    let open = passed.values().filter(|(_, count)| count % 2 == 1).count();
    if open > 0 {
        return Err(Fault::Open { open, all });
    }
    let turned = passed.values().filter(|(sum, _)| *sum != 0).count();
    if turned > 0 { Err(Fault::Turned { turned, all }) } else { Ok(()) }
}

/// Returns the volume, m³, negative of a surface that is inside out, and its middle, m: the sum of the tetrahedra that the
/// triangles make with the origin.
pub(super) fn enclosed(corners: &[Vector3<f64>], triangles: &[[u32; 3]]) -> (f64, Vector3<f64>) {
    let (mut volume, mut moment) = (0.0, Vector3::zeros());
    for t in triangles {
        let [a, b, c] = t.map(|corner| corners[corner as usize]);
        let part = a.dot(&b.cross(&c)) / 6.0;
        volume += part;
        moment += part * (a + b + c) / 4.0;
    }
    let middle = if volume == 0.0 { Vector3::zeros() } else { moment / volume };
    (volume, middle)
}
