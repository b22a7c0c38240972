//! Mistakes of the program's own: told once, with their place, by whoever catches them or at the end.

use std::panic;
use std::process::Command;
use std::thread;

use trueup::report::panics::{caught, listen, uncaught};

/// The hook is the whole process's, so it is tried in one of its own.
#[test]
fn a_mistake_of_the_program_is_one_message_with_its_place() {
    let own = std::env::current_exe().unwrap();
    let args = ["--exact", "cli::panics::in_a_process_of_its_own", "--ignored", "--nocapture"];
    let done = Command::new(own).args(args).output().unwrap();
    let (out, err) = (String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    assert!(done.status.success(), "{out}{err}");
    assert!(out.contains("1 passed"), "{out}{err}");
    assert!(!err.contains("panicked"), "{err}");
}

#[test]
#[ignore = "sets the hook of its process; run by the test above"]
fn in_a_process_of_its_own() {
    listen();
    let beyond = panic::catch_unwind(|| {
        let list: Vec<u8> = Vec::new();
        list[std::hint::black_box(3)]
    });
    let failure = caught(beyond.unwrap_err().as_ref(), true);
    assert!(failure.message.contains("index is 3"), "{}", failure.message);
    assert!(failure.place.as_deref().unwrap().contains("tests/cli/panics.rs:"));
    assert!(failure.message.contains("the arm was stopped"), "{}", failure.message);
    assert_eq!((failure.code.as_str(), failure.exit()), ("internal::error", 3));
    assert!(uncaught().is_none(), "it was told");
    // A pool of threads hands the panic on; a thread by itself does not.
    let pool = panic::catch_unwind(|| rayon::join(|| (), || panic!("in the pool")));
    let failure = caught(pool.unwrap_err().as_ref(), false);
    assert!(failure.message.contains("in the pool"), "{}", failure.message);
    assert!(thread::spawn(|| panic!("by itself")).join().is_err());
    let failure = uncaught().unwrap();
    assert!(failure.message.contains("by itself"), "{}", failure.message);
    assert_eq!(failure.exit(), 2);
}
