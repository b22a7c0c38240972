//! What `trueup align hand-eye` prints and writes: where the camera is, as other programs and
//! [`crate::world::camera_file`] read it, with what is known of how good that is.

use nalgebra::{Isometry3, Vector3};
use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::alignment::hand_eye::{Advice, HandEye, LeftOut, Placed, ViewFit};
use crate::world::{Pose, frame};

/// The answer as one document; `left` are pictures and rows that could not be used.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Answer {
    document: Value,
}

impl Answer {
    /// Words a calibration as the answer; with `world_from_base` a fixed camera is placed in the world as well.
    pub fn new(
        answer: &HandEye,
        left: &[(String, String)],
        world_from_base: Option<Pose<frame::World, frame::Base>>,
    ) -> Self {
        let (carrier, other) = (answer.mount.carrier(), answer.mount.other());
        let mut document = Map::new();
        let mut put = |name: String, value: Value| drop(document.insert(name, value));
        put("camera_on".into(), json!(answer.mount.name()));
        put(format!("{carrier}_from_camera"), pose(&answer.camera.pose));
        put(format!("{carrier}_from_camera_std"), std(&answer.camera));
        put(format!("{other}_from_board"), pose(&answer.board.pose));
        put(format!("{other}_from_board_std"), std(&answer.board));
        put("camera".into(), json!({ "intrinsics": answer.intrinsics }));
        if let Some(world_from_base) = world_from_base {
            let base_from_camera: Pose<frame::Base, frame::Camera> = Pose::new(answer.camera.pose);
            put("world_from_camera".into(), json!(world_from_base * base_from_camera));
        }
        put("leave_one_out".into(), json!(answer.leave_one_out().map(|(median, rms, (view, worst))| {
            json!({
                "median_m": median.position, "median_rad": median.rotation,
                "rms_m": rms.position, "rms_rad": rms.rotation,
                "worst": {"picture": view.name, "error_m": worst.position, "error_rad": worst.rotation},
            })
        })));
        put("spread_m".into(), json!(answer.spread));
        put("rms_px".into(), json!(answer.rms_px));
        put("picture_rms_px".into(), json!(answer.picture_rms_px));
        put(
            "pose_noise".into(),
            json!({
                "position_m": answer.noise.position, "rotation_rad": answer.noise.rotation,
            }),
        );
        put(
            "square".into(),
            json!({
                "of": answer.square.of.name(),
                "said_m": answer.square.said, "measured_m": answer.square.measured, "std_m": answer.square.std,
                "is_wrong": answer.square.is_wrong,
            }),
        );
        put(
            "motions".into(),
            json!({
                "turns_rad": answer.motions.turns, "axes": answer.motions.axes.map(row), "frame": carrier,
                "travel_m": answer.motions.travel,
            }),
        );
        put(
            "other_mount".into(),
            json!(answer.other_mount.map(|(rotation, position)| {
                json!({"median_rad": rotation, "median_m": position})
            })),
        );
        let views = answer.views.iter().map(|view| picture(view, answer));
        let missing =
            left.iter().map(|(name, why)| json!({"picture": name, "used": false, "reason": why}));
        put("pictures".into(), Value::Array(views.chain(missing).collect()));
        let (warnings, advice): (Vec<_>, Vec<_>) =
            answer.advice().into_iter().partition(Advice::is_warning);
        let worded = |all: Vec<_>| all.iter().map(ToString::to_string).collect::<Vec<String>>();
        put("warnings".into(), json!(worded(warnings)));
        put("advice".into(), json!(worded(advice)));
        Self { document: Value::Object(document) }
    }
}

fn pose(isometry: &Isometry3<f64>) -> Value {
    json!(Pose::<frame::World, frame::World>::new(*isometry))
}

fn row(v: Vector3<f64>) -> [f64; 3] {
    v.into()
}

/// Standard deviations; `null` for what is not determined.
fn std(placed: &Placed) -> Value {
    json!({"xyz_m": row(placed.std_position), "rotation_rad": row(placed.std_rotation)})
}

fn picture(view: &ViewFit, answer: &HandEye) -> Value {
    let reason = (!view.is_used).then(|| match view.row_of {
        Some(other) => {
            format!("disagrees with the others; the row of {} fits it", answer.views[other].name)
        }
        None => "disagrees with the others".into(),
    });
    let left_out = |of: fn(&LeftOut) -> f64| view.left_out.as_ref().map(of);
    json!({
        "picture": view.name, "used": view.is_used, "reason": reason,
        "off_m": view.position, "off_rad": view.rotation,
        "leave_one_out_m": left_out(|e| e.position), "leave_one_out_rad": left_out(|e| e.rotation),
    })
}
