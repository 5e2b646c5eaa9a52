//! The quantities of a fit.

use super::covariance_kind::CovarianceKind;
use super::curve::{Curve, Curves};
use super::quantity::Quantity;
use crate::functions::Ratio;
use crate::problem::Problem;

/// Means over the record of all functions and ratios, and all scalars.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantities {
    /// Kind of the covariance of their standard errors.
    pub kind: CovarianceKind,
    /// One for each function.
    pub functions: Vec<Quantity>,
    /// Ratios of the shared coefficient set, as far as the system has their terms.
    pub ratios: Vec<Quantity>,
    /// Initial states and sensor parameters.
    pub scalars: Vec<Quantity>,
}

impl Quantities {
    /// The quantities at the parameters `theta`, without standard errors.
    pub fn at(problem: &Problem, theta: &[f64]) -> Self {
        let curves = Curves::at(problem, theta, None);
        let means = |list: Vec<Curve>| {
            let terms = list.into_iter().filter_map(|curve| curve.terms(problem));
            terms.map(|terms| curves.mean(&terms)).collect()
        };
        Self {
            kind: CovarianceKind::default(),
            functions: means(Curve::functions(problem)),
            ratios: means(Curve::ratios()),
            scalars: Self::scalars_of(problem, problem.scalars(theta)),
        }
    }

    /// The scalars of a problem with these values, without standard errors.
    pub fn scalars_of(problem: &Problem, values: &[f64]) -> Vec<Quantity> {
        let scalars = problem.functions.scalars().iter().zip(values);
        let each = scalars.zip(problem.functions.scalar_range());
        each.map(|((scalar, value), parameter)| Quantity {
            gradient: vec![(parameter, 1.0)],
            ..Quantity::new(&scalar.name, &scalar.unit, *value)
        })
        .collect()
    }

    /// All of them, to give them standard errors.
    pub(crate) fn all_mut(&mut self) -> impl Iterator<Item = &mut Quantity> {
        let all = self.functions.iter_mut().chain(&mut self.ratios);
        all.chain(&mut self.scalars)
    }

    /// Mean of a ratio.
    pub fn ratio(&self, ratio: Ratio) -> Option<&Quantity> {
        self.ratios.iter().find(|mean| mean.name == ratio.name())
    }
}
