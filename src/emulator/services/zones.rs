//! What the service says and does of `zones`; what it keeps is in [`super::super::zones`].

use super::super::call::{Answer, Ask, done, say};
use super::super::controller::Controller;
use super::super::zones::{AHEAD, Place, Rule, Zone, check};
use crate::kortex::messages::base::ServoingMode;
use crate::kortex::messages::base::{ConfigurationChange, ConfigurationNotificationEvent};
use crate::kortex::messages::sequence::{
    ProtectionZone, ProtectionZoneHandle, ProtectionZoneList, ProtectionZoneNotification,
};
use crate::kortex::refusal;
use crate::kortex::rpc::base as call;
use ConfigurationNotificationEvent as Event;

impl Controller {
    /// Tells where the tool is beside the zones, and slows or stops what the base commands.
    pub(in crate::emulator) fn keep_zones(&mut self) {
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
    pub(in crate::emulator) fn zone_calls(&mut self, ask: &Ask<'_>) -> Option<Answer> {
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
