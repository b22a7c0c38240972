//! The client of a program that was built without one (feature `web`): each request is refused, and the refusal
//! says why.

use super::error::{Trouble, Unreachable};
use super::{Address, Answer, Limits};

/// Asks nobody.
#[derive(Debug, Clone)]
pub struct Client;

impl Client {
    /// The limits and the address are of no use here.
    pub fn new(_: Limits, _: &Address) -> Self {
        Self
    }

    /// Fetches nothing.
    ///
    /// # Errors
    ///
    /// Always [`Unreachable::NotBuilt`].
    pub fn get(&self, _: &Address, _: Option<&str>) -> Result<Answer, Trouble> {
        Err(Unreachable::NotBuilt.into())
    }

    /// Sends nothing.
    ///
    /// # Errors
    ///
    /// Always [`Unreachable::NotBuilt`].
    pub fn post(&self, _: &Address, _: &str, _: &str) -> Result<Answer, Trouble> {
        Err(Unreachable::NotBuilt.into())
    }
}
