//! The numbers of the links that an arm's recordings have, in the place of the file's.

use nalgebra::{Matrix3, Vector3};

use super::super::chain::{Body, Chain};
use super::body::NUMBERS;
use crate::discovery::finding::Identified;
use crate::motion::revise::{LinkChange, Revision};

/// The bodies of an arm as its recordings have them.
#[derive(Debug, Clone)]
pub(in super::super) struct Links {
    /// What is added to each body's numbers.
    pub(in super::super) changes: Vec<[f64; NUMBERS]>,
    /// Those that the data tell.
    pub(in super::super) told: Vec<Identified>,
    /// Says which of them is further from the file's than files are off, if one is.
    pub(in super::super) far: Option<String>,
    /// Whether a load was taken beside them.
    pub(in super::super) has_load: bool,
    /// Whether they predict clearly better than the file's with any single link heavier, or with a load.
    pub(in super::super) is_better: bool,
}

impl Links {
    /// Returns what these numbers change in the arm's file, in which its links have the names of its bodies.
    pub(in super::super) fn revision(&self, chain: &Chain) -> Revision {
        let of = |(body, by): (&Body, &[f64; NUMBERS])| LinkChange {
            link: body.name.clone(),
            mass: by[0],
            moment: Vector3::new(by[1], by[2], by[3]),
            inertia: Matrix3::new(by[4], by[5], by[6], by[5], by[7], by[8], by[6], by[8], by[9]),
        };
        let links = chain.bodies.iter().zip(&self.changes).map(of).collect();
        Revision { links, joints: Vec::new() }
    }
}
