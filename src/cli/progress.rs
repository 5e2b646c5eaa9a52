//! A progress line on a terminal, nothing elsewhere.

use crate::solvers::{Row, Stopping};
use indicatif::{HumanDuration, ProgressBar, ProgressStyle};
use std::cell::Cell;
use std::time::Duration;

/// The line: iteration, cost and gradient, rung of the start ladder, time left.
pub struct Progress {
    bar: ProgressBar,
    /// Wall-clock limit.
    limit: Option<Duration>,
    /// Searches that were begun, and the last iteration that was shown.
    rung: Cell<u32>,
    last: Cell<u64>,
}

impl Progress {
    /// A line for a run that stops by these rules; hidden where standard error is no terminal.
    pub fn new(stopping: &Stopping) -> Self {
        let bar = ProgressBar::new(stopping.iterations);
        let template = "{prefix}{bar:24} {pos}/{len}  {msg}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        Self {
            bar,
            limit: stopping.limit,
            rung: Cell::new(0),
            last: Cell::new(u64::MAX),
        }
    }

    /// Puts the name of the run before the line.
    pub fn named(self, name: &str) -> Self {
        self.bar.set_prefix(format!("{name}  "));
        self
    }

    /// Shows an iteration.
    pub fn show(&self, row: &Row) {
        // Every search counts its iterations from 1.
        if row.iteration <= self.last.replace(row.iteration) {
            self.rung.set(self.rung.get() + 1);
            self.bar.reset_eta();
        }
        self.bar.set_position(row.iteration);
        let rung = match self.rung.get() {
            0 | 1 => String::new(),
            rung => format!("  search {rung}"),
        };
        self.bar.set_message(format!(
            "J/J0 {:.3e}  G²/G0² {:.3e}{rung}  {} left at most",
            row.cost_ratio,
            row.gradient_norm_squared_ratio,
            HumanDuration(self.left())
        ));
    }

    /// What the iterations or the wall clock leave, whichever ends first.
    fn left(&self) -> Duration {
        let by_iterations = self.bar.eta();
        let by_clock = self.limit.map(|l| l.saturating_sub(self.bar.elapsed()));
        by_clock.map_or(by_iterations, |left| left.min(by_iterations))
    }

    /// Takes the line away.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}
