//! Forward solve: the response by Eq. 2.

use super::equation::{EquationOfMotion, advance};
use crate::simulate::Trajectory;
use crate::simulate::error::{SimulationError, require_finite, require_positive_mass};
use crate::system::{Excitation, MIDPOINT, Method, NodalCoefficients, RK4, State, System, Tableau};

/// Response of `system` from `initial` under `excitation` (`None` for a free response) over the whole grid:
/// `m (y'' + b'') + sum_j p_j phi_j(y, y') = f`, in sequential steps with the paper's order of operations.
///
/// # Errors
/// A [`SimulationError`] if the mass is not positive at some node or the response overflows.
///
/// # Panics
/// If `system` or `excitation` does not fit the grid and the terms.
pub fn forward(
    system: &System,
    nodal: &NodalCoefficients,
    initial: State,
    excitation: Option<&Excitation>,
) -> Result<Trajectory, SimulationError> {
    let mut trajectory = Trajectory::zeros(system.grid.nodes());
    forward_into(system, nodal, initial, excitation, &mut trajectory)?;
    Ok(trajectory)
}

/// [`forward`] into existing storage, over the nodes of `trajectory`; a record may be shorter than the grid.
///
/// # Errors
/// As [`forward`].
pub fn forward_into(
    system: &System,
    nodal: &NodalCoefficients,
    initial: State,
    excitation: Option<&Excitation>,
    trajectory: &mut Trajectory,
) -> Result<(), SimulationError> {
    let grid = &system.grid;
    require_positive_mass(grid, nodal)?;
    let equation = EquationOfMotion::new(system, nodal, excitation, trajectory.nodes());
    match system.method {
        Method::Midpoint => sweep(&MIDPOINT, equation, initial, trajectory),
        Method::Rk4 => sweep(&RK4, equation, initial, trajectory),
    }
    require_finite(grid, trajectory)
}

fn sweep<const S: usize>(
    tableau: &Tableau<S>,
    equation: EquationOfMotion,
    initial: State,
    trajectory: &mut Trajectory,
) {
    let (mut y, mut v) = (initial.displacement, initial.velocity);
    let nodes = trajectory.nodes();
    trajectory.displacement[0] = y;
    trajectory.velocity[0] = v;
    for i in 0..nodes - 1 {
        let stages = equation.stages(tableau, i, y, v);
        (y, v) = advance(tableau, equation.dt, &stages, y, v);
        trajectory.displacement[i + 1] = y;
        trajectory.velocity[i + 1] = v;
    }
}
