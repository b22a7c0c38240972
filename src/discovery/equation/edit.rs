//! Changes to the text of a model: the program that is fitted is the text a person reviews.
//!
//! An effect is a [`Patch`]: new parameters and states, terms added to rates, wrappers around inputs and
//! outputs. [`apply`] writes it into the text and leaves every other byte, comments included, as it was.

use std::fmt::Write as _;

use crate::language::ast::{Expr, ExprKind, Item, ModelItem, Span};
use crate::language::parse;
use crate::units::{Dimension, Unit, significant};

use super::wording;

/// A new parameter as it stands in the text.
#[derive(Debug, Clone, PartialEq)]
pub struct NewParam {
    /// What the vocabulary calls it: `coefficient`.
    pub role: &'static str,
    /// What the model calls it: `v_dry`.
    pub name: String,
    /// Its dimension, if known.
    pub dimension: Option<Dimension>,
    /// What it may be.
    pub range: Option<[f64; 2]>,
    /// The value at which the effect is not there; `None` for a parameter of its shape.
    pub neutral: Option<f64>,
    /// Its value; free, with this as a guess, unless `std` is given.
    pub value: f64,
    /// Standard deviation once it has been fitted.
    pub std: Option<f64>,
}

/// What an effect changes in a model.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Patch {
    /// `coulomb(v)`, for the note behind its parameters.
    pub title: String,
    /// Parameters to add.
    pub params: Vec<NewParam>,
    /// States to add, all free, with their rates.
    pub states: Vec<(String, String)>,
    /// Definitions to add.
    pub lets: Vec<(String, String)>,
    /// Terms to add to the rate of a state: `- c*v`.
    pub rates: Vec<(String, String)>,
    /// Terms to add to an output.
    pub outputs: Vec<(String, String)>,
    /// An input and what acts in its place: `{}` is the input.
    pub input: Option<(String, String)>,
    /// An output and what is read in its place: `{}` is the output.
    pub output: Option<(String, String)>,
}

impl Patch {
    /// The parameters that say what the effect is like, not how much of it there is.
    pub fn shapes(&self) -> impl Iterator<Item = &NewParam> {
        self.params.iter().filter(|p| p.neutral.is_none())
    }

    /// How many parameters say how much there is, and how many what it is like.
    pub fn amounts_and_shapes(&self) -> (usize, usize) {
        let shapes = self.shapes().count();
        (self.params.len() - shapes, shapes)
    }
}

/// Returns a model of a text.
pub fn model_in(text: &str, name: &str) -> Option<ModelItem> {
    parse(text).0.items.into_iter().find_map(|item| match item {
        Item::Model(model) if name.is_empty() || model.name.text == name => Some(model),
        _ => None,
    })
}

/// Returns a name that the model does not have yet.
pub fn fresh(model: &ModelItem, wanted: &str) -> String {
    let taken = |name: &str| {
        let starts = model.params.iter().chain(&model.states).map(|s| &s.name.text);
        let formulas = model.lets.iter().chain(&model.outputs).map(|f| &f.name.text);
        starts.chain(formulas).chain(model.inputs.iter().map(|i| &i.name.text)).any(|n| n == name)
    };
    if !taken(wanted) {
        return wanted.into();
    }
    (2..10_000).map(|i| format!("{wanted}_{i}")).find(|n| !taken(n)).unwrap_or_default()
}

/// One replacement of bytes.
struct Edit {
    span: Span,
    with: String,
    /// Order among edits of one place.
    order: usize,
}

/// Writes a patch into the text of a model; `None` where it cannot be written.
pub fn apply(text: &str, name: &str, patch: &Patch) -> Option<String> {
    let model = model_in(text, name)?;
    let mut edits = Edits::new(text, &model, patch);
    edits.declarations();
    edits.new_rates()?;
    edits.terms()?;
    edits.around_output()?;
    edits.around_input()?;
    edits.written()
}

/// The replacements that write a patch, in the order in which they were asked for.
struct Edits<'a> {
    text: &'a str,
    model: &'a ModelItem,
    patch: &'a Patch,
    /// The blanks before a line of the model.
    indent: String,
    /// Where lines behind the parameters, the states and the equations begin.
    at_params: Span,
    at_states: Span,
    at_equations: Span,
    all: Vec<Edit>,
}

impl<'a> Edits<'a> {
    fn new(text: &'a str, model: &'a ModelItem, patch: &'a Patch) -> Self {
        let after_params = last_of(
            model.params.iter().map(|p| p.span).chain(model.inputs.iter().map(|i| i.name.span)),
        )
        .or_else(|| last_of(model.states.iter().map(|s| s.span)));
        let anchor = after_params.unwrap_or(Span { from: model.body.from, to: model.body.from });
        let after_states = last_of(model.states.iter().map(|s| s.span)).unwrap_or(anchor);
        let last_formula = last_of(model.equations.iter().map(|e| e.span)).unwrap_or(after_states);
        Self {
            text,
            model,
            patch,
            indent: indent_of(text, model),
            at_params: line_end(text, anchor, model.body),
            at_states: line_end(text, after_states, model.body),
            at_equations: line_end(text, last_formula, model.body),
            all: Vec::new(),
        }
    }

    /// Puts a text in the place of a span.
    fn edit(&mut self, span: Span, with: String) {
        let order = self.all.len();
        self.all.push(Edit { span, with, order });
    }

    /// Adds a line of the model with the effect's name behind it.
    fn line(&mut self, at: Span, statement: &str) {
        self.edit(at, format!("\n{}{statement}    // {}", self.indent, self.patch.title));
    }

    /// Declares parameters, states and definitions.
    fn declarations(&mut self) {
        let patch = self.patch;
        for param in &patch.params {
            let line = format!("\n{}{}", self.indent, declaration(param, &patch.title));
            self.edit(self.at_params, line);
        }
        for (state, _) in &patch.states {
            self.line(self.at_states, &format!("state {state} = free"));
        }
        for (name, formula) in &patch.lets {
            self.line(self.at_states, &format!("let {name} = {formula}"));
        }
    }

    /// Adds the rates of new states.
    fn new_rates(&mut self) -> Option<()> {
        for (state, rate) in &self.patch.states {
            // `{y}` in a rate is what output `y` was before.
            let mut rate = rate.clone();
            for output in &self.model.outputs {
                let placeholder = format!("{{{}}}", output.name.text);
                if rate.contains(&placeholder) {
                    let span = output.formula.span;
                    let lone = matches!(output.formula.kind, ExprKind::Name(_));
                    let inner = self.text.get(span.from..span.to)?;
                    let inner = if lone { inner.to_string() } else { format!("({inner})") };
                    rate = rate.replace(&placeholder, &inner);
                }
            }
            self.line(self.at_equations, &format!("{state}' = {rate}"));
        }
        Some(())
    }

    /// Adds terms to rates and outputs.
    fn terms(&mut self) -> Option<()> {
        for (state, term) in &self.patch.rates {
            let equation = self.model.equations.iter().find(|e| e.name.text == *state)?;
            let to = equation.formula.span.to;
            self.edit(Span { from: to, to }, format!(" {term}"));
        }
        for (output, term) in &self.patch.outputs {
            let to = self.output(output)?.span.to;
            self.edit(Span { from: to, to }, format!(" {term}"));
        }
        Some(())
    }

    /// Returns an output's formula; `None` for one that is late as a whole, to which nothing can be added.
    fn output(&self, name: &str) -> Option<&'a Expr> {
        let output = self.model.outputs.iter().find(|o| o.name.text == name)?;
        (!is_late(&output.formula)).then_some(&output.formula)
    }

    /// Wraps what is read in the place of an output.
    fn around_output(&mut self) -> Option<()> {
        let Some((output, template)) = &self.patch.output else { return Some(()) };
        let formula = self.output(output)?;
        let span = formula.span;
        let inner = self.text.get(span.from..span.to)?;
        let lone = matches!(formula.kind, ExprKind::Name(_) | ExprKind::Call(_));
        let bare = lone || template.contains("({}") || template.starts_with("{} ");
        let inner = if bare { inner.to_string() } else { format!("({inner})") };
        self.edit(span, template.replace("{}", &inner));
        Some(())
    }

    /// Wraps what acts in the place of an input, wherever it stands.
    fn around_input(&mut self) -> Option<()> {
        let Some((input, template)) = &self.patch.input else { return Some(()) };
        let model = self.model;
        let mut places = Vec::new();
        let formulas = model.lets.iter().chain(&model.equations).chain(&model.outputs);
        for formula in formulas {
            occurrences(&formula.formula, input, &mut places);
        }
        let first = *places.first()?;
        let inner = self.text.get(first.from..first.to)?.to_string();
        if template.starts_with("delay(") && inner != *input {
            return None;
        }
        if places.iter().any(|p| self.text.get(p.from..p.to) != Some(&inner)) {
            return None;
        }
        if template.starts_with("delay(") {
            for place in places {
                self.edit(place, template.replace("{}", input));
            }
        } else {
            let acting = fresh(model, &format!("{input}_acting"));
            let formula = template.replace("{}", &inner);
            self.line(self.at_states, &format!("let {acting} = {formula}"));
            for place in places {
                self.edit(place, acting.clone());
            }
        }
        Some(())
    }

    /// Returns the text with everything replaced; `None` where two replacements meet.
    fn written(mut self) -> Option<String> {
        // A new line comes behind whatever joins the end of the line before it.
        self.all.sort_by_key(|e| (e.span.from, e.with.starts_with('\n'), e.order));
        let mut out = String::with_capacity(self.text.len() + 200);
        let mut at = 0;
        for edit in self.all {
            if edit.span.from < at {
                return None;
            }
            out.push_str(&self.text[at..edit.span.from]);
            out.push_str(&edit.with);
            at = edit.span.to;
        }
        out.push_str(&self.text[at..]);
        Some(out)
    }
}

/// `param v_dry: m/s^2 = 0.2145    // dry_friction(v): +- 0.002`.
fn declaration(param: &NewParam, title: &str) -> String {
    let unit =
        param.dimension.map(Dimension::si).filter(|u| !u.is_empty() && Unit::parse(u).is_ok());
    let unit = unit.map_or(String::new(), |u| format!(": {u}"));
    let number = |v: f64| format!("{v:e}");
    if let Some(std) = param.std {
        let value = significant(param.value, 6);
        return format!(
            "param {}{unit} = {value}    // {}",
            param.name,
            wording::found(title, std)
        );
    }
    let range = param
        .range
        .map_or(String::new(), |[low, high]| format!(" in {} to {}", number(low), number(high)));
    format!("param {}{unit} = free ~ {}{range}    // {title}", param.name, number(param.value))
}

fn is_late(expr: &Expr) -> bool {
    matches!(&expr.kind, ExprKind::Call(call) if call.name.text == "delay")
}

/// Where an input stands in a formula; a delayed input counts with its delay.
fn occurrences(expr: &Expr, input: &str, out: &mut Vec<Span>) {
    match &expr.kind {
        ExprKind::Name(name) if name == input => out.push(expr.span),
        ExprKind::Negate(inner) => occurrences(inner, input, out),
        ExprKind::Binary(a, _, b) => {
            occurrences(a, input, out);
            occurrences(b, input, out);
        }
        ExprKind::Call(call) => {
            let args = || call.args.iter().flat_map(|a| &a.values);
            let of_input = args()
                .next()
                .is_some_and(|a| matches!(&a.kind, ExprKind::Name(name) if name == input));
            if call.name.text == "delay" && of_input {
                out.push(call.span);
            } else {
                args().for_each(|a| occurrences(a, input, out));
            }
        }
        _ => {}
    }
}

fn last_of(spans: impl Iterator<Item = Span>) -> Option<Span> {
    spans.max_by_key(|s| s.to)
}

/// The end of the line a statement ends on, its note included, inside the model.
fn line_end(text: &str, after: Span, body: Span) -> Span {
    let end = text[after.to..].find('\n').map_or(text.len(), |i| after.to + i);
    let at = if end > body.to { after.to } else { end };
    let at = at - usize::from(text[..at].ends_with('\r'));
    Span { from: at, to: at }
}

/// The indentation of the model's lines.
fn indent_of(text: &str, model: &ModelItem) -> String {
    let first = model
        .equations
        .iter()
        .chain(&model.outputs)
        .map(|e| e.span.from)
        .min()
        .unwrap_or(model.body.from);
    let line = text[..first].rfind('\n').map_or(0, |i| i + 1);
    let blanks: String =
        text[line..first].chars().take_while(|c| matches!(c, ' ' | '\t')).collect();
    if blanks.is_empty() { "    ".into() } else { blanks }
}

/// The lines that differ, as a unified diff of the whole text with three lines of context.
pub fn diff(path: &str, before: &str, after: &str) -> String {
    let (a, b): (Vec<&str>, Vec<&str>) = (before.lines().collect(), after.lines().collect());
    if a == b {
        return String::new();
    }
    // Longest common subsequence; models are short.
    let mut table = vec![vec![0_u32; b.len() + 1]; a.len() + 1];
    for i in (0..a.len()).rev() {
        for j in (0..b.len()).rev() {
            table[i][j] = if a[i] == b[j] {
                table[i + 1][j + 1] + 1
            } else {
                table[i + 1][j].max(table[i][j + 1])
            };
        }
    }
    let mut lines: Vec<(char, &str)> = Vec::new();
    let (mut i, mut j) = (0, 0);
    while i < a.len() || j < b.len() {
        if i < a.len() && j < b.len() && a[i] == b[j] {
            lines.push((' ', a[i]));
            i += 1;
            j += 1;
        } else if i < a.len() && (j == b.len() || table[i + 1][j] >= table[i][j + 1]) {
            lines.push(('-', a[i]));
            i += 1;
        } else {
            lines.push(('+', b[j]));
            j += 1;
        }
    }
    let near =
        |k: usize| (k.saturating_sub(3)..(k + 4).min(lines.len())).any(|m| lines[m].0 != ' ');
    let mut out = format!("--- {path}\n+++ {path}\n");
    let (mut at_a, mut at_b) = (1, 1);
    let mut k = 0;
    while k < lines.len() {
        let from = k;
        while k < lines.len() && near(k) {
            k += 1;
        }
        if k > from {
            let hunk = &lines[from..k];
            let count = |skip: char| hunk.iter().filter(|(sign, _)| *sign != skip).count();
            let (n_a, n_b) = (count('+'), count('-'));
            let _ = writeln!(out, "@@ -{at_a},{n_a} +{at_b},{n_b} @@");
            for (sign, line) in hunk {
                out.push(*sign);
                out.push_str(line);
                out.push('\n');
            }
            at_a += n_a;
            at_b += n_b;
        } else {
            at_a += 1;
            at_b += 1;
            k += 1;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A term at the end of the last equation and a new line behind it meet in one place.
    #[test]
    fn a_term_joins_its_equation_and_not_the_note_of_a_new_line() {
        let text = "model m {\n    input u\n    state q = free, v = free\n    q' = v\n    v' = u\n    output y = q\n}\n";
        let patch = Patch {
            title: "loop".into(),
            states: vec![("z".into(), "v - z".into())],
            rates: vec![("v".into(), "- z".into())],
            ..Patch::default()
        };
        let changed = apply(text, "m", &patch).unwrap();
        assert!(changed.contains("    v' = u - z\n    z' = v - z    // loop\n"), "{changed}");
    }
}
