//! A finding in words: where the gap is, what is missing, how much smaller it becomes.

use std::fmt::Write as _;

use crate::discovery::finding::{Effect, Finding, Parameter, Value, Verdict};
use crate::units::{Unit, significant};

use super::Style;

/// How many characters the bar of the shrink is long.
const BAR: usize = 40;

/// The verdict in plain words.
pub(super) fn headline(finding: &Finding) -> &'static str {
    match finding.verdict {
        Verdict::Named => "one effect is missing",
        Verdict::Several => "several effects are missing",
        Verdict::Ambiguous if finding.effects.len() == 1 => {
            "cannot tell: something else explains this equally well"
        }
        Verdict::Ambiguous => "cannot tell: several effects explain this equally well",
        Verdict::Unknown => "something without a name is missing",
        Verdict::NothingMissing if !finding.identified.is_empty() => {
            "numbers of the model are off, nothing else is missing"
        }
        Verdict::NothingMissing => "nothing is missing",
        Verdict::DifferentMachines if !finding.effects.is_empty() => {
            "the recordings are not of one machine: some bear a load"
        }
        Verdict::DifferentMachines => "the recordings are not of one machine",
        Verdict::ModelInadequate => {
            "the model does not fit: most of the gap stays, whatever is added to it"
        }
    }
}

/// Words a finding for people.
pub fn people(finding: &Finding, style: Style) -> String {
    let mut text = String::new();
    let head = headline(finding);
    let _ = writeln!(text, "{}  {}", style.green(head), style.dim(&finding.reason));
    let shown: Vec<_> = finding.places.iter().filter(|place| place.share > 0.005).take(6).collect();
    if finding.verdict != Verdict::NothingMissing && !shown.is_empty() {
        let are_judged = shown.iter().any(|place| place.heldout.is_some());
        let column =
            |title: String| if are_judged { format!("{title:<25}") } else { String::new() };
        let _ = writeln!(
            text,
            "\nwhere      measured - model     noise        share  {}follows",
            column("held out".into())
        );
        for place in shown {
            let left = place.heldout.map_or_else(String::new, |left| {
                let of = |value| quantity(value, &place.unit);
                format!("{} → {}", of(left.before), of(left.after))
            });
            let _ = writeln!(
                text,
                "{:<10} {:<20} {:<12} {:>4.0} %  {}{}",
                place.channel,
                quantity(place.rms, &place.unit),
                quantity(place.noise, &place.unit),
                place.share * 100.0,
                column(left),
                place.concentrated_in
            );
        }
    }
    text.push_str(&identified(finding));
    for effect in &finding.effects {
        let _ = writeln!(text, "\n{}", effect_text(effect, style));
    }
    if finding.verdict == Verdict::NothingMissing && !finding.smallest_visible.is_empty() {
        let _ = writeln!(text, "\nwould have been seen, if it were at least");
        for seen in &finding.smallest_visible {
            let _ = writeln!(
                text,
                "  {:<20} {:<9} {} {}",
                seen.name,
                seen.at,
                seen.parameter,
                quantity(seen.least, &seen.unit)
            );
        }
    }
    text.push_str(&shrink(finding, style));
    if !finding.model.diff.is_empty() {
        let done = if finding.model.applied { "changed" } else { "not changed; `--apply` does" };
        let _ = writeln!(text, "\nmodel      {done}");
        for line in finding.model.diff.lines() {
            let painted = match line.chars().next() {
                Some('+') => style.green(line),
                Some('-') => style.red(line),
                _ => style.dim(line),
            };
            let _ = writeln!(text, "{painted}");
        }
    } else if !finding.model.added.is_empty() {
        let _ = writeln!(text, "\nmodel      no file given; it would gain");
        for line in &finding.model.added {
            let _ = writeln!(text, "{}", style.green(&format!("+   {line}")));
        }
    }
    if let Some(next) = &finding.next_experiment {
        let _ = writeln!(text, "\nnext       {}", next.why);
        if let Some(file) = &next.commands {
            let _ = writeln!(
                text,
                "           it is in {file}: carry it out, record it, and give `gap` that recording too"
            );
        }
    }
    for note in notes(&finding.notes) {
        let _ = writeln!(text, "{}", style.dim(&note));
    }
    text
}

/// The numbers of the model's own that are off, as a table.
fn identified(finding: &Finding) -> String {
    let mut text = String::new();
    if finding.identified.is_empty() {
        return text;
    }
    let _ = writeln!(text, "\n{:<27} {:<9} {:<13} off by", "numbers that are off", "", "file");
    for off in &finding.identified {
        let kind = off.name.as_str();
        let at = if kind == "inertial" { off.at.clone() } else { format!("{kind}({})", off.at) };
        let _ = writeln!(
            text,
            "{at:<27} {:<9} {:<13} {} ± {}",
            off.parameter,
            quantity(off.file, &off.unit),
            quantity(off.value - off.file, &off.unit),
            quantity(off.std, &off.unit)
        );
    }
    text
}

fn effect_text(effect: &Effect, style: Style) -> String {
    let mut text = format!("{}({})", effect.name, effect.at);
    for (name, parameter) in &effect.parameters {
        let _ = write!(text, "  {name} = {}", parameter_text(parameter));
    }
    if effect.indistinguishable {
        text.push_str("  (in doubt)");
    }
    let _ = write!(text, "\n  {}", effect.equation);
    let _ = write!(
        text,
        "\n  {}",
        style.dim(&format!(
            "evidence: BIC falls by {}; it accounts for {:.0} % of the explained held-out error; \
             {:.0} of 100 draws of the data name it",
            significant(effect.evidence.delta_bic, 3),
            effect.evidence.heldout_gain * 100.0,
            effect.stability * 100.0
        ))
    );
    for other in &effect.alternatives {
        let _ = write!(
            text,
            "\n  {}",
            style.dim(&format!("not {}({}): {}", other.name, other.at, other.why_not))
        );
    }
    text
}

fn parameter_text(parameter: &Parameter) -> String {
    // What is poured is read in millilitres.
    let (unit, factor) = match parameter.unit.as_str() {
        "m^3" => ("mL", 1e6),
        unit => (unit, 1.0),
    };
    match (&parameter.value, &parameter.std) {
        (Value::Number(value), Value::Number(std)) => {
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            if std.is_infinite() {
                format!("{}{unit} (not determined)", significant(factor * value, 4))
            } else if *std > 0.0 {
                format!(
                    "{}{unit} ± {}",
                    significant(factor * value, 4),
                    significant(factor * std, 2)
                )
            } else {
                format!("{}{unit}", significant(factor * value, 4))
            }
        }
        (Value::Vector(values), Value::Vector(stds)) => {
            let word = |value: f64, digits| {
                let is_open = value.is_infinite();
                if is_open { "not determined".into() } else { significant(value, digits) }
            };
            let list = |values: &[f64], digits| {
                let words: Vec<String> = values.iter().map(|value| word(*value, digits)).collect();
                words.join(", ")
            };
            format!("({}) {unit} ± ({})", list(values, 4), list(stds, 2))
        }
        _ => String::new(),
    }
}

/// The gap before and after as numbers and as a bar.
fn shrink(finding: &Finding, style: Style) -> String {
    let gap = &finding.gap;
    let mut text = String::new();
    let in_noise = (gap.noise_floor - 1.0).abs() < 1e-9;
    let unit = if in_noise {
        "units of noise (1 is noise alone)"
    } else {
        "standard deviations of the signal"
    };
    let _ = writeln!(text, "\ngap in {unit}");
    let most = gap.before.heldout.max(gap.after.heldout).max(1e-9);
    // Of one name the path is before and after.
    let path = if finding.path.len() > 1 { &finding.path[..] } else { &[] };
    let steps = path.iter().map(|step| (format!("+ {}({})", step.name, step.at), step.gap));
    let mut lines = vec![("before".to_owned(), gap.before)];
    lines.extend(steps);
    lines.push(("after".to_owned(), gap.after));
    let wide = lines.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let last = lines.len() - 1;
    for (at, (name, split)) in lines.iter().enumerate() {
        let filled = ((split.heldout / most) * BAR as f64).round() as usize;
        let bar = format!("{}{}", "█".repeat(filled.min(BAR)), "·".repeat(BAR - filled.min(BAR)));
        let bar = match at {
            0 => style.red(&bar),
            _ if at == last => style.green(&bar),
            _ => style.dim(&bar),
        };
        let _ = writeln!(
            text,
            "  {name:<wide$} fitted {:<8} held out {:<8} {bar}",
            significant(split.train, 3),
            significant(split.heldout, 3)
        );
    }
    if !finding.effects.is_empty() {
        let _ = writeln!(text, "  {}", gone(finding));
    }
    text
}

/// Says which part of the gap is gone, and what that counts: it may hide much of a channel where little weight lies.
pub(super) fn gone(finding: &Finding) -> String {
    let part = finding.gap.shrink_heldout * 100.0;
    let mut text = format!("{part:.1} % of the gap on held-out data is gone, noise taken out");
    let largest = finding.places.first().and_then(|place| Some((place, place.heldout?)));
    if let Some((place, left)) = largest {
        let of = |value| quantity(value, &place.unit);
        let _ = write!(
            text,
            "; each value counts by how exactly it is known.\n  Unweighted, {} went from {} to {}",
            place.channel,
            of(left.before),
            of(left.after)
        );
    }
    text
}

/// Words the numbers of an effect.
pub(super) fn numbers(effect: &Effect) -> String {
    let number = |(name, parameter): (&String, &Parameter)| {
        format!("{name} = {}", parameter_text(parameter))
    };
    effect.parameters.iter().map(number).collect::<Vec<_>>().join(", ")
}

/// Writes a number in its everyday unit.
pub(super) fn quantity(value: f64, unit: &str) -> String {
    // Nobody thinks of a viscosity in kg/m/s, nor of a soft gear in rad*s^2/kg/m^2.
    if unit == "Pa*s" || unit.contains('(') {
        return format!("{} {unit}", significant(value, 3));
    }
    Unit::parse(unit).map_or_else(
        |_| format!("{} {unit}", significant(value, 3)),
        |unit| unit.of(value).to_string(),
    )
}

/// Words notes, a line each. Those of the same several recordings stand together, and the recordings are named once.
fn notes(notes: &[String]) -> Vec<String> {
    let mut told: Vec<(Option<&str>, Vec<&str>)> = Vec::new();
    for note in notes {
        let split = note.split_once(": ").filter(|(of, _)| of.contains(", "));
        let (of, rest) = split.map_or((None, note.as_str()), |(of, rest)| (Some(of), rest));
        match told.iter_mut().find(|(known, _)| of.is_some() && *known == of) {
            Some((_, all)) => all.push(rest),
            None => told.push((of, vec![rest])),
        }
    }
    let words = |(of, all): (Option<&str>, Vec<&str>)| match (of, all.as_slice()) {
        (None, all) => format!("note: {}", all.join("\n  ")),
        (Some(of), [one]) => format!("note: {of}: {one}"),
        (Some(of), all) => format!("note: {of}:\n  {}", all.join("\n  ")),
    };
    told.into_iter().map(words).collect()
}

#[cfg(test)]
mod tests {
    use super::notes;

    /// The paths of eight recordings stood in three notes, one below the other.
    #[test]
    fn recordings_that_several_notes_are_of_are_named_once() {
        let of = "runs/1/arm.csv, runs/2/arm.csv";
        let said = [
            format!("{of}: no noise is given"),
            "what is left is above noise".to_owned(),
            "a.csv: cells are blank".to_owned(),
            format!("{of}: no controller is known"),
        ];
        let told = [
            format!("note: {of}:\n  no noise is given\n  no controller is known"),
            "note: what is left is above noise".to_owned(),
            "note: a.csv: cells are blank".to_owned(),
        ];
        assert_eq!(notes(&said), told);
        assert_eq!(notes(&said[..1]), [format!("note: {of}: no noise is given")]);
    }
}
