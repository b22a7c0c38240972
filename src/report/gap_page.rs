//! A finding as one self-contained HTML page: residuals before and after, held-out data shaded.

use std::fmt::Write as _;

use crate::discovery::finding::Finding;
use crate::discovery::{Investigation, Trace};
use crate::units::significant;

use super::{Style, escaped, gap};

/// Size of a plot, px.
const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 150.0;

/// How many channels are drawn.
const CHANNELS: usize = 8;

/// Most points of a curve; more would not show.
const POINTS: usize = 900;

/// Returns the page.
pub fn page(investigation: &Investigation) -> String {
    let finding = &investigation.finding;
    let plain = Style { json: false, quiet: false, colour: false, bars: false };
    let words = escaped(gap::people(finding, plain).trim_end());
    let mut plots = String::new();
    let shown = finding.places.iter().take(CHANNELS);
    for place in shown {
        for trace in investigation.traces.iter().filter(|trace| trace.channel == place.channel) {
            plots.push_str(&plot(trace, finding));
        }
    }
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>gap</title><style>\n\
         body{{font:15px/1.5 system-ui,sans-serif;max-width:900px;margin:2em auto;padding:0 1em;\
         color:#222;background:#fff}}\npre{{background:#f6f6f4;padding:1em;overflow-x:auto;\
         font-size:13px}}\nh2{{font-size:1em;margin:1.6em 0 .2em}}\n.key b{{padding:0 .4em}}\n\
         @media(prefers-color-scheme:dark){{body{{color:#ddd;background:#181818}}pre{{background:\
         #222}}}}\n</style></head><body>\n<h1>{}</h1>\n<pre>{words}</pre>\n\
         <p class=\"key\">measured minus model, <b style=\"color:#c33\">before</b> and \
         <b style=\"color:#27a\">after</b>; the grey band is twice the noise, shaded is held out</p>\n\
         {plots}</body></html>\n",
        escaped(&finding.reason)
    )
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
    let line = |values: &[f64], colour: &str| {
        let mut points = String::new();
        for (t, value) in trace.time.iter().zip(values).step_by(stride) {
            let _ = write!(points, "{:.1},{:.1} ", x(*t), y(*value));
        }
        format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1\"/>",
            points.trim_end()
        )
    };
    let band = (y(-2.0 * trace.noise) - y(2.0 * trace.noise)).max(1.0);
    let shade = if trace.held_out { "#eef3e4" } else { "#ffffff" };
    let follows = finding
        .places
        .iter()
        .find(|place| place.channel == trace.channel)
        .map_or("", |place| place.concentrated_in.as_str());
    format!(
        "<h2>{}{} ({})</h2><p>full scale ± {} {}, follows {}</p>\n\
         <svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"100%\" role=\"img\">\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"{shade}\"/>\
         <rect y=\"{:.1}\" width=\"{WIDTH}\" height=\"{band:.1}\" fill=\"#8884\"/>{}{}</svg>\n",
        escaped(&trace.channel),
        if trace.held_out { ", held out" } else { "" },
        escaped(&trace.recording),
        significant(most, 3),
        trace.unit,
        escaped(follows),
        y(2.0 * trace.noise),
        line(&trace.before, "#c33"),
        line(&trace.after, "#27a"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discovery::finding::{Gap, ModelChange, Split, Verdict};

    #[test]
    fn the_page_needs_nothing_from_outside_and_escapes_what_it_shows() {
        let split = Split { train: 2.0, heldout: 2.0 };
        let finding = Finding {
            verdict: Verdict::Unknown,
            places: Vec::new(),
            effects: Vec::new(),
            gap: Gap::of(split, split, 1.0),
            model: ModelChange::default(),
            next_experiment: None,
            reason: "a < b".into(),
            smallest_visible: Vec::new(),
            notes: Vec::new(),
        };
        let page = page(&Investigation { finding, traces: Vec::new(), experiment: None });
        assert!(page.contains("a &lt; b") && !page.contains("http"));
    }
}
