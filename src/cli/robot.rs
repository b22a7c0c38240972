//! `trueup robot`: kinematics, dynamics and planning of any robot with a URDF.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::{Args, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};

use crate::language::nearest;
use crate::motion::dynamics::Bodies;
use crate::motion::fault::{SideFault, UrdfFault};
use crate::motion::robot::{Motion, Robot};
use crate::motion::{self, Budget, budget, rrt};
use crate::report::{Failure, Style};
use crate::workcell::{RobotError, Stdlib};

use super::answer::plan::{self, PlanAnswer, SAMPLES};
use super::answer::problem::Problem;
use super::answer::robot as answer;
use super::answer::robot_check;
use super::answer::rows::{joint_rows, pose_rows};
use super::clock::clock;
use super::inputs::{data, read};
use super::numbers;
use super::shared::Shared;
use super::signals::{is_interrupted, watch_interrupt};
use crate::report::exit::Exit;

#[derive(Debug, Subcommand)]
pub(super) enum RobotCommand {
    /// Where the tip is for joint positions.
    Fk(QArgs),
    /// Joint positions that bring the tip to a pose.
    Ik(IkArgs),
    /// Gravity torques and mass matrix, of the links up to the tip.
    Dynamics(DynamicsArgs),
    /// A collision-free path, timed.
    Plan(PlanArgs),
    /// What a robot's files have, and what is missing for planning, the twin and a pour.
    Check(CheckArgs),
}

#[derive(Debug, Args)]
pub(super) struct Which {
    /// The robot: a URDF, a folder with one, or the name of a robot of the stdlib; the stdlib's Gen3 when left out.
    #[arg(long, value_name = "URDF")]
    robot_file: Option<PathBuf>,
    /// The link whose pose is meant; the Gen3's flange when left out, or the end of the chain.
    #[arg(long, value_name = "LINK")]
    tip: Option<String>,
}

#[derive(Debug, Args)]
pub(super) struct QArgs {
    #[command(flatten)]
    which: Which,
    /// Joint positions, rad: `q1,...,qn`.
    #[arg(long, allow_hyphen_values = true, required_unless_present = "q_file")]
    q: Option<String>,
    /// Rows of joint positions, rad, with or without a header.
    #[arg(long, value_name = "CSV", conflicts_with = "q")]
    q_file: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(super) struct DynamicsArgs {
    #[command(flatten)]
    rows: QArgs,
    /// Count the gripper and everything else beyond the tip too.
    #[arg(long)]
    with_gripper: bool,
}

#[derive(Debug, Args)]
pub(super) struct IkArgs {
    #[command(flatten)]
    which: Which,
    /// A pose of the tip in the base: `x,y,z,qw,qx,qy,qz`, m.
    #[arg(long, allow_hyphen_values = true, required_unless_present = "pose_file")]
    pose: Option<String>,
    /// Rows of poses.
    #[arg(long, value_name = "CSV", conflicts_with = "pose")]
    pose_file: Option<PathBuf>,
    /// Prefer solutions near these joint positions, rad.
    #[arg(long, allow_hyphen_values = true)]
    near: Option<String>,
}

#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    /// A URDF, a folder with one, or the name of a robot of the stdlib.
    file: PathBuf,
    /// The link whose pose is meant; `tip` of robot.toml or the end of the chain when left out.
    #[arg(long, value_name = "LINK")]
    tip: Option<String>,
}

#[derive(Debug, Args)]
pub(super) struct PlanArgs {
    #[command(flatten)]
    which: Which,
    /// The problem: start, goals, obstacles.
    #[arg(long, value_name = "FILE.json")]
    problem: PathBuf,
    /// How many samples a path is searched with in all, from 1 to 1000000; a way with 3 mm of room is searched for first.
    #[arg(long, value_name = "N", default_value_t = SAMPLES, value_parser = numbers::samples)]
    samples: usize,
}

/// Where more samples than usual are asked for there is a usual budget for each so many. Chosen: of trees that large a search goes
/// on to its last sample.
const SAMPLES_OF_A_BUDGET: usize = 50_000;

/// What rows of joint positions look like.
const ROWS: &str = "numbers stand between commas, one row a line; a header may name the columns and their units; another arm than the \
    Gen3 is named by `--robot-file URDF`";

/// What poses look like.
const POSES: &str = "a pose is `x,y,z,qw,qx,qy,qz`: a place in m, and a quaternion of length 1, w first; any other has that length when its \
    four numbers are divided by its own";

/// What a planning problem looks like.
const PROBLEM: &str = "it holds {\"start\": [..], \"goals\": [[..]], \"obstacles\": [{\"shape\": \"box\", \"size_m\": [0.1, 0.1, 0.4], \
     \"pose\": {\"xyz_m\": [0.5, 0, 0.2], \"quat_wxyz\": [1, 0, 0, 0]}}]}, with quaternions of length 1";

/// What is asked of a robot, and so what is read of it.
#[derive(Debug, Clone, Copy)]
enum Asked {
    /// Where the links up to the tip are, and what they weigh.
    UpToTip,
    /// Where all links are, and what they weigh.
    All,
    /// What it touches too.
    Touch,
}

fn robot_of(which: &Which, asked: Asked) -> Result<Robot, Failure> {
    let tip = which.tip.as_deref();
    match (&which.robot_file, tip) {
        (Some(path), tip) => named(path, tip, asked),
        (None, Some(tip)) => Robot::gen3_to(tip).map_err(|error| failure(&error)),
        (None, None) => Ok(Robot::gen3()),
    }
}

/// Reads a robot from a URDF or the one in a folder; what is neither may be the name of a robot of the stdlib.
fn named(path: &Path, tip: Option<&str>, asked: Asked) -> Result<Robot, Failure> {
    let place = path.display().to_string();
    if !path.exists() {
        match Stdlib::embedded().robot_to(&place, tip) {
            Ok(robot) => return Ok(robot),
            Err(RobotError::Text { error, .. }) => return Err(failure(&error).at(place)),
            // Then it is a file that is not there.
            Err(RobotError::None { .. }) => {}
        }
    }
    let robot = match asked {
        Asked::UpToTip => Robot::bare_from_file(path, tip, false),
        Asked::All => Robot::bare_from_file(path, tip, true),
        Asked::Touch => Robot::from_file(path, tip),
    };
    robot.map_err(|error| failure(&error).at(place))
}

fn failure(error: &motion::Error) -> Failure {
    let failure = Failure::input("robot::input", error.to_string());
    match error {
        motion::Error::Urdf { what: UrdfFault::Xacro } => {
            failure.help("`xacro FILE.xacro > FILE.urdf` makes one (a tool of ROS)")
        }
        motion::Error::Urdf { what: UrdfFault::Lacks(lacking) }
            if lacking.element == "geometry" =>
        {
            failure.help("a <geometry> holds one <box>, <cylinder>, <sphere>, <capsule> or <mesh>")
        }
        motion::Error::Urdf { what: UrdfFault::Lacks(lacking) } if lacking.element != "robot" => {
            let (field, element) = (&lacking.field, &lacking.element);
            failure.help(format!("write the {field} of this <{element}>, or take the element out"))
        }
        motion::Error::Urdf {
            what: UrdfFault::Format(_) | UrdfFault::NoLink | UrdfFault::Lacks(_),
        } => failure.help("a URDF is XML whose root is `<robot name=\"…\">`"),
        motion::Error::Urdf { what: UrdfFault::SeveralFiles { .. } } => failure,
        motion::Error::Urdf { what: UrdfFault::Size { .. } } => failure
            .help("sizes of a <collision> are above 0 m; a link that is to touch nothing has none"),
        motion::Error::Urdf { .. } => {
            failure.help("correct it in the file, or in what the file is made from")
        }
        motion::Error::SideFile { what: SideFault::NoLink { name, known, .. } } => {
            match nearest(name, known.iter().map(String::as_str)) {
                Some(near) => failure.help(format!("did you mean `{near}`?")),
                None => failure.help("name a link of the URDF, or take the entry out"),
            }
        }
        motion::Error::NoLink { name, known } => {
            match nearest(name, known.iter().map(String::as_str)) {
                Some(near) => failure.help(format!("did you mean `{near}`?")),
                None => failure.help("leave `--tip` out for the end of the arm"),
            }
        }
        motion::Error::Branches { .. } => {
            failure.help("`--tip LINK` names the end of the arm that is meant")
        }
        motion::Error::WrongLength { .. } => {
            failure.help("another arm than the Gen3 is named by `--robot-file URDF`")
        }
        _ => failure,
    }
}

/// Reads rows given on the line or in a file.
fn rows_of(
    robot: &Robot,
    line: Option<&String>,
    file: Option<&PathBuf>,
    style: Style,
) -> Result<Rows, Failure> {
    let (text, place) = match (line, file) {
        (Some(line), _) => (line.clone(), "--q".to_owned()),
        (None, Some(path)) => (data(path)?, path.display().to_string()),
        (None, None) => (String::new(), "--q".to_owned()),
    };
    let rows = joint_rows(robot, &text).map_err(|error| failure(&error).at(place).help(ROWS))?;
    mind_degrees(robot, &rows, style);
    Ok(rows)
}

/// Says so where a joint that turns is a whole turn beyond its range, which hardly any angle in rad is.
fn mind_degrees(robot: &Robot, rows: &Rows, style: Style) {
    let far = |q: &Vec<f64>| {
        let joints = robot.joints().iter().zip(q);
        let mut turning = joints.filter(|(joint, _)| {
            robot.links()[joint.link].joint.motion == Motion::Turn && joint.upper.is_finite()
        });
        turning
            .find(|(joint, q)| !(joint.lower - TAU..=joint.upper + TAU).contains(*q))
            .map(|(joint, q)| (joint.name.clone(), *q, joint.lower, joint.upper))
    };
    if let Some((name, q, lower, upper)) = rows.iter().find_map(far) {
        style.note(&format!(
            "{name} is at {q} rad, and its range is {lower:.2} to {upper:.2} rad; if these are degrees, name the columns \
             `q_1[deg]`, `q_2[deg]`, …"
        ));
    }
}

type Rows = Vec<Vec<f64>>;

/// Tells on a terminal how far a check has come, and at first that the robot is read.
fn bar(style: Style) -> ProgressBar {
    if !style.bars || style.quiet {
        return ProgressBar::hidden();
    }
    let look = ProgressStyle::with_template("{bar:24} {msg}  {elapsed}");
    let bar = ProgressBar::new(1).with_message("reading");
    bar.enable_steady_tick(Duration::from_millis(120));
    bar.with_style(look.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// `trueup robot ...`.
pub(super) fn robot(
    command: &RobotCommand,
    shared: &Shared,
    style: Style,
) -> Result<Exit, Failure> {
    let mut now_us = || clock() * 1e6;
    let (seed, motion) = (shared.common.seed, shared.cell.motion);
    match command {
        RobotCommand::Fk(args) => {
            let robot = robot_of(&args.which, Asked::UpToTip)?;
            let rows = rows_of(&robot, args.q.as_ref(), args.q_file.as_ref(), style)?;
            let found = answer::fk(&robot, &rows).map_err(|error| failure(&error))?;
            style.answer(&found);
            Ok(Exit::Yes)
        }
        RobotCommand::Dynamics(args) => {
            let (bodies, asked) = if args.with_gripper {
                (Bodies::All, Asked::All)
            } else {
                (Bodies::UpToTip, Asked::UpToTip)
            };
            let robot = robot_of(&args.rows.which, asked)?;
            let rows = rows_of(&robot, args.rows.q.as_ref(), args.rows.q_file.as_ref(), style)?;
            let found = answer::dynamics(&robot, bodies, &rows).map_err(|error| failure(&error))?;
            style.answer(&found);
            Ok(Exit::Yes)
        }
        RobotCommand::Ik(args) => {
            let robot = robot_of(&args.which, Asked::UpToTip)?;
            let (text, place) = match (&args.pose, &args.pose_file) {
                (Some(line), _) => (line.clone(), "--pose".to_owned()),
                (None, Some(path)) => (data(path)?, path.display().to_string()),
                (None, None) => (String::new(), "--pose".to_owned()),
            };
            let poses = pose_rows(&text).map_err(|error| failure(&error).at(place).help(POSES))?;
            let near = match &args.near {
                None => Vec::new(),
                Some(_) => rows_of(&robot, args.near.as_ref(), None, style)?.swap_remove(0),
            };
            if args.near.is_some() {
                robot.check(&near).map_err(|error| failure(&error).at("--near"))?;
            }
            let found = answer::ik(&robot, &poses, &near, seed, &mut now_us);
            style.answer(&found);
            Ok(if found.solutions.iter().all(|s| matches!(s, answer::IkSolution::Found { .. })) {
                Exit::Yes
            } else {
                Exit::No
            })
        }
        RobotCommand::Check(args) => {
            let bar = bar(style);
            let robot = named(&args.file, args.tip.as_deref(), Asked::Touch)
                .inspect_err(|_| bar.finish_and_clear())?;
            let found = robot_check::check(&robot, &mut |what, [done, of]| {
                bar.set_length(of as u64 + 1);
                bar.set_position(done as u64 + 1);
                bar.set_message(what);
            });
            bar.finish_and_clear();
            if style.json {
                style.document(&found);
            } else {
                style.say(found.lines());
            }
            Ok(if found.is_ready() { Exit::Yes } else { Exit::No })
        }
        RobotCommand::Plan(args) => {
            let robot = robot_of(&args.which, Asked::Touch)?;
            let place = args.problem.display().to_string();
            let problem = Problem::parse(&read(&args.problem)?).map_err(|error| {
                Failure::input("robot::problem", error.to_string()).at(&place).help(PROBLEM)
            })?;
            let settings =
                rrt::Settings { max_samples: args.samples, ..rrt::Settings::seeded(seed) };
            watch_interrupt()?;
            // Who asks for more samples than usual is to have them.
            let is_usual = args.samples <= SAMPLES;
            let times = if is_usual { 1 } else { args.samples.div_ceil(SAMPLES_OF_A_BUDGET) };
            let budget = Budget::of(budget::USUAL.saturating_mul(times as u64), is_interrupted);
            let found = {
                let means = motion.into();
                plan::plan(&robot, &problem, means, &settings, &budget, &mut now_us)
            };
            let found = match found {
                Err(motion::Error::Cancelled) => return Ok(Exit::Stopped),
                found => found.map_err(|error| failure(&error).at(place).help(PROBLEM))?,
            };
            if style.json {
                style.document(&found);
            } else {
                style.say(found.lines(&robot.sliding()));
            }
            Ok(if matches!(found, PlanAnswer::Found { .. }) { Exit::Yes } else { Exit::No })
        }
    }
}
