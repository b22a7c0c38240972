//! Configurations grown from roots, as a search by samples grows them.
//!
//! Nothing here knows what is in the way.

#![expect(clippy::inline_always, reason = "what is not inlined misses the registers")]

use pulp::f32x8;
use rand::RngExt;
use rand::rngs::StdRng;

use super::lanes::{Eight, Job, LANES, Wide, run};
use super::robot::Robot;
use super::scratch::{FEW, scratch};

/// How far samples may be from a node that was blocked once, and from one that was blocked many times, rad, and by what share
/// that changes: as VAMP has them. With faster tuning, from 0.02 on, 2 to 100 of 419 problems were not solved.
const WIDEST: f64 = 4.0;
const NARROWEST: f64 = 1.0;
const TUNING: f64 = 1e-4;

/// Configurations grown from some roots, each knowing the one it grew from.
pub(super) struct Tree {
    /// One after the other.
    nodes: Vec<f64>,
    /// The same, eight beside each other, joint by joint: to be looked through. What is missing is infinitely far.
    eights: Vec<[f32; LANES]>,
    parents: Vec<Option<usize>>,
    /// Of each: samples farther than this are none of its business, rad.
    domains: Vec<f64>,
    /// Numbers of a configuration.
    n: usize,
}

impl Tree {
    pub(super) fn rooted<'q>(roots: impl IntoIterator<Item = &'q Vec<f64>>) -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            eights: Vec::new(),
            parents: Vec::new(),
            domains: Vec::new(),
            n: 1,
        };
        for root in roots {
            tree.n = root.len();
            tree.add(root, None);
        }
        tree
    }

    pub(super) fn len(&self) -> usize {
        self.parents.len()
    }

    pub(super) fn node(&self, at: usize) -> &[f64] {
        &self.nodes[at * self.n..(at + 1) * self.n]
    }

    /// Returns the node nearest to `q`, up to rounding to 24 bits.
    pub(super) fn nearest(&self, q: &[f64]) -> usize {
        run(Nearest { tree: self, q })
    }

    /// Returns how far samples may be that a node listens to, rad.
    pub(super) fn domain(&self, at: usize) -> f64 {
        self.domains[at]
    }

    /// Takes note that a node could not grow towards a sample: it then listens to nearer ones only.
    pub(super) fn was_blocked(&mut self, at: usize) {
        let domain = &mut self.domains[at];
        *domain =
            if domain.is_finite() { (*domain * (1.0 - TUNING)).max(NARROWEST) } else { WIDEST };
    }

    /// Takes note that a node could grow.
    pub(super) fn has_grown(&mut self, at: usize) {
        self.domains[at] *= 1.0 + TUNING;
    }

    pub(super) fn push(&mut self, q: &[f64], parent: usize) -> usize {
        self.add(q, Some(parent))
    }

    fn add(&mut self, q: &[f64], parent: Option<usize>) -> usize {
        let at = self.len();
        if at.is_multiple_of(LANES) {
            self.eights.resize(self.eights.len() + self.n, [f32::INFINITY; LANES]);
        }
        let eight = &mut self.eights[at / LANES * self.n..];
        for (lanes, x) in eight.iter_mut().zip(q) {
            lanes[at % LANES] = *x as f32;
        }
        self.nodes.extend_from_slice(q);
        self.parents.push(parent);
        self.domains.push(f64::INFINITY);
        at
    }

    /// Returns the way from a node back to its root.
    pub(super) fn trace(&self, from: usize) -> Vec<Vec<f64>> {
        let mut way = Vec::new();
        let mut at = Some(from);
        while let Some(node) = at {
            way.push(self.node(node).to_vec());
            at = self.parents[node];
        }
        way
    }
}

struct Nearest<'a> {
    tree: &'a Tree,
    q: &'a [f64],
}

impl Job for Nearest<'_> {
    type Found = usize;

    #[inline(always)]
    fn with<S: Wide>(self, simd: S) -> usize {
        match self.tree.n {
            6 => self.among::<S, 6>(simd),
            7 => self.among::<S, 7>(simd),
            n => self.least(simd, self.tree.eights.chunks_exact(n)),
        }
    }
}

impl Nearest<'_> {
    /// Looks through the nodes of an arm of so many joints, which is known beforehand: no loop counts them.
    #[inline(always)]
    fn among<S: Wide, const N: usize>(&self, simd: S) -> usize {
        let (eights, _) = self.tree.eights.as_chunks::<N>();
        self.least(simd, eights.iter().map(|eight| &eight[..]))
    }

    /// Returns the nearest of nodes that stand eight beside each other.
    #[inline(always)]
    fn least<'e, S: Wide>(
        &self,
        simd: S,
        eights: impl Iterator<Item = &'e [[f32; LANES]]>,
    ) -> usize {
        let (mut few, mut many) = ([0.0_f32; FEW], Vec::new());
        let q = scratch(self.tree.n, &mut few, &mut many);
        for (short, x) in q.iter_mut().zip(self.q) {
            *short = *x as f32;
        }
        let mut best = (f32::INFINITY, 0);
        for (at, eight) in eights.enumerate() {
            let mut squared = Eight::all(simd, 0.0);
            for (lanes, x) in eight.iter().zip(&*q) {
                let [a, b, c, d, e, f, g, h] = *lanes;
                let gap = Eight::of(simd, f32x8(a, b, c, d, e, f, g, h)) - Eight::all(simd, *x);
                squared = squared + gap * gap;
            }
            if (squared - Eight::all(simd, best.0)).below_zero() != 0 {
                let least = squared.least();
                let lane = (squared - Eight::all(simd, least.next_up())).below_zero();
                best = (least, at * LANES + lane.trailing_zeros() as usize);
            }
        }
        best.1
    }
}

/// Draws a configuration beside one of a tree's own: any distance from a hundredth of a step to half of one is as likely.
///
/// Where hardly any way leads out, what is drawn from all over lies in the wrong direction nearly always.
pub(super) fn beside(robot: &Robot, tree: &Tree, random: &mut StdRng, sample: &mut [f64]) {
    let node = tree.node(random.random_range(0..tree.len()));
    let reach = 10.0_f64.powf(random.random_range(-2.3..-0.3));
    for ((joint, from), x) in robot.joints().iter().zip(node).zip(sample) {
        *x = (from + random.random_range(-reach..reach)).clamp(joint.lower, joint.upper);
    }
}
