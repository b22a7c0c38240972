//! Trials in words: a bar while they go on, the table of what they came to.

use indicatif::{ProgressBar, ProgressStyle};

use crate::trace::{Event, Observer};
use crate::workcell::trials::{Row, Share, Spread, Trial};

use super::grid::{Form, Grid};
use super::{Style, complain, shown};

/// Tells on stderr how far trials have come: a bar on a terminal, a line a trial elsewhere.
pub struct Progress {
    style: Style,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// Begins at `done` of `all`.
    pub fn new(done: usize, all: usize, style: Style) -> Self {
        let bar = (style.bars && !style.quiet).then(|| {
            let look = ProgressStyle::with_template("{bar:24} {pos} of {len}  {msg}  {elapsed}");
            let bar = ProgressBar::new(all as u64).with_position(done as u64);
            bar.with_style(look.unwrap_or_else(|_| ProgressStyle::default_bar()))
        });
        Self { style, bar }
    }

    /// Returns someone who tells what goes on inside a trial.
    pub fn watch(&self, what: &str) -> Watch {
        if let Some(bar) = &self.bar {
            bar.set_message(shown(what));
        }
        Watch { bar: self.bar.clone(), what: what.to_owned() }
    }

    /// Tells that a trial is over.
    pub fn over(&self, number: usize, of: usize, trial: &Trial) {
        let line = format!("trial {number} of {of}: {}", line(trial));
        match &self.bar {
            Some(bar) => {
                bar.inc(1);
                bar.println(shown(&line));
            }
            None if !self.style.quiet => complain(&line),
            None => {}
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Tells on the bar what a trial does.
pub struct Watch {
    bar: Option<ProgressBar>,
    what: String,
}

impl Observer for Watch {
    fn event(&mut self, event: &Event) {
        let Some(bar) = &self.bar else { return };
        match event {
            Event::Phase { name, .. } => bar.set_message(shown(&format!("{}: {name}", self.what))),
            Event::StepStart { action, .. } => {
                bar.set_message(shown(&format!("{}: {action}", self.what)));
            }
            _ => {}
        }
    }
}

/// Words one trial.
fn line(trial: &Trial) -> String {
    let without = match &trial.without[..] {
        [] => String::new(),
        left_out => {
            let names: Vec<String> = left_out.iter().map(ToString::to_string).collect();
            format!(" without regression {}", names.join(", "))
        }
    };
    let water = match (trial.in_target_ml, trial.spilt_ml) {
        (Some(target), Some(spilt)) => {
            format!("{target:.1} mL in the target, {spilt:.1} mL spilt, ")
        }
        (None, Some(spilt)) => format!("{spilt:.1} mL spilt, "),
        _ => String::new(),
    };
    let ended = match &trial.reason {
        Some(reason) => format!("failed, {reason}"),
        None if trial.is_clean() => "done".to_owned(),
        None => "not clean".to_owned(),
    };
    format!("seed {}{without}: {ended}; {water}{:.1} s", trial.seed, trial.total_s)
}

/// Returns the table of trials in a form.
pub fn table(rows: &[Row], leak: f64, form: Form) -> String {
    if form == Form::Csv {
        return csv(rows).form(form);
    }
    let mut grid = Grid::new(
        1,
        &[
            "method",
            "pick up",
            "pour water",
            "success (soft)",
            "success (hard)",
            "wall time, s",
            "arm time, s",
            "in the target, mL",
            "spilt, mL",
        ],
    );
    for row in rows {
        grid.rows.push(vec![
            row.method.clone(),
            share(row.pick_up),
            share(row.pour_water),
            share(row.success_soft),
            share(row.success_hard),
            spread(row.total_s),
            spread(row.arm_s),
            spread(row.in_target_ml),
            spread(row.spilt_ml),
        ]);
    }
    let mut lines = vec![grid.form(form)];
    if form == Form::Text {
        lines.push(format!(
            "\nIn brackets Wilson's 95 % interval; after ± the standard deviation. Pour water: at least 90 % is \
             in the target.\nSoft: done with at most {leak} mL on the table; hard: with none."
        ));
        for row in rows {
            for failed in &row.failures {
                let spilt =
                    failed.spilt_ml.map_or(String::new(), |ml| format!(" ({ml:.1} mL spilt)"));
                lines.push(format!(
                    "  {}, seed {}: {}{spilt}",
                    row.method, failed.seed, failed.reason
                ));
            }
        }
    }
    lines.join("\n")
}

pub(super) fn share(share: Option<Share>) -> String {
    share.map_or_else(
        || "-".to_owned(),
        |Share { of, yes, wilson_95: [low, high] }| {
            format!("{yes}/{of} ({:.0}-{:.0} %)", low * 100.0, high * 100.0)
        },
    )
}

fn spread(spread: Option<Spread>) -> String {
    spread.map_or_else(|| "-".to_owned(), |s| format!("{:.1} ± {:.1}", s.mean, s.std))
}

fn csv(rows: &[Row]) -> Grid {
    let shares = ["pick_up", "pour_water", "success_soft", "success_hard"];
    let spreads = ["total_s", "arm_s", "in_target_ml", "spilt_ml"];
    let mut head = vec!["method".to_owned(), "n".to_owned()];
    for name in shares {
        head.extend([name.to_owned(), format!("{name}_low"), format!("{name}_high")]);
    }
    for name in spreads {
        head.extend([format!("{name}_mean"), format!("{name}_std")]);
    }
    let mut grid = Grid { head, rows: Vec::new(), words: 1 };
    for row in rows {
        let mut cells = vec![row.method.clone(), row.n.to_string()];
        for share in [row.pick_up, row.pour_water, row.success_soft, row.success_hard] {
            match share {
                Some(Share { yes, wilson_95: [low, high], .. }) => {
                    cells.extend([yes.to_string(), format!("{low:.4}"), format!("{high:.4}")]);
                }
                None => cells.extend([const { String::new() }; 3]),
            }
        }
        for spread in [row.total_s, row.arm_s, row.in_target_ml, row.spilt_ml] {
            match spread {
                Some(s) => cells.extend([format!("{:.3}", s.mean), format!("{:.3}", s.std)]),
                None => cells.extend([const { String::new() }; 2]),
            }
        }
        grid.rows.push(cells);
    }
    grid
}
