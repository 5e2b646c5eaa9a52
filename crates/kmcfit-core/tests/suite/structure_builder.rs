//! Structures by names: built from coordinates and elements, fitted, and refused.

use crate::common::forced::{broadband, rms, white};
use crate::common::synthetic::with_noise;
use kmcfit_core::builder::{Builder, Record};
use kmcfit_core::model::StructureSpec;
use kmcfit_core::problem::Problem;
use kmcfit_core::solvers::{FitSettings, Status, fit};
use serde_json::{Value, json};

const MASSES: [f64; 3] = [1.0, 0.9, 0.8];
const SPRINGS: [f64; 3] = [900.0, 800.0, 700.0];
const DAMPERS: [f64; 3] = [0.6, 0.5, 0.4];

fn spec(value: Value) -> StructureSpec {
    serde_json::from_value(value).expect("a structure")
}

/// Three storeys whose springs and dampers start at `factor` times the truth; the first mass is known.
fn building(factor: f64) -> StructureSpec {
    let ends = |j: usize| match j {
        0 => json!(["ground", "floor_1"]),
        _ => json!([format!("floor_{j}"), format!("floor_{}", j + 1)]),
    };
    let free = |start: f64| json!({"basis": "constant", "start": factor * start, "min": 0.0});
    let mut coordinates = serde_json::Map::new();
    let mut elements = serde_json::Map::new();
    for j in 0..3 {
        let mass = match j {
            0 => json!({"fixed": MASSES[0]}),
            _ => json!({"basis": "constant", "start": MASSES[j]}),
        };
        coordinates.insert(format!("floor_{}", j + 1), json!({"mass": mass}));
        for (law, start) in [("spring", SPRINGS[j]), ("damper", DAMPERS[j])] {
            let mut element = free(start);
            element[law] = ends(j);
            elements.insert(format!("{law}_{}", j + 1), element);
        }
    }
    spec(json!({"coordinates": coordinates, "elements": elements}))
}

/// Absolute accelerations of the storeys under the acceleration `base`, linear between its samples, by the classical method of Runge and
/// Kutta with ten steps between samples.
fn accelerations(base: &[f64], step: f64) -> [Vec<f64>; 3] {
    let relative = |x: &[f64; 6], ground: f64| -> [f64; 6] {
        let force = |j: usize| {
            let (q, v) = match j {
                0 => (x[0], x[3]),
                _ => (x[j] - x[j - 1], x[3 + j] - x[2 + j]),
            };
            SPRINGS[j] * q + DAMPERS[j] * v
        };
        let net = |j: usize| force(j) - if j < 2 { force(j + 1) } else { 0.0 };
        let a = |j: usize| -net(j) / MASSES[j] - ground;
        [x[3], x[4], x[5], a(0), a(1), a(2)]
    };
    let plus = |x: &[f64; 6], k: &[f64; 6], h: f64| -> [f64; 6] {
        std::array::from_fn(|i| x[i] + h * k[i])
    };
    let mut found: [Vec<f64>; 3] = Default::default();
    let mut x = [0.0; 6];
    for (i, ground) in base.iter().enumerate() {
        let slope = relative(&x, *ground);
        (0..3).for_each(|j| found[j].push(slope[3 + j] + ground));
        let Some(next) = base.get(i + 1) else { break };
        let h = step / 10.0;
        for s in 0..10 {
            let at = |t: f64| ground + (next - ground) * (f64::from(s) + t) / 10.0;
            let k1 = relative(&x, at(0.0));
            let k2 = relative(&plus(&x, &k1, 0.5 * h), at(0.5));
            let k3 = relative(&plus(&x, &k2, 0.5 * h), at(0.5));
            let k4 = relative(&plus(&x, &k3, h), at(1.0));
            x = std::array::from_fn(|i| {
                x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
            });
        }
    }
    found
}

fn shaken(structure: &StructureSpec) -> Problem {
    let (step, samples) = (0.01, 2001);
    let times: Vec<f64> = (0..samples).map(|i| step * f64::from(i)).collect();
    let base = broadband(white(11, 2, samples as usize));
    let mut record = Record::new("shake")
        .from_state(0.0, 0.0)
        .base_acceleration(&times, &base);
    for (j, clean) in accelerations(&base, step).iter().enumerate() {
        let sigma = 0.02 * rms(clean);
        let noisy = with_noise(clean, sigma, 1 + j as u64);
        let floor = format!("floor_{}", j + 1);
        record = record
            .acceleration(&times, &noisy)
            .sigma(sigma)
            .at(&[&floor]);
    }
    let builder = Builder::structure(structure).expect("a builder");
    // Four steps between samples, whose errors are below the noise.
    let builder = builder.record(record).nodes(4 * (samples as usize - 1) + 1);
    builder.build().expect("a problem")
}

/// Springs and dampers from three times, and from a third of, their values.
#[test]
fn a_building_is_recovered() {
    let truth = shaken(&building(1.0)).start();
    for factor in [3.0, 1.0 / 3.0] {
        let problem = shaken(&building(factor));
        let found = fit(
            &problem,
            &problem.start(),
            &FitSettings::default(),
            &mut |_| {},
        );
        let found = found.expect("a fit");
        assert_eq!(found.outcome.status, Status::Converged, "{factor}");
        let covariance = problem.covariance(&found.best.evaluation);
        let covariance = covariance.expect("a covariance");
        let parameters = found.best.parameters.iter().zip(&truth).enumerate();
        for (j, (x, truth)) in parameters {
            // A standardised error beyond 4 has a probability of 6e-5.
            let error = (x - truth) / covariance[(j, j)].sqrt();
            assert!(error.abs() < 4.0, "{factor} {j}: {x} {truth} {error}");
        }
    }
    let names: Vec<String> = shaken(&building(1.0))
        .functions
        .iter()
        .map(|f| f.name())
        .collect();
    assert_eq!(
        names[..4],
        ["floor_1.mass", "floor_2.mass", "floor_3.mass", "damper_1"]
    );
}

/// Keys and values found of what is refused.
#[test]
fn invalid_structures_are_refused() {
    let refused = |mass: f64, elements: Value| {
        let mass = json!({"mass": {"fixed": mass}});
        let coordinates = json!({"a": mass, "b": mass});
        let structure = spec(json!({"coordinates": coordinates, "elements": elements}));
        let times = [0.0, 0.1, 0.2, 0.3];
        let record = Record::new("free").from_state(1.0, 0.0);
        let record = record.displacement(&times, &[0.0; 4]).sigma(1.0).at(&["c"]);
        let built = Builder::structure(&structure).and_then(|b| b.record(record).build());
        let error = built.expect_err("an error");
        (error.key, error.found.unwrap_or_default())
    };
    let spring = |ends: Value| json!({"spring": ends, "fixed": 1.0});
    let held = json!({"k": spring(json!(["ground", "a"])), "l": spring(json!(["a", "b"]))});
    for (mass, elements, key, found) in [
        (1.0, held.clone(), "experiments[0].channels[0]", "`c`"),
        (0.0, held, "structure.coordinates.a.mass.fixed", "0"),
        (
            1.0,
            json!({"k": spring(json!(["a", "b"]))}),
            "structure.coordinates.a",
            "`a` and `b`",
        ),
        (
            1.0,
            json!({"k": spring(json!(["a", "x"]))}),
            "structure.elements.k.spring",
            "`x`",
        ),
        (
            1.0,
            json!({"k": spring(json!(["a", "a"]))}),
            "structure.elements.k.spring",
            "a and a",
        ),
        (
            1.0,
            json!({"k": {"fixed": 1.0}}),
            "structure.elements.k",
            "none",
        ),
        (
            1.0,
            json!({"k.x": spring(json!(["ground", "a"]))}),
            "structure.elements",
            "`k.x`",
        ),
    ] {
        assert_eq!(refused(mass, elements), (key.to_owned(), found.to_owned()));
    }
}
