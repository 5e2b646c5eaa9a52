//! Numbers of seeds of the statistical tests, and bounds that follow from them.

use statrs::distribution::{Binomial, DiscreteCDF};

/// Coverage of the intervals.
const COVERAGE: f64 = 0.95;

/// `few` seeds, or `all` where `KMCFIT_LONG` is set: `.ci/long statistics`.
pub fn seeds(few: u64, all: u64) -> u64 {
    match std::env::var_os("KMCFIT_LONG") {
        Some(_) => all,
        None => few,
    }
}

/// Number of independent 95 % intervals of `count` that hold at least: fewer have a probability below 0.1 %.
pub fn least_held(count: u64) -> usize {
    let held = Binomial::new(COVERAGE, count).expect("a probability");
    held.inverse_cdf(0.001) as usize
}

/// Half-width of a bound on a mean over `count` seeds, where it is `half_width` for `of` seeds.
pub fn widened(half_width: f64, of: u64, count: u64) -> f64 {
    half_width * (of as f64 / count as f64).sqrt()
}
