//! First screen, headings, tables and downloads of the page of a fit in a browser.

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
    for page in PAGES {
        browser.open(&pages().path(page));
        let table = match page.ends_with("compare.html") {
            true => "main > .scroll table",
            false => ".first table",
        };
        let edge = |browser: &mut Browser, what: &str, side: &str| {
            browser.number(&format!(
                "document.querySelector('{what}').getBoundingClientRect().{side}"
            ))
        };
        for part in [".state", table, "#figure-main .plot", "#figure-main"] {
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
            "runs/plain/report.html" => {
                "samples.csv and truth.csv: 201 samples, 20 s; files last changed on "
            }
            _ => "samples.csv, truth.csv and ",
        };
        let date = browser.text("document.querySelector('main > .soft time').textContent");
        assert!(source.starts_with(file), "{page}: {source}");
        assert!(
            date.len() == 10 && date.matches('-').count() == 2,
            "{source}"
        );
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
    let labels = browser.text(
        "[...document.querySelectorAll('#figure-main .ylabel')].map(e => e.textContent).join('; ')",
    );
    assert_eq!(labels, "mass m (kg); displacement y (m)");
    let keys = browser.text(
        "[...document.querySelectorAll('#figure-main .key')].map(e => e.textContent).join('; ')",
    );
    assert!(
        keys.contains("estimate") && keys.contains("95 % band"),
        "{keys}"
    );
    // Constants have no chart.
    let functions = browser.text("[...document.querySelectorAll('#figure-functions .ylabel')].map(e => e.textContent).join('; ')");
    assert_eq!(functions, "mass m (kg)");
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

/// Contents stay in sight, and every link and button of a phone is at least 44 px high; no table has hidden columns.
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
        "[...document.querySelectorAll('nav a, button, summary')].filter(e => {
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
        "[...document.querySelectorAll('.chart.ready .plot svg')].flatMap(svg => {
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

/// The buttons of a chart save its drawing and its numbers: what would be written to the files is caught here.
#[test]
fn charts_are_saved_as_drawings_and_numbers() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    browser.open(&pages().path("runs/hostile/report.html"));
    browser.evaluate(
        "window.saved = []; URL.createObjectURL = (blob) => { window.saved.push(blob); return 'data:,'; };
         HTMLAnchorElement.prototype.click = function () { this.name = this.download; };",
    );
    let mut press = |button: &str| {
        browser.evaluate(&format!(
            "[...document.querySelectorAll('#figure-residual_tests .tools button')].find(b => b.textContent === '{button}').click()"
        ));
        browser.evaluate("new Promise(done => { const wait = () => window.saved.length ? done(1) : setTimeout(wait, 20); wait(); })");
        browser.text("(async () => { const blob = window.saved.pop(); return blob.type + '\\n' + (blob.type === 'image/png' ? blob.size : await blob.text()); })()")
    };
    let svg = press("SVG");
    let (kind, svg) = svg.split_once('\n').expect("two parts");
    assert_eq!(kind, "image/svg+xml");
    let drawing = roxmltree::Document::parse(svg).expect("well-formed");
    assert_eq!(drawing.root_element().tag_name().name(), "svg");
    let csv = press("CSV");
    let (kind, csv) = csv.split_once('\n').expect("two parts");
    assert_eq!(kind, "text/csv");
    let rows: Vec<&str> = csv.trim_end().split("\r\n").collect();
    assert_eq!(rows[0], "panel,curve,abscissa,x,y,upper");
    let stored: Value =
        serde_json::from_str(&pages().read("runs/hostile/result.json")).expect("JSON");
    let channel = &stored["experiments"][0]["channels"][0];
    let lags = channel["autocorrelation"].as_array().expect("numbers");
    let name = match channel["noise"].is_null() {
        true => "residuals",
        false => "innovations",
    };
    let start = format!("\"autocorrelation\",\"{name}\",\"lag (s)\",");
    let stems = rows.iter().filter_map(|row| row.strip_prefix(&start));
    let stems: Vec<f64> = stems
        .map(|row| {
            row.split(',')
                .nth(1)
                .and_then(|y| y.parse().ok())
                .expect("a number")
        })
        .collect();
    assert_eq!(stems.len(), lags.len());
    for (stem, lag) in stems.iter().zip(lags) {
        // Charts have six digits.
        assert!((stem - lag.as_f64().expect("a number")).abs() < 1e-5);
    }
    let png = press("PNG");
    let (kind, size) = png.split_once('\n').expect("two parts");
    assert_eq!(kind, "image/png");
    assert!(size.parse::<f64>().expect("bytes") > 10_000.0, "{size}");
}

/// The animation is still until it is played; its slider shows the response of `trajectory.csv` at that time, and the mass moves by it.
#[test]
fn the_animation_shows_the_response_at_a_time() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    browser.open(&pages().path(REPORT));
    browser.evaluate("document.getElementById('animation').open = true");
    browser.settle();
    let part = |what: &str| format!("document.querySelector('#animation {what}')");
    let button = part("button");
    let text = format!("{button}.textContent");
    assert_eq!(browser.text(&text), "Play");
    for control in ["button", "select", "input"] {
        let height = browser.number(&format!("{}.getBoundingClientRect().height", part(control)));
        assert!(height >= 44.0, "{control}: {height}");
    }
    let time = format!("Number({}.value)", part("input"));
    browser.settle();
    assert_eq!(browser.number(&time), 0.0, "it starts still");
    let csv = pages().read("runs/plain/trajectory.csv");
    let mut lines = csv.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let headers = lines.next().expect("a header");
    let column = headers
        .iter()
        .position(|h| h.starts_with("y_") || h.starts_with("displacement"));
    let column = column.unwrap_or_else(|| panic!("{headers:?}"));
    let rows: Vec<Vec<f64>> = lines
        .map(|line| line.iter().map(|x| x.parse().unwrap_or(f64::NAN)).collect())
        .collect();
    let last = rows.len() - 1;
    let ends = [rows[0][0], rows[last][0]];
    let moved = |browser: &mut Browser, place: usize| {
        browser.evaluate(&format!(
            "(() => {{ const s = {}; s.value = {place}; s.dispatchEvent(new Event('input')); }})()",
            part("input")
        ));
        let shown = browser.text("document.querySelectorAll('#animation dd')[1].textContent");
        let shown = shown.replace('−', "-");
        let shown: f64 = shown
            .split(' ')
            .next()
            .and_then(|x| x.parse().ok())
            .expect("a number");
        let x = browser.number(&format!("Number({}.getAttribute('x'))", part("rect.mass")));
        let t = ends[0] + place as f64 / 1000.0 * (ends[1] - ends[0]);
        let after = rows.partition_point(|row| row[0] < t).clamp(1, last);
        let [a, b] = [&rows[after - 1], &rows[after]];
        let y = a[column] + (t - a[0]) / (b[0] - a[0]) * (b[column] - a[column]);
        (shown, y, x)
    };
    let places = [0, 130, 500, 990].map(|place| moved(&mut browser, place));
    let largest = rows.iter().map(|row| row[column].abs()).fold(0.0, f64::max);
    for (shown, y, x) in places {
        // Three digits are shown, and the curve is drawn from the samples' times.
        assert!((shown - y).abs() <= 0.02 * largest, "{shown} {y}");
        let travel = (x - places[0].2) / (shown - places[0].0);
        assert!(
            shown == places[0].0 || (travel * largest / 120.0 - 1.0).abs() < 0.2,
            "{travel}"
        );
    }
    browser.evaluate(&format!("{button}.click()"));
    assert_eq!(browser.text(&text), "Pause");
    let before = browser.text("document.querySelector('#animation dd').textContent");
    let runs = (0..200).any(|_| {
        browser.settle();
        browser.text("document.querySelector('#animation dd').textContent") != before
    });
    assert!(runs, "it moves");
    browser.evaluate(&format!("{button}.click()"));
    assert_eq!(browser.text(&text), "Play");
    assert_eq!(browser.complaints(), [""; 0]);
}
