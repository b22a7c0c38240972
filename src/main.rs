//! The program: hands its arguments to `cli`, turns the outcome into an exit code.

fn main() {}
