//! A camera and scales behind a web address: any device that answers `GET` with a PNG or JPEG picture, or
//! with the scales' JSON. Plain HTTP, one request a photograph.

use std::io::{Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use image::RgbImage;

use super::arm::{Camera, DeviceError, Scales, Weighing};

/// The longest answer that is read, bytes.
const LONGEST: u64 = 64 << 20;
/// How long a connection may take, and the next part of an answer, s.
const PATIENCE: (u64, u64) = (5, 60);

/// A web address: `http://HOST[:PORT]/PATH`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Address {
    host: String,
    port: u16,
    path: String,
}

impl std::fmt::Display for Address {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "http://{}:{}{}", self.host, self.port, self.path)
    }
}

impl std::str::FromStr for Address {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is not http://HOST[:PORT]/PATH");
        let rest = text.strip_prefix("http://").ok_or_else(wrong)?;
        let (place, path) = match rest.find('/') {
            Some(at) => rest.split_at(at),
            None => (rest, "/"),
        };
        let (host, port) = match place.rsplit_once(':') {
            Some((host, port)) => (host, port.parse().map_err(|_| wrong())?),
            None => (place, 80),
        };
        // What would end a line of the request cannot be part of it.
        if host.is_empty() || text.chars().any(|c| c.is_whitespace() || c.is_control()) {
            return Err(wrong());
        }
        Ok(Self { host: host.to_owned(), port, path: path.to_owned() })
    }
}

impl Address {
    fn get(&self) -> Result<Vec<u8>, String> {
        let words = |error: std::io::Error| error.to_string();
        let mut all = (self.host.as_str(), self.port).to_socket_addrs().map_err(words)?;
        let address = all.next().ok_or("no such host")?;
        let (soon, long) = (Duration::from_secs(PATIENCE.0), Duration::from_secs(PATIENCE.1));
        let mut stream = TcpStream::connect_timeout(&address, soon).map_err(words)?;
        stream.set_read_timeout(Some(long)).map_err(words)?;
        stream.set_write_timeout(Some(soon)).map_err(words)?;
        // HTTP/1.0: the answer comes in one piece and ends with the connection.
        let Self { host, path, .. } = self;
        let request = format!("GET {path} HTTP/1.0\r\nHost: {host}\r\nConnection: close\r\n\r\n");
        stream.write_all(request.as_bytes()).map_err(words)?;
        let mut answer = Vec::new();
        stream.take(LONGEST).read_to_end(&mut answer).map_err(words)?;
        let end = answer.windows(4).position(|four| four == b"\r\n\r\n");
        let end = end.ok_or("the answer is not HTTP")?;
        let first = answer[..end].split(|&byte| byte == b'\r').next().unwrap_or_default();
        let status = String::from_utf8_lossy(first).into_owned();
        if status.split(' ').nth(1) != Some("200") {
            return Err(format!("it answers `{status}`"));
        }
        Ok(answer.split_off(end + 4))
    }
}

/// A camera that answers with a picture.
#[derive(Debug, Clone)]
pub struct WebCamera(pub Address);

impl Camera for WebCamera {
    fn photo(&mut self) -> Result<RgbImage, DeviceError> {
        let failed = |why: String| DeviceError::Refused {
            what: format!("no picture from {}: {why}", self.0),
            help: "open the address in a browser: does it show the table?".to_owned(),
        };
        let bytes = self.0.get().map_err(failed)?;
        let picture = image::load_from_memory(&bytes).map_err(|error| failed(error.to_string()))?;
        Ok(picture.to_rgb8())
    }
}

/// Scales that answer with a [`Weighing`] as JSON.
#[derive(Debug, Clone)]
pub struct WebScales(pub Address);

impl Scales for WebScales {
    fn weigh(&mut self) -> Option<Weighing> {
        serde_json::from_slice(&self.0.get().ok()?).ok()
    }
}
