//! What a fit leaves behind: tables, figures and the result document.

use super::cost::{CostKind, cost_definition};
use super::csv::CsvTable;
use super::document::{
    ActiveSummary, ConstraintSummary, CostSummary, CountsSummary, ExperimentSummary, FORMAT,
    FunctionSummary, GradientSummary, ModelSummary, OutcomeSummary, PathSummary, Prediction,
    ResultDocument, RungSummary, SlackSummary, WeightSummary,
};
use super::figure::Figure;
use super::figures::{self, FunctionCurve, RatioCurves};
use super::files::OutputFolder;
use super::render;
use crate::config::Model;
use crate::dynamics::Device;
use crate::functions::basis::physical_powers;
use crate::functions::{Basis, Quantity, Ratios};
use crate::solvers::{
    ActiveGroup, Fit, PathPoint, Row, Rung, Status, WeightPath, WeightRule, active_constraints,
};
use std::collections::BTreeMap;
use std::io;

/// A fitted model and what it predicts.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    /// What was fitted.
    pub model: &'a Model,
    /// What was found.
    pub fit: &'a Fit,
    /// The motion of the found device from other initial states.
    pub predictions: &'a [Prediction],
    /// The path on which the weight of the smoothness was chosen, if by a rule.
    pub weights: Option<&'a WeightPath>,
}

impl Run<'_> {
    /// Writes tables and, if asked for, figures; the result `document` last, so that a folder with a
    /// result is complete.
    ///
    /// # Errors
    /// What the file system says.
    pub fn write(
        &self,
        folder: &OutputFolder,
        document: &ResultDocument,
        with_figures: bool,
    ) -> io::Result<()> {
        folder.write("history.csv", &self.history().to_csv())?;
        folder.write("functions.csv", &self.functions_table().to_csv())?;
        folder.write("trajectory.csv", &self.trajectories().to_csv())?;
        let figures = if with_figures {
            self.figures()
        } else {
            Vec::new()
        };
        for figure in figures {
            folder.write(&format!("figures/{}.svg", figure.name), &render(&figure))?;
        }
        folder.write("result.json", &json(document))
    }

    /// The result document.
    pub fn document(&self) -> ResultDocument {
        let (model, fit) = (self.model, self.fit);
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
            functions: self.function_summaries(),
            constraints: self.constraint_summary(),
            weights: self.weight_summary(),
            rungs: self.fit.rungs.iter().map(rung_summary).collect(),
            experiments: self.experiment_summaries(),
            predictions: self.predictions.to_vec(),
            warnings: model.warnings.clone(),
        }
    }

    fn model_summary(&self) -> ModelSummary {
        let problem = &self.model.problem;
        let grid = &problem.oscillator.grid;
        ModelSummary {
            nodes: grid.nodes(),
            start: grid.start(),
            duration: grid.duration(),
            step: grid.step(),
            stepper: problem.oscillator.method.name().into(),
            method: self.model.settings.solver.name().into(),
            gradient: self.model.settings.gradient.name().into(),
            parameters: problem.functions.parameters(),
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

    fn named_functions(&self) -> impl Iterator<Item = (Quantity, &[f64])> {
        let quantities = self.model.problem.functions.iter().map(|f| f.quantity);
        quantities.zip(self.fit.best.evaluation.device.functions())
    }

    fn true_function(&self, index: usize) -> Option<&[f64]> {
        self.model.truth.as_ref()?.functions().nth(index)
    }

    fn function_summaries(&self) -> BTreeMap<String, FunctionSummary> {
        let summary = |(i, (quantity, values)): (usize, (Quantity, &[f64]))| {
            let summary = FunctionSummary {
                powers: self.powers(i),
                ..summarise(values, self.true_function(i))
            };
            (quantity.name().to_string(), summary)
        };
        self.named_functions().enumerate().map(summary).collect()
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
            .filter_map(|(experiment, predictions)| {
                let (channel, predicted) = experiment.channels.iter().zip(predictions).next()?;
                let squares = channel.residuals(predicted).map(|r| r * r);
                Some(ExperimentSummary {
                    name: experiment.name.clone(),
                    readings: channel.len(),
                    rms_residual: (squares.sum::<f64>() / channel.len() as f64).sqrt(),
                })
            })
            .collect()
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
        for (quantity, values) in self.named_functions() {
            table = table.column(quantity.column(), values.to_vec());
        }
        let ratios = Ratios::of(device);
        table = table
            .column("k_over_m_per_s2", ratios.k_over_m)
            .column("c_over_m_per_s", ratios.c_over_m)
            .column("natural_frequency_Hz", ratios.frequency)
            .column("damping_ratio", ratios.damping_ratio);
        if let Some(truth) = &self.model.truth {
            for ((quantity, _), values) in self.named_functions().zip(truth.functions()) {
                table = table.column(format!("true_{}", quantity.column()), values.to_vec());
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
            table = table
                .column(name("y_m"), motion.displacement.clone())
                .column(name("v_m_per_s"), motion.velocity.clone());
            if let [channel] = experiment.channels.as_slice()
                && let Some(stride) = channel.stride()
            {
                let mut observed = vec![f64::NAN; motion.displacement.len()];
                for (i, value) in channel.observed().iter().enumerate() {
                    observed[i * stride] = *value;
                }
                table = table.column(name("observed_y_m"), observed);
            }
        }
        table
    }

    /// The figures of a fit.
    pub fn figures(&self) -> Vec<Figure> {
        let mut figures: Vec<Figure> = self.weights.map(figures::weight_path).into_iter().collect();
        figures.extend([
            self.convergence(),
            self.functions_figure(),
            self.ratios_figure(),
        ]);
        let problem = &self.model.problem;
        let several = problem.experiments.len() > 1;
        for (i, experiment) in problem.experiments.iter().enumerate() {
            let Some(channel) = experiment.channels.first() else {
                continue;
            };
            let times = channel.times();
            for mut figure in [
                figures::observation(&[("displacement y", "m", times, channel.observed())]),
                self.motion(i, times, channel.observed()),
            ] {
                if several {
                    figure.name = format!("{}-{}", figure.name, i + 1);
                }
                figures.push(figure);
            }
        }
        figures
    }

    fn convergence(&self) -> Figure {
        let column = |f: fn(&Row) -> f64| self.fit.history.iter().map(f).collect::<Vec<_>>();
        figures::convergence(
            &column(|r| r.iteration as f64),
            &column(|r| r.cost_ratio),
            &column(|r| r.gradient_norm_squared_ratio),
        )
    }

    fn motion(&self, experiment: usize, times: &[f64], observed: &[f64]) -> Figure {
        let grid_times = self.model.problem.oscillator.grid.times();
        let mut snapshots: Vec<(usize, &[f64], &[f64])> = (self.fit.snapshots.iter())
            .map(|s| {
                let motion = &s.trajectories[experiment];
                (
                    s.iteration as usize,
                    grid_times.as_slice(),
                    motion.displacement.as_slice(),
                )
            })
            .collect();
        let last = self.fit.history.len();
        if snapshots.last().is_none_or(|s| s.0 != last) {
            let motion = &self.fit.best.evaluation.trajectories[experiment];
            snapshots.push((last, &grid_times, &motion.displacement));
        }
        figures::motion(times, observed, &snapshots)
    }

    fn functions_figure(&self) -> Figure {
        let problem = &self.model.problem;
        let start: Device = problem.functions.device(&problem.functions.start());
        let names: Vec<String> = self
            .named_functions()
            .map(|(q, _)| format!("{} {}", q.name(), q.symbol()))
            .collect();
        let starts: Vec<&[f64]> = start.functions().collect();
        let curves: Vec<FunctionCurve> = (self.named_functions().enumerate())
            .map(|(i, (quantity, found))| FunctionCurve {
                start: Some(starts[i]),
                truth: self.true_function(i),
                ..FunctionCurve::new(&names[i], quantity.unit(), found)
            })
            .collect();
        figures::functions(&problem.oscillator.grid.times(), &curves)
    }

    fn ratios_figure(&self) -> Figure {
        let found = Ratios::of(&self.fit.best.evaluation.device);
        let truth = self.model.truth.as_ref().map(Ratios::of);
        figures::ratios(
            &self.model.problem.oscillator.grid.times(),
            &curves(&found),
            truth.as_ref().map(curves).as_ref(),
        )
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

fn curves(ratios: &Ratios) -> RatioCurves<'_> {
    RatioCurves {
        k_over_m: &ratios.k_over_m,
        c_over_m: &ratios.c_over_m,
        frequency: &ratios.frequency,
        damping_ratio: &ratios.damping_ratio,
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
