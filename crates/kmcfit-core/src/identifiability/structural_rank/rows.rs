//! Rows of the structural rank: the number of independent equations of the samples.

use super::super::components::force_of;
use super::columns::last_acting;
use super::{RankFinding, RankFindingKind};
use crate::functions::Basis;
use crate::problem::Problem;
use crate::record::{ChannelKind, Experiment};
use crate::system::{Method, StageSamples, TimePoint};
use std::collections::BTreeMap;

/// Smallest share of an input that is orthogonal to the others, for independent inputs.
const INDEPENDENT: f64 = 1e-9;

/// Coefficient set, kind, node and fraction of a step of a sample.
type SampleKey = (usize, ChannelKind, usize, u64);

/// Number of independent equations, and findings about them.
pub(super) fn equations(problem: &Problem) -> (usize, Vec<RankFinding>) {
    let mut groups: BTreeMap<SampleKey, (TimePoint, Vec<usize>)> = BTreeMap::new();
    let mut others = 0;
    for (e, experiment) in problem.experiments.iter().enumerate() {
        for channel in &experiment.channels {
            if !superposes(problem, experiment, channel) {
                // A sample of the known initial state does not depend on the parameters.
                let known = experiment.begins_known()
                    && !channel.sensor().is_estimated()
                    && channel.filter().is_empty();
                let acts = |p: &TimePoint| last_acting(problem, channel.kind(), *p).is_some();
                others += match known {
                    true => channel.positions().filter(acts).count(),
                    false => channel.len(),
                };
                continue;
            }
            for position in channel.positions() {
                let (node, fraction) = match position.as_node() {
                    Some(node) => (node, 0.0),
                    None => (position.step, position.fraction),
                };
                let key = (
                    experiment.coefficient_set,
                    channel.kind(),
                    node,
                    f64::to_bits(fraction),
                );
                let (_, members) = groups.entry(key).or_insert((position, Vec::new()));
                if !members.contains(&e) {
                    members.push(e);
                }
            }
        }
    }
    let mut inputs: BTreeMap<Vec<usize>, Inputs> = BTreeMap::new();
    let mut total = others;
    let mut dependent = false;
    for ((_, kind, ..), (position, members)) in &groups {
        let Some(last) = last_acting(problem, *kind, *position) else {
            continue;
        };
        let inputs = inputs
            .entry(members.clone())
            .or_insert_with(|| Inputs::of(problem, members));
        let mut rank = inputs.rank(*kind, *position, last);
        if *kind == ChannelKind::Displacement && inputs.stepwise {
            rank = rank.min(inputs.most_of_step(last));
        }
        dependent |= rank < members.len();
        total += rank;
    }
    let combinations = dependent.then(|| RankFinding {
        kind: RankFindingKind::DependentRecords,
        sentence: "some records are linear combinations of others: the response is linear in initial state and force, so \
                   more than two free records, or records before their force acts, add no information on the parameters"
            .to_owned(),
    });
    (total, combinations.into_iter().collect())
}

/// True if the samples of a channel are linear in the inputs of the record and depend on no scalar parameters.
fn superposes(
    problem: &Problem,
    experiment: &Experiment,
    channel: &crate::record::Channel,
) -> bool {
    problem.system.laws().iter().all(|t| t.is_linear())
        && experiment.begins_known()
        && !channel.sensor().is_estimated()
        && channel.filter().is_empty()
}

/// Number of independent inputs of a group of records over time.
struct Inputs {
    /// Number of independent inputs up to the left, middle and right stage of each step.
    after: Vec<[usize; 3]>,
    initially: usize,
    method: Method,
    /// True if the equations of single steps can be counted: nodal functions, one displacement per step of the midpoint rule,
    /// no base excitation.
    stepwise: bool,
    silent: Vec<bool>,
}

/// Value at stage `s` of step `i`; zero beyond the samples and without them.
fn at_stage(samples: Option<&StageSamples>, i: usize, s: usize) -> f64 {
    let samples = samples.filter(|samples| i < samples.steps());
    samples.map_or(0.0, |samples| samples.step(i)[s])
}

impl Inputs {
    fn of(problem: &Problem, members: &[usize]) -> Self {
        let records: Vec<&Experiment> = members.iter().map(|e| &problem.experiments[*e]).collect();
        let mut span = Span::default();
        span.add(records.iter().map(|r| r.initial.displacement(0)).collect());
        span.add(records.iter().map(|r| r.initial.velocity(0)).collect());
        let initially = span.len();
        let steps = problem.system.grid.nodes() - 1;
        let base = |r: &Experiment, i: usize, s: usize| {
            at_stage(r.excitation.as_ref().and_then(|e| e.frame(0)), i, s)
        };
        let force = |r: &Experiment, i: usize, s: usize| at_stage(force_of(r), i, s);
        let mut after = Vec::with_capacity(steps);
        let mut silent = Vec::with_capacity(steps);
        for i in 0..steps {
            let stages = [0, 1, 2].map(|s| {
                span.add(records.iter().map(|r| force(r, i, s)).collect());
                span.add(records.iter().map(|r| base(r, i, s)).collect());
                span.len()
            });
            after.push(stages);
            // The displacement after the step also depends on the node through the middle of the previous step.
            let before = |r: &&Experiment| i == 0 || force(r, i - 1, 1) == 0.0;
            let at_node = |r: &&Experiment| force(r, i, 0) == 0.0;
            silent.push(records.iter().all(|r| before(r) && at_node(r)));
        }
        let still = |r: &&Experiment| {
            let base = r.excitation.as_ref().and_then(|e| e.frame(0));
            base.is_none_or(|b| b.is_zero())
        };
        let nodal = records.iter().all(|r| {
            let assembly = problem.functions.coefficient_set(r.coefficient_set).parts();
            let mut functions = assembly.map(|(_, f)| problem.functions.get(f));
            functions.all(|f| f.parameters() == 0 || f.basis == Some(Basis::Nodal))
        });
        let sampled = records.iter().all(|r| {
            let plain = |c: &&crate::record::Channel| c.kind() == ChannelKind::Displacement;
            r.channels.len() == 1
                && r.channels
                    .iter()
                    .filter(plain)
                    .any(|c| c.stride() == Some(1))
        });
        let method = problem.system.method;
        Self {
            stepwise: method == Method::Midpoint && nodal && sampled && records.iter().all(still),
            after,
            initially,
            method,
            silent,
        }
    }

    /// Number of independent inputs that affect a sample.
    fn rank(&self, kind: ChannelKind, position: TimePoint, last: usize) -> usize {
        let stage = |step: Option<usize>, s: usize| match step {
            Some(step) => self.after[step.min(self.after.len() - 1)][s],
            None => self.initially,
        };
        match (kind, position.as_node(), self.method) {
            (ChannelKind::Displacement, Some(node), Method::Midpoint) => {
                stage(node.checked_sub(1), 0)
            }
            (ChannelKind::Displacement, Some(node), Method::Rk4) => stage(node.checked_sub(1), 1),
            (ChannelKind::Velocity, Some(node), Method::Midpoint) => stage(node.checked_sub(1), 1),
            (
                ChannelKind::Displacement | ChannelKind::Velocity,
                Some(node),
                Method::ImplicitMidpoint,
            ) => stage(node.checked_sub(1), 1),
            (ChannelKind::Velocity, Some(node), Method::Rk4) => stage(node.checked_sub(1), 2),
            _ => stage(Some(last), 2),
        }
    }

    /// Largest number of equations of the step from node `last`.
    fn most_of_step(&self, last: usize) -> usize {
        match self.silent[last.min(self.silent.len() - 1)] {
            true => 2,
            false => usize::MAX,
        }
    }
}

/// Orthonormal basis of vectors added one after the other.
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
