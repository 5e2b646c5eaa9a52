//! The equation of motion at one stage of a step.

use crate::simd::Real;
use crate::structure::{Structure, banded::Banded};

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
/// The accelerations `a` satisfy the equation of motion at displacements `q + h (v + h a)` and velocities `v + h a`, with the state `q`, `v`
/// that the stage starts from. An explicit stage has `h = 0`. With the matrices `C` and `K` of the slopes,
///
/// ```text
/// (M + h C + h^2 K) da = df - M dg'' - sum_e b_e (p_e (slopes) b_e (dq + h dv, dv) + dp_e phi_e) - sum_r b_r dm_r b_r (q'' + g'')
/// ```
#[derive(Debug, Clone)]
pub(crate) struct Stage<T> {
    pub values: StageValues<T>,
    /// Displacements and velocities at the stage, those of supports last.
    pub q: Vec<T>,
    pub v: Vec<T>,
    /// Accelerations relative to the frames.
    pub a: Vec<T>,
    /// `b_r (q'' + g'')` of the inertias, then `phi_e` of the elements.
    phi: Vec<T>,
    /// Derivatives of the elements' forces `p_e phi_e` by elongation and rate.
    slopes: Vec<[T; 2]>,
    matrix: Banded<T>,
    /// Values for which the matrix is factorised; empty for none.
    factorised: Vec<T>,
    work: Vec<T>,
    step: Vec<T>,
}

/// Why a stage has no solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Trouble {
    /// The matrix of masses is not positive definite.
    Mass,
    /// Newton's method does not converge.
    Newton,
}

/// Iterations of Newton's method before it is given up.
const ITERATIONS: u32 = 60;
/// Change of the velocity by an iteration, relative to the velocity, after which the error, which is squared by each, is rounding.
const CONVERGED: f64 = 1e-8;
/// Share of a step below which it is not halved again.
const SHORTEST: f64 = 1e-3;

impl<T: Scalar> Stage<T> {
    pub fn new(structure: &Structure, zero: T) -> Self {
        let (n, all) = (
            structure.coordinates(),
            structure.coordinates() + structure.supports(),
        );
        Self {
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

    /// Solves for the accelerations from the state `q`, `v`; an implicit stage starts from the accelerations there are.
    pub fn solve(
        &mut self,
        structure: &Structure,
        h: f64,
        q: &[T],
        v: &[T],
    ) -> Result<(), Trouble> {
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
                self.place(n, h, q, v);
                self.residual(structure);
                self.newton_step(structure, h)?;
            }
            false => self.iterate(structure, h, q, v)?,
        }
        self.place(n, h, q, v);
        Ok(())
    }

    /// Newton's method. A step that does not reduce the residual is halved, down to rounding.
    fn iterate(&mut self, structure: &Structure, h: f64, q: &[T], v: &[T]) -> Result<(), Trouble> {
        let n = structure.coordinates();
        let size = |x: &[T]| x.iter().map(|x| x.value().abs()).fold(0.0, f64::max);
        let (mut norm, mut length, mut further) = (f64::INFINITY, 1.0, T::FURTHER);
        for _ in 0..ITERATIONS {
            self.place(n, h, q, v);
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
        Err(Trouble::Newton)
    }

    /// Replaces the residual by the step that it asks for, and takes it.
    fn newton_step(&mut self, structure: &Structure, h: f64) -> Result<(), Trouble> {
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
        q: &[T],
        v: &[T],
        accelerations: impl Iterator<Item = T>,
    ) {
        let n = structure.coordinates();
        self.place_supports(n);
        let each = self.a[..n].iter_mut().zip(accelerations);
        each.for_each(|(to, a)| *to = a);
        self.place(n, h, q, v);
    }

    fn place_supports(&mut self, n: usize) {
        let [of_q, of_v, of_a] = &self.values.supports;
        self.q[n..].copy_from_slice(of_q);
        self.v[n..].copy_from_slice(of_v);
        self.a[n..].copy_from_slice(of_a);
    }

    /// Displacements and velocities at the stage.
    fn place(&mut self, n: usize, h: f64, q: &[T], v: &[T]) {
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
        for (e, (law, ends)) in structure.elements().enumerate() {
            let phi = law.phi(ends.across(&self.q), ends.across(&self.v));
            self.phi[count + e] = phi;
            let force = self.values.functions[count + e] * phi;
            ends.spread(zero - force, &mut self.work);
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

    /// Slopes at the stage, and `phi` of all functions.
    pub fn linearise(&mut self, structure: &Structure) {
        self.accelerations_of_inertias(structure);
        let count = structure.inertias().len();
        for (e, (law, ends)) in structure.elements().enumerate() {
            let (x, r) = (ends.across(&self.q), ends.across(&self.v));
            self.phi[count + e] = law.phi(x, r);
            self.set_slopes(e, count, law.slopes(x, r));
        }
    }

    fn set_slopes(&mut self, e: usize, count: usize, slopes: [Option<T>; 2]) {
        let p = self.values.functions[count + e];
        self.slopes[e] = slopes.map(|slope| slope.map_or(p.like(0.0), |slope| p * slope));
    }

    /// Factorises `M + h C + h^2 K`; again only where values changed on which it depends.
    pub fn factorise(&mut self, structure: &Structure, h: f64) -> Result<(), Trouble> {
        let count = structure.inertias().len();
        let functions = match h == 0.0 {
            true => &self.values.functions[..count],
            false => &self.values.functions[..],
        };
        let depends_on_state = h != 0.0 && !structure.is_linear();
        if !depends_on_state && self.factorised == functions {
            return Ok(());
        }
        self.factorised.clear();
        self.factorised.extend_from_slice(functions);
        self.matrix.fill(self.q[0].like(0.0));
        for f in 0..count {
            self.matrix
                .add(structure.pattern(f), self.values.functions[f]);
        }
        if h != 0.0 {
            for (e, (law, ends)) in structure.elements().enumerate() {
                self.set_slopes(
                    e,
                    count,
                    law.slopes(ends.across(&self.q), ends.across(&self.v)),
                );
                let [by_q, by_v] = self.slopes[e];
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
                Err(Trouble::Mass)
            }
        }
    }
}

/// Derivatives with respect to the values at a stage.
#[derive(Debug, Clone)]
pub(crate) struct StageShares {
    pub functions: Vec<f64>,
    pub forces: Vec<f64>,
    pub frames: Vec<f64>,
}

impl StageShares {
    pub fn zeros(structure: &Structure) -> Self {
        Self {
            functions: vec![0.0; structure.functions()],
            forces: vec![0.0; structure.coordinates()],
            frames: vec![0.0; structure.coordinates()],
        }
    }
}

impl Stage<f64> {
    /// Multipliers of the state that the stage starts from, added to `state`, for multipliers `velocity` of the velocities at the stage and
    /// `acceleration` of its accelerations; the factor is that of the stage.
    pub fn pull(
        &mut self,
        structure: &Structure,
        h: f64,
        velocity: &[f64],
        acceleration: &[f64],
        state: [&mut [f64]; 2],
        shares: &mut StageShares,
    ) {
        let [by_q, by_v] = state;
        let count = structure.inertias().len();
        for ((w, a), v) in self.work.iter_mut().zip(acceleration).zip(velocity) {
            *w = a + h * v;
        }
        self.matrix.solve(&mut self.work);
        shares.forces.copy_from_slice(&self.work);
        by_v.iter_mut().zip(velocity).for_each(|(to, v)| *to += v);
        shares.frames.fill(0.0);
        for (f, ends) in structure.inertias().iter().enumerate() {
            let across = of_coordinates(ends.entries(), &self.work);
            shares.functions[f] = -across * self.phi[f];
            ends.spread(-across * self.values.functions[f], &mut shares.frames);
        }
        for (e, (_, ends)) in structure.elements().enumerate() {
            let across = of_coordinates(ends.entries(), &self.work);
            shares.functions[count + e] = -across * self.phi[count + e];
            let [slope_q, slope_v] = self.slopes[e];
            ends.spread(-across * slope_q, by_q);
            ends.spread(-across * (slope_v + h * slope_q), by_v);
        }
    }

    /// Changes of velocities and accelerations at the stage, in `out`, for changes `q`, `v` of the state that it starts from and changes
    /// of the values.
    pub fn push(
        &mut self,
        structure: &Structure,
        h: f64,
        [q, v]: [&[f64]; 2],
        changes: &StageValues<f64>,
        [to_v, to_a]: [&mut [f64]; 2],
    ) {
        let count = structure.inertias().len();
        let n = structure.coordinates();
        self.work.copy_from_slice(&changes.forces);
        for (f, ends) in structure.inertias().iter().enumerate() {
            let mut frame = 0.0;
            for (j, factor) in ends.entries() {
                frame += factor * changes.frames.get(*j).copied().unwrap_or(0.0);
            }
            let force = self.values.functions[f] * frame + changes.functions[f] * self.phi[f];
            ends.spread(-force, &mut self.work);
        }
        for (e, (_, ends)) in structure.elements().enumerate() {
            let [slope_q, slope_v] = self.slopes[e];
            let [dq, dv] = [q, v].map(|x| of_coordinates(ends.entries(), x));
            let force = slope_q * (dq + h * dv) + slope_v * dv;
            ends.spread(
                -force - changes.functions[count + e] * self.phi[count + e],
                &mut self.work,
            );
        }
        self.matrix.solve(&mut self.work);
        to_a.copy_from_slice(&self.work);
        for j in 0..n {
            to_v[j] = v[j] + h * self.work[j];
        }
    }
}

/// A combination of coordinates, without supports.
fn of_coordinates(entries: &[(usize, f64)], x: &[f64]) -> f64 {
    let terms = entries
        .iter()
        .filter_map(|(j, factor)| Some(factor * x.get(*j)?));
    terms.sum()
}
