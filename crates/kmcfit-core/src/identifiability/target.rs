//! What a quantity is a value of.

use super::curve::{Curve, Curves};
use super::quantities::Quantities;
use super::quantity::Quantity;
use crate::functions::Basis;
use crate::problem::Problem;
use crate::system::TimePoint;

/// What a quantity is a value of.
#[derive(Debug, Clone, PartialEq)]
pub enum Target {
    /// A weighted sum of parameters, given by their indices and weights.
    Parameters(Vec<(usize, f64)>),
    /// The scalar with this index: an initial state or sensor parameter.
    Scalar(usize),
    /// Value at a time, s, of the functions interpolated linearly between nodes.
    Value(Curve, f64),
    /// Mean over the record `1/T integral p dt`, by the trapezoid rule over the nodes.
    Mean(Curve),
}

impl Target {
    /// A parameter, by its index.
    pub fn parameter(index: usize) -> Self {
        Self::Parameters(vec![(index, 1.0)])
    }

    /// Time of the value, s; `None` for others.
    pub fn time(&self) -> Option<f64> {
        match self {
            Self::Value(_, time) => Some(*time),
            _ => None,
        }
    }

    /// The quantity at the parameters `theta`, without a standard error; `None` outside the grid and for a ratio that the system does not have.
    ///
    /// # Panics
    /// Without a function, scalar or parameter of this index.
    pub fn at(&self, problem: &Problem, theta: &[f64]) -> Option<Quantity> {
        Some(match self {
            Self::Parameters(entries) => {
                let indices: Vec<String> = entries.iter().map(|(j, _)| j.to_string()).collect();
                let name = format!("parameter {}", indices.join(" + "));
                let value = entries.iter().map(|(j, a)| a * theta[*j]).sum();
                Quantity {
                    gradient: entries.clone(),
                    ..Quantity::new(name, "", value)
                }
            }
            Self::Scalar(index) => {
                let mut scalars = Quantities::scalars_of(problem, problem.scalars(theta));
                scalars.swap_remove(*index)
            }
            Self::Value(curve, time) => {
                let point = TimePoint::of(&problem.system.grid, *time)?;
                let weights = [
                    (point.step, 1.0 - point.fraction),
                    (point.step + 1, point.fraction),
                ];
                let weights = weights.into_iter().filter(|(_, weight)| *weight != 0.0);
                let (nodes, weights): (Vec<usize>, Vec<f64>) = weights.unzip();
                let weights: Vec<(usize, f64)> = weights.into_iter().enumerate().collect();
                let mut value = Curves::at(problem, theta, Some(nodes))
                    .quantity(&curve.terms(problem)?, &weights);
                value.name = format!("{} at {time} s", value.name);
                value
            }
            Self::Mean(curve) => {
                let mut mean = Curves::at(problem, theta, None).mean(&curve.terms(problem)?);
                let is_constant = matches!(curve, Curve::Function(f)
                    if problem.functions.get(*f).basis == Some(Basis::Constant));
                if !is_constant {
                    mean.name = format!("mean of {}", mean.name);
                }
                mean
            }
        })
    }
}
