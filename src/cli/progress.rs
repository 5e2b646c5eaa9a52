//! Progress lines on standard error, on a terminal only: of a fit by its iterations, of other work by its stage and finished jobs.

use crate::escape::harmless;
use crate::faults::{self, Operation};
use crate::reading_share;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use kmcfit_core::internals::solvers::{IterationEvent, Stopping};
use std::cell::Cell;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

/// Time after which a stage is shown.
const DELAY: Duration = Duration::from_secs(1);
/// Time between updates of the elapsed time.
const TICK: Duration = Duration::from_millis(500);

/// Line of a stage, of one that reads a table, and of one with jobs.
const STAGE: &str = "{msg}  {elapsed}";
const READING: &str = "{msg}  {bar:24} {percent} % of {total_bytes}  {elapsed}";
const JOBS: &str = "{msg}  {bar:24} {pos}/{len}  {elapsed}, about {eta} remaining";

/// Finished jobs and all jobs of the current list.
static DONE: [AtomicUsize; 2] = [const { AtomicUsize::new(0) }; 2];

/// The line that shows the jobs of the numerics.
static SHOWN: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Progress of work without iterations: its stage, the finished jobs of all, and the elapsed and remaining time. Appears after a second;
/// hidden if standard error is not a terminal. Dropping it removes the line.
pub struct Activity {
    bar: ProgressBar,
    /// Ends the thread that updates the line.
    end: Option<Sender<()>>,
    updates: Option<JoinHandle<()>>,
}

impl Activity {
    /// A line for a stage, as `reading shaker.csv`.
    #[expect(
        clippy::disallowed_methods,
        reason = "the thread outlives the call, and a refusal leaves out the line"
    )]
    pub fn begin(stage: impl AsRef<str>) -> Self {
        let target = ProgressDrawTarget::stderr();
        let is_visible = !target.is_hidden();
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        bar.set_style(style(STAGE));
        let mut activity = Self {
            end: None,
            updates: None,
            bar,
        };
        activity.stage(stage);
        if is_visible {
            *SHOWN.lock().unwrap_or_else(PoisonError::into_inner) = Some(activity.bar.clone());
            let (end, ended) = channel();
            let bar = activity.bar.clone();
            // Without a thread there is no line.
            let updates = faults::check(Operation::Spawn)
                .and_then(|()| Builder::new().spawn(move || update(&bar, target, &ended)));
            activity.end = Some(end);
            activity.updates = updates.ok();
        }
        activity
    }

    /// Shows the next stage.
    pub fn stage(&self, stage: impl AsRef<str>) {
        self.bar.set_style(style(STAGE));
        self.bar.set_message(harmless(stage.as_ref()).into_owned());
    }
}

/// Shows the line after a second and updates it until its end.
fn update(bar: &ProgressBar, target: ProgressDrawTarget, ended: &Receiver<()>) {
    let goes_on = |time| ended.recv_timeout(time) == Err(RecvTimeoutError::Timeout);
    if !goes_on(DELAY) {
        return;
    }
    bar.set_draw_target(target);
    let mut is_reading = false;
    let mut show = || {
        match (reading_share::get(), is_reading) {
            (Some([read, all]), _) => {
                bar.set_style(style(READING));
                bar.set_length(all);
                bar.set_position(read);
                is_reading = true;
            }
            (None, true) => {
                bar.set_style(style(STAGE));
                is_reading = false;
            }
            (None, false) => {}
        }
        bar.tick();
    };
    show();
    while goes_on(TICK) {
        show();
    }
}

impl Drop for Activity {
    fn drop(&mut self) {
        SHOWN.lock().unwrap_or_else(PoisonError::into_inner).take();
        drop(self.end.take());
        if let Some(updates) = self.updates.take() {
            // A panic of the display is no failure of the work.
            let _ = updates.join();
        }
        self.bar.finish_and_clear();
    }
}

/// Shows the number of finished jobs of all in the line of the current [`Activity`].
pub fn show_jobs(done: usize, all: usize) {
    // The largest number is that of the threads that report out of order.
    match DONE[1].swap(all, Ordering::Relaxed) == all && done > 1 {
        true => DONE[0].fetch_max(done, Ordering::Relaxed),
        false => DONE[0].swap(done, Ordering::Relaxed),
    };
    let shown = SHOWN.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(bar) = shown.as_ref() else {
        return;
    };
    let (done, all) = (done as u64, all as u64);
    // The first job of the next list.
    if done == 1 || bar.length() != Some(all) {
        bar.set_style(style(JOBS));
        bar.set_length(all);
        bar.set_position(0);
        bar.reset_eta();
    }
    // Threads report out of order.
    bar.set_position(done.max(bar.position()));
}

/// Forgets the jobs of earlier lists.
pub fn forget_jobs() {
    DONE.iter()
        .for_each(|count| count.store(0, Ordering::Relaxed));
}

/// Finished jobs and all jobs of the last list; `None` without one.
pub fn jobs() -> Option<[usize; 2]> {
    let counts = [0, 1].map(|i: usize| DONE[i].load(Ordering::Relaxed));
    (counts[1] > 0).then_some(counts)
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// Progress line: iteration, cost ratio, gradient ratio, constraint violation, start strategy, remaining time.
pub struct Progress {
    bar: ProgressBar,
    /// Wall-clock limit.
    limit: Option<Duration>,
    /// Number of searches started, and the last iteration shown.
    searches: Cell<u32>,
    last: Cell<u64>,
}

impl Progress {
    /// A line for these stopping tests; hidden if standard error is not a terminal.
    pub fn new(stopping: &Stopping) -> Self {
        let bar = ProgressBar::new(stopping.iterations);
        bar.set_style(style("{prefix}{bar:24} {pos}/{len}  {msg}"));
        Self {
            bar,
            limit: stopping.limit,
            searches: Cell::new(0),
            last: Cell::new(u64::MAX),
        }
    }

    /// Puts the name of the run before the line.
    pub fn named(self, name: &str) -> Self {
        self.bar
            .set_prefix(harmless(&format!("{name}  ")).into_owned());
        self
    }

    /// A stage before or after the search, with the name of the run.
    pub fn named_stage(&self, stage: &str) -> String {
        format!("{}{stage}", self.bar.prefix())
    }

    /// True on a terminal.
    pub fn is_visible(&self) -> bool {
        !self.bar.is_hidden()
    }

    /// Shows an iteration.
    pub fn show(&self, moment: &IterationEvent) {
        let row = moment.row;
        // Every search counts its iterations from 1.
        if row.iteration <= self.last.replace(row.iteration) {
            self.searches.set(self.searches.get() + 1);
            self.bar.reset_eta();
        }
        self.bar.set_position(row.iteration);
        let message = message(moment, self.searches.get());
        // The first iterations give no estimate of the remaining time.
        let remaining = self.remaining();
        self.bar
            .set_message(match remaining >= Duration::from_secs(1) {
                true => format!("{message}  at most {} remaining", HumanDuration(remaining)),
                false => message,
            });
    }

    /// Remaining time by the iteration limit or the time limit, whichever is shorter.
    fn remaining(&self) -> Duration {
        let by_iterations = self.bar.eta();
        let by_clock = self.limit.map(|l| l.saturating_sub(self.bar.elapsed()));
        by_clock.map_or(by_iterations, |left| left.min(by_iterations))
    }

    /// Removes the line.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

/// Text of an iteration of search `number`, with its start strategy from the second search on.
fn message(moment: &IterationEvent, number: u32) -> String {
    let IterationEvent {
        row,
        start,
        violation,
    } = *moment;
    let mut parts = vec![
        format!("J/J0 {:.3e}", row.cost_ratio),
        format!("G\u{b2}/G0\u{b2} {:.3e}", row.gradient_norm_squared_ratio),
    ];
    parts.extend(violation.map(|violation| format!("violation {violation:.0e}")));
    if number > 1 {
        let from = start.map_or(String::new(), |start| format!(": {}", start.name()));
        parts.push(format!("search {number}{from}"));
    }
    parts.join("  ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use kmcfit_core::internals::solvers::{IterationRecord, StartStrategy};

    #[test]
    fn the_progress_line_has_all_available_quantities() {
        let row = IterationRecord {
            iteration: 3,
            cost: 2.0,
            cost_ratio: 0.25,
            gradient_norm_squared_ratio: 1e-3,
            step: 1.0,
            relative_change: 0.1,
        };
        let mut moment = IterationEvent {
            row: &row,
            start: Some(StartStrategy::EquationError),
            violation: None,
        };
        let line = "J/J0 2.500e-1  G\u{b2}/G0\u{b2} 1.000e-3";
        assert_eq!(message(&moment, 1), line);
        moment.violation = Some(2.6e-9);
        let line = format!("{line}  violation 3e-9");
        assert_eq!(message(&moment, 1), line);
        assert_eq!(
            message(&moment, 2),
            format!("{line}  search 2: equation error")
        );
        moment.start = None;
        assert_eq!(message(&moment, 2), format!("{line}  search 2"));
    }
}
