//! The referee: two ways to a pose, the checks between them, and how sure that leaves one.

use image::{GrayImage, Luma};
use nalgebra::Vector2;

use super::{Checks, FOUND, Sighting, Way, belief};
use crate::alignment::contour::Smoothness;
use crate::alignment::key_points::{self, Placed};
use crate::alignment::outline::{Outline, Projector};
use crate::alignment::picture::Picture;
use crate::alignment::placement::{Candidate, Evidence, Score};
use crate::alignment::refine::Doubt;
use crate::alignment::segment::{BORDERS, cut};
use crate::world::{Material, Object};

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

/// Fits the chosen candidate once more with what is hidden left out, asks the other way, and says how sure
/// the two and the picture leave one.
pub(super) fn judge(
    picture: &Picture,
    view: &Projector,
    object: &Object,
    evidence: &Evidence,
    best: Option<Candidate>,
    rivals: &[Candidate],
) -> Sighting {
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
        return sighting;
    };
    let mut best = if evidence.hidden.hulls.is_empty() { best } else { evidence.fit(&best) };
    let (w, h) = (picture.size().0 as f64, picture.size().1 as f64);

    // The second way starts from a box, as the paper's does, and shares nothing else with the first. Where
    // the box alone does not cut a smooth contour, the silhouette helps.
    let outline = evidence.outline(&best.pose(), 12);
    let bbox = bounds(&outline, (w, h));
    let boxed = |p: Vector2<f64>| p.x > bbox[0] && p.y > bbox[1] && p.x < bbox[2] && p.y < bbox[3];
    let covered = |p: Vector2<f64>| evidence.hidden.covers(p);
    let place = |mask: Option<GrayImage>| {
        let mask = mask?;
        let placed = key_points::place(&mask, picture, view, object, &evidence.hidden);
        Some((mask, placed))
    };
    let mut second = place(cut(picture, bbox, boxed, covered, BORDERS[0]));
    for attempt in 0..2 {
        if matches!(&second, Some((_, Ok(_)))) {
            break;
        }
        let again = place(if attempt == 0 {
            cut(picture, bbox, boxed, covered, BORDERS[1])
        } else {
            cut(picture, bbox, |p| outline.contains(p), covered, BORDERS[0])
        });
        if second.is_none() || matches!(&again, Some((_, Ok(_)))) {
            second = again;
        }
    }
    let (own, placed): (Option<GrayImage>, Option<Placed>) = match second {
        Some((mask, Ok(placed))) => (Some(mask), Some(placed)),
        Some((mask, Err(why))) => {
            sighting.checks.refused = Some(why);
            (Some(mask), None)
        }
        None => (None, None),
    };

    let doubt = evidence.doubt(&best.pose());
    sighting.checks.doubt = doubt;
    let opaque = object.material == Material::Opaque;
    (sighting.std, sighting.yaw_std) = spread(&best, object, doubt.filter(|_| opaque));
    sighting.checks.fit_place = Some([best.x, best.y, best.yaw]);
    if let Some(found) = &placed {
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

    let apart = (0.6 * object.shape.inner_radius()).max(0.02);
    let rival = rivals.iter().find(|c| c.distance(&best) > apart);
    let gap = rival.map_or(1.0, |r| 1.0 - r.score.total / best.score.total.max(1e-9));
    sighting.gap = gap;
    sighting.confidence = belief(&best.score) * (0.1 + gap / 0.1).clamp(0.0, 1.0);

    let silhouette = fill(&outline, evidence, sighting.bbox, (w as u32, h as u32));
    if let Some(own) = &own {
        let (mut both, mut mine, mut theirs) = (0.0, 0.0, 0.0);
        for (a, b) in own.pixels().zip(silhouette.pixels()) {
            let (a, b) = (a.0[0] > 0, b.0[0] > 0);
            both += f64::from(u8::from(a && b));
            mine += f64::from(u8::from(a));
            theirs += f64::from(u8::from(b));
        }
        let size = f64::max(theirs, 1.0);
        sighting.checks.mask_iou = Some(both / f64::max(mine + theirs - both, 1.0));
        sighting.checks.bite = (theirs - both) / size;
        sighting.checks.leak = (mine - both) / size;
    }
    let objection = object_to(&mut sighting, object, view.eye());
    sighting.found = sighting.confidence >= FOUND;
    if !sighting.found {
        sighting.reason = Some(match rival {
            _ if objection.is_some() => objection.unwrap_or_default(),
            Some(r) if gap < 0.05 => format!(
                "two places fit almost equally: ({:.3}, {:.3}) m and ({:.3}, {:.3}) m; \
                 clear the table or tell where to look",
                best.x, best.y, r.x, r.y
            ),
            _ => format!(
                "the best place, ({:.3}, {:.3}) m, is not convincing: {:.0} % of the outline has an edge, \
                 the weakest part {:.0} %",
                best.x,
                best.y,
                100.0 * best.score.edge,
                100.0 * best.score.weakest
            ),
        });
        return sighting;
    }
    sighting.ambiguous = objection;
    sighting.world_from_object = Some(best.pose());
    let inside = |p: &Vector2<f64>| p.x >= -0.5 && p.y >= -0.5 && p.x < w - 0.5 && p.y < h - 0.5;
    let shown = |p: &&Vector2<f64>| inside(p) && !evidence.hidden.covers(**p);
    sighting.key_points = match &placed {
        // The contour's own key points, when they belong to this pose.
        Some(found)
            if sighting.way == Way::KeyPoints
                || sighting.checks.apart.is_some_and(|a| a < 0.01) =>
        {
            found.points.iter().map(|point| [point.pixel.x, point.pixel.y]).collect()
        }
        _ => outline.key_points.iter().filter(shown).map(|p| [p.x, p.y]).collect(),
    };
    sighting.hull = outline.hull.iter().map(|p| [p.x, p.y]).collect();
    // The picture's own cut is the better mask when it is smooth and agrees with the solid.
    let agrees = sighting.checks.mask_iou.is_some_and(|iou| iou > 0.85);
    sighting.mask = own
        .filter(|own| agrees && Smoothness::of(own).is_some_and(|s| s.is_smooth()))
        .or(Some(silhouette));
    sighting
}

/// Returns one standard deviation of a fit's position, m, and turn, rad.
///
/// What the fit would move by were the table's and the solid's height not believed shows how far the scene's
/// numbers carry; a quarter of it is about what they cost on real photographs of a tube 3 % thinner than
/// said.
fn spread(best: &Candidate, object: &Object, doubt: Option<Doubt>) -> (f64, f64) {
    let turns = object.shape.symmetry() > 0.0;
    let Some(fit) = best.fit else {
        // Not fitted below the scoring's own step: a few pixels' worth.
        return (0.004, if turns { 0.03 } else { 0.0 });
    };
    let plane = fit.covariance.fixed_view::<2, 2>(0, 0).into_owned();
    let std = plane.symmetric_eigenvalues().max().max(0.0).sqrt();
    let scene = doubt.map_or(0.0, |d| SCENE_SHARE * d.moved.min(0.05));
    (std.hypot(scene), fit.covariance[(2, 2)].max(0.0).sqrt())
}

/// The part of [`Doubt::moved`] that is taken for the scene's error.
const SCENE_SHARE: f64 = 0.25;
/// Support of the weakest part of an opaque outline at which a pose is as likely wrong as right: right poses
/// have at least 0.56 on real photographs, those with a wrong height or table at most 0.45.
const WEAK: f64 = 0.5;
/// Share of the silhouette, in whole edges, that may show no edge.
const MISSING: f64 = 0.12;
/// Lift of the base that is more than a size known to 3 % explains, as a part of the distance to the eye.
const LIFTED: f64 = 0.032;
/// How far apart the two ways may put an object, m, and in standard deviations.
const APART: (f64, f64) = (0.01, 3.0);

/// Lowers the confidence by what speaks against the pose, and says it.
fn object_to(
    sighting: &mut Sighting,
    object: &Object,
    eye: nalgebra::Vector3<f64>,
) -> Option<String> {
    let checks = sighting.checks;
    let mut objection = None;
    let [x, y, _] = checks.fit_place?;
    // A clear thing's own edges are too faint and too many to judge the scene by.
    if object.material == Material::Opaque {
        if sighting.score.visible > 0.45 {
            let weak = 1.0 / (1.0 + (-(sighting.score.weakest - WEAK) / 0.03).exp());
            sighting.confidence *= weak;
            if weak < 0.8 {
                objection = Some(format!(
                    "at ({x:.3}, {y:.3}) m a part of its outline has hardly an edge in the picture: {:.0} %; \
                     check its size and the table's place in the scene",
                    100.0 * sighting.score.weakest
                ));
            }
        }
        if let Some(doubt) = checks.doubt {
            if doubt.missing > MISSING {
                sighting.confidence *= 0.4;
                objection = Some(format!(
                    "at ({x:.3}, {y:.3}) m {:.0} % of its outline, whole edges, are not in the picture; \
                     check its height and size in the scene",
                    100.0 * doubt.missing
                ));
            }
            let far = (eye - nalgebra::Vector3::new(x, y, 0.0)).norm();
            if doubt.lift.abs() > (LIFTED * far).max(3.0 * doubt.lift_std) {
                sighting.confidence *= 0.8;
                objection = Some(format!(
                    "by its size in the picture it stands {:.0} mm {} the table, or it is {:.0} % {} than said",
                    1e3 * doubt.lift.abs(),
                    if doubt.lift > 0.0 { "above" } else { "below" },
                    100.0 * doubt.lift.abs() / far,
                    if doubt.lift > 0.0 { "larger" } else { "smaller" },
                ));
            }
        }
    }
    let sigma = sighting.std.hypot(checks.key_point_std);
    if let Some(apart) = checks.apart
        && apart > APART.0.max(APART.1 * sigma)
    {
        sighting.confidence *= 0.6;
        objection = Some(format!(
            "its contour's key points put it {:.0} mm from where its outline fits best; \
             clear the view, or check its size in the scene",
            1e3 * apart
        ));
    }
    objection
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
