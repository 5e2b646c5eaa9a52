//! Advice: what is tried before it is given has the stated effect when it is followed.
//!
//! Each case is a model or record with one defect. The fit gives the advice as texts for `--set`; with these the verdict or BIC improves as
//! stated, and the root-mean-square residual of a validation record of the same system, without noise and defect, does not grow.

use crate::oscillator::displacements;
use crate::workbench::Workbench;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;

const SAMPLES: usize = 600;
const SPACING: f64 = 0.02;
/// Noise relative to the root mean square of the response.
const NOISE: f64 = 0.01;
/// Steps of the integrator per sample; its error is below 1e-8 of the amplitude.
const SUBSTEPS: usize = 20;

/// `m y'' + c y' + (k + rate t) y + cubic y^3 + friction sign(y') = f` with m = 2 kg, c = 3 N s/m, k = 800 N/m: 3.2 Hz, 3.8 % damping.
#[derive(Clone, Copy, Default)]
struct System {
    rate: f64,
    cubic: f64,
    friction: f64,
}

fn white(seed: u64, count: usize) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..count)
        .map(|_| StandardNormal.sample(&mut random))
        .collect()
}

/// A force of 10 N rms with a correlation time of three samples.
fn force(seed: u64) -> Vec<f64> {
    let mut smooth = 0.0;
    let each = white(seed, SAMPLES).into_iter().map(|e| {
        smooth = 0.7 * smooth + e;
        7.0 * smooth
    });
    each.collect()
}

impl System {
    fn acceleration(&self, t: f64, y: f64, v: f64, f: f64) -> f64 {
        let friction = self.friction * (v / 1e-4).clamp(-1.0, 1.0);
        let spring = (800.0 + self.rate * t) * y + self.cubic * y * y * y;
        (f - 3.0 * v - spring - friction) / 2.0
    }

    /// Displacements at the samples, from rest.
    fn displacement(&self, force: &[f64]) -> Vec<f64> {
        let acceleration = |t, y, v, f| self.acceleration(t, y, v, f);
        let all = displacements(force, SPACING, SUBSTEPS, acceleration);
        all.into_iter().step_by(SUBSTEPS).collect()
    }
}

/// Rows `t,f,y`: times, force and displacement with noise, each changed by the defect `(time, force, displacement)`.
fn record(
    system: &System,
    seed: u64,
    noise_share: f64,
    defect: impl Fn(usize, [f64; 3]) -> [f64; 3],
) -> String {
    let force = force(seed);
    let exact = system.displacement(&force);
    let rms = (exact.iter().map(|y| y * y).sum::<f64>() / SAMPLES as f64).sqrt();
    let noise = white(seed + 1000, SAMPLES);
    let rows = (0..SAMPLES).map(|i| {
        let row = [
            SPACING * i as f64,
            force[i],
            exact[i] + noise_share * rms * noise[i],
        ];
        let [t, f, y] = defect(i, row);
        format!("{t},{f},{y}\n")
    });
    format!("t_s,force_N,y_m\n{}", rows.collect::<String>())
}

const MODEL: &str = "format: 1
experiments:
  - name: shaker
    data: fitted.csv
    columns: {time: t_s, force: force_N, displacement: y_m}
    sigma: {displacement: estimate}
    initial: {displacement: 0, velocity: 0}
  - name: second
    data: second.csv
    columns: {time: t_s, force: force_N, displacement: y_m}
    sigma: {displacement: estimate}
    initial: {displacement: 0, velocity: 0}
    validation: true
functions:
  mass: {basis: constant, start: 2.5}
  damping: {basis: constant, start: 2.0}
  stiffness: {basis: constant, start: 850}
fit: {method: gauss-newton}
";

/// A case: the kind of the advice, and what is wrong.
struct Case {
    kind: &'static str,
    system: System,
    defect: fn(usize, [f64; 3]) -> [f64; 3],
    /// Replacements in the model.
    wrong: &'static [(&'static str, &'static str)],
}

const LINEAR: System = System {
    rate: 0.0,
    cubic: 0.0,
    friction: 0.0,
};

fn same(_: usize, row: [f64; 3]) -> [f64; 3] {
    row
}

const CASES: &[Case] = &[
    Case {
        kind: "finer_steps",
        system: LINEAR,
        defect: same,
        wrong: &[("functions:", "grid: {nodes: 150}\nfunctions:")],
    },
    Case {
        kind: "add",
        system: System {
            cubic: 5e4,
            ..LINEAR
        },
        defect: same,
        wrong: &[],
    },
    Case {
        kind: "add",
        system: System {
            friction: 2.0,
            ..LINEAR
        },
        defect: same,
        wrong: &[],
    },
    Case {
        kind: "add",
        system: LINEAR,
        defect: |_, [t, f, y]| [t, f, y + 2e-4],
        wrong: &[],
    },
    Case {
        kind: "add",
        system: LINEAR,
        defect: |_, [t, f, y]| [t, f, y + 2e-3],
        wrong: &[],
    },
    Case {
        kind: "estimate_drift",
        system: LINEAR,
        defect: |_, [t, f, y]| [t, f, y + 1e-3 * (t - 6.0)],
        wrong: &[],
    },
    Case {
        kind: "reverse_input",
        system: LINEAR,
        defect: |_, [t, f, y]| [t, -f, y],
        wrong: &[],
    },
    Case {
        kind: "narrow_friction",
        system: System {
            friction: 2.0,
            ..LINEAR
        },
        defect: same,
        wrong: &[(
            "fit:",
            "  coulomb_friction: {basis: constant, start: 1.5, width: 0.05}\nfit:",
        )],
    },
    Case {
        kind: "constant",
        system: LINEAR,
        defect: same,
        wrong: &[(
            "stiffness: {basis: constant,",
            "stiffness: {basis: piecewise-linear, knots: 20,",
        )],
    },
    Case {
        kind: "larger_sigma",
        system: LINEAR,
        defect: same,
        wrong: &[("displacement: estimate", "displacement: 1e-5")],
    },
    Case {
        kind: "robust_loss",
        system: LINEAR,
        defect: |i, [t, f, y]| [t, f, if i % 100 == 50 { y + 0.2 } else { y }],
        wrong: &[],
    },
];

/// The model with a defect.
fn spoilt(changes: &[(&str, &str)]) -> String {
    let mut text = MODEL.to_owned();
    for (from, to) in changes {
        assert!(text.contains(from), "{from} is not in the model");
        text = text.replacen(from, to, 1);
    }
    text
}

/// The result of a fit.
fn fitted(bench: &Workbench, overrides: &[&str]) -> Value {
    let mut arguments = vec!["fit", "model.yaml", "--no-report", "--json"];
    arguments.extend(overrides.iter().flat_map(|text| ["--set", text]));
    let (_, printed, error) = bench.run(&arguments);
    serde_json::from_str(&printed).unwrap_or_else(|_| panic!("{overrides:?}: {error}"))
}

/// Residual of the validation record; infinite without a prediction.
fn predicted(result: &Value) -> f64 {
    let residual = result["validation"][0]["channels"][0]["rms_residual"].as_f64();
    residual.unwrap_or(f64::INFINITY)
}

fn bench(case: &Case) -> Workbench {
    let bench = Workbench::empty();
    bench.write("fitted.csv", &record(&case.system, 1, NOISE, case.defect));
    bench.write("second.csv", &record(&case.system, 101, 0.0, same));
    bench.write("model.yaml", &spoilt(case.wrong));
    bench
}

impl Case {
    /// What is wrong with the advice, if anything.
    fn problem(&self) -> Result<(), String> {
        let bench = bench(self);
        let before = fitted(&bench, &[]);
        let mut advice = before["advice"].as_array().into_iter().flatten();
        let found = advice.find(|a| a["kind"] == self.kind).ok_or_else(|| {
            let [advice, reasons] = [&before["advice"], &before["verdict"]["reasons"]];
            format!("no such advice: {advice:#} {reasons:#}")
        })?;
        let set = found["set"].as_array().into_iter().flatten();
        let set: Vec<&str> = set.filter_map(Value::as_str).collect();
        let words = found["text"].as_str().unwrap_or_default();
        for text in &set {
            assert!(words.contains(text), "{words}");
        }
        let after = fitted(&bench, &set);
        let tried = found["tried"].as_str().unwrap_or_default();
        let level = after["verdict"]["level"].as_str().unwrap_or_default();
        let [bic, bic_after] = [&before, &after].map(|r| r["statistics"]["bic"].as_f64());
        let is_as_stated = match tried.strip_prefix("tried: BIC ") {
            Some(_) => bic
                .zip(bic_after)
                .is_some_and(|(before, after)| after < before - 6.0),
            None => tried.to_lowercase() == format!("tried: {level}"),
        };
        if !is_as_stated {
            return Err(format!("{words}: {level}, BIC {bic:?} to {bic_after:?}"));
        }
        let [residual, residual_after] = [&before, &after].map(predicted);
        println!("{words}: prediction {residual:.4e} to {residual_after:.4e}");
        match residual_after <= 1.001 * residual {
            true => Ok(()),
            false => Err(format!(
                "{words}: prediction {residual:.4e} to {residual_after:.4e}"
            )),
        }
    }
}

#[test]
fn what_was_tried_improves_the_fit_as_stated() {
    let failed: Vec<String> = CASES
        .iter()
        .filter_map(|case| Some(format!("{}: {}", case.kind, case.problem().err()?)))
        .collect();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn nothing_is_advised_on_a_correct_model() {
    let case = Case {
        kind: "",
        system: LINEAR,
        defect: same,
        wrong: &[],
    };
    let result = fitted(&bench(&case), &[]);
    assert_eq!(result["verdict"]["level"], "adequate", "{result:#}");
    assert!(result["advice"].is_null(), "{:#}", result["advice"]);
}

/// What takes longer than the fit is not tried, and marked so.
#[test]
fn limits_of_a_search_are_not_tried() {
    let limits = [
        ("more_iterations", "stop: {iterations: 1, tolerance: 1e-9}"),
        ("more_time", "stop: {seconds: 1e-9}"),
    ];
    for (kind, stop) in limits {
        let bench = bench(&Case {
            kind,
            system: LINEAR,
            defect: same,
            wrong: &[],
        });
        let model = spoilt(&[("gauss-newton}", &format!("gauss-newton, {stop}}}"))]);
        bench.write(
            "model.yaml",
            &model.replace("    sigma: {displacement: estimate}\n", ""),
        );
        let result = fitted(&bench, &[]);
        let mut advice = result["advice"].as_array().into_iter().flatten();
        let found = advice.find(|a| a["kind"] == kind);
        let found = found.unwrap_or_else(|| panic!("{:#}", result["advice"]));
        assert_eq!(found["tried"], "not tried");
    }
}
