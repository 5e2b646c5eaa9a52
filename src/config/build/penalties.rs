//! Penalties: `smooth` and `variation` of the functions.

use super::fit::{is_equation_error, method};
use super::functions::{slots, values};
use crate::config::ModelFile;
use crate::config::scalar::{Sigma, Weight};
use crate::config::spec::{SmoothSpec, WeightRule};
use crate::error::InputError;
use kmcfit_core::internals::functions::{Basis, Penalty, Variation};
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::solvers::{self, Measurements};

/// A weight that is still to be chosen from the data.
#[derive(Debug, Clone, PartialEq)]
pub struct WeightSearch {
    /// How it is chosen.
    pub rule: solvers::WeightRule,
    /// The penalties that it multiplies, by their places in the problem.
    pub penalties: Vec<usize>,
}

/// Adds the penalties of all functions to the problem; those whose weight is still to be chosen have
/// weight 1.
pub(super) fn build(
    file: &ModelFile,
    problem: &mut Problem,
    measured: Option<&Measurements>,
    warnings: &mut Vec<String>,
) -> Result<Option<WeightSearch>, InputError> {
    let mut search: Option<WeightSearch> = None;
    for (j, slot) in slots(file).iter().enumerate() {
        let smooth = slot.spec.smooth.iter();
        for (place, spec) in smooth.flat_map(|list| list.iter()) {
            let key = format!("{}.smooth{place}", slot.key);
            let weight = match spec.weight {
                Weight::Number(weight) => weight.0,
                Weight::Rule(WeightRule::Period) => {
                    has_period(file, &key, spec)?;
                    measured.map_or(0.0, |m| m.period_weight(problem, j, spec.order.0))
                }
                Weight::Rule(rule) => {
                    can_choose(file, &key, rule, search.as_ref())?;
                    1.0
                }
            };
            let Some(basis) = problem
                .functions
                .iter()
                .nth(j)
                .and_then(|f| f.basis.clone())
            else {
                continue;
            };
            let penalty = penalty(file, problem, (j, &basis), &key, spec, weight)?;
            if penalty.rows.is_empty() {
                warnings.push(format!(
                    "{key} says nothing: this derivative of a {} function is zero",
                    basis.name()
                ));
                continue;
            }
            if let Weight::Rule(rule) = spec.weight
                && let Some(rule) = meant(rule)
            {
                let search = search.get_or_insert_with(|| WeightSearch {
                    rule,
                    penalties: Vec::new(),
                });
                search.penalties.push(problem.penalties.len());
            }
            if weight > 0.0 {
                let added = problem.penalize(penalty);
                added.map_err(|why| file.error_at(&key, why.to_string()))?;
            }
        }
    }
    Ok(search)
}

/// Adds the total variation of the functions to the problem.
pub(super) fn add_variations(file: &ModelFile, problem: &mut Problem) -> Result<(), InputError> {
    let grid = problem.oscillator.grid;
    let bases: Vec<Option<Basis>> = problem.functions.iter().map(|f| f.basis.clone()).collect();
    for (j, (slot, basis)) in slots(file).iter().zip(bases).enumerate() {
        let weight = slot.spec.variation.as_ref().map_or(0.0, |v| v.weight.0);
        if let (Some(basis), true) = (basis, weight > 0.0) {
            let added = problem.penalize_variation(Variation {
                function: j,
                weight,
                rows: basis.changes(&grid),
            });
            added.map_err(|why| file.error_at(&slot.key, why.to_string()))?;
        }
    }
    Ok(())
}

fn penalty(
    file: &ModelFile,
    problem: &Problem,
    (j, basis): (usize, &Basis),
    key: &str,
    spec: &SmoothSpec,
    weight: f64,
) -> Result<Penalty, InputError> {
    let grid = &problem.oscillator.grid;
    let rows = basis.roughness(grid, spec.order.0);
    let mut penalty = Penalty::new(j, spec.order.0, weight, rows);
    if let Some(reference) = &spec.reference {
        let key = format!("{key}.reference");
        let values = values(file, grid, &key, reference)?;
        // The part of the reference outside the basis adds a constant to the cost and nothing else.
        let nearest = basis.project(grid, &values).ok_or_else(|| {
            file.error_at(&key, "the reference cannot be turned into this basis")
                .found(format!("`{}`", basis.name()))
                .expected("a basis whose functions the nodes can tell apart")
        })?;
        penalty.rows.set_right(penalty.residuals(&nearest));
    }
    Ok(penalty)
}

/// The rule by which a weight is searched for; `None` for one that computes it.
fn meant(rule: WeightRule) -> Option<solvers::WeightRule> {
    match rule {
        WeightRule::Discrepancy => Some(solvers::WeightRule::Discrepancy),
        WeightRule::LCurve => Some(solvers::WeightRule::LCurve),
        WeightRule::Gcv => Some(solvers::WeightRule::Gcv),
        WeightRule::Period => None,
    }
}

/// Refuses the rule `period` where it has no meaning.
fn has_period(file: &ModelFile, key: &str, spec: &SmoothSpec) -> Result<(), InputError> {
    if !is_equation_error(file) {
        return Err(file
            .error_at(
                &format!("{key}.weight"),
                "the rule `period` is a rule of the method `equation-error` alone",
            )
            .found(format!("`{}`", method(file)))
            .expected(
                "`l-curve`, `gcv`, `discrepancy`, a number, or `fit.method: equation-error`",
            ));
    }
    if spec.order.0 == 0 {
        return Err(file
            .error_at(
                &format!("{key}.order"),
                "the rule `period` is about a derivative",
            )
            .found(0)
            .expected("order 1 or 2, or a number for the weight"));
    }
    Ok(())
}

/// Refuses a second rule, and a rule that the readings give no footing.
fn can_choose(
    file: &ModelFile,
    key: &str,
    rule: WeightRule,
    search: Option<&WeightSearch>,
) -> Result<(), InputError> {
    let key = format!("{key}.weight");
    if is_equation_error(file) {
        return Err(file
            .error_at(
                &key,
                "the method `equation-error` knows no search for the weight",
            )
            .found(format!("`{rule}`"))
            .expected("`period`, which follows from the motion, or a number"));
    }
    if let Some(first) = search.filter(|first| Some(first.rule) != meant(rule)) {
        return Err(file
            .error_at(&key, "there is one rule for all weights that are chosen")
            .found(format!("`{rule}` beside `{}`", first.rule.name()))
            .expected("the same rule, or a number"));
    }
    // Which channels there are was checked when they were read; `estimate` is no known noise.
    let known = |sigma: &Option<Sigma>| sigma.as_ref().is_some_and(|s| *s != Sigma::Estimate);
    let with_sigma = |e: &crate::config::spec::ExperimentSpec| {
        let any = |s: &crate::config::spec::SigmaSpec| {
            let all = [&s.displacement, &s.velocity, &s.acceleration];
            all.iter().any(|s| known(s)) && !all.iter().any(|s| **s == Some(Sigma::Estimate))
        };
        e.sigma.as_ref().is_some_and(any)
    };
    let fitted = |e: &&crate::config::spec::ExperimentSpec| e.hold_out != Some(true);
    let mut experiments = file.spec.experiments.iter().enumerate();
    let without = experiments
        .find(|(_, e)| fitted(e) && !with_sigma(e))
        .map(|(i, _)| i);
    match without {
        Some(i) if rule == WeightRule::Discrepancy => Err(file
            .error_at(
                &key,
                "the rule `discrepancy` needs the noise of the readings",
            )
            .found(format!("no `sigma` in experiments[{i}]"))
            .expected("`sigma` in every experiment, or `l-curve` or `gcv`, which do without")),
        _ => Ok(()),
    }
}
