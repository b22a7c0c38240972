//! A mug: a cylinder with a handle on its side at +x.
//!
//! What holds is the cylinder; the handle is three bars of one thickness, solid to everything that touches, looks or keeps
//! clear. Sizes in m. Seen, it is the surface of its parts together ([`Mug::outside`]); which way the handle points is part
//! of the pose.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::mesh::Mesh;
use super::mesh::read::Triangle;

/// From where to where the handle reaches, as shares of the height. Chosen: mugs of 8 to 10 cm at hand, whose handles begin
/// at a fifth and end at four fifths.
const BETWEEN: [f64; 2] = [0.2, 0.82];
/// Sides of the polygon that is seen as the wall: its corners are the circle's own, its sides 0.5 % inside.
const SIDES: usize = 32;
/// How deep a bar reaches into the wall, m: as deep as a round wall falls back across the bar, and this. A wall is thicker.
const INTO: f64 = 2e-4;

/// Sizes of a mug, m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Sizes", into = "Sizes")]
pub struct Mug {
    sizes: Sizes,
    outside: Arc<Mesh>,
}

/// What a mug is made by, m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sizes {
    /// Outer radius of the wall.
    pub radius: f64,
    /// Height.
    pub height: f64,
    /// How far the handle stands out from the wall.
    pub handle: f64,
    /// How thick its bars are.
    pub thick: f64,
}

/// Why sizes make no mug.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// A bar as thick as the handle is far out or half as high.
    #[error("a handle so thick leaves no room for a finger")]
    Thick,
    /// No size above 0.
    #[error("sizes of a mug are above 0")]
    Sizes,
}

/// A box in the mug's frame: its middle and half its sides, m.
pub type Bar = (Vector3<f64>, Vector3<f64>);

impl Mug {
    /// Makes a mug of its sizes.
    ///
    /// # Errors
    ///
    /// [`Fault`] says what is wrong with them.
    pub fn new(sizes: Sizes) -> Result<Self, Fault> {
        let Sizes { radius, height, handle, thick } = sizes;
        if ![radius, height, handle, thick].iter().all(|size| size.is_finite() && *size > 0.0) {
            return Err(Fault::Sizes);
        }
        let high = (BETWEEN[1] - BETWEEN[0]) * height;
        if thick >= handle || 2.0 * thick >= high || thick >= radius {
            return Err(Fault::Thick);
        }
        let wall = wall(&sizes);
        let mut parts = vec![wall.iter().flatten().copied().collect()];
        parts.extend(bars(&sizes).iter().map(corners));
        let triangles: Vec<Triangle> = wall.into_iter().chain(handle_of(&sizes)).collect();
        let outside = Mesh::of_parts(&triangles, parts).map_err(|_| Fault::Sizes)?;
        Ok(Self { sizes, outside: Arc::new(outside) })
    }

    /// Returns its sizes, m.
    pub fn sizes(&self) -> &Sizes {
        &self.sizes
    }

    /// Returns what is seen of it.
    pub fn outside(&self) -> &Arc<Mesh> {
        &self.outside
    }

    /// Returns the bars of the handle: the one that is held, and those above and below it.
    pub fn bars(&self) -> [Bar; 3] {
        bars(&self.sizes)
    }

    /// Returns the box around the handle.
    pub fn around_handle(&self) -> Bar {
        let [(middle, half), ..] = self.bars();
        let from = inner(&self.sizes);
        let to = middle.x + half.x;
        let (x, reach) = (f64::midpoint(from, to), 0.5 * (to - from));
        (Vector3::new(x, 0.0, middle.z), Vector3::new(reach, half.y, half.z))
    }

    /// Returns how far a point, seen from above, is from its handle, m; 0 where it is below it.
    pub fn beside_handle(&self, x: f64, y: f64) -> f64 {
        let (middle, half) = self.around_handle();
        ((x - middle.x).abs() - half.x).max(0.0).hypot((y.abs() - half.y).max(0.0))
    }
}

impl TryFrom<Sizes> for Mug {
    type Error = Fault;

    fn try_from(sizes: Sizes) -> Result<Self, Fault> {
        Self::new(sizes)
    }
}

impl From<Mug> for Sizes {
    fn from(mug: Mug) -> Self {
        mug.sizes
    }
}

/// Returns how far from the axis the bars of the handle begin, m.
fn inner(sizes: &Sizes) -> f64 {
    let half = 0.5 * sizes.thick;
    (sizes.radius * sizes.radius - half * half).max(0.0).sqrt() - INTO
}

fn bars(sizes: &Sizes) -> [Bar; 3] {
    let Sizes { radius, height, handle, thick } = *sizes;
    let [low, high] = BETWEEN.map(|share| share * height);
    let half = 0.5 * thick;
    let out = radius + handle;
    let held = (
        Vector3::new(out - half, 0.0, f64::midpoint(low, high)),
        Vector3::new(half, half, 0.5 * (high - low)),
    );
    // From inside the wall to the bar that is held.
    let from = inner(sizes);
    let across = |z: f64| {
        let x = f64::midpoint(from, out - thick);
        (Vector3::new(x, 0.0, z), Vector3::new(0.5 * (out - thick - from), half, half))
    };
    [held, across(high - half), across(low + half)]
}

/// The corners of a box.
fn corners((middle, half): &Bar) -> Vec<Vector3<f64>> {
    let side = |k: usize, bit: usize| if k & bit == 0 { -1.0 } else { 1.0 };
    let corner = |k: usize| Vector3::new(side(k, 1), side(k, 2), side(k, 4));
    (0..8).map(|k| middle + corner(k).component_mul(half)).collect()
}

/// The triangles of the handle: a C in x and z, drawn out along y.
fn handle_of(sizes: &Sizes) -> Vec<Triangle> {
    let Sizes { radius, height, handle, thick } = *sizes;
    let [low, high] = BETWEEN.map(|share| share * height);
    let (from, out) = (inner(sizes), radius + handle);
    let (inner, foot, head) = (out - thick, low + thick, high - thick);
    // Round about against the clock, with the corners that its three pieces share.
    let around = [
        (from, low),
        (out, low),
        (out, foot),
        (out, head),
        (out, high),
        (from, high),
        (from, head),
        (inner, head),
        (inner, foot),
        (from, foot),
    ];
    let at = |k: usize, side: f64| {
        let (x, z) = around[k % around.len()];
        Vector3::new(x, 0.5 * side * thick, z)
    };
    let mut triangles = Vec::new();
    for k in 0..around.len() {
        triangles.push([at(k, -1.0), at(k + 1, 1.0), at(k + 1, -1.0)]);
        triangles.push([at(k, -1.0), at(k, 1.0), at(k + 1, 1.0)]);
    }
    for piece in [&[0, 1, 2, 8, 9][..], &[8, 2, 3, 7], &[5, 6, 7, 3, 4]] {
        for pair in piece.windows(2).skip(1) {
            let [a, b, c] = [piece[0], pair[0], pair[1]];
            triangles.push([at(a, -1.0), at(b, -1.0), at(c, -1.0)]);
            triangles.push([at(a, 1.0), at(c, 1.0), at(b, 1.0)]);
        }
    }
    triangles
}

/// The triangles of the wall and what it stands on.
fn wall(sizes: &Sizes) -> Vec<Triangle> {
    let at = |k: usize, z: f64| {
        let (sin, cos) = (TAU * (k % SIDES) as f64 / SIDES as f64).sin_cos();
        Vector3::new(sizes.radius * cos, sizes.radius * sin, z)
    };
    let high = sizes.height;
    let mut triangles = Vec::new();
    for k in 0..SIDES {
        triangles.push([at(k, 0.0), at(k + 1, 0.0), at(k + 1, high)]);
        triangles.push([at(k, 0.0), at(k + 1, high), at(k, high)]);
        triangles.push([Vector3::zeros(), at(k + 1, 0.0), at(k, 0.0)]);
        triangles.push([Vector3::z() * high, at(k, high), at(k + 1, high)]);
    }
    triangles
}

/// Returns the volume of the handle outside the wall, m³.
pub(super) fn handle_volume(mug: &Mug) -> f64 {
    let [held, above, below] = mug.bars().map(|(_, half)| 8.0 * half.product());
    held + above + below
}

/// Returns the volume inside the wall's outside, m³.
pub(super) fn body_volume(sizes: &Sizes) -> f64 {
    PI * sizes.radius * sizes.radius * sizes.height
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mug() -> Mug {
        Mug::new(Sizes { radius: 0.038, height: 0.095, handle: 0.03, thick: 0.01 }).unwrap()
    }

    #[test]
    fn a_mug_is_seen_with_its_handle_and_looks_the_same_after_a_full_turn_only() {
        let mug = mug();
        let outside = mug.outside();
        assert!((outside.outer_radius() - 0.068).abs() < 2e-4, "{}", outside.outer_radius());
        assert_eq!(outside.parts().len(), 4);
        assert!((outside.symmetry() - TAU).abs() < 1e-12);
        let (low, high) = (outside.corners().iter().map(|p| p.x).fold(1.0, f64::min), mug.sizes());
        assert!((low + high.radius).abs() < 1e-9, "its axis is the wall's");
        assert!((mug.beside_handle(0.07, 0.0) - 0.002).abs() < 1e-9);
        assert!(mug.beside_handle(0.06, 0.003) < 1e-12);
    }

    #[test]
    fn what_is_no_mug_is_refused() {
        let sizes = Sizes { radius: 0.038, height: 0.095, handle: 0.03, thick: 0.03 };
        assert_eq!(Mug::new(sizes).unwrap_err(), Fault::Thick);
        assert_eq!(Mug::new(Sizes { radius: f64::NAN, ..sizes }).unwrap_err(), Fault::Sizes);
    }
}
