//! Seeded noise for the tests.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Independent standard normal values.
pub fn white(seed: u64, count: usize) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = || StandardNormal.sample(&mut random);
    (0..count).map(|_| draw()).collect()
}

/// Autoregression `x_i = coefficient x_(i-1) + e_i` with standard normal `e`, stationary from the first value.
pub fn auto_regression(seed: u64, count: usize, coefficient: f64) -> Vec<f64> {
    let mut state = 0.0;
    let first = (1.0 - coefficient * coefficient).sqrt();
    let shocks = white(seed, count).into_iter().enumerate();
    shocks
        .map(|(i, shock)| {
            let size = if i == 0 { shock / first } else { shock };
            state = coefficient * state + size;
            state
        })
        .collect()
}
