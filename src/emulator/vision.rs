//! Service 5, `VisionConfig`: settings of the cameras in the wrist. They are kept and change no picture: the lab's
//! camera stands beside the table.
//!
//! Options and their ranges are those of the vendor's documentation of `VisionConfig.Option`; lenses and defaults
//! are chosen.

use std::collections::BTreeMap;

use crate::execution::kortex::messages::common::{DeviceType, NotificationHandle};
use crate::execution::kortex::messages::common::{RotationMatrix, RotationMatrixRow};
use crate::execution::kortex::messages::vision::{
    DistortionCoefficients, ExtrinsicParameters, IntrinsicParameters, IntrinsicProfileIdentifier,
    OptionIdentifier, OptionInformation, OptionValue, SensorFocusAction, SensorIdentifier,
    SensorSettings, TranslationVector, VisionNotification,
};
use crate::execution::kortex::refusal;
use crate::execution::kortex::rpc::vision_config as call;

use super::controller::{Answer, Ask, Controller, No, done, say};

/// `Sensor`.
const COLOUR: i32 = 1;
const DEPTH: i32 = 2;
/// `VisionEvent`.
const SETTINGS_CHANGED: i32 = 1;
const OPTION_CHANGED: i32 = 2;
/// The largest manual focus, by the vendor's example.
const FURTHEST_FOCUS: u32 = 1023;

/// An option: sensor, number, least, most, step, default, whether it is only read.
type Known = (i32, i32, f32, f32, f32, f32, bool);

/// The options there are.
const OPTIONS: &[Known] = &[
    (COLOUR, 2, -4.0, 4.0, 1.0, 0.0, false),
    (COLOUR, 3, -4.0, 4.0, 1.0, 0.0, false),
    (COLOUR, 8, -4.0, 4.0, 1.0, 0.0, false),
    (DEPTH, 4, 20.0, 166_000.0, 20.0, 33_000.0, false),
    (DEPTH, 5, 16.0, 248.0, 1.0, 16.0, false),
    (DEPTH, 11, 0.0, 1.0, 1.0, 1.0, false),
    (DEPTH, 13, 0.0, 5.0, 1.0, 0.0, false),
    (DEPTH, 20, 0.0, 32.0, 1.0, 16.0, false),
    (DEPTH, 24, -40.0, 125.0, 0.0, 35.0, true),
    (DEPTH, 25, 0.0, 1.0, 1.0, 1.0, false),
    (DEPTH, 27, 0.0, 1.0, 1.0, 0.0, false),
    (DEPTH, 29, 0.0001, 0.01, 0.000_001, 0.001, false),
    (DEPTH, 41, 55.241_055, 55.241_055, 0.0, 55.241_055, true),
];

/// Sensor, `Resolution`, width and height in pixels.
const RESOLUTIONS: &[(i32, i32, f32, f32)] = &[
    (COLOUR, 1, 320.0, 240.0),
    (COLOUR, 4, 640.0, 480.0),
    (COLOUR, 5, 1280.0, 720.0),
    (COLOUR, 6, 1920.0, 1080.0),
    (DEPTH, 2, 424.0, 240.0),
    (DEPTH, 3, 480.0, 270.0),
];

/// What is set of the cameras.
#[derive(Debug, Clone)]
pub(super) struct Vision {
    settings: BTreeMap<i32, SensorSettings>,
    values: BTreeMap<(i32, i32), f32>,
    lenses: BTreeMap<(i32, i32), IntrinsicParameters>,
    extrinsics: ExtrinsicParameters,
}

impl Default for Vision {
    fn default() -> Self {
        let of = |sensor, resolution| SensorSettings {
            sensor,
            resolution,
            frame_rate: 3,
            bit_rate: i32::from(sensor == COLOUR),
        };
        let lens = |&(sensor, resolution, width, height): &(i32, i32, f32, f32)| {
            // The colour camera sees about 53 deg across, the depth camera 68 deg.
            let focal = width * if sensor == COLOUR { 1.0 } else { 0.75 };
            let lens = IntrinsicParameters {
                sensor,
                resolution,
                principal_point_x: width / 2.0,
                principal_point_y: height / 2.0,
                focal_length_x: focal,
                focal_length_y: focal,
                distortion_coeffs: Some(DistortionCoefficients::default()),
            };
            ((sensor, resolution), lens)
        };
        let row = |column1, column2, column3| Some(RotationMatrixRow { column1, column2, column3 });
        Self {
            settings: [(COLOUR, of(COLOUR, 5)), (DEPTH, of(DEPTH, 3))].into(),
            values: OPTIONS.iter().map(|known| ((known.0, known.1), known.5)).collect(),
            lenses: RESOLUTIONS.iter().map(lens).collect(),
            extrinsics: ExtrinsicParameters {
                rotation: Some(RotationMatrix {
                    row1: row(1.0, 0.0, 0.0),
                    row2: row(0.0, 1.0, 0.0),
                    row3: row(0.0, 0.0, 1.0),
                }),
                translation: Some(TranslationVector { t_x: -0.0195, t_y: -0.005, t_z: 0.0 }),
            },
        }
    }
}

/// Returns what is known of an option.
fn option(asked: &OptionIdentifier) -> Result<&'static Known, No> {
    let found = OPTIONS.iter().find(|known| (known.0, known.1) == (asked.sensor, asked.option));
    found.ok_or_else(|| No::device(refusal::UNSUPPORTED_OPTION, "this sensor has no such option"))
}

impl Vision {
    fn settings(&self, sensor: i32) -> Result<&SensorSettings, No> {
        let none = || No::device(refusal::INVALID_PARAM, "sensors are 1, colour, and 2, depth");
        self.settings.get(&sensor).ok_or_else(none)
    }

    fn lens(&self, sensor: i32, resolution: i32) -> Result<&IntrinsicParameters, No> {
        let none = || No::device(refusal::UNSUPPORTED_RESOLUTION, "not of this sensor");
        self.lenses.get(&(sensor, resolution)).ok_or_else(none)
    }

    fn set(&mut self, asked: SensorSettings) -> Result<(), No> {
        self.settings(asked.sensor)?;
        self.lens(asked.sensor, asked.resolution)?;
        self.settings.insert(asked.sensor, asked);
        Ok(())
    }

    fn set_value(&mut self, asked: &OptionValue) -> Result<(), No> {
        let key = (asked.sensor, asked.option);
        let &(_, _, least, most, _, _, read_only) =
            option(&OptionIdentifier { sensor: key.0, option: key.1 })?;
        if read_only {
            return Err(No::device(refusal::UNSUPPORTED_OPTION, "this option is only read"));
        }
        if asked.value > most {
            return Err(No::device(refusal::VALUE_IS_ABOVE_MAXIMUM, "above its maximum"));
        }
        if asked.value.is_nan() || asked.value < least {
            return Err(No::device(refusal::VALUE_IS_BELOW_MINIMUM, "below its minimum"));
        }
        self.values.insert(key, asked.value);
        Ok(())
    }
}

/// Says whether a lens can be focused so.
fn focus(asked: &SensorFocusAction) -> Result<(), No> {
    if asked.sensor != COLOUR {
        return Err(No::device(refusal::UNSUPPORTED_FOCUS_ACTION, "only colour is focused"));
    }
    if !(1..=6).contains(&asked.focus_action) {
        return Err(No::device(refusal::UNSUPPORTED_FOCUS_ACTION, "no such action"));
    }
    if asked.manual_focus.as_ref().is_some_and(|focus| focus.value > FURTHEST_FOCUS) {
        return Err(No::device(refusal::VALUE_IS_ABOVE_MAXIMUM, "focus is 0 to 1023"));
    }
    Ok(())
}

impl Controller {
    pub(super) fn vision_service(&mut self, ask: &Ask<'_>) -> Answer {
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
            _ => Err(No::protocol(refusal::UNSUPPORTED_METHOD, "not emulated")),
        }
    }

    fn tell_vision(&mut self, event: i32, sensor: i32, option: i32) {
        let told = VisionNotification { event, sensor, option };
        self.topics.tell(call::ON_VISION_TOPIC, &told);
    }
}
