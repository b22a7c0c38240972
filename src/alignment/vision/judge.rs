//! The referee: two ways to a pose, the checks between them, and how sure that leaves one.

use image::{GrayImage, Luma};
use nalgebra::Vector2;

use super::identity;
use super::own_cut::{chosen, offered_cuts, overlap, own_cut};
use super::probability::{self, Says};
use super::rival::{GAP, RIVAL_LEAST, along_std, apart_std, is_another};
use super::{Checks, FOUND, MaskIs, Sighting, Way, belief, wording};
use crate::alignment::contour::Smoothness;
use crate::alignment::doubt::{Doubt, TableDoubt};
use crate::alignment::evidence::{Evidence, Score};
use crate::alignment::outline::{Outline, Projector};
use crate::alignment::picture::Picture;
use crate::alignment::placement::Candidate;
use crate::world::{Material, Object, Table};

/// Returns a sighting that says nothing was seen.
fn unseen(name: &str) -> Sighting {
    Sighting {
        name: name.to_owned(),
        found: false,
        fits: false,
        reason: None,
        ambiguous: None,
        world_from_object: None,
        likeliest: None,
        kept: None,
        std: 0.0,
        std_if_there: 0.0,
        yaw_std: 0.0,
        confidence: 0.0,
        score: Score::default(),
        gap: 0.0,
        bbox: [0.0; 4],
        key_points: Vec::new(),
        hull: Vec::new(),
        mask: None,
        mask_is: MaskIs::Silhouette,
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
/// the picture leaves one; what it says against the scene is returned for [`weigh`]. Of what was not chosen the best rival
/// is looked at, else any place at all.
pub(super) fn judge(
    picture: &Picture,
    view: &Projector,
    table: &Table,
    evidence: &Evidence,
    offered: &[GrayImage],
    (best, rivals, alike, any): (Option<Candidate>, &[Candidate], &[f64], Option<Candidate>),
) -> (Sighting, Option<Doubt>) {
    let object = evidence.object;
    let mut sighting = unseen(&object.name);
    let is_chosen = best.is_some();
    let is_explained = best.is_none() && rivals.is_empty();
    let Some(best) = best.or(rivals.first().copied()).or(any) else {
        sighting.reason = Some(wording::nothing_like_it(None));
        return (sighting, None);
    };
    let (mut best, others) = behind(evidence, best);
    let (w, h) = (picture.size().0 as f64, picture.size().1 as f64);
    let doubt = evidence.doubt(&best.pose(), table.centre);
    sighting.checks.missing = doubt.map_or(0.0, |d| d.missing);
    (sighting.std, sighting.yaw_std) = spread(&best, &others, object);
    sighting.checks.fit_place = Some([best.x, best.y, best.yaw]);

    let outline = evidence.silhouette(&best.pose(), PER_EDGE);
    let own = own_cut(picture, view, evidence, &outline, bounds(&outline, (w, h)));
    let offered = offered_cuts(picture, view, evidence, offered);
    let (cut, is_others) =
        chosen(picture, own.as_ref(), &offered).map_or((None, false), |(cut, by)| (Some(cut), by));
    sighting.checks.is_others = is_others;
    sighting.checks.helped = cut.is_some_and(|cut| cut.helped);
    sighting.checks.refused = cut.and_then(|cut| cut.placed.as_ref().err().copied());
    let placed = cut.and_then(|cut| cut.placed.as_ref().ok());
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
        let ratio = other.score.total / best.score.total.max(TINY);
        let surer = found.std() < SURER * sighting.std;
        if ratio > BETTER || (ratio > AS_GOOD && surer) {
            best = other;
            sighting.way = Way::KeyPoints;
            sighting.std = found.std();
            sighting.yaw_std = found.covariance[(2, 2)].max(0.0).sqrt();
        }
    }
    let outline = evidence.silhouette(&best.pose(), PER_EDGE);
    sighting.bbox = bounds(&outline, (w, h));
    sighting.score = best.score;
    sighting.world_from_object = Some(best.pose());

    let rival = rivals.iter().find(|c| is_another(&object.shape, &best, c));
    let gap = rival.map_or(1.0, |r| 1.0 - r.score.total / best.score.total.max(TINY));
    let at_its_place = rivals.iter().filter(|c| c.distance(&best) < RIVAL_LEAST);
    let (_, by_turn) = apart_std(&best, at_its_place, object.shape.symmetry());
    sighting.yaw_std = sighting.yaw_std.hypot(by_turn);
    sighting.std = sighting.std.hypot(along_std(&object.shape, &best, rivals));
    let other = identity::ask(evidence, &best, alike);
    let gap = gap.min(other.ahead);
    sighting.gap = gap;
    sighting.checks.identity = other;
    if other.shape < 0.0 {
        sighting.std =
            sighting.std.hypot(other.shape_apart * (1.0 - (other.shape / SHAPE_WIDTH).exp()));
    }
    let silhouette = fill(&outline, evidence, sighting.bbox, (w as u32, h as u32));
    sighting.checks.mask_iou = own.as_ref().map(|own| overlap(&own.mask, &silhouette));
    let tie = believe(&mut sighting, &best, object.material, rival);
    sighting.fits &= is_chosen && table.holds(best.x, best.y, 0.0);
    if !is_chosen {
        sighting.confidence = 0.0;
        sighting.reason = Some(if is_explained {
            wording::is_something_else(&best)
        } else {
            wording::nothing_like_it(Some(&best))
        });
    } else if !table.holds(best.x, best.y, 0.0) {
        sighting.confidence = 0.0;
        sighting.reason = Some(wording::off_the_table(&best));
    }
    // What is not there is anywhere: its place is as far off as its rivals are.
    sighting.checks.elsewhere = elsewhere(&best, rivals, table);
    // What looks like the thing tells of the table, whether or not its outline is whole; what is something else does not.
    let doubt = doubt.filter(|_| !is_explained && belief(&best.score) * tie >= FOUND);
    if hardly_in_view(&mut sighting, &best, object.material) {
        sighting.reason = Some(wording::hardly_in_view(&best));
    }

    sighting.key_points = match placed {
        // The contour's own key points, when they belong to this pose.
        Some(found)
            if sighting.way == Way::KeyPoints
                || sighting.checks.apart.is_some_and(|a| a < APART.0) =>
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
    (sighting.mask_is, sighting.mask) = masked(cut.map(|cut| &cut.mask), is_others, silhouette);
    (sighting, doubt)
}

/// Fits a candidate once more where something is in front of it. It was placed and turned before that was known, and may have
/// been drawn to an edge of what hides it: what is best around it, at any turn, is tried beside it. Returned with the other
/// places there that a fit comes to.
fn behind(evidence: &Evidence, best: Candidate) -> (Candidate, Vec<Candidate>) {
    if evidence.hidden.hulls.is_empty() {
        return (best, Vec::new());
    }
    if !evidence.is_behind(&best) {
        return (evidence.fit(&best), Vec::new());
    }
    let mut places = evidence.around(&best);
    let first = places.remove(0);
    (first, places)
}

/// Chooses the mask of a thing: the cut when it is smooth and agrees with the solid, else the solid's silhouette.
fn masked(
    cut: Option<&GrayImage>,
    is_others: bool,
    silhouette: GrayImage,
) -> (MaskIs, Option<GrayImage>) {
    let agrees = |mask: &&GrayImage| {
        overlap(mask, &silhouette) > AGREES && Smoothness::of(mask).is_some_and(|s| s.is_smooth())
    };
    match cut.filter(agrees) {
        None => (MaskIs::Silhouette, Some(silhouette)),
        Some(mask) if is_others => (MaskIs::Offered, Some(mask.clone())),
        Some(mask) => (MaskIs::OwnCut, Some(mask.clone())),
    }
}

/// Says how probable a placement is and what speaks most against it, and whether it fits there, wherever else it would as well;
/// returns what the nearest rival leaves of it.
fn believe(
    sighting: &mut Sighting,
    best: &Candidate,
    material: Material,
    rival: Option<&Candidate>,
) -> f64 {
    let (gap, missing) = (sighting.gap, sighting.checks.missing);
    let said = probability::Evidence {
        score: best.score.total,
        weakest: best.score.weakest,
        cut: sighting.checks.mask_iou,
        elsewhere: sighting.checks.identity.elsewhere,
        shape: sighting.checks.identity.shape,
        gap,
        missing,
        apart: sighting.checks.apart,
    };
    let is_clear = material == Material::Transparent;
    let (likely, against) = probability::of(&said, is_clear);
    let alone = probability::Evidence { gap: 1.0, elsewhere: 1.0, ..said };
    sighting.fits = !is_clear && missing <= MISSING && probability::of(&alone, false).0 >= FOUND;
    let tie = (TIED + gap / GAP).clamp(0.0, 1.0);
    sighting.confidence = likely * tie;
    if let Some(rival) = rival.filter(|_| gap < NEAR_TIE) {
        sighting.reason = Some(wording::two_places(best, rival));
    } else if likely < TOLD {
        sighting.reason = Some(told(against, best, sighting));
    }
    if missing > MISSING && material == Material::Opaque {
        sighting.confidence *= LEFT_BY_MISSING;
        sighting.reason = Some(wording::missing_edges(best, missing));
    }
    tie
}

/// Returns one standard deviation of a place, m, and of its turn, rad, were the scene right: that of its fit and, of what is
/// behind another, of the other places there that fit about as well.
fn spread(best: &Candidate, others: &[Candidate], object: &Object) -> (f64, f64) {
    let symmetry = object.shape.symmetry();
    let (std, turn_std) = match best.fit {
        None => UNFITTED,
        Some(fit) => {
            let plane = fit.covariance.fixed_view::<2, 2>(0, 0).into_owned();
            let std = plane.symmetric_eigenvalues().max().max(0.0).sqrt();
            (std, fit.covariance[(2, 2)].max(0.0).sqrt())
        }
    };
    let turn_std = if symmetry > 0.0 { turn_std } else { 0.0 };
    let (by_place, by_turn) = apart_std(best, others, symmetry);
    (std.hypot(by_place), turn_std.hypot(by_turn))
}

/// Probability below which a person is told what speaks most against a place: one in five is wrong.
const TOLD: f64 = 0.8;
/// How much better another solid must fit for its place to count in full in the deviation, score. Chosen: a tenth of
/// the step between what is absent and what is there; with half of it chance moves a place that is right, with twice
/// as much a bottle's place is believed to a fraction of a millimetre.
const SHAPE_WIDTH: f64 = 0.04;
/// What is in view by chance of rounding does not count against [`IN_VIEW`]: a tenth of it.
const NEARLY_IN_VIEW: f64 = 0.9;
/// How the confidence falls with the share in view: its power, so that a half of [`IN_VIEW`] leaves an eighth.
/// Chosen: at 1.5 a quarter of an outline would leave more than a third, and by belief alone a thing is found at 0.5;
/// at 6 a hidden tenth more is the end of it.
const SEEN_POWER: i32 = 3;
/// Share of the silhouette, in whole edges, that may show no edge, and what more leaves of the confidence. Chosen: below
/// one of the six edges of a cuboid's silhouette (0.17), of which none may be missing; with half of the share a short
/// edge in the dark refuses a right pose, with twice as much a whole side may be missing. It is beside the regression: the
/// battery's scenes are true, and it is in wrong ones that whole edges are missing (`a_wrong_scene_is_objected_to`).
const MISSING: f64 = 0.12;
const LEFT_BY_MISSING: f64 = 0.4;
/// The least deviation that has a reason told, m. Chosen: ten times the 0.3 mm of a good sighting
/// (`docs/results.md`), and less than the room of a grasp (4 mm a side); at half of it every sighting tells one, at
/// twice it a grasp may fail unwarned.
const WORTH_TELLING: f64 = 0.003;
/// The odds at which a size is told as wrong: more likely than not, and by how much at least, as a share. Chosen: 2 %
/// of a 65 mm thing is 1.3 mm, a rule's reading; half of it is not told from a table that is 10 mm off
/// (`docs/results.md`).
const ODDS: f64 = 0.5;
const LARGER: f64 = 0.02;
/// What keeps a score of none from dividing; scores that matter are above 0.3.
const TINY: f64 = 1e-9;
/// Points an edge of the outline for what is drawn, filled and cut: 12 are some 5 mm of a 65 mm edge. Chosen: half of
/// them would show a bent edge of a lens as a straight one, twice as many cost as much again and are nearer than a
/// picture can show.
const PER_EDGE: usize = 12;
/// The key points' way is taken when its score is that much better, or when it is nearly as good and surer, as
/// ratios. Chosen: a score is flat within some pixels, so that a few per cent decide nothing. With half of these
/// steps chance chooses between two good places; with twice as large ones the better of two ways loses, and a bad one
/// may win by its own word.
const BETTER: f64 = 1.02;
const AS_GOOD: f64 = 0.97;
const SURER: f64 = 0.8;
/// What is believed at a tie; [`GAP`] ahead of it nothing is taken off.
const TIED: f64 = 0.1;
/// The gap that the measurement marks, told in words.
const NEAR_TIE: f64 = 0.05;
/// Overlap of mask and silhouette above which the mask is believed. The cuts of eleven real transparent things had
/// 0.92 in the median and 0.8 or more in eight (measured with a prototype, boxes 15 % too large). Chosen below the
/// median: at 0.7 a cut that has taken a shadow in replaces the solid, at 0.95 most that are right are thrown away.
const AGREES: f64 = 0.85;
/// Deviation of a place that was not fitted, m, and of its turn, rad: not below the step of the scoring, which climbs
/// from 3 mm and 0.03 rad. With half of it a place is believed more than it was looked at; twice as much is what the
/// coarse grid knows already.
const UNFITTED: (f64, f64) = (0.004, 0.03);
/// Share of the outline that must be in view for edges alone to name a thing. Chosen: less than half of an outline
/// leaves a side open, along which the place is not known; with twice as much nothing at the edge of the picture
/// would be found.
const IN_VIEW: f64 = 0.5;
/// How far apart the two ways may put an object, m, and in standard deviations. Chosen: 1 cm is the most that both
/// may be wrong and a hand still close round the thing (10 mm of room on each side of the jar); 3 standard deviations
/// are 1 in 370. With half of it every second clear thing is doubted, with twice as much a pose that misses the thing
/// is not.
const APART: (f64, f64) = (0.01, 3.0);
/// How far off, m, a place may be before it is as good as unknown: twice what a gripper forgives.
const OF_USE: f64 = 0.025;

/// Returns what speaks most against a place in words.
fn told(against: Says, at: &Candidate, sighting: &Sighting) -> String {
    let checks = &sighting.checks;
    match against {
        Says::Weakest => wording::weak_part(at),
        Says::Cut => wording::cut_differs(at, checks.mask_iou),
        Says::Elsewhere => wording::common_look(at, checks.identity.elsewhere),
        Says::Gap => wording::another_place(at, sighting.gap),
        Says::Shape => wording::other_solid(at),
        Says::Whole => wording::missing_edges(at, checks.missing),
        Says::Agree => {
            checks.apart.map_or_else(|| wording::no_key_points(at), wording::two_ways_differ)
        }
        Says::Score => wording::not_convincing([at.x, at.y], at.score.edge, at.score.weakest),
    }
}

/// Lowers the confidence in a thing without colour of which too little is in view, and returns whether it did: such a thing fits
/// anywhere along what is seen of it.
fn hardly_in_view(sighting: &mut Sighting, at: &Candidate, material: Material) -> bool {
    let score = at.score;
    let has_none = score.colour.is_none() && material == Material::Opaque;
    if !has_none || score.visible > NEARLY_IN_VIEW * IN_VIEW {
        return false;
    }
    sighting.fits = false;
    sighting.confidence *= (score.visible / IN_VIEW).powi(SEEN_POWER);
    true
}

/// How far away the places are that a thing may be at instead, m: those of its rivals, or anywhere on the table.
fn elsewhere(best: &Candidate, rivals: &[Candidate], table: &Table) -> f64 {
    let apart = rivals.iter().map(|rival| rival.distance(best));
    apart.fold(0.5 * table.size.x.hypot(table.size.y) / 3.0_f64.sqrt(), f64::max)
}

/// Weighs what speaks against the scene, and how far the two ways are apart.
pub(super) fn weigh(
    sighting: &mut Sighting,
    doubt: Option<&Doubt>,
    table: Option<&TableDoubt>,
    height: f64,
) {
    let Some(pose) = sighting.world_from_object else { return };
    if let Some(doubt) = doubt {
        let meaning = doubt.meaning(table, height);
        sighting.checks.meaning = meaning;
        let scene = meaning.std();
        sighting.std = sighting.std.hypot(scene);
        sighting.confidence /= 1.0 + (scene / OF_USE).powi(2);
        // A deviation that grew has a reason that is told.
        let by_itself = (meaning.size * meaning.by_size).max(meaning.raised * meaning.by_raised);
        if scene > WORTH_TELLING && meaning.table * meaning.by_table >= by_itself {
            sighting.reason = Some(wording::table_is_elsewhere(&meaning, scene));
        } else if meaning.raised > ODDS && scene > WORTH_TELLING {
            let at = pose.origin();
            let place = [at.x + meaning.shift[0], at.y + meaning.shift[1]];
            sighting.reason = Some(wording::stands_higher(&meaning, place));
        } else if meaning.size > ODDS && meaning.larger.iter().any(|l| l.abs() > LARGER) {
            sighting.reason = Some(wording::size_is_other(&meaning, scene));
        }
    }
    let sigma = sighting.std.hypot(sighting.checks.key_point_std);
    if let Some(apart) = sighting.checks.apart
        && apart > APART.0.max(APART.1 * sigma)
    {
        sighting.reason = Some(wording::two_ways_differ(apart));
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
    if far > WORTH_TELLING {
        sighting.reason.get_or_insert_with(|| wording::others_look_wrong(far));
    }
}

/// Takes into account that what was seen may be one of `others`, which differ from it by colour alone, in a picture that has
/// none; `share` is how probable it is that it is not.
pub(super) fn without_colour(sighting: &mut Sighting, others: &[&str], share: f64) {
    let was_found = sighting.confidence >= FOUND;
    sighting.confidence *= share;
    if was_found {
        sighting.reason = Some(wording::only_colour_tells(others));
    }
}

/// Decides whether an object is found; what is not found has a reason, and the likeliest place in place of its place.
pub(super) fn decide(sighting: &mut Sighting) {
    let Some(pose) = sighting.world_from_object else { return };
    sighting.found = sighting.confidence >= FOUND;
    sighting.std_if_there = sighting.std;
    if sighting.found {
        sighting.ambiguous = sighting.reason.take();
        return;
    }
    sighting.likeliest = sighting.world_from_object.take();
    // It is there with this probability, else where its rivals are.
    let sure = sighting.confidence;
    let (here, there) = (sighting.std.powi(2), sighting.checks.elsewhere.powi(2));
    sighting.std = (sure * here + (1.0 - sure) * there).sqrt();
    sighting.key_points.clear();
    let at = pose.origin();
    let score = sighting.score;
    sighting
        .reason
        .get_or_insert_with(|| wording::not_convincing([at.x, at.y], score.edge, score.weakest));
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
