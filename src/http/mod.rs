//! HTTP, both halves: a server of a few hundred lines for the page and the emulated cell's camera, and a
//! client for cameras, scales and models at web addresses.

mod client;
mod server;

pub use client::{Address, Answer, Client, Limits, Trouble};
pub use server::{Handler, Request, Response, Server, encoded};
