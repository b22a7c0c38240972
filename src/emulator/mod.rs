//! A Gen3's controller without a Gen3: the Kortex protocol over TCP and UDP, with any arm that can be
//! stepped behind it, by default the laboratory's.
//!
//! People write and test clients against it, their own or the vendor's. It refuses what an arm refuses,
//! notifies in the order an arm does, stops a movement when its commander falls silent, and does on demand
//! what networks and arms do on bad days ([`Faults`]). What it does not know it refuses as not supported,
//! rather than pretend; what is like an arm and what is not is listed in `docs/kortex.md`.
//!
//! `controller` knows no socket and no clock; `server` has both.

mod controller;
mod sessions;
mod topics;
mod base;
mod call;
mod error;
mod store;
mod zones;
mod drive;
mod sequences;
mod services;
mod force;
mod moves;
mod actions;
mod paths;
mod unplanned;
mod cyclic;
mod config;
mod expansion;
mod vision;
mod servo;
mod faults;
mod plant;
mod server;
mod time;
mod pictures;
mod wording;

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, UdpSocket};
use std::sync::Arc;
use std::thread::{self, JoinHandle};

use crate::arm::ticked::Plant;
use crate::kortex::clock::{Clock, Wall};
use crate::motion::robot::Robot;

use controller::Controller;
pub use error::WrongFault;
pub use faults::{Faults, duration};
pub use pictures::Pictures;
pub use plant::Ideal;
pub use server::Pace;
use server::Shared;
pub use time::ArmClock;
pub use wording::FAULTS as FAULT_WORDS;

/// How an emulated controller is reached and how it behaves.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The address it listens on.
    pub address: IpAddr,
    /// TCP port; 0 takes any that is free.
    pub tcp: u16,
    /// UDP port; 0 takes any that is free.
    pub udp: u16,
    /// The one user there is at first.
    pub user: String,
    /// Its password.
    pub password: String,
    /// Soft limits as a share of the hard ones.
    pub soft: f64,
    /// Low-level servoing is left when no command comes for so long, s; infinite where it is not left. The arm's
    /// own time is not published, and the vendor's gripper example needs an arm that stays.
    pub patience: f64,
    /// A connection that has not logged in by then is closed, s.
    pub login: f64,
    /// What goes wrong.
    pub faults: Faults,
    /// How the arm's time runs.
    pub pace: Pace,
    /// The chance of faults.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            address: IpAddr::V4(Ipv4Addr::LOCALHOST),
            tcp: 0,
            udp: 0,
            user: "admin".to_owned(),
            password: "admin".to_owned(),
            soft: 1.0,
            patience: f64::INFINITY,
            login: 5.0,
            faults: Faults::default(),
            pace: Pace::Real,
            seed: 1,
        }
    }
}

/// What goes on inside, for tests of clients and of the emulator itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Status {
    /// TCP connections open now.
    pub connections: usize,
    /// Sessions open now.
    pub sessions: usize,
    /// Sessions ever opened.
    pub opened: u64,
    /// Subscriptions in force.
    pub subscriptions: usize,
    /// Low-level commands taken, of them late ones, and how often the stream starved.
    pub streamed: (u64, u64, u64),
    /// The arm's time, s.
    pub time: f64,
}

/// A controller that runs until it is dropped.
pub struct Emulator {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
    tcp: SocketAddr,
    udp: SocketAddr,
    clock: ArmClock,
}

impl Emulator {
    /// Listens, with this arm behind the wire.
    ///
    /// # Errors
    ///
    /// When a port is taken or may not be used.
    pub fn start(robot: Arc<Robot>, plant: Box<dyn Plant>, options: &Options) -> io::Result<Self> {
        let listener = TcpListener::bind((options.address, options.tcp))?;
        let socket = UdpSocket::bind((options.address, options.udp))?;
        server::prepare(&listener, &socket)?;
        let (tcp, udp) = (listener.local_addr()?, socket.local_addr()?);
        let serial = TcpListener::bind((options.address, 0))?;
        serial.set_nonblocking(true)?;
        let chance = faults::Chance::new(options.faults.clone(), options.seed);
        let login = (options.user.as_str(), options.password.as_str());
        let mut controller = Controller::new(robot, plant, login, chance, Wall.now());
        controller.config.soften(options.soft as f32);
        controller.expansion.port = serial.local_addr()?.port();
        controller.stream = cyclic::Stream::new(options.patience);
        let clock = ArmClock::default();
        let shared = Arc::new(Shared::new(controller, socket, options, clock.clone()));
        let pace = options.pace;
        let [living, accepting, answering, wired] = [(); 4].map(|()| shared.clone());
        let threads = vec![
            thread::spawn(move || server::live(&living, pace)),
            thread::spawn(move || server::accept(&accepting, &listener)),
            thread::spawn(move || server::datagrams(&answering)),
            thread::spawn(move || server::serial(&wired, &serial)),
        ];
        Ok(Self { shared, threads, tcp, udp, clock })
    }

    /// Returns where TCP connections are taken.
    pub fn tcp(&self) -> SocketAddr {
        self.tcp
    }

    /// Returns where datagrams are taken.
    pub fn udp(&self) -> SocketAddr {
        self.udp
    }

    /// Returns the arm's clock: a client that waits on it is right however slow the machine is.
    pub fn clock(&self) -> Arc<dyn Clock> {
        Arc::new(self.clock.clone())
    }

    /// Returns what goes on inside.
    pub fn status(&self) -> Status {
        let connections = self.shared.open_connections();
        let controller = self.shared.controller();
        let stream = &controller.stream;
        Status {
            connections,
            sessions: controller.sessions.count(),
            opened: controller.sessions.opened,
            subscriptions: controller.topics.count(),
            streamed: (stream.taken, stream.late, stream.starved),
            time: controller.servo.time,
        }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        self.shared.end();
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}
