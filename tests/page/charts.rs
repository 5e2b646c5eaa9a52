//! Interaction of the charts: pointer, keyboard and visibility in a browser.

use crate::browser::Browser;
use crate::pages::{PAGES, pages};
use serde_json::json;

const REPORT: &str = PAGES[0];

fn opened(page: &str) -> Option<Browser> {
    let mut browser = Browser::start()?;
    browser.open(&pages().path(page));
    Some(browser)
}

/// The first plot of a figure.
fn plot(figure: &str) -> String {
    format!("document.querySelector('#figure-{figure} .plot')")
}

/// Visible range of the horizontal axis.
fn range(browser: &mut Browser, figure: &str) -> [f64; 2] {
    ends(browser, figure, "x")
}

fn ends(browser: &mut Browser, figure: &str, axis: &str) -> [f64; 2] {
    let text = browser.text(&format!(
        "{}.querySelector('svg').dataset.{axis}",
        plot(figure)
    ));
    let ends: Vec<f64> = text
        .split(' ')
        .map(|x| x.parse().expect("a number"))
        .collect();
    ends.try_into().expect("two ends")
}

/// Centre of a plot in the window, after scrolling to it.
fn middle(browser: &mut Browser, figure: &str) -> [f64; 2] {
    let plot = plot(figure);
    browser.evaluate(&format!("{plot}.scrollIntoView({{block: 'center'}})"));
    ["left + b.width / 2", "top + b.height / 2"].map(|what| {
        browser.number(&format!(
            "(() => {{ const b = {plot}.getBoundingClientRect(); return b.{what}; }})()"
        ))
    })
}

fn click(browser: &mut Browser, at: [f64; 2], times: u32) {
    for count in 1..=times {
        for kind in ["mousePressed", "mouseReleased"] {
            browser.mouse(kind, at, json!({"button": "left", "clickCount": count}));
        }
    }
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
        assert!(browser.number("document.querySelectorAll('figure').length") >= 3.0);
        let empty = browser.text(
            "[...document.querySelectorAll('figure')].filter(f => !f.classList.contains('ready')
               || [...f.querySelectorAll('.plot svg')].some(s =>
                    ![...s.querySelectorAll('.marks path')].some(p => p.getTotalLength() >= 0 && p.getAttribute('d').length > 3)
                    || s.querySelectorAll('text').length < 3 || s.getBoundingClientRect().height < 100)
               || f.querySelector('.still').checkVisibility()
             ).map(f => f.id).join(' ')",
        );
        assert_eq!(empty, "", "{page}");
    }
}

#[test]
fn the_wheel_zooms_a_chart_that_has_the_focus() {
    let Some(mut browser) = opened(REPORT) else {
        return;
    };
    let whole = range(&mut browser, "functions");
    assert_eq!(whole, [0.0, 20.0]);
    let at = middle(&mut browser, "functions");
    let turn = json!({"deltaX": 0, "deltaY": -240});
    browser.mouse("mouseMoved", at, json!({}));
    browser.mouse("mouseWheel", at, turn.clone());
    assert_eq!(range(&mut browser, "functions"), whole, "the page scrolls");
    let at = middle(&mut browser, "functions");
    click(&mut browser, at, 1);
    browser.mouse("mouseWheel", at, turn.clone());
    let zoomed = range(&mut browser, "functions");
    assert!(zoomed[0] > 0.0 && zoomed[1] < 20.0, "{zoomed:?}");
    // The value under the pointer stays in place, and all charts over time show the same range.
    for figure in ["channel", "residuals", "ratios", "motion"] {
        assert_eq!(range(&mut browser, figure), zoomed, "{figure}");
    }
    let before = ends(&mut browser, "functions", "y");
    let upward = json!({"deltaX": 0, "deltaY": -240, "modifiers": 8});
    browser.mouse("mouseWheel", at, upward);
    let after = ends(&mut browser, "functions", "y");
    // On some systems Shift makes the wheel scroll sideways, which has no effect.
    assert!(after[1] - after[0] <= before[1] - before[0]);
    browser.key("Escape");
    assert_eq!(range(&mut browser, "functions"), whole);
    assert_eq!(ends(&mut browser, "functions", "y"), before);
    assert_eq!(browser.complaints(), [""; 0]);
}

#[test]
fn keys_zoom_and_read() {
    let Some(mut browser) = opened(REPORT) else {
        return;
    };
    browser.evaluate(&format!("{}.focus()", plot("functions")));
    browser.key("ArrowRight");
    let said = browser.text("document.getElementById('chart-cursor').textContent");
    assert!(said.starts_with("time t 10.2 s; "), "{said}");
    for part in ["estimate 1.", "truth 1 kg", "95 % band "] {
        assert!(said.contains(part), "{part} in {said}");
    }
    browser.key("+");
    let zoomed = range(&mut browser, "functions");
    assert!((zoomed[1] - zoomed[0] - 10.0).abs() < 1e-9, "{zoomed:?}");
    browser.key("End");
    let end = browser.text("document.getElementById('chart-cursor').textContent");
    assert_ne!(end, said);
    // A step beyond the edge moves the visible range.
    browser.key("ArrowRight");
    let moved = range(&mut browser, "functions");
    assert!(moved[0] > zoomed[0] && moved[1] > zoomed[1], "{moved:?}");
    browser.key("Home");
    browser.key("-");
    assert_eq!(range(&mut browser, "functions"), [0.0, 20.0]);
    browser.key("+");
    browser.key("Escape");
    assert_eq!(range(&mut browser, "functions"), [0.0, 20.0]);
    // At any zoom there is an axis, and the zoom can be reset.
    browser.evaluate(&format!(
        "for (let i = 0; i < 200; i += 1) {}.dispatchEvent(new KeyboardEvent('keydown', {{key: '+', bubbles: true}}))",
        plot("functions")
    ));
    browser.settle();
    let [low, high] = range(&mut browser, "functions");
    assert!(high - low > 0.0 && high - low < 1e-6, "{low} {high}");
    browser.key("Escape");
    assert_eq!(range(&mut browser, "functions"), [0.0, 20.0]);
    // A chart with a separate logarithmic axis.
    browser.evaluate(&format!("{}.focus()", plot("spectra")));
    let whole = range(&mut browser, "spectra");
    browser.key("+");
    assert_ne!(range(&mut browser, "spectra"), whole);
    assert_eq!(range(&mut browser, "functions"), [0.0, 20.0]);
    assert_eq!(browser.complaints(), [""; 0]);
}

#[test]
fn a_drag_zooms_and_a_double_click_resets() {
    let Some(mut browser) = opened(REPORT) else {
        return;
    };
    let at = middle(&mut browser, "channel");
    let to = [at[0] + 100.0, at[1] + 2.0];
    browser.mouse(
        "mousePressed",
        at,
        json!({"button": "left", "clickCount": 1}),
    );
    browser.mouse("mouseMoved", to, json!({"button": "left", "buttons": 1}));
    assert!(browser.number("document.querySelectorAll('.drag').length") == 1.0);
    browser.mouse(
        "mouseReleased",
        to,
        json!({"button": "left", "clickCount": 1}),
    );
    let zoomed = range(&mut browser, "channel");
    assert!(zoomed[0] > 5.0 && zoomed[1] < 16.0, "{zoomed:?}");
    let disabled = "document.querySelector('#figure-channel .tools button:nth-child(3)').disabled";
    assert_eq!(browser.evaluate(disabled), json!(false));
    click(&mut browser, at, 2);
    assert_eq!(range(&mut browser, "channel"), [0.0, 20.0]);
    assert_eq!(browser.evaluate(disabled), json!(true));
    // The pointer shows a line and the values at its position.
    browser.mouse("mouseMoved", at, json!({}));
    let reading = browser.text("document.querySelector('#figure-channel .cursor').textContent");
    assert!(
        reading.contains("samples") && reading.contains("model"),
        "{reading}"
    );
    assert!(browser.number("document.querySelectorAll('#figure-channel .cross').length") == 1.0);
    assert_eq!(browser.complaints(), [""; 0]);
}

#[test]
fn the_legend_switches_curves() {
    let Some(mut browser) = opened(REPORT) else {
        return;
    };
    let count = "document.querySelectorAll('#figure-functions .marks path').length";
    let all = browser.number(count);
    let key = "document.querySelector('#figure-functions .key')";
    browser.evaluate(&format!("{key}.click()"));
    assert_eq!(
        browser.text(&format!("{key}.getAttribute('aria-pressed')")),
        "false"
    );
    assert!(browser.number(count) < all);
    // By the keyboard, as a button.
    browser.evaluate(&format!("{key}.focus()"));
    browser.call(
        "Input.dispatchKeyEvent",
        json!({"type": "keyDown", "key": " ", "text": " ", "windowsVirtualKeyCode": 32}),
    );
    browser.call(
        "Input.dispatchKeyEvent",
        json!({"type": "keyUp", "key": " ", "windowsVirtualKeyCode": 32}),
    );
    browser.settle();
    assert_eq!(
        browser.text(&format!("{key}.getAttribute('aria-pressed')")),
        "true"
    );
    assert_eq!(browser.number(count), all);
}

fn phone(browser: &mut Browser) {
    let size = json!({"width": 390, "height": 844, "deviceScaleFactor": 2, "mobile": true});
    browser.call("Emulation.setDeviceMetricsOverride", size);
    browser.call(
        "Emulation.setTouchEmulationEnabled",
        json!({"enabled": true, "maxTouchPoints": 2}),
    );
}

#[test]
fn a_phone_shows_everything_and_two_fingers_zoom() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    phone(&mut browser);
    for page in PAGES {
        browser.open(&pages().path(page));
        let width = browser.number("document.documentElement.scrollWidth");
        assert!(width <= 390.0, "{page}: {width}");
    }
    browser.open(&pages().path(REPORT));
    let [x, y] = middle(&mut browser, "channel");
    for (kind, apart) in [
        ("touchStart", 30.0),
        ("touchMove", 60.0),
        ("touchMove", 90.0),
    ] {
        let fingers = json!([{"x": x - apart, "y": y, "id": 1}, {"x": x + apart, "y": y, "id": 2}]);
        browser.call(
            "Input.dispatchTouchEvent",
            json!({"type": kind, "touchPoints": fingers}),
        );
        browser.settle();
    }
    browser.call(
        "Input.dispatchTouchEvent",
        json!({"type": "touchEnd", "touchPoints": []}),
    );
    browser.settle();
    let [low, high] = range(&mut browser, "channel");
    assert!(high - low < 12.0, "{low} {high}");
    assert_eq!(browser.complaints(), [""; 0]);
}

/// Contrast of every visible text with its background, from the computed colours of the browser.
const FAINT: &str = "(() => {
  const rgb = (c) => c.match(/[\\d.]+/g).map(Number);
  const light = (c) => { const [r, g, b] = c.map((v) => { const s = v / 255; return s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4; }); return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
  const behind = (e) => { for (; e; e = e.parentElement) { const c = rgb(getComputedStyle(e).backgroundColor); if (c.length === 3 || c[3] > 0) return c.slice(0, 3); } return [255, 255, 255]; };
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const faint = []; let seen = 0;
  for (let n = texts.nextNode(); n; n = texts.nextNode()) {
    const e = n.parentElement;
    if (!n.textContent.trim() || !e.checkVisibility() || e.closest('script, style')) continue;
    const style = getComputedStyle(e);
    const [a, b] = [light(rgb(e.namespaceURI.endsWith('svg') ? style.fill : style.color).slice(0, 3)), light(behind(e))];
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    seen += 1;
    if (ratio < 4.5) faint.push(`${ratio.toFixed(2)} ${n.textContent.trim().slice(0, 30)}`);
  }
  return seen < 50 ? `only ${seen} texts` : faint.join('; ');
})()";

#[test]
fn every_text_stands_out_in_light_and_dark() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    for theme in ["light", "dark"] {
        let features = json!([{"name": "prefers-color-scheme", "value": theme}]);
        browser.call("Emulation.setEmulatedMedia", json!({"features": features}));
        for page in PAGES {
            browser.open(&pages().path(page));
            assert_eq!(browser.text(FAINT), "", "{page} {theme}");
            let paper = browser.text("getComputedStyle(document.body).backgroundColor");
            let expected = if theme == "dark" {
                "rgb(20, 23, 26)"
            } else {
                "rgb(255, 255, 255)"
            };
            assert_eq!(paper, expected);
        }
    }
}

/// On paper, and without scripts, drawings replace the charts.
#[test]
fn paper_and_readers_without_scripts_get_drawings() {
    let Some(mut browser) = opened(REPORT) else {
        return;
    };
    let figures = browser.number("document.querySelectorAll('figure').length");
    let seen = |what: &str| {
        format!("[...document.querySelectorAll('{what}')].filter(e => e.checkVisibility()).length")
    };
    assert_eq!(browser.number(&seen(".still svg")), 0.0);
    browser.call("Emulation.setEmulatedMedia", json!({"media": "print"}));
    assert_eq!(browser.number(&seen(".still svg")), figures);
    assert_eq!(browser.number(&seen(".live")), 0.0);
    browser.call("Emulation.setEmulatedMedia", json!({"media": ""}));
    browser.call(
        "Emulation.setScriptExecutionDisabled",
        json!({"value": true}),
    );
    browser.load(&pages().path(REPORT));
    let folded = browser.number("document.querySelectorAll('details figure').length");
    assert!(folded > 0.0);
    assert_eq!(browser.number(&seen(".still svg")), figures - folded);
}
