//! Does a function vary at all?
//!
//! For each function the model is fitted as it is and with that function constant. The statistic is
//! the likelihood ratio
//!
//! ```text
//! LR = J(constant) - J(varying)                     with sigma
//!    = n ln(J(constant) / J(varying))               without, n readings
//! ```
//!
//! on whole costs, penalties and priors included. Its distribution when the function is constant is
//! not a chi-square once there are penalties, so it is simulated: readings of the constant model
//! with seeded normal noise, both models refitted to their linearisation at the constant optimum,
//! penalties and priors included, inequality constraints left out: bounds that hold the varying model
//! alone make the test err towards constant, one that holds the constant itself towards varying. The
//! p-value is `(1 + how many simulated LR are at least the observed) / (1 + simulations)`.
//!
//! Source: A. C. Davison, D. V. Hinkley, *Bootstrap Methods and their Application*, Cambridge 1997,
//! section 4.2.

use super::parallel::map;
use super::refit::{nearest, settings, sizes};
use super::simulate::{normal, sigmas, stream};
use crate::constraints::{Constraints, RowGroup, Rows};
use crate::dynamics::Breakdown;
use crate::functions::{CoefficientFunction, Design, Functions, Penalty};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::solvers::{fit_from, weighted_jacobian};
use nalgebra::{DMatrix, DVector};
use nalgebra_sparse::{CooMatrix, CsrMatrix};

/// Singular values below this share of the largest are directions that nothing sees.
const UNSEEN: f64 = 1e-10;

/// The verdict on one function.
#[derive(Debug, Clone, PartialEq)]
pub struct Varies {
    /// Its name.
    pub function: String,
    /// Index in the list of functions.
    pub index: usize,
    /// The likelihood ratio.
    pub statistic: f64,
    /// Its p-value under the constant model.
    pub p_value: f64,
    /// Simulations behind it.
    pub simulations: usize,
    /// BIC of the constant model less that of the varying one, every parameter counted, `LR - (extra
    /// parameters) ln n`: positive speaks for varying. Penalised parameters count in full, so with
    /// penalties it is too hard on them.
    pub bic: f64,
    /// The constant that fits best, in the unit of the function.
    pub constant: f64,
    /// Its unit.
    pub unit: String,
    /// Largest p-value called varying.
    pub level: f64,
}

impl Varies {
    /// Whether the readings say that it varies.
    pub fn varies(&self) -> bool {
        self.p_value <= self.level
    }

    /// In words.
    pub fn sentence(&self) -> String {
        let Self {
            function,
            p_value,
            statistic,
            ..
        } = self;
        match self.varies() {
            true => format!(
                "{function} varies: a constant would fit worse by {statistic:.1}, which chance brings \
                 with a probability of {p_value:.3}"
            ),
            false => format!(
                "{function} may be constant, {:.6} {}: varying lowers the misfit by {statistic:.1}, \
                 as chance does with a probability of {p_value:.2}",
                self.constant, self.unit
            ),
        }
    }
}

/// How the question is asked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asking {
    /// Largest p-value called varying, as 0.05.
    pub level: f64,
    /// Simulated records.
    pub simulations: usize,
    /// Their seed.
    pub seed: u64,
    /// Most threads; the result does not depend on it.
    pub threads: usize,
}

impl Default for Asking {
    fn default() -> Self {
        Self {
            level: 0.05,
            simulations: 399,
            seed: 1,
            threads: 1,
        }
    }
}

/// The verdict on every function that could vary, from `optimum`, where the problem was fitted.
///
/// # Errors
/// A [`Breakdown`] if the optimum, or a constant in its place, has no motion.
pub fn variation(
    problem: &Problem,
    optimum: &[f64],
    how: &Asking,
) -> Result<Vec<Varies>, Breakdown> {
    let varies = |f: &usize| problem.functions.ranges()[*f].len() > 1;
    let each = (0..problem.functions.ranges().len()).filter(varies);
    each.map(|f| of_function(problem, optimum, f, how))
        .collect()
}

/// The verdict on function `function` alone.
///
/// # Errors
/// As [`variation`].
pub fn of_function(
    problem: &Problem,
    optimum: &[f64],
    function: usize,
    how: &Asking,
) -> Result<Varies, Breakdown> {
    let reduced = Reduced::new(problem, function);
    let start = reduced.mean_of(optimum);
    let sizes_of = sizes(&reduced.problem, &start);
    let start = nearest(&reduced.problem, &start, &sizes_of).unwrap_or(start);
    let constant = fit_from(&reduced.problem, &start, &settings())?.best;
    let embedded = reduced.embed(&constant.parameters);
    let there = fit_from(problem, optimum, &settings())?
        .best
        .evaluation
        .cost;
    let here = fit_from(problem, &embedded, &settings())?
        .best
        .evaluation
        .cost;
    let readings = problem.reading_count() as f64;
    let sigma = problem.channels().all(|c| c.weighting().is_sigma());
    let ratio = |constant: f64, varying: f64| match sigma {
        true => constant - varying,
        false => readings * (constant / varying.max(f64::MIN_POSITIVE)).ln(),
    };
    let statistic = ratio(constant.evaluation.cost, there.min(here));
    let evaluation = problem.evaluate(&embedded)?;
    let linear = Linearised::new(problem, &reduced, &embedded, &evaluation);
    let simulated = map(how.simulations, how.threads, |index| {
        let [constant, varying] = linear.costs(how.seed, index);
        ratio(constant, varying)
    });
    let above = simulated.iter().filter(|s| **s >= statistic).count();
    let list = problem.functions.get(function);
    let extra = (problem.parameters() - reduced.problem.parameters()) as f64;
    Ok(Varies {
        function: list.name(),
        index: function,
        statistic,
        p_value: (1 + above) as f64 / (1 + how.simulations) as f64,
        simulations: how.simulations,
        bic: statistic - extra * readings.ln(),
        constant: constant.parameters[reduced.place],
        unit: list.quantity.unit().to_owned(),
        level: how.level,
    })
}

/// The problem with one function constant, and how its parameters become those of the whole one.
struct Reduced {
    problem: Problem,
    function: usize,
    /// Where the constant stands.
    place: usize,
    /// Number of parameters of the function that it replaces, and those of the constant 1.
    one: Vec<f64>,
}

impl Reduced {
    fn new(problem: &Problem, function: usize) -> Self {
        let grid = &problem.oscillator.grid;
        let whole = problem.functions.get(function);
        let one = match &whole.basis {
            Some(basis) => basis.constant(grid, 1.0),
            None => Vec::new(),
        };
        let place = problem.functions.ranges()[function].start;
        let mut list: Vec<CoefficientFunction> = problem.functions.iter().cloned().collect();
        let nodes = problem.functions.nodes();
        let constant = CoefficientFunction {
            owner: whole.owner.clone(),
            offset: whole.offset.clone(),
            ..CoefficientFunction::constant(whole.quantity, 0.0, nodes)
        };
        list[function] = constant;
        let devices = problem.functions.assemblies().to_vec();
        let functions = Functions::with_devices(list, devices, nodes, grid.step())
            .expect("a constant instead of a function stays independent")
            .with_scalars(problem.functions.scalars().to_vec());
        let mut reduced = Self {
            problem: Problem {
                functions,
                ..problem.clone()
            },
            function,
            place,
            one,
        };
        reduced.rewrite(problem);
        reduced
    }

    /// Constraints and penalties in the parameters of the reduced problem.
    fn rewrite(&mut self, whole: &Problem) {
        let groups = |list: &[RowGroup]| -> Vec<RowGroup> {
            let each = list.iter().map(|group| RowGroup {
                rows: self.rows(&group.rows),
                ..group.clone()
            });
            each.collect()
        };
        let mut constraints = Constraints {
            groups: groups(&whole.constraints.groups),
            cones: whole.constraints.cones.clone(),
        };
        for cone in constraints.cones.iter_mut().flat_map(|g| &mut g.cones) {
            cone.rows = self.rows(&cone.rows);
        }
        // Rows about the function's shape have nothing left to say.
        for group in &mut constraints.groups {
            let mut kept = RowGroup {
                rows: Rows::new(),
                upper: Vec::new(),
                times: Vec::new(),
                ..group.clone()
            };
            for i in 0..group.rows.len() {
                if group.rows.scale(i) > 1e-12 {
                    kept.push(group.rows.row(i), group.bounds(i), group.times[i]);
                }
            }
            *group = kept;
        }
        let soft = groups(&whole.soft);
        let penalties = whole
            .penalties
            .iter()
            .filter_map(|p| self.penalty(p))
            .collect();
        let variations = whole.variations.iter();
        let variations = variations.filter(|v| v.function != self.function).cloned();
        let variations = variations.collect();
        self.problem.constraints = constraints;
        self.problem.soft = soft;
        self.problem.penalties = penalties;
        self.problem.variations = variations;
    }

    /// `A M` for `theta = M theta'`.
    fn rows(&self, rows: &Rows) -> Rows {
        let mut out = Rows::new();
        for (i, right) in rows.right().iter().enumerate() {
            out.push(rows.row(i).map(|(j, a)| self.column(j, a)), *right);
        }
        out
    }

    fn column(&self, j: usize, a: f64) -> (usize, f64) {
        let end = self.place + self.one.len();
        match j {
            _ if j < self.place => (j, a),
            _ if j < end => (self.place, a * self.one[j - self.place]),
            _ => (j + 1 - self.one.len(), a),
        }
    }

    /// A penalty of the function: one of a derivative is nothing for a constant.
    fn penalty(&self, penalty: &Penalty) -> Option<Penalty> {
        if penalty.function != self.function {
            return Some(penalty.clone());
        }
        if penalty.order > 0 {
            return None;
        }
        let rows = penalty.target.len();
        let column = penalty.rows.multiply(&self.one, rows);
        let mut matrix = CooMatrix::new(rows, 1);
        for (i, a) in column.into_iter().enumerate() {
            matrix.push(i, 0, a);
        }
        Some(Penalty {
            rows: Design::Sparse(CsrMatrix::from(&matrix)),
            ..penalty.clone()
        })
    }

    /// The parameters of the whole problem.
    fn embed(&self, theta: &[f64]) -> Vec<f64> {
        let function = self.one.iter().map(|one| one * theta[self.place]);
        let before = theta[..self.place].iter().copied();
        let after = theta[self.place + 1..].iter().copied();
        before.chain(function).chain(after).collect()
    }

    /// Those of the reduced one, with the mean of the function's values.
    fn mean_of(&self, theta: &[f64]) -> Vec<f64> {
        let end = self.place + self.one.len();
        // The constant nearest to the parameters.
        let along: f64 = self
            .one
            .iter()
            .zip(&theta[self.place..end])
            .map(|(o, t)| o * t)
            .sum();
        let own: f64 = self.one.iter().map(|o| o * o).sum();
        [&theta[..self.place], &[along / own], &theta[end..]].concat()
    }
}

/// Both models, linearised at the constant optimum.
struct Linearised {
    /// Orthonormal columns that span what each model can do: constant, varying.
    spans: [DMatrix<f64>; 2],
    /// Number of readings, root weight times sigma of each.
    noise: Vec<f64>,
    /// What penalties and priors ask for.
    asked: Vec<f64>,
}

impl Linearised {
    fn new(problem: &Problem, reduced: &Reduced, theta: &[f64], here: &Evaluation) -> Self {
        let (jacobian, _) = weighted_jacobian(problem, here);
        let n = theta.len();
        let ranges = problem.functions.ranges();
        let mut rest: Vec<(DVector<f64>, f64)> = Vec::new();
        for penalty in &problem.penalties {
            let range = ranges[penalty.function].clone();
            let root = penalty.weight.sqrt();
            let residuals = penalty.residuals(&theta[range.clone()]);
            for (i, r) in residuals.iter().enumerate() {
                let mut row = DVector::zeros(n);
                penalty
                    .rows
                    .row(i)
                    .for_each(|(j, a)| row[range.start + j] += root * a);
                rest.push((row, -root * r));
            }
        }
        let scalars = problem.functions.scalar_range();
        for (j, scalar) in scalars.zip(problem.functions.scalars()) {
            if let Some(prior) = scalar.prior {
                let mut row = DVector::zeros(n);
                row[j] = 1.0 / prior.sigma;
                rest.push((row, (prior.mean - theta[j]) / prior.sigma));
            }
        }
        let readings = jacobian.nrows();
        let mut varying = jacobian.resize_vertically(readings + rest.len(), 0.0);
        for (i, (row, _)) in rest.iter().enumerate() {
            varying.set_row(readings + i, &row.transpose());
        }
        let mut embedding = DMatrix::zeros(n, reduced.problem.parameters());
        for j in 0..n {
            let (column, a) = reduced.column(j, 1.0);
            embedding[(j, column)] = a;
        }
        let constant = &varying * embedding;
        let sigmas = sigmas(&reduced.problem, here);
        let roots = problem
            .channels()
            .flat_map(|c| (0..c.len()).map(|i| c.weighting().weight(i, c.len()).sqrt()));
        Self {
            spans: [span(constant), span(varying)],
            noise: roots
                .zip(&sigmas)
                .map(|(root, sigma)| root * sigma)
                .collect(),
            asked: rest.iter().map(|(_, b)| *b).collect(),
        }
    }

    /// Least costs of both models for simulated readings `index`.
    fn costs(&self, seed: u64, index: usize) -> [f64; 2] {
        let mut random = stream(seed, index);
        let unit = normal(&mut random, self.noise.len());
        let errors = unit.iter().zip(&self.noise).map(|(u, s)| u * s);
        let right: Vec<f64> = errors.chain(self.asked.iter().copied()).collect();
        let right = DVector::from_vec(right);
        let cost = |span: &DMatrix<f64>| {
            let inside = span * span.tr_mul(&right);
            (&right - inside).norm_squared()
        };
        [cost(&self.spans[0]), cost(&self.spans[1])]
    }
}

/// An orthonormal basis of the columns' span; columns are first scaled to size 1, for parameters have
/// units.
fn span(mut matrix: DMatrix<f64>) -> DMatrix<f64> {
    for mut column in matrix.column_iter_mut() {
        let size = column.norm();
        if size > 0.0 {
            column /= size;
        }
    }
    let svd = matrix.svd(true, false);
    let most = svd.singular_values.max();
    let seen: Vec<usize> = (0..svd.singular_values.len())
        .filter(|i| svd.singular_values[*i] > UNSEEN * most)
        .collect();
    let u = svd.u.expect("asked for");
    u.select_columns(&seen)
}
