//! The twin: closed forms for rigid bodies and torques, planted grasps and pours, and water that is
//! neither lost nor made.

mod grasp;
mod pour;
mod render;
mod rigid;
mod rims;
mod shapes;
mod stick;
mod torque;
mod water;

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use trueup::motion::Robot;
use trueup::twin::{Settings, Twin};
use trueup::world::{
    Camera, Cavity, Intrinsics, Material, Object, ObjectState, Pose, Scene, Shape, Table,
    WorldState,
};

/// A posture over the table, clear of everything.
pub(crate) const HOME: [f64; 7] =
    [0.0, 0.261_799, std::f64::consts::PI, -2.268_928, 0.0, 0.959_931, std::f64::consts::FRAC_PI_2];

/// The robot of the standard library.
pub(crate) fn gen3() -> Robot {
    Robot::gen3()
}

/// A vessel of the kitchen: thin walls, open at the top.
pub(crate) fn vessel(name: &str, shape: Shape, mass: f64) -> Object {
    let wall = 0.003;
    Object {
        cavity: Some(Cavity { wall, capacity: 2.5e-4, filled: 0.0 }),
        ..solid(name, shape, mass)
    }
}

/// A solid object.
pub(crate) fn solid(name: &str, shape: Shape, mass: f64) -> Object {
    Object {
        name: name.into(),
        kind: "Thing".into(),
        shape,
        cavity: None,
        looks: String::new(),
        material: Material::Opaque,
        colour: [128; 3],
        mass,
    }
}

/// The kitchen's jar.
pub(crate) fn jar() -> Object {
    vessel("jar", Shape::Cuboid { size: Vector3::new(0.065, 0.065, 0.14) }, 0.16)
}

/// The kitchen's cup.
pub(crate) fn cup() -> Object {
    vessel("cup", Shape::Cylinder { radius: 0.08, height: 0.095 }, 0.18)
}

/// A table with these objects, the arm at the origin.
pub(crate) fn scene(objects: Vec<Object>) -> Scene {
    let eye = Vector3::new(1.25, 0.0, 0.85);
    Scene {
        name: "test".into(),
        table: Table { size: Vector3::new(1.2, 0.8, 0.02), centre: [0.5, 0.0], colour: [0; 3] },
        marks: Vec::new(),
        objects,
        drawers: Vec::new(),
        camera_name: "overhead".into(),
        camera: Camera::looking(Intrinsics::centred(900.0, 1280, 720), eye, Vector3::zeros()),
        person: None,
        calibration: None,
        robot: "gen3_2f85".into(),
        world_from_base: Pose::identity(),
    }
}

/// A state: arm at `q`, jaws open, objects at `(name, pose, water in m³)`.
pub(crate) fn state(q: &[f64], objects: &[(&str, Isometry3<f64>, f64)]) -> WorldState {
    let objects = objects.iter().map(|(name, pose, water)| ObjectState {
        name: (*name).into(),
        world_from_object: Some(Pose::new(*pose)),
        std: 0.0,
        water: Some(*water),
    });
    WorldState {
        time: 0.0,
        q: q.to_vec(),
        opening: 0.085,
        world_from_tool: Pose::identity(),
        held: None,
        objects: objects.collect(),
        spilt: Some(0.0),
        unknown: Vec::new(),
    }
}

/// An upright pose at `(x, y, z)` m.
pub(crate) fn at(x: f64, y: f64, z: f64) -> Isometry3<f64> {
    Isometry3::translation(x, y, z)
}

/// A tool pose that points along world x with the jaws opening along y, centred on `(x, y, z)`.
pub(crate) fn forward(x: f64, y: f64, z: f64) -> Isometry3<f64> {
    let columns = [Vector3::y(), Vector3::z(), Vector3::x()];
    let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&columns));
    Isometry3::from_parts(Vector3::new(x, y, z).into(), UnitQuaternion::from(turn))
}

/// Joint angles that put the tool at `goal`, by damped least squares from `start`.
pub(crate) fn reach(robot: &Robot, goal: &Isometry3<f64>, start: &[f64]) -> Vec<f64> {
    let tool = |q: &[f64]| *robot.forward_tool(q).unwrap().isometry();
    let error = |q: &[f64]| {
        let now = tool(q);
        let shift = goal.translation.vector - now.translation.vector;
        let turn = (goal.rotation * now.rotation.inverse()).scaled_axis();
        DVector::from_iterator(6, shift.iter().chain(turn.iter()).copied())
    };
    let mut q = start.to_vec();
    for _ in 0..300 {
        let e = error(&q);
        if e.norm() < 1e-10 {
            return q;
        }
        let mut jacobian = DMatrix::zeros(6, q.len());
        for j in 0..q.len() {
            let mut moved = q.clone();
            moved[j] += 1e-7;
            jacobian.set_column(j, &((&e - error(&moved)) / 1e-7));
        }
        let damping = 0.01 * e.norm_squared() + 1e-9;
        let square = &jacobian * jacobian.transpose() + DMatrix::identity(6, 6) * damping;
        let step = jacobian.transpose() * square.lu().solve(&e).unwrap();
        let scale = (0.3 / step.amax()).min(1.0);
        for (q, s) in q.iter_mut().zip(step.iter()) {
            *q += s * scale;
        }
    }
    panic!("no joint angles for {goal:?}: {}", error(&q).norm());
}

/// Moves the arm to `q` along a smooth path in `seconds`, and lets it finish.
pub(crate) fn drive(twin: &mut Twin, q: &[f64], seconds: f64) {
    let start = twin.q();
    let steps = (seconds / twin.dt()).round() as usize;
    for i in 1..=steps {
        let t = i as f64 / steps as f64;
        let (s, ds) = (t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t) / seconds);
        let at: Vec<f64> = start.iter().zip(q).map(|(a, b)| a + (b - a) * s).collect();
        let speed: Vec<f64> = start.iter().zip(q).map(|(a, b)| (b - a) * ds).collect();
        twin.command(&at, &speed).unwrap();
        twin.step().unwrap();
    }
}

/// A twin of the Gen3 with ideal servos.
pub(crate) fn twin(objects: Vec<Object>, state: &WorldState) -> Twin {
    let robot = gen3();
    Twin::new(&robot, &scene(objects), state, Settings::for_arm(&robot)).unwrap()
}
