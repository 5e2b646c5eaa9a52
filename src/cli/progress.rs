//! Progress line of a fit, on a terminal only.

use indicatif::{HumanDuration, ProgressBar, ProgressStyle};
use kmcfit_core::internals::solvers::{IterationEvent, Stopping};
use std::cell::Cell;
use std::time::Duration;

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
        let template = "{prefix}{bar:24} {pos}/{len}  {msg}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        Self {
            bar,
            limit: stopping.limit,
            searches: Cell::new(0),
            last: Cell::new(u64::MAX),
        }
    }

    /// Puts the name of the run before the line.
    pub fn named(self, name: &str) -> Self {
        self.bar.set_prefix(format!("{name}  "));
        self
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
