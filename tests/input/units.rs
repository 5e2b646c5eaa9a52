//! The unit of a column, from all places that may state it, and the warnings if they differ.

use insta::assert_snapshot;
use kmcfit::config::{BuildMode, ModelFile, build};
use kmcfit_core::finding::Finding;

/// Warnings about a table with columns of time and displacement, or its error; and the last time, s.
fn built(table: &str, names: [&str; 2], units: &str) -> Result<(String, f64), String> {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("d.csv"), table).expect("room");
    let [time, reading] = names;
    let text = format!(
        "format: 1\nexperiments:\n  - data: d.csv\n    columns: {{time: {time}, displacement: \
         {reading}}}\n    {units}\n    initial: {{displacement: 1, velocity: 0}}\ngrid: {{nodes: 101}}\nfunctions: {{mass: \
         {{basis: constant, start: 2}}, damping: {{fixed: 0}}, stiffness: {{fixed: 1}}}}\n"
    );
    let said = |error: kmcfit::error::InputError| {
        let location = format!("{}/", folder.path().display());
        error.to_string().replace(&location, "")
    };
    let file = ModelFile::parse(folder.path().join("m.yaml"), text).map_err(said)?;
    let model = build(&file, BuildMode::Fit).map_err(said)?;
    let grid = &model.problem.system.grid;
    let about_units = |w: &&Finding| w.check.contains("unit");
    let warnings: Vec<&str> = (model.warnings.iter().filter(about_units))
        .map(|w| w.sentence.as_str())
        .collect();
    Ok((warnings.join("\n"), grid.time(grid.nodes() - 1)))
}

/// A table of a cosine with a period of 20 rows; its times count rows.
fn rows(head: &str) -> String {
    let row = |i: usize| format!("{i},{}\n", 1000.0 * (i as f64 * 0.314).cos());
    format!("{head}\n{}", (0..101).map(row).collect::<String>())
}

#[test]
fn a_name_that_ends_like_another_unit_is_a_warning_for_times_and_samples() {
    let (warnings, time) = built(&rows("t_ms,y_mm"), ["t_ms", "y_mm"], "").expect("a model");
    assert_eq!(time, 100.0);
    assert_snapshot!(warnings, @"
    experiments[0].columns.displacement: column `y_mm`: m is assumed, although its name ends in mm; add `units: {displacement: mm}` if it is in mm
    experiments[0].columns.time: column `t_ms`: s is assumed, although its name ends in ms; add `units: {time: ms}` if it is in ms
    ");
    // The remedy that the warnings suggest.
    let units = "units: {time: ms, displacement: mm}";
    let (warnings, time) = built(&rows("t_ms,y_mm"), ["t_ms", "y_mm"], units).expect("a model");
    assert_eq!((warnings.as_str(), time), ("", 0.1));
    let units = "units: {time: s, displacement: m}";
    let (warnings, time) = built(&rows("t_ms,y_mm"), ["t_ms", "y_mm"], units).expect("a model");
    assert_eq!(time, 100.0);
    assert_snapshot!(warnings, @"
    experiments[0].units.displacement: column `y_mm`: unit taken from the model (m); the file says mm
    experiments[0].units.time: column `t_ms`: unit taken from the model (s); the file says ms
    ");
}

#[test]
fn a_name_that_ends_like_another_unit_than_the_file_states() {
    let head = "t_s [ms],y_mm\nms,m";
    let (warnings, time) = built(&rows(head), ["1", "y_mm"], "").expect("a model");
    assert_eq!(time, 0.1);
    assert_snapshot!(warnings, @"
    experiments[0].columns.displacement: column `y_mm`: unit taken from the file's row of units (m); its name ends in mm
    experiments[0].columns.time: column `t_s [ms]`: unit taken from the file's row of units (ms); its name ends in s
    ");
    let unknown = built(&rows("t [weeks],y"), ["t", "y"], "")
        .expect("a model")
        .0;
    assert_snapshot!(unknown, @"experiments[0].columns.time: the unit `weeks` of the time in the column `t [weeks]` is not known: s is assumed; state one under `units`");
}

#[test]
fn a_name_and_a_row_of_units_that_differ_are_refused() {
    let head = "t [s],y [mm]\ns,m";
    assert_snapshot!(built(&rows(head), ["t", "y"], "").expect_err("a contradiction"), @"
    d.csv:2:1: experiments[0].columns.displacement: two units for the column `y [mm]`
      found: `m` in the row of units (line 2), `mm` in the column name (line 1)
      expected: the same unit in both, or in one of them
      hint: state the unit in the model: `units: {displacement: …}`
    ");
    let head = "t [ms],y [m]\ns,m";
    let said = built(&rows(head), ["t", "y"], "").expect_err("a contradiction");
    assert!(
        said.contains("columns.time: two units for the column `t [ms]`"),
        "{said}"
    );
    let units = "units: {time: ms}";
    let (warnings, time) = built(&rows(head), ["t", "y"], units).expect("a model");
    assert_eq!(time, 0.1);
    assert_snapshot!(warnings, @"experiments[0].units.time: column `t [ms]`: unit taken from the model (ms); the file says s");
}

#[test]
fn a_column_of_standard_deviations_in_another_unit() {
    let row = |i: usize| format!("{i},{},1\n", (f64::from(i as u32) * 0.314).cos());
    let text = format!("t_s,y_m,s_mm\n{}", (0..101).map(row).collect::<String>());
    let units = "sigma: {displacement: s_mm}";
    let (warnings, _) = built(&text, ["t_s", "y_m"], units).expect("a model");
    assert_snapshot!(warnings, @"experiments[0].sigma.displacement: column `s_mm`: unit taken from the samples (m); the file says mm");
}
