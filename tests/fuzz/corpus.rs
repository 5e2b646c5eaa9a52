//! Inputs of the fuzz tests: the corpus, shipped files and generated long inputs.

use crate::targets::made;
use std::fs;
use std::path::{Path, PathBuf};

/// Largest number of bytes of a shipped table.
const LONGEST: usize = 4000;

/// All inputs of a target except mutations, with names.
pub fn seeds(target: &str) -> Vec<(String, Vec<u8>)> {
    let mut seeds = files(&format!("tests/fuzz/corpus/{target}"));
    assert!(!seeds.is_empty(), "the corpus of {target}");
    match target {
        "model" => seeds.extend(files("models")),
        "channels" => {
            seeds.extend(files("tests/formats"));
            seeds.extend(files("tests/formats/storage"));
        }
        "table" => {
            let cut = |(name, mut bytes): (String, Vec<u8>)| {
                bytes.truncate(LONGEST);
                (name, bytes)
            };
            seeds.extend(files("data").into_iter().map(cut));
        }
        _ => {}
    }
    let made = made(target).into_iter().enumerate();
    seeds.extend(made.map(|(i, bytes)| (format!("made {i}"), bytes)));
    seeds.extend(long(target).map(|(name, text)| (name.to_owned(), text.into_bytes())));
    seeds
}

fn files(folder: &str) -> Vec<(String, Vec<u8>)> {
    let folder: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let entries = fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let read = |path: PathBuf| (path.display().to_string(), fs::read(&path).expect("a file"));
    let paths = entries.map(|entry| entry.expect("an entry").path());
    paths.filter(|path| path.is_file()).map(read).collect()
}

/// Long repetitive inputs, which are generated instead of stored.
fn long(target: &str) -> impl Iterator<Item = (&'static str, String)> {
    let repeat = |text: &str, times: usize| text.repeat(times);
    let model = "format: 1\nfunctions: {mass: {fixed: &m 1}, damping: {fixed: 0}, stiffness: {basis: \
                 constant, start: 1}}\ngrid: {nodes: 9}\n";
    let record = "initial: {displacement: 1, velocity: 0}";
    let inputs = match target {
        "model" => vec![
            ("brackets", repeat("[", 200_000)),
            ("braces", repeat("{a: ", 60_000)),
            ("dashes", repeat("- ", 130_000)),
            ("questions", repeat("? ", 130_000)),
            ("colons", repeat("a: ", 80_000)),
            (
                "aliases of a long list",
                format!(
                    "a: &a [{}]\nb: [{}]\n",
                    repeat("1,", 20_000),
                    repeat("*a,", 900)
                ),
            ),
            (
                "aliases of a long text",
                format!(
                    "{model}experiments: [{{{record}}}]\npredict: &a {}\ntitle: [{}]\n",
                    repeat("x", 200_000),
                    repeat("*a,", 900)
                ),
            ),
            (
                "aliases of aliases",
                format!(
                    "a0: &a0 [1]\n{}",
                    (1..60)
                        .map(|i| format!("a{i}: &a{i} [{}]\n", repeat(&format!("*a{},", i - 1), 9)))
                        .collect::<String>()
                ),
            ),
            (
                "aliases of records",
                format!(
                    "{model}experiments:\n- &r {{{record}}}\n{}",
                    repeat("- *r\n", 990)
                ),
            ),
            ("deep", (0..600).map(|i| " ".repeat(i) + "a:\n").collect()),
            ("anchors", repeat("&a ", 80_000) + "*a"),
            (
                "many anchors",
                (0..30_000).map(|i| format!("&a{i} ")).collect::<String>() + "*a1",
            ),
            ("stars", repeat("*", 260_000)),
            (
                "aliases",
                format!("a: &a 1\nb: [{}]", repeat("*a,", 80_000)),
            ),
            ("quotes", repeat("'", 260_000)),
            ("double quotes", repeat("\"\\n", 80_000)),
            ("comments", repeat("#\n", 130_000)),
            ("tags", repeat("!t ", 80_000)),
            ("documents", repeat("---\n", 60_000)),
            ("same keys", repeat("format: 1\n", 25_000)),
            (
                "unknown keys",
                (0..25_000).map(|i| format!("k{i}: 1\n")).collect(),
            ),
            (
                "numbers",
                format!(
                    "{model}experiments: [{{{record}}}]\npredict: [{}]",
                    repeat("1,", 100_000)
                ),
            ),
            ("folded", format!("title: >\n{}", repeat("  a\n", 60_000))),
            (
                "experiments",
                format!(
                    "{model}experiments:\n{}",
                    repeat(&format!("- {{{record}}}\n"), 5000)
                ),
            ),
            (
                "names",
                format!(
                    "{model}experiments:\n{}",
                    (0..900)
                        .map(|i| format!("- {{name: e{i}, {record}}}\n"))
                        .collect::<String>()
                ),
            ),
            (
                "constraints",
                format!(
                    "{model}experiments: [{{{record}}}]\nconstraints:\n{}",
                    repeat("- {function: stiffness, shape: convex}\n", 6000)
                ),
            ),
            (
                "penalties",
                model.replace(
                    "start: 1}}",
                    &format!(
                        "start: 1, penalty: [{}]}}}}",
                        repeat("{order: 1, weight: 1},", 10_000)
                    ),
                ) + &format!("experiments: [{{{record}}}]\n"),
            ),
            (
                "candidates",
                format!(
                    "{model}experiments: [{{{record}}}]\nstudy: {{candidates: [{}]}}",
                    (0..3000)
                        .map(|i| format!("{{name: c{i}, {record}}},"))
                        .collect::<String>()
                ),
            ),
        ],
        "table" => vec![
            ("commas", repeat(",", 1_000_000)),
            ("long line", repeat("1", 3_000_000)),
            (
                "wide",
                repeat("1,", 9_000) + "1\n" + &repeat("2,", 9_000) + "2\n",
            ),
            (
                "wide texts",
                repeat("a,", 400_000) + "\n" + &repeat("x,", 400_000),
            ),
            ("tall", repeat("1\n", 400_000)),
            ("tall and empty", format!("a,b\n{}", repeat(",\n", 300_000))),
            ("one tall", format!("t,y\n{}", repeat("0,-\n", 200_000))),
            ("blank lines", repeat("\n", 1_000_000)),
            ("carriage returns", repeat("1\r", 400_000)),
            ("mixed ends", repeat("1\r", 400_000) + "\n"),
            ("comments", repeat("#\n", 500_000)),
            ("quotes", repeat("\"", 1_000_000)),
            ("open quote", format!("t,y\n\"{}", repeat("0,1\n", 200_000))),
            ("blanks", repeat(" ", 1_000_000)),
            ("blanks and signs", repeat("1 ", 500_000)),
            (
                "semicolons",
                format!("t;y\n{}", repeat("0,1;1,5\n", 100_000)),
            ),
            ("digits", format!("t,y\n0,{}\n", repeat("9", 900_000))),
        ],
        "run" => vec![
            ("json brackets", "{".to_owned() + &repeat("[", 300_000)),
            (
                "json maps",
                format!("{{\"a\":[{}{{}}]}}", repeat("{\"\":0},", 100_000)),
            ),
            (
                "json lists",
                format!("{{\"a\":[{}0]}}", repeat("[],", 200_000)),
            ),
            ("commas", format!("t_s,mass_kg{}", repeat(",", 1_000_000))),
            ("rows", format!("iteration\n{}", repeat("\n", 500_000))),
        ],
        "yaml" | "override" => vec![(
            "aliases of a long list",
            format!(
                "title=\nlist: &a [{}]\nb: [{}]\n",
                repeat("1,", 20_000),
                repeat("*a,", 900)
            ),
        )],
        _ => vec![
            (
                "lines",
                "lbfgs\n".to_owned() + &repeat("[1,\"nothing\"]\n", 20_000),
            ),
            (
                "units",
                "lbfgs\n".to_owned()
                    + &(1..20_000)
                        .map(|i| format!("[{i},\"nothing\"]\n"))
                        .collect::<String>(),
            ),
        ],
    };
    inputs.into_iter()
}
