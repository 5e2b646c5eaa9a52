//! What the readings say of the motion: how often they come, how fast it is.

use super::columns::{Column, Columns, Role};
use crate::error::InputError;
use crate::observations::{Table, increasing_at};
use crate::signal::Spectrum;

/// Fewest readings of which a model can be made.
const FEWEST: usize = 8;
/// Spacings that differ by less than this share are equal, but for rounded times.
const REGULAR: f64 = 0.05;

/// The motion of a record.
#[derive(Debug)]
pub struct Motion {
    pub readings: usize,
    pub missing: usize,
    /// s.
    pub duration: f64,
    /// Median distance of readings, s.
    pub spacing: f64,
    pub is_regular: bool,
    /// Hz.
    pub frequency: Option<f64>,
    /// Whether the mean of the readings is larger than their distances from it.
    pub is_off_centre: bool,
    /// Root-mean-square force, N, and motion with the power of the frequency that makes it an
    /// acceleration.
    force: Option<f64>,
    motion: f64,
    power: i32,
}

impl Motion {
    pub fn of(
        table: &Table,
        columns: &Columns,
        sample_rate: Option<f64>,
    ) -> Result<Self, InputError> {
        let times = times(table, columns, sample_rate)?;
        let channel = |role: Role| columns.find(role);
        let order = [
            (Role::Displacement, 2),
            (Role::Velocity, 1),
            (Role::Acceleration, 0),
        ];
        let mut measured = order
            .into_iter()
            .filter_map(|(r, p)| Some((channel(r)?, p)));
        let Some((column, power)) = measured.next() else {
            return Err(InputError::file(
                table.path(),
                "there is no column of a motion",
            ));
        };
        let values = in_si(table, column)?;
        let pairs: Vec<(f64, f64)> = (times.iter().copied().zip(values))
            .filter(|(_, value)| value.is_finite())
            .collect();
        if pairs.len() < FEWEST {
            return Err(InputError::file(table.path(), "there are too few readings")
                .found(pairs.len())
                .expected(format!("{FEWEST} or more")));
        }
        if let Some((_, still)) = pairs
            .first()
            .filter(|(_, first)| pairs.iter().all(|(_, x)| x == first))
        {
            return Err(InputError::file(table.path(), "the readings do not move")
                .found(format!("{} readings, all of them {still}", pairs.len()))
                .expected(
                    "the motion of a device: nothing can be learnt from one that stands still",
                ));
        }
        let spacings: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
        let spacing = median(&spacings);
        let force = channel(Role::Force).map(|c| in_si(table, c)).transpose()?;
        Ok(Self {
            readings: pairs.len(),
            missing: times.len() - pairs.len(),
            duration: times[times.len() - 1] - times[0],
            spacing,
            is_regular: (spacings.iter()).all(|s| (s - spacing).abs() <= REGULAR * spacing),
            frequency: frequency(&pairs, spacing),
            is_off_centre: off_centre(&pairs),
            force: force.map(|f| spread(f.into_iter().filter(|x| x.is_finite()))),
            motion: spread(pairs.iter().map(|(_, value)| *value)),
            power,
        })
    }

    /// Number of periods of the dominant frequency in the record.
    pub fn periods(&self) -> f64 {
        self.frequency.unwrap_or(0.0) * self.duration
    }

    /// The mass that the force would move so, if it had nothing else to do, kg.
    pub fn mass(&self, omega: f64) -> Option<f64> {
        let mass = self.force? / (self.motion * omega.powi(self.power));
        (mass.is_finite() && mass > 0.0).then_some(mass)
    }

    pub fn spacing_in_words(&self) -> String {
        let kind = match self.is_regular {
            true => "one every",
            false => "at irregular times, about one every",
        };
        let missing = match self.missing {
            0 => String::new(),
            some => format!(", {some} missing"),
        };
        format!("{kind} {} s{missing}", super::short(self.spacing))
    }
}

fn times(
    table: &Table,
    columns: &Columns,
    sample_rate: Option<f64>,
) -> Result<Vec<f64>, InputError> {
    match columns.find(Role::Time) {
        Some(column) => {
            let times = increasing_at(table, column.index)?;
            let times = times.iter().map(|t| t * column.unit.factor());
            Ok(times.collect())
        }
        None => {
            let rate = sample_rate.unwrap_or(1.0);
            Ok((0..table.rows()).map(|i| i as f64 / rate).collect())
        }
    }
}

fn in_si(table: &Table, column: &Column) -> Result<Vec<f64>, InputError> {
    let factor = column.unit.factor();
    let readings = table.readings(column.index)?;
    Ok(readings.iter().map(|x| x * factor).collect())
}

/// The dominant frequency of readings that are joined by straight lines where they are not equally
/// spaced, Hz.
fn frequency(pairs: &[(f64, f64)], spacing: f64) -> Option<f64> {
    let (first, last) = (pairs.first()?.0, pairs.last()?.0);
    // A gap of hours between readings of milliseconds is no reason to take all memory.
    let count = (((last - first) / spacing).round() as usize + 1).min(4 * pairs.len());
    let step = (last - first) / (count - 1) as f64;
    let mut next = 1;
    let at = |i: usize| {
        let t = first + step * i as f64;
        while next + 1 < pairs.len() && pairs[next].0 < t {
            next += 1;
        }
        let ((t0, y0), (t1, y1)) = (pairs[next - 1], pairs[next]);
        y0 + (y1 - y0) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0)
    };
    let values: Vec<f64> = (0..count).map(at).collect();
    let frequency = Spectrum::of(&values, step)?.dominant();
    (frequency.is_finite() && frequency > 0.0).then_some(frequency)
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn off_centre(pairs: &[(f64, f64)]) -> bool {
    let mean = pairs.iter().map(|(_, value)| value).sum::<f64>() / pairs.len() as f64;
    mean.abs() > spread(pairs.iter().map(|(_, value)| *value))
}

/// Standard deviation.
fn spread(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n).sqrt()
}
