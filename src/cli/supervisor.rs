//! `trueup kortex`: how a Gen3 is, stop, and clear its faults, beside whoever commands it.

use std::time::Duration;

use clap::{Args, Subcommand};
use serde_json::json;

use crate::arm::{Cancel, DeviceError, Pacing};
use crate::kortex::messages::base::ServoingMode;
use crate::kortex::messages::common::ArmState;
use crate::kortex::supervisor::{COMING_TO_REST, Status, Stopped, Supervisor};
use crate::report::{self, Failure, Style};

use super::{kortex, numbers, signals};
use crate::report::exit::Exit;

/// What is said once the emergency stop was called.
const IN_FAULT: &str = "stopped; the arm is in fault until `trueup kortex clear-faults`";
/// How long an arm may take to answer.
const PATIENCE: Duration = Duration::from_secs(5);

/// Look after a Gen3 without moving it anywhere.
#[derive(Debug, Subcommand)]
pub(super) enum KortexCommand {
    /// Say how the arm is: what it is, what it does, where it stands, what is wrong with it.
    Status(Whom),
    /// Stop the arm; it holds, and can be commanded again.
    Stop(StopArgs),
    /// Clear the arm's faults, once their cause is gone.
    ClearFaults(Whom),
    /// Measure how evenly this computer streams: hold the arm where it is by 1000 positions a second.
    Beat(BeatArgs),
}

/// Which arm.
#[derive(Debug, Args)]
pub(super) struct Whom {
    /// Where it is: `kortex://USER@HOST[:PORT]`, or `HOST` for the user admin. The password is
    /// `KORTEX_PASSWORD`, or is asked for.
    address: String,
}

/// How to measure the beat.
#[derive(Debug, Args)]
pub(super) struct BeatArgs {
    #[command(flatten)]
    whom: Whom,
    /// For how long, s, from 1 to 600.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = numbers::beat)]
    seconds: f64,
    /// The arm's UDP port, where it is not the one after its TCP port.
    #[arg(long, value_name = "PORT")]
    udp: Option<u16>,
}

/// How to stop it.
#[derive(Debug, Args)]
pub(super) struct StopArgs {
    #[command(flatten)]
    whom: Whom,
    /// Stop it as its red button does: it is in fault until its faults are cleared.
    #[arg(long)]
    emergency: bool,
}

/// `trueup kortex`.
pub(super) fn kortex(command: &KortexCommand, style: Style) -> Result<Exit, Failure> {
    let (whom, is_status) = match command {
        KortexCommand::Status(whom) => (whom, true),
        KortexCommand::ClearFaults(whom) => (whom, false),
        KortexCommand::Beat(args) => return beat(args, style),
        KortexCommand::Stop(args) => (&args.whom, false),
    };
    let (place, open) = kortex::supervised(&whom.address, style)?;
    let failed = |error: DeviceError| {
        Failure::unavailable("device", error.to_string()).at(place.clone()).help(error.help())
    };
    let arm = Supervisor::open(&open.0, open.1, &open.2, PATIENCE).map_err(failed)?;
    let done = match command {
        KortexCommand::Status(_) | KortexCommand::Beat(_) => "",
        KortexCommand::Stop(StopArgs { emergency: true, .. }) => {
            arm.emergency_stop(COMING_TO_REST).map_err(failed)?;
            IN_FAULT
        }
        KortexCommand::Stop(_) => match arm.stop(COMING_TO_REST).map_err(failed)? {
            Stopped::Held => "stopped; the arm rests and holds its position",
            Stopped::Emergency => {
                style.note("the arm went on after a stop; its emergency stop was called");
                IN_FAULT
            }
        },
        KortexCommand::ClearFaults(_) => {
            arm.clear_faults().map_err(failed)?;
            "the arm has no faults"
        }
    };
    if !is_status {
        if style.json {
            style.document(&json!({ "arm": place, "done": done }));
        }
        style.say(done);
        return Ok(Exit::Yes);
    }
    let status = arm.status().map_err(failed)?;
    if style.json {
        style.document(&document(&place, &status));
    } else {
        style.say(words(&status));
    }
    Ok(if status.faults.is_empty() { Exit::Yes } else { Exit::No })
}

/// Holds the arm where it is for a while and says how evenly the positions left.
fn beat(args: &BeatArgs, style: Style) -> Result<Exit, Failure> {
    let (place, (host, port, login)) = kortex::supervised(&args.whom.address, style)?;
    let failed = |error: DeviceError| {
        Failure::unavailable("device", error.to_string()).at(place.clone()).help(error.help())
    };
    let arm = Supervisor::open(&host, port, &login, PATIENCE).map_err(failed)?;
    let udp = args.udp.unwrap_or(port.saturating_add(1));
    let over = Cancel::default();
    signals::stop(over.clone())?;
    let beat = arm.hold(&host, udp, &login, args.seconds, &over).map_err(failed)?;
    let told = Pacing::from(&beat);
    if style.json {
        style.document(&told);
    } else {
        style.say(report::run::pacing(&told));
    }
    Ok(if signals::is_interrupted() { Exit::Stopped } else { Exit::Yes })
}

/// Returns what an arm does, in words.
fn state(state: ArmState) -> &'static str {
    match state {
        ArmState::BaseInitialization | ArmState::Initialization => "starting",
        ArmState::Idle => "idle",
        ArmState::InFault => "in fault",
        ArmState::Maintenance => "in maintenance",
        ArmState::ServoingLowLevel => "commanded at 1 kHz",
        ArmState::ServoingReady => "ready",
        ArmState::ServoingPlayingSequence => "playing a sequence",
        ArmState::ServoingManuallyControlled => "moved by hand commands",
        ArmState::BrakeReleasing => "releasing its brakes",
        ArmState::Unspecified | ArmState::Reserved => "in a state it does not name",
    }
}

fn words(status: &Status) -> String {
    let Status { about, commanded_by, joints, closed, faults } = status;
    let listed = |numbers: &[f64], digits: usize| {
        let each: Vec<String> = numbers.iter().map(|x| format!("{x:.digits$}")).collect();
        each.join(", ")
    };
    let degrees = |list: &[f64]| list.iter().map(|x| x.to_degrees()).collect::<Vec<f64>>();
    let firmware = if about.firmware.is_empty() { "unknown" } else { &about.firmware };
    let mut lines = vec![
        format!(
            "arm       model {:?}, {} joints, gripper {:?}, brakes {:?}, firmware {firmware}",
            about.model, about.joints, about.gripper, about.brakes
        ),
        format!("state     {}", state(about.state)),
        format!("joints    {} deg", listed(joints, 1)),
    ];
    if let Some(closed) = closed {
        lines.push(format!("gripper   {:.0} % closed", closed * 100.0));
    }
    let fastest = |limits: &[f64]| format!("{} deg/s", listed(&degrees(limits), 0));
    lines.push(format!("can do    {} (hard limits)", fastest(&about.hard.velocity)));
    lines.push(format!("accepts   {} (soft limits)", fastest(&about.soft.velocity)));
    if about.servoing == ServoingMode::LowLevel {
        lines.push("mode      low-level servoing: someone streams positions".to_owned());
    }
    let by = if commanded_by.is_empty() { "nobody" } else { commanded_by };
    lines.push(format!("commands  {by}"));
    lines.push(format!("sessions  {}", about.connected.join(", ")));
    for fault in faults {
        lines.push(format!("fault     {fault}"));
    }
    lines.join("\n")
}

fn document(place: &str, status: &Status) -> serde_json::Value {
    let Status { about, commanded_by, joints, closed, faults } = status;
    json!({
        "arm": place,
        "model": format!("{:?}", about.model),
        "joints": about.joints,
        "gripper": format!("{:?}", about.gripper),
        "brakes": format!("{:?}", about.brakes),
        "firmware": about.firmware,
        "state": state(about.state),
        "servoing": format!("{:?}", about.servoing),
        "joints_deg": joints,
        "gripper_closed": closed,
        "hard_rad_s": about.hard.velocity,
        "soft_rad_s": about.soft.velocity,
        "commanded_by": commanded_by,
        "sessions": about.connected,
        "faults": faults,
    })
}
