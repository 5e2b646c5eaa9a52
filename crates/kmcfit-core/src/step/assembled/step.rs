//! Steps of a structure, their tangents and their transposes, stage by stage.

use super::super::tableau::{At, MIDPOINT, RK4};
use super::stage::{AssembledStage, Scalar, StageValues, Unsolved};
use super::stage_derivatives::StageShares;
use crate::structure::Structure;
use crate::system::Method;

/// Coefficients of a method as in [`Tableau`](super::super::tableau::Tableau); every stage is at the end of an implicit Euler step of
/// `implicit` steps from the state that it starts from.
#[derive(Clone, Copy)]
struct Scheme {
    at: &'static [At],
    next: &'static [f64],
    end: &'static [f64],
    implicit: f64,
}

impl Scheme {
    fn of(method: Method) -> Self {
        match method {
            Method::Midpoint => Self {
                at: &MIDPOINT.at,
                next: &MIDPOINT.next,
                end: &MIDPOINT.end,
                implicit: 0.0,
            },
            Method::Rk4 => Self {
                at: &RK4.at,
                next: &RK4.next,
                end: &RK4.end,
                implicit: 0.0,
            },
            Method::ImplicitMidpoint => Self {
                at: &[At::Middle],
                next: &[0.0],
                end: &[1.0],
                implicit: 0.5,
            },
        }
    }
}

/// Where the values at a stage of a step come from.
pub(crate) trait Source<T> {
    fn read(&self, step: usize, at: At, values: &mut StageValues<T>);
}

/// Steps of a structure. A state has the displacements of the coordinates, then their velocities, then the internal states of elements.
pub(crate) struct Steps<'a, T> {
    pub structure: &'a Structure,
    scheme: Scheme,
    dt: f64,
    stages: Vec<AssembledStage<T>>,
    from: Vec<T>,
    sum: Vec<T>,
}

impl<'a, T: Scalar> Steps<'a, T> {
    pub fn new(structure: &'a Structure, method: Method, dt: f64, zero: T) -> Self {
        let scheme = Scheme::of(method);
        let state = vec![zero; structure.components()];
        Self {
            structure,
            scheme,
            dt,
            stages: vec![AssembledStage::new(structure, zero); scheme.at.len()],
            from: state.clone(),
            sum: state,
        }
    }

    /// Goes from the state `x` at the left node of a step to that at its right node.
    pub fn advance(
        &mut self,
        source: &impl Source<T>,
        step: usize,
        x: &mut [T],
    ) -> Result<(), Unsolved> {
        let (n, scheme) = (self.structure.coordinates(), self.scheme);
        let h = self.dt * scheme.implicit;
        self.sum.copy_from_slice(x);
        self.from.copy_from_slice(x);
        for (s, stage) in self.stages.iter_mut().enumerate() {
            source.read(step, scheme.at[s], &mut stage.values);
            stage.solve(self.structure, h, parts(&self.from, n))?;
            let [end, next] = [scheme.end[s], scheme.next[s]].map(|share| self.dt * share);
            let slopes = stage.v[..n].iter().chain(&stage.a[..n]);
            for (k, slope) in slopes.chain(&stage.rates).enumerate() {
                self.sum[k] = self.sum[k] + slope.scale(end);
                self.from[k] = x[k] + slope.scale(next);
            }
        }
        x.copy_from_slice(&self.sum);
        Ok(())
    }
}

impl Steps<'_, f64> {
    /// Linearises a step about the state at its left node, which becomes that at its right node. An implicit step to a known state `next` is
    /// not solved again.
    pub fn linearise(
        &mut self,
        source: &impl Source<f64>,
        step: usize,
        x: &mut [f64],
        next: Option<&[f64]>,
    ) -> Result<(), Unsolved> {
        let (n, dt, scheme) = (self.structure.coordinates(), self.dt, self.scheme);
        let h = dt * scheme.implicit;
        match (self.stages.as_mut_slice(), next) {
            ([stage], Some(next)) if h != 0.0 => {
                source.read(step, scheme.at[0], &mut stage.values);
                let from = parts(x, n);
                let velocities = next[n..2 * n].iter().zip(from[1]);
                let accelerations = velocities.map(|(next, v)| (next - v) / dt);
                stage.adopt(self.structure, h, from, accelerations)?;
                x.copy_from_slice(next);
            }
            _ => self.advance(source, step, x)?,
        }
        for stage in &mut self.stages {
            stage.linearise(self.structure, h);
            stage.factorise(self.structure, h)?;
        }
        Ok(())
    }

    /// Replaces multipliers `y` of the state at the right node of the linearised step by those of the state at its left node; `see` takes
    /// the derivatives with respect to the values at each stage.
    pub fn pull(
        &mut self,
        y: &mut [f64],
        shares: &mut StageShares,
        mut see: impl FnMut(At, &StageShares),
    ) {
        let (n, scheme) = (self.structure.coordinates(), self.scheme);
        let h = self.dt * scheme.implicit;
        let end = y.to_vec();
        // Of the state from which the next stage starts, then this one.
        let mut of_start = vec![0.0; end.len()];
        for (s, stage) in self.stages.iter_mut().enumerate().rev() {
            let [by_end, by_next] = [scheme.end[s], scheme.next[s]].map(|share| self.dt * share);
            let slopes: Vec<f64> = end
                .iter()
                .zip(&of_start)
                .map(|(end, start)| by_end * end + by_next * start)
                .collect();
            of_start.fill(0.0);
            let by_state = parts_mut(&mut of_start, n);
            stage.pull(self.structure, h, parts(&slopes, n), by_state, shares);
            see(scheme.at[s], shares);
            y.iter_mut().zip(&of_start).for_each(|(y, x)| *y += x);
        }
    }

    /// Replaces a change `x` of the state at the left node of the linearised step by that of the state at its right node, with the changes of
    /// the values that `source` has.
    pub fn push(&mut self, source: &impl Source<f64>, step: usize, x: &mut [f64]) {
        let (n, scheme) = (self.structure.coordinates(), self.scheme);
        let h = self.dt * scheme.implicit;
        let mut changes = StageValues::zeros(self.structure, 0.0);
        let mut slopes = vec![0.0; x.len()];
        self.sum.copy_from_slice(x);
        self.from.copy_from_slice(x);
        for (s, stage) in self.stages.iter_mut().enumerate() {
            source.read(step, scheme.at[s], &mut changes);
            let to = parts_mut(&mut slopes, n);
            stage.push(self.structure, h, parts(&self.from, n), &changes, to);
            let [end, next] = [scheme.end[s], scheme.next[s]].map(|share| self.dt * share);
            for (k, slope) in slopes.iter().enumerate() {
                self.sum[k] += end * slope;
                self.from[k] = x[k] + next * slope;
            }
        }
        x.copy_from_slice(&self.sum);
    }
}

/// Displacements, velocities and internal states of a state of `n` coordinates.
fn parts<T>(state: &[T], n: usize) -> [&[T]; 3] {
    let (q, rest) = state.split_at(n);
    let (v, z) = rest.split_at(n);
    [q, v, z]
}

/// [`parts`], mutable.
fn parts_mut<T>(state: &mut [T], n: usize) -> [&mut [T]; 3] {
    let (q, rest) = state.split_at_mut(n);
    let (v, z) = rest.split_at_mut(n);
    [q, v, z]
}
