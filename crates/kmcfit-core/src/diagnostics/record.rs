//! Residual diagnostics of one channel of a record.

use super::{Whiteness, autocorrelation, default_lags, fit_percent, rms, whiteness};

/// Largest distance of a sample from an equally spaced grid, in steps.
const OFF_GRID: f64 = 0.05;
/// Largest number of grid points per sample, for a grid with gaps.
const PLACES_PER_READING: usize = 10;

/// Samples of one channel with their predictions.
#[derive(Debug, Clone, Copy)]
pub struct ResidualRecord<'a> {
    /// Times (s), increasing.
    pub times: &'a [f64],
    /// Residuals as they enter the cost: observed minus model, divided by sigma where stated. Values that are not finite are missing.
    pub residuals: &'a [f64],
    /// Samples, in their unit.
    pub observed: &'a [f64],
    /// Predictions, in the same unit.
    pub model: &'a [f64],
    /// Number of fitted parameters of the noise, of which the residuals are the innovations.
    pub fitted: usize,
}

/// Diagnostics of the residuals of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualDiagnostics {
    /// Number of residuals that are not missing.
    pub count: usize,
    /// Root mean square of observed minus model, in the unit of the samples.
    pub rms: f64,
    /// [`fit_percent`] (%).
    pub fit_percent: f64,
    /// Time between lags (s).
    pub step: f64,
    /// Normalised autocorrelation of the residuals at lags 0, 1, …
    pub autocorrelation: Vec<f64>,
    /// Half-width of the 95 % band of the autocorrelation of white noise.
    pub band: f64,
    /// Whiteness test.
    pub whiteness: Whiteness,
}

impl ResidualDiagnostics {
    /// Computes the diagnostics of one record.
    ///
    /// Lags are multiples of the median spacing. A time missing from an equally spaced sequence is a missing residual. For unequally
    /// spaced times the residuals are taken in order, one mean spacing apart.
    ///
    /// The shortest of the four slices determines the number of samples.
    pub fn new(record: &ResidualRecord) -> Self {
        let ResidualRecord {
            times,
            residuals,
            observed,
            model,
            fitted,
        } = *record;
        let length = [times, residuals, observed, model]
            .map(<[f64]>::len)
            .into_iter()
            .fold(usize::MAX, usize::min);
        let (sequence, step) = on_grid(&times[..length], &residuals[..length]);
        let present = sequence.iter().filter(|r| r.is_finite()).count();
        let correlation = autocorrelation(&sequence, default_lags(present));
        let [observed, model] = [&observed[..length], &model[..length]];
        let missed: Vec<f64> = observed.iter().zip(model).map(|(o, m)| o - m).collect();
        Self {
            count: correlation.count,
            rms: rms(&missed),
            fit_percent: fit_percent(observed, model),
            step,
            band: correlation.band(),
            whiteness: whiteness(&correlation, step, fitted),
            autocorrelation: correlation.values,
        }
    }
}

/// Residuals at equal spacing, NaN in gaps, and the spacing.
fn on_grid(times: &[f64], residuals: &[f64]) -> (Vec<f64>, f64) {
    let (Some(step), &[first, .., last]) = (median_spacing(times), times) else {
        return (residuals.to_vec(), 0.0);
    };
    let in_order = || {
        let mean = (last - first) / (times.len() - 1) as f64;
        (residuals.to_vec(), mean)
    };
    let positions = ((last - first) / step).round();
    // False for a step of zero or NaN.
    let fits = positions >= 0.0 && positions < (PLACES_PER_READING * times.len()) as f64;
    if !fits {
        return in_order();
    }
    let mut sequence = vec![f64::NAN; positions as usize + 1];
    let mut before = None;
    for (time, residual) in times.iter().zip(residuals) {
        let position = (time - first) / step;
        let index = position.round() as usize;
        let on_place = (position - position.round()).abs() <= OFF_GRID;
        match sequence.get_mut(index) {
            Some(slot) if on_place && before.is_none_or(|b| b < index) => *slot = *residual,
            _ => return in_order(),
        }
        before = Some(index);
    }
    (sequence, step)
}

/// Median distance of neighbours, refined to the mean of the distances near it, so that rounding of the times does not accumulate.
fn median_spacing(times: &[f64]) -> Option<f64> {
    let mut spacings: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = spacings.len() / 2;
    (!spacings.is_empty()).then_some(())?;
    let median = *spacings.select_nth_unstable_by(middle, f64::total_cmp).1;
    let near = |s: &&f64| (0.5..1.5).contains(&(**s / median));
    let (mut sum, mut count) = (0.0, 0);
    for spacing in spacings.iter().filter(near) {
        (sum, count) = (sum + spacing, count + 1);
    }
    let mean = sum / count.max(1) as f64;
    Some(if mean > 0.0 { mean } else { median })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::WhitenessResult;
    use crate::diagnostics::noise::white;

    fn diagnostics(times: &[f64], noise: &[f64]) -> ResidualDiagnostics {
        let model: Vec<f64> = times.iter().map(|t| t.sin()).collect();
        let observed: Vec<f64> = model.iter().zip(noise).map(|(m, e)| m + 0.1 * e).collect();
        ResidualDiagnostics::new(&ResidualRecord {
            times,
            residuals: noise,
            observed: &observed,
            model: &model,
            fitted: 0,
        })
    }

    fn even(count: usize) -> Vec<f64> {
        (0..count).map(|i| 3.0 + 0.02 * i as f64).collect()
    }

    #[test]
    fn a_right_model_with_white_errors() {
        let found = diagnostics(&even(1000), &white(1, 1000));
        assert_eq!(found.count, 1000);
        // sigma 0.1 of a sine of amplitude 1 over some three periods.
        assert!((found.rms - 0.1).abs() < 0.01, "{}", found.rms);
        assert!(
            (found.fit_percent - 86.0).abs() < 2.0,
            "{}",
            found.fit_percent
        );
        assert!((found.step - 0.02).abs() < 1e-12);
        assert_eq!(found.autocorrelation.len(), 51);
        assert!((found.band - 0.062).abs() < 1e-4);
        assert_eq!(found.whiteness.verdict, WhitenessResult::White);
    }

    #[test]
    fn gaps_in_the_times_are_gaps_in_the_sequence() {
        // White noise in which two of five samples are missing, with a correlation at a distance of five steps.
        let shocks = white(7, 3000);
        let noise: Vec<f64> = (5..3000).map(|i| shocks[i] + shocks[i - 5]).collect();
        let kept = |i: &usize| i % 5 != 2 && i % 5 != 3;
        let indices: Vec<usize> = (0..noise.len()).filter(kept).collect();
        let times: Vec<f64> = indices.iter().map(|i| 0.02 * *i as f64).collect();
        let values: Vec<f64> = indices.iter().map(|i| noise[*i]).collect();
        let found = diagnostics(&times, &values);
        assert_eq!(found.count, values.len());
        assert!((found.step - 0.02).abs() < 1e-9, "{}", found.step);
        let r = &found.autocorrelation;
        assert!((r[5] - 0.5).abs() < 0.08, "{}", r[5]);
        assert!(r[3].abs() < 0.1, "{}", r[3]);
    }

    #[test]
    fn times_with_few_digits_are_equally_spaced() {
        let times: Vec<f64> = (0..900)
            .map(|i| (1000.0 * i as f64 / 30.0).round() / 1000.0)
            .collect();
        let found = diagnostics(&times, &white(2, 900));
        assert!((found.step - 1.0 / 30.0).abs() < 1e-4, "{}", found.step);
        assert_eq!(found.count, 900);
    }

    #[test]
    fn unequally_spaced_residuals_are_taken_in_order() {
        let mut time = 0.0;
        let times: Vec<f64> = (0..300)
            .map(|i| {
                time += 0.1 + 0.05 * (i as f64).sin();
                time
            })
            .collect();
        let found = diagnostics(&times, &white(3, 300));
        assert_eq!((found.count, found.autocorrelation.len()), (300, 31));
        assert!((found.step - 0.1).abs() < 1e-3, "{}", found.step);
    }

    #[test]
    fn nothing_panics_on_odd_input() {
        let nan = f64::NAN;
        for times in [
            vec![],
            vec![1.0],
            vec![1.0; 30],
            (0..30).map(|i| -f64::from(i)).collect(),
            vec![nan; 30],
            [vec![0.0; 20], vec![1e300; 20]].concat(),
            (0..40)
                .map(|i| if i == 7 { f64::INFINITY } else { f64::from(i) })
                .collect(),
        ] {
            let found = diagnostics(&times, &white(1, times.len()));
            assert_eq!(found.count, times.len());
            assert!(!found.whiteness.to_string().is_empty());
        }
        let uneven = ResidualRecord {
            times: &even(40),
            residuals: &[nan; 30],
            observed: &[1.0; 20],
            model: &[],
            fitted: 0,
        };
        assert_eq!(ResidualDiagnostics::new(&uneven).count, 0);
    }
}
