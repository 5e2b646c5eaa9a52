//! Active constraints at a point, with multipliers.

use crate::constraints::{Cone, ConeGroup, RowGroup};
use crate::problem::Problem;
use crate::qp::{StageLayout, Subproblem};
use crate::solvers::iterate::Iterate;
use crate::spans::span_words;

/// Largest distance from the bound of an active row, relative to its scale; larger than the accuracy with which a quadratic
/// program satisfies an active row.
const NEAR: f64 = 1e-6;
/// A bound is active if relaxing it by one per cent of the row's scale lowers J by more than this share of J, and by
/// more than [`ROUNDING`] of the zero-response misfit.
const PUSH: f64 = 1e-6;
/// Rounding error of a change of J, as a share of the zero-response misfit: residuals carry the accumulated rounding errors
/// of thousands of steps.
const ROUNDING: f64 = 1e-12;

/// A group of constraints with active rows.
#[derive(Debug, Clone, PartialEq)]
pub struct ActiveGroup {
    /// Name of the group.
    pub name: String,
    /// Number of active rows.
    pub rows: usize,
    /// Spans of time on which rows are active, s.
    pub spans: Vec<[f64; 2]>,
    /// True for equalities alone.
    pub is_equality: bool,
    /// Spans on which relaxing the bound lowers J significantly, s.
    pub binding: Vec<[f64; 2]>,
    /// Sum of the absolute multipliers of the rows: decrease of J per unit by which all bounds are relaxed.
    pub multiplier: f64,
}

impl ActiveGroup {
    /// The active rows as a sentence.
    pub fn sentence(&self) -> String {
        let name = &self.name;
        match (self.is_equality, self.binding.as_slice()) {
            (true, []) => format!("`{name}` has no significant effect on the fit"),
            (true, binding) => format!("`{name}` limits the fit at {}", span_words(binding)),
            (false, []) => format!(
                "`{name}` is active on {}, without a significant effect on the fit",
                span_words(&self.spans)
            ),
            (false, binding) => format!(
                "`{name}` is active and limits the fit on {}",
                span_words(binding)
            ),
        }
    }
}

/// Active constraints at `point`.
///
/// The multipliers are the least-squares solution of the optimality conditions `dJ + G^T lambda = 0`, obtained from the
/// projection of the steepest-descent step.
pub fn active_constraints(problem: &Problem, point: &Iterate) -> Vec<ActiveGroup> {
    let constraints = &problem.constraints;
    let near: Vec<Vec<usize>> = (constraints.groups.iter())
        .map(|group| near_rows(group, point))
        .collect();
    let near_cones: Vec<Vec<usize>> = (constraints.cones.iter())
        .map(|group| near_cones(group, point))
        .collect();
    if near.iter().chain(&near_cones).all(Vec::is_empty) {
        return Vec::new();
    }
    let multipliers = multipliers(problem, point);
    let gain_that_counts =
        (PUSH * point.evaluation.cost).max(ROUNDING * problem.zero_response_misfit());
    let counts = |scale: f64, multiplier: f64| 0.01 * scale * multiplier > gain_that_counts;
    let groups = constraints.groups.iter().zip(near).enumerate();
    let rows = groups.map(|(g, (group, rows))| {
        let multiplier = |i: usize| multipliers.as_ref().map_or(0.0, |m| m.rows[g][i].abs());
        let is_binding = |&i: &usize| counts(group.scale(i, &point.parameters), multiplier(i));
        let binding: Vec<usize> = rows.iter().copied().filter(is_binding).collect();
        ActiveGroup {
            name: group.name.clone(),
            is_equality: rows
                .iter()
                .all(|&i| group.upper[i] == group.rows.right()[i]),
            rows: rows.len(),
            spans: joined_spans(&group.times, &rows),
            binding: joined_spans(&group.times, &binding),
            multiplier: rows.iter().map(|&i| multiplier(i)).sum(),
        }
    });
    let groups = constraints.cones.iter().zip(near_cones).enumerate();
    let cones = groups.map(|(g, (group, cones))| {
        let multiplier = |i: usize| multipliers.as_ref().map_or(0.0, |m| m.cones[g][i].abs());
        let is_binding = |&i: &usize| counts(bound(&group.cones[i], point), multiplier(i));
        let binding: Vec<usize> = cones.iter().copied().filter(is_binding).collect();
        let times: Vec<[f64; 2]> = group.times.iter().map(|t| [*t, *t]).collect();
        ActiveGroup {
            name: group.name.clone(),
            is_equality: false,
            rows: cones.len(),
            spans: joined_spans(&times, &cones),
            binding: joined_spans(&times, &binding),
            multiplier: cones.iter().map(|&i| multiplier(i)).sum(),
        }
    });
    rows.chain(cones).filter(|active| active.rows > 0).collect()
}

/// Size of the bound of a cone at the point.
fn bound(cone: &Cone, point: &Iterate) -> f64 {
    let values = cone.rows.multiply(&point.parameters);
    values
        .first()
        .map_or(0.0, |v| (v - cone.rows.right()[0]).abs())
}

fn near_cones(group: &ConeGroup, point: &Iterate) -> Vec<usize> {
    let is_near = |i: &usize| group.cones[*i].violation(&point.parameters) >= -NEAR;
    (0..group.cones.len()).filter(is_near).collect()
}

fn near_rows(group: &RowGroup, point: &Iterate) -> Vec<usize> {
    let is_near = |&i: &usize| group.relative_violation(i, &point.parameters) >= -NEAR;
    (0..group.rows.len()).filter(is_near).collect()
}

/// Joins the time spans of consecutive rows.
fn joined_spans(times: &[[f64; 2]], rows: &[usize]) -> Vec<[f64; 2]> {
    let mut joined: Vec<[f64; 2]> = Vec::new();
    let mut last = None;
    for &i in rows {
        let [from, to] = times[i];
        match joined.last_mut() {
            Some(span) if last.is_some_and(|last| last + 1 == i) && from >= span[0] => {
                span[1] = span[1].max(to);
            }
            _ => joined.push([from, to]),
        }
        last = Some(i);
    }
    joined
}

/// Multipliers of J by group and row, and by group and cone.
struct Multipliers {
    rows: Vec<Vec<f64>>,
    cones: Vec<Vec<f64>>,
}

/// Multipliers at `point`; `None` if the quadratic program fails.
fn multipliers(problem: &Problem, point: &Iterate) -> Option<Multipliers> {
    if problem.constraints.are_simple() {
        return Some(simple_multipliers(problem, point));
    }
    let metric = point.relative_metric(problem);
    let gradient = &point.gradient.euclidean;
    // Scaled to a largest entry of about 1 on the right-hand side.
    let steepest = gradient
        .iter()
        .zip(&metric)
        .map(|(g, m)| (g / m.sqrt()).abs());
    let scale = steepest.fold(f64::MIN_POSITIVE.sqrt(), f64::max);
    let mut sub = Subproblem::new(metric.len());
    sub.layout = StageLayout::of(&problem.functions);
    for (j, (m, g)) in metric.iter().zip(gradient).enumerate() {
        let root = m.sqrt();
        sub.residuals.push([(j, root)], -g / (root * scale));
    }
    let positions = sub.constrain(&problem.constraints, &point.parameters);
    let solution = sub.solve();
    solution.status.is_point().then(|| {
        let mut rows = solution.by_group(&positions);
        rows.iter_mut().flatten().for_each(|m| *m *= scale);
        let mut each = solution.cone_multipliers.iter().map(|m| m * scale);
        let groups = problem.constraints.cones.iter();
        let cones = groups.map(|g| each.by_ref().take(g.cones.len()).collect());
        Multipliers {
            rows,
            cones: cones.collect(),
        }
    })
}

/// [`multipliers`] for constraints on single parameters: the nearest bound in the descent direction of each parameter, if
/// active, takes the whole derivative.
fn simple_multipliers(problem: &Problem, point: &Iterate) -> Multipliers {
    let groups = &problem.constraints.groups;
    let gradient = &point.gradient.euclidean;
    // Distance and row of each parameter's nearest bound in the descent direction of J.
    let mut stops: Vec<Option<(f64, [usize; 2], f64)>> = vec![None; gradient.len()];
    for (g, group) in groups.iter().enumerate() {
        for i in 0..group.rows.len() {
            let Some((j, a)) = group.single(i) else {
                continue;
            };
            let [lower, upper] = group.bounds(i);
            let value = a * point.parameters[j];
            let room = match (gradient[j] < 0.0) == (a > 0.0) {
                true => upper - value,
                false => value - lower,
            };
            let is_near = room <= NEAR * group.scale(i, &point.parameters);
            let room = room / a.abs();
            if is_near && stops[j].is_none_or(|(nearest, ..)| room < nearest) {
                stops[j] = Some((room, [g, i], a));
            }
        }
    }
    let mut rows: Vec<Vec<f64>> = groups.iter().map(|g| vec![0.0; g.rows.len()]).collect();
    for (stop, slope) in stops.iter().zip(gradient) {
        if let Some((_, [g, i], a)) = *stop {
            rows[g][i] = -slope / a;
        }
    }
    Multipliers {
        rows,
        cones: Vec::new(),
    }
}
