//! Table, page and summary of a fleet.

use super::folder::FleetFolder;
use super::records::RecordList;
use super::statistics::{Distribution, FEWEST, OUTLYING};
use super::trend::Trend;
use crate::error::InputError;
use crate::report::page as shell;
use crate::report::text::aligned;
use crate::report::{Axis, Colour, Figure, Mark, Panel, Style, quantity};
use kmcfit_core::number_format::{count, significant};

/// Most records in the terminal.
const MOST_LISTED: usize = 5;

/// The rows of a fleet in the order of its records.
struct Collected<'a> {
    folder: &'a FleetFolder,
    list: &'a RecordList,
    trend: &'a Trend,
    distributions: Vec<Distribution>,
    /// Records with the verdicts Adequate, Check and Inadequate.
    verdicts: [usize; 3],
    /// Record and reason.
    errors: Vec<[String; 2]>,
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
        let (mut verdicts, mut errors) = ([0; 3], Vec::new());
        let mut columns: Vec<(&str, &str, Vec<f64>)> = Vec::new();
        for (i, record) in list.records.iter().enumerate() {
            let Some(row) = folder.row(&record.name) else {
                continue;
            };
            errors.extend(row.error.clone().map(|error| [record.name.clone(), error]));
            if let Some(level) = row.verdict {
                verdicts[level as usize] += 1;
            }
            for (name, estimate) in &row.estimates.0 {
                let known = columns.iter().position(|(known, ..)| known == name);
                let column = known.unwrap_or_else(|| {
                    let none = vec![f64::NAN; list.records.len()];
                    columns.push((name, &estimate.unit, none));
                    columns.len() - 1
                });
                columns[column].2[i] = estimate.value;
            }
        }
        let distributions = columns
            .into_iter()
            .filter_map(|(name, unit, values)| Distribution::of(name, unit, values, &trend.values));
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

    fn counts(&self) -> String {
        let [adequate, check, inadequate] = self.verdicts;
        format!(
            "{}, {adequate} Adequate, {check} Check, {inadequate} Inadequate, {}",
            count(self.list.records.len(), "record"),
            count(self.errors.len(), "error")
        )
    }

    /// Headings and rows of the table of the estimates that differ between records.
    fn estimates(&self) -> (Vec<String>, Vec<Vec<String>>) {
        let change = format!("change per {}", self.trend.name);
        let headings = ["estimate", "median", &change, "unit", "outliers"];
        let row = |d: &Distribution| {
            vec![
                quantity(&d.name),
                significant(d.median, 5),
                d.slope
                    .map_or("—".to_owned(), |slope| significant(slope, 3)),
                d.unit.clone(),
                d.outliers().count().to_string(),
            ]
        };
        let shown = self.distributions.iter().filter(|d| !d.is_constant());
        (headings.map(str::to_owned).into(), shown.map(row).collect())
    }

    /// Each record and estimate that stands out, the farthest first.
    fn outliers(&self) -> Vec<[String; 2]> {
        let each = self.distributions.iter();
        let mut found: Vec<(usize, &Distribution)> = each
            .flat_map(|d| d.outliers().map(move |index| (index, d)))
            .collect();
        found.sort_by(|(i, a), (j, b)| b.scores[*j].abs().total_cmp(&a.scores[*i].abs()));
        let in_words = |(index, d): (usize, &Distribution)| {
            let [value, score] = [(d.values[index], 5), (d.scores[index], 3)]
                .map(|(x, digits)| significant(x, digits));
            let what = format!("{} {value} {}", quantity(&d.name), d.unit);
            let text = format!(
                "{}, {score} standard deviations from the trend",
                what.trim()
            );
            [self.list.records[index].name.clone(), text]
        };
        found.into_iter().map(in_words).collect()
    }

    /// The summary for the terminal.
    fn summary(&self) -> String {
        let mut text = format!("{}\n\n", self.counts());
        let (headings, rows) = self.estimates();
        if !rows.is_empty() {
            let rows: Vec<Vec<String>> = std::iter::once(headings).chain(rows).collect();
            text += &(aligned(&rows) + "\n");
        }
        for (word, found) in [("outlier", &self.outliers()), ("error  ", &self.errors)] {
            for [record, what] in found.iter().take(MOST_LISTED) {
                let first = what.lines().next().unwrap_or_default();
                text += &format!("{word} {record}: {first}\n");
            }
            let more = found.len().saturating_sub(MOST_LISTED);
            if more > 0 {
                text += &format!("{word} and {more} more: fleet.html\n");
            }
        }
        text + &format!("results in {}\n", self.folder.path.display())
    }

    /// `fleet.html`: estimates and records that stand out, then the trend of each estimate and the errors.
    fn page(&self) -> String {
        let varying = self.distributions.iter().filter(|d| !d.is_constant());
        let figures: Vec<Figure> = varying.map(|d| trend_figure(d, self.trend)).collect();
        let (headings, rows) = self.estimates();
        let headings: Vec<&str> = headings.iter().map(String::as_str).collect();
        let meaning = format!(
            "An estimate stands out more than {OUTLYING} standard deviations from its trend, the line with the median slope of the pairs of \
             records (modified z-score, Iglewicz and Hoaglin 1993), from {FEWEST} records on. `kmcfit fit` with \
             `--set experiments.0.data=RECORD` makes the page of a record."
        );
        let marked = self.errors.iter().cloned().chain(self.outliers());
        let marked: Vec<Vec<String>> = marked.map(Vec::from).collect();
        let table = shell::table(
            "Records",
            &["FleetRecord", "Error or estimate that stands out"],
            &marked,
        );
        let sections: Vec<shell::Section> = vec![
            (
                "records",
                "Records to look at",
                shell::paragraph(&meaning) + &table,
            ),
            ("trend", "Trend", shell::figures(&figures)),
        ];
        let above = shell::paragraph(&self.counts());
        let answers = shell::table("Estimates over all records", &headings, &rows);
        let title = format!("Fleet of {}", count(self.list.records.len(), "record"));
        shell::sectioned(&title, &shell::screen(&above, &answers, None), sections)
    }
}

/// An estimate along the axis: each record, and the line with the median slope.
fn trend_figure(distribution: &Distribution, trend: &Trend) -> Figure {
    let Distribution {
        name, values, line, ..
    } = distribution;
    let mut positions: Vec<usize> = (0..values.len())
        .filter(|i| trend.values[*i].is_finite() && values[*i].is_finite())
        .collect();
    positions.sort_by(|i, j| trend.values[*i].total_cmp(&trend.values[*j]));
    let of = |list: &[f64]| positions.iter().map(|i| list[*i]).collect::<Vec<f64>>();
    let (x, name) = (of(&trend.values), quantity(name));
    let dots = Style::new(Colour::nth(0)).width(4.0);
    let text = "Each record, and the line with the median slope of all pairs of records.";
    let title = format!("{name} over {}", trend.name);
    // Dots at the ends stand inside the frame.
    let (first, last) = (x.first(), x.last());
    let [low, high] = [first, last].map(|end| end.copied().unwrap_or_default());
    let room = 0.02 * (high - low);
    let panel = Panel::new(
        Axis::linear(trend.name.clone(), "").limits(low - room, high + room),
        Axis::linear(name, distribution.unit.clone()),
    );
    Figure::new(format!("trend-{}", distribution.name), title, text).panel(
        panel
            .mark(Mark::points("records", &x, &of(values), dots))
            .mark(Mark::line("trend", &x, &of(line), Style::nth(2))),
    )
}
