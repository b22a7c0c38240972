//! A hand-eye calibration in words: where the camera is, how sure that is, picture by picture, and what to do next.

use std::fmt::Write as _;

use nalgebra::Vector3;

use crate::alignment::hand_eye::{HandEye, Placed, ViewFit};

/// Words an answer. `left` are the pictures and rows that could not be used, with the reason of each.
pub fn text(answer: &HandEye, left: &[(String, String)]) -> String {
    let mut text = String::new();
    let names = answer.views.iter().map(|v| &v.name).chain(left.iter().map(|(name, _)| name));
    let width = names.map(|name| name.chars().count()).max().unwrap_or(0);
    for view in &answer.views {
        let _ = writeln!(text, "{:<width$}  {}", view.name, picture(view));
    }
    for (name, why) in left {
        let _ = writeln!(text, "{name:<width$}  not used: {why}");
    }
    let used = answer.views.iter().filter(|v| v.is_used).count();
    let all = answer.views.len() + left.len();
    let _ = write!(text, "camera {}, from {used} of {all} pictures", answer.mount);
    if let Some((rotation, position)) = answer.other_mount {
        let _ = write!(
            text,
            " (the other way the median picture would be off by {:.0} deg and {:.0} mm)",
            rotation.to_degrees(),
            1e3 * position
        );
    }
    let (carrier, other) = (answer.mount.carrier(), answer.mount.other());
    let _ = write!(text, "\n{}", place(&format!("{carrier}_from_camera"), &answer.camera));
    let _ = write!(text, "{}", place(&format!("{other}_from_board"), &answer.board));
    if let Some((median, rms, (view, worst))) = answer.leave_one_out() {
        let _ = writeln!(
            text,
            "left out in turn, a picture is predicted to {:.1} mm and {:.2} deg (median; rms {:.1} mm, {:.2} deg; worst \
             {}: {:.1} mm, {:.2} deg)",
            1e3 * median.position,
            median.rotation.to_degrees(),
            1e3 * rms.position,
            rms.rotation.to_degrees(),
            view.name,
            1e3 * worst.position,
            worst.rotation.to_degrees()
        );
    }
    let _ = writeln!(
        text,
        "the board's middle spreads by {:.1} mm rms; corners rms {:.2} px through the robot's poses, {:.2} px by each picture \
         alone",
        1e3 * answer.spread,
        answer.rms_px,
        answer.picture_rms_px
    );
    let _ = writeln!(
        text,
        "noise of the robot's poses: {:.2} mm and {:.3} deg an axis; {} by the robot's travel: {:.2} ± {:.2} mm, said \
         {:.2} mm",
        1e3 * answer.noise.position,
        answer.noise.rotation.to_degrees(),
        answer.square.of,
        1e3 * answer.square.measured,
        1e3 * answer.square.std,
        1e3 * answer.square.said
    );
    for advice in answer.advice() {
        let kind = if advice.is_warning() { "warning" } else { "next" };
        let _ = writeln!(text, "{kind}: {advice}");
    }
    text
}

/// One picture.
fn picture(view: &ViewFit) -> String {
    let mut text = String::from(if view.is_used { "" } else { "not used: " });
    let (rotation, position) = (view.rotation.to_degrees(), 1e3 * view.position);
    let _ = write!(text, "pose off by {position:.1} mm, {rotation:.2} deg");
    if let Some(left_out) = view.left_out.filter(|_| view.is_used) {
        let (rotation, position) = (left_out.rotation.to_degrees(), 1e3 * left_out.position);
        let _ = write!(text, "; predicted by the others to {position:.1} mm, {rotation:.2} deg");
    }
    text
}

/// A place with its standard deviations.
fn place(name: &str, placed: &Placed) -> String {
    let mm = |v: &Vector3<f64>| (1e3 * v.x, 1e3 * v.y, 1e3 * v.z);
    let deg = |v: Vector3<f64>| (v.x.to_degrees(), v.y.to_degrees(), v.z.to_degrees());
    let ((x, y, z), (sx, sy, sz)) = (mm(&placed.pose.translation.vector), mm(&placed.std_position));
    let (roll, pitch, yaw) = placed.pose.rotation.euler_angles();
    let (roll, pitch, yaw) = deg(Vector3::new(roll, pitch, yaw));
    let (a, b, c) = deg(placed.std_rotation);
    format!(
        "  {name:<18} x {x:.1} ± {sx:.1}, y {y:.1} ± {sy:.1}, z {z:.1} ± {sz:.1} mm\n  {:<18} roll {roll:.2}, pitch {pitch:.2}, yaw \
         {yaw:.2} deg; ± {a:.2}, {b:.2}, {c:.2} deg about its own axes\n",
        ""
    )
}
