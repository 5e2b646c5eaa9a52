//! Definition of the cost J of a problem: kind of the misfit, and the formula as text.

use kmcfit_core::constraints::RowGroup;
use kmcfit_core::functions::{Penalty, Prior};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::Loss;
use kmcfit_core::solvers::{EquationForm, Solver};
use kmcfit_core::structure::CoefficientKind;
use serde::{Deserialize, Serialize};

/// Kind of the misfit in J.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CostKind {
    /// `integral (y - y_obs)^2 dt` for every experiment: no record has a sigma.
    Integral,
    /// `sum ((y - y_obs)/sigma)^2` for every experiment: every record has a sigma.
    ChiSquare,
    /// Some records have a sigma and some have none.
    Mixed,
    /// `integral (m (y'' + b'') + sum_j p_j phi_j(y, y') - f)^2 dt` with the response from the samples.
    EquationError,
}

impl CostKind {
    /// The kind of a problem's misfit, for the solver that fits it.
    pub fn of(problem: &Problem, solver: Solver) -> Self {
        if solver == Solver::EquationError {
            return CostKind::EquationError;
        }
        let kinds: Vec<bool> = (problem.channels())
            .map(|c| !c.weighting().is_sigma())
            .collect();
        match (kinds.contains(&true), kinds.contains(&false)) {
            (true, true) => CostKind::Mixed,
            (false, true) => CostKind::ChiSquare,
            (_, false) => CostKind::Integral,
        }
    }

    fn misfit(self) -> &'static str {
        match self {
            CostKind::Integral => {
                "integral (y - y_obs)^2 dt (trapezoid rule over the samples, m^2 s)"
            }
            CostKind::ChiSquare => {
                "sum over the samples of ((model - sample)/sigma)^2 (chi-square)"
            }
            CostKind::Mixed => {
                "integral (y - y_obs)^2 dt over the records without sigma (trapezoid rule over the \
                 samples, m^2 s) + sum of ((model - sample)/sigma)^2 over the samples with sigma \
                 (chi-square)"
            }
            CostKind::EquationError => {
                "integral (m (y'' + b'') + sum p_j phi_j(y, y') - f)^2 dt over the samples, with y, y' \
                 and y'' from the samples and not from a simulation (N^2 s)"
            }
        }
    }
}

/// Misfit of the equation error in the weak form.
const WEAK_FORM: &str = "integral e^2 dt over averages e of m (y'' + b'') + sum p_j phi_j(y, y') - f by bump functions, with y, y' and \
                         y'' from the samples and not from a simulation (N^2 s)";

/// The formula of J with all factors, as [`Problem::evaluate`] computes it, or for [`Solver::EquationError`] the
/// objective of the fit: the misfit and every penalty with its weight. `form` is that of the equation of motion, if known.
pub fn cost_definition(problem: &Problem, solver: Solver, form: Option<EquationForm>) -> String {
    let quantities: Vec<CoefficientKind> = problem.functions.iter().map(|f| f.quantity).collect();
    let kind = CostKind::of(problem, solver);
    let misfit = match (kind, form) {
        (CostKind::EquationError, Some(EquationForm::Weak)) => WEAK_FORM,
        _ => kind.misfit(),
    };
    let misfit = misfit.to_owned() + &robust(problem, kind);
    let scalars = problem.functions.scalars().iter();
    let scalars = scalars.map(|s| (s.name.clone(), s.prior));
    let known = problem.functions.iter().map(|f| (f.name(), f.prior));
    let priors = known.chain(scalars).filter_map(|(name, prior)| {
        let Prior { mean, sigma } = prior?;
        Some(format!("(({name} - {mean:?})/{sigma:?})^2"))
    });
    let smooth = (problem.penalties.iter()).map(|p| penalty(p, quantities[p.function].symbol()));
    let jumps = problem.variations.iter().map(|variation| {
        let symbol = quantities[variation.function].symbol();
        format!("{:?} * total variation of {symbol}", variation.weight)
    });
    let terms: Vec<String> = std::iter::once(misfit)
        .chain(smooth)
        .chain(jumps)
        .chain(problem.soft.iter().map(soft))
        .chain(priors)
        .collect();
    format!("J = {}", terms.join(" + "))
}

/// The robust losses, as text.
fn robust(problem: &Problem, kind: CostKind) -> String {
    let mut said: Vec<String> = Vec::new();
    for channel in problem.channels() {
        let squared = match kind {
            CostKind::EquationError => {
                "e^2 of an error e of the equation is s^2 u^2, u = e/s, s = 1.4826 median |e|, and u^2"
                    .to_owned()
            }
            _ => format!("u^2 of the {}", channel.kind().name()),
        };
        let words = match channel.loss() {
            Loss::Squares => continue,
            Loss::Huber { threshold } => format!(
                ", where {squared} is 2*{threshold:?}*|u| - {threshold:?}^2 beyond |u| = \
                 {threshold:?} (Huber)"
            ),
            Loss::StudentT { degrees } => format!(
                ", where {squared} is ({degrees:?} + 1) ln(1 + u^2/{degrees:?}) (Student's t)"
            ),
        };
        if !said.contains(&words) {
            said.push(words);
        }
    }
    said.concat()
}

fn penalty(penalty: &Penalty, symbol: &str) -> String {
    let integrand = match penalty.order {
        0 if penalty.rows.right().iter().all(|t| *t == 0.0) => format!("{symbol}^2"),
        0 => format!("({symbol} - reference)^2"),
        1 => format!("(d{symbol}/dt)^2"),
        q => format!("(d^{q}{symbol}/dt^{q})^2"),
    };
    format!("{:?} * integral {integrand} dt", penalty.weight)
}

fn soft(group: &RowGroup) -> String {
    let weight = group.soft.unwrap_or(0.0);
    let name = &group.name;
    format!("{weight:?} * mean over its rows of (excess beyond `{name}`)^2")
}
