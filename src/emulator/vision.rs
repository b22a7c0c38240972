//! Service 5, `VisionConfig`: settings of the cameras in the wrist. They are kept and change no picture: the lab's
//! camera stands beside the table.
//!
//! Options and their ranges are those of the vendor's documentation of `VisionConfig.Option`; lenses and defaults
//! are chosen.

use std::collections::BTreeMap;

use crate::kortex::messages::common::{RotationMatrix, RotationMatrixRow};
use crate::kortex::messages::vision::{
    DistortionCoefficients, ExtrinsicParameters, IntrinsicParameters, OptionIdentifier,
    OptionValue, SensorFocusAction, SensorSettings, TranslationVector,
};

use super::error::Refused;

/// `Sensor`.
const COLOUR: i32 = 1;
const DEPTH: i32 = 2;
/// `VisionEvent`.
pub(super) const SETTINGS_CHANGED: i32 = 1;
pub(super) const OPTION_CHANGED: i32 = 2;
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
    pub(super) values: BTreeMap<(i32, i32), f32>,
    pub(super) lenses: BTreeMap<(i32, i32), IntrinsicParameters>,
    pub(super) extrinsics: ExtrinsicParameters,
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
pub(super) fn option(asked: &OptionIdentifier) -> Result<&'static Known, Refused> {
    let found = OPTIONS.iter().find(|known| (known.0, known.1) == (asked.sensor, asked.option));
    found.ok_or(Refused::NoOption)
}

impl Vision {
    pub(super) fn settings(&self, sensor: i32) -> Result<&SensorSettings, Refused> {
        self.settings.get(&sensor).ok_or(Refused::NoSensor)
    }

    pub(super) fn lens(
        &self,
        sensor: i32,
        resolution: i32,
    ) -> Result<&IntrinsicParameters, Refused> {
        self.lenses.get(&(sensor, resolution)).ok_or(Refused::NoResolution)
    }

    pub(super) fn set(&mut self, asked: SensorSettings) -> Result<(), Refused> {
        self.settings(asked.sensor)?;
        self.lens(asked.sensor, asked.resolution)?;
        self.settings.insert(asked.sensor, asked);
        Ok(())
    }

    pub(super) fn set_value(&mut self, asked: &OptionValue) -> Result<(), Refused> {
        let key = (asked.sensor, asked.option);
        let &(_, _, least, most, _, _, read_only) =
            option(&OptionIdentifier { sensor: key.0, option: key.1 })?;
        if read_only {
            return Err(Refused::ReadOnlyOption);
        }
        if asked.value > most {
            return Err(Refused::AboveMaximum);
        }
        if asked.value.is_nan() || asked.value < least {
            return Err(Refused::BelowMinimum);
        }
        self.values.insert(key, asked.value);
        Ok(())
    }
}

/// Says whether a lens can be focused so.
pub(super) fn focus(asked: &SensorFocusAction) -> Result<(), Refused> {
    if asked.sensor != COLOUR {
        return Err(Refused::OnlyColourFocused);
    }
    if !(1..=6).contains(&asked.focus_action) {
        return Err(Refused::NoFocus);
    }
    if asked.manual_focus.as_ref().is_some_and(|focus| focus.value > FURTHEST_FOCUS) {
        return Err(Refused::FocusTooFar);
    }
    Ok(())
}
