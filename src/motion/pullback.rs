//! Policies of points, directions and joints carried to the joints: what each asks for adds up to one metric and one force.
//!
//! A policy asks for an acceleration `a` of its own coordinate, `M` times as much as others do. With the Jacobian `J` of the
//! coordinate it becomes the metric `Jᵀ M J` and the force `Jᵀ M (a - J̇ q̇)` of all joints; their sum is resolved by one
//! system of equations. What is said about points of one link is gathered there first.
//!
//! Source: Cheng et al., "RMPflow: a geometric framework for generation of multitask motion policies", 2018; twists and
//! their drift: Featherstone, *Rigid Body Dynamics Algorithms*, §2.9.

use nalgebra::{Matrix3xX, Vector3, Vector6};

use super::cholesky;
use super::frames::{Frame, Frames};
use super::rmp::{INERTIA, Pull, Pull3};

/// Memory of a step, used again.
#[derive(Debug, Default)]
pub(super) struct Gathered {
    /// Time of a step, s, at whose end damping acts.
    step: f64,
    pub(super) placed: Vec<Frame>,
    /// Per node: the twist about the base's origin that each joint gives it, six numbers a joint; its twist; and the
    /// acceleration of that without any of the joints.
    columns: Vec<Vec<f64>>,
    twists: Vec<Vector6<f64>>,
    drifts: Vec<Vector6<f64>>,
    /// Per node: metric and force of all that was said about points on it, 6 × 6 and 6.
    metric: Vec<[f64; 36]>,
    force: Vec<Vector6<f64>>,
    /// Of all joints, n × n and n.
    root: Vec<f64>,
    pull: Vec<f64>,
}

impl Gathered {
    pub(super) fn new(step: f64) -> Self {
        Self { step, ..Self::default() }
    }

    /// Puts frames where the joints are and works out how each moves.
    pub(super) fn place(&mut self, frames: &Frames, q: &[f64], dq: &[f64]) {
        let (n, count) = (q.len(), frames.nodes.len());
        frames.place(q, &mut self.placed);
        self.columns.resize(count, Vec::new());
        self.twists.resize(count, Vector6::zeros());
        self.drifts.resize(count, Vector6::zeros());
        self.metric.clear();
        self.metric.resize(count, [0.0; 36]);
        self.force.clear();
        self.force.resize(count, Vector6::zeros());
        self.root.clear();
        self.root.resize(n * n, 0.0);
        self.pull.clear();
        self.pull.resize(n, 0.0);
        for i in 0..n {
            self.root[i * n + i] = INERTIA;
        }
        for (k, node) in frames.nodes.iter().enumerate() {
            let frame = self.placed[k];
            let axis = frame.z * node.multiplier;
            let (linear, turn) = if node.slides {
                (axis, Vector3::zeros())
            } else {
                (frame.origin.cross(&axis), axis)
            };
            let (mut columns, mut twist, mut drift) = match node.parent {
                Some(parent) => {
                    (self.columns[parent].clone(), self.twists[parent], self.drifts[parent])
                }
                None => (vec![0.0; 6 * n], Vector6::zeros(), Vector6::zeros()),
            };
            let own = Vector6::new(linear.x, linear.y, linear.z, turn.x, turn.y, turn.z);
            for i in 0..6 {
                columns[6 * node.index + i] += own[i];
            }
            let own = own * dq[node.index];
            twist += own;
            // The axis is carried along: Featherstone's `v × S q̇`.
            let (v, w) = (twist.fixed_rows::<3>(0), twist.fixed_rows::<3>(3));
            let (a, b) = (own.fixed_rows::<3>(0), own.fixed_rows::<3>(3));
            let mut linear = drift.fixed_rows_mut::<3>(0);
            linear += w.cross(&a) + v.cross(&b);
            let mut turning = drift.fixed_rows_mut::<3>(3);
            turning += w.cross(&b);
            self.columns[k] = columns;
            self.twists[k] = twist;
            self.drifts[k] = drift;
        }
    }

    /// Adds a policy of one coordinate of a point on a node: `row` carries the node's twist to the coordinate's rate, and
    /// `drift` is how fast that grows without any acceleration of the joints. Its damping acts at the end of the step.
    pub(super) fn add_on(
        &mut self,
        node: usize,
        row: &Vector6<f64>,
        pull: &Pull,
        rate: f64,
        drift: f64,
    ) {
        let metric = pull.metric * (1.0 + self.step * pull.damping);
        let whole = &mut self.metric[node];
        for j in 0..6 {
            for i in 0..6 {
                whole[6 * j + i] += metric * row[i] * row[j];
            }
        }
        self.force[node] += row * (pull.metric * (pull.push - pull.damping * rate - drift));
    }

    /// Carries what was said about points on nodes to the joints.
    pub(super) fn gather(&mut self) {
        let n = self.pull.len();
        for (node, columns) in self.columns.iter().enumerate() {
            let (metric, force) = (&self.metric[node], &self.force[node]);
            if metric[0] + metric[7] + metric[14] == 0.0 {
                continue;
            }
            for j in 0..n {
                let column = Vector6::from_column_slice(&columns[6 * j..6 * j + 6]);
                if column == Vector6::zeros() {
                    continue;
                }
                self.pull[j] += column.dot(force);
                let mut weighed = Vector6::<f64>::zeros();
                for k in 0..6 {
                    for i in 0..6 {
                        weighed[i] += metric[6 * k + i] * column[k];
                    }
                }
                for i in 0..n {
                    let other = &columns[6 * i..6 * i + 6];
                    let share: f64 = other.iter().zip(&weighed).map(|(a, b)| a * b).sum();
                    self.root[j * n + i] += share;
                }
            }
        }
    }

    /// Adds a policy of a joint, of which the coordinate is `slope` times as fast as the joint.
    pub(super) fn add_joint(&mut self, joint: usize, slope: f64, pull: &Pull, rate: f64) {
        let n = self.pull.len();
        self.root[joint * n + joint] +=
            slope * slope * pull.metric * (1.0 + self.step * pull.damping);
        self.pull[joint] += slope * pull.metric * (pull.push - pull.damping * rate);
    }

    /// Adds a policy of a point on a node.
    pub(super) fn add_point(&mut self, node: usize, at: &Vector3<f64>, pull: &Pull3) {
        let (velocity, drift) = self.motion(node, at);
        let jacobian = self.jacobian(node, |linear, turn| linear + turn.cross(at));
        self.add3(&jacobian, pull, &velocity, &drift);
    }

    /// Adds a policy of a direction that is fixed to a node.
    pub(super) fn add_axis(&mut self, node: usize, axis: &Vector3<f64>, pull: &Pull3) {
        let turn = self.twists[node].fixed_rows::<3>(3).into_owned();
        let rate = turn.cross(axis);
        let drift = self.drifts[node].fixed_rows::<3>(3).cross(axis) + turn.cross(&rate);
        let jacobian = self.jacobian(node, |_, turn| turn.cross(axis));
        self.add3(&jacobian, pull, &rate, &drift);
    }

    fn jacobian(
        &self,
        node: usize,
        of: impl Fn(Vector3<f64>, Vector3<f64>) -> Vector3<f64>,
    ) -> Matrix3xX<f64> {
        let columns = self.columns[node]
            .chunks_exact(6)
            .map(|c| of(Vector3::from_column_slice(&c[..3]), Vector3::from_column_slice(&c[3..])));
        Matrix3xX::from_columns(&columns.collect::<Vec<_>>())
    }

    fn add3(
        &mut self,
        jacobian: &Matrix3xX<f64>,
        pull: &Pull3,
        rate: &Vector3<f64>,
        drift: &Vector3<f64>,
    ) {
        let n = self.pull.len();
        let weighed = pull.metric * jacobian;
        let force = pull.metric * (pull.push - rate * pull.damping - drift);
        for j in 0..n {
            self.pull[j] += jacobian.column(j).dot(&force);
            for i in 0..n {
                let share = jacobian.column(i).dot(&weighed.column(j));
                self.root[j * n + i] += share * (1.0 + self.step * pull.damping);
            }
        }
    }

    /// How fast a point moves that is fixed to a node, m/s, and how fast that grows without any acceleration of the joints,
    /// m/s².
    pub(super) fn motion(&self, node: usize, at: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        let (twist, drift) = (self.twists[node], self.drifts[node]);
        let turn = twist.fixed_rows::<3>(3);
        let velocity = twist.fixed_rows::<3>(0) + turn.cross(at);
        let own = drift.fixed_rows::<3>(0) + drift.fixed_rows::<3>(3).cross(at);
        (velocity, own + turn.cross(&velocity))
    }

    /// Returns the acceleration of each joint that suits all, rad/s².
    pub(super) fn resolved(&mut self) -> &[f64] {
        // Inertia makes the metric positive definite.
        cholesky::solve(&mut self.root, &mut self.pull);
        &self.pull
    }
}
