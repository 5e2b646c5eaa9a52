//! Likelihood profile of one quantity.
//!
//! The profile of `q(theta)` is `P(v) = min J(theta)` subject to `q(theta) = v` and the model's
//! constraints. With `J` a chi-square, the values with
//!
//! ```text
//! P(v) - J(optimum) <= quantile            (n ln(P(v)/J(optimum)) without sigma, n samples)
//! ```
//!
//! are a confidence interval, 95 % for the quantile 3.841 of chi-square with one degree of freedom.
//! `J` is the whole cost, penalties and priors included: with penalties the interval is that of the
//! penalised problem. A flat profile is that of a quantity that the data do not determine.
//!
//! Sources: S. S. Wilks, *Annals of Mathematical Statistics* 9 (1938) 60-62; A. Raue et al.,
//! "Structural and practical identifiability analysis of partially observed dynamical models by
//! exploiting the profile likelihood", *Bioinformatics* 25 (2009) 1923-1929.

mod continuation;

use crate::identifiability::Target;
use crate::problem::Problem;
use crate::step::SimulationError;
use continuation::ProfileSearch;

/// The 95 % quantile of chi-square with one degree of freedom.
pub const QUANTILE_95: f64 = 3.841_458_820_694_124;
/// Search limit without stated limits, as a multiple of the size of the quantity.
const FAR: f64 = 1e3;
/// Settings of a profile.
#[derive(Debug, Clone, PartialEq)]
pub struct ProfileSettings {
    /// Rise of the cost at which the profile ends.
    pub quantile: f64,
    /// Range of values to search, in the unit of the quantity.
    pub limits: [f64; 2],
    /// First step, in the unit of the quantity; by default half a standard deviation by the covariance, or a share of the
    /// quantity's size where no covariance exists.
    pub step: Option<f64>,
    /// Largest number of steps on each side; steps double where the profile is flat.
    pub steps: usize,
}

impl Default for ProfileSettings {
    fn default() -> Self {
        Self {
            quantile: QUANTILE_95,
            limits: [f64::NEG_INFINITY, f64::INFINITY],
            step: None,
            steps: 40,
        }
    }
}

/// Classification of a profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interval {
    /// Both ends of the interval are found.
    Identified,
    /// One end is found.
    OneSided,
    /// No end is found: the data do not determine the quantity.
    Flat,
}

/// End of a profile on one side.
#[derive(Debug, Clone, PartialEq)]
pub enum End {
    /// The cost rises by the quantile.
    Rise,
    /// The cost rises by the quantile because of the named constraints; without them the rise is smaller.
    RiseBy(Vec<String>),
    /// The bound of the quantity, or the stated limit, is reached first.
    Bound,
    /// No end within a thousand times the size of the quantity.
    Far,
    /// The limit of steps is reached.
    Steps,
    /// No fit succeeds further out; the reason.
    Failed(String),
}

/// The profile of one quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Name of the quantity.
    pub name: String,
    /// Unit of the quantity.
    pub unit: String,
    /// Value at the optimum.
    pub optimum: f64,
    /// Cost at the optimum.
    pub optimum_cost: f64,
    /// Fixed values of the quantity, rising.
    pub values: Vec<f64>,
    /// Cost `P(v)` at each value.
    pub costs: Vec<f64>,
    /// Parameters at each value.
    pub parameters: Vec<Vec<f64>>,
    /// Ends of the interval; `None` where not found.
    pub interval: [Option<f64>; 2],
    /// Reasons for the lower and upper end.
    pub ends: [End; 2],
    /// Classification.
    pub verdict: Interval,
    /// Parameters of a better minimum, if one was found.
    pub better_optimum: Option<Vec<f64>>,
}

impl Profile {
    /// The result as a sentence.
    pub fn sentence(&self) -> String {
        let Self { name, unit, .. } = self;
        let number = |x: f64| format!("{x:.6} {unit}").trim_end().to_owned();
        let mut words = match self.interval {
            [Some(low), Some(high)] => format!(
                "{name} is identified: between {} and {}",
                number(low),
                number(high)
            ),
            [Some(low), None] => format!("{name} is bounded below only: at least {}", number(low)),
            [None, Some(high)] => format!("{name} is bounded above only: at most {}", number(high)),
            [None, None] => format!("{name} is not identifiable from these samples"),
        };
        for (side, end) in ["below", "above"].iter().zip(&self.ends) {
            let why = match end {
                End::Rise => continue,
                End::RiseBy(names) => format!(
                    "the rise {side} is due to {}, not to the samples alone",
                    names.join(" and ")
                ),
                End::Bound => format!("{side} the profile reaches its bound or limit"),
                End::Far => format!("{side} there is no end within {FAR} times the optimum's size"),
                End::Steps => format!("{side} the limit of steps was reached"),
                End::Failed(reason) => format!("{side} no fit was found ({reason})"),
            };
            words.push_str("; ");
            words.push_str(&why);
        }
        if self.better_optimum.is_some() {
            words.push_str("; the profile found a better minimum: repeat the fit from there");
        }
        words
    }
}

/// Computes the profile of a quantity that is linear in the parameters, no ratio, about the fitted parameters `optimum`.
///
/// The value moves outwards from the optimum. Each fit (Gauss–Newton under the constraints) starts from its neighbours,
/// until the cost has risen by the quantile or a bound, a limit or the number of steps is reached. A secant method on the
/// square root of the rise, which is linear in `v` where the response is linear in the parameters, then locates the ends.
///
/// # Errors
/// A [`SimulationError`] if the simulation at the optimum fails.
///
/// # Panics
/// For a ratio, and for a time outside the grid.
pub fn profile(
    problem: &Problem,
    optimum: &[f64],
    of: &Target,
    how: &ProfileSettings,
) -> Result<Profile, SimulationError> {
    ProfileSearch::new(problem, optimum, of, how).map(ProfileSearch::run)
}
