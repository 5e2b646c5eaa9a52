//! Correlation time of noise sampled at unequal times.

use super::correlation::{Correlation, CorrelationLaw};

/// Number of correlation times that are compared, evenly in their logarithm.
const TIMES: usize = 60;

/// Correlation time (s) that maximises the likelihood of `values` at `times` with their variance profiled, `n log |W u|^2 + log |R|`;
/// `None` where the Bayesian information criterion prefers uncorrelated noise.
pub fn select_exponential(values: &[f64], times: &[f64]) -> Option<f64> {
    let samples = values.len() as f64;
    let spacings = times.windows(2).map(|pair| pair[1] - pair[0]);
    let shortest = spacings.fold(f64::INFINITY, f64::min);
    let span = times.last()? - times.first()?;
    if !(shortest > 0.0 && span > shortest) {
        return None;
    }
    let squares = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
    let cost = |time: f64| {
        let correlation = Correlation::new(CorrelationLaw::Exponential { time }, times);
        correlation.map_or(f64::INFINITY, |c| {
            samples * squares(&c.whiten(values)).ln() + c.log_determinant()
        })
    };
    let (low, high) = ((0.1 * shortest).ln(), (0.25 * span).ln());
    let at = |i: usize| (low + (high - low) * i as f64 / (TIMES - 1) as f64).exp();
    let costs = (0..TIMES).map(|i| (cost(at(i)), at(i)));
    let (least, time) = costs.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let white = samples * squares(values).ln();
    (least + samples.ln() < white).then_some(time)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::noise::white;

    #[test]
    fn the_correlation_time_of_irregular_samples_is_found_and_white_noise_has_none() {
        let steps = white(1, 800);
        let mut times = vec![0.0];
        times.extend(steps.iter().scan(0.0, |t, s| {
            *t += 0.1 * (1.0 + 0.8 * s.tanh());
            Some(*t)
        }));
        let law = CorrelationLaw::Exponential { time: 0.5 };
        let correlation = Correlation::new(law, &times).unwrap();
        let unit = white(2, times.len());
        let found = select_exponential(&correlation.colour(&unit), &times).unwrap();
        // The relative standard error of a correlation time is about sqrt(2 * 0.5 s / 80 s) = 11 %.
        assert!((found / 0.5 - 1.0).abs() < 0.4, "{found}");
        assert!(select_exponential(&unit, &times).is_none());
    }
}
