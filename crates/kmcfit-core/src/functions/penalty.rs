//! Tikhonov penalties on the roughness of a function.

use crate::rows::Rows;

/// Rule that chooses the weight of a penalty from the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum WeightRule {
    /// Discrepancy principle: the largest weight whose residuals agree with the noise, chi-square at most `n + 2 sqrt(2 n)`.
    Discrepancy,
    /// Restricted maximum likelihood of noise and smoothness; each penalty has its own weight (Wood 2011).
    #[serde(rename = "reml")]
    RestrictedLikelihood,
    /// Weight at which the function resolves changes within one dominant period of the response.
    Period,
    /// For `tv`: Bayesian information criterion with the number of levels as degrees of freedom; then a fit without the
    /// penalty on the jumps found.
    Bic,
}

impl WeightRule {
    /// Name in a model file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Discrepancy => "discrepancy",
            Self::RestrictedLikelihood => "reml",
            Self::Period => "period",
            Self::Bic => "bic",
        }
    }

    /// True if intervals from the Hessian of the penalised misfit cover on average over the record; with the other rules
    /// they hold for the chosen smoothness alone.
    pub fn gives_coverage(self) -> bool {
        self == Self::RestrictedLikelihood
    }
}

/// Penalty `weight * |L theta_j - target|^2` on one function `j`.
///
/// For the roughness rows `L` of order `q` and no target this is `weight * integral (d^q p/dt^q)^2 dt`, independent of basis and
/// number of nodes. It is kept in residual form: `L^T L` contains powers of `1/dt^4` and loses the digits of a smooth function.
#[derive(Debug, Clone)]
pub struct Penalty {
    /// Index of the function, mass 0.
    pub function: usize,
    /// Order `q` of the derivative.
    pub order: usize,
    /// Weight, in the unit of J per unit of the integral.
    pub weight: f64,
    /// Rule that chooses the weight; `None` for a given one.
    pub rule: Option<WeightRule>,
    /// `L`, rows x parameters of the function, and the target.
    pub rows: Rows,
}

impl Penalty {
    /// Roughness `rows` of order `order` with target zero and a given weight.
    pub fn new(function: usize, order: usize, weight: f64, rows: Rows) -> Self {
        Self {
            function,
            order,
            weight,
            rule: None,
            rows,
        }
    }

    /// Residuals `L theta - target`.
    pub fn residuals(&self, theta: &[f64]) -> Vec<f64> {
        let mut residuals: Vec<f64> = self.rows.right().iter().map(|t| -t).collect();
        self.rows.multiply_add(theta, &mut residuals);
        residuals
    }

    /// Roughness `|L theta - target|^2`, without the weight.
    pub fn roughness(&self, theta: &[f64]) -> f64 {
        self.residuals(theta).iter().map(|r| r * r).sum()
    }

    /// Adds `2 weight L^T (L theta - target)` to the gradient in the function's parameters.
    pub fn add_gradient(&self, theta: &[f64], gradient: &mut [f64]) {
        let mut residuals = self.residuals(theta);
        residuals.iter_mut().for_each(|r| *r *= 2.0 * self.weight);
        self.rows.transpose_multiply_add(&residuals, gradient);
    }
}
