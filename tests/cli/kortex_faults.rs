//! What goes wrong with a real arm, met through the program: a clear word, what would help, and exit code 4;
//! and the commands that look after the arm beside whoever moves it.

use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use trueup::emulator::{Emulator, Ideal, Options, Pictures};
use trueup::execution::lab_arm::{self, LabCamera, LabScales};
use trueup::kortex::clock::{Clock as _, Wall};
use trueup::kortex::link::{Link, Login};
use trueup::kortex::messages::cyclic::Feedback;
use trueup::kortex::messages::motion::{JointSpeed, JointSpeeds};
use trueup::kortex::rpc::{base, base_cyclic};
use trueup::lab::{Lab, LabSettings};
use trueup::motion::robot::Robot;

use crate::kitchen::{self, HOME};
use crate::program::{Said, Scratch};

fn emulator(faults: &str) -> Emulator {
    let faults = faults.parse().unwrap();
    let options = Options { faults, ..Options::default() };
    Emulator::start(Arc::new(Robot::gen3()), Box::new(Ideal::new(&HOME)), &options).unwrap()
}

fn link(emulator: &Emulator) -> Link {
    let login = Login { user: "admin".into(), password: "admin".into() };
    Link::open(emulator.tcp(), &login, Duration::from_secs(10)).unwrap()
}

/// The program with a password in its environment.
fn with_password(scratch: &Scratch, args: &[&str], password: &str) -> Said {
    let output = scratch.command(args).env("KORTEX_PASSWORD", password).output().unwrap();
    Said {
        code: output.status.code().unwrap(),
        out: String::from_utf8(output.stdout).unwrap(),
        err: String::from_utf8(output.stderr).unwrap(),
    }
}

fn address(emulator: &Emulator) -> String {
    format!("kortex://admin@{}", emulator.tcp())
}

/// Runs a call on an arm that refuses at once; returns what was said of it, and what would help.
fn refused(scratch: &Scratch, emulator: &Emulator, password: &str) -> (String, String) {
    let robot = address(emulator);
    let camera = "http://127.0.0.1:9/photo.png";
    let args = ["-c", "home()", "--json", "--yes", "--robot", &robot, "--camera-at", camera];
    let said = with_password(scratch, &args, password);
    assert_eq!(said.code, 4, "{said:?}");
    assert_eq!(said.error("code"), "device");
    (said.error("message"), said.error("help"))
}

#[test]
fn what_keeps_one_from_an_arm_is_told_with_what_would_help() {
    let scratch = Scratch::new("cli-kortex-refused");
    let well = emulator("");
    let (what, help) = refused(&scratch, &well, "guess");
    assert!(what.contains("does not take this password"), "{what}");
    assert!(help.contains("KORTEX_PASSWORD"), "{help}");

    // A number nobody knows is told as one.
    let (what, help) = refused(&scratch, &emulator("unknown=1"), "admin");
    assert!(what.contains("a reason this program does not know (sub-code 999"), "{what}");
    assert!(help.contains("firmware"), "{help}");

    // A second client, while the first moves the arm.
    let other = link(&well);
    let spin = JointSpeed { joint_identifier: 0, value: 5.0, duration: 0 };
    let spin = JointSpeeds { joint_speeds: vec![spin], duration: 0 };
    let () = other.call(base::SEND_JOINT_SPEEDS_COMMAND, &spin).unwrap();
    let (what, help) = refused(&scratch, &well, "admin");
    assert!(what.contains("someone else moves the arm now: TCP"), "{what}");
    assert!(help.contains("wait until they are done"), "{help}");

    // In fault.
    let () = other.call(base::APPLY_EMERGENCY_STOP, &()).unwrap();
    let (what, help) = refused(&scratch, &well, "admin");
    assert!(what.contains("the arm is in fault: the emergency stop is active"), "{what}");
    assert!(help.contains("trueup kortex clear-faults"), "{help}");
}

#[test]
fn an_arm_is_looked_after_from_the_command_line_while_someone_else_moves_it() {
    let scratch = Scratch::new("cli-kortex-scratch");
    let emulator = emulator("");
    let robot = address(&emulator);
    let kortex = |args: &[&str]| {
        with_password(&scratch, &[&["kortex"][..], args, &[&robot]].concat(), "admin")
    };
    let said = kortex(&["status", "--json"]);
    assert_eq!(said.code, 0, "{said:?}");
    let told = said.document("kortex-status");
    assert_eq!(told["state"], "ready");
    assert_eq!(told["model"], "L53");
    assert_eq!(told["joints_deg"].as_array().unwrap().len(), 7);
    assert!((told["joints_deg"][3].as_f64().unwrap() - 230.0).abs() < 0.01);

    let other = link(&emulator);
    let spin = JointSpeed { joint_identifier: 0, value: 5.0, duration: 0 };
    let spin = JointSpeeds { joint_speeds: vec![spin], duration: 0 };
    let go = || other.call::<()>(base::SEND_JOINT_SPEEDS_COMMAND, &spin);
    go().unwrap();
    let said = kortex(&["status"]);
    assert!(said.out.contains("moved by hand commands"), "{said:?}");
    assert!(said.out.contains("commands  TCP 127.0.0.1"), "{said:?}");
    assert_eq!(kortex(&["stop"]).code, 0);
    let still = || {
        let told: Feedback = other.call(base_cyclic::REFRESH_FEEDBACK, &()).unwrap();
        told.actuators[0].velocity.abs() < 0.01
    };
    Wall.sleep(0.5);
    assert!(still());
    go().unwrap();
    let said = kortex(&["stop", "--emergency"]);
    assert!(said.out.contains("the arm is in fault until"), "{said:?}");
    assert!(go().is_err());
    let said = kortex(&["status"]);
    assert_eq!(said.code, 1, "{said:?}");
    assert!(said.out.contains("fault     the emergency stop is active"), "{said:?}");
    let said = kortex(&["clear-faults"]);
    assert_eq!((said.code, said.out.trim()), (0, "the arm has no faults"));
    go().unwrap();
}

#[test]
fn nobody_there_and_no_address_are_told_by_the_desk_too() {
    let scratch = Scratch::new("cli-kortex-nobody");
    let said = with_password(&scratch, &["kortex", "stop", "127.0.0.1:9", "--json"], "admin");
    assert_eq!((said.code, said.error("code")), (4, "device".to_owned()));
    assert!(said.error("message").contains("no arm answers at 127.0.0.1:9"));
    let said =
        with_password(&scratch, &["kortex", "status", "kortex://a:b@host", "--json"], "admin");
    assert_eq!((said.code, said.error("code")), (2, "robot::password".to_owned()));
}

#[test]
fn the_prompt_asks_before_an_arm_is_moved_unless_told_not_to() {
    let scratch = Scratch::new("cli-kortex-prompt");
    let emulator = emulator("");
    let robot = address(&emulator);
    let camera = "http://127.0.0.1:9/photo.png";
    let args = ["--yes", "--robot", &robot, "--camera-at", camera];
    let keys = ":confirm\nhome()\nn\n:confirm all\nhome()\nn\n:confirm none\nhome()\n:quit\n";
    let said = scratch.typed_with(&args, keys, ("KORTEX_PASSWORD", "admin"));
    let asked = said.out.matches("carry it out with the kortex://").count();
    assert_eq!((asked, said.out.matches("left undone").count()), (2, 2), "{}", said.out);
    // `--yes` does not answer it; it names what does.
    assert_eq!(said.out.matches("y or n; `:confirm none` asks no more").count(), 2, "{}", said.out);
    // Without a question it goes to work, and the camera is not there.
    assert!(said.out.contains("no picture from http://127.0.0.1:9"), "{}", said.out);
}

/// Lets the program move the lab's arm over the wire and does something to it as soon as it moves.
fn meanwhile(scratch: &Scratch, act: impl FnOnce(&Link, &Mutex<Option<Emulator>>)) -> Said {
    let robot = Arc::new(Robot::gen3());
    let scene = Arc::new(kitchen::scene());
    let lab = Lab::new(&robot, &scene, LabSettings::perfect(), 1).unwrap();
    let lab = Arc::new(Mutex::new(lab));
    let plant = Box::new(lab_arm::plant(lab.clone()));
    let emulator = Emulator::start(robot, plant, &Options::default()).unwrap();
    let (camera, scales) = (Box::new(LabCamera(lab.clone())), Box::new(LabScales(lab)));
    let pictures = Pictures::serve([127, 0, 0, 1].into(), 0, camera, scales).unwrap();
    let (place, tcp) = (format!("http://{}/photo.png", pictures.address()), address(&emulator));
    let watching = link(&emulator);
    let held = Mutex::new(Some(emulator));
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let program = scope.spawn(|| {
            let args = [
                "-c",
                "home()",
                "--yes",
                "--speed",
                "0.1",
                "--without-regression",
                "1,2,3",
                "--robot",
                &tcp,
                "--camera-at",
                &place,
            ];
            let said = with_password(scratch, &args, "admin");
            is_over.store(true, Ordering::SeqCst);
            said
        });
        // An arm on a busy machine may answer late.
        let moves = || {
            let told = watching.call::<Feedback>(base_cyclic::REFRESH_FEEDBACK, &());
            told.is_ok_and(|told| told.actuators.iter().any(|joint| joint.velocity.abs() > 1.0))
        };
        while !is_over.load(Ordering::SeqCst) && !moves() {
            Wall.sleep(0.02);
        }
        act(&watching, &held);
        program.join().unwrap()
    })
}

#[test]
fn an_emergency_stop_on_the_way_ends_the_run_with_advice() {
    let scratch = Scratch::new("cli-kortex-estop");
    let said = meanwhile(&scratch, |link, _| {
        let () = link.call(base::APPLY_EMERGENCY_STOP, &()).unwrap();
    });
    assert_eq!(said.code, 4, "{said:?}");
    let all = format!("{}{}", said.out, said.err);
    assert!(all.contains("emergency stop"), "{all}");
    assert!(all.contains("clear the faults"), "{all}");
}

#[test]
fn a_link_lost_on_the_way_ends_the_run_with_advice() {
    let scratch = Scratch::new("cli-kortex-lost");
    let said = meanwhile(&scratch, |_, emulator| drop(emulator.lock().unwrap().take()));
    assert_eq!(said.code, 4, "{said:?}");
    let all = format!("{}{}", said.out, said.err);
    assert!(all.contains("the connection to the arm is gone"), "{all}");
    // Either the loss itself is told, or that it could not be mended.
    assert!(
        all.contains("the next command connects again") || all.contains("opened again"),
        "{all}"
    );
}
