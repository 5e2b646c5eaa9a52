//! Reads one entry of `constraints` into one or more constraints, each with its key for error messages.
//!
//! Units: bounds, means and values in the unit of the function, slopes in that unit per s, integrals in that unit times s, times in s,
//! frequencies in Hz, ratios in the unit of the first function per that of the second; damping ratios are dimensionless.

use super::BuildError;
use super::coefficient::history;
use crate::constraints::{Constraint, Shape, TimeHistory};
use crate::functions::CoefficientKind;
use crate::model::{ConstraintSpec, NumberOrColumn, RangeSpec};
use crate::system::{Grid, TimePoint};

/// Kind of a constraint, by its key.
#[derive(Debug, Clone, Copy, PartialEq)]
enum ConstraintKey {
    Bounds,
    Slope,
    Shape,
    Values,
    Mean,
    Integral,
    Equal,
    Passive,
    Frequency,
    DampingRatio,
}

impl ConstraintKey {
    /// All kinds with their keys.
    const ALL: [(ConstraintKey, &'static str); 10] = [
        (ConstraintKey::Bounds, "`min` or `max`"),
        (ConstraintKey::Slope, "`slope`"),
        (ConstraintKey::Shape, "`shape`"),
        (ConstraintKey::Values, "`at` and `value`"),
        (ConstraintKey::Mean, "`mean`"),
        (ConstraintKey::Integral, "`integral`"),
        (ConstraintKey::Equal, "`equal`"),
        (ConstraintKey::Passive, "`passive`"),
        (ConstraintKey::Frequency, "`frequency`"),
        (ConstraintKey::DampingRatio, "`damping_ratio`"),
    ];

    fn is_given(self, spec: &ConstraintSpec) -> bool {
        match self {
            ConstraintKey::Bounds => spec.min.is_some() || spec.max.is_some(),
            ConstraintKey::Slope => spec.slope.is_some(),
            ConstraintKey::Shape => spec.shape.is_some(),
            ConstraintKey::Values => spec.at.is_some() || spec.value.is_some(),
            ConstraintKey::Mean => spec.mean.is_some(),
            ConstraintKey::Integral => spec.integral.is_some(),
            ConstraintKey::Equal => spec.equal.is_some(),
            ConstraintKey::Passive => spec.passive.is_some(),
            ConstraintKey::Frequency => spec.frequency.is_some(),
            ConstraintKey::DampingRatio => spec.damping_ratio.is_some(),
        }
    }

    fn name(self) -> &'static str {
        let found = Self::ALL.iter().find(|(kind, _)| *kind == self);
        found.map_or("", |(_, name)| name)
    }

    fn is_about_one_function(self) -> bool {
        !matches!(
            self,
            ConstraintKey::Equal
                | ConstraintKey::Passive
                | ConstraintKey::Frequency
                | ConstraintKey::DampingRatio
        )
    }
}

/// One entry of `constraints` and its key.
struct ConstraintReader<'a> {
    key: &'a str,
    grid: &'a Grid,
    spec: &'a ConstraintSpec,
}

/// Returns the constraints of the entry at `key`, each with its key for error messages.
pub(super) fn read(
    key: &str,
    grid: &Grid,
    spec: &ConstraintSpec,
) -> Result<Vec<(String, Constraint)>, BuildError> {
    let reader = ConstraintReader { key, grid, spec };
    let kind = reader.kind()?;
    reader.check_companions(kind)?;
    reader.constraints(kind)
}

impl ConstraintReader<'_> {
    fn error(&self, below: &str, problem: impl Into<String>) -> BuildError {
        match below {
            "" => BuildError::new(self.key, problem),
            below => BuildError::new(format!("{}.{below}", self.key), problem),
        }
    }

    /// Returns the kind of the constraint; keys of exactly one kind must be given.
    fn kind(&self) -> Result<ConstraintKey, BuildError> {
        let given: Vec<ConstraintKey> = (ConstraintKey::ALL.iter().map(|(kind, _)| *kind))
            .filter(|kind| kind.is_given(self.spec))
            .collect();
        match given.as_slice() {
            [kind] => Ok(*kind),
            [] => {
                let all: Vec<&str> = ConstraintKey::ALL.iter().map(|(_, name)| *name).collect();
                Err(self
                    .error("", "empty constraint")
                    .expected(format!("one of: {}", all.join(", "))))
            }
            [first, second, ..] => Err(self
                .error("", "an entry of `constraints` is one constraint")
                .found(format!("{} beside {}", first.name(), second.name()))
                .expected("one entry for each")),
        }
    }

    /// Checks that `function` and `ratio` are given where the kind needs them, and only there.
    fn check_companions(&self, kind: ConstraintKey) -> Result<(), BuildError> {
        match (kind.is_about_one_function(), self.spec.function) {
            (true, None) => {
                return Err(self
                    .error("", "this constraint needs a function")
                    .found(format!("{} alone", kind.name()))
                    .expected("`function: mass`, `damping` or `stiffness`"));
            }
            (false, Some(_)) => {
                let problem = match kind {
                    ConstraintKey::Passive => {
                        "`passive` concerns mass, damping and stiffness: leave `function` out"
                    }
                    _ => "this constraint applies to several functions: leave `function` out",
                };
                return Err(self
                    .error("function", problem)
                    .found(format!("`function` beside {}", kind.name()))
                    .expected("no `function`"));
            }
            _ => {}
        }
        match self.spec.ratio {
            Some(_) if kind != ConstraintKey::Equal => Err(self
                .error("ratio", "only `equal` has a ratio")
                .found(format!("`ratio` beside {}", kind.name()))
                .expected("no `ratio`")),
            Some(ratio) if ratio == 0.0 => Err(self
                .error("ratio", "a ratio must not be 0")
                .found(ratio)
                .expected(
                    "a number other than 0; for a function that is zero, `max: 0` and `min: 0`",
                )),
            _ => Ok(()),
        }
    }

    /// Returns the constrained function. [`Self::check_companions`] has rejected kinds that need a function and lack one; for the
    /// others the value is unused.
    fn target_function(&self) -> CoefficientKind {
        self.spec.function.unwrap_or(CoefficientKind::MASS)
    }

    /// Returns the constraints of one entry: several for a list of shapes or of times, one for any other kind.
    fn constraints(&self, kind: ConstraintKey) -> Result<Vec<(String, Constraint)>, BuildError> {
        let spec = self.spec;
        let of = self.target_function();
        let number = |given: Option<f64>| given.unwrap_or(0.0);
        let constraint = match kind {
            ConstraintKey::Shape => return self.shapes(),
            ConstraintKey::Values => return self.fixed_values(),
            ConstraintKey::Bounds => Constraint::Bounds {
                of,
                min: self.bound("min", spec.min.as_ref())?,
                max: self.bound("max", spec.max.as_ref())?,
            },
            ConstraintKey::Slope => {
                let (min, max) = self.range("slope", spec.slope.as_ref())?;
                Constraint::Slope { of, min, max }
            }
            ConstraintKey::Mean => Constraint::Mean {
                of,
                value: number(spec.mean),
            },
            ConstraintKey::Integral => Constraint::Integral {
                of,
                value: number(spec.integral),
            },
            ConstraintKey::Equal => self.equal()?,
            ConstraintKey::Frequency => {
                let (min, max) = self.range("frequency", spec.frequency.as_ref())?;
                self.positive("frequency.min", min)?;
                self.positive("frequency.max", max)?;
                Constraint::Frequency { min, max }
            }
            ConstraintKey::DampingRatio => self.damping_ratio()?,
            ConstraintKey::Passive => {
                if spec.passive == Some(false) {
                    return Err(self
                        .error("passive", "this constraint has no effect")
                        .found("false")
                        .expected("`passive: true`, or no such constraint"));
                }
                Constraint::Passive
            }
        };
        Ok(vec![(self.key.to_owned(), constraint)])
    }

    fn bound(
        &self,
        name: &str,
        given: Option<&NumberOrColumn>,
    ) -> Result<Option<TimeHistory>, BuildError> {
        let read = |given| history(given, &format!("{}.{name}", self.key));
        given.map(read).transpose()
    }

    fn shapes(&self) -> Result<Vec<(String, Constraint)>, BuildError> {
        let Some(shapes) = &self.spec.shape else {
            return Ok(Vec::new());
        };
        self.not_empty("shape", shapes.values().len(), "at least one shape")?;
        let constraint = |(i, &shape): (usize, &Shape)| {
            let key = format!("{}.shape{}", self.key, shapes.suffix(i));
            let of = self.target_function();
            (key, Constraint::Shape { of, shape })
        };
        Ok(shapes.values().iter().enumerate().map(constraint).collect())
    }

    fn fixed_values(&self) -> Result<Vec<(String, Constraint)>, BuildError> {
        let (at, value) = match (&self.spec.at, &self.spec.value) {
            (Some(at), Some(value)) => (at, value),
            (at, _) => {
                let (has, lacks) = match at {
                    Some(_) => ("at", "value"),
                    None => ("value", "at"),
                };
                return Err(self
                    .error(has, format!("`{has}` requires `{lacks}`"))
                    .found(format!("`{has}` alone"))
                    .expected("both, as in {function: stiffness, at: 0.0, value: 1.0}"));
            }
        };
        let (times, values) = (at.values(), value.values());
        self.not_empty("at", times.len(), "at least one time in s")?;
        self.not_empty("value", values.len(), "at least one value")?;
        if values.len() != 1 && values.len() != times.len() {
            return Err(self
                .error("value", "the numbers of values and times differ")
                .found(format!("{} values, {} times", values.len(), times.len()))
                .expected("as many values as times, or one for all"));
        }
        let (start, end) = (self.grid.start(), self.grid.time(self.grid.nodes() - 1));
        // A time outside the grid within this distance (s) counts as its end.
        let slack = TimePoint::SAME_TIME * self.grid.step();
        let constraint = |(i, time): (usize, &f64)| {
            let below = format!("at{}", at.suffix(i));
            if *time < start - slack || *time > end + slack {
                return Err(self
                    .error(&below, "this time lies outside the grid")
                    .found(time)
                    .expected(format!(
                        "a time from {start} s to {} s",
                        self.grid.round_time(end)
                    )));
            }
            let fixed = Constraint::Value {
                of: self.target_function(),
                at: time.clamp(start, end),
                value: values[i.min(values.len() - 1)],
            };
            Ok((format!("{}.{below}", self.key), fixed))
        };
        times.iter().enumerate().map(constraint).collect()
    }

    fn equal(&self) -> Result<Constraint, BuildError> {
        let names = self.spec.equal.as_deref().unwrap_or_default();
        match names {
            [first, second] if first != second => Ok(Constraint::Equal {
                first: *first,
                second: *second,
                ratio: self.spec.ratio.unwrap_or(1.0),
            }),
            [first, _] => Err(self
                .error("equal", "the two functions are the same")
                .found(format!("`{}` twice", first.name()))
                .expected("two functions, as in [damping, stiffness]")),
            _ => Err(self
                .error("equal", "an equality needs two functions")
                .found(match names.len() {
                    0 => "an empty list".to_owned(),
                    1 => "1 function".to_owned(),
                    n => format!("{n} functions"),
                })
                .expected("two functions, as in [damping, stiffness]")),
        }
    }

    fn damping_ratio(&self) -> Result<Constraint, BuildError> {
        let range = self.spec.damping_ratio.as_ref();
        if let Some(min) = range.and_then(|r| r.min) {
            return Err(self
                .error(
                    "damping_ratio.min",
                    "a lower bound on the damping ratio is not supported",
                )
                .found(min)
                .expected("`max` alone, because a lower bound is not a convex constraint"));
        }
        let (_, max) = self.range("damping_ratio", range)?;
        let Some(max) = self.positive("damping_ratio.max", max)? else {
            return Err(self
                .error("damping_ratio", "the upper limit is missing")
                .expected("`max`, as in {max: 0.2}"));
        };
        Ok(Constraint::DampingRatio { max })
    }

    /// Both ends of a range, at least one of which is given.
    fn range(
        &self,
        key: &str,
        range: Option<&RangeSpec>,
    ) -> Result<(Option<f64>, Option<f64>), BuildError> {
        let end = |end: fn(&RangeSpec) -> Option<f64>| range.and_then(end);
        let (min, max) = (end(|r| r.min), end(|r| r.max));
        match (min, max) {
            (None, None) => Err(self
                .error(key, "this range has no limit")
                .found("neither `min` nor `max`")
                .expected(match key {
                    "damping_ratio" => "`max`, as in {max: 0.2}",
                    _ => "one of the two, or both",
                })),
            (Some(low), Some(high)) if low > high => Err(self
                .error(&format!("{key}.min"), "min is greater than max")
                .found(format!("min {low} and max {high}"))
                .expected("min at most max")),
            _ => Ok((min, max)),
        }
    }

    fn positive(&self, key: &str, value: Option<f64>) -> Result<Option<f64>, BuildError> {
        match value {
            Some(value) if value <= 0.0 => Err(self
                .error(key, "this limit must be positive")
                .found(value)
                .expected("a number greater than 0")),
            value => Ok(value),
        }
    }

    fn not_empty(&self, key: &str, count: usize, expected: &str) -> Result<(), BuildError> {
        match count {
            0 => Err(self
                .error(key, "the list is empty")
                .found("an empty list")
                .expected(expected)),
            _ => Ok(()),
        }
    }
}
