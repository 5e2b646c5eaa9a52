//! The equation of motion of the records in the form in which its error is minimised.
//!
//! In the **weak form** the equation is multiplied by [bump functions](super::bumps) and integrated. The bump functions carry the derivatives
//! of the response, so the linear terms follow from the samples without smoothing, and the noise of the derivatives is averaged out
//! instead of filtered together with the response. In the **pointwise form** the equation holds at every time, with the smoothed
//! response. The weak form is used where the bump functions outnumber the parameters of all functions eight times and these are at most
//! [`FEW_PARAMETERS`]; a function with one value per node needs equations that are local in time, and has the pointwise form.

use super::bump_lengths;
use super::bumps::Bumps;
use super::nodal;
use super::response::blend;
use super::restored::restored;
use super::robust::ResidualLoss;
use crate::functions::{Basis, CoefficientFunction};
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::qp::Subproblem;
use crate::record::{Experiment, Measured, Measurements};
use crate::structure::Law;
use crate::system::{NodalCoefficients, TimePoint};

/// Relative decrease of the cost from which a restored state is used.
const RESTORED: f64 = 1e-6;
/// Fewest bump functions per parameter.
const FEWEST: usize = 8;

/// Form of the equation of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EquationForm {
    /// Integrated with bump functions.
    Weak,
    /// At every time.
    Pointwise,
}

/// The equation of motion of one record.
pub(super) struct Equation<'a> {
    pub experiment: &'a Experiment,
    pub measured: &'a Measured,
    /// Factor of each function at every time: `y'' + b''` for the mass, `phi` for a term.
    factors: Vec<Vec<f64>>,
    /// Force, N.
    force: Vec<f64>,
    /// Bump functions of the weak form.
    bumps: Option<Bumps>,
    pub loss: ResidualLoss,
}

impl<'a> Equation<'a> {
    /// The equation at every time, with the smoothed response.
    pub fn pointwise(
        problem: &Problem,
        experiment: &'a Experiment,
        measured: &'a Measured,
    ) -> Self {
        let times = measured.positions.len();
        let factor = |f: usize| {
            (0..times)
                .map(|i| measured.response(problem, f, i))
                .collect()
        };
        let factors = (0..=problem.system.laws().len()).map(|f| measured.filtered(factor(f)));
        Self {
            experiment,
            measured,
            factors: factors.collect(),
            force: measured.filtered(measured.force.clone()),
            bumps: None,
            loss: ResidualLoss::squares(),
        }
    }

    /// The equation integrated with bump functions; linear terms follow from the samples without smoothing where the mass has no jumps.
    fn weak(
        problem: &Problem,
        experiment: &'a Experiment,
        measured: &'a Measured,
        bumps: Bumps,
    ) -> Self {
        let mut equation = Self::pointwise(problem, experiment, measured);
        equation.bumps = Some(bumps);
        let set = problem
            .functions
            .coefficient_set(experiment.coefficient_set);
        let has_no_jump = (set.iter().zip(0..)).all(|(function, f)| {
            let is_differentiated = f == 0 || problem.system.laws()[f - 1] == Law::Damping;
            !is_differentiated || is_continuous(problem.functions.get(*function))
        });
        let Some(plain) = measured.unsmoothed.as_ref().filter(|_| has_no_jump) else {
            return equation;
        };
        let state = &plain.state;
        let inertia = state.a.iter().zip(&plain.base).map(|(a, b)| a + b);
        equation.factors[0] = measured.filtered(inertia.collect());
        for (term, factor) in problem.system.laws().iter().zip(&mut equation.factors[1..]) {
            if term.is_linear() {
                let pairs = state.y.iter().zip(&state.v);
                *factor = measured.filtered(pairs.map(|(y, v)| term.phi(*y, *v)).collect());
            }
        }
        equation.force = measured.filtered(plain.force.clone());
        equation
    }

    /// Length of the bump functions, s; `None` in the pointwise form.
    pub fn bump_length(&self) -> Option<f64> {
        let bumps = self.bumps.as_ref()?;
        Some(bumps.length() as f64 * self.measured.weight)
    }

    /// Number of residuals.
    pub fn len(&self) -> usize {
        let times = self.measured.positions.len();
        self.bumps.as_ref().map_or(times, Bumps::count)
    }

    /// Weight of a squared residual in the cost, s.
    pub fn weight(&self) -> f64 {
        let stride = self.bumps.as_ref().map_or(1, Bumps::stride);
        self.measured.weight * stride as f64
    }

    /// A series at all times in the form of the equation.
    pub fn averaged(&self, series: Vec<f64>) -> Vec<f64> {
        match &self.bumps {
            Some(bumps) => bumps.average(&series),
            None => series,
        }
    }

    /// Factor of a term that the equation may lack, in the form of the equation.
    pub fn factor_of(&self, term: Law) -> Vec<f64> {
        let states = self.measured.y.iter().zip(&self.measured.v);
        let factor = states.map(|(y, v)| term.phi(*y, *v)).collect();
        self.averaged(self.measured.filtered(factor))
    }

    /// Force of each function of the equation, then the measured force, in the form of the equation, N.
    pub fn forces(&self, nodal: &NodalCoefficients) -> Vec<Vec<f64>> {
        let functions = nodal.functions().zip(&self.factors);
        let forces = functions.map(|(values, factor)| {
            let pairs = self.measured.positions.iter().zip(factor);
            pairs
                .map(|(position, x)| blend(values, *position) * x)
                .collect()
        });
        let all = forces.chain(std::iter::once(self.force.clone()));
        all.map(|series| self.averaged(series)).collect()
    }

    /// Residual `m (y'' + b'') + sum_j p_j phi_j(y, y') - f` in the form of the equation, N.
    pub fn residuals(&self, nodal: &NodalCoefficients) -> Vec<f64> {
        let error = |(i, position): (usize, &TimePoint)| {
            let functions = nodal.functions().zip(&self.factors);
            let forces = functions.map(|(values, factor)| blend(values, *position) * factor[i]);
            forces.fold(-self.force[i], |sum, force| sum + force)
        };
        let errors = self
            .measured
            .positions
            .iter()
            .enumerate()
            .map(error)
            .collect();
        self.averaged(errors)
    }

    /// Residuals at the parameters `theta`, N.
    pub fn residuals_at(&self, problem: &Problem, theta: &[f64]) -> Vec<f64> {
        self.residuals(&nodal(problem, self.experiment, theta))
    }

    /// Integral of the loss of the residuals, N^2 s.
    pub fn misfit(&self, residuals: &[f64]) -> f64 {
        self.weight() * residuals.iter().map(|e| self.loss.cost(*e)).sum::<f64>()
    }

    /// Adds the `residuals` at some parameters, each times its `root`, as residuals in the steps from these parameters.
    pub fn add_rows(
        &self,
        problem: &Problem,
        residuals: &[f64],
        root: impl Fn(f64) -> f64,
        sub: &mut Subproblem,
    ) {
        for (i, residual) in residuals.iter().enumerate() {
            let root = root(*residual);
            let entries = match &self.bumps {
                None => self.entries(problem, i, root),
                Some(bumps) => {
                    let mut row = vec![0.0; sub.variables];
                    for (k, weight) in bumps.samples(i) {
                        let entries = self.entries(problem, k, root * weight);
                        entries.into_iter().for_each(|(j, a)| row[j] += a);
                    }
                    let entries = row.into_iter().enumerate();
                    entries.filter(|(_, a)| *a != 0.0).collect()
                }
            };
            sub.residuals.push(entries, -root * residual);
        }
    }

    /// Derivatives of the residual at time `i` with respect to the parameters, times `root`.
    fn entries(&self, problem: &Problem, i: usize, root: f64) -> Vec<(usize, f64)> {
        let functions = &problem.functions;
        let TimePoint { step, fraction } = self.measured.positions[i];
        let mut entries = Vec::new();
        let set = functions.coefficient_set(self.experiment.coefficient_set);
        for (position, f) in set.parts() {
            let first = functions.ranges()[f].start;
            let response = self.factors[position][i];
            for (side, share) in [1.0 - fraction, fraction].into_iter().enumerate() {
                if share != 0.0 {
                    let row = functions.get(f).design.row(step + side);
                    entries.extend(row.map(|(j, b)| (first + j, root * b * response * share)));
                }
            }
        }
        entries
    }

    /// Replaces the factors of nonlinear terms by those of the restored state at the parameters `theta`, where these lower the cost;
    /// true if they do.
    fn restore(&mut self, problem: &Problem, theta: &[f64]) -> bool {
        let terms = problem.system.laws();
        let is_nonlinear = |term: &Law| !term.is_linear() && *term != Law::Offset;
        if self.bumps.is_none() || !terms.iter().any(is_nonlinear) {
            return false;
        }
        let nodal = nodal(problem, self.experiment, theta);
        let Some([y, v]) = restored(problem, self.measured, &nodal) else {
            return false;
        };
        let before = self.misfit(&self.residuals(&nodal));
        let present = self.factors.clone();
        for (term, factor) in terms.iter().zip(&mut self.factors[1..]) {
            if is_nonlinear(term) {
                let pairs = y.iter().zip(&v);
                let series = pairs.map(|(y, v)| term.phi(*y, *v)).collect();
                *factor = self.measured.filtered(series);
            }
        }
        let after = self.misfit(&self.residuals(&nodal));
        // NaN is not lower.
        let is_lower = after < (1.0 - RESTORED) * before;
        if !is_lower {
            self.factors = present;
        }
        is_lower
    }

    /// Adds the gradient of the misfit with respect to the parameters `theta`.
    pub fn add_gradient(&self, problem: &Problem, theta: &[f64], gradient: &mut [f64]) {
        let residuals = self.residuals_at(problem, theta);
        let weight = self.weight();
        let each = residuals
            .iter()
            .map(|e| 2.0 * weight * self.loss.weight(*e) * e);
        let pushes: Vec<f64> = each.collect();
        let pushes = match &self.bumps {
            Some(bumps) => bumps.spread(&pushes, self.measured.positions.len()),
            None => pushes,
        };
        let mut nodal: NodalCoefficients = problem.functions.empty_nodal();
        for (values, factor) in nodal.functions_mut().zip(&self.factors) {
            for ((position, push), x) in self.measured.positions.iter().zip(&pushes).zip(factor) {
                let push = push * x;
                values[position.step] += push * (1.0 - position.fraction);
                values[position.step + 1] += push * position.fraction;
            }
        }
        let functions = &problem.functions;
        functions.add_transpose(&nodal, self.experiment.coefficient_set, gradient);
    }
}

/// The equations of motion of all records with samples, in one form.
pub(super) struct Equations<'a> {
    pub form: EquationForm,
    pub list: Vec<Equation<'a>>,
}

impl<'a> Equations<'a> {
    /// The equations in the form that the module comment states, with the losses of the channels and bump functions of the width that
    /// was chosen for the measurements, else of the largest one.
    pub fn of(problem: &'a Problem, measurements: &'a Measurements) -> Self {
        let halvings = measurements.halvings.get().copied();
        Self::of_width(problem, measurements, halvings.unwrap_or(0))
    }

    /// [`Equations::of`] with bump functions whose width is halved `halvings` times.
    pub fn of_width(problem: &'a Problem, measurements: &'a Measurements, halvings: i32) -> Self {
        let pairs = problem.experiments.iter().zip(&measurements.experiments);
        let pairs: Vec<(&Experiment, &Measured)> = pairs
            .filter_map(|(experiment, measured)| Some((experiment, measured.as_ref()?)))
            .collect();
        let bumps = |halvings| -> Vec<Bumps> {
            let each = pairs.iter().map(|(experiment, measured)| {
                bump_lengths::bumps(problem, experiment, measured.in_weak_form(), halvings)
            });
            each.collect()
        };
        let parameters = problem.functions.scalar_range().start;
        let widest = bumps(0);
        let count: usize = widest.iter().map(Bumps::count).sum();
        let is_weak = parameters <= FEW_PARAMETERS && count >= FEWEST * parameters.max(1);
        let bumps = if halvings > 0 {
            bumps(halvings)
        } else {
            widest
        };
        let list = pairs
            .iter()
            .zip(bumps)
            .map(|((experiment, measured), bumps)| {
                let equation = match is_weak {
                    true => Equation::weak(problem, experiment, measured.in_weak_form(), bumps),
                    false => Equation::pointwise(problem, experiment, measured),
                };
                Equation {
                    loss: ResidualLoss::of(experiment),
                    ..equation
                }
            });
        Self {
            form: match is_weak {
                true => EquationForm::Weak,
                false => EquationForm::Pointwise,
            },
            list: list.collect(),
        }
    }

    /// Changes the width of the bump functions of the weak form; true if it is another one.
    pub fn set_halvings(&mut self, problem: &Problem, halvings: i32) -> bool {
        let mut is_changed = false;
        for equation in &mut self.list {
            if let Some(bumps) = &mut equation.bumps {
                let next =
                    bump_lengths::bumps(problem, equation.experiment, equation.measured, halvings);
                is_changed |= next.length() != bumps.length();
                *bumps = next;
            }
        }
        is_changed
    }

    /// [`Equations::of`] with restored nonlinear terms and the scales of robust losses at the parameters `theta`.
    pub fn at(problem: &'a Problem, measurements: &'a Measurements, theta: &[f64]) -> Self {
        let mut equations = Self::of(problem, measurements);
        equations.set_scales(problem, theta);
        equations.restore(problem, theta);
        equations.set_scales(problem, theta);
        equations
    }

    /// Restores the factors of nonlinear terms at the parameters `theta` ([`restored`]); true if the cost falls.
    pub fn restore(&mut self, problem: &Problem, theta: &[f64]) -> bool {
        let mut is_lower = false;
        for equation in &mut self.list {
            is_lower |= equation.restore(problem, theta);
        }
        is_lower
    }

    /// Sets the scales of robust losses to those of the residuals at the parameters `theta`.
    pub fn set_scales(&mut self, problem: &Problem, theta: &[f64]) {
        for equation in &mut self.list {
            let residuals = equation.residuals_at(problem, theta);
            equation.loss = equation.loss.scaled_by(&residuals);
        }
    }

    /// True with a robust loss.
    pub fn are_robust(&self) -> bool {
        self.list.iter().any(|equation| equation.loss.is_robust())
    }
}

/// True for a function of time without jumps.
fn is_continuous(function: &CoefficientFunction) -> bool {
    match &function.basis {
        Some(Basis::PiecewiseConstant { .. }) => false,
        Some(_) => true,
        None => function.offset.windows(2).all(|pair| pair[0] == pair[1]),
    }
}
