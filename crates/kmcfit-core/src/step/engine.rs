//! Operations on a system: response, adjoint, tangents, and the linearisation of its steps. Explicit steps of one coordinate are
//! compiled; all others go through the assembled structure.

use super::adjoint::{Adjoint, Gradient};
use super::error::{SimulationError, require_finite, require_positive_masses};
use super::maps::{Linearise, StepMaps, Wanted};
use super::paper;
use super::response::{Linear, Prepared};
use super::stage::{DUFFING, Drive, Elements, LINEAR, Model};
use super::tableau::{MIDPOINT, RK4, Tableau};
use super::{CoefficientGradient, Trajectory};
use crate::simd;
use crate::structure::{Law, Link, MOST_ELEMENTS};
use crate::system::{
    Excitation, FUNCTIONS, Method, NodalCoefficients, StageSamples, State, System, SystemTangent,
};

/// Required agreement of a response with the paper's order of operations, where the system is the paper's: one coordinate with damping and
/// stiffness by the midpoint rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EngineMode {
    /// Every bit. The history of the paper's run depends on every bit.
    Reference,
    /// Machine precision at the highest speed.
    Fastest,
}

/// Derivatives of the steps of one coordinate.
pub(crate) type Maps = StepMaps<2, FUNCTIONS>;

/// Largest number of nodes of a free linear record that is computed in the paper's order: gradient descent depends on every bit.
const MOST_IN_PAPER_ORDER: usize = 64;

impl EngineMode {
    fn is_in_paper_order(self, driven: Driven, nodes: usize) -> bool {
        let is_free = || driven.excitation.is_none_or(Excitation::is_zero);
        let is_wanted = self == Self::Reference || nodes <= MOST_IN_PAPER_ORDER && is_free();
        is_wanted && is_linear_midpoint(driven.system) && driven.nodal.coefficients.len() == 2
    }
}

/// A system with the values of its functions and its excitation.
#[derive(Clone, Copy)]
pub struct Driven<'a> {
    /// Grid, method and laws.
    pub system: &'a System,
    /// Nodal values of mass and coefficients.
    pub nodal: &'a NodalCoefficients,
    /// `None` for a free response.
    pub excitation: Option<&'a Excitation>,
}

/// Calls a function of the kernel's model of a compiled [`Driven`] system with some links; the common lists of elements are known to the
/// compiler.
macro_rules! with_model {
    ($driven:expr, $links:expr, $call:ident($($argument:expr),*)) => {{
        let (driven, links): (Driven, &[Link]) = ($driven, $links);
        match driven.system.method {
            Method::Midpoint if links == LINEAR => $call(driven.model::<2, _>(&MIDPOINT, links), $($argument),*),
            Method::Midpoint => $call(driven.model::<MOST_ELEMENTS, _>(&MIDPOINT, links), $($argument),*),
            Method::Rk4 if links == LINEAR => $call(driven.model::<2, _>(&RK4, links), $($argument),*),
            Method::Rk4 if links == DUFFING => $call(driven.model::<3, _>(&RK4, links), $($argument),*),
            Method::Rk4 => $call(driven.model::<MOST_ELEMENTS, _>(&RK4, links), $($argument),*),
            Method::ImplicitMidpoint => unreachable!("implicit steps are assembled"),
        }
    }};
}

/// Response of one coordinate.
fn respond_in<const E: usize, const S: usize>(
    model: Model<1, E, S>,
    initial: &State,
    trajectory: &mut Trajectory,
) {
    let x = [[initial.displacement(0)], [initial.velocity(0)]];
    let states = trajectory.columns_mut();
    match model.elements().iter().all(|e| e.law.is_linear()) {
        true => simd::run(Linear { model, x, states }),
        false => simd::run(Prepared { model, x, states }),
    }
}

/// Adjoint of one coordinate.
fn adjoint_in<const E: usize, const S: usize>(
    model: Model<1, E, S>,
    trajectory: &Trajectory,
    source: &Trajectory,
    gradient: Gradient,
) -> State {
    let slopes = simd::run(Adjoint {
        model,
        states: trajectory.columns(),
        source: source.columns(),
        gradient,
    });
    State::from(slopes.as_flattened().to_vec())
}

/// Linearised steps of one coordinate.
fn linearise_in<const E: usize, const S: usize>(
    model: Model<1, E, S>,
    trajectory: &Trajectory,
    from: usize,
    wanted: &Wanted<FUNCTIONS>,
    maps: &mut Maps,
) {
    simd::run(Linearise {
        model,
        states: trajectory.columns(),
        from,
        wanted,
        maps,
    });
}

impl<'a> Driven<'a> {
    /// # Panics
    /// If there are more functions than terms, functions of another length than the grid, or grid or excitation is shorter than `nodes`
    /// nodes.
    fn require(self, nodes: usize) -> Self {
        let Self {
            system,
            nodal,
            excitation,
        } = self;
        let grid = &system.grid;
        let (count, inertias) = (nodal.coefficients.len(), nodal.inertias.len());
        let structure = &system.structure;
        assert_eq!(inertias, structure.inertias().len(), "values of inertias");
        assert!(
            inertias + count <= structure.functions(),
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
        self
    }

    fn model<'b, const E: usize, const S: usize>(
        self,
        tableau: &'b Tableau<S>,
        links: &'b [Link],
    ) -> Model<'b, 1, E, S>
    where
        'a: 'b,
    {
        let coefficients = &self.nodal.coefficients;
        let stages = |part: Option<&'a StageSamples>| part.map(StageSamples::stages);
        let driven = self
            .excitation
            .filter(|e| !e.forces.is_empty() || !e.frames.is_empty());
        Model {
            tableau,
            elements: Elements::new(links),
            masses: [&self.nodal.inertias[0]],
            coefficients: std::array::from_fn(|e| coefficients.get(e).map_or(&[][..], |p| p)),
            drives: driven.map(|e| {
                [Drive {
                    force: stages(e.force(0)),
                    base: stages(e.frame(0)),
                }]
            }),
            dt: self.system.grid.step(),
        }
    }

    /// The elements of a structure whose steps are compiled: explicit ones of one coordinate.
    fn links(self) -> Option<&'a [Link]> {
        let links = self.system.structure.links();
        links.filter(|_| self.system.method != Method::ImplicitMidpoint)
    }

    /// True where the steps are not compiled.
    pub(crate) fn is_assembled(self) -> bool {
        self.links().is_none()
    }

    /// Response from `initial` over the nodes of `trajectory`; a record may be shorter than the grid.
    ///
    /// # Errors
    /// A [`SimulationError`] if the mass is not positive at some node, an implicit step is not solved, or the response overflows.
    pub fn respond(
        self,
        mode: EngineMode,
        initial: &State,
        trajectory: &mut Trajectory,
    ) -> Result<(), SimulationError> {
        let grid = &self.system.grid;
        let nodes = trajectory.nodes();
        let driven = self.require(nodes);
        let Some(links) = self.links() else {
            return driven.respond_assembled(initial, trajectory);
        };
        require_positive_masses(grid, self.nodal)?;
        match mode.is_in_paper_order(driven, nodes) {
            true => paper::respond(
                driven.system,
                driven.nodal,
                driven.excitation,
                initial,
                trajectory,
            ),
            false => with_model!(driven, links, respond_in(initial, trajectory)),
        }
        require_finite(grid, trajectory)
    }

    /// Adds the derivatives of a scalar cost of the response with respect to the functions to `gradient`, and returns those with respect
    /// to the initial state. `source` has the derivatives of the cost with respect to displacement and velocity at every node.
    ///
    /// The result is the transpose of [`Driven::tangent`] to machine precision.
    pub fn adjoint(
        self,
        trajectory: &Trajectory,
        source: &Trajectory,
        gradient: CoefficientGradient,
    ) -> State {
        let driven = self.require(trajectory.nodes());
        let Some(links) = self.links() else {
            return driven.adjoint_assembled(trajectory, source, gradient);
        };
        let gradient = match gradient {
            CoefficientGradient::AtNodes(nodal) => {
                Gradient::AtNodes(nodal.functions_mut().map(Vec::as_mut_slice).collect())
            }
            CoefficientGradient::Summed(sums) => Gradient::Summed(sums),
        };
        with_model!(driven, links, adjoint_in(trajectory, source, gradient))
    }

    /// [`Driven::adjoint`] with the derivatives at the nodes.
    pub fn nodal_adjoint(self, trajectory: &Trajectory, source: &Trajectory) -> SystemTangent {
        let structure = &self.system.structure;
        let inertias = structure.inertias().len();
        let coefficients = structure.functions() - inertias;
        let mut nodal = NodalCoefficients::zeros(self.nodal.nodes(), inertias, coefficients);
        let gradient = CoefficientGradient::AtNodes(&mut nodal);
        let initial = self.adjoint(trajectory, source, gradient);
        SystemTangent { nodal, initial }
    }

    /// Linearises the steps `from` to `from + 7` of one coordinate about the states of `trajectory`, which need not satisfy the equation of
    /// motion.
    pub(crate) fn linearise(
        self,
        trajectory: &Trajectory,
        from: usize,
        wanted: &Wanted<FUNCTIONS>,
        maps: &mut Maps,
    ) {
        let Some(links) = self.links() else {
            return self.linearise_assembled(trajectory, from, maps);
        };
        with_model!(self, links, linearise_in(trajectory, from, wanted, maps));
    }

    /// Directional derivative of the response along `direction`; not a number where a step has no solution.
    pub fn tangent(self, trajectory: &Trajectory, direction: &SystemTangent) -> Trajectory {
        if self.is_assembled() {
            let one = std::slice::from_ref(direction);
            return self.tangents(trajectory, one).remove(0);
        }
        let functions: Vec<&[f64]> = direction.nodal.functions().collect();
        let mut out = Trajectory::zeros(1, trajectory.nodes());
        let mut x = [
            direction.initial.displacement(0),
            direction.initial.velocity(0),
        ];
        out.write(0, &x);
        self.each_step(trajectory, false, |i, maps, l| {
            let mut change = [0.0; 2];
            for (end, change) in change.iter_mut().enumerate() {
                for (f, values) in functions.iter().enumerate() {
                    *change +=
                        maps.left[f][end][l] * values[i] + maps.right[f][end][l] * values[i + 1];
                }
                *change += maps.growth[end][0][l] * x[0] + maps.growth[end][1][l] * x[1];
            }
            x = [x[0] + change[0], x[1] + change[1]];
            out.write(i + 1, &x);
        });
        out
    }

    /// Passes each step of a record of one coordinate to `take`, with the derivatives in one lane of the maps.
    pub(crate) fn each_step(
        self,
        trajectory: &Trajectory,
        inputs: bool,
        mut take: impl FnMut(usize, &Maps, usize),
    ) {
        let steps = trajectory.nodes() - 1;
        let driven = self.require(trajectory.nodes());
        let wanted = Wanted {
            ends: [true; FUNCTIONS],
            sum: [false; FUNCTIONS],
            inputs,
        };
        let mut maps = Maps::NOTHING;
        for from in (0..steps).step_by(simd::LANES) {
            driven.linearise(trajectory, from, &wanted, &mut maps);
            for l in 0..simd::LANES.min(steps - from) {
                take(from + l, &maps, l);
            }
        }
    }
}

impl System {
    /// Response in the paper's order of operations.
    ///
    /// # Errors
    /// A [`SimulationError`] if the mass is not positive at some node or the response overflows.
    ///
    /// # Panics
    /// If `nodal` or `excitation` does not fit the grid and the terms.
    pub fn forward(
        &self,
        nodal: &NodalCoefficients,
        initial: &State,
        excitation: Option<&Excitation>,
    ) -> Result<Trajectory, SimulationError> {
        let mut trajectory = Trajectory::of(&self.structure, self.grid.nodes());
        let driven = Driven {
            system: self,
            nodal,
            excitation,
        };
        driven.respond(EngineMode::Reference, initial, &mut trajectory)?;
        Ok(trajectory)
    }
}

/// True for systems with damping and stiffness alone and the midpoint rule, whose trial steps are computed in lanes.
pub(crate) fn is_linear_midpoint(system: &System) -> bool {
    system.method == Method::Midpoint && system.laws() == [Law::Damping, Law::Stiffness]
}

/// Cost `J = sum_i w_i (y_i - observed_i)^2` of the free response by the midpoint rule with damping and stiffness, with the weights of
/// inner nodes and of both ends, for the nodal values mass, damping, stiffness. Overwrites `gradient` with the gradient with respect to
/// the functions; `None` where it does not apply or a result is not finite.
pub(crate) fn least_squares(
    system: &System,
    functions: [&[f64]; 3],
    initial: &State,
    observed: &[f64],
    [inner, end]: [f64; 2],
    gradient: [&mut [f64]; 3],
) -> Option<f64> {
    let [mass, damping, stiffness] = functions;
    let nodes = observed.len();
    let usable =
        is_linear_midpoint(system) && nodes > MOST_IN_PAPER_ORDER && simd::sum::are_positive(mass);
    usable.then_some(())?;
    let model = Model::<1, 2, 2> {
        tableau: &MIDPOINT,
        elements: Elements::new(LINEAR),
        masses: [mass],
        coefficients: [damping, stiffness],
        drives: None,
        dt: system.grid.step(),
    };
    let (mut y, mut v) = (vec![0.0; nodes], vec![0.0; nodes]);
    simd::run(Linear {
        model,
        x: [[initial.displacement(0)], [initial.velocity(0)]],
        states: [[&mut y], [&mut v]],
    });
    let mut cost = 0.0;
    let mut source = vec![0.0; nodes];
    for (i, source) in source.iter_mut().enumerate() {
        let weight = if i == 0 || i + 1 == nodes { end } else { inner };
        let residual = y[i] - observed[i];
        cost += weight * residual * residual;
        *source = 2.0 * weight * residual;
    }
    let gradient = gradient.map(|g| {
        g.fill(0.0);
        g
    });
    let slopes = simd::run(Adjoint {
        model,
        states: [[&y], [&v]],
        source: [[&source], [&vec![0.0; nodes]]],
        gradient: Gradient::AtNodes(gradient.into()),
    });
    (cost.is_finite() && slopes.as_flattened().iter().all(|x| x.is_finite())).then_some(cost)
}
