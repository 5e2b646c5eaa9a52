//! Records and, where there is one, their model in; model, text, coefficients and page out: bytes in memory.

use kmcfit::config::{ModelFile, Source, Statements, scaffold};
use kmcfit::error::InputError;
use kmcfit_core::host::{Host, set_host};
use std::cell::RefCell;
use std::time::Duration;

#[link(wasm_import_module = "host")]
unsafe extern "C" {
    /// Time of the host, s.
    safe fn seconds() -> f64;
}

thread_local! {
    static INPUT: RefCell<Vec<Vec<u8>>> = const { RefCell::new(Vec::new()) };
    static OUTPUT: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

/// The results of a fit. The arguments are path and text of the model, and data files, each a name and a content. For an empty text it is
/// the model that `kmcfit init` writes for the first file.
fn analysed(path: &str, text: &str, files: &[Vec<u8>]) -> Result<[String; 4], InputError> {
    let (files, _) = files.as_chunks::<2>();
    let files: Vec<_> = files
        .iter()
        .map(|[name, content]| (as_text(name), content.as_slice()))
        .collect();
    let text = match (text, files.as_slice()) {
        ("", [(name, content), ..]) => {
            scaffold(&[Source::in_memory(name, *content)], &Statements::default())?.text
        }
        _ => text.to_owned(),
    };
    let files = files.into_iter();
    let files = files.map(|(name, content)| (name, content.into()));
    let file = ModelFile::parse(path, text)?.with_files(files);
    let found = kmcfit::analyse(&file, &mut |_| {})?;
    let tables = found.fit.tables(&found.document).into_iter();
    let functions = tables.filter(|(name, _)| name == "functions.csv");
    let functions = functions.map(|(_, table)| table).collect();
    Ok([file.text.clone(), found.text(), functions, found.page()])
}

fn as_text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Begins a part of the input.
#[unsafe(no_mangle)]
pub extern "C" fn begin() {
    INPUT.with_borrow_mut(|input| input.push(Vec::new()));
}

/// Adds a byte to the last part of the input.
#[unsafe(no_mangle)]
pub extern "C" fn push(byte: u8) {
    INPUT.with_borrow_mut(|input| {
        if let Some(part) = input.last_mut() {
            part.push(byte);
        }
    });
}

/// Fits the input; the number of bytes of the output: the results or an error, each of which ends with a zero.
#[unsafe(no_mangle)]
pub extern "C" fn analyse() -> u32 {
    set_host(Host {
        clock: || Duration::from_secs_f64(seconds()),
        progress: |_, _| {},
        is_interrupted: || false,
    });
    let input = INPUT.take();
    let found = match input.as_slice() {
        [path, text, files @ ..] => analysed(&as_text(path), &as_text(text), files),
        _ => Ok(Default::default()),
    };
    let found = found.map_or_else(|error| vec![error.to_string()], Vec::from);
    let output: Vec<u8> = (found.iter())
        .flat_map(|part| part.bytes().chain([0]))
        .collect();
    let length = output.len() as u32;
    OUTPUT.set(output);
    length
}

/// A byte of the output, by its index.
#[unsafe(no_mangle)]
pub extern "C" fn output(index: u32) -> u8 {
    OUTPUT.with_borrow(|output| output.get(index as usize).copied().unwrap_or_default())
}
