//! One connection to a bridge: a line out, a line back, and no answer believed before it was checked.
//!
//! After the first wrong answer the arm is asked to stop, and nothing more is asked of the connection.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;
use serde_json::Value;

use super::error::Error;
use super::wire::{Hello, Photo, Refusal, Request, Step, Told, VERSION};
use crate::arm::{Mover, Weighing};

/// The longest line, bytes (protocol 1).
const LONGEST: usize = 16 << 20;
/// How long a connection may take, s.
const CONNECT_S: f64 = 5.0;
/// How long an answer may take beyond the time that passes in it, s: a simulator may be slow, and a person who waits
/// for an arm that has gone silent should know soon.
const ANSWER_S: f64 = 10.0;
/// How long a picture may take, s: a path tracer's takes tens of seconds.
const PHOTO_S: f64 = 60.0;
/// How long the arm's stop is waited for after a wrong answer, s.
const STOP_S: f64 = 1.0;

/// A clock that stands for so long is none, s: one that goes on in coarse steps stands for less.
const STOOD_S: f64 = 1.0;

/// A connection to a reality.
pub struct Link {
    stream: TcpStream,
    /// What was read beyond the last line.
    ahead: Vec<u8>,
    joints: usize,
    /// The server's time at the last feedback, s.
    time: Option<f64>,
    /// How much time was to pass since it went on, s.
    stood: f64,
    /// What was wrong, once something was.
    trouble: Option<Error>,
}

impl Link {
    /// Connects to `HOST:PORT` and says hello for a robot with these joints.
    ///
    /// # Errors
    ///
    /// [`Error`]: nobody there, another version, other joints.
    pub fn open(place: &str, robot: &str, joints: &[&str]) -> Result<(Self, Hello), Error> {
        let nobody = |why: &dyn std::fmt::Display| Error::Nobody {
            place: place.to_owned(),
            why: why.to_string(),
        };
        let mut why = Error::NoHost { place: place.to_owned() };
        let mut found = None;
        for address in place.to_socket_addrs().map_err(|error| nobody(&error))? {
            match TcpStream::connect_timeout(&address, Duration::from_secs_f64(CONNECT_S)) {
                Ok(stream) => {
                    found = Some(stream);
                    break;
                }
                Err(error) => why = nobody(&error),
            }
        }
        let stream = found.ok_or(why)?;
        // A command of a few hundred bytes is not held back to be sent with the next.
        stream.set_nodelay(true).map_err(|error| nobody(&error))?;
        let mut link = Self {
            stream,
            ahead: Vec::new(),
            joints: joints.len(),
            time: None,
            stood: 0.0,
            trouble: None,
        };
        let request = Request::Hello { version: VERSION, robot: robot.to_owned() };
        let hello: Hello = link.ask(&request, ANSWER_S)?;
        if hello.hello != VERSION {
            return Err(Error::Version { theirs: hello.hello, ours: VERSION });
        }
        if hello.joints != joints {
            return Err(Error::Joints { theirs: hello.joints.join(", "), ours: joints.join(", ") });
        }
        Ok((link, hello))
    }

    /// Returns whether nothing is asked of it any more.
    pub fn is_lost(&self) -> bool {
        self.trouble.is_some()
    }

    /// Lets time pass; returns how the arm is afterwards.
    ///
    /// # Errors
    ///
    /// [`Error`], after the arm was asked to stop.
    pub fn step(&mut self, step: Step) -> Result<Told, Error> {
        let (within, dt, before) = (ANSWER_S + step.dt, step.dt, self.time);
        let told = self.told(&Request::Step(step), within)?;
        self.stood = if before.is_some_and(|t| told.t <= t) { self.stood + dt } else { 0.0 };
        if self.stood > STOOD_S {
            return Err(self.give_up(Error::ClockStands { at: told.t, passed: self.stood }));
        }
        Ok(told)
    }

    /// Returns how the arm is now.
    ///
    /// # Errors
    ///
    /// As [`Self::step`].
    pub fn feedback(&mut self) -> Result<Told, Error> {
        self.told(&Request::Feedback {}, ANSWER_S)
    }

    /// Has the arm held where it is.
    ///
    /// # Errors
    ///
    /// As [`Self::step`].
    pub fn stop(&mut self) -> Result<Told, Error> {
        self.told(&Request::Stop {}, ANSWER_S)
    }

    /// Returns a photograph, a PNG file in base64.
    ///
    /// # Errors
    ///
    /// As [`Self::step`].
    pub fn photo(&mut self) -> Result<String, Error> {
        self.ask(&Request::Photo {}, PHOTO_S).map(|photo: Photo| photo.png)
    }

    /// Returns a photograph as [`Self::photo`] does, if there is one; the arm is stopped only when the line is lost.
    pub fn glance(&mut self) -> Option<String> {
        if self.trouble.is_some() {
            return None;
        }
        match self.exchange(&Request::Photo {}, PHOTO_S) {
            Ok(line) => serde_json::from_slice(&line).ok().map(|photo: Photo| photo.png),
            Err(error) => {
                self.give_up(error);
                None
            }
        }
    }

    /// Returns what the scales say.
    ///
    /// # Errors
    ///
    /// As [`Self::step`].
    pub fn scales(&mut self) -> Result<Weighing, Error> {
        let weighing: Weighing = self.ask(&Request::Scales {}, ANSWER_S)?;
        let all = weighing.water.iter().map(|(vessel, volume)| (vessel.as_str(), *volume));
        for (which, volume) in all.chain([("what was spilt", weighing.spilt)]) {
            if volume < 0.0 {
                let error = Error::Scales { which: which.to_owned(), volume_m3: volume };
                return Err(self.give_up(error));
            }
        }
        Ok(weighing)
    }

    /// Asks for feedback, and checks it.
    fn told(&mut self, request: &Request, within: f64) -> Result<Told, Error> {
        let told: Told = self.ask(request, within)?;
        if let Some(error) = wrong(&told, request.word(), self.joints, self.time) {
            return Err(self.give_up(error));
        }
        self.time = Some(told.t);
        Ok(told)
    }

    /// Asks; an answer that is no answer ends the connection, one that says no does not.
    fn ask<T: DeserializeOwned>(&mut self, request: &Request, within: f64) -> Result<T, Error> {
        if let Some(trouble) = &self.trouble {
            return Err(trouble.clone());
        }
        let word = request.word();
        let line = match self.exchange(request, within) {
            Ok(line) => line,
            Err(error) => return Err(self.give_up(error)),
        };
        if let Ok(Refusal { error, help }) = serde_json::from_slice(&line) {
            // It may go on later, but not from a motion that was cut short.
            let _ = self.exchange(&Request::Stop {}, STOP_S);
            return Err(Error::Refused { request: word, why: error, help });
        }
        serde_json::from_slice(&line).map_err(|error| {
            let unreadable = Error::Unreadable { request: word, why: error.to_string() };
            self.give_up(no_number(&line, word).unwrap_or(unreadable))
        })
    }

    /// Sends a line and waits for one.
    #[expect(
        clippy::disallowed_methods,
        reason = "how long an answer may take is measured against the wall"
    )]
    fn exchange(&mut self, request: &Request, within: f64) -> Result<Vec<u8>, Error> {
        let word = request.word();
        let broken =
            |error: &dyn std::fmt::Display| Error::Broken { request: word, why: error.to_string() };
        let mut line = serde_json::to_vec(request).map_err(|error| broken(&error))?;
        line.push(b'\n');
        let limit = Duration::from_secs_f64(within);
        self.stream.set_write_timeout(Some(limit)).map_err(|error| broken(&error))?;
        self.stream.write_all(&line).map_err(|error| broken(&error))?;
        let end = Instant::now() + limit;
        let mut chunk = vec![0; 64 << 10];
        let mut searched = 0;
        loop {
            if let Some(at) = self.ahead[searched..].iter().position(|byte| *byte == b'\n') {
                let rest = self.ahead.split_off(searched + at + 1);
                return Ok(std::mem::replace(&mut self.ahead, rest));
            }
            searched = self.ahead.len();
            if searched > LONGEST {
                return Err(Error::TooLong { request: word, limit_mib: LONGEST >> 20 });
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(Error::Silent { request: word, within_s: within });
            }
            self.stream.set_read_timeout(Some(left)).map_err(|error| broken(&error))?;
            match self.stream.read(&mut chunk) {
                Ok(0) => return Err(Error::Closed { request: word }),
                Ok(n) => self.ahead.extend_from_slice(&chunk[..n]),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error)
                    if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) =>
                {
                    return Err(Error::Silent { request: word, within_s: within });
                }
                Err(error) => return Err(broken(&error)),
            }
        }
    }

    /// Asks the arm to stop and keeps what was wrong: nothing is asked any more.
    fn give_up(&mut self, error: Error) -> Error {
        // Whoever answers wrongly may still understand this; nothing depends on it.
        self.ahead.clear();
        let _ = self.exchange(&Request::Stop {}, STOP_S);
        self.trouble = Some(error.clone());
        error
    }
}

/// Returns which number of feedback that cannot be read is none: JSON has no word for it, and programs write `NaN` or `null`.
fn no_number(line: &[u8], request: &'static str) -> Option<Error> {
    let text = std::str::from_utf8(line).ok()?.to_owned();
    let words = ["-Infinity", "Infinity", "NaN"];
    let text = words.into_iter().fold(text, |text, word| text.replace(word, "null"));
    let told: Value = serde_json::from_str(&text).ok()?;
    for field in ["q", "dq", "tau"] {
        let mut list = told.get(field).and_then(Value::as_array).into_iter().flatten();
        if let Some(at) = list.position(Value::is_null) {
            return Some(Error::NotFinite { request, field, joint: Some(at + 1) });
        }
    }
    let single = ["t", "opening"].into_iter();
    let mut none = single.filter(|field| told.get(*field).is_some_and(Value::is_null));
    none.next().map(|field| Error::NotFinite { request, field, joint: None })
}

/// Returns what is wrong with feedback, if anything is.
fn wrong(told: &Told, request: &'static str, joints: usize, before: Option<f64>) -> Option<Error> {
    let lists = [("q", &told.q), ("dq", &told.dq), ("tau", &told.tau)];
    for (field, list) in lists {
        if list.len() != joints {
            return Some(Error::Length { request, field, got: list.len(), joints });
        }
        if let Some(at) = list.iter().position(|number| !number.is_finite()) {
            return Some(Error::NotFinite { request, field, joint: Some(at + 1) });
        }
    }
    for (field, number) in [("t", told.t), ("opening", told.opening)] {
        if !number.is_finite() {
            return Some(Error::NotFinite { request, field, joint: None });
        }
    }
    if told.moving.len() > Mover::MOST {
        return Some(Error::Movers { request, got: told.moving.len() });
    }
    for (at, mover) in told.moving.iter().enumerate() {
        let is_another = told.moving[..at].iter().any(|other| other.name == mover.name);
        if !mover.is_sound() || mover.name.is_empty() || is_another {
            return Some(Error::Mover { request, which: at + 1 });
        }
    }
    let from = before?;
    (told.t < from).then_some(Error::ClockWentBack { from, to: told.t })
}
