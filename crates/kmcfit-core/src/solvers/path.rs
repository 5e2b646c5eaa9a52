//! A path of fits with falling penalty weights.

/// Fit at one weight.
#[derive(Debug, Clone, PartialEq)]
pub struct PathPoint {
    /// Factor on the penalties.
    pub weight: f64,
    /// Iterations of the fit, over all attempts.
    pub iterations: u64,
    /// Misfit of the samples; chi-square where they have a sigma.
    pub misfit: f64,
    /// Roughness `sum |L theta - target|^2` of the penalties on the path, without the weight.
    pub roughness: f64,
    /// Effective number of parameters determined by the data.
    pub degrees_of_freedom: f64,
    /// `n misfit / (n - dof)^2`.
    pub gcv: f64,
    /// Bayesian information criterion, on a path of total variation.
    pub bic: Option<f64>,
    /// Fitted parameters.
    pub parameters: Vec<f64>,
}

/// Fits from the largest weight to the smallest, and the choice of each rule.
#[derive(Debug, Clone, PartialEq)]
pub struct WeightPath {
    /// Fits, by falling weight.
    pub points: Vec<PathPoint>,
    /// Index that each of [`WeightPath::RULES`] would choose; `None` where one chooses none.
    pub picks: [Option<usize>; 3],
    /// Index of the point whose weight is used.
    pub chosen: usize,
    /// Seed of the random vectors of the degrees of freedom.
    pub seed: u64,
    /// Note on the choice.
    pub remark: Option<String>,
}

impl WeightPath {
    /// The discrepancy principle, which chooses the weight; the corner of misfit against roughness on logarithmic axes (Hansen); the
    /// least generalised cross-validation score `n misfit / (n - dof)^2` (Golub, Heath, Wahba).
    pub const RULES: [&'static str; 3] = ["discrepancy", "l-curve", "gcv"];

    /// Chosen weight.
    pub fn chosen_weight(&self) -> f64 {
        self.points[self.chosen].weight
    }
}
