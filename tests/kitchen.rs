//! The kitchen of `stdlib/scenes/kitchen.task` as a value, for tests below the layer that reads scenes.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use trueup::world::{
    Camera, Cavity, Intrinsics, Mark, Material, Object, ObjectState, Pose, Scene, Shape, Table,
    WorldState,
};

/// The robot's description.
pub(crate) const URDF: &str = include_str!("../stdlib/robots/gen3_2f85/gen3_2f85.urdf");

/// Kinova's home configuration, rad.
pub(crate) const HOME: [f64; 7] = [
    0.0,
    0.261_799_388,
    std::f64::consts::PI,
    -2.268_928_028,
    0.0,
    0.959_931_089,
    std::f64::consts::FRAC_PI_2,
];

pub(crate) fn scene() -> Scene {
    let marks = [
        (0.25, -0.36),
        (0.25, -0.18),
        (0.25, 0.18),
        (0.25, 0.36),
        (0.50, -0.36),
        (0.50, 0.36),
        (0.80, -0.36),
        (0.80, -0.12),
        (0.80, 0.12),
        (0.80, 0.36),
        (0.92, -0.25),
        (0.92, 0.0),
        (0.92, 0.25),
    ];
    Scene {
        name: "kitchen".into(),
        table: Table {
            size: Vector3::new(1.2, 0.8, 0.02),
            centre: [0.5, 0.0],
            colour: [0xc8, 0xb0, 0x90],
        },
        marks: marks.map(|(x, y)| Mark { x, y, radius: 0.012 }).to_vec(),
        objects: vec![
            Object {
                name: "jar".into(),
                kind: "Container".into(),
                shape: Shape::Cuboid { size: Vector3::new(0.065, 0.065, 0.140) },
                cavity: Some(Cavity { wall: 0.003, capacity: 250e-6, filled: 150e-6 }),
                looks: "transparent jar".into(),
                material: Material::Transparent,
                colour: [220, 230, 230],
                mass: 0.16,
            },
            Object {
                name: "cup".into(),
                kind: "Container".into(),
                shape: Shape::Cylinder { radius: 0.08, height: 0.095 },
                cavity: Some(Cavity { wall: 0.003, capacity: 1.7e-3, filled: 0.0 }),
                looks: "blue cup".into(),
                material: Material::Opaque,
                colour: [0x20, 0x50, 0xc0],
                mass: 0.18,
            },
        ],
        drawers: Vec::new(),
        camera_name: "overhead".into(),
        camera: Camera::looking(
            Intrinsics::centred(900.0, 1280, 720),
            Vector3::new(1.25, 0.0, 0.85),
            Vector3::new(0.60, 0.0, 0.05),
        ),
        person: None,
        calibration: None,
        robot: "gen3_2f85".into(),
        world_from_base: Pose::identity(),
    }
}

/// The arm at home, the jar at `jar` and the cup at `cup` (x, y m, yaw rad).
pub(crate) fn state(jar: [f64; 3], cup: [f64; 3]) -> WorldState {
    let at = |name: &str, [x, y, yaw]: [f64; 3], water: f64| ObjectState {
        name: name.into(),
        world_from_object: Some(Pose::upright(x, y, 0.0, yaw)),
        std: 0.0,
        water: Some(water),
    };
    WorldState {
        time: 0.0,
        q: HOME.to_vec(),
        opening: 0.085,
        world_from_tool: Pose::identity(),
        held: None,
        objects: vec![at("jar", jar, 150e-6), at("cup", cup, 0.0)],
        spilt: Some(0.0),
        unknown: Vec::new(),
    }
}

/// Link poses by the textbook chain of joint transforms, written here so that tests of pictures do not rest
/// on the kinematics under test elsewhere.
pub(crate) fn links(
    robot: &urdf_rs::Robot,
    q: &[f64],
    opening: f64,
) -> Vec<(String, Isometry3<f64>)> {
    let mut poses = vec![("base_link".to_owned(), Isometry3::identity())];
    let mut angles = q.iter();
    for joint in &robot.joints {
        let parent = poses.iter().find(|(name, _)| *name == joint.parent.link).unwrap().1;
        let [roll, pitch, yaw] = joint.origin.rpy.0;
        let origin = Isometry3::from_parts(
            Translation3::from(Vector3::from(joint.origin.xyz.0)),
            UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        );
        let axis = Vector3::from(joint.axis.xyz.0);
        let motion = match joint.joint_type {
            urdf_rs::JointType::Revolute | urdf_rs::JointType::Continuous => {
                Isometry3::rotation(axis * *angles.next().unwrap())
            }
            urdf_rs::JointType::Prismatic => {
                Isometry3::from_parts((axis * (opening / 2.0)).into(), UnitQuaternion::identity())
            }
            _ => Isometry3::identity(),
        };
        poses.push((joint.child.link.clone(), parent * origin * motion));
    }
    poses
}
