//! Valid files that loggers and their libraries write: each of `tests/formats/storage/` holds the record of `right.csv`.

use kmcfit::formats::{FileChannel, read, recognise};
use std::fs;
use std::path::Path;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/formats/storage");

fn channels(file: &str) -> Vec<FileChannel> {
    let path = Path::new(FOLDER).join(file);
    let bytes = fs::read(&path).expect("a file");
    let format = recognise(&path, &bytes).unwrap_or_else(|error| panic!("{error}"));
    let found = read(&path, &bytes, format.expect("a binary format"));
    found.unwrap_or_else(|error| panic!("{error}")).channels
}

/// A column of the record.
fn right(column: usize) -> Vec<f64> {
    let text = fs::read_to_string(Path::new(FOLDER).join("right.csv")).expect("a file");
    let field = |row: &str| row.split(',').nth(column)?.parse().ok();
    text.lines().skip(1).filter_map(field).collect()
}

/// Number of missing samples, the factor of the others to those of a column, and their largest deviation from that, relative to the
/// largest sample.
fn compared(values: &[f64], right: &[f64]) -> (usize, f64, f64) {
    assert_eq!(values.len(), right.len());
    let known = || values.iter().zip(right).filter(|(x, _)| !x.is_nan());
    let product: f64 = known().map(|(x, y)| x * y).sum();
    let factor = product / known().map(|(_, y)| y * y).sum::<f64>();
    let largest = right.iter().fold(0.0f64, |most, y| most.max(y.abs()));
    let off = known().map(|(x, y)| (x / factor - y).abs() / largest);
    (
        values.len() - known().count(),
        factor,
        off.fold(0.0, f64::max),
    )
}

#[test]
fn channels_have_their_values_and_units() {
    // File, channel, unit, column of the record, missing samples, and the factor where it is not that of counts.
    for (file, name, unit, column, missing, factor) in [
        (
            "unit_for_each_column.h5",
            "acceleration.2",
            Some("g"),
            2,
            0,
            None,
        ),
        (
            "unit_text_of_h5py.h5",
            "force",
            Some("kN"),
            1,
            0,
            Some(1e-3),
        ),
        (
            "nc_unit_of_8_attributes.nc",
            "force",
            Some("kN"),
            1,
            0,
            Some(1e-3),
        ),
        (
            "latin1_field.npy",
            "latin1_field.a [mm/s²]",
            None,
            2,
            0,
            Some(1e3),
        ),
        ("nc_packed.nc", "force", Some("N"), 1, 0, Some(1.0)),
        (
            "nc_packed.nc",
            "acceleration",
            Some("m/s^2"),
            2,
            0,
            Some(1.0),
        ),
        (
            "nc_missing_samples.nc",
            "acceleration",
            Some("m/s^2"),
            2,
            4,
            Some(1.0),
        ),
        ("float_other_bias.h5", "acceleration", None, 2, 0, Some(1.0)),
        (
            "appended_latest.h5",
            "acceleration",
            Some("m/s^2"),
            2,
            0,
            Some(1.0),
        ),
        (
            "nc_9_variables.nc",
            "acceleration",
            Some("m/s^2"),
            2,
            0,
            Some(1.0),
        ),
        (
            "table_of_fields.h5",
            "table.acceleration",
            None,
            2,
            0,
            Some(1.0),
        ),
        ("lzf.h5", "acceleration", Some("m/s^2"), 2, 0, Some(1.0)),
        (
            "gap_of_two_chunks.h5",
            "acceleration",
            Some("m/s^2"),
            2,
            100,
            Some(1.0),
        ),
        ("adc_24_bits_in_32.h5", "acceleration", None, 2, 0, None),
        (
            "struct_aligned.npy",
            "struct_aligned.acceleration",
            None,
            2,
            0,
            Some(1.0),
        ),
        (
            "length_ffffffff.wav",
            "channel 1",
            None,
            1,
            0,
            Some(1.0 / 60.0),
        ),
        ("rifx.wav", "channel 2", None, 2, 0, Some(1.0 / 140.0)),
    ] {
        let all = channels(file);
        let Some(found) = all.iter().find(|c| c.name == name) else {
            let names: Vec<&str> = all.iter().map(|c| &*c.name).collect();
            panic!("{file}: {names:?}");
        };
        assert_eq!(found.unit.as_deref(), unit, "{file}: {name}");
        let (absent, own, off) = compared(&found.values, &right(column));
        assert_eq!(absent, missing, "{file}: {name}");
        assert!(off < 1e-3, "{file}: {name}: {off}");
        if let Some(factor) = factor {
            assert!((own / factor - 1.0).abs() < 1e-3, "{file}: {name}: {own}");
        }
    }
}

#[test]
fn chunks_that_were_never_written_are_missing_samples() {
    let all = channels("gap_of_two_chunks.h5");
    let found = all.iter().find(|c| c.name == "acceleration");
    let values = &found.expect("the acceleration").values;
    let is_missing = |i: usize| values[i].is_nan();
    assert!((0..600).all(|i| is_missing(i) == (200..300).contains(&i)));
}
