//! The `ViSP` cube and cylinder sequence, read in place: its camera and scene from its own files.

use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use trueup::world::frame::{Camera as CameraFrame, Object as ObjectFrame, World};
use trueup::world::{Camera, Intrinsics, Material, Object, Pose, Scene, Shape, Table};

/// Edge of the cube, m.
const EDGE: f64 = 0.084;

fn number(text: &str, tag: &str) -> f64 {
    let after = text.split(&format!("<{tag}>")).nth(1).unwrap();
    after.split('<').next().unwrap().trim().parse().unwrap()
}

fn numbers(value: &serde_json::Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

/// The dataset's cube frame has a corner as origin, x from 0 to -84 mm; ours the centre of the base.
fn cube_from_corner() -> Isometry3<f64> {
    Isometry3::translation(-EDGE / 2.0, EDGE / 2.0, 0.0)
}

/// A published or reference pose: camera from the cube's base centre.
fn camera_from_cube(t: &[f64], rvec: &[f64]) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(rvec[0], rvec[1], rvec[2]));
    Isometry3::from_parts(Translation3::new(t[0], t[1], t[2]), rotation) * cube_from_corner()
}

/// Where `cube.0.pos` puts the cube in frame 0.
fn published_pose(folder: &Path) -> Isometry3<f64> {
    let text = fs::read_to_string(folder.join("cube.0.pos")).unwrap();
    let n: Vec<f64> = text.split_whitespace().map(|v| v.parse().unwrap()).collect();
    camera_from_cube(&n[..3], &n[3..])
}

/// The sequence: camera with the table as z = 0, scene, and the reference of each frame.
pub(crate) struct Visp {
    pub(crate) folder: PathBuf,
    pub(crate) camera: Camera,
    pub(crate) scene: Scene,
    reference: serde_json::Value,
}

impl Visp {
    /// Reads the dataset's files. The table is the cube's base in the published pose of frame 0
    /// (`cube.0.pos`), or in the reference pose of `frame`.
    pub(crate) fn read(folder: &Path, frame: Option<u32>) -> Self {
        let xml = fs::read_to_string(folder.join("cube.xml")).unwrap();
        let reference: serde_json::Value =
            serde_json::from_str(&fs::read_to_string(folder.join("reference_poses.json")).unwrap())
                .unwrap();
        let intrinsics = Intrinsics {
            fx: number(&xml, "px"),
            fy: number(&xml, "py"),
            cx: number(&xml, "u0"),
            cy: number(&xml, "v0"),
            ..Intrinsics::centred(1.0, 640, 480)
        };
        let pose = if let Some(frame) = frame {
            let entry = &reference["frames"][frame.to_string()];
            camera_from_cube(&numbers(&entry["t_m"]), &numbers(&entry["rvec"]))
        } else {
            published_pose(folder)
        };
        // The world: the cube's base in frame 0 is z = 0; origin below the middle of the picture; y away.
        let normal = pose.rotation * Vector3::z();
        let base = pose.translation.vector;
        let ray = Vector3::new(0.0, 0.0, 1.0);
        let origin = ray * (normal.dot(&base) / normal.dot(&ray));
        let away = (ray - normal * normal.dot(&ray)).normalize();
        let right = away.cross(&normal);
        let rotation =
            Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[right, away, normal]));
        let camera_from_world = Isometry3::from_parts(Translation3::from(origin), rotation.into());
        let world_from_camera: Pose<World, CameraFrame> = Pose::new(camera_from_world.inverse());
        let camera = Camera { intrinsics, world_from_camera };
        let object = |name: &str, shape, looks: &str| Object {
            name: name.into(),
            kind: "Block".into(),
            shape,
            cavity: None,
            looks: looks.into(),
            material: Material::Opaque,
            colour: [128, 128, 128],
            mass: 0.2,
        };
        let scene = Scene {
            name: "visp".into(),
            table: Table {
                size: Vector3::new(0.8, 0.8, 0.02),
                centre: [0.0, 0.1],
                colour: [170, 170, 170],
            },
            marks: Vec::new(),
            objects: vec![
                object("cube", Shape::Cuboid { size: Vector3::repeat(EDGE) }, "printed cube"),
                object(
                    "tube",
                    Shape::Cylinder { radius: 0.04, height: 0.35 },
                    "grey tube taller than the picture",
                ),
            ],
            drawers: Vec::new(),
            camera_name: "still".into(),
            camera,
            person: None,
            calibration: None,
            robot: "gen3_2f85".into(),
            world_from_base: Pose::identity(),
        };
        Self { folder: folder.to_path_buf(), camera, scene, reference }
    }

    /// Where the reference says the cube and the tube's axis stand in a frame, world.
    pub(crate) fn truth(&self, frame: u32) -> (Pose<World, ObjectFrame>, Vector3<f64>) {
        let entry = &self.reference["frames"][frame.to_string()];
        let pose = camera_from_cube(&numbers(&entry["t_m"]), &numbers(&entry["rvec"]));
        let world = self.camera.world_from_camera.isometry() * pose;
        let corner = cube_from_corner().inverse();
        let axis = world * corner * nalgebra::Point3::new(-0.17, -0.03, 0.0);
        (Pose::new(world), axis.coords)
    }

    /// As [`Self::truth`], from the published pose of frame 0.
    pub(crate) fn published(&self) -> (Pose<World, ObjectFrame>, Vector3<f64>) {
        let world = self.camera.world_from_camera.isometry() * published_pose(&self.folder);
        let axis = world * cube_from_corner().inverse() * nalgebra::Point3::new(-0.17, -0.03, 0.0);
        (Pose::new(world), axis.coords)
    }

    pub(crate) fn image(&self, frame: u32) -> image::RgbImage {
        image::open(self.folder.join(format!("image{frame:04}.png"))).unwrap().to_rgb8()
    }
}
