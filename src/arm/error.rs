//! What may go wrong with an arm, a camera or scales, and what would help.

/// What may go wrong with a device.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DeviceError {
    /// A person asked to stop.
    #[error("stopped; the arm holds its position")]
    Stopped,
    /// The arm did not follow.
    #[error("joint {joint} is {error_deg:.1} deg behind its command (limit {limit_deg:.1} deg)")]
    FollowingError {
        /// Joint number from 1.
        joint: usize,
        /// How far behind, degrees.
        error_deg: f64,
        /// The most that is tolerated, degrees.
        limit_deg: f64,
    },
    /// The device cannot be reached or refuses to work.
    #[error("{0}")]
    Unavailable(String),
    /// The device cannot be reached or refuses, and what would help is known.
    #[error("{what}")]
    Refused {
        /// What happened.
        what: String,
        /// What would help.
        help: String,
    },
}

impl DeviceError {
    /// Returns what an arm says that cannot be led.
    pub fn only_follows() -> Self {
        Self::Unavailable("this arm only follows what is planned before".into())
    }

    /// Whether the program stopped the arm by a limit of its own: the arm is there, and holds.
    pub fn is_limit(&self) -> bool {
        matches!(self, Self::FollowingError { .. })
    }

    /// Returns what would help.
    pub fn help(&self) -> &str {
        match self {
            Self::Stopped => "call it again to go on",
            Self::FollowingError { .. } => "see that nothing holds the arm, then try again, slower",
            Self::Unavailable(_) => "see that it is switched on and reached, then try again",
            Self::Refused { help, .. } => help,
        }
    }
}
