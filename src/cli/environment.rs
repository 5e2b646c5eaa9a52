//! Services of the process for the numerics: clock, progress, interruption, choice of SIMD arithmetic.

use crate::error::InputError;
use crate::spelling::did_you_mean;
use kmcfit_core::host::{Host, set_host};
use kmcfit_core::simd::{LIMIT, arithmetics, check_limit};
use std::sync::LazyLock;
use std::time::Instant;

/// Origin of the clock.
#[expect(
    clippy::disallowed_methods,
    reason = "the clock that the host provides"
)]
static START: LazyLock<Instant> = LazyLock::new(Instant::now);

/// Provides the functions of the host.
pub fn provide_host() {
    set_host(Host {
        clock: || START.elapsed(),
        progress: super::progress::show_jobs,
        is_interrupted: super::interrupt::is_asked,
    });
}

/// Checks that the variable `KMCFIT_ARITHMETIC`, if it is set, names an arithmetic.
pub fn check_arithmetic() -> Result<(), InputError> {
    check_limit().map_err(|found| {
        let names = arithmetics();
        InputError::argument(format!("environment variable {LIMIT}"), "unknown value")
            .found(format!("`{found}`"))
            .expected(format!("one of: {}", names.join(", ")))
            .hint_if(did_you_mean(&found, names))
    })
}
