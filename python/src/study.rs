//! Studies.

use crate::errors::{Failure, keyed};
use crate::fit::{RawFit, ended, watched};
use kmcfit::Run;
use kmcfit::cli::{CommandError, study_into};
use kmcfit::config::{ModelFile, Override};
use kmcfit::report::study::{StudiedFit, StudyDocument};
use kmcfit_core::problem::Problem;
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Findings by the name of their part, the text for a terminal, and true if Ctrl-C ended the study.
type Studied = (Vec<(&'static str, String)>, String, bool);

/// Studies a fit into a folder: the files of `kmcfit study`. Ctrl-C ends it after the analyses finished so far.
#[pyfunction]
pub fn study(
    py: Python<'_>,
    fit: Py<RawFit>,
    folder: PathBuf,
    overrides: Vec<String>,
    threads: Option<usize>,
) -> PyResult<Studied> {
    let fit = fit.get();
    run(py, move |flag| {
        let file = fit.file.clone();
        let path = file.path.clone();
        let in_memory = !file.files_in_memory().is_empty();
        let located = |error| match in_memory {
            true => keyed(error, &path),
            false => error,
        };
        let finished = StudiedFit::of(&fit.done.model, &fit.done.fit);
        let finished = Some((finished, fit.done.model.problem.clone()));
        studied(file, &overrides, &folder, threads, finished, flag).map_err(|error| match error {
            Failure::Input(error) => Failure::Input(located(error)),
            other => other,
        })
    })
}

/// Studies the model of a finished run.
#[pyfunction]
pub fn study_run(
    py: Python<'_>,
    run: PathBuf,
    folder: PathBuf,
    overrides: Vec<String>,
    threads: Option<usize>,
) -> PyResult<Studied> {
    self::run(py, move |flag| {
        let file = Run::open(&run)?.model_file()?;
        studied(file, &overrides, &folder, threads, None, flag)
    })
}

fn run(
    py: Python<'_>,
    work: impl FnOnce(Arc<AtomicBool>) -> Result<StudyDocument, Failure> + Send,
) -> PyResult<Studied> {
    let flag = Arc::new(AtomicBool::new(false));
    let own = Arc::clone(&flag);
    let (result, signal) = py.detach(|| watched(&flag, move || work(own)));
    let document = ended(py, result, signal, |document| !document.is_complete())?;
    Ok((
        document.findings(),
        document.text(),
        !document.is_complete(),
    ))
}

fn studied(
    file: ModelFile,
    overrides: &[String],
    folder: &Path,
    threads: Option<usize>,
    finished: Option<(StudiedFit, Problem)>,
    flag: Arc<AtomicBool>,
) -> Result<StudyDocument, Failure> {
    let file = file.with_overrides(&Override::parse_all(overrides)?)?;
    study_into(folder, &file, threads, finished, flag).map_err(|error| match error {
        CommandError::Input(error) => Failure::Input(error),
        CommandError::Numerical(reason) => Failure::Numerical(reason),
    })
}
