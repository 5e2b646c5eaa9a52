//! Columns of a file and their places, from its metadata.

use super::super::number::NumberType;
use super::thrift::Value;

/// Content and remedy of a column that is not read.
type Refusal = (&'static str, Option<&'static str>);

/// A column.
pub(super) struct Column {
    pub name: String,
    /// Position among the columns of a row group.
    pub index: usize,
    pub kind: Result<NumberType, Refusal>,
    /// True for a column with missing values.
    pub is_optional: bool,
}

/// A column in a row group.
pub(super) struct Chunk {
    /// Position of the first page.
    pub begin: usize,
    /// Length of all pages, compressed.
    pub length: usize,
    /// Number of values, with the missing ones.
    pub values: usize,
    pub codec: i64,
}

/// The columns, by the list of nodes of the schema from its root in order of depth.
pub(super) fn columns(metadata: &Value) -> Vec<Column> {
    let mut found: Vec<Column> = Vec::new();
    // Nodes that are left of the nested column.
    let mut nested = 0usize;
    let mut index = 0;
    for node in metadata.list(2).iter().skip(1) {
        let children = node.count(5).unwrap_or(0);
        let is_inner = nested > 0;
        nested = nested.saturating_sub(1).saturating_add(children);
        if !is_inner {
            let is_repeated = node.integer(3) == Some(2);
            found.push(Column {
                name: node.text(4).unwrap_or_default(),
                index,
                kind: match children > 0 || is_repeated {
                    true => Err(("a nested column", None)),
                    false => number_type(node),
                },
                is_optional: node.integer(3) == Some(1),
            });
        }
        if children == 0 {
            index += 1;
        }
    }
    found
}

/// Places of a column in all row groups; `None` for one that the metadata do not state.
pub(super) fn chunks<'a>(
    metadata: &'a Value,
    index: usize,
) -> impl Iterator<Item = Option<Chunk>> + 'a {
    metadata.list(4).iter().map(move |group| {
        let data = group.list(1).get(index)?.field(3)?;
        let first = data.count(9)?;
        let dictionary = data.count(11).filter(|at| *at > 0);
        Some(Chunk {
            begin: dictionary.map_or(first, |at| at.min(first)),
            length: data.count(7)?,
            values: data.count(5)?,
            codec: data.integer(4)?,
        })
    })
}

/// Type of the numbers of a column.
fn number_type(node: &Value) -> Result<NumberType, Refusal> {
    const IN_SECONDS: &str = "save seconds, in Python `t = (t - t.iloc[0]).dt.total_seconds()`";
    // The first field of the logical type, else the older converted type.
    let logical = match node.field(10) {
        Some(Value::Struct(fields)) => fields.first().map(|(number, _)| *number),
        _ => None,
    };
    match (logical, node.integer(6)) {
        (Some(6..=8), _) | (None, Some(6..=10)) => {
            return Err(("dates or times of day", Some(IN_SECONDS)));
        }
        (Some(5), _) | (None, Some(5)) => {
            return Err((
                "decimal numbers",
                Some("save them as floating point numbers"),
            ));
        }
        _ => {}
    }
    Ok(match (node.integer(1), node.integer(6)) {
        (Some(1), Some(13)) => NumberType::U32,
        (Some(1), _) => NumberType::I32,
        (Some(2), Some(14)) => NumberType::U64,
        (Some(2), _) => NumberType::I64,
        (Some(4), _) => NumberType::F32,
        (Some(5), _) => NumberType::F64,
        (Some(0), _) => return Err(("truth values", None)),
        (Some(3), _) => return Err(("dates or times of day", Some(IN_SECONDS))),
        _ => return Err(("texts", None)),
    })
}
