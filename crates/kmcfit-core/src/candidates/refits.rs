//! Refits of the most promising candidates.

use super::addition::{Addition, Family};
use super::columns::{LinearCandidate, mode_columns};
use super::early;
use super::estimates::estimates;
use super::jump;
use super::penalised_misfit::{Judged, Linearised};
use super::second_mode::{Mode, ModeSamples};
use super::{COLOURED, Candidate};
use crate::assessment::{
    Clock, RecordColumns, RecordParameter, Refit, on_best_clock, with_samples_of,
};
use crate::problem::Problem;
use crate::simd::sum::rms;
use crate::threads::{analyses_at_once, map};
use nalgebra::DVector;

/// Number of candidates with the lowest penalised misfit, and with the least squares, that are refitted.
const LOWEST: usize = 3;
const LEAST_SQUARES: usize = 2;
/// Most refits.
const MOST: usize = 12;
/// Iteration limit of a refit: those that explain the residuals take at most half as many, others approach a poor minimum in small steps.
const ITERATIONS: u64 = 40;
/// Degrees of the polynomials of a function that varies, each refitted from the one before.
const DEGREES: [usize; 4] = [1, 2, 4, 8];
/// Most halvings of the intervals of a basis.
const MOST_HALVINGS: usize = 3;
/// Rounds of a refit with what is added to predictions, and change of the sum of squares at which they end.
const ROUNDS: usize = 12;
const AT_REST: f64 = 1e-8;
/// Relative change of a frequency or a ratio for derivatives.
const SMALL: f64 = 1e-4;
/// Largest change of the logarithm of a frequency and a ratio in a round.
const FARTHEST: [f64; 2] = [0.02, 0.7];

/// Result of a refit.
pub(super) struct Found {
    pub(super) additions: Vec<Addition>,
    pub(super) judged: Judged,
    /// Parameters at the end of the search.
    pub(super) theta: Vec<f64>,
    /// Number of parameters beyond those of the model.
    parameters: usize,
    /// Functions and scalars by name with their parameters.
    named: Vec<(String, Vec<f64>)>,
}

impl Found {
    /// As a candidate beside a model with a penalised misfit.
    pub(super) fn candidate(self, problem: &Problem, misfit: f64) -> Candidate {
        let changes = self.judged.estimate.as_slice();
        let starts = self.theta.iter().copied().chain(std::iter::repeat(0.0));
        let mut at: Vec<f64> = starts.zip(changes).map(|(a, d)| a + d).collect();
        at.extend(self.theta.iter().skip(at.len()));
        let estimates = match self.additions.as_slice() {
            [only] => estimates(*only, problem, &at, &self.judged),
            _ => Vec::new(),
        };
        let names = self.additions.iter().map(|a| a.name(problem));
        let candidate = Candidate {
            name: names.collect::<Vec<String>>().join(" and "),
            words: String::new(),
            estimates,
            to_constants: false,
            gain: misfit - self.judged.misfit,
            parameters: self.parameters,
            order: self.judged.order,
            is_refitted: true,
            parameters_by_name: self.named,
            additions: self.additions,
        };
        Candidate {
            words: candidate.in_words(problem),
            ..candidate
        }
    }
}

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
        let pairs = pairs(problem, theta, &found, linear);
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

/// True for one candidate with other values of what was searched.
pub(super) fn same(a: Addition, b: Addition) -> bool {
    match (a, b) {
        (Addition::Variation { function: f, .. }, Addition::Variation { function: g, .. })
        | (Addition::FinerBasis { function: f, .. }, Addition::FinerBasis { function: g, .. })
        | (Addition::Jump { function: f, .. }, Addition::Jump { function: g, .. }) => f == g,
        (
            Addition::SecondMode {
                experiment: e,
                channel: c,
                ..
            },
            Addition::SecondMode {
                experiment: f,
                channel: d,
                ..
            },
        ) => (e, c) == (f, d),
        _ => a == b,
    }
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
            .any(|known| same(known.addition, candidate.addition))
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
        } => beside(problem, theta, addition, (experiment, channel)),
        _ => plain(problem, theta, addition, further),
    }
}

/// Refit of a changed problem.
pub(super) fn plain(
    problem: &Problem,
    theta: &[f64],
    addition: Addition,
    further: &[f64],
) -> Option<Found> {
    let (changed, start) = addition.added(problem, theta, further)?;
    let parameters = changed.parameters() - problem.parameters();
    let refit = Refit::within(ITERATIONS, changed, &start)?;
    let judged = Linearised::at(&refit.problem, refit.evaluation()).own();
    Some(Found {
        additions: vec![addition],
        named: refit.problem.functions.named(&refit.fit.best.parameters),
        judged,
        theta: refit.fit.best.parameters,
        parameters,
    })
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
    let addition = Addition::Variation { function, degree };
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
        let addition = Addition::Variation { function, degree };
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

/// Refit with what is added to the predictions of a channel.
fn beside(
    problem: &Problem,
    theta: &[f64],
    addition: Addition,
    (e, c): (usize, usize),
) -> Option<Found> {
    let mut theta = theta.to_vec();
    let count = theta.len();
    let mut evaluation = problem.evaluate(&theta).ok()?;
    let samples = ModeSamples::of(problem, e, c);
    let mut mode = match addition {
        Addition::SecondMode { mode, .. } => mode,
        _ => [0.0; 2],
    };
    let mut before = f64::INFINITY;
    let mut best: Option<Found> = None;
    for _ in 0..ROUNDS {
        let columns = RecordColumns::of(problem, &evaluation, &[]);
        let further = |mode: Mode| -> Option<Vec<DVector<f64>>> {
            match addition {
                Addition::SecondMode { .. } => Some(mode_columns(
                    problem,
                    &columns,
                    samples.as_ref()?,
                    (e, c),
                    mode,
                )),
                _ => Some(super::columns::beside(
                    problem,
                    &evaluation,
                    &columns,
                    addition,
                )),
            }
        };
        let linearised = Linearised::at(problem, &evaluation);
        let mut own = further(mode)?;
        let factors = own.len();
        if let Addition::SecondMode { .. } = addition {
            let judged = linearised.squares_with(&own);
            let values = &judged.as_slice()[count..];
            let sum = |columns: &[DVector<f64>]| {
                let mut sum = DVector::zeros(linearised.residuals.len());
                columns
                    .iter()
                    .zip(values)
                    .for_each(|(column, value)| sum.axpy(*value, column, 1.0));
                sum
            };
            let here = sum(&own);
            for j in 0..2 {
                let mut moved = mode;
                moved[j] *= 1.0 + SMALL;
                own.push((sum(&further(moved)?) - &here) / SMALL);
            }
        }
        let judged = linearised.with(&own, 0);
        let squares = judged.squares;
        if !squares.is_finite() || squares > before {
            break;
        }
        let is_at_rest = squares > (1.0 - AT_REST) * before;
        before = squares;
        let change = judged.change.clone();
        let parameters = own.len();
        best = Some(Found {
            additions: vec![match addition {
                Addition::SecondMode { .. } => Addition::SecondMode {
                    experiment: e,
                    channel: c,
                    mode,
                },
                other => other,
            }],
            judged,
            theta: theta.clone(),
            named: Vec::new(),
            parameters,
        });
        if is_at_rest {
            break;
        }
        if let Addition::SecondMode { .. } = addition {
            for j in 0..2 {
                let step = change[count + factors + j].clamp(-FARTHEST[j], FARTHEST[j]);
                mode[j] *= step.exp();
            }
            (mode.iter().all(|x| x.is_finite() && *x > 0.0) && mode[1] < 1.0).then_some(())?;
        }
        theta
            .iter_mut()
            .zip(change.as_slice())
            .for_each(|(a, d)| *a += d);
        evaluation = problem.evaluate(&theta).ok()?;
    }
    best
}
