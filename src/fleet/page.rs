//! The page of a fleet.

use super::collect::Collected;
use super::figures::{histograms, trend_figure};
use super::folder::FleetFolder;
use super::statistics::{Distribution, FEWEST, Statistics};
use super::summary::{cells, counts, headings, incomplete_axis, shown};
use super::trend::Trend;
use crate::number_format::significant;
use crate::report::chart::Detail;
use crate::report::page as shell;
use crate::report::text::{escape, prose};
use crate::report::{Figure, count, quantity};
use kmcfit_core::internals::assessment::VerdictLevel::{Check, Inadequate};

/// Most records in a table of the page.
const MOST_ROWS: usize = 50;
/// Most links to pages of records.
const MOST_LINKS: usize = 200;

/// The page of a fleet.
pub fn fleet_page(folder: &FleetFolder, collected: &Collected, trend: &Trend) -> String {
    shell::within_limit(|detail| page_of(folder, collected, trend, detail))
}

fn page_of(folder: &FleetFolder, collected: &Collected, trend: &Trend, detail: Detail) -> String {
    let statistics = &collected.statistics;
    let drawn = |figures: Vec<Figure>| shell::figures(&figures, detail);
    let shown = shown(statistics);
    let sections: Vec<shell::Section> = vec![
        (
            "outliers",
            "Records that stand out",
            outliers(folder, collected),
        ),
        (
            "distributions",
            "Distribution of each estimate",
            drawn(vec![histograms(&shown)].into_iter().flatten().collect()),
        ),
        (
            "trend",
            "Trend",
            drawn(
                shown
                    .iter()
                    .filter_map(|d| trend_figure(d, trend))
                    .collect(),
            ),
        ),
        ("verdicts", "Verdicts", verdicts(collected)),
        ("errors", "Errors", errors(collected)),
        ("reproduction", "Reproduction", reproduction(folder)),
    ];
    let above = format!(
        "<p class=\"soft\">{}</p>\n",
        escape(&folder.identity.model_name())
    ) + &state(statistics);
    let main = shown
        .first()
        .and_then(|d| trend_figure(d, trend))
        .map(|figure| Figure {
            name: "main".into(),
            ..figure
        });
    let first = shell::screen(&above, &answers(statistics, &shown, trend), main, detail);
    let title = format!("Fleet of {}", count(collected.list.records.len(), "record"));
    shell::sectioned(&title, &first, sections)
}

fn state(statistics: &Statistics) -> String {
    let [_, check, inadequate] = statistics.verdicts;
    let (colour, word) = match (statistics.missing, statistics.errors, inadequate, check) {
        (0, 0, 0, 0) => ("good", "All adequate"),
        (0, 0, 0, _) => ("warn", "To check"),
        (0, 0, ..) => ("bad", "Some inadequate"),
        (0, ..) => ("bad", "Some errors"),
        _ => ("bad", "Incomplete"),
    };
    shell::state_line(colour, word, &counts(statistics))
}

fn answers(statistics: &Statistics, shown: &[&Distribution], trend: &Trend) -> String {
    // The unit beside the name leaves room for the interval of the change.
    let in_columns = |[name, median, central, change, unit, outliers]: [String; 6]| {
        let name = match unit.as_str() {
            "" => name,
            unit => format!("{name}, {unit}"),
        };
        vec![name, median, central, change, outliers]
    };
    let rows: Vec<Vec<String>> = shown.iter().map(|d| in_columns(cells(d))).collect();
    let headings = in_columns(headings(trend));
    let headings: Vec<&str> = headings.iter().map(String::as_str).collect();
    let used = incomplete_axis(statistics, trend).map_or(String::new(), |s| shell::paragraph(&s));
    shell::table("Estimates over all records", &headings, &rows) + &used
}

fn outliers(folder: &FleetFolder, collected: &Collected) -> String {
    let statistics = &collected.statistics;
    let all = statistics.outliers.len();
    let unit = |name: &str| {
        let distribution = statistics.distributions.iter().find(|d| d.name == name);
        distribution.map_or(String::new(), |d| d.unit.clone())
    };
    let rows: Vec<Vec<String>> = statistics
        .outliers
        .iter()
        .take(MOST_ROWS)
        .map(|o| {
            vec![
                o.record.clone(),
                quantity(&o.estimate),
                significant(o.value, 5),
                unit(&o.estimate),
                significant(o.score, 3),
            ]
        })
        .collect();
    let meaning = match all {
        0 if statistics.records < FEWEST => {
            format!("Outliers are read from {FEWEST} records on.")
        }
        0 => "No estimate lies more than 3.5 standard deviations from its trend (modified z-score, Iglewicz and Hoaglin 1993).".to_owned(),
        _ => format!(
            "{} with an estimate more than 3.5 standard deviations from its trend, the line with the median slope of the pairs of at most 1000 records (modified z-score, Iglewicz and Hoaglin \
             1993){}. The table shows the estimate that lies farthest. `kmcfit fleet page {} RECORD` makes the page of a record.",
            count(all, "record"),
            if all > MOST_ROWS { format!("; the first {MOST_ROWS} are listed") } else { String::new() },
            shell::shell_quoted(&folder.path.display().to_string()),
        ),
    };
    let headings = [
        "Record",
        "Estimate",
        "Value",
        "Unit",
        "Standard deviations from the trend",
    ];
    shell::paragraph(&meaning)
        + &shell::table("Records that stand out", &headings, &rows)
        + &pages(folder, collected)
}

/// Links to the pages of records that have been made.
fn pages(folder: &FleetFolder, collected: &Collected) -> String {
    let records = collected.list.records.iter().enumerate();
    let made = records.filter_map(|(index, record)| {
        let name = page_folder(index);
        let page = folder.path.join(&name).join("report.html");
        page.is_file().then_some((name, &record.name))
    });
    let links: String = made
        .take(MOST_LINKS)
        .map(|(folder, record)| {
            format!(
                "<li><a href=\"{folder}/report.html\">{}</a></li>\n",
                escape(record)
            )
        })
        .collect();
    match links.is_empty() {
        true => String::new(),
        false => shell::paragraph("Pages of records:") + &format!("<ul>\n{links}</ul>\n"),
    }
}

/// Records that are not adequate, the inadequate first.
fn verdicts(collected: &Collected) -> String {
    let of = |level| {
        let verdicts = collected.verdicts.iter().enumerate();
        verdicts
            .filter(move |(_, verdict)| **verdict == Some(level))
            .map(|(i, _)| i)
    };
    let rows: Vec<Vec<String>> = [(Inadequate, "Inadequate"), (Check, "Check")]
        .into_iter()
        .flat_map(|(level, word)| of(level).map(move |i| (i, word)))
        .take(MOST_ROWS)
        .map(|(i, word)| vec![collected.list.records[i].name.clone(), word.to_owned()])
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    let text = format!(
        "{}. The column `warnings` of rows.parquet has all reasons of a record.",
        counts(&collected.statistics)
    );
    let reasons = collected.statistics.reasons.iter().take(MOST_ROWS);
    let reasons: Vec<Vec<String>> = reasons
        .map(|(reason, count)| vec![reason.clone(), count.to_string()])
        .collect();
    shell::paragraph(&text)
        + &shell::table("First reasons", &["First reason", "Records"], &reasons)
        + &shell::table(
            "Records that are not adequate",
            &["Record", "Verdict"],
            &rows,
        )
}

fn errors(collected: &Collected) -> String {
    let rows: Vec<Vec<String>> = collected
        .errors
        .iter()
        .take(MOST_ROWS)
        .map(|(record, error)| vec![record.clone(), error.clone()])
        .collect();
    shell::table("Records without estimates", &["Record", "Error"], &rows)
}

fn reproduction(folder: &FleetFolder) -> String {
    let identity = &folder.identity;
    let facts = [
        format!("kmcfit {}", identity.version),
        format!(
            "model {} (SHA-256 {})",
            identity.model.display(),
            identity.model_sha256
        ),
        format!(
            "{} (SHA-256 of the list {})",
            count(identity.records, "record"),
            identity.records_sha256
        ),
    ];
    let overrides = identity
        .overrides
        .iter()
        .map(|text| format!("--set {text}"));
    let warm = identity.warm_start.then(|| "--warm-start".to_owned());
    let facts: Vec<String> = facts.into_iter().chain(overrides).chain(warm).collect();
    let items: String = facts
        .iter()
        .map(|fact| format!("<li>{}</li>\n", prose(fact)))
        .collect();
    format!("<ul>\n{items}</ul>\n")
}

/// The folder of the page of the record with an index, within that of its fleet.
pub fn page_folder(index: usize) -> String {
    format!("page-{:06}", index + 1)
}
