//! A robot: links, joints and limits, read from a URDF and constant from then on.
//!
//! Joint positions `q` are those of the moving joints between the root link and the *tip*, base first.
//! Joints off that path are the gripper's jaws, which are not part of `q` but follow one number, the
//! opening, or follow a joint of the arm, as a rod beside it does. Where links are for some `q` is
//! [`super::kinematics`]; torques are [`super::dynamics`].
//!
//! This is the program's one model of an arm: planning, the twin's physics, its pictures and the lab all
//! take theirs from it. An arm that differs from its file (zeros, mounting) is another [`Robot`].

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use nalgebra::{Point3, Translation3, Vector3};

use super::bounds;
use super::error::Error;
use super::fault::{MeshFault, Note, UrdfFault};
use super::frames::{Frame, Frames};
use super::lacking::{lacking, out_of_place};
pub use super::links::{Drive, Joint, JointLimits, Link, Marker, Motion, Visual};
use super::mesh;
use super::mimic::Mimics;
use super::side;
use super::tree;
use crate::files;
use crate::world::frame::{Flange, Point, Pose, Tool};

/// The stdlib Gen3 with a 2F-85 gripper.
const GEN3_URDF: &str = include_str!("../../stdlib/robots/gen3_2f85/gen3_2f85.urdf");
/// What its URDF has no place for.
const GEN3_SIDE: &str = include_str!("../../stdlib/robots/gen3_2f85/robot.toml");

/// A robot, constant.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    pub(super) name: String,
    pub(super) links: Vec<Link>,
    pub(super) joints: Vec<JointLimits>,
    pub(super) tip: usize,
    /// Links from the root's child to the tip.
    pub(super) path: Vec<usize>,
    pub(super) flange_from_tool: Pose<Flange, Tool>,
    pub(super) tool: Option<usize>,
    pub(super) marker: Option<Marker>,
    pub(super) unchecked: Vec<(usize, usize)>,
    pub(super) poses: BTreeMap<String, Vec<f64>>,
    pub(super) min_opening: f64,
    pub(super) max_opening: f64,
    pub(super) notes: Vec<Note>,
    pub(super) has_side_file: bool,
    /// Whether the files say how fast every joint may gain speed.
    pub(super) states_accelerations: bool,
    /// The driven joints up to the tip, derived from `links` and `path`.
    pub(super) way: Frames,
    /// The tip in the last frame of `way`.
    pub(super) way_end: Frame,
}

/// Whether a text is what URDFs are made from: the names of that language's own, or values that it would fill in.
fn is_xacro(text: &str) -> bool {
    ["<xacro:", "${", "$(arg ", "$(find "].iter().any(|word| text.contains(word))
}

/// Says why a text that its reader refuses is none.
fn not_a_urdf(text: &str, error: &urdf_rs::UrdfError) -> UrdfFault {
    let said = error.to_string();
    let root = bounds::tags(text).next().map(|(_, tag)| bounds::name_of(tag));
    if is_xacro(text) {
        return UrdfFault::Xacro;
    }
    if root != Some("robot") {
        return UrdfFault::Format(said);
    }
    let field = said.split_once("missing field `").and_then(|(_, rest)| rest.split_once('`'));
    let lacks = field.and_then(|(field, _)| lacking(text, field));
    lacks
        .or_else(|| out_of_place(text, &said))
        .unwrap_or_else(|| UrdfFault::Content(said.trim_start_matches("custom: ").to_owned()))
}

/// Reads a mesh by its name, of the files in a folder.
type ReadMesh = dyn Fn(&Path, &str) -> Result<Vec<u8>, MeshFault>;

impl Robot {
    /// Returns the stdlib robot: a Kinova Gen3 with seven joints and a Robotiq 2F-85.
    pub fn gen3() -> Self {
        Self::from_urdf_with(GEN3_URDF, GEN3_SIDE, None)
            .expect("the embedded robot is read by the tests")
    }

    /// As [`Self::gen3`], with `q` and poses up to another link.
    ///
    /// # Errors
    ///
    /// [`Error::NoLink`] if the robot has no link `tip`.
    pub fn gen3_to(tip: &str) -> Result<Self, Error> {
        Self::from_urdf_with(GEN3_URDF, GEN3_SIDE, Some(tip))
    }

    /// Reads a robot from the text of a URDF; `tip` names the link whose pose is meant, and where `q`
    /// ends. Without it: the well-known name for a flange that the file has, else the end of the chain.
    ///
    /// # Errors
    ///
    /// [`Error::Urdf`] for text that is not a URDF of one tree, [`Error::NoLink`] for an unknown tip,
    /// [`Error::Branches`] when the file has several arms and no tip was named.
    pub fn from_urdf(text: &str, tip: Option<&str>) -> Result<Self, Error> {
        Self::from_urdf_with(text, "", tip)
    }

    /// As [`Self::from_urdf`], with a side file (see `stdlib/robots/gen3_2f85/robot.toml`).
    ///
    /// # Errors
    ///
    /// As [`Self::from_urdf`], and [`Error::SideFile`].
    pub fn from_urdf_with(text: &str, side: &str, tip: Option<&str>) -> Result<Self, Error> {
        Self::from_urdf_beside(text, side, tip, &mesh::nowhere)
    }

    /// As [`Self::from_urdf_with`], with the meshes that the text names from `meshes`. A mesh that there is none of, or
    /// that is not read, is left out and noted.
    ///
    /// # Errors
    ///
    /// As [`Self::from_urdf_with`].
    pub fn from_urdf_beside(
        text: &str,
        side: &str,
        tip: Option<&str>,
        meshes: &mesh::Source<'_>,
    ) -> Result<Self, Error> {
        let side_file = side::SideFile::parse(side)?;
        bounds::check(text)?;
        let mut urdf = urdf_rs::read_from_string(text)
            .map_err(|error| Error::Urdf { what: not_a_urdf(text, &error) })?;
        if urdf.links.is_empty() {
            let what = if is_xacro(text) { UrdfFault::Xacro } else { UrdfFault::NoLink };
            return Err(Error::Urdf { what });
        }
        let order = tree::order(&urdf)?;
        let mimics = Mimics::of(&urdf, &order)?;
        let meant = |name: Option<&str>| match name {
            Some(name) => order
                .iter()
                .position(|step| urdf.links[step.link].name == name)
                .ok_or_else(|| Error::NoLink {
                    name: name.to_owned(),
                    known: urdf.links.iter().map(|link| link.name.clone()).collect(),
                }),
            None => tree::default_tip(&urdf, &order, mimics.jaws()),
        };
        let own = side_file.tip.as_deref();
        let tip = match tip {
            Some(_) => meant(tip)?,
            None => meant(own).map_err(side::named_in_file("tip"))?,
        };
        // Of several arms each has a pose of its own length.
        let count = |tip| mimics.roles(&order, tip).entries.len();
        let whole =
            meant(own).map_or_else(|_| (0..order.len()).map(count).max(), |tip| Some(count(tip)));
        let whole = whole.unwrap_or_default();
        let mut robot = Self {
            name: std::mem::take(&mut urdf.name),
            links: Vec::with_capacity(order.len()),
            joints: Vec::new(),
            tip,
            path: tree::path(&order, tip),
            flange_from_tool: Pose::identity(),
            tool: None,
            marker: None,
            unchecked: Vec::new(),
            poses: BTreeMap::new(),
            min_opening: 0.0,
            max_opening: 0.0,
            notes: Vec::new(),
            has_side_file: false,
            states_accelerations: true,
            way: Frames::default(),
            way_end: Frame::base(),
        };
        robot.add_links(&urdf, &order, meshes)?;
        robot.drive_joints(&urdf, &order, &mimics.roles(&order, tip))?;
        side_file.apply(&mut robot, whole)?;
        robot.join_frames();
        robot.place_tool();
        Ok(robot)
    }

    /// Reads a robot from a URDF file, or from the one in a folder, and from `robot.toml` and meshes beside it if there
    /// are any.
    ///
    /// # Errors
    ///
    /// [`Error::File`] if a file cannot be read; otherwise as [`Self::from_urdf_with`].
    pub fn from_file(path: &Path, tip: Option<&str>) -> Result<Self, Error> {
        Self::from_file_with(path, tip, &mesh::beside)
    }

    /// As [`Self::from_file`], for whoever asks where links are and what they weigh, not what they touch: without its meshes,
    /// whose solids take long to find. Jaws that turn are coupled by the shapes of their pads: a robot that has some on the
    /// way to the tip, or `with_jaws` any, is read with its meshes all the same.
    ///
    /// # Errors
    ///
    /// As [`Self::from_file`].
    pub fn bare_from_file(path: &Path, tip: Option<&str>, with_jaws: bool) -> Result<Self, Error> {
        let bare = Self::from_file_with(path, tip, &|_, name| mesh::not_asked(name))?;
        let follows = |link: usize| bare.links[link].joint.drive.is_of_gripper();
        let matters = if with_jaws {
            (0..bare.links.len()).any(follows)
        } else {
            bare.path.iter().any(|&link| follows(link))
        };
        if matters { Self::from_file(path, tip) } else { Ok(bare) }
    }

    fn from_file_with(path: &Path, tip: Option<&str>, meshes: &ReadMesh) -> Result<Self, Error> {
        let inside = if path.is_dir() { only_urdf(path)? } else { None };
        let path = inside.as_deref().unwrap_or(path);
        let read = |path: &Path| {
            files::read::text(path).map_err(|error| Error::File {
                path: path.display().to_string(),
                what: error.to_string(),
            })
        };
        let text = read(path)?;
        let beside = path.with_file_name("robot.toml");
        let side = if beside.is_file() { read(&beside)? } else { String::new() };
        let folder = path.parent().unwrap_or(Path::new(""));
        Self::from_urdf_beside(&text, &side, tip, &|name: &str| meshes(folder, name))
    }

    /// Joins what is rigid on the way to the tip.
    fn join_frames(&mut self) {
        let mut on_way = vec![false; self.links.len()];
        for &link in &self.path {
            on_way[link] = true;
        }
        self.way = Frames::of(&self.links, 0.0, |link| on_way[link]);
        self.way_end = Frame::of(&self.way.links[self.tip].1);
    }

    /// Works out where the tool sits on the tip; both are rigid, so any `q` tells it.
    fn place_tool(&mut self) {
        let Some(tool) = self.tool else { return };
        let poses = self.link_poses(&vec![0.0; self.n_joints()], 0.0).expect("zeros fit any robot");
        self.flange_from_tool = Pose::new(poses[self.tip].inv_mul(&poses[tool]));
    }

    /// Returns the robot's name in its file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the links, parents before their children; index 0 is the root.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// Returns the limits of each entry of `q`.
    pub fn joints(&self) -> &[JointLimits] {
        &self.joints
    }

    /// Returns whether an entry of `q` is the way of a joint that slides, m, not an angle, rad.
    pub fn slides(&self, joint: usize) -> bool {
        self.links[self.joints[joint].link].joint.motion == Motion::Slide
    }

    /// Returns [`Self::slides`] of each entry of `q`.
    pub fn sliding(&self) -> Vec<bool> {
        (0..self.n_joints()).map(|joint| self.slides(joint)).collect()
    }

    /// Returns the number of entries of `q`.
    pub fn n_joints(&self) -> usize {
        self.joints.len()
    }

    /// Returns the index of the tip link.
    pub fn tip(&self) -> usize {
        self.tip
    }

    /// Returns the index of the tool link, if the side file names one.
    pub fn tool(&self) -> Option<usize> {
        self.tool
    }

    /// Returns the marker ball, if the side file describes one.
    pub fn marker(&self) -> Option<&Marker> {
        self.marker.as_ref()
    }

    /// Returns the centre of the marker ball in the flange's frame, m; both are rigid, so any `q` tells it.
    pub fn marker_in_flange(&self) -> Option<Point<Flange>> {
        let marker = self.marker?;
        let poses = self.link_poses(&vec![0.0; self.n_joints()], 0.0).ok()?;
        let flange_from_link = poses[self.tip].inv_mul(&poses[marker.link]);
        Some(Point::from((flange_from_link * Point3::from(marker.centre)).coords))
    }

    /// Returns this robot with other zeros: where it reads 0 rad, joint `i` stands at `offsets[i]` rad.
    ///
    /// Joints beyond the end of `offsets` keep theirs.
    #[must_use]
    pub fn with_zero_offsets(mut self, offsets: &[f64]) -> Self {
        for (limits, &offset) in self.joints.iter().zip(offsets) {
            let joint = &mut self.links[limits.link].joint;
            joint.parent_from_link = joint.parent_from_link(offset);
        }
        self.join_frames();
        self
    }

    /// Returns this robot with its speeds and accelerations held to these, rad/s and rad/s², where its own
    /// are higher.
    ///
    /// Joints beyond the end of a list keep theirs.
    #[must_use]
    pub fn with_limits(mut self, velocity: &[f64], acceleration: &[f64]) -> Self {
        for (joint, &most) in self.joints.iter_mut().zip(velocity) {
            joint.velocity = joint.velocity.min(most);
        }
        for (joint, &most) in self.joints.iter_mut().zip(acceleration) {
            joint.acceleration = joint.acceleration.min(most);
        }
        self
    }

    /// Returns this robot with ranges that let every joint that turns go a whole turn, half of it to either side.
    #[must_use]
    pub fn with_whole_turns(mut self) -> Self {
        for i in (0..self.joints.len()).filter(|&i| !self.slides(i)).collect::<Vec<_>>() {
            let joint = &mut self.joints[i];
            (joint.lower, joint.upper) = (joint.lower.min(-PI), joint.upper.max(PI));
        }
        self
    }

    /// Returns this robot with everything that is mounted on the tip moved by `shift` m, tip axes.
    #[must_use]
    pub fn with_tool_shift(mut self, shift: Vector3<f64>) -> Self {
        for link in &mut self.links {
            if link.parent == Some(self.tip) {
                let origin = &mut link.joint.parent_from_link;
                *origin = Translation3::from(shift) * *origin;
            }
        }
        self.place_tool();
        self
    }

    /// Returns the index of the link of that name.
    ///
    /// # Errors
    ///
    /// [`Error::NoLink`].
    pub fn link(&self, name: &str) -> Result<usize, Error> {
        self.links.iter().position(|link| link.name == name).ok_or_else(|| Error::NoLink {
            name: name.into(),
            known: self.links.iter().map(|link| link.name.clone()).collect(),
        })
    }

    /// Returns the link whose joint moves this one: itself, or what it is fixed to, through however many links; the root
    /// where no joint does.
    pub fn carrier(&self, link: usize) -> usize {
        let mut at = link;
        while let (Motion::Fixed, Some(parent)) =
            (self.links[at].joint.motion, self.links[at].parent)
        {
            at = parent;
        }
        at
    }

    /// Returns a pose the side file names (`home`, `retract`, `zero`), rad, and m for what slides.
    ///
    /// # Errors
    ///
    /// [`Error::NoPose`].
    pub fn pose(&self, name: &str) -> Result<&[f64], Error> {
        self.poses.get(name).map(Vec::as_slice).ok_or_else(|| Error::NoPose {
            name: name.into(),
            known: self.poses.keys().cloned().collect(),
        })
    }

    /// Returns the named poses, rad, and m for what slides.
    pub fn poses(&self) -> &BTreeMap<String, Vec<f64>> {
        &self.poses
    }

    /// Returns the widest opening between the jaws, m; 0 without jaws.
    pub fn max_opening(&self) -> f64 {
        self.max_opening
    }

    /// Returns the opening between the jaws where their ranges end inwards, m; 0 of jaws that close all the way.
    pub fn min_opening(&self) -> f64 {
        self.min_opening
    }

    /// Returns pairs of links that need no collision check, besides parents and children.
    pub fn unchecked(&self) -> &[(usize, usize)] {
        &self.unchecked
    }

    /// Returns whether a side file said which pairs need no check.
    pub fn has_side_file(&self) -> bool {
        self.has_side_file
    }

    /// Returns whether the files say how fast every joint may gain speed; else it is assumed.
    pub fn states_accelerations(&self) -> bool {
        self.states_accelerations
    }

    /// Returns what was left out or assumed when the file was read, one sentence each.
    pub fn notes(&self) -> &[Note] {
        &self.notes
    }

    /// Checks that `q` has one entry per joint, finite and not so large that a turn is lost in its rounding.
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`], [`Error::NotFinite`] or [`Error::TooFar`].
    pub fn check(&self, q: &[f64]) -> Result<(), Error> {
        // Sixteen thousand turns, known to 1e-11 rad.
        const MOST: f64 = 1e5;
        if q.len() != self.n_joints() {
            return Err(Error::WrongLength { expected: self.n_joints(), found: q.len() });
        }
        // Not a number is not within it either. Without a way out of the loop: this is asked before every pose.
        if q.iter().fold(true, |fit, x| fit & (x.abs() <= MOST)) {
            return Ok(());
        }
        let is_no = |x: &f64| !x.is_finite() || x.abs() > MOST;
        let index = q.iter().position(is_no).expect("one of them does not fit");
        let joint = self.joints[index].name.clone();
        Err(if q[index].is_finite() {
            Error::TooFar { joint, value: q[index], most: MOST }
        } else {
            Error::NotFinite { joint }
        })
    }

    /// Returns the first joint that is more than `slack` outside its range, rad or m, if any: room for rounding.
    pub fn outside_limits(&self, q: &[f64], slack: f64) -> Option<usize> {
        (0..self.n_joints())
            .find(|&i| q[i] < self.joints[i].lower - slack || q[i] > self.joints[i].upper + slack)
    }
}

/// Returns the URDF in a folder, if there is one and no other.
fn only_urdf(folder: &Path) -> Result<Option<PathBuf>, Error> {
    let no = |error: io::Error| Error::File {
        path: folder.display().to_string(),
        what: error.to_string(),
    };
    let mut found = None;
    for entry in fs::read_dir(folder).map_err(no)? {
        let path = entry.map_err(no)?.path();
        if path.extension().is_some_and(|ending| ending == "urdf") {
            if found.is_some() {
                let folder = folder.display().to_string();
                return Err(Error::Urdf { what: UrdfFault::SeveralFiles { folder } });
            }
            found = Some(path);
        }
    }
    Ok(found)
}
