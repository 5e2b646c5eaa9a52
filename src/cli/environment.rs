//! What the numerics take from the process: limits, thread starts, the arithmetic that a variable names.

use crate::error::{InputError, Place};
use crate::faults::{self, Operation};
use crate::memory;
use crate::near::nearest;
use kmcfit_core::internals::host::{self, Host};
use kmcfit_core::internals::simd::{LIMIT, arithmetics, check_limit};

/// Provides the functions of the host.
pub fn provide_host() {
    host::provide(Host {
        has_memory: |bytes| memory::check(bytes).is_ok(),
        may_start_thread: || faults::check(Operation::Spawn),
    });
}

/// Checks that the variable `KMCFIT_ARITHMETIC`, if it is set, names an arithmetic.
pub fn check_arithmetic() -> Result<(), InputError> {
    check_limit().map_err(|found| {
        let names = arithmetics();
        let place = Place::Argument(LIMIT.into());
        let error = InputError::new(place, "no arithmetic has this name")
            .found(format!("`{found}`"))
            .expected(names.join(", "));
        match nearest(&found, names) {
            Some(near) => error.hint(format!("did you mean `{near}`?")),
            None => error,
        }
    })
}
