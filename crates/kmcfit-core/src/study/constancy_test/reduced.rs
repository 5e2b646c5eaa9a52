//! The null model of the constancy test: the problem with one function replaced by a constant, `theta = M theta'`.

use crate::constraints::Rows;
use crate::functions::{CoefficientFunction, Parameterization, Penalty};
use crate::problem::Problem;

/// The problem with one constant function, and the map `M` from its parameters to those of the full problem.
pub struct ConstantModel {
    pub problem: Problem,
    function: usize,
    /// Index of the constant among the parameters.
    pub place: usize,
    /// Parameters of the constant 1 in the basis of the replaced function.
    one: Vec<f64>,
}

impl ConstantModel {
    pub fn new(problem: &Problem, function: usize) -> Self {
        let grid = &problem.system.grid;
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
        let coefficient_sets = problem.functions.coefficient_sets().to_vec();
        let functions =
            Parameterization::with_coefficient_sets(list, coefficient_sets, nodes, grid.step())
                .expect("a constant instead of a function stays independent")
                .with_scalars(problem.functions.scalars().to_vec());
        let mut own = problem.clone();
        own.parts_mut().functions = functions;
        let mut reduced = Self {
            problem: own,
            function,
            place,
            one,
        };
        reduced.rewrite(problem);
        reduced
    }

    /// Rewrites constraints and penalties in the parameters of the constant model.
    fn rewrite(&mut self, whole: &Problem) {
        let column = |j: usize, a: f64| self.column(j, a);
        // Rows on the shape of the function have no entries for a constant.
        let constraints = whole.constraints.in_parameters(&column);
        let soft = whole.soft.iter();
        let soft = soft.map(|group| group.in_parameters(&column)).collect();
        let penalties = whole
            .penalties
            .iter()
            .filter_map(|p| self.penalty(p))
            .collect();
        let variations = whole.variations.iter();
        let variations = variations.filter(|v| v.function != self.function).cloned();
        let variations = variations.collect();
        let parts = self.problem.parts_mut();
        parts.constraints = constraints;
        parts.soft = soft;
        parts.penalties = penalties;
        parts.variations = variations;
    }

    pub fn column(&self, j: usize, a: f64) -> (usize, f64) {
        let end = self.place + self.one.len();
        match j {
            _ if j < self.place => (j, a),
            _ if j < end => (self.place, a * self.one[j - self.place]),
            _ => (j + 1 - self.one.len(), a),
        }
    }

    /// Penalty in the new parameters; `None` for a penalty on a derivative, which is zero for a constant.
    fn penalty(&self, penalty: &Penalty) -> Option<Penalty> {
        if penalty.function != self.function {
            return Some(penalty.clone());
        }
        if penalty.order > 0 {
            return None;
        }
        let mut rows = Rows::of_width(1);
        let column = penalty.rows.multiply(&self.one);
        for (a, target) in column.into_iter().zip(penalty.rows.right()) {
            rows.push([(0, a)], *target);
        }
        Some(Penalty {
            rows,
            ..penalty.clone()
        })
    }

    /// Parameters of the full problem, `M theta'`.
    pub fn embed(&self, theta: &[f64]) -> Vec<f64> {
        let function = self.one.iter().map(|one| one * theta[self.place]);
        let before = theta[..self.place].iter().copied();
        let after = theta[self.place + 1..].iter().copied();
        before.chain(function).chain(after).collect()
    }

    /// Parameters of the constant model, with the mean value of the function.
    pub fn mean_of(&self, theta: &[f64]) -> Vec<f64> {
        let end = self.place + self.one.len();
        // Constant nearest to the parameters, by least squares.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Builder, CoefficientSpec, Record};
    use crate::constraints::Constraint;
    use crate::functions::CoefficientKind;

    fn whole() -> Problem {
        let times: Vec<f64> = (0..=80).map(|i| 0.1 * f64::from(i)).collect();
        let samples: Vec<f64> = times.iter().map(|t| (1.3 * t).cos()).collect();
        let record = Record::new("decay").displacement(&times, &samples);
        let parts = [
            CoefficientSpec::piecewise_linear(5, 1.0)
                .tikhonov(1, 0.3)
                .min(0.1),
            CoefficientSpec::piecewise_linear(4, 0.2)
                .tikhonov(0, 0.7)
                .tikhonov(2, 0.2),
            CoefficientSpec::piecewise_constant(6, 1.7).total_variation(0.4),
        ];
        let value = |of, value| Constraint::Mean { of, value };
        Builder::new(parts)
            .record(record)
            .constrain(value(CoefficientKind::Mass, 1.1))
            .constrain(Constraint::DampingRatio { max: 0.8 })
            .constrain(Constraint::Slope {
                of: CoefficientKind::Damping,
                min: Some(-0.5),
                max: None,
            })
            .penalize(value(CoefficientKind::Stiffness, 1.5), 2.0)
            .penalize(value(CoefficientKind::Damping, 0.3), 3.0)
            .build()
            .unwrap()
    }

    /// The constant model agrees with the full problem at constant functions, for each function: response, penalties, soft rows
    /// and constraints.
    #[test]
    fn the_constant_model_agrees_with_the_full_problem_at_constants() {
        let whole = whole();
        for function in 0..3 {
            let reduced = ConstantModel::new(&whole, function);
            let count = reduced.problem.parameters();
            let own = whole.functions.ranges()[function].len();
            assert_eq!(count, whole.parameters() + 1 - own);
            let theta: Vec<f64> = (0..count)
                .map(|j| 1.0 + 0.05 * (2.3 * j as f64).sin())
                .collect();
            let embedded = reduced.embed(&theta);
            let costs = [
                reduced.problem.evaluate(&theta).unwrap(),
                whole.evaluate(&embedded).unwrap(),
            ]
            .map(|evaluation| [evaluation.misfit, evaluation.regularisation]);
            for (a, b) in costs[0].iter().zip(costs[1]) {
                assert!((a / b - 1.0).abs() < 1e-12, "{function}: {a} {b}");
            }
            assert!(costs[0][1] > 0.0);
            let worst =
                [(&reduced.problem, &theta), (&whole, &embedded)].map(|(problem, theta)| {
                    let worst = problem.constraints.largest_violation(theta);
                    worst.expect("constraints").relative
                });
            assert!(
                worst[0] > 0.0 && (worst[0] - worst[1]).abs() < 1e-12,
                "{worst:?}"
            );
            for (there, back) in theta.iter().zip(reduced.mean_of(&embedded)) {
                assert!((there - back).abs() < 1e-12, "{function}: {there} {back}");
            }
        }
    }

    #[test]
    fn rows_on_the_shape_of_a_constant_are_removed() {
        let whole = whole();
        let slopes = |problem: &Problem| {
            let groups = problem.constraints.groups.iter();
            let of_slopes = groups.filter(|group| group.name.starts_with("slope of "));
            of_slopes.map(|group| group.rows.len()).sum::<usize>()
        };
        assert_eq!(slopes(&whole), 3);
        assert_eq!(slopes(&ConstantModel::new(&whole, 1).problem), 0);
        assert_eq!(slopes(&ConstantModel::new(&whole, 0).problem), 3);
        assert!(ConstantModel::new(&whole, 2).problem.variations.is_empty());
        assert_eq!(ConstantModel::new(&whole, 1).problem.penalties.len(), 2);
    }
}
