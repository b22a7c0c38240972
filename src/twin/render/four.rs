//! The table's top, four pixels of a row at once, in single precision: half of a picture is table.
//!
//! A place is right to 1e-7 m, a ten-thousandth of a pixel; edges are looked at closely in double precision afterwards.
//! Four numbers fit the registers that every processor of this kind has, so the picture is the same on each.

#![expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]

use nalgebra::{Matrix3, Vector3};
use wide::f32x4;

use super::lens::Lens;
use super::light::Lighting;
use super::tone::BRIGHTEST;
use crate::world::Table;

/// Where four rays beside each other meet the table's top.
pub(super) struct Four {
    x: f32x4,
    y: f32x4,
    /// How far they go, in lengths that grow by 1 along camera z.
    pub(super) depth: [f32; 4],
}

/// The rays of a picture and a table that they meet, in single precision.
pub(super) struct Plane {
    turn: Matrix3<f32>,
    eye: Vector3<f32>,
    middle: [f32; 2],
    half: [f32; 2],
    /// Whether the table can be met in this way.
    works: bool,
}

impl Plane {
    pub(super) fn new(lens: &Lens, table: &Table) -> Self {
        Self {
            turn: lens.world_from_camera().cast(),
            eye: lens.centre.cast(),
            middle: table.centre.map(|at| at as f32),
            half: [table.size.x as f32 / 2.0, table.size.y as f32 / 2.0],
            works: lens.is_radial() && lens.centre.z > 1e-3,
        }
    }

    /// Returns where the rays of the four pixels from `(u, v)` to the right meet the table, if all of them do.
    #[inline(always)]
    pub(super) fn meet(&self, lens: &Lens, u: usize, v: usize) -> Option<Four> {
        if !self.works {
            return None;
        }
        let [x, y] = lens.four(u, v);
        let (m, o) = (&self.turn, &self.eye);
        let turned =
            |a: f32, b: f32, c: f32| f32x4::splat(a) * x + f32x4::splat(b) * y + f32x4::splat(c);
        let down = turned(m.m31, m.m32, m.m33).to_array();
        // So flat a ray reaches the table's edge or nothing.
        if down[0].max(down[1]).max(down[2].max(down[3])) > -1e-4 {
            return None;
        }
        let depth = f32x4::splat(-o.z) / f32x4::from(down);
        let x = f32x4::splat(o.x) + turned(m.m11, m.m12, m.m13) * depth;
        let y = f32x4::splat(o.y) + turned(m.m21, m.m22, m.m23) * depth;
        let within = |at: f32x4, k: usize| {
            let [a, b, c, d] = (at - f32x4::splat(self.middle[k])).abs().to_array();
            a.max(b).max(c.max(d)) < self.half[k]
        };
        let is_on = within(x, 0) && within(y, 1);
        is_on.then(|| Four { x, y, depth: depth.to_array() })
    }
}

impl Four {
    /// Returns the light there.
    #[inline(always)]
    pub(super) fn light(&self, lighting: &Lighting) -> [[f32; 4]; 4] {
        lighting.table_four(self.x, self.y)
    }

    /// Returns the places (x and y, m).
    pub(super) fn places(&self) -> [[f32; 4]; 2] {
        [self.x.to_array(), self.y.to_array()]
    }
}

impl Lighting {
    /// Returns the light of the table's top at four places, without marks and no brighter than is told apart: red, green, blue
    /// and nothing.
    ///
    /// Loops are written out here and in what it asks: closures over arrays are calls in a build without all optimisation.
    #[inline(always)]
    pub(super) fn table_four(&self, x: f32x4, y: f32x4) -> [[f32; 4]; 4] {
        self.grained(self.shade.four(x, y), self.on_table.grains(x, y))
    }

    /// Returns the light of the table's top: `plain` but for its grain, and `wood` the brightness of that.
    #[inline(always)]
    pub(super) fn grained(&self, plain: [f32x4; 4], wood: f32x4) -> [[f32; 4]; 4] {
        let wood = wood.to_array();
        let gloss = &self.on_table.gloss;
        let gloss = f32x4::from([gloss.x, gloss.y, gloss.z, 0.0]);
        let mut lights = [[0.0; 4]; 4];
        for k in 0..4 {
            let mirrored = gloss * f32x4::splat(plain[k].to_array()[3]);
            lights[k] = (plain[k] * f32x4::splat(wood[k]) + mirrored)
                .fast_max(f32x4::splat(0.0))
                .fast_min(f32x4::splat(BRIGHTEST))
                .to_array();
        }
        lights
    }
}
