//! A session over UDP, which the 1 kHz cycle needs: one call at a time, and what comes late is passed over.
//!
//! It is waited for with `ppoll`, whose time-out is in nanoseconds. A socket's own time-out is rounded up to the
//! kernel's ticks, of which there are 100 to 1000 a second: with it a beat of 1 ms came out as one of 4 to 16 ms.

use std::io::ErrorKind;
use std::net::{SocketAddr, UdpSocket};
use std::time::Duration;

use prost::Message;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

use super::super::clock::{Clock, Wall};
use super::super::frame::{Frame, Kind};
use super::super::rpc::{self, Rpc};
use super::{LinkError, Login, Loss, answer};

/// A session over UDP, one call at a time.
#[derive(Debug)]
pub struct Datagrams {
    socket: UdpSocket,
    session: u16,
    next: u16,
    buffer: Vec<u8>,
}

impl Datagrams {
    /// Opens a session; it is asked for a few times, since datagrams get lost.
    ///
    /// # Errors
    ///
    /// As [`super::Link::open`].
    pub fn open(address: SocketAddr, login: &Login) -> Result<Self, LinkError> {
        let failed = |error: std::io::Error| LinkError::Connect {
            address: format!("{address} (UDP)"),
            error: error.to_string(),
        };
        let any: SocketAddr = match address {
            SocketAddr::V4(_) => ([0, 0, 0, 0], 0).into(),
            SocketAddr::V6(_) => ([0_u16; 8], 0).into(),
        };
        let socket = UdpSocket::bind(any).map_err(failed)?;
        socket.connect(address).map_err(failed)?;
        socket.set_nonblocking(true).map_err(failed)?;
        let mut link = Self { socket, session: 0, next: 1, buffer: vec![0; 65_536] };
        let mut last = None;
        for _ in 0..5 {
            let soon = Duration::from_millis(400);
            match link.call::<()>(rpc::session::CREATE_SESSION, &login.message(), soon) {
                Ok(()) => return Ok(link),
                Err(error @ LinkError::Silent { .. }) => last = Some(error),
                Err(error) => return Err(error),
            }
        }
        Err(last.unwrap_or(LinkError::Lost(Loss::NeverOpen)))
    }

    /// Calls and waits at most `timeout` for the answer; late answers to earlier calls are passed over.
    ///
    /// # Errors
    ///
    /// As [`super::Link::call`].
    pub fn call<M: Message + Default>(
        &mut self,
        rpc: Rpc,
        message: &impl Message,
        timeout: Duration,
    ) -> Result<M, LinkError> {
        let number = self.send(rpc, message)?;
        let until = Wall.now() + timeout.as_secs_f64();
        loop {
            let left = until - Wall.now();
            if left <= 0.0 {
                let milliseconds = timeout.as_millis() as u64;
                return Err(LinkError::Silent { rpc, milliseconds });
            }
            // What is no frame, and a word that nobody listens, is no answer either.
            let Some(frame) = self.receive(Duration::from_secs_f64(left))? else { continue };
            if frame.header.kind == Kind::Response && frame.header.message == number {
                if frame.header.error == 0 {
                    self.session = frame.header.session;
                }
                return answer(rpc, &frame);
            }
        }
    }

    /// Sends a call without waiting and returns the number its answer will have.
    ///
    /// # Errors
    ///
    /// [`LinkError::Lost`], [`LinkError::Frame`].
    pub fn send(&mut self, rpc: Rpc, message: &impl Message) -> Result<u16, LinkError> {
        let number = self.next;
        self.next = self.next.wrapping_add(1);
        let frame = Frame::request(rpc, 0, self.session, number, message.encode_to_vec());
        match self.socket.send(&frame.encode()?) {
            Ok(_) => Ok(number),
            // Nobody listens there now; that shows when no answer comes.
            // A full buffer is a datagram lost.
            Err(error)
                if matches!(error.kind(), ErrorKind::ConnectionRefused | ErrorKind::WouldBlock) =>
            {
                Ok(number)
            }
            Err(error) => Err(LinkError::Lost(Loss::System(error.to_string()))),
        }
    }

    /// Returns the next frame that comes within `timeout`.
    ///
    /// # Errors
    ///
    /// [`LinkError::Lost`].
    pub fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>, LinkError> {
        if let Some(n) = self.received()? {
            return Ok(Frame::decode(&self.buffer[..n]).ok());
        }
        if timeout.is_zero() {
            return Ok(None);
        }
        let time = Timespec::try_from(timeout).map_err(|_| LinkError::Lost(Loss::Endless))?;
        match poll(&mut [PollFd::new(&self.socket, PollFlags::IN)], Some(&time)) {
            Ok(_) | Err(Errno::INTR) => {}
            Err(error) => return Err(LinkError::Lost(Loss::System(error.to_string()))),
        }
        Ok(self.received()?.and_then(|n| Frame::decode(&self.buffer[..n]).ok()))
    }

    /// Reads what has come already: how many bytes of the buffer it fills.
    fn received(&mut self) -> Result<Option<usize>, LinkError> {
        match self.socket.recv(&mut self.buffer) {
            Ok(n) => Ok(Some(n)),
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::WouldBlock | ErrorKind::Interrupted | ErrorKind::ConnectionRefused
                ) =>
            {
                Ok(None)
            }
            Err(error) => Err(LinkError::Lost(Loss::System(error.to_string()))),
        }
    }
}

impl Drop for Datagrams {
    fn drop(&mut self) {
        let _ = self.send(rpc::session::CLOSE_SESSION, &());
    }
}
