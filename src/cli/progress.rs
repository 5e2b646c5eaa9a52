//! One line of progress on standard error, on a terminal only: the stage, and the iteration of a fit or the finished jobs of other work.

use crate::escape::harmless;
use indicatif::{ProgressBar, ProgressStyle};
use kmcfit_core::solvers::IterationEvent;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The line of the current stage, for the jobs of the numerics.
static SHOWN: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// The line of a stage; hidden if standard error is not a terminal. Dropping it removes the line.
pub struct Activity(ProgressBar);

impl Activity {
    /// A line for a stage, as `reading shaker.csv`.
    pub fn begin(stage: impl AsRef<str>) -> Self {
        let bar = line(stage.as_ref());
        if !bar.is_hidden() {
            bar.tick();
            *shown() = Some(bar.clone());
        }
        Self(bar)
    }

    /// Shows the next stage.
    pub fn stage(&self, stage: impl AsRef<str>) {
        self.0.set_prefix(harmless(stage.as_ref()).into_owned());
        self.0.set_message("");
    }
}

impl Drop for Activity {
    fn drop(&mut self) {
        shown().take();
        self.0.finish_and_clear();
    }
}

/// Shows the number of finished jobs of all in the line of the current [`Activity`].
pub fn show_jobs(done: usize, all: usize) {
    if let Some(bar) = shown().as_ref() {
        bar.set_message(format!("{done}/{all}"));
    }
}

/// The line of a fit: the iteration with cost and gradient relative to the start.
pub struct Progress(ProgressBar);

impl Progress {
    /// A line with the name of the run or stage.
    pub fn new(name: &str) -> Self {
        Self(line(name))
    }

    /// A stage before or after the search, with the name of the run.
    pub fn named_stage(&self, stage: &str) -> String {
        format!("{} {stage}", self.0.prefix()).trim().to_owned()
    }

    /// True on a terminal.
    pub fn is_visible(&self) -> bool {
        !self.0.is_hidden()
    }

    /// Shows an iteration.
    pub fn show(&self, moment: &IterationEvent) {
        let row = moment.row;
        self.0.set_message(format!(
            "iteration {}  J/J0 {:.3e}  G\u{b2}/G0\u{b2} {:.3e}",
            row.iteration, row.cost_ratio, row.gradient_norm_squared_ratio
        ));
        self.0.tick();
    }

    /// Removes the line.
    pub fn clear(&self) {
        self.0.finish_and_clear();
    }
}

fn line(stage: &str) -> ProgressBar {
    let style = ProgressStyle::with_template("{prefix}  {msg}");
    let bar = ProgressBar::new_spinner();
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
    bar.with_prefix(harmless(stage).into_owned())
}

fn shown() -> MutexGuard<'static, Option<ProgressBar>> {
    SHOWN.lock().unwrap_or_else(PoisonError::into_inner)
}
