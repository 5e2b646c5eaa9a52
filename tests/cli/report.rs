//! `kmcfit report`: units and width of page and figures.

use crate::workbench::{MODEL, Workbench};
use insta::assert_snapshot;

/// Number in an attribute of an SVG element.
fn number(node: &roxmltree::Node, name: &str) -> Option<f64> {
    node.attribute(name)?.parse().ok()
}

/// Fonts, curve widths (both in pt) and width (mm) of a drawing, by the ratio of its width to its `viewBox`.
fn sizes(svg: &str) -> (Vec<f64>, Vec<f64>, f64) {
    let page = roxmltree::Document::parse(svg).expect("well-formed");
    let root = page.root_element();
    let width = root.attribute("width").and_then(|w| w.strip_suffix("mm"));
    let width: f64 = width.expect("mm").parse().expect("a number");
    let units = root.attribute("viewBox").and_then(|v| v.split(' ').nth(2));
    let points = width / 25.4 * 72.0 / units.expect("a width").parse::<f64>().expect("a number");
    let all = |name: &str| {
        let values = page.descendants().filter_map(|node| number(&node, name));
        values.map(|value| points * value).collect::<Vec<f64>>()
    };
    (all("font-size"), all("stroke-width"), width)
}

/// Figures have the width of one or two columns with fonts of 7 to 9 pt and lines of 0.5 to 1 pt (coordinates are in tenths of a pixel,
/// 0.075 pt); page and figures have the unit for display, and the residual of the page that of the result times 1000. Tables and
/// result.json stay as they are. Mistakes write nothing.
#[test]
fn reports_have_other_units_and_widths() {
    let bench = Workbench::with_small_model();
    let parts = "{basis: piecewise-linear, knots: 3, start: 1.0}";
    bench.write(
        "model.yaml",
        &MODEL.replace("{basis: nodal, start: 1.0}", parts),
    );
    bench.run_to(0, &["fit", "model.yaml", "--out", "run"]);
    let result = bench.read("run/result.json");
    for (width, arguments) in [
        (180.0, vec![]),
        (85.0, vec!["--width", "85", "--units", "displacement=mm"]),
    ] {
        let report = ["report", "run"].into_iter().chain(arguments);
        bench.run_to(0, &report.collect::<Vec<_>>());
        for name in [
            "observation",
            "residuals",
            "functions",
            "ratios",
            "convergence",
            "residual_tests",
            "spectra",
        ] {
            let svg = bench.read(&format!("run/figures/{name}.svg"));
            let (fonts, lines, found) = sizes(&svg);
            assert_eq!(found, width, "{name}");
            assert!(
                fonts.len() > 5 && fonts.iter().all(|size| (7.0..9.03).contains(size)),
                "{name} {width}: {fonts:?}"
            );
            let is_fine = |size: &f64| (0.5 - 0.04..1.0 + 0.04).contains(size);
            assert!(
                lines.len() > 5 && lines.iter().all(is_fine),
                "{name} {width}: {lines:?}"
            );
        }
    }
    assert_eq!(bench.read("run/result.json"), result);
    let page = bench.read("run/report.html");
    assert!(page.contains("displacement y (mm)") && !page.contains("displacement y (m)"));
    assert!(
        bench
            .read("run/figures/observation.svg")
            .contains("displacement y (mm)")
    );
    let result: serde_json::Value = serde_json::from_str(&result).expect("JSON");
    let rms = result["experiments"][0]["channels"][0]["rms_residual"].as_f64();
    let rms = format!("{:.3} mm", 1e3 * rms.expect("a number"));
    assert!(page.contains(&rms), "{rms}");

    let before = bench.contents();
    let mistakes = [
        ["--width", "90"],
        ["--units", "acceleratoin=g"],
        ["--units", "acceleration=rad/s^2"],
        ["--units", "g"],
        ["--units", "force=N,force=kN"],
    ];
    let mut messages = String::new();
    for mistake in mistakes {
        let (code, stdout, stderr) = bench.run(&[&["report", "run"], &mistake[..]].concat());
        assert_eq!((code, stdout.as_str()), (2, ""), "{mistake:?}");
        messages += &stderr;
    }
    assert!(bench.contents() == before, "nothing is written");
    assert_snapshot!(messages, @"
    error: --width: invalid width of the figures
      found: `90`
      expected: 85 (one column of a journal) or 180 (two), in mm
    error: --units: unknown quantity
      found: `acceleratoin`
      expected: one of: displacement, velocity, acceleration, force
      hint: did you mean `acceleration`?
    error: --units: not a unit of the acceleration of a translation
      found: `rad/s²`
      expected: one of: m/s², mm/s², g, mg, gal, in/s², ft/s²
    error: --units: a unit without its quantity
      found: `g`
      expected: quantities and units, as in `acceleration=g,force=kN`
    error: --units: the quantity is given twice
      found: `force=N,force=kN`
      expected: one unit for each quantity
    ");
}
