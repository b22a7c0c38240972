//! The sentences of an answer.

use crate::units::significant;

use super::super::finding::{Effect, Gap, Verdict};
use super::experiment::Separating;
use super::fitting::Fitted;
use super::hypothesis::{Hypothesis, Question};
use super::unknown::LEAST_PREDICTED;

fn percent(part: f64) -> String {
    format!("{} %", significant(100.0 * part, 3))
}

/// The names and places of effects.
fn listed<'e>(effects: impl IntoIterator<Item = &'e Effect>, between: &str) -> String {
    let names: Vec<String> = effects.into_iter().map(|e| format!("{}({})", e.name, e.at)).collect();
    names.join(between)
}

/// The verdict's reason, one sentence.
pub(super) fn reason(verdict: Verdict, gap: &Gap, effects: &[Effect]) -> String {
    let from_to = format!(
        "the gap on held-out data falls from {} to {} of the signal",
        percent(gap.before.heldout),
        percent(gap.after.heldout)
    );
    match verdict {
        Verdict::NothingMissing => format!(
            "what is left on held-out data, {} of the signal, is noise, and no effect pays for itself",
            percent(gap.before.heldout)
        ),
        Verdict::ModelInadequate | Verdict::DifferentMachines => from_to,
        Verdict::Unknown if effects.is_empty() => format!(
            "the model misses {} of the signal on held-out data, and nothing that has a name explains it",
            percent(gap.before.heldout)
        ),
        Verdict::Unknown => format!(
            "nothing that has a name explains it; with the formula for {} {from_to}",
            effects[0].at
        ),
        Verdict::Named => format!("with {} of {} {from_to}", effects[0].name, effects[0].at),
        Verdict::Several => format!("with {} {from_to}", listed(effects, " and ")),
        Verdict::Ambiguous => {
            let (doubtful, sure): (Vec<&Effect>, Vec<&Effect>) =
                effects.iter().partition(|effect| effect.indistinguishable);
            let beside = if sure.is_empty() {
                String::new()
            } else {
                format!(", beside {}", listed(sure, " and "))
            };
            format!("{} explain the data equally well{beside}; {from_to}", listed(doubtful, " or "))
        }
    }
}

/// Why a formula is not given.
pub(super) fn refused(train: f64, heldout: f64) -> String {
    format!(
        "; the best formula explains {} of it on the data fitted but {} on the data held out, where {} were asked for, so none is given",
        percent(train.max(0.0)),
        percent(heldout.max(0.0)),
        percent(LEAST_PREDICTED)
    )
}

/// Where a formula has been seen to hold.
pub(super) fn validity(question: &Question, shown: &Hypothesis) -> String {
    let compiled = &shown.fitted.compiled;
    let columns = question.along(&shown.fitted);
    let of = |name: &str, values: &mut dyn Iterator<Item = f64>| {
        let (low, high) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let unit = compiled.units.of(name).map(crate::units::Dimension::si).unwrap_or_default();
        let text =
            format!("{name} from {} to {} {unit}", significant(low, 3), significant(high, 3));
        text.trim_end().to_owned()
    };
    let mut seen: Vec<String> = compiled
        .states
        .iter()
        .zip(&columns)
        .map(|(state, column)| of(&state.name, &mut column.iter().copied()))
        .collect();
    for (i, (name, _)) in compiled.inputs.iter().enumerate() {
        let mut all = question.bench.train.iter().flat_map(|d| d.inputs[i].iter().copied());
        seen.push(of(name, &mut all));
    }
    format!("the formula was seen to hold for {}; outside nobody knows", seen.join(", "))
}

/// What the model's own free parameters came out as.
pub(super) fn fitted(shown: &Hypothesis, nominal: &Hypothesis) -> Option<String> {
    let (compiled, train) = (&shown.fitted.compiled, &shown.fitted.train);
    let own = |name: &str| nominal.fitted.compiled.params.iter().any(|p| p.name == name);
    let values: Vec<String> = compiled
        .params
        .iter()
        .zip(train.point.params.iter().zip(&train.std))
        .filter(|(param, _)| own(&param.name))
        .map(|(param, (value, std))| {
            let unit = compiled.units.of(&param.name).map(crate::units::Dimension::si);
            let sure = if std.is_finite() && *std > 0.0 {
                format!(" +- {}", significant(*std, 2))
            } else {
                String::new()
            };
            let text = format!(
                "{} = {}{sure} {}",
                param.name,
                significant(*value, 4),
                unit.unwrap_or_default()
            );
            text.trim_end().to_owned()
        })
        .collect();
    (!values.is_empty()).then(|| format!("fitted to the recordings: {}", values.join(", ")))
}

/// That parameters ran off in `off`, were kept where the text has them, and what came of them at the end.
pub(super) fn anchored(off: &Fitted, names: &[String], end: &str) -> String {
    let compiled = &off.compiled;
    let one = |name: &String| {
        let i = compiled.params.iter().position(|param| param.name == *name)?;
        let unit = compiled.units.of(name).map(crate::units::Dimension::si).unwrap_or_default();
        let value = |v: f64| format!("{} {unit}", significant(v, 3)).trim_end().to_owned();
        let (ran, given) = (value(off.train.point.params[i]), value(compiled.params[i].guess?));
        Some(format!(
            "without what is missing {name} runs off to {ran}; it was kept at {given} until that was found, and {end}"
        ))
    };
    names.iter().filter_map(one).collect::<Vec<_>>().join("; ")
}

/// That a doubt is kept out of the model's text.
pub(super) fn unwritten(effects: &[Effect]) -> String {
    let doubtful = effects.iter().filter(|effect| effect.indistinguishable);
    format!("not written into the model until it is settled which: {}", listed(doubtful, ", "))
}

/// What would settle a doubt between explanations.
pub(super) fn next(effects: &[Effect], n_rivals: usize, found: Option<&Separating>) -> String {
    let doubtful = effects.iter().filter(|effect| effect.indistinguishable);
    let Some(found) = found else {
        return format!(
            "no input of the kind recorded tells {} apart: measure more, the input at the machine or the output with a second sensor",
            listed(doubtful, " from ")
        );
    };
    let left = if found.settled < n_rivals {
        format!(" ({} of {n_rivals} rivals; the others need a second sensor)", found.settled)
    } else {
        String::new()
    };
    format!(
        "record with {}, as written in the file: there {} come to differ by {} standard deviations of the noise{left}",
        found.what,
        listed(doubtful, " and "),
        significant(found.sigma, 2)
    )
}

/// Replaces a whole word.
pub(super) fn replace_word(text: &str, word: &str, with: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    while let Some(at) = rest.find(word) {
        let (before, after) = rest.split_at(at);
        let after = &after[word.len()..];
        let whole = !before.ends_with(is_word) && !after.starts_with(is_word);
        out.push_str(before);
        out.push_str(if whole { with } else { word });
        rest = after;
    }
    out.push_str(rest);
    out
}
