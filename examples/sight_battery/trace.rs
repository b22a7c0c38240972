//! A small ray tracer of test pictures: solids with painted textures, glass and shadows over a background.
//!
//! It shares the camera model with the program and nothing else. What it draws is placed exactly, so the truth is
//! known; light, textures and glass are plausible, not physical.

use image::{Rgb, RgbImage};
use nalgebra::{Vector2, Vector3};
use trueup::world::{Camera, Pixel, Ray};

type P3 = Vector3<f64>;

/// A body about its own z axis; stacked ones make bottles.
#[derive(Debug, Clone)]
pub(crate) enum Body {
    /// Edge lengths, m.
    Cuboid(P3),
    /// Rings of a lathe: radius and height, m, from below.
    Lathe(Vec<(f64, f64)>),
    /// Centre above the table and radius, m.
    Ball(P3, f64),
}

/// What is painted on a body.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Paint {
    Plain,
    /// Stripes of this period, m, across the axis.
    Stripes(f64),
    Checks(f64),
    /// Blotches of this size, m.
    Blotches(f64),
    /// A band with print on it, between two shares of the height.
    Label(f64, f64),
    Glass,
}

/// A thing in the picture.
#[derive(Debug, Clone)]
pub(crate) struct Thing {
    pub(crate) body: Body,
    pub(crate) at: [f64; 2],
    pub(crate) yaw: f64,
    pub(crate) colour: [f64; 3],
    pub(crate) second: [f64; 3],
    pub(crate) paint: Paint,
    pub(crate) seed: u64,
}

struct Hit {
    far: f64,
    normal: P3,
    local: P3,
}

/// A hash of two whole numbers, 0 to 1.
pub(crate) fn hash(x: i64, y: i64, seed: u64) -> f64 {
    let mut h = (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
        ^ seed.wrapping_mul(0x1656_67B1_9E37_79F9);
    h ^= h >> 29;
    h = h.wrapping_mul(0xBF58_476D_1CE4_E5B9);
    h ^= h >> 32;
    (h & 0xFFFF_FFFF) as f64 / f64::from(u32::MAX)
}

/// Smooth noise of two coordinates, 0 to 1.
pub(crate) fn noise(x: f64, y: f64, seed: u64) -> f64 {
    let (x0, y0) = (x.floor(), y.floor());
    let smooth = |t: f64| t * t * (3.0 - 2.0 * t);
    let (fx, fy) = (smooth(x - x0), smooth(y - y0));
    let (i, j) = (x0 as i64, y0 as i64);
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    mix(
        mix(hash(i, j, seed), hash(i + 1, j, seed), fx),
        mix(hash(i, j + 1, seed), hash(i + 1, j + 1, seed), fx),
        fy,
    )
}

impl Thing {
    /// The radius around its place that holds it, m.
    pub(crate) fn reach(&self) -> f64 {
        match &self.body {
            Body::Cuboid(size) => 0.5 * size.x.hypot(size.y),
            Body::Lathe(rings) => rings.iter().map(|r| r.0).fold(0.0, f64::max),
            Body::Ball(_, radius) => *radius,
        }
    }

    pub(crate) fn height(&self) -> f64 {
        match &self.body {
            Body::Cuboid(size) => size.z,
            Body::Lathe(rings) => rings.last().map_or(0.0, |r| r.1),
            Body::Ball(centre, radius) => centre.z + radius,
        }
    }

    fn coat(&self, at: P3) -> [f64; 3] {
        let along = match &self.body {
            Body::Cuboid(_) => at.x + at.y,
            _ => at.y.atan2(at.x) * self.reach(),
        };
        let share = match self.paint {
            Paint::Plain | Paint::Glass => 0.0,
            Paint::Stripes(period) => f64::from(u8::from((at.z / period).rem_euclid(1.0) < 0.4)),
            Paint::Checks(size) => f64::from(u8::from(
                ((along / size).floor() + (at.z / size).floor()).rem_euclid(2.0) < 1.0,
            )),
            Paint::Blotches(size) => {
                let n = noise(along / size, at.z / size + 3.0 * at.x / size, self.seed);
                ((n - 0.45) * 6.0).clamp(0.0, 1.0)
            }
            Paint::Label(low, high) => {
                let z = at.z / self.height().max(1e-6);
                if z > low && z < high {
                    let print = hash(
                        (along / 0.004).floor() as i64,
                        (at.z / 0.006).floor() as i64,
                        self.seed,
                    );
                    0.6 + 0.4 * f64::from(u8::from(print > 0.5))
                } else {
                    0.0
                }
            }
        };
        [0, 1, 2].map(|c| self.colour[c] * (1.0 - share) + self.second[c] * share)
    }
}

/// A thing with what every ray asks of it.
struct Placed<'a> {
    thing: &'a Thing,
    /// The ball around it: middle, and radius, m.
    middle: P3,
    ball: f64,
    /// Sine and cosine of its turn, back and forth.
    turns: [(f64, f64); 2],
}

impl<'a> Placed<'a> {
    fn of(thing: &'a Thing) -> Self {
        let half = 0.5 * thing.height();
        let ball = match &thing.body {
            Body::Ball(centre, radius) => centre.xy().norm() + radius + half,
            _ => thing.reach().hypot(half),
        };
        let middle = P3::new(thing.at[0], thing.at[1], half);
        Self { thing, middle, ball, turns: [-thing.yaw, thing.yaw].map(f64::sin_cos) }
    }

    fn turn(&self, v: P3, way: usize) -> P3 {
        let (sin, cos) = self.turns[way];
        P3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z)
    }

    /// Whether a ray passes by within the ball around the thing.
    fn is_near(&self, origin: P3, way: P3, by: f64) -> bool {
        let off = self.middle - origin;
        let beside = off - way * off.dot(&way);
        beside.norm() < self.ball + by
    }

    fn hit(&self, origin: P3, way: P3) -> Option<Hit> {
        if !self.is_near(origin, way, 0.0) {
            return None;
        }
        let o = self.turn(origin - P3::new(self.thing.at[0], self.thing.at[1], 0.0), 0);
        let d = self.turn(way, 0);
        let (far, normal) = match &self.thing.body {
            Body::Cuboid(size) => {
                let (low, high) = (
                    P3::new(-size.x / 2.0, -size.y / 2.0, 0.0),
                    P3::new(size.x / 2.0, size.y / 2.0, size.z),
                );
                let (mut near, mut end, mut normal) = (1e-6, f64::INFINITY, P3::zeros());
                for k in 0..3 {
                    let (a, b) = ((low[k] - o[k]) / d[k], (high[k] - o[k]) / d[k]);
                    let (a, b) = (a.min(b), a.max(b));
                    if a > near {
                        near = a;
                        normal = P3::zeros();
                        normal[k] = -d[k].signum();
                    }
                    end = end.min(b);
                }
                (near < end && normal != P3::zeros()).then_some((near, normal))?
            }
            Body::Ball(centre, radius) => {
                let off = o - centre;
                let (b, c) = (off.dot(&d), off.norm_squared() - radius * radius);
                let root = (b * b - c).max(-1.0);
                let far = (root > 0.0 && -b - root.sqrt() > 1e-6).then(|| -b - root.sqrt())?;
                (far, (off + d * far).normalize())
            }
            Body::Lathe(rings) => lathe(rings, o, d)?,
        };
        Some(Hit { far, normal: self.turn(normal, 1), local: o + d * far })
    }
}

/// The nearest hit of a body of revolution: frusta between rings, and a lid on the last and first.
fn lathe(rings: &[(f64, f64)], o: P3, d: P3) -> Option<(f64, P3)> {
    let mut best: Option<(f64, P3)> = None;
    let mut offer = |far: f64, normal: P3| {
        if far > 1e-6 && best.is_none_or(|b| far < b.0) {
            best = Some((far, normal));
        }
    };
    for pair in rings.windows(2) {
        let ((r0, z0), (r1, z1)) = (pair[0], pair[1]);
        if (z1 - z0).abs() < 1e-9 {
            continue;
        }
        // x² + y² = (r0 + k (z - z0))².
        let k = (r1 - r0) / (z1 - z0);
        let r = r0 + k * (o.z - z0);
        let a = d.x * d.x + d.y * d.y - k * k * d.z * d.z;
        let b = o.x * d.x + o.y * d.y - k * r * d.z;
        let c = o.x * o.x + o.y * o.y - r * r;
        let root = b * b - a * c;
        if root > 0.0 && a.abs() > 1e-12 {
            for far in [(-b - root.sqrt()) / a, (-b + root.sqrt()) / a] {
                let p = o + d * far;
                if p.z >= z0 && p.z <= z1 {
                    offer(far, P3::new(p.x, p.y, -k * p.xy().norm()).normalize());
                }
            }
        }
    }
    for (ring, up) in [(rings.first(), -1.0), (rings.last(), 1.0)] {
        if let Some(&(radius, z)) = ring {
            let far = (z - o.z) / d.z;
            if (o + d * far).xy().norm() < radius {
                offer(far, P3::new(0.0, 0.0, up));
            }
        }
    }
    best
}

/// Where the light comes from: its direction, m above the table does not matter.
fn sun(seed: u64) -> P3 {
    let turn = std::f64::consts::TAU * hash(1, 2, seed);
    P3::new(0.6 * turn.cos(), 0.6 * turn.sin(), 1.0).normalize()
}

/// The middles of a pixel's four quarters, px from its own.
const QUARTERS: [(f64, f64); 4] = [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)];

/// Draws things over a background that the camera would see without them.
pub(crate) fn draw(
    camera: &Camera,
    background: &RgbImage,
    things: &[Thing],
    seed: u64,
) -> RgbImage {
    let (sun, eye) = (sun(seed), camera.world_from_camera.origin());
    let things: Vec<Placed> = things.iter().map(Placed::of).collect();
    let lamp = [0.0, 1.0, 2.0, 3.0].map(|k| {
        let side = std::f64::consts::FRAC_PI_2 * k;
        (sun + P3::new(0.06 * side.cos(), 0.06 * side.sin(), 0.0)).normalize()
    });
    let (w, h) = background.dimensions();
    let nearest = |ray: &Ray| {
        things
            .iter()
            .filter_map(|t| Some((t.thing, t.hit(ray.origin, ray.direction)?)))
            .min_by(|a, b| a.1.far.total_cmp(&b.1.far))
    };
    let behind = |u: f64, v: f64| {
        let (x, y) =
            (u.round().clamp(0.0, f64::from(w) - 1.0), v.round().clamp(0.0, f64::from(h) - 1.0));
        background.get_pixel(x as u32, y as u32).0.map(f64::from)
    };
    // A soft shadow: four rays to a lamp that has some width.
    let shade = |at: P3| {
        let lit = lamp.iter().filter(|way| {
            let is_hit = |t: &Placed| t.hit(at + 1e-4 * **way, **way).is_some();
            !things.iter().any(|t| !matches!(t.thing.paint, Paint::Glass) && is_hit(t))
        });
        0.6 + 0.1 * lit.count() as f64
    };
    let sample = |u: f64, v: f64| -> [f64; 3] {
        let ray = camera.ray(Pixel::new(u, v));
        let Some((thing, hit)) = nearest(&ray) else {
            let floor = ray.meet_plane(Vector3::z(), 0.0).map(|p| shade(p.coords()));
            return behind(u, v).map(|c| c * floor.unwrap_or(1.0));
        };
        let facing = hit.normal.dot(&-ray.direction).abs();
        if matches!(thing.paint, Paint::Glass) {
            // Seen through, a little aside, brighter at the rim and along edges.
            let aside: Vector2<f64> =
                camera.world_from_camera.rotation().inverse_transform_vector(&hit.normal).xy();
            let seen = behind(u + 9.0 * aside.x, v + 9.0 * aside.y);
            let edge = match &thing.body {
                Body::Cuboid(size) => {
                    let gap = |k: usize, from: f64| (from - hit.local[k].abs()).abs();
                    let mut gaps = [
                        gap(0, size.x / 2.0),
                        gap(1, size.y / 2.0),
                        hit.local.z.min(size.z - hit.local.z).abs(),
                    ];
                    gaps.sort_by(f64::total_cmp);
                    f64::from(u8::from(gaps[1] < 0.0018))
                }
                _ => f64::from(u8::from(
                    hit.local.z < 0.0025 || thing.height() - hit.local.z < 0.0025,
                )),
            };
            let white = (0.05 + 0.7 * (1.0 - facing).powi(4) + 0.35 * edge).min(0.8);
            return seen.map(|c| 0.95 * c * (1.0 - white) + 240.0 * white);
        }
        let at = ray.origin + ray.direction * hit.far;
        let light = 0.45 + 0.55 * hit.normal.dot(&sun).max(0.0) * shade(at);
        thing.coat(hit.local).map(|c| c * light)
    };
    let grey = background.pixels().take(2000).all(|p| p.0[0] == p.0[1] && p.0[1] == p.0[2]);
    debug_assert!(eye.z > 0.0, "a camera above the table");
    RgbImage::from_fn(w, h, |x, y| {
        // Where nothing is near, one sample is as good as four.
        let ray = camera.ray(Pixel::new(f64::from(x), f64::from(y)));
        let is_open = !things.iter().any(|t| t.is_near(ray.origin, ray.direction, 0.004));
        let mut sum = if is_open { sample(f64::from(x), f64::from(y)) } else { [0.0; 3] };
        for &(du, dv) in QUARTERS.iter().filter(|_| !is_open) {
            let colour = sample(f64::from(x) + du, f64::from(y) + dv);
            for c in 0..3 {
                sum[c] += 0.25 * colour[c];
            }
        }
        if grey {
            let light = 0.299 * sum[0] + 0.587 * sum[1] + 0.114 * sum[2];
            sum = [light; 3];
        }
        let grain = 3.0 * (hash(i64::from(x), i64::from(y), seed) - 0.5);
        Rgb(sum.map(|c| (c + grain).round().clamp(0.0, 255.0) as u8))
    })
}

/// A table of our own making seen by a camera: wood, cloth, tiles, or plain, with a floor around it.
pub(crate) fn table(
    camera: &Camera,
    holds: impl Fn(f64, f64) -> bool,
    kind: usize,
    seed: u64,
) -> RgbImage {
    let base = [0, 1, 2].map(|c| 90.0 + 130.0 * hash(c, 7, seed));
    let floor = [0, 1, 2].map(|c| 50.0 + 90.0 * hash(c, 9, seed));
    let (w, h) = (camera.intrinsics.width, camera.intrinsics.height);
    RgbImage::from_fn(w, h, |x, y| {
        let at = camera.on_plane(Pixel::new(f64::from(x), f64::from(y)), 0.0).map(|p| p.coords());
        let Some(at) = at.filter(|p| holds(p.x, p.y)) else {
            let n = noise(f64::from(x) / 40.0, f64::from(y) / 40.0, seed + 1);
            return Rgb(floor.map(|c| (c * (0.8 + 0.4 * n)) as u8));
        };
        let share = match kind {
            0 => 1.0 + 0.05 * (noise(at.x * 8.0, at.y * 8.0, seed) - 0.5),
            // Wood: long grain.
            1 => {
                0.75 + 0.3 * noise(at.x * 6.0, at.y * 140.0, seed)
                    + 0.15 * noise(at.x * 20.0, at.y * 500.0, seed)
            }
            // Cloth with checks.
            2 => {
                let stripe = |v: f64| f64::from(u8::from((v / 0.06).rem_euclid(1.0) < 0.5));
                0.7 + 0.18 * (stripe(at.x) + stripe(at.y))
            }
            // Tiles with joints.
            3 => {
                let joint = |v: f64| (v / 0.1).rem_euclid(1.0) < 0.03;
                if joint(at.x) || joint(at.y) {
                    0.6
                } else {
                    1.0 + 0.08
                        * (hash((at.x / 0.1).floor() as i64, (at.y / 0.1).floor() as i64, seed)
                            - 0.5)
                }
            }
            // Marble.
            _ => {
                0.7 + 0.5
                    * noise(
                        at.x * 25.0 + 3.0 * noise(at.x * 60.0, at.y * 60.0, seed),
                        at.y * 25.0,
                        seed + 2,
                    )
            }
        };
        Rgb(base.map(|c| (c * share).clamp(0.0, 255.0) as u8))
    })
}
