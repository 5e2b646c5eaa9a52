//! Classification of functions and ratios by their bands.

use super::band::Band;
use super::bands::Bands;
use super::curve::Curve;
use crate::diagnostics::median_size;
use crate::functions::Ratio;
use crate::number_format::at_most;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::spans::{span_words, spans};
use crate::structure::Law;
use serde::{Deserialize, Serialize};

/// Largest half-width of the 95 % band of an identified function, as a share of its size ([`Problem::natural_scales`] with
/// the median of its values in place of the largest).
const IDENTIFIED: f64 = 0.25;
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
        /// Largest half-width of the 95 % band, relative to the function's largest value.
        relative: f64,
    },
    /// Determined under a condition alone, whose error the interval excludes.
    Conditional {
        /// Largest half-width of the 95 % band under the condition, relative to the function's largest value.
        relative: f64,
        /// Condition.
        on: Condition,
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
            Self::Conditional { .. } => ClassificationKind::Conditional,
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
            Self::Conditional { .. } => "conditional",
            Self::OnlyRatio(_) => "only-ratio",
            Self::PartlyIdentified(_) => "partly-identified",
            Self::NotIdentified => "not-identified",
            Self::Fixed => "fixed",
        }
    }
}

/// Condition of a conditional interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Condition {
    /// The smoothness: the rule that chose the weight of the penalty gives no interval that includes the smoothing bias.
    Smoothness,
    /// The basis: a finer one fits significantly better.
    Basis,
    /// The measured input and the terms of the equation of motion: the residuals are those of errors of the input or of a missing term.
    Input,
    /// Negligible noise of the measured response, which biases the minimum of the equation error.
    NegligibleNoise,
    /// The number and the times of the jumps found.
    Jumps,
    /// A dependence on time: one on the amplitude explains the samples as well.
    Time,
}

/// Kind of a [`Classification`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)]
pub enum ClassificationKind {
    Identified,
    Conditional,
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
    /// Makes an identified function conditional.
    fn depends_on(&mut self, on: Condition) {
        if let Classification::Identified { relative } = self.verdict {
            self.sentence = on.sentence(&self.name, relative);
            self.verdict = Classification::Conditional { relative, on };
        }
    }

    /// True where the classification limits what is known: partly, not, only as a ratio, or only for the chosen smoothness
    /// identified.
    pub fn is_open(&self) -> bool {
        match self.verdict {
            Classification::Identified { .. } | Classification::Fixed => false,
            Classification::Conditional { .. }
            | Classification::OnlyRatio(_)
            | Classification::PartlyIdentified(_)
            | Classification::NotIdentified => true,
        }
    }
}

impl Condition {
    /// Sentence on a function identified under the condition, with its largest half-width relative to its largest value.
    pub fn sentence(self, name: &str, relative: f64) -> String {
        let half = format!(
            "95 % CI half-width at most {} of its largest value",
            percent(relative)
        );
        match self {
            Self::Smoothness => format!(
                "{name} is identified conditionally on the smoothness: {half}; the interval excludes the smoothing bias"
            ),
            Self::Basis => format!(
                "{name} is identified conditionally on the basis: {half}; a finer basis fits significantly better"
            ),
            Self::Input => format!(
                "{name} is identified conditionally on an exact input: {half}; the residuals show a disturbance of the equation of motion"
            ),
            Self::Jumps => format!(
                "{name} is identified conditionally on the number and times of the jumps: {half}; the interval excludes their uncertainty"
            ),
            Self::Time => format!(
                "{name} is identified conditionally on a dependence on time: {half}; one on the amplitude explains the samples as well"
            ),
            Self::NegligibleNoise => format!(
                "{name} is identified conditionally on negligible noise of the measured response: {half}"
            ),
        }
    }
}

/// Makes all identified functions conditional on the measured input.
pub(crate) fn condition_on_inputs(classifications: &mut [FunctionClassification]) {
    (classifications.iter_mut()).for_each(|each| each.depends_on(Condition::Input));
}

/// Makes all identified functions conditional on negligible noise of the measured response.
pub(crate) fn condition_on_negligible_noise(classifications: &mut [FunctionClassification]) {
    (classifications.iter_mut()).for_each(|each| each.depends_on(Condition::NegligibleNoise));
}

/// Makes classifications conditional on the basis for these functions, and for the ratios with them.
pub(crate) fn condition_on_bases(
    problem: &Problem,
    classifications: &mut [FunctionClassification],
    coarse: &[usize],
) {
    for classification in of_functions(problem, classifications, coarse) {
        classification.depends_on(Condition::Basis);
    }
}

/// Makes the identified functions `varying`, and the ratios with them, conditional on a dependence on time.
pub(crate) fn condition_on_time(
    problem: &Problem,
    classifications: &mut [FunctionClassification],
    varying: &[usize],
) {
    for classification in of_functions(problem, classifications, varying) {
        classification.depends_on(Condition::Time);
    }
}

/// Classifications of these functions, and of the ratios with them.
fn of_functions<'a>(
    problem: &'a Problem,
    classifications: &'a mut [FunctionClassification],
    chosen: &'a [usize],
) -> impl Iterator<Item = &'a mut FunctionClassification> {
    let functions = problem.functions.ranges().len();
    let is_chosen = move |index: usize, name: &str| {
        let curve = match Ratio::named(name) {
            Some(ratio) if index >= functions => Curve::Ratio(ratio),
            _ => Curve::Function(index),
        };
        let terms = curve.terms(problem).into_iter();
        let mut all = terms.flat_map(|terms| terms.coefficients.concat());
        all.any(|f| chosen.contains(&f))
    };
    let each = classifications.iter_mut().enumerate();
    each.filter(move |(index, c)| is_chosen(*index, &c.name))
        .map(|(_, c)| c)
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
    let [half, own] = half_width_and_value(band, size);
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
        () => percent(share),
    };
    format!("{name} is identified: 95 % CI half-width at most {share} of its largest value")
}

/// Largest half-width and largest absolute value where the function is known.
fn half_width_and_value(band: &Band, size: f64) -> [f64; 2] {
    let known = || (0..band.points.len()).filter(|i| is_known(band, size, *i));
    [
        known().fold(0.0, |most, i| most.max(band.points[i].half_width())),
        known().fold(0.0, |most, i| most.max(band.points[i].value.abs())),
    ]
}

/// A share in per cent, rounded upward: two decimals, of a small one the first digit.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    match percent < 0.01 {
        true => format!("{} %", at_most(percent, 1)),
        false => format!("{:.2} %", (100.0 * percent - 1e-9).ceil() / 100.0),
    }
}

/// True where the half-width of the band at node `i` is small enough for a function of this size.
fn is_known(band: &Band, size: f64, i: usize) -> bool {
    let point = &band.points[i];
    point.value.is_finite() && point.half_width() / size <= IDENTIFIED
}

/// Classifies every function of the list, then `k/m` and `c/m`.
pub fn classify_functions(
    problem: &Problem,
    evaluation: &Evaluation,
    bands: &Bands,
) -> Vec<FunctionClassification> {
    let sizes = problem.median_scales(evaluation);
    let assembly = problem.functions.coefficient_set(0);
    let mass = median_size(&evaluation.nodal.inertias[0]);
    let of = |term: Law| {
        let position = problem.system.laws().iter().position(|t| *t == term)?;
        Some(assembly[position + 1])
    };
    let numerators = [
        (Ratio::StiffnessOverMass, of(Law::Stiffness)),
        (Ratio::DampingOverMass, of(Law::Damping)),
    ];
    let ratios: Vec<(&Band, usize, f64, Classification)> = (numerators.into_iter())
        .filter_map(|(ratio, function)| {
            let (band, f) = (bands.ratio(ratio)?, function?);
            let values: Vec<f64> = band.values().collect();
            let size = median_size(&values).max(sizes[f] / mass);
            Some((band, f, size, judge(&bands.times, band, size)))
        })
        .collect();
    let known = |f: usize| {
        let with = |(_, function, _, verdict): &&(&Band, usize, f64, Classification)| {
            (*function == f || f == assembly[0])
                && matches!(verdict, Classification::Identified { .. })
        };
        let found = ratios.iter().find(with);
        found.map(|(band, ..)| band.name.clone())
    };
    let functions = bands.functions.iter().enumerate().map(|(f, band)| {
        let verdict = match problem.functions.get(f).parameters() {
            0 => Classification::Fixed,
            _ => match judge(&bands.times, band, sizes[f]) {
                identified @ Classification::Identified { .. } => identified,
                other => known(f).map_or(other, Classification::OnlyRatio),
            },
        };
        let verdict = conditional(problem, verdict);
        classification(verdict, band, sizes[f])
    });
    let functions: Vec<FunctionClassification> = functions.collect();
    let ratios = (ratios.into_iter()).map(|(band, _, size, verdict)| {
        let verdict = conditional(problem, verdict);
        classification(verdict, band, size)
    });
    functions.into_iter().chain(ratios).collect()
}

/// Verdict on a function or ratio: conditional instead of identified where jumps were found, and where the weight of a penalty was
/// chosen by a rule whose intervals exclude the smoothing bias, which is a bias of all estimates.
fn conditional(problem: &Problem, verdict: Classification) -> Classification {
    let mut rules = problem.penalties.iter().filter_map(|p| p.rule);
    let is_biased = rules.any(|rule| !rule.gives_coverage());
    match verdict {
        Classification::Identified { relative } if !problem.jumps.is_empty() => {
            Classification::Conditional {
                relative,
                on: Condition::Jumps,
            }
        }
        Classification::Identified { relative } if is_biased => Classification::Conditional {
            relative,
            on: Condition::Smoothness,
        },
        other => other,
    }
}

fn judge(times: &[f64], band: &Band, size: f64) -> Classification {
    let known = |i: usize| is_known(band, size, i);
    let count = (0..times.len()).filter(|i| known(*i)).count();
    let share = count as f64 / times.len() as f64;
    if share >= MOST {
        let [half, largest] = half_width_and_value(band, size);
        return Classification::Identified {
            relative: half / largest,
        };
    }
    match share < LEAST {
        true => Classification::NotIdentified,
        false => Classification::PartlyIdentified(spans(times, known)),
    }
}

fn partly_identified(name: &str, spans: &[[f64; 2]]) -> String {
    format!("{name} is identified only on {}", span_words(spans))
}

fn classification(verdict: Classification, band: &Band, size: f64) -> FunctionClassification {
    let name = band.name.as_str();
    let sentence = match &verdict {
        Classification::Identified { .. } => identified(name, band, size),
        Classification::Conditional { relative, on } => on.sentence(name, *relative),
        Classification::OnlyRatio(ratio) => {
            format!("{name} itself is not identifiable; the ratio {ratio} is identified")
        }
        Classification::PartlyIdentified(spans) => partly_identified(name, spans),
        Classification::NotIdentified => format!("{name} is not identifiable from these records"),
        Classification::Fixed => format!("{name} is fixed by the model"),
    };
    let known = (0..band.points.len()).filter(|i| is_known(band, size, *i));
    let identified_range = known.map(|i| [band.points[i].value; 2]);
    FunctionClassification {
        name: name.to_owned(),
        verdict,
        sentence,
        identified_range: identified_range.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]),
    }
}
