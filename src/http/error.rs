//! Why nothing came back, and why a request is not answered.

use super::Address;

/// Why nothing came back.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Trouble {
    /// Nobody answers at the address.
    #[error("no answer: {0}")]
    Unreachable(#[from] Unreachable),
    /// Somebody took longer than this, s.
    #[error("no answer within {0} s")]
    Late(f64),
    /// What came is no answer.
    #[error("the answer cannot be read: {0}")]
    Broken(#[from] Broken),
}

/// Why nobody answers.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Unreachable {
    /// It took longer than this to connect, s.
    #[error("no connection within {0} s")]
    Slow(f64),
    /// The name means no machine.
    #[error("there is no such host")]
    NoHost,
    /// The connection broke off before it was one.
    #[error("the connection failed")]
    Failed,
    /// What the system says.
    #[error("{0}")]
    System(String),
    /// The program was built without a client.
    #[error("this build has no web client; build it with `--features web`")]
    NotBuilt,
}

/// Why what came is no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Broken {
    /// It has more bytes than are read.
    #[error("it is longer than {0} bytes")]
    TooLong(u64),
    /// It says that something is wrong.
    #[error("{address} answers with status {status}")]
    Status {
        /// Who says so.
        address: Address,
        /// 200 would be good.
        status: u16,
    },
    /// It is no JSON where JSON was asked for.
    #[error("{0} does not answer with JSON")]
    NotJson(Address),
    /// It is no HTTP.
    #[error("{0}")]
    Garbled(String),
}

/// Not a web address.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not http://HOST[:PORT]/PATH")]
pub struct NoAddress(pub String);

/// Why a request is not answered.
#[cfg(feature = "server")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(super) enum Refusal {
    #[error("only GET, HEAD and POST are answered")]
    Method,
    #[error("the path cannot be read")]
    Path,
    #[error("a header that may stand once stands twice")]
    HeaderTwice,
    #[error("the body of the request is too long")]
    BodyTooLong,
    #[error("the request is cut short")]
    CutShort,
    #[error("the body of the request came too slowly")]
    BodyTooSlow,
    #[error("too many requests at once; try again")]
    TooMany,
    /// The handler failed.
    #[error("this could not be answered")]
    Failed,
}

#[cfg(feature = "server")]
impl Refusal {
    /// Returns the status that says so.
    pub(super) fn status(self) -> u16 {
        match self {
            Self::Path | Self::HeaderTwice | Self::CutShort => 400,
            Self::Method => 405,
            Self::BodyTooSlow => 408,
            Self::BodyTooLong => 413,
            Self::Failed => 500,
            Self::TooMany => 503,
        }
    }
}
