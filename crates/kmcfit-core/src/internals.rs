//! Items that the application, tests, benches and fuzz targets of kmcfit use beyond the public API. No semantic versioning
//! applies to them. Every item is listed by name.

pub mod assessment {
    pub use crate::assessment::{
        AmplitudeRival, BEYOND_SIGMA, BasisComparison, BasisTest, ClassicalEstimate,
        ClassicalMethod, CoarseBasis, Doubt, EXACT, EquationErrorIntervals, Estimate,
        EstimateErrors, EstimateStatus, Extension, ExtensionTest, FitAssessment, FitStatistics,
        FunctionSummary, Implausible, ModelTests, NoIntervals, POOR, Parts, Plausibility,
        RecordError, ResidualPattern, Severity, StepCheck, TruthErrors, Unidentified, VerdictLevel,
        all_diagnostics, estimates, function_summaries, outliers, pattern, quantities_of_many,
        verdict_assumptions, verdict_reasons,
    };
}
pub mod builder {
    pub use crate::builder::{
        BuildError, Builder, ChannelSpec, Contradiction, Record, UNKNOWN_MASS, WeightSearch, listed,
    };
}
pub mod constraints {
    pub use crate::constraints::{
        Cone, Constraint, Constraints, RowGroup, Rows, Shape, TOLERANCE, TimeHistory,
    };
}
pub mod diagnostics {
    pub use crate::diagnostics::{
        ResidualDiagnostics, SIGNIFICANCE, Whiteness, chi_square_one, detrended, normal_half_width,
        offset_and_drift, outlier_indices, rms, standard_deviation, student_half_width,
    };
}
pub mod finding {
    pub use crate::finding::Finding;
}
pub mod functions {
    pub use crate::functions::{
        Basis, CoefficientFunction, CoefficientKind, CoefficientSet, Parameterization, Penalty,
        Prior, Ratio, ScalarParameter, ScalarValue, TotalVariation, WeightRule, basis,
    };
}
pub mod host {
    pub use crate::host::{Host, Instant, set_host};
}
pub mod identifiability {
    pub use crate::identifiability::{
        Band, Bands, Classification, ClassificationKind, Condition, CovarianceKind, Curve,
        FunctionClassification, Quantities, Quantity, RankFinding, Ranked, ScaleFreedom,
        ScaleSource, ScalingAmbiguity, Sensitivity, Side, SingularSpectrum, Target,
        classify_functions, rank_experiments, scale_source, structural_rank,
    };
    pub use crate::spans::span_words;
}
pub mod objective {
    pub use crate::objective::{Evaluation, GradientKind, SimulatedRecord};
}
pub mod problem {
    pub use crate::problem::{Jumps, Problem};
}
pub mod qp {
    pub use crate::qp::{ConicStatus, Kkt, Subproblem, project};
}
pub mod noise {
    pub use crate::noise::{Correlation, CorrelationLaw, automatic_bandwidth};
}
pub mod number_format {
    pub use crate::number_format::{
        and_list, at_most, count, number_or_nan, percent, resolved, significant, times_in_words,
    };
}
pub mod record {
    pub use crate::record::{
        BaseMotion, Channel, ChannelKind, Experiment, Input, InputNoise, InputNoiseKind, Loss,
        NoiseEstimate, NoiseModel, ScoreCovariance, Sensor, Waveform, Weighting, integral_over,
    };
}
pub mod signal {
    pub use crate::signal::{
        ExcitationShape, Extremes, Interpolation, Mobility, SecondOrder, Signal, Spectrum,
        SweepLaw, band_pass, clipped, cut_off, decimate, driven_oscillator, dropouts, even_spacing,
        high_pass, is_kept_up, jumps, low_pass, median, median_spacing, onset, quantisation,
        spikes, two_forced_modes, two_modes,
    };
}
pub mod simd {
    pub use crate::simd::{LIMIT, arithmetics, check_limit};
}
pub mod step {
    pub use crate::step::{
        Cause, Driven, EngineMode, SimulationError, Trajectory, arithmetic, continuous_adjoint,
        observe,
    };
}
pub mod solvers {
    pub use crate::problem::FEW_PARAMETERS;
    pub use crate::solvers::{
        ActiveGroup, Attempt, EquationBalance, EquationForm, EquationShare, Fit, FitSettings,
        GridNotice, Initial, IterationEvent, IterationRecord, Measurements, MissingTerm, Observer,
        OnNodes, Optimality, PathPoint, QpSolver, Solver, StartProjection, StartStrategy, Status,
        Stopping, WeightPath, active_constraints, choose_weight, choose_weight_watched,
        equation_balance, equation_error, equation_rows, fit, fit_from, fit_on_refined_grids,
        fit_with_noise, fit_with_noise_watched, missing_terms, no_response, predict_validation,
        timed,
    };
}
pub mod structure {
    pub use crate::structure::{Ends, Law, Structure};
}
pub mod study {
    pub use crate::study::{
        Choice, EquivalentSystem, IdentifiedSystem, PredictedChannel, PredictedResponse,
        PredictionSummary, Profile, ProfileSettings, equivalent_coefficients, equivalent_systems,
        extremes, multistart, predict, prediction, profile, profile_likelihood,
    };
}
pub mod system {
    pub use crate::system::{
        Excitation, Grid, InputQuantity, InputSample, Method, NodalCoefficients, StageSamples,
        State, SupportMotion, System, SystemTangent, TimePoint, quadrature, round_time,
    };
}
pub mod threads {
    pub use crate::threads::{
        analyses_at_once, available, available_for, both, interruptible, map, sharing,
    };
}
