//! Responses by an integrator that shares no code with the library, and random numbers for forces and noise.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Steps of the integrator per sample.
const SUBSTEPS: usize = 40;

/// Standard normal numbers of a seed and a stream.
pub fn white(seed: u64, stream: u64, count: usize) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(stream);
    (0..count)
        .map(|_| StandardNormal.sample(&mut random))
        .collect()
}

/// Broadband force: `10 s_i`, `s_i = 0.7 s_(i-1) + e_i` with standard normal `e_i`.
pub fn broadband(shocks: Vec<f64>) -> Vec<f64> {
    let mut smooth = 0.0;
    let each = shocks.into_iter().map(|e| {
        smooth = 0.7 * smooth + e;
        10.0 * smooth
    });
    each.collect()
}

/// Displacement, velocity and acceleration `a(t, y, v, f)` at samples `spacing` (s) apart, from the state `[y, v]`, by the
/// fourth-order method of Runge and Kutta with 40 steps per sample under a force that is linear between its samples. On 20 samples
/// per cycle the error is 1e-9 of the amplitude.
pub fn response(
    spacing: f64,
    [mut y, mut v]: [f64; 2],
    force: &[f64],
    acceleration: impl Fn(f64, f64, f64, f64) -> f64,
) -> Vec<[f64; 3]> {
    let h = spacing / SUBSTEPS as f64;
    let mut samples = vec![[y, v, acceleration(0.0, y, v, force[0])]];
    for (i, pair) in force.windows(2).enumerate() {
        for s in 0..SUBSTEPS {
            let slope = |part: f64, y: f64, v: f64| {
                let share = (s as f64 + part) / SUBSTEPS as f64;
                let f = pair[0] + share * (pair[1] - pair[0]);
                [v, acceleration(spacing * (i as f64 + share), y, v, f)]
            };
            let a = slope(0.0, y, v);
            let b = slope(0.5, y + 0.5 * h * a[0], v + 0.5 * h * a[1]);
            let c = slope(0.5, y + 0.5 * h * b[0], v + 0.5 * h * b[1]);
            let d = slope(1.0, y + h * c[0], v + h * c[1]);
            y += h / 6.0 * (a[0] + 2.0 * b[0] + 2.0 * c[0] + d[0]);
            v += h / 6.0 * (a[1] + 2.0 * b[1] + 2.0 * c[1] + d[1]);
        }
        let end = spacing * (i + 1) as f64;
        samples.push([y, v, acceleration(end, y, v, pair[1])]);
    }
    samples
}

/// Root mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}
