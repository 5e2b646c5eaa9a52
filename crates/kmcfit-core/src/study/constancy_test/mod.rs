//! Constancy test: a likelihood-ratio test of a constant against a time-varying coefficient function.
//!
//! For each function the model is fitted twice, as stated and with that function constant. The statistic is
//!
//! ```text
//! LR = J(constant) - J(varying)                     if sigma is known
//!    = n ln(J(constant) / J(varying))               otherwise, n samples
//! ```
//!
//! with the full cost `J`, penalties and priors included. Penalties invalidate the chi-square distribution of `LR` under
//! the null hypothesis (the function is constant), so the distribution is simulated: samples of the constant model with
//! seeded normal noise are fitted by both models, linearised at the constant optimum. The p-value is
//! `(1 + number of simulated LR not below the observed one) / (1 + simulations)`.
//!
//! Limits: the linearised models include penalties and priors but no inequality constraints. Active bounds of the varying
//! model alone bias the test towards constant, an active bound of the constant biases it towards varying. The simulated
//! noise is normal also where the loss is robust.
//!
//! Source: A. C. Davison, D. V. Hinkley, *Bootstrap Methods and their Application*, Cambridge 1997,
//! section 4.2.

mod linearised;
mod reduced;

use super::refit::{nearest, settings, sizes};
use crate::problem::Problem;
use crate::simulate::SimulationError;
use crate::solvers::fit_from;
use crate::threads::map_with_progress;
use linearised::LinearisedModels;
use reduced::ConstantModel;

/// Result of the constancy test of one function.
#[derive(Debug, Clone, PartialEq)]
pub struct ConstancyTest {
    /// Name of the function.
    pub function: String,
    /// Index in the list of functions.
    pub index: usize,
    /// Likelihood ratio `LR`.
    pub statistic: f64,
    /// p-value of `LR` under the constant model.
    pub p_value: f64,
    /// Number of simulations.
    pub simulations: usize,
    /// BIC of the constant model minus that of the varying one, `LR - (extra parameters) ln n`: positive values favour the
    /// varying model. Penalised parameters count in full, so with penalties the value is biased towards constant.
    pub bic: f64,
    /// Best-fitting constant, in the unit of the function.
    pub constant: f64,
    /// Unit of the function.
    pub unit: String,
    /// Significance level.
    pub level: f64,
}

impl ConstancyTest {
    /// Rejection of the constant model at the significance level.
    pub fn varies(&self) -> bool {
        self.p_value <= self.level
    }

    /// Result as a sentence.
    pub fn sentence(&self) -> String {
        let Self {
            function,
            p_value,
            statistic,
            ..
        } = self;
        match self.varies() {
            true => format!(
                "likelihood-ratio test rejects a constant {function} (p = {p_value:.3}): the best constant raises the \
                 cost by {statistic:.1}"
            ),
            false => format!(
                "likelihood-ratio test does not reject a constant {function}, {:.6} {} (p = {p_value:.2}): variation \
                 lowers the cost by {statistic:.1}",
                self.constant, self.unit
            ),
        }
    }
}

/// Settings of the constancy test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConstancySettings {
    /// Significance level, for example 0.05.
    pub level: f64,
    /// Number of simulations.
    pub simulations: usize,
    /// Seed of the simulations.
    pub seed: u64,
    /// Largest number of threads; results do not depend on it.
    pub threads: usize,
}

impl Default for ConstancySettings {
    fn default() -> Self {
        Self {
            level: 0.05,
            simulations: 399,
            seed: 1,
            threads: 1,
        }
    }
}

/// Tests every function with several parameters, starting from the fitted parameters `optimum`.
///
/// # Errors
/// A [`SimulationError`] if the simulation fails at the optimum or at the constant that replaces a function.
pub fn constancy_tests(
    problem: &Problem,
    optimum: &[f64],
    how: &ConstancySettings,
) -> Result<Vec<ConstancyTest>, SimulationError> {
    let varies = |f: &usize| problem.functions.ranges()[*f].len() > 1;
    let each = (0..problem.functions.ranges().len()).filter(varies);
    each.map(|f| of_function(problem, optimum, f, how))
        .collect()
}

/// Tests function `function` alone.
///
/// # Errors
/// As [`constancy_tests`].
pub fn of_function(
    problem: &Problem,
    optimum: &[f64],
    function: usize,
    how: &ConstancySettings,
) -> Result<ConstancyTest, SimulationError> {
    let reduced = ConstantModel::new(problem, function);
    let start = reduced.mean_of(optimum);
    let sizes_of = sizes(&reduced.problem, &start);
    let start = nearest(&reduced.problem, &start, &sizes_of).unwrap_or(start);
    let constant = fit_from(&reduced.problem, &start, &settings())?.best;
    let embedded = reduced.embed(&constant.parameters);
    let there = fit_from(problem, optimum, &settings())?
        .best
        .evaluation
        .cost;
    let here = fit_from(problem, &embedded, &settings())?
        .best
        .evaluation
        .cost;
    let samples = problem.sample_count() as f64;
    let sigma = problem.channels().all(|c| c.weighting().is_sigma());
    let ratio = |constant: f64, varying: f64| match sigma {
        true => constant - varying,
        false => samples * (constant / varying.max(f64::MIN_POSITIVE)).ln(),
    };
    let statistic = ratio(constant.evaluation.cost, there.min(here));
    let evaluation = problem.evaluate(&embedded)?;
    let linear = LinearisedModels::new(problem, &reduced, &embedded, &evaluation);
    let simulated = map_with_progress(how.simulations, how.threads, |index| {
        let [constant, varying] = linear.costs(how.seed, index);
        ratio(constant, varying)
    });
    let above = simulated.iter().filter(|s| **s >= statistic).count();
    let list = problem.functions.get(function);
    let extra = (problem.parameters() - reduced.problem.parameters()) as f64;
    Ok(ConstancyTest {
        function: list.name(),
        index: function,
        statistic,
        p_value: (1 + above) as f64 / (1 + how.simulations) as f64,
        simulations: how.simulations,
        bic: statistic - extra * samples.ln(),
        constant: constant.parameters[reduced.place],
        unit: list.quantity.unit().to_owned(),
        level: how.level,
    })
}
