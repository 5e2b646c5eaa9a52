//! Infeasible subsets: minimal sets of constraints that contradict each other.

use crate::constraints::{Constraints, TOLERANCE};
use crate::qp::{ConicStatus, project};

/// Feasibility of a set of constraints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Feasibility {
    /// A feasible point was found.
    Feasible,
    /// The set is proved to be empty.
    Infeasible,
    /// The projection ended without a decision.
    Undecided,
}

/// Constraints that contradict each other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Conflict {
    /// Names of the constraints.
    pub names: Vec<String>,
    /// True if removing any one of them resolves the contradiction; otherwise some may not take part in it.
    pub minimal: bool,
}

/// Feasibility of `constraints`, from the projection of `theta` in the metric `metric`.
pub(super) fn feasibility(constraints: &Constraints, theta: &[f64], metric: &[f64]) -> Feasibility {
    if bounds_cross(constraints, theta.len()) {
        return Feasibility::Infeasible;
    }
    let projection = project(constraints, theta, metric);
    match projection.status {
        ConicStatus::Infeasible => Feasibility::Infeasible,
        ConicStatus::Solved | ConicStatus::Almost
            if constraints.hold(&projection.theta, TOLERANCE) =>
        {
            Feasibility::Feasible
        }
        _ => Feasibility::Undecided,
    }
}

/// True if rows on single parameters contradict each other. The accuracy of a projection is too low to detect bounds that
/// cross by little.
fn bounds_cross(constraints: &Constraints, parameters: usize) -> bool {
    let mut bounds = vec![[f64::NEG_INFINITY, f64::INFINITY]; parameters];
    for group in &constraints.groups {
        for i in 0..group.rows.len() {
            let Some((j, a)) = group.single(i) else {
                continue;
            };
            let [mut low, mut high] = group.bounds(i).map(|bound| bound / a);
            if a < 0.0 {
                std::mem::swap(&mut low, &mut high);
            }
            bounds[j][0] = bounds[j][0].max(low);
            bounds[j][1] = bounds[j][1].min(high);
        }
    }
    // Each of the two may be violated by the tolerance.
    let crosses = |[low, high]: &[f64; 2]| low - high > TOLERANCE * (low.abs() + high.abs());
    bounds.iter().any(crosses)
}

/// Infeasible subset of `all` by deletion: each group is removed in turn, permanently where the remaining set is proved
/// infeasible. A group stays where the set without it is undecided. `None` if `all` is not proved infeasible.
pub(super) fn conflict(
    all: &Constraints,
    judge: &dyn Fn(&Constraints) -> Feasibility,
) -> Option<Conflict> {
    if judge(all) != Feasibility::Infeasible {
        return None;
    }
    let mut left = all.clone();
    let mut minimal = true;
    let mut i = 0;
    while i < left.groups.len() + left.cones.len() {
        let without = without(&left, i);
        match judge(&without) {
            Feasibility::Infeasible => {
                left = without;
                continue;
            }
            Feasibility::Feasible => {}
            Feasibility::Undecided => minimal = false,
        }
        i += 1;
    }
    let groups = left.groups.into_iter().map(|g| g.name);
    let cones = left.cones.into_iter().map(|c| c.name);
    Some(Conflict {
        names: groups.chain(cones).collect(),
        minimal,
    })
}

/// The constraints without group `i`; cones follow the rows.
fn without(constraints: &Constraints, i: usize) -> Constraints {
    let mut rest = constraints.clone();
    match i.checked_sub(rest.groups.len()) {
        None => drop(rest.groups.remove(i)),
        Some(i) => drop(rest.cones.remove(i)),
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraints::RowGroup;

    fn named(names: &[&str]) -> Constraints {
        Constraints {
            groups: names.iter().map(|name| RowGroup::new(*name)).collect(),
            cones: Vec::new(),
        }
    }

    fn has(constraints: &Constraints, name: &str) -> bool {
        constraints.groups.iter().any(|g| g.name == name)
    }

    /// `a` and `c` contradict each other; a set without `silent` is undecided.
    fn judge(silent: &'static str) -> impl Fn(&Constraints) -> Feasibility {
        move |set| match (has(set, "a") && has(set, "c"), has(set, silent)) {
            (_, false) => Feasibility::Undecided,
            (true, true) => Feasibility::Infeasible,
            (false, true) => Feasibility::Feasible,
        }
    }

    #[test]
    fn a_decided_contradiction_is_minimal() {
        let decided = |set: &Constraints| match has(set, "a") && has(set, "c") {
            true => Feasibility::Infeasible,
            false => Feasibility::Feasible,
        };
        let found = conflict(&named(&["a", "b", "c", "d"]), &decided);
        let names = ["a", "c"].map(String::from).to_vec();
        let minimal = true;
        assert_eq!(found, Some(Conflict { names, minimal }));
    }

    /// The set without `b` is undecided: `b` stays, and the subset is not marked as minimal.
    #[test]
    fn a_subset_with_undecided_parts_is_not_minimal() {
        let found = conflict(&named(&["a", "b", "c", "d"]), &judge("b"));
        let names = ["a", "b", "c"].map(String::from).to_vec();
        let minimal = false;
        assert_eq!(found, Some(Conflict { names, minimal }));
    }

    #[test]
    fn an_undecided_set_is_no_contradiction() {
        assert_eq!(conflict(&named(&["a", "c"]), &judge("b")), None);
    }

    /// Bounds that cross by a millionth, in rows with different factors: below the accuracy of a projection.
    #[test]
    fn bounds_that_cross_by_little_are_a_contradiction() {
        let set = |low: f64| {
            let mut constraints = named(&["low", "high", "other"]);
            let infinity = f64::INFINITY;
            constraints.groups[0].push([(1, 2.0)], [2.0 * low, infinity], [0.0, 0.0]);
            constraints.groups[1].push([(1, -3.0)], [-3.0, infinity], [0.0, 0.0]);
            constraints.groups[2].push([(0, 1.0)], [0.0, infinity], [0.0, 0.0]);
            constraints
        };
        let judge = |set: &Constraints| feasibility(set, &[1.0, 1.0], &[1.0, 1.0]);
        let found = conflict(&set(1.0 + 1e-6), &judge);
        let names = ["low", "high"].map(String::from).to_vec();
        let minimal = true;
        assert_eq!(found, Some(Conflict { names, minimal }));
        assert_eq!(conflict(&set(1.0), &judge), None);
    }
}
