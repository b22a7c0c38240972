//! The served page: every view over HTTP, what it refuses, a live run led from it, and a browser.

mod browser;
mod live;
mod views;
mod watch;

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::Arc;

use trueup::page::{Live, Options, Page};

use crate::program::Scratch;
use crate::repl::kept;

/// A page over the three runs that are kept, with pictures and a drawing in the third.
pub(crate) fn served(scratch: &Scratch) -> Page {
    served_with(scratch, None)
}

/// The same, with a live run beside them.
pub(crate) fn served_with(scratch: &Scratch, live: Option<Arc<Live>>) -> Page {
    kept::lay_out(scratch);
    for folder in ["20260101-090000-pour", "20260102-110000-pour"] {
        if !scratch.path(&format!("runs/{folder}")).is_dir() {
            continue;
        }
        for (name, colour) in [
            ("01-before-real", [90, 90, 200]),
            ("01-before-twin", [90, 90, 160]),
            ("01-after-real", [90, 200, 90]),
            ("01-after-twin", [90, 160, 90]),
            ("02-before-real", [200, 200, 90]),
            ("02-before-twin", [160, 160, 90]),
            ("02-after-real", [200, 30, 30]),
            ("02-after-twin", [160, 30, 30]),
        ] {
            let file = scratch.path(&format!("runs/{folder}/frames/{name}.png"));
            std::fs::create_dir_all(file.parent().unwrap()).unwrap();
            image::RgbImage::from_pixel(64, 36, image::Rgb(colour)).save(file).unwrap();
        }
        scratch.file(&format!("runs/{folder}/graph.svg"), GRAPH);
    }
    let options = Options {
        root: scratch.path("runs"),
        answers: scratch.path("runs/answers.jsonl"),
        port: 0,
        seed: 1,
        place: Box::new(|name| (name == "above").then(|| "tasks/std.task:29".into())),
    };
    Page::open(options, live).unwrap()
}

const GRAPH: &str = "<?xml version=\"1.0\"?><svg xmlns=\"http://www.w3.org/2000/svg\" width=\"300\" height=\"90\">\
    <g data-path=\"pour\"><rect width=\"60\" height=\"20\"/></g>\
    <g data-path=\"pour/2-pick/lift\"><rect y=\"30\" width=\"60\" height=\"20\"/></g>\
    <g data-path=\"pour/4-move_over\"><rect y=\"60\" width=\"60\" height=\"20\"/></g></svg>";

/// An answer, read to its end.
pub(crate) struct Got {
    pub(crate) status: u16,
    pub(crate) head: String,
    pub(crate) body: Vec<u8>,
}

impl Got {
    pub(crate) fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    pub(crate) fn header(&self, name: &str) -> Option<String> {
        let mut lines = self.head.lines();
        let line = lines.find(|line| line.to_lowercase().starts_with(&format!("{name}:")))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    }

    pub(crate) fn json(&self) -> serde_json::Value {
        serde_json::from_slice(&self.body)
            .unwrap_or_else(|error| panic!("{error}: {}", self.text()))
    }
}

/// Sends a request as it is written.
pub(crate) fn raw(host: &str, request: &str) -> Got {
    let mut stream = TcpStream::connect(host).unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    let mut all = Vec::new();
    stream.read_to_end(&mut all).unwrap();
    let end = all.windows(4).position(|four| four == b"\r\n\r\n").unwrap();
    let head = String::from_utf8(all[..end].to_vec()).unwrap();
    let status = head.split(' ').nth(1).unwrap().parse().unwrap();
    Got { status, head, body: all[end + 4..].to_vec() }
}

/// Returns `127.0.0.1:PORT` of a page.
pub(crate) fn host(page: &Page) -> String {
    page.address().trim_start_matches("http://").trim_end_matches('/').to_owned()
}

pub(crate) fn get(host: &str, path: &str) -> Got {
    raw(host, &format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n"))
}

pub(crate) fn post(host: &str, path: &str, form: &str) -> Got {
    post_from(host, path, form, &format!("Origin: http://{host}\r\n"))
}

pub(crate) fn post_from(host: &str, path: &str, form: &str, origin: &str) -> Got {
    raw(
        host,
        &format!(
            "POST {path} HTTP/1.1\r\nHost: {host}\r\n{origin}Content-Length: {}\r\n\r\n{form}",
            form.len()
        ),
    )
}
