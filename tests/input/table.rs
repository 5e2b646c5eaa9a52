//! Valid tables.

use kmcfit::error::Location;
use kmcfit::tables::{Table, times};

fn table(text: &str) -> Table {
    Table::parse("t.csv", text.as_bytes()).unwrap()
}

#[test]
fn columns_are_read_by_name() {
    let table = table("t_s,y_m\n0,3.3\n0.5,-1e-3\n+1.0,.25\n");
    assert_eq!(table.headers(), ["t_s", "y_m"]);
    assert_eq!(table.column("t_s").unwrap(), [0.0, 0.5, 1.0]);
    assert_eq!(table.column("y_m").unwrap(), [3.3, -1e-3, 0.25]);
    assert_eq!(table.rows(), 3);
    assert_eq!(table.lines(), [2, 3, 4]);
    assert_eq!(table.path().to_str(), Some("t.csv"));
}

#[test]
fn byte_order_marks_and_blank_lines_are_ignored() {
    let plain = table("t,y\n0,1\n1,2\n");
    for text in [
        "\u{feff}t,y\n0,1\n1,2\n",
        "t,y\r\n0,1\r\n1,2\r\n",
        "t,y\n0,1\n1,2",
        "t,y\n0,1\n1,2\n\n\n",
        "t,y\n0,1\n1,2\n   \n",
        " t , y \n 0 , 1\n1,\t2\n",
        "\"t\",\"y\"\n\"0\",1\n1,\" 2\"\n",
        "t,y\r0,1\r1,2\r",
    ] {
        let read = table(text);
        assert_eq!(read.headers(), plain.headers(), "{text:?}");
        assert_eq!(read.column("t"), plain.column("t"), "{text:?}");
        assert_eq!(read.column("y"), plain.column("y"), "{text:?}");
        assert_eq!(read.lines(), plain.lines(), "{text:?}");
    }
}

#[test]
fn lines_are_those_of_the_file() {
    let text = "# made by hand\n\nt,y\n# a, comment, here\n0,1\n\n  # indented\n1,2\n   \n2,3\n";
    for text in [
        text.to_owned(),
        text.replace('\n', "\r\n"),
        text.replace('\n', "\r"),
    ] {
        assert_eq!(table(&text).lines(), [5, 8, 10], "{text:?}");
    }
    assert_eq!(
        table("t,\"a\nb\"\n0,1\n\"1\",\"\n2\"\n2,3\n").lines(),
        [3, 4, 6]
    );
}

#[test]
fn text_is_allowed_in_unused_columns() {
    let table = table("t,note,\n0,start,a\n1,,b\n");
    assert_eq!(table.column("t").unwrap(), [0.0, 1.0]);
    assert!(table.column("note").is_err());
}

#[test]
fn places_have_the_line() {
    let table = table("t\n0\n# no\n1\n");
    let Location::Row { line, .. } = table.location(1, None) else {
        panic!("a row")
    };
    assert_eq!(line, 4);
    table.location(7, Some("t"));
}

#[test]
fn files_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.csv");
    std::fs::write(&path, "t,y\n0,1\n").unwrap();
    assert_eq!(Table::read(&path).unwrap().column("y").unwrap(), [1.0]);
}

#[test]
fn times_increase() {
    let unequal = table("t\n0\n1\n5\n");
    assert_eq!(times::increasing(&unequal, "t").unwrap(), [0.0, 1.0, 5.0]);
}
