//! Time or amplitude: rivals of coefficients that vary with time.
//!
//! In one record with a varying amplitude `A(t)` a coefficient that varies with time and one that depends on the amplitude are nearly
//! interchangeable: by harmonic balance
//!
//! ```text
//! k(t) ~ k + 3/4 k3 A^2 + 5/8 k5 A^4,    c(t) ~ c + 8/(3 pi) c2 w A + 4/pi F/(w A)
//! ```
//!
//! The rivals have constants for the functions that vary, and such terms in their place: first one for a stiffness or damping that varies, then one of
//! the other force beside the best of these. Each one that a [linearisation](super::rival_screen) does not decide is fitted with the noise model
//! of the fit, started at the regression of the functions on these powers of `A`, and compared by
//!
//! ```text
//! BIC = -2 log L + p ln n,    -2 log L = n ln(S / n), or S where every sigma is given,
//! ```
//!
//! with the sum `S` of squared weighted and whitened residuals.

use super::constants::constant_probability;
use super::extension::with_functions;
use super::refinement::applies;
use super::rival_screen::RivalScreen;
use crate::functions::{CoefficientFunction, CoefficientKind, CoefficientSet, Parameterization};
use crate::objective::Evaluation;
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::record::{Channel, Loss, Weighting};
use crate::solvers::{Fit, FitSettings, Stopping, fit_from};
use crate::structure::Law;
use nalgebra::DMatrix;
use serde::Serialize;
use std::f64::consts::PI;

/// Probability of a constant below which a function varies.
const VARIES: f64 = 0.01;
/// Difference of BIC up to which a rival is named: 10 is very strong evidence (Kass and Raftery 1995).
const CLOSE: f64 = 10.0;
/// Ratio of the linearised residuals of a rival to those of the fit, in squares, above which it is not fitted. Coulomb friction may be better than
/// the fit at a ratio of 3; other terms are worse from 1.2 on.
const FAR: f64 = 100.0;
/// Multiple of the error of the linearisation at its minimum that a further decrease of BIC by the search may have. Fits of rivals go below by
/// 0.2 to 2 times it.
const ERRORS: f64 = 5.0;
/// Ratio of the ninth and the first decile of the amplitude below which it does not vary.
const AMPLITUDES: f64 = 1.3;
/// Width of the sign of the velocity of a Coulomb friction, relative to the root mean square of the velocity.
const WIDTH: f64 = 0.01;
/// Iteration limit of the fit of a rival.
const ITERATIONS: u64 = 30;
/// Fewest samples per parameter.
const SAMPLES_PER_PARAMETER: usize = 4;

const STIFFNESS: [CoefficientKind; 2] = [
    CoefficientKind::CUBIC_STIFFNESS,
    CoefficientKind::QUINTIC_STIFFNESS,
];
const DAMPING: [CoefficientKind; 2] = [
    CoefficientKind::QUADRATIC_DAMPING,
    CoefficientKind::COULOMB_FRICTION,
];

/// A model with constants that explains the samples as well as coefficients that vary with time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AmplitudeRival {
    /// Functions that vary with time in the fit.
    pub functions: Vec<String>,
    /// Terms of the rival that depend on the amplitude; none for constants alone.
    pub terms: Vec<CoefficientKind>,
    /// BIC of the rival minus that of the fit.
    pub bic_difference: f64,
    /// Indices of the functions.
    #[serde(skip)]
    pub indices: Vec<usize>,
}

/// The rival with the smallest BIC, where that is at most [`CLOSE`] above that of the fit. `None` where no function varies significantly, the
/// amplitude hardly varies, and where the comparison does not apply: without a likelihood, at active constraints, with many parameters.
pub(super) fn amplitude_rival(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
    covariance: Option<&DMatrix<f64>>,
    effective: Option<&[f64]>,
) -> Option<AmplitudeRival> {
    let indices = varying(problem, theta, covariance?, effective);
    let is_few = (1..=FEW_PARAMETERS).contains(&problem.parameters());
    let is_long = problem.sample_count() >= SAMPLES_PER_PARAMETER * problem.parameters();
    let is_plain = problem.channels().all(|c| c.loss() == Loss::Squares);
    let is_one_set = problem.functions.coefficient_sets().len() == 1;
    let may_apply = !indices.is_empty() && is_few && is_long && is_plain && is_one_set;
    (may_apply && applies(problem, theta, evaluation)).then_some(())?;
    let response = Response::of(problem, evaluation)?;
    let varies = response.varies();
    let own = problem.parameters() as f64 - penalty_freedom(problem, effective);
    let here = criterion(problem, evaluation, own);
    let comparison = Comparison {
        problem,
        theta,
        indices: &indices,
        screen: RivalScreen::at(problem, theta, &indices, &terms(problem, &response)),
        response,
        here,
        own,
    };
    // Constants alone are the first rival.
    let alone = std::iter::once(Vec::new());
    let further = first_terms(problem, &indices).into_iter();
    let first = alone.chain(further.filter(|_| varies)).collect();
    let first = comparison.best(first, None)?;
    let second = comparison.best(with_another(problem, &first.kinds), Some(&first));
    let best = second.filter(|second| second.difference < first.difference);
    let Rival {
        difference: bic_difference,
        kinds: terms,
        ..
    } = best.unwrap_or(first);
    (bic_difference <= CLOSE).then_some(())?;
    Some(AmplitudeRival {
        functions: indices
            .iter()
            .map(|i| problem.functions.get(*i).name())
            .collect(),
        terms,
        bic_difference,
        indices,
    })
}

/// A rival with the terms `kinds`.
struct Rival {
    kinds: Vec<CoefficientKind>,
    /// BIC minus that of the fit: of the fitted rival, or of its linearisation where that [decides](Comparison::decided).
    difference: f64,
    /// The same by the linearisation.
    linear: f64,
    /// True if the linearisation decides.
    is_decided: bool,
}

/// Rivals beside a fit.
struct Comparison<'a> {
    problem: &'a Problem,
    theta: &'a [f64],
    indices: &'a [usize],
    response: Response,
    screen: Option<RivalScreen>,
    /// BIC of the fit.
    here: f64,
    /// Effective number of parameters of the fit.
    own: f64,
}

impl Comparison<'_> {
    /// The rival with the smallest BIC. Those that are worse than `found` in the linearisation are left out where it decides.
    fn best(&self, sets: Vec<Vec<CoefficientKind>>, found: Option<&Rival>) -> Option<Rival> {
        let decided = found.filter(|rival| rival.is_decided);
        let rivals = sets.into_iter().filter_map(|kinds| {
            let linear = self.linear(&kinds);
            let is_worse = |known: &Rival| linear > known.linear && is_near(&kinds);
            if decided.is_some_and(is_worse) {
                return None;
            }
            let decision = self.decided(&kinds, linear);
            let difference = match decision {
                Some(difference) => difference,
                None => self.criterion(&kinds)? - self.here,
            };
            difference.is_finite().then_some(Rival {
                kinds,
                difference,
                linear,
                is_decided: decision.is_some(),
            })
        });
        rivals.min_by(|a, b| a.difference.total_cmp(&b.difference))
    }

    /// BIC of a rival minus that of the fit where no fit of it is needed: its residuals are [much larger](FAR), or the linearisation, with the
    /// difference `linear` and confirmed by a response at its minimum, leaves it above [`CLOSE`].
    fn decided(&self, kinds: &[CoefficientKind], linear: f64) -> Option<f64> {
        let screen = self.screen.as_ref()?;
        if screen.difference(kinds) > FAR * screen.here() {
            return Some(linear);
        }
        (linear > CLOSE && is_near(kinds)).then_some(())?;
        let (rival, _) = self.rival(kinds)?;
        let at = screen.minimum(kinds);
        (at.len() == rival.parameters()).then_some(())?;
        let evaluation = rival.evaluate(&at).ok()?;
        let there = criterion(&rival, &evaluation, rival.parameters() as f64) - self.here;
        let error = (there - linear).abs();
        (there.min(linear) - ERRORS * error > CLOSE).then_some(there)
    }

    /// The rival with the terms `kinds`, and its start.
    fn rival(&self, kinds: &[CoefficientKind]) -> Option<(Problem, Vec<f64>)> {
        rival(
            self.problem,
            self.theta,
            self.indices,
            kinds,
            &self.response,
        )
    }

    /// BIC of a rival minus that of the fit by the linearisation at the optimum; zero without one.
    fn linear(&self, kinds: &[CoefficientKind]) -> f64 {
        let Some(screen) = &self.screen else {
            return 0.0;
        };
        let is_estimated = |c: &Channel| matches!(c.weighting(), Weighting::Estimated { .. });
        let samples = self.problem.sample_count() as f64;
        let worse = screen.difference(kinds);
        let deviance = match self.problem.channels().all(is_estimated) {
            true => samples * (worse / screen.here()).ln_1p(),
            false => worse,
        };
        deviance + (screen.parameters(kinds) as f64 - self.own) * samples.ln()
    }

    /// BIC of the fitted rival with the terms `kinds`; `None` without a response.
    fn criterion(&self, kinds: &[CoefficientKind]) -> Option<f64> {
        let (rival, start) = self.rival(kinds)?;
        let fit = search(&rival, &start)?;
        Some(criterion(
            &rival,
            &fit.best.evaluation,
            rival.parameters() as f64,
        ))
    }
}

/// A short search from a start.
fn search(problem: &Problem, start: &[f64]) -> Option<Fit> {
    let settings = FitSettings {
        stopping: Stopping {
            tolerance: Some(1e-6),
            ..Stopping::exactly(ITERATIONS)
        },
        ..FitSettings::default()
    };
    fit_from(problem, start, &settings).ok()
}

/// The problem with constants for all functions that can vary, fitted.
pub(super) fn fit_of_constants(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
) -> Option<(Problem, Fit)> {
    (problem.functions.coefficient_sets().len() == 1).then_some(())?;
    let response = Response::of(problem, evaluation)?;
    let all = 0..problem.functions.ranges().len();
    let indices: Vec<usize> = all
        .filter(|f| problem.functions.get(*f).parameters() > 1)
        .collect();
    let (constants, start) = rival(problem, theta, &indices, &[], &response)?;
    let fit = search(&constants, &start)?;
    Some((constants, fit))
}

/// True if a rival has no better minimum far from the fit. One with friction, which ends a motion, may have: it was better by 100 where the response
/// at the linearised minimum confirmed that it is worse by 500.
fn is_near(kinds: &[CoefficientKind]) -> bool {
    !kinds.contains(&CoefficientKind::COULOMB_FRICTION)
}

/// Terms of all rivals that the model does not have.
fn terms(problem: &Problem, response: &Response) -> Vec<(CoefficientKind, Law)> {
    let width = WIDTH * response.speed;
    let all = [STIFFNESS, DAMPING].map(|kinds| absent(problem, kinds));
    let all = all.into_iter().flatten();
    all.filter_map(|kind| Some((kind, kind.law(width)?)))
        .collect()
}

/// Functions with several parameters that are no constants.
fn varying(
    problem: &Problem,
    theta: &[f64],
    covariance: &DMatrix<f64>,
    effective: Option<&[f64]>,
) -> Vec<usize> {
    let of_function = |f: usize| {
        let mut pairs = problem.penalties.iter().zip(effective?);
        pairs
            .find(|(p, _)| p.function == f)
            .map(|(_, effective)| *effective)
    };
    let several = (0..problem.functions.ranges().len())
        .filter(|f| problem.functions.get(*f).parameters() > 1);
    several
        .filter(|f| {
            let p = constant_probability(problem, *f, theta, covariance, of_function(*f));
            p.is_some_and(|p| p < VARIES)
        })
        .collect()
}

/// Parameters that penalties hold.
pub(super) fn penalty_freedom(problem: &Problem, effective: Option<&[f64]>) -> f64 {
    let pairs = problem.penalties.iter().zip(effective.unwrap_or_default());
    let held = pairs.map(|(penalty, effective)| {
        problem.functions.ranges()[penalty.function].len() as f64 - effective
    });
    held.sum()
}

/// The Bayesian information criterion.
fn criterion(problem: &Problem, evaluation: &Evaluation, parameters: f64) -> f64 {
    let all = problem.sample_count() as f64;
    let deviance = problem.predicted(evaluation).map(|(channel, predicted)| {
        let weighted = channel.majorant(predicted).weighted;
        let squares: f64 = weighted.iter().map(|r| r * r).sum();
        let count = channel.len() as f64;
        match channel.weighting() {
            Weighting::Estimated { .. } => count * (squares / count).ln(),
            _ => squares,
        }
    });
    deviance.sum::<f64>() + parameters * all.ln()
}

/// Terms of a list that the model does not have.
fn absent(problem: &Problem, kinds: [CoefficientKind; 2]) -> Vec<CoefficientKind> {
    let has = |kind: &CoefficientKind| problem.functions.iter().any(|f| f.quantity == *kind);
    kinds.into_iter().filter(|kind| !has(kind)).collect()
}

/// Terms of the first rivals: one in place of a stiffness or a damping that varies, a pair where both vary, any single one beside a mass.
fn first_terms(problem: &Problem, indices: &[usize]) -> Vec<Vec<CoefficientKind>> {
    let varies = |kind: CoefficientKind| {
        let mut quantities = indices.iter().map(|i| problem.functions.get(*i).quantity);
        quantities.any(|quantity| quantity == kind)
    };
    let [stiffness, damping] = [STIFFNESS, DAMPING].map(|kinds| absent(problem, kinds));
    let single = |kinds: &[CoefficientKind]| kinds.iter().map(|kind| vec![*kind]).collect();
    match [CoefficientKind::STIFFNESS, CoefficientKind::DAMPING].map(varies) {
        [true, true] => {
            let pairs = stiffness
                .iter()
                .flat_map(|k| damping.iter().map(|c| vec![*k, *c]));
            pairs.collect()
        }
        [true, false] => single(&stiffness),
        [false, true] => single(&damping),
        [false, false] => single(&[stiffness, damping].concat()),
    }
}

/// A single term with each one of the other force, whose misfit changes both; none beside a pair.
fn with_another(problem: &Problem, terms: &[CoefficientKind]) -> Vec<Vec<CoefficientKind>> {
    let [term] = terms else {
        return Vec::new();
    };
    let others = match STIFFNESS.contains(term) {
        true => DAMPING,
        false => STIFFNESS,
    };
    let others = absent(problem, others).into_iter();
    others.map(|other| vec![*term, other]).collect()
}

/// Amplitude and frequency of the response at the nodes.
struct Response {
    /// Of the longest record, m.
    amplitude: Vec<f64>,
    /// Root mean square of velocity over that of displacement, 1/s.
    frequency: f64,
    /// Root mean square velocity, m/s.
    speed: f64,
}

impl Response {
    fn of(problem: &Problem, evaluation: &Evaluation) -> Option<Self> {
        let longest = (evaluation.trajectories.iter()).max_by_key(|response| response.nodes())?;
        let (y, v) = (longest.displacement(0), longest.velocity(0));
        let size = |values: &[f64]| crate::simd::sum::rms(values);
        let frequency = size(v) / size(y);
        (frequency.is_finite() && frequency > 0.0).then_some(())?;
        let mut amplitude: Vec<f64> = (y.iter().zip(v))
            .map(|(y, v)| y.hypot(v / frequency))
            .collect();
        let last = *amplitude.last()?;
        amplitude.resize(problem.functions.nodes(), last);
        Some(Self {
            amplitude,
            frequency,
            speed: size(v),
        })
    }

    /// False where the amplitude hardly varies.
    fn varies(&self) -> bool {
        let mut sorted = self.amplitude.clone();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| sorted[(share * (sorted.len() - 1) as f64) as usize];
        at(0.9) > AMPLITUDES * at(0.1)
    }

    /// Equivalent linear coefficient at amplitude `a` of a unit coefficient of this kind.
    fn equivalent(&self, kind: CoefficientKind, a: f64) -> f64 {
        let (a, w) = (a.max(f64::MIN_POSITIVE), self.frequency);
        match kind {
            CoefficientKind::CUBIC_STIFFNESS => 0.75 * a * a,
            CoefficientKind::QUINTIC_STIFFNESS => 0.625 * a.powi(4),
            CoefficientKind::QUADRATIC_DAMPING => 8.0 / (3.0 * PI) * w * a,
            CoefficientKind::COULOMB_FRICTION => 4.0 / (PI * w * a),
            _ => 0.0,
        }
    }

    /// Least-squares constant and coefficient of `kind` for a function with these values at the nodes, weighted by the squared amplitude; the mean
    /// alone without a kind.
    fn regression(&self, values: &[f64], kind: Option<CoefficientKind>) -> [f64; 2] {
        let weights = self.amplitude.iter().map(|a| a * a);
        let (mut normal, mut right) = ([[0.0; 2]; 2], [0.0; 2]);
        for ((value, a), weight) in values.iter().zip(&self.amplitude).zip(weights) {
            let row = [1.0, kind.map_or(0.0, |kind| self.equivalent(kind, *a))];
            for i in 0..2 {
                right[i] += weight * row[i] * value;
                for j in 0..2 {
                    normal[i][j] += weight * row[i] * row[j];
                }
            }
        }
        let mean = right[0] / normal[0][0];
        let determinant = normal[0][0] * normal[1][1] - normal[0][1] * normal[1][0];
        match determinant > 1e-12 * normal[0][0] * normal[1][1] {
            true => [
                (right[0] * normal[1][1] - right[1] * normal[0][1]) / determinant,
                (right[1] * normal[0][0] - right[0] * normal[1][0]) / determinant,
            ],
            false => [mean, 0.0],
        }
    }
}

/// The problem with constants for the functions `indices` and further constants for the terms `kinds`, and its start.
fn rival(
    problem: &Problem,
    theta: &[f64],
    indices: &[usize],
    kinds: &[CoefficientKind],
    response: &Response,
) -> Option<(Problem, Vec<f64>)> {
    let functions = &problem.functions;
    let (nodes, step) = (functions.nodes(), problem.system.grid.step());
    let values = functions.values(theta);
    let of_kind = |own: CoefficientKind| {
        let list = match own {
            CoefficientKind::STIFFNESS => &STIFFNESS,
            CoefficientKind::DAMPING => &DAMPING,
            _ => return None,
        };
        kinds.iter().copied().find(|kind| list.contains(kind))
    };
    let mut list: Vec<CoefficientFunction> = Vec::new();
    let mut new = vec![0.0; kinds.len()];
    let mut start = Vec::new();
    for (f, function) in functions.iter().enumerate() {
        if !indices.contains(&f) {
            start.extend(&theta[functions.ranges()[f].clone()]);
            list.push(function.clone());
            continue;
        }
        let kind = of_kind(function.quantity);
        let [constant, coefficient] = response.regression(&values[f], kind);
        if let Some(position) = kinds.iter().position(|known| Some(*known) == kind) {
            new[position] = coefficient;
        }
        start.push(constant);
        list.push(CoefficientFunction {
            owner: function.owner.clone(),
            is_known_part: function.is_known_part,
            ..CoefficientFunction::constant(function.quantity, constant, nodes)
        });
    }
    let first = list.len();
    let width = WIDTH * response.speed;
    let terms: Vec<Law> = kinds.iter().filter_map(|kind| kind.law(width)).collect();
    let more = kinds.iter().zip(&new);
    list.extend(more.map(|(kind, start)| CoefficientFunction::constant(*kind, *start, nodes)));
    start.extend(&new);
    start.extend(problem.scalars(theta));
    let set = functions.coefficient_set(0);
    let all = set.iter().copied().chain(first..first + kinds.len());
    let sets = vec![
        CoefficientSet::from(all.collect::<Vec<usize>>())
            .with_known_parts(set.known_parts().to_vec()),
    ];
    let constants = Parameterization::with_coefficient_sets(list, sets, nodes, step)?
        .with_scalars(functions.scalars().to_vec());
    Some((with_functions(problem, constants, terms)?, start))
}
