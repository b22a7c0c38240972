//! Tests of what may not be here: public data read in place, a browser. Where it is absent they say so, in the
//! output of a passing run too.

use std::io::Write as _;
use std::path::PathBuf;
use std::thread;

/// Says that the test that is running is skipped, and why. Written past the harness, which keeps what tests
/// that pass print.
pub(crate) fn skipped(why: &str) {
    let thread = thread::current();
    let test = thread.name().unwrap_or("a test");
    let _ = writeln!(std::io::stderr(), "{test} ... skipped: {why}");
}

/// Returns a file or folder of the public data, or `None`, having said so, where it is absent.
pub(crate) fn public(name: &str) -> Option<PathBuf> {
    let data = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/public"));
    let path = data.join(name);
    if !path.exists() {
        skipped(&format!("shared/data/public/{name} is not here"));
        return None;
    }
    Some(path)
}
