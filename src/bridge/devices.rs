//! An arm, a camera and scales over one bridge.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::RgbImage;

use super::check::Wanted;
use super::error::Error;
use super::link::Link;
use super::wire::{Aim, Hello, Size, Step, Told};
use crate::alignment::decode;
use crate::arm::ticked::{Brake, Plant, Ticked};
use crate::arm::{Camera, Cancel, DeviceError, Feedback, Film, Scales, SmallShot, Weighing};

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

/// Connects to the reality at `HOST:PORT`, which must have this robot. Nothing moves. What is asked later is given up when `cancel` says so.
///
/// # Errors
///
/// [`Error`].
pub fn connect(place: &str, wanted: Wanted, cancel: Cancel) -> Result<Bridged, Error> {
    let brakes = wanted.joints.iter().map(|joint| Brake {
        range: joint.range,
        acceleration: joint.acceleration,
        jerk: joint.jerk,
    });
    let brakes = brakes.collect();
    let (mut link, hello) = Link::open(place, wanted, cancel)?;
    let told = link.feedback()?;
    let link = Arc::new(Mutex::new(link));
    let plant = BridgePlant {
        link: link.clone(),
        is_realtime: hello.realtime,
        began: told.t,
        told,
        is_old: false,
        next: Step::default(),
    };
    Ok(Bridged {
        arm: Ticked::new(plant, brakes),
        camera: hello.camera.map(|size| BridgeCamera {
            link: link.clone(),
            size,
            is_realtime: hello.realtime,
        }),
        scales: hello.scales.then(|| BridgeScales(link)),
        hello,
    })
}

fn lock(link: &SharedLink) -> MutexGuard<'_, Link> {
    link.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A joint behind a bridge that stays farther than this from its command is stuck, or its encoder is, rad. Chosen: twice what the
/// controller of a Gen3 bears (5 deg), since nothing is known of a server's servos. One in MuJoCo lagged by 0.3 deg.
const MOST_BEHIND: f64 = 0.2;

/// How long a server's fingers may take to begin to move, s. Chosen: drivers of grippers answer in some tenths.
const FINGERS_BEGIN: f64 = 1.0;

/// The arm behind a bridge as something that is stepped.
pub struct BridgePlant {
    link: SharedLink,
    /// Whether its time passes by itself.
    is_realtime: bool,
    /// Its time when it was connected, s.
    began: f64,
    /// What was heard last.
    told: Told,
    /// Whether something may have happened since that was not heard.
    is_old: bool,
    /// What is sent with the next step.
    next: Step,
}

impl BridgePlant {
    /// Asks something that is answered with how the arm is.
    fn hears(
        &mut self,
        asks: impl FnOnce(&mut Link) -> Result<Told, Error>,
    ) -> Result<(), DeviceError> {
        let told = asks(&mut lock(&self.link));
        self.is_old = told.is_err();
        self.told = told?;
        Ok(())
    }
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
        self.hears(|link| link.step(step))
    }

    fn refresh(&mut self) -> Result<(), DeviceError> {
        // A line that is lost has said so; where the arm was last is all that is known.
        if self.is_lost() || !(self.is_realtime || self.is_old) {
            return Ok(());
        }
        self.hears(Link::feedback)
    }

    fn hold(&mut self) -> Result<bool, DeviceError> {
        self.hears(Link::stop)?;
        Ok(true)
    }

    fn is_lost(&self) -> bool {
        lock(&self.link).is_lost()
    }

    fn owes_stop(&self) -> bool {
        lock(&self.link).owes_stop()
    }

    fn is_led_to_rest(&self) -> bool {
        lock(&self.link).is_led_to_rest()
    }

    fn fingers_begin_within(&self) -> f64 {
        FINGERS_BEGIN
    }

    fn most_behind(&self) -> Option<f64> {
        Some(MOST_BEHIND)
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
            moving: self.told.moving.clone(),
        }
    }
}

/// The camera behind a bridge.
pub struct BridgeCamera {
    link: SharedLink,
    /// What its pictures are to have.
    size: Size,
    is_realtime: bool,
}

impl Camera for BridgeCamera {
    fn photo(&mut self) -> Result<RgbImage, DeviceError> {
        let png = lock(&self.link).photo()?;
        let image = decoded(&png).map_err(|why| Error::Unreadable { request: "photo", why })?;
        let (sent, said) = (image.dimensions(), (self.size.width, self.size.height));
        if sent != said {
            let words = |(width, height): (u32, u32)| format!("{width} x {height}");
            return Err(Error::PictureSize { sent: words(sent), said: words(said) }.into());
        }
        Ok(image)
    }

    fn film(&self, is_watched: bool) -> Option<Box<dyn Film>> {
        // A picture takes the line that the arm is led by: none where time does not wait meanwhile. Nor where nobody looks
        // on, for it takes a while, and may draw a simulator's next noise.
        let film = || BridgeFilm { link: self.link.clone(), rests_until: None };
        (is_watched && !self.is_realtime).then(|| Box::new(film()) as Box<dyn Film>)
    }
}

/// Reads a photograph, a PNG file in base64.
fn decoded(png: &str) -> Result<RgbImage, String> {
    let bytes = STANDARD.decode(png.trim()).map_err(|error| format!("no base64: {error}"))?;
    decode::decoded(&bytes).map_err(|error| error.to_string())
}

/// The camera behind a bridge as it films: after a picture for as long as it took none is taken, so that a run that is looked
/// at takes twice its time at most.
struct BridgeFilm {
    link: SharedLink,
    rests_until: Option<Instant>,
}

impl Film for BridgeFilm {
    #[expect(
        clippy::disallowed_methods,
        reason = "what a picture costs is measured against the wall"
    )]
    fn shoot(&mut self, width: u32) -> Option<SmallShot> {
        let begin = Instant::now();
        if self.rests_until.is_some_and(|end| begin < end) {
            return None;
        }
        let png = lock(&self.link).glance();
        self.rests_until = Some(Instant::now() + begin.elapsed());
        let png = png?;
        Some(Box::new(move || decode::small(&decoded(&png).ok()?, width)))
    }
}

/// The scales behind a bridge.
pub struct BridgeScales(SharedLink);

impl Scales for BridgeScales {
    fn weigh(&mut self) -> Option<Weighing> {
        lock(&self.0).scales().ok()
    }
}
