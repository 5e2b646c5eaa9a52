//! Classes of MATLAB that hold no plain numbers, with the lines of MATLAB that export them.

use std::path::Path;

use crate::text_io::quote;

/// Name for the file in a line of MATLAB.
fn file_name(path: &Path) -> String {
    let name = path.file_name().map(|name| name.to_string_lossy());
    name.unwrap_or_default().replace('\'', "''")
}

/// The line of MATLAB that saves an object of a class as numbers.
pub(super) fn export(path: &Path, name: &str, class: &str) -> String {
    let convert = match class {
        "timetable" => format!(
            "S = table2struct(timetable2table({name}), 'ToScalar', true); S.Time = seconds(S.Time - S.Time(1));"
        ),
        "table" => format!("S = table2struct({name}, 'ToScalar', true);"),
        "timeseries" => format!("S.time = {name}.Time; S.data = squeeze({name}.Data);"),
        "datetime" => format!("S.time = seconds({name} - {name}(1));"),
        "duration" => format!("S.time = seconds({name});"),
        _ => format!("S = struct({name});"),
    };
    format!(
        "in MATLAB: `{convert} save('{}', 'S', '-v7')`",
        file_name(path)
    )
}

/// The line of MATLAB that saves a file of version 7.3 in version 7.
pub(super) fn save_as_version_7(path: &Path) -> String {
    let name = file_name(path);
    format!("in MATLAB: `load('{name}'); save('{name}', '-v7')`")
}

/// Classes of version 5 without plain numbers.
pub(super) const CHAR: u32 = 4;
pub(super) const SPARSE: u32 = 5;
pub(super) const FUNCTION: u32 = 16;

/// Content of an object of a class.
pub(super) fn object(class: &str) -> String {
    format!("an object of the class {}", quote(class))
}

/// Content and remedy of arrays of the classes of version 5 without plain numbers.
pub(super) fn old(class: u32) -> (&'static str, Option<&'static str>) {
    match class {
        3 => ("an object", Some("save its numbers as a struct")),
        CHAR => ("text", None),
        SPARSE => ("a sparse matrix", Some("save it as `full(x)`")),
        FUNCTION => ("a function", None),
        _ => ("data of an unknown class", None),
    }
}
