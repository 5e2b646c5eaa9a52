//! Curves: functions and ratios over time, and the quantities that are their values and means.

use super::basis_error::basis_error;
use super::quantity::Quantity;
use crate::functions::{Formula, MOST_COEFFICIENTS, Ratio};
use crate::problem::Problem;
use crate::system::quadrature::trapezoid_weights;

/// A number that varies with time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Curve {
    /// The function with this index.
    Function(usize),
    /// A ratio of the shared coefficient set.
    Ratio(Ratio),
}

/// A formula of coefficients, each a sum of functions.
pub(crate) struct Terms {
    pub name: String,
    pub unit: &'static str,
    /// Indices of the functions of each coefficient: its own and its known parts.
    pub coefficients: Vec<Vec<usize>>,
    formula: Formula,
}

impl Curve {
    /// All functions.
    pub(super) fn functions(problem: &Problem) -> Vec<Self> {
        (0..problem.functions.ranges().len())
            .map(Self::Function)
            .collect()
    }

    /// All ratios.
    pub(super) fn ratios() -> Vec<Self> {
        Ratio::ALL.map(Self::Ratio).to_vec()
    }

    /// Its formula; `None` for a ratio that the system does not have: without its terms, or of several coordinates.
    pub(crate) fn terms(self, problem: &Problem) -> Option<Terms> {
        match self {
            Self::Function(f) => {
                let function = problem.functions.get(f);
                Some(Terms {
                    name: function.name(),
                    unit: function.quantity.unit(),
                    coefficients: vec![vec![f]],
                    formula: |[p, _, _]| (p, [1.0, 0.0, 0.0]),
                })
            }
            Self::Ratio(ratio) => {
                let structure = &problem.system.structure;
                let indices = ratio
                    .indices(structure.laws())
                    .filter(|_| structure.is_one())?;
                let set = problem.functions.coefficient_set(0);
                let functions = |index: usize| -> Vec<usize> {
                    let parts = set.parts().filter(|(other, _)| *other == index);
                    parts.map(|(_, f)| f).collect()
                };
                Some(Terms {
                    name: ratio.name().to_owned(),
                    unit: ratio.unit(),
                    coefficients: indices.into_iter().map(functions).collect(),
                    formula: ratio.formula(),
                })
            }
        }
    }
}

/// The functions at some nodes, from which curves are made.
pub(super) struct Curves<'a> {
    problem: &'a Problem,
    /// Indices of the nodes; `None` for all.
    nodes: Option<Vec<usize>>,
    /// Values of each function.
    pub values: Vec<Vec<f64>>,
    /// Errors of the basis of each function.
    errors: Vec<Vec<f64>>,
}

impl<'a> Curves<'a> {
    /// At these nodes, or at all of them.
    pub fn at(problem: &'a Problem, theta: &[f64], nodes: Option<Vec<usize>>) -> Self {
        let (functions, grid) = (&problem.functions, &problem.system.grid);
        let times: Vec<f64> = match &nodes {
            Some(nodes) => nodes.iter().map(|node| grid.time(*node)).collect(),
            None => grid.times(),
        };
        let errors = 0..functions.ranges().len();
        Self {
            problem,
            values: match &nodes {
                Some(nodes) => functions.values_at(theta, nodes),
                None => functions.values(theta),
            },
            errors: errors
                .map(|f| basis_error(problem, f, theta, &times))
                .collect(),
            nodes,
        }
    }

    /// Value and basis error of a formula of the coefficients `sum_i w_i p(t_i)`, with the weights `w_i` by the index of their node in the list;
    /// adds the derivatives in the parameters, of which one may come several times.
    fn add(
        &self,
        terms: &Terms,
        weights: &[(usize, f64)],
        add: &mut dyn FnMut(usize, f64),
    ) -> [f64; 2] {
        let sums = |of: &[Vec<f64>]| {
            let mut sums = [0.0; MOST_COEFFICIENTS];
            for (sum, functions) in sums.iter_mut().zip(&terms.coefficients) {
                let each = functions
                    .iter()
                    .flat_map(|f| weights.iter().map(|(i, w)| w * of[*f][*i]));
                *sum = each.sum();
            }
            sums
        };
        let (value, slopes) = (terms.formula)(sums(&self.values));
        let errors = sums(&self.errors);
        let functions = &self.problem.functions;
        for (coefficient, slope) in terms.coefficients.iter().zip(slopes) {
            for f in coefficient {
                let first = functions.ranges()[*f].start;
                for (i, weight) in weights {
                    let node = self.nodes.as_ref().map_or(*i, |nodes| nodes[*i]);
                    let row = functions.get(*f).design.row(node);
                    row.for_each(|(j, b)| add(first + j, slope * weight * b));
                }
            }
        }
        let pairs = slopes.iter().zip(errors);
        [value, pairs.map(|(slope, error)| slope * error).sum()]
    }

    /// The quantity of [`Curves::add`].
    pub fn quantity(&self, terms: &Terms, weights: &[(usize, f64)]) -> Quantity {
        let mut gradient = Vec::new();
        let [value, basis_error] =
            self.add(terms, weights, &mut |j, slope| gradient.push((j, slope)));
        Quantity {
            gradient,
            basis_error,
            ..Quantity::new(&terms.name, terms.unit, value)
        }
    }

    /// Mean over the record, at all nodes; the value itself of a curve that is constant.
    pub fn mean(&self, terms: &Terms) -> Quantity {
        let nodes = self.problem.functions.nodes();
        let shares = trapezoid_weights(nodes, 1.0 / (nodes - 1).max(1) as f64);
        let mut dense = vec![0.0; self.problem.parameters()];
        let (mut mean, mut basis_error, mut is_constant) = (0.0, 0.0, true);
        let mut first = None;
        for (i, share) in shares.into_iter().enumerate() {
            let [value, error] = self.add(terms, &[(i, 1.0)], &mut |j, slope| {
                dense[j] += share * slope;
            });
            mean += share * value;
            basis_error += share * error;
            is_constant &= *first.get_or_insert(value) == value;
        }
        let gradient = dense.into_iter().enumerate().filter(|(_, a)| *a != 0.0);
        Quantity {
            gradient: gradient.collect(),
            basis_error,
            ..Quantity::new(
                &terms.name,
                terms.unit,
                first.filter(|_| is_constant).unwrap_or(mean),
            )
        }
    }
}
