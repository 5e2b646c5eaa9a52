//! The document of a study, `study.json` and the records of its analyses.

use crate::report::document::Verdict;
use kmcfit_core::finding::Finding;
use kmcfit_core::solvers::Status;
use kmcfit_core::study::ExtremeStatus;
use serde::{Deserialize, Serialize};

/// Numbers; an infinite or missing one is `null` in JSON.
pub type Numbers = Vec<Option<f64>>;

/// The document of a study.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct StudyDocument {
    /// Version of this format.
    pub format: u32,
    /// Title of the model.
    pub title: String,
    /// Version of kmcfit.
    pub version: String,
    /// `complete`, or `interrupted` before all analyses were finished.
    pub status: String,
    /// Confidence of bands and intervals.
    pub confidence: f64,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Structural rank: the part of identifiability that is known before the fit.
    pub structural_rank: Vec<Finding>,
    /// The fit.
    pub fit: Option<StudiedFit>,
    /// Singular values of the sensitivity at the optimum.
    pub sensitivity: Option<SensitivityRecord>,
    /// Confidence bands of functions and ratios.
    pub bands: Option<BandsRecord>,
    /// Likelihood profiles.
    pub profiles: Vec<ProfileRecord>,
    /// Data-consistent extremes of functions and ratios.
    pub extremes: Vec<ExtremesRecord>,
    /// True if penalties limit the roughness of the extremes.
    pub roughness_limited: bool,
    /// Equivalent systems: other coefficients with the same response.
    pub equivalent_systems: Vec<EquivalentSystemRecord>,
    /// Fits from random starting points.
    pub multistart: Option<MultistartRecord>,
    /// Candidate experiments, the most informative first.
    pub candidates: Vec<CandidateRecord>,
    /// Predicted responses.
    pub predictions: Vec<PredictionRecord>,
    /// Analyses that failed.
    pub failures: Vec<AnalysisFailure>,
}

/// An analysis that failed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AnalysisFailure {
    /// The analysis.
    pub analysis: String,
    /// The reason.
    pub reason: String,
}

/// The fit that is studied.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StudiedFit {
    /// Status.
    pub status: Status,
    /// The reason, as a sentence.
    pub reason: String,
    /// Cost J.
    pub cost: f64,
    /// Verdict on the fit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
    /// Part of J from the samples.
    pub misfit: f64,
    /// Number of nodes.
    pub nodes: usize,
    /// Width of Coulomb friction, m/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction_width: Option<f64>,
    /// Parameters of the functions, then the nuisance parameters.
    pub parameters: Vec<f64>,
    /// Weights of the penalties.
    pub weights: Vec<f64>,
    /// Estimated sigma of each channel; `null` where it is given.
    pub sigmas: Numbers,
}

/// Singular value decomposition of the scaled sensitivity of the samples to the parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SensitivityRecord {
    /// The rank, as a sentence.
    pub text: String,
    /// Singular values, largest first.
    pub singular_values: Vec<f64>,
    /// Number of identifiable parameter combinations.
    pub rank: usize,
    /// Number of parameter combinations.
    pub combinations: usize,
    /// Combinations that are not identifiable.
    pub unidentifiable: Vec<UnidentifiableRecord>,
}

/// A parameter combination that is not identifiable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct UnidentifiableRecord {
    /// The ambiguity that it belongs to.
    pub name: String,
    /// Share of its squared norm within that ambiguity.
    pub share: f64,
}

/// Confidence bands and the classification by them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BandsRecord {
    /// Times, s.
    pub times: Vec<f64>,
    /// Functions, then ratios.
    pub bands: Vec<BandRecord>,
    /// Notes on all bands.
    pub notes: Vec<String>,
    /// Classification of functions and ratios.
    pub classification: Vec<ClassificationRecord>,
}

/// The band of a function or ratio.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BandRecord {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Values.
    pub values: Numbers,
    /// Lower ends of the pointwise band; `null` where there is none.
    pub low: Numbers,
    /// Upper ends of the pointwise band.
    pub high: Numbers,
    /// Mean over the record, at all nodes of the fit; `null` where a value is not defined.
    #[serde(default)]
    pub mean: Option<f64>,
    /// 95 % confidence interval of the mean; `null` where there is none.
    #[serde(default)]
    pub mean_95: Option<[f64; 2]>,
    /// True values, where they are known.
    pub truth: Numbers,
    /// Notes.
    pub notes: Vec<String>,
}

/// Classification of a function or ratio.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ClassificationRecord {
    /// Function or ratio.
    pub name: String,
    /// `identified`, `only-ratio`, `partly-identified`, `not-identified` or `fixed`.
    pub verdict: String,
    /// The sentence.
    pub text: String,
}

/// Likelihood profile of one quantity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ProfileRecord {
    /// The quantity.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its value at the optimum.
    pub optimum: f64,
    /// Values of the quantity, each held fixed while the other parameters are fitted.
    pub values: Vec<f64>,
    /// Minimal cost at each value.
    pub costs: Vec<f64>,
    /// Ends of the confidence interval; `null` where the profile has none.
    pub interval: [Option<f64>; 2],
    /// `identified`, `one-sided` or `flat`.
    pub verdict: String,
    /// The sentence.
    pub text: String,
}

/// Data-consistent extremes of a function or ratio: its smallest and largest value among all systems whose misfit is at
/// most `misfit_limit`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExtremesRecord {
    /// Function or ratio.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Times, s.
    pub times: Vec<f64>,
    /// Smallest values.
    pub low: Vec<f64>,
    /// Largest values.
    pub high: Vec<f64>,
    /// Largest misfit that is consistent with the data.
    pub misfit_limit: f64,
    /// The systems that attain the extremes.
    pub systems: Vec<ExtremeSystemRecord>,
}

/// A system that attains an extreme.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExtremeSystemRecord {
    /// The extreme, as in `largest mass at 3 s`.
    pub name: String,
    /// Misfit, recomputed.
    pub misfit: f64,
    /// End of the search.
    pub status: ExtremeStatus,
}

/// An equivalent system: other coefficients with the response of the fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EquivalentSystemRecord {
    /// Name.
    pub name: String,
    /// Times, s.
    pub times: Vec<f64>,
    /// Mass, kg.
    pub mass: Vec<f64>,
    /// Damping, N s/m.
    pub damping: Vec<f64>,
    /// Stiffness, N/m.
    pub stiffness: Vec<f64>,
    /// Largest difference of its response from the fit's, relative to the largest displacement.
    pub response_error: f64,
}

/// Fits from random starting points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MultistartRecord {
    /// Costs in rising order.
    pub costs: Vec<f64>,
    /// Reasons for which fits failed.
    pub failures: Vec<String>,
    /// Distinct end points.
    pub clusters: Vec<ClusterRecord>,
    /// Findings.
    pub findings: Vec<Finding>,
}

/// An end point that one or several starting points led to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ClusterRecord {
    /// Number of starting points.
    pub starts: usize,
    /// Its cost.
    pub cost: f64,
}

/// A candidate experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CandidateRecord {
    /// Name.
    pub name: String,
    /// Number of parameter combinations that it makes identifiable; `null` if it cannot be simulated.
    pub added_rank: Option<usize>,
    /// D criterion: ratio of the geometric means of the standard errors, with the experiment to without.
    pub d_ratio: Option<f64>,
    /// The sentence.
    pub text: String,
}

/// A predicted response with its uncertainty.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PredictionRecord {
    /// Name.
    pub name: String,
    /// Times, s.
    pub times: Vec<f64>,
    /// Displacement, m.
    pub displacement: Vec<f64>,
    /// 95 % confidence band, m.
    pub band: Option<Vec<[f64; 2]>>,
    /// Envelope over the extreme systems, m.
    pub envelope: Option<Vec<[f64; 2]>>,
    /// The extreme system with the largest difference of displacement.
    pub furthest: Option<FurthestSystem>,
    /// Extreme systems without a bounded response, which are not in the envelope.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unbounded: Vec<String>,
}

/// The extreme system whose response differs most from the prediction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FurthestSystem {
    /// The extreme.
    pub name: String,
    /// Largest difference of displacement, m.
    pub difference: f64,
}
