//! A channel with its prediction: figures and table in the unit of the file.

use super::chart::Figure;
use super::csv::CsvTable;
use super::figures;
use super::record_figures::{self, InputSeries, SeriesPair, frequency_response, spectrum};
use crate::config::ChannelNote;
use crate::units::Unit;
use kmcfit_core::diagnostics::{ResidualDiagnostics, Whiteness};
use kmcfit_core::record::{Channel, Weighting};
use kmcfit_core::signal::even_spacing;

/// Size of residuals relative to the samples below which they are rounding errors.
const ROUNDING: f64 = 1e-10;

/// A channel, its prediction, and its notes for reports.
#[derive(Debug, Clone, Copy)]
pub(super) struct ChannelView<'a> {
    pub channel: &'a Channel,
    pub predicted: &'a [f64],
    pub note: Option<&'a ChannelNote>,
    pub diagnostics: &'a ResidualDiagnostics,
}

impl ChannelView<'_> {
    /// Unit of the file.
    fn shown(&self) -> Option<Unit> {
        self.note.map(|note| note.unit)
    }

    /// Factor from the unit shown to SI.
    pub fn factor(&self) -> f64 {
        self.shown().map_or(1.0, |unit| unit.factor())
    }

    /// Unit in which reports give the channel.
    pub fn unit(&self) -> &str {
        self.note
            .map_or(self.channel.kind().unit(), |note| note.unit.symbol())
    }

    /// Standard deviation of a sample in this unit; `None` if it differs between samples, and without one.
    pub fn sigma(&self) -> Option<f64> {
        match self.channel.weighting() {
            Weighting::Sigma(sigma) | Weighting::Estimated { sigma } => Some(sigma / self.factor()),
            Weighting::Sigmas(_) | Weighting::Integral { .. } | Weighting::Trapezoid(_) => None,
        }
    }

    fn scaled(&self, values: impl Iterator<Item = f64>) -> Vec<f64> {
        let factor = self.factor();
        values.map(|v| v / factor).collect()
    }

    fn observed(&self) -> Vec<f64> {
        self.scaled(self.channel.observed().iter().copied())
    }

    fn model(&self) -> Vec<f64> {
        self.scaled(self.predicted.iter().copied())
    }

    fn residuals(&self) -> Vec<f64> {
        self.scaled(self.channel.residuals(self.predicted))
    }

    fn label(&self) -> String {
        let kind = self.channel.kind();
        format!("{} {}", kind.name(), kind.symbol())
    }

    /// Figures of the samples with the prediction, and of the residuals.
    pub fn figures(&self) -> [Figure; 2] {
        let (label, unit) = (self.label(), self.unit());
        let label = (label.as_str(), unit);
        let times = self.channel.times();
        [
            figures::channel(label, times, self.observed(), || self.model()),
            figures::residuals(
                label,
                times,
                &self.residuals(),
                self.sigma(),
                &sentence(&self.whiteness()),
            ),
        ]
    }

    /// Result of the test of whiteness; rounding errors are not tested.
    fn whiteness(&self) -> String {
        let squares = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>();
        match squares(&self.residuals()) <= ROUNDING * ROUNDING * squares(&self.observed()) {
            true => "the residuals are rounding errors of samples without noise".to_owned(),
            false => whiteness(self.channel, &self.diagnostics.whiteness),
        }
    }

    /// Figure of the test of the residuals, or of the innovations of correlated noise.
    pub fn residual_tests(&self) -> Option<Figure> {
        let name = match self.channel.correlation() {
            None => "residuals",
            Some(_) => "innovations",
        };
        record_figures::residual_tests(name, self.diagnostics, &self.whiteness())
    }

    /// Figures of the spectra, and of the frequency response to an only input at the samples, with the undamped natural frequency
    /// `mark`; none for samples at unequal times.
    pub fn spectra(&self, inputs: &[InputSeries], mark: Option<f64>) -> Vec<Figure> {
        let Some(spacing) = even_spacing(self.channel.times()) else {
            return Vec::new();
        };
        let (label, unit) = (self.label(), self.unit());
        let (measured, model) = (self.observed(), self.model());
        let pair = SeriesPair {
            label: (&label, unit),
            spacing,
            measured: &measured,
            model: &model,
        };
        // With several inputs the ratio to one of them is no frequency response.
        let response = match inputs {
            [input] => frequency_response(&pair, input, mark),
            _ => None,
        };
        spectrum(&pair, mark).into_iter().chain(response).collect()
    }

    /// Table of samples and prediction, in the unit of the file, at the samples that `rows` chooses.
    pub fn table(&self, rows: impl Fn(&[f64]) -> Vec<f64>) -> CsvTable {
        CsvTable::new()
            .column("t_s", rows(self.channel.times()))
            .column("measured", rows(&self.observed()))
            .column("predicted", rows(&self.model()))
            .column("residual", rows(&self.residuals()))
    }
}

/// A text with a capital letter and a full stop.
pub(super) fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    match letters.next() {
        None => String::new(),
        Some(first) => format!("{}{}.", first.to_uppercase(), letters.as_str()),
    }
}

/// Result of the test of whiteness, which is that of the innovations of correlated noise.
pub(super) fn whiteness(channel: &Channel, test: &Whiteness) -> String {
    match channel.correlation() {
        None => test.to_string(),
        Some(_) => test.to_string().replace("residuals", "innovations"),
    }
}
