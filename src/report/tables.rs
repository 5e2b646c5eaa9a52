//! The tables of a fit.

use super::FittedModel;
use super::columns::{function_column, interval_columns, named_column};
use super::csv::CsvTable;
use super::figures::RatioCurves;
use kmcfit_core::functions::Ratio;
use kmcfit_core::problem::FEW_PARAMETERS;
use kmcfit_core::solvers::IterationRecord;
use kmcfit_core::system::NodalCoefficients;

/// Most rows of a table over time.
#[derive(Debug, Clone, Copy)]
pub(super) struct MostRows {
    /// Without thinning.
    whole: usize,
    /// Of a thinned table.
    thinned: usize,
}

impl MostRows {
    /// Values from one row to the next of a table of so many values.
    fn values_per_row(self, count: usize) -> usize {
        match count.saturating_sub(1) {
            steps if steps > self.whole => steps.div_ceil(self.thinned),
            _ => 1,
        }
    }
}

/// Rows of the functions, where a curve through them has the values in between.
pub(super) const FUNCTION_ROWS: MostRows = MostRows {
    whole: 4000,
    thinned: 4000,
};
/// Rows of the trajectories and of the samples of a channel. Tables that spreadsheets open are not thinned; thinned ones have several rows for
/// each pixel of a plot.
pub(super) const TRAJECTORY_ROWS: MostRows = MostRows {
    whole: 50_000,
    thinned: 20_000,
};

impl FittedModel<'_> {
    /// Steps between the rows of a table of at most so many rows: 1 where all rows are requested or the functions have many parameters.
    pub(super) fn steps_per_row(&self, most: MostRows) -> usize {
        self.values_per_row(self.model.problem.system.grid.nodes(), most)
    }

    /// Samples between the rows of the table of a channel with so many samples.
    pub(super) fn samples_per_row(&self, samples: usize) -> usize {
        self.values_per_row(samples, TRAJECTORY_ROWS)
    }

    fn values_per_row(&self, count: usize, most: MostRows) -> usize {
        let few = self.model.problem.functions.parameters() <= FEW_PARAMETERS;
        match few && !self.requested.tables {
            true => most.values_per_row(count),
            false => 1,
        }
    }

    /// The values of every node with a row in a table of at most so many rows: one in so many steps, and the last one.
    pub(super) fn rows(&self, values: &[f64], most: MostRows) -> Vec<f64> {
        every(values, self.steps_per_row(most))
    }

    /// Iterations of the attempts by their number in `attempts` of the result document, then those of the search with the result as attempt 0.
    pub(super) fn history(&self) -> CsvTable {
        let last = &self.fit.history;
        let attempts = (1..).zip(&self.fit.attempts);
        // The attempt that gave the result has its rows once.
        let others = attempts.filter(|(_, attempt)| attempt.history != *last);
        let others = others.map(|(number, attempt)| (number, &attempt.history));
        let all = others.chain([(0, last)]);
        let rows: Vec<(i32, &IterationRecord)> = all
            .flat_map(|(number, rows)| rows.iter().map(move |row| (number, row)))
            .collect();
        let column = |f: fn(&IterationRecord) -> f64| rows.iter().map(|(_, r)| f(r)).collect();
        CsvTable::new()
            .column("attempt", rows.iter().map(|(n, _)| f64::from(*n)).collect())
            .column("iteration", column(|r| r.iteration as f64))
            .column("cost", column(|r| r.cost))
            .column("cost_ratio", column(|r| r.cost_ratio))
            .column(
                "gradient_norm_squared_ratio",
                column(|r| r.gradient_norm_squared_ratio),
            )
            .column("step", column(|r| r.step))
            .column("relative_change", column(|r| r.relative_change))
    }

    /// The ratios of nodal coefficients at the nodes that the table of the functions has.
    pub(super) fn ratio_rows(&self, nodal: &NodalCoefficients) -> RatioCurves {
        let laws = self.model.problem.system.laws();
        Ratio::ALL.map(|ratio| self.rows(&ratio.at_nodes(laws, nodal), FUNCTION_ROWS))
    }

    pub(super) fn functions_table(&self) -> CsvTable {
        let is_rotation = self.is_rotation();
        let rows = |values: &[f64]| self.rows(values, FUNCTION_ROWS);
        let coefficients = &self.fit.best.evaluation.nodal;
        let times = rows(&self.model.problem.system.grid.times());
        let mut table = CsvTable::new().column("t_s", times.clone());
        for (function, values) in self.named_functions() {
            table = table.column(function_column(function, is_rotation), rows(&values));
        }
        for (ratio, values) in Ratio::ALL.into_iter().zip(self.ratio_rows(coefficients)) {
            table = table.column(ratio.column(), values);
        }
        if let Some(bands) = self.bands() {
            for band in bands.functions.iter().chain(&bands.ratios) {
                let Some(column) = named_column(&band.name, is_rotation) else {
                    continue;
                };
                let [low, high] = band.curves(&bands.times, &times);
                let [of_low, of_high] = interval_columns(&column);
                table = table.column(of_low, low).column(of_high, high);
            }
        }
        if let Some(truth) = &self.model.truth {
            let functions = self.model.problem.functions.iter();
            for (function, values) in functions.zip(truth.functions()) {
                let name = format!("true_{}", function.quantity.column(is_rotation));
                table = table.column(name, rows(values));
            }
        }
        table
    }

    pub(super) fn trajectories(&self) -> CsvTable {
        let problem = &self.model.problem;
        let rows = |values: &[f64]| self.rows(values, TRAJECTORY_ROWS);
        let mut table = CsvTable::new().column("t_s", rows(&problem.system.grid.times()));
        let several = problem.experiments.len() > 1;
        let [y, v, observed_y] = match self.is_rotation() {
            true => ["y_rad", "v_rad_per_s", "observed_y_rad"],
            false => ["y_m", "v_m_per_s", "observed_y_m"],
        };
        let responses = problem
            .experiments
            .iter()
            .zip(&self.fit.best.evaluation.trajectories);
        for (i, (experiment, response)) in responses.enumerate() {
            let name = |column: &str| match several {
                true => format!("{column}_{}", i + 1),
                false => column.to_string(),
            };
            // A record can end before the grid.
            let full = |values: &[f64]| {
                let mut values = values.to_vec();
                values.resize(problem.system.grid.nodes(), f64::NAN);
                rows(&values)
            };
            table = table
                .column(name(y), full(response.displacement(0)))
                .column(name(v), full(response.velocity(0)));
            if let [channel] = experiment.channels.as_slice()
                && let Some(stride) = channel.stride()
            {
                let mut observed = vec![f64::NAN; problem.system.grid.nodes()];
                for (i, value) in channel.observed().iter().enumerate() {
                    observed[i * stride] = *value;
                }
                table = table.column(name(observed_y), rows(&observed));
            }
        }
        table
    }

    /// Tables of the samples and predictions of each channel in the unit of the file, with their names; validation
    /// records last, with all samples.
    pub(super) fn samples(&self) -> Vec<(String, CsvTable)> {
        let fitted = self.channels().into_iter().map(|(e, c)| {
            let view = self.channel_view(e, c);
            let name = format!("channels/{}-{}.csv", e + 1, view.channel.kind().name());
            let steps = self.samples_per_row(view.channel.len());
            (name, view.table(|values| every(values, steps)))
        });
        let validation = self.run_assessment.validation.iter().enumerate();
        let validation = validation.flat_map(|(i, out)| {
            out.channels().into_iter().map(move |view| {
                let kind = view.channel.kind().name();
                let name = format!("channels/validation-{}-{kind}.csv", i + 1);
                (name, view.table(<[f64]>::to_vec))
            })
        });
        fitted.chain(validation).collect()
    }
}

/// One value in so many steps, and the last one.
fn every(values: &[f64], steps: usize) -> Vec<f64> {
    let Some(last) = values.len().checked_sub(1) else {
        return Vec::new();
    };
    let positions = (0..last).step_by(steps).chain([last]);
    positions.map(|position| values[position]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After the first row 50,000 further ones are not thinned; of 65,000 samples 16,250 are left, of a million 20,000.
    #[test]
    fn long_tables_are_thinned() {
        let counts = [0, 1, 2, 50_001, 50_002, 65_000, 1_000_001];
        let of_samples = counts.map(|count| TRAJECTORY_ROWS.values_per_row(count));
        assert_eq!(of_samples, [1, 1, 1, 1, 3, 4, 50]);
        let counts = [4000, 4001, 4002, 65_000];
        let of_nodes = counts.map(|count| FUNCTION_ROWS.values_per_row(count));
        assert_eq!(of_nodes, [1, 1, 2, 17]);
    }
}
