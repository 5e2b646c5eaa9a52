//! First screen, headings and tables of the pages in a browser.

use crate::browser::Browser;
use crate::pages::{HOSTILE_FILE, PAGES, pages};
use serde_json::{Value, json};

const REPORT: &str = PAGES[0];

fn resize(browser: &mut Browser, [width, height]: [u32; 2]) {
    let size = json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": false});
    browser.call("Emulation.setDeviceMetricsOverride", size);
}

/// The verdict, the whole answer and the whole main chart are on a screen of 1440 x 900, side by side.
#[test]
fn the_first_screen_holds_verdict_answer_and_chart() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    resize(&mut browser, [1440, 900]);
    for page in PAGES
        .into_iter()
        .filter(|page| !page.ends_with("compare.html"))
    {
        browser.open(&pages().path(page));
        let table = ".first table";
        let edge = |browser: &mut Browser, what: &str, side: &str| {
            browser.number(&format!(
                "document.querySelector('{what}').getBoundingClientRect().{side}"
            ))
        };
        for part in [".state", table, "#figure-main .still", "#figure-main"] {
            let [top, bottom] = ["top", "bottom"].map(|side| edge(&mut browser, part, side));
            assert!(
                top >= 0.0 && bottom > top && bottom <= 900.0,
                "{page}: {part} {top} {bottom}"
            );
        }
        // Data files and the date of the last change.
        let source = browser.text("document.querySelector('main > .soft').textContent");
        let file = match page {
            "runs/hostile/report.html" | "runs/study/study.html" => HOSTILE_FILE,
            _ => "samples.csv and truth.csv: 201 samples, 20 s",
        };
        assert!(source.starts_with(file), "{page}: {source}");
        // Text left, chart right.
        let text = edge(&mut browser, ".first > :first-child", "right");
        assert!(text <= edge(&mut browser, "#figure-main", "left"), "{page}");
        let wide = "(() => { const box = document.querySelector('main .scroll'); return box.scrollWidth - box.clientWidth; })()";
        assert!(
            browser.number(wide) <= 0.0,
            "{page}: columns of the table are hidden"
        );
    }
}

/// The coefficient that varies is the linear mass: its chart has estimate and band, and the record below.
#[test]
fn the_main_chart_is_the_varying_coefficient_over_the_record() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    browser.open(&pages().path(REPORT));
    let list = |browser: &mut Browser, what: &str, field: &str| {
        browser.text(&format!(
            "[...document.querySelectorAll('{what}')].map(e => e.dataset.{field}).join('; ')"
        ))
    };
    let labels = list(&mut browser, "#figure-main .panel", "ylabel");
    assert_eq!(labels, "mass m; displacement y");
    let curves = list(&mut browser, "#figure-main [data-label]", "label");
    assert!(
        curves.contains("estimate") && curves.contains("95 % band"),
        "{curves}"
    );
    // Constants have no chart.
    let functions = list(&mut browser, "#figure-functions .panel", "ylabel");
    assert_eq!(functions, "mass m");
}

/// Levels of headings rise by one at most, every heading stands once, and landmarks of one role have different names.
#[test]
fn headings_and_landmarks_are_in_order() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    for page in PAGES {
        browser.open(&pages().path(page));
        let list = browser.evaluate("[...document.querySelectorAll('h1, h2, h3, h4')].map(h => [Number(h.tagName[1]), h.textContent])");
        let headings: Vec<(u64, String)> = serde_json::from_value(list).expect("headings");
        assert_eq!(headings[0].0, 1, "{page}");
        for pair in headings.windows(2) {
            assert!(pair[1].0 <= pair[0].0 + 1, "{page}: {pair:?}");
        }
        let mut second: Vec<&String> = headings.iter().filter(|h| h.0 == 2).map(|h| &h.1).collect();
        let count = second.len();
        second.sort();
        second.dedup();
        assert_eq!(second.len(), count, "{page}: {headings:?}");
        let outside = browser.text("[...document.body.children].filter(e => !['MAIN', 'SCRIPT'].includes(e.tagName)).map(e => e.outerHTML).join()");
        assert_eq!(outside, "", "{page}");
        let names = browser.evaluate("[...document.querySelectorAll('[role=region], nav')].map(e => e.getAttribute('aria-label'))");
        let names: Vec<String> = serde_json::from_value(names).expect("names");
        let mut distinct = names.clone();
        distinct.sort();
        distinct.dedup();
        assert_eq!(distinct.len(), names.len(), "{page}: {names:?}");
    }
}

/// Contents stay in sight, and every link of a phone is at least 44 px high; no table has hidden columns.
#[test]
fn a_phone_has_large_targets_and_whole_tables() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    resize(&mut browser, [390, 844]);
    for page in PAGES {
        browser.open(&pages().path(page));
        on_a_phone(&mut browser, page);
    }
}

fn on_a_phone(browser: &mut Browser, page: &str) {
    let small = browser.text(
        "[...document.querySelectorAll('nav a, summary')].filter(e => {
           const b = e.getBoundingClientRect(); return b.height < 44 || b.width < 44;
         }).map(e => e.textContent).join('; ')",
    );
    assert_eq!(small, "", "{page}");
    let hidden = browser.text(
        "[...document.querySelectorAll('.scroll')].filter(e => e.scrollWidth > e.clientWidth).map(e => e.getAttribute('aria-label')).join()",
    );
    assert_eq!(hidden, "", "{page}");
    let wide = browser.number("document.documentElement.scrollWidth");
    assert!(wide <= 390.0, "{page}: {wide}");
    assert_eq!(overlaps(browser), "", "{page}");
    browser.evaluate("document.querySelector('main section:last-child').scrollIntoView()");
    browser.settle();
    let top = browser.number("document.querySelector('nav').getBoundingClientRect().top");
    assert_eq!(top, 0.0, "{page}");
}

/// Pairs of labels of a chart whose boxes overlap by more than a pixel.
fn overlaps(browser: &mut Browser) -> String {
    browser.text(
        "[...document.querySelectorAll('.still > svg')].flatMap(svg => {
           const labels = [...svg.querySelectorAll('text')].map(e => [e.textContent, e.getBoundingClientRect()]);
           return labels.flatMap(([one, a], i) => labels.slice(i + 1)
             .filter(([, b]) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1
               && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 1)
             .map(([other]) => `${svg.closest('figure').id}: ${one} and ${other}`));
         }).join('; ')",
    )
}

/// The rules of axe-core for WCAG 2.2 AA and its best practices, where `KMCFIT_AXE` has the path of its script.
#[test]
fn pages_break_no_rule_of_axe() {
    let Some(script) = std::env::var_os("KMCFIT_AXE") else {
        eprintln!("SKIPPED: KMCFIT_AXE is not set");
        return;
    };
    let script = std::fs::read_to_string(script).expect("the script of axe-core");
    let Some(mut browser) = Browser::start() else {
        return;
    };
    resize(&mut browser, [1440, 900]);
    for page in PAGES {
        browser.open(&pages().path(page));
        assert_eq!(overlaps(&mut browser), "", "{page}");
        browser.evaluate(&format!("{{{script}; undefined}}"));
        let broken = browser.text(
            "axe.run({runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa', 'best-practice']}).then(found =>
               found.passes.length < 20 ? 'few rules were applied' : found.violations.map(v => `${v.id}: ${v.nodes.map(n => n.target.join(' ')).slice(0, 5).join(', ')}`).join('; '))",
        );
        assert_eq!(broken, "", "{page}");
    }
}

/// The numbers of the answer are those of `result.json`, to the digits shown.
#[test]
fn the_answer_has_the_numbers_of_the_result() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    browser.open(&pages().path(REPORT));
    let rows = browser.evaluate("[...document.querySelectorAll('.first tbody tr')].map(r => [...r.children].map(c => c.textContent))");
    let rows: Vec<Vec<String>> = serde_json::from_value(rows).expect("rows");
    let result: Value =
        serde_json::from_str(&pages().read("runs/plain/result.json")).expect("JSON");
    let mut compared = 0;
    for (key, name) in [
        ("natural_frequency", "undamped natural frequency"),
        ("mass", "mass m"),
        ("stiffness", "stiffness k"),
    ] {
        let row = rows
            .iter()
            .find(|row| row[0] == name)
            .unwrap_or_else(|| panic!("{name} in {rows:?}"));
        let estimate = &result["estimates"][key];
        let stored = estimate["value"].as_f64().expect("a number");
        let shown: f64 = row[1]
            .split(' ')
            .next()
            .and_then(|n| n.parse().ok())
            .expect("a number");
        // Four digits at least.
        assert!(
            (shown / stored - 1.0).abs() < 5e-4,
            "{name}: {shown} {stored}"
        );
        if let Some(low) = estimate["ci95"][0].as_f64() {
            let shown: f64 = row[2]
                .split(' ')
                .next()
                .and_then(|n| n.parse().ok())
                .expect("a number");
            // The digits that the interval resolves.
            let width = estimate["ci95"][1].as_f64().expect("a number") - low;
            assert!((shown - low).abs() <= 0.1 * width, "{name}: {shown} {low}");
            compared += 1;
        }
    }
    assert!(compared >= 2, "{rows:?}");
}
