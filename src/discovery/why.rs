//! Why an effect is named: what is left of a channel without it, all others in place, against the state it acts by, and
//! what the effect itself adds there.
//!
//! Each kind of gap says what is left of its channels with and without an effect, and which states they may depend on
//! ([`Shown`]): those that are searched by `selection` by [`Shows`], equations in `equation::shown`. How the channel and the
//! state are chosen is the same for all. It decides nothing: it is for a person to look at.

use super::selection::{Hypothesis, Outcome, Residuals, Rival};

/// An effect beside the data that show it.
#[derive(Debug, Clone, PartialEq)]
pub struct Why {
    /// Its name and its place.
    pub name: String,
    /// Where it sits.
    pub at: String,
    /// The channel that shows it most.
    pub channel: String,
    /// Its SI unit.
    pub unit: String,
    /// The state it is shown against.
    pub state: String,
    /// Its SI unit.
    pub state_unit: String,
    /// Standard deviation of one value of the channel, SI.
    pub noise: f64,
    /// Over how long each value is a mean, s; `None` for values as they were read.
    pub mean_over: Option<f64>,
    /// Row by row of all recordings.
    pub rows: Vec<Row>,
    /// What the effect adds over the state, where that is one curve; else empty.
    pub curve: Vec<(f64, f64)>,
}

/// One value that was read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// The state, SI.
    pub state: f64,
    /// Measured minus the model with all other effects, SI.
    pub left: f64,
    /// What the effect adds to the model, SI.
    pub law: f64,
    /// Whether it was held out.
    pub held_out: bool,
}

/// The unit of a state that counts: pours, grasps.
pub const COUNT: &str = "count";

/// What a hypothesis leaves of one channel of one recording, row by row, SI; 0 where it is not judged.
#[derive(Debug, Clone)]
pub(super) struct Left {
    pub(super) channel: String,
    pub(super) unit: String,
    pub(super) noise: f64,
    pub(super) held_out: Vec<bool>,
    pub(super) values: Vec<f64>,
}

/// What a channel may depend on, row by row.
pub(super) struct State {
    pub(super) name: String,
    pub(super) unit: String,
    pub(super) values: Vec<f64>,
}

/// Where an effect is best seen, where its kind knows.
#[derive(Default)]
pub(super) struct Seen {
    pub(super) channel: Option<String>,
    pub(super) state: Option<String>,
}

/// An effect with what is left of every channel of every recording without it and with it, in the same order.
pub(super) struct Shown {
    pub(super) name: String,
    pub(super) at: String,
    pub(super) seen: Seen,
    pub(super) without: Vec<Left>,
    pub(super) with: Vec<Left>,
}

/// A gap that can be looked at.
pub(super) trait Shows: Residuals {
    /// Returns what effects leave, channel by channel and recording by recording; nothing when the model runs away.
    fn left(&self, terms: &[Self::Term], parameters: &[f64]) -> Vec<Left>;
    /// Returns the states that the `at`-th of them may depend on, the same ones for the same channel.
    fn states(&self, at: usize) -> Vec<State>;
    /// Returns an effect's name and place; `None` for what no channel shows.
    fn told(&self, term: &Self::Term) -> Option<(String, String)>;
    /// Returns where it is best seen.
    fn seen(&self, term: &Self::Term) -> Seen;
}

/// The channel that an effect's kind is seen in shows it if it adds this much to it at least, in squares of its noise, on average.
const SHOWS: f64 = 0.05;
/// Bins of equally many rows, over which what an effect adds is averaged to see on which state it depends.
const BINS: usize = 24;
/// Bins of a curve: finer than is drawn would not show.
const FINE: usize = 120;
/// Fewer rows a bin than this make no curve.
const FEW: usize = 2;
/// What an effect adds is one curve over a state that says this part of it, in squares: a jump within one of [`FINE`] bins takes
/// about one of them.
const ONE_CURVE: f64 = 0.98;

/// Returns of each effect of an answer why it is named, and of those less than `tie` behind it as well.
pub(super) fn whys<G: Shows>(gap: &G, outcome: &Outcome<G::Term>, tie: f64) -> Vec<Why> {
    let best = &outcome.best;
    let with = gap.left(&best.terms, &best.parameters);
    let mut found = Vec::new();
    for at in 0..best.terms.len() {
        found.extend(why_of(gap, best, at, &with));
        let tied = |rival: &&Rival<G::Term>| rival.instead_of == at && rival.behind < tie;
        for Rival { hypothesis, .. } in outcome.rivals.iter().filter(tied) {
            let with = gap.left(&hypothesis.terms, &hypothesis.parameters);
            let last = hypothesis.terms.len().saturating_sub(1);
            found.extend(why_of(gap, hypothesis, last, &with));
        }
    }
    found
}

/// Shows the effect at a place of a hypothesis, which leaves `with`.
fn why_of<G: Shows>(gap: &G, whole: &Hypothesis<G::Term>, at: usize, with: &[Left]) -> Option<Why> {
    let term = whole.terms.get(at)?;
    let (name, site) = gap.told(term)?;
    let numbers = |terms: &[G::Term]| terms.iter().map(|term| gap.specs(term).len()).sum::<usize>();
    let from = gap.nuisance().len() + numbers(&whole.terms[..at]);
    let (mut terms, mut parameters) = (whole.terms.clone(), whole.parameters.clone());
    terms.remove(at);
    parameters.drain(from..from + gap.specs(term).len());
    let without = gap.left(&terms, &parameters);
    let shown = Shown { name, at: site, seen: gap.seen(term), without, with: with.to_vec() };
    why(&shown, |k| gap.states(k))
}

impl Shown {
    /// Whether row stands beside row.
    fn is_alike(&self) -> bool {
        let mut pairs = self.without.iter().zip(&self.with);
        self.without.len() == self.with.len()
            && pairs.all(|(a, b)| a.values.len() == b.values.len())
    }

    /// Returns what the effect adds to the `k`-th of the channels.
    fn adds(&self, k: usize) -> impl Iterator<Item = f64> {
        self.without[k].values.iter().zip(&self.with[k].values).map(|(a, b)| a - b)
    }

    /// The recordings of a channel.
    fn of<'a>(&'a self, channel: &'a str) -> impl Iterator<Item = usize> + 'a {
        (0..self.with.len()).filter(move |k| self.with[*k].channel == channel)
    }

    /// How much the effect adds to a channel, in squares of its noise.
    fn strength(&self, channel: &str) -> f64 {
        let of = |k: usize| self.adds(k).map(move |v| (v / self.with[k].noise).powi(2));
        self.of(channel).flat_map(of).sum()
    }

    /// Returns the channel that shows the effect: the one that its kind is seen in, else the one it adds most to.
    fn channel(&self) -> Option<&str> {
        let mut channels: Vec<&str> = Vec::new();
        for left in &self.with {
            if !channels.contains(&left.channel.as_str()) {
                channels.push(&left.channel);
            }
        }
        let strengths = channels.iter().map(|channel| self.strength(channel));
        let total: f64 = strengths.sum();
        if !(total.is_finite() && total > 0.0) {
            return None;
        }
        let rows =
            |channel: &str| -> usize { self.of(channel).map(|k| self.with[k].values.len()).sum() };
        let shows = |channel: &&str| self.strength(channel) > SHOWS * rows(channel) as f64;
        let most =
            channels.iter().copied().max_by(|a, b| self.strength(a).total_cmp(&self.strength(b)));
        self.seen.channel.as_deref().filter(shows).or(most)
    }
}

/// Shows what an effect adds, by what is left without and with it; `states` are those that the `k`-th channel may depend on.
pub(super) fn why(shown: &Shown, states: impl Fn(usize) -> Vec<State>) -> Option<Why> {
    let channel = shown.is_alike().then(|| shown.channel())??;
    let series: Vec<usize> = shown.of(channel).collect();
    let states: Vec<Vec<State>> = series.iter().map(|k| states(*k)).collect();
    let law: Vec<f64> = series.iter().flat_map(|k| shown.adds(*k)).collect();
    let of = |s: usize| -> Vec<f64> {
        states.iter().flat_map(|own| own[s].values.iter().copied()).collect()
    };
    let n_states = states.iter().map(Vec::len).min()?;
    let wanted = shown.seen.state.as_ref();
    let named = |s: &usize| wanted.is_some_and(|state| states[0][*s].name == *state);
    let s = (0..n_states).find(named).or_else(|| {
        let part = |s: usize| depends(&law, &of(s), BINS);
        (0..n_states).max_by(|a, b| part(*a).total_cmp(&part(*b)))
    })?;
    let without = |k: &usize| shown.without[*k].values.iter().zip(&shown.without[*k].held_out);
    let rows = series.iter().flat_map(without).zip(law.iter().zip(of(s)));
    let rows: Vec<Row> = rows
        .filter(|((left, _), _)| left.abs() > 0.0)
        .map(|((left, held_out), (law, state))| Row {
            state,
            left: *left,
            law: *law,
            held_out: *held_out,
        })
        .filter(|row| row.state.is_finite() && row.left.is_finite() && row.law.is_finite())
        .collect();
    let (first, state) = (&shown.with[series[0]], &states[0][s]);
    Some(Why {
        name: shown.name.clone(),
        at: shown.at.clone(),
        channel: channel.to_owned(),
        unit: first.unit.clone(),
        state: state.name.clone(),
        state_unit: state.unit.clone(),
        noise: first.noise,
        mean_over: None,
        curve: curve(&rows),
        rows,
    })
}

/// Returns what an effect adds over the state, bin by bin, if the state says it nearly all.
fn curve(rows: &[Row]) -> Vec<(f64, f64)> {
    let law: Vec<f64> = rows.iter().map(|row| row.law).collect();
    let state: Vec<f64> = rows.iter().map(|row| row.state).collect();
    if rows.len() < FEW * FINE || depends(&law, &state, FINE) < ONE_CURVE {
        return Vec::new();
    }
    let mut sorted = rows.to_vec();
    sorted.sort_by(|a, b| a.state.total_cmp(&b.state));
    let mean = |bin: &[Row], of: fn(&Row) -> f64| {
        bin.iter().map(of).sum::<f64>() / bin.len().max(1) as f64
    };
    let bins = sorted.chunks(rows.len().div_ceil(FINE));
    bins.map(|bin| (mean(bin, |row| row.state), mean(bin, |row| row.law))).collect()
}

/// Returns the part of the squares of some values that means over bins of a state take away: Pearson's correlation ratio,
/// without the mean taken out, since a constant is as well told by any state.
fn depends(values: &[f64], state: &[f64], bins: usize) -> f64 {
    let mut order: Vec<usize> =
        (0..values.len().min(state.len())).filter(|row| values[*row].abs() > 0.0).collect();
    order.sort_by(|a, b| state[*a].total_cmp(&state[*b]));
    let all: f64 = order.iter().map(|row| values[*row].powi(2)).sum();
    let bins = order.chunks(order.len().div_ceil(bins).max(1));
    let of_bin = |rows: &[usize]| {
        rows.iter().map(|row| values[*row]).sum::<f64>().powi(2) / rows.len() as f64
    };
    bins.map(of_bin).sum::<f64>() / all.max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_depends_on_a_state_is_told_from_what_does_not() {
        let state: Vec<f64> = (0..2000).map(|k| f64::from(k) / 100.0).collect();
        let sines: Vec<f64> = state.iter().map(|s| s.sin()).collect();
        let other: Vec<f64> = (0..2000).map(|k| f64::from((k * 7919) % 2000)).collect();
        assert!(depends(&sines, &state, BINS) > 0.9, "{}", depends(&sines, &state, BINS));
        assert!(depends(&sines, &other, BINS) < 0.1, "{}", depends(&sines, &other, BINS));
    }
}
