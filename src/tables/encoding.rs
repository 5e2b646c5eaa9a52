//! Decoding of the bytes of a table: UTF-8, UTF-16, or Windows-1252.

use std::fmt;
use std::path::Path;

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
    let utf_16 = match bytes.as_slice() {
        [0xff, 0xfe, units @ ..] => Some(utf_16(units, u16::from_le_bytes)),
        [0xfe, 0xff, units @ ..] => Some(utf_16(units, u16::from_be_bytes)),
        _ => None,
    };
    match utf_16 {
        None => {}
        Some(Some(text)) => return Ok((text, Encoding::Utf16)),
        Some(None) => {
            return Err(InputError::file(path, "the file is not text")
                .found("a byte order mark of UTF-16, but no UTF-16 text behind it")
                .hint("save it as UTF-8"));
        }
    }
    let (text, encoding) = match String::from_utf8(bytes) {
        Ok(text) => (without_mark(text), Encoding::Utf8),
        Err(error) => {
            let text = error.as_bytes().iter().map(|byte| windows_1252(*byte));
            (text.collect(), Encoding::Windows1252)
        }
    };
    match memchr::memchr(0, text.as_bytes()) {
        Some(at) => Err(InputError::after(path, &text[..at], "the file is not text")
            .found("the byte 0x00")
            .hint("is it a binary file, or UTF-16 without a byte order mark? Save it as text in UTF-8")),
        None => Ok((text, encoding)),
    }
}

/// Text of the 16-bit `units`, without a byte order mark; `None` for an odd number of bytes or a lone surrogate.
fn utf_16(units: &[u8], unit: fn([u8; 2]) -> u16) -> Option<String> {
    let (pairs, rest) = units.as_chunks();
    let characters = char::decode_utf16(pairs.iter().map(|pair| unit(*pair)));
    rest.is_empty()
        .then(|| characters.collect::<Result<_, _>>().ok())
        .flatten()
}

/// Character of a byte in Windows-1252.
///
/// Source: WHATWG Encoding Standard, index windows-1252.
fn windows_1252(byte: u8) -> char {
    /// Characters of the bytes 0x80 to 0x9f; those without one are the control characters of Latin-1.
    const OTHERS: [char; 32] = [
        '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž',
        '\u{8f}', '\u{90}', '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}',
        'ž', 'Ÿ',
    ];
    match byte {
        0x80..=0x9f => OTHERS[usize::from(byte - 0x80)],
        latin_1 => char::from(latin_1),
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

    /// Prices, quotes and dashes are outside of Latin-1; a character beyond 16 bits has two units.
    #[test]
    fn characters_beyond_latin_1() {
        assert_eq!(
            read(b"\x80 5 \x96 \x84Gr\xf6\xdfe\x93\x99 \x81\x9f\xff"),
            ("€ 5 – „Größe“™ \u{81}Ÿÿ".to_owned(), Encoding::Windows1252)
        );
        assert_eq!(
            read(b"\xfe\xff\xd8\x35\xdc\x9f\x03\xa9"),
            ("𝒟Ω".to_owned(), Encoding::Utf16)
        );
    }

    #[test]
    fn files_that_are_not_text_are_refused() {
        let message = |bytes: &[u8]| {
            let error = decode(Path::new("t.csv"), bytes.to_vec()).unwrap_err();
            error.to_string()
        };
        assert!(message(b"t,y\n0,\0").starts_with("t.csv:2:3: the file is not text"));
        for broken in [
            &b"\xff\xfe\0\xd8t\0"[..],
            b"\xff\xfet\0,",
            b"\xfe\xff\0t\xdc\x9f",
        ] {
            assert!(
                message(broken).starts_with("t.csv: the file is not text"),
                "{broken:?}"
            );
        }
    }
}
