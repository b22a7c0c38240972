//! A camera and scales behind a web address: any device that answers `GET` with a PNG or JPEG picture, or
//! with the scales' JSON. One request a photograph.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use image::RgbImage;

use crate::alignment::decode;
use crate::http::{Address, Client, Limits, Trouble};

use crate::arm::{Camera, DeviceError, Film, Scales, SmallShot, Weighing};

use super::wording;

/// A camera may think about a long exposure, but not for longer than this.
const LIMITS: Limits = Limits { connect_s: 5.0, reply_s: 60.0, longest: 64 << 20 };

/// Why a device gave nothing.
#[derive(Debug, thiserror::Error)]
enum Nothing {
    #[error("{0}")]
    Http(#[from] Trouble),
    #[error("it answers with status {0}")]
    Status(u16),
    #[error("{0}")]
    Picture(#[from] decode::Error),
}

impl Nothing {
    /// As the camera at that address says it.
    fn of_camera(&self, address: &Address) -> DeviceError {
        DeviceError::Refused {
            what: wording::no_picture(address, self),
            help: wording::look_for_yourself(),
        }
    }
}

fn get(address: &Address) -> Result<Vec<u8>, Nothing> {
    let answer = Client::new(LIMITS, address).get(address, None)?;
    match answer.status {
        200 => Ok(answer.body),
        other => Err(Nothing::Status(other)),
    }
}

fn picture(address: &Address) -> Result<RgbImage, Nothing> {
    Ok(decode::decoded(&get(address)?)?)
}

/// A camera that answers with a picture.
#[derive(Debug, Clone)]
pub struct WebCamera(pub Address);

impl Camera for WebCamera {
    fn photo(&mut self) -> Result<RgbImage, DeviceError> {
        picture(&self.0).map_err(|why| why.of_camera(&self.0))
    }

    fn film(&self, _is_watched: bool) -> Option<Box<dyn Film>> {
        Some(Box::new(WebFilm { address: self.0.clone(), is_busy: Arc::default() }))
    }
}

/// A camera at a web address as it films: a picture is asked for when the one before has come.
struct WebFilm {
    address: Address,
    is_busy: Arc<AtomicBool>,
}

impl Film for WebFilm {
    fn shoot(&mut self, width: u32) -> Option<SmallShot> {
        if self.is_busy.swap(true, Ordering::SeqCst) {
            return None;
        }
        let (address, is_busy) = (self.address.clone(), self.is_busy.clone());
        Some(Box::new(move || {
            let image = picture(&address).ok();
            is_busy.store(false, Ordering::SeqCst);
            decode::small(&image?, width)
        }))
    }
}

/// Scales that answer with a [`Weighing`] as JSON.
#[derive(Debug, Clone)]
pub struct WebScales(pub Address);

impl Scales for WebScales {
    fn weigh(&mut self) -> Option<Weighing> {
        serde_json::from_slice(&get(&self.0).ok()?).ok()
    }
}

#[cfg(test)]
#[cfg(all(feature = "server", feature = "web"))]
mod tests {
    use std::io::Cursor;
    use std::net::Ipv4Addr;
    use std::sync::Arc;

    use image::{ImageFormat, Rgb};

    use super::*;
    use crate::http::{Handler, Request, Response, Server};

    #[test]
    fn a_picture_and_a_reading_come_over_the_web() {
        let picture = RgbImage::from_pixel(3, 2, Rgb([10, 200, 30]));
        let mut png = Cursor::new(Vec::new());
        picture.write_to(&mut png, ImageFormat::Png).unwrap();
        let png = png.into_inner();
        let handler: Handler = Arc::new(move |request: &Request| match request.path.as_str() {
            "/photo.png" => Response::new(200, "image/png", png.clone()),
            "/scales.json" => {
                Response::new(200, "application/json", r#"{"water":[["cup",1e-4]],"spilt":0.0}"#)
            }
            "/elsewhere" => Response::see_other("/photo.png"),
            _ => Response::text(404, "nothing"),
        });
        let server = Server::serve((Ipv4Addr::LOCALHOST, 0).into(), handler).unwrap();
        let at = |path: &str| -> Address {
            format!("http://{}{path}", server.address()).parse().unwrap()
        };
        assert_eq!(WebCamera(at("/photo.png")).photo().unwrap(), picture);
        let read = WebScales(at("/scales.json")).weigh().unwrap();
        assert_eq!((read.water, read.spilt), (vec![("cup".to_owned(), 1e-4)], 0.0));
        assert!(WebScales(at("/gone")).weigh().is_none());
        for (path, why) in
            [("/gone", "status 404"), ("/elsewhere", "status 303"), ("/scales.json", "")]
        {
            let error = WebCamera(at(path)).photo().unwrap_err().to_string();
            assert!(error.contains(why) && error.contains(path), "{error}");
        }
    }
}
