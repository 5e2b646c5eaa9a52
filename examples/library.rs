// The record of the README from Rust: estimates with units, 95 % intervals and status, and the verdict.

use kmcfit::config::{ModelFile, Source, Statements, scaffold};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let record = Source::file("data/shaker.csv", "data/shaker.csv");
    let model = scaffold(&[record], &Statements::default())?.text;
    let found = kmcfit::analyse(&ModelFile::parse("shaker.yaml", model)?, &mut |_| {})?;
    for estimate in found.estimates() {
        println!("{estimate}");
    }
    println!("{}", found.verdict());
    Ok(())
}
