//! Finished runs, data files and model files.

use crate::errors::{Failure, guarded, keyed};
use crate::source::to_bytes;
use kmcfit::Run;
use kmcfit::config::{ModelFile, NewRecord, Source, Statements};
use kmcfit::error::InputError;
use kmcfit::quantity_names::quantity_of;
use kmcfit::report::compare::{ComparedRun, Comparison};
use kmcfit::report::{CsvTable, ForcedPredictions, json, predict};
use kmcfit::tables::Table;
use kmcfit::units::{Measurand, Unit};
use kmcfit_core::record::ChannelKind;
use kmcfit_core::system::State;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::path::PathBuf;

/// Checks the keys and types of a model; returns its maps and lists as JSON. Messages name keys, and lines if it was `written` by the user.
#[pyfunction]
pub fn parse(py: Python<'_>, text: String, path: PathBuf, written: bool) -> PyResult<String> {
    guarded(py, || match ModelFile::parse(&path, text) {
        Ok(file) => Ok(file.to_json()),
        Err(error) if written => Err(Failure::Input(error)),
        Err(error) => Err(Failure::Input(keyed(error, &path))),
    })
}

/// The text of a model file.
#[pyfunction]
pub fn read_text(py: Python<'_>, path: PathBuf) -> PyResult<String> {
    guarded(py, || Ok(ModelFile::read(&path)?.text))
}

/// A model file for measured records, as `kmcfit init` writes it.
#[pyfunction]
pub fn scaffold(py: Python<'_>, paths: Vec<PathBuf>) -> PyResult<String> {
    guarded(py, || {
        let sources: Vec<Source> = (paths.into_iter())
            .map(|path| Source::file(&path, path.display().to_string()))
            .collect();
        Ok(kmcfit::config::scaffold(&sources, &Statements::default())?.text)
    })
}

/// The quantity of a channel by its unit and name, as `kmcfit init` finds it.
#[pyfunction]
pub fn quantity(name: &str, unit: &str) -> Option<&'static str> {
    let by_name = quantity_of(name);
    let of =
        |kind: &Measurand| Unit::recognise(*kind, unit).is_some_and(|unit| !unit.is_arbitrary());
    let by_unit = Measurand::ALL.into_iter().find(of);
    let found = match unit.trim() {
        "" => by_name,
        _ => by_name.filter(of).or(by_unit),
    };
    found.map(Measurand::name)
}

/// The numeric columns of a data file, each with its name.
#[pyfunction]
pub fn read_table(py: Python<'_>, path: PathBuf) -> PyResult<Vec<(String, Py<PyBytes>)>> {
    let columns = guarded(py, || {
        let table = Table::read(&path)?;
        let numeric = (0..table.width()).filter_map(|i| {
            let samples = table.samples(i).ok()?;
            Some((table.label(i), samples.to_vec()))
        });
        Ok(numeric.collect::<Vec<_>>())
    })?;
    let columns = columns.into_iter();
    let columns = columns.map(|(name, x)| (name, PyBytes::new(py, &to_bytes(&x)).unbind()));
    Ok(columns.collect())
}

/// Checks a finished run; returns its result document.
#[pyfunction]
pub fn open_run(py: Python<'_>, folder: PathBuf) -> PyResult<String> {
    guarded(py, || {
        let run = Run::open(&folder)?;
        let path = run.folder.join("result.json");
        std::fs::read_to_string(&path).map_err(|error| {
            let error = InputError::file(&path, "the result cannot be read").found(error);
            Failure::Input(error)
        })
    })
}

/// The response of the system of a run, as CSV.
#[pyfunction]
pub fn simulate(
    py: Python<'_>,
    folder: PathBuf,
    force: Option<PathBuf>,
    base: Option<PathBuf>,
    initial: (f64, f64),
    channels: Vec<String>,
) -> PyResult<String> {
    guarded(py, || {
        let kinds = kinds(&channels)?;
        let run = Run::open(&folder)?;
        let state = State::one(initial.0, initial.1);
        if force.is_none() && base.is_none() {
            return free(&run, state, &kinds);
        }
        if run.document.model.mass_unknown && force.is_some() {
            return Err(Failure::Input(
                InputError::argument("force", "the mass of the fitted system is unknown")
                    .expected("a motion of the base; the response to a force depends on the mass")
                    .hint("fit with the mass: `km.Model(mass=…)`, in kg"),
            ));
        }
        let record = NewRecord::read(force.as_deref(), base.as_deref(), &run.own_model()?)?;
        let found = ForcedPredictions::of(&run, &record, &[state], &kinds)?;
        Ok(found.map_err(Failure::Numerical)?.csv().to_csv())
    })
}

fn kinds(channels: &[String]) -> Result<Vec<ChannelKind>, Failure> {
    let kind = |name: &String| {
        let found = ChannelKind::ALL
            .into_iter()
            .find(|kind| kind.name() == name);
        found.ok_or_else(|| {
            Failure::Input(
                InputError::argument("channels", "no such channel")
                    .found(format!("`{name}`"))
                    .expected("displacement, velocity or acceleration"),
            )
        })
    };
    channels.iter().map(kind).collect()
}

/// A free response over the times of the fit.
fn free(run: &Run, state: State, kinds: &[ChannelKind]) -> Result<String, Failure> {
    if kinds.iter().any(|kind| *kind != ChannelKind::Displacement) {
        return Err(Failure::Input(
            InputError::argument("channels", "a free response is predicted as a displacement")
                .expected("`displacement`, or a force or motion of the base"),
        ));
    }
    let responses = predict(&run.system, &run.coefficients, None, &[state])
        .map_err(|breakdown| Failure::Numerical(format!("no response: {breakdown}")))?;
    let mut table = CsvTable::new().column("t_s", run.system.grid.times());
    for predicted in responses {
        table = table.column(
            "displacement_m",
            predicted.response.displacement(0).to_vec(),
        );
    }
    Ok(table.to_csv())
}

/// Compares finished runs, each with its name: text, document and page.
#[pyfunction]
pub fn compare(py: Python<'_>, runs: Vec<(String, PathBuf)>) -> PyResult<(String, String, String)> {
    guarded(py, || {
        let runs = runs
            .iter()
            .map(|(name, folder)| ComparedRun::read(name, folder));
        let compared = Comparison::new(runs.collect::<Result<_, _>>()?, Vec::new());
        Ok((
            compared.text(),
            json(&compared.document()),
            compared.to_html(),
        ))
    })
}
