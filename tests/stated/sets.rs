//! Sets of channels: universal files, tables of HDF5, archives, many variables.

use crate::headings::init;
use crate::workbench::Workbench;
use hdf5_pure::{AttrValue, CompoundTypeBuilder, Datatype, FileBuilder, make_f64_type};
use kmcfit::tables::Table;
use std::io::Write as _;

fn samples() -> Vec<f64> {
    let at = |i: usize| (0.25 * i as f64).cos() + 1e-3 * (i * 7919 % 101) as f64;
    (0..300).map(at).collect()
}

/// Data set 58 with 300 samples of an acceleration at 50 Hz.
fn set_58(time_unit: &str, unit: &str) -> String {
    let mut text = format!("    -1\n    58\n{}", "NONE\n".repeat(5));
    text += "    1         0    0         0 NONE               1   3 NONE               0   0\n";
    text += &format!(
        "{:>10}{:>10}{:>10}{:13.5e}{:13.5e}{:13.5e}\n",
        2, 300, 1, 0.0, 0.02, 0.0
    );
    for (kind, unit) in [(17, time_unit), (12, unit), (0, "NONE"), (0, "NONE")] {
        text += &format!("{kind:>10}    0    0    0 {:<20} {unit:<20}\n", "NONE");
    }
    for row in samples().chunks(6) {
        text.extend(row.iter().map(|x| format!("{x:13.5e}")));
        text += "\n";
    }
    text + "    -1\n"
}

/// Units of data set 164 hold wherever it stands; an unknown unit of times is named and a reason.
#[test]
fn units_of_universal_files() {
    let set_164 = "    -1\n   164\n         5mm             2\n    1.00000000000000000D+03    1.00000000000000000D+03    1.0D+00\n    0.0D+00\n    -1\n";
    let sets = set_58("s", "NONE");
    for text in [format!("{set_164}{sets}"), format!("{sets}{set_164}")] {
        let said = init("r.uff", text.as_bytes(), &[]);
        assert!(
            said.contains("acceleration, mm/s²") && said.contains("over 5.98 s"),
            "{said}"
        );
    }
    let bench = Workbench::empty();
    bench.write("r.uff", &set_58("fortnight", "g"));
    let said = bench.run_to(0, &["init", "r.uff"]);
    assert!(said.contains("fortnight, which is not applied"), "{said}");
    bench.run_to(0, &["fit", "r.yaml", "--out", "run", "--no-report"]);
    let document: serde_json::Value =
        serde_json::from_str(&bench.read("run/result.json")).expect("a document");
    let verdict = &document["verdict"];
    assert!(
        verdict["level"] != "adequate" && verdict["reasons"].to_string().contains("fortnight"),
        "{verdict}"
    );
}

/// A table of HDF5 as PyTables and pandas write it: fields of several numbers, attributes, and a group with the order of a column.
#[test]
fn tables_of_hdf5() {
    let pair = Datatype::Array {
        base_type: Box::new(make_f64_type()),
        dimensions: vec![2],
    };
    let kind = CompoundTypeBuilder::new()
        .f64_field("time")
        .field("acc", pair)
        .build()
        .expect("a type");
    let file = |unit: AttrValue| {
        let rows = samples();
        let row = |(i, y): (usize, &f64)| [0.02 * i as f64, 0.1 * y, *y].map(f64::to_le_bytes);
        let raw = rows.iter().enumerate().flat_map(row).flatten().collect();
        let mut file = FileBuilder::new();
        let set = file
            .create_dataset("run")
            .with_compound_data(kind.clone(), raw, 300);
        set.set_attr("units", unit);
        let mut group = file.create_group("_i_run");
        group.create_dataset("acc").with_f64_data(&rows);
        file.add_group(group.finish());
        file.finish().expect("a file")
    };
    let said = init("r.h5", &file(AttrValue::String("g".into())), &[]);
    assert!(
        said.contains("`run.acc.2`: acceleration, g") && said.contains("`run.time`: time, s"),
        "{said}"
    );
    assert!(!said.contains("_i_run"), "{said}");
    let each = ["s", "g", "g"].map(str::to_owned).to_vec();
    let said = init("r.h5", &file(AttrValue::StringArray(each)), &[]);
    assert!(said.contains("`run.acc.2`: acceleration, g"), "{said}");
}

/// An archive of one table and a table of gzip are read; several files are to be unpacked.
#[test]
fn packed_tables() {
    let mut text = "time (s),acc (g)\n".to_owned();
    text.extend(
        samples()
            .iter()
            .enumerate()
            .map(|(i, y)| format!("{:.2},{y}\n", 0.02 * i as f64)),
    );
    let archive = |names: &[&str]| {
        let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        for name in names {
            let options = zip::write::SimpleFileOptions::default();
            zip.start_file(*name, options).expect("a member");
            zip.write_all(text.as_bytes()).expect("a member");
        }
        zip.finish().expect("an archive").into_inner()
    };
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gzip.write_all(text.as_bytes()).expect("a text");
    let gzip = gzip.finish().expect("a text");
    for (name, bytes) in [("r.zip", &archive(&["r.csv"])), ("r.csv.gz", &gzip)] {
        let said = init(name, bytes, &[]);
        assert!(
            said.contains("acceleration, g") && said.contains("over 5.98 s"),
            "{said}"
        );
        let damaged = &bytes[..bytes.len() * 2 / 3];
        assert!(Table::parse(name, damaged).is_err());
    }
    // Twice packed, and zeros that expand beyond the limit.
    let mut twice = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    twice.write_all(&gzip).expect("bytes");
    let mut zeros = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    zeros.write_all(&vec![b'0'; 40 << 20]).expect("zeros");
    for bytes in [twice.finish(), zeros.finish()] {
        assert!(Table::parse("r.gz", &*bytes.expect("bytes")).is_err());
    }
    let bench = Workbench::empty();
    bench.write_bytes("two.zip", &archive(&["a.csv", "b.csv"]));
    let (code, _, said) = bench.run(&["init", "two.zip"]);
    assert!(code == 2 && said.contains("unpack the archive"), "{said}");
}

/// Names in which a comma stands without quotes.
#[test]
fn commas_in_names() {
    let bench = Workbench::empty();
    bench.write("r.csv", "Time (s),Force, kN,acc (g)\n0,1,2\n1,2,3\n2,1,2\n");
    let (code, _, said) = bench.run(&["init", "r.csv"]);
    assert!(
        code == 2 && said.contains("write `Force (kN)`, or the name in quotes"),
        "{said}"
    );
}
