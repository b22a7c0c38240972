//! The sentences of an answer, and what is said while it is looked for. Numbers come in, nothing is decided here.

use std::fmt::{Display, Write as _};

use crate::units::significant;

use super::super::finding::{Effect, Gap, Verdict};
use super::simulate::Hold;

/// Said while candidates are fitted.
pub(super) const FITTING: &str = "fitting the model with every effect at every place";
/// Said while the answer is put together.
pub(super) const LOOKING: &str = "looking at what is left";
/// What stands for an output's formula where an effect is around it.
pub(super) const WHAT_THE_MODEL_SAYS: &str = "what the model says";

/// A number with its unit, if it has one.
fn with_unit(number: &str, unit: &str) -> String {
    format!("{number} {unit}").trim_end().to_owned()
}

fn percent(part: f64) -> String {
    format!("{} %", significant(100.0 * part, 3))
}

/// The names and places of effects.
fn listed<'e>(effects: impl IntoIterator<Item = &'e Effect>, between: &str) -> String {
    let names: Vec<String> = effects.into_iter().map(|e| format!("{}({})", e.name, e.at)).collect();
    names.join(between)
}

/// The verdict's reason, one sentence; `clock` is how many times as long as written times would be for the model as it is to say as
/// much as an effect in doubt.
pub(super) fn reason(
    verdict: Verdict,
    gap: &Gap,
    effects: &[Effect],
    clock: Option<f64>,
) -> String {
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
            "the model misses {} of the signal on held-out data, where noise is {}, and nothing that has a name explains it",
            percent(gap.before.heldout),
            percent(gap.noise_floor)
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
            let clock = clock.map_or_else(String::new, |factor| {
                format!(" or a wrong clock (times {} times as long)", significant(factor, 4))
            });
            let doubtful = listed(doubtful, " or ");
            format!("{doubtful}{clock} explain the data equally well{beside}; {from_to}")
        }
    }
}

/// The reason where the data held out do not show what is missing on those fitted.
pub(super) fn not_shown(gap: &Gap) -> String {
    format!(
        "the model misses {} of the signal on the data fitted and {} on the data held out, where noise is {}: what is held out is too \
         short, or too still, to show what is missing, and nothing is named that it does not show; hold out more, with a larger \
         `--holdout` or a second recording of a motion like those fitted",
        percent(gap.before.train),
        percent(gap.before.heldout),
        percent(gap.noise_floor)
    )
}

/// Why a formula is not given: the parts of the gap that it explains, and what was asked for.
pub(super) fn refused(train: f64, heldout: f64, least: f64) -> String {
    let [train, heldout] = [train, heldout].map(|part| percent(part.max(0.0)));
    if train == heldout && train == percent(0.0) {
        return "; no formula explains any of it, and none is given".into();
    }
    let least = percent(least);
    if train == heldout {
        return format!(
            "; the best formula explains {train} of it, and {least} are needed, so none is given"
        );
    }
    format!(
        "; the best formula explains {train} of it on the data fitted and {heldout} on the data held out, where {least} are needed, so none is given"
    )
}

/// That the numbers of an effect are told beside one of them that is set, since all trade against what is free in the model.
pub(super) fn only_beside(kind: &str, at: &str, role: &str, value: f64) -> String {
    format!(
        "{kind}({at}) is told with {role} = {}: all its numbers trade against what is free in the model, their difference does not",
        significant(value, 3)
    )
}

/// Which names, with their places, take too little of the gap to be given.
pub(super) fn leaves_most<'e>(tried: impl Iterator<Item = (&'e str, &'e str)>) -> String {
    let names: Vec<String> = tried.map(|(kind, at)| format!("{kind}({at})")).collect();
    format!(
        "{} would take a part of the gap and leave too much of it to be what is missing",
        names.join(" and ")
    )
}

/// Which names, with their places, take nothing of the gap where nothing was decided.
pub(super) fn predicts_nothing<'e>(tried: impl Iterator<Item = (&'e str, &'e str)>) -> String {
    let names: Vec<String> = tried.map(|(kind, at)| format!("{kind}({at})")).collect();
    format!(
        "{} would pay on the data that decide, and on the data held out that decide nothing the gap does not fall with it: not named",
        names.join(" and ")
    )
}

/// The range of a state or an input in the recordings.
pub(super) struct Seen<'a> {
    pub(super) name: &'a str,
    /// Lowest and highest, in `unit`.
    pub(super) range: (f64, f64),
    pub(super) unit: String,
}

/// Where a formula has been seen to hold.
pub(super) fn validity(seen: &[Seen]) -> String {
    let one = |Seen { name, range: (low, high), unit }: &Seen| {
        with_unit(
            &format!("{name} from {} to {}", significant(*low, 3), significant(*high, 3)),
            unit,
        )
    };
    let seen: Vec<String> = seen.iter().map(one).collect();
    format!(
        "the formula was seen to hold for {}; outside that range it is not known",
        seen.join(", ")
    )
}

/// A parameter of the model as it was fitted.
pub(super) struct FittedParam<'a> {
    pub(super) name: &'a str,
    pub(super) value: f64,
    /// Its standard deviation, where it has one of its own.
    pub(super) std: Option<f64>,
    pub(super) unit: String,
}

/// What the model's own free parameters came out as.
pub(super) fn fitted(params: &[FittedParam]) -> String {
    let one = |FittedParam { name, value, std, unit }: &FittedParam| {
        let sure = std.map_or(String::new(), |std| format!(" +- {}", significant(std, 2)));
        with_unit(&format!("{name} = {}{sure}", significant(*value, 4)), unit)
    };
    let values: Vec<String> = params.iter().map(one).collect();
    format!("fitted to the recordings: {}", values.join(", "))
}

/// Which parameters fit as well far from where they ended, and whether sizes that would have been seen are told.
pub(super) fn unexercised(params: &[FittedParam], are_sizes_told: bool) -> String {
    let names: Vec<&str> = params.iter().map(|param| param.name).collect();
    let ended = |FittedParam { name, value, unit, .. }: &FittedParam| {
        with_unit(&format!("{name} = {}", significant(*value, 2)), unit)
    };
    let ended: Vec<String> = params.iter().map(ended).collect();
    let hold = if are_sizes_told { "; the sizes that would have been seen hold there" } else { "" };
    format!(
        "the data do not determine {}: values far from where the fit ended ({}) leave as little; only a motion \
         that exercises more would tell{hold}",
        names.join(", "),
        ended.join(", ")
    )
}

/// A parameter that ran off without what is missing.
pub(super) struct RanOff<'a> {
    pub(super) name: &'a str,
    /// Where it ran, and what the text gives, in `unit`.
    pub(super) ran: f64,
    pub(super) given: f64,
    pub(super) unit: String,
}

/// That parameters ran off, were kept where the text has them, and whether they were fitted at the end.
pub(super) fn anchored(off: &[RanOff], are_fitted: bool) -> String {
    let end =
        if are_fitted { "fitted then" } else { "stays there, since the recordings do not tell it" };
    let one = |RanOff { name, ran, given, unit }: &RanOff| {
        let value = |v: f64| with_unit(&significant(v, 3), unit);
        let (ran, given) = (value(*ran), value(*given));
        format!(
            "without what is missing {name} runs off to {ran}; it was kept at {given} until that was found, and {end}"
        )
    };
    off.iter().map(one).collect::<Vec<_>>().join("; ")
}

/// That a doubt is kept out of the model's text.
pub(super) fn unwritten(effects: &[Effect]) -> String {
    let doubtful = effects.iter().filter(|effect| effect.indistinguishable);
    format!("not written into the model until it is settled which: {}", listed(doubtful, ", "))
}

/// That no input would settle a doubt between explanations.
pub(super) fn nothing_settles(effects: &[Effect]) -> String {
    let doubtful = effects.iter().filter(|effect| effect.indistinguishable);
    format!(
        "no input of the kind recorded tells {} apart: measure more, the input at the machine or the output with a second sensor",
        listed(doubtful, " from ")
    )
}

/// That only the clock itself would settle whether an effect is there.
pub(super) fn clock_settles(effects: &[Effect]) -> String {
    let doubtful = effects.iter().filter(|effect| effect.indistinguishable);
    format!(
        "record something whose duration is known with the same clock: with a clock that is right it is {}",
        listed(doubtful, " or ")
    )
}

/// Which input would settle a doubt, for `settled` of the rivals, and by how many standard deviations of the noise.
pub(super) fn settled_by(
    effects: &[Effect],
    input: impl Display,
    (settled, n_rivals): (usize, usize),
    sigma: f64,
) -> String {
    let doubtful = effects.iter().filter(|effect| effect.indistinguishable);
    let left = if settled < n_rivals {
        format!(" ({settled} of {n_rivals} rivals; the others need a second sensor)")
    } else {
        String::new()
    };
    format!(
        "record with {input}, as written in the file: there {} come to differ by {} standard deviations of the noise{left}",
        listed(doubtful, " and "),
        significant(sigma, 2)
    )
}

/// Of which effects no amount would have been seen.
pub(super) fn blind(effects: &[String]) -> String {
    format!(
        "no amount of {} would have been seen: what is free in the model makes up for it",
        effects.join(", ")
    )
}

/// Why a name was not taken where a formula explains more.
pub(super) fn explains_less() -> String {
    "explains less than half as much of the held-out data".into()
}

/// Why a rival was not chosen.
pub(super) enum WhyNot {
    /// It is the same in a recording that moves one way.
    SameOneWay,
    /// The data say the same of both.
    Tied,
    /// Its criterion is so much higher.
    FitsWorse(f64),
    /// It leaves this part more of the held-out data.
    PredictsWorse(f64),
    /// It needs more parameters for the same.
    Longer,
}

impl Display for WhyNot {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::SameOneWay => f.write_str("everything moves one way, where it is the same"),
            Self::Tied => f.write_str("the data cannot tell it from this one"),
            Self::FitsWorse(by) => {
                write!(f, "fits worse: its criterion is {} higher", significant(*by, 3))
            }
            Self::PredictsWorse(by) => {
                let percent = significant(100.0 * by, 2);
                write!(f, "predicts the held-out data worse by {percent} %")
            }
            Self::Longer => f.write_str("says the same with more parameters"),
        }
    }
}

/// The note behind a parameter that was fitted: what trades against something else has a value, and no deviation of its own.
pub(super) fn found(title: &str, std: f64) -> String {
    let sure = if std.is_finite() {
        format!("+- {}", significant(std, 2))
    } else {
        "trades against others".into()
    };
    format!("{title}, found by gap: {sure}")
}

/// What inputs did between rows, by how many seconds they act later than written, if they do, and half a row, s, where
/// straight lines fit as well as held inputs.
pub(super) fn inputs_between(hold: Hold, later: Option<f64>, open: Option<f64>) -> String {
    let mut text = match hold {
        Hold::Zero if open.is_some() => "inputs are held between rows",
        Hold::Line if open.is_some() => "inputs follow straight lines between rows",
        Hold::Zero => "inputs are held between rows, which fits best",
        Hold::Line => "inputs follow straight lines between rows, which fits best",
        Hold::Curve => "inputs follow smooth curves between rows, which fits best",
    }
    .to_owned();
    if let Some(later) = later {
        let way = if later > 0.0 { "later" } else { "earlier" };
        let later = significant(later.abs(), 2);
        let _ = write!(
            text,
            ", and act {later} s {way} than written; less than a row is a matter of how the recording was taken, and no effect"
        );
    }
    if let Some(half) = open {
        let half = significant(half, 2);
        let (other, longer) = match hold {
            Hold::Zero => ("straight lines between them", "longer"),
            Hold::Line | Hold::Curve => ("held ones", "shorter"),
        };
        let _ = write!(
            text,
            "; {other} fit as well: a delay would be half a row ({half} s) {longer}, which is in its +-, as in that of every number that \
             this changes"
        );
    }
    text
}

/// That times so many times as long as written explain the data fitted as well as what was found, and whether those held out.
pub(super) fn another_clock(factor: f64, predicts: bool) -> String {
    let what = if predicts {
        "explains the recordings as well"
    } else {
        "explains the data fitted as well, and predicts those held out worse"
    };
    format!(
        "with times {} times as long as written the model as it is {what}: check the clock, or the frame rate of the video, first",
        significant(factor, 4)
    )
}

/// That the search was ended before it was over.
pub(super) fn stopped() -> String {
    "the search stopped at its work limit; fewer rows, or a model nearer to the machine, take less"
        .into()
}

/// How long the stretches are in which a model is run, s.
pub(super) fn in_segments(seconds: f64) -> String {
    format!(
        "integrating model: simulated in segments of {} s, each from fitted initial values",
        significant(seconds, 3)
    )
}

/// Which parameters the recordings do not tell.
pub(super) fn undetermined(names: &str) -> String {
    format!(
        "the data do not determine {names}: they trade against each other, or against the first values"
    )
}

/// That each `by` rows are one.
pub(super) fn averaged(by: usize) -> String {
    format!("rows are averaged by {by}: nothing faster is in these recordings")
}

/// That not all rows are run.
pub(super) fn not_all_rows(most: usize, rows: usize) -> String {
    format!("{most} of the {rows} rows fitted are run; all of them would take long")
}

/// That the first values are not those of the model.
pub(super) fn first_values_estimated() -> String {
    "the recordings do not begin at the first values that the model gives; they are estimated"
        .into()
}

/// That an angle jumps by whole turns in a recording.
pub(super) fn unrolled(recording: &str, column: &str, turns: usize) -> String {
    format!("{recording}: `{column}` wraps {turns} times and is unrolled")
}

/// What a spill adds to its equation when a part of it goes on.
pub(super) fn spill_goes_on(part: &str, to: &str) -> String {
    format!(", {part} of it goes on to {to}")
}

/// The rate of a sensor that lags behind the model.
pub(super) fn lagging(lagged: &str, time: &str) -> String {
    format!("({WHAT_THE_MODEL_SAYS} - {lagged})/{time}")
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
