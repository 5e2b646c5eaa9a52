//! Serialisation of a figure for the script of a page.

use super::figure::Figure;
use super::thin::Detail;
use crate::report::text::clean;
use serde::Serialize;

/// A figure as text for a script element.
pub(in crate::report) struct Data {
    pub json: String,
    /// True if thinning removed points that would be visible when zoomed.
    pub thinned: bool,
}

/// Serialises a figure; curves with the labels `off` are initially hidden.
pub(in crate::report) fn data(figure: &Figure, off: &[&str]) -> Data {
    #[derive(Serialize)]
    struct Chart<'a> {
        off: &'a [&'a str],
        #[serde(flatten)]
        figure: &'a Figure,
    }
    let figure = figure.clone().thinned(Detail::FULL);
    let mut marks = figure.panels.iter().flat_map(|panel| &panel.marks);
    let thinned = marks.any(|mark| mark.is_thinned);
    let figure = &figure;
    // Plain structs with text keys always serialise.
    let json = serde_json::to_string(&Chart { off, figure }).unwrap_or_default();
    Data {
        json: inert(&json),
        thinned,
    }
}

/// Serialises plain data for a script element.
pub(in crate::report) fn text_for_script<T: Serialize>(contents: &T) -> String {
    // Plain structs with text keys always serialise.
    inert(&serde_json::to_string(contents).unwrap_or_default())
}

/// Escapes the characters of JSON that could end a script or begin markup; they occur only in strings.
fn inert(json: &str) -> String {
    clean(json)
        .replace('<', "\\u003c")
        .replace('>', "\\u003e")
        .replace('&', "\\u0026")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::chart::{Axis, Colour, Mark, Panel, Style};

    #[test]
    fn any_data_give_numbers() {
        let ugly = [
            vec![],
            vec![1.0],
            vec![f64::NAN; 3],
            vec![f64::INFINITY, 1.0, f64::NEG_INFINITY],
            vec![f64::MAX, f64::MIN, 1.0],
            vec![5e-324, 0.0, -0.0],
            vec![1e15, 1e15 + 1.0],
        ];
        for (x, y) in ugly.iter().flat_map(|x| ugly.iter().map(move |y| (x, y))) {
            for axis in [Axis::linear("", ""), Axis::log("", "")] {
                let style = Style::nth(0);
                let panel = Panel::new(axis.clone(), axis)
                    .mark(Mark::line("", x, y, style))
                    .mark(Mark::points("", y, x, style))
                    .mark(Mark::band("", x, y, x, Colour::Blue))
                    .mark(Mark::span("", f64::NAN, f64::INFINITY));
                let json = data(&Figure::new("", "", "").panel(panel), &[]).json;
                let read: serde_json::Value = serde_json::from_str(&json).expect("JSON");
                assert_eq!(read["panels"][0]["marks"].as_array().map(Vec::len), Some(4));
            }
        }
    }

    #[test]
    fn no_text_ends_the_script() {
        let hostile = "</script><!-- & ]]>\u{ffff}";
        let panel = Panel::new(Axis::linear(hostile, ""), Axis::log("", hostile)).title(hostile);
        let drawn = data(&Figure::new("", "", "").panel(panel), &[hostile]);
        assert!(!drawn.json.contains(['<', '>', '&', '\u{ffff}']));
        let read: serde_json::Value = serde_json::from_str(&drawn.json).expect("JSON");
        assert_eq!(read["panels"][0]["title"], "</script><!-- & ]]>");
    }
}
