//! The public API, name by name.

use std::collections::BTreeSet;

/// `api.txt` lists what `src/lib.rs` exports: a new name is added to both.
#[test]
fn the_public_names_are_those_of_the_list() {
    let source = include_str!("../src/lib.rs");
    let list: BTreeSet<&str> = include_str!("../api.txt").lines().collect();
    let exports = source.split("\npub use ").skip(1).map(|rest| {
        let (path, _) = rest.split_once(';').expect("the end of an export");
        path.split_once("::").expect("a module").1
    });
    let is_separator = |c: char| !c.is_alphanumeric() && c != '_';
    let names = exports.flat_map(|names| names.split(is_separator));
    let names: BTreeSet<&str> = names.filter(|name| !name.is_empty()).collect();
    assert_eq!(names, list);
}
