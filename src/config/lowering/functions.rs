//! Coefficient functions of a model file with their columns at the nodes, and the true coefficients.

use super::ModelKey;
use super::on_grid::column_on_grid;
use crate::config::ModelFile;
use crate::error::InputError;
use kmcfit_core::builder::UNKNOWN_MASS;
use kmcfit_core::constraints::TimeHistory;
use kmcfit_core::identifiability::{ScaleSource, scale_source};
use kmcfit_core::model::{
    Bound, ByCoefficient, CoefficientSpec, ColumnSpec, ExperimentSpec, KnownValue, KnownValueMap,
    NumberOrColumn, OneOrList, StartSpec, StructureSpec,
};
use kmcfit_core::problem::Problem;
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::system::{Grid, NodalCoefficients};

/// Default lower limit of a mass, as a share of its smallest start value: a fit can otherwise end with a mass of nearly zero, whose
/// response follows the force at all frequencies.
const LEAST_MASS: f64 = 1e-3;

/// A coefficient function of the model file: kind and settings.
pub(super) type Given<'a> = (CoefficientKind, &'a CoefficientSpec);

/// The functions common to all experiments, mass first.
pub(super) fn shared(file: &ModelFile) -> Vec<Given<'_>> {
    let functions = file.spec.functions.iter();
    functions.flat_map(ByCoefficient::iter).collect()
}

/// The functions of an experiment alone.
pub(super) fn own(spec: &ExperimentSpec) -> Vec<Given<'_>> {
    (spec.functions.iter())
        .flat_map(ByCoefficient::iter)
        .collect()
}

/// The structure of a model with the columns of its functions at the nodes.
pub(super) fn structure(
    file: &ModelFile,
    given: &StructureSpec,
    grid: &Grid,
    defaults: Defaults<'_>,
) -> Result<StructureSpec, InputError> {
    let mut structure = given.clone();
    for (name, coordinate) in &mut structure.coordinates.0 {
        let at = ModelKey::new(file, format!("structure.coordinates.{name}.mass"));
        let mass = (CoefficientKind::MASS, &coordinate.mass);
        coordinate.mass = specification(&at, grid, mass, defaults)?;
    }
    for (name, element) in &mut structure.elements.0 {
        let at = ModelKey::new(file, format!("structure.elements.{name}"));
        // An element without a law is refused where it is built.
        let kind = element
            .laws
            .first()
            .map_or(CoefficientKind::STIFFNESS, |(kind, _)| *kind);
        element.coefficient = specification(&at, grid, (kind, &element.coefficient), defaults)?;
    }
    Ok(structure)
}

/// All functions of the model.
pub(super) fn all(file: &ModelFile) -> Vec<Given<'_>> {
    let own = file.spec.experiments.iter().flat_map(own);
    shared(file).into_iter().chain(own).collect()
}

/// Start values of mass (kg), damping (N s/m) and stiffness (N/m) from the records, for functions without `start`.
pub(super) type RecordStarts = [(CoefficientKind, f64); 3];

/// What a function takes that its keys leave out.
#[derive(Clone, Copy)]
pub(super) struct Defaults<'a> {
    /// True for a lower bound of the mass.
    pub is_limited: bool,
    /// Start values from the records; `None` without records.
    pub starts: Option<&'a RecordStarts>,
}

/// The function at `key` with its columns at the nodes; where a start is left out, that of the record; if the fit is limited, an
/// estimated mass without `min` has a lower bound of [`LEAST_MASS`] times its smallest start value.
pub(super) fn specification(
    at: &ModelKey<'_>,
    grid: &Grid,
    (kind, given): Given<'_>,
    defaults: Defaults<'_>,
) -> Result<CoefficientSpec, InputError> {
    let mut spec = given.clone();
    for (name, known) in [
        ("fixed", &mut spec.fixed),
        ("known_part", &mut spec.known_part),
    ] {
        if let Some(KnownValue::Map(KnownValueMap {
            value: None,
            sigma: None,
            data: Some(data),
            column: Some(column),
        })) = known
        {
            let (data, column) = (data.clone(), column.clone());
            let values = column_history(&at.below(name), grid, &ColumnSpec { data, column })?;
            *known = Some(KnownValue::History(values));
        }
    }
    for (name, bound) in [("min", &mut spec.min), ("max", &mut spec.max)] {
        if let Some(Bound::At(values)) = bound {
            read_column(&at.below(name), grid, values)?;
        }
    }
    if let Some(StartSpec::Column(column)) = &spec.start {
        spec.start = Some(StartSpec::Nodal(self::column(
            &at.below("start"),
            grid,
            column,
        )?));
    }
    let penalties = match &mut spec.penalty {
        None => &mut [],
        Some(OneOrList::One(one)) => std::slice::from_mut(one),
        Some(OneOrList::List(list)) => list.as_mut_slice(),
    };
    for (i, penalty) in penalties.iter_mut().enumerate() {
        if let Some(reference) = &mut penalty.reference {
            let suffix = given
                .penalty
                .as_ref()
                .map(|list| list.suffix(i))
                .unwrap_or_default();
            read_column(
                &at.below(&format!("penalty{suffix}.reference")),
                grid,
                reference,
            )?;
        }
    }
    if spec.start.is_none() && spec.fixed.is_none() {
        let mut starts = defaults.starts.into_iter().flatten();
        let start = starts.find(|(of, _)| *of == kind && spec.basis.is_some());
        spec.start = start.map(|(_, start)| StartSpec::Number(*start));
    }
    if defaults.is_limited && kind == CoefficientKind::MASS {
        spec.min_of_start = Some(LEAST_MASS);
    }
    Ok(spec)
}

/// Replaces a column of a file by its values at the nodes.
pub(super) fn read_column(
    at: &ModelKey<'_>,
    grid: &Grid,
    given: &mut NumberOrColumn,
) -> Result<(), InputError> {
    if let NumberOrColumn::Column(column) = given {
        *given = NumberOrColumn::History(column_history(at, grid, column)?);
    }
    Ok(())
}

/// True if the model states that the mass is unknown.
pub(super) fn has_unknown_mass(file: &ModelFile) -> bool {
    let functions = file.spec.functions.as_ref();
    let mass = functions.and_then(|all| all.get(CoefficientKind::MASS));
    mass.is_some_and(|mass| matches!(mass.fixed, Some(KnownValue::Unknown(_))))
}

/// Error for an unknown mass where a force or another known value determines the scale of the coefficients.
pub(super) fn check_unknown_mass(file: &ModelFile, problem: &Problem) -> Result<(), InputError> {
    if !has_unknown_mass(file) {
        return Ok(());
    }
    let refused = |found: String| {
        Err(file
            .error_at(
                UNKNOWN_MASS,
                "the mass is not unknown: the model determines it",
            )
            .found(found)
            .expected("`mass: {basis: constant}`, or the known mass in kg"))
    };
    match scale_source(problem) {
        ScaleSource::Force => refused("a force".to_owned()),
        ScaleSource::KnownValue => {
            refused("a known value with its standard deviation, or a known part".to_owned())
        }
        ScaleSource::Fixed(fixed) => match fixed.iter().find(|name| *name != "mass") {
            Some(other) => refused(format!("the fixed {}", other.replace('_', " "))),
            None => Ok(()),
        },
        ScaleSource::Model => Ok(()),
    }
}

/// A column named by `key`, interpolated at the nodes.
fn column_history(
    at: &ModelKey<'_>,
    grid: &Grid,
    given: &ColumnSpec,
) -> Result<TimeHistory, InputError> {
    Ok(TimeHistory::Nodal {
        name: format!("{} of {}", given.column, given.data),
        values: column(at, grid, given)?,
    })
}

/// A constant, or a column named by `key`, interpolated at the nodes.
pub(super) fn history(
    at: &ModelKey<'_>,
    grid: &Grid,
    given: &NumberOrColumn,
) -> Result<TimeHistory, InputError> {
    match given {
        NumberOrColumn::Number(value) => Ok(TimeHistory::Constant(*value)),
        NumberOrColumn::Column(column) => column_history(at, grid, column),
        NumberOrColumn::History(values) => Ok(values.clone()),
    }
}

/// Values at the nodes: a constant, or a column named by `key`.
pub(super) fn values(
    at: &ModelKey<'_>,
    grid: &Grid,
    given: &NumberOrColumn,
) -> Result<Vec<f64>, InputError> {
    match history(at, grid, given)? {
        TimeHistory::Constant(value) => Ok(vec![value; grid.nodes()]),
        TimeHistory::Nodal { values, .. } => Ok(values),
    }
}

/// Nodal values of a column named by `key`.
fn column(at: &ModelKey<'_>, grid: &Grid, given: &ColumnSpec) -> Result<Vec<f64>, InputError> {
    let data = (&*given.data, &at.below("data"));
    column_on_grid(data, (&given.column, &at.below("column")), grid)
}

/// The true coefficient functions on the grid, where the model names them.
pub(super) fn truth(
    file: &ModelFile,
    grid: &Grid,
) -> Result<Option<NodalCoefficients>, InputError> {
    let Some(spec) = &file.spec.truth else {
        return Ok(None);
    };
    let at = ModelKey::new(file, "truth");
    let column = |(kind, _): Given| {
        let named = spec.columns.as_ref().and_then(|columns| columns.get(kind));
        let name = named.map_or_else(|| kind.column(false), |name| name.clone());
        let column = at.below(&format!("columns.{}", kind.name()));
        column_on_grid((&spec.data, &at.below("data")), (&name, &column), grid)
    };
    let mut list = shared(file).into_iter();
    let mass = list.next().map(&column).transpose()?.unwrap_or_default();
    Ok(Some(NodalCoefficients {
        inertias: vec![mass],
        coefficients: list.map(&column).collect::<Result<_, _>>()?,
    }))
}
