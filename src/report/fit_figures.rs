//! The figures of a fit.

use super::FittedModel;
use super::chart::Figure;
use super::document::ResultDocument;
use super::figures::{self, FunctionCurve};
use super::record_figures::{self, InputSeries};
use super::tables::FUNCTION_ROWS;
use kmcfit_core::identifiability::{Band, Bands};
use kmcfit_core::record::ChannelKind;
use kmcfit_core::solvers::IterationRecord;
use kmcfit_core::threads::{analyses_at_once, both, map};

/// Figures that both page and files have, drawn once.
#[derive(Debug, Clone)]
pub struct DrawnFigures {
    /// Those of each channel against time, without their titles.
    pub(super) channels: Vec<ChannelFigures>,
    /// Spectra, and frequency responses where one input acts.
    pub spectra: Vec<Figure>,
    /// Tests of the residuals.
    pub tests: Vec<Figure>,
    /// Coefficient functions.
    pub functions: Figure,
    /// Their ratios.
    pub ratios: Figure,
    /// Inputs of each driven experiment.
    pub inputs: Vec<Figure>,
    /// Validation records with their predictions and residuals.
    pub validation: Vec<Figure>,
}

/// Figures of a channel against time.
#[derive(Debug, Clone)]
pub(super) struct ChannelFigures {
    /// Samples with the prediction.
    pub samples: Figure,
    /// Residuals.
    pub residuals: Figure,
    /// Samples with the responses during the fit, of displacements at nodes in SI units.
    pub response: Option<Figure>,
}

impl FittedModel<'_> {
    /// The figures of a fit.
    pub fn figures(&self) -> Vec<Figure> {
        let mut figures: Vec<Figure> = self.weights.map(figures::weight_path).into_iter().collect();
        let drawn = self.drawn();
        figures.push(self.convergence());
        figures.extend([&drawn.functions, &drawn.ratios].map(Figure::clone));
        for ((experiment, channel), of_channel) in self.channels().into_iter().zip(&drawn.channels)
        {
            let beside = of_channel.response.as_ref();
            let beside = beside.unwrap_or(&of_channel.samples);
            let list = [beside, &of_channel.residuals];
            figures.extend(list.map(|figure| {
                let mut figure = figure.clone();
                figure.name += &self.suffix(experiment, channel);
                figure
            }));
        }
        let others = [
            &drawn.spectra,
            &drawn.tests,
            &drawn.inputs,
            &drawn.validation,
        ];
        figures.extend(others.into_iter().flatten().cloned());
        figures
    }

    /// Indices of the experiments and their channels.
    pub(super) fn channels(&self) -> Vec<(usize, usize)> {
        let experiments = self.model.problem.experiments.iter().enumerate();
        experiments
            .flat_map(|(e, experiment)| (0..experiment.channels.len()).map(move |c| (e, c)))
            .collect()
    }

    /// Adds experiment and channel to the name and title of a figure, if there are several channels.
    pub(super) fn titled(&self, mut figure: Figure, experiment: usize, channel: usize) -> Figure {
        figure.name += &self.suffix(experiment, channel);
        if self.channels().len() > 1 {
            let record = &self.model.problem.experiments[experiment];
            let kind = record.channels[channel].kind().name();
            figure.title = format!("{}: {}, {kind}", figure.title, record.name);
        }
        figure
    }

    /// Suffix for the names of the figures of one channel.
    fn suffix(&self, experiment: usize, channel: usize) -> String {
        let experiments = &self.model.problem.experiments;
        let number = match experiments.len() {
            1 => String::new(),
            _ => format!("-{}", experiment + 1),
        };
        match channel {
            0 => number,
            _ => format!(
                "{number}-{}",
                experiments[experiment].channels[channel].kind().name()
            ),
        }
    }

    /// Figures of a channel with their titles.
    fn of_channel(
        &self,
        (experiment, channel): (usize, usize),
        of: fn(&Self, usize, usize) -> Vec<Figure>,
    ) -> Vec<Figure> {
        let figures = of(self, experiment, channel).into_iter();
        figures
            .map(|figure| self.titled(figure, experiment, channel))
            .collect()
    }

    /// The figures that both page and files have, drawn once.
    pub(super) fn drawn(&self) -> &DrawnFigures {
        self.computed.figures.get_or_init(|| self.draw())
    }

    /// The result document, beside which the figures are drawn if figures are requested.
    pub fn document_and_figures(&self) -> ResultDocument {
        match self.requested.figures {
            true => both(|| self.document(), || self.drawn()).0,
            false => self.document(),
        }
    }

    fn draw(&self) -> DrawnFigures {
        let channels = self.channels();
        let threads = analyses_at_once(self.model.problem.sample_count());
        let spectra = map(channels.len(), threads, |i| {
            self.of_channel(channels[i], Self::channel_spectra)
        });
        let tests = |channel: &_| self.of_channel(*channel, Self::channel_tests);
        let figures = channels.iter().map(|(e, c)| self.channel_figures(*e, *c));
        DrawnFigures {
            channels: figures.collect(),
            spectra: spectra.into_iter().flatten().collect(),
            tests: channels.iter().flat_map(tests).collect(),
            functions: self.functions_figure(),
            ratios: self.ratios_figure(),
            inputs: self.input_figures(),
            validation: self.validation_figures(),
        }
    }

    /// Spectra of a channel, and its frequency response where one input acts.
    fn channel_spectra(&self, experiment: usize, channel: usize) -> Vec<Figure> {
        let view = self.channel_view(experiment, channel);
        let estimates = self.estimates().0;
        let mut frequency = estimates
            .iter()
            .filter(|(name, _)| name == "natural_frequency");
        let frequency = frequency.next().map(|(_, estimate)| estimate.value);
        view.spectra(&self.inputs(experiment, view.channel.times()), frequency)
    }

    /// Tests of the residuals of a channel.
    fn channel_tests(&self, experiment: usize, channel: usize) -> Vec<Figure> {
        let tests = self.channel_view(experiment, channel).residual_tests();
        tests.into_iter().collect()
    }

    /// Samples and residuals of all channels against time.
    pub(super) fn channel_fits(&self) -> Vec<Figure> {
        let channels = self.channels().into_iter().zip(&self.drawn().channels);
        let figures = channels.flat_map(|((e, c), of_channel)| {
            let fit = [&of_channel.samples, &of_channel.residuals];
            fit.map(|figure| self.titled(figure.clone(), e, c))
        });
        figures.collect()
    }

    /// Force and motion of the base at some times, in SI units.
    fn inputs(&self, experiment: usize, times: &[f64]) -> Vec<InputSeries> {
        let input = &self.model.problem.experiments[experiment].input;
        let units = match self.is_rotation() {
            true => ["N m", "rad", "rad/s²"],
            false => ["N", "m", "m/s²"],
        };
        let force = input.forces_at(times).map(|forces| InputSeries {
            label: "force",
            unit: units[0],
            samples: forces.to_vec(),
        });
        let motion = |label, kind, unit| {
            let samples = times.iter().map(|t| input.base_motion_at(kind, *t));
            let samples = samples.collect::<Option<Vec<f64>>>()?;
            Some(InputSeries {
                label,
                unit,
                samples,
            })
        };
        let base = input.base.as_ref().and_then(|_| {
            motion("base displacement", ChannelKind::Displacement, units[1])
                .or_else(|| motion("base acceleration", ChannelKind::Acceleration, units[2]))
        });
        force.into_iter().chain(base).collect()
    }

    /// The inputs of each driven experiment at the samples of its first channel.
    fn input_figures(&self) -> Vec<Figure> {
        let channels = self
            .channels()
            .into_iter()
            .filter(|(_, channel)| *channel == 0);
        let figures = channels.filter_map(|(e, c)| {
            let times = self.channel_view(e, c).channel.times();
            let inputs = self.inputs(e, times);
            let figure = record_figures::input(times, &inputs);
            (!inputs.is_empty()).then(|| {
                let mut figure = figure;
                figure.name += &self.suffix(e, c);
                let record = &self.model.problem.experiments[e];
                if self.model.problem.experiments.len() > 1 {
                    figure.title += &format!(" of {}", record.name);
                }
                figure
            })
        });
        figures.collect()
    }

    /// Figures of a channel against time.
    fn channel_figures(&self, experiment: usize, channel: usize) -> ChannelFigures {
        let view = self.channel_view(experiment, channel);
        let [samples, residuals] = view.figures();
        // The response is in SI units; a page has one unit for a quantity.
        let is_at_nodes = view.channel.stride().is_some() && view.factor() == 1.0;
        ChannelFigures {
            samples,
            residuals,
            response: is_at_nodes
                .then(|| self.response(experiment, view.channel.times(), view.channel.observed())),
        }
    }

    /// Validation records with their predictions and residuals.
    fn validation_figures(&self) -> Vec<Figure> {
        let mut figures = Vec::new();
        for (i, held) in self.run_assessment.validation.iter().enumerate() {
            for view in held.channels() {
                let kind = view.channel.kind().name();
                for mut figure in view.figures() {
                    figure.name += &format!("-validation-{}-{kind}", i + 1);
                    figure.title = format!(
                        "{}: {} (validation), {kind}",
                        figure.title, held.out.experiment.name
                    );
                    figures.push(figure);
                }
            }
        }
        figures
    }

    pub(super) fn convergence(&self) -> Figure {
        let column =
            |f: fn(&IterationRecord) -> f64| self.fit.history.iter().map(f).collect::<Vec<_>>();
        figures::convergence(
            &column(|r| r.iteration as f64),
            &column(|r| r.cost_ratio),
            &column(|r| r.gradient_norm_squared_ratio),
        )
    }

    fn response(&self, experiment: usize, times: &[f64], observed: &[f64]) -> Figure {
        let grid_times = self.model.problem.system.grid.times();
        let nodes = self.model.problem.experiments[experiment].nodes;
        let grid_times = &grid_times[..nodes];
        let mut snapshots: Vec<(usize, &[f64], &[f64])> = (self.fit.snapshots.iter())
            .map(|s| {
                let displacement = s.displacements[experiment].as_slice();
                (s.iteration as usize, grid_times, displacement)
            })
            .collect();
        let last = self.fit.history.len();
        if snapshots.last().is_none_or(|s| s.0 != last) {
            let response = &self.fit.best.evaluation.trajectories[experiment];
            snapshots.push((last, grid_times, response.displacement(0)));
        }
        figures::response(times, observed, &snapshots)
    }

    /// The functions, at the nodes that their table has.
    fn functions_figure(&self) -> Figure {
        let problem = &self.model.problem;
        let rows = |values: &[f64]| self.rows(values, FUNCTION_ROWS);
        let starts = problem.functions.values(&problem.start());
        let times = rows(&problem.system.grid.times());
        let bands = self.band_curves(|bands| &bands.functions, &times);
        let panels = self.named_functions().into_iter().enumerate();
        let panels = panels.map(|(i, (function, found))| {
            let name = format!("{} {}", function.name(), function.quantity.symbol());
            let (found, start) = (rows(&found), rows(&starts[i]));
            let truth = self
                .model
                .truth
                .as_ref()
                .and_then(|truth| truth.functions().nth(i));
            let truth = truth.map(rows);
            let curve = FunctionCurve {
                band: bands.get(i).map(|[low, high]| (&low[..], &high[..])),
                start: Some(&start),
                truth: truth.as_deref(),
                ..FunctionCurve::new(&name, self.unit(function), &found)
            };
            curve.panel(&times)
        });
        figures::functions(panels)
    }

    /// Ends of some bands at these times; none without bands.
    fn band_curves(&self, of: fn(&Bands) -> &Vec<Band>, times: &[f64]) -> Vec<[Vec<f64>; 2]> {
        let bands = self.bands().into_iter();
        let curves = bands.flat_map(|b| of(b).iter().map(|band| band.curves(&b.times, times)));
        curves.collect()
    }

    /// The ratios, at the nodes that their table has.
    fn ratios_figure(&self) -> Figure {
        let found = self.ratio_rows(&self.fit.best.evaluation.nodal);
        let truth = self
            .model
            .truth
            .as_ref()
            .map(|truth| self.ratio_rows(truth));
        let times = self.rows(&self.model.problem.system.grid.times(), FUNCTION_ROWS);
        let bands = self.band_curves(|bands| &bands.ratios, &times);
        figures::ratios(&times, &found, truth.as_ref(), &bands)
    }
}
