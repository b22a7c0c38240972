//! `trueup graph`: the And-Or graph of a call, a script or a file of the exchange format, in all its forms.

use std::path::Path;

use clap::{Args, ValueEnum};

use crate::graph::{self, Graph, InScene, exchange};
use crate::language::ast::{Item, Program, Span, Step};
use crate::language::library::DEFAULT_SCENE;
use crate::language::{self, Diagnostic, Library, Source, text};
use crate::report::{self, Failure, Style};
use crate::workcell::{self, check};

use super::cell::stdlib;
use super::inputs::read;
use super::shared::Shared;
use crate::report::exit::Exit;

/// Draw the And-Or graph of a task.
#[derive(Debug, Args)]
pub(super) struct GraphArgs {
    /// A call such as `pour(jar, cup)`, a script that makes one, or a graph as `--format json` writes it.
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
    /// A text of the language that has this graph.
    Task,
    /// A probabilistic grammar of its actions.
    Pcfg,
}

/// A graph, and what of its text it does not hold.
struct Drawn {
    graph: Graph,
    /// Types, scenes, imports, and fluents that only other fluents speak of.
    beside: Vec<String>,
}

/// `trueup graph FILE|'CALL'|GRAPH.json`.
pub(super) fn graph(args: &GraphArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let path = Path::new(&args.what);
    let is = |ending: &str| path.extension().is_some_and(|its| its == ending);
    let drawn =
        if is("json") { from_file(path)? } else { from_text(&args.what, is("task"), cli, style)? };
    let Drawn { graph, beside } = drawn;
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
        Format::Dot if !style.json => report::out(&exchange::to_dot(&graph)),
        Format::Pcfg if !style.json => report::out(exchange::to_pcfg(&graph).trim_end()),
        Format::Task if !style.json => {
            let written = exchange::to_task(&graph).map_err(|error| {
                Failure::no("graph::text", error.to_string())
                    .at(args.what.clone())
                    .help("`--format json` holds all of it")
            })?;
            let (program, _) = language::parse(&written);
            let parts: Vec<String> =
                beside.into_iter().filter(|part| is_new(part, &program)).collect();
            let parts = parts.into_iter().chain([written]);
            report::out(parts.collect::<Vec<_>>().join("\n").trim_end());
        }
        _ => style.document(&exchange::to_json(&graph, &exchange::Learnt { outcomes, priors })),
    }
    Ok(Exit::Yes)
}

/// Whether a text does not define again what is defined.
fn is_new(part: &str, program: &Program) -> bool {
    let (part, _) = language::parse(part);
    let Some(Item::Fluent(fluent)) = part.items.first() else { return true };
    let known =
        |item: &Item| matches!(item, Item::Fluent(other) if other.name.text == fluent.name.text);
    !program.items.iter().any(known)
}

/// Reads a graph of the exchange format.
fn from_file(path: &Path) -> Result<Drawn, Failure> {
    let place = path.display().to_string();
    let wrong = |why: String| {
        Failure::input("graph::file", why)
            .at(place.clone())
            .help("`trueup graph CALL --format json` writes such a file")
    };
    let value = serde_json::from_str(&read(path)?)
        .map_err(|error| wrong(format!("this is no JSON: {error}")))?;
    let graph = exchange::from_json(&value).map_err(|error| wrong(error.to_string()))?;
    Ok(Drawn { graph, beside: Vec::new() })
}

/// Builds the graph of a call or of the first call of a script.
fn from_text(what: &str, is_file: bool, cli: &Shared, style: Style) -> Result<Drawn, Failure> {
    let stdlib = stdlib(cli)?;
    let mut library = workcell::library(&stdlib);
    let named = match &cli.cell.scene {
        None => None,
        Some(path) => {
            let source = Source::new(path.display().to_string(), read(path)?);
            let added = workcell::add_scene(&mut library, &stdlib, source);
            Some(added.map_err(|error| report::cell_failure(&error, style))?)
        }
    };
    let scene_in = |library: &Library, file: Option<usize>| {
        workcell::scene_name(library, file).unwrap_or(DEFAULT_SCENE).to_owned()
    };
    let (source, program, scene, wrong) = if is_file {
        let source = Source::new(what, read(Path::new(what))?);
        let (program, _) = language::parse(&source.text);
        let file = library.add_with(source.clone(), &|path| stdlib.read(path));
        let scene = scene_in(&library, named.or(Some(file)));
        let wrong = check::check_file(&library, &stdlib, file, &library.scope(&scene));
        (source, program, scene, wrong)
    } else {
        let source = Source::new("command line", what);
        let (step, mut wrong) = language::parse_line(what);
        let scene = scene_in(&library, named);
        if let Some(step) = step.as_ref().filter(|_| wrong.is_empty()) {
            let scope = library.scope(&scene);
            wrong = check::check_step(step, &source, &library, &stdlib, &scope);
        }
        let items = step.map(Item::Run).into_iter().collect();
        (source, Program { items }, scene, wrong)
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
    let graph = graph::build(&InScene { library: &library, scene: &scene }, &call)
        .map_err(|problems| report::problems_failure(&problems, &library, &source))?;
    let beside = if is_file { beside(&program, &source, &library) } else { Vec::new() };
    Ok(Drawn { graph, beside })
}

/// What a file defines that no graph holds.
fn beside(program: &Program, source: &Source, library: &Library) -> Vec<String> {
    let slice = |span: Span| source.text.get(span.from..span.to).map(language::format);
    let parts = program.items.iter().filter_map(|item| match item {
        Item::Import(import) => slice(import.span),
        Item::Scene(scene) => slice(scene.span),
        Item::Type(ty) => Some(text::object_type(ty)),
        Item::Fluent(fluent) if library.fluent(&fluent.name.text).is_some() => {
            Some(text::fluent(fluent))
        }
        _ => None,
    });
    parts.collect()
}

/// The steps at the top level of a text.
fn runs(program: &Program) -> Vec<Step> {
    let steps = program.items.iter().filter_map(|item| match item {
        Item::Run(step) => Some(step.clone()),
        _ => None,
    });
    steps.collect()
}
