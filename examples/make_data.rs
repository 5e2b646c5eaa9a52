//! Makes the files of `data/` that `kmcfit simulate` does not make: the system behind the paper's
//! data, and the response of a linearly decaying mass from its closed form.
//!
//! `cargo run --example make_data -- data`

use kmcfit::report::CsvTable;
use kmcfit::results::write_whole;
use std::path::{Path, PathBuf};

const NODES: usize = 2000;
const DURATION: f64 = 25.0;

fn times() -> Vec<f64> {
    (0..NODES)
        .map(|i| i as f64 * (DURATION / (NODES - 1) as f64))
        .collect()
}

/// m_i = 1 - 0.5 (i + 1)/N, c = 0, k = 1.
pub fn paper_truth() -> CsvTable {
    let mass = (0..NODES).map(|i| 1.0 - 0.5 * (i + 1) as f64 / NODES as f64);
    CsvTable::new()
        .column("t_s", times())
        .column("mass_kg", mass.collect())
        .column("damping_N_s_per_m", vec![0.0; NODES])
        .column("stiffness_N_per_m", vec![1.0; NODES])
}

/// The response for m = 1 - a t, c = 0, k = 1 from y(0) = 3.3, v(0) = 1: with x = 1 - a t and
/// z = 2 sqrt(x)/a, y = sqrt(x) [A J1(z) + B Y1(z)].
pub fn bessel() -> CsvTable {
    const A: f64 = -43.2406529071;
    const B: f64 = 1.75804247628;
    const RATE: f64 = 0.02;
    let displacement = |t: f64| {
        let root = (1.0 - RATE * t).sqrt();
        let z = 2.0 * root / RATE;
        root * (A * libm::j1(z) + B * libm::y1(z))
    };
    let times = times();
    let y = times.iter().map(|t| displacement(*t)).collect();
    CsvTable::new().column("t_s", times).column("y_m", y)
}

fn main() -> std::io::Result<()> {
    let folder = std::env::args_os()
        .nth(1)
        .map_or_else(|| PathBuf::from("data"), PathBuf::from);
    let write =
        |name: &str, table: CsvTable| write_whole(&Path::new(&folder).join(name), &table.to_csv());
    write("paper_truth.csv", paper_truth())?;
    write("bessel.csv", bessel())
}
