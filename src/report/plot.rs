//! One plot as SVG: axes with units and ticks, lines, dots, bands. What is drawn, and what it means, is its caller's.
//!
//! All plots are as wide as a telephone's screen, so that their words can be read there; a page lays several side by side.

use std::fmt::Write as _;

use crate::discovery::COUNT;
use crate::units::significant;

use super::html::escaped;

/// Size of a plot, px.
const WIDTH: f64 = 440.0;
const HEIGHT: f64 = 236.0;
/// Room for the words beside the axes, px.
const LEFT: f64 = 58.0;
const BOTTOM: f64 = 38.0;
const TOP: f64 = 10.0;
const RIGHT: f64 = 10.0;

/// Dots up to this size hide what is behind them, px.
const SOLID: f64 = 2.0;

/// Ticks of an axis, about.
const TICKS: f64 = 5.0;

/// What every page with plots needs beside its look.
pub const STYLE: &str = "\
.plots{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,26rem),1fr));gap:1rem;margin:1rem 0}\
.plots .card{margin:0;min-width:0;overflow-wrap:anywhere}\
svg.plot{display:block;width:100%;height:auto;font:13px system-ui,sans-serif}\
svg.plot text{fill:var(--ink)}svg.plot .grid{stroke:var(--line);stroke-width:.7}\
:root{--fitted:#1f6fb0;--heldout:#b35c00;--before:#a3201a;--law:#1b1f24;--held:#f4ead8}\
@media(prefers-color-scheme:dark){:root{--fitted:#7cb8f2;--heldout:#f0a860;--before:#ff9d93;--law:#ffffff;--held:#33291a}}";

/// An axis: what it is, and from where to where it goes, in the unit that is written.
#[derive(Debug, Clone)]
pub struct Axis {
    name: String,
    from: f64,
    to: f64,
    /// Written numbers are this many times those in SI.
    factor: f64,
    /// Whether only whole numbers are written.
    is_count: bool,
}

/// Returns a unit as a plot writes it, and how many of it are one in SI.
fn written(unit: &str) -> (String, f64) {
    match unit {
        "rad" => ("deg".into(), 180.0 / std::f64::consts::PI),
        "m" => ("mm".into(), 1e3),
        "kg" => ("g".into(), 1e3),
        "kg/s" => ("g/s".into(), 1e3),
        "m^3" => ("mL".into(), 1e6),
        COUNT => (String::new(), 1.0),
        unit => (unit.replace('*', "·").replace("^2", "²").replace("^3", "³"), 1.0),
    }
}

impl Axis {
    /// Returns the axis on which all values lie, in SI; `None` where there is none. A little room is left around them.
    pub fn over(name: &str, unit: &str, values: impl Iterator<Item = f64>) -> Option<Self> {
        let (low, high) = values
            .filter(|value| value.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value), high.max(value))
            });
        let is_count = unit == COUNT;
        let (unit, factor) = written(unit);
        let name = if unit.is_empty() { name.to_owned() } else { format!("{name} ({unit})") };
        let room = match high > low {
            _ if is_count => 0.5,
            true => 0.04 * (high - low),
            false => low.abs().max(1e-9),
        };
        (low <= high).then_some(Self {
            name,
            from: factor * (low - room),
            to: factor * (high + room),
            factor,
            is_count,
        })
    }

    /// The same for sizes to both sides of nothing.
    pub fn around(name: &str, unit: &str, values: impl Iterator<Item = f64>) -> Option<Self> {
        Self::over(name, unit, values.chain(std::iter::once(0.0)))
    }

    /// Returns where along the axis a value in SI lies, from 0 to 1.
    fn at(&self, value: f64) -> f64 {
        (self.factor * value - self.from) / (self.to - self.from)
    }

    /// Returns round numbers within, as they are written, and their values in SI.
    fn ticks(&self) -> Vec<(String, f64)> {
        let rough = (self.to - self.from) / TICKS;
        let power = 10_f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|by| by * power);
        let step = step.into_iter().find(|step| *step >= rough).unwrap_or(10.0 * power);
        let step = if self.is_count { step.max(1.0) } else { step };
        let first = (self.from / step).ceil() as i64;
        let last = (self.to / step).floor() as i64;
        let word = |k: i64| {
            let value = k as f64 * step;
            let text = significant(value, 3);
            (if k == 0 { "0".to_owned() } else { text }, value / self.factor)
        };
        (first..=last).map(word).collect()
    }
}

/// A plot that is being drawn.
#[derive(Debug)]
pub struct Plot {
    x: Axis,
    y: Axis,
    inside: String,
}

impl Plot {
    /// Begins a plot.
    pub fn new(x: Axis, y: Axis) -> Self {
        Self { x, y, inside: String::new() }
    }

    fn x(&self, value: f64) -> f64 {
        LEFT + self.x.at(value) * (WIDTH - LEFT - RIGHT)
    }

    fn y(&self, value: f64) -> f64 {
        HEIGHT - BOTTOM - self.y.at(value) * (HEIGHT - BOTTOM - TOP)
    }

    /// Shades a stretch of the first axis.
    pub fn shade(&mut self, from: f64, to: f64, colour: &str) {
        let (left, right) = (self.x(from), self.x(to));
        let _ = write!(
            self.inside,
            "<rect x=\"{left:.1}\" y=\"{TOP}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{colour}\"/>",
            (right - left).max(0.5),
            HEIGHT - BOTTOM - TOP
        );
    }

    /// Lays a column over a stretch of the first axis that a page can light: that of a step by its number.
    pub fn column(&mut self, from: f64, to: f64, step: usize) {
        let (left, right) = (self.x(from), self.x(to));
        let _ = write!(
            self.inside,
            "<rect data-step=\"{step}\" x=\"{left:.1}\" y=\"{TOP}\" width=\"{:.1}\" height=\"{:.1}\"/>",
            (right - left).max(1.0),
            HEIGHT - BOTTOM - TOP
        );
    }

    /// Fills between two curves, point by point: first axis, below, above.
    pub fn band(&mut self, points: &[(f64, f64, f64)], colour: &str) {
        let mut outline = String::new();
        for (x, _, above) in points {
            let _ = write!(outline, "{:.1},{:.1} ", self.x(*x), self.y(*above));
        }
        for (x, below, _) in points.iter().rev() {
            let _ = write!(outline, "{:.1},{:.1} ", self.x(*x), self.y(*below));
        }
        let _ =
            write!(self.inside, "<polygon points=\"{}\" fill=\"{colour}\"/>", outline.trim_end());
    }

    /// Draws a line through points; `dash` as SVG writes it, empty for a whole line.
    pub fn line(&mut self, points: impl Iterator<Item = (f64, f64)>, colour: &str, dash: &str) {
        let mut path = String::new();
        for (x, y) in points {
            let _ = write!(path, "{:.1},{:.1} ", self.x(x), self.y(y));
        }
        let dash =
            if dash.is_empty() { String::new() } else { format!(" stroke-dasharray=\"{dash}\"") };
        let _ = write!(
            self.inside,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.2\"{dash}/>",
            path.trim_end()
        );
    }

    /// Draws a broad line through points.
    pub fn curve(&mut self, points: impl Iterator<Item = (f64, f64)>, colour: &str) {
        let mut path = String::new();
        for (x, y) in points {
            let _ = write!(path, "{:.1},{:.1} ", self.x(x), self.y(y));
        }
        let _ = write!(
            self.inside,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\" stroke-linejoin=\"round\"/>",
            path.trim_end()
        );
    }

    /// Draws an upright bar through each point: first axis, from, to.
    pub fn bars(&mut self, points: impl Iterator<Item = (f64, f64, f64)>, colour: &str) {
        let mut path = String::new();
        for (x, from, to) in points {
            let (x, from, to) = (self.x(x), self.y(from), self.y(to));
            let _ = write!(
                path,
                "M{x:.1} {from:.1}V{to:.1}M{:.1} {from:.1}h6M{:.1} {to:.1}h6",
                x - 3.0,
                x - 3.0
            );
        }
        let _ = write!(
            self.inside,
            "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.2\"/>"
        );
    }

    /// Draws dots, round or square; the larger ones can be seen through.
    pub fn dots(
        &mut self,
        points: impl Iterator<Item = (f64, f64)>,
        (colour, size): (&str, f64),
        is_round: bool,
    ) {
        let mut path = String::new();
        let wide = if is_round { 0.0 } else { size };
        for (x, y) in points {
            let _ = write!(path, "M{:.1} {:.1}h{wide}", self.x(x) - wide / 2.0, self.y(y));
        }
        let cap = if is_round { "round" } else { "butt" };
        let opacity = if size > SOLID { 0.5 } else { 1.0 };
        let _ = write!(
            self.inside,
            "<path d=\"{path}\" stroke=\"{colour}\" stroke-width=\"{size}\" stroke-linecap=\"{cap}\" \
             stroke-opacity=\"{opacity}\"/>"
        );
    }

    /// Returns the drawing; `says` is what it shows, for who does not see it.
    pub fn drawn(self, says: &str) -> String {
        let mut text = format!(
            "<svg class=\"plot\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{}\">",
            escaped(says)
        );
        let mut marks = String::new();
        let (bottom, right) = (HEIGHT - BOTTOM, WIDTH - RIGHT);
        for (word, value) in self.x.ticks() {
            let x = self.x(value);
            let _ = write!(
                marks,
                "<path class=\"grid\" d=\"M{x:.1} {TOP}V{bottom}\"/>\
                 <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{word}</text>",
                bottom + 14.0
            );
        }
        for (word, value) in self.y.ticks() {
            let y = self.y(value);
            let _ = write!(
                marks,
                "<path class=\"grid\" d=\"M{LEFT} {y:.1}H{right}\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{word}</text>",
                LEFT - 5.0,
                y + 4.0
            );
        }
        let middle = f64::midpoint(TOP, bottom);
        let _ = write!(
            text,
            "{}{marks}<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\
             <text transform=\"translate(12 {middle:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text></svg>",
            self.inside,
            f64::midpoint(LEFT, right),
            HEIGHT - 6.0,
            escaped(&self.x.name),
            escaped(&self.y.name)
        );
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_numbers_in_the_unit_that_is_written() {
        let axis = Axis::over("q_1", "rad", [0.0, std::f64::consts::PI].into_iter()).unwrap();
        let ticks = axis.ticks();
        let words: Vec<&str> = ticks.iter().map(|(word, _)| word.as_str()).collect();
        assert_eq!(words, ["0", "50", "100", "150"]);
        assert!((ticks[1].1 - 50_f64.to_radians()).abs() < 1e-12);
        let still = Axis::over("q_1", "rad", [0.3].into_iter()).unwrap();
        assert!(!still.ticks().is_empty(), "one value has an axis as well");
        assert!(Axis::over("q_1", "rad", std::iter::empty()).is_none());
    }
}
