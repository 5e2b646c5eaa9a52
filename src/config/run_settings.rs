//! What the model of a run states about its records, for a new record of the same sensors.

use super::ModelFile;
use super::lowering::sensor_of;
use super::scaffold::Role;
use crate::tables::{ColumnName, Table};
use crate::units::ScaledUnit;
use kmcfit_core::model::{
    ColumnId, ColumnRef, DelayValue, ExperimentSpec, ScalarOr, ScalarSpec, SensorSpec,
};
use kmcfit_core::record::ChannelKind;
use kmcfit_core::signal::Interpolation;

/// Settings of the first record of a run with a given input; those of an ideal sensor by default.
#[derive(Debug, Clone, Default)]
pub struct RunSettings {
    experiment: Option<ExperimentSpec>,
    /// Name of the record, which is that of its estimated parameters.
    name: String,
}

/// A parameter of a sensor.
#[derive(Debug, Clone, PartialEq)]
pub enum SensorValue {
    /// Stated in the model.
    Known(f64),
    /// Estimated by the fit as the parameter of this name.
    Estimated(String),
}

/// A sensor of a response as the model states it.
#[derive(Debug, Clone, PartialEq)]
pub struct RunSensor {
    pub gain: SensorValue,
    pub offset: SensorValue,
    pub drift: SensorValue,
    /// Delay of the samples, s.
    pub delay: SensorValue,
    /// Delay of the input, s.
    pub input_delay: SensorValue,
    /// True for absolute motion.
    pub absolute: bool,
}

impl RunSensor {
    /// Names of its estimated parameters.
    pub fn estimated(&self) -> impl Iterator<Item = &str> {
        let all = [
            &self.gain,
            &self.offset,
            &self.drift,
            &self.delay,
            &self.input_delay,
        ];
        all.into_iter().filter_map(|value| match value {
            SensorValue::Known(_) => None,
            SensorValue::Estimated(name) => Some(name.as_str()),
        })
    }
}

impl RunSettings {
    /// Settings of the first fitted record with a column of the force (else of the base motion), of any first one where there is none.
    pub fn of(file: &ModelFile, has_force: bool) -> Self {
        let specs = &file.spec.experiments;
        let has_input = |spec: &ExperimentSpec| {
            spec.columns.as_ref().is_some_and(|c| match has_force {
                true => c.force.is_some(),
                false => c.base_acceleration.is_some() || c.base_displacement.is_some(),
            })
        };
        let is_fitted = |spec: &ExperimentSpec| spec.validation != Some(true);
        let first = |is: &dyn Fn(&ExperimentSpec) -> bool| specs.iter().position(is);
        let found = first(&|spec| has_input(spec) && is_fitted(spec))
            .or_else(|| first(&has_input))
            .or_else(|| first(&is_fitted));
        found.map_or_else(Self::default, |i| Self {
            experiment: Some(specs[i].clone()),
            name: file.experiment_name(i),
        })
    }

    /// Interpolation of an input.
    pub fn interpolation(&self, role: Role) -> Interpolation {
        let spec = self.experiment.as_ref();
        let stated = match role {
            // It is differentiated twice.
            Role::BaseDisplacement => return Interpolation::Cubic,
            Role::Force => spec.and_then(|s| s.force.as_ref()?.interpolation),
            _ => spec.and_then(|s| s.base.as_ref()?.interpolation),
        };
        stated.unwrap_or_default()
    }

    /// Sampling rate of a record without a column of times, Hz.
    pub fn sample_rate(&self) -> Option<f64> {
        self.experiment.as_ref()?.sample_rate
    }

    /// Columns of a table with the names that the model gives, by index.
    pub fn columns_of(&self, table: &Table) -> Vec<(usize, Role)> {
        let Some(columns) = self.experiment.as_ref().and_then(|s| s.columns.as_ref()) else {
            return Vec::new();
        };
        let index = |id: &ColumnId| match id {
            ColumnId::Name(name) => table.find(&ColumnName::Name(name.clone())).ok(),
            // A table of another layout has another quantity there.
            ColumnId::Number(_) => None,
        };
        let of = |reference: &Option<ColumnRef>| match reference.as_ref()? {
            ScalarOr::Scalar(id) => index(id),
            ScalarOr::Map(source) => index(&source.column),
        };
        let named = [
            (columns.time.as_ref().and_then(index), Role::Time),
            (of(&columns.displacement), Role::Displacement),
            (of(&columns.velocity), Role::Velocity),
            (of(&columns.acceleration), Role::Acceleration),
            (of(&columns.force), Role::Force),
            (of(&columns.base_acceleration), Role::BaseAcceleration),
            (of(&columns.base_displacement), Role::BaseDisplacement),
        ];
        let found = named.into_iter();
        found.filter_map(|(i, role)| Some((i?, role))).collect()
    }

    /// Units that the model states.
    pub fn units(&self) -> Vec<(Role, ScaledUnit)> {
        let Some(units) = self.experiment.as_ref().and_then(|s| s.units.as_ref()) else {
            return Vec::new();
        };
        let stated: [(Role, &Option<String>); 7] = [
            (Role::Time, &units.time),
            (Role::Displacement, &units.displacement),
            (Role::Velocity, &units.velocity),
            (Role::Acceleration, &units.acceleration),
            (Role::Force, &units.force),
            (Role::BaseAcceleration, &units.base_acceleration),
            (Role::BaseDisplacement, &units.base_displacement),
        ];
        let parsed = stated.into_iter().filter_map(|(role, text)| {
            let unit = ScaledUnit::parse(role.kind(), text.as_ref()?, None).ok()?;
            Some((role, unit))
        });
        parsed.collect()
    }

    /// The sensor of a response.
    pub fn sensor(&self, kind: ChannelKind) -> RunSensor {
        let spec = self.experiment.as_ref();
        let given = spec.and_then(|spec| sensor_of(spec, kind));
        let name = |part: &str| format!("{part} of the {} of {}", kind.name(), self.name);
        let value =
            |pick: &dyn Fn(&SensorSpec) -> Option<&ScalarSpec>, part: &str, default| match given
                .and_then(pick)
            {
                None => SensorValue::Known(default),
                Some(ScalarSpec::Known(x)) => SensorValue::Known(*x),
                Some(_) => SensorValue::Estimated(name(part)),
            };
        let (input, input_delay) = self.input_delay();
        RunSensor {
            gain: value(&|s| s.gain.as_ref(), "gain", 1.0),
            offset: value(&|s| s.offset.as_ref(), "offset", 0.0),
            drift: value(&|s| s.drift.as_ref(), "drift", 0.0),
            delay: delay(given.and_then(|s| s.delay.as_ref()), || name("delay")),
            input_delay: delay(input_delay, || {
                format!("delay of the {input} of {}", self.name)
            }),
            absolute: given
                .and_then(|s| s.absolute)
                .unwrap_or(kind == ChannelKind::Acceleration),
        }
    }

    /// Name and delay of the input that the model names.
    fn input_delay(&self) -> (&'static str, Option<&DelayValue>) {
        let spec = self.experiment.as_ref();
        let Some(sensors) = spec.and_then(|s| s.sensors.as_ref()) else {
            return ("force", None);
        };
        let base = || {
            let acceleration = sensors.base_acceleration.as_ref();
            acceleration.or(sensors.base_displacement.as_ref())
        };
        match &sensors.force {
            Some(force) => ("force", force.delay.as_ref()),
            None => ("base motion", base().and_then(|s| s.delay.as_ref())),
        }
    }
}

fn delay(given: Option<&DelayValue>, name: impl Fn() -> String) -> SensorValue {
    match given {
        None => SensorValue::Known(0.0),
        Some(DelayValue::Known(x)) => SensorValue::Known(*x),
        Some(_) => SensorValue::Estimated(name()),
    }
}
