//! Charts in a browser: values at the pointer, zoom, keyboard.

use crate::browser::Browser;
use crate::pages::{PAGES, least_figures, pages};
use serde_json::json;

const REPORT: &str = PAGES[0];
const WHOLE: f64 = 1.0;

fn opened(page: &str) -> Option<Browser> {
    let mut browser = Browser::start()?;
    browser.open(&pages().path(page));
    Some(browser)
}

/// Share of the horizontal axis that the first panel of a figure shows.
fn share(browser: &mut Browser, figure: &str) -> f64 {
    browser.number(&format!(
        "(() => {{ const s = document.querySelector('#figure-{figure} svg svg');
           return s.viewBox.baseVal.width / s.width.baseVal.value; }})()"
    ))
}

/// The values that a figure reads.
fn cursor(browser: &mut Browser, figure: &str) -> String {
    browser.text(&format!(
        "document.querySelector('#figure-{figure} .cursor').textContent"
    ))
}

/// A point of the first panel of a figure in the window, after scrolling to it: shares of its frame.
fn point(browser: &mut Browser, figure: &str, [x, y]: [f64; 2]) -> [f64; 2] {
    let plot = format!("document.querySelector('#figure-{figure} .frame')");
    browser.evaluate(&format!("{plot}.scrollIntoView({{block: 'center'}})"));
    browser.settle();
    let side = |browser: &mut Browser, side: &str| {
        browser.number(&format!("{plot}.getBoundingClientRect().{side}"))
    };
    let [left, top, width, height] =
        ["left", "top", "width", "height"].map(|name| side(browser, name));
    [left + x * width, top + y * height]
}

#[test]
fn pages_are_quiet_and_every_chart_is_drawn() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    for page in PAGES {
        let file = pages().path(page);
        browser.open(&file);
        assert_eq!(browser.complaints(), [""; 0], "{page}");
        let own = format!("file://{}", file.display());
        assert_eq!(browser.requests(), [own], "{page}");
        let figures = browser.number("document.querySelectorAll('figure').length");
        assert!(figures >= least_figures(page) as f64, "{page}");
        let empty = browser.text(
            "[...document.querySelectorAll('figure')].filter(f => [...f.querySelectorAll('.panel')].some(p =>
                ![...p.querySelectorAll('svg path')].some(m => m.getAttribute('d').length > 3)
                || p.querySelectorAll('text').length < 3 || p.getBoundingClientRect().height < 50)
             ).map(f => f.id).join(' ')",
        );
        assert_eq!(empty, "", "{page}");
    }
}

/// A drag zooms all charts over time; a double click shows all again.
#[test]
fn a_drag_zooms_and_a_double_click_resets() {
    let Some(mut browser) = opened(REPORT) else {
        return;
    };
    assert_eq!(share(&mut browser, "functions"), WHOLE);
    let [from, to] = [[0.25, 0.5], [0.75, 0.5]].map(|at| point(&mut browser, "functions", at));
    let left = |count: u32| json!({"button": "left", "clickCount": count});
    browser.mouse("mousePressed", from, left(1));
    browser.mouse("mouseMoved", to, json!({"button": "left"}));
    browser.mouse("mouseReleased", to, left(1));
    for figure in ["functions", "channel", "residuals", "ratios"] {
        let share = share(&mut browser, figure);
        assert!((share - 0.5).abs() < 0.01, "{figure}: {share}");
    }
    let labels = browser.text(
        "[...document.querySelectorAll('#figure-functions .x text')].map(t => t.textContent).join(' ')",
    );
    assert!(
        labels.starts_with("6 ") && labels.ends_with(" 14"),
        "{labels}"
    );
    for count in [1, 2] {
        browser.mouse("mousePressed", from, left(count));
        browser.mouse("mouseReleased", from, left(count));
    }
    assert_eq!(share(&mut browser, "functions"), WHOLE);
    assert_eq!(share(&mut browser, "residuals"), WHOLE);
}

/// The values below the pointer are those of the table, to the hundredths of a pixel of the drawing.
#[test]
fn the_pointer_reads_values() {
    let Some(mut browser) = opened(REPORT) else {
        return;
    };
    let at = point(&mut browser, "functions", [0.5, 0.5]);
    browser.mouse("mouseMoved", at, json!({}));
    let shown = cursor(&mut browser, "functions");
    let csv = pages().read("runs/plain/functions.csv");
    let row = csv.lines().find(|line| line.starts_with("10,"));
    let mass = row.and_then(|row| row.split(',').nth(1)?.parse::<f64>().ok());
    let mass = mass.expect("the mass at 10 s");
    let value = shown.split("estimate ").nth(1).expect("an estimate");
    let value: f64 = value
        .split(' ')
        .next()
        .and_then(|x| x.parse().ok())
        .expect("a number");
    assert!((value / mass - 1.0).abs() < 2e-3, "{shown}: {mass}");
    assert!(
        shown.starts_with("time t 9.9") || shown.starts_with("time t 10"),
        "{shown}"
    );
    assert!(
        shown.contains("95 % band") && shown.contains(" to "),
        "{shown}"
    );
}

/// The arrows move the cursor, + and - zoom, Escape shows all.
#[test]
fn keys_read_and_zoom() {
    let Some(mut browser) = opened(REPORT) else {
        return;
    };
    browser.evaluate("document.querySelector('#figure-channel .still').focus()");
    browser.key("ArrowRight");
    let first = cursor(&mut browser, "channel");
    browser.key("ArrowRight");
    let second = cursor(&mut browser, "channel");
    assert!(
        first.starts_with("time t 10.2 s") && second.starts_with("time t 10.4 s"),
        "{first} {second}"
    );
    browser.key("+");
    assert_eq!(share(&mut browser, "channel"), 0.5);
    browser.key("-");
    browser.key("+");
    browser.key("Escape");
    assert_eq!(share(&mut browser, "channel"), WHOLE);
    assert_eq!(browser.complaints(), [""; 0]);
}
