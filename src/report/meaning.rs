//! Whether what a fit came to is a device to speak of, and the only one of its kind.

use super::measured::{HalfStep, StatisticsSummary};
use crate::diagnostics::fit_percent;
use crate::dynamics::{Excitation, Term};
use crate::objective::{Channel, Evaluation};
use crate::problem::Problem;
use std::f64::consts::TAU;

/// Half the step may change the model's readings by this share of the largest one; if by more, what was fitted is
/// the stepper, and not the device.
const STEPPER: f64 = 0.1;
/// A fit is absurd that misses all channels by more than twice what their readings vary, per cent. Outliers that
/// a robust loss leaves aside cannot bring it below -42 %.
const ABSURD: f64 = -100.0;
/// Residuals may be this many times sigma before nothing is made of sigma any more.
const BEYOND_SIGMA: f64 = 3.0;
/// Two and a half readings a period: from there on the frequency is near to that of its first alias.
const PERIODS_PER_READING: f64 = 0.4;
/// Equally spaced readings are no further from their places than this part of the spacing.
const EVEN: f64 = 0.01;

/// Why no statement on the functions means anything; `None` where they may.
pub(super) fn meaningless(
    problem: &Problem,
    evaluation: &Evaluation,
    half_step: &HalfStep,
) -> Option<String> {
    match half_step {
        Err(breakdown) => return Some(format!("on half the step there is no motion: {breakdown}")),
        Ok(Some(half)) if half.change_per_reading > STEPPER => {
            return Some(
                "on half the step the model's readings change by more than a tenth of the largest one"
                    .into(),
            );
        }
        Ok(_) => {}
    }
    let predictions = evaluation.predictions.iter().flatten();
    let mut fits = (problem.channels().zip(predictions))
        .map(|(channel, predicted)| fit_percent(channel.observed(), predicted))
        .peekable();
    let absurd = fits.peek().is_some() && fits.all(|fit| fit < ABSURD);
    absurd.then(|| "its motion misses the readings by more than twice what they vary".into())
}

/// What is said where the residuals are larger than the readings' sigma allows: the errors of all functions are then
/// too small. `None` where they are not, or nobody gave a sigma.
pub(super) fn unexplained(statistics: &StatisticsSummary) -> Option<String> {
    let times = statistics.reduced_chi_square?.sqrt();
    (times > BEYOND_SIGMA).then(|| {
        format!(
            "how sure the functions are is not known: the residuals are {times:.1} times sigma, so the device does not \
             explain the readings, or sigma is too small"
        )
    })
}

/// What is said of a device that swings so fast that its readings are those of other devices as well; `None` where they
/// are not. Equally spaced readings of one kind of a free motion of frequency `f` are those of one of `1/spacing - f`;
/// uneven ones, a force, or a second kind of reading tell them apart.
pub(super) fn aliased(problem: &Problem, evaluation: &Evaluation) -> Option<String> {
    let mut channels = problem.channels();
    let first = channels.next()?;
    let spacing = spacing(first)?;
    let alike = |c: &Channel| {
        let same = self::spacing(c).is_some_and(|s| (s - spacing).abs() <= EVEN * spacing);
        c.kind() == first.kind() && same
    };
    let driven =
        |excitation: &Option<Excitation>| excitation.as_ref().is_some_and(|e| !e.is_zero());
    let mut experiments = problem.experiments.iter();
    if !channels.all(alike) || experiments.any(|e| driven(&e.excitation)) {
        return None;
    }
    let place = problem
        .oscillator
        .terms
        .iter()
        .position(|term| *term == Term::Stiffness)?;
    let device = &evaluation.device;
    let pairs = device.mass.iter().zip(&device.coefficients[place]);
    let fastest = pairs.map(|(m, k)| k / m).fold(0.0, f64::max).sqrt() / TAU;
    (fastest * spacing > PERIODS_PER_READING).then(|| {
        format!(
            "which of several frequencies it is, is not identified: with {:.1} readings in a period of {fastest:.3} Hz \
             its aliases match as well; read more often, or at uneven times",
            1.0 / (fastest * spacing)
        )
    })
}

/// The spacing of equally spaced readings, s.
fn spacing(channel: &Channel) -> Option<f64> {
    let times = channel.times();
    let spacing = (times.last()? - times.first()?) / (times.len().checked_sub(1)? as f64);
    let even = |(i, t): (usize, &f64)| (t - times[0] - i as f64 * spacing).abs() <= EVEN * spacing;
    (spacing > 0.0 && times.iter().enumerate().all(even)).then_some(spacing)
}
