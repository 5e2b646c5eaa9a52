//! All keys of a model file, for `kmcfit explain` and the JSON schema.

mod explain;
mod schema;

pub use super::key::{KeyDoc, KeyGroup, ValueType, model};
pub use explain::explain;
pub use schema::schema;

/// A key with its paths.
#[derive(Debug, Clone)]
pub struct Found {
    /// The key.
    pub key: &'static KeyDoc,
    /// Its paths, as `functions.mass.start`, without positions in lists.
    pub paths: Vec<String>,
}

/// Every key of a model file with all its paths, each once, in the order of the table.
pub fn all() -> Vec<Found> {
    let mut found = Vec::new();
    collect(model(), "", &mut found);
    found
}

fn collect(group: &'static KeyGroup, above: &str, found: &mut Vec<Found>) {
    for key in group.keys {
        let path = match above {
            "" => key.name.to_owned(),
            above => format!("{above}.{}", key.name),
        };
        match found.iter_mut().find(|f| std::ptr::eq(f.key, key)) {
            Some(same) => same.paths.push(path.clone()),
            None => found.push(Found {
                key,
                paths: vec![path.clone()],
            }),
        }
        for inner in key.kind.groups() {
            collect(inner, &path, found);
        }
    }
}
