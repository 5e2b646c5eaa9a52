//! The problem with one function constant.

use crate::constraints::{Constraints, RowGroup, Rows};
use crate::functions::{CoefficientFunction, Design, Functions, Penalty};
use crate::problem::Problem;
use nalgebra_sparse::{CooMatrix, CsrMatrix};

/// The problem with one function constant, and how its parameters become those of the whole one.
pub struct Reduced {
    pub problem: Problem,
    function: usize,
    /// Where the constant stands.
    pub place: usize,
    /// The parameters of the constant 1 in the function that it replaces.
    one: Vec<f64>,
}

impl Reduced {
    pub fn new(problem: &Problem, function: usize) -> Self {
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

    pub fn column(&self, j: usize, a: f64) -> (usize, f64) {
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
    pub fn embed(&self, theta: &[f64]) -> Vec<f64> {
        let function = self.one.iter().map(|one| one * theta[self.place]);
        let before = theta[..self.place].iter().copied();
        let after = theta[self.place + 1..].iter().copied();
        before.chain(function).chain(after).collect()
    }

    /// Those of the reduced one, with the mean of the function's values.
    pub fn mean_of(&self, theta: &[f64]) -> Vec<f64> {
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
