//! A camera's calibration in words, every number with its unit and standard deviation, and as a drawing.

use std::fmt::{self, Write as _};

use crate::alignment::boards::NotFound;
use crate::alignment::intrinsics::coverage::Coverage;
use crate::alignment::intrinsics::lens::Compared;
use crate::alignment::intrinsics::strays::Stray;
use crate::alignment::intrinsics::{Calibration, View};
use crate::units::significant;
use crate::world::LensModel;

use super::html::escaped;

/// A picture that was looked at for a board.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Its file.
    pub name: String,
    /// What was seen.
    pub seen: Seen,
}

/// What was seen of the board in a picture.
#[derive(Debug, Clone, PartialEq)]
pub enum Seen {
    /// All of it; which of the calibration's views.
    Board(usize),
    /// Not the board.
    NotFound(NotFound),
    /// Width and height, px, are not those of the pictures before.
    OtherSize((u32, u32)),
    /// The board is where it is in this picture before, to the last digit: it is the same picture.
    SameAs(String),
    /// It cannot be read.
    Unreadable(String),
}

impl Picture {
    /// Returns why it is not used, `None` if it is.
    pub fn why_not(&self) -> Option<String> {
        match &self.seen {
            Seen::Board(_) => None,
            Seen::NotFound(why) => Some(why.to_string()),
            Seen::OtherSize((w, h)) => {
                Some(format!("{w} x {h} px, unlike the pictures before: one camera at one setting"))
            }
            Seen::SameAs(other) => {
                Some(format!("the same picture as {other}, so it says nothing more"))
            }
            Seen::Unreadable(why) => Some(why.clone()),
        }
    }
}

impl fmt::Display for Picture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let why = self.why_not();
        write!(f, "{}: {}", self.name, why.as_deref().unwrap_or("found"))
    }
}

/// Words a calibration from pictures.
pub fn text(
    fit: &Calibration,
    coverage: &Coverage,
    compared: &[Compared],
    pictures: &[Picture],
    strays: &[Stray],
) -> String {
    let mut text = String::new();
    let width = pictures.iter().map(|p| p.name.chars().count()).max().unwrap_or(0);
    for picture in pictures {
        let name = &picture.name;
        let _ = if let Seen::Board(view) = picture.seen {
            let (rms, n) = (fit.views[view].rms_px, fit.residuals[view].len());
            let tilt = coverage.held[view].tilt.to_degrees();
            let far: Vec<f64> =
                strays.iter().filter(|s| s.view == view).map(|s| s.off_px).collect();
            let left_out = if far.is_empty() {
                String::new()
            } else {
                let most = far.iter().copied().fold(0.0, f64::max);
                format!(", {} left out (off by up to {most:.1} px)", far.len())
            };
            writeln!(
                text,
                "{name:<width$}  {n} corners, rms {} px, tilted {tilt:.0} deg{left_out}",
                small(rms)
            )
        } else {
            let why = picture.why_not().unwrap_or_default();
            writeln!(text, "{name:<width$}  not used: {why}")
        };
    }
    let k = &fit.intrinsics;
    let n: usize = fit.residuals.iter().map(Vec::len).sum();
    let _ = writeln!(
        text,
        "camera from {} of {} pictures of {} x {} px, {n} corners",
        fit.views.len(),
        pictures.len(),
        k.width,
        k.height
    );
    text.push_str(&lens(fit));
    if !compared.is_empty() {
        let each: Vec<String> =
            compared.iter().map(|c| format!("{} {:.4}", c.distortion.name(), c.rms_px)).collect();
        let _ = writeln!(text, "lens terms by BIC; rms of each choice, px: {}", each.join(", "));
    }
    for advice in coverage.advice(fit) {
        let _ = writeln!(text, "next: {advice}");
    }
    text
}

/// A number of px with two decimals, and of less than 0.1 px with two digits: boards that are drawn fit to 0.005 px.
fn small(px: f64) -> String {
    if px < 0.1 { significant(px, 2) } else { format!("{px:.2}") }
}

/// Words what is inside a camera, each number with its standard deviation, and how well it explains the corners.
pub(super) fn lens(fit: &Calibration) -> String {
    let (mut text, k) = (String::new(), &fit.intrinsics);
    let lengths = [("fx", k.fx), ("fy", k.fy), ("cx", k.cx), ("cy", k.cy), ("skew", k.skew)];
    let terms =
        [("k1", k.k1), ("k2", k.k2), ("p1", k.p1), ("p2", k.p2), ("k3", k.k3), ("k4", k.k4)];
    let is_fisheye = k.model == LensModel::Fisheye;
    if is_fisheye {
        let _ = writeln!(text, "  a fisheye: k1 to k4 bend the angle from the axis");
    }
    // Terms that a lens does not have are not those that were not fitted.
    let foreign: &[&str] = if is_fisheye { &["p1", "p2"] } else { &["k4"] };
    for (i, (name, value)) in lengths.into_iter().chain(terms).enumerate() {
        if foreign.contains(&name) {
            continue;
        }
        let std = fit.std[i];
        let _ = match (i < lengths.len(), std > 0.0) {
            (true, true) => writeln!(text, "  {name:<4} {value:>10.3} px ± {std:.3} px"),
            (true, false) => writeln!(text, "  {name:<4} {value:>10.3} px (not fitted)"),
            (false, true) => writeln!(text, "  {name:<4} {value:>10.5} ± {std:.5}"),
            (false, false) => writeln!(text, "  {name:<4} {value:>10} (not fitted)"),
        };
    }
    let _ = writeln!(
        text,
        "rms {:.4} px a corner; noise {:.3} px a coordinate",
        fit.rms_px, fit.noise_px
    );
    text
}

/// Colours that stay apart for the colour-blind (Okabe and Ito), one a view in turn.
const COLOURS: [&str; 6] = ["#e69f00", "#56b4e9", "#009e73", "#cc79a7", "#d55e00", "#0072b2"];
/// The median residual is drawn as long as this part of the picture's width. Chosen: seen, and shorter than the
/// distance of corners.
const ARROW: f64 = 0.01;

/// Draws the corners of all views over the picture's frame, with their residuals enlarged, as SVG.
pub fn drawing(fit: &Calibration, views: &[View]) -> String {
    let (w, h) = (fit.intrinsics.width, fit.intrinsics.height);
    let mut lengths: Vec<f64> =
        fit.residuals.iter().flatten().map(nalgebra::Matrix::norm).collect();
    lengths.sort_by(f64::total_cmp);
    let median = lengths.get(lengths.len() / 2).copied().unwrap_or(0.0);
    let times = if median > 0.0 { (ARROW * f64::from(w) / median).max(1.0).round() } else { 1.0 };
    let stroke = f64::from(w) / 640.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"-1 -1 {} {}\" font-family=\"sans-serif\">\n\
         <rect x=\"-0.5\" y=\"-0.5\" width=\"{w}\" height=\"{h}\" fill=\"#fff\" stroke=\"#333\" stroke-width=\"{stroke}\"/>\n",
        w + 1,
        f64::from(h) + 18.0 * stroke
    );
    for i in 1..3 {
        let (x, y) = (f64::from(w * i) / 3.0 - 0.5, f64::from(h * i) / 3.0 - 0.5);
        let _ = writeln!(
            svg,
            "<path d=\"M{x:.1} 0V{h}M0 {y:.1}H{w}\" stroke=\"#ccc\" stroke-width=\"{stroke}\"/>"
        );
    }
    for (i, (view, residuals)) in views.iter().zip(&fit.residuals).enumerate() {
        let colour = COLOURS[i % COLOURS.len()];
        let _ = writeln!(
            svg,
            "<g fill=\"{colour}\" stroke=\"{colour}\" stroke-width=\"{stroke}\"><title>{}</title>",
            escaped(&view.name)
        );
        for ((_, pixel), residual) in view.points.iter().zip(residuals) {
            let (u, v) = (pixel.u, pixel.v);
            let (to_u, to_v) = (u + times * residual.x, v + times * residual.y);
            let _ = writeln!(
                svg,
                "<circle cx=\"{u:.2}\" cy=\"{v:.2}\" r=\"{:.2}\"/><path d=\"M{u:.2} {v:.2}L{to_u:.2} {to_v:.2}\"/>",
                1.5 * stroke
            );
        }
        svg.push_str("</g>\n");
    }
    let _ = writeln!(
        svg,
        "<text x=\"0\" y=\"{:.1}\" font-size=\"{:.1}\">{} pictures, {} corners; lines: residuals {times:.0} times enlarged, \
         rms {:.3} px</text>\n</svg>",
        f64::from(h) + 13.0 * stroke,
        11.0 * stroke,
        views.len(),
        lengths.len(),
        fit.rms_px
    );
    svg
}
