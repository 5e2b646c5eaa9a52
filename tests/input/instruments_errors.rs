//! Messages about tables as instruments write them.

use insta::assert_snapshot;
use kmcfit::tables::{ColumnName, Table, TableFormat};

fn parsed(text: &str) -> Table {
    Table::parse("t.csv", text.as_bytes()).unwrap()
}

fn with(text: &str, format: &TableFormat) -> String {
    let error = Table::parse_with("t.csv", text.as_bytes(), format);
    error.unwrap_err().to_string()
}

#[test]
fn columns() {
    let find = |text: &str, column: ColumnName| parsed(text).find(&column).unwrap_err().to_string();
    assert_snapshot!(find("t [s];acc [g]\n0;1\n", "ac".into()), @"
    t.csv: there is no such column
      found: `ac`
      expected: one of: t [s], acc [g]
      hint: did you mean `acc`?
    ");
    assert_snapshot!(find("a [g],a [V]\n0,1\n", "a".into()), @"
    t.csv: several columns have this name
      found: `a`
      expected: one of: a [g], a [V]
    ");
    assert_snapshot!(find("t,y\n0,1\n", ColumnName::Number(3)), @"
    t.csv: no such column number
      found: 3
      expected: 1 to 2
    ");
    assert_snapshot!(find("t\n0\n", ColumnName::Number(0)), @"
    t.csv: no such column number
      found: 0
      expected: 1: there is one column
    ");
    assert_snapshot!(find("0,1\n1,2\n", "t".into()), @"
    t.csv: there is no such column
      found: `t`
      expected: a number from 1 to 2
      hint: the file has no column names: give the column by its number
    ");
}

#[test]
fn rows() {
    let any = TableFormat::default();
    assert_snapshot!(with("0;1\n1;2\n2\n", &any), @"
    t.csv:3: the row does not fit the other rows
      found: 1 field
      expected: 2 fields, one per column
    ");
    assert_snapshot!(with("Rig;7\n\nt;y\ns;m\n0,5;1\n1,5;2;3\n", &any), @"
    t.csv:6: the row does not fit the column names
      found: 3 fields
      expected: 2 fields, one per column
    ");
    assert_snapshot!(with("t\n0,5\n1,5\n", &any), @"
    t.csv:2: the row does not fit the column names
      found: 2 fields
      expected: 1 field, one per column
      hint: write numbers with a decimal point, not a comma
    ");
}

#[test]
fn formats() {
    let any = TableFormat::default();
    let told = |format| with("0,1\n1,2\n", &format);
    assert_snapshot!(told(TableFormat { header: Some(true), ..any }), @"
    t.csv:1:1: the column names are missing
      found: the numbers `0, 1`
      expected: one row of column names before the data
      hint: a line that begins with `#` is a comment: remove the `#` before the names
    ");
    assert_snapshot!(told(TableFormat { skip: Some(9), ..any }), @"
    t.csv: the file is empty
      found: nothing after 9 skipped lines
      expected: a CSV file with one row of column names and rows of numbers
    ");
    assert_snapshot!(told(TableFormat { delimiter: Some('x'), ..any }), @"
    delimiter: invalid delimiter
      found: `x`
      expected: a comma, a semicolon, a tab, a space or another punctuation mark, except `.`, `+`, `-`, `#` and quotes
    ");
    assert_snapshot!(told(TableFormat { decimal: Some('\''), ..any }), @"
    decimal: invalid decimal separator
      found: `'`
      expected: `.` or `,`
    ");
    assert_snapshot!(told(TableFormat { delimiter: Some(','), decimal: Some(','), ..any }), @"
    delimiter: the delimiter is also the decimal sign
      found: `,`
      expected: two different signs
    ");
}
