//! The equation of motion at the stages of one step.

use crate::system::{Excitation, NodalCoefficients, StagePosition, System, Tableau, Term};

/// The equation of motion of one system in one experiment.
#[derive(Clone, Copy)]
pub(crate) struct EquationOfMotion<'a> {
    pub terms: &'a [Term],
    pub nodal: &'a NodalCoefficients,
    pub excitation: Option<&'a Excitation>,
    pub dt: f64,
}

/// Displacement, velocity and acceleration at the stages of one step.
pub(crate) struct Stages<const S: usize> {
    pub y: [f64; S],
    pub v: [f64; S],
    pub a: [f64; S],
}

/// Derivatives of the acceleration at one stage.
pub(crate) struct Partials {
    pub mass: f64,
    pub da_dy: f64,
    pub da_dv: f64,
}

impl<'a> EquationOfMotion<'a> {
    /// # Panics
    /// If there are functions without a term or of another length than the grid, or grid or excitation is shorter than `nodes` nodes.
    pub fn new(
        system: &'a System,
        nodal: &'a NodalCoefficients,
        excitation: Option<&'a Excitation>,
        nodes: usize,
    ) -> Self {
        let System { grid, terms, .. } = system;
        assert!(
            nodal.coefficients.len() <= terms.len(),
            "a term for each function"
        );
        assert!(
            nodal.functions().all(|f| f.len() == grid.nodes()),
            "functions on the nodes"
        );
        assert!(
            (1..=grid.nodes()).contains(&nodes),
            "a response within the grid"
        );
        assert!(
            excitation.is_none_or(|e| e.covers(nodes)),
            "an excitation as long as the response"
        );
        Self {
            terms,
            nodal,
            excitation,
            dt: grid.step(),
        }
    }

    /// Acceleration `y'' = f/m - sum_j p_j phi_j / m - b''`.
    ///
    /// Each quotient is computed separately, and the terms are summed backwards (stiffness before damping): the paper's order
    /// of operations, on whose every bit its run depends.
    #[inline(always)]
    pub fn acceleration(&self, i: usize, position: StagePosition, y: f64, v: f64) -> f64 {
        let mass = position.of(&self.nodal.mass, i);
        let force = self.excitation.and_then(|e| e.force.as_ref());
        let mut a = force.map_or(0.0, |f| f.at(i, position) / mass);
        for (term, p) in self.terms.iter().zip(&self.nodal.coefficients).rev() {
            a -= position.of(p, i) * term.phi(y, v) / mass;
        }
        match self.excitation.and_then(|e| e.base.as_ref()) {
            Some(base) => a - base.at(i, position),
            None => a,
        }
    }

    /// Absolute acceleration `y'' + b''` for the relative acceleration `y'' = a`.
    #[inline(always)]
    pub fn absolute(&self, i: usize, position: StagePosition, a: f64) -> f64 {
        match self.excitation.and_then(|e| e.base.as_ref()) {
            Some(base) => a + base.at(i, position),
            None => a,
        }
    }

    /// Mass and partial derivatives of [`EquationOfMotion::acceleration`].
    #[inline(always)]
    pub fn partials(&self, i: usize, position: StagePosition, y: f64, v: f64) -> Partials {
        let mass = position.of(&self.nodal.mass, i);
        let (mut da_dy, mut da_dv) = (0.0, 0.0);
        for (term, p) in self.terms.iter().zip(&self.nodal.coefficients) {
            let (phi_y, phi_v) = term.partials(y, v);
            let p = position.of(p, i);
            da_dy -= p * phi_y / mass;
            da_dv -= p * phi_v / mass;
        }
        Partials { mass, da_dy, da_dv }
    }

    /// Stages of step `i` from the state `(y, v)` at its left node.
    #[inline(always)]
    pub fn stages<const S: usize>(
        &self,
        tableau: &Tableau<S>,
        i: usize,
        y: f64,
        v: f64,
    ) -> Stages<S> {
        let mut stages = Stages {
            y: [y; S],
            v: [v; S],
            a: [0.0; S],
        };
        for s in 0..S {
            for r in 0..s {
                let a = tableau.a[s][r];
                if a != 0.0 {
                    stages.y[s] += self.dt * stages.v[r] * a;
                    stages.v[s] += self.dt * stages.a[r] * a;
                }
            }
            stages.a[s] = self.acceleration(i, tableau.position[s], stages.y[s], stages.v[s]);
        }
        stages
    }
}

/// State at the right node: `x + sum_s b_s dt x'_s`.
#[inline(always)]
pub(crate) fn advance<const S: usize>(
    tableau: &Tableau<S>,
    dt: f64,
    stages: &Stages<S>,
    y: f64,
    v: f64,
) -> (f64, f64) {
    let (mut y, mut v) = (y, v);
    for s in 0..S {
        let b = tableau.b[s];
        if b != 0.0 {
            y += dt * stages.v[s] * b;
            v += dt * stages.a[s] * b;
        }
    }
    (y, v)
}
