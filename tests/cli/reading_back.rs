//! The library loads finished runs.

use crate::workbench::{Workbench, column, paper_run};
use kmcfit::Run;
use kmcfit_core::solvers::Status;

#[test]
fn a_run_equals_its_files() {
    let (bench, _) = paper_run();
    let run = Run::open(bench.path("runs/paper")).expect("a run");
    let read = |table: &str, name: &str| column(&bench.read(&format!("runs/paper/{table}")), name);
    assert_eq!(run.document.outcome.status, Status::Completed);
    assert_eq!(
        run.value["cost"]["final"].as_f64(),
        Some(run.document.cost.r#final)
    );
    let costs: Vec<f64> = run.history.iter().map(|row| row.cost).collect();
    assert_eq!(costs, read("history.csv", "cost"));
    assert_eq!(run.history.last().map(|row| row.iteration), Some(1000));
    assert_eq!(
        run.coefficients.inertias[0],
        read("functions.csv", "mass_kg")
    );
    let truth = run.truth.as_ref().expect("the truth is known");
    assert_eq!(truth.inertias[0], read("functions.csv", "true_mass_kg"));
    assert_eq!(
        run.trajectory.column("y_m"),
        Some(read("trajectory.csv", "y_m"))
    );
    assert_eq!(run.system.grid.times(), read("trajectory.csv", "t_s"));
    assert!(
        run.band("mass").is_none(),
        "of 6000 values no bands are computed"
    );
}

#[test]
fn bands() {
    let bench = Workbench::with_shipped_models();
    bench.run_to(
        0,
        &[
            "fit",
            "models/linear-mass.yaml",
            "--out",
            "run",
            "--no-report",
        ],
    );
    let run = Run::open(bench.path("run")).expect("a run");
    let [low, high] = run.band("mass").expect("few values");
    let within = |i: usize| {
        low[i] <= run.coefficients.inertias[0][i] && run.coefficients.inertias[0][i] <= high[i]
    };
    assert!((0..run.coefficients.inertias[0].len()).all(within));
    assert!(run.band("k/m").is_some() && run.band("friction").is_none());
}

/// Missing or damaged contents are reported with the file; no content of a file causes a panic.
#[test]
fn damaged_runs() {
    let bench = Workbench::with_small_model();
    bench.run_to(0, &["fit", "model.yaml", "--out", "run", "--no-report"]);
    let folder = bench.path("run");
    let refused = || Run::open(&folder).expect_err("damaged").to_string();
    for name in [
        "result.json",
        "history.csv",
        "functions.csv",
        "trajectory.csv",
    ] {
        let path = folder.join(name);
        let whole = std::fs::read(&path).expect("a file");
        std::fs::remove_file(&path).expect("a file");
        assert!(
            refused().contains(&format!("{name}: no such file")),
            "{}",
            refused()
        );
        for share in 0..20 {
            std::fs::write(&path, &whole[..whole.len() * share / 20]).expect("room");
            assert!(refused().contains(name), "{}", refused());
        }
        let mut state = 7_u64;
        for _ in 0..300 {
            let mut spoiled = whole.clone();
            for _ in 0..3 {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                let position = (state >> 33) as usize % spoiled.len();
                spoiled[position] = (state >> 20) as u8;
            }
            std::fs::write(&path, &spoiled).expect("room");
            // A changed digit may remain undetected: only a panic is a failure.
            let _ = Run::open(&folder);
        }
        std::fs::write(&path, &whole).expect("room");
    }
    let history = bench.read("run/history.csv");
    let (rest, _) = history.trim_end().rsplit_once('\n').expect("rows");
    bench.write("run/history.csv", &format!("{rest}\n"));
    insta::assert_snapshot!(refused().replace(&folder.display().to_string(), "run"), @"
    run/history.csv: the table does not fit the result
      found: 4 rows of attempt 0
      expected: 5, one per iteration
    ");
    bench.write("run/history.csv", &history);
    let functions = bench.read("run/functions.csv");
    let spoil = |from: &str, to: &str| {
        assert!(functions.contains(from));
        bench.write("run/functions.csv", &functions.replacen(from, to, 1));
        refused().replace(&folder.display().to_string(), "run")
    };
    let renamed = spoil("mass_kg", "mass_g");
    let text = spoil("\n0,", "\nx,");
    let field = spoil("\n0,", "\n0,,");
    insta::assert_snapshot!([text, field].join("\n"), @"
    run/functions.csv:2: column `t_s`: not a number
      found: `x`
      expected: a number, or an empty field
    run/functions.csv:2: wrong number of fields in this row
      found: 9
      expected: 8
    ");
    assert!(
        renamed.starts_with("run/functions.csv: no column `mass_kg`"),
        "{renamed}"
    );
    assert!(renamed.contains("did you mean `mass_g`"), "{renamed}");
}
