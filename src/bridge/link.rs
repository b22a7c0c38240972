//! One connection to a bridge: a line out, a line back, and no answer believed before it was checked.
//!
//! An answer that cannot be ends the connection: the arm is asked to stop, and nothing more is asked. One to a step leaves the line in
//! step, and the arm may move: whoever leads it may lead it to rest before, as long as the answers are good. An answer that says no ends nothing.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;

use super::check::{Unchanged, Wanted, wrong};
use super::error::Error;
use super::unread::{no_object, unread};
use super::wire::{Hello, Photo, Refusal, Request, Step, Told, VERSION};
use crate::arm::{Cancel, Weighing};

/// The longest line, bytes (protocol 1).
const LONGEST: usize = 16 << 20;
/// How long a connection may take, s.
const CONNECT_S: f64 = 5.0;
/// How long an answer may take beyond the time that passes in it, s: a simulator may be slow, and a person who waits
/// for an arm that has gone silent should know soon.
const ANSWER_S: f64 = 10.0;
/// How long a picture may take, s: a path tracer's takes tens of seconds.
const PHOTO_S: f64 = 60.0;
/// How long the arm's stop is waited for after a wrong answer or one that somebody did not wait for, s; and each step that leads it to
/// rest after a wrong one.
const STOP_S: f64 = 1.0;

/// How often a wish to stop is looked for while an answer is waited for, s.
const LOOK_S: f64 = 0.05;
/// How long an answer is waited for once somebody wishes to stop, s: long enough to brake by commands where a server is as quick as ever.
const WISH_S: f64 = 1.0;

/// A clock that stands for so long is none, s: one that goes on in coarse steps stands for less, and leaps by less.
const STOOD_S: f64 = 1.0;

/// A connection to a reality.
pub struct Link {
    stream: TcpStream,
    /// What was read beyond the last line.
    ahead: Vec<u8>,
    /// Answers that were not waited for to the end, and come before the next.
    owed: usize,
    /// What was answered last.
    answered: &'static str,
    /// What is wished to stop while an answer is waited for.
    cancel: Cancel,
    wanted: Wanted,
    /// Whether the server's time passes by itself.
    is_realtime: bool,
    /// The last feedback.
    last: Option<Told>,
    unchanged: Unchanged,
    /// How much time was to pass since it went on, s.
    stood: f64,
    /// What was wrong, once something was.
    trouble: Option<Error>,
    /// Whether the line is in step all the same, and the arm has not been asked to stop yet.
    may_rest: bool,
}

impl Link {
    /// Connects to `HOST:PORT` and says hello for this robot; answers are waited for until `cancel` says otherwise.
    ///
    /// # Errors
    ///
    /// [`Error`]: nobody there, another version, other joints.
    pub fn open(place: &str, wanted: Wanted, cancel: Cancel) -> Result<(Self, Hello), Error> {
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
            owed: 0,
            answered: "hello",
            cancel,
            wanted,
            is_realtime: false,
            last: None,
            unchanged: Unchanged::default(),
            stood: 0.0,
            trouble: None,
            may_rest: false,
        };
        let request = Request::Hello { version: VERSION, robot: link.wanted.robot.clone() };
        let hello: Hello = link.ask(&request, ANSWER_S)?;
        if hello.hello != VERSION {
            return Err(Error::Version { theirs: hello.hello, ours: VERSION });
        }
        let joints: Vec<&str> =
            link.wanted.joints.iter().map(|joint| joint.name.as_str()).collect();
        if hello.joints != joints {
            return Err(Error::Joints { theirs: hello.joints.join(", "), ours: joints.join(", ") });
        }
        link.is_realtime = hello.realtime;
        Ok((link, hello))
    }

    /// Returns whether nothing is asked of it any more, but that the arm comes to rest.
    pub fn is_lost(&self) -> bool {
        self.trouble.is_some()
    }

    /// Returns whether steps that lead the arm to rest are still carried.
    pub fn is_led_to_rest(&self) -> bool {
        self.trouble.is_none() || self.may_rest
    }

    /// Returns whether the arm was asked to stop and has not answered yet.
    pub fn owes_stop(&self) -> bool {
        self.owed > 0
    }

    /// Lets time pass; returns how the arm is afterwards.
    ///
    /// # Errors
    ///
    /// [`Error`]; the arm was asked to stop unless it [may be led to rest](Self::is_led_to_rest): then [`Self::stop`] is due.
    pub fn step(&mut self, step: Step) -> Result<Told, Error> {
        let patience = if self.is_lost() { STOP_S } else { ANSWER_S };
        let (within, dt, sent) = (patience + step.dt, step.dt, step.q.clone());
        let last = self.last.clone();
        let told = self.told(&Request::Step(step), within)?;
        let frozen =
            last.as_ref().and_then(|last| self.unchanged.takes(last, &told, sent.as_deref()));
        if let Some(error) = frozen {
            return Err(self.doubt(error));
        }
        let before = last.map(|last| last.t);
        if let Some(from) = before.filter(|_| !self.is_realtime) {
            let leap = told.t - from;
            if leap > dt + self.stood + STOOD_S {
                return Err(self.doubt(Error::ClockLeaps { leap, asked: dt }));
            }
        }
        self.stood = if before.is_some_and(|t| told.t <= t) { self.stood + dt } else { 0.0 };
        if self.stood > STOOD_S {
            return Err(self.doubt(Error::ClockStands { at: told.t, passed: self.stood }));
        }
        Ok(told)
    }

    /// Returns how the arm is now.
    ///
    /// # Errors
    ///
    /// [`Error`], after the arm was asked to stop.
    pub fn feedback(&mut self) -> Result<Told, Error> {
        self.told(&Request::Feedback {}, ANSWER_S)
    }

    /// Has the arm held where it is.
    ///
    /// # Errors
    ///
    /// [`Error`]; after an answer that cannot be it is that one's, and the arm was asked to stop.
    pub fn stop(&mut self) -> Result<Told, Error> {
        if self.may_rest
            && let Some(trouble) = self.trouble.clone()
        {
            return Err(self.give_up(trouble));
        }
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
                self.fail(error);
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
        if let Some(error) = wrong(&told, request.word(), &self.wanted, self.last.as_ref()) {
            return Err(self.refuse(request, error));
        }
        self.last = Some(told.clone());
        Ok(told)
    }

    /// Asks; an answer that is no answer ends the connection, one that says no does not. Either has the arm stopped, but where it may be
    /// led to rest before.
    fn ask<T: DeserializeOwned>(&mut self, request: &Request, within: f64) -> Result<T, Error> {
        let leads_to_rest = self.may_rest && is_step(request);
        if let Some(trouble) = self.trouble.as_ref().filter(|_| !leads_to_rest) {
            return Err(trouble.clone());
        }
        let word = request.word();
        let answer = match self.exchange(request, within) {
            Ok(answer) => answer,
            Err(error) => return Err(self.fail(error)),
        };
        // A writer of UTF-8 may begin with a byte-order mark.
        let line = answer.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&answer);
        if let Some(error) = no_object(line, word) {
            return Err(self.refuse(request, error));
        }
        if let Ok(Refusal { error, help }) = serde_json::from_slice(line) {
            // It may go on later, but not from a motion that was cut short.
            if !is_step(request) && !matches!(request, Request::Stop {}) {
                self.ask_to_stop();
            }
            return Err(Error::Refused { request: word, why: error, help });
        }
        serde_json::from_slice(line).map_err(|error| {
            let error = unread(line, word, &error);
            self.refuse(request, error)
        })
    }

    /// Sends a line and waits for one.
    fn exchange(&mut self, request: &Request, within: f64) -> Result<Vec<u8>, Error> {
        let word = request.word();
        // What somebody wished to stop is to be stopped.
        let wish_s = (!matches!(request, Request::Stop {})).then_some(WISH_S);
        // What is owed has been waited for since the wish.
        self.catch_up(word, within, wish_s.map(|_| 0.0))?;
        self.is_alone()?;
        self.send(request, within)?;
        let line = self.line(word, within, wish_s);
        if matches!(line, Err(Error::Interrupted { .. })) {
            // The answer comes later, and then the arm is stopped.
            self.owed += 1;
            self.owed += usize::from(self.send(&Request::Stop {}, STOP_S).is_ok());
            // Whether it holds is known once it has answered.
            let _ = self.catch_up("stop", STOP_S, None);
        }
        let line = line?;
        self.answered = word;
        Ok(line)
    }

    /// Lets pass what was not waited for to the end.
    fn catch_up(
        &mut self,
        word: &'static str,
        within: f64,
        wish_s: Option<f64>,
    ) -> Result<(), Error> {
        while self.owed > 0 {
            self.line(word, within, wish_s)?;
            self.owed -= 1;
        }
        Ok(())
    }

    /// Refuses an answer that waits though nothing was asked: all that follow would be one too old.
    fn is_alone(&mut self) -> Result<(), Error> {
        let after = self.answered;
        let broken =
            |error: std::io::Error| Error::Broken { request: after, why: error.to_string() };
        let mut chunk = [0; 1 << 10];
        self.stream.set_nonblocking(true).map_err(broken)?;
        // A line that has ended says so when it is asked.
        if let Ok(n) = self.stream.read(&mut chunk) {
            self.ahead.extend_from_slice(&chunk[..n]);
        }
        self.stream.set_nonblocking(false).map_err(broken)?;
        if self.ahead.iter().all(u8::is_ascii_whitespace) {
            self.ahead.clear();
            return Ok(());
        }
        Err(Error::Unasked { after })
    }

    /// Sends a line.
    fn send(&mut self, request: &Request, within: f64) -> Result<(), Error> {
        let word = request.word();
        let broken =
            |error: &dyn std::fmt::Display| Error::Broken { request: word, why: error.to_string() };
        let mut line = serde_json::to_vec(request).map_err(|error| broken(&error))?;
        line.push(b'\n');
        let limit = Duration::from_secs_f64(within);
        self.stream.set_write_timeout(Some(limit)).map_err(|error| broken(&error))?;
        self.stream.write_all(&line).map_err(|error| broken(&error))
    }

    /// Waits for a line; only `wish_s` longer once somebody wishes to stop, s, where such a wish counts.
    #[expect(
        clippy::disallowed_methods,
        reason = "how long an answer may take is measured against the wall"
    )]
    fn line(
        &mut self,
        word: &'static str,
        within: f64,
        wish_s: Option<f64>,
    ) -> Result<Vec<u8>, Error> {
        let broken =
            |error: std::io::Error| Error::Broken { request: word, why: error.to_string() };
        let end = Instant::now() + Duration::from_secs_f64(within);
        let mut wished = None;
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
            let now = Instant::now();
            let left = end.saturating_duration_since(now);
            if left.is_zero() {
                return Err(Error::Silent { request: word, within_s: within });
            }
            if let Some(wish_s) = wish_s.filter(|_| self.cancel.is_cancelled()) {
                let since = *wished.get_or_insert(now);
                if now.duration_since(since).as_secs_f64() > wish_s {
                    return Err(Error::Interrupted { request: word });
                }
            }
            let look = left.min(Duration::from_secs_f64(LOOK_S));
            self.stream.set_read_timeout(Some(look)).map_err(broken)?;
            match self.stream.read(&mut chunk) {
                Ok(0) => return Err(Error::Closed { request: word }),
                Ok(n) => self.ahead.extend_from_slice(&chunk[..n]),
                Err(error)
                    if matches!(
                        error.kind(),
                        ErrorKind::Interrupted | ErrorKind::WouldBlock | ErrorKind::TimedOut
                    ) => {}
                Err(error) => return Err(broken(error)),
            }
        }
    }

    /// Takes note of what went wrong with an answer: after all but one that was only not waited for, nothing is asked any more.
    fn fail(&mut self, error: Error) -> Error {
        if matches!(error, Error::Interrupted { .. }) {
            // The arm has been asked to stop.
            self.may_rest = false;
            return error;
        }
        self.give_up(error)
    }

    /// Takes note of an answer that came and cannot be.
    fn refuse(&mut self, request: &Request, error: Error) -> Error {
        if is_step(request) { self.doubt(error) } else { self.give_up(error) }
    }

    /// Takes note of an answer to a step that cannot be: the next ones may be good, and the arm is led to rest by them. After a second one it
    /// is asked to stop at once.
    fn doubt(&mut self, error: Error) -> Error {
        if self.is_lost() {
            return self.give_up(error);
        }
        self.may_rest = true;
        self.trouble = Some(error.clone());
        error
    }

    /// Asks the arm to stop; an answer that is late comes before the next.
    fn ask_to_stop(&mut self) {
        match self.exchange(&Request::Stop {}, STOP_S) {
            Ok(_) => {}
            Err(Error::Silent { .. }) => self.owed += 1,
            Err(error) => {
                self.give_up(error);
            }
        }
    }

    /// Asks the arm to stop and keeps what was wrong first: nothing is asked any more.
    fn give_up(&mut self, error: Error) -> Error {
        // Whoever answers wrongly may still understand this; nothing depends on it.
        self.ahead.clear();
        let stopped = self.send(&Request::Stop {}, STOP_S);
        let _ = stopped.and_then(|()| self.line("stop", STOP_S, None));
        self.may_rest = false;
        self.trouble.get_or_insert(error).clone()
    }
}

/// Whether the arm may be on its way while this is answered.
fn is_step(request: &Request) -> bool {
    matches!(request, Request::Step(_))
}
