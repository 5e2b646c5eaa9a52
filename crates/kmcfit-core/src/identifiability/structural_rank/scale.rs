//! Common scale of a group of functions: intervals on which it is free, and the constraints and penalties that determine it.

use super::super::components::{Component, given_words};
use super::{RankFinding, RankFindingKind, ScaleFreedom};
use crate::functions::{Basis, CoefficientFunction};
use crate::problem::Problem;
use crate::spans::{span_words, spans};

/// Number of knots from which a basis follows a slowly varying `s(t)` closely.
const MANY_KNOTS: usize = 5;
/// Largest distance between equal knots, relative to the record.
const SAME_TIME: f64 = 1e-9;

/// Common scale of one component.
pub(super) struct CommonScale {
    space: FactorSpace,
    /// Nodes at which a force acts, and at which a fixed function is nonzero.
    forced: Vec<bool>,
    known: Vec<bool>,
    free_functions: usize,
}

impl CommonScale {
    pub fn of(problem: &Problem, component: &Component) -> Self {
        let free: Vec<&CoefficientFunction> = (component.functions.iter())
            .map(|f| problem.functions.get(*f))
            .filter(|f| f.parameters() > 0)
            .collect();
        Self {
            space: FactorSpace::of(problem, &free),
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

    /// Number of scaling directions among the parameters that affect a sample.
    pub fn directions(&self, visible: &[bool]) -> usize {
        let free = |i: &usize| self.is_free(*i);
        match &self.space {
            FactorSpace::Nodes => (0..visible.len())
                .filter(free)
                .filter(|i| visible[*i])
                .count(),
            FactorSpace::Cells(cells) => {
                let last = cells.last().map_or(0, |c| c + 1);
                let nodes = |c: usize| (0..cells.len()).filter(move |i| cells[*i] == c);
                let counts = |c: &usize| {
                    let mut all = nodes(*c);
                    all.all(|i| self.is_free(i)) && nodes(*c).any(|i| visible[i])
                };
                (0..last).filter(counts).count()
            }
            FactorSpace::Constant { .. } => usize::from(self.all_free() && visible.contains(&true)),
        }
    }

    pub fn free_on(&self, problem: &Problem) -> Vec<[f64; 2]> {
        let times = problem.system.grid.times();
        match self.space {
            FactorSpace::Constant { .. } if !self.all_free() => Vec::new(),
            _ => spans(&times, |i| self.is_free(i)),
        }
    }

    /// The scaling ambiguity that records, penalties and equality constraints leave, and the finding about it.
    pub fn left(&self, problem: &Problem, component: &Component) -> (ScaleFreedom, RankFinding) {
        let symbols = component.symbols(problem);
        let by_records = match &self.space {
            FactorSpace::Constant { .. } if !self.all_free() => ScaleFreedom::None,
            FactorSpace::Constant { nearly_more: true } => ScaleFreedom::NearlyFunction,
            FactorSpace::Constant { nearly_more: false } => ScaleFreedom::ConstantFactor,
            _ if !(0..self.forced.len()).any(|i| self.is_free(i)) => ScaleFreedom::None,
            _ => ScaleFreedom::Function,
        };
        if by_records == ScaleFreedom::None {
            let given: Vec<String> = component.given(problem).map(|f| f.name()).collect();
            let sentence = match (self.free_functions, given.as_slice()) {
                (0, _) => format!("the scale of {symbols} is fixed: none of them is estimated"),
                (_, []) => format!("a measured force determines the scale of {symbols}"),
                (_, given) => format!("the scale of {symbols} follows from {}", given_words(given)),
            };
            let kind = RankFindingKind::ScaleIdentified;
            return (ScaleFreedom::None, RankFinding { kind, sentence });
        }
        let held = self.held(problem, component);
        let smooth = smoothness(problem, component);
        let where_free = match self.all_free() {
            true => "no force is measured".to_owned(),
            false => format!("no force acts on {}", span_words(&self.free_on(problem))),
        };
        let partly = !self.all_free();
        let reference = smooth.is_some_and(|order| order == 0);
        let left = match by_records {
            _ if reference => ScaleFreedom::None,
            // A force at other times and a penalty determine the scale on force-free intervals.
            ScaleFreedom::Function if smooth.is_some() && (held || partly) => ScaleFreedom::None,
            ScaleFreedom::Function | ScaleFreedom::NearlyFunction if smooth.is_some() && !held => {
                ScaleFreedom::ConstantFactor
            }
            ScaleFreedom::ConstantFactor | ScaleFreedom::NearlyFunction
                if held && smooth.is_some() =>
            {
                ScaleFreedom::None
            }
            ScaleFreedom::ConstantFactor if held => ScaleFreedom::None,
            other => other,
        };
        let sentence = scale_sentence(
            left,
            &symbols,
            &where_free,
            [reference, held, smooth.is_some(), partly],
        );
        let kind = match left {
            ScaleFreedom::None => RankFindingKind::ScaleConstrained,
            ScaleFreedom::ConstantFactor => RankFindingKind::ConstantScaleFree,
            ScaleFreedom::NearlyFunction => RankFindingKind::ScaleNearlyFree,
            ScaleFreedom::Function => RankFindingKind::ScaleFree,
        };
        (left, RankFinding { kind, sentence })
    }

    /// True if an equality with nonzero right-hand side determines the constant factor.
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

/// Factors `s(t)` under which the bases of all functions are closed.
enum FactorSpace {
    Nodes,
    /// Constant on each cell; the cell of every node.
    Cells(Vec<usize>),
    Constant {
        nearly_more: bool,
    },
}

impl FactorSpace {
    pub fn of(problem: &Problem, free: &[&CoefficientFunction]) -> Self {
        let grid = &problem.system.grid;
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

/// Lowest order of a penalty on a function of the component; total variation counts as order 1.
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

/// The sentence about the scale that is left, by whether there is a reference, a constraint that determines a constant factor, a
/// penalty, and a force at other times.
fn scale_sentence(
    left: ScaleFreedom,
    symbols: &str,
    where_free: &str,
    [reference, held, smooth, partly]: [bool; 4],
) -> String {
    match left {
        ScaleFreedom::None => format!(
            "{where_free}: the scale of {symbols} follows from {} alone",
            match (reference, held, smooth) {
                (true, ..) => "a reference",
                (_, true, true) => "a penalty and a constraint on a value or mean",
                (_, true, false) => "a constraint on a value or mean",
                _ => "a penalty and the force at other times",
            }
        ),
        ScaleFreedom::ConstantFactor => format!(
            "{where_free}: {symbols} are determined only up to a common constant factor; fix a function, constrain a \
                 value or mean, or add a record with a measured force"
        ),
        ScaleFreedom::NearlyFunction => format!(
            "{where_free}: {symbols} are determined only up to a common factor{}, and with bases of many knots a slowly \
                 varying factor s(t) is hardly identifiable; fix a function, add a penalty, or add a record with a \
                 measured force",
            match held {
                true => " whose mean a constraint determines",
                false => "",
            }
        ),
        ScaleFreedom::Function => format!(
            "{where_free}: {symbols} are determined only up to a common factor s(t){}; fix a function, add a penalty, or \
                 add a record with a measured force {}",
            match held {
                true => " (a constraint on a value or mean determines only a constant factor)",
                false => "",
            },
            match partly {
                true => "at these times",
                false => "at all times",
            }
        ),
    }
}
