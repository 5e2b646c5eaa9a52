//! Gradient check against finite differences: step sizes, errors and the pass criterion.

use super::GradientKind;
use crate::problem::Problem;
use crate::simulate::SimulationError;

/// Largest number of step sizes, 40 decades.
const MOST_STEPS: usize = 81;
/// Decrease of the error from one step to the next (a factor sqrt(10) in the step) from which the error counts as still
/// proportional to the step.
const FALLS: f64 = 2.5;

/// Errors of one gradient on one grid.
#[derive(Debug, Clone, PartialEq)]
pub struct GradientCheck {
    /// Nodes of the time grid.
    pub nodes: usize,
    /// Adjoint that computed the gradient.
    pub kind: GradientKind,
    /// Steps `a` along the negative L2 gradient.
    pub step: Vec<f64>,
    /// Errors `|(J(p - a g) - J(p))/a + G^2| / G^2` at each step `a`.
    pub error: Vec<f64>,
}

impl GradientCheck {
    /// Largest error of a correct discrete gradient at its best step. An incorrect gradient has an error floor; a correct one
    /// is limited by truncation and rounding errors, 1e-7 or less at N = 128,000.
    pub const PASS: f64 = 1e-6;

    /// True if the error at the best step is below [`GradientCheck::PASS`].
    pub fn passes(&self) -> bool {
        self.best().1 <= Self::PASS
    }

    /// True if the error still decreases at the smallest step, where smaller steps are needed.
    fn falls(&self) -> bool {
        let tail = &self.error[self.error.len().saturating_sub(4)..];
        tail.len() == 4 && tail.windows(2).all(|w| w[0] > FALLS * w[1])
    }

    /// Step with the least error, and the error.
    pub fn best(&self) -> (f64, f64) {
        let pairs = self.step.iter().copied().zip(self.error.iter().copied());
        pairs.fold((f64::NAN, f64::INFINITY), |best, pair| {
            if pair.1 < best.1 { pair } else { best }
        })
    }
}

impl Problem {
    /// Step sizes of a check: two per decade over ten decades, the largest being the power of ten nearest to `10 J/G^2`. A
    /// step `a` lowers J by `a G^2` to first order, so the steps lower the same share of J in every unit; for the paper's run
    /// they are 1 to 1e-10. `None` where the gradient vanishes.
    ///
    /// # Errors
    /// A [`SimulationError`] if the simulation at `theta` fails.
    pub fn check_steps(&self, theta: &[f64]) -> Result<Option<Vec<f64>>, SimulationError> {
        let here = self.evaluate(theta)?;
        let norm_squared = self
            .gradient(theta, &here, GradientKind::Discrete)
            .norm_squared;
        let decade = (10.0 * here.cost / norm_squared).log10().round();
        let decade = if decade.is_finite() { decade } else { 0.0 };
        let step = |i| 10f64.powf(decade - 0.5 * f64::from(i));
        Ok((norm_squared > 0.0).then(|| (0..=20).map(step).collect()))
    }

    /// Computes the errors of a gradient at `steps`, and at smaller steps where the error still decreases at the last one.
    ///
    /// # Errors
    /// A [`SimulationError`] if the simulation at `theta` fails.
    pub fn check_gradient(
        &self,
        theta: &[f64],
        kind: GradientKind,
        steps: &[f64],
    ) -> Result<GradientCheck, SimulationError> {
        let mut steps = steps.to_vec();
        loop {
            let errors = self.gradient_error(theta, kind, &steps)?;
            let check = GradientCheck {
                nodes: self.system.grid.nodes(),
                kind,
                step: errors.iter().map(|e| e.step).collect(),
                error: errors.iter().map(|e| e.error).collect(),
            };
            if check.passes() || !check.falls() || steps.len() >= MOST_STEPS {
                return Ok(check);
            }
            let last = steps.last().map_or(0.0, |step| step.log10());
            steps.extend((1..=10).map(|i| 10f64.powf(last - 0.5 * f64::from(i))));
        }
    }
}
