//! `--live`: a page on this machine that shows a run while it goes on, and ends with it.

use std::path::Path;
use std::sync::Arc;

use crate::files::write;
use crate::page::{Onlooker, Options, Page, Screen};
use crate::report::{self, Failure, Style};
use crate::teach::answers;
use crate::trace::Observer;
use crate::workcell::{Run, WorkCell};

use super::report::whole;
use super::run::Until;
use super::shared::Shared;

/// The file of the report in a run folder.
const REPORT: &str = "report.html";

/// A page that runs are shown on.
pub(super) struct Window {
    screen: Arc<Screen>,
    /// Served until the window is dropped.
    _page: Page,
}

impl Window {
    /// Opens a page for the runs of a cell and says where it is.
    pub(super) fn open(
        cell: &mut WorkCell,
        cli: &Shared,
        until: Until,
        style: Style,
    ) -> Result<Self, Failure> {
        let screen = Arc::new(match until {
            Until::RunIsOver => Screen::default(),
            Until::PromptIsLeft => Screen::of_prompt(),
        });
        let library = cell.library().clone();
        let options = Options {
            root: cli.cell.record.clone(),
            answers: cli.cell.record.join(answers::FILE),
            port: 0,
            seed: cli.common.seed,
            place: Box::new(move |name| {
                let (fluent, source) = library.fluent(name)?;
                Some(source.place(fluent.name.span))
            }),
        };
        let page = Page::watch(options, screen.clone()).map_err(|error| {
            Failure::unavailable("page::port", format!("cannot listen on this machine: {error}"))
                .help("run without `--live`; `trueup report RUN` shows the run afterwards")
        })?;
        cell.show_rehearsals();
        let until = match until {
            Until::RunIsOver => "until the run is over",
            Until::PromptIsLeft => "while the prompt is open",
        };
        style.note(&format!("live: {}watch on this machine only, {until}", page.address()));
        Ok(Self { screen, _page: page })
    }

    /// Returns who watches a run of a task for the page.
    pub(super) fn onlooker(&self, task: &str) -> Box<dyn Observer + Send> {
        self.screen.begin(task);
        Box::new(Onlooker(self.screen.clone()))
    }

    /// Shows how a run ended, with the report on it, which is written into its folder.
    pub(super) fn ended(&self, run: &Result<Run, Failure>, style: Style) {
        match run {
            Ok(run) => {
                let report = run.run_dir.as_deref().map(|dir| Path::new(dir).join(REPORT));
                let written = report.filter(|path| {
                    let dir = path.parent().unwrap_or(Path::new("."));
                    write::replace(path, whole(dir, run)).is_ok()
                });
                if let Some(path) = &written {
                    style.note(&format!("report: {}", path.display()));
                }
                self.screen.ended(&report::run::ending(run, Style::plain()), written);
            }
            Err(failure) => self.screen.ended(&failure.message, None),
        }
    }
}

impl Drop for Window {
    /// A browser that looks is given the end.
    fn drop(&mut self) {
        self.screen.part();
    }
}
