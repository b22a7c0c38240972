//! The paper's Table 1 in one laboratory: how far the corners of a cube are from where a map of the twin's picture puts them.
//!
//! The camera of a laboratory stands and sees otherwise than the twin's. From the dots on the table in one photograph each form of
//! the map is fitted (regression 1); then the corners of a cube, whose size and place are known, are found on the contour
//! in the same photograph, and compared with the twin's corners under each map. The corners are those of the cube's
//! silhouette, six of its eight, as the paper has it. The twin's are computed, not looked for in a drawn picture.
//!
//! A map of the table's plane cannot put what stands above it exactly; a camera that is fitted can. It is told beside the
//! maps, since that is what a run uses.
//!
//! Source: Zeng, Zhao and Wu, section 3.1 and Table 1.

use nalgebra::Vector3;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde::Serialize;

use crate::alignment::image_map::{self, Model, NoiseIn, Pair, fit_map};
use crate::alignment::marks::find_marks;
use crate::alignment::vision::{self, Sighting};
use crate::execution::calibrate::{Switches, from_marks};
use crate::language::Source;
use crate::world::{Camera, Pixel, Point, Pose, Scene, Shape, frame};

use super::error::NoCorners;
use super::{Options, devices};

/// The scene with the cube, in the stdlib; not among the scenes that a cell may be opened with by itself.
const SCENE: &str = "paper/cube.task";
/// The cube's name in it.
const CUBE: &str = "cube";
/// Where the cube is put: x and y, m, where a jar stands in the kitchen and no dot is, and the turn, rad, of which a square
/// has no more.
const X: [f64; 2] = [0.50, 0.68];
const Y: [f64; 2] = [-0.18, 0.18];
const YAW: [f64; 2] = [0.0, std::f64::consts::FRAC_PI_2];
/// A corner on the contour is the one that is seen within this distance of it, px: a tenth of the cube's side in the picture
/// (about 75 px). With twice as much a corner of the far side may be taken for one of the near.
const NEAR_PX: f64 = 7.5;
/// Corners that a cube's silhouette has, and as many as must be found of them.
pub const CORNERS: usize = 6;

/// How far one way of putting the twin's corners into the real picture is off.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Miss {
    /// The way: `none`, the name of a form, or `camera`, fitted as in a run.
    pub way: &'static str,
    /// Its degrees of freedom.
    pub dof: usize,
    /// Mean square distance at the corners, px².
    pub mse_px2: f64,
    /// Mean distance at the corners, px: what the paper's text calls its error.
    pub error_px: f64,
    /// Root mean square distance at the dots it was fitted to, px.
    pub dots_rms_px: f64,
}

/// Table 1 in one laboratory.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Corners {
    /// The laboratory.
    pub seed: u64,
    /// How many dots the maps rest on.
    pub dots: usize,
    /// How many corners were found on the contour.
    pub corners: usize,
    /// The ways, fewest degrees of freedom first.
    pub ways: Vec<Miss>,
}

/// Looks at the cube in the laboratory of these options; their scene is left aside.
///
/// # Errors
///
/// [`NoCorners`]: the laboratory cannot be opened, its dots do not give a map, or the cube is not seen with all its corners.
pub fn corners(mut options: Options) -> Result<Corners, NoCorners> {
    let seed = options.seed;
    let mut random = StdRng::seed_from_u64(seed);
    let mut draw = |[from, to]: [f64; 2]| random.random_range(from..to);
    let (x, y, yaw) = (draw(X), draw(Y), draw(YAW));
    options.put(CUBE, x, y, yaw);
    let text = options.stdlib.file(SCENE).unwrap_or_default().to_owned();
    options.scene = Some(Source::new(SCENE, text));
    let (_, scene, robot) = devices::place(&mut options)?;
    let mut devices = devices::simulated(&robot, &scene, options.lab.clone(), seed)?;
    let photo = devices.camera.photo()?;

    let twin = scene.camera;
    let dots = find_marks(&photo, &scene, &twin)?;
    let pair = |seen: &crate::alignment::marks::MarkSighting| {
        let mark = &scene.marks[seen.mark_idx];
        Some(Pair { real: seen.pixel, twin: twin.project(Point::new(mark.x, mark.y, 0.0))? })
    };
    let pairs: Vec<Pair> = dots.iter().filter_map(pair).collect();
    // The twin's pixels are computed, so the real picture alone has noise.
    let exact = image_map::Options { noise: NoiseIn::Real, seed, ..image_map::Options::default() };
    let agreed = fit_map(&pairs, Model::Projective, &exact)?;
    let kept: Vec<Pair> = (0..pairs.len())
        .filter(|i| agreed.outliers.binary_search(i).is_err())
        .map(|i| pairs[i])
        .collect();

    let camera = from_marks(&photo, &scene, Switches::default())?.camera;
    let pose = Pose::upright(x, y, 0.0, yaw);
    let seen = vision::see(&photo, &camera, &scene, &vision::Options::default())?;
    let cube = seen.iter().find(|sighting| sighting.name == CUBE);
    let real = on_the_contour(cube, &camera, &scene, &pose)?;
    let of = |view: &Camera| -> Vec<Pair> {
        let seen = real
            .iter()
            .filter_map(|(corner, real)| Some(Pair { real: *real, twin: view.project(*corner)? }));
        seen.collect()
    };
    let of_twin = of(&twin);
    let mut ways = vec![miss("none", 0, &of_twin, &kept, &|p| Some(p))];
    let plain = image_map::Options { robust: false, ..exact };
    for form in Model::FORMS {
        let map = fit_map(&kept, form, &plain)?;
        ways.push(miss(form.name(), form.dof(), &of_twin, &kept, &|p| map.apply(p)));
    }
    let on_dots: Vec<Pair> = dots
        .iter()
        .filter_map(|seen| {
            let mark = &scene.marks[seen.mark_idx];
            Some(Pair { real: seen.pixel, twin: camera.project(Point::new(mark.x, mark.y, 0.0))? })
        })
        .collect();
    ways.push(miss("camera", CAMERA_DOF, &of(&camera), &on_dots, &|p| Some(p)));
    Ok(Corners { seed, dots: kept.len(), corners: real.len(), ways })
}

/// What a run fits of a camera at most: its pose (6), the focal length, the principal point (2) and one radial term.
const CAMERA_DOF: usize = 10;

fn miss(
    way: &'static str,
    dof: usize,
    corners: &[Pair],
    dots: &[Pair],
    map: &dyn Fn(Pixel) -> Option<Pixel>,
) -> Miss {
    let far = |pairs: &[Pair]| -> Vec<f64> {
        let far = |p: &Pair| map(p.twin).map_or(f64::INFINITY, |at| at.distance(p.real));
        pairs.iter().map(far).collect()
    };
    let mean = |all: &[f64], of: fn(f64) -> f64| {
        all.iter().map(|far| of(*far)).sum::<f64>() / all.len().max(1) as f64
    };
    let at_corners = far(corners);
    Miss {
        way,
        dof,
        mse_px2: mean(&at_corners, |far| far * far),
        error_px: mean(&at_corners, |far| far),
        dots_rms_px: mean(&far(dots), |far| far * far).sqrt(),
    }
}

/// The corners of the cube that were measured on its contour: where they are, and where they are seen.
fn on_the_contour(
    cube: Option<&Sighting>,
    camera: &Camera,
    scene: &Scene,
    pose: &Pose<frame::World, frame::Object>,
) -> Result<Vec<(Point<frame::World>, Pixel)>, NoCorners> {
    let Some(cube) = cube.filter(|cube| cube.found && cube.checks.measured) else {
        let why = cube.and_then(|cube| cube.reason.clone()).unwrap_or_default();
        return Err(NoCorners::NotSeen(why));
    };
    let Some(Shape::Cuboid { size }) = scene.object(CUBE).map(|object| &object.shape) else {
        return Err(NoCorners::NotSeen(String::new()));
    };
    let signs = [-0.5, 0.5];
    let all = signs.iter().flat_map(|x| signs.iter().map(move |y| (*x, *y)));
    let all = all.flat_map(|(x, y)| [0.0, 1.0].map(|z| Vector3::new(x, y, z).component_mul(size)));
    let mut found = Vec::new();
    for corner in all {
        let corner = *pose * Point::<frame::Object>::from(corner);
        let Some(expected) = camera.project(corner) else { continue };
        let points = cube.key_points.iter().map(|&[u, v]| Pixel::new(u, v));
        let nearest = points.min_by(|a, b| a.distance(expected).total_cmp(&b.distance(expected)));
        found.extend(
            nearest.filter(|pixel| pixel.distance(expected) < NEAR_PX).map(|pixel| (corner, pixel)),
        );
    }
    if found.len() == CORNERS { Ok(found) } else { Err(NoCorners::Few(found.len())) }
}
