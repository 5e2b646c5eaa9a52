//! Cost and derivatives as functions of the parameters.

use crate::errors::{Failure, guarded};
use crate::source::{RawModel, from_bytes, to_bytes};
use kmcfit_core::objective::Evaluation;
use kmcfit_core::problem::Problem as Core;
use kmcfit_core::step::SimulationError;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyBytes;

/// The problem of a model.
#[pyclass(frozen, module = "kmcfit._kmcfit")]
pub struct Problem {
    core: Core,
}

fn no_response(breakdown: SimulationError) -> Failure {
    Failure::Numerical(format!("no response: {breakdown}"))
}

impl Problem {
    /// A result of the evaluation at `theta`, as the bytes of numbers.
    fn at<'py>(
        &self,
        py: Python<'py>,
        theta: &PyBackedBytes,
        find: impl FnOnce(&Core, &[f64], &Evaluation) -> Vec<f64> + Send,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let theta = from_bytes(theta);
        let values = guarded(py, || {
            let evaluation = self.core.evaluate(&theta).map_err(no_response)?;
            Ok(find(&self.core, &theta, &evaluation))
        })?;
        Ok(PyBytes::new(py, &to_bytes(&values)))
    }
}

#[pymethods]
impl Problem {
    #[new]
    fn new(py: Python<'_>, model: Py<RawModel>) -> PyResult<Self> {
        let model = model.get();
        guarded(py, || {
            Ok(Self {
                core: model.build()?.problem,
            })
        })
    }

    /// Names of the parameters.
    fn names(&self) -> Vec<String> {
        let functions = &self.core.functions;
        let mut names = Vec::new();
        for (function, range) in functions.iter().zip(functions.ranges()) {
            let name = |i: usize| match range.len() {
                1 => function.name(),
                _ => format!("{}[{i}]", function.name()),
            };
            names.extend((0..range.len()).map(name));
        }
        names.extend(functions.scalars().iter().map(|s| s.name.clone()));
        names
    }

    /// The starting point.
    fn start<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &to_bytes(&self.core.start()))
    }

    /// The samples of all channels.
    fn observed<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        let samples = self.core.channels().flat_map(|c| c.observed());
        PyBytes::new(py, &to_bytes(&samples.copied().collect::<Vec<_>>()))
    }

    fn cost(&self, py: Python<'_>, theta: PyBackedBytes) -> PyResult<f64> {
        let theta = from_bytes(&theta);
        guarded(py, || {
            Ok(self.core.evaluate(&theta).map_err(no_response)?.cost)
        })
    }

    fn cost_and_gradient<'py>(
        &self,
        py: Python<'py>,
        theta: PyBackedBytes,
    ) -> PyResult<(f64, Bound<'py, PyBytes>)> {
        let theta = from_bytes(&theta);
        let (cost, gradient) = guarded(py, || {
            let mut gradient = vec![0.0; theta.len()];
            let cost = self.core.cost_and_gradient(&theta, &mut gradient);
            Ok((cost.map_err(no_response)?, gradient))
        })?;
        Ok((cost, PyBytes::new(py, &to_bytes(&gradient))))
    }

    fn predict<'py>(&self, py: Python<'py>, theta: PyBackedBytes) -> PyResult<Bound<'py, PyBytes>> {
        self.at(py, &theta, |_, _, evaluation| {
            evaluation
                .predictions
                .iter()
                .flatten()
                .flatten()
                .copied()
                .collect()
        })
    }

    fn weights<'py>(&self, py: Python<'py>, theta: PyBackedBytes) -> PyResult<Bound<'py, PyBytes>> {
        self.at(py, &theta, |core, _, evaluation| {
            let predictions = evaluation.predictions.iter().flatten();
            let channels = core.channels().zip(predictions);
            let weights = channels.flat_map(|(channel, predicted)| {
                let residuals = channel.residuals(predicted).enumerate();
                residuals
                    .map(|(i, r)| channel.weight(i, r))
                    .collect::<Vec<_>>()
            });
            weights.collect()
        })
    }

    fn jvp<'py>(
        &self,
        py: Python<'py>,
        theta: PyBackedBytes,
        along: PyBackedBytes,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let along = from_bytes(&along);
        self.at(py, &theta, |core, _, evaluation| {
            let change = core.predictions_tangent(evaluation, &along);
            change.into_iter().flatten().flatten().collect()
        })
    }

    fn vjp<'py>(
        &self,
        py: Python<'py>,
        theta: PyBackedBytes,
        slopes: PyBackedBytes,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let slopes = from_bytes(&slopes);
        self.at(py, &theta, |core, _, evaluation| {
            core.predictions_transpose(evaluation, &slopes)
        })
    }

    /// The Jacobian of the predictions, column by column.
    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        theta: PyBackedBytes,
    ) -> PyResult<Bound<'py, PyBytes>> {
        self.at(py, &theta, |core, _, evaluation| {
            core.predictions_jacobian(evaluation).as_slice().to_vec()
        })
    }
}
