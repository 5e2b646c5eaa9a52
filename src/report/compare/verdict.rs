//! Summary of a run in one line: fit of the response, and agreement with the true system.

use super::run::ComparedRun;
use super::{CLOSE, MATCHED, ROUNDING};
use crate::report::cost::CostKind;
use kmcfit_core::internals::assessment::{RECOVERY_TOLERANCE, TruthErrors};
use std::fmt;

/// Smallest fit, per cent, of a response that counts as fitted, if sigma was estimated.
const FITTED: f64 = 90.0;

/// Agreement of a fitted system with the true one, by the errors of k/m and c/m: the same thresholds for verdicts, conclusions and headline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Agreement {
    /// Below [`RECOVERY_TOLERANCE`].
    Recovered,
    /// Below [`CLOSE`].
    Close,
    /// Above.
    Different,
}

impl Agreement {
    pub fn of(errors: &TruthErrors) -> Self {
        match errors {
            e if e.within(RECOVERY_TOLERANCE) => Self::Recovered,
            e if e.within(CLOSE) => Self::Close,
            _ => Self::Different,
        }
    }

    /// True if the error of the mass, the scale, is below the same threshold.
    pub fn has_scale(self, errors: &TruthErrors) -> bool {
        errors.mass_relative
            < match self {
                Self::Recovered => RECOVERY_TOLERANCE,
                Self::Close | Self::Different => CLOSE,
            }
    }
}

/// Fit of the measured response.
pub(super) enum ResponseFit {
    /// Fit of the worst channel, per cent. Sigma was estimated, so chi-square carries no information.
    Fit(f64),
    /// Chi-square and number of samples.
    ChiSquare { misfit: f64, samples: f64 },
    /// `J/J0` of the equation error; no response was simulated.
    Equation(f64),
    /// Root-mean-square residual over root-mean-square sample, and `J/J0`.
    Residual { share: f64, ratio: f64 },
}

impl ResponseFit {
    /// The fit of a run.
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
                samples: document.experiments.iter().map(|e| e.samples as f64).sum(),
            },
            CostKind::EquationError => Self::Equation(ratio),
            CostKind::Integral | CostKind::Mixed => Self::Residual {
                share: residual_share(run),
                ratio,
            },
        }
    }

    /// True if the response counts as fitted: a chi-square by the discrepancy rule: at most its mean plus twice its standard
    /// deviation.
    pub fn is_matched(&self) -> bool {
        match *self {
            Self::Fit(percent) => percent >= FITTED,
            Self::ChiSquare { misfit, samples: n } => misfit <= n + 2.0 * (2.0 * n).sqrt(),
            Self::Equation(_) => false,
            Self::Residual { share, .. } => share <= MATCHED,
        }
    }
}

impl fmt::Display for ResponseFit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verb = match self.is_matched() {
            true => "response fitted",
            false => "response not fitted",
        };
        match self {
            Self::Fit(percent) => {
                write!(f, "{verb} (fit {percent:.1} %, sigma estimated)")
            }
            Self::ChiSquare { misfit, samples } => write!(
                f,
                "{verb} within the noise (chi-square {misfit:.0} for {samples} samples)"
            ),
            Self::Equation(ratio) => {
                write!(
                    f,
                    "equation error fitted, no response simulated (J/J0 {ratio:.1e})"
                )
            }
            Self::Residual { ratio, .. } if self.is_matched() => {
                write!(f, "{verb} (J/J0 {ratio:.1e})")
            }
            Self::Residual { share, ratio } => {
                write!(
                    f,
                    "{verb} (J/J0 {ratio:.1e}, rms residual {} of the rms response)",
                    percent(*share)
                )
            }
        }
    }
}

/// The line: fit of the response and, if the true system is known, the errors of k/m, c/m and m.
pub(super) fn verdict(response: &ResponseFit, errors: Option<&TruthErrors>) -> String {
    let matched = response.is_matched();
    let Some(errors) = errors else {
        return format!("{response}; true system not known");
    };
    let agreement = Agreement::of(errors);
    if agreement == Agreement::Recovered {
        let mut text = match errors.relative_to_critical {
            true => format!(
                "true system recovered: k/m within {} of its largest value, c/m within {} of critical damping",
                size(errors.k_over_m_relative),
                size(errors.c_over_m_relative)
            ),
            false => format!(
                "true system recovered: relative error of k/m and c/m at most {}",
                size(errors.largest_ratio_error())
            ),
        };
        if !agreement.has_scale(errors) {
            let off = percent(errors.mass_relative);
            text += &format!("; m, c and k are scaled by a common factor (error of m {off})");
        }
        return match matched {
            true => text,
            false => format!("{text}; {response}"),
        };
    }
    let off = distances(errors);
    match (matched, agreement == Agreement::Close) {
        (_, true) if !agreement.has_scale(errors) => format!(
            "close to the true system in k/m and c/m: {off}; m, c and k are scaled by a common factor (error of m \
             {}); {response}",
            percent(errors.mass_relative)
        ),
        (_, true) => format!("close to the true system: {off}; {response}"),
        (true, false) => format!("{response}, but not by the true system: {off}"),
        (false, false) => format!("{response}; not the true system: {off}"),
    }
}

/// Root-mean-square residual over root-mean-square sample, the largest of all records.
fn residual_share(run: &ComparedRun) -> f64 {
    let squares = |f: &[f64]| f.iter().map(|x| x * x).sum::<f64>();
    let shares = run.responses.iter().map(|response| {
        let left = squares(&response.residual);
        if left == 0.0 {
            0.0
        } else {
            (left / squares(&response.observed)).sqrt()
        }
    });
    shares.fold(0.0, f64::max)
}

/// Errors of `k/m` and `c/m` that exceed the tolerance.
fn distances(errors: &TruthErrors) -> String {
    let stiffness = format!("error of k/m {}", percent(errors.k_over_m_relative));
    let of = if errors.relative_to_critical {
        " of critical damping"
    } else {
        ""
    };
    let damping = format!("error of c/m {}{of}", percent(errors.c_over_m_relative));
    if errors.c_over_m_relative < RECOVERY_TOLERANCE {
        stiffness
    } else if errors.k_over_m_relative < RECOVERY_TOLERANCE {
        damping
    } else {
        format!("{stiffness}, {damping}")
    }
}

/// A small number with two digits; with one if it is at the level of rounding errors.
fn size(x: f64) -> String {
    match x < ROUNDING {
        _ if x == 0.0 => "0".into(),
        true => format!("{x:.0e}"),
        false => format!("{x:.1e}"),
    }
}

/// A ratio as a percentage with two or three digits.
pub(super) fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    match percent {
        _ if !percent.is_finite() => "unbounded".into(),
        p if p >= 1e4 => format!("a factor of {share:.0e}"),
        p if p >= 10.0 => format!("{p:.0} %"),
        p if p >= 1.0 => format!("{p:.1} %"),
        p => format!("{p:.2} %"),
    }
}
