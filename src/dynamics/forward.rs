//! The forward solve.

use super::stages::{Rhs, advance};
use super::tableau::{MIDPOINT, RK4, Tableau};
use super::{Device, Grid, Method, State, Term};
use std::fmt;

/// What moves: the grid, the stepper and the force terms. The coefficient values are a [`Device`].
#[derive(Debug, Clone, PartialEq)]
pub struct Oscillator {
    /// Time nodes.
    pub grid: Grid,
    /// Stepper.
    pub method: Method,
    /// Force terms, in the order of [`Device::coefficients`].
    pub terms: Vec<Term>,
}

/// Displacement and velocity at all nodes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    /// Displacement in m.
    pub displacement: Vec<f64>,
    /// Velocity in m/s.
    pub velocity: Vec<f64>,
}

/// Why a motion could not be computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    /// The mass is zero, negative or not a number: the equation of motion has no meaning there.
    Mass,
    /// The motion left the range of floating-point numbers.
    Overflow,
    /// The motion exists, but the square of a residual leaves the range of floating-point numbers.
    CostOverflow,
}

/// An evaluation that ended early: an outcome of a trial, not a misuse. Line searches step back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Breakdown {
    /// What happened.
    pub cause: Cause,
    /// Node at which it happened.
    pub node: usize,
    /// Time of that node, s.
    pub time: f64,
    /// The value found there: the mass in kg, the last finite displacement or the largest residual
    /// in m.
    pub value: f64,
}

impl fmt::Display for Breakdown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (time, value) = (self.time, self.value);
        match self.cause {
            Cause::Mass => write!(f, "the mass is {value} kg at t = {time:.6} s, not positive"),
            Cause::Overflow => write!(f, "the motion overflows at t = {time:.6} s"),
            Cause::CostOverflow => write!(
                f,
                "the cost overflows: the motion and a reading are {value:.3e} m apart at t = \
                 {time:.6} s"
            ),
        }
    }
}

impl std::error::Error for Breakdown {}

impl Oscillator {
    /// The motion of `device` from `initial` under `force` (N at the nodes; `None` is no force).
    ///
    /// # Errors
    /// A [`Breakdown`] if the mass is not positive at some node or the motion overflows.
    ///
    /// # Panics
    /// If the lengths of `device` or `force` do not fit the grid and the terms.
    pub fn forward(
        &self,
        device: &Device,
        initial: State,
        force: Option<&[f64]>,
    ) -> Result<Trajectory, Breakdown> {
        let mut trajectory = Trajectory::default();
        self.forward_into(device, initial, force, &mut trajectory)?;
        Ok(trajectory)
    }

    /// [`Oscillator::forward`] into storage that is used again.
    ///
    /// # Errors
    /// As [`Oscillator::forward`].
    pub fn forward_into(
        &self,
        device: &Device,
        initial: State,
        force: Option<&[f64]>,
        trajectory: &mut Trajectory,
    ) -> Result<(), Breakdown> {
        self.require_positive_mass(device)?;
        trajectory.displacement.resize(self.grid.nodes(), 0.0);
        trajectory.velocity.resize(self.grid.nodes(), 0.0);
        let rhs = self.rhs(device, force);
        match self.method {
            Method::Midpoint => sweep(&MIDPOINT, rhs, initial, trajectory),
            Method::Rk4 => sweep(&RK4, rhs, initial, trajectory),
        }
        self.require_finite(trajectory)
    }

    pub(super) fn rhs<'a>(&'a self, device: &'a Device, force: Option<&'a [f64]>) -> Rhs<'a> {
        let nodes = self.grid.nodes();
        assert_eq!(
            device.coefficients.len(),
            self.terms.len(),
            "one function per term"
        );
        assert!(
            device.functions().all(|f| f.len() == nodes),
            "functions on the nodes"
        );
        assert!(force.is_none_or(|f| f.len() == nodes), "force on the nodes");
        Rhs {
            terms: &self.terms,
            device,
            force,
            dt: self.grid.step(),
        }
    }

    fn require_positive_mass(&self, device: &Device) -> Result<(), Breakdown> {
        let broken = |m: &f64| m.is_nan() || *m <= 0.0;
        match device.mass.iter().position(broken) {
            Some(node) => Err(self.breakdown(Cause::Mass, node, device.mass[node])),
            None => Ok(()),
        }
    }

    fn require_finite(&self, trajectory: &Trajectory) -> Result<(), Breakdown> {
        let finite =
            |i: usize| trajectory.displacement[i].is_finite() && trajectory.velocity[i].is_finite();
        // A motion that has left the finite numbers never returns, so the last node tells.
        if finite(self.grid.nodes() - 1) {
            return Ok(());
        }
        let node = (0..self.grid.nodes()).find(|&i| !finite(i)).unwrap_or(0);
        let last = trajectory.displacement[node.saturating_sub(1)];
        Err(self.breakdown(Cause::Overflow, node, last))
    }

    fn breakdown(&self, cause: Cause, node: usize, value: f64) -> Breakdown {
        Breakdown {
            cause,
            node,
            time: self.grid.time(node),
            value,
        }
    }
}

fn sweep<const S: usize>(
    tableau: &Tableau<S>,
    rhs: Rhs,
    initial: State,
    trajectory: &mut Trajectory,
) {
    let (mut y, mut v) = (initial.displacement, initial.velocity);
    let nodes = trajectory.displacement.len();
    trajectory.displacement[0] = y;
    trajectory.velocity[0] = v;
    for i in 0..nodes - 1 {
        let stages = rhs.stages(tableau, i, y, v);
        (y, v) = advance(tableau, rhs.dt, &stages, y, v);
        trajectory.displacement[i + 1] = y;
        trajectory.velocity[i + 1] = v;
    }
}
