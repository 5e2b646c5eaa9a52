//! Choice between the reference implementation of responses and adjoints and its specialisations.

use super::error::{SimulationError, require_finite, require_positive_mass};
use super::fast::blocks::LinearSystem;
use super::fast::{continuous_adjoint, prefactored, simd_adjoint};
use super::reference::equation::EquationOfMotion;
use super::reference::{self, AdjointEquation};
use super::{CoefficientGradient, Trajectory};
use crate::system::{Excitation, Method, NodalCoefficients, State, System, SystemTangent, Term};

/// Required agreement of a simulation with the reference implementation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EngineMode {
    /// Bit-identity with [`reference`](mod@super::reference). The history of the paper's run depends on every bit.
    Reference,
    /// Machine precision at the highest speed.
    Fastest,
}

/// Implementation of response and discrete adjoint.
///
/// | engine | agreement with [`reference`](mod@super::reference) | applies to |
/// |---|---|---|
/// | [`Reference`](Self::Reference) | bit-identical | every system |
/// | [`Prefactored`](Self::Prefactored) | machine precision | every system |
/// | [`ParallelInTime`](Self::ParallelInTime) | machine precision | linear free response by the midpoint rule |
///
/// Non-finite results of a specialisation are recomputed by the reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Engine {
    /// Sequential steps in the paper's order of operations.
    Reference,
    /// Sequential steps with prefactored stages; the adjoint linearises eight steps at a time.
    Prefactored,
    /// Sixteen blocks of the record in parallel.
    ParallelInTime,
}

/// Largest number of nodes of a record that is not divided into blocks.
const SHORTEST_IN_BLOCKS: usize = 64;

impl Engine {
    /// The engine for a response over `nodes` nodes.
    pub fn choose(
        system: &System,
        excitation: Option<&Excitation>,
        nodes: usize,
        mode: EngineMode,
    ) -> Self {
        let is_free = system.is_linear_and_free(excitation);
        match mode {
            EngineMode::Reference => Self::Reference,
            // Gradient descent depends on every bit; those of the reference are kept on short records.
            EngineMode::Fastest if is_free && nodes <= SHORTEST_IN_BLOCKS => Self::Reference,
            EngineMode::Fastest if is_free && is_linear_midpoint(system) => Self::ParallelInTime,
            EngineMode::Fastest => Self::Prefactored,
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
            // A non-finite value anywhere makes the first node non-finite.
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

    /// Sums over the nodes of [`Engine::discrete_adjoint`], the gradient with respect to constant functions, and the gradient
    /// with respect to the initial state. `None` if the engine does not compute sums, or they are not finite.
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

/// [`reference::continuous_adjoint`], bit-identical.
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

/// True for systems with damping and stiffness alone and the midpoint rule, whose free responses are computed in blocks and
/// in batches of steps.
pub(crate) fn is_linear_midpoint(system: &System) -> bool {
    system.method == Method::Midpoint && system.terms == [Term::Damping, Term::Stiffness]
}

/// Cost `J = sum_i w_i (y_i - observed_i)^2` of the free response, with the weights of inner nodes and of both ends, for the
/// nodal values mass, damping, stiffness. Overwrites `gradient` with the gradient with respect to the functions and returns
/// that with respect to the initial state. Agrees with [`reference::forward`] and [`reference::discrete_adjoint`] to machine
/// precision. `None` where [`Engine::ParallelInTime`] does not apply.
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
    let engine = Engine::choose(system, None, nodes, EngineMode::Fastest);
    (engine == Engine::ParallelInTime).then_some(())?;
    let nodal = LinearSystem::new(functions, system.grid.step(), nodes)?;
    Some(nodal.least_squares(initial, observed, weights, gradient))
}
