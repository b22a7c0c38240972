//! What happens during a run, in order, and who may watch.

use std::sync::Arc;

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder as _, RgbImage};
use serde::{Deserialize, Serialize};

use crate::arm::Feedback;

use super::step::StepRecord;

/// What happens during a run, in order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// A part of the work begins: `perceive`, `plan`, `simulate`, `execute`.
    Phase {
        /// Its name.
        name: String,
        /// What it is about, in words.
        detail: String,
    },
    /// Something worth a line.
    Note {
        /// The line.
        text: String,
    },
    /// How far a long piece of work has come.
    Progress {
        /// What is being done.
        what: String,
        /// From 0 to 1.
        fraction: f64,
    },
    /// A step begins.
    StepStart {
        /// Its place in the run, from 1.
        number: usize,
        /// How many there are in the plan.
        of: usize,
        /// As a call.
        action: String,
        /// Its node's path in the graph.
        path: String,
    },
    /// A step has ended.
    StepEnd {
        /// What came of it.
        record: Box<StepRecord>,
    },
    /// One control tick of the arm.
    #[serde(skip)]
    Tick(Feedback),
    /// A picture: it goes to the recorder, not to the event file.
    #[serde(skip)]
    Picture {
        /// File name without ending.
        name: String,
        /// The picture as a PNG file; empty when it cannot be one. Two names may share one picture.
        png: Arc<[u8]>,
    },
}

impl Event {
    /// Returns the event of a picture, encoded here so that whoever watches has nothing long to do.
    pub fn picture(name: impl Into<String>, image: &RgbImage) -> Self {
        let mut png = Vec::new();
        let encoder = PngEncoder::new(&mut png);
        let (width, height) = image.dimensions();
        if encoder.write_image(image, width, height, ExtendedColorType::Rgb8).is_err() {
            png.clear();
        }
        Self::Picture { name: name.into(), png: png.into() }
    }
}

/// Someone who watches a run.
pub trait Observer {
    /// Sees one event. An observer never slows the arm: it may only note and return.
    fn event(&mut self, event: &Event);
}

/// Watches nothing.
#[derive(Debug, Default, Clone, Copy)]
pub struct Nobody;

impl Observer for Nobody {
    fn event(&mut self, _event: &Event) {}
}
