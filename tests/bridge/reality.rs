//! A server of the bridge protocol over the embedded laboratory, and one that says whatever it is told to.

use std::io::{BufRead, BufReader, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::thread;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use trueup::arm::ticked::Plant as _;
use trueup::arm::{Camera as _, Scales as _};
use trueup::execution::calibrate::Switches;
use trueup::lab::LabSettings;
use trueup::language::Source;
use trueup::motion::free::Means;
use trueup::workcell::{CANDIDATES, Laboratory, Options, Stdlib, laboratory};

/// Answers each line of one connection after the other; `None` hangs up.
pub(super) fn serve(
    mut answer: impl FnMut(&Value) -> Option<String> + Send + 'static,
) -> (String, Arc<Mutex<Vec<Value>>>) {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let place = listener.local_addr().unwrap().to_string();
    let asked = Arc::new(Mutex::new(Vec::new()));
    let heard = asked.clone();
    thread::spawn(move || {
        for stream in listener.incoming() {
            let Ok(stream) = stream else { return };
            let _ = converse(&stream, &mut answer, &heard);
        }
    });
    (place, asked)
}

fn converse(
    stream: &TcpStream,
    answer: &mut impl FnMut(&Value) -> Option<String>,
    heard: &Mutex<Vec<Value>>,
) -> std::io::Result<()> {
    stream.set_nodelay(true)?;
    let mut out = stream;
    for line in BufReader::new(stream).lines() {
        let request: Value = serde_json::from_str(&line?)?;
        heard.lock().unwrap().push(request.clone());
        let Some(mut said) = answer(&request) else { return Ok(()) };
        said.push('\n');
        out.write_all(said.as_bytes())?;
    }
    Ok(())
}

/// The embedded laboratory as somebody else's simulator: only what the protocol says crosses.
pub(super) struct Reality {
    laboratory: Laboratory,
}

impl Reality {
    pub(super) fn new(scene: Option<Source>, lab: LabSettings, seed: u64) -> Self {
        let options = Options {
            robot: "lab".into(),
            scene,
            script: None,
            lab,
            stdlib: Stdlib::embedded(),
            seed,
            switches: Switches::default(),
            candidates: CANDIDATES,
            means: Means::default(),
            is_real_time: false,
            clock: || 0.0,
        };
        Self { laboratory: laboratory(options).unwrap() }
    }

    pub(super) fn answer(&mut self, request: &Value) -> String {
        let Laboratory { robot, plant, camera, scales } = &mut self.laboratory;
        let (word, with) = request.as_object().unwrap().iter().next().unwrap();
        let numbers = |of: &Value| -> Option<Vec<f64>> {
            of.as_array().map(|all| all.iter().map(|n| n.as_f64().unwrap()).collect())
        };
        match word.as_str() {
            "hello" => {
                let joints: Vec<_> = robot.joints().iter().map(|joint| &joint.name).collect();
                json!({"hello": 1, "name": "laboratory", "joints": joints, "scales": true,
                       "camera": {"width": 1280, "height": 720}, "realtime": false, "mood": "fine"})
                .to_string()
            }
            "photo" => {
                let mut png = std::io::Cursor::new(Vec::new());
                camera.photo().unwrap().write_to(&mut png, image::ImageFormat::Png).unwrap();
                json!({"png": STANDARD.encode(png.into_inner())}).to_string()
            }
            "scales" => serde_json::to_string(&scales.weigh().unwrap()).unwrap(),
            _ => {
                if let Some(q) = numbers(&with["q"]) {
                    plant.command(&q, &numbers(&with["dq"]).unwrap()).unwrap();
                }
                if let Some(grip) = with["grip"].as_object() {
                    let [opening, speed, force] =
                        ["opening", "speed", "force"].map(|key| grip[key].as_f64().unwrap());
                    plant.aim(opening, speed, force).unwrap();
                }
                if word == "step" {
                    plant.advance(with["dt"].as_f64().unwrap()).unwrap();
                }
                let told = plant.report();
                json!({"t": told.time, "q": told.q, "dq": told.dq, "tau": told.tau,
                       "opening": told.opening})
                .to_string()
            }
        }
    }
}
