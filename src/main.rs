//! The `kmcfit` program: arguments in, exit code out.

use mimalloc::MiMalloc;
use std::process::ExitCode;

/// Functions, motions and gradients of one value a node come and go with every iteration; the system's allocator
/// returns pages of that size at once, and filling them anew takes longer than the arithmetic on long
/// records.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

fn main() -> ExitCode {
    kmcfit::cli::main()
}
