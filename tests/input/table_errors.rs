//! Messages about invalid tables.

use insta::assert_snapshot;
use kmcfit::error::InputError;
use kmcfit::tables::{Table, times};

/// The message about a text as a whole.
fn message(text: impl AsRef<[u8]>) -> String {
    shown(Table::parse("t.csv", text.as_ref()))
}

/// The message about a column of a text.
fn column(text: &str, name: &str) -> String {
    shown(Table::parse("t.csv", text.as_bytes()).unwrap().column(name))
}

fn shown<T>(result: Result<T, InputError>) -> String {
    match result {
        Ok(_) => "no error".to_owned(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn files() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("noisy.csv"), "t\n0\n").unwrap();
    let read = |name: &str| {
        shown(Table::read(folder.path().join(name)))
            .replace(&folder.path().display().to_string(), "DIR")
    };
    assert_snapshot!(read("nosy.csv"), @"
    DIR/nosy.csv: no such file
      expected: a CSV file with one row of column names and rows of numbers
      hint: did you mean `noisy.csv`?
    ");
    assert_snapshot!(read("data/noisy.csv"), @"
    DIR/data/noisy.csv: no such file
      expected: a CSV file with one row of column names and rows of numbers
      hint: the folder DIR/data does not exist
    ");
    assert_snapshot!(read("."), @"
    DIR/.: this is a folder, not a file
      expected: a CSV file with one row of column names and rows of numbers
    ");
}

#[test]
fn empty_and_foreign() {
    assert_snapshot!(message(""), @"
    t.csv: the file is empty
      expected: a CSV file with one row of column names and rows of numbers
    ");
    assert_snapshot!(message("\n# only a comment\n\n"), @"
    t.csv: the file is empty
      expected: a CSV file with one row of column names and rows of numbers
    ");
    assert_snapshot!(message("t,y\n# nothing\n"), @"
    t.csv: the file has no data
      found: a row of column names only
      expected: a CSV file with one row of column names and rows of numbers
    ");
    assert_snapshot!(message(b"t,y\n0,1\n1,\0\n"), @"
    t.csv:3:3: the file is not text
      found: the byte 0x00
      hint: is it a binary file, or UTF-16 without a byte order mark? Save it as text in UTF-8
    ");
    assert_snapshot!(message(b"\xfe\xff\xd8\0\0,"), @"
    t.csv: the file is not text
      found: a byte order mark of UTF-16, but no UTF-16 text behind it
      hint: save it as UTF-8
    ");
    assert_snapshot!(message("t;y\n"), @"
    t.csv: the file has no data
      found: a row of column names only
      expected: a CSV file with one row of column names and rows of numbers
    ");
}

#[test]
fn headers() {
    assert_snapshot!(message("note\nt,y,t\n0,1,2\n"), @"
    t.csv:2:1: two columns have the name `t`
      found: columns 1 and 3
      expected: every column name once
    ");
    assert_snapshot!(message("t,y,t\n0,1,2\n"), @"
    t.csv:1:1: two columns have the name `t`
      found: columns 1 and 3
      expected: every column name once
    ");
    assert_snapshot!(column("t_s,y_m\n0,1\n", "y"), @"
    t.csv: there is no such column
      found: `y`
      expected: one of: t_s, y_m
      hint: did you mean `y_m`?
    ");
    assert_snapshot!(column("t_s,y_m\n0,1\n", "Y_M"), @"
    t.csv: there is no such column
      found: `Y_M`
      expected: one of: t_s, y_m
      hint: did you mean `y_m`?
    ");
    assert_snapshot!(column("t_s,y_m\n0,1\n", "acceleration"), @"
    t.csv: there is no such column
      found: `acceleration`
      expected: one of: t_s, y_m
    ");
}

#[test]
fn fields() {
    let mut text = "t,y\n# comment\n".to_owned();
    for row in 1..20 {
        text.push_str(&format!("{row},{}\n", if row == 17 { "off" } else { "1" }));
    }
    assert_snapshot!(column(&text, "y"), @"
    t.csv:19: column `y`: not a number
      found: `off`
      expected: a finite number
    ");
    assert_snapshot!(column("t,y\n0,\n", "y"), @"
    t.csv:2: column `y`: a number is missing
      found: nothing
      expected: a finite number
    ");
    assert_snapshot!(column("t,y\n0,NaN\n", "y"), @"
    t.csv:2: column `y`: not a finite number
      found: `NaN`
      expected: a finite number
    ");
    assert_snapshot!(column("t,y\n0,1e999\n", "y"), @"
    t.csv:2: column `y`: not a finite number
      found: `1e999`
      expected: a finite number
    ");
    assert_snapshot!(column("t,y\n0,3.5 m\n", "y"), @"
    t.csv:2: column `y`: not a number
      found: `3.5 m`
      expected: a finite number
    ");
    assert_snapshot!(column("t,y\n0,\"3.5\n1,2\n", "y"), @r"
    t.csv:2: column `y`: not a number
      found: `3.5\n1,2`
      expected: a finite number
      hint: a quote that is opened in this row is not closed in it
    ");
}

#[test]
fn spacing() {
    let increasing = |text: &str| {
        shown(times::increasing(
            &Table::parse("t.csv", text.as_bytes()).unwrap(),
            "t",
        ))
    };
    assert_snapshot!(increasing("t\n0\n1\n1\n2\n"), @"
    t.csv:4: column `t`: two rows with the same time
      found: 1 after 1 in line 3
      expected: a time greater than 1
    ");
    assert_snapshot!(increasing("t\n0\n1\n# again\n0.5\n2\n"), @"
    t.csv:5: column `t`: the times do not increase
      found: 0.5 after 1 in line 3
      expected: a time greater than 1
    ");
    assert_snapshot!(increasing("t\n0\nx\n"), @"
    t.csv:3: column `t`: not a number
      found: `x`
      expected: a finite number
    ");
    assert_snapshot!(increasing("u\n0\n1\n"), @"
    t.csv: there is no such column
      found: `t`
      expected: `u`
    ");
}
