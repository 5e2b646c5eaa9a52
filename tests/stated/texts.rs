//! Texts of loggers: times in many notations, odd cells and lines, series in rows, measurement files of LabVIEW.

use crate::headings::init;
use crate::workbench::Workbench;
use std::f64::consts::TAU;
use std::fmt::Write;

/// Free decay of 2 Hz and 2 % at 50 Hz.
fn decay(i: usize) -> f64 {
    let t = 0.02 * i as f64;
    (-0.02 * TAU * 2.0 * t).exp() * (TAU * 2.0 * t).cos()
}

/// A table of 300 rows with times as `time` writes them and the decay.
fn table(header: &str, time: impl Fn(usize) -> String) -> String {
    let mut text = format!("{header}\n");
    for i in 0..300 {
        let _ = writeln!(text, "{},{:.6}", time(i), decay(i));
    }
    text
}

/// 300 samples at 50 Hz that vibrate at 2 Hz.
fn is_read(said: &str) -> bool {
    (said.contains("300 samples") || said.contains("299 samples"))
        && said.contains("0.02 s")
        && said.contains("frequency 2 Hz")
        || said.contains("frequency 1.99")
        || said.contains("frequency 2.00")
}

#[test]
fn times_in_many_notations() {
    let at = |i: usize| 0.02 * i as f64;
    let clock = |seconds: f64, sign: char| {
        let day = seconds.rem_euclid(86400.0);
        let (hours, minutes) = ((day / 3600.0).floor(), (day / 60.0).floor() % 60.0);
        format!("{hours:02}:{minutes:02}:{:06.3}", day % 60.0).replace('.', &sign.to_string())
    };
    let notations: [(&str, &dyn Fn(usize) -> String); 16] = [
        ("timestamp", &|i| {
            format!(
                "2024-01-{:02}T{}Z",
                if at(i) < 2.0 { 10 } else { 11 },
                clock(86398.0 + at(i), '.')
            )
        }),
        ("time", &|i| clock(86398.0 + at(i), '.')),
        ("Zeit", &|i| {
            format!("10.01.2024 {}", clock(36000.0 + at(i), '.'))
        }),
        ("time", &|i| {
            format!("\"01/10/2024 {} PM\"", clock(36000.0 + at(i), '.'))
        }),
        ("Time", &|i| clock(36000.0 + at(i), ':')),
        ("time", &|i| {
            format!("0 days {}", clock(36000.0 + at(i), '.'))
        }),
        ("Time", &|i| format!("{:.3} sec", at(i))),
        ("Time", &|i| {
            format!("10-Jan-2024 {}", clock(36000.0 + at(i), '.'))
        }),
        ("time", &|i| format!("{:.12}", 45301.5 + at(i) / 86400.0)),
        ("time", &|i| {
            format!("{}", 1_700_000_000_000_000_000u64 + 20_000_000 * i as u64)
        }),
        ("time", &|i| {
            format!("{}", 1_700_000_000_000_000u64 + 20_000 * i as u64)
        }),
        ("epoch", &|i| {
            format!("{}", 1_700_000_000_000u64 + 20 * i as u64)
        }),
        ("millis", &|i| format!("{}", 5000 + 20 * i)),
        ("micros()", &|i| format!("{}", 5000 + 20_000 * i)),
        ("time [us]", &|i| format!("{}", 20_000 * i)),
        ("t", &|i| format!("{:.3E}", at(i)).replace('E', "D")),
    ];
    for (header, time) in notations {
        let text = table(&format!("{header},position (mm)"), time);
        let said = init("record.csv", text.as_bytes(), &[]);
        assert!(is_read(&said), "{header}, {}: {said}", time(1));
    }
}

/// A line of units before the names is applied, for all columns or all but the times; a line of another number of units is a reason.
#[test]
fn units_before_the_names_are_applied_or_named() {
    let rows = table("t,x", |i| format!("{:.2}", 0.02 * i as f64));
    for line in [
        "# units: s, mm",
        "Units;s;mm",
        "# Einheiten: s mm",
        "% unit = mm",
    ] {
        let line = line.replacen(';', ": ", 1);
        let said = init("record.csv", format!("{line}\n{rows}").as_bytes(), &[]);
        assert!(said.contains("`x`: displacement, mm"), "{line}: {said}");
    }
    let text = format!("# units: s, mm, N, V\n{rows}");
    let said = init("record.csv", text.as_bytes(), &[]);
    assert!(said.contains("units = [s, mm, N, V]"), "{said}");
    // A device, and no unit of measurement.
    let said = init("record.csv", format!("# Unit: 12\n{rows}").as_bytes(), &[]);
    assert!(!said.contains("not applied"), "{said}");
}

#[test]
fn odd_cells_and_lines_are_read_and_said() {
    let plain = table("time (s),position (mm)", |i| {
        format!("{:.2}", 0.02 * i as f64)
    });
    let with = |row: usize, cell: &str| {
        let mut lines: Vec<String> = plain.lines().map(str::to_owned).collect();
        let time = lines[row].split(',').next().expect("a time").to_owned();
        lines[row] = format!("{time},{cell}");
        lines.join("\n") + "\n"
    };
    for cell in ["OVLD", "---", "OL", "#N/A", "NaN", "No Data"] {
        let said = init("record.csv", with(40, cell).as_bytes(), &[]);
        assert!(is_read(&said), "{cell}: {said}");
    }
    for (name, text) in [
        (
            "footer",
            format!("{plain}\nMaximum: 1.0\nEnd of data, operator: ab\n"),
        ),
        ("one footer", format!("{plain}# end\nEOF\n")),
        ("statistics", format!("{plain}Mean,0.1\n\"Std\",2.5\n")),
        (
            "header inside",
            plain.replace("0.40,", "time (s),position (mm)\n0.40,"),
        ),
    ] {
        let said = init("record.csv", text.as_bytes(), &[]);
        assert!(
            is_read(&said) && said.contains("left out"),
            "{name}: {said}"
        );
    }
    let thousands = table("time (s),position (mm)", |i| {
        format!("{:.2}", 0.02 * i as f64)
    })
    .replace("time (s),position (mm)\n", "");
    let thousands: String = thousands
        .lines()
        .map(|line| {
            let (t, y) = line.split_once(',').expect("two fields");
            format!(
                "{t},\"1,{:07.3}\"\n",
                234.0 + y.parse::<f64>().expect("a number")
            )
        })
        .collect();
    let said = init(
        "record.csv",
        format!("time (s),position (um)\n{thousands}").as_bytes(),
        &[],
    );
    assert!(is_read(&said), "{said}");
    let commas: String = plain
        .lines()
        .skip(1)
        .map(|line| {
            let (t, y) = line.split_once(',').expect("two fields");
            format!("\"{}\",\"{}\"\n", t.replace('.', ","), y.replace('.', ","))
        })
        .collect();
    let said = init(
        "record.csv",
        format!("time (s),position (mm)\n{commas}").as_bytes(),
        &[],
    );
    assert!(is_read(&said), "{said}");
    for header in [
        "# time (s),position (mm)",
        "# Recorded by a program\n# time, position\n# s, mm",
        "# time (s) position (mm)",
    ] {
        let text = plain.replace("time (s),position (mm)", header);
        let said = init("record.csv", text.as_bytes(), &[]);
        assert!(
            is_read(&said) && said.contains("displacement, mm"),
            "{header}: {said}"
        );
    }
}

#[test]
fn series_in_rows() {
    let values: Vec<f64> = (0..300).map(decay).collect();
    let rows = |per_line: usize| -> String {
        let row = |row: &[f64]| row.iter().map(|x| format!("{x:10.5}")).collect::<String>() + "\n";
        values.chunks(per_line).map(row).collect()
    };
    let knet = "Origin Time       2024/01/10 10:00:00\nSampling Freq(Hz) 50Hz\nDuration Time(s)  6\nDir.              N-S\nScale Factor      3920(gal)/6182761\nMax. Acc. (gal)   1.0\nMemo.\n";
    for (name, header, per_line, unit) in [
        (
            "a.at2",
            "PEER\nRECORD\nACCELERATION TIME SERIES IN UNITS OF G\n  300   0.0200   NPTS, DT\n",
            5,
            "acceleration, g",
        ),
        (
            "a.vt2",
            "PEER\nRECORD\nVELOCITY TIME SERIES IN UNITS OF CM/S\nNPTS=  300, DT=   .0200 SEC\n",
            5,
            "velocity, cm/s",
        ),
        (
            "a.v2",
            "COSMOS\n     300 points of accel data equally spaced at  .020 sec, in cm/sec2.   (8f10.5)\n",
            8,
            "acceleration, cm/s²",
        ),
        (
            "a.txt",
            "TIMESERIES XX_A_00_HNZ_D, 300 samples, 50 sps, 2024-01-10T10:00:00, SLIST, FLOAT, M/S**2\n",
            6,
            "acceleration, m/s²",
        ),
        ("a.NS", knet, 8, "acceleration, gal"),
    ] {
        let said = init(name, format!("{header}{}", rows(per_line)).as_bytes(), &[]);
        assert!(is_read(&said) && said.contains(unit), "{name}: {said}");
    }
}

#[test]
fn measurement_files_of_labview() {
    let head = |columns: &str| {
        format!(
            "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\nX_Columns\t{columns}\n***End_of_Header***\t\n\t\nChannels\t2\nSamples\t300\t300\nY_Unit_Label\tmm\tN\nX0\t0\t0\nDelta_X\t0.02\t0.02\n***End_of_Header***\t\t\n"
        )
    };
    let rows = |form: &dyn Fn(f64, f64) -> String| -> String {
        (0..300).map(|i| form(0.02 * i as f64, decay(i))).collect()
    };
    let none = format!(
        "{}X_Value\tPosition\tForce\tComment\n{}",
        head("No"),
        rows(&|_, y| format!("\t{y:.6}\t{:.6}\n", -y))
    );
    let one = format!(
        "{}X_Value\tPosition\tForce\tComment\n{}",
        head("One"),
        rows(&|t, y| format!("{t:.6}\t{y:.6}\t{:.6}\n", -y))
    );
    let multi = format!(
        "{}X_Value\tPosition\tX_Value\tForce\tComment\n{}",
        head("Multi"),
        rows(&|t, y| format!("{t:.6}\t{y:.6}\t{t:.6}\t{:.6}\n", -y))
    );
    for (name, text) in [("none", &none), ("one", &one), ("multi", &multi)] {
        let said = init("record.lvm", text.as_bytes(), &[]);
        assert!(
            is_read(&said) && said.contains("displacement, mm") && said.contains("force, N"),
            "{name}: {said}"
        );
    }
    // A missing sample keeps its row.
    let gap = one.replace(
        &format!("{:.6}\t{:.6}\t", 0.2, decay(10)),
        &format!("{:.6}\t\t", 0.2),
    );
    let said = init("record.lvm", gap.as_bytes(), &[]);
    assert!(
        said.contains("299 samples over 5.98 s") && said.contains("1 missing"),
        "{said}"
    );
    let bench = Workbench::empty();
    bench.write("a.lvm", &none);
    bench.write("b.dat2", "t,y\n0,1\n1,2\n2,3\n");
    assert!(
        bench
            .run_to(0, &["check", "a.lvm"])
            .contains("LabVIEW measurement file")
    );
    assert!(bench.run_to(0, &["check", "b.dat2"]).contains("column"));
}

/// Columns are chosen by options; a hint names no column that is not there.
#[test]
fn columns_are_chosen_by_options() {
    let text = table("a,b", |i| format!("{:.2}", 0.02 * i as f64));
    let said = init(
        "r.csv",
        text.as_bytes(),
        &["--time", "a", "--response", "velocity=b"],
    );
    assert!(is_read(&said) && said.contains("`b`: velocity"), "{said}");
    let three = table("t,disp (mm),acc (g)", |i| {
        format!("{:.2},{:.4}", 0.02 * i as f64, decay(i))
    });
    let said = init("r.csv", three.as_bytes(), &["--response", "acc (g)"]);
    assert!(
        said.contains("acceleration, g") && said.contains("not used: `disp (mm)`"),
        "{said}"
    );
    let bench = Workbench::empty();
    bench.write("r.csv", &text);
    for arguments in [
        ["--time", "x"],
        ["--response", "x"],
        ["--response", "mass=b"],
    ] {
        let (code, _, said) = bench.run(&[&["init", "r.csv"][..], &arguments].concat());
        assert!(code == 2 && said.contains("expected"), "{said}");
    }
}

/// What drives the system beside a response: an input by its unit, else left out; what `init` writes is fitted.
#[test]
fn drives_and_motions_of_the_ground() {
    let row = |i: usize| {
        let t = 0.02 * i as f64;
        let base = 1e-2 * (TAU * 1.1 * t).sin();
        (base, base + 1e-2 * decay(i))
    };
    for header in [
        "time (s),ground_x,x",
        "time (s),ground_m,top_m",
        "time (s),drive_V,position (m)",
        "time (s),motor,angle (rad)",
        "time (s),base displacement (m),displacement (m)",
        "time (s),table acceleration (g),acceleration (g)",
    ] {
        let mut text = format!("{header}\n");
        for i in 0..400 {
            let (base, top) = row(i);
            let _ = writeln!(text, "{:.2},{base:.6},{top:.6}", 0.02 * i as f64);
        }
        let bench = Workbench::empty();
        bench.write("r.csv", &text);
        let said = bench.run_to(0, &["init", "r.csv"]);
        let (code, _, error) = bench.run(&["fit", "r.yaml", "--no-report"]);
        assert!(code != 2, "{header}: {said}{error}");
        // Both displacements are measured from the ground.
        let is_displacement = header.contains("ground") || header.contains("base");
        let model = bench.read("r.yaml");
        assert!(
            model.contains("absolute: true") == is_displacement,
            "{header}: {model}"
        );
        assert!(
            !said.contains("drive_V`: ") && !said.contains("motor`: "),
            "{header}: {said}"
        );
    }
}
