//! Estimates of all records of a problem, and sizes that follow from them.

use crate::functions::Parameterization;
use crate::problem::Problem;
use crate::record::{Experiment, Measured, Measurements};
use crate::solvers::reason::{MissingMeasurement, UnsupportedRecord};
use std::sync::Arc;

impl Measurements {
    /// Estimates from the samples of a problem, with scalars at their start.
    ///
    /// # Errors
    /// The first experiment whose samples do not provide a response.
    pub fn of(problem: &Problem) -> Result<Arc<Self>, UnsupportedRecord> {
        Self::with_scalars(problem, problem.scalars(&problem.start()))
    }

    /// [`Measurements::of`] for the sensor parameters `scalars`, estimated once for each problem.
    pub(super) fn with_scalars(
        problem: &Problem,
        scalars: &[f64],
    ) -> Result<Arc<Self>, UnsupportedRecord> {
        problem.measurements(scalars, || Self::estimated(problem, scalars))
    }

    fn estimated(problem: &Problem, scalars: &[f64]) -> Result<Self, UnsupportedRecord> {
        let one = |(index, experiment): (usize, &Experiment)| {
            if experiment.channels.is_empty() {
                return Ok(None);
            }
            let measured = match problem.system.structure.is_one() {
                true => Measured::of(problem, experiment, scalars),
                false => Err(MissingMeasurement::OneCoordinate),
            };
            measured.map(Some).map_err(|reason| UnsupportedRecord {
                experiment: index,
                name: experiment.name.clone(),
                reason,
            })
        };
        let experiments = problem.experiments.iter().enumerate().map(one);
        Ok(Self {
            experiments: experiments.collect::<Result<_, _>>()?,
            ..Self::default()
        })
    }

    /// Notes on lost information: the filter that integrates an acceleration removes slow components, which biases forces not
    /// proportional to the response.
    pub fn remarks(&self, problem: &Problem) -> Vec<String> {
        let terms = problem.system.laws().iter();
        if terms.clone().all(|term| term.is_linear()) {
            return Vec::new();
        }
        let in_bands = problem.experiments.iter().zip(&self.experiments);
        let one = |(experiment, measured): (&Experiment, &Option<Measured>)| {
            let corner = measured.as_ref()?.corner? / std::f64::consts::TAU;
            Some(format!(
                "{}: the acceleration is integrated above {corner:.3} Hz alone, so forces that \
                 are not proportional to the response are biased, and a static force is not \
                 identifiable",
                experiment.name
            ))
        };
        in_bands.filter_map(one).collect()
    }

    /// Weight of a penalty on derivative `order` of function `index` for which the time constant of the smoother is one dominant
    /// period T at the mean amplitude of the response: `mean(phi^2) T^(2 order)`, summed over the experiments with the function.
    /// T is the mean of their periods.
    ///
    /// For fixed other functions, minimising `integral (phi p - g)^2 + weight p'^2 dt` smooths `p` by `exp(-|t|/T)/(2T)`.
    pub fn period_weight(&self, problem: &Problem, index: usize, order: usize) -> f64 {
        let mut squares = 0.0;
        let mut periods = Vec::new();
        for (f, measured) in self.with_function(problem, index) {
            squares += measured.mean_square(problem, f);
            periods.push(std::f64::consts::TAU / measured.frequency);
        }
        let period = periods.iter().sum::<f64>() / periods.len().max(1) as f64;
        squares * period.powi(2 * order as i32)
    }

    /// Largest value at `start` of each function of the list.
    pub(super) fn own_sizes(problem: &Problem, start: &[f64]) -> Vec<f64> {
        let values = problem.functions.values(start);
        let largest = |f: &Vec<f64>| f.iter().fold(0.0f64, |m, p| m.max(p.abs()));
        values.iter().map(largest).collect()
    }

    /// For each function of the list, the larger of its largest value at `start` and of the value whose force equals the inertia
    /// force.
    pub(super) fn sizes(&self, problem: &Problem, start: &[f64]) -> Vec<f64> {
        let sizes = Self::own_sizes(problem, start);
        let own = |index: usize| sizes[index];
        let natural = |index: usize| {
            let [mut inertia, mut response] = [0.0, 0.0];
            for (f, measured) in self.with_function(problem, index) {
                let mass = mass_of(&problem.functions, index).map_or(1.0, own);
                inertia += mass * mass * measured.mean_square(problem, 0);
                response += measured.mean_square(problem, f);
            }
            match response > 0.0 {
                true => f64::sqrt(inertia / response),
                false => 0.0,
            }
        };
        (0..sizes.len())
            .map(|index| own(index).max(natural(index)))
            .collect()
    }

    /// Experiments with function `index` of the list, and its position in their coefficient set.
    fn with_function<'a>(
        &'a self,
        problem: &'a Problem,
        index: usize,
    ) -> impl Iterator<Item = (usize, &'a Measured)> {
        let all = problem.experiments.iter().zip(&self.experiments);
        all.filter_map(move |(experiment, measured)| {
            let assembly = problem
                .functions
                .coefficient_set(experiment.coefficient_set);
            let (position, _) = assembly.parts().find(|(_, f)| *f == index)?;
            Some((position, measured.as_ref()?))
        })
    }
}

/// Mass of the first coefficient set with function `index`.
fn mass_of(functions: &Parameterization, index: usize) -> Option<usize> {
    let mut nodal_sets = functions.coefficient_sets().iter();
    let nodal = nodal_sets.find(|set| set.parts().any(|(_, f)| f == index))?;
    nodal.first().copied()
}

impl Measured {
    /// Mean square of the factor of function `f`.
    fn mean_square(&self, problem: &Problem, f: usize) -> f64 {
        let n = self.positions.len();
        let squares = (0..n).map(|i| self.response(problem, f, i).powi(2));
        squares.sum::<f64>() / n.max(1) as f64
    }
}
