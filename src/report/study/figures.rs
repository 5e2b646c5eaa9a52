//! The figures of a study.

use super::{
    BandRecord, BandsRecord, DirectionRecord, EquivalentSystemRecord, Numbers, StudyDocument,
};
use crate::report::chart::{Axis, Colour, Dash, Figure, Mark, Panel, Style};
use crate::report::figures::truth;

/// The names of the figures, some with a suffix.
pub const NAMES: [&str; 8] = [
    "bands",
    "spectrum",
    "directions",
    "profiles",
    "extremes",
    "equivalent-systems",
    "waterfall",
    "study-predictions",
];

/// Figures of all analyses in the study.
pub fn all(study: &StudyDocument) -> Vec<Figure> {
    let mut figures = Vec::new();
    figures.extend(bands(study));
    figures.extend(spectrum(study));
    figures.extend(directions(study));
    figures.extend(profiles(study));
    figures.extend(extremes(study));
    figures.extend(equivalent_systems(study));
    figures.extend(waterfall(study));
    figures.extend(predictions(study));
    figures
}

/// Missing numbers as gaps.
fn gaps(numbers: &Numbers) -> Vec<f64> {
    numbers.iter().map(|x| x.unwrap_or(f64::NAN)).collect()
}

fn bands(study: &StudyDocument) -> Option<Figure> {
    let bands = study.bands.as_ref()?;
    let figure = Figure::new(
        "bands",
        "Estimates with confidence bands",
        "Functions and ratios against time, with the pointwise confidence band and the wider simultaneous band. Marks: \
         turning points, where a free response determines k/m, and zero crossings, where it determines c/m.",
    );
    let panels = bands.bands.iter().map(|band| band_panel(band, bands));
    Some(figure.columns(2).panels(panels))
}

/// Area between the ends of a band; times without ends are omitted.
fn area(
    times: &[f64],
    (low, high): (&Numbers, &Numbers),
    label: &str,
    colour: Colour,
) -> Option<Mark> {
    let ends = times.iter().zip(low).zip(high);
    let ends = ends.filter_map(|((t, low), high)| Some((*t, ((*low)?, (*high)?))));
    let (times, (low, high)): (Vec<f64>, (Vec<f64>, Vec<f64>)) = ends.unzip();
    (times.len() > 1).then(|| Mark::band(label, &times, &low, &high, colour))
}

fn band_panel(band: &BandRecord, all: &BandsRecord) -> Panel {
    let times = &all.times;
    let values = gaps(&band.values);
    let anchors: &[f64] = match band.name.as_str() {
        "k/m" => &all.turning_points,
        "c/m" => &all.zero_crossings,
        _ => &[],
    };
    let at = |t: &f64| values[times.partition_point(|x| x < t).min(times.len() - 1)];
    let anchored: Vec<f64> = anchors.iter().map(at).collect();
    let real = gaps(&band.truth);
    let whole = (&band.simultaneous_low, &band.simultaneous_high);
    let each = (&band.low, &band.high);
    Panel::of_time(&band.name, &band.unit)
        .marks(area(times, whole, "simultaneous", Colour::Grey))
        .marks(area(times, each, "pointwise", Colour::Sky))
        .mark(Mark::line(
            "estimate",
            times,
            &values,
            Style::new(Colour::Blue).width(1.6),
        ))
        .marks((!real.is_empty()).then(|| truth(times, &real)))
        .marks((!anchors.is_empty()).then(|| {
            let style = Style::new(Colour::Black).width(4.0);
            Mark::points("turning points, zero crossings", anchors, &anchored, style)
        }))
}

/// Numbers from 1.
fn ranks(count: usize) -> Vec<f64> {
    (1..=count).map(|i| i as f64).collect()
}

fn spectrum(study: &StudyDocument) -> Option<Figure> {
    let spectrum = study.sensitivity.as_ref()?;
    let values = &spectrum.singular_values;
    let largest = values.first().copied().filter(|s| *s > 0.0)?;
    let relative: Vec<f64> = values.iter().map(|s| (s / largest).max(1e-20)).collect();
    let dashed = Style::new(Colour::Vermillion).dash(Dash::Dashed);
    let rank = spectrum.rank as f64;
    let panel = Panel::new(
        Axis::linear("parameter combination, largest singular value first", ""),
        Axis::log("singular value relative to the largest", ""),
    )
    .marks([
        Mark::line(
            "",
            &ranks(values.len()),
            &relative,
            Style::new(Colour::Blue),
        ),
        Mark::vertical("rank", rank, dashed),
    ]);
    let text = spectrum.text.as_str();
    Some(Figure::new("spectrum", "Singular values of the sensitivity", text).panel(panel))
}

fn directions(study: &StudyDocument) -> Vec<Figure> {
    let Some(spectrum) = &study.sensitivity else {
        return Vec::new();
    };
    let figure = |(name, set): (&str, &[DirectionRecord])| {
        let names = set.first()?.functions.iter().enumerate();
        let panels = names.map(|(f, (name, _))| {
            let line = |(k, direction): (usize, &DirectionRecord)| {
                let label = format!("{:.1e}", direction.singular_value);
                Mark::line(
                    label,
                    &spectrum.times,
                    &direction.functions[f].1,
                    Style::nth(k),
                )
            };
            Panel::of_time(format!("change of {name}"), "").marks(set.iter().enumerate().map(line))
        });
        let figure = Figure::new(
            format!("directions-{name}"),
            format!("Parameter combinations identified {name}"),
            "Change of each function against time along these combinations.",
        );
        Some(figure.panels(panels))
    };
    let sets = [("best", &spectrum.best[..]), ("worst", &spectrum.worst)];
    sets.into_iter().filter_map(figure).collect()
}

/// A figure with a panel for each record, if there are any.
fn each<T>(records: &[T], figure: Figure, panel: impl Fn(&T) -> Panel) -> Option<Figure> {
    (!records.is_empty()).then(|| figure.panels(records.iter().map(panel)))
}

fn profiles(study: &StudyDocument) -> Option<Figure> {
    let figure = Figure::new(
        "profiles",
        "Likelihood profiles",
        "Rise of the minimal cost with one quantity held at a value, against that value.",
    );
    each(&study.profiles, figure.columns(2), |p| {
        let least = p.costs.iter().copied().fold(f64::INFINITY, f64::min);
        let rise: Vec<f64> = p.costs.iter().map(|c| c - least).collect();
        let dashed = Style::new(Colour::Vermillion).dash(Dash::Dashed);
        let dotted = Style::new(Colour::Grey).dash(Dash::Dotted);
        let ends = p.interval.iter().flatten();
        let x = Axis::linear(&p.name, &p.unit);
        Panel::new(x, Axis::linear("rise of the cost", ""))
            .title(&p.verdict)
            .mark(Mark::line("", &p.values, &rise, Style::new(Colour::Blue)))
            .marks(ends.map(|end| Mark::vertical("interval", *end, dashed)))
            .marks(
                (p.active_from.iter())
                    .map(|a| Mark::vertical("constraint becomes active", a.value, dotted)),
            )
    })
}

fn extremes(study: &StudyDocument) -> Option<Figure> {
    let figure = Figure::new(
        "extremes",
        "Data-consistent extremes",
        "Smallest and largest value at each time among all systems within the misfit limit.",
    );
    let dots = |colour| Style::new(colour).width(4.0);
    each(&study.extremes, figure.columns(2), |record| {
        let (t, low, high) = (&record.times, &record.low, &record.high);
        Panel::of_time(&record.name, &record.unit).marks([
            Mark::band("", t, low, high, Colour::Sky),
            Mark::points("smallest", t, low, dots(Colour::Blue)),
            Mark::points("largest", t, high, dots(Colour::Vermillion)),
        ])
    })
}

fn equivalent_systems(study: &StudyDocument) -> Option<Figure> {
    let figure = Figure::new(
        "equivalent-systems",
        "Equivalent systems",
        "Mass, damping and stiffness of systems with the same response as the fit.",
    );
    type Pick = fn(&EquivalentSystemRecord) -> &Vec<f64>;
    let parts: [(&str, &str, Pick); 3] = [
        ("mass m", "kg", |e| &e.mass),
        ("damping c", "N s/m", |e| &e.damping),
        ("stiffness k", "N/m", |e| &e.stiffness),
    ];
    let panels = parts.into_iter().map(|(label, unit, pick)| {
        let systems = study.equivalent_systems.iter().enumerate();
        Panel::of_time(label, unit)
            .marks(systems.map(|(k, e)| Mark::line(&e.name, &e.times, pick(e), Style::nth(k))))
    });
    (!study.equivalent_systems.is_empty()).then(|| figure.panels(panels))
}

fn waterfall(study: &StudyDocument) -> Option<Figure> {
    let multistart = study.multistart.as_ref()?;
    let costs: Vec<f64> = multistart.costs.iter().map(|c| c.max(1e-300)).collect();
    let dots = Style::new(Colour::Blue).width(4.0);
    let panel = Panel::new(Axis::linear("fit, best first", ""), Axis::log("cost J", ""));
    let panel = panel.mark(Mark::points("", &ranks(costs.len()), &costs, dots));
    let figure = Figure::new(
        "waterfall",
        "Fits from random starting points",
        "Final costs in rising order; each step is a minimum.",
    );
    (!costs.is_empty()).then(|| figure.panel(panel))
}

fn predictions(study: &StudyDocument) -> Option<Figure> {
    let figure = Figure::new(
        "study-predictions",
        "Predicted responses",
        "Displacement with its 95 % confidence band, and the envelope over the extreme systems.",
    );
    each(&study.predictions, figure, |p| {
        let area = |ends: &Option<Vec<[f64; 2]>>, label: &str, colour| {
            let ends = ends.iter().flatten().map(|[low, high]| (*low, *high));
            let (low, high): (Vec<f64>, Vec<f64>) = ends.unzip();
            Mark::band(label, &p.times, &low, &high, colour)
        };
        let worst = p
            .envelope
            .is_some()
            .then(|| area(&p.envelope, "extremes", Colour::Orange));
        let band = p
            .band
            .is_some()
            .then(|| area(&p.band, "95 % band", Colour::Sky));
        let found = Mark::line(
            "prediction",
            &p.times,
            &p.displacement,
            Style::new(Colour::Blue),
        );
        Panel::of_time("displacement y", "m")
            .title(&p.name)
            .marks(worst.into_iter().chain(band).chain([found]))
    })
}
