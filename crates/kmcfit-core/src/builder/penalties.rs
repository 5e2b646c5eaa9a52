//! Penalties of a builder: Tikhonov penalties of its functions.

use super::coefficient::{history, values_at_nodes};
use super::{BuildError, BuildNotice, Builder};
use crate::constraints::TimeHistory;
use crate::functions::{Basis, Penalty, WeightRule};
use crate::model::{PenaltyKind, PenaltySpec, WeightChoice};
use crate::problem::Problem;
use crate::record::Weighting;
use crate::solvers::Measurements;
use crate::system::Grid;

/// Highest order of a penalised derivative.
const HIGHEST_ORDER: usize = 2;

/// Penalty weights to be chosen by a rule.
#[derive(Debug, Clone, PartialEq)]
pub struct WeightSearch {
    /// Rule.
    pub rule: WeightRule,
    /// Indices of the penalties that share the weight; their weight in the problem is 1.
    pub penalties: Vec<usize>,
}

impl Builder {
    /// Adds the penalties to the problem; penalties whose weight is chosen by a rule have weight 1.
    pub(super) fn add_penalties(
        &self,
        problem: &mut Problem,
        measured: Option<&Measurements>,
        notices: &mut Vec<BuildNotice>,
    ) -> Result<Option<WeightSearch>, BuildError> {
        let mut search: Option<WeightSearch> = None;
        for (j, entry) in self.entries().iter().enumerate() {
            let Some(basis) = problem.functions.get(j).basis.clone() else {
                continue;
            };
            for (suffix, spec) in entry.spec.penalty.iter().flat_map(|list| list.iter()) {
                let key = format!("{}.penalty{suffix}", entry.key);
                if spec.kind == PenaltyKind::TotalVariation {
                    let function = (j, &basis);
                    search = self.add_variation(problem, function, &key, spec.weight, search)?;
                    continue;
                }
                let order = spec.order.unwrap_or_default();
                let (factor, rule) = match spec.weight {
                    WeightChoice::Number(weight) => (weight, None),
                    WeightChoice::Rule(WeightRule::Period) => {
                        self.check_period(&key, order)?;
                        let weight = measured.map(|m| m.period_weight(problem, j, order));
                        (weight.unwrap_or(0.0), None)
                    }
                    WeightChoice::Rule(rule) => {
                        self.check_rule(&key, rule, search.as_ref())?;
                        (1.0, Some(rule))
                    }
                };
                let mut penalty = Penalty::new(
                    j,
                    order,
                    factor,
                    basis.roughness(&problem.system.grid, order),
                );
                if let Some(reference) = &spec.reference {
                    let reference = &history(reference, &key)?;
                    let residuals = residuals_at(problem, &basis, &key, reference, &penalty)?;
                    penalty.rows.set_right(residuals);
                }
                if penalty.rows.is_empty() {
                    let basis = basis.name();
                    notices.push(BuildNotice::NoRoughness { key, basis });
                    continue;
                }
                penalty.rule = rule;
                if let Some(rule) = rule.filter(|rule| *rule != WeightRule::RestrictedLikelihood) {
                    let search = search.get_or_insert_with(|| WeightSearch {
                        rule,
                        penalties: Vec::new(),
                    });
                    search.penalties.push(problem.penalties.len());
                }
                if factor > 0.0 {
                    let added = problem.penalize(penalty);
                    added.map_err(|why| BuildError::new(&key, why.to_string()))?;
                }
            }
        }
        Ok(search)
    }

    /// Error if the rule `period` does not apply.
    fn check_period(&self, key: &str, order: usize) -> Result<(), BuildError> {
        if !self.is_equation_error() {
            let problem = "the rule `period` applies to the method `equation-error` only";
            return Err(BuildError::new(format!("{key}.weight"), problem)
                .found(format!("`{}`", self.solver.name()))
                .expected("`reml`, `discrepancy`, a number, or `fit.method: equation-error`"));
        }
        if order == 0 {
            let problem = "the rule `period` requires a penalty on a derivative";
            return Err(BuildError::new(format!("{key}.order"), problem)
                .found(0)
                .expected("order 1 or 2, or a number for the weight"));
        }
        Ok(())
    }

    /// Error for a second rule, and for a rule that needs the noise level of the samples where none is given.
    fn check_rule(
        &self,
        key: &str,
        rule: WeightRule,
        search: Option<&WeightSearch>,
    ) -> Result<(), BuildError> {
        let key = format!("{key}.weight");
        if rule == WeightRule::Bic {
            let problem = "the rule `bic` applies to total variation only";
            return Err(BuildError::new(key, problem)
                .found("`kind: tikhonov`")
                .expected("`kind: tv`, or `reml`, `discrepancy` or a number"));
        }
        if self.is_equation_error() {
            let problem = "the method `equation-error` has no search for the weight";
            return Err(BuildError::new(key, problem)
                .found(format!("`{}`", rule.name()))
                .expected("`period`, which follows from the response, or a number"));
        }
        if let Some(first) = search.filter(|first| first.rule != rule) {
            let problem = "all weights chosen by a rule must have the same rule";
            return Err(BuildError::new(key, problem)
                .found(format!("`{}` beside `{}`", rule.name(), first.rule.name()))
                .expected("the same rule, or a number"));
        }
        let (found, problem, expected) = match rule {
            WeightRule::Discrepancy => (
                self.records.iter().position(|record| {
                    let mut weightings = record.channels.iter().map(|c| c.weighting.as_ref());
                    !record.validation && weightings.any(|w| w.is_none_or(is_unknown))
                }),
                "the rule `discrepancy` needs the noise of the samples",
                "`sigma` in every experiment, or `reml` with `estimate`",
            ),
            WeightRule::RestrictedLikelihood => (
                self.without_likelihood(),
                "the rule `reml` needs a likelihood of the samples",
                "`sigma` in every experiment, a number or `estimate`",
            ),
            WeightRule::Bic | WeightRule::Period => return Ok(()),
        };
        match found {
            Some(i) => Err(BuildError::new(key, problem)
                .found(format!("no `sigma` in experiments[{i}]"))
                .expected(expected)),
            None => Ok(()),
        }
    }
}

/// True if the standard deviation of the noise is not given.
fn is_unknown(weighting: &Weighting) -> bool {
    !matches!(weighting, Weighting::Sigma(_) | Weighting::Sigmas(_))
}

/// Residuals of a penalty at its reference.
fn residuals_at(
    problem: &Problem,
    basis: &Basis,
    key: &str,
    reference: &TimeHistory,
    penalty: &Penalty,
) -> Result<Vec<f64>, BuildError> {
    let grid = &problem.system.grid;
    let key = format!("{key}.reference");
    let values = values_at_nodes(reference, &key, grid.nodes())?;
    // The part of the reference outside the basis adds a constant to the cost.
    let nearest = basis.project(grid, &values).ok_or_else(|| {
        BuildError::new(&key, "the reference cannot be projected onto this basis")
            .found(format!("`{}`", basis.name()))
            .expected("a basis whose functions are linearly independent at the nodes")
    })?;
    Ok(penalty.residuals(&nearest))
}

impl PenaltySpec {
    pub(super) fn check(&self, key: &str, grid: &Grid) -> Result<(), BuildError> {
        let error = |part: &str, problem: &str| BuildError::new(format!("{key}.{part}"), problem);
        let order = match (self.kind, self.order) {
            (PenaltyKind::TotalVariation, _) => {
                let others = [
                    ("order", self.order.is_some()),
                    ("reference", self.reference.is_some()),
                ];
                if let Some((other, _)) = others.iter().find(|(_, given)| *given) {
                    let problem = "a penalty on total variation has only a weight";
                    return Err(error(other, problem)
                        .found(format!("`{other}` beside `kind: tv`"))
                        .expected(format!("no `{other}`, or `kind: tikhonov`")));
                }
                1
            }
            (PenaltyKind::Tikhonov, Some(order)) => order,
            (PenaltyKind::Tikhonov, None) => {
                return Err(BuildError::new(key, "the key `order` is missing")
                    .found("a penalty of the kind `tikhonov` alone")
                    .expected("for instance `order: 2`"));
            }
        };
        if order > HIGHEST_ORDER {
            return Err(error("order", "this derivative cannot be penalised")
                .found(order)
                .expected("0 (the value), 1 (the slope) or 2 (the curvature)"));
        }
        if let WeightChoice::Number(weight) = self.weight {
            check_weight(&format!("{key}.weight"), weight)?;
        }
        match &self.reference {
            Some(_) if order > 0 => Err(error(
                "reference",
                "only a penalty of order 0 has a reference",
            )
            .found(format!("a reference with order {order}"))
            .expected("no `reference`, or `order: 0`")),
            Some(given) => {
                let key = format!("{key}.reference");
                values_at_nodes(&history(given, &key)?, &key, grid.nodes()).map(drop)
            }
            None => Ok(()),
        }
    }
}

fn check_weight(key: &str, weight: f64) -> Result<(), BuildError> {
    match weight.is_finite() && weight >= 0.0 {
        true => Ok(()),
        false => Err(BuildError::new(key, "a weight cannot be negative")
            .found(weight)
            .expected("a number, 0 or more")),
    }
}
