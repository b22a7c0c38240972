//! The three regressions in words, as `align map | intrinsics | offset` prints them for people: what was fitted, how well, how sure that
//! is, and what to beware of. All the numbers, covariances among them, are in the commands' JSON.

use std::fmt::Write as _;

use super::calibrated;
use crate::alignment::image_map::{Compared, Grid, MapFit, Warning};
use crate::alignment::intrinsics::Calibration;
use crate::alignment::intrinsics::strays::Stray;
use crate::alignment::offset::{Known, OffsetFit};

/// Of an offset that no arm has.
pub const MIRRORED: &str = "the points said are the real ones seen in a mirror, which no arm does: are two columns exchanged, such as \
     xs and ys, or is one of the other sign?";

/// Of a form that was not chosen though it fits closer, and of how many pairs.
pub fn untested(closer: &str, n_pairs: usize) -> String {
    format!(
        "{closer} fits closer, but {n_pairs} pairs hardly test it: add a pair, or ask for it with `--model {closer}`"
    )
}

/// Words regression 1: `compared` are its forms side by side, `grid` says how far it is known over the twin's picture.
pub fn map(
    fit: &MapFit,
    compared: &[Compared],
    grid: Option<&Grid>,
    warnings: &[Warning],
) -> String {
    let mut text = format!(
        "{} map, real from twin, from {}\n",
        fit.model.name(),
        kept(fit.kept, &fit.outliers)
    );
    text.push_str(&matrix("M", fit.m.row_iter().map(|row| row.iter().copied().collect())));
    let off = |px: f64| format!("{px:.3} px");
    let worst = fit.worst;
    let _ = writeln!(
        text,
        "off by {} rms{}",
        off(fit.rms_px),
        predicted(fit.leave_one_out_px, worst, &off)
    );
    if fit.noise_px > 0.0 {
        let _ = writeln!(text, "noise {} a coordinate", off(fit.noise_px));
    }
    let known: Vec<f64> =
        grid.iter().flat_map(|grid| &grid.std_px).flatten().copied().flatten().collect();
    if !known.is_empty() {
        let (least, most) = ends(&known);
        let _ = writeln!(
            text,
            "known over the picture to {} where best, {} where worst",
            off(least),
            off(most)
        );
    }
    let each = compared
        .iter()
        .map(|c| (c.model.name(), off(c.mse_px.sqrt()), c.leave_one_out_px.map(off), c.evidence));
    text.push_str(&forms(each));
    if compared.len() > 1 && !fit.reason.is_empty() {
        let _ = writeln!(text, "{}", fit.reason);
    }
    for warning in warnings {
        let _ = writeln!(text, "beware: {warning}");
    }
    text
}

/// Words regression 2, and the points that were left out.
pub fn intrinsics(fit: &Calibration, strays: &[Stray]) -> String {
    let mut text = String::new();
    let width = fit.views.iter().map(|view| view.name.chars().count()).max().unwrap_or(0);
    for (view, residuals) in fit.views.iter().zip(&fit.residuals) {
        let (name, n, rms) = (&view.name, residuals.len(), view.rms_px);
        let _ = write!(text, "view {name:<width$}  {n} points, rms {rms:.3} px");
        let (moved, turned) = (1e3 * view.moved_m, view.turned_rad.to_degrees());
        let _ = if fit.leverage.is_some() {
            writeln!(text, ", {moved:.1} mm and {turned:.2} deg from where it was said to be")
        } else {
            writeln!(text)
        };
    }
    let n: usize = fit.residuals.iter().map(Vec::len).sum();
    let views =
        if fit.views.len() == 1 { "1 view".into() } else { format!("{} views", fit.views.len()) };
    let _ = writeln!(text, "camera from {n} points in {views}");
    for stray in strays {
        let (view, point) = (&fit.views[stray.view].name, stray.point);
        let _ = writeln!(
            text,
            "left out: point {point} of view {view}, counted from 0, off by {:.1} px",
            stray.off_px
        );
    }
    text.push_str(&calibrated::lens(fit));
    text
}

/// Words regression 3; `asked` is how far it is known at the places that were asked for.
pub fn offset(fit: &OffsetFit, n: usize, asked: &[Known]) -> String {
    let left = fit.outliers.len();
    let mut text = format!(
        "{} offset, said from real, from {}\n",
        fit.model.name(),
        kept(n - left, &fit.outliers)
    );
    text.push_str(&matrix("D", fit.d.row_iter().map(|row| row.iter().copied().collect())));
    let off = |m: f64| format!("{:.3} mm", 1e3 * m);
    let _ = writeln!(
        text,
        "off by {} rms{}",
        off(fit.rms_m),
        predicted(fit.leave_one_out_m, fit.worst, &off)
    );
    if fit.noise_m > 0.0 {
        let _ = writeln!(text, "noise {} a coordinate", off(fit.noise_m));
    }
    for known in fit.known() {
        let _ = writeln!(
            text,
            "known to {} at {:.0} mm from the points' centre{}",
            off(known.std),
            1e3 * known.from_centre,
            if known.reach > 1.0 { ", beyond all of them" } else { "" }
        );
    }
    for known in asked {
        let [x, y, z] = <[f64; 3]>::from(known.at);
        let _ = writeln!(text, "known to {} at ({x:.3}, {y:.3}, {z:.3}) m", off(known.std));
    }
    for what in &fit.unobservable {
        let _ = writeln!(text, "not told by these points: {what}");
    }
    let each = fit.compared.iter();
    text.push_str(&forms(
        each.map(|c| (c.model.name(), off(c.rms_m), c.leave_one_out_m.map(off), c.evidence)),
    ));
    if fit.is_mirrored() {
        let _ = writeln!(text, "beware: {MIRRORED}");
    }
    if let Some(closer) = fit.untested {
        let _ = writeln!(text, "beware: {}", untested(closer.name(), fit.kept));
    }
    text
}

/// How many rows it rests on, and which were left out.
fn kept(kept: usize, outliers: &[usize]) -> String {
    /// So many are named.
    const NAMED: usize = 8;
    if outliers.is_empty() {
        return format!("{kept} pairs");
    }
    let rows: Vec<String> = outliers.iter().take(NAMED).map(usize::to_string).collect();
    let more = if outliers.len() > NAMED { ", …" } else { "" };
    format!(
        "{kept} of {} pairs; left out, counted from 0: {}{more}",
        kept + outliers.len(),
        rows.join(", ")
    )
}

fn matrix(name: &str, rows: impl Iterator<Item = Vec<f64>>) -> String {
    let mut text = String::new();
    for (i, row) in rows.enumerate() {
        let _ = write!(text, "  {:<2}", if i == 0 { name } else { "" });
        for x in row {
            let _ = write!(text, " {x:>14.8}");
        }
        text.push('\n');
    }
    text
}

/// How far rows are off as predicted from the others.
fn predicted(rms: Option<f64>, worst: Option<(usize, f64)>, off: &dyn Fn(f64) -> String) -> String {
    let Some(rms) = rms else { return "; too few to predict any from the others".into() };
    let worst =
        worst.map(|(row, error)| format!(" (most: {}, row {row})", off(error))).unwrap_or_default();
    format!("; predicted from the others, {}{worst}", off(rms))
}

/// The forms side by side: name, error, error of what is predicted, evidence.
fn forms<'a>(each: impl Iterator<Item = (&'a str, String, Option<String>, f64)>) -> String {
    let each: Vec<_> = each.collect();
    if each.len() < 2 {
        return String::new();
    }
    let mut text = format!("{:<12} {:>12} {:>12} {:>12}\n", "form", "rms", "predicted", "evidence");
    for (name, rms, predicted, evidence) in each {
        let predicted = predicted.unwrap_or_else(|| "-".into());
        let _ = writeln!(text, "{name:<12} {rms:>12} {predicted:>12} {evidence:>12.1}");
    }
    text
}

fn ends(values: &[f64]) -> (f64, f64) {
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    (least, values.iter().copied().fold(0.0, f64::max))
}
