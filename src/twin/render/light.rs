//! Light: the lamp, what is mirrored, the grain of the table's wood. Shadows on the table are [`super::shade`]'s, the room is
//! [`super::room`]'s.
//!
//! All in linear light, where 1 is white paper in a good exposure. Nothing here is random: the grain
//! comes from a hash of the place.

#![expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]

use std::sync::LazyLock;

use nalgebra::Vector3;
use rayon::prelude::*;
use wide::f32x4;

use super::noise::noise;
use super::options::Options;
use super::scene::{Thing, linear};
use super::shade::{Shade, disc};
use super::view::{View, WATER};

/// A colour as linear light: red, green, blue.
pub(super) type Rgb = Vector3<f64>;

/// The light of a view, made ready.
pub(super) struct Lighting {
    towards: Vector3<f64>,
    lamp: Rgb,
    pub(super) ambient: f64,
    spread: f64,
    /// Sine of `spread`.
    sine: f64,
    table: Rgb,
    pub(super) on_table: OnTable,
    /// Cosine of the angle from the lamp at which its softened image ends.
    sheen_from: f64,
    pub(super) shade: Shade,
    samples: Vec<Vector3<f64>>,
}

/// What shading the table needs, in single precision: half of a picture is table.
pub(super) struct OnTable {
    /// What the whole lamp adds to a white table.
    pub(super) lamp: Vector3<f32>,
    pub(super) ambient: f32,
    /// What the lamp's mirror image adds, per part mirrored.
    pub(super) gloss: Vector3<f32>,
    pub(super) colour: Vector3<f32>,
    wood: &'static [f32],
}

/// So many directions stand for the lamp where a body's shadows are asked for.
pub(super) const LAMPS: usize = 4;

/// How shiny the table's top is.
pub(super) const TABLE_GLOSS: f32 = 0.10;

/// Width of the softened edge of the lamp's mirror image, rad.
const SHEEN_EDGE: f64 = 0.06;

impl Lighting {
    /// Makes the light of a view ready to be seen from `eye`.
    pub(super) fn new(view: &View, things: &[Thing], options: Options, eye: Vector3<f64>) -> Self {
        let light = view.light;
        let towards = light.towards.try_normalize(1e-9).unwrap_or(Vector3::z());
        let lamp = Vector3::from(light.tint) * light.intensity;
        let on_table = OnTable {
            lamp: (lamp * towards.z.max(0.0)).cast(),
            ambient: light.ambient as f32,
            gloss: lamp.cast(),
            colour: linear(view.table.colour).cast(),
            wood: &WOOD,
        };
        let mut shade = Shade::new(view, things, &light, towards, options, eye);
        let (lamp_there, colour) = (&on_table.lamp, &on_table.colour);
        let lamp_there = f32x4::from([lamp_there.x, lamp_there.y, lamp_there.z, 0.0]);
        let ambient = f32x4::splat(on_table.ambient);
        let colour = f32x4::from([colour.x, colour.y, colour.z, 0.0]);
        let gloss = f32x4::from([0.0, 0.0, 0.0, TABLE_GLOSS]);
        shade.light_table(
            #[inline(always)]
            |[lit, open, shine, _]| {
                let light = lamp_there * f32x4::splat(lit) + ambient * f32x4::splat(open);
                colour * light + gloss * f32x4::splat(lit * shine)
            },
        );
        Self {
            towards,
            lamp,
            ambient: light.ambient,
            spread: light.spread,
            sine: light.spread.sin(),
            table: linear(view.table.colour),
            on_table,
            sheen_from: (light.spread + SHEEN_EDGE).cos(),
            shade,
            samples: if options.shadows { disc(towards, light.spread, LAMPS) } else { Vec::new() },
        }
    }

    /// Returns a few directions spread over the lamp; none when nothing casts shadows.
    #[inline]
    pub(super) fn samples(&self) -> &[Vector3<f64>] {
        &self.samples
    }

    /// Returns which things can stand between thing `own` and the lamp.
    pub(super) fn casters(&self, things: &[Thing], own: usize) -> Vec<u32> {
        /// For more things (a mesh) finding the pairs would take longer than it saves.
        const MANY: usize = 400;
        if self.samples.is_empty() || things[own].id == WATER {
            return Vec::new();
        }
        let slope = self.spread.tan();
        let below = &things[own];
        let between = |thing: &Thing| {
            let to = thing.centre - below.centre;
            let (along, both) = (to.dot(&self.towards), thing.radius + below.radius);
            let reach = both + slope * (along.abs() + both);
            along > -both && to.norm_squared() - along * along < reach * reach
        };
        let others = things.iter().enumerate().skip(1);
        others
            .filter(|&(k, thing)| k != own && thing.id != WATER)
            .filter(|&(_, thing)| things.len() > MANY || between(thing))
            .map(|(k, _)| k as u32)
            .collect()
    }

    /// Returns the direction to the lamp, unit, world.
    #[inline]
    pub(super) fn towards(&self) -> Vector3<f64> {
        self.towards
    }

    /// Returns the sine of half the angle that the lamp covers.
    #[inline]
    pub(super) fn sine(&self) -> f64 {
        self.sine
    }

    /// Returns what the lamp adds to a white surface that faces it.
    #[inline]
    pub(super) fn lamp(&self) -> Rgb {
        self.lamp
    }

    /// Returns the table's colour.
    #[inline]
    pub(super) fn table(&self) -> Rgb {
        self.table
    }

    /// Returns how the lamp's mirror image ends: the cosine of the angle beyond which nothing of it is seen, half the angle of the
    /// lamp, and how wide its edge is, rad.
    #[inline]
    pub(super) fn lamp_edge(&self) -> [f32; 3] {
        [self.sheen_from as f32, self.spread as f32, SHEEN_EDGE as f32]
    }

    /// Returns the light a surface sends towards the eye. `lit` (0 to 1) is the part of the lamp it sees,
    /// `open` (0 to 1) the part of the room.
    #[inline]
    pub(super) fn surface(
        &self,
        albedo: Rgb,
        specular: f64,
        normal: Vector3<f64>,
        from_eye: Vector3<f64>,
        lit: f64,
        open: f64,
    ) -> Rgb {
        // Light from the surroundings comes mostly from above; the table sends some back up.
        let up = 0.5 + 0.5 * normal.z;
        let around = self.ambient * open * (0.42 + 0.58 * up);
        let facing = normal.dot(&self.towards).max(0.0);
        let mut light =
            albedo.component_mul(&(self.lamp * (facing * lit) + Vector3::repeat(around)));
        if specular > 0.0 {
            let halfway = (self.towards - from_eye).normalize();
            let power = 12 + (90.0 * specular * specular) as i32;
            let shine = normal.dot(&halfway).max(0.0).powi(power) * lit * specular * 0.9;
            light += self.lamp * shine;
        }
        light
    }

    /// Returns what the table top looks like at `(x, y)`: its light, without marks.
    #[inline]
    pub(super) fn table_top(&self, x: f64, y: f64) -> Vector3<f32> {
        self.flat(self.on_table.colour * grain(self.on_table.wood, x, y), TABLE_GLOSS, x, y)
    }

    /// Returns the ink of a printed mark at `(x, y)`.
    #[inline]
    pub(super) fn mark(&self, x: f64, y: f64) -> Vector3<f32> {
        self.flat(Vector3::repeat(0.016), 0.08, x, y)
    }

    /// As [`Self::surface`] for what lies flat on the table.
    #[inline]
    fn flat(&self, albedo: Vector3<f32>, specular: f32, x: f64, y: f64) -> Vector3<f32> {
        let [lit, open, shine, _] = self.shade.at(x, y);
        let on = &self.on_table;
        let light = on.lamp * lit + Vector3::repeat(on.ambient * open);
        albedo.component_mul(&light) + on.gloss * (lit * shine * specular)
    }

    /// Returns what a polished surface mirrors in the direction `d` (unit) without asking what stands there.
    pub(super) fn mirrored(&self, d: Vector3<f64>) -> Rgb {
        // Beside the lamp a laboratory's ceiling: rows of weaker panels 2.2 m above the table.
        let panel = if d.z > 0.05 {
            let inside = |at: f64, apart: f64, half: f64| {
                // A cast is quicker than `round`, which is a call; enough panels before make it positive.
                let panels = f64::from((at / apart + 256.5) as i32) - 256.0;
                let from_middle = (at - apart * panels).abs();
                1.0 - ((from_middle - half) / 0.08).clamp(0.0, 1.0)
            };
            let scale = 2.2 / d.z;
            inside(d.x * scale - 0.4, 1.5, 0.22) * inside(d.y * scale + 0.3, 1.9, 0.50)
        } else {
            0.0
        };
        self.sheen(d) + self.lamp * (5.0 * panel)
    }

    /// Returns what lacquer, less smooth than glass, mirrors in the direction `d`: the lamp and the room's
    /// brightness, but no image of it.
    pub(super) fn sheen(&self, d: Vector3<f64>) -> Rgb {
        if d.z < 0.0 {
            return self.table * (0.55 * self.level());
        }
        let room = Vector3::repeat(0.30 + 0.25 * d.z) * self.level();
        let cos = d.dot(&self.towards);
        if cos < self.sheen_from {
            return room;
        }
        // The lamp's edge is softened a little so that its mirror image does not flicker.
        let lamp = 1.0 - ((cos.min(1.0).acos() - self.spread) / SHEEN_EDGE).clamp(0.0, 1.0);
        room + self.lamp * (12.0 * lamp * lamp)
    }

    pub(super) fn level(&self) -> f64 {
        self.ambient + 0.8 * self.lamp.max()
    }
}

/// How places of the table are places of the stored piece of wood, for a stretch of them without a fold: factor and what is added.
pub(super) struct Fold([[f32; 2]; 2]);

impl Fold {
    /// Returns how the wood lies between two places (least and greatest x and y), if no fold of it is between them.
    #[inline(always)]
    pub(super) fn between(low: [f64; 2], high: [f64; 2]) -> Option<Self> {
        const PERIOD: f64 = (GRAIN - 2) as f64;
        let mut fold = [[0.0; 2]; 2];
        for (k, fold) in fold.iter_mut().enumerate() {
            let unfold = |a: f64| a / TEXEL + 0.31 * PERIOD;
            let turns = (unfold(low[k]) / PERIOD).floor();
            // A hair within, for rounding.
            let within = 1e-3..PERIOD - 1e-3;
            let is_in = |a: f64| within.contains(&(unfold(a) - turns * PERIOD));
            if !is_in(low[k]) || !is_in(high[k]) {
                return None;
            }
            let start = 0.31 * PERIOD - turns * PERIOD;
            let is_back = turns.rem_euclid(2.0) > 0.5;
            let (sign, start) = if is_back { (-1.0, PERIOD - start) } else { (1.0, start) };
            *fold = [(sign / TEXEL) as f32, start as f32];
        }
        Some(Self(fold))
    }
}

impl OnTable {
    /// As [`Self::grains`] where no fold is between the places.
    #[inline(always)]
    pub(super) fn grains_in(&self, fold: &Fold, x: f32x4, y: f32x4) -> f32x4 {
        let Fold([[fx, ox], [fy, oy]]) = *fold;
        self.between(
            x * f32x4::splat(fx) + f32x4::splat(ox),
            y * f32x4::splat(fy) + f32x4::splat(oy),
        )
    }

    /// Returns the wood's brightness between the texels around four places of the stored piece.
    #[inline]
    fn between(&self, u: f32x4, v: f32x4) -> f32x4 {
        let (i, j) = (f32x4::from_i32x4(u.fast_trunc_int()), f32x4::from_i32x4(v.fast_trunc_int()));
        let (fu, fv) = (u - i, v - j);
        // Fewer texels than whole numbers that single precision holds.
        let at = (j * f32x4::splat(GRAIN as f32) + i).fast_trunc_int().to_array();
        let mut corners = [[0.0_f32; 4]; 4];
        for k in 0..4 {
            let wood = &self.wood[at[k] as usize..][..GRAIN + 2];
            corners[k] = [wood[0], wood[1], wood[GRAIN], wood[GRAIN + 1]];
        }
        let [a, b, c, d] = f32x4::transpose(corners.map(f32x4::from));
        let (near, far) = (a + (b - a) * fu, c + (d - c) * fu);
        near + (far - near) * fv
    }

    /// Returns the wood's brightness at four places, about 1; as [`grain`].
    #[inline(always)]
    pub(super) fn grains(&self, x: f32x4, y: f32x4) -> f32x4 {
        const PERIOD: f32 = (GRAIN - 2) as f32;
        let fold = |a: f32x4| {
            let a = a * f32x4::splat(1.0 / TEXEL as f32) + f32x4::splat(0.31 * PERIOD);
            let turns = a * f32x4::splat(0.5 / PERIOD) + f32x4::splat(1024.0);
            let whole = f32x4::from_i32x4(turns.fast_trunc_int()) - f32x4::splat(1024.0);
            let rest = a - f32x4::splat(2.0 * PERIOD) * whole;
            let folded = rest.fast_min(f32x4::splat(2.0 * PERIOD) - rest);
            folded.fast_max(f32x4::splat(0.0)).fast_min(f32x4::splat(PERIOD))
        };
        self.between(fold(x), fold(y))
    }
}

/// Edge of the stored piece of wood in texels, and of a texel in m.
const GRAIN: usize = 640;
const TEXEL: f64 = 0.0025;

/// A piece of wood of 1.6 m by 1.6 m, mirrored beyond: factors about 1.
static WOOD: LazyLock<Vec<f32>> = LazyLock::new(|| {
    (0..GRAIN * GRAIN)
        .into_par_iter()
        .map(|k| {
            let (x, y) = ((k % GRAIN) as f64 * TEXEL, (k / GRAIN) as f64 * TEXEL);
            // Growth rings cut lengthwise: stretched along x, bent by a slow wave.
            let bent = y + 0.02 * (noise(x * 2.2, y * 3.0) - 0.5);
            let rings = (noise(x * 1.3 + 9.0, bent * 34.0) - 0.5)
                + 0.6 * (noise(x * 3.1, bent * 95.0) - 0.5)
                + 0.35 * (noise(x * 26.0, bent * 190.0) - 0.5);
            let patch = noise(x * 1.7 + 40.0, y * 2.1 + 7.0) - 0.5;
            (1.0 + 0.085 * rings + 0.06 * patch) as f32
        })
        .collect()
});

/// Returns the wood's brightness at a place of the table, about 1.
#[inline]
fn grain(wood: &[f32], x: f64, y: f64) -> f32 {
    let fold = |a: f64| {
        const PERIOD: f64 = (GRAIN - 2) as f64;
        // Enough whole periods on top make it positive, so that a cast rounds down.
        let a = a * (1.0 / TEXEL) + (0.31 + 64.0) * PERIOD;
        let a = a - 2.0 * PERIOD * f64::from((a * (0.5 / PERIOD)) as i32);
        (if a > PERIOD { 2.0 * PERIOD - a } else { a }).clamp(0.0, PERIOD)
    };
    let (u, v) = (fold(x), fold(y));
    let (i, j) = (u as usize, v as usize);
    let (fu, fv) = ((u - i as f64) as f32, (v - j as f64) as f32);
    let wood = &wood[j * GRAIN + i..][..GRAIN + 2];
    let (near, far) = (wood[0] + (wood[1] - wood[0]) * fu, &wood[GRAIN..]);
    near + (far[0] + (far[1] - far[0]) * fu - near) * fv
}
