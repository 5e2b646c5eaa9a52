//! The pages of `docs/` in the documentation of the crate, with equations as MathML and links between its pages.
//! `KMCFIT_GUIDE=write cargo test --test guide` writes `src/guide/` anew.
#![cfg(unix)]

mod common;

use common::pages::page;
use common::repository;
use pulldown_latex::config::DisplayMode;
use pulldown_latex::{Parser, RenderConfig, Storage, push_mathml};
use std::fs;

/// The pages; the last one is included in the front page.
const PAGES: [&str; 4] = ["tutorial", "choosing", "theory", "equations"];

#[test]
fn the_guide_is_that_of_the_docs() {
    let write = std::env::var_os("KMCFIT_GUIDE").is_some_and(|value| value == "write");
    for name in PAGES {
        let (made, kept) = (
            rendered(&page(&format!("docs/{name}.md"))),
            format!("src/guide/{name}.md"),
        );
        if write {
            fs::write(repository(&kept), &made).expect("the guide can be written");
        }
        assert!(
            fs::read_to_string(repository(&kept)).is_ok_and(|kept| kept == made),
            "{kept} is out of date: KMCFIT_GUIDE=write cargo test --test guide"
        );
    }
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
