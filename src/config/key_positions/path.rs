//! Paths of keys into a YAML file.

/// One step of a path into a YAML file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Segment {
    /// Into a map, by key.
    Key(String),
    /// Into a list, by position from 0.
    Index(usize),
}

/// Splits a path such as `experiments[0].initial.velocity` into segments.
///
/// A malformed index is part of a key.
pub fn key_path(path: &str) -> Vec<Segment> {
    let mut segments = Vec::new();
    for part in path.split('.').filter(|part| !part.is_empty()) {
        let (key, indices) = split_indices(part);
        if !key.is_empty() {
            segments.push(Segment::Key(key.to_owned()));
        }
        segments.extend(indices.into_iter().map(Segment::Index));
    }
    segments
}

/// `list[1][2]` as `list` and `[1, 2]`.
fn split_indices(part: &str) -> (&str, Vec<usize>) {
    let mut key = part;
    let mut indices = Vec::new();
    while let Some((before, index)) = key.strip_suffix(']').and_then(|rest| rest.rsplit_once('['))
        && let Ok(index) = index.parse()
    {
        indices.insert(0, index);
        key = before;
    }
    (key, indices)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_taken_apart() {
        use Segment::{Index, Key};
        let key = |name: &str| Key(name.to_owned());
        assert_eq!(key_path(""), []);
        assert_eq!(key_path("a.b"), [key("a"), key("b")]);
        assert_eq!(
            key_path("a[0][12].b"),
            [key("a"), Index(0), Index(12), key("b")]
        );
        assert_eq!(key_path("[3]"), [Index(3)]);
        assert_eq!(key_path("a[x]"), [key("a[x]")]);
    }
}
