//! Structural rank: upper bound of the number of identifiable parameter combinations, from the problem alone, without a
//! simulation.
//!
//! **Rows.** Each sample is one equation. If every term is linear in the response (damping and stiffness), the response
//! is linear in `(y(0), v(0), f, b'')`: among the samples of one kind at one time, at most as many are independent as the
//! inputs of the records up to that time. A third free record adds no equations, nor does a forced one before its force
//! starts.
//!
//! **Force-free nodes.** With one value per node and one sample per step, a step of the midpoint rule without a force in
//! it or half a step before maps states of two dimensions: it adds at most two equations.
//!
//! **Columns.** Parameters that act after the last sample are not identifiable, and neither is the common scale:
//! `(m, c, k) -> s(t) (m, c, k)` leaves the response unchanged where no force acts. If all bases are closed under
//! multiplication by `s(t)`, this is one direction per node (or cell) without a force and without a nonzero fixed
//! function; otherwise it is the constant factor, if neither a force nor a nonzero fixed function exists.
//!
//! The constant factor is exact. Invariance under `s(t)` holds to the order of the stepper: exactly for displacements
//! alone; with further channels, or cells whose values jump within a step, the singular values fall with the step, and a
//! rank with a relative threshold of 1e-12 may exceed this bound.

mod columns;
mod rows;
mod scale;

use super::components::components;
use crate::problem::Problem;
use columns::{parameter_is_visible, visible_nodes};
use rows::equations;
use scale::CommonScale;
use serde::{Deserialize, Serialize};

/// Factor `s(t)` of all functions, `(m, c, k) -> s(t) (m, c, k)`, that the problem leaves undetermined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ScaleFreedom {
    /// None.
    None,
    /// One factor for all times.
    ConstantFactor,
    /// Exactly one factor for all times, and approximately any slowly varying `s(t)`: the bases have many knots.
    NearlyFunction,
    /// Any function `s(t)`, on [`StructuralRank::free_on`].
    Function,
}

/// Structural rank of a problem.
#[derive(Debug, Clone, PartialEq)]
pub struct StructuralRank {
    /// Upper bound of the rank: number of identifiable parameter combinations.
    pub rank_bound: usize,
    /// Number of parameters.
    pub parameters: usize,
    /// Independent equations of the samples.
    pub equations: usize,
    /// Scaling ambiguity that records, functions, penalties and equality constraints leave together.
    pub scale_freedom: ScaleFreedom,
    /// Intervals of time on which the scale is free, s.
    pub free_on: Vec<[f64; 2]>,
    /// Findings on the rank and on the scale of the functions.
    pub findings: Vec<RankFinding>,
}

impl StructuralRank {
    /// Headline and sentences of all findings.
    pub fn sentences(&self) -> Vec<String> {
        let all = self.findings.iter().map(|s| s.sentence.clone());
        std::iter::once(self.headline()).chain(all).collect()
    }

    /// The rank bound as a sentence.
    pub fn headline(&self) -> String {
        let Self {
            rank_bound,
            parameters,
            ..
        } = self;
        format!("at most {rank_bound} of {parameters} parameter combinations are identifiable")
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
    /// Kind.
    pub kind: RankFindingKind,
    /// Sentence.
    pub sentence: String,
}

impl RankFinding {
    /// True if the finding limits what is identifiable.
    pub fn is_warning(&self) -> bool {
        !matches!(
            self.kind,
            RankFindingKind::ScaleIdentified | RankFindingKind::ScaleConstrained
        )
    }
}

/// Computes the structural rank of `problem`.
pub fn structural_rank(problem: &Problem) -> StructuralRank {
    let (equations, mut findings) = equations(problem);
    let visible = visible_nodes(problem);
    let mut seen = (0..problem.parameters())
        .filter(|j| parameter_is_visible(problem, *j, &visible))
        .count();
    let mut worst = ScaleFreedom::None;
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
        rank_bound: seen.min(equations),
        parameters: problem.parameters(),
        equations,
        scale_freedom: worst,
        free_on,
        findings,
    }
}
