//! The messages of the Kortex protocol that are spoken here, a file per service or part of one.
//!
//! Written from the schema of API 2.6 (Kinova's annotated `.proto` files), which agrees with the
//! serialised descriptors of API 2.3: field numbers and types did not change in between. Names of messages
//! and fields are the vendor's, so that its documentation can be read beside this; where two messages of
//! different services share a name, one is renamed and its first line says which it is. A field that is not
//! listed is skipped when read and absent when written.
//!
//! Units are the wire's: degrees, deg/s, m, s, N·m, A, V, °C; the gripper in shares of its travel (0 open,
//! 1 closed) for `Base` and in per cent for `BaseCyclic`. They end in [`super::degrees`].
#![expect(
    missing_docs,
    reason = "names, numbers and meanings of fields are the vendor's documents'"
)]

pub mod common;
pub mod session;
pub mod base;
pub mod motion;
pub mod force;
pub mod sequence;
pub mod trajectory;
pub mod cyclic;
pub mod config;
pub mod interconnect;
pub mod vision;
