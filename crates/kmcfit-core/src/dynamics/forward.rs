//! The forward solve.

use super::blocks::LinearDevice;
use super::rates;
use super::stages::{Rhs, advance};
use super::tableau::{MIDPOINT, RK4, Tableau};
use super::{Device, Excitation, Grid, Method, State, Term};
use crate::lanes::sum::are_positive;
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

impl Trajectory {
    /// A motion of zeros over `nodes` nodes.
    pub fn zeros(nodes: usize) -> Self {
        Self {
            displacement: vec![0.0; nodes],
            velocity: vec![0.0; nodes],
        }
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.displacement.len()
    }

    /// Whether all of it is finite: a motion that has left the finite numbers never returns, so the
    /// last node tells.
    fn ends_finite(&self) -> bool {
        let last = self.nodes() - 1;
        self.displacement[last].is_finite() && self.velocity[last].is_finite()
    }
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
    /// The value found there: the mass in kg, the last finite displacement in m or the largest residual
    /// in its own unit.
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
                "the cost overflows: the motion and a reading are {value:.3e} apart at t = \
                 {time:.6} s"
            ),
        }
    }
}

impl std::error::Error for Breakdown {}

impl Oscillator {
    /// The motion of `device` from `initial` under `excitation` (`None` is free motion), over the
    /// whole grid.
    ///
    /// # Errors
    /// A [`Breakdown`] if the mass is not positive at some node or the motion overflows.
    ///
    /// # Panics
    /// If `device` or `excitation` does not fit the grid and the terms.
    pub fn forward(
        &self,
        device: &Device,
        initial: State,
        excitation: Option<&Excitation>,
    ) -> Result<Trajectory, Breakdown> {
        let mut trajectory = Trajectory::zeros(self.grid.nodes());
        self.forward_into(device, initial, excitation, &mut trajectory)?;
        Ok(trajectory)
    }

    /// [`Oscillator::forward`] into storage that is used again, over as many nodes as `trajectory`
    /// has: a record may end before the grid does.
    ///
    /// # Errors
    /// As [`Oscillator::forward`].
    pub fn forward_into(
        &self,
        device: &Device,
        initial: State,
        excitation: Option<&Excitation>,
        trajectory: &mut Trajectory,
    ) -> Result<(), Breakdown> {
        self.require_positive_mass(device)?;
        let rhs = self.rhs(device, excitation, trajectory.nodes());
        match self.method {
            Method::Midpoint => sweep(&MIDPOINT, rhs, initial, trajectory),
            Method::Rk4 => sweep(&RK4, rhs, initial, trajectory),
        }
        self.require_finite(trajectory)
    }

    /// [`Oscillator::forward_into`] as fast as it goes: linear free motion by the midpoint rule is
    /// computed in eight blocks of the record at once, forced or nonlinear motion with quotients that are
    /// made ahead, which both change it by rounding; everything else, and what leaves the finite numbers
    /// on the way, as [`Oscillator::forward_into`] does it.
    ///
    /// # Errors
    /// As [`Oscillator::forward`].
    pub fn forward_in_blocks_into(
        &self,
        device: &Device,
        initial: State,
        excitation: Option<&Excitation>,
        trajectory: &mut Trajectory,
    ) -> Result<(), Breakdown> {
        if let Some(linear) = LinearDevice::of(self, device, excitation, trajectory.nodes()) {
            linear.forward(initial, trajectory);
            if trajectory.ends_finite() {
                return Ok(());
            }
        }
        self.require_positive_mass(device)?;
        let rhs = self.rhs(device, excitation, trajectory.nodes());
        // Linear free motion of any other kind keeps its order: how far descents along the gradient alone
        // come in so many iterations depends on it.
        if !self.is_linear_and_free(excitation)
            && rates::forward(rhs, self.method, initial, trajectory)
            && trajectory.ends_finite()
        {
            return Ok(());
        }
        self.forward_into(device, initial, excitation, trajectory)
    }

    /// Whether the motion is linear in the state and nothing drives it.
    pub(crate) fn is_linear_and_free(&self, excitation: Option<&Excitation>) -> bool {
        let is_free = || excitation.is_none_or(Excitation::is_zero);
        self.terms.iter().all(|term| term.is_linear()) && is_free()
    }

    pub(super) fn rhs<'a>(
        &'a self,
        device: &'a Device,
        excitation: Option<&'a Excitation>,
        motion_nodes: usize,
    ) -> Rhs<'a> {
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
        assert!(
            (1..=nodes).contains(&motion_nodes),
            "a motion within the grid"
        );
        assert!(
            excitation.is_none_or(|e| e.covers(motion_nodes)),
            "an excitation as long as the motion"
        );
        Rhs {
            terms: &self.terms,
            device,
            excitation,
            dt: self.grid.step(),
        }
    }

    fn require_positive_mass(&self, device: &Device) -> Result<(), Breakdown> {
        if are_positive(&device.mass) {
            return Ok(());
        }
        let broken = |m: &f64| m.is_nan() || *m <= 0.0;
        match device.mass.iter().position(broken) {
            Some(node) => Err(self.breakdown(Cause::Mass, node, device.mass[node])),
            None => Ok(()),
        }
    }

    fn require_finite(&self, trajectory: &Trajectory) -> Result<(), Breakdown> {
        let finite =
            |i: usize| trajectory.displacement[i].is_finite() && trajectory.velocity[i].is_finite();
        if trajectory.ends_finite() {
            return Ok(());
        }
        let nodes = trajectory.nodes();
        let node = (0..nodes).find(|&i| !finite(i)).unwrap_or(0);
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
    let nodes = trajectory.nodes();
    trajectory.displacement[0] = y;
    trajectory.velocity[0] = v;
    for i in 0..nodes - 1 {
        let stages = rhs.stages(tableau, i, y, v);
        (y, v) = advance(tableau, rhs.dt, &stages, y, v);
        trajectory.displacement[i + 1] = y;
        trajectory.velocity[i + 1] = v;
    }
}
