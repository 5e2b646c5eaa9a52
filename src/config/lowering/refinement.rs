//! Finer grids of a model whose number of nodes is automatic.

use super::grid::{FinerNodes, stable_nodes};
use super::{BuildMode, Known, Model, ReadRecords, build_on};
use crate::config::ModelFile;
use kmcfit_core::internals::solvers::Solver;
use std::sync::Arc;

/// An automatic grid, and the model file from which the model is built on a finer one.
#[derive(Debug, Clone)]
pub struct AutomaticGrid {
    file: Arc<ModelFile>,
    finer: FinerNodes,
    read: Arc<ReadRecords>,
}

impl AutomaticGrid {
    /// The automatic grid of a fit that simulates the response.
    pub(super) fn of(
        file: &ModelFile,
        mode: BuildMode,
        solver: Solver,
        finer: Option<FinerNodes>,
        read: &Arc<ReadRecords>,
    ) -> Option<Self> {
        let is_fit = mode == BuildMode::Fit && solver != Solver::EquationError;
        let finer = finer.filter(|_| is_fit)?;
        Some(Self {
            file: Arc::new(file.clone()),
            finer,
            read: Arc::clone(read),
        })
    }

    /// Most nodes.
    pub fn most(&self) -> usize {
        self.finer.most
    }
}

impl Model {
    /// The model on an automatic grid of at least `least` nodes, with the same settings; `None` if the number of nodes is stated, or
    /// the grid does not fit into memory.
    pub fn on_nodes(&self, least: usize) -> Option<Self> {
        let AutomaticGrid { file, finer, read } = self.grid.as_ref()?;
        let start = self.problem.start();
        let scalars = self.problem.scalars(&start);
        let experiments = self.problem.experiments.iter();
        let known = Known {
            read: Arc::clone(read),
            states: experiments.map(|e| e.initial_state(scalars)).collect(),
            source: self.source.clone(),
        };
        let model = build_on(file, BuildMode::Fit, finer.at_least(least), Some(known)).ok()?;
        Some(Self {
            settings: self.settings.clone(),
            automatic: self.automatic.clone(),
            ..model
        })
    }

    /// The model on a grid with stable steps at the start, if its grid is automatic and such a grid is possible.
    pub(super) fn on_stable_grid(self) -> Self {
        let Some(most) = self.grid.as_ref().map(AutomaticGrid::most) else {
            return self;
        };
        let problem = &self.problem;
        let start = problem.start();
        let sets = 0..problem.functions.coefficient_sets().len();
        let of_set = sets.map(|set| {
            let mut nodal = problem.functions.empty_nodal();
            problem.functions.nodal_into(&start, set, &mut nodal);
            problem.system.stable_nodes(&nodal)
        });
        let stable = of_set.max().unwrap_or_default().min(most);
        let before = problem.system.grid.nodes();
        let finer = (stable > before).then(|| self.on_nodes(stable)).flatten();
        let Some(mut finer) = finer else {
            return self;
        };
        let nodes = finer.problem.system.grid.nodes();
        finer.automatic.push(stable_nodes(nodes, before));
        finer
    }
}
