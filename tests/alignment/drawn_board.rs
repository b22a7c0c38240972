//! Chessboards drawn through any lens, with things in front of them: pictures whose corners are known.
//!
//! Every pixel is sixteen looks along rays onto the board's plane; a cover is painted in the picture, since it stands before the
//! board. Then come the lens's blur and the sensor's noise. Nothing here is shared with what finds the corners but the camera model.

use image::RgbImage;
use nalgebra::{Rotation3, Vector3};
use rand::rngs::StdRng;
use rand::{RngExt as _, SeedableRng as _};
use trueup::alignment::chessboard::Board;
use trueup::alignment::plane::Plane;
use trueup::world::{Camera, Intrinsics, Pixel, Pose};

use crate::sights::Sights;

/// What stands before the board, in the picture.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Cover {
    /// Everything on one side of a line: normal's angle, rad, and how far from (0, 0) along it, px.
    Sheet { angle: f64, far: f64, paint: Paint },
    /// An ellipse, as a finger or a mug seen from above: middle, half axes, px, and turn, rad.
    Ellipse { at: [f64; 2], axes: [f64; 2], angle: f64, paint: Paint },
}

/// How what covers looks, grey levels.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Paint {
    /// One grey.
    Flat(f64),
    /// From the first to the second, rounded towards its rim, as skin under a lamp.
    Round(f64, f64),
    /// Waves of 9 px about a grey.
    Woven(f64, f64),
    /// No thing but its shadow: this part of the light is left.
    Shadow(f64),
}

impl Cover {
    /// How far inside a place is, 0 at the rim and 1 in the middle, and the paint; `None` outside.
    fn at(&self, u: f64, v: f64) -> Option<(f64, Paint)> {
        match *self {
            Self::Sheet { angle, far, paint } => {
                let inside = u * angle.cos() + v * angle.sin() - far;
                (inside > 0.0).then_some(((inside / 40.0).min(1.0), paint))
            }
            Self::Ellipse { at, axes, angle, paint } => {
                let (x, y) = (u - at[0], v - at[1]);
                let a = (x * angle.cos() + y * angle.sin()) / axes[0];
                let b = (y * angle.cos() - x * angle.sin()) / axes[1];
                let far = a.hypot(b);
                (far < 1.0).then_some((1.0 - far, paint))
            }
        }
    }

    /// Whether a place is covered.
    pub(crate) fn hides(&self, at: Pixel) -> bool {
        self.at(at.u, at.v).is_some()
    }
}

impl Paint {
    fn over(self, ground: f64, inside: f64, u: f64, v: f64) -> f64 {
        match self {
            Self::Flat(grey) => grey,
            Self::Round(rim, middle) => rim + (middle - rim) * inside.sqrt(),
            Self::Woven(grey, by) => grey + by * (0.7 * u + 0.2 * v).sin() * (0.6 * v).cos(),
            Self::Shadow(part) => part * ground,
        }
    }
}

/// How a board is photographed.
#[derive(Debug, Clone)]
pub(crate) struct Photo {
    pub(crate) board: Board,
    pub(crate) lens: Intrinsics,
    /// Turns about x, y, z of the camera, rad.
    pub(crate) turns: [f64; 3],
    /// Where the board's middle is from the camera, m, camera axes.
    pub(crate) middle: [f64; 3],
    /// Dark and bright, grey levels.
    pub(crate) ink: [f64; 2],
    pub(crate) blur: f32,
    pub(crate) noise: f64,
    pub(crate) covers: Vec<Cover>,
    pub(crate) seed: u64,
}

/// A lens as cameras have them: 640 x 480 px, barrel, a little tangential.
pub(crate) fn usual_lens() -> Intrinsics {
    let mut k = Intrinsics::centred(600.0, 640, 480);
    (k.k1, k.k2, k.p1, k.p2) = (-0.2, 0.06, 1e-3, -5e-4);
    k
}

impl Photo {
    /// A board of squares of 25 mm, 0.5 m away in the middle of the picture.
    pub(crate) fn new(columns: usize, rows: usize, turns: [f64; 3]) -> Self {
        Self {
            board: Board::new(columns, rows, 0.025).unwrap(),
            lens: usual_lens(),
            turns,
            middle: [0.0, 0.0, 0.5],
            ink: [30.0, 220.0],
            blur: 0.7,
            noise: 2.0,
            covers: Vec::new(),
            seed: 7,
        }
    }

    pub(crate) fn camera(&self) -> Camera {
        let [x, y, z] = self.turns;
        let turn = Rotation3::from_euler_angles(x, y, z);
        let side = self.board.square;
        let middle = Vector3::new(
            0.5 * side * (self.board.columns as f64 - 1.0),
            0.5 * side * (self.board.rows as f64 - 1.0),
            0.0,
        );
        let eye = middle - turn.inverse() * Vector3::from(self.middle);
        let world_from_camera = Pose::from_parts(eye, turn.inverse().into());
        Camera { intrinsics: self.lens, world_from_camera }
    }

    /// Where the corners are, row by row.
    pub(crate) fn truth(&self) -> Vec<Pixel> {
        let camera = self.camera();
        self.board.points().into_iter().map(|p| camera.project(p).unwrap()).collect()
    }

    /// Squares around the inner corners, a margin as wide, and a grey table.
    pub(crate) fn taken(&self) -> RgbImage {
        let sights = Sights::of(&self.camera());
        let (w, h) = (self.lens.width as usize, self.lens.height as usize);
        let ground = |u: f64, v: f64| {
            let Some([x, y]) = sights.on_plane(u, v) else { return 90.0 };
            let (x, y) = (x / self.board.square, y / self.board.square);
            let (c, r) = (self.board.columns as f64, self.board.rows as f64);
            if x < -2.0 || y < -2.0 || x > c + 1.0 || y > r + 1.0 {
                90.0
            } else if x < -1.0 || y < -1.0 || x > c || y > r {
                self.ink[1]
            } else {
                // The first square inside is dark.
                self.ink[usize::from((x.floor() + y.floor()).rem_euclid(2.0) > 0.5)]
            }
        };
        let shade = |u: f64, v: f64| {
            let mut value = ground(u, v);
            for cover in &self.covers {
                if let Some((inside, paint)) = cover.at(u, v) {
                    value = paint.over(value, inside, u, v);
                }
            }
            value
        };
        let mut plane = Plane::zeros(w, h);
        // At the corners of pixels; only where they differ there is an edge to be looked at closely.
        let at_corners: Vec<f64> = (0..(w + 1) * (h + 1))
            .map(|k| shade((k % (w + 1)) as f64 - 0.5, (k / (w + 1)) as f64 - 0.5))
            .collect();
        for v in 0..h {
            for u in 0..w {
                let first = v * (w + 1) + u;
                let four = [first, first + 1, first + w + 1, first + w + 2].map(|k| at_corners[k]);
                let (low, high) = four.iter().fold((f64::MAX, f64::MIN), |(low, high), value| {
                    (low.min(*value), high.max(*value))
                });
                if high - low < 8.0 {
                    plane.data[v * w + u] = (0.25 * four.iter().sum::<f64>()) as f32;
                    continue;
                }
                // Hammersley's points: an edge along an axis is seen to a sixteenth of a pixel.
                let sum: f64 = (0_u8..16)
                    .map(|i| {
                        let (a, b) = (f64::from(i) - 7.5, f64::from(i.reverse_bits() >> 4) - 7.5);
                        shade(u as f64 + a / 16.0, v as f64 + b / 16.0)
                    })
                    .sum();
                plane.data[v * w + u] = (sum / 16.0) as f32;
            }
        }
        let plane = plane.blurred(self.blur);
        let mut random = StdRng::seed_from_u64(self.seed);
        RgbImage::from_fn(w as u32, h as u32, |u, v| {
            // Twelve even draws have a variance of 1 and are nearly normal.
            let noise: f64 = (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
            let value = f64::from(plane.at(i64::from(u), i64::from(v))) + self.noise * noise;
            image::Rgb([value.round().clamp(0.0, 255.0) as u8; 3])
        })
    }

    /// The board as somebody holds it, with a hand or a mug before it; all by the seed.
    pub(crate) fn covered(seed: u64) -> Self {
        let mut random = StdRng::seed_from_u64(seed);
        let mut even = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
        let turns = [even(-0.5, 0.5), even(-0.5, 0.5), even(-0.4, 0.4)];
        let mut photo = Self::new(9, 6, turns);
        photo.middle[2] = even(0.45, 0.7);
        (photo.blur, photo.noise) = (even(0.6, 1.4) as f32, even(1.0, 4.0));
        photo.seed = seed;
        let corners = photo.truth();
        let near = corners[(even(0.0, 1.0) * 54.0) as usize % 54];
        let paint = match seed % 6 {
            0 => Paint::Flat(150.0),
            1 => Paint::Round(70.0, 170.0),
            2 => Paint::Woven(125.0, 35.0),
            3 => Paint::Flat(45.0),
            4 => Paint::Round(140.0, 235.0),
            _ => Paint::Shadow(0.45),
        };
        let angle = even(0.0, std::f64::consts::TAU);
        let cover = if seed.is_multiple_of(2) {
            // A quarter of the board from one side.
            let along = |p: &Pixel| p.u * angle.cos() + p.v * angle.sin();
            let mut far: Vec<f64> = corners.iter().map(along).collect();
            far.sort_by(f64::total_cmp);
            Cover::Sheet { angle, far: far[41] + even(-8.0, 8.0), paint }
        } else {
            let at = [near.u + even(-20.0, 20.0), near.v + even(-20.0, 20.0)];
            Cover::Ellipse { at, axes: [even(12.0, 25.0), even(25.0, 90.0)], angle, paint }
        };
        photo.covers.push(cover);
        photo
    }
}
