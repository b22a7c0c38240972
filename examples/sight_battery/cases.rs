//! What is asked of each picture: the objects that a scene declares, where they stand, and which are not there.

use std::path::Path;

use image::RgbImage;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use trueup::world::{
    Camera, Intrinsics, Material, Object, Pixel, Point, Pose, Profile, Scene, Shape, Table,
};

use crate::forms;
use crate::photos::{Clear, Ground};
use crate::trace::{Body, Paint, Thing, draw};
use crate::visp;

/// A picture, what a scene says of it, and the truth.
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) image: RgbImage,
    pub(crate) scene: Scene,
    /// For each object the places that are right, m; none when it is not there.
    pub(crate) truth: Vec<Vec<[f64; 2]>>,
}

pub(crate) fn object(name: &str, shape: Shape, colour: [u8; 3], material: Material) -> Object {
    Object {
        name: name.into(),
        kind: "Block".into(),
        shape,
        cavity: None,
        looks: name.into(),
        material,
        colour,
        mass: 0.2,
    }
}

fn scene(camera: Camera, table: Table, objects: Vec<Object>) -> Scene {
    Scene {
        name: "battery".into(),
        table,
        marks: Vec::new(),
        objects,
        drawers: Vec::new(),
        camera_name: "still".into(),
        camera,
        person: None,
        calibration: None,
        robot: "gen3_2f85".into(),
        world_from_base: Pose::identity(),
    }
}

fn cuboid(x: f64, y: f64, z: f64) -> Shape {
    Shape::Cuboid { size: Vector3::new(x, y, z) }
}

fn cylinder(radius: f64, height: f64) -> Shape {
    Shape::Cylinder { radius, height }
}

/// What scenes of the battery may declare: name, shape, colour, material.
pub(crate) fn catalogue() -> Vec<Object> {
    use Material::{Opaque, Transparent};
    vec![
        object("jar", cuboid(0.065, 0.065, 0.140), [220, 230, 230], Transparent),
        object("mug", cylinder(0.042, 0.100), [60, 90, 190], Opaque),
        object("gelatin box", cuboid(0.085, 0.073, 0.028), [190, 50, 40], Opaque),
        object("can", cylinder(0.033, 0.115), [60, 150, 80], Opaque),
        object("cube", cuboid(0.05, 0.05, 0.05), [220, 190, 60], Opaque),
        object("carton", cuboid(0.07, 0.07, 0.19), [230, 230, 225], Opaque),
        object("tumbler", cylinder(0.036, 0.110), [225, 230, 230], Transparent),
        object("bowl", cylinder(0.065, 0.05), [150, 90, 160], Opaque),
        object("book", cuboid(0.12, 0.17, 0.025), [90, 60, 50], Opaque),
        object("tin", cylinder(0.05, 0.14), [120, 120, 125], Opaque),
    ]
}

fn body(shape: &Shape) -> Body {
    match shape {
        Shape::Cuboid { size } => Body::Cuboid(*size),
        Shape::Lathe { profile } => Body::Lathe(points(profile, 1.0)),
        // Meshes and mugs are in no case.
        round => {
            Body::Lathe(vec![(round.inner_radius(), 0.0), (round.inner_radius(), round.height())])
        }
    }
}

/// The points (radius, height) of a profile, so many times as large.
fn points(profile: &Profile, by: f64) -> Vec<(f64, f64)> {
    profile.points().iter().map(|[r, z]| (by * r, by * z)).collect()
}

struct Chance(StdRng);

impl Chance {
    fn even(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    fn below(&mut self, n: usize) -> usize {
        (self.even(0.0, n as f64) as usize).min(n - 1)
    }

    fn colour(&mut self) -> [f64; 3] {
        [0; 3].map(|_| self.even(25.0, 235.0))
    }

    fn paint(&mut self) -> Paint {
        match self.below(6) {
            0 => Paint::Stripes(self.even(0.015, 0.04)),
            1 => Paint::Checks(self.even(0.012, 0.03)),
            2 => Paint::Blotches(self.even(0.01, 0.03)),
            3 => Paint::Label(0.25, self.even(0.55, 0.8)),
            _ => Paint::Plain,
        }
    }
}

/// The object as it looks: its colour within a lamp's mood, and something printed on it half of the time.
fn real(object: &Object, chance: &mut Chance) -> Thing {
    let mood = chance.even(0.85, 1.12);
    let paint = match object.material {
        Material::Transparent => Paint::Glass,
        Material::Opaque => chance.paint(),
    };
    Thing {
        body: body(&object.shape),
        at: [0.0; 2],
        yaw: chance.even(-1.5, 1.5),
        colour: object.colour.map(|c| f64::from(c) * mood),
        second: chance.colour(),
        paint,
        seed: chance.0.random(),
    }
}

/// Something that is not the object and may be taken for it.
fn other(object: &Object, chance: &mut Chance) -> Thing {
    let (wide, high) = (object.shape.inner_radius(), object.shape.height());
    let mut thing = real(object, chance);
    if matches!(thing.paint, Paint::Glass) && chance.below(2) == 0 {
        thing.paint = Paint::Blotches(0.02);
    }
    thing.body = match chance.below(5) {
        // The same shape in another size.
        0 => {
            let by =
                if chance.below(2) == 0 { chance.even(1.25, 1.5) } else { chance.even(0.6, 0.8) };
            body(&object.shape.scaled(by, by))
        }
        // A bottle of about its size.
        1 | 2 => Body::Lathe(vec![
            (wide, 0.0),
            (wide, 0.62 * high.max(0.09)),
            (0.4 * wide, 0.8 * high.max(0.09)),
            (0.4 * wide, high.max(0.09) * 1.1),
        ]),
        // An apple.
        3 => Body::Ball(Vector3::new(0.0, 0.0, wide.clamp(0.025, 0.045)), wide.clamp(0.025, 0.045)),
        // A cone of a cup.
        _ => Body::Lathe(vec![(0.62 * wide, 0.0), (1.15 * wide, high.max(0.06))]),
    };
    if chance.below(2) == 0 {
        thing.colour = chance.colour();
    }
    thing
}

/// A foot that is in view with all that stands on it, clear of the others.
fn spot(ground: &Ground, thing: &Thing, taken: &[Thing], chance: &mut Chance) -> Option<[f64; 2]> {
    let (reach, height) = (thing.reach(), thing.height());
    let (w, h) = (f64::from(ground.image.width()), f64::from(ground.image.height()));
    (0..400).find_map(|_| {
        let at = if ground.room.is_empty() {
            let corners = ground.table.corners();
            [chance.even(corners[0][0], corners[2][0]), chance.even(corners[0][1], corners[2][1])]
        } else {
            let [u0, v0, u1, v1] = ground.room[chance.below(ground.room.len())];
            let pixel = Pixel::new(chance.even(u0, u1), chance.even(v0, v1));
            let foot = ground.camera.on_plane(pixel, 0.0)?.coords();
            [foot.x, foot.y]
        };
        let shown = (0..8).all(|k| {
            let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_4).sin_cos();
            [0.0, height].iter().all(|&z| {
                let point = Point::new(at[0] + reach * cos, at[1] + reach * sin, z);
                ground
                    .camera
                    .project(point)
                    .is_some_and(|p| p.u > 5.0 && p.v > 5.0 && p.u < w - 6.0 && p.v < h - 6.0)
            })
        });
        let clear = taken.iter().all(|other| {
            (other.at[0] - at[0]).hypot(other.at[1] - at[1]) > other.reach() + reach + 0.01
        });
        (shown && clear && ground.table.holds(at[0], at[1], reach)).then_some(at)
    })
}

/// Paints things into a photograph or onto a table of our own: of what is declared half is not there.
pub(crate) fn painted(ground: &Ground, seed: u64) -> Case {
    let mut chance = Chance(StdRng::seed_from_u64(seed));
    let mut all = catalogue();
    let mut things: Vec<Thing> = Vec::new();
    let (mut objects, mut truth) = (Vec::new(), Vec::new());
    for k in 0..4 {
        let object = all.remove(chance.below(all.len()));
        let present = k % 2 == 0;
        let mut thing =
            if present { real(&object, &mut chance) } else { other(&object, &mut chance) };
        // Of what is absent a fifth has nothing in its stead.
        let stands = present || chance.below(5) > 0;
        if stands && let Some(at) = spot(ground, &thing, &things, &mut chance) {
            thing.at = at;
            truth.push(if present { vec![at] } else { Vec::new() });
            things.push(thing);
            objects.push(object);
        } else if !present {
            truth.push(Vec::new());
            objects.push(object);
        }
    }
    // One thing more that nobody asks for.
    let last = all.remove(chance.below(all.len()));
    let mut more =
        if seed.is_multiple_of(3) { hand(&mut chance) } else { vec![other(&last, &mut chance)] };
    if let Some(at) = spot(ground, &more[0], &things, &mut chance) {
        for part in &mut more {
            part.at = at;
        }
        things.append(&mut more);
    }
    Case {
        name: format!("painted {seed} on {}", ground.name),
        image: draw(&ground.camera, &ground.image, &things, seed),
        scene: scene(ground.camera, ground.table, objects),
        truth,
    }
}

/// A hand on the table: balls in rows.
fn hand(chance: &mut Chance) -> Vec<Thing> {
    let turn = chance.even(-3.0, 3.0);
    let skin = [205.0, 150.0, 120.0];
    let ball = |x: f64, y: f64, radius: f64| Thing {
        body: Body::Ball(Vector3::new(x, y, radius), radius),
        at: [0.0; 2],
        yaw: turn,
        colour: skin,
        second: skin,
        paint: Paint::Plain,
        seed: 0,
    };
    let palm = (0..5).map(|k| ball(0.01 * f64::from(k), 0.0, 0.03));
    let fingers = (0..4).flat_map(|f| {
        let side = 0.018 * (f64::from(f) - 1.5);
        (0..9).map(move |k| ball(0.05 + 0.007 * f64::from(k), side, 0.009))
    });
    palm.chain(fingers).collect()
}

/// A camera over a table of our own making.
pub(crate) fn own_ground(kind: usize, seed: u64) -> Ground {
    let mut chance = Chance(StdRng::seed_from_u64(seed ^ 0x5EED));
    let eye =
        Vector3::new(chance.even(-0.15, 0.15), chance.even(-0.85, -0.6), chance.even(0.45, 0.8));
    let camera =
        Camera::looking(Intrinsics::centred(900.0, 1280, 720), eye, Vector3::new(0.0, 0.05, 0.04));
    let table =
        Table { size: Vector3::new(0.8, 0.6, 0.02), centre: [0.0, 0.05], colour: [170, 160, 150] };
    let image = crate::trace::table(&camera, |x, y| table.holds(x, y, 0.0), kind, seed);
    let kinds = ["plain", "wood", "cloth", "tiles", "marble"];
    Ground { name: format!("own {}", kinds[kind.min(4)]), image, camera, table, room: Vec::new() }
}

/// The size of the square bottles in the first photograph, and where they stand, from its depth map.
const BOTTLE: [f64; 3] = [0.054, 0.054, 0.163];
const BOTTLES: [[f64; 2]; 3] = [[-0.084, -0.095], [0.019, -0.034], [0.179, -0.072]];

/// Cuts a bottle out of its photograph and puts it on another table: turned about the eye, the two tables' planes
/// meet, and a larger bottle farther off looks the same, so that the truth stays exact.
pub(crate) fn pasted(folder: &Path, ground: &Ground, which: usize, seed: u64) -> Option<Case> {
    let source = Clear::read(folder, "080")?;
    let (from, mask) = (source.image(folder, "opaque")?, source.mask(folder)?);
    let own = source.camera();
    let mut chance = Chance(StdRng::seed_from_u64(seed));
    let eye = [own, ground.camera].map(|c| c.world_from_camera.origin());
    let grown = eye[1].z / eye[0].z;
    // The mask's piece that holds the bottle's middle.
    let middle = own.project(Point::new(BOTTLES[which][0], BOTTLES[which][1], 0.07))?;
    let pieces = imageproc::region_labelling::connected_components(
        &mask,
        imageproc::region_labelling::Connectivity::Four,
        image::Luma([0]),
    );
    let label = pieces.get_pixel(middle.u as u32, middle.v as u32).0[0];
    for _ in 0..200 {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), chance.even(-3.1, 3.1));
        let rel = Vector3::new(BOTTLES[which][0], BOTTLES[which][1], 0.0) - eye[0].xy().push(0.0);
        let at = eye[1].xy().push(0.0) + grown * (turn * rel);
        let top = ground.camera.project(Point::new(at.x, at.y, grown * BOTTLE[2]));
        let foot = ground.camera.project(Point::new(at.x, at.y, 0.0));
        let (Some(top), Some(foot)) = (top, foot) else { continue };
        let (w, h) = (f64::from(ground.image.width()), f64::from(ground.image.height()));
        let inside = |p: Pixel| p.u > 60.0 && p.u < w - 60.0 && p.v > 25.0 && p.v < h - 30.0;
        let room = ground.room.is_empty()
            || ground
                .room
                .iter()
                .any(|r| foot.u > r[0] && foot.u < r[2] && foot.v > r[1] && foot.v < r[3]);
        if !inside(top) || !inside(foot) || !room || !ground.table.holds(at.x, at.y, 0.03) {
            continue;
        }
        let mut image = ground.image.clone();
        let grey = image.pixels().take(2000).all(|p| p.0[0] == p.0[1] && p.0[1] == p.0[2]);
        let back = Isometry3::from_parts(Vector3::zeros().into(), turn.inverse());
        for (x, y, pixel) in image.enumerate_pixels_mut() {
            let ray = ground.camera.ray(Pixel::new(f64::from(x), f64::from(y))).direction;
            let Some(p) = own.project(Point::from(eye[0] + back * ray)) else { continue };
            if p.u < 1.0 || p.v < 1.0 || p.u > 1278.0 || p.v > 718.0 {
                continue;
            }
            let (u, v) = (p.u.round() as u32, p.v.round() as u32);
            if mask.get_pixel(u, v).0[0] > 0 && pieces.get_pixel(u, v).0[0] == label {
                *pixel = image::Rgb(from.get_pixel(u, v).0);
                if grey {
                    let [r, g, b] = pixel.0.map(f64::from);
                    *pixel = image::Rgb([(0.299 * r + 0.587 * g + 0.114 * b) as u8; 3]);
                }
            }
        }
        let size = BOTTLE.map(|s| s * grown);
        let objects = vec![
            object("bottle", cuboid(size[0], size[1], size[2]), [130, 125, 120], Material::Opaque),
            object(
                "jar",
                cuboid(0.065 * grown, 0.065 * grown, 0.14 * grown),
                [220, 230, 230],
                Material::Transparent,
            ),
            object("can", cylinder(0.033 * grown, 0.115 * grown), [60, 150, 80], Material::Opaque),
        ];
        return Some(Case {
            name: format!("pasted {seed} bottle {which} on {}", ground.name),
            image,
            scene: scene(ground.camera, ground.table, objects),
            truth: vec![vec![[at.x, at.y]], Vec::new(), Vec::new()],
        });
    }
    None
}

/// Three of a kind, each of which may be any of those that are there.
fn three(object: &Object, places: &[[f64; 2]; 3]) -> Vec<(Object, Vec<[f64; 2]>)> {
    let named = |k: usize| Object { name: format!("{} {k}", object.name), ..object.clone() };
    (1..=3).map(|k| (named(k), places.to_vec())).collect()
}

/// How the things in the photographs of clear things are declared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Forms {
    /// As they are: bottles with necks, flowers, a tumbler that opens upwards.
    Own,
    /// As boxes and cylinders of about their sizes, which none of them is.
    Boxes,
}

/// The photographs as they are, once with what is there and once with what is not.
pub(crate) fn clear(
    folder: &Path,
    scene_name: &'static str,
    twin: &str,
    declared: Forms,
) -> Vec<Case> {
    let Some(photo) = Clear::read(folder, scene_name) else { return Vec::new() };
    let Some(image) = photo.image(folder, twin) else { return Vec::new() };
    let material = if twin == "opaque" { Material::Opaque } else { Material::Transparent };
    let colour = if twin == "opaque" { [130, 125, 120] } else { [220, 230, 230] };
    let [bottle, tumbler, mug, flower] = match declared {
        Forms::Own => [forms::bottle(), forms::tumbler(), forms::mug(), forms::flower()],
        Forms::Boxes => [
            cuboid(BOTTLE[0], BOTTLE[1], BOTTLE[2]),
            cuboid(0.055, 0.055, 0.106),
            cylinder(0.040, 0.128),
            cuboid(0.075, 0.035, 0.080),
        ],
    };
    let bottle = || object("bottle", bottle.clone(), colour, material);
    let tumbler = || object("tumbler", tumbler.clone(), colour, material);
    let mug = || object("mug", mug.clone(), [70, 110, 110], Material::Opaque);
    let flower = || object("flower", flower.clone(), colour, material);
    let mut there: Vec<(Object, Vec<[f64; 2]>)> = match scene_name {
        "080" => three(&bottle(), &forms::BOTTLES),
        "123" => three(&flower(), &forms::FLOWERS),
        "130" => vec![(mug(), vec![forms::MUG]), (tumbler(), vec![forms::TUMBLER])],
        _ => Vec::new(),
    };
    let twins = match scene_name {
        "080" => vec![mug(), tumbler()],
        "123" => vec![mug(), bottle()],
        "130" => vec![
            bottle(),
            object("gelatin box", cuboid(0.085, 0.073, 0.028), [190, 50, 40], Material::Opaque),
        ],
        _ => vec![bottle(), mug(), tumbler()],
    };
    let absent: Vec<(Object, Vec<[f64; 2]>)> =
        twins.into_iter().chain([catalogue().swap_remove(0)]).map(|o| (o, Vec::new())).collect();
    let case = |what: &str, all: Vec<(Object, Vec<[f64; 2]>)>| {
        let (objects, truth): (Vec<_>, Vec<_>) = all.into_iter().unzip();
        Case {
            name: format!("{scene_name} {twin}, {what}"),
            image: image.clone(),
            scene: scene(photo.camera(), photo.table(), objects),
            truth,
        }
    };
    let mut cases = vec![case("absent", absent.clone())];
    if !there.is_empty() {
        cases.push(case("there", there.clone()));
        there.extend(absent);
        cases.push(case("both", there));
    }
    cases
}

/// The sequence with the cube and the tube: as it is, and asked for what is not there.
pub(crate) fn desk(folder: &Path, frame: u32) -> Vec<Case> {
    let seen = visp::Visp::read(folder, Some(frame));
    let (cube, axis) = seen.truth(frame);
    let image = seen.image(frame);
    let there = Case {
        name: format!("desk {frame}, there"),
        image: image.clone(),
        scene: seen.scene.clone(),
        truth: vec![vec![[cube.origin().x, cube.origin().y]], vec![[axis.x, axis.y]]],
    };
    let all = catalogue();
    let wanted: Vec<Object> = [0, 1, 2, 3, 5].iter().map(|&k| all[k].clone()).collect();
    let absent = Case {
        name: format!("desk {frame}, absent"),
        image,
        truth: vec![Vec::new(); wanted.len()],
        scene: scene(seen.camera, seen.scene.table, wanted),
    };
    vec![there, absent]
}
