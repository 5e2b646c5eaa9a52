//! Scaling ambiguity: directions in parameter space that leave the response unchanged.
//!
//! For `f = 0` the response of `s(t) (m, c, k)` equals that of `(m, c, k)`. To first order, `s = 1 + epsilon sigma(t)`
//! changes all functions by `delta p_j = epsilon sigma(t) p_j`. A scaling direction is a `delta theta` that represents
//! this change in every basis, with `sigma = 0` where a force acts or a fixed function is nonzero, and that satisfies all
//! equality constraints.

use super::components::{Component, components};
use super::directions::Directions;
use super::factorisation::{column_space, null_space};
use super::sensitivity::SingularSpectrum;
use crate::functions::Design;
use crate::problem::Problem;
use crate::system::quadrature::trapezoid_weights;
use nalgebra::{DMatrix, DVector};

/// Relative residual below which a relation holds, relative to the functions' sizes.
const HOLDS: f64 = 1e-8;
/// Share of the squared norm in the space of scaling directions above which an undetermined direction is named a scaling.
pub const MOSTLY: f64 = 0.9;
/// Number of nodes up to which the factor over time is represented node by node; beyond it, by so many hats.
const MOST_FACTORS: usize = 200;

/// One scaling direction.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalingDirection {
    /// `scale of (m, c, k)`, or `scale over time s(t) of (m, c, k)`.
    pub name: String,
    /// True for a factor constant in time.
    pub constant: bool,
    /// Factor `sigma` at the nodes, dimensionless.
    pub factor: Vec<f64>,
    /// Change of the parameters.
    pub change: Vec<f64>,
}

/// All scaling directions at a point.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ScalingAmbiguity {
    /// For each group of functions with a common scale: the constant factor first, where it is free, then a basis of the
    /// factors over time, whose span contains the constant one.
    pub directions: Vec<ScalingDirection>,
}

/// An undetermined direction that is mostly a scaling.
#[derive(Debug, Clone, PartialEq)]
pub struct Named {
    /// Name of the scaling.
    pub name: String,
    /// Share of the squared norm in the space of scaling directions.
    pub share: f64,
    /// Change of the parameters.
    pub change: Vec<f64>,
}

impl ScalingAmbiguity {
    /// Scaling directions at the parameters `theta`.
    pub fn at(problem: &Problem, theta: &[f64]) -> Self {
        let values = problem.functions.values(theta);
        let mut directions = Vec::new();
        for component in components(problem) {
            let symbols = component.symbols(problem);
            let Some(factors) = factors(problem, &component, &values) else {
                continue;
            };
            let nodes = problem.functions.nodes();
            let make = |factor: &[f64], constant: bool| ScalingDirection {
                name: match constant {
                    true => format!("scale of {symbols}"),
                    false => format!("scale over time s(t) of {symbols}"),
                },
                constant,
                factor: factor.to_vec(),
                change: change(problem, &component, &values, factor),
            };
            let ones = DVector::from_element(nodes, 1.0 / (nodes as f64).sqrt());
            let inside = &factors * factors.tr_mul(&ones);
            let constant = (inside - &ones).norm() <= HOLDS;
            let each = factors.column_iter().map(|f| make(f.as_slice(), false));
            let free = obeying(problem, each.collect());
            let constant = (constant)
                .then(|| make(&vec![1.0; nodes], true))
                .filter(|c| obeying(problem, vec![c.clone()]).len() == 1);
            // The factors over time contain no more than the constant one.
            if constant.is_some() && free.len() == 1 {
                directions.extend(constant);
            } else {
                directions.extend(constant.into_iter().chain(free));
            }
        }
        Self { directions }
    }

    /// True if the scale of all functions is determined.
    pub fn is_empty(&self) -> bool {
        self.directions.is_empty()
    }

    /// Constant factors.
    pub fn constant(&self) -> impl Iterator<Item = &ScalingDirection> {
        self.directions.iter().filter(|d| d.constant)
    }

    /// Factors over time; empty where only constant factors are free.
    pub fn over_time(&self) -> impl Iterator<Item = &ScalingDirection> {
        self.directions.iter().filter(|d| !d.constant)
    }

    /// Orthonormal basis of the scaling directions in scaled directions, as columns.
    pub fn basis(&self, directions: &Directions) -> DMatrix<f64> {
        basis_of(self.directions.iter(), directions)
    }

    /// Share of the squared norm of a parameter change in the space of scaling directions, in scaled directions.
    pub fn share(&self, change: &[f64], directions: &Directions) -> f64 {
        let z = DVector::from_vec(directions.nearest(change));
        let inside = self.basis(directions).tr_mul(&z);
        inside.norm_squared() / z.norm_squared().max(f64::MIN_POSITIVE)
    }

    /// Undetermined directions that are mostly scalings: constant factors first, then factors over time, orthogonal to them.
    /// The remaining directions of [`SingularSpectrum::undetermined`] have other causes.
    pub fn undetermined(&self, spectrum: &SingularSpectrum) -> Vec<Named> {
        let directions = spectrum.directions();
        let mut named = Vec::new();
        let constant = basis_of(self.constant(), directions);
        named.extend(unseen_in(
            spectrum,
            &constant,
            self.constant().next().map(|d| d.name.as_str()),
        ));
        let all = basis_of(self.over_time(), directions);
        let inside = constant.tr_mul(&all);
        let rest = match all.ncols() {
            0 => all,
            _ => column_space(&(&all - &constant * inside), HOLDS),
        };
        named.extend(unseen_in(
            spectrum,
            &rest,
            self.over_time().next().map(|d| d.name.as_str()),
        ));
        named
    }
}

fn basis_of<'a>(
    list: impl Iterator<Item = &'a ScalingDirection>,
    directions: &Directions,
) -> DMatrix<f64> {
    let columns: Vec<DVector<f64>> = list
        .map(|d| DVector::from_vec(directions.nearest(&d.change)).normalize())
        .collect();
    match columns.is_empty() {
        true => DMatrix::zeros(directions.len(), 0),
        false => column_space(&DMatrix::from_columns(&columns), HOLDS),
    }
}

/// Undetermined directions in the space `basis` (orthonormal columns): principal directions between it and the null space.
fn unseen_in(spectrum: &SingularSpectrum, basis: &DMatrix<f64>, name: Option<&str>) -> Vec<Named> {
    let Some(name) = name else {
        return Vec::new();
    };
    if basis.ncols() == 0 {
        return Vec::new();
    }
    let hidden = spectrum.unseen_part(basis);
    let svd = hidden.clone().svd(false, true);
    let right = svd.v_t.expect("asked for");
    let mut found = Vec::new();
    for (k, cosine) in svd.singular_values.iter().enumerate() {
        let share = cosine * cosine;
        if share > MOSTLY {
            let z = &hidden * right.row(k).transpose() / *cosine;
            found.push(Named {
                name: name.to_owned(),
                share,
                change: spectrum.directions().to_parameters(z.as_slice()),
            });
        }
    }
    found
}

/// Combinations of `directions` that satisfy all equality constraints.
fn obeying(problem: &Problem, directions: Vec<ScalingDirection>) -> Vec<ScalingDirection> {
    let Some(first) = directions.first() else {
        return directions;
    };
    let mut rows = Vec::new();
    for group in &problem.constraints.groups {
        for i in 0..group.rows.len() {
            let [lower, upper] = group.bounds(i);
            if lower == upper {
                let answer = |d: &ScalingDirection| -> f64 {
                    group.rows.row(i).map(|(j, a)| a * d.change[j]).sum()
                };
                let answers: Vec<f64> = directions.iter().map(answer).collect();
                // Relative to the terms of the row, so that rounding errors count as zero.
                let size = directions.iter().fold(0.0f64, |most, d| {
                    let terms = group.rows.row(i).map(|(j, a)| (a * d.change[j]).abs());
                    most.max(terms.sum())
                });
                if size > 0.0 {
                    rows.push(answers.into_iter().map(|a| a / size).collect::<Vec<f64>>());
                }
            }
        }
    }
    if rows.is_empty() {
        return directions;
    }
    let matrix = DMatrix::from_fn(rows.len(), directions.len(), |i, j| rows[i][j]);
    let kept = null_space(&matrix, HOLDS);
    let combined = |of: &dyn Fn(&ScalingDirection) -> &Vec<f64>| {
        let columns: Vec<DVector<f64>> = (directions.iter())
            .map(|d| DVector::from_column_slice(of(d)))
            .collect();
        DMatrix::from_columns(&columns) * &kept
    };
    let (factors, changes) = (combined(&|d| &d.factor), combined(&|d| &d.change));
    let pairs = factors.column_iter().zip(changes.column_iter());
    let each = pairs.map(|(factor, change)| ScalingDirection {
        name: first.name.clone(),
        constant: first.constant,
        factor: factor.as_slice().to_vec(),
        change: change.as_slice().to_vec(),
    });
    each.collect()
}

/// Orthonormal basis of the factors at the nodes that the bases of all functions of the component represent and that vanish
/// where the scale is determined; `None` if there are none.
fn factors(problem: &Problem, component: &Component, values: &[Vec<f64>]) -> Option<DMatrix<f64>> {
    let (forced, known) = (component.forced(problem), component.known(problem));
    let nodes = forced.len();
    let open: Vec<bool> = (0..nodes).map(|i| !forced[i] && !known[i]).collect();
    let function = |f: usize| problem.functions.get(f);
    let free = |f: &usize| function(*f).parameters() > 0;
    let nonzero = |f: &usize| values[*f].iter().all(|p| *p != 0.0);
    let zero = |f: &usize| values[*f].iter().all(|p| *p == 0.0);
    let base = (component.functions.iter().copied())
        .filter(|f| free(f) && nonzero(f))
        .min_by_key(|f| function(*f).parameters())?;
    let is_nodal = |f: &usize| matches!(function(*f).design, Design::Identity);
    let limited: Vec<usize> = (component.functions.iter().copied())
        .filter(|f| *f != base && free(f) && !is_nodal(f) && !zero(f))
        .collect();
    let space = if is_nodal(&base) {
        nodal_factors(&open)
    } else {
        let matrix = dense(&function(base).design, nodes);
        let over = |i: usize, j: usize| matrix[(i, j)] / values[base][i];
        let matrix = DMatrix::from_fn(nodes, matrix.ncols(), over);
        column_space(&matrix, HOLDS * HOLDS)
    };
    if space.ncols() == 0 {
        return None;
    }
    let closed = (0..nodes).filter(|i| !open[*i]);
    let mut rows: Vec<DMatrix<f64>> = Vec::new();
    let closed: Vec<usize> = closed.collect();
    rows.push(space.select_rows(&closed));
    for f in limited {
        let most = values[f].iter().fold(0.0f64, |m, p| m.max(p.abs()));
        let mut scaled = space.clone();
        for (mut row, p) in scaled.row_iter_mut().zip(&values[f]) {
            row *= *p / most;
        }
        let range = column_space(&dense(&function(f).design, nodes), HOLDS * HOLDS);
        let inside = range.tr_mul(&scaled);
        rows.push(scaled - range * inside);
    }
    let total: usize = rows.iter().map(DMatrix::nrows).sum();
    let mut conditions = DMatrix::zeros(total, space.ncols());
    let mut first = 0;
    for part in &rows {
        conditions.rows_mut(first, part.nrows()).copy_from(part);
        first += part.nrows();
    }
    let kept = null_space(&conditions, HOLDS);
    (kept.ncols() > 0).then(|| space * kept)
}

/// One factor per node with a free scale, or hats over time for many nodes.
fn nodal_factors(open: &[bool]) -> DMatrix<f64> {
    let nodes = open.len();
    let free: Vec<usize> = (0..nodes).filter(|i| open[*i]).collect();
    if free.len() <= MOST_FACTORS {
        return DMatrix::from_fn(nodes, free.len(), |i, k| f64::from(u8::from(free[k] == i)));
    }
    let spacing = (nodes - 1) as f64 / (MOST_FACTORS - 1) as f64;
    let hat = |i: usize, k: usize| match open[i] {
        true => (1.0 - (i as f64 / spacing - k as f64).abs()).max(0.0),
        false => 0.0,
    };
    column_space(&DMatrix::from_fn(nodes, MOST_FACTORS, hat), HOLDS)
}

fn dense(design: &Design, nodes: usize) -> DMatrix<f64> {
    match design {
        Design::Empty => DMatrix::zeros(nodes, 0),
        Design::Identity => DMatrix::identity(nodes, nodes),
        Design::Constant { .. } => DMatrix::from_element(nodes, 1, 1.0),
        Design::Sparse(rows) => rows.dense(),
    }
}

/// Change of all parameters that multiplies the functions of the component by `factor`.
fn change(
    problem: &Problem,
    component: &Component,
    values: &[Vec<f64>],
    factor: &[f64],
) -> Vec<f64> {
    let functions = &problem.functions;
    let weights = trapezoid_weights(functions.nodes(), problem.system.grid.step());
    let mut change = vec![0.0; problem.parameters()];
    for &f in &component.functions {
        let range = functions.ranges()[f].clone();
        let product: Vec<f64> = values[f].iter().zip(factor).map(|(p, s)| p * s).collect();
        let part = &mut change[range];
        match &functions.get(f).design {
            Design::Empty => {}
            Design::Identity => part.copy_from_slice(&product),
            design @ (Design::Sparse(_) | Design::Constant { .. }) => {
                let gram = functions.gram(f);
                let mut step = vec![0.0; part.len()];
                // A second pass removes the error of the normal equations.
                for _ in 0..2 {
                    let now = design.multiply(part, functions.nodes());
                    let rest = product.iter().zip(&now).zip(&weights);
                    let rest: Vec<f64> = rest.map(|((p, n), w)| w * (p - n)).collect();
                    let mut dual = vec![0.0; part.len()];
                    design.transpose_multiply_add(&rest, &mut dual);
                    gram.solve(&dual, &mut step);
                    part.iter_mut().zip(&step).for_each(|(p, s)| *p += s);
                }
            }
        }
    }
    change
}
