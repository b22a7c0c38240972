//! What an investigation found: the verdict, where the gap is, the effects, the shrink, what to do next.
//!
//! Data only: [`crate::discovery::investigate`] fills it in and the report words it for people. What serde
//! makes of it is the JSON of `trueup gap --json`.

use std::collections::BTreeMap;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::vocabulary;

/// A number of the model's own that the recordings have otherwise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Identified {
    /// What kind of number it is: `inertial`, `armature`.
    pub name: String,
    /// Whose it is: a link, a joint.
    pub at: String,
    /// `mass`, `moment_x`, `ixx`: about the link's own origin.
    pub parameter: String,
    /// What the file says, SI.
    pub file: f64,
    /// What the recordings say, SI.
    pub value: f64,
    /// One standard deviation.
    pub std: f64,
    /// SI unit.
    pub unit: String,
}

/// The answer in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// One effect, with a name.
    Named,
    /// More than one effect, each with a name.
    Several,
    /// Several effects explain the data equally well.
    Ambiguous,
    /// Something is missing that has no name; at best there is a formula.
    Unknown,
    /// What is left is noise.
    NothingMissing,
    /// Most of the gap stays whatever is tried: the model is not of this machine, or not of its units.
    ModelInadequate,
    /// The recordings are not of one machine.
    DifferentMachines,
}

/// How much of the gap one channel carries.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Channel {
    /// Its name: `tau_4`, `tcp_x`.
    pub channel: String,
    /// Root mean square of measured minus model, in its unit.
    pub rms: f64,
    /// Standard deviation of its noise, in its unit.
    pub noise: f64,
    /// SI unit of both.
    pub unit: String,
    /// Its part of everything beyond noise, 0 to 1.
    pub share: f64,
    /// The state, time or segment the residual follows most.
    pub concentrated_in: String,
    /// What is left of it on the data held out alone, where that is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heldout: Option<Left>,
}

/// Root mean square of measured minus model of one channel, in its unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Left {
    /// With the model as it was.
    pub before: f64,
    /// With what was found.
    pub after: f64,
}

/// A number or a vector.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// One number.
    Number(f64),
    /// One number per component; a deviation that nothing determines is infinite, and `null` in JSON.
    Vector(#[serde(deserialize_with = "components")] Vec<f64>),
}

impl Value {
    /// Whether it, or a component of it, is finite.
    fn is_finite(&self) -> bool {
        match self {
            Self::Number(value) => value.is_finite(),
            Self::Vector(values) => values.iter().any(|value| value.is_finite()),
        }
    }
}

/// Reads components as JSON has them.
fn components<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    let found = Vec::<Option<f64>>::deserialize(deserializer)?;
    Ok(found.into_iter().map(|component| component.unwrap_or(f64::INFINITY)).collect())
}

/// Writes the parameters that the data determine.
fn determined<S: Serializer>(
    all: &BTreeMap<String, Parameter>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(all.iter().filter(|(_, parameter)| parameter.std.is_finite()))
}

/// A fitted parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Its value in SI.
    pub value: Value,
    /// One standard deviation, in the same unit.
    pub std: Value,
    /// Its SI unit; empty for a plain number.
    pub unit: String,
}

/// How strongly the data speak for an effect.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Evidence {
    /// Fall of the Bayesian information criterion on the data fitted, when this effect is added to all
    /// the others; above 10 is usually called very strong.
    pub delta_bic: f64,
    /// The part of what is explainable on the held-out data that is lost when this effect is left out.
    pub heldout_gain: f64,
}

/// Another explanation that was tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Alternative {
    /// Its name.
    pub name: String,
    /// Where it would sit.
    pub at: String,
    /// How much worse its Bayesian information criterion is than that of the one chosen.
    pub delta_bic: f64,
    /// Why it was not chosen.
    pub why_not: String,
}

/// An effect that was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Effect {
    /// Its name in the vocabulary.
    pub name: String,
    /// Where it sits.
    pub at: String,
    /// Its parameters; JSON leaves out those of which the data determine nothing.
    #[serde(serialize_with = "determined")]
    pub parameters: BTreeMap<String, Parameter>,
    /// How sure.
    pub evidence: Evidence,
    /// The share of draws of stretches of the data in which it is named, 0 to 1 ([`super::resample`]); 0 of what has neither name nor
    /// formula.
    #[serde(default)]
    pub stability: f64,
    /// The part of the gap on data held out that it takes away beside all others, 0 to 1.
    #[serde(default)]
    pub heldout_share: f64,
    /// What it adds to the model, as an equation.
    pub equation: String,
    /// What else was considered.
    pub alternatives: Vec<Alternative>,
    /// Whether the data cannot tell it from another of the list.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub indistinguishable: bool,
}

/// How strongly the data speak for an effect, and the share of draws of them that name it.
pub type Worth = (Evidence, f64);

impl Effect {
    /// Returns an effect in no doubt.
    pub fn new(
        (name, at): (&str, String),
        parameters: BTreeMap<String, Parameter>,
        (evidence, stability): Worth,
        equation: String,
    ) -> Self {
        Self {
            name: name.into(),
            at,
            parameters,
            evidence,
            stability,
            heldout_share: evidence.heldout_gain.max(0.0),
            equation,
            alternatives: Vec::new(),
            indistinguishable: false,
        }
    }

    /// Returns what has no name, and nothing to say how it goes.
    pub fn unknown(at: String, why: &str) -> Self {
        Self::new(("unknown", at), BTreeMap::new(), (Evidence::default(), 0.0), why.into())
    }
}

/// A number on the data fitted and on the data held out.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Split {
    /// On the data fitted.
    pub train: f64,
    /// On the data held out.
    pub heldout: f64,
}

/// The gap once a name is in the model, beside those before it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// The name.
    pub name: String,
    /// Where.
    pub at: String,
    /// What is left, as [`Gap`] measures it.
    pub gap: Split,
}

/// The size of the gap before and after.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// `nrmse`: root mean square of (measured - model) / noise, so that pure noise is 1.
    pub metric: String,
    /// Without the effects.
    pub before: Split,
    /// With them.
    pub after: Split,
    /// What pure noise would give.
    pub noise_floor: f64,
    /// `1 - after/before` on held-out data, noise taken out of both; 0 when there was no gap.
    pub shrink_heldout: f64,
}

/// What would change in the model file.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ModelChange {
    /// The file, if one was given.
    pub path: Option<String>,
    /// The lines to add.
    pub added: Vec<String>,
    /// The change as a unified diff, empty without a file.
    #[serde(default)]
    pub diff: String,
    /// Whether the file was changed.
    #[serde(default)]
    pub applied: bool,
}

/// What to measure next, and why.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NextExperiment {
    /// Why it would settle the doubt.
    pub why: String,
    /// The file with the motion to command; `None` when no motion can settle it.
    pub commands: Option<String>,
}

/// The smallest effect of a kind that would have been seen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Visible {
    /// Its name.
    pub name: String,
    /// Where.
    pub at: String,
    /// Which parameter.
    pub parameter: String,
    /// The least size that stands out, in `unit`.
    pub least: f64,
    /// SI unit.
    pub unit: String,
}

/// The whole answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// In one word.
    pub verdict: Verdict,
    /// Where the gap is, largest share first.
    #[serde(rename = "where")]
    pub places: Vec<Channel>,
    /// What is missing; the indistinguishable set when ambiguous, empty when nothing is.
    pub effects: Vec<Effect>,
    /// How much smaller the gap becomes.
    pub gap: Gap,
    /// What is left of it after each name, the largest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub path: Vec<Step>,
    /// The change to the model.
    pub model: ModelChange,
    /// What to measure next.
    pub next_experiment: Option<NextExperiment>,
    /// The verdict's reason, one sentence.
    #[serde(default)]
    pub reason: String,
    /// What would have been seen if it were there: the power of the test.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub smallest_visible: Vec<Visible>,
    /// Numbers of the model's own that are off, beside what is missing from it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub identified: Vec<Identified>,
    /// What was assumed or left out, one sentence each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

impl Finding {
    /// Returns the finding with numbers of the model's own that were identified before anything was looked for: `filed` is
    /// the gap with those of the file, and `places` where it is.
    #[must_use]
    pub fn identified_first(
        mut self,
        mut identified: Vec<Identified>,
        filed: Split,
        places: Vec<Channel>,
    ) -> Self {
        self.places = places;
        let step = Step { name: "identified".into(), at: "model".into(), gap: self.gap.before };
        self.path.insert(0, step);
        self.gap = Gap::of(filed, self.gap.after, self.gap.noise_floor);
        identified.append(&mut self.identified);
        self.identified = identified;
        self
    }
}

impl Gap {
    /// Returns the gap from the four root mean squares, in units of noise.
    pub fn of(before: Split, after: Split, noise_floor: f64) -> Self {
        let shrink_heldout = shrink(before.heldout, after.heldout, noise_floor);
        Self { metric: "nrmse".into(), before, after, noise_floor, shrink_heldout }
    }

    /// Returns how much of it is explained, by the data held out.
    pub fn explains(&self) -> Explains {
        let (part, rest) = (self.shrink_heldout, self.after.heldout);
        // What is left near the noise may be little explained, but not by next to nothing.
        let is_small = rest < ESTIMATED || (rest < NEAR_NOISE && part >= MATTERS);
        if rest < ESTIMATED || (is_small && part >= EXPLAINED) {
            Explains::All
        } else if part >= EXPLAINED || is_small {
            Explains::Part
        } else {
            Explains::TooLittle
        }
    }
}

/// Returns by which part a root mean square falls, noise taken out of both; 0 when there was no gap.
pub fn shrink(before: f64, after: f64, noise_floor: f64) -> f64 {
    let beyond = |rms: f64| (rms * rms - noise_floor * noise_floor).max(0.0).sqrt();
    if beyond(before) > 0.0 { 1.0 - beyond(after) / beyond(before) } else { 0.0 }
}

/// How much of a gap is explained by what was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Explains {
    /// All that is not near noise.
    All,
    /// A part that is worth names.
    Part,
    /// So little that names are a lead at most, and what is missing has none.
    TooLittle,
}

/// What leaves less than this many times the noise is near it, and is told by its names with the part that they explain; a
/// channel that is left with more keeps a part of its gap.
pub const NEAR_NOISE: f64 = 2.0;

/// Noise estimated from a channel is that near to what it is.
pub const ESTIMATED: f64 = 1.1;

/// A number of an effect as it is told: name, value, standard deviation, unit.
pub type ParameterEstimate = (String, f64, f64, String);

/// Groups the numbers of an effect as its kind does: a vector's components become one parameter.
///
/// `numbers` are (name, value, standard deviation, unit), in the order of [`vocabulary::Kind::numbers`] or
/// a part of it; a component that is missing is 0. A name the kind does not know stays a number.
pub fn grouped(kind: &str, numbers: &[ParameterEstimate]) -> BTreeMap<String, Parameter> {
    let mut grouped = BTreeMap::new();
    let kinds = vocabulary::kind_named(kind).map_or(&[][..], |kind| kind.parameters);
    for (name, value, std, unit) in numbers {
        let vector = kinds.iter().find(|kind| kind.components.contains(&name.as_str()));
        let Some(vector) = vector else {
            let number = |value| Value::Number(value);
            let parameter =
                Parameter { value: number(*value), std: number(*std), unit: unit.clone() };
            grouped.insert(name.clone(), parameter);
            continue;
        };
        let zero = || Value::Vector(vec![0.0; vector.components.len()]);
        let entry = grouped.entry(vector.name.to_owned()).or_insert_with(|| Parameter {
            value: zero(),
            std: zero(),
            unit: unit.clone(),
        });
        if let Some(at) = vector.components.iter().position(|component| component == name)
            && let (Value::Vector(values), Value::Vector(stds)) = (&mut entry.value, &mut entry.std)
        {
            (values[at], stds[at]) = (*value, *std);
        }
    }
    grouped
}

/// Two explanations this near each other in the criterion are not told apart: "strong" on the scale of Kass and Raftery, 1995,
/// begins here.
pub const TIE: f64 = 6.0;

/// The part of what is left that an effect takes at least to be named; and the part of a signal below which what is left of it may
/// be an error of measurement.
pub const MATTERS: f64 = 0.1;

/// Names that explain less than this part of a gap are not what is missing.
pub const EXPLAINED: f64 = 0.5;

/// A misfit this many standard deviations of χ² above its expectation is no noise.
pub const SIGNIFICANT: f64 = 5.0;

/// Returns how many standard deviations of χ² a sum of squares lies above what noise alone would leave.
pub fn above_noise(sum: f64, count: usize) -> f64 {
    let count = count.max(1) as f64;
    (sum - count) / (2.0 * count).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noise_is_taken_out_of_the_shrink() {
        let split = |heldout| Split { train: 0.0, heldout };
        let perfect = Gap::of(split(5.0), split(1.0), 1.0);
        assert!((perfect.shrink_heldout - 1.0).abs() < 1e-12);
        let half = Gap::of(split(2.0_f64.hypot(1.0)), split(1.0_f64.hypot(1.0)), 1.0);
        assert!((half.shrink_heldout - 0.5).abs() < 1e-12);
        assert!(Gap::of(split(0.99), split(0.99), 1.0).shrink_heldout.abs() < 1e-12);
    }

    #[test]
    fn names_that_leave_most_of_a_gap_explain_too_little() {
        let split = |heldout| Split { train: 0.0, heldout };
        let explains = |before, after| Gap::of(split(before), split(after), 1.0).explains();
        assert_eq!(explains(4.32, 3.98), Explains::TooLittle);
        assert_eq!(explains(3.12, 2.21), Explains::TooLittle);
        assert_eq!(explains(1.5, 1.6), Explains::TooLittle);
        assert_eq!(explains(8.0, 2.5), Explains::Part);
        assert_eq!(explains(1.6, 1.4), Explains::Part);
        assert_eq!(explains(8.0, 1.9), Explains::All);
        assert_eq!(explains(1.05, 1.05), Explains::All);
    }

    #[test]
    fn components_become_a_vector() {
        let number = |name: &str, value| (name.to_owned(), value, 0.1, "m".to_owned());
        let grouped =
            grouped("payload", &[number("mass", 0.5), number("com_x", 1.0), number("com_z", 3.0)]);
        assert_eq!(grouped["com"].value, Value::Vector(vec![1.0, 0.0, 3.0]));
        assert_eq!(grouped["mass"].value, Value::Number(0.5));
    }

    #[test]
    fn json_has_no_number_that_the_data_leave_to_others() {
        let number = |name: &str, std| (name.to_owned(), 1.5, std, String::new());
        let parameters = grouped("x", &[number("level", f64::INFINITY), number("share", 0.1)]);
        let at = "h".to_owned();
        let effect =
            Effect::new(("overflow", at), parameters, (Evidence::default(), 1.0), String::new());
        let text = serde_json::to_string(&effect).unwrap();
        assert!(text.contains("\"share\"") && !text.contains("\"level\""), "{text}");
        let read: Effect = serde_json::from_str(&text).unwrap();
        assert_eq!(read.parameters["share"], effect.parameters["share"]);
    }

    #[test]
    fn json_has_null_for_the_deviation_of_a_component_that_nothing_determines() {
        let number = |name: &str, std| (name.to_owned(), 0.5, std, "m".to_owned());
        let com = [number("com_x", 0.1), number("com_y", 0.1), number("com_z", f64::INFINITY)];
        let own = &grouped("payload", &com)["com"];
        let text = serde_json::to_string(own).unwrap();
        assert!(text.contains("\"std\":[0.1,0.1,null]"), "{text}");
        assert_eq!(serde_json::from_str::<Parameter>(&text).unwrap(), *own);
        assert!(own.std.is_finite());
    }

    #[test]
    fn a_verdict_is_one_lower_case_word_in_json() {
        assert_eq!(serde_json::to_string(&Verdict::NothingMissing).unwrap(), "\"nothing_missing\"");
    }
}
