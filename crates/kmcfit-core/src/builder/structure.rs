//! Structures: the functions of coordinates and elements, and the rows of coordinates that names state.

use super::coefficient_sets::Function;
use super::{BuildError, Builder, listed};
use crate::functions::CoefficientKind;
use crate::model::{BasisName, CoefficientSpec, StructureSpec};
use crate::number_format::and_list;
use crate::structure::Ends;

/// The end that does not move relative to the base.
const GROUND: &str = "ground";

impl Builder {
    /// A structure of several coordinates, integrated by RK4: its functions are the masses, then the coefficients of the elements, in the
    /// order of `spec`.
    ///
    /// # Errors
    /// Without a coordinate, for a name that cannot stand in a key, an element without law or ends, and a part that no element joins to
    /// the ground.
    pub fn structure(spec: &StructureSpec) -> Result<Self, BuildError> {
        let mut builder = Self::of(Vec::new());
        for (name, _) in &spec.coordinates.0 {
            check_name("structure.coordinates", name)?;
            builder.coordinates.push(name.clone());
        }
        if builder.coordinates.is_empty() {
            let problem = "a structure has at least one coordinate";
            return Err(BuildError::new("structure.coordinates", problem)
                .expected("`{floor_1: {mass: {fixed: 1.0}}}`"));
        }
        for (j, (name, coordinate)) in spec.coordinates.0.iter().enumerate() {
            builder.functions.push(Function {
                key: format!("structure.coordinates.{name}.mass"),
                name: format!("{name}.mass"),
                kind: CoefficientKind::MASS,
                spec: constant_unless_stated(&coordinate.mass),
                ends: Ends::ground(j),
            });
        }
        for (name, element) in &spec.elements.0 {
            check_name("structure.elements", name)?;
            let key = format!("structure.elements.{name}");
            let [(kind, ends)] = element.laws.as_slice() else {
                let laws = CoefficientKind::ALL.into_iter();
                let laws: Vec<&str> = laws.filter_map(|kind| kind.row().element).collect();
                return Err(BuildError::new(key, "an element has one law")
                    .found(match element.laws.len() {
                        0 => "none".to_owned(),
                        laws => format!("{laws} laws"),
                    })
                    .expected(format!("one of {}, with its two ends", laws.join(", "))));
            };
            let law = kind.row().element.unwrap_or_default();
            let ends = builder.row(&format!("{key}.{law}"), ends, 2)?;
            builder.functions.push(Function {
                key,
                name: name.clone(),
                kind: *kind,
                spec: constant_unless_stated(&element.coefficient),
                ends,
            });
        }
        builder.check_floating()?;
        Ok(builder)
    }

    /// Index of a coordinate.
    pub(super) fn coordinate(&self, key: &str, name: &str) -> Result<usize, BuildError> {
        let position = self.coordinates.iter().position(|other| other == name);
        position.ok_or_else(|| {
            BuildError::new(key, "the structure has no such coordinate")
                .found(format!("`{name}`"))
                .expected(format!(
                    "one of {}",
                    listed(self.coordinates.iter().map(String::as_str))
                ))
        })
    }

    /// The row of `names` at `key`, of which there are at most `most`: a coordinate, the second of two ends less the first, or the elongation
    /// of an element; the first coordinate where there are none.
    pub(super) fn row(&self, key: &str, names: &[String], most: usize) -> Result<Ends, BuildError> {
        let is_element = |function: &&Function| Some(&function.name) == names.first();
        let end = |name: &String| match name == GROUND {
            true => Ok(None),
            false => self.coordinate(key, name).map(Some),
        };
        match names {
            [] => Ok(Ends::ground(0)),
            [_] if most == 1 || self.coordinates.contains(&names[0]) => {
                Ok(Ends::ground(self.coordinate(key, &names[0])?))
            }
            [one] => match self.functions.iter().find(is_element) {
                Some(element) if most == 2 => Ok(element.ends.clone()),
                _ => self.coordinate(key, one).map(Ends::ground),
            },
            [from, to] if from != to => {
                let ends = [(end(from)?, -1.0), (end(to)?, 1.0)];
                let ends = ends
                    .into_iter()
                    .filter_map(|(j, factor)| Some((j?, factor)));
                Ok(Ends::combination(ends))
            }
            _ => Err(BuildError::new(key, "the ends must be two different ones")
                .found(listed(names.iter().map(String::as_str)))
                .expected("two of the coordinates and `ground`, such as [ground, floor_1]")),
        }
    }

    /// Error for coordinates that no chain of elements joins to the ground.
    fn check_floating(&self) -> Result<(), BuildError> {
        let mut held = vec![false; self.coordinates.len()];
        let elements = || {
            self.functions
                .iter()
                .filter(|f| f.kind != CoefficientKind::MASS)
        };
        let mut changes = true;
        while changes {
            changes = false;
            for element in elements() {
                let entries = element.ends.entries();
                if entries.len() < 2 || entries.iter().any(|(j, _)| held[*j]) {
                    for (j, _) in entries {
                        changes |= !std::mem::replace(&mut held[*j], true);
                    }
                }
            }
        }
        let floating = self
            .coordinates
            .iter()
            .zip(&held)
            .filter(|(_, held)| !**held);
        let floating: Vec<&str> = floating.map(|(name, _)| name.as_str()).collect();
        match floating.first() {
            None => Ok(()),
            Some(first) => Err(BuildError::new(
                format!("structure.coordinates.{first}"),
                "no elements join this part of the structure to the ground",
            )
            .found(and_list(
                &floating
                    .iter()
                    .map(|name| format!("`{name}`"))
                    .collect::<Vec<_>>(),
            ))
            .expected("an element between this part and `ground` or the rest of the structure")),
        }
    }
}

/// The coefficient, constant where it has a start without a basis.
fn constant_unless_stated(given: &CoefficientSpec) -> CoefficientSpec {
    let is_free = given.fixed.is_none() && given.start.is_some();
    let constant = Some(BasisName::Constant).filter(|_| is_free);
    CoefficientSpec {
        basis: given.basis.or(constant),
        ..given.clone()
    }
}

/// Error for a name that is not a word of letters, digits, `_` and `-`, or that is the ground.
fn check_name(key: &str, name: &str) -> Result<(), BuildError> {
    let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
    match name.chars().all(is_word) && !name.is_empty() && name != GROUND {
        true => Ok(()),
        false => Err(BuildError::new(key, "this name cannot be used")
            .found(format!("`{name}`"))
            .expected("letters, digits, `_` and `-`, and not `ground`")),
    }
}
