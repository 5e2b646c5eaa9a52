//! Constraints as groups of linear rows and second-order cones.

use super::Rows;

/// `|(rows_1, ..., rows_k) z - right_{1..k}| <= rows_0 z - right_0`.
#[derive(Debug, Clone, PartialEq)]
pub struct Cone {
    /// The bound first, then the parts of the norm.
    pub rows: Rows,
}

/// Rows `lower <= g_i^T theta <= upper` that say one thing about the functions, at many times.
#[derive(Debug, Clone, PartialEq)]
pub struct RowGroup {
    /// What the rows say, as in `damping >= 0`.
    pub name: String,
    /// The rows in the parameters of all functions; their right-hand sides are the lower bounds,
    /// minus infinity where there is none.
    pub rows: Rows,
    /// The upper bounds, infinity where there is none; equal to the lower ones for an equality.
    pub upper: Vec<f64>,
    /// The span of time that each row speaks of, s.
    pub times: Vec<[f64; 2]>,
    /// For rows that may be broken at a price: the weight of their violation, greater than 0. `None`
    /// is a constraint that holds.
    pub soft: Option<f64>,
}

/// Second-order cones that say one thing about the functions, at many times.
#[derive(Debug, Clone, PartialEq)]
pub struct ConeGroup {
    /// What the cones say.
    pub name: String,
    /// The cones in the parameters of all functions.
    pub cones: Vec<Cone>,
    /// The time that each cone speaks of, s.
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

    /// Adds `lower <= entries theta <= upper` about the time span `times` (s).
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

    /// The parameter and its coefficient, if row `i` is about a single one.
    pub fn single(&self, i: usize) -> Option<(usize, f64)> {
        let mut entries = self.rows.row(i).filter(|(_, a)| *a != 0.0);
        match (entries.next(), entries.next()) {
            (Some(entry), None) => Some(entry),
            _ => None,
        }
    }
}

impl Constraints {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty() && self.cones.is_empty()
    }

    /// Adds those of `other`.
    pub fn extend(&mut self, other: Constraints) {
        self.groups.extend(other.groups);
        self.cones.extend(other.cones);
    }

    /// Takes out the soft groups.
    pub fn take_soft(&mut self) -> Vec<RowGroup> {
        let groups = std::mem::take(&mut self.groups);
        let (soft, hard) = groups.into_iter().partition(|group| group.soft.is_some());
        self.groups = hard;
        soft
    }

    /// Whether every constraint bounds or fixes a single parameter, so that clipping projects onto
    /// the set.
    pub fn are_simple(&self) -> bool {
        let simple = |g: &RowGroup| (0..g.rows.len()).all(|i| g.single(i).is_some());
        self.cones.is_empty() && self.groups.iter().all(simple)
    }

    /// `theta` moved by a step, and then into the bounds of single parameters.
    pub fn moved(&self, theta: &[f64], step: &[f64]) -> Vec<f64> {
        let mut moved: Vec<f64> = theta.iter().zip(step).map(|(t, d)| t + d).collect();
        self.clip(&mut moved);
        moved
    }

    /// Moves every parameter that a row bounds alone exactly into its bounds.
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
                // Not clamp(), which panics on contradictory bounds.
                theta[j] = theta[j].min(high).max(low);
            }
        }
    }
}
