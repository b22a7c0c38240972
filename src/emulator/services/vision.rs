//! What the service says and does of `vision`; what it keeps is in [`super::super::vision`].

use super::super::call::{Answer, Ask, done, say};
use super::super::controller::Controller;
use super::super::error::Refused;
use super::super::vision::{OPTION_CHANGED, SETTINGS_CHANGED, focus, option};
use crate::kortex::messages::common::{DeviceType, NotificationHandle};
use crate::kortex::messages::vision::{
    IntrinsicParameters, IntrinsicProfileIdentifier, OptionIdentifier, OptionInformation,
    OptionValue, SensorIdentifier, SensorSettings, VisionNotification,
};
use crate::kortex::rpc::vision_config as call;

impl Controller {
    pub(in crate::emulator) fn vision_service(&mut self, ask: &Ask<'_>) -> Answer {
        self.config.must_be(ask.device, DeviceType::Vision)?;
        let vision = &mut self.vision;
        match ask.rpc {
            call::GET_SENSOR_SETTINGS => {
                let SensorIdentifier { sensor } = ask.read()?;
                say(vision.settings(sensor)?)
            }
            call::SET_SENSOR_SETTINGS => {
                let asked: SensorSettings = ask.read()?;
                let sensor = asked.sensor;
                vision.set(asked)?;
                self.tell_vision(SETTINGS_CHANGED, sensor, 0);
                done()
            }
            call::GET_OPTION_VALUE => {
                let asked: OptionIdentifier = ask.read()?;
                option(&asked)?;
                let OptionIdentifier { sensor, option } = asked;
                let value = vision.values.get(&(sensor, option)).copied().unwrap_or_default();
                say(&OptionValue { sensor, option, value })
            }
            call::SET_OPTION_VALUE => {
                let asked: OptionValue = ask.read()?;
                vision.set_value(&asked)?;
                self.tell_vision(OPTION_CHANGED, asked.sensor, asked.option);
                done()
            }
            call::GET_OPTION_INFORMATION => {
                let asked: OptionIdentifier = ask.read()?;
                let known = option(&asked).ok();
                let OptionIdentifier { sensor, option } = asked;
                let none = OptionInformation { sensor, option, ..OptionInformation::default() };
                say(&known.map_or(
                    none,
                    |&(_, _, minimum, maximum, step, default_value, read_only)| OptionInformation {
                        sensor,
                        option,
                        supported: true,
                        read_only,
                        minimum,
                        maximum,
                        step,
                        default_value,
                    },
                ))
            }
            call::DO_SENSOR_FOCUS_ACTION => {
                focus(&ask.read()?)?;
                done()
            }
            call::GET_INTRINSIC_PARAMETERS => {
                let SensorIdentifier { sensor } = ask.read()?;
                say(vision.lens(sensor, vision.settings(sensor)?.resolution)?)
            }
            call::GET_INTRINSIC_PARAMETERS_PROFILE => {
                let IntrinsicProfileIdentifier { sensor, resolution } = ask.read()?;
                say(vision.lens(sensor, resolution)?)
            }
            call::SET_INTRINSIC_PARAMETERS => {
                let asked: IntrinsicParameters = ask.read()?;
                vision.lens(asked.sensor, asked.resolution)?;
                vision.lenses.insert((asked.sensor, asked.resolution), asked);
                done()
            }
            call::GET_EXTRINSIC_PARAMETERS => say(&vision.extrinsics),
            call::SET_EXTRINSIC_PARAMETERS => {
                vision.extrinsics = ask.read()?;
                done()
            }
            topic @ call::ON_VISION_TOPIC => say(&NotificationHandle {
                identifier: self.topics.subscribe(ask.session, ask.peer, topic),
            }),
            _ => Err(Refused::NotEmulated),
        }
    }

    fn tell_vision(&mut self, event: i32, sensor: i32, option: i32) {
        let told = VisionNotification { event, sensor, option };
        self.topics.tell(call::ON_VISION_TOPIC, &told);
    }
}
