//! The run folder: everything a run decided, did and measured, on disk step by step.
//!
//! `events.jsonl` is appended and flushed event by event, `arm.csv` is a recording of
//! commands, joints and torques, pictures are JPEG files in `frames/`, those of the
//! film in `film/`, and `run.json` is written anew
//! after each step, so that an interrupted run is still a whole document. Rows and lines are written whole or
//! not at all. `events.jsonl` is locked while the run goes on, by which a run that was cut off is told from one
//! that is not over: the system takes the lock away from a program that is killed.

use std::fmt::Write as _;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::RgbImage;
use rayon::prelude::*;
use serde::Serialize;

use crate::arm::{Cancel, Feedback};
use crate::files::write;
use crate::trace::{Event, Observer, Still};

use super::{film, picture, wording};

/// The file of events in a run folder.
pub const EVENTS: &str = "events.jsonl";
/// Rows of the arm are gathered up to this before they are written, bytes.
const GATHERED: usize = 64 << 10;
/// Rows of the arm are at least so far apart, s: every third tick of 4 ms, 12 ms, every tenth of a stream's. Chosen: what the arm
/// reports faster adds nothing a gap could be found in.
const APART: f64 = 0.01;
/// A row that is early by less is not, s: rounding of the arm's time.
const SAME: f64 = 1e-4;

/// A run folder being written.
#[derive(Debug)]
pub struct Recorder {
    dir: PathBuf,
    events: Growing,
    arm: Growing,
    /// Whether a film is kept.
    is_filmed: bool,
    /// The film's table, once there is a film.
    film: Option<Growing>,
    /// Rows of the arm that are not written yet.
    rows: String,
    arm_has_header: bool,
    /// Which joints slide; those beyond its end turn.
    sliding: Vec<bool>,
    last_tick: f64,
    /// The last pictures, real and twin.
    pictures: Vec<(PathBuf, Arc<[u8]>)>,
    /// Whom to ask to stop when nothing can be recorded any more.
    stop: Option<Cancel>,
    /// The first thing that could not be written; later events are dropped.
    trouble: Option<io::Error>,
    /// Whether that was told.
    is_told: bool,
}

/// A file that only grows, by whole lines.
#[derive(Debug)]
struct Growing {
    file: File,
    length: u64,
}

impl Growing {
    fn new(path: &Path) -> io::Result<Self> {
        Ok(Self { file: File::create(path)?, length: 0 })
    }

    fn add(&mut self, lines: &str) -> io::Result<()> {
        write::append(&mut self.file, &mut self.length, lines.as_bytes())
    }
}

/// Takes away what a program that was killed while it wrote left of a last row of `arm.csv`.
pub fn whole_rows(mut rows: String) -> String {
    rows.truncate(rows.rfind('\n').map_or(0, |end| end + 1));
    rows
}

/// Returns whether somebody writes to a run folder now.
pub fn is_going_on(dir: &Path) -> bool {
    let events = File::open(dir.join(EVENTS));
    events.is_ok_and(|events| matches!(events.try_lock_shared(), Err(TryLockError::WouldBlock)))
}

impl Recorder {
    /// Makes the folder `root/<stamp>-<task>`, or the first free name after it.
    ///
    /// # Errors
    ///
    /// What the file system says, with the path; nothing is left behind.
    pub fn create(root: &Path, stamp: &str, task: &str) -> Result<Self, (PathBuf, io::Error)> {
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
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                    dir = root.join(format!("{stamp}-{task}-{n}"));
                }
                Err(error) => return Err((dir, error)),
            }
        }
        Self::fill(&dir).map_err(|error| {
            // It was made just now, and nobody has put anything into it.
            let _ = fs::remove_dir_all(&dir);
            (dir, error)
        })
    }

    /// Begins the files of a folder.
    fn fill(dir: &Path) -> io::Result<Self> {
        fs::create_dir(dir.join("frames"))?;
        let events = Growing::new(&dir.join(EVENTS))?;
        // A file system without locks: then nobody can tell, which is not worth a run.
        let _ = events.file.try_lock();
        let arm = Growing::new(&dir.join("arm.csv"))?;
        Ok(Self {
            dir: dir.to_owned(),
            events,
            arm,
            is_filmed: true,
            film: None,
            rows: String::new(),
            arm_has_header: false,
            sliding: Vec::new(),
            last_tick: f64::NEG_INFINITY,
            pictures: Vec::new(),
            stop: None,
            trouble: None,
            is_told: false,
        })
    }

    /// Keeps no film: of many runs of which nobody looks at each.
    #[must_use]
    pub fn without_film(self) -> Self {
        Self { is_filmed: false, ..self }
    }

    /// Says which joints slide, before the arm moves: their columns are in m, m/s and N.
    pub fn slide(&mut self, sliding: Vec<bool>) {
        self.sliding = sliding;
    }

    /// Whether a film is kept.
    pub(super) fn is_filmed(&self) -> bool {
        self.is_filmed
    }

    /// Asks for a stop when something cannot be recorded: what nobody can look up later is not done.
    pub fn stops(&mut self, stop: Cancel) {
        self.stop = Some(stop);
    }

    /// Says what could not be written, if anything could not and nobody was told yet.
    pub fn trouble(&self) -> Option<String> {
        self.trouble.as_ref().map(ToString::to_string)
    }

    /// Returns the folder.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Writes `run.json` as it stands now, whole or not at all.
    ///
    /// # Errors
    ///
    /// What the file system says, also, once, about anything earlier that could not be written; the document
    /// is written all the same if that can be done.
    pub fn save(&mut self, run: &impl Serialize) -> io::Result<()> {
        if let Err(error) = self.write_rows() {
            self.fail(error);
        }
        let text = serde_json::to_string(run)?;
        let saved = write::replace(&self.dir.join("run.json"), text);
        match self.trouble.take_if(|_| !self.is_told) {
            Some(trouble) => {
                self.is_told = true;
                Err(trouble)
            }
            None => saved,
        }
    }

    /// Writes another file of the folder.
    ///
    /// # Errors
    ///
    /// What the file system says.
    pub fn write(&self, name: &str, text: &str) -> io::Result<()> {
        write::replace(&self.dir.join(name), text)
    }

    /// Takes note of the first thing that could not be written, and asks for a stop.
    fn fail(&mut self, error: io::Error) {
        if self.trouble.is_some() || self.is_told {
            return;
        }
        // A short line may fit where nothing else does: into what is left of the last block of its file.
        let last = Event::note(wording::unrecorded(&error));
        if let Ok(line) = serde_json::to_string(&last) {
            let _ = self.events.add(&(line + "\n"));
        }
        self.trouble = Some(error);
        if let Some(stop) = &self.stop {
            stop.cancel();
        }
    }

    fn write_rows(&mut self) -> io::Result<()> {
        self.arm.add(&std::mem::take(&mut self.rows))
    }

    fn tick(&mut self, feedback: &Feedback) -> io::Result<()> {
        if feedback.time - self.last_tick < APART - SAME {
            return Ok(());
        }
        self.last_tick = feedback.time;
        let n = feedback.q.len();
        if !self.arm_has_header {
            self.arm_has_header = true;
            let columns = [
                ("q_cmd", ["rad", "m"]),
                ("q", ["rad", "m"]),
                ("dq", ["rad/s", "m/s"]),
                ("tau", ["N*m", "N"]),
            ];
            let mut header = "t[s]".to_owned();
            for (name, [turning, sliding]) in columns {
                for joint in 1..=n {
                    let slides = self.sliding.get(joint - 1).copied().unwrap_or(false);
                    let unit = if slides { sliding } else { turning };
                    let _ = write!(header, ",{name}_{joint}[{unit}]");
                }
            }
            let scale = if feedback.mass.is_some() { ",mass[kg]" } else { "" };
            let _ = writeln!(self.rows, "{header},gripper[m]{scale}");
        }
        let mut row = format!("{:.4}", feedback.time);
        // A twentieth of an encoder's step, and of what speeds and torques are known to.
        for (values, digits) in
            [(&feedback.q_cmd, 6), (&feedback.q, 6), (&feedback.dq, 4), (&feedback.tau, 4)]
        {
            for value in values {
                let _ = write!(row, ",{value:.digits$}");
            }
        }
        let _ = write!(row, ",{:.5}", feedback.opening);
        if let Some(mass) = feedback.mass {
            let _ = write!(row, ",{mass:.5}");
        }
        let _ = writeln!(self.rows, "{row}");
        if self.rows.len() < GATHERED { Ok(()) } else { self.write_rows() }
    }

    /// Writes a picture; one that is there by another name is linked.
    fn picture(&mut self, name: &str, jpeg: &Arc<[u8]>) -> io::Result<()> {
        let path = self.dir.join("frames").join(format!("{name}.{}", picture::ENDING));
        if jpeg.is_empty() {
            return Err(io::ErrorKind::InvalidData.into());
        }
        let twin = self.pictures.iter().find(|(_, last)| Arc::ptr_eq(last, jpeg));
        // Where the file system has no links it is written again.
        if twin.is_some_and(|(twin, _)| fs::hard_link(twin, &path).is_ok()) {
            return Ok(());
        }
        write::place(&path, jpeg)?;
        self.pictures.truncate(1);
        self.pictures.insert(0, (path, jpeg.clone()));
        Ok(())
    }

    /// Keeps the last pictures as they were drawn too, as PNG files: a run is judged by them.
    pub(super) fn keep_whole(&mut self, newest: &[(String, RgbImage)]) {
        let frames = self.dir.join("frames");
        let keep = |(name, image): &(String, RgbImage)| {
            write::picture(&frames.join(format!("{name}.png")), image)
        };
        let kept: Vec<io::Result<()>> = newest.par_iter().map(keep).collect();
        if let Some(error) = kept.into_iter().find_map(Result::err) {
            self.fail(error);
        }
    }

    /// Writes a moment of the film: its pictures first, so that the table tells of none that is not there.
    fn still(&mut self, still: &Still) -> io::Result<()> {
        if self.film.is_none() {
            let dir = self.dir.join(film::FOLDER);
            fs::create_dir(&dir)?;
            let mut table = Growing::new(&dir.join(film::TABLE))?;
            table.add(&film::header(still))?;
            self.film = Some(table);
        }
        for (whose, jpeg) in [("real", &still.real), ("twin", &still.twin)] {
            if let Some(jpeg) = jpeg {
                write::place(&film::picture(&self.dir, still.number, whose), jpeg)?;
            }
        }
        let Some(table) = &mut self.film else { return Ok(()) };
        table.add(&film::row(still))
    }

    fn keep(&mut self, event: &Event) -> io::Result<()> {
        match event {
            Event::Tick(feedback) => self.tick(feedback),
            Event::Picture { name, jpeg } => self.picture(name, jpeg),
            Event::Still(still) => self.still(still),
            Event::Progress { .. } | Event::Tryout(_) => Ok(()),
            other => {
                // Rows first: the arm's recording is as long as what is said of it.
                self.write_rows()?;
                self.events.add(&(serde_json::to_string(other)? + "\n"))
            }
        }
    }
}

impl Observer for Recorder {
    fn event(&mut self, event: &Event) {
        if self.trouble.is_some() || self.is_told {
            return;
        }
        if let Err(error) = self.keep(event) {
            self.fail(error);
        }
    }
}
