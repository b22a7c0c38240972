//! What people are told of what is done: by the lines of a script, by the regressions, by a look at the table.
//!
//! Why something fails stands with its error ([`super::error`], [`super::refusal`], [`crate::trace::Cause`]).

use std::fmt::{Display, Write as _};

use crate::alignment::camera_fit::{CameraFit, PARAMETERS};
use crate::alignment::vision::Sighting;
use crate::http::Address;
use crate::world::colour::colour_word;
use crate::world::region::TABLE;
use crate::world::{Region, Shape, Unknown};

use super::calibrate::Visited;
use super::calibrate::arm::ArmFit;

// What lines of scripts do.

/// A share of full speed: ` at 30 % of full speed`.
fn at_speed(share: f64) -> String {
    format!(" at {:.0} % of full speed", 100.0 * share.clamp(0.02, 1.0))
}

/// What `camera.look` does.
pub(super) fn looks() -> String {
    "take a camera image and find all objects again".to_owned()
}

/// What `arm.open` does.
pub(super) fn opens() -> String {
    "open the fingers as wide as they go".to_owned()
}

/// What `arm.close` does, with at most so much force, N.
pub(super) fn closes(object: &str, force: f64) -> String {
    format!("close the fingers on the {object} with at most {force:.0} N")
}

/// What `arm.weigh` does.
pub(super) fn weighs() -> String {
    "hold still and weigh what is in the hand by the joints' torques".to_owned()
}

/// What `arm.heft` does for so many seconds.
pub(super) fn hefts(seconds: f64) -> String {
    format!("hold still and feel for {seconds:.1} s how heavy what is in the hand is")
}

/// What `arm.stands` does.
pub(super) fn feels_standing(o: &str) -> String {
    format!("feel whether `{o}` has slid in the hand and stands")
}

/// What `arm.wait` does for so many seconds.
pub(super) fn waits(seconds: f64) -> String {
    format!("hold still for {seconds:.1} s")
}

/// What `arm.move_to` does.
pub(super) fn moves_round() -> String {
    format!("move round everything in the way{}", at_speed(1.0))
}

/// What `arm.carry_to` does, leaning at most by `tilt` rad, at a share of full speed.
pub(super) fn carries(tilt: f64, speed: f64) -> String {
    let (lean, at) = (tilt.to_degrees(), at_speed(speed));
    format!("carry what is held round everything in the way, leaning at most {lean:.0} deg,{at}")
}

/// What `arm.follow` does, at a share of full speed.
pub(super) fn follows(speed: f64) -> String {
    format!("follow the path that was found{}", at_speed(speed))
}

/// What `arm.draw_back` does, at a share of full speed.
pub(super) fn draws_back(speed: f64) -> String {
    format!("draw the hand back the way it came{}", at_speed(speed))
}

/// What `arm.move_by` does, by so many m in the world, at a share of full speed: `move straight by 12.0 cm up`.
pub(super) fn moves_straight(by: [f64; 3], speed: f64) -> String {
    let ways = [("along x", "against x"), ("along y", "against y"), ("up", "down")];
    let mut text = String::from("move straight by");
    let mut is_first = true;
    for (amount, (forth, back)) in by.into_iter().zip(ways) {
        if amount.abs() < 5e-5 {
            continue;
        }
        let way = if amount > 0.0 { forth } else { back };
        let and = if is_first { "" } else { " and" };
        let _ = write!(text, "{and} {:.1} cm {way}", 100.0 * amount.abs());
        is_first = false;
    }
    if is_first {
        return "stay where it is".to_owned();
    }
    format!("{text}{}", at_speed(speed))
}

/// What `arm.line_to` does, at a share of full speed.
pub(super) fn moves_to(at: [f64; 3], speed: f64) -> String {
    let [x, y, z] = at.map(|along| 100.0 * along);
    format!("move straight to ({x:.1}, {y:.1}, {z:.1}) cm{}", at_speed(speed))
}

/// What `arm.turn_about` does, by so many rad.
pub(super) fn turns_about(angle: f64) -> String {
    format!("turn the hand in its place by {:.0} deg", angle.to_degrees())
}

/// What `arm.move_until` does: by so many m at most, until so many N are felt.
pub(super) fn moves_until(by: [f64; 3], force: f64) -> String {
    let way = by[0].hypot(by[1]).hypot(by[2]);
    format!("move straight until {force:.1} N are felt, at most {:.1} cm", 100.0 * way)
}

/// The arm stands still for something that moves by itself, which would have come so near, m.
pub(super) fn waits_for(name: &str, apart: f64) -> String {
    format!("the arm waits: `{name}` would come within {:.0} cm", 100.0 * apart.max(0.0))
}

/// After so many seconds what it waited for keeps away from its way.
pub(super) fn goes_on_past(name: &str, seconds: f64) -> String {
    format!("the arm goes on after {seconds:.1} s: its way is clear of `{name}`")
}

/// After so many seconds its way leads no nearer to what is within so much, m.
pub(super) fn goes_on_beside(name: &str, apart: f64, seconds: f64) -> String {
    let apart = 100.0 * apart.max(0.0);
    format!(
        "the arm goes on after {seconds:.1} s: its way leads no nearer to `{name}`, which is within {apart:.0} cm"
    )
}

/// Something that moves by itself reached the arm, or what it holds, while the arm moved, and so far into it at most, m.
pub(super) fn touched(name: &str, into: f64) -> String {
    format!("`{name}` touched the arm while it moved: they overlapped by {:.0} mm", 1e3 * into)
}

/// A free motion by policies, among things that move.
pub(super) fn gives_way() -> String {
    "the arm gives way to what moves while it goes there".to_owned()
}

/// What `arm.offer` does: an object, until so many N are felt, for so many s at most.
pub(super) fn offers(object: &str, force: f64, seconds: f64) -> String {
    format!(
        "hold the {object} out until somebody pulls with {force:.0} N, for {seconds:.0} s at most"
    )
}

/// What `arm.pull` does: by so many m, as long as less than so many N are felt.
pub(super) fn pulls(by: [f64; 3], force: f64) -> String {
    let way = by[0].hypot(by[1]).hypot(by[2]);
    format!("pull straight by {:.1} cm, with at most {force:.0} N", 100.0 * way)
}

/// What `arm.push` does.
pub(super) fn pushes(object: &str, way: f64) -> String {
    format!("push the {object} straight, {:.1} cm of way", 100.0 * way)
}

/// What `arm.open_to` does, to so many m.
pub(super) fn opens_to(width: f64) -> String {
    format!("move the fingers to {:.0} mm between the pads", 1e3 * width)
}

/// What `arm.turn` does, at so many rad/s.
pub(super) fn turns(rate: f64) -> String {
    format!("turn the hand along its path at {:.0} deg/s", rate.to_degrees())
}

/// What `arm.turn_back` does, at so many rad/s.
pub(super) fn turns_back(rate: f64) -> String {
    format!("turn the hand back upright at {:.0} deg/s", rate.to_degrees())
}

/// What `arm.turn_to` does: to this share of a path, at so many rad/s.
pub(super) fn turns_to(share: f64, rate: f64) -> String {
    let (percent, rate) = (100.0 * share, rate.to_degrees());
    format!("turn the hand to {percent:.1} % of its path at {rate:.0} deg/s")
}

/// The last note of a script that leaves more than so many.
pub(super) fn notes_end(most: usize) -> String {
    format!("{most} notes of this script are told, and no more")
}

// What there is no way to do: see `NoWay`.

/// To take an object.
pub(super) fn to_grasp(object: &str) -> String {
    format!("to grasp `{object}`")
}

/// To take a drawer by its handle.
pub(super) fn to_handle(drawer: &str) -> String {
    format!("to take `{drawer}` by its handle and draw it")
}

/// To put an object somewhere; `is_into` of a vessel that it goes into.
pub(super) fn to_put(object: &str, at: &Region, is_into: bool) -> String {
    match at {
        Region::On(name) if name == TABLE => format!("to put `{object}` down"),
        Region::On(name) if is_into => format!("to put `{object}` into `{name}`"),
        Region::On(name) => format!("to put `{object}` on `{name}`"),
        Region::Point(_) | Region::Spot { .. } => format!("to put `{object}` at that point"),
        Region::Beside { of, .. } => format!("to put `{object}` beside `{of}`"),
        Region::Between(a, b) => format!("to put `{object}` between `{a}` and `{b}`"),
        Region::Away(_) => format!("to put `{object}` aside"),
        Region::Unknown(of) => format!("to put `{object}` where `{of}` was"),
    }
}

/// To push an object somewhere.
pub(super) fn to_push(object: &str, at: &Region) -> String {
    to_put(object, at, false).replacen("to put", "to push", 1)
}

/// To stir a vessel's water.
pub(super) fn to_stir(vessel: &str, tool: &str) -> String {
    format!("to stir `{vessel}` with `{tool}`")
}

/// To hand an object over.
pub(super) fn to_hand_over(object: &str) -> String {
    format!("to hold `{object}` out")
}

/// To wipe a thing's top.
pub(super) fn to_wipe(object: &str) -> String {
    format!("to wipe `{object}`")
}

/// To pour.
pub(super) fn to_pour(source: &str, target: &str) -> String {
    format!("to pour from `{source}` into `{target}`")
}

/// To move the tool straight by so many m.
pub(super) fn to_move(by: f64) -> String {
    format!("to move the tool by {:.0} mm", by * 1e3)
}

/// To turn the tool in its place by so many rad.
pub(super) fn to_turn(angle: f64) -> String {
    format!("to turn the tool by {:.0} deg", angle.to_degrees())
}

// Where the arm must not be left standing.

/// Between steps that go on at the same time.
pub fn inside_together() -> String {
    "inside a `together`".to_owned()
}

/// With a vessel in the hand that leans by `tilt` rad, as far as anybody knows.
pub(super) fn leans(held: &str, tilt: Option<f64>) -> String {
    match tilt {
        Some(tilt) => format!("the {held} is tilted by {:.0} deg", tilt.to_degrees()),
        None => format!("the tilt of the {held} has not been measured"),
    }
}

// What a look and the regressions found.

/// Where an object was seen, or why it was not.
pub(super) fn seen(sighting: &Sighting) -> String {
    let name = &sighting.name;
    let Some(pose) = sighting.world_from_object else {
        let why = sighting.reason.as_deref();
        let why = why.unwrap_or("nothing in the picture looks like it");
        let likeliest = sighting.likeliest.map_or_else(String::new, |pose| {
            let at = pose.origin();
            format!(
                "; likeliest at ({:.1}, {:.1}) cm, probability {:.2}",
                at.x * 100.0,
                at.y * 100.0,
                sighting.confidence
            )
        });
        if let Some(kept) = sighting.kept {
            let at = kept.origin() * 100.0;
            return format!(
                "camera: {name} is not recognised ({why}); believed to stand where it was, at ({:.1}, {:.1}) cm",
                at.x, at.y
            );
        }
        return format!("camera: {name} not found: {why}{likeliest}");
    };
    let at = pose.origin();
    format!(
        "camera: {name} at ({:.1}, {:.1}) cm, {}, ± {:.1} mm, probability {:.2}",
        at.x * 100.0,
        at.y * 100.0,
        sighting.turned(&pose),
        sighting.std * 1e3,
        sighting.confidence
    )
}

/// What was seen on the table that the scene does not declare.
pub(super) fn seen_unknown(other: &Unknown) -> String {
    let what = match &other.form {
        Some(form) => {
            let [x, y, z] = sides(&form.shape).map(|side| side * 1e3);
            let colour = colour_word(form.colour);
            if form.shape.faces().is_some() {
                format!("a {colour} box of {x:.0} x {y:.0} x {z:.0} mm")
            } else {
                format!("a {colour} can of {x:.0} mm, {z:.0} mm high,")
            }
        }
        None => format!(
            "something at most {:.0} cm wide and {:.0} cm high",
            other.radius * 200.0,
            other.height * 100.0
        ),
    };
    format!(
        "camera: {what} that the scene does not declare at ({:.0}, {:.0}) cm; the arm keeps clear of it",
        other.at[0] * 100.0,
        other.at[1] * 100.0
    )
}

/// How long a shape is along x, y and z, m.
fn sides(shape: &Shape) -> [f64; 3] {
    let [x, y] = shape.faces().unwrap_or([2.0 * shape.outer_radius(); 2]);
    [x, y, shape.height()]
}

/// That a thing is not seen upright where it was put.
pub(super) fn gone(object: &str) -> String {
    format!("camera: {object} is not seen upright where it was put")
}

/// Before any regression was fitted.
pub(super) fn nothing_calibrated() -> String {
    "nothing has been calibrated".to_owned()
}

/// That regressions 1 and 2 are switched off.
pub(super) fn camera_left_out() -> String {
    "regressions 1 and 2 left out: the scene file is believed".to_owned()
}

/// Regression 1: how many of the table's dots it rests on, its residual, px, and whether it is in force.
pub(super) fn camera_aligned(used: usize, dots: usize, rms_px: f64, in_force: bool) -> String {
    let camera = if in_force { "aligned" } else { "left where the scene file says" };
    format!(
        "regression 1: {used} of {dots} dots, projective map, rms {rms_px:.2} px, camera {camera}"
    )
}

/// Regression 2: what it found, each number with its standard deviation, its residual, px, and whether it is in force. One view
/// of a plane leaves the focal length and the centre loosely held, however small the residual.
pub(super) fn lens_fitted(fit: &CameraFit, in_force: bool) -> String {
    let left_out = if in_force { "" } else { " (left out: the lens is believed as given)" };
    let (lens, rms_px) = (&fit.camera.intrinsics, fit.rms_px);
    let of = |name: &str, value: f64, digits: usize| {
        let at = PARAMETERS.iter().position(|parameter| *parameter == name);
        // What was kept as given has none.
        match at.map(|at| fit.std[at]).filter(|std| *std > 0.0) {
            Some(std) => format!("{value:.digits$} ± {std:.digits$}"),
            None => format!("{value:.digits$}"),
        }
    };
    format!(
        "regression 2: focal {} px, centre ({}, {}) px, k1 {}, rms {rms_px:.2} px{left_out}",
        of("fx", lens.fx, 1),
        of("cx", lens.cx, 1),
        of("cy", lens.cy, 1),
        of("k1", lens.k1, 4)
    )
}

/// That regression 3 is switched off.
pub(super) fn arm_left_out() -> String {
    "regression 3 left out: the arm is taken at its word".to_owned()
}

/// Regression 3: how many of the points visited it rests on, and what it found.
pub(super) fn arm_fitted(used: usize, visited: usize, fit: &ArmFit) -> String {
    format!(
        "regression 3: arm position error {:.1} mm, corrected ({used} of {visited} points, rms {:.2} px)",
        fit.off * 1e3,
        fit.rms_px
    )
}

/// What the arm does after the touch-off.
pub(super) fn back_from_touch_off() -> String {
    "back to where the arm stood before the touch-off".to_owned()
}

/// At how many of the points to visit the arm's marker was seen, and why not at the others.
pub(super) fn seen_too_rarely(visited: &Visited) -> String {
    let Visited { seen, reached, outside, out_of_reach, in_the_way, points, needed } = *visited;
    let others = [
        (out_of_reach, "out of reach"),
        (in_the_way, "with something in the way"),
        (outside, "outside the picture"),
    ];
    let others = others.iter().filter(|(n, _)| *n > 0).map(|(n, why)| format!("{n} {why}"));
    let others = others.collect::<Vec<_>>().join(", ");
    if reached == 0 {
        return format!(
            "the arm took none of the poses that show its marker ball, with a level hand or a steep one, at {points} points over the \
             table: {others}; the offset needs at least {needed}"
        );
    }
    let others = if others.is_empty() { others } else { format!(" ({others})") };
    format!(
        "the marker ball was seen at {seen} of {reached} points that the arm came to, of {points} in all{others}; the offset needs at \
         least {needed}"
    )
}

// What fails in a device that is ours.

/// The laboratory's arm cannot be stepped.
pub(super) fn lab_failed(error: impl Display) -> String {
    format!("the lab's arm failed: {error}")
}

/// The twin cannot be stepped.
pub(super) fn twin_failed(error: impl Display) -> String {
    format!("the twin cannot be stepped: {error}")
}

/// Nothing can be seen in a camera image.
pub(super) fn image_of_no_use(error: impl Display) -> String {
    format!("the camera image cannot be used: {error}")
}

/// A camera at a web address gives no picture.
pub(super) fn no_picture(address: &Address, why: impl Display) -> String {
    format!("no picture from {address}: {why}")
}

/// What helps when a camera at a web address gives no picture.
pub(super) fn look_for_yourself() -> String {
    "open the address in a browser: does it show the table?".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_is_told_by_its_parts() {
        assert_eq!(
            moves_straight([0.0, 0.0, 0.12], 0.3),
            "move straight by 12.0 cm up at 30 % of full speed"
        );
        assert_eq!(
            moves_straight([-0.05, 0.0, -0.01], 1.0),
            "move straight by 5.0 cm against x and 1.0 cm down at 100 % of full speed"
        );
        assert_eq!(moves_straight([0.0; 3], 1.0), "stay where it is");
    }
}
