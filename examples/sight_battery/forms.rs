//! The forms of the things in the photographs of clear things, as somebody who has them in hand would declare them.
//!
//! Nobody here has them in hand. Their sizes and their places are those at which a solid of each form fills the published
//! masks best, several pieces of one kind with one size (`scripts/sight_forms.py`: overlaps of 0.97 to 0.99), the mug's, which is in no mask,
//! a cut made by hand. The depth maps put the same things 0 to 9 mm nearer to the camera. No edge that the program looks for
//! has a part in them.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

use nalgebra::Vector3;
use trueup::world::mesh::Mesh;
use trueup::world::{Profile, Shape};

type P3 = Vector3<f64>;

/// Facets of a quarter turn: 10 deg each, so that what is round has no lines on it.
const QUARTER: usize = 9;

/// Where the bottles of the first photograph stand, m.
pub(crate) const BOTTLES: [[f64; 2]; 3] = [[-0.085, -0.090], [0.019, -0.029], [0.185, -0.069]];
/// Where the flowers of the second stand, m.
pub(crate) const FLOWERS: [[f64; 2]; 3] = [[0.188, 0.097], [0.337, 0.048], [-0.028, -0.074]];
/// Where the mug and the standing tumbler of the third are, m.
pub(crate) const MUG: [f64; 2] = [-0.108, -0.073];
pub(crate) const TUMBLER: [f64; 2] = [0.122, 0.205];

/// A square with round corners: half its side and the corners' radius, m, at a height.
fn square(half: f64, round: f64, z: f64) -> Vec<P3> {
    let corner = |k: usize, i: usize| {
        let turn = FRAC_PI_2 * (k as f64 + i as f64 / QUARTER as f64);
        let middle = FRAC_PI_2 * k as f64;
        let (x, y) = (middle.cos() - middle.sin(), middle.sin() + middle.cos());
        P3::new((half - round) * x + round * turn.cos(), (half - round) * y + round * turn.sin(), z)
    };
    (0..4).flat_map(|k| (0..=QUARTER).map(move |i| corner(k, i))).collect()
}

/// A closed body between rings of equally many points, each once round, with a fan over the first and the last.
fn between(name: &str, rings: &[Vec<P3>]) -> Shape {
    let mut triangles = Vec::new();
    for pair in rings.windows(2) {
        let (low, high) = (&pair[0], &pair[1]);
        for i in 0..low.len() {
            let j = (i + 1) % low.len();
            triangles.push([low[i], low[j], high[j]]);
            triangles.push([low[i], high[j], high[i]]);
        }
    }
    for (ring, is_last) in [(rings.first(), false), (rings.last(), true)] {
        let Some(ring) = ring else { continue };
        let middle = ring.iter().sum::<P3>() / ring.len() as f64;
        for i in 0..ring.len() {
            let (a, b) = (ring[i], ring[(i + 1) % ring.len()]);
            triangles.push(if is_last { [middle, a, b] } else { [middle, b, a] });
        }
    }
    Shape::Mesh { mesh: Arc::new(Mesh::new(name, &triangles, 1.0).unwrap()) }
}

/// A bottle of square body, round shoulders and a round neck, 167 mm high.
pub(crate) fn bottle() -> Shape {
    let (half, round, neck, shoulder, neck_from, height) =
        (0.0294, 0.0154, 0.0176, 0.1324, 0.1494, 0.1678);
    let foot = 0.0045;
    let mut rings = Vec::new();
    for k in 0..=QUARTER {
        let (sin, cos) = (FRAC_PI_2 * k as f64 / QUARTER as f64).sin_cos();
        let less = foot * (1.0 - sin);
        rings.push(square(half - less, round - less, foot * (1.0 - cos)));
    }
    for k in 0..=QUARTER {
        let (sin, cos) = (FRAC_PI_2 * k as f64 / QUARTER as f64).sin_cos();
        let wide = neck + (half - neck) * cos;
        let corner = (round + (neck - round) * (1.0 - cos)).min(wide - 1e-4);
        rings.push(square(wide, corner, shoulder + (neck_from - shoulder) * sin));
    }
    rings.push(square(neck, neck - 1e-4, height));
    between("bottle", &rings)
}

/// A tumbler that opens upwards from a square foot to a rounder mouth, 111 mm high.
pub(crate) fn tumbler() -> Shape {
    between("tumbler", &[square(0.0203, 0.0044, 0.0), square(0.0331, 0.0157, 0.1106)])
}

/// A flat box with the outline of a flower of five petals, standing on two of them, 81 mm high and 28 mm thick.
pub(crate) fn flower() -> Shape {
    let (middle, petal, thick): (f64, f64, f64) = (0.0277, 0.0154, 0.0284);
    // Between the petals the outline is that of a disc; where it meets a petal, seen from the petal's own middle.
    let disc = 0.9 * middle;
    let meets = (disc * disc - middle * middle - petal * petal) / (2.0 * middle * petal);
    let half = meets.acos();
    let ring = |y: f64| -> Vec<P3> {
        let points = (0..5).flat_map(|k| (0..=24).map(move |i| (k, i)));
        let at = points.map(|(k, i)| {
            let out = FRAC_PI_2 + TAU * f64::from(k) / 5.0;
            let turn = out - half + 2.0 * half * f64::from(i) / 24.0;
            P3::new(
                middle * out.cos() + petal * turn.cos(),
                y,
                middle * out.sin() + petal * turn.sin(),
            )
        });
        at.collect()
    };
    between("flower", &[ring(0.5 * thick), ring(-0.5 * thick)])
}

/// The mug without its handle: it widens a little to foot and rim, 122 mm high.
pub(crate) fn mug() -> Shape {
    let rings =
        [[0.0445, 0.0], [0.0445, 0.006], [0.0435, 0.025], [0.0439, 0.0734], [0.0475, 0.1223]];
    Shape::Lathe { profile: Profile::new(&rings).unwrap() }
}
