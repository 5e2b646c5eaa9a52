//! What the functions must satisfy: `constraints`, and the functions' own `min` and `max`.

mod gauge;
mod start;
mod statement;

pub(super) use start::move_start;

use super::functions::{Assemblies, slots};
use super::listed;
use crate::config::ModelFile;
use crate::config::spec::ConstraintSpec;
use crate::error::InputError;
use kmcfit_core::internals::constraints::{Constraints, Impossible, Statement};
use kmcfit_core::internals::functions::CoefficientKind;
use kmcfit_core::internals::problem::Problem;

/// The name of a group of rows, and the key of the model that it comes from.
pub(super) struct Place {
    name: String,
    key: String,
}

/// Adds all constraints of the model to the problem.
pub(super) fn build(
    file: &ModelFile,
    problem: &mut Problem,
    assemblies: &Assemblies,
    warnings: &mut Vec<String>,
) -> Result<Vec<Place>, InputError> {
    let mut places = Vec::new();
    for slot in slots(file) {
        let (key, quantity, spec) = (&slot.key, slot.quantity, slot.spec);
        let device = slot.owner.map_or(0, |i| assemblies.of_experiment[i]);
        let given = [
            (format!("{key}.min"), &spec.min, &None),
            (format!("{key}.max"), &None, &spec.max),
        ];
        // Both at once, so that equal ones become an equality.
        let both = [(format!("{key}.min"), &spec.min, &spec.max)];
        let list = match spec.min == spec.max {
            true => &both[..],
            false => &given[..],
        };
        for (key, min, max) in list.iter().filter(|(_, a, b)| a.is_some() || b.is_some()) {
            let parent = key.rsplit_once('.').map_or("", |(parent, _)| parent);
            let grid = &problem.oscillator.grid;
            let bounds = statement::bounds(file, grid, parent, quantity, (min, max))?;
            let at = At {
                key,
                soft: None,
                device,
            };
            add(file, problem, &at, &bounds, &mut places, warnings)?;
        }
    }
    let Some(list) = &file.spec.constraints else {
        return Ok(places);
    };
    if list.is_empty() {
        return Err(file
            .error_at("constraints", "there is no constraint")
            .found("an empty list")
            .expected("at least one constraint, or no `constraints`"));
    }
    for (i, spec) in list.iter().enumerate() {
        let key = format!("constraints[{i}]");
        let soft = soft(file, &key, spec)?;
        for (key, statement) in statement::read(file, &problem.oscillator.grid, &key, spec)? {
            let at = At {
                key: &key,
                soft,
                device: 0,
            };
            add(file, problem, &at, &statement, &mut places, warnings)?;
        }
    }
    Ok(places)
}

/// Where a statement stands, what breaking it costs, and which device it is about.
struct At<'a> {
    key: &'a str,
    soft: Option<f64>,
    device: usize,
}

/// Adds the rows of one statement to the problem.
fn add(
    file: &ModelFile,
    problem: &mut Problem,
    &At { key, soft, device }: &At,
    statement: &Statement,
    places: &mut Vec<Place>,
    warnings: &mut Vec<String>,
) -> Result<(), InputError> {
    if soft.is_none() {
        leaves_a_mass(file, key, statement)?;
    }
    let built = statement.build_for(&problem.oscillator.grid, &problem.functions, device);
    let mut rows = built.map_err(|why| impossible(file, key, why))?;
    if rows.is_empty() {
        warnings.push(format!("{key} says nothing: it holds for all functions"));
    }
    warnings.extend(gauge::says_nothing(file, problem, statement, key));
    rows.groups.iter_mut().for_each(|group| group.soft = soft);
    places.extend(names(&rows).map(|name| Place {
        name: name.clone(),
        key: key.to_owned(),
    }));
    let added = problem.constrain(rows);
    added.map_err(|why| file.error_at(key, why.to_string()))
}

/// The equation of motion needs a mass above zero: what holds it at or below is refused.
fn leaves_a_mass(file: &ModelFile, key: &str, statement: &Statement) -> Result<(), InputError> {
    let held = match statement {
        Statement::Bounds {
            of: CoefficientKind::Mass,
            max: Some(max),
            ..
        } => max.least(),
        Statement::Value {
            of: CoefficientKind::Mass,
            value,
            ..
        }
        | Statement::Mean {
            of: CoefficientKind::Mass,
            value,
        }
        | Statement::Integral {
            of: CoefficientKind::Mass,
            value,
        } => *value,
        _ => return Ok(()),
    };
    if held > 0.0 {
        return Ok(());
    }
    Err(file
        .error_at(key, "this leaves no mass: it must be positive at all times")
        .found(held)
        .expected("a number greater than 0"))
}

fn names(constraints: &Constraints) -> impl Iterator<Item = &String> {
    let rows = constraints.groups.iter().map(|group| &group.name);
    rows.chain(constraints.cones.iter().map(|group| &group.name))
}

fn impossible(file: &ModelFile, key: &str, why: Impossible) -> InputError {
    match why {
        Impossible::Absent(quantity) => {
            file.error_at(key, format!("the device has no {}", quantity.name()))
        }
        Impossible::Fixed(list) => {
            let names = listed(list.iter().map(|q| q.name()));
            let problem = match list.len() {
                1 => format!("{names} is fixed, so it cannot be constrained"),
                _ => format!("{names} are fixed, so they cannot be constrained"),
            };
            file.error_at(key, problem)
                .found("a constraint on fixed functions only")
                .expected("`basis` and `start` instead of `fixed`, or no such constraint")
        }
        Impossible::Broken { name, time } => file
            .error_at(key, "no fit can satisfy this constraint")
            .found(format!("`{name}` is broken at {time} s by what is given"))
            .expected("functions with more freedom, or another constraint"),
    }
}

fn soft(file: &ModelFile, key: &str, spec: &ConstraintSpec) -> Result<Option<f64>, InputError> {
    let Some(weight) = spec.soft else {
        return Ok(None);
    };
    let at = format!("{key}.soft");
    if weight.0 <= 0.0 {
        return Err(file
            .error_at(&at, "the weight of a soft constraint must be positive")
            .found(weight.0)
            .expected("a number greater than 0"));
    }
    if spec.damping_ratio.is_some() {
        return Err(file
            .error_at(&at, "a cap on the damping ratio cannot be soft")
            .found("`soft` beside `damping_ratio`")
            .expected("no `soft`"));
    }
    Ok(Some(weight.0))
}
