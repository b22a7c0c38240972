//! The real arm's protocol: bytes, the client, and the controller it is tested against.

mod wire;
