//! Coefficient functions of a model file as specifications of the builder, and the true coefficients.

use super::on_grid::column_on_grid;
use crate::config::ModelFile;
use crate::config::lowering::Place;
use crate::error::InputError;
use kmcfit_core::internals::builder::{self, BasisSpec, CoefficientSpec, PenaltyWeight, Roughness};
use kmcfit_core::internals::constraints::TimeHistory;
use kmcfit_core::internals::functions::{self, CoefficientKind};
use kmcfit_core::internals::identifiability::{ScaleSource, scale_source};
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::system::{Grid, NodalCoefficients};
use kmcfit_core::model::{
    self as config, BasisName, ByCoefficient, ColumnSpec, ExperimentSpec, FunctionSpec,
    PenaltyKind, WeightRuleName,
};
use kmcfit_core::model::{
    Bound, KnotSpec, KnownValue, KnownValueMap, NumberOrColumn, StartSpec, WeightChoice,
};

/// Default lower limit of a mass, as a share of its smallest start value: a fit can otherwise end with a mass of nearly zero, whose
/// response follows the force at all frequencies.
const LEAST_MASS: f64 = 1e-3;

/// A coefficient function of the model file: kind and settings.
pub(super) type Given<'a> = (CoefficientKind, &'a FunctionSpec);

/// The functions common to all experiments, mass first.
pub(super) fn shared(file: &ModelFile) -> Vec<Given<'_>> {
    file.spec.functions.iter().collect()
}

/// The functions of an experiment alone.
pub(super) fn own(spec: &ExperimentSpec) -> Vec<Given<'_>> {
    (spec.functions.iter())
        .flat_map(ByCoefficient::iter)
        .collect()
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

/// The specification of the function at `key`; if the fit is limited, an estimated mass without `min` has a lower bound of
/// [`LEAST_MASS`] times its smallest start value.
pub(super) fn specification(
    at: &Place<'_>,
    grid: &Grid,
    (kind, given): Given<'_>,
    defaults: Defaults<'_>,
) -> Result<CoefficientSpec, InputError> {
    let is_own = !at.key.starts_with("functions.");
    check_basis_keys(at, given)?;
    let bound = |name: &str, given: &Option<Bound>| match given {
        None | Some(Bound::None(_)) => Ok(None),
        Some(Bound::At(given)) => history(&at.below(name), grid, given).map(Some),
    };
    let mut spec = match (&given.fixed, &given.start, given.basis) {
        (Some(_), Some(_), _) => {
            return Err(at
                .error_in("start", "`fixed` and `start` exclude each other")
                .expected("either `fixed` or `start`"));
        }
        (Some(_), None, Some(_)) => {
            return Err(at
                .error_in("basis", "`fixed` and `basis` exclude each other")
                .expected("either `fixed`, or `basis` with `start`"));
        }
        (Some(fixed), None, None) => {
            refuse_negative_stiffness(at, kind, fixed)?;
            known(&at.below("fixed"), grid, fixed)?
        }
        (None, None, None) if is_own && is_known_part_alone(given) => CoefficientSpec::shared(),
        (None, None, basis_name) => {
            let mut starts = defaults.starts.into_iter().flatten();
            let start = starts.find(|(of, _)| *of == kind);
            let Some((basis_name, (_, start))) = basis_name.zip(start) else {
                return Err(at
                    .error("this function has neither a start nor a fixed value")
                    .expected("`start` for a function to be fitted, `fixed` for a known one")
                    .hint("mass, damping and stiffness of a fit start from the record"));
            };
            let basis = basis(at, given, basis_name)?;
            CoefficientSpec::estimated(basis, builder::Start::Constant(*start))
        }
        (None, Some(_), None) => {
            return Err(at
                .error("a function to be fitted needs a basis")
                .expected(format!("`basis`, one of {}", basis_names())));
        }
        (None, Some(given_start), Some(kind)) => {
            let basis = basis(at, given, kind)?;
            let start = start(&at.below("start"), grid, kind, given_start)?;
            CoefficientSpec::estimated(basis, start)
        }
    };
    spec = spec.bounds(bound("min", &given.min)?, bound("max", &given.max)?);
    if given.min.is_none() && defaults.is_limited && kind == CoefficientKind::MASS {
        spec = spec.min_of_start(LEAST_MASS);
    }
    for (place, given) in given.penalty.iter().flat_map(|list| list.iter()) {
        spec = spec.penalty(penalty(&at.below(&format!("penalty{place}")), grid, given)?);
    }
    if let Some(part) = &given.known_part {
        spec = spec.known_part(known(&at.below("known_part"), grid, part)?);
    }
    Ok(match given.width {
        Some(width) => spec.width(width),
        None => spec,
    })
}

/// Refuses a fixed negative stiffness without a stiffening term: every motion would grow without end.
fn refuse_negative_stiffness(
    at: &Place<'_>,
    kind: CoefficientKind,
    fixed: &KnownValue,
) -> Result<(), InputError> {
    let value = match fixed {
        KnownValue::Number(value) => Some(*value),
        KnownValue::Map(map) => map.value,
        KnownValue::Unknown(_) => None,
    };
    let functions = &at.file.spec.functions;
    let stiffening = [
        CoefficientKind::CUBIC_STIFFNESS,
        CoefficientKind::QUINTIC_STIFFNESS,
    ];
    let is_stiffened = stiffening.iter().any(|kind| functions.get(*kind).is_some());
    match value.filter(|value| *value < 0.0 && kind == CoefficientKind::STIFFNESS) {
        Some(value) if !is_stiffened => Err(at
            .error_in(
                "fixed",
                "a negative stiffness without a term that stiffens: every motion grows without end",
            )
            .found(value)
            .expected("a positive stiffness, or `cubic_stiffness` beside it")),
        _ => Ok(()),
    }
}

/// True for a function of an experiment that has a known part and no other key.
fn is_known_part_alone(given: &FunctionSpec) -> bool {
    let has_other = given.min.is_some()
        || given.max.is_some()
        || given.penalty.is_some()
        || given.width.is_some();
    given.known_part.is_some() && !has_other
}

/// Known values at `key`.
fn known(at: &Place<'_>, grid: &Grid, given: &KnownValue) -> Result<CoefficientSpec, InputError> {
    let map = match given {
        KnownValue::Number(value) => return Ok(CoefficientSpec::fixed(*value)),
        KnownValue::Unknown(_) if at.key == UNKNOWN_MASS => return Ok(CoefficientSpec::fixed(1.0)),
        KnownValue::Unknown(_) => {
            return Err(at.error("only the mass can be unknown")
                .found("`unknown`")
                .expected("a value, or `basis` for a function to be fitted")
                .hint("all coefficients are ratios to an unknown mass: `functions: {mass: {fixed: unknown}}`"));
        }
        KnownValue::Map(map) => map,
    };
    let KnownValueMap {
        value,
        sigma,
        data,
        column,
    } = map;
    match (value, sigma, data, column) {
        (Some(value), Some(sigma), None, None) => Ok(CoefficientSpec::uncertain(*value, *sigma)),
        (None, None, Some(data), Some(name)) => {
            let column = NumberOrColumn::Column(ColumnSpec {
                data: data.clone(),
                column: name.clone(),
            });
            history(at, grid, &column).map(CoefficientSpec::known)
        }
        _ => {
            let keys = [
                ("value", value.is_some()),
                ("sigma", sigma.is_some()),
                ("data", data.is_some()),
                ("column", column.is_some()),
            ];
            let given = keys.iter().filter(|(_, is_given)| *is_given);
            let given: Vec<String> = given.map(|(name, _)| format!("`{name}`")).collect();
            let found = match given.is_empty() {
                true => "an empty map".to_owned(),
                false => given.join(" and "),
            };
            Err(at
                .error("neither a value with its standard deviation nor a column of a file")
                .found(found)
                .expected("{value: 4.5, sigma: 0.02}, or {data: file.csv, column: name}"))
        }
    }
}

/// Key of a mass that is `unknown`.
const UNKNOWN_MASS: &str = "functions.mass.fixed";

/// True if the model states that the mass is unknown.
pub(super) fn has_unknown_mass(file: &ModelFile) -> bool {
    let mass = file.spec.functions.get(CoefficientKind::MASS);
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

/// The additional key of a basis.
fn own_key(kind: BasisName) -> Option<&'static str> {
    match kind {
        BasisName::Nodal | BasisName::Constant => None,
        BasisName::Polynomial => Some("degree"),
        BasisName::PiecewiseConstant | BasisName::PiecewiseLinear | BasisName::BSpline => {
            Some("knots")
        }
    }
}

/// Refuses `knots` and `degree` where the basis does not use them.
fn check_basis_keys(at: &Place<'_>, spec: &FunctionSpec) -> Result<(), InputError> {
    let given = [
        ("knots", spec.knots.is_some()),
        ("degree", spec.degree.is_some()),
    ];
    let own = spec.basis.and_then(own_key);
    let Some((unused, _)) = given.iter().find(|(k, given)| *given && own != Some(*k)) else {
        return Ok(());
    };
    let problem = match spec.basis {
        Some(kind) => format!("the basis `{kind}` does not use this key"),
        None => "this key needs a basis that uses it".to_owned(),
    };
    Err((at.error_in(unused, problem))
        .found(format!("`{unused}`"))
        .expected(match (spec.basis, own) {
            (_, Some(own)) => format!("`{own}`"),
            (Some(_), None) => "neither `knots` nor `degree`".to_owned(),
            (None, None) => "`basis` beside it".to_owned(),
        })
        .hint(match *unused {
            "knots" => "piecewise-constant, piecewise-linear and b-spline have knots",
            _ => "polynomial has a degree",
        }))
}

/// The basis of a function to be fitted.
fn basis(at: &Place<'_>, spec: &FunctionSpec, kind: BasisName) -> Result<BasisSpec, InputError> {
    let missing = |what: &str, expected: &str| {
        at.error(format!("the basis `{kind}` needs {what}"))
            .expected(expected)
    };
    let knots = || match &spec.knots {
        Some(KnotSpec::Count(count)) => Ok(builder::Knots::Count(*count)),
        Some(KnotSpec::Times(times)) => Ok(builder::Knots::Times(times.clone())),
        Some(KnotSpec::Auto(_)) => Ok(builder::Knots::Auto),
        None => Err(missing(
            "knots",
            "`knots`: `auto`, the number of equally spaced knots, or a list of times in s",
        )),
    };
    Ok(match kind {
        BasisName::Nodal => BasisSpec::Nodal,
        BasisName::Constant => BasisSpec::Constant,
        BasisName::PiecewiseConstant => BasisSpec::PiecewiseConstant(knots()?),
        BasisName::PiecewiseLinear => BasisSpec::PiecewiseLinear(knots()?),
        BasisName::BSpline => BasisSpec::BSpline(knots()?),
        BasisName::Polynomial => {
            let degree = spec.degree.ok_or_else(|| {
                missing("a degree", "`degree`: an integer, for instance `degree: 1`")
            })?;
            BasisSpec::Polynomial { degree }
        }
    })
}

fn basis_names() -> String {
    let names: Vec<&str> = BasisName::ALL.iter().map(|basis| basis.name()).collect();
    names.join(", ")
}

fn start(
    at: &Place<'_>,
    grid: &Grid,
    kind: BasisName,
    given: &StartSpec,
) -> Result<builder::Start, InputError> {
    match given {
        StartSpec::Number(value) => Ok(builder::Start::Constant(*value)),
        StartSpec::List(_) if kind == BasisName::BSpline => Err(at
            .error("`start` of the basis `b-spline` must be one number")
            .found("a list")
            .expected("a finite number, or a column: {data: file.csv, column: name}")),
        StartSpec::List(values) => Ok(builder::Start::Parameters(values.clone())),
        StartSpec::Column(c) => Ok(builder::Start::Nodal(column(at, grid, c)?)),
    }
}

fn penalty(
    at: &Place<'_>,
    grid: &Grid,
    given: &config::PenaltyKeys,
) -> Result<Roughness, InputError> {
    if given.kind == PenaltyKind::TotalVariation {
        return total_variation(at, given);
    }
    let Some(order) = given.order else {
        return Err(at
            .error("the key `order` is missing")
            .found("a penalty of the kind `tikhonov` alone")
            .expected("for instance `order: 2`"));
    };
    let reference = given.reference.as_ref();
    let reference = reference.map(|r| history(&at.below("reference"), grid, r));
    Ok(Roughness::Tikhonov {
        order,
        weight: penalty_weight(given.weight),
        reference: reference.transpose()?,
    })
}

/// A penalty on total variation; refuses keys other than the weight.
fn total_variation(at: &Place<'_>, given: &config::PenaltyKeys) -> Result<Roughness, InputError> {
    let others = [
        ("order", given.order.is_some()),
        ("reference", given.reference.is_some()),
    ];
    if let Some((other, _)) = others.iter().find(|(_, given)| *given) {
        return Err(at
            .error_in(other, "a penalty on total variation has only a weight")
            .found(format!("`{other}` beside `kind: tv`"))
            .expected(format!("no `{other}`, or `kind: tikhonov`")));
    }
    let weight = penalty_weight(given.weight);
    Ok(Roughness::TotalVariation { weight })
}

fn penalty_weight(given: WeightChoice) -> PenaltyWeight {
    let rule = match given {
        WeightChoice::Number(weight) => return PenaltyWeight::Given(weight),
        WeightChoice::Rule(WeightRuleName::Period) => return PenaltyWeight::Period,
        WeightChoice::Rule(WeightRuleName::Discrepancy) => functions::WeightRule::Discrepancy,
        WeightChoice::Rule(WeightRuleName::RestrictedLikelihood) => {
            functions::WeightRule::RestrictedLikelihood
        }
        WeightChoice::Rule(WeightRuleName::Bic) => functions::WeightRule::Bic,
    };
    PenaltyWeight::Rule(rule)
}

/// A constant, or a column named by `key`, interpolated at the nodes.
pub(super) fn history(
    at: &Place<'_>,
    grid: &Grid,
    given: &NumberOrColumn,
) -> Result<TimeHistory, InputError> {
    match given {
        NumberOrColumn::Number(value) => Ok(TimeHistory::Constant(*value)),
        NumberOrColumn::Column(c) => Ok(TimeHistory::Nodal {
            name: format!("{} of {}", c.column, c.data),
            values: column(at, grid, c)?,
        }),
    }
}

/// Values at the nodes: a constant, or a column named by `key`.
pub(super) fn values(
    at: &Place<'_>,
    grid: &Grid,
    given: &NumberOrColumn,
) -> Result<Vec<f64>, InputError> {
    match history(at, grid, given)? {
        TimeHistory::Constant(value) => Ok(vec![value; grid.nodes()]),
        TimeHistory::Nodal { values, .. } => Ok(values),
    }
}

/// Nodal values of a column named by `key`.
fn column(at: &Place<'_>, grid: &Grid, given: &ColumnSpec) -> Result<Vec<f64>, InputError> {
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
    let at = Place::new(file, "truth");
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
