//! Why there is no mask.

use std::path::PathBuf;

use crate::http::{Address, NoAddress, Trouble};

/// Why there is no mask.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Neither an address nor a file of a network.
    #[error("`{0}` is neither http://HOST[:PORT]/PATH nor a file that ends in .onnx")]
    Unknown(String),
    /// Not a web address.
    #[error(transparent)]
    NoAddress(#[from] NoAddress),
    /// Nobody answers.
    #[error("{address}: {trouble}")]
    Trouble {
        /// Who was asked.
        address: Address,
        /// What went wrong.
        trouble: Trouble,
    },
    /// The server says that something is wrong.
    #[error("{address} answers with status {status}: {told}")]
    Status {
        /// Who says so.
        address: Address,
        /// 200 would be good.
        status: u16,
        /// How its answer begins.
        told: String,
    },
    /// The answer is none.
    #[error("the answer of {address} is not {{\"masks\": [..]}}: {flaw}")]
    Answer {
        /// Who answered.
        address: Address,
        /// What is wrong with it.
        flaw: Flaw,
    },
    /// One of the masks is none.
    #[error("mask {number} in the answer of {address} is not one of this picture: {flaw}")]
    Mask {
        /// Who answered.
        address: Address,
        /// Which, counted from 1.
        number: usize,
        /// What is wrong with it.
        flaw: Flaw,
    },
    /// This build reads no networks.
    #[error("this build reads no ONNX files")]
    NotBuilt,
    /// A file of a network that is of no use.
    #[error("{}: {unfit}", path.display())]
    Network {
        /// The file.
        path: PathBuf,
        /// Why.
        unfit: Unfit,
    },
}

/// What is wrong with an answer, or with a mask in it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Flaw {
    /// It is no JSON; how it begins.
    #[error("it is not JSON, it begins `{0}`")]
    NotJson(String),
    /// A number that JSON does not have.
    #[error("it holds NaN or Infinity, which JSON does not have; a score is a number")]
    NoNumber,
    /// There is no list.
    #[error("it has no list `masks`")]
    NoList,
    /// More masks than are read.
    #[error("it has {0} masks, and at most {1} are read")]
    TooMany(usize, usize),
    /// A score that is none.
    #[error("`score` is not a finite number")]
    Score,
    /// A number of a prompt that was not sent.
    #[error("`prompt` is not the number of one that was sent, 0 to {}", .0.saturating_sub(1))]
    Prompt(usize),
    /// Several prompts, and it is not said to which it belongs.
    #[error("{0} prompts were sent, and `prompt` does not say which this answers")]
    WhichPrompt(usize),
    /// No mask.
    #[error("it has neither `rle` nor `png`")]
    Neither,
    /// Another size.
    #[error("it is of {} x {} px, the picture of {} x {} px", got.0, got.1, asked.0, asked.1)]
    Size {
        /// Its width and height.
        got: (u64, u64),
        /// The picture's.
        asked: (u32, u32),
    },
    /// Runs that are none.
    #[error("`rle` is not {{\"size\": [height, width], \"counts\": [..] or \"..\"}}")]
    Runs,
    /// Runs that do not add up.
    #[error("the runs of `rle` come to {0} pixels, the picture has {1}")]
    Length(u64, u64),
    /// No picture.
    #[error("`png` cannot be read: {0}")]
    Png(String),
}

/// Why a network is of no use.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Unfit {
    /// The file cannot be read.
    #[error("{0}")]
    File(String),
    /// It is no network, or has parts that are not known here.
    #[error("it cannot be loaded: {0}")]
    Load(String),
    /// Other inputs than are understood.
    #[error("expected one input [1, 3, H, W] of floats for the picture, and it has {0}")]
    Inputs(String),
    /// An input that is neither a box nor a point.
    #[error(
        "expected beside the picture at most [1, 4] for a box or [1, 2] for a point, floats, and it has {0}"
    )]
    Prompt(String),
    /// Other outputs than are understood.
    #[error("expected one output [1, 1, H, W] of floats, and it has {0}")]
    Outputs(String),
    /// It needs a box.
    #[error("its input `{0}` is a box, and none was said")]
    NeedsBox(String),
    /// It needs a point.
    #[error("its input `{0}` is a point, and none was said")]
    NeedsPoint(String),
    /// It failed.
    #[error("it cannot be run on a picture of {width} x {height} px: {why}")]
    Run {
        /// The picture's width, as it was given in.
        width: usize,
        /// Its height.
        height: usize,
        /// Why.
        why: String,
    },
    /// Numbers that are none.
    #[error("its output holds numbers that are not finite")]
    NotFinite,
}
