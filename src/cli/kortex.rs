//! `--robot kortex://USER@HOST[:PORT]`: where the arm is and who connects.
//!
//! The password comes from the environment or is asked for; an address that holds one is refused, for what
//! is on a command line can be read by everyone on the machine.

use std::fmt;
use std::io::{self, IsTerminal};
use std::sync::Arc;
use std::time::Duration;

use crate::arm::{Cancel, Scales};
use crate::execution::snapshot::{WebCamera, WebScales};
use crate::http::Address;
use crate::kortex::arm::{KortexArm, Options};
use crate::kortex::clock::Wall;
use crate::kortex::link::Login;
use crate::kortex::stream::Cyclic;
use crate::motion::robot::Robot;
use crate::report::{Failure, Style};
use crate::workcell::{Devices, Error};

use super::arm::KORTEX;
use super::shared::CellArgs;

/// The port of a Gen3.
const PORT: u16 = 10_000;
/// Where the password is looked for.
const PASSWORD: &str = "KORTEX_PASSWORD";

/// Where an arm is and who connects.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Target {
    user: String,
    host: String,
    port: u16,
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{KORTEX}{}:{}", self.host, self.port)
    }
}

/// Reads `USER@HOST[:PORT]`.
pub(super) fn target(rest: &str) -> Result<Target, Failure> {
    let wrong = |what: &str| {
        Failure::input("robot::address", what)
            .help("it is `kortex://USER@HOST` or `kortex://USER@HOST:PORT`")
    };
    let (user, place) = rest.rsplit_once('@').unwrap_or(("admin", rest));
    if user.contains(':') {
        let what = "a password does not belong on the command line";
        return Err(Failure::input("robot::password", what)
            .help(format!("set {PASSWORD} instead, or be asked for it")));
    }
    let (host, port) = match place.rsplit_once(':') {
        Some((host, port)) => {
            let port = port.parse();
            (host, port.map_err(|_| wrong("the arm's port is a number up to 65535"))?)
        }
        None => (place, PORT),
    };
    if host.is_empty() || user.is_empty() {
        return Err(wrong("the arm's address is not whole"));
    }
    Ok(Target { user: user.to_owned(), host: host.to_owned(), port })
}

/// Returns who connects, with the password of the environment or of whoever sits at the terminal.
fn login(target: &Target, style: Style) -> Result<Login, Failure> {
    let none = || {
        Failure::input("robot::password", "no password for the arm")
            .at(target.to_string())
            .help(format!("set {PASSWORD}"))
    };
    let password = match std::env::var(PASSWORD) {
        Ok(password) => password,
        Err(_) if io::stdin().is_terminal() && !style.json => {
            let asked = format!("password of {} at {}: ", target.user, target.host);
            rpassword::prompt_password(asked).map_err(|_| none())?
        }
        Err(_) => return Err(none()),
    };
    Ok(Login { user: target.user.clone(), password })
}

/// Reads where an arm is, with or without the scheme, and gets the password: its name for people, then host,
/// port and who connects.
pub(super) fn supervised(
    address: &str,
    style: Style,
) -> Result<(String, (String, u16, Login)), Failure> {
    let target = target(address.strip_prefix(KORTEX).unwrap_or(address))?;
    let login = login(&target, style)?;
    Ok((target.to_string(), (target.host, target.port, login)))
}

/// What is known before anyone connects.
pub(super) struct Ready {
    target: Target,
    login: Login,
    camera: Address,
    scales: Option<Address>,
    speed: f64,
    is_streamed: bool,
}

impl Ready {
    /// Looks whether everything has been said that is needed, and gets the password.
    pub(super) fn new(target: Target, args: &CellArgs, style: Style) -> Result<Self, Failure> {
        let Some(camera) = args.camera_at.clone() else {
            let what = "this is an arm without a camera, and nothing is done unseen";
            return Err(Failure::unavailable("robot::no_camera", what)
                .at(target.to_string())
                .help("name the camera that sees the table: `--camera-at http://HOST/PATH`"));
        };
        let login = login(&target, style)?;
        Ok(Self {
            target,
            login,
            camera,
            scales: args.scales_at.clone(),
            speed: args.speed,
            is_streamed: args.stream,
        })
    }

    /// Connects to the arm and what stands beside it. Nothing moves.
    pub(super) fn connect(self, robot: &Arc<Robot>) -> Result<Devices, Error> {
        let joints = robot.n_joints();
        let options = Options {
            host: self.target.host,
            port: self.target.port,
            stream: self.is_streamed.then(|| Cyclic::at(self.target.port.saturating_add(1))),
            login: self.login,
            rate: 40.0,
            timeout: Duration::from_secs(5),
            patience: Options::PATIENCE,
            near: robot.pose("home").map_or_else(|_| vec![0.0; joints], <[f64]>::to_vec),
            max_opening: robot.max_opening(),
            clock: Arc::new(Wall),
        };
        let arm = KortexArm::connect(options)?;
        let limits = arm.about().soft.scaled(self.speed, self.speed);
        let scales = self.scales.map(|at| -> Box<dyn Scales> { Box::new(WebScales(at)) });
        Ok(Devices {
            arm: Box::new(arm),
            camera: Box::new(WebCamera(self.camera)),
            scales,
            limits: Some(limits),
            cancel: Cancel::default(),
        })
    }
}
