//! A finding as one self-contained HTML page: what is missing and why, then what is left of every channel over time.
//!
//! A plot of an effect shows what is left without it, all others in place, against the state it acts by, with what the
//! effect adds over it. Below, each channel before and after, with what was held out shaded and with the band that values
//! are weighed by. How a finding is worded is [`super::gap`]'s business, how a plot is drawn [`super::plot`]'s.

use std::fmt::Write as _;

use crate::discovery::finding::{Channel, Effect, Finding, Verdict};
use crate::discovery::vocabulary::kind_named;
use crate::discovery::{Against, Investigation, Trace, Why};
use crate::units::significant;

use super::html::{self, escaped};
use super::plot::{Axis, Plot, STYLE};
use super::{Style, gap};

/// Most points of a curve; more would not show.
const POINTS: usize = 700;
/// So few values are drawn with bars of their noise.
const FEW: usize = 20;
/// Stretches of a state over which what is left is averaged.
const MEANS: usize = 40;
/// A channel has changed if what is left of it has by this part of its noise.
const CHANGED: f64 = 0.1;

/// Returns the page; `after` is what follows the plots, as HTML.
pub fn page(investigation: &Investigation, after: &str) -> String {
    let finding = &investigation.finding;
    let plain = Style { json: false, quiet: false, verbose: false, colour: false, bars: false };
    let words = escaped(gap::people(finding, plain).trim_end());
    let mut whys = String::new();
    for (at, effect) in finding.effects.iter().enumerate() {
        whys.push_str(&effect_card(effect, &own(finding, at, &investigation.whys)));
    }
    let (mut changed, mut others) = (String::new(), String::new());
    for place in &finding.places {
        let own: Vec<&Trace> =
            investigation.traces.iter().filter(|trace| trace.channel == place.channel).collect();
        let text =
            if is_changed(&own) || finding.effects.is_empty() { &mut changed } else { &mut others };
        text.push_str(&channel_card(place, &own));
    }
    let mut body = format!(
        "<style>\n{STYLE}\n.effect{{margin-top:0}}\n</style>\n<h1>{}</h1>\n<p>{}</p>\n{}",
        escaped(&heading(finding)),
        escaped(&finding.reason),
        gone(finding)
    );
    if !whys.is_empty() {
        let _ = write!(
            body,
            "<h2>Why</h2>\n<p class=\"key soft\">Measured minus the model with all other effects: \
             <b style=\"color:var(--fitted)\">● fitted</b>, <b style=\"color:var(--heldout)\">■ held out</b>, \
             <b style=\"color:var(--law)\">— what the effect adds</b></p>\n<div class=\"plots\">{whys}</div>\n"
        );
    }
    if !changed.is_empty() {
        let _ = write!(
            body,
            "<h2>Before and after</h2>\n<p class=\"key soft\">Measured minus model: \
             <b style=\"color:var(--before)\">before (dotted)</b>, <b style=\"color:var(--fitted)\">after \
             (solid)</b>. Shaded: held out. Grey band: two standard deviations to each side; values are weighed by \
             it.</p>\n<div class=\"plots\">{changed}</div>\n"
        );
    }
    body.push_str(&weighed(finding, &investigation.traces));
    if !others.is_empty() {
        let _ = writeln!(
            body,
            "<details><summary>Channels that did not change</summary><div class=\"plots\">{others}</div></details>"
        );
    }
    let _ = write!(
        body,
        "<details><summary>The whole answer in words</summary><pre class=\"columns\">{words}</pre></details>\n{after}"
    );
    html::document("gap", &body)
}

/// Says how much smaller the gap is, in what it is counted, and what that is in the channels' own units.
fn weighed(finding: &Finding, traces: &[Trace]) -> String {
    let gap = &finding.gap;
    let in_noise = (gap.noise_floor - 1.0).abs() < 1e-9;
    let unit = if in_noise {
        "times what noise and the model's own inaccuracy explain (1 is noise alone)"
    } else {
        "standard deviations of the signal"
    };
    let mut text = format!(
        "<details><summary>All channels in numbers</summary><div class=\"scroll\"><table><caption>What is left, root mean square; of the data held out, as above, on rows that decided nothing where some were set aside</caption><thead><tr><th scope=\"col\">\
         <th scope=\"col\" class=\"number\">fitted, before<th scope=\"col\" class=\"number\">after\
         <th scope=\"col\" class=\"number\">held out, before<th scope=\"col\" class=\"number\">after</tr></thead>\n<tbody>\
         <tr><th scope=\"row\">all channels, {unit}{}",
        [gap.before.train, gap.after.train, gap.before.heldout, gap.after.heldout]
            .map(|value| format!("<td class=\"number\">{}", significant(value, 3)))
            .concat()
    );
    for place in &finding.places {
        let own = || traces.iter().filter(|trace| trace.channel == place.channel);
        let fitted = |values: fn(&Trace) -> &[f64]| {
            let rows = own().flat_map(|trace| values(trace).iter().zip(&trace.held_out));
            let rows = rows.filter(|(value, held)| !**held && value.abs() > 0.0);
            let (sum, n) = rows.fold((0.0, 0_usize), |(sum, n), (v, _)| (sum + v * v, n + 1));
            (n > 0).then(|| (sum / n as f64).sqrt())
        };
        // Of what was held out the same rows as everywhere else on the page.
        let told = place.heldout.map(|told| [told.before, told.after]);
        let [was, is] = told.map_or([None; 2], |told| told.map(Some));
        if own().next().is_some() {
            let cells = [fitted(before), fitted(left), was, is].map(|value| {
                let text =
                    value.map_or("–".to_owned(), |value| gap::quantity(value, &place.unit));
                format!("<td class=\"number\">{text}")
            });
            let _ = write!(
                text,
                "\n<tr><th scope=\"row\">{}{}",
                escaped(&place.channel),
                cells.concat()
            );
        }
    }
    text.push_str("</tbody></table></div></details>\n");
    text
}

/// The verdict in plain words, with what one effect does.
fn heading(finding: &Finding) -> String {
    let mut letters = gap::headline(finding).chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    let head: String = first.chain(letters).collect();
    match finding.effects.as_slice() {
        [one] if finding.verdict == Verdict::Named => match kind_named(&one.name) {
            Some(kind) => format!("{head}: {}, at {}", kind.does, one.at),
            None => head,
        },
        _ => head,
    }
}

/// Says which part of the gap is gone, where something was found.
fn gone(finding: &Finding) -> String {
    if finding.effects.is_empty() {
        return String::new();
    }
    format!("<p>{}</p>\n", escaped(&gap::gone(finding)))
}

fn before(trace: &Trace) -> &[f64] {
    &trace.before
}

fn left(trace: &Trace) -> &[f64] {
    &trace.after
}

/// Whether what is left of a channel changed.
fn is_changed(traces: &[&Trace]) -> bool {
    traces.iter().any(|trace| {
        let change = trace.before.iter().zip(&trace.after).map(|(a, b)| (a - b).powi(2));
        let rms = (change.sum::<f64>() / trace.before.len().max(1) as f64).sqrt();
        rms > CHANGED * trace.noise
    })
}

/// Returns the plots of the effect at a place of a finding. Of two of one name and place, such as a width and a height, each
/// has its own.
fn own<'a>(finding: &Finding, at: usize, whys: &'a [Why]) -> Vec<&'a Why> {
    let effect = &finding.effects[at];
    let is_same = |other: &&Effect| effect.name == other.name && effect.at == other.at;
    let own = whys.iter().filter(|why| why.name == effect.name && why.at == effect.at);
    let own: Vec<&Why> = own.collect();
    let before = finding.effects[..at].iter().filter(is_same).count();
    match own.get(before) {
        Some(one) if finding.effects.iter().filter(is_same).count() == own.len() => vec![*one],
        _ => own,
    }
}

/// An effect: its name, what it does, its numbers, and the plots that show it.
fn effect_card(effect: &Effect, whys: &[&Why]) -> String {
    let plots: String = whys.iter().filter_map(|why| why_plot(why)).collect();
    let does = kind_named(&effect.name).map_or("", |kind| kind.does);
    let numbers = gap::numbers(effect);
    let doubt = if effect.indistinguishable { " (in doubt)" } else { "" };
    format!(
        "<section class=\"card\"><h3 class=\"effect\">{} at {}{doubt}</h3><p>{}{}</p>{plots}</section>\n",
        escaped(&effect.name),
        escaped(&effect.at),
        escaped(does),
        if numbers.is_empty() { String::new() } else { format!("<br>{}", escaped(&numbers)) },
    )
}

/// Draws what is left without an effect against the state it acts by, and what the effect adds.
fn why_plot(why: &Why) -> Option<String> {
    let state = Axis::over(&why.state, &why.state_unit, why.rows.iter().map(|row| row.state))?;
    let is_few = why.rows.len() <= FEW;
    let room = if is_few { 2.0 * why.noise } else { 0.0 };
    let values = why.rows.iter().flat_map(|row| [row.left - room, row.left + room, row.law]);
    let mut plot = Plot::new(state, Axis::around(&why.channel, &why.unit, values)?);
    let stride = why.rows.len().div_ceil(2 * POINTS).max(1);
    for held_out in [false, true] {
        let colour = if held_out { "var(--heldout)" } else { "var(--fitted)" };
        let own = || why.rows.iter().filter(|row| row.held_out == held_out);
        if is_few {
            plot.bars(own().map(|row| (row.state, row.left - room, row.left + room)), colour);
        }
        let size = if is_few { 8.0 } else { 3.0 };
        let own = own().step_by(stride).map(|row| (row.state, row.left));
        plot.dots(own, (colour, size), !held_out);
    }
    if why.curve.is_empty() {
        let law = why.rows.iter().step_by(stride);
        let size = if is_few { 5.0 } else { 2.0 };
        plot.dots(law.map(|row| (row.state, row.law)), ("var(--law)", size), true);
    } else {
        plot.curve(why.curve.iter().copied(), "var(--law)");
    }
    let says = format!("{} against {}, and what {} adds", why.channel, why.state, why.name);
    let mut drawn = plot.drawn(&says);
    if is_few {
        drawn.push_str("<p class=\"soft\">Bars: two standard deviations to each side</p>");
    }
    if let Some(span) = why.mean_over {
        let _ = write!(
            drawn,
            "<p class=\"soft\">Each point is a mean over {} s</p>",
            significant(span, 2)
        );
    }
    Some(drawn)
}

/// Draws a channel over time, recording after recording.
fn channel_card(place: &Channel, traces: &[&Trace]) -> String {
    let Some(first) = traces.first() else { return String::new() };
    // Recordings follow each other with a little room between them.
    let span = |trace: &Trace| match (trace.time.first(), trace.time.last()) {
        (Some(from), Some(to)) => to - from,
        _ => 0.0,
    };
    let total: f64 = traces.iter().map(|trace| span(trace)).sum();
    let mut begin = 0.0;
    let mut laid = Vec::new();
    for trace in traces {
        let from = trace.time.first().copied().unwrap_or(0.0);
        laid.push((*trace, trace.time.iter().map(|t| begin + t - from).collect::<Vec<f64>>()));
        begin += span(trace) + 0.02 * total;
    }
    let values = traces.iter().flat_map(|trace| trace.before.iter().chain(&trace.after).copied());
    let values = values.chain([-3.0 * first.noise, 3.0 * first.noise]);
    let along = if first.along == "s" { ("time", "s") } else { (first.along, "") };
    let times = laid.iter().flat_map(|(_, time)| time.iter().copied());
    let axes =
        (Axis::over(along.0, along.1, times), Axis::around(&place.channel, &place.unit, values));
    let (Some(x), Some(y)) = axes else { return String::new() };
    let mut plot = Plot::new(x, y);
    for (trace, time) in &laid {
        for (from, to) in stretches(&trace.held_out) {
            plot.shade(time[from], time[to], "var(--held)");
        }
        let stride = time.len().div_ceil(POINTS).max(1);
        let rows = || (0..time.len()).step_by(stride);
        let band: Vec<_> =
            rows().map(|k| (time[k], -2.0 * trace.sigma[k], 2.0 * trace.sigma[k])).collect();
        plot.band(&band, "#8884");
        plot.line(rows().map(|k| (time[k], trace.before[k])), "var(--before)", "3 2");
        plot.line(rows().map(|k| (time[k], trace.after[k])), "var(--fitted)", "");
    }
    // Of a path, what tells recordings apart: of a run's, its folder.
    let name = |trace: &&Trace| {
        let path = trace.recording.strip_suffix("/arm.csv").unwrap_or(&trace.recording);
        let name = path.rsplit('/').next().unwrap_or_default();
        let is_held = trace.held_out.iter().all(|held| *held);
        format!("{name}{}", if is_held { " (held out)" } else { "" })
    };
    let names: Vec<String> = traces.iter().map(name).collect();
    let against = traces.iter().filter_map(|trace| Some((*trace, trace.against.as_ref()?)));
    let follows = &place.concentrated_in;
    format!(
        "<section class=\"card\"><h3 class=\"effect\">{}</h3><p class=\"soft\">{}{}</p>{}{}</section>\n",
        escaped(&place.channel),
        escaped(&names.join(", ")),
        if follows.is_empty() { String::new() } else { format!("; follows {}", escaped(follows)) },
        plot.drawn("measured minus model, before and after"),
        against.filter_map(|(trace, against)| scatter(trace, against)).collect::<String>(),
    )
}

/// Returns the stretches in which a flag is set: first row and last.
fn stretches(flags: &[bool]) -> Vec<(usize, usize)> {
    let mut found: Vec<(usize, usize)> = Vec::new();
    for (row, _) in flags.iter().enumerate().filter(|(_, flag)| **flag) {
        match found.last_mut() {
            Some((_, to)) if *to + 1 == row => *to = row,
            _ => found.push((row, row)),
        }
    }
    found
}

/// Draws what is left of a channel over the state it depends on most, and the mean over stretches of that state.
fn scatter(trace: &Trace, against: &Against) -> Option<String> {
    let judged = || trace.after.iter().zip(&against.values).filter(|(left, _)| left.abs() > 0.0);
    let state = Axis::over(&against.state, &against.unit, judged().map(|(_, at)| *at))?;
    let axis = Axis::around(&trace.channel, &trace.unit, judged().map(|(left, _)| *left))?;
    let mut plot = Plot::new(state, axis);
    let stride = judged().count().div_ceil(2 * POINTS).max(1);
    plot.dots(
        judged().step_by(stride).map(|(left, at)| (*at, *left)),
        ("var(--fitted)", 2.5),
        true,
    );
    let (from, to) = judged().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, at)| {
        (low.min(*at), high.max(*at))
    });
    let wide = ((to - from) / MEANS as f64).max(f64::MIN_POSITIVE);
    let mut sums = [(0.0, 0_usize); MEANS];
    for (left, at) in judged() {
        let sum = &mut sums[(((at - from) / wide) as usize).min(MEANS - 1)];
        *sum = (sum.0 + left, sum.1 + 1);
    }
    let means = sums.iter().enumerate().filter(|(_, (_, rows))| *rows > 0);
    let means = means.map(|(k, (sum, rows))| (from + (k as f64 + 0.5) * wide, sum / *rows as f64));
    plot.line(means, "var(--before)", "");
    let drawn = plot.drawn(&format!("what is left against {}", against.state));
    Some(format!(
        "<p class=\"soft\">What is left in {} against {}: a curve over it, such as the mean (red), would take {:.0} % of it away</p>{drawn}",
        escaped(&trace.recording),
        escaped(&against.state),
        100.0 * against.part,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discovery::Row;
    use crate::discovery::finding::{Evidence, Gap, Left, ModelChange, Split};

    #[test]
    fn the_page_shows_why_with_axes_and_needs_nothing_from_outside() {
        let split = Split { train: 2.0, heldout: 2.0 };
        let place = Channel {
            channel: "tau_1".into(),
            rms: 0.7,
            noise: 0.1,
            unit: "N*m".into(),
            share: 1.0,
            concentrated_in: "q_1".into(),
            heldout: Some(Left { before: 1.23, after: 0.45 }),
        };
        let finding = Finding {
            identified: Vec::new(),
            verdict: Verdict::Unknown,
            places: vec![place],
            effects: vec![Effect::new(
                ("coulomb_friction", "joint_1".into()),
                std::collections::BTreeMap::new(),
                (Evidence::default(), 1.0),
                String::new(),
            )],
            path: Vec::new(),
            gap: Gap::of(split, split, 1.0),
            model: ModelChange::default(),
            next_experiment: None,
            reason: "a < b".into(),
            smallest_visible: Vec::new(),
            notes: Vec::new(),
        };
        let left: Vec<f64> = (0..100).map(|k| f64::from(k).sin()).collect();
        let against =
            Against { state: "q_1".into(), unit: "rad".into(), part: 0.4, values: left.clone() };
        let trace = Trace {
            recording: "log".into(),
            channel: "tau_1".into(),
            unit: "N*m".into(),
            noise: 0.1,
            sigma: vec![0.1; 100],
            held_out: (0..100).map(|k| k >= 60).collect(),
            along: "s",
            time: (0..100).map(f64::from).collect(),
            before: left.iter().map(|left| 2.0 * left).collect(),
            after: left,
            unseen: Vec::new(),
            against: Some(against),
        };
        let traces = vec![trace];
        let row = |k: i32| Row {
            state: f64::from(k - 50),
            left: 0.7 * f64::from((k - 50).signum()),
            law: 0.7 * f64::from((k - 50).signum()),
            held_out: k % 2 == 0,
        };
        let whys = vec![Why {
            name: "coulomb_friction".into(),
            at: "joint_1".into(),
            channel: "tau_1".into(),
            unit: "N*m".into(),
            state: "dq_1".into(),
            state_unit: "rad/s".into(),
            noise: 0.1,
            mean_over: None,
            curve: Vec::new(),
            rows: (0..100).map(row).collect(),
        }];
        let page =
            page(&Investigation { finding, traces, whys, experiment: None, revision: None }, "");
        assert!(page.contains("a &lt; b") && !page.contains("://"));
        assert!(page.contains("What is left in log against q_1"), "{page}");
        for axis in ["q_1 (deg)", "tau_1 (N·m)", "time (s)", "dq_1 (rad/s)"] {
            assert!(page.contains(axis), "{axis} in {page}");
        }
        assert!(page.contains("<h3 class=\"effect\">coulomb_friction at joint_1</h3>"), "{page}");
        let (was, is) = (gap::quantity(1.23, "N*m"), gap::quantity(0.45, "N*m"));
        let cells = format!("<td class=\"number\">{was}<td class=\"number\">{is}");
        for told in [format!("from {was} to {is}"), cells] {
            assert!(page.contains(&told), "{told} in {page}");
        }
        assert_eq!(page.matches("fill=\"var(--held)\"").count(), 1, "one stretch was held out");
    }
}
