//! What records can show at most, from the problem alone: no response is computed.
//!
//! **Rows.** A sample gives one equation. Where every term is linear in the response (damping and
//! stiffness), the response is linear in `(y(0), v(0), f, b'')`: of the samples of one kind at one time only as
//! many are independent as the records' inputs up to that time. So a third free record adds nothing, and
//! neither does a forced one before its force sets in.
//!
//! **Silent nodes.** With one value per node and one sample per step, a step of the midpoint rule
//! without a force, and without one half a step before, moves states of two dimensions: it adds at most
//! two equations.
//!
//! **Columns.** A parameter that acts after the last sample is not seen, and neither is the common
//! scale: `(m, c, k) -> s(t) (m, c, k)` leaves the response unchanged where no force acts. For functions
//! that are closed under multiplication by `s(t)` that is one direction per node (or cell) without a
//! force and without a known function that is not zero, for others the constant factor, if there
//! is neither anywhere.
//!
//! The constant factor is exact; `s(t)` holds to the order of the stepper: with displacements alone it
//! is not seen at all; further channels, or cells whose values jump within a step, may give it singular
//! values that fall with the step, so that a rank by a relative 1e-12 finds more than is counted here.

mod columns;
mod rows;
mod scale;

use super::components::components;
use crate::problem::Problem;
use columns::{parameter_is_visible, visible_nodes};
use rows::equations;
use scale::CommonScale;
use serde::{Deserialize, Serialize};

/// Which factor of all functions nothing in the problem fixes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Symmetry {
    /// None.
    None,
    /// One factor for all times.
    ConstantFactor,
    /// One factor for all times exactly, and nearly any slow `s(t)`: the bases have many knots.
    NearlyFunction,
    /// Any function `s(t)`, on [`StructuralRank::free_on`].
    Function,
}

/// What can be seen at most.
#[derive(Debug, Clone, PartialEq)]
pub struct StructuralRank {
    /// Upper bound of the number of directions that the samples see.
    pub seen_at_most: usize,
    /// Number of parameters.
    pub of: usize,
    /// Independent equations of the samples.
    pub equations: usize,
    /// The gauge that is left by records, functions, penalties and equality constraints together.
    pub symmetry: Symmetry,
    /// The spans of time on which the scale is free, s.
    pub free_on: Vec<[f64; 2]>,
    /// Findings on the rank and on the scale of the functions.
    pub findings: Vec<RankFinding>,
}

impl StructuralRank {
    /// The headline and the sentences of all findings.
    pub fn sentences(&self) -> Vec<String> {
        let all = self.findings.iter().map(|s| s.sentence.clone());
        std::iter::once(self.headline()).chain(all).collect()
    }

    /// The rank bound as a sentence.
    pub fn headline(&self) -> String {
        let Self {
            seen_at_most, of, ..
        } = self;
        format!("at most {seen_at_most} of {of} parameter combinations are identifiable")
    }
}

/// Kind of a [`RankFinding`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RankFindingKind {
    /// Some records are linear combinations of others.
    DependentRecords,
    /// A force or a fixed function determines the scale of the functions.
    ScaleIdentified,
    /// A constraint or a penalty determines the scale, which the records do not.
    ScaleConstrained,
    /// One factor, constant in time, is not identifiable.
    ConstantScaleFree,
    /// A slowly varying factor is hardly identifiable.
    ScaleNearlyFree,
    /// Any common factor `s(t)` is possible.
    ScaleFree,
}

/// A finding on the structural rank, with its sentence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RankFinding {
    /// Its kind.
    pub kind: RankFindingKind,
    /// The sentence.
    pub sentence: String,
}

impl RankFinding {
    /// Whether the finding limits what is identifiable.
    pub fn is_warning(&self) -> bool {
        !matches!(
            self.kind,
            RankFindingKind::ScaleIdentified | RankFindingKind::ScaleConstrained
        )
    }
}

/// Counts what the records of `problem` can show.
pub fn structural_rank(problem: &Problem) -> StructuralRank {
    let (equations, mut findings) = equations(problem);
    let visible = visible_nodes(problem);
    let mut seen = (0..problem.parameters())
        .filter(|j| parameter_is_visible(problem, *j, &visible))
        .count();
    let mut worst = Symmetry::None;
    let mut free_on = Vec::new();
    for component in components(problem) {
        let scale = CommonScale::of(problem, &component);
        seen -= scale.directions(&visible).min(seen);
        let (left, finding) = scale.left(problem, &component);
        if left > worst {
            worst = left;
            free_on = scale.free_on(problem);
        }
        findings.push(finding);
    }
    StructuralRank {
        seen_at_most: seen.min(equations),
        of: problem.parameters(),
        equations,
        symmetry: worst,
        free_on,
        findings,
    }
}
