//! Assumptions of a model besides its samples, as text.

use crate::config::Model;
use kmcfit_core::functions::{Basis, CoefficientFunction};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{ChannelKind, Experiment};

/// Assumptions: records, fixed functions, bases with few parameters, constraints, smoothness.
pub fn assumptions(model: &Model) -> Vec<String> {
    let problem = &model.problem;
    let mut known = vec![records(problem)];
    for function in problem.functions.iter() {
        let name = function.name();
        match &function.basis {
            None => known.push(format!("{name} fixed")),
            Some(Basis::Nodal) => {}
            Some(basis) => known.push(match function.parameters() {
                1 => format!("{name} constant"),
                count => format!("{name}: {}, {count} parameters", basis_in_words(basis)),
            }),
        }
    }
    let groups = problem.constraints.groups.iter();
    known.extend(groups.map(|group| with_unit(model, &group.name)));
    known.extend(problem.constraints.cones.iter().map(|c| c.name.clone()));
    for penalty in &problem.penalties {
        let name = problem.functions.get(penalty.function).name();
        known.push(match penalty.order {
            0 => format!("{name}: deviation from its reference penalised"),
            1 => format!("{name}: slope penalised"),
            _ => format!("{name}: curvature penalised"),
        });
    }
    for variation in &problem.variations {
        let name = problem.functions.get(variation.function).name();
        known.push(format!("{name}: total variation penalised"));
    }
    for jumps in &problem.jumps {
        let name = problem.functions.get(jumps.function).name();
        known.push(format!("{name}: constant between jumps"));
    }
    known.extend(problem.soft.iter().map(|g| format!("{} (soft)", g.name)));
    known
}

/// The name of a bound of a function, `mass >= 0.003`, with its unit; other names, and a bound of zero, unchanged.
fn with_unit(model: &Model, name: &str) -> String {
    let is_number = |text: &str| text.parse::<f64>().is_ok_and(|x| x != 0.0);
    let bounds = |function: &&CoefficientFunction| {
        let rest = name.strip_prefix(&function.name());
        let limit = rest.and_then(|rest| {
            [" >= ", " <= ", " = "]
                .iter()
                .find_map(|sign| rest.strip_prefix(sign))
        });
        limit.is_some_and(is_number)
    };
    let unit = model.problem.functions.iter().find(bounds);
    let unit = unit.map_or("", |function| model.unit(function));
    format!("{name} {unit}").trim_end().to_owned()
}

fn basis_in_words(basis: &Basis) -> &str {
    match basis {
        Basis::BSpline { .. } => "B-spline",
        other => other.name(),
    }
}

/// Number and kind of the records.
fn records(problem: &Problem) -> String {
    let free = problem.experiments.iter().filter(|e| e.is_free()).count();
    let forced = problem.experiments.len() - free;
    let count = |n: usize, kind: &str| match n {
        1 => format!("one {kind} record"),
        n => format!("{n} {kind} records"),
    };
    let which = match (free, forced) {
        (0, forced) => count(forced, "forced-vibration"),
        (free, 0) => count(free, "free-vibration"),
        (free, forced) => format!(
            "{} and {}",
            count(free, "free-vibration"),
            count(forced, "forced-vibration")
        ),
    };
    let sees = |e: &Experiment, kind: ChannelKind| e.channels.iter().any(|c| c.kind() == kind);
    let kinds = ChannelKind::ALL
        .into_iter()
        .filter(|kind| problem.experiments.iter().any(|e| sees(e, *kind)));
    let kinds: Vec<&str> = kinds.map(ChannelKind::name).collect();
    format!("{which} of {}", kinds.join(", "))
}
