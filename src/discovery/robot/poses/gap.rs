//! Poses at rest as something to be explained: [`Residuals`] over laws that show at rest.

use nalgebra::{DMatrix, DVector, Vector3};

use super::super::chain::MOST_JOINTS;
use super::super::plant::Arm;
use super::super::term::{Law, SENSIBLE_GAIN, SHIFTS, Term};
use super::super::{estimates, known, wording};
use super::at_rest::{Pose, largest_zero};
use super::geometry::{Geometry, LEAST_BEYOND};
use super::model::AtRest;
use crate::alignment::rigid::motion_between;
use crate::discovery::Trace;
use crate::discovery::finding::{Channel, ParameterEstimate};
use crate::discovery::recording::Error;
use crate::discovery::resample;
use crate::discovery::selection::{Candidate, Hypothesis, ParameterSpec, Residuals, Set};
use crate::discovery::why::{Left, Seen, Shows, State};
use crate::discovery::wording::Worded;
use crate::language::ast::EffectItem;

/// The noise of what was read.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Noise {
    /// Of each axis of the tip, m.
    pub(super) tip: f64,
    /// Of each joint's torque, N·m.
    pub(super) tau: Vec<f64>,
    /// By how many readings beyond those that explain them it is known.
    pub(super) beyond: f64,
}

/// How many readings the noise common to all joints counts for beside a joint's own: a few poses say little of one joint.
const COMMON: f64 = 4.0;

/// The largest error of a length that is an error of a file, as a part of the arm's reach.
const LONGEST: f64 = 0.2;

/// Poses of one arm, some to fit and some to judge.
#[derive(Debug, Clone)]
pub(super) struct AtPoses {
    pub(super) arm: Arm,
    train: Vec<Pose>,
    heldout: Vec<Pose>,
    unseen: Vec<Pose>,
    pub(super) known: (Vec<Term>, Vec<f64>),
    pub(super) noise: Noise,
}

impl AtPoses {
    pub(super) fn new(arm: Arm, train: Vec<Pose>, heldout: Vec<Pose>) -> Self {
        let noise = Noise { tip: 1.0, tau: vec![1.0; arm.chain.n()], beyond: f64::INFINITY };
        let apart = |(row, _): &(usize, Pose)| resample::is_unseen_alone(*row);
        let (unseen, heldout): (Vec<_>, Vec<_>) = heldout.into_iter().enumerate().partition(apart);
        let [unseen, heldout] =
            [unseen, heldout].map(|all| all.into_iter().map(|(_, p)| p).collect());
        Self { arm, train, heldout, unseen, known: (Vec::new(), Vec::new()), noise }
    }

    pub(super) fn poses(&self, set: Set) -> &[Pose] {
        match set {
            Set::Train => &self.train,
            Set::Heldout => &self.heldout,
            Set::Unseen => &self.unseen,
        }
    }

    /// Takes the effects that the model has already; returns a sentence for each that does not show at rest.
    ///
    /// # Errors
    ///
    /// An [`Error`] for an effect of the arm that is not written as it must be.
    pub(super) fn take_known(
        &mut self,
        known: &[EffectItem],
        place: &str,
    ) -> Result<Vec<String>, Error> {
        let (mut aside, slides) = (Vec::new(), self.arm.chain.sliding());
        for effect in known {
            let (name, at) = (&effect.name.text, &effect.at.text);
            let read = known::known(effect, &slides)
                .map_err(|misfit| misfit.at(format!("{place}, {}", wording::effect(name, at))))?;
            match read {
                Some((term, values)) => {
                    self.known.0.push(term);
                    self.known.1.extend(values);
                }
                None => aside.push(wording::not_of_the_arm(name, at)),
            }
        }
        Ok(aside)
    }

    /// Tells the tips in the base's frame where the tracker's is clearly another one (`far`: rad and m), and says so.
    pub(super) fn find_tracker(&mut self, far: f64) -> Option<String> {
        let arm = AtRest::of(&self.arm.chain, &self.known.0, &self.known.1);
        let pairs: Vec<_> =
            self.train.iter().filter_map(|pose| Some((arm.read(pose).0?, pose.tip?))).collect();
        let seen = motion_between(&pairs)?;
        let (x, turn) = (seen.translation.vector, seen.rotation.angle());
        if turn < far && x.norm() < far {
            return None;
        }
        for pose in self.train.iter_mut().chain(&mut self.heldout).chain(&mut self.unseen) {
            pose.tip = pose.tip.map(|tip| (seen.inverse() * nalgebra::Point3::from(tip)).coords);
        }
        Some(wording::tracker([x.x, x.y, x.z], seen.rotation.euler_angles()))
    }

    /// Returns the same with another geometry of the arm.
    #[must_use]
    pub(super) fn with_geometry(&self, geometry: &Geometry) -> Self {
        let (chain, zero, seen) = geometry.applied(&self.arm.chain);
        let mut other = self.clone();
        other.arm.chain = chain;
        for pose in other.train.iter_mut().chain(&mut other.heldout).chain(&mut other.unseen) {
            pose.q.iter_mut().zip(zero).for_each(|(q, zero)| *q += zero);
            pose.tip = pose.tip.map(|tip| (seen.inverse() * nalgebra::Point3::from(tip)).coords);
        }
        other
    }

    /// Returns measured minus predicted at every pose, one channel after the other, SI; channels that were not read are
    /// left out.
    fn left(&self, set: Set, terms: &[Term], parameters: &[f64]) -> Vec<(usize, Vec<f64>)> {
        let terms = [&self.known.0[..], terms].concat();
        let parameters = [&self.known.1[..], parameters].concat();
        let arm = AtRest::of(&self.arm.chain, &terms, &parameters);
        let n = self.arm.chain.n();
        let mut channels = vec![Vec::new(); 3 + n];
        for pose in self.poses(set) {
            let (tip, tau) = arm.read(pose);
            if let (Some(read), Some(tip)) = (pose.tip, tip) {
                (0..3).for_each(|axis| channels[axis].push(read[axis] - tip[axis]));
            }
            for (j, (read, tau)) in pose.tau.iter().zip(&tau).enumerate() {
                channels[3 + j].push(read - tau);
            }
        }
        channels.into_iter().enumerate().filter(|(_, left)| !left.is_empty()).collect()
    }

    fn noise_of(&self, channel: usize) -> f64 {
        if channel < 3 { self.noise.tip } else { self.noise.tau[channel - 3] }
    }

    /// Returns measured minus predicted, `filed` without any effect and this with those of `best`, for every channel.
    pub(super) fn traces(&self, filed: &Self, best: &Hypothesis<Term>, name: &str) -> Vec<Trace> {
        let mut found = Vec::new();
        for set in Set::ALL {
            let before = filed.left(set, &[], &[]);
            let after = self.left(set, &best.terms, &best.parameters);
            for ((channel, before), (_, after)) in before.into_iter().zip(after) {
                found.push(Trace {
                    recording: name.to_owned(),
                    channel: channel_name(channel),
                    unit: unit(channel).to_owned(),
                    noise: self.noise_of(channel),
                    sigma: vec![self.noise_of(channel); before.len()],
                    held_out: vec![set != Set::Train; before.len()],
                    unseen: vec![set == Set::Unseen; before.len()],
                    along: "poses",
                    time: (0..before.len()).map(|row| row as f64).collect(),
                    before,
                    after,
                    against: None,
                });
            }
        }
        found
    }
}

fn channel_name(channel: usize) -> String {
    match channel {
        0..3 => format!("tcp_{}", ["x", "y", "z"][channel]),
        _ => format!("tau_{}", channel - 2),
    }
}

fn unit(channel: usize) -> &'static str {
    if channel < 3 { "m" } else { "N*m" }
}

impl Noise {
    /// Judges the noise by what is left once everything that could act at once has been fitted: of the tips the whole
    /// geometry, of the torques every weight, offset and gain. `None` where too little is left to say.
    pub(super) fn of(gap: &AtPoses, geometry: Option<&Geometry>) -> Option<Self> {
        let read = gap.left(Set::Train, &[], &[]);
        let has_tip = read.iter().any(|(channel, _)| *channel < 3);
        let has_torque = read.iter().any(|(channel, _)| *channel >= 3);
        let (mut tip, mut tau) = (1.0, vec![1.0; gap.arm.chain.n()]);
        let mut beyond = f64::INFINITY;
        if has_tip {
            let geometry = geometry?;
            (tip, beyond) = (geometry.noise, geometry.beyond);
        }
        if has_torque {
            let (own, its) = torques(gap)?;
            (tau, beyond) = (own, beyond.min(its));
        }
        Some(Self { tip, tau, beyond })
    }
}

/// Returns the noise of each joint's torques, and by how many readings beyond those that explain them it is known.
fn torques(gap: &AtPoses) -> Option<(Vec<f64>, f64)> {
    let n = gap.arm.chain.n();
    let taus = |terms: &[Term], parameters: &[f64]| -> Vec<f64> {
        let read = gap.left(Set::Train, terms, parameters);
        read.into_iter().filter(|(channel, _)| *channel >= 3).flat_map(|(_, left)| left).collect()
    };
    let here = taus(&[], &[]);
    let rows = here.len() / n;
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut add = |law: Law, joint: usize| {
        let term = Term { law, joint };
        let specs = law.specs();
        let neutral: Vec<f64> = specs.iter().map(|spec| spec.neutral.unwrap_or(0.0)).collect();
        for (k, spec) in specs.iter().enumerate() {
            let mut moved = neutral.clone();
            moved[k] += spec.scale;
            let there = taus(&[term], &moved);
            columns.push(here.iter().zip(&there).map(|(a, b)| (a - b) / spec.scale).collect());
        }
    };
    for joint in 0..n {
        for law in [Law::TorqueOffset, Law::TorqueGain, Law::LinkMass] {
            add(law, joint);
        }
    }
    for law in [Law::Payload, Law::BaseTilt] {
        add(law, 0);
    }
    let matrix = DMatrix::from_fn(here.len(), columns.len(), |i, k| columns[k][i]);
    let svd = matrix.svd(true, false);
    let u = svd.u?;
    let most = svd.singular_values.amax();
    let estimates: Vec<usize> =
        (0..svd.singular_values.len()).filter(|k| svd.singular_values[*k] > 1e-9 * most).collect();
    let beyond = here.len() as f64 - estimates.len() as f64;
    if beyond < LEAST_BEYOND {
        return None;
    }
    let mut left = DVector::from_vec(here.clone());
    for k in &estimates {
        let along = u.column(*k).dot(&left);
        left -= u.column(*k) * along;
    }
    let common = (left.norm_squared() / beyond).max(1e-18);
    // A reading that some number could explain by itself says nothing of the noise.
    let free = |row: usize| 1.0 - estimates.iter().map(|k| u[(row, *k)].powi(2)).sum::<f64>();
    let own = |joint: usize| {
        let rows = joint * rows..(joint + 1) * rows;
        let square: f64 = left.as_slice()[rows.clone()].iter().map(|value| value * value).sum();
        let count: f64 = rows.map(free).sum();
        ((square + COMMON * common) / (count + COMMON)).sqrt()
    };
    Some(((0..n).map(own).collect(), beyond))
}

impl Residuals for AtPoses {
    type Term = Term;

    fn specs(&self, term: &Term) -> Vec<ParameterSpec> {
        term.law.specs()
    }

    fn residuals(&self, set: Set, terms: &[Term], parameters: &[f64]) -> Option<Vec<f64>> {
        let mut all = Vec::new();
        for (channel, left) in self.left(set, terms, parameters) {
            let noise = self.noise_of(channel);
            all.extend(left.into_iter().map(|value| value / noise));
        }
        all.iter().all(|value| value.is_finite()).then_some(all)
    }

    fn count(&self, set: Set) -> usize {
        let of = |pose: &Pose| 3 * usize::from(pose.tip.is_some()) + pose.tau.len();
        self.poses(set).iter().map(of).sum()
    }

    fn candidates(
        &self,
        terms: &[Term],
        _left: &[f64],
        _instead_of: Option<&Term>,
    ) -> Vec<Candidate<Term>> {
        let n = self.arm.chain.n();
        let has_tip = self.train.iter().any(|pose| pose.tip.is_some());
        let has_torque = self.train.iter().any(|pose| !pose.tau.is_empty());
        let mut found = Vec::new();
        for joint in 0..n {
            let mut add = |law| found.push(Term { law, joint });
            if has_tip {
                add(Law::Compliance);
                add(Law::ZeroOffset);
            } else if joint > 0 {
                // About the first joint's axis, which gravity is along, a zero weighs nothing.
                add(Law::ZeroOffset);
            }
            if has_tip && joint > 0 {
                // Where the first joint sits in the base is where the tracker sees the base.
                add(Law::LinkLength);
            }
            if has_torque {
                add(Law::TorqueOffset);
                add(Law::TorqueGain);
            }
            if has_torque && joint > 0 {
                add(Law::LinkMass);
            }
        }
        let mut add = |law| found.push(Term { law, joint: 0 });
        if has_torque {
            add(Law::Payload);
            add(Law::BaseTilt);
        }
        if has_tip {
            add(Law::ToolOffset);
            for free in SHIFTS {
                add(Law::CameraShift(free));
            }
        }
        found.retain(|term| !terms.contains(term));
        let candidate = |term: Term| {
            let start = term.law.specs().iter().map(|spec| spec.neutral.unwrap_or(0.0)).collect();
            Candidate { term, with: Vec::new(), starts: vec![start], surcharge: 0.0 }
        };
        found.into_iter().map(candidate).collect()
    }

    fn compatible(&self, a: &Term, b: &Term) -> bool {
        a != b && !self.is_same(a, b)
    }

    fn is_broad(&self, term: &Term) -> bool {
        matches!(term.law, Law::Payload | Law::BaseTilt | Law::LinkLength)
    }

    fn is_exact(&self, term: &Term) -> bool {
        term.law.is_exact()
    }

    fn is_sensible(&self, term: &Term, p: &[f64]) -> bool {
        let chain = &self.arm.chain;
        match term.law {
            Law::TorqueGain => SENSIBLE_GAIN.contains(&p[0]),
            Law::LinkMass => chain.bodies[term.joint].may_gain(p[0]),
            Law::Payload => p[0] > 0.0 && chain.bears(p[0], &p[1..4]),
            Law::LinkLength => Vector3::from_column_slice(p).norm() < LONGEST * chain.reach(),
            Law::ZeroOffset => p[0].abs() < largest_zero(&self.train),
            _ => true,
        }
    }

    fn contains(&self, general: &Term, special: &Term) -> bool {
        general.contains(special, self.arm.chain.n())
    }
}

impl Shows for AtPoses {
    fn left(&self, terms: &[Term], parameters: &[f64]) -> Vec<Left> {
        let of = |set: Set| {
            let channels = AtPoses::left(self, set, terms, parameters).into_iter();
            let left = move |(channel, values): (usize, Vec<f64>)| Left {
                channel: channel_name(channel),
                unit: unit(channel).to_owned(),
                noise: self.noise_of(channel),
                held_out: vec![set != Set::Train; values.len()],
                values,
            };
            channels.map(left).collect::<Vec<_>>()
        };
        Set::ALL.into_iter().flat_map(of).collect()
    }

    fn states(&self, at: usize) -> Vec<State> {
        // Of each set as many channels as are read at all.
        let sizes = Set::ALL.map(|set| (set, AtPoses::left(self, set, &[], &[])));
        let each = sizes.iter().flat_map(|(set, left)| left.iter().map(move |(c, _)| (*set, *c)));
        let Some((set, channel)) = each.into_iter().nth(at) else { return Vec::new() };
        let is_read = |pose: &&Pose| {
            if channel < 3 { pose.tip.is_some() } else { pose.tau.len() > channel - 3 }
        };
        let joint = |j: usize| State {
            name: format!("q_{}", j + 1),
            unit: "rad".into(),
            values: self.poses(set).iter().filter(is_read).map(|pose| pose.q[j]).collect(),
        };
        (0..self.arm.chain.n()).map(joint).collect()
    }

    fn told(&self, term: &Term) -> Option<(String, String)> {
        Some((self.name(term).to_owned(), self.site(term)))
    }

    fn seen(&self, term: &Term) -> Seen {
        let channel = term.law.is_local().then(|| format!("tau_{}", term.joint + 1));
        Seen { channel, state: None }
    }
}

impl Worded for AtPoses {
    fn name(&self, term: &Term) -> &'static str {
        term.law.name()
    }

    fn site(&self, term: &Term) -> String {
        term.site(&[])
    }

    fn seat(&self, term: &Term) -> String {
        term.seat(&[])
    }

    fn is_same(&self, a: &Term, b: &Term) -> bool {
        matches!((a.law, b.law), (Law::CameraShift(_), Law::CameraShift(_)))
    }

    fn estimates(&self, h: &Hypothesis<Term>, at: usize) -> Vec<ParameterEstimate> {
        let from: usize = h.terms[..at].iter().map(|term| term.law.specs().len()).sum();
        let count = h.terms[at].law.specs().len();
        let covariance = h.covariance.view((from, from), (count, count)).into_owned();
        let (term, slides) = (&h.terms[at], self.arm.chain.slides(h.terms[at].joint));
        estimates::estimates(term, &h.parameters[from..from + count], &covariance, &[], slides)
    }

    fn equation(&self, term: &Term, estimates: &[ParameterEstimate]) -> String {
        wording::equation(term, estimates)
    }

    fn places(&self, nothing: &Hypothesis<Term>) -> Vec<Channel> {
        let left = self.left(Set::Heldout, &nothing.terms, &nothing.parameters);
        let beyond = |channel: usize, left: &[f64]| {
            let noise = self.noise_of(channel);
            left.iter().map(|value| (value / noise).powi(2) - 1.0).sum::<f64>().max(0.0)
        };
        let total: f64 = left.iter().map(|(channel, left)| beyond(*channel, left)).sum();
        let mut places: Vec<Channel> = left
            .iter()
            .map(|(channel, left)| Channel {
                channel: channel_name(*channel),
                rms: (left.iter().map(|v| v * v).sum::<f64>() / left.len() as f64).sqrt(),
                noise: self.noise_of(*channel),
                unit: unit(*channel).to_owned(),
                share: if total > 0.0 { beyond(*channel, left) / total } else { 0.0 },
                concentrated_in: self.followed(*channel, left),
                heldout: None,
            })
            .collect();
        places.sort_by(|a, b| b.share.total_cmp(&a.share));
        places
    }

    fn above(&self, sum: f64, count: usize) -> f64 {
        // The noise is known no better than from what is left of a few readings: Fisher's ratio of two variances.
        let count = count.max(1) as f64;
        (sum / count - 1.0) / (2.0 / count + 2.0 / self.noise.beyond).sqrt()
    }

    fn nothing(&self) -> &'static str {
        wording::POSES_ARE_NOISE
    }

    fn doubt(&self) -> &'static str {
        wording::MORE_POSES
    }
}

/// A residual follows a joint if the joint's sine and cosine explain more than this part of it.
const FOLLOWS: f64 = 0.3;

impl AtPoses {
    /// Says which joint the residuals of a channel follow most, among the poses held out.
    fn followed(&self, channel: usize, left: &[f64]) -> String {
        let poses = self.poses(Set::Heldout).iter();
        let poses: Vec<&Pose> = poses
            .filter(|pose| if channel < 3 { pose.tip.is_some() } else { !pose.tau.is_empty() })
            .collect();
        let all = left.iter().map(|value| value * value).sum::<f64>().max(1e-300);
        let explained = |j: usize| -> f64 {
            let columns = DMatrix::from_fn(left.len(), 3, |i, k| match k {
                0 => 1.0,
                1 => poses[i].q[j].sin(),
                _ => poses[i].q[j].cos(),
            });
            let target = DVector::from_column_slice(left);
            let svd = columns.svd(true, false);
            svd.u.map_or(0.0, |u| u.tr_mul(&target).norm_squared() / all)
        };
        let n = self.arm.chain.n().min(MOST_JOINTS);
        let best = (0..n).map(|j| (explained(j), j)).max_by(|a, b| a.0.total_cmp(&b.0));
        match best {
            Some((part, j)) if part > FOLLOWS && left.len() > 6 => format!("q_{}", j + 1),
            _ => "the pose".into(),
        }
    }
}
