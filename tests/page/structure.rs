//! Contents of the pages.

use crate::pages::{HOSTILE, HOSTILE_STEM, PAGES, least_figures, pages};
use roxmltree::{Document, Node, ParsingOptions};
use serde_json::Value;
use std::collections::BTreeSet;

/// The page parsed as XML, which it also is.
fn parsed(html: &str) -> Document<'_> {
    let options = ParsingOptions {
        allow_dtd: true,
        ..ParsingOptions::default()
    };
    Document::parse_with_options(html, options).expect("well-formed")
}

fn all<'a>(page: &'a Document, name: &'a str) -> impl Iterator<Item = Node<'a, 'a>> {
    page.descendants().filter(move |n| n.has_tag_name(name))
}

fn text_of(node: Node) -> String {
    let texts = node.descendants().filter(Node::is_text);
    texts.filter_map(|n| n.text()).collect()
}

#[test]
fn every_figure_has_its_texts_and_its_curves() {
    for name in PAGES {
        let html = pages().read(name);
        let page = parsed(&html);
        let least = least_figures(name);
        assert!(all(&page, "figure").count() >= least, "{name}");
        let ids = all(&page, "figure").filter_map(|n| n.attribute("id"));
        let ids: Vec<&str> = ids.collect();
        let distinct: BTreeSet<&&str> = ids.iter().collect();
        assert_eq!(distinct.len(), ids.len(), "{name}: {ids:?}");
        for figure in all(&page, "figure") {
            let caption = figure.children().find(|n| n.has_tag_name("figcaption"));
            assert!(!text_of(caption.expect("a caption")).trim().is_empty());
            let svg = figure.descendants().find(|n| n.has_tag_name("svg"));
            let svg = svg.expect("a drawing");
            assert_eq!(svg.attribute("role"), Some("img"));
            for told in ["title", "desc"] {
                let node = svg.children().find(|n| n.has_tag_name(told));
                assert!(node.is_some_and(|n| !text_of(n).is_empty()), "{told}");
            }
            let panels: Vec<Node> = figure
                .descendants()
                .filter(|n| n.attribute("class") == Some("panel"))
                .collect();
            assert!(!panels.is_empty());
            for panel in panels {
                let plot = panel.children().find(|n| n.has_tag_name("svg"));
                let marks = plot.expect("a plot").children();
                assert!(
                    marks.filter(|n| n.has_tag_name("path")).count() > 0,
                    "{name}"
                );
            }
        }
    }
}

/// A report has all required sections and values.
#[test]
fn a_report_is_complete() {
    let html = pages().read("runs/plain/report.html");
    let page = parsed(&html);
    let ids: Vec<&str> = (page.descendants())
        .filter_map(|n| n.attribute("id"))
        .collect();
    for id in [
        "fit",
        "functions",
        "constraints",
        "identifiability",
        "predictions",
        "spectra",
        "tests",
        "solver",
        "repeat",
        "cite",
        "figure-main",
        "figure-residual_tests",
        "figure-spectra",
        "figure-channel",
        "figure-residuals",
        "figure-functions",
        "figure-ratios",
        "figure-motion",
    ] {
        assert_eq!(ids.iter().filter(|other| **other == id).count(), 1, "{id}");
    }
    for link in all(&page, "a").filter_map(|n| n.attribute("href")) {
        let to = link.strip_prefix('#').expect("a place in the page");
        assert!(ids.contains(&to), "{link}");
    }
    let text = text_of(page.root_element());
    let result: Value =
        serde_json::from_str(&pages().read("runs/plain/result.json")).expect("JSON");
    let sentences = |pointer: &str| -> Vec<String> {
        let list = result.pointer(pointer).and_then(Value::as_array);
        let list = list.unwrap_or_else(|| panic!("{pointer}"));
        // Text between backquotes is code in the page.
        list.iter()
            .filter_map(|v| v["text"].as_str())
            .map(|sentence| sentence.replace('`', ""))
            .collect()
    };
    for pointer in ["/findings", "/constraints/active"] {
        let said = sentences(pointer);
        assert!(!said.is_empty(), "{pointer}");
        said.iter()
            .for_each(|s| assert!(text.contains(s.as_str()), "{s}"));
    }
    for told in [
        result["outcome"]["reason"].as_str().expect("a reason"),
        result["model"]["cost_definition"]
            .as_str()
            .expect("a sentence"),
        "kmcfit fit plain.yaml",
        env!("CARGO_PKG_VERSION"),
        "Buchta",
        "samples.csv",
        "truth.csv",
        "basis: polynomial",
    ] {
        assert!(text.contains(told), "{told}");
    }
    // The bands of the functions and of the ratios, and the truth beside them.
    for figure in ["figure-functions", "figure-ratios"] {
        let figure = page
            .descendants()
            .find(|n| n.attribute("id") == Some(figure));
        let labels: Vec<&str> = (figure.expect("the figure").descendants())
            .filter_map(|n| n.attribute("data-label"))
            .collect();
        for label in ["95 % band", "estimate", "truth"] {
            assert!(
                labels.iter().any(|l| l.starts_with(label)),
                "{label} in {labels:?}"
            );
        }
    }
}

/// Each finding of a study with a chart stands beside it, what can be acted on first; extremes are curves, and the wider band has dashed edges.
#[test]
fn a_study_shows_findings_beside_their_charts() {
    let html = pages().read("runs/study/study.html");
    let page = parsed(&html);
    let study: Value = serde_json::from_str(&pages().read("runs/study/study.json")).expect("JSON");
    let anchors: Vec<&str> = all(&page, "section")
        .filter_map(|n| n.attribute("id"))
        .collect();
    let location = |anchor: &str| {
        let location = anchors.iter().position(|other| *other == anchor);
        location.unwrap_or_else(|| panic!("{anchor} in {anchors:?}"))
    };
    assert!(location("starts") < location("candidates"));
    assert!(
        location("candidates") < location("bands") && location("bands") < location("sensitivity")
    );
    let beside = |id: &str| {
        let figure = page.descendants().find(|n| n.attribute("id") == Some(id));
        let figure = figure.unwrap_or_else(|| panic!("{id}"));
        let finding = figure
            .ancestors()
            .find(|n| n.attribute("class") == Some("finding"));
        let text = finding.and_then(|n| n.descendants().find(|n| n.has_tag_name("li")));
        let labels = figure
            .descendants()
            .filter_map(|n| n.attribute("data-label"));
        (
            text.map(text_of).unwrap_or_default(),
            labels.collect::<Vec<_>>(),
        )
    };
    let plain = |text: &Value| text.as_str().expect("a sentence").replace('`', "");
    assert_eq!(
        beside("figure-profiles").0,
        plain(&study["profiles"][0]["text"])
    );
    // The first function of the extremes is the mass, which varies.
    let (text, labels) = beside("figure-extremes");
    assert!(text.starts_with("mass: "), "{text}");
    assert!(
        labels.contains(&"smallest") && labels.contains(&"largest"),
        "{labels:?}"
    );
    let (_, labels) = beside("figure-bands");
    assert!(labels.contains(&"confidence band"), "{labels:?}");
}

/// No element loads an external resource, also not one from text of the user.
#[test]
fn nothing_is_loaded() {
    for name in PAGES {
        let html = pages().read(name);
        let page = parsed(&html);
        for node in page.descendants().filter(Node::is_element) {
            let tag = node.tag_name().name();
            assert!(
                ![
                    "link", "img", "iframe", "object", "embed", "base", "use", "image"
                ]
                .contains(&tag),
                "{tag}"
            );
            for attribute in node.attributes() {
                let (key, value) = (attribute.name(), attribute.value());
                assert!(
                    !["src", "srcset", "action", "style"].contains(&key),
                    "{key}={value}"
                );
                assert!(!key.starts_with("on"), "{key}={value}");
                assert!(key != "href" || value.starts_with('#'), "{value}");
                assert!(!value.contains("url("), "{value}");
            }
        }
        let style = text_of(all(&page, "style").next().expect("a style sheet"));
        assert!(!style.contains("url(") && !style.contains("@import"));
        let policy = all(&page, "meta").find(|n| n.attribute("http-equiv").is_some());
        let policy = policy
            .and_then(|n| n.attribute("content"))
            .expect("a policy");
        assert!(policy.starts_with("default-src 'none';") && !policy.contains("unsafe"));
        assert!(
            !html.contains("http://") && !html.contains("https://"),
            "{name}"
        );
    }
}

/// Titles, names and the text of the model are shown literally, as text.
#[test]
fn hostile_texts_are_texts() {
    for name in &PAGES[1..] {
        let html = pages().read(name);
        assert!(!html.contains("<script>alert"), "{name}");
        let page = parsed(&html);
        let text = text_of(page.root_element());
        assert!(
            text.contains(HOSTILE) || name.contains("compare.html"),
            "{name}"
        );
        let file = match *name {
            "runs/models/compare.html" => HOSTILE_STEM,
            "runs/compare/compare.html" => "hostile",
            _ => "<i>&'data.csv",
        };
        assert!(text.contains(file), "{name}: {file}");
        assert_eq!(all(&page, "script").count(), 1, "{name}");
        // In HTML a script ends at its first end tag.
        let ends = html.matches("</script").count();
        assert_eq!(ends, all(&page, "script").count(), "{name}");
    }
}
