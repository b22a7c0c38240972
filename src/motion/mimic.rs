//! Which joint leads where joints follow each other, and which of them are the arm's and which the gripper's.
//!
//! A `<mimic>` may name a joint that follows another in turn: what counts is the joint at the end of that way, with the factor
//! and the summand of all of it. Joints that follow one another side by side are taken for the gripper's while no tip is known:
//! two fingers are written so, and so is a rod beside an arm. The way to the tip tells them apart: a joint on it is the arm's,
//! and what follows that joint moves with the arm. Only where the tip is on a finger do the gripper's joints end the way.
//!
//! Source: the URDF specification, <http://wiki.ros.org/urdf/XML/joint>: `value = multiplier * other_joint_value + offset`.

use std::collections::BTreeMap;

use urdf_rs::JointType;

use super::error::Error;
use super::fault::UrdfFault;
use super::tree::{self, Step};

/// What a joint follows: its value is `multiplier × value of the joint that leads + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lead {
    /// Place in the order of the link that the leading joint carries; the joint's own where it follows none.
    pub(super) at: usize,
    /// Factor; 1 for a joint that leads.
    pub(super) multiplier: f64,
    /// Summand, rad or m.
    pub(super) offset: f64,
}

/// Which joints follow which, whatever the tip is. All lists have an entry for each link of the order.
#[derive(Debug)]
pub(super) struct Mimics {
    leads: Vec<Lead>,
    jaws: Vec<bool>,
    moves: Vec<bool>,
    slides: Vec<bool>,
    /// For a joint that leads: whether what follows it ends in two chains side by side, of two joints or more, as knuckles do.
    chains: Vec<bool>,
}

/// What the joints are for one tip.
#[derive(Debug)]
pub(super) struct Roles<'m> {
    /// Per link of the order: what its joint follows.
    pub(super) leads: &'m [Lead],
    /// Per link of the order: whether its joint is the gripper's.
    pub(super) jaws: Vec<bool>,
    /// The links whose joints are the entries of q, base first.
    pub(super) entries: Vec<usize>,
}

impl Mimics {
    /// Looks what every joint follows.
    ///
    /// # Errors
    ///
    /// [`Error::Urdf`] for a joint that follows one that is not there, or in the end itself.
    pub(super) fn of(urdf: &urdf_rs::Robot, order: &[Step]) -> Result<Self, Error> {
        let kind = |at: usize| order[at].joint.map(|joint| &urdf.joints[joint].joint_type);
        let all = 0..order.len();
        let moves: Vec<bool> =
            all.clone().map(|at| kind(at).is_some_and(|kind| *kind != JointType::Fixed)).collect();
        let slides = all.map(|at| kind(at) == Some(&JointType::Prismatic)).collect();
        let leads = leads(urdf, order)?;
        let jaws = side_by_side(order, &leads);
        let chains = chains(order, &leads, &moves);
        Ok(Self { leads, jaws, moves, slides, chains })
    }

    /// Returns, per link of the order, whether its joint moves with another that is neither above nor below it, as the two
    /// fingers of a gripper do, or follows one that does.
    pub(super) fn jaws(&self) -> &[bool] {
        &self.jaws
    }

    /// Returns what the joints are for a tip.
    pub(super) fn roles(&self, order: &[Step], tip: usize) -> Roles<'_> {
        let path = tree::path(order, tip).into_iter();
        let moving: Vec<usize> = path.filter(|&at| self.moves[at]).collect();
        let fingers = self.fingers(&moving);
        let mut of_arm = vec![false; order.len()];
        for &at in &moving {
            let lead = self.leads[at].at;
            of_arm[lead] |= fingers != Some(lead);
        }
        let is_jaw = |at: usize| self.jaws[at] && !of_arm[self.leads[at].at];
        let jaws: Vec<bool> = (0..order.len()).map(is_jaw).collect();
        Roles { leads: &self.leads, entries: self.entries(&moving, &jaws), jaws }
    }

    /// Returns what leads the last of the joints that move on the way to a tip, if those are fingers: they slide, or they are
    /// knuckles, and no other joint stands between them or beyond.
    fn fingers(&self, moving: &[usize]) -> Option<usize> {
        let lead = self.leads[*moving.last()?].at;
        let own: Vec<usize> =
            moving.iter().copied().filter(|&at| self.leads[at].at == lead).collect();
        let is_gripper = self.chains[lead] || own.iter().all(|&at| self.slides[at]);
        (self.jaws[lead] && is_gripper && moving.ends_with(&own)).then_some(lead)
    }

    /// Returns which of the joints that move on the way are entries of q: those that lead, and where what leads stands beside
    /// the way the first that follows it.
    fn entries(&self, moving: &[usize], jaws: &[bool]) -> Vec<usize> {
        let mut on_way = vec![false; jaws.len()];
        for &at in moving {
            on_way[at] = true;
        }
        let mut is_led = vec![false; jaws.len()];
        let mut entries = Vec::new();
        for &at in moving.iter().filter(|&&at| !jaws[at]) {
            let lead = &self.leads[at];
            let is_entry = if on_way[lead.at] {
                lead.at == at
            } else {
                self.moves[lead.at] && !is_led[lead.at] && lead.multiplier.is_normal()
            };
            if is_entry {
                is_led[lead.at] = true;
                entries.push(at);
            }
        }
        entries
    }
}

/// Returns what each joint follows in the end.
fn leads(urdf: &urdf_rs::Robot, order: &[Step]) -> Result<Vec<Lead>, Error> {
    let name = |at: usize| order[at].joint.map(|joint| urdf.joints[joint].name.as_str());
    let places: BTreeMap<&str, usize> =
        (0..order.len()).filter_map(|at| Some((name(at)?, at))).collect();
    let followed = |at: usize| {
        let joint = &urdf.joints[order[at].joint?];
        joint.mimic.as_ref().filter(|_| joint.joint_type != JointType::Fixed)
    };
    let name_of = |at: usize| name(at).unwrap_or_default().to_owned();
    let lead_of = |own: usize| {
        let mut lead = Lead { at: own, multiplier: 1.0, offset: 0.0 };
        let mut passed = Vec::new();
        while let Some(mimic) = followed(lead.at) {
            passed.push(lead.at);
            let Some(&at) = places.get(mimic.joint.as_str()) else {
                let (joint, master) = (name_of(lead.at), mimic.joint.clone());
                return Err(Error::Urdf { what: UrdfFault::NoMaster { joint, master } });
            };
            if let Some(first) = passed.iter().position(|&before| before == at) {
                let what = if at == lead.at {
                    UrdfFault::FollowsItself { joint: name_of(at) }
                } else {
                    let joints = passed[first..].iter().map(|&at| name_of(at)).collect();
                    UrdfFault::Circle { joints }
                };
                return Err(Error::Urdf { what });
            }
            lead.offset += lead.multiplier * mimic.offset.unwrap_or(0.0);
            lead.multiplier *= mimic.multiplier.unwrap_or(1.0);
            lead.at = at;
        }
        Ok(lead)
    };
    (0..order.len()).map(lead_of).collect()
}

/// Returns, per link, whether its joint or one with the same lead moves beside the one that leads, neither above nor below it.
fn side_by_side(order: &[Step], leads: &[Lead]) -> Vec<bool> {
    let is_above = |high: usize, low: usize| {
        std::iter::successors(Some(low), |&at| order[at].parent).any(|at| at == high)
    };
    let mut beside = vec![false; order.len()];
    for (at, lead) in leads.iter().enumerate() {
        beside[lead.at] |= !is_above(lead.at, at) && !is_above(at, lead.at);
    }
    leads.iter().map(|lead| beside[lead.at]).collect()
}

/// Returns for each joint that leads whether the joints of that lead make two chains of the same length, two or more, and no
/// longer one: each finger of a gripper with knuckles has a knuckle and a tip that turns back.
fn chains(order: &[Step], leads: &[Lead], moves: &[bool]) -> Vec<bool> {
    let mut depth = vec![0_usize; order.len()];
    let mut most = vec![0; order.len()];
    for at in (0..order.len()).filter(|&at| moves[at]) {
        let lead = leads[at].at;
        let mut above = std::iter::successors(order[at].parent, |&up| order[up].parent);
        let before = above.find(|&up| moves[up] && leads[up].at == lead);
        depth[at] = 1 + before.map_or(0, |up| depth[up]);
        most[lead] = depth[at].max(most[lead]);
    }
    let mut deepest = vec![0_usize; order.len()];
    for (at, lead) in leads.iter().enumerate() {
        deepest[lead.at] += usize::from(depth[at] > 0 && depth[at] == most[lead.at]);
    }
    most.into_iter().zip(deepest).map(|(most, count)| most > 1 && count == 2).collect()
}
