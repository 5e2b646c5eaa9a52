//! Conclusions on a sequence of runs, computed from their measures: the assumptions that each run adds, its result, and
//! the first run that recovers the true system.

use super::measures::Measures;
use super::verdict::Agreement;

/// One sentence for each run, then the sentences on the whole sequence.
pub fn conclusions(runs: &[Measures]) -> Vec<String> {
    let mut sentences = Vec::new();
    let mut earlier: Vec<&String> = Vec::new();
    for (i, run) in runs.iter().enumerate() {
        let new = run.assumptions.iter().filter(|a| !earlier.contains(a));
        let new: Vec<&str> = new.map(String::as_str).collect();
        let assumptions = match (i, new.as_slice()) {
            (_, []) => "no new assumption".to_owned(),
            (0, list) => format!("assumptions: {}", list.join("; ")),
            (_, list) => format!("new assumptions: {}", list.join("; ")),
        };
        sentences.push(format!("{} ({assumptions}): {}.", run.name, outcome(run)));
        earlier.extend(&run.assumptions);
    }
    sentences.extend(on_the_truth(runs));
    sentences
}

/// Result of one run.
fn outcome(run: &Measures) -> String {
    let matched = run.is_matched;
    let Some(errors) = &run.errors else {
        return match matched {
            true => "response fitted; true system not known".into(),
            false => "response not fitted; true system not known".into(),
        };
    };
    let worst = errors.largest_ratio_error();
    let percent = |share: f64| match share < 1e-4 {
        true => format!("{:.0e} %", 100.0 * share),
        false => format!("{:.2} %", 100.0 * share),
    };
    let agreement = Agreement::of(errors);
    let mass = percent(errors.mass_relative);
    match (agreement, agreement.has_scale(errors), matched) {
        (Agreement::Recovered, true, _) => format!(
            "true system recovered: relative error of k/m and c/m {}, of m {mass}",
            percent(worst)
        ),
        (Agreement::Recovered, false, _) => format!(
            "k/m and c/m of the true system recovered (error {}), but not the scale: error of m {mass}",
            percent(worst)
        ),
        (Agreement::Close, true, _) => format!(
            "close to the true system: relative error of k/m and c/m {}, of m {mass}",
            percent(worst)
        ),
        (Agreement::Close, false, _) => format!(
            "k/m and c/m close to the true values (error {}), but not the scale: error of m {mass}",
            percent(worst)
        ),
        (Agreement::Different, _, true) => format!(
            "response fitted by another parameter set: error of k/m or c/m {}",
            percent(worst)
        ),
        (Agreement::Different, _, false) => format!(
            "response not fitted, not close to the true system: error of k/m or c/m {}",
            percent(worst)
        ),
    }
}

/// Sentences on the true system: the smallest misfit of a wrong parameter set, and the first run that recovers the system.
pub(super) fn on_the_truth(runs: &[Measures]) -> Vec<String> {
    let mut sentences = Vec::new();
    let known = runs.iter().filter_map(|run| {
        let errors = run.errors.as_ref()?;
        let agreement = Agreement::of(errors);
        Some((run, agreement, agreement.has_scale(errors)))
    });
    let known: Vec<(&Measures, Agreement, bool)> = known.collect();
    let wrong = known.iter().filter(|(_, a, _)| *a == Agreement::Different);
    let best_wrong = wrong.min_by(|a, b| a.0.cost_ratio.total_cmp(&b.0.cost_ratio));
    if let Some((run, ..)) = best_wrong {
        sentences.push(format!(
            "A small misfit does not imply the true system: {} has J/J0 = {:.1e} with another parameter set.",
            run.name, run.cost_ratio
        ));
    }
    let mut recovered = known.iter().filter(|(_, a, _)| *a == Agreement::Recovered);
    let is_recovered = recovered.clone().next().is_some();
    let first = recovered.find(|(.., has_scale)| *has_scale);
    let close = known.iter().find(|(_, a, _)| *a == Agreement::Close);
    sentences.extend(match (first, close) {
        _ if known.is_empty() => None,
        (Some((first, ..)), _) => Some(format!(
            "{} is the first run that recovers the true system, including its scale.",
            first.name
        )),
        _ if is_recovered => Some(
            "k/m and c/m of the true system are recovered in at least one run, the scale of m, c and k in none."
                .into(),
        ),
        (None, Some((close, ..))) => Some(format!(
            "No run recovers the true system; {} is the first that is close to it.",
            close.name
        )),
        (None, None) => Some("No run recovers the true system.".into()),
    });
    sentences
}
