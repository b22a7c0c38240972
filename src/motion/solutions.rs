//! One search for joint positions that put the tip at a pose: what is found, and what is found wanting.
//!
//! Which way to search is chosen in [`super::ik`].

use std::f64::consts::{PI, TAU};

use rand::SeedableRng;
use rand::rngs::StdRng;

use super::closed_form::{ClosedForm, Looked, Wanted};
use super::decomposition::Decomposition;
use super::descent::{descend, random_configuration};
use super::frames::Frame;
use super::gate::Gate;
use super::ik::{Options, Solver, distance, wrap};
use super::polish::polish;
use super::window;

/// Starts of the numerical method that differ from where the arm is in joint 3 alone: every 40 deg of a range of 330.
/// Chosen: half of the solutions that are wanted come from them and half from anywhere, as another posture does.
const SWIVELS: usize = 8;
/// A start that is farther outside a joint's limits, rad, is none: polishing moves a joint by less.
const FAR_OUTSIDE: f64 = 0.1;
/// Starts past the limits after which a pose that none led to is out of reach. Chosen: of an arm of five joints one start in two
/// leads to a solution, and at the hardest of 300 poses one in ten.
const GIVEN_UP: usize = 20;

/// One search: what was found, and what was found wanting.
pub(super) struct Search<'s> {
    solver: &'s Solver<'s>,
    near: &'s [f64],
    accept: &'s dyn Fn(&[f64]) -> bool,
    pub(super) found: Vec<Vec<f64>>,
    /// A solution outside the limits was seen.
    pub(super) outside: bool,
    /// The filter refused a solution.
    pub(super) refused: bool,
    /// What the closed form gave, by the value of joint 3.
    swept: Vec<(f64, Looked)>,
}

impl<'s> Search<'s> {
    pub(super) fn new(
        solver: &'s Solver<'s>,
        near: &'s [f64],
        accept: &'s dyn Fn(&[f64]) -> bool,
    ) -> Self {
        let found = Vec::new();
        Self { solver, near, accept, found, outside: false, refused: false, swept: Vec::new() }
    }

    fn take(&mut self, q: &[f64]) {
        match self.solver.fit(q.to_vec(), self.near) {
            None => self.outside = true,
            Some(q) => self.offer(&q, 0),
        }
    }

    /// Keeps a solution inside the limits, if it is unlike those found as number `from` and later and the filter takes
    /// it.
    fn offer(&mut self, q: &[f64], from: usize) {
        if self.found[from..].iter().any(|other| distance(other, q) < 1e-6) {
            return;
        }
        if (self.accept)(q) {
            self.found.push(q.to_vec());
        } else {
            self.refused = true;
        }
    }

    /// Asks the closed form: a sweep over joint 3, and if that finds nothing, what lies between its values.
    pub(super) fn closed(
        &mut self,
        form: &ClosedForm,
        gate: &Gate,
        target: &Frame,
        options: &Options,
    ) {
        let robot = self.solver.robot();
        let wanted = form.wanted(target, self.near);
        self.sweep(form, &wanted, gate, options);
        if self.found.is_empty() && self.outside {
            // Where a joint crosses its limit: at a pose that only joints at their limits reach, a single value of
            // joint 3 serves.
            let swept = std::mem::take(&mut self.swept);
            for q in window::crossings(robot, form, &wanted, gate, &swept) {
                self.take(&q);
            }
        }
    }

    /// Tries the value of joint 3 at hand, then a full turn of it, coarse before fine.
    fn sweep(&mut self, form: &ClosedForm, wanted: &Wanted, gate: &Gate, options: &Options) {
        let solver = self.solver;
        for q3 in self.values(2, options.sweep) {
            let looked = form.branches(solver.robot(), wanted, q3, Some(gate));
            if self.take_nearest(&looked, options.enough) {
                return;
            }
            if self.found.is_empty() {
                if self.swept.is_empty() {
                    // Most that get here try them all.
                    self.swept.reserve(options.sweep.min(128) + 1);
                }
                self.swept.push((q3, looked));
            }
        }
    }

    /// Returns the values of a joint to be tried: the one at hand, then those of a full turn inside its limits, coarse
    /// before fine, and the limits.
    fn values(&self, joint: usize, sweep: usize) -> impl Iterator<Item = f64> + use<'s> {
        let (near, limits) = (self.near[joint], &self.solver.robot().joints()[joint]);
        let swept = (0..=sweep).filter_map(move |k| {
            let value = if k == 0 { near } else { near + TAU * coarse_to_fine(k) };
            let value = if limits.continuous { value } else { wrap(value) };
            (limits.lower..=limits.upper).contains(&value).then_some(value)
        });
        let ends = [limits.lower, limits.upper].into_iter().filter(|end| end.is_finite());
        swept.chain(ends.filter(|_| !limits.continuous))
    }

    /// Asks an arm that comes apart: all its solutions, or those at the values tried of the joint it has to spare, and if
    /// there are none, those between them.
    pub(super) fn by_parts(&mut self, parts: &Decomposition, target: &Frame, options: &Options) {
        let Some(held) = parts.held() else {
            self.at_value(parts, target, 0.0, options.enough);
            return;
        };
        let robot = self.solver.robot();
        let mut swept = Vec::with_capacity(options.sweep + 1);
        for value in self.values(held, options.sweep) {
            let least = self.at_value(parts, target, value, options.enough);
            if self.found.len() >= options.enough {
                return;
            }
            swept.push((value, least));
        }
        if self.found.is_empty() && self.outside {
            let near = self.near;
            let least = |value: f64| {
                let mut least = f64::INFINITY;
                parts.solve(target, value, near, &mut |q| {
                    least = least.min(window::excess(robot, &q));
                });
                least
            };
            for value in window::values(robot, held, &swept, &least) {
                self.at_value(parts, target, value, options.enough);
            }
        }
    }

    /// Takes what fits at one value of the joint to spare, nearest first; returns how far outside its limits the solution is
    /// that is least, rad.
    fn at_value(
        &mut self,
        parts: &Decomposition,
        target: &Frame,
        value: f64,
        enough: usize,
    ) -> f64 {
        let (solver, near) = (self.solver, self.near);
        let mut starts = Vec::with_capacity(8);
        let mut least = f64::INFINITY;
        parts.solve(target, value, near, &mut |q| {
            least = least.min(window::excess(solver.robot(), &q));
            match solver.turned(q, near, FAR_OUTSIDE) {
                Some(q) => starts.push((distance(&q, near), q)),
                None => self.outside = true,
            }
        });
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Other values of the joint that is held give other solutions.
        let first = self.found.len();
        for (_, mut q) in starts {
            if !polish(solver.robot(), target, &mut q, &parts.six) {
                continue;
            }
            match solver.fit(q, near) {
                Some(q) => self.offer(&q, first),
                None => self.outside = true,
            }
            if self.found.len() >= enough {
                break;
            }
        }
        least
    }

    /// Takes what fits of one value of joint 3, nearest first; returns whether there is enough.
    fn take_nearest(&mut self, looked: &Looked, enough: usize) -> bool {
        let mut fit = [[0.0; 7]; 8];
        let mut order = [(0.0, 0); 8];
        let mut n = 0;
        for (branch, beyond) in looked.branches.iter().zip(looked.beyond) {
            let Some(q) = branch else {
                self.outside |= beyond.is_finite();
                continue;
            };
            let Some(q) = self.solver.fit(*q, self.near) else {
                self.outside = true;
                continue;
            };
            // Sorted in: there are eight at most, and those alike keep their order.
            let far = distance(&q, self.near);
            let mut at = n;
            while at > 0 && order[at - 1].0 > far {
                order[at] = order[at - 1];
                at -= 1;
            }
            (fit[n], order[at]) = (q, (far, n));
            n += 1;
        }
        // Other values of joint 3 give other solutions.
        let first = self.found.len();
        for (_, which) in &order[..n] {
            self.offer(&fit[*which], first);
            if self.found.len() >= enough {
                return true;
            }
        }
        false
    }

    pub(super) fn descend(&mut self, target: &Frame, options: &Options, restarts: usize) {
        let robot = self.solver.robot();
        let ranges: Vec<_> = robot.joints().iter().map(|j| (j.lower, j.upper)).collect();
        let mut random = StdRng::seed_from_u64(options.seed);
        // Many starts end in the same few solutions; a handful is enough to choose from.
        let enough = options.enough.min(8);
        // An arm with a joint to spare has the nearest solutions with its elbow turned; joint 3 turns it.
        let is_swept = self.solver.closed_form().is_some();
        let swivels = if robot.n_joints() > 6 && !is_swept { SWIVELS } else { 0 };
        let mut q = self.near.to_vec();
        for start in 1..=restarts {
            if descend(robot, target, &mut q, Some(&ranges), self.solver.give) {
                self.take(&q.clone());
            }
            if self.found.len() >= enough {
                return;
            }
            if start <= swivels {
                q.copy_from_slice(self.near);
                let (low, high) = (ranges[2].0.max(-PI), ranges[2].1.min(PI));
                q[2] = low + (high - low) * coarse_to_fine(start);
            } else {
                q = random_configuration(robot, &mut random);
            }
        }
    }

    /// Looks for one solution of a pose that none was found of from `tried` starts inside the limits: past them, by whole turns
    /// and from where the limits are nearest to a solution outside, then inside from further starts. What no start past them
    /// leads to is given up soon: most poses of an arm of few joints are like that.
    pub(super) fn descend_past_limits(&mut self, target: &Frame, options: &Options, tried: usize) {
        let (solver, robot) = (self.solver, self.solver.robot());
        let ranges: Vec<_> = robot.joints().iter().map(|j| (j.lower, j.upper)).collect();
        let mut random = StdRng::seed_from_u64(options.seed);
        let mut seen: Vec<Vec<f64>> = Vec::new();
        let mut q = self.near.to_vec();
        for start in 0..options.restarts.max(GIVEN_UP) {
            let mut free = q.clone();
            if descend(robot, target, &mut free, None, solver.give) {
                solver.clamp(&mut free);
                if seen.iter().all(|other| distance(other, &free) > 1e-6) {
                    seen.push(free.clone());
                    // It ends at once where whole turns were all that was outside.
                    if descend(robot, target, &mut free, Some(&ranges), solver.give) {
                        self.take(&free);
                    } else {
                        self.outside = true;
                    }
                }
            }
            if start >= tried
                && self.found.is_empty()
                && descend(robot, target, &mut q, Some(&ranges), solver.give)
            {
                self.take(&q);
            }
            let is_lost = start + 1 >= GIVEN_UP && !self.outside;
            if is_lost || self.refused || !self.found.is_empty() {
                return;
            }
            q = random_configuration(robot, &mut random);
        }
    }
}

/// The k-th number of a sequence that fills (0, 1) ever more finely (van der Corput, base 2).
fn coarse_to_fine(k: usize) -> f64 {
    let (mut k, mut value, mut digit) = (k, 0.0, 0.5);
    while k > 0 {
        if k % 2 == 1 {
            value += digit;
        }
        digit *= 0.5;
        k /= 2;
    }
    value
}
