//! The choice among the reference functions and their specialisations.

use super::error::{SimulationError, require_finite, require_positive_mass};
use super::fast::blocks::LinearSystem;
use super::fast::{continuous_adjoint, prefactored, simd_adjoint};
use super::reference::equation::EquationOfMotion;
use super::reference::{self, AdjointEquation};
use super::{CoefficientGradient, Trajectory};
use crate::system::{Excitation, Method, NodalCoefficients, State, System, SystemTangent, Term};

/// Purpose of a simulation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// The bits of [`reference`](mod@super::reference). The paper's run is chaotic in the rounding: its history depends on every bit.
    Reproduction,
    /// Results to machine precision, as fast as possible.
    Estimation,
}

/// Implementation of response and discrete adjoint.
///
/// | engine | equals [`reference`](mod@super::reference) to | applies to |
/// |---|---|---|
/// | [`Reference`](Self::Reference) | bits | every system |
/// | [`Prefactored`](Self::Prefactored) | machine precision | every system |
/// | [`ParallelInTime`](Self::ParallelInTime) | machine precision | linear free response by the midpoint rule |
///
/// A result of a specialisation that leaves the finite numbers is computed again by the reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Engine {
    /// One step after the other, in the paper's order of operations.
    Reference,
    /// One step after the other, its stages prefactored and, in the adjoint, linearised eight steps at a time.
    Prefactored,
    /// Sixteen blocks of the record at once.
    ParallelInTime,
}

/// Nodes up to which a record is too short to be cut into blocks.
const SHORTEST_IN_BLOCKS: usize = 64;

impl Engine {
    /// The engine for a response over `nodes` nodes.
    pub fn choose(
        system: &System,
        excitation: Option<&Excitation>,
        nodes: usize,
        purpose: Purpose,
    ) -> Self {
        let has_blocks = nodes > SHORTEST_IN_BLOCKS && is_linear_midpoint(system);
        match purpose {
            Purpose::Reproduction => Self::Reference,
            // The iterations of descents along the gradient alone depend on every bit; of linear free
            // responses the bits of the reference are kept where the record is not cut.
            Purpose::Estimation if system.is_linear_and_free(excitation) => match has_blocks {
                true => Self::ParallelInTime,
                false => Self::Reference,
            },
            Purpose::Estimation => Self::Prefactored,
        }
    }

    /// [`reference::forward_into`].
    ///
    /// # Errors
    /// As [`reference::forward`].
    pub fn forward_into(
        self,
        system: &System,
        nodal: &NodalCoefficients,
        initial: State,
        excitation: Option<&Excitation>,
        trajectory: &mut Trajectory,
    ) -> Result<(), SimulationError> {
        match self {
            Self::Reference => {}
            Self::ParallelInTime => {
                if let Some(linear) = LinearSystem::of(system, nodal, trajectory.nodes()) {
                    linear.forward(initial, trajectory);
                    if trajectory.is_finite() {
                        return Ok(());
                    }
                }
            }
            Self::Prefactored => {
                require_positive_mass(&system.grid, nodal)?;
                let nodes = trajectory.nodes();
                let equation = EquationOfMotion::new(system, nodal, excitation, nodes);
                if prefactored::forward(equation, system.method, initial, trajectory)
                    && require_finite(&system.grid, trajectory).is_ok()
                {
                    return Ok(());
                }
            }
        }
        reference::forward_into(system, nodal, initial, excitation, trajectory)
    }

    /// [`reference::discrete_adjoint`].
    pub fn discrete_adjoint(
        self,
        system: &System,
        nodal: &NodalCoefficients,
        excitation: Option<&Excitation>,
        trajectory: &Trajectory,
        source: &Trajectory,
    ) -> SystemTangent {
        let nodes = trajectory.nodes();
        let gradient = match self {
            Self::Reference => None,
            // What is not finite anywhere is not finite at the beginning.
            Self::ParallelInTime => LinearSystem::of(system, nodal, nodes)
                .map(|linear| linear.gradient(trajectory, source))
                .filter(|gradient| gradient.initial.is_finite()),
            Self::Prefactored => {
                let equation = EquationOfMotion::new(system, nodal, excitation, nodes);
                let method = system.method;
                Some(simd_adjoint::gradient(equation, method, trajectory, source))
                    .filter(SystemTangent::is_finite)
            }
        };
        gradient.unwrap_or_else(|| {
            reference::discrete_adjoint(system, nodal, excitation, trajectory, source)
        })
    }

    /// Sums over the nodes of [`Engine::discrete_adjoint`], which are the gradient with respect to constant functions,
    /// and its initial state. `None` if the engine does not sum, or the sums leave the finite numbers.
    pub(crate) fn discrete_adjoint_sums(
        self,
        system: &System,
        nodal: &NodalCoefficients,
        excitation: Option<&Excitation>,
        trajectory: &Trajectory,
        source: &Trajectory,
    ) -> Option<(Vec<f64>, State)> {
        (self == Self::Prefactored).then_some(())?;
        let equation = EquationOfMotion::new(system, nodal, excitation, trajectory.nodes());
        let mut sums = vec![0.0; 1 + system.terms.len()];
        let gradient = CoefficientGradient::Summed(&mut sums);
        let initial = simd_adjoint::back(equation, system.method, trajectory, source, gradient);
        let is_finite = initial.is_finite() && sums.iter().all(|x| x.is_finite());
        is_finite.then_some((sums, initial))
    }
}

/// [`reference::continuous_adjoint`], to the bit.
pub fn continuous_adjoint(
    system: &System,
    nodal: &NodalCoefficients,
    excitation: Option<&Excitation>,
    trajectory: &Trajectory,
    observed: &[f64],
) -> SystemTangent {
    let equation = AdjointEquation::new(system, nodal, trajectory, observed);
    let adjoint = continuous_adjoint::solve(&equation);
    equation.gradients(system, excitation, trajectory, &adjoint)
}

/// Whether a system has damping and stiffness alone and is stepped by the midpoint rule: its free responses are
/// computed in blocks and in batches of steps.
pub(crate) fn is_linear_midpoint(system: &System) -> bool {
    system.method == Method::Midpoint && system.terms == [Term::Damping, Term::Stiffness]
}

/// Cost `J = sum_i w_i (y_i - observed_i)^2` of the free response, with the weights of the inner nodes and of both
/// ends, of a system with the nodal values mass, damping, stiffness; its gradient with respect to the functions
/// overwrites `gradient`, that with respect to the initial state is returned. To machine precision that of
/// [`reference::forward`] and [`reference::discrete_adjoint`]. `None` where [`Engine::ParallelInTime`] does not apply.
///
/// # Panics
/// If a function, the measurements or a part of the gradient has another length than the grid.
pub(crate) fn least_squares(
    system: &System,
    functions: [&[f64]; 3],
    initial: State,
    observed: &[f64],
    weights: [f64; 2],
    gradient: [&mut [f64]; 3],
) -> Option<(f64, State)> {
    let nodes = system.grid.nodes();
    assert_eq!(observed.len(), nodes, "a measurement per node");
    let engine = Engine::choose(system, None, nodes, Purpose::Estimation);
    (engine == Engine::ParallelInTime).then_some(())?;
    let nodal = LinearSystem::new(functions, system.grid.step(), nodes)?;
    Some(nodal.least_squares(initial, observed, weights, gradient))
}
