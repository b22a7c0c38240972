//! Who is connected, who may command, and who has been silent for too long.
//!
//! The first to command has control; someone else may command once the holder has been silent for 7.5 s
//! (Kinova's user guide, p. 127). A session that sends nothing for its own inactivity time is closed; one
//! that commands a movement and falls silent for its connection's inactivity time has it stopped.

use crate::kortex::messages::base::{FullUserProfile, PasswordChange, UserProfile};
use crate::kortex::messages::common::{Connection, UserProfileHandle};
use crate::kortex::messages::session::CreateSessionInfo;

use super::call::Peer;
use super::error::Refused;

/// After so long without a command someone else may command, s.
const GRACE: f64 = 7.5;
/// What the arm takes when the client leaves a time-out at 0, s.
const SILENCE: f64 = 60.0;
/// How many sessions there may be at once; chosen.
const MOST: usize = 64;

/// One client on one transport.
#[derive(Debug, Clone)]
pub(super) struct Session {
    pub(super) id: u16,
    pub(super) peer: Peer,
    user: u32,
    /// Closed after so long a silence, s.
    silence: f64,
    /// Its movement is stopped after so long a silence, s.
    pause: f64,
    last: f64,
}

/// All sessions, users, and who has control.
#[derive(Debug, Clone)]
pub(super) struct Sessions {
    open: Vec<Session>,
    users: Vec<(UserProfile, String)>,
    next: u16,
    next_user: u32,
    /// Who commanded last, and when, s.
    control: Option<(u16, f64)>,
    /// How many sessions were ever opened.
    pub(super) opened: u64,
}

impl Sessions {
    /// Knows one user.
    pub(super) fn new(user: &str, password: &str) -> Self {
        let mut sessions = Self {
            open: Vec::new(),
            users: Vec::new(),
            next: 1,
            next_user: 1,
            control: None,
            opened: 0,
        };
        let profile = UserProfile { username: user.to_owned(), ..UserProfile::default() };
        let made = sessions.add_user(FullUserProfile {
            user_profile: Some(profile),
            password: password.to_owned(),
        });
        debug_assert!(made.is_ok(), "an empty list takes a user with a name");
        sessions
    }

    /// Opens a session for a peer, in place of the one it may have.
    pub(super) fn create(
        &mut self,
        peer: Peer,
        asked: &CreateSessionInfo,
        now: f64,
    ) -> Result<u16, Refused> {
        let user = self.users.iter().find(|(user, _)| user.username == asked.username);
        let Some((user, password)) = user else {
            return Err(Refused::UserNotFound);
        };
        if *password != asked.password {
            return Err(Refused::WrongPassword);
        }
        let user = user.handle.as_ref().map_or(0, |handle| handle.identifier);
        self.leave(peer);
        if self.open.len() >= MOST {
            return Err(Refused::TooManySessions);
        }
        while self.next == 0 || self.open.iter().any(|session| session.id == self.next) {
            self.next = self.next.wrapping_add(1);
        }
        let id = self.next;
        self.next = self.next.wrapping_add(1);
        let seconds = |milliseconds: u32| match milliseconds {
            0 => SILENCE,
            some => f64::from(some) / 1e3,
        };
        self.open.push(Session {
            id,
            peer,
            user,
            silence: seconds(asked.session_inactivity_timeout),
            pause: seconds(asked.connection_inactivity_timeout),
            last: now,
        });
        self.opened += 1;
        Ok(id)
    }

    /// Notes that a peer spoke in a session and returns it.
    pub(super) fn heard(&mut self, peer: Peer, id: u16, now: f64) -> Result<&Session, Refused> {
        let session = self.open.iter_mut().find(|session| session.id == id && session.peer == peer);
        let session = session.ok_or(Refused::NoSession)?;
        session.last = now;
        Ok(session)
    }

    /// Closes a session; returns whether it had control.
    pub(super) fn close(&mut self, id: u16) -> bool {
        self.open.retain(|session| session.id != id);
        let had = self.control.is_some_and(|(holder, _)| holder == id);
        if had {
            self.control = None;
        }
        had
    }

    /// Closes what a peer that is gone had open; returns those sessions and whether one had control.
    pub(super) fn leave(&mut self, peer: Peer) -> (Vec<u16>, bool) {
        let of = |session: &&Session| session.peer == peer;
        let gone: Vec<u16> = self.open.iter().filter(of).map(|session| session.id).collect();
        let had = gone.iter().filter(|&&id| self.close(id)).count() > 0;
        (gone, had)
    }

    /// Takes control for a session that commands now.
    pub(super) fn take(&mut self, id: u16, is_moving: bool, now: f64) -> Result<(), Refused> {
        if let Some((holder, last)) = self.control
            && holder != id
            && (is_moving || now - last < GRACE)
        {
            return Err(Refused::NotInControl);
        }
        self.control = Some((id, now));
        Ok(())
    }

    /// Notes that the holder of control commanded by another way, as low-level servoing does.
    pub(super) fn keep(&mut self, now: f64) {
        if let Some((_, last)) = &mut self.control {
            *last = now;
        }
    }

    /// Returns who has control.
    pub(super) fn holder(&self) -> Option<&Session> {
        let (holder, _) = self.control?;
        self.open.iter().find(|session| session.id == holder)
    }

    /// Returns whether whoever has control has been silent for too long to be trusted with a movement.
    pub(super) fn is_holder_silent(&self, now: f64) -> bool {
        self.holder().is_none_or(|session| now - session.last > session.pause)
    }

    /// Closes sessions that have been silent for too long and returns them.
    pub(super) fn expire(&mut self, now: f64) -> Vec<u16> {
        let over = |session: &&Session| now - session.last > session.silence;
        let gone: Vec<u16> = self.open.iter().filter(over).map(|session| session.id).collect();
        for &id in &gone {
            self.close(id);
        }
        gone
    }

    /// Returns the numbers of all open sessions.
    pub(super) fn ids(&self) -> Vec<u16> {
        self.open.iter().map(|session| session.id).collect()
    }

    /// Returns whether a peer has a session.
    pub(super) fn has(&self, peer: Peer) -> bool {
        self.open.iter().any(|session| session.peer == peer)
    }

    /// Returns how many sessions are open.
    pub(super) fn count(&self) -> usize {
        self.open.len()
    }

    /// Returns the session with a number.
    pub(super) fn find(&self, id: u16) -> Option<&Session> {
        self.open.iter().find(|session| session.id == id)
    }

    /// Returns the sessions as `Session.GetConnections` tells them.
    pub(super) fn connections(&self) -> Vec<Connection> {
        self.open.iter().map(Session::connection).collect()
    }

    /// Adds a user and returns its handle.
    pub(super) fn add_user(
        &mut self,
        asked: FullUserProfile,
    ) -> Result<UserProfileHandle, Refused> {
        let mut profile = asked.user_profile.unwrap_or_default();
        if profile.username.is_empty() {
            return Err(Refused::NoUserName);
        }
        if self.users.iter().any(|(user, _)| user.username == profile.username) {
            return Err(Refused::UserNameTaken);
        }
        let handle = UserProfileHandle { identifier: self.next_user, permission: 7 };
        self.next_user += 1;
        profile.handle = Some(handle.clone());
        self.users.push((profile, asked.password));
        Ok(handle)
    }

    /// Returns a user, without the password.
    pub(super) fn user(&self, handle: &UserProfileHandle) -> Result<&UserProfile, Refused> {
        Ok(&self.users[self.user_at(Some(handle))?].0)
    }

    /// Changes what is known of a user; the name stays unique.
    pub(super) fn change_user(&mut self, asked: UserProfile) -> Result<UserProfileHandle, Refused> {
        let at = self.user_at(asked.handle.as_ref())?;
        if asked.username.is_empty() {
            return Err(Refused::NoUserName);
        }
        let is_taken = |(i, (user, _)): (usize, &(UserProfile, String))| {
            i != at && user.username == asked.username
        };
        if self.users.iter().enumerate().any(is_taken) {
            return Err(Refused::UserNameTaken);
        }
        let handle = self.users[at].0.handle.clone();
        self.users[at].0 = UserProfile { handle: handle.clone(), ..asked };
        Ok(handle.unwrap_or_default())
    }

    /// Changes a password for who knows the old one.
    pub(super) fn change_password(&mut self, asked: &PasswordChange) -> Result<(), Refused> {
        let at = self.user_at(asked.handle.as_ref())?;
        let (_, password) = &mut self.users[at];
        if *password != asked.old_password {
            return Err(Refused::OldPasswordWrong);
        }
        if *password == asked.new_password {
            return Err(Refused::PasswordNotChanged);
        }
        password.clone_from(&asked.new_password);
        Ok(())
    }

    fn user_at(&self, handle: Option<&UserProfileHandle>) -> Result<usize, Refused> {
        let is = |(user, _): &(UserProfile, String)| {
            let own = user.handle.as_ref().map(|own| own.identifier);
            own.is_some() && own == handle.map(|handle| handle.identifier)
        };
        let found = self.users.iter().position(is);
        found.ok_or(Refused::NoUserProfile)
    }

    /// Removes a user.
    pub(super) fn remove_user(&mut self, handle: &UserProfileHandle) -> Result<(), Refused> {
        let at = self.user_at(Some(handle))?;
        self.users.remove(at);
        Ok(())
    }

    /// Returns all users, without their passwords.
    pub(super) fn users(&self) -> Vec<UserProfile> {
        self.users.iter().map(|(user, _)| user.clone()).collect()
    }
}

impl Session {
    /// Returns who this is, as the arm tells others.
    pub(super) fn connection(&self) -> Connection {
        Connection {
            user_handle: Some(self.user_handle()),
            connection_information: self.peer.to_string(),
            connection_identifier: u32::from(self.id),
        }
    }

    /// Returns the handle of its user.
    pub(super) fn user_handle(&self) -> UserProfileHandle {
        UserProfileHandle { identifier: self.user, permission: 7 }
    }
}
