//! What one ray sees: the nearest surface and its light. What is transparent is `super::glass`'s.

#![expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]

use nalgebra::Vector3;

use super::known::{surface_of, surface_through};
use super::light::{Lighting, Rgb};
use super::options::Options;
use super::rays::{Balls, Casters, Plain};
use super::scene::{self, Hit, Kind, Thing};
use super::span::TOP;
use super::vectors::Four3;
use super::view::{NOTHING, TABLE, View};
use crate::world::{Mark, Table};

/// How many transparent things in a row a ray is followed through.
const MOST_BOUNCES: u8 = 3;

/// Of so many things that can cast a shadow it is asked which do so near a place: most of them do not.
pub(super) const FEW: usize = 24;

/// A view ready to be looked at. The table is the first of its things.
pub(super) struct Stage<'a> {
    pub(super) things: Vec<Thing>,
    pub(super) lighting: Lighting,
    pub(super) marks: &'a [Mark],
    pub(super) table: Table,
    /// The things that can be met four rays at a time.
    pub(super) plain: Vec<Option<Plain>>,
    /// The balls around its things.
    balls: Balls,
    /// From where it is looked at.
    pub(super) eye: Vector3<f64>,
    /// For each thing those that can cast a shadow on it.
    casters: Vec<Vec<u32>>,
    /// The balls around those.
    caster_balls: Vec<Casters>,
}

/// What can be met in a part of the picture; see [`super::tile`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidates<'t> {
    pub(super) things: &'t [u32],
    pub(super) marks: &'t [u32],
}

/// What a ray meets first.
pub(super) struct Seen<'a> {
    /// What is opaque.
    solid: Option<(Hit, usize)>,
    /// What is transparent in front of it: how far, and which thing.
    clear: Option<(f64, usize)>,
    /// The printed mark it is, when the opaque thing is the table.
    mark: Option<&'a Mark>,
}

impl Seen<'_> {
    /// Returns whether something transparent is in front.
    pub(super) fn is_clear(&self) -> bool {
        self.clear.is_some()
    }

    /// Returns a number that two rays share when they see the same surface.
    pub(super) fn surface(&self) -> u64 {
        match (self.clear, &self.solid) {
            (Some((_, index)), _) => surface_through(index as u32),
            (None, Some((hit, index))) => {
                surface_of(*index as u32, hit.face, hit.wet, self.mark.is_some())
            }
            (None, None) => 0,
        }
    }
}

/// What one ray sees.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    /// Linear light.
    pub(super) light: Rgb,
    /// Differs where two neighbours must not be taken for one smooth surface.
    pub(super) key: u64,
    /// Distance along the ray to what is opaque, m; infinite when nothing.
    pub(super) distance: f64,
    /// What is opaque there.
    pub(super) id: u16,
    /// What transparent thing is in front of it.
    pub(super) glass: u16,
}

impl<'a> Stage<'a> {
    /// Makes a view ready to be looked at from `eye`.
    pub(super) fn new(view: &'a View, options: Options, eye: Vector3<f64>) -> Self {
        let things = scene::things(view);
        let lighting = Lighting::new(view, &things, options, eye);
        let casters: Vec<Vec<u32>> =
            (0..things.len()).map(|k| lighting.casters(&things, k)).collect();
        let caster_balls = casters.iter().map(|told| Casters::new(&things, told)).collect();
        let plain = things.iter().map(|thing| Plain::new(thing, eye, &lighting)).collect();
        let (table, balls) = (view.table, Balls::new(&things));
        let marks = &view.marks;
        Self { things, lighting, marks, table, plain, balls, eye, casters, caster_balls }
    }

    /// Looks from `o` along `d` (unit). `candidates` are the things that can be met; `None` means any.
    pub(super) fn look(
        &self,
        o: Vector3<f64>,
        d: Vector3<f64>,
        candidates: Option<Candidates<'_>>,
        bounce: u8,
    ) -> Sample {
        self.develop(&self.see(o, d, candidates, bounce), o, d, bounce)
    }

    /// Returns what a ray from `o` along `d` (unit) meets.
    #[inline]
    pub(super) fn see(
        &self,
        o: Vector3<f64>,
        d: Vector3<f64>,
        candidates: Option<Candidates<'_>>,
        bounce: u8,
    ) -> Seen<'_> {
        let mut solid: Option<(Hit, usize)> = None;
        let mut clear: Option<(f64, usize)> = None;
        let mut consider = |index: usize| {
            let thing = &self.things[index];
            let nearest = solid.map_or(f64::INFINITY, |(best, _)| best.t);
            let hit = if index == 0 {
                self.meet_table(o, d)
            } else if !thing.near(o, d, nearest) {
                return;
            } else if thing.paint.transparent {
                if let Some(t) = thing.entry(o, d)
                    && clear.is_none_or(|(best, _)| t < best)
                {
                    clear = Some((t, index));
                }
                return;
            } else {
                thing.hit(o, d, 1e-6, nearest)
            };
            if let Some(hit) = hit
                && solid.is_none_or(|(best, _)| hit.t < best.t)
            {
                solid = Some((hit, index));
            }
        };
        match candidates {
            Some(list) => list.things.iter().for_each(|&index| consider(index as usize)),
            None => self.balls.ahead(o, d, &mut consider),
        }
        let distance = solid.map_or(f64::INFINITY, |(hit, _)| hit.t);
        let mark =
            solid.filter(|(hit, index)| *index == 0 && hit.face == TOP).and_then(|(hit, _)| {
                let at = o + d * hit.t;
                self.mark_at(at.x, at.y, candidates.map(|list| list.marks))
            });
        Seen { solid, clear: clear.filter(|&(t, _)| t < distance && bounce < MOST_BOUNCES), mark }
    }

    /// Returns what is opaque of what was seen.
    pub(super) fn id(&self, seen: &Seen<'_>) -> u16 {
        seen.solid.map_or(NOTHING, |(_, index)| self.things[index].id)
    }

    /// Returns the mark at a place of the table, among those listed or any.
    #[inline]
    pub(super) fn mark_at(&self, x: f64, y: f64, listed: Option<&[u32]>) -> Option<&Mark> {
        let on = |mark: &&Mark| {
            let (x, y) = (x - mark.x, y - mark.y);
            x * x + y * y < mark.radius * mark.radius
        };
        match listed {
            Some(list) => list.iter().map(|&k| &self.marks[k as usize]).find(on),
            None => self.marks.iter().find(on),
        }
    }

    /// Returns where a ray meets the table: nearly always its top, which is quickly told.
    #[inline]
    fn meet_table(&self, o: Vector3<f64>, d: Vector3<f64>) -> Option<Hit> {
        if o.z > 1e-6 {
            if d.z >= 0.0 {
                return None;
            }
            let t = -o.z / d.z;
            if self.table.holds(o.x + d.x * t, o.y + d.y * t, 0.0) {
                return Some(Hit { t, normal: Vector3::z(), face: TOP, depth: 0.0, wet: false });
            }
        }
        self.things[0].hit(o, d, 1e-6, f64::INFINITY)
    }

    /// Returns the light of what a ray from `o` along `d` met.
    pub(super) fn develop(
        &self,
        seen: &Seen<'_>,
        o: Vector3<f64>,
        d: Vector3<f64>,
        bounce: u8,
    ) -> Sample {
        let id = self.id(seen);
        let distance = seen.solid.map_or(f64::INFINITY, |(hit, _)| hit.t);
        let mut sample =
            Sample { light: Rgb::zeros(), key: u64::from(id), distance, id, glass: NOTHING };
        if let Some((t, index)) = seen.clear {
            let thing = &self.things[index];
            sample.glass = thing.id;
            (sample.light, sample.key) = self.through(thing, o, d, t, bounce);
            return sample;
        }
        match seen.solid {
            None => sample.light = self.lighting.room(o, d),
            Some((hit, index)) => {
                let (light, key) = self.shade(index, &hit, seen.mark.is_some(), o, d);
                sample.light = light;
                sample.key = mix(sample.key, key);
            }
        }
        sample
    }

    /// Returns the light of an opaque surface, and a key that changes at its inner edges.
    fn shade(
        &self,
        index: usize,
        hit: &Hit,
        on_mark: bool,
        o: Vector3<f64>,
        d: Vector3<f64>,
    ) -> (Rgb, u64) {
        let thing = &self.things[index];
        let at = o + d * hit.t;
        if thing.id == TABLE && hit.face == TOP {
            let light = if on_mark {
                self.lighting.mark(at.x, at.y)
            } else {
                self.lighting.table_top(at.x, at.y)
            };
            return (light.cast(), table_key(on_mark));
        }
        if hit.wet
            && let Kind::Vessel(hollow) = &thing.kind
            && let Some(seen) = self.under_water(thing, hollow, o, d)
        {
            return (seen, 66 + u64::from(hit.face));
        }
        let (lit, key) = self.lit(index, hit, at);
        let open = 1.0 - 0.6 * hit.depth;
        // Close above the table less of the room is seen.
        let open = open * (1.0 - 0.25 * (-at.z.max(0.0) / 0.02).exp());
        let gloss = thing.paint.specular;
        let mut light = self.lighting.surface(thing.albedo, gloss, hit.normal, d, lit, open);
        if gloss > 0.1 {
            let cos = -hit.normal.dot(&d).min(0.0);
            let back = d + hit.normal * (2.0 * cos);
            // Schlick's form of Fresnel's equations for a lacquer.
            let part = (0.04 + 0.96 * (1.0 - cos).powi(5)) * gloss * open;
            light += self.lighting.sheen(back) * part;
        }
        (light, u64::from(hit.face) * 8 + key)
    }

    /// Returns what may cast a shadow on a part of a thing: of what can on any, those that `may`, kept in `near` where they are few.
    #[inline]
    pub(super) fn casters<'c>(
        &'c self,
        index: usize,
        near: &'c mut [u32; FEW],
        may: impl Fn(u32) -> bool,
    ) -> &'c [u32] {
        let beside = &self.casters[index];
        if beside.len() > FEW {
            return beside;
        }
        let mut n = 0;
        for &caster in beside {
            if may(caster) {
                near[n] = caster;
                n += 1;
            }
        }
        &near[..n]
    }

    /// As [`Self::casters`], of places within a distance of one, for those that stand between them and the lamp or nearly so.
    #[inline(always)]
    pub(super) fn casters_about<'c>(
        &'c self,
        index: usize,
        near: &'c mut [u32; FEW],
        (from, around): (Vector3<f32>, f32),
        (towards, sine): (Four3, f32),
        may: impl Fn(u32) -> bool,
    ) -> &'c [u32] {
        let beside = &self.casters[index];
        if beside.len() > FEW {
            return beside;
        }
        let mut n = 0;
        self.caster_balls[index].between(
            (from, around),
            (towards, sine),
            #[inline(always)]
            |k| {
                if may(beside[k]) {
                    near[n] = beside[k];
                    n += 1;
                }
            },
        );
        &near[..n]
    }

    /// Returns the part of the lamp a place on a body sees, and a key that changes with it.
    fn lit(&self, index: usize, hit: &Hit, at: Vector3<f64>) -> (f64, u64) {
        let own = &self.things[index];
        if hit.normal.dot(&self.lighting.towards()) <= 0.0 {
            return (0.0, 0);
        }
        let from = at + hit.normal * 1e-4;
        let samples = self.lighting.samples();
        if samples.is_empty() {
            return (1.0, 0);
        }
        let mut near = [0; FEW];
        let casters = self.casters(index, &mut near, |caster| {
            self.things[caster as usize].in_beam(
                from,
                self.lighting.towards(),
                self.lighting.sine(),
            )
        });
        let mut seen = 0.0;
        for &to in samples {
            let mut left: f64 = 1.0;
            if hit.depth > 0.0
                && let Kind::Vessel(hollow) = &own.kind
            {
                let (lo, ld) = own.inward(from, to);
                let out = hollow.cavity.span(lo, ld);
                if out.is_none_or(|span| span.leave_face != TOP) {
                    continue;
                }
            }
            for &caster in casters {
                let thing = &self.things[caster as usize];
                if thing.near(from, to, f64::INFINITY) && thing.blocks(from, to) {
                    left = left.min(if thing.paint.transparent { 0.7 } else { 0.0 });
                    if left <= 0.0 {
                        break;
                    }
                }
            }
            seen += left;
        }
        (seen / samples.len() as f64, (2.0 * seen) as u64)
    }
}

/// The key of the table's top, and of a mark on it.
#[inline]
fn table_key(on_mark: bool) -> u64 {
    if on_mark { 64 } else { 65 }
}

/// The key of a look at the table's top.
#[inline]
pub(super) fn key_of_table(on_mark: bool) -> u64 {
    mix(u64::from(TABLE), table_key(on_mark))
}

/// Folds a number into a key (FNV-1a's step).
#[inline]
pub(super) fn mix(key: u64, with: u64) -> u64 {
    (key ^ with).wrapping_mul(0x0100_0000_01B3).rotate_left(23)
}
