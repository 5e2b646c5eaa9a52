//! Linearisation of single steps, for methods with the states as unknowns.

use super::equation::{EquationOfMotion, Stages, advance};
use crate::simulate::Trajectory;
use crate::system::{
    Excitation, InputQuantity, MIDPOINT, Method, NodalCoefficients, RK4, StagePosition, State,
    System, Tableau,
};

/// Change of the state `(y, v)` at the right node of a step.
pub type StateChange = [f64; 2];

/// One step `x_{i+1} = Phi_i(x_i, p)` and its derivatives; functions in the order of
/// [`NodalCoefficients::functions`], mass first.
#[derive(Debug, Clone, PartialEq)]
pub struct StepJacobian {
    /// `Phi_i`: displacement and velocity at the right node.
    pub end: State,
    /// Derivatives with respect to the displacement and to the velocity at the left node.
    pub state: [StateChange; 2],
    /// Derivatives with respect to each function's value at the left node.
    pub left: Vec<StateChange>,
    /// Derivatives with respect to each function's value at the right node.
    pub right: Vec<StateChange>,
}

/// Variable of one column of a step's Jacobian.
#[derive(Clone, Copy)]
enum Seed {
    Displacement,
    Velocity,
    Function(usize, StagePosition),
    Input(InputQuantity, StagePosition),
}

/// Linearises all steps about the node states `states`, which need not satisfy the equation of motion.
pub fn step_jacobians(
    system: &System,
    nodal: &NodalCoefficients,
    excitation: Option<&Excitation>,
    states: &Trajectory,
) -> Vec<StepJacobian> {
    let equation = EquationOfMotion::new(system, nodal, excitation, states.nodes());
    let steps = 0..states.nodes() - 1;
    match system.method {
        Method::Midpoint => steps
            .map(|i| step(&MIDPOINT, equation, states, i))
            .collect(),
        Method::Rk4 => steps.map(|i| step(&RK4, equation, states, i)).collect(),
    }
}

/// Derivatives of the state at the right node of every step with respect to displacement and velocity at the left node, and with
/// respect to the input `quantity` at the left and at the right node, between which it is linear.
pub fn input_derivatives(
    system: &System,
    nodal: &NodalCoefficients,
    excitation: Option<&Excitation>,
    states: &Trajectory,
    quantity: InputQuantity,
) -> Vec<[[StateChange; 2]; 2]> {
    let equation = EquationOfMotion::new(system, nodal, excitation, states.nodes());
    let steps = 0..states.nodes() - 1;
    match system.method {
        Method::Midpoint => steps
            .map(|i| state_and_input(&MIDPOINT, equation, states, i, quantity))
            .collect(),
        Method::Rk4 => steps
            .map(|i| state_and_input(&RK4, equation, states, i, quantity))
            .collect(),
    }
}

fn state_and_input<const S: usize>(
    tableau: &Tableau<S>,
    equation: EquationOfMotion,
    states: &Trajectory,
    i: usize,
    quantity: InputQuantity,
) -> [[StateChange; 2]; 2] {
    let base = equation.stages(tableau, i, states.displacement[i], states.velocity[i]);
    let by_state = [Seed::Displacement, Seed::Velocity];
    let ends = [StagePosition::Left, StagePosition::Right];
    let by_input = ends.map(|end| Seed::Input(quantity, end));
    [by_state, by_input].map(|seeds| seeds.map(|seed| column(tableau, equation, i, &base, seed)))
}

fn step<const S: usize>(
    tableau: &Tableau<S>,
    equation: EquationOfMotion,
    states: &Trajectory,
    i: usize,
) -> StepJacobian {
    let (y, v) = (states.displacement[i], states.velocity[i]);
    let base = equation.stages(tableau, i, y, v);
    let (displacement, velocity) = advance(tableau, equation.dt, &base, y, v);
    let column = |seed: Seed| column(tableau, equation, i, &base, seed);
    let functions = 0..=equation.terms.len();
    let side = |position: StagePosition| {
        let each = functions.clone();
        each.map(|f| column(Seed::Function(f, position))).collect()
    };
    StepJacobian {
        end: State {
            displacement,
            velocity,
        },
        state: [column(Seed::Displacement), column(Seed::Velocity)],
        left: side(StagePosition::Left),
        right: side(StagePosition::Right),
    }
}

fn column<const S: usize>(
    tableau: &Tableau<S>,
    equation: EquationOfMotion,
    i: usize,
    base: &Stages<S>,
    seed: Seed,
) -> StateChange {
    let (dy, dv) = match seed {
        Seed::Displacement => (1.0, 0.0),
        Seed::Velocity => (0.0, 1.0),
        Seed::Function(..) | Seed::Input(..) => (0.0, 0.0),
    };
    let mut change = Stages {
        y: [dy; S],
        v: [dv; S],
        a: [0.0; S],
    };
    for s in 0..S {
        for r in 0..s {
            let a = tableau.a[s][r];
            change.y[s] += equation.dt * change.v[r] * a;
            change.v[s] += equation.dt * change.a[r] * a;
        }
        let position = tableau.position[s];
        let (y, v) = (base.y[s], base.v[s]);
        let partials = equation.partials(i, position, y, v);
        let force = match seed {
            Seed::Function(0, node) => {
                position.share(node) * equation.absolute(i, position, base.a[s])
            }
            Seed::Function(f, node) => position.share(node) * equation.terms[f - 1].phi(y, v),
            Seed::Input(InputQuantity::Force, node) => -position.share(node),
            Seed::Input(InputQuantity::BaseAcceleration, node) => {
                position.share(node) * partials.mass
            }
            Seed::Displacement | Seed::Velocity => 0.0,
        };
        change.a[s] =
            partials.da_dy * change.y[s] + partials.da_dv * change.v[s] - force / partials.mass;
    }
    let (y, v) = advance(tableau, equation.dt, &change, dy, dv);
    [y, v]
}
