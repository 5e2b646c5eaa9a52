//! Comparison of several runs: a table with a row for each, and a page of overlaid figures.
//!
//! Every run is read from its folder and keeps its own grid. [`Measures`] are the compared quantities of one run; the terminal,
//! `--json` and `compare.html` show the same ones.

mod figures;
mod likelihood;
mod measures;

pub use likelihood::Likelihood;
pub use measures::Measures;

use super::page as shell;
use super::render;
use super::run_reader::Run;
use super::text::{aligned, clean};
use crate::error::InputError;
use crate::results::read_lock;
use kmcfit_core::number_format::significant;
use measures::HEADINGS;
use serde::Serialize;
use std::fmt::Write;
use std::io;
use std::path::Path;

/// Differences of BIC beyond which evidence is very strong, strong and positive (Kass and Raftery 1995).
const VERY_STRONG: f64 = 10.0;
const STRONG: f64 = 6.0;
const POSITIVE: f64 = 2.0;

/// Version of the document's format.
const FORMAT: u32 = 2;

/// A finished run with its name in the comparison, which is unique.
#[derive(Debug, Clone)]
pub struct ComparedRun {
    /// Name.
    pub name: String,
    /// Document, estimated coefficients and true system.
    pub finished: Run,
    /// Digests of the files of its records, windows and bands, channels with their numbers of samples.
    records: Vec<String>,
    /// The channels of its validation records.
    validation: Vec<figures::Channel>,
}

impl ComparedRun {
    /// Reads the folder of a finished run.
    ///
    /// # Errors
    /// If there is no complete run in the folder.
    pub fn read(name: &str, folder: &Path) -> Result<Self, InputError> {
        // All that is read belongs to one run.
        let _lock = read_lock(folder);
        let finished = Run::open(folder)?;
        let model = finished.own_model()?;
        let names = model.record_names();
        let files = finished.document.sources.iter();
        let files = files.filter(|file| names.contains(&file.name));
        let used = model.spec.experiments.iter();
        let used = used.map(|e| format!("{:?} {:?}", e.window, e.band));
        let channels = finished.document.channels();
        let channels = channels.map(|c| format!("{} {}", c.kind, c.samples));
        let files = files.map(|file| file.sha256.clone());
        Ok(Self {
            name: name.into(),
            records: files.chain(used).chain(channels).collect(),
            validation: figures::channels(&finished),
            finished,
        })
    }

    /// True if another run has the same records.
    fn has_records_of(&self, other: &Self) -> bool {
        self.records == other.records
    }
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
    /// The runs without a result.
    pub left_out: &'a [LeftOut],
}

/// Several runs side by side.
#[derive(Debug, Clone)]
pub struct Comparison {
    runs: Vec<ComparedRun>,
    measures: Vec<Measures>,
    left_out: Vec<LeftOut>,
}

impl Comparison {
    /// The comparison of these runs.
    pub fn new(runs: Vec<ComparedRun>, left_out: Vec<LeftOut>) -> Self {
        let mut measures: Vec<Measures> = runs.iter().map(Measures::of).collect();
        let is_same =
            (runs.first()).is_some_and(|first| runs.iter().all(|run| run.has_records_of(first)));
        if is_same {
            let bic = |m: &Measures| m.likelihood.map(|l| l.bic);
            let best = measures.iter().filter_map(bic).reduce(f64::min);
            for m in &mut measures {
                m.bic_difference = bic(m).zip(best).map(|(bic, best)| bic - best);
            }
        }
        Self {
            measures,
            runs,
            left_out,
        }
    }

    /// The measures of each run.
    pub fn measures(&self) -> &[Measures] {
        &self.measures
    }

    /// The runs.
    pub fn runs(&self) -> &[ComparedRun] {
        &self.runs
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
            left_out: &self.left_out,
        }
    }

    /// A word and a sentence on the best model, and true if the data favour one: that with the smallest BIC.
    fn conclusion(&self) -> (String, String, bool) {
        let first = self.runs.first();
        let other = first.and_then(|a| self.runs.iter().find(|b| !b.has_records_of(a)));
        if let (Some(first), Some(other)) = (first, other) {
            let sentence = format!(
                "The runs use different records ({}, {}): likelihoods and fits are not comparable.",
                first.name, other.name
            );
            return ("Not ranked".into(), sentence, false);
        }
        let mut known: Vec<(&str, f64)> = (self.measures.iter())
            .filter_map(|m| Some((m.name.as_str(), m.bic_difference?)))
            .collect();
        known.sort_by(|a, b| a.1.total_cmp(&b.1));
        let [(best, _), (second, difference), ..] = known.as_slice() else {
            let sentence = "Fewer than two runs have a likelihood of the same samples.";
            return ("Not ranked".into(), sentence.into(), false);
        };
        let size = significant(*difference, 2);
        let strength = match *difference {
            d if d >= VERY_STRONG => "decisively",
            d if d >= STRONG => "strongly",
            d if d >= POSITIVE => "weakly",
            _ => {
                let sentence = format!(
                    "The data do not distinguish `{best}` and `{second}` (difference of BIC {size})."
                );
                return ("No clear best".into(), sentence, false);
            }
        };
        let sentence = format!(
            "The data favour `{best}` over `{second}` {strength} (difference of BIC {size})."
        );
        (format!("Best: {best}"), sentence, true)
    }

    /// The table: a row for each run; columns without a value are omitted.
    fn table(&self) -> (Vec<&'static str>, Vec<Vec<String>>) {
        let all: Vec<_> = self.measures.iter().map(Measures::row).collect();
        let is_known = |j: &usize| all.iter().any(|row| row[*j] != "–");
        let kept: Vec<usize> = (0..HEADINGS.len()).filter(is_known).collect();
        let row = |row: &[String; HEADINGS.len()]| kept.iter().map(|j| row[*j].clone()).collect();
        let headings = kept.iter().map(|j| HEADINGS[*j]).collect();
        (headings, all.iter().map(row).collect())
    }

    fn failures(&self) -> Vec<String> {
        let runs = self.left_out.iter();
        runs.map(|run| format!("{}: no result: {}", run.name, run.reason))
            .collect()
    }

    /// The comparison as text: the table, the best model, and the runs without a result.
    pub fn text(&self) -> String {
        let (headings, rows) = self.table();
        let mut lines = vec![headings.iter().map(ToString::to_string).collect()];
        // One line without control characters for each run.
        let plain = |text: &String| clean(text).replace(['\n', '\t'], " ");
        lines.extend(
            rows.iter()
                .map(|row| row.iter().map(plain).collect::<Vec<_>>()),
        );
        let mut text = aligned(&lines);
        let (_, sentence, _) = self.conclusion();
        let _ = writeln!(text, "\n{}", plain(&sentence));
        for failure in self.failures() {
            let _ = writeln!(text, "{}", plain(&failure));
        }
        text
    }

    /// The page: one HTML file without external resources.
    pub fn to_html(&self) -> String {
        let (word, sentence, is_favoured) = self.conclusion();
        let colour = if is_favoured { "good" } else { "warn" };
        let (headings, rows) = self.table();
        let above = shell::state_line(colour, &word, &sentence)
            + &shell::table("Models", &headings, &rows)
            + &shell::list(&self.failures());
        let [functions, validation] = figures::all(&self.runs)
            .map(|figure| shell::figures(&figure.into_iter().collect::<Vec<_>>()));
        let sections: Vec<shell::Section> = vec![
            ("functions", "Coefficients and ratios", functions),
            (
                "validation",
                "Predictions of validation records",
                validation,
            ),
        ];
        let title = format!(
            "Comparison of {} runs",
            self.runs.len() + self.left_out.len()
        );
        shell::sectioned(&title, &shell::screen(&above, "", None), sections)
    }

    /// Writes `figures/*.svg` and `compare.html`.
    ///
    /// # Errors
    /// An error of the file system.
    pub fn write(&self, write: &dyn Fn(&str, &[u8]) -> io::Result<()>) -> io::Result<()> {
        for figure in figures::all(&self.runs).iter().flatten() {
            let name = format!("figures/{}.svg", figure.name);
            write(&name, render(figure).as_bytes())?;
        }
        write("compare.html", self.to_html().as_bytes())
    }
}
