//! Regression 3: where the arm really is when it reports its joints.
//!
//! The paper's `D` (Eq. 7) is one transform of the work space, and that is what a base that stands elsewhere
//! makes. Encoders with wrong zeros and a gripper beside its place make errors that turn with the arm: a
//! `D` fitted to a hand that points ahead is off by a centimetre when it points aside. So the three are
//! fitted together, from the pixels at which one camera saw the marker ball on the gripper:
//!
//! ```text
//! real tool = D⁻¹ · base · FK(q + zeros) · (flange + shift) · tool
//! ```
//!
//! Much of it cannot be told apart (a turned base and the zero of joint 1), which priors leave undecided
//! and which does no harm: what counts is where the tool is.
//!
//! Source: the paper, "Robot offset", Eq. 7; Hollerbach, Khalil and Gautier, "Model Identification", Springer
//! Handbook of Robotics, 2nd ed., §6.2 (kinematic calibration, open loop).

use nalgebra::{DMatrix, UnitQuaternion, Vector3};

use crate::alignment::Error;
use crate::fit::{self, Noise, Prior, Residuals};
use crate::motion::robot::Robot;
use crate::world::frame::{Base, Flange, World};
use crate::world::{Camera, Pixel, Point, Pose};

/// One stop of the touch-off.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop {
    /// The joint positions the arm reports, rad.
    pub q: Vec<f64>,
    /// Where the camera sees the middle of the marker ball.
    pub pixel: Pixel,
    /// Standard deviation of the pixel, per coordinate, px.
    pub sigma: f64,
}

/// What is known of the arm beforehand: standard deviations about none, per axis or joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Priors {
    /// Of the base's shift, at the centre of the points, m.
    pub shift: f64,
    /// Of the base's turn, rad.
    pub turn: f64,
    /// Of an encoder's zero, rad.
    pub zero: f64,
    /// Of the gripper on the flange, m.
    pub tool: f64,
}

impl Default for Priors {
    /// An arm that was set up with care: 2 cm and 2° for its base, half a degree for a zero, 3 mm for the gripper.
    /// Chosen: they hold what the stops leave undecided. With half of them an arm whose base stands 4 cm beside its
    /// place is drawn back towards it; with twice as much a turned base and the zero of joint 1 grow against each
    /// other until the tool is off where nobody looked. `tests/execution/arm_fit.rs` plants shifts up to 12 mm, zeros
    /// up to 0.9° and 4 mm at the gripper.
    fn default() -> Self {
        Self { shift: 0.02, turn: 0.035, zero: 0.009, tool: 0.003 }
    }
}

/// The arm as it really is.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmFit {
    /// `D`: carries a real pose to the one the arm, with its zeros put right, takes for it.
    pub reported_from_real: Pose<World, World>,
    /// Real angle less the reported one, rad, a joint each.
    pub zeros: Vec<f64>,
    /// How far the gripper sits from its place, m, in the flange's frame.
    pub tool_shift: Vector3<f64>,
    /// How far the marker really is from where the arm says, root mean square over the stops, m.
    pub off: f64,
    /// Standard deviation of where the marker is after the fit, along one axis of the table, root mean square over the stops
    /// kept, m.
    pub std: f64,
    /// Root mean square reprojection error of the stops kept, before the fit, px.
    pub rms_before_px: f64,
    /// The same after it, px.
    pub rms_px: f64,
    /// Stops left out, in order.
    pub outliers: Vec<usize>,
}

/// What the servo leaves undone (sag, friction at rest), as a part of the picture, px at most stops. Chosen: 0.3 mm
/// at the 1 m and 900 px focal length of the kitchen's camera, which is what an arm that follows within 0.5 mrad is
/// off at 0.6 m. With half of it sub-pixel sightings outvote the priors by what is not theirs; with twice as much a
/// stop that is really off is no longer left out.
const SERVO_PX: f64 = 0.25;
/// A stop farther off than this many standard deviations is left out: 1 in 3000 clean ones, of two coordinates
/// (`exp(-4² / 2)`).
const CUT: f64 = 4.0;
/// Base: three shifts and three turns; gripper: three shifts.
const BASE: usize = 6;
const TOOL: usize = 3;
/// Fewest stops that say more than the priors: twelve numbers, twice those of the base. With half of them they are as
/// many as the base alone has; with twice as many a scene that hides most points could not be calibrated.
pub const NEEDED: usize = 6;

/// Returns the standard deviation along one axis of the table of a place that follows from parameters, m.
fn sideways(
    place: &dyn Fn(&[f64]) -> Option<Vector3<f64>>,
    x: &[f64],
    covariance: &DMatrix<f64>,
) -> f64 {
    /// Step of the differences: rad and m, far above rounding and far below what bends.
    const STEP: f64 = 1e-6;
    let mut jacobian = DMatrix::zeros(2, x.len());
    let mut moved = x.to_vec();
    for k in 0..x.len() {
        let mut at = |by: f64| {
            moved[k] = x[k] + by;
            place(&moved)
        };
        let (Some(up), Some(down)) = (at(STEP), at(-STEP)) else { return f64::INFINITY };
        moved[k] = x[k];
        jacobian.set_column(k, &((up - down).xy() / (2.0 * STEP)));
    }
    ((&jacobian * covariance * jacobian.transpose()).trace().max(0.0) / 2.0).sqrt()
}

/// Finds where the arm really is from stops at which one camera saw the marker ball.
///
/// `marker` is the middle of the ball in the flange's frame, m. The camera is taken as true; calibrate it
/// first.
///
/// # Errors
///
/// [`Error::TooFew`] below [`NEEDED`] stops, [`Error::BehindCamera`], [`Error::NotFinite`], and what the
/// solver says.
pub fn fit_arm(
    robot: &Robot,
    world_from_base: Pose<World, Base>,
    marker: Point<Flange>,
    camera: &Camera,
    stops: &[Stop],
    priors: &Priors,
) -> Result<ArmFit, Error> {
    let (given, n) = (stops.len(), robot.n_joints());
    if given < NEEDED {
        return Err(Error::TooFew { what: "rigid", of: "sightings", needed: NEEDED, given });
    }
    let place = |stop: &Stop, zeros: &[f64], shift: Vector3<f64>| {
        let q: Vec<f64> = stop.q.iter().zip(zeros).map(|(q, zero)| q + zero).collect();
        let ball = Point::<Flange>::from(marker.coords() + shift);
        robot
            .forward(&q)
            .ok()
            .map(|base_from_flange| (world_from_base * (base_from_flange * ball)).coords())
    };
    let nowhere = vec![0.0; n];
    let mut reported = Vec::new();
    for (row, stop) in stops.iter().enumerate() {
        let numbers = stop.q.iter().chain([&stop.pixel.u, &stop.pixel.v, &stop.sigma]);
        let at = place(stop, &nowhere, Vector3::zeros())
            .filter(|_| numbers.clone().all(|v| v.is_finite()));
        reported.push(at.ok_or(Error::NotFinite { what: "the stops", row })?);
    }
    let centre = reported.iter().sum::<Vector3<f64>>() / given as f64;
    let real = |x: &[f64], stop: &Stop| {
        let shift = Vector3::new(x[0], x[1], x[2]);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(x[3], x[4], x[5]));
        let (zeros, tool) = x[BASE..].split_at(n);
        let at = place(stop, zeros, Vector3::new(tool[0], tool[1], tool[2]))?;
        Some(centre + shift + turn * (at - centre))
    };
    let sigma = |stop: &Stop| stop.sigma.hypot(SERVO_PX);
    let problem = Residuals {
        n: 2 * given,
        block: 2,
        function: |x: &[f64], r: &mut [f64]| {
            for (stop, r) in stops.iter().zip(r.chunks_exact_mut(2)) {
                let seen = real(x, stop).and_then(|real| camera.project(Point::from(real)));
                match seen {
                    Some(p) => {
                        r[0] = (p.u - stop.pixel.u) / sigma(stop);
                        r[1] = (p.v - stop.pixel.v) / sigma(stop);
                    }
                    None => r.fill(f64::INFINITY),
                }
            }
        },
    };
    let std = |i: usize| match i {
        0..3 => priors.shift,
        3..BASE => priors.turn,
        i if i < BASE + n => priors.zero,
        _ => priors.tool,
    };
    let parameters = BASE + n + TOOL;
    let options = fit::Options {
        priors: (0..parameters).map(|i| Prior { parameter: i, mean: 0.0, std: std(i) }).collect(),
        noise: Noise::Known,
        ..fit::Options::default()
    };
    let start = vec![0.0; parameters];
    let mut before = vec![0.0; 2 * given];
    fit::Problem::residuals(&problem, &start, &mut before);
    if let Some(at) = before.iter().position(|r| !r.is_finite()) {
        return Err(Error::BehindCamera { row: at / 2 });
    }
    let found = fit::solve_rejecting(&problem, &start, &options, CUT)?;
    let x = &found.fit.x;
    let kept: Vec<usize> = (0..given).filter(|i| !found.outliers.contains(i)).collect();
    let mean = |of: &dyn Fn(usize) -> f64| {
        (kept.iter().map(|&i| of(i).powi(2)).sum::<f64>() / kept.len().max(1) as f64).sqrt()
    };
    let rms = |r: &[f64]| mean(&|i| sigma(&stops[i]) * r[2 * i].hypot(r[2 * i + 1]));
    let shift = Vector3::new(x[0], x[1], x[2]);
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(x[3], x[4], x[5]));
    let real_from_reported: Pose<World, World> =
        Pose::from_parts(centre + shift - turn * centre, turn);
    Ok(ArmFit {
        reported_from_real: real_from_reported.inverse(),
        zeros: x[BASE..BASE + n].to_vec(),
        tool_shift: Vector3::from_column_slice(&x[BASE + n..]),
        off: mean(&|i| real(x, &stops[i]).map_or(0.0, |real| (real - reported[i]).norm())),
        std: mean(&|i| sideways(&|x| real(x, &stops[i]), x, &found.fit.covariance)),
        rms_before_px: rms(&before),
        rms_px: rms(&found.fit.residuals),
        outliers: found.outliers,
    })
}
