//! Finer grids of a model whose number of nodes is automatic.

use super::grid::{FinerNodes, MOST_CHOSEN, stable_nodes, unstable_start, unstable_steps};
use super::{BuildMode, Known, Model, ReadRecords, build_on};
use crate::config::ModelFile;
use crate::error::InputError;
use kmcfit_core::solvers::Solver;
use kmcfit_core::system::NodalCoefficients;
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

    /// True for steps that the record determines, not its sampling.
    pub fn is_chosen(&self) -> bool {
        !self.finer.is_per_sample
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
    ///
    /// # Errors
    /// If the steps are unstable at the start on a grid that is not finer, and no function is searched; otherwise a note says so.
    pub(super) fn on_stable_grid(
        mut self,
        file: &ModelFile,
        mode: BuildMode,
    ) -> Result<Self, InputError> {
        if let Some(most) = self.grid.as_ref().map(AutomaticGrid::most) {
            let stable = self.stable_nodes(|_| true).min(most);
            let before = self.problem.system.grid.nodes();
            let finer = (stable > before).then(|| self.on_nodes(stable)).flatten();
            if let Some(mut finer) = finer {
                let nodes = finer.problem.system.grid.nodes();
                finer.automatic.push(stable_nodes(nodes, before));
                self = finer;
            }
        }
        let system = &self.problem.system;
        // The equation error needs no response.
        let simulates = mode != BuildMode::Fit || self.settings.solver != Solver::EquationError;
        let least = self.stable_nodes(|nodal| simulates && system.is_unstable(nodal));
        // Start values without any stable grid fail at the first step. A search may leave them.
        let is_searched = mode == BuildMode::Fit && self.problem.functions.scalar_range().start > 0;
        match (least == 0 || least > MOST_CHOSEN, is_searched) {
            (true, _) => {}
            (false, true) => self.automatic.push(unstable_start(&system.grid, least)),
            (false, false) => return Err(unstable_steps(file, mode, &system.grid, least)),
        }
        Ok(self)
    }

    /// Smallest number of nodes with stable steps for all start functions that are meant; 0 without them.
    fn stable_nodes(&self, is_meant: impl Fn(&NodalCoefficients) -> bool) -> usize {
        let problem = &self.problem;
        let start = problem.start();
        let of_set = |set: usize| {
            let mut nodal = problem.functions.empty_nodal();
            problem.functions.nodal_into(&start, set, &mut nodal);
            is_meant(&nodal).then(|| problem.system.stable_nodes(&nodal))
        };
        let sets = 0..problem.functions.coefficient_sets().len();
        sets.filter_map(of_set).max().unwrap_or_default()
    }
}
