//! The program that is tested.

/// Path of the tested program: that of the tests' profile, or the one that `KMCFIT_PROGRAM` names.
pub fn program() -> String {
    std::env::var("KMCFIT_PROGRAM").unwrap_or_else(|_| env!("CARGO_BIN_EXE_kmcfit").to_owned())
}
