//! Structures of any size: derivatives against dual numbers, responses against closed forms and the compiled sizes.

use super::super::tableau::At;
use super::Motion;
use super::stage::{Scalar, StageValues};
use super::step::{Source, Steps};
use crate::step::{Cause, Trajectory};
use crate::structure::assembly::StructureError;
use crate::structure::{CoefficientKind, Ends, Law, Structure};
use crate::system::{Excitation, Method, StageSamples, SupportMotion};
use num_dual::Dual64;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

impl Scalar for Dual64 {
    const FURTHER: u32 = 2;

    fn value(self) -> f64 {
        self.re
    }
}

const METHODS: [Method; 3] = [Method::Midpoint, Method::Rk4, Method::ImplicitMidpoint];
/// All laws.
fn laws() -> Vec<Law> {
    let of_table = CoefficientKind::ALL.into_iter();
    let of_table = of_table.filter_map(|kind| kind.law(0.2));
    let with_states = [1, 3].map(|exponent| Law::BoucWen { exponent });
    of_table.chain(with_states).collect()
}

/// A structure with random rows, values and inputs.
struct Case {
    structure: Structure,
    functions: Vec<Vec<f64>>,
    excitation: Excitation,
    initial: Vec<f64>,
    step: f64,
}

fn series(random: &mut impl Rng, nodes: usize) -> Vec<f64> {
    (0..nodes).map(|_| random.random_range(-1.0..1.0)).collect()
}

/// Samples with jumps at nodes.
fn samples(random: &mut impl Rng, nodes: usize) -> StageSamples {
    let steps = (1..nodes).map(|_| std::array::from_fn(|_| random.random_range(-1.0..1.0)));
    StageSamples::new(steps.collect::<Vec<[f64; 3]>>())
}

impl Case {
    fn new(seed: u64, n: usize, supports: usize, nodes: usize) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let ends = |random: &mut ChaCha8Rng| {
            let mut entries = vec![(random.random_range(0..n), 1.0)];
            for _ in 0..random.random_range(0..3) {
                entries.push((
                    random.random_range(0..n + supports),
                    random.random_range(-1.0..1.0),
                ));
            }
            Ends::combination(entries)
        };
        let mut inertias: Vec<Ends> = (0..n).map(Ends::ground).collect();
        inertias.extend((0..2).map(|_| ends(&mut random)));
        let mut elements: Vec<(Law, Ends)> = (0..n)
            .flat_map(|j| {
                [
                    (Law::Damping, Ends::ground(j)),
                    (Law::Stiffness, Ends::ground(j)),
                ]
            })
            .collect();
        elements.extend(laws().into_iter().map(|law| (law, ends(&mut random))));
        let masses = inertias.iter().map(|_| 1.5);
        let coefficients = elements.iter().flat_map(|(law, _)| match law {
            Law::Stiffness => vec![3.0],
            Law::BoucWen { .. } => vec![2.0, 0.8, 0.4],
            _ => vec![0.3],
        });
        let functions = (masses.chain(coefficients))
            .map(|level| {
                series(&mut random, nodes)
                    .iter()
                    .map(|x| level * (1.0 + 0.3 * x))
                    .collect()
            })
            .collect();
        let mut each = || (0..n).map(|j| (j, samples(&mut random, nodes))).collect();
        let (forces, frames) = (each(), each());
        let motion = |random: &mut ChaCha8Rng| SupportMotion {
            displacement: samples(random, nodes),
            velocity: samples(random, nodes),
            acceleration: samples(random, nodes),
        };
        let motions = (0..supports).map(|_| motion(&mut random)).collect();
        let structure = Structure::new(n, supports, inertias, elements).expect("a structure");
        Self {
            functions,
            excitation: Excitation {
                forces,
                frames,
                supports: motions,
            },
            initial: series(&mut random, structure.components()),
            structure,
            step: 0.05,
        }
    }

    fn with<T>(&self, method: Method, call: impl FnOnce(&Motion) -> T) -> T {
        let functions: Vec<&[f64]> = self.functions.iter().map(Vec::as_slice).collect();
        call(&Motion {
            structure: &self.structure,
            method,
            step: self.step,
            functions: &functions,
            excitation: Some(&self.excitation),
        })
    }
}

/// Values of a motion with their changes: of functions at the nodes, and of forces and frames, linear between nodes.
struct Along<'a> {
    motion: &'a Motion<'a>,
    functions: &'a [Vec<f64>],
    inputs: [&'a [Vec<f64>]; 2],
}

impl Source<Dual64> for Along<'_> {
    fn read(&self, step: usize, at: At, values: &mut StageValues<Dual64>) {
        let mut real = StageValues::zeros(self.motion.structure, 0.0);
        self.motion.read(step, at, &mut real);
        let [left, right] = at.shares();
        let change = |nodes: &[f64]| left * nodes[step] + right * nodes[step + 1];
        let set = |to: &mut [Dual64], values: &[f64], changes: &[Vec<f64>]| {
            for ((to, value), nodes) in to.iter_mut().zip(values).zip(changes) {
                *to = Dual64::new(*value, change(nodes));
            }
        };
        set(&mut values.functions, &real.functions, self.functions);
        set(&mut values.forces, &real.forces, self.inputs[0]);
        set(&mut values.frames, &real.frames, self.inputs[1]);
        for (to, from) in values.supports.iter_mut().zip(&real.supports) {
            to.iter_mut()
                .zip(from)
                .for_each(|(to, x)| *to = Dual64::from(*x));
        }
    }
}

fn close(found: f64, exact: f64, size: f64, what: &str) {
    assert!(
        (found - exact).abs() <= 1e-12 * size,
        "{what}: {found} {exact} ({size})"
    );
}

fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |most, x| most.max(x.abs()))
}

/// Responses, tangents, adjoints and derivatives by inputs of a case.
fn check(case: &Case, method: Method, nodes: usize) {
    let (n, components) = (case.structure.coordinates(), case.structure.components());
    case.with(method, |motion| {
        let mut states = Trajectory::of(&case.structure, nodes);
        motion
            .respond(&case.initial, &mut states)
            .expect("a motion");
        let mut random = ChaCha8Rng::seed_from_u64(99);
        let functions: Vec<Vec<f64>> = case
            .functions
            .iter()
            .map(|_| series(&mut random, nodes))
            .collect();
        let initial = series(&mut random, components);
        let zeros = vec![vec![0.0; nodes]; n];
        let inputs: [Vec<Vec<f64>>; 2] =
            [0, 1].map(|_| (0..n).map(|_| series(&mut random, nodes)).collect());

        // By dual numbers, along functions and initial state, and along forces and frames.
        let by_dual = |inputs: [&[Vec<f64>]; 2], functions: &[Vec<f64>], initial: &[f64]| {
            let zero = Dual64::from(0.0);
            let mut steps = Steps::new(&case.structure, method, case.step, zero);
            let source = Along {
                motion,
                functions,
                inputs,
            };
            let mut x: Vec<Dual64> = case
                .initial
                .iter()
                .zip(initial)
                .map(|(x, dx)| Dual64::new(*x, *dx))
                .collect();
            let mut all = vec![x.clone()];
            for i in 0..nodes - 1 {
                steps.advance(&source, i, &mut x).expect("a step");
                all.push(x.clone());
            }
            all
        };
        let exact = by_dual([&zeros, &zeros], &functions, &initial);
        let slices: Vec<&[f64]> = functions.iter().map(Vec::as_slice).collect();
        let tangents = motion.tangents(&states, &[(&slices, &initial)]);
        let tangent = &tangents.expect("a tangent")[0];
        let size = largest(exact.iter().flatten().map(|x| x.eps));
        for (i, exact) in exact.iter().enumerate() {
            for (c, exact) in exact.iter().enumerate() {
                close(states.component(c)[i], exact.re, 10.0, "a response");
                close(tangent.component(c)[i], exact.eps, size, "a tangent");
            }
        }

        // A cost that is linear in the states.
        let mut source = Trajectory::like(&states);
        (0..components).for_each(|c| {
            source
                .component_mut(c)
                .copy_from_slice(&series(&mut random, nodes));
        });
        let mut gradient = vec![vec![0.0; nodes]; functions.len()];
        let mut columns: Vec<&mut [f64]> = gradient.iter_mut().map(Vec::as_mut_slice).collect();
        let by_initial = motion
            .adjoint(&states, &source, &mut columns)
            .expect("an adjoint");
        let products = gradient.iter().flatten().zip(functions.iter().flatten());
        let products = products.chain(by_initial.iter().zip(&initial));
        let products: Vec<f64> = products.map(|(a, b)| a * b).collect();
        let cost = (0..components).flat_map(|c| {
            let of = |i: usize| source.component(c)[i] * exact[i][c].eps;
            (0..nodes).map(of).collect::<Vec<f64>>()
        });
        let size = products.iter().map(|x| x.abs()).sum();
        close(products.iter().sum(), cost.sum(), size, "the adjoint");

        let nothing: Vec<Vec<f64>> = functions.iter().map(|f| vec![0.0; f.len()]).collect();
        let exact = by_dual([&inputs[0], &inputs[1]], &nothing, &vec![0.0; components]);
        let size = largest(exact.iter().flatten().map(|x| x.eps));
        let mut change = vec![0.0; components];
        for i in 0..nodes - 1 {
            let mut x: Vec<f64> = (0..components).map(|c| states.component(c)[i]).collect();
            let rows = motion.step_derivatives(i, &mut x).expect("a step");
            let next = rows.iter().map(|row| {
                let of_state = row.state.iter().zip(&change).map(|(a, b)| a * b);
                let by = [&row.forces, &row.frames]
                    .into_iter()
                    .zip(&inputs)
                    .flat_map(|(by, values)| {
                        by.iter()
                            .zip(values)
                            .map(|([left, right], values)| left * values[i] + right * values[i + 1])
                    });
                of_state.chain(by).sum::<f64>()
            });
            change = next.collect();
            for (found, exact) in change.iter().zip(&exact[i + 1]) {
                close(*found, exact.eps, size, "a derivative by inputs");
            }
        }
    });
}

#[test]
fn derivatives_are_those_of_dual_numbers() {
    for (seed, (n, supports)) in [(1, 0), (1, 1), (2, 0), (3, 2), (5, 1), (12, 3)]
        .into_iter()
        .enumerate()
    {
        for nodes in [2, 60] {
            let case = Case::new(seed as u64, n, supports, nodes);
            METHODS
                .iter()
                .for_each(|method| check(&case, *method, nodes));
        }
    }
}

/// A chain of equal masses and springs with a fixed first end; the other end is free.
fn chain(n: usize, laws: &[Law]) -> Structure {
    let ends = |j: usize| match j {
        0 => Ends::ground(0),
        _ => Ends::between(j, j - 1),
    };
    let elements = (0..n).flat_map(|j| laws.iter().map(move |law| (*law, ends(j))));
    Structure::new(n, 0, (0..n).map(Ends::ground).collect(), elements.collect()).expect("a chain")
}

/// Frequencies `2 sqrt(k/m) sin((2 j - 1) pi / (4 n + 2))` of a chain with a free end.
fn frequency(n: usize, j: usize) -> f64 {
    let angle = (2 * j - 1) as f64 * std::f64::consts::PI / (4 * n + 2) as f64;
    2.0 * 4.0f64.sqrt() * angle.sin()
}

#[test]
fn natural_frequencies_are_those_of_a_chain() {
    let structure = chain(12, &[Law::Damping, Law::Stiffness]);
    let values: Vec<f64> = (0..36)
        .map(|f| if f < 12 { 1.0 } else { [0.1, 4.0][f % 2] })
        .collect();
    let found = structure.eigenvalues(&values).expect("masses");
    for (j, square) in (1..).zip(&found) {
        assert!(
            (square.sqrt() - frequency(12, j)).abs() < 1e-12,
            "{j}: {square}"
        );
    }
    assert_eq!(structure.largest_rate(&values), Some(found[11].sqrt()));
}

/// Superposition of two modes of a chain of five masses: orders of all methods, and the exact response of the implicit rule, whose modes
/// keep their energy at the frequency `2 atan(omega h / 2) / h`.
#[test]
fn responses_converge_to_modes_with_the_order_of_the_method() {
    let (n, duration) = (5, 8.0);
    let structure = chain(n, &[Law::Stiffness]);
    let shape = |j: usize| -> Vec<f64> {
        let angle = (2 * j - 1) as f64 * std::f64::consts::PI / (2 * n + 1) as f64;
        (1..=n).map(|i| (i as f64 * angle).sin()).collect()
    };
    let modes = [(1, 0.8), (4, -0.3)];
    let error = |method: Method, nodes: usize, implicit: bool| -> f64 {
        let h = duration / (nodes - 1) as f64;
        let values: Vec<Vec<f64>> = (0..2 * n)
            .map(|f| vec![if f < n { 1.0 } else { 4.0 }; nodes])
            .collect();
        let functions: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
        let motion = Motion {
            structure: &structure,
            method,
            step: h,
            functions: &functions,
            excitation: None,
        };
        let mut initial = vec![0.0; 2 * n];
        for (j, size) in modes {
            initial
                .iter_mut()
                .zip(shape(j))
                .for_each(|(x, s)| *x += size * s);
        }
        let mut states = Trajectory::zeros(n, nodes);
        motion.respond(&initial, &mut states).expect("a motion");
        let exact = |t: f64, i: usize| -> f64 {
            let of = |(j, size): (usize, f64)| {
                let omega = frequency(n, j);
                let omega = match implicit {
                    true => 2.0 * (0.5 * omega * h).atan() / h,
                    false => omega,
                };
                size * shape(j)[i] * (omega * t).cos()
            };
            modes.into_iter().map(of).sum()
        };
        largest(
            (0..nodes)
                .flat_map(|i| (0..n).map(move |c| (i, c)))
                .map(|(i, c)| states.displacement(c)[i] - exact(i as f64 * h, c)),
        )
    };
    for method in METHODS {
        let [coarse, fine] = [401, 801].map(|nodes| error(method, nodes, false));
        let order = (coarse / fine).log2();
        assert!(
            (order - f64::from(method.order())).abs() < 0.1,
            "{method:?}: {order}"
        );
    }
    // Also with steps that no explicit method allows.
    for nodes in [9, 101] {
        let error = error(Method::ImplicitMidpoint, nodes, true);
        assert!(error < 1e-11, "{nodes}: {error}");
    }
}

/// Just below the largest stable step an undamped chain keeps its size for thousands of steps, above it does not.
#[test]
fn the_largest_stable_step_is_the_limit() {
    let structure = chain(6, &[Law::Stiffness]);
    let nodes = 4001;
    let values: Vec<Vec<f64>> = (0..12)
        .map(|f| vec![if f < 6 { 1.0 } else { 4.0 }; nodes])
        .collect();
    let functions: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
    let mut motion = Motion {
        structure: &structure,
        method: Method::Rk4,
        step: f64::NAN,
        functions: &functions,
        excitation: None,
    };
    let rate = structure.largest_rate_of(functions.iter().copied());
    let limit = Method::Rk4.stability_limit() / rate.expect("masses");
    // 2.5 over the highest frequency.
    assert!((limit * frequency(6, 6) - 2.5).abs() < 1e-12);
    let size = |motion: &Motion| {
        let mut states = Trajectory::zeros(6, nodes);
        let initial = [
            1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
        ];
        match motion.respond(&initial, &mut states) {
            Ok(()) => largest(states.displacement(5).iter().copied()),
            Err(_) => f64::INFINITY,
        }
    };
    motion.step = limit;
    assert!(size(&motion) < 10.0);
    motion.step = 1.15 * limit;
    assert!(size(&motion) > 1e6);
    motion.method = Method::ImplicitMidpoint;
    assert!(size(&motion) < 10.0);
}

/// A support that moves and a frame that moves with it give the same motion but for the error of the method.
#[test]
fn a_moving_support_is_a_moving_frame() {
    let base = |t: f64| {
        [
            (2.0 * t).sin(),
            2.0 * (2.0 * t).cos(),
            -4.0 * (2.0 * t).sin(),
        ]
    };
    let laws = [
        (Law::Damping, 0.2),
        (Law::Stiffness, 3.0),
        (Law::CubicStiffness, 0.5),
    ];
    let difference = |method: Method, nodes: usize| -> f64 {
        let h = 6.0 / (nodes - 1) as f64;
        let at = |part: usize| {
            let value = |t: f64| base(t)[part];
            let step = |i: usize| [0.0, 0.5, 1.0].map(|s| value(h * (i as f64 + s)));
            StageSamples::new((0..nodes - 1).map(step).collect::<Vec<_>>())
        };
        let [displacement, velocity, acceleration] = [0, 1, 2].map(at);
        let values: Vec<Vec<f64>> = [1.5]
            .into_iter()
            .chain(laws.map(|(_, p)| p))
            .map(|p| vec![p; nodes])
            .collect();
        let functions: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
        let of_base = Excitation::one(None, Some(acceleration.clone()));
        let of_support = Excitation {
            supports: vec![SupportMotion {
                displacement,
                velocity,
                acceleration,
            }],
            ..Excitation::default()
        };
        let respond = |moves: bool, initial: [f64; 2]| {
            let ends = |moves: bool| {
                if moves {
                    Ends::between(0, 1)
                } else {
                    Ends::ground(0)
                }
            };
            let elements = laws.map(|(law, _)| (law, ends(moves))).to_vec();
            let structure = Structure::new(1, usize::from(moves), vec![Ends::ground(0)], elements);
            let motion = Motion {
                structure: &structure.expect("a structure"),
                method,
                step: h,
                functions: &functions,
                excitation: Some(if moves { &of_support } else { &of_base }),
            };
            let mut states = Trajectory::zeros(1, nodes);
            motion.respond(&initial, &mut states).expect("a motion");
            states
        };
        let [y, v, _] = base(0.0);
        let (absolute, relative) = (respond(true, [0.4 + y, v]), respond(false, [0.4, 0.0]));
        largest((0..nodes).map(|i| {
            absolute.displacement(0)[i] - relative.displacement(0)[i] - base(h * i as f64)[0]
        }))
    };
    for method in METHODS {
        let [coarse, fine] = [201, 401].map(|nodes| difference(method, nodes));
        let order = (coarse / fine).log2();
        assert!(
            (order - f64::from(method.order())).abs() < 0.3,
            "{method:?}: {order}"
        );
    }
}

/// The consistent mass of a bar, `m/6 (2 1; 1 2)`, as three rows.
#[test]
fn a_consistent_mass_is_a_sum_of_rows() {
    let rows = [
        Ends::ground(0),
        Ends::ground(1),
        Ends::combination([(0, 1.0), (1, 1.0)]),
    ];
    let structure = Structure::new(
        2,
        0,
        rows.to_vec(),
        vec![(Law::Stiffness, Ends::between(0, 1))],
    );
    let structure = structure.expect("a structure");
    // Frequencies of a free element of mass 6 and stiffness 1: 0 and sqrt(12 k/m).
    let squares = structure
        .eigenvalues(&[1.0, 1.0, 1.0, 1.0])
        .expect("masses");
    assert!(
        squares[0].abs() < 1e-15 && (squares[1] - 2.0).abs() < 1e-14,
        "{squares:?}"
    );
}

#[test]
fn a_structure_without_meaning_is_refused() {
    let spring = |ends| vec![(Law::Stiffness, ends)];
    let masses = || vec![Ends::ground(0), Ends::ground(1)];
    let new = |n, inertias, elements| Structure::new(n, 1, inertias, elements).map(|_| ());
    assert_eq!(new(2, masses(), spring(Ends::between(0, 2))), Ok(()));
    assert_eq!(new(0, vec![], vec![]), Err(StructureError::Empty));
    assert_eq!(
        new(2, masses(), spring(Ends::ground(3))),
        Err(StructureError::UnknownEnd {
            function: 2,
            index: 3,
            coordinates: 2,
            supports: 1
        })
    );
    assert_eq!(
        new(2, masses(), spring(Ends::ground(2))),
        Err(StructureError::Unattached(2))
    );
    assert_eq!(
        new(2, vec![Ends::ground(0)], vec![]),
        Err(StructureError::Massless(1))
    );
}

#[test]
fn what_cannot_be_computed_is_named() {
    let structure = chain(2, &[Law::Stiffness, Law::CubicStiffness]);
    let attempt = |mass: f64, cubic: f64, method| {
        let values: Vec<Vec<f64>> = [mass, mass, 1.0, cubic, 1.0, cubic]
            .iter()
            .map(|p| vec![*p; 101])
            .collect();
        let functions: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
        let motion = Motion {
            structure: &structure,
            method,
            step: 0.1,
            functions: &functions,
            excitation: None,
        };
        let mut states = Trajectory::zeros(2, 101);
        let found = motion.respond(&[1.0, 2.0, 0.0, 0.0], &mut states);
        found.map_err(|error| {
            if error.cause == Cause::Overflow {
                let is_finite = |i: &usize| states.component(3)[*i].is_finite();
                assert_eq!((0..101).take_while(is_finite).count(), error.node);
            }
            error.cause
        })
    };
    for method in METHODS {
        assert_eq!(attempt(-1.0, 0.0, method), Err(Cause::Mass));
    }
    assert_eq!(attempt(1.0, -30.0, Method::Rk4), Err(Cause::Overflow));
    for cubic in [0.5, 30.0, 3000.0] {
        assert_eq!(attempt(1.0, cubic, Method::ImplicitMidpoint), Ok(()));
    }
}

/// Hysteresis that a support drives in one direction: `z = (1 - exp(-(beta + gamma) x)) / (beta + gamma)` of the elongation `x`, with the order of
/// the method, and back with `z' = r + (beta - gamma) r z` where `z` keeps its sign.
#[test]
fn hysteresis_follows_its_closed_form() {
    let (beta, gamma) = (1.7, 0.6);
    let law = Law::BoucWen { exponent: 1 };
    let elements = vec![(law, Ends::between(1, 0))];
    // A mass that hardly moves.
    let structure = Structure::new(1, 1, vec![Ends::ground(0)], elements).expect("a structure");
    let error = |method: Method, nodes: usize| {
        let h = 2.0 / (nodes - 1) as f64;
        let at = |value: &dyn Fn(f64) -> f64| {
            let step = |i: usize| [0.0, 0.5, 1.0].map(|s| value(h * (i as f64 + s)));
            StageSamples::new((0..nodes - 1).map(step).collect::<Vec<_>>())
        };
        // Forwards until t = 1, then backwards a quarter of the way.
        let away = |t: f64| {
            if t < 1.0 {
                t * t * (3.0 - 2.0 * t)
            } else {
                1.0 - 0.25 * (t - 1.0).powi(2)
            }
        };
        let speed = |t: f64| {
            if t < 1.0 {
                6.0 * t * (1.0 - t)
            } else {
                0.5 * (1.0 - t)
            }
        };
        let excitation = Excitation {
            supports: vec![SupportMotion {
                displacement: at(&away),
                velocity: at(&speed),
                acceleration: at(&|_| 0.0),
            }],
            ..Excitation::default()
        };
        let values = [1e12, 1.0, beta, gamma].map(|p| vec![p; nodes]);
        let functions: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
        let motion = Motion {
            structure: &structure,
            method,
            step: h,
            functions: &functions,
            excitation: Some(&excitation),
        };
        let mut states = Trajectory::of(&structure, nodes);
        motion.respond(&[0.0; 3], &mut states).expect("a motion");
        let sum = beta + gamma;
        let forwards = |x: f64| (1.0 - (-sum * x).exp()) / sum;
        let exact = |t: f64| match t <= 1.0 {
            true => forwards(away(t)),
            false => {
                // z' = r (1 + (beta - gamma) z) from the turn on.
                let rate = beta - gamma;
                let turn = 1.0 + rate * forwards(1.0);
                (turn * (rate * (away(t) - 1.0)).exp() - 1.0) / rate
            }
        };
        let z = states.component(2);
        assert!(z[nodes - 1] > 0.0, "the sign stays");
        largest((0..nodes).map(|i| z[i] - exact(h * i as f64)))
    };
    for method in METHODS {
        let [coarse, fine] = [101, 201].map(|nodes| error(method, nodes));
        let order = (coarse / fine).log2();
        let expected = f64::from(method.order());
        assert!((order - expected).abs() < 0.2, "{method:?}: {order} {fine}");
    }
}
