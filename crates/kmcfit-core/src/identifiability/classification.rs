//! Classification of functions and ratios by their bands.

use super::band::Band;
use super::bands::Bands;
use super::spans::{span_words, spans};
use crate::diagnostics::median_size;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::system::Term;
use serde::{Deserialize, Serialize};

/// Largest half-width of the 95 % band of an identified function, as a share of its size ([`Problem::natural_scales`] with
/// the median of its values in place of the largest).
pub const IDENTIFIED: f64 = 0.25;
/// Share of the nodes at which a function must be identified to be identified as a whole; the ends of a record carry less
/// information.
pub const MOST: f64 = 0.95;
/// Share of the nodes below which a function is not identified.
pub const LEAST: f64 = 0.05;

/// Identifiability of a function or ratio.
#[derive(Debug, Clone, PartialEq)]
pub enum Classification {
    /// Identified at (nearly) all times.
    Identified {
        /// Largest half-width of the 95 % band, relative to the function's size.
        relative: f64,
    },
    /// Not identified itself; the named ratio to the mass is.
    OnlyRatio(String),
    /// Identified on these spans of time, s.
    PartlyIdentified(Vec<[f64; 2]>),
    /// Not identified at (nearly) any time.
    NotIdentified,
    /// Fixed by the model.
    Fixed,
}

impl Classification {
    /// Kind without values.
    pub fn kind(&self) -> ClassificationKind {
        match self {
            Self::Identified { .. } => ClassificationKind::Identified,
            Self::OnlyRatio(_) => ClassificationKind::OnlyRatio,
            Self::PartlyIdentified(_) => ClassificationKind::PartlyIdentified,
            Self::NotIdentified => ClassificationKind::NotIdentified,
            Self::Fixed => ClassificationKind::Fixed,
        }
    }

    /// Name in files.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Identified { .. } => "identified",
            Self::OnlyRatio(_) => "only-ratio",
            Self::PartlyIdentified(_) => "partly-identified",
            Self::NotIdentified => "not-identified",
            Self::Fixed => "fixed",
        }
    }
}

/// Kind of a [`Classification`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)]
pub enum ClassificationKind {
    Identified,
    OnlyRatio,
    PartlyIdentified,
    NotIdentified,
    Fixed,
}

/// Classification of one function or ratio.
#[derive(Debug, Clone, PartialEq)]
pub struct FunctionClassification {
    /// Name of the function or ratio.
    pub name: String,
    /// Classification.
    pub verdict: Classification,
    /// Classification as a sentence.
    pub sentence: String,
    /// Smallest and largest value over the nodes where it is identified; `None` where there is no such node.
    pub identified_range: Option<[f64; 2]>,
}

impl FunctionClassification {
    /// True where the classification limits what is known: partly, not, or only as a ratio identified.
    pub fn is_open(&self) -> bool {
        match self.verdict {
            Classification::Identified { .. } | Classification::Fixed => false,
            Classification::OnlyRatio(_)
            | Classification::PartlyIdentified(_)
            | Classification::NotIdentified => true,
        }
    }
}

/// Values below this share of a function's size are rounding errors.
const ROUNDING: f64 = 1e-12;

/// True where `value` is zero to machine precision, relative to `size`.
pub fn is_negligible(value: f64, size: f64) -> bool {
    value.abs() <= ROUNDING * size
}

/// Sentence on the accuracy of an identified function. The half-width is given relative to the function's largest value, or
/// as a number where the band contains zero or the function is small relative to `size`.
fn identified(name: &str, band: &Band, size: f64) -> String {
    let seen = || (0..band.values.len()).filter(|i| is_known(band, size, *i));
    let half = seen().fold(0.0f64, |most, i| most.max(band.half_width(i)));
    let own = seen().fold(0.0f64, |most, i| most.max(band.values[i].abs()));
    let unit = &band.unit;
    if is_negligible(half.max(own), size) {
        return format!("{name} is zero to machine precision");
    }
    if half >= own {
        return format!("{name} does not differ from zero: 95 % CI half-width {half:.1e} {unit}");
    }
    let share = half / own;
    if share > IDENTIFIED {
        return format!(
            "{name} is small: 95 % CI half-width {half:.1e} {unit}, {:.0} % of its largest value",
            100.0 * share
        );
    }
    let share = match () {
        () if is_negligible(share, 1.0) => {
            return format!("{name} is identified to machine precision");
        }
        () if share < 1e-4 => format!("{:.0e} %", 100.0 * share),
        () => format!("{:.2} %", 100.0 * share),
    };
    format!("{name} is identified: 95 % CI half-width at most {share} of its largest value")
}

/// True where the half-width of the band at node `i` is small enough for a function of this size.
fn is_known(band: &Band, size: f64, i: usize) -> bool {
    band.values[i].is_finite() && band.half_width(i) / size <= IDENTIFIED
}

/// Classifies every function of the list, then `k/m` and `c/m`.
pub fn classify_functions(
    problem: &Problem,
    evaluation: &Evaluation,
    bands: &Bands,
) -> Vec<FunctionClassification> {
    let sizes = problem.median_scales(evaluation);
    let assembly = problem.functions.coefficient_set(0);
    let mass = median_size(&evaluation.nodal.mass);
    let of = |term: Term| {
        let place = problem.system.terms.iter().position(|t| *t == term)?;
        Some(assembly[place + 1])
    };
    let named = [("k/m", of(Term::Stiffness)), ("c/m", of(Term::Damping))];
    let ratios: Vec<(&str, usize, f64, Classification)> = (named.into_iter())
        .filter_map(|(name, function)| {
            let (band, f) = (bands.ratio(name)?, function?);
            let size = median_size(&band.values).max(sizes[f] / mass);
            Some((name, f, size, judge(&bands.times, band, size)))
        })
        .collect();
    let known = |f: usize| {
        let with = |(_, function, _, verdict): &&(&str, usize, f64, Classification)| {
            (*function == f || f == assembly[0])
                && matches!(verdict, Classification::Identified { .. })
        };
        ratios
            .iter()
            .find(with)
            .map(|(name, ..)| (*name).to_owned())
    };
    let functions = bands.functions.iter().enumerate().map(|(f, band)| {
        let verdict = match problem.functions.get(f).parameters() {
            0 => Classification::Fixed,
            _ => match judge(&bands.times, band, sizes[f]) {
                identified @ Classification::Identified { .. } => identified,
                other => known(f).map_or(other, Classification::OnlyRatio),
            },
        };
        classification(&band.name, verdict, band, sizes[f])
    });
    let functions: Vec<FunctionClassification> = functions.collect();
    let ratios = (ratios.into_iter())
        .filter_map(|(name, _, size, v)| Some(classification(name, v, bands.ratio(name)?, size)));
    functions.into_iter().chain(ratios).collect()
}

fn judge(times: &[f64], band: &Band, size: f64) -> Classification {
    let known = |i: usize| is_known(band, size, i);
    let count = (0..times.len()).filter(|i| known(*i)).count();
    let share = count as f64 / times.len() as f64;
    if share >= MOST {
        let relative = |i: usize| band.half_width(i) / size;
        let known = (0..times.len()).filter(|i| known(*i));
        return Classification::Identified {
            relative: known.map(relative).fold(0.0, f64::max),
        };
    }
    match share < LEAST {
        true => Classification::NotIdentified,
        false => Classification::PartlyIdentified(spans(times, known)),
    }
}

fn classification(
    name: &str,
    verdict: Classification,
    band: &Band,
    size: f64,
) -> FunctionClassification {
    let sentence = match &verdict {
        Classification::Identified { .. } => identified(name, band, size),
        Classification::OnlyRatio(ratio) => {
            format!("{name} itself is not identifiable; the ratio {ratio} is identified")
        }
        Classification::PartlyIdentified(spans) => {
            format!("{name} is identified only on {}", span_words(spans))
        }
        Classification::NotIdentified => format!("{name} is not identifiable from these records"),
        Classification::Fixed => format!("{name} is fixed by the model"),
    };
    let known = (0..band.values.len()).filter(|i| is_known(band, size, *i));
    let identified_range = known.map(|i| [band.values[i]; 2]);
    FunctionClassification {
        name: name.to_owned(),
        verdict,
        sentence,
        identified_range: identified_range.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]),
    }
}
