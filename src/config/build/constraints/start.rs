//! A start inside the constraints, or the constraints that leave none.

use super::Place;
use crate::config::ModelFile;
use crate::error::{self, InputError};
use kmcfit_core::internals::constraints::TOLERANCE;
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::solvers::StartProjection;

/// Moves the functions' start into the constraints, with a warning unless it only was off by
/// rounding.
pub(in crate::config::build) fn move_start(
    file: &ModelFile,
    problem: &mut Problem,
    places: &[Place],
    warnings: &mut Vec<String>,
) -> Result<(), InputError> {
    if problem.constraints.is_empty() {
        return Ok(());
    }
    let start = problem.functions.start();
    let found = problem.feasible_start(&start);
    let was_inside = problem.constraints.hold(&start, TOLERANCE);
    match found {
        StartProjection::Kept(_) => Ok(()),
        StartProjection::Moved {
            parameters,
            constraint,
        } => {
            if !was_inside {
                let moved = format!("the start was moved into the constraints (`{constraint}`)");
                warnings.push(moved);
            }
            problem.start_from(&parameters);
            Ok(())
        }
        StartProjection::Contradiction(names) => {
            let hint = "leaving out any one of them resolves it";
            Err(contradiction(file, places, &names, hint))
        }
        StartProjection::ContradictionAmong(names) => {
            let hint = "some of them may have no part in it";
            Err(contradiction(file, places, &names, hint))
        }
        StartProjection::Unsolved(status) => Err(file
            .error_at("constraints", "no start inside the constraints was found")
            .found(status.sentence())
            .expected("constraints of moderate sizes that some functions satisfy")),
    }
}

fn contradiction(file: &ModelFile, places: &[Place], names: &[String], hint: &str) -> InputError {
    let mut left: Vec<&Place> = places.iter().collect();
    let mut last: Option<(usize, &str)> = None;
    let mut rows = Vec::new();
    for name in names {
        let Some(i) = left.iter().position(|place| place.name == *name) else {
            rows.push(format!("`{name}`"));
            continue;
        };
        let key = &left.remove(i).key;
        match file.error_at(key, "").place {
            error::Place::Line { line, .. } => {
                rows.push(format!("`{name}` (line {line})"));
                if last.is_none_or(|(before, _)| line >= before) {
                    last = Some((line, key));
                }
            }
            _ => rows.push(format!("`{name}`")),
        }
    }
    let key = last.map_or("constraints", |(_, key)| key);
    let error = match names.len() {
        1 => file.error_at(key, "this constraint contradicts itself"),
        _ => file
            .error_at(key, "these constraints contradict each other")
            .hint(hint),
    };
    error
        .found(super::listed(rows.iter().map(String::as_str)))
        .expected("constraints that some functions satisfy together")
}
