//! The fit of `models/linear-mass.yaml`, arrays in, arrays out.

use kmcfit_core::{Builder, CoefficientSpec, Method, Record};
use std::cell::RefCell;

thread_local! {
    static INPUT: RefCell<Vec<f64>> = const { RefCell::new(Vec::new()) };
    static OUTPUT: RefCell<Vec<f64>> = const { RefCell::new(Vec::new()) };
}

/// Mass at both ends (kg) and damping (N s/m) of a free decay from 3.3 m and 1 m/s, with a stiffness of 1 N/m: a mass linear
/// in time, a constant damping. `None` where the fit does not converge.
fn estimates(times: &[f64], displacement: &[f64]) -> Option<[f64; 3]> {
    let system = [
        CoefficientSpec::polynomial(&[2.0, 0.0]).min(0.05),
        CoefficientSpec::constant(1.0),
        CoefficientSpec::fixed(1.0),
    ];
    let record = Record::new("free decay")
        .from_state(3.3, 1.0)
        .displacement(times, displacement);
    let builder = Builder::new(system).record(record);
    let fit = builder.method(Method::Midpoint).build().ok()?.fit().ok()?;
    let coefficients = &fit.best.evaluation.nodal;
    let mass = &coefficients.inertias[0];
    (fit.outcome.status.name() == "converged")
        .then(|| [mass[0], mass[mass.len() - 1], coefficients.coefficients[0][0]])
}

/// Adds a number to the input: all times, then all displacements.
#[unsafe(no_mangle)]
pub extern "C" fn push(value: f64) {
    INPUT.with_borrow_mut(|input| input.push(value));
}

/// Fits the input; the number of estimates.
#[unsafe(no_mangle)]
pub extern "C" fn fit() -> u32 {
    let found = INPUT.with_borrow(|input| {
        let (times, displacement) = input.split_at(input.len() / 2);
        estimates(times, displacement)
    });
    let found = found.map_or(Vec::new(), Vec::from);
    let count = found.len() as u32;
    OUTPUT.with_borrow_mut(|output| *output = found);
    count
}

/// An estimate, by its index.
#[unsafe(no_mangle)]
pub extern "C" fn estimate(index: u32) -> f64 {
    OUTPUT.with_borrow(|output| output.get(index as usize).copied().unwrap_or(f64::NAN))
}
