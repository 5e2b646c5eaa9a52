//! Prints the estimates from a file of times and displacements, one pair a line behind a heading.

fn main() {
    let path = std::env::args().nth(1).expect("a file");
    let text = std::fs::read_to_string(path).expect("text");
    let pairs = text.lines().skip(1).map(|line| {
        let (t, y) = line.split_once(',').expect("two numbers");
        (t.parse::<f64>().expect("a time"), y.parse::<f64>().expect("a displacement"))
    });
    let (times, displacement): (Vec<f64>, Vec<f64>) = pairs.unzip();
    let found = kmcfit_core_wasm_test::estimates(&times, &displacement).expect("a converged fit");
    println!("{found:?}");
}
