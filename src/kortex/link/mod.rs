//! A session with the arm: calls and their answers, notifications, and signs of life.
//!
//! Over TCP any number of calls may be under way; an answer finds its call by the message's number. Over
//! UDP, which the 1 kHz cycle needs, there is one at a time and what comes late is passed over. Both need a
//! session of their own.
//!
//! Source: the behaviour of Kinova's Python client 2.3.0 (numbers of messages and sessions, times of its
//! keep-alive).

use std::collections::{BTreeMap, VecDeque};
use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU16, Ordering};
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use prost::Message;

use super::clock::{Clock, Wall};
use super::frame::{Decoder, Frame, FrameError, Kind};
use super::messages::base::{ServoingMode, ServoingModeInformation};
use super::messages::common::{NotificationHandle, NotificationOptions};
use super::messages::session::CreateSessionInfo;
use super::refusal::{self, Refusal};
use super::rpc::{self, Rpc};

mod datagrams;
mod error;

pub use datagrams::Datagrams;
pub use error::{Garbled, LinkError, Loss};

/// A session that sends nothing for so long is closed by the arm, ms; and its movements are stopped after
/// so long, ms. The vendor's examples take the same.
const SESSION_SILENCE_MS: u32 = 60_000;
pub(super) const MOVEMENT_SILENCE_MS: u32 = 2_000;
/// A sign of life is sent when nothing else was for so long, s.
const BEAT: f64 = 0.15;
/// How often a thread that waits looks whether it should end.
const LOOK: Duration = Duration::from_millis(30);
/// How many notifications of one subscription are kept for whoever asks for them.
const KEPT: usize = 1024;
/// How many subscriptions notifications are kept for.
const HANDLES: usize = 64;

/// Who connects. The password is never printed.
#[derive(Clone, PartialEq, Eq)]
pub struct Login {
    /// The user's name.
    pub user: String,
    /// The password.
    pub password: String,
}

impl std::fmt::Debug for Login {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Login").field("user", &self.user).finish_non_exhaustive()
    }
}

impl Login {
    fn message(&self) -> CreateSessionInfo {
        CreateSessionInfo {
            username: self.user.clone(),
            session_inactivity_timeout: SESSION_SILENCE_MS,
            password: self.password.clone(),
            connection_inactivity_timeout: MOVEMENT_SILENCE_MS,
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Reads a response: a message, or the no it carries.
fn answer<M: Message + Default>(rpc: Rpc, response: &Frame) -> Result<M, LinkError> {
    let header = &response.header;
    if header.error != 0 {
        let refusal = Refusal::read(rpc, (header.error, header.sub_error), &response.payload);
        return Err(LinkError::Refused(refusal));
    }
    M::decode(&response.payload[..])
        .map_err(|error| LinkError::Unreadable { rpc, error: Garbled::Message(error.to_string()) })
}

/// A session over TCP.
pub struct Link {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

struct Shared {
    writing: Mutex<TcpStream>,
    pending: Mutex<BTreeMap<u16, SyncSender<Frame>>>,
    notes: Mutex<BTreeMap<u16, VecDeque<Frame>>>,
    session: AtomicU16,
    next: AtomicU16,
    /// When something was last sent, s.
    sent: Mutex<f64>,
    lost: Mutex<Option<Loss>>,
    is_over: AtomicBool,
    timeout: Duration,
}

impl std::fmt::Debug for Link {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let session = self.shared.session.load(Ordering::SeqCst);
        f.debug_struct("Link").field("session", &session).finish_non_exhaustive()
    }
}

impl Link {
    /// Connects and opens a session; every call waits at most `timeout` for its answer.
    ///
    /// # Errors
    ///
    /// [`LinkError::Connect`], or what the arm says against user and password.
    pub fn open(address: SocketAddr, login: &Login, timeout: Duration) -> Result<Self, LinkError> {
        let failed = |error: std::io::Error| LinkError::Connect {
            address: address.to_string(),
            error: error.to_string(),
        };
        let stream = TcpStream::connect_timeout(&address, timeout).map_err(failed)?;
        stream.set_nodelay(true).map_err(failed)?;
        stream.set_read_timeout(Some(LOOK)).map_err(failed)?;
        stream.set_write_timeout(Some(timeout)).map_err(failed)?;
        let reading = stream.try_clone().map_err(failed)?;
        let now = Wall.now();
        let shared = Arc::new(Shared {
            writing: Mutex::new(stream),
            pending: Mutex::default(),
            notes: Mutex::default(),
            session: AtomicU16::new(0),
            next: AtomicU16::new(1),
            sent: Mutex::new(now),
            lost: Mutex::new(None),
            is_over: AtomicBool::new(false),
            timeout,
        });
        let (listening, living) = (shared.clone(), shared.clone());
        let mut link =
            Self { shared, threads: vec![thread::spawn(move || listening.listen(reading))] };
        let () = link.call(rpc::session::CREATE_SESSION, &login.message())?;
        link.threads.push(thread::spawn(move || living.live()));
        Ok(link)
    }

    /// Calls and waits for the answer.
    ///
    /// # Errors
    ///
    /// Every [`LinkError`] but [`LinkError::Connect`].
    pub fn call<M: Message + Default>(
        &self,
        rpc: Rpc,
        message: &impl Message,
    ) -> Result<M, LinkError> {
        self.call_device(rpc, 0, message)
    }

    /// As [`Self::call`], and waits at most so long.
    ///
    /// # Errors
    ///
    /// As [`Self::call`].
    pub fn call_within<M: Message + Default>(
        &self,
        rpc: Rpc,
        message: &impl Message,
        timeout: Duration,
    ) -> Result<M, LinkError> {
        let timeout = timeout.min(self.shared.timeout);
        answer(rpc, &self.shared.ask(rpc, 0, message.encode_to_vec(), timeout)?)
    }

    /// Asks for a servoing mode.
    ///
    /// # Errors
    ///
    /// As [`Self::call`].
    pub fn set_servoing(&self, mode: ServoingMode) -> Result<(), LinkError> {
        self.set_servoing_within(mode, self.shared.timeout)
    }

    /// As [`Self::set_servoing`], waiting at most `timeout`.
    ///
    /// # Errors
    ///
    /// As [`Self::call`].
    pub fn set_servoing_within(
        &self,
        mode: ServoingMode,
        timeout: Duration,
    ) -> Result<(), LinkError> {
        let asked = ServoingModeInformation { servoing_mode: mode as i32 };
        self.call_within(rpc::base::SET_SERVOING_MODE, &asked, timeout)
    }

    /// As [`Self::call`], to one device behind the base.
    ///
    /// # Errors
    ///
    /// As [`Self::call`].
    pub fn call_device<M: Message + Default>(
        &self,
        rpc: Rpc,
        device: u8,
        message: &impl Message,
    ) -> Result<M, LinkError> {
        let response =
            self.shared.ask(rpc, device, message.encode_to_vec(), self.shared.timeout)?;
        answer(rpc, &response)
    }

    /// Asks to be told a topic; [`Self::notes`] takes the handle this returns.
    ///
    /// # Errors
    ///
    /// As [`Self::call`].
    pub fn subscribe(&self, topic: Rpc) -> Result<u16, LinkError> {
        let handle: NotificationHandle = self.call(topic, &NotificationOptions::default())?;
        Ok(handle.identifier as u16)
    }

    /// Takes what was told under a handle since the last time.
    pub fn notes(&self, handle: u16) -> Vec<Frame> {
        lock(&self.shared.notes)
            .get_mut(&handle)
            .map_or_else(Vec::new, |kept| kept.drain(..).collect())
    }

    /// Returns why the connection is gone, if it is.
    pub fn lost(&self) -> Option<LinkError> {
        lock(&self.shared.lost).clone().map(LinkError::Lost)
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        if self.lost().is_none() && self.shared.session.load(Ordering::SeqCst) != 0 {
            // The arm closes the session by itself if this does not reach it.
            let short = Duration::from_millis(300).min(self.shared.timeout);
            let _ = self.shared.ask(rpc::session::CLOSE_SESSION, 0, Vec::new(), short);
        }
        self.shared.is_over.store(true, Ordering::SeqCst);
        let _ = lock(&self.shared.writing).shutdown(Shutdown::Both);
        for thread in self.threads.drain(..) {
            thread.thread().unpark();
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn ask(
        &self,
        rpc: Rpc,
        device: u8,
        payload: Vec<u8>,
        timeout: Duration,
    ) -> Result<Frame, LinkError> {
        if let Some(why) = lock(&self.lost).clone() {
            return Err(LinkError::Lost(why));
        }
        let (sender, receiver) = sync_channel(1);
        let message = {
            let mut pending = lock(&self.pending);
            let mut message = self.next.fetch_add(1, Ordering::SeqCst);
            while pending.contains_key(&message) {
                message = self.next.fetch_add(1, Ordering::SeqCst);
            }
            pending.insert(message, sender);
            message
        };
        let session = self.session.load(Ordering::SeqCst);
        let sent = Frame::request(rpc, device, session, message, payload).encode_stream();
        let sent = sent.map_err(LinkError::from).and_then(|bytes| {
            let mut stream = lock(&self.writing);
            stream.write_all(&bytes).map_err(|error| self.lose(Loss::System(error.to_string())))?;
            *lock(&self.sent) = Wall.now();
            Ok(())
        });
        let answered = sent.and_then(|()| {
            receiver.recv_timeout(timeout).map_err(|error| match error {
                RecvTimeoutError::Timeout => {
                    LinkError::Silent { rpc, milliseconds: timeout.as_millis() as u64 }
                }
                RecvTimeoutError::Disconnected => {
                    let why = lock(&self.lost).clone();
                    LinkError::Lost(why.unwrap_or(Loss::Closed))
                }
            })
        });
        lock(&self.pending).remove(&message);
        let frame = answered?;
        if frame.header.error == 0 {
            // The arm may change the session's number; the latest response counts.
            self.session.store(frame.header.session, Ordering::SeqCst);
        }
        Ok(frame)
    }

    /// Notes why the connection is gone, and lets everyone go who waits for an answer.
    fn lose(&self, why: Loss) -> LinkError {
        let mut lost = lock(&self.lost);
        let why = lost.get_or_insert(why).clone();
        drop(lost);
        lock(&self.pending).clear();
        LinkError::Lost(why)
    }

    fn listen(&self, mut stream: TcpStream) {
        let mut decoder = Decoder::default();
        let mut buffer = vec![0; 65_536];
        while !self.is_over.load(Ordering::SeqCst) {
            match stream.read(&mut buffer) {
                Ok(0) => {
                    self.lose(Loss::ClosedByArm);
                    return;
                }
                Ok(n) => decoder.push(&buffer[..n]),
                Err(error)
                    if matches!(
                        error.kind(),
                        ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted
                    ) =>
                {
                    continue;
                }
                Err(error) => {
                    self.lose(Loss::System(error.to_string()));
                    return;
                }
            }
            loop {
                match decoder.next_frame() {
                    Ok(Some(frame)) => self.take(frame),
                    Ok(None) => break,
                    Err(error @ (FrameError::Magic(_) | FrameError::TooLong(_))) => {
                        self.lose(Loss::Frame(error));
                        return;
                    }
                    // Whose answer it was cannot be told; its call will say that none came.
                    Err(_) => {}
                }
            }
        }
    }

    fn take(&self, frame: Frame) {
        match frame.header.kind {
            Kind::Response => {
                // An answer nobody waits for any more is passed over.
                if let Some(waiting) = lock(&self.pending).remove(&frame.header.message) {
                    let _ = waiting.try_send(frame);
                }
            }
            Kind::Notification => {
                let mut notes = lock(&self.notes);
                if notes.len() >= HANDLES && !notes.contains_key(&frame.header.message) {
                    return;
                }
                let kept = notes.entry(frame.header.message).or_default();
                if kept.len() == KEPT {
                    kept.pop_front();
                }
                kept.push_back(frame);
            }
            Kind::Request | Kind::Other(_) => {}
        }
    }

    /// Sends signs of life.
    fn live(&self) {
        while !self.is_over.load(Ordering::SeqCst) && lock(&self.lost).is_none() {
            thread::park_timeout(LOOK);
            let quiet = Wall.now() - *lock(&self.sent);
            if quiet < BEAT {
                continue;
            }
            let soon = Duration::from_millis(500).min(self.timeout);
            // An arm that is late with this one is asked again; one that knows no such session is lost.
            let beaten = self.ask(rpc::session::KEEP_ALIVE, 0, Vec::new(), soon);
            if beaten.is_ok_and(|frame| frame.header.sub_error == refusal::INVALID_SESSION) {
                self.lose(Loss::SessionOver);
            }
        }
    }
}
