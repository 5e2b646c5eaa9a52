//! Coefficient sets of a builder: the functions shared by all records, and those of single records.

use super::{BuildError, Builder, CoefficientSpec};
use crate::functions::CoefficientKind;

/// A coefficient function of a builder, with its key.
pub(super) struct FunctionEntry<'a> {
    /// Key, such as `functions.mass` or `experiments[1].functions.damping`.
    pub key: String,
    pub kind: CoefficientKind,
    pub spec: &'a CoefficientSpec,
    /// Index of the record with its own function; `None` for a shared one.
    pub owner: Option<usize>,
}

impl FunctionEntry<'_> {
    /// Smoothing speed of the sign of the velocity, m/s, for Coulomb friction; 0 for other kinds.
    pub fn width(&self) -> Result<f64, BuildError> {
        let key = format!("{}.width", self.key);
        let advice = "well below those of the response";
        match (self.kind, self.spec.width) {
            (CoefficientKind::CoulombFriction, Some(width)) if width > 0.0 && width.is_finite() => {
                Ok(width)
            }
            (CoefficientKind::CoulombFriction, Some(width)) => {
                Err(BuildError::new(key, "the width must be positive")
                    .found(width)
                    .expected(format!("a speed in m/s, greater than 0, {advice}")))
            }
            (CoefficientKind::CoulombFriction, None) => {
                Err(
                    BuildError::new(&self.key, "Coulomb friction needs a width").expected(format!(
                        "`width`: the speed in m/s over which the sign of v is smoothed, {advice}"
                    )),
                )
            }
            (_, Some(width)) => Err(BuildError::new(key, "only Coulomb friction has a width")
                .found(width)
                .expected("no `width`")),
            (_, None) => Ok(0.0),
        }
    }
}

/// Coefficient sets, and the set of each record.
pub(super) struct CoefficientSets {
    /// Indices into the list of [`Builder::entries`], mass first; the first set is the shared one.
    pub sets: Vec<Vec<usize>>,
    pub of_record: Vec<usize>,
}

impl Builder {
    /// All functions in the order of the problem: the shared ones, mass first, then those of single records.
    pub(super) fn entries(&self) -> Vec<FunctionEntry<'_>> {
        let shared = (self.coefficients.iter()).map(|(kind, spec)| FunctionEntry {
            key: format!("functions.{}", kind.name()),
            kind: *kind,
            spec,
            owner: None,
        });
        let own = self.records.iter().enumerate().flat_map(|(i, record)| {
            record
                .coefficients
                .iter()
                .map(move |(kind, spec)| FunctionEntry {
                    key: format!("experiments[{i}].functions.{}", kind.name()),
                    kind: *kind,
                    spec,
                    owner: Some(i),
                })
        });
        shared.chain(own).collect()
    }

    /// Coefficient sets of the records.
    pub(super) fn coefficient_sets(&self) -> Result<CoefficientSets, BuildError> {
        let entries = self.entries();
        let shared: Vec<usize> = (0..self.coefficients.len()).collect();
        let mut found = CoefficientSets {
            sets: vec![shared.clone()],
            of_record: Vec::new(),
        };
        for (i, record) in self.records.iter().enumerate() {
            let mut set = shared.clone();
            if record.validation && !record.coefficients.is_empty() {
                let problem = "a validation record cannot have functions of its own";
                return Err(
                    BuildError::new(format!("experiments[{i}].functions"), problem)
                        .found("`functions` beside `validation: true`")
                        .expected(
                            "no `functions`: the record is predicted with the shared functions",
                        ),
                );
            }
            for (f, entry) in entries
                .iter()
                .enumerate()
                .filter(|(_, s)| s.owner == Some(i))
            {
                set[self.shared_place(entry)?] = f;
            }
            let known = found.sets.iter().position(|s| *s == set);
            found.of_record.push(known.unwrap_or(found.sets.len()));
            if known.is_none() {
                found.sets.push(set);
            }
        }
        check_shared(&entries, &found)?;
        Ok(found)
    }

    /// Index of the shared function that a record replaces.
    fn shared_place(&self, entry: &FunctionEntry) -> Result<usize, BuildError> {
        let mut kinds = self.coefficients.iter().map(|(kind, _)| *kind);
        let Some(place) = kinds.position(|kind| kind == entry.kind) else {
            let name = entry.kind.name();
            return Err(
                BuildError::new(&entry.key, "the system has no such function")
                    .found(format!("`{name}` in one experiment only"))
                    .expected(format!(
                        "`functions.{name}` as well, which the other experiments share; `fixed: 0` where they have none"
                    )),
            );
        };
        if entry.kind != CoefficientKind::CoulombFriction {
            return entry.width().map(|_| place);
        }
        let shared = self.coefficients[place].1.width;
        match entry.spec.width {
            Some(width) if shared != Some(width) => {
                let problem = "the width of Coulomb friction is shared by all experiments";
                Err(BuildError::new(format!("{}.width", entry.key), problem)
                    .found(width)
                    .expected("no `width`, or that of `functions.coulomb_friction`"))
            }
            _ => Ok(place),
        }
    }
}

/// Error if records share no estimated function, or a function applies to no record.
fn check_shared(entries: &[FunctionEntry], found: &CoefficientSets) -> Result<(), BuildError> {
    let users = |f: usize| {
        let uses = |set: &&usize| found.sets[**set].contains(&f);
        found.of_record.iter().filter(uses).count()
    };
    let own = (entries.iter()).any(|s| s.owner.is_some() && s.spec.is_estimated());
    let shared = |(f, entry): (usize, &FunctionEntry)| entry.spec.is_estimated() && users(f) > 1;
    if found.of_record.len() > 1 && own && !entries.iter().enumerate().any(shared) {
        let problem = "the experiments share no function that is fitted";
        return Err(BuildError::new("experiments", problem)
            .found("separate functions in every experiment")
            .expected("a function that several experiments share, or a model for each"));
    }
    match (entries.iter().enumerate()).find(|(f, _)| users(*f) == 0 && !found.of_record.is_empty())
    {
        Some((_, entry)) => Err(
            BuildError::new(&entry.key, "no experiment uses this function")
                .found("a separate function in every experiment")
                .expected("an experiment without a separate function, or `fixed` here"),
        ),
        None => Ok(()),
    }
}
