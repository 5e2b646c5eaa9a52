//! Functions: basis, start, fixed part; and the truth.

mod basis;
mod limits;
mod start;

use super::on_grid::{Wanted, column_on_grid};
use crate::config::ModelFile;
use crate::config::NumberOrColumn;
use crate::config::scalar::{Start, Text};
use crate::config::spec::{Basis, ColumnSpec, FunctionSpec};
use crate::error::InputError;
use kmcfit_core::internals::functions::{self, CoefficientFunction, CoefficientKind};
use kmcfit_core::internals::system::{Grid, NodalCoefficients, Term};

/// The part of a map with a key for each function, required or not.
macro_rules! by_kind {
    ($map:expr, $kind:expr) => {
        match $kind {
            CoefficientKind::Mass => Option::from(&$map.mass),
            CoefficientKind::Damping => Option::from(&$map.damping),
            CoefficientKind::Stiffness => Option::from(&$map.stiffness),
            CoefficientKind::CubicStiffness => $map.cubic_stiffness.as_ref(),
            CoefficientKind::QuadraticDamping => $map.quadratic_damping.as_ref(),
            CoefficientKind::CoulombFriction => $map.coulomb_friction.as_ref(),
            CoefficientKind::Offset => $map.offset.as_ref(),
        }
    };
}

/// A function as the model gives it, and where.
pub(super) struct Slot<'a> {
    /// Its key, such as `functions.mass` or `experiments[1].functions.damping`.
    pub key: String,
    /// Which function it is.
    pub quantity: CoefficientKind,
    /// What the model says about it.
    pub spec: &'a FunctionSpec,
    /// The experiment that has it for itself.
    pub owner: Option<usize>,
}

/// All functions of the model in the order of the problem: those of the main device, mass first, then
/// those of single experiments.
pub(super) fn slots(file: &ModelFile) -> Vec<Slot<'_>> {
    let mut slots: Vec<Slot> = Vec::new();
    let main = CoefficientKind::ALL.into_iter().filter_map(|quantity| {
        Some(Slot {
            key: format!("functions.{}", quantity.name()),
            quantity,
            spec: by_kind!(file.spec.functions, quantity)?,
            owner: None,
        })
    });
    slots.extend(main);
    for (i, experiment) in file.spec.experiments.iter().enumerate() {
        let Some(own) = &experiment.functions else {
            continue;
        };
        slots.extend(CoefficientKind::ALL.into_iter().filter_map(|quantity| {
            Some(Slot {
                key: format!("experiments[{i}].functions.{}", quantity.name()),
                quantity,
                spec: by_kind!(own, quantity)?,
                owner: Some(i),
            })
        }));
    }
    slots
}

/// The quantities of the device, mass first.
pub(super) fn quantities(file: &ModelFile) -> Vec<CoefficientKind> {
    let shared = |slot: &Slot| slot.owner.is_none().then_some(slot.quantity);
    slots(file).iter().filter_map(shared).collect()
}

/// The force terms of the device.
pub(super) fn terms(file: &ModelFile) -> Result<Vec<Term>, InputError> {
    let mut terms = Vec::new();
    for slot in slots(file).iter().filter(|slot| slot.owner.is_none()) {
        let width = width(file, slot)?;
        terms.extend(slot.quantity.term(width));
    }
    Ok(terms)
}

/// The speed that Coulomb friction is smoothed over; 0 for other functions.
fn width(file: &ModelFile, slot: &Slot) -> Result<f64, InputError> {
    let key = format!("{}.width", slot.key);
    match (slot.quantity, slot.spec.width) {
        (CoefficientKind::CoulombFriction, Some(width)) if width.0 > 0.0 => Ok(width.0),
        (CoefficientKind::CoulombFriction, Some(width)) => Err(file
            .error_at(&key, "the width must be positive")
            .found(width.0)
            .expected("a speed in m/s, greater than 0, well below those of the motion")),
        (CoefficientKind::CoulombFriction, None) => Err(file
            .error_at(&slot.key, "Coulomb friction needs a width")
            .expected(
                "`width`: the speed in m/s over which the sign of v is smoothed, well below those \
                 of the motion",
            )),
        (_, Some(width)) => Err(file
            .error_at(&key, "only Coulomb friction has a width")
            .found(width.0)
            .expected("no `width`")),
        (_, None) => Ok(0.0),
    }
}

/// The functions that make up each device, and the device of each experiment.
pub(super) struct Assemblies {
    pub devices: Vec<Vec<usize>>,
    pub of_experiment: Vec<usize>,
}

/// Which functions move in which experiment.
pub(super) fn assemblies(file: &ModelFile) -> Result<Assemblies, InputError> {
    let slots = slots(file);
    let shared = quantities(file);
    let main: Vec<usize> = (0..shared.len()).collect();
    let mut found = Assemblies {
        devices: vec![main.clone()],
        of_experiment: Vec::new(),
    };
    for (i, spec) in file.spec.experiments.iter().enumerate() {
        let mut device = main.clone();
        if let (true, Some(_)) = (spec.hold_out == Some(true), &spec.functions) {
            return Err(file
                .error_at(
                    &format!("experiments[{i}].functions"),
                    "an experiment that is held out cannot have functions of its own",
                )
                .found("`functions` beside `hold_out: true`")
                .expected("the shared functions: they are what is to be tested"));
        }
        for (f, slot) in slots.iter().enumerate().filter(|(_, s)| s.owner == Some(i)) {
            let Some(place) = shared.iter().position(|q| *q == slot.quantity) else {
                let name = slot.quantity.name();
                return Err(file
                    .error_at(&slot.key, "the device has no such function")
                    .found(format!("`{name}` in one experiment only"))
                    .expected(format!(
                        "`functions.{name}` as well, which the other experiments share; \
                         `fixed: 0` where they have none"
                    )));
            };
            if slot.quantity == CoefficientKind::CoulombFriction {
                return Err(file
                    .error_at(&slot.key, "Coulomb friction is shared by all experiments")
                    .expected("it under `functions` alone"));
            }
            device[place] = f;
        }
        let known = found.devices.iter().position(|d| *d == device);
        found
            .of_experiment
            .push(known.unwrap_or(found.devices.len()));
        if known.is_none() {
            found.devices.push(device);
        }
    }
    something_shared(file, &slots, &found)?;
    Ok(found)
}

/// Refuses experiments that have nothing to do with each other, and functions that nobody uses.
fn something_shared(
    file: &ModelFile,
    slots: &[Slot],
    found: &Assemblies,
) -> Result<(), InputError> {
    let users = |f: usize| {
        let uses = |d: &&usize| found.devices[**d].contains(&f);
        found.of_experiment.iter().filter(uses).count()
    };
    let several = found.of_experiment.len() > 1;
    let sought = |slot: &Slot| slot.spec.fixed.is_none();
    let own = slots.iter().any(|s| s.owner.is_some() && sought(s));
    let shared = (slots.iter().enumerate()).any(|(f, slot)| sought(slot) && users(f) > 1);
    if several && own && !shared {
        return Err(file
            .error_at(
                "experiments",
                "the experiments share no function that is fitted",
            )
            .found("functions of its own in every experiment")
            .expected(
                "a function of the device that several experiments show, or a model for each",
            ));
    }
    match slots.iter().enumerate().find(|(f, _)| users(*f) == 0) {
        Some((_, slot)) => Err(file
            .error_at(&slot.key, "no experiment uses this function")
            .found("one of its own in every experiment")
            .expected("at least one experiment without, or `fixed` here")),
        None => Ok(()),
    }
}

/// All functions on the grid, in the order of [`slots`].
pub(super) fn build(
    file: &ModelFile,
    grid: &Grid,
    warnings: &mut Vec<String>,
) -> Result<Vec<CoefficientFunction>, InputError> {
    let list: Vec<CoefficientFunction> = slots(file)
        .iter()
        .map(|slot| {
            let owner = slot.owner.map(|i| file.experiment_name(i));
            Ok(CoefficientFunction {
                owner,
                ..function(file, grid, slot)?
            })
        })
        .collect::<Result<_, _>>()?;
    if list.iter().all(|f| f.parameters() == 0) {
        warnings.push("every function is fixed, so there is nothing to fit".into());
    }
    Ok(list)
}

fn function(file: &ModelFile, grid: &Grid, slot: &Slot) -> Result<CoefficientFunction, InputError> {
    let (key, quantity, spec) = (slot.key.as_str(), slot.quantity, slot.spec);
    basis::keys_fit(file, key, spec)?;
    limits::check(file, grid, key, spec)?;
    match (&spec.fixed, &spec.start, spec.basis) {
        (Some(_), Some(_), _) => Err(file
            .error_at(&format!("{key}.start"), "a fixed function has no start")
            .expected("either `fixed` or `start`")),
        (Some(fixed), None, _) => {
            let values = values(file, grid, &format!("{key}.fixed"), fixed)?;
            positive_mass(file, quantity, &format!("{key}.fixed"), &values)?;
            Ok(CoefficientFunction::fixed(quantity, values))
        }
        (None, None, _) => Err(file
            .error_at(key, "this function has neither a start nor a fixed value")
            .expected("`start` for a function to be fitted, `fixed` for a known one")),
        (None, Some(_), None) => Err(file
            .error_at(key, "a function to be fitted needs a basis")
            .expected(format!("`basis`, one of {}", basis_names()))),
        (None, Some(given), Some(kind)) => {
            let basis = basis::build(file, grid, key, spec, kind)?;
            free(file, grid, slot, basis, given)
        }
    }
}

fn free(
    file: &ModelFile,
    grid: &Grid,
    slot: &Slot,
    basis: functions::Basis,
    given: &Start,
) -> Result<CoefficientFunction, InputError> {
    let (key, quantity) = (format!("{}.start", slot.key), slot.quantity);
    let start = start::parameters(file, grid, &key, &basis, given)?;
    let function = CoefficientFunction::free(quantity, basis, grid, start);
    let mut values = vec![0.0; grid.nodes()];
    function.values_into(&function.start, &mut values);
    positive_mass(file, quantity, &key, &values)?;
    Ok(function)
}

/// Values at the nodes: the same number, or a column that `key` names.
pub(super) fn values(
    file: &ModelFile,
    grid: &Grid,
    key: &str,
    given: &NumberOrColumn,
) -> Result<Vec<f64>, InputError> {
    match given {
        NumberOrColumn::Number(value) => Ok(vec![value.0; grid.nodes()]),
        NumberOrColumn::Column(c) => column(file, grid, key, c),
    }
}

/// The nodal values of a column that `key` names.
fn column(
    file: &ModelFile,
    grid: &Grid,
    key: &str,
    given: &ColumnSpec,
) -> Result<Vec<f64>, InputError> {
    let wanted = Wanted {
        data: &given.data.0,
        data_key: &format!("{key}.data"),
        column: &given.column.0,
        column_key: &format!("{key}.column"),
    };
    column_on_grid(file, &wanted, grid)
}

/// The equation of motion needs a positive mass everywhere.
fn positive_mass(
    file: &ModelFile,
    quantity: CoefficientKind,
    key: &str,
    values: &[f64],
) -> Result<(), InputError> {
    let broken = values.iter().position(|m| *m <= 0.0);
    match broken {
        Some(i) if quantity == CoefficientKind::Mass => Err(file
            .error_at(key, "the mass must be positive at all times")
            .found(match values.iter().all(|m| m == &values[i]) {
                true => values[i].to_string(),
                false => format!("{} at node {i}", values[i]),
            })
            .expected("a number greater than 0, in kg")),
        _ => Ok(()),
    }
}

fn basis_names() -> String {
    let names: Vec<&str> = Basis::ALL.iter().map(|(name, _)| *name).collect();
    names.join(", ")
}

/// The true device on the grid, where the model names it.
pub(super) fn truth(
    file: &ModelFile,
    grid: &Grid,
) -> Result<Option<NodalCoefficients>, InputError> {
    let Some(spec) = &file.spec.truth else {
        return Ok(None);
    };
    let column = |quantity: CoefficientKind| {
        let named: Option<&Text> = (spec.columns.as_ref()).and_then(|c| by_kind!(c, quantity));
        let name = named.map_or(quantity.column(), |name| name.0.as_str());
        let wanted = Wanted {
            data: &spec.data.0,
            data_key: "truth.data",
            column: name,
            column_key: &format!("truth.columns.{}", quantity.name()),
        };
        column_on_grid(file, &wanted, grid)
    };
    let mut list = quantities(file).into_iter();
    let mass = list.next().map(&column).transpose()?.unwrap_or_default();
    Ok(Some(NodalCoefficients {
        mass,
        coefficients: list.map(&column).collect::<Result<_, _>>()?,
    }))
}
