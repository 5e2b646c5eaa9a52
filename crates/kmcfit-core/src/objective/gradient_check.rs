//! Check of a gradient: the steps of its differences, and whether its errors are those of an exact gradient.

use super::GradientKind;
use crate::problem::Problem;
use crate::simulate::SimulationError;

/// Most step sizes: where the error still falls after 40 decades, nothing can be said of the gradient.
const MOST_STEPS: usize = 81;
/// A curve that ends by falling in proportion to the step, by sqrt(10) from one to the next, has not
/// met a floor yet; this is a little less.
const FALLS: f64 = 2.5;

/// The errors of one gradient on one grid.
#[derive(Debug, Clone, PartialEq)]
pub struct GradientCheck {
    /// Nodes of the time grid.
    pub nodes: usize,
    /// Which adjoint gave the gradient.
    pub kind: GradientKind,
    /// Step along the negative L2 gradient.
    pub step: Vec<f64>,
    /// `|(J(p - a g) - J(p))/a + G^2| / G^2` at each step `a`.
    pub error: Vec<f64>,
}

impl GradientCheck {
    /// The discrete gradient passes if its error falls below this at some step. An error in the gradient is a floor; an
    /// exact gradient is only limited by truncation and rounding, which leave 1e-7 or less at N = 128,000.
    pub const PASS: f64 = 1e-6;

    /// Whether the error is as small as that of an exact gradient.
    pub fn passes(&self) -> bool {
        self.best().1 <= Self::PASS
    }

    /// Whether the error still falls with the step at the smallest one, so that smaller steps show more of it.
    fn falls(&self) -> bool {
        let tail = &self.error[self.error.len().saturating_sub(4)..];
        tail.len() == 4 && tail.windows(2).all(|w| w[0] > FALLS * w[1])
    }

    /// The step with the least error, and that error.
    pub fn best(&self) -> (f64, f64) {
        let pairs = self.step.iter().copied().zip(self.error.iter().copied());
        pairs.fold((f64::NAN, f64::INFINITY), |best, pair| {
            if pair.1 < best.1 { pair } else { best }
        })
    }
}

impl Problem {
    /// Step sizes of a check: two per decade over ten decades, the largest being the power of ten nearest to `10 J/G^2`. A
    /// step `a` lowers J by `a G^2` to first order, so the same part of J is lowered whatever the unit of J; for the
    /// paper's run the steps are 1 to 1e-10. `None` where the gradient vanishes.
    ///
    /// # Errors
    /// A [`SimulationError`] if there is no response.
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

    /// The errors of a gradient at these steps, and at smaller ones where the error still falls at the last.
    ///
    /// # Errors
    /// A [`SimulationError`] if there is no response.
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
