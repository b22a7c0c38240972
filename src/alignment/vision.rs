//! Seeing: a picture → the scene's objects, placed on the table, with how sure.
//!
//! [`see`] asks for every object of the scene where the picture supports it best ([`super::placement`]),
//! keeps objects out of each other, looks again at what stands behind something else, cuts the object out
//! of the picture ([`super::segment`]) as a second opinion, and says what it is not sure of. An object that
//! is not on the table is an answer: `found: false` with the reason. [`verify`] asks whether a picture
//! supports an object at a given pose in the air. Nothing here moves, calibrates or talks to people.
//!
//! Source: the paper, section 2.2 (segment, contour, key points, placement).

use std::collections::BTreeMap;

use image::{GrayImage, Luma, RgbImage};
use nalgebra::Vector2;
use serde::Serialize;
use thiserror::Error as ThisError;

use super::contour::Smoothness;
use super::outline::{Kind, ObjectPose, Projector};
use super::picture::{Picture, Plane, median};
use super::placement::{Candidate, Evidence, Hidden, Score, Window, assign, overlap};
use super::refine::strongest;
use super::segment::{TableModel, cut};
use crate::world::{Camera, Object, Scene};

pub use super::overlay::annotate;

/// Why a picture could not be used at all. An object that is not found is an answer, not an error.
#[derive(Debug, Clone, PartialEq, ThisError)]
pub enum Error {
    /// The picture and the camera disagree about the picture's size.
    #[error(
        "the picture is {} x {} px, the camera's calibration is for {} x {} px; \
         use the calibration of this camera at this size",
        image.0, image.1, camera.0, camera.1
    )]
    WrongSize {
        /// Width and height of the picture, px.
        image: (u32, u32),
        /// Width and height in the calibration, px.
        camera: (u32, u32),
    },
    /// The scene has too few printed dots for a homography.
    #[error(
        "the scene has {marks} table marks, alignment needs at least {needed}; add `marks dots` to the scene"
    )]
    NoMarks {
        /// Marks in the scene.
        marks: usize,
        /// Marks needed.
        needed: usize,
    },
    /// Too few printed dots were recognised.
    #[error(
        "only {found} of {marks} table marks were recognised ({dots} dark dots seen, {needed} needed); \
         clear the table's dots, or correct the camera guess in the scene"
    )]
    TooFewMarks {
        /// Marks recognised.
        found: usize,
        /// Marks needed.
        needed: usize,
        /// Dark dots seen at all.
        dots: usize,
        /// Marks in the scene.
        marks: usize,
    },
}

/// Where to look and what to leave out.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// For some objects, by name, the part of the table to search; others are searched for everywhere.
    pub windows: BTreeMap<String, Window>,
    /// Non-zero where the picture shows something that is not to be judged, such as the arm; the
    /// picture's size.
    pub ignore: Option<GrayImage>,
}

/// Confidence from which an object counts as found.
pub const FOUND: f64 = 0.5;

/// One object of the scene as the picture shows it.
#[derive(Debug, Clone)]
pub struct Sighting {
    /// The object's name.
    pub name: String,
    /// Whether it is on the table in this picture, as far as one can be sure.
    pub found: bool,
    /// Why it is not found, or what speaks against a pose that was found.
    pub reason: Option<String>,
    /// Where it stands, when found; z = 0 and upright by assumption.
    pub world_from_object: Option<ObjectPose>,
    /// One standard deviation of its position, m: of the worst direction on the table.
    pub std: f64,
    /// One standard deviation of its turn about z, rad; 0 for a cylinder.
    pub yaw_std: f64,
    /// How sure, 0 to 1.
    pub confidence: f64,
    /// What the best pose scored, found or not.
    pub score: Score,
    /// How far behind the best other place is, as a share of the best score.
    pub gap: f64,
    /// `[u0, v0, u1, v1]` of its silhouette inside the picture, px.
    pub bbox: [f64; 4],
    /// Corners and rim points that are seen, px.
    pub key_points: Vec<[f64; 2]>,
    /// The silhouette's outline, px.
    pub hull: Vec<[f64; 2]>,
    /// 255 where the picture shows the object; the picture's size.
    pub mask: Option<GrayImage>,
    /// Overlap of the mask cut from the picture with the silhouette of the pose; `None` when not cut.
    pub mask_iou: Option<f64>,
}

/// Whether a picture supports an object at a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Support {
    /// The agreement's parts.
    pub score: Score,
    /// How sure that the object is there, 0 to 1.
    pub confidence: f64,
    /// How the outline would have to move in the picture to meet the edges best, px (u, v).
    pub shift_px: [f64; 2],
    /// What is left of the distances between outline and edges after that, px.
    pub rms_px: f64,
}

/// Returns how sure a total score alone makes, 0 to 1.
///
/// The middle and the width are chosen between what was measured: absent objects score up to 0.3, present
/// ones from 0.57.
fn belief(score: &Score) -> f64 {
    1.0 / (1.0 + (-(score.total - 0.42) / 0.04).exp())
}

fn check_size(image: &RgbImage, camera: &Camera) -> Result<(), Error> {
    let size = (camera.intrinsics.width, camera.intrinsics.height);
    if image.dimensions() == size {
        Ok(())
    } else {
        Err(Error::WrongSize { image: image.dimensions(), camera: size })
    }
}

/// Returns what does not look like bare table; nothing, when no table is in view.
fn change_of(picture: &Picture, view: &Projector, scene: &Scene) -> Plane {
    TableModel::fit(picture, view, &scene.table).map_or_else(
        || Plane::zeros(picture.small[0].width, picture.small[0].height),
        |table| table.change(picture),
    )
}

/// Finds the scene's objects, standing on the table, in a picture of a calibrated camera.
///
/// One sighting per object, in the scene's order, whether found or not. Takes about a second per megapixel.
///
/// # Errors
///
/// [`Error::WrongSize`] when the picture is not the camera's size.
pub fn see(
    image: &RgbImage,
    camera: &Camera,
    scene: &Scene,
    options: &Options,
) -> Result<Vec<Sighting>, Error> {
    check_size(image, camera)?;
    let picture = Picture::new(image);
    let view = Projector::new(camera);
    let change = change_of(&picture, &view, scene);
    let [low, _, high, _] = scene.table.corners();
    let everywhere = Window { x: [low[0], high[0]], y: [low[1], high[1]] };
    let objects: Vec<&Object> = scene.objects.iter().collect();
    let bare = Hidden { mask: options.ignore.clone(), hulls: Vec::new() };
    let candidates: Vec<Vec<Candidate>> = objects
        .iter()
        .map(|object| {
            let window = options.windows.get(&object.name).copied().unwrap_or(everywhere);
            Evidence::new(&picture, &view, object, &change, bare.clone()).search(&window)
        })
        .collect();
    let chosen = assign(&objects, &candidates, 0.3);
    let best: Vec<Option<Candidate>> =
        chosen.iter().zip(&candidates).map(|(k, all)| k.map(|k| all[k])).collect();
    let eye = view.eye();
    let far = |c: &Candidate| (c.x - eye.x).hypot(c.y - eye.y);
    let sightings = (0..objects.len())
        .map(|i| {
            let mut hidden = bare.clone();
            if let Some(own) = best[i] {
                // What is believed to stand nearer to the camera covers what is behind it.
                for (j, other) in best.iter().enumerate() {
                    if let Some(other) = other
                        && j != i
                        && far(other) < far(&own)
                        && belief(&other.score) > FOUND
                    {
                        let view =
                            Evidence::new(&picture, &view, objects[j], &change, bare.clone());
                        hidden.hulls.push(view.outline(&other.pose(), 4).hull);
                    }
                }
            }
            let evidence = Evidence::new(&picture, &view, objects[i], &change, hidden);
            // Places taken by the other objects are no rivals.
            let rivals: Vec<Candidate> = candidates[i]
                .iter()
                .filter(|c| {
                    best.iter().enumerate().all(|(j, other)| {
                        j == i || other.is_none_or(|o| !overlap(objects[i], c, objects[j], &o))
                    })
                })
                .copied()
                .collect();
            judge(image, &picture, objects[i], &evidence, best[i], &rivals)
        })
        .collect();
    Ok(sightings)
}

/// Fits the chosen candidate once more with what is hidden left out, and says how sure it is.
fn judge(
    image: &RgbImage,
    picture: &Picture,
    object: &Object,
    evidence: &Evidence,
    best: Option<Candidate>,
    rivals: &[Candidate],
) -> Sighting {
    let mut sighting = Sighting {
        name: object.name.clone(),
        found: false,
        reason: None,
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
        mask_iou: None,
    };
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
    let best = if evidence.hidden.hulls.is_empty() { best } else { evidence.fit(&best) };
    let apart = (0.6 * object.shape.inner_radius()).max(0.02);
    let rival = rivals.iter().find(|c| c.distance(&best) > apart);
    let gap = rival.map_or(1.0, |r| 1.0 - r.score.total / best.score.total.max(1e-9));
    sighting.score = best.score;
    sighting.gap = gap;
    sighting.confidence = belief(&best.score) * (0.1 + gap / 0.1).clamp(0.0, 1.0);
    sighting.found = sighting.confidence >= FOUND;
    let outline = evidence.outline(&best.pose(), 12);
    let (w, h) = image.dimensions();
    let [u0, v0, u1, v1] = outline.bounds();
    sighting.bbox =
        [u0.max(0.0), v0.max(0.0), u1.min(f64::from(w) - 1.0), v1.min(f64::from(h) - 1.0)];
    if !sighting.found {
        sighting.reason = Some(match rival {
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
    sighting.world_from_object = Some(best.pose());
    if let Some(fit) = best.fit {
        let plane = fit.covariance.fixed_view::<2, 2>(0, 0).into_owned();
        sighting.std = plane.symmetric_eigenvalues().max().max(0.0).sqrt();
        sighting.yaw_std = fit.covariance[(2, 2)].max(0.0).sqrt();
    } else {
        // Not fitted below the scoring's own step: a few pixels' worth.
        sighting.std = 0.004;
        sighting.yaw_std = if object.shape.symmetry() > 0.0 { 0.03 } else { 0.0 };
    }
    let inside = |p: &Vector2<f64>| {
        p.x >= -0.5 && p.y >= -0.5 && p.x < f64::from(w) - 0.5 && p.y < f64::from(h) - 0.5
    };
    let shown = |p: &&Vector2<f64>| inside(p) && !evidence.hidden.covers(**p);
    sighting.key_points = outline.key_points.iter().filter(shown).map(|p| [p.x, p.y]).collect();
    sighting.hull = outline.hull.iter().map(|p| [p.x, p.y]).collect();
    let mut mask = GrayImage::new(w, h);
    for y in
        sighting.bbox[1].floor() as u32..=sighting.bbox[3].ceil().min(f64::from(h) - 1.0) as u32
    {
        for x in
            sighting.bbox[0].floor() as u32..=sighting.bbox[2].ceil().min(f64::from(w) - 1.0) as u32
        {
            let p = Vector2::new(f64::from(x), f64::from(y));
            if outline.contains(p) && !evidence.hidden.covers(p) {
                mask.put_pixel(x, y, Luma([255]));
            }
        }
    }
    // The picture's own cut is the better mask when it is smooth and agrees with the solid.
    if let Some(own) = cut(picture, sighting.bbox, |p| outline.contains(p)) {
        let (mut both, mut either) = (0.0, 0.0);
        for (a, b) in own.pixels().zip(mask.pixels()) {
            both += f64::from(u8::from(a.0[0] > 0 && b.0[0] > 0));
            either += f64::from(u8::from(a.0[0] > 0 || b.0[0] > 0));
        }
        let iou = both / f64::max(either, 1.0);
        sighting.mask_iou = Some(iou);
        if iou > 0.85 && Smoothness::of(&own).is_some_and(|s| s.is_smooth()) {
            mask = own;
        }
    }
    sighting.mask = Some(mask);
    sighting
}

/// Asks whether a picture supports an object at a pose, standing or held, anywhere in view.
///
/// `ignore` is non-zero where something else, such as the fingers, is in front.
///
/// # Errors
///
/// [`Error::WrongSize`] when the picture is not the camera's size.
pub fn verify(
    image: &RgbImage,
    camera: &Camera,
    scene: &Scene,
    object: &Object,
    world_from_object: &ObjectPose,
    ignore: Option<&GrayImage>,
) -> Result<Support, Error> {
    check_size(image, camera)?;
    let picture = Picture::new(image);
    let view = Projector::new(camera);
    let change = change_of(&picture, &view, scene);
    let hidden = Hidden { mask: ignore.cloned(), hulls: Vec::new() };
    let evidence = Evidence::new(&picture, &view, object, &change, hidden);
    let score = evidence.score(world_from_object, 0, 16);
    let outline = evidence.outline(world_from_object, 16);
    let (w, h) = picture.size();
    let looks: Vec<(Vector2<f64>, f64, f64)> = outline
        .samples
        .iter()
        .filter(|s| {
            s.kind == Kind::Silhouette
                && s.pixel.x > 2.0
                && s.pixel.y > 2.0
                && s.pixel.x < w as f64 - 3.0
                && s.pixel.y < h as f64 - 3.0
                && !evidence.hidden.covers(s.pixel)
        })
        .filter_map(|s| {
            let (offset, strength) = strongest(&picture, s.pixel, s.normal, (2.0, 8.0, false))?;
            Some((s.normal, offset, strength * s.length))
        })
        .collect();
    let mut shift = Vector2::zeros();
    let mut rms = 0.0;
    for _ in 0..8 {
        let mut off: Vec<f64> = looks.iter().map(|l| (l.1 - l.0.dot(&shift)).abs()).collect();
        let spread = (1.4826 * median(&mut off)).max(0.3);
        let (mut normal, mut rhs) = (nalgebra::Matrix2::identity() * 1e-6, Vector2::zeros());
        let (mut square, mut weight) = (0.0, 1e-9);
        for (n, offset, w) in &looks {
            let residual = offset - n.dot(&shift);
            let t = (residual / (4.0 * spread)).powi(2);
            if t < 1.0 {
                let w = w * (1.0 - t).powi(2);
                normal += w * n * n.transpose();
                rhs += w * n * residual;
                square += w * residual * residual;
                weight += w;
            }
        }
        if let Some(inverse) = normal.try_inverse() {
            shift += inverse * rhs;
        }
        rms = (square / weight).sqrt();
    }
    Ok(Support { score, confidence: belief(&score), shift_px: [shift.x, shift.y], rms_px: rms })
}

/// The answer of `camera see`, as `INTERFACES.md` fixes it.
#[derive(Debug, Clone, Serialize)]
pub struct Answer {
    /// One entry per object of the scene.
    pub objects: Vec<ObjectAnswer>,
}

/// One object in the answer of `camera see`.
#[derive(Debug, Clone, Serialize)]
pub struct ObjectAnswer {
    /// The object's name.
    pub name: String,
    /// Whether it is there.
    pub found: bool,
    /// Where its mask was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mask: Option<String>,
    /// `[u0, v0, u1, v1]`, px.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bbox_px: Option<[f64; 4]>,
    /// Key points, px.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub key_points_px: Option<Vec<[f64; 2]>>,
    /// Its pose.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub world_from_object: Option<ObjectPose>,
    /// One standard deviation of its position, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub std_m: Option<f64>,
    /// One standard deviation of its turn, rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub yaw_std_rad: Option<f64>,
    /// How sure, 0 to 1.
    pub confidence: f64,
    /// Why it is not found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

impl Answer {
    /// Words sightings as the answer; `mask_path` says where an object's mask was written, if it was.
    pub fn new(sightings: &[Sighting], mask_path: impl Fn(&Sighting) -> Option<String>) -> Self {
        let objects = sightings
            .iter()
            .map(|s| ObjectAnswer {
                name: s.name.clone(),
                found: s.found,
                mask: if s.found { mask_path(s) } else { None },
                bbox_px: s.found.then_some(s.bbox),
                key_points_px: s.found.then(|| s.key_points.clone()),
                world_from_object: s.world_from_object,
                std_m: s.found.then_some(s.std),
                yaw_std_rad: s.found.then_some(s.yaw_std),
                confidence: s.confidence,
                reason: s.reason.clone(),
            })
            .collect();
        Self { objects }
    }
}
