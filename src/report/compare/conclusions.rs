//! What a row of runs comes to, computed from their numbers: change the data and it changes.

use super::CLOSE;
use super::measures::Measures;
use kmcfit_core::internals::assessment::TruthErrors;

/// One sentence for each run, and one on what led to the true device.
pub fn conclusions(runs: &[Measures]) -> Vec<String> {
    let mut sentences = Vec::new();
    let mut told: Vec<&String> = Vec::new();
    for (i, run) in runs.iter().enumerate() {
        let new = run.knowledge.iter().filter(|k| !told.contains(k));
        let new: Vec<&str> = new.map(String::as_str).collect();
        let told_more = match (i, new.as_slice()) {
            (_, []) => "Told nothing more".to_owned(),
            (0, list) => format!("Told {}", list.join("; ")),
            (_, list) => format!("Told besides, or instead: {}", list.join("; ")),
        };
        sentences.push(format!("{}. {told_more}, it {}.", run.name, outcome(run)));
        told.extend(&run.knowledge);
    }
    sentences.extend(turning_point(runs));
    sentences
}

/// What a run found.
fn outcome(run: &Measures) -> String {
    let matched = run.is_matched;
    let Some(errors) = &run.errors else {
        return match matched {
            true => "matches the motion; the truth is not known".into(),
            false => "does not match the motion; the truth is not known".into(),
        };
    };
    let worst = errors.worst_ratio();
    let percent = |share: f64| match share < 1e-4 {
        true => format!("{share:.0e} of their size"),
        false => format!("{:.2} %", 100.0 * share),
    };
    let scale = errors.mass_relative >= CLOSE;
    match (worst < CLOSE, scale, matched) {
        (true, false, _) => format!(
            "finds the true device: k/m and c/m to {}, m to {}",
            percent(worst),
            percent(errors.mass_relative)
        ),
        (true, true, _) => format!(
            "finds the true k/m and c/m (to {}), but not the scale: m is off by {}",
            percent(worst),
            percent(errors.mass_relative)
        ),
        (false, _, true) => format!(
            "matches the motion with another device: k/m or c/m is off by {}",
            percent(worst)
        ),
        (false, _, false) => format!(
            "finds neither the motion nor the device: k/m or c/m is off by {}",
            percent(worst)
        ),
    }
}

/// How near the ratios of a run are to the truth; `None` where it is not known.
fn distance(run: &Measures) -> Option<f64> {
    run.errors.as_ref().map(TruthErrors::worst_ratio)
}

/// Whether a small misfit went with a wrong device, and which run of these is nearest to the truth.
fn turning_point(runs: &[Measures]) -> Vec<String> {
    let mut sentences = Vec::new();
    let known: Vec<&Measures> = runs.iter().filter(|r| r.errors.is_some()).collect();
    let wrong = |r: &&&Measures| distance(r).is_some_and(|d| d >= CLOSE);
    let best_wrong = known
        .iter()
        .filter(wrong)
        .min_by(|a, b| a.cost_ratio.total_cmp(&b.cost_ratio));
    if let Some(run) = best_wrong {
        sentences.push(format!(
            "A small misfit does not show the device: {} leaves J/J0 = {:.1e} and is another one.",
            run.name, run.cost_ratio
        ));
    }
    let found = known.iter().filter(|r| !wrong(r));
    let with_scale = |r: &&&&Measures| r.errors.as_ref().is_some_and(|e| e.mass_relative < CLOSE);
    let found: Vec<&&Measures> = found.collect();
    match (found.is_empty(), found.iter().find(with_scale)) {
        (true, _) if !known.is_empty() => {
            sentences.push("None of these runs leads to the true device.".into());
        }
        (false, Some(first)) => sentences.push(format!(
            "The first of these runs to find the device with its scale is {}.",
            first.name
        )),
        (false, None) => sentences.push(
            "The ratios k/m and c/m are found; nothing here holds the scale of (m, c, k).".into(),
        ),
        _ => {}
    }
    sentences
}
