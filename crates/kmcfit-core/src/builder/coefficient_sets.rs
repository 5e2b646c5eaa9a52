//! Coefficient sets of a builder: the functions shared by all records, and those of single records.

use super::coefficient::KNOWN_PART;
use super::{BuildError, Builder};
use crate::functions::{CoefficientKind, CoefficientSet};
use crate::model::{CoefficientSpec, KnownValue};
use crate::solvers::Solver;
use crate::structure::Ends;
use std::borrow::Cow;

/// A function of the system: the mass of a coordinate, or the coefficient of an element.
#[derive(Debug, Clone)]
pub(super) struct Function {
    /// Key, such as `functions.mass` or `structure.elements.storey_1`.
    pub key: String,
    /// Name, which is that of the kind without a structure.
    pub name: String,
    pub kind: CoefficientKind,
    pub spec: CoefficientSpec,
    /// The combination of coordinates on which it acts.
    pub ends: Ends,
}

impl Function {
    /// That of a system of one coordinate.
    pub fn one((kind, spec): (CoefficientKind, CoefficientSpec)) -> Self {
        Self {
            key: format!("functions.{}", kind.name()),
            name: kind.name().to_owned(),
            kind,
            spec,
            ends: Ends::ground(0),
        }
    }
}

/// A coefficient function of a builder, with its key.
pub(super) struct FunctionEntry<'a> {
    /// Key, such as `functions.mass` or `experiments[1].functions.damping`.
    pub key: String,
    /// Name of the shared function.
    pub name: &'a str,
    pub kind: CoefficientKind,
    pub spec: Cow<'a, CoefficientSpec>,
    /// Index of the record with its own function; `None` for a shared one.
    pub owner: Option<usize>,
    /// True for a known part.
    pub is_known_part: bool,
}

impl FunctionEntry<'_> {
    /// Width of the law of the coefficient; 0 for laws without one.
    pub fn width(&self) -> Result<f64, BuildError> {
        let key = format!("{}.width", self.key);
        let row = self.kind.row();
        match (row.width, self.spec.width) {
            (Some(_), Some(width)) if width > 0.0 && width.is_finite() => Ok(width),
            (Some(meaning), Some(width)) => Err(BuildError::new(key, "the width must be positive")
                .found(width)
                .expected(format!("greater than 0: {meaning}"))),
            (Some(meaning), None) => Err(BuildError::new(
                &self.key,
                format!("{} needs a width", row.words),
            )
            .expected(format!("`width`: {meaning}"))),
            (None, Some(width)) => Err(BuildError::new(key, format!("{} has no width", row.words))
                .found(width)
                .expected("no `width`")),
            (None, None) => Ok(0.0),
        }
    }
}

/// Coefficient sets, and the set of each record.
pub(super) struct CoefficientSets {
    /// Functions of [`Builder::entries`]; the first set is the shared one.
    pub sets: Vec<CoefficientSet>,
    pub of_record: Vec<usize>,
}

impl Builder {
    /// All functions in the order of the problem: the shared ones, mass first, those of single records, then known parts.
    pub(super) fn entries(&self) -> Vec<FunctionEntry<'_>> {
        let given = self.given();
        let known = (given.iter()).filter_map(|entry| {
            let fixed = entry.spec.known_part.clone()?;
            Some(FunctionEntry {
                key: format!("{}.{KNOWN_PART}", entry.key),
                spec: Cow::Owned(CoefficientSpec {
                    fixed: Some(fixed),
                    ..CoefficientSpec::default()
                }),
                is_known_part: true,
                ..*entry
            })
        });
        let known: Vec<FunctionEntry> = known.collect();
        let has_own = |entry: &FunctionEntry| entry.owner.is_none() || !entry.spec.is_shared();
        let functions = given.into_iter().filter(has_own);
        functions.chain(known).collect()
    }

    /// The specified functions, of all records and of single ones.
    fn given(&self) -> Vec<FunctionEntry<'_>> {
        let shared = self.functions.iter().map(|function| FunctionEntry {
            key: function.key.clone(),
            name: &function.name,
            kind: function.kind,
            spec: Cow::Borrowed(&function.spec),
            owner: None,
            is_known_part: false,
        });
        let own = self.records.iter().enumerate().flat_map(|(i, record)| {
            record
                .coefficients
                .iter()
                .map(move |(kind, spec)| FunctionEntry {
                    key: format!("experiments[{i}].functions.{}", kind.name()),
                    name: kind.name(),
                    kind: *kind,
                    spec: Cow::Borrowed(spec),
                    owner: Some(i),
                    is_known_part: false,
                })
        });
        shared.chain(own).collect()
    }

    /// Coefficient sets of the records.
    pub(super) fn coefficient_sets(&self) -> Result<CoefficientSets, BuildError> {
        let (given, entries) = (self.given(), self.entries());
        for entry in &given {
            entry.spec.form(&entry.key)?;
        }
        self.check_known(&entries)?;
        self.check_stiffness()?;
        let shared: Vec<usize> = (0..self.functions.len()).collect();
        let known_of = |owner: Option<usize>| {
            let known = entries.iter().enumerate();
            known.filter(move |(_, entry)| entry.is_known_part && entry.owner == owner)
        };
        let mut of_shared = Vec::new();
        for (f, entry) in known_of(None) {
            of_shared.push((self.shared_index(entry)?, f));
        }
        let mut found = CoefficientSets {
            sets: vec![self.set_of(shared.clone(), of_shared.clone())],
            of_record: Vec::new(),
        };
        for (i, record) in self.records.iter().enumerate() {
            let (mut set, mut known) = (shared.clone(), of_shared.clone());
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
            // The function of a record replaces the shared one with its known part.
            for entry in given.iter().filter(|entry| entry.owner == Some(i)) {
                let position = self.shared_index(entry)?;
                known.retain(|(other, _)| *other != position);
            }
            for (f, entry) in (entries.iter().enumerate()).filter(|(_, e)| e.owner == Some(i)) {
                let position = self.shared_index(entry)?;
                match entry.is_known_part {
                    true => known.push((position, f)),
                    false => set[position] = f,
                }
            }
            let set = self.set_of(set, known);
            let before = found.sets.iter().position(|s| *s == set);
            found.of_record.push(before.unwrap_or(found.sets.len()));
            if before.is_none() {
                found.sets.push(set);
            }
        }
        check_shared(&entries, &found)?;
        Ok(found)
    }

    /// A coefficient set of functions and known parts, the masses first.
    fn set_of(&self, functions: Vec<usize>, known_parts: Vec<(usize, usize)>) -> CoefficientSet {
        let masses = self
            .functions
            .iter()
            .filter(|f| f.kind == CoefficientKind::MASS);
        let set = CoefficientSet::from(functions).with_inertias(masses.count());
        set.with_known_parts(known_parts)
    }

    /// Error for a known part that is not known, beside a fixed value, or without the likelihood that its standard deviation needs.
    fn check_known(&self, entries: &[FunctionEntry]) -> Result<(), BuildError> {
        for entry in self.given() {
            if entry.spec.known_part.is_some() && entry.spec.fixed.is_some() {
                let problem = "a fixed function has no known part";
                return Err(
                    BuildError::new(format!("{}.{KNOWN_PART}", entry.key), problem)
                        .found("`fixed` and `known_part`")
                        .expected("their sum as `fixed`"),
                );
            }
        }
        let Some(entry) = entries.iter().find(|entry| entry.spec.prior().is_some()) else {
            return Ok(());
        };
        let found = match self.solver {
            Solver::EquationError => Some("method equation-error".to_owned()),
            _ => (self.without_likelihood()).map(|i| format!("no `sigma` in experiments[{i}]")),
        };
        match found {
            Some(found) if !self.is_simulation => {
                let problem =
                    "a known value with a standard deviation needs a likelihood of the samples";
                Err(BuildError::new(&entry.key, problem).found(found).expected(
                    "`sigma` in every experiment and another method, or a number without a standard deviation",
                ))
            }
            _ => Ok(()),
        }
    }

    /// Error for a fixed negative stiffness without a stiffening term: every motion would grow without end.
    fn check_stiffness(&self) -> Result<(), BuildError> {
        let stiffening = [
            CoefficientKind::CUBIC_STIFFNESS,
            CoefficientKind::QUINTIC_STIFFNESS,
        ];
        // Others may hold a spring of a structure.
        let mut kinds = self.functions.iter().map(|function| &function.kind);
        if self.coordinates.len() > 1 || kinds.any(|kind| stiffening.contains(kind)) {
            return Ok(());
        }
        for entry in self.given() {
            let value = match &entry.spec.fixed {
                Some(KnownValue::Number(value)) => Some(*value),
                Some(KnownValue::Map(map)) => map.value,
                _ => None,
            };
            let of_stiffness = value.filter(|_| entry.kind == CoefficientKind::STIFFNESS);
            if let Some(value) = of_stiffness.filter(|value| *value < 0.0) {
                let problem = "a negative stiffness without a term that stiffens: every motion grows without end";
                return Err(BuildError::new(format!("{}.fixed", entry.key), problem)
                    .found(value)
                    .expected("a positive stiffness, or `cubic_stiffness` beside it"));
            }
        }
        Ok(())
    }

    /// Index of the shared function that a record replaces.
    fn shared_index(&self, entry: &FunctionEntry) -> Result<usize, BuildError> {
        let mut names = self.functions.iter().map(|function| &function.name);
        let Some(position) = names.position(|name| name == entry.name) else {
            let name = entry.name;
            return Err(
                BuildError::new(&entry.key, "the system has no such function")
                    .found(format!("`{name}` in one experiment only"))
                    .expected(format!(
                        "`functions.{name}` as well, which the other experiments share; `fixed: 0` where they have none"
                    )),
            );
        };
        if entry.kind != CoefficientKind::COULOMB_FRICTION {
            return entry.width().map(|_| position);
        }
        let shared = self.functions[position].spec.width;
        match entry.spec.width {
            Some(width) if shared != Some(width) => {
                let problem = "the width of Coulomb friction is shared by all experiments";
                Err(BuildError::new(format!("{}.width", entry.key), problem)
                    .found(width)
                    .expected("no `width`, or that of `functions.coulomb_friction`"))
            }
            _ => Ok(position),
        }
    }
}

/// Error if records share no estimated function, or a function applies to no record.
fn check_shared(entries: &[FunctionEntry], found: &CoefficientSets) -> Result<(), BuildError> {
    let users = |f: usize| {
        let uses = |set: &&usize| found.sets[**set].parts().any(|(_, part)| part == f);
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
                .expected(match entry.is_known_part {
                    true => "no `known_part` here, or an experiment without one of its own",
                    false => "an experiment without a separate function, or `fixed` here",
                }),
        ),
        None => Ok(()),
    }
}
