//! Fits.

use crate::errors::{Failure, caught, guarded};
use crate::source::RawModel;
use kmcfit::config::ModelFile;
use kmcfit::fitting::fit_or_no_response;
use kmcfit::report::document::ResultDocument;
use kmcfit::report::selection::{Selected, select};
use kmcfit::report::{CompletedFit, MODEL, OverheadTimings, RequestedFiles, TimingsSummary, json};
use kmcfit::results::OutputFolder;
use kmcfit_core::solvers::{IterationRecord, Observer, Status};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::{Builder, scope};
use std::time::{Duration, Instant};

/// Time between two looks for Ctrl-C.
const POLL: Duration = Duration::from_millis(20);
/// Stack of the thread of a fit, bytes: that of the program's main thread on Linux.
const STACK: usize = 8 << 20;

/// A finished fit.
#[pyclass(frozen, module = "kmcfit._kmcfit")]
pub struct RawFit {
    pub file: ModelFile,
    pub done: CompletedFit,
    document: ResultDocument,
}

/// Fits a model; Ctrl-C ends the fit at its best point. `progress` is called with number and cost of each iteration. In the main thread
/// the fit of small records is done in place, which saves the start of a thread.
#[pyfunction]
pub fn fit(
    py: Python<'_>,
    model: Py<RawModel>,
    selects: bool,
    progress: Option<Py<PyAny>>,
    is_main_thread: bool,
) -> PyResult<RawFit> {
    let model = model.get();
    let flag = Arc::new(AtomicBool::new(false));
    let interrupt = Arc::clone(&flag);
    let (result, signal) = match is_main_thread && model.is_small() {
        true => polled(py, &flag, |poll| {
            fitted(model, selects, interrupt, progress, poll)
        }),
        false => py.detach(|| watched(&flag, || {
                fitted(model, selects, interrupt, progress, &mut || ())
            })),
    };
    ended(py, result, signal, RawFit::is_interrupted)
}

/// The result of work that a signal may have ended: Ctrl-C gives a result that `is_interrupted`, another exception is raised.
pub fn ended<T>(
    py: Python<'_>,
    result: Result<T, Failure>,
    signal: Option<PyErr>,
    is_interrupted: impl Fn(&T) -> bool,
) -> PyResult<T> {
    let found = result.map_err(|failure| failure.raise(py));
    let Some(raised) = signal else {
        return found;
    };
    match (raised.is_instance_of::<PyKeyboardInterrupt>(py), found) {
        (true, Ok(found)) if is_interrupted(&found) => Ok(found),
        (true, Err(error)) => Err(error),
        _ => Err(raised),
    }
}

/// Does `work` on a thread of its own, and sets `flag` at the first exception of a signal handler, which is returned.
#[allow(
    clippy::disallowed_methods,
    reason = "its stack is as large as that of the program's main thread; a refusal is an error"
)]
pub fn watched<T: Send>(
    flag: &AtomicBool,
    work: impl FnOnce() -> Result<T, Failure> + Send,
) -> (Result<T, Failure>, Option<PyErr>) {
    let mut signal = None;
    let result = scope(|scope| {
        let (done, finished) = channel();
        // The result is sent, so that the call does not wait for the end of the thread, which returns its memory.
        let worker = Builder::new()
            .stack_size(STACK)
            .spawn_scoped(scope, move || {
                let _ = done.send(caught(work));
            });
        worker.map_err(|error| Failure::Numerical(format!("no thread: {error}")))?;
        loop {
            match finished.recv_timeout(POLL) {
                Ok(result) => return result,
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(Failure::Panic("the thread of the work ended".into()));
                }
                Err(RecvTimeoutError::Timeout) => {
                    if let Err(raised) = Python::attach(|py| py.check_signals()) {
                        flag.store(true, Ordering::Relaxed);
                        signal = Some(raised);
                    }
                }
            }
        }
    });
    (result, signal)
}

/// Does `work` on this thread, without the interpreter; it calls its argument often, which sets `flag` at the first exception of a signal
/// handler, which is returned.
fn polled<T: Send>(
    py: Python<'_>,
    flag: &AtomicBool,
    work: impl FnOnce(&mut dyn FnMut()) -> Result<T, Failure> + Send,
) -> (Result<T, Failure>, Option<PyErr>) {
    py.detach(|| {
        let (mut signal, mut last) = (None, Instant::now());
        let mut poll = || {
            if last.elapsed() < POLL {
                return;
            }
            last = Instant::now();
            if let Err(raised) = Python::attach(|py| py.check_signals()) {
                flag.store(true, Ordering::Relaxed);
                signal = Some(raised);
            }
        };
        let result = caught(|| work(&mut poll));
        (result, signal)
    })
}

/// Fits a model; `poll` is called after each iteration.
fn fitted(
    source: &RawModel,
    selects: bool,
    interrupt: Arc<AtomicBool>,
    progress: Option<Py<PyAny>>,
    poll: &mut dyn FnMut(),
) -> Result<RawFit, Failure> {
    let mut model = source.build()?;
    model.settings.interrupt = Some(Arc::clone(&interrupt));
    let clock = Instant::now();
    let mut raised = None;
    let mut show = |record: &IterationRecord| {
        poll();
        let Some(progress) = progress.as_ref().filter(|_| raised.is_none()) else {
            return;
        };
        let (iteration, cost) = (record.iteration, record.cost);
        let called = Python::attach(|py| progress.call1(py, (iteration, cost)).map(drop));
        if let Err(error) = called {
            interrupt.store(true, Ordering::Relaxed);
            raised = Some(error);
        }
    };
    let found = fit_or_no_response(&model, &mut Observer::new(&mut show));
    if let Some(error) = raised {
        return Err(Failure::Raised(error));
    }
    let found = found.map_err(Failure::Numerical)?;
    let analysis = Instant::now();
    let (fit, requested) = (CompletedFit::of(found), RequestedFiles::figures());
    let found = match selects {
        true => select(source.file(), fit, requested),
        false => Selected::of(source.file(), fit, requested),
    };
    let (file, done, mut document) = (found.file, found.fit, found.document);
    let overhead = OverheadTimings {
        io: model.preparation.reading,
        analysis: analysis.elapsed(),
        report: Duration::ZERO,
    };
    let total = (model.preparation.total + clock.elapsed()).max(overhead.sum() + done.fit.elapsed);
    document.timings = TimingsSummary::new(&done.fit, &overhead, total);
    Ok(RawFit {
        file,
        done,
        document,
    })
}

impl RawFit {
    /// Writes the run; a model in memory with its files beside the results.
    fn write(&self, folder: &Path, requested: RequestedFiles) -> Result<(), Failure> {
        let in_memory: Vec<(String, Arc<[u8]>)> = self.file.files_in_memory();
        let inputs = self.file.data_files().into_iter();
        let inputs: Vec<PathBuf> = match in_memory.is_empty() {
            true => inputs.chain([self.file.path.clone()]).collect(),
            false => Vec::new(),
        };
        let output = OutputFolder::prepare(folder, "fit", inputs)?;
        let full = |error| {
            Failure::Input(
                kmcfit::error::InputError::file(folder, "the results cannot be written")
                    .found(error)
                    .expected("a writable folder"),
            )
        };
        let run = self.done.fitted(requested);
        let mut document = run.document();
        document.timings = self.document.timings.clone();
        document.selection = self.document.selection.clone();
        let text = match in_memory.is_empty() {
            true => &self.file.text,
            false => self.file.effective_text(),
        };
        output.write(MODEL, text).map_err(full)?;
        match in_memory.is_empty() {
            true => document.model.folder = output.path_to(None, self.file.path.parent()),
            false => document.model.file = folder.join(MODEL).display().to_string(),
        }
        for (name, content) in &in_memory {
            output.write(name, content).map_err(full)?;
        }
        run.write(&|name, bytes| output.write(name, bytes), &document)
            .map_err(full)?;
        output.commit(&document).map_err(full)
    }
}

#[pymethods]
impl RawFit {
    /// True if Ctrl-C ended the fit.
    pub fn is_interrupted(&self) -> bool {
        self.document.outcome.status == Status::Interrupted
    }

    /// The result document.
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        guarded(py, || Ok(json(&self.document)))
    }

    /// Tables over time and iterations, and the parameters, by the name of the file; one row for every node.
    fn tables(&self, py: Python<'_>) -> PyResult<Vec<(String, String)>> {
        guarded(py, || Ok(self.done.tables(&self.document)))
    }

    /// Writes the run into a folder.
    fn save(&self, py: Python<'_>, folder: PathBuf, figures: bool, tables: bool) -> PyResult<()> {
        let requested = RequestedFiles { figures, tables };
        guarded(py, || self.write(&folder, requested))
    }
}
