//! Frames: what travels over TCP and UDP, to the bit.
//!
//! A frame is a protobuf message with a header of four words and a payload. UDP carries one a datagram; TCP
//! puts [`MAGIC`] and the length, big-endian, before each. [`Decoder`] takes a stream apart and refuses what
//! no controller sends; it never reserves memory for bytes that have not come.
//!
//! Source: Kinova's C++ headers `HeaderInfo.h`, `Frame.h` and `KinovaTcpUtilities.h` (API 2.3) and the
//! bytes of its Python client.

use prost::Message;

use super::rpc::Rpc;

/// Eight bytes before every frame on TCP.
pub const MAGIC: [u8; 8] = *b"\x07xEtRoK\x07";

/// Length of what stands before a frame on TCP, bytes: [`MAGIC`] and the length.
const PREAMBLE: usize = 12;

/// The longest frame, bytes: the buffer of the vendor's own client.
pub const LONGEST: usize = 16_777_216;

/// The longest payload the header can tell, bytes.
const LONGEST_PAYLOAD: usize = 0x00FF_FFFF;

/// The only version of headers and services.
const VERSION: u32 = 1;

/// What cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// The stream is not Kortex, or has lost step.
    #[error("{}", foreign(*.0))]
    Magic([u8; 8]),
    /// The stream announces more than any controller sends.
    #[error("a frame of {0} bytes was announced; the longest is {LONGEST} bytes")]
    TooLong(usize),
    /// The frame is not a frame.
    #[error("a frame that cannot be read: {0}")]
    Malformed(Malformed),
    /// The header has another version.
    #[error("a frame of header version {version}; this program speaks version {VERSION}")]
    Version {
        /// Which.
        version: u32,
        /// Whose frame it is, if what tells so stands where it does in this version.
        header: Header,
    },
    /// The header and the frame disagree about the payload.
    #[error("a frame announces {announced} bytes of payload and has {found} bytes")]
    Payload {
        /// What the header says.
        announced: usize,
        /// What there is.
        found: usize,
    },
}

/// Words the beginning of what is no frame: as text where it is text, which another server's answer often is.
fn foreign(bytes: [u8; 8]) -> String {
    match std::str::from_utf8(&bytes) {
        Ok(text) if text.chars().all(|c| !c.is_control() || c.is_whitespace()) => {
            format!("what answers there is no Kortex controller; it begins with `{}`", text.trim())
        }
        _ => format!("bytes that are no Kortex frame: {bytes:02x?}"),
    }
}

/// Why a frame is not a frame.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Malformed {
    /// It is no message.
    #[error("{0}")]
    Message(String),
    /// It has no header.
    #[error("it has no header")]
    NoHeader,
}

/// What kind of frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A client asks.
    Request,
    /// The arm answers.
    Response,
    /// The arm tells of its own accord.
    Notification,
    /// Something nobody here uses: raw 2, ping 7, pong 8.
    Other(u8),
}

impl Kind {
    fn number(self) -> u32 {
        match self {
            Self::Request => 1,
            Self::Response => 3,
            Self::Notification => 5,
            Self::Other(number) => u32::from(number),
        }
    }

    fn of(number: u8) -> Self {
        match number {
            1 => Self::Request,
            3 => Self::Response,
            5 => Self::Notification,
            other => Self::Other(other),
        }
    }
}

/// The header's four words, taken apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// What kind of frame.
    pub kind: Kind,
    /// Whom it is for: 0 the base, else an identifier of `DeviceManager.ReadAllDevices`.
    pub device: u8,
    /// Error code of a response, 4 bits; 0 is none.
    pub error: u8,
    /// Error sub-code, 12 bits.
    pub sub_error: u16,
    /// The session, 0 before there is one.
    pub session: u16,
    /// Number of the message, by which a response finds its request; of a notification, its handle.
    pub message: u16,
    /// The service, 12 bits.
    pub service: u16,
    /// The function.
    pub function: u16,
}

/// A header and its payload.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// The header.
    pub header: Header,
    /// A serialised message, which may be empty.
    pub payload: Vec<u8>,
}

/// `Frame` on the wire.
#[derive(Clone, PartialEq, Message)]
struct RawFrame {
    #[prost(message, optional, tag = "1")]
    header: Option<RawHeader>,
    #[prost(bytes = "vec", tag = "2")]
    payload: Vec<u8>,
}

/// `Header` on the wire, whose fields are `frame_info`, `message_info`, `service_info`, `payload_info`.
#[derive(Clone, PartialEq, Message)]
struct RawHeader {
    /// Version 31..28, kind 27..24, device 23..16, error 15..12, sub-code 11..0.
    #[prost(fixed32, tag = "1")]
    frame: u32,
    /// Session 31..16, message 15..0.
    #[prost(fixed32, tag = "2")]
    message: u32,
    /// Version 31..28, service 27..16, function 15..0.
    #[prost(fixed32, tag = "3")]
    service: u32,
    /// Length of the payload 23..0.
    #[prost(fixed32, tag = "4")]
    payload: u32,
}

impl Frame {
    /// Returns a request.
    pub fn request(rpc: Rpc, device: u8, session: u16, message: u16, payload: Vec<u8>) -> Self {
        let header = Header {
            kind: Kind::Request,
            device,
            error: 0,
            sub_error: 0,
            session,
            message,
            service: rpc.service,
            function: rpc.function,
        };
        Self { header, payload }
    }

    /// Returns the answer to this request.
    #[must_use]
    pub fn response(&self, session: u16, payload: Vec<u8>) -> Self {
        let header = Header { kind: Kind::Response, session, ..self.header };
        Self { header, payload }
    }

    /// Returns the frame's bytes: a UDP datagram.
    ///
    /// # Errors
    ///
    /// [`FrameError::TooLong`] if the header cannot tell the payload's length.
    pub fn encode(&self) -> Result<Vec<u8>, FrameError> {
        if self.payload.len() > LONGEST_PAYLOAD {
            return Err(FrameError::TooLong(self.payload.len()));
        }
        let h = &self.header;
        let raw = RawHeader {
            frame: VERSION << 28
                | (h.kind.number() & 0xF) << 24
                | u32::from(h.device) << 16
                | (u32::from(h.error) & 0xF) << 12
                | u32::from(h.sub_error) & 0xFFF,
            message: u32::from(h.session) << 16 | u32::from(h.message),
            service: VERSION << 28 | (u32::from(h.service) & 0xFFF) << 16 | u32::from(h.function),
            payload: self.payload.len() as u32,
        };
        Ok(RawFrame { header: Some(raw), payload: self.payload.clone() }.encode_to_vec())
    }

    /// Returns the frame's bytes with [`MAGIC`] and length before them, to be written at once: the vendor's
    /// client reads the first twelve bytes with a single call.
    ///
    /// # Errors
    ///
    /// As [`Self::encode`].
    pub fn encode_stream(&self) -> Result<Vec<u8>, FrameError> {
        let frame = self.encode()?;
        let mut bytes = Vec::with_capacity(PREAMBLE + frame.len());
        bytes.extend_from_slice(&MAGIC);
        bytes.extend_from_slice(&(frame.len() as u32).to_be_bytes());
        bytes.extend_from_slice(&frame);
        Ok(bytes)
    }

    /// Reads a frame: a UDP datagram.
    ///
    /// # Errors
    ///
    /// Everything but [`FrameError::Magic`].
    pub fn decode(bytes: &[u8]) -> Result<Self, FrameError> {
        let raw = RawFrame::decode(bytes)
            .map_err(|error| FrameError::Malformed(Malformed::Message(error.to_string())))?;
        let words = raw.header.ok_or(FrameError::Malformed(Malformed::NoHeader))?;
        let header = Header {
            kind: Kind::of((words.frame >> 24 & 0xF) as u8),
            device: (words.frame >> 16) as u8,
            error: (words.frame >> 12 & 0xF) as u8,
            sub_error: (words.frame & 0xFFF) as u16,
            session: (words.message >> 16) as u16,
            message: words.message as u16,
            service: (words.service >> 16 & 0xFFF) as u16,
            function: words.service as u16,
        };
        for version in [words.frame >> 28, words.service >> 28] {
            if version != VERSION {
                return Err(FrameError::Version { version, header });
            }
        }
        let announced = (words.payload & 0x00FF_FFFF) as usize;
        if announced != raw.payload.len() {
            return Err(FrameError::Payload { announced, found: raw.payload.len() });
        }
        Ok(Self { header, payload: raw.payload })
    }
}

/// Takes a TCP stream apart.
#[derive(Debug, Clone, Default)]
pub struct Decoder {
    bytes: Vec<u8>,
    /// How many of `bytes` have been read.
    read: usize,
}

impl Decoder {
    /// Takes the next bytes of the stream.
    pub fn push(&mut self, bytes: &[u8]) {
        if self.read > 0 {
            self.bytes.drain(..self.read);
            self.read = 0;
        }
        self.bytes.extend_from_slice(bytes);
    }

    /// Returns the next whole frame, if it has come.
    ///
    /// # Errors
    ///
    /// After [`FrameError::Magic`] and [`FrameError::TooLong`] the stream is of no more use: where the next
    /// frame begins is not known. A frame that is whole but cannot be read is passed over.
    pub fn next_frame(&mut self) -> Result<Option<Frame>, FrameError> {
        let waiting = &self.bytes[self.read..];
        let Some((preamble, rest)) = waiting.split_first_chunk::<PREAMBLE>() else {
            // Wrong bytes are told as soon as they are seen.
            let seen = waiting.len().min(MAGIC.len());
            if waiting[..seen] != MAGIC[..seen] {
                let mut wrong = [0; 8];
                wrong[..seen].copy_from_slice(&waiting[..seen]);
                return Err(FrameError::Magic(wrong));
            }
            return Ok(None);
        };
        let [a, b, c, d, e, f, g, h, length @ ..] = *preamble;
        let magic = [a, b, c, d, e, f, g, h];
        if magic != MAGIC {
            return Err(FrameError::Magic(magic));
        }
        let length = u32::from_be_bytes(length) as usize;
        if length > LONGEST {
            return Err(FrameError::TooLong(length));
        }
        let Some(frame) = rest.get(..length) else { return Ok(None) };
        let frame = Frame::decode(frame);
        self.read += PREAMBLE + length;
        frame.map(Some)
    }

    /// Returns how many bytes wait for the rest of their frame.
    pub fn waiting(&self) -> usize {
        self.bytes.len() - self.read
    }
}
