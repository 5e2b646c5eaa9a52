//! The pieces of a study, as they are kept and read back.

use kmcfit_core::internals::solvers::Status;
use serde::{Deserialize, Serialize};

/// Numbers of which some may be infinite or missing: `null` in JSON.
pub type Numbers = Vec<Option<f64>>;

/// The whole of a study.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct StudyDocument {
    /// Version of this format.
    pub format: u32,
    /// Title of the model.
    pub title: String,
    /// Version of kmcfit.
    pub version: String,
    /// `complete`, or `interrupted` before all pieces were finished.
    pub status: String,
    /// Confidence of bands and intervals.
    pub confidence: f64,
    /// Seed of everything random.
    pub seed: u64,
    /// What was known before the fit, in words.
    pub before: Vec<String>,
    /// The optimum.
    pub fit: Option<FitPiece>,
    /// What the readings see there.
    pub spectrum: Option<SpectrumPiece>,
    /// How far functions and ratios may be off.
    pub bands: Option<BandsPiece>,
    /// Profiles of chosen numbers.
    pub profiles: Vec<ProfilePiece>,
    /// The widest tubes.
    pub tubes: Vec<TubeRecord>,
    /// Whether the roughness of the devices in the tubes was bounded.
    pub budgeted: bool,
    /// Other devices with the same motion.
    pub equivalents: Vec<EquivalentRecord>,
    /// Fits from many starts.
    pub multistart: Option<MultistartPiece>,
    /// Whether each function varies.
    pub varies: Vec<VariesRecord>,
    /// Intervals from refits.
    pub bootstrap: Vec<BootstrapRecord>,
    /// Experiments that might be made next, best first.
    pub candidates: Vec<CandidateRecord>,
    /// Motions from other initial states.
    pub predictions: Vec<PredictionRecord>,
    /// What could not be done, and why.
    pub failures: Vec<String>,
}

/// The fit that is studied.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FitPiece {
    /// How it ended.
    pub status: Status,
    /// The same in words.
    pub reason: String,
    /// J.
    pub cost: f64,
    /// J of the readings.
    pub misfit: f64,
    /// Parameters of functions and scalars.
    pub parameters: Vec<f64>,
    /// Weights of the penalties, as they were given or chosen.
    pub weights: Vec<f64>,
    /// Sigmas that were estimated, one for each channel; `null` where they were given.
    pub sigmas: Numbers,
}

/// What the readings see.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SpectrumPiece {
    /// In words.
    pub sentence: String,
    /// Singular values of the scaled sensitivity.
    pub singular_values: Vec<f64>,
    /// Number of directions that are seen.
    pub rank: usize,
    /// Number of directions.
    pub of: usize,
    /// What the unseen directions are.
    pub unseen: Vec<NamedRecord>,
    /// Times of the nodes, s.
    pub times: Vec<f64>,
    /// The directions seen best.
    pub best: Vec<DirectionRecord>,
    /// The directions seen worst.
    pub worst: Vec<DirectionRecord>,
}

/// An unseen direction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NamedRecord {
    /// Its name.
    pub name: String,
    /// Share of it that is what the name says.
    pub share: f64,
}

/// A direction as changes of the functions over time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DirectionRecord {
    /// Its singular value.
    pub singular_value: f64,
    /// Name of each function and its change at the nodes.
    pub functions: Vec<(String, Vec<f64>)>,
}

/// Bands, verdicts and anchors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BandsPiece {
    /// s.
    pub times: Vec<f64>,
    /// Functions, then ratios.
    pub bands: Vec<BandRecord>,
    /// What is to be said of all.
    pub notes: Vec<String>,
    /// Verdicts.
    pub verdicts: Vec<JudgementRecord>,
    /// Instants at which the data fix k/m whatever c is, s.
    pub turning_points: Vec<f64>,
    /// Instants at which they fix c/m, s.
    pub zero_crossings: Vec<f64>,
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
    /// Lower end at each time; `null` where there is none.
    pub low: Numbers,
    /// Upper end.
    pub high: Numbers,
    /// Ends of the band that holds at all times at once.
    pub simultaneous_low: Numbers,
    /// Its upper ends.
    pub simultaneous_high: Numbers,
    /// The truth, where it is known.
    pub truth: Numbers,
    /// What is to be said of it.
    pub notes: Vec<String>,
}

/// A verdict.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JudgementRecord {
    /// Function or ratio.
    pub name: String,
    /// `identified`, `only-ratio`, `only-on`, `not-seen` or `fixed`.
    pub verdict: String,
    /// In words.
    pub sentence: String,
}

/// A profile.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ProfilePiece {
    /// The number.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its value at the optimum.
    pub optimum: f64,
    /// Values at which the rest was fitted again.
    pub values: Vec<f64>,
    /// Cost there.
    pub costs: Vec<f64>,
    /// Ends of the interval; `null` where there is none.
    pub interval: [Option<f64>; 2],
    /// `identified`, `one-sided` or `flat`.
    pub verdict: String,
    /// In words.
    pub sentence: String,
    /// Values at which other bounds become active.
    pub marks: Vec<(f64, String)>,
}

/// The widest tube of a function.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TubeRecord {
    /// Function or ratio.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// s.
    pub times: Vec<f64>,
    /// Smallest values.
    pub low: Vec<f64>,
    /// Largest values.
    pub high: Vec<f64>,
    /// Largest misfit allowed.
    pub level: f64,
    /// The extreme devices: name, misfit by a fresh solve, how the search ended.
    pub devices: Vec<(String, f64, String)>,
}

/// Another device with the same motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EquivalentRecord {
    /// What was chosen.
    pub name: String,
    /// s.
    pub times: Vec<f64>,
    /// Mass, kg.
    pub mass: Vec<f64>,
    /// Damping, N s/m.
    pub damping: Vec<f64>,
    /// Stiffness, N/m.
    pub stiffness: Vec<f64>,
    /// Largest distance of its motion from the fit's, as a share of the largest displacement.
    pub response_error: f64,
}

/// Fits from many starts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MultistartPiece {
    /// Costs in rising order.
    pub costs: Vec<f64>,
    /// Why starts led nowhere.
    pub failures: Vec<String>,
    /// Optima.
    pub clusters: Vec<ClusterRecord>,
    /// In words.
    pub sentences: Vec<String>,
}

/// An optimum that several starts led to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ClusterRecord {
    /// Number of starts.
    pub starts: usize,
    /// Its cost.
    pub cost: f64,
}

/// Whether a function varies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VariesRecord {
    /// Function.
    pub name: String,
    /// p-value of a constant.
    pub p_value: f64,
    /// In words.
    pub sentence: String,
}

/// An interval from refits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BootstrapRecord {
    /// The number.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Interval; `null` where too few refits ended well.
    pub interval: Option<[f64; 2]>,
}

/// An experiment that might be made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CandidateRecord {
    /// Name.
    pub name: String,
    /// Directions that it would show and that are not seen now; `null` if it cannot be simulated.
    pub new_directions: Option<usize>,
    /// Ratio of the geometric mean of the standard errors, after to before (D).
    pub volume: Option<f64>,
    /// Ratio of their root mean squares (A).
    pub average: Option<f64>,
    /// Ratio of the largest (E).
    pub worst: Option<f64>,
    /// In words.
    pub sentence: String,
}

/// The motion from another initial state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PredictionRecord {
    /// Name.
    pub name: String,
    /// s.
    pub times: Vec<f64>,
    /// Displacement, m.
    pub displacement: Vec<f64>,
    /// Band, m.
    pub band: Option<Vec<[f64; 2]>>,
    /// Envelope over the extreme devices, m.
    pub worst: Option<Vec<[f64; 2]>>,
    /// The extreme device that is furthest, and by how much, m.
    pub furthest: Option<(String, f64)>,
}
