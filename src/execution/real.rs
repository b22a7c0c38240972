//! A real body: an arm and a camera behind their traits, and what they let one believe about the world.
//!
//! Nothing is known here that a laboratory would not know: photographs, joint feedback, the scene file,
//! and the three regressions fitted from them. What follows from what was measured is [`Belief`]'s.

use std::collections::BTreeSet;
use std::panic::resume_unwind;

use image::GrayImage;

use crate::alignment::overlay::{annotate, outline_unknown};
use crate::alignment::vision::{self, Sighting};
use crate::twin::render::{ArmLook, View, solids};
use crate::world::frame::{self, Tool, World};
use crate::world::{Pose, Unknown, WorldState};

use super::belief::Belief;
use super::body::Sight;
use super::body::{Body, Watcher};
use super::calibration::Calibration;
use super::cell::Cell;
use super::confirm::{Confirmation, Judged};
use super::wording;
use crate::arm::patience::Patient;
use crate::arm::{Arm, Camera, Cancel, DeviceError, Feedback, Film, Grip, Plate};
use crate::trace::Event;

/// An arm and a camera as a body in a context.
pub struct RealBody {
    /// The cell as the regressions in force found it.
    cell: Cell,
    arm: Patient,
    camera: Box<dyn Camera>,
    calibration: Calibration,
    belief: Belief,
    look: ArmLook,
    watcher: Watcher,
    photos: usize,
    /// What a picture shows, being worked out.
    looking: Option<Looking>,
    /// The wish to stop, which a look obeys.
    cancel: Cancel,
}

/// What is found in a photograph.
struct Found {
    /// The photograph, with what was found drawn into it.
    picture: Event,
    /// The scene's objects.
    sightings: Vec<Sighting>,
    /// What else there is, where that was asked.
    others: Option<Vec<Unknown>>,
    /// What the scene's objects bound that were not found where they fit.
    doubted: Vec<Unknown>,
    /// Whether it has any colour.
    has_colour: bool,
}

/// What is found in a photograph, worked out in a thread of its own; `None` when that was stopped.
type Looking = std::thread::JoinHandle<Result<Option<Found>, vision::Error>>;

impl RealBody {
    /// Takes devices in a context with what is known so far.
    pub fn new(
        cell: Cell,
        arm: Box<dyn Arm>,
        camera: Box<dyn Camera>,
        calibration: Calibration,
        belief: Belief,
        look: ArmLook,
        watcher: Watcher,
    ) -> Self {
        let pads = cell.pads;
        Self {
            cell,
            arm: Patient::new(arm),
            camera,
            calibration,
            belief: belief.with_pads(pads),
            look,
            watcher,
            photos: 0,
            looking: None,
            cancel: Cancel::default(),
        }
    }

    /// Lets looks end when somebody asks to stop.
    #[must_use]
    pub fn obeying(mut self, cancel: Cancel) -> Self {
        self.cancel = cancel;
        self
    }

    /// Returns where the arm, with what is in the hand, hides the table from the camera, by its own report and a little more.
    fn arm_in_picture(&self, camera: &crate::world::Camera, state: &WorldState) -> GrayImage {
        let robot = &self.cell.robot;
        let world_from_base = self.cell.scene.world_from_base;
        let poses = robot.link_poses(&state.q, robot.max_opening()).unwrap_or_default();
        let links: Vec<_> = robot
            .links()
            .iter()
            .zip(poses)
            .map(|(link, pose)| (link.name.clone(), world_from_base.isometry() * pose))
            .collect();
        let mut view = View::of_arm(&self.cell.scene, &self.look, &links);
        let held = self.belief.in_hand();
        let held = held.and_then(|name| self.cell.scene.object(name).zip(state.object(name)));
        if let Some((object, pose)) =
            held.and_then(|(o, known)| Some((o, known.world_from_object?)))
        {
            view = view.with_silhouette(object, *pose.isometry());
        }
        let (w, h) = (camera.intrinsics.width, camera.intrinsics.height);
        let bodies = solids(camera, &view).into_iter().map(|is_body| if is_body { 255 } else { 0 });
        let mask =
            GrayImage::from_raw(w, h, bodies.collect()).unwrap_or_else(|| GrayImage::new(w, h));
        // The arm is not quite where it says, and it casts a soft edge.
        imageproc::morphology::dilate(&mask, imageproc::distance_transform::Norm::LInf, 12)
    }

    /// Returns what is not looked for on the table: what is in the hand.
    fn elsewhere(&self) -> BTreeSet<String> {
        self.belief.in_hand().map(str::to_owned).into_iter().collect()
    }

    /// Returns the name of the picture of the next look.
    fn next_look(&mut self) -> String {
        self.photos += 1;
        format!("look-{}", self.photos)
    }

    /// Returns where the tool really is at these reported joint positions.
    fn tool(&self, q: &[f64]) -> Pose<World, Tool> {
        self.cell.tool_pose(q)
    }
}

/// What is known while the arm moves: where it reports to be, what is in its fingers, and where things were
/// seen last. Water that may be on its way is not known to be anywhere before it is weighed.
struct RealSight {
    belief: Belief,
    cell: Cell,
}

impl Sight for RealSight {
    fn state(&mut self, feedback: &Feedback) -> WorldState {
        let tool = self.cell.tool_pose(&feedback.q);
        let mut state = self.belief.state(feedback, tool);
        for object in &mut state.objects {
            object.water = None;
        }
        state
    }

    fn contact(&self, a: &str, b: &str) -> Option<bool> {
        self.belief.contact(a, b)
    }

    fn feels(&self) -> bool {
        true
    }
}

impl Body for RealBody {
    fn arm(&mut self) -> &mut dyn Arm {
        &mut self.arm
    }

    fn sight(&self) -> Box<dyn Sight> {
        Box::new(RealSight { belief: self.belief.clone(), cell: self.cell.clone() })
    }

    fn state(&mut self) -> Result<WorldState, DeviceError> {
        let feedback = self.arm.feedback()?;
        let tool = self.tool(&feedback.q);
        Ok(self.belief.state(&feedback, tool))
    }

    fn last_state(&mut self) -> Option<WorldState> {
        let feedback = self.arm.last()?.clone();
        let tool = self.tool(&feedback.q);
        Some(self.belief.state(&feedback, tool))
    }

    fn waits(&mut self, on: bool) -> Result<(), DeviceError> {
        self.arm.waits(on)
    }

    fn look(&mut self) -> Result<(), DeviceError> {
        self.look_begin()?;
        self.look_end()
    }

    fn look_begin(&mut self) -> Result<(), DeviceError> {
        let plate = self.camera.plate()?;
        let scene = self.cell.scene.clone();
        let camera = self.calibration.camera;
        // Fingers that have closed further have lost what they held: it is looked for again.
        let state = self.state()?;
        let mut options = vision::Options {
            ignore: Some(self.arm_in_picture(&camera, &state)),
            elsewhere: self.elsewhere(),
            raised: self.belief.raised(),
            ..vision::Options::default()
        };
        let name = self.next_look();
        let known = self.belief.objects().to_vec();
        let before = self.belief.unknown().to_vec();
        let cancel = self.cancel.clone();
        self.looking = Some(std::thread::spawn(move || {
            let stop = || cancel.is_cancelled();
            let photo = plate(None);
            let look = vision::Look::new(&photo, &camera, &scene)?.until(&stop);
            let sightings = look.see_standing(&mut options, &known);
            // What hangs over the table hides it, and is reflected in it.
            let is_open = options.elsewhere.is_empty();
            let others = is_open.then(|| look.unexplained(&sightings, &options, &before));
            let doubted = look.doubted(&sightings);
            if look.is_stopped() {
                return Ok(None);
            }
            let mut image = annotate(&photo, &sightings);
            outline_unknown(&mut image, &camera, others.as_deref().unwrap_or(&[]));
            let (picture, has_colour) = (Event::picture(name, &image), look.has_colour());
            Ok(Some(Found { picture, sightings, others, doubted, has_colour }))
        }));
        Ok(())
    }

    fn look_end(&mut self) -> Result<(), DeviceError> {
        let Some(looking) = self.looking.take() else { return Ok(()) };
        let no_use = |error| DeviceError::Unavailable(wording::image_of_no_use(error));
        // A mistake of the program's own is no fault of the photograph.
        let found = looking.join().unwrap_or_else(|panic| resume_unwind(panic));
        let found = found.map_err(no_use)?.ok_or(DeviceError::Stopped)?;
        let Found { picture, sightings, others, doubted, has_colour } = found;
        if let Ok(mut watcher) = self.watcher.lock() {
            watcher.event(&picture);
            if !has_colour {
                watcher.event(&Event::note(vision::NO_COLOUR));
            }
            for sighting in &sightings {
                watcher.event(&Event::note(wording::seen(sighting)));
            }
            for other in others.iter().flatten() {
                watcher.event(&Event::note(wording::seen_unknown(other)));
            }
        }
        self.belief.saw(&sightings);
        if let Some(mut others) = others {
            others.extend(doubted);
            self.belief.saw_unknown(others);
        }
        Ok(())
    }

    fn sure(&self) -> Vec<(String, f64)> {
        self.belief.sure()
    }

    fn confirm(&mut self, names: &[String]) -> Result<(), DeviceError> {
        if names.is_empty() {
            return Ok(());
        }
        let photo = self.camera.photo()?;
        let feedback = self.arm.feedback()?;
        let tool = self.tool(&feedback.q);
        let state = self.belief.state(&feedback, tool);
        let no_use = |error| DeviceError::Unavailable(wording::image_of_no_use(error));
        let mask = self.arm_in_picture(&self.calibration.camera, &state);
        let checking = Confirmation {
            photo: &photo,
            camera: &self.calibration.camera,
            scene: &self.cell.scene,
            raised: self.belief.raised(),
            elsewhere: self.elsewhere(),
            mask: &mask,
            stop: &|| self.cancel.is_cancelled(),
        };
        let judged = checking.judge(names, &state).map_err(no_use)?;
        let Judged { gone, seen } = judged.ok_or(DeviceError::Stopped)?;
        let picture = Event::picture(self.next_look(), &annotate(&photo, &seen));
        if let Ok(mut watcher) = self.watcher.lock() {
            watcher.event(&picture);
            for name in &gone {
                watcher.event(&Event::note(wording::gone(name)));
            }
        }
        for name in &gone {
            self.belief.lost(name);
        }
        Ok(())
    }

    fn gripped(&mut self, grip: Grip, aim: Option<&str>) -> Result<(), DeviceError> {
        let feedback = self.arm.feedback()?;
        let tool = self.tool(&feedback.q);
        self.belief.gripped(grip, aim, &tool, feedback.time);
        Ok(())
    }

    fn given(&mut self, o: &str) {
        self.belief.lost(o);
    }

    fn cut_short(&mut self) {
        // An arm that does not answer leaves what is known of its lean.
        let _ = self.state();
        self.belief.cut_short();
    }

    fn weighed(&mut self, mass: f64) {
        // It is weighed as it leans now; an arm that does not answer is told by the next step.
        let _ = self.state();
        self.belief.weighed(mass);
    }

    fn bears(&mut self, mass: f64) {
        self.belief.bears(mass);
    }

    fn stands(&mut self, by: f64) -> Result<(), DeviceError> {
        let q = self.arm.feedback()?.q;
        let tool = self.tool(&q);
        self.belief.stands(by, &tool);
        Ok(())
    }

    fn pushed(&mut self, o: &str, ends: Option<Pose<World, frame::Object>>) {
        self.belief.pushed(o, ends);
    }

    fn plate(&mut self) -> Result<Option<Plate>, DeviceError> {
        Ok(Some(self.camera.plate()?))
    }

    fn film(&self, is_watched: bool) -> Option<Box<dyn Film>> {
        self.camera.film(is_watched)
    }

    fn calibrate(&mut self, calibration: Calibration, cell: &Cell) {
        self.cell = cell.clone();
        self.look = ArmLook::new(&cell.robot);
        self.calibration = calibration;
    }

    fn calibration(&self) -> Option<&Calibration> {
        Some(&self.calibration)
    }

    fn contact(&mut self, a: &str, b: &str) -> Option<bool> {
        self.belief.contact(a, b)
    }
}
