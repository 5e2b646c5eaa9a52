//! No input makes the readers panic.

use kmcfit::config::ModelFile;
use kmcfit::config::key_positions::{key_path, locate};
use kmcfit::tables::{ColumnName, Table, TableFormat, times};
use proptest::collection::vec;
use proptest::prelude::*;

use crate::model::FULL;
use crate::properties::properties;

const CSV: &str = "# made by hand\nt,\"y\",note\r\n0,1,a\n\n0.1, 2 ,\"b, c\"\n0.2,3,\n";

const INSTRUMENT: &str = "Rig 7\nRate;1000\n\nt [s];a\ns;m/s²\n0,0;1,5\n0,1;\n# x\n0,2;NaN\n";

/// Fragments of syntax that are inserted into a text.
const PIECES: &[&str] = &[
    "{",
    "}",
    "[",
    "]",
    ":",
    ": ",
    "- ",
    ",",
    "\n",
    "\t",
    "  ",
    "\"",
    "'",
    "&a ",
    "*a",
    "!t ",
    "!!float ",
    "!!null ",
    "#",
    " #",
    "---\n",
    "...\n",
    "|\n",
    ">\n",
    "? ",
    "<<: ",
    "~",
    "null",
    ".nan",
    "1e999",
    "é",
    "\u{feff}",
    "\r",
    "\0",
    "%",
    "@",
    "\\",
    "\"\\x02\"",
    "`",
    "99999999999999999999999",
    "mass",
    "format: 1\n",
];

/// Inserts fragments into a text, or removes parts of it.
fn mutate(text: &str, changes: &[(usize, usize, usize)]) -> String {
    let mut chars: Vec<char> = text.chars().collect();
    for &(at, length, piece) in changes {
        let begin = at % (chars.len() + 1);
        let end = (begin + length).min(chars.len());
        let piece = PIECES[piece % PIECES.len()].chars();
        chars.splice(begin..end, piece);
    }
    chars.into_iter().collect()
}

fn changes() -> impl Strategy<Value = Vec<(usize, usize, usize)>> {
    vec((0..4000usize, 0..12usize, 0..PIECES.len()), 1..6)
}

/// Reads a model; its message must be printable text, and later errors must have a location.
fn read_model(text: &str) {
    match ModelFile::parse("m.yaml", text) {
        Ok(model) => {
            let error = model.error_at("functions.mass.start", "wrong").to_string();
            assert!(error.starts_with("m.yaml:"), "{error}");
        }
        Err(error) => {
            let error = error.to_string();
            assert!(error.starts_with("m.yaml"), "{error}");
            assert!(!error.contains(['\u{2}', '\u{1f}']), "{error:?}");
        }
    }
    for path in [
        "",
        "experiments[0].initial",
        "functions.mass.start",
        "a[1][2]",
    ] {
        locate(text, &key_path(path));
    }
}

fn read_table(bytes: &[u8]) {
    let any = TableFormat::default();
    for format in [
        any,
        TableFormat {
            delimiter: Some(' '),
            units_row: Some(true),
            ..any
        },
        TableFormat {
            decimal: Some(','),
            skip: Some(2),
            ..any
        },
        TableFormat {
            header: Some(false),
            units_row: Some(true),
            ..any
        },
        TableFormat {
            header: Some(true),
            ..any
        },
    ] {
        read_table_with(bytes, &format);
    }
}

fn read_table_with(bytes: &[u8], format: &TableFormat) {
    if let Ok(table) = Table::parse_with("t.csv", bytes, format) {
        assert!(!table.format_in_words().is_empty());
        assert!(table.rows() > 0);
        for index in 0..table.width() {
            assert_eq!(table.find(&ColumnName::Number(index + 1)), Ok(index));
            table.unit(index);
            if let Ok(samples) = table.samples(index) {
                assert_eq!(samples.len(), table.rows());
            }
        }
        assert!(table.values(table.width()).is_err());
        assert_eq!(table.rows(), table.lines().len());
        assert!(table.lines().is_sorted());
        for name in table.headers() {
            if let Ok(values) = table.column(name) {
                assert_eq!(values.len(), table.rows());
            }
            let _ = times::equally_spaced(&table, name);
        }
        let _ = table.column("no such column");
    }
}

proptest! {
    #![proptest_config(properties(1000, 1))]

    #[test]
    fn models_with_mistakes(changes in changes()) {
        read_model(&mutate(FULL, &changes));
    }

    #[test]
    fn pieces_of_yaml(pieces in vec(0..PIECES.len(), 0..40)) {
        read_model(&pieces.into_iter().map(|piece| PIECES[piece]).collect::<String>());
    }

    #[test]
    fn any_text(text in any::<String>()) {
        read_model(&text);
        read_table(text.as_bytes());
        locate(FULL, &key_path(&text));
    }

    #[test]
    fn tables_with_mistakes(changes in changes()) {
        read_table(mutate(CSV, &changes).as_bytes());
        read_table(mutate(INSTRUMENT, &changes).as_bytes());
    }

    #[test]
    fn any_bytes(bytes in vec(any::<u8>(), 0..200)) {
        read_table(&bytes);
    }
}
