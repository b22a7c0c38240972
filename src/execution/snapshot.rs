//! A camera and scales behind a web address: any device that answers `GET` with a PNG or JPEG picture, or
//! with the scales' JSON. One request a photograph.

use image::RgbImage;

use crate::http::{Address, Client, Limits};

use super::arm::{Camera, DeviceError, Scales, Weighing};

/// A camera may think about a long exposure, but not for longer than this.
const LIMITS: Limits = Limits { connect_s: 5.0, reply_s: 60.0, longest: 64 << 20 };

fn get(address: &Address) -> Result<Vec<u8>, String> {
    let answer = Client::new(LIMITS, address).get(address, None).map_err(|e| e.to_string())?;
    match answer.status {
        200 => Ok(answer.body),
        other => Err(format!("it answers with status {other}")),
    }
}

/// A camera that answers with a picture.
#[derive(Debug, Clone)]
pub struct WebCamera(pub Address);

impl Camera for WebCamera {
    fn photo(&mut self) -> Result<RgbImage, DeviceError> {
        let failed = |why: String| DeviceError::Refused {
            what: format!("no picture from {}: {why}", self.0),
            help: "open the address in a browser: does it show the table?".to_owned(),
        };
        let bytes = get(&self.0).map_err(failed)?;
        let picture = image::load_from_memory(&bytes).map_err(|error| failed(error.to_string()))?;
        Ok(picture.to_rgb8())
    }
}

/// Scales that answer with a [`Weighing`] as JSON.
#[derive(Debug, Clone)]
pub struct WebScales(pub Address);

impl Scales for WebScales {
    fn weigh(&mut self) -> Option<Weighing> {
        serde_json::from_slice(&get(&self.0).ok()?).ok()
    }
}
