//! The `kmcfit` program: arguments in, exit code out.

use std::process::ExitCode;

fn main() -> ExitCode {
    kmcfit::cli::main()
}
