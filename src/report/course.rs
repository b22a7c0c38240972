//! The course of a run as drawings: which fluents held when, the water in the vessels, the torques of the joints.
//!
//! Time is the arm's, from the beginning of the first step. A fluent is read when a step is over; until the next one is,
//! what was read last is shown. Every drawing has the steps as columns, so that a page can light the one it shows.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use crate::trace::StepRecord;
use crate::workcell::Run;
use crate::workcell::film::Film;

use super::html::escaped;
use super::plot::{Axis, Plot};

/// What pages with these drawings need beside their look and that of plots.
pub const STYLE: &str = "\
svg.course{display:block;width:100%;min-width:40rem;height:auto;font:13px system-ui,sans-serif}\
svg.course text{fill:var(--ink)}svg.course .soft{fill:var(--soft)}\
[data-step]{fill:transparent;cursor:pointer}[data-step].here{fill:var(--accent);fill-opacity:.16}\
.graph [data-path].here>rect,.graph [data-path].here>polygon,.graph [data-path].here>path{stroke-width:3.5}\
svg.course .edge{stroke:var(--line);stroke-width:.7}\
.key{display:flex;flex-wrap:wrap;gap:.2rem 1rem;color:var(--soft);font-size:.88rem}\
.key i{display:inline-block;width:1.1em;height:.7em;margin-right:.4em;border:1px solid var(--line)}";

/// Width of the drawing of fluents, of the names beside it, and the height of a row, px.
const WIDTH: f64 = 1120.0;
const NAMES: f64 = 250.0;
const ROW: f64 = 24.0;
/// Room above the rows for the steps' numbers, below for times, px.
const HEAD: f64 = 22.0;
const FOOT: f64 = 24.0;
/// Columns narrower than this have no number of their own, px.
const NUMBERED: f64 = 16.0;
/// Fluents that are shown at most: what a person reads at one look; all are with the steps.
const MOST: usize = 18;
/// Letters of a name that there is room for.
const LETTERS: usize = 38;
/// Moments of a recording that a plot shows at most: one for each pixel of a telephone's screen.
const MOMENTS: usize = 440;
/// Colours that stay apart for the colour-blind on light and dark paper (Okabe and Ito, the yellow left out for a grey).
pub(super) const COLOURS: [&str; 7] =
    ["#0072b2", "#e69f00", "#009e73", "#d55e00", "#56b4e9", "#cc79a7", "#8a8f94"];

/// Returns the drawings, each in its card; empty for a run without steps.
///
/// `arm` is the text of the run's `arm.csv`, `film` the table of its film; either may be empty.
pub fn drawings(run: &Run, arm: &str, film: &Film) -> String {
    let Some(span) = Span::of(&run.steps) else { return String::new() };
    let mut text = String::new();
    if let Some(fluents) = fluents(&run.steps, &span) {
        let _ = write!(
            text,
            "<section class=\"card\"><h2>Fluents over time</h2>\n{fluents}</section>\n"
        );
    }
    let arm = Recording::read(arm, &span);
    let of_arm = |draw: fn(&Recording, &Span) -> Vec<String>| {
        arm.as_ref().map(|arm| draw(arm, &span)).unwrap_or_default()
    };
    let water = water(film, &span).into_iter();
    let plots: Vec<String> = water.chain(of_arm(torques)).chain(of_arm(tracking)).collect();
    if !plots.is_empty() {
        let _ = write!(text, "<div class=\"plots\">\n{}</div>\n", plots.concat());
    }
    text
}

/// The steps of a run in time.
struct Span {
    begin: f64,
    end: f64,
    /// Number, beginning and end of each step, s from `begin`.
    steps: Vec<(usize, f64, f64)>,
}

impl Span {
    /// `None` without a step that takes time.
    fn of(steps: &[StepRecord]) -> Option<Self> {
        let (begin, end) = (steps.first()?.interval_s[0], steps.last()?.interval_s[1]);
        let since = |t: f64| t - begin;
        let all = steps
            .iter()
            .map(|step| (step.number, since(step.interval_s[0]), since(step.interval_s[1])))
            .collect();
        (end > begin).then_some(Self { begin, end, steps: all })
    }

    fn long(&self) -> f64 {
        self.end - self.begin
    }

    fn axis(&self) -> Option<Axis> {
        Axis::over("arm time", "s", [0.0, self.long()].into_iter())
    }

    /// A plot over the span with the steps as columns.
    fn plot(&self, name: &str, unit: &str, values: impl Iterator<Item = f64>) -> Option<Plot> {
        let mut plot = Plot::new(self.axis()?, Axis::around(name, unit, values)?);
        for (number, from, to) in &self.steps {
            plot.column(*from, *to, *number);
        }
        Some(plot)
    }
}

/// Draws when fluents held: those that a step relies on or changes.
fn fluents(steps: &[StepRecord], span: &Span) -> Option<String> {
    let names = telling(steps);
    let shown = names.len().min(MOST);
    if shown == 0 {
        return None;
    }
    let x = |t: f64| NAMES + t / span.long() * (WIDTH - NAMES - 4.0);
    let high = HEAD + ROW * shown as f64 + FOOT;
    let bottom = high - FOOT;
    let mut svg = format!(
        "<div class=\"scroll\"><svg class=\"course\" viewBox=\"0 0 {WIDTH} {high}\" role=\"img\" \
         aria-label=\"which fluents held when; the tables of the steps say the same\">"
    );
    for (row, name) in names.iter().take(shown).enumerate() {
        let y = HEAD + ROW * row as f64;
        let _ = write!(
            svg,
            "<text x=\"{:.0}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            NAMES - 8.0,
            y + 15.0,
            escaped(&short(name))
        );
        for (k, step) in steps.iter().enumerate() {
            let Some(fluent) = step.fluents.iter().find(|fluent| fluent.name == *name) else {
                continue;
            };
            let from = x(span.steps[k].2);
            let to = span.steps.get(k + 1).map_or(x(span.long()), |(.., end)| x(*end));
            bar(&mut svg, [from, to, y + 3.0, 12.0], fluent.measured);
            bar(&mut svg, [from, to, y + 16.5, 4.0], fluent.twin);
        }
    }
    for (number, from, to) in &span.steps {
        let (left, right) = (x(*from), x(*to));
        let _ = write!(
            svg,
            "<path class=\"edge\" d=\"M{right:.1} {HEAD}V{bottom}\"/>\
             <rect data-step=\"{number}\" x=\"{left:.1}\" y=\"0\" width=\"{:.1}\" height=\"{bottom}\"/>",
            (right - left).max(2.0)
        );
        if right - left >= NUMBERED {
            let middle = f64::midpoint(left, right);
            let _ = write!(
                svg,
                "<text class=\"soft\" x=\"{middle:.1}\" y=\"15\" text-anchor=\"middle\">{number}</text>"
            );
        }
    }
    let _ = writeln!(
        svg,
        "<text class=\"soft\" x=\"{NAMES}\" y=\"{:.0}\">0 s</text>\
         <text class=\"soft\" x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"end\">{:.0} s of arm time</text></svg></div>",
        high - 8.0,
        WIDTH - 4.0,
        high - 8.0,
        span.long()
    );
    svg += "<p class=\"key\"><span><i style=\"background:var(--yes)\"></i>yes</span>\
            <span><i style=\"background:var(--no-tint)\"></i>no</span>\
            <span><i></i>unknown</span><span>wide: as measured; narrow: in the twin</span></p>\n";
    let more = names.len() - shown;
    if more > 0 {
        let _ = writeln!(svg, "<p class=\"soft\">{more} more changed; the steps tell of all.</p>");
    }
    Some(svg)
}

fn bar(svg: &mut String, [from, to, y, high]: [f64; 4], truth: Option<bool>) {
    let colour = match truth {
        Some(true) => "var(--yes)",
        Some(false) => "var(--no-tint)",
        None => return,
    };
    let wide = (to - from).max(0.0);
    let _ = write!(
        svg,
        "<rect x=\"{from:.1}\" y=\"{y:.1}\" width=\"{wide:.1}\" height=\"{high}\" fill=\"{colour}\"/>"
    );
}

/// Returns the fluents that some step expects, or whose truth changes, in the order they come.
fn telling(steps: &[StepRecord]) -> Vec<&str> {
    let mut seen = BTreeSet::new();
    let all = steps.iter().flat_map(|step| &step.fluents).map(|fluent| fluent.name.as_str());
    let names: Vec<&str> = all.filter(|name| seen.insert(*name)).collect();
    let tells = |name: &&str| {
        let rows =
            || steps.iter().flat_map(|step| &step.fluents).filter(|fluent| fluent.name == **name);
        let truths: BTreeSet<Option<bool>> = rows().map(|fluent| fluent.measured).collect();
        truths.len() > 1 || rows().any(|fluent| fluent.expected.is_some())
    };
    names.into_iter().filter(tells).collect()
}

fn short(name: &str) -> String {
    if name.chars().count() <= LETTERS {
        return name.to_owned();
    }
    name.chars().take(LETTERS - 1).chain(['…']).collect()
}

/// Draws the water in the twin's vessels; `None` where there never is any.
fn water(film: &Film, span: &Span) -> Option<String> {
    let moments = || film.moments.iter().filter(|moment| moment.time >= span.begin);
    let last = film.moments.last()?;
    let holds = |column: &usize| film.moments.iter().any(|moment| moment.water_ml[*column] > 0.0);
    let columns: Vec<usize> = (0..last.water_ml.len()).filter(holds).collect();
    if columns.is_empty() {
        return None;
    }
    let all =
        moments().flat_map(|moment| columns.iter().map(|column| moment.water_ml[*column] * 1e-6));
    let mut plot = span.plot("water", "m^3", all)?;
    // A vessel's colour goes by its place in the table, as in the film.
    for column in &columns {
        let points =
            moments().map(|moment| (moment.time - span.begin, moment.water_ml[*column] * 1e-6));
        plot.line(points, colour(*column), "");
    }
    let name = |column: usize| (colour(column), film.vessels[column].clone());
    let names: Vec<_> = columns.into_iter().map(name).collect();
    Some(card("Water in the twin", plot, &names))
}

/// What is drawn of each joint: the drawing's title, the name of what is drawn, and its unit in SI.
#[derive(Clone, Copy)]
struct Drawing {
    title: &'static str,
    name: &'static str,
    unit: &'static str,
}

/// Draws the torques that the joints felt, and the forces of those that slide.
fn torques(arm: &Recording, span: &Span) -> Vec<String> {
    let felt = |joint: usize| arm.column(&format!("tau_{joint}"));
    let turning = Drawing { title: "Torques of the joints", name: "torque", unit: "N*m" };
    let sliding = Drawing { title: "Forces of the joints that slide", name: "force", unit: "N" };
    lines(arm, span, &felt, [turning, sliding])
}

/// Draws how far the joints were from where they were sent.
fn tracking(arm: &Recording, span: &Span) -> Vec<String> {
    let behind = |joint: usize| {
        let sent = arm.column(&format!("q_cmd_{joint}"))?;
        let is = arm.column(&format!("q_{joint}"))?;
        Some(sent.into_iter().zip(is).map(|(sent, is)| sent - is).collect())
    };
    let turning = Drawing { title: "Behind the command", name: "behind", unit: "rad" };
    let title = "Behind the command, joints that slide";
    lines(arm, span, &behind, [turning, Drawing { title, name: "behind", unit: "m" }])
}

/// Draws a line for each joint: those that turn in one drawing, those that slide in another.
fn lines(
    arm: &Recording,
    span: &Span,
    of: &dyn Fn(usize) -> Option<Vec<f64>>,
    [turning, sliding]: [Drawing; 2],
) -> Vec<String> {
    let all = (1..).map_while(|joint| Some((joint, of(joint)?)));
    let (slide, turn): (Vec<_>, Vec<_>) = all.partition(|(joint, _)| arm.slides(*joint));
    let drawn = |joints: &[(usize, Vec<f64>)], drawing: Drawing| {
        if joints.is_empty() {
            return None;
        }
        let values = joints.iter().flat_map(|(_, values)| values);
        let mut plot = span.plot(drawing.name, drawing.unit, values.copied())?;
        let mut names = Vec::new();
        for (k, (joint, values)) in joints.iter().enumerate() {
            let points = arm.times.iter().zip(values).map(|(t, value)| (t - span.begin, *value));
            plot.line(points, colour(k), "");
            names.push((colour(k), format!("joint {joint}")));
        }
        Some(card(drawing.title, plot, &names))
    };
    [drawn(&turn, turning), drawn(&slide, sliding)].into_iter().flatten().collect()
}

/// The colour of the `k`th of several.
fn colour(k: usize) -> &'static str {
    COLOURS[k % COLOURS.len()]
}

fn card(title: &str, plot: Plot, names: &[(&str, String)]) -> String {
    let mut text = format!(
        "<figure class=\"card\"><h2>{title}</h2>\n{}\n<figcaption class=\"key\">",
        plot.drawn(title)
    );
    for (colour, name) in names {
        let _ = write!(text, "<span><i style=\"background:{colour}\"></i>{}</span>", escaped(name));
    }
    text + "</figcaption></figure>\n"
}

/// Rows of `arm.csv` during the steps, at most [`MOMENTS`] of them.
struct Recording {
    names: Vec<String>,
    /// The headings of the positions of joints that slide, without units.
    sliding: BTreeSet<String>,
    times: Vec<f64>,
    rows: Vec<Vec<f64>>,
}

impl Recording {
    /// `None` when there is nothing to read.
    fn read(text: &str, span: &Span) -> Option<Self> {
        let mut lines = text.lines();
        let bare = |cell: &str| cell.split('[').next().unwrap_or_default().to_owned();
        let headings = lines.next()?;
        let names: Vec<String> = headings.split(',').map(bare).collect();
        let in_m = headings.split(',').filter_map(|cell| cell.strip_suffix("[m]"));
        let sliding = in_m.map(str::to_owned).collect();
        let during = |line: &&str| {
            let time = line.split(',').next().and_then(|cell| cell.parse::<f64>().ok());
            time.is_some_and(|time| (span.begin..=span.end).contains(&time))
        };
        let during: Vec<&str> = lines.filter(during).collect();
        let every = during.len().div_ceil(MOMENTS).max(1);
        let row = |line: &&str| {
            let row: Result<Vec<f64>, _> = line.split(',').map(str::parse).collect();
            row.ok().filter(|row| row.len() == names.len())
        };
        let rows: Vec<Vec<f64>> = during.iter().step_by(every).filter_map(row).collect();
        let times = rows.iter().map(|row| row[0]).collect();
        (!rows.is_empty()).then_some(Self { names, sliding, times, rows })
    }

    /// Whether a joint, from 1, slides.
    fn slides(&self, joint: usize) -> bool {
        self.sliding.contains(&format!("q_{joint}"))
    }

    fn column(&self, name: &str) -> Option<Vec<f64>> {
        let at = self.names.iter().position(|column| column == name)?;
        Some(self.rows.iter().map(|row| row[at]).collect())
    }
}

#[cfg(test)]
mod tests {
    use crate::workcell::film::Moment;

    use super::*;

    /// A run that only pushed a block had an empty drawing of water.
    #[test]
    fn a_run_without_water_has_no_drawing_of_it() {
        let span = Span { begin: 0.0, end: 1.0, steps: vec![(1, 0.0, 1.0)] };
        let film = |water: [f64; 2]| Film {
            vessels: vec!["cup".into(), "spilt".into()],
            moments: [0.2, 0.4]
                .map(|time| Moment { number: 1, time, step: 1, water_ml: water.to_vec() })
                .to_vec(),
        };
        assert_eq!(water(&film([0.0, 0.0]), &span), None);
        assert!(water(&film([50.0, 0.0]), &span).is_some_and(|drawn| drawn.contains("cup")));
    }

    #[test]
    fn joints_that_slide_have_drawings_of_their_own_in_mm_and_newtons() {
        let span = Span { begin: 0.0, end: 1.0, steps: vec![(1, 0.0, 1.0)] };
        let text = "t[s],q_cmd_1[rad],q_cmd_2[m],q_1[rad],q_2[m],tau_1[N*m],tau_2[N]\n\
                    0,0.1,0.2,0.1,0.2,1,20\n0.5,0.2,0.3,0.19,0.299,2,30\n";
        let arm = Recording::read(text, &span).unwrap();
        let [turning, sliding] = &tracking(&arm, &span)[..] else { panic!("two drawings") };
        assert!(turning.contains("joint 1") && !turning.contains("joint 2"), "{turning}");
        assert!(turning.contains("(deg)") && sliding.contains("(mm)"), "{sliding}");
        assert!(sliding.contains("joint 2") && sliding.contains("that slide"), "{sliding}");
        let [_, forces] = &torques(&arm, &span)[..] else { panic!("two drawings") };
        assert!(forces.contains("(N)") && forces.contains("joint 2"), "{forces}");
        // Of an arm without any there is none.
        let turns = text.replace("[m]", "[rad]").replace("tau_2[N]", "tau_2[N*m]");
        assert_eq!(tracking(&Recording::read(&turns, &span).unwrap(), &span).len(), 1);
    }
}
