//! Output of a fit: the result document, tables, figures and the page.

use super::channel_view::ChannelView;
use super::chart::{Figure, render};
use super::cost::{CostKind, cost_definition};
use super::document::{
    ActiveSummary, AttemptSummary, ChannelSummary, ConstraintSummary, CostSummary, CountsSummary,
    ExperimentSummary, FORMAT, GradientSummary, ModelSummary, OutcomeSummary, PathPointSummary,
    PenaltySummary, Prediction, ResultDocument, SlackSummary, WeightSummary,
};
use super::fit_assessment::RunAssessment;
use super::fit_figures::DrawnFigures;
use super::fit_quality;
use super::page::fit_page;
use super::ratios;
use super::tables::{FUNCTION_ROWS, TRAJECTORY_ROWS};
use super::timings::{OverheadTimings, TimingsSummary};
use crate::config::{ChannelNote, Model};
use kmcfit_core::assessment::Estimate;
use kmcfit_core::functions::{CoefficientFunction, WeightRule};
use kmcfit_core::host::Instant;
use kmcfit_core::identifiability::{Bands, Quantities};
use kmcfit_core::solvers::{
    ActiveGroup, Attempt, Fit, PathPoint, Solver, Status, WeightPath, active_constraints, timed,
};
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::system::Excitation;
use kmcfit_core::threads::{analyses_at_once, map};
use std::io;
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Duration;

/// The page.
const PAGE: &str = "report.html";
/// The model file, as it was read.
pub const MODEL: &str = "model.yaml";
/// Most parameters of `parameters.json`: the values of more stand in `functions.csv`.
const MOST_PARAMETERS: usize = 10_000;

/// A fitted model with its predictions and assessment.
#[derive(Debug, Clone)]
pub struct FittedModel<'a> {
    /// Model.
    pub model: &'a Model,
    /// Result of the fit.
    pub fit: &'a Fit,
    /// Responses of the fitted system to other initial states.
    pub predictions: &'a [Prediction],
    /// Weight path, if a rule chose the weight of a penalty.
    pub weights: Option<&'a WeightPath>,
    /// Assessment of the fit.
    pub run_assessment: &'a RunAssessment,
    /// Files that are written on request.
    pub requested: RequestedFiles,
    /// What several parts of a report use.
    pub computed: Computed,
}

/// What several parts of a report use, each computed where it is first needed.
#[derive(Debug, Clone, Default)]
pub struct Computed {
    /// Figures that both page and files have.
    pub(super) figures: OnceLock<DrawnFigures>,
    /// Estimates with the names of the core.
    pub(super) estimates: OnceLock<Vec<(String, Estimate)>>,
}

impl Model {
    /// SI unit of a function, for a rotation if the channels are angles; per unit of the mass if this is unknown.
    pub(super) fn unit(&self, function: &CoefficientFunction) -> &'static str {
        self.unit_of(function.quantity)
    }

    fn unit_of(&self, kind: CoefficientKind) -> &'static str {
        match self.is_rotation() {
            is_rotation if self.has_unknown_mass => ratios::unit(kind, is_rotation),
            true => kind.angular_unit(),
            false => kind.unit(),
        }
    }

    /// The unit of a result that is in the SI unit `unit` of a coefficient of a translation; others are unchanged.
    pub(crate) fn converted_unit<'a>(&self, unit: &'a str) -> &'a str {
        let mut kinds = CoefficientKind::ALL.into_iter();
        let kind = kinds.find(|kind| kind.unit() == unit);
        kind.map_or(unit, |kind| self.unit_of(kind))
    }

    /// True if the channels are angles.
    pub(super) fn is_rotation(&self) -> bool {
        let mut units = self.notes.iter().flatten().map(|note| note.unit);
        units.any(|unit| unit.is_angular())
    }
}

impl<'a> FittedModel<'a> {
    /// A fit without predictions, a choice of the weight and requested files.
    pub(super) fn new(model: &'a Model, fit: &'a Fit, run_assessment: &'a RunAssessment) -> Self {
        Self {
            model,
            fit,
            predictions: &[],
            weights: None,
            run_assessment,
            requested: RequestedFiles::default(),
            computed: Computed::default(),
        }
    }
}

impl FittedModel<'_> {
    /// Writes tables and, if requested, figures and the page of `document`, but not the result document itself. Returns
    /// the elapsed time multiplied by the share of writing in the working time of the threads.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn write(
        &self,
        into: &(dyn Fn(&str, &[u8]) -> io::Result<()> + Sync),
        document: &ResultDocument,
    ) -> io::Result<Duration> {
        let (writing, all) = (Mutex::default(), Mutex::default());
        let write = |name: &str, bytes: &[u8]| timed_in(&writing, || into(name, bytes));
        let figures = match self.requested.figures {
            true => self.figures(),
            false => Vec::new(),
        };
        // The longest first.
        let part = |i: usize| match i.checked_sub(2) {
            Some(i) => {
                let (name, text) = svg(&figures[i]);
                write(&name, text.as_bytes())
            }
            None if i == 0 => self.write_tables(document, &write),
            None => write(PAGE, self.page(document).as_bytes()),
        };
        let parts = match self.requested.figures {
            true => 2 + figures.len(),
            false => 1,
        };
        let threads = analyses_at_once(self.model.problem.sample_count());
        let clock = Instant::now();
        let results = map(parts, threads, |i| timed_in(&all, || part(i))).into_iter();
        results.collect::<io::Result<()>>()?;
        let [writing, all] = [writing, all].map(|of| {
            let taken: Duration = of.into_inner().unwrap_or_else(PoisonError::into_inner);
            taken.as_secs_f64()
        });
        Ok(clock
            .elapsed()
            .mul_f64(writing / all.max(writing).max(f64::MIN_POSITIVE)))
    }

    fn write_tables(
        &self,
        document: &ResultDocument,
        write: &impl Fn(&str, &[u8]) -> io::Result<()>,
    ) -> io::Result<()> {
        if self.model.problem.parameters() <= MOST_PARAMETERS {
            write(
                "parameters.json",
                json(&self.parameters(document)).as_bytes(),
            )?;
        }
        write("history.csv", self.history().to_csv().as_bytes())?;
        write("functions.csv", self.functions_table().to_csv().as_bytes())?;
        write("trajectory.csv", self.trajectories().to_csv().as_bytes())?;
        for (name, table) in self.samples() {
            write(&name, table.to_csv().as_bytes())?;
        }
        Ok(())
    }

    /// The HTML page of the run: one file without external resources.
    pub fn page(&self, document: &ResultDocument) -> String {
        fit_page(self, document)
    }

    /// The result document.
    pub fn document(&self) -> ResultDocument {
        let (model, fit) = (self.model, self.fit);
        let (identifiability, findings) = self.identifiability();
        let mut document = ResultDocument {
            format: FORMAT,
            title: model.title.clone(),
            version: env!("CARGO_PKG_VERSION").into(),
            verdict: Some(self.verdict()),
            estimates: self.estimates(),
            classical: (self.run_assessment.assessment.as_ref()).and_then(|a| a.classical.clone()),
            model: self.model_summary(),
            sources: model.source.data.clone(),
            outcome: OutcomeSummary {
                status: fit.outcome.status,
                reason: fit.outcome.reason.to_string(),
            },
            cost: CostSummary {
                initial: fit.initial_cost,
                r#final: fit.best.evaluation.cost,
                ratio: fit.cost_ratio(),
                misfit: fit.best.evaluation.misfit,
                regularisation: fit.best.evaluation.regularisation,
            },
            gradient: GradientSummary {
                initial_norm_squared: fit.initial_norm_squared,
                final_norm_squared: fit.best.gradient.norm_squared,
            },
            optimality: fit.optimality,
            counts: CountsSummary {
                iterations: fit.history.len() as u64,
                forward: fit.counts.forward,
                adjoint: fit.counts.adjoint,
                tangent: fit.counts.tangent,
                qp: fit.counts.qp,
            },
            seconds: fit.elapsed.as_secs_f64(),
            timings: TimingsSummary::new(fit, &OverheadTimings::default(), fit.elapsed),
            functions: self.function_summaries(),
            constraints: self.constraint_summary(),
            identifiability,
            findings,
            weights: self.weight_summary(),
            penalties: self.penalty_summaries(),
            attempts: self.fit.attempts.iter().map(attempt_summary).collect(),
            experiments: self.experiment_summaries(),
            validation: self
                .run_assessment
                .validation
                .iter()
                .map(fit_quality::validation)
                .collect(),
            nuisance_parameters: match self.is_simulated() {
                true => match self.run_assessment.quantities() {
                    Some(quantities) => quantities.scalars.clone(),
                    None => Quantities::scalars_of(&model.problem, &fit.best.evaluation.scalars),
                },
                false => Vec::new(),
            },
            statistics: (self.run_assessment.assessment.as_ref())
                .map(|a| a.statistics.clone())
                .unwrap_or_default(),
            step_check: self.run_assessment.step_check().cloned(),
            candidates: (self.run_assessment.assessment.as_ref())
                .and_then(|a| a.candidates.clone()),
            selection: Vec::new(),
            equation: self.run_assessment.balance.clone(),
            data: model.data.clone(),
            automatic: model.automatic.clone(),
            predictions: self.predictions.to_vec(),
            warnings: model.warnings.clone(),
            advice: Vec::new(),
        };
        document.advice = super::suggestions::untried(&document, model);
        document
    }

    /// True if the fit minimises the misfit of a simulated response; false for the equation error.
    pub(super) fn is_simulated(&self) -> bool {
        self.model.settings.solver != Solver::EquationError
    }

    /// The bands of functions and ratios, for models of at most 64 parameters.
    pub(super) fn bands(&self) -> Option<&Bands> {
        self.run_assessment.bands()
    }

    fn model_summary(&self) -> ModelSummary {
        let problem = &self.model.problem;
        let grid = &problem.system.grid;
        ModelSummary {
            file: self.model.file.display().to_string(),
            folder: Default::default(),
            overrides: self.model.source.overrides.clone(),
            nodes: grid.nodes(),
            steps_per_row: self.steps_per_row(FUNCTION_ROWS),
            steps_per_trajectory_row: self.steps_per_row(TRAJECTORY_ROWS),
            start: grid.start(),
            duration: grid.duration(),
            step: grid.step(),
            stepper: problem.system.method.name().into(),
            method: self.model.settings.solver.name().into(),
            gradient: self.model.settings.gradient.name().into(),
            parameters: problem.parameters(),
            mass_unknown: self.model.has_unknown_mass,
            terms: (problem.functions.coefficient_set(0).iter().skip(1))
                .map(|f| problem.functions.get(*f).quantity.name().into())
                .collect(),
            widths: (problem.functions.coefficient_set(0).iter().skip(1))
                .zip(problem.system.laws())
                .filter_map(|(f, law)| {
                    let name = problem.functions.get(*f).quantity.name();
                    Some((name.to_owned(), law.width()?))
                })
                .collect(),
            cost_kind: CostKind::of(problem, self.model.settings.solver),
            cost_definition: {
                let balance = self.run_assessment.balance.as_ref();
                let solver = self.model.settings.solver;
                cost_definition(problem, solver, balance.map(|b| b.form))
            },
        }
    }

    fn constraint_summary(&self) -> ConstraintSummary {
        let problem = &self.model.problem;
        let worst = problem
            .constraints
            .largest_violation(&self.fit.best.parameters);
        // Multipliers are meaningful only at points that satisfy the constraints.
        let active = match self.fit.outcome.status {
            Status::Infeasible => Vec::new(),
            _ => active_constraints(problem, &self.fit.best),
        };
        ConstraintSummary {
            max_violation: worst.map_or(0.0, |v| v.relative),
            active: active.into_iter().map(active_summary).collect(),
            slack: self.slack(),
        }
    }

    fn slack(&self) -> Vec<SlackSummary> {
        let theta = &self.fit.best.parameters;
        let broken = self.model.problem.soft.iter().filter_map(|group| {
            let (rows, largest) = group.slack(theta);
            (!rows.is_empty()).then(|| SlackSummary {
                name: group.name.clone(),
                rows: rows.len(),
                largest,
                penalty: group.price(theta),
            })
        });
        broken.collect()
    }

    fn weight_summary(&self) -> Option<WeightSummary> {
        let path = self.weights?;
        let rule = self.model.weight_rule.as_ref()?.rule;
        let picks = WeightPath::RULES.iter().zip(path.picks);
        let picks =
            picks.filter_map(|(rule, pick)| Some(((*rule).to_owned(), path.points[pick?].weight)));
        let bic = (rule == WeightRule::Bic).then(|| (rule.name().to_owned(), path.chosen_weight()));
        let point = |p: &PathPoint| PathPointSummary {
            weight: p.weight,
            iterations: p.iterations,
            misfit: p.misfit,
            roughness: p.roughness,
            degrees_of_freedom: p
                .degrees_of_freedom
                .is_finite()
                .then_some(p.degrees_of_freedom),
            bic: p.bic,
        };
        Some(WeightSummary {
            rule: rule.name().into(),
            weight: path.chosen_weight(),
            picks: picks.chain(bic).collect(),
            seed: path.seed,
            remark: path.remark.clone(),
            path: path.points.iter().map(point).collect(),
        })
    }

    fn penalty_summaries(&self) -> Vec<PenaltySummary> {
        let problem = &self.model.problem;
        let assessment = self.run_assessment.assessment.as_ref();
        let effective = assessment.and_then(|a| a.effective_parameters.as_ref());
        let each = problem.penalties.iter().enumerate();
        let summaries = each.map(|(i, penalty)| PenaltySummary {
            function: problem.functions.get(penalty.function).name(),
            order: penalty.order,
            weight: penalty.weight,
            rule: penalty.rule.map(|rule| rule.name().to_owned()),
            parameters: problem.functions.ranges()[penalty.function].len(),
            effective_parameters: effective.map(|all| all[i]),
        });
        summaries.collect()
    }

    /// All coefficient functions with their nodal values, those of single experiments last.
    pub(super) fn named_functions(&self) -> Vec<(&CoefficientFunction, Vec<f64>)> {
        let functions = &self.model.problem.functions;
        let values = functions.values(&self.fit.best.parameters);
        functions.iter().zip(values).collect()
    }

    fn experiment_summaries(&self) -> Vec<ExperimentSummary> {
        let predictions = &self.fit.best.evaluation.predictions;
        let pairs = self.model.problem.experiments.iter().zip(predictions);
        pairs
            .enumerate()
            .map(|(e, (experiment, predictions))| {
                let channels = 0..predictions.len();
                let channels: Vec<ChannelSummary> = channels
                    .map(|i| {
                        let view = self.channel_view(e, i);
                        fit_quality::channel(&view, self.samples_per_row(view.channel.len()))
                    })
                    .collect();
                let factor = match channels.is_empty() {
                    true => 1.0,
                    false => self.channel_view(e, 0).factor(),
                };
                ExperimentSummary {
                    name: experiment.name.clone(),
                    driven_by: driven_by(experiment.excitation.as_ref()),
                    samples: experiment.sample_count(),
                    rms_residual: channels
                        .first()
                        .map_or(f64::NAN, |first| factor * first.rms_residual),
                    channels,
                }
            })
            .collect()
    }

    /// SI unit of a function, for a rotation if the channels are angles; per unit of the mass if this is unknown.
    pub(super) fn unit(&self, function: &CoefficientFunction) -> &'static str {
        self.model.unit(function)
    }

    /// True if the channels are angles.
    pub(super) fn is_rotation(&self) -> bool {
        self.model.is_rotation()
    }

    /// A channel with its prediction.
    pub(super) fn channel_view(&self, experiment: usize, channel: usize) -> ChannelView<'_> {
        ChannelView {
            channel: &self.model.problem.experiments[experiment].channels[channel],
            predicted: &self.fit.best.evaluation.predictions[experiment][channel],
            note: self.note(experiment, channel),
            diagnostics: &self.run_assessment.diagnostics[experiment][channel],
        }
    }

    pub(super) fn note(&self, experiment: usize, channel: usize) -> Option<&ChannelNote> {
        self.model.notes.get(experiment)?.get(channel)
    }
}

/// Does `work` and adds its time to that of other threads.
fn timed_in<T>(of_threads: &Mutex<Duration>, work: impl FnOnce() -> T) -> T {
    let mut taken = Duration::ZERO;
    let found = timed(&mut taken, work);
    *of_threads.lock().unwrap_or_else(PoisonError::into_inner) += taken;
    found
}

/// A figure as a file: its name and its text.
fn svg(figure: &Figure) -> (String, String) {
    let name = format!("figures/{}.svg", figure.name);
    (name, render(figure))
}

fn driven_by(excitation: Option<&Excitation>) -> Vec<String> {
    let parts = excitation.map(|e| [("force", e.force(0)), ("base", e.frame(0))]);
    let acting = parts.into_iter().flatten();
    let acting = acting.filter(|(_, part)| part.is_some_and(|part| !part.is_zero()));
    acting.map(|(name, _)| name.to_owned()).collect()
}

fn active_summary(group: ActiveGroup) -> ActiveSummary {
    ActiveSummary {
        text: group.sentence(),
        name: group.name,
        rows: group.rows,
        spans: group.spans,
        multiplier: group.multiplier,
    }
}

fn attempt_summary(attempt: &Attempt) -> AttemptSummary {
    let known = |x: f64| x.is_finite().then_some(x);
    AttemptSummary {
        start: attempt.start.name().into(),
        initial_cost: known(attempt.initial_cost),
        cost: known(attempt.cost),
        iterations: attempt.history.len() as u64,
        status: attempt.outcome.status,
    }
}

/// Files of a fit that are written on request.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RequestedFiles {
    /// Figures and the page.
    pub figures: bool,
    /// One row per node in the tables over time.
    pub tables: bool,
}

impl RequestedFiles {
    /// Figures and the page only.
    pub fn figures() -> Self {
        Self {
            figures: true,
            ..Self::default()
        }
    }
}

/// Formatted JSON with a final newline. Numbers that JSON cannot represent become `null`.
pub fn json<T: serde::Serialize>(document: &T) -> String {
    // The documents are plain structs with text keys, which always serialise.
    let mut text = serde_json::to_string_pretty(document).unwrap_or_default();
    text.push('\n');
    text
}
