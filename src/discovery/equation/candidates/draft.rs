//! A candidate in the making: what the model offers, what is to be patched into it, and with which parameters.

use super::super::compile::Compiled;
use super::super::edit::{NewParam, Patch, fresh};
use super::laws::{Law, Seen, Sign, law_of};
use crate::language::ast::{Expr, ExprKind, ModelItem};
use crate::language::names_in;
use crate::units::Dimension;

/// What is known of a signal along the recordings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Least value.
    pub low: f64,
    /// Greatest value.
    pub high: f64,
    /// Root mean square.
    pub rms: f64,
}

impl Range {
    /// Of some values.
    pub fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut sum, mut n) = (0.0, 0.0);
        for v in values {
            low = low.min(v);
            high = high.max(v);
            sum += v * v;
            n += 1.0;
        }
        Self { low, high, rms: f64::sqrt(sum / f64::max(n, 1.0)) }
    }

    pub(in super::super) fn span(self) -> f64 {
        (self.high - self.low).max(0.0)
    }

    /// Whether it is well on both sides of 0.
    pub(in super::super) fn changes_sign(self) -> bool {
        self.low < -0.02 * self.span() && self.high > 0.02 * self.span()
    }

    /// Whether it goes ten times as far to one side of 0 as to the other.
    pub(in super::super) fn is_one_way(self) -> bool {
        let (below, above) = ((-self.low).max(0.0), self.high.max(0.0));
        below.min(above) < 0.1 * below.max(above)
    }
}

/// What the candidates are made from.
#[derive(Debug, Clone)]
pub struct Ground<'a> {
    /// The model as text tree.
    pub model: &'a ModelItem,
    /// The same before anything was found.
    pub given: &'a ModelItem,
    /// The model as program.
    pub compiled: &'a Compiled,
    /// Along the simulation, one per state.
    pub states: Vec<Range>,
    /// As measured, one per input.
    pub inputs: Vec<Range>,
    /// As measured, one per output.
    pub outputs: Vec<Range>,
    /// Rates of the states, one per state.
    pub rates: Vec<Range>,
    /// How often each state turns round, as measured where it is; a velocity turns round with its position.
    pub turns: Vec<usize>,
    /// The part of the time that each state stands still.
    pub still: Vec<f64>,
    /// Usual step of the recordings as they are fitted, s.
    pub step: f64,
    /// Usual step of the recordings as they were taken, s: shifts below it are a matter of how rows were
    /// written, not of the machine.
    pub row: f64,
    /// Length of a recording, s.
    pub duration: f64,
    /// Length of what is run in one go from first values that fit it, s: a recording, or a stretch of one.
    pub stretch: f64,
    /// Lines in the spectrum of the residual, Hz, strongest first.
    pub lines: Vec<f64>,
}

/// A path turns round so often where it goes back and forth.
pub(super) const BACK_AND_FORTH: usize = 6;

/// What stands still for this part of the time has come to rest.
pub(super) const AT_REST: f64 = 0.1;

impl Ground<'_> {
    /// Whether a state or an input goes one way only.
    pub(in super::super) fn is_one_way(&self, name: &str) -> bool {
        let state = self.compiled.states.iter().position(|s| s.name == name);
        let input = self.compiled.inputs.iter().position(|(input, _)| input == name);
        let range = state.map(|s| self.states[s]).or_else(|| input.map(|i| self.inputs[i]));
        range.is_some_and(Range::is_one_way)
    }

    /// Whether what has to be seen of a motion for a law is seen at a place.
    fn shows(&self, seen: Seen, at: &str) -> bool {
        let state = self.compiled.states.iter().position(|s| s.name == at);
        let output = || self.compiled.outputs.iter().find(|o| o.name == at)?.state;
        let Some(s) = state.or_else(output) else { return true };
        match seen {
            Seen::Anything => true,
            Seen::Reversals => self.turns[s] >= BACK_AND_FORTH,
            Seen::Turning => {
                let is_driven = !self.compiled.inputs.is_empty();
                is_driven || self.turns[s] > 0 || self.still[s] >= AT_REST
            }
        }
    }
}

/// An effect at a place.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Its name in the vocabulary.
    pub kind: &'static str,
    /// Its place.
    pub at: String,
    /// What it changes; the values are one start of the fit.
    pub patches: Vec<Patch>,
    /// What it says as an equation, with parameter names.
    pub equation: String,
    /// Names of kinds it is a special case of.
    pub within: &'static [&'static str],
}

impl Candidate {
    /// The same, begun from what its special case came out as: `size` of it in every amount.
    #[must_use]
    pub fn from_special(mut self, size: f64) -> Self {
        for patch in &mut self.patches {
            for param in patch.params.iter_mut().filter(|p| p.neutral.is_some()) {
                param.value = param.range.map_or(size, |[low, high]| size.clamp(low, high));
            }
        }
        self
    }

    /// How many numbers it has.
    fn n_params(&self) -> usize {
        self.patches.first().map_or(0, |patch| patch.params.len())
    }

    /// Whether it is a special case of another at the same place.
    pub fn is_special(&self, of: &Self) -> bool {
        self.at == of.at && self.within.contains(&of.kind) && self.n_params() < of.n_params()
    }

    /// Whether the two cannot act together: the same effect at the same place, or a special case of it.
    pub fn excludes(&self, other: &Self) -> bool {
        let is_same = self.at == other.at && self.kind == other.kind;
        is_same || self.is_special(other) || other.is_special(self)
    }
}

pub(super) struct Draft<'a> {
    pub(super) ground: &'a Ground<'a>,
    pub(super) out: Vec<Candidate>,
}

/// One parameter of a draft.
pub(super) struct P {
    role: &'static str,
    /// End of its name in the text.
    suffix: &'static str,
    dimension: Option<Dimension>,
    range: Option<[f64; 2]>,
    /// The value at which the effect is not there; `None` for a parameter of its shape.
    neutral: Option<f64>,
    starts: Vec<f64>,
}

/// A parameter that says how much of an effect there is: none at 0.
pub(super) fn p(
    role: &'static str,
    suffix: &'static str,
    dimension: Option<Dimension>,
    starts: &[f64],
) -> P {
    P { role, suffix, dimension, range: None, neutral: Some(0.0), starts: starts.to_vec() }
}

impl P {
    pub(super) fn within(mut self, low: f64, high: f64) -> Self {
        self.range = Some([low, high]);
        for start in &mut self.starts {
            *start = start.clamp(low, high);
        }
        self
    }

    /// A parameter that says what an effect is like.
    pub(super) fn shape(mut self) -> Self {
        self.neutral = None;
        self
    }

    /// A factor: no effect at 1.
    pub(super) fn factor(mut self) -> Self {
        self.neutral = Some(1.0);
        self
    }
}

impl Draft<'_> {
    /// Adds a candidate; `write` makes the patch from the names of its parameters.
    pub(super) fn add(
        &mut self,
        (kind, at): (&'static str, &str),
        params: &[P],
        within: &'static [&'static str],
        write: impl Fn(&[String]) -> (Patch, String),
    ) {
        let model = self.ground.model;
        let law = law_of(kind);
        if !self.ground.shows(law.seen, at) {
            return;
        }
        let names: Vec<String> =
            params.iter().map(|p| fresh(model, &format!("{at}_{}", p.suffix))).collect();
        let (patch, equation) = write(&names);
        let is_not_negative = is_not_negative(self.ground, law, at, &patch);
        let n_starts = params.iter().map(|p| p.starts.len()).max().unwrap_or(1);
        // What has no shape is nearly linear in how much of it there is, so it begins from none.
        let none: Option<Vec<f64>> = params.iter().map(|p| p.neutral).collect();
        let n_starts = if none.is_some() { 1 } else { n_starts };
        let patches = (0..n_starts)
            .map(|i| Patch {
                title: format!("{kind}({at})"),
                params: params
                    .iter()
                    .zip(&names)
                    .enumerate()
                    .map(|(k, (p, name))| NewParam {
                        role: p.role,
                        name: name.clone(),
                        dimension: p.dimension,
                        range: p
                            .range
                            .or((is_not_negative && p.neutral == Some(0.0)).then_some([0.0, OPEN])),
                        neutral: p.neutral,
                        value: none
                            .as_ref()
                            .map_or(p.starts[i.min(p.starts.len() - 1)], |none| none[k]),
                        std: None,
                    })
                    .collect(),
                ..patch.clone()
            })
            .collect();
        self.out.push(Candidate { kind, at: at.into(), patches, equation, within });
    }
}

/// The end of a range that has none.
pub(super) const OPEN: f64 = 1e15;

/// Whether the amounts of a law cannot be negative at a place: where the model has a force of its own there, what
/// is added may take some of it away.
pub(super) fn is_not_negative(ground: &Ground, law: Law, at: &str, patch: &Patch) -> bool {
    match law.sign {
        Sign::Any => false,
        Sign::Own => true,
        Sign::Total | Sign::Given | Sign::Rubbing => {
            let model = if law.sign == Sign::Total { ground.model } else { ground.given };
            let has_own = |state: &String| {
                let rate = model.equations.iter().find(|e| e.name.text == *state);
                rate.is_some_and(|e| match law.sign {
                    Sign::Rubbing => bends(model, &e.formula, at),
                    _ => names_in(&e.formula).iter().any(|n| depends(model, n, at)),
                })
            };
            !patch.rates.is_empty() && !patch.rates.iter().any(|(state, _)| has_own(state))
        }
    }
}

/// Whether a formula takes a function of `state`, itself or in a definition: a sign, a step, a hyperbolic tangent.
fn bends(model: &ModelItem, formula: &Expr, state: &str) -> bool {
    match &formula.kind {
        ExprKind::Call(_) => names_in(formula).iter().any(|n| depends(model, n, state)),
        ExprKind::Negate(inner) => bends(model, inner, state),
        ExprKind::Binary(a, _, b) => bends(model, a, state) || bends(model, b, state),
        ExprKind::Name(name) => {
            let own = model.lets.iter().find(|l| l.name.text == *name);
            own.is_some_and(|l| {
                !names_in(&l.formula).contains(name) && bends(model, &l.formula, state)
            })
        }
        _ => false,
    }
}

/// Whether a name is `state` or is defined by it.
pub(super) fn depends(model: &ModelItem, name: &str, state: &str) -> bool {
    name == state
        || model.lets.iter().any(|l| {
            l.name.text == name
                && names_in(&l.formula).iter().any(|n| n != name && depends(model, n, state))
        })
}

/// Which states are velocities, with the state they are the rate of.
pub fn velocities(ground: &Ground) -> Vec<(usize, Option<usize>)> {
    let model = ground.compiled;
    let n = model.states.len();
    let of = |v: usize| (0..n).find(|&q| q != v && model.rates[q] == model.state_regs[v]);
    (0..n)
        .filter_map(|v| {
            let dimension = model.units.of(&model.states[v].name);
            let by_unit =
                dimension.is_some_and(|d| d == Dimension::SPEED || d == Dimension::ANGULAR_SPEED);
            if let Some(q) = of(v) {
                return Some((v, Some(q)));
            }
            // Without units a state that goes both ways and is not the integral of another may be one.
            let position = (0..n).any(|w| w != v && model.rates[v] == model.state_regs[w]);
            let open = dimension.is_none() && !position && ground.states[v].changes_sign();
            (by_unit || open).then_some((v, None))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::super::edit::model_in;
    use super::bends;

    /// A constant in a rate came as a friction that drives one way and brakes the other.
    #[test]
    fn only_what_jumps_or_bends_with_a_velocity_leaves_friction_less_than_none() {
        let is_bent = |rate: &str| {
            let text = format!(
                "model m {{\n param c = 1\n state q = 0, v = 0\n let rub = c*tanh(v/0.01)\n q' = v\n v' = {rate}\n output q = q\n}}\n"
            );
            let model = model_in(&text, "m").unwrap();
            let rate = model.equations.iter().find(|e| e.name.text == "v").unwrap();
            bends(&model, &rate.formula, "v")
        };
        assert!(!is_bent("c*(1 - q^2)*v - sin(q)"));
        assert!(is_bent("-q - c*sign(v)") && is_bent("-(q + rub)"));
    }
}
