//! Confidence bands of a study, and the sentences on functions and ratios.

use super::document::*;
use super::records::{Optimum, finite_numbers};
use crate::config::Model;
use crate::number_format::{resolved, significant};
use crate::report::doubts;
use kmcfit_core::internals::assessment::Plausibility;
use kmcfit_core::internals::diagnostics::normal_half_width;
use kmcfit_core::internals::functions::Ratios;
use kmcfit_core::internals::identifiability::{
    Band, Bands, Classification, FunctionClassification, RelativeChange, classify_functions,
};

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
    notes.extend((plausibility.unidentified.iter()).map(|why| doubts::unidentified(why).text));
    notes.extend((plausibility.warnings.iter()).map(|w| doubts::doubt(w).text));
    let ratios = truth.map(Ratios::of);
    let of_ratio = |part: fn(&Ratios) -> &Vec<f64>| ratios.as_ref().map(|r| part(r).as_slice());
    let list = bands.functions.iter().chain(&bands.ratios);
    let records = list.enumerate().map(|(i, band)| {
        let real = match band.name.as_str() {
            "k/m" => of_ratio(|r| &r.k_over_m),
            "c/m" => of_ratio(|r| &r.c_over_m),
            "natural frequency" => of_ratio(|r| &r.frequency),
            "damping ratio" => of_ratio(|r| &r.damping_ratio),
            _ => truth.and_then(|t| t.functions().nth(i)),
        };
        band_record(band, factor, real)
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

/// A classification with the mean over the record, its interval, and for a function that varies its largest change.
fn with_numbers(at: Optimum, bands: &Bands, found: &FunctionClassification) -> String {
    let is_identified = matches!(
        found.verdict,
        Classification::Identified { .. } | Classification::Conditional { .. }
    );
    let means = bands.means();
    let place = (at.problem.functions.iter()).position(|f| f.name() == found.name);
    let mean = match place {
        Some(f) => means.functions.get(f).copied(),
        None => means.ratio(&found.name),
    };
    let (Some(mean), true) = (mean, is_identified) else {
        return found.sentence.clone();
    };
    // The numbers of a function that is zero are rounding errors.
    if found.sentence.ends_with("is zero to machine precision") {
        return found.sentence.clone();
    }
    let Some([low, high]) = mean.interval() else {
        return found.sentence.clone();
    };
    let list = bands.functions.iter().chain(&bands.ratios);
    let band = list.into_iter().find(|band| band.name == found.name);
    let is_constant = |band: &Band| band.values.iter().all(|x| *x == band.values[0]);
    let of_mean = match band.is_some_and(is_constant) {
        true => "",
        false => "mean ",
    };
    let unit = band.map_or("", |band| band.unit.as_str());
    let half = 0.5 * (high - low);
    let [value, low, high] = resolved([mean.value, low, high], half);
    let mut text = format!(
        "{}: {of_mean}{value} {unit} (95 % CI {low} to {high})",
        found.name
    );
    if mean.value.abs() < half {
        text += ", does not differ from zero";
    }
    let change = place.and_then(|f| bands.relative_change(at.problem, at.theta, f));
    text += &change.map(change_in_words).unwrap_or_default();
    let on = match &found.verdict {
        Classification::Conditional { .. } => format!("; {}", found.sentence),
        _ => String::new(),
    };
    text + &on
}

/// `; falls by 18 % (95 % CI 17 to 19 %) between 4 s and 9 s`.
fn change_in_words(change: RelativeChange) -> String {
    let [from, to] = change.times.map(|t| significant(t, 3));
    let [low, high] = change.interval;
    let half = 50.0 * (high - low);
    if low <= 0.0 && high >= 0.0 {
        let [low, high] = resolved([100.0 * low, 100.0 * high], half);
        return format!(
            "; its change between {from} s and {to} s is not significant (95 % CI {low} to {high} %)"
        );
    }
    let sign = 100.0 * change.relative.signum();
    let mut numbers = [sign * change.relative, sign * low, sign * high];
    numbers[1..].sort_by(f64::total_cmp);
    let [size, low, high] = resolved(numbers, half);
    let verb = match change.relative < 0.0 {
        true => "falls",
        false => "rises",
    };
    format!("; {verb} by {size} % (95 % CI {low} to {high} %) between {from} s and {to} s")
}

fn band_record(band: &Band, factor: f64, truth: Option<&[f64]>) -> BandRecord {
    let ends = |factor: f64| -> [Numbers; 2] {
        let each = (0..band.values.len()).map(|t| band.ends(t, factor));
        let (low, high): (Vec<f64>, Vec<f64>) = each.map(|[low, high]| (low, high)).unzip();
        [finite_numbers(&low), finite_numbers(&high)]
    };
    let [low, high] = ends(factor);
    BandRecord {
        name: band.name.clone(),
        unit: band.unit.clone(),
        values: finite_numbers(&band.values),
        low,
        high,
        mean: Some(band.mean.value).filter(|mean| mean.is_finite()),
        mean_95: band.mean.interval(),
        truth: truth.map(finite_numbers).unwrap_or_default(),
        notes: band.notes.clone(),
    }
}
