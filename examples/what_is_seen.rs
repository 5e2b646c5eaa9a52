// Before measuring: what can a record show? One free decay, and the same with a shaker run.

use kmcfit_core::internals::identifiability::{Symmetry, structural_rank};
use kmcfit_core::{Builder, CoefficientSpec, Record};
use kmcfit_core::{Excitation, Grid, Method, NodalCoefficients, State, System, Term};
use std::error::Error;

/// For one free record and for the pair: directions seen at most, and whether a factor of all functions
/// stays free.
pub fn found() -> Result<[(usize, bool); 2], Box<dyn Error>> {
    // Any response will do: what can be counted depends on the records, not on what they read.
    let grid = Grid::new(0.0, 20.0, 401).ok_or("a grid")?;
    let system = System {
        grid,
        method: Method::Rk4,
        terms: vec![Term::Damping, Term::Stiffness],
    };
    let nodes = grid.nodes();
    let nodal = NodalCoefficients {
        mass: vec![1.0; nodes],
        coefficients: vec![vec![0.1; nodes], vec![4.0; nodes]],
    };
    let times = grid.times();
    let force: Vec<f64> = times.iter().map(|t| (1.7 * t).sin()).collect();
    let excitation = Excitation::force_at_nodes(&force);
    let plucked = State {
        displacement: 1.0,
        velocity: 0.0,
    };
    let decay = system.forward(&nodal, plucked, None)?;
    let shaken = system.forward(&nodal, State::default(), Some(&excitation))?;

    let free = Record::new("free decay")
        .from_state(1.0, 0.0)
        .displacement(&times, &decay.displacement);
    let forced = Record::new("shaker")
        .from_state(0.0, 0.0)
        .force(&times, &force)
        .displacement(&times, &shaken.displacement);
    let parts = || [1.0, 0.1, 4.0].map(|start| CoefficientSpec::piecewise_linear(11, start));
    let alone = Builder::new(parts()).record(free.clone()).build()?;
    let pair = Builder::new(parts()).record(free).record(forced).build()?;
    Ok([alone, pair].map(|problem| {
        let seen = structural_rank(&problem);
        (seen.rank_bound, seen.symmetry != Symmetry::None)
    }))
}

pub fn main() -> Result<(), Box<dyn Error>> {
    for (name, (seen, open)) in ["a free decay", "with a shaker run"]
        .into_iter()
        .zip(found()?)
    {
        let scale = if open { "free" } else { "fixed" };
        println!("{name}: at most {seen} of 33 directions, common factor {scale}");
    }
    Ok(())
}
