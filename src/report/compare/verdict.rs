//! What the numbers of a run mean, in one line.

use super::errors::Errors;
use super::run::ComparedRun;
use super::{CLOSE, MATCHED, RECOVERED, ROUNDING};
use crate::report::cost::CostKind;
use crate::report::document::ResultDocument;

/// Fit in per cent from which a motion whose noise was estimated counts as matched.
const FITTED: f64 = 90.0;

/// The line: whether the motion is matched, and whether the device is the true one.
pub(super) fn verdict(run: &ComparedRun, errors: Option<&Errors>) -> String {
    let (matched, how) = matching(run);
    let Some(errors) = errors else {
        return format!("{how}; the truth is not known");
    };
    if errors.within(RECOVERED) {
        let digits = errors.k_over_m_relative.max(errors.c_over_m_relative);
        let mut text = format!("the true device: k/m and c/m to {}", size(digits));
        if errors.mass_relative >= RECOVERED {
            let off = percent(errors.mass_relative);
            text += &format!(", but m, c and k off by a common factor (m by {off})");
        }
        return match matched {
            true => text,
            false => format!("{text}; {how}"),
        };
    }
    let off = distances(errors);
    match (matched, errors.within(CLOSE)) {
        (_, true) if errors.mass_relative >= CLOSE => format!(
            "close to the true device in k/m and c/m: {off}; m, c and k off by a common factor (m by \
             {}); {how}",
            percent(errors.mass_relative)
        ),
        (_, true) => format!("close to the true device: {off}; {how}"),
        (true, false) => format!("{how} but is another device: {off}"),
        (false, false) => format!("{how}; another device: {off}"),
    }
}

/// Whether the measured motion is matched, and in words how well.
fn matching(run: &ComparedRun) -> (bool, String) {
    let document = &run.finished.document;
    let ratio = document.cost.ratio;
    let channels = || document.experiments.iter().flat_map(|e| &e.channels);
    if channels().any(|c| c.sigma_estimated) {
        // Chi-square is then what it is by construction.
        let least = channels().map(|c| c.fit_percent).fold(100.0, f64::min);
        let verb = match least >= FITTED {
            true => "matches",
            false => "does not match",
        };
        let how = format!("{verb} the motion (fit {least:.1} %; its noise was estimated from it)");
        return (least >= FITTED, how);
    }
    if is_chi_square(document) {
        let n = document
            .experiments
            .iter()
            .map(|e| e.readings)
            .sum::<usize>() as f64;
        let misfit = document.cost.misfit;
        // The discrepancy rule: mean and twice the standard deviation of a chi-square.
        let matched = misfit <= n + 2.0 * (2.0 * n).sqrt();
        let verb = if matched { "matches" } else { "does not match" };
        let how =
            format!("{verb} the motion within its noise (chi-square {misfit:.0} of {n} readings)");
        return (matched, how);
    }
    if document.model.cost_kind == CostKind::EquationError {
        // The motion of such a run is the measured one.
        let how = format!("fits the equation of motion, not a motion (J/J0 {ratio:.1e})");
        return (false, how);
    }
    let left = residual_share(run);
    match left <= MATCHED {
        true => (true, format!("matches the motion (J/J0 {ratio:.1e})")),
        false => {
            let left = percent(left);
            let how = format!("does not match the motion (J/J0 {ratio:.1e}, {left} of it is left)");
            (false, how)
        }
    }
}

/// Root-mean-square residual over root-mean-square reading, the worst of all motions.
fn residual_share(run: &ComparedRun) -> f64 {
    let squares = |f: &[f64]| f.iter().map(|x| x * x).sum::<f64>();
    let shares = run.motions.iter().map(|motion| {
        let left = squares(&motion.residual);
        if left == 0.0 {
            0.0
        } else {
            (left / squares(&motion.observed)).sqrt()
        }
    });
    shares.fold(0.0, f64::max)
}

/// The misfit is a chi-square: every record has a sigma.
pub(super) fn is_chi_square(document: &ResultDocument) -> bool {
    document.model.cost_kind == CostKind::ChiSquare
}

/// How far `k/m` and `c/m` are from the truth; only the one that is off, if the other is not.
fn distances(errors: &Errors) -> String {
    let stiffness = format!("k/m off by {}", percent(errors.k_over_m_relative));
    let of = if errors.undamped {
        " of critical damping"
    } else {
        ""
    };
    let damping = format!("c/m off by {}{of}", percent(errors.c_over_m_relative));
    if errors.c_over_m_relative < RECOVERED {
        stiffness
    } else if errors.k_over_m_relative < RECOVERED {
        damping
    } else {
        format!("{stiffness}, {damping}")
    }
}

/// A small number with two digits; with one where it is rounding.
fn size(x: f64) -> String {
    match x < ROUNDING {
        true => format!("{x:.0e}"),
        false => format!("{x:.1e}"),
    }
}

/// A share as a percentage with two or three digits.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    match percent {
        _ if !percent.is_finite() => "more than any number".into(),
        p if p >= 1e4 => format!("a factor of {share:.0e}"),
        p if p >= 10.0 => format!("{p:.0} %"),
        p if p >= 1.0 => format!("{p:.1} %"),
        p => format!("{p:.2} %"),
    }
}
