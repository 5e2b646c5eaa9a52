//! Constraints of a builder: their rows, and the projection of the start.

use super::coefficient::{limit, uncrossed};
use super::coefficient_sets::FunctionEntry;
use super::{BuildError, BuildNotice, Builder, Contradiction};
use crate::constraints::{Constraint, ConstraintError, Constraints, Shape, TOLERANCE, TimeHistory};
use crate::functions::{Basis, CoefficientFunction, CoefficientKind};
use crate::number_format::and_list;
use crate::problem::Problem;
use crate::solvers::StartProjection;

/// A constraint, or a soft constraint with a penalty.
#[derive(Debug, Clone)]
pub(super) struct StatedConstraint {
    /// Key.
    pub key: String,
    pub statement: Constraint,
    /// Penalty weight of its violation in J; `None` for a constraint that must hold.
    pub soft: Option<f64>,
    /// Index of the coefficient set.
    pub coefficient_set: usize,
    /// Index of its function; `None` for the first of each kind in the set.
    pub function: Option<usize>,
}

/// Name of a group of rows, with the key of its constraint.
#[derive(Debug, Clone)]
pub(super) struct RowKey {
    name: String,
    key: String,
}

/// Constraints from the bounds of the function `function` with the nodal values `start`.
pub(super) fn of_bounds(
    entry: &FunctionEntry,
    function: usize,
    start: &[f64],
    coefficient_set: usize,
) -> Vec<StatedConstraint> {
    let (of, key) = (entry.kind, entry.key.as_str());
    let (min, max) = (entry.spec.lower_bound(start), entry.spec.upper_bound());
    let constraint = |name: &str, min, max| StatedConstraint {
        key: format!("{key}.{name}"),
        statement: Constraint::Bounds { of, min, max },
        soft: None,
        coefficient_set,
        function: Some(function),
    };
    match (min, max) {
        (None, None) => Vec::new(),
        // Both together, so that equal bounds become an equality.
        (min, max) if min == max => vec![constraint("min", min, max)],
        (min, max) => {
            let min = min.map(|min| constraint("min", Some(min), None));
            let max = max.map(|max| constraint("max", None, Some(max)));
            min.into_iter().chain(max).collect()
        }
    }
}

impl Builder {
    /// Adds the rows of a constraint to the problem.
    pub(super) fn add(
        &self,
        constraint: &StatedConstraint,
        problem: &mut Problem,
        keys: &mut Vec<RowKey>,
        notices: &mut Vec<BuildNotice>,
    ) -> Result<(), BuildError> {
        let key = &constraint.key;
        let grid = problem.system.grid;
        constraint.check()?;
        let set = problem
            .functions
            .coefficient_set(constraint.coefficient_set);
        let list = &problem.functions;
        let has_known_part = |kind: &CoefficientKind| {
            let known = set.known_parts().iter();
            let mut kinds = known.map(|(_, f)| list.get(*f).quantity);
            kinds.any(|k| k == *kind)
        };
        let joint = constraint.statement.functions();
        if joint.len() > 1 && joint.iter().any(has_known_part) {
            let problem = "a constraint on several functions cannot include one with a known part";
            return Err(BuildError::new(key, problem)
                .found("`known_part` in one of them")
                .expected("`min` and `max` of the functions, which concern the estimated part"));
        }
        if let Constraint::Bounds { of, min, max } = &constraint.statement {
            uncrossed(key, of.unit(), min.as_ref(), max.as_ref(), &grid)?;
            let lowest = min.as_ref().map(TimeHistory::least);
            if *of == CoefficientKind::MASS && lowest.is_some_and(|least| least <= 0.0) {
                notices.push(BuildNotice::MassMayVanish { key: key.clone() });
            }
        }
        let statement = &constraint.statement;
        let (functions, set) = (&problem.functions, constraint.coefficient_set);
        let rows = match constraint.function {
            Some(function) => statement.build_of(&grid, functions, set, function),
            None => statement.build_for(&grid, functions, set),
        };
        let mut rows = rows.map_err(|why| impossible(key, why))?;
        if rows.is_empty() {
            notices.push(BuildNotice::AlwaysHolds { key: key.clone() });
        }
        notices.extend(self.uninformative(constraint, problem));
        let soft = constraint.soft;
        rows.groups.iter_mut().for_each(|group| group.soft = soft);
        keys.extend(names(&rows).map(|name| RowKey {
            name: name.clone(),
            key: key.clone(),
        }));
        let added = problem.constrain(rows);
        added.map_err(|why| BuildError::new(key, why.to_string()))
    }

    /// Notice for a constraint that the scaling ambiguity of free records can satisfy. Without a force, `(m, c, k)` and
    /// `s(t) (m, c, k)` have the same response for every positive `s(t)`. Passivity and monotonicity of mass or stiffness are not
    /// invariant under this change: unless `s(t)` is determined otherwise, a suitable `s(t)` satisfies them, and they carry no
    /// information on the system.
    fn uninformative(
        &self,
        constraint: &StatedConstraint,
        problem: &Problem,
    ) -> Option<BuildNotice> {
        let what = match &constraint.statement {
            Constraint::Passive => "passivity",
            Constraint::Shape {
                of: CoefficientKind::MASS,
                shape: Shape::NonIncreasing | Shape::NonDecreasing,
            } => "a monotone mass",
            Constraint::Shape {
                of: CoefficientKind::STIFFNESS,
                shape: Shape::NonIncreasing | Shape::NonDecreasing,
            } => "a monotone stiffness",
            Constraint::Slope { of, min, max } if one_way(*min, *max) => match *of {
                CoefficientKind::MASS => "a slope of the mass in one direction",
                CoefficientKind::STIFFNESS => "a slope of the stiffness in one direction",
                _ => return None,
            },
            _ => return None,
        };
        let forced = problem.experiments.iter().any(|e| !e.is_free());
        let held = problem.functions.iter().any(holds_scale);
        let smoothed = problem.penalties.iter().any(|p| p.weight > 0.0)
            || problem.variations.iter().any(|v| v.weight > 0.0);
        let key = constraint.key.clone();
        let notice = BuildNotice::Uninformative { key, what };
        (!(forced || held || smoothed || self.bounded_on_both_sides())).then_some(notice)
    }

    /// True if bounds limit the common scale from below and from above.
    fn bounded_on_both_sides(&self) -> bool {
        let positive = |limit: &&TimeHistory| match limit {
            TimeHistory::Constant(value) => *value > 0.0,
            TimeHistory::Nodal { .. } => true,
        };
        let entries = self.entries();
        let own = entries.iter();
        let own = own.map(|entry| (limit(entry.spec.min.as_ref()), entry.spec.upper_bound()));
        let listed = self.constraints.iter().filter_map(|c| match &c.statement {
            Constraint::Bounds { min, max, .. } => Some((min.clone(), max.clone())),
            _ => None,
        });
        let all: Vec<_> = own.chain(listed).collect();
        let below = all.iter().filter_map(|(min, _)| min.as_ref());
        let above = all.iter().filter_map(|(_, max)| max.as_ref());
        below.filter(positive).count() > 0 && above.filter(positive).count() > 0
    }
}

impl StatedConstraint {
    /// Error for an invalid weight, and for a constraint that excludes a positive mass.
    fn check(&self) -> Result<(), BuildError> {
        if let Some(weight) = self.soft {
            let key = format!("{}.soft", self.key);
            if !(weight.is_finite() && weight > 0.0) {
                let problem = "the weight of a soft constraint must be positive";
                return Err(BuildError::new(key, problem)
                    .found(weight)
                    .expected("a number greater than 0"));
            }
            return match self.statement {
                Constraint::DampingRatio { .. } => Err(BuildError::new(
                    key,
                    "a bound of the damping ratio cannot be soft",
                )
                .found("`soft` beside `damping_ratio`")
                .expected("no `soft`")),
                _ => Ok(()),
            };
        }
        let held = match &self.statement {
            Constraint::Bounds {
                of: CoefficientKind::MASS,
                max: Some(max),
                ..
            } => max.least(),
            Constraint::Value {
                of: CoefficientKind::MASS,
                value,
                ..
            }
            | Constraint::Mean {
                of: CoefficientKind::MASS,
                value,
            }
            | Constraint::Integral {
                of: CoefficientKind::MASS,
                value,
            } => *value,
            _ => return Ok(()),
        };
        if held > 0.0 {
            return Ok(());
        }
        let problem = "this bound excludes a positive mass: the mass must be positive at all times";
        Err(BuildError::new(&self.key, problem)
            .found(format!("{held} kg"))
            .expected("a number greater than 0, in kg"))
    }
}

/// True for limits on the sign of a slope alone.
fn one_way(min: Option<f64>, max: Option<f64>) -> bool {
    matches!((min, max), (None, Some(0.0)) | (Some(0.0), None))
}

/// True if a function determines the common scale `s(t)`: it is fixed and nonzero, or its basis is not closed under
/// multiplication by `s(t)`.
fn holds_scale(function: &CoefficientFunction) -> bool {
    match &function.basis {
        None => function.offset.iter().any(|p| *p != 0.0),
        Some(basis) => matches!(basis, Basis::Constant | Basis::Polynomial { .. }),
    }
}

fn names(constraints: &Constraints) -> impl Iterator<Item = &String> {
    let rows = constraints.groups.iter().map(|group| &group.name);
    rows.chain(constraints.cones.iter().map(|group| &group.name))
}

fn impossible(key: &str, why: ConstraintError) -> BuildError {
    match why {
        ConstraintError::Absent(kind) => {
            BuildError::new(key, format!("the system has no {}", kind.name()))
        }
        ConstraintError::Fixed(list) => {
            let names = listed(list.iter().map(|kind| kind.name()));
            let problem = match list.len() {
                1 => format!("{names} is fixed, so it cannot be constrained"),
                _ => format!("{names} are fixed, so they cannot be constrained"),
            };
            BuildError::new(key, problem)
                .found("a constraint on fixed functions only")
                .expected("`basis` and `start` instead of `fixed`, or no such constraint")
        }
        ConstraintError::Broken { name, time } => {
            BuildError::new(key, "no fit can satisfy this constraint")
                .found(format!("fixed functions violate `{name}` at {time} s"))
                .expected("functions with more freedom, or another constraint")
        }
    }
}

/// Projects the start onto the constraints, with a notice unless the change is a rounding error.
///
/// # Errors
/// If the constraints contradict each other, or no feasible start is found.
pub(super) fn move_start(
    problem: &mut Problem,
    keys: &[RowKey],
) -> Result<Option<BuildNotice>, BuildError> {
    if problem.constraints.is_empty() {
        return Ok(None);
    }
    let start = problem.functions.start();
    let was_inside = problem.constraints.hold(&start, TOLERANCE);
    match problem.feasible_start(&start) {
        StartProjection::Kept(_) => Ok(None),
        StartProjection::Moved {
            parameters,
            constraint,
        } => {
            problem.start_from(&parameters);
            Ok((!was_inside).then_some(BuildNotice::StartMoved { constraint }))
        }
        StartProjection::Contradiction(names) => Err(contradiction(keys, &names, true)),
        StartProjection::ContradictionAmong(names) => Err(contradiction(keys, &names, false)),
        StartProjection::Unsolved(status) => {
            let problem = "no feasible start was found";
            Err(BuildError::new("constraints", problem)
                .found(status.sentence())
                .expected("constraints of moderate sizes that some functions satisfy"))
        }
    }
}

fn contradiction(keys: &[RowKey], names: &[String], minimal: bool) -> BuildError {
    let mut left: Vec<&RowKey> = keys.iter().collect();
    let key_of = |name: &String| {
        let position = left.iter().position(|row| row.name == *name);
        (
            name.clone(),
            position.map(|position| left.remove(position).key.clone()),
        )
    };
    let constraints: Vec<_> = names.iter().map(key_of).collect();
    let error = match names.len() {
        1 => BuildError::new("constraints", "this constraint contradicts itself"),
        _ => BuildError::new("constraints", "these constraints contradict each other").hint(
            match minimal {
                true => "removing any one of them resolves it",
                false => "some of them may not take part in the contradiction",
            },
        ),
    };
    let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    BuildError {
        contradiction: Some(Contradiction {
            constraints,
            minimal,
        }),
        ..error
            .found(listed(names.iter().map(String::as_str)))
            .expected("constraints that some functions satisfy together")
    }
}

/// Enumeration of names: `a`, `a and b`, `a, b and c`.
pub fn listed<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    and_list(&names.into_iter().collect::<Vec<_>>())
}
