//! `trueup lab hide` and `trueup lab reveal`: an effect under a seal, to be found by its traces.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use serde::Serialize;

use crate::files::write;
use crate::lab::{self, HiddenEffect, LabSettings};
use crate::report::{self, Failure, Style};
use crate::units::significant;
use crate::workcell;

use super::cell::stdlib;
use super::inputs::read;
use super::shared::Shared;
use crate::report::exit::Exit;

#[derive(Debug, Subcommand)]
pub(super) enum LabCommand {
    /// Draw an effect by `--seed`, seal it, and write a file for `--lab`.
    Hide(HideArgs),
    /// Open the seal of a file, and say whether the guess was right.
    Reveal(RevealArgs),
}

#[derive(Debug, Args)]
pub(super) struct HideArgs {
    /// The file to write.
    #[arg(long, short, value_name = "FILE", default_value = "hidden.toml")]
    out: PathBuf,
}

#[derive(Debug, Args)]
pub(super) struct RevealArgs {
    /// The file that `lab hide` wrote.
    file: PathBuf,
    /// What it is taken to be: `lip_dribble(jar)`.
    #[arg(long, value_name = "NAME(AT)")]
    guess: Option<String>,
}

/// `trueup lab ...`.
pub(super) fn lab(command: &LabCommand, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    match command {
        LabCommand::Hide(args) => hide(args, cli, style),
        LabCommand::Reveal(args) => reveal(args, style),
    }
}

#[derive(Serialize)]
struct Hidden {
    path: String,
    sealed: bool,
}

fn hide(args: &HideArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let library = workcell::library(&stdlib(cli)?);
    let scene =
        workcell::scene_of(&library, None).map_err(|error| report::cell_failure(&error, style))?;
    let settings = |error: lab::Error| Failure::input("lab::settings", error.to_string());
    let effect = lab::draw(&scene, cli.common.seed).map_err(settings)?;
    let mut with = match &cli.cell.lab {
        None => LabSettings::default(),
        Some(path) => LabSettings::from_toml(&read(path)?)
            .map_err(|error| settings(error).at(path.display().to_string()))?,
    };
    with.sealed =
        lab::seal(std::slice::from_ref(&effect), cli.common.seed.wrapping_mul(0x9E37_79B9));
    // What this command wrote may be replaced by it.
    let is_sealed =
        |text: &str| LabSettings::from_toml(text).is_ok_and(|settings| !settings.sealed.is_empty());
    if args.out.is_file() && !is_sealed(&read(&args.out)?) {
        return Err(Failure::there(&args.out));
    }
    let path = args.out.display().to_string();
    let text = match &cli.cell.lab {
        // Whoever reads the file sees what they changed, and the seal.
        None => format!(
            "# One effect is hidden here. `trueup lab reveal {path}` shows it.\nsealed = \"{}\"\n",
            with.sealed
        ),
        Some(_) => toml::to_string(&with)
            .map_err(|error| Failure::input("lab::settings", error.to_string()))?,
    };
    write::replace(&args.out, text).map_err(|error| Failure::unwritten(&args.out, &error))?;
    if style.json {
        style.document(&Hidden { path, sealed: true });
    } else {
        style.say(format!(
            "an effect is hidden in {path}\n  run it:   trueup run scripts/pour.task --lab {path}\n  \
             name it:  trueup gap RUN... --model FILE\n  check:    trueup lab reveal {path} --guess 'NAME(AT)'"
        ));
    }
    Ok(Exit::Yes)
}

#[derive(Serialize)]
struct Revealed<'a> {
    effects: &'a [HiddenEffect],
    #[serde(skip_serializing_if = "Option::is_none")]
    guess_is_right: Option<bool>,
}

fn reveal(args: &RevealArgs, style: Style) -> Result<Exit, Failure> {
    let path = args.file.display().to_string();
    let wrong = |error: lab::Error| {
        Failure::input("lab::settings", error.to_string())
            .at(&path)
            .help("name the file that `trueup lab hide` wrote")
    };
    let settings = LabSettings::from_toml(&read(&args.file)?).map_err(wrong)?;
    let mut effects = settings.effects.clone();
    if !settings.sealed.is_empty() {
        effects.extend(lab::unseal(&settings.sealed).map_err(wrong)?);
    }
    if effects.is_empty() {
        return Err(Failure::input("lab::nothing_hidden", "nothing is hidden in this file")
            .at(&path)
            .help("`trueup lab hide` hides something"));
    }
    let name = |effect: &HiddenEffect| format!("{}({})", effect.name, effect.at);
    let plain = |text: &str| text.split_whitespace().collect::<String>();
    let right = args
        .guess
        .as_ref()
        .map(|guess| effects.iter().any(|effect| plain(&name(effect)) == plain(guess)));
    if style.json {
        style.document(&Revealed { effects: &effects, guess_is_right: right });
    } else {
        for effect in &effects {
            style.say(format!("{}  {}", name(effect), numbers(&effect.numbers)));
        }
        match (right, &args.guess) {
            (Some(true), _) => style.say("the guess is right"),
            (Some(false), Some(guess)) => style.say(format!("`{guess}` is not what was hidden")),
            _ => {}
        }
    }
    Ok(if right == Some(false) { Exit::No } else { Exit::Yes })
}

/// Words numbers in SI units as people write them.
fn numbers(numbers: &BTreeMap<String, f64>) -> String {
    let word = |(name, value): (&String, &f64)| match name.as_str() {
        "volume" | "level" => format!("{name} = {} mL", significant(value * 1e6, 3)),
        "delay" => format!("{name} = {} s", significant(*value, 3)),
        "mass" => format!("{name} = {} kg", significant(*value, 3)),
        "viscosity" => format!("{name} = {} Pa*s", significant(*value, 3)),
        "rate" => format!("{name} = {} mm/s", significant(*value * 1e3, 3)),
        "dx" | "dy" | "dz" => format!("{name} = {} mm", significant(*value * 1e3, 3)),
        "torque" => format!("{name} = {} N*m", significant(*value, 3)),
        "coefficient" => format!("{name} = {} N*m*s/rad", significant(*value, 3)),
        "compliance" => format!("{name} = {} rad/(N*m)", significant(*value, 3)),
        _ => format!("{name} = {}", significant(*value, 3)),
    };
    numbers.iter().map(word).collect::<Vec<_>>().join(", ")
}
