//! The `kmcfit` program: arguments in, exit code out.

use mimalloc::MiMalloc;

/// Arrays with one value per node are allocated in every iteration; the system's allocator returns pages of that size
/// at once, and filling them anew takes longer than the arithmetic on long records.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

fn main() {
    kmcfit::cli::main()
}
