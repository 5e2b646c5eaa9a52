//! The pages of `docs/` in the documentation of the crate, with equations as MathML and links between its pages, and the reference
//! of the keys, `docs/keys.md`, from the documentation of the keys in the source.
//! `KMCFIT_GUIDE=write cargo test --test suite guide::` writes `src/guide/` and `docs/keys.md`.
#![cfg(unix)]

use crate::common::pages::page;
use crate::common::repository;
use kmcfit::config::key_documentation::{Found, KeyDoc, KeyGroup, ValueType, all, model};
use pulldown_latex::config::DisplayMode;
use pulldown_latex::{Parser, RenderConfig, Storage, push_mathml};
use std::fs;

/// The pages.
const PAGES: [&str; 3] = ["tutorial", "choosing", "theory"];

#[test]
fn the_guide_is_that_of_the_docs() {
    for name in PAGES {
        let made = rendered(&page(&format!("docs/{name}.md")));
        is_current(&format!("src/guide/{name}.md"), &made);
    }
}

#[test]
fn the_key_reference_is_that_of_the_source() {
    is_current("docs/keys.md", &key_reference());
}

/// Compares a generated file with the one in the repository; with `KMCFIT_GUIDE=write` writes it first.
fn is_current(kept: &str, made: &str) {
    if std::env::var_os("KMCFIT_GUIDE").is_some_and(|value| value == "write") {
        fs::write(repository(kept), made).expect("a file in the repository");
    }
    assert!(
        fs::read_to_string(repository(kept)).is_ok_and(|kept| kept == made),
        "{kept} is out of date: KMCFIT_GUIDE=write cargo test --test suite guide::"
    );
}

#[test]
fn equations_become_mathml() {
    let text = rendered("A $x_1$ and `$HOME`.\n\n$$ a = \\frac{b}{c} $$\n");
    assert!(text.contains("`$HOME`"), "{text}");
    assert_eq!(text.matches("<math").count(), 2, "{text}");
    assert!(
        text.contains("display=\"block\"") && text.contains("<mfrac>"),
        "{text}"
    );
    let text = "See [the theory](theory.md), [a model](../models/paper.yaml), [more](https://doc.rust-lang.org).";
    let expected =
        "See [the theory](crate::guide::theory), a model, [more](https://doc.rust-lang.org).";
    assert!(rendered(text).starts_with(expected));
}

/// Style against the scroll bars that rustdoc adds to paragraphs with tall equations.
const STYLE: &str = "<style>.docblock > p { overflow: visible !important }</style>";

/// A page in the form for the documentation of the crate.
fn rendered(page: &str) -> String {
    let mut text = String::new();
    let mut in_code = false;
    for line in page.lines() {
        let fence = line.starts_with("```");
        if fence {
            // Marked as text, because rustdoc runs unmarked blocks as Rust.
            text.push_str(if in_code { "```" } else { "```text" });
            in_code = !in_code;
        } else if in_code {
            text.push_str(line);
        } else {
            text.push_str(&prose(line));
        }
        text.push('\n');
    }
    text.push_str(&format!("\n{STYLE}\n"));
    text
}

/// A line of prose; code between backquotes is unchanged.
fn prose(line: &str) -> String {
    if let Some(figure) = figure(line) {
        return figure;
    }
    let parts = line.split('`').enumerate();
    let parts = parts.map(|(i, part)| match i % 2 {
        0 => equations(part),
        _ => part.to_owned(),
    });
    links(&parts.collect::<Vec<_>>().join("`"))
}

/// A figure, `![caption](file.svg)` on a separate line, is embedded.
fn figure(line: &str) -> Option<String> {
    let (_, file) = line
        .strip_prefix("![")?
        .strip_suffix(".svg)")?
        .split_once("](")?;
    let drawing = page(&format!("docs/{file}.svg"));
    // Markdown ends a block of HTML at an empty line.
    let lines = drawing.lines().filter(|line| !line.trim().is_empty());
    Some(lines.collect::<Vec<_>>().join("\n"))
}

/// The equations of a text as MathML: `$$ … $$` on lines of their own, `$ … $` within.
fn equations(text: &str) -> String {
    let display = text.contains("$$");
    let parts = text.split(if display { "$$" } else { "$" });
    let parts: Vec<&str> = parts.collect();
    assert!(parts.len() % 2 == 1, "an equation is not closed: {text}");
    let parts = parts.into_iter().enumerate();
    let parts = parts.map(|(i, part)| match i % 2 {
        0 => part.to_owned(),
        _ => mathml(part, display),
    });
    parts.collect()
}

fn mathml(latex: &str, display: bool) -> String {
    let storage = Storage::new();
    let known = Parser::new(latex, &storage).all(|event| event.is_ok());
    assert!(known, "not understood: {latex}");
    let config = RenderConfig {
        display_mode: if display {
            DisplayMode::Block
        } else {
            DisplayMode::Inline
        },
        ..RenderConfig::default()
    };
    let mut text = String::new();
    push_mathml(&mut text, Parser::new(latex, &storage), config).expect("MathML");
    plain_to_markdown(&text)
}

/// Escapes characters of MathML that have a meaning in Markdown.
fn plain_to_markdown(mathml: &str) -> String {
    let mut text = String::new();
    let mut in_tag = false;
    for c in mathml.chars().filter(|c| *c != '\n') {
        match c {
            '<' => in_tag = true,
            '>' => in_tag = false,
            _ if !in_tag && "*_[]|'\\`~\"".contains(c) => {
                text.push_str(&format!("&#{};", u32::from(c)));
                continue;
            }
            _ => {}
        }
        text.push(c);
    }
    text
}

/// Links between the pages become links of the documentation; of links to other files only the label remains.
fn links(line: &str) -> String {
    let mut text = String::new();
    let mut rest = line;
    while let Some((before, label, target, after)) = next_link(rest) {
        text.push_str(before);
        let name = target.strip_suffix(".md").unwrap_or_default();
        if PAGES.contains(&name) {
            text.push_str(&format!("[{label}](crate::guide::{name})"));
        } else if target.starts_with("https://") || target.starts_with('#') {
            text.push_str(&format!("[{label}]({target})"));
        } else {
            text.push_str(label);
        }
        rest = after;
    }
    text + rest
}

/// Text before a link, its label, its target, and the text after it.
fn next_link(line: &str) -> Option<(&str, &str, &str, &str)> {
    let middle = line.find("](")?;
    let begin = line[..middle].rfind('[')?;
    let (target, after) = line[middle + 2..].split_once(')')?;
    Some((&line[..begin], &line[begin + 1..middle], target, after))
}

const KEYS: &str = "# Key reference

Every key of a model file: a table for each map, with the type and the allowed values, the unit, the default and the
meaning. *Range* limits a number. *Needs* names the keys or values without which the key is refused or has no effect.
Numbers are in SI units; a column is a name, or a number from 1. A key without default is optional unless it is marked as
required. [Model files](model_files.md) and [Records](records.md) have examples; `kmcfit explain KEY` prints one entry.

This page is generated from the source of the reader.
";

/// The page of all keys: one section for each map.
fn key_reference() -> String {
    let keys = all();
    let mut groups: Vec<&KeyGroup> = vec![model()];
    let nested = keys.iter().flat_map(|found| found.key.kind.groups());
    for group in nested {
        if !groups.iter().any(|known| known.name == group.name) {
            groups.push(group);
        }
    }
    let sections = groups.into_iter().map(|group| section(group, &keys));
    KEYS.to_owned() + &sections.collect::<String>()
}

/// The keys of a map as a table, between the paths at which the map stands and the meaning of its words.
fn section(group: &KeyGroup, keys: &[Found]) -> String {
    let holds = |key: &KeyDoc| key.kind.groups().iter().any(|g| g.name == group.name);
    let holders = keys.iter().filter(|found| holds(found.key));
    let mut paths: Vec<String> = (holders.flat_map(|found| &found.paths))
        .map(|path| format!("`{path}`"))
        .collect();
    paths.sort_by_key(|path| path.matches('.').count());
    let mut text = format!("\n## {}\n\n{}", group.name, group.text);
    match paths.len() {
        0 => {}
        1 => text += &format!(" Path: {}.", paths[0]),
        2..=4 => text += &format!(" Paths: {}.", paths.join(", ")),
        more => text += &format!(" Paths: {} and {} more.", paths[..3].join(", "), more - 3),
    }
    text += "\n\n| key | value | unit | default | meaning |\n|---|---|---|---|---|\n";
    let mut words: Vec<&(&str, &str)> = Vec::new();
    for key in group.keys {
        let name = format!("`{}`", key.name);
        let default = match key.required {
            true => "required",
            false => key.default.unwrap_or_default(),
        };
        let facts = [("Range", key.range), ("Needs", key.needs)];
        let facts = facts.map(|(name, fact)| fact.map(|fact| format!(" *{name}:* {fact}.")));
        let meaning = key.text.to_owned() + &facts.into_iter().flatten().collect::<String>();
        let cells = [
            &name,
            &value(key.kind, &mut words),
            key.unit.unwrap_or_default(),
            default,
            &meaning,
        ];
        for cell in cells {
            text += "|";
            if !cell.is_empty() {
                text += &format!(" {} ", cell.replace('|', "\\|"));
            }
        }
        text += "|\n";
    }
    words.sort();
    words.dedup();
    words.retain(|(word, meaning)| !meaning.trim_end_matches('.').eq_ignore_ascii_case(word));
    if !words.is_empty() {
        text.push('\n');
    }
    for (word, meaning) in words {
        text += &format!("- `{word}`: {meaning}\n");
    }
    text
}

/// A type, with links to the maps; adds its words, each with its meaning.
fn value(kind: ValueType, words: &mut Vec<&(&str, &str)>) -> String {
    match kind {
        ValueType::Format => "1".into(),
        ValueType::Number => "number".into(),
        ValueType::Count => "integer".into(),
        ValueType::Text => "text".into(),
        ValueType::Bool => "boolean".into(),
        ValueType::Column => "column".into(),
        ValueType::Word(word) => format!("`{word}`"),
        ValueType::Choice(choices) => {
            words.extend(choices);
            let names = choices.iter().map(|(word, _)| format!("`{word}`"));
            names.collect::<Vec<_>>().join(", ")
        }
        ValueType::Map(group) => format!("[{0}](#{0})", group.name),
        ValueType::List(inner) => format!("list of: {}", value(*inner, words)),
        ValueType::AnyOf(kinds) => {
            let kinds: Vec<String> = kinds.iter().map(|kind| value(*kind, words)).collect();
            kinds.join("; or ")
        }
    }
}
