//! One function of the device: its basis, start, limits and penalties.

use super::BuildError;
use crate::constraints::{Limit, Statement};
use crate::functions::basis::{from_physical_powers, uniform_knots};
use crate::functions::{Basis, CoefficientFunction, CoefficientKind, Penalty, Variation};
use crate::system::Grid;

/// Where a function comes from.
#[derive(Debug, Clone, PartialEq)]
enum Form {
    Fixed(f64),
    FixedAt(Vec<f64>),
    Nodal(f64),
    Constant(f64),
    Steps(usize, f64),
    Linear(usize, f64),
    Spline(usize, f64),
    Polynomial(Vec<f64>),
    Sought(Basis, Vec<f64>),
}

/// A function of time of the device: mass (kg), damping (N s/m), stiffness (N/m) or the factor of a
/// further term. It is known ([`Part::fixed`]) or sought in a basis from a start.
///
/// The counterpart of one entry of `functions` in a model file.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    form: Form,
    min: Option<f64>,
    max: Option<f64>,
    smooth: Vec<(usize, f64)>,
    variation: Option<f64>,
}

impl Part {
    fn new(form: Form) -> Self {
        Self {
            form,
            min: None,
            max: None,
            smooth: Vec::new(),
            variation: None,
        }
    }

    /// Known, and the same at all times.
    pub fn fixed(value: f64) -> Self {
        Self::new(Form::Fixed(value))
    }

    /// Known, one value a node.
    pub fn fixed_at_nodes(values: Vec<f64>) -> Self {
        Self::new(Form::FixedAt(values))
    }

    /// One free value for all times.
    pub fn constant(start: f64) -> Self {
        Self::new(Form::Constant(start))
    }

    /// A free value at every node: the paper's choice.
    pub fn nodal(start: f64) -> Self {
        Self::new(Form::Nodal(start))
    }

    /// Constant between equally spaced `knots`, both ends of the record included.
    pub fn piecewise_constant(knots: usize, start: f64) -> Self {
        Self::new(Form::Steps(knots, start))
    }

    /// Lines between equally spaced `knots`, both ends of the record included.
    pub fn piecewise_linear(knots: usize, start: f64) -> Self {
        Self::new(Form::Linear(knots, start))
    }

    /// A cubic spline with equally spaced `knots`, both ends of the record included.
    pub fn b_spline(knots: usize, start: f64) -> Self {
        Self::new(Form::Spline(knots, start))
    }

    /// A polynomial that starts from these factors of `t^0`, `t^1`, ... (t in s): one number for a
    /// constant, two for a line.
    pub fn polynomial(start: &[f64]) -> Self {
        Self::new(Form::Polynomial(start.to_vec()))
    }

    /// Any basis, with a start for each of its parameters.
    pub fn sought(basis: Basis, start: Vec<f64>) -> Self {
        Self::new(Form::Sought(basis, start))
    }

    /// Never below `min`.
    #[must_use]
    pub fn min(mut self, min: f64) -> Self {
        self.min = Some(min);
        self
    }

    /// Never above `max`.
    #[must_use]
    pub fn max(mut self, max: f64) -> Self {
        self.max = Some(max);
        self
    }

    /// Pays `weight * integral (d^order p/dt^order)^2 dt`, `order` 0, 1 or 2; several add up.
    #[must_use]
    pub fn smooth(mut self, order: usize, weight: f64) -> Self {
        self.smooth.push((order, weight));
        self
    }

    /// Pays `weight` times its total variation: a jump costs no more than a slow change.
    #[must_use]
    pub fn variation(mut self, weight: f64) -> Self {
        self.variation = Some(weight);
        self
    }

    /// On a grid.
    pub(super) fn on(
        &self,
        quantity: CoefficientKind,
        grid: &Grid,
    ) -> Result<CoefficientFunction, BuildError> {
        let name = quantity.name();
        let refuse = |problem: String| Err(BuildError::new(name, problem));
        let nodes = grid.nodes();
        let function = match &self.form {
            Form::Fixed(value) => CoefficientFunction::fixed(quantity, vec![*value; nodes]),
            Form::FixedAt(values) if values.len() == nodes => {
                CoefficientFunction::fixed(quantity, values.clone())
            }
            Form::FixedAt(values) => {
                return refuse(format!("{} values for {nodes} nodes", values.len()));
            }
            form => {
                let (basis, start) = form.basis(grid).map_err(|p| BuildError::new(name, p))?;
                let wanted = basis.parameters(grid);
                if start.len() != wanted {
                    let given = start.len();
                    return refuse(format!("{given} start values, but {wanted} parameters"));
                }
                CoefficientFunction::free(quantity, basis, grid, start)
            }
        };
        let mut values = vec![0.0; nodes];
        function.values_into(&function.start, &mut values);
        match values.iter().find(|v| !v.is_finite()) {
            Some(value) => return refuse(format!("its start is {value}, not a finite number")),
            None if quantity != CoefficientKind::Mass => {}
            None => {
                if let Some(value) = values.iter().find(|v| **v <= 0.0) {
                    return refuse(format!("it must be positive at all times, not {value}"));
                }
            }
        }
        Ok(function)
    }

    /// What its limits demand.
    pub(super) fn limits(&self, of: CoefficientKind) -> Result<Vec<Statement>, BuildError> {
        let mut limits = Vec::new();
        for (name, limit) in [("min", self.min), ("max", self.max)] {
            let Some(value) = limit else { continue };
            if !value.is_finite() {
                let problem = format!("`{name}` is {value}, not a finite number");
                return Err(BuildError::new(of.name(), problem));
            }
            if name == "max" && of == CoefficientKind::Mass && value <= 0.0 {
                return Err(BuildError::new("mass", "`max` leaves no mass"));
            }
        }
        let number = |limit: Option<f64>| limit.map(Limit::Number);
        // Both at once where they are equal, so that they become an equality.
        if self.min.is_some() && self.min == self.max {
            let (min, max) = (number(self.min), number(self.max));
            return Ok(vec![Statement::Bounds { of, min, max }]);
        }
        for (min, max) in [(self.min, None), (None, self.max)] {
            if min.is_some() || max.is_some() {
                let (min, max) = (number(min), number(max));
                limits.push(Statement::Bounds { of, min, max });
            }
        }
        Ok(limits)
    }

    /// What it pays, as function `index` of the problem.
    pub(super) fn penalties(
        &self,
        index: usize,
        function: &CoefficientFunction,
        grid: &Grid,
    ) -> Result<(Vec<Penalty>, Option<Variation>), BuildError> {
        let name = function.quantity.name();
        let weights = self.smooth.iter().map(|(_, weight)| *weight);
        for weight in weights.chain(self.variation) {
            if !(weight.is_finite() && weight >= 0.0) {
                let problem = format!("the weight {weight} is not a finite number of at least 0");
                return Err(BuildError::new(name, problem));
            }
        }
        if let Some((order, _)) = self.smooth.iter().find(|(order, _)| *order > 2) {
            let problem = format!("order {order} of `smooth` is not 0, 1 or 2");
            return Err(BuildError::new(name, problem));
        }
        let Some(basis) = &function.basis else {
            return match self.smooth.is_empty() && self.variation.is_none() {
                true => Ok((Vec::new(), None)),
                false => Err(BuildError::new(name, "a fixed function pays nothing")),
            };
        };
        let smooth = self.smooth.iter().map(|&(order, weight)| {
            Penalty::new(index, order, weight, basis.roughness(grid, order))
        });
        let smooth = smooth.filter(|p| !p.rows.is_empty() && p.weight > 0.0);
        let variation = self.variation.filter(|weight| *weight > 0.0);
        let variation = variation.map(|weight| Variation {
            function: index,
            weight,
            rows: basis.changes(grid),
        });
        Ok((smooth.collect(), variation))
    }
}

impl Form {
    /// The basis on a grid, and the start of its parameters.
    fn basis(&self, grid: &Grid) -> Result<(Basis, Vec<f64>), String> {
        let nodes = grid.nodes();
        let knots = |count: usize, most: usize| match count {
            2.. if count <= most => Ok(uniform_knots(grid, count)),
            _ => Err(format!("{count} knots, but from 2 to {most} fit the grid")),
        };
        let (basis, start) = match self {
            Form::Nodal(start) => (Basis::Nodal, *start),
            Form::Constant(start) => (Basis::Constant, *start),
            Form::Steps(count, start) => {
                let knots = knots(*count, nodes + 1)?;
                (Basis::PiecewiseConstant { knots }, *start)
            }
            Form::Linear(count, start) => {
                let knots = knots(*count, nodes)?;
                (Basis::PiecewiseLinear { knots }, *start)
            }
            Form::Spline(count, start) => {
                let knots = knots(*count, nodes.saturating_sub(2))?;
                (Basis::BSpline { knots }, *start)
            }
            Form::Polynomial(powers) => {
                let Some(degree) = powers.len().checked_sub(1) else {
                    return Err("a polynomial needs at least one start value".into());
                };
                let basis = Basis::Polynomial { degree };
                checked(&basis, grid)?;
                let start = from_physical_powers(grid, powers);
                return Ok((basis, start));
            }
            Form::Sought(basis, start) => {
                checked(basis, grid)?;
                return Ok((basis.clone(), start.clone()));
            }
            Form::Fixed(_) | Form::FixedAt(_) => unreachable!("a fixed function has no basis"),
        };
        let start = basis.constant(grid, start);
        Ok((basis, start))
    }
}

/// Refuses knots that are not those of the record, and degrees that the grid does not tell apart.
fn checked(basis: &Basis, grid: &Grid) -> Result<(), String> {
    if let Basis::Polynomial { degree } = basis {
        let most = Basis::highest_degree(grid);
        return match *degree <= most {
            true => Ok(()),
            false => Err(format!("degree {degree}, but at most {most} fits the grid")),
        };
    }
    let (Basis::PiecewiseConstant { knots }
    | Basis::PiecewiseLinear { knots }
    | Basis::BSpline { knots }) = basis
    else {
        return Ok(());
    };
    let ends = [grid.start(), grid.time(grid.nodes() - 1)];
    let increasing = knots.windows(2).all(|pair| pair[0] < pair[1]);
    match knots.as_slice() {
        [first, .., last] if increasing && [*first, *last] == ends => Ok(()),
        _ => Err(format!(
            "its knots must increase from {} s to {} s, the ends of the record",
            ends[0], ends[1]
        )),
    }
}
