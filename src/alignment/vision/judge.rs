//! The referee: two ways to a pose, the checks between them, and how sure that leaves one.

use image::{GrayImage, Luma};
use nalgebra::Vector2;

use super::{Checks, FOUND, Sighting, Way, belief};
use crate::alignment::contour::Smoothness;
use crate::alignment::doubt::{Doubt, TableDoubt};
use crate::alignment::key_points::{self, Placed};
use crate::alignment::outline::{Outline, Projector};
use crate::alignment::picture::Picture;
use crate::alignment::placement::{Candidate, Evidence, Score};
use crate::alignment::segment::{BORDERS, Expect, cut};
use crate::world::{Material, Object, Table};

/// Returns a sighting that says nothing was seen.
fn unseen(name: &str) -> Sighting {
    Sighting {
        name: name.to_owned(),
        found: false,
        reason: None,
        ambiguous: None,
        world_from_object: None,
        std: 0.0,
        yaw_std: 0.0,
        confidence: 0.0,
        score: Score::default(),
        gap: 0.0,
        bbox: [0.0; 4],
        key_points: Vec::new(),
        hull: Vec::new(),
        mask: None,
        way: Way::ModelFit,
        checks: Checks::default(),
    }
}

/// Returns the part of a silhouette's bounding box that is in the picture, px.
fn bounds(outline: &Outline, (w, h): (f64, f64)) -> [f64; 4] {
    let [u0, v0, u1, v1] = outline.bounds();
    [u0.max(0.0), v0.max(0.0), u1.min(w - 1.0), v1.min(h - 1.0)]
}

/// The picture's own cut of an object, and where its contour's key points put it.
struct OwnCut {
    mask: GrayImage,
    placed: Result<Placed, key_points::Refused>,
    /// Whether it was cut near the fit's outline.
    helped: bool,
}

/// How far from the fit's outline a border is looked for when the box alone does not separate, px.
const BAND_PX: f64 = 9.0;

/// Goes the paper's way: cuts the object out, and places it by its contour's key points.
///
/// The first cuts start from the box alone and share nothing else with the fit. Where they give no contour
/// of use (a thing's own pattern, a neighbour of its colour) the border is looked for near the fit's outline.
fn own_cut(
    picture: &Picture,
    view: &Projector,
    evidence: &Evidence,
    outline: &Outline,
    bbox: [f64; 4],
) -> Option<OwnCut> {
    let boxed = |p: Vector2<f64>| {
        let inside = p.x > bbox[0] && p.y > bbox[1] && p.x < bbox[2] && p.y < bbox[3];
        match (evidence.hidden.covers(p), inside) {
            (true, _) => Expect::Ground,
            (_, true) => Expect::Inside,
            _ => Expect::Outside,
        }
    };
    let band = |p: Vector2<f64>| {
        let far = outline.depth(p);
        if far > BAND_PX || evidence.hidden.covers(p) {
            Expect::Ground
        } else if far > 0.0 {
            Expect::Outside
        } else if far > -BAND_PX {
            Expect::Inside
        } else {
            Expect::Object
        }
    };
    let mut first = None;
    for (border, helped) in [(BORDERS[0], false), (BORDERS[1], false), (BORDERS[0], true)] {
        let mask = if helped {
            cut(picture, bbox, band, border)
        } else {
            cut(picture, bbox, boxed, border)
        };
        let Some(mask) = mask else { continue };
        let placed = key_points::place(&mask, picture, view, evidence.object, &evidence.hidden);
        let done = placed.is_ok();
        let own = OwnCut { mask, placed, helped };
        if done {
            return Some(own);
        }
        first = first.or(Some(own));
    }
    first
}

/// Fits the chosen candidate once more with what is hidden left out, asks the other way, and says how sure
/// the picture leaves one; what it says against the scene is returned for [`weigh`].
pub(super) fn judge(
    picture: &Picture,
    view: &Projector,
    table: &Table,
    evidence: &Evidence,
    best: Option<Candidate>,
    rivals: &[Candidate],
) -> (Sighting, Option<Doubt>) {
    let object = evidence.object;
    let mut sighting = unseen(&object.name);
    let Some(best) = best else {
        let nearest = rivals.first();
        sighting.score = nearest.map(|c| c.score).unwrap_or_default();
        sighting.reason = Some(nearest.map_or_else(
            || "nothing in the picture looks like it".into(),
            |c| {
                format!(
                    "nothing in the picture looks like it: the best place, ({:.3}, {:.3}) m, scores {:.2}",
                    c.x, c.y, c.score.total
                )
            },
        ));
        return (sighting, None);
    };
    let mut best = if evidence.hidden.hulls.is_empty() { best } else { evidence.fit(&best) };
    let (w, h) = (picture.size().0 as f64, picture.size().1 as f64);
    let doubt = evidence.doubt(&best.pose(), table.centre);
    sighting.checks.missing = doubt.map_or(0.0, |d| d.missing);
    (sighting.std, sighting.yaw_std) = spread(&best, object);
    sighting.checks.fit_place = Some([best.x, best.y, best.yaw]);

    let outline = evidence.outline(&best.pose(), 12);
    let own = own_cut(picture, view, evidence, &outline, bounds(&outline, (w, h)));
    sighting.checks.helped = own.as_ref().is_some_and(|own| own.helped);
    sighting.checks.refused = own.as_ref().and_then(|own| own.placed.as_ref().err().copied());
    let placed = own.as_ref().and_then(|own| own.placed.as_ref().ok());
    if let Some(found) = placed {
        let other = Candidate {
            x: found.x,
            y: found.y,
            yaw: found.yaw,
            score: evidence.score(&found.pose(), 0, 16),
            fit: None,
        };
        sighting.checks.key_point_place = Some([found.x, found.y, found.yaw]);
        sighting.checks.key_point_std = found.std();
        sighting.checks.apart = Some(other.distance(&best));
        // The edges are the referee; where they do not care, the surer way is taken.
        let ratio = other.score.total / best.score.total.max(1e-9);
        if ratio > 1.02 || (ratio > 0.97 && found.std() < 0.8 * sighting.std) {
            best = other;
            sighting.way = Way::KeyPoints;
            sighting.std = found.std();
            sighting.yaw_std = found.covariance[(2, 2)].max(0.0).sqrt();
        }
    }
    let outline = evidence.outline(&best.pose(), 12);
    sighting.bbox = bounds(&outline, (w, h));
    sighting.score = best.score;
    sighting.world_from_object = Some(best.pose());

    let apart = (0.6 * object.shape.inner_radius()).max(0.02);
    let rival = rivals.iter().find(|c| c.distance(&best) > apart);
    let gap = rival.map_or(1.0, |r| 1.0 - r.score.total / best.score.total.max(1e-9));
    sighting.gap = gap;
    sighting.confidence = belief(&best.score) * (0.1 + gap / 0.1).clamp(0.0, 1.0);
    if let Some(rival) = rival.filter(|_| gap < 0.05) {
        sighting.reason = Some(format!(
            "two places fit almost equally: ({:.3}, {:.3}) m and ({:.3}, {:.3}) m; \
             clear the table or tell where to look",
            best.x, best.y, rival.x, rival.y
        ));
    }
    // What looks like the thing tells of the table, whether or not its outline is whole.
    let doubt = doubt.filter(|_| sighting.confidence >= FOUND);
    object_to(&mut sighting, &best, object.material);

    let silhouette = fill(&outline, evidence, sighting.bbox, (w as u32, h as u32));
    if let Some(own) = &own {
        let (mut both, mut mine, mut theirs) = (0.0, 0.0, 0.0);
        for (a, b) in own.mask.pixels().zip(silhouette.pixels()) {
            let (a, b) = (a.0[0] > 0, b.0[0] > 0);
            both += f64::from(u8::from(a && b));
            mine += f64::from(u8::from(a));
            theirs += f64::from(u8::from(b));
        }
        sighting.checks.mask_iou = Some(both / f64::max(mine + theirs - both, 1.0));
    }
    sighting.key_points = match placed {
        // The contour's own key points, when they belong to this pose.
        Some(found)
            if sighting.way == Way::KeyPoints
                || sighting.checks.apart.is_some_and(|a| a < 0.01) =>
        {
            sighting.checks.measured = true;
            found.points.iter().map(|point| [point.pixel.x, point.pixel.y]).collect()
        }
        _ => {
            let inside =
                |p: &Vector2<f64>| p.x >= -0.5 && p.y >= -0.5 && p.x < w - 0.5 && p.y < h - 0.5;
            let shown = |p: &&Vector2<f64>| inside(p) && !evidence.hidden.covers(**p);
            outline.key_points.iter().filter(shown).map(|p| [p.x, p.y]).collect()
        }
    };
    sighting.hull = outline.hull.iter().map(|p| [p.x, p.y]).collect();
    // The picture's own cut is the better mask when it is smooth and agrees with the solid.
    let agrees = sighting.checks.mask_iou.is_some_and(|iou| iou > 0.85);
    sighting.mask = own
        .map(|own| own.mask)
        .filter(|own| agrees && Smoothness::of(own).is_some_and(|s| s.is_smooth()))
        .or(Some(silhouette));
    (sighting, doubt)
}

/// Returns one standard deviation of a fit's position, m, and turn, rad, were the scene right.
fn spread(best: &Candidate, object: &Object) -> (f64, f64) {
    let turns = object.shape.symmetry() > 0.0;
    let Some(fit) = best.fit else {
        // Not fitted below the scoring's own step: a few pixels' worth.
        return (0.004, if turns { 0.03 } else { 0.0 });
    };
    let plane = fit.covariance.fixed_view::<2, 2>(0, 0).into_owned();
    let std = plane.symmetric_eigenvalues().max().max(0.0).sqrt();
    (std, fit.covariance[(2, 2)].max(0.0).sqrt())
}

/// Support of the weakest part of an outline at which a pose is as likely wrong as right. Of opaque things,
/// right poses have at least 0.56 on real photographs, those with a wrong height or table at most 0.45. Of
/// clear ones, whose edges come and go, a place inside something else has up to 0.3.
const WEAK: [f64; 2] = [0.5, 0.4];
/// Share of the silhouette, in whole edges, that may show no edge.
const MISSING: f64 = 0.12;
/// Share of the outline that must be in view for edges alone to name a thing.
const IN_VIEW: f64 = 0.5;
/// How far apart the two ways may put an object, m, and in standard deviations.
const APART: (f64, f64) = (0.01, 3.0);
/// How far off, m, a place may be before it is as good as unknown: twice what a gripper forgives.
const OF_USE: f64 = 0.025;

/// Lowers the confidence by what a thing's outline lacks in the picture, and says it.
fn object_to(sighting: &mut Sighting, at: &Candidate, material: Material) {
    let score = at.score;
    let clear = material == Material::Transparent;
    if score.visible > 0.9 * IN_VIEW {
        let weak = 1.0 / (1.0 + (-(score.weakest - WEAK[usize::from(clear)]) / 0.03).exp());
        sighting.confidence *= weak;
        if weak < 0.8 {
            sighting.reason = Some(format!(
                "at ({:.3}, {:.3}) m a part of its outline has hardly an edge in the picture: {:.0} %; \
                 check its size and the table's place in the scene",
                at.x,
                at.y,
                100.0 * score.weakest
            ));
        }
    } else if score.colour.is_none() && !clear {
        sighting.confidence *= (score.visible / IN_VIEW).powi(3);
        sighting.reason = Some(format!(
            "at ({:.3}, {:.3}) m only {:.0} % of its outline is in view, and it has no colour of its own; \
             move it, or what hides it",
            at.x,
            at.y,
            100.0 * score.visible
        ));
    }
    if sighting.checks.missing > MISSING && !clear {
        sighting.confidence *= 0.4;
        sighting.reason = Some(format!(
            "at ({:.3}, {:.3}) m {:.0} % of its outline, whole edges, are not in the picture; \
             check its height and size in the scene",
            at.x,
            at.y,
            100.0 * sighting.checks.missing
        ));
    }
}

/// Weighs what speaks against the scene, and how far the two ways are apart.
pub(super) fn weigh(
    sighting: &mut Sighting,
    doubt: Option<&Doubt>,
    table: Option<&TableDoubt>,
    height: f64,
) {
    if sighting.world_from_object.is_none() {
        return;
    }
    if let Some(doubt) = doubt {
        let meaning = doubt.meaning(table, height);
        sighting.checks.meaning = meaning;
        let scene = meaning.std();
        sighting.std = sighting.std.hypot(scene);
        sighting.confidence /= 1.0 + (scene / OF_USE).powi(2);
        let far = 1e3 * scene;
        // A deviation that grew has a reason that is told.
        if scene > 0.003 && meaning.table * meaning.by_table >= meaning.size * meaning.by_size {
            sighting.reason = Some(format!(
                "by the edges of what stands on it the table is {:.0} mm {} than the scene and the camera's \
                 pose say, and tilted by {:.1} deg, so this place may be {far:.0} mm off; \
                 calibrate the camera, or check sizes in the scene",
                1e3 * meaning.lift.abs(),
                if meaning.lift > 0.0 { "higher" } else { "lower" },
                meaning.tilt.to_degrees(),
            ));
        } else if meaning.size > 0.5 && meaning.larger.iter().any(|l| l.abs() > 0.02) {
            let [whole, height] = meaning.larger.map(|l| 100.0 * l);
            sighting.reason = Some(format!(
                "by its edges it is {:.0} % {} and {:.0} % {} than said, so its place may be {far:.0} mm off; \
                 check its size in the scene",
                whole.abs(),
                if whole > 0.0 { "wider" } else { "narrower" },
                (whole + height).abs(),
                if whole + height > 0.0 { "taller" } else { "lower" },
            ));
        }
    }
    let sigma = sighting.std.hypot(sighting.checks.key_point_std);
    if let Some(apart) = sighting.checks.apart
        && apart > APART.0.max(APART.1 * sigma)
    {
        sighting.confidence *= 0.6;
        sighting.reason = Some(format!(
            "its contour's key points put it {:.0} mm from where its outline fits best; \
             clear the view, or check its size in the scene",
            1e3 * apart
        ));
    }
}

/// Takes into account that what others, or the object itself, are blamed for may be the table's fault.
///
/// `blamed` is where the table would then be.
pub(super) fn suspect(
    sighting: &mut Sighting,
    doubt: Option<&Doubt>,
    blamed: &TableDoubt,
    height: f64,
) {
    let Some(doubt) = doubt else { return };
    let far = doubt.meaning(Some(blamed), height).by_table;
    sighting.std = sighting.std.hypot(far);
    sighting.confidence /= 1.0 + (far / OF_USE).powi(2);
    if far > 0.003 {
        sighting.reason.get_or_insert_with(|| {
            format!(
                "something on the table does not look as the scene says; if the table or the camera is not \
                 where it is said to be, this place is {:.0} mm off",
                1e3 * far
            )
        });
    }
}

/// Decides whether an object is found; what is not found has a reason and no place.
pub(super) fn decide(sighting: &mut Sighting) {
    let Some(pose) = sighting.world_from_object else { return };
    sighting.found = sighting.confidence >= FOUND;
    if sighting.found {
        sighting.ambiguous = sighting.reason.take();
        return;
    }
    sighting.world_from_object = None;
    sighting.mask = None;
    sighting.key_points.clear();
    sighting.hull.clear();
    let at = pose.origin();
    sighting.reason.get_or_insert_with(|| {
        format!(
            "the best place, ({:.3}, {:.3}) m, is not convincing: {:.0} % of the outline has an edge, \
             the weakest part {:.0} %",
            at.x,
            at.y,
            100.0 * sighting.score.edge,
            100.0 * sighting.score.weakest
        )
    });
}

/// Returns the silhouette without what is hidden as a mask of the picture's size.
fn fill(outline: &Outline, evidence: &Evidence, bbox: [f64; 4], size: (u32, u32)) -> GrayImage {
    let mut mask = GrayImage::new(size.0, size.1);
    for y in bbox[1].floor() as u32..=bbox[3].ceil().min(f64::from(size.1) - 1.0) as u32 {
        for x in bbox[0].floor() as u32..=bbox[2].ceil().min(f64::from(size.0) - 1.0) as u32 {
            let p = Vector2::new(f64::from(x), f64::from(y));
            if outline.contains(p) && !evidence.hidden.covers(p) {
                mask.put_pixel(x, y, Luma([255]));
            }
        }
    }
    mask
}
