//! Wording of the recommendations.

use super::{Advice, Suspect, percent};
use crate::digits::significant;
use kmcfit_core::internals::assessment::ResidualPattern;
use kmcfit_core::internals::solvers::Solver;
use std::fmt;

impl fmt::Display for Advice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Advice::MoreIterations(iterations) => {
                write!(f, "the iterations ran out: fit.stop.iterations={iterations}")
            }
            Advice::MoreTime => f.write_str("the time ran out: a larger fit.stop.seconds"),
            Advice::Resume => f.write_str("`kmcfit resume` goes on with this fit"),
            Advice::AnotherMethod => {
                let newton = Solver::GaussNewton.name();
                write!(f, "the search is stuck: fit.method={newton}")
            }
            Advice::AnotherStart => f.write_str(
                "start elsewhere: fit.initial=data, or other start values; soften constraints (soft)",
            ),
            Advice::FinerSteps(nodes) => write!(f, "the steps are coarse: grid.nodes={nodes}"),
            Advice::Pattern {
                kind,
                has_sigma,
                pattern,
            } => write_pattern(f, kind, *has_sigma, pattern),
            Advice::LargerSigma { times, fit } => write!(
                f,
                "the residuals are {times:.1} times sigma, and the readings are matched to {}: sigma is too small (sigma: \
                 estimate)",
                percent(*fit, 2)
            ),
            Advice::NoneBetter {
                kind,
                fit,
                is_white,
            } => {
                let left = match is_white {
                    true => "looks like noise",
                    false => "is nearly noise",
                };
                let fit = percent(*fit, 0);
                write!(
                    f,
                    "the {kind} is matched to {fit} only, but what is left {left}: no other device would do much better"
                )
            }
            Advice::Mismatch {
                channel,
                fit,
                from_readings,
                suspect,
                absent,
            } => {
                write_matched(f, channel.as_ref(), *fit)?;
                if *from_readings {
                    f.write_str("start from the readings (fit.initial=data), or ")?;
                }
                write_suspect(f, suspect, &more_freedom(absent))
            }
            Advice::MoreFreedom { absent } => {
                write!(f, "the residuals have a pattern: {}", more_freedom(absent))
            }
            Advice::Constant { function, p_value } => write!(
                f,
                "a constant {function} would match as well (p = {}): basis: constant",
                significant(*p_value, 1)
            ),
            Advice::StudyOfHidden {
                parameters: [of, seen],
                can_be_simpler,
            } => {
                write!(f, "{of} free values, {seen} of them visible at most: ")?;
                if *can_be_simpler {
                    f.write_str("fewer (knots), or add a `penalty`; ")?;
                }
                f.write_str("`kmcfit study` tells which are seen")
            }
            Advice::Study => f.write_str(
                "`kmcfit study` tells how sure each function is, and with `study.candidates` which experiment would show most",
            ),
        }
    }
}

/// How well a channel is matched that is hardly matched.
fn write_matched(
    f: &mut fmt::Formatter<'_>,
    channel: Option<&(String, String)>,
    fit: f64,
) -> fmt::Result {
    match channel {
        None => f.write_str("the readings are")?,
        Some((kind, record)) => write!(f, "the {kind} of {record} is")?,
    }
    write!(f, " matched to {} only: ", percent(fit, 0))
}

/// The suspect, and else what gives the functions more freedom.
fn write_suspect(f: &mut fmt::Formatter<'_>, suspect: &Suspect, freedom: &str) -> fmt::Result {
    let (drive, start_is_given) = match suspect {
        Suspect::Functions => return f.write_str(freedom),
        Suspect::UnknownForce => {
            return write!(
                f,
                "{freedom}, or, if something unknown keeps it moving, compare accelerations instead of motions \
                 (fit.method=equation-error)"
            );
        }
        Suspect::Drive {
            is_base: true,
            start_is_given,
        } => ("the motion of the base", start_is_given),
        Suspect::Drive { start_is_given, .. } => ("the force", start_is_given),
    };
    let start = match start_is_given {
        true => ", and the motion the right start (initial: estimate)",
        false => "",
    };
    write!(
        f,
        "look whether {drive} has the right sign (`gain: -1` of a sensor turns it), unit and times{start}; or {freedom}"
    )
}

/// Functions that change more, and terms that the model does not have.
fn more_freedom(absent: &[&str]) -> String {
    let functions = "let a function change more (basis: piecewise-linear, more knots)";
    let terms = absent
        .join(", ")
        .replace("friction", "friction with its width");
    match absent.is_empty() {
        true => functions.into(),
        false => format!("{functions}, or add a term ({terms})"),
    }
}

fn write_pattern(
    f: &mut fmt::Formatter<'_>,
    kind: &str,
    has_sigma: bool,
    pattern: &ResidualPattern,
) -> fmt::Result {
    match pattern {
        ResidualPattern::Outliers {
            samples: readings,
            first,
        } => {
            match readings {
                1 => write!(f, "one reading of the {kind} lies far off, at {first} s")?,
                _ => write!(
                    f,
                    "{readings} readings of the {kind} lie far off, the first at {first} s"
                )?,
            }
            let sigma = match has_sigma {
                true => "",
                false => ", with `sigma`",
            };
            write!(
                f,
                ": a robust loss (loss: {{{kind}: huber}}{sigma}) in the experiment"
            )
        }
        ResidualPattern::Offset => write!(
            f,
            "the residuals of the {kind} have an offset: sensors: {{{kind}: {{offset: estimate}}}} in the experiment"
        ),
        ResidualPattern::Tone { frequency, beside } => {
            let end = if frequency > beside { "max" } else { "min" };
            write!(
                f,
                "the residuals of the {kind} swing at {} Hz, the readings at {}: of a hum or another mode a band leaves \
                 little (band: {{{end}: {}}}) in the experiment",
                significant(*frequency, 3),
                significant(*beside, 3),
                significant((frequency * beside).sqrt(), 2)
            )
        }
        ResidualPattern::Drift => write!(
            f,
            "the residuals of the {kind} drift: sensors: {{{kind}: {{offset: estimate, drift: estimate}}}} in the \
             experiment"
        ),
    }
}
