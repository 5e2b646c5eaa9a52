//! A subproblem as a control problem along time.

use super::rows::{StageRows, UnorderedRows};
use super::sizes::{Sizes, stage_of, stage_of_cone};
use super::transitions::{NONE, Transitions};
use crate::constraints::{Rows, TOLERANCE};
use crate::qp::Subproblem;
use crate::qp::layout::{StageLayout, VariableRole};
use crate::simd::tall_qr::order_by;

/// The side of an inequality that a constraint row stands for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side {
    /// Row of the subproblem.
    pub row: usize,
    /// 1 for the upper bound, -1 for the lower one.
    pub sign: f64,
}

/// A subproblem in the coordinates of its stages.
pub(super) struct StageProgram<const X: usize, const W: usize> {
    pub stages: usize,
    pub transitions: Transitions<W>,
    /// Offsets `f_i` of the steps of the responses.
    pub offsets: Vec<f64>,
    /// `1/2 sum (a' xi - right)^2` is half the cost.
    pub residuals: StageRows,
    /// `a' xi <= right`.
    pub constraints: StageRows,
    /// Row of the subproblem and side of each constraint row.
    pub sides: Vec<Side>,
    /// Largest coefficient of each constraint row in the variables.
    pub scales: Vec<f64>,
    /// Rows of the cones `C xi - right`, those of a cone with the same columns.
    pub cones: StageRows,
    /// First row of each cone, and the number of rows.
    pub cone_rows: Vec<u32>,
    /// Cone of the subproblem for each cone here.
    pub cone_order: Vec<usize>,
    /// Absolute values `h |a' xi - right|`.
    pub absolute: StageRows,
    /// `h` of each, half its weight.
    pub absolute_costs: Vec<f64>,
    /// Row of the subproblem of each.
    pub absolute_order: Vec<usize>,
    /// Values of the first state that are known.
    pub fixed: [Option<f64>; X],
    positions: Vec<VariableRole>,
    /// The state of each history's value; those of its differences follow.
    values: Vec<usize>,
    orders: Vec<usize>,
    /// The first constant.
    constants: usize,
    /// Equality of each step of a response component.
    equalities: Vec<usize>,
    /// Equalities that fix a first state.
    fixing: Vec<(usize, usize)>,
}

impl<const X: usize, const W: usize> StageProgram<X, W> {
    /// `None` where the subproblem is of another form: an equality that is neither a step of a response nor fixes a first
    /// state, bounds without a point between them, or a row that speaks of more than one step of a response.
    pub fn new(sub: &Subproblem, layout: &StageLayout, sizes: Sizes) -> Option<Self> {
        let responses = layout.components();
        let mut values = Vec::new();
        let mut next = Vec::new();
        for (f, order) in sizes.orders.iter().enumerate() {
            values.push(responses + next.len());
            next.extend((1..*order).map(|j| values[f] + j));
            next.push(X + f);
        }
        let constants = responses + next.len();
        next.extend(layout.constants.iter().map(|_| NONE));
        let stages = layout.nodes;
        let mut fixed = [None; X];
        fixed[constants + layout.constants.len()..].fill(Some(0.0));
        let initial = layout
            .responses
            .iter()
            .flat_map(|response| &response.initial);
        for (component, initial) in initial.enumerate() {
            if initial.is_none() {
                fixed[component] = Some(0.0);
            }
        }
        let mut program = Self {
            stages,
            transitions: Transitions {
                responses,
                steps: vec![[0.0; W]; responses * (stages - 1)],
                next,
            },
            offsets: vec![0.0; responses * (stages - 1)],
            residuals: StageRows::default(),
            constraints: StageRows::default(),
            sides: Vec::new(),
            scales: Vec::new(),
            cones: StageRows::default(),
            cone_rows: Vec::new(),
            cone_order: Vec::new(),
            absolute: StageRows::default(),
            absolute_costs: Vec::new(),
            absolute_order: Vec::new(),
            fixed,
            positions: sizes.positions,
            values,
            orders: sizes.orders,
            constants,
            equalities: vec![NONE; responses * (stages - 1)],
            fixing: Vec::new(),
        };
        for i in 0..sub.equalities.len() {
            program.add_equality(&sub.equalities, i)?;
        }
        let mut base = 0;
        for response in &layout.responses {
            for step in 0..response.nodes - 1 {
                let steps = step * responses + base;
                let known = &program.equalities[steps..steps + response.components()];
                (!known.contains(&NONE)).then_some(())?;
            }
            base += response.components();
        }
        program.add_residuals(sub)?;
        program.add_constraints(sub)?;
        program.add_cones(sub)?;
        program.add_absolute_values(sub)?;
        Some(program)
    }

    /// A step of a response, solved for its later state, or a known first state.
    fn add_equality(&mut self, rows: &Rows, i: usize) -> Option<()> {
        let later = rows.row(i).filter_map(|(j, a)| match self.positions[j] {
            VariableRole::Response(component, node) if node > 0 && a != 0.0 => {
                Some((node, component, j, a))
            }
            _ => None,
        });
        let Some((node, component, pivot, size)) = later.max_by_key(|(node, ..)| *node) else {
            let mut entries = rows.row(i).filter(|(_, a)| *a != 0.0);
            let (Some((j, a)), None) = (entries.next(), entries.next()) else {
                return None;
            };
            let state = self.first_state(j)?;
            if self.fixed[state].is_some() {
                return None;
            }
            self.fixed[state] = Some(rows.right()[i] / a);
            self.fixing.push((state, i));
            return Some(());
        };
        let step = (node - 1) * self.transitions.responses + component;
        if self.equalities[step] != NONE {
            return None;
        }
        let mut xi = [0.0; W];
        for (j, a) in rows.row(i).filter(|(j, _)| *j != pivot) {
            let is_at_once = match self.positions[j] {
                VariableRole::Response(_, other) => other + 1 == node,
                _ => true,
            };
            if !is_at_once {
                return None;
            }
            self.add_entry(node - 1, j, -a / size, &mut xi)?;
        }
        self.equalities[step] = i;
        self.transitions.steps[step] = xi;
        self.offsets[step] = rows.right()[i] / size;
        Some(())
    }

    /// The first state that is a variable.
    fn first_state(&self, variable: usize) -> Option<usize> {
        match self.positions[variable] {
            VariableRole::History(f, 0) => Some(self.values[f]),
            VariableRole::Response(component, 0) => Some(component),
            VariableRole::Constant(c) => Some(self.constants + c),
            _ => None,
        }
    }

    /// Adds `a` times a variable in the coordinates of stage `i`; the constant that comes with it.
    fn add_entry(&self, i: usize, variable: usize, a: f64, xi: &mut [f64; W]) -> Option<f64> {
        // The stage of a row is that of its first coefficient other than zero.
        if a == 0.0 {
            return Some(0.0);
        }
        match self.positions[variable] {
            VariableRole::Constant(c) => xi[self.constants + c] += a,
            VariableRole::Response(component, node) if node == i => xi[component] += a,
            VariableRole::Response(component, node) if node == i + 1 => {
                let step = i * self.transitions.responses + component;
                for (xi, b) in xi.iter_mut().zip(&self.transitions.steps[step]) {
                    *xi += a * b;
                }
                return Some(a * self.offsets[step]);
            }
            VariableRole::Response(..) => return None,
            VariableRole::History(f, node) => {
                // p_{i+d} = sum_j binomial(d, j) difference_j.
                let (d, order) = (node.checked_sub(i)?, self.orders[f]);
                if d > order {
                    return None;
                }
                let mut binomial = 1.0;
                for j in 0..=d {
                    let at = if j < order { self.values[f] + j } else { X + f };
                    xi[at] += a * binomial;
                    binomial *= (d - j) as f64 / (j + 1) as f64;
                }
            }
        }
        Some(0.0)
    }

    /// Coefficients of row `i` in the coordinates of a stage, and the constant that comes with it.
    fn row_at(&self, stage: usize, rows: &Rows, i: usize) -> Option<([f64; W], f64)> {
        let mut xi = [0.0; W];
        let mut constant = 0.0;
        for (j, a) in rows.row(i) {
            constant += self.add_entry(stage, j, a, &mut xi)?;
        }
        // Differences of weighted sums leave rounding where a coefficient is zero.
        let largest = xi.iter().fold(0.0f64, |most, a| most.max(a.abs()));
        let rounding = 4.0 * f64::EPSILON * largest;
        for a in xi.iter_mut().filter(|a| a.abs() <= rounding) {
            *a = 0.0;
        }
        Some((xi, constant))
    }

    /// The residuals, the proximal terms, and what holds the differences that act on no node.
    fn add_residuals(&mut self, sub: &Subproblem) -> Option<()> {
        let mut unordered = UnorderedRows::default();
        self.add_rows(&sub.residuals, &mut unordered)?;
        let mut diagonal = |stage, column: usize, a| {
            let mut xi = [0.0; W];
            xi[column] = a;
            unordered.push(stage, &xi, 1.0, 0.0, |j| j == column);
        };
        for (j, d) in sub.proximal.iter().enumerate().filter(|(_, d)| **d != 0.0) {
            match self.positions[j] {
                VariableRole::Response(component, node) => diagonal(node, component, d.sqrt()),
                VariableRole::History(f, node) => diagonal(node, self.values[f], d.sqrt()),
                VariableRole::Constant(c) => diagonal(0, self.constants + c, d.sqrt()),
            }
        }
        for (f, order) in self.orders.iter().enumerate() {
            (self.stages.saturating_sub(*order)..self.stages).for_each(|i| diagonal(i, X + f, 1.0));
        }
        self.residuals = unordered.in_order(self.stages).0;
        Some(())
    }

    /// Adds the rows, each at its stage.
    fn add_rows(&self, rows: &Rows, unordered: &mut UnorderedRows) -> Option<()> {
        for i in 0..rows.len() {
            let stage = stage_of(rows, i, &self.positions);
            let (xi, constant) = self.row_at(stage, rows, i)?;
            unordered.push(stage, &xi, 1.0, rows.right()[i] - constant, |j| {
                xi[j] != 0.0
            });
        }
        Some(())
    }

    fn add_constraints(&mut self, sub: &Subproblem) -> Option<()> {
        let mut unordered = UnorderedRows::default();
        let mut sides = Vec::with_capacity(sub.inequalities.len());
        for i in 0..sub.inequalities.len() {
            let stage = stage_of(&sub.inequalities, i, &self.positions);
            let (xi, constant) = self.row_at(stage, &sub.inequalities, i)?;
            let lower = sub.inequalities.right()[i] - constant;
            let upper = sub.upper[i] - constant;
            if let Some(value) = self.known_value(stage, &xi) {
                let slack = TOLERANCE * sub.inequalities.scale(i);
                if value < lower - slack || value > upper + slack {
                    return None;
                }
                continue;
            }
            if lower >= upper || lower.is_nan() || upper.is_nan() {
                return None;
            }
            for (sign, bound) in [(1.0, upper), (-1.0, -lower)] {
                if bound.is_finite() {
                    unordered.push(stage, &xi, sign, bound, |j| xi[j] != 0.0);
                    sides.push(Side { row: i, sign });
                }
            }
        }
        let (rows, order) = unordered.in_order(self.stages);
        self.constraints = rows;
        self.sides = order.iter().map(|i| sides[*i as usize]).collect();
        let scale = |side: &Side| sub.inequalities.scale(side.row);
        self.scales = self.sides.iter().map(scale).collect();
        Some(())
    }

    fn add_cones(&mut self, sub: &Subproblem) -> Option<()> {
        let stages = sub
            .cones
            .iter()
            .map(|cone| stage_of_cone(cone, &self.positions));
        let stages: Vec<usize> = stages.collect();
        self.cone_order = order_by(&stages);
        let mut unordered = UnorderedRows::default();
        self.cone_rows.push(0);
        for k in &self.cone_order {
            let (cone, stage) = (&sub.cones[*k].rows, stages[*k]);
            let rows = (0..cone.len()).map(|i| self.row_at(stage, cone, i));
            let rows = rows.collect::<Option<Vec<_>>>()?;
            let is_used = |j: usize| rows.iter().any(|(xi, _)| xi[j] != 0.0);
            for (i, (xi, constant)) in rows.iter().enumerate() {
                unordered.push(stage, xi, 1.0, cone.right()[i] - constant, is_used);
            }
            self.cone_rows.push(unordered.len() as u32);
        }
        self.cones = unordered.in_order(self.stages).0;
        Some(())
    }

    fn add_absolute_values(&mut self, sub: &Subproblem) -> Option<()> {
        let mut unordered = UnorderedRows::default();
        self.add_rows(&sub.absolute, &mut unordered)?;
        let (rows, order) = unordered.in_order(self.stages);
        self.absolute = rows;
        self.absolute_order = order.iter().map(|i| *i as usize).collect();
        let half = |i: &usize| 0.5 * sub.absolute_weights[*i];
        self.absolute_costs = self.absolute_order.iter().map(half).collect();
        Some(())
    }

    /// The value of a row that acts on known first states alone.
    fn known_value(&self, stage: usize, xi: &[f64; W]) -> Option<f64> {
        let entries = xi.iter().enumerate().filter(|(_, a)| **a != 0.0);
        let terms = entries.map(|(column, a)| {
            let fixed = self.fixed.get(column).copied().flatten()?;
            (stage == 0).then_some(a * fixed)
        });
        terms.sum()
    }

    /// The coordinates of all stages with the known first states, all others and the controls zero.
    pub fn uncontrolled(&self) -> Vec<[f64; W]> {
        let responses = self.transitions.responses;
        let mut xi = vec![[0.0; W]; self.stages];
        let mut x = self.fixed.map(|value| value.unwrap_or(0.0));
        for (i, xi) in xi.iter_mut().enumerate() {
            xi[..X].copy_from_slice(&x);
            if i + 1 < self.stages {
                x = self.transitions.forward(i, xi);
                let offsets = &self.offsets[i * responses..];
                let pairs = x[..responses].iter_mut().zip(offsets);
                pairs.for_each(|(x, offset)| *x += offset);
            }
        }
        xi
    }

    /// Number of controls.
    pub fn controls(&self) -> usize {
        self.orders.len()
    }

    /// The variables of the subproblem at the coordinates `xi`.
    pub fn variables(&self, xi: &[[f64; W]]) -> Vec<f64> {
        let each = self.positions.iter().map(|position| match *position {
            VariableRole::History(f, node) => xi[node][self.values[f]],
            VariableRole::Response(component, node) => xi[node][component],
            VariableRole::Constant(c) => xi[0][self.constants + c],
        });
        each.collect()
    }

    /// Multipliers of the equalities: those with which the gradient of the Lagrangian vanishes in the responses and the known first
    /// states, for its `gradient` without them.
    pub fn equality_multipliers(&self, sub: &Subproblem, mut gradient: Vec<f64>) -> Vec<f64> {
        let mut multipliers = vec![0.0; sub.equalities.len()];
        let mut solve = |i: usize, is_pivot: &dyn Fn(usize) -> bool| {
            let pivot = sub
                .equalities
                .row(i)
                .find(|(j, a)| is_pivot(*j) && *a != 0.0);
            let Some((j, a)) = pivot else { return };
            multipliers[i] = -gradient[j] / a;
            for (j, a) in sub.equalities.row(i) {
                gradient[j] += a * multipliers[i];
            }
        };
        let responses = self.transitions.responses;
        for (step, i) in self.equalities.iter().enumerate().rev() {
            if *i != NONE {
                let position = VariableRole::Response(step % responses, step / responses + 1);
                solve(*i, &|j| self.positions[j] == position);
            }
        }
        for (state, i) in &self.fixing {
            solve(*i, &|j| self.first_state(j) == Some(*state));
        }
        multipliers
    }
}
