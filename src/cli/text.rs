//! `trueup check`, `trueup fmt` and `trueup graph`: texts without a robot.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::json;

use crate::graph;
use crate::language::ast::{Item, Program, Step};
use crate::language::{self, Diagnostic, Source};
use crate::report::{self, Failure, Style};
use crate::workcell::{check, library};

use super::run::{read, stdlib};
use super::{Cli, Exit};

/// Find mistakes in task files.
#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    /// Files, or folders with `.task` files.
    #[arg(required = true)]
    files: Vec<PathBuf>,
}

/// Lay task files out in the one canonical way.
#[derive(Debug, Args)]
pub(super) struct FmtArgs {
    /// Change nothing; say which files would change, with exit code 1 when there are any.
    #[arg(long)]
    check: bool,
    /// Files, or folders with `.task` files.
    #[arg(required = true)]
    files: Vec<PathBuf>,
}

/// Draw the And-Or graph of a task.
#[derive(Debug, Args)]
pub(super) struct GraphArgs {
    /// A call such as `pour(jar, cup)`, or a script that makes one.
    what: String,
    /// How.
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// A tree in the terminal.
    Text,
    /// A drawing.
    Svg,
    /// Graphviz.
    Dot,
    /// The exchange format.
    Json,
}

/// Returns the task files that paths name, folders searched to the bottom, in order of name.
fn task_files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut found = Vec::new();
    for path in paths {
        if !path.is_dir() {
            found.push(path.clone());
            continue;
        }
        let before = found.len();
        let mut open = vec![path.clone()];
        while let Some(dir) = open.pop() {
            let entries = std::fs::read_dir(&dir).map_err(|error| {
                Failure::input("io::read", format!("cannot read {}: {error}", dir.display()))
            })?;
            for entry in entries.flatten() {
                let path = entry.path();
                if path.is_dir() {
                    open.push(path);
                } else if path.extension().is_some_and(|ending| ending == "task") {
                    found.push(path);
                }
            }
        }
        if found.len() == before {
            let place = path.display().to_string();
            return Err(
                Failure::input("io::empty", "there are no `.task` files in the folder").at(place)
            );
        }
    }
    found.sort();
    Ok(found)
}

/// `trueup check FILE...`: each file by itself over the stdlib.
pub(super) fn check(args: &CheckArgs, cli: &Cli, style: Style) -> Result<Exit, Failure> {
    let stdlib = stdlib(cli)?;
    let files = task_files(&args.files)?.into_iter();
    let sources = files.map(|path| Ok(Source::new(path.display().to_string(), read(&path)?)));
    let all = check::check_all(&stdlib, sources.collect::<Result<_, Failure>>()?);
    let errors = all.iter().filter(|(diagnostic, _)| diagnostic.is_error()).count();
    if style.json {
        let list: Vec<_> = all.iter().map(|(d, source)| d.to_json(source)).collect();
        style.document(&json!({ "diagnostics": list }));
    } else {
        for (diagnostic, source) in &all {
            style.say(report::diagnostic(diagnostic, source, style));
        }
        if all.is_empty() {
            style.say(style.green("no mistakes found"));
        }
    }
    Ok(if errors > 0 { Exit::No } else { Exit::Yes })
}

/// `trueup fmt FILE...`.
pub(super) fn fmt(args: &FmtArgs, style: Style) -> Result<Exit, Failure> {
    let mut changed = Vec::new();
    for path in task_files(&args.files)? {
        let text = read(&path)?;
        let name = path.display().to_string();
        let (_, diagnostics) = language::parse(&text);
        if diagnostics.iter().any(Diagnostic::is_error) {
            let source = Source::new(name, text);
            return Err(report::text_failure(&diagnostics, &source, style));
        }
        let formatted = language::format(&text);
        if formatted == text {
            continue;
        }
        changed.push((name, path, formatted));
    }
    // Nothing is written before everything has been read.
    for (name, path, formatted) in changed.iter().filter(|_| !args.check) {
        std::fs::write(path, formatted).map_err(|error| {
            Failure::input("io::write", format!("cannot write {name}: {error}")).at(name)
        })?;
    }
    let changed: Vec<String> = changed.into_iter().map(|(name, ..)| name).collect();
    if style.json {
        style.document(&json!({ "changed": changed }));
    } else {
        let verb = if args.check { "would change" } else { "formatted" };
        for name in &changed {
            style.say(format!("{verb}: {name}"));
        }
    }
    Ok(if args.check && !changed.is_empty() { Exit::No } else { Exit::Yes })
}

/// `trueup graph FILE|'CALL'`.
pub(super) fn graph(args: &GraphArgs, cli: &Cli, style: Style) -> Result<Exit, Failure> {
    let stdlib = stdlib(cli)?;
    let mut library = library(&stdlib);
    let is_file = Path::new(&args.what).extension().is_some_and(|ending| ending == "task");
    let own = match &cli.cell.scene {
        None => None,
        Some(path) => {
            let file = library.add(Source::new(path.display().to_string(), read(path)?));
            library.program(file).and_then(first_scene)
        }
    };
    let own = own.as_deref().unwrap_or("kitchen");
    let (source, program, wrong) = if is_file {
        let source = Source::new(args.what.clone(), read(Path::new(&args.what))?);
        let (program, _) = language::parse(&source.text);
        let file = library.add_with(source.clone(), &|path| stdlib.read(path));
        let scope = library.scope(first_scene(&program).as_deref().unwrap_or(own));
        let wrong = library.check_file(file, &scope);
        (source, program, wrong)
    } else {
        let source = Source::new("command line", args.what.clone());
        let (step, mut wrong) = language::parse_line(&args.what);
        if let Some(step) = step.as_ref().filter(|_| wrong.is_empty()) {
            wrong = library.check_step(step, &source, &library.scope(own));
        }
        (source, Program { items: step.map(Item::Run).into_iter().collect() }, wrong)
    };
    if wrong.iter().any(Diagnostic::is_error) {
        return Err(report::text_failure(&wrong, &source, style));
    }
    let steps = runs(&program);
    // Of several calls the first is drawn; steps that belong together are drawn together.
    let drawn = match steps.as_slice() {
        [] => {
            return Err(Failure::input("script::empty", "there is no call to draw")
                .at(source.name.clone())
                .help("name a call such as `pour(jar, cup)`"));
        }
        [Step::Act(_), ..] => &steps[..1],
        all => all,
    };
    let call = library.define(&source, drawn);
    let graph = graph::build(&library, &call)
        .map_err(|problems| report::problems_failure(&problems, &library, &source))?;
    let learnt = super::learn::learnt(cli)?;
    let outcomes = (!learnt.outcomes.is_empty()).then_some(&learnt.outcomes);
    let counted = outcomes.map(|outcomes| (outcomes, learnt.domain.as_str()));
    let priors = learnt.priors.as_ref();
    match args.format {
        Format::Text if !style.json => {
            let learnt = graph::outline::Learnt { outcomes: counted, priors, ..Default::default() };
            report::out(graph::outline::outline(&graph, &learnt).trim_end());
        }
        Format::Svg if !style.json => {
            let drawing = graph::draw::Drawing { outcomes: counted, priors, parse: None };
            report::out(&graph::draw::to_svg(&graph, &drawing));
        }
        Format::Dot if !style.json => report::out(&graph::exchange::to_dot(&graph)),
        _ => {
            let learnt = graph::exchange::Learnt { outcomes, priors };
            style.document(&graph::exchange::to_json(&graph, &learnt));
        }
    }
    Ok(Exit::Yes)
}

fn first_scene(program: &Program) -> Option<String> {
    program.items.iter().find_map(|item| match item {
        Item::Scene(scene) => Some(scene.name.text.clone()),
        _ => None,
    })
}

/// The steps at the top level of a text.
fn runs(program: &Program) -> Vec<Step> {
    let steps = program.items.iter().filter_map(|item| match item {
        Item::Run(step) => Some(step.clone()),
        _ => None,
    });
    steps.collect()
}
