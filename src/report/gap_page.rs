//! A finding as one self-contained HTML page: residuals before and after, held-out data shaded.

use std::fmt::Write as _;

use crate::discovery::finding::Finding;
use crate::discovery::{Against, Investigation, Trace};
use crate::trace::Measure;

use super::html::{self, escaped};
use super::{Style, gap, why};

/// Size of a plot, px.
const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 150.0;

/// How many channels are drawn.
const CHANNELS: usize = 8;

/// Most points of a curve; more would not show.
const POINTS: usize = 900;

/// Stretches of a state over which what is left is averaged.
const MEANS: usize = 40;

/// Returns the page; `after` is what follows the plots, as HTML.
pub fn page(investigation: &Investigation, after: &str) -> String {
    let finding = &investigation.finding;
    let plain = Style { json: false, quiet: false, verbose: false, colour: false, bars: false };
    let words = escaped(gap::people(finding, plain).trim_end());
    let mut plots = String::new();
    let shown = finding.places.iter().take(CHANNELS);
    for place in shown {
        for trace in investigation.traces.iter().filter(|trace| trace.channel == place.channel) {
            plots.push_str(&plot(trace, finding));
        }
    }
    let body = format!(
        "<style>\n.key b{{padding:0 .4em}} .plot svg{{display:block;width:100%;height:auto}}\n\
         :root{{--before:#c0271e;--after:#1f6fb0;--field:#fff;--held:#eef3e4}}\n\
         @media(prefers-color-scheme:dark){{:root{{--before:#ff8a80;--after:#7cb8f2;--field:#14171a;\
         --held:#1d2a1c}}}}\n</style>\n<h1>{}</h1>\n<pre class=\"columns\">{words}</pre>\n\
         <p class=\"key\">Measured minus model, <b style=\"color:var(--before)\">before (dotted)</b> and \
         <b style=\"color:var(--after)\">after (solid)</b>; the grey band is twice the noise, shaded is \
         held out.</p>\n{plots}{after}",
        escaped(&finding.reason)
    );
    html::document("gap", &body)
}

/// Draws measured minus model over time.
fn plot(trace: &Trace, finding: &Finding) -> String {
    let rows = trace.time.len();
    if rows < 2 {
        return String::new();
    }
    let most = trace
        .before
        .iter()
        .chain(&trace.after)
        .fold(3.0 * trace.noise, |most, value| most.max(value.abs()));
    let (from, to) = (trace.time[0], trace.time[rows - 1]);
    let x = |t: f64| (t - from) / (to - from).max(1e-9) * WIDTH;
    let y = |value: f64| HEIGHT / 2.0 - value / most * (HEIGHT / 2.0 - 4.0);
    let stride = rows.div_ceil(POINTS);
    let line = |values: &[f64], colour: &str, dash: &str| {
        let mut points = String::new();
        for (t, value) in trace.time.iter().zip(values).step_by(stride) {
            let _ = write!(points, "{:.1},{:.1} ", x(*t), y(*value));
        }
        format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.2\"{dash}/>",
            points.trim_end()
        )
    };
    let band = (y(-2.0 * trace.noise) - y(2.0 * trace.noise)).max(1.0);
    let shade = if trace.held_out { "var(--held)" } else { "var(--field)" };
    let follows = finding
        .places
        .iter()
        .find(|place| place.channel == trace.channel)
        .map_or("", |place| place.concentrated_in.as_str());
    format!(
        "<section class=\"card plot\"><h2>{}{} ({})</h2><p class=\"soft\">full scale ± {}, {:.1} {}{}{}</p>\n\
         <svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"measured minus model\">\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"{shade}\"/>\
         <rect y=\"{:.1}\" width=\"{WIDTH}\" height=\"{band:.1}\" fill=\"#8884\"/>{}{}</svg>{}</section>\n",
        escaped(&trace.channel),
        if trace.held_out { ", held out" } else { "" },
        escaped(&trace.recording),
        why::size(&Measure { value: most, unit: trace.unit.clone() }),
        to - from,
        trace.along,
        if follows.is_empty() { "" } else { ", follows " },
        escaped(follows),
        y(2.0 * trace.noise),
        line(&trace.before, "var(--before)", " stroke-dasharray=\"3 2\""),
        line(&trace.after, "var(--after)", ""),
        trace.against.as_ref().map_or_else(String::new, |against| scatter(trace, against)),
    )
}

/// Draws what is left of a channel over the state it depends on most, and the mean over stretches of that state.
fn scatter(trace: &Trace, against: &Against) -> String {
    let judged = || trace.after.iter().zip(&against.values).filter(|(left, _)| left.abs() > 0.0);
    let most = judged().fold(3.0 * trace.noise, |most, (left, _)| most.max(left.abs()));
    let (from, to) = judged().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, at)| {
        (low.min(*at), high.max(*at))
    });
    let x = |at: f64| (at - from) / (to - from).max(1e-12) * WIDTH;
    let y = |value: f64| HEIGHT / 2.0 - value / most * (HEIGHT / 2.0 - 4.0);
    let stride = judged().count().div_ceil(2 * POINTS).max(1);
    let mut dots = String::new();
    for (left, at) in judged().step_by(stride) {
        let _ = write!(dots, "M{:.1} {:.1}h0", x(*at), y(*left));
    }
    let mut sums = [(0.0, 0_usize); MEANS];
    for (left, at) in judged() {
        let sum = &mut sums[((x(*at) / WIDTH * MEANS as f64) as usize).min(MEANS - 1)];
        *sum = (sum.0 + left, sum.1 + 1);
    }
    let mut means = String::new();
    for (k, (sum, rows)) in sums.iter().enumerate().filter(|(_, (_, rows))| *rows > 0) {
        let middle = (k as f64 + 0.5) / MEANS as f64 * WIDTH;
        let _ = write!(means, "{middle:.1},{:.1} ", y(sum / *rows as f64));
    }
    let size = |value| gap::quantity(value, &against.unit);
    format!(
        "<p class=\"soft\">What is left against {}, from {} to {}, full scale ± {}: a curve over it, such as the mean (red), would take {:.0} % of it away</p>\
         <svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"what is left against {}\">\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"var(--field)\"/>\
         <path d=\"{dots}\" stroke=\"var(--after)\" stroke-opacity=\"0.35\" stroke-width=\"2.5\" stroke-linecap=\"round\"/>\
         <polyline points=\"{}\" fill=\"none\" stroke=\"var(--before)\" stroke-width=\"1.6\"/></svg>",
        escaped(&against.state),
        size(from),
        size(to),
        why::size(&Measure { value: most, unit: trace.unit.clone() }),
        100.0 * against.part,
        escaped(&against.state),
        means.trim_end(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discovery::finding::{Channel, Gap, ModelChange, Split, Verdict};

    #[test]
    fn the_page_needs_nothing_from_outside_and_escapes_what_it_shows() {
        let split = Split { train: 2.0, heldout: 2.0 };
        let place = Channel {
            channel: "tau_1".into(),
            rms: 0.7,
            noise: 0.1,
            unit: "N*m".into(),
            share: 1.0,
            concentrated_in: "q_1".into(),
            heldout: None,
        };
        let finding = Finding {
            identified: Vec::new(),
            verdict: Verdict::Unknown,
            places: vec![place],
            effects: Vec::new(),
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
            held_out: true,
            along: "s",
            time: (0..100).map(f64::from).collect(),
            before: left.clone(),
            after: left,
            unseen: Vec::new(),
            against: Some(against),
        };
        let traces = vec![trace];
        let page = page(&Investigation { finding, traces, experiment: None, revision: None }, "");
        assert!(page.contains("a &lt; b") && !page.contains("://"));
        assert!(page.contains("What is left against q_1, from -57.3 deg to 57.3 deg"), "{page}");
    }
}
