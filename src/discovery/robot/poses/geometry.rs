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
use super::data::Pose;
use crate::discovery::finding::Identified;
use crate::motion::revise::{JointChange, Revision};

/// Numbers of each joint: where it sits in the link before it, the two turns of its axis, its zero.
const OF_JOINT: usize = 6;
/// Numbers of the tool and of the tracker.
const BESIDE: usize = 9;

/// Turns of the fit: a few millimetres are linear after the second.
const TURNS: usize = 6;

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
    pub(super) fn fitted(chain: &Chain, poses: &[&Pose]) -> Option<Self> {
        let poses: Vec<&Pose> = poses.iter().copied().filter(|pose| pose.tip.is_some()).collect();
        let p = chain.n() * OF_JOINT + BESIDE;
        let rows = 3 * poses.len();
        if (rows as f64) < BESIDE as f64 + LEAST_BEYOND {
            return None;
        }
        let free = p - BESIDE;
        let is_free = independent(&linear(chain, &poses, &DVector::zeros(p)).0, chain.n());
        let scales = |spread: f64| {
            DVector::from_fn(p, |k, _| match k {
                _ if !is_free[k] => 0.0,
                _ if k < free => spread,
                _ => ANYWHERE,
            })
        };
        let mut best: Option<(f64, Self)> = None;
        for half in SPREADS {
            let spread = 10_f64.powf(f64::from(half) / 2.0);
            let scale = scales(spread);
            let mut x = DVector::zeros(p);
            let mut end = None;
            for _ in 0..TURNS {
                let (columns, left) = linear(chain, &poses, &x);
                // In units of the spreads; what nothing holds is solved for, what shows nowhere stays.
                let scaled = DMatrix::from_fn(rows, p, |i, k| columns[(i, k)] * scale[k]);
                let svd = scaled.svd(true, true);
                let (u, v_t) = (svd.u?, svd.v_t?);
                // The noise beside which a spread is judged: what the fit leaves, found turn by turn.
                let noise = end.as_ref().map_or(1e-3, |(_, _, noise): &(_, _, f64)| *noise);
                let here =
                    DVector::from_fn(p, |k, _| if is_free[k] { x[k] / scale[k] } else { 0.0 });
                let target = u.tr_mul(&(&left + &columns * &x));
                let shrink = |s: f64| s * s / (s * s + noise * noise);
                let told: f64 = svd.singular_values.iter().map(|s| shrink(*s)).sum();
                let inner = DVector::from_fn(svd.singular_values.len(), |k, _| {
                    let s = svd.singular_values[k];
                    if s > 0.0 { shrink(s) * target[k] / s } else { 0.0 }
                });
                let next = v_t.tr_mul(&inner);
                let moved = (&next - here).amax();
                x = DVector::from_fn(p, |k, _| next[k] * scale[k]);
                let rest = linear(chain, &poses, &x).1.norm_squared();
                let beyond = rows as f64 - told;
                if beyond < LEAST_BEYOND {
                    return best.map(|(_, found)| found);
                }
                let noise = (rest / beyond).sqrt().max(1e-12);
                let variances = DVector::from_fn(svd.singular_values.len(), |k, _| {
                    noise * noise / (svd.singular_values[k].powi(2) + noise * noise)
                });
                let inner = DMatrix::identity(p, p) - v_t.tr_mul(&v_t)
                    + v_t.transpose() * DMatrix::from_diagonal(&variances) * &v_t;
                let covariance = DMatrix::from_fn(p, p, |i, k| inner[(i, k)] * scale[i] * scale[k]);
                end = Some((told, covariance, noise));
                if moved < 1e-9 {
                    break;
                }
            }
            let (told, covariance, noise) = end?;
            // Generalised cross-validation.
            let score = noise * noise / (1.0 - told / rows as f64);
            if best.as_ref().is_none_or(|(least, _)| score < *least) {
                let is_free = is_free.clone();
                best = Some((
                    score,
                    Self {
                        x,
                        covariance,
                        spread,
                        noise,
                        told,
                        beyond: rows as f64 - told,
                        is_free,
                    },
                ));
            }
        }
        best.map(|(_, found)| found)
    }

    /// Returns the arm with this geometry, tool included, and how the tracker sees its base.
    pub(super) fn applied(&self, chain: &Chain) -> (Chain, [f64; MOST_JOINTS], Isometry3<f64>) {
        changed(chain, &self.x)
    }

    /// Returns what this geometry changes in the arm's file; `tip` is the link whose place was seen.
    pub(super) fn revision(&self, chain: &Chain, tip: &str) -> Revision {
        let own = |j: usize| &self.x.as_slice()[j * OF_JOINT..(j + 1) * OF_JOINT];
        let of_joint = |(j, body): (usize, &Body)| {
            let (own, [first, second]) = (own(j), across(&body.axis));
            let tilt = UnitQuaternion::from_scaled_axis(first * own[3] + second * own[4]);
            let zero = if body.slides {
                Isometry3::from(Translation3::from(body.axis.into_inner() * own[5]))
            } else {
                Isometry3::rotation(body.axis.into_inner() * own[5])
            };
            let before = Vector3::new(own[0], own[1], own[2]);
            JointChange { link: body.name.clone(), before, after: tilt * zero }
        };
        let mut joints: Vec<JointChange> = chain.bodies.iter().enumerate().map(of_joint).collect();
        let tool = &self.x.as_slice()[chain.n() * OF_JOINT..];
        let after = Isometry3::translation(tool[0], tool[1], tool[2]);
        // A tip that moves by itself has no joint that only carries it.
        if chain.bodies.iter().all(|body| body.name != tip) {
            joints.push(JointChange { link: tip.into(), before: Vector3::zeros(), after });
        }
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
                    file: place[axis],
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
                file: tool[axis],
                value: tool[axis] + by,
                std,
                unit: "m".into(),
            });
        }
        found
    }
}

/// Readings beyond those that tell the geometry, so that what is left says something of the noise.
const LEAST_BEYOND: f64 = 6.0;

/// Two directions across a joint's axis, nearest to the frame's own.
fn across(axis: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let along = axis.iamax();
    let of = |k: usize| Vector3::ith((along + k) % 3, 1.0);
    [of(1), of(2)]
}

/// Returns an arm with other numbers of its geometry, its zeros, and how the tracker sees its base.
fn changed(chain: &Chain, x: &DVector<f64>) -> (Chain, [f64; MOST_JOINTS], Isometry3<f64>) {
    let mut chain = chain.clone();
    let mut zero = [0.0; MOST_JOINTS];
    for (j, body) in chain.bodies.iter_mut().enumerate() {
        let own = &x.as_slice()[j * OF_JOINT..(j + 1) * OF_JOINT];
        let [first, second] = across(&body.axis);
        let tilt = UnitQuaternion::from_scaled_axis(first * own[3] + second * own[4]);
        let shift = Translation3::new(own[0], own[1], own[2]);
        body.sit(shift * body.parent_from_body * tilt);
        zero[j] = own[5];
    }
    let rest = &x.as_slice()[chain.n() * OF_JOINT..];
    chain.body_from_tip *= Translation3::new(rest[0], rest[1], rest[2]);
    let turn = Rotation3::from_euler_angles(rest[6], rest[7], rest[8]);
    let seen = Isometry3::from_parts(Translation3::new(rest[3], rest[4], rest[5]), turn.into());
    (chain, zero, seen)
}

/// Returns where the tips are with these numbers, one axis after the other.
fn tips(chain: &Chain, poses: &[&Pose], x: &DVector<f64>) -> DVector<f64> {
    let (chain, zero, seen) = changed(chain, x);
    let tips = poses.iter().flat_map(|pose| {
        let mut q = zero;
        q.iter_mut().zip(&pose.q).for_each(|(to, q)| *to += q);
        let tip = seen * nalgebra::Point3::from(chain.tip(&q[..pose.q.len()]));
        [tip.x, tip.y, tip.z]
    });
    DVector::from_iterator(3 * poses.len(), tips)
}

/// Returns how the tips change with each number, and measured minus predicted, m.
fn linear(chain: &Chain, poses: &[&Pose], x: &DVector<f64>) -> (DMatrix<f64>, DVector<f64>) {
    let here = tips(chain, poses, x);
    let mut columns = DMatrix::zeros(here.len(), x.len());
    for k in 0..x.len() {
        let mut moved = x.clone();
        moved[k] += STEP;
        columns.set_column(k, &((tips(chain, poses, &moved) - &here) / STEP));
    }
    let measured = poses.iter().filter_map(|pose| pose.tip).flat_map(|tip| [tip.x, tip.y, tip.z]);
    (columns, DVector::from_iterator(here.len(), measured) - here)
}
