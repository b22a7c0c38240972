//! The software camera: outlines where the camera model puts them, glass that bends light, shadows that fall.

use nalgebra::{Isometry3, Vector3};
use trueup::motion::Robot;
use trueup::twin::render::{
    ArmLook, Ball, Body, FIRST_BODY, MARKER, NOTHING, Options, Paint, Shape, TABLE, View, WATER,
    light, picture, radiance, render, solids,
};
use trueup::world::{Camera, Intrinsics, Pixel, Point, Scene};

use crate::kitchen;

fn bent_camera(scene: &Scene) -> Camera {
    let mut camera = scene.camera;
    (camera.intrinsics.k1, camera.intrinsics.k2) = (-0.15, 0.02);
    (camera.intrinsics.cx, camera.intrinsics.cy) = (643.0, 355.0);
    camera
}

/// The arm reaching out level over the table, rad; found by trying.
const REACHING: [f64; 7] =
    [-0.35, 0.95, std::f64::consts::PI, -1.75, 0.0, 1.13, std::f64::consts::FRAC_PI_2];

/// The kitchen, arm over the table, water in the jar.
fn view(scene: &Scene) -> View {
    let robot = urdf_rs::read_from_string(kitchen::URDF).unwrap();
    let state = kitchen::state([0.60, -0.10, 0.3], [0.58, 0.20, 0.0]);
    let links = kitchen::links(&robot, &REACHING, 0.085);
    View::of(scene, &state, &ArmLook::new(&Robot::gen3()), &links)
}

fn bare(scene: &Scene) -> View {
    View { bodies: Vec::new(), marker: None, ..view(scene) }
}

/// Darkness-weighted middle of a disc of `reach` px around a pixel, relative to the brightest there.
fn dark_centre(light: &[[f32; 3]], width: usize, near: Pixel, reach: f64) -> Pixel {
    let (mut sum, mut su, mut sv) = (0.0, 0.0, 0.0);
    let at = |u: usize, v: usize| f64::from(light[v * width + u][1]);
    let (u0, v0) = ((near.u - reach) as usize, (near.v - reach) as usize);
    let side = (2.0 * reach) as usize + 2;
    for v in v0..v0 + side {
        for u in u0..u0 + side {
            let dark = (0.25 - at(u, v)).max(0.0);
            sum += dark;
            su += dark * u as f64;
            sv += dark * v as f64;
        }
    }
    Pixel::new(su / sum, sv / sum)
}

#[test]
fn marks_appear_where_the_camera_model_projects_them() {
    let scene = kitchen::scene();
    let camera = bent_camera(&scene);
    let drawn = radiance(&camera, &bare(&scene), &Options { shadows: false, ..Options::default() });
    let mut worst: f64 = 0.0;
    for mark in &scene.marks {
        // The middle of the picture of a disc is not the picture of its middle: compare with the mean of
        // the disc's points as projected, weighted as the picture weighs them, by area.
        let (mut su, mut sv, mut sum) = (0.0, 0.0, 0.0);
        for i in 0..60 {
            for j in 0..60 {
                let place = |k: i32| (f64::from(k) + 0.5) / 30.0 - 1.0;
                let (a, b) = (place(i), place(j));
                if a * a + b * b > 1.0 {
                    continue;
                }
                let at = |da: f64, db: f64| {
                    let (x, y) = (mark.x + a * mark.radius + da, mark.y + b * mark.radius + db);
                    camera.project(Point::new(x, y, 0.0)).unwrap()
                };
                let (pixel, pa, pb) = (at(0.0, 0.0), at(1e-5, 0.0), at(0.0, 1e-5));
                let weight = ((pa.u - pixel.u) * (pb.v - pixel.v)
                    - (pa.v - pixel.v) * (pb.u - pixel.u))
                    .abs();
                (su, sv, sum) = (su + weight * pixel.u, sv + weight * pixel.v, sum + weight);
            }
        }
        let expected = Pixel::new(su / sum, sv / sum);
        if expected.u < 30.0 || expected.v < 30.0 || expected.u > 1249.0 || expected.v > 689.0 {
            continue;
        }
        let edge = camera.project(Point::new(mark.x, mark.y + mark.radius, 0.0)).unwrap();
        let seen = dark_centre(&drawn.light, 1280, expected, edge.distance(expected) + 5.0);
        worst = worst.max(seen.distance(expected));
    }
    assert!(worst < 0.05, "a mark is {worst} px off");
}

/// Straight edges of the table are drawn as curves, and lie on the projected edge to a few hundredths px.
#[test]
fn table_edges_bend_as_the_lens_bends_them() {
    let scene = kitchen::scene();
    let mut camera = bent_camera(&scene);
    camera.world_from_camera = Camera::looking(
        camera.intrinsics,
        Vector3::new(1.5, 0.0, 1.3),
        Vector3::new(0.5, 0.0, 0.0),
    )
    .world_from_camera;
    let mut view = bare(&scene);
    view.marks.clear();
    let drawn = radiance(&camera, &view, &Options { shadows: false, ..Options::default() });
    let light = |u: usize, v: usize| f64::from(drawn.light[v * 1280 + u][0]);
    let mut bow: f64 = 0.0;
    let mut checked = 0;
    let ends = [0.0, 1.0].map(|k| camera.project(Point::new(0.2 + 0.8 * k, 0.4, 0.0)).unwrap());
    for k in 1..40 {
        let p = camera.project(Point::new(0.2 + 0.02 * f64::from(k), 0.4, 0.0)).unwrap();
        let v = p.v.round();
        // The edge between this row's neighbours: linear interpolation of the projected edge.
        let q = camera.project(Point::new(0.2 + 0.02 * f64::from(k) + 0.004, 0.4, 0.0)).unwrap();
        let expected = p.u + (q.u - p.u) * (v - p.v) / (q.v - p.v);
        let (row, column) = (v as usize, expected.round() as usize);
        let (inside, outside) = (light(column - 5, row), light(column + 5, row));
        let covered: f64 = (column - 4..=column + 4)
            .map(|u| ((light(u, row) - outside) / (inside - outside)).clamp(0.0, 1.0))
            .sum();
        let seen = column as f64 - 4.5 + covered;
        // The wood's grain makes the brightness inside uncertain by some percent over four pixels.
        assert!((seen - expected).abs() < 0.25, "row {row}: {seen} against {expected}");
        let chord = ends[0].u + (ends[1].u - ends[0].u) * (v - ends[0].v) / (ends[1].v - ends[0].v);
        bow = bow.max((expected - chord).abs());
        checked += 1;
    }
    assert!(checked > 30 && bow > 1.0, "the edge bows by {bow} px only");
}

#[test]
fn a_ball_covers_its_closed_form_solid_angle() {
    let scene = kitchen::scene();
    let camera = scene.camera;
    let mut view = bare(&scene);
    let centre = Vector3::new(0.6, 0.1, 0.2);
    let radius = 0.03;
    view.marker = Some(Ball { centre, radius, colour: [208, 32, 143] });
    let drawn = radiance(&camera, &view, &Options::default());
    // Each pixel's share of the sphere around the camera is dΩ = cos³θ / f².
    let f = camera.intrinsics.fx;
    let mut angle = 0.0;
    for (k, &id) in drawn.ids.iter().enumerate() {
        if id == MARKER {
            let pixel = Pixel::new((k % 1280) as f64, (k / 1280) as f64);
            let n = camera.intrinsics.normalise(pixel);
            angle += (1.0 + n.norm_squared()).powf(-1.5) / (f * f);
        }
    }
    let distance = (centre - camera.world_from_camera.origin()).norm();
    let cap = std::f64::consts::TAU * (1.0 - (1.0 - (radius / distance).powi(2)).sqrt());
    assert!((angle / cap - 1.0).abs() < 0.01, "{angle} against {cap}");
    // Depth is measured along camera z: at the nearest point of the ball it is the ball's front.
    let p = camera.project(Point::from(centre)).unwrap();
    let at = p.v.round() as usize * 1280 + p.u.round() as usize;
    let (_, z) = camera.project_with_depth(Point::from(centre)).unwrap();
    let front = z * (1.0 - radius / distance);
    assert!((f64::from(drawn.depth[at]) - front).abs() < 1e-4);
}

#[test]
fn ids_say_what_is_seen_and_what_is_glass() {
    let scene = kitchen::scene();
    let view = view(&scene);
    let frame = render(&scene.camera, &view, &Options::quick());
    let at = |x, y, z| {
        let p = scene.camera.project(Point::new(x, y, z)).unwrap();
        p.v.round() as usize * 1280 + p.u.round() as usize
    };
    let jar = view.id_of("jar").unwrap();
    let cup = view.id_of("cup").unwrap();
    assert_eq!((view.name_of(jar), jar), (Some("jar"), FIRST_BODY));
    let through_jar = at(0.60, -0.10, 0.07);
    assert_eq!((frame.glass_ids[through_jar], frame.ids[through_jar]), (jar, TABLE));
    assert_eq!(frame.ids[at(0.58, 0.20, 0.095 / 2.0)], cup);
    assert_eq!(frame.ids[at(0.75, 0.0, 0.0)], TABLE);
    assert_eq!(frame.ids[0], NOTHING);
    assert!(frame.depth[0].is_infinite());
    assert!(frame.ids.contains(&MARKER), "the marker on the gripper is in view ");
    // The arm covers part of the picture.
    assert!(frame.ids.iter().filter(|&&id| id > cup).count() > 10_000);
}

/// The jar must be found by its edges and what it does to the background, not by a colour of its own.
#[test]
fn glass_shows_the_table_behind_it_with_bright_and_dark_edges() {
    let scene = kitchen::scene();
    let with = view(&scene);
    let without = View {
        bodies: with.bodies.iter().filter(|body| body.name != "jar").cloned().collect(),
        ..with.clone()
    };
    let jar = with.id_of("jar").unwrap();
    let options = Options::default();
    let (a, b) =
        (radiance(&scene.camera, &with, &options), radiance(&scene.camera, &without, &options));
    let mut ratios: Vec<f32> = Vec::new();
    for k in 0..a.ids.len() {
        if a.glass_ids[k] == jar {
            ratios.push(a.light[k][1] / b.light[k][1]);
        }
    }
    ratios.sort_by(f32::total_cmp);
    let at = |part: f64| ratios[(part * (ratios.len() - 1) as f64) as usize];
    assert!(ratios.len() > 5_000, "{} px of jar", ratios.len());
    assert!((0.55..1.1).contains(&at(0.5)), "the middle of the jar is near the table: {}", at(0.5));
    assert!(at(0.02) < 0.75 && at(0.98) > 1.05, "edges stand out: {} {}", at(0.02), at(0.98));
}

#[test]
fn a_box_casts_its_shadow_away_from_the_lamp() {
    let scene = kitchen::scene();
    let mut view = bare(&scene);
    view.bodies.push(Body {
        name: "box".into(),
        shape: Shape::Cuboid(Vector3::new(0.06, 0.06, 0.2)),
        world_from_body: Isometry3::translation(0.6, 0.0, 0.1),
        paint: Paint::opaque([200, 200, 200], 0.0),
    });
    view.light.towards = Vector3::new(0.0, -1.0, 1.0);
    let light = |options: &Options, x: f64, y: f64| {
        let drawn = radiance(&scene.camera, &view, options);
        let p = scene.camera.project(Point::new(x, y, 0.0)).unwrap();
        drawn.light[p.v.round() as usize * 1280 + p.u.round() as usize][1]
    };
    let flat = Options { shadows: false, ..Options::default() };
    let shaded = Options::default();
    // The lamp stands towards -y at 45°: the shadow reaches 0.2 m towards +y.
    assert!(light(&shaded, 0.6, 0.12) < 0.65 * light(&flat, 0.6, 0.12));
    assert!(light(&shaded, 0.6, -0.15) > 0.9 * light(&flat, 0.6, -0.15));
    assert!(light(&shaded, 0.6, 0.34) > 0.9 * light(&flat, 0.6, 0.34));
}

#[test]
fn drops_are_drawn_outside_vessels_and_not_inside() {
    let scene = kitchen::scene();
    let drops = [[0.72, 0.0, 0.3], [0.72, 0.0, 0.292], [0.60, -0.10, 0.05], [0.75, 0.05, 0.003]]
        .map(Vector3::<f32>::from);
    let view = view(&scene).with_water(&drops, 0.004);
    let frame = render(&scene.camera, &view, &Options::default());
    let at = |x, y, z| {
        let p = scene.camera.project(Point::new(x, y, z)).unwrap();
        p.v.round() as usize * 1280 + p.u.round() as usize
    };
    assert_eq!(frame.glass_ids[at(0.72, 0.0, 0.3)], WATER);
    assert_eq!(frame.glass_ids[at(0.75, 0.05, 0.0)], WATER);
    assert_eq!(frame.glass_ids[at(0.60, -0.10, 0.05)], view.id_of("jar").unwrap());
}

#[test]
fn the_same_view_gives_the_same_bits_on_any_number_of_threads() {
    let scene = kitchen::scene();
    let mut camera = bent_camera(&scene);
    camera.intrinsics = Intrinsics { k1: -0.1, ..Intrinsics::centred(225.0, 320, 180) };
    let view = view(&scene);
    let draw = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| radiance(&camera, &view, &Options::default()))
    };
    assert_eq!(draw(1), draw(3));
}

/// Who wants only a part of a picture gets the same bits of it.
#[test]
fn parts_of_a_picture_are_those_of_the_whole() {
    let scene = kitchen::scene();
    let mut camera = bent_camera(&scene);
    // Not a whole number of squares.
    camera.intrinsics = Intrinsics { k1: -0.1, ..Intrinsics::centred(225.0, 331, 187) };
    let drops = [[0.72, 0.0, 0.3], [0.75, 0.05, 0.003]].map(Vector3::<f32>::from);
    let view = view(&scene).with_water(&drops, 0.004);
    for options in [Options::default(), Options::film(), Options::quick()] {
        let (whole, drawn) = (render(&camera, &view, &options), radiance(&camera, &view, &options));
        assert_eq!(picture(&camera, &view, &options), whole.colour);
        assert_eq!(light(&camera, &view, &options), drawn.light);
        let is_solid = |id: &u16| *id != NOTHING && *id != TABLE;
        let expected: Vec<bool> = whole.ids.iter().map(is_solid).collect();
        assert!(expected.contains(&true) && solids(&camera, &view) == expected);
    }
}

/// `TRUEUP_PICTURES=folder cargo test pictures` writes pictures to look at; without it nothing is written.
#[test]
fn pictures_to_look_at() {
    let Some(folder) = std::env::var_os("TRUEUP_PICTURES") else { return };
    let folder = std::path::Path::new(&folder);
    let scene = kitchen::scene();
    let camera = bent_camera(&scene);
    let options = Options::default();
    render(&camera, &view(&scene), &options).colour.save(folder.join("kitchen.png")).unwrap();
    // Held over the cup, tilted, pouring.
    let mut state = kitchen::state([0.6, -0.1, 0.3], [0.62, 0.12, 0.0]);
    let tilted =
        Isometry3::translation(0.60, -0.04, 0.20) * Isometry3::rotation(Vector3::x() * -1.25);
    state.objects[0].world_from_object = Some(trueup::world::Pose::new(tilted));
    state.objects[0].water = Some(60e-6);
    state.objects[1].water = Some(80e-6);
    let robot = urdf_rs::read_from_string(kitchen::URDF).unwrap();
    let links = kitchen::links(&robot, &REACHING, 0.065);
    let drops: Vec<Vector3<f32>> = (0..60)
        .map(|k| {
            let t = k as f32 * 0.003;
            [0.6 + 0.002 * (k as f32 * 1.7).sin(), 0.095 + 0.25 * t, 0.20 - 0.4 * t - 4.9 * t * t]
        })
        .chain([[0.75, 0.0, 0.003], [0.757, 0.004, 0.003], [0.70, -0.02, 0.003]])
        .map(Vector3::from)
        .collect();
    let pouring =
        View::of(&scene, &state, &ArmLook::new(&Robot::gen3()), &links).with_water(&drops, 0.0039);
    render(&camera, &pouring, &options).colour.save(folder.join("pouring.png")).unwrap();
    let mut near = camera;
    near.world_from_camera = Camera::looking(
        near.intrinsics,
        Vector3::new(0.95, 0.1, 0.35),
        Vector3::new(0.6, 0.0, 0.07),
    )
    .world_from_camera;
    render(&near, &view(&scene), &options).colour.save(folder.join("near.png")).unwrap();
    render(&near, &pouring, &options).colour.save(folder.join("near_pouring.png")).unwrap();
}
