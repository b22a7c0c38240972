//! Masks that somebody else makes: a server at a web address (segment-anything and its like), or a network in an ONNX file.
//!
//! A picture goes out with places where to look, in its pixels; masks of the picture's size come back, each with what its maker
//! thinks of it. What is no mask is an error that says which and why, and nobody is waited for longer than was said. Whether a mask
//! is a good one, and what becomes of it, is `alignment`'s business: nothing here sees edges or poses.

mod endpoint;
mod error;
#[cfg(feature = "onnx")]
mod network;
#[cfg(not(feature = "onnx"))]
#[path = "absent.rs"]
mod network;
#[cfg(feature = "onnx")]
mod pieces;
mod reply;
mod rle;

use std::path::Path;

use image::{GrayImage, RgbImage};

use crate::http::Address;
pub use endpoint::Endpoint;
pub use error::{Error, Flaw, Unfit};
pub use network::Network;

/// Where a thing is looked for, px of the picture: (0, 0) is the middle of its top left pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Where {
    /// Inside this box, `[left, top, right, bottom]`, with some room.
    Box([f64; 4]),
    /// At this place on it, `[x, y]`.
    Point([f64; 2]),
}

/// A mask as somebody else made it.
#[derive(Debug, Clone)]
pub struct Mask {
    /// Which of the places it answers, by its number from 0; `None` where none was named.
    pub of: Option<usize>,
    /// 255 where the thing is, else 0; the picture's size.
    pub mask: GrayImage,
    /// What its maker thinks of it; a number, of which 1 is meant to be sure.
    pub score: f64,
}

/// Somebody who makes masks.
pub enum Source {
    /// A server.
    Endpoint(Endpoint),
    /// A file with a network.
    Network(Box<Network>),
}

impl Source {
    /// Opens what a text names: `http://HOST:PORT/PATH`, or a file that ends in `.onnx`. A server is waited for at most
    /// `reply_s` seconds, each time.
    ///
    /// # Errors
    ///
    /// [`Error::Unknown`] for what is neither; for a file, what is wrong with it.
    pub fn named(text: &str, reply_s: f64) -> Result<Self, Error> {
        if text.starts_with("http://") || text.starts_with("https://") {
            let address: Address = text.parse()?;
            return Ok(Self::Endpoint(Endpoint::new(address, reply_s)));
        }
        let path = Path::new(text);
        if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("onnx")) {
            return Network::open(path).map(|network| Self::Network(Box::new(network)));
        }
        Err(Error::Unknown(text.to_owned()))
    }

    /// Asks for masks of what is at some places; of everything that stands out where none is named.
    ///
    /// # Errors
    ///
    /// [`Error`]: nobody answers, or what comes is no mask of this picture. No mask at all is an answer.
    pub fn ask(&self, picture: &RgbImage, places: &[Where]) -> Result<Vec<Mask>, Error> {
        match self {
            Self::Endpoint(endpoint) => endpoint.ask(picture, places),
            Self::Network(network) => network.ask(picture, places),
        }
    }
}
