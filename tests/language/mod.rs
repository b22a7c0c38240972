//! The language as a whole: texts in, trees and diagnostics out.

mod diagnostics;
mod reading;
mod stdlib;
