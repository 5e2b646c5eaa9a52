//! Comparison of several runs: a table, overlaid figures, one page.
//!
//! Every run is read from its folder and keeps its own grid. [`Measures`] are the compared quantities of one run; the
//! terminal, `compare.csv` and `compare.html` show the same ones.

mod conclusions;
mod figures;
mod likelihood;
mod measures;
mod page;
mod run;
mod selection;
mod table;
mod text;
mod verdict;

pub use likelihood::{Likelihood, LikelihoodRatio};
pub use measures::Measures;
pub use run::{ComparedRun, MatchedResponse};

use super::render;
use crate::results::{Claim, OutputFolder};
use serde::Serialize;
use std::io;

/// Largest relative error of `k/m` and `c/m` of a system that counts as close to the true one: attainable for a smooth
/// fit of a record with a few per cent of noise.
pub const CLOSE: f64 = 0.05;

/// Largest rms residual relative to the rms sample of a response without sigma that counts as fitted; 0.9 % for the
/// optimum of the paper.
pub const MATCHED: f64 = 0.01;

/// Relative errors below this are rounding errors and are printed with one digit.
const ROUNDING: f64 = 1e-12;

/// Version of the document's format.
const FORMAT: u32 = 1;

/// Several runs side by side.
#[derive(Debug, Clone)]
pub struct Comparison {
    runs: Vec<ComparedRun>,
    measures: Vec<Measures>,
    likelihood_ratios: Vec<LikelihoodRatio>,
    left_out: Vec<LeftOut>,
    sequence: Option<String>,
}

/// A run without a result.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// Its name in the comparison.
    pub name: String,
    /// The reason, as a sentence.
    pub reason: String,
}

/// The comparison as a document: what `--json` prints.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparisonDocument<'a> {
    /// Version of this format.
    pub format: u32,
    /// Version of kmcfit.
    pub version: &'static str,
    /// The runs in the order of the arguments.
    pub runs: &'a [Measures],
    /// Likelihood-ratio tests of the runs that another one contains.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    pub likelihood_ratios: &'a [LikelihoodRatio],
    /// The runs without a result.
    pub left_out: &'a [LeftOut],
}

impl Comparison {
    /// The comparison of these runs.
    pub fn new(runs: Vec<ComparedRun>, left_out: Vec<LeftOut>) -> Self {
        let mut measures: Vec<Measures> = runs.iter().map(Measures::of).collect();
        let is_same =
            (runs.first()).is_some_and(|first| runs.iter().all(|run| run.has_records_of(first)));
        let mut likelihood_ratios = Vec::new();
        if is_same {
            let bic = |m: &Measures| m.likelihood.map(|l| l.bic);
            let best = measures.iter().filter_map(bic).reduce(f64::min);
            for m in &mut measures {
                m.bic_difference = bic(m).zip(best).map(|(bic, best)| bic - best);
            }
            let likelihoods: Vec<_> = measures.iter().map(|m| m.likelihood).collect();
            likelihood_ratios = likelihood::likelihood_ratios(&runs, &likelihoods);
        }
        Self {
            measures,
            runs,
            likelihood_ratios,
            left_out,
            sequence: None,
        }
    }

    /// The comparison as a sequence with a title, whose page lists the assumptions that each run adds.
    #[must_use]
    pub fn as_sequence(mut self, title: impl Into<String>) -> Self {
        self.sequence = Some(title.into());
        self
    }

    /// Conclusions: the assumptions that each run adds, its result, and the recovery of the true system.
    pub fn conclusions(&self) -> Vec<String> {
        conclusions::conclusions(&self.measures)
    }

    /// Warning where runs have different records.
    fn warning(&self) -> Option<String> {
        let first = self.runs.first()?;
        let other = self.runs.iter().find(|run| !run.has_records_of(first))?;
        Some(format!(
            "the runs use different records ({}, {}): misfit, fit and iterations are not comparable",
            first.name, other.name
        ))
    }

    /// The measures of each run.
    pub fn measures(&self) -> &[Measures] {
        &self.measures
    }

    /// The runs without a result.
    pub fn left_out(&self) -> &[LeftOut] {
        &self.left_out
    }

    /// The comparison as a document.
    pub fn document(&self) -> ComparisonDocument<'_> {
        ComparisonDocument {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION"),
            runs: &self.measures,
            likelihood_ratios: &self.likelihood_ratios,
            left_out: &self.left_out,
        }
    }

    /// The comparison as text: a line for each run, then the table.
    pub fn text(&self) -> String {
        text::text(self)
    }

    /// The table as CSV: one row for each run, units in the headers, unknown values empty.
    pub fn to_csv(&self) -> String {
        let rows = table::csv_rows(&self.measures);
        let mut lines = vec![rows.iter().map(|r| field(&r.header)).collect::<Vec<_>>()];
        for i in 0..self.measures.len() {
            lines.push(rows.iter().map(|r| field(&r.cells[i].exact())).collect());
        }
        let lines = lines.iter().map(|line| line.join(",") + "\n");
        lines.collect()
    }

    /// The page: one HTML file without external resources.
    pub fn to_html(&self) -> String {
        page::page(self)
    }

    /// Files that `command` writes for a comparison.
    pub fn claim(command: &'static str) -> Claim {
        Claim::new(command)
            .files(["compare.csv", "compare.html"])
            .family("figures", "svg", figures::NAMES)
    }

    /// Writes `figures/*.svg`, `compare.csv` and `compare.html`.
    ///
    /// # Errors
    /// An error of the file system.
    pub fn write(&self, folder: &OutputFolder) -> io::Result<()> {
        let stage = folder.stage()?;
        for figure in figures::all(self) {
            stage.write(&format!("figures/{}.svg", figure.name), render(&figure))?;
        }
        stage.write("compare.csv", self.to_csv())?;
        stage.write("compare.html", self.to_html())?;
        stage.commit()
    }
}

/// A CSV field, quoted if necessary.
fn field(text: &str) -> String {
    match text.contains([',', '"', '\n', '\r', '#']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.into(),
    }
}
