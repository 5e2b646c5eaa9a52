//! Interpolation of a signal between its samples.

use super::spline;
use std::sync::Arc;

/// Largest distance, relative to the nearest spacing, of a time that is taken as a sample, and of a time outside the samples that is
/// taken as their end, because times are rounded.
const NEARNESS: f64 = 1e-6;

/// Interpolation between samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Interpolation {
    /// Zero-order hold: the last sample until the next one, with jumps.
    Hold,
    /// Piecewise linear.
    #[default]
    Linear,
    /// Cubic spline with not-a-knot end conditions: exact for cubics, fourth-order accurate for smooth signals.
    Cubic,
}

/// Samples at increasing times, with interpolation between them.
///
/// Outside the samples the first or last value holds; [`covers`](Self::covers) tests a span.
#[derive(Debug, Clone, PartialEq)]
pub struct Signal {
    // Shared by copies: problems are copied often.
    times: Arc<Vec<f64>>,
    values: Arc<Vec<f64>>,
    interpolation: Interpolation,
    /// Mean number of samples per second, for the search of a time.
    rate: f64,
    /// Second derivatives at the samples; empty unless cubic.
    curvatures: Arc<Vec<f64>>,
}

impl Signal {
    /// A signal through samples at times in s.
    ///
    /// Two samples of a cubic signal define a line, three a parabola; a single sample is a constant.
    ///
    /// `None` if there is no sample, the numbers of times and values differ, a time or value is not finite, the times do not increase, or
    /// they are so close that a spline overflows.
    pub fn new(times: Vec<f64>, values: Vec<f64>, interpolation: Interpolation) -> Option<Self> {
        let increasing = times.windows(2).all(|pair| pair[0] < pair[1]);
        let finite = times.iter().chain(&values).all(|x| x.is_finite());
        if times.is_empty() || times.len() != values.len() || !increasing || !finite {
            return None;
        }
        let curvatures = match interpolation {
            Interpolation::Cubic => spline::curvatures(&times, &values),
            _ => Vec::new(),
        };
        let bent = curvatures.iter().all(|bend| bend.is_finite());
        let duration = times[times.len() - 1] - times[0];
        bent.then_some(Self {
            rate: (times.len() - 1) as f64 / duration.max(f64::MIN_POSITIVE),
            times: Arc::new(times),
            values: Arc::new(values),
            interpolation,
            curvatures: Arc::new(curvatures),
        })
    }

    /// A signal through samples at `start + i * spacing`, in s.
    ///
    /// `None` as [`new`](Self::new).
    pub fn equally_spaced(
        start: f64,
        spacing: f64,
        values: Vec<f64>,
        interpolation: Interpolation,
    ) -> Option<Self> {
        let times = (0..values.len()).map(|i| start + i as f64 * spacing);
        Self::new(times.collect(), values, interpolation)
    }

    /// Times of the samples, s.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Values of the samples.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Values at some times (s); at the times of the samples shared, because long records have few arrays of all samples.
    pub(crate) fn values_at(&self, times: &[f64]) -> Arc<Vec<f64>> {
        match *self.times == times {
            true => Arc::clone(&self.values),
            false => Arc::new(times.iter().map(|t| self.value(*t)).collect()),
        }
    }

    /// Shares `times` where they are the times of the samples.
    pub fn share_times(&mut self, times: &Arc<Vec<f64>>) {
        if self.times == *times {
            self.times = Arc::clone(times);
        }
    }

    /// Interpolation between the samples.
    pub fn interpolation(&self) -> Interpolation {
        self.interpolation
    }

    /// True if the samples cover `from` to `to`, to within 1e-6 of the spacing at each end.
    pub fn covers(&self, from: f64, to: f64) -> bool {
        let n = self.times.len();
        let (first, last) = (self.times[0], self.times[n - 1]);
        let spacings = match n {
            1 => (0.0, 0.0),
            n => (self.times[1] - first, last - self.times[n - 2]),
        };
        from >= first - NEARNESS * spacings.0 && to <= last + NEARNESS * spacings.1
    }

    /// Value at a time; at a jump the value after it.
    pub fn value(&self, t: f64) -> f64 {
        match self.interpolation {
            Interpolation::Hold => self.values[self.held(t, false)],
            _ => self.between(t),
        }
    }

    /// Left limit of the value: at a jump the value before it.
    pub fn value_before(&self, t: f64) -> f64 {
        match self.interpolation {
            Interpolation::Hold => self.values[self.held(t, true)],
            _ => self.between(t),
        }
    }

    /// First derivative at a time, per s; at a kink the one after it.
    ///
    /// Zero for a zero-order hold, without its jumps.
    pub fn derivative(&self, t: f64) -> f64 {
        match (self.interpolation, self.cell(t)) {
            (Interpolation::Hold, _) | (_, None) => 0.0,
            (Interpolation::Linear, Some(cell)) => {
                (self.values[cell + 1] - self.values[cell])
                    / (self.times[cell + 1] - self.times[cell])
            }
            (Interpolation::Cubic, Some(cell)) => self.piece(cell).derivative(self.clamped(t)),
        }
    }

    /// Second derivative at a time, per s²; zero unless cubic, without kinks.
    pub fn second_derivative(&self, t: f64) -> f64 {
        match (self.interpolation, self.cell(t)) {
            (Interpolation::Cubic, Some(cell)) => {
                self.piece(cell).second_derivative(self.clamped(t))
            }
            _ => 0.0,
        }
    }

    fn clamped(&self, t: f64) -> f64 {
        t.max(self.times[0]).min(self.times[self.times.len() - 1])
    }

    fn between(&self, t: f64) -> f64 {
        let Some(cell) = self.cell(t) else {
            return self.values[0];
        };
        let t = self.clamped(t);
        match self.interpolation {
            Interpolation::Cubic => self.piece(cell).value(t),
            _ => {
                let part = (t - self.times[cell]) / (self.times[cell + 1] - self.times[cell]);
                (1.0 - part) * self.values[cell] + part * self.values[cell + 1]
            }
        }
    }

    fn piece(&self, cell: usize) -> spline::SplineSegment {
        spline::SplineSegment {
            times: [self.times[cell], self.times[cell + 1]],
            values: [self.values[cell], self.values[cell + 1]],
            curvatures: [self.curvatures[cell], self.curvatures[cell + 1]],
        }
    }

    /// Index of the sample held at a time, or just before it.
    fn held(&self, t: f64, before: bool) -> usize {
        let Some(cell) = self.cell(t) else {
            return 0;
        };
        let near = NEARNESS * (self.times[cell + 1] - self.times[cell]);
        // A time that differs from a sample by rounding is that sample.
        if (t - self.times[cell]).abs() <= near {
            cell.saturating_sub(usize::from(before))
        } else if t >= self.times[cell + 1] - near {
            let after_end = t > self.times[cell + 1] + near;
            cell + usize::from(after_end || !before)
        } else {
            cell
        }
    }

    /// Interval between samples that contains a time, the first or the last one outside the samples; at a sample the later interval.
    /// `None` for a single sample.
    fn cell(&self, t: f64) -> Option<usize> {
        let last = self.times.len().checked_sub(2)?;
        // For equally spaced samples the index is known except for rounding.
        let guess = ((t - self.times[0]) * self.rate) as usize;
        for cell in [guess, guess.saturating_sub(1), guess + 1] {
            if cell <= last && self.times[cell] <= t && t < self.times[cell + 1] {
                return Some(cell);
            }
        }
        let after = self.times.partition_point(|&time| time <= t);
        Some(after.saturating_sub(1).min(last))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times with spacings from 0.05 to 0.25.
    fn irregular(count: usize) -> Vec<f64> {
        let mut t = -0.4;
        let step = |i: usize| 0.15 + 0.1 * (1.7 * i as f64).sin();
        (0..count)
            .map(|i| {
                t += step(i);
                t
            })
            .collect()
    }

    fn sampled(times: &[f64], f: impl Fn(f64) -> f64, interpolation: Interpolation) -> Signal {
        let values = times.iter().map(|&t| f(t)).collect();
        Signal::new(times.to_vec(), values, interpolation).unwrap()
    }

    #[test]
    fn cubics_are_exact_with_their_derivatives() {
        let cubic = |t: f64| 1.0 - 2.0 * t + 0.5 * t * t - 0.75 * t * t * t;
        for count in [4, 5, 6, 40] {
            let times = irregular(count);
            let signal = sampled(&times, cubic, Interpolation::Cubic);
            for i in 0..=200 {
                let part = f64::from(i) / 200.0;
                let t = times[0] + part * (times[count - 1] - times[0]);
                // Values up to about 100; a second derivative divides their rounding errors by the square of the shortest spacing, 1/400.
                assert!((signal.value(t) - cubic(t)).abs() < 1e-12, "{count} {t}");
                let slope = -2.0 + t - 2.25 * t * t;
                assert!((signal.derivative(t) - slope).abs() < 1e-11, "{count} {t}");
                let bend = 1.0 - 4.5 * t;
                assert!(
                    (signal.second_derivative(t) - bend).abs() < 1e-9,
                    "{count} {t}"
                );
            }
        }
    }

    #[test]
    fn few_samples_define_lines_and_parabolas() {
        let times = irregular(3);
        let parabola = |t: f64| 3.0 - t + 2.0 * t * t;
        let signal = sampled(&times, parabola, Interpolation::Cubic);
        for t in [times[0], 0.1, times[2]] {
            assert!((signal.value(t) - parabola(t)).abs() < 1e-14);
            assert!((signal.derivative(t) - (4.0 * t - 1.0)).abs() < 1e-13);
            assert!((signal.second_derivative(t) - 4.0).abs() < 1e-12);
        }
        let line = sampled(&times[..2], |t| 2.0 * t, Interpolation::Cubic);
        assert!((line.value(-0.1) + 0.2).abs() < 1e-15);
        assert_eq!(line.second_derivative(-0.1), 0.0);
        let one = sampled(&times[..1], |_| 7.0, Interpolation::Cubic);
        assert_eq!((one.value(0.0), one.derivative(0.0)), (7.0, 0.0));
    }

    #[test]
    fn the_spline_converges_with_order_four() {
        let error = |count: usize| {
            let spacing = 6.0 / (count - 1) as f64;
            let values = (0..count).map(|i| (i as f64 * spacing).sin()).collect();
            let signal = Signal::equally_spaced(0.0, spacing, values, Interpolation::Cubic);
            let signal = signal.unwrap();
            let errors = (0..=1000).map(|i| {
                let t = 6.0 * f64::from(i) / 1000.0;
                (signal.value(t) - t.sin()).abs()
            });
            errors.fold(0.0, f64::max)
        };
        let order = (error(41) / error(81)).log2();
        assert!((3.7..4.6).contains(&order), "{order}");
    }

    #[test]
    fn the_three_interpolations_pass_through_the_samples() {
        let times = irregular(30);
        for interpolation in [
            Interpolation::Hold,
            Interpolation::Linear,
            Interpolation::Cubic,
        ] {
            let signal = sampled(&times, |t| (5.0 * t).cos(), interpolation);
            for (t, y) in times.iter().zip(signal.values()) {
                assert!((signal.value(*t) - y).abs() < 1e-15, "{interpolation:?}");
            }
        }
    }

    #[test]
    fn held_signals_jump_at_samples() {
        let spacing = 0.1;
        let values: Vec<f64> = (0..1001).map(f64::from).collect();
        let signal = Signal::equally_spaced(0.0, spacing, values, Interpolation::Hold).unwrap();
        for i in 1..1000 {
            let index = f64::from(i);
            // Also where a time computed differently differs by rounding.
            for t in [
                index * spacing,
                index / 10.0,
                index * spacing * (1.0 - 1e-15),
            ] {
                assert_eq!(signal.value(t), index, "{t}");
                assert_eq!(signal.value_before(t), index - 1.0, "{t}");
            }
            let t = (index + 0.5) * spacing;
            assert_eq!((signal.value(t), signal.value_before(t)), (index, index));
        }
        assert_eq!((signal.value(0.0), signal.value_before(0.0)), (0.0, 0.0));
        assert_eq!(signal.value(100.0), 1000.0);
        assert_eq!(signal.value_before(100.0), 999.0);
        assert_eq!((signal.value(-5.0), signal.value(500.0)), (0.0, 1000.0));
        assert_eq!(signal.value_before(500.0), 1000.0);
    }

    #[test]
    fn lines_have_slopes() {
        let signal = Signal::new(
            vec![0.0, 1.0, 3.0],
            vec![0.0, 2.0, 0.0],
            Interpolation::Linear,
        );
        let signal = signal.unwrap();
        assert_eq!((signal.value(0.5), signal.value(2.0)), (1.0, 1.0));
        assert_eq!(
            (signal.derivative(0.5), signal.derivative(1.0)),
            (2.0, -1.0)
        );
        assert_eq!((signal.value(-1.0), signal.value(9.0)), (0.0, 0.0));
    }

    #[test]
    fn spans_are_covered_to_within_rounding() {
        let signal =
            Signal::equally_spaced(0.0, 0.1, vec![0.0; 11], Interpolation::Linear).unwrap();
        assert!(signal.covers(0.0, 1.0));
        assert!(signal.covers(-1e-9, 1.0 + 1e-9));
        assert!(!signal.covers(-1e-3, 1.0));
        assert!(!signal.covers(0.0, 1.001));
    }

    #[test]
    fn invalid_signals_are_rejected() {
        for (times, values) in [
            (vec![], vec![]),
            (vec![0.0, 1.0], vec![1.0]),
            (vec![0.0, 0.0], vec![1.0, 2.0]),
            (vec![0.0, f64::NAN], vec![1.0, 2.0]),
            (vec![0.0, 1.0], vec![1.0, f64::INFINITY]),
        ] {
            assert_eq!(Signal::new(times, values, Interpolation::Cubic), None);
        }
        let close = Signal::new(
            vec![0.0, 1e-310, 1.0, 2.0],
            vec![0.0, 1.0, 0.0, 1.0],
            Interpolation::Cubic,
        );
        assert_eq!(close, None);
        let still = Signal::equally_spaced(0.0, 0.1, vec![1.0], Interpolation::Hold).unwrap();
        assert!(still.value(f64::NAN) == 1.0);
    }
}
