//! What a candidate estimates.

use super::addition::Addition;
use super::penalised_misfit::Judged;
use crate::alternatives::RecordParameter;
use crate::functions::Ratio;
use crate::identifiability::Quantity;
use crate::problem::Problem;
use crate::signal::median;

/// The estimates of an addition to a problem, whose fit has the parameters `theta`; `held` are those that were searched.
pub(super) fn estimates(
    addition: Addition,
    problem: &Problem,
    theta: &[f64],
    judged: &Judged,
) -> Vec<Quantity> {
    let value = |i: usize| theta.get(i).copied().unwrap_or(f64::NAN);
    let of = |name: &str, unit: &str, value: f64, gradient: Vec<(usize, f64)>| Quantity {
        gradient,
        ..Quantity::new(name, unit, value)
    };
    let one = |name: &str, unit: &str, i: usize| of(name, unit, value(i), vec![(i, 1.0)]);
    let last = theta.len().saturating_sub(1);
    let quantities = match addition {
        Addition::Term(kind, _) => {
            let i = problem.functions.scalar_range().start;
            vec![one(kind.name(), kind.unit(), i)]
        }
        Addition::Variation {
            function, degree, ..
        } => {
            let own = problem.functions.get(function);
            let first = problem.functions.ranges()[function].start;
            let unit = own.quantity.unit();
            // Legendre polynomials are 1 at the end, and 1 or -1 at the beginning.
            let at = |sign: f64| {
                let terms = (0..=degree).map(|j| (first + j, sign.powi(j as i32)));
                let terms: Vec<(usize, f64)> = terms.collect();
                let sum = terms.iter().map(|(i, a)| a * value(*i)).sum::<f64>();
                (sum + own.fixed_at(0), terms)
            };
            let ends = [("at the beginning", -1.0), ("at the end", 1.0)];
            let ends = ends.map(|(name, sign)| {
                let (value, gradient) = at(sign);
                of(name, unit, value, gradient)
            });
            ends.into()
        }
        Addition::FinerBasis { .. }
        | Addition::CubicInputs
        | Addition::Disturbance { .. }
        | Addition::InputPulses { .. } => Vec::new(),
        Addition::Jump { function, time } => {
            let own = problem.functions.get(function);
            let first = problem.functions.ranges()[function].start;
            let [before, at, after] = [0, 1, 2].map(|i| value(first + i));
            let (h, step) = (problem.system.grid.step(), after - before);
            // time = middle + h/2 - h (at - before) / (after - before)
            let share = (at - before) / step;
            let slopes = [h * (1.0 - share) / step, -h / step, h * share / step];
            let slopes = slopes.into_iter().enumerate();
            let unit = own.quantity.unit();
            let slopes = slopes.map(|(j, a)| (first + j, a)).collect();
            let time = Quantity {
                // An acceleration sampled at the jump has one side of it, the node at the jump both.
                basis_error: 0.5 * h,
                ..of("time", "s", time, slopes)
            };
            vec![
                time,
                one("before", unit, first),
                one("after", unit, first + 2),
            ]
        }
        Addition::Record(parameter) => {
            let unit = match parameter {
                RecordParameter::Delay(_) => "s".to_owned(),
                RecordParameter::Rate(_) | RecordParameter::Gain(..) => String::new(),
                RecordParameter::Offset(e, c) => unit_of(problem, e, c),
                RecordParameter::Drift(e, c) => format!("{}/s", unit_of(problem, e, c)),
            };
            vec![one(parameter.name(), &unit, last)]
        }
        Addition::SensorCurve { .. } => {
            vec![one("square", "", last - 1), one("cube", "", last)]
        }
        Addition::Tone { .. } => {
            let [a, b] = [value(last - 1), value(last)];
            let size = a.hypot(b);
            vec![of(
                "amplitude",
                "",
                size,
                vec![(last - 1, a / size), (last, b / size)],
            )]
        }
        Addition::SecondMode { mode, .. } => {
            let [f, ratio] = mode;
            let mut modes = vec![
                of("frequency", "Hz", f, vec![(last - 1, f)]),
                of("damping ratio", "", ratio, vec![(last, ratio)]),
            ];
            let nodal = problem.functions.nodal(&theta[..problem.parameters()]);
            let own = [Ratio::NaturalFrequency, Ratio::DampingRatio];
            let own = own.map(|r| median(r.at_nodes(problem.system.laws(), &nodal)));
            let own = [
                ("own frequency", "Hz", own[0]),
                ("own damping ratio", "", own[1]),
            ];
            modes.extend(own.map(|(name, unit, value)| Quantity::new(name, unit, value)));
            modes
        }
    };
    // A rate of clocks is found by a search of its own.
    let rows = judged.covariance.nrows();
    let known = |quantity: Quantity| match quantity.gradient.iter().all(|(i, _)| *i < rows) {
        true => quantity.with_covariance(&judged.covariance, judged.degrees),
        false => quantity,
    };
    quantities.into_iter().map(known).collect()
}

fn unit_of(problem: &Problem, e: usize, c: usize) -> String {
    problem.experiments[e].channels[c].kind().unit().to_owned()
}
