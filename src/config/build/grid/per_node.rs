//! Upper estimate of the memory of a run per node, bytes, from method, records and functions.
//!
//! The constants are the measured growth of a run's memory with the number of nodes, for every method and one to three
//! records and functions, rounded up; most runs need half of the estimate.

use crate::config::ModelFile;
use crate::config::build::BuildMode;
use crate::config::build::fit::DEFAULT_MEMORY;
use crate::config::build::functions::{self, Given};
use crate::config::spec::{Basis, FitMethod};
use crate::config::values::KnotSpec;
use kmcfit_core::internals::solvers::FEW_PARAMETERS;

/// Bytes per node of every run: times, tables and figures.
const RUN: usize = 200;
/// For each record: response, excitation and samples.
const RECORD: usize = 400;
/// For each function: its values, design and table.
const FUNCTION: usize = 100;
/// For each record of a simulation, which keeps one response and writes one table.
const SIMULATION: usize = 100;
/// For each pair of L-BFGS and each nodal function: two numbers and their duals, doubled while a checkpoint is written.
const PAIR: usize = 72;
/// Gauss-Newton with few parameters, for each record: start from the samples, Jacobian.
const FEW: usize = 1000;
const FEW_RECORD: usize = 300;
/// Gauss-Newton with many parameters, for each record and each nodal function: the states are unknowns with sparse
/// factors.
const MANY_RECORD: usize = 3500;
const MANY_FUNCTION: usize = 1500;
/// Factor on [`MANY_RECORD`] for fits that may need quadratic programs by an interior-point method.
const PROGRAMS: usize = 2;

/// Upper estimate of the memory of a run, bytes per node.
pub fn per_node(file: &ModelFile, mode: BuildMode) -> usize {
    let spec = &file.spec;
    let (records, functions) = (spec.experiments.len(), functions::all(file));
    if let BuildMode::Simulate { .. } = mode {
        return SIMULATION * (1 + records + functions.len());
    }
    let common = RUN + RECORD * records + FUNCTION * functions.len();
    let values: Vec<FreeValues> = functions.iter().map(free_values).collect();
    let nodal = values.iter().filter(|v| **v == FreeValues::PerNode).count();
    let few: usize = (values.iter())
        .map(|v| match v {
            FreeValues::Few(count) => *count,
            FreeValues::PerNode => 0,
        })
        .sum();
    let fit = spec.fit.as_ref();
    let method = fit.and_then(|f| f.method);
    let own = match method.unwrap_or(FitMethod::GaussNewton) {
        FitMethod::SteepestDescent => 0,
        FitMethod::Lbfgs => {
            let memory = fit.and_then(|f| f.memory).map_or(DEFAULT_MEMORY, |m| m.0);
            PAIR.saturating_mul(memory).saturating_mul(nodal)
        }
        FitMethod::ProjectedGradient if !has_programs(file, &functions) => 0,
        FitMethod::ProjectedGradient => PROGRAMS * MANY_FUNCTION * nodal,
        FitMethod::GaussNewton | FitMethod::EquationError => {
            let steps = match nodal == 0 && few <= FEW_PARAMETERS {
                true => FEW + FEW_RECORD * records,
                false => MANY_RECORD * records + MANY_FUNCTION * nodal,
            };
            match has_programs(file, &functions) {
                true => PROGRAMS * steps,
                false => steps,
            }
        }
    };
    own.saturating_add(common)
}

/// Number of parameters of a function.
#[derive(Clone, Copy, PartialEq, Eq)]
enum FreeValues {
    Few(usize),
    /// One for each node, or a similar number.
    PerNode,
}

fn free_values((_, spec): &Given) -> FreeValues {
    let knots = match &spec.knots {
        Some(KnotSpec::Count(count)) => count.0,
        Some(KnotSpec::Times(times)) => times.len(),
        Some(KnotSpec::Auto) => FEW_PARAMETERS - 2,
        None => 0,
    };
    let count = match spec.basis {
        None => 0,
        Some(Basis::Nodal) => return FreeValues::PerNode,
        Some(Basis::Constant) => 1,
        Some(Basis::Polynomial) => spec.degree.map_or(1, |d| d.0.saturating_add(1)),
        // A cubic spline has two more than it has knots.
        Some(Basis::PiecewiseConstant | Basis::PiecewiseLinear | Basis::BSpline) => {
            knots.saturating_add(2)
        }
    };
    match count <= FEW_PARAMETERS {
        true => FreeValues::Few(count),
        false => FreeValues::PerNode,
    }
}

/// True if inequalities or total variation may need a quadratic program.
fn has_programs(file: &ModelFile, functions: &[Given]) -> bool {
    let limited =
        |(_, spec): &Given| spec.min.is_some() || spec.max.is_some() || spec.has_total_variation();
    file.spec.constraints.is_some() || functions.iter().any(limited)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn model(functions: &str, fit: &str, more: &str) -> ModelFile {
        let record = "{initial: {displacement: 1.0, velocity: 0.0}}";
        let text = format!(
            "format: 1\nexperiments:\n  - {record}\nfunctions:\n  mass: {{fixed: 1.0}}\n  \
             damping: {{basis: constant, start: 1.0}}\n  stiffness: {functions}\n\
             fit: {{method: {fit}}}\n{more}"
        );
        ModelFile::parse("m.yaml", text).expect("a model")
    }

    /// The measured growth, in bytes per node, is slightly below the estimate.
    #[test]
    fn the_estimate_is_above_what_was_measured() {
        let nodal = "{basis: nodal, start: 1.0}";
        let constant = "{basis: constant, start: 1.0}";
        let variation = "{basis: nodal, start: 1.0, penalty: {kind: tv, weight: 0.01}}";
        let measured = [
            (constant, "lbfgs", 439),
            (nodal, "lbfgs", 1649),
            (constant, "gauss-newton", 1513),
            (nodal, "gauss-newton", 3564),
            (variation, "gauss-newton", 6485),
        ];
        for (function, method, bytes) in measured {
            let file = model(function, method, "");
            let asked = per_node(&file, BuildMode::Fit);
            assert!(
                (bytes..=2 * bytes + 500).contains(&asked),
                "{method}: {asked} {bytes}"
            );
        }
        let simulation = BuildMode::Simulate { nodes: None };
        let asked = per_node(&model(nodal, "lbfgs", ""), simulation);
        assert!((186..=500).contains(&asked), "{asked}");
    }

    /// Peaks of `fit --no-report --checkpoint 0.3` on 200,000 and on 8000 nodes, 40 iterations, compared.
    #[test]
    fn the_estimate_of_shipped_models_is_above_what_was_measured() {
        let measured = [
            ("paper", 805),
            ("paper-lbfgs", 4660),
            ("paper-smooth", 3320),
            ("knots", 1710),
        ];
        for (name, bytes) in measured {
            let mut folders = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
            let model = folders.find_map(|folder| {
                let path = folder.join(format!("models/{name}.yaml"));
                path.is_file().then_some(path)
            });
            let file = ModelFile::read(model.expect("a shipped model")).expect("a model");
            let asked = per_node(&file, BuildMode::Fit);
            assert!(asked >= bytes, "{name}: {asked} {bytes}");
        }
    }

    #[test]
    fn more_knots_than_a_dense_jacobian_takes_are_many() {
        let splines = |knots: usize| {
            let function = format!("{{basis: b-spline, knots: {knots}, start: 1.0}}");
            per_node(&model(&function, "gauss-newton", ""), BuildMode::Fit)
        };
        assert_eq!(splines(10), splines(60));
        assert!(splines(100) > 2 * splines(60));
    }
}
