//! A camera against points of known place: where the picture shows them, and where the model says it should.
//!
//! Files of points come in ([`points`]), a finding goes out ([`investigate()`]). The model is a lens and a pose
//! ([`lens`], [`views`]); effects bend it ([`term`], [`bent`]). Where the camera's pose in a view is unknown, the
//! pose is fitted again for every hypothesis, so that only what no pose explains is called a gap. Wrong matches and
//! the noise are told before the search by a model more flexible than any effect ([`robust`]); the search itself is
//! [`super::selection`]. What two explanations leave open is settled by other pictures ([`pictures`]).
//!
//! It finds no points in pictures and calibrates nothing by itself: that is [`crate::alignment`].
//!
//! Source of the lens: Brown, "Decentering Distortion of Lenses", 1966, in the form of `OpenCV`.

mod camera_finding;
mod dropped;
pub mod bent;
pub mod views;
pub mod explain;
pub mod investigate;
pub mod known;
mod layout;
mod misread;
pub mod lens;
pub mod pictures;
mod places;
pub mod points;
mod power;
pub mod robust;
pub mod term;
mod error;
pub mod wording;

pub use investigate::investigate;
