//! Refits of the most promising candidates.

use super::addition::{Addition, Family};
use super::columns::LinearCandidate;
use super::early;
use super::found::{Found, plain};
use super::jump;
use super::penalised_misfit::{Judged, Linearised};
use super::predictions;
use super::{COLOURED, GAIN};
use crate::alternatives::{Clock, RecordParameter, Refit, on_best_clock, with_samples_of};
use crate::problem::Problem;
use crate::simd::sum::rms;
use crate::threads::{analyses_at_once, map};

/// Number of candidates with the lowest penalised misfit, and with the least squares, that are refitted.
const LOWEST: usize = 3;
const LEAST_SQUARES: usize = 2;
/// Most refits.
const MOST: usize = 12;
/// Degrees of the polynomials of a function that varies, each refitted from the one before.
const DEGREES: [usize; 4] = [1, 2, 4, 8];
/// Most halvings of the intervals of a basis.
const MOST_HALVINGS: usize = 3;

/// Refits of the most promising candidates, and in free decays of pairs.
pub(super) fn refits(
    problem: &Problem,
    theta: &[f64],
    own: &Judged,
    linear: &[LinearCandidate],
) -> Vec<Found> {
    let chosen = chosen(problem, own, linear);
    let found = map(
        chosen.len(),
        analyses_at_once(problem.sample_count()),
        |i| refitted(problem, theta, own, chosen[i]),
    );
    let mut found: Vec<Found> = found.into_iter().flatten().collect();
    let is_free = problem.experiments.iter().all(|e| e.is_free());
    if is_free && own.order >= COLOURED {
        let mut pairs = pairs(problem, theta, &found, linear);
        // What the second of a pair adds is judged as what the first does.
        pairs.retain(|pair| {
            let has = |single: &&Found| {
                pair.additions
                    .iter()
                    .any(|a| a.is_like(single.additions[0]))
            };
            let mut singles = found.iter().filter(has);
            singles.all(|single| single.judged.misfit - pair.judged.misfit >= GAIN)
        });
        found.extend(pairs);
    }
    found
}

/// Refits of a change of the restoring force together with one of the damping, each from the refit of the first and from the constants: where both
/// are large, the right one alone leaves residuals that hide it.
fn pairs(
    problem: &Problem,
    theta: &[f64],
    found: &[Found],
    linear: &[LinearCandidate],
) -> Vec<Found> {
    let is_of = |addition: Addition, family: Family| addition.family(problem) == family;
    let elastic = found
        .iter()
        .filter(|f| is_of(f.additions[0], Family::Elastic));
    let elastic = elastic.filter_map(|found| {
        let addition = found.additions[0];
        let (changed, start) = addition.added(problem, theta, &[0.0])?;
        Some((addition, changed, [found.theta.clone(), start]))
    });
    let elastic: Vec<_> = elastic.collect();
    let dissipative = linear
        .iter()
        .filter(|c| is_of(c.addition, Family::Dissipative));
    let dissipative: Vec<&LinearCandidate> = dissipative.collect();
    let count = elastic.len() * dissipative.len();
    let found = map(count, analyses_at_once(problem.sample_count()), |i| {
        let (first, changed, starts) = &elastic[i / dissipative.len()];
        let second = dissipative[i % dissipative.len()];
        let from = starts.iter().filter_map(|start| {
            let refit = plain(changed, start, second.addition, second.further())?;
            Some(Found {
                additions: vec![*first, second.addition],
                parameters: refit.parameters + changed.parameters() - problem.parameters(),
                ..refit
            })
        });
        from.min_by(|a, b| a.judged.misfit.total_cmp(&b.judged.misfit))
    });
    found.into_iter().flatten().collect()
}

/// The candidates with the lowest penalised misfit and the least squares, with their families.
fn chosen<'a>(
    problem: &Problem,
    own: &Judged,
    linear: &'a [LinearCandidate],
) -> Vec<&'a LinearCandidate> {
    let mut by_misfit: Vec<&LinearCandidate> = linear.iter().collect();
    by_misfit.sort_by(|a, b| a.judged.misfit.total_cmp(&b.judged.misfit));
    let mut by_squares = by_misfit.clone();
    by_squares.sort_by(|a, b| a.judged.squares.total_cmp(&b.judged.squares));
    let firsts = by_misfit
        .iter()
        .take(LOWEST)
        .chain(by_squares.iter().take(LEAST_SQUARES));
    let firsts: Vec<&LinearCandidate> = firsts.copied().collect();
    let mut families: Vec<Family> = firsts.iter().map(|c| c.addition.family(problem)).collect();
    if own.order >= COLOURED {
        families.push(Family::Elastic);
    }
    let of_families = by_misfit.iter().copied();
    let of_families = of_families.filter(|c| families.contains(&c.addition.family(problem)));
    let mut all: Vec<&LinearCandidate> = Vec::new();
    for candidate in firsts.into_iter().chain(of_families) {
        if !all
            .iter()
            .any(|known| known.addition.is_like(candidate.addition))
        {
            all.push(candidate);
        }
    }
    all.truncate(MOST);
    all
}

fn refitted(
    problem: &Problem,
    theta: &[f64],
    own: &Judged,
    candidate: &LinearCandidate,
) -> Option<Found> {
    let addition = candidate.addition;
    let further = candidate.further();
    match addition {
        Addition::Variation { function, .. } => ladder(problem, theta, function),
        Addition::FinerBasis { function, .. } => halved(problem, theta, function),
        Addition::Jump { function, time } => {
            jump::refit(problem, theta, function, time, *further.first()?)
        }
        Addition::Record(parameter @ RecordParameter::Rate(_)) => {
            clock(problem, theta, own, parameter, *further.first()?)
        }
        Addition::SensorCurve {
            experiment,
            channel,
        }
        | Addition::Tone {
            experiment,
            channel,
            ..
        }
        | Addition::SecondMode {
            experiment,
            channel,
            ..
        } => predictions::refit(problem, theta, addition, (experiment, channel)),
        _ => plain(problem, theta, addition, further),
    }
}

/// Refits with polynomials of higher and higher degree, as long as these are better; where they leave residuals far from white also from the
/// beginning of the record on.
fn ladder(problem: &Problem, theta: &[f64], function: usize) -> Option<Found> {
    let most = 0.5 * periods(problem, theta);
    let best = climb(problem, theta, &[0.0], function, &DEGREES, most);
    if best
        .as_ref()
        .is_some_and(|best| best.judged.order < COLOURED)
    {
        return best;
    }
    let lowest = &DEGREES[1..];
    let degree = lowest[0];
    let addition = variation(function, degree, most);
    let from_beginning = || {
        let quarter = early::of_first_quarter(problem, theta)?;
        let (changed, start) = addition.added(problem, &quarter, &[0.0])?;
        let half = early::of_first_half(&changed, &start)?;
        let range = problem.functions.ranges()[function].clone();
        let further = half[range.start + 1..=range.start + degree].to_vec();
        let theta = [&half[..=range.start], &half[range.start + 1 + degree..]].concat();
        climb(problem, &theta, &further, function, lowest, most)
    };
    let both = best.into_iter().chain(from_beginning());
    both.min_by(|a, b| a.judged.misfit.total_cmp(&b.judged.misfit))
}

/// A function that varies, of at most this degree; a degree of 2 needs no more.
fn variation(function: usize, degree: usize, most: f64) -> Addition {
    let is_slow = degree == 1 || (2 * degree) as f64 <= most;
    Addition::Variation {
        function,
        degree,
        next: if is_slow { 2 * degree } else { degree },
    }
}

/// Refits with finer and finer bases, as long as these are better.
fn halved(problem: &Problem, theta: &[f64], function: usize) -> Option<Found> {
    let mut best: Option<Found> = None;
    for halvings in 1..=MOST_HALVINGS {
        let addition = Addition::FinerBasis { function, halvings };
        let Some(found) = plain(problem, theta, addition, &[]) else {
            break;
        };
        if best
            .as_ref()
            .is_some_and(|best| found.judged.misfit >= best.judged.misfit)
        {
            break;
        }
        best = Some(found);
    }
    best
}

/// Refits with polynomials of these degrees from parameters of the problem and the polynomial.
fn climb(
    problem: &Problem,
    theta: &[f64],
    further: &[f64],
    function: usize,
    degrees: &[usize],
    most: f64,
) -> Option<Found> {
    let first = problem.functions.ranges()[function].start;
    let (mut theta, mut further) = (theta.to_vec(), further.to_vec());
    let mut best: Option<Found> = None;
    for &degree in degrees {
        if degree > 1 && degree as f64 > most {
            break;
        }
        let addition = variation(function, degree, most);
        let Some(found) = plain(problem, &theta, addition, &further) else {
            break;
        };
        further = found.theta[first + 1..=first + degree].to_vec();
        theta = [&found.theta[..=first], &found.theta[first + 1 + degree..]].concat();
        let is_better = (best.as_ref()).is_none_or(|best| found.judged.misfit < best.judged.misfit);
        if !is_better && degree > 2 {
            break;
        }
        if is_better {
            best = Some(found);
        }
    }
    best
}

/// Periods of the natural frequency in the longest record.
fn periods(problem: &Problem, theta: &[f64]) -> f64 {
    let Ok(evaluation) = problem.evaluate(theta) else {
        return 0.0;
    };
    let of_record = evaluation.trajectories.iter().map(|response| {
        let [y, v] = [response.displacement(0), response.velocity(0)].map(|x| {
            let mean = x.iter().sum::<f64>() / x.len() as f64;
            rms(&x.iter().map(|x| x - mean).collect::<Vec<f64>>())
        });
        v / y * problem.system.grid.step() * response.nodes() as f64 / std::f64::consts::TAU
    });
    of_record.filter(|p| p.is_finite()).fold(0.0, f64::max)
}

/// Refit with the clock of a response at another rate, beside a refit of the model to the samples that the other clock leaves in the record.
fn clock(
    problem: &Problem,
    theta: &[f64],
    own: &Judged,
    parameter: RecordParameter,
    rate: f64,
) -> Option<Found> {
    let RecordParameter::Rate(e) = parameter else {
        return None;
    };
    let (clock, refit) = on_best_clock(problem, theta, parameter, Clock { delay: 0.0, rate })?;
    let mut judged = Linearised::at(&refit.problem, refit.evaluation()).own();
    let left = Refit::of(with_samples_of(problem, e, clock)?, theta)?;
    let beside = Linearised::at(&left.problem, left.evaluation()).own();
    let price = (problem.sample_count() as f64).ln();
    judged.misfit += own.misfit - beside.misfit + price;
    Some(Found {
        additions: vec![Addition::Record(parameter)],
        judged,
        theta: [&refit.fit.best.parameters[..], &[clock.rate]].concat(),
        named: Vec::new(),
        parameters: 1,
    })
}
