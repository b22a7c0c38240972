//! The language as a whole: texts in, trees and diagnostics out.

mod assist;
mod diagnostics;
mod forms;
mod layout;
mod model;
mod reading;
mod robust;
mod sentences;
mod stdlib;
