//! What was asked for.

use super::table::{number, pairs};
use crate::report::FittedModel;
use crate::report::document::ResultDocument;
use kmcfit_core::internals::solvers::Stopping;

/// Grid, method, cost and stopping rules.
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
            "forces",
            std::iter::once("mass")
                .chain(model.terms.iter().map(String::as_str))
                .collect::<Vec<_>>()
                .join(", "),
        ),
        ("free values", model.parameters.to_string()),
        ("stop", stopping(&run.model.settings.stopping)),
        ("cost", model.cost_definition.clone()),
    ];
    if let Some(weights) = &document.weights {
        let weight = format!("{} by {}", number(weights.weight), weights.rule);
        rows.push(("weight of the smoothness", weight));
    }
    pairs(&rows)
}

/// The rules by which the fit stops, in the words of the model file.
fn stopping(rules: &Stopping) -> String {
    let mut said = vec![format!("iterations {}", rules.iterations)];
    let rule = |name: &str, value: Option<f64>| Some(format!("{name} {:e}", value?));
    said.extend(rule("cost_ratio", rules.cost_ratio));
    said.extend(rule("gradient_ratio", rules.gradient_ratio));
    said.extend(rule("tolerance", rules.tolerance));
    said.extend(rule("step", rules.step));
    said.extend(
        rules
            .limit
            .map(|limit| format!("seconds {}", limit.as_secs_f64())),
    );
    said.join(", ")
}
