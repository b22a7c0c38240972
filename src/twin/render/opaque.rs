//! What four rays from the eye see of plain things: which and how far, in single precision. How bright it is, is [`super::lit`]'s.
//!
//! It is what [`super::trace`] does ray by ray, for the parts of a picture in which there are only solids and vessels of
//! [`super::rays`]: the same light, the same keys, the same shadows. What is of another form is left to that, also as what casts a shadow;
//! what is clear is met here and followed through in [`super::glass`].

#![expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]

use wide::f32x4;

use super::known::{Known, surface_of, surface_through};
use super::lit::lights;
use super::span::TOP;
use super::tone::clamped;
use super::trace::{Stage, key_of_table};
use super::vectors::Four3;
use super::view::{NOTHING, TABLE};

/// What four rays meet first.
#[derive(Clone, Copy)]
pub(super) struct Met {
    /// How far; infinite where nothing is met.
    t: f32x4,
    /// Which thing; [`NO_THING`] where nothing is met.
    pub(super) things: [u32; 4],
    /// How far the clear thing before it is, and which.
    clear_t: f32x4,
    clear: [u32; 4],
    /// Whether all four that go on to the table meet its top.
    on_top: bool,
}

/// No thing of a stage.
pub(super) const NO_THING: u32 = 1 << 23;

/// What four rays see.
pub(super) struct Looks {
    /// Linear light, no brighter than is told apart.
    pub(super) light: [[f32; 3]; 4],
    /// As in [`super::trace::Sample`].
    pub(super) keys: [u64; 4],
    /// Distances along the rays, m; infinite when nothing is met.
    pub(super) distances: [f32; 4],
    /// What is there.
    pub(super) ids: [u16; 4],
    /// What transparent thing is in front of it.
    pub(super) glass: [u16; 4],
}

/// Which of four rays are to be lit, also where they see a surface of which light is known.
#[derive(Clone, Copy)]
pub(super) struct Asked {
    /// Of those that meet something clear, a bit each.
    pub(super) clear: u32,
    /// Of these, where the light known so far is uneven.
    pub(super) uneven: u32,
    /// Those that meet something opaque. The table's light is asked for always.
    pub(super) opaque: bool,
    /// Whether others may take their light later.
    pub(super) is_kept: bool,
}

impl Asked {
    /// All of them, and nothing is taken from what is known.
    pub(super) const ALL: Self = Self { clear: 15, uneven: 0, opaque: true, is_kept: false };
}

impl Stage<'_> {
    /// Returns whether all of some things can be met four rays at a time.
    pub(super) fn are_plain(&self, things: &[u32]) -> bool {
        things.iter().all(|&k| self.plain[k as usize].is_some())
    }

    /// Returns what rays from the eye along `d` (unit) meet first among things that are plain.
    #[inline(always)]
    pub(super) fn see_four(&self, d: Four3, things: &[u32]) -> Met {
        let mut t = f32x4::splat(f32::INFINITY);
        let mut which = f32x4::splat(NO_THING as f32);
        let least = f32x4::splat(1e-6);
        let (mut clear_t, mut clear) = (t, which);
        let mut things = things;
        let mut on_top = false;
        if let [0, others @ ..] = things
            && let Some(top) = self.all_on_top(d)
        {
            (t, which, things, on_top) = (top, f32x4::splat(0.0), others, true);
        }
        for &k in things {
            let Some(plain) = &self.plain[k as usize] else { continue };
            if plain.is_clear() {
                let enter = plain.entered(d);
                let is_next = enter.simd_lt(clear_t) & enter.simd_gt(least);
                clear_t = is_next.bitselect(enter, clear_t);
                clear = is_next.bitselect(f32x4::splat(k as f32), clear);
                continue;
            }
            let enter = plain.seen(d);
            let is_next = enter.simd_lt(t) & enter.simd_gt(least);
            t = is_next.bitselect(enter, t);
            which = is_next.bitselect(f32x4::splat(k as f32), which);
        }
        let clear = clear_t.simd_lt(t).bitselect(clear, f32x4::splat(NO_THING as f32));
        let which_of = |which: f32x4| which.fast_trunc_int().to_array().map(i32::cast_unsigned);
        Met { t, things: which_of(which), clear_t, clear: which_of(clear), on_top }
    }

    /// Returns where four rays from the eye along `d` (unit) meet the table's top, if all do, well within its edge.
    #[inline(always)]
    fn all_on_top(&self, d: Four3) -> Option<f32x4> {
        let (eye, table) = (self.eye, &self.table);
        if eye.z < 1e-3 {
            return None;
        }
        let t = f32x4::splat(-eye.z as f32) / d.z;
        let within = |d: f32x4, k: usize, size: f64| {
            let from_middle = d * t + f32x4::splat((eye[k] - table.centre[k]) as f32);
            from_middle.abs().simd_lt(f32x4::splat((size / 2.0 - 1e-4) as f32))
        };
        let is_on = within(d.x, 0, table.size.x) & within(d.y, 1, table.size.y);
        (is_on & t.simd_gt(f32x4::splat(0.0))).all().then_some(t)
    }

    /// Returns the light of what rays from the eye along `d` (unit) met; of surfaces that `known` holds only where it is `asked`.
    #[inline(always)]
    pub(super) fn look_four(
        &self,
        d: Four3,
        met: Met,
        marks: &[u32],
        asked: Asked,
        known: &mut Known,
    ) -> Looks {
        let distances = met.t.to_array();
        let mut looks = Looks {
            light: [[0.0; 3]; 4],
            keys: [0; 4],
            distances,
            ids: [NOTHING; 4],
            glass: [NOTHING; 4],
        };
        let mut left = 15;
        if met.clear != [NO_THING; 4] {
            left &= !self.look_through(d, &met, asked, &mut looks, known);
        }
        while left != 0 {
            let first = left.trailing_zeros() as usize;
            let thing = met.things[first];
            if thing == NO_THING {
                let room = lights(self.lighting.room_four(self.eye, d));
                for (k, room) in room.into_iter().enumerate() {
                    if met.things[k] == NO_THING && left >> k & 1 == 1 {
                        looks.light[k] = room;
                        left &= !(1 << k);
                    }
                }
                continue;
            }
            // Where another thing is seen the numbers are not used; they are kept finite.
            let (mut own, mut t) = (0, [distances[first]; 4]);
            for k in first..4 {
                if met.things[k] == thing && left >> k & 1 == 1 {
                    own |= 1 << k;
                    t[k] = distances[k];
                }
            }
            left &= !own;
            let Some(plain) = &self.plain[thing as usize] else { continue };
            let t = f32x4::from(t);
            let at = Four3::of(self.eye.cast()) + d * t;
            let id = self.things[thing as usize].id;
            if thing == 0 && met.on_top {
                let (light, keys) = self.table_four(at, marks);
                for k in first..4 {
                    if own >> k & 1 == 1 {
                        (looks.light[k], looks.keys[k], looks.ids[k]) = (light[k], keys[k], id);
                    }
                }
                continue;
            }
            let lie = plain.surface(d, t);
            let mut top = 0;
            if id == TABLE {
                for k in first..4 {
                    top |= (own & 1 << k) * u32::from(lie.faces[k] == TOP);
                }
            }
            let mut take = |(light, keys): ([[f32; 3]; 4], [u64; 4]), which: u32| {
                for k in first..4 {
                    if which >> k & 1 == 1 {
                        (looks.light[k], looks.keys[k], looks.ids[k]) = (light[k], keys[k], id);
                    }
                }
            };
            if top != 0 {
                take(self.table_four(at, marks), top);
            }
            let body = own & !top;
            if body != 0 {
                let surface =
                    |k: usize| surface_of(thing, lie.faces[k], lie.wet >> k & 1 == 1, false);
                let known_light = (!asked.opaque).then(|| known.four(surface, body)).flatten();
                // Written out: in a closure it would be built without the widest registers.
                let lit = match known_light {
                    Some(lit) => lit,
                    None => self.light_four(thing as usize, d, at, &lie),
                };
                if asked.is_kept && known_light.is_none() {
                    known.add_four(surface, body, &lit.0);
                }
                take(lit, body);
            }
        }
        looks
    }

    /// Looks along those of four rays that meet something clear first, and returns which these are, a bit each.
    fn look_through(
        &self,
        d: Four3,
        met: &Met,
        asked: Asked,
        looks: &mut Looks,
        known: &mut Known,
    ) -> u32 {
        let t = met.clear_t.to_array();
        let mut done = 0;
        // Those that are lit come first: the others take their light.
        for is_lit in [true, false] {
            for (k, &clear) in met.clear.iter().enumerate() {
                if clear == NO_THING || (asked.clear >> k & 1 == 1) != is_lit {
                    continue;
                }
                let thing = &self.things[clear as usize];
                let surface = surface_through(clear);
                let is_lit = is_lit || asked.uneven >> k & 1 == 1 && known.is_uneven(surface);
                looks.light[k] = known.light(surface).filter(|_| !is_lit).unwrap_or_else(|| {
                    let d = d.lane(k).normalize();
                    let (light, key) = self.through(thing, self.eye, d, f64::from(t[k]), 0);
                    looks.keys[k] = key;
                    let light = clamped(light);
                    if asked.is_kept || asked.clear != 15 {
                        known.add(surface, light);
                    }
                    light
                });
                looks.glass[k] = thing.id;
                if met.things[k] != NO_THING {
                    looks.ids[k] = self.things[met.things[k] as usize].id;
                }
                done |= 1 << k;
            }
        }
        done
    }

    /// Returns the light of the table's top, marks on it included.
    #[inline(always)]
    fn table_four(&self, at: Four3, marks: &[u32]) -> ([[f32; 3]; 4], [u64; 4]) {
        let light = self.lighting.table_four(at.x, at.y);
        let mut light = light.map(|[r, g, b, _]| [r, g, b]);
        let mut keys = [key_of_table(false); 4];
        if !marks.is_empty() {
            for k in 0..4 {
                let at = at.lane(k);
                if self.mark_at(at.x, at.y, Some(marks)).is_some() {
                    light[k] = clamped(self.lighting.mark(at.x, at.y).cast());
                    keys[k] = key_of_table(true);
                }
            }
        }
        (light, keys)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;
    use crate::twin::render::lens::Lens;
    use crate::twin::render::trace::Candidates;
    use crate::twin::render::{Body, Light, Options, Paint, Shape, View};
    use crate::world::{Camera, Intrinsics, Mark, Table, object};

    /// A table with a box, a cylinder, a capsule, a ball, vessels, and glass over them, most of them turned.
    fn view() -> View {
        let body = |shape, [x, y, z]: [f64; 3], turn: f64, paint| Body {
            name: String::new(),
            shape,
            world_from_body: Isometry3::new(
                Vector3::new(x, y, z),
                Vector3::new(0.3, -0.2, 1.0) * turn,
            ),
            paint,
        };
        let grey = |specular| Paint::opaque([150, 140, 120], specular);
        let cylinder = |radius, length| Shape::Cylinder { radius, length };
        let vessel = |water| Shape::Vessel {
            outside: object::Shape::Cuboid { size: Vector3::new(0.07, 0.08, 0.12) },
            wall: 0.003,
            water,
        };
        View {
            table: Table {
                size: Vector3::new(1.0, 0.8, 0.02),
                centre: [0.5, 0.0],
                colour: [200, 176, 144],
            },
            marks: vec![Mark { x: 0.4, y: 0.1, radius: 0.02 }],
            bodies: vec![
                body(Shape::Cuboid(Vector3::new(0.2, 0.1, 0.15)), [0.5, 0.1, 0.1], 0.7, grey(0.4)),
                body(cylinder(0.06, 0.2), [0.4, -0.1, 0.12], 0.4, grey(0.05)),
                body(
                    Shape::Capsule { radius: 0.04, length: 0.3 },
                    [0.6, -0.1, 0.2],
                    1.4,
                    grey(0.5),
                ),
                body(Shape::Sphere(0.05), [0.7, 0.15, 0.05], 0.0, grey(0.0)),
                body(cylinder(0.1, 0.05), [0.55, 0.0, 0.5], 0.2, Paint::glass()),
                body(vessel(30e-6), [0.75, -0.1, 0.05], 0.1, grey(0.35)),
                body(vessel(0.0), [0.25, 0.2, 0.0], 0.0, grey(0.35)),
                body(vessel(30e-6), [0.85, 0.05, 0.0], 0.0, Paint::glass()),
            ],
            water: Vec::new(),
            particle_radius: 0.004,
            light: Light::default(),
            marker: None,
        }
    }

    #[test]
    fn four_rays_see_what_each_of_them_sees() {
        let mut intrinsics = Intrinsics::centred(300.0, 320, 240);
        (intrinsics.k1, intrinsics.skew) = (-0.15, 0.4);
        for (tangential, shadows) in [(0.0, true), (1e-3, false)] {
            intrinsics.p1 = tangential;
            let camera = Camera::looking(
                intrinsics,
                Vector3::new(1.3, 0.2, 0.7),
                Vector3::new(0.5, 0.0, 0.05),
            );
            let (view, lens) = (view(), Lens::new(&camera));
            let options = Options { shadows, ..Options::default() };
            let stage = Stage::new(&view, options, lens.centre);
            let things: Vec<u32> = (0..9).collect();
            assert!(stage.are_plain(&things));
            let candidates = Candidates { things: &things, marks: &[0] };
            let (mut n, mut apart, mut shaded) = (0, 0, 0);
            for v in (0..240).step_by(3) {
                for u in (0..320).step_by(4) {
                    let beside = [[0.0, 1.0, 2.0, 3.0], [0.25; 4]].map(f32x4::from);
                    let (d, length) = lens.four_rays((u, v), beside);
                    let met = stage.see_four(d, &things);
                    let four = stage.look_four(d, met, &[0], Asked::ALL, &mut Known::default());
                    for k in 0..4 {
                        let ray = lens.direction((u + k) as f64, v as f64 + 0.25);
                        assert!((f64::from(length.to_array()[k]) - ray.norm()).abs() < 1e-6);
                        let one = stage.look(lens.centre, ray.normalize(), Some(candidates), 0);
                        n += 1;
                        shaded += usize::from(one.id > TABLE);
                        // On an outline the last digit says which side a ray is on.
                        if one.id != four.ids[k] || one.key != four.keys[k] {
                            apart += 1;
                            continue;
                        }
                        if one.id != NOTHING {
                            let off = (one.distance - f64::from(four.distances[k])).abs();
                            assert!(off < 2e-5, "{u} {v} {k}: {off}");
                        }
                        let light = one.light.cast::<f32>() - Vector3::from(four.light[k]);
                        if light.amax() < 2e-3 {
                            continue;
                        }
                        assert_ne!(four.glass[k], NOTHING, "{u} {v} {k}: {light}");
                        // By a glass's edge a ray sees another thing than one a hundred thousandth of a pixel beside it does.
                        let beside = lens.direction((u + k) as f64, v as f64 + 0.25 + 1e-5);
                        let beside =
                            stage.look(lens.centre, beside.normalize(), Some(candidates), 0);
                        let turns = 4.0 * (beside.light - one.light).amax() as f32;
                        assert!(light.amax() < turns, "{u} {v} {k}: {light}");
                        apart += 1;
                    }
                }
            }
            assert!(apart * 1000 < n, "{apart} of {n}");
            assert!(shaded * 10 > n, "{shaded} of {n}");
        }
    }
}
