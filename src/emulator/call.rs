//! One call on the wire: who asks, and what a service answers.

use std::net::SocketAddr;

use prost::Message;

use crate::kortex::rpc::Rpc;

use super::error::Refused;

/// A client as the network knows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Peer {
    /// A TCP connection, by its number, and where it came from.
    Tcp(u64, SocketAddr),
    /// Whoever sends datagrams from there.
    Udp(SocketAddr),
}

impl std::fmt::Display for Peer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Tcp(_, from) => write!(f, "TCP {from}"),
            Self::Udp(from) => write!(f, "UDP {from}"),
        }
    }
}

/// What a service says: a serialised message or a no.
pub(super) type Answer = Result<Vec<u8>, Refused>;

/// Says a message.
#[expect(clippy::unnecessary_wraps, reason = "the last word of every service")]
pub(super) fn say(message: &impl Message) -> Answer {
    Ok(message.encode_to_vec())
}

/// Says that it is done.
#[expect(clippy::unnecessary_wraps, reason = "the last word of every service")]
pub(super) fn done() -> Answer {
    Ok(Vec::new())
}

/// Reads what a call carries.
pub(super) fn read<M: Message + Default>(payload: &[u8]) -> Result<M, Refused> {
    M::decode(payload).map_err(|error| Refused::Garbled(error.to_string()))
}

/// Who asks what, and when.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ask<'a> {
    pub(super) rpc: Rpc,
    pub(super) peer: Peer,
    pub(super) session: u16,
    pub(super) device: u8,
    pub(super) payload: &'a [u8],
    /// When it came, s.
    pub(super) now: f64,
}

impl Ask<'_> {
    /// Reads what the call carries.
    pub(super) fn read<M: Message + Default>(&self) -> Result<M, Refused> {
        read(self.payload)
    }
}

/// Why the arm is in fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fault {
    /// Someone pressed, or called, the emergency stop.
    EmergencyStop,
    /// This joint (from 0) did not follow its command.
    Following(usize),
    /// This joint (from 0) was led over a limit, and its bit for that.
    Limit(usize, u32),
    /// Something else, planted or real.
    Other,
}
