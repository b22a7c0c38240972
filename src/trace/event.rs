//! What happens during a run, in order, and who may watch.

use std::sync::Arc;

use image::RgbImage;
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use serde::{Deserialize, Serialize};

use crate::arm::Feedback;

use super::step::StepRecord;

/// How finely pictures are kept, of 100. Chosen: a cup in a photograph of the laboratory is found where it was to 0.1 mm (0.04 mm
/// at 80), in a thirtieth of a PNG file's bytes, most of which are the sensor's noise.
const QUALITY: u8 = 75;
/// As [`QUALITY`], of the small pictures of a film. Chosen: arm, vessels and water are told apart at a glance, and a
/// pour's folder stays below 5 MB.
const FILM_QUALITY: u8 = 50;

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
        /// Whether only who asks for everything is told.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        is_detail: bool,
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
        /// The picture as a JPEG file; empty when it cannot be one. Two names may share one picture.
        jpeg: Arc<[u8]>,
    },
    /// A moment of a moving arm, in small pictures: for the film, not the event file.
    #[serde(skip)]
    Still(Arc<Still>),
    /// How a rehearsal goes, for who looks on.
    #[serde(skip)]
    Tryout(Arc<Tryout>),
}

impl Event {
    /// Returns the event of a line for everybody.
    pub fn note(text: impl Into<String>) -> Self {
        Self::Note { text: text.into(), is_detail: false }
    }

    /// Returns the event of a line for who asks for everything.
    pub fn detail(text: impl Into<String>) -> Self {
        Self::Note { text: text.into(), is_detail: true }
    }

    /// Returns the event of a picture, encoded here so that whoever watches has nothing long to do.
    pub fn picture(name: impl Into<String>, image: &RgbImage) -> Self {
        Self::Picture { name: name.into(), jpeg: jpeg(image).into() }
    }
}

/// A moment while the arm moves: what the camera saw, and the twin at the same moment of its rehearsal.
#[derive(Debug, Clone, PartialEq)]
pub struct Still {
    /// Its place in the run's film, from 1.
    pub number: usize,
    /// The arm's time, s.
    pub time: f64,
    /// The step that runs.
    pub step: usize,
    /// The camera's picture as a JPEG file, where there is a camera that films.
    pub real: Option<Vec<u8>>,
    /// The twin's.
    pub twin: Option<Vec<u8>>,
    /// Water in the twin's vessels, by name, m³.
    pub water: Vec<(String, f64)>,
    /// Water on the twin's table, m³.
    pub spilt: f64,
}

/// How a rehearsal in the twin goes.
#[derive(Debug, Clone, PartialEq)]
pub struct Tryout {
    /// Its place among those of its attempt, from 1.
    pub number: usize,
    /// How many there are at most.
    pub of: usize,
    /// Which branches are tried, and which way in them.
    pub name: String,
    /// The twin as it is now, a JPEG file, where there is a new picture.
    pub picture: Option<Vec<u8>>,
    /// How it ended: why it failed, or that it did not; nothing while it goes on.
    pub went: Option<Result<(), String>>,
}

/// Returns a picture as a JPEG file; nothing when it cannot be one.
pub fn jpeg(image: &RgbImage) -> Vec<u8> {
    coded(image, QUALITY)
}

/// As [`jpeg`], of a small picture of a film.
pub fn small_jpeg(image: &RgbImage) -> Vec<u8> {
    coded(image, FILM_QUALITY)
}

/// Codes a picture with colour at half the width and height. Codes made for each picture would save an eighth, but the encoder
/// then writes one colour after the other, and the `image` crate reads such a file wrongly.
fn coded(image: &RgbImage, quality: u8) -> Vec<u8> {
    let mut file = Vec::new();
    let size = (u16::try_from(image.width()), u16::try_from(image.height()));
    let (Ok(width), Ok(height)) = size else { return file };
    let mut encoder = Encoder::new(&mut file, quality);
    encoder.set_sampling_factor(SamplingFactor::F_2_2);
    if encoder.encode(image.as_raw(), width, height, ColorType::Rgb).is_err() {
        file.clear();
    }
    file
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture with sharp edges of brightness, noise, and colours that change slowly.
    fn picture(width: u32, height: u32) -> RgbImage {
        RgbImage::from_fn(width, height, |x, y| {
            let (warm, cold) = ((f64::from(x) * 0.05).sin() * 30.0, f64::from(y) * 0.3);
            let noise = f64::from((x * 7919 + y * 104_729) % 13) - 6.0;
            let grey = noise + if (x / 20 + y / 30) % 2 == 0 { 170.0 } else { 70.0 };
            let of = |colour: f64| (grey + colour).clamp(0.0, 255.0) as u8;
            image::Rgb([of(warm), of(-warm - cold), of(cold)])
        })
    }

    fn error(a: &RgbImage, b: &RgbImage) -> f64 {
        let pairs = a.as_raw().iter().zip(b.as_raw());
        let sum: f64 = pairs.map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
        (sum / a.as_raw().len() as f64).sqrt()
    }

    #[test]
    fn a_reader_sees_the_picture_that_was_written() {
        for (width, height) in [(1280, 720), (480, 270), (161, 97), (7, 33)] {
            let drawn = picture(width, height);
            let read = |file: Vec<u8>| image::load_from_memory(&file).unwrap().to_rgb8();
            let (fine, coarse) = (read(jpeg(&drawn)), read(small_jpeg(&drawn)));
            assert_eq!(fine.dimensions(), drawn.dimensions());
            // Steps of up to 40, and of up to 80, in the coefficients; a step of s adds s/√12 to the pixels at most.
            assert!(error(&fine, &drawn) < 7.0, "{width} {height} {}", error(&fine, &drawn));
            assert!(error(&coarse, &drawn) < 9.0, "{width} {height} {}", error(&coarse, &drawn));
        }
        assert!(jpeg(&RgbImage::new(0, 4)).is_empty());
    }
}
