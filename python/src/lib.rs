//! The extension module `kmcfit._kmcfit`: models, fits and runs for the Python package on top of it.

#![forbid(unsafe_code)]
#![allow(
    clippy::result_large_err,
    reason = "as in the application: an input error ends the call"
)]

mod errors;
mod fit;
mod fleet;
mod problem;
mod runs;
mod source;
mod study;

use mimalloc::MiMalloc;
use pyo3::prelude::*;

/// As in the program: the system's allocator returns the pages of arrays with one value per node at once.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

#[pymodule]
mod _kmcfit {
    use super::*;
    use std::ffi::OsString;

    #[pymodule_export]
    use crate::fit::{RawFit, fit};
    #[pymodule_export]
    use crate::fleet::{RawFleet, RawFolder, record_list};
    #[pymodule_export]
    use crate::problem::Problem;
    #[pymodule_export]
    use crate::runs::{
        compare, open_run, parse, quantity, read_table, read_text, scaffold, simulate,
    };
    #[pymodule_export]
    use crate::source::RawModel;
    #[pymodule_export]
    use crate::study::{study, study_run};

    /// Provides the services of the process once.
    #[pymodule_init]
    fn init(_module: &Bound<'_, PyModule>) -> PyResult<()> {
        kmcfit::cli::provide_host();
        Ok(())
    }

    /// Runs the program on its arguments; returns its exit code.
    #[pyfunction]
    fn main(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
        let words = std::iter::once(OsString::from("kmcfit")).chain(arguments);
        py.detach(|| kmcfit::cli::run(words.collect()))
    }

    /// Names of the coefficient functions.
    #[pyfunction]
    fn coefficient_names() -> Vec<&'static str> {
        let kinds = kmcfit_core::structure::CoefficientKind::ALL.into_iter();
        kinds.map(kmcfit_core::structure::CoefficientKind::name).collect()
    }

    /// Version of the package.
    #[pyfunction]
    fn version() -> &'static str {
        env!("CARGO_PKG_VERSION")
    }
}
