//! A real body: an arm and a camera behind their traits, and what they let one believe about the world.
//!
//! Nothing is known here that a laboratory would not know: photographs, joint feedback, the scene file,
//! and the three regressions fitted from them. What follows from what was measured is worked out in one
//! place, [`Belief`]; what nobody measured stays unknown.

use std::sync::Arc;

use image::{GrayImage, RgbImage};
use nalgebra::Matrix6;

use crate::alignment::overlay::annotate;
use crate::alignment::vision::{self, Sighting};
use crate::motion::kinematics::pose_error;
use crate::motion::robot::Robot;
use crate::twin::render::{ArmLook, NOTHING, Options, TABLE, View, render};
use crate::world::frame::{Base, Object, Tool, World};
use crate::world::{ObjectState, Pose, Scene, WorldState};

use super::arm::{Arm, Camera, DeviceError, Feedback, Grip};
use super::calibrate::Calibration;
use super::during::Sight;
use super::patience::Patient;
use super::stage::{Body, Cell, Watcher};
use super::trace::Event;

/// Density of water, kg/m³.
const WATER: f64 = 998.0;
/// Pads this much closer or wider than an object's width still hold it, m.
const PAD_TOLERANCE: f64 = 0.008;

/// What is between the fingers.
#[derive(Debug, Clone)]
struct Held {
    name: String,
    /// How it lies there.
    tool_from_object: Pose<Tool, Object>,
    /// Opening between the pads when they closed on it, m.
    opening: f64,
}

/// What was measured, and what follows from it.
#[derive(Debug, Clone)]
pub struct Belief {
    scene: Arc<Scene>,
    objects: Vec<ObjectState>,
    /// What is between the fingers and how it lies there.
    held: Option<Held>,
    /// The last object whose lip was over another: where what leaves the hand goes.
    below: Option<String>,
    /// The last mass weighed in the hand, kg.
    mass: Option<f64>,
}

impl Belief {
    /// Knows the scene file and nothing else: no places, and the water the file declares.
    pub fn new(scene: Arc<Scene>) -> Self {
        let objects = scene
            .objects
            .iter()
            .map(|object| ObjectState {
                name: object.name.clone(),
                world_from_object: None,
                std: f64::INFINITY,
                water: object.cavity.map(|cavity| cavity.filled),
            })
            .collect();
        Self { scene, objects, held: None, below: None, mass: None }
    }

    /// Knows where things are in this world, and how much water is in them; what is held stands below the hand.
    pub fn knowing(scene: Arc<Scene>, state: &WorldState) -> Self {
        let mut belief = Self::new(scene);
        for object in &mut belief.objects {
            let Some(known) = state.object(&object.name) else { continue };
            *object = known.clone();
            if state.held.as_ref() == Some(&object.name) {
                object.world_from_object = known.world_from_object.map(|pose| {
                    let at = pose.origin();
                    Pose::upright(at.x, at.y, 0.0, pose.yaw())
                });
            }
        }
        belief
    }

    /// Takes what a photograph showed. What is in the hand is known better by the hand.
    pub fn saw(&mut self, sightings: &[Sighting]) {
        for sighting in sightings {
            if self.holds(&sighting.name) {
                continue;
            }
            let Some(object) = self.objects.iter_mut().find(|o| o.name == sighting.name) else {
                continue;
            };
            object.world_from_object = sighting.world_from_object;
            object.std = sighting.std;
        }
    }

    fn holds(&self, name: &str) -> bool {
        self.held.as_ref().is_some_and(|held| held.name == name)
    }

    /// Fingers that close further than on what they hold have lost it, and nobody knows where to.
    fn slipped(&mut self, opening: f64) {
        let Some(held) = self.held.take_if(|held| opening < held.opening - PAD_TOLERANCE) else {
            return;
        };
        if let Some(object) = self.objects.iter_mut().find(|object| object.name == held.name) {
            object.world_from_object = None;
            object.std = f64::INFINITY;
        }
        self.mass = None;
    }

    /// Takes how a grip on `aim` ended, with the tool at `tool`.
    pub fn gripped(&mut self, grip: Grip, aim: Option<&str>, tool: &Pose<World, Tool>) {
        if let Some(Held { name, tool_from_object, .. }) = self.held.take() {
            // What was held stands where the hand let it go.
            let mut pose = *tool * tool_from_object;
            let origin = pose.origin();
            if origin.z < 0.03 {
                pose = Pose::upright(origin.x, origin.y, 0.0, pose.yaw());
            }
            if let Some(object) = self.objects.iter_mut().find(|object| object.name == name) {
                object.world_from_object = Some(pose);
            }
            self.mass = None;
        }
        let Some(aim) = aim else { return };
        let Some(object) = self.scene.object(aim) else { return };
        let widths = match object.shape {
            crate::world::Shape::Cuboid { size } => vec![size.x, size.y],
            crate::world::Shape::Cylinder { radius, .. } => vec![2.0 * radius],
        };
        let fits = widths.iter().any(|width| (grip.opening - width).abs() < PAD_TOLERANCE);
        let Some(known) = self.objects.iter_mut().find(|o| o.name == aim) else { return };
        if grip.stalled && fits {
            if let Some(pose) = known.world_from_object {
                let tool_from_object = tool.inverse() * pose;
                let (name, opening) = (aim.to_owned(), grip.opening);
                self.held = Some(Held { name, tool_from_object, opening });
            }
        } else {
            // The fingers closed where it should have been, so it is somewhere else: look again.
            known.world_from_object = None;
            known.std = f64::INFINITY;
        }
    }

    /// Takes the mass in the hand, kg: what it lost since the last time went into what is below it.
    pub fn weighed(&mut self, mass: f64) {
        let Some(name) = self.held.as_ref().map(|held| held.name.clone()) else { return };
        let lost = self.mass.map(|before| (before - mass) / WATER);
        self.mass = Some(mass);
        let Some(lost) = lost else { return };
        let below = self.below.clone();
        for object in &mut self.objects {
            if let Some(water) = &mut object.water {
                if object.name == name {
                    *water = (*water - lost).max(0.0);
                } else if Some(&object.name) == below.as_ref() {
                    *water = (*water + lost).max(0.0);
                }
            }
        }
    }

    /// Returns whether two things touch; touch between two things on the table is not measured.
    fn contact(&self, a: &str, b: &str) -> Option<bool> {
        match (a, b) {
            ("gripper", o) | (o, "gripper") => Some(self.holds(o)),
            _ => None,
        }
    }

    /// Returns the world with the arm as reported and the tool where it really is.
    pub fn state(&mut self, feedback: &Feedback, tool: Pose<World, Tool>) -> WorldState {
        self.slipped(feedback.opening);
        let mut objects = self.objects.clone();
        if let Some(Held { name, tool_from_object, .. }) = &self.held {
            if let Some(object) = objects.iter_mut().find(|object| object.name == *name) {
                object.world_from_object = Some(tool * *tool_from_object);
            }
            self.below = below(&self.scene, &objects, name).or(self.below.take());
        }
        WorldState {
            time: feedback.time,
            q: feedback.q.clone(),
            opening: feedback.opening,
            world_from_tool: tool,
            held: self.held.as_ref().map(|held| held.name.clone()),
            objects,
            // No one weighs the table during a run.
            spilt: None,
        }
    }
}

/// Returns the vessel over whose mouth the held object's middle hangs.
fn below(scene: &Scene, objects: &[ObjectState], held: &str) -> Option<String> {
    let pose = |name: &str| objects.iter().find(|o| o.name == name)?.world_from_object;
    let hand = pose(held)?;
    scene.objects.iter().filter(|o| o.name != held && o.cavity.is_some()).find_map(|object| {
        let under = pose(&object.name)?;
        let gap = (hand.origin() - under.origin()).xy().norm();
        let near = gap < object.shape.outer_radius() + 0.08;
        (near && hand.origin().z > under.origin().z + 0.05).then(|| object.name.clone())
    })
}

/// An arm and a camera as a body on stage.
pub struct RealBody {
    cell: Cell,
    arm: Patient,
    camera: Box<dyn Camera>,
    calibration: Calibration,
    /// The arm as regression 3 says it is.
    real: Arc<Robot>,
    belief: Belief,
    look: ArmLook,
    watcher: Watcher,
    photos: usize,
    /// What a picture shows, being worked out.
    looking: Option<Looking>,
}

/// A photograph and what is found in it, on a thread of its own.
type Looking = std::thread::JoinHandle<(RgbImage, Result<Vec<Sighting>, vision::Error>)>;

impl RealBody {
    /// Takes devices on stage with what is known so far.
    pub fn new(
        cell: Cell,
        arm: Box<dyn Arm>,
        camera: Box<dyn Camera>,
        calibration: Calibration,
        belief: Belief,
        look: ArmLook,
        watcher: Watcher,
    ) -> Self {
        let real = Arc::new(calibration.arm(&cell.robot));
        Self {
            cell,
            arm: Patient::new(arm),
            camera,
            calibration,
            real,
            belief,
            look,
            watcher,
            photos: 0,
            looking: None,
        }
    }

    /// Returns where the arm hides the table from the camera, by its own report and a little more.
    fn arm_in_picture(&self, camera: &crate::world::Camera, q: &[f64]) -> GrayImage {
        let robot = &self.cell.robot;
        let world_from_base = self.cell.scene.world_from_base;
        let poses = robot.link_poses(q, robot.max_opening()).unwrap_or_default();
        let links: Vec<_> = robot
            .links()
            .iter()
            .zip(poses)
            .map(|(link, pose)| (link.name.clone(), world_from_base.isometry() * pose))
            .collect();
        let view = View::of_arm(&self.cell.scene, &self.look, &links);
        let frame = render(camera, &view, &Options::quick());
        let (w, h) = (camera.intrinsics.width, camera.intrinsics.height);
        let bodies = frame.ids.iter().map(|&id| if id == NOTHING || id == TABLE { 0 } else { 255 });
        let mask =
            GrayImage::from_raw(w, h, bodies.collect()).unwrap_or_else(|| GrayImage::new(w, h));
        // The arm is not quite where it says, and it casts a soft edge.
        imageproc::morphology::dilate(&mask, imageproc::distance_transform::Norm::LInf, 12)
    }

    /// Returns where the tool really is at these reported joint positions (regression 3).
    fn tool(&self, q: &[f64]) -> Pose<World, Tool> {
        real_tool(&self.real, &self.cell.scene, &self.calibration.reported_from_real, q)
    }
}

fn real_tool(
    real: &Robot,
    scene: &Scene,
    reported_from_real: &Pose<World, World>,
    q: &[f64],
) -> Pose<World, Tool> {
    let base_from_tool = real.forward_tool(q).expect("an arm reports one angle per joint");
    reported_from_real.inverse() * (scene.world_from_base * base_from_tool)
}

/// What is known while the arm moves: where it reports to be, what is in its fingers, and where things were
/// seen last. Water that may be on its way is not known to be anywhere before it is weighed.
struct RealSight {
    belief: Belief,
    real: Arc<Robot>,
    reported_from_real: Pose<World, World>,
}

impl Sight for RealSight {
    fn state(&mut self, feedback: &Feedback) -> WorldState {
        let scene = self.belief.scene.clone();
        let tool = real_tool(&self.real, &scene, &self.reported_from_real, &feedback.q);
        let mut state = self.belief.state(feedback, tool);
        for object in &mut state.objects {
            object.water = None;
        }
        state
    }

    fn contact(&self, a: &str, b: &str) -> Option<bool> {
        self.belief.contact(a, b)
    }
}

/// Returns the joint positions near `q` that bring the tool of `robot` to a pose a little off, by Newton's
/// method with the smallest joint motion: smooth in `q` and indifferent to joint ranges, which the limits
/// look at later.
fn at_tool(robot: &Robot, base_from_tool: &Pose<Base, Tool>, q: &[f64]) -> Vec<f64> {
    let tip = *base_from_tool * robot.flange_from_tool().inverse();
    let mut near = q.to_vec();
    for _ in 0..6 {
        let (Ok(now), Ok(jacobian)) = (robot.forward(&near), robot.jacobian(&near)) else {
            return q.to_vec();
        };
        let error = pose_error(now.isometry(), tip.isometry());
        // Damped a little, so that a wrist near its singularity moves no further than it must.
        let normal = &jacobian * jacobian.transpose() + Matrix6::identity() * 1e-6;
        let Some(weights) = normal.lu().solve(&error) else { return q.to_vec() };
        let step = jacobian.transpose() * weights;
        for (joint, change) in near.iter_mut().zip(step.iter()) {
            *joint += change;
        }
    }
    near
}

impl Body for RealBody {
    fn arm(&mut self) -> &mut dyn Arm {
        &mut self.arm
    }

    fn sight(&self) -> Box<dyn Sight> {
        Box::new(RealSight {
            belief: self.belief.clone(),
            real: self.real.clone(),
            reported_from_real: self.calibration.reported_from_real,
        })
    }

    fn state(&mut self) -> Result<WorldState, DeviceError> {
        let feedback = self.arm.feedback()?;
        let tool = self.tool(&feedback.q);
        Ok(self.belief.state(&feedback, tool))
    }

    fn waits(&mut self, on: bool) -> Result<(), DeviceError> {
        self.arm.waits(on)
    }

    fn look(&mut self) -> Result<(), DeviceError> {
        self.look_begin()?;
        self.look_end()
    }

    fn look_begin(&mut self) -> Result<(), DeviceError> {
        let photo = self.camera.photo()?;
        let scene = self.cell.scene.clone();
        let camera = self.calibration.camera;
        let q = self.arm.feedback()?.q;
        let options = vision::Options {
            ignore: Some(self.arm_in_picture(&camera, &q)),
            ..vision::Options::default()
        };
        self.looking = Some(std::thread::spawn(move || {
            let seen = vision::see(&photo, &camera, &scene, &options);
            (photo, seen)
        }));
        Ok(())
    }

    fn look_end(&mut self) -> Result<(), DeviceError> {
        let Some(looking) = self.looking.take() else { return Ok(()) };
        let no_use = |error: &dyn std::fmt::Display| {
            DeviceError::Unavailable(format!("the photograph is no use: {error}"))
        };
        let (photo, seen) = looking.join().map_err(|_| no_use(&"looking at it failed"))?;
        let sightings = seen.map_err(|error| no_use(&error))?;
        self.photos += 1;
        if let Ok(mut watcher) = self.watcher.lock() {
            let image = annotate(&photo, &sightings);
            watcher.event(&Event::Picture { name: format!("look-{}", self.photos), image });
            for sighting in &sightings {
                watcher.event(&Event::Note { text: summary(sighting) });
            }
        }
        self.belief.saw(&sightings);
        Ok(())
    }

    fn correct(&self, q: &[f64]) -> Vec<f64> {
        let planned = super::plan::tool_pose(&self.cell, q);
        let base_from_world = self.cell.scene.world_from_base.inverse();
        let there = base_from_world * (self.calibration.reported_from_real * planned);
        at_tool(&self.real, &there, q)
    }

    fn uncorrect(&self, q: &[f64]) -> Vec<f64> {
        // The correction is nearly the identity, so this closes in on its inverse; a pose alone would leave
        // the elbow free to be elsewhere than the arm is.
        let mut planned = q.to_vec();
        for _ in 0..8 {
            let sent = self.correct(&planned);
            for (planned, (q, sent)) in planned.iter_mut().zip(q.iter().zip(&sent)) {
                *planned += q - sent;
            }
        }
        planned
    }

    fn gripped(&mut self, grip: Grip, aim: Option<&str>) -> Result<(), DeviceError> {
        let feedback = self.arm.feedback()?;
        let tool = self.tool(&feedback.q);
        self.belief.gripped(grip, aim, &tool);
        Ok(())
    }

    fn weighed(&mut self, mass: f64) {
        self.belief.weighed(mass);
    }

    fn photo(&mut self) -> Result<Option<RgbImage>, DeviceError> {
        Ok(Some(self.camera.photo()?))
    }

    fn calibrate(&mut self, calibration: Calibration) {
        self.real = Arc::new(calibration.arm(&self.cell.robot));
        self.calibration = calibration;
    }

    fn calibration(&self) -> Option<&Calibration> {
        Some(&self.calibration)
    }

    fn contact(&mut self, a: &str, b: &str) -> Option<bool> {
        self.belief.contact(a, b)
    }
}

/// Words a sighting.
fn summary(seen: &Sighting) -> String {
    match seen.world_from_object {
        Some(pose) => {
            let at = pose.origin();
            format!(
                "camera: {} at ({:.1}, {:.1}) cm, turned {:.1} deg, ± {:.1} mm, confidence {:.2}",
                seen.name,
                at.x * 100.0,
                at.y * 100.0,
                pose.yaw().to_degrees(),
                seen.std * 1e3,
                seen.confidence
            )
        }
        None => format!(
            "camera: {} not found: {}",
            seen.name,
            seen.reason.as_deref().unwrap_or("nothing in the picture looks like it")
        ),
    }
}
