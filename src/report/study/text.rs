//! Text of a study for the terminal and for its page.

use super::figures;
use super::{
    BandsRecord, ExtremesRecord, PredictionRecord, SensitivityRecord, StudiedFit, StudyDocument,
};
use crate::report::chart::Figure;
use kmcfit_core::finding::Finding;
use kmcfit_core::number_format::{resolved, significant};
use kmcfit_core::study::{BOUNDED, ExtremeStatus};

/// Most extremes that are listed because their search did not converge.
const MOST_LISTED: usize = 6;

/// Width of a range below which its ends are equal to machine precision, relative to the larger one.
const NEGLIGIBLE: f64 = 1e-12;

/// A part of a study: one analysis.
pub struct Part {
    /// Anchor of its section on the page.
    pub anchor: &'static str,
    pub heading: &'static str,
    /// Its sentences; none for an analysis that was not run.
    pub sentences: fn(&StudyDocument) -> Vec<String>,
    pub figure: fn(&StudyDocument) -> Option<Figure>,
}

/// All parts in order of what the user can do about them: mend the study or the fit, change the model, measure again; then what the
/// records determine, and the basis of these findings.
pub const PARTS: [Part; 11] = [
    Part {
        anchor: "failures",
        heading: "Failed analyses",
        sentences: |study| lines(&study.failures, |f| format!("{}: {}", f.analysis, f.reason)),
        figure: |_| None,
    },
    Part {
        anchor: "starts",
        heading: "Fits from random starting points",
        sentences: |study| {
            let starts = study.multistart.iter();
            starts.flat_map(|m| Finding::texts(&m.findings)).collect()
        },
        figure: figures::waterfall,
    },
    Part {
        anchor: "candidates",
        heading: "Candidate experiments",
        sentences: |study| lines(&study.candidates, |c| c.text.clone()),
        figure: |_| None,
    },
    Part {
        anchor: "bands",
        heading: "Identifiability of functions and ratios, within the model",
        sentences: |study| study.bands.iter().flat_map(bands).collect(),
        figure: figures::bands,
    },
    Part {
        anchor: "profiles",
        heading: "Likelihood profiles",
        sentences: |study| lines(&study.profiles, |p| p.text.clone()),
        figure: figures::profiles,
    },
    Part {
        anchor: "extremes",
        heading: "Data-consistent extremes, within the model",
        sentences: extremes,
        figure: figures::extremes,
    },
    Part {
        anchor: "predictions",
        heading: "Predicted responses",
        sentences: |study| lines(&study.predictions, prediction),
        figure: figures::predictions,
    },
    Part {
        anchor: "equivalent-systems",
        heading: "Equivalent systems, in a wider model",
        sentences: equivalent_systems,
        figure: figures::equivalent_systems,
    },
    Part {
        anchor: "sensitivity",
        heading: "Sensitivity",
        sentences: |study| study.sensitivity.iter().flat_map(sensitivity).collect(),
        figure: |_| None,
    },
    Part {
        anchor: "structural-rank",
        heading: "Structural rank (before the fit)",
        sentences: |study| Finding::texts(&study.structural_rank),
        figure: |_| None,
    },
    Part {
        anchor: "fit",
        heading: "Fit",
        sentences: |study| lines(study.fit.as_slice(), fit),
        figure: |_| None,
    },
];

fn fit(fit: &StudiedFit) -> String {
    let penalty = fit.cost - fit.misfit;
    let parts = match penalty > 1e-6 * fit.cost {
        true => format!(" (misfit {:.6e}, penalties {penalty:.2e})", fit.misfit),
        false => String::new(),
    };
    let (status, reason) = (fit.status.name(), &fit.reason);
    format!("{status}: {reason}; J = {:.6e}{parts}", fit.cost)
}

/// The study as text in the order of its page: a heading for each analysis and its sentences.
pub fn text(study: &StudyDocument) -> String {
    let mut text = format!("{}\n", study.title);
    for part in PARTS {
        let sentences = (part.sentences)(study);
        if sentences.is_empty() {
            continue;
        }
        text += &format!("\n{}\n", part.heading);
        for sentence in sentences {
            text += &format!("  {sentence}\n");
        }
    }
    text
}

fn lines<T>(list: &[T], line: impl Fn(&T) -> String) -> Vec<String> {
    list.iter().map(line).collect()
}

fn sensitivity(sensitivity: &SensitivityRecord) -> Vec<String> {
    let mut lines = vec![sensitivity.text.clone()];
    let names = sensitivity.unidentifiable.iter();
    let mut names: Vec<&str> = names.map(|n| n.name.as_str()).collect();
    names.sort_unstable();
    lines.extend(names.chunk_by(|a, b| a == b).map(|same| match same {
        [name] => format!("not identifiable: {name}"),
        _ => format!(
            "not identifiable: {} ({} combinations)",
            same[0],
            same.len()
        ),
    }));
    lines
}

fn bands(bands: &BandsRecord) -> Vec<String> {
    let classification = bands.classification.iter().map(|c| c.text.clone());
    classification.chain(bands.notes.iter().cloned()).collect()
}

fn equivalent_systems(study: &StudyDocument) -> Vec<String> {
    let others = study.equivalent_systems.iter();
    let mut lines: Vec<String> = others
        .filter(|e| e.response_error > 0.0)
        .map(|e| {
            format!(
                "{}: the response differs from that of the fit by at most {} % of the largest displacement",
                e.name,
                significant(100.0 * e.response_error, 2)
            )
        })
        .collect();
    if !lines.is_empty() {
        let lead = "with c(t) and k(t) as free functions of time, other masses reproduce the same response; the bases, fixed values \
                    and force of this model may exclude them";
        lines.insert(0, lead.into());
    }
    lines
}

fn extremes(study: &StudyDocument) -> Vec<String> {
    let mut lines = lines(&study.extremes, widest);
    let systems = study.extremes.iter().flat_map(|e| &e.systems);
    let unfinished = systems.filter(|s| s.status != ExtremeStatus::Converged);
    lines.extend(
        unfinished
            .take(MOST_LISTED)
            .map(|s| format!("{}: {}", s.name, search(s.status))),
    );
    let mut systems = study.extremes.iter().flat_map(|e| &e.systems);
    if !study.roughness_limited && systems.any(|s| s.status == ExtremeStatus::SearchLimit) {
        lines.push(
            "no penalty limits the roughness of these systems: their extremes are those of the constraints, or of the search range"
                .into(),
        );
    }
    lines
}

/// End of the search for an extreme as a phrase.
fn search(status: ExtremeStatus) -> &'static str {
    match status {
        ExtremeStatus::Converged => "converged",
        ExtremeStatus::SearchLimit => "search range reached; the extreme lies beyond it",
        ExtremeStatus::NoFeasibleStep => "search stalled at the misfit limit",
        ExtremeStatus::ProgramLimit => "iteration limit reached",
    }
}

/// The extremes at the time where they differ most.
fn widest(e: &ExtremesRecord) -> String {
    let range = widest_range(e);
    match is_exact(e) {
        true => format!(
            "{}: {range} to machine precision: the fit reproduces the samples exactly",
            e.name
        ),
        false => format!(
            "{}: {range} (misfit limit {})",
            e.name,
            significant(e.misfit_limit, 5)
        ),
    }
}

/// Index of the time at which the extremes differ most.
fn widest_index(e: &ExtremesRecord) -> usize {
    let width = |i: &usize| e.high[*i] - e.low[*i];
    let times = 0..e.times.len().min(e.low.len()).min(e.high.len());
    times
        .max_by(|a, b| width(a).total_cmp(&width(b)))
        .unwrap_or(0)
}

/// True if the extremes are equal to machine precision.
fn is_exact(e: &ExtremesRecord) -> bool {
    let i = widest_index(e);
    let (Some(low), Some(high)) = (e.low.get(i), e.high.get(i)) else {
        return false;
    };
    high - low <= NEGLIGIBLE * high.abs().max(low.abs())
}

/// The range between the extremes with its unit, at the time where they differ most.
pub fn widest_range(e: &ExtremesRecord) -> String {
    let i = widest_index(e);
    let (Some(low), Some(high), Some(time)) = (e.low.get(i), e.high.get(i), e.times.get(i)) else {
        return String::new();
    };
    if is_exact(e) {
        return format!("{} {}", significant(*high, 6), e.unit);
    }
    let [low, high] = ends([*low, *high]);
    let is_constant = |values: &[f64]| values.iter().all(|x| *x == values[0]);
    let at = match is_constant(&e.low) && is_constant(&e.high) {
        true => String::new(),
        false => format!(" at {time} s, where the range is widest"),
    };
    format!("{low} to {high} {}{at}", e.unit)
}

/// The ends of an interval with three digits of its half-width.
fn ends([low, high]: [f64; 2]) -> [String; 2] {
    resolved([low, high], 0.05 * (high - low))
}

fn prediction(p: &PredictionRecord) -> String {
    if !p.unbounded.is_empty() {
        return format!(
            "{}: the records do not limit this response: {} data-consistent systems, the first with the {}, move more than {BOUNDED} times as far as the fit",
            p.name,
            p.unbounded.len(),
            p.unbounded[0]
        );
    }
    match &p.furthest {
        Some(furthest) if furthest.difference == 0.0 => format!(
            "{}: the extreme systems have the response of the fit",
            p.name
        ),
        Some(furthest) => format!(
            "{}: the response of the system with the {} differs from the fit's by up to {} m",
            p.name,
            furthest.name,
            significant(furthest.difference, 4)
        ),
        None => format!("{}: no extreme systems to compare with", p.name),
    }
}
