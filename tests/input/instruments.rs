//! Tables as instruments and spreadsheets write them.

use kmcfit::tables::{ColumnName, Encoding, Table, TableFormat};

const ANY: TableFormat = TableFormat {
    delimiter: None,
    decimal: None,
    skip: None,
    header: None,
    units_row: None,
};

fn table(text: impl AsRef<[u8]>) -> Table {
    Table::parse("t.csv", text.as_ref()).unwrap()
}

fn table_with(text: &str, format: &TableFormat) -> Table {
    Table::parse_with("t.csv", text.as_bytes(), format).unwrap()
}

/// Detected separators, the lines of names and units, and the lines of the data.
fn found(table: &Table) -> (char, char, Option<usize>, Option<usize>, &[usize]) {
    let format = table.text_format().expect("a text");
    (
        format.delimiter,
        format.decimal,
        format.header,
        format.units_row,
        table.lines(),
    )
}

#[test]
fn delimiters_and_decimal_signs_are_detected() {
    for (text, delimiter, decimal) in [
        ("t,y\n0.5,-1.5\n1.0,2.5\n", ',', '.'),
        ("t;y\n0,5;-1,5\n1,0;2,5\n", ';', ','),
        ("t;y\n0.5;-1.5\n1.0;2.5\n", ';', '.'),
        ("t\ty\n0.5\t-1.5\n1.0\t2.5\n", '\t', '.'),
        ("t\ty\n0,5\t-1,5\n1,0\t2,5\n", '\t', ','),
        ("  t     y\n 0.5  -1.5\n 1.0   2.5\n", ' ', '.'),
        ("  t   \t y\n 0,5 \t \t-1,5\n 1,0   2,5\n", ' ', ','),
        ("t , y\n0.5 , -1.5\n1.0 , 2.5\n", ',', '.'),
        ("t; y\r\n0,5; -1,5\r\n\r\n1,0; 2,5\r\n", ';', ','),
        ("t;y\r0,5;-1,5\r1,0;2,5\r", ';', ','),
        ("\"t\";\"y\"\n\"0,5\";\"-1,5\"\n\"1,0\";\"2,5\"\n", ';', ','),
    ] {
        let table = table(text);
        let format = table.text_format().expect("a text");
        assert_eq!(
            (format.delimiter, format.decimal),
            (delimiter, decimal),
            "{text:?}"
        );
        assert_eq!(table.headers(), ["t", "y"], "{text:?}");
        assert_eq!(table.column("t").unwrap(), [0.5, 1.0], "{text:?}");
        assert_eq!(table.column("y").unwrap(), [-1.5, 2.5], "{text:?}");
    }
}

#[test]
fn whole_numbers_do_not_hide_the_delimiter() {
    let table = table("t;y\n0;1\n1;2,5\n2;3\n");
    assert_eq!(found(&table), (';', ',', Some(1), None, &[2, 3, 4][..]));
    assert_eq!(table.column("y").unwrap(), [1.0, 2.5, 3.0]);
}

#[test]
fn preambles_are_skipped() {
    let logger = "\
Data logger XY-7
Date;03.05.2024
Sample rate: 1000 Hz
Channels;2

# free decay
Time;Acceleration
s;m/s²
0,000;1,5
0,001;1,25
";
    let table = table(logger);
    assert_eq!(found(&table), (';', ',', Some(7), Some(8), &[9, 10][..]));
    assert_eq!(table.headers(), ["Time", "Acceleration"]);
    assert_eq!((table.unit(0), table.unit(1)), (Some("s"), Some("m/s²")));
    assert_eq!(table.column("Acceleration").unwrap(), [1.5, 1.25]);
    assert_eq!(
        table.format_in_words(),
        "UTF-8; separated by semicolons; decimal comma; column names in line 7; units in line 8"
    );
    assert_eq!(table.text_format().expect("a text").skipped, 6);
}

#[test]
fn a_preamble_of_commas_ends_at_the_names() {
    let scope = "\
Model,DSO-X 3024\nSerial,12345\nStart,2024-05-03,10:15\nx-axis,1,2\nsecond,Volt,Volt
0.0,1.0,2.0\n0.1,1.1,2.1\n";
    // `Volt` twice: two columns with the same name, unless the line has the units.
    let format = TableFormat {
        units_row: Some(true),
        ..ANY
    };
    let table = table_with(scope, &format);
    assert_eq!(table.headers(), ["x-axis", "1", "2"]);
    assert_eq!(table.unit(2), Some("Volt"));
    assert_eq!(table.lines(), [6, 7]);
}

#[test]
fn units_stand_in_rows_and_names() {
    for (text, units) in [
        ("t,a,F\ns,g,N\n0,1,2\n", [Some("s"), Some("g"), Some("N")]),
        ("t,a,F\n(s),[g],\n0,1,2\n", [Some("s"), Some("g"), None]),
        (
            "t [s],a (g),F / kN\n0,1,2\n",
            [Some("s"), Some("g"), Some("kN")],
        ),
        ("t,a,F\n0,1,2\n", [None; 3]),
        ("s,g,N\n0,1,2\n", [Some("s"), Some("g"), Some("N")]),
        ("g,s,N\n0,1,2\n", [None; 3]),
    ] {
        let table = table(text);
        assert_eq!([0, 1, 2].map(|index| table.unit(index)), units, "{text}");
        assert_eq!(table.rows(), 1, "{text}");
    }
    assert_eq!(table("s,g\n0,1\n").headers(), ["s", "g"]);
}

#[test]
fn names_are_found_without_their_units() {
    let table = table("t [s];acc [m/s²];acc_2 (g);\"F / N\";F\n0;1;2;3;4\n");
    for (name, index) in [
        ("t", 0),
        ("t [s]", 0),
        ("acc", 1),
        ("\"acc\"", 1),
        ("acc_2", 2),
        ("F", 4),
        ("F / N", 3),
    ] {
        assert_eq!(table.find(&name.into()).unwrap(), index, "{name}");
    }
    assert_eq!(table.find(&ColumnName::Number(5)).unwrap(), 4);
    assert_eq!(table.label(1), "acc [m/s²]");
}

#[test]
fn files_without_names_have_numbered_columns() {
    for text in [
        "0,1\n0.5,2\n",
        "# made by hand\n0,1\n0.5,2\n",
        "Rig 7\n2024\n0,1\n0.5,2\n",
        "0 1\n0.5 2\n",
        "Made by hand on Monday\n\n0;1\n0,5;2\n",
    ] {
        let table = table(text);
        assert!(table.headers().is_empty(), "{text}");
        assert_eq!(table.width(), 2, "{text}");
        assert_eq!(table.values(0).unwrap(), [0.0, 0.5], "{text}");
        let index = table.find(&ColumnName::Number(2)).unwrap();
        assert_eq!(table.samples(index).unwrap(), [1.0, 2.0], "{text}");
        assert_eq!(table.label(1), "2", "{text}");
    }
    let words = "UTF-8; separated by commas; decimal point; no column names, data from line 1";
    assert_eq!(table("0,1\n").format_in_words(), words);
}

#[test]
fn one_column_is_a_table() {
    for text in [
        "y\n1.5\n2.5\n",
        "1.5\n2.5\n",
        "Rig 7, Monday\n\ny\n1.5\n2.5\n",
    ] {
        let table = table(text);
        assert_eq!(table.width(), 1, "{text}");
        assert_eq!(table.values(0).unwrap(), [1.5, 2.5], "{text}");
    }
}

#[test]
fn encodings_are_read() {
    let text = "Prüfstand 7\nt;a\ns;m/s²\n0,0;1,5\n";
    let latin1: Vec<u8> = text.chars().map(|c| u8::try_from(c).unwrap()).collect();
    let mut utf16 = vec![0xff, 0xfe];
    utf16.extend(text.encode_utf16().flat_map(u16::to_le_bytes));
    for (bytes, encoding) in [
        (text.as_bytes().to_vec(), Encoding::Utf8),
        (latin1, Encoding::Windows1252),
        (utf16, Encoding::Utf16),
    ] {
        let table = table(&bytes);
        assert_eq!(table.text_format().expect("a text").encoding, encoding);
        assert_eq!(table.unit(1), Some("m/s²"), "{encoding}");
        assert_eq!(table.column("a").unwrap(), [1.5], "{encoding}");
    }
}

#[test]
fn missing_samples_are_nan() {
    let table = table("t;y\n0;1,5\n1;\n2;NaN\n3;NA\n4;n/a\n5;-\n6;null\n7;#N/A\n8;2,5\n");
    let samples = table.samples(1).unwrap();
    assert_eq!((samples[0], samples[8]), (1.5, 2.5));
    assert!(samples[1..8].iter().all(|y| y.is_nan()));
    assert!(table.values(1).is_err());
    assert_eq!(table.values(0).unwrap(), table.samples(0).unwrap());
}

#[test]
fn a_mistake_in_the_first_row_does_not_make_it_a_name() {
    for text in [
        "t,y\n0,off\n1,2\n2,3\n",
        "t,y\n0,off\n1,off\n2,3\n3,4\n4,5\n",
    ] {
        let table = table(text);
        assert_eq!(table.headers(), ["t", "y"]);
        let message = table.column("y").unwrap_err().to_string();
        assert!(
            message.starts_with("t.csv:2: column `y`: not a number"),
            "{message}"
        );
    }
    assert_eq!(table("t,1,2\n0,3,4\n").headers(), ["t", "1", "2"]);
}

#[test]
fn a_given_format_is_not_detected() {
    let text = "1;2\n3;4\n5;6\n";
    let told = |format| table_with(text, &format).lines().to_vec();
    assert_eq!(told(ANY), [1, 2, 3]);
    assert_eq!(
        told(TableFormat {
            skip: Some(1),
            ..ANY
        }),
        [2, 3]
    );
    let names = "t;y\ns;m\n0,5;1,5\n";
    let table = table_with(
        names,
        &TableFormat {
            header: Some(false),
            ..ANY
        },
    );
    assert!(table.headers().is_empty());
    assert_eq!(table.lines(), [3]);
    let table = table_with(
        names,
        &TableFormat {
            units_row: Some(false),
            ..ANY
        },
    );
    assert_eq!(table.headers(), ["s", "m"]);
    let table = table_with(
        "a|b\n1,5|2\n",
        &TableFormat {
            delimiter: Some('|'),
            ..ANY
        },
    );
    assert_eq!(table.column("a").unwrap(), [1.5]);
    let table = table_with(
        "a\n1,5\n2,5\n",
        &TableFormat {
            decimal: Some(','),
            ..ANY
        },
    );
    assert_eq!(table.column("a").unwrap(), [1.5, 2.5]);
    let table = table_with(
        "Rig;7\nt;y\ns;m\n0;1\n",
        &TableFormat {
            skip: Some(1),
            ..ANY
        },
    );
    assert_eq!(table.headers(), ["t", "y"]);
    assert_eq!((table.unit(0), table.lines()), (Some("s"), &[4][..]));
}

#[test]
fn formats_of_common_instruments_are_read() {
    // Units in brackets, then a blank line.
    let scope = table("Time,Channel A\n(ms),(mV)\n\n-0.1,1.0\n0.0,1.5\n");
    assert_eq!(scope.headers(), ["Time", "Channel A"]);
    assert_eq!((scope.unit(0), scope.unit(1)), (Some("ms"), Some("mV")));
    assert_eq!(scope.column("Channel A").unwrap(), [1.0, 1.5]);
    // Keys and values, some of them numbers; names that are units.
    let scope = table(
        "Record Length,7000\nInterval,CH1:2e-6\nUnits,CH1:V\nSecond,Volt\n-7e-3,0.04\n-6e-3,0.05\n",
    );
    assert_eq!(scope.headers(), ["Second", "Volt"]);
    assert_eq!(scope.lines(), [5, 6]);
    // A recording of a phone: quoted names with units.
    let phone = table("\"Time (s)\",\"Acceleration x (m/s^2)\"\n0E0,1.5E-1\n1E-2,2E-1\n");
    assert_eq!(phone.column("Acceleration x").unwrap(), [0.15, 0.2]);
    // A spreadsheet.
    let sheet = table("sep=;\r\nt;y\r\n0;1,5\r\n1;2,5\r\n");
    assert_eq!(sheet.column("y").unwrap(), [1.5, 2.5]);
    // A delimiter after the last field, with and without one after the names.
    for names in ["t\ty\t", "t\ty"] {
        let table = table(format!("{names}\n0\t1.5\t\n1\t2.5\t\n"));
        assert_eq!(table.column("y").unwrap(), [1.5, 2.5]);
    }
    // Settings beside the samples.
    let beside = table("Points,2500,,-0.5,1\nInterval,2e-4,,0.0,2\n,,,0.5,3\n,,,1.0,4\n");
    assert_eq!(beside.values(3).unwrap(), [-0.5, 0.0, 0.5, 1.0]);
    assert!(beside.headers().is_empty());
    // Names with spaces in columns separated by spaces: no names rather than wrong ones.
    let aligned = table("Time (s)   Acc (g)\n   0.0       1.0\n   0.1       2.0\n");
    assert_eq!(aligned.values(1).unwrap(), [1.0, 2.0]);
    assert!(aligned.headers().is_empty());
}

#[test]
fn rows_without_samples_are_no_names() {
    for text in ["t,y\nNaN,NaN\n0,1\n1,2\n", "t,y\n,\n0,1\n1,2\n"] {
        let table = table(text);
        assert_eq!(table.headers(), ["t", "y"]);
        assert_eq!(table.lines(), [2, 3, 4]);
        assert!(table.samples(1).unwrap()[0].is_nan());
    }
}

#[test]
fn long_files_are_read_beyond_the_detected_part() {
    let mut text = "Rig 7\nt;y\n".to_owned();
    for i in 0..20_000 {
        text.push_str(&format!("{},{:03};{}\n", i / 1000, i % 1000, i % 7));
    }
    let table = table(&text);
    assert_eq!(table.rows(), 20_000);
    assert_eq!(table.values(0).unwrap()[19_999], 19.999);
    assert_eq!(table.lines()[19_999], 20_002);
}

/// A long text is read in halves, one with quotes as a whole: both have the same rows, gaps, unusable columns and mistakes.
#[test]
fn halves_of_a_long_text() {
    let text = |changes: &[(usize, &str)]| {
        let mut text = String::from("t,y,note\n");
        for i in 0..40_000 {
            let change = changes.iter().find(|(row, _)| *row == i);
            match change {
                Some((_, row)) => text += row,
                None => text += &format!("{i},{},{}", 0.5 * i as f64, 2 * i),
            }
            text.push('\n');
        }
        text
    };
    let outcome = |text: &str| match Table::parse("t.csv", text.as_bytes()) {
        Ok(table) => format!("{table:?}"),
        Err(error) => error.to_string(),
    };
    let both = |changes: &[(usize, &str)]| {
        let text = text(changes);
        let halves = outcome(&text);
        assert!(
            halves == outcome(&text.replacen("t,y", "\"t\",y", 1)),
            "{changes:?}"
        );
        halves
    };
    both(&[]);
    both(&[(7, "7,,14"), (35_000, "35000,NaN,1")]);
    both(&[(39_000, "39000,1,late")]);
    both(&[(11, "11,1,early"), (39_000, "39000,x,late")]);
    let mistake = both(&[(30_000, "30000,1"), (39_000, "39000")]);
    assert!(
        mistake.starts_with("t.csv:30002: the row does not fit"),
        "{mistake}"
    );
    let mistake = both(&[(5, "5"), (30_000, "30000,1")]);
    assert!(
        mistake.starts_with("t.csv:7: the row does not fit"),
        "{mistake}"
    );
}
