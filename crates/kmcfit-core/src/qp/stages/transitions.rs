//! Transitions `x_{i+1} = F_i xi_i` from the coordinates of a stage to the state of the next one.

/// No coordinate.
pub(super) const NONE: usize = usize::MAX;

/// The transitions `F_i`: rows of the responses, which differ from stage to stage; every other state keeps its value
/// and adds that of another coordinate, its next difference.
#[derive(Debug, Clone)]
pub(super) struct Transitions<const W: usize> {
    /// Number of response components, the first states.
    pub responses: usize,
    /// Rows of the responses, `responses` for each step.
    pub steps: Vec<[f64; W]>,
    /// For each state that is no response the coordinate that it adds; [`NONE`] for a constant. States that do not occur are
    /// beyond the end.
    pub next: Vec<usize>,
}

impl<const W: usize> Transitions<W> {
    /// States in use.
    pub fn states(&self) -> usize {
        self.responses + self.next.len()
    }

    #[inline(always)]
    pub fn step(&self, i: usize) -> &[[f64; W]] {
        &self.steps[i * self.responses..(i + 1) * self.responses]
    }

    /// `F_i xi`.
    #[inline(always)]
    pub fn forward<const X: usize>(&self, i: usize, xi: &[f64; W]) -> [f64; X] {
        let mut x = [0.0; X];
        for (x, row) in x.iter_mut().zip(self.step(i)) {
            // The controls come last: they are known later than the states.
            let controls: f64 = row[X..].iter().zip(&xi[X..]).map(|(a, u)| a * u).sum();
            *x = dot(&row[..X], &xi[..X]) + controls;
        }
        for (k, next) in self.next.iter().enumerate() {
            let state = self.responses + k;
            x[state] = match *next {
                NONE => xi[state],
                next => xi[state] + xi[next],
            };
        }
        x
    }
}

/// The product of two vectors, in four sums side by side.
#[inline(always)]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    for (a, b) in a.chunks_exact(4).zip(b.chunks_exact(4)) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3])
}
