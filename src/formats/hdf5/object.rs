//! Object headers of versions 1 and 2: messages, and attributes among them.

use super::super::bytes::Bytes;
use super::data_type::{Content, DataType};
use super::file::File;
use crate::error::InputError;

/// Types of messages.
pub(super) const DATA_SPACE: u64 = 0x01;
pub(super) const LINK_INFO: u64 = 0x02;
pub(super) const DATA_TYPE: u64 = 0x03;
pub(super) const LINK: u64 = 0x06;
pub(super) const LAYOUT: u64 = 0x08;
pub(super) const FILTERS: u64 = 0x0b;
const ATTRIBUTE: u64 = 0x0c;
const CONTINUATION: u64 = 0x10;
pub(super) const SYMBOL_TABLE: u64 = 0x11;
const KEPT: [u64; 8] = [
    DATA_SPACE,
    LINK_INFO,
    DATA_TYPE,
    LINK,
    LAYOUT,
    FILTERS,
    ATTRIBUTE,
    SYMBOL_TABLE,
];
/// Flag of a message that stands elsewhere.
const SHARED: u64 = 0x02;

const HEADER: &str = "the header of an object";
const ATTRIBUTES: &str = "an attribute";

/// A message of a header.
struct Message<'a> {
    kind: u64,
    data: Bytes<'a>,
}

/// The header of a group or data set.
pub(super) struct Object<'a> {
    messages: Vec<Message<'a>>,
}

impl<'a> Object<'a> {
    /// Reads the header at an address.
    ///
    /// # Errors
    /// When the file ends in it, or its parts refer to each other in a circle.
    pub fn read(file: &File<'a>, address: u64) -> Result<Self, InputError> {
        let mut head = file.at(address, HEADER)?;
        let is_new = head.rest().starts_with(b"OHDR");
        let (size, has_order) = match is_new {
            true => new_prefix(&mut head)?,
            false => (old_prefix(file, &mut head)?, false),
        };
        let mut blocks = vec![head.part(size, HEADER)?];
        let mut messages = Vec::new();
        let least = if is_new { 4 } else { 8 };
        while let Some(mut block) = blocks.pop() {
            file.work(block.left() as u64, HEADER)?;
            while block.left() >= least {
                let kind = block.uint(if is_new { 1 } else { 2 }, HEADER)?;
                let length = block.uint(2, HEADER)?;
                let flags = block.uint(1, HEADER)?;
                block.skip(match (is_new, has_order) {
                    (true, true) => 2,
                    (true, false) => 0,
                    (false, _) => 3,
                });
                let mut data = block.part(length, HEADER)?;
                if kind == CONTINUATION {
                    blocks.push(continuation(file, &mut data, is_new)?);
                } else if KEPT.contains(&kind) && flags & SHARED == 0 {
                    messages.push(Message { kind, data });
                }
            }
        }
        Ok(Self { messages })
    }

    /// Contents of all messages of a type.
    pub fn all(&self, kind: u64) -> impl Iterator<Item = Bytes<'a>> + '_ {
        let own = self.messages.iter().filter(move |m| m.kind == kind);
        own.map(|message| message.data)
    }

    /// Content of the first message of a type.
    pub fn first(&self, kind: u64) -> Option<Bytes<'a>> {
        self.all(kind).next()
    }

    /// True for an object with an attribute of a name.
    ///
    /// # Errors
    /// When an attribute is damaged.
    pub fn has_attribute(&self, file: &File<'a>, name: &str) -> Result<bool, InputError> {
        Ok(self.attribute(file, name)?.is_some())
    }

    /// An attribute of text of fixed length.
    ///
    /// # Errors
    /// When an attribute is damaged.
    pub fn text(&self, file: &File<'a>, name: &str) -> Result<Option<String>, InputError> {
        let Some((kind, mut data)) = self.attribute(file, name)? else {
            return Ok(None);
        };
        if kind.content != Content::Text {
            return Ok(None);
        }
        let text = data.take(kind.size as u64, ATTRIBUTES)?;
        Ok(Some(text_of(text)))
    }

    /// Type and data of an attribute.
    fn attribute(
        &self,
        file: &File<'a>,
        name: &str,
    ) -> Result<Option<(DataType, Bytes<'a>)>, InputError> {
        for mut data in self.all(ATTRIBUTE) {
            let version = data.uint(1, ATTRIBUTES)?;
            data.skip(1);
            let mut sizes = [0; 3];
            for size in &mut sizes {
                *size = data.uint(2, ATTRIBUTES)?;
            }
            // The character set of the name.
            data.skip(usize::from(version == 3));
            let pad = |size: u64| {
                if version == 1 {
                    size.next_multiple_of(8)
                } else {
                    size
                }
            };
            let [own, mut kind, _] = {
                let mut parts = [data; 3];
                for (part, size) in parts.iter_mut().zip(sizes) {
                    *part = data.part(pad(size), ATTRIBUTES)?;
                }
                parts
            };
            if text_of(own.rest()) == name {
                return Ok(Some((DataType::read(file, &mut kind)?, data)));
            }
        }
        Ok(None)
    }
}

/// Text up to the first zero.
pub(super) fn text_of(bytes: &[u8]) -> String {
    let text = bytes.split(|byte| *byte == 0).next();
    String::from_utf8_lossy(text.unwrap_or_default()).into_owned()
}

/// Length of the messages behind the prefix of version 1.
fn old_prefix(file: &File, head: &mut Bytes) -> Result<u64, InputError> {
    let version = head.uint(1, HEADER)?;
    if version != 1 {
        let found = format!("version {version}");
        return Err(file.damaged(HEADER).found(found).expected("version 1 or 2"));
    }
    // Number of messages, of references.
    head.skip(7);
    let size = head.uint(4, HEADER)?;
    head.skip(4);
    Ok(size)
}

/// Length of the messages behind the prefix of version 2, and whether these have numbers of their order.
fn new_prefix(head: &mut Bytes) -> Result<(u64, bool), InputError> {
    head.skip(5);
    let flags = head.uint(1, HEADER)?;
    head.skip(if flags & 0x20 != 0 { 16 } else { 0 });
    head.skip(if flags & 0x10 != 0 { 4 } else { 0 });
    let size = head.uint(1 << (flags & 3), HEADER)?;
    Ok((size, flags & 4 != 0))
}

/// The block of messages that a message refers to.
fn continuation<'a>(
    file: &File<'a>,
    data: &mut Bytes,
    is_new: bool,
) -> Result<Bytes<'a>, InputError> {
    let address = file.address(data, HEADER)?;
    let length = file.length(data, HEADER)?;
    match is_new {
        false => file.at(address, HEADER)?.part(length, HEADER),
        // Behind its letters, and before its checksum.
        true => {
            let mut block = file.node(address, b"OCHK", HEADER)?;
            block.part(length.saturating_sub(8), HEADER)
        }
    }
}
