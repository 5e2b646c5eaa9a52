//! The standard figures as SVG documents: well-formed, reproducible, small, and valid for any data.

use kmcfit::report::figures::{FunctionCurve, convergence, functions, ratios, response};
use kmcfit::report::{Axis, Colour, Figure, Mark, Panel, Style, render};

/// All standard figures, with one series for all quantities.
fn standard(t: &[f64], y: &[f64]) -> Vec<Figure> {
    let curve = FunctionCurve {
        band: Some((y, t)),
        start: Some(t),
        truth: Some(y),
        ..FunctionCurve::new("mass m", "kg", y)
    };
    let found = [y, t, y, y].map(<[f64]>::to_vec);
    vec![
        convergence(t, y, t),
        response(t, y, &[(0, t, y), (10, t, t)]),
        functions([curve, curve, curve].map(|c| c.panel(t))),
        ratios(t, &found, Some(&found), &[[y.to_vec(), t.to_vec()]]),
    ]
}

fn wave(count: usize) -> (Vec<f64>, Vec<f64>) {
    let t: Vec<f64> = (0..count).map(|i| 25.0 * i as f64 / count as f64).collect();
    let y = t.iter().map(|t| 3.3 * t.cos()).collect();
    (t, y)
}

/// Parses the document and checks that all its coordinates are finite.
fn check(svg: &str) {
    let document = roxmltree::Document::parse(svg).expect("well-formed");
    let root = document.root_element();
    assert_eq!(root.attribute("role"), Some("img"));
    assert!(root.attribute("viewBox").is_some());
    let children: Vec<_> = root.children().filter(|node| node.is_element()).collect();
    assert_eq!(children[0].tag_name().name(), "title");
    assert_eq!(children[1].tag_name().name(), "desc");
    for node in document.descendants() {
        for attribute in node.attributes() {
            let value = attribute.value();
            assert!(!value.contains("NaN") && !value.contains("inf"), "{value}");
        }
    }
}

#[test]
fn standard_figures_are_well_formed_and_stable() {
    let (t, y) = wave(500);
    let again = standard(&t, &y);
    for (figure, again) in standard(&t, &y).iter().zip(&again) {
        let svg = render(figure);
        check(&svg);
        assert_eq!(svg, render(again), "{} differs from itself", figure.name);
    }
}

#[test]
fn any_data_give_a_figure() {
    let ugly = [
        vec![],
        vec![1.0],
        vec![0.0; 5],
        vec![1.0; 5],
        vec![-1.0; 5],
        vec![f64::NAN; 5],
        vec![f64::INFINITY, 1.0, f64::NEG_INFINITY, f64::NAN, 2.0],
        vec![f64::MAX, f64::MIN, 1.0],
        vec![1e300, -1e300, 0.0],
        vec![5e-324, 1e-310, 0.0],
        vec![1e15, 1e15 + 1.0],
    ];
    for x in &ugly {
        for y in &ugly {
            standard(x, y)
                .iter()
                .for_each(|figure| check(&render(figure)));
        }
    }
}

#[test]
fn figures_without_content_are_documents_too() {
    check(&render(&Figure::new("", "", "")));
    check(&render(&functions([])));
    check(&render(&ratios(&[], &Default::default(), None, &[])));
    check(&render(&Figure::new("", "", "").columns(0).panel(
        Panel::new(
            Axis::linear("", "").limits(1.0, 1.0),
            Axis::log("", "").limits(-1.0, f64::NAN),
        ),
    )));
}

#[test]
fn text_is_escaped_everywhere() {
    let text = "a<b & \"c\" 'd' \u{1}";
    let t = [0.0, 1.0];
    let panel = Panel::new(Axis::linear(text, text), Axis::linear(text, text))
        .title(text)
        .mark(Mark::line(text, &t, &t, Style::new(Colour::Blue)))
        .mark(Mark::span(text, 0.2, f64::INFINITY))
        .mark(Mark::horizontal(text, 0.5, Style::nth(1)))
        .mark(Mark::vertical(text, f64::NAN, Style::nth(2)))
        .mark(Mark::band(text, &t, &t, &t, Colour::Purple));
    let svg = render(&Figure::new("name", text, text).panel(panel));
    check(&svg);
    let document = roxmltree::Document::parse(&svg).expect("well-formed");
    let texts = document.descendants().filter(|node| node.is_text());
    let found = texts.filter(|node| node.text().is_some_and(|s| s.contains("a<b & \"c\" 'd'")));
    assert_eq!(found.count(), 2 + 5 + 3);
}

#[test]
fn decades_are_labelled_in_superscripts() {
    let iterations: Vec<f64> = (1..=1000).map(f64::from).collect();
    let cost: Vec<f64> = iterations.iter().map(|i| 0.8 * i.powf(-1.3)).collect();
    let svg = render(&convergence(&iterations, &cost, &cost));
    for label in ["10⁻⁴", "10⁻³", "10⁻²", "10⁻¹", "10⁰", "10¹", "10²", "10³"] {
        assert!(svg.contains(&format!(">{label}<")), "{label} is missing");
    }
    assert!(!svg.contains(">10⁴<") && !svg.contains(">10⁻⁵<"));
}

#[test]
fn long_series_make_small_files_and_keep_their_spikes() {
    let (t, mut y) = wave(128_000);
    let dull = render(&response(&t, &y, &[(0, &t, &y)]));
    y[100_001] = 3.35;
    let spiked = render(&response(&t, &y, &[(0, &t, &y)]));
    assert_ne!(dull, spiked);
    let (t, y) = wave(2000);
    let snapshots = [0, 10, 30, 100, 300, 1000].map(|i| (i, t.as_slice(), y.as_slice()));
    for svg in [dull, spiked, render(&response(&t, &y, &snapshots))] {
        assert!(svg.len() < 200_000, "{} bytes", svg.len());
    }
}

#[test]
fn equal_axes_share_their_labels() {
    let (t, y) = wave(50);
    let curve = FunctionCurve::new("mass m", "kg", &y);
    let svg = render(&functions([curve, curve].map(|c| c.panel(&t))));
    assert_eq!(svg.matches(">time t (s)<").count(), 1);
    assert_eq!(svg.matches(">mass m (kg)<").count(), 2);
    assert_eq!(svg.matches(">estimate<").count(), 1);
}
