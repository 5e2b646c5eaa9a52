//! Seeds of the property tests.

use proptest::test_runner::{Config, RngSeed};

/// `cases` cases drawn from `seed`, or from `KMCFIT_PROPTEST_SEED` where that is set: `.ci/run` repeats the same
/// cases, `.ci/long properties` draws fresh ones.
pub fn properties(cases: u32, seed: u64) -> Config {
    let fresh = std::env::var("KMCFIT_PROPTEST_SEED").ok();
    let seed = fresh.map_or(seed, |fresh| {
        fresh.parse().expect("KMCFIT_PROPTEST_SEED: a whole number")
    });
    Config {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(seed),
        ..Config::default()
    }
}
