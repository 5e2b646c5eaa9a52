//! Continuation along a likelihood profile, outwards from the optimum on both sides.

use super::{End, FAR, Interval, Profile, ProfileSettings};
use crate::constraints::RowGroup;
use crate::identifiability::{Quantity, Target};
use crate::problem::Problem;
use crate::qp::Subproblem;
use crate::solvers::{Iterate, Status, active_constraints, fit_from};
use crate::step::SimulationError;
use crate::study::refit::{nearest, settings, sizes};

/// Rise in one step, in quantiles, above which a fit is taken to have left the minimum.
const LOST: f64 = 1e4;
/// Name of the equality row that fixes the quantity.
const HELD: &str = "the profiled number";
/// Rise of a step, as a share of the quantile, below which the next step is doubled.
const SLOW: f64 = 0.15;
/// Rise of a step, as a share of the quantile, above which the next step is halved.
const FAST: f64 = 0.6;
/// Relative accuracy of the root of the rise at an end.
const END: f64 = 1e-9;
/// Largest number of refits for one end.
const END_FITS: usize = 60;
/// Decrease of the cost below the optimum's, as a share of the quantile, that counts as a better minimum.
const BETTER: f64 = 1e-3;
/// First step without a covariance, as a share of the quantity's size.
const FIRST_STEP: f64 = 0.02;
/// Distance kept from a bound found by a convex program, as a share of the quantity's size.
const SPARE: f64 = 1e-6;
/// A rise is attributed to a constraint if less than this share of the quantile remains without it.
const BLAMED: f64 = 0.5;

/// Names of the constraints that are active at a point, without the row that fixes the quantity.
fn names(problem: &Problem, point: &Iterate) -> Vec<String> {
    let active = active_constraints(problem, point).into_iter();
    active
        .map(|group| group.name)
        .filter(|name| name != HELD)
        .collect()
}

/// The problem with the quantity, made at zero parameters, fixed at `value`.
fn held(problem: &Problem, (of, time): (&Quantity, Option<f64>), value: f64) -> Problem {
    let mut held = problem.clone();
    let mut group = RowGroup::new(HELD);
    let right = value - of.value;
    let time = time.unwrap_or(problem.system.grid.start());
    group.push(of.gradient.iter().copied(), [right, right], [time, time]);
    held.parts_mut().constraints.groups.push(group);
    held
}

/// One refit.
#[derive(Clone)]
struct ProfilePoint {
    value: f64,
    cost: f64,
    point: Iterate,
    /// Names of the active constraints.
    active: Vec<String>,
}

/// The computation of one profile.
pub struct ProfileSearch<'a> {
    problem: &'a Problem,
    /// At zero parameters.
    of: Quantity,
    time: Option<f64>,
    how: &'a ProfileSettings,
    sizes: Vec<f64>,
    base: f64,
    sample_count: f64,
    sigma: bool,
    points: Vec<ProfilePoint>,
}

impl<'a> ProfileSearch<'a> {
    /// Starts at the optimum, after a refit to full accuracy.
    pub fn new(
        problem: &'a Problem,
        optimum: &[f64],
        of: &Target,
        how: &'a ProfileSettings,
    ) -> Result<Self, SimulationError> {
        let start = fit_from(problem, optimum, &settings())?.best;
        let cost = start.evaluation.cost;
        let time = of.time();
        let of = of.at(problem, &vec![0.0; problem.parameters()]);
        let of = of.filter(|of| of.value.is_finite());
        let of = of.expect("a quantity that is linear in the parameters");
        Ok(Self {
            problem,
            time,
            how,
            sizes: sizes(problem, &start.parameters),
            base: cost,
            sample_count: problem.sample_count() as f64,
            sigma: problem.channels().all(|c| c.weighting().is_sigma()),
            points: vec![ProfilePoint {
                value: of.linear_at(&start.parameters),
                cost,
                active: names(problem, &start),
                point: start,
            }],
            of,
        })
    }

    /// Computes both sides.
    pub fn run(mut self) -> Profile {
        let first = self.points[0].clone();
        let sides = [-1.0, 1.0].map(|side| self.side(side, &first));
        self.finish(first.value, sides)
    }

    /// Rise of the cost, comparable with the quantile.
    fn rise(&self, cost: f64) -> f64 {
        match self.sigma {
            true => cost - self.base,
            false => self.sample_count * (cost / self.base.max(f64::MIN_POSITIVE)).ln(),
        }
    }

    /// Signed distance to the quantile: difference of the square roots.
    fn distance(&self, cost: f64) -> f64 {
        self.rise(cost).max(0.0).sqrt() - self.how.quantile.sqrt()
    }

    /// Best fit with the quantity fixed at `value`, started at `guess`.
    fn fit(&self, problem: &Problem, value: f64, guess: &[f64]) -> Result<ProfilePoint, String> {
        let held = held(problem, (&self.of, self.time), value);
        let start = nearest(&held, guess, &self.sizes)
            .ok_or_else(|| "the constraints do not allow the value".to_owned())?;
        let found = fit_from(&held, &start, &settings()).map_err(|b| b.to_string())?;
        match found.outcome.status {
            Status::Infeasible | Status::Failed => Err(found.outcome.reason.to_string()),
            // A large rise in one step is a different minimum: the step is too long.
            _ if self.rise(found.best.evaluation.cost) > LOST * self.how.quantile => {
                Err("no fit near the optimum was found with the number held there".to_owned())
            }
            _ => Ok(ProfilePoint {
                value,
                cost: found.best.evaluation.cost,
                active: names(&held, &found.best),
                point: found.best,
            }),
        }
    }

    /// Farthest value towards `side` within constraints and limits, and the kind of limit there.
    fn reach(&self, side: f64, theta: &[f64]) -> (f64, End) {
        let here = self.of.linear_at(theta);
        let limit = self.how.limits[usize::from(side > 0.0)];
        let size: f64 = (self.of.gradient.iter())
            .map(|(j, a)| (a * self.sizes[*j]).abs())
            .sum();
        let (far, what) = match limit.is_finite() {
            true => (limit, End::Bound),
            false => (here + side * FAR * size, End::Far),
        };
        if self.problem.constraints.is_empty() || far == here {
            return (far, what);
        }
        // Feasible point whose quantity is nearest to the far limit.
        let unit = (far - here).abs().max(f64::MIN_POSITIVE);
        let mut sub = Subproblem::new(theta.len());
        sub.residuals.push(
            self.of.gradient.iter().map(|(j, a)| (*j, a / unit)),
            (far - here) / unit,
        );
        sub.constrain(&self.problem.constraints, theta);
        for (d, size) in sub.proximal.iter_mut().zip(&self.sizes) {
            *d = 1e-12 / (size * size);
        }
        let solution = sub.solve();
        if !solution.status.is_point() {
            return (far, what);
        }
        let reached = (self.of).linear_at(&self.problem.constraints.moved(theta, &solution.z));
        if (far - reached).abs() <= 1e-3 * unit {
            return (far, what);
        }
        // A program satisfies rows on several parameters to its own accuracy only.
        let room = match self.problem.constraints.are_simple() {
            true => 0.0,
            false => SPARE * size.min((reached - here).abs()),
        };
        (reached - side * room, End::Bound)
    }

    fn first_step(&self, start: &Iterate) -> f64 {
        let covariance = self.problem.covariance(&start.evaluation);
        let of = |c| self.of.clone().with_covariance(&c, f64::INFINITY);
        let deviation = covariance.map_or(0.0, |c| 0.5 * of(c).standard_error);
        let size: f64 = (self.of.gradient.iter())
            .map(|(j, a)| (a * self.sizes[*j]).abs())
            .sum();
        let usable = deviation > 1e-9 * size && deviation < size;
        let guess = if usable { deviation } else { FIRST_STEP * size };
        self.how.step.unwrap_or(guess)
    }

    fn side(&mut self, side: f64, start: &ProfilePoint) -> (Option<f64>, End) {
        let mut step = self.first_step(&start.point);
        let (limit, what) = self.reach(side, &start.point.parameters);
        let mut here = start.clone();
        let mut behind: Option<ProfilePoint> = None;
        let mut shortened = 0;
        for _ in 0..self.how.steps {
            if (limit - here.value) * side <= 1e-12 * limit.abs() {
                return (None, what);
            }
            let wanted = here.value + side * step;
            let value = if (limit - wanted) * side < 0.0 {
                limit
            } else {
                wanted
            };
            let guess = extrapolated(behind.as_ref(), &here, value);
            let fit = self.fit(self.problem, value, &guess);
            let fit = fit.or_else(|_| self.fit(self.problem, value, &here.point.parameters));
            let next = match fit {
                Ok(next) => next,
                Err(reason) if shortened >= 6 => return (None, End::Failed(reason)),
                Err(_) => {
                    shortened += 1;
                    step *= 0.25;
                    continue;
                }
            };
            let rise = self.rise(next.cost) - self.rise(here.cost);
            self.points.push(next.clone());
            if self.distance(next.cost) >= 0.0 {
                let end = self.end(here, next);
                let active = end.active.iter();
                let new = active
                    .filter(|n| !start.active.contains(n))
                    .cloned()
                    .collect();
                return (Some(end.value), self.blame(&end, new));
            }
            if rise < SLOW * self.how.quantile {
                step *= 2.0;
            } else if rise > FAST * self.how.quantile {
                step *= 0.5;
            }
            behind = Some(std::mem::replace(&mut here, next));
        }
        (None, End::Steps)
    }

    /// Value at which the rise equals the quantile, between a point inside and one outside: the Illinois variant of the
    /// secant method (M. Dowell, P. Jarratt, *BIT* 11 (1971) 168-174).
    fn end(&mut self, inside: ProfilePoint, outside: ProfilePoint) -> ProfilePoint {
        let (mut inside, mut outside) = (inside, outside);
        let root = self.how.quantile.sqrt();
        let (mut low, mut high) = (self.distance(inside.cost), self.distance(outside.cost));
        let mut was_inside = None;
        for _ in 0..END_FITS {
            let share = low / (low - high);
            let value = inside.value + share * (outside.value - inside.value);
            let guess = extrapolated(Some(&inside), &outside, value);
            let Ok(next) = self.fit(self.problem, value, &guess) else {
                break;
            };
            let distance = self.distance(next.cost);
            self.points.push(next.clone());
            let done = distance.abs() <= END * root
                || (outside.value - inside.value).abs() <= 1e-14 * value.abs();
            let is_inside = distance < 0.0;
            let again = was_inside == Some(is_inside);
            if is_inside {
                (inside, low) = (next, distance);
                high *= if again { 0.5 } else { 1.0 };
            } else {
                (outside, high) = (next, distance);
                low *= if again { 0.5 } else { 1.0 };
            }
            was_inside = Some(is_inside);
            if done {
                return if distance < 0.0 { inside } else { outside };
            }
        }
        outside
    }

    /// Attribution of the rise at `end` to the constraints `new`, which are not active at the optimum: the fit is repeated
    /// without them.
    fn blame(&self, end: &ProfilePoint, new: Vec<String>) -> End {
        if new.is_empty() {
            return End::Rise;
        }
        let mut without = self.problem.clone();
        let constraints = &mut without.parts_mut().constraints;
        constraints.groups.retain(|g| !new.contains(&g.name));
        constraints.cones.retain(|g| !new.contains(&g.name));
        match self.fit(&without, end.value, &end.point.parameters) {
            Ok(free) if self.rise(free.cost) < BLAMED * self.how.quantile => End::RiseBy(new),
            _ => End::Rise,
        }
    }

    fn finish(self, optimum: f64, sides: [(Option<f64>, End); 2]) -> Profile {
        let least = BETTER * self.how.quantile;
        let better = (self.points.iter())
            .filter(|s| self.rise(s.cost) < -least)
            .min_by(|a, b| a.cost.total_cmp(&b.cost))
            .map(|s| s.point.parameters.clone());
        let mut points = self.points;
        sort(&mut points);
        let [(low, below), (high, above)] = sides;
        let verdict = match [low, high] {
            [Some(_), Some(_)] => Interval::Identified,
            [None, None] => Interval::Flat,
            _ => Interval::OneSided,
        };
        Profile {
            name: self.of.name.clone(),
            unit: self.of.unit.clone(),
            optimum,
            optimum_cost: self.base,
            values: points.iter().map(|s| s.value).collect(),
            costs: points.iter().map(|s| s.cost).collect(),
            parameters: points.into_iter().map(|s| s.point.parameters).collect(),
            interval: [low, high],
            ends: [below, above],
            verdict,
            better_optimum: better,
        }
    }
}

/// Parameters at `value` on the line through two points; those of the second where there is no first.
fn extrapolated(first: Option<&ProfilePoint>, second: &ProfilePoint, value: f64) -> Vec<f64> {
    let here = &second.point.parameters;
    let Some(first) = first.filter(|f| f.value != second.value) else {
        return here.clone();
    };
    let share = (value - second.value) / (second.value - first.value);
    let pairs = here.iter().zip(&first.point.parameters);
    pairs.map(|(b, a)| b + share * (b - a)).collect()
}
/// Sorts points by their values.
fn sort(points: &mut [ProfilePoint]) {
    points.sort_by(|a, b| a.value.total_cmp(&b.value));
}
