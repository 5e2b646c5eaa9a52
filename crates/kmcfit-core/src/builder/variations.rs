//! Total-variation penalties of a builder.

use super::penalties::WeightSearch;
use super::{BuildError, Builder};
use crate::functions::{Basis, TotalVariation, WeightRule};
use crate::model::{PenaltyKind, WeightChoice};
use crate::problem::Problem;

impl Builder {
    /// Adds a total-variation penalty to the problem, with weight 1 where a rule chooses it; returns the search for the weight, which
    /// is `search` for a given weight.
    pub(super) fn add_variation(
        &self,
        problem: &mut Problem,
        function: (usize, &Basis),
        key: &str,
        weight: WeightChoice,
        search: Option<WeightSearch>,
    ) -> Result<Option<WeightSearch>, BuildError> {
        let (weight, search) = match weight {
            WeightChoice::Number(weight) => (weight, search),
            WeightChoice::Rule(WeightRule::Bic) => {
                self.check_bic(function.1, key, search.as_ref())?;
                let penalties = vec![problem.variations.len()];
                let rule = WeightRule::Bic;
                (1.0, Some(WeightSearch { rule, penalties }))
            }
            WeightChoice::Rule(rule) => return Err(other_rule(key, rule.name())),
        };
        if weight > 0.0 {
            let (function, basis) = function;
            let rows = basis.changes(&problem.system.grid);
            let added = problem.penalize_variation(TotalVariation {
                function,
                weight,
                rows,
            });
            added.map_err(|why| BuildError::new(key, why.to_string()))?;
        }
        Ok(search)
    }

    /// Error where the rule `bic` does not apply: without levels or a likelihood, and beside another rule or penalty.
    fn check_bic(
        &self,
        basis: &Basis,
        key: &str,
        search: Option<&WeightSearch>,
    ) -> Result<(), BuildError> {
        let at = format!("{key}.weight");
        if self.is_equation_error() {
            let problem = "the method `equation-error` has no search for the weight";
            return Err(BuildError::new(at, problem)
                .found("`bic`")
                .expected("a number, or `method: gauss-newton`"));
        }
        if !matches!(basis, Basis::Nodal | Basis::PiecewiseConstant { .. }) {
            let problem = "the rule `bic` needs a basis of levels";
            return Err(BuildError::new(at, problem)
                .found(format!("`{}`", basis.name()))
                .expected(
                    "`basis: piecewise-constant` or `basis: nodal`, or a number for the weight",
                ));
        }
        if let Some(other) = self.other_rule(search) {
            let problem = "the rule `bic` is the only rule of a model, for one function";
            return Err(BuildError::new(at, problem)
                .found(format!("`bic` beside `{other}`"))
                .expected("one rule, and numbers for the other weights"));
        }
        let own = key
            .rsplit_once(".penalty")
            .map_or(key, |(function, _)| function);
        let mut entries = self.entries().into_iter();
        if entries.any(|entry| entry.key == own && entry.spec.penalties().len() > 1) {
            let problem = "a function with the rule `bic` has no other penalty";
            return Err(BuildError::new(at, problem)
                .found("several penalties of the function")
                .expected("`{kind: tv, weight: bic}` alone"));
        }
        match self.without_likelihood() {
            None => Ok(()),
            Some(i) => Err(
                BuildError::new(at, "the rule `bic` needs a likelihood of the samples")
                    .found(format!("no `sigma` in experiments[{i}]"))
                    .expected("`sigma` in every experiment, a number or `estimate`; or a number for the weight"),
            ),
        }
    }

    /// Name of another rule for a weight in the model, besides the first `bic`.
    fn other_rule(&self, search: Option<&WeightSearch>) -> Option<&'static str> {
        let entries = self.entries();
        let penalties = entries.iter().flat_map(|entry| entry.spec.penalties());
        let mut rules = penalties.filter_map(|penalty| match (penalty.kind, penalty.weight) {
            (_, WeightChoice::Rule(WeightRule::Period)) => None,
            (PenaltyKind::Tikhonov, WeightChoice::Rule(rule)) => Some(rule.name()),
            _ => None,
        });
        rules.next().or(search.map(|first| first.rule.name()))
    }
}

/// Error for a rule that applies to Tikhonov penalties only.
fn other_rule(key: &str, rule: &str) -> BuildError {
    let problem = "the weight of total variation has the rule `bic` only";
    BuildError::new(format!("{key}.weight"), problem)
        .found(format!("`{rule}`"))
        .expected("`bic`, or a finite number")
}
