//! What goes on beside a moving arm: fingers that open, a picture that is looked at.
//!
//! An arm's motions follow one another; its fingers and the camera can work at the same time. Their scripts
//! are asked beforehand what they want ([`Order`]), and the arm carries it out while it moves. When each
//! was really done is measured from the arm's ticks.

use std::sync::{Arc, Mutex, PoisonError};

use crate::arm::Feedback;

/// What a script wants done beside a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Order {
    /// Fingers to so many m between the pads, or as wide as they go.
    Open(Option<f64>),
    /// A photograph, and what it shows.
    Look,
}

/// Fingers that move less than this are at rest, m: above the encoder's noise.
const STILL: f64 = 3e-4;

/// The opening of the fingers over arm time; cloning shares it.
#[derive(Debug, Clone, Default)]
pub struct Openings(Arc<Mutex<Vec<(f64, f64)>>>);

impl Openings {
    /// Takes note of one tick.
    pub fn note(&self, feedback: &Feedback) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.push((feedback.time, feedback.opening));
    }

    /// Returns when the fingers came to rest, s: the first tick from which on they stay where they are at
    /// the end.
    pub fn rest(&self) -> Option<f64> {
        let all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let last = all.last()?.1;
        let moving = all.iter().rposition(|(_, opening)| (opening - last).abs() >= STILL);
        let at = moving.map_or(0, |at| (at + 1).min(all.len() - 1));
        Some(all[at].0)
    }
}
