//! The work cell that the arguments ask for: stdlib, robot, laboratory, model, and the folder the prompt keeps.

use std::path::{Path, PathBuf};

use crate::execution::calibrate::Switches;
use crate::files;
use crate::lab::LabSettings;
use crate::language::Source;
use crate::report::{self, Failure, Style};
use crate::vqa::Endpoint;
use crate::workcell::{Options, Run, Stdlib, WorkCell};

use super::arm::{self, ArmAt};
use super::clock::clock;
use super::inputs::read;
#[cfg(feature = "kortex")]
use super::kortex;
use super::shared::{CellArgs, Pace, Shared};
use super::{bridge, consent, endpoint, learn};

/// Returns which regressions are in force when these are left out.
pub(super) fn switches(left_out: &[u8]) -> Result<Switches, Failure> {
    let mut switches = Switches::default();
    for which in left_out {
        match which {
            1 => switches.camera = false,
            2 => switches.intrinsics = false,
            3 => switches.offset = false,
            other => {
                return Err(Failure::input(
                    "usage::regression",
                    format!("there is no regression {other}"),
                )
                .help("1 camera alignment, 2 intrinsics, 3 robot offset"));
            }
        }
    }
    Ok(switches)
}

/// Returns the embedded stdlib with the user's folder over it.
pub(super) fn stdlib(cli: &Shared) -> Result<Stdlib, Failure> {
    let embedded = Stdlib::embedded().reading(|path| files::read::text(Path::new(path)));
    match &cli.cell.stdlib {
        None => Ok(embedded),
        Some(folder) => embedded.with_folder(folder).map_err(|(path, error)| {
            let mut failure = Failure::unread(&path, &error)
                .help("`--stdlib` takes a folder laid out like the project's `stdlib/`");
            failure.code = "io::read".into();
            failure
        }),
    }
}

/// Returns how a cell is to be opened.
pub(super) fn options(cli: &Shared, script: Option<Source>) -> Result<Options, Failure> {
    let robot = match arm::at(&cli.cell.robot)? {
        // Who connects is nobody's business who reads a run folder.
        #[cfg(feature = "kortex")]
        ArmAt::Kortex(target) => target.to_string(),
        ArmAt::Bridge(target) => target.to_string(),
        ArmAt::Inside => cli.cell.robot.clone(),
    };
    let lab = match &cli.cell.lab {
        None => LabSettings::default(),
        Some(path) => LabSettings::from_toml(&read(path)?).map_err(|error| {
            Failure::input("lab::settings", error.to_string()).at(path.display().to_string())
        })?,
    };
    let scene = match &cli.cell.scene {
        None => None,
        Some(path) => Some(Source::new(path.display().to_string(), read(path)?)),
    };
    let switches = switches(&cli.cell.without_regression)?;
    Ok(Options {
        robot,
        scene,
        script,
        lab,
        stdlib: stdlib(cli)?,
        seed: cli.common.seed,
        switches,
        candidates: cli.cell.candidates,
        means: cli.cell.motion.into(),
        is_real_time: cli.cell.pace == Pace::Real,
        clock,
    })
}

/// Returns the arguments with the scene and the stdlib that a run was made with where none is named, as far as they are there.
pub(super) fn of_run(cli: &Shared, run: &Run) -> Shared {
    let mut cli = cli.clone();
    let Some(setting) = &run.setting else { return cli };
    let there = |named: &Option<String>, is_one: fn(&Path) -> bool| {
        named.as_ref().map(PathBuf::from).filter(|path| is_one(path))
    };
    let cell = &mut cli.cell;
    cell.scene = cell.scene.take().or_else(|| there(&setting.file, Path::is_file));
    cell.stdlib = cell.stdlib.take().or_else(|| there(&setting.stdlib, Path::is_dir));
    cli
}

/// Opens the cell the arguments ask for.
pub(super) fn open(
    cli: &Shared,
    script: Option<Source>,
    style: Style,
) -> Result<WorkCell, Failure> {
    let learnt = learn::learnt(cli)?;
    let options = options(cli, script)?;
    let mut may_be_real = false;
    let opened = match arm::at(&cli.cell.robot)? {
        ArmAt::Inside => WorkCell::open(options),
        #[cfg(feature = "kortex")]
        ArmAt::Kortex(target) => {
            may_be_real = true;
            let ready = kortex::Ready::new(target, &cli.cell, style)?;
            WorkCell::open_with(options, |robot, _, _| ready.connect(robot))
        }
        ArmAt::Bridge(target) => WorkCell::open_with(options, |robot, scene, _| {
            let devices = bridge::devices(&target, robot, scene, &cli.cell);
            let devices = devices.map_err(bridge::refused)?;
            may_be_real = devices.limits.is_some();
            Ok(devices)
        }),
    };
    let mut cell = opened.map_err(|error| report::cell_failure(&error, style))?;
    if may_be_real {
        consent::confirm(cell.robot_name(), &cli.cell)?;
    }
    cell.learn_from(learnt);
    if let Some(model) = model(cli)? {
        cell.answered_by(model);
    }
    Ok(cell)
}

/// Returns the model that answers questions beside geometry, if one is named.
pub(super) fn model(cli: &Shared) -> Result<Option<Endpoint>, Failure> {
    let CellArgs { ask_endpoint, ask_model, ask_timeout, .. } = &cli.cell;
    let Some(base) = ask_endpoint else { return Ok(None) };
    endpoint::at(base.clone(), ask_model.clone(), *ask_timeout, false).map(Some)
}

/// Returns the folder where the prompt keeps history and phrases, made if it is not there.
pub(super) fn home() -> Option<PathBuf> {
    let state = std::env::var_os("XDG_STATE_HOME")
        .map(PathBuf::from)
        .or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".local/state")))?;
    let dir = state.join("trueup");
    std::fs::create_dir_all(&dir).ok()?;
    Some(dir)
}
