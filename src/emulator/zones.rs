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

use crate::execution::kortex::messages::base::ServoingMode;
use crate::execution::kortex::messages::base::{
    ConfigurationChange, ConfigurationNotificationEvent,
};
use crate::execution::kortex::messages::common::RotationMatrixRow;
use crate::execution::kortex::messages::sequence::{
    CartesianLimitation, ProtectionZone, ProtectionZoneEvent, ProtectionZoneHandle,
    ProtectionZoneList, ProtectionZoneNotification, ZoneShape,
};
use crate::execution::kortex::refusal;
use crate::execution::kortex::rpc::base as call;

use super::controller::{Answer, Ask, Controller, No, done, say};

use ConfigurationNotificationEvent as Event;

/// How far ahead of the tool zones are looked for, s of its motion: longer than it takes to brake.
const AHEAD: f64 = 0.25;
/// `Base.LimitationType`: a speed.
const VELOCITY: i32 = 3;

/// Where the tool is beside a zone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Place {
    #[default]
    Outside,
    Near,
    Inside,
}

#[derive(Debug, Clone)]
struct Zone {
    told: ProtectionZone,
    place: Place,
}

/// What the zones ask of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Rule {
    /// The tool moves no faster than this, m/s.
    Within(f64),
    /// It is about to enter where it must not.
    Stop,
}

/// The zones there are.
#[derive(Debug, Clone, Default)]
pub(super) struct Zones {
    stored: Vec<Zone>,
    last: u32,
}

impl Zones {
    fn at(&self, handle: Option<&ProtectionZoneHandle>) -> Result<usize, No> {
        let is = |zone: &Zone| {
            let own = zone.told.handle.as_ref().map(|own| own.identifier);
            own.is_some() && own == handle.map(|handle| handle.identifier)
        };
        let found = self.stored.iter().position(is);
        found.ok_or_else(|| No::device(refusal::ENTITY_NOT_FOUND, "protection zone not found"))
    }

    fn enabled(&self) -> impl Iterator<Item = &Zone> {
        self.stored.iter().filter(|zone| zone.told.is_enabled)
    }

    /// Returns what the zones ask of a tool that is at `here` and will soon be `ahead`, m in the base.
    fn rule(&self, here: &Vector3<f64>, ahead: &Vector3<f64>) -> Rule {
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
    fn watch(&mut self, here: &Vector3<f64>) -> Vec<(ProtectionZoneEvent, ProtectionZoneHandle)> {
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
fn speed(limitations: &[CartesianLimitation]) -> Option<f64> {
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
fn check(zone: &ProtectionZone) -> Result<(), No> {
    let wrong = |word: &str| No::device(refusal::INVALID_PARAM, word);
    let shape = zone.shape.as_ref().ok_or_else(|| wrong("no shape"))?;
    let needed = match shape.shape_type {
        1 => 2,
        2 => 1,
        3 => 3,
        _ => return Err(wrong("no shape")),
    };
    let sizes = &shape.dimensions;
    if sizes.len() < needed || !sizes.iter().all(|size| *size > 0.0 && size.is_finite()) {
        return Err(wrong("a size is missing or not positive"));
    }
    if let Some(rotation) = rotation(shape) {
        let off = (rotation * rotation.transpose() - Matrix3::identity()).amax();
        // Written as NaN-safe: what is no number is no rotation.
        if !(off < 1e-3 && rotation.determinant() > 0.0) {
            return Err(wrong("the orientation is no rotation"));
        }
    }
    Ok(())
}

impl Controller {
    /// Tells where the tool is beside the zones, and slows or stops what the base commands.
    pub(super) fn keep_zones(&mut self) {
        if self.zones.stored.is_empty() {
            return;
        }
        let here = self.tool().translation.vector;
        for (event, handle) in self.zones.watch(&here) {
            let told = ProtectionZoneNotification {
                event: event as i32,
                handle: Some(handle),
                timestamp: Some(self.timestamp()),
                user_handle: None,
                connection: None,
            };
            self.topics.tell(call::ON_PROTECTION_ZONE_TOPIC, &told);
        }
        let (now, soon) = self.servo.tool_ahead(AHEAD);
        match self.zones.rule(&now, &soon) {
            Rule::Within(speed) => self.servo.keep_tool_within(speed),
            Rule::Stop if self.mode == ServoingMode::SingleLevel && self.is_moving() => {
                self.stop_all(refusal::CONTROL_OUTSIDE_WORKSPACE);
            }
            Rule::Stop => {}
        }
    }

    /// The calls about protection zones; `None` for any other.
    pub(super) fn zone_calls(&mut self, ask: &Ask<'_>) -> Option<Answer> {
        Some(match ask.rpc {
            call::CREATE_PROTECTION_ZONE => ask.read().and_then(|mut zone: ProtectionZone| {
                check(&zone)?;
                self.zones.last += 1;
                let handle = ProtectionZoneHandle { identifier: self.zones.last, permission: 7 };
                zone.handle = Some(handle.clone());
                self.zones.stored.push(Zone { told: zone, place: Place::Outside });
                let change = ConfigurationChange::ProtectionZoneHandle(handle.clone());
                self.tell_change(ask, Event::Created, change);
                say(&handle)
            }),
            call::UPDATE_PROTECTION_ZONE => ask.read().and_then(|zone: ProtectionZone| {
                check(&zone)?;
                let at = self.zones.at(zone.handle.as_ref())?;
                let handle = zone.handle.clone().unwrap_or_default();
                self.zones.stored[at].told = zone;
                let change = ConfigurationChange::ProtectionZoneHandle(handle);
                self.tell_change(ask, Event::Updated, change);
                done()
            }),
            call::READ_PROTECTION_ZONE => ask.read().and_then(|handle| {
                let at = self.zones.at(Some(&handle))?;
                say(&self.zones.stored[at].told)
            }),
            call::DELETE_PROTECTION_ZONE => ask.read().and_then(|handle| {
                let at = self.zones.at(Some(&handle))?;
                self.zones.stored.remove(at);
                self.servo.keep_tool_within(f64::INFINITY);
                let change = ConfigurationChange::ProtectionZoneHandle(handle);
                self.tell_change(ask, Event::Deleted, change);
                done()
            }),
            call::READ_ALL_PROTECTION_ZONES => {
                let protection_zones = self.zones.stored.iter().map(|zone| zone.told.clone());
                say(&ProtectionZoneList { protection_zones: protection_zones.collect() })
            }
            _ => return None,
        })
    }
}
