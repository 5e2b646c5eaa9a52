//! What a fit leaves behind: tables, figures and the result document.

use super::cost::{CostKind, cost_definition};
use super::csv::CsvTable;
use super::document::{
    ActiveSummary, ConstraintSummary, CostSummary, CountsSummary, ExperimentSummary, FORMAT,
    FunctionSummary, GradientSummary, IdentifiabilitySummary, ModelSummary, OutcomeSummary,
    PathSummary, Prediction, ResultDocument, RungSummary, SlackSummary, WeightSummary,
};
use super::files::Stage;
use super::knowledge::knowledge;
use super::meaning::Doubts;
use super::measured::{self, ChannelSummary, HalfStep, StatisticsSummary};
use super::page::fit_page;
use super::render;
use super::timings::TimingsSummary;
use crate::config::{ChannelNote, Model};
use crate::diagnostics::rms;
use crate::dynamics::Term;
use crate::functions::basis::physical_powers;
use crate::functions::{Basis, CoefficientFunction, Ratios};
use crate::identifiability::{BandSettings, Bands, count, verdicts};
use crate::solvers::{
    ActiveGroup, Fit, PathPoint, Row, Rung, Solver, Status, WeightPath, WeightRule,
    active_constraints, timed,
};
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use std::io;
use std::time::Duration;

/// Up to so many free values the bands are computed with every fit: some milliseconds.
const FEW_PARAMETERS: usize = 64;

/// A fitted model and what it predicts.
#[derive(Debug, Clone, Copy)]
pub struct FittedModel<'a> {
    /// What was fitted.
    pub model: &'a Model,
    /// What was found.
    pub fit: &'a Fit,
    /// The motion of the found device from other initial states.
    pub predictions: &'a [Prediction],
    /// The path on which the weight of the smoothness was chosen, if by a rule.
    pub weights: Option<&'a WeightPath>,
    /// How well the readings determine what was found.
    pub known: &'a Known,
}

/// How well the readings determine what was found, for models of few free values: computed once, told in
/// several places.
#[derive(Debug, Clone, Default)]
pub struct Known {
    covariance: Option<DMatrix<f64>>,
    bands: Option<Bands>,
}

impl Known {
    /// For a simulated motion and up to 64 free values; nothing for others.
    pub fn of(model: &Model, fit: &Fit) -> Self {
        let (problem, best) = (&model.problem, &fit.best);
        let few = (1..=FEW_PARAMETERS).contains(&problem.parameters());
        let is_simulated = model.settings.solver != Solver::EquationError;
        if !(few && is_simulated && problem.reading_count() > problem.parameters()) {
            return Self::default();
        }
        let settings = BandSettings {
            draws: 0,
            ..BandSettings::default()
        };
        Self {
            covariance: problem.covariance(&best.evaluation),
            bands: Some(Bands::at(
                problem,
                &best.parameters,
                &best.evaluation,
                &settings,
            )),
        }
    }
}

impl FittedModel<'_> {
    /// Writes tables and, if asked for, figures and the page of `document`: all but the result document
    /// itself, which comes last ([`Stage::commit_run`]). Returns what the writing took.
    ///
    /// # Errors
    /// What the file system says.
    pub fn write(
        &self,
        stage: &mut Stage,
        document: &ResultDocument,
        with_figures: bool,
    ) -> io::Result<Duration> {
        let mut writing = Duration::ZERO;
        let mut batch = stage.batch();
        let mut write = |name: &str, text: &str| timed(&mut writing, || batch.write(name, text));
        write("history.csv", &self.history().to_csv())?;
        write("functions.csv", &self.functions_table().to_csv())?;
        write("trajectory.csv", &self.trajectories().to_csv())?;
        for (name, table) in self.readings() {
            write(&name, &table.to_csv())?;
        }
        if with_figures {
            for figure in self.figures() {
                write(&format!("figures/{}.svg", figure.name), &render(&figure))?;
            }
            write("report.html", &self.page(document))?;
        }
        timed(&mut writing, || batch.finish())?;
        Ok(writing)
    }

    /// The page that people keep, of the run and its document: one HTML file that loads nothing.
    pub fn page(&self, document: &ResultDocument) -> String {
        fit_page(self, document)
    }

    /// The result document.
    pub fn document(&self) -> ResultDocument {
        let (model, fit) = (self.model, self.fit);
        let half_step = match self.is_simulated() {
            true => measured::refined(&model.problem, &fit.best.evaluation),
            false => Ok(None),
        };
        let statistics = match self.is_simulated() {
            true => measured::statistics(&model.problem, &fit.best.evaluation),
            false => StatisticsSummary::default(),
        };
        ResultDocument {
            format: FORMAT,
            title: model.title.clone(),
            version: env!("CARGO_PKG_VERSION").into(),
            model: self.model_summary(),
            outcome: OutcomeSummary {
                status: fit.outcome.status.name().into(),
                reason: fit.outcome.reason.clone(),
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
            counts: CountsSummary {
                iterations: fit.history.len() as u64,
                forward: fit.counts.forward,
                adjoint: fit.counts.adjoint,
                tangent: fit.counts.tangent,
                qp: fit.counts.qp,
            },
            seconds: fit.elapsed.as_secs_f64(),
            timings: TimingsSummary::new(fit, Duration::ZERO, fit.elapsed),
            functions: self.function_summaries(),
            constraints: self.constraint_summary(),
            identifiability: self.identifiability(&half_step, &statistics),
            weights: self.weight_summary(),
            rungs: self.fit.rungs.iter().map(rung_summary).collect(),
            experiments: self.experiment_summaries(),
            held_out: measured::held_out(model, fit),
            scalars: match self.is_simulated() {
                true => {
                    let covariance = self.known.covariance.as_ref();
                    measured::scalars(&model.problem, &fit.best.evaluation, covariance)
                }
                false => Vec::new(),
            },
            statistics,
            half_step: half_step.unwrap_or_default(),
            remarks: model.remarks.clone(),
            predictions: self.predictions.to_vec(),
            warnings: model.warnings.clone(),
        }
    }

    /// Whether the fit compares a simulated motion with the readings, and not the equation of motion.
    pub(super) fn is_simulated(&self) -> bool {
        self.model.settings.solver != Solver::EquationError
    }

    /// The bands of functions and ratios, for models of few free values.
    pub(super) fn bands(&self) -> Option<&Bands> {
        self.known.bands.as_ref()
    }

    /// What was known before the fit, and what its optimum tells, if that is a device at all; the equation error has no
    /// simulated motion to count about.
    fn identifiability(
        &self,
        half_step: &HalfStep,
        statistics: &StatisticsSummary,
    ) -> IdentifiabilitySummary {
        let problem = &self.model.problem;
        let knowledge = knowledge(problem);
        if !self.is_simulated() {
            let sentence = "how sure the functions are is not known: the equation error simulates no motion, and noise \
                            biases it; method: gauss-newton, with initial: data, goes on from it";
            return IdentifiabilitySummary {
                of: problem.parameters(),
                verdicts: vec![sentence.into()],
                knowledge,
                ..IdentifiabilitySummary::default()
            };
        }
        let count = count(problem);
        let evaluation = &self.fit.best.evaluation;
        let mut doubts = Doubts::of(problem, evaluation, half_step, statistics);
        if self.fit.outcome.status == Status::Failed {
            doubts.no_device = Some("the device is not identified: the fit failed".into());
            doubts.errors_hold = false;
        }
        let bands = self.known.bands.as_ref().filter(|_| doubts.errors_hold);
        let judged = bands.map_or(Vec::new(), |bands| verdicts(problem, evaluation, bands));
        IdentifiabilitySummary {
            seen: count.seen_at_most,
            of: count.of,
            verdicts: match doubts.no_device {
                Some(why) => vec![why],
                None => count.sentences.into_iter().chain(doubts.open).collect(),
            },
            knowledge,
            functions: judged.into_iter().map(|j| j.sentence).collect(),
        }
    }

    fn model_summary(&self) -> ModelSummary {
        let problem = &self.model.problem;
        let grid = &problem.oscillator.grid;
        ModelSummary {
            file: self.model.file.display().to_string(),
            overrides: self.model.source.overrides.clone(),
            nodes: grid.nodes(),
            start: grid.start(),
            duration: grid.duration(),
            step: grid.step(),
            stepper: problem.oscillator.method.name().into(),
            method: self.model.settings.solver.name().into(),
            gradient: self.model.settings.gradient.name().into(),
            parameters: problem.parameters(),
            terms: (problem.functions.assembly(0).iter().skip(1))
                .map(|f| problem.functions.get(*f).quantity.name().into())
                .collect(),
            friction_width: problem.oscillator.terms.iter().find_map(|t| match t {
                Term::CoulombFriction { width } => Some(*width),
                _ => None,
            }),
            cost_kind: CostKind::of(problem, self.model.settings.solver),
            cost_definition: cost_definition(problem, self.model.settings.solver),
        }
    }

    fn constraint_summary(&self) -> ConstraintSummary {
        let problem = &self.model.problem;
        let worst = problem
            .constraints
            .largest_violation(&self.fit.best.parameters);
        // What pushes where is a matter of points that satisfy the constraints.
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
                price: group.price(theta),
            })
        });
        broken.collect()
    }

    fn weight_summary(&self) -> Option<WeightSummary> {
        let path = self.weights?;
        let rule = self.model.weight_rule.as_ref()?.rule;
        let picks = WeightRule::ALL
            .iter()
            .zip(path.picks)
            .filter_map(|(rule, pick)| Some((rule.name().to_string(), path.points[pick?].weight)));
        let point = |p: &PathPoint| PathSummary {
            weight: p.weight,
            iterations: p.iterations,
            misfit: p.misfit,
            roughness: p.roughness,
            degrees_of_freedom: p
                .degrees_of_freedom
                .is_finite()
                .then_some(p.degrees_of_freedom),
        };
        Some(WeightSummary {
            rule: rule.name().into(),
            weight: path.chosen_weight(),
            picks: picks.collect(),
            seed: path.seed,
            remark: path.remark.clone(),
            path: path.points.iter().map(point).collect(),
        })
    }

    /// All functions with what they are and what they are called, those of single experiments last.
    pub(super) fn named_functions(&self) -> Vec<(&CoefficientFunction, Vec<f64>)> {
        let functions = &self.model.problem.functions;
        let values = functions.values(&self.fit.best.parameters);
        functions.iter().zip(values).collect()
    }

    pub(super) fn true_function(&self, index: usize) -> Option<&[f64]> {
        self.model.truth.as_ref()?.functions().nth(index)
    }

    fn function_summaries(&self) -> BTreeMap<String, FunctionSummary> {
        let problem = &self.model.problem;
        let list = self.named_functions().into_iter().enumerate();
        list.map(|(i, (function, values))| {
            let index = problem.functions.ranges()[i].start;
            let summary = FunctionSummary {
                powers: self.powers(i),
                standard_error: measured::standard_error(
                    function,
                    index,
                    self.known.covariance.as_ref(),
                ),
                ..summarise(&values, self.true_function(i))
            };
            (function.name(), summary)
        })
        .collect()
    }

    /// The factors of the powers of t, if function `index` is a free polynomial.
    fn powers(&self, index: usize) -> Option<Vec<f64>> {
        let problem = &self.model.problem;
        let function = problem.functions.iter().nth(index)?;
        let Some(Basis::Polynomial { .. }) = &function.basis else {
            return None;
        };
        let range = problem.functions.ranges()[index].clone();
        let theta = &self.fit.best.parameters[range];
        Some(physical_powers(&problem.oscillator.grid, theta))
    }

    fn experiment_summaries(&self) -> Vec<ExperimentSummary> {
        let predictions = &self.fit.best.evaluation.predictions;
        let pairs = self.model.problem.experiments.iter().zip(predictions);
        pairs
            .enumerate()
            .map(|(e, (experiment, predictions))| {
                let channels = experiment.channels.iter().zip(predictions).enumerate();
                let channels: Vec<ChannelSummary> = channels
                    .map(|(i, (c, predicted))| measured::channel(c, self.note(e, i), predicted))
                    .collect();
                let first = experiment.channels.iter().zip(predictions).next();
                ExperimentSummary {
                    name: experiment.name.clone(),
                    readings: experiment.reading_count(),
                    rms_residual: first.map_or(f64::NAN, |(c, predicted)| {
                        rms(&c.residuals(predicted).collect::<Vec<f64>>())
                    }),
                    channels,
                }
            })
            .collect()
    }

    /// SI unit of a function: of a rotation if the channels are.
    pub(super) fn unit(&self, function: &CoefficientFunction) -> &'static str {
        let mut units = self.model.notes.iter().flatten().map(|note| note.unit);
        match units.any(|unit| unit.is_angular()) {
            true => function.quantity.angular_unit(),
            false => function.quantity.unit(),
        }
    }

    pub(super) fn note(&self, experiment: usize, channel: usize) -> Option<&ChannelNote> {
        self.model.notes.get(experiment)?.get(channel)
    }

    fn history(&self) -> CsvTable {
        let column = |f: fn(&Row) -> f64| self.fit.history.iter().map(f).collect();
        CsvTable::new()
            .column("iteration", column(|r| r.iteration as f64))
            .column("cost", column(|r| r.cost))
            .column("cost_ratio", column(|r| r.cost_ratio))
            .column(
                "gradient_norm_squared_ratio",
                column(|r| r.gradient_norm_squared_ratio),
            )
            .column("step", column(|r| r.step))
            .column("relative_change", column(|r| r.relative_change))
    }

    fn functions_table(&self) -> CsvTable {
        let device = &self.fit.best.evaluation.device;
        let times = self.model.problem.oscillator.grid.times();
        let mut table = CsvTable::new().column("t_s", times);
        for (function, values) in self.named_functions() {
            let column = function.quantity.column();
            let name = match &function.owner {
                None => column.to_owned(),
                // A comma would end the header.
                Some(owner) => format!("{column} of {}", owner.replace([',', '"', '\n'], " ")),
            };
            table = table.column(name, values);
        }
        let ratios = Ratios::of(device);
        table = table
            .column("k_over_m_per_s2", ratios.k_over_m)
            .column("c_over_m_per_s", ratios.c_over_m)
            .column("natural_frequency_Hz", ratios.frequency)
            .column("damping_ratio", ratios.damping_ratio);
        if let Some(bands) = &self.known.bands {
            for band in bands.functions.iter().chain(&bands.ratios) {
                let name = band.name.replace([' ', '/', ','], "_");
                let ends = |side: usize| -> Vec<f64> {
                    (0..band.values.len())
                        .map(|i| band.pointwise(i)[side])
                        .collect()
                };
                table = table
                    .column(format!("{name}_low_95"), ends(0))
                    .column(format!("{name}_high_95"), ends(1));
            }
        }
        if let Some(truth) = &self.model.truth {
            let functions = self.model.problem.functions.iter();
            for (function, values) in functions.zip(truth.functions()) {
                let name = format!("true_{}", function.quantity.column());
                table = table.column(name, values.to_vec());
            }
        }
        table
    }

    fn trajectories(&self) -> CsvTable {
        let problem = &self.model.problem;
        let mut table = CsvTable::new().column("t_s", problem.oscillator.grid.times());
        let several = problem.experiments.len() > 1;
        let motions = problem
            .experiments
            .iter()
            .zip(&self.fit.best.evaluation.trajectories);
        for (i, (experiment, motion)) in motions.enumerate() {
            let name = |column: &str| match several {
                true => format!("{column}_{}", i + 1),
                false => column.to_string(),
            };
            // A record may end before the grid does.
            let full = |values: &[f64]| {
                let mut values = values.to_vec();
                values.resize(problem.oscillator.grid.nodes(), f64::NAN);
                values
            };
            table = table
                .column(name("y_m"), full(&motion.displacement))
                .column(name("v_m_per_s"), full(&motion.velocity));
            if let [channel] = experiment.channels.as_slice()
                && let Some(stride) = channel.stride()
            {
                let mut observed = vec![f64::NAN; problem.oscillator.grid.nodes()];
                for (i, value) in channel.observed().iter().enumerate() {
                    observed[i * stride] = *value;
                }
                table = table.column(name("observed_y_m"), observed);
            }
        }
        table
    }

    /// The readings of each channel beside what the model says of them, in the unit of the file, and
    /// the names of the tables.
    fn readings(&self) -> Vec<(String, CsvTable)> {
        let mut tables = Vec::new();
        let predictions = &self.fit.best.evaluation.predictions;
        let experiments = self.model.problem.experiments.iter().zip(predictions);
        for (e, (experiment, predictions)) in experiments.enumerate() {
            for (c, (channel, predicted)) in experiment.channels.iter().zip(predictions).enumerate()
            {
                let factor = self.note(e, c).map_or(1.0, |n| n.unit.factor());
                let scaled = |values: &mut dyn Iterator<Item = f64>| -> Vec<f64> {
                    values.map(|v| v / factor).collect()
                };
                let table = CsvTable::new()
                    .column("t_s", channel.times().to_vec())
                    .column("reading", scaled(&mut channel.observed().iter().copied()))
                    .column("model", scaled(&mut predicted.iter().copied()))
                    .column("residual", scaled(&mut channel.residuals(predicted)));
                let name = format!("readings/{}-{}.csv", e + 1, channel.kind().name());
                tables.push((name, table));
            }
        }
        tables
    }
}

fn active_summary(group: ActiveGroup) -> ActiveSummary {
    ActiveSummary {
        sentence: group.sentence(),
        name: group.name,
        rows: group.rows,
        spans: group.spans,
        multiplier: group.multiplier,
    }
}

fn rung_summary(rung: &Rung) -> RungSummary {
    let known = |x: f64| x.is_finite().then_some(x);
    RungSummary {
        start: rung.name.into(),
        initial_cost: known(rung.initial_cost),
        cost: known(rung.cost),
        iterations: rung.iterations,
        status: rung.outcome.status.name().into(),
    }
}

fn summarise(values: &[f64], truth: Option<&[f64]>) -> FunctionSummary {
    let errors = |truth: &[f64]| -> Vec<f64> {
        values
            .iter()
            .zip(truth)
            .map(|(a, b)| (a - b).abs())
            .collect()
    };
    let errors = truth.map(errors);
    FunctionSummary {
        min: values.iter().copied().fold(f64::INFINITY, f64::min),
        max: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        truth_max_error: errors
            .as_ref()
            .map(|e| e.iter().copied().fold(0.0, f64::max)),
        powers: None,
        standard_error: None,
        truth_rms_error: errors
            .map(|e| (e.iter().map(|e| e * e).sum::<f64>() / e.len() as f64).sqrt()),
    }
}

/// Pretty JSON with a final newline. Numbers that JSON cannot hold become `null`.
pub fn json<T: serde::Serialize>(document: &T) -> String {
    // The documents are plain structs with text keys, which always serialise.
    let mut text = serde_json::to_string_pretty(document).unwrap_or_default();
    text.push('\n');
    text
}
