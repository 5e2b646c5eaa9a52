//! A stated unit, scale, offset, start time or rate is applied or named: generated headings and attributes, 200 of each kind.

use hdf5_pure::{AttrValue, FileBuilder};
use kmcfit::config::{Role, recognised};
use kmcfit::tables::{Table, TableFormat};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const COUNT: usize = 200;

fn one<'a, T>(random: &mut ChaCha8Rng, of: &'a [T]) -> &'a T {
    &of[random.random_range(0..of.len())]
}

/// Units of accelerations and forces in any spelling and place of a heading; texts that are no units are stated, and not taken for SI.
#[test]
fn headings() {
    let accelerations = [
        ("m/s^2", 1.0),
        ("m/s²", 1.0),
        ("ms-2", 1.0),
        ("m s^-2", 1.0),
        ("m/sec2", 1.0),
        ("g", 9.80665),
        ("mg", 9.80665e-3),
        ("%g", 0.0980665),
        ("cm/s/s", 0.01),
        ("gal", 0.01),
        ("mm/s**2", 1e-3),
        ("µm/s²", 1e-6),
        ("in/s²", 0.0254),
        ("ft/sec^2", 0.3048),
        ("km/h/s", 1.0 / 3.6),
    ];
    let forces = [
        ("N", 1.0),
        ("kN", 1e3),
        ("MN", 1e6),
        ("daN", 10.0),
        ("mN", 1e-3),
        ("kgf", 9.80665),
        ("kp", 9.80665),
        ("lbf", 4.448_221_615_260_5),
        ("kip", 4_448.221_615_260_5),
        ("dyn", 1e-5),
        ("µN", 1e-6),
    ];
    let unknown = [
        "dBm", "Pa", "raw", "counts", "furlong", "mV/V", "a.u.", "bits", "m/", "kN/m", "1/s", "Hz",
        "%",
    ];
    let forms = [
        "NAME [UNIT]",
        "NAME (UNIT)",
        "NAME (UNIT) Run #1",
        "NAME [UNIT] filtered",
        "NAME {UNIT}",
        "Sensor 1: NAME (UNIT)",
        "NAME  [ UNIT ]",
        "NAME (left) [UNIT]",
        "\"NAME (UNIT)\"",
        "NAME <UNIT>",
    ];
    let known_forms = [
        "NAME / UNIT",
        "NAME, UNIT",
        "NAME in UNIT",
        "NAME: UNIT",
        "NAME - UNIT",
        "NAME|UNIT",
        "NAME (±16UNIT)",
        "NAME (200UNIT) ch1",
    ];
    let mut random = ChaCha8Rng::seed_from_u64(70);
    for i in 0..3 * COUNT {
        let (names, units, role): (&[&str], &[(&str, f64)], Role) = match i % 2 {
            0 => (
                &["acceleration", "Acc_z", "accel X", "Beschleunigung"],
                &accelerations,
                Role::Acceleration,
            ),
            _ => (
                &["Force", "Load cell", "kraft", "hammer force"],
                &forces,
                Role::Force,
            ),
        };
        let name = one(&mut random, names);
        let is_known = i < 2 * COUNT;
        let (unit, factor) = match is_known {
            true => *one(&mut random, units),
            false => (*one(&mut random, &unknown), 0.0),
        };
        let form = match is_known && random.random_bool(0.4) {
            true => one(&mut random, &known_forms),
            false => one(&mut random, &forms),
        };
        let header = form.replace("NAME", name).replace("UNIT", unit);
        let text = format!("t;{header}\n0;1\n1;2\n2;1\n");
        let table = Table::parse("t.csv", text.as_bytes())
            .unwrap_or_else(|error| panic!("{header}: {error}"));
        let found = recognised(&table, 1);
        match is_known {
            true => {
                let (own, of_file, is_stated) =
                    found.unwrap_or_else(|| panic!("{header}: no quantity"));
                assert!(
                    own == role && is_stated,
                    "{header}: {own:?}, stated: {is_stated}"
                );
                assert!(
                    (of_file.factor() / factor - 1.0).abs() < 1e-12,
                    "{header}: {}",
                    of_file.symbol()
                );
            }
            // Not used, or used with a unit that is named as unknown.
            false => {
                let is_named =
                    found.is_none_or(|(_, _, is_stated)| !is_stated && table.unit(1).is_some());
                assert!(is_named, "{header}: {found:?}");
            }
        }
    }
}

/// Value of a property of TDMS.
#[derive(Clone)]
pub enum Property {
    Number(f64),
    Text(&'static str),
    /// Whole seconds and fractions of 2^-64.
    Time(i64, u64),
}

/// Path, properties and samples.
pub type TdmsObject<'a> = (&'a str, &'a [(&'a str, Property)], &'a [f64]);

/// A file of TDMS with a segment: objects by their paths, each with properties and samples.
pub fn tdms(objects: &[TdmsObject]) -> Vec<u8> {
    let text = |bytes: &mut Vec<u8>, text: &str| {
        bytes.extend((text.len() as u32).to_le_bytes());
        bytes.extend(text.bytes());
    };
    let mut meta = (objects.len() as u32).to_le_bytes().to_vec();
    for (path, properties, samples) in objects {
        text(&mut meta, path);
        match samples {
            [] => meta.extend(u32::MAX.to_le_bytes()),
            samples => {
                meta.extend([20u32, 10, 1].map(u32::to_le_bytes).concat());
                meta.extend((samples.len() as u64).to_le_bytes());
            }
        }
        meta.extend((properties.len() as u32).to_le_bytes());
        for (name, value) in *properties {
            text(&mut meta, name);
            match value {
                Property::Number(x) => {
                    meta.extend(10u32.to_le_bytes());
                    meta.extend(x.to_le_bytes());
                }
                Property::Text(own) => {
                    meta.extend(0x20u32.to_le_bytes());
                    text(&mut meta, own);
                }
                Property::Time(seconds, fraction) => {
                    meta.extend(0x44u32.to_le_bytes());
                    meta.extend(fraction.to_le_bytes());
                    meta.extend(seconds.to_le_bytes());
                }
            }
        }
    }
    let samples = objects.iter().flat_map(|(.., samples)| samples.iter());
    let raw: Vec<u8> = samples.flat_map(|x| x.to_le_bytes()).collect();
    let mut bytes = b"TDSm".to_vec();
    bytes.extend([14u32, 4713].map(u32::to_le_bytes).concat());
    bytes.extend(((meta.len() + raw.len()) as u64).to_le_bytes());
    bytes.extend((meta.len() as u64).to_le_bytes());
    [bytes, meta, raw].concat()
}

/// Attributes of samples in HDF5 and properties in TDMS: units, scales, rates and starts of any name are applied, other scales are named.
#[test]
fn attributes() {
    let samples = [1.0, -2.0, 4.0, 8.0, 3.0];
    let mut random = ChaCha8Rng::seed_from_u64(71);
    for i in 0..10 * COUNT {
        let value = f64::from(random.random_range(2..2000)) / 8.0;
        let (names, kind): (&[&str], &str) = match i % 5 {
            0 => (
                &[
                    "units",
                    "unit",
                    "Units",
                    "UNIT",
                    "y_unit",
                    "unit_string",
                    "Unit Description",
                ],
                "unit",
            ),
            1 => (&["scale_factor"], "factor"),
            2 => (&["add_offset"], "offset"),
            3 => (
                &[
                    "fs",
                    "sample_rate",
                    "Sampling Rate",
                    "SampleRate",
                    "sampling_frequency",
                    "ActualRate",
                    "dt",
                    "sampling_interval",
                    "delta_t",
                ],
                "rate",
            ),
            _ => (
                &[
                    "gain",
                    "sensitivity",
                    "Calibration",
                    "offset",
                    "slope",
                    "conversion_factor",
                    "zero_offset",
                ],
                "other",
            ),
        };
        let name = *one(&mut random, names);
        let attribute = match (kind, random.random_range(0..4)) {
            ("unit", 0) => AttrValue::VarLenString("kN".to_owned()),
            ("unit", _) => AttrValue::String("kN".to_owned()),
            (_, 0) => AttrValue::F32(value as f32),
            (_, 1) => AttrValue::I64(value.ceil() as i64),
            (_, 2) => AttrValue::F64Array(vec![value]),
            _ => AttrValue::F64(value),
        };
        let value = match attribute {
            AttrValue::I64(whole) => whole as f64,
            _ => value,
        };
        let is_outside = kind == "rate" && random.random_bool(0.3);
        let is_tdms = random.random_bool(0.5);
        let bytes = if is_tdms {
            let property = match kind {
                "unit" => Property::Text("kN"),
                _ => Property::Number(value),
            };
            let both = [&[][..], &[(name, property)]];
            let position = usize::from(is_outside);
            tdms(&[
                ("/'g'", both[position], &[]),
                ("/'g'/'force'", both[1 - position], &samples),
            ])
        } else {
            let mut file = FileBuilder::new();
            if is_outside {
                file.set_attr(name, attribute.clone());
            }
            let set = file
                .create_dataset("force")
                .with_f64_data(&samples)
                .with_shape(&[5]);
            if !is_outside {
                set.set_attr(name, attribute);
            }
            file.finish().expect("a file")
        };
        let (path, column) = match is_tdms {
            true => ("f.tdms", "g.force"),
            false => ("f.h5", "force"),
        };
        let tables = Table::parse_all(path, &*bytes, &TableFormat::default())
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        let table = &tables[0];
        let read = table.column(column).expect("a column");
        let near = |x: f64, y: f64| (x - y).abs() <= 1e-12 * y.abs();
        let is_stated = match kind {
            "unit" => table.unit(0) == Some("kN"),
            "factor" if !is_tdms => near(read[3], 8.0 * value),
            "offset" if !is_tdms => near(read[3], 8.0 + value),
            "rate" => {
                let step = if name.starts_with('d') || name.contains("interval") {
                    value
                } else {
                    1.0 / value
                };
                table
                    .time_column()
                    .is_some_and(|time| near(table.values(time).expect("times")[1], step))
            }
            // A factor of 1 changes nothing.
            _ if value == 1.0 => true,
            _ => table
                .unapplied(0)
                .iter()
                .any(|stated| stated.contains(name)),
        };
        assert!(is_stated, "{path}: {name} = {value} ({kind})");
    }
}
