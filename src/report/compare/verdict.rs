//! What the numbers of a run mean, in one line.

use super::run::ComparedRun;
use super::{CLOSE, MATCHED, ROUNDING};
use crate::report::cost::CostKind;
use kmcfit_core::internals::assessment::{RECOVERED, TruthErrors};
use std::fmt;

/// Fit in per cent from which a motion whose noise was estimated counts as matched.
const FITTED: f64 = 90.0;

/// How well the measured motion is matched.
pub(super) enum Match {
    /// The noise was estimated from the motion, and the fit of the worst channel is so many per cent: chi-square is then
    /// what it is by construction.
    Fit(f64),
    /// Chi-square of so many readings.
    ChiSquare { misfit: f64, readings: f64 },
    /// The motion of the run is the measured one; `J/J0`.
    Equation(f64),
    /// The share of the motion that is left, and `J/J0`.
    Left { share: f64, ratio: f64 },
}

impl Match {
    /// How well a run matches its motion.
    pub fn of(run: &ComparedRun) -> Self {
        let document = &run.finished.document;
        let ratio = document.cost.ratio;
        if document.estimates_sigma() {
            return Self::Fit(
                document
                    .channels()
                    .map(|c| c.fit_percent)
                    .fold(100.0, f64::min),
            );
        }
        match document.model.cost_kind {
            CostKind::ChiSquare => Self::ChiSquare {
                misfit: document.cost.misfit,
                readings: document.experiments.iter().map(|e| e.readings as f64).sum(),
            },
            CostKind::EquationError => Self::Equation(ratio),
            CostKind::Integral | CostKind::Mixed => Self::Left {
                share: residual_share(run),
                ratio,
            },
        }
    }

    /// Whether it is matched. For a chi-square by the discrepancy rule: mean and twice the standard deviation.
    pub fn is_matched(&self) -> bool {
        match *self {
            Self::Fit(percent) => percent >= FITTED,
            Self::ChiSquare {
                misfit,
                readings: n,
            } => misfit <= n + 2.0 * (2.0 * n).sqrt(),
            Self::Equation(_) => false,
            Self::Left { share, .. } => share <= MATCHED,
        }
    }
}

impl fmt::Display for Match {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verb = match self.is_matched() {
            true => "matches the motion",
            false => "does not match the motion",
        };
        match self {
            Self::Fit(percent) => {
                write!(
                    f,
                    "{verb} (fit {percent:.1} %; its noise was estimated from it)"
                )
            }
            Self::ChiSquare { misfit, readings } => write!(
                f,
                "{verb} within its noise (chi-square {misfit:.0} of {readings} readings)"
            ),
            Self::Equation(ratio) => {
                write!(
                    f,
                    "fits the equation of motion, not a motion (J/J0 {ratio:.1e})"
                )
            }
            Self::Left { ratio, .. } if self.is_matched() => write!(f, "{verb} (J/J0 {ratio:.1e})"),
            Self::Left { share, ratio } => {
                write!(
                    f,
                    "{verb} (J/J0 {ratio:.1e}, {} of it is left)",
                    percent(*share)
                )
            }
        }
    }
}

/// The line: whether the motion is matched, and whether the device is the true one.
pub(super) fn verdict(matching: &Match, errors: Option<&TruthErrors>) -> String {
    let matched = matching.is_matched();
    let Some(errors) = errors else {
        return format!("{matching}; the truth is not known");
    };
    if errors.within(RECOVERED) {
        let mut text = format!(
            "the true device: k/m and c/m to {}",
            size(errors.worst_ratio())
        );
        if errors.mass_relative >= RECOVERED {
            let off = percent(errors.mass_relative);
            text += &format!(", but m, c and k off by a common factor (m by {off})");
        }
        return match matched {
            true => text,
            false => format!("{text}; {matching}"),
        };
    }
    let off = distances(errors);
    match (matched, errors.within(CLOSE)) {
        (_, true) if errors.mass_relative >= CLOSE => format!(
            "close to the true device in k/m and c/m: {off}; m, c and k off by a common factor (m by \
             {}); {matching}",
            percent(errors.mass_relative)
        ),
        (_, true) => format!("close to the true device: {off}; {matching}"),
        (true, false) => format!("{matching} but is another device: {off}"),
        (false, false) => format!("{matching}; another device: {off}"),
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

/// How far `k/m` and `c/m` are from the truth; only the one that is off, if the other is not.
fn distances(errors: &TruthErrors) -> String {
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
