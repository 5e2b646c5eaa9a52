//! Verification of a finished run: its results computed again from model file, data and parameters.
//!
//! Nothing is searched again: the model is rebuilt with the grid, the noise and the weights of the run, and evaluated at the stored
//! parameters. Cost, gradient, covariance and sigmas are computed by the reference simulation and other factorisations
//! ([`ReferenceValues`]); all numbers of the documents and tables by the operations that wrote them. The record of the search (attempts,
//! counts, weight path, history of a fit that estimates its noise) is not part of the answer and is left out.

mod difference;
mod rebuild;
mod text;

pub use difference::Difference;

use super::display_units::DisplayUnits;
use super::document::{Prediction, ResultDocument};
use super::fit_assessment::RunAssessment;
use super::npy::read_npy;
use super::parameters::ParametersDocument;
use super::result_table::ResultTable;
use super::run::{COVARIANCE, FittedModel};
use super::run_reader::Run;
use crate::config::Model;
use crate::error::InputError;
use crate::results::RequestedFiles;
use difference::{Comparison, TOLERANCE};
use kmcfit_core::internals::record::{Channel, Weighting};
use kmcfit_core::internals::solvers::{Fit, Solver};
use kmcfit_core::internals::study::ReferenceValues;
use nalgebra::DMatrix;
pub use rebuild::rebuilt_fit;
use rebuild::{Rebuilt, rebuilt};
use serde::Serialize;
use serde_json::Value;

/// Cost beside that of the start that is rounding.
const EXACT: f64 = 1e-13;
/// Largest difference of a covariance by normal equations, in the product of the standard deviations.
const COVARIANCE_TOLERANCE: f64 = 1e-6;
/// Largest relative difference of a sigma from that of the residuals: fit and estimation alternate until it changes by 1e-6.
const SIGMA: f64 = 1e-5;
/// Largest difference of the norms of two gradients, relative to that at the start.
const GRADIENT: f64 = 1e-7;

/// Parts of `result.json` that describe the search or its time.
const OF_THE_SEARCH: [&str; 10] = [
    "/seconds",
    "/timings",
    "/counts",
    "/attempts",
    "/weights",
    "/automatic",
    "/advice",
    "/model/overrides",
    "/gradient/initial_norm_squared",
    "/outcome",
];

/// Result of one check.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// Name.
    pub name: &'static str,
    /// Stored value, in words.
    pub stored: String,
    /// Recomputed value, in words.
    pub recomputed: String,
    /// Difference: relative for costs and sigmas, beside the start for a gradient, beside the standard deviations for a covariance.
    pub difference: Option<f64>,
    /// True if the stored value holds.
    pub holds: bool,
}

/// Results of all checks of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verification {
    /// Version of this format.
    pub format: u32,
    /// Version of kmcfit that verified the run.
    pub version: &'static str,
    /// True if all checks hold.
    pub holds: bool,
    /// The checks.
    pub checks: Vec<Check>,
    /// Values that do not hold.
    pub differences: Vec<Difference>,
}

impl Verification {
    /// Verifies a run. `predictions` computes those of the model file.
    ///
    /// # Errors
    /// If the model file, its data or `parameters.json` are missing, invalid, or those of another model.
    pub fn of(
        run: &Run,
        predictions: &dyn Fn(&Model, &Fit) -> Vec<Prediction>,
    ) -> Result<Self, InputError> {
        let (parameters, stored_parameters) = ParametersDocument::read(&run.folder)?;
        let Rebuilt { mut model, fit } = rebuilt(run, &parameters)?;
        keep_notices(&mut model, &run.document);
        let fit = Fit {
            history: run.history.clone(),
            ..fit
        };
        let assessment = RunAssessment::of(&model, &fit);
        let predictions = predictions(&model, &fit);
        let fitted = FittedModel {
            model: &model,
            fit: &fit,
            predictions: &predictions,
            weights: None,
            run_assessment: &assessment,
            display: DisplayUnits::default(),
            requested: RequestedFiles {
                tables: run.document.model.steps_per_row == 1,
                ..RequestedFiles::default()
            },
            computed: Default::default(),
        };
        let again = Again {
            run,
            parameters: &parameters,
            document: fitted.document(),
            fitted,
        };
        let mut checks = again.of_reference()?;
        let mut differences = Vec::new();
        for (name, found) in [
            ("result.json", again.result_document()),
            (
                "parameters.json",
                again.parameters_document(&stored_parameters),
            ),
            ("tables", again.tables()?),
        ] {
            checks.push(Check {
                name,
                stored: format!("{} values", found.count),
                recomputed: match found.differences.len() {
                    0 => format!("{} values", found.count),
                    1 => "1 differs".into(),
                    many => format!("{many} differ"),
                },
                difference: Some(found.largest),
                holds: found.differences.is_empty(),
            });
            differences.extend(found.differences);
        }
        Ok(Self {
            format: 1,
            version: env!("CARGO_PKG_VERSION"),
            holds: checks.iter().all(|check| check.holds),
            checks,
            differences,
        })
    }

    /// The checks as text.
    pub fn text(&self) -> String {
        text::text(self)
    }
}

/// Takes the notices on grids and widths, which the search wrote, from the stored document.
fn keep_notices(model: &mut Model, document: &ResultDocument) {
    model.automatic.clone_from(&document.automatic);
    let of_search = |kind: &str| matches!(kind, "grid_limited" | "width_limited");
    let kept = document.warnings.iter().filter(|w| of_search(&w.kind));
    model.warnings.extend(kept.cloned());
}

/// The run and its recomputed model.
struct Again<'a> {
    run: &'a Run,
    parameters: &'a ParametersDocument,
    document: ResultDocument,
    fitted: FittedModel<'a>,
}

impl Again<'_> {
    fn start_cost(&self) -> f64 {
        self.run.document.cost.initial.abs()
    }

    /// Checks by the reference simulation; for the equation error, which simulates no response, of its cost alone.
    fn of_reference(&self) -> Result<Vec<Check>, InputError> {
        let (document, model) = (&self.run.document, self.fitted.model);
        if model.settings.solver == Solver::EquationError {
            let cost = self.fitted.fit.best.evaluation.cost;
            return Ok(vec![self.cost(cost), self.optimality()]);
        }
        let kind = self.parameters.covariance_kind;
        let theta = &self.parameters.values;
        let reference = ReferenceValues::at(&model.problem, theta, kind).map_err(|breakdown| {
            InputError::file(&self.run.folder, "the stored parameters have no response")
                .found(breakdown)
                .expected("the parameters of a finished fit")
        })?;
        let mut checks = vec![self.cost(reference.cost)];
        checks.extend(match &document.optimality {
            Some(_) => Some(self.optimality()),
            None => self.gradient(&reference),
        });
        checks.extend(self.covariance(&reference));
        checks.extend(self.large_covariance()?);
        checks.extend(self.noise(&reference));
        Ok(checks)
    }

    fn cost(&self, recomputed: f64) -> Check {
        let stored = self.run.document.cost.r#final;
        let off = relative(stored, recomputed);
        let floor = EXACT * self.start_cost();
        Check {
            name: "cost",
            stored: text::number(stored),
            recomputed: text::number(recomputed),
            difference: Some(off),
            holds: off <= TOLERANCE || (stored - recomputed).abs() <= floor,
        }
    }

    /// First-order condition, by the linearised problem at the stored parameters.
    fn optimality(&self) -> Check {
        let word = |is_minimum: Option<bool>| match is_minimum {
            Some(true) => "a minimum".to_owned(),
            Some(false) => "no minimum".to_owned(),
            None => "not measured".to_owned(),
        };
        let stored = self.run.document.optimality.map(|o| o.holds());
        let again = self.fitted.fit.optimality;
        Check {
            name: "KKT residual",
            stored: word(stored),
            recomputed: word(again.map(|o| o.holds())),
            difference: again.map(|o| o.stationarity.max(o.feasibility)),
            holds: stored.is_none() || stored == again.map(|o| o.holds()),
        }
    }

    /// Norm of the gradient; not for the continuous adjoint, which is not the derivative of the cost.
    fn gradient(&self, reference: &ReferenceValues) -> Option<Check> {
        let problem = &self.fitted.model.problem;
        let is_discrete = self.run.document.model.gradient == "discrete";
        let euclidean = reference.gradient.as_ref().filter(|_| is_discrete)?;
        let functions = &problem.functions;
        let norm = functions
            .norm_squared(&functions.gram_solve(euclidean))
            .sqrt();
        let stored = self.run.document.gradient.final_norm_squared.sqrt();
        let size = self.run.document.gradient.initial_norm_squared.sqrt();
        let off = (norm - stored).abs() / size.max(stored);
        Some(Check {
            name: "gradient",
            stored: text::number(stored),
            recomputed: text::number(norm),
            difference: Some(off),
            holds: off <= GRADIENT,
        })
    }

    fn covariance(&self, reference: &ReferenceValues) -> Option<Check> {
        let stored = self.parameters.covariance.as_ref()?;
        let n = stored.len();
        let stored = DMatrix::from_fn(n, n, |i, j| stored[i][j]);
        // A covariance of another kind has the factorisation of the fit.
        let of_fit = || self.fitted.bands()?.covariance.as_ref();
        let found = reference.covariance.as_ref().or_else(of_fit)?;
        Some(covariance_check(&stored, found))
    }

    /// Covariance of 65 to 1000 parameters in its file. Its standard errors are those of a dense decomposition in the tests.
    fn large_covariance(&self) -> Result<Option<Check>, InputError> {
        let large = self.fitted.large_covariance();
        let Some(found) = large.and_then(|large| large.covariance.as_ref()) else {
            return Ok(None);
        };
        let path = self.run.folder.join(COVARIANCE);
        let stored = read_npy(&path, found.nrows(), found.ncols())?;
        Ok(Some(covariance_check(&stored, found)))
    }

    /// Sigmas of the residuals of channels with white noise. Weights of penalties change the degrees of freedom.
    fn noise(&self, reference: &ReferenceValues) -> Option<Check> {
        let problem = &self.fitted.model.problem;
        let pairs = problem.channels().zip(&reference.sigmas);
        let differences = pairs.filter_map(|(channel, found)| match channel.weighting() {
            Weighting::Estimated { sigma } => Some(relative(*sigma, (*found)?)),
            _ => None,
        });
        let off = differences
            .reduce(f64::max)
            .filter(|_| problem.penalties.is_empty())?;
        let sigma = reference.sigmas.iter().flatten().next()?;
        let stored = problem
            .channels()
            .find(|c| is_estimated(c))?
            .weighting()
            .sigma(0)?;
        Some(Check {
            name: "noise",
            stored: format!("sigma {}", text::number(stored)),
            recomputed: text::number(*sigma),
            difference: Some(off),
            holds: off <= SIGMA,
        })
    }

    fn result_document(&self) -> Comparison {
        let start = self.start_cost();
        let norm = self.run.document.gradient.initial_norm_squared;
        let floor = |place: &str| match place {
            "/gradient/final_norm_squared" => GRADIENT * GRADIENT * norm,
            "/cost/ratio" => EXACT,
            _ if place.starts_with("/cost/") || place.ends_with("/cost") => EXACT * start,
            _ if place.starts_with("/optimality/") => TOLERANCE,
            _ => 0.0,
        };
        let fresh = value(&self.document);
        let mut left_out = OF_THE_SEARCH.to_vec();
        if has_gap(&self.run.document) {
            // Cycles in a gap are counted by fits of the search.
            left_out.extend(["/verdict", "/identifiability", "/findings"]);
        }
        let mut found =
            Comparison::of_json("result.json", [&self.run.value, &fresh], &left_out, &floor);
        found.add(self.outcome());
        found
    }

    fn outcome(&self) -> Comparison {
        let pair = [&self.run.document, &self.document].map(|d| value(&d.outcome.status));
        Comparison::of_json("result.json", [&pair[0], &pair[1]], &[], &|_| 0.0)
    }

    fn parameters_document(&self, stored: &Value) -> Comparison {
        let fresh = value(&self.fitted.parameters(&self.document));
        let deviations: Vec<f64> = match &self.parameters.covariance {
            Some(rows) => (rows.iter().enumerate())
                .map(|(i, row)| row.get(i).map_or(0.0, |v| v.abs().sqrt()))
                .collect(),
            None => Vec::new(),
        };
        let floor = |place: &str| {
            let mut parts = place.split('/').skip(1);
            let is_covariance = parts.next() == Some("covariance");
            let mut deviation = || {
                deviations
                    .get(parts.next()?.parse::<usize>().ok()?)
                    .copied()
            };
            match (is_covariance, deviation(), deviation()) {
                (true, Some(a), Some(b)) => EXACT * a * b,
                _ => 0.0,
            }
        };
        Comparison::of_json("parameters.json", [stored, &fresh], &[], &floor)
    }

    /// Costs of the iterations: `cost_ratio = cost / J0`, where all of them have the noise and the weights of the last one.
    fn history(&self) -> Comparison {
        let problem = &self.fitted.model.problem;
        let is_stated = |c: &Channel| c.correlation().is_none() && !is_estimated(c);
        let is_one_search = problem.channels().all(is_stated)
            && self.run.document.weights.is_none()
            && self.document.cost.initial > 0.0;
        let mut found = Comparison::default();
        for row in self.run.history.iter().filter(|_| is_one_search) {
            let pair = [row.cost_ratio, row.cost / self.document.cost.initial].map(Value::from);
            let place = format!("history.csv, iteration {}", row.iteration);
            found.add(Comparison::of_json(
                &place,
                [&pair[0], &pair[1]],
                &[],
                &|_| EXACT,
            ));
        }
        found
    }

    fn tables(&self) -> Result<Comparison, InputError> {
        let mut found = self.history();
        found.add(Comparison::of_table(
            "functions.csv",
            &self.run.functions,
            &self.fitted.functions_table(),
        ));
        let trajectory = self.fitted.trajectories();
        found.add(Comparison::of_table(
            "trajectory.csv",
            &self.run.trajectory,
            &trajectory,
        ));
        for (name, fresh) in self.fitted.samples() {
            let stored = ResultTable::read(&self.run.folder.join(&name))?;
            found.add(Comparison::of_table(&name, &stored, &fresh));
        }
        Ok(found)
    }
}

fn is_estimated(channel: &Channel) -> bool {
    matches!(channel.weighting(), Weighting::Estimated { .. })
}

/// Compares two covariances of the same size by their largest difference, in the product of the standard deviations.
fn covariance_check(stored: &DMatrix<f64>, found: &DMatrix<f64>) -> Check {
    let size = |of: &DMatrix<f64>| format!("{} x {}", of.nrows(), of.ncols());
    let deviation = |i: usize| found[(i, i)].sqrt();
    let off = match stored.shape() == found.shape() {
        true => {
            let pairs = (0..found.nrows()).flat_map(|i| (0..found.ncols()).map(move |j| (i, j)));
            let each = pairs.map(|(i, j)| {
                let off = (stored[(i, j)] - found[(i, j)]).abs();
                // Parameters held by an equality have no variance.
                match () {
                    () if off == 0.0 => 0.0,
                    () if off.is_nan() => f64::INFINITY,
                    () => off / (deviation(i) * deviation(j)),
                }
            });
            each.fold(0.0, f64::max)
        }
        false => f64::INFINITY,
    };
    Check {
        name: "covariance",
        stored: size(stored),
        recomputed: size(found),
        difference: Some(off),
        holds: off <= COVARIANCE_TOLERANCE,
    }
}

fn has_gap(document: &ResultDocument) -> bool {
    let mut all = document.findings.iter();
    all.any(|found| found.finding.kind.contains("gap"))
}

/// A document as JSON; its plain structs always serialise.
fn value(document: &impl Serialize) -> Value {
    serde_json::to_value(document).unwrap_or_default()
}

/// Relative difference of two numbers; 0 if both are zero.
fn relative(a: f64, b: f64) -> f64 {
    match a == b {
        true => 0.0,
        false => (a - b).abs() / a.abs().max(b.abs()),
    }
}
