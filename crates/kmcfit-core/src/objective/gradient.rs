//! Gradient of the cost by the discrete or the continuous adjoint.

use super::Evaluation;
use crate::functions::{CoefficientFunction, Design};
use crate::problem::Problem;
use crate::step::{CoefficientGradient, Trajectory, continuous_adjoint};
use crate::system::quadrature::trapezoid_weights;
use crate::system::{NodalCoefficients, State};

/// Derivatives with respect to the predictions of a channel, by the indices of experiment and channel.
type Slopes<'a> = dyn Fn(usize, usize) -> Vec<f64> + 'a;

/// Adjoint that computes the gradient.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum GradientKind {
    /// Exact gradient of the discretised cost (discrete adjoint).
    Discrete,
    /// Discretised adjoint differential equation (continuous adjoint, Eq. 13 of the paper): not the exact derivative of the cost.
    Continuous,
}

impl GradientKind {
    /// Name in a model file.
    pub fn name(self) -> &'static str {
        match self {
            GradientKind::Discrete => "discrete",
            GradientKind::Continuous => "continuous",
        }
    }
}

/// Gradient of `J` in the Euclidean and the L2 inner product.
#[derive(Debug, Clone, PartialEq)]
pub struct Gradient {
    /// Euclidean gradient `dJ/dtheta`.
    pub euclidean: Vec<f64>,
    /// Parameters of the L2 gradient `g`: `dJ = sum_j integral g_j dp_j dt`. For nodal functions these are the values of
    /// `dI/dm`, `dI/dc`, `dI/dk` of Eqs. 15-17 at the nodes.
    pub l2: Vec<f64>,
    /// Squared norm `G^2 = sum_j integral g_j^2 dt`.
    pub norm_squared: f64,
}

impl Problem {
    /// Gradient at an evaluated point.
    ///
    /// # Panics
    /// If `kind` is continuous and the problem does not satisfy [`Problem::supports_continuous`].
    pub fn gradient(&self, theta: &[f64], evaluation: &Evaluation, kind: GradientKind) -> Gradient {
        match kind {
            GradientKind::Discrete => {
                self.gradient_of_misfit(theta, self.discrete_gradient(evaluation))
            }
            GradientKind::Continuous => {
                let (euclidean, l2) = self.continuous_gradient(evaluation);
                self.completed(theta, euclidean, l2)
            }
        }
    }

    /// Gradient at `theta` from the Euclidean gradient of the misfit.
    pub(crate) fn gradient_of_misfit(&self, theta: &[f64], misfit: Vec<f64>) -> Gradient {
        let l2 = self.functions.gram_solve(&misfit);
        self.completed(theta, misfit, l2)
    }

    /// Gradient at `theta` from that of the misfit in both inner products.
    fn completed(&self, theta: &[f64], mut euclidean: Vec<f64>, mut l2: Vec<f64>) -> Gradient {
        if self.is_regularised() {
            let push = self.penalty_gradient(theta);
            let push_l2 = self.functions.gram_solve(&push);
            euclidean.iter_mut().zip(&push).for_each(|(g, p)| *g += p);
            l2.iter_mut().zip(&push_l2).for_each(|(g, p)| *g += p);
        }
        let norm_squared = self.functions.norm_squared(&l2);
        Gradient {
            euclidean,
            l2,
            norm_squared,
        }
    }

    /// Euclidean gradient `dJ/dtheta` by the discrete adjoint at an evaluated point.
    pub fn euclidean_gradient(&self, theta: &[f64], evaluation: &Evaluation) -> Vec<f64> {
        let mut gradient = self.discrete_gradient(evaluation);
        if self.is_regularised() {
            let push = self.penalty_gradient(theta);
            gradient.iter_mut().zip(&push).for_each(|(g, p)| *g += p);
        }
        gradient
    }

    /// True if the cost has terms besides the misfit.
    pub fn is_regularised(&self) -> bool {
        self.functions.priors().next().is_some()
            || !(self.penalties.is_empty() && self.variations.is_empty() && self.soft.is_empty())
    }

    /// Euclidean gradient of [`Problem::regularisation`] in the parameters.
    pub(crate) fn penalty_gradient(&self, theta: &[f64]) -> Vec<f64> {
        let mut gradient = vec![0.0; theta.len()];
        for penalty in &self.penalties {
            let range = self.functions.ranges()[penalty.function].clone();
            penalty.add_gradient(&theta[range.clone()], &mut gradient[range]);
        }
        for variation in &self.variations {
            let range = self.functions.ranges()[variation.function].clone();
            variation.add_gradient(&theta[range.clone()], &mut gradient[range]);
        }
        for group in &self.soft {
            group.add_price_gradient(theta, &mut gradient);
        }
        for (index, prior) in self.functions.priors() {
            gradient[index] += 2.0 * (theta[index] - prior.mean) / prior.sigma.powi(2);
        }
        gradient
    }

    /// Transpose of [`Problem::predictions_tangent`] by one adjoint solve: `J' slopes` for the Jacobian `J` of the predictions with respect to
    /// the parameters, and one slope for each sample of all channels of all experiments, in order.
    ///
    /// # Panics
    /// If `slopes` has fewer elements than there are samples.
    pub fn predictions_transpose(&self, evaluation: &Evaluation, slopes: &[f64]) -> Vec<f64> {
        let mut first = vec![Vec::new(); self.experiments.len()];
        let mut position = 0;
        for (firsts, experiment) in first.iter_mut().zip(&self.experiments) {
            for channel in &experiment.channels {
                firsts.push(position..position + channel.len());
                position += channel.len();
            }
        }
        self.adjoint_gradient(evaluation, &|e, c| slopes[first[e][c].clone()].to_vec())
    }

    /// Euclidean gradient of the misfit in the parameters.
    fn discrete_gradient(&self, evaluation: &Evaluation) -> Vec<f64> {
        self.adjoint_gradient(evaluation, &|e, c| {
            self.experiments[e].channels[c].slopes(&evaluation.predictions[e][c])
        })
    }

    /// Gradient in the parameters of a function of the predictions from its derivatives with respect to them.
    fn adjoint_gradient(&self, evaluation: &Evaluation, slopes: &Slopes) -> Vec<f64> {
        let mut gradient = vec![0.0; self.parameters()];
        let mut nodal: Vec<Option<NodalCoefficients>> =
            vec![None; self.functions.coefficient_sets().len()];
        let mut scalars = vec![0.0; evaluation.scalars.len()];
        for (e, experiment) in self.experiments.iter().enumerate() {
            if experiment.channels.is_empty()
                || self.add_gradient_of_constants(
                    evaluation,
                    e,
                    slopes,
                    &mut gradient,
                    &mut scalars,
                )
            {
                continue;
            }
            let view = self.view(evaluation, e);
            let empty = || self.functions.empty_nodal();
            let total = nodal[experiment.coefficient_set].get_or_insert_with(empty);
            let direct = &mut CoefficientGradient::AtNodes(total);
            let source = self.source(evaluation, e, slopes, direct, &mut scalars);
            let share = view.discrete_adjoint(&source);
            add(total, &share.nodal);
            add_initial(&experiment.initial_parameters, share.initial, &mut scalars);
        }
        for (which, nodal) in nodal.iter().enumerate() {
            if let Some(nodal) = nodal {
                self.functions.add_transpose(nodal, which, &mut gradient);
            }
        }
        gradient[self.functions.scalar_range()].copy_from_slice(&scalars);
        gradient
    }

    /// Derivative with respect to the response of experiment `e`, from those with respect to its predictions. Derivatives at fixed
    /// states are added to `direct` and `scalars`.
    fn source(
        &self,
        evaluation: &Evaluation,
        e: usize,
        slopes: &Slopes,
        direct: &mut CoefficientGradient,
        scalars: &mut [f64],
    ) -> Trajectory {
        let (experiment, view) = (&self.experiments[e], self.view(evaluation, e));
        let mut source = Trajectory::like(view.response);
        for (c, channel) in experiment.channels.iter().enumerate() {
            channel.add_transpose(view, &slopes(e, c), &mut source, direct, scalars);
        }
        source
    }

    /// Adds the gradient of experiment `e` from sums over the nodes if all functions of its coefficient set are constants.
    /// Returns false, and adds nothing, otherwise.
    fn add_gradient_of_constants(
        &self,
        evaluation: &Evaluation,
        e: usize,
        slopes: &Slopes,
        gradient: &mut [f64],
        scalars: &mut [f64],
    ) -> bool {
        let (experiment, functions) = (&self.experiments[e], &self.functions);
        let assembly = functions.coefficient_set(experiment.coefficient_set);
        let view = self.view(evaluation, e);
        if !assembly
            .parts()
            .all(|(_, f)| functions.is_constant_or_known(f))
        {
            return false;
        }
        let mut direct = vec![0.0; assembly.len()];
        let mut own = vec![0.0; scalars.len()];
        let source = self.source(
            evaluation,
            e,
            slopes,
            &mut CoefficientGradient::Summed(&mut direct),
            &mut own,
        );
        let mut sums = vec![0.0; assembly.len()];
        let by_sums = CoefficientGradient::Summed(&mut sums);
        let initial = view.driven().adjoint(view.response, &source, by_sums);
        for (position, f) in assembly.parts() {
            let first = functions.ranges()[f].start;
            for (j, entry) in functions.get(f).design.row(0) {
                gradient[first + j] += entry * (direct[position] + sums[position]);
            }
        }
        add_initial(&experiment.initial_parameters, initial, &mut own);
        scalars.iter_mut().zip(&own).for_each(|(s, own)| *s += own);
        true
    }

    /// Euclidean gradient in the parameters, and parameters of the L2 gradient.
    fn continuous_gradient(&self, evaluation: &Evaluation) -> (Vec<f64>, Vec<f64>) {
        assert!(
            self.supports_continuous(),
            "Eq. 13 needs one sample per node and no sigma"
        );
        let mut nodal: Vec<Option<NodalCoefficients>> =
            vec![None; self.functions.coefficient_sets().len()];
        let mut scalars = vec![0.0; evaluation.scalars.len()];
        for (e, experiment) in self.experiments.iter().enumerate() {
            let view = self.view(evaluation, e);
            let share = continuous_adjoint(
                &self.system,
                view.nodal,
                view.excitation,
                view.response,
                experiment.channels[0].observed(),
            );
            match &mut nodal[experiment.coefficient_set] {
                Some(total) => add(total, &share.nodal),
                none => *none = Some(share.nodal),
            }
            add_initial(&experiment.initial_parameters, share.initial, &mut scalars);
        }
        let or_empty = |nodal: Option<NodalCoefficients>| {
            nodal.unwrap_or_else(|| self.functions.empty_nodal())
        };
        let nodal: Vec<NodalCoefficients> = nodal.into_iter().map(or_empty).collect();
        let grid = &self.system.grid;
        let weights = trapezoid_weights(grid.nodes(), grid.step());
        let identity = |f: &CoefficientFunction| matches!(f.design, Design::Identity);
        if let ([total], true) = (nodal.as_slice(), self.functions.iter().all(identity)) {
            // Nodal functions: the gradients themselves, without multiplication and division by quadrature weights.
            let mut l2 = Vec::with_capacity(self.parameters());
            let mut euclidean = Vec::with_capacity(self.parameters());
            for values in total.functions() {
                l2.extend_from_slice(values);
                euclidean.extend(values.iter().zip(&weights).map(|(g, w)| g * w));
            }
            l2.extend(scalars.iter().map(|g| g / grid.duration()));
            euclidean.extend(&scalars);
            return (euclidean, l2);
        }
        let mut euclidean = vec![0.0; self.parameters()];
        euclidean[self.functions.scalar_range()].copy_from_slice(&scalars);
        for (which, total) in nodal.iter().enumerate() {
            let mut weighted = total.clone();
            for values in weighted.functions_mut() {
                values.iter_mut().zip(&weights).for_each(|(g, w)| *g *= w);
            }
            self.functions
                .add_transpose(&weighted, which, &mut euclidean);
        }
        let mut l2 = self.functions.gram_solve(&euclidean);
        // The remaining functions, projected onto their bases.
        if let [total] = nodal.as_slice() {
            let parts = self.functions.iter().zip(self.functions.ranges());
            for ((function, range), values) in parts.zip(total.functions()) {
                if matches!(function.design, Design::Identity) {
                    l2[range.clone()].copy_from_slice(values);
                }
            }
        }
        (euclidean, l2)
    }
}

/// Adds the gradient with respect to an initial state to those of its scalar parameters.
fn add_initial(estimated: &[Option<usize>], gradient: State, scalars: &mut [f64]) {
    for (index, slope) in estimated.iter().zip(gradient.components()) {
        if let Some(index) = index {
            scalars[*index] += slope;
        }
    }
}

fn add(total: &mut NodalCoefficients, share: &NodalCoefficients) {
    for (total, share) in total.functions_mut().zip(share.functions()) {
        total.iter_mut().zip(share).for_each(|(t, s)| *t += s);
    }
}
