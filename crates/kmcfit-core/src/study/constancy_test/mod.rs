//! Does a function vary at all?
//!
//! For each function the model is fitted as it is and with that function constant. The statistic is
//! the likelihood ratio
//!
//! ```text
//! LR = J(constant) - J(varying)                     with sigma
//!    = n ln(J(constant) / J(varying))               without, n samples
//! ```
//!
//! on whole costs, penalties and priors included. Its distribution when the function is constant is
//! not a chi-square once there are penalties, so it is simulated: samples of the constant model
//! with seeded normal noise, both models refitted to their linearisation at the constant optimum,
//! penalties and priors included, inequality constraints left out: bounds that hold the varying model
//! alone make the test err towards constant, one that holds the constant itself towards varying. The
//! p-value is `(1 + how many simulated LR are at least the observed) / (1 + simulations)`.
//!
//! The noise is normal: with a robust loss the p-value is only as good as that.
//!
//! Source: A. C. Davison, D. V. Hinkley, *Bootstrap Methods and their Application*, Cambridge 1997,
//! section 4.2.

mod linearised;
mod reduced;

use super::parallel::map;
use super::refit::{nearest, settings, sizes};
use crate::problem::Problem;
use crate::simulate::SimulationError;
use crate::solvers::fit_from;
use linearised::LinearisedModels;
use reduced::ConstantModel;

/// The verdict on one function.
#[derive(Debug, Clone, PartialEq)]
pub struct ConstancyTest {
    /// Its name.
    pub function: String,
    /// Index in the list of functions.
    pub index: usize,
    /// The likelihood ratio.
    pub statistic: f64,
    /// Its p-value under the constant model.
    pub p_value: f64,
    /// Simulations behind it.
    pub simulations: usize,
    /// BIC of the constant model less that of the varying one, every parameter counted, `LR - (extra
    /// parameters) ln n`: positive speaks for varying. Penalised parameters count in full, so with
    /// penalties it is too hard on them.
    pub bic: f64,
    /// The constant that fits best, in the unit of the function.
    pub constant: f64,
    /// Its unit.
    pub unit: String,
    /// Largest p-value called varying.
    pub level: f64,
}

impl ConstancyTest {
    /// Whether the samples say that it varies.
    pub fn varies(&self) -> bool {
        self.p_value <= self.level
    }

    /// In words.
    pub fn sentence(&self) -> String {
        let Self {
            function,
            p_value,
            statistic,
            ..
        } = self;
        match self.varies() {
            true => format!(
                "{function} varies: a constant would fit worse by {statistic:.1}, which chance brings \
                 with a probability of {p_value:.3}"
            ),
            false => format!(
                "{function} may be constant, {:.6} {}: varying lowers the misfit by {statistic:.1}, \
                 as chance does with a probability of {p_value:.2}",
                self.constant, self.unit
            ),
        }
    }
}

/// How the question is asked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConstancySettings {
    /// Largest p-value called varying, as 0.05.
    pub level: f64,
    /// Simulated records.
    pub simulations: usize,
    /// Their seed.
    pub seed: u64,
    /// Most threads; the result does not depend on it.
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

/// The verdict on every function that could vary, from `optimum`, where the problem was fitted.
///
/// # Errors
/// A [`SimulationError`] if the optimum, or a constant in its place, has no response.
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

/// The verdict on function `function` alone.
///
/// # Errors
/// As [`variation`].
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
    let simulated = map(how.simulations, how.threads, |index| {
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
