//! The program that is tested, and the length of the tests.

/// Path of the tested program: that of the tests' profile, or the one that `KMCFIT_PROGRAM` names.
pub fn program() -> String {
    std::env::var("KMCFIT_PROGRAM").unwrap_or_else(|_| env!("CARGO_BIN_EXE_kmcfit").to_owned())
}

/// True where `KMCFIT_LONG` is set: `.ci/long`.
#[allow(dead_code, reason = "not in all test programs")]
pub fn is_long() -> bool {
    std::env::var_os("KMCFIT_LONG").is_some()
}
