//! Columns of the structural rank: parameters that affect at least one sample.

use crate::problem::Problem;
use crate::record::ChannelKind;
use crate::system::{Method, TimePoint};

/// Nodes whose values affect a sample.
pub(super) fn visible_nodes(problem: &Problem) -> Vec<bool> {
    let nodes = problem.functions.nodes();
    let mut last = None;
    for (kind, position) in samples(problem).map(|(_, kind, position)| (kind, position)) {
        last = last.max(last_acting(problem, kind, position));
    }
    (0..nodes).map(|i| last.is_some_and(|l| i <= l)).collect()
}

/// Last node whose values affect a sample; `None` if none does.
pub(super) fn last_acting(
    problem: &Problem,
    kind: ChannelKind,
    position: TimePoint,
) -> Option<usize> {
    match (kind, position.as_node(), problem.system.method) {
        (ChannelKind::Acceleration, Some(node), _) => Some(node),
        (_, Some(0), _) => None,
        // The midpoint rule computes the displacement at the end from the velocity half-way.
        (ChannelKind::Displacement, Some(node), Method::Midpoint) => Some(node - 1),
        (_, Some(node), _) => Some(node),
        (_, None, _) => Some(position.step + 1),
    }
}

fn samples(problem: &Problem) -> impl Iterator<Item = (usize, ChannelKind, TimePoint)> + '_ {
    let experiments = problem.experiments.iter().enumerate();
    experiments.flat_map(|(e, experiment)| {
        let channels = experiment.channels.iter();
        channels.flat_map(move |c| c.positions().map(move |p| (e, c.kind(), p)))
    })
}

pub(super) fn parameter_is_visible(problem: &Problem, j: usize, visible: &[bool]) -> bool {
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
