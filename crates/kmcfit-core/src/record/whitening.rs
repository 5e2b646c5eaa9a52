//! Whitening of the residuals of a channel and of rows of the Jacobian.

use super::{Channel, Loss, NoiseEstimate, NoiseModel, ScoreCovariance, Weighting};
use crate::noise::Correlation;

/// Quadratic majorant `sum_i (root_i (e_i + de_i))^2` of a channel's misfit at a point: `e` are the residuals, whitened
/// ([`Channel::whiten_rows`]) where the noise is correlated.
pub struct Majorant {
    /// Roots of the weights.
    pub weight_roots: Vec<f64>,
    /// `root_i e_i`.
    pub weighted: Vec<f64>,
}

impl Channel {
    /// Sets the model of the noise.
    #[must_use]
    pub fn with_noise_model(mut self, model: NoiseModel) -> Self {
        self.noise_model = model;
        self
    }

    /// Sets the estimated noise; a correlation requires samples with a sigma.
    ///
    /// # Panics
    /// If a correlation is given for samples without sigma.
    #[must_use]
    pub fn with_noise(mut self, noise: NoiseEstimate) -> Self {
        assert!(
            noise.correlation.is_none() || self.weighting().is_sigma(),
            "correlated noise needs a sigma"
        );
        self.noise = noise;
        self
    }

    /// Model of the noise.
    pub fn noise_model(&self) -> NoiseModel {
        self.noise_model
    }

    /// Estimated noise.
    pub fn noise(&self) -> &NoiseEstimate {
        &self.noise
    }

    /// Estimated correlation of the noise; `None` for white noise.
    pub fn correlation(&self) -> Option<&Correlation> {
        self.noise.correlation.as_ref()
    }

    /// The channel with its noise moved by `step` in the coordinate `index` of [`NoiseEstimate::covariance`].
    #[must_use]
    pub fn with_moved_noise(&self, index: usize, step: f64) -> Self {
        let mut moved = self.clone();
        let index = match (self.weighting(), index) {
            (Weighting::Estimated { sigma }, 0) => {
                let sigma = sigma * step.exp();
                return moved.with_weighting(Weighting::Estimated { sigma });
            }
            (Weighting::Estimated { .. }, later) => later - 1,
            (_, index) => index,
        };
        moved.noise.correlation = moved.noise.correlation.map(|correlation| {
            let mut coordinates = correlation.coordinates();
            coordinates[index] += step;
            correlation.at(&coordinates)
        });
        moved
    }

    /// Residuals as the likelihood contains them: `r`, or for correlated noise `sigma_i W (r/sigma)`, the innovations scaled to
    /// the standard deviation of the noise.
    pub fn innovations(&self, predicted: &[f64]) -> Vec<f64> {
        match self.correlation() {
            None => self.residuals(predicted).collect(),
            Some(_) => {
                let normalised = self.normalised_innovations(predicted).into_iter();
                let each = normalised.enumerate();
                each.map(|(i, e)| e * self.sigma_of(i)).collect()
            }
        }
    }

    /// Changes `rows` of predictions, one per sample, to rows of the quadratic majorant up to its weight_roots: `W (rows/sigma)` for
    /// correlated noise, unchanged otherwise.
    pub fn whiten_rows(&self, rows: &mut [f64]) {
        if let Some(correlation) = self.correlation() {
            self.over_sigma(rows);
            let whitened = correlation.whiten(rows);
            rows.copy_from_slice(&whitened);
        }
    }

    /// Quadratic majorant of the misfit at predictions.
    pub fn majorant(&self, predicted: &[f64]) -> Majorant {
        let (mut weighted, weight_roots): (Vec<f64>, Vec<f64>) = match self.correlation() {
            None => {
                let each = self.residuals(predicted).enumerate();
                each.map(|(i, r)| (r, self.weight(i, r).sqrt())).unzip()
            }
            Some(_) => {
                let each = self.normalised_innovations(predicted).into_iter();
                each.map(|e| (e, self.loss().weight(e).sqrt())).unzip()
            }
        };
        let pairs = weighted.iter_mut().zip(&weight_roots);
        pairs.for_each(|(r, root)| *r *= root);
        Majorant {
            weighted,
            weight_roots,
        }
    }

    /// Factor of the standard errors' inverse by the loss, beside the roots of [`Channel::majorant`]; 1 for least squares.
    pub fn information_root(&self, predicted: &[f64]) -> f64 {
        if self.loss() == Loss::Squares || !self.weighting().is_sigma() {
            return 1.0;
        }
        let normalised = match self.correlation() {
            Some(_) => self.normalised_innovations(predicted),
            None => {
                let each = self.residuals(predicted).enumerate();
                each.map(|(i, r)| r / self.sigma_of(i)).collect()
            }
        };
        let has_score_covariance = self.noise().scores == ScoreCovariance::Kernel;
        let ratio = self
            .loss()
            .information_ratio(&normalised, has_score_covariance);
        ratio.sqrt()
    }

    /// `W (r/sigma)`, of unit variance.
    pub(super) fn normalised_innovations(&self, predicted: &[f64]) -> Vec<f64> {
        let mut residuals: Vec<f64> = self.residuals(predicted).collect();
        self.whiten_rows(&mut residuals);
        residuals
    }

    /// Misfit under correlated noise: `sum rho(e)` over the innovations.
    pub(super) fn correlated_cost(&self, predicted: &[f64]) -> f64 {
        let innovations = self.normalised_innovations(predicted).into_iter();
        innovations.map(|e| self.loss().cost(e)).sum()
    }

    /// Difference of [`Channel::correlated_cost`] without cancellation under least squares.
    pub(super) fn correlated_difference(&self, from: &[f64], to: &[f64]) -> f64 {
        if self.loss() != Loss::Squares {
            return self.correlated_cost(to) - self.correlated_cost(from);
        }
        let pairs = from.iter().zip(to);
        let mut change: Vec<f64> = pairs.map(|(y, moved)| moved - y).collect();
        self.whiten_rows(&mut change);
        let [before, after] = [from, to].map(|p| self.normalised_innovations(p));
        let sums = before.iter().zip(&after).map(|(a, b)| a + b);
        change.iter().zip(sums).map(|(d, s)| d * s).sum()
    }

    /// Derivatives of [`Channel::correlated_cost`] by the predictions.
    pub(super) fn correlated_slopes(
        &self,
        correlation: &Correlation,
        predicted: &[f64],
    ) -> Vec<f64> {
        let innovations = self.normalised_innovations(predicted).into_iter();
        let slopes: Vec<f64> = innovations
            .map(|e| 2.0 * self.loss().weight(e) * e)
            .collect();
        let mut slopes = correlation.whiten_transpose(&slopes);
        self.over_sigma(&mut slopes);
        slopes
    }

    fn over_sigma(&self, values: &mut [f64]) {
        for (i, value) in values.iter_mut().enumerate() {
            *value /= self.sigma_of(i);
        }
    }

    fn sigma_of(&self, i: usize) -> f64 {
        self.weighting().sigma(i).unwrap_or(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::{Autoregression, CorrelationLaw};
    use crate::record::ChannelKind;
    use crate::system::Grid;

    fn channel(loss: Loss) -> Channel {
        let grid = Grid::new(0.0, 3.0, 31).unwrap();
        let times = grid.times();
        let values = times.iter().map(|t| (3.0 * t).sin()).collect();
        let sigmas = times.iter().map(|t| 0.1 + 0.02 * t).collect();
        let weighting = Weighting::Sigmas(sigmas);
        let process = Autoregression::new(vec![0.8, -0.3]).unwrap();
        let law = CorrelationLaw::Autoregressive(process);
        let correlation = Correlation::new(law, &times);
        Channel::new(
            ChannelKind::Displacement,
            times,
            values,
            weighting,
            &grid,
            31,
        )
        .unwrap()
        .with_loss(loss)
        .with_noise(NoiseEstimate {
            correlation,
            ..NoiseEstimate::default()
        })
    }

    /// Slopes against central differences, the difference of two costs, and the majorant's value and slope.
    #[test]
    fn slopes_and_majorant_of_correlated_noise_belong_to_its_cost() {
        let losses = [Loss::Squares, Loss::Huber { threshold: 1.3 }];
        for loss in losses {
            let channel = channel(loss);
            let predicted: Vec<f64> = (0..31).map(|i| 0.3 * (0.2 * i as f64).cos()).collect();
            let slopes = channel.slopes(&predicted);
            let majorant = channel.majorant(&predicted);
            for j in [0, 1, 2, 15, 30] {
                let h = 1e-6;
                let mut sides = [predicted.clone(), predicted.clone()];
                sides[0][j] -= h;
                sides[1][j] += h;
                let slope = channel.cost_difference(&sides[0], &sides[1]) / (2.0 * h);
                assert!((slope - slopes[j]).abs() < 1e-6 * slopes[j].abs().max(1.0));
                let mut unit = vec![0.0; 31];
                unit[j] = 1.0;
                channel.whiten_rows(&mut unit);
                let rows = unit
                    .iter()
                    .zip(&majorant.weight_roots)
                    .zip(&majorant.weighted);
                let by_rows: f64 = rows.map(|((u, root), r)| 2.0 * u * root * r).sum();
                assert!((by_rows - slopes[j]).abs() < 1e-10 * slopes[j].abs().max(1.0));
            }
            if loss == Loss::Squares {
                let squares: f64 = majorant.weighted.iter().map(|r| r * r).sum();
                assert!((squares - channel.cost(&predicted)).abs() < 1e-12 * squares);
            }
        }
    }
}
