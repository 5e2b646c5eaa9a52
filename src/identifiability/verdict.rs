//! What the bands say of each function and ratio, in words.

use super::bands::{Band, Bands};
use super::linear::{span_words, spans};
use crate::diagnostics::NORMAL_975;
use crate::dynamics::Term;
use crate::objective::Evaluation;
use crate::problem::Problem;

/// A function is identified where the half-width of its 95 % band is at most this share of its
/// natural size: a quarter tells half of it from the whole.
pub const IDENTIFIED: f64 = 0.25;
/// It is identified on the whole if it is so at this share of the nodes: the ends of a record are
/// always seen less.
pub const MOST: f64 = 0.95;
/// Below this share of the nodes it is not seen.
pub const LEAST: f64 = 0.05;

/// What is known of a function or ratio.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// Known at (nearly) all times.
    Identified {
        /// Largest half-width of the 95 % band there, relative to the natural size.
        relative: f64,
    },
    /// Not known itself, but this ratio with it is.
    OnlyRatio(String),
    /// Known on these spans of time, s.
    OnlyOn(Vec<[f64; 2]>),
    /// Not known.
    NotSeen,
    /// Not sought.
    Fixed,
}

/// A verdict on one function or ratio.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    /// Name of the function or ratio.
    pub name: String,
    /// The verdict.
    pub verdict: Verdict,
    /// The same as a sentence.
    pub sentence: String,
}

/// By how much a number is known: as a share of its own largest value, or where that is within the
/// band, as a number beside which the value cannot be told from zero. In between it is small beside the natural
/// size of such a number, and that is what is known of it.
fn identified(name: &str, band: &Band) -> String {
    let half = band.standard_error.iter().filter(|e| e.is_finite());
    let half = NORMAL_975 * half.fold(0.0f64, |most, e| most.max(*e));
    let own = band.values.iter().filter(|v| v.is_finite());
    let own = own.fold(0.0f64, |most, v| most.max(v.abs()));
    if half >= own {
        let unit = &band.unit;
        return format!("{name} is identified: zero, to within {half:.1e} {unit} (95 %)");
    }
    if half > IDENTIFIED * own {
        let (unit, share) = (&band.unit, 100.0 * half / own);
        return format!(
            "{name} is small, and known to within {half:.1e} {unit}: {share:.0} % of its largest value (95 %)"
        );
    }
    let share = match half / own {
        share if share < 1e-4 => format!("{share:.0e}"),
        share => format!("{:.2} %", 100.0 * share),
    };
    format!("{name} is identified, to {share} of its largest value (95 %)")
}

/// Verdicts on every function of the list, then on `k/m` and `c/m`.
pub fn verdicts(problem: &Problem, evaluation: &Evaluation, bands: &Bands) -> Vec<Judgement> {
    let sizes = problem.natural_sizes(evaluation);
    let assembly = problem.functions.assembly(0);
    let heaviest = evaluation.device.mass.iter().copied().fold(0.0, f64::max);
    let of = |term: Term| {
        let place = problem.oscillator.terms.iter().position(|t| *t == term)?;
        Some(assembly[place + 1])
    };
    let named = [("k/m", of(Term::Stiffness)), ("c/m", of(Term::Damping))];
    let ratios: Vec<(&str, usize, Verdict)> = (named.into_iter())
        .filter_map(|(name, function)| {
            let (band, f) = (bands.ratio(name)?, function?);
            let own = band.values.iter().fold(0.0f64, |most, r| most.max(r.abs()));
            let size = own.max(sizes[f] / heaviest);
            Some((name, f, judge(&bands.times, band, size)))
        })
        .collect();
    let known = |f: usize| {
        let with = |(_, function, verdict): &&(&str, usize, Verdict)| {
            (*function == f || f == assembly[0]) && matches!(verdict, Verdict::Identified { .. })
        };
        ratios
            .iter()
            .find(with)
            .map(|(name, ..)| (*name).to_owned())
    };
    let functions = bands.functions.iter().enumerate().map(|(f, band)| {
        let verdict = match problem.functions.get(f).parameters() {
            0 => Verdict::Fixed,
            _ => match judge(&bands.times, band, sizes[f]) {
                identified @ Verdict::Identified { .. } => identified,
                other => known(f).map_or(other, Verdict::OnlyRatio),
            },
        };
        judgement(&band.name, verdict, band)
    });
    let functions: Vec<Judgement> = functions.collect();
    let ratios = (ratios.into_iter())
        .filter_map(|(name, _, v)| Some(judgement(name, v, bands.ratio(name)?)));
    functions.into_iter().chain(ratios).collect()
}

fn judge(times: &[f64], band: &Band, size: f64) -> Verdict {
    let relative = |i: usize| NORMAL_975 * band.standard_error[i] / size;
    let known = |i: usize| band.values[i].is_finite() && relative(i) <= IDENTIFIED;
    let count = (0..times.len()).filter(|i| known(*i)).count();
    let share = count as f64 / times.len() as f64;
    if share >= MOST {
        let known = (0..times.len()).filter(|i| known(*i));
        return Verdict::Identified {
            relative: known.map(relative).fold(0.0, f64::max),
        };
    }
    match share < LEAST {
        true => Verdict::NotSeen,
        false => Verdict::OnlyOn(spans(times, known)),
    }
}

fn judgement(name: &str, verdict: Verdict, band: &Band) -> Judgement {
    let sentence = match &verdict {
        Verdict::Identified { .. } => identified(name, band),
        Verdict::OnlyRatio(ratio) => {
            format!("{name} is not identified by itself, only the ratio {ratio} is")
        }
        Verdict::OnlyOn(spans) => format!("{name} is identified only on {}", span_words(spans)),
        Verdict::NotSeen => format!("{name} is not seen by the readings"),
        Verdict::Fixed => format!("{name} is given"),
    };
    Judgement {
        name: name.to_owned(),
        verdict,
        sentence,
    }
}
