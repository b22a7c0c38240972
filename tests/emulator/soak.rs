//! Many sessions, many cycles, bad networks: nothing leaks, nothing hangs.

use std::time::Duration;

use trueup::arm::{Arm, Cancel, DeviceError, Feedback};
use trueup::emulator::{Emulator, Options};
use trueup::kortex::arm::{KortexArm, Options as Client};
use trueup::kortex::clock::{Clock as _, Wall};
use trueup::kortex::link::{Datagrams, Link, LinkError};
use trueup::kortex::messages::base::{ServoingMode, ServoingModeInformation};
use trueup::kortex::messages::cyclic::{ActuatorCommand, Command, Feedback as Told};
use trueup::kortex::refusal;
use trueup::kortex::rpc::{base, base_cyclic};
use trueup::kortex::stream::Cyclic;

use super::arm::{client, largest, turned};
use super::{admin, eager, emulator, link};
use crate::kitchen::HOME;

#[test]
fn a_thousand_sessions_leave_nothing_behind() {
    let emulator = emulator(&eager());
    for round in 0..1000 {
        let link = Link::open(emulator.tcp(), &admin(), Duration::from_secs(10)).unwrap();
        if round % 10 == 0 {
            link.subscribe(base::ON_ACTION_TOPIC).unwrap();
        }
        if round % 50 == 0 {
            let _cyclic = Datagrams::open(emulator.udp(), &admin()).unwrap();
        }
    }
    // The last ones are closed a moment after their clients are gone.
    let until = Wall.now() + 5.0;
    while Wall.now() < until && emulator.status().connections + emulator.status().sessions > 0 {
        Wall.sleep(0.02);
    }
    let status = emulator.status();
    assert_eq!((status.connections, status.sessions, status.subscriptions), (0, 0, 0));
    assert!(status.opened >= 1000);
}

/// An emulator that forgives a busy machine its pauses.
fn patient(faults: &str) -> Emulator {
    let faults = faults.parse().unwrap();
    emulator(&Options { patience: 5.0, faults, ..Options::default() })
}

pub(super) fn streaming(emulator: &Emulator) -> KortexArm {
    let stream = Some(Cyclic { port: emulator.udp().port(), silence: 5.0 });
    KortexArm::connect(Client { stream, ..client(emulator) }).unwrap()
}

#[test]
fn a_streamed_motion_ends_where_asked_and_leaves_low_level_servoing() {
    // One arm that stays in low-level servoing without commands, and one that leaves it after a while.
    for patience in [f64::INFINITY, 5.0] {
        streams_to_the_end(&emulator(&Options { patience, ..Options::default() }));
    }
}

fn streams_to_the_end(emulator: &Emulator) {
    let mut arm = streaming(emulator);
    let (cleared, end) = turned(&HOME, 0.5, 0.5);
    let mut ticks = 0;
    let mut furthest = 0.0_f64;
    arm.follow(&cleared, &Cancel::default(), &mut |tick: &Feedback| {
        ticks += 1;
        furthest = furthest.max(tick.q[0]);
    })
    .unwrap();
    assert!(largest(&arm.feedback().unwrap().q, &end) < 1e-4);
    assert!(furthest < end[0] + 1e-3);
    let beat = arm.beat().unwrap().clone();
    let told = arm.pacing().unwrap();
    assert_eq!((told.sent, told.answered), (beat.sent, beat.answered));
    assert!(told.median_s <= told.p99_s && told.p99_s <= told.worst_s + 1e-5, "{told:?}");
    assert!(arm.pacing().is_none(), "it was told already");
    // A busy machine sends fewer, for as long.
    let streamed = beat.sent as f64 * beat.intervals.mean();
    assert!(streamed > 0.95 * cleared.trajectory().duration(), "{streamed} s of {beat:?}");
    assert!(ticks > 0 && ticks <= beat.answered, "{ticks} of {beat:?}");
    let link = link(emulator);
    let told: ServoingModeInformation = link.call(base::GET_SERVOING_MODE, &()).unwrap();
    assert_eq!(told.servoing_mode(), ServoingMode::SingleLevel);
    // And the next motion begins there.
    let (on, end) = turned(&end, -0.2, 0.5);
    arm.follow(&on, &Cancel::default(), &mut |_| {}).unwrap();
    assert!(largest(&arm.feedback().unwrap().q, &end) < 1e-4);
}

#[test]
fn a_streamed_motion_that_is_called_off_slows_down_and_holds() {
    let emulator = patient("");
    let mut arm = streaming(&emulator);
    let (cleared, end) = turned(&HOME, 1.6, 0.3);
    let cancel = Cancel::default();
    let stopped = arm.follow(&cleared, &cancel, &mut |tick| {
        if tick.q[0] > 0.3 {
            cancel.cancel();
        }
    });
    assert_eq!(stopped, Err(DeviceError::Stopped));
    let rest = arm.feedback().unwrap();
    assert!(rest.q[0] < end[0] - 0.2 && rest.dq.iter().all(|dq| dq.abs() < 0.02), "{rest:?}");
}

#[test]
fn one_datagram_in_twenty_may_be_lost() {
    let emulator = patient("drop=0.05");
    let mut arm = streaming(&emulator);
    let (cleared, end) = turned(&HOME, 0.4, 0.3);
    arm.follow(&cleared, &Cancel::default(), &mut |_| {}).unwrap();
    assert!(largest(&arm.feedback().unwrap().q, &end) < 1e-4);
    let beat = arm.beat().unwrap();
    assert!(beat.answered < beat.sent, "{beat:?}");
}

#[test]
fn a_motion_is_held_while_nobody_answers_and_then_goes_on() {
    // Patient: it stays in low-level servoing through the silence.
    let emulator = patient("stall=400ms@2s");
    let mut arm = streaming(&emulator);
    let (cleared, end) = turned(&HOME, 0.8, 0.15);
    arm.follow(&cleared, &Cancel::default(), &mut |_| {}).unwrap();
    assert!(largest(&arm.feedback().unwrap().q, &end) < 1e-4);
    let beat = arm.beat().unwrap();
    assert!(beat.held > 0, "{beat:?}");
}

#[test]
fn an_arm_that_leaves_low_level_servoing_is_asked_back_and_led_to_the_end() {
    // A silence of four tenths of a second is too long for an arm that waits one.
    let faults = "stall=400ms@2s".parse().unwrap();
    let emulator = emulator(&Options { patience: 0.1, faults, ..Options::default() });
    let mut arm = streaming(&emulator);
    let (cleared, end) = turned(&HOME, 0.8, 0.15);
    let mut before = HOME[0];
    let mut back = 0.0_f64;
    arm.follow(&cleared, &Cancel::default(), &mut |tick: &Feedback| {
        back = back.max(before - tick.q[0]);
        before = tick.q[0];
    })
    .unwrap();
    assert!(largest(&arm.feedback().unwrap().q, &end) < 1e-4);
    let beat = arm.beat().unwrap();
    assert!(beat.left >= 1, "{beat:?}");
    assert!(back < 0.02, "it went back by {back} rad");
}

#[test]
#[ignore = "measures how a busy machine streams: run it alone, beside as many busy programs as wanted"]
#[expect(clippy::print_stdout, reason = "the numbers are what it is run for")]
fn streaming_on_a_busy_machine() {
    let emulator = emulator(&Options { patience: 0.1, ..Options::default() });
    let stream = Some(Cyclic { port: emulator.udp().port(), silence: 2.0 });
    let mut arm = KortexArm::connect(Client { stream, ..client(&emulator) }).unwrap();
    let (mut q, mut turn) = (HOME.to_vec(), 0.8);
    for _ in 0..5 {
        let (cleared, end) = turned(&q, turn, 0.2);
        let begun = Wall.now();
        let followed = arm.follow(&cleared, &Cancel::default(), &mut |_| {});
        let (asked, took) = (cleared.trajectory().duration(), Wall.now() - begun);
        println!("{asked:.1} s asked, {took:.1} s taken, {followed:?}, {:?}", arm.beat().unwrap());
        (q, turn) = (end, -turn);
    }
}

/// Memory that is in use, KiB, and open files, of this process; nothing where the system does not say.
fn footprint() -> Option<(u64, usize)> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    let memory = line.split_whitespace().nth(1)?.parse().ok()?;
    Some((memory, std::fs::read_dir("/proc/self/fd").ok()?.count()))
}

/// Sends what was measured for so long at 1 kHz; returns how many cycles went unanswered.
fn refresh(emulator: &Emulator, seconds: f64) -> (u64, u64) {
    let link = link(emulator);
    let mut cyclic = Datagrams::open(emulator.udp(), &admin()).unwrap();
    let soon = Duration::from_millis(500);
    let mut told: Result<Told, LinkError> = cyclic.call(base_cyclic::REFRESH_FEEDBACK, &(), soon);
    while told.is_err() {
        told = cyclic.call(base_cyclic::REFRESH_FEEDBACK, &(), soon);
    }
    let positions: Vec<f32> = told.unwrap().actuators.iter().map(|a| a.position).collect();
    let low = ServoingModeInformation { servoing_mode: ServoingMode::LowLevel as i32 };
    let () = link.call(base::SET_SERVOING_MODE, &low).unwrap();
    let (begun, mut cycles, mut missed) = (Wall.now(), 0_u64, 0);
    while Wall.now() - begun < seconds {
        cycles += 1;
        let frame_id = (cycles & 0xFFFF) as u32;
        let actuators = positions.iter().map(|&position| ActuatorCommand {
            command_id: frame_id,
            flags: 1,
            position,
            ..ActuatorCommand::default()
        });
        let command = Command { frame_id, actuators: actuators.collect(), interconnect: None };
        match cyclic.call::<Told>(base_cyclic::REFRESH, &command, Duration::from_millis(3)) {
            Ok(told) => assert_eq!(told.frame_id, frame_id),
            Err(LinkError::Silent { .. }) => missed += 1,
            // The machine paused for a tenth of a second: told, and asked for again.
            Err(error) if error.is_refusal(refusal::WRONG_SERVOING_MODE) => {
                let () = link.call(base::SET_SERVOING_MODE, &low).unwrap();
            }
            Err(error) => panic!("{error}"),
        }
        Wall.sleep(begun + cycles as f64 * 1e-3 - Wall.now());
    }
    (cycles, missed)
}

#[test]
fn two_seconds_of_refresh_with_one_per_cent_lost() {
    let faults = "drop=0.01".parse().unwrap();
    let emulator = emulator(&Options { faults, ..Options::default() });
    let (cycles, missed) = refresh(&emulator, 2.0);
    // Two in a hundred are lost; what the machine is late for is a miss, too.
    assert!(cycles > 20 && missed < cycles, "{missed} of {cycles}");
}

#[test]
#[ignore = "takes ten minutes"]
#[expect(clippy::print_stdout, reason = "the numbers are what it is run for")]
fn ten_minutes_of_refresh_with_one_per_cent_lost() {
    let faults = "drop=0.01".parse().unwrap();
    let emulator = emulator(&Options { faults, ..Options::default() });
    // What is reserved once is reserved by then.
    refresh(&emulator, 5.0);
    // Connections are closed a moment after their clients are gone.
    Wall.sleep(2.0);
    let before = footprint();
    let (cycles, missed) = refresh(&emulator, 600.0);
    Wall.sleep(2.0);
    let after = footprint();
    let status = emulator.status();
    println!("{cycles} cycles, {missed} unanswered, {:?} taken, late, starved", status.streamed);
    println!("KiB and files before {before:?}, after {after:?}; {status:?}");
    assert!(cycles > 60_000 && missed < cycles / 4, "{missed} of {cycles}");
    if let (Some((before, files)), Some((after, files_after))) = (before, after) {
        assert!(after < before + 8192, "from {before} to {after} KiB");
        assert_eq!(files, files_after);
    }
}
