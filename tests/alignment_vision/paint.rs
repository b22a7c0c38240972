//! A small painter of test pictures: tables, dots, boxes, cylinders and clear things with known poses.
//!
//! It shares the camera model with the program and nothing else: faces are drawn back to front as polygons
//! from the solids' own corners, four samples to the pixel, with shading, light that falls off, and noise.

use image::{Rgb, RgbImage};
use nalgebra::Vector3;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use trueup::world::frame::{Object as ObjectFrame, World};
use trueup::world::{Camera, Material, Object, Point, Pose, Scene, Shape};

pub(super) struct Light {
    pub gain: f64,
    /// Relative fall-off from left to right and from top to bottom.
    pub slope: [f64; 2],
    /// Standard deviation of the noise, grey levels.
    pub noise: f64,
    pub seed: u64,
}

impl Light {
    pub(super) fn even(seed: u64) -> Self {
        Self { gain: 1.0, slope: [0.0, 0.0], noise: 1.5, seed }
    }
}

pub(super) struct Painter<'a> {
    camera: &'a Camera,
    /// Twice the size, linear in sRGB values.
    pixels: Vec<[f64; 3]>,
    width: usize,
    height: usize,
}

type P3 = Vector3<f64>;

impl<'a> Painter<'a> {
    pub(super) fn new(camera: &'a Camera, background: [u8; 3]) -> Self {
        let width = 2 * camera.intrinsics.width as usize;
        let height = 2 * camera.intrinsics.height as usize;
        let pixels = vec![background.map(f64::from); width * height];
        Self { camera, pixels, width, height }
    }

    /// Fills a polygon given by image points (px), mixing by `alpha`.
    pub(super) fn polygon(&mut self, points: &[(f64, f64)], colour: [f64; 3], alpha: f64) {
        let fine: Vec<(f64, f64)> =
            points.iter().map(|&(u, v)| (2.0 * u + 0.5, 2.0 * v + 0.5)).collect();
        let top = fine.iter().map(|p| p.1).fold(f64::INFINITY, f64::min).ceil().max(0.0) as usize;
        let bottom = fine.iter().map(|p| p.1).fold(f64::NEG_INFINITY, f64::max);
        for y in top..self.height {
            if y as f64 > bottom {
                break;
            }
            let mut cuts: Vec<f64> = Vec::new();
            for i in 0..fine.len() {
                let (a, b) = (fine[i], fine[(i + 1) % fine.len()]);
                if (a.1 <= y as f64) != (b.1 <= y as f64) {
                    cuts.push(a.0 + (y as f64 - a.1) / (b.1 - a.1) * (b.0 - a.0));
                }
            }
            cuts.sort_by(f64::total_cmp);
            for pair in cuts.chunks_exact(2) {
                let from = pair[0].ceil().max(0.0) as usize;
                let to = pair[1].floor().min(self.width as f64 - 1.0);
                if to < from as f64 {
                    continue;
                }
                for x in from..=to as usize {
                    let pixel = &mut self.pixels[y * self.width + x];
                    for c in 0..3 {
                        pixel[c] = pixel[c] * (1.0 - alpha) + colour[c] * alpha;
                    }
                }
            }
        }
    }

    /// Fills a polygon of world points.
    pub(super) fn face(&mut self, points: &[P3], colour: [f64; 3], alpha: f64) {
        let pixels: Vec<(f64, f64)> = points
            .iter()
            .filter_map(|&p| self.camera.project(Point::from(p)))
            .map(|p| (p.u, p.v))
            .collect();
        if pixels.len() == points.len() {
            self.polygon(&pixels, colour, alpha);
        }
    }

    /// Draws a line of some width between world points.
    pub(super) fn line(&mut self, from: P3, to: P3, width: f64, colour: [f64; 3], alpha: f64) {
        let (Some(a), Some(b)) =
            (self.camera.project(Point::from(from)), self.camera.project(Point::from(to)))
        else {
            return;
        };
        let length = a.distance(b).max(1e-9);
        let (nx, ny) = (-(b.v - a.v) / length * width / 2.0, (b.u - a.u) / length * width / 2.0);
        let quad = [
            (a.u + nx, a.v + ny),
            (b.u + nx, b.v + ny),
            (b.u - nx, b.v - ny),
            (a.u - nx, a.v - ny),
        ];
        self.polygon(&quad, colour, alpha);
    }

    pub(super) fn table(&mut self, scene: &Scene) {
        // Fine subdivision lets the lens bend the table's edge.
        let corners = scene.table.corners();
        let mut edge = Vec::new();
        for i in 0..4 {
            let (a, b) = (corners[i], corners[(i + 1) % 4]);
            for k in 0..20 {
                let t = f64::from(k) / 20.0;
                edge.push(P3::new(a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, 0.0));
            }
        }
        self.face(&edge, scene.table.colour.map(f64::from), 1.0);
        for mark in &scene.marks {
            self.disc(mark.x, mark.y, mark.radius, [30.0, 30.0, 32.0]);
        }
    }

    pub(super) fn disc(&mut self, x: f64, y: f64, radius: f64, colour: [f64; 3]) {
        let ring = circle(&Pose::upright(x, y, 0.0, 0.0), radius, 0.0);
        self.face(&ring, colour, 1.0);
    }

    pub(super) fn object(&mut self, object: &Object, pose: &Pose<World, ObjectFrame>) {
        let colour = object.colour.map(f64::from);
        let clear = object.material == Material::Transparent;
        match object.shape {
            Shape::Cuboid { size } => self.cuboid(size, pose, colour, clear),
            Shape::Cylinder { radius, height } => self.cylinder(radius, height, pose, colour),
            _ => panic!("this renderer knows boxes and cylinders"),
        }
    }

    fn cuboid(&mut self, size: P3, pose: &Pose<World, ObjectFrame>, colour: [f64; 3], clear: bool) {
        let corner = |i: usize| {
            let s =
                |bit: usize, length: f64| if i & bit == 0 { -length / 2.0 } else { length / 2.0 };
            let z = if i & 4 == 0 { 0.0 } else { size.z };
            (*pose * Point::new(s(1, size.x), s(2, size.y), z)).coords()
        };
        let faces = [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [4, 5, 7, 6]];
        let normals = [-pose.axis(0), pose.axis(0), -pose.axis(1), pose.axis(1), pose.axis(2)];
        let eye = self.camera.world_from_camera.origin();
        let sun = Vector3::new(0.5, 0.3, 0.8).normalize();
        for front in [false, true] {
            for (face, normal) in faces.iter().zip(normals) {
                let points = face.map(corner);
                if (normal.dot(&(eye - points[0])) > 0.0) != front || (!front && !clear) {
                    continue;
                }
                if clear {
                    self.face(&points, [205.0, 222.0, 225.0], 0.10);
                    for i in 0..4 {
                        let (a, b) = (points[i], points[(i + 1) % 4]);
                        self.line(a, b, 1.6, [235.0, 240.0, 242.0], 0.30);
                    }
                } else {
                    let shade = 0.55 + 0.45 * normal.dot(&sun).max(0.0);
                    self.face(&points, colour.map(|c| c * shade), 1.0);
                }
            }
        }
    }

    fn cylinder(
        &mut self,
        radius: f64,
        height: f64,
        pose: &Pose<World, ObjectFrame>,
        colour: [f64; 3],
    ) {
        let eye = self.camera.world_from_camera.origin();
        let sun = Vector3::new(0.5, 0.3, 0.8).normalize();
        let strip = |i: usize| {
            let a = std::f64::consts::TAU * i as f64 / 180.0;
            let p = |z: f64| (*pose * Point::new(radius * a.cos(), radius * a.sin(), z)).coords();
            (p(0.0), p(height), pose.axis(0) * a.cos() + pose.axis(1) * a.sin())
        };
        for i in 0..180 {
            let (a0, a1, normal) = strip(i);
            let (b0, b1, _) = strip(i + 1);
            if normal.dot(&(eye - a0)) > 0.0 {
                let shade = 0.55 + 0.45 * normal.dot(&sun).max(0.0);
                self.face(&[a0, b0, b1, a1], colour.map(|c| c * shade), 1.0);
            }
        }
        let rim = circle(pose, radius, height);
        self.face(&rim, colour.map(|c| c * 1.0), 1.0);
        let inside = circle(pose, radius - 0.004, height);
        self.face(&inside, colour.map(|c| c * 0.45), 1.0);
    }

    /// A shaded ball.
    pub(super) fn ball(&mut self, centre: P3, radius: f64, colour: [u8; 3]) {
        let eye = self.camera.world_from_camera.origin();
        let sun = Vector3::new(0.5, 0.3, 0.8).normalize();
        let mid = self.camera.project(Point::from(centre)).unwrap();
        let size = self.camera.intrinsics.fx * radius / (centre - eye).norm() * 1.4 + 2.0;
        for y in (2.0 * (mid.v - size)) as usize..(2.0 * (mid.v + size)) as usize {
            for x in (2.0 * (mid.u - size)) as usize..(2.0 * (mid.u + size)) as usize {
                if x >= self.width || y >= self.height {
                    continue;
                }
                let pixel =
                    trueup::world::Pixel::new((x as f64 - 0.5) / 2.0, (y as f64 - 0.5) / 2.0);
                let ray = self.camera.ray(pixel);
                let along = ray.direction.dot(&(centre - eye));
                let off = (centre - eye).norm_squared() - along * along;
                if off < radius * radius {
                    let hit = eye + ray.direction * (along - (radius * radius - off).sqrt());
                    let shade = 0.5 + 0.5 * ((hit - centre) / radius).dot(&sun).max(0.0);
                    self.pixels[y * self.width + x] = colour.map(|c| f64::from(c) * shade);
                }
            }
        }
    }

    pub(super) fn finish(self, light: &Light) -> RgbImage {
        let mut rng = StdRng::seed_from_u64(light.seed);
        let (w, h) = (self.width / 2, self.height / 2);
        RgbImage::from_fn(w as u32, h as u32, |x, y| {
            let (x, y) = (x as usize, y as usize);
            let fall = light.gain
                * (1.0 + light.slope[0] * (x as f64 / w as f64 - 0.5))
                * (1.0 + light.slope[1] * (y as f64 / h as f64 - 0.5));
            let mut value = [0.0; 3];
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let p = self.pixels[(2 * y + dy) * self.width + 2 * x + dx];
                for c in 0..3 {
                    value[c] += 0.25 * p[c];
                }
            }
            Rgb(value.map(|v| {
                let u: f64 = rng.random::<f64>().max(1e-12);
                let t: f64 = rng.random();
                let gauss = (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * t).cos();
                (v * fall + light.noise * gauss).round().clamp(0.0, 255.0) as u8
            }))
        })
    }
}

fn circle(pose: &Pose<World, ObjectFrame>, radius: f64, z: f64) -> Vec<P3> {
    (0..120)
        .map(|i| {
            let a = std::f64::consts::TAU * f64::from(i) / 120.0;
            (*pose * Point::new(radius * a.cos(), radius * a.sin(), z)).coords()
        })
        .collect()
}

/// The camera as it really stands in these tests: off the guess in place, direction, lens.
pub(super) fn true_camera() -> Camera {
    use trueup::world::Intrinsics;
    let mut intrinsics = Intrinsics::centred(921.0, 1280, 720);
    intrinsics.cx += 9.0;
    intrinsics.cy -= 6.0;
    intrinsics.k1 = -0.06;
    intrinsics.k2 = 0.01;
    Camera::looking(intrinsics, Vector3::new(1.27, 0.02, 0.83), Vector3::new(0.58, -0.02, 0.04))
}
