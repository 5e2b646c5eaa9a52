mod common;
use kmcfit::constraints::RowGroup;
use kmcfit::functions::Penalty;
use kmcfit::objective::GradientKind;
use kmcfit::solvers::{FitSettings, Initial, Solver, Stopping, fit};
use nalgebra_sparse::{CooMatrix, CsrMatrix};

fn differences(n: usize, h: f64, order: usize) -> CsrMatrix<f64> {
    let mut coo = CooMatrix::new(n - order, n);
    for i in 0..n - order {
        if order == 1 {
            let s = (1.0 / h).sqrt();
            coo.push(i, i, -s);
            coo.push(i, i + 1, s);
        } else {
            let s = h.sqrt() / h / h;
            coo.push(i, i, s);
            coo.push(i, i + 1, -2.0 * s);
            coo.push(i, i + 2, s);
        }
    }
    CsrMatrix::from(&coo)
}

#[test]
fn smooth() {
    let sizes: Vec<usize> = std::env::var("NS")
        .unwrap_or("500,2000".into())
        .split(',')
        .map(|x| x.parse().unwrap())
        .collect();
    for n in sizes {
        let mut problem = common::paper_problem(n, [2.0, 1.0, 1.0]);
        let h = problem.oscillator.grid.step();
        let beta: f64 = std::env::var("BETA").unwrap_or("1".into()).parse().unwrap();
        if beta > 0.0 {
            problem.penalties = vec![
                Penalty::new(0, 2, beta, differences(n, h, 2)),
                Penalty::new(1, 1, beta, differences(n, h, 1)),
                Penalty::new(2, 1, beta, differences(n, h, 1)),
            ];
        }
        let mut group = RowGroup::new("k(0) = 1");
        group.push([(2 * n, 1.0)], [1.0, 1.0], [0.0, 0.0]);
        if std::env::var_os("NOK").is_none() {
            problem.constraints.groups.push(group);
        }
        let mut group = RowGroup::new("positive");
        if std::env::var_os("POS").is_some() {
            for i in 0..n {
                group.push([(i, 1.0)], [0.05, f64::INFINITY], [0.0, 0.0]);
                group.push([(n + i, 1.0)], [0.0, f64::INFINITY], [0.0, 0.0]);
                group.push([(2 * n + i, 1.0)], [0.0, f64::INFINITY], [0.0, 0.0]);
            }
            problem.constraints.groups.push(group);
        }
        let settings = FitSettings {
            solver: if std::env::var_os("PG").is_some() {
                Solver::ProjectedGradient
            } else {
                Solver::GaussNewton
            },
            initial: Initial::Functions,
            gradient: GradientKind::Discrete,
            stopping: Stopping {
                tolerance: Some(1e-9),
                ..Stopping::exactly(std::env::var("ITS").unwrap_or("60".into()).parse().unwrap())
            },
            interrupt: None,
        };
        let mut start = problem.functions.start();
        let clock = std::time::Instant::now();
        if std::env::var_os("EE").is_some() {
            start = kmcfit::solvers::equation_error(&problem, &start).unwrap();
            let d = problem.functions.device(&start);
            let e: Vec<f64> = d
                .functions()
                .zip(common::paper_device(n).functions())
                .map(|(a, b)| {
                    a.iter()
                        .zip(b)
                        .fold(0.0f64, |m, (a, b)| m.max((a - b).abs()))
                })
                .collect();
            println!("EE {:?} errs {e:?}", clock.elapsed());
        }
        let result = fit(&problem, &start, &settings, &mut |row| {
            println!(
                "  {} {:.4e} {:.3e} {:.1e}",
                row.iteration, row.cost, row.cost_ratio, row.relative_change
            )
        })
        .unwrap();
        let truth = common::paper_device(n);
        let errs: Vec<f64> = result
            .best
            .evaluation
            .device
            .functions()
            .zip(truth.functions())
            .map(|(a, b)| {
                a.iter()
                    .zip(b)
                    .fold(0.0f64, |m, (a, b)| m.max((a - b).abs()))
            })
            .collect();
        println!(
            "N {n} {:?} {:?} {:?} its {} errs {errs:?}",
            result.outcome,
            result.counts,
            result.elapsed,
            result.history.len()
        );
    }
}
