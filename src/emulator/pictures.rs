//! What stands beside the arm, over HTTP: `GET /photo.png` photographs the table, `GET /scales.json` reads
//! the kitchen scales. So a client elsewhere can see what the emulated arm works on.

use std::io::{self, Read, Write};
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use image::{ExtendedColorType, ImageEncoder};

use crate::execution::arm::{Camera, Scales};

/// Pictures and readings, until it is dropped.
pub struct Pictures {
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    address: SocketAddr,
}

impl Pictures {
    /// Serves a camera and scales; port 0 takes any that is free.
    ///
    /// # Errors
    ///
    /// When the port is taken.
    pub fn serve(
        address: IpAddr,
        port: u16,
        mut camera: Box<dyn Camera>,
        mut scales: Box<dyn Scales>,
    ) -> io::Result<Self> {
        let listener = TcpListener::bind((address, port))?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let is_over = Arc::new(AtomicBool::new(false));
        let ending = is_over.clone();
        let thread = thread::spawn(move || {
            while !ending.load(Ordering::SeqCst) {
                match listener.accept() {
                    // Who hangs up meanwhile misses the picture, nobody else does.
                    Ok((stream, _)) => {
                        let _ = answer(stream, camera.as_mut(), scales.as_mut());
                    }
                    Err(_) => thread::sleep(Duration::from_millis(20)),
                }
            }
        });
        Ok(Self { is_over, thread: Some(thread), address })
    }

    /// Returns where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for Pictures {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// The longest request that is read, bytes.
const LONGEST: usize = 8192;

fn answer(
    mut stream: TcpStream,
    camera: &mut dyn Camera,
    scales: &mut dyn Scales,
) -> io::Result<()> {
    stream.set_nonblocking(false)?;
    stream.set_read_timeout(Some(Duration::from_secs(2)))?;
    stream.set_write_timeout(Some(Duration::from_secs(10)))?;
    // The first line says all that matters; the rest is read too, since closing a connection with
    // something unread in it takes back what was answered.
    let mut request = Vec::new();
    let mut byte = [0];
    while request.len() < LONGEST && !request.ends_with(b"\r\n\r\n") && stream.read(&mut byte)? == 1
    {
        request.push(byte[0]);
    }
    let request = String::from_utf8_lossy(&request);
    let mut words = request.split_whitespace();
    let (status, kind, body) = match (words.next(), words.next()) {
        (Some("GET"), Some("/photo.png")) => photo(camera),
        (Some("GET"), Some("/scales.json")) => match scales.weigh() {
            Some(read) => {
                let body = serde_json::to_vec(&read).unwrap_or_default();
                ("200 OK", "application/json", body)
            }
            None => ("404 Not Found", "text/plain", b"there are no scales\n".to_vec()),
        },
        _ => ("404 Not Found", "text/plain", b"there are /photo.png and /scales.json\n".to_vec()),
    };
    write!(
        stream,
        "HTTP/1.0 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n",
        body.len()
    )?;
    stream.write_all(&body)
}

fn photo(camera: &mut dyn Camera) -> (&'static str, &'static str, Vec<u8>) {
    let failed = |why: String| ("500 Internal Server Error", "text/plain", why.into_bytes());
    let picture = match camera.photo() {
        Ok(picture) => picture,
        Err(error) => return failed(error.to_string()),
    };
    let mut body = Vec::new();
    let (width, height) = picture.dimensions();
    let encoder = image::codecs::png::PngEncoder::new(&mut body);
    match encoder.write_image(picture.as_raw(), width, height, ExtendedColorType::Rgb8) {
        Ok(()) => ("200 OK", "image/png", body),
        Err(error) => failed(error.to_string()),
    }
}
