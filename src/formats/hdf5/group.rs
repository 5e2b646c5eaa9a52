//! Members of a group: in a symbol table, or as links in its header.

use super::super::budget::Budget;
use super::super::bytes::Bytes;
use super::file::File;
use super::joined;
use super::object::{LINK, LINK_INFO, Object, SYMBOL_TABLE, text_of};
use crate::error::InputError;

const TABLE: &str = "the members of a group";
/// Cache type of a symbolic link, which has no address.
const SYMBOLIC: u64 = 2;

/// Members of a group.
pub(super) enum Members {
    /// Names and addresses of the headers.
    Listed(Vec<(String, u64)>),
    /// In a heap with a B-tree of version 2.
    Dense,
}

/// True for the header of a group.
pub(super) fn is_group(object: &Object) -> bool {
    let kinds = [SYMBOL_TABLE, LINK_INFO, LINK];
    kinds.into_iter().any(|kind| object.first(kind).is_some())
}

/// The members of the group `group`; each counts against the budget with its path.
///
/// # Errors
/// When the group is damaged, or has too many members.
pub(super) fn members(
    file: &File,
    object: &Object,
    group: &str,
    budget: &mut Budget,
) -> Result<Members, InputError> {
    if let Some(mut info) = object.first(LINK_INFO) {
        let flags = info.uint(2, TABLE)? >> 8;
        info.skip(if flags & 1 != 0 { 8 } else { 0 });
        if !file.is_undefined(file.address(&mut info, TABLE)?) {
            return Ok(Members::Dense);
        }
    }
    let mut found = Vec::new();
    let mut add = |name: String, address: u64| {
        budget.name(&joined(group, &name))?;
        found.push((name, address));
        Ok(())
    };
    for mut link in object.all(LINK) {
        if let Some((name, address)) = hard_link(file, &mut link)? {
            add(name, address)?;
        }
    }
    if let Some(mut table) = object.first(SYMBOL_TABLE) {
        let tree = file.address(&mut table, TABLE)?;
        let names = heap(file, file.address(&mut table, TABLE)?)?;
        node(file, tree, names, None, &mut add)?;
    }
    Ok(Members::Listed(found))
}

/// Name and address of a link in a header; `None` for a symbolic or external one.
fn hard_link(file: &File, link: &mut Bytes) -> Result<Option<(String, u64)>, InputError> {
    link.skip(1);
    let flags = link.uint(1, TABLE)?;
    let kind = if flags & 8 != 0 {
        link.uint(1, TABLE)?
    } else {
        0
    };
    link.skip(if flags & 4 != 0 { 8 } else { 0 });
    link.skip(if flags & 0x10 != 0 { 1 } else { 0 });
    let length = link.uint(1 << (flags & 3), TABLE)?;
    let name = text_of(link.take(length, TABLE)?);
    Ok(match kind {
        0 => Some((name, file.address(link, TABLE)?)),
        _ => None,
    })
}

/// The local heap with the names.
fn heap<'a>(file: &File<'a>, address: u64) -> Result<Bytes<'a>, InputError> {
    let mut heap = file.node(address, b"HEAP", TABLE)?;
    heap.skip(4);
    let size = file.length(&mut heap, TABLE)?;
    file.length(&mut heap, TABLE)?;
    let data = file.address(&mut heap, TABLE)?;
    file.at(data, TABLE)?.part(size, TABLE)
}

/// A node of the B-tree, and all below it; levels decrease by one from the given one.
fn node(
    file: &File,
    address: u64,
    names: Bytes,
    level: Option<u64>,
    add: &mut dyn FnMut(String, u64) -> Result<(), InputError>,
) -> Result<(), InputError> {
    let mut node = file.node(address, b"TREE", TABLE)?;
    let kind = node.uint(1, TABLE)?;
    let own = node.uint(1, TABLE)?;
    if kind != 0 || level.is_some_and(|level| own != level) {
        let found = format!("a node of type {kind} at level {own}");
        return Err(file.damaged(TABLE).found(found));
    }
    let count = node.uint(2, TABLE)?;
    file.work(8 * count, TABLE)?;
    file.address(&mut node, TABLE)?;
    file.address(&mut node, TABLE)?;
    for _ in 0..count {
        file.length(&mut node, TABLE)?;
        let child = file.address(&mut node, TABLE)?;
        match own {
            0 => symbols(file, child, names, add)?,
            _ => self::node(file, child, names, Some(own - 1), add)?,
        }
    }
    Ok(())
}

/// The members in a leaf.
fn symbols(
    file: &File,
    address: u64,
    names: Bytes,
    add: &mut dyn FnMut(String, u64) -> Result<(), InputError>,
) -> Result<(), InputError> {
    let mut leaf = file.node(address, b"SNOD", TABLE)?;
    leaf.skip(2);
    let count = leaf.uint(2, TABLE)?;
    file.work(24 * count, TABLE)?;
    for _ in 0..count {
        let at = file.address(&mut leaf, TABLE)?;
        let header = file.address(&mut leaf, TABLE)?;
        let cache = leaf.uint(4, TABLE)?;
        leaf.take(20, TABLE)?;
        let at = usize::try_from(at).ok();
        let name = at.and_then(|at| names.rest().get(at..)).ok_or_else(|| {
            file.damaged(TABLE)
                .found("a name outside of the list of names")
        })?;
        if cache != SYMBOLIC {
            // A name that is too long is refused by the budget.
            let name = name.get(..2048).unwrap_or(name);
            add(text_of(name), header)?;
        }
    }
    Ok(())
}
