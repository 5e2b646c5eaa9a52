//! Settings of a fit: grid, stepper and method; gradient, stopping tests and cost of the solver.

use super::table::{number, pairs};
use crate::report::FittedModel;
use crate::report::document::ResultDocument;
use kmcfit_core::internals::solvers::Stopping;

/// Table of the settings.
pub(super) fn settings(document: &ResultDocument) -> String {
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
        (
            "terms",
            std::iter::once("mass")
                .chain(model.terms.iter().map(String::as_str))
                .collect::<Vec<_>>()
                .join(", "),
        ),
        ("parameters", model.parameters.to_string()),
    ];
    if let Some(weights) = &document.weights {
        let weight = format!("{} by {}", number(weights.weight), weights.rule);
        rows.push(("penalty weight", weight));
    }
    pairs(&rows)
}

/// Gradient, stopping tests and cost.
pub(super) fn solver(run: &FittedModel, document: &ResultDocument) -> String {
    let model = &document.model;
    pairs(&[
        ("gradient", model.gradient.clone()),
        ("stop", stopping(&run.model.settings.stopping)),
        ("cost", model.cost_definition.clone()),
    ])
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
