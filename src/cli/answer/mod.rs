//! What commands print as JSON, as `INTERFACES.md` fixes it: data of the layers below → structs to serialise, and
//! the JSON and tables that commands are given → data. Nothing here reads a file or a clock.

pub mod align;
pub mod calibrate;
pub mod hand_eye;
pub mod measured;
pub mod left_out;
pub mod problem;
pub mod plan;
pub mod robot;
pub mod finding;
pub mod robot_check;
mod robot_contacts;
mod robot_reach;
pub mod rows;
pub mod see;
pub mod segment;
