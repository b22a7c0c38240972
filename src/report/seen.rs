//! What a picture shows, in words: a thing with its place and how probable it is, or why it is not found and where it
//! would be; and what was cut out of a picture.

use std::fmt::Write as _;
use std::mem::discriminant;

use crate::alignment::key_points::Refused;
use crate::alignment::measure::{Measured, Unmeasured};
use crate::alignment::segment::{By, Segment};
use crate::alignment::vision::{MaskIs, Sighting};
use crate::world::Shape;

/// Words one thing: where it stands and how probable that is; or why it is not found, and the likeliest place.
pub fn sighting(seen: &Sighting) -> String {
    if let Some(pose) = seen.world_from_object {
        let at = pose.origin();
        let mut text = format!(
            "{:<8} at ({:.1}, {:.1}) mm, {}, ± {:.1} mm, probability {:.2}",
            seen.name,
            at.x * 1e3,
            at.y * 1e3,
            seen.turned(&pose),
            seen.std * 1e3,
            seen.confidence
        );
        if let Some(ambiguous) = &seen.ambiguous {
            let _ = write!(text, "\n{:<8} but {ambiguous}", "");
        }
        return text;
    }
    let mut text = format!(
        "{:<8} not found: {}",
        seen.name,
        seen.reason.as_deref().unwrap_or("nothing in the picture looks like it")
    );
    if let Some(pose) = seen.likeliest {
        let at = pose.origin();
        let _ = write!(
            text,
            "\n{:<8} likeliest place ({:.1}, {:.1}) mm, probability {:.2}, ± {:.1} mm if it is there",
            "",
            at.x * 1e3,
            at.y * 1e3,
            seen.confidence,
            seen.std_if_there * 1e3
        );
    }
    text
}

/// Words what was cut out of a picture, and where the masks were written; `is_asked` when somebody said where to look.
pub fn segments(cuts: &[Segment], masks: &[String], is_asked: bool) -> String {
    if cuts.is_empty() {
        return if is_asked {
            "nothing separates from its surroundings there; try a larger box, or a point in its middle".into()
        } else {
            "nothing stands out; say where to look with --box or --point".into()
        };
    }
    let lines = cuts.iter().enumerate().map(|(k, cut)| {
        let ([u0, v0, u1, v1], area) = cut.extent();
        let is_smooth = if cut.is_smooth { "smooth" } else { "not smooth" };
        let mask = masks.get(k).map_or_else(String::new, |path| format!("; {path}"));
        let by = match cut.by {
            By::Ours => String::new(),
            By::Other { score } => format!(", from --masks with score {score:.2}"),
        };
        format!(
            "{:>2}  box ({u0:.0}, {v0:.0}) to ({u1:.0}, {v1:.0}) px, {area} px, contour of {} points, {is_smooth}, agreement \
             {:.2}{by}{mask}",
            k + 1,
            cut.contour.len(),
            cut.agreement
        )
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// Words what came of asking somebody else for masks: `came` masks, the best of which agrees so much with the picture's edges.
pub fn others_masks(from: &str, came: usize, agreement: Option<f64>, is_taken: bool) -> String {
    let best = match agreement {
        Some(agreement) => format!(", the best with agreement {agreement:.2}"),
        None => String::new(),
    };
    let taken = match (came, is_taken) {
        (0, _) => "",
        (_, true) => "; used where it is the better one",
        (_, false) => "; ours is better",
    };
    format!("masks of {from}: {came}{best}{taken}")
}

/// Words whose mask a thing's contour and its mask are, where somebody else was asked.
pub fn whose_mask(seen: &Sighting, from: &str) -> String {
    let whose = |is_theirs: bool| if is_theirs { from } else { "our own cut" };
    let contour = whose(seen.checks.is_others);
    let mask = match seen.mask_is {
        MaskIs::Silhouette => "the placed solid's outline",
        MaskIs::OwnCut => whose(false),
        MaskIs::Offered => whose(true),
    };
    format!("{:<8} contour from {contour}; mask: {mask}", "")
}

/// So many things that were not measured for one reason are told one by one.
const HANDFUL: usize = 5;
/// So many more are hardly things: nobody puts as many on a table.
const PATTERN: usize = 20;

/// Where something stands, m on the table, and why it was not measured.
type Missed = ([f64; 2], Unmeasured);

/// Words what was not measured, what is most like a thing first, and of one reason a handful.
fn unmeasured(missed: &[Missed]) -> Vec<String> {
    let mut left: Vec<&Missed> = missed.iter().collect();
    left.sort_by_key(|(_, why)| unlike_a_thing(why));
    let mut lines = Vec::new();
    while let Some(first) = left.first() {
        let why = first.1;
        let (same, others): (Vec<&Missed>, Vec<&Missed>) =
            left.iter().copied().partition(|one| is_same(&why, &one.1));
        for ([x, y], why) in same.iter().take(HANDFUL).copied() {
            lines.push(format!(
                "not measured: what stands at about ({:.0}, {:.0}) mm: {why}",
                x * 1e3,
                y * 1e3
            ));
        }
        let more = same.len().saturating_sub(HANDFUL);
        if more > 0 {
            let cloth = if more >= PATTERN { ": the cloth seems to be patterned" } else { "" };
            lines.push(format!("not measured: {more} more for the same reason{cloth}"));
        }
        left = others;
    }
    lines
}

/// Whether two things were not measured for one reason, whatever its numbers.
fn is_same(a: &Unmeasured, b: &Unmeasured) -> bool {
    let is_same_outline = match (a, b) {
        (Unmeasured::Outline(a), Unmeasured::Outline(b)) => discriminant(a) == discriminant(b),
        _ => true,
    };
    is_same_outline && discriminant(a) == discriminant(b)
}

/// How little speaks for a thing, of any number: what has sides and lacks a view first, what is flat last.
fn unlike_a_thing(why: &Unmeasured) -> u8 {
    match why {
        Unmeasured::Undetermined(_) => 0,
        Unmeasured::Stretch(_) => 1,
        Unmeasured::Misfit(_) => 2,
        Unmeasured::Outline(Refused::Ragged(_) | Refused::Empty) => 4,
        Unmeasured::Outline(_) => 3,
        Unmeasured::Uncut => 5,
        Unmeasured::Flat => 6,
    }
}

/// Words what a photograph showed for a scene: what stays as declared, what was measured, what could not be.
pub fn measured(
    seen: &[Sighting],
    things: &[(&str, &Measured)],
    missed: &[([f64; 2], Unmeasured)],
) -> String {
    let mut lines: Vec<String> = seen.iter().map(sighting).collect();
    for (name, thing) in things {
        let size = match &thing.shape {
            Shape::Cuboid { size } => {
                let [x, y, z] = [size.x, size.y, size.z].map(|side| side * 1e3);
                format!("box {x:.0} x {y:.0} x {z:.0} mm")
            }
            // Only boxes and cans are measured.
            round => {
                let [radius, high] = [round.outer_radius(), round.height()].map(|side| side * 1e3);
                format!("can of {radius:.0} mm radius, {high:.0} mm high")
            }
        };
        let at = thing.world_from_object.origin() * 1e3;
        let worst = thing.size_std.iter().fold(0.0_f64, |worst, std| worst.max(*std));
        lines.push(format!(
            "{name:<8} measured: {size} (± {:.1} mm) at ({:.1}, {:.1}) mm (± {:.1} mm), outline off by {:.1} px",
            worst * 1e3,
            at.x,
            at.y,
            thing.std * 1e3,
            thing.rms_px
        ));
    }
    lines.extend(unmeasured(missed));
    if lines.is_empty() {
        lines.push("nothing stands on the table that differs from it in colour".into());
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::alignment::contour::Smoothness;

    /// A flowered cloth was answered with a hundred lines, the box among them.
    #[test]
    fn what_is_refused_for_one_reason_is_told_a_handful_of_times() {
        let print = Smoothness { turning: 2.8, hull_ratio: 1.2, solidity: 0.7 };
        let print = Unmeasured::Outline(Refused::Ragged(print));
        let mut missed: Vec<_> = (0..31).map(|i| ([0.01 * f64::from(i), 0.0], print)).collect();
        missed.push(([0.6, 0.1], Unmeasured::Misfit(2.0)));
        missed.push(([0.7, 0.1], Unmeasured::Misfit(3.0)));
        let said = measured(&[], &[], &missed);
        let lines: Vec<&str> = said.lines().collect();
        assert_eq!(lines.len(), 2 + HANDFUL + 1, "{said}");
        assert!(lines[0].contains("(600, 100) mm") && lines[1].contains("(700, 100) mm"), "{said}");
        assert!(lines[7].contains("26 more for the same reason: the cloth"), "{said}");
        // Numbers that no operator knows are left out.
        assert!(!said.contains("solidity"), "{said}");
        assert!(!measured(&[], &[], &missed[..7]).contains("cloth"), "{said}");
    }
}
