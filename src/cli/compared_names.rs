//! Names of the runs of a comparison.

use crate::results::{COMPARE_JOURNAL, MANIFEST};
use std::path::{Path, PathBuf};

/// Name of each run: the name of its file or folder, numbered if it is taken. No fitted model gets the name of a compared
/// run's folder or of a file of the comparison.
pub(super) fn names(paths: &[PathBuf], out: &Path) -> Vec<String> {
    let runs: Vec<PathBuf> = paths
        .iter()
        .filter(|path| path.is_dir())
        .filter_map(|path| path.canonicalize().ok())
        .collect();
    let mut taken: Vec<String> = [
        "figures",
        "compare.csv",
        "compare.html",
        COMPARE_JOURNAL,
        MANIFEST,
    ]
    .map(String::from)
    .into();
    let mut names = Vec::new();
    for path in paths {
        let stem = stem(path);
        let numbered = (2..).map(|i| format!("{stem}-{i}"));
        let mut wanted = std::iter::once(stem.clone()).chain(numbered);
        let free = |name: &String| {
            let place = out.join(name).canonicalize();
            let overwrites = !path.is_dir() && place.is_ok_and(|place| runs.contains(&place));
            // Some file systems ignore case.
            !taken.contains(&name.to_lowercase()) && !overwrites
        };
        let name = wanted.find(free).unwrap_or(stem.clone());
        taken.push(name.to_lowercase());
        names.push(name);
    }
    names
}

fn stem(path: &Path) -> String {
    let whole = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let name = match path.is_dir() {
        true => whole.file_name(),
        false => return super::stem(path),
    };
    name.map_or_else(|| "run".into(), |name| name.to_string_lossy().into_owned())
}
