//! The run folder: everything a run decided, did and measured, on disk step by step.
//!
//! `events.jsonl` is appended and flushed event by event, `arm.csv` is a recording of
//! commands, joints and torques, pictures are PNG files in `frames/`, and `run.json` is written anew
//! after each step, so that an interrupted run is still a whole document.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::execution::arm::Feedback;
use crate::execution::trace::{Event, Observer};

/// A run folder being written.
#[derive(Debug)]
pub struct Recorder {
    dir: PathBuf,
    events: File,
    arm: BufWriter<File>,
    arm_has_header: bool,
    last_tick: f64,
    /// The first thing that could not be written; later events are dropped and this is told at the end.
    trouble: Option<std::io::Error>,
}

impl Recorder {
    /// Makes the folder `root/<stamp>-<task>`, or the first free name after it.
    ///
    /// # Errors
    ///
    /// What the file system says, with the path; nothing is left behind.
    pub fn create(root: &Path, stamp: &str, task: &str) -> Result<Self, (PathBuf, std::io::Error)> {
        let task: String =
            task.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
        let at = |dir: &Path| {
            let dir = dir.to_path_buf();
            move |error| (dir, error)
        };
        fs::create_dir_all(root).map_err(at(root))?;
        let mut dir = root.join(format!("{stamp}-{task}"));
        for n in 2.. {
            match fs::create_dir(&dir) {
                Ok(()) => break,
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {
                    dir = root.join(format!("{stamp}-{task}-{n}"));
                }
                Err(error) => return Err((dir, error)),
            }
        }
        fs::create_dir(dir.join("frames")).map_err(at(&dir))?;
        let events = File::create(dir.join("events.jsonl")).map_err(at(&dir))?;
        let arm = BufWriter::new(File::create(dir.join("arm.csv")).map_err(at(&dir))?);
        Ok(Self {
            dir,
            events,
            arm,
            arm_has_header: false,
            last_tick: f64::NEG_INFINITY,
            trouble: None,
        })
    }

    /// Returns the folder.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Writes `run.json` as it stands now, whole or not at all.
    ///
    /// # Errors
    ///
    /// What the file system says, also about anything earlier that could not be written.
    pub fn save(&mut self, run: &impl Serialize) -> std::io::Result<()> {
        if let Some(trouble) = self.trouble.take() {
            return Err(trouble);
        }
        self.arm.flush()?;
        let text = serde_json::to_string_pretty(run)?;
        let half = self.dir.join("run.json.part");
        fs::write(&half, text)?;
        fs::rename(half, self.dir.join("run.json"))
    }

    /// Writes another file of the folder.
    ///
    /// # Errors
    ///
    /// What the file system says.
    pub fn write(&self, name: &str, text: &str) -> std::io::Result<()> {
        fs::write(self.dir.join(name), text)
    }

    fn tick(&mut self, feedback: &Feedback) -> std::io::Result<()> {
        // 100 Hz are kept: what the arm reports faster adds nothing a gap could be found in.
        if feedback.time - self.last_tick < 0.0099 {
            return Ok(());
        }
        self.last_tick = feedback.time;
        let n = feedback.q.len();
        if !self.arm_has_header {
            self.arm_has_header = true;
            let columns = [("q_cmd", "rad"), ("q", "rad"), ("dq", "rad/s"), ("tau", "N*m")];
            let mut header = "t[s]".to_owned();
            for (name, unit) in columns {
                for joint in 1..=n {
                    let _ = write!(header, ",{name}_{joint}[{unit}]");
                }
            }
            let scale = if feedback.mass.is_some() { ",mass[kg]" } else { "" };
            writeln!(self.arm, "{header},gripper[m]{scale}")?;
        }
        let mut row = format!("{:.4}", feedback.time);
        for values in [&feedback.q_cmd, &feedback.q, &feedback.dq, &feedback.tau] {
            for value in values {
                let _ = write!(row, ",{value:.6}");
            }
        }
        let _ = write!(row, ",{:.5}", feedback.opening);
        if let Some(mass) = feedback.mass {
            let _ = write!(row, ",{mass:.5}");
        }
        writeln!(self.arm, "{row}")
    }

    fn keep(&mut self, event: &Event) -> std::io::Result<()> {
        match event {
            Event::Tick(feedback) => self.tick(feedback),
            Event::Picture { name, image } => {
                let path = self.dir.join("frames").join(format!("{name}.png"));
                image.save(path).map_err(std::io::Error::other)
            }
            Event::Progress { .. } => Ok(()),
            other => {
                let line = serde_json::to_string(other)?;
                writeln!(self.events, "{line}")?;
                self.events.flush()
            }
        }
    }
}

impl Observer for Recorder {
    fn event(&mut self, event: &Event) {
        if let Err(error) = self.keep(event) {
            self.trouble.get_or_insert(error);
        }
    }
}
