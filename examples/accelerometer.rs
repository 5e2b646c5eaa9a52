// A shaken mass with an accelerometer and a force gauge: mass, damping and stiffness with standard errors.

use kmcfit::tables::Table;
use kmcfit_core::builder::{Builder, Record};
use kmcfit_core::identifiability::Bands;
use kmcfit_core::model::CoefficientSpec;
use kmcfit_core::signal::Interpolation;
use std::error::Error;

/// Value and standard error of mass (kg), damping (N s/m) and stiffness (N/m).
pub fn found() -> Result<[[f64; 2]; 3], Box<dyn Error>> {
    let table = Table::read("data/shaker.csv")?;
    let times = table.column("t_s")?;
    let record = Record::new("shaker")
        .from_state(0.0, 0.0)
        .force(times, table.column("f_N")?)
        // The sweep is smooth between its samples; linear interpolation would cause errors of five standard errors.
        .interpolation(Interpolation::Cubic)
        .acceleration(times, table.column("a_m_per_s2")?)
        .sigma(0.02);
    let nodal = [
        CoefficientSpec::constant(3.0),
        CoefficientSpec::constant(0.0),
        CoefficientSpec::constant(200.0),
    ];
    let problem = Builder::new(nodal).record(record).nodes(4801).build()?;
    let fit = problem.fit()?;
    println!("{}: {}", fit.outcome.status.name(), fit.outcome.reason);

    let best = &fit.best;
    let bands = Bands::at(&problem, &best.parameters, &best.evaluation);
    Ok([0, 1, 2].map(|j| {
        let band = &bands.functions[j];
        let point = &band.points[0];
        [point.value, point.standard_error]
    }))
}

pub fn main() -> Result<(), Box<dyn Error>> {
    for (name, [value, error]) in ["m", "c", "k"].into_iter().zip(found()?) {
        println!("{name} = {value:.4} +- {error:.4}");
    }
    Ok(())
}
