//! `trueup emulate kortex`: a Gen3's controller for clients of any make, until Ctrl-C.

use std::net::IpAddr;
use std::sync::Arc;
use std::time::Duration;

use clap::{Args, ValueEnum};

use crate::arm::ticked::Plant;
use crate::arm::{Camera, Cancel, Scales};
use crate::emulator::{self, Emulator, FAULT_WORDS, Faults, Ideal, Options, Pictures, WrongFault};
use crate::kortex::clock::{Clock, Wall};
use crate::motion::robot::Robot;
use crate::report::{self, Failure, Style};
use crate::workcell::{self, Laboratory};

use super::cell::options;
use super::numbers;
use super::shared::Shared;
use super::signals;
use crate::report::exit::Exit;

/// Play a Gen3's controller.
#[derive(Debug, Args)]
pub(super) struct EmulateArgs {
    /// The protocol.
    protocol: Protocol,
    /// Where to listen.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    listen: IpAddr,
    /// TCP port; 0 takes any that is free.
    #[arg(long, value_name = "PORT", default_value_t = 10_000)]
    tcp: u16,
    /// UDP port; 0 takes any that is free.
    #[arg(long, value_name = "PORT", default_value_t = 10_001)]
    udp: u16,
    /// Port of the lab's camera and scales, over HTTP; 0 takes any that is free.
    #[arg(long, value_name = "PORT", default_value_t = 10_080)]
    pictures: u16,
    /// The one user there is at first.
    #[arg(long, default_value = "admin")]
    user: String,
    /// Its password; there is nothing here to protect.
    #[arg(long, default_value = "admin")]
    password: String,
    /// Soft limits as a share of the hard ones, from 0.02 to 1.
    #[arg(long, value_name = "SHARE", value_parser = numbers::share, default_value_t = 1.0)]
    soft: f64,
    /// What goes wrong, such as `drop=0.01,stall=3s@10s`.
    #[arg(long, value_name = "NAME=VALUE,..")]
    fault: Option<String>,
    /// What low-level servoing does without commands: `stay`, `leave` (after 100ms) or a time such as `250ms`.
    #[arg(long, value_name = "HOW", default_value = "stay", value_parser = patience)]
    silence: f64,
    /// An arm that goes exactly where it is sent, with nothing on the table and no camera.
    #[arg(long)]
    ideal: bool,
}

/// Reads how long an arm stays in low-level servoing without a command, s.
fn patience(text: &str) -> Result<f64, String> {
    match text {
        "stay" => Ok(f64::INFINITY),
        "leave" => Ok(0.1),
        time => emulator::duration(time)
            .filter(|value| (0.001..=3600.0).contains(value))
            .ok_or_else(|| "it is `stay`, `leave`, or a time such as 250ms or 2s".to_owned()),
    }
}

/// What is spoken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Protocol {
    /// Kinova's, of the Gen3.
    Kortex,
}

/// `trueup emulate kortex`.
pub(super) fn emulate(args: &EmulateArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let Protocol::Kortex = args.protocol;
    let faults = match &args.fault {
        None => Faults::default(),
        Some(text) => text
            .parse()
            .map_err(|wrong: WrongFault| Failure::input("emulate::fault", wrong.to_string()))
            .map_err(|failure| failure.help(FAULT_WORDS))?,
    };
    let (robot, plant, beside) = inside(args, cli, style)?;
    let options = Options {
        address: args.listen,
        tcp: args.tcp,
        udp: args.udp,
        user: args.user.clone(),
        password: args.password.clone(),
        soft: args.soft,
        patience: args.silence,
        faults,
        seed: cli.common.seed,
        ..Options::default()
    };
    let taken = |what: String| {
        move |error: std::io::Error| {
            Failure::unavailable("emulate::port", format!("cannot listen on {what}: {error}"))
                .help("give other ports, or 0 for any that is free")
        }
    };
    let ports = format!("{}, TCP {} and UDP {}", args.listen, args.tcp, args.udp);
    let emulator = Emulator::start(robot, plant, &options).map_err(taken(ports))?;
    let serve = |(camera, scales)| {
        let port = format!("{}, TCP {}", args.listen, args.pictures);
        Pictures::serve(args.listen, args.pictures, camera, scales).map_err(taken(port))
    };
    let pictures = beside.map(serve).transpose()?;
    tell(args, &emulator, pictures.as_ref(), style);
    until_interrupted(&emulator, style)
}

/// A camera and scales.
type Beside = (Box<dyn Camera>, Box<dyn Scales>);
/// A robot, what is behind the wire, and what stands beside it.
type Inside = (Arc<Robot>, Box<dyn Plant>, Option<Beside>);

/// Returns the robot, what is behind the wire, and what stands beside it.
fn inside(args: &EmulateArgs, cli: &Shared, style: Style) -> Result<Inside, Failure> {
    let options = options(cli, None)?;
    let failed = |error: workcell::Error| report::cell_failure(&error, style);
    if args.ideal {
        let robot = workcell::robot_of(options).map_err(failed)?;
        let home = robot.pose("home").map_or_else(|_| vec![0.0; robot.n_joints()], <[f64]>::to_vec);
        return Ok((robot, Box::new(Ideal::new(&home)), None));
    }
    let lab = workcell::laboratory(options).map_err(failed)?;
    let Laboratory { robot, plant, camera, scales } = lab;
    Ok((robot, Box::new(plant), Some((Box::new(camera), Box::new(scales)))))
}

/// Says where it listens and how to connect.
fn tell(args: &EmulateArgs, emulator: &Emulator, pictures: Option<&Pictures>, style: Style) {
    let (tcp, udp) = (emulator.tcp(), emulator.udp());
    let web = pictures.map(|pictures| format!("http://{}", pictures.address()));
    if style.json {
        style.document(&serde_json::json!({
            "tcp": tcp.to_string(),
            "udp": udp.to_string(),
            "photo": web.as_ref().map(|web| format!("{web}/photo.png")),
            "scales": web.as_ref().map(|web| format!("{web}/scales.json")),
        }));
        return;
    }
    style.say(format!("a Gen3's controller, emulated: TCP {tcp}, UDP {udp}, user {}", args.user));
    if let Some(web) = web {
        style.say(format!(
            "to run against it:\n  {}={} trueup run scripts/pour.task --robot kortex://{}@{tcp} \\\n    \
             --camera-at {web}/photo.png --scales-at {web}/scales.json --speed 1 --yes",
            "KORTEX_PASSWORD", args.password, args.user
        ));
    }
    style.say("Ctrl-C ends it");
}

/// Waits for Ctrl-C, then says how the arm's time went.
fn until_interrupted(emulator: &Emulator, style: Style) -> Result<Exit, Failure> {
    let over = Cancel::default();
    signals::stop(over.clone())?;
    let (begun, begun_arm) = (Wall.now(), emulator.status().time);
    while !over.is_cancelled() {
        std::thread::sleep(Duration::from_millis(50));
    }
    let status = emulator.status();
    let (wall, arm) = (Wall.now() - begun, status.time - begun_arm);
    style.say(format!(
        "{} sessions in {wall:.0} s; the arm's time ran at {:.0} % of the wall's",
        status.opened,
        100.0 * arm / wall.max(1e-3)
    ));
    Ok(Exit::Yes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_an_arm_does_without_commands_is_stay_leave_or_a_time() {
        assert_eq!(patience("stay"), Ok(f64::INFINITY));
        for (text, seconds) in [("leave", 0.1), ("250ms", 0.25), ("2s", 2.0)] {
            assert!((patience(text).unwrap() - seconds).abs() < 1e-12, "{text}");
        }
        for text in ["", "2", "0s", "-1s", "NaNs", "1e9s", "go"] {
            assert!(patience(text).unwrap_err().contains("`stay`, `leave`"), "{text}");
        }
    }
}
