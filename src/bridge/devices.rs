//! An arm, a camera and scales over one bridge.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::RgbImage;

use super::error::Error;
use super::link::Link;
use super::wire::{Aim, Hello, Step, Told};
use crate::alignment::decode;
use crate::arm::ticked::{Plant, Ticked};
use crate::arm::{Camera, DeviceError, Feedback, Scales, Weighing};

/// The connection, shared by its arm, camera and scales.
type SharedLink = Arc<Mutex<Link>>;

/// The arm behind a bridge.
pub type BridgeArm = Ticked<BridgePlant>;

/// A reality that answered.
pub struct Bridged {
    /// What it says of itself.
    pub hello: Hello,
    /// Its arm.
    pub arm: BridgeArm,
    /// Its camera, if it has one.
    pub camera: Option<BridgeCamera>,
    /// Its scales, if it has some.
    pub scales: Option<BridgeScales>,
}

/// Connects to the reality at `HOST:PORT`, which must have this robot with these joints. Nothing moves.
///
/// # Errors
///
/// [`Error`].
pub fn connect(place: &str, robot: &str, joints: &[&str]) -> Result<Bridged, Error> {
    let (mut link, hello) = Link::open(place, robot, joints)?;
    let told = link.feedback()?;
    let link = Arc::new(Mutex::new(link));
    let plant = BridgePlant {
        link: link.clone(),
        is_realtime: hello.realtime,
        began: told.t,
        told,
        next: Step::default(),
    };
    Ok(Bridged {
        arm: Ticked::new(plant),
        camera: hello.camera.map(|_| BridgeCamera(link.clone())),
        scales: hello.scales.then(|| BridgeScales(link)),
        hello,
    })
}

fn lock(link: &SharedLink) -> MutexGuard<'_, Link> {
    link.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The arm behind a bridge as something that is stepped.
pub struct BridgePlant {
    link: SharedLink,
    /// Whether its time passes by itself.
    is_realtime: bool,
    /// Its time when it was connected, s.
    began: f64,
    /// What was heard last.
    told: Told,
    /// What is sent with the next step.
    next: Step,
}

impl Plant for BridgePlant {
    fn command(&mut self, q: &[f64], dq: &[f64]) -> Result<(), DeviceError> {
        self.next.q = Some(q.to_vec());
        self.next.dq = Some(dq.to_vec());
        Ok(())
    }

    fn aim(&mut self, opening: f64, speed: f64, force: f64) -> Result<(), DeviceError> {
        self.next.grip = Some(Aim { opening, speed, force });
        Ok(())
    }

    fn advance(&mut self, seconds: f64) -> Result<(), DeviceError> {
        let step = Step { dt: seconds, ..std::mem::take(&mut self.next) };
        self.told = lock(&self.link).step(step)?;
        Ok(())
    }

    fn refresh(&mut self) -> Result<(), DeviceError> {
        if self.is_realtime {
            self.told = lock(&self.link).feedback()?;
        }
        Ok(())
    }

    fn report(&mut self) -> Feedback {
        Feedback {
            time: self.told.t - self.began,
            q_cmd: Vec::new(),
            q: self.told.q.clone(),
            dq: self.told.dq.clone(),
            tau: self.told.tau.clone(),
            opening: self.told.opening,
            mass: None,
        }
    }
}

/// The camera behind a bridge.
pub struct BridgeCamera(SharedLink);

impl Camera for BridgeCamera {
    fn photo(&mut self) -> Result<RgbImage, DeviceError> {
        let unreadable =
            |why: String| DeviceError::from(Error::Unreadable { request: "photo", why });
        let png = lock(&self.0).photo()?;
        let bytes = STANDARD.decode(png.trim()).map_err(|error| unreadable(error.to_string()))?;
        decode::decoded(&bytes).map_err(|error| unreadable(error.to_string()))
    }
}

/// The scales behind a bridge.
pub struct BridgeScales(SharedLink);

impl Scales for BridgeScales {
    fn weigh(&mut self) -> Option<Weighing> {
        lock(&self.0).scales().ok()
    }
}
