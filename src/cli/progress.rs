//! A progress line on a terminal, nothing elsewhere.

use crate::solvers::Row;
use indicatif::{ProgressBar, ProgressStyle};

/// The line: iteration, cost and gradient, time left.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// A line for a run of at most `iterations`; hidden where standard error is no terminal.
    pub fn new(iterations: u64) -> Self {
        let bar = ProgressBar::new(iterations);
        let template = "{prefix}{bar:24} {pos}/{len}  {msg}  {elapsed} ({eta} left at most)";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        Self { bar }
    }

    /// Puts the name of the run before the line.
    pub fn named(self, name: &str) -> Self {
        self.bar.set_prefix(format!("{name}  "));
        self
    }

    /// Shows an iteration.
    pub fn show(&self, row: &Row) {
        self.bar.set_position(row.iteration);
        self.bar.set_message(format!(
            "J/J0 {:.3e}  G²/G0² {:.3e}",
            row.cost_ratio, row.gradient_norm_squared_ratio
        ));
    }

    /// Takes the line away.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}
