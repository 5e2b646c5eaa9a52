//! A study for a terminal: its sentences.

use super::StudyDocument;
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
    let mut sections = vec![("Before the fit", study.before.clone())];
    if let Some(fit) = &study.fit {
        let line = format!("{}: {}; J = {:.6e}", fit.status, fit.reason, fit.cost);
        sections.push(("The fit", vec![line]));
    }
    if let Some(spectrum) = &study.spectrum {
        let mut lines = vec![spectrum.sentence.clone()];
        let mut names: Vec<&str> = spectrum.unseen.iter().map(|n| n.name.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        for name in names {
            let count = spectrum.unseen.iter().filter(|n| n.name == name).count();
            lines.push(match count {
                1 => format!("one unseen direction is the {name}"),
                _ => format!("{count} unseen directions are the {name}"),
            });
        }
        sections.push(("What the readings see", lines));
    }
    if let Some(bands) = &study.bands {
        let verdicts = bands.verdicts.iter().map(|v| v.sentence.clone());
        let notes = bands.notes.iter().cloned();
        sections.push((
            "What is known of each function",
            verdicts.chain(notes).collect(),
        ));
    }
    let mut add = |heading, lines: Vec<String>| {
        if !lines.is_empty() {
            sections.push((heading, lines));
        }
    };
    add(
        "Profiles",
        study.profiles.iter().map(|p| p.sentence.clone()).collect(),
    );
    let tube = |t: &super::TubeRecord| {
        let width = |i: &usize| t.high[*i] - t.low[*i];
        let widest = (0..t.times.len().min(t.low.len()))
            .max_by(|a, b| width(a).total_cmp(&width(b)))
            .unwrap_or(0);
        format!(
            "{}: widest at {} s, from {} to {} {}, among devices with a misfit of at most {:.4e}",
            t.name,
            t.times[widest],
            significant(t.low[widest], 6),
            significant(t.high[widest], 6),
            t.unit,
            t.level
        )
    };
    let mut lines: Vec<String> = study.tubes.iter().map(tube).collect();
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
    add("The widest tubes", lines);
    let equivalent = |e: &super::EquivalentRecord| {
        format!(
            "{}: moves like the fit to {:.1e} of the largest displacement",
            e.name, e.motion_error
        )
    };
    add(
        "Other devices with the same motion",
        study.equivalents.iter().map(equivalent).collect(),
    );
    if let Some(multistart) = &study.multistart {
        add("Fits from many starts", multistart.sentences.clone());
    }
    add(
        "Does it vary?",
        study.varies.iter().map(|v| v.sentence.clone()).collect(),
    );
    let interval = |b: &super::BootstrapRecord| match b.interval {
        Some([low, high]) => format!(
            "{}: {} to {} {}",
            b.name,
            significant(low, 6),
            significant(high, 6),
            b.unit
        ),
        None => format!("{}: too few refits ended well", b.name),
    };
    add("Refits", study.bootstrap.iter().map(interval).collect());
    add(
        "Which experiment next",
        study
            .candidates
            .iter()
            .map(|c| c.sentence.clone())
            .collect(),
    );
    let prediction = |p: &super::PredictionRecord| match &p.furthest {
        Some((name, distance)) => {
            format!(
                "{}: the device `{name}` moves up to {} m away",
                p.name,
                significant(*distance, 4)
            )
        }
        None => format!("{}: no other device to compare with", p.name),
    };
    add(
        "Motions from elsewhere",
        study.predictions.iter().map(prediction).collect(),
    );
    add("Not done", study.failures.clone());
    sections
}
