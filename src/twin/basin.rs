//! How liquid stands in a vessel at any tilt: where its surface is, and where its weight.
//!
//! The inside is cut into upright columns, each measured exactly; the surface is a plane at right angles to an `up`
//! that need not be the vessel's axis. Everything is in the vessel's frame, m. How it leaves is [`super::hold`]'s.

use nalgebra::Vector3;
use wide::f64x4;

use crate::world::Shape;

/// Columns across. The level in a leaning box is right within 0.1 mm of geometry with 16, 24 or 32 of them; a round
/// inside has its area to 1 % before it is scaled to it.
const ACROSS: usize = 24;
/// A vessel that lies closer to level than this (its axis' part along `up`) is taken as lying so: a column would be
/// cut nowhere.
const LEVEL: f64 = 1e-3;
/// Steps to find the height of the surface: bisection alone would come within 1e-8 of the vessel's size.
const STEPS: usize = 27;

/// The inside of a vessel.
#[derive(Debug, Clone)]
pub struct Basin {
    columns: Vec<Four>,
    /// Feet of the columns at the ends of the rows, m: one of them is the farthest along any direction.
    ends: Vec<[f64; 2]>,
    /// What each column has of the inside's area, m².
    column: f64,
    floor: f64,
    rim: f64,
    /// What the feet add up to, where all columns are as high.
    feet: Option<Feet>,
}

/// How many feet there are, and what their places and the products of those add up to, m and m².
#[derive(Debug, Clone, Copy)]
struct Feet {
    n: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Feet {
    fn of(feet: &[[f64; 2]]) -> Self {
        let sum = |of: fn(f64, f64) -> f64| feet.iter().map(|&[x, y]| of(x, y)).sum();
        Self {
            n: feet.len() as f64,
            x: sum(|x, _| x),
            y: sum(|_, y| y),
            xx: sum(|x, _| x * x),
            xy: sum(|x, y| x * y),
            yy: sum(|_, y| y * y),
        }
    }
}

/// Four columns, worked out at once.
#[derive(Debug, Clone, Copy)]
struct Four {
    /// Their feet, m.
    x: f64x4,
    y: f64x4,
    /// From where to where each is inside, m.
    floor: f64x4,
    rim: f64x4,
}

impl Four {
    fn new(feet: &[[f64; 2]], room: &[[f64; 2]]) -> Self {
        // What is left over of the last four is nowhere inside.
        let all = |of: &[[f64; 2]], k: usize| {
            let each: [f64; 4] = std::array::from_fn(|i| of.get(i).map_or(0.0, |it| it[k]));
            f64x4::from(each)
        };
        Self { x: all(feet, 0), y: all(feet, 1), floor: all(room, 0), rim: all(room, 1) }
    }

    /// Returns from where to where they are wet when the surface is at a height.
    #[inline]
    fn wet(&self, level: &Level, height: f64) -> [f64x4; 2] {
        let reach = level.x * self.x + level.y * self.y;
        let cut = (f64x4::splat(height) - reach) * level.per_z;
        let cut = cut.fast_max(self.floor).fast_min(self.rim);
        if level.is_upright { [self.floor, cut] } else { [cut, self.rim] }
    }
}

/// How a surface lies: up's parts, and one by that along the axis.
struct Level {
    x: f64x4,
    y: f64x4,
    per_z: f64x4,
    is_upright: bool,
}

/// How so much liquid stands in a basin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stand {
    /// How far along `up` the surface is, m.
    pub height: f64,
    /// Its centre of mass, m; on the floor where there is nothing.
    pub centre: Vector3<f64>,
}

impl Basin {
    /// Cuts the inside of a vessel with that outside into columns; wall and floor are `wall` m thick.
    pub fn new(outside: &Shape, wall: f64) -> Self {
        let inside = |half: f64| half - wall;
        let rim = outside.height();
        let (x, y, area, round) = match (outside, outside.faces()) {
            (_, Some([x, y])) => {
                let (x, y) = (inside(0.5 * x), inside(0.5 * y));
                (x, y, 4.0 * x * y, false)
            }
            (Shape::Lathe { profile }, _) => {
                let r = inside(profile.widest());
                (r, r, std::f64::consts::PI * r * r, true)
            }
            (_, None) => {
                let r = inside(outside.inner_radius());
                (r, r, std::f64::consts::PI * r * r, true)
            }
        };
        let place = |k: usize| 2.0 * (k as f64 + 0.5) / ACROSS as f64 - 1.0;
        let feet: Vec<[f64; 2]> = (0..ACROSS * ACROSS)
            .map(|k| [place(k % ACROSS), place(k / ACROSS)])
            .filter(|[a, b]| !round || a * a + b * b <= 1.0)
            .map(|[a, b]| [a * x, b * y])
            .collect();
        let mut column = area / feet.len() as f64;
        let mut room = vec![[wall, rim]; feet.len()];
        if let Shape::Lathe { profile } = outside
            && let Some(hollow) = profile.inside(wall)
        {
            for (room, foot) in room.iter_mut().zip(&feet) {
                let heights = hollow.heights_at(foot[0].hypot(foot[1]));
                *room = heights.map_or([rim, rim], |heights| heights.map(|z| z + wall));
            }
            let lengths: f64 = room.iter().map(|[from, to]| to - from).sum();
            column = hollow.volume() / lengths;
        }
        let columns = feet.chunks(4).zip(room.chunks(4)).map(|(feet, room)| Four::new(feet, room));
        let columns = columns.collect();
        let rows = feet.chunk_by(|[_, a], [_, b]| a.total_cmp(b).is_eq());
        let ends = rows.flat_map(|row| [row.first(), row.last()]).flatten().copied().collect();
        let is_straight = !matches!(outside, Shape::Lathe { .. });
        let feet = is_straight.then(|| Feet::of(&feet));
        Self { columns, ends, column, floor: wall, rim, feet }
    }

    /// Returns how `volume` m³ stand when `up` (unit) is up. More than it holds fills it.
    pub fn stand(&self, up: &Vector3<f64>, volume: f64) -> Stand {
        self.stand_near(up, volume, f64::NAN)
    }

    /// As [`Self::stand`], quicker where the surface is near a height (m along `up`), as it is a moment after it was there.
    pub fn stand_near(&self, up: &Vector3<f64>, volume: f64, near: f64) -> Stand {
        if let Some(stand) = self.stand_at_walls(up, volume) {
            return stand;
        }
        let z = if up.z.abs() < LEVEL { LEVEL.copysign(up.z) } else { up.z };
        let [x, y, per_z] = [up.x, up.y, 1.0 / z].map(f64x4::splat);
        let level = Level { x, y, per_z, is_upright: z > 0.0 };
        let heights = self.ends.iter().flat_map(|foot| {
            let reach = up.x * foot[0] + up.y * foot[1];
            [reach + z * self.floor, reach + z * self.rim]
        });
        let (mut low, mut high) =
            heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), h| (a.min(h), b.max(h)));
        let mut height = if near > low && near < high { near } else { f64::midpoint(low, high) };
        // Newton's step where it stays between what is too low and too high, else half of that.
        for _ in 0..STEPS {
            let (mut held, mut surface) = (f64x4::ZERO, f64x4::ZERO);
            for four in &self.columns {
                let [from, to] = four.wet(&level, height);
                let wet = to - from;
                held += wet;
                let is_cut = wet.simd_gt(f64x4::ZERO) & wet.simd_lt(four.rim - four.floor);
                surface += is_cut & f64x4::ONE;
            }
            let missing = volume / self.column - held.reduce_add();
            if missing > 0.0 {
                low = height;
            } else {
                high = height;
            }
            let step = height + missing * z.abs() / f64::max(surface.reduce_add(), 1.0);
            let next = if step > low && step < high { step } else { f64::midpoint(low, high) };
            let moved = (next - height).abs();
            height = next;
            if moved < 1e-9 {
                break;
            }
        }
        let (mut held, mut sum) = (f64x4::ZERO, [f64x4::ZERO; 3]);
        for four in &self.columns {
            let [from, to] = four.wet(&level, height);
            let wet = to - from;
            held += wet;
            sum[0] += four.x * wet;
            sum[1] += four.y * wet;
            sum[2] += (from + to) * f64x4::HALF * wet;
        }
        let held = held.reduce_add();
        let sum = Vector3::from(sum.map(f64x4::reduce_add));
        let centre = if held > 0.0 { sum / held } else { Vector3::z() * self.floor };
        Stand { height, centre }
    }

    /// As [`Self::stand`] where all columns are as high and the surface meets neither floor nor rim: each is as wet as where it
    /// stands says, and what they add up to is known.
    fn stand_at_walls(&self, up: &Vector3<f64>, volume: f64) -> Option<Stand> {
        let feet = self.feet.filter(|_| volume > 0.0 && up.z > LEVEL)?;
        let (held, a, b) = (volume / self.column, -up.x / up.z, -up.y / up.z);
        // A column at (x, y) is wet by `wet + a x + b y`.
        let wet = (held - a * feet.x - b * feet.y) / feet.n;
        let (room, mut inside) = (self.rim - self.floor, self.ends.iter());
        if !inside.all(|[x, y]| (0.0..=room).contains(&(wet + a * x + b * y))) {
            return None;
        }
        let aside = a * feet.x + b * feet.y;
        let x = wet * feet.x + a * feet.xx + b * feet.xy;
        let y = wet * feet.y + a * feet.xy + b * feet.yy;
        let squares = wet * (feet.n * wet + 2.0 * aside)
            + a * (a * feet.xx + 2.0 * b * feet.xy)
            + b * b * feet.yy;
        let height = (self.floor + wet) * up.z;
        let centre = Vector3::new(x / held, y / held, self.floor + 0.5 * squares / held);
        Some(Stand { height, centre })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box of 60 mm by 60 mm by 140 mm inside.
    fn jar() -> Basin {
        Basin::new(&Shape::Cuboid { size: Vector3::new(0.066, 0.066, 0.143) }, 0.003)
    }

    const VOLUME: f64 = 0.06 * 0.06 * 0.08;

    #[test]
    fn it_stands_level_in_a_tilted_box_as_geometry_says() {
        // As long as the surface meets only the four walls, the depth along the box's axis stays that of the upright
        // one, whatever the tilt.
        for tilt in [0.0_f64, 0.2, 0.5, 0.7] {
            let up = Vector3::new(tilt.sin(), 0.0, tilt.cos());
            let stand = jar().stand(&up, VOLUME);
            assert!((stand.height / tilt.cos() - 0.083).abs() < 1e-4, "{tilt}: {stand:?}");
            // The centre moves to the lower side by b² tan θ / (12 h), and up by half of that times tan θ.
            let aside = -0.06_f64.powi(2) * tilt.tan() / (12.0 * 0.08);
            assert!((stand.centre.x - aside).abs() < 1e-4, "{tilt}: {stand:?}");
            let z = 0.003 + 0.04 - 0.5 * aside * tilt.tan();
            assert!((stand.centre.z - z).abs() < 1e-4, "{tilt}: {stand:?}");
        }
        // Lying on its side, a box filled to 4/7 is filled to 4/7 of its width.
        let side = jar().stand(&Vector3::x(), VOLUME);
        assert!((side.height - (-0.03 + 0.06 * 4.0 / 7.0)).abs() < 1e-3, "{side:?}");
    }

    #[test]
    fn in_a_cone_it_stands_as_high_as_its_volume_says() {
        let profile = crate::world::Profile::cone(0.03, 0.05, 0.1).unwrap();
        let basin = Basin::new(&Shape::Lathe { profile }, 0.002);
        let hollow = profile.inside(0.002).unwrap();
        // What is below 5 cm of the inside: a stump from 28.4 to 38.4 mm.
        let (low, high) = (hollow.foot(), hollow.radius_at(0.05));
        let volume = std::f64::consts::PI / 3.0 * 0.05 * (low * low + low * high + high * high);
        let stand = basin.stand(&Vector3::z(), volume);
        assert!((stand.height - 0.052).abs() < 5e-4, "{stand:?}");
        let full = basin.stand(&Vector3::z(), hollow.volume());
        assert!((full.height - 0.1).abs() < 1e-6, "{full:?}");
    }

    #[test]
    fn upside_down_it_stands_on_the_lid_and_what_is_not_there_lies_on_the_floor() {
        let stand = jar().stand(&-Vector3::z(), VOLUME);
        assert!((stand.height + 0.063).abs() < 1e-6 && (stand.centre.z - 0.103).abs() < 1e-6);
        let empty = jar().stand(&Vector3::z(), 0.0);
        assert!((empty.height - 0.003).abs() < 1e-6 && (empty.centre.z - 0.003).abs() < 1e-6);
        let full = Basin::new(&Shape::Cylinder { radius: 0.04, height: 0.1 }, 0.002);
        let stand = full.stand(&Vector3::z(), 1.0);
        assert!((stand.height - 0.1).abs() < 1e-6, "{stand:?}");
    }

    #[test]
    fn what_meets_the_walls_alone_stands_as_the_columns_say() {
        let mut counted = 0;
        for shape in [
            Shape::Cuboid { size: Vector3::new(0.066, 0.05, 0.143) },
            Shape::Cylinder { radius: 0.04, height: 0.1 },
        ] {
            let quick = Basin::new(&shape, 0.003);
            let slow = Basin { feet: None, ..quick.clone() };
            for k in 0..60 {
                let (tilt, way) = (0.02 * f64::from(k), 0.7 * f64::from(k));
                let up = Vector3::new(tilt.sin() * way.cos(), tilt.sin() * way.sin(), tilt.cos());
                counted += usize::from(quick.stand_at_walls(&up, 1.1e-4).is_some());
                let (a, b) = (quick.stand(&up, 1.1e-4), slow.stand(&up, 1.1e-4));
                assert!((a.height - b.height).abs() < 1e-8, "{tilt} rad: {a:?} {b:?}");
                assert!((a.centre - b.centre).norm() < 1e-8, "{tilt} rad: {a:?} {b:?}");
            }
        }
        assert!((20..120).contains(&counted), "{counted}");
    }
}
