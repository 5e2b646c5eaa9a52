//! Minima of small convex programs in rational numbers.
//!
//! The points at which a convex cost is least in a polyhedron are a polyhedron themselves, each smallest
//! face of which is the set of minima under some rows held as equalities. So the least value at any
//! feasible point that minimises the cost under some rows held is the minimum, and no multiplier is
//! needed. Absolute values are linear on each side of zero: each is tried on both.

/// `lower <= a z <= upper`.
#[derive(Debug, Clone)]
pub struct Row {
    pub a: Vec<i128>,
    pub lower: Option<i128>,
    pub upper: Option<i128>,
}

/// Minimise `sum (a z - f)^2 + sum d z^2 + sum w |a z - t|` under equalities and rows.
#[derive(Debug, Clone)]
pub struct Program {
    pub n: usize,
    pub squares: Vec<(Vec<i128>, i128)>,
    pub proximal: Vec<i128>,
    /// `a`, `t`, `w`.
    pub absolute: Vec<(Vec<i128>, i128, i128)>,
    pub equalities: Vec<(Vec<i128>, i128)>,
    pub rows: Vec<Row>,
}

fn gcd(a: i128, b: i128) -> i128 {
    if b == 0 { a.abs() } else { gcd(b, a % b) }
}

/// A point `numerators / denominator`, the denominator positive.
struct Point {
    numerators: Vec<i128>,
    denominator: i128,
}

impl Point {
    fn times(&self, a: &[i128]) -> i128 {
        let pairs = a.iter().zip(&self.numerators);
        pairs
            .map(|(a, z)| a.checked_mul(*z).expect("small integers"))
            .sum()
    }

    /// `a z - b`, times the denominator.
    fn excess(&self, a: &[i128], b: i128) -> i128 {
        self.times(a) - b.checked_mul(self.denominator).expect("small integers")
    }
}

/// Some solution of `rows z = right`, each row with its right-hand side last; free variables are zero.
/// `None` if there is none. Fraction-free Gauss-Jordan elimination (Bareiss).
fn solve(mut rows: Vec<Vec<i128>>, unknowns: usize) -> Option<Vec<(i128, i128)>> {
    let mut pivots: Vec<(usize, usize)> = Vec::new();
    let mut last = 1i128;
    for column in 0..unknowns {
        let rank = pivots.len();
        let Some(found) = (rank..rows.len()).find(|i| rows[*i][column] != 0) else {
            continue;
        };
        rows.swap(rank, found);
        let pivot_row = rows[rank].clone();
        let pivot = pivot_row[column];
        for (i, row) in rows.iter_mut().enumerate() {
            if i == rank {
                continue;
            }
            let factor = row[column];
            for (x, p) in row.iter_mut().zip(&pivot_row) {
                let product = pivot.checked_mul(*x).expect("small integers");
                let other = factor.checked_mul(*p).expect("small integers");
                *x = (product - other) / last;
            }
        }
        last = pivot;
        pivots.push((rank, column));
    }
    if rows[pivots.len()..].iter().any(|row| row[unknowns] != 0) {
        return None;
    }
    let mut solution = vec![(0, 1); unknowns];
    for (i, column) in pivots {
        let (numerator, denominator) = (rows[i][unknowns], rows[i][column]);
        let divisor = gcd(numerator, denominator).max(1) * denominator.signum();
        solution[column] = (numerator / divisor, denominator / divisor);
    }
    Some(solution)
}

impl Program {
    /// The least cost; `None` if no point satisfies the constraints.
    pub fn minimum(&self) -> Option<f64> {
        let sides = 0..1u32 << self.absolute.len();
        let least = sides.filter_map(|sides| self.minimum_on(sides));
        least.min_by(f64::total_cmp)
    }

    /// The least cost where the `i`-th absolute value is that of a number not negative if bit `i` of
    /// `sides` is set, and not positive otherwise.
    fn minimum_on(&self, sides: u32) -> Option<f64> {
        let mut rows = self.rows.clone();
        for (i, (a, t, _)) in self.absolute.iter().enumerate() {
            let (lower, upper) = match sides >> i & 1 {
                1 => (Some(*t), None),
                _ => (None, Some(*t)),
            };
            rows.push(Row {
                a: a.clone(),
                lower,
                upper,
            });
        }
        let mut least = None;
        // Each row is held at its lower bound, at its upper one, or not.
        for mut set in 0..3usize.pow(rows.len() as u32) {
            let mut held = self.equalities.clone();
            let mut exists = true;
            for row in &rows {
                let bound = match set % 3 {
                    0 => None,
                    1 => Some(row.lower),
                    _ => Some(row.upper),
                };
                set /= 3;
                match bound {
                    None => {}
                    Some(None) => exists = false,
                    Some(Some(bound)) => held.push((row.a.clone(), bound)),
                }
            }
            if !exists {
                continue;
            }
            let Some(point) = self.held_minimum(sides, &held) else {
                continue;
            };
            let inside = rows.iter().all(|row| {
                row.lower.is_none_or(|b| point.excess(&row.a, b) >= 0)
                    && row.upper.is_none_or(|b| point.excess(&row.a, b) <= 0)
            });
            if inside {
                let cost = self.cost(&point);
                least = Some(least.map_or(cost, |least: f64| least.min(cost)));
            }
        }
        least
    }

    /// Some minimiser under the rows `held`, from the optimality conditions
    /// `F'F z + D z + A' lambda = F'f - sum w s a / 2`, doubled; `A z = b`.
    fn held_minimum(&self, sides: u32, held: &[(Vec<i128>, i128)]) -> Option<Point> {
        let (n, unknowns) = (self.n, self.n + held.len());
        let mut rows = Vec::new();
        for j in 0..n {
            let mut row = vec![0i128; unknowns + 1];
            for (a, f) in &self.squares {
                for k in 0..n {
                    row[k] += 2 * a[j] * a[k];
                }
                row[unknowns] += 2 * a[j] * f;
            }
            row[j] += 2 * self.proximal[j];
            for (i, (a, _, w)) in self.absolute.iter().enumerate() {
                let sign = if sides >> i & 1 == 1 { 1 } else { -1 };
                row[unknowns] -= sign * w * a[j];
            }
            for (i, (a, _)) in held.iter().enumerate() {
                row[n + i] = a[j];
            }
            rows.push(row);
        }
        for (a, b) in held {
            let mut row = vec![0i128; unknowns + 1];
            row[..n].copy_from_slice(a);
            row[unknowns] = *b;
            rows.push(row);
        }
        let solution = solve(rows, unknowns)?;
        let parts = &solution[..n];
        let denominator = parts.iter().fold(1, |all, (_, d)| all / gcd(all, *d) * d);
        let numerators = parts.iter().map(|(x, d)| x * (denominator / d)).collect();
        Some(Point {
            numerators,
            denominator,
        })
    }

    fn cost(&self, point: &Point) -> f64 {
        let q = point.denominator as f64;
        let exact = |a: &[i128], b: i128| point.excess(a, b) as f64 / q;
        let squares: f64 = self.squares.iter().map(|(a, f)| exact(a, *f).powi(2)).sum();
        let pairs = self.proximal.iter().zip(&point.numerators);
        let near: f64 = pairs
            .map(|(d, z)| *d as f64 * (*z as f64 / q).powi(2))
            .sum();
        let jumps = self.absolute.iter();
        squares
            + near
            + jumps
                .map(|(a, t, w)| *w as f64 * exact(a, *t).abs())
                .sum::<f64>()
    }
}
