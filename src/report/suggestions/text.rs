//! Texts of the suggestions.

use super::{Suggestion, Suspect, percent};
use crate::number_format::{significant, times_in_words};
use kmcfit_core::internals::assessment::ResidualPattern;
use kmcfit_core::internals::functions::CoefficientKind;
use kmcfit_core::internals::solvers::Solver;
use std::fmt;

impl fmt::Display for Suggestion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Suggestion::MoreIterations => {
                f.write_str("iteration limit reached: raise it with fit.stop.iterations")
            }
            Suggestion::MoreTime => {
                f.write_str("time limit reached: raise it with fit.stop.seconds")
            }
            Suggestion::Resume => f.write_str("continue this fit with `kmcfit resume`"),
            Suggestion::AnotherMethod => {
                let newton = Solver::GaussNewton.name();
                write!(f, "the search stalled: use fit.method={newton}")
            }
            Suggestion::AnotherStart => f.write_str(
                "use another starting point (fit.initial=data, or other `start` values) or soft constraints (`soft`)",
            ),
            Suggestion::FinerSteps { automatic: true } => {
                f.write_str("the time step is too coarse: use grid.nodes=auto")
            }
            Suggestion::FinerSteps { automatic: false } => {
                f.write_str("the time step is too coarse: use more nodes (grid.nodes)")
            }
            Suggestion::Pattern {
                channel,
                has_sigma,
                pattern,
            } => write_pattern(f, channel, *has_sigma, pattern),
            Suggestion::LargerSigma { times, fit } => write!(
                f,
                "sigma is too small: the residuals are {} times sigma although the fit is {}; use `sigma: estimate`",
                times_in_words(*times),
                percent(*fit, 2)
            ),
            Suggestion::NoiseLimited { channel, fit } => write!(
                f,
                "{channel}: fit {}, but the residuals have no significant autocorrelation: measurement noise limits the fit, not the model",
                percent(*fit, 0)
            ),
            Suggestion::OutliersLimited { channel, fit } => write!(
                f,
                "{channel}: outliers cause the low fit of {}; the robust loss limits their influence on the estimates",
                percent(*fit, 0)
            ),
            Suggestion::Mismatch {
                channel,
                fit,
                start_from_data,
                suspect,
                absent,
                without_sigma,
            } => {
                write_fit(f, channel.as_ref(), *fit)?;
                if *start_from_data {
                    f.write_str("start from the record (fit.initial=data), or ")?;
                }
                write_suspect(f, suspect, &more_parameters(absent, *without_sigma))
            }
            Suggestion::StateInputSigma { input, sigma } => write!(
                f,
                "check the interpolation of the {quantity}; state its errors: `sigma: {{{input}: {{value: {}, kind: sensor}}}}` for noise of its sensor, `kind: drive` for an unmeasured drive; or add a missing force term",
                significant(*sigma, 2),
                quantity = input.replace('_', " ")
            ),
            Suggestion::AddTerm { term, start } => {
                let width = match term {
                    CoefficientKind::CoulombFriction => ", width: auto",
                    _ => "",
                };
                write!(
                    f,
                    "add the missing term: `{}: {{basis: constant, start: {}{width}}}` under `functions`",
                    term.name(),
                    significant(*start, 3)
                )
            }
            Suggestion::SecondAmplitude => f.write_str(
                "measure a record at a second amplitude (half or twice) and fit both: it shows whether the coefficients depend on time or on amplitude",
            ),
            Suggestion::EstimateOffset {
                channel,
                experiment,
                or_static_force,
            } => {
                write!(
                    f,
                    "{channel} of {experiment}: estimate the offset of the sensor (`sensors: {{{channel}: {{offset: estimate}}}}`)"
                )?;
                match or_static_force {
                    true => f.write_str(
                        " or, nearly equivalent, a static force (`static_force: {basis: constant, start: 0.0}` under `functions`)",
                    ),
                    false => Ok(()),
                }
            }
            Suggestion::ScaleChannel { channel, factor } => write!(
                f,
                "correct the unit of the {channel} or of the other channels and the input (`units`), or state the gain of its sensor: `sensors: {{{channel}: {{gain: {}}}}}`",
                significant(*factor, 4)
            ),
            Suggestion::ReverseInput {
                experiment,
                channels,
            } => {
                let each: Vec<String> = (channels.iter())
                    .map(|channel| format!("{channel}: {{gain: -1}}"))
                    .collect();
                write!(
                    f,
                    "reverse the sign of the input of {experiment} in its file, or that of the response: `sensors: {{{}}}`",
                    each.join(", ")
                )
            }
            Suggestion::EstimateDelay {
                experiment,
                channel,
                delay,
                held,
            } => {
                let estimate = format!("`sensors: {{{channel}: {{delay: estimate}}}}`");
                match held {
                    Some(true) => write!(
                        f,
                        "half a sample is the lag under an input of {experiment} that is held between its samples (`interpolation: hold`); for another delay: {estimate}"
                    ),
                    Some(false) => write!(
                        f,
                        "half a sample is the lead under an input of {experiment} that is not held between its samples (`interpolation: linear`); for another delay: {estimate}"
                    ),
                    None => write!(
                        f,
                        "estimate the delay of the {} of {experiment}: {estimate}, about {} s",
                        channel.replace('_', " "),
                        significant(*delay, 3)
                    ),
                }
            }
            Suggestion::ScaleTimes {
                experiment,
                percent,
            } => write!(
                f,
                "put input and response of {experiment} on one clock in the file: multiply the times of the response by {}",
                significant(1.0 + 0.01 * percent, 6)
            ),
            Suggestion::NarrowFriction => f.write_str(
                "reduce the width of Coulomb friction until the estimates do not depend on it: `width: auto`, with an automatic grid",
            ),
            Suggestion::FinerBasis {
                function,
                without_sigma,
            } => write!(
                f,
                "let the {function} vary more freely ({}); an error of the input and a missing force term, too, appear as a coefficient that varies",
                spline(*without_sigma)
            ),
            Suggestion::Constant { function, p_value } => write!(
                f,
                "a constant {function} is not rejected (Wald test, p = {}): use `basis: constant` without `knots` and `penalty`",
                significant(*p_value, 1)
            ),
            Suggestion::StudyUnidentifiable { can_be_simpler, .. } => {
                if *can_be_simpler {
                    f.write_str("use fewer parameters (`knots`) or add a `penalty`; ")?;
                }
                f.write_str("`kmcfit study` lists the identifiable parameter combinations")
            }
        }
    }
}

/// The channel and its poor fit.
fn write_fit(
    f: &mut fmt::Formatter<'_>,
    channel: Option<&(String, String)>,
    fit: f64,
) -> fmt::Result {
    if let Some((channel, record)) = channel {
        write!(f, "{channel} of {record}: ")?;
    }
    write!(f, "poor fit ({}): ", percent(fit, 0))
}

/// The likeliest cause, or else more parameters.
fn write_suspect(f: &mut fmt::Formatter<'_>, suspect: &Suspect, more: &str) -> fmt::Result {
    let (input, start_is_given) = match suspect {
        Suspect::Functions => return f.write_str(more),
        Suspect::UnknownForce => {
            return write!(
                f,
                "{more}; if an unmeasured force acts, fit the equation of motion instead (fit.method=equation-error)"
            );
        }
        Suspect::Input {
            is_base: true,
            start_is_given,
        } => ("the base motion", start_is_given),
        Suspect::Input { start_is_given, .. } => ("the force", start_is_given),
    };
    let start = match start_is_given {
        true => ", and the initial state (`initial: estimate`)",
        false => "",
    };
    write!(
        f,
        "check sign (`gain: -1` of a sensor reverses it), unit and times of {input}{start}; or {more}"
    )
}

/// More parameters of the functions, and the terms that the model lacks.
fn more_parameters(absent: &[&str], without_sigma: bool) -> String {
    let functions = format!("let a coefficient vary ({})", spline(without_sigma));
    let terms = absent
        .join(", ")
        .replace("friction", "friction with its width");
    match absent.is_empty() {
        true => functions,
        false => format!("{functions} or add a force term ({terms})"),
    }
}

/// A spline with automatic knots, which need a sigma in every experiment.
fn spline(without_sigma: bool) -> &'static str {
    match without_sigma {
        true => "`basis: b-spline`, `knots: auto`, with `sigma` in every experiment",
        false => "`basis: b-spline`, `knots: auto`",
    }
}

fn write_pattern(
    f: &mut fmt::Formatter<'_>,
    channel: &str,
    has_sigma: bool,
    pattern: &ResidualPattern,
) -> fmt::Result {
    match pattern {
        ResidualPattern::Outliers { samples, first } => {
            match samples {
                1 => write!(f, "{channel}: one outlier, at {first} s")?,
                _ => write!(f, "{channel}: {samples} outliers, the first at {first} s")?,
            }
            let sigma = match has_sigma {
                true => "",
                false => ", with `sigma`",
            };
            write!(
                f,
                ": use a robust loss (`loss: {{{channel}: huber}}`{sigma})"
            )
        }
        ResidualPattern::Offset => write!(
            f,
            "{channel}: the residuals have an offset: estimate it (`sensors: {{{channel}: {{offset: estimate}}}}`)"
        ),
        ResidualPattern::Tone { frequency, beside } => {
            let end = if frequency > beside { "max" } else { "min" };
            write!(
                f,
                "{channel}: the residuals oscillate at {} Hz, the response at {} Hz (mains hum or another mode): restrict \
                 the frequency band (`band` with a `{end}` between the two)",
                significant(*frequency, 3),
                significant(*beside, 3)
            )
        }
        ResidualPattern::Drift => write!(
            f,
            "{channel}: the residuals drift: estimate offset and drift (`sensors: {{{channel}: {{offset: estimate, drift: \
             estimate}}}}`)"
        ),
    }
}
