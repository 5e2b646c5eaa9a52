//! The figures of a fit.

use super::FittedModel;
use super::chart::Figure;
use super::document::ResultDocument;
use super::figures::{self, FunctionCurve};
use super::record_figures::{self, InputSeries};
use super::tables::FUNCTION_ROWS;
use crate::units::Unit;
use kmcfit_core::internals::record::ChannelKind;
use kmcfit_core::internals::solvers::IterationRecord;
use kmcfit_core::internals::threads::{analyses_at_once, both, map};

/// Figures of all channels with their titles.
#[derive(Debug, Clone, Default)]
pub struct ChannelFigures {
    /// Samples with the prediction, and residuals, of each channel, without its title.
    fits: Vec<[Figure; 2]>,
    /// Spectra, and frequency responses where one input acts.
    pub spectra: Vec<Figure>,
    /// Tests of the residuals.
    pub tests: Vec<Figure>,
}

/// What is computed before a report is written.
enum ReportPart {
    Document(Box<ResultDocument>),
    Fits(Vec<[Figure; 2]>),
    Tests(Vec<Figure>),
    Spectra(Vec<Figure>),
}

impl FittedModel<'_> {
    /// The figures of a fit.
    pub fn figures(&self) -> Vec<Figure> {
        let mut figures: Vec<Figure> = self.weights.map(figures::weight_path).into_iter().collect();
        figures.extend([
            self.convergence(),
            self.functions_figure(),
            self.ratios_figure(),
        ]);
        let drawn = self.drawn_channels();
        for ((experiment, channel), fit) in self.channels().into_iter().zip(&drawn.fits) {
            let mut list = self.channel_figures(experiment, channel, fit);
            let suffix = self.suffix(experiment, channel);
            list.iter_mut().for_each(|figure| figure.name += &suffix);
            figures.extend(list);
        }
        figures.extend(drawn.spectra.iter().chain(&drawn.tests).cloned());
        figures.extend(self.input_figures());
        figures.extend(self.validation_figures());
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

    /// Figures of all channels with their titles.
    pub(super) fn each_channel(&self, of: fn(&Self, usize, usize) -> Vec<Figure>) -> Vec<Figure> {
        let channels = self.channels().into_iter();
        channels
            .flat_map(|channel| self.of_channel(channel, of))
            .collect()
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
    pub(super) fn drawn_channels(&self) -> &ChannelFigures {
        self.computed.figures.get_or_init(|| {
            let tests = || self.each_channel(Self::channel_tests);
            let spectra = || self.each_channel(Self::channel_spectra);
            let ((fits, tests), spectra) = both(|| (self.fits(), tests()), spectra);
            ChannelFigures {
                fits,
                spectra,
                tests,
            }
        })
    }

    /// The result document, beside which the figures of the channels are drawn if figures are requested.
    pub fn document_and_figures(&self) -> ResultDocument {
        if !self.requested.figures {
            return self.document();
        }
        let channels = self.channels();
        // The longest first.
        let part = |i: usize| match i.checked_sub(channels.len()) {
            None => ReportPart::Spectra(self.of_channel(channels[i], Self::channel_spectra)),
            Some(0) => ReportPart::Document(Box::new(self.document())),
            Some(1) => ReportPart::Tests(self.each_channel(Self::channel_tests)),
            Some(_) => ReportPart::Fits(self.fits()),
        };
        let mut figures = ChannelFigures::default();
        let mut document = None;
        let threads = analyses_at_once(self.model.problem.sample_count());
        for part in map(channels.len() + 3, threads, part) {
            match part {
                ReportPart::Spectra(of_channel) => figures.spectra.extend(of_channel),
                ReportPart::Document(found) => document = Some(*found),
                ReportPart::Tests(found) => figures.tests = found,
                ReportPart::Fits(found) => figures.fits = found,
            }
        }
        self.computed.figures.get_or_init(|| figures);
        document.unwrap_or_else(|| self.document())
    }

    /// Samples with the prediction, and residuals, of each channel, without its title.
    fn fits(&self) -> Vec<[Figure; 2]> {
        let channels = self.channels().into_iter();
        let fits = channels.map(|(e, c)| self.channel_view(e, c).figures());
        fits.collect()
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
        let channels = self.channels().into_iter().zip(&self.drawn_channels().fits);
        let figures = channels.flat_map(|((e, c), fit)| {
            let titled = move |figure: &Figure| self.titled(figure.clone(), e, c);
            fit.iter().map(titled)
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
        let scale = |unit: Option<Unit>| unit.map_or(1.0, |unit| unit.factor());
        let force_unit = self.display.of_force();
        let force = |t: &f64| input.force_at(*t) / scale(force_unit);
        let force = input.force.as_ref().map(|_| InputSeries {
            label: "force",
            unit: force_unit.map_or(units[0], |unit| unit.symbol()),
            samples: times.iter().map(force).collect(),
        });
        let motion = |label, kind, unit| {
            let shown = self.display.of_channel(kind);
            let at = |t: &f64| Some(input.base_motion_at(kind, *t)? / scale(shown));
            let samples = times.iter().map(at);
            let samples = samples.collect::<Option<Vec<f64>>>()?;
            Some(InputSeries {
                label,
                unit: shown.map_or(unit, |unit| unit.symbol()),
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
    pub(super) fn input_figures(&self) -> Vec<Figure> {
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

    /// The figures of one channel: samples, samples with the response, residuals.
    fn channel_figures(
        &self,
        experiment: usize,
        index: usize,
        [beside, residuals]: &[Figure; 2],
    ) -> [Figure; 3] {
        let view = self.channel_view(experiment, index);
        let channel = view.channel;
        let beside = match channel.stride() {
            Some(_) if view.factor() == 1.0 => {
                self.response(experiment, channel.times(), channel.observed())
            }
            _ => beside.clone(),
        };
        [view.observation(), beside, residuals.clone()]
    }

    /// Validation records with their predictions and residuals.
    pub(super) fn validation_figures(&self) -> Vec<Figure> {
        let mut figures = Vec::new();
        for (i, held) in self.run_assessment.validation.iter().enumerate() {
            for view in held.channels(self.display) {
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

    pub(super) fn response(&self, experiment: usize, times: &[f64], observed: &[f64]) -> Figure {
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
            snapshots.push((last, grid_times, &response.displacement));
        }
        figures::response(times, observed, &snapshots)
    }

    /// The functions, at the nodes that their table has.
    pub(super) fn functions_figure(&self) -> Figure {
        let problem = &self.model.problem;
        let rows = |values: &[f64]| self.rows(values, FUNCTION_ROWS);
        let starts = problem.functions.values(&problem.start());
        let times = rows(&problem.system.grid.times());
        let bands = self
            .bands()
            .map_or(Vec::new(), |b| b.curves(&b.functions, &times));
        let panels = self.named_functions().into_iter().enumerate();
        let panels = panels.map(|(i, (function, found))| {
            let name = format!("{} {}", function.name(), function.quantity.symbol());
            let (found, start) = (rows(&found), rows(&starts[i]));
            let truth = self.true_function(i).map(rows);
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

    /// The ratios, at the nodes that their table has.
    pub(super) fn ratios_figure(&self) -> Figure {
        let found = self.ratio_rows(&self.fit.best.evaluation.nodal);
        let truth = self
            .model
            .truth
            .as_ref()
            .map(|truth| self.ratio_rows(truth));
        let times = self.rows(&self.model.problem.system.grid.times(), FUNCTION_ROWS);
        let bands = self
            .bands()
            .map_or(Vec::new(), |b| b.curves(&b.ratios, &times));
        figures::ratios(&times, &found, truth.as_ref(), &bands)
    }
}
