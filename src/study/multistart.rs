//! Fits from many starts: their costs, their clusters, and whether two optima share a valley.
//!
//! Starts are a Latin hypercube (M. D. McKay, R. J. Beckman, W. J. Conover, *Technometrics* 21 (1979)
//! 239-245): each range is cut into as many parts as there are starts, and every part is used once.
//! Optima are told apart by what free motion can show, the ratios of the functions to the mass, and by
//! their motions, not by their costs: two different devices may fit alike, and one device may be
//! reached to different accuracy.

use super::parallel::map;
use super::refit::{nearest, sizes};
use super::simulate::stream;
use crate::dynamics::Device;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::solvers::{FitSettings, Status, fit, fit_from};
use rand::RngExt;

/// Where starts lie.
#[derive(Debug, Clone, PartialEq)]
pub enum Ranges {
    /// A range for each parameter, scalars included.
    Parameters(Vec<[f64; 2]>),
    /// A range for each function, which starts constant, and then one for each scalar. Fixed
    /// functions have a range that is not used.
    Constants(Vec<[f64; 2]>),
}

impl Ranges {
    /// The parameters' own bounds, by the constraints about one parameter alone; `None` unless every
    /// parameter has two.
    pub fn of_bounds(problem: &Problem) -> Option<Self> {
        let mut ranges = vec![[f64::NEG_INFINITY, f64::INFINITY]; problem.parameters()];
        for group in &problem.constraints.groups {
            for i in 0..group.rows.len() {
                let Some((j, a)) = group.single(i) else {
                    continue;
                };
                let [lower, upper] = group.bounds(i).map(|b| b / a);
                let [low, high] = if a > 0.0 {
                    [lower, upper]
                } else {
                    [upper, lower]
                };
                ranges[j] = [ranges[j][0].max(low), ranges[j][1].min(high)];
            }
        }
        let bounded = ranges.iter().flatten().all(|b| b.is_finite());
        bounded.then_some(Self::Parameters(ranges))
    }
}

/// How the fits are run.
#[derive(Debug, Clone)]
pub struct Multistart {
    /// Where they start.
    pub ranges: Ranges,
    /// How many.
    pub starts: usize,
    /// Seed of the starts.
    pub seed: u64,
    /// Most threads; the results do not depend on it.
    pub threads: usize,
    /// Whether a fit may climb the ladder of starts; without it every fit says where its own start
    /// leads.
    pub ladder: bool,
    /// The fits.
    pub settings: FitSettings,
}

/// One fit.
#[derive(Debug, Clone)]
pub struct Run {
    /// Its start, within the constraints.
    pub start: Vec<f64>,
    /// Where it led; `None` if the start has no motion, or the constraints no point.
    pub found: Option<Found>,
    /// How it ended, or why there is nothing.
    pub status: Status,
    /// The same in words.
    pub reason: String,
}

/// The end of one fit.
#[derive(Debug, Clone)]
pub struct Found {
    /// Parameters.
    pub parameters: Vec<f64>,
    /// Cost, devices and motions.
    pub evaluation: Evaluation,
    /// Iterations.
    pub iterations: usize,
}

/// All fits.
#[derive(Debug, Clone)]
pub struct Waterfall {
    /// In the order of the starts.
    pub runs: Vec<Run>,
    /// Indices of the runs that found something, by rising cost.
    pub order: Vec<usize>,
    /// The seed of the starts.
    pub seed: u64,
}

/// How far two optima are from each other, without unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Largest root mean square difference of a ratio `p/m`, relative to its natural size.
    pub ratios: f64,
    /// Root mean square difference of the displacements, relative to their own.
    pub motions: f64,
}

/// Optima that are one.
#[derive(Debug, Clone, PartialEq)]
pub struct Cluster {
    /// Indices of the runs, by rising cost.
    pub members: Vec<usize>,
    /// Lowest cost.
    pub cost: f64,
}

/// The starts of `how`, one list per start, before the constraints.
///
/// # Panics
/// If there is not one range for each parameter, or function and scalar.
pub fn starts(problem: &Problem, how: &Multistart) -> Vec<Vec<f64>> {
    let (Ranges::Parameters(ranges) | Ranges::Constants(ranges)) = &how.ranges;
    let mut columns = Vec::with_capacity(ranges.len());
    for (j, [low, high]) in ranges.iter().enumerate() {
        let mut random = stream(how.seed, j);
        let mut cells: Vec<usize> = (0..how.starts).collect();
        for i in (1..cells.len()).rev() {
            cells.swap(i, random.random_range(0..=i));
        }
        let place = |cell: usize| {
            let share = (cell as f64 + random.random_range(0.0..1.0)) / how.starts as f64;
            low + share * (high - low)
        };
        columns.push(cells.into_iter().map(place).collect::<Vec<f64>>());
    }
    let drawn = (0..how.starts).map(|i| columns.iter().map(|c| c[i]).collect::<Vec<f64>>());
    match &how.ranges {
        Ranges::Parameters(ranges) => {
            assert_eq!(
                ranges.len(),
                problem.parameters(),
                "one range per parameter"
            );
            drawn.collect()
        }
        Ranges::Constants(ranges) => {
            let functions = problem.functions.ranges().len();
            let scalars = problem.functions.scalars().len();
            assert_eq!(ranges.len(), functions + scalars, "one range each");
            drawn.map(|levels| constants(problem, &levels)).collect()
        }
    }
}

fn constants(problem: &Problem, levels: &[f64]) -> Vec<f64> {
    let grid = &problem.oscillator.grid;
    let mut theta = Vec::with_capacity(problem.parameters());
    for (function, level) in problem.functions.iter().zip(levels) {
        if let Some(basis) = &function.basis {
            theta.extend(basis.constant(grid, *level));
        }
    }
    theta.extend(&levels[problem.functions.ranges().len()..]);
    theta
}

/// Runs all fits. A fit that fails is a record with its reason.
pub fn multistart(problem: &Problem, how: &Multistart) -> Waterfall {
    let starts = starts(problem, how);
    let runs = map(starts.len(), how.threads, |i| run(problem, how, &starts[i]));
    let mut order: Vec<usize> = (0..runs.len())
        .filter(|i| runs[*i].found.is_some())
        .collect();
    let cost = |i: &usize| {
        let found = runs[*i].found.as_ref();
        found.map_or(f64::INFINITY, |f| f.evaluation.cost)
    };
    // Stable: equal costs stay in the order of the starts.
    order.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
    Waterfall {
        runs,
        order,
        seed: how.seed,
    }
}

fn run(problem: &Problem, how: &Multistart, start: &[f64]) -> Run {
    let failed = |start: &[f64], reason: String| Run {
        start: start.to_vec(),
        found: None,
        status: Status::Failed,
        reason,
    };
    let Some(start) = nearest(problem, start, &sizes(problem, start)) else {
        return failed(
            start,
            "the start cannot be brought into the constraints".into(),
        );
    };
    let result = match how.ladder {
        true => fit(problem, &start, &how.settings, &mut |_| {}),
        false => fit_from(problem, &start, &how.settings),
    };
    match result {
        Err(breakdown) => failed(&start, breakdown.to_string()),
        Ok(fit) => Run {
            start,
            found: Some(Found {
                parameters: fit.best.parameters,
                evaluation: fit.best.evaluation,
                iterations: fit.history.len(),
            }),
            status: fit.outcome.status,
            reason: fit.outcome.reason,
        },
    }
}

impl Waterfall {
    /// Sorted costs.
    pub fn costs(&self) -> Vec<f64> {
        let found = self
            .order
            .iter()
            .filter_map(|i| self.runs[*i].found.as_ref());
        found.map(|f| f.evaluation.cost).collect()
    }

    /// How many fits found nothing.
    pub fn failures(&self) -> usize {
        self.runs.len() - self.order.len()
    }

    /// Clusters by rising cost: a run belongs to the first cluster whose best member is no further
    /// than `tolerance`, in ratios and motions both. Only converged runs are told apart; the others
    /// have not reached an optimum.
    pub fn clusters(&self, problem: &Problem, tolerance: Distance) -> Vec<Cluster> {
        let mut clusters: Vec<Cluster> = Vec::new();
        for &i in &self.order {
            let run = &self.runs[i];
            let (Some(found), Status::Converged) = (&run.found, run.status) else {
                continue;
            };
            let near = |cluster: &&mut Cluster| {
                let best = self.runs[cluster.members[0]].found.as_ref();
                best.is_some_and(|best| {
                    let apart = distance(problem, &best.evaluation, &found.evaluation);
                    apart.ratios <= tolerance.ratios && apart.motions <= tolerance.motions
                })
            };
            match clusters.iter_mut().find(near) {
                Some(cluster) => cluster.members.push(i),
                None => clusters.push(Cluster {
                    members: vec![i],
                    cost: found.evaluation.cost,
                }),
            }
        }
        clusters
    }
}

/// How far two points are from each other.
pub fn distance(problem: &Problem, a: &Evaluation, b: &Evaluation) -> Distance {
    let natural = problem.natural_sizes(a);
    let mut ratios = 0.0f64;
    for (which, assembly) in problem.functions.assemblies().iter().enumerate() {
        let (one, two) = (a.device_of(which), b.device_of(which));
        for (j, (p, q)) in one.coefficients.iter().zip(&two.coefficients).enumerate() {
            let size = natural[assembly[j + 1]] / natural[assembly[0]];
            let changes = (0..p.len()).map(|i| p[i] / one.mass[i] - q[i] / two.mass[i]);
            let change = rms(changes);
            if change > 0.0 {
                ratios = ratios.max(change / size);
            }
        }
    }
    let pairs = a.trajectories.iter().zip(&b.trajectories);
    let changes = pairs.flat_map(|(a, b)| {
        let nodes = a.displacement.iter().zip(&b.displacement);
        nodes.map(|(a, b)| a - b)
    });
    let own = a
        .trajectories
        .iter()
        .flat_map(|t| t.displacement.iter().copied());
    let (change, own) = (rms(changes), rms(own));
    Distance {
        ratios,
        motions: if change > 0.0 { change / own } else { 0.0 },
    }
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0usize), |(s, n), v| (s + v * v, n + 1));
    (sum / count.max(1) as f64).sqrt()
}

/// The cost along two paths between two points; infinite where there is no motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Paths {
    /// Along `(1 - s) a + s b`, both ends included.
    pub straight: Vec<f64>,
    /// Along the gauge: the mass goes from one to the other geometrically, `m_a^(1-s) m_b^s`, and the
    /// ratios to it go straight, so that between devices with the same ratios nothing but the common
    /// factor changes. `None` where the functions cannot follow, as when one is fixed.
    pub gauge: Option<Vec<f64>>,
}

impl Paths {
    /// Whether one of the paths never rises by more than `rise` above the higher end: then the two
    /// are ends of one valley. No path below it proves nothing.
    pub fn one_valley(&self, rise: f64) -> bool {
        let low = |path: &Vec<f64>| {
            let ends = path[0].max(path[path.len() - 1]);
            path.iter().all(|cost| *cost <= ends + rise)
        };
        low(&self.straight) || self.gauge.as_ref().is_some_and(low)
    }
}

/// The cost at `points` steps between the parameters `a` and `b`.
pub fn between(problem: &Problem, a: &[f64], b: &[f64], points: usize) -> Paths {
    let points = points.max(1);
    let shares: Vec<f64> = (0..=points).map(|i| i as f64 / points as f64).collect();
    let cost = |theta: &[f64]| problem.evaluate(theta).map_or(f64::INFINITY, |e| e.cost);
    let mix = |s: f64| -> Vec<f64> {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| (1.0 - s) * a + s * b).collect()
    };
    let straight = shares.iter().map(|s| cost(&mix(*s))).collect();
    let gauge: Option<Vec<Vec<f64>>> = shares
        .iter()
        .map(|s| along_gauge(problem, a, b, *s, mix(*s)))
        .collect();
    Paths {
        straight,
        gauge: gauge.map(|path| path.iter().map(|theta| cost(theta)).collect()),
    }
}

/// The point at `s` of the gauge path, functions of single experiments and scalars straight.
fn along_gauge(
    problem: &Problem,
    a: &[f64],
    b: &[f64],
    s: f64,
    straight: Vec<f64>,
) -> Option<Vec<f64>> {
    let mut theta = straight;
    let (one, two) = (problem.functions.device(a), problem.functions.device(b));
    if one.mass.iter().chain(&two.mass).any(|m| *m <= 0.0) {
        return None;
    }
    let between = mixed(&one, &two, s);
    let grid = &problem.oscillator.grid;
    let assembly = problem.functions.assembly(0);
    for (&f, values) in assembly.iter().zip(between.functions()) {
        let basis = problem.functions.get(f).basis.as_ref()?;
        let range = problem.functions.ranges()[f].clone();
        theta[range].copy_from_slice(&basis.project(grid, values)?);
    }
    Some(theta)
}

fn mixed(one: &Device, two: &Device, s: f64) -> Device {
    let pairs = one.mass.iter().zip(&two.mass);
    let mass: Vec<f64> = pairs.map(|(a, b)| a.powf(1.0 - s) * b.powf(s)).collect();
    let coefficient = |p: &Vec<f64>, q: &Vec<f64>| -> Vec<f64> {
        let ratio = |i: usize| (1.0 - s) * p[i] / one.mass[i] + s * q[i] / two.mass[i];
        (0..p.len()).map(|i| mass[i] * ratio(i)).collect()
    };
    let pairs = one.coefficients.iter().zip(&two.coefficients);
    let coefficients = pairs.map(|(p, q)| coefficient(p, q)).collect();
    Device { mass, coefficients }
}
