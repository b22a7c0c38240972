//! The words of a formula for what has no name: products and powers of states and inputs, harmonics, and
//! what begins only above a level.

use crate::units::Dimension;

use super::candidates::{Ground, Range};

/// The word that is always the same.
pub(super) const CONSTANT: &str = "1";

/// One word of a formula.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Feature {
    /// The word, `{}` where the parameter of its shape stands.
    pub(super) text: String,
    /// Its dimension, if known.
    pub(super) dimension: Option<Dimension>,
    /// The parameter of its shape: its dimension, range and start.
    pub(super) shape: Option<(Option<Dimension>, [f64; 2], f64)>,
}

/// A state or an input, along the recordings.
struct Variable {
    name: String,
    dimension: Option<Dimension>,
    range: Range,
}

/// Every word that could stand in a formula.
pub(super) fn features(ground: &Ground) -> Vec<Feature> {
    let model = ground.compiled;
    let states = model.states.iter().zip(&ground.states).map(|(state, range)| Variable {
        name: state.name.clone(),
        dimension: model.units.of(&state.name),
        range: *range,
    });
    let inputs = model.inputs.iter().zip(&ground.inputs).map(|((name, dimension), range)| {
        Variable { name: name.clone(), dimension: *dimension, range: *range }
    });
    let variables: Vec<Variable> = states.chain(inputs).filter(|v| v.range.span() > 0.0).collect();
    let mut out = vec![plain(CONSTANT, Some(Dimension::NONE)), plain("t", Some(Dimension::TIME))];
    for v in &variables {
        alone(v, &mut out);
    }
    for v in &variables {
        for w in variables.iter().filter(|w| w.name != v.name) {
            together(v, w, &mut out);
        }
    }
    out
}

fn plain(text: impl Into<String>, dimension: Option<Dimension>) -> Feature {
    Feature { text: text.into(), dimension, shape: None }
}

/// Whether a sine may be taken of it.
fn turns(v: &Variable) -> bool {
    v.dimension.is_none_or(|d| d == Dimension::NONE || d == Dimension::ANGLE)
}

fn power(v: &Variable, n: u32) -> Option<Dimension> {
    v.dimension.map(|d| (1..n).fold(d, |product, _| product * d))
}

/// Words of one variable.
fn alone(v: &Variable, out: &mut Vec<Feature>) {
    let z = &v.name;
    out.push(plain(z.clone(), v.dimension));
    out.push(plain(format!("{z}^2"), power(v, 2)));
    out.push(plain(format!("{z}^3"), power(v, 3)));
    out.push(plain(format!("{z}^5"), power(v, 5)));
    if v.range.low < 0.0 {
        out.push(plain(format!("{z}*abs({z})"), power(v, 2)));
        out.push(plain(format!("abs({z})"), v.dimension));
        out.push(plain(format!("sign({z})"), Some(Dimension::NONE)));
    } else if v.dimension.is_none_or(|d| d == Dimension::NONE) {
        out.push(plain(format!("sqrt({z})"), v.dimension));
    }
    let (low, span) = (v.range.low, v.range.span());
    for part in [0.3, 0.5, 0.7] {
        let range = [low + 0.02 * span, low + 0.98 * span];
        for text in [format!("max({z} - {{}}, 0)"), format!("min({z} - {{}}, 0)")] {
            let shape = Some((v.dimension, range, low + part * span));
            out.push(Feature { text, dimension: v.dimension, shape });
        }
    }
    if turns(v) {
        for text in [format!("sin({{}}*{z})"), format!("cos({{}}*{z})")] {
            harmonics(&text, v, Some(Dimension::NONE), out);
        }
    }
}

/// A word at the first harmonics that a variable's range can show; the fit finds what lies between.
fn harmonics(text: &str, v: &Variable, dimension: Option<Dimension>, out: &mut Vec<Feature>) {
    for n in [1.0, 2.0, 4.0, 8.0] {
        let size = v.range.span().max(1e-12);
        let range = [0.3_f64.max(1.5 / size), 0.3_f64.max(1.5 / size) * 60.0];
        if n > range[0] {
            let shape = Some((Some(Dimension::NONE), range, n));
            out.push(Feature { text: text.into(), dimension, shape });
        }
    }
}

/// Products of two variables, the second never alone in a power.
fn together(v: &Variable, w: &Variable, out: &mut Vec<Feature>) {
    let (z, y) = (&v.name, &w.name);
    let times = |a: Option<Dimension>, b: Option<Dimension>| a.zip(b).map(|(a, b)| a * b);
    if z < y {
        out.push(plain(format!("{z}*{y}"), times(v.dimension, w.dimension)));
    }
    out.push(plain(format!("{z}*{y}^2"), times(v.dimension, power(w, 2))));
    if w.range.low < 0.0 {
        out.push(plain(format!("{z}*abs({y})"), times(v.dimension, w.dimension)));
    }
    if turns(w) {
        for text in [format!("{z}*cos({{}}*{y})"), format!("{z}*sin({{}}*{y})")] {
            harmonics(&text, w, v.dimension, out);
        }
    }
}
