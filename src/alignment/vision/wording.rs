//! What a sighting says in words: why a thing is not found, or why its place is in doubt.
//!
//! Places on the table, lengths and shares come in m and as fractions, and are told in cm, mm and %.

use crate::alignment::doubt::Meaning;
use crate::alignment::placement::Candidate;

/// A turn that is less sure than this is not seen, rad: 20 deg. Chosen: fingers still close on a box that is turned by less.
const UNSEEN: f64 = 20.0 * std::f64::consts::PI / 180.0;

/// A place on the table, as those of what was found are told.
fn place(x: f64, y: f64) -> String {
    format!("({:.1}, {:.1}) cm", 100.0 * x, 100.0 * y)
}

/// How a thing is turned, and that it is not seen where it may be turned otherwise as well.
pub(super) fn turned(yaw: f64, std: f64) -> String {
    if std > UNSEEN {
        let [yaw, std] = [yaw, std].map(f64::to_degrees);
        return format!("its turn is not seen ({yaw:.0} ± {std:.0} deg)");
    }
    format!("turned {:.1} deg", yaw.to_degrees())
}

/// No place was worth a second look; the nearest, if there was any.
pub(super) fn nothing_like_it(nearest: Option<&Candidate>) -> String {
    nearest.map_or_else(
        || "nothing in the picture looks like it".into(),
        |c| {
            format!(
                "nothing in the picture looks like it: the best place, {}, scores {:.2}",
                place(c.x, c.y),
                c.score.total
            )
        },
    )
}

/// All that looks like it is another thing, or the arm.
pub(super) fn is_something_else(at: &Candidate) -> String {
    format!(
        "what looks most like it, at {}, is another thing that stands there, or the arm; \
         clear the view, or what hides it",
        place(at.x, at.y)
    )
}

/// What is said of a picture in which there is no colour.
pub const NO_COLOUR: &str = "the picture has no colour: things of one form are not told apart, and what no scene declares is not noticed";

/// It differs from these by its colour alone, and the picture has none.
pub(super) fn only_colour_tells(others: &[&str]) -> String {
    let others: Vec<String> = others.iter().map(|name| format!("`{name}`")).collect();
    format!(
        "it differs from {} by colour alone, and the picture has no colour; take it in colour, or clear the table of what it \
         may be mistaken for",
        others.join(" and ")
    )
}

/// A rival is as good.
pub(super) fn two_places(best: &Candidate, rival: &Candidate) -> String {
    format!(
        "two places fit almost equally: {} and {}; clear the table or tell where to look",
        place(best.x, best.y),
        place(rival.x, rival.y)
    )
}

/// A part of the outline has no edge.
pub(super) fn weak_part(at: &Candidate) -> String {
    format!(
        "at {} a part of its outline has hardly an edge in the picture: {:.0} %; \
         check its size and the table's place in the scene",
        place(at.x, at.y),
        100.0 * at.score.weakest
    )
}

/// Too little of the outline is in view.
pub(super) fn hardly_in_view(at: &Candidate) -> String {
    format!(
        "at {} only {:.0} % of its outline is in view, and it has no colour of its own; \
         move it, or what hides it",
        place(at.x, at.y),
        100.0 * at.score.visible
    )
}

/// Whole edges of the outline have none in the picture: their share of it.
pub(super) fn missing_edges(at: &Candidate, share: f64) -> String {
    format!(
        "at {} {:.0} % of its outline, whole edges, are not in the picture; \
         check its height and size in the scene",
        place(at.x, at.y),
        100.0 * share
    )
}

/// The table is not where it is said to be; how far off the place may be, m.
pub(super) fn table_is_elsewhere(meaning: &Meaning, off: f64) -> String {
    let far = 1e3 * off;
    format!(
        "by the edges of what stands on it the table is {:.0} mm {} than the scene and the camera's \
         pose say, and tilted by {:.1} deg, so this place may be {far:.0} mm off; \
         calibrate the camera, or check sizes in the scene",
        1e3 * meaning.lift.abs(),
        if meaning.lift > 0.0 { "higher" } else { "lower" },
        meaning.tilt.to_degrees(),
    )
}

/// The thing has not the size it is said to have; how far off the place may be, m.
pub(super) fn size_is_other(meaning: &Meaning, off: f64) -> String {
    let far = 1e3 * off;
    let [whole, height] = meaning.larger.map(|l| 100.0 * l);
    format!(
        "by its edges it is {:.0} % {} and {:.0} % {} than said, so its place may be {far:.0} mm off; \
         check its size in the scene",
        whole.abs(),
        if whole > 0.0 { "wider" } else { "narrower" },
        (whole + height).abs(),
        if whole + height > 0.0 { "taller" } else { "lower" },
    )
}

/// The thing is nearer than it would be on the table; where it would then stand.
pub(super) fn stands_higher(meaning: &Meaning, [x, y]: [f64; 2]) -> String {
    format!(
        "it looks {:.0} % larger than it would on the table: it stands about {:.0} mm higher, on something, at about {}; \
         say in the scene what it stands on, or check its size there",
        100.0 * meaning.larger[0].abs(),
        1e3 * meaning.height,
        place(x, y)
    )
}

/// The thing was found on another, so high above the table, m.
pub(super) fn stands_upon(carrier: &str, height: f64) -> String {
    format!(
        "it looks larger than it would on the table: it stands {:.0} mm higher, on `{carrier}`",
        1e3 * height
    )
}

/// The best place is beside the table.
pub(super) fn off_the_table(at: &Candidate) -> String {
    format!("the best place, {}, is not on the table", place(at.x, at.y))
}

/// The picture's own cut is not the silhouette: their overlap.
pub(super) fn cut_differs(at: &Candidate, overlap: Option<f64>) -> String {
    overlap.map_or_else(
        || format!("at {} nothing stands out from its surroundings", place(at.x, at.y)),
        |overlap| {
            format!(
                "what stands out at {} has another outline: the two overlap by {:.0} %; \
                 check its shape and size in the scene",
                place(at.x, at.y),
                100.0 * overlap
            )
        },
    )
}

/// Other places look as much like it: how far the best is ahead, as a score.
pub(super) fn common_look(at: &Candidate, ahead: f64) -> String {
    format!(
        "at {} it looks hardly more like it than other things in the picture do: \
         ahead by {ahead:.2}; clear the table or tell where to look",
        place(at.x, at.y)
    )
}

/// Another place fits nearly as well: by how much less, as a share; none or less where it fits better.
pub(super) fn another_place(at: &Candidate, behind: f64) -> String {
    let better = if behind > 0.0 {
        format!("only {:.0} % better than", 100.0 * behind)
    } else {
        "no better than".to_owned()
    };
    format!(
        "at {} it fits {better} at another place; clear the table or tell where to look",
        place(at.x, at.y)
    )
}

/// Another solid fits there better.
pub(super) fn other_solid(at: &Candidate) -> String {
    format!(
        "at {} a solid of another size or kind fits as well; check its shape in the scene",
        place(at.x, at.y)
    )
}

/// A drawer whose case was not found.
pub(super) fn no_case(case: &str) -> String {
    format!("`{case}`, in which it slides, was not found")
}

/// A drawer whose colour is seen nowhere along its rail.
pub(super) fn no_front(tray: &str) -> String {
    format!(
        "nothing in the colour of `{tray}` is seen before a side of its case; clear the view, or check its colour"
    )
}

/// The contour has no key points.
pub(super) fn no_key_points(at: &Candidate) -> String {
    format!(
        "at {} its contour does not show its corners or its rim; clear the view, or check its shape in the scene",
        place(at.x, at.y)
    )
}

/// Outline and key points differ: by how much, m.
pub(super) fn two_ways_differ(apart: f64) -> String {
    format!(
        "its contour's key points put it {:.0} mm from where its outline fits best; \
         clear the view, or check its size in the scene",
        1e3 * apart
    )
}

/// What else is on the table does not look right; how far off this place may be, m.
pub(super) fn others_look_wrong(off: f64) -> String {
    format!(
        "something on the table does not look as the scene says; if the table or the camera is not \
         where it is said to be, this place is {:.0} mm off",
        1e3 * off
    )
}

/// The best place does not convince: shares of its outline with an edge, in all and at the weakest part.
pub(super) fn not_convincing([x, y]: [f64; 2], edge: f64, weakest: f64) -> String {
    format!(
        "the best place, {}, is not convincing: {:.0} % of the outline has an edge, \
         the weakest part {:.0} %",
        place(x, y),
        100.0 * edge,
        100.0 * weakest
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// "At (0.781, -0.004) m … believed to stand at (65.5, 8.8) cm", in one line.
    #[test]
    fn places_are_told_in_the_unit_of_those_that_were_found() {
        assert!(not_convincing([0.781, -0.004], 0.5, 0.3).contains("(78.1, -0.4) cm"));
    }
}
