//! The emulated controller, met over its own sockets: what it answers, refuses, tells and forgives.

mod examples;
mod calls;
mod kept;
mod zones;
mod drive;
mod rules;
mod commands;
mod arm;
mod stopping;
mod fault;
mod wrist;
mod pour;
mod soak;

use std::sync::Arc;
use std::time::Duration;

use trueup::emulator::{Emulator, Ideal, Options, Pace};
use trueup::kortex::frame::Frame;
use trueup::kortex::link::{Link, Login};
use trueup::kortex::messages::base::{ActionEvent, ActionNotification};
use trueup::kortex::rpc::base as call;
use trueup::motion::robot::Robot;

use prost::Message;

use crate::kitchen::HOME;

/// Options for an arm whose time runs as fast as it is waited for.
fn eager() -> Options {
    Options { pace: Pace::Eager, ..Options::default() }
}

/// An emulator with an arm that goes exactly where it is sent.
fn emulator(options: &Options) -> Emulator {
    Emulator::start(Arc::new(Robot::gen3()), Box::new(Ideal::new(&HOME)), options).unwrap()
}

fn admin() -> Login {
    Login { user: "admin".into(), password: "admin".into() }
}

fn link(emulator: &Emulator) -> Link {
    Link::open(emulator.tcp(), &admin(), Duration::from_secs(10)).unwrap()
}

/// What was told of actions until one ended or was given up, at most 60 s of the arm's time.
fn until_over(emulator: &Emulator, link: &Link, handle: u16) -> Vec<(ActionEvent, i32)> {
    let clock = emulator.clock();
    let late = clock.now() + 60.0;
    let mut told = Vec::new();
    while clock.now() < late {
        for note in link.notes(handle) {
            let note = action(&note);
            told.push((note.action_event(), note.abort_details));
        }
        if told.iter().any(|(event, _)| matches!(event, ActionEvent::End | ActionEvent::Abort)) {
            return told;
        }
        clock.sleep(0.02);
    }
    panic!("the action never ended: {told:?}");
}

fn action(note: &Frame) -> ActionNotification {
    assert_eq!(note.header.service, call::ON_ACTION_TOPIC.service);
    ActionNotification::decode(&note.payload[..]).unwrap()
}
