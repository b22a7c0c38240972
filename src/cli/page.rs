//! `trueup teach --page`: stored runs and a run that is stepped now, in a browser on this machine.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use crate::arm::Cancel;
use crate::http::encoded;
use crate::language::ast::Step;
use crate::language::{self, Library, Source};
use crate::page::{self, Live, Page, Place};
use crate::report::{self, Failure, Style, kept, run::Console};
use crate::trace::Observer;
use crate::workcell::record::Recorder;
use crate::workcell::{self, Fan, Run, WorkCell, archive};

use super::cell::{open, stdlib};
use super::clock::stamp;
use super::inputs::{read, steps};
use super::shared::Shared;
use super::signals::{self, stop_on_interrupt};
use crate::report::exit::Exit;
use crate::report::exit::ended;

/// How often a wish to end is looked for, ms.
const LOOK: u64 = 50;

/// Where the page is and where it keeps answers.
pub(super) struct Where {
    /// 0 takes any port that is free.
    pub(super) port: u16,
    /// The file answers are added to.
    pub(super) answers: PathBuf,
    /// The folder of runs.
    pub(super) root: PathBuf,
}

/// Serves stored runs, and the call or the script that is stepped, if there is one.
pub(super) fn teach(what: &str, at: Where, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    if what.is_empty() {
        return stored("", at, cli, style);
    }
    let Ok(dir) = kept::folder(&cli.cell.record, Path::new(what)) else {
        return live(what, at, cli, style);
    };
    archive::load(&dir).map_err(|error| report::cell_failure(&error, style))?;
    let dir = std::path::absolute(&dir).unwrap_or(dir);
    let name = dir.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    // A run that lies elsewhere is shown among those beside it.
    let root = dir.parent().map_or_else(|| cli.cell.record.clone(), Path::to_path_buf);
    stored(&format!("run/{}/1/before", encoded(name)), Where { root, ..at }, cli, style)
}

/// Serves stored runs until Ctrl-C; no arm is asked for.
fn stored(path: &str, at: Where, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let library = workcell::library(&stdlib(cli)?);
    let end = Cancel::default();
    signals::stop(end.clone())?;
    let _page = serve(at, library, None, path, cli, style)?;
    wait(&end);
    Ok(Exit::Yes)
}

/// Carries out a call or a script, stepped from the page, and serves it afterwards until Ctrl-C.
fn live(what: &str, at: Where, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let path = Path::new(what);
    let is_file = path.is_file();
    let source =
        if is_file { Source::new(what, read(path)?) } else { Source::new("command line", what) };
    let steps = steps(&source, is_file, style)?;
    let mut cell = open(cli, is_file.then(|| source.clone()), style)?;
    for step in &steps {
        let wrong = cell.check_line(step, &source);
        if wrong.iter().any(language::Diagnostic::is_error) {
            return Err(report::text_failure(&wrong, &source, style));
        }
    }
    stop_on_interrupt(&cell)?;
    let cancel = cell.cancel();
    let live = Arc::new(Live::new(source.text.trim().to_owned(), cancel.clone(), cell.dial()));
    let _page = serve(at, cell.library().clone(), Some(live.clone()), "live", cli, style)?;
    let run = perform(&mut cell, &steps, &source, &live, cli, style);
    let exit = match &run {
        Ok(run) => {
            live.ended(&report::run::ending(run, Style::plain()));
            style.say(report::run::ending(run, style));
            if style.json {
                style.document(run);
            }
            ended(run)
        }
        Err(failure) => {
            let help = failure.help.as_ref().map_or(String::new(), |help| format!("\n{help}"));
            live.ended(&format!("{}{help}", failure.message));
            style.failure(failure);
            Exit::No
        }
    };
    wait_then(&cancel, style, run.map(|_| exit))
}

fn wait_then(cancel: &Cancel, style: Style, exit: Result<Exit, Failure>) -> Result<Exit, Failure> {
    if !signals::LEAVE.is_asked() {
        style.note("the page stays until Ctrl-C");
        cancel.clear();
        signals::forget();
        wait(cancel);
    }
    // It was told when it happened.
    exit.map_err(|mut failure| {
        failure.is_shown = true;
        failure
    })
}

fn serve(
    at: Where,
    library: Library,
    live: Option<Arc<Live>>,
    path: &str,
    cli: &Shared,
    style: Style,
) -> Result<Page, Failure> {
    let place: Place = Box::new(move |name| {
        let (fluent, source) = library.fluent(name)?;
        Some(source.place(fluent.name.span))
    });
    let Where { port, answers, root } = at;
    let options = page::Options { root, answers, port, seed: cli.common.seed, place };
    let page = Page::open(options, live).map_err(|error| {
        Failure::unavailable("page::port", format!("cannot listen on port {port}: {error}"))
            .help("leave `--port` out, and any port that is free is taken")
    })?;
    let address = format!("{}{path}", page.address());
    if style.json {
        report::out(&serde_json::json!({ "page": address }).to_string());
    } else {
        report::out(&format!("the page is at {address} on this machine only; Ctrl-C ends it"));
    }
    Ok(page)
}

fn perform(
    cell: &mut WorkCell,
    steps: &[Step],
    source: &Source,
    live: &Arc<Live>,
    cli: &Shared,
    style: Style,
) -> Result<Run, Failure> {
    let call = &cell.define(source, steps);
    cell.graph(call).map_err(|error| report::cell_failure(&error, style))?;
    let made = Recorder::create(&cli.cell.record, &stamp(), &call.name.text);
    let recorder =
        made.map_err(|(path, error)| Failure::no_run_folder(&path, &error, "--record"))?;
    cell.led_by(Box::new(page::Lead::new(live.clone())));
    // What a step came to is told on the page, once its questions are answered.
    let console: Box<dyn Observer + Send> = Box::new(Console::new(style).without_steps());
    let watchers = Fan(vec![console, Box::new(page::Watch(live.clone()))]);
    let run = cell.run(call, Some(recorder), Box::new(watchers));
    run.map_err(|error| report::cell_failure(&error, style))
}

fn wait(end: &Cancel) {
    while !end.is_cancelled() {
        thread::sleep(Duration::from_millis(LOOK));
    }
}
