//! Inputs of a prediction: force and base motion from files of their own, with measurements to score it, if any.

use super::ModelFile;
use super::run_settings::{RunSensor, RunSettings};
use super::scaffold::{ColumnAssignment, Role, recognised};
use crate::error::InputError;
use crate::tables::{Table, increasing_at};
use crate::text_io::quote;
use kmcfit_core::record::{BaseMotion, ChannelKind, Input, Waveform};
use kmcfit_core::signal::{Signal, median_spacing};
use std::path::{Path, PathBuf};

/// Inputs over a span of time, and measurements in the same files.
pub struct NewRecord {
    /// Force and base motion.
    pub input: Input,
    /// First and last time of the inputs, s.
    pub span: [f64; 2],
    /// Median distance of their samples, s.
    pub spacing: f64,
    /// Measured channels.
    pub measured: Vec<MeasuredChannel>,
    /// Files.
    pub files: Vec<PathBuf>,
}

/// A measured channel: samples in SI units.
pub struct MeasuredChannel {
    /// Kind.
    pub kind: ChannelKind,
    /// Its sensor, as in the run.
    pub sensor: RunSensor,
    /// Times, s.
    pub times: Vec<f64>,
    /// Samples, SI.
    pub values: Vec<f64>,
}

impl NewRecord {
    /// Reads the files of the options `--force` and `--base`, one of them at least. Roles and units of their columns follow from names
    /// and units, as in `kmcfit init`, unless the model of the run, `model`, names and states them; interpolation and sensors are those of
    /// its first record with the same input.
    ///
    /// # Errors
    /// If a file cannot be read, has no column of times or of the input, or gaps in the input; if the base ends before the force.
    pub fn read(
        force: Option<&Path>,
        base: Option<&Path>,
        model: &ModelFile,
    ) -> Result<Self, InputError> {
        let [force, base] = [(force, true), (base, false)].map(|(path, is_force)| {
            path.map(|path| InputFile::read(path, RunSettings::of(model, is_force)))
                .transpose()
        });
        let (force, base) = (force?, base?);
        let mut input = Input::default();
        let mut used = Vec::new();
        if let Some(file) = &force {
            let (signal, index) = file.signal("--force", &[Role::Force], "a force")?;
            input.force = Some(Waveform::Samples(signal));
            used.push((file.table.path().to_path_buf(), index));
        }
        if let Some(file) = &base {
            let roles = [
                Role::BaseAcceleration,
                Role::BaseDisplacement,
                Role::Acceleration,
            ];
            let (signal, index) = file.signal("--base", &roles, "a motion of the base")?;
            let is_displacement = file.role(index) == Some(Role::BaseDisplacement);
            input.base = Some(match is_displacement {
                true => BaseMotion::Displacement(signal),
                false => BaseMotion::Acceleration(signal),
            });
            used.push((file.table.path().to_path_buf(), index));
        }
        let files: Vec<&InputFile> = force.iter().chain(&base).collect();
        let span = |file: &InputFile| [file.times[0], file.times[file.times.len() - 1]];
        let Some(first) = files.first() else {
            return Err(InputError::argument("--force", "no input is given")
                .expected("`--force FILE`, `--base FILE` or both"));
        };
        let [from, to] = span(first);
        let spacing = median_spacing(&first.times);
        for other in files.iter().skip(1) {
            let [start, end] = span(other);
            if start > from + spacing || end < to - spacing {
                return Err(InputError::file(
                    other.table.path(),
                    "the motion of the base does not cover the force",
                )
                .found(format!("{start} s to {end} s"))
                .expected(format!("{from} s to {to} s")));
            }
        }
        let mut measured = Vec::new();
        for file in &files {
            for channel in file.measured(&used)? {
                let is_known = measured
                    .iter()
                    .any(|m: &MeasuredChannel| m.kind == channel.kind);
                if !is_known {
                    measured.push(channel);
                }
            }
        }
        Ok(Self {
            input,
            span: [from, to],
            spacing,
            measured,
            files: files.iter().map(|f| f.table.path().to_path_buf()).collect(),
        })
    }
}

/// A file with its columns.
struct InputFile {
    table: Table,
    columns: ColumnAssignment,
    settings: RunSettings,
    /// Times of the rows, s.
    times: Vec<f64>,
}

impl InputFile {
    fn read(path: &Path, settings: RunSettings) -> Result<Self, InputError> {
        let table = Table::read(path)?;
        let named = settings.columns_of(&table);
        let has_times = (0..table.width()).any(|i| {
            recognised(&table, i).is_some_and(|(role, ..)| role == Role::Time)
                || named.contains(&(i, Role::Time))
        });
        let rate = settings.sample_rate().filter(|_| !has_times);
        let columns = ColumnAssignment::as_in_run(&table, rate, named, settings.units())?;
        let times: Vec<f64> = match rate {
            Some(rate) => (0..table.rows()).map(|i| i as f64 / rate).collect(),
            None => {
                let time = columns.find(Role::Time).ok_or_else(|| {
                    InputError::file(path, "no column of times").expected("a column of times in s")
                })?;
                let times = increasing_at(&table, time.index)?;
                times.iter().map(|t| t * time.factor()).collect()
            }
        };
        if times.len() < 3 {
            return Err(InputError::file(path, "too few rows for a prediction")
                .found(times.len())
                .expected("at least 3 rows"));
        }
        Ok(Self {
            columns,
            settings,
            times,
            table,
        })
    }

    fn role(&self, index: usize) -> Option<Role> {
        let mut used = self.columns.used.iter();
        used.find(|c| c.index == index).map(|c| c.role)
    }

    /// The first column with one of the `roles`, as a signal, and its index.
    fn signal(
        &self,
        option: &str,
        roles: &[Role],
        what: &str,
    ) -> Result<(Signal, usize), InputError> {
        let path = self.table.path();
        let found = roles.iter().find_map(|role| self.columns.find(*role));
        let column = found.ok_or_else(|| {
            let names = (0..self.table.width()).map(|i| quote(&self.table.label(i)));
            let error = InputError::argument(option, format!("{}: no column is {what}", path.display()))
                .found(names.collect::<Vec<_>>().join(", "));
            match option {
                "--force" => error.expected("a column named `force`, or one with the unit N: `f_N`, `F [kN]`"),
                _ => error.expected("a column named `base_acc` or `base_disp` with its unit: `base_acc_g`, `table [mm]`"),
            }
        })?;
        let samples = self.table.samples(column.index)?;
        let label = self.table.label(column.index);
        let missing = samples.iter().filter(|x| x.is_nan()).count();
        if let Some(first) = samples.iter().position(|x| x.is_nan()) {
            return Err(InputError::new(
                self.table.location(first, Some(&label)),
                "the input has gaps",
            )
            .found(format!("{missing} of {} values missing", samples.len()))
            .expected("a value in every row: it acts at all times"));
        }
        let values = samples.iter().map(|x| x * column.factor()).collect();
        let interpolation = self.settings.interpolation(column.role);
        let signal = Signal::new(self.times.clone(), values, interpolation);
        let signal = signal.ok_or_else(|| {
            InputError::file(path, "invalid samples of the input")
                .found(format!("{} samples of `{label}`", samples.len()))
                .expected("finite values at increasing times")
        })?;
        Ok((signal, column.index))
    }

    /// Measured responses, without the columns `used` as inputs.
    fn measured(&self, used: &[(PathBuf, usize)]) -> Result<Vec<MeasuredChannel>, InputError> {
        let mut found = Vec::new();
        for column in &self.columns.used {
            let kind = match column.role {
                Role::Displacement => ChannelKind::Displacement,
                Role::Velocity => ChannelKind::Velocity,
                Role::Acceleration => ChannelKind::Acceleration,
                _ => continue,
            };
            let is_input = |(path, index): &(PathBuf, usize)| {
                path == self.table.path() && *index == column.index
            };
            if used.iter().any(is_input) {
                continue;
            }
            let samples = self.table.samples(column.index)?;
            let pairs = self
                .times
                .iter()
                .zip(samples)
                .filter(|(_, x)| x.is_finite());
            let (times, values) = pairs.map(|(t, x)| (*t, x * column.factor())).unzip();
            found.push(MeasuredChannel {
                kind,
                sensor: self.settings.sensor(kind),
                times,
                values,
            });
        }
        Ok(found)
    }
}
