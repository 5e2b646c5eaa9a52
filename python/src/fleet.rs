//! Fleets: one model on many records.

use crate::errors::{Failure, guarded, keyed};
use kmcfit::config::{ModelFile, Override};
use kmcfit::error::InputError;
use kmcfit::fleet::{
    FleetFolder, FleetModel, Journal, Limits, Record, RecordList, Row, RowIndex, Shard, Trend,
    collect, fit_record, fleet_page,
};
use kmcfit::results::write_whole;
use kmcfit_core::internals::threads::sharing;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// A record: name, path, content where it stands in memory, changed keys, system, and values of the other columns.
type Given = (
    String,
    PathBuf,
    Option<PyBackedBytes>,
    Vec<String>,
    String,
    Vec<String>,
);
/// The row of a record and its curves, as JSON.
type Lines = (String, Vec<String>);

/// The model of a fleet.
#[pyclass(frozen, module = "kmcfit._kmcfit")]
pub struct RawFleet {
    model: FleetModel,
    interrupt: Arc<AtomicBool>,
    /// The model with the changed keys of the last record: those of many records are the same.
    last: Mutex<Option<(Vec<String>, FleetModel)>>,
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
                FleetModel::new(file.with_overrides(&overrides)?)
            };
            let model = read().map_err(|error| match is_text {
                true => keyed(error, &path),
                false => error,
            })?;
            Ok(Self {
                model,
                interrupt: Arc::default(),
                last: Mutex::default(),
            })
        })
    }

    /// Ends the fits of this model that are going on.
    fn interrupt(&self) {
        self.interrupt.store(true, Ordering::Relaxed);
    }

    /// Fits blocks of records on this thread; with `warm_start` each one of a block from the estimates of the one before. The rows end
    /// early where they are interrupted.
    fn fit(
        &self,
        py: Python<'_>,
        blocks: Vec<Vec<Given>>,
        warm_start: bool,
        time_limit: Option<f64>,
    ) -> PyResult<Vec<Lines>> {
        let limits = Limits {
            interrupt: Arc::clone(&self.interrupt),
            // The callers refuse other times.
            time: time_limit.and_then(|limit| Duration::try_from_secs_f64(limit).ok()),
        };
        guarded(py, || {
            let mut rows = Vec::new();
            for block in blocks {
                let mut from: Option<Vec<f64>> = None;
                for given in block {
                    let found = sharing(|| self.fit_one(given, from.as_deref(), &limits));
                    let Some((lines, parameters)) = found? else {
                        return Ok(rows);
                    };
                    rows.push(lines);
                    from = parameters.filter(|_| warm_start);
                }
            }
            Ok(rows)
        })
    }
}

impl RawFleet {
    /// The row of a record, and the parameters of its functions; `None` where it was interrupted.
    fn fit_one(
        &self,
        given: Given,
        from: Option<&[f64]>,
        limits: &Limits,
    ) -> Result<Option<(Lines, Option<Vec<f64>>)>, Failure> {
        let (name, path, content, overrides, ..) = given;
        let content = content.map(|content| Arc::from(&*content));
        let record = Record {
            path,
            ..Record::of_file(&name)
        };
        let found = match self.changed(overrides) {
            Ok(model) => fit_record(&model, &record, content, from, limits),
            Err(error) => {
                let row = Row::failed(&name, 0.0, error.to_string());
                return Ok(Some((
                    (line(serde_json::to_string(&row))?, Vec::new()),
                    None,
                )));
            }
        };
        let Some(found) = found else {
            return Ok(None);
        };
        let curves = found.curves.iter();
        let curves = curves.map(|curve| line(serde_json::to_string(curve)));
        let row = line(serde_json::to_string(&found.row))?;
        let lines = (row, curves.collect::<Result<_, _>>()?);
        Ok(Some((lines, found.parameters)))
    }

    /// The model with changed keys.
    fn changed(&self, overrides: Vec<String>) -> Result<FleetModel, InputError> {
        if overrides.is_empty() {
            return Ok(self.model.clone());
        }
        let last = || self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, model)) = last().as_ref().filter(|(keys, _)| *keys == overrides) {
            return Ok(model.clone());
        }
        let changes = Override::parse_all(&overrides)?;
        let model = FleetModel {
            file: self.model.file.clone().with_overrides(&changes)?,
        };
        *last() = Some((overrides, model.clone()));
        Ok(model)
    }
}

/// A line of JSON.
fn line(written: serde_json::Result<String>) -> Result<String, Failure> {
    written.map_err(|error| Failure::Panic(error.to_string()))
}

/// The records of files, patterns, or one table, and the names of its other columns: the arguments of `kmcfit fleet`.
#[pyfunction]
pub fn record_list(py: Python<'_>, arguments: Vec<String>) -> PyResult<(Vec<Given>, Vec<String>)> {
    guarded(py, || {
        let list = RecordList::read(&arguments)?;
        let given = list.records.into_iter().map(|record| {
            let overrides = record.overrides.iter().map(Override::to_string);
            (
                record.name,
                record.path,
                None,
                overrides.collect(),
                record.system,
                record.columns,
            )
        });
        Ok((given.collect(), list.columns))
    })
}

/// Folder and journal of a fleet, as `kmcfit fleet` writes them.
#[pyclass(frozen, module = "kmcfit._kmcfit")]
pub struct RawJournal(Mutex<State>);

struct State {
    folder: FleetFolder,
    /// The records so far, or all where they are known.
    list: RecordList,
    /// Names of records that become known one after another.
    names: HashSet<String>,
    /// Records of a folder that is complete, by their names, where they become known one after another.
    known: Option<HashMap<String, Record>>,
    /// True to fit records again whose rows have errors.
    retry_errors: bool,
    index: RowIndex,
    /// None once it is closed.
    journal: Option<Journal>,
}

impl State {
    /// Does `work` on the journal; its errors name the folder.
    fn write(
        &mut self,
        work: impl FnOnce(&mut Journal) -> std::io::Result<()>,
    ) -> Result<(), Failure> {
        let closed = || Failure::Numerical("the journal is closed".into());
        let done = work(self.journal.as_mut().ok_or_else(closed)?);
        done.map_err(|error| unwritable(&self.folder.path, error).into())
    }
}

#[pymethods]
impl RawJournal {
    /// Creates or opens the folder for `records`, or without them for records that become known one after another.
    #[new]
    fn new(
        py: Python<'_>,
        folder: PathBuf,
        model: Py<RawFleet>,
        records: Option<Vec<Given>>,
        columns: Vec<String>,
        warm_start: bool,
        retry_errors: bool,
        trend: Option<String>,
    ) -> PyResult<Self> {
        let model = &model.get().model;
        guarded(py, || {
            let mut list = RecordList {
                columns,
                ..RecordList::default()
            };
            let folder = match records {
                Some(records) => {
                    let records = records
                        .into_iter()
                        .map(|record| listed(record, list.columns.len()));
                    list.records = records.collect::<Result<_, _>>()?;
                    list = list.checked()?;
                    axis(&list, trend.as_deref())?;
                    FleetFolder::prepare(&folder, model, &list, warm_start)?
                }
                None => FleetFolder::begin(&folder, model, warm_start)?,
            };
            let folder = folder.with_trend(trend.as_deref())?;
            let known = match list.records.is_empty() && folder.identity.records > 0 {
                true => Some(folder.records()?.records),
                false => None,
            };
            let known = known.map(|records| {
                let lines = records.into_iter();
                lines.map(|record| (record.name.clone(), record)).collect()
            });
            let journal = Journal::open(&folder.path, Shard::ALL, |_| {})?;
            let index = RowIndex::read(&folder.path)?;
            Ok(Self(Mutex::new(State {
                folder,
                list,
                names: HashSet::new(),
                known,
                retry_errors,
                index,
                journal: Some(journal),
            })))
        })
    }

    /// Adds a record that became known.
    fn add(&self, py: Python<'_>, record: Given) -> PyResult<()> {
        guarded(py, || {
            let mut state = self.state();
            if !state.names.insert(record.0.clone()) {
                return Err(Failure::Input(
                    InputError::argument("records", "two records have the same name")
                        .found(format!("`{}`", record.0))
                        .expected("every record once"),
                ));
            }
            let columns = state.list.columns.len();
            let record = listed(record, columns)?;
            let known = state.known.as_ref();
            if known
                .is_some_and(|known| !known.get(&record.name).is_some_and(|k| is_same(k, &record)))
            {
                return Err(Failure::Input(
                    InputError::file(
                        &state.folder.path,
                        "the folder belongs to a fleet of other records",
                    )
                    .found(format!("`{}`, which is new or has changed", record.name))
                    .expected("the records with which it was completed"),
                ));
            }
            state.list.records.push(record);
            Ok(())
        })
    }

    /// The row that a record had before, as JSON.
    fn row(&self, py: Python<'_>, record: &str) -> PyResult<Option<String>> {
        let state = self.state();
        let has_row = match state.retry_errors {
            true => state.index.has_estimates(record),
            false => state.index.has(record),
        };
        if !has_row {
            return Ok(None);
        }
        guarded(py, || Ok(state.index.line(record)?))
    }

    /// Appends rows with their curves.
    fn append(&self, py: Python<'_>, rows: Vec<Lines>) -> PyResult<()> {
        guarded(py, || {
            let mut state = self.state();
            for (row, curves) in rows {
                let read = || {
                    let curves = curves.iter().map(|curve| serde_json::from_str(curve));
                    Ok::<_, serde_json::Error>((
                        serde_json::from_str(&row)?,
                        curves.collect::<Result<Vec<_>, _>>()?,
                    ))
                };
                let (row, curves) = read().map_err(|error| Failure::Panic(error.to_string()))?;
                state.write(|journal| journal.append(&row, &curves))?;
            }
            Ok(())
        })
    }

    /// Makes the rows durable and lets other processes work on the folder.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        guarded(py, || {
            let mut state = self.state();
            let synced = state.write(Journal::sync);
            state.journal = None;
            synced
        })
    }

    /// Writes tables, statistics and page; every record has its row.
    fn finish(&self, py: Python<'_>, trend: Option<String>) -> PyResult<()> {
        guarded(py, || {
            let mut state = self.state();
            state.write(Journal::sync)?;
            let folder = state.folder.clone().complete(&state.list)?;
            collected(&folder, state.list.clone(), trend.as_deref())
        })
    }
}

impl RawJournal {
    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// True if a record is the one of a list that was written: same place, changed keys and system.
fn is_same(written: &Record, record: &Record) -> bool {
    let place = |record: &Record| match record.is_in_memory() {
        true => record.path.clone(),
        false => std::path::absolute(&record.path).unwrap_or_else(|_| record.path.clone()),
    };
    place(written) == place(record)
        && written.overrides == record.overrides
        && written.system == record.system
}

/// A record without its content, with a cell for each column.
fn listed(given: Given, width: usize) -> Result<Record, InputError> {
    let (name, path, _, overrides, system, mut columns) = given;
    columns.resize(width, String::new());
    Ok(Record {
        name,
        path,
        overrides: Override::parse_all(&overrides)?,
        system,
        columns,
    })
}

fn unwritable(folder: &Path, error: std::io::Error) -> InputError {
    InputError::file(folder, "a row cannot be written")
        .found(error)
        .expected("room for the rows")
        .hint("the same call continues after the rows that are written")
}

/// The axis of the page of a fleet.
fn axis(list: &RecordList, trend: Option<&str>) -> Result<Trend, InputError> {
    Trend::of(list, trend).ok_or_else(|| {
        InputError::argument("trend", "no column of numbers or dates with this name")
            .found(format!("`{}`", trend.unwrap_or_default()))
            .expected(match list.columns.is_empty() {
                true => "records with further keys".into(),
                false => format!("one of: {}", list.columns.join(", ")),
            })
    })
}

/// Joins the shards of a fleet: tables, statistics and page.
fn collected(folder: &FleetFolder, list: RecordList, trend: Option<&str>) -> Result<(), Failure> {
    let trend = trend.or(folder.identity.trend.as_deref());
    let axis = axis(&list, trend)?;
    let found = collect(folder, list, &axis)?;
    let page = fleet_page(folder, &found, &axis);
    let path = folder.path.join("fleet.html");
    Ok(write_whole(&path, &page).map_err(|error| unwritable(&folder.path, error))?)
}

/// Joins the shards of the fleet of a folder; returns its rows in the order of the records, as JSON.
#[pyfunction]
pub fn fleet_rows(py: Python<'_>, folder: PathBuf, collect: bool) -> PyResult<Vec<String>> {
    guarded(py, || {
        let folder = FleetFolder::open(&folder)?;
        let list = folder.records()?;
        let index = RowIndex::read(&folder.path)?;
        let rows = match list.records.is_empty() {
            // Its records are not all known.
            true => index.lines()?,
            false => {
                let names = list.records.iter().map(|record| index.line(&record.name));
                names
                    .filter_map(Result::transpose)
                    .collect::<Result<_, _>>()?
            }
        };
        if collect && !list.records.is_empty() {
            collected(&folder, list, None)?;
        }
        Ok(rows)
    })
}
