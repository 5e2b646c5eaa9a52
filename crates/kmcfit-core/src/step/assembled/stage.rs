//! The equation of motion at one stage of a step.

use crate::simd::Real;
use crate::structure::{Partials, Structure, banded::Banded};

/// A number whose size decides when an iteration ends.
pub(crate) trait Scalar: Real + PartialEq {
    /// Iterations of Newton's method after the one that is converged in value.
    const FURTHER: u32;
    fn value(self) -> f64;
}

impl Scalar for f64 {
    const FURTHER: u32 = 0;

    fn value(self) -> f64 {
        self
    }
}

/// Values at one stage.
#[derive(Debug, Clone)]
pub(crate) struct StageValues<T> {
    /// Of the functions.
    pub functions: Vec<T>,
    /// Forces on the coordinates.
    pub forces: Vec<T>,
    /// Accelerations of the frames of the coordinates.
    pub frames: Vec<T>,
    /// Displacements, velocities and accelerations of the supports.
    pub supports: [Vec<T>; 3],
}

impl<T: Real> StageValues<T> {
    pub fn zeros(structure: &Structure, zero: T) -> Self {
        let supports = vec![zero; structure.supports()];
        Self {
            functions: vec![zero; structure.functions()],
            forces: vec![zero; structure.coordinates()],
            frames: vec![zero; structure.coordinates()],
            supports: [supports.clone(), supports.clone(), supports],
        }
    }
}

/// State, accelerations and derivatives at one stage.
///
/// The accelerations `a` satisfy the equation of motion at displacements `q + h (v + h a)`, velocities `v + h a` and internal states
/// `z + h z'`, with the state `q`, `v`, `z` that the stage starts from. An explicit stage has `h = 0`. With the matrices `C` and `K` of the slopes,
///
/// ```text
/// (M + h C + h^2 K) da = df - M dg'' - sum_e b_e (p_e (slopes) b_e (dq + h dv, dv) + dp_e phi_e) - sum_r b_r dm_r b_r (q'' + g'')
/// ```
///
/// Internal states depend on their own element alone and are eliminated: slopes and `phi` are those of the force with the internal state that
/// the elongation at the stage gives.
#[derive(Debug, Clone)]
pub(crate) struct AssembledStage<T> {
    pub values: StageValues<T>,
    /// Displacements and velocities at the stage, those of supports last.
    pub q: Vec<T>,
    pub v: Vec<T>,
    /// Accelerations relative to the frames.
    pub a: Vec<T>,
    /// Internal states, and their rates.
    pub z: Vec<T>,
    pub rates: Vec<T>,
    /// `b_r (q'' + g'')` of the inertias, then the derivatives of the elements' forces by their coefficients, `phi_e`.
    pub(super) phi: Vec<T>,
    /// Derivatives of the elements' forces `p_e phi_e` by elongation and rate.
    pub(super) slopes: Vec<[T; 2]>,
    /// Of each element with an internal state.
    pub(super) internal: Vec<Internal<T>>,
    pub(super) matrix: Banded<T>,
    /// Values for which the matrix is factorised; empty for none.
    factorised: Vec<T>,
    pub(super) work: Vec<T>,
    pub(super) step: Vec<T>,
}

/// An element with an internal state, and the derivatives of its force and of the rate of its state: by elongation and rate at the stage, by the
/// state that the stage starts from, and by its coefficients.
#[derive(Debug, Clone)]
pub(super) struct Internal<T> {
    pub(super) element: usize,
    /// First function.
    pub(super) first: usize,
    pub(super) force_by_state: T,
    pub(super) rate_by: [T; 3],
    pub(super) rate_by_coefficients: Vec<T>,
}

/// Why a stage has no solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unsolved {
    /// The matrix of masses is not positive definite.
    Mass,
    /// The equation of an implicit step has no solution, or Newton's method does not converge.
    Newton,
}

/// Iterations of Newton's method before it is given up.
const ITERATIONS: u32 = 60;
/// Change of the velocity by an iteration, relative to the velocity, after which the error, which is squared by each, is rounding.
const CONVERGED: f64 = 1e-8;
/// Share of a step below which it is not halved again.
const SHORTEST: f64 = 1e-3;

impl<T: Scalar> AssembledStage<T> {
    pub fn new(structure: &Structure, zero: T) -> Self {
        let (n, all) = (
            structure.coordinates(),
            structure.coordinates() + structure.supports(),
        );
        let laws = structure.laws().iter().enumerate();
        let internal = laws.filter(|(_, law)| law.has_internal_state());
        let internal = internal.map(|(element, law)| Internal {
            element,
            first: structure.function_of(element),
            force_by_state: zero,
            rate_by: [zero; 3],
            rate_by_coefficients: vec![zero; law.coefficients()],
        });
        Self {
            z: vec![zero; structure.internal_states()],
            rates: vec![zero; structure.internal_states()],
            internal: internal.collect(),
            values: StageValues::zeros(structure, zero),
            q: vec![zero; all],
            v: vec![zero; all],
            a: vec![zero; all],
            phi: vec![zero; structure.functions()],
            slopes: vec![[zero; 2]; structure.laws().len()],
            matrix: Banded::zeros(n, structure.bandwidth(), zero),
            factorised: Vec::new(),
            work: vec![zero; n],
            step: vec![zero; n],
        }
    }

    /// Solves for the accelerations from the state `q`, `v`, `z`; an implicit stage starts from the accelerations there are.
    pub fn solve(
        &mut self,
        structure: &Structure,
        h: f64,
        [q, v, z]: [&[T]; 3],
    ) -> Result<(), Unsolved> {
        let n = structure.coordinates();
        let zero = q[0].like(0.0);
        self.place_supports(n);
        if h == 0.0 {
            // Without accelerations relative to the inertial frame.
            for j in 0..n {
                self.a[j] = zero - self.values.frames[j];
            }
        }
        match h == 0.0 || structure.is_linear() {
            true => {
                self.position(n, h, q, v);
                self.settle(structure, h, z)?;
                self.residual(structure);
                self.newton_step(structure, h)?;
            }
            false => self.iterate(structure, h, [q, v, z])?,
        }
        self.position(n, h, q, v);
        self.settle(structure, h, z)
    }

    /// Newton's method. A step that does not reduce the residual is halved, down to rounding.
    fn iterate(
        &mut self,
        structure: &Structure,
        h: f64,
        [q, v, z]: [&[T]; 3],
    ) -> Result<(), Unsolved> {
        let n = structure.coordinates();
        let size = |x: &[T]| x.iter().map(|x| x.value().abs()).fold(0.0, f64::max);
        let (mut norm, mut length, mut further) = (f64::INFINITY, 1.0, T::FURTHER);
        for _ in 0..ITERATIONS {
            self.position(n, h, q, v);
            self.settle(structure, h, z)?;
            self.residual(structure);
            let now = size(&self.work);
            if now >= norm && length > SHORTEST {
                length *= 0.5;
                for (a, step) in self.a.iter_mut().zip(&self.step) {
                    *a = *a - step.scale(length);
                }
                continue;
            }
            (norm, length) = (now, 1.0);
            self.newton_step(structure, h)?;
            self.step.copy_from_slice(&self.work);
            let scale = size(&self.a[..n]).max(size(&v[..n]) / h);
            if size(&self.step) <= CONVERGED * scale {
                if further == 0 {
                    return Ok(());
                }
                further -= 1;
                norm = f64::INFINITY;
            }
        }
        Err(Unsolved::Newton)
    }

    /// Replaces the residual by the step that it asks for, and takes it.
    fn newton_step(&mut self, structure: &Structure, h: f64) -> Result<(), Unsolved> {
        self.factorise(structure, h)?;
        self.matrix.solve(&mut self.work);
        for (a, step) in self.a.iter_mut().zip(&self.work) {
            *a = *a + *step;
        }
        Ok(())
    }

    /// The stage with known accelerations of the coordinates.
    pub fn adopt(
        &mut self,
        structure: &Structure,
        h: f64,
        [q, v, z]: [&[T]; 3],
        accelerations: impl Iterator<Item = T>,
    ) -> Result<(), Unsolved> {
        let n = structure.coordinates();
        self.place_supports(n);
        let each = self.a[..n].iter_mut().zip(accelerations);
        each.for_each(|(to, a)| *to = a);
        self.position(n, h, q, v);
        self.settle(structure, h, z)
    }

    fn place_supports(&mut self, n: usize) {
        let [of_q, of_v, of_a] = &self.values.supports;
        self.q[n..].copy_from_slice(of_q);
        self.v[n..].copy_from_slice(of_v);
        self.a[n..].copy_from_slice(of_a);
    }

    /// Displacements and velocities at the stage.
    fn position(&mut self, n: usize, h: f64, q: &[T], v: &[T]) {
        for j in 0..n {
            (self.q[j], self.v[j]) = match h == 0.0 {
                true => (q[j], v[j]),
                false => {
                    let velocity = v[j] + self.a[j].scale(h);
                    (q[j] + velocity.scale(h), velocity)
                }
            };
        }
    }

    /// Internal states at the stage for elongations there, from those `z` that it starts from, with their rates: `z_s = z + h z'`.
    fn settle(&mut self, structure: &Structure, h: f64, z: &[T]) -> Result<(), Unsolved> {
        self.z.copy_from_slice(z);
        for k in 0..self.internal.len() {
            let mut further = T::FURTHER;
            for iteration in 0.. {
                let [_, rate] = self.partials(structure, k);
                self.rates[k] = rate.value;
                if h == 0.0 {
                    break;
                }
                let missing = z[k] + rate.value.scale(h) - self.z[k];
                let change = missing / (missing.like(1.0) - rate.by[2].scale(h));
                self.z[k] = self.z[k] + change;
                let size = self.z[k].value().abs() + h * rate.value.value().abs();
                if change.value().abs() <= CONVERGED * size {
                    if further == 0 {
                        // The error is squared by each iteration.
                        self.rates[k] = (self.z[k] - z[k]).scale(1.0 / h);
                        break;
                    }
                    further -= 1;
                }
                if iteration == ITERATIONS || !change.value().is_finite() {
                    return Err(Unsolved::Newton);
                }
            }
        }
        Ok(())
    }

    /// Force of the element with internal state `k` and the rate of the state, as they are at the stage.
    fn partials(&self, structure: &Structure, k: usize) -> [Partials<T>; 2] {
        let Internal { element, first, .. } = self.internal[k];
        let law = structure.laws()[element];
        let r = structure.ends(element).across(&self.v);
        let coefficients = &self.values.functions[first..first + law.coefficients()];
        let signs = [r, self.z[k]].map(|x| 1f64.copysign(x.value()));
        law.with_internal_state(coefficients, r, self.z[k], signs)
    }

    /// What is missing in the equation of motion, as forces.
    fn residual(&mut self, structure: &Structure) {
        self.work.copy_from_slice(&self.values.forces);
        let zero = self.q[0].like(0.0);
        self.accelerations_of_inertias(structure);
        let count = structure.inertias().len();
        for (f, ends) in structure.inertias().iter().enumerate() {
            let force = self.values.functions[f] * self.phi[f];
            ends.spread(zero - force, &mut self.work);
        }
        let mut f = count;
        for (law, ends) in structure.elements() {
            let phi = law.phi(ends.across(&self.q), ends.across(&self.v));
            self.phi[f] = phi;
            let force = self.values.functions[f] * phi;
            ends.spread(zero - force, &mut self.work);
            f += law.coefficients();
        }
        for k in 0..self.internal.len() {
            let [force, _] = self.partials(structure, k);
            let ends = structure.ends(self.internal[k].element);
            ends.spread(zero - force.value, &mut self.work);
        }
    }

    /// `b_r (q'' + g'')`.
    fn accelerations_of_inertias(&mut self, structure: &Structure) {
        let n = structure.coordinates();
        for (f, ends) in structure.inertias().iter().enumerate() {
            let mut sum = ends.across(&self.a);
            for (j, factor) in ends.entries().iter().filter(|(j, _)| *j < n) {
                sum = sum + self.values.frames[*j].scale(*factor);
            }
            self.phi[f] = sum;
        }
    }

    /// Slopes at the stage, and `phi` of all functions, for an implicit part `h` of the step.
    pub fn linearise(&mut self, structure: &Structure, h: f64) {
        self.accelerations_of_inertias(structure);
        self.set_slopes(structure, h);
    }

    fn set_slopes(&mut self, structure: &Structure, h: f64) {
        let mut f = structure.inertias().len();
        for (e, (law, ends)) in structure.elements().enumerate() {
            let (x, r) = (ends.across(&self.q), ends.across(&self.v));
            self.phi[f] = law.phi(x, r);
            let p = self.values.functions[f];
            let slopes = law.slopes(x, r);
            self.slopes[e] = slopes.map(|slope| slope.map_or(p.like(0.0), |slope| p * slope));
            f += law.coefficients();
        }
        for k in 0..self.internal.len() {
            let [force, rate] = self.partials(structure, k);
            let one = rate.value.like(1.0);
            // The state at the stage by elongation, rate, the state before and the coefficients, times 1 - h dz'/dz.
            let share = one / (one - rate.by[2].scale(h));
            let internal = &mut self.internal[k];
            let [by_x, by_r, by_z] = force.by;
            let through = by_z * share.scale(h);
            self.slopes[internal.element] =
                [by_x + through * rate.by[0], by_r + through * rate.by[1]];
            internal.force_by_state = by_z * share;
            internal.rate_by = rate.by.map(|by| by * share);
            for (c, to) in internal.rate_by_coefficients.iter_mut().enumerate() {
                *to = rate.by_coefficients[c] * share;
                self.phi[internal.first + c] =
                    force.by_coefficients[c] + through * rate.by_coefficients[c];
            }
        }
    }

    /// Factorises `M + h C + h^2 K`; again only where values changed on which it depends.
    pub fn factorise(&mut self, structure: &Structure, h: f64) -> Result<(), Unsolved> {
        let count = structure.inertias().len();
        let functions = match h == 0.0 {
            true => &self.values.functions[..count],
            false => &self.values.functions[..],
        };
        let depends_on_state = h != 0.0 && !structure.is_linear();
        if !depends_on_state && self.factorised == functions {
            return Ok(());
        }
        let masses_are_known = self.factorised.get(..count) == functions.get(..count);
        self.factorised.clear();
        self.factorised.extend_from_slice(functions);
        self.matrix.fill(self.q[0].like(0.0));
        for f in 0..count {
            self.matrix
                .add(structure.pattern(f), self.values.functions[f]);
        }
        if h != 0.0 {
            if !masses_are_known {
                let mut masses = self.matrix.clone();
                masses.factorise();
                if !masses.diagonal().all(|d| d.value() > 0.0) {
                    self.factorised.clear();
                    return Err(Unsolved::Mass);
                }
            }
            self.set_slopes(structure, h);
            for (e, [by_q, by_v]) in self.slopes.iter().enumerate() {
                let factor = by_v.scale(h) + by_q.scale(h * h);
                self.matrix.add(structure.pattern(count + e), factor);
            }
        }
        self.matrix.factorise();
        // An implicit matrix of negative stiffness may have negative pivots.
        let is_solvable = |d: f64| d.is_finite() && if h == 0.0 { d > 0.0 } else { d != 0.0 };
        match self.matrix.diagonal().all(|d| is_solvable(d.value())) {
            true => Ok(()),
            false => {
                self.factorised.clear();
                Err(match h == 0.0 {
                    true => Unsolved::Mass,
                    false => Unsolved::Newton,
                })
            }
        }
    }
}
