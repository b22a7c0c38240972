//! What follows from what was measured: where things are, what is in the hand, where the water went.
//!
//! What nobody measured stays unknown. What is in the hand is known by the hand, and creeps in it as the pads are
//! known to let it; what the hand no longer weighs went into what was below it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::Vector3;

use crate::alignment::vision::Sighting;
use crate::fluent;
use crate::world::frame::{Object, Tool, World};
use crate::world::{ObjectState, Pose, Scene, Unknown, WATER_DENSITY, WorldState, drawer, support};

use super::cell::Pads;
use crate::arm::{Feedback, Grip};

/// Pads this much closer or wider than an object's width still hold it, m.
const PAD_TOLERANCE: f64 = 0.008;
/// A thing that was let go lower than this above what is below it has come to stand there, m. Chosen: a hand is off by
/// up to 2 cm (8 to 19 mm in `docs/results.md`); what falls deeper may come to lie.
pub(super) const LET_DOWN: f64 = 0.03;
/// A mouth this far beside a vessel still pours into it, m: a lip is half a jar's width from its mouth's middle, and a
/// stream leaves it forwards.
const BESIDE: f64 = 0.08;
/// A base this far above another's hangs over it, m. Chosen: more than what is lifted by before it is carried.
const ABOVE: f64 = 0.05;
/// How well the place of a thing is known that was pushed and not seen since, m, one standard deviation. Chosen: a hand is
/// off by up to 2 cm (8 to 19 mm in `docs/results.md`), two of these.
const PUSHED: f64 = 0.01;
/// A thing whose base is this far above the table hangs in the hand, m.
const HANGS: f64 = 0.002;
/// A vessel that leans by more than this, and by more than when it was weighed last, may let water go, rad: twice what it may lean
/// while it is carried.
const MAY_RUN: f64 = 0.35;
/// Two looks at one tilt differ by less, rad.
const SAME_TILT: f64 = 0.02;

/// What is between the fingers.
#[derive(Debug, Clone)]
struct Held {
    name: String,
    /// How it lies there.
    tool_from_object: Pose<Tool, Object>,
    /// Opening between the pads when they closed on it, m.
    opening: f64,
    /// How far it has crept since.
    crept: Crept,
}

/// How far a thing has crept along the pads, shared by all who follow the arm: between two looks at the arm it
/// crept the way its weight pulls at the second.
#[derive(Debug, Clone)]
struct Crept {
    /// m/s.
    rate: f64,
    /// Until when, s, and how far, m in the tool's frame.
    so_far: Arc<Mutex<(f64, Vector3<f64>)>>,
}

impl Crept {
    fn since(time: f64, rate: f64) -> Self {
        Self { rate, so_far: Arc::new(Mutex::new((time, Vector3::zeros()))) }
    }

    /// Returns where a thing that was taken as `tool_from_object` lies in the hand by `time`, with the tool at `tool`,
    /// whose fingers close along its x axis.
    fn by(
        &self,
        time: f64,
        tool: &Pose<World, Tool>,
        tool_from_object: &Pose<Tool, Object>,
    ) -> Pose<Tool, Object> {
        let mut so_far = self.so_far.lock().unwrap_or_else(PoisonError::into_inner);
        let (until, crept) = *so_far;
        let lies = |crept: Vector3<f64>| {
            Pose::from_parts(tool_from_object.origin() + crept, tool_from_object.rotation())
        };
        // What the table bears does not creep.
        let hangs = (*tool * lies(crept)).origin().z > HANGS;
        if self.rate > 0.0 && time > until {
            let down = tool.rotation().inverse() * -Vector3::z();
            let along = Vector3::new(0.0, down.y, down.z).try_normalize(1e-9).unwrap_or_default();
            let more = if hangs { self.rate * (time - until) * along } else { Vector3::zeros() };
            *so_far = (time, crept + more);
        }
        lies(so_far.1)
    }

    /// Takes note that the thing has slid by so much, m in the tool's frame, beside what is known of the pads.
    fn slid(&self, by: Vector3<f64>) {
        let mut so_far = self.so_far.lock().unwrap_or_else(PoisonError::into_inner);
        so_far.1 += by;
    }
}

/// What was measured, and what follows from it.
#[derive(Debug, Clone)]
pub struct Belief {
    pub(super) scene: Arc<Scene>,
    objects: Vec<ObjectState>,
    /// What is between the fingers and how it lies there.
    held: Option<Held>,
    /// The last object whose lip was over another: where what leaves the hand goes.
    below: Option<String>,
    /// The last mass weighed in the hand, kg.
    mass: Option<f64>,
    /// How far what is in the hand leans, rad: now, and when it was weighed last.
    leans: [f64; 2],
    /// Vessels between which water may have gone since they were weighed.
    unweighed: BTreeSet<String>,
    /// How fast things creep along the pads, m/s.
    creep: f64,
    /// What else was seen on the table.
    unknown: Vec<Unknown>,
    /// How probable it is that things are where the last picture that showed them says, by name.
    sure: BTreeMap<String, f64>,
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
        Self {
            scene,
            objects,
            held: None,
            below: None,
            mass: None,
            leans: [0.0; 2],
            unweighed: BTreeSet::new(),
            creep: 0.0,
            unknown: Vec::new(),
            sure: BTreeMap::new(),
        }
    }

    /// Knows where things are in this world, and how much water is in them; what is held stands below the hand.
    pub fn knowing(scene: Arc<Scene>, state: &WorldState) -> Self {
        let mut belief = Self::new(scene);
        belief.unknown.clone_from(&state.unknown);
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

    /// Takes what a photograph showed. What is in the hand is known better by the hand; what it does not show to be gone is
    /// believed as before.
    pub fn saw(&mut self, sightings: &[Sighting]) {
        for sighting in sightings {
            if self.holds(&sighting.name) || sighting.kept.is_some() {
                continue;
            }
            let Some(object) = self.objects.iter_mut().find(|o| o.name == sighting.name) else {
                continue;
            };
            object.world_from_object = sighting.world_from_object;
            object.std = sighting.std;
            self.sure.insert(sighting.name.clone(), sighting.confidence);
        }
    }

    /// Returns how probable it is that things are where the last picture that showed them says, 0 to 1, by name.
    pub fn sure(&self) -> Vec<(String, f64)> {
        self.sure.iter().map(|(name, sure)| (name.clone(), *sure)).collect()
    }

    /// Returns how high above the table things stand that stand on others, m.
    pub fn raised(&self) -> BTreeMap<String, f64> {
        let standing = self.objects.iter().filter(|object| !self.holds(&object.name));
        let height = |object: &ObjectState| {
            let pose = object.world_from_object?;
            let below =
                support::below(&self.scene, &self.objects, self.scene.object(&object.name)?, &pose);
            below.name.map(|_| (object.name.clone(), below.height))
        };
        standing.filter_map(height).collect()
    }

    /// Returns what hangs in the hand; a drawer that is held by its handle is where its case is.
    pub fn in_hand(&self) -> Option<&str> {
        let held = self.held.as_ref().map(|held| held.name.as_str());
        held.filter(|name| self.scene.drawer(name).is_none())
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

    /// Takes note that a thing is not where it was believed to be.
    pub fn lost(&mut self, name: &str) {
        if let Some(object) = self.objects.iter_mut().find(|object| object.name == name) {
            object.world_from_object = None;
            object.std = f64::INFINITY;
        }
    }

    /// Takes where a thing is believed to stand that was pushed; where it stands whose push was cut short nobody knows.
    pub fn pushed(&mut self, name: &str, ends: Option<Pose<World, Object>>) {
        let Some(object) = self.objects.iter_mut().find(|object| object.name == name) else {
            return;
        };
        object.world_from_object = ends;
        object.std = ends.map_or(f64::INFINITY, |_| object.std.max(PUSHED));
    }

    /// Takes what a photograph showed that nothing explains. While something is in the hand nothing is said of it, since
    /// what hangs over the table hides it.
    pub fn saw_unknown(&mut self, unknown: Vec<Unknown>) {
        if self.held.is_none() {
            self.unknown = unknown;
        }
    }

    /// Returns what is known of each thing, what is in the hand as it was before.
    pub fn objects(&self) -> &[ObjectState] {
        &self.objects
    }

    /// Returns what else was seen on the table.
    pub fn unknown(&self) -> &[Unknown] {
        &self.unknown
    }

    /// Knows how the finger pads hold.
    #[must_use]
    pub fn with_pads(self, pads: Pads) -> Self {
        Self { creep: pads.creep, ..self }
    }

    /// Takes how a grip on `aim` ended at `time` (s), with the tool at `tool`.
    pub fn gripped(&mut self, grip: Grip, aim: Option<&str>, tool: &Pose<World, Tool>, time: f64) {
        if let Some(Held { name, tool_from_object, .. }) =
            self.held.take_if(|held| self.scene.drawer(&held.name).is_some())
        {
            let (scene, pose) = (self.scene.clone(), *tool * tool_from_object);
            follow(&scene, &name, &pose, &mut self.objects);
            self.mass = None;
        }
        if let Some(Held { name, tool_from_object, crept, .. }) = self.held.take() {
            // What was held stands where the hand let it go; where something fell to a look has to show.
            let hung = *tool * crept.by(time, tool, &tool_from_object);
            let stands = self.scene.object(&name).and_then(|object| {
                let (origin, below) =
                    (hung.origin(), support::below(&self.scene, &self.objects, object, &hung));
                let is_down = origin.z - below.height < LET_DOWN;
                is_down.then(|| Pose::upright(origin.x, origin.y, below.height, hung.yaw()))
            });
            if let Some(object) = self.objects.iter_mut().find(|object| object.name == name) {
                object.world_from_object = stands;
                if stands.is_none() {
                    object.std = f64::INFINITY;
                }
            }
            // What is let go is not weighed any more.
            for lost in std::mem::take(&mut self.unweighed) {
                if let Some(object) = self.objects.iter_mut().find(|object| object.name == lost) {
                    object.water = None;
                }
            }
            self.mass = None;
        }
        let Some(aim) = aim else { return };
        let Some(object) = self.scene.object(aim) else { return };
        // A drawer is held by the bar of its handle.
        let width = match self.scene.drawer(aim) {
            Some(_) => 2.0 * drawer::BAR,
            None => object.shape.between(grip.opening),
        };
        let fits = (grip.opening - width).abs() < PAD_TOLERANCE;
        let Some(known) = self.objects.iter_mut().find(|o| o.name == aim) else { return };
        if grip.stalled && fits {
            if let Some(pose) = known.world_from_object {
                let tool_from_object = tool.inverse() * pose;
                let (name, opening) = (aim.to_owned(), grip.opening);
                let crept = Crept::since(time, self.creep);
                self.held = Some(Held { name, tool_from_object, opening, crept });
            }
        } else {
            // The fingers closed where it should have been, so it is somewhere else: look again.
            known.world_from_object = None;
            known.std = f64::INFINITY;
        }
    }

    /// Takes note that what is in the hand, with the tool at `tool`, stands: it is `by` m lower than it was believed to be.
    pub fn stands(&mut self, by: f64, tool: &Pose<World, Tool>) {
        if let Some(held) = &self.held {
            held.crept.slid(tool.rotation().inverse() * Vector3::new(0.0, 0.0, -by));
        }
    }

    /// Takes the mass in the hand, kg: what it lost since the last time went into what is below it.
    pub fn weighed(&mut self, mass: f64) {
        let Some(name) = self.held.as_ref().map(|held| held.name.clone()) else { return };
        let lost = self.mass.map(|before| (before - mass) / WATER_DENSITY);
        self.mass = Some(mass);
        self.leans[1] = self.leans[0];
        let Some(lost) = lost else { return };
        self.unweighed.clear();
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

    /// Takes note that what was under way has ended before its end: what leans in the hand, and has not been weighed as it leans, may
    /// have let water go into what is below it.
    pub fn cut_short(&mut self) {
        let [leans, weighed] = self.leans;
        if leans > MAY_RUN.max(weighed + SAME_TILT) {
            let held = self.held.as_ref().map(|held| held.name.clone());
            self.unweighed.extend(held.into_iter().chain(self.below.clone()));
        }
    }

    /// Takes a better measurement of the mass in the hand, kg, from which nothing has left since the last.
    pub fn bears(&mut self, mass: f64) {
        self.mass = self.held.as_ref().map(|_| mass);
    }

    /// Returns whether two things touch; touch between two things on the table is not measured.
    pub(super) fn contact(&self, a: &str, b: &str) -> Option<bool> {
        match (a, b) {
            ("gripper", o) | (o, "gripper") => Some(self.holds(o)),
            _ => None,
        }
    }

    /// Returns the world with the arm as reported and the tool where it really is.
    pub fn state(&mut self, feedback: &Feedback, tool: Pose<World, Tool>) -> WorldState {
        self.slipped(feedback.opening);
        let mut objects = self.objects.clone();
        if let Some(Held { name, tool_from_object, crept, .. }) = &self.held {
            if self.scene.drawer(name).is_some() {
                follow(&self.scene, name, &(tool * *tool_from_object), &mut objects);
            } else if let Some(object) = objects.iter_mut().find(|object| object.name == *name) {
                let stands = tool * crept.by(feedback.time, &tool, tool_from_object);
                object.world_from_object = Some(stands);
                self.leans[0] = stands.tilt();
            }
            self.below = below(&self.scene, &objects, name).or(self.below.take());
        } else {
            self.leans = [0.0; 2];
        }
        for object in objects.iter_mut().filter(|object| self.unweighed.contains(&object.name)) {
            object.water = None;
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
            unknown: self.unknown.clone(),
        }
    }
}

/// Draws a drawer by the hand that holds it: as far along its rail as the hand has brought it, with what is in it.
fn follow(scene: &Scene, name: &str, by_hand: &Pose<World, Object>, objects: &mut [ObjectState]) {
    let Some(drawer) = scene.drawer(name) else { return };
    let case = objects.iter().find(|known| known.name == drawer.case);
    let Some(case) = case.and_then(|known| known.world_from_object) else { return };
    if let Some(drawn) = drawer.drawn(scene, &case, by_hand) {
        drawer::slide(scene, drawer, objects, drawn.clamp(0.0, drawer.travel));
    }
}

/// Returns the vessel that catches what leaves the held one: of those it hangs over, the one whose middle is nearest
/// to its own mouth.
fn below(scene: &Scene, objects: &[ObjectState], held: &str) -> Option<String> {
    let pose = |name: &str| objects.iter().find(|o| o.name == name)?.world_from_object;
    let hand = pose(held)?;
    let source = scene.objects.iter().find(|object| object.name == held)?;
    let mouth = fluent::rim_centre(source, &hand);
    let vessels = scene.objects.iter().filter(|o| o.name != held && o.cavity.is_some());
    let over = vessels.filter_map(|object| {
        let under = pose(&object.name)?.origin();
        let gap = (mouth - under).xy().norm();
        let near = gap < object.shape.outer_radius() + BESIDE;
        (near && hand.origin().z > under.z + ABOVE).then_some((gap, &object.name))
    });
    over.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, name)| name.clone())
}
