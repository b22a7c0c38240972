//! The shared photographs: cameras, tables, what stands where, and where there is room to put more.

use std::path::Path;

use image::{GrayImage, RgbImage};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, Vector3};
use trueup::world::frame::{Camera as CameraFrame, World};
use trueup::world::{Camera, Intrinsics, Pose, Table};

use crate::visp;

/// A photograph that more can be put into.
pub(crate) struct Ground {
    pub(crate) name: String,
    pub(crate) image: RgbImage,
    pub(crate) camera: Camera,
    pub(crate) table: Table,
    /// Where a foot may stand so that nothing in front of it is in the photograph: `[u0, v0, u1, v1]`, px.
    pub(crate) room: Vec<[f64; 4]>,
}

/// The plane of a table in a camera's frame: unit normal towards the camera, distance of the eye, m.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane {
    pub(crate) normal: Vector3<f64>,
    pub(crate) eye: f64,
}

impl Plane {
    /// World on the plane: the origin where the axis of view meets it, x to the right, y away.
    pub(crate) fn world_from_camera(self) -> Pose<World, CameraFrame> {
        let n = self.normal;
        let right = (Vector3::x() - n * n.x).normalize();
        let away = n.cross(&right);
        let origin = Vector3::z() * (-self.eye / n.z);
        let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[right, away, n]));
        Pose::new(Isometry3::from_parts(Translation3::from(origin), axes.into()).inverse())
    }
}

/// One of the four photographed tables with clear things, and their painted twins.
pub(crate) struct Clear {
    pub(crate) scene: &'static str,
    pub(crate) plane: Plane,
}

pub(crate) const CLEAR: [&str; 4] = ["080", "123", "130", "153"];

impl Clear {
    /// Reads the table's plane; `None` where the reference is not there.
    pub(crate) fn read(folder: &Path, scene: &'static str) -> Option<Self> {
        let text = std::fs::read_to_string(folder.join("reference_from_depth.json")).ok()?;
        let all: serde_json::Value = serde_json::from_str(&text).ok()?;
        let n = all["scenes"][scene]["table_plane_n_d"].as_array()?;
        let n: Vec<f64> = n.iter().filter_map(serde_json::Value::as_f64).collect();
        Some(Self {
            scene,
            plane: Plane { normal: Vector3::new(n[0], n[1], n[2]).normalize(), eye: n[3] },
        })
    }

    pub(crate) fn image(&self, folder: &Path, twin: &str) -> Option<RgbImage> {
        let name = format!("real_{}-{twin}-rgb-img.jpg", self.scene);
        Some(image::open(folder.join(name)).ok()?.to_rgb8())
    }

    pub(crate) fn mask(&self, folder: &Path) -> Option<GrayImage> {
        Some(image::open(folder.join(format!("real_{}-mask.png", self.scene))).ok()?.to_luma8())
    }

    pub(crate) fn camera(&self) -> Camera {
        let mut intrinsics = Intrinsics::centred(921.0, 1280, 720);
        (intrinsics.cx, intrinsics.cy) = (642.0, 359.0);
        Camera { intrinsics, world_from_camera: self.plane.world_from_camera() }
    }

    /// The table's top as far as it is seen, from the pictures by hand, to some centimetres.
    pub(crate) fn table(&self) -> Table {
        let (size, centre, colour) = match self.scene {
            "080" => ([1.3, 0.62], [0.05, -0.02], [20, 110, 160]),
            "123" => ([0.75, 0.75], [0.10, 0.03], [60, 25, 25]),
            "130" => ([0.72, 0.75], [0.11, 0.03], [60, 25, 25]),
            _ => ([1.4, 1.0], [0.0, 0.10], [215, 215, 220]),
        };
        Table { size: Vector3::new(size[0], size[1], 0.02), centre, colour }
    }

    pub(crate) fn ground(&self, folder: &Path, twin: &str) -> Option<Ground> {
        let room = match self.scene {
            "080" => vec![
                [90.0, 520.0, 420.0, 640.0],
                [440.0, 600.0, 700.0, 660.0],
                [1090.0, 470.0, 1220.0, 640.0],
            ],
            "123" => vec![[700.0, 380.0, 1100.0, 480.0], [480.0, 560.0, 680.0, 660.0]],
            "130" => vec![[380.0, 560.0, 900.0, 660.0], [620.0, 450.0, 800.0, 640.0]],
            _ => vec![
                [120.0, 200.0, 600.0, 300.0],
                [820.0, 450.0, 1180.0, 640.0],
                [150.0, 560.0, 800.0, 660.0],
            ],
        };
        Some(Ground {
            name: format!("{} {twin}", self.scene),
            image: self.image(folder, twin)?,
            camera: self.camera(),
            table: self.table(),
            room,
        })
    }
}

/// A frame of the sequence with the cube and the tube.
pub(crate) fn desk(folder: &Path, frame: u32) -> Ground {
    let seen = visp::Visp::read(folder, Some(frame));
    Ground {
        name: format!("desk {frame}"),
        image: seen.image(frame),
        camera: seen.camera,
        table: seen.scene.table,
        room: vec![[440.0, 230.0, 600.0, 380.0], [150.0, 340.0, 330.0, 400.0]],
    }
}
