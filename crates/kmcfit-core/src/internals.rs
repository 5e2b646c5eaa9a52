//! Items that the application, tests, benches and fuzz targets of kmcfit use beyond the public API. No semantic versioning
//! applies to them. Every item is listed by name.

pub mod assessment {
    pub use crate::assessment::{
        AmplitudeRival, BEYOND_SIGMA, BasisComparison, BasisTest, ClassicalEstimate,
        ClassicalMethod, CoarseBasis, Draw, EXACT, EquationErrorIntervals, Estimate,
        EstimateErrors, EstimateStatus, Extension, ExtensionTest, FitAssessment, FitStatistics,
        FitWarning, FunctionInGap, FunctionSummary, GapAssessment, GapStatus, Implausible,
        LargeCovariance, MOST_WITH_COVARIANCE, ModelTests, NoDraws, NoIntervals, POOR,
        Plausibility, RECOVERY_TOLERANCE, RecordError, ResidualPattern, Roughness, SampleFault,
        StepCheck, TruthErrors, Unidentified, VerdictAssumption, VerdictLevel, VerdictReason,
        all_diagnostics, constant_probability, draws, estimates, function_summaries, is_same_truth,
        outliers, pattern, standard_error, verdict_assumptions, verdict_level, verdict_reasons,
    };
}
pub mod builder {
    pub use crate::builder::{
        BasisSpec, BuildError, BuildNotice, Builder, Built, ChannelSpec, CoefficientSpec,
        Contradiction, Knots, PenaltySpec, PenaltyWeight, Record, ScalarSpec, SensorSpec, Start,
        WeightSearch, listed,
    };
}
pub mod constraints {
    pub use crate::constraints::{
        Cone, Constraint, ConstraintError, Constraints, RowGroup, Rows, Shape, TOLERANCE,
        TimeHistory,
    };
}
pub mod diagnostics {
    pub use crate::diagnostics::{
        NORMAL_975, ResidualDiagnostics, SIGNIFICANCE, UntestedReason, Whiteness, WhitenessResult,
        chi_square_one, detrended, normal_half_width, offset_and_drift, outlier_indices, rms,
        standard_deviation, student_half_width,
    };
}
pub mod functions {
    pub use crate::functions::{
        Basis, CoefficientFunction, CoefficientKind, CoefficientSet, Design, Gram,
        Parameterization, Penalty, Prior, Ratios, ScalarParameter, ScalarValue, TotalVariation,
        WeightRule, basis,
    };
}
pub mod host {
    pub use crate::host::{Host, set_host};
}
pub mod identifiability {
    pub use crate::identifiability::{
        Band, BandSettings, BandSide, Bands, CandidateChannel, CandidateExperiment, Classification,
        ClassificationKind, Condition, CovarianceKind, EquationRows, FunctionClassification, Gain,
        MeanOverRecord, Means, RankFinding, RankFindingKind, Ranked, RelativeChange,
        ResolvedDirection, ScaleFreedom, ScaleSource, ScalingAmbiguity, Sensitivity,
        SingularSpectrum, anchors, classify_functions, is_negligible, is_unhindered,
        rank_experiments, residual_spread, scale_source, structural_rank,
    };
    pub use crate::spans::span_words;
}
pub mod objective {
    pub use crate::objective::{
        Evaluation, GradientCheck, GradientKind, SimulatedRecord, state_scales,
    };
}
pub mod problem {
    pub use crate::problem::{Jumps, Problem, ProblemError, ProblemParts};
}
pub mod qp {
    pub use crate::qp::{ConicStatus, Kkt, ResponseVariables, StageLayout, Subproblem, project};
}
pub mod noise {
    pub use crate::noise::{
        Autoregression, Correlation, CorrelationLaw, KernelCovariance, automatic_bandwidth,
        kernel_sum,
    };
}
pub mod number_format {
    pub use crate::number_format::{at_most, significant};
}
pub mod record {
    pub use crate::record::{
        BaseMotion, Channel, ChannelKind, Experiment, Input, InputError, InputErrorKind, Loss,
        NoiseEstimate, NoiseModel, ScoreCovariance, Sensor, Waveform, Weighting, integral_over,
    };
}
pub mod signal {
    pub use crate::signal::{
        ExcitationShape, Extremes, Interpolation, Mobility, SecondOrder, Signal, Spectrum,
        SweepLaw, band_pass, clipped, cut_off, decimate, decimation_filter, driven_oscillator,
        dropouts, even_spacing, high_pass, low_pass, median, median_spacing, onset, quantisation,
        spikes, two_forced_modes, two_modes,
    };
}
pub mod simd {
    pub use crate::simd::{LIMIT, arithmetics, check_limit};
}
pub mod simulate {
    pub use crate::simulate::{
        Cause, Engine, EngineMode, SimulationError, Trajectory, arithmetic, continuous_adjoint,
        reference,
    };
}
pub mod solvers {
    pub use crate::problem::FEW_PARAMETERS;
    pub use crate::solvers::{
        ActiveGroup, Attempt, BoundedValue, CheckpointStore, CheckpointUnit, ConditionFailure,
        CycleCount, EquationBalance, EquationForm, EquationPart, EquationShare, ExactF64s, Fit,
        FitSettings, Gap, GridNotice, Initial, IterationEvent, IterationRecord, Measurements,
        MissingMeasurement, MissingTerm, Observer, OnNodes, Optimality, PathPoint, QpSolver,
        Reason, Solver, SolverState, StartProjection, StartStrategy, Status, Stopping,
        UnsupportedRecord, WeightPath, WidthNotice, active_constraints, choose_weight,
        choose_weight_watched, cycles, equation_balance, equation_error, equation_rows,
        estimate_states, fit, fit_from, fit_on_reduced_widths, fit_on_refined_grids,
        fit_with_noise, fit_with_noise_watched, missing_terms, no_response, number_or_nan,
        predict_validation, stored_fit, timed,
    };
}
pub mod study {
    pub use crate::study::{
        Choice, EquivalentSystem, IdentifiedSystem, Linear, PredictedChannel, PredictedResponse,
        PredictionSummary, Profile, ProfileSettings, ReferenceValues, Target, bootstrap,
        constancy_test, equivalent_coefficients, equivalent_systems, extremes, multistart, predict,
        prediction, profile, profile_likelihood, profiles,
    };
}
pub mod system {
    pub use crate::system::{
        Excitation, Grid, InputQuantity, InputSample, Method, NodalCoefficients, StageSamples,
        State, System, SystemTangent, Term, TimePoint, quadrature, round_time,
    };
}
pub mod threads {
    pub use crate::threads::{
        analyses_at_once, available, available_for, both, interruptible, map, share, sharing,
        spawn_scoped,
    };
}
