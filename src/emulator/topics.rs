//! What the arm tells of its own accord, and to whom.
//!
//! A handle is given once and never again as long as the program runs, short of sixteen bits of them: the
//! vendor's client hangs on a notification for a handle it has let go.

use prost::Message;

use crate::kortex::frame::{Frame, Header, Kind};
use crate::kortex::rpc::Rpc;

use super::call::Peer;
use super::error::Refused;

/// One topic told to one session.
#[derive(Debug, Clone, Copy)]
struct Subscription {
    handle: u16,
    session: u16,
    peer: Peer,
    topic: Rpc,
}

/// Who wants to be told what, and what has not been sent yet.
#[derive(Debug, Clone, Default)]
pub(super) struct Topics {
    subscriptions: Vec<Subscription>,
    last: u16,
    outbox: Vec<(Peer, Frame)>,
}

impl Topics {
    /// Returns a new handle under which `topic` is told.
    pub(super) fn subscribe(&mut self, session: u16, peer: Peer, topic: Rpc) -> u32 {
        self.last = self.last.checked_add(1).unwrap_or(1);
        self.subscriptions.push(Subscription { handle: self.last, session, peer, topic });
        u32::from(self.last)
    }

    /// Ends a subscription of a session.
    pub(super) fn unsubscribe(&mut self, session: u16, handle: u32) -> Result<(), Refused> {
        let before = self.subscriptions.len();
        self.subscriptions.retain(|s| u32::from(s.handle) != handle || s.session != session);
        if self.subscriptions.len() == before {
            return Err(Refused::NoSubscription);
        }
        Ok(())
    }

    /// Ends all subscriptions of a session.
    pub(super) fn forget(&mut self, session: u16) {
        self.subscriptions.retain(|subscription| subscription.session != session);
    }

    /// Tells everyone who wants to know.
    pub(super) fn tell(&mut self, topic: Rpc, message: &impl Message) {
        let payload = message.encode_to_vec();
        for to in self.subscriptions.iter().filter(|subscription| subscription.topic == topic) {
            let header = Header {
                kind: Kind::Notification,
                device: 0,
                error: 0,
                sub_error: 0,
                session: to.session,
                message: to.handle,
                service: topic.service,
                function: topic.function,
            };
            self.outbox.push((to.peer, Frame { header, payload: payload.clone() }));
        }
    }

    /// Takes what has not been sent yet.
    pub(super) fn take(&mut self) -> Vec<(Peer, Frame)> {
        std::mem::take(&mut self.outbox)
    }

    /// Returns how many subscriptions there are.
    pub(super) fn count(&self) -> usize {
        self.subscriptions.len()
    }
}
