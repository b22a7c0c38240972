//! The program: hands its arguments to `cli`, turns the outcome into an exit code.

use std::process::ExitCode;

fn main() -> ExitCode {
    trueup::cli::main()
}
