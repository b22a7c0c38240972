//! An arm at rest: where its tip is and what its joints bear at a pose, with effects.

use nalgebra::{Rotation3, Translation3, Vector3};

use super::super::chain::{Chain, MOST_JOINTS, PointMass};
use super::super::term::{Law, Term};
use super::at_rest::Pose;

/// What of the joints, the sensors and the tracker differs from the model.
pub(super) struct AtRest {
    chain: Chain,
    zero: [f64; MOST_JOINTS],
    compliance: [f64; MOST_JOINTS],
    gain: [f64; MOST_JOINTS],
    offset: [f64; MOST_JOINTS],
    shift: Vector3<f64>,
    turn: Rotation3<f64>,
}

impl AtRest {
    /// Returns an arm with effects, their parameters one after the other. What shows in motion only does nothing.
    pub(super) fn of(chain: &Chain, terms: &[Term], parameters: &[f64]) -> Self {
        let mut arm = Self {
            chain: chain.clone(),
            zero: [0.0; MOST_JOINTS],
            compliance: [0.0; MOST_JOINTS],
            gain: [1.0; MOST_JOINTS],
            offset: [0.0; MOST_JOINTS],
            shift: Vector3::zeros(),
            turn: Rotation3::identity(),
        };
        let mut at = 0;
        for term in terms {
            let count = term.law.specs().len();
            arm.add(chain, term, &parameters[at..at + count]);
            at += count;
        }
        arm
    }

    fn add(&mut self, filed: &Chain, term: &Term, p: &[f64]) {
        let j = term.joint;
        match term.law {
            Law::ZeroOffset => self.zero[j] += p[0],
            Law::Compliance => self.compliance[j] += p[0],
            Law::TorqueGain => self.gain[j] *= p[0],
            Law::TorqueOffset => self.offset[j] += p[0],
            Law::LinkLength => {
                let place = &mut self.chain.bodies[j].parent_from_body.translation.vector;
                *place += Vector3::from_column_slice(p);
            }
            Law::ToolOffset => {
                self.chain.body_from_tip *= Translation3::from(Vector3::from_column_slice(p));
            }
            Law::CameraShift(free) => {
                let mut six = [0.0; 6];
                let places = six.iter_mut().zip(free).filter(|(_, free)| *free);
                places.zip(p).for_each(|((to, _), value)| *to = *value);
                self.shift += Vector3::new(six[0], six[1], six[2]);
                self.turn = Rotation3::from_euler_angles(six[3], six[4], six[5]) * self.turn;
            }
            Law::LinkMass => {
                let own = filed.bodies[j].mass;
                if own > 0.0 {
                    self.chain.bodies[j].thicken(p[0] / own);
                }
            }
            Law::Payload => {
                // First moment about the body's origin, in its axes.
                let (body, tip) = (self.chain.n() - 1, filed.body_from_tip);
                let own = tip.rotation * Vector3::new(p[1], p[2], p[3]);
                let moment = own + p[0] * tip.translation.vector;
                self.chain.add_point(&PointMass { body, mass: p[0], moment });
            }
            Law::BaseTilt => {
                let tilt = Rotation3::from_euler_angles(p[0], p[1], 0.0);
                self.chain.gravity = tilt.inverse_transform_vector(&filed.gravity);
            }
            _ => {}
        }
    }

    /// Returns what is read at a pose: the tip if it was, then the torques.
    pub(super) fn read(&self, pose: &Pose) -> (Option<Vector3<f64>>, Vec<f64>) {
        let tip = pose.tip.map(|_| self.tip(&pose.q));
        if pose.tau.is_empty() {
            return (tip, Vec::new());
        }
        let (_, load) = self.borne(&pose.q);
        let tau = self
            .gain
            .iter()
            .zip(&load)
            .zip(&self.offset)
            .map(|((gain, load), offset)| gain * load + offset);
        (tip, tau.take(pose.q.len()).collect())
    }

    /// Returns where a tracker sees the tip, m, at these readings of the encoders.
    pub(super) fn tip(&self, read: &[f64]) -> Vector3<f64> {
        let (mut q, load) = self.borne(read);
        for ((q, soft), load) in q.iter_mut().zip(&self.compliance).zip(&load) {
            *q -= soft * load;
        }
        self.turn * self.chain.tip(&q[..read.len()]) + self.shift
    }

    /// Returns where the joints stand and what they bear, rad and N·m, at these readings of the encoders.
    fn borne(&self, read: &[f64]) -> ([f64; MOST_JOINTS], [f64; MOST_JOINTS]) {
        let n = read.len();
        let [mut q, still, mut load] = [[0.0; MOST_JOINTS]; 3];
        for ((q, read), zero) in q.iter_mut().zip(read).zip(&self.zero) {
            *q = read + zero;
        }
        self.chain.inverse(&q[..n], &still[..n], &still[..n], &mut load[..n]);
        (q, load)
    }
}
