//! Connected records: groups of functions that share one scale, and the forces and fixed functions that determine it.

use crate::functions::CoefficientFunction;
use crate::problem::Problem;
use crate::record::Experiment;
use crate::system::StageSamples;

/// Functions with one common factor: those of coefficient sets that share a function.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Component {
    /// Indices into the list of functions.
    pub functions: Vec<usize>,
    /// Indices of the coefficient sets.
    pub coefficient_sets: Vec<usize>,
}

/// Components of the coefficient sets used by an experiment.
pub(super) fn components(problem: &Problem) -> Vec<Component> {
    let mut found: Vec<Component> = Vec::new();
    for (which, assembly) in problem.functions.coefficient_sets().iter().enumerate() {
        if !problem
            .experiments
            .iter()
            .any(|e| e.coefficient_set == which)
        {
            continue;
        }
        let functions: Vec<usize> = assembly.parts().map(|(_, f)| f).collect();
        let shares = |c: &Component| c.functions.iter().any(|f| functions.contains(f));
        let (joined, others): (Vec<_>, Vec<_>) = found.into_iter().partition(shares);
        found = others;
        let mut union = Component {
            functions,
            coefficient_sets: vec![which],
        };
        for part in joined {
            union.functions.extend(part.functions);
            union.coefficient_sets.extend(part.coefficient_sets);
        }
        union.functions.sort_unstable();
        union.functions.dedup();
        union.coefficient_sets.sort_unstable();
        found.push(union);
    }
    found.sort_by_key(|c| c.coefficient_sets[0]);
    found
}

impl Component {
    /// Experiments of the component.
    pub fn experiments<'a>(
        &'a self,
        problem: &'a Problem,
    ) -> impl Iterator<Item = &'a Experiment> + 'a {
        let mine = |e: &&Experiment| self.coefficient_sets.contains(&e.coefficient_set);
        problem.experiments.iter().filter(mine)
    }

    /// Symbols of the functions, `(m, c, k)`.
    pub fn symbols(&self, problem: &Problem) -> String {
        let functions = self.functions.iter().map(|f| problem.functions.get(*f));
        let symbol = |function: &CoefficientFunction| match &function.owner {
            None => function.quantity.symbol().to_owned(),
            Some(owner) => format!("{} of {owner}", function.quantity.symbol()),
        };
        let functions = functions.filter(|function| !function.is_known_part);
        let symbols: Vec<String> = functions.map(symbol).collect();
        format!("({})", symbols.join(", "))
    }

    /// Nodes at which a force acts in an experiment of the component, at the node itself or in an adjacent step. Motion of the
    /// base is excluded: its inertia force `m b''` scales with `m`.
    pub fn forced(&self, problem: &Problem) -> Vec<bool> {
        let mut forced = vec![false; problem.functions.nodes()];
        for experiment in self.experiments(problem) {
            let Some(force) = force_of(experiment) else {
                continue;
            };
            for (i, stages) in force.iter().enumerate().take(experiment.nodes - 1) {
                forced[i] |= stages[0] != 0.0 || stages[1] != 0.0;
                forced[i + 1] |= stages[1] != 0.0 || stages[2] != 0.0;
            }
        }
        forced
    }

    /// Nodes at which a fixed function is nonzero.
    pub fn known(&self, problem: &Problem) -> Vec<bool> {
        let mut known = vec![false; problem.functions.nodes()];
        for function in self.given(problem) {
            let is_known = |i: usize| function.fixed_at(i) != 0.0 || function.prior.is_some();
            let nodes = known.iter_mut().enumerate();
            nodes.for_each(|(i, known)| *known |= is_known(i));
        }
        known
    }

    /// Fixed functions that are nonzero somewhere, and known values with a standard deviation.
    pub fn given<'a>(
        &'a self,
        problem: &'a Problem,
    ) -> impl Iterator<Item = &'a CoefficientFunction> + 'a {
        let functions = self.functions.iter().map(|f| problem.functions.get(*f));
        let is_nonzero = |f: &CoefficientFunction| f.offset.iter().any(|p| *p != 0.0);
        functions.filter(move |f| f.prior.is_some() || f.parameters() == 0 && is_nonzero(f))
    }
}

/// Enumeration of fixed functions: `the fixed mass and the fixed stiffness`.
pub(super) fn given_words(names: &[String]) -> String {
    let names: Vec<String> = (names.iter().map(|name| format!("the fixed {name}"))).collect();
    names.join(" and ")
}

/// The force of an experiment, where there is one.
pub(super) fn force_of(experiment: &Experiment) -> Option<&StageSamples> {
    experiment.excitation.as_ref()?.force(0)
}
