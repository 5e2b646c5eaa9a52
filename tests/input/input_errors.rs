//! Errors of an input in model files: the problem that they give, and the messages about invalid ones.

use insta::assert_snapshot;
use kmcfit::config::{BuildMode, Model, ModelFile, build};
use kmcfit_core::record::InputNoiseKind;
use kmcfit_core::system::InputQuantity;

/// A forced record of 41 samples over 4 s; line 5 has the sigmas, line 7 a further key.
const FORCED: &str = "format: 1
experiments:
  - data: samples.csv
    columns: {displacement: y_m, force: f_N}
    sigma: {displacement: estimate, force: {value: 0.5, kind: sensor}}
    initial: {displacement: 1, velocity: 0}
    validation: false
grid: {nodes: 81}
functions:
  mass: {basis: constant, start: 2}
  damping: {basis: constant, start: 0.1}
  stiffness: {basis: constant, start: 2}
";

fn read(text: &str) -> Result<Model, String> {
    let folder = tempfile::tempdir().unwrap();
    let mut samples = String::from("t_s,y_m,v_m_per_s,f_N,s_m\n");
    for i in 0..41 {
        let t = f64::from(i) / 10.0;
        samples.push_str(&format!(
            "{t},{},{},{},0.1\n",
            t.cos(),
            -t.sin(),
            (3.0 * t).sin()
        ));
    }
    std::fs::write(folder.path().join("samples.csv"), samples).unwrap();
    let said = |error: kmcfit::error::InputError| {
        let shown = format!("{}/", folder.path().display());
        error.to_string().replace(&shown, "")
    };
    let file = ModelFile::parse(folder.path().join("m.yaml"), text).map_err(said)?;
    build(&file, BuildMode::Fit).map_err(said)
}

/// The message about the forced record with one place changed.
fn changed(from: &str, to: &str) -> String {
    assert!(FORCED.contains(from), "{from}");
    message(&FORCED.replacen(from, to, 1))
}

fn message(text: &str) -> String {
    match read(text) {
        Ok(_) => "no error".to_owned(),
        Err(message) => message,
    }
}

#[test]
fn the_sigma_of_an_input_is_that_of_its_samples() {
    for (word, kind) in [
        ("sensor", InputNoiseKind::Sensor),
        ("drive", InputNoiseKind::Drive),
    ] {
        let model =
            read(&FORCED.replace("sensor", word)).unwrap_or_else(|message| panic!("{message}"));
        let error = model.problem.experiments[0].input_error.clone().unwrap();
        assert_eq!(
            (error.quantity, error.kind, error.sigma),
            (InputQuantity::Force, kind, 0.5)
        );
        assert_eq!((error.times.len(), error.times[40]), (41, 4.0));
    }
    let base = FORCED
        .replace("force: f_N", "base_acceleration: f_N")
        .replace("force: {", "base_acceleration: {");
    let model = read(&base).unwrap_or_else(|message| panic!("{message}"));
    let error = model.problem.experiments[0].input_error.clone().unwrap();
    assert_eq!(error.quantity, InputQuantity::BaseAcceleration);
}

#[test]
fn values_of_the_sigma() {
    assert_snapshot!(changed("{value: 0.5, kind: sensor}", "0.5"), @"
    m.yaml:5:44: experiments[0].sigma.force: wrong type of value
      found: the number 0.5
      expected: a map such as {value: 0.5, kind: sensor}
    ");
    assert_snapshot!(changed("{value: 0.5, kind: sensor}", "{value: 0.5}"), @"
    m.yaml:5:37: experiments[0].sigma.force: the key `kind` is missing
      expected: the key `kind`
    ");
    assert_snapshot!(changed("value: 0.5", "value: 0"), @"
    m.yaml:5:44: experiments[0].sigma.force: a standard deviation must be positive
      found: 0
      expected: a number greater than 0, in SI units
    ");
    assert_snapshot!(changed("kind: sensor", "kind: noise"), @"
    m.yaml:5:63: experiments[0].sigma.force.kind: unknown choice
      found: `noise`
      expected: one of: sensor, drive
    ");
    assert_snapshot!(changed("force: {value", "base_acceleration: {value: 1, kind: drive}, force: {value"), @"
    m.yaml:5:56: experiments[0].sigma.base_acceleration: errors are supported for one input
      found: `force` and `base_acceleration`
      expected: one of the two
    ");
}

#[test]
fn records_without_what_errors_of_an_input_need() {
    assert_snapshot!(changed(", force: f_N", ""), @"
    m.yaml:5:44: experiments[0].sigma.force: the force is not measured
      found: no samples of the force
      expected: `columns: {force: …}`, or no sigma of it
    ");
    let two = FORCED
        .replace("y_m, force", "y_m, velocity: v_m_per_s, force")
        .replace("sigma: {", "sigma: {velocity: 0.1, ");
    assert_snapshot!(message(&two), @"
    m.yaml:5:59: experiments[0].sigma.force: errors of an input are supported for records with one channel
      found: 2 channels
      expected: one channel, or no sigma of the input
    ");
    assert_snapshot!(changed("displacement: estimate, ", ""), @"
    m.yaml:5:20: experiments[0].sigma.force: errors of an input need one sigma for all samples of the channel
      found: no `sigma.displacement`
      expected: `sigma: {displacement: …}`: a number, or `estimate`
    ");
    assert_snapshot!(changed("displacement: estimate", "displacement: s_m"), @"
    m.yaml:5:39: experiments[0].sigma.force: errors of an input need one sigma for all samples of the channel
      found: a column as `sigma.displacement`
      expected: `sigma: {displacement: …}`: a number, or `estimate`
    ");
    assert_snapshot!(changed("validation: false", "loss: {displacement: huber}"), @"
    m.yaml:5:44: experiments[0].sigma.force: errors of an input need the loss `squares`
      found: a robust loss of the displacement
      expected: `squares`, or no sigma of the input
    ");
    assert_snapshot!(changed("validation: false", "band: {max: 2}"), @"
    m.yaml:5:44: experiments[0].sigma.force: errors of an input need samples without a filter
      found: a filter of the displacement
      expected: no filter, or no sigma of the input
    ");
    assert_snapshot!(changed("validation: false", "noise: {displacement: {ar: 1}}"), @"
    m.yaml:5:44: experiments[0].sigma.force: errors of an input are supported with white noise of the channel
      found: `noise.displacement.ar`
      expected: `white` or `auto`, or no sigma of the input
    ");
    assert_snapshot!(changed("grid:", "fit: {method: steepest-descent}\ngrid:"), @"
    m.yaml:5:44: experiments[0].sigma.force: the method does not use errors of an input
      found: `steepest-descent`
      expected: `gauss-newton`, `projected-gradient` or `lbfgs`, or no sigma of the input
    ");
    assert_snapshot!(changed("mass: {basis: constant", "mass: {basis: nodal"), @"
    m.yaml:5:44: experiments[0].sigma.force: errors of an input are supported up to 64 parameters
      found: 83 parameters
      expected: bases with fewer parameters, or no sigma of the input
    ");
}
