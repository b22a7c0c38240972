//! A server that makes masks: one request with the picture and all places, one answer with all masks.
//!
//! What is sent and what must come back is in `docs/seeing.md`, with a server to copy. An address is asked once: a model that needs
//! longer than was said needs longer the second time too. What comes back is read by [`super::reply`].

use std::io::Cursor;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::{ImageFormat, RgbImage};
use serde_json::{Value, json};

use super::{Error, Mask, Where, reply};
use crate::http::{Address, Client, Limits};
use crate::plain;

/// How long is waited for a connection, s. As for models that answer questions.
const CONNECT_S: f64 = 2.0;
/// The longest answer that is read, bytes: as many masks as are read of a picture of a megapixel, as PNG.
const LONGEST: u64 = 64 << 20;
/// So much is shown of what a server says, characters.
const SHOWN: usize = 120;

/// A server at a web address.
#[derive(Clone)]
pub struct Endpoint {
    address: Address,
    client: Client,
}

impl Endpoint {
    /// Asks nobody yet; later for at most `reply_s` seconds.
    pub fn new(address: Address, reply_s: f64) -> Self {
        let limits = Limits { connect_s: CONNECT_S.min(reply_s), reply_s, longest: LONGEST };
        let client = Client::new(limits, &address);
        Self { address, client }
    }

    /// Returns where it is.
    pub fn address(&self) -> &Address {
        &self.address
    }

    /// Asks for masks.
    ///
    /// # Errors
    ///
    /// [`Error`].
    pub(super) fn ask(&self, picture: &RgbImage, places: &[Where]) -> Result<Vec<Mask>, Error> {
        let address = || self.address.clone();
        let body = request(picture, places).to_string();
        let came = self
            .client
            .post(&self.address, &body, "none")
            .map_err(|trouble| Error::Trouble { address: address(), trouble })?;
        if came.status != 200 {
            let told = begins(&came.body);
            return Err(Error::Status { address: address(), status: came.status, told });
        }
        reply::read(&came.body, picture.dimensions(), places.len()).map_err(|(number, flaw)| {
            match number {
                Some(number) => Error::Mask { address: address(), number, flaw },
                None => Error::Answer { address: address(), flaw },
            }
        })
    }
}

/// How a text begins, on one line.
pub(super) fn begins(body: &[u8]) -> String {
    let text = String::from_utf8_lossy(&body[..body.len().min(4 * SHOWN)]).into_owned();
    let line: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
    plain::visible(&line.chars().take(SHOWN).collect::<String>()).into_owned()
}

/// The document that is sent.
fn request(picture: &RgbImage, places: &[Where]) -> Value {
    let mut bytes = Cursor::new(Vec::new());
    picture
        .write_to(&mut bytes, ImageFormat::Png)
        .expect("an RGB picture in memory can be written as PNG");
    let places: Vec<Value> = places
        .iter()
        .map(|place| match place {
            Where::Box(bounds) => json!({ "box": bounds }),
            Where::Point(at) => json!({ "point": at }),
        })
        .collect();
    json!({
        "image": {
            "media": "image/png",
            "width": picture.width(),
            "height": picture.height(),
            "base64": STANDARD.encode(bytes.into_inner()),
        },
        "prompts": places,
    })
}
