//! The tables of a fit.

use super::FittedModel;
use super::csv::CsvTable;
use kmcfit_core::internals::functions::{CoefficientKind, Ratios};
use kmcfit_core::internals::solvers::FEW_PARAMETERS;
use kmcfit_core::internals::solvers::IterationRecord;

/// Most rows of the tables over time where a curve through them has the values in between: what spreadsheets open at once.
const MOST_ROWS: usize = 50_000;

impl FittedModel<'_> {
    /// Steps between the rows of the tables over time: 1, unless the functions have few parameters on more than [`MOST_ROWS`] nodes.
    pub(super) fn steps_per_row(&self) -> usize {
        let problem = &self.model.problem;
        let few = problem.functions.parameters() <= FEW_PARAMETERS;
        match (problem.system.grid.nodes() - 1).div_ceil(MOST_ROWS) {
            steps if few => steps,
            _ => 1,
        }
    }

    /// The values of every node with a row in the tables over time: one in so many steps, and the last one.
    fn rows(&self, values: &[f64]) -> Vec<f64> {
        let steps = self.steps_per_row();
        let last = values.len() - 1;
        let nodes = (0..last).step_by(steps).chain([last]);
        nodes.map(|node| values[node]).collect()
    }

    pub(super) fn history(&self) -> CsvTable {
        let column = |f: fn(&IterationRecord) -> f64| self.fit.history.iter().map(f).collect();
        CsvTable::new()
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

    /// Column header of a quantity.
    fn column(&self, quantity: CoefficientKind) -> &'static str {
        match self.is_rotation() {
            true => quantity.angular_column(),
            false => quantity.column(),
        }
    }

    pub(super) fn functions_table(&self) -> CsvTable {
        let coefficients = &self.fit.best.evaluation.nodal;
        let times = self.rows(&self.model.problem.system.grid.times());
        let mut table = CsvTable::new().column("t_s", times.clone());
        for (function, values) in self.named_functions() {
            let column = self.column(function.quantity);
            let column = match function.is_known_part {
                true => format!("known_part_of_{column}"),
                false => column.to_owned(),
            };
            let name = match &function.owner {
                None => column,
                // A comma would end the header.
                Some(owner) => format!("{column} of {}", owner.replace([',', '"', '\n'], " ")),
            };
            table = table.column(name, self.rows(&values));
        }
        let ratios = Ratios::of(coefficients);
        table = table
            .column("k_over_m_per_s2", self.rows(&ratios.k_over_m))
            .column("c_over_m_per_s", self.rows(&ratios.c_over_m))
            .column("natural_frequency_Hz", self.rows(&ratios.frequency))
            .column("damping_ratio", self.rows(&ratios.damping_ratio));
        if let Some(bands) = self.bands() {
            for list in [&bands.functions, &bands.ratios] {
                for (band, [low, high]) in list.iter().zip(bands.curves(list, &times)) {
                    let name = band.name.replace([' ', '/', ','], "_");
                    table = table
                        .column(format!("{name}_low_95"), low)
                        .column(format!("{name}_high_95"), high);
                }
            }
        }
        if let Some(truth) = &self.model.truth {
            let functions = self.model.problem.functions.iter();
            for (function, values) in functions.zip(truth.functions()) {
                let name = format!("true_{}", self.column(function.quantity));
                table = table.column(name, self.rows(values));
            }
        }
        table
    }

    pub(super) fn trajectories(&self) -> CsvTable {
        let problem = &self.model.problem;
        let mut table = CsvTable::new().column("t_s", self.rows(&problem.system.grid.times()));
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
                self.rows(&values)
            };
            table = table
                .column(name(y), full(&response.displacement))
                .column(name(v), full(&response.velocity));
            if let [channel] = experiment.channels.as_slice()
                && let Some(stride) = channel.stride()
            {
                let mut observed = vec![f64::NAN; problem.system.grid.nodes()];
                for (i, value) in channel.observed().iter().enumerate() {
                    observed[i * stride] = *value;
                }
                table = table.column(name(observed_y), self.rows(&observed));
            }
        }
        table
    }

    /// Tables of the samples and predictions of each channel in the unit of the file, with their names; validation
    /// records last.
    pub(super) fn samples(&self) -> Vec<(String, CsvTable)> {
        let fitted = self.channels().into_iter().map(|(e, c)| {
            let view = self.channel_view(e, c);
            let name = format!("channels/{}-{}.csv", e + 1, view.channel.kind().name());
            (name, view.table())
        });
        let validation = self.run_assessment.validation.iter().enumerate();
        let validation = validation.flat_map(|(i, out)| {
            out.channels().into_iter().map(move |view| {
                let kind = view.channel.kind().name();
                let name = format!("channels/validation-{}-{kind}.csv", i + 1);
                (name, view.table())
            })
        });
        fitted.chain(validation).collect()
    }
}
