//! Random convex programs in twelve decades of scale, against minima in exact arithmetic.
//!
//! Every program has small integers for data, and its minimum is found in rational numbers by trying
//! every active set. Rows, variables and cost are then multiplied by powers of two up to 2^20 and down to
//! 2^-20, which are exact in floating point and leave the minimum, in the scale of the cost, as it is.
//! `KMCFIT_QP_SEED` selects other programs.

use crate::rational::{Program, Row};
use kmcfit_core::qp::{ConicStatus, Subproblem};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Programs in all.
const PROGRAMS: u64 = 500;
/// Largest number of programs that may fail.
const REFUSALS: usize = 5;
/// Accuracy of the minimum, relative to the larger of it and the cost at zero.
const COST: f64 = 1e-9;
/// Accuracy of the constraints, relative to the natural sizes of the terms of their rows: that of a solution ([`kmcfit_core::qp::Kkt::VIOLATION`]).
const ROWS: f64 = 1e-8;
/// Largest exponent of two of a scale: twelve decades from the smallest to the largest.
const OCTAVES: i32 = 20;

fn seed() -> u64 {
    std::env::var("KMCFIT_QP_SEED").map_or(1, |seed| seed.parse().expect("a whole number"))
}

/// An integer from -3 to 3.
fn small(random: &mut ChaCha8Rng) -> i128 {
    random.random_range(-3..=3)
}

/// A row about `z`, at least one entry of which is not zero.
fn row(random: &mut ChaCha8Rng, n: usize) -> Vec<i128> {
    let mut a: Vec<i128> = (0..n).map(|_| small(random)).collect();
    if a.iter().all(|a| *a == 0) {
        a[random.random_range(0..n)] = 1;
    }
    if random.random_bool(0.4) {
        // A bound of one variable, as most are.
        let j = random.random_range(0..n);
        a.fill(0);
        a[j] = 1;
    }
    a
}

fn times(a: &[i128], z: &[i128]) -> i128 {
    a.iter().zip(z).map(|(a, z)| a * z).sum()
}

/// A program whose constraints the point `z` satisfies, unless it is `contradicted`.
fn program(random: &mut ChaCha8Rng, contradicted: bool) -> Program {
    let n = random.random_range(2..=4usize);
    let z: Vec<i128> = (0..n).map(|_| small(random)).collect();
    // Fewer residuals than variables make a Hessian that is not of full rank; so do equal columns.
    let residuals = random.random_range(1..=n + 2);
    let mut squares: Vec<(Vec<i128>, i128)> = (0..residuals)
        .map(|_| (row(random, n), 2 * small(random)))
        .collect();
    if random.random_bool(0.2) {
        squares.iter_mut().for_each(|(a, _)| a[1] = a[0]);
    }
    let proximal = (0..n)
        .map(|_| match random.random_bool(0.3) {
            true => random.random_range(1..=2),
            false => 0,
        })
        .collect();
    // Bounds through the point where all residuals vanish are active with multipliers of zero.
    if random.random_bool(0.15) {
        squares.iter_mut().for_each(|(a, f)| *f = times(a, &z));
    }
    let mut rows: Vec<Row> = Vec::new();
    for _ in 0..random.random_range(0..=4) {
        let a = row(random, n);
        let at = times(&a, &z);
        let (below, above) = (random.random_range(0..=2), random.random_range(0..=2));
        let (lower, upper) = match random.random_range(0..4) {
            0 => (Some(at - below), None),
            1 => (None, Some(at + above)),
            2 => (Some(at - below), Some(at + above)),
            // As an inequality, both of whose bounds are one.
            _ => (Some(at), Some(at)),
        };
        rows.push(Row { a, lower, upper });
    }
    if let Some(row) = rows.first().cloned()
        && random.random_bool(0.3)
    {
        rows.push(row);
    }
    let mut equalities: Vec<(Vec<i128>, i128)> = (0..random.random_range(0..=2))
        .map(|_| {
            let a = row(random, n);
            let at = times(&a, &z);
            (a, at)
        })
        .collect();
    if let Some(twice) = equalities.first().cloned()
        && random.random_bool(0.2)
    {
        equalities.push(twice);
    }
    if contradicted {
        // A combination of rows and its contrary, one apart.
        let a = row(random, n);
        let at = times(&a, &z);
        let other: Vec<i128> = row(random, n);
        let sum: Vec<i128> = a.iter().zip(&other).map(|(a, b)| a + b).collect();
        let limit = times(&other, &z);
        let (one, two) = (Some(at), Some(limit));
        rows.push(Row {
            a,
            lower: one,
            upper: None,
        });
        rows.push(Row {
            a: other,
            lower: two,
            upper: None,
        });
        rows.push(Row {
            a: sum,
            lower: None,
            upper: Some(at + limit - 1),
        });
    }
    let absolute = (0..random.random_range(0..=2usize).saturating_sub(1))
        .map(|_| (row(random, n), small(random), random.random_range(1..=4)))
        .collect();
    Program {
        n,
        squares,
        proximal,
        absolute,
        equalities,
        rows,
    }
}

/// The program in floating point, with rows, variables and cost in other units, and those that the variables are to be
/// multiplied by.
fn scaled(program: &Program, random: &mut ChaCha8Rng) -> (Subproblem, Vec<f64>) {
    let mut unit = || f64::from(random.random_range(-OCTAVES..=OCTAVES)).exp2();
    let cost = unit();
    let units: Vec<f64> = (0..program.n).map(|_| unit()).collect();
    let entries = |a: &[i128], factor: f64| -> Vec<(usize, f64)> {
        let pairs = a.iter().zip(&units).enumerate();
        pairs
            .filter(|(_, (a, _))| **a != 0)
            .map(|(j, (a, unit))| (j, *a as f64 * unit * factor))
            .collect()
    };
    let mut sub = Subproblem::new(program.n);
    for (a, f) in &program.squares {
        sub.residuals.push(entries(a, cost), *f as f64 * cost);
    }
    for (j, d) in program.proximal.iter().enumerate() {
        sub.proximal[j] = *d as f64 * (cost * units[j]).powi(2);
    }
    for (a, t, w) in &program.absolute {
        let row = unit();
        sub.absolute.push(entries(a, row), *t as f64 * row);
        sub.absolute_weights.push(*w as f64 * cost * cost / row);
    }
    for (a, e) in &program.equalities {
        let row = unit();
        sub.equalities.push(entries(a, row), *e as f64 * row);
    }
    for Row { a, lower, upper } in &program.rows {
        let row = unit();
        let bound = |b: &Option<i128>, none: f64| b.map_or(none, |b| b as f64 * row);
        let (lower, upper) = (bound(lower, f64::NEG_INFINITY), bound(upper, f64::INFINITY));
        sub.bound(entries(a, row), lower, upper);
    }
    (sub, units)
}

/// `a . z - f` in twice the working precision (Ogita, Rump and Oishi 2005, Algorithm 5.3): far out along a direction without
/// cost, plain rounding of a residual is more of the cost than what is tested.
fn residual(a: &[i128], z: &[f64], f: i128) -> f64 {
    let (mut sum, mut error) = (-f as f64, 0.0);
    for (a, z) in a.iter().zip(z) {
        let product = *a as f64 * z;
        let next = sum + product;
        let added = next - sum;
        error += (sum - (next - added)) + (product - added) + (*a as f64).mul_add(*z, -product);
        sum = next;
    }
    sum + error
}

/// The cost at `z`, in the units of the integers.
fn cost(program: &Program, z: &[f64]) -> f64 {
    let squares = program.squares.iter();
    let squares = squares.map(|(a, f)| residual(a, z, *f).powi(2));
    let proximal = program.proximal.iter().zip(z);
    let proximal = proximal.map(|(d, z)| *d as f64 * z * z);
    let absolute = program.absolute.iter();
    let absolute = absolute.map(|(a, t, w)| *w as f64 * residual(a, z, *t).abs());
    squares.chain(proximal).chain(absolute).sum()
}

/// The natural size of each variable: the larger of `|z_j|` and the change that costs as much as `scale` by the squares in which
/// it stands.
fn natural_sizes(program: &Program, z: &[f64], scale: f64) -> Vec<f64> {
    let size = |(j, z): (usize, &f64)| {
        let squares = program.squares.iter().map(|(a, _)| a[j] * a[j]);
        match squares.sum::<i128>() + program.proximal[j] {
            0 => z.abs(),
            curvature => z.abs().max((scale / curvature as f64).sqrt()),
        }
    };
    z.iter().enumerate().map(size).collect()
}

/// The largest violation of a row at `z`, in the units of the integers, relative to the largest of its terms at the natural sizes, its
/// bound and 1, an ordinary number among them.
fn violation(program: &Program, z: &[f64], scale: f64) -> f64 {
    let sizes = natural_sizes(program, z, scale);
    let outside = |a: &[i128], lower: Option<i128>, upper: Option<i128>| {
        let value = residual(a, z, 0);
        let terms = a.iter().zip(&sizes).map(|(a, x)| (*a as f64).abs() * x);
        let size = terms.sum::<f64>().max(1.0);
        let below = lower.map_or(0.0, |b| (b as f64 - value) / size.max((b as f64).abs()));
        let above = upper.map_or(0.0, |b| (value - b as f64) / size.max((b as f64).abs()));
        below.max(above)
    };
    let equalities = program.equalities.iter();
    let equalities = equalities.map(|(a, e)| outside(a, Some(*e), Some(*e)));
    let rows = program.rows.iter();
    let rows = rows.map(|row| outside(&row.a, row.lower, row.upper));
    equalities.chain(rows).fold(0.0, f64::max)
}

#[test]
fn programs_in_twelve_decades_have_their_exact_minimum_or_are_refused() {
    check(seed());
}

/// Seeds of programs that were accepted at a wrong cost (1028, 1029), whose cost plain rounding hides (837344958), with a row that does not hold (153813147), or whose
/// contradictions were not proved (1019, 860216186).
#[test]
fn programs_that_were_solved_wrongly_have_their_exact_minimum_or_are_refused() {
    // With the terms of absolute values left out of the sizes of variables, one of 153813147 in few variables was wrong as well.
    [1019, 1028, 1029, 860_216_186, 153_813_147, 837_344_958]
        .into_iter()
        .for_each(check);
}

/// Compares all programs of a seed with their minima, as programs of many variables and of few.
fn check(seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut by_active_sets = 0;
    let [mut many, mut few] = [Tally::default(), Tally::default()];
    for number in 0..PROGRAMS {
        let exact = program(&mut random, number % 10 == 9);
        let minimum = exact.minimum();
        let (mut sub, units) = scaled(&exact, &mut random);
        let solution = sub.solve();
        many.add(
            number,
            &exact,
            minimum,
            solution.status,
            &in_integers(&solution.z, &units),
        );
        sub.elimination_order = vec![0; exact.n];
        let solution = sub.solve();
        by_active_sets +=
            usize::from(solution.status == ConicStatus::Solved && solution.attempts == 0);
        few.add(
            number,
            &exact,
            minimum,
            solution.status,
            &in_integers(&solution.z, &units),
        );
    }
    for tally in [many, few] {
        tally.assert(seed);
    }
    assert!(by_active_sets > 150, "seed {seed}: {by_active_sets}");
}

/// Variables of the scaled program in the units of the integers.
fn in_integers(z: &[f64], units: &[f64]) -> Vec<f64> {
    z.iter().zip(units).map(|(z, unit)| z * unit).collect()
}

/// Outcomes of the programs of a seed.
#[derive(Default)]
struct Tally {
    wrong: Vec<String>,
    refused: Vec<u64>,
    infeasible: usize,
}

impl Tally {
    fn add(
        &mut self,
        number: u64,
        exact: &Program,
        minimum: Option<f64>,
        status: ConicStatus,
        z: &[f64],
    ) {
        let Some(minimum) = minimum else {
            self.infeasible += 1;
            if status != ConicStatus::Infeasible {
                self.wrong
                    .push(format!("{number}: {status:?} without a feasible point"));
            }
            return;
        };
        match status {
            ConicStatus::Solved => {
                let (found, at_zero) = (cost(exact, z), cost(exact, &vec![0.0; exact.n]));
                // 1 is an ordinary cost among integers.
                let error = (found - minimum).abs() / at_zero.max(minimum).max(1.0);
                let outside = violation(exact, z, at_zero.max(found));
                if !(error <= COST && outside <= ROWS) {
                    self.wrong.push(format!(
                        "{number}: {found:e} for {minimum:e}, rows to {outside:.1e}"
                    ));
                }
            }
            ConicStatus::Infeasible => {
                self.wrong
                    .push(format!("{number}: infeasible with a minimum of {minimum}"));
            }
            _ => self.refused.push(number),
        }
    }

    fn assert(self, seed: u64) {
        let Self {
            wrong,
            refused,
            infeasible,
        } = self;
        assert!(
            infeasible >= 40,
            "seed {seed}: {infeasible} programs without a feasible point"
        );
        assert!(
            wrong.is_empty(),
            "seed {seed}: {} wrong, {} refused: {wrong:#?}",
            wrong.len(),
            refused.len()
        );
        assert!(
            refused.len() <= REFUSALS,
            "seed {seed}: {} refused: {refused:?}",
            refused.len()
        );
    }
}
