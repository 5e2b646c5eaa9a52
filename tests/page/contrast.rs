//! The colours of the style sheet: text against its background by the rule of WCAG 2, 4.5 to 1, and
//! curves, frames and focus by that for graphics, 3 to 1.

use crate::pages::{PAGES, pages};
use std::collections::BTreeMap;

type Colours = BTreeMap<String, [f64; 3]>;

/// The colours named in one block `{ --name: #rrggbb; ... }`.
fn colours(block: &str) -> Colours {
    let mut found = Colours::new();
    for part in block.split("--").skip(1) {
        let (name, rest) = part.split_once(':').expect("a value");
        let value = rest.split(';').next().expect("a value").trim();
        let hex = value
            .strip_prefix('#')
            .unwrap_or_else(|| panic!("{name}: {value}"));
        assert_eq!(hex.len(), 6, "{name}");
        let part = |i: usize| u8::from_str_radix(&hex[i..i + 2], 16).expect("a colour");
        found.insert(name.into(), [0, 2, 4].map(|i| f64::from(part(i)) / 255.0));
    }
    found
}

/// Colours of the light and the dark scheme.
fn both(style: &str) -> [Colours; 2] {
    let mut blocks = style.split(":root {").skip(1).map(|rest| {
        let block = rest.split('}').next().expect("an end");
        colours(block)
    });
    let (light, dark) = (blocks.next().expect("light"), blocks.next().expect("dark"));
    let mut all = light.clone();
    all.extend(dark);
    [light, all]
}

fn luminance(colour: [f64; 3]) -> f64 {
    let linear = |c: f64| match c <= 0.04045 {
        true => c / 12.92,
        false => ((c + 0.055) / 1.055).powf(2.4),
    };
    let [r, g, b] = colour.map(linear);
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

fn contrast(one: [f64; 3], other: [f64; 3]) -> f64 {
    let (a, b) = (luminance(one), luminance(other));
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

#[test]
fn text_and_curves_stand_out_in_light_and_dark() {
    let html = pages().read(PAGES[0]);
    let style = html.split("<style>").nth(1).expect("a style sheet");
    let style = style.split("</style>").next().expect("an end");
    for (theme, colours) in ["light", "dark"].iter().zip(both(style)) {
        let of = |name: &str| *colours.get(name).unwrap_or_else(|| panic!("{name}"));
        for text in ["ink", "soft", "link", "good", "warn", "bad"] {
            for paper in ["paper", "band"] {
                let ratio = contrast(of(text), of(paper));
                assert!(ratio >= 4.5, "{theme}: {text} on {paper}: {ratio:.2}");
            }
        }
        for drawn in [
            "blue",
            "vermillion",
            "green",
            "purple",
            "orange",
            "sky",
            "black",
            "grey",
            "axis",
            "focus",
        ] {
            let ratio = contrast(of(drawn), of("paper"));
            assert!(ratio >= 3.0, "{theme}: {drawn}: {ratio:.2}");
        }
    }
    // The other colours of the style sheet are those of drawings, which it replaces.
    let rest: String = style
        .split('}')
        .filter(|rule| !rule.contains(":root"))
        .collect();
    assert!(!rest.contains(": #"), "a colour without a name");
}
