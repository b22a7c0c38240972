//! What one ray sees: the nearest surface, its light, and through glass and water what is behind them.
//!
//! Glass is not painted on: a ray is bent at every wall by Snell's law, loses the part Fresnel's equations
//! say is mirrored, and is tinted along its way (Beer and Lambert). So a jar shows what real ones show: a
//! displaced background, dark and bright edges, a highlight, and little else.

use nalgebra::Vector3;

use super::light::{Lighting, Rgb};
use super::scene::{self, Hit, Hollow, Kind, Thing};
use super::solid::{Solid, TOP};
use super::view::{NOTHING, TABLE, View};
use crate::world::{Mark, Table};

/// Index of refraction of soda-lime glass, and of water.
const N_GLASS: f64 = 1.52;
const N_WATER: f64 = 1.333;
/// Absorption per m of slightly green glass, and of water made a little bluer than it is, so that the eye
/// finds it as it does in a real room by cues this renderer lacks.
const TINT_GLASS: [f64; 3] = [4.5, 1.6, 2.8];
const TINT_WATER: [f64; 3] = [4.0, 1.3, 0.7];
/// How many surfaces of one vessel a ray is followed through.
const MOST_SURFACES: usize = 14;
/// How many transparent things in a row a ray is followed through.
const MOST_BOUNCES: u8 = 3;

/// A view ready to be looked at. The table is the first of its things.
pub(super) struct Stage<'a> {
    pub(super) things: Vec<Thing>,
    pub(super) lighting: Lighting,
    pub(super) marks: &'a [Mark],
    table: Table,
    /// For each thing those that can cast a shadow on it.
    casters: Vec<Vec<u32>>,
}

/// What can be met in a part of the picture; see [`super::tile`].
#[derive(Debug, Clone, Default)]
pub(super) struct Candidates {
    pub(super) things: Vec<u32>,
    pub(super) marks: Vec<u32>,
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
            (Some((_, index)), _) => 1 << 32 | index as u64,
            (None, Some((hit, index))) => {
                let extra = u64::from(hit.face) << 2 | u64::from(hit.wet) << 1;
                2 << 32 | (*index as u64) << 10 | extra | u64::from(self.mark.is_some())
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

impl Sample {
    /// Returns what a ray sees that meets nothing but the room.
    pub(super) fn room(light: Rgb) -> Self {
        Self { light, key: 0, distance: f64::INFINITY, id: NOTHING, glass: NOTHING }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Medium {
    Air,
    Glass,
    Water,
}

impl Medium {
    fn index(self) -> f64 {
        match self {
            Self::Air => 1.0,
            Self::Glass => N_GLASS,
            Self::Water => N_WATER,
        }
    }

    fn pass(self, length: f64) -> Rgb {
        let tint = match self {
            Self::Air => return Vector3::repeat(1.0),
            Self::Glass => TINT_GLASS,
            Self::Water => TINT_WATER,
        };
        // Single precision is quick, and far finer than the tint is known.
        Vector3::from(tint.map(|a| f64::from(((-a * length) as f32).exp())))
    }
}

impl<'a> Stage<'a> {
    /// Makes a view ready to be looked at from `eye`.
    pub(super) fn new(view: &'a View, shadows: bool, eye: Vector3<f64>) -> Self {
        let things = scene::things(view);
        let lighting = Lighting::new(view, &things, shadows, eye);
        let casters = (0..things.len()).map(|k| lighting.casters(&things, k)).collect();
        Self { things, lighting, marks: &view.marks, table: view.table, casters }
    }

    /// Looks from `o` along `d` (unit). `candidates` are the things that can be met; `None` means any.
    pub(super) fn look(
        &self,
        o: Vector3<f64>,
        d: Vector3<f64>,
        candidates: Option<&Candidates>,
        bounce: u8,
    ) -> Sample {
        self.develop(&self.see(o, d, candidates, bounce), o, d, bounce)
    }

    /// Returns what a ray from `o` along `d` (unit) meets.
    pub(super) fn see(
        &self,
        o: Vector3<f64>,
        d: Vector3<f64>,
        candidates: Option<&Candidates>,
        bounce: u8,
    ) -> Seen<'_> {
        let mut solid: Option<(Hit, usize)> = None;
        let mut clear: Option<(f64, usize)> = None;
        let mut consider = |index: usize| {
            let thing = &self.things[index];
            let hit = if index == 0 {
                self.meet_table(o, d)
            } else if !thing.near(o, d) {
                return;
            } else if thing.paint.transparent {
                if let Some(t) = entry(thing, o, d)
                    && clear.is_none_or(|(best, _)| t < best)
                {
                    clear = Some((t, index));
                }
                return;
            } else {
                thing.hit(o, d, 1e-6)
            };
            if let Some(hit) = hit
                && solid.is_none_or(|(best, _)| hit.t < best.t)
            {
                solid = Some((hit, index));
            }
        };
        match candidates {
            Some(list) => list.things.iter().for_each(|&index| consider(index as usize)),
            None => (0..self.things.len()).for_each(&mut consider),
        }
        let distance = solid.map_or(f64::INFINITY, |(hit, _)| hit.t);
        let mark =
            solid.filter(|(hit, index)| *index == 0 && hit.face == TOP).and_then(|(hit, _)| {
                let at = o + d * hit.t;
                self.mark_at(at.x, at.y, candidates.map(|list| list.marks.as_slice()))
            });
        Seen { solid, clear: clear.filter(|&(t, _)| t < distance && bounce < MOST_BOUNCES), mark }
    }

    /// Returns the mark at a place of the table, among those listed or any.
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
        self.things[0].hit(o, d, 1e-6)
    }

    /// Looks along `d` (any length) where only room and table can be seen; distances are in lengths of `d`.
    pub(super) fn look_at_table(&self, o: Vector3<f64>, d: Vector3<f64>, marks: &[u32]) -> Sample {
        if o.z > 1e-6 && d.z < 0.0 {
            let t = -o.z / d.z;
            let (x, y) = (o.x + d.x * t, o.y + d.y * t);
            if self.table.holds(x, y, 0.0) {
                let on = self.mark_at(x, y, Some(marks)).is_some();
                let light =
                    if on { self.lighting.mark(x, y) } else { self.lighting.table_top(x, y) };
                let key = mix(u64::from(TABLE), table_key(on));
                return Sample { light: light.cast(), key, distance: t, id: TABLE, glass: NOTHING };
            }
        }
        let length = d.norm();
        let only = Candidates { things: vec![0], marks: marks.to_vec() };
        let sample = self.look(o, d / length, Some(&only), 0);
        Sample { distance: sample.distance / length, ..sample }
    }

    /// Returns the light of what a ray from `o` along `d` met.
    pub(super) fn develop(
        &self,
        seen: &Seen<'_>,
        o: Vector3<f64>,
        d: Vector3<f64>,
        bounce: u8,
    ) -> Sample {
        let id = seen.solid.map_or(NOTHING, |(_, index)| self.things[index].id);
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
            for &caster in &self.casters[index] {
                let thing = &self.things[caster as usize];
                if thing.near(from, to) && thing.blocks(from, to) {
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

    /// Returns what is seen in the water of an opaque vessel, or `None` when the ray misses the water.
    fn under_water(
        &self,
        thing: &Thing,
        hollow: &Hollow,
        o: Vector3<f64>,
        d: Vector3<f64>,
    ) -> Option<Rgb> {
        let (up, height) = hollow.level?;
        let (lo, ld) = thing.inward(o, d);
        let t = (height - up.dot(&lo)) / up.dot(&ld);
        let at = lo + ld * t;
        if !(t > 0.0 && up.dot(&ld) < 0.0 && hollow.cavity.holds(at)) {
            return None;
        }
        let (mirrored, bent) = split(ld, up, 1.0, N_WATER);
        let down = bent?;
        let span = hollow.cavity.span(at, down)?;
        let wall = at + down * span.leave;
        let depth = 1.0 - wall.z.max(0.0) / hollow.rim;
        let normal = -thing.outward(hollow.cavity.normal(span.leave_face, wall));
        let open = 0.9 - 0.5 * depth;
        let floor = self.lighting.surface(thing.albedo, 0.0, normal, d, 0.35, open);
        let around = self.lighting.mirrored(thing.outward(ld - up * (2.0 * up.dot(&ld))));
        Some(
            floor.component_mul(&Medium::Water.pass(span.leave)) * (1.0 - mirrored)
                + around * mirrored,
        )
    }

    /// Follows a ray through a transparent thing that it enters at `t`, and beyond.
    fn through(
        &self,
        thing: &Thing,
        o: Vector3<f64>,
        d: Vector3<f64>,
        t: f64,
        bounce: u8,
    ) -> (Rgb, u64) {
        let (mut at, mut way) = thing.inward(o + d * (t - 1e-5), d);
        let mut medium = Medium::Air;
        let mut light = Rgb::zeros();
        let mut left = Vector3::repeat(1.0);
        let mut key = u64::from(thing.id);
        for _ in 0..MOST_SURFACES {
            let Some(step) = next_surface(&thing.kind, at, way, medium) else { break };
            left.component_mul_assign(&medium.pass(step.length));
            at += way * step.length;
            key = mix(key, u64::from(step.code));
            let facing = |n: Vector3<f64>| if n.dot(&way) > 0.0 { -n } else { n };
            let mut normal = facing(step.normal);
            if step.code < 16 {
                let soft = facing(rounded(&thing.kind, step.normal, at));
                // Seen almost along the wall the rounding would turn the surface inside out.
                if soft.dot(&normal) > 0.0 {
                    normal = soft;
                }
            }
            let (mirrored, bent) = split(way, normal, medium.index(), step.beyond.index());
            let back = way - normal * (2.0 * normal.dot(&way));
            if let Some(bent) = bent {
                // The mirrored part is not followed further: what the room looks like there will do.
                let around = self.lighting.mirrored(thing.outward(back));
                light += left.component_mul(&around) * mirrored;
                left *= 1.0 - mirrored;
                way = bent;
                medium = step.beyond;
            } else {
                way = back;
                key = mix(key, 77);
            }
            if left.max() < 0.01 {
                return (light, key);
            }
        }
        if medium != Medium::Air {
            // Caught inside by total reflection; what comes out has been mixed well.
            light += left.component_mul(&self.lighting.mirrored(Vector3::z())) * 0.4;
            return (light, mix(key, 78));
        }
        // A hair back, so that what the thing stands on is not missed where the two touch.
        let from = thing.back(at - way * 1e-4);
        let beyond = self.look(from, thing.outward(way), None, bounce + 1);
        (light + left.component_mul(&beyond.light), mix(key, beyond.key))
    }
}

/// The way to the next change of medium.
struct Step {
    length: f64,
    normal: Vector3<f64>,
    beyond: Medium,
    code: u8,
}

/// Returns the next surface along a ray inside or near a transparent thing, in its own frame, or `None`
/// when the ray leaves it for good.
fn next_surface(kind: &Kind, o: Vector3<f64>, d: Vector3<f64>, now: Medium) -> Option<Step> {
    /// Nearer than this is the surface just crossed, m.
    const NEAR: f64 = 1e-7;
    let (outer, cavity, level): (&Solid, Option<&Solid>, _) = match kind {
        Kind::Solid(solid) => (solid, None, None),
        Kind::Vessel(hollow) => (&hollow.outer, Some(&hollow.cavity), hollow.level),
        Kind::Triangle { .. } => return None,
    };
    let body = outer.span(o, d)?;
    let hollow = cavity.and_then(|cavity| cavity.span(o, d).map(|span| (cavity, span)));
    let medium = |t: f64| {
        if t <= body.enter || t >= body.leave {
            return Medium::Air;
        }
        match (&hollow, cavity) {
            (_, None) => Medium::Water,
            (Some((_, span)), _) if t > span.enter && t < span.leave => {
                let under = level.is_some_and(|(up, height)| up.dot(&(o + d * t)) < height);
                if under { Medium::Water } else { Medium::Air }
            }
            _ => Medium::Glass,
        }
    };
    let far = f64::INFINITY;
    let mut ends = [(far, 0_u8); 5];
    ends[0] = (body.enter, body.enter_face);
    ends[1] = (body.leave, body.leave_face);
    if let Some((_, span)) = hollow {
        ends[2] = (span.enter, 16 + span.enter_face);
        ends[3] = (span.leave, 16 + span.leave_face);
    }
    if let Some((up, height)) = level
        && up.dot(&d).abs() > 1e-9
    {
        ends[4] = ((height - up.dot(&o)) / up.dot(&d), 32);
    }
    // Insertion: a general sort takes longer to begin than five numbers take to order.
    for k in 1..ends.len() {
        let mut at = k;
        while at > 0 && ends[at].0 < ends[at - 1].0 {
            ends.swap(at, at - 1);
            at -= 1;
        }
    }
    for (k, &(t, code)) in ends.iter().enumerate() {
        if t <= NEAR || t >= far {
            continue;
        }
        let after = ends.get(k + 1).map_or(far, |next| next.0);
        let beyond = medium(if after < far { f64::midpoint(t, after) } else { t + 1e-3 });
        if beyond == now {
            continue;
        }
        let at = o + d * t;
        let normal = match (code, level, hollow) {
            (32, Some((up, _)), _) => up,
            (16.., _, Some((cavity, _))) => cavity.normal(code - 16, at),
            _ => outer.normal(code, at),
        };
        return Some(Step { length: t, normal, beyond, code });
    }
    None
}

/// Returns where a ray enters the hull of a transparent thing ahead of it.
fn entry(thing: &Thing, o: Vector3<f64>, d: Vector3<f64>) -> Option<f64> {
    let (lo, ld) = thing.inward(o, d);
    let solid = match &thing.kind {
        Kind::Solid(solid) => solid,
        Kind::Vessel(hollow) => &hollow.outer,
        Kind::Triangle { .. } => return None,
    };
    solid.span(lo, ld).map(|span| span.enter).filter(|&t| t > 1e-6)
}

/// Returns the normal of a box's outside near its edges as if they were ground round, as glass edges are;
/// it is what gives them their bright and dark lines.
fn rounded(kind: &Kind, normal: Vector3<f64>, at: Vector3<f64>) -> Vector3<f64> {
    /// Radius of a ground edge, m. Chosen: pressed jars have 1 to 3 mm.
    const ROUND: f64 = 0.002;
    let Kind::Vessel(hollow) = kind else { return normal };
    let Solid::Cuboid { centre, half } = hollow.outer else { return normal };
    let off = at - centre;
    let mut soft = normal;
    for axis in 0..3 {
        let left = half[axis] - off[axis].abs();
        if normal[axis].abs() < 0.5 && left < ROUND {
            soft[axis] += off[axis].signum() * (1.0 - left.max(0.0) / ROUND);
        }
    }
    soft.normalize()
}

/// Fresnel and Snell at a smooth surface: the part of unpolarised light that is mirrored, and the bent
/// direction unless all of it is. `normal` faces against `way`; both are of length 1.
fn split(way: Vector3<f64>, normal: Vector3<f64>, n1: f64, n2: f64) -> (f64, Option<Vector3<f64>>) {
    let ratio = n1 / n2;
    let cos1 = -normal.dot(&way);
    let left = 1.0 - ratio * ratio * (1.0 - cos1 * cos1);
    if left <= 0.0 {
        return (1.0, None);
    }
    let cos2 = left.sqrt();
    let s = (n1 * cos1 - n2 * cos2) / (n1 * cos1 + n2 * cos2);
    let p = (n1 * cos2 - n2 * cos1) / (n1 * cos2 + n2 * cos1);
    let bent = way * ratio + normal * (ratio * cos1 - cos2);
    (f64::midpoint(s * s, p * p), Some(bent.normalize()))
}

/// The key of the table's top, and of a mark on it.
fn table_key(on_mark: bool) -> u64 {
    if on_mark { 64 } else { 65 }
}

/// Folds a number into a key (FNV-1a's step).
fn mix(key: u64, with: u64) -> u64 {
    (key ^ with).wrapping_mul(0x0100_0000_01B3).rotate_left(23)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glass_mirrors_and_bends_as_the_textbook_says() {
        let down = -Vector3::z();
        let (mirrored, bent) = split(down, Vector3::z(), 1.0, 1.5);
        assert!((mirrored - 0.04).abs() < 1e-12, "((n-1)/(n+1))² at a right angle");
        assert!((bent.unwrap() - down).norm() < 1e-12);
        let slant = Vector3::new(0.6, 0.0, -0.8);
        let (_, bent) = split(slant, Vector3::z(), 1.0, 1.333);
        assert!((bent.unwrap().x - 0.6 / 1.333).abs() < 1e-12, "Snell");
        // Brewster's angle: the part mirrored is half of the s-polarised one.
        let brewster = 1.5_f64.atan();
        let way = Vector3::new(brewster.sin(), 0.0, -brewster.cos());
        let (mirrored, _) = split(way, Vector3::z(), 1.0, 1.5);
        let s = ((1.0 - 2.25) / (1.0 + 2.25_f64)).powi(2);
        assert!((mirrored - s / 2.0).abs() < 1e-12);
        let (all, none) = split(Vector3::new(0.9, 0.0, -(0.19_f64.sqrt())), Vector3::z(), 1.5, 1.0);
        assert!((all - 1.0).abs() < 1e-12 && none.is_none(), "total reflection");
    }

    #[test]
    fn a_ray_through_a_thin_window_comes_out_parallel() {
        let pane = Hollow {
            outer: Solid::Cuboid { centre: Vector3::zeros(), half: Vector3::new(0.5, 0.5, 0.5) },
            cavity: Solid::Cuboid {
                centre: Vector3::zeros(),
                half: Vector3::new(0.49, 0.49, 0.49),
            },
            rim: 0.5,
            level: None,
        };
        let kind = Kind::Vessel(pane);
        let start = Vector3::new(0.3, 0.2, -1.0).normalize();
        let (mut at, mut way) = (Vector3::new(-0.1, 0.0, 0.6), start);
        let mut medium = Medium::Air;
        let mut media = vec![medium];
        while let Some(step) = next_surface(&kind, at, way, medium) {
            at += way * step.length;
            let normal = if step.normal.dot(&way) > 0.0 { -step.normal } else { step.normal };
            way = split(way, normal, medium.index(), step.beyond.index()).1.unwrap();
            medium = step.beyond;
            media.push(medium);
            assert!(media.len() < 9);
        }
        let (air, glass) = (Medium::Air, Medium::Glass);
        assert_eq!(media, [air, glass, air, glass, air]);
        assert!((way - start).norm() < 1e-12);
    }
}
