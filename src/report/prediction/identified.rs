//! The identified system of a run, from `parameters.json` and `functions.csv`.

use crate::config::{RunSensor, SensorValue};
use crate::error::InputError;
use crate::report::Run;
use crate::report::columns::named_column;
use crate::report::parameters::{FunctionBasis, ParametersDocument};
use crate::report::run_reader::at_nodes;
use crate::units::Unit;
use kmcfit_core::functions::{
    Basis, CoefficientFunction, CoefficientSet, ScalarParameter, ScalarValue,
};
use kmcfit_core::record::{ChannelKind, Sensor};
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::study::IdentifiedSystem;
use kmcfit_core::system::Grid;
use nalgebra::DMatrix;
use std::sync::Arc;

/// An identified system with the noise of its channels.
pub(super) struct SystemOfRun {
    pub identified: IdentifiedSystem,
    /// Kind of the first channel.
    pub kind: ChannelKind,
    /// Standard deviation of the noise of each channel, SI.
    sigmas: Vec<(ChannelKind, f64)>,
    /// Estimated parameters of sensors, the last ones of the system.
    pub scalars: Vec<ScalarParameter>,
}

impl SystemOfRun {
    /// Standard deviation of the noise of a channel of this kind.
    pub fn sigma(&self, kind: ChannelKind) -> Option<f64> {
        let found = self.sigmas.iter().find(|(known, _)| *known == kind);
        found.map(|(_, sigma)| *sigma)
    }

    /// The sensor with its estimated parameters; one that the run did not estimate has the value of an ideal sensor.
    pub fn sensor(&self, given: &RunSensor) -> Sensor {
        let value = |given: &SensorValue, ideal: f64| match given {
            SensorValue::Known(value) => ScalarValue::Known(*value),
            SensorValue::Estimated(name) => {
                let found = self.scalars.iter().position(|scalar| scalar.name == *name);
                found.map_or(ScalarValue::Known(ideal), ScalarValue::Estimated)
            }
        };
        Sensor {
            gain: value(&given.gain, 1.0),
            offset: value(&given.offset, 0.0),
            drift: value(&given.drift, 0.0),
            delay: value(&given.delay, 0.0),
            input_delay: value(&given.input_delay, 0.0),
        }
    }
}

/// The shared coefficient set of a run, and its estimated parameters among those of `sensors`.
///
/// # Errors
/// If `parameters.json` is missing, damaged, or has no shared coefficients.
pub(super) fn system_of(run: &Run, sensors: &[&RunSensor]) -> Result<SystemOfRun, InputError> {
    let (parameters, _) = ParametersDocument::read(&run.folder)?;
    let terms = run.document.model.terms.iter().map(String::as_str);
    let names: Vec<&str> = std::iter::once("mass").chain(terms).collect();
    let mut functions = Vec::new();
    let mut indices = Vec::new();
    let mut known_parts = Vec::new();
    for (location, name) in names.iter().enumerate() {
        let stored = parameters.functions.iter().find(|f| f.name == *name);
        let stored = stored.ok_or_else(|| damaged(run, &format!("no function `{name}`")))?;
        functions.push(function(run, &parameters, stored, name, false)?);
        indices.extend(stored.first..stored.first + stored.count);
        let part = format!("known part of {name}");
        known_parts.extend(
            parameters
                .functions
                .iter()
                .filter(|f| f.name == part)
                .map(|f| (location, f)),
        );
    }
    let first = functions.len();
    let mut positions = Vec::new();
    for (i, (location, stored)) in known_parts.into_iter().enumerate() {
        functions.push(function(run, &parameters, stored, names[location], true)?);
        indices.extend(stored.first..stored.first + stored.count);
        positions.push((location, first + i));
    }
    let mut scalars: Vec<ScalarParameter> = Vec::new();
    for name in sensors.iter().flat_map(|sensor| sensor.estimated()) {
        let location = parameters.names.iter().position(|known| known == name);
        if let Some(index) = location.filter(|index| !indices.contains(index)) {
            indices.push(index);
            scalars.push(ScalarParameter {
                name: name.to_owned(),
                unit: String::new(),
                start: parameters.values[index],
                size: 1.0,
                prior: None,
            });
        }
    }
    let set = CoefficientSet::from((0..first).collect::<Vec<usize>>()).with_known_parts(positions);
    let covariance = parameters.covariance.as_ref().map(|rows| {
        let n = indices.len();
        DMatrix::from_fn(n, n, |i, j| rows[indices[i]][indices[j]])
    });
    let channels = run
        .document
        .channels()
        .filter_map(|c| Some((kind(&c.kind)?, c)));
    let channels: Vec<_> = channels.collect();
    let sigmas = channels.iter().filter_map(|(kind, channel)| {
        let unit = Unit::recognise((*kind).into(), &channel.unit)?;
        Some((*kind, channel.sigma? * unit.factor()))
    });
    Ok(SystemOfRun {
        identified: IdentifiedSystem {
            system: run.system.clone(),
            functions,
            set,
            theta: indices.iter().map(|i| parameters.values[*i]).collect(),
            covariance,
        },
        kind: channels
            .first()
            .map_or(ChannelKind::Displacement, |(kind, _)| *kind),
        sigmas: sigmas.collect(),
        scalars,
    })
}

fn kind(name: &str) -> Option<ChannelKind> {
    ChannelKind::ALL
        .into_iter()
        .find(|kind| kind.name() == name)
}

fn damaged(run: &Run, found: &str) -> InputError {
    InputError::file(
        run.folder.join("parameters.json"),
        "the parameters do not describe the system of the run",
    )
    .found(found)
    .expected("the parameters of this run, with the functions of its equation of motion")
}

/// A function of the run in its basis; its fixed part is the remainder of its values in `functions.csv`.
fn function(
    run: &Run,
    parameters: &ParametersDocument,
    stored: &FunctionBasis,
    name: &str,
    is_known_part: bool,
) -> Result<CoefficientFunction, InputError> {
    let grid = &run.system.grid;
    let kind =
        CoefficientKind::named(name).zip(named_column(&stored.name, run.document.is_rotation()));
    let (quantity, column) = kind.ok_or_else(|| damaged(run, &format!("a function `{name}`")))?;
    let rows = run.functions.finite(&column)?;
    let values = at_nodes(rows, grid.nodes(), run.document.model.steps_per_row);
    if stored.count == 0 {
        return Ok(CoefficientFunction {
            is_known_part,
            ..CoefficientFunction::fixed(quantity, values)
        });
    }
    let theta = parameters.values[stored.first..stored.first + stored.count].to_vec();
    let basis = basis(stored, grid).filter(|basis| basis.parameters(grid) == stored.count);
    let basis = basis.ok_or_else(|| {
        damaged(
            run,
            &format!(
                "basis `{}` with {} parameters for the {name}",
                stored.basis, stored.count
            ),
        )
    })?;
    let mut function = CoefficientFunction::free(quantity, basis, grid, theta.clone());
    let mut own = vec![0.0; grid.nodes()];
    function.values_into(&theta, &mut own);
    let largest = values.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    let remainder = values.iter().zip(&own).map(|(value, own)| value - own);
    // Rounding is no fixed part.
    let fixed = remainder.map(|x| if x.abs() <= 1e-12 * largest { 0.0 } else { x });
    function.offset = Arc::new(fixed.collect());
    function.is_known_part = is_known_part;
    Ok(function)
}

/// The basis as stored; `None` for an unknown name or knots that are not increasing over the grid.
fn basis(stored: &FunctionBasis, grid: &Grid) -> Option<Basis> {
    let knots = || {
        let knots = stored.knots.clone()?;
        let (first, last) = (*knots.first()?, *knots.last()?);
        let slack = 1e-6 * grid.step();
        let is_over_grid = (first - grid.start()).abs() <= slack
            && (last - grid.start() - grid.duration()).abs() <= slack;
        let is_increasing = knots.windows(2).all(|pair| pair[0] < pair[1]);
        (knots.len() >= 2 && is_over_grid && is_increasing).then_some(knots)
    };
    Some(match stored.basis.as_str() {
        "nodal" => Basis::Nodal,
        "constant" => Basis::Constant,
        "polynomial" => {
            let degree = stored.count.checked_sub(1)?;
            (degree <= Basis::highest_degree(grid)).then_some(Basis::Polynomial { degree })?
        }
        "piecewise-constant" => Basis::PiecewiseConstant { knots: knots()? },
        "piecewise-linear" => Basis::PiecewiseLinear { knots: knots()? },
        "b-spline" => Basis::BSpline { knots: knots()? },
        _ => return None,
    })
}
