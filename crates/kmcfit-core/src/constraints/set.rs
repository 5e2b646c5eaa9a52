//! Constraints as groups of linear rows and second-order cones.

use super::Rows;

/// Size of a row whose entries have cancelled.
const NO_ENTRY: f64 = 1e-12;

/// Second-order cone `|(rows_1, ..., rows_k) z - right_{1..k}| <= rows_0 z - right_0`.
#[derive(Debug, Clone, PartialEq)]
pub struct Cone {
    /// The bound first, then the components of the norm.
    pub rows: Rows,
}

/// Rows `lower <= g_i^T theta <= upper` of one constraint, at many times.
#[derive(Debug, Clone, PartialEq)]
pub struct RowGroup {
    /// Name, as in `damping >= 0`.
    pub name: String,
    /// Rows in the parameters of all functions; right-hand sides are the lower bounds, minus infinity for none.
    pub rows: Rows,
    /// Upper bounds, infinity for none; equal to the lower ones for an equality.
    pub upper: Vec<f64>,
    /// Interval of time of each row, s.
    pub times: Vec<[f64; 2]>,
    /// Penalty weight of the violation of a soft constraint, greater than 0; `None` for a constraint that must hold.
    pub soft: Option<f64>,
}

/// Second-order cones of one constraint, at many times.
#[derive(Debug, Clone, PartialEq)]
pub struct ConeGroup {
    /// Name.
    pub name: String,
    /// Cones in the parameters of all functions.
    pub cones: Vec<Cone>,
    /// Time of each cone, s.
    pub times: Vec<f64>,
}

/// All constraints of a problem.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Constraints {
    /// Linear rows.
    pub groups: Vec<RowGroup>,
    /// Second-order cones.
    pub cones: Vec<ConeGroup>,
}

impl RowGroup {
    /// A group without rows.
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            rows: Rows::new(),
            upper: Vec::new(),
            times: Vec::new(),
            soft: None,
        }
    }

    /// Adds `lower <= entries theta <= upper` for the interval `times` (s).
    pub fn push(
        &mut self,
        entries: impl IntoIterator<Item = (usize, f64)>,
        [lower, upper]: [f64; 2],
        times: [f64; 2],
    ) {
        self.rows.push(entries, lower);
        self.upper.push(upper);
        self.times.push(times);
    }

    /// Lower and upper bound of row `i`.
    pub fn bounds(&self, i: usize) -> [f64; 2] {
        [self.rows.right()[i], self.upper[i]]
    }

    /// The group in other parameters, in which entry `(j, a)` is `column(j, a)`; rows without entries there are omitted.
    #[must_use]
    pub fn in_parameters(&self, column: &dyn Fn(usize, f64) -> (usize, f64)) -> Self {
        let rows = rows_in_parameters(&self.rows, column);
        let mut group = Self {
            rows: Rows::new(),
            upper: Vec::new(),
            times: Vec::new(),
            ..self.clone()
        };
        for i in 0..rows.len() {
            if rows.scale(i) > NO_ENTRY {
                group.push(rows.row(i), self.bounds(i), self.times[i]);
            }
        }
        group
    }

    /// Parameter and coefficient of row `i`, if it has a single entry.
    pub fn single(&self, i: usize) -> Option<(usize, f64)> {
        let mut entries = self.rows.row(i).filter(|(_, a)| *a != 0.0);
        match (entries.next(), entries.next()) {
            (Some(entry), None) => Some(entry),
            _ => None,
        }
    }
}

impl Constraints {
    /// True without constraints.
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty() && self.cones.is_empty()
    }

    /// The constraints in other parameters, in which entry `(j, a)` is `column(j, a)`.
    #[must_use]
    pub fn in_parameters(&self, column: &dyn Fn(usize, f64) -> (usize, f64)) -> Self {
        let mut cones = self.cones.clone();
        for cone in cones.iter_mut().flat_map(|group| &mut group.cones) {
            cone.rows = rows_in_parameters(&cone.rows, column);
        }
        let groups = self.groups.iter();
        Self {
            groups: groups.map(|group| group.in_parameters(column)).collect(),
            cones,
        }
    }

    /// Adds the constraints of `other`.
    pub fn extend(&mut self, other: Constraints) {
        self.groups.extend(other.groups);
        self.cones.extend(other.cones);
    }

    /// Removes and returns the soft groups.
    pub fn take_soft(&mut self) -> Vec<RowGroup> {
        let groups = std::mem::take(&mut self.groups);
        let (soft, hard) = groups.into_iter().partition(|group| group.soft.is_some());
        self.groups = hard;
        soft
    }

    /// True if every constraint bounds or fixes a single parameter, so that clipping is the projection.
    pub fn are_simple(&self) -> bool {
        let simple = |g: &RowGroup| (0..g.rows.len()).all(|i| g.single(i).is_some());
        self.cones.is_empty() && self.groups.iter().all(simple)
    }

    /// `theta` plus a step, clipped to the bounds of single parameters.
    pub fn moved(&self, theta: &[f64], step: &[f64]) -> Vec<f64> {
        let mut moved: Vec<f64> = theta.iter().zip(step).map(|(t, d)| t + d).collect();
        self.clip(&mut moved);
        moved
    }

    /// Clips every parameter to its bounds.
    pub fn clip(&self, theta: &mut [f64]) {
        for group in &self.groups {
            for i in 0..group.rows.len() {
                let Some((j, a)) = group.single(i) else {
                    continue;
                };
                let [lower, upper] = group.bounds(i);
                let ends = [lower / a, upper / a];
                let (low, high) = if a > 0.0 {
                    (ends[0], ends[1])
                } else {
                    (ends[1], ends[0])
                };
                // Not clamp(), which panics for contradictory bounds.
                theta[j] = theta[j].min(high).max(low);
            }
        }
    }
}

/// Rows in other parameters.
fn rows_in_parameters(rows: &Rows, column: &dyn Fn(usize, f64) -> (usize, f64)) -> Rows {
    let mut out = Rows::new();
    for (i, right) in rows.right().iter().enumerate() {
        out.push(rows.row(i).map(|(j, a)| column(j, a)), *right);
    }
    out
}
