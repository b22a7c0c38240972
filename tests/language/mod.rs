//! The language as a whole: texts in, trees and diagnostics out.

mod diagnostics;
mod model;
mod reading;
mod stdlib;
