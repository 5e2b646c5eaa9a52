//! Quantities derived from the parameters: linear functionals and ratios of two of them.

use crate::functions::Basis;
use crate::identifiability::mean_weights;
use crate::problem::Problem;
use crate::system::TimePoint;

/// Linear functional `q(theta) = constant + sum_j a_j theta_j`: a parameter, a scalar, the value of a function or its mean.
#[derive(Debug, Clone, PartialEq)]
pub struct Linear {
    /// Name for reports, as in `mass at 3 s`.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Time of the value, s; `None` for parameters, scalars and means.
    pub time: Option<f64>,
    /// Entries `(j, a_j)`.
    pub entries: Vec<(usize, f64)>,
    /// Constant part, in the unit of `q`.
    pub constant: f64,
}

impl Linear {
    /// Parameter `index` itself.
    pub fn parameter(index: usize) -> Self {
        Self {
            name: format!("parameter {index}"),
            unit: String::new(),
            time: None,
            entries: vec![(index, 1.0)],
            constant: 0.0,
        }
    }

    /// Scalar `index` of the problem.
    ///
    /// # Panics
    /// If there is none.
    pub fn scalar(problem: &Problem, index: usize) -> Self {
        let scalar = &problem.functions.scalars()[index];
        let first = problem.functions.scalar_range().start;
        Self {
            name: scalar.name.clone(),
            unit: scalar.unit.clone(),
            time: None,
            entries: vec![(first + index, 1.0)],
            constant: 0.0,
        }
    }

    /// Value of function `function` at `time` (s), by linear interpolation between nodes; `None` outside the grid.
    pub fn value(problem: &Problem, function: usize, time: f64) -> Option<Self> {
        let place = TimePoint::of(&problem.system.grid, time)?;
        let weights = [
            (place.step, 1.0 - place.fraction),
            (place.step + 1, place.fraction),
        ];
        let name = format!("{} at {time} s", problem.functions.get(function).name());
        let at = Self::combine(problem, function, name, weights);
        Some(Self {
            time: Some(time),
            ..at
        })
    }

    /// Mean `1/T integral p dt` of function `function`, by the trapezoid rule over the grid.
    pub fn mean(problem: &Problem, function: usize) -> Self {
        let weights = mean_weights(problem.functions.nodes()).into_iter();
        let of = problem.functions.get(function);
        let name = match of.basis {
            Some(Basis::Constant) => of.name(),
            _ => format!("mean of {}", of.name()),
        };
        Self::combine(problem, function, name, weights.enumerate())
    }

    /// Sum `sum_i w_i p(t_i)` over nodes.
    fn combine(
        problem: &Problem,
        function: usize,
        name: String,
        weights: impl IntoIterator<Item = (usize, f64)>,
    ) -> Self {
        let list = problem.functions.get(function);
        let first = problem.functions.ranges()[function].start;
        let mut dense = vec![0.0; list.parameters()];
        let mut constant = 0.0;
        for (node, weight) in weights {
            if weight != 0.0 {
                list.design
                    .row(node)
                    .for_each(|(j, b)| dense[j] += weight * b);
                constant += weight * list.fixed_at(node);
            }
        }
        let entries = dense.into_iter().enumerate().filter(|(_, a)| *a != 0.0);
        Self {
            name,
            unit: list.quantity.unit().to_owned(),
            time: None,
            entries: entries.map(|(j, a)| (first + j, a)).collect(),
            constant,
        }
    }

    /// `q(theta)`.
    pub fn of(&self, theta: &[f64]) -> f64 {
        self.constant + self.entries.iter().map(|(j, a)| a * theta[*j]).sum::<f64>()
    }

    /// Standard deviation `sqrt(a^T C a)` for the covariance `C` of the parameters.
    pub fn deviation(&self, covariance: &nalgebra::DMatrix<f64>) -> f64 {
        let row = |&(i, a): &(usize, f64)| -> f64 {
            let sum: f64 = self
                .entries
                .iter()
                .map(|(j, b)| b * covariance[(i, *j)])
                .sum();
            a * sum
        };
        self.entries.iter().map(row).sum::<f64>().max(0.0).sqrt()
    }
}

/// A quantity whose extremes are computed.
#[derive(Debug, Clone, PartialEq)]
pub enum Target {
    /// A linear functional.
    Linear(Linear),
    /// A ratio of two linear functionals, as `k/m` at one time; the denominator is positive.
    Ratio(Linear, Linear),
}

impl Target {
    /// Name for reports.
    pub fn name(&self) -> String {
        match self {
            Self::Linear(q) => q.name.clone(),
            Self::Ratio(over, under) => format!("{} over {}", over.name, under.name),
        }
    }

    /// Time of the quantity, s.
    pub fn time(&self) -> Option<f64> {
        match self {
            Self::Linear(q) | Self::Ratio(q, _) => q.time,
        }
    }

    /// Value at `theta`.
    pub fn of(&self, theta: &[f64]) -> f64 {
        match self {
            Self::Linear(q) => q.of(theta),
            Self::Ratio(over, under) => over.of(theta) / under.of(theta),
        }
    }

    /// `(j, d value / d theta_j)`.
    pub fn slopes(&self, theta: &[f64]) -> Vec<(usize, f64)> {
        match self {
            Self::Linear(q) => q.entries.clone(),
            Self::Ratio(over, under) => {
                let below = under.of(theta);
                let ratio = over.of(theta) / below;
                let first = over.entries.iter().map(|(j, a)| (*j, a / below));
                let second = under.entries.iter().map(|(j, a)| (*j, -ratio * a / below));
                first.chain(second).collect()
            }
        }
    }
}
