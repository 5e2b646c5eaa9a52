//! Decoding of the bytes of a table: UTF-8, UTF-16, or Windows-1252.

use std::fmt;
use std::path::Path;

use encoding_rs::{UTF_16BE, UTF_16LE, WINDOWS_1252};

use crate::error::InputError;

/// Character encoding of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// UTF-8, with or without a byte order mark; includes ASCII.
    Utf8,
    /// UTF-16 with a byte order mark.
    Utf16,
    /// Windows-1252, assumed for bytes that are not UTF-8; includes the letters of Latin-1.
    Windows1252,
}

impl fmt::Display for Encoding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Utf8 => "UTF-8",
            Self::Utf16 => "UTF-16",
            Self::Windows1252 => "Windows-1252",
        })
    }
}

/// Decodes bytes; removes the byte order mark.
///
/// # Errors
///
/// When the bytes are not text: invalid UTF-16, or a zero byte.
pub fn decode(path: &Path, bytes: Vec<u8>) -> Result<(String, Encoding), InputError> {
    for (mark, encoding) in [([0xff, 0xfe], UTF_16LE), ([0xfe, 0xff], UTF_16BE)] {
        if bytes.starts_with(&mark) {
            let (text, broken) = encoding.decode_with_bom_removal(&bytes);
            return match broken {
                true => Err(InputError::file(path, "the file is not text")
                    .found("a byte order mark of UTF-16, but no UTF-16 text behind it")
                    .hint("save it as UTF-8")),
                false => Ok((text.into_owned(), Encoding::Utf16)),
            };
        }
    }
    let (text, encoding) = match String::from_utf8(bytes) {
        Ok(text) => (without_mark(text), Encoding::Utf8),
        Err(error) => {
            let (text, _) = WINDOWS_1252.decode_without_bom_handling(error.as_bytes());
            (text.into_owned(), Encoding::Windows1252)
        }
    };
    match text.find('\0') {
        Some(at) => Err(InputError::after(path, &text[..at], "the file is not text")
            .found("the byte 0x00")
            .hint("is it a binary file, or UTF-16 without a byte order mark? Save it as text in UTF-8")),
        None => Ok((text, encoding)),
    }
}

fn without_mark(text: String) -> String {
    match text.strip_prefix('\u{feff}') {
        Some(rest) => rest.to_owned(),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> (String, Encoding) {
        decode(Path::new("t.csv"), bytes.to_vec()).unwrap()
    }

    #[test]
    fn encodings_are_detected() {
        let text = "m/s²".to_owned();
        assert_eq!(read("m/s²".as_bytes()), (text.clone(), Encoding::Utf8));
        assert_eq!(
            read("\u{feff}m/s²".as_bytes()),
            (text.clone(), Encoding::Utf8)
        );
        assert_eq!(read(b"m/s\xb2"), (text.clone(), Encoding::Windows1252));
        assert_eq!(
            read(b"\xff\xfem\0/\0s\0\xb2\0"),
            (text.clone(), Encoding::Utf16)
        );
        assert_eq!(read(b"\xfe\xff\0m\0/\0s\0\xb2"), (text, Encoding::Utf16));
    }

    #[test]
    fn files_that_are_not_text_are_refused() {
        let message = |bytes: &[u8]| {
            let error = decode(Path::new("t.csv"), bytes.to_vec()).unwrap_err();
            error.to_string()
        };
        assert!(message(b"t,y\n0,\0").starts_with("t.csv:2:3: the file is not text"));
        assert!(message(b"\xff\xfe\0\xd8t\0").starts_with("t.csv: the file is not text"));
    }
}
