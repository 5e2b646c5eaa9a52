//! Automatic width of Coulomb friction: the first one, from the velocity of the records. A fit reduces it
//! ([`fit_on_reduced_widths`](kmcfit_core::internals::solvers::fit_on_reduced_widths)).

use super::experiments::RawRecord;
use super::functions;
use crate::config::ModelFile;
use crate::config::values::FrictionWidth;
use crate::error::InputError;
use kmcfit_core::internals::functions::CoefficientKind;
use kmcfit_core::internals::objective::state_scales;

/// First width relative to the root mean square of the velocity.
const SHARE: f64 = 0.02;

/// The first width (m/s) where the model states `width: auto`.
///
/// # Errors
/// For another function than friction, for an experiment that shares another width, and without a record.
pub(super) fn automatic_width(
    file: &ModelFile,
    records: &[Option<RawRecord>],
) -> Result<Option<f64>, InputError> {
    let is_automatic = |given: &functions::Given| given.1.width == Some(FrictionWidth::Auto);
    let of_shared = functions::shared(file).into_iter().map(|given| {
        let key = format!("functions.{}.width", given.0.name());
        (key, given)
    });
    let of_own = (0..file.spec.experiments.len()).flat_map(|i| {
        let key = move |kind: CoefficientKind| {
            format!("experiments[{i}].functions.{}.width", kind.name())
        };
        functions::own(file, i)
            .into_iter()
            .map(move |given| (key(given.0), given))
    });
    let automatic: Vec<_> = (of_shared.chain(of_own))
        .filter(|(_, given)| is_automatic(given))
        .collect();
    let refused = |key: &str, problem: &str, expected: &str| {
        Err(file
            .error_at(key, problem)
            .found("`auto`")
            .expected(expected))
    };
    let is_friction = |given: &functions::Given| given.0 == CoefficientKind::CoulombFriction;
    if let Some((key, _)) = automatic.iter().find(|(_, given)| !is_friction(given)) {
        return refused(key, "only Coulomb friction has a width", "no `width`");
    }
    let Some((key, _)) = automatic.first() else {
        return Ok(None);
    };
    if !functions::shared(file).iter().any(is_automatic) {
        let problem = "the width of Coulomb friction is shared by all experiments";
        let expected = "no `width`, or that of `functions.coulomb_friction`";
        return refused(key, problem, expected);
    }
    let speeds = records.iter().flatten().filter_map(velocity);
    match speeds.reduce(f64::min) {
        Some(speed) => Ok(Some(SHARE * speed)),
        None => refused(
            key,
            "an automatic width needs a record",
            "a width in m/s, because no record is read",
        ),
    }
}

/// Root mean square of the velocity of a record, m/s, from its first channel.
fn velocity(record: &RawRecord) -> Option<f64> {
    let channel = record.channels.first()?;
    let [_, speed] = state_scales(channel.kind, &channel.values, channel.median_spacing);
    (speed.is_finite() && speed > 0.0).then_some(speed)
}
