//! Fields of the elements of HDF5, and the values of attributes.

use hdf5_pure::{AttrValue, Datatype};

use super::hdf5_number::Number;
use crate::error::InputError;
use std::collections::HashMap;

/// Why a data set is not read.
pub(super) enum Unread {
    /// Content, as a noun, and remedy.
    Content(String, Option<&'static str>),
    /// A structure that the library does not read, or damage.
    Library(String),
    /// The file as a whole is refused.
    File(InputError),
}

impl From<hdf5_pure::Error> for Unread {
    fn from(error: hdf5_pure::Error) -> Self {
        Self::Library(one_line(&error))
    }
}

impl From<InputError> for Unread {
    fn from(error: InputError) -> Self {
        Self::File(error)
    }
}

pub(super) fn content(noun: &str, hint: Option<&'static str>) -> Unread {
    Unread::Content(noun.to_owned(), hint)
}

pub(super) fn one_line(error: &hdf5_pure::Error) -> String {
    error.to_string().replace('\n', " ")
}

pub(super) type Attributes = HashMap<String, AttrValue>;

/// Most numbers of a field.
const WIDEST: u32 = 1000;

pub(super) fn is_text(kind: &Datatype) -> bool {
    matches!(
        kind,
        Datatype::String { .. }
            | Datatype::VariableLength {
                is_string: true,
                ..
            }
    )
}

/// Name, form and place of the numbers of an element, without a name for one that is a number itself; `None` for references.
#[expect(clippy::type_complexity, reason = "named once")]
pub(super) fn fields(
    kind: &Datatype,
) -> Result<Option<Vec<(Option<String>, Number, usize)>>, Unread> {
    let members = match kind {
        Datatype::Reference { .. } => return Ok(None),
        Datatype::Compound { members, .. } => members,
        kind if is_text(kind) => return Err(content("texts", None)),
        kind => {
            let number = Number::of(kind);
            let number =
                number.ok_or_else(|| content("data of another type than numbers", None))?;
            return Ok(Some(vec![(None, number, 0)]));
        }
    };
    if (members.first()).is_some_and(|first| ["r", "real"].contains(&first.name.as_str())) {
        let hint = "save the real samples in time, for instance `real(x)`";
        return Err(content("complex numbers", Some(hint)));
    }
    let mut numbers = Vec::new();
    for member in members {
        let at = usize::try_from(member.byte_offset).unwrap_or(usize::MAX);
        let Datatype::Array {
            base_type,
            dimensions,
        } = &member.datatype
        else {
            let number = Number::of(&member.datatype);
            numbers.extend(number.map(|number| (Some(member.name.clone()), number, at)));
            continue;
        };
        // A field of several numbers, as in the tables of pandas.
        let count = dimensions
            .iter()
            .fold(1, |n: u32, of| n.saturating_mul(*of));
        if let Some(number) = Number::of(base_type) {
            numbers.extend((0..count.min(WIDEST) as usize).map(|i| {
                let name = format!("{}.{}", member.name, i + 1);
                (Some(name), number, at.saturating_add(i * number.size))
            }));
        }
    }
    match numbers.is_empty() {
        true => Err(content("a table without numbers", None)),
        false => Ok(Some(numbers)),
    }
}

/// The numbers of an attribute, also of one that is a text.
pub(super) fn numbers(value: &AttrValue) -> Vec<f64> {
    let integers = || Some(value.to_i64s()?.into_iter().map(|x| x as f64).collect());
    let texts = || {
        value
            .as_strings()?
            .iter()
            .map(|text| text.trim().parse().ok())
            .collect()
    };
    value
        .to_f64s()
        .or_else(integers)
        .or_else(texts)
        .unwrap_or_default()
}

/// What attributes state, in the order of their names.
pub(super) fn statements(attributes: &Attributes) -> Vec<(&String, Vec<String>)> {
    let mut all: Vec<(&String, &AttrValue)> = attributes.iter().collect();
    all.sort_by_key(|(name, _)| *name);
    let text = |value: &AttrValue| match value.as_strings() {
        Some(texts) => texts.to_vec(),
        None => numbers(value).iter().map(ToString::to_string).collect(),
    };
    all.into_iter()
        .map(|(name, value)| (name, text(value)))
        .collect()
}
