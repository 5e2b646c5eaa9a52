// Damping and stiffness of a free decay with known mass, from arrays.

use kmcfit_core::builder::{Builder, Record};
use kmcfit_core::model::CoefficientSpec;
use std::error::Error;

/// Damping (N s/m) and stiffness (N/m).
pub fn found() -> Result<[f64; 2], Box<dyn Error>> {
    // m = 1 kg, c = 2 N s/m, k = 2500 N/m: a ring-down at 8 Hz, from its closed form.
    let times: Vec<f64> = (0..=1000).map(|i| f64::from(i) * 1e-3).collect();
    let omega = 2499.0f64.sqrt();
    let decay = |t: &f64| 0.01 * (-t).exp() * ((omega * t).cos() + (omega * t).sin() / omega);
    let response: Vec<f64> = times.iter().map(decay).collect();

    let nodal = [
        CoefficientSpec::fixed(1.0),
        CoefficientSpec::constant(1.0).min(0.0),
        CoefficientSpec::constant(2000.0).min(0.0),
    ];
    let record = Record::new("ring-down")
        .from_state(0.01, 0.0)
        .displacement(&times, &response);
    let fit = Builder::new(nodal).record(record).build()?.fit()?;

    println!("{}: {}", fit.outcome.status.name(), fit.outcome.reason);
    Ok([0, 1].map(|j| fit.best.evaluation.nodal.coefficients[j][0]))
}

pub fn main() -> Result<(), Box<dyn Error>> {
    let [c, k] = found()?;
    println!("c = {c:.3} N s/m, k = {k:.1} N/m");
    Ok(())
}
