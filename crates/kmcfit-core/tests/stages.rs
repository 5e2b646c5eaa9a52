//! Random bounded programs along time: the interior-point method on stages against Clarabel.

use kmcfit_core::internals::qp::{ConicStatus, ResponseVariables, StageLayout, Subproblem};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Programs in all, and the seed of the first; `KMCFIT_QP_SEED` gives others.
const PROGRAMS: u64 = 500;
/// Excess of the cost over that of the other solver, relative to the larger of the cost and that at zero.
const COST: f64 = 1e-9;
/// Distance of the minimisers in the norm of the Hessian, relative to the root of the same cost.
const DISTANCE: f64 = 1e-4;

/// One to three coefficients on a grid, one or two responses that they drive, and a constant; bounds that are all, partly or not
/// active, and weights over twelve decades.
fn program(random: &mut ChaCha8Rng) -> Subproblem {
    let nodes = random.random_range(4..30);
    let histories = random.random_range(1..4);
    let responses = random.random_range(1..3);
    let parameters = histories * nodes + 1;
    let constant = parameters - 1;
    let mut sub = Subproblem::new(parameters + 2 * responses * (nodes - 1));
    let response = |r: usize, node: usize, q: usize| match node {
        0 => None,
        _ => Some(parameters + 2 * (r * (nodes - 1) + node - 1) + q),
    };
    let mut layout = StageLayout {
        nodes,
        constants: vec![constant],
        ..StageLayout::default()
    };
    let mut number = |low: f64, high: f64| random.random_range(low..high);
    for r in 0..responses {
        layout.responses.push(ResponseVariables {
            first: parameters + 2 * r * (nodes - 1),
            nodes,
            initial: [None, None],
        });
        for node in 1..nodes {
            for q in 0..2 {
                let mut entries = vec![(response(r, node, q).expect("a later node"), 1.0)];
                for s in 0..2 {
                    entries.extend(response(r, node - 1, s).map(|j| (j, number(-0.6, 0.6))));
                }
                for f in 0..histories {
                    entries.push((f * nodes + node - 1, number(-0.3, 0.3)));
                    entries.push((f * nodes + node, number(-0.3, 0.3)));
                }
                entries.push((constant, number(-0.1, 0.1)));
                sub.equalities.push(entries, number(-0.01, 0.01));
            }
            let measured = response(r, node, 0).expect("a later node");
            sub.residuals.push([(measured, 3.0)], number(-3.0, 3.0));
        }
    }
    for f in 0..histories {
        layout.histories.push(f * nodes..(f + 1) * nodes);
        let root = 10f64.powf(number(-3.0, 3.0));
        let second = number(0.0, 1.0) < 0.5;
        for i in 0..nodes - if second { 2 } else { 1 } {
            let j = f * nodes + i;
            let row = match second {
                true => vec![(j, root), (j + 1, -2.0 * root), (j + 2, root)],
                false => vec![(j, -root), (j + 1, root)],
            };
            sub.residuals.push(row, root * number(-0.1, 0.1));
        }
        let width = 10f64.powf(number(-2.0, 2.0));
        for i in 0..nodes {
            sub.bound([(f * nodes + i, 1.0)], -width, f64::INFINITY);
            if second {
                sub.bound([(f * nodes + i, 2.0)], f64::NEG_INFINITY, width);
            }
        }
        if number(0.0, 1.0) < 0.3 {
            for i in 0..nodes - 1 {
                let j = f * nodes + i;
                sub.bound([(j, -1.0), (j + 1, 1.0)], f64::NEG_INFINITY, 0.1 * width);
            }
        }
    }
    if number(0.0, 1.0) < 0.5 {
        sub.equalities.push([(0, 1.0)], 0.0);
    }
    let near = 10f64.powf(number(-6.0, 0.0));
    sub.proximal[..parameters].fill(near);
    sub.layout = Some(layout);
    sub
}

#[test]
fn bounded_programs_have_the_minimum_that_clarabel_finds() {
    let seed = std::env::var("KMCFIT_QP_SEED");
    let seed: u64 = seed.map_or(1, |seed| seed.parse().expect("a whole number"));
    let mut bounded = 0;
    for case in 0..PROGRAMS {
        let mut random = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(1_000_003) + case);
        let sub = program(&mut random);
        let name = format!("seed {seed}, program {case}");
        let step = sub.step_on_stages(Subproblem::ITERATIONS);
        let (step, excess) = step.unwrap_or_else(|| panic!("{name}: not solved on stages"));
        let on_stages = sub.solve();
        let other = Subproblem {
            layout: None,
            ..sub.clone()
        };
        let reference = other.solve();
        assert_eq!(on_stages.status, ConicStatus::Solved, "{name}");
        if reference.status != ConicStatus::Solved {
            continue;
        }
        let [found, least, rough] = [&on_stages, &reference, &step].map(|s| sub.value(&s.z));
        let scale = found.max(sub.value(&vec![0.0; sub.variables]));
        assert!(
            found - least <= COST * scale,
            "{name}: {found} above {least}"
        );
        assert!(
            rough - least <= excess + COST * scale,
            "{name}: a step {rough} above {least}, at most {excess} above it by its own account"
        );
        assert!(sub.holds(&on_stages.z, 1e-9), "{name}");
        let mut difference = Subproblem {
            constant: 0.0,
            ..sub.clone()
        };
        difference.residuals.clear_right();
        let z: Vec<f64> = (on_stages.z.iter().zip(&reference.z))
            .map(|(a, b)| a - b)
            .collect();
        let distance = (difference.value(&z) / scale).sqrt();
        assert!(distance <= DISTANCE, "{name}: minimisers {distance} apart");
        bounded += usize::from(on_stages.multipliers.iter().any(|m| m.abs() > 1e-6));
    }
    // The other programs have their minimum inside.
    assert!(bounded > 300, "{bounded} bounded programs");
}
