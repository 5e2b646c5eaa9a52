//! Fleets: one model on many records.

use crate::errors::{Failure, guarded, keyed};
use kmcfit::config::{ModelFile, Override};
use kmcfit::fleet::{
    FleetFolder, FleetRecord, RecordList, Row, Trend, check_model, finish, fit_record,
};
use kmcfit_core::threads::sharing;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A record: name, path, content where it stands in memory, changed keys, and values of the other columns.
type Given = (
    String,
    PathBuf,
    Option<PyBackedBytes>,
    Vec<String>,
    Vec<String>,
);

/// The model of a fleet.
#[pyclass(frozen, module = "kmcfit._kmcfit")]
pub struct RawFleet {
    model: ModelFile,
    interrupt: Arc<AtomicBool>,
}

#[pymethods]
impl RawFleet {
    /// The model of a text, or without one of the file of the path.
    #[new]
    fn new(
        py: Python<'_>,
        text: Option<String>,
        path: PathBuf,
        overrides: Vec<String>,
    ) -> PyResult<Self> {
        let is_text = text.is_some();
        guarded(py, || {
            let read = || {
                let overrides = Override::parse_all(&overrides)?;
                let file = match text {
                    Some(text) => ModelFile::parse(&path, text)?,
                    None => ModelFile::read(&path)?,
                };
                check_model(file.with_overrides(&overrides)?)
            };
            let model = read().map_err(|error| match is_text {
                true => keyed(error, &path),
                false => error,
            })?;
            Ok(Self {
                model,
                interrupt: Arc::default(),
            })
        })
    }

    /// Ends the fits of this model that are going on.
    fn interrupt(&self) {
        self.interrupt.store(true, Ordering::Relaxed);
    }

    /// Fits a record on this thread; its row as JSON, or None where it was interrupted.
    fn fit(&self, py: Python<'_>, record: Given) -> PyResult<Option<String>> {
        guarded(py, || {
            let name = record.0.clone();
            let row = match given(record) {
                Ok(record) => sharing(|| fit_record(&self.model, &record, &self.interrupt)),
                Err(error) => Some(Row::failed(&name, error.to_string())),
            };
            let line = row.map(|row| serde_json::to_string(&row));
            line.transpose()
                .map_err(|error| Failure::Panic(error.to_string()))
        })
    }
}

/// A record of Rust; errors are those of its changed keys.
fn given(record: Given) -> Result<FleetRecord, kmcfit::error::InputError> {
    let (name, path, content, overrides, columns) = record;
    Ok(FleetRecord {
        path,
        content: content.map(|content| Arc::from(&*content)),
        overrides: Override::parse_all(&overrides)?,
        columns,
        ..FleetRecord::of_file(&name)
    })
}

/// The records of files, patterns, or one table, and the names of its other columns: the arguments of `kmcfit fleet`.
#[pyfunction]
pub fn record_list(py: Python<'_>, arguments: Vec<String>) -> PyResult<(Vec<Given>, Vec<String>)> {
    guarded(py, || {
        let list = RecordList::read(&arguments)?;
        let given = list.records.into_iter().map(|record| {
            let overrides = record.overrides.iter().map(Override::to_string).collect();
            (record.name, record.path, None, overrides, record.columns)
        });
        Ok((given.collect(), list.columns))
    })
}

/// The folder of a fleet, as `kmcfit fleet` writes it.
#[pyclass(frozen, module = "kmcfit._kmcfit")]
pub struct RawFolder(Mutex<Option<FleetFolder>>);

#[pymethods]
impl RawFolder {
    /// Creates the folder, or opens it to go on after its rows.
    #[new]
    fn new(py: Python<'_>, folder: PathBuf, model: Py<RawFleet>) -> PyResult<Self> {
        let model = &model.get().model;
        guarded(py, || {
            Ok(Self(Mutex::new(Some(FleetFolder::open(&folder, model)?))))
        })
    }

    /// The row that a record had before, as JSON; none with an error. A record that has changed is refused.
    fn row(&self, py: Python<'_>, record: Given) -> PyResult<Option<String>> {
        guarded(py, || {
            self.with(|folder| {
                let row = folder.row(&record.0);
                let Some(row) = row.filter(|row| row.error.is_none()) else {
                    return Ok(None);
                };
                let line = serde_json::to_string(row)
                    .map_err(|error| Failure::Panic(error.to_string()))?;
                folder.check_record(&given(record)?)?;
                Ok(Some(line))
            })
        })
    }

    /// Appends rows.
    fn append(&self, py: Python<'_>, lines: Vec<String>) -> PyResult<()> {
        guarded(py, || {
            self.with(|folder| {
                for line in lines {
                    let row = serde_json::from_str(&line)
                        .map_err(|error| Failure::Panic(error.to_string()))?;
                    folder.append(row)?;
                }
                Ok(())
            })
        })
    }

    /// Writes table and page of the records, all of which have their rows.
    fn finish(
        &self,
        py: Python<'_>,
        records: Vec<Given>,
        columns: Vec<String>,
        trend: Option<String>,
    ) -> PyResult<()> {
        guarded(py, || {
            let records = records.into_iter().map(|record| {
                let mut record = given(record)?;
                record.columns.resize(columns.len(), String::new());
                Ok(record)
            });
            let records = records.collect::<Result<_, kmcfit::error::InputError>>()?;
            let list = RecordList { records, columns }.checked()?;
            let trend = Trend::of(&list, trend.as_deref())?;
            self.with(|folder| Ok(drop(finish(folder, &list, &trend)?)))
        })
    }

    /// Lets other processes work on the folder.
    fn close(&self) {
        *self.lock() = None;
    }
}

impl RawFolder {
    fn lock(&self) -> MutexGuard<'_, Option<FleetFolder>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn with<T>(
        &self,
        work: impl FnOnce(&mut FleetFolder) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        match &mut *self.lock() {
            Some(folder) => work(folder),
            None => Err(Failure::Numerical(
                "the folder of the fleet is closed".into(),
            )),
        }
    }
}
