//! What a recording says of a thing in the hand.

use std::ops::Range;

use nalgebra::{Isometry3, Matrix3, Point3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use super::wording;
use crate::discovery::recording::sidecar::{HeldObject, Origin};
use crate::discovery::recording::{Error, Recording, noise};
use crate::discovery::robot::smooth::whittaker;
use crate::motion::Robot;
use crate::motion::dynamics::GRAVITY;
use crate::units::Dimension;
use crate::world::{Object, Scene, Shape};

/// A seen place is never better known than this, m: the hand's place follows from an arm's model.
const LEAST_NOISE: f64 = 3e-4;

/// How well the opening says how wide a thing is, m: pads give.
const PADS: f64 = 5e-4;

/// How well a seen height says how high a thing is, m.
const HEIGHT: f64 = 5e-4;

/// The fingers are given this long after they closed, s.
const SETTLE: f64 = 0.2;

/// Rows nearer to each other than this are not told apart, s.
const STRIDE: f64 = 0.05;

/// Fingers that stand still for so long, s, this much less open than at their widest, m, hold something.
const STANDS: (f64, f64) = (0.5, 3e-3);

/// An opening that changes by less than this in [`SETTLE`] stands still, m.
const STILL: f64 = 5e-4;

/// A thing in the hand, row by row.
#[derive(Debug, Clone)]
pub struct Held {
    /// The recording's name.
    pub name: String,
    /// What the thing is called.
    pub object: String,
    /// Every row's time, s.
    pub time: Vec<f64>,
    /// The hand in the robot's base, every row.
    pub hand: Vec<Isometry3<f64>>,
    /// What pulls the thing along the pads, in the hand's frame, every row, m/s²: gravity less the hand's
    /// acceleration, without what the pads bear.
    pub pull: Vec<Vector3<f64>>,
    /// Where the thing was seen, in the robot's base, every row, m.
    pub seen: Vec<Vector3<f64>>,
    /// Rows that are judged, stretch after stretch of being held.
    pub stretches: Vec<Vec<usize>>,
    /// Standard deviation of a seen place along each axis, m.
    pub noise: f64,
    /// What the fingers can do at most against a slip, in units of friction, m/s²: twice the squeeze over the
    /// mass.
    pub squeeze: Option<f64>,
    /// Each stretch's opening less what the scene says is between the fingers, m, with the axis of the thing
    /// that is between them.
    pub opening: Vec<(f64, usize)>,
    /// Where the thing was seen standing less where the scene says, m, and which part of its height that is.
    pub height: Option<(f64, f64)>,
    /// What was assumed, one sentence each.
    pub notes: Vec<String>,
}

impl Held {
    /// Standard deviation of an opening as a width, m.
    pub(super) const PADS: f64 = PADS;
    /// Standard deviation of a height, m.
    pub(super) const HEIGHT: f64 = HEIGHT;

    /// Returns whether a recording is of a thing in a hand: it has `object_x` and the hand's place.
    pub fn is_one(recording: &Recording) -> bool {
        recording.has("object_x") && (recording.has("q_1") || recording.has("tcp_x"))
    }

    /// Takes a thing in the hand out of a recording.
    ///
    /// # Errors
    ///
    /// An [`Error`] for columns that are missing or wrong, a thing that the scene does not have, or a recording
    /// in which nothing is held.
    pub fn of(recording: &Recording, robot: &Robot, scene: &Scene) -> Result<Self, Error> {
        let mut notes = Vec::new();
        let told = recording.sidecar.held.clone().unwrap_or_default();
        let object = match &told.object {
            None => None,
            Some(name) => {
                Some(scene.object(name).ok_or_else(|| wording::no_such(name, recording, scene))?)
            }
        };
        let seen = places(recording, "object")?;
        let turned = turns(recording, "object")?;
        let time = recording.time.clone();
        let hand = hands(recording, robot, &mut notes)?;
        let has_turns = recording.has("q_1") || recording.has("tcp_qw");
        let across = if has_turns { closing(robot) } else { Vector3::x() };
        let pull = pulls(&time, &hand, &across, has_turns);
        let fingers = if recording.has("gripper") {
            Some(recording.column("gripper", Dimension::LENGTH)?)
        } else {
            None
        };
        let spans = spans(recording, fingers, &mut notes)?;
        let fresh: Vec<usize> =
            (0..time.len()).filter(|&row| row == 0 || seen[row] != seen[row - 1]).collect();
        let stretches: Vec<Vec<usize>> = spans
            .iter()
            .map(|span| thinned(&time, fresh.iter().copied().filter(|row| span.contains(row))))
            .filter(|rows| rows.len() >= 4)
            .collect();
        if stretches.is_empty() {
            return Err(wording::nothing_held(&recording.name));
        }
        let noise = seen_noise(&time, &seen, &fresh);
        if let Some(turned) = &turned {
            notes.extend(pivoted(&recording.name, &hand, turned, &stretches));
        }
        let opening = match (object, fingers) {
            (Some(object), Some(fingers)) => spans
                .iter()
                .map(|span| {
                    let opening = median(fingers[span.clone()].to_vec());
                    let row = usize::midpoint(span.start, span.end);
                    let across = turned.as_ref().map(|turned| {
                        turned[row].inverse_transform_vector(&(hand[row].rotation * across))
                    });
                    between(object, opening, across)
                })
                .collect(),
            _ => Vec::new(),
        };
        let height = object.and_then(|object| {
            let z = standing(&time, &seen, spans[0].start)?;
            let (higher, part) = over(object, &told, scene, z)?;
            if (higher / part).abs() <= object.shape.height() {
                return Some((higher, part));
            }
            // No thing is that much higher: something else held it.
            notes.push(wording::not_on_table(&recording.name, higher));
            None
        });
        let mass = told.mass_kg.or_else(|| object.map(|object| object.mass));
        let squeeze = told.squeeze_n.zip(mass).map(|(squeeze, mass)| 2.0 * squeeze / mass);
        if object.is_none() {
            notes.push(wording::size_unknown(&recording.name));
        }
        if squeeze.is_none() {
            notes.push(wording::squeeze_unknown(&recording.name));
        }
        Ok(Self {
            name: recording.name.clone(),
            object: told.object.unwrap_or_else(|| "object".into()),
            time,
            hand,
            pull,
            seen,
            stretches,
            noise,
            squeeze,
            opening,
            height,
            notes,
        })
    }

    /// Returns the hand at a time between rows.
    pub(super) fn hand_at(&self, time: f64) -> Isometry3<f64> {
        let to = self.time.partition_point(|t| *t < time).clamp(1, self.time.len() - 1);
        let (t0, t1) = (self.time[to - 1], self.time[to]);
        let part = ((time - t0) / (t1 - t0)).clamp(0.0, 1.0);
        let (a, b) = (&self.hand[to - 1], &self.hand[to]);
        let place = a.translation.vector.lerp(&b.translation.vector, part);
        Isometry3::from_parts(place.into(), a.rotation.nlerp(&b.rotation, part))
    }
}

/// A place of the recording, every row, m.
fn places(recording: &Recording, stem: &str) -> Result<Vec<Vector3<f64>>, Error> {
    let axis = |name: &str| recording.column(&format!("{stem}_{name}"), Dimension::LENGTH);
    let (x, y, z) = (axis("x")?, axis("y")?, axis("z")?);
    Ok((0..x.len()).map(|row| Vector3::new(x[row], y[row], z[row])).collect())
}

/// An attitude of the recording, every row, when it has one.
fn turns(recording: &Recording, stem: &str) -> Result<Option<Vec<UnitQuaternion<f64>>>, Error> {
    if !recording.has(&format!("{stem}_qw")) {
        return Ok(None);
    }
    let part = |name: &str| recording.column(&format!("{stem}_{name}"), Dimension::NONE);
    let (w, x, y, z) = (part("qw")?, part("qx")?, part("qy")?, part("qz")?);
    let one = |row: usize| Quaternion::new(w[row], x[row], y[row], z[row]);
    Ok(Some((0..w.len()).map(|row| UnitQuaternion::from_quaternion(one(row))).collect()))
}

/// The hand in the robot's base, every row: from the joints, or as the recording has it.
fn hands(
    recording: &Recording,
    robot: &Robot,
    notes: &mut Vec<String>,
) -> Result<Vec<Isometry3<f64>>, Error> {
    if recording.has("q_1") {
        return from_joints(recording, robot);
    }
    let turns = turns(recording, "tcp")?.unwrap_or_else(|| {
        notes.push(wording::hand_does_not_turn(&recording.name));
        vec![UnitQuaternion::identity(); recording.n_rows()]
    });
    let places = smoothed(&recording.time, &places(recording, "tcp")?);
    let pose = |(place, turn): (Vector3<f64>, UnitQuaternion<f64>)| {
        Isometry3::from_parts(place.into(), turn)
    };
    Ok(places.into_iter().zip(turns).map(pose).collect())
}

/// How well a place is seen, m: of the rows that were looked at anew.
fn seen_noise(time: &[f64], seen: &[Vector3<f64>], fresh: &[usize]) -> f64 {
    let axis = |index: usize| -> f64 {
        let (times, values): (Vec<f64>, Vec<f64>) =
            fresh.iter().map(|&row| (time[row], seen[row][index])).unzip();
        noise::estimate(&times, &values)
    };
    (0..3).map(axis).fold(0.0, f64::max).hypot(LEAST_NOISE)
}

/// The hand from the joints, without their noise.
fn from_joints(recording: &Recording, robot: &Robot) -> Result<Vec<Isometry3<f64>>, Error> {
    let n = robot.n_joints();
    recording.check_joints(&robot.sliding())?;
    let columns = recording.group("q", n, Dimension::ANGLE)?.unwrap_or_default();
    let smooth: Vec<Vec<f64>> = columns
        .iter()
        .map(|values| {
            whittaker(&recording.time, values, noise::estimate(&recording.time, values)).q
        })
        .collect();
    (0..recording.n_rows())
        .map(|row| {
            let q: Vec<f64> = smooth.iter().map(|values| values[row]).collect();
            let pose = robot.forward_tool(&q).map(|pose| *pose.isometry());
            pose.map_err(|error| wording::not_this_robot(&error, &recording.name))
        })
        .collect()
}

/// Places without their noise.
fn smoothed(time: &[f64], places: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let axis = |index: usize| {
        let values: Vec<f64> = places.iter().map(|place| place[index]).collect();
        whittaker(time, &values, noise::estimate(time, &values)).q
    };
    let (x, y, z) = (axis(0), axis(1), axis(2));
    (0..time.len()).map(|row| Vector3::new(x[row], y[row], z[row])).collect()
}

/// Returns along what the jaws close, in the tool's frame.
fn closing(robot: &Robot) -> Vector3<f64> {
    let zero = vec![0.0; robot.n_joints()];
    let found = || {
        let (jaw, tool) = (robot.jaws().next()?, robot.tool()?);
        let shut = robot.link_poses(&zero, 0.0).ok()?;
        let open = robot.link_poses(&zero, robot.max_opening()).ok()?;
        let moved = open[jaw].translation.vector - shut[jaw].translation.vector;
        shut[tool].inverse_transform_vector(&moved).try_normalize(1e-9)
    };
    found().unwrap_or_else(Vector3::x)
}

/// Returns what pulls a thing along the pads at each row, in the hand's frame. Where the hand's turn is not
/// known, the pads are taken to stand upright.
fn pulls(
    time: &[f64],
    hand: &[Isometry3<f64>],
    across: &Vector3<f64>,
    has_turns: bool,
) -> Vec<Vector3<f64>> {
    let along = if has_turns {
        Matrix3::identity() - across * across.transpose()
    } else {
        Matrix3::from_diagonal(&Vector3::z())
    };
    let place = |row: usize| hand[row].translation.vector;
    let rows = time.len();
    // Over this many rows on either side a smoothed place bends by more than rounding.
    let step = (time[rows - 1] - time[0]) / (rows - 1) as f64;
    let reach = ((0.02 / step).round() as usize).max(1);
    (0..rows)
        .map(|row| {
            let middle = row.clamp(reach.min(rows / 2), rows - 1 - reach.min((rows - 1) / 2));
            let (a, b) = (middle.saturating_sub(reach), (middle + reach).min(rows - 1));
            let (left, right) = (time[middle] - time[a], time[b] - time[middle]);
            let acceleration = if left > 0.0 && right > 0.0 {
                let after = (place(b) - place(middle)) / right;
                let before = (place(middle) - place(a)) / left;
                2.0 * (after - before) / (left + right)
            } else {
                Vector3::zeros()
            };
            let felt = Vector3::new(0.0, 0.0, -GRAVITY) - acceleration;
            along * hand[row].rotation.inverse_transform_vector(&felt)
        })
        .collect()
}

/// Finds the rows between which something is held.
fn spans(
    recording: &Recording,
    fingers: Option<&[f64]>,
    notes: &mut Vec<String>,
) -> Result<Vec<Range<usize>>, Error> {
    let time = &recording.time;
    let settled = |span: Range<usize>| {
        let from = time.partition_point(|t| *t < time[span.start] + SETTLE);
        (from < span.end).then_some(from..span.end)
    };
    let runs = |holds: &dyn Fn(usize) -> bool| -> Vec<Range<usize>> {
        let mut found = Vec::new();
        let mut begun = None;
        for row in 0..=time.len() {
            match (row < time.len() && holds(row), begun) {
                (true, None) => begun = Some(row),
                (false, Some(from)) => {
                    found.push(from..row);
                    begun = None;
                }
                _ => {}
            }
        }
        found
    };
    if recording.has("held") {
        let held = recording.column("held", Dimension::NONE)?;
        return Ok(runs(&|row| held[row] > 0.5).into_iter().filter_map(settled).collect());
    }
    let segments: Vec<_> =
        recording.sidecar.segments.iter().filter(|s| s.name.starts_with("held")).collect();
    if !segments.is_empty() {
        let inside = |row: usize| segments.iter().any(|s| (s.from..=s.to).contains(&time[row]));
        return Ok(runs(&inside).into_iter().filter_map(settled).collect());
    }
    let Some(fingers) = fingers else {
        notes.push(wording::all_is_held(&recording.name));
        return Ok(std::iter::once(0..time.len()).collect());
    };
    let widest = fingers.iter().copied().fold(0.0, f64::max);
    let stands = |row: usize| {
        let back = time.partition_point(|t| *t < time[row] - SETTLE);
        let window = &fingers[back..=row];
        let (least, most) =
            window.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
        most < widest - STANDS.1 && least > STILL && most - least < STILL
    };
    let long = |span: &Range<usize>| time[span.end - 1] - time[span.start] > STANDS.0;
    Ok(runs(&stands).into_iter().filter(long).collect())
}

/// Leaves out rows nearer to the one before than [`STRIDE`].
fn thinned(time: &[f64], rows: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut kept: Vec<usize> = Vec::new();
    for row in rows {
        if kept.last().is_none_or(|last| time[row] - time[*last] > STRIDE - 1e-9) {
            kept.push(row);
        }
    }
    kept
}

/// Says that a thing turned in the fingers, which no effect has a name for.
fn pivoted(
    name: &str,
    hand: &[Isometry3<f64>],
    turned: &[UnitQuaternion<f64>],
    stretches: &[Vec<usize>],
) -> Option<String> {
    let most = stretches
        .iter()
        .map(|rows| {
            let part = rows.len().div_ceil(4);
            let mean = |rows: &[usize]| {
                let sum = rows.iter().fold(Matrix3::zeros(), |sum, &row| {
                    let turn = hand[row].rotation.inverse() * turned[row];
                    sum + turn.to_rotation_matrix().into_inner()
                });
                Rotation3::from_matrix(&sum)
            };
            mean(&rows[..part]).angle_to(&mean(&rows[rows.len() - part..]))
        })
        .fold(0.0, f64::max);
    (most > 0.035).then(|| wording::pivoted(name, most))
}

/// Returns by how much an opening differs from what is between the fingers, and which axis of the thing that
/// is. `across` is along the fingers' way, in the thing's frame, if its turn was seen.
fn between(object: &Object, opening: f64, across: Option<Vector3<f64>>) -> (f64, usize) {
    let size = match &object.shape {
        Shape::Cuboid { size } => [size.x, size.y],
        // Where between its narrowest and its widest place it is held nobody says.
        other => return (opening - other.between(opening), 0),
    };
    let axis = match across {
        Some(across) => usize::from(across.y.abs() > across.x.abs()),
        None => usize::from((opening - size[1]).abs() < (opening - size[0]).abs()),
    };
    (opening - size[axis], axis)
}

/// Returns the height, m, at which the thing was seen before it was taken, if it stood still there.
fn standing(time: &[f64], seen: &[Vector3<f64>], taken: usize) -> Option<f64> {
    // The fingers close last, and what they touch may shift.
    let end = time.partition_point(|t| *t < time[taken] - 1.0);
    let heights: Vec<f64> = seen[..end].iter().map(|place| place.z).collect();
    let spread = heights.iter().fold((f64::MAX, f64::MIN), |(a, b), z| (a.min(*z), b.max(*z)));
    (heights.len() >= 4 && spread.1 - spread.0 < 0.01).then(|| median(heights))
}

/// Returns by how much a seen height differs from the scene's, and which part of the thing's height it is.
fn over(object: &Object, told: &HeldObject, scene: &Scene, z: f64) -> Option<(f64, f64)> {
    let part = match told.origin {
        // The base of a thing stands on the table however high the thing is.
        Origin::Base => return None,
        Origin::Centre => 0.5,
        Origin::Top => 1.0,
    };
    let table = scene.world_from_base.isometry().inverse() * Point3::origin();
    Some((z - table.z - part * object.shape.height(), part))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
