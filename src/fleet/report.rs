//! Table, page and summary of a fleet.

use super::folder::FleetFolder;
use super::records::RecordList;
use super::statistics::{Distribution, FEWEST, LinearTrend, outliers};
use super::trend::Trend;
use crate::error::InputError;
use crate::number_format::significant;
use crate::report::page as shell;
use crate::report::text::{aligned, escape};
use crate::report::{Axis, Colour, Figure, Mark, Panel, Style, count, quantity};
use std::fmt::Write;

/// Most records in a table of the page, and in the terminal.
const MOST_ROWS: usize = 50;
const MOST_LISTED: usize = 5;
/// Most points of a trend; of more records every second, third, ... is drawn.
const MOST_POINTS: usize = 4000;

/// The rows of a fleet in the order of its records.
struct Collected<'a> {
    folder: &'a FleetFolder,
    list: &'a RecordList,
    trend: &'a Trend,
    distributions: Vec<Distribution>,
    /// Records with the verdicts Adequate, Check and Inadequate.
    verdicts: [usize; 3],
    errors: Vec<(&'a str, &'a str)>,
}

/// Writes table and page of a fleet all of whose records have their rows; returns the summary for the terminal.
///
/// # Errors
/// Errors of the file system.
pub fn finish(
    folder: &FleetFolder,
    list: &RecordList,
    trend: &Trend,
) -> Result<String, InputError> {
    let collected = Collected::new(folder, list, trend);
    folder.write(&collected.table(), &collected.page())?;
    Ok(collected.summary())
}

impl<'a> Collected<'a> {
    fn new(folder: &'a FleetFolder, list: &'a RecordList, trend: &'a Trend) -> Self {
        let count = list.records.len();
        let (mut verdicts, mut errors) = ([0; 3], Vec::new());
        let mut columns: Vec<(&str, &str, Vec<f64>)> = Vec::new();
        for (i, record) in list.records.iter().enumerate() {
            let Some(row) = folder.row(&record.name) else {
                continue;
            };
            if let Some(error) = &row.error {
                errors.push((record.name.as_str(), error.as_str()));
            }
            if let Some(level) = row.verdict {
                verdicts[level as usize] += 1;
            }
            for (name, estimate) in &row.estimates.0 {
                let known = columns.iter().position(|(known, ..)| known == name);
                let column = known.unwrap_or_else(|| {
                    columns.push((name, &estimate.unit, vec![f64::NAN; count]));
                    columns.len() - 1
                });
                columns[column].2[i] = estimate.value;
            }
        }
        let distributions = columns.into_iter().filter_map(|(name, unit, values)| {
            Distribution::of(name.to_owned(), unit.to_owned(), values, &trend.values)
        });
        Self {
            distributions: distributions.collect(),
            folder,
            list,
            trend,
            verdicts,
            errors,
        }
    }

    /// `rows.csv`: a line for each record with its columns, its estimates with their intervals, and its verdict.
    fn table(&self) -> String {
        let mut table = csv::Writer::from_writer(Vec::new());
        let mut names = vec!["record".to_owned()];
        names.extend(self.list.columns.iter().map(|name| format!("table_{name}")));
        for Distribution { name, .. } in &self.distributions {
            names.extend(["", "_low", "_high"].map(|end| format!("{name}{end}")));
        }
        names.extend(["verdict", "warnings", "seconds", "error"].map(str::to_owned));
        let rows = self.list.records.iter();
        let rows = rows.filter_map(|record| Some((record, self.folder.row(&record.name)?)));
        let lines = rows.map(|(record, row)| {
            let mut cells = vec![record.name.clone()];
            cells.extend(record.columns.iter().cloned());
            for Distribution { name, .. } in &self.distributions {
                let estimate = row.estimates.get(name);
                let limits = estimate.and_then(|e| e.ci95).map(|limits| limits.map(Some));
                let [low, high] = limits.unwrap_or_default();
                let numbers = [estimate.map(|e| e.value), low, high];
                cells.extend(numbers.map(|x| x.map_or_else(String::new, |x| x.to_string())));
            }
            let level = row.verdict.map(|level| format!("{level:?}").to_lowercase());
            cells.extend([
                level.unwrap_or_default(),
                row.warnings.join("; "),
                row.seconds.to_string(),
                row.error.clone().unwrap_or_default(),
            ]);
            cells
        });
        for line in std::iter::once(names).chain(lines) {
            // Writing to memory cannot fail, and all lines have one length.
            let _ = table.write_record(line);
        }
        String::from_utf8(table.into_inner().unwrap_or_default()).unwrap_or_default()
    }

    /// Estimates that differ between records.
    fn shown(&self) -> impl Iterator<Item = &Distribution> {
        self.distributions.iter().filter(|d| !d.is_constant())
    }

    fn counts(&self) -> String {
        let [adequate, check, inadequate] = self.verdicts;
        format!(
            "{}, {adequate} Adequate, {check} Check, {inadequate} Inadequate, {}",
            count(self.list.records.len(), "record"),
            count(self.errors.len(), "error")
        )
    }

    /// Headings and rows of the table of estimates.
    fn estimates(&self) -> (Vec<String>, Vec<Vec<String>>) {
        let change = format!("change per {} (95 % CI)", self.trend.step());
        let headings = [
            "estimate",
            "median",
            "95 % of records",
            &change,
            "unit",
            "outliers",
        ];
        let in_words = |trend: LinearTrend| {
            let [low, high] = trend.slope95.map(|limit| significant(limit, 3));
            format!("{} ({low} to {high})", significant(trend.slope, 3))
        };
        let row = |d: &Distribution| {
            let [low, high] = d.central95.map(|x| significant(x, 5));
            vec![
                quantity(&d.name),
                significant(d.median, 5),
                format!("{low} to {high}"),
                d.trend.map_or("—".to_owned(), in_words),
                d.unit.clone(),
                d.outliers.to_string(),
            ]
        };
        (
            headings.map(str::to_owned).into(),
            self.shown().map(row).collect(),
        )
    }

    /// Record, estimate, value and distance of each record that stands out.
    fn outliers(&self) -> Vec<[String; 4]> {
        let found = outliers(&self.distributions).into_iter();
        let found = found.map(|(index, d, score)| {
            let value = format!("{} {}", significant(d.values[index], 5), d.unit);
            let (name, value) = (
                self.list.records[index].name.clone(),
                value.trim_end().to_owned(),
            );
            [name, quantity(&d.name), value, significant(score, 3)]
        });
        found.collect()
    }

    /// The summary for the terminal.
    fn summary(&self) -> String {
        let mut text = format!("{}\n\n", self.counts());
        let (headings, rows) = self.estimates();
        if !rows.is_empty() {
            let rows: Vec<Vec<String>> = std::iter::once(headings).chain(rows).collect();
            text += &aligned(&rows);
            text.push('\n');
        }
        let outliers = self.outliers();
        for [record, estimate, value, score] in outliers.iter().take(MOST_LISTED) {
            let _ = writeln!(
                text,
                "outlier {record}: {estimate} {value}, {score} standard deviations from the trend"
            );
        }
        let further = |count: usize, what: &str| match count.saturating_sub(MOST_LISTED) {
            0 => String::new(),
            more => format!("{what} and {more} more: fleet.html\n"),
        };
        text += &further(outliers.len(), "outlier");
        for (record, error) in self.errors.iter().take(MOST_LISTED) {
            let _ = writeln!(
                text,
                "error   {record}: {}",
                error.lines().next().unwrap_or_default()
            );
        }
        text += &further(self.errors.len(), "error  ");
        let _ = writeln!(text, "results in {}", self.folder.path.display());
        text
    }

    /// `fleet.html`: estimates and records that stand out, then the trend of each estimate and the errors.
    fn page(&self) -> String {
        let shown = self.shown();
        let figures: Vec<Figure> = shown.filter_map(|d| trend_figure(d, self.trend)).collect();
        let (headings, rows) = self.estimates();
        let headings: Vec<&str> = headings.iter().map(String::as_str).collect();
        let errors = self.errors.iter();
        let errors = errors.map(|(record, error)| [record, *error].map(str::to_owned));
        let sections: Vec<shell::Section> = vec![
            ("outliers", "Records that stand out", self.outlier_section()),
            ("trend", "Trend", shell::figures(&figures)),
            (
                "errors",
                "Errors",
                rows_of("Records without estimates", &["Record", "Error"], errors),
            ),
        ];
        let [_, check, inadequate] = self.verdicts;
        let (colour, word) = match (self.errors.len(), inadequate, check) {
            (0, 0, 0) => ("good", "All adequate"),
            (0, 0, _) => ("warn", "To check"),
            (0, ..) => ("bad", "Some inadequate"),
            _ => ("bad", "Some errors"),
        };
        let name = self.folder.identity.model.display().to_string();
        let above = format!("<p class=\"soft\">{}</p>\n", escape(&name))
            + &shell::state_line(colour, word, &self.counts());
        let answers = shell::table("Estimates over all records", &headings, &rows);
        let main = figures.first().cloned().map(|figure| Figure {
            name: "main".into(),
            ..figure
        });
        let title = format!("Fleet of {}", count(self.list.records.len(), "record"));
        shell::sectioned(&title, &shell::screen(&above, &answers, main), sections)
    }

    fn outlier_section(&self) -> String {
        let outliers = self.outliers();
        let meaning = match outliers.len() {
            0 if self.list.records.len() < FEWEST => {
                format!("Outliers are read from {FEWEST} records on.")
            }
            all => format!(
                "{} with an estimate more than 3.5 standard deviations from its trend, the line with the median slope of the pairs of \
                 records (modified z-score, Iglewicz and Hoaglin 1993). `kmcfit fit` with `--set experiments.0.data=RECORD` makes the page of a record.",
                count(all, "record"),
            ),
        };
        let headings = [
            "Record",
            "Estimate",
            "Value",
            "Standard deviations from the trend",
        ];
        let table = rows_of("Records that stand out", &headings, outliers.into_iter());
        shell::paragraph(&meaning) + &table
    }
}

/// A table of the first rows.
fn rows_of<const N: usize>(
    name: &str,
    headings: &[&str],
    rows: impl Iterator<Item = [String; N]>,
) -> String {
    let rows: Vec<Vec<String>> = rows.take(MOST_ROWS).map(Vec::from).collect();
    shell::table(name, headings, &rows)
}

/// An estimate along the axis: each record, and the line with the median slope.
fn trend_figure(distribution: &Distribution, trend: &Trend) -> Option<Figure> {
    let pairs = trend.values.iter().zip(&distribution.values);
    let pairs: Vec<(f64, f64)> = pairs
        .map(|(x, y)| (*x, *y))
        .filter(|(x, y)| x.is_finite() && y.is_finite())
        .collect();
    let low = pairs.iter().map(|(x, _)| *x).reduce(f64::min)?;
    let high = pairs.iter().map(|(x, _)| *x).reduce(f64::max)?;
    (pairs.len() >= 3 && high > low).then_some(())?;
    let every = pairs.len().div_ceil(MOST_POINTS);
    let (x, y): (Vec<f64>, Vec<f64>) = pairs.iter().step_by(every).copied().unzip();
    let name = quantity(&distribution.name);
    // No dot is cut by the frame.
    let margin = 0.03 * (high - low);
    let axis =
        Axis::linear(trend.name.clone(), trend.unit.clone()).limits(low - margin, high + margin);
    let mut panel = Panel::new(axis, Axis::linear(name.clone(), distribution.unit.clone())).mark(
        Mark::points("records", &x, &y, Style::new(Colour::nth(0)).width(4.0)),
    );
    if let Some(line) = &distribution.trend {
        let ends = [low, high].map(|x| line.value + line.slope * (x - line.at));
        panel = panel.mark(Mark::line("trend", &[low, high], &ends, Style::nth(2)));
    }
    let text = "Each record, and the line with the median slope of all pairs of records.";
    Some(
        Figure::new(
            format!("trend-{}", distribution.name),
            format!("{name} over {}", trend.name),
            text,
        )
        .panel(panel),
    )
}
