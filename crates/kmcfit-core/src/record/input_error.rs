//! Errors of a measured input.

use crate::signal::Interpolation;
use crate::system::{Grid, InputQuantity};

/// What the errors of an input are errors of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InputNoiseKind {
    /// Noise of the sensor of the input: the system received the true input, which differs from the samples.
    Sensor,
    /// Unmeasured part of the drive: the system received the samples and further, independent input.
    Drive,
}

/// Independent errors of the samples of an input, of one standard deviation. Whatever the interpolation of the input, its errors are linear
/// between the samples: at the samples they are the same, and at a frequency `f` of samples `h` apart their spectrum differs from that of
/// a smooth interpolation by the factor `sinc^4(f h)`, 2 % at 18 samples a period.
#[derive(Debug, Clone, PartialEq)]
pub struct InputNoise {
    /// The input.
    pub quantity: InputQuantity,
    /// Kind of the errors.
    pub kind: InputNoiseKind,
    /// Standard deviation, in the SI unit of the input.
    pub sigma: f64,
    /// Times of the samples of the input, s, increasing; at least two.
    pub times: Vec<f64>,
    /// Interpolation of the input.
    pub interpolation: Interpolation,
}

impl InputNoise {
    /// For each of the first `nodes` nodes of `grid` the index of the input sample before it, at most the last but one, and the
    /// fraction of the way to the next sample, from 0 to 1.
    pub fn positions(&self, grid: &Grid, nodes: usize) -> Vec<(usize, f64)> {
        let position = |i: usize| self.position(grid.time(i));
        (0..nodes).map(position).collect()
    }

    /// Index of the input sample before time `t` (s), at most the last but one, and the fraction of the way to the next one.
    pub fn position(&self, t: f64) -> (usize, f64) {
        let later = self.times.partition_point(|time| *time <= t);
        let before = later.saturating_sub(1).min(self.times.len() - 2);
        let [left, right] = [self.times[before], self.times[before + 1]];
        (before, ((t - left) / (right - left)).clamp(0.0, 1.0))
    }

    /// Value at time `t` (s) of the errors `values` of the samples.
    pub fn at(&self, values: &[f64], t: f64) -> f64 {
        let (before, fraction) = self.position(t);
        values[before] * (1.0 - fraction) + values[before + 1] * fraction
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_lie_between_samples_and_values_are_linear_between_them() {
        let error = InputNoise {
            quantity: InputQuantity::Force,
            kind: InputNoiseKind::Sensor,
            sigma: 1.0,
            times: vec![0.0, 1.0, 3.0],
            interpolation: Interpolation::Linear,
        };
        let grid = Grid::new(-0.5, 4.0, 9).unwrap();
        let positions = error.positions(&grid, 9);
        let expected = [
            (0, 0.0),
            (0, 0.0),
            (0, 0.5),
            (1, 0.0),
            (1, 0.25),
            (1, 0.5),
            (1, 0.75),
            (1, 1.0),
            (1, 1.0),
        ];
        assert_eq!(positions, expected);
        let values = [4.0, 2.0, 6.0];
        assert_eq!(
            [0.5, 2.0, 9.0].map(|t| error.at(&values, t)),
            [3.0, 4.0, 6.0]
        );
    }
}
