//! Test of the bases of a fit against finer ones: twice as many knots, and two halves for a constant.
//!
//! One linearisation in the finer bases at the optimum gives the smallest sums of squares of weighted and whitened residuals with the
//! given bases, `S1` with `q1` parameters, and with one of them finer, `S2` with `q2`. If the given basis contains the function,
//!
//! ```text
//! F = ((S1 - S2) / (q2 - q1)) / (S2 / (n - q2))
//! ```
//!
//! has an F distribution. A nonlinear refit gives the same verdict at several times the cost. The test is of no use where residuals
//! are far from noise, and for an estimate that a constraint holds; there it is left out.

use super::larger_models::BasisComparison;
use super::minimum::Minimum;
use crate::diagnostics::{rms, standard_deviation};
use crate::functions::{Basis, CoefficientFunction, Parameterization};
use crate::identifiability::has_active_rows;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::solvers::reduced_jacobian;
use crate::spans::spans;
use crate::system::Grid;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

/// Probability of a false alarm over all functions of a fit.
pub(super) const LEVEL: f64 = 0.01;
/// Smallest number of samples per parameter of the finer bases.
const SAMPLES_PER_PARAMETER: usize = 4;
/// Largest number of parameters of the finer bases.
const MOST_PARAMETERS: usize = 200;
/// Residuals below this share of the variation of the samples are rounding and step-size errors.
const EXACT: f64 = 1e-4;
/// Nodes for each cell of a finer basis, where the given one is expressed in it.
const EMBEDDING_NODES: f64 = 16.0;
/// Share of the largest change that counts as the place of the change.
const PLACE: f64 = 0.5;

/// A basis that is too coarse for its function.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoarseBasis {
    /// Index of the function.
    #[serde(skip)]
    pub index: usize,
    /// Name of the function.
    pub function: String,
    /// Unit of the function.
    pub unit: &'static str,
    /// Probability of so large an improvement by noise alone.
    pub p_value: f64,
    /// Largest change of the function by the finer basis, relative to its size.
    pub change: f64,
    /// Spans of time with at least half of this change, s.
    pub spans: Vec<[f64; 2]>,
    /// Number of knots of the finer basis; `None` for a constant.
    pub knots: Option<usize>,
    /// Estimates in the two halves of the record, for a constant, in the unit of the function.
    pub halves: Option<[f64; 2]>,
}

/// Result of the test of all bases.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BasisTest {
    /// Bases that are too coarse, the most significant first, each with the finer bases of those before it.
    pub coarse: Vec<CoarseBasis>,
    /// Indices of all functions for which a finer basis alone fits significantly better: a variation of one function can appear
    /// as that of another, and the intervals of all of them exclude it.
    pub doubtful: Vec<usize>,
    /// Each basis against its finer one alone, in the order of the functions.
    pub comparisons: Vec<BasisComparison>,
    /// p-value below which a finer basis fits significantly better: [`LEVEL`] over the number of tests.
    pub level: f64,
}

impl BasisTest {
    /// Tests the bases of an evaluated fit. Empty where the test does not apply: without a likelihood, at an
    /// active constraint, for residuals at machine precision, and with few samples.
    pub fn of(problem: &Problem, theta: &[f64], evaluation: &Evaluation) -> Self {
        Self::where_it_applies(problem, theta, evaluation).unwrap_or_default()
    }

    fn where_it_applies(problem: &Problem, theta: &[f64], evaluation: &Evaluation) -> Option<Self> {
        applies(problem, theta, evaluation).then_some(())?;
        let finer = FinerBases::new(problem, theta)?;
        let parameters = finer.problem.parameters();
        let is_long = problem.sample_count() >= SAMPLES_PER_PARAMETER * parameters;
        (parameters <= MOST_PARAMETERS && is_long).then_some(())?;
        Some(finer.test(problem, evaluation))
    }
}

pub(crate) fn applies(problem: &Problem, theta: &[f64], evaluation: &Evaluation) -> bool {
    let is_noise = problem.predicted(evaluation).all(|(channel, predicted)| {
        let residuals: Vec<f64> = channel.residuals(predicted).collect();
        rms(&residuals) > EXACT * standard_deviation(channel.observed())
    });
    let is_likelihood = problem.channels().all(|c| c.weighting().is_sigma());
    problem.parameters() > 0 && is_likelihood && is_noise && !has_active_rows(problem, theta)
}

/// The problem in finer bases, without penalties and constraints.
struct FinerBases {
    problem: Problem,
    /// For each function with a finer basis the parameters in it of each parameter in the given one.
    maps: Vec<Option<DMatrix<f64>>>,
}

impl FinerBases {
    /// `None` where no basis can be finer.
    fn new(problem: &Problem, theta: &[f64]) -> Option<Self> {
        let grid = &problem.system.grid;
        let functions = &problem.functions;
        let mut list: Vec<CoefficientFunction> = functions.iter().cloned().collect();
        let mut maps = Vec::with_capacity(list.len());
        for (index, function) in list.iter_mut().enumerate() {
            let is_penalised = problem.penalties.iter().any(|p| p.function == index)
                || problem.variations.iter().any(|v| v.function == index)
                || problem.jumps.iter().any(|j| j.function == index);
            // A known value does not vary.
            let is_open = !is_penalised && function.prior.is_none();
            let finer = function.basis.as_ref().filter(|_| is_open);
            let map = finer
                .and_then(|basis| finer_basis(problem, basis))
                .and_then(|finer| {
                    let map = embedding(problem, function, &finer)?;
                    let start = &map
                        * DVector::from_column_slice(&theta[functions.ranges()[index].clone()]);
                    *function = CoefficientFunction {
                        owner: function.owner.clone(),
                        offset: function.offset.clone(),
                        ..CoefficientFunction::free(
                            function.quantity,
                            finer,
                            grid,
                            start.as_slice().to_vec(),
                        )
                    };
                    Some(map)
                });
            maps.push(map);
        }
        maps.iter().any(Option::is_some).then_some(())?;
        let sets = functions.coefficient_sets().to_vec();
        let finer = Parameterization::with_coefficient_sets(list, sets, grid.nodes(), grid.step())?
            .with_scalars(functions.scalars().to_vec());
        let mut own = problem.clone();
        let parts = own.parts_mut();
        parts.functions = finer;
        parts.penalties.clear();
        parts.variations.clear();
        parts.soft.clear();
        parts.constraints = crate::constraints::Constraints::default();
        Some(Self { problem: own, maps })
    }

    /// Test at the evaluation of the given problem: the finer bases have the same functions.
    fn test(&self, given: &Problem, evaluation: &Evaluation) -> BasisTest {
        let (jacobian, residuals) = reduced_jacobian(&self.problem, evaluation);
        let samples = given.sample_count();
        let mut open: Vec<usize> = (0..self.maps.len())
            .filter(|i| self.maps[*i].is_some())
            .collect();
        let level = LEVEL / open.len() as f64;
        let sizes = given.median_scales(evaluation);
        let mut test = BasisTest {
            level,
            ..BasisTest::default()
        };
        let mut finer: Vec<usize> = Vec::new();
        let mut coarse = Minimum::of(&self.columns(&jacobian, &finer), &residuals);
        // The most significant first: a basis that is too coarse makes other functions appear to vary.
        loop {
            let tests = open.iter().filter_map(|&index| {
                let with = [finer.as_slice(), &[index]].concat();
                let minimum = Minimum::of(&self.columns(&jacobian, &with), &residuals);
                let p_value = minimum.p_value(&coarse, samples)?;
                Some((index, p_value, minimum))
            });
            let mut tests: Vec<(usize, f64, Minimum)> = tests.collect();
            if finer.is_empty() {
                let all = tests.iter();
                test.comparisons = all
                    .map(|(i, p, _)| self.comparison(given, *i, *p))
                    .collect();
            }
            tests.retain(|(_, p_value, _)| *p_value < level);
            if finer.is_empty() {
                test.doubtful = tests.iter().map(|(index, ..)| *index).collect();
            }
            let least = tests.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
            let Some((index, p_value, minimum)) = least else {
                return test;
            };
            let change = self.change(index, &finer, &coarse, &minimum);
            test.coarse
                .push(self.finding(given, index, &change, p_value, sizes[index]));
            open.retain(|i| *i != index);
            finer.push(index);
            coarse = minimum;
        }
    }

    fn comparison(&self, given: &Problem, index: usize, p_value: f64) -> BasisComparison {
        let function = given.functions.get(index);
        BasisComparison {
            function: function.name(),
            parameters: function.parameters(),
            finer: self.problem.functions.get(index).parameters(),
            p_value,
        }
    }

    /// First place of function `index` among the columns with the finer bases `finer`.
    fn position(&self, index: usize, finer: &[usize]) -> usize {
        let count = |i: usize| match &self.maps[i] {
            Some(map) if !finer.contains(&i) => map.ncols(),
            _ => self.problem.functions.get(i).parameters(),
        };
        (0..index).map(count).sum()
    }

    /// Changes of the parameters of function `index` in its finer basis: from the point of linearisation to the minimum with it, and
    /// from the minimum without it.
    fn change(
        &self,
        index: usize,
        finer: &[usize],
        before: &Minimum,
        after: &Minimum,
    ) -> [DVector<f64>; 2] {
        let map = self.maps[index]
            .as_ref()
            .expect("a function with a finer basis");
        let position = self.position(index, finer);
        let to = after.change.rows(position, map.nrows()).into_owned();
        let from = map * before.change.rows(position, map.ncols());
        [to.clone(), to - from]
    }

    /// Columns of the given bases, but of the finer ones for the functions `finer`.
    fn columns(&self, jacobian: &DMatrix<f64>, finer: &[usize]) -> DMatrix<f64> {
        let functions = &self.problem.functions;
        let mut parts: Vec<DMatrix<f64>> = Vec::new();
        for (index, range) in functions.ranges().iter().enumerate() {
            let own = jacobian.columns(range.start, range.len());
            parts.push(match &self.maps[index] {
                Some(map) if !finer.contains(&index) => own * map,
                _ => own.into_owned(),
            });
        }
        let scalars = functions.scalar_range();
        parts.push(jacobian.columns(scalars.start, scalars.len()).into_owned());
        let columns: Vec<_> = parts.iter().flat_map(|p| p.column_iter()).collect();
        DMatrix::from_columns(&columns)
    }

    fn finding(
        &self,
        given: &Problem,
        index: usize,
        [to, change]: &[DVector<f64>; 2],
        p_value: f64,
        size: f64,
    ) -> CoarseBasis {
        let grid = &given.system.grid;
        let function = self.problem.functions.get(index);
        let values = function.design.multiply(change.as_slice(), grid.nodes());
        let largest = values.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let times = grid.times();
        let is_constant = given.functions.is_constant(index);
        let half = |i: usize| function.start[i] + to[i] + function.fixed_at(0);
        CoarseBasis {
            index,
            function: function.name(),
            unit: function.quantity.unit(),
            p_value,
            change: largest / size,
            spans: spans(&times, |i| values[i].abs() >= PLACE * largest),
            knots: match &function.basis {
                Some(basis) if !is_constant => Some(basis.knot_times(grid).len()),
                _ => None,
            },
            halves: is_constant.then(|| [half(0), half(1)]),
        }
    }
}

/// A basis that contains the given one and has about twice as many parameters; `None` for a basis that is as fine as the grid.
pub(crate) fn finer_basis(problem: &Problem, basis: &Basis) -> Option<Basis> {
    let grid = &problem.system.grid;
    let halved = |knots: &[f64]| -> Vec<f64> {
        let pairs = knots
            .windows(2)
            .flat_map(|pair| [pair[0], 0.5 * (pair[0] + pair[1])]);
        pairs.chain(knots.last().copied()).collect()
    };
    let finer = match basis {
        Basis::Nodal => return None,
        Basis::Constant => Basis::PiecewiseConstant {
            knots: halved(&basis.knot_times(grid)),
        },
        Basis::PiecewiseConstant { knots } => Basis::PiecewiseConstant {
            knots: halved(knots),
        },
        Basis::PiecewiseLinear { knots } => Basis::PiecewiseLinear {
            knots: halved(knots),
        },
        Basis::BSpline { knots } => Basis::BSpline {
            knots: halved(knots),
        },
        Basis::Polynomial { degree } => Basis::Polynomial {
            degree: 2 * degree + 1,
        },
    };
    let most = match finer {
        Basis::Polynomial { .. } => Basis::highest_degree(grid),
        _ => grid.nodes() / 2,
    };
    (finer.parameters(grid) <= most).then_some(finer)
}

/// Parameters in the `finer` basis of the functions of a basis, as columns.
fn embedding(
    problem: &Problem,
    function: &CoefficientFunction,
    finer: &Basis,
) -> Option<DMatrix<f64>> {
    let grid = &problem.system.grid;
    let own = function.basis.as_ref()?;
    // The functions are those of the finer basis, so any grid with several nodes in each of its cells gives the same.
    let knots = finer.knot_times(grid);
    let narrowest = knots.windows(2).map(|ends| ends[1] - ends[0]);
    let narrowest = narrowest.fold(grid.duration(), f64::min);
    let nodes = (EMBEDDING_NODES * grid.duration() / narrowest) as usize
        + EMBEDDING_NODES as usize * finer.parameters(grid);
    let coarse = Grid::new(grid.start(), grid.duration(), nodes).filter(|_| nodes < grid.nodes());
    let grid = coarse.as_ref().unwrap_or(grid);
    let design = own.design(grid);
    let mut unit = vec![0.0; own.parameters(grid)];
    let mut columns = Vec::with_capacity(unit.len());
    for j in 0..unit.len() {
        unit[j] = 1.0;
        let values = design.multiply(&unit, grid.nodes());
        unit[j] = 0.0;
        columns.push(DVector::from_vec(finer.project(grid, &values)?));
    }
    Some(DMatrix::from_columns(&columns))
}
