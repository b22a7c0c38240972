//! Protection zones: kept, told when the tool reaches, enters or leaves them, and kept out of.
//!
//! The tool may not enter a zone that sets no speed for its inside; in the envelope around a zone it keeps to
//! the envelope's speed. The base keeps to zones in what it commands itself, not in low-level servoing. How an
//! arm brakes before one is not published: here it comes to rest in time, and a running action is given up as
//! outside the workspace. Only the tool's own point counts, no elbow; a zone's origin is its centre, and a
//! cylinder stands along its z axis.
//!
//! Source: Kinova, *Gen3 User Guide*, "Protection zone" (prevented from entering, or limited in speed).

use nalgebra::{Matrix3, Vector3};

use crate::kortex::messages::common::RotationMatrixRow;
use crate::kortex::messages::sequence::{
    CartesianLimitation, ProtectionZone, ProtectionZoneEvent, ProtectionZoneHandle, ZoneShape,
};

use super::error::Refused;

/// How far ahead of the tool zones are looked for, s of its motion: longer than it takes to brake.
pub(super) const AHEAD: f64 = 0.25;
/// `Base.LimitationType`: a speed.
const VELOCITY: i32 = 3;

/// Where the tool is beside a zone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Place {
    #[default]
    Outside,
    Near,
    Inside,
}

#[derive(Debug, Clone)]
pub(super) struct Zone {
    pub(super) told: ProtectionZone,
    pub(super) place: Place,
}

/// What the zones ask of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Rule {
    /// The tool moves no faster than this, m/s.
    Within(f64),
    /// It is about to enter where it must not.
    Stop,
}

/// The zones there are.
#[derive(Debug, Clone, Default)]
pub(super) struct Zones {
    pub(super) stored: Vec<Zone>,
    pub(super) last: u32,
}

impl Zones {
    pub(super) fn at(&self, handle: Option<&ProtectionZoneHandle>) -> Result<usize, Refused> {
        let is = |zone: &Zone| {
            let own = zone.told.handle.as_ref().map(|own| own.identifier);
            own.is_some() && own == handle.map(|handle| handle.identifier)
        };
        let found = self.stored.iter().position(is);
        found.ok_or(Refused::NoZone)
    }

    fn enabled(&self) -> impl Iterator<Item = &Zone> {
        self.stored.iter().filter(|zone| zone.told.is_enabled)
    }

    /// Returns what the zones ask of a tool that is at `here` and will soon be `ahead`, m in the base.
    pub(super) fn rule(&self, here: &Vector3<f64>, ahead: &Vector3<f64>) -> Rule {
        let mut most = f64::INFINITY;
        for zone in self.enabled() {
            let Some(shape) = &zone.told.shape else { continue };
            let (now, soon) = (distance(shape, here), distance(shape, ahead));
            let nearest = now.min(soon);
            let inside = speed(&zone.told.limitations);
            if nearest < 0.0 {
                match inside {
                    Some(limit) => most = most.min(limit),
                    // One that is inside already may leave.
                    None if soon < now - 1e-6 => return Rule::Stop,
                    None => {}
                }
            }
            if nearest < f64::from(shape.envelope_thickness)
                && let Some(limit) = speed(&zone.told.envelope_limitations)
            {
                most = most.min(limit);
            }
        }
        Rule::Within(most)
    }

    /// Notes where the tool is, m in the base; returns what is new.
    pub(super) fn watch(
        &mut self,
        here: &Vector3<f64>,
    ) -> Vec<(ProtectionZoneEvent, ProtectionZoneHandle)> {
        let mut news = Vec::new();
        for zone in &mut self.stored {
            let Some(shape) = zone.told.shape.as_ref().filter(|_| zone.told.is_enabled) else {
                zone.place = Place::Outside;
                continue;
            };
            let far = distance(shape, here);
            let place = match far {
                far if far < 0.0 => Place::Inside,
                far if far < f64::from(shape.envelope_thickness) => Place::Near,
                _ => Place::Outside,
            };
            let event = match (zone.place, place) {
                (before, now) if before == now => continue,
                (_, Place::Inside) => ProtectionZoneEvent::Entered,
                (Place::Outside, Place::Near) => ProtectionZoneEvent::Reached,
                (Place::Inside, Place::Near) | (_, Place::Outside) => ProtectionZoneEvent::Exited,
                (Place::Near, Place::Near) => continue,
            };
            zone.place = place;
            news.extend(zone.told.handle.clone().map(|handle| (event, handle)));
        }
        news
    }
}

/// Returns the speed that limitations allow the tool, m/s, if they speak of speed.
pub(super) fn speed(limitations: &[CartesianLimitation]) -> Option<f64> {
    let limits = limitations.iter().filter(|limit| limit.r#type == VELOCITY);
    limits.map(|limit| f64::from(limit.translation)).reduce(f64::min)
}

/// Returns how far a point of the base is outside a shape, m; negative inside.
fn distance(shape: &ZoneShape, point: &Vector3<f64>) -> f64 {
    let origin = shape.origin.clone().unwrap_or_default();
    let from = point - Vector3::new(origin.x, origin.y, origin.z).map(f64::from);
    let local = rotation(shape).map_or(from, |rotation| rotation.transpose() * from);
    let size = |i: usize| f64::from(shape.dimensions[i]);
    match shape.shape_type {
        1 => {
            let out = (local.xy().norm() - size(0), local.z.abs() - size(1) / 2.0);
            box_distance(&[out.0, out.1])
        }
        2 => local.norm() - size(0),
        _ => {
            let out = [0, 1, 2].map(|i| local[i].abs() - size(i) / 2.0);
            box_distance(&out)
        }
    }
}

/// Returns the distance of a point from a box by how far it is outside along each axis.
fn box_distance(out: &[f64]) -> f64 {
    let outside = out.iter().map(|d| d.max(0.0).powi(2)).sum::<f64>().sqrt();
    let inside = out.iter().fold(f64::NEG_INFINITY, |most, &d| most.max(d));
    if inside > 0.0 { outside } else { inside }
}

/// Returns how a shape is turned in the base, if it says so.
fn rotation(shape: &ZoneShape) -> Option<Matrix3<f64>> {
    let told = shape.orientation.as_ref()?;
    let row = |row: &Option<RotationMatrixRow>| {
        let row = row.as_ref()?;
        Some([row.column1, row.column2, row.column3].map(f64::from))
    };
    let rows = [row(&told.row1)?, row(&told.row2)?, row(&told.row3)?];
    Some(Matrix3::from_row_iterator(rows.into_iter().flatten()))
}

/// Says no to a zone whose shape has not the sizes it needs, or is turned by no rotation.
pub(super) fn check(zone: &ProtectionZone) -> Result<(), Refused> {
    let shape = zone.shape.as_ref().ok_or(Refused::NoShape)?;
    let needed = match shape.shape_type {
        1 => 2,
        2 => 1,
        3 => 3,
        _ => return Err(Refused::NoShape),
    };
    let sizes = &shape.dimensions;
    if sizes.len() < needed || !sizes.iter().all(|size| *size > 0.0 && size.is_finite()) {
        return Err(Refused::NoSize);
    }
    if let Some(rotation) = rotation(shape) {
        let off = (rotation * rotation.transpose() - Matrix3::identity()).amax();
        // Written as NaN-safe: what is no number is no rotation.
        if !(off < 1e-3 && rotation.determinant() > 0.0) {
            return Err(Refused::NoRotation);
        }
    }
    Ok(())
}
