//! The teaching page: stored runs and a run that is stepped or looked at now, in a browser on this machine.
//!
//! The page is a client, never a second brain. Everything it shows is worded by [`crate::report`] and read
//! from run folders; everything it is told is a word for the conductor of the live run, or an answer kept
//! beside what geometry said. It reads without scripts; with them, one slider goes through the steps and
//! single keys answer.
//!
//! It listens on 127.0.0.1 alone and answers only its own page ([`crate::http::Request::is_local`]). No
//! text of a request ever becomes a path: a run is looked up among the folders there are, and a picture is
//! named by a number and two words.

mod options;
mod api;
mod answering;
mod frame;
mod live;
mod overview;
mod quiz;
mod run_index;
mod routes;
mod screen;
mod site;
mod step;
mod stepping;
mod watching;

use std::io;
use std::net::Ipv4Addr;
use std::sync::Arc;

use crate::http::Server;

pub use live::{Lead, Live, Watch, Wish};
pub use options::{Options, Place};
pub use screen::{Onlooker, Screen};
use site::{Shown, Site};

/// A page that is served until it is dropped.
pub struct Page {
    server: Server,
}

impl Page {
    /// Serves runs, and the run that `live` speaks of, if any.
    ///
    /// # Errors
    ///
    /// When the port is taken.
    pub fn open(options: Options, live: Option<Arc<Live>>) -> io::Result<Self> {
        Self::serve(options, Shown { live, screen: None })
    }

    /// Serves runs, and a run to look at while it goes on.
    ///
    /// # Errors
    ///
    /// When the port is taken.
    pub fn watch(options: Options, screen: Arc<Screen>) -> io::Result<Self> {
        Self::serve(options, Shown { live: None, screen: Some(screen) })
    }

    fn serve(options: Options, shown: Shown) -> io::Result<Self> {
        let port = options.port;
        let site = Site::new(options, shown);
        let handler = move |request: &crate::http::Request| site.answer(request);
        let server = Server::serve((Ipv4Addr::LOCALHOST, port).into(), Arc::new(handler))?;
        Ok(Self { server })
    }

    /// Returns its address: `http://127.0.0.1:40123/`.
    pub fn address(&self) -> String {
        format!("http://{}/", self.server.address())
    }
}
