//! Several runs side by side: one table, overlaid figures, one page.
//!
//! Every run is read from its folder, whether it was just fitted or long ago, so all are treated
//! alike and each keeps its own grid. [`Measures`] are the numbers of one run; terminal,
//! `compare.csv` and `compare.html` show the same ones.

mod conclusions;
mod figures;
mod measures;
mod page;
mod run;
mod table;
mod text;
mod verdict;

pub use measures::Measures;
pub use run::{ComparedRun, MatchedMotion};

use super::render;
use crate::results::{Claim, OutputFolder};
use serde::Serialize;
use std::io;

/// Largest relative error of `k/m` and `c/m` below which a device counts as close to the true one:
/// what a smooth fit of a record with a few per cent of noise can be asked for.
pub const CLOSE: f64 = 0.05;

/// Root-mean-square residual, as a share of the root-mean-square reading, up to which a motion
/// without a sigma counts as matched: the paper's optimum leaves 0.9 %.
pub const MATCHED: f64 = 0.01;

/// Sizes below this are what rounding leaves: one digit says all there is to say.
const ROUNDING: f64 = 1e-12;

/// Version of the document's format.
const FORMAT: u32 = 1;

/// Several runs side by side.
#[derive(Debug, Clone)]
pub struct Comparison {
    runs: Vec<ComparedRun>,
    measures: Vec<Measures>,
    left_out: Vec<LeftOut>,
    sequence: Option<String>,
}

/// A run that was asked for and left nothing to compare.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// What the comparison calls it.
    pub name: String,
    /// Why, in one sentence.
    pub reason: String,
}

/// The comparison as a document: what `--json` prints.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparisonDocument<'a> {
    /// Version of this format.
    pub format: u32,
    /// Version of kmcfit.
    pub version: &'static str,
    /// The runs, in the order in which they were asked for.
    pub runs: &'a [Measures],
    /// The runs that left nothing to compare.
    pub left_out: &'a [LeftOut],
}

impl Comparison {
    /// The comparison of these runs.
    pub fn new(runs: Vec<ComparedRun>, left_out: Vec<LeftOut>) -> Self {
        Self {
            measures: runs.iter().map(Measures::of).collect(),
            runs,
            left_out,
            sequence: None,
        }
    }

    /// The same as a sequence with a title: the order of the runs matters, and what each adds to those
    /// before it is told.
    #[must_use]
    pub fn told_as(mut self, title: impl Into<String>) -> Self {
        self.sequence = Some(title.into());
        self
    }

    /// What the runs come to, in words: what each was told more than those before it, and whether that
    /// led to the true device.
    pub fn conclusions(&self) -> Vec<String> {
        conclusions::conclusions(&self.measures)
    }

    /// The numbers of each run.
    pub fn measures(&self) -> &[Measures] {
        &self.measures
    }

    /// The runs that left nothing to compare.
    pub fn left_out(&self) -> &[LeftOut] {
        &self.left_out
    }

    /// The comparison as a document.
    pub fn document(&self) -> ComparisonDocument<'_> {
        ComparisonDocument {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION"),
            runs: &self.measures,
            left_out: &self.left_out,
        }
    }

    /// For a terminal: what each run means in one line, then the table with one row per quantity and
    /// one column per run.
    pub fn text(&self) -> String {
        text::text(self)
    }

    /// The table with one row per run and units in the header; empty fields are not known.
    pub fn to_csv(&self) -> String {
        let rows = table::csv_rows(&self.measures);
        let mut lines = vec![rows.iter().map(|r| field(&r.header)).collect::<Vec<_>>()];
        for i in 0..self.measures.len() {
            lines.push(rows.iter().map(|r| field(&r.cells[i].exact())).collect());
        }
        let lines = lines.iter().map(|line| line.join(",") + "\n");
        lines.collect()
    }

    /// The page: one file without scripts and without anything to load.
    pub fn to_html(&self) -> String {
        page::page(self)
    }

    /// The files that `command` writes with a comparison.
    pub fn claim(command: &'static str) -> Claim {
        Claim::new(command)
            .files(["compare.csv", "compare.html"])
            .family("figures", "svg", figures::NAMES)
    }

    /// Writes `figures/*.svg`, `compare.csv` and `compare.html`.
    ///
    /// # Errors
    /// What the file system says.
    pub fn write(&self, folder: &OutputFolder) -> io::Result<()> {
        let mut stage = folder.stage()?;
        for figure in figures::all(self) {
            stage.write(&format!("figures/{}.svg", figure.name), &render(&figure))?;
        }
        stage.write("compare.csv", &self.to_csv())?;
        stage.write("compare.html", &self.to_html())?;
        stage.commit()
    }
}

/// A field of a CSV file, quoted where it must be.
fn field(text: &str) -> String {
    match text.contains([',', '"', '\n', '\r', '#']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.into(),
    }
}
