//! Snapshots of folders, and the complete runs in them.

use kmcfit::results::{FileRecord, MANIFEST, Manifest};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Entry at a path; links are not followed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Entry {
    Folder,
    Link(PathBuf),
    File(Vec<u8>),
}

/// All entries below a folder, by relative path.
pub type Tree = BTreeMap<String, Entry>;

/// Names of temporary files of a killed run, which the next run removes.
const ON_ITS_WAY: &str = ".kmcfit-";

pub fn tree(root: &Path) -> Tree {
    let mut found = Tree::new();
    collect(root, "", &mut found);
    found
}

fn collect(root: &Path, below: &str, found: &mut Tree) {
    for entry in fs::read_dir(root.join(below)).expect("a folder") {
        let name = entry.expect("an entry").file_name();
        let name = format!("{below}{}", name.to_string_lossy());
        let path = root.join(&name);
        let metadata = path.symlink_metadata().expect("an entry");
        if metadata.is_symlink() {
            let target = fs::read_link(&path).expect("a link");
            found.insert(name, Entry::Link(target));
        } else if metadata.is_dir() {
            found.insert(name.clone(), Entry::Folder);
            collect(root, &format!("{name}/"), found);
        } else {
            found.insert(name, Entry::File(fs::read(&path).expect("a file")));
        }
    }
}

/// The entries without temporary files of a killed run.
pub fn settled(tree: &Tree) -> Tree {
    let mut settled = tree.clone();
    settled.retain(|name, _| !name.split('/').any(|part| part.starts_with(ON_ITS_WAY)));
    settled
}

/// The files of a run as its manifest lists them, if all of them have the contents that it records.
pub fn whole_run(folder: &Path) -> Result<BTreeMap<String, FileRecord>, String> {
    let manifest = Manifest::read(folder).map_err(|error| error.to_string())?;
    let manifest = manifest.ok_or_else(|| format!("no {MANIFEST}"))?;
    for (name, record) in &manifest.files {
        let bytes = fs::read(folder.join(name)).map_err(|error| format!("{name}: {error}"))?;
        if FileRecord::of(&bytes) != *record {
            return Err(format!("{name} is another file than the manifest records"));
        }
    }
    Ok(manifest.files)
}

/// Copies a folder with all that is in it.
pub fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder");
    for (name, entry) in tree(from) {
        let path = to.join(name);
        match entry {
            Entry::Folder => fs::create_dir_all(path).expect("a folder"),
            Entry::File(bytes) => fs::write(path, bytes).expect("a file"),
            Entry::Link(_) => panic!("no links are copied"),
        }
    }
}
