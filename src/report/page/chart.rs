//! The numbers of a figure for the script of the page.

use super::shrink::kept;
use crate::report::figure::{Axis, Figure, Panel, Scale};
use crate::report::mark::{Colour, Dash, Mark, Style};
use crate::report::text::clean;
use serde::Serialize;

/// Significant digits of what can be read off, beyond those that all values of a curve have in common.
const DIGITS: i32 = 6;

/// A figure as text that may stand in a script element.
pub(super) struct Drawn {
    pub json: String,
    /// Whether points were left out that could be seen when zoomed.
    pub thinned: bool,
}

/// The numbers of a figure; the chart begins without the curves of the labels `off`.
pub(super) fn chart(figure: &Figure, off: &[&str]) -> Drawn {
    let mut maker = Maker::default();
    let panels: Vec<PanelData> = figure.panels.iter().map(|p| maker.panel(p)).collect();
    let data = ChartData {
        columns: figure.columns,
        off,
        xs: &maker.xs,
        panels: &panels,
    };
    // Plain structs with text keys always serialise.
    let json = serde_json::to_string(&data).unwrap_or_default();
    Drawn {
        json: inert(&json),
        thinned: maker.thinned,
    }
}

/// JSON without the letters that could end a script or begin markup; in JSON they only stand in texts.
fn inert(json: &str) -> String {
    clean(json)
        .replace('<', "\\u003c")
        .replace('>', "\\u003e")
        .replace('&', "\\u0026")
}

#[derive(Serialize)]
struct ChartData<'a> {
    columns: usize,
    off: &'a [&'a str],
    xs: &'a [Abscissae],
    panels: &'a [PanelData<'a>],
}

/// Horizontal places, which several marks may share.
#[derive(PartialEq, Serialize)]
#[serde(untagged)]
enum Abscissae {
    Even { from: f64, step: f64, count: usize },
    Each(Vec<Option<f64>>),
}

impl Abscissae {
    /// Places that are equally spaced to a millionth of a step are written by their ends.
    fn new(x: &[f64]) -> Self {
        let (Some(from), Some(to)) = (x.first().copied(), x.last().copied()) else {
            return Self::Each(Vec::new());
        };
        let step = (to - from) / (x.len().max(2) - 1) as f64;
        let close = |(i, x): (usize, &f64)| (x - (from + i as f64 * step)).abs() <= 1e-6 * step;
        match step > 0.0 && x.iter().enumerate().all(close) {
            true => Self::Even {
                from,
                step,
                count: x.len(),
            },
            false => Self::Each(rounded(x)),
        }
    }
}

#[derive(Serialize)]
struct PanelData<'a> {
    title: &'a str,
    x: AxisData<'a>,
    y: AxisData<'a>,
    marks: Vec<MarkData<'a>>,
}

#[derive(Serialize)]
struct AxisData<'a> {
    label: &'a str,
    unit: &'a str,
    log: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    limits: Option<(f64, f64)>,
}

impl<'a> AxisData<'a> {
    fn new(axis: &'a Axis) -> Self {
        let log = axis.scale == Scale::Log;
        let useful = |(low, high): &(f64, f64)| {
            low.is_finite() && high.is_finite() && low < high && (!log || *low > 0.0)
        };
        Self {
            label: &axis.label,
            unit: &axis.unit,
            log,
            limits: axis.limits.filter(useful),
        }
    }
}

#[derive(Default, Serialize)]
struct MarkData<'a> {
    kind: &'static str,
    label: &'a str,
    #[serde(skip_serializing_if = "str::is_empty")]
    colour: &'static str,
    #[serde(skip_serializing_if = "str::is_empty")]
    dash: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    width: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    x: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    y: Option<Vec<Option<f64>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    low: Option<Vec<Option<f64>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    high: Option<Vec<Option<f64>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    at: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    from: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    to: Option<f64>,
}

impl<'a> MarkData<'a> {
    fn styled(kind: &'static str, label: &'a str, style: &Style) -> Self {
        Self {
            kind,
            label,
            colour: name(style.colour),
            dash: match kind {
                "points" => "",
                _ => pattern(style.dash),
            },
            width: Some(style.width.clamp(0.1, 20.0)),
            ..Self::default()
        }
    }
}

/// The class of a colour in the style sheet.
fn name(colour: Colour) -> &'static str {
    match colour {
        Colour::Black => "black",
        Colour::Blue => "blue",
        Colour::Vermillion => "vermillion",
        Colour::Green => "green",
        Colour::Purple => "purple",
        Colour::Orange => "orange",
        Colour::Sky => "sky",
        Colour::Grey => "grey",
    }
}

fn pattern(dash: Dash) -> &'static str {
    match dash {
        Dash::Solid => "",
        Dash::Dashed => "6 3.2",
        Dash::Dotted => "1.6 2.2",
        Dash::DashDot => "7 2.6 1.6 2.6",
    }
}

/// Makes the marks and collects the places that they share.
#[derive(Default)]
struct Maker {
    xs: Vec<Abscissae>,
    thinned: bool,
}

impl Maker {
    fn panel<'a>(&mut self, panel: &'a Panel) -> PanelData<'a> {
        let scales = (panel.x.scale, panel.y.scale);
        PanelData {
            title: &panel.title,
            x: AxisData::new(&panel.x),
            y: AxisData::new(&panel.y),
            marks: (panel.marks.iter())
                .map(|mark| self.mark(mark, scales))
                .collect(),
        }
    }

    fn mark<'a>(&mut self, mark: &'a Mark, (across, up): (Scale, Scale)) -> MarkData<'a> {
        let finite = |x: f64| x.is_finite().then_some(x);
        match mark {
            Mark::Line { label, x, y, style } | Mark::Points { label, x, y, style } => {
                let joined = matches!(mark, Mark::Line { .. });
                let points = self.kept((x, across), &[(y, up)], joined);
                MarkData {
                    x: Some(self.places(x, &points)),
                    y: Some(rounded(&chosen(y, &points))),
                    ..MarkData::styled(if joined { "line" } else { "points" }, label, style)
                }
            }
            Mark::Band {
                label,
                x,
                low,
                high,
                colour,
            } => {
                let points = self.kept((x, across), &[(low, up), (high, up)], true);
                MarkData {
                    kind: "band",
                    label,
                    colour: name(*colour),
                    x: Some(self.places(x, &points)),
                    low: Some(rounded(&chosen(low, &points))),
                    high: Some(rounded(&chosen(high, &points))),
                    ..MarkData::default()
                }
            }
            Mark::Span { label, from, to } => MarkData {
                kind: "span",
                label,
                from: finite(*from),
                to: finite(*to),
                ..MarkData::default()
            },
            Mark::HorizontalLine { label, y, style } => MarkData {
                at: finite(*y),
                ..MarkData::styled("across", label, style)
            },
            Mark::VerticalLine { label, x, style } => MarkData {
                at: finite(*x),
                ..MarkData::styled("upright", label, style)
            },
        }
    }

    fn kept(&mut self, x: (&[f64], Scale), ys: &[(&[f64], Scale)], joined: bool) -> Vec<usize> {
        let (points, thinned) = kept(x, ys, joined);
        self.thinned |= thinned;
        points
    }

    /// The index of these places among those of the figure.
    fn places(&mut self, x: &[f64], points: &[usize]) -> usize {
        let places = Abscissae::new(&chosen(x, points));
        let known = self.xs.iter().position(|known| *known == places);
        known.unwrap_or_else(|| {
            self.xs.push(places);
            self.xs.len() - 1
        })
    }
}

fn chosen(values: &[f64], points: &[usize]) -> Vec<f64> {
    points.iter().map(|i| values[*i]).collect()
}

/// As many digits as tell values apart that differ by a millionth of their range; what is not finite
/// is left open.
fn rounded(values: &[f64]) -> Vec<Option<f64>> {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    let common = (low.abs().max(high.abs()) / (high - low)).log10();
    let digits = match common.is_finite() {
        true => DIGITS + common.ceil().clamp(0.0, 10.0) as i32,
        false => DIGITS,
    };
    let round = |v: f64| format!("{v:.*e}", digits as usize - 1).parse().unwrap_or(v);
    let open = |v: &f64| v.is_finite().then(|| round(*v));
    values.iter().map(open).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_the_digits_that_tell_them_apart() {
        assert_eq!(
            rounded(&[1.0 / 3.0, f64::NAN, 1e300]),
            [Some(0.333333), None, Some(1e300)]
        );
        let near = rounded(&[1000.0001234567, 1000.0009876543]);
        assert_eq!(near, [Some(1000.000123457), Some(1000.000987654)]);
        assert_eq!(rounded(&[2.0; 3]), [Some(2.0); 3]);
        assert_eq!(rounded(&[]), []);
    }

    #[test]
    fn even_places_are_written_by_their_ends() {
        let x: Vec<f64> = (0..2000).map(|i| f64::from(i) * 25.0 / 1999.0).collect();
        assert!(matches!(
            Abscissae::new(&x),
            Abscissae::Even { count: 2000, .. }
        ));
        assert!(matches!(
            Abscissae::new(&[0.0, 1.0, 3.0]),
            Abscissae::Each(_)
        ));
        for few in [vec![], vec![1.0], vec![1.0, 1.0], vec![f64::NAN, 1.0]] {
            assert!(
                matches!(Abscissae::new(&few), Abscissae::Each(_)),
                "{few:?}"
            );
        }
    }

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
                let json = chart(&Figure::new("", "", "").panel(panel), &[]).json;
                let read: serde_json::Value = serde_json::from_str(&json).expect("JSON");
                assert_eq!(read["panels"][0]["marks"].as_array().map(Vec::len), Some(4));
            }
        }
    }

    #[test]
    fn no_text_ends_the_script() {
        let hostile = "</script><!-- & ]]>\u{ffff}";
        let panel = Panel::new(Axis::linear(hostile, ""), Axis::log("", hostile)).title(hostile);
        let drawn = chart(&Figure::new("", "", "").panel(panel), &[hostile]);
        assert!(!drawn.json.contains(['<', '>', '&', '\u{ffff}']));
        let read: serde_json::Value = serde_json::from_str(&drawn.json).expect("JSON");
        assert_eq!(read["panels"][0]["title"], "</script><!-- & ]]>");
    }
}
