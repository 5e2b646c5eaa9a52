//! Settings of a fit: grid, stepper, method, gradient, stopping tests and cost.

use super::table::{number, pairs};
use crate::report::FittedModel;
use crate::report::document::ResultDocument;
use kmcfit_core::internals::solvers::Stopping;

/// Table of the settings.
pub(super) fn settings(run: &FittedModel, document: &ResultDocument) -> String {
    let model = &document.model;
    let end = model.start + model.duration;
    let mut rows = vec![
        (
            "time",
            format!(
                "{} to {} s on {} nodes, step {} s",
                number(model.start),
                number(end),
                model.nodes,
                number(model.step)
            ),
        ),
        ("stepper", model.stepper.clone()),
        ("method", model.method.clone()),
        ("gradient", model.gradient.clone()),
        (
            "terms",
            std::iter::once("mass")
                .chain(model.terms.iter().map(String::as_str))
                .collect::<Vec<_>>()
                .join(", "),
        ),
        ("parameters", model.parameters.to_string()),
        ("stop", stopping(&run.model.settings.stopping)),
        ("cost", model.cost_definition.clone()),
    ];
    if let Some(weights) = &document.weights {
        let weight = format!("{} by {}", number(weights.weight), weights.rule);
        rows.push(("penalty weight", weight));
    }
    pairs(&rows)
}

/// Stopping tests, with the keys of the model file.
fn stopping(rules: &Stopping) -> String {
    let mut tests = vec![format!("iterations {}", rules.iterations)];
    let rule = |name: &str, value: Option<f64>| Some(format!("{name} {:e}", value?));
    tests.extend(rule("cost_ratio", rules.cost_ratio));
    tests.extend(rule("gradient_ratio", rules.gradient_ratio));
    tests.extend(rule("tolerance", rules.tolerance));
    tests.extend(rule("step", rules.step));
    tests.extend(
        rules
            .limit
            .map(|limit| format!("seconds {}", limit.as_secs_f64())),
    );
    tests.join(", ")
}
