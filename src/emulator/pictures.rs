//! What stands beside the arm, over HTTP: `GET /photo.png` photographs the table, `GET /scales.json` reads
//! the kitchen scales. So a client elsewhere can see what the emulated arm works on.

use std::io;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, PoisonError};

use image::{ExtendedColorType, ImageEncoder};

use crate::arm::{Camera, Scales};
use crate::http::{Request, Response, Server};

use super::wording;

/// Pictures and readings, until it is dropped.
pub struct Pictures(Server);

impl Pictures {
    /// Serves a camera and scales; port 0 takes any that is free.
    ///
    /// # Errors
    ///
    /// When the port is taken.
    pub fn serve(
        address: IpAddr,
        port: u16,
        camera: Box<dyn Camera>,
        scales: Box<dyn Scales>,
    ) -> io::Result<Self> {
        let beside = Mutex::new((camera, scales));
        let handler = move |request: &Request| {
            // Camera and scales answer one at a time.
            let mut beside = beside.lock().unwrap_or_else(PoisonError::into_inner);
            match (request.method.as_str(), request.path.as_str()) {
                ("GET" | "HEAD", "/photo.png") => photo(beside.0.as_mut()),
                ("GET" | "HEAD", "/scales.json") => match beside.1.weigh() {
                    Some(read) => {
                        let body = serde_json::to_vec(&read).unwrap_or_default();
                        Response::new(200, "application/json", body)
                    }
                    None => Response::text(404, wording::NO_SCALES),
                },
                _ => Response::text(404, wording::PAGES),
            }
        };
        Server::serve((address, port).into(), Arc::new(handler)).map(Self)
    }

    /// Returns where it listens.
    pub fn address(&self) -> SocketAddr {
        self.0.address()
    }
}

fn photo(camera: &mut dyn Camera) -> Response {
    let picture = match camera.photo() {
        Ok(picture) => picture,
        Err(error) => return Response::text(500, &error.to_string()),
    };
    let mut body = Vec::new();
    let (width, height) = picture.dimensions();
    let encoder = image::codecs::png::PngEncoder::new(&mut body);
    match encoder.write_image(picture.as_raw(), width, height, ExtendedColorType::Rgb8) {
        Ok(()) => Response::new(200, "image/png", body),
        Err(error) => Response::text(500, &error.to_string()),
    }
}
