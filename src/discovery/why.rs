//! Why an effect is named: what is left of a channel without it, all others in place, against the state it acts by, and
//! what the effect itself adds there.
//!
//! Each kind of gap says what is left of its channels and which states they may depend on ([`Shows`]); how the channel and
//! the state are chosen is the same for all. It decides nothing: it is for a person to look at.

use super::selection::{Hypothesis, Residuals};

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
    /// Row by row of all recordings.
    pub rows: Vec<Row>,
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

/// What a hypothesis leaves of one channel of one recording, row by row, SI; 0 where it is not judged.
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

/// Returns of each effect of a hypothesis why it is named.
pub(super) fn whys<G: Shows>(gap: &G, best: &Hypothesis<G::Term>) -> Vec<Why> {
    let with = gap.left(&best.terms, &best.parameters);
    let mut from = gap.nuisance().len();
    let mut found = Vec::new();
    for (at, term) in best.terms.iter().enumerate() {
        let to = from + gap.specs(term).len();
        let (mut terms, mut parameters) = (best.terms.clone(), best.parameters.clone());
        terms.remove(at);
        parameters.drain(from..to);
        from = to;
        let without = gap.left(&terms, &parameters);
        let is_alike = without.len() == with.len()
            && without.iter().zip(&with).all(|(a, b)| a.values.len() == b.values.len());
        if is_alike && let Some(told) = gap.told(term) {
            found.extend(why(gap, told, &gap.seen(term), &without, &with));
        }
    }
    found
}

/// Shows what an effect adds, by what is left without and with it.
fn why<G: Shows>(
    gap: &G,
    (name, at): (String, String),
    seen: &Seen,
    without: &[Left],
    with: &[Left],
) -> Option<Why> {
    let adds = |k: usize| -> Vec<f64> {
        without[k].values.iter().zip(&with[k].values).map(|(a, b)| a - b).collect()
    };
    let strength = |channel: &str| -> f64 {
        let own = (0..with.len()).filter(|k| with[*k].channel == channel);
        own.map(|k| adds(k).iter().map(|v| (v / with[k].noise).powi(2)).sum::<f64>()).sum()
    };
    let mut channels: Vec<&str> = Vec::new();
    for left in with {
        if !channels.contains(&left.channel.as_str()) {
            channels.push(&left.channel);
        }
    }
    let total: f64 = channels.iter().map(|channel| strength(channel)).sum();
    if !(total.is_finite() && total > 0.0) {
        return None;
    }
    let most = channels.iter().max_by(|a, b| strength(a).total_cmp(&strength(b)))?;
    let wanted = seen.channel.as_deref();
    let rows = |channel: &str| -> usize {
        with.iter().filter(|left| left.channel == channel).map(|left| left.values.len()).sum()
    };
    let shows = |channel: &&str| strength(channel) > SHOWS * rows(channel) as f64;
    let channel = wanted.filter(shows).unwrap_or(most);
    let series: Vec<usize> = (0..with.len()).filter(|k| with[*k].channel == channel).collect();
    let states: Vec<Vec<State>> = series.iter().map(|k| gap.states(*k)).collect();
    let law: Vec<f64> = series.iter().flat_map(|k| adds(*k)).collect();
    let of = |s: usize| -> Vec<f64> {
        states.iter().flat_map(|own| own[s].values.iter().copied()).collect()
    };
    let n_states = states.iter().map(Vec::len).min()?;
    let named = |s: &usize| seen.state.as_ref().is_some_and(|state| states[0][*s].name == *state);
    let s = (0..n_states).find(named).or_else(|| {
        (0..n_states).max_by(|a, b| depends(&law, &of(*a)).total_cmp(&depends(&law, &of(*b))))
    })?;
    let left = series.iter().flat_map(|k| without[*k].values.iter().zip(&without[*k].held_out));
    let rows = left.zip(law.iter().zip(of(s)));
    let rows = rows
        .filter(|((left, _), _)| left.abs() > 0.0)
        .map(|((left, held_out), (law, state))| Row {
            state,
            left: *left,
            law: *law,
            held_out: *held_out,
        })
        .filter(|row| row.state.is_finite() && row.left.is_finite() && row.law.is_finite());
    let (unit, state) = (with[series[0]].unit.clone(), &states[0][s]);
    Some(Why {
        name,
        at,
        channel: channel.to_owned(),
        unit,
        state: state.name.clone(),
        state_unit: state.unit.clone(),
        rows: rows.collect(),
    })
}

/// Returns the part of the squares of some values that means over bins of a state take away: Pearson's correlation ratio,
/// without the mean taken out, since a constant is as well told by any state.
fn depends(values: &[f64], state: &[f64]) -> f64 {
    let mut order: Vec<usize> =
        (0..values.len().min(state.len())).filter(|row| values[*row].abs() > 0.0).collect();
    order.sort_by(|a, b| state[*a].total_cmp(&state[*b]));
    let all: f64 = order.iter().map(|row| values[*row].powi(2)).sum();
    let bins = order.chunks(order.len().div_ceil(BINS).max(1));
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
        assert!(depends(&sines, &state) > 0.9, "{}", depends(&sines, &state));
        assert!(depends(&sines, &other) < 0.1, "{}", depends(&sines, &other));
    }
}
