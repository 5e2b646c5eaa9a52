//! Identifiability of sensor gains and offsets: rejection of combinations that no data can determine.

use super::BuildError;
use crate::functions::CoefficientKind;
use crate::problem::Problem;
use crate::record::{Channel, ChannelKind, Experiment};
use crate::structure::Law;

/// Error for gains that cannot be estimated. In a linear system, a free response and its initial state, or a forced response
/// and the inverse scale of mass, damping and stiffness, can be multiplied by a factor that the gain divides.
pub(super) fn check(problem: &Problem) -> Result<(), BuildError> {
    let scalars = problem.functions.scalars();
    let open = |index: Option<usize>| index.is_some_and(|i| scalars[i].prior.is_none());
    let terms = problem.system.laws();
    // With an estimated stiffness a shifted quadratic spring is another quadratic spring.
    let mut functions = problem.functions.iter();
    let has_stiffness =
        functions.any(|f| f.quantity == CoefficientKind::STIFFNESS && f.parameters() > 0);
    let shift_is_free = |t: &Law| match t {
        Law::QuadraticStiffness => has_stiffness,
        Law::Offset => true,
        term => term.is_linear(),
    };
    if terms.iter().all(shift_is_free) {
        check_offsets(problem, &open)?;
    }
    if !terms.iter().all(|term| term.is_linear()) {
        return Ok(());
    }
    let open_scale = |e: &Experiment| gains_open(e, &open) && starts_open(e, &open);
    let free_and_open = |e: &Experiment| e.is_free() && open_scale(e);
    if let Some(position) = problem.experiments.iter().position(free_and_open) {
        let name = &problem.experiments[position].name;
        let problem = format!(
            "the gain and the initial state of {name} cannot both be estimated: only their product is \
             identifiable"
        );
        return Err(BuildError::new("experiments", problem)
            .found(format!(
                "no known gain, state or prior in record {}",
                position + 1
            ))
            .expected("a number for one of them, or a `prior`"));
    }
    let mut forced = problem.experiments.iter().filter(|e| !e.is_free());
    let by_force = |e: &Experiment| e.excitation.as_ref().is_some_and(|x| x.frames.is_empty());
    let all = forced.clone().count() > 0 && forced.all(|e| by_force(e) && open_scale(e));
    match all && scale_is_open(problem) {
        true => Err(BuildError::new(
            "experiments",
            "the gains and the scale of mass, damping and stiffness cannot both be estimated: only their ratio \
             is identifiable",
        )
        .found("no known gain, no fixed function and no value that determines the scale")
        .expected(
            "a known gain or a `prior` in one forced experiment, a fixed function, or a constraint such as {function: mass, \
             mean: 1.0}",
        )),
        false => Ok(()),
    }
}

fn gains_open(e: &Experiment, open: &dyn Fn(Option<usize>) -> bool) -> bool {
    let gain = |c: &Channel| {
        // Added base motion has a known scale.
        open(c.sensor().gain.index()) && (0..c.len()).all(|i| c.base_at(i) == 0.0)
    };
    !e.channels.is_empty() && e.channels.iter().all(gain)
}

fn starts_open(e: &Experiment, open: &dyn Fn(Option<usize>) -> bool) -> bool {
    let mut components = e.initial_parameters.iter().zip(e.initial.components());
    components.all(|(estimated, known)| match estimated {
        Some(index) => open(Some(*index)),
        None => *known == 0.0,
    })
}

/// True if neither a fixed function nor an equality determines the common scale of the functions.
fn scale_is_open(problem: &Problem) -> bool {
    let held = problem.constraints.groups.iter().any(|group| {
        (0..group.rows.len()).any(|r| {
            let [low, high] = group.bounds(r);
            low == high && low != 0.0
        })
    });
    let mut functions = problem.functions.iter();
    !held && functions.all(|f| f.prior.is_none() && f.offset.iter().all(|p| *p == 0.0))
}

/// Error for a static force together with unknown sensor offsets: a response shifted by `d`, a sensor offset lower by `d` and
/// a force larger by `k d` give the same samples; with a quadratic stiffness `k2` the stiffness then differs by `2 k2 d`.
fn check_offsets(
    problem: &Problem,
    open: &dyn Fn(Option<usize>) -> bool,
) -> Result<(), BuildError> {
    let mut functions = problem.functions.iter();
    let estimated =
        functions.any(|f| f.quantity == CoefficientKind::STATIC_FORCE && f.parameters() > 0);
    let shifted = |e: &Experiment| {
        let sees =
            |c: &Channel| c.kind() != ChannelKind::Displacement || open(c.sensor().offset.index());
        open(e.initial_parameters[0]) && e.channels.iter().all(sees)
    };
    if !(estimated && problem.experiments.iter().all(shifted)) {
        return Ok(());
    }
    let problem = "a static force and the offsets of the sensors cannot both be estimated: only their sum is identifiable";
    Err(BuildError::new("functions.static_force", problem)
        .found("no known offset, initial displacement or prior")
        .expected("a number for one of them, or a `prior`"))
}
