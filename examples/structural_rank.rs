// Number of parameter combinations that a free decay determines, by itself and together with a shaker run; no measured
// values are needed.

use kmcfit_core::builder::{Builder, Record};
use kmcfit_core::identifiability::{ScaleFreedom, structural_rank};
use kmcfit_core::model::CoefficientSpec;
use kmcfit_core::structure::{Law, Structure};
use kmcfit_core::system::{Excitation, Grid, Method, NodalCoefficients, State, System};
use std::error::Error;

/// Structural rank of the free record and of the pair, each with `true` if a common factor of all functions is
/// undetermined.
pub fn found() -> Result<[(usize, bool); 2], Box<dyn Error>> {
    // The rank depends on inputs and sample times only, so the response of any system serves as the record.
    let grid = Grid::new(0.0, 20.0, 401).ok_or("a grid")?;
    let system = System {
        grid,
        method: Method::Rk4,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
    };
    let nodes = grid.nodes();
    let nodal = NodalCoefficients {
        inertias: vec![vec![1.0; nodes]],
        coefficients: vec![vec![0.1; nodes], vec![4.0; nodes]],
    };
    let times = grid.times();
    let force: Vec<f64> = times.iter().map(|t| (1.7 * t).sin()).collect();
    let excitation = Excitation::force_at_nodes(&force);
    let plucked = State::one(1.0, 0.0);
    let decay = system.forward(&nodal, &plucked, None)?;
    let shaken = system.forward(&nodal, &State::rest(1), Some(&excitation))?;

    let free = Record::new("free decay")
        .from_state(1.0, 0.0)
        .displacement(&times, decay.displacement(0));
    let forced = Record::new("shaker")
        .from_state(0.0, 0.0)
        .force(&times, &force)
        .displacement(&times, shaken.displacement(0));
    let parts = || [1.0, 0.1, 4.0].map(|start| CoefficientSpec::piecewise_linear(11, start));
    let alone = Builder::new(parts()).record(free.clone()).build()?;
    let pair = Builder::new(parts()).record(free).record(forced).build()?;
    Ok([alone, pair].map(|problem| {
        let rank = structural_rank(&problem);
        (rank.rank_bound, rank.scale_freedom != ScaleFreedom::None)
    }))
}

pub fn main() -> Result<(), Box<dyn Error>> {
    for (name, (rank, open)) in ["a free decay", "with a shaker run"]
        .into_iter()
        .zip(found()?)
    {
        let scale = if open { "undetermined" } else { "determined" };
        println!("{name}: at most {rank} of 33 parameter combinations; common factor {scale}");
    }
    Ok(())
}
