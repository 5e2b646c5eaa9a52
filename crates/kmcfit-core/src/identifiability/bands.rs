//! Confidence bands of functions and ratios.
//!
//! Without penalties the covariance of the parameters is `(J^T W J)^-1` (Cramér and Rao, for Gaussian
//! noise and the linearised predictions). With penalties it is the sandwich
//!
//! ```text
//! Cov = H^-1 (J^T W J) H^-1,    H = J^T W J + sum_j weight_j L_j^T L_j
//! ```
//!
//! which describes the scatter of the estimates between repetitions of the noise. It **excludes the smoothing bias**, the
//! shift of the mean estimate caused by penalties. With weights of restricted likelihood or cross-validation it is
//!
//! ```text
//! Cov = H^-1
//! ```
//!
//! the covariance of a random function whose prior is the penalty. It includes the smoothing bias on average over the record
//! (Wahba 1983; Nychka 1988): there a 95 % band holds the function at 95 % of the times, fewer where it bends most.
//! The standard error of a piecewise-linear function without a penalty includes the error of linear interpolation between its knots, as far
//! as its second differences show it.
//! Priors of scalars count as measurements. Total-variation penalties and
//! the curvature of the predictions are neglected.
//!
//! Active rows hold with equality: the covariance is that in their null space. Where an active bound leaves a function no
//! freedom, the band is one-sided, with the width it has without the bound. Where an undetermined direction changes a
//! function, its band is infinite.

use super::active::{ActiveRow, active_rows};
use super::band::{Band, BandSide, MeanOverRecord};
use super::band_notes::notes;
use super::basis_error::basis_error;
use super::covariance::{CovarianceRoot, Information};
use super::covariance_kind::CovarianceKind;
use super::degrees::{NoiseVariants, degrees_of_parameters};
use super::directions::Directions;
use super::equation_rows::EquationRows;
use super::linearised_curve::{LinearisedCurve, combine};
use super::means::{Means, means_at};
use super::ratios::{RatioOfSet, ratios_of_set};
use super::sensitivity::Sensitivity;
use crate::objective::{Evaluation, Refined};
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::spans::{span_words, spans};
use nalgebra::{DMatrix, DVector};

/// Largest number of parameters with a full covariance; beyond it, smooth directions are used.
const MOST_PARAMETERS: usize = 800;
/// Largest number of smooth directions.
const MOST_SMOOTH: usize = 400;
/// Largest work of the decomposition of smooth directions, samples x directions^2.
const MOST_WORK: f64 = 2e9;
/// Largest number of nodes with bands, apart from the last one; longer grids are thinned evenly.
const MOST_NODES: usize = 4000;
/// Smallest share of the slope of a value in undetermined directions that makes the value undetermined.
const UNSEEN_SHARE: f64 = 1e-6;
/// Standard errors below this share of those without bounds count as zero.
const HELD: f64 = 1e-6;

/// Bands of all functions and of the ratios of the shared coefficient set.
#[derive(Debug, Clone, PartialEq)]
pub struct Bands {
    /// Times, s.
    pub times: Vec<f64>,
    /// One per function of the list.
    pub functions: Vec<Band>,
    /// `k/m`, `c/m`, natural frequency and damping ratio, as far as the system has these terms.
    pub ratios: Vec<Band>,
    /// Estimated standard deviation of samples without sigma, in their unit.
    pub sigma: Option<f64>,
    /// Number of undetermined directions.
    pub undetermined: usize,
    /// Kind of the covariance.
    pub covariance_kind: CovarianceKind,
    /// Covariance of the parameters, with penalties, priors and equality constraints; `None` with many parameters and where a
    /// combination is undetermined.
    pub covariance: Option<DMatrix<f64>>,
    /// Degrees of freedom of the estimate of each parameter ([`Problem::degrees_of_freedom`]).
    pub degrees_of_freedom: Vec<f64>,
    /// Notes on all bands.
    pub notes: Vec<String>,
}

impl Bands {
    /// Computes the bands at the parameters `theta`, evaluated in `evaluation`.
    pub fn at(problem: &Problem, theta: &[f64], evaluation: &Evaluation) -> Self {
        Self::beside(problem, theta, evaluation, None)
    }

    /// [`Bands::at`], with the results on half the step where they are known.
    pub(crate) fn beside(
        problem: &Problem,
        theta: &[f64],
        evaluation: &Evaluation,
        halved: Option<Refined>,
    ) -> Self {
        let samples = problem.sample_count().max(1) as f64;
        let affordable = (MOST_WORK / samples).sqrt() as usize;
        let smooth = affordable.min(MOST_SMOOTH);
        let directions = Directions::new(problem, evaluation, MOST_PARAMETERS, smooth);
        let sensitivity = Sensitivity::along(problem, evaluation, directions);
        let information = Information::new(problem, theta, sensitivity)
            .with_error_of_steps(problem, evaluation, halved);
        Self::from_information(problem, theta, evaluation, &information)
    }

    /// Computes the bands of the equation error at its minimum `theta`, from the scores of its samples.
    pub fn of_equation(
        problem: &Problem,
        theta: &[f64],
        evaluation: &Evaluation,
        equation: &EquationRows,
    ) -> Self {
        let information = Information::of_equation(problem, theta, evaluation, equation);
        Self::from_information(problem, theta, evaluation, &information)
    }

    fn from_information(
        problem: &Problem,
        theta: &[f64],
        evaluation: &Evaluation,
        information: &Information,
    ) -> Self {
        let mut active = active_rows(problem, theta);
        active.extend(information.held().iter().cloned());
        let equal: Vec<&ActiveRow> = active.iter().filter(|r| r.equality).collect();
        let bounded = active.iter().any(|r| !r.equality);
        let all: Vec<&ActiveRow> = active.iter().collect();
        let without_bounds = information.factor(&equal);
        let with_bounds = match bounded {
            true => information.factor(&all),
            false => without_bounds.clone(),
        };
        let stride = problem.functions.nodes().div_ceil(MOST_NODES);
        let all = problem.functions.nodes();
        let thinned = (0..all - 1).step_by(stride);
        let nodes: Vec<usize> = thinned.chain([all - 1]).collect();
        let variants = match information.is_equation() {
            true => None,
            false => NoiseVariants::of(problem, evaluation, Some(information.sensitivity())),
        };
        let directions = &information.sensitivity().directions;
        let computation = BandComputation {
            problem,
            theta,
            variants: variants.as_ref(),
            times: nodes.iter().map(|i| problem.system.grid.time(*i)).collect(),
            nodes,
            factors: match bounded {
                true => vec![&with_bounds, &without_bounds],
                false => vec![&without_bounds],
            },
            directions,
            bounds_of: bounds_of(problem.parameters(), &active),
            inwards: active.iter().map(|row| inwards(directions, row)).collect(),
        };
        let linearised: Vec<LinearisedCurve> = (0..problem.functions.ranges().len())
            .map(|f| computation.function(f))
            .collect();
        let values = problem.functions.values_at(theta, &computation.nodes);
        let (means, means_of_ratios) = means_at(problem, theta);
        let means = means.into_iter();
        let functions = linearised
            .iter()
            .enumerate()
            .zip(means)
            .map(|((f, linear), mean)| {
                let function = problem.functions.get(f);
                let unit = function.quantity.unit();
                let entries = |i: usize, into: &mut Vec<(usize, f64)>| {
                    computation.add_entries(f, computation.nodes[i], 1.0, into);
                };
                let degrees = computation.degrees(&entries);
                let at_nodes = values[f].clone();
                let mean = computation.mean(mean, linear);
                computation.band(
                    (function.name(), unit),
                    at_nodes,
                    linear,
                    (degrees, mean),
                    Some(f),
                )
            });
        let functions = functions.collect();
        let undetermined = without_bounds.undetermined.ncols();
        let mut notes = notes(problem, information, &active);
        if undetermined > 0 {
            notes.push(format!(
                "parameter combinations that are not identifiable: {undetermined}; the bands of the functions they change are infinite"
            ));
        }
        Self {
            functions,
            ratios: computation.ratios(&values, &linearised, means_of_ratios),
            sigma: with_bounds.variance.map(f64::sqrt),
            covariance: match problem.parameters() {
                1..=FEW_PARAMETERS => information.of_parameters(&without_bounds),
                _ => None,
            },
            undetermined,
            covariance_kind: information.kind(),
            degrees_of_freedom: degrees_of_parameters(problem, computation.variants),
            notes,
            times: computation.times,
        }
    }

    /// Means over the record.
    pub fn means(&self) -> Means<'_> {
        Means {
            functions: self.functions.iter().map(|band| &band.mean).collect(),
            ratios: (self.ratios.iter())
                .map(|band| (band.name.as_str(), &band.mean))
                .collect(),
        }
    }

    /// Band of the ratio `name`.
    pub fn ratio(&self, name: &str) -> Option<&Band> {
        self.ratios.iter().find(|b| b.name == name)
    }
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Slope of an active row along the directions, and its norm.
fn inwards(directions: &Directions, row: &ActiveRow) -> (Vec<f64>, f64) {
    let slope = match row.equality {
        // Not asked for.
        true => Vec::new(),
        false => directions.row(row.entries.iter().copied()),
    };
    let length = norm(&slope);
    (slope, length)
}

/// Indices of the active rows without equality that have each parameter.
fn bounds_of(parameters: usize, active: &[ActiveRow]) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new(); parameters];
    for (i, row) in active.iter().enumerate().filter(|(_, row)| !row.equality) {
        row.entries.iter().for_each(|(j, _)| all[*j].push(i));
    }
    all
}

/// Adds the entries of a value at a node in the parameters to a list.
type AddEntries<'a> = dyn Fn(usize, &mut Vec<(usize, f64)>) + 'a;

struct BandComputation<'a> {
    problem: &'a Problem,
    theta: &'a [f64],
    variants: Option<&'a NoiseVariants>,
    nodes: Vec<usize>,
    times: Vec<f64>,
    /// With all active rows fixed, and with only the equalities fixed; a single one where no bound is active.
    factors: Vec<&'a CovarianceRoot>,
    directions: &'a Directions,
    /// Active bounds, by the parameters that they have.
    bounds_of: Vec<Vec<usize>>,
    /// Slope of each active row along the directions, inwards, and its norm.
    inwards: Vec<(Vec<f64>, f64)>,
}

impl BandComputation<'_> {
    /// Slopes of the value of function `f` at node `i` along the scaled directions.
    fn slope(&self, f: usize, i: usize) -> Vec<f64> {
        let functions = &self.problem.functions;
        let first = functions.ranges()[f].start;
        let row = functions.get(f).design.row(i);
        self.directions.row(row.map(|(j, b)| (first + j, b)))
    }

    /// Adds the entries of `factor` times the value of function `f` at node `i` in the parameters.
    fn add_entries(&self, f: usize, i: usize, factor: f64, into: &mut Vec<(usize, f64)>) {
        let functions = &self.problem.functions;
        let first = functions.ranges()[f].start;
        let row = functions.get(f).design.row(i);
        into.extend(row.map(|(j, b)| (first + j, factor * b)));
    }

    /// Degrees of freedom of the values with these entries at each node of the band.
    fn degrees(&self, add: &AddEntries) -> Vec<f64> {
        let mut entries = Vec::new();
        let degrees = (0..self.nodes.len()).map(|i| {
            entries.clear();
            add(i, &mut entries);
            self.variants
                .map_or(f64::INFINITY, |variants| variants.degrees(&entries))
        });
        degrees.collect()
    }

    /// The mean over the record of a curve with its standard error, with only the equalities fixed.
    fn mean(&self, mean: MeanOverRecord, linear: &LinearisedCurve) -> MeanOverRecord {
        let entries: Vec<(usize, f64)> = mean.gradient.iter().copied().enumerate().collect();
        let slope = DVector::from_vec(self.directions.row(entries.iter().copied()));
        let factor = self.factors[self.factors.len() - 1];
        let hidden = factor.undetermined.tr_mul(&slope).norm();
        let error = factor.root.tr_mul(&slope).norm();
        let size = linear.sizes.iter().sum::<f64>() / linear.sizes.len() as f64;
        let is_known = hidden <= UNSEEN_SHARE * size && error.is_finite();
        MeanOverRecord {
            standard_error: match is_known {
                true => error.hypot(mean.basis_error),
                false => f64::INFINITY,
            },
            degrees: self
                .variants
                .map_or(f64::INFINITY, |variants| variants.degrees(&entries)),
            ..mean
        }
    }

    fn function(&self, f: usize) -> LinearisedCurve {
        let functions = &self.problem.functions;
        let range = functions.ranges()[f].clone();
        let image = |columns: &DMatrix<f64>| {
            let mut out = DMatrix::zeros(self.nodes.len(), columns.ncols());
            for (z, mut into) in columns.column_iter().zip(out.column_iter_mut()) {
                let theta = self.directions.to_parameters(z.as_slice());
                let design = &functions.get(f).design;
                let own = &theta[range.clone()];
                into.iter_mut()
                    .zip(&self.nodes)
                    .for_each(|(x, i)| *x = design.product_at(own, *i));
            }
            out
        };
        let size = |i: &usize| {
            let row = functions.get(f).design.row(*i);
            self.directions
                .slope_norm(row.map(|(j, b)| (range.start + j, b)))
        };
        LinearisedCurve {
            roots: self.factors.iter().map(|f| image(&f.root)).collect(),
            hidden: (self.factors.iter())
                .map(|f| image(&f.undetermined))
                .collect(),
            sizes: self.nodes.iter().map(size).collect(),
            basis_error: basis_error(self.problem, f, self.theta, &self.times),
        }
    }

    fn band(
        &self,
        (name, unit): (String, &str),
        values: Vec<f64>,
        linear: &LinearisedCurve,
        (degrees, mean): (Vec<f64>, MeanOverRecord),
        function: Option<usize>,
    ) -> Band {
        let count = self.nodes.len();
        let cases = 0..linear.roots.len();
        let norms: Vec<[Vec<f64>; 2]> = cases.map(|case| linear.norms(case)).collect();
        let error = |case: usize, i: usize| {
            let [known, hidden] = &norms[case];
            match hidden[i] > UNSEEN_SHARE * linear.sizes[i] {
                true => f64::INFINITY,
                false => known[i].hypot(linear.basis_error[i]),
            }
        };
        let (mut errors, mut sides) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for (i, value) in values.iter().enumerate() {
            let with_bounds = error(0, i);
            let without_bounds = match norms.len() {
                1 => with_bounds,
                _ => error(1, i),
            };
            let (standard_error, side) = if !value.is_finite() || with_bounds.is_nan() {
                (f64::INFINITY, BandSide::Both)
            } else if without_bounds == 0.0 {
                (0.0, BandSide::Neither)
            } else if with_bounds <= HELD * without_bounds {
                let side = function.map_or(BandSide::Both, |f| self.side(f, self.nodes[i]));
                (without_bounds, side)
            } else {
                (with_bounds, BandSide::Both)
            };
            errors.push(standard_error);
            sides.push(side);
        }
        let mut notes = Vec::new();
        let mut note = |words: &str, holds: &dyn Fn(usize) -> bool| {
            let found = spans(&self.times, holds);
            if !found.is_empty() {
                notes.push(format!("{words} on {}", span_words(&found)));
            }
        };
        note("not defined", &|i| !values[i].is_finite());
        note("not identifiable", &|i| {
            values[i].is_finite() && errors[i].is_infinite()
        });
        note("one-sided, because a bound is active,", &|i| {
            matches!(sides[i], BandSide::Above | BandSide::Below)
        });
        Band {
            mean,
            name,
            unit: unit.to_owned(),
            values,
            standard_error: errors,
            degrees,
            sides,
            notes,
        }
    }

    /// Sides on which function `f` may change at node `i`, where the active rows leave it no freedom.
    fn side(&self, f: usize, i: usize) -> BandSide {
        let slope = self.slope(f, i);
        let size = norm(&slope);
        let functions = &self.problem.functions;
        let first = functions.ranges()[f].start;
        let own = functions.get(f).design.row(i).map(|(j, _)| first + j);
        let mut lists: Vec<&[usize]> = own.map(|j| self.bounds_of[j].as_slice()).collect();
        // Each row of these ascending lists once, in ascending order: bounds at all nodes are thousands of rows.
        let rows = std::iter::from_fn(|| {
            let next = *lists.iter().filter_map(|list| list.first()).min()?;
            for list in &mut lists {
                *list = list.strip_prefix(&[next]).unwrap_or(list);
            }
            Some(next)
        });
        for (inwards, length) in rows.map(|r| &self.inwards[r]) {
            let dot: f64 = inwards.iter().zip(&slope).map(|(a, b)| a * b).sum();
            let cosine = dot / (length * size).max(f64::MIN_POSITIVE);
            if cosine.abs() > 1.0 - HELD {
                return if cosine > 0.0 {
                    BandSide::Above
                } else {
                    BandSide::Below
                };
            }
        }
        // Several rows together fix the value.
        BandSide::Both
    }

    /// Ratios of the shared coefficient set, by the delta method, from the values of the functions at the nodes and the means of the ratios.
    fn ratios(
        &self,
        values: &[Vec<f64>],
        linearised: &[LinearisedCurve],
        means: Vec<(&'static str, MeanOverRecord)>,
    ) -> Vec<Band> {
        let band = |(ratio, (name, mean)): (RatioOfSet, (&'static str, MeanOverRecord))| {
            let functions = ratio.functions();
            let (ratios, slopes) = ratio.at_nodes(values);
            let linear = combine(linearised, &functions, &slopes);
            let entries = |i: usize, into: &mut Vec<(usize, f64)>| {
                let slopes = &slopes[i * functions.len()..];
                for (f, slope) in functions.iter().zip(slopes) {
                    self.add_entries(*f, self.nodes[i], *slope, into);
                }
            };
            let degrees = self.degrees(&entries);
            let mean = self.mean(mean, &linear);
            self.band(
                (name.into(), ratio.unit),
                ratios,
                &linear,
                (degrees, mean),
                None,
            )
        };
        let ratios = ratios_of_set(self.problem).into_iter();
        ratios.zip(means).map(band).collect()
    }
}
