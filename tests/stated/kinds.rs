//! Statements in every place of every kind of file: each is applied, or named by `init` and the verdict.

use crate::properties::{Property, tdms};
use hdf5_pure::{AttrValue, FileBuilder};
use kmcfit::config::recognised;
use kmcfit::tables::{Table, TableFormat};
use std::io::Write as _;

/// What a table must say of a column.
#[derive(Debug, Clone, Copy)]
enum Says {
    /// Its unit.
    Unit(&'static str),
    /// A statement with this text is named: as not applied, or as a unit that is not known.
    Named(&'static str),
    /// The second sample: 1 in the file.
    Second(f64),
    /// The sampling interval, s.
    Step(f64),
}
use Says::{Named, Second, Step, Unit};

fn check(case: &str, file: &str, bytes: &[u8], column: &str, says: Says) {
    let tables = Table::parse_all(file, bytes, &TableFormat::default())
        .unwrap_or_else(|error| panic!("{case}: {error}"));
    let find = |table: &Table| table.find(&column.into()).ok();
    let found = tables.iter().find_map(|table| Some((table, find(table)?)));
    let (table, index) = found.unwrap_or_else(|| panic!("{case}: no column {column}"));
    let known = recognised(table, index);
    let is_said = match says {
        Unit(symbol) => {
            known.is_some_and(|(_, unit, is_stated)| is_stated && unit.symbol() == symbol)
                && table.unapplied(index).is_empty()
        }
        Named(text) => {
            let unknown = table
                .unit(index)
                .filter(|_| known.is_none_or(|(.., is_stated)| !is_stated));
            table
                .unapplied(index)
                .iter()
                .map(String::as_str)
                .chain(unknown)
                .any(|said| said.contains(text))
        }
        Second(value) => {
            (table.samples(index).expect("samples")[1] - value).abs() < 1e-12
                && table.unapplied(index).is_empty()
        }
        Step(step) => {
            let time = (0..table.width()).find(|i| table.label(*i) == "time");
            let own = time
                .map(|i| table.values(i).expect("times"))
                .map(|t| t[1] - t[0]);
            let own = own.or(table.stated_rate().map(|rate| 1.0 / rate));
            own.is_some_and(|own| (own / step - 1.0).abs() < 1e-9)
        }
    };
    let unapplied = table.unapplied(index);
    assert!(
        is_said,
        "{case}: {says:?}; unit {:?}, known {known:?}, not applied {unapplied:?}, notes {:?}",
        table.unit(index),
        table.notes()
    );
}

const TIMES: [f64; 12] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0];
const SAMPLES: [f64; 12] = [
    0.0, 1.0, -2.0, 1.5, 0.5, -1.0, 2.0, 0.0, 1.0, -0.5, 0.5, 1.0,
];

/// A text of three columns below these lines.
fn text(lines: &str) -> String {
    let rows = (0..12).map(|i| format!("{},{},{}\n", TIMES[i], SAMPLES[i], SAMPLES[11 - i]));
    format!("{lines}\n{}", rows.collect::<String>())
}

#[test]
fn headings_and_lines() {
    for (lines, column, says) in [
        ("t (s),force (x10 N),acc", "force (x10 N)", Named("x10 N")),
        ("t (s),Force 10N,acc", "Force 10N", Named("10N")),
        (
            "t (s),Force (N) x 0.1,acc",
            "Force (N) x 0.1",
            Named("x 0.1"),
        ),
        ("t (s),Force (N) /10,acc", "Force (N) /10", Named("/10")),
        ("t (s),Force (N) (/4),acc", "Force (N) (/4)", Named("/4")),
        ("t (s),Force (N*10),acc", "Force (N*10)", Named("N*10")),
        ("t (s),f,acc (x3)", "acc (x3)", Named("x3")),
        ("t (s),f,acc (m/s2) x2", "acc (m/s2) x2", Named("x2")),
        (
            "t (s),f,acc (counts/16384)",
            "acc (counts/16384)",
            Named("counts/16384"),
        ),
        (
            "t (s),f,acc (9.81 m/s^2)",
            "acc (9.81 m/s^2)",
            Named("9.81 m/s^2"),
        ),
        ("t (s),f,a*g^-1", "a*g^-1", Named("g^-1")),
        ("Time (x 2 s),f,acc", "Time (x 2 s)", Named("x 2 s")),
        (
            "t (s),f,acc (±0.2 g)",
            "acc (±0.2 g)",
            Named("range of 0.2"),
        ),
        ("t (s),f,acc (±16 g)", "acc (±16 g)", Unit("g")),
        ("t (s),f,acc (gravities)", "acc (gravities)", Unit("g")),
        ("t (s),f,acc (g-force)", "acc (g-force)", Unit("g")),
        ("t (s),f,acc [Unit: g]", "acc [Unit: g]", Unit("g")),
        ("t (s),f,acc (unit=g)", "acc (unit=g)", Unit("g")),
        ("t (s),f,g (acceleration)", "g (acceleration)", Unit("g")),
        ("t (s),f,acc.g", "acc.g", Unit("g")),
        ("t (s),f,acc-g", "acc-g", Unit("g")),
        ("t (s),f,accelerationInG", "accelerationInG", Unit("g")),
        ("t (s),f,accG", "accG", Unit("g")),
        ("t (s),forcekN,accG", "forcekN", Unit("kN")),
        (
            "t (s),f,\"Acceleration, g, ch 3\"",
            "Acceleration, g, ch 3",
            Unit("g"),
        ),
        (
            "# acceleration in g\nt,f,acceleration",
            "acceleration",
            Unit("g"),
        ),
        (
            "# acceleration unit: g\nt,f,acceleration",
            "acceleration",
            Unit("g"),
        ),
        ("Time unit: ms\ntime,f,acc", "time", Unit("ms")),
        ("Units: kN, g\ntime,force,acc", "acc", Unit("g")),
        (
            "\"Units\",\"kN\",\"g\"\ntime,force,acc",
            "force",
            Unit("kN"),
        ),
        ("time,force,acc\n\"Units\",\"kN\",\"g\"", "acc", Unit("g")),
        (
            "# units: time ms, force N, acc g\ntime,force,acc",
            "time",
            Unit("ms"),
        ),
        (
            "Scale factor: 2\nt (s),force (N),acc (g)",
            "acc (g)",
            Named("Scale factor = 2"),
        ),
        (
            "Scale,1,0.1,10\nt (s),force (N),acc (g)",
            "acc (g)",
            Named("Scale = 10"),
        ),
        (
            "t,force,acc\ns,N,g\nScale,0.1,10",
            "acc",
            Named("Scale = 10"),
        ),
        (
            "Sampling Rate,0.2,kHz\nx,force (N),acc (g)",
            "acc (g)",
            Step(0.005),
        ),
    ] {
        check(lines, "t.csv", text(lines).as_bytes(), column, says);
    }
    let levels = text(",force,acceleration\n,N,g\ntime,,");
    check(
        "an index below names of several levels",
        "t.csv",
        levels.as_bytes(),
        "acceleration",
        Unit("g"),
    );
}

#[test]
fn columns_of_days() {
    for (name, first) in [
        ("datenum", 739_312.5),
        ("MATLAB time", 739_312.5),
        ("JD", 2_460_340.5),
        ("MJD", 60_340.5),
        ("Timestamp", 45_322.5),
    ] {
        let rows = (0..200).map(|i| {
            format!(
                "{:.11},{}\n",
                first + f64::from(i) * 0.005 / 86400.0,
                (f64::from(i) / 9.0).sin()
            )
        });
        let text = format!("{name},acc (g)\n{}", rows.collect::<String>());
        check(name, "t.csv", text.as_bytes(), name, Unit("day"));
    }
    let zones = |i: i32| {
        [
            "10:00:00+01:00",
            "09:00:01Z",
            "11:00:02+0200",
            "08:00:03-01",
        ][i as usize % 4]
    };
    let rows = (0..4).map(|i| format!("2024-03-01T{},{i}\n", zones(i)));
    let text = format!("time,acc (g)\n{}", rows.collect::<String>());
    let table = Table::parse("t.csv", text.as_bytes()).expect("a table");
    assert_eq!(table.values(0).expect("times"), [0.0, 1.0, 2.0, 3.0]);
    let text = "time,acc (g)\n12:59:58,1\n12:59:59,2\n1:00:00,3\n";
    let table = Table::parse("t.csv", text.as_bytes()).expect("a table");
    assert_eq!(table.values(0).expect("times"), [0.0, 1.0, 2.0]);
}

fn string(text: &str) -> AttrValue {
    AttrValue::String(text.to_owned())
}

fn strings(texts: &[&str]) -> AttrValue {
    AttrValue::StringArray(texts.iter().map(|text| (*text).to_owned()).collect())
}

/// A file with times, a force, and an acceleration, with attributes of the file and of the acceleration.
fn hdf5(of_file: &[(&str, AttrValue)], of_acc: &[(&str, AttrValue)], has_times: bool) -> Vec<u8> {
    let mut file = FileBuilder::new();
    for (name, value) in of_file {
        file.set_attr(name, value.clone());
    }
    for (name, samples) in [("time", &TIMES), ("force", &SAMPLES), ("acc", &SAMPLES)] {
        if name == "time" && !has_times {
            continue;
        }
        let set = file
            .create_dataset(name)
            .with_f64_data(samples)
            .with_shape(&[12]);
        for (key, value) in of_acc.iter().filter(|_| name == "acc") {
            set.set_attr(key, value.clone());
        }
    }
    file.finish().expect("a file")
}

#[test]
fn attributes_of_hdf5() {
    let unit = |name: &'static str, text: &str| (name, string(text));
    for (of_acc, says) in [
        (vec![unit("unit_label", "g")], Unit("g")),
        (vec![unit("long_name", "acceleration in g")], Unit("g")),
        (vec![unit("description", "acceleration [g]")], Unit("g")),
        (vec![unit("dimension", "g")], Unit("g")),
        (vec![unit("unit_name", "g")], Unit("g")),
        (vec![unit("y_unit", "g")], Unit("g")),
        (
            vec![unit("units", "g"), ("gain", AttrValue::F64(1.0))],
            Unit("g"),
        ),
        (
            vec![
                unit("units", "g"),
                ("natural_frequency", AttrValue::F64(3.0)),
            ],
            Unit("g"),
        ),
        (
            vec![unit("units", "g"), unit("calibration", "ok")],
            Unit("g"),
        ),
        (
            vec![
                unit("units", "g"),
                ("coefficients", AttrValue::F64Array(vec![0.0, 1.0])),
            ],
            Unit("g"),
        ),
        (
            vec![("coefficients", AttrValue::F64Array(vec![0.0, 3.0]))],
            Named("coefficients = [0, 3]"),
        ),
        (vec![("scale_factor", AttrValue::F64(0.5))], Second(0.5)),
        (vec![("scaleFactor", string("0.5"))], Second(0.5)),
        (
            vec![unit("sensitivity", "100 mV/g")],
            Named("sensitivity = 100 mV/g"),
        ),
    ] {
        check(
            &format!("{of_acc:?}"),
            "t.h5",
            &hdf5(&[], &of_acc, true),
            "acc",
            says,
        );
    }
    for name in [
        "factor",
        "lsb",
        "Resolution",
        "conversion",
        "counts_per_unit",
        "bits_to_units",
        "unitSI",
        "mult",
        "multiplier",
        "multiplicator",
        "volts_to_g",
        "amplification",
        "units_per_count",
        "bias",
        "delay",
        "acc_sensitivity",
    ] {
        let of_acc = [("units", string("m/s^2")), (name, AttrValue::F64(3.0))];
        check(name, "t.h5", &hdf5(&[], &of_acc, true), "acc", Named("= 3"));
    }
    for (of_file, says) in [
        (vec![unit("acc_units", "g")], Unit("g")),
        (vec![unit("units", "g")], Unit("g")),
        (vec![unit("acceleration_unit", "g")], Unit("g")),
        (
            vec![("units", strings(&["s", "N", "g"]))],
            Named("units = [s, N, g]"),
        ),
        (vec![unit("sensor_unit", "bar")], Named("sensor_unit = bar")),
    ] {
        check(
            &format!("{of_file:?}"),
            "t.h5",
            &hdf5(&of_file, &[], true),
            "acc",
            says,
        );
    }
    let number = |name: &'static str, x: f64| (name, AttrValue::F64(x));
    for (of_file, step) in [
        (vec![number("dt", 5.0), unit("dt_unit", "ms")], 0.005),
        (vec![number("dt", 50.0), unit("dt_units", "1e-4 s")], 0.005),
        (vec![number("dt_ms", 5.0)], 0.005),
        (
            vec![number("sample_rate", 0.2), unit("sample_rate_unit", "kHz")],
            0.005,
        ),
        (vec![number("fs_kHz", 0.2)], 0.005),
        (vec![number("sampling_period_us", 5000.0)], 0.005),
        (vec![number("Tinterval", 0.005)], 0.005),
    ] {
        check(
            &format!("{of_file:?}"),
            "t.h5",
            &hdf5(&of_file, &[], false),
            "acc",
            Step(step),
        );
        check(
            &format!("{of_file:?}"),
            "t.h5",
            &hdf5(&[], &of_file, false),
            "acc",
            Step(step),
        );
    }
    let of_file = [number("dt", 5.0), unit("dt_unit", "jiffies")];
    check(
        "an unknown unit of the interval",
        "t.h5",
        &hdf5(&of_file, &[], false),
        "acc",
        Named("jiffies"),
    );
}

#[test]
fn properties_of_tdms() {
    use Property::{Number, Text};
    let unit = |name, text| (name, Text(text));
    let rows: [(&[(&str, Property)], Says); 6] = [
        (
            &[
                unit("NI_UnitDescription", "g"),
                ("wf_increment", Number(0.005)),
            ],
            Unit("g"),
        ),
        (
            &[
                unit("NI_UnitDescription", "g"),
                unit("unit_string", ""),
                ("wf_increment", Number(0.005)),
            ],
            Unit("g"),
        ),
        (
            &[("wf_increment", Number(5.0)), unit("wf_xunit_string", "ms")],
            Step(0.005),
        ),
        (
            &[
                ("wf_increment", Number(5.0)),
                unit("wf_xunit_string", "jiffies"),
            ],
            Named("jiffies"),
        ),
        (
            &[("wf_increment", Number(5.0)), ("factor", Number(3.0))],
            Named("factor = 3"),
        ),
        (
            &[("wf_increment", Number(5.0)), ("cDAQ_gain", Number(3.0))],
            Named("cDAQ_gain = 3"),
        ),
    ];
    for (properties, says) in rows {
        let bytes = tdms(&[("/'g'", &[], &[]), ("/'g'/'acc'", properties, &SAMPLES)]);
        check("a property", "t.tdms", &bytes, "g.acc", says);
    }
    let scale = [
        ("NI_Number_Of_Scales", Number(1.0)),
        ("NI_Scale[0]_Scale_Type", Text("Thermocouple")),
    ];
    let bytes = tdms(&[("/'g'", &[], &[]), ("/'g'/'acc'", &scale, &SAMPLES)]);
    check(
        "a scale of another type",
        "t.tdms",
        &bytes,
        "g.acc",
        Named("Thermocouple"),
    );
}

/// An array of NumPy: numbers, or texts of up to eight letters.
fn npy(kind: &str, shape: &str, data: Vec<u8>) -> Vec<u8> {
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(data);
    bytes
}

enum Variable {
    Numbers(Vec<f64>),
    Texts(Vec<&'static str>),
}

fn npz(variables: &[(&str, Variable)]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, variable) in variables {
        let options = zip::write::SimpleFileOptions::default()
            .compression_method(zip::CompressionMethod::Stored);
        archive
            .start_file(format!("{name}.npy"), options)
            .expect("a file");
        let array = match variable {
            Variable::Numbers(numbers) => npy(
                "<f8",
                &format!("({},)", numbers.len()),
                numbers.iter().flat_map(|x| x.to_le_bytes()).collect(),
            ),
            Variable::Texts(texts) => {
                let letters = texts
                    .iter()
                    .flat_map(|text| (0..8).map(|i| text.as_bytes().get(i).copied().unwrap_or(0)));
                let shape = if texts.len() == 1 {
                    "()".to_owned()
                } else {
                    format!("({},)", texts.len())
                };
                npy(
                    "<U8",
                    &shape,
                    letters
                        .flat_map(|letter| u32::from(letter).to_le_bytes())
                        .collect(),
                )
            }
        };
        archive.write_all(&array).expect("bytes");
    }
    archive.finish().expect("an archive").into_inner()
}

/// An element of a file of MATLAB, and its arrays.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = [kind, data.len() as u32].map(u32::to_le_bytes).concat();
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

fn matrix(class: u32, name: &str, dims: [u32; 2], content: Vec<u8>) -> Vec<u8> {
    let parts = [
        element(6, &[class, 0].map(u32::to_le_bytes).concat()),
        element(5, &dims.map(u32::to_le_bytes).concat()),
        element(1, name.as_bytes()),
        content,
    ];
    element(14, &parts.concat())
}

fn mat_variable(name: &str, variable: &Variable) -> Vec<u8> {
    match variable {
        Variable::Numbers(numbers) => {
            let data: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
            matrix(6, name, [numbers.len() as u32, 1], element(9, &data))
        }
        Variable::Texts(texts) if texts.len() == 1 => {
            let letters: Vec<u8> = texts[0]
                .bytes()
                .flat_map(|letter| u16::from(letter).to_le_bytes())
                .collect();
            matrix(4, name, [1, texts[0].len() as u32], element(4, &letters))
        }
        Variable::Texts(texts) => {
            let cells: Vec<u8> = texts
                .iter()
                .flat_map(|text| mat_variable("", &Variable::Texts(vec![text])))
                .collect();
            matrix(1, name, [texts.len() as u32, 1], cells)
        }
    }
}

/// A file of MATLAB: names with a point are fields of structs.
fn mat(variables: &[(&str, Variable)]) -> Vec<u8> {
    let mut bytes = format!("{:<124}", "MATLAB 5.0 MAT-file").into_bytes();
    bytes.extend([0, 1, b'I', b'M']);
    let mut known = Vec::new();
    for (name, variable) in variables {
        let Some((group, _)) = name.split_once('.') else {
            bytes.extend(mat_variable(name, variable));
            continue;
        };
        if known.contains(&group) {
            continue;
        }
        known.push(group);
        let members = variables.iter().filter_map(|(name, variable)| {
            Some((name.strip_prefix(group)?.strip_prefix('.')?, variable))
        });
        let names: Vec<u8> = members
            .clone()
            .flat_map(|(name, _)| format!("{name:\0<16}").into_bytes())
            .collect();
        let fields: Vec<u8> = members
            .flat_map(|(_, variable)| mat_variable("", variable))
            .collect();
        let content = [element(5, &16u32.to_le_bytes()), element(1, &names), fields].concat();
        bytes.extend(matrix(2, group, [1, 1], content));
    }
    bytes
}

#[test]
fn variables_of_numpy_and_matlab() {
    let samples = || Variable::Numbers(SAMPLES.to_vec());
    let one = |x: f64| Variable::Numbers(vec![x]);
    let word = |text| Variable::Texts(vec![text]);
    let base = || vec![("force", samples()), ("acc", samples())];
    for (more, says) in [
        (vec![("acc_unit", word("g"))], Unit("g")),
        (vec![("acceleration_unit", word("g"))], Unit("g")),
        (
            vec![("units", Variable::Texts(vec!["s", "N", "g"]))],
            Named("units = [s, N, g]"),
        ),
        (vec![("acc_scale", one(3.0))], Named("acc_scale = 3")),
        (
            vec![("acc_sensitivity", one(3.0))],
            Named("acc_sensitivity = 3"),
        ),
        (
            vec![("scale", Variable::Numbers(vec![1.0, 3.0]))],
            Named("scale = [1, 3]"),
        ),
        (vec![("fs", one(200.0))], Step(0.005)),
        (vec![("fs_kHz", one(0.2))], Step(0.005)),
        (
            vec![("fs", one(0.2)), ("fs_unit", word("kHz"))],
            Step(0.005),
        ),
        (vec![("dt_ms", one(5.0))], Step(0.005)),
        (
            vec![("dt", one(5.0)), ("time_unit", word("ms"))],
            Step(0.005),
        ),
        (vec![("Tinterval", one(0.005))], Step(0.005)),
        (
            vec![("units.acc", word("g")), ("units.force", word("kN"))],
            Unit("g"),
        ),
    ] {
        let names: Vec<&str> = more.iter().map(|(name, _)| *name).collect();
        let mut variables = base();
        variables.extend(more);
        let case = names.join(", ");
        if !case.contains('.') {
            check(&case, "t.npz", &npz(&variables), "acc", says);
        }
        check(&case, "t.mat", &mat(&variables), "acc", says);
    }
    let structs = [
        ("acc.data", samples()),
        ("acc.unit", word("g")),
        ("acc.dt", one(0.005)),
        ("f.data", samples()),
        ("f.unit", word("N")),
    ];
    check("structs", "t.mat", &mat(&structs), "acc.data", Unit("g"));
    check("structs", "t.mat", &mat(&structs), "f.data", Unit("N"));
    let plot = [
        ("X.Data", samples()),
        ("X.Unit", word("N")),
        ("Y.Data", samples()),
        ("Y.Unit", word("g")),
        ("Fs", one(200.0)),
    ];
    check("plots", "t.mat", &mat(&plot), "X.Data", Unit("N"));
    check("plots", "t.mat", &mat(&plot), "Y.Data", Unit("g"));
}

/// Files with times of their own for two channels: their first times, and samples that are the whole times in steps.
#[test]
fn clocks_of_channels_are_aligned() {
    let two = |from: f64| -> Vec<f64> { TIMES.iter().map(|t| 0.005 * (t + from)).collect() };
    let steps = |from: f64| -> Vec<f64> { TIMES.iter().map(|t| t + from).collect() };
    let numbers = |x: Vec<f64>| Variable::Numbers(x);
    let named = [
        ("t_force", numbers(two(0.0))),
        ("force", numbers(steps(0.0))),
        ("t_acc", numbers(two(2.0))),
        ("acc", numbers(steps(2.0))),
    ];
    let grouped = [
        ("f.time", numbers(two(0.0))),
        ("f.force", numbers(steps(0.0))),
        ("a.time", numbers(two(2.0))),
        ("a.acc", numbers(steps(2.0))),
    ];
    let mut begun = FileBuilder::new();
    for (name, from) in [("force", 0.0), ("acc", 2.0)] {
        let set = begun
            .create_dataset(name)
            .with_f64_data(&steps(from))
            .with_shape(&[12]);
        set.set_attr("sample_rate", AttrValue::F64(200.0));
        set.set_attr("start_time", AttrValue::F64(100.0 + 0.005 * from));
    }
    let rows = (0..12).map(|i| {
        format!(
            "{:.3},{},{:.3},{}\n",
            two(0.0)[i],
            steps(0.0)[i],
            two(2.0)[i],
            steps(2.0)[i]
        )
    });
    let rows: String = rows.collect();
    let lvm = format!(
        "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\nX_Columns\tMulti\n***End_of_Header***\t\n\t\nChannels\t2\nDelta_X\t0.005\t\
         0.005\nX0\t0\t0.01\n***End_of_Header***\t\t\nX_Value\tforce\tX_Value\tacc\tComment\n{}",
        rows.replace(',', "\t")
    );
    let clock = lvm
        .replace("Multi", "No")
        .replace("X0\t0\t0.01", "Time\t12:00:00.1\t12:00:00.11");
    let clock: String = clock.replace("X_Value\tforce\tX_Value\tacc", "X_Value\tforce\tacc");
    let (head, _) = clock.split_at(clock.find("Comment\n").expect("names") + 8);
    let clock = format!(
        "{head}{}",
        (0..12)
            .map(|i| format!("\t{}\t{}\n", steps(0.0)[i], steps(2.0)[i]))
            .collect::<String>()
    );
    for (file, bytes) in [
        ("named.mat", mat(&named)),
        ("named.npz", npz(&named)),
        ("groups.mat", mat(&grouped)),
        ("begun.h5", begun.finish().expect("a file")),
        (
            "pairs.csv",
            format!("t_force (s),force (N),t_acc (s),acc (g)\n{rows}").into_bytes(),
        ),
        (
            "same.csv",
            format!("Time (s),force (N),Time (s),acc (g)\n{rows}").into_bytes(),
        ),
        ("multi.lvm", lvm.into_bytes()),
        ("clock.lvm", clock.into_bytes()),
    ] {
        let tables = Table::parse_all(file, &*bytes, &TableFormat::default())
            .unwrap_or_else(|error| panic!("{file}: {error}"));
        let end = |name: &str, end: &str| name.split([' ', '.']).any(|part| part == end);
        let table = tables
            .iter()
            .find(|table| table.headers().iter().any(|name| end(name, "acc")))
            .expect("an acceleration");
        let column = |of: &str| table.headers().iter().position(|name| end(name, of));
        let force = column("force").unwrap_or_else(|| panic!("{file}: {:?}", table.headers()));
        let acc = column("acc").expect("an acceleration");
        assert_eq!(table.samples(force), table.samples(acc), "{file}");
        assert_eq!(table.rows(), 10, "{file}");
    }
}

/// The names of all unknown units are reasons.
#[test]
fn every_unknown_unit_is_a_reason() {
    let rows = crate::headings::forced(1500, 0.002);
    let rows = rows
        .iter()
        .map(|[t, f, a]| format!("{t:.6},{f:.9e},{a:.9e}\n"));
    let text = format!(
        "time (jiffies),force (tonf),acceleration (wibbles)\n{}",
        rows.collect::<String>()
    );
    let bench = crate::workbench::Workbench::empty();
    bench.write_bytes("r.csv", text.as_bytes());
    bench.run_to(0, &["fit", "r.csv", "--out", "run", "--no-report"]);
    let document: serde_json::Value =
        serde_json::from_str(&bench.read("run/result.json")).expect("a document");
    let reasons = document["verdict"]["reasons"].to_string();
    for unit in ["jiffies", "tonf", "wibbles"] {
        assert!(reasons.contains(unit), "{unit}: {reasons}");
    }
}

/// Runs on one clock: the model that `init` writes fits.
#[test]
fn runs_on_one_clock_fit() {
    let rows = crate::headings::forced(1600, 0.002);
    let row = |i: usize| {
        let ([t, f, a], [u, g, b]) = (rows[i], rows[800 + i]);
        format!("{t:.4},{f:.9e},{a:.9e},{u:.4},{g:.9e},{b:.9e}\n")
    };
    let names = ["1", "2"].map(|run| {
        format!("Time (s) Run #{run},Force (N) Run #{run},Acceleration (m/s^2) Run #{run}")
    });
    let text = format!(
        "{}\n{}",
        names.join(","),
        (0..800).map(row).collect::<String>()
    );
    let bench = crate::workbench::Workbench::empty();
    bench.write_bytes("r.csv", text.as_bytes());
    bench.run_to(0, &["init", "r.csv", "--out", "model.yaml"]);
    bench.run_to(0, &["fit", "model.yaml", "--out", "run", "--no-report"]);
    let document: serde_json::Value =
        serde_json::from_str(&bench.read("run/result.json")).expect("a document");
    let mass = crate::headings::value(&document, "mass");
    assert!((mass / 2.0 - 1.0).abs() < 0.02, "{mass} kg");
}
