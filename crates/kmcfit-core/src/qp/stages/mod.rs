//! Convex subproblems along time, by an interior-point method whose Newton steps are Riccati recursions.

mod absolute_values;
mod barrier;
mod bounds;
mod cones;
mod hessian;
mod interior_point;
mod riccati;
mod rows;
mod sizes;
mod transcription;
mod transitions;

#[cfg(test)]
mod tests;

use super::dot2::{CompensatedSum, add_transposed_product, residuals};
use super::{PrimalDual, StageLayout, Subproblem};
use sizes::Sizes;
use transcription::StageProgram;

/// A point from the stages.
pub(super) struct StagePoint {
    pub point: PrimalDual,
    /// Decrease of half the cost by a Newton step.
    pub decrease: f64,
    /// By how much half the cost is below that of zero controls.
    pub fall: f64,
    /// Bound of the further excess of half the cost over the minimum.
    pub gap: f64,
}

impl Subproblem {
    /// The minimiser with its multipliers, by the interior-point method on the stages of [`Subproblem::layout`], or a point from
    /// which the cost falls by at most `share` of the decrease that it brings; `None` where
    /// there is no layout, the program is of another form, or a Newton step fails.
    pub(super) fn minimise_on_stages(&self, iterations: u32, share: f64) -> Option<StagePoint> {
        let layout = self.layout.as_ref()?;
        let sizes = Sizes::of(self, layout)?;
        // Compiled for some sizes; states and controls that are not there cost time alone.
        match (sizes.states, sizes.controls) {
            (..=8, ..=4) => self.minimise_of_size::<8, 12>(layout, sizes, iterations, share),
            (..=16, ..=4) => self.minimise_of_size::<16, 20>(layout, sizes, iterations, share),
            _ => None,
        }
    }

    fn minimise_of_size<const X: usize, const W: usize>(
        &self,
        layout: &StageLayout,
        sizes: Sizes,
        iterations: u32,
        share: f64,
    ) -> Option<StagePoint> {
        let program = StageProgram::<X, W>::new(self, layout, sizes)?;
        let mut point = PrimalDual::zero(self);
        let estimates = self.multiplier_estimates(&program);
        let solution = interior_point::minimise(&program, &estimates, iterations, share)?;
        point.z = program.variables(&solution.xi);
        self.clip(&mut point.z);
        for (side, multiplier) in program.sides.iter().zip(&solution.multipliers) {
            point.inequalities[side.row] += side.sign * multiplier;
        }
        let cones = program.cone_order.iter().zip(program.cone_rows.windows(2));
        for (cone, rows) in cones {
            let rows = rows[0] as usize..rows[1] as usize;
            point.cones[*cone].copy_from_slice(&solution.cones[rows]);
        }
        for (row, multiplier) in program.absolute_order.iter().zip(&solution.absolute) {
            point.absolute[*row] = *multiplier;
        }
        point.equalities = program.equality_multipliers(self, self.gradient(&point));
        point.is_finite().then_some(StagePoint {
            point,
            decrease: solution.decrease,
            fall: solution.fall,
            gap: solution.gap,
        })
    }

    /// Multipliers of the constraint rows at zero that balance the gradient of half the cost in the variable that a row bounds
    /// alone; zero for other rows.
    fn multiplier_estimates<const X: usize, const W: usize>(
        &self,
        program: &StageProgram<X, W>,
    ) -> Vec<f64> {
        let zero = PrimalDual::zero(self);
        let mut gradient = self.gradient(&zero);
        let equalities = program.equality_multipliers(self, gradient.clone());
        self.equalities
            .transpose_multiply_add(&equalities, &mut gradient);
        let estimate = |side: &transcription::Side| {
            let mut entries = self.inequalities.row(side.row).filter(|(_, a)| *a != 0.0);
            match (entries.next(), entries.next()) {
                (Some((j, a)), None) => (-side.sign * gradient[j] / a).max(0.0),
                _ => 0.0,
            }
        };
        program.sides.iter().map(estimate).collect()
    }

    /// Gradient of the Lagrangian of half the cost without the equalities.
    pub(super) fn gradient(&self, point: &PrimalDual) -> Vec<f64> {
        let mut gradient = vec![CompensatedSum::default(); self.variables];
        for ((sum, d), z) in gradient.iter_mut().zip(&self.proximal).zip(&point.z) {
            sum.add_product(*d, *z);
        }
        add_transposed_product(
            &mut gradient,
            &self.residuals,
            &residuals(&self.residuals, &point.z),
        );
        add_transposed_product(&mut gradient, &self.inequalities, &point.inequalities);
        add_transposed_product(&mut gradient, &self.absolute, &point.absolute);
        for (cone, multipliers) in self.cones.iter().zip(&point.cones) {
            let negative: Vec<f64> = multipliers.iter().map(|c| -c).collect();
            add_transposed_product(&mut gradient, &cone.rows, &negative);
        }
        gradient.iter().map(CompensatedSum::total).collect()
    }
}
