//! The command line: the same verbs as the prompt, as subcommands.
//!
//! This file holds the arguments and the exit codes of `INTERFACES`; what a command does is in the
//! module of its name, how it is worded in [`crate::report`].

pub mod answer;
mod align;
mod camera;
mod cell;
mod clock;
mod completions;
#[cfg(feature = "kortex")]
mod supervisor;
mod doc;
mod doctor;
#[cfg(feature = "kortex")]
mod emulate;
mod endpoint;
mod explain;
mod export;
mod gap;
mod graph;
mod guide;
mod inputs;
mod arm;
mod bridge;
mod consent;
#[cfg(feature = "kortex")]
mod kortex;
mod lab;
mod learn;
#[cfg(feature = "lsp")]
mod lsp;
mod marks;
mod meant;
mod new;
mod numbers;
mod offered;
#[cfg(feature = "page")]
mod page;
mod paper;
mod question;
mod replay;
mod report;
mod robot;
mod run;
mod runs;
mod say;
mod scene;
mod shared;
mod signals;
mod teach;
mod test;
mod text;
mod topics;
mod trials;
mod vqa;
#[cfg(feature = "page")]
mod watch;

use std::io::IsTerminal as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;

use clap::{FromArgMatches as _, Parser, Subcommand};

use crate::report::{Failure, Style, panics, unwritten_answer};

pub use crate::report::exit::Exit;
use shared::Shared;

/// Script a robot arm against a digital twin that tells the truth.
#[derive(Debug, Parser)]
#[command(name = "trueup", version, about, disable_help_subcommand = true)]
struct Cli {
    #[command(flatten)]
    shared: Shared,
    /// Evaluate one line, such as `pour(jar, cup)`, and exit.
    #[arg(short = 'c', value_name = "LINE")]
    line: Option<String>,
    /// Show runs of the line, or of the prompt, on a page of this machine while they go on.
    #[cfg(feature = "page")]
    #[arg(long)]
    live: bool,
    #[command(subcommand)]
    command: Option<Command>,
}

impl Cli {
    /// Whether runs are shown on a page.
    fn is_live(&self) -> bool {
        #[cfg(feature = "page")]
        return self.live;
        #[cfg(not(feature = "page"))]
        return false;
    }
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run a saved script; a run folder is written.
    Run(run::RunArgs),
    /// Write a file to begin with: a scene or a task.
    New(new::NewArgs),
    /// Find mistakes in task files.
    Check(text::CheckArgs),
    /// Lay task files out in the one canonical way.
    Fmt(text::FmtArgs),
    /// Carry out the examples in task files, in the twin.
    Test(test::TestArgs),
    /// Say what a name means.
    Doc(doc::DocArgs),
    /// Say what the code of a mistake means.
    Explain(explain::ExplainArgs),
    /// Serve an editor over stdin and stdout.
    #[cfg(feature = "lsp")]
    Lsp,
    /// Learn from stored runs which branches work.
    Learn(learn::LearnArgs),
    /// Draw the And-Or graph of a task.
    Graph(graph::GraphArgs),
    /// Say which call a sentence means.
    Say(say::SayArgs),
    /// Runs that are kept: list, show, diff, export.
    Runs(runs::RunsArgs),
    /// Tell a recorded run again, without an arm.
    Replay(replay::ReplayArgs),
    /// Carry out a call or a script one step at a time, or look at a run.
    Teach(teach::TeachArgs),
    /// Write a run folder as one HTML page.
    Report(report::ReportArgs),
    /// Write a run as a film, or as MCAP, RRD or CSV for other programs.
    Export(export::ExportArgs),
    /// Kinematics, dynamics and planning of a robot.
    #[command(subcommand)]
    Robot(robot::RobotCommand),
    /// Find objects in a picture.
    #[command(subcommand)]
    Camera(camera::CameraCommand),
    /// Scenes from photographs.
    #[command(subcommand)]
    Scene(scene::SceneCommand),
    /// Write the dots of a scene as a page to print, in true size.
    Marks(marks::MarksArgs),
    /// The three regressions on files; where a camera sits.
    #[command(subcommand)]
    Align(align::AlignCommand),
    /// Play a Gen3's controller, with the lab's arm inside.
    #[cfg(feature = "kortex")]
    Emulate(emulate::EmulateArgs),
    /// Look after a Gen3 beside whoever commands it.
    #[command(subcommand)]
    #[cfg(feature = "kortex")]
    Kortex(supervisor::KortexCommand),
    /// Find what a model lacks, from recordings.
    Gap(gap::GapArgs),
    /// Carry out a task in many laboratories, and count.
    Trials(trials::TrialsArgs),
    /// The paper's tables, made anew beside the paper's own numbers.
    #[command(subcommand)]
    Paper(paper::PaperCommand),
    /// Ask a vision-language model about runs, and score the answers.
    #[command(subcommand)]
    Vqa(vqa::VqaCommand),
    /// Hide an effect in the laboratory, and reveal it.
    #[command(subcommand)]
    Lab(lab::LabCommand),
    /// Tell how something is done, with examples: `trueup help gap`.
    Help(guide::HelpArgs),
    /// Say what is in order: texts, run folder, arm, camera, model.
    Doctor,
    /// Write a script that completes commands in a shell.
    Completions(completions::CompletionsArgs),
}

/// Runs the program with the arguments of the process and returns its exit code.
pub fn main() -> ExitCode {
    panics::listen();
    signals::outlive_limits();
    let command = guide::command();
    let parsed = command.clone().try_get_matches();
    let read = parsed.and_then(|matches| Ok((Cli::from_arg_matches(&matches)?, matches)));
    let (cli, matches) = match read {
        Ok(read) => read,
        Err(error) => {
            let mut words = std::env::args_os().skip(1).map(|w| w.to_string_lossy().into_owned());
            let first = words.find(|word| !word.starts_with('-'));
            let error = meant::suggested(error, first.as_deref());
            // Help and version go to stdout with code 0; everything else is bad usage.
            let code = if error.use_stderr() { Exit::BadInput } else { Exit::Yes };
            if error.use_stderr() && std::env::args_os().any(|argument| argument == "--json") {
                Style::detect(true, true, false).failure(&usage(&error));
            } else if error.use_stderr() {
                // It quotes the arguments, which may be names of files that somebody else chose.
                let is_coloured = std::io::stderr().is_terminal() && !Style::is_plain();
                let styled = error.render();
                crate::report::complain(
                    if is_coloured { styled.ansi().to_string() } else { styled.to_string() }
                        .trim_end(),
                );
            } else {
                let _ = error.print();
            }
            return ExitCode::from(code as u8);
        }
    };
    let common = &cli.shared.common;
    let style = Style::detect(common.json, common.quiet, common.verbose);
    // Of a robot that does not exist is told what is wrong with it, and not also that it is not used.
    if arm::at(&cli.shared.cell.robot).is_ok() {
        for note in offered::without_effect(&command, &matches) {
            style.note(&note);
        }
    }
    let outcome = catch_unwind(AssertUnwindSafe(|| dispatch(&cli, style)));
    let outcome =
        outcome.unwrap_or_else(|panic| Err(panics::caught(panic.as_ref(), signals::has_arm())));
    let told = match outcome {
        Ok(exit) => exit as u8,
        Err(failure) => {
            style.failure(&failure);
            failure.exit()
        }
    };
    // A thread by itself may have failed beside all that, or the answer may be lost, so this is said beside it.
    let beside = [panics::uncaught(), unwritten_answer()].into_iter().flatten();
    ExitCode::from(beside.fold(told, |told, failure| {
        Style { json: false, ..style }.failure(&failure);
        failure.exit().max(told)
    }))
}

/// Words bad usage for a program: the first paragraph says what, the rest what would help.
fn usage(error: &clap::Error) -> Failure {
    let text = error.render().to_string();
    let (what, help) = text.split_once("\n\n").unwrap_or((&text, ""));
    let joined = |text: &str, by: &str| {
        let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
        lines.collect::<Vec<_>>().join(by)
    };
    let what = joined(what, " ");
    Failure::input("usage", what.strip_prefix("error: ").unwrap_or(&what)).help(joined(help, "; "))
}

fn dispatch(cli: &Cli, style: Style) -> Result<Exit, Failure> {
    let shared = &cli.shared;
    if cli.is_live() && cli.command.is_some() {
        return Err(Failure::input("usage", "`--live` before a command shows nothing")
            .help("give it to the prompt, to `-c LINE`, or after `run FILE`"));
    }
    // A robot that does not exist is wrong whether or not the command would use it.
    let robot = &shared.cell.robot;
    arm::at(robot).map_err(|failure| match &cli.command {
        Some(Command::Gap(_)) => arm::of_recordings(robot, failure),
        _ => failure,
    })?;
    match (&cli.command, &cli.line) {
        (Some(Command::Run(args)), _) => run::script(args, shared, style),
        (Some(Command::New(args)), _) => new::new(args, style),
        (Some(Command::Marks(args)), _) => marks::marks(args, shared, style),
        (Some(Command::Check(args)), _) => text::check(args, shared, style),
        (Some(Command::Fmt(args)), _) => text::fmt(args, style),
        #[cfg(feature = "lsp")]
        (Some(Command::Lsp), _) => lsp::serve(shared),
        (Some(Command::Learn(args)), _) => learn::learn(args, shared, style),
        (Some(Command::Replay(args)), _) => replay::replay(args, shared, style),
        (Some(Command::Teach(args)), _) => teach::teach(args, shared, style),
        (Some(Command::Report(args)), _) => report::report(args, shared, style),
        (Some(Command::Export(args)), _) => export::export(args, shared, style),
        (Some(Command::Say(args)), _) => say::say(args, shared, style),
        (Some(Command::Test(args)), _) => test::test(args, shared, style),
        (Some(Command::Doc(args)), _) => doc::doc(args, shared, style),
        (Some(Command::Runs(args)), _) => runs::runs(args, shared, style),
        (Some(Command::Help(args)), _) => guide::help(args, style),
        (Some(Command::Doctor), _) => doctor::doctor(shared, style),
        (Some(Command::Completions(args)), _) => Ok(completions::completions(args, style)),
        (Some(Command::Explain(args)), _) => explain::explain(args, style),
        (Some(Command::Graph(args)), _) => graph::graph(args, shared, style),
        (Some(Command::Robot(command)), _) => robot::robot(command, shared, style),
        (Some(Command::Camera(command)), _) => {
            camera::camera(command, shared.cell.scene.as_ref(), style)
        }
        (Some(Command::Scene(command)), _) => {
            scene::scene(command, shared.cell.scene.as_ref(), style)
        }
        (Some(Command::Align(command)), _) => {
            align::align(command, shared.cell.scene.as_ref(), style)
        }
        #[cfg(feature = "kortex")]
        (Some(Command::Emulate(args)), _) => emulate::emulate(args, shared, style),
        #[cfg(feature = "kortex")]
        (Some(Command::Kortex(command)), _) => supervisor::kortex(command, style),
        (Some(Command::Gap(args)), _) => gap::gap(args, shared, style),
        (Some(Command::Trials(args)), _) => trials::trials(args, shared, style),
        (Some(Command::Paper(command)), _) => paper::paper(command, shared, style),
        (Some(Command::Vqa(command)), _) => vqa::vqa(command, shared, style),
        (Some(Command::Lab(command)), _) => lab::lab(command, shared, style),
        (None, Some(line)) => run::line(line, cli.is_live(), shared, style),
        (None, None) if style.json => Err(Failure::input("usage", "the prompt has no JSON form")
            .help("give a command, or a line with `-c`")),
        (None, None) => run::prompt(cli.is_live(), shared, style),
    }
}
