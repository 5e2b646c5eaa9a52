//! What a person reads in ten seconds.

use super::advice::{self, Advice};
use super::document::{ChannelSummary, Prediction, ResultDocument};
use crate::digits::significant;
use kmcfit_core::internals::assessment::FunctionSummary;
use kmcfit_core::internals::identifiability::VerdictKind;
use kmcfit_core::internals::solvers::StartStrategy;
use std::fmt::Write;

/// The outcome, the misfit and the functions, as text.
pub fn summary(document: &ResultDocument) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write_summary(&mut text, document);
    text
}

fn write_summary(text: &mut String, document: &ResultDocument) -> std::fmt::Result {
    let cost = &document.cost;
    writeln!(text, "{}", document.title)?;
    writeln!(
        text,
        "{}: {}",
        document.outcome.status.name(),
        document.outcome.reason
    )?;
    write_findings(text, document)?;
    write!(text, "J {:.6e} -> {:.6e}", cost.initial, cost.r#final)?;
    if document.has_ratio() {
        write!(text, ", J/J0 {:.4e}", cost.ratio)?;
    }
    let counts = &document.counts;
    let (others, what) = match (counts.adjoint, counts.tangent) {
        (0, tangent @ 1..) => (tangent, "tangent"),
        (adjoint, _) => (adjoint, "adjoint"),
    };
    writeln!(
        text,
        "; {}, {} forward and {others} {what} solves, {:.2} s",
        iterations(document),
        counts.forward,
        document.seconds
    )?;
    for (name, channel) in document.records() {
        write_channel(text, &name, channel)?;
    }
    for out in &document.held_out {
        if let Some(failure) = &out.failure {
            writeln!(text, "{}: no motion: {failure}", out.title())?;
        }
    }
    write_statistics(text, document)?;
    writeln!(text)?;
    write_functions(text, document)?;
    write_scalars(text, document)?;
    write_constraints(text, document)?;
    write_rungs(text, document)?;
    if !document.predictions.is_empty() {
        write!(
            text,
            "\n{}",
            prediction_table(&document.predictions, document.is_rotation())
        )?;
    }
    Ok(())
}

/// What was found, how well, how sure, what stays open, what to try next: a line each.
fn write_findings(text: &mut String, document: &ResultDocument) -> std::fmt::Result {
    let well = document.worst_fit().map(|worst| {
        let what = match document.channels().count() {
            1 => "the readings are",
            _ => "the worst channel is",
        };
        let aside = match document.channels().map(|c| c.left_aside).sum::<usize>() {
            0 => String::new(),
            far => format!(", {} far off left aside", count(far, "reading")),
        };
        let ratio = match document.has_ratio() {
            true => format!("; J/J0 {:.1e}", document.cost.ratio),
            false => String::new(),
        };
        let held = document.held_out.iter().flat_map(|e| &e.channels);
        let held = held.map(|c| c.fit_percent).reduce(f64::min);
        let held = held.map_or(String::new(), |worst| {
            format!("; held out: {}", advice::percent(worst, 2))
        });
        format!(
            "{what} matched to {}{aside}{held}{ratio}",
            advice::percent(worst, 2)
        )
    });
    let known = &document.identifiability;
    for (label, sentences) in [
        ("found", vec![found(document)]),
        ("how well", well.into_iter().collect()),
        ("how sure", known.settled.clone()),
        ("open", known.open.clone()),
        (
            "try next",
            advice::next(document)
                .iter()
                .map(Advice::to_string)
                .collect(),
        ),
    ] {
        for (i, sentence) in sentences.iter().enumerate() {
            let label = if i == 0 { label } else { "" };
            writeln!(text, "  {label:<9} {sentence}")?;
        }
    }
    writeln!(text)
}

/// The functions of the device with their units: `mass 0.6 to 2.3 kg; stiffness 1 N/m`. What readings do not show has no
/// value, what they show at times has its values then.
fn found(document: &ResultDocument) -> String {
    let function = |(name, f): (&str, &FunctionSummary)| {
        if f.is_rounding {
            return format!("{name} 0 {}", f.unit);
        }
        if f.verdict == Some(VerdictKind::NotSeen) {
            return format!("{name} not seen");
        }
        let (range, seen) = match f.known_range {
            Some(range) if f.verdict == Some(VerdictKind::OnlyOn) => (range, " where it is seen"),
            _ => ([f.min, f.max], ""),
        };
        let [low, high] = range.map(short);
        let values = match f.standard_error {
            Some(error) if f.min == f.max => format!("{low} +- {error:.1e}"),
            _ if low == high => low,
            _ => format!("{low} to {high}"),
        };
        format!("{name} {values} {}{seen}", f.unit)
    };
    let found: Vec<String> = document.terms().map(function).collect();
    let legend = match found.iter().any(|f| f.contains(" +- ")) {
        true => " (+- one standard error)",
        false => "",
    };
    found.join("; ") + legend
}

/// Four significant digits.
fn short(x: f64) -> String {
    significant(x, 4)
}

/// How well one channel is matched.
pub(super) fn write_channel(
    text: &mut String,
    name: &str,
    channel: &ChannelSummary,
) -> std::fmt::Result {
    write!(
        text,
        "{name}: {} within {:.4e} {} rms, {}, {}",
        channel.kind,
        channel.rms_residual,
        channel.unit,
        fit_in_words(channel.fit_percent),
        count(channel.readings, "reading")
    )?;
    if channel.left_aside > 0 {
        write!(text, "; {} far off left aside", channel.left_aside)?;
    }
    for ignored in &channel.ignored {
        write!(text, "; {} not used: {}", ignored.readings, ignored.reason)?;
    }
    writeln!(text)?;
    if let (Some(sigma), true) = (channel.sigma, channel.sigma_estimated) {
        writeln!(text, "  sigma estimated: {sigma:.4e} {}", channel.unit)?;
    }
    // Where there is no noise the question makes no sense.
    if channel.sigma.is_some() {
        writeln!(text, "  {}", channel.whiteness)?;
    }
    Ok(())
}

/// The fit of a channel; readings that are all the same have none.
pub(super) fn fit_in_words(percent: f64) -> String {
    match percent.is_finite() {
        true => format!("fit {}", advice::percent(percent, 2)),
        false => "no fit in per cent".into(),
    }
}

/// All readings together, and what half the step changes.
pub(super) fn write_statistics(text: &mut String, document: &ResultDocument) -> std::fmt::Result {
    let statistics = &document.statistics;
    if let Some(reduced) = statistics.reduced_chi_square {
        write!(
            text,
            "chi-square per degree of freedom {reduced:.4} ({} readings, {} parameters)",
            statistics.samples, statistics.parameters
        )?;
        match (statistics.aic, statistics.bic) {
            (Some(aic), Some(bic)) => writeln!(text, ", AIC {aic:.2}, BIC {bic:.2}")?,
            _ => writeln!(text)?,
        }
    }
    match &document.half_step {
        Some(half) => writeln!(
            text,
            "on half the step the model's readings change by at most {:.1e} of the largest one",
            half.change_per_sample
        ),
        None if !document.is_simulated() => Ok(()),
        None => writeln!(text, "on half the step there is no motion"),
    }
}

/// The numbers that were fitted beside the functions.
pub(super) fn write_scalars(text: &mut String, document: &ResultDocument) -> std::fmt::Result {
    for scalar in &document.scalars {
        write!(text, "{} {}", scalar.name, significant(scalar.value, 6))?;
        match scalar.standard_error {
            Some(error) => writeln!(text, " +- {error:.2e} {}", scalar.unit)?,
            None => writeln!(text, " {}", scalar.unit)?,
        }
    }
    Ok(())
}

/// The iterations of the last fit, and of the fits on the way to it: to its weight, if a rule chose that, or from other
/// starts.
pub(super) fn iterations(document: &ResultDocument) -> String {
    let last = count(document.counts.iterations as usize, "iteration");
    if let Some(weights) = &document.weights {
        let fits = count(weights.path.len(), "weight");
        let before = weights.iterations();
        return format!("{last} after {before} along a path of {fits}");
    }
    if document.rungs.len() < 2 {
        return last;
    }
    let all = document
        .rungs
        .iter()
        .map(|rung| rung.iterations)
        .sum::<u64>();
    let starts = document
        .rungs
        .iter()
        .filter(|rung| rung.start != StartStrategy::Continued.name());
    let starts = count(starts.count(), "start");
    match document.estimates_sigma() {
        true => format!("{last} after {all} from {starts}"),
        false => format!("{last}, {all} in all from {starts}"),
    }
}

/// A number of things, in the singular where there is one.
pub(super) fn count(number: usize, thing: &str) -> String {
    match number {
        1 => format!("1 {thing}"),
        _ => format!("{number} {thing}s"),
    }
}

/// Numbers of one kind with five decimals, or in powers of ten where the largest asks for that; what rounds to zero
/// has no sign.
pub(super) fn alike<const N: usize>(numbers: [f64; N]) -> [String; N] {
    let largest = numbers.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    match largest == 0.0 || (1e-2..1e6).contains(&largest) {
        true => numbers.map(decimals),
        false => numbers.map(|x| format!("{x:.5e}")),
    }
}

fn decimals(x: f64) -> String {
    let text = format!("{x:.5}");
    match text.strip_prefix('-') {
        Some(zero) if zero.bytes().all(|b| b == b'0' || b == b'.') => zero.into(),
        _ => text,
    }
}

fn write_functions(text: &mut String, document: &ResultDocument) -> std::fmt::Result {
    let has_truth = document
        .functions
        .values()
        .any(|f| f.truth_max_error.is_some());
    let longest = document.functions.keys().map(String::len).max();
    let width = longest.unwrap_or(0).max(10);
    write!(text, "{:<width$} {:>12} {:>12}", "function", "min", "max")?;
    if has_truth {
        write!(text, " {:>14} {:>14}", "largest error", "rms error")?;
    }
    writeln!(text)?;
    for (name, function) in document.all_functions() {
        let [min, max] = match function.is_rounding {
            true => [0.0; 2].map(decimals),
            false => alike([function.min, function.max]),
        };
        write!(text, "{name:<width$} {min:>12} {max:>12}")?;
        if let (Some(most), Some(rms)) = (function.truth_max_error, function.truth_rms_error) {
            write!(text, " {most:>14.3e} {rms:>14.3e}")?;
        }
        let is_seen = function.verdict != Some(VerdictKind::NotSeen);
        match function.standard_error.filter(|_| !function.is_rounding) {
            _ if !is_seen => write!(text, "  not seen")?,
            Some(error) => write!(text, "  +- {error:.2e}")?,
            None => {}
        }
        writeln!(text)?;
    }
    Ok(())
}

pub(super) fn write_constraints(text: &mut String, document: &ResultDocument) -> std::fmt::Result {
    if let Some(weights) = &document.weights {
        writeln!(
            text,
            "weight of the smoothness {:.3e} by {}",
            weights.weight, weights.rule
        )?;
        if let Some(remark) = &weights.remark {
            writeln!(text, "{remark}")?;
        }
    }
    for slack in &document.constraints.slack {
        writeln!(
            text,
            "soft `{}` is broken by up to {:.3e} on {}",
            slack.name,
            slack.largest,
            count(slack.rows, "row")
        )?;
    }
    for active in &document.constraints.active {
        writeln!(text, "{}", active.sentence)?;
    }
    Ok(())
}

/// The ladder, where more than one start was tried.
pub(super) fn write_rungs(text: &mut String, document: &ResultDocument) -> std::fmt::Result {
    if document.rungs.len() < 2 {
        return Ok(());
    }
    let with = match document.estimates_sigma() {
        true => " (sigma not estimated yet)",
        false => "",
    };
    for rung in &document.rungs {
        let cost = rung
            .cost
            .map_or("no motion".into(), |cost| format!("J {cost:.4e}{with}"));
        writeln!(
            text,
            "from the {}: {cost} after {} ({})",
            rung.start,
            count(rung.iterations as usize, "iteration"),
            rung.status.name()
        )?;
    }
    Ok(())
}

/// Predictions as a table: the initial state and, where a truth is known, the cost against it and the energy of the true
/// motion, else how far the motion goes and where it ends.
pub fn prediction_table(predictions: &[Prediction], is_rotation: bool) -> String {
    let has_truth = predictions
        .iter()
        .any(|p| p.cost.is_some() || p.energy.is_some());
    let m = if is_rotation { "rad" } else { "m" };
    let row = |[y, v, one, other]: [&str; 4]| format!("{y:>12} {v:>12} {one:>14} {other:>14}\n");
    let [y, v] = [format!("y(0) {m}"), format!("v(0) {m}/s")];
    let [one, other] = match has_truth {
        true => [format!("cost {m}^2 s"), format!("energy {m}^2 s")],
        false => [format!("largest {m}"), format!("at the end {m}")],
    };
    let mut text = row([&y, &v, &one, &other]);
    for p in predictions {
        let [y, v] = [p.displacement, p.velocity].map(|x| significant(x, 6));
        let [one, other] = match has_truth {
            true => [p.cost, p.energy].map(|x| x.map(|x| format!("{x:.5e}"))),
            false => [p.largest, p.last].map(|x| x.map(|x| significant(x, 6))),
        }
        .map(|x| x.unwrap_or_else(|| "unknown".into()));
        text += &row([&y, &v, &one, &other]);
        if let Some(failure) = &p.failure {
            let _ = writeln!(text, "{:>12} no motion: {failure}", "");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_has_no_sign() {
        assert_eq!(decimals(-1e-9), "0.00000");
        assert_eq!(decimals(-0.0), "0.00000");
        assert_eq!(decimals(-1e-5), "-0.00001");
        assert_eq!(decimals(-0.09917), "-0.09917");
        assert_eq!(decimals(12.0), "12.00000");
    }

    #[test]
    fn one_is_not_many() {
        assert_eq!(count(1, "row"), "1 row");
        assert_eq!(count(0, "row"), "0 rows");
        assert_eq!(count(2, "row"), "2 rows");
    }
}
