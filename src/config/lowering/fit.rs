//! Settings of a fit from the key `fit`: method, stopping tests, start strategy; refuses combinations that a method
//! does not support.

use crate::config::ModelFile;
use crate::error::InputError;
use kmcfit_core::model::{FitMethod, StopSpec};
use kmcfit_core::objective::GradientKind;
use kmcfit_core::problem::Problem;
use kmcfit_core::solvers::{FitSettings, Initial, QpSolver, Solver, Stopping};
use std::time::Duration;

/// Pairs kept by L-BFGS: on the paper's problem 20 take 13 % fewer iterations than 10, 40 only
/// 8 % fewer still.
pub(super) const DEFAULT_MEMORY: usize = 20;

pub(super) fn build(
    file: &ModelFile,
    problem: &Problem,
    solver: Solver,
    searches: bool,
) -> Result<FitSettings, InputError> {
    let spec = file.spec.fit.as_ref();
    let gradient = gradient(file, problem)?;
    takes_steps(file, solver)?;
    can_constrain(file, problem, solver)?;
    can_regularise(file, problem, searches, solver)?;
    let initial = spec.and_then(|f| f.initial);
    let stopping = match spec.and_then(|f| f.stop.as_ref()) {
        Some(stop) => stopping(file, stop)?,
        None => Stopping::default(),
    };
    Ok(FitSettings {
        solver,
        initial: initial.unwrap_or(Initial::Functions),
        gradient,
        stopping,
        qp: qp(file, solver)?,
        interrupt: None,
    })
}

/// The method of the model file, or the default.
fn method(file: &ModelFile) -> FitMethod {
    let method = file.spec.fit.as_ref().and_then(|f| f.method);
    method.unwrap_or(FitMethod::GaussNewton)
}

/// Refuses settings of steps for a method without steps.
fn takes_steps(file: &ModelFile, solver: Solver) -> Result<(), InputError> {
    let Some(fit) = file.spec.fit.as_ref() else {
        return Ok(());
    };
    let given = [
        ("initial", fit.initial.is_some()),
        ("gradient", fit.gradient.is_some()),
        ("stop", fit.stop.is_some()),
    ];
    match given.iter().find(|(_, given)| *given) {
        Some((key, _)) if solver == Solver::EquationError => Err(file
            .error_at(
                &format!("fit.{key}"),
                "the method `equation-error` solves one convex problem and takes no steps",
            )
            .expected(format!("no `{key}`, or another method"))),
        _ => Ok(()),
    }
}

pub(super) fn solver(file: &ModelFile) -> Result<Solver, InputError> {
    let memory = memory(file)?;
    let solver = match method(file) {
        FitMethod::SteepestDescent => Solver::SteepestDescent,
        FitMethod::Lbfgs => {
            return Ok(Solver::Lbfgs {
                memory: memory.unwrap_or(DEFAULT_MEMORY),
            });
        }
        FitMethod::ProjectedGradient => Solver::ProjectedGradient,
        FitMethod::GaussNewton => Solver::GaussNewton,
        FitMethod::EquationError => Solver::EquationError,
    };
    match memory {
        None => Ok(solver),
        Some(_) => Err(file
            .error_at(
                "fit.memory",
                format!("the method `{}` has no memory", solver.name()),
            )
            .expected("no `memory`, or `method: lbfgs`")),
    }
}

/// Refuses constraints for a method that does not support them.
fn can_constrain(file: &ModelFile, problem: &Problem, solver: Solver) -> Result<(), InputError> {
    let constraints = &problem.constraints;
    let rows = constraints.groups.iter().map(|group| &group.name);
    let cones = constraints.cones.iter().map(|group| &group.name);
    match (solver, rows.chain(cones).next()) {
        (Solver::SteepestDescent | Solver::Lbfgs { .. }, Some(name)) => Err(file
            .error_at("fit.method", "this method does not support constraints")
            .found(format!("`{}` with `{name}`", solver.name()))
            .expected("`gauss-newton` or `projected-gradient`")),
        _ => Ok(()),
    }
}

/// Refuses total variation and a rule for the weight for methods that support neither.
fn can_regularise(
    file: &ModelFile,
    problem: &Problem,
    searches: bool,
    solver: Solver,
) -> Result<(), InputError> {
    let asked = match (problem.variations.is_empty(), searches) {
        (false, _) => "total variation",
        (true, true) => "a rule for the weight",
        (true, false) => return Ok(()),
    };
    match solver {
        Solver::GaussNewton | Solver::EquationError => Ok(()),
        _ => Err(file
            .error_at(
                "fit.method",
                format!("this method does not support {asked}"),
            )
            .found(format!("`{}`", solver.name()))
            .expected("`gauss-newton`, which does")),
    }
}

fn gradient(file: &ModelFile, problem: &Problem) -> Result<GradientKind, InputError> {
    let asked = file.spec.fit.as_ref().and_then(|f| f.gradient);
    let has_samples = problem.experiments.iter().any(|e| !e.channels.is_empty());
    if asked == Some(GradientKind::Continuous) && has_samples && !problem.supports_continuous() {
        return Err(file
            .error_at(
                "fit.gradient",
                "the continuous adjoint needs the integral cost with a sample at every node",
            )
            .found("`continuous` with a sigma or with fewer samples than nodes")
            .expected("`discrete`"));
    }
    Ok(asked.unwrap_or(GradientKind::Discrete))
}

/// The solver of quadratic programs; refused for methods without them.
fn qp(file: &ModelFile, solver: Solver) -> Result<QpSolver, InputError> {
    let Some(qp) = file.spec.fit.as_ref().and_then(|f| f.qp) else {
        return Ok(QpSolver::Auto);
    };
    match solver {
        Solver::GaussNewton | Solver::ProjectedGradient => Ok(qp),
        _ => Err(file
            .error_at(
                "fit.qp",
                "this method solves no quadratic programs for its steps",
            )
            .found(format!("`{}`", solver.name()))
            .expected("no `qp`, or `method: gauss-newton` or `projected-gradient`")),
    }
}

fn memory(file: &ModelFile) -> Result<Option<usize>, InputError> {
    match file.spec.fit.as_ref().and_then(|f| f.memory.as_ref()) {
        Some(memory) if *memory == 0 => Err(file
            .error_at("fit.memory", "L-BFGS needs a memory")
            .found(0)
            .expected("1 or more pairs")),
        memory => Ok(memory.copied()),
    }
}

fn stopping(file: &ModelFile, stop: &StopSpec) -> Result<Stopping, InputError> {
    let positive = |key: &str, value: &Option<f64>| match value {
        Some(value) if *value <= 0.0 => Err(file
            .error_at(&format!("fit.stop.{key}"), "this limit must be positive")
            .found(value)
            .expected(match key {
                "seconds" => "a number greater than 0, in s",
                _ => "a number greater than 0",
            })),
        value => Ok(*value),
    };
    let seconds = positive("seconds", &stop.seconds)?;
    let given = Stopping {
        iterations: stop.iterations.as_ref().map_or(1000, |n| *n as u64),
        cost_ratio: positive("cost_ratio", &stop.cost_ratio)?,
        gradient_ratio: positive("gradient_ratio", &stop.gradient_ratio)?,
        tolerance: positive("tolerance", &stop.tolerance)?,
        step: positive("step", &stop.step)?,
        // A limit beyond the range of Duration has no effect.
        limit: seconds.and_then(|s| Duration::try_from_secs_f64(s).ok()),
        program_iterations: Stopping::default().program_iterations,
    };
    // A given number of iterations without a tolerance runs exactly that many.
    let tolerance = match (given.has_test(), &stop.iterations) {
        (false, None) => Stopping::default().tolerance,
        _ => given.tolerance,
    };
    Ok(Stopping { tolerance, ..given })
}
