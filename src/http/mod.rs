//! HTTP, both halves: a server for the page and the emulated cell's camera (feature `server`), and a client for
//! cameras, scales and models at web addresses (feature `web`).

mod address;
#[cfg(feature = "web")]
mod client;
#[cfg(not(feature = "web"))]
#[path = "absent.rs"]
mod client;
mod error;
#[cfg(feature = "server")]
mod message;
#[cfg(feature = "server")]
mod server;

pub use address::Address;
pub use client::Client;
pub use error::{Broken, NoAddress, Trouble, Unreachable};
#[cfg(feature = "server")]
pub use message::{Request, Response, encoded};
#[cfg(feature = "server")]
pub use server::{Handler, Server};

/// How long is waited and how much is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// For a connection, s.
    pub connect_s: f64,
    /// For everything: sending, waiting and reading, s.
    pub reply_s: f64,
    /// The longest answer that is read, bytes.
    pub longest: u64,
}

/// What came back, whatever its status.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    /// 200 is good.
    pub status: u16,
    /// All of it.
    pub body: Vec<u8>,
}
