//! What the picture shows on the table that no object of the scene explains.
//!
//! Bare table has one colour up to its light, so the chromaticity of a pixel tells what is not table and leaves shadows
//! alone. What is in the table's colour, or clear as glass, is not noticed. A region whose outline is that of a
//! box or a can is measured. Any other is bounded: what stands somewhere under it is inside a cylinder over its extent on
//! the table, at most so high as the region is long in the direction of view.

use image::{GrayImage, Luma};
use imageproc::region_labelling::{Connectivity, connected_components};
use nalgebra::Vector2;
use rayon::prelude::*;

use super::{Look, Options, Sighting};
use crate::alignment::measure::{Measured, Unmeasured, measure_in};
use crate::alignment::outline::{Outline, Projector, inside_convex};
use crate::alignment::picture::QUARTER;
use crate::world::{Camera, Form, Mark, Pixel, Scene, Shape, Unknown};

/// From so many spreads on a colour is not the table's: of normal noise one pixel in five hundred million is, and wood
/// has streaks of twice its spread.
const NOT_TABLE: f64 = 6.0;
/// Added to the spread of the table's chromaticity: a grey value of 8 bits is a hundredth of it in the shade.
const LEAST_SPREAD: f32 = 0.004;
/// So far around a known object nothing is said, px: its outline is known to a few pixels, and what it reflects and
/// refracts is around it.
const AROUND_KNOWN_PX: f64 = 24.0;
/// The same around a printed dot, m.
const AROUND_MARK: f64 = 0.012;
/// The same along the edge of the table, m.
const AROUND_EDGE: f64 = 0.02;
/// The same around the axis of the arm's base, m: its foot is 7 cm wide (`gen3_2f85.urdf`), cables and bolts are beside
/// it, and nothing that stands there can be worked with.
const AROUND_BASE: f64 = 0.20;
/// The smallest region that is told, m²: a cube of 2 cm.
const LEAST_AREA: f64 = 4e-4;
/// A thing is where it was if the box around it in the picture is, to so much, px: three of the pixels that regions are made
/// of.
const AS_BEFORE_PX: f64 = 3.0 * QUARTER;
/// Points of an edge of a solid: its corners, and one between.
const CORNERS: usize = 2;
/// Nothing on a table is taken to be higher, m.
const HIGHEST: f64 = 0.4;

impl Look<'_> {
    /// Returns what is on the table and in no sighting, largest first, with its form where its outline tells. `before` is what
    /// an earlier picture showed: what is where it was is not measured again. When the look is stopped the rest is left out.
    pub fn unexplained(
        &self,
        sightings: &[Sighting],
        options: &Options,
        before: &[Unknown],
    ) -> Vec<Unknown> {
        let regions = self.unexplained_regions(sightings, options).into_iter();
        let known = regions.take_while(|_| !self.is_stopped()).map(|region| {
            let is_same = |it: &&Unknown| is_there(it, &self.view, region.in_picture);
            if let Some(same) = before.iter().find(is_same) {
                return same.clone();
            }
            self.measured_in(region.in_picture).map_or(region.bound, Measured::bound)
        });
        known.collect()
    }

    /// Returns what bounds the things that were not found although they fit at their likeliest places: each as it would stand
    /// there. The arm has to keep clear of them, and they are nothing that the scene does not declare.
    pub fn doubted(&self, sightings: &[Sighting]) -> Vec<Unknown> {
        let bound = |sighting: &Sighting| {
            let world_from_object = sighting.doubted()?;
            let object = self.scene.object(&sighting.name)?;
            let (radius, height) = (object.shape.outer_radius(), object.shape.height());
            let shape = match &object.shape {
                Shape::Cuboid { size } => Shape::Cuboid { size: *size },
                _ => Shape::Cylinder { radius, height },
            };
            let within = 2.0 * sighting.std_if_there;
            Some(Unknown {
                at: world_from_object.origin().xy().into(),
                radius: radius + within,
                height: height + within,
                form: Some(Form { shape, world_from_object, within, colour: object.colour }),
            })
        };
        sightings.iter().filter_map(bound).collect()
    }

    /// Measures what stands in a box of the picture, `[u0, v0, u1, v1]` px, as [`Self::unexplained_regions`] finds it.
    ///
    /// # Errors
    ///
    /// As [`measure_in`].
    pub fn measured_in(&self, in_picture: [f64; 4]) -> Result<Measured, Unmeasured> {
        measure_in(&self.picture, self.image, self.camera, in_picture)
    }

    /// As [`Self::unexplained`], unmeasured, with the box of each in the picture.
    pub fn unexplained_regions(
        &self,
        sightings: &[Sighting],
        options: &Options,
    ) -> Vec<Unexplained> {
        let Self { picture, camera, scene, .. } = self;
        if picture.is_grey {
            return Vec::new();
        }
        let (w, h) = (picture.small[0].width, picture.small[0].height);
        let known = Known::of(sightings);
        let ground = |x: usize, y: usize| -> Option<Vector2<f64>> {
            let pixel = Pixel { u: QUARTER * x as f64 + 1.5, v: QUARTER * y as f64 + 1.5 };
            if is_ignored(pixel, options) || known.explains(pixel) {
                return None;
            }
            let at = camera.on_plane(pixel, 0.0)?.coords().xy();
            let is_open = scene.table.holds(at.x, at.y, AROUND_EDGE) && !is_furniture(at, scene);
            is_open.then_some(at)
        };
        let open: Vec<(usize, usize, Vector2<f64>)> = (0..h)
            .into_par_iter()
            .flat_map_iter(|y| (0..w).filter_map(move |x| Some((x, y, ground(x, y)?))))
            .collect();
        let bare: Vec<(f32, f32)> = picture
            .chromaticity
            .iter()
            .map(|plane| middle(open.iter().map(|(x, y, _)| plane.data[y * w + x]).collect()))
            .collect();
        let mut other = GrayImage::new(w as u32, h as u32);
        for (x, y, _) in &open {
            let far = picture.chromaticity.iter().zip(&bare).map(|(plane, (middle, spread))| {
                f64::from((plane.data[y * w + x] - middle) / (spread + LEAST_SPREAD))
            });
            if far.fold(0.0, f64::hypot) > NOT_TABLE {
                other.put_pixel(*x as u32, *y as u32, Luma([255]));
            }
        }
        bounded(&other, &open, camera)
    }
}

/// Whether a thing that was measured before, standing where it stood, is what a box of the picture (`[u0, v0, u1, v1]`, px)
/// shows.
fn is_there(before: &Unknown, view: &Projector, in_picture: [f64; 4]) -> bool {
    before.form.as_ref().is_some_and(|form| {
        let hull = Outline::new(view, &form.shape, &form.world_from_object, CORNERS).hull;
        let ends = |of: fn(f64, f64) -> f64| {
            hull.iter().copied().reduce(|a, b| Vector2::new(of(a.x, b.x), of(a.y, b.y)))
        };
        let [u0, v0, u1, v1] = in_picture;
        ends(f64::min).zip(ends(f64::max)).is_some_and(|(low, high)| {
            let off = [low.x - u0, low.y - v0, high.x - u1, high.y - v1];
            off.iter().all(|off| off.abs() < AS_BEFORE_PX)
        })
    })
}

/// What no sighting explains: where it may be, and where it is in the picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Unexplained {
    /// What bounds it on the table.
    pub bound: Unknown,
    /// Its box in the picture, `[u0, v0, u1, v1]`, px.
    pub in_picture: [f64; 4],
}

/// The outlines of what is seen, kept, or not found where it fits.
struct Known {
    /// Their corners, px, in order, and the box around them, `[u0, v0, u1, v1]`.
    hulls: Vec<(Vec<Vector2<f64>>, [f64; 4])>,
}

impl Known {
    fn of(sightings: &[Sighting]) -> Self {
        let is_known = |sighting: &&Sighting| {
            sighting.found || sighting.kept.is_some() || sighting.doubted().is_some()
        };
        let hull = |sighting: &Sighting| {
            let corners: Vec<Vector2<f64>> =
                sighting.hull.iter().map(|c| Vector2::from(*c)).collect();
            let nowhere = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
            let around = corners
                .iter()
                .fold(nowhere, |b, p| [b[0].min(p.x), b[1].min(p.y), b[2].max(p.x), b[3].max(p.y)]);
            (corners, around)
        };
        Self { hulls: sightings.iter().filter(is_known).map(hull).collect() }
    }

    /// Whether a pixel is in one of them, or so near that it may be its reflection.
    fn explains(&self, pixel: Pixel) -> bool {
        let p = Vector2::new(pixel.u, pixel.v);
        self.hulls.iter().any(|(hull, [u0, v0, u1, v1])| {
            let is_near = p.x > u0 - AROUND_KNOWN_PX - 1.0
                && p.y > v0 - AROUND_KNOWN_PX - 1.0
                && p.x < u1 + AROUND_KNOWN_PX + 1.0
                && p.y < v1 + AROUND_KNOWN_PX + 1.0;
            is_near && distance_to(hull, p) < AROUND_KNOWN_PX
        })
    }
}

/// Whether a pixel is not to be judged.
fn is_ignored(pixel: Pixel, options: &Options) -> bool {
    let (u, v) = (pixel.u.max(0.0) as u32, pixel.v.max(0.0) as u32);
    options
        .ignore
        .as_ref()
        .is_some_and(|mask| u < mask.width() && v < mask.height() && mask.get_pixel(u, v)[0] > 0)
}

/// Whether a place of the table is the arm's foot, or one of the dots.
fn is_furniture(at: Vector2<f64>, scene: &Scene) -> bool {
    let is_on =
        |mark: &Mark| (at - Vector2::new(mark.x, mark.y)).norm() < mark.radius + AROUND_MARK;
    (at - scene.world_from_base.origin().xy()).norm() < AROUND_BASE || scene.marks.iter().any(is_on)
}

/// Returns how far a point is outside a convex outline, px; 0 inside.
fn distance_to(corners: &[Vector2<f64>], p: Vector2<f64>) -> f64 {
    if corners.len() < 3 {
        return f64::INFINITY;
    }
    if inside_convex(corners, p) {
        return 0.0;
    }
    let sides = corners.iter().zip(corners.iter().cycle().skip(1));
    let apart = sides.map(|(a, b)| {
        let along = (b - a).dot(&(p - a)) / (b - a).norm_squared().max(1e-12);
        (p - a - (b - a) * along.clamp(0.0, 1.0)).norm()
    });
    apart.fold(f64::INFINITY, f64::min)
}

/// Returns the median and the robust standard deviation.
fn middle(mut values: Vec<f32>) -> (f32, f32) {
    if values.is_empty() {
        return (0.0, 1.0);
    }
    let half = values.len() / 2;
    let middle = *values.select_nth_unstable_by(half, f32::total_cmp).1;
    let mut off: Vec<f32> = values.iter().map(|value| (value - middle).abs()).collect();
    // 1.4826: the standard deviation over the median of absolute deviations of a normal distribution.
    (middle, 1.4826 * *off.select_nth_unstable_by(half, f32::total_cmp).1)
}

/// Bounds each connected region by a cylinder on the table.
fn bounded(
    other: &GrayImage,
    open: &[(usize, usize, Vector2<f64>)],
    camera: &Camera,
) -> Vec<Unexplained> {
    let labels = connected_components(other, Connectivity::Eight, Luma([0]));
    let count = labels.pixels().map(|label| label[0]).max().unwrap_or(0) as usize;
    let nowhere = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    let mut regions: Vec<(Vec<Vector2<f64>>, [f64; 4])> = vec![(Vec::new(), nowhere); count + 1];
    for (x, y, at) in open {
        let label = labels.get_pixel(*x as u32, *y as u32)[0] as usize;
        if label > 0 {
            let (region, [u0, v0, u1, v1]) = &mut regions[label];
            region.push(*at);
            let (u, v) = (QUARTER * *x as f64, QUARTER * *y as f64);
            (*u0, *v0) = (u0.min(u), v0.min(v));
            (*u1, *v1) = (u1.max(u + QUARTER - 1.0), v1.max(v + QUARTER - 1.0));
        }
    }
    let eye = camera.world_from_camera.origin();
    let mut found: Vec<Unexplained> = Vec::new();
    for (region, in_picture) in &regions {
        let Some(first) = region.first() else { continue };
        let (low, high) =
            region.iter().fold((*first, *first), |(low, high), p| (low.inf(p), high.sup(p)));
        let centre = 0.5 * (low + high);
        // A pixel covers the more table the farther and the flatter it is seen.
        let ray = nalgebra::Vector3::new(centre.x, centre.y, 0.0) - eye;
        let side = QUARTER * ray.norm() / camera.intrinsics.fx;
        let area = region.len() as f64 * side * side * ray.norm() / ray.z.abs().max(1e-6);
        if area < LEAST_AREA {
            continue;
        }
        let radius = region.iter().map(|p| (p - centre).norm()).fold(0.0, f64::max);
        let away = ray.xy().try_normalize(1e-9).unwrap_or_else(Vector2::x);
        let along = region.iter().map(|p| (p - centre).dot(&away));
        let (near, far) = along
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(near, far), d| (near.min(d), far.max(d)));
        let slope = eye.z / ray.xy().norm().max(1e-6);
        let height = ((far - near) * slope).clamp(0.0, HIGHEST);
        let bound = Unknown { at: centre.into(), radius, height, form: None };
        found.push(Unexplained { bound, in_picture: *in_picture });
    }
    found.sort_by(|a, b| b.bound.radius.total_cmp(&a.bound.radius));
    found
}
