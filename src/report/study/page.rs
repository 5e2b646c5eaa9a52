//! The page of a study, `study.html`: first screen, then each finding beside its chart.

use super::figures;
use super::text::{Part, widest_range};
use super::{BandRecord, StudyDocument};
use crate::number_format::{resolved, significant};
use crate::report::chart::{Detail, Figure};
use crate::report::page as shell;
use crate::report::text::{escape, prose};

/// Predictions with a chart; those of the others are in `figures/study-predictions.svg`, so that the page stays below 2 MB.
const MOST_PREDICTIONS: usize = 2;

/// Leading parts whose first findings stand on the first screen.
const LEADING: usize = 4;

/// The page: one HTML file without external resources. `source` is the line on its data.
pub fn page(study: &StudyDocument, source: &str) -> String {
    shell::within_limit(|detail| page_of(study, source, detail))
}

fn page_of(study: &StudyDocument, source: &str, detail: Detail) -> String {
    let mut sections: Vec<shell::Section> = Part::ALL
        .iter()
        .map(|part| {
            let body = section(study, *part, detail);
            (part.anchor(), part.heading(), body)
        })
        .collect();
    let made = format!(
        "Made by kmcfit {}; seed {}, confidence {}; the study is {}.",
        study.version, study.seed, study.confidence, study.status
    );
    sections.push(("made", "Settings", shell::paragraph(&made)));
    let title = format!("Study of identifiability: {}", study.title);
    shell::sectioned(&title, &first_screen(study, source, detail), sections)
}

fn first_screen(study: &StudyDocument, source: &str, detail: Detail) -> String {
    let fit = study.fit.as_ref();
    let state = fit.map_or(String::new(), |fit| match &fit.verdict {
        Some(verdict) => shell::verdict_line(verdict),
        None => shell::state_line("warn", fit.status.name(), &fit.reason),
    });
    let state = match study.status.as_str() {
        super::COMPLETE => state,
        status => state + &shell::paragraph(&format!("The study is {status}.")),
    };
    let text = quantities(study) + &leading(study);
    shell::screen(
        &(source.to_owned() + &state),
        &text,
        figures::main(study),
        detail,
    )
}

/// Undamped natural frequency and damping ratio with their interval, or range where they vary.
fn ratios(study: &StudyDocument) -> Vec<Vec<String>> {
    let names = [
        ("natural frequency", "undamped natural frequency"),
        ("damping ratio", "damping ratio"),
    ];
    let bands = study
        .bands
        .iter()
        .filter(|bands| !bands.classification.is_empty());
    let all: Vec<&BandRecord> = bands.flat_map(|bands| &bands.bands).collect();
    let row = |(name, shown): (&str, &str)| {
        let band = all.iter().find(|band| band.name == name)?;
        let finite = || band.values.iter().copied().flatten();
        let least = finite().reduce(f64::min)?;
        let most = finite().reduce(f64::max)?;
        let ends = [&band.low, &band.high].map(|end| end.first().copied().flatten());
        let text = match ends {
            [Some(low), Some(high)] if least == most && high > low => {
                let [value, low, high] = resolved([least, low, high], 0.5 * (high - low));
                let level = significant(100.0 * study.confidence, 3);
                format!("{value} {} ({level} % CI {low} to {high})", band.unit)
            }
            _ if least == most => format!("{} {}", significant(least, 4), band.unit),
            _ => {
                let [low, high] = [least, most].map(|x| significant(x, 4));
                format!("{low} to {high} {} over the record", band.unit)
            }
        };
        Some(vec![
            shown.to_owned(),
            text.replace("  ", " "),
            String::new(),
        ])
    };
    names.into_iter().filter_map(row).collect()
}

/// Table of the functions and ratios: extremes and classification of each.
fn quantities(study: &StudyDocument) -> String {
    let known = study.bands.iter().flat_map(|bands| &bands.classification);
    let rows = known.map(|c| {
        let extremes = study.extremes.iter().find(|e| e.name == c.name);
        let text = c.text.strip_prefix(&format!("{}: ", c.name));
        vec![
            c.name.clone(),
            text.unwrap_or(&c.text).to_owned(),
            extremes.map_or(String::new(), widest_range),
        ]
    });
    let headings = [
        "quantity",
        "determined by the records",
        "data-consistent extremes",
    ];
    let rows: Vec<Vec<String>> = ratios(study).into_iter().chain(rows).collect();
    let table = shell::table("Quantities", &headings, &rows);
    format!("<div class=\"words\">\n{table}</div>\n")
}

/// The first finding of each leading part, with a link to its section.
fn leading(study: &StudyDocument) -> String {
    let items = Part::ALL[..LEADING].iter().filter_map(|part| {
        let sentences = part.sentences(study);
        let first = prose(sentences.first()?);
        let (anchor, heading) = (part.anchor(), escape(part.heading()));
        Some(format!(
            "<li><a href=\"#{anchor}\">{heading}</a>: {first}</li>\n"
        ))
    });
    let items: String = items.collect();
    match items.is_empty() {
        true => items,
        false => format!("<ul>\n{items}</ul>\n"),
    }
}

/// Findings of a part, each beside its charts.
fn section(study: &StudyDocument, part: Part, detail: Detail) -> String {
    let sentences = part.sentences(study);
    let charts: Vec<Option<Figure>> = match part {
        Part::Bands => return bands(study, &sentences, detail),
        Part::Profiles => figures::profiles_alone(study),
        Part::Extremes => figures::extremes_alone(study),
        Part::Predictions => {
            let mut charts = figures::predictions_alone(study);
            charts.truncate(MOST_PREDICTIONS);
            charts
        }
        Part::EquivalentSystems => {
            return finding(&sentences, figures::equivalent_systems(study), detail);
        }
        Part::Multistart => return finding(&sentences, figures::waterfall(study), detail),
        Part::Sensitivity => {
            let spectrum = figures::spectrum(study).into_iter();
            return finding(
                &sentences,
                spectrum.chain(figures::directions(study)),
                detail,
            );
        }
        _ => Vec::new(),
    };
    let own = sentences.iter().zip(charts);
    let own = own.map(|(sentence, chart)| finding(std::slice::from_ref(sentence), chart, detail));
    let own: Vec<String> = own.collect();
    own.concat() + &shell::list(&sentences[own.len()..])
}

/// The bands of functions and ratios that vary, each beside its classification; before them the other sentences.
fn bands(study: &StudyDocument, sentences: &[String], detail: Detail) -> String {
    let mut others = sentences.to_vec();
    let known = study.bands.iter().flat_map(|bands| &bands.classification);
    let known: Vec<_> = known.collect();
    let charts = figures::bands_alone(study).into_iter();
    let charts = charts.map(|(name, chart)| {
        let own = known.iter().find(|c| c.name == name);
        let own: Vec<String> = own.map(|c| c.text.clone()).into_iter().collect();
        // Natural frequency and damping ratio have no finding of their own beside those of k/m and c/m.
        if own.is_empty() && !known.is_empty() {
            return String::new();
        }
        others.retain(|sentence| !own.contains(sentence));
        finding(&own, [chart], detail)
    });
    let charts: String = charts.collect();
    shell::list(&others) + &charts
}

/// Sentences beside their charts; sentences alone without any, and charts alone.
fn finding(
    sentences: &[String],
    charts: impl IntoIterator<Item = Figure>,
    detail: Detail,
) -> String {
    let charts: Vec<Figure> = charts.into_iter().collect();
    let (text, charts) = (shell::list(sentences), shell::figures(&charts, detail));
    match charts.is_empty() {
        true => text,
        false => {
            format!("<div class=\"finding\">\n<div>\n{text}</div>\n<div>\n{charts}</div>\n</div>\n")
        }
    }
}
