//! What records can show at most, from the problem alone: no motion is computed.
//!
//! **Rows.** A reading gives one equation. Where every term is linear in the motion (damping and
//! stiffness), the motion is linear in `(y(0), v(0), f, b'')`: of the readings of one kind at one time only as
//! many are independent as the records' inputs up to that time. So a third free record adds nothing, and
//! neither does a forced one before its force sets in.
//!
//! **Silent nodes.** With one value per node and one reading per step, a step of the midpoint rule
//! without a force, and without one half a step before, moves states of two dimensions: it adds at most
//! two equations.
//!
//! **Columns.** A parameter that acts after the last reading is not seen, and neither is the common
//! scale: `(m, c, k) -> s(t) (m, c, k)` leaves the motion unchanged where no force acts. For functions
//! that are closed under multiplication by `s(t)` that is one direction per node (or cell) without a
//! force and without a known function that is not zero, for others the constant factor, if there
//! is neither anywhere.
//!
//! The constant factor is exact; `s(t)` holds to the order of the stepper: with displacements alone it
//! is not seen at all; further channels, or cells whose values jump within a step, may give it singular
//! values that fall with the step, so that a rank by a relative 1e-12 finds more than is counted here.

use super::components::{Component, components, force_of};
use super::linear::{span_words, spans};
use crate::dynamics::{ChannelKind, Method, Place};
use crate::functions::{Basis, CoefficientFunction};
use crate::problem::{Experiment, Problem};
use std::collections::BTreeMap;

/// Functions with at least this many knots can follow a slow `s(t)` so nearly that it is hardly seen.
const MANY_KNOTS: usize = 5;
/// Two inputs are independent if this share of one is left beside the others.
const INDEPENDENT: f64 = 1e-9;
/// Knots are the same if they are this near, relative to the record.
const SAME_TIME: f64 = 1e-9;

/// Which factor of all functions nothing in the problem fixes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Symmetry {
    /// None.
    None,
    /// One factor for all times.
    ConstantFactor,
    /// One factor for all times exactly, and nearly any slow `s(t)`: the bases have many knots.
    NearlyFunction,
    /// Any function `s(t)`, on [`Count::free_on`].
    Function,
}

/// What can be seen at most.
#[derive(Debug, Clone, PartialEq)]
pub struct Count {
    /// Upper bound of the number of directions that the readings see.
    pub seen_at_most: usize,
    /// Number of parameters.
    pub of: usize,
    /// Independent equations of the readings.
    pub equations: usize,
    /// The gauge that is left by records, functions, penalties and equality constraints together.
    pub symmetry: Symmetry,
    /// The spans of time on which the scale is free, s.
    pub free_on: Vec<[f64; 2]>,
    /// All of it in words.
    pub sentences: Vec<String>,
}

/// Counts what the records of `problem` can show.
pub fn count(problem: &Problem) -> Count {
    let (equations, mut notes) = equations(problem);
    let visible = visible_nodes(problem);
    let mut seen = (0..problem.parameters())
        .filter(|j| parameter_is_visible(problem, *j, &visible))
        .count();
    let mut worst = Symmetry::None;
    let mut free_on = Vec::new();
    for component in components(problem) {
        let scale = Scale::of(problem, &component);
        seen -= scale.directions(&visible).min(seen);
        let (left, sentence) = scale.left(problem, &component);
        if left > worst {
            worst = left;
            free_on = scale.free_on(problem);
        }
        notes.push(sentence);
    }
    let of = problem.parameters();
    let seen_at_most = seen.min(equations);
    let mut sentences = vec![format!(
        "at most {seen_at_most} of {of} directions can be seen"
    )];
    sentences.append(&mut notes);
    Count {
        seen_at_most,
        of,
        equations,
        symmetry: worst,
        free_on,
        sentences,
    }
}

/// The scale of one component.
struct Scale {
    space: Space,
    /// Nodes at which a force acts or a function is known.
    forced: Vec<bool>,
    known: Vec<bool>,
    free_functions: usize,
}

/// The factors `s(t)` that keep all functions in their bases.
enum Space {
    Nodes,
    /// Constant on each cell: the cell of every node.
    Cells(Vec<usize>),
    Constant {
        nearly_more: bool,
    },
}

impl Scale {
    fn of(problem: &Problem, component: &Component) -> Self {
        let free: Vec<&CoefficientFunction> = (component.functions.iter())
            .map(|f| problem.functions.get(*f))
            .filter(|f| f.parameters() > 0)
            .collect();
        Self {
            space: Space::of(problem, &free),
            forced: component.forced(problem),
            known: component.known(problem),
            free_functions: free.len(),
        }
    }

    fn is_free(&self, node: usize) -> bool {
        self.free_functions > 0 && !self.forced[node] && !self.known[node]
    }

    fn all_free(&self) -> bool {
        (0..self.forced.len()).all(|i| self.is_free(i))
    }

    /// Number of directions of the scale among the parameters that act.
    fn directions(&self, visible: &[bool]) -> usize {
        let free = |i: &usize| self.is_free(*i);
        match &self.space {
            Space::Nodes => (0..visible.len())
                .filter(free)
                .filter(|i| visible[*i])
                .count(),
            Space::Cells(cells) => {
                let last = cells.last().map_or(0, |c| c + 1);
                let nodes = |c: usize| (0..cells.len()).filter(move |i| cells[*i] == c);
                let counts = |c: &usize| {
                    let mut all = nodes(*c);
                    all.all(|i| self.is_free(i)) && nodes(*c).any(|i| visible[i])
                };
                (0..last).filter(counts).count()
            }
            Space::Constant { .. } => usize::from(self.all_free() && visible.contains(&true)),
        }
    }

    fn free_on(&self, problem: &Problem) -> Vec<[f64; 2]> {
        let times = problem.oscillator.grid.times();
        match self.space {
            Space::Constant { .. } if !self.all_free() => Vec::new(),
            _ => spans(&times, |i| self.is_free(i)),
        }
    }

    /// What is left of the scale beside penalties and equalities, and a sentence about it.
    fn left(&self, problem: &Problem, component: &Component) -> (Symmetry, String) {
        let symbols = component.symbols(problem);
        let by_records = match &self.space {
            Space::Constant { .. } if !self.all_free() => Symmetry::None,
            Space::Constant { nearly_more: true } => Symmetry::NearlyFunction,
            Space::Constant { nearly_more: false } => Symmetry::ConstantFactor,
            _ if !(0..self.forced.len()).any(|i| self.is_free(i)) => Symmetry::None,
            _ => Symmetry::Function,
        };
        if by_records == Symmetry::None {
            let why = match (self.free_functions, self.known.contains(&true)) {
                (0, _) => "nothing of it is sought",
                (_, true) => "a function is known",
                _ => "a force acts",
            };
            return (
                Symmetry::None,
                format!("the scale of {symbols} is fixed: {why}"),
            );
        }
        let held = self.held(problem, component);
        let smooth = smoothness(problem, component);
        let where_free = match self.all_free() {
            true => "because no force acts".to_owned(),
            false => format!(
                "on {}, where no force acts",
                span_words(&self.free_on(problem))
            ),
        };
        let partly = !self.all_free();
        let reference = smooth.is_some_and(|order| order == 0);
        let left = match by_records {
            _ if reference => Symmetry::None,
            // A force elsewhere and smoothness tie the silent spans to the others.
            Symmetry::Function if smooth.is_some() && (held || partly) => Symmetry::None,
            Symmetry::Function | Symmetry::NearlyFunction if smooth.is_some() && !held => {
                Symmetry::ConstantFactor
            }
            Symmetry::ConstantFactor | Symmetry::NearlyFunction if held && smooth.is_some() => {
                Symmetry::None
            }
            Symmetry::ConstantFactor if held => Symmetry::None,
            other => other,
        };
        let sentence = match left {
            Symmetry::None => format!(
                "the readings leave the scale of {symbols} free {where_free}; {} it",
                match (reference, held, smooth.is_some()) {
                    (true, ..) => "a reference holds",
                    (_, true, true) => "a value or mean and smoothness hold",
                    (_, true, false) => "a value or mean holds",
                    _ => "smoothness and the force elsewhere hold",
                }
            ),
            Symmetry::ConstantFactor => format!(
                "the constant factor of {symbols} is free {where_free}: hold a value or a mean, fix a \
                 function, or add a record with a force"
            ),
            Symmetry::NearlyFunction => format!(
                "{} scale s(t) of {symbols} is hardly seen {where_free}, for the bases have many knots: \
                 fix a function, add smoothness, or add a record with a force",
                match held {
                    true => "a value or mean holds the constant factor, but a slowly varying",
                    false => "the constant factor is free, and a slowly varying",
                }
            ),
            Symmetry::Function => format!(
                "the scale s(t) of {symbols} is free {where_free}{}: fix a function, add smoothness, or \
                 add a record with a force {}",
                match held {
                    true => " (a value or mean holds only its constant factor)",
                    false => "",
                },
                match partly {
                    true => "there",
                    false => "at all times",
                }
            ),
        };
        (left, sentence)
    }

    /// Whether an equality with a right-hand side holds the constant factor.
    fn held(&self, problem: &Problem, component: &Component) -> bool {
        let mine = |j: usize| {
            let ranges = problem.functions.ranges();
            component.functions.iter().any(|f| ranges[*f].contains(&j))
        };
        let groups = problem.constraints.groups.iter();
        groups
            .flat_map(|g| (0..g.rows.len()).map(move |i| (g, i)))
            .any(|(g, i)| {
                let [lower, upper] = g.bounds(i);
                lower == upper && lower != 0.0 && g.rows.row(i).any(|(j, a)| a != 0.0 && mine(j))
            })
    }
}

/// The lowest order of a penalty on a function of the component; variation counts as order 1.
fn smoothness(problem: &Problem, component: &Component) -> Option<usize> {
    let mine = |f: &usize| component.functions.contains(f);
    let penalties = (problem.penalties.iter())
        .filter(|p| p.weight > 0.0 && mine(&p.function))
        .map(|p| p.order);
    let variations = (problem.variations.iter())
        .filter(|v| v.weight > 0.0 && mine(&v.function))
        .map(|_| 1);
    penalties.chain(variations).min()
}

impl Space {
    fn of(problem: &Problem, free: &[&CoefficientFunction]) -> Self {
        let grid = &problem.oscillator.grid;
        let offset = |f: &&&CoefficientFunction| f.offset.iter().any(|b| *b != 0.0);
        if free.iter().find(offset).is_some() {
            return Self::Constant { nearly_more: false };
        }
        let slack = SAME_TIME * grid.duration();
        let mut cells: Option<Vec<f64>> = None;
        let mut closed = true;
        for function in free {
            match &function.basis {
                Some(Basis::Nodal) => {}
                Some(Basis::PiecewiseConstant { knots }) => {
                    cells = Some(match cells {
                        None => knots.clone(),
                        Some(common) => {
                            let also = |t: &f64| knots.iter().any(|k| (k - t).abs() <= slack);
                            common.into_iter().filter(also).collect()
                        }
                    });
                }
                _ => closed = false,
            }
        }
        match cells {
            None if closed => Self::Nodes,
            Some(knots) if closed && knots.len() > 2 => {
                let cell = |t: f64| {
                    let passed = knots.partition_point(|k| *k <= t + slack);
                    passed.clamp(1, knots.len() - 1) - 1
                };
                Self::Cells(grid.times().into_iter().map(cell).collect())
            }
            _ => {
                let many = |f: &&CoefficientFunction| match &f.basis {
                    Some(Basis::Nodal) => true,
                    Some(
                        Basis::PiecewiseLinear { knots }
                        | Basis::BSpline { knots }
                        | Basis::PiecewiseConstant { knots },
                    ) => knots.len() >= MANY_KNOTS,
                    _ => false,
                };
                Self::Constant {
                    nearly_more: free.iter().all(many),
                }
            }
        }
    }
}

/// The nodes whose values act on some reading.
fn visible_nodes(problem: &Problem) -> Vec<bool> {
    let nodes = problem.functions.nodes();
    let mut last = None;
    for (kind, place) in readings(problem).map(|(_, kind, place)| (kind, place)) {
        last = last.max(last_acting(problem, kind, place));
    }
    (0..nodes).map(|i| last.is_some_and(|l| i <= l)).collect()
}

/// The last node whose values act on a reading; `None` if none does.
fn last_acting(problem: &Problem, kind: ChannelKind, place: Place) -> Option<usize> {
    match (kind, place.as_node(), problem.oscillator.method) {
        (ChannelKind::Acceleration, Some(node), _) => Some(node),
        (_, Some(0), _) => None,
        // The midpoint rule takes the displacement at the end from the velocity half-way.
        (ChannelKind::Displacement, Some(node), Method::Midpoint) => Some(node - 1),
        (_, Some(node), _) => Some(node),
        (_, None, _) => Some(place.step + 1),
    }
}

fn readings(problem: &Problem) -> impl Iterator<Item = (usize, ChannelKind, Place)> + '_ {
    let experiments = problem.experiments.iter().enumerate();
    experiments.flat_map(|(e, experiment)| {
        let channels = experiment.channels.iter();
        channels.flat_map(move |c| c.places().iter().map(move |p| (e, c.kind(), *p)))
    })
}

fn parameter_is_visible(problem: &Problem, j: usize, visible: &[bool]) -> bool {
    let functions = &problem.functions;
    let found = functions.ranges().iter().position(|r| r.contains(&j));
    let Some(f) = found else {
        return true;
    };
    let (design, first) = (&functions.get(f).design, functions.ranges()[f].start);
    match design {
        crate::functions::Design::Identity => visible[j - first],
        _ => visible.iter().enumerate().any(|(i, visible)| {
            *visible
                && design
                    .row(i)
                    .any(|(column, b)| column + first == j && b != 0.0)
        }),
    }
}

/// Readings of one kind at one place.
type Key = (usize, ChannelKind, usize, u64);

/// The number of independent equations, and what is to be said of them.
fn equations(problem: &Problem) -> (usize, Vec<String>) {
    let mut groups: BTreeMap<Key, (Place, Vec<usize>)> = BTreeMap::new();
    let mut others = 0;
    for (e, experiment) in problem.experiments.iter().enumerate() {
        for channel in &experiment.channels {
            if !superposes(problem, experiment, channel) {
                // A reading of a known initial state says nothing of the parameters.
                let known = experiment.sought == [None; 2]
                    && channel.sensor().indices() == [None; 3]
                    && channel.filter().is_empty();
                let acts = |p: &&Place| last_acting(problem, channel.kind(), **p).is_some();
                others += match known {
                    true => channel.places().iter().filter(acts).count(),
                    false => channel.len(),
                };
                continue;
            }
            for place in channel.places() {
                let (node, fraction) = match place.as_node() {
                    Some(node) => (node, 0.0),
                    None => (place.step, place.fraction),
                };
                let key = (
                    experiment.device,
                    channel.kind(),
                    node,
                    f64::to_bits(fraction),
                );
                let (_, members) = groups.entry(key).or_insert((*place, Vec::new()));
                if !members.contains(&e) {
                    members.push(e);
                }
            }
        }
    }
    let mut inputs: BTreeMap<Vec<usize>, Inputs> = BTreeMap::new();
    let mut total = others;
    let mut dependent = false;
    for ((_, kind, ..), (place, members)) in &groups {
        let Some(last) = last_acting(problem, *kind, *place) else {
            continue;
        };
        let inputs = inputs
            .entry(members.clone())
            .or_insert_with(|| Inputs::of(problem, members));
        let mut rank = inputs.rank(*kind, *place, last);
        if *kind == ChannelKind::Displacement && inputs.stepwise {
            rank = rank.min(inputs.most_of_step(last));
        }
        dependent |= rank < members.len();
        total += rank;
    }
    let mut notes = Vec::new();
    if dependent {
        notes.push(
            "some records are combinations of others where no force tells them apart: the motion is \
             linear in its initial state and force, so only two free records count"
                .to_owned(),
        );
    }
    (total, notes)
}

/// Whether a channel's readings are linear in the record's inputs, with no numbers sought besides.
fn superposes(
    problem: &Problem,
    experiment: &Experiment,
    channel: &crate::objective::Channel,
) -> bool {
    problem.oscillator.terms.iter().all(|t| t.is_linear())
        && experiment.sought == [None; 2]
        && channel.sensor().indices() == [None; 3]
        && channel.filter().is_empty()
}

/// The inputs of records: how many are independent, as time goes on.
struct Inputs {
    /// Independent inputs when left, middle and right stage of each step have been reached.
    after: Vec<[usize; 3]>,
    initially: usize,
    method: Method,
    /// One value per node for all functions, one displacement per step of the midpoint rule, no base
    /// that moves: the steps may be counted one by one.
    stepwise: bool,
    silent: Vec<bool>,
}

impl Inputs {
    fn of(problem: &Problem, members: &[usize]) -> Self {
        let records: Vec<&Experiment> = members.iter().map(|e| &problem.experiments[*e]).collect();
        let mut span = Span::default();
        span.add(records.iter().map(|r| r.initial.displacement).collect());
        span.add(records.iter().map(|r| r.initial.velocity).collect());
        let initially = span.len();
        let steps = problem.oscillator.grid.nodes() - 1;
        let base = |r: &Experiment, i: usize, s: usize| {
            let base = r.excitation.as_ref().and_then(|e| e.base.as_ref());
            base.and_then(|b| b.values().get(i)).map_or(0.0, |b| b[s])
        };
        let force = |r: &Experiment, i: usize, s: usize| {
            let force = force_of(r).and_then(|f| f.values().get(i));
            force.map_or(0.0, |f| f[s])
        };
        let mut after = Vec::with_capacity(steps);
        let mut silent = Vec::with_capacity(steps);
        for i in 0..steps {
            let stages = [0, 1, 2].map(|s| {
                span.add(records.iter().map(|r| force(r, i, s)).collect());
                span.add(records.iter().map(|r| base(r, i, s)).collect());
                span.len()
            });
            after.push(stages);
            // The displacement after the step also answers to the node through the middle of the step
            // before it.
            let before = |r: &&Experiment| i == 0 || force(r, i - 1, 1) == 0.0;
            let at_node = |r: &&Experiment| force(r, i, 0) == 0.0;
            silent.push(records.iter().all(|r| before(r) && at_node(r)));
        }
        let still = |r: &&Experiment| {
            let base = r.excitation.as_ref().and_then(|e| e.base.as_ref());
            base.is_none_or(|b| b.is_zero())
        };
        let nodal = records.iter().all(|r| {
            let assembly = problem.functions.assembly(r.device).iter();
            let mut functions = assembly.map(|f| problem.functions.get(*f));
            functions.all(|f| f.parameters() == 0 || f.basis == Some(Basis::Nodal))
        });
        let sampled = records.iter().all(|r| {
            let plain = |c: &&crate::objective::Channel| c.kind() == ChannelKind::Displacement;
            r.channels.len() == 1
                && r.channels
                    .iter()
                    .filter(plain)
                    .any(|c| c.stride() == Some(1))
        });
        let method = problem.oscillator.method;
        Self {
            stepwise: method == Method::Midpoint && nodal && sampled && records.iter().all(still),
            after,
            initially,
            method,
            silent,
        }
    }

    /// Independent inputs that act on a reading.
    fn rank(&self, kind: ChannelKind, place: Place, last: usize) -> usize {
        let stage = |step: Option<usize>, s: usize| match step {
            Some(step) => self.after[step.min(self.after.len() - 1)][s],
            None => self.initially,
        };
        match (kind, place.as_node(), self.method) {
            (ChannelKind::Displacement, Some(node), Method::Midpoint) => {
                stage(node.checked_sub(1), 0)
            }
            (ChannelKind::Displacement, Some(node), Method::Rk4) => stage(node.checked_sub(1), 1),
            (ChannelKind::Velocity, Some(node), Method::Midpoint) => stage(node.checked_sub(1), 1),
            (ChannelKind::Velocity, Some(node), Method::Rk4) => stage(node.checked_sub(1), 2),
            _ => stage(Some(last), 2),
        }
    }

    /// The most equations of the step from node `last`.
    fn most_of_step(&self, last: usize) -> usize {
        match self.silent[last.min(self.silent.len() - 1)] {
            true => 2,
            false => usize::MAX,
        }
    }
}

/// The span of vectors that are added one after the other.
#[derive(Default)]
struct Span(Vec<Vec<f64>>);

impl Span {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn add(&mut self, mut x: Vec<f64>) {
        if self.0.len() == x.len() {
            return;
        }
        let norm = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
        let size = norm(&x);
        if size <= f64::MIN_POSITIVE {
            return;
        }
        for basis in self.0.iter().chain(&self.0) {
            let inside: f64 = basis.iter().zip(&x).map(|(a, b)| a * b).sum();
            x.iter_mut().zip(basis).for_each(|(x, b)| *x -= inside * b);
        }
        let rest = norm(&x);
        if rest > INDEPENDENT * size {
            x.iter_mut().for_each(|x| *x /= rest);
            self.0.push(x);
        }
    }
}
