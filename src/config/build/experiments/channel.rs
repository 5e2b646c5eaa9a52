//! Channels: readings from columns, with their noise, loss, sensor and filter.

use super::source::{self, Wanted};
use super::value::{Named, value};
use super::{ChannelNote, name, names};
use crate::config::ModelFile;
use crate::config::scalar::{ColumnId, ScalarOr, Sigma, Text};
use crate::config::spec::{ColumnRef, ExperimentSpec, LossName, LossSpec, SensorSpec};
use crate::dynamics::{ChannelKind, Grid, Surroundings};
use crate::error::InputError;
use crate::functions::{Scalar, Value};
use crate::objective::{Channel, Loss, Sensor, Weighting, integral_over};
use crate::observations::times::{even_spacing, median_spacing};
use crate::problem::Experiment;
use crate::signal::{self, SecondOrder};
use crate::units::{Kind, Unit};

/// Default name of the column of the displacement, for files without `columns`.
const DISPLACEMENT_COLUMN: &str = "y_m";
/// Order of the filter of a band, run forward and backward.
const BAND_ORDER: usize = 2;
/// Threshold of Huber's loss: 95 % efficiency for Gaussian noise.
const HUBER: f64 = 1.345;
/// Degrees of freedom of Student's t.
const STUDENT: f64 = 4.0;
/// Spacings that differ by less than this share look like rounded times.
const ROUNDED: f64 = 0.05;
/// First guess of a sigma that is estimated, as a share of the readings' size.
const FIRST_SIGMA: f64 = 0.05;

/// One channel before it is put on the grid.
pub struct RawChannel {
    /// What is measured.
    pub kind: ChannelKind,
    /// s.
    pub times: Vec<f64>,
    /// SI.
    pub values: Vec<f64>,
    /// Spacing of the readings where it is equal and none is missing, s.
    pub spacing: Option<f64>,
    /// First and last time of the rows, with a reading or without, s.
    pub span: [f64; 2],
    /// Whether most readings were left out, so that they no longer tell how fine the steps must be.
    pub decimated: bool,
    /// s.
    pub median_spacing: f64,
    /// `None` for the integral cost.
    pub weighting: Option<Weighting>,
    /// Sections of the band's filter.
    pub filter: Vec<SecondOrder>,
    loss: Loss,
    pub unit: Unit,
    ignored: Vec<(usize, String)>,
    format: String,
}

impl RawChannel {
    /// What a report says about it.
    pub fn note(&self) -> ChannelNote {
        ChannelNote {
            kind: self.kind,
            unit: self.unit,
            ignored: self.ignored.clone(),
            format: self.format.clone(),
        }
    }
}

/// What the model says about one kind of channel.
struct Spec<'a> {
    kind: ChannelKind,
    column: Option<&'a ColumnRef>,
    unit: Option<&'a Text>,
    sigma: Option<&'a Sigma>,
    loss: Option<&'a ScalarOr<LossName, LossSpec>>,
    sensor: Option<&'a SensorSpec>,
}

fn spec_of(spec: &ExperimentSpec, kind: ChannelKind) -> Spec<'_> {
    macro_rules! pick {
        ($part:expr) => {
            $part.as_ref().and_then(|part| match kind {
                ChannelKind::Displacement => part.displacement.as_ref(),
                ChannelKind::Velocity => part.velocity.as_ref(),
                ChannelKind::Acceleration => part.acceleration.as_ref(),
            })
        };
    }
    Spec {
        kind,
        column: pick!(spec.columns),
        unit: pick!(spec.units),
        sigma: pick!(spec.sigma),
        loss: pick!(spec.loss),
        sensor: pick!(spec.sensors),
    }
}

/// Reads all channels of experiment `i`.
pub fn read(
    file: &ModelFile,
    i: usize,
    spec: &ExperimentSpec,
    warnings: &mut Vec<String>,
) -> Result<Vec<RawChannel>, InputError> {
    let named: Vec<ChannelKind> = (ChannelKind::ALL.into_iter())
        .filter(|kind| spec_of(spec, *kind).column.is_some())
        .collect();
    if named.is_empty() && (spec.data.is_none() || named_something_else(spec)) {
        return Err(no_channel(file, i, spec));
    }
    let default: ColumnRef = ScalarOr::Scalar(ColumnId::Name(DISPLACEMENT_COLUMN.to_owned()));
    let mut channels = Vec::new();
    for kind in ChannelKind::ALL {
        let of_kind = spec_of(spec, kind);
        let usual = named.is_empty() && kind == ChannelKind::Displacement;
        match of_kind.column.or(usual.then_some(&default)) {
            Some(column) => channels.push(read_one(file, i, spec, &of_kind, column, warnings)?),
            None => without_column(file, i, &of_kind, &named)?,
        }
    }
    Ok(channels)
}

/// Whether `columns` names what drives the motion or nothing but the time.
fn named_something_else(spec: &ExperimentSpec) -> bool {
    let columns = spec.columns.as_ref();
    columns.is_some_and(|c| {
        c.force.is_some() || c.base_acceleration.is_some() || c.base_displacement.is_some()
    })
}

fn no_channel(file: &ModelFile, i: usize, spec: &ExperimentSpec) -> InputError {
    let key = format!("experiments[{i}]");
    match (&spec.data, &spec.columns) {
        (None, None) => file
            .error_at(&key, "this experiment has no data")
            .expected("`data`, a CSV file with the readings"),
        _ => file
            .error_at(&format!("{key}.columns"), "this experiment has no readings")
            .found("columns of other things only")
            .expected("one or more of `displacement`, `velocity`, `acceleration`"),
    }
}

/// Refuses a sigma, a loss or a sensor of a channel that is not read.
fn without_column(
    file: &ModelFile,
    i: usize,
    spec: &Spec,
    named: &[ChannelKind],
) -> Result<(), InputError> {
    let name = spec.kind.name();
    let given = [
        ("sigma", spec.sigma.is_some()),
        ("units", spec.unit.is_some()),
        ("loss", spec.loss.is_some()),
        ("sensors", spec.sensor.is_some()),
    ];
    match given.iter().find(|(_, given)| *given) {
        Some((part, _)) => Err(file
            .error_at(
                &format!("experiments[{i}].{part}.{name}"),
                format!("the {name} has no column, so it is not read"),
            )
            .found(match named {
                [] => "no `columns`: the displacement is read".to_owned(),
                some => format!("columns of {}", names(some)),
            })
            .expected(format!("`columns: {{{name}: …}}`, or no such key here"))),
        None => Ok(()),
    }
}

fn read_one(
    file: &ModelFile,
    i: usize,
    spec: &ExperimentSpec,
    of_kind: &Spec,
    column: &ColumnRef,
    warnings: &mut Vec<String>,
) -> Result<RawChannel, InputError> {
    let kind = of_kind.kind;
    let key = format!("experiments[{i}]");
    let sigma_key = format!("{key}.sigma.{}", kind.name());
    let sigma_column = match of_kind.sigma {
        Some(Sigma::Column(name)) => Some((name.as_str(), sigma_key.as_str())),
        _ => None,
    };
    let wanted = Wanted {
        experiment: i,
        name: kind.name(),
        kind: match kind {
            ChannelKind::Displacement => Kind::Displacement,
            ChannelKind::Velocity => Kind::Velocity,
            ChannelKind::Acceleration => Kind::Acceleration,
        },
        column,
        unit: of_kind.unit,
        beside: sigma_column,
    };
    let mut source = source::read(file, spec, &wanted, warnings)?;
    let mut ignored = Vec::new();
    if source.outside > 0 {
        ignored.push((source.outside, "outside the window".to_owned()));
    }
    if let Some(factor) = spec.decimate {
        decimate(file, &key, factor.0, &mut source, &mut ignored)?;
    }
    let span = [source.times[0], source.times[source.times.len() - 1]];
    let present: Vec<usize> = (0..source.values.len())
        .filter(|&r| !source.values[r].is_nan())
        .collect();
    let missing = source.values.len() - present.len();
    if present.is_empty() {
        return Err(file
            .error_at(
                &format!("{key}.columns.{}", kind.name()),
                "all readings are missing",
            )
            .found(format!(
                "{missing} rows without a number in `{}`",
                source.label
            ))
            .expected("at least some readings"));
    }
    if missing > 0 {
        ignored.push((missing, "missing".to_owned()));
    }
    let times: Vec<f64> = present.iter().map(|&r| source.times[r]).collect();
    let values: Vec<f64> = present.iter().map(|&r| source.values[r]).collect();
    let sigmas = source
        .beside
        .map(|s| present.iter().map(|&r| s[r]).collect::<Vec<f64>>());
    if values.len() < Grid::FEWEST_NODES {
        return Err(file
            .error_at(
                &format!("{key}.columns.{}", kind.name()),
                "there are too few readings",
            )
            .found(match values.len() {
                1 => "1 reading".to_owned(),
                count => format!("{count} readings"),
            })
            .expected(format!("at least {}", Grid::FEWEST_NODES)));
    }
    let spacing = even_spacing(&times);
    if spacing.is_none() && missing == 0 && nearly_equal(&times) {
        warnings.push(format!(
            "{key}: the times are nearly equally spaced but not quite, as if they had been printed \
             with too few digits; they are taken as they are. `sample_rate` in place of the column \
             of times gives them exactly"
        ));
    }
    let filter = band(file, &key, spec, spacing, missing)?;
    let weighting = weighting(file, &sigma_key, of_kind.sigma, sigmas, &values)?;
    let loss = loss(file, &key, of_kind, weighting.as_ref())?;
    Ok(RawChannel {
        kind,
        span,
        decimated: spec.decimate.is_some_and(|factor| factor.0 > 1),
        median_spacing: median_spacing(&times),
        times,
        values,
        spacing,
        weighting,
        filter,
        loss,
        unit: source.unit,
        ignored,
        format: source.format,
    })
}

/// Whether all spacings are within some per cent of their median.
fn nearly_equal(times: &[f64]) -> bool {
    let median = median_spacing(times);
    let off = |w: &[f64]| (w[1] - w[0] - median).abs() > ROUNDED * median;
    !times.windows(2).any(off)
}

/// Keeps every `factor`-th reading after a low-pass filter.
fn decimate(
    file: &ModelFile,
    key: &str,
    factor: usize,
    source: &mut source::Source,
    ignored: &mut Vec<(usize, String)>,
) -> Result<(), InputError> {
    let at = format!("{key}.decimate");
    if factor == 0 {
        return Err(file
            .error_at(&at, "every how manyth reading is kept cannot be 0")
            .found(factor)
            .expected("an integer, 1 or more"));
    }
    let whole = source.values.iter().all(|v| !v.is_nan());
    if !whole || source.times.len() < 2 || even_spacing(&source.times).is_none() {
        return Err(file
            .error_at(
                &at,
                "only equally spaced readings without gaps can be decimated",
            )
            .found(match whole {
                true => "times that are not equally spaced",
                false => "missing readings",
            })
            .expected("no `decimate`, or a window without gaps"));
    }
    let before = source.values.len();
    source.values = signal::decimate(&source.values, factor);
    source.times = source.times.iter().copied().step_by(factor).collect();
    if let Some(beside) = &mut source.beside {
        *beside = beside.iter().copied().step_by(factor).collect();
    }
    let dropped = before - source.values.len();
    if dropped > 0 {
        ignored.push((
            dropped,
            format!("left out by decimation to every {factor}th"),
        ));
    }
    Ok(())
}

/// The filter of the band.
fn band(
    file: &ModelFile,
    key: &str,
    spec: &ExperimentSpec,
    spacing: Option<f64>,
    missing: usize,
) -> Result<Vec<SecondOrder>, InputError> {
    let Some(band) = &spec.band else {
        return Ok(Vec::new());
    };
    let at = format!("{key}.band");
    let Some(spacing) = spacing else {
        return Err(file
            .error_at(
                &at,
                "only equally spaced readings without gaps can be filtered",
            )
            .found(match missing {
                0 => "times that are not equally spaced".to_owned(),
                count => format!("{count} missing readings"),
            })
            .expected("no `band`, or a window without gaps"));
    };
    let rate = 1.0 / spacing;
    let (low, high) = (band.min.map(|f| f.0), band.max.map(|f| f.0));
    let sections = match (low, high) {
        (Some(low), Some(high)) => signal::band_pass(BAND_ORDER, low, high, rate),
        (Some(low), None) => signal::high_pass(BAND_ORDER, low, rate),
        (None, Some(high)) => signal::low_pass(BAND_ORDER, high, rate),
        (None, None) => None,
    };
    sections.ok_or_else(|| {
        let end = |f: Option<f64>| f.map_or("open".to_owned(), |f| format!("{f} Hz"));
        file.error_at(&at, "these frequencies make no band")
            .found(format!("{} to {}", end(low), end(high)))
            .expected(format!(
                "`min`, `max` or both, with 0 < min < max < {} Hz, half the sampling rate",
                0.5 * rate
            ))
    })
}

fn weighting(
    file: &ModelFile,
    key: &str,
    sigma: Option<&Sigma>,
    sigmas: Option<Vec<f64>>,
    values: &[f64],
) -> Result<Option<Weighting>, InputError> {
    let expected = "a number greater than 0, in SI units";
    match (sigma, sigmas) {
        (None, _) => Ok(None),
        (Some(Sigma::Number(sigma)), _) if sigma.0 <= 0.0 => Err(file
            .error_at(key, "a standard deviation must be positive")
            .found(sigma.0)
            .expected(expected)),
        (Some(Sigma::Number(sigma)), _) => Ok(Some(Weighting::Sigma(sigma.0))),
        (Some(Sigma::Estimate), _) => {
            let size = (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
            let sigma = FIRST_SIGMA * if size > 0.0 { size } else { 1.0 };
            Ok(Some(Weighting::Estimated { sigma }))
        }
        (Some(Sigma::Column(name)), Some(sigmas)) => {
            match sigmas.iter().position(|s| !s.is_finite() || *s <= 0.0) {
                Some(row) => Err(file
                    .error_at(key, "a standard deviation must be positive")
                    .found(match sigmas[row].is_nan() {
                        true => format!("nothing in `{name}` beside reading {}", row + 1),
                        false => format!("{} in `{name}` beside reading {}", sigmas[row], row + 1),
                    })
                    .expected("a number greater than 0 beside every reading")),
                None => Ok(Some(Weighting::Sigmas(sigmas))),
            }
        }
        (Some(Sigma::Column(_)), None) => Ok(None),
    }
}

fn loss(
    file: &ModelFile,
    key: &str,
    of_kind: &Spec,
    weighting: Option<&Weighting>,
) -> Result<Loss, InputError> {
    let key = format!("{key}.loss.{}", of_kind.kind.name());
    let (name, threshold, degrees) = match of_kind.loss {
        None => return Ok(Loss::Squares),
        Some(ScalarOr::Scalar(name)) => (*name, None, None),
        Some(ScalarOr::Map(spec)) => (spec.name, spec.threshold, spec.degrees),
    };
    for (part, given, owner) in [
        ("threshold", threshold, LossName::Huber),
        ("degrees", degrees, LossName::StudentT),
    ] {
        match given {
            Some(_) if name != owner => {
                return Err(file
                    .error_at(
                        &format!("{key}.{part}"),
                        format!("`{name}` has no `{part}`"),
                    )
                    .found(format!("`{part}`"))
                    .expected(format!("it beside `{owner}` only")));
            }
            Some(number) if number.0 <= 0.0 => {
                return Err(file
                    .error_at(
                        &format!("{key}.{part}"),
                        format!("the `{part}` must be positive"),
                    )
                    .found(number.0)
                    .expected("a number greater than 0"));
            }
            _ => {}
        }
    }
    if name != LossName::Squares && weighting.is_none() {
        return Err(file
            .error_at(
                &key,
                "a robust loss needs to know which residuals are large",
            )
            .found("no `sigma`")
            .expected(format!("`sigma: {{{}: …}}`", of_kind.kind.name())));
    }
    Ok(match name {
        LossName::Squares => Loss::Squares,
        LossName::Huber => Loss::Huber {
            threshold: threshold.map_or(HUBER, |t| t.0),
        },
        LossName::StudentT => Loss::StudentT {
            degrees: degrees.map_or(STUDENT, |d| d.0),
        },
    })
}

/// Puts a channel on the grid.
pub fn place(
    file: &ModelFile,
    (i, spec): (usize, &ExperimentSpec),
    raw: RawChannel,
    grid: &Grid,
    experiment: &Experiment,
    scalars: &mut Vec<Scalar>,
) -> Result<Channel, InputError> {
    let of_kind = spec_of(spec, raw.kind);
    let weighting = match (raw.weighting, raw.spacing) {
        (Some(weighting), _) => weighting,
        (None, Some(_)) => Weighting::Integral {
            // As the paper's: the length over the intervals.
            spacing: even_spacing(&raw.times).unwrap_or(raw.median_spacing),
        },
        (None, None) => integral_over(&raw.times),
    };
    let sensor = sensor(
        file,
        (i, raw.unit.is_angular()),
        &of_kind,
        &raw.values,
        scalars,
    )?;
    let times = raw.times.clone();
    let channel = Channel::new(
        raw.kind,
        raw.times,
        raw.values,
        weighting,
        grid,
        experiment.nodes,
    );
    let channel = channel.ok_or_else(|| {
        file.error_at("grid", "the readings do not lie on the grid")
            .found(format!("readings until {} s", times[times.len() - 1]))
            .expected(format!(
                "a grid from {} s to {} s",
                grid.start(),
                grid.start() + grid.duration()
            ))
    })?;
    let mut channel = channel.with_loss(raw.loss).with_sensor(sensor);
    let drive = &experiment.drive;
    if raw.kind == ChannelKind::Acceleration && experiment.excitation.is_some() {
        let around = |t: &f64| Surroundings {
            force: drive.force_at(*t),
            base: drive.base_acceleration_at(*t),
        };
        channel = channel.with_surroundings(times.iter().map(around).collect());
    }
    if drive.base.is_some() {
        let usual = raw.kind == ChannelKind::Acceleration;
        let absolute = of_kind.sensor.and_then(|s| s.absolute);
        if absolute.unwrap_or(usual) {
            let motion = times.iter().map(|t| drive.base_motion_at(raw.kind, *t));
            let motion: Option<Vec<f64>> = motion.collect();
            channel = channel.with_base(motion.ok_or_else(|| {
                let name = raw.kind.name();
                file.error_at(
                    &format!("experiments[{i}].sensors.{name}.absolute"),
                    format!("the {name} of the base is not known"),
                )
                .found("the acceleration of the base only")
                .expected("`columns: {base_displacement: …}`, or no `absolute: true`")
            })?);
        }
    } else if of_kind.sensor.and_then(|s| s.absolute).is_some() {
        let name = raw.kind.name();
        return Err(file
            .error_at(
                &format!("experiments[{i}].sensors.{name}.absolute"),
                "the base does not move, so there is only one motion to measure",
            )
            .found("`absolute` without a motion of the base")
            .expected("no `absolute`"));
    }
    if !raw.filter.is_empty() {
        channel = channel.with_filter(raw.filter);
    }
    Ok(channel)
}

fn sensor(
    file: &ModelFile,
    (i, angular): (usize, bool),
    of_kind: &Spec,
    values: &[f64],
    scalars: &mut Vec<Scalar>,
) -> Result<Sensor, InputError> {
    let Some(spec) = of_kind.sensor else {
        return Ok(Sensor::default());
    };
    let kind = of_kind.kind;
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let size =
        (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / values.len() as f64).sqrt();
    let unit = kind.unit_of(angular);
    let per_second = format!("{unit}/s");
    let parts = [
        ("gain", &spec.gain, "", 1.0, 1.0),
        ("offset", &spec.offset, unit, mean, size),
        ("drift", &spec.drift, per_second.as_str(), 0.0, size),
    ];
    let mut found = [Value::Known(1.0), Value::Known(0.0), Value::Known(0.0)];
    for ((part, given, unit, start, size), found) in parts.into_iter().zip(&mut found) {
        if let Some(given) = given {
            let named = Named {
                key: format!("experiments[{i}].sensors.{}.{part}", kind.name()),
                name: format!("{part} of the {} of {}", kind.name(), name(file, i)),
                unit,
                start,
                size,
            };
            *found = value(file, &named, given, scalars)?;
        }
    }
    if found[0] == Value::Known(0.0) {
        return Err(file
            .error_at(
                &format!("experiments[{i}].sensors.{}.gain", kind.name()),
                "a sensor with gain 0 sees nothing",
            )
            .found("0")
            .expected("another number, or `estimate`"));
    }
    if super::is_equation_error(file) && found.iter().any(|v| v.index().is_some()) {
        return Err(file
            .error_at(
                &format!("experiments[{i}].sensors.{}", kind.name()),
                "the method `equation-error` needs sensors that are known",
            )
            .found("`estimate`")
            .expected("numbers, or another method"));
    }
    Ok(Sensor {
        gain: found[0],
        offset: found[1],
        drift: found[2],
    })
}
