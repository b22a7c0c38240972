//! `trueup emulate kortex`, and `--robot kortex://…` where nobody answers.

use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::process::{Child, ChildStdout, Command};
use std::sync::Arc;
use std::time::Duration;

use serde_json::Value;
use trueup::arm::{Arm, Camera, Cancel, Scales};
use trueup::execution::snapshot::{WebCamera, WebScales};
use trueup::kortex::arm::{KortexArm, Options};
use trueup::kortex::clock::Wall;
use trueup::kortex::link::Login;

use crate::kitchen::HOME;
use crate::program::Scratch;
use crate::schema::Schemas;

/// A program that is ended with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn start(scratch: &Scratch, args: &[&str]) -> (Running, BufReader<ChildStdout>) {
    running(scratch.command(args))
}

fn running(mut command: Command) -> (Running, BufReader<ChildStdout>) {
    let mut child = command.spawn().unwrap();
    let out = BufReader::new(child.stdout.take().unwrap());
    (Running(child), out)
}

/// The JSON document with which the emulator says where it listens.
fn places(out: &mut impl BufRead) -> Value {
    let mut text = String::new();
    while !text.ends_with("}\n") {
        assert!(out.read_line(&mut text).unwrap() > 0, "it ended with {text}");
    }
    let places = serde_json::from_str(&text).unwrap();
    Schemas::read().holds("emulate", &places);
    places
}

#[test]
fn the_emulator_says_where_it_is_and_answers_there_with_the_labs_arm_and_camera() {
    let scratch = Scratch::new("cli-emulate");
    let free = ["--tcp", "0", "--udp", "0", "--pictures", "0", "--json"];
    let (_running, mut out) = start(&scratch, &[&["emulate", "kortex"][..], &free].concat());
    let said = places(&mut out);
    let (host, port) = said["tcp"].as_str().unwrap().rsplit_once(':').unwrap();
    let mut arm = KortexArm::connect(Options {
        host: host.to_owned(),
        port: port.parse().unwrap(),
        stream: None,
        login: Login { user: "admin".into(), password: "admin".into() },
        rate: 40.0,
        timeout: Duration::from_secs(20),
        patience: Duration::from_secs(20),
        near: HOME.to_vec(),
        max_opening: 0.085,
        clock: Arc::new(Wall),
    })
    .unwrap();
    let told = arm.feedback().unwrap();
    let off = told.q.iter().zip(HOME).map(|(q, home)| (q - home).abs()).fold(0.0, f64::max);
    assert!(off < 0.01, "{:?}", told.q);
    // The lab's arm carries its weight: its torques are those of an arm that stands at home.
    assert!(told.tau[1] < -5.0, "{:?}", told.tau);
    arm.wait(0.1, &Cancel::default(), &mut |_| {}).unwrap();
    let at = |key: &str| said[key].as_str().unwrap().parse().unwrap();
    let scales = WebScales(at("scales")).weigh().unwrap();
    assert!(scales.water.iter().any(|(name, water)| name == "jar" && *water > 1e-5));
    let photo = WebCamera(at("photo")).photo().unwrap();
    assert!(photo.width() > 100 && photo.height() > 100);
    let missing = said["photo"].as_str().unwrap().replace("photo", "nothing").parse().unwrap();
    let error = WebCamera(missing).photo().unwrap_err().to_string();
    assert!(error.contains("404"), "{error}");
}

#[test]
fn an_ideal_arm_has_no_camera_and_ports_that_are_taken_are_told() {
    let scratch = Scratch::new("cli-emulate-ideal");
    let ideal = ["emulate", "kortex", "--ideal", "--udp", "0", "--json"];
    let (_running, mut out) = start(&scratch, &[&ideal[..], &["--tcp", "0"]].concat());
    let said = places(&mut out);
    assert_eq!(said["photo"], Value::Null);
    let port = said["tcp"].as_str().unwrap().rsplit_once(':').unwrap().1.to_owned();
    let second = scratch.trueup(&[&ideal[..], &["--tcp", &port]].concat());
    assert_eq!(second.code, 4);
    assert_eq!(second.error("code"), "emulate::port");
}

/// A crowd takes every file the emulator may open, so that taking one more connection fails; once the crowd is
/// gone, its controller and its scales answer as before.
#[cfg(target_os = "linux")]
#[test]
fn a_server_that_ran_out_of_files_takes_connections_again() {
    const FILES: usize = 48;
    let scratch = Scratch::new("cli-emulate-files");
    let free = ["emulate", "kortex", "--tcp", "0", "--udp", "0", "--pictures", "0", "--json"];
    let (running, mut out) = running(scratch.limited(&format!("ulimit -n {FILES}"), &free));
    let said = places(&mut out);
    let tcp = said["tcp"].as_str().unwrap();
    let scales = said["scales"].as_str().unwrap();
    let web = scales.trim_start_matches("http://").split('/').next().unwrap();
    let open = || std::fs::read_dir(format!("/proc/{}/fd", running.0.id())).unwrap().count();
    // Whoever comes while a crowd is still being sent away may be taken for one of it, and tries again.
    let soon = |is_so: &dyn Fn() -> bool| {
        (0..600).any(|_| {
            std::thread::sleep(Duration::from_millis(50));
            is_so()
        })
    };
    for place in [web, tcp] {
        let crowd: Vec<_> = (0..FILES + 8).map(|_| TcpStream::connect(place).unwrap()).collect();
        // The controller has fewer places than there are files; it turns the rest of a crowd away.
        assert!(place == tcp || soon(&|| open() >= FILES), "{place}: {} files are open", open());
        drop(crowd);
        assert!(
            soon(&|| WebScales(scales.parse().unwrap()).weigh().is_some()),
            "after {place}: {} are open",
            open()
        );
        let robot = format!("kortex://admin@{tcp}");
        let answers = || {
            let mut status = scratch.command(&["kortex", "status", &robot, "--json"]);
            status.env("KORTEX_PASSWORD", "admin").output().unwrap().status.success()
        };
        assert!(soon(&answers), "after {place}: {} files are open", open());
    }
}

#[test]
fn what_is_missing_for_a_real_arm_is_told_before_anything_is_tried() {
    let scratch = Scratch::new("cli-kortex-missing");
    let camera = ["--camera-at", "http://127.0.0.1:9/photo.png"];
    let run = |robot: &str, more: &[&str], password: Option<&str>| {
        let args = [&["-c", "pick(jar)", "--json", "--robot", robot][..], more].concat();
        let mut command = scratch.command(&args);
        command.env_remove("KORTEX_PASSWORD");
        if let Some(password) = password {
            command.env("KORTEX_PASSWORD", password);
        }
        let output = command.output().unwrap();
        let told: Value = serde_json::from_slice(&output.stdout).unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(!text.contains("secret"), "{text}");
        (output.status.code().unwrap(), told["error"]["code"].as_str().unwrap().to_owned())
    };
    let says = |code: i32, word: &str| (code, word.to_owned());
    let nobody = "kortex://admin@127.0.0.1:9";
    assert_eq!(run(nobody, &[], Some("secret")), says(4, "robot::no_camera"));
    assert_eq!(run(nobody, &camera, None), says(2, "robot::password"));
    assert_eq!(run(nobody, &camera, Some("secret")), says(4, "device"));
    let with_password = "kortex://admin:secret@127.0.0.1";
    assert_eq!(run(with_password, &camera, None), says(2, "robot::password"));
    assert_eq!(run("kortex://admin@:1", &camera, None), says(2, "robot::address"));
    assert_eq!(run("kortex://admin@host:x", &camera, None), says(2, "robot::address"));
}

/// It ended with one line, and nothing else was looked at.
#[test]
fn a_doctor_without_the_password_looks_at_the_rest() {
    let scratch = Scratch::new("cli-kortex-doctor");
    let args = ["doctor", "--json", "--robot", "kortex://admin@127.0.0.1:9"];
    let output = scratch.command(&args).env_remove("KORTEX_PASSWORD").output().unwrap();
    assert_eq!(output.status.code(), Some(4));
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    let all = told["findings"].as_array().unwrap();
    let found = |what: &str| all.iter().find(|one| one["what"] == what).unwrap();
    assert_eq!(found("texts")["state"], "ok", "{told}");
    assert_eq!(found("arm")["state"], "away", "{told}");
    assert_eq!(found("arm")["says"], "kortex://127.0.0.1:9: no password for the arm");
    assert_eq!(found("arm")["help"], "set KORTEX_PASSWORD");
}

#[test]
fn nothing_moves_before_someone_said_it_may() {
    let scratch = Scratch::new("cli-kortex-confirm");
    let ideal = ["emulate", "kortex", "--ideal", "--udp", "0", "--json", "--tcp", "0"];
    let (_running, mut out) = start(&scratch, &ideal);
    let robot = format!("kortex://admin@{}", places(&mut out)["tcp"].as_str().unwrap());
    let camera = "http://127.0.0.1:9/photo.png";
    let args = ["-c", "pick(jar)", "--json", "--robot", &robot, "--camera-at", camera];
    let output = scratch.command(&args).env("KORTEX_PASSWORD", "admin").output().unwrap();
    assert_eq!(output.status.code(), Some(3));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("motion not confirmed"), "{text}");
}

#[test]
fn mistakes_in_faults_are_told_with_what_there_is() {
    let scratch = Scratch::new("cli-emulate-fault");
    let said = scratch.trueup(&["emulate", "kortex", "--fault", "flood=1", "--json"]);
    assert_eq!((said.code, said.error("code")), (2, "emulate::fault".to_owned()));
    assert!(said.error("help").contains("drop=0.01"));
}
