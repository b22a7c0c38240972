//! Cameras against points: planted truth is found, and what the points cannot tell is said to be so.
//!
//! The pictures are made here, by a second camera model written for the tests alone: it shares no code with the one
//! that is judged.

mod bad_input;
mod confusion;
mod planted;
mod public;

use std::fmt::Write as _;

use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector2, Vector3};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use trueup::discovery::camera::{investigate, points::Points};
use trueup::discovery::finding::{Effect, Finding, Value};
use trueup::discovery::model_file::ModelFile;
use trueup::discovery::recording::{Error, Map};
use trueup::discovery::{Investigation, Options};

/// What the true camera has and the model does not.
#[derive(Debug, Clone)]
struct Truth {
    k: [f64; 2],
    p: [f64; 2],
    focal: [f64; 2],
    centre: [f64; 2],
    /// x, y, z in m, roll, pitch, yaw in rad, about the camera's own axes.
    shift: [f64; 6],
    /// roll, pitch in rad, height in m.
    table: [f64; 3],
    delay: f64,
    row_time: f64,
    /// Added to u and v, px, of the normalised coordinates.
    strange: fn(f64, f64) -> (f64, f64),
}

impl Default for Truth {
    fn default() -> Self {
        Self {
            k: [0.0; 2],
            p: [0.0; 2],
            focal: [1.0; 2],
            centre: [0.0; 2],
            shift: [0.0; 6],
            table: [0.0; 3],
            delay: 0.0,
            row_time: 0.0,
            strange: |_, _| (0.0, 0.0),
        }
    }
}

const WIDTH: f64 = 1280.0;
const HEIGHT: f64 = 720.0;
const FOCAL: f64 = 800.0;
const CENTRE: [f64; 2] = [639.5, 359.5];

const LENS: &str = r#""camera": {"fx_px": 800, "fy_px": 800, "cx_px": 639.5, "cy_px": 359.5}"#;

/// How the pictures are taken.
#[derive(Debug, Clone, Copy)]
struct Shot {
    noise: f64,
    /// Part of the points that are matched to something else.
    wrong: f64,
    seed: u64,
}

impl Shot {
    fn with(seed: u64) -> Self {
        Self { noise: 0.3, wrong: 0.03, seed }
    }
}

fn normal(random: &mut StdRng) -> f64 {
    let a: f64 = random.random_range(f64::MIN_POSITIVE..1.0);
    let b: f64 = random.random_range(0.0..std::f64::consts::TAU);
    (-2.0 * a.ln()).sqrt() * b.cos()
}

/// The camera of the model: above the table, looking down at it at an angle.
fn thought() -> Isometry3<f64> {
    looking(Vector3::new(1.25, 0.0, 0.85), Vector3::new(0.5, 0.0, 0.0))
}

/// World from a camera at `eye` that looks at `target`.
fn looking(eye: Vector3<f64>, target: Vector3<f64>) -> Isometry3<f64> {
    let z = (target - eye).normalize();
    let side = if z.cross(&Vector3::z()).norm() > 1e-6 { Vector3::z() } else { Vector3::x() };
    let x = z.cross(&side).normalize();
    let axes = nalgebra::Matrix3::from_columns(&[x, z.cross(&x), z]);
    let turned = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    Isometry3::from_parts(Translation3::from(eye), turned)
}

fn rpy(roll: f64, pitch: f64, yaw: f64) -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Vector3::z_axis(), yaw)
        * Rotation3::from_axis_angle(&Vector3::y_axis(), pitch)
        * Rotation3::from_axis_angle(&Vector3::x_axis(), roll)
}

impl Truth {
    /// Where the picture shows a point, when the camera is thought to stand at `world_from_camera`.
    fn pixel(
        &self,
        world_from_camera: &Isometry3<f64>,
        point: Vector3<f64>,
    ) -> Option<Vector2<f64>> {
        let [x, y, z, roll, pitch, yaw] = self.shift;
        let mut p = point;
        if p.z == 0.0 {
            p = rpy(self.table[0], self.table[1], 0.0) * p + Vector3::new(0.0, 0.0, self.table[2]);
        }
        let thought =
            world_from_camera.rotation.inverse() * (p - world_from_camera.translation.vector);
        let c = rpy(roll, pitch, yaw).inverse() * (thought - Vector3::new(x, y, z));
        if c.z < 0.05 {
            return None;
        }
        let (x, y) = (c.x / c.z, c.y / c.z);
        let r2 = x * x + y * y;
        let radial = 1.0 + self.k[0] * r2 + self.k[1] * r2 * r2;
        let xd = x * radial + 2.0 * self.p[0] * x * y + self.p[1] * (r2 + 2.0 * x * x);
        let yd = y * radial + self.p[0] * (r2 + 2.0 * y * y) + 2.0 * self.p[1] * x * y;
        let (du, dv) = (self.strange)(x, y);
        let u = self.focal[0] * FOCAL * xd + CENTRE[0] + self.centre[0] + du;
        let v = self.focal[1] * FOCAL * yd + CENTRE[1] + self.centre[1] + dv;
        let inside = (0.0..WIDTH).contains(&u) && (0.0..HEIGHT).contains(&v);
        inside.then(|| Vector2::new(u, v))
    }

    /// Writes one row if the point is in the picture.
    fn row(
        &self,
        text: &mut String,
        random: &mut StdRng,
        shot: Shot,
        (pose, point): (&Isometry3<f64>, Vector3<f64>),
        rest: &str,
    ) {
        let Some(mut seen) = self.pixel(pose, point) else { return };
        seen += Vector2::new(normal(random), normal(random)) * shot.noise;
        if random.random_range(0.0..1.0) < shot.wrong {
            seen = Vector2::new(random.random_range(0.0..WIDTH), random.random_range(0.0..HEIGHT));
        }
        write_row(text, point, seen, rest);
    }

    /// One picture of a table with marks, and of the tops of things on it if `tops`.
    fn table_picture(&self, shot: Shot, tops: bool) -> String {
        let mut random = StdRng::seed_from_u64(shot.seed);
        let mut text = String::from("x[m],y[m],z[m],u[px],v[px],view\n");
        for i in 0..12 {
            for j in 0..12 {
                let z = if tops && (i + j) % 2 == 1 { random.random_range(0.05..0.3) } else { 0.0 };
                let at = Vector3::new(f64::from(i) * 0.1 - 0.2, f64::from(j) * 0.11 - 0.6, z);
                self.row(&mut text, &mut random, shot, (&thought(), at), "1");
            }
        }
        text
    }

    /// Pictures of a board of 9 by 6 corners held in front of a camera whose pose nobody knows; square to the camera
    /// unless `tilted`.
    fn board_pictures(&self, shot: Shot, views: usize, tilted: bool) -> String {
        let mut random = StdRng::seed_from_u64(shot.seed);
        let mut text = String::from("x[m],y[m],z[m],u[px],v[px],view\n");
        for view in 0..views {
            let mut tilt = || if tilted { random.random_range(-0.7..0.7) } else { 0.0 };
            let turned = rpy(tilt(), tilt(), 0.2 * tilt());
            let far = random.random_range(0.35..0.6);
            let middle = Vector3::new(
                random.random_range(-0.3..0.3) * far,
                random.random_range(-0.15..0.15) * far,
                far,
            );
            let centre = Vector3::new(0.12, 0.075, 0.0);
            let camera_from_board = Isometry3::from_parts(
                Translation3::from(middle - turned * centre),
                UnitQuaternion::from_rotation_matrix(&turned),
            );
            let pose = camera_from_board.inverse();
            for (i, j) in (0..9).flat_map(|i| (0..6).map(move |j| (i, j))) {
                let at = Vector3::new(f64::from(i) * 0.03, f64::from(j) * 0.03, 0.0);
                self.row(&mut text, &mut random, shot, (&pose, at), &format!("{view}"));
            }
        }
        text
    }

    /// A film of two points that swing through the picture of a camera that stands still: 40 s, 25 pictures a second.
    fn film(&self, shot: Shot) -> String {
        let mut random = StdRng::seed_from_u64(shot.seed);
        let phase: f64 = random.random_range(0.0..6.0);
        let mut text = String::from("x[m],y[m],z[m],u[px],v[px],t[s],point\n");
        let place = |point: usize, t: f64| {
            let other = 1.7 * point as f64 + phase;
            Vector3::new(
                0.55 + 0.3 * (1.3 * t + other).sin(),
                0.4 * (0.9 * t + 2.0 * other).sin(),
                0.2 + 0.1 * (0.7 * t).cos(),
            )
        };
        for picture in 0..600 {
            let t = f64::from(picture) * 0.04;
            for point in 0..2 {
                // The row the point is on says when it was taken.
                let mut seen = self.pixel(&thought(), place(point, t));
                for _ in 0..5 {
                    let Some(here) = seen else { break };
                    let taken = t - self.delay + self.row_time * here.y;
                    seen = self.pixel(&thought(), place(point, taken));
                }
                let Some(mut seen) = seen else { continue };
                seen += Vector2::new(normal(&mut random), normal(&mut random)) * shot.noise;
                if random.random_range(0.0..1.0) < shot.wrong {
                    seen = Vector2::new(
                        random.random_range(0.0..WIDTH),
                        random.random_range(0.0..HEIGHT),
                    );
                }
                write_row(&mut text, place(point, t), seen, &format!("{t:.3},p{point}"));
            }
        }
        text
    }
}

fn write_row(text: &mut String, at: Vector3<f64>, seen: Vector2<f64>, rest: &str) {
    writeln!(text, "{:.6},{:.6},{:.6},{:.4},{:.4},{rest}", at.x, at.y, at.z, seen.x, seen.y)
        .unwrap();
}

/// Where the camera is thought to stand, as a file says it.
fn pose_json() -> String {
    let pose = thought();
    let (t, q) = (pose.translation.vector, pose.rotation.quaternion());
    format!(
        r#""world_from_camera": {{"xyz_m": [{}, {}, {}], "quat_wxyz": [{}, {}, {}, {}]}}"#,
        t.x, t.y, t.z, q.w, q.i, q.j, q.k
    )
}

/// The file beside the points of a camera of known pose.
fn posed() -> String {
    format!("{{{LENS}, {}}}", pose_json())
}

/// The file beside the points of a camera of unknown pose.
fn unposed() -> String {
    format!("{{{LENS}}}")
}

fn points(name: &str, text: &str, sidecar: &str) -> Result<Points, Error> {
    Points::read(name, text, Some(("camera.json", sidecar)), None, &Map::default())
}

fn asked(texts: &[String], sidecar: &str, known: &str) -> Result<Investigation, Error> {
    let files: Vec<Points> = texts
        .iter()
        .enumerate()
        .map(|(i, text)| points(&format!("points_{i}.csv"), text, sidecar))
        .collect::<Result<_, _>>()?;
    let twin = ModelFile::read(&format!("twin t of kitchen {{ {known} }}")).unwrap();
    investigate(&files, None, twin.effects(), &Options::default(), &mut |_, _| {})
}

fn found(texts: &[String], sidecar: &str) -> Finding {
    asked(texts, sidecar, "").unwrap().finding
}

/// Names in order of the alphabet.
fn names(finding: &Finding) -> Vec<&str> {
    let mut names: Vec<&str> = finding.effects.iter().map(|effect| effect.name.as_str()).collect();
    names.sort_unstable();
    names
}

/// Asserts that a fitted number is the true one, within its own uncertainty.
fn assert_number(effect: &Effect, parameter: &str, component: usize, truth: f64) {
    let found = &effect.parameters[parameter];
    let (value, std) = match (&found.value, &found.std) {
        (Value::Number(value), Value::Number(std)) => (*value, *std),
        (Value::Vector(values), Value::Vector(stds)) => (values[component], stds[component]),
        other => panic!("{other:?}"),
    };
    assert!(std > 0.0, "{parameter} of {} was not fitted", effect.name);
    assert!((value - truth).abs() < 4.5 * std, "{parameter}: {value} ± {std}, truly {truth}");
}
