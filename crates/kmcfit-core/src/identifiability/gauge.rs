//! The directions in which the response cannot change: the common scale of the functions.
//!
//! With `f = 0` the response of `s(t) (m, c, k)` is that of `(m, c, k)`. At a point, `s = 1 + epsilon sigma(t)`
//! changes the functions by `delta p_j = epsilon sigma(t) p_j`, for all `j` alike. A gauge direction is a
//! `delta theta` that does this in every basis, with `sigma = 0` where a force acts or a function that
//! is known is not zero, and that no equality constraint forbids.

use super::components::{Component, components};
use super::directions::Directions;
use super::factorisation::{column_space, null_space};
use super::sensitivity::SingularSpectrum;
use crate::functions::Design;
use crate::problem::Problem;
use crate::system::quadrature::trapezoid_weights;
use nalgebra::{DMatrix, DVector};

/// What is left of a relation that holds, relative to the functions' sizes.
const HOLDS: f64 = 1e-8;
/// A direction is named after the gauge if this share of its squared norm lies there.
pub const MOSTLY: f64 = 0.9;
/// Up to so many nodes the scale over time is written node by node, beyond by so many hats.
const MOST_FACTORS: usize = 200;

/// One gauge direction.
#[derive(Debug, Clone, PartialEq)]
pub struct GaugeDirection {
    /// `scale of (m, c, k)`, or `scale over time s(t) of (m, c, k)`.
    pub name: String,
    /// Whether the factor is the same at all times.
    pub constant: bool,
    /// The factor `sigma` at the nodes, without unit.
    pub factor: Vec<f64>,
    /// The change of the parameters.
    pub change: Vec<f64>,
}

/// All gauge directions at a point.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Gauge {
    /// For each set of functions with one scale: the constant factor first, where it is free, then a
    /// basis of the factors over time (whose span contains it).
    pub directions: Vec<GaugeDirection>,
}

/// A direction that the samples do not see, with the name of what it does.
#[derive(Debug, Clone, PartialEq)]
pub struct Named {
    /// The gauge it belongs to.
    pub name: String,
    /// The share of its squared norm that lies in the gauge space.
    pub share: f64,
    /// Its change of the parameters.
    pub change: Vec<f64>,
}

impl Gauge {
    /// The gauge directions at the parameters `theta`.
    pub fn at(problem: &Problem, theta: &[f64]) -> Self {
        let values = problem.functions.values(theta);
        let mut directions = Vec::new();
        for component in components(problem) {
            let symbols = component.symbols(problem);
            let Some(factors) = factors(problem, &component, &values) else {
                continue;
            };
            let nodes = problem.functions.nodes();
            let make = |factor: &[f64], constant: bool| GaugeDirection {
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
            // Nothing but the constant: said once.
            if constant.is_some() && free.len() == 1 {
                directions.extend(constant);
            } else {
                directions.extend(constant.into_iter().chain(free));
            }
        }
        Self { directions }
    }

    /// Whether nothing is free.
    pub fn is_empty(&self) -> bool {
        self.directions.is_empty()
    }

    /// The constant factors.
    pub fn constant(&self) -> impl Iterator<Item = &GaugeDirection> {
        self.directions.iter().filter(|d| d.constant)
    }

    /// The factors over time; none where only a constant one is free.
    pub fn over_time(&self) -> impl Iterator<Item = &GaugeDirection> {
        self.directions.iter().filter(|d| !d.constant)
    }

    /// An orthonormal basis of the gauge space in the scaled directions, as columns.
    pub fn basis(&self, directions: &Directions) -> DMatrix<f64> {
        basis_of(self.directions.iter(), directions)
    }

    /// The share of the squared norm of a change of the parameters that lies in the gauge space, in
    /// scaled directions.
    pub fn share(&self, change: &[f64], directions: &Directions) -> f64 {
        let z = DVector::from_vec(directions.nearest(change));
        let inside = self.basis(directions).tr_mul(&z);
        inside.norm_squared() / z.norm_squared().max(f64::MIN_POSITIVE)
    }

    /// The directions that the samples do not see and that are mostly gauge: constant factors
    /// first, then those over time, orthogonal to them. The rest of [`SingularSpectrum::unseen`] has other
    /// reasons.
    pub fn unseen(&self, spectrum: &SingularSpectrum) -> Vec<Named> {
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
    list: impl Iterator<Item = &'a GaugeDirection>,
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

/// The directions of the space `basis` (orthonormal columns) that are not seen: principal directions
/// between it and the null space.
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

/// The combinations of `directions` that no equality constraint forbids.
fn obeying(problem: &Problem, directions: Vec<GaugeDirection>) -> Vec<GaugeDirection> {
    let Some(first) = directions.first() else {
        return directions;
    };
    let mut rows = Vec::new();
    for group in &problem.constraints.groups {
        for i in 0..group.rows.len() {
            let [lower, upper] = group.bounds(i);
            if lower == upper {
                let answer = |d: &GaugeDirection| -> f64 {
                    group.rows.row(i).map(|(j, a)| a * d.change[j]).sum()
                };
                let answers: Vec<f64> = directions.iter().map(answer).collect();
                // Against the row's own terms, so that a rounded zero is one.
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
    let combined = |of: &dyn Fn(&GaugeDirection) -> &Vec<f64>| {
        let columns: Vec<DVector<f64>> = (directions.iter())
            .map(|d| DVector::from_column_slice(of(d)))
            .collect();
        DMatrix::from_columns(&columns) * &kept
    };
    let (factors, changes) = (combined(&|d| &d.factor), combined(&|d| &d.change));
    let pairs = factors.column_iter().zip(changes.column_iter());
    let each = pairs.map(|(factor, change)| GaugeDirection {
        name: first.name.clone(),
        constant: first.constant,
        factor: factor.as_slice().to_vec(),
        change: change.as_slice().to_vec(),
    });
    each.collect()
}

/// An orthonormal basis of the factors at the nodes that every function of the component can follow
/// and that vanish where the scale is fixed; `None` if there are none.
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

/// One factor per node at which the scale is open, or hats over time where these are many.
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
        Design::Sparse(rows) => rows.dense(),
    }
}

/// The change of all parameters that multiplies the component's functions by `factor`.
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
            design @ Design::Sparse(_) => {
                let gram = functions.gram(f);
                let mut step = vec![0.0; part.len()];
                // Twice: the second pass removes what the normal equations lose.
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
