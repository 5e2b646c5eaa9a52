//! A study for a terminal: its sentences.

use super::{
    BandsPiece, BootstrapRecord, PredictionRecord, SpectrumPiece, StudyDocument, TubeRecord,
};
use crate::digits::significant;

/// How the search for an extreme device ends when it has found it.
pub const ENDED: &str = "no further";
/// Most extreme devices of which it is told how their search ended otherwise.
const MOST_LISTED: usize = 6;

/// What was found, a paragraph for each piece.
pub fn text(study: &StudyDocument) -> String {
    let mut text = format!("{}\n", study.title);
    for (heading, sentences) in sections(study) {
        text += &format!("\n{heading}\n");
        for sentence in sentences {
            text += &format!("  {sentence}\n");
        }
    }
    text
}

/// The headings and their sentences.
pub fn sections(study: &StudyDocument) -> Vec<(&'static str, Vec<String>)> {
    let multistart = study.multistart.iter();
    let sections = [
        ("Before the fit", study.before.clone()),
        (
            "The fit",
            lines(study.fit.as_slice(), |fit| {
                format!(
                    "{}: {}; J = {:.6e}",
                    fit.status.name(),
                    fit.reason,
                    fit.cost
                )
            }),
        ),
        (
            "What the readings see",
            study.spectrum.iter().flat_map(spectrum).collect(),
        ),
        (
            "What is known of each function",
            study.bands.iter().flat_map(bands).collect(),
        ),
        ("Profiles", lines(&study.profiles, |p| p.sentence.clone())),
        ("The widest tubes", tubes(study)),
        (
            "Other devices with the same motion",
            lines(&study.equivalents, |e| {
                format!(
                    "{}: moves like the fit to {:.1e} of the largest displacement",
                    e.name, e.response_error
                )
            }),
        ),
        (
            "Fits from many starts",
            multistart.flat_map(|m| m.sentences.clone()).collect(),
        ),
        (
            "Does it vary?",
            lines(&study.varies, |v| v.sentence.clone()),
        ),
        ("Refits", lines(&study.bootstrap, interval)),
        (
            "Which experiment next",
            lines(&study.candidates, |c| c.sentence.clone()),
        ),
        (
            "Motions from elsewhere",
            lines(&study.predictions, prediction),
        ),
        ("Not done", study.failures.clone()),
    ];
    let mut sections = Vec::from(sections);
    sections.retain(|(_, lines)| !lines.is_empty());
    sections
}

fn lines<T>(list: &[T], line: impl Fn(&T) -> String) -> Vec<String> {
    list.iter().map(line).collect()
}

fn spectrum(spectrum: &SpectrumPiece) -> Vec<String> {
    let mut lines = vec![spectrum.sentence.clone()];
    let mut names: Vec<&str> = spectrum.unseen.iter().map(|n| n.name.as_str()).collect();
    names.sort_unstable();
    lines.extend(names.chunk_by(|a, b| a == b).map(|same| match same {
        [name] => format!("one unseen direction is the {name}"),
        _ => format!("{} unseen directions are the {}", same.len(), same[0]),
    }));
    lines
}

fn bands(bands: &BandsPiece) -> Vec<String> {
    let verdicts = bands.verdicts.iter().map(|v| v.sentence.clone());
    verdicts.chain(bands.notes.iter().cloned()).collect()
}

fn tubes(study: &StudyDocument) -> Vec<String> {
    let mut lines = lines(&study.tubes, tube);
    let open = study.tubes.iter().flat_map(|t| &t.devices);
    let open = open
        .filter(|(_, _, ended)| ended != ENDED)
        .take(MOST_LISTED);
    lines.extend(open.map(|(name, _, ended)| format!("{name}: {ended}")));
    if !study.tubes.is_empty() && !study.budgeted {
        lines.push(
            "no smoothness bounds these devices: where constraints do not either, the tubes are the \
             bounds"
                .into(),
        );
    }
    lines
}

fn tube(t: &TubeRecord) -> String {
    let width = |i: &usize| t.high[*i] - t.low[*i];
    let widest = (0..t.times.len().min(t.low.len())).max_by(|a, b| width(a).total_cmp(&width(b)));
    let widest = widest.unwrap_or(0);
    format!(
        "{}: widest at {} s, from {} to {} {}, among devices with a misfit of at most {:.4e}",
        t.name,
        t.times[widest],
        significant(t.low[widest], 6),
        significant(t.high[widest], 6),
        t.unit,
        t.level
    )
}

fn interval(b: &BootstrapRecord) -> String {
    match b.interval {
        Some([low, high]) => format!(
            "{}: {} to {} {}",
            b.name,
            significant(low, 6),
            significant(high, 6),
            b.unit
        ),
        None => format!("{}: too few refits ended well", b.name),
    }
}

fn prediction(p: &PredictionRecord) -> String {
    match &p.furthest {
        Some((name, distance)) => format!(
            "{}: the device `{name}` moves up to {} m away",
            p.name,
            significant(*distance, 4)
        ),
        None => format!("{}: no other device to compare with", p.name),
    }
}
