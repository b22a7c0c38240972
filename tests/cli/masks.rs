//! `--masks http://…`: a server of masks for tests, of which the path says how it behaves; what it offers is judged, what is wrong
//! with it is said, and nobody is waited for beyond what was asked.

use std::io::{Cursor, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::{GrayImage, ImageFormat, Luma, Rgb, RgbImage};
use serde_json::{Value, json};

use crate::program::Scratch;

/// What was asked, and where.
struct Server {
    address: SocketAddr,
    seen: Arc<Mutex<Vec<Value>>>,
}

impl Server {
    fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let seen: Arc<Mutex<Vec<Value>>> = Arc::default();
        let keep = seen.clone();
        thread::spawn(move || {
            for stream in listener.incoming() {
                let keep = keep.clone();
                thread::spawn(move || answer(stream.unwrap(), &keep));
            }
        });
        Self { address, seen }
    }

    fn at(&self, path: &str) -> String {
        format!("http://{}/{path}", self.address)
    }
}

fn answer(mut stream: TcpStream, keep: &Mutex<Vec<Value>>) {
    let Some((path, body)) = asked(&mut stream) else { return };
    let body: Value = serde_json::from_slice(&body).unwrap();
    keep.lock().unwrap().push(body.clone());
    let picture = STANDARD.decode(body["image"]["base64"].as_str().unwrap()).unwrap();
    let picture = image::load_from_memory(&picture).unwrap().to_rgb8();
    assert_eq!(body["image"]["width"], picture.width());
    assert_eq!(body["image"]["height"], picture.height());
    let head = |length: usize| {
        format!(
            "HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: {length}\r\n\r\n"
        )
    };
    match path.as_str() {
        "silent" => thread::sleep(Duration::from_secs(30)),
        "dribble" => {
            let _ = stream.write_all(head(10_000).as_bytes());
            for _ in 0..300 {
                if stream.write_all(b" ").is_err() {
                    return;
                }
                thread::sleep(Duration::from_millis(100));
            }
        }
        "broken" => {
            let _ = stream.write_all((head(1000) + "{\"masks\": [").as_bytes());
        }
        "status" => {
            let text = "no GPU left";
            let _ =
                write!(stream, "HTTP/1.1 500 No\r\nContent-Length: {}\r\n\r\n{text}", text.len());
        }
        path => {
            let text = says(path, &body, &picture);
            let _ = stream.write_all([head(text.len()), text].concat().as_bytes());
        }
    }
}

fn asked(stream: &mut TcpStream) -> Option<(String, Vec<u8>)> {
    let mut got = Vec::new();
    let mut part = [0; 8192];
    let end = loop {
        if let Some(at) = got.windows(4).position(|four| four == b"\r\n\r\n") {
            break at;
        }
        let n = stream.read(&mut part).ok().filter(|n| *n > 0)?;
        got.extend_from_slice(&part[..n]);
    };
    let head = String::from_utf8(got[..end].to_vec()).unwrap();
    let path = head.split(' ').nth(1)?.trim_start_matches('/').to_owned();
    let length = head.lines().find_map(|line| {
        let (name, value) = line.split_once(": ")?;
        name.eq_ignore_ascii_case("content-length").then(|| value.parse::<usize>().unwrap())
    })?;
    let mut body = got.split_off(end + 4);
    while body.len() < length {
        let n = stream.read(&mut part).ok().filter(|n| *n > 0)?;
        body.extend_from_slice(&part[..n]);
    }
    Some((path, body))
}

/// Runs down the columns, as COCO counts them.
fn runs(mask: &GrayImage) -> Vec<u64> {
    let (mut counts, mut last, mut n) = (Vec::new(), false, 0);
    for x in 0..mask.width() {
        for y in 0..mask.height() {
            let is_in = mask.get_pixel(x, y).0[0] > 0;
            if is_in == last {
                n += 1;
            } else {
                counts.push(n);
                (last, n) = (is_in, 1);
            }
        }
    }
    counts.push(n);
    counts
}

fn png(mask: &GrayImage) -> String {
    let mut bytes = Cursor::new(Vec::new());
    mask.write_to(&mut bytes, ImageFormat::Png).unwrap();
    STANDARD.encode(bytes.into_inner())
}

/// What a path answers: a network that looks for blue, or one that errs.
fn says(path: &str, body: &Value, picture: &RgbImage) -> String {
    let (w, h) = picture.dimensions();
    let blue = GrayImage::from_fn(w, h, |x, y| {
        let Rgb([r, _, b]) = *picture.get_pixel(x, y);
        Luma([if i32::from(b) > i32::from(r) + 40 { 255 } else { 0 }])
    });
    let rle = json!({"size": [h, w], "counts": runs(&blue)});
    let prompts = body["prompts"].as_array().unwrap().len();
    let all = |entry: Value| {
        let each = (0..prompts.max(1)).map(|k| {
            let mut entry = entry.clone();
            if prompts > 0 {
                entry["prompt"] = json!(k);
            }
            entry
        });
        json!({"masks": each.collect::<Vec<_>>()}).to_string()
    };
    let small = GrayImage::new(10, 10);
    let bad = GrayImage::from_fn(w, h, |x, y| Luma([if x < w / 2 && y % 7 < 3 { 255 } else { 0 }]));
    match path {
        "blue" => all(json!({"score": 0.97, "rle": rle})),
        "png" => all(json!({"score": 0.97, "png": png(&blue)})),
        "bad" => all(json!({"score": 1.0, "png": png(&bad)})),
        "nothing" => json!({"masks": []}).to_string(),
        "black" => all(json!({"score": 0.5, "png": png(&GrayImage::new(w, h))})),
        "nan" => "{\"masks\": [{\"score\": NaN, \"rle\": {}}]}".into(),
        "noscore" => all(json!({"rle": rle})),
        "size" => all(json!({"score": 0.9, "rle": {"size": [10, 10], "counts": [100]}})),
        "pngsize" => all(json!({"score": 0.9, "png": png(&small)})),
        "short" => all(json!({"score": 0.9, "rle": {"size": [h, w], "counts": [5, 2]}})),
        "nomask" => all(json!({"score": 0.9, "box": [1, 2, 3, 4]})),
        "nopng" => all(json!({"score": 0.9, "png": STANDARD.encode("GIF89a")})),
        "prompt" => json!({"masks": [{"prompt": 7, "score": 0.9, "rle": rle}]}).to_string(),
        "list" => json!([1, 2]).to_string(),
        _ => "<html><body>Sign in to the network</body></html>".into(),
    }
}

/// A blue disc on a table with a slope of light.
fn disc() -> RgbImage {
    RgbImage::from_fn(320, 240, |x, y| {
        let light = 150 + (x / 10) as u8;
        Rgb(if inside(x, y) { [60, 90, 160] } else { [light, light, light - 10] })
    })
}

fn inside(x: u32, y: u32) -> bool {
    (f64::from(x) - 150.0).hypot(f64::from(y) - 110.0) < 45.0
}

#[test]
fn the_better_mask_is_taken_and_it_is_said_whose_it_is() {
    let scratch = Scratch::new("masks-better");
    let server = Server::start();
    disc().save(scratch.path("photo.png")).unwrap();
    let ask = |path: &str, more: &[&str]| {
        let url = server.at(path);
        let args = ["camera", "segment", "photo.png", "--json", "--out", "cut", "--masks", &url];
        scratch.trueup(&[&args[..], more].concat())
    };
    for path in ["blue", "png"] {
        for prompt in [&["--box", "90,50,210,170"][..], &["--point", "150,110"], &[]] {
            let answer = ask(path, prompt).document("camera-segment");
            // One thing, whoever cut it out.
            assert_eq!(answer["segments"].as_array().unwrap().len(), 1, "{answer:#}");
            let (theirs, ours) = (&answer["masks"]["agreement"], &answer["masks"]["own_agreement"]);
            let (theirs, ours) = (theirs.as_f64().unwrap(), ours.as_f64().unwrap());
            assert_eq!(answer["masks"]["came"], 1);
            let by = if theirs > ours { "masks" } else { "trueup" };
            assert_eq!(answer["segments"][0]["by"], by, "{answer:#}");
            let mask = image::open(scratch.path("cut/mask-1.png")).unwrap().to_luma8();
            let wrong = mask.enumerate_pixels().filter(|(x, y, p)| (p.0[0] > 0) != inside(*x, *y));
            assert!(wrong.count() < 300, "{path} {prompt:?}");
        }
    }
    // Stripes over half of the picture are no thing, however sure their maker is.
    let answer = ask("bad", &["--box", "90,50,210,170"]).json();
    assert_eq!(answer["segments"][0]["by"], "trueup", "{answer:#}");
    assert_eq!(answer["masks"]["came"], 1, "{answer:#}");
    // Nothing is an answer.
    for path in ["nothing", "black"] {
        let answer = ask(path, &["--box", "90,50,210,170"]).document("camera-segment");
        assert_eq!(answer["masks"]["came"], 0);
        assert_eq!(answer["segments"][0]["by"], "trueup");
    }
    let url = server.at("bad");
    let said =
        scratch.trueup(&["camera", "segment", "photo.png", "--point", "150,110", "--masks", &url]);
    assert!(said.out.contains("; ours is better"), "{said:?}");
    // What was sent is what is documented.
    let seen = server.seen.lock().unwrap();
    assert_eq!(seen[0]["prompts"], json!([{"box": [90.0, 50.0, 210.0, 170.0]}]));
    assert_eq!(seen[1]["prompts"], json!([{"point": [150.0, 110.0]}]));
    assert_eq!(seen[2]["prompts"], json!([]));
    assert_eq!(seen[0]["image"]["media"], "image/png");
}

#[test]
fn a_bad_answer_is_an_error_that_says_what_is_wrong_with_it() {
    let scratch = Scratch::new("masks-bad");
    let server = Server::start();
    disc().save(scratch.path("photo.png")).unwrap();
    for (path, code, word) in [
        ("nan", "masks::answer", "NaN"),
        ("noscore", "masks::answer", "`score` is not a finite number"),
        ("size", "masks::answer", "10 x 10 px, the picture of 320 x 240 px"),
        ("pngsize", "masks::answer", "10 x 10 px, the picture of 320 x 240 px"),
        ("short", "masks::answer", "7 pixels, the picture has 76800"),
        ("nomask", "masks::answer", "neither `rle` nor `png`"),
        ("nopng", "masks::answer", "`png` cannot be read"),
        ("prompt", "masks::answer", "not the number of one that was sent"),
        ("list", "masks::answer", "no list `masks`"),
        ("html", "masks::answer", "it begins `<html>"),
        ("broken", "masks::unavailable", "answer"),
        ("status", "masks::unavailable", "status 500: no GPU left"),
        ("silent", "masks::unavailable", "within 1 s"),
        ("dribble", "masks::unavailable", "within 1 s"),
    ] {
        let url = server.at(path);
        let said = scratch.trueup(&[
            "camera",
            "segment",
            "photo.png",
            "--json",
            "--box",
            "90,50,210,170",
            "--masks-timeout",
            "1",
            "--masks",
            &url,
        ]);
        assert_eq!(said.error("code"), code, "{path}: {said:?}");
        assert!(said.error("message").contains(word), "{path}: {}", said.error("message"));
        assert_eq!(said.code, 4, "{path}: {said:?}");
        assert!(!said.error("help").is_empty(), "{path}");
    }
    // Nobody there, no address, no file that can be read.
    let nobody = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    for (source, code) in [
        (format!("http://{nobody}/masks"), "masks::unavailable"),
        ("http://:80".into(), "masks::source"),
        ("model.pt".into(), "masks::source"),
    ] {
        let args = ["camera", "segment", "photo.png", "--json", "--masks", &source];
        let said = scratch.trueup(&args);
        assert_eq!(said.error("code"), code, "{source}: {said:?}");
    }
    #[cfg(not(feature = "onnx"))]
    {
        let args = ["camera", "segment", "photo.png", "--json", "--masks", "model.onnx"];
        let said = scratch.trueup(&args);
        assert_eq!(said.error("code"), "masks::not_built", "{said:?}");
        assert!(said.error("help").contains("--features onnx"), "{said:?}");
    }
}
