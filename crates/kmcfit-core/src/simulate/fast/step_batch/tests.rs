use super::*;
use crate::simulate::{Trajectory, reference};
use crate::system::quadrature::trapezoid;
use crate::system::{Grid, Method, NodalCoefficients, System, Term};

/// Parts of one and of many nodes, with short and empty last parts.
const NODES: [usize; 9] = [3, 4, 8, 9, 17, 41, 64, 65, 241];

/// Mass, damping and stiffness, and the search direction.
fn functions(nodes: usize) -> [[Vec<f64>; 3]; 2] {
    let of = |f: fn(f64) -> f64| -> Vec<f64> {
        (0..nodes)
            .map(|i| f(8.0 * i as f64 / nodes as f64))
            .collect()
    };
    [
        [
            of(|t| 2.0 + 0.3 * t.sin()),
            of(|t| 0.4 - 0.05 * t),
            of(|t| 3.0 + t.cos()),
        ],
        [
            of(|t| 1.0 + 0.1 * t),
            of(|t| 0.5 - 0.1 * t),
            of(|t| t.sin() - 0.5),
        ],
    ]
}

fn nodal_at(ray: &SearchRay, length: f64) -> NodalCoefficients {
    let [mass, damping, stiffness] = [0, 1, 2].map(|f| {
        let pairs = ray.functions[f].iter().zip(ray.direction[f]);
        pairs.map(|(p, g)| p - length * g).collect()
    });
    NodalCoefficients {
        mass,
        coefficients: vec![damping, stiffness],
    }
}

/// One trial by the forward solve and the trapezoid rule: response and cost.
fn by_itself(ray: &SearchRay, length: f64) -> Option<(Trajectory, f64)> {
    let nodes = ray.samples.len();
    let system = System {
        grid: Grid::new(0.0, ray.step * (nodes - 1) as f64, nodes).unwrap(),
        method: Method::Midpoint,
        terms: vec![Term::Damping, Term::Stiffness],
    };
    let response = reference::forward(&system, &nodal_at(ray, length), ray.initial, None).ok()?;
    let pairs = response.displacement.iter().zip(ray.samples);
    let squares: Vec<f64> = pairs.map(|(y, o)| (y - o) * (y - o)).collect();
    let cost = trapezoid(&squares, ray.step);
    Some((response, cost))
}

fn ray<'a>(
    functions: &'a [Vec<f64>; 3],
    direction: &'a [Vec<f64>; 3],
    samples: &'a [f64],
) -> SearchRay<'a> {
    SearchRay {
        functions: functions.each_ref().map(Vec::as_slice),
        direction: direction.each_ref().map(Vec::as_slice),
        initial: State {
            displacement: 1.2,
            velocity: -0.7,
        },
        samples,
        step: 0.125,
    }
}

#[test]
fn every_trial_agrees_with_its_forward_solve() {
    NODES.into_iter().for_each(every_trial);
}

fn every_trial(nodes: usize) {
    let [functions, direction] = functions(nodes);
    let samples: Vec<f64> = (0..nodes).map(|i| (0.3 * i as f64).cos()).collect();
    let ray = ray(&functions, &direction, &samples);
    // One lane, part of a row, whole rows, and half a row with one, two and three rows; the two longest steps leave no mass.
    for count in [1, 7, 8, 19, 28, 32, 44, 50, 52] {
        let lengths: Vec<f64> = (1..=count).map(|i| 3.0 / i as f64).collect();
        let layout = LaneLayout::new(ray, &lengths);
        // Rows of one thread and of another.
        let (rows, mut trials) = (layout.rows(), [StepBatch::default(), StepBatch::default()]);
        trials[0].run(ray, &layout, 0..rows.div_ceil(2));
        trials[1].run(ray, &layout, rows.div_ceil(2)..rows);
        let found = trials.each_ref().map(StepBatch::costs).concat();
        let lowest = layout.lowest(&found);
        let alone: Vec<_> = lengths.iter().map(|a| by_itself(&ray, *a)).collect();
        let costs: Vec<f64> = (alone.iter())
            .map(|found| found.as_ref().map_or(f64::INFINITY, |(_, cost)| *cost))
            .collect();
        let best = (0..count).filter(|i| costs[*i].is_finite());
        let best = best.min_by(|a, b| costs[*a].total_cmp(&costs[*b]));
        assert_eq!(best.is_some(), !lowest.is_empty());
        assert!(
            best.is_none_or(|best| lowest.contains(&best)),
            "of {count}: {costs:?}"
        );
        assert!(lowest.len() <= 1 || nodes < 9, "{lowest:?} of {count}");
        for (which, cost) in costs
            .iter()
            .enumerate()
            .filter(|(_, cost)| cost.is_finite())
        {
            let (row, lane) = layout.place(which);
            let error = ray.step * found[row][lane] / cost - 1.0;
            assert!(error.abs() < 1e-12, "trial {which} of {count}: {error:e}");
        }
        for (which, found) in alone.into_iter().enumerate() {
            let Some((response, _)) = found else { continue };
            let mut again = Trajectory::zeros(nodes);
            let nodal = nodal_at(&ray, lengths[which]);
            let place = layout.place(which);
            let states = trials.iter().find_map(|trials| trials.states(place));
            let mut states = states.expect("states of every trial");
            let is_whole = reconstruct(&nodal, ray.initial, states, ray.step, &mut again);
            assert!(is_whole && again == response, "trial {which} of {count}");
            // A change of the last bit in any part is detected.
            let parts = nodes.div_ceil(part(nodes));
            let state = &mut states[which % 2][which % parts];
            *state = state.next_up();
            assert!(
                !reconstruct(&nodal, ray.initial, states, ray.step, &mut again),
                "trial {which} of {count}"
            );
        }
    }
}

/// All trials with nearly equal costs are candidates, whichever is lower in the last digits.
#[test]
fn trials_of_nearly_equal_cost_are_all_candidates() {
    let [functions, direction] = functions(41);
    let samples = [0.3; 41];
    let ray = ray(&functions, &direction, &samples);
    let layout = LaneLayout::new(ray, &[0.5, 0.4, 0.3, 0.2, 0.1]);
    // Costs within the margin, and beyond it.
    let mut costs = [1.0; LANES];
    (costs[1], costs[2], costs[3]) = (0.5, 0.5 * (1.0 + 1e-12), 0.5 * (1.0 + 1e-9));
    assert_eq!(layout.lowest(&[costs]), [1, 2]);
    (costs[0], costs[1]) = (f64::NAN, f64::INFINITY);
    assert_eq!(layout.lowest(&[costs]), [2]);
}
