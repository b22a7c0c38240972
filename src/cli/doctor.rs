//! `trueup doctor`: what is in order before anything is asked of it. Nothing moves, and nothing is left behind.
//!
//! Texts and the run folder are looked at always; an arm, a camera, scales and a model only when they are asked
//! for with the options that any command takes.

use std::fs;
use std::path::Path;
use std::time::Duration;

use serde_json::json;

use crate::arm::{Camera as _, Cancel, DeviceError, Feedback, Scales as _};
use crate::execution::error::ActionError;
use crate::execution::lint::readable;
use crate::execution::snapshot::{WebCamera, WebScales};
use crate::http::Address;
#[cfg(feature = "kortex")]
use crate::kortex::supervisor::Supervisor;
use crate::language::Diagnostic;
use crate::language::ast::ActionItem;
use crate::motion::dynamics::{Bodies, Dynamics};
use crate::motion::robot::Robot;
use crate::report::{Failure, Style};
use crate::workcell::{Error, Stdlib, WorkCell, archive, check, library};

use super::arm::{self, ArmAt};
use super::cell::{options, stdlib};
#[cfg(feature = "kortex")]
use super::kortex;
use super::shared::Shared;
use super::{bridge, endpoint};
use crate::report::exit::Exit;

/// How long an arm may take to answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// Where a model is said to be that answers questions about pictures.
const MODEL: &str = "TRUEUP_VQA_URL";

/// How something is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// In order.
    Well,
    /// Works, and a person should know.
    Mind,
    /// Not asked for.
    None,
    /// Wrong.
    Wrong,
    /// Asked for, and does not answer.
    Away,
}

impl State {
    fn word(self) -> &'static str {
        match self {
            Self::Well => "ok",
            Self::Mind => "mind",
            Self::None => "none",
            Self::Wrong => "wrong",
            Self::Away => "away",
        }
    }
}

/// One thing that was looked at.
struct Finding {
    what: &'static str,
    state: State,
    says: String,
    help: Option<String>,
}

impl Finding {
    fn new(what: &'static str, state: State, says: impl Into<String>) -> Self {
        Self { what, state, says: says.into(), help: None }
    }

    fn help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }
}

/// Of scales that nobody named.
const NO_SCALES: &str = "not connected; `--scales-at URL` names some";
/// Of what may stand behind a bridge that cannot be asked, or answers with what cannot be worked with.
const BRIDGE_AWAY: &str = "not asked: the bridge is away";
const BRIDGE_WRONG: &str = "not asked: the bridge cannot be worked with";

/// `trueup doctor`.
pub(super) fn doctor(cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let stdlib = stdlib(cli)?;
    let mut found = vec![texts(&stdlib), scripts(&stdlib), scene(cli), folder(&cli.cell.record)];
    found.extend(arm(cli, style)?);
    let is_told = |found: &[Finding], what: &str| found.iter().any(|finding| finding.what == what);
    if !is_told(&found, "camera") {
        found.push(camera(cli));
    }
    if !is_told(&found, "scales") {
        found.push(scales(cli));
    }
    found.push(model(cli)?);
    let exit = if found.iter().any(|finding| finding.state == State::Away) {
        Exit::Unavailable
    } else if found.iter().any(|finding| finding.state == State::Wrong) {
        Exit::No
    } else {
        Exit::Yes
    };
    if style.json {
        let each = found.iter().map(|finding| {
            let Finding { what, state, says, help } = finding;
            json!({"what": what, "state": state.word(), "says": says, "help": help})
        });
        style.document(
            &json!({"findings": each.collect::<Vec<_>>(), "in_order": exit == Exit::Yes}),
        );
    }
    for finding in &found {
        style.say(words(finding, style));
    }
    Ok(exit)
}

fn words(finding: &Finding, style: Style) -> String {
    let Finding { what, state, says, help } = finding;
    // Padded before it is coloured: what colours is not seen and would be counted.
    let word = format!("{:<6}", state.word());
    let word = match state {
        State::Well => style.green(&word),
        State::Wrong | State::Away => style.red(&word),
        State::None => style.dim(&word),
        State::Mind => word,
    };
    let help = help.as_ref().map(|help| format!("\n                help: {help}"));
    format!("{what:<9} {word}{says}{}", help.unwrap_or_default())
}

fn texts(stdlib: &Stdlib) -> Finding {
    let library = library(stdlib);
    let scope = library.scope(library.default_scene());
    let wrong = (0..library.len())
        .flat_map(|file| check::check_file(&library, stdlib, file, &scope))
        .find(Diagnostic::is_error);
    if let Some(wrong) = wrong {
        let says = format!("{}: {}", wrong.file, wrong.message);
        return Finding::new("texts", State::Wrong, says)
            .help("leave `--stdlib` out for the texts that are built in, or mend that file");
    }
    let (tasks, actions) = (library.tasks().count(), library.actions().count());
    let fluents = library.fluents().count();
    let says = format!("{tasks} tasks, {actions} actions, {fluents} fluents");
    Finding::new("texts", State::Well, says)
}

fn scripts(stdlib: &Stdlib) -> Finding {
    let library = library(stdlib);
    let mut count = 0;
    for name in stdlib.script_names() {
        let text = stdlib.file(&format!("actions/{name}")).unwrap_or_default();
        let runs =
            |action: &ActionItem| action.script.as_ref().is_some_and(|(file, _)| file == name);
        let actions = library.actions().map(|(action, _)| action).filter(|action| runs(action));
        let params =
            actions.flat_map(|action| &action.params).map(|param| param.name.text.as_str());
        if let Err(error) = readable(name, text, params) {
            return Finding::new("scripts", State::Wrong, error.to_string())
                .help("mend the script at that line");
        }
        count += 1;
    }
    Finding::new("scripts", State::Well, format!("{count} scripts of actions can be read"))
}

fn scene(cli: &Shared) -> Finding {
    let found = options(cli, None).and_then(|options| {
        crate::workcell::robot_of(options)
            .map_err(|error| Failure::input("scene", error.to_string()))
    });
    match found {
        Ok(robot) => {
            Finding::new("scene", State::Well, format!("a robot of {} joints", robot.n_joints()))
        }
        Err(failure) => {
            let finding = Finding::new("scene", State::Wrong, failure.message);
            Finding { help: failure.help, ..finding }
        }
    }
}

/// Whether runs can be kept: a folder is made beside them and taken away again.
fn folder(root: &Path) -> Finding {
    let above = root.ancestors().find(|above| above.is_dir() || above.as_os_str().is_empty());
    let above = above.filter(|above| !above.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let probe = above.join(format!(".trueup-doctor-{}", std::process::id()));
    let kept = archive::entries(root).len();
    match fs::create_dir(&probe).and_then(|()| fs::remove_dir(&probe)) {
        Ok(()) => {
            let says = format!("the folder {} can be written, {kept} kept", root.display());
            Finding::new("runs", State::Well, says)
        }
        Err(error) => {
            let says = format!("{} cannot be written: {error}", root.display());
            Finding::new("runs", State::Wrong, says)
                .help("name a folder that may be written with `--record DIR`")
        }
    }
}

#[cfg_attr(
    not(feature = "kortex"),
    expect(unused_variables, reason = "a Gen3 asks for a password")
)]
fn arm(cli: &Shared, style: Style) -> Result<Vec<Finding>, Failure> {
    match arm::at(&cli.cell.robot)? {
        #[cfg(feature = "kortex")]
        ArmAt::Kortex(target) => Ok(vec![gen3(&target, &cli.cell.robot, style)]),
        ArmAt::Bridge(target) => behind(&target, cli),
        ArmAt::Inside => {
            let says = match cli.cell.robot.as_str() {
                "twin" => "the twin, inside the program",
                _ => "the laboratory, inside the program",
            };
            Ok(vec![Finding::new("arm", State::Well, says)])
        }
    }
}

/// Asks a Gen3 how it is; nothing moves.
#[cfg(feature = "kortex")]
fn gen3(target: &kortex::Target, robot: &str, style: Style) -> Finding {
    let (place, open) = match kortex::supervised(robot, style) {
        Ok(open) => open,
        // Without a password nobody can ask it; the rest is looked at all the same.
        Err(failure) => {
            let finding =
                Finding::new("arm", State::Away, format!("{target}: {}", failure.message));
            return Finding { help: failure.help, ..finding };
        }
    };
    let status = Supervisor::open(&open.0, open.1, &open.2, PATIENCE).and_then(|arm| arm.status());
    let status = match status {
        Ok(status) => status,
        Err(error) => {
            let says = format!("{place}: {error}");
            return Finding::new("arm", State::Away, says).help(error.help());
        }
    };
    if let Some(fault) = status.faults.first() {
        let says = format!("{place}: in fault: {fault}");
        return Finding::new("arm", State::Wrong, says)
            .help("`trueup kortex clear-faults`, once the cause is gone");
    }
    // The session that looks is one of those that are listed.
    let others: Vec<&String> = status.about.connected.iter().skip(1).collect();
    if !status.commanded_by.is_empty() || !others.is_empty() {
        let by = if status.commanded_by.is_empty() {
            "others are connected".to_owned()
        } else {
            format!("commanded by {}", status.commanded_by)
        };
        let all: Vec<&str> = status.about.connected.iter().map(String::as_str).collect();
        let says = format!("{target}: {by}; sessions {}", all.join(", "));
        return Finding::new("arm", State::Mind, says)
            .help("close the web application and other programs before the arm is to move");
    }
    let says =
        format!("{target}: {} joints, no faults, not commanded by anyone", status.about.joints);
    Finding::new("arm", State::Well, says)
}

/// How much time is let pass behind a bridge, to see its clock go on, s.
const TICKS: f64 = 0.02;

/// Says how an arm behind a bridge is, after its clock went on by `passed` s.
fn stands(told: &Feedback, passed: f64) -> String {
    // Rounded first: there is no joint at -0.0 deg.
    let deg = |q: &f64| format!("{:.1}", (10.0 * q.to_degrees()).round() / 10.0 + 0.0);
    let q: Vec<String> = told.q.iter().map(deg).collect();
    let (opening, asked, passed) = (1e3 * told.opening, 1e3 * TICKS, 1e3 * passed);
    format!(
        "q {} deg, opening {opening:.1} mm, t went on by {passed:.0} ms in {asked:.0} ms",
        q.join(", ")
    )
}

/// A joint tells by its torque which way gravity is when it bears this part of its effort: friction is less.
const BEARS: f64 = 0.15;
/// An arm that moves faster is not at rest, rad/s or m/s.
const AT_REST: f64 = 0.05;
/// In torques that are meant as they should be the model's come back times so much: something may be in the hand, joints rub, and masses in a robot's
/// file are known to some per cent.
const AS_BORNE: std::ops::RangeInclusive<f64> = 0.4..=2.5;

/// Says what is odd about the torques of an arm that stands, beside those by which its model is held up. An arm that has no sensors says
/// zero.
fn torques(robot: &Robot, told: &Feedback) -> Option<Finding> {
    let model = Dynamics::at_opening(robot, Bodies::All, told.opening);
    let model = model.gravity_torques(&told.q).ok()?;
    let is_silent = !told.tau.iter().any(|tau| tau.abs() > 0.0);
    if is_silent || told.dq.iter().any(|dq| dq.abs() > AT_REST) {
        return None;
    }
    let joints = robot.joints().iter().zip(model.iter().zip(&told.tau)).enumerate();
    let bearing: Vec<(usize, f64, f64)> = joints
        .filter(|(_, (joint, (model, _)))| model.abs() >= BEARS * joint.effort)
        .map(|(at, (_, (model, tau)))| (at + 1, *model, *tau))
        .collect();
    let (joint, needed, tau) = *bearing.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    let along: f64 = bearing.iter().map(|(_, model, tau)| model * tau).sum();
    let times = along / bearing.iter().map(|(_, model, _)| model * model).sum::<f64>();
    if AS_BORNE.contains(&times) {
        return None;
    }
    let unit = if robot.slides(joint - 1) { "N" } else { "N*m" };
    let says = format!(
        "`tau` is {times:.2} times what holds the robot's model up (joint {joint}: {tau:.1} {unit}, by the model {needed:.1} {unit})"
    );
    let help = if AS_BORNE.contains(&-times) {
        "let `tau` be what the drive puts on the link behind it, positive as `q` grows: the signs seem to be turned"
    } else if times < *AS_BORNE.start() {
        "leave gravity in `tau`, in N*m: masses are weighed by it"
    } else {
        "is the hand empty, and `tau` in N*m? Masses are weighed by it"
    };
    Some(Finding::new("torques", State::Mind, says).help(help))
}

/// Connects to a reality behind a bridge, lets a moment pass, takes a picture and weighs; of camera and scales that have an
/// address of their own nothing is said here.
fn behind(target: &bridge::Target, cli: &Shared) -> Result<Vec<Finding>, Failure> {
    let (mut joints, mut says) = (0, String::new());
    let (mut picture, mut weighing, mut odd) = (None, None, None);
    let mut is_away = true;
    // Whether there are scales, once the bridge was found to be one.
    let mut has_scales = None;
    let opened = WorkCell::open_with(options(cli, None)?, |robot, scene, _| {
        joints = robot.n_joints();
        let devices = bridge::devices(target, robot, scene, &cli.cell);
        is_away = devices.as_ref().is_err_and(|trouble| !trouble.is_answer());
        let mut devices = devices.map_err(bridge::refused)?;
        has_scales = Some(devices.scales.is_some());
        let begin = devices.arm.feedback()?.time;
        devices.arm.wait(TICKS, &Cancel::default(), &mut |_| {})?;
        let told = devices.arm.feedback()?;
        says = stands(&told, told.time - begin);
        odd = torques(robot, &told);
        // A camera with an address of its own is looked at by itself.
        picture = cli.cell.camera_at.is_none().then(|| devices.camera.photo());
        // A line with an answer that cannot be has ended.
        if !devices.arm.is_lost() {
            weighing = devices.scales.as_mut().map(|scales| scales.weigh().is_some());
        }
        Ok(devices)
    });
    let arm = match &opened {
        Ok(_) => Finding::new("arm", State::Well, format!("{target}: {joints} joints; {says}")),
        Err(error) => {
            let help = match error {
                Error::Action(ActionError::Device(device)) => device.help(),
                _ => "start the server, then try again",
            };
            let (state, how) = if is_away {
                (State::Away, "")
            } else {
                (State::Wrong, " answers, and cannot be worked with")
            };
            Finding::new("arm", state, format!("{target}{how}: {error}")).help(help)
        }
    };
    let unasked = if is_away { BRIDGE_AWAY } else { BRIDGE_WRONG };
    let mut found = vec![arm];
    found.extend(odd);
    if cli.cell.camera_at.is_none() {
        found.push(match picture {
            Some(Ok(picture)) => {
                let (width, height) = picture.dimensions();
                let says = format!("behind the bridge, of {width} x {height} px");
                Finding::new("camera", State::Well, says)
            }
            Some(Err(error)) => {
                let says = format!("behind the bridge: {error}");
                Finding::new("camera", State::Wrong, says).help(error.help())
            }
            None if has_scales.is_none() => Finding::new("camera", State::None, unasked),
            None => Finding::new("camera", State::None, "the bridge gave no picture"),
        });
    }
    if cli.cell.scales_at.is_none() {
        found.push(match (has_scales, weighing) {
            (_, Some(true)) => Finding::new("scales", State::Well, "behind the bridge"),
            (_, Some(false)) => {
                Finding::new("scales", State::Away, "the bridge's give no weighing")
            }
            (Some(false), None) => Finding::new("scales", State::None, NO_SCALES),
            // What comes before the weighing failed.
            (Some(true), None) => Finding::new("scales", State::None, "the bridge's, not asked"),
            (None, None) => Finding::new("scales", State::None, unasked),
        });
    }
    Ok(found)
}

fn camera(cli: &Shared) -> Finding {
    let is_elsewhere = cli.cell.robot.starts_with(arm::KORTEX);
    let Some(address) = cli.cell.camera_at.clone() else {
        if is_elsewhere {
            return Finding::new("camera", State::Wrong, "an arm without a camera does nothing")
                .help("name one: `--camera-at http://HOST/PATH`");
        }
        return Finding::new("camera", State::Well, "the laboratory's, inside the program");
    };
    match WebCamera(address.clone()).photo() {
        Ok(picture) => {
            let says = format!("{address}: {} x {} px", picture.width(), picture.height());
            Finding::new("camera", State::Well, says)
        }
        Err(error) => away("camera", &address, &error),
    }
}

fn scales(cli: &Shared) -> Finding {
    let Some(address) = cli.cell.scales_at.clone() else {
        return Finding::new("scales", State::None, NO_SCALES);
    };
    match WebScales(address.clone()).weigh() {
        Some(_) => Finding::new("scales", State::Well, address.to_string()),
        None => Finding::new("scales", State::Away, format!("{address} gives no weighing"))
            .help("open the address in a browser: does it answer with JSON?"),
    }
}

/// A model is never needed: geometry and people answer without one. It is asked which models it serves; no
/// picture is sent.
fn model(cli: &Shared) -> Result<Finding, Failure> {
    let said = std::env::var(MODEL).ok().filter(|said| !said.is_empty());
    let base = match (&cli.cell.ask_endpoint, said) {
        (Some(base), _) => base.clone(),
        (None, None) => {
            let says = format!("not connected; `--ask-endpoint URL` or `{MODEL}` names one");
            return Ok(Finding::new("model", State::None, says));
        }
        (None, Some(said)) => match said.parse::<Address>() {
            Ok(base) => base,
            Err(why) => {
                return Ok(Finding::new("model", State::Wrong, format!("`{MODEL}`: {why}"))
                    .help("it is `http://HOST:PORT/v1`"));
            }
        },
    };
    let name = cli.cell.ask_model.clone().unwrap_or_default();
    let endpoint = endpoint::at(base, Some(name), PATIENCE.as_secs_f64(), false)?;
    let place = endpoint.base().to_string();
    Ok(match endpoint.models() {
        Ok(models) => {
            let says = format!("{place} serves {}; `trueup vqa probe` tries it", models.join(", "));
            Finding::new("model", State::Well, says)
        }
        Err(why) => Finding::new("model", State::Away, format!("{place}: {why}"))
            .help("is the server running, and does the address end in `/v1`?"),
    })
}

fn away(what: &'static str, address: &Address, error: &DeviceError) -> Finding {
    Finding::new(what, State::Away, format!("{address}: {error}")).help(error.help())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Torques with turned signs, and such without gravity, were `ok`, and then weighed with.
    #[test]
    fn torques_of_an_arm_at_rest_are_held_against_its_model() {
        let robot = Robot::gen3();
        let q = robot.pose("home").unwrap().to_vec();
        let model = Dynamics::new(&robot, Bodies::All).gravity_torques(&q).unwrap();
        let still = vec![0.0; q.len()];
        let told = |times: f64, rubs: f64| Feedback {
            time: 0.0,
            q_cmd: q.clone(),
            q: q.clone(),
            dq: still.clone(),
            tau: model.iter().map(|tau| times * tau + rubs).collect(),
            opening: 0.0,
            mass: None,
            moving: Vec::new(),
        };
        let help =
            |times, rubs| torques(&robot, &told(times, rubs)).map(|found| found.help.unwrap());
        for (times, rubs) in [(1.0, 0.0), (1.0, 2.0), (1.0, -2.0), (1.6, 0.0), (0.0, 0.0)] {
            assert_eq!(help(times, rubs), None, "{times} {rubs}");
        }
        assert!(help(-1.0, 0.5).unwrap().contains("signs"));
        assert!(help(0.0, 0.5).unwrap().contains("leave gravity"));
        assert!(help(8.9, 0.0).unwrap().contains("in N*m?"));
        let falls = Feedback { dq: vec![0.5; q.len()], ..told(-1.0, 0.0) };
        assert!(torques(&robot, &falls).is_none());
    }
}
