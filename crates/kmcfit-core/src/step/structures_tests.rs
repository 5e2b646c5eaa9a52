//! Structures of several coordinates: derivatives against dual numbers, responses against closed forms.

use super::adjoint::{Adjoint, Gradient};
use super::maps::{Linearise, StepMaps, Wanted};
use super::response::{Linear, Prepared};
use super::stage::{Drive, Elements, Function, Model, Values, step};
use super::tableau::{At, MIDPOINT, RK4, Tableau};
use crate::simd::{self, Arithmetic, Kernel, LANES, Real};
use crate::structure::{CoefficientKind, Law, Link};
use num_dual::{Dual64, DualNum};
use std::array::from_fn;

/// Most elements of a test structure, and functions with the masses.
const ELEMENTS: usize = 20;
const FUNCTIONS: usize = 25;

impl Real for Dual64 {
    fn like(self, x: f64) -> Self {
        Dual64::from(x)
    }

    fn sqrt(self) -> Self {
        DualNum::sqrt(&self)
    }

    fn abs(self) -> Self {
        if self.re < 0.0 { -self } else { self }
    }
}

/// A smooth series of numbers in (-1, 1).
fn wave(seed: f64, i: usize, count: usize) -> f64 {
    (seed * 1.7 + 11.0 * i as f64 / count as f64 * (1.0 + 0.3 * seed)).sin()
}

/// A chain of `N` masses on springs and dampers, with one element of each other law and links across.
struct Structure<const N: usize> {
    elements: Vec<Link>,
    /// Masses, then coefficients, at the nodes.
    functions: Vec<Vec<f64>>,
    /// Forces and accelerations of the frames at the stages; the values jump at nodes.
    inputs: Option<[[[Vec<f64>; 3]; 2]; N]>,
    dt: f64,
    initial: [[f64; N]; 2],
}

impl<const N: usize> Structure<N> {
    fn new(nodes: usize, is_driven: bool, others: usize) -> Self {
        let element = |law, from: usize, to| Link { law, from, to };
        let mut elements = Vec::new();
        for j in 0..N {
            elements.push(element(Law::Damping, j, j.checked_sub(1)));
            elements.push(element(Law::Stiffness, j, j.checked_sub(1)));
        }
        // The cubic spring first, then each other law of the table once.
        let cubic = CoefficientKind::CUBIC_STIFFNESS;
        let others_of_table = CoefficientKind::ALL.into_iter().skip(3);
        let kinds = std::iter::once(cubic).chain(others_of_table.filter(|kind| *kind != cubic));
        let laws = kinds.filter_map(|kind| kind.law(0.1));
        for (e, law) in laws.enumerate().take(others) {
            let to = (N > 1 && e % 2 == 0).then_some((e + 1) % N);
            let from = e % N;
            elements.push(element(law, from, to.filter(|to| *to != from)));
        }
        let values = |seed: f64, level: f64, part: f64| -> Vec<f64> {
            let value = |i| level * (1.0 + part * wave(seed, i, nodes));
            (0..nodes).map(value).collect()
        };
        let masses = (0..N).map(|j| values(j as f64 + 0.1, 1.5 + 0.1 * j as f64, 0.2));
        let coefficients = elements.iter().enumerate().map(|(e, element)| {
            let level = match element.law {
                Law::Damping => 0.3,
                Law::Stiffness => 3.0,
                Law::CubicStiffness => 0.8,
                _ => 0.05,
            };
            values(e as f64 + 2.3, level, 0.3)
        });
        let input = |seed: f64| -> [Vec<f64>; 3] {
            from_fn(|at| {
                let jump = if at == 2 { 0.1 } else { 0.0 };
                (0..nodes - 1)
                    .map(|i| wave(seed, 2 * i + at, 2 * nodes) + jump)
                    .collect()
            })
        };
        let inputs = is_driven.then(|| from_fn(|j| [input(j as f64 + 7.7), input(j as f64 + 9.1)]));
        Self {
            functions: masses.chain(coefficients).collect(),
            elements,
            inputs,
            dt: 25.0 / 2000.0,
            initial: from_fn(|k| from_fn(|j| 0.8 - 0.3 * (k * N + j) as f64)),
        }
    }

    fn model<'a, const S: usize>(&'a self, tableau: &'a Tableau<S>) -> Model<'a, N, ELEMENTS, S> {
        let stages = |of: &'a [Vec<f64>; 3]| Some(of.each_ref().map(Vec::as_slice));
        Model {
            tableau,
            elements: Elements::new(&self.elements),
            masses: from_fn(|j| self.functions[j].as_slice()),
            coefficients: from_fn(|e| self.functions.get(N + e).map_or(&[][..], |p| p)),
            drives: self.inputs.as_ref().map(|inputs| {
                inputs.each_ref().map(|[force, base]| Drive {
                    force: stages(force),
                    base: stages(base),
                })
            }),
            dt: self.dt,
        }
    }

    fn is_linear(&self) -> bool {
        self.elements.iter().all(|element| element.law.is_linear())
    }
}

/// Displacements and velocities at the nodes.
type States<const N: usize> = [[Vec<f64>; N]; 2];

fn zeros<const N: usize>(nodes: usize) -> States<N> {
    from_fn(|_| from_fn(|_| vec![0.0; nodes]))
}

fn slices<const N: usize>(states: &States<N>) -> [[&[f64]; N]; 2] {
    states
        .each_ref()
        .map(|part| part.each_ref().map(Vec::as_slice))
}

fn slices_mut<const N: usize>(states: &mut States<N>) -> [[&mut [f64]; N]; 2] {
    states
        .each_mut()
        .map(|part| part.each_mut().map(Vec::as_mut_slice))
}

/// A response by a way of the kernel.
struct Whole<'a, const N: usize, const S: usize> {
    model: Model<'a, N, ELEMENTS, S>,
    initial: [[f64; N]; 2],
    nodes: usize,
    is_linear: bool,
}

impl<const N: usize, const S: usize> Kernel for Whole<'_, N, S> {
    type Output = States<N>;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> States<N> {
        let (model, x) = (self.model, self.initial);
        let mut out = zeros(self.nodes);
        let states = slices_mut(&mut out);
        match self.is_linear {
            true => Linear { model, x, states }.run(arithmetic),
            false => Prepared { model, x, states }.run(arithmetic),
        }
        out
    }
}

/// Values with their changes along a direction: of functions, and of forces and accelerations of the frames, linear between nodes.
struct Along<'a, const N: usize, const S: usize> {
    model: Model<'a, N, ELEMENTS, S>,
    functions: &'a [Vec<f64>],
    inputs: &'a [[Vec<f64>; N]; 2],
    step: usize,
}

impl<const N: usize, const S: usize> Values<Dual64, N> for Along<'_, N, S> {
    fn value(&self, function: Function, side: usize) -> Dual64 {
        let (values, f) = match function {
            Function::Mass(j) => (self.model.masses[j], j),
            Function::Coefficient(e) => (self.model.coefficients[e], N + e),
        };
        let i = self.step + side;
        Dual64::new(values[i], self.functions[f][i])
    }

    fn drives(&self, at: At) -> Option<[[Dual64; N]; 2]> {
        let drives = self.model.drives?;
        let [left, right] = [[1.0, 0.0], [0.5, 0.5], [0.0, 1.0]][at as usize];
        Some(from_fn(|part| {
            from_fn(|j| {
                let value = [drives[j].force, drives[j].base][part].expect("an input");
                let change = &self.inputs[part][j];
                let change = left * change[self.step] + right * change[self.step + 1];
                Dual64::new(value[at as usize][self.step], change)
            })
        }))
    }
}

/// Response, step by step, and its change along a direction of the initial state, the functions and the inputs.
fn respond<const N: usize, const S: usize>(
    model: Model<N, ELEMENTS, S>,
    x: [[f64; N]; 2],
    change: [[f64; N]; 2],
    functions: &[Vec<f64>],
    inputs: &[[Vec<f64>; N]; 2],
) -> [States<N>; 2] {
    let nodes = model.masses[0].len();
    let mut out = [zeros(nodes), zeros(nodes)];
    let mut x = from_fn(|k| from_fn(|j| Dual64::new(x[k][j], change[k][j])));
    for i in 0..nodes {
        if i > 0 {
            let along = Along {
                model,
                functions,
                inputs,
                step: i - 1,
            };
            let (tableau, elements) = (model.tableau, model.elements());
            x = step::<_, N, ELEMENTS, S>(tableau, elements, model.dt, &along, &x);
        }
        for k in 0..2 {
            for j in 0..N {
                (out[0][k][j][i], out[1][k][j][i]) = (x[k][j].re, x[k][j].eps);
            }
        }
    }
    out
}

/// No change of functions and inputs.
fn nothing<const N: usize>(nodes: usize) -> (Vec<Vec<f64>>, [[Vec<f64>; N]; 2]) {
    (vec![vec![0.0; nodes]; N + ELEMENTS], zeros(nodes))
}

/// Agreement of a number with an exact one, relative to the size of what is summed.
fn close(found: f64, exact: f64, size: f64, what: &str) {
    assert!(
        (found - exact).abs() <= 1e-12 * size,
        "{what}: {found} {exact} ({size})"
    );
}

/// Responses, adjoint and maps of a structure.
fn check<const N: usize, const D: usize, const S: usize>(
    tableau: &Tableau<S>,
    nodes: usize,
    is_driven: bool,
    others: usize,
) {
    let structure = Structure::<N>::new(nodes, is_driven, others);
    let model = structure.model(tableau);
    let x = structure.initial;
    let (functions, inputs) = nothing(nodes);
    let [exact, _] = respond(model, x, [[0.0; N]; 2], &functions, &inputs);
    for is_linear in [false, structure.is_linear()] {
        let each = simd::on_each(|| Whole {
            model,
            initial: x,
            nodes,
            is_linear,
        });
        assert!(
            each.iter().all(|states| *states == each[0]),
            "the same bits in all lanes"
        );
        for (found, exact) in each[0].iter().flatten().zip(exact.iter().flatten()) {
            for (found, exact) in found.iter().zip(exact) {
                assert!((found - exact).abs() < 1e-11, "{found} {exact}");
            }
        }
    }

    // A cost that is linear in the states, so that its source is known.
    let source: States<N> = from_fn(|k| {
        from_fn(|j| {
            (0..nodes)
                .map(|i| wave((k * N + j) as f64 + 0.4, 5 * i, nodes))
                .collect()
        })
    });
    let count = N + structure.elements.len();
    let mut gradient = vec![vec![0.0; nodes]; count];
    let mut sums = vec![0.0; count];
    let adjoint = |gradient| Adjoint {
        model,
        states: slices(&exact),
        source: slices(&source),
        gradient,
    };
    let at_nodes = gradient.iter_mut().map(Vec::as_mut_slice).collect();
    let by_initial = simd::run(adjoint(Gradient::AtNodes(at_nodes)));
    assert_eq!(by_initial, simd::run(adjoint(Gradient::Summed(&mut sums))));
    for (sum, values) in sums.iter().zip(&gradient) {
        let size = values.iter().map(|x| x.abs()).sum();
        close(*sum, values.iter().sum(), size, "a sum");
    }

    for seed in 0..3 {
        let series = |s: f64| {
            (0..nodes)
                .map(|i| wave(s, 7 * i, nodes))
                .collect::<Vec<f64>>()
        };
        let functions: Vec<Vec<f64>> = (0..count)
            .map(|f| series((3 * f + seed) as f64 + 0.77))
            .collect();
        let change: [[f64; N]; 2] = from_fn(|k| from_fn(|j| 0.3 - 0.2 * (k * N + j) as f64));
        for has_inputs in [false, is_driven] {
            let input = |s: f64| {
                if has_inputs {
                    series(s)
                } else {
                    vec![0.0; nodes]
                }
            };
            let inputs: [[Vec<f64>; N]; 2] =
                from_fn(|part| from_fn(|j| input((part * N + j) as f64 + 0.2)));
            let [_, tangent] = respond(model, x, change, &functions, &inputs);
            if !has_inputs {
                let products = |a: &[f64], b: &[f64]| -> [f64; 2] {
                    let pairs = || a.iter().zip(b).map(|(a, b)| a * b);
                    [pairs().sum(), pairs().map(f64::abs).sum()]
                };
                let pairs = tangent.as_flattened().iter().zip(source.as_flattened());
                let cost: f64 = pairs.map(|(x, by)| products(x, by)[0]).sum();
                let by = gradient.iter().zip(&functions).map(|(g, d)| products(g, d));
                let initial = products(by_initial.as_flattened(), change.as_flattened());
                let [found, size] = by.fold(initial, |[a, b], [c, d]| [a + c, b + d]);
                close(found, cost, size, "the adjoint");
            }
            by_maps::<N, D, S>(model, &exact, change, &functions, &inputs, &tangent);
        }
    }
}

/// The tangent by the derivatives of each step.
fn by_maps<const N: usize, const D: usize, const S: usize>(
    model: Model<N, ELEMENTS, S>,
    states: &States<N>,
    change: [[f64; N]; 2],
    functions: &[Vec<f64>],
    inputs: &[[Vec<f64>; N]; 2],
    exact: &States<N>,
) {
    let nodes = states[0][0].len();
    let wanted = Wanted {
        ends: [true; FUNCTIONS],
        sum: [true; FUNCTIONS],
        inputs: true,
    };
    let mut maps = StepMaps::<D, FUNCTIONS>::NOTHING;
    let mut x: [f64; D] = from_fn(|end| change[end / N][end % N]);
    let size = exact
        .iter()
        .flatten()
        .flatten()
        .fold(0.0f64, |most, x| most.max(x.abs()));
    for i in 0..nodes - 1 {
        let l = i % LANES;
        if l == 0 {
            let states = slices(states);
            simd::run(Linearise {
                model,
                states,
                from: i,
                wanted: &wanted,
                maps: &mut maps,
            });
        }
        let before = x;
        for end in 0..D {
            let (k, j) = (end / N, end % N);
            let step = states[k][j][i + 1] - states[k][j][i];
            close(maps.increment[end][l], step, 10.0, "an increment");
            for (b, before) in before.iter().enumerate() {
                x[end] += maps.growth[end][b][l] * before;
            }
            for (f, values) in functions.iter().enumerate() {
                let [left, right] = [maps.left[f][end][l], maps.right[f][end][l]];
                close(maps.sum[f][end][l], left + right, 1.0, "a constant");
                x[end] += left * values[i] + right * values[i + 1];
            }
            for (by, values) in [&maps.forces, &maps.bases].into_iter().zip(inputs) {
                for (by, values) in by.iter().zip(values) {
                    x[end] += by[0][end][l] * values[i] + by[1][end][l] * values[i + 1];
                }
            }
        }
        for end in 0..D {
            close(x[end], exact[end / N][end % N][i + 1], size, "a tangent");
        }
    }
}

#[test]
fn derivatives_are_those_of_dual_numbers() {
    for nodes in [3, 13, 400, 401] {
        for is_driven in [false, true] {
            for others in [0, 1, CoefficientKind::COUNT - 3] {
                check::<1, 2, 2>(&MIDPOINT, nodes, is_driven, others);
                check::<1, 2, 4>(&RK4, nodes, is_driven, others);
                check::<2, 4, 2>(&MIDPOINT, nodes, is_driven, others);
                check::<2, 4, 4>(&RK4, nodes, is_driven, others);
                check::<3, 6, 2>(&MIDPOINT, nodes, is_driven, others);
                check::<3, 6, 4>(&RK4, nodes, is_driven, others);
                check::<5, 10, 2>(&MIDPOINT, nodes, is_driven, others);
            }
        }
    }
}

/// Two equal masses between three equal springs: modes in phase at `sqrt(k/m)` and in opposition at `sqrt(3 k/m)`. The error of the
/// displacement over two periods falls by the order of the method.
#[test]
fn two_modes_converge_with_the_order_of_the_method() {
    let error = |nodes: usize, is_midpoint: bool| -> f64 {
        let spring = |from, to| Link {
            law: Law::Stiffness,
            from,
            to,
        };
        let list = [spring(0, None), spring(1, Some(0)), spring(1, None)];
        let (one, four) = (vec![1.0; nodes], vec![4.0; nodes]);
        let dt = 6.0 / (nodes - 1) as f64;
        let x = [[0.8, -0.2], [0.0, 0.0]];
        let (functions, inputs) = nothing(nodes);
        macro_rules! by {
            ($tableau:expr) => {{
                let model = Model::<2, ELEMENTS, _> {
                    tableau: $tableau,
                    elements: Elements::new(&list),
                    masses: [&one, &one],
                    coefficients: from_fn(|e| if e < 3 { &four[..] } else { &[] }),
                    drives: None,
                    dt,
                };
                respond(model, x, [[0.0; 2]; 2], &functions, &inputs)
            }};
        }
        let [out, _] = match is_midpoint {
            true => by!(&MIDPOINT),
            false => by!(&RK4),
        };
        let exact = |t: f64| 0.3 * (2.0 * t).cos() + 0.5 * (12.0f64.sqrt() * t).cos();
        (0..nodes)
            .map(|i| (out[0][0][i] - exact(i as f64 * dt)).abs())
            .fold(0.0, f64::max)
    };
    for (is_midpoint, order) in [(true, 2.0), (false, 4.0)] {
        let [coarse, fine] = [401, 801].map(|nodes| error(nodes, is_midpoint));
        let found = (coarse / fine).log2();
        assert!(
            (found - order).abs() < 0.1,
            "{found} for {order}: {coarse} {fine}"
        );
    }
}
