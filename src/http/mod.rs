//! HTTP, both halves: a server for the page and the emulated cell's camera, and a
//! client for cameras, scales and models at web addresses.

mod client;
mod error;
mod message;
mod server;

pub use client::{Address, Answer, Client, Limits};
pub use error::{Broken, NoAddress, Trouble, Unreachable};
pub use message::{Request, Response, encoded};
pub use server::{Handler, Server};
