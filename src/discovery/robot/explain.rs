//! An arm's recordings as something to be explained: [`Residuals`] over laws and joints.

use nalgebra::DMatrix;

use super::candidates::candidates;
use super::channels::{Channel, Quantity};
use super::currents::Drives;
use super::links::body::NUMBERS;
use super::links::covariance::covariance;
use super::links::own::Links;
use super::load::Thing;
use super::simulate::{Model, is_in};
use super::term::{Law, SENSIBLE_GAIN, Term, WITHIN};
use super::zeros;
use crate::discovery::selection::{
    Block, Candidate, Hypothesis, ParameterSpec, Residuals, Set, rises,
};
use crate::discovery::vocabulary::{Odds, kind_named};

/// Recordings of one arm, some to fit and some to judge.
#[derive(Debug)]
pub struct ArmGap {
    /// The recordings fitted.
    pub train: Vec<Model>,
    /// The recordings held out.
    pub heldout: Vec<Model>,
    /// Effects that the model has already, with their parameters one after the other.
    pub known: (Vec<Term>, Vec<f64>),
    /// What was carried in some of them.
    pub things: Vec<Thing>,
    /// How many rows of each sensor hold what nothing explains, in the recordings fitted and held out; empty where that is
    /// not known.
    pub unexplained: [Vec<f64>; 2],
    /// What is not missing any more, since its links are as the recordings have them: none is heavier, and where no load was
    /// needed beside them there is none.
    pub settled: Vec<Law>,
    /// What the drives turn an ampere into, where torques were measured as currents.
    pub(super) drives: Drives,
}

/// Effects with their parameters, and the simulation's own, as they act on a model.
pub(super) struct WithKnown {
    own: Vec<f64>,
    terms: Vec<Term>,
    parameters: Vec<f64>,
}

impl WithKnown {
    /// Returns what they leave of a recording, in the order of [`Model::residuals`]; `None` when the model runs away.
    pub(super) fn residuals(&self, model: &Model) -> Option<Vec<f64>> {
        model.residuals(&self.own, &self.terms, &self.parameters)
    }
}

/// A loop is wider than the narrowest that could be told by this factor.
const NARROW: f64 = 1.05;

/// A sensor that leaves no more than this many times its noise is described: noise is known to a tenth.
const DESCRIBED: f64 = 1.1;

/// A number nearer to nothing than this many of its standard deviations is nothing.
const SURE: f64 = 2.0;

impl ArmGap {
    /// Lays the arm out about the motions that a hypothesis gives it, where they are far from the commands;
    /// returns whether any was.
    pub fn laid_out_again(&mut self, h: &Hypothesis<Term>) -> bool {
        let with = self.with_known(&h.terms, &h.parameters);
        let mut any = false;
        for model in self.train.iter_mut().chain(&mut self.heldout) {
            if let Some(again) = model.about(&with.own, &with.terms, &with.parameters) {
                *model = again;
                any = true;
            }
        }
        any
    }

    /// Returns the same with other numbers of the arm's bodies.
    #[must_use]
    pub(super) fn with_links(&self, links: &Links) -> Self {
        let load = (!links.has_load).then_some(Law::Payload);
        let settled = std::iter::once(Law::LinkMass).chain(load).collect();
        Self { settled, ..self.with_models(|model| model.with_bodies(&links.changes)) }
    }

    /// Returns the same with other numbers of the arm's bodies.
    pub(super) fn with_bodies(&self, changes: &[[f64; NUMBERS]]) -> Self {
        self.with_models(|model| model.with_bodies(changes))
    }

    /// Returns the recordings held out alone, to be fitted and judged, with other numbers of the arm's bodies and effects that
    /// are known.
    pub(super) fn of_heldout(
        &self,
        changes: &[[f64; NUMBERS]],
        known: (Vec<Term>, Vec<f64>),
    ) -> Self {
        let models = || self.heldout.iter().map(|model| model.with_bodies(changes)).collect();
        Self {
            train: models(),
            heldout: models(),
            known,
            things: self.things.clone(),
            unexplained: Default::default(),
            settled: Vec::new(),
            drives: self.drives.clone(),
        }
    }

    /// Returns whether its links are as the recordings have them.
    pub(super) fn has_own_links(&self) -> bool {
        self.settled.contains(&Law::LinkMass)
    }

    fn with_models(&self, change: impl Fn(&Model) -> Model) -> Self {
        Self {
            train: self.train.iter().map(&change).collect(),
            heldout: self.heldout.iter().map(&change).collect(),
            known: self.known.clone(),
            things: self.things.clone(),
            unexplained: self.unexplained.clone(),
            settled: self.settled.clone(),
            drives: self.drives.clone(),
        }
    }

    /// Returns effects and parameters, the simulation's own first, with those that the model has already.
    pub(super) fn with_known(&self, terms: &[Term], parameters: &[f64]) -> WithKnown {
        let n_own = self.train.first().map_or(0, |model| model.own().len());
        let (own, parameters) = parameters.split_at(n_own.min(parameters.len()));
        WithKnown {
            own: own.to_vec(),
            terms: [&self.known.0[..], terms].concat(),
            parameters: [&self.known.1[..], parameters].concat(),
        }
    }

    /// Returns whether torque and tip follow from a measured motion, so that they are linear in what is missing.
    pub fn is_along(&self) -> bool {
        let mut models = self.train.iter().chain(&self.heldout);
        models.all(|model| !model.course.closed_loop && model.course.data.has(Quantity::Position))
    }

    /// The same for the search: of long recordings as many rows as it needs.
    #[must_use]
    pub fn for_search(&self) -> Self {
        self.with_models(Model::thinned)
    }

    /// Takes the noise of each sensor to be so many times larger.
    pub fn soften(&mut self, floors: &[f64]) {
        let rows = |models: &[Model], set| {
            let of = |(sensor, floor): (usize, &f64)| {
                let rest = 1.0 - (DESCRIBED / floor.max(DESCRIBED)).powi(2);
                let judged = |model: &Model| model.judged(&model.course.data.channels[sensor], set);
                rest * models.iter().map(judged).sum::<usize>() as f64
            };
            floors.iter().enumerate().map(of).collect()
        };
        self.unexplained = [rows(&self.train, Set::Train), rows(&self.heldout, Set::Heldout)];
        for model in self.train.iter_mut().chain(&mut self.heldout) {
            for (channel, floor) in model.course.data.channels.iter_mut().zip(floors) {
                channel.noise *= floor;
            }
        }
    }

    pub(super) fn models(&self, set: Set) -> &[Model] {
        match set {
            Set::Train => &self.train,
            Set::Heldout | Set::Unseen => &self.heldout,
        }
    }
}

impl Residuals for ArmGap {
    type Term = Term;

    fn specs(&self, term: &Term) -> Vec<ParameterSpec> {
        let mut specs = term.law.specs();
        let measured = self.train.iter().find(|model| !model.course.closed_loop);
        if let (Law::SensorDelay(_), Some(model)) = (term.law, measured) {
            // A measured motion is smoothed between its rows: what is shorter than half a step of them
            // is the smoother's.
            let step = model.course.data.time.windows(2).map(|t| t[1] - t[0]).fold(0.0, f64::max);
            specs[0].least = specs[0].least.max(0.5 * step);
        }
        if let (Law::Hysteresis, Some(model)) = (term.law, measured) {
            // A joint that passes a loop from one row to the next shows dry friction.
            let step = model.course.typical_step(term.joint);
            specs[1].range.0 = specs[1].range.0.max(step.min(0.5 * specs[1].range.1));
        }
        if term.law == Law::Armature {
            // What the model knows of a rotor may be too much, but no rotor has less than nothing.
            let known = self.train.iter().map(|model| model.arm.armature[term.joint]);
            specs[0].range.0 = -known.fold(f64::INFINITY, f64::min);
        }
        // Smoothing takes torque away that is not missing; twice as much is beyond doubt.
        for model in self.train.iter().filter(|model| !model.course.smoothing.is_empty()) {
            let of = |which: usize| 2.0 * model.course.smoothing[term.joint][which].abs();
            match term.law {
                Law::TorqueGain => specs[0].least = specs[0].least.max(of(0)),
                Law::Armature => specs[0].least = specs[0].least.max(of(1)),
                _ => {}
            }
        }
        specs
    }

    fn nuisance(&self) -> Vec<(ParameterSpec, f64)> {
        self.train.first().map_or(Vec::new(), Model::own)
    }

    fn residuals(&self, set: Set, terms: &[Term], parameters: &[f64]) -> Option<Vec<f64>> {
        let with = self.with_known(terms, parameters);
        let mut all = Vec::new();
        for model in self.models(set) {
            let unseen = model.course.unseen.iter().cycle();
            let own = with.residuals(model)?.into_iter().zip(unseen);
            all.extend(own.map(|(left, unseen)| if is_in(set, *unseen) { left } else { 0.0 }));
        }
        Some(all)
    }

    fn count(&self, set: Set) -> usize {
        self.models(set).iter().map(|model| model.count(set)).sum()
    }

    fn candidates(
        &self,
        terms: &[Term],
        left: &[f64],
        instead_of: Option<&Term>,
    ) -> Vec<Candidate<Term>> {
        let joints = (0..self.train[0].course.data.n).filter(|&joint| {
            let somewhere = Term { law: Law::Viscous, joint };
            instead_of.is_none_or(|left_out| self.related(left_out, &somewhere))
        });
        // Where to begin is taken from the first recording; the fit uses them all.
        let mut found = candidates(&self.train[0], terms, left, joints);
        let things = (0..self.things.len()).map(|joint| Term { law: Law::ObjectMass, joint });
        found.retain(|candidate| !self.settled.contains(&candidate.term.law));
        if self.train[0].course.data.are_currents {
            // What an ampere is worth was fitted: a gain is in it.
            let is_gain = |law| matches!(law, Law::TorqueGain | Law::ActuatorGain);
            found.retain(|candidate| !is_gain(candidate.term.law));
        }
        found.extend(things.filter(|term| !terms.contains(term)).map(|term| Candidate {
            term,
            with: Vec::new(),
            starts: vec![vec![0.0]],
            surcharge: 0.0,
        }));
        found
    }

    fn compatible(&self, a: &Term, b: &Term) -> bool {
        use Law::{Asymmetric, CameraShift, Coulomb, SmoothCoulomb, Stribeck};
        let shifts = matches!((a.law, b.law), (CameraShift(_), CameraShift(_)));
        let dry = |law| matches!(law, Coulomb | SmoothCoulomb | Stribeck | Asymmetric);
        // Along a measured motion friction that differs with direction is plain friction beside an offset of the sensor.
        let twice = match (a.law, b.law) {
            (Asymmetric, Law::TorqueOffset) => a.joint == b.joint && self.is_along(),
            (Law::TorqueOffset, Asymmetric) => self.is_along(),
            _ => false,
        };
        let both_dry = a.joint == b.joint && dry(a.law) && dry(b.law);
        a != b && !twice && !shifts && !both_dry
    }

    fn names_first(&self) -> bool {
        // The friction of a real joint is dry and fluid at once, which a root of the speed resembles.
        self.train.iter().any(|model| !model.course.closed_loop)
    }

    fn related(&self, a: &Term, b: &Term) -> bool {
        // Along a measured motion a torque at one joint shows in that joint's torque alone.
        let closed = self.train.iter().any(|model| model.course.closed_loop);
        closed || !(a.law.is_local() && b.law.is_local()) || a.joint == b.joint
    }

    fn is_broad(&self, term: &Term) -> bool {
        matches!(term.law, Law::Payload | Law::BaseTilt | Law::LinkLength)
            || (term.law == Law::LinkMass && self.is_along())
    }

    fn is_exact(&self, term: &Term) -> bool {
        term.law.is_exact()
    }

    fn is_sensible(&self, term: &Term, parameters: &[f64]) -> bool {
        if term.law.has_run_out(parameters) {
            return false;
        }
        // A spring that begins where hardly any row is, or a spring over all of them, is something else.
        let q0 = match term.law {
            Law::Above | Law::Below => parameters[1],
            Law::TorqueGain | Law::ActuatorGain if self.is_along() => {
                return SENSIBLE_GAIN.contains(&parameters[0]);
            }
            // Friction takes power from the motion, whatever part of it the model has already.
            Law::Asymmetric => {
                let resists = parameters[0] + parameters[1] + self.dry_known(term.joint) >= 0.0;
                return resists && self.is_more_than_dry(*term, parameters);
            }
            Law::Stribeck => return self.is_more_than_dry(*term, parameters),
            // At the end of what is looked at, the one that fits lies beyond it.
            Law::BaseTilt => {
                let specs = term.law.specs();
                let mut angles = specs.iter().zip(parameters);
                return angles.all(|(spec, angle)| angle.abs() < WITHIN * spec.range.1);
            }
            Law::ZeroOffset => {
                let sees_tip = self.train.iter().any(|m| m.course.data.has(Quantity::Tip));
                return parameters[0].abs() < zeros::largest(sees_tip);
            }
            // Where the sensor mostly shows more, it only takes the joint's torque away.
            Law::Saturation => {
                let rows =
                    self.train.iter().map(|m| m.course.data.above(term.joint, parameters[0]));
                let (above, all) = rows.fold((0, 0), |sum, own| (sum.0 + own.0, sum.1 + own.1));
                return 2 * above <= all;
            }
            // One as narrow as may be is none, and one that the joint never turns across is a spring.
            Law::Hysteresis => {
                let least = NARROW * self.specs(term)[1].range.0;
                let travels = self.train.iter().map(|model| model.course.travel(term.joint));
                return (least..travels.fold(0.0, f64::max)).contains(&parameters[1]);
            }
            Law::LinkMass => {
                let of_one =
                    |model: &Model| model.arm.chain.bodies[term.joint].may_gain(parameters[0]);
                return self.train.iter().all(of_one);
            }
            Law::Payload => {
                // What a last link weighs less than its file says is no load that lifts.
                let lifts = parameters[0] < 0.0 && self.is_along();
                let bears = |model: &Model| model.arm.chain.bears(parameters[0], &parameters[1..4]);
                return !lifts && self.train.iter().all(bears);
            }
            _ => return true,
        };
        let (mut beyond, mut rows) = (0, 0);
        for model in &self.train {
            let plant = &model.course.plant;
            rows += plant.len;
            beyond += plant
                .q
                .chunks(plant.n)
                .filter(|q| (q[term.joint] > q0) == (term.law == Law::Above))
                .count();
        }
        let part = beyond as f64 / rows.max(1) as f64;
        (0.05..0.95).contains(&part)
    }

    fn asks_for_size(&self) -> bool {
        true
    }

    fn covariance(&self, h: &Hypothesis<Term>) -> DMatrix<f64> {
        let beside = || {
            let blocks = self.blocks(Set::Train);
            covariance(&self.train, &blocks, h, &rises(self, h)?)
        };
        let own = if self.has_own_links() { beside() } else { None };
        own.unwrap_or_else(|| h.covariance.clone())
    }

    fn base(&self, term: &Term) -> Option<usize> {
        // A peak stands on friction that stays at speed, unless the model has that already.
        (term.law == Law::Stribeck && self.dry_known(term.joint) <= 0.0).then_some(0)
    }

    fn unexplained(&self, set: Set, term: &Term) -> f64 {
        let rows = &self.unexplained[usize::from(set == Set::Heldout)];
        if !term.law.is_local() {
            return rows.iter().sum::<f64>() / rows.len().max(1) as f64;
        }
        let channels = &self.train[0].course.data.channels;
        let own = |c: &Channel| c.quantity == Quantity::Torque && c.index == term.joint;
        let at = channels.iter().position(own);
        at.and_then(|at| rows.get(at)).copied().unwrap_or(0.0)
    }

    fn is_common(&self, term: &Term) -> bool {
        kind_named(term.law.name()).is_some_and(|kind| kind.odds == Odds::Common)
    }

    fn common(&self) -> Vec<Term> {
        let n = self.train[0].course.data.n;
        let has = |quantity| self.train.iter().all(|model| model.course.data.has(quantity));
        if !self.is_along() || !has(Quantity::Torque) {
            return Vec::new();
        }
        let joint = |joint| {
            let laws = [Law::TorqueOffset, Law::Viscous, Law::Coulomb, Law::Armature];
            laws.into_iter().map(move |law| Term { law, joint })
        };
        let links = (1..n).map(|joint| Term { law: Law::LinkMass, joint });
        let links = links.filter(|_| !self.has_own_links());
        links.chain((0..n).flat_map(joint)).collect()
    }

    fn simplified(&self, terms: &[Term], parameters: &[f64]) -> Option<(Vec<Term>, Vec<f64>)> {
        // Along a measured motion friction that differs with direction is plain friction beside an offset of the sensor,
        // which the other sensors have as well.
        let offset = |joint| Term { law: Law::TorqueOffset, joint };
        let any = terms.iter().any(|term| term.law == Law::TorqueOffset);
        let found = terms.iter().position(|term| term.law == Law::Asymmetric);
        let at = found.filter(|_| any && self.is_along())?;
        let from: usize = terms[..at].iter().map(|term| term.law.specs().len()).sum();
        let [forward, backward, creep] = parameters[from..from + 3] else { return None };
        let (mut terms, mut parameters) = (terms.to_vec(), parameters.to_vec());
        let joint = terms[at].joint;
        terms[at].law = Law::Coulomb;
        parameters.splice(from..from + 3, [(0.5 * (forward + backward)).max(0.0), creep]);
        terms.push(offset(joint));
        parameters.push(0.5 * (forward - backward));
        Some(self.simplified(&terms, &parameters).unwrap_or((terms, parameters)))
    }

    fn collapsed(&self, h: &Hypothesis<Term>) -> Option<(usize, Term, Vec<f64>)> {
        let mut from = self.nuisance().len();
        h.terms.iter().enumerate().find_map(|(at, term)| {
            let begins = from;
            from += term.law.specs().len();
            let own = &h.parameters[begins..from];
            let of_whole = match term.law {
                Law::Asymmetric => vec![0.5, 0.5, 0.0],
                Law::Stribeck => vec![1.0, 0.0, 0.0, 0.0],
                _ => return None,
            };
            // How far the further number, which is a difference of two or one alone, is from nothing.
            let further: &[f64] =
                if term.law == Law::Asymmetric { &[1.0, -1.0, 0.0] } else { &[0.0, 1.0, 0.0, 0.0] };
            let count = further.len();
            let covariance = h.covariance.view((begins, begins), (count, count));
            let by = nalgebra::DVector::from_row_slice(further);
            let std = (by.transpose() * covariance * &by)[(0, 0)].max(0.0).sqrt();
            let dot = |a: &[f64]| a.iter().zip(own).map(|(a, b)| a * b).sum::<f64>();
            let is_more = self.is_more_than_dry(*term, own) && dot(further).abs() > SURE * std;
            let level = dot(&of_whole);
            // A simulated joint that is held bends as the general laws do.
            let law = if self.is_along() { Law::Coulomb } else { Law::SmoothCoulomb };
            let special = Term { law, joint: term.joint };
            (!is_more && level > 0.0).then(|| (at, special, vec![level, own[count - 1]]))
        })
    }

    fn blocks(&self, set: Set) -> Vec<Block> {
        let mut found = Vec::new();
        let mut from = 0;
        for model in self.models(set) {
            let channels = model.course.data.channels.iter().enumerate();
            for (sensor, _) in channels.filter(|(_, c)| model.is_predicted(c.quantity)) {
                let to = from + model.course.data.n_rows();
                found.push(Block { sensor, rows: from..to });
                from = to;
            }
        }
        found
    }

    fn is_rough(&self, term: &Term) -> bool {
        matches!(term.law, Law::Backlash)
    }

    fn is_likelier(&self, other: &Term, chosen: &Term) -> bool {
        matches!((other.law, chosen.law), (Law::Payload, Law::LinkMass))
    }

    fn contains(&self, general: &Term, special: &Term) -> bool {
        general.contains(special, self.train[0].course.data.n)
    }
}
