//! The figures of a study.

use super::{BandRecord, Numbers, StudyDocument};
use crate::report::figure::{Axis, Figure, Panel};
use crate::report::mark::{Colour, Dash, Mark, Style};

/// All that the study has something for.
/// The names of the figures, some with a suffix.
pub const NAMES: [&str; 8] = [
    "bands",
    "spectrum",
    "directions",
    "profiles",
    "tubes",
    "equivalents",
    "waterfall",
    "study-predictions",
];

pub fn all(study: &StudyDocument) -> Vec<Figure> {
    let mut figures = Vec::new();
    figures.extend(bands(study));
    figures.extend(spectrum(study));
    figures.extend(directions(study));
    figures.extend(profiles(study));
    figures.extend(tubes(study));
    figures.extend(equivalents(study));
    figures.extend(waterfall(study));
    figures.extend(predictions(study));
    figures
}

fn time() -> Axis {
    Axis::linear("time t", "s")
}

/// Missing numbers as gaps.
fn gaps(numbers: &Numbers) -> Vec<f64> {
    numbers.iter().map(|x| x.unwrap_or(f64::NAN)).collect()
}

fn bands(study: &StudyDocument) -> Option<Figure> {
    let bands = study.bands.as_ref()?;
    let figure = Figure::new(
        "bands",
        "Functions and ratios with their bands",
        "What was found against time, with the band of the stated confidence at each time; wider the \
         band that holds at all times at once. Marks: turning points fix k/m, zero crossings c/m.",
    );
    let figure = bands.bands.iter().fold(figure.columns(2), |figure, band| {
        figure.panel(band_panel(&bands.times, band, bands))
    });
    Some(figure)
}

fn band_panel(times: &[f64], band: &BandRecord, all: &super::BandsPiece) -> Panel {
    let values = gaps(&band.values);
    let known = |low: &Numbers, high: &Numbers| {
        let pairs = low
            .iter()
            .zip(high)
            .filter(|(l, h)| l.is_some() && h.is_some());
        pairs.count() > 1
    };
    // Where a band has no end it is not drawn: its note says so.
    let area = |low: &Numbers, high: &Numbers, label: &str, colour| {
        known(low, high).then(|| {
            let mut kept: [Vec<f64>; 3] = [Vec::new(), Vec::new(), Vec::new()];
            for ((t, l), h) in times.iter().zip(low).zip(high) {
                if let (Some(l), Some(h)) = (l, h) {
                    kept[0].push(*t);
                    kept[1].push(*l);
                    kept[2].push(*h);
                }
            }
            Mark::band(label, &kept[0], &kept[1], &kept[2], colour)
        })
    };
    let anchors: &[f64] = match band.name.as_str() {
        "k/m" => &all.turning_points,
        "c/m" => &all.zero_crossings,
        _ => &[],
    };
    let at = |t: &f64| {
        let i = times.partition_point(|x| x < t).min(times.len() - 1);
        values[i]
    };
    let anchored: Vec<f64> = anchors.iter().map(at).collect();
    let truth = gaps(&band.truth);
    Panel::new(time(), Axis::linear(&band.name, &band.unit))
        .maybe(area(
            &band.simultaneous_low,
            &band.simultaneous_high,
            "at all times at once",
            Colour::Grey,
        ))
        .maybe(area(&band.low, &band.high, "at each time", Colour::Sky))
        .mark(Mark::line(
            "found",
            times,
            &values,
            Style::new(Colour::Blue).width(1.6),
        ))
        .maybe((!truth.is_empty()).then(|| {
            let style = Style::new(Colour::Vermillion).dash(Dash::Dashed);
            Mark::line("truth", times, &truth, style)
        }))
        .maybe((!anchors.is_empty()).then(|| {
            let style = Style::new(Colour::Black).width(4.0);
            Mark::points("fixed by the data", anchors, &anchored, style)
        }))
}

fn spectrum(study: &StudyDocument) -> Option<Figure> {
    let spectrum = study.spectrum.as_ref()?;
    let values = &spectrum.singular_values;
    let largest = values.first().copied().filter(|s| *s > 0.0)?;
    let index: Vec<f64> = (1..=values.len()).map(|i| i as f64).collect();
    let relative: Vec<f64> = values.iter().map(|s| (s / largest).max(1e-20)).collect();
    Some(
        Figure::new(
            "spectrum",
            "What the readings see",
            spectrum.sentence.clone(),
        )
        .panel(
            Panel::new(
                Axis::linear("direction, best first", ""),
                Axis::log("singular value relative to the largest", ""),
            )
            .mark(Mark::line("", &index, &relative, Style::new(Colour::Blue)))
            .mark(Mark::vertical(
                "last direction that is seen",
                spectrum.rank as f64,
                Style::new(Colour::Vermillion).dash(Dash::Dashed),
            )),
        ),
    )
}

fn directions(study: &StudyDocument) -> Vec<Figure> {
    let Some(spectrum) = &study.spectrum else {
        return Vec::new();
    };
    let sets = [
        ("best", "The directions that are seen best", &spectrum.best),
        (
            "worst",
            "The directions that are seen worst",
            &spectrum.worst,
        ),
    ];
    let drawn = sets.into_iter().filter(|(_, _, set)| !set.is_empty());
    drawn
        .map(|(name, title, set)| {
            let figure = Figure::new(
                format!("directions-{name}"),
                title,
                "Changes of the functions against time, one panel for each function.",
            );
            let count = set[0].functions.len();
            (0..count).fold(figure, |figure, f| {
                let name = &set[0].functions[f].0;
                let panel = Panel::new(time(), Axis::linear(format!("change of {name}"), ""));
                let panel = set.iter().enumerate().fold(panel, |panel, (k, direction)| {
                    let label = format!("{:.1e}", direction.singular_value);
                    let values = &direction.functions[f].1;
                    panel.mark(Mark::line(label, &spectrum.times, values, Style::nth(k)))
                });
                figure.panel(panel)
            })
        })
        .collect()
}

fn profiles(study: &StudyDocument) -> Option<Figure> {
    if study.profiles.is_empty() {
        return None;
    }
    let figure = Figure::new(
        "profiles",
        "Profiles",
        "The least cost with one number held, above the optimum's, against that number.",
    );
    let figure = study.profiles.iter().fold(figure.columns(2), |figure, p| {
        let least = p.costs.iter().copied().fold(f64::INFINITY, f64::min);
        let rise: Vec<f64> = p.costs.iter().map(|c| c - least).collect();
        let style = Style::new(Colour::Blue);
        let mut panel = Panel::new(
            Axis::linear(&p.name, &p.unit),
            Axis::linear("rise of the cost", ""),
        )
        .title(p.verdict.clone())
        .mark(Mark::line("", &p.values, &rise, style));
        for end in p.interval.iter().flatten() {
            let style = Style::new(Colour::Vermillion).dash(Dash::Dashed);
            panel = panel.mark(Mark::vertical("interval", *end, style));
        }
        for (value, _) in &p.marks {
            let style = Style::new(Colour::Grey).dash(Dash::Dotted);
            panel = panel.mark(Mark::vertical("another bound", *value, style));
        }
        figure.panel(panel)
    });
    Some(figure)
}

fn tubes(study: &StudyDocument) -> Option<Figure> {
    if study.tubes.is_empty() {
        return None;
    }
    let figure = Figure::new(
        "tubes",
        "The widest tubes",
        "Smallest and largest values among all devices that fit as well as stated, at chosen times.",
    );
    let figure = study.tubes.iter().fold(figure.columns(2), |figure, tube| {
        let panel = Panel::new(time(), Axis::linear(&tube.name, &tube.unit))
            .mark(Mark::band(
                "",
                &tube.times,
                &tube.low,
                &tube.high,
                Colour::Sky,
            ))
            .mark(Mark::points(
                "smallest",
                &tube.times,
                &tube.low,
                Style::new(Colour::Blue).width(4.0),
            ))
            .mark(Mark::points(
                "largest",
                &tube.times,
                &tube.high,
                Style::new(Colour::Vermillion).width(4.0),
            ));
        figure.panel(panel)
    });
    Some(figure)
}

fn equivalents(study: &StudyDocument) -> Option<Figure> {
    if study.equivalents.is_empty() {
        return None;
    }
    let figure = Figure::new(
        "equivalents",
        "Several devices, same motion",
        "Mass, damping and stiffness of devices that all move like the fit.",
    );
    type Pick = fn(&super::EquivalentRecord) -> &Vec<f64>;
    let parts: [(&str, &str, Pick); 3] = [
        ("mass m", "kg", |e| &e.mass),
        ("damping c", "N s/m", |e| &e.damping),
        ("stiffness k", "N/m", |e| &e.stiffness),
    ];
    let figure = parts
        .into_iter()
        .fold(figure, |figure, (label, unit, pick)| {
            let panel = Panel::new(time(), Axis::linear(label, unit));
            let devices = study.equivalents.iter().enumerate();
            figure.panel(devices.fold(panel, |panel, (k, e)| {
                panel.mark(Mark::line(&e.name, &e.times, pick(e), Style::nth(k)))
            }))
        });
    Some(figure)
}

fn waterfall(study: &StudyDocument) -> Option<Figure> {
    let multistart = study.multistart.as_ref()?;
    let costs: Vec<f64> = multistart.costs.iter().map(|c| c.max(1e-300)).collect();
    let index: Vec<f64> = (1..=costs.len()).map(|i| i as f64).collect();
    (!costs.is_empty()).then(|| {
        Figure::new(
            "waterfall",
            "Fits from many starts",
            "Costs of all fits in rising order: steps are optima.",
        )
        .panel(
            Panel::new(Axis::linear("fit, best first", ""), Axis::log("cost J", "")).mark(
                Mark::points("", &index, &costs, Style::new(Colour::Blue).width(4.0)),
            ),
        )
    })
}

fn predictions(study: &StudyDocument) -> Option<Figure> {
    if study.predictions.is_empty() {
        return None;
    }
    let figure = Figure::new(
        "study-predictions",
        "Motions from elsewhere",
        "The displacement of the fitted device, with its band, and the envelope over the extreme devices.",
    );
    let figure = study.predictions.iter().fold(figure, |figure, p| {
        let area = |ends: &Vec<[f64; 2]>, label: &str, colour| {
            let low: Vec<f64> = ends.iter().map(|e| e[0]).collect();
            let high: Vec<f64> = ends.iter().map(|e| e[1]).collect();
            Mark::band(label, &p.times, &low, &high, colour)
        };
        figure.panel(
            Panel::new(time(), Axis::linear("displacement y", "m"))
                .title(p.name.clone())
                .maybe(
                    p.worst
                        .as_ref()
                        .map(|e| area(e, "worst case", Colour::Orange)),
                )
                .maybe(p.band.as_ref().map(|e| area(e, "band", Colour::Sky)))
                .mark(Mark::line(
                    "found",
                    &p.times,
                    &p.displacement,
                    Style::new(Colour::Blue),
                )),
        )
    });
    Some(figure)
}
