//! All numbers of an arm's geometry at once: where every joint sits, how its axis is turned, its zero, the tool, and where the
//! tracker stands.
//!
//! Many of them show only in sums. Of those that say the same the first is kept: the tracker and the tool, then zeros, places
//! of joints, turns of axes. A maker's file is off by a little in each, so each is held near the file's, all by one strength:
//! a millimetre beside a milliradian, for an arm reaches about a metre. The strength is the one that would predict left-out
//! poses best (generalised cross-validation). The tracker and the tool are where they are: nothing holds them.
//!
//! Source: Hollerbach and Wampler, "The calibration index and taxonomy for robot kinematic calibration methods", 1996; Golub,
//! Heath and Wahba, "Generalized cross-validation as a method for choosing a good ridge parameter", 1979.

use nalgebra::{DMatrix, DVector, Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::super::chain::{Body, Chain, MOST_JOINTS};
use super::super::term::Term;
use super::at_rest::Pose;
use super::model::AtRest;
use crate::discovery::finding::Identified;
use crate::motion::revise::{JointChange, Revision};

/// Numbers of each joint: where it sits in the link before it, the two turns of its axis, its zero.
const OF_JOINT: usize = 6;
/// Numbers of the tool and of the tracker.
const BESIDE: usize = 9;

/// Turns of the fit: a few millimetres are linear after the second, and the noise settles with them.
const TURNS: usize = 20;

/// A number that moves by less than this, m or rad, has arrived.
const SETTLED: f64 = 1e-9;

/// Strengths of the hold that are tried: standard deviations of a file's numbers, m and rad, in halves of a decade.
const SPREADS: std::ops::Range<i32> = -11..-1;

/// A number is told if the data say more of it than the file does: its uncertainty fell to this part.
const TOLD: f64 = 0.5;

/// Unknown places of tracker and tool, m and rad: as good as anywhere.
const ANYWHERE: f64 = 10.0;

/// A change for derivatives, m and rad.
const STEP: f64 = 1e-6;

/// The geometry that poses say an arm has.
pub(super) struct Geometry {
    x: DVector<f64>,
    covariance: DMatrix<f64>,
    spread: f64,
    /// What is left of one axis of the tip, m: with everything that the geometry can explain taken away.
    pub(super) noise: f64,
    /// How many of its numbers the poses tell.
    pub(super) told: f64,
    /// How many readings there are beyond those that tell them.
    pub(super) beyond: f64,
    /// Whether each number was free: no sum of others says the same.
    is_free: Vec<bool>,
}

/// A number of which less than this part is its own says what others say.
const OWN: f64 = 0.02;

/// Returns which numbers say something that those before them, in the order of preference, do not say.
fn independent(columns: &DMatrix<f64>, n: usize) -> Vec<bool> {
    let of_joints = |parts: std::ops::Range<usize>| {
        (0..n).flat_map(move |j| parts.clone().map(move |k| j * OF_JOINT + k))
    };
    let beside = n * OF_JOINT..n * OF_JOINT + BESIDE;
    let order = beside.chain(of_joints(5..6)).chain(of_joints(0..3)).chain(of_joints(3..5));
    let mut is_free = vec![false; columns.ncols()];
    let mut kept: Vec<DVector<f64>> = Vec::new();
    for k in order {
        let mut left = columns.column(k).into_owned();
        let whole = left.norm();
        // Twice, for the first round leaves rounding.
        for basis in kept.iter().chain(&kept) {
            left -= basis * basis.dot(&left);
        }
        if left.norm() > OWN * whole && whole > 0.0 {
            is_free[k] = true;
            kept.push(left.normalize());
        }
    }
    is_free
}

impl Geometry {
    /// Returns how many numbers there are.
    pub(super) fn count(&self) -> usize {
        self.x.len()
    }

    /// Returns how many of them say something that no sum of others says.
    pub(super) fn rank(&self) -> usize {
        self.is_free.iter().filter(|is_free| **is_free).count()
    }

    /// Fits all numbers to the tips of some poses; `None` where there are not clearly more readings than they tell.
    pub(super) fn fitted(arm: &Seen<'_>) -> Option<Self> {
        let p = arm.chain.n() * OF_JOINT + BESIDE;
        if ((3 * arm.poses.len()) as f64) < BESIDE as f64 + LEAST_BEYOND {
            return None;
        }
        let is_free = independent(&arm.linear(&DVector::zeros(p)).0, arm.chain.n());
        let spreads = SPREADS.map(|half| 10_f64.powf(f64::from(half) / 2.0));
        let fits = spreads.filter_map(|spread| Self::held(arm, spread, &is_free));
        // Generalised cross-validation.
        let score = |fit: &Self| fit.noise.powi(2) * (1.0 + fit.told / fit.beyond);
        fits.min_by(|a, b| score(a).total_cmp(&score(b)))
    }

    /// Fits with the numbers held near the file's by a spread, m and rad; `None` where too few readings are left over.
    fn held(arm: &Seen<'_>, spread: f64, is_free: &[bool]) -> Option<Self> {
        let (p, rows) = (is_free.len(), 3 * arm.poses.len());
        let scale = DVector::from_fn(p, |k, _| match k {
            _ if !is_free[k] => 0.0,
            _ if k < p - BESIDE => spread,
            _ => ANYWHERE,
        });
        // What the fit leaves, found turn by turn; at first a millimetre.
        let (mut x, mut noise) = (DVector::zeros(p), 1e-3);
        for _ in 0..TURNS {
            let (columns, left) = arm.linear(&x);
            // In units of the spreads; what nothing holds is solved for, what shows nowhere stays.
            let scaled = DMatrix::from_fn(rows, p, |i, k| columns[(i, k)] * scale[k]);
            let svd = scaled.svd(true, true);
            let (u, v_t, sizes) = (svd.u?, svd.v_t?, svd.singular_values);
            let target = u.tr_mul(&(&left + &columns * &x));
            let parts = sizes.map(|s| s * s / (s * s + noise * noise));
            let inner = DVector::from_fn(sizes.len(), |k, _| {
                if sizes[k] > 0.0 { parts[k] * target[k] / sizes[k] } else { 0.0 }
            });
            let next = v_t.tr_mul(&inner).component_mul(&scale);
            let moved = (&next - &x).amax();
            x = next;
            let told = parts.sum();
            let beyond = rows as f64 - told;
            if beyond < LEAST_BEYOND {
                return None;
            }
            noise = (arm.linear(&x).1.norm_squared() / beyond).sqrt().max(1e-12);
            if moved < SETTLED {
                let kept = DMatrix::from_diagonal(&sizes.map(|s| s * s / (s * s + noise * noise)));
                let inner = DMatrix::identity(p, p) - v_t.transpose() * kept * &v_t;
                let covariance = DMatrix::from_fn(p, p, |i, k| inner[(i, k)] * scale[i] * scale[k]);
                let is_free = is_free.to_vec();
                return Some(Self { x, covariance, spread, noise, told, beyond, is_free });
            }
        }
        None
    }

    /// Returns the arm with this geometry, tool included, and how the tracker sees its base.
    pub(super) fn applied(&self, chain: &Chain) -> (Chain, [f64; MOST_JOINTS], Isometry3<f64>) {
        changed(chain, &self.x)
    }

    /// Returns what this geometry changes in the arm's file; `tip` is the link whose place was seen.
    pub(super) fn revision(&self, chain: &Chain, tip: &str) -> Revision {
        let of_joint = |(j, body): (usize, &Body)| {
            let (before, tilt, zero) = joint(&self.x, j, body);
            let along = body.axis.into_inner() * zero;
            let zero = if body.slides {
                Isometry3::translation(along.x, along.y, along.z)
            } else {
                Isometry3::rotation(along)
            };
            JointChange { link: body.name.clone(), before, after: tilt * zero }
        };
        let mut joints: Vec<JointChange> = chain.bodies.iter().enumerate().map(of_joint).collect();
        let tool = &self.x.as_slice()[chain.n() * OF_JOINT..];
        let after = Isometry3::translation(tool[0], tool[1], tool[2]);
        // A tip that moves by itself has no joint that only carries it.
        if chain.bodies.iter().all(|body| body.name != tip) {
            joints.push(JointChange { link: tip.into(), before: Vector3::zeros(), after });
        }
        joints.retain(|joint| joint.before.norm() > 0.0 || joint.after != Isometry3::identity());
        Revision { links: Vec::new(), joints }
    }

    /// Returns the numbers of which the poses say more than the file does, and something else.
    pub(super) fn off(&self, chain: &Chain) -> Vec<Identified> {
        let n = chain.n();
        let mut found = Vec::new();
        let mut tell = |at: usize, prior: f64, entry: &dyn Fn(f64, f64) -> Identified| {
            let std = self.covariance[(at, at)].max(0.0).sqrt();
            if self.is_free[at] && std < TOLD * prior && self.x[at].abs() > 2.0 * std {
                found.push(entry(self.x[at], std));
            }
        };
        for j in 0..n {
            let body = &chain.bodies[j];
            let place = body.parent_from_body.translation.vector;
            let at = format!("joint_{}", j + 1);
            for (axis, parameter) in ["x", "y", "z"].into_iter().enumerate() {
                tell(j * OF_JOINT + axis, self.spread, &|by, std| Identified {
                    name: "link_length".into(),
                    at: at.clone(),
                    parameter: parameter.into(),
                    file: filed(place[axis]),
                    value: place[axis] + by,
                    std,
                    unit: "m".into(),
                });
            }
            let axes = across(&body.axis);
            for (k, axis) in axes.iter().enumerate() {
                let parameter = format!("about_{}", ["x", "y", "z"][axis.iamax()]);
                tell(j * OF_JOINT + 3 + k, self.spread, &|by, std| Identified {
                    name: "axis_tilt".into(),
                    at: at.clone(),
                    parameter: parameter.clone(),
                    file: 0.0,
                    value: by,
                    std,
                    unit: "rad".into(),
                });
            }
            tell(j * OF_JOINT + 5, self.spread, &|by, std| Identified {
                name: "joint_zero_offset".into(),
                at: at.clone(),
                parameter: "angle".into(),
                file: 0.0,
                value: by,
                std,
                unit: "rad".into(),
            });
        }
        let tool = chain.body_from_tip.translation.vector;
        for (axis, parameter) in ["x", "y", "z"].into_iter().enumerate() {
            tell(n * OF_JOINT + axis, ANYWHERE, &|by, std| Identified {
                name: "tool_offset".into(),
                at: "tool".into(),
                parameter: parameter.into(),
                file: filed(tool[axis]),
                value: tool[axis] + by,
                std,
                unit: "m".into(),
            });
        }
        found
    }
}

/// A length of a file below this, m, is 0, as it is left by turns along the file's frames.
const ROUNDING: f64 = 1e-12;

/// A length as a file has it, m.
fn filed(length: f64) -> f64 {
    if length.abs() < ROUNDING { 0.0 } else { length }
}

/// Readings beyond those that explain them, so that what is left says something of the noise.
pub(super) const LEAST_BEYOND: f64 = 6.0;

/// Two directions across a joint's axis, nearest to the frame's own.
fn across(axis: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let along = axis.iamax();
    let of = |k: usize| Vector3::ith((along + k) % 3, 1.0);
    [of(1), of(2)]
}

/// Returns the numbers of one joint: where it sits further, m, the turn of its axis, its zero, rad or m.
fn joint(x: &DVector<f64>, j: usize, body: &Body) -> (Vector3<f64>, UnitQuaternion<f64>, f64) {
    let own = &x.as_slice()[j * OF_JOINT..(j + 1) * OF_JOINT];
    let [first, second] = across(&body.axis);
    let tilt = UnitQuaternion::from_scaled_axis(first * own[3] + second * own[4]);
    (Vector3::from_column_slice(&own[..3]), tilt, own[5])
}

/// Returns an arm with other numbers of its geometry, its zeros, and how the tracker sees its base.
fn changed(chain: &Chain, x: &DVector<f64>) -> (Chain, [f64; MOST_JOINTS], Isometry3<f64>) {
    let mut chain = chain.clone();
    let mut zeros = [0.0; MOST_JOINTS];
    for (j, body) in chain.bodies.iter_mut().enumerate() {
        let (shift, tilt, zero) = joint(x, j, body);
        body.sit(Translation3::from(shift) * body.parent_from_body * tilt);
        zeros[j] = zero;
    }
    let rest = &x.as_slice()[chain.n() * OF_JOINT..];
    chain.body_from_tip *= Translation3::new(rest[0], rest[1], rest[2]);
    let turn = Rotation3::from_euler_angles(rest[6], rest[7], rest[8]);
    let seen = Isometry3::from_parts(Translation3::new(rest[3], rest[4], rest[5]), turn.into());
    (chain, zeros, seen)
}

/// An arm with what its model knows already, and the poses in which its tip was seen.
pub(super) struct Seen<'a> {
    chain: &'a Chain,
    known: &'a (Vec<Term>, Vec<f64>),
    poses: Vec<&'a Pose>,
}

impl<'a> Seen<'a> {
    /// Takes the poses in which the tip was seen.
    pub(super) fn of(
        chain: &'a Chain,
        known: &'a (Vec<Term>, Vec<f64>),
        poses: &'a [Pose],
    ) -> Self {
        Self { chain, known, poses: poses.iter().filter(|pose| pose.tip.is_some()).collect() }
    }

    /// Returns where the tips are with these numbers, one axis after the other.
    fn tips(&self, x: &DVector<f64>) -> DVector<f64> {
        let (chain, zeros, seen) = changed(self.chain, x);
        let arm = AtRest::of(&chain, &self.known.0, &self.known.1);
        let tips = self.poses.iter().flat_map(|pose| {
            let q: Vec<f64> = pose.q.iter().zip(zeros).map(|(q, zero)| q + zero).collect();
            let tip = seen * nalgebra::Point3::from(arm.tip(&q));
            [tip.x, tip.y, tip.z]
        });
        DVector::from_iterator(3 * self.poses.len(), tips)
    }

    /// Returns how the tips change with each number, and measured minus predicted, m.
    fn linear(&self, x: &DVector<f64>) -> (DMatrix<f64>, DVector<f64>) {
        let here = self.tips(x);
        let mut columns = DMatrix::zeros(here.len(), x.len());
        for k in 0..x.len() {
            let mut moved = x.clone();
            moved[k] += STEP;
            columns.set_column(k, &((self.tips(&moved) - &here) / STEP));
        }
        let measured = self.poses.iter().filter_map(|pose| pose.tip);
        let measured = measured.flat_map(|tip| [tip.x, tip.y, tip.z]);
        (columns, DVector::from_iterator(here.len(), measured) - here)
    }
}
