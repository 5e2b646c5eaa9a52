// The paper's record: smoothness, a monotone mass and a known stiffness select the true system among all that match the
// record.

use kmcfit::tables::Table;
use kmcfit_core::builder::{Builder, Record};
use kmcfit_core::constraints::{Constraint, Shape};
use kmcfit_core::model::CoefficientSpec;
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::system::Method;
use std::error::Error;

/// Largest error of the mass, kg; the true mass decreases linearly from 1 to 0.5 kg.
pub fn found() -> Result<f64, Box<dyn Error>> {
    let table = Table::read("data/paper.csv")?;
    let record = Record::new("free decay")
        .from_state(3.3, 1.0)
        .displacement(table.column("t_s")?, table.column("y_m")?);
    let nodal = [
        // Positive, with the smallest curvature that matches the record.
        CoefficientSpec::nodal(2.0).min(0.05).tikhonov(2, 1e-3),
        CoefficientSpec::nodal(1.0).min(0.0).tikhonov(2, 1e-3),
        // A free response determines ratios only: one function must be known.
        CoefficientSpec::fixed(1.0),
    ];
    let problem = Builder::new(nodal)
        .record(record)
        .method(Method::Midpoint)
        .constrain(Constraint::Shape {
            of: CoefficientKind::MASS,
            shape: Shape::NonIncreasing,
        })
        .build()?;
    let fit = problem.fit()?;
    println!("{}: {}", fit.outcome.status.name(), fit.outcome.reason);

    let mass = &fit.best.evaluation.nodal.inertias[0];
    let count = mass.len() as f64;
    let truth = (1..=mass.len()).map(|i| 1.0 - 0.5 * i as f64 / count);
    let errors = mass.iter().zip(truth).map(|(m, truth)| (m - truth).abs());
    Ok(errors.fold(0.0, f64::max))
}

pub fn main() -> Result<(), Box<dyn Error>> {
    println!("largest error of the mass: {:.1e} kg", found()?);
    Ok(())
}
