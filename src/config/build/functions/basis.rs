//! From `basis`, `knots` and `degree` to a basis that the grid can tell apart.

use crate::config::ModelFile;
use crate::config::scalar::{Count, Knots, Number};
use crate::config::spec::{Basis as Kind, FunctionSpec};
use crate::digits::clock;
use crate::error::InputError;
use kmcfit_core::internals::functions::basis::uniform_knots;
use kmcfit_core::internals::functions::{Basis, Design, Gram};
use kmcfit_core::internals::system::Grid;
use kmcfit_core::internals::system::quadrature::trapezoid_weights;

/// How near the first and last knot must be to the ends of the record, in steps.
const SAME_TIME: f64 = 1e-6;

/// The key that a kind of basis has besides its name.
fn own_key(kind: Kind) -> Option<&'static str> {
    match kind {
        Kind::Nodal | Kind::Constant => None,
        Kind::Polynomial => Some("degree"),
        Kind::PiecewiseConstant | Kind::PiecewiseLinear | Kind::BSpline => Some("knots"),
    }
}

/// Refuses `knots` and `degree` where the basis does not use them.
pub(super) fn keys_fit(file: &ModelFile, key: &str, spec: &FunctionSpec) -> Result<(), InputError> {
    let given = [
        ("knots", spec.knots.is_some()),
        ("degree", spec.degree.is_some()),
    ];
    let own = spec.basis.and_then(own_key);
    let Some((unused, _)) = given.iter().find(|(k, given)| *given && own != Some(*k)) else {
        return Ok(());
    };
    let at = format!("{key}.{unused}");
    let error = match spec.basis {
        Some(kind) => file.error_at(&at, format!("the basis `{kind}` does not use this key")),
        None => file.error_at(&at, "this key needs a basis that uses it"),
    };
    Err(error
        .found(format!("`{unused}`"))
        .expected(match (spec.basis, own) {
            (_, Some(own)) => format!("`{own}`"),
            (Some(_), None) => "neither `knots` nor `degree`".to_owned(),
            (None, None) => "`basis` beside it".to_owned(),
        })
        .hint(match *unused {
            "knots" => "piecewise-constant, piecewise-linear and b-spline have knots",
            _ => "polynomial has a degree",
        }))
}

/// The basis of a function to be fitted.
pub(super) fn build(
    file: &ModelFile,
    grid: &Grid,
    key: &str,
    spec: &FunctionSpec,
    kind: Kind,
) -> Result<Basis, InputError> {
    let missing = |what: &str, expected: &str| {
        file.error_at(key, format!("the basis `{kind}` needs {what}"))
            .expected(expected)
    };
    let knots = || {
        let given = spec.knots.as_ref().ok_or_else(|| {
            missing(
                "knots",
                "`knots`: an integer (so many, equally spaced), or a list of times in s",
            )
        })?;
        knots(file, grid, &format!("{key}.knots"), given, kind)
    };
    let basis = match kind {
        Kind::Nodal => Basis::Nodal,
        Kind::Constant => Basis::Constant,
        Kind::PiecewiseConstant => Basis::PiecewiseConstant { knots: knots()? },
        Kind::PiecewiseLinear => Basis::PiecewiseLinear { knots: knots()? },
        Kind::BSpline => Basis::BSpline { knots: knots()? },
        Kind::Polynomial => {
            let given = spec.degree.ok_or_else(|| {
                missing("a degree", "`degree`: an integer, for instance `degree: 1`")
            })?;
            degree(file, grid, &format!("{key}.degree"), given)?
        }
    };
    told_apart(file, grid, key, &basis)?;
    Ok(basis)
}

fn degree(file: &ModelFile, grid: &Grid, key: &str, given: Count) -> Result<Basis, InputError> {
    let nodes = grid.nodes();
    let most = Basis::highest_degree(grid);
    if given.0 > most {
        return Err(file
            .error_at(key, "the degree is too high for the grid")
            .found(format!("{} on {nodes} nodes", given.0))
            .expected(format!("at most {most}")));
    }
    Ok(Basis::Polynomial { degree: given.0 })
}

/// The times of the knots, the ends exactly those of the record.
fn knots(
    file: &ModelFile,
    grid: &Grid,
    key: &str,
    given: &Knots,
    kind: Kind,
) -> Result<Vec<f64>, InputError> {
    let count = match given {
        Knots::Count(count) => count.0,
        Knots::Times(times) => times.len(),
    };
    if count < 2 {
        return Err(file
            .error_at(key, "there are fewer than two knots")
            .found(count)
            .expected("2 or more, both ends of the record included"));
    }
    let most = match kind {
        Kind::PiecewiseConstant => grid.nodes() + 1,
        Kind::BSpline => grid.nodes().saturating_sub(2),
        _ => grid.nodes(),
    };
    if count > most {
        return Err(file
            .error_at(key, "there are more parameters than nodes")
            .found(format!("{count} knots on {} nodes", grid.nodes()))
            .expected(format!("at most {most} knots")));
    }
    match given {
        Knots::Count(_) => Ok(uniform_knots(grid, count)),
        Knots::Times(times) => listed(file, grid, key, times),
    }
}

fn listed(
    file: &ModelFile,
    grid: &Grid,
    key: &str,
    given: &[Number],
) -> Result<Vec<f64>, InputError> {
    let (start, end) = (grid.start(), grid.time(grid.nodes() - 1));
    let slack = SAME_TIME * grid.step();
    let at = |i: usize, problem: &str| {
        file.error_at(&format!("{key}[{i}]"), problem)
            .found(given[i].0)
    };
    let mut times: Vec<f64> = given.iter().map(|t| t.0).collect();
    for (i, &t) in times.iter().enumerate() {
        if t < start - slack || t > end + slack {
            return Err(at(i, "this knot lies outside the record").expected(format!(
                "a time from {start} s to {} s",
                clock(end, grid.step())
            )));
        }
        if i > 0 && t <= times[i - 1] {
            let before = times[i - 1];
            return Err(at(i, "the knots do not increase")
                .found(format!("{t} after {before}"))
                .expected(format!("a time greater than {before} s")));
        }
    }
    let last = times.len() - 1;
    for (i, bound, problem) in [
        (0, start, "the first knot is not at the start of the record"),
        (last, end, "the last knot is not at the end of the record"),
    ] {
        if (times[i] - bound).abs() > slack {
            return Err(at(i, problem)
                .expected(format!("{bound} s"))
                .hint("a list of knots includes both ends of the record"));
        }
        times[i] = bound;
    }
    Ok(times)
}

/// Refuses a basis with a function that no node sees, or with dependent functions.
fn told_apart(file: &ModelFile, grid: &Grid, key: &str, basis: &Basis) -> Result<(), InputError> {
    let design = basis.design(grid);
    let Design::Sparse(rows) = &design else {
        return Ok(());
    };
    let mut seen = vec![false; rows.width()];
    for i in 0..rows.len() {
        rows.row(i).for_each(|(j, _)| seen[j] = true);
    }
    if let Some(unseen) = seen.iter().position(|seen| !seen) {
        // Function j is not zero between the knots j - reach and j + 1.
        let knots = basis.knot_times(grid);
        let reach = (seen.len() + 1).saturating_sub(knots.len());
        let from = knots[unseen.saturating_sub(reach)];
        let to = knots[(unseen + 1).min(knots.len() - 1)];
        return Err(file
            .error_at(
                &format!("{key}.knots"),
                "the knots are closer than the nodes",
            )
            .found(format!(
                "no node for a parameter between {from} s and {to} s"
            ))
            .expected(format!(
                "knots further apart than the step of {} s",
                grid.step()
            )));
    }
    let weights = trapezoid_weights(grid.nodes(), grid.step());
    if Gram::new(&design, &weights).is_some() {
        return Ok(());
    }
    let (own, fewer) = match basis {
        Basis::Polynomial { .. } => ("degree", "a lower degree, or more nodes"),
        _ => ("knots", "fewer knots, or more nodes"),
    };
    let problem = "the nodes cannot tell the functions of this basis apart";
    Err(file
        .error_at(&format!("{key}.{own}"), problem)
        .found(format!(
            "{} parameters on {} nodes",
            seen.len(),
            grid.nodes()
        ))
        .expected(fewer))
}
