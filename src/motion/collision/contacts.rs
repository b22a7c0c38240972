//! How often what of a robot is near to what of it, over joint positions drawn at random.
//!
//! A pair that is near at most of them hinders every plan, and as a rule it is the shapes that are near there and not the
//! arm. Pairs that are not checked are not asked.

use std::collections::BTreeMap;

use rand::SeedableRng;
use rand::rngs::StdRng;

use super::super::descent::random_configuration;
use super::CollisionWorld;
use super::clearance::Pair;

/// What of a robot is near to itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Contacts {
    /// At how many positions it touches itself nowhere.
    pub free: usize,
    /// The pairs that were near, that which was so most often first.
    pub pairs: Vec<Contact>,
}

/// How often two links are near to each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// The links.
    pub links: [String; 2],
    /// At how many positions they are near or touch.
    pub near: usize,
    /// At how many they touch.
    pub touching: usize,
    /// The smallest signed distance, m.
    pub least: f64,
}

impl CollisionWorld<'_> {
    /// Returns how often links are within `room` m of each other at `positions` joint positions inside the limits, drawn with
    /// the same seed always.
    pub fn contacts(&self, positions: usize, room: f64) -> Contacts {
        let mut random = StdRng::seed_from_u64(0);
        let mut free = 0;
        let mut found: BTreeMap<(usize, usize), (usize, usize, f64)> = BTreeMap::new();
        for _ in 0..positions {
            let q = random_configuration(self.robot, &mut random);
            let mut touches = false;
            for (pair, distance) in self.touching(&q, room) {
                let Pair::Parts(first, second) = pair else { continue };
                let (near, touching, least) =
                    found.entry((first, second)).or_insert((0, 0, f64::INFINITY));
                *near += 1;
                *touching += usize::from(distance <= 0.0);
                *least = least.min(distance);
                touches |= distance <= 0.0;
            }
            free += usize::from(!touches);
        }
        let mut pairs = Vec::with_capacity(found.len());
        for ((first, second), (near, touching, least)) in found {
            let links = [first, second].map(|part| self.parts[part].name.clone());
            pairs.push(Contact { links, near, touching, least });
        }
        pairs.sort_by_key(|pair| std::cmp::Reverse(pair.near));
        Contacts { free, pairs }
    }
}
