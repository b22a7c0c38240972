//! Sockets and threads around the controller: one thread lets the arm move, one reads datagrams, one takes
//! connections, two serve each of them.
//!
//! What is sent is queued while the controller is held, so an answer is always before what it sets off. A
//! client that does not read what it is sent is cut off.

use std::collections::BTreeMap;
use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::kortex::clock::{Clock, Wall};
use crate::kortex::frame::{Decoder, Frame, FrameError};
use crate::kortex::messages::base::ServoingMode;

use super::Options;
use super::call::Peer;
use super::controller::{Controller, answer_unread};
use super::faults::Faults;
use super::servo::TICK;
use super::time::ArmClock;

/// How often a thread that waits for a client looks whether it should end.
const LOOK: Duration = Duration::from_millis(50);
/// How many frames may wait for a client to read them.
const QUEUE: usize = 4096;
/// How many connections there may be at once.
const CONNECTIONS: usize = 64;
/// How much a connection may send before it has logged in, bytes.
const STRANGE: usize = 64 << 10;
/// The arm's time may fall so far behind the wall's before the difference is forgotten, s.
const LAG: f64 = 0.05;

/// How long an emulated arm takes to start again, s; a real one takes most of a minute.
const BOOT: f64 = 2.0;

/// How the arm's time runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// With the wall's, or slower where the machine is.
    Real,
    /// As fast as the machine can, up to twenty times the wall's, while something moves or someone waits on
    /// the arm's clock; else as [`Self::Real`].
    Eager,
}

/// How many times as fast as the wall's an eager arm's time runs: faster, and what a client does in between
/// would take the arm seconds.
const EAGER: f64 = 20.0;

/// Bytes and when they may be sent, s.
type Queued = (f64, Vec<u8>);

/// What all threads share.
pub(super) struct Shared {
    controller: Mutex<Controller>,
    /// How many threads want the controller: the arm lets them go first.
    wanting: AtomicUsize,
    writers: Mutex<BTreeMap<u64, (SyncSender<Queued>, TcpStream)>>,
    udp: UdpSocket,
    is_over: AtomicBool,
    connections: AtomicU64,
    faults: Faults,
    /// A connection that has not logged in by then is closed, s.
    login: f64,
    begun: f64,
    /// The arm starts anew and answers nobody until then, s.
    away: Mutex<f64>,
    clock: ArmClock,
}

impl Shared {
    pub(super) fn new(
        controller: Controller,
        udp: UdpSocket,
        options: &Options,
        clock: ArmClock,
    ) -> Self {
        Self {
            controller: Mutex::new(controller),
            wanting: AtomicUsize::new(0),
            writers: Mutex::default(),
            udp,
            is_over: AtomicBool::new(false),
            connections: AtomicU64::new(0),
            faults: options.faults.clone(),
            login: options.login,
            begun: Wall.now(),
            away: Mutex::new(0.0),
            clock,
        }
    }

    /// Takes the controller, before the arm's next tick.
    pub(super) fn controller(&self) -> MutexGuard<'_, Controller> {
        self.wanting.fetch_add(1, Ordering::SeqCst);
        let controller = self.controller.lock().unwrap_or_else(PoisonError::into_inner);
        self.wanting.fetch_sub(1, Ordering::SeqCst);
        controller
    }

    /// Returns how many TCP connections are open.
    pub(super) fn open_connections(&self) -> usize {
        self.writers.lock().unwrap_or_else(PoisonError::into_inner).len()
    }

    /// Ends everything.
    pub(super) fn end(&self) {
        self.is_over.store(true, Ordering::SeqCst);
        self.clock.end();
        for (_, stream) in self.writers.lock().unwrap_or_else(PoisonError::into_inner).values() {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    /// Returns whether everything is to end.
    pub(super) fn is_over(&self) -> bool {
        self.is_over.load(Ordering::SeqCst)
    }

    /// Returns whether the arm is starting anew.
    fn is_away(&self) -> bool {
        Wall.now() < *self.away.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns whether the controller is struck dumb now.
    fn is_stalled(&self) -> bool {
        let since = Wall.now() - self.begun - self.faults.stall_at;
        (0.0..self.faults.stall).contains(&since)
    }

    /// Lets the controller answer what was heard and sends whatever it has to say.
    fn handle(&self, peer: Peer, heard: &Result<Frame, FrameError>) {
        let now = Wall.now();
        let mut controller = self.controller();
        let answer = match heard {
            Ok(frame) => controller.answer(peer, frame, now),
            Err(error) => answer_unread(error),
        };
        if let Some(answer) = answer {
            self.send(&mut controller, peer, &answer);
        }
        self.send_notifications(&mut controller);
        if std::mem::take(&mut controller.is_rebooting) {
            *self.away.lock().unwrap_or_else(PoisonError::into_inner) = now + BOOT;
        }
    }

    fn send_notifications(&self, controller: &mut Controller) {
        for (peer, frame) in controller.topics.take() {
            self.send(controller, peer, &frame);
        }
    }

    fn send(&self, controller: &mut Controller, peer: Peer, frame: &Frame) {
        match peer {
            Peer::Udp(to) => {
                if controller.chance.drops() {
                    return;
                }
                if let Ok(bytes) = frame.encode() {
                    // A datagram that cannot be sent is a datagram lost.
                    let _ = self.udp.send_to(&bytes, to);
                }
            }
            Peer::Tcp(id, _) => {
                let Ok(bytes) = frame.encode_stream() else { return };
                let due = Wall.now() + self.faults.delay.as_secs_f64();
                let writers = self.writers.lock().unwrap_or_else(PoisonError::into_inner);
                if let Some((queue, stream)) = writers.get(&id)
                    && queue.try_send((due, bytes)).is_err()
                {
                    let _ = stream.shutdown(Shutdown::Both);
                }
            }
        }
    }
}

/// Lets the arm move.
pub(super) fn live(shared: &Shared, pace: Pace) {
    let mut ahead_of = Wall.now();
    while !shared.is_over() {
        let (is_busy, time) = {
            while shared.wanting.load(Ordering::SeqCst) > 0 {
                thread::sleep(Duration::from_micros(20));
            }
            let mut controller = shared.controller.lock().unwrap_or_else(PoisonError::into_inner);
            controller.tick(Wall.now());
            shared.send_notifications(&mut controller);
            // A stream of positions comes with the wall's time.
            let is_busy = controller.servo.is_busy() && controller.mode != ServoingMode::LowLevel;
            (is_busy, controller.servo.time)
        };
        shared.clock.set(time);
        let now = Wall.now();
        let is_eager = pace == Pace::Eager && (is_busy || shared.clock.is_awaited());
        ahead_of += if is_eager { TICK / EAGER } else { TICK };
        if ahead_of > now {
            thread::sleep(Duration::from_secs_f64(ahead_of - now));
        } else if now - ahead_of > LAG {
            ahead_of = now;
        }
    }
}

/// Takes connections.
pub(super) fn accept(shared: &Arc<Shared>, listener: &TcpListener) {
    let mut serving: Vec<JoinHandle<()>> = Vec::new();
    while !shared.is_over() {
        match listener.accept() {
            Ok((stream, from)) if shared.open_connections() < CONNECTIONS && !shared.is_away() => {
                let shared = shared.clone();
                serving.push(thread::spawn(move || serve(&shared, stream, from)));
            }
            // One too many, or nobody is at home: the connection is closed as it is dropped.
            Ok(_) => {}
            Err(error) if error.kind() == ErrorKind::WouldBlock => {
                thread::sleep(Duration::from_millis(5));
            }
            Err(_) => thread::sleep(LOOK),
        }
        serving.retain(|thread| !thread.is_finished());
    }
    for thread in serving {
        let _ = thread.join();
    }
}

/// Serves one connection to its end.
fn serve(shared: &Arc<Shared>, stream: TcpStream, from: SocketAddr) {
    let id = shared.connections.fetch_add(1, Ordering::SeqCst);
    let ready = stream
        .set_nonblocking(false)
        .and_then(|()| stream.set_nodelay(true))
        .and_then(|()| stream.set_read_timeout(Some(LOOK)))
        .and_then(|()| stream.set_write_timeout(Some(Duration::from_secs(2))));
    let (Ok(()), Ok(writing), Ok(closing)) = (ready, stream.try_clone(), stream.try_clone()) else {
        return;
    };
    let (queue, queued) = sync_channel(QUEUE);
    let writer = thread::spawn(move || write(writing, &queued));
    let peer = Peer::Tcp(id, from);
    shared.writers.lock().unwrap_or_else(PoisonError::into_inner).insert(id, (queue, closing));
    listen(shared, stream, peer);
    // The queue ends with its sender, the writer with the queue.
    let gone = shared.writers.lock().unwrap_or_else(PoisonError::into_inner).remove(&id);
    if let Some((queue, stream)) = gone {
        drop(queue);
        {
            let mut controller = shared.controller();
            controller.peer_left(peer);
            shared.send_notifications(&mut controller);
        }
        // What was answered already is sent before the connection ends.
        let _ = writer.join();
        let _ = stream.shutdown(Shutdown::Both);
    }
}

/// Reads frames until the connection ends.
fn listen(shared: &Shared, mut stream: TcpStream, peer: Peer) {
    let opened = Wall.now();
    let mut decoder = Decoder::default();
    let mut buffer = vec![0; 65_536];
    // Who has not said a password yet is neither waited for nor listened to for long.
    let (mut is_known, mut strange) = (false, 0);
    while !shared.is_over() {
        match stream.read(&mut buffer) {
            Ok(0) => return,
            Ok(n) => {
                strange += n;
                decoder.push(&buffer[..n]);
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(_) => return,
        }
        if shared.is_away() {
            return;
        }
        if shared.faults.cut.is_some_and(|cut| Wall.now() - opened > cut) {
            return;
        }
        loop {
            while shared.is_stalled() && !shared.is_over() {
                thread::sleep(Duration::from_millis(5));
            }
            match decoder.next_frame().transpose() {
                None => break,
                Some(Err(FrameError::Magic(_) | FrameError::TooLong(_))) => return,
                Some(heard) => shared.handle(peer, &heard),
            }
            is_known = is_known || shared.controller().sessions.has(peer);
            if !is_known && strange > STRANGE {
                return;
            }
        }
        if !is_known && (strange > STRANGE || Wall.now() - opened > shared.login) {
            return;
        }
    }
}

fn write(mut stream: TcpStream, queued: &Receiver<Queued>) {
    while let Ok((due, bytes)) = queued.recv() {
        Wall.sleep(due - Wall.now());
        if stream.write_all(&bytes).is_err() {
            let _ = stream.shutdown(Shutdown::Both);
            return;
        }
    }
}

/// Answers datagrams.
pub(super) fn datagrams(shared: &Shared) {
    let mut buffer = vec![0; 65_536];
    while !shared.is_over() {
        let Ok((n, from)) = shared.udp.recv_from(&mut buffer) else { continue };
        let heard = Frame::decode(&buffer[..n]);
        if shared.is_away() || shared.is_stalled() || shared.controller().chance.drops() {
            continue;
        }
        shared.handle(Peer::Udp(from), &heard);
    }
}

/// Makes the sockets ready for the threads above.
pub(super) fn prepare(listener: &TcpListener, udp: &UdpSocket) -> std::io::Result<()> {
    listener.set_nonblocking(true)?;
    udp.set_read_timeout(Some(LOOK))
}

/// Sends back what comes to the serial port, one client at a time, while a bridge leads to it.
pub(super) fn serial(shared: &Shared, listener: &TcpListener) {
    while !shared.is_over() {
        match listener.accept() {
            Ok((stream, _)) if shared.controller().expansion.is_bridged() => echo(shared, stream),
            Ok(_) => {}
            Err(_) => thread::sleep(LOOK),
        }
    }
}

fn echo(shared: &Shared, mut stream: TcpStream) {
    let ready = stream
        .set_nonblocking(false)
        .and_then(|()| stream.set_read_timeout(Some(LOOK)))
        .and_then(|()| stream.set_write_timeout(Some(Duration::from_secs(2))));
    let mut buffer = [0; 1024];
    while ready.is_ok() && !shared.is_over() && shared.controller().expansion.is_bridged() {
        match stream.read(&mut buffer) {
            Ok(0) => return,
            Ok(n) if stream.write_all(&buffer[..n]).is_err() => return,
            Ok(_) => {}
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted
                ) => {}
            Err(_) => return,
        }
    }
}
