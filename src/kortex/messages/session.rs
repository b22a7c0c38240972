//! Service 1, Session: who speaks.

use super::common::Connection;

/// `Session.CreateSessionInfo`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct CreateSessionInfo {
    #[prost(string, tag = "1")]
    pub username: String,
    #[prost(uint32, tag = "2")]
    pub session_inactivity_timeout: u32,
    #[prost(string, tag = "3")]
    pub password: String,
    #[prost(uint32, tag = "4")]
    pub connection_inactivity_timeout: u32,
}

/// `Session.ConnectionList`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ConnectionList {
    #[prost(message, repeated, tag = "1")]
    pub connection: Vec<Connection>,
}
