//! Experiments: readings from files, put on the grid.

use super::{Purpose, asked_for};
use crate::config::ModelFile;
use crate::config::spec::ExperimentSpec;
use crate::dynamics::{Grid, State};
use crate::error::InputError;
use crate::objective::{Channel, Weighting};
use crate::observations::{Table, equally_spaced, resample};
use crate::problem::Experiment;

/// Default names of the columns.
const TIME_COLUMN: &str = "t_s";
const DISPLACEMENT_COLUMN: &str = "y_m";

/// Readings as they stand in a file, at equally spaced times.
pub(super) struct Record {
    pub start: f64,
    pub duration: f64,
    pub spacing: f64,
    pub values: Vec<f64>,
}

/// What reports call experiment `i`.
pub(super) fn name(file: &ModelFile, i: usize) -> String {
    let given = file.spec.experiments[i].name.as_ref();
    given.map_or_else(|| format!("experiment {}", i + 1), |name| name.0.clone())
}

/// Two experiments of one name could not be told apart.
pub(super) fn distinct_names(file: &ModelFile) -> Result<(), InputError> {
    let mut names: Vec<&str> = Vec::new();
    for (i, spec) in file.spec.experiments.iter().enumerate() {
        let Some(name) = &spec.name else { continue };
        if names.contains(&name.0.as_str()) {
            return Err(file
                .error_at(
                    &format!("experiments[{i}].name"),
                    "two experiments have the same name",
                )
                .found(format!("`{}`", name.0))
                .expected("a name of its own for every experiment"));
        }
        names.push(&name.0);
    }
    Ok(())
}

/// Reads the files of all experiments; `None` where there is none to be read.
pub(super) fn read(file: &ModelFile, purpose: Purpose) -> Result<Vec<Option<Record>>, InputError> {
    if matches!(purpose, Purpose::Simulate { .. }) {
        // The duration may still have to come from the readings.
        let has_duration = file
            .spec
            .grid
            .as_ref()
            .is_some_and(|g| g.duration.is_some());
        let all_have_data = file.spec.experiments.iter().all(|e| e.data.is_some());
        if has_duration || !all_have_data {
            return Ok(file.spec.experiments.iter().map(|_| None).collect());
        }
    }
    let records: Vec<Option<Record>> = (file.spec.experiments.iter().enumerate())
        .map(|(i, spec)| read_one(file, i, spec).map(Some))
        .collect::<Result<_, _>>()?;
    same_span(file, &records)?;
    Ok(records)
}

fn read_one(file: &ModelFile, i: usize, spec: &ExperimentSpec) -> Result<Record, InputError> {
    let key = format!("experiments[{i}]");
    let data = spec.data.as_ref().ok_or_else(|| {
        file.error_at(&key, "this experiment has no data")
            .expected("`data`, a CSV file with the readings")
    })?;
    let asked = |key: &str| asked_for(file, format!("experiments[{i}].{key}"));
    let table = Table::read(file.resolve(&data.0)).map_err(asked("data"))?;
    let named = |name: Option<&crate::config::Text>, default: &str| {
        name.map_or(default.to_string(), |name| name.0.clone())
    };
    let columns = spec.columns.as_ref();
    let time = named(columns.and_then(|c| c.time.as_ref()), TIME_COLUMN);
    let displacement = named(
        columns.and_then(|c| c.displacement.as_ref()),
        DISPLACEMENT_COLUMN,
    );
    if table.rows() < Grid::FEWEST_NODES {
        let few = InputError::file(table.path(), "there are too few readings")
            .found(match table.rows() {
                1 => "1 row".to_string(),
                rows => format!("{rows} rows"),
            })
            .expected(format!("at least {}", Grid::FEWEST_NODES));
        return Err(asked("data")(few));
    }
    if time == displacement {
        return Err(file
            .error_at(
                &format!("{key}.columns"),
                "time and displacement are the same column",
            )
            .found(format!("`{time}`"))
            .expected("two columns"));
    }
    let spacing = equally_spaced(&table, &time).map_err(asked("columns.time"))?;
    let times = table.column(&time)?;
    let values = table
        .column(&displacement)
        .map_err(asked("columns.displacement"))?
        .to_vec();
    Ok(Record {
        start: times[0],
        duration: times[times.len() - 1] - times[0],
        spacing,
        values,
    })
}

/// The functions are functions of one time, so all records must span the same.
fn same_span(file: &ModelFile, records: &[Option<Record>]) -> Result<(), InputError> {
    let Some(Some(first)) = records.first() else {
        return Ok(());
    };
    for (i, record) in records.iter().enumerate().skip(1) {
        let Some(record) = record else { continue };
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-6 * first.spacing;
        if !close(record.start, first.start) || !close(record.duration, first.duration) {
            let span = |r: &Record| format!("{} s to {} s", r.start, r.start + r.duration);
            return Err(file
                .error_at(
                    &format!("experiments[{i}].data"),
                    "this record spans another time than the first one",
                )
                .found(span(record))
                .expected(format!("{}, as the functions are shared", span(first))));
        }
    }
    Ok(())
}

/// Puts the records on the grid.
pub(super) fn build(
    file: &ModelFile,
    purpose: Purpose,
    grid: &Grid,
    records: Vec<Option<Record>>,
) -> Result<Vec<Experiment>, InputError> {
    let specs = file.spec.experiments.iter().zip(records).enumerate();
    specs
        .map(|(i, (spec, record))| {
            let weighting = weighting(file, i, spec)?;
            let readings = match (purpose, record) {
                (Purpose::Simulate { .. }, _) | (_, None) => None,
                (_, Some(record)) => Some(place(file, purpose, grid, record, weighting)?),
            };
            let initial = State {
                displacement: spec.initial.displacement.0,
                velocity: spec.initial.velocity.0,
            };
            let mut experiment = Experiment::free(name(file, i), initial, grid.nodes());
            experiment.channels.extend(readings);
            Ok(experiment)
        })
        .collect()
}

fn weighting(file: &ModelFile, i: usize, spec: &ExperimentSpec) -> Result<Option<f64>, InputError> {
    let sigma = spec.sigma.as_ref().and_then(|s| s.displacement.as_ref());
    match sigma {
        Some(sigma) if sigma.0 <= 0.0 => Err(file
            .error_at(
                &format!("experiments[{i}].sigma.displacement"),
                "a standard deviation must be positive",
            )
            .found(sigma.0)
            .expected("a number greater than 0, in m")),
        _ => Ok(sigma.map(|sigma| sigma.0)),
    }
}

fn place(
    file: &ModelFile,
    purpose: Purpose,
    grid: &Grid,
    record: Record,
    sigma: Option<f64>,
) -> Result<Channel, InputError> {
    let (steps, intervals) = (grid.nodes() - 1, record.values.len() - 1);
    let (values, stride) = if steps.is_multiple_of(intervals) {
        (record.values, steps / intervals)
    } else if matches!(purpose, Purpose::Check { .. }) {
        (resample(&record.values, grid.nodes()), 1)
    } else {
        return Err(file
            .error_at("grid.nodes", "the readings do not fall on nodes")
            .found(format!("{} nodes, {} readings", steps + 1, intervals + 1))
            .expected(format!(
                "{} nodes or 1 + a multiple of {intervals}",
                intervals + 1
            )));
    };
    // A check is about the gradient, so a finer grid gets a reading at every node.
    let (values, stride) = match purpose {
        Purpose::Check { .. } if stride > 1 => (resample(&values, grid.nodes()), 1),
        _ => (values, stride),
    };
    let spacing = grid.duration() / (values.len() - 1) as f64;
    let weighting = match sigma {
        Some(sigma) => Weighting::Sigma(sigma),
        None => Weighting::Integral { spacing },
    };
    Ok(Channel::displacement_at_nodes(
        values, stride, weighting, grid,
    ))
}
