//! Joints that stand still: what friction holds them with.
//!
//! Where a joint rests, dry friction is anything up to its level either way, whatever the motor asks for. No law of the motion says
//! how much, so that a torque from before the gear is not judged there. A robot that goes from point to point has joints that rest
//! for half of the log; taken for motion, what holds them looks like springs, waves and lighter links.
//!
//! Source: Armstrong-Hélouvry, Dupont and Canudas de Wit, "A survey of models, analysis tools and compensation methods for the control
//! of machines with friction", Automatica 30, 1994: at rest friction is a set of values.

use super::channels::{Data, Quantity};
use super::note::Note;

/// Within so much time of a row, either way, s, a joint that stands still does not move. Chosen: where a motion turns round it is
/// slower than it can be told for less.
const HALF: f64 = 0.1;
/// Readings of an angle that stays are so many times their noise apart at most.
const APART: f64 = 6.0;
/// An angle that changes faster than this is not called still, rad/s, however coarse its sensor is. Chosen: a fifth of the speed at
/// which dry friction of arms has come to its level.
const SLOWEST: f64 = 0.002;
/// A joint that moves in less than this share of the rows is judged in all of them: there would be too little left.
const MOVES: f64 = 0.1;

impl Data {
    /// Leaves out torques of joints in rows in which these stand still.
    pub(super) fn leave_out_standing(&mut self, name: &str) {
        let mut joints = Vec::new();
        for joint in 0..self.n {
            let rows = self.standing(joint);
            let moving = self.n_rows() - rows.len();
            if rows.is_empty() || (moving as f64) < MOVES * self.n_rows() as f64 {
                continue;
            }
            let mut torques = self.channels.iter_mut();
            let own = torques.find(|c| c.quantity == Quantity::Torque && c.index == joint);
            let Some(torque) = own else { continue };
            torque.leave_out(&rows);
            torque.fill(&self.time);
            joints.push((torque.name.clone(), rows.len()));
        }
        if !joints.is_empty() {
            let recording = name.to_owned();
            self.notes.push(Note::Standing { recording, joints, rows: self.n_rows() });
        }
    }

    /// Returns the rows about which a joint's angle stays.
    fn standing(&self, joint: usize) -> Vec<usize> {
        let mut angles = self.channels.iter();
        let own = angles.find(|c| c.quantity == Quantity::Position && c.index == joint);
        let Some(angle) = own else { return Vec::new() };
        let most = (APART * angle.noise).min(2.0 * HALF * SLOWEST);
        let (mut from, mut to) = (0, 0);
        let stays = |row: &usize| {
            let at = self.time[*row];
            while self.time[from] < at - HALF {
                from += 1;
            }
            while to < self.time.len() && self.time[to] <= at + HALF {
                to += 1;
            }
            let about = &angle.values[from..to];
            let (least, largest) = about
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), q| (a.min(*q), b.max(*q)));
            about.len() > 2 && largest - least <= most
        };
        (0..self.n_rows()).filter(stays).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discovery::robot::channels::Channel;

    fn channel(quantity: Quantity, values: Vec<f64>) -> Channel {
        let (name, unread) = (format!("{}_1", quantity.stem()), Vec::new());
        Channel { quantity, index: 0, name, values, noise: 3e-5, unread }
    }

    /// A joint that moves at 0.5 rad/s for a second from `begins` s on, of 3 s, with noise on its angle.
    fn log(begins: f64) -> Data {
        let time: Vec<f64> = (0..300).map(|row| f64::from(row) * 0.01).collect();
        let jitter = |row: usize| if row.is_multiple_of(3) { 5e-5 } else { 0.0 };
        let q = time.iter().map(|t| 0.5 * (t - begins).clamp(0.0, 1.0)).enumerate();
        let q = q.map(|(row, q)| q + jitter(row)).collect();
        let channels =
            vec![channel(Quantity::Position, q), channel(Quantity::Torque, vec![1.0; 300])];
        Data {
            n: 1,
            time,
            commands: Vec::new(),
            channels,
            notes: Vec::new(),
            are_currents: false,
            of_currents: false,
        }
    }

    #[test]
    fn what_holds_a_joint_that_stands_still_is_not_judged() {
        let mut data = log(1.0);
        data.leave_out_standing("log");
        let read: Vec<usize> = (0..300).filter(|row| data.channels[1].is_read(*row)).collect();
        assert_eq!((read[0], read[read.len() - 1], read.len()), (91, 209, 119));
        assert!(data.channels[0].unread.is_empty());
        let told = data.notes[0].to_string();
        assert!(told.contains("`tau_1` in 181 of 300 rows"), "{told}");
    }

    #[test]
    fn a_joint_that_hardly_ever_moves_is_judged_as_it_is() {
        let mut data = log(2.95);
        data.leave_out_standing("log");
        assert!(data.channels[1].unread.is_empty() && data.notes.is_empty());
    }

    /// A turn of a slow motion is no rest, and neither is what creeps.
    #[test]
    fn what_moves_slowly_is_judged() {
        let mut data = log(0.0);
        for (row, q) in data.channels[0].values.iter_mut().enumerate() {
            *q = 0.3 * (row as f64 * 0.01).cos();
        }
        data.leave_out_standing("log");
        assert!(data.channels[1].unread.is_empty());
        for (row, q) in data.channels[0].values.iter_mut().enumerate() {
            *q = 0.005 * (row as f64 * 0.01);
        }
        data.leave_out_standing("log");
        assert!(data.channels[1].unread.is_empty());
    }
}
