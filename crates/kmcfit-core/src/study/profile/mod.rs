//! Profile likelihood of one number.
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
//! penalised problem. A profile that never rises is a number that the samples do not see.
//!
//! Sources: S. S. Wilks, *Annals of Mathematical Statistics* 9 (1938) 60-62; A. Raue et al.,
//! "Structural and practical identifiability analysis of partially observed dynamical models by
//! exploiting the profile likelihood", *Bioinformatics* 25 (2009) 1923-1929.

mod walk;

use super::functional::Linear;
use super::parallel::map;
use crate::problem::Problem;
use crate::simulate::SimulationError;
use walk::ProfileSearch;

/// The 95 % quantile of chi-square with one degree of freedom.
pub const QUANTILE_95: f64 = 3.841_458_820_694_124;
/// Without a limit, so many sizes away is far.
const FAR: f64 = 1e3;
/// How far a profile is walked.
#[derive(Debug, Clone, PartialEq)]
pub struct ProfileSettings {
    /// The rise at which it ends.
    pub quantile: f64,
    /// Values beyond which nobody asks, in the unit of the number.
    pub limits: [f64; 2],
    /// First step, in the unit of the number; by default half a standard deviation by the
    /// covariance, or where there is none a share of the number's size.
    pub step: Option<f64>,
    /// Most steps on each side; they double where the profile is flat.
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

/// The kind of an interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interval {
    /// Both ends of its interval are found.
    Identified,
    /// One end is found.
    OneSided,
    /// None is: the samples do not see it.
    Flat,
}

/// Why a profile ends on one side.
#[derive(Debug, Clone, PartialEq)]
pub enum End {
    /// The cost rises by the quantile.
    Rise,
    /// It does, but another constraint makes it: without the constraints of these names it would not.
    RiseBy(Vec<String>),
    /// The number's own bound, or the stated limit, comes first.
    Bound,
    /// There is none within a thousand times the number's size.
    Far,
    /// The steps ran out.
    Steps,
    /// No response, or no fit, further out.
    Failed(String),
}

/// A constraint that becomes active along the profile.
#[derive(Debug, Clone, PartialEq)]
pub struct ActivationPoint {
    /// The value from which on it is, outwards from the optimum.
    pub value: f64,
    /// Its name.
    pub constraint: String,
}

/// The profile of one number.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// What was profiled.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its value at the optimum.
    pub optimum: f64,
    /// Cost there.
    pub optimum_cost: f64,
    /// The values at which it was held, rising.
    pub values: Vec<f64>,
    /// `P(v)` at each.
    pub costs: Vec<f64>,
    /// The parameters at each.
    pub parameters: Vec<Vec<f64>>,
    /// The ends of the interval; `None` where there is none.
    pub interval: [Option<f64>; 2],
    /// Why it ends, below and above.
    pub ends: [End; 2],
    /// In one word.
    pub verdict: Interval,
    /// Where other constraints become active.
    pub marks: Vec<ActivationPoint>,
    /// Parameters of a better optimum, if one was met.
    pub better_optimum: Option<Vec<f64>>,
}

impl Profile {
    /// The verdict in words.
    pub fn sentence(&self) -> String {
        let Self { name, unit, .. } = self;
        let number = |x: f64| format!("{x:.6} {unit}").trim_end().to_owned();
        let mut words = match self.interval {
            [Some(low), Some(high)] => format!(
                "{name} is identified: between {} and {}",
                number(low),
                number(high)
            ),
            [Some(low), None] => format!("{name} is only known to be at least {}", number(low)),
            [None, Some(high)] => format!("{name} is only known to be at most {}", number(high)),
            [None, None] => format!("{name} is not seen by the samples"),
        };
        for (side, end) in ["below", "above"].iter().zip(&self.ends) {
            let why = match end {
                End::Rise => continue,
                End::RiseBy(names) => format!(
                    "the rise {side} is the work of {}, not of the samples alone",
                    names.join(" and ")
                ),
                End::Bound => format!("{side} it runs into its bound or limit"),
                End::Far => format!("{side} there is no end within {FAR} times its size"),
                End::Steps => format!("{side} the steps ran out"),
                End::Failed(reason) => format!("{side} no fit was found ({reason})"),
            };
            words.push_str("; ");
            words.push_str(&why);
        }
        if self.better_optimum.is_some() {
            words.push_str("; a better optimum was met on the way: fit again from there");
        }
        words
    }
}

/// The profile of `of` about `optimum`, parameters at which the problem was fitted.
///
/// It walks outwards from the optimum, each fit (Gauss–Newton under the constraints) from its
/// neighbours, until the cost has risen by the quantile or a bound, a limit or the number of steps is
/// met; the ends are then found by a secant method on the root of the rise, which is a straight line
/// where the response is linear in the parameters.
///
/// # Errors
/// A [`SimulationError`] if the optimum has no response.
pub fn profile(
    problem: &Problem,
    optimum: &[f64],
    of: &Linear,
    how: &ProfileSettings,
) -> Result<Profile, SimulationError> {
    ProfileSearch::new(problem, optimum, of, how).map(ProfileSearch::run)
}

/// The profiles of several numbers, on up to `threads` threads; the same bits for any number of them.
///
/// # Errors
/// As [`profile()`].
pub fn profiles(
    problem: &Problem,
    optimum: &[f64],
    of: &[Linear],
    how: &ProfileSettings,
    threads: usize,
) -> Result<Vec<Profile>, SimulationError> {
    let each = map(of.len(), threads, |i| {
        profile(problem, optimum, &of[i], how)
    });
    each.into_iter().collect()
}
