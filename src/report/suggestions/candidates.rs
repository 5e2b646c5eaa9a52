//! The candidate that is preferred to the model as a change of the model file, or as what is to be measured.

use super::records::{about_delay, about_disturbance};
use super::{Step, Suggestion, written};
use crate::config::Model;
use crate::report::document::ResultDocument;
use kmcfit_core::candidates::RecordParameter;
use kmcfit_core::candidates::{Addition, Candidate};
use kmcfit_core::functions::Basis;
use kmcfit_core::signal::median_spacing;
use kmcfit_core::system::InputQuantity;

/// Suggestions about candidates that are preferred to the model or as good: the changes of the model by them, and a measurement that would tell
/// them apart.
pub(super) fn about_candidates(
    candidates: &[Candidate],
    are_preferred: bool,
    document: &ResultDocument,
    model: &Model,
) -> Vec<Suggestion> {
    let changes = candidates.iter().filter(|_| are_preferred);
    let changes = changes.filter_map(|candidate| {
        let overrides = overrides(candidate, document, model)?;
        let words = format!("add {}", candidate.words);
        Some(Suggestion::change("add", words, overrides))
    });
    changes
        .chain(measurement(candidates, !are_preferred))
        .collect()
}

/// The measurement that tells candidates apart.
fn measurement(candidates: &[Candidate], is_beside_model: bool) -> Option<Suggestion> {
    let additions = || candidates.iter().flat_map(|c| &c.additions);
    let depends_on_amplitude = additions().any(|a| matches!(a, Addition::Term(..)));
    let depends_on_time = is_beside_model
        || additions().any(|a| matches!(a, Addition::Variation { .. } | Addition::Jump { .. }));
    let several_terms = additions()
        .filter(|a| matches!(a, Addition::Term(..)))
        .count()
        > 1;
    let is_tied = is_beside_model || candidates.len() > 1;
    (is_tied && depends_on_amplitude && (depends_on_time || several_terms)).then(|| {
        Suggestion::outside(
            "second_amplitude",
            "measure a record at a second amplitude (half or twice) and fit both: it shows whether the coefficients depend on time or on amplitude",
        )
    })
}

/// Overrides of the model file that add a candidate, with the numbers of the experiments in the file; `None` for what no key states.
pub fn overrides_of(
    candidate: &Candidate,
    document: &ResultDocument,
    model: &Model,
) -> Option<Vec<String>> {
    let own = overrides(candidate, document, model)?;
    let change = Suggestion::change("add", "", own).in_file(&model.positions);
    match change.step {
        Step::Change(overrides) => Some(overrides),
        _ => None,
    }
}

/// Overrides of the model file that add a candidate; `None` for what no key states.
fn overrides(
    candidate: &Candidate,
    document: &ResultDocument,
    model: &Model,
) -> Option<Vec<String>> {
    let mut all = Vec::new();
    if candidate.to_constants {
        let several = model
            .problem
            .functions
            .iter()
            .filter(|f| f.parameters() > 1);
        let names = several.map(|f| f.owner.is_none().then(|| f.quantity.name()));
        for name in names {
            all.push(format!("functions.{}={{basis: constant}}", name?));
        }
    }
    for addition in &candidate.additions {
        match addition {
            Addition::Disturbance { experiment } => {
                all.extend(noise_of_input(*experiment, candidate, document, model)?);
            }
            other => all.push(change(*other, candidate, document, model)?),
        }
    }
    (!all.is_empty()).then_some(all)
}

/// Overrides that state the noise of a measured input.
fn noise_of_input(
    e: usize,
    candidate: &Candidate,
    document: &ResultDocument,
    model: &Model,
) -> Option<Vec<String>> {
    let name = &document.experiments.get(e)?.name;
    let sigma = candidate.estimates.first()?.value;
    let input = input(model, e)?;
    match about_disturbance(document, model, name, input.name(), sigma)?.step {
        Step::Change(overrides) => Some(overrides),
        _ => None,
    }
}

fn change(
    addition: Addition,
    candidate: &Candidate,
    document: &ResultDocument,
    model: &Model,
) -> Option<String> {
    let is_single = candidate.additions.len() == 1;
    let estimate = |i: usize| {
        candidate
            .estimates
            .get(i)
            .filter(|_| is_single)
            .map(|q| q.value)
    };
    let key = |function: usize| {
        let own = model.problem.functions.get(function);
        (own.owner.is_none() && !own.is_known_part).then(|| own.quantity.name())
    };
    let sensor = |e: usize, c: usize, parameter: &str| {
        let channel = model.problem.experiments[e].channels[c].kind().name();
        format!("experiments.{e}.sensors.{channel}.{parameter}=estimate")
    };
    Some(match addition {
        Addition::Term(kind, law) => {
            let width = law
                .width()
                .map(|width| format!(", width: {}", written(width)));
            let width = width.unwrap_or_default();
            let start = written(estimate(0).unwrap_or(0.0));
            format!(
                "functions.{}={{basis: constant, start: {start}{width}}}",
                kind.name()
            )
        }
        Addition::Variation { function, next, .. } => {
            format!(
                "functions.{}={{basis: polynomial, degree: {next}}}",
                key(function)?
            )
        }
        Addition::FinerBasis { function, halvings } => {
            let own = model.problem.functions.get(function);
            let basis = own.basis.as_ref()?;
            let grid = &model.problem.system.grid;
            let (name, times) = (key(function)?, 1 << halvings);
            match basis {
                Basis::Polynomial { degree } => {
                    format!("functions.{name}.degree={}", times * (degree + 1) - 1)
                }
                _ => {
                    let intervals = basis.knot_times(grid).len() - 1;
                    format!("functions.{name}.knots={}", times * intervals + 1)
                }
            }
        }
        Addition::Jump { function, time } => {
            let grid = &model.problem.system.grid;
            let half = 0.5 * grid.step();
            let node = ((time - grid.start()) / grid.step()).round();
            let middle = grid.start() + node * grid.step();
            let (start, end) = (grid.start(), grid.start() + grid.duration());
            let levels = match (estimate(1), estimate(2)) {
                (Some(a), Some(b)) => format!(
                    ", start: [{}, {}, {}]",
                    written(a),
                    written(0.5 * (a + b)),
                    written(b)
                ),
                _ => String::new(),
            };
            format!(
                "functions.{}={{basis: piecewise-constant, knots: [{start:?}, {:?}, {:?}, {end:?}]{levels}}}",
                key(function)?,
                middle - half,
                middle + half
            )
        }
        Addition::Record(parameter) => match parameter {
            RecordParameter::Offset(e, c) => sensor(e, c, "offset"),
            RecordParameter::Drift(e, c) => sensor(e, c, "drift"),
            RecordParameter::Gain(e, c) => sensor(e, c, "gain"),
            RecordParameter::Delay(e) => {
                let channel = model.problem.experiments[e].channels.first()?;
                let samples = estimate(0)? / median_spacing(channel.times());
                let name = &document.experiments.get(e)?.name;
                match about_delay(document, name, samples)?.step {
                    Step::Change(mut overrides) => overrides.pop()?,
                    _ => return None,
                }
            }
            RecordParameter::Rate(_) => return None,
        },
        Addition::CubicInputs => {
            let (e, input) = (0..model.problem.experiments.len())
                .find_map(|e| input(model, e).map(|input| (e, input)))?;
            let part = match input {
                InputQuantity::Force => "force",
                InputQuantity::BaseAcceleration => "base",
            };
            format!("experiments.{e}.{part}.interpolation=cubic")
        }
        Addition::Disturbance { .. }
        | Addition::InputPulses { .. }
        | Addition::SensorCurve { .. }
        | Addition::Tone { .. }
        | Addition::SecondMode { .. } => return None,
    })
}

/// The measured input of an experiment.
fn input(model: &Model, e: usize) -> Option<InputQuantity> {
    let own = &model.problem.experiments[e].input;
    match (&own.force, &own.base) {
        (Some(_), _) => Some(InputQuantity::Force),
        (None, Some(_)) => Some(InputQuantity::BaseAcceleration),
        _ => None,
    }
}
