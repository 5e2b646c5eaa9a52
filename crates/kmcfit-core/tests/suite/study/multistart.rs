use super::problems::{Record, bound, constants, nodal, problem, rest, samples, system};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::Weighting;
use kmcfit_core::study::{Multistart, Ranges, multistart};

/// One sample per second of an undamped response from rest, `cos(w n)`: the frequencies
/// `2 pi j +- w` give the same samples. k from 1 to 60, w = 1.5: 2.25, 22.9, 60.6 are exact.
pub fn aliased(noise: f64) -> Problem {
    let system = system(6.0, 601);
    assert_eq!(rest().velocity(0), 0.0);
    let values = samples(&system, &nodal(601, [1.0, 0.0, 2.25]), None, 100, noise, 1);
    let list = constants(601, [None, None, Some(2.0)], [1.0, 0.0, 0.0]);
    let record = Record {
        weighting: Weighting::Sigma(0.05),
        ..Record::of(values, 100)
    };
    let mut problem = problem(system, list, Vec::new(), record);
    bound(&mut problem, "stiffness from 1 to 65", 0, [1.0, 65.0]);
    problem
}

/// Local minima of the cost over the range, its ends included, by a fine scan.
pub fn minima(problem: &Problem) -> Vec<f64> {
    let count = 6400;
    let k = |i: usize| 1.0 + 64.0 * i as f64 / count as f64;
    let cost: Vec<f64> = (0..=count)
        .map(|i| problem.evaluate(&[k(i)]).unwrap().cost)
        .collect();
    let low = |i: usize| {
        let left = i == 0 || cost[i] < cost[i - 1];
        let right = i == count || cost[i] < cost[i + 1];
        left && right
    };
    (0..=count).filter(|i| low(*i)).map(k).collect()
}

fn how(threads: usize) -> Multistart {
    Multistart {
        ranges: Ranges::of_bounds(&aliased(0.0)).unwrap(),
        starts: 80,
        seed: 4,
        threads,
        settings: crate::common::synthetic::settings(),
    }
}

#[test]
fn the_aliases_of_a_period_are_found_and_counted() {
    let problem = aliased(0.0);
    let expected = minima(&problem);
    let found = multistart(&problem, &how(2));
    let clusters = found.clusters(&problem, 1e-2);
    let mut k: Vec<f64> = clusters
        .iter()
        .map(|c| found.runs[c.members[0]].found.as_ref().unwrap().parameters[0])
        .collect();
    println!(
        "costs {:?}",
        clusters
            .iter()
            .map(|c| (c.cost, c.members.len()))
            .collect::<Vec<_>>()
    );
    k.sort_by(f64::total_cmp);
    println!("scan {expected:?}\nfits {k:?}");
    assert_eq!(k.len(), expected.len());
    // The scan's spacing is 0.01.
    assert!(
        k.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 0.011),
        "{k:?} {expected:?}"
    );
    // Three of them fit exactly: equal costs, distinct minima.
    let exact = clusters.iter().filter(|c| c.cost < 1e-9).count();
    assert_eq!(exact, 3);
    let costs = found.costs();
    assert!(costs.windows(2).all(|w| w[0] <= w[1]));
}

#[test]
fn the_threads_change_no_bit() {
    let problem = aliased(0.02);
    let [one, two] = [1, 2].map(|threads| multistart(&problem, &how(threads)));
    assert_eq!(one.order, two.order);
    let bits = |w: &kmcfit_core::study::Waterfall| -> Vec<u64> {
        w.runs
            .iter()
            .map(|r| r.found.as_ref().unwrap().parameters[0].to_bits())
            .collect()
    };
    assert_eq!(bits(&one), bits(&two));
}

/// Starts with a negative mass have no response: they are listed as failed, and the others are fitted.
#[test]
fn starts_that_cannot_be_simulated_are_listed_with_their_reason() {
    let system = system(6.0, 301);
    let values = samples(&system, &nodal(301, [1.0, 0.1, 2.0]), None, 5, 0.01, 1);
    let list = constants(301, [Some(1.0), Some(0.1), None], [0.0, 0.0, 2.0]);
    let problem = problem(system, list, Vec::new(), Record::of(values, 5));
    let how = Multistart {
        ranges: Ranges::Constants(vec![[-1.0, 2.0], [0.0, 0.5], [0.0, 0.0]]),
        starts: 12,
        ..how(2)
    };
    let found = multistart(&problem, &how);
    assert_eq!(found.runs.len() - found.order.len(), 4);
    let failed = found.runs.iter().find(|r| r.found.is_none()).unwrap();
    assert!(failed.reason.contains("mass"), "{}", failed.reason);
}
