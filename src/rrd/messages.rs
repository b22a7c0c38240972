//! The messages of an RRD file, as far as they are written here: protobuf, by derive from structs.
//!
//! Source: Rerun, `rerun/v1alpha1/log_msg.proto` and `common.proto`, of which the names are.
#![allow(
    missing_docs,
    reason = "the fields of somebody else's messages, named and explained there"
)]

/// `COMPRESSION_NONE`.
pub const NO_COMPRESSION: i32 = 1;
/// `ENCODING_ARROW_IPC`.
pub const ARROW_IPC: i32 = 1;
/// `STORE_KIND_RECORDING`.
const RECORDING: i32 = 1;
/// `STORE_SOURCE_KIND_OTHER`: what is neither of Rerun's SDKs nor of its viewer.
const OTHER: i32 = 6;
/// `ENCODER_VERSION_V0`.
const ENCODER: i32 = 1;

/// A name that nothing else has: of a row, of a chunk.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Tuid {
    #[prost(fixed64, optional, tag = "1")]
    pub time_ns: Option<u64>,
    #[prost(fixed64, optional, tag = "2")]
    pub inc: Option<u64>,
}

impl Tuid {
    /// The name of that number. Its time is that of no clock, so that the same run gives the same bytes; zero is no name.
    pub(super) fn numbered(inc: u64) -> Self {
        Self { time_ns: Some(1), inc: Some(inc) }
    }

    /// As the columns of rows and chunks have it: 16 bytes, big-endian.
    pub(super) fn bytes(&self) -> [u8; 16] {
        let number = u128::from(self.time_ns()) << 64 | u128::from(self.inc());
        number.to_be_bytes()
    }
}

#[derive(Clone, PartialEq, prost::Message)]
pub struct ApplicationId {
    #[prost(string, tag = "1")]
    pub id: String,
}

#[derive(Clone, PartialEq, prost::Message)]
pub struct StoreId {
    #[prost(int32, tag = "1")]
    pub kind: i32,
    #[prost(string, tag = "2")]
    pub recording_id: String,
    #[prost(message, optional, tag = "3")]
    pub application_id: Option<ApplicationId>,
}

impl StoreId {
    pub(super) fn recording(application: &str, id: &str) -> Self {
        Self {
            kind: RECORDING,
            recording_id: id.to_owned(),
            application_id: Some(ApplicationId { id: application.to_owned() }),
        }
    }
}

#[derive(Clone, PartialEq, prost::Message)]
pub struct SetStoreInfo {
    #[prost(message, optional, tag = "1")]
    pub row_id: Option<Tuid>,
    #[prost(message, optional, tag = "2")]
    pub info: Option<StoreInfo>,
}

#[derive(Clone, PartialEq, prost::Message)]
pub struct StoreInfo {
    #[prost(message, optional, tag = "2")]
    pub store_id: Option<StoreId>,
    #[prost(message, optional, tag = "5")]
    pub store_source: Option<StoreSource>,
    #[prost(message, optional, tag = "6")]
    pub store_version: Option<StoreVersion>,
}

#[derive(Clone, PartialEq, prost::Message)]
pub struct StoreSource {
    #[prost(int32, tag = "1")]
    pub kind: i32,
    #[prost(message, optional, tag = "2")]
    pub extra: Option<StoreSourceExtra>,
}

impl StoreSource {
    pub(super) fn other(name: &str) -> Self {
        let payload = name.as_bytes().to_vec();
        Self { kind: OTHER, extra: Some(StoreSourceExtra { payload }) }
    }
}

#[derive(Clone, PartialEq, prost::Message)]
pub struct StoreSourceExtra {
    #[prost(bytes = "vec", tag = "1")]
    pub payload: Vec<u8>,
}

#[derive(Clone, PartialEq, prost::Message)]
pub struct StoreVersion {
    #[prost(int32, tag = "1")]
    pub crate_version_bits: i32,
}

impl StoreVersion {
    pub(super) fn of(version: [u8; 4]) -> Self {
        Self { crate_version_bits: i32::from_be_bytes(version) }
    }
}

#[derive(Clone, PartialEq, prost::Message)]
pub struct ArrowMsg {
    #[prost(message, optional, tag = "1")]
    pub store_id: Option<StoreId>,
    #[prost(int32, tag = "2")]
    pub compression: i32,
    #[prost(uint64, tag = "3")]
    pub uncompressed_size: u64,
    #[prost(int32, tag = "4")]
    pub encoding: i32,
    #[prost(bytes = "vec", tag = "5")]
    pub payload: Vec<u8>,
    #[prost(message, optional, tag = "6")]
    pub chunk_id: Option<Tuid>,
    #[prost(bool, optional, tag = "7")]
    pub is_static: Option<bool>,
}

#[derive(Clone, PartialEq, prost::Message)]
pub struct RrdFooter {
    #[prost(message, repeated, tag = "1")]
    pub manifests: Vec<RrdManifest>,
}

#[derive(Clone, PartialEq, prost::Message)]
pub struct RrdManifest {
    #[prost(message, optional, tag = "1")]
    pub store_id: Option<StoreId>,
    #[prost(message, optional, tag = "2")]
    pub sorbet_schema: Option<Schema>,
    #[prost(bytes = "vec", optional, tag = "3")]
    pub sorbet_schema_sha256: Option<Vec<u8>>,
    #[prost(message, optional, tag = "4")]
    pub data: Option<DataframePart>,
}

#[derive(Clone, PartialEq, prost::Message)]
pub struct Schema {
    #[prost(bytes = "vec", optional, tag = "1")]
    pub arrow_schema: Option<Vec<u8>>,
}

#[derive(Clone, PartialEq, prost::Message)]
pub struct DataframePart {
    #[prost(int32, tag = "1")]
    pub encoder_version: i32,
    #[prost(bytes = "vec", optional, tag = "2")]
    pub payload: Option<Vec<u8>>,
    #[prost(int32, tag = "3")]
    pub compression: i32,
    #[prost(uint64, tag = "4")]
    pub uncompressed_size: u64,
}

impl DataframePart {
    pub(super) fn plain(payload: Vec<u8>) -> Self {
        Self {
            encoder_version: ENCODER,
            compression: NO_COMPRESSION,
            uncompressed_size: payload.len() as u64,
            payload: Some(payload),
        }
    }
}
