//! Figures of one record: residual tests, spectra, frequency response and input.

use super::chart::{Axis, Colour, Dash, Figure, Mark, Panel, Style};
use kmcfit_core::diagnostics::{ResidualDiagnostics, SIGNIFICANCE};
use kmcfit_core::number_format::count;
use kmcfit_core::signal::{Mobility, Spectrum};

/// Coherence below which a measured frequency response is noise and does not widen its axis.
const COHERENT: f64 = 0.5;
/// Order of the derivative with which [`Mobility`] is the ratio of the response to the input itself.
const PLAIN: i32 = 1;

/// A measured and a modelled series at equal times, in the unit of the channel.
#[derive(Debug, Clone, Copy)]
pub(super) struct SeriesPair<'a> {
    /// Measurand with its symbol, and unit.
    pub label: (&'a str, &'a str),
    /// Time between samples, s.
    pub spacing: f64,
    pub measured: &'a [f64],
    pub model: &'a [f64],
}

/// An input of a record: quantity, unit and samples.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct InputSeries {
    pub label: &'static str,
    pub unit: &'static str,
    pub samples: Vec<f64>,
}

/// Autocorrelation of the residuals with the bounds that 95 % of the lags of white noise keep; `None` for residuals without one. `name` is `residuals` or `innovations`, `result` that
/// of the test of autocorrelation.
pub(super) fn residual_tests(
    name: &str,
    diagnostics: &ResidualDiagnostics,
    result: &str,
) -> Option<Figure> {
    let lags = 0..diagnostics.autocorrelation.len();
    (lags.len() > 1).then_some(())?;
    let lags: Vec<f64> = lags.map(|lag| lag as f64 * diagnostics.step).collect();
    let bound = Style::new(Colour::Grey).dash(Dash::Dashed);
    let stem = Style::new(Colour::Blue);
    let correlation = Panel::new(
        Axis::linear("lag", "s"),
        Axis::linear("autocorrelation", ""),
    )
    .marks([
        Mark::horizontal("95 % bounds", diagnostics.band, bound),
        Mark::horizontal("", -diagnostics.band, bound),
        Mark::stems(name, &lags, &diagnostics.autocorrelation, stem),
    ]);
    Some(
        Figure::new(
            "residual_tests",
            "Residual tests",
            format!(
                "Autocorrelation of the {name}; without any, 95 % of the lags are within the bounds. Ljung-Box test of {}, significance level \
                 {SIGNIFICANCE}: {result}.",
                count(diagnostics.autocorrelation.len().saturating_sub(1), "lag"),
            ),
        )
        .panel(correlation),
    )
}

/// A line at the undamped natural frequency, where it is on the axis.
fn natural_frequency(mark: Option<f64>, frequencies: &[f64]) -> Option<Mark> {
    let [first, .., last] = frequencies else {
        return None;
    };
    let style = Style::new(Colour::Green).dash(Dash::DashDot).width(1.2);
    let inside = mark.filter(|f| (*first..=*last).contains(f))?;
    Some(Mark::vertical("undamped natural frequency", inside, style))
}

/// Power spectral densities of the samples, of the fitted response and of the residuals, with the undamped natural frequency `mark`;
/// `None` where the samples have no spectrum.
pub(super) fn spectrum(pair: &SeriesPair, mark: Option<f64>) -> Option<Figure> {
    let (name, unit) = pair.label;
    let residuals: Vec<f64> = pair
        .measured
        .iter()
        .zip(pair.model)
        .map(|(y, m)| y - m)
        .collect();
    let measured = Spectrum::of(pair.measured, pair.spacing)?;
    let frequencies: Vec<f64> = measured.frequencies().skip(1).collect();
    let line = |label: &str, spectrum: Option<&Spectrum>, style: Style| {
        let density = spectrum?.density().get(1..)?;
        Some(Mark::line(label, &frequencies, density, style))
    };
    let of = |values: &[f64]| Spectrum::of(values, pair.spacing);
    let grey = Style::new(Colour::Grey).width(1.2);
    let vermillion = Style::new(Colour::Vermillion).width(0.8);
    let marks = [
        line("measured", Some(&measured), grey),
        line("model", of(pair.model).as_ref(), Style::new(Colour::Blue)),
        line("residuals", of(&residuals).as_ref(), vermillion),
    ];
    // A model without noise falls far below the samples.
    let y = within(
        Axis::log("power spectral density", density_unit(unit)),
        measured.density().iter().skip(1).copied(),
    );
    let panel = Panel::new(over(&frequencies), y)
        .marks(marks.into_iter().flatten())
        .marks(natural_frequency(mark, &frequencies));
    Some(
        Figure::new(
            "spectra",
            "Power spectral density",
            format!("Periodogram of the {name} with a Hann window: samples, fitted response and residuals."),
        )
        .panel(panel),
    )
}

/// Unit of a density: `m²/Hz`, `(m/s²)²/Hz`.
fn density_unit(unit: &str) -> String {
    match unit {
        "" => "1/Hz".to_owned(),
        unit => format!("{}²/Hz", factor(unit)),
    }
}

/// A unit as a factor: in parentheses where it has more than letters.
fn factor(unit: &str) -> String {
    match unit.chars().all(char::is_alphabetic) {
        true => unit.to_owned(),
        false => format!("({unit})"),
    }
}

/// Frequency responses of samples and fitted response to the input, and the coherence of samples and of residuals with it; `None` for
/// records too short for averages over segments.
pub(super) fn frequency_response(
    pair: &SeriesPair,
    input: &InputSeries,
    mark: Option<f64>,
) -> Option<Figure> {
    let (name, unit) = pair.label;
    let residuals: Vec<f64> = pair
        .measured
        .iter()
        .zip(pair.model)
        .map(|(y, m)| y - m)
        .collect();
    let of = |response: &[f64]| Mobility::of(&input.samples, response, pair.spacing, PLAIN);
    let (measured, model) = (of(pair.measured)?, of(pair.model)?);
    let size = |of: &Mobility| {
        of.squares
            .iter()
            .skip(1)
            .map(|square| square.sqrt())
            .collect::<Vec<_>>()
    };
    let frequencies: Vec<f64> = (1..measured.squares.len())
        .map(|k| k as f64 * measured.resolution)
        .collect();
    let (measured_size, model_size) = (size(&measured), size(&model));
    let unit = format!("{}/{}", factor(unit), factor(input.unit));
    let is_coherent = |k: &usize| {
        measured
            .coherence
            .get(k + 1)
            .is_some_and(|c| *c >= COHERENT)
    };
    let coherent = (0..measured_size.len()).filter(is_coherent);
    let drawn = coherent
        .map(|k| measured_size[k])
        .chain(model_size.iter().copied());
    let y = within(Axis::log("frequency response", unit), drawn);
    let grey = Style::new(Colour::Grey).width(2.0);
    let response = Panel::new(over(&frequencies), y).marks([
        Mark::line("measured", &frequencies, &measured_size, grey),
        Mark::line("model", &frequencies, &model_size, Style::new(Colour::Blue)),
    ]);
    let response = response.marks(natural_frequency(mark, &frequencies));
    let coherence = |label: &str, of: &Mobility, style: Style| {
        Some(Mark::line(
            label,
            &frequencies,
            of.coherence.get(1..)?,
            style,
        ))
    };
    let coherences = [
        coherence("measured", &measured, grey),
        of(&residuals).and_then(|r| coherence("residuals", &r, Style::new(Colour::Vermillion))),
    ];
    let coherence = Panel::new(
        over(&frequencies),
        Axis::linear("coherence", "").limits(0.0, 1.0),
    )
    .marks(coherences.into_iter().flatten());
    Some(
        Figure::new(
            "frequency_response",
            "Frequency response",
            format!(
                "Ratio of {name} to {} for samples and fitted response, and coherence of samples and residuals with the \
                 {}: averages over nine segments with Hann windows.",
                input.label, input.label
            ),
        )
        .panels([response, coherence]),
    )
}

/// The frequency axis from the lowest to the highest frequency above zero.
fn over(frequencies: &[f64]) -> Axis {
    let axis = Axis::log("frequency", "Hz");
    match frequencies {
        [first, .., last] => axis.limits(*first, *last),
        _ => axis,
    }
}

/// The axis limited to the positive values of a curve and a little more.
fn within(axis: Axis, values: impl Iterator<Item = f64>) -> Axis {
    let positive = values.filter(|v| *v > 0.0 && v.is_finite());
    let (low, high) = positive.fold((f64::INFINITY, 0.0_f64), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    axis.limits(0.5 * low, 2.0 * high)
}

/// Inputs against time, one panel each, titled by what is measured.
pub(super) fn input(times: &[f64], inputs: &[InputSeries]) -> Figure {
    let style = Style::new(Colour::Green).width(1.2);
    let title = match inputs {
        [only] => only.label[..1].to_uppercase() + &only.label[1..],
        _ => "Input".to_owned(),
    };
    Figure::new("input", title, "At the samples of the response.").panels(inputs.iter().map(
        |input| {
            Panel::of_time(input.label, input.unit).mark(Mark::line(
                "",
                times,
                &input.samples,
                style,
            ))
        },
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Marks of the figure's panel `i`.
    fn marks(figure: &Figure, i: usize) -> &[Mark] {
        &figure.panels[i].marks
    }

    fn noise(count: usize, seed: u64) -> Vec<f64> {
        use rand::SeedableRng;
        use rand_distr::{Distribution, StandardNormal};
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        (0..count)
            .map(|_| StandardNormal.sample(&mut random))
            .collect()
    }

    /// The response is half the force with noise of 5 %: the frequency response is 0.5, the coherence `1/(1 + 0.1^2)`, that of the residuals
    /// small. Averages over about 5.4 independent segments scatter by `0.1/sqrt(2 * 5.4)`.
    #[test]
    fn the_frequency_response_of_a_proportional_response_is_flat() {
        let force = noise(4000, 7);
        let error = noise(4000, 8);
        let measured: Vec<f64> = force
            .iter()
            .zip(&error)
            .map(|(f, e)| 0.5 * f + 0.05 * e)
            .collect();
        let model: Vec<f64> = force.iter().map(|f| 0.5 * f).collect();
        let pair = SeriesPair {
            label: ("displacement y", "m"),
            spacing: 0.01,
            measured: &measured,
            model: &model,
        };
        let input = InputSeries {
            label: "force",
            unit: "N",
            samples: force,
        };
        let figure = frequency_response(&pair, &input, None).expect("long enough");
        let [measured, model] = [&marks(&figure, 0)[0].y, &marks(&figure, 0)[1].y];
        let worst = |values: &[f64], expected: f64| {
            values
                .iter()
                .map(|v| (v - expected).abs())
                .fold(0.0, f64::max)
        };
        assert!(worst(model, 0.5) < 1e-9, "{}", worst(model, 0.5));
        assert!(worst(measured, 0.5) < 0.15, "{}", worst(measured, 0.5));
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        assert!((mean(measured) - 0.5).abs() < 0.005, "{}", mean(measured));
        let coherence = mean(&marks(&figure, 1)[0].y);
        assert!((coherence - 1.0 / 1.01).abs() < 0.005, "{coherence}");
        let residuals = mean(&marks(&figure, 1)[1].y);
        assert!(residuals < 0.3, "{residuals}");
        assert!(
            frequency_response(
                &SeriesPair {
                    measured: &pair.measured[..100],
                    ..pair
                },
                &input,
                None
            )
            .is_none()
        );
    }

    /// The density integrates to the variance (Parseval).
    #[test]
    fn the_spectrum_holds_the_variance() {
        let measured = noise(2000, 7);
        let model = vec![0.0; 2000];
        let pair = SeriesPair {
            label: ("velocity v", "m/s"),
            spacing: 0.02,
            measured: &measured,
            model: &model,
        };
        let figure = spectrum(&pair, None).expect("it varies");
        let mark = &marks(&figure, 0)[0];
        let sum = mark.y.iter().sum::<f64>() / (2000.0 * 0.02);
        let variance = measured.iter().map(|x| x * x).sum::<f64>() / 2000.0;
        // The window weighs the samples: the variances scatter by about sqrt(2/2000) each.
        assert!((sum / variance - 1.0).abs() < 0.1, "{sum} {variance}");
        assert_eq!(figure.panels[0].y.unit, "(m/s)²/Hz");
        // A response of zero has no spectrum; measured and residuals remain.
        assert_eq!(marks(&figure, 0).len(), 2);
        assert!(
            spectrum(
                &SeriesPair {
                    measured: &model,
                    ..pair
                },
                None
            )
            .is_none()
        );
    }
}
