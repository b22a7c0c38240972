//! Why there is no answer to read.

use crate::http::Trouble;

use super::Said;

/// Why a question, or a sentence, was not answered.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Unanswered {
    /// Nobody waits for the answer any more.
    #[error("stopped by a person")]
    Stopped,
    /// It was not asked: the time for all questions, s, is over.
    #[error("not asked: {0} s are over")]
    NotAsked(f64),
    /// The thread that asked is gone.
    #[error("the request broke off")]
    BrokeOff,
    /// Nothing came back.
    #[error("{0}")]
    Trouble(#[from] Trouble),
    /// What came back is no answer.
    #[error("{0}")]
    Unread(#[from] Unread),
}

/// Why what came back is no answer. Excerpts are on one line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Unread {
    /// The server says that something is wrong.
    #[error("status {status}: {told}")]
    Status {
        /// 200 would be good.
        status: u16,
        /// What the server says about it.
        told: String,
    },
    /// What the server sent is no JSON; how it begins.
    #[error("not JSON, it begins `{0}`")]
    NoJson(String),
    /// The model refuses, and says so.
    #[error("refused: {0}")]
    Refused(String),
    /// There is no message in what the server sent.
    #[error("no choice in the reply")]
    NoChoice,
    /// The message is empty.
    #[error("empty")]
    Empty,
    /// The message is empty because the model thought for too long.
    #[error("empty: the model used up its tokens first")]
    UsedUp,
    /// The document ends before its end.
    #[error("JSON cut short")]
    CutShort,
    /// The document is none.
    #[error("not JSON: {0}")]
    Malformed(String),
    /// The document does not answer.
    #[error("JSON without an answer")]
    NoAnswer,
    /// The document answers with another word.
    #[error("the answer is `{0}`")]
    OtherWord(String),
    /// The message does not begin with one of the words.
    #[error("prose: `{0}`")]
    Prose(String),
    /// The message takes its first word back.
    #[error("it says {} and then `{hedge}`", .said.name())]
    Hedged {
        /// Its first word.
        said: Said,
        /// The word that takes it back.
        hedge: String,
    },
    /// The reply to a sentence is no document.
    #[error("the reply is not JSON")]
    NoProposal,
    /// The reply to a sentence proposes nothing.
    #[error("the reply names no call")]
    NoCall,
}
