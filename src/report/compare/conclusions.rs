//! Conclusions on a sequence of runs, computed from their measures: the assumptions that each run adds, its result, and
//! the first run that recovers the true system.

use super::CLOSE;
use super::measures::Measures;
use kmcfit_core::internals::assessment::TruthErrors;

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
    let scale = errors.mass_relative >= CLOSE;
    match (worst < CLOSE, scale, matched) {
        (true, false, _) => format!(
            "close to the true system: relative error of k/m and c/m {}, of m {}",
            percent(worst),
            percent(errors.mass_relative)
        ),
        (true, true, _) => format!(
            "k/m and c/m close to the true values (error {}), but not the scale: error of m {}",
            percent(worst),
            percent(errors.mass_relative)
        ),
        (false, _, true) => format!(
            "response fitted by another parameter set: error of k/m or c/m {}",
            percent(worst)
        ),
        (false, _, false) => format!(
            "response not fitted, not close to the true system: error of k/m or c/m {}",
            percent(worst)
        ),
    }
}

/// Largest relative error of k/m and c/m; `None` if the true system is not known.
fn ratio_error(run: &Measures) -> Option<f64> {
    run.errors.as_ref().map(TruthErrors::largest_ratio_error)
}

/// Sentences on the true system: the smallest misfit of a wrong parameter set, and the first run that recovers the system.
fn on_the_truth(runs: &[Measures]) -> Vec<String> {
    let mut sentences = Vec::new();
    let known: Vec<&Measures> = runs.iter().filter(|r| r.errors.is_some()).collect();
    let wrong = |r: &&&Measures| ratio_error(r).is_some_and(|d| d >= CLOSE);
    let best_wrong = known
        .iter()
        .filter(wrong)
        .min_by(|a, b| a.cost_ratio.total_cmp(&b.cost_ratio));
    if let Some(run) = best_wrong {
        sentences.push(format!(
            "A small misfit does not imply the true system: {} has J/J0 = {:.1e} with another parameter set.",
            run.name, run.cost_ratio
        ));
    }
    let found = known.iter().filter(|r| !wrong(r));
    let with_scale = |r: &&&&Measures| r.errors.as_ref().is_some_and(|e| e.mass_relative < CLOSE);
    let found: Vec<&&Measures> = found.collect();
    match (found.is_empty(), found.iter().find(with_scale)) {
        (true, _) if !known.is_empty() => {
            sentences.push("No run is close to the true system.".into());
        }
        (false, Some(first)) => sentences.push(format!(
            "{} is the first run close to the true system, including its scale.",
            first.name
        )),
        (false, None) => sentences.push(
            "k/m and c/m are close to the true values in at least one run; the scale of m, c and k is not close in any of these.".into(),
        ),
        _ => {}
    }
    sentences
}
