//! The services of the controller, one file each: what a call asks for and what is answered. What they keep between
//! calls is in the file of the same name above.

mod actions;
mod config;
mod cyclic;
mod expansion;
mod sequences;
mod vision;
mod zones;
