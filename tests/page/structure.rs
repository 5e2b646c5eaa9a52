//! Contents of the pages.

use crate::pages::{HOSTILE, HOSTILE_STEM, PAGES, pages, repository};
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

/// Data of a chart.
fn numbers(figure: Node) -> Value {
    let script = figure.children().find(|n| n.has_tag_name("script"));
    let text = text_of(script.expect("the numbers of the chart"));
    serde_json::from_str(&text).expect("JSON")
}

/// Number of finite values of a mark.
fn size(mark: &Value) -> usize {
    let finite = |key: &str| -> usize {
        let list = mark[key].as_array();
        list.map_or(0, |list| list.iter().filter(|v| v.is_number()).count())
    };
    let alone = ["at", "from"].iter().filter(|k| mark[**k].is_number());
    finite("y").max(finite("low")) + alone.count()
}

#[test]
fn every_figure_has_its_texts_and_its_numbers() {
    for name in PAGES {
        let html = pages().read(name);
        let page = parsed(&html);
        assert!(all(&page, "figure").count() >= 3, "{name}");
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
            let data = numbers(figure);
            let panels = data["panels"].as_array().expect("panels");
            assert!(!panels.is_empty());
            for panel in panels {
                let marks = panel["marks"].as_array().expect("marks");
                assert!(marks.iter().map(size).sum::<usize>() > 0, "{name}: {panel}");
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
        "settings",
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
        let data = numbers(figure.expect("the figure"));
        let labels: Vec<&str> = (data["panels"].as_array().expect("panels").iter())
            .flat_map(|p| p["marks"].as_array().expect("marks"))
            .filter_map(|m| m["label"].as_str())
            .collect();
        for label in ["95 % band", "estimate", "truth"] {
            assert!(labels.contains(&label), "{label} in {labels:?}");
        }
    }
}

/// The page of a shipped model with several records: what was checked has the numbers of `result.json`, the validation says what it
/// proves, initial states have the unit of their channel, and facts of the solver are folded.
#[test]
fn a_page_has_the_numbers_of_its_checks() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("run");
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_kmcfit"))
        .args(["fit", "models/hammer-and-shaker.yaml", "--out"])
        .arg(&out)
        .current_dir(repository(""))
        .output()
        .expect("the program runs");
    assert!(output.status.success(), "{output:?}");
    let read = |name: &str| std::fs::read_to_string(out.join(name)).expect("a file");
    let html = read("report.html");
    let page = parsed(&html);
    let result: Value = serde_json::from_str(&read("result.json")).expect("JSON");
    let rows = |id: &str| -> Vec<Vec<String>> {
        let section = page.descendants().find(|n| n.attribute("id") == Some(id));
        let rows = section
            .expect(id)
            .descendants()
            .filter(|n| n.has_tag_name("tr"));
        let cells = |row: Node| {
            row.children()
                .filter(Node::is_element)
                .map(text_of)
                .collect()
        };
        rows.map(cells).collect()
    };
    let shown = rows("checks");
    let number = |text: &str| text.replace('−', "-").parse::<f64>().expect("a number");
    let tests = &result["model_tests"];
    let (bases, extensions) = (&tests["bases"], &tests["extensions"]);
    let bases = bases.as_array().expect("tests");
    let extensions = extensions.as_array().expect("tests");
    // Three constants; four terms and two errors of the clock, each with a row, besides two rows of headings.
    assert!(bases.len() == 3 && extensions.len() >= 5, "{tests}");
    assert_eq!(shown.len(), bases.len() + extensions.len() + 2);
    for (row, test) in shown[1..].iter().zip(bases) {
        assert_eq!(row[0], test["function"].as_str().expect("a name"));
        // Two digits, rounded upward.
        let (p, stored) = (number(&row[2]), test["p_value"].as_f64().expect("p"));
        assert!(p >= stored && p <= 1.1 * stored, "{row:?} {test}");
    }
    for (row, test) in shown[bases.len() + 2..].iter().zip(extensions) {
        let stored = test["t"].as_f64().expect("t");
        assert!(
            (number(&row[2]) - stored).abs() <= 0.05 * stored.abs(),
            "{row:?} {test}"
        );
        // A term is missing from 4.5 standard errors on.
        assert!(stored.abs() < tests["t_limit"].as_f64().expect("a limit"));
    }
    let section = |id: &str| {
        let section = page.descendants().find(|n| n.attribute("id") == Some(id));
        text_of(section.expect(id))
    };
    assert!(section("validation").contains("Validation passed: fit 99."));
    assert!(
        section("validation")
            .contains("only its initial displacement and initial velocity were fitted to it")
    );
    assert!(section("identifiability").contains("initial velocity of hammer 2 = -100.09 mm/s"));
    assert!(section("identifiability").contains("mass >= 0.003 kg"));
    let link = |n: &Node| n.has_tag_name("a") && n.attribute("href") == Some("#validation");
    assert!(
        page.descendants().any(|n| link(&n)),
        "the contents name the validation"
    );
    // The constants stand in the answer alone.
    assert!(
        !page
            .descendants()
            .any(|n| n.attribute("id") == Some("functions"))
    );
    let text = text_of(page.root_element());
    assert!(text.contains("a force sensor that reads 1 % high makes m, c and k 1 % too large"));
    assert!(text.contains("common to the 3 records"));
    let titles = page.descendants().filter(|n| n.has_tag_name("strong"));
    assert!(titles.map(text_of).any(|title| title == "Force of shaker"));
    for fact in ["J fell from", "iterations 1000"] {
        let place = page
            .descendants()
            .find(|n| n.is_text() && n.text().is_some_and(|t| t.contains(fact)));
        let folded = place
            .expect(fact)
            .ancestors()
            .any(|n| n.has_tag_name("details"));
        assert!(folded, "{fact}");
    }
    let labels: Vec<Value> = all(&page, "figure")
        .map(numbers)
        .flat_map(|f| f["panels"].as_array().cloned().unwrap_or_default())
        .flat_map(|p| p["marks"].as_array().cloned().unwrap_or_default())
        .collect();
    let sigma = labels
        .iter()
        .find(|m| m["label"] == "±2 sigma")
        .expect("a line");
    // The sigma of the first record is 0.02 mm.
    assert_eq!(sigma["y"][0].as_f64(), Some(0.04));
    let frequency = result["estimates"]["natural_frequency"]["value"]
        .as_f64()
        .expect("Hz");
    let marked = labels
        .iter()
        .filter(|m| m["label"] == "undamped natural frequency");
    let marked: Vec<f64> = marked.filter_map(|m| m["x"][0].as_f64()).collect();
    // Three spectra and one frequency response; charts have six digits.
    assert_eq!(marked.len(), 4);
    assert!(
        marked.iter().all(|f| (f / frequency - 1.0).abs() < 1e-5),
        "{marked:?}"
    );
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
    let place = |anchor: &str| {
        let place = anchors.iter().position(|other| *other == anchor);
        place.unwrap_or_else(|| panic!("{anchor} in {anchors:?}"))
    };
    assert!(place("starts") < place("candidates"));
    assert!(place("candidates") < place("bands") && place("bands") < place("sensitivity"));
    let beside = |id: &str| {
        let figure = page.descendants().find(|n| n.attribute("id") == Some(id));
        let figure = figure.unwrap_or_else(|| panic!("{id}"));
        let finding = figure
            .ancestors()
            .find(|n| n.attribute("class") == Some("finding"));
        let text = finding.and_then(|n| n.descendants().find(|n| n.has_tag_name("li")));
        (text.map(text_of).unwrap_or_default(), numbers(figure))
    };
    let plain = |text: &Value| text.as_str().expect("a sentence").replace('`', "");
    let (text, _) = beside("figure-profiles-1");
    assert_eq!(text, plain(&study["profiles"][0]["text"]));
    // The first function of the extremes is the mass, which varies.
    let (text, drawn) = beside("figure-extremes-1");
    assert!(text.starts_with("mass: "), "{text}");
    let marks = drawn["panels"][0]["marks"].as_array().expect("marks");
    assert!(marks.iter().all(|mark| mark["kind"] != "band"), "{marks:?}");
    for (label, key) in [("smallest", "low"), ("largest", "high")] {
        let mut lines = marks
            .iter()
            .filter(|m| m["label"] == label && m["kind"] == "line");
        let line = lines.next().expect("a curve");
        let stored = study["extremes"][0][key].as_array().expect("numbers");
        let shown = line["y"].as_array().expect("numbers");
        assert_eq!(shown.len(), stored.len());
        for (shown, stored) in shown.iter().zip(stored) {
            let (shown, stored) = (
                shown.as_f64().expect("a number"),
                stored.as_f64().expect("a number"),
            );
            // Charts have six digits.
            assert!(
                (shown - stored).abs() <= 1e-5 * stored.abs(),
                "{shown} {stored}"
            );
        }
    }
    let (_, drawn) = beside("figure-bands-1");
    let marks = drawn["panels"][0]["marks"].as_array().expect("marks");
    let dash = |label: &str| {
        let mark = marks.iter().find(|m| m["label"] == label);
        mark.and_then(|m| m["dash"].as_str()).map(str::len)
    };
    assert!(dash("simultaneous").is_some_and(|length| length > 0));
    assert_eq!(dash("pointwise"), Some(0));
    // At most twelve instants are marked, and constants have no chart.
    let figures = all(&page, "figure").map(numbers);
    let panels: Vec<Value> = figures
        .flat_map(|f| f["panels"].as_array().cloned().unwrap_or_default())
        .collect();
    for panel in &panels {
        for mark in panel["marks"].as_array().expect("marks") {
            let is_anchor = ["turning points", "zero crossings"]
                .iter()
                .any(|label| mark["label"] == *label);
            assert!(!is_anchor || size(mark) <= 12);
        }
        assert!(panel["y"]["label"] != "damping", "{panel}");
    }
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
        assert!(text.contains(HOSTILE), "{name}");
        let file = match *name {
            "runs/sequence/compare.html" => HOSTILE_STEM,
            "runs/compare/compare.html" => "hostile",
            _ => "<i>&'data.csv",
        };
        assert!(text.contains(file), "{name}: {file}");
        let runs = |n: &Node| n.attribute("type") != Some("application/json");
        assert_eq!(all(&page, "script").filter(runs).count(), 1, "{name}");
        // In HTML a script ends at its first end tag.
        let ends = html.matches("</script").count();
        assert_eq!(ends, all(&page, "script").count(), "{name}");
    }
}

/// The page of a long record has at most 2 MB; decimation keeps the peaks.
#[test]
fn long_records_make_small_pages() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let samples: String = (0..65_000)
        .map(|i| {
            let t = f64::from(i) * 0.01;
            let spike = if i == 40_000 { 5.0 } else { 0.0 };
            format!("{t},{}\n", (3.0 * t).cos() + 0.1 * (77.0 * t).sin() + spike)
        })
        .collect();
    std::fs::write(
        folder.path().join("samples.csv"),
        "t_s,y_m\n".to_string() + &samples,
    )
    .expect("a file");
    let model = "format: 1
title: Long
experiments:
  - {data: samples.csv, sigma: {displacement: 0.1}, initial: {displacement: 1.0, velocity: 0.0}}
functions:
  mass: {basis: piecewise-linear, knots: 20, start: 1.0}
  damping: {basis: constant, start: 0.0}
  stiffness: {fixed: 9.0}
fit: {stop: {iterations: 2}}
";
    std::fs::write(folder.path().join("long.yaml"), model).expect("a file");
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_kmcfit"))
        .current_dir(folder.path())
        .args(["fit", "long.yaml"])
        .output()
        .expect("the program runs");
    assert!(
        output.status.code().is_some_and(|c| c == 0 || c == 3),
        "{output:?}"
    );
    let html =
        std::fs::read_to_string(folder.path().join("runs/long/report.html")).expect("a page");
    assert!(html.len() < 2_000_000, "{} bytes", html.len());
    let page = parsed(&html);
    let channel = page
        .descendants()
        .find(|n| n.attribute("id") == Some("figure-channel"));
    let channel = channel.expect("the figure");
    assert!(text_of(channel).contains("thinned for display"));
    let data = numbers(channel);
    let samples = data["panels"][0]["marks"][0]["y"]
        .as_array()
        .expect("numbers");
    let largest = samples.iter().filter_map(Value::as_f64).fold(0.0, f64::max);
    assert!(largest > 4.0, "the spike is lost: {largest}");
}

/// The README names the page that its commands write.
#[test]
fn the_readme_names_the_page() {
    let readme = std::fs::read_to_string(repository("README.md")).expect("a file");
    assert!(readme.contains("`report.html`"));
}
