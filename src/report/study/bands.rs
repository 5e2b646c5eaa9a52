//! Confidence bands of a study, and the sentences on functions and ratios.

use super::document::*;
use super::records::{Optimum, finite_numbers};
use crate::config::Model;
use kmcfit_core::assessment::{Doubt, Plausibility, Unidentified};
use kmcfit_core::diagnostics::normal_half_width;
use kmcfit_core::functions::Ratio;
use kmcfit_core::identifiability::{
    Band, Bands, Classification, FunctionClassification, Quantity, classify_functions,
};
use kmcfit_core::number_format::{resolved, significant};

/// Confidence bands and the classification by them.
pub fn bands(at: Optimum, model: &Model) -> BandsRecord {
    let (plan, truth) = (&model.study, model.truth.as_ref());
    let (problem, evaluation) = (at.problem, at.evaluation);
    let mut bands = Bands::at(problem, at.theta, evaluation);
    for band in &mut bands.functions {
        band.unit = model.converted_unit(&band.unit).to_owned();
    }
    let factor = normal_half_width(plan.confidence);
    let plausibility = Plausibility::at(problem, evaluation);
    let judged = match plausibility.errors_hold {
        true => classify_functions(problem, evaluation, &bands),
        false => Vec::new(),
    };
    let mut notes = bands.notes.clone();
    notes.extend((plausibility.unidentified.iter()).map(Unidentified::sentence));
    notes.extend((plausibility.warnings.iter()).map(Doubt::sentence));
    let records = with_means(&bands).enumerate().map(|(i, (band, mean))| {
        let real = truth.and_then(|truth| match Ratio::named(&band.name) {
            Some(ratio) => Some(ratio.at_nodes(problem.system.laws(), truth)),
            None => truth.functions().nth(i).map(<[f64]>::to_vec),
        });
        band_record(band, mean, factor, real.as_deref())
    });
    BandsRecord {
        times: bands.times.clone(),
        bands: records.collect(),
        notes,
        classification: (judged.into_iter())
            .map(|j| ClassificationRecord {
                text: with_numbers(at, &bands, &j),
                verdict: j.verdict.name().into(),
                name: j.name,
            })
            .collect(),
    }
}

/// All bands with the means over the record.
fn with_means(bands: &Bands) -> impl Iterator<Item = (&Band, &Quantity)> {
    let means = &bands.quantities;
    let functions = bands.functions.iter().zip(&means.functions);
    functions.chain(bands.ratios.iter().zip(&means.ratios))
}

/// A classification with the mean over the record, its interval, and for a function that varies its largest change.
fn with_numbers(at: Optimum, bands: &Bands, found: &FunctionClassification) -> String {
    let is_identified = matches!(
        found.verdict,
        Classification::Identified { .. } | Classification::Conditional { .. }
    );
    let named = with_means(bands).find(|(band, _)| band.name == found.name);
    let (Some((band, mean)), true) = (named, is_identified) else {
        return found.sentence.clone();
    };
    // The numbers of a function that is zero are rounding errors.
    if found.sentence.ends_with("is zero to machine precision") {
        return found.sentence.clone();
    }
    let Some([low, high]) = mean.interval() else {
        return found.sentence.clone();
    };
    let of_mean = match band.values().all(|x| x == band.points[0].value) {
        true => "",
        false => "mean ",
    };
    let unit = &band.unit;
    let half = 0.5 * (high - low);
    let [value, low, high] = resolved([mean.value, low, high], half);
    let mut text = format!(
        "{}: {of_mean}{value} {unit} (95 % CI {low} to {high})",
        found.name
    );
    if mean.value.abs() < half {
        text += ", does not differ from zero";
    }
    let change = (at.problem.functions.iter())
        .position(|f| f.name() == found.name)
        .zip(bands.covariance.as_ref())
        .and_then(|(f, covariance)| {
            let errors = (covariance, bands.degrees_of_freedom.as_slice());
            Quantity::relative_change(at.problem, at.theta, f, errors)
        });
    text += &change.and_then(change_in_words).unwrap_or_default();
    let on = match &found.verdict {
        Classification::Conditional { .. } => format!("; {}", found.sentence),
        _ => String::new(),
    };
    text + &on
}

/// `; falls by 18 % (95 % CI 17 to 19 %) between 4 s and 9 s`.
fn change_in_words((change, times): (Quantity, [f64; 2])) -> Option<String> {
    let [from, to] = times.map(|t| significant(t, 3));
    let [low, high] = change.interval()?;
    let half = 50.0 * (high - low);
    if low <= 0.0 && high >= 0.0 {
        let [low, high] = resolved([100.0 * low, 100.0 * high], half);
        return Some(format!(
            "; its change between {from} s and {to} s is not significant (95 % CI {low} to {high} %)"
        ));
    }
    let sign = 100.0 * change.value.signum();
    let mut numbers = [sign * change.value, sign * low, sign * high];
    numbers[1..].sort_by(f64::total_cmp);
    let [size, low, high] = resolved(numbers, half);
    let verb = match change.value < 0.0 {
        true => "falls",
        false => "rises",
    };
    Some(format!(
        "; {verb} by {size} % (95 % CI {low} to {high} %) between {from} s and {to} s"
    ))
}

fn band_record(band: &Band, mean: &Quantity, factor: f64, truth: Option<&[f64]>) -> BandRecord {
    let ends = band
        .points
        .iter()
        .map(|point| point.ends(factor * point.standard_error));
    let (low, high): (Vec<f64>, Vec<f64>) = ends.map(|[low, high]| (low, high)).unzip();
    BandRecord {
        name: band.name.clone(),
        unit: band.unit.clone(),
        values: finite_numbers(&band.values().collect::<Vec<f64>>()),
        low: finite_numbers(&low),
        high: finite_numbers(&high),
        mean: Some(mean.value).filter(|mean| mean.is_finite()),
        mean_95: mean.interval(),
        truth: truth.map(finite_numbers).unwrap_or_default(),
        notes: band.notes.clone(),
    }
}
