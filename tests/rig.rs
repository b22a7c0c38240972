//! An arm, a camera and a board, made up: where each is, what the arm says, and pictures of the board.

use image::{Rgb, RgbImage};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rand::rngs::StdRng;
use rand::{RngExt as _, SeedableRng as _};
use trueup::alignment::chessboard::Board;
use trueup::alignment::hand_eye::{Mount, View};
use trueup::world::{Camera, Intrinsics, Pixel, Pose};

use crate::sheet::Sheet;
use crate::sights::Sights;

/// Everything as it is, and how badly it is said.
#[derive(Debug, Clone)]
pub(crate) struct Rig {
    pub(crate) mount: Mount,
    pub(crate) board: Board,
    pub(crate) intrinsics: Intrinsics,
    /// `flange_from_camera`, or `base_from_camera`.
    pub(crate) camera: Isometry3<f64>,
    /// `base_from_board`, or `flange_from_board`.
    pub(crate) place: Isometry3<f64>,
    /// Where the pictures are taken from: `camera_from_board`.
    pub(crate) sights: Vec<Isometry3<f64>>,
    /// Noise of a corner, px; of the arm's turn, rad, and place, m, along each axis.
    pub(crate) noise: (f64, f64, f64),
}

/// Turns of a picture: how far the board leans, to which side, and how the camera is rolled, rad; and the distance, m.
pub(crate) type Turns = (f64, f64, f64, f64);

/// Turns to all sides, up to 35 deg.
pub(crate) fn all_sides(n: usize) -> Vec<Turns> {
    let each = (0..n).map(|i| {
        let i = i as f64;
        // The golden angle spreads sides evenly.
        (
            0.2 + 0.4 * (0.618 * i).fract(),
            2.4 * i,
            0.7 * (1.7 * i).sin(),
            0.42 + 0.12 * (0.37 * i).fract(),
        )
    });
    each.collect()
}

fn iso(xyz: [f64; 3], turn: [f64; 3]) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(xyz[0], xyz[1], xyz[2]),
        UnitQuaternion::from_euler_angles(turn[0], turn[1], turn[2]),
    )
}

/// Normal noise: twelve even draws have a variance of 1.
fn normal(random: &mut StdRng) -> f64 {
    (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0
}

impl Rig {
    pub(crate) fn new(mount: Mount, turns: &[Turns]) -> Self {
        let board = Board::new(9, 6, 0.02).unwrap();
        let mut intrinsics = Intrinsics::centred(620.0, 640, 480);
        (intrinsics.k1, intrinsics.k2) = (-0.12, 0.05);
        let (camera, place) = match mount {
            Mount::Wrist => (
                iso([0.05, -0.03, 0.08], [0.1, -0.05, 1.5]),
                iso([0.5, 0.1, 0.02], [3.1, 0.02, 0.4]),
            ),
            Mount::Fixed => {
                (iso([0.9, -0.3, 0.7], [-2.2, 0.1, 1.0]), iso([0.02, -0.06, 0.1], [0.2, -0.3, 0.6]))
            }
        };
        let middle = Vector3::new(0.08, 0.05, 0.0);
        let sights = turns.iter().enumerate().map(|(i, &(lean, side, roll, distance))| {
            let axis = Vector3::new(side.cos(), side.sin(), 0.0);
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll)
                * UnitQuaternion::from_scaled_axis(axis * lean);
            let aside = Vector3::new(
                0.03 * (1.3 * i as f64).sin(),
                0.02 * (2.1 * i as f64).cos(),
                distance,
            );
            Isometry3::from_parts(Translation3::from(aside - turn * middle), turn)
        });
        let sights = sights.collect();
        Self { mount, board, intrinsics, camera, place, sights, noise: (0.1, 5e-4, 3e-4) }
    }

    /// A rig that looks at a drawn board's middle from where it would look at its own's, `n` times.
    pub(crate) fn before(mount: Mount, sheet: &Sheet, n: usize) -> Self {
        let mut rig = Self::new(mount, &all_sides(n));
        let front = if sheet.is_up {
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
        } else {
            UnitQuaternion::identity()
        };
        let old = Translation3::new(0.08, 0.05, 0.0);
        let new = Translation3::new(sheet.middle[0], sheet.middle[1], 0.0);
        let moved = Isometry3::from_parts(old, front) * new.inverse();
        for sight in &mut rig.sights {
            *sight *= moved;
        }
        rig
    }

    /// Where the flange truly was.
    pub(crate) fn flange(&self, picture: usize) -> Isometry3<f64> {
        let sight = self.sights[picture];
        match self.mount {
            Mount::Wrist => self.place * sight.inverse() * self.camera.inverse(),
            Mount::Fixed => self.camera * sight * self.place.inverse(),
        }
    }

    /// Where the arm says its flanges were, with noise.
    pub(crate) fn said(&self, seed: u64) -> Vec<Isometry3<f64>> {
        let mut random = StdRng::seed_from_u64(seed);
        let each = (0..self.sights.len()).map(|i| {
            let mut three = |size: f64| {
                Vector3::new(normal(&mut random), normal(&mut random), normal(&mut random)) * size
            };
            let (turn, shift) = (three(self.noise.1), three(self.noise.2));
            self.flange(i) * Isometry3::new(shift, turn)
        });
        each.collect()
    }

    pub(crate) fn seen_by(&self, picture: usize) -> Camera {
        let world_from_camera = Pose::new(self.sights[picture].inverse());
        Camera { intrinsics: self.intrinsics, world_from_camera }
    }

    /// The views with noise; the board's squares as it is said.
    pub(crate) fn views(&self, said: &Board, seed: u64) -> Vec<View> {
        let mut random = StdRng::seed_from_u64(seed + 1000);
        let poses = self.said(seed);
        let view = |i: usize| {
            let camera = self.seen_by(i);
            let points = said.points().into_iter().zip(self.board.points()).map(|(said, point)| {
                let p = camera.project(point).unwrap();
                let mut off = || self.noise.0 * normal(&mut random);
                (said, Pixel::new(p.u + off(), p.v + off()))
            });
            let points = points.collect();
            View { name: format!("{i}"), base_from_flange: Pose::new(poses[i]), points }
        };
        (0..poses.len()).map(view).collect()
    }

    /// A picture of the board, a white margin around it, on a grey table.
    pub(crate) fn picture(&self, picture: usize) -> RgbImage {
        let sights = Sights::of(&self.seen_by(picture));
        let (columns, rows) = (self.board.columns as f64, self.board.rows as f64);
        let shade = |u: f64, v: f64| -> f64 {
            let Some([x, y]) = sights.on_plane(u, v) else { return 90.0 };
            let (x, y) = (x / self.board.square, y / self.board.square);
            let is_within = |rim: f64| {
                x >= -rim && y >= -rim && x <= columns + rim - 1.0 && y <= rows + rim - 1.0
            };
            let is_dark = (x.floor() + y.floor()).rem_euclid(2.0) < 0.5;
            match (is_within(2.0), is_within(1.0) && is_dark) {
                (false, _) => 90.0,
                (true, false) => 220.0,
                (true, true) => 30.0,
            }
        };
        RgbImage::from_fn(self.intrinsics.width, self.intrinsics.height, |u, v| {
            // Hammersley's points: an edge along an axis is seen to an eighth of a pixel.
            let sum: f64 = (0_u8..8)
                .map(|i| {
                    let (a, b) = (f64::from(i) - 3.5, f64::from(i.reverse_bits() >> 5) - 3.5);
                    shade(f64::from(u) + a / 8.0, f64::from(v) + b / 8.0)
                })
                .sum();
            Rgb([(sum / 8.0).round() as u8; 3])
        })
    }
}
