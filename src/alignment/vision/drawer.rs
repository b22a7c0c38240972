//! How far a drawer is drawn, as the picture shows it: where its case was found, which way its front is, and up to where
//! the colour of its tray reaches.
//!
//! Every place along the rail is a silhouette of tray, bar and posts beside that of the case. A pixel of it speaks for the
//! tray when its colour is nearer to the tray's than to the bare table's beside it, and against it otherwise; the place with the
//! most in its favour is where the tray is, and the stretch of places that are hardly worse is how well that is known. A tray in
//! the colour of the table cannot be told, and is not found. Nothing that moved the tray is asked.

use std::f64::consts::{FRAC_PI_2, PI};

use image::GrayImage;
use nalgebra::{Isometry3, UnitQuaternion, Vector2, Vector3};

use super::wording;
use super::{MaskIs, Sighting};
use crate::alignment::outline::{ObjectPose, Outline, Projector};
use crate::alignment::picture::{Picture, lab};
use crate::alignment::segment::TableModel;
use crate::world::{Drawer, Object, Pose, Scene, Shape};

/// Places along the rail that are looked at, m apart: 4 px of a table that is a metre away.
const STEP: f64 = 0.004;
/// Pixels that are asked are so many apart, along u and v.
const APART: usize = 2;
/// So much worse than the best, in units of log-likelihood, is within two standard deviations.
const TWO_SIGMA: f64 = 2.0;
/// What a pixel counts when its colour is the tray's, or the table's, in that unit. Chosen: neighbours are not independent, and
/// the light changes along an edge; with four times as much a shadow decides, with a quarter of it a closed drawer of which only
/// the end of the bar is seen behind its case (some 100 px in the laboratory) is not told from none.
const COUNTS: f64 = 0.5;
/// From this share of its visible pixels on that have its colour a tray is there. Chosen: what stands in it hides a part; of a
/// wrong place half are table.
const SHARE: f64 = 0.6;
/// A hue in the shade is as pale as this share of what it is in the light, and in a strong light stronger by the other. Measured
/// in the laboratory: the inside of a tray that looks away from the lamp has 0.4 of its front's.
const PALEST: f64 = 0.25;
const STRONGEST: f64 = 1.3;
/// What two colours may differ by and be the same, CIELAB: twice the noise of a pixel.
const UNSURE: f64 = 2.0;
/// The least a place is known to, m: three quarters of a step.
const LEAST_STD: f64 = 0.003;
/// Points on each edge of a silhouette.
const PER_EDGE: usize = 4;

/// What the picture says of one drawer.
pub(super) struct Drawn {
    /// Where the case is, with its front told from its back.
    pub(super) case: ObjectPose,
    /// What is to be said of the tray.
    pub(super) tray: Sighting,
}

/// What a picture is asked with.
pub(super) struct Looking<'a> {
    pub(super) picture: &'a Picture,
    pub(super) view: &'a Projector,
    pub(super) table: &'a TableModel,
    pub(super) scene: &'a Scene,
    pub(super) ignore: Option<&'a GrayImage>,
}

/// A place along the rail with what speaks for it.
struct Place {
    case: ObjectPose,
    drawn: f64,
    worth: f64,
    seen: usize,
    its_colour: usize,
}

impl Looking<'_> {
    /// Says where the tray of a drawer is whose case was sighted; as not found where the case is not, or nothing tells.
    pub(super) fn drawn(&self, drawer: &Drawer, case: &Sighting) -> Option<Drawn> {
        let tray = self.scene.object(&drawer.tray)?;
        let around = self.scene.object(&drawer.case)?;
        let Some(at) = case.world_from_object.filter(|_| case.found) else {
            let lost = lost(case, tray, wording::no_case(&drawer.case));
            return Some(Drawn { case: case.likeliest?, tray: lost });
        };
        let sides: &[f64] = match around.shape {
            Shape::Cuboid { size } if (size.x - size.y).abs() < 1e-6 => {
                &[0.0, PI, FRAC_PI_2, -FRAC_PI_2]
            }
            _ => &[0.0, PI],
        };
        let steps = (drawer.travel / STEP).round().max(1.0) as usize;
        let places: Vec<Place> = sides
            .iter()
            .flat_map(|side| {
                let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), *side);
                let case =
                    Pose::new(at.isometry() * Isometry3::from_parts(Vector3::zeros().into(), turn));
                (0..=steps).map(move |k| (case, drawer.travel * k as f64 / steps as f64))
            })
            .filter_map(|(case, drawn)| self.place(drawer, tray, around, case, drawn))
            .collect();
        let best = places.iter().max_by(|a, b| a.worth.total_cmp(&b.worth))?;
        let same = |place: &&Place| (place.case.yaw() - best.case.yaw()).cos() > 0.5;
        let near: Vec<f64> = places
            .iter()
            .filter(same)
            .filter(|place| place.worth > best.worth - TWO_SIGMA)
            .map(|place| place.drawn)
            .collect();
        let (low, high) = near
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)));
        // Half of what is within two standard deviations on each side.
        let std = (0.25 * (high - low)).hypot(LEAST_STD);
        let other = places.iter().filter(|place| !same(place)).map(|place| place.worth);
        let front_is_known = other.fold(f64::NEG_INFINITY, f64::max) < best.worth - TWO_SIGMA;
        let its_own = best.its_colour as f64 >= SHARE * best.seen as f64;
        let pose = drawer.tray_at(self.scene, &best.case, best.drawn)?;
        let found = front_is_known && its_own && std < 0.25 * drawer.travel;
        let tray = if found {
            self.found(case, tray, pose, std)
        } else {
            lost(case, tray, wording::no_front(&drawer.tray))
        };
        Some(Drawn { case: best.case, tray })
    }

    /// Weighs one place of the tray.
    fn place(
        &self,
        drawer: &Drawer,
        tray: &Object,
        around: &Object,
        case: ObjectPose,
        drawn: f64,
    ) -> Option<Place> {
        let pose = drawer.tray_at(self.scene, &case, drawn)?;
        let hidden = Outline::new(self.view, &around.shape, &case, PER_EDGE);
        let parts =
            std::iter::once((Vector3::zeros(), tray.shape.clone())).chain(drawer.handle(tray));
        let shown: Vec<Outline> = parts
            .map(|(at, shape)| {
                let pose = Pose::new(pose.isometry() * Isometry3::from(at));
                Outline::new(self.view, &shape, &pose, PER_EDGE)
            })
            .collect();
        let [mut u0, mut v0, mut u1, mut v1] = shown[0].bounds();
        for part in &shown[1..] {
            let [a, b, c, d] = part.bounds();
            (u0, v0, u1, v1) = (u0.min(a), v0.min(b), u1.max(c), v1.max(d));
        }
        let own = lab(tray.colour).map(f64::from);
        let (width, height) = self.picture.size();
        let inside = |x: f64, most: usize| x.clamp(0.0, most as f64 - 1.0) as usize;
        let mut place = Place { case, drawn, worth: 0.0, seen: 0, its_colour: 0 };
        for v in (inside(v0, height)..=inside(v1, height)).step_by(APART) {
            for u in (inside(u0, width)..=inside(u1, width)).step_by(APART) {
                let p = Vector2::new(u as f64, v as f64);
                if !shown.iter().any(|part| part.contains(p)) || hidden.contains(p) {
                    continue;
                }
                let ignored = self.ignore.is_some_and(|mask| {
                    let (u, v) = (u as u32, v as u32);
                    u < mask.width() && v < mask.height() && mask.get_pixel(u, v)[0] > 0
                });
                if ignored {
                    continue;
                }
                let odds = self.likeness(p, &own);
                place.worth += COUNTS * (odds - 0.5);
                place.seen += 1;
                place.its_colour += usize::from(odds > 0.5);
            }
        }
        Some(place)
    }

    /// How much nearer the hue of a pixel is to a colour than to the table's there, 0 to 1.
    ///
    /// Lightness is left out, and how strong a hue is counts for little: a shadow darkens tray and table and pales both, and leaves
    /// their hues.
    fn likeness(&self, p: Vector2<f64>, own: &[f64; 3]) -> f64 {
        let shown = self.picture.lab_at(p.x, p.y);
        let table = self.table.colour((p.x - 1.5) / 4.0, (p.y - 1.5) / 4.0);
        let shown = Vector2::new(f64::from(shown[1]), f64::from(shown[2]));
        let far = |from: &[f64; 3]| {
            let full = Vector2::new(from[1], from[2]);
            let share = shown.dot(&full) / full.norm_squared().max(1e-9);
            (shown - full * share.clamp(PALEST, STRONGEST)).norm() + UNSURE
        };
        let (to_own, to_table) = (far(own), far(&table));
        to_table / (to_own + to_table)
    }

    fn found(&self, case: &Sighting, tray: &Object, pose: ObjectPose, std: f64) -> Sighting {
        let outline = Outline::new(self.view, &tray.shape, &pose, PER_EDGE);
        Sighting {
            name: tray.name.clone(),
            found: true,
            reason: None,
            ambiguous: case.ambiguous.clone(),
            world_from_object: Some(pose),
            likeliest: Some(pose),
            std: case.std.hypot(std),
            std_if_there: case.std.hypot(std),
            bbox: outline.bounds(),
            key_points: outline.key_points.iter().map(|p| [p.x, p.y]).collect(),
            hull: outline.hull.iter().map(|p| [p.x, p.y]).collect(),
            mask: None,
            mask_is: MaskIs::Silhouette,
            ..case.clone()
        }
    }
}

fn lost(case: &Sighting, tray: &Object, reason: String) -> Sighting {
    Sighting {
        name: tray.name.clone(),
        found: false,
        reason: Some(reason),
        world_from_object: None,
        likeliest: None,
        std: f64::INFINITY,
        confidence: 0.0,
        hull: Vec::new(),
        key_points: Vec::new(),
        mask: None,
        mask_is: MaskIs::Silhouette,
        ..case.clone()
    }
}
