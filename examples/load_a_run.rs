// Loads the results of `kmcfit fit models/linear-mass.yaml` and simulates the response from another initial state.

use kmcfit::Run;
use kmcfit_core::system::State;
use std::error::Error;
use std::path::Path;

/// The ratio J/J0, and the largest displacement (m) of the identified system released at 1 m.
pub fn found(folder: &Path) -> Result<[f64; 2], Box<dyn Error>> {
    let run = Run::open(folder)?;
    let let_go = State::one(1.0, 0.0);
    let response = run.system.forward(&run.coefficients, &let_go, None)?;
    let most = response
        .displacement(0)
        .iter()
        .fold(0.0, |most: f64, y| most.max(y.abs()));
    Ok([run.document.cost.ratio, most])
}

pub fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1);
    let [ratio, most] = found(Path::new(folder.as_deref().unwrap_or("runs/linear-mass")))?;
    println!("J/J0 = {ratio:.1e}; let go at 1 m it swings to {most:.2} m");
    Ok(())
}
