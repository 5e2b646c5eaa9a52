//! The figures of a study.

use super::{
    BandRecord, BandsRecord, DirectionRecord, EquivalentSystemRecord, ExtremeSearch,
    ExtremesRecord, Numbers, PredictionRecord, ProfileRecord, StudyDocument,
};
use crate::number_format::significant;
use crate::report::chart::{Axis, Colour, Dash, Figure, Mark, Panel, Style};
use crate::report::figures::truth;
use crate::report::main_figure::variation;

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

/// Most instants that are marked on a curve.
const MOST_ANCHORS: usize = 12;

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

const BANDS: &str = "Pointwise confidence band (filled) and the wider simultaneous band (dashed edges). Marks: instants at \
     which a free response determines k/m (turning points) or c/m (zero crossings).";

fn bands(study: &StudyDocument) -> Option<Figure> {
    let panels = band_panels(study).into_iter().map(|(_, panel)| panel);
    let figure = Figure::new("bands", "Estimates with confidence bands", BANDS).columns(2);
    figure.panels(panels).varying()
}

/// The panels of functions and ratios that vary, with their names.
fn band_panels(study: &StudyDocument) -> Vec<(&str, Panel)> {
    let bands = study.bands.iter();
    let panels = bands.flat_map(|all| all.bands.iter().map(move |band| (band, all)));
    let panels = panels.map(|(band, all)| (band.name.as_str(), band_panel(band, all)));
    panels.filter(|(_, panel)| !panel.is_constant()).collect()
}

/// A figure for each function and ratio that varies, with its name.
pub fn bands_alone(study: &StudyDocument) -> Vec<(&str, Figure)> {
    let panels = band_panels(study).into_iter().enumerate();
    let figure = |(i, (name, panel))| {
        let title = format!("{name} with confidence bands");
        let figure = Figure::new(format!("bands-{}", i + 1), title, BANDS);
        (name, figure.panel(panel))
    };
    panels.map(figure).collect()
}

/// The figure of the first screen: the function or ratio that varies most relative to its interval, with its extremes; without one the first
/// profile, else the fits from random starting points; `None` without any.
pub fn main(study: &StudyDocument) -> Option<Figure> {
    let panels = band_panels(study).into_iter();
    let scored = panels.filter_map(|(name, panel)| Some((variation(&panel)?, name, panel)));
    let most = scored.max_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, name, panel)) = most else {
        let others = profiles_alone(study).into_iter().flatten();
        let mut others = others.chain(waterfall(study));
        let name = "main".to_owned();
        return others.next().map(|figure| Figure { name, ..figure });
    };
    let converged = |e: &&ExtremesRecord| {
        let mut systems = e.systems.iter();
        e.name == name && systems.all(|s| s.status == ExtremeSearch::Converged)
    };
    let extremes = study.extremes.iter().find(converged);
    let panel = panel.marks(extremes.into_iter().flat_map(extreme_marks));
    let title = format!("{name} over the record");
    let figure = Figure::new(
        "main",
        title,
        "The function or ratio that varies most relative to its interval.",
    );
    Some(figure.panel(panel))
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
    let (anchors, label): (&[f64], &str) = match band.name.as_str() {
        "k/m" => (&all.turning_points, "turning points"),
        "c/m" => (&all.zero_crossings, "zero crossings"),
        _ => (&[], ""),
    };
    let anchors: Vec<f64> = thinned(anchors);
    let at = |t: &f64| values[times.partition_point(|x| x < t).min(times.len() - 1)];
    let anchored: Vec<f64> = anchors.iter().map(at).collect();
    let real = gaps(&band.truth);
    let whole = (&band.simultaneous_low, &band.simultaneous_high);
    let each = (&band.low, &band.high);
    Panel::of_time(&band.name, &band.unit)
        .marks(area(times, whole, "simultaneous", Colour::Grey).map(|band| band.dash(Dash::Dashed)))
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
            Mark::points(label, &anchors, &anchored, style)
        }))
}

/// At most [`MOST_ANCHORS`] of the instants, evenly chosen.
fn thinned(instants: &[f64]) -> Vec<f64> {
    let stride = instants.len().div_ceil(MOST_ANCHORS).max(1);
    instants.iter().copied().step_by(stride).collect()
}

/// Numbers from 1.
fn ranks(count: usize) -> Vec<f64> {
    (1..=count).map(|i| i as f64).collect()
}

pub fn spectrum(study: &StudyDocument) -> Option<Figure> {
    let spectrum = study.sensitivity.as_ref()?;
    let values = &spectrum.singular_values;
    // One value is no curve.
    let largest = values
        .first()
        .copied()
        .filter(|s| *s > 0.0 && values.len() > 1)?;
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
        Mark::points(
            "",
            &ranks(values.len()),
            &relative,
            Style::new(Colour::Blue).width(5.0),
        ),
        Mark::vertical("rank", rank, dashed),
    ]);
    let text = "Relative to the largest one; the dashed line is at the number of identifiable parameter combinations.";
    Some(Figure::new("spectrum", "Singular values of the sensitivity", text).panel(panel))
}

pub fn directions(study: &StudyDocument) -> Vec<Figure> {
    let Some(spectrum) = &study.sensitivity else {
        return Vec::new();
    };
    let figure = |(name, set): (&str, &[DirectionRecord])| {
        let names = set.first()?.functions.iter().enumerate();
        // A fixed function has no change.
        let changes = |f: usize| {
            set.iter()
                .any(|d| d.functions[f].1.iter().any(|x| *x != 0.0))
        };
        let names = names.filter(|(f, _)| changes(*f));
        let panels = names.map(|(f, (name, _))| {
            let line = |(k, direction): (usize, &DirectionRecord)| {
                let label = format!(
                    "singular value {}",
                    significant(direction.singular_value, 2)
                );
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
        let figure = figure.panels(panels);
        // The values of constants stand in the sentences.
        let varies = !figure.panels.iter().all(Panel::is_constant);
        varies.then_some(figure)
    };
    let sets = [("best", &spectrum.best[..]), ("worst", &spectrum.worst)];
    // The best and the worst of a few are the same.
    let shown = if spectrum.rank > spectrum.best.len() {
        2
    } else {
        1
    };
    sets.into_iter().take(shown).filter_map(figure).collect()
}

/// A figure with the panels of all records that have one.
fn each<T>(records: &[T], figure: Figure, panel: impl Fn(&T) -> Option<Panel>) -> Option<Figure> {
    let panels: Vec<Panel> = records.iter().filter_map(panel).collect();
    (!panels.is_empty()).then(|| figure.panels(panels))
}

/// A figure for each record that has a panel, with a name and a title of its own.
fn alone<T>(
    records: &[T],
    figure: &Figure,
    name: impl Fn(&T) -> &str,
    panel: impl Fn(&T) -> Option<Panel>,
) -> Vec<Option<Figure>> {
    let one = |(i, record): (usize, &T)| {
        let title = format!("{}: {}", figure.title, name(record));
        let figure_name = format!("{}-{}", figure.name, i + 1);
        let own = Figure::new(figure_name, title, figure.description.as_str());
        panel(record).map(|panel| own.panel(panel))
    };
    records.iter().enumerate().map(one).collect()
}

fn profile_figure() -> Figure {
    Figure::new(
        "profiles",
        "Likelihood profile",
        "Rise of the minimal cost with one quantity held at a value, against that value.",
    )
}

fn profiles(study: &StudyDocument) -> Option<Figure> {
    each(&study.profiles, profile_figure().columns(2), profile_panel)
}

/// A figure for each profile; `None` for one without a curve.
pub fn profiles_alone(study: &StudyDocument) -> Vec<Option<Figure>> {
    alone(
        &study.profiles,
        &profile_figure(),
        |p| p.name.as_str(),
        profile_panel,
    )
}

fn profile_panel(p: &ProfileRecord) -> Option<Panel> {
    let least = p.costs.iter().copied().fold(f64::INFINITY, f64::min);
    let rise: Vec<f64> = p.costs.iter().map(|c| c - least).collect();
    let dashed = Style::new(Colour::Vermillion).dash(Dash::Dashed);
    let dotted = Style::new(Colour::Grey).dash(Dash::Dotted);
    let ends = p.interval.iter().flatten();
    let x = Axis::linear(&p.name, &p.unit);
    let panel = Panel::new(x, Axis::linear("rise of the cost", ""))
        .title(&p.verdict)
        .mark(Mark::line("", &p.values, &rise, Style::new(Colour::Blue)))
        .marks(ends.map(|end| Mark::vertical("interval", *end, dashed)))
        .marks(
            (p.active_from.iter())
                .map(|a| Mark::vertical("constraint becomes active", a.value, dotted)),
        );
    (p.values.len() > 1).then_some(panel)
}

fn extreme_figure() -> Figure {
    Figure::new(
        "extremes",
        "Data-consistent extremes",
        "Smallest and largest value at each of the marked times among all systems within the misfit limit, each of another system.",
    )
}

fn extremes(study: &StudyDocument) -> Option<Figure> {
    let panel = |e: &ExtremesRecord| extreme_panel(study, e);
    each(&study.extremes, extreme_figure().columns(2), panel)
}

/// A figure for each function and ratio with extremes at several times; `None` for constants.
pub fn extremes_alone(study: &StudyDocument) -> Vec<Option<Figure>> {
    let panel = |e: &ExtremesRecord| extreme_panel(study, e);
    alone(
        &study.extremes,
        &extreme_figure(),
        |e| e.name.as_str(),
        panel,
    )
}

fn extreme_panel(study: &StudyDocument, e: &ExtremesRecord) -> Option<Panel> {
    let estimate = study.bands.iter().find_map(|all| {
        let band = all.bands.iter().find(|band| band.name == e.name)?;
        let style = Style::new(Colour::Blue).width(1.6);
        Some(Mark::line(
            "estimate",
            &all.times,
            &gaps(&band.values),
            style,
        ))
    });
    let panel = Panel::of_time(&e.name, &e.unit)
        .marks(estimate)
        .marks(extreme_marks(e));
    (e.times.len() > 1 && !panel.is_constant()).then_some(panel)
}

/// Smallest and largest values as dots at their times, joined by dashed lines.
fn extreme_marks(e: &ExtremesRecord) -> Vec<Mark> {
    let sides = [
        ("smallest", &e.low, Colour::Green, Dash::Dashed),
        ("largest", &e.high, Colour::Vermillion, Dash::DashDot),
    ];
    let marks = sides.into_iter().flat_map(|(label, values, colour, dash)| {
        let style = Style::new(colour);
        [
            Mark::line(label, &e.times, values, style.dash(dash).width(1.2)),
            Mark::points(label, &e.times, values, style.width(5.0)),
        ]
    });
    marks.collect()
}

pub fn equivalent_systems(study: &StudyDocument) -> Option<Figure> {
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

pub fn waterfall(study: &StudyDocument) -> Option<Figure> {
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
    (costs.len() > 1).then(|| figure.panel(panel))
}

fn prediction_figure() -> Figure {
    Figure::new(
        "study-predictions",
        "Predicted response",
        "Displacement with its 95 % confidence band, and the smallest and largest displacement of the extreme systems.",
    )
}

fn predictions(study: &StudyDocument) -> Option<Figure> {
    each(&study.predictions, prediction_figure(), prediction_panel)
}

/// A figure for each prediction.
pub fn predictions_alone(study: &StudyDocument) -> Vec<Option<Figure>> {
    alone(
        &study.predictions,
        &prediction_figure(),
        |p| p.name.as_str(),
        prediction_panel,
    )
}

fn prediction_panel(p: &PredictionRecord) -> Option<Panel> {
    let split = |ends: &[[f64; 2]]| -> [Vec<f64>; 2] {
        [0, 1].map(|side| ends.iter().map(|ends| ends[side]).collect())
    };
    let band = p.band.iter().map(|ends| {
        let [low, high] = split(ends);
        Mark::band("95 % band", &p.times, &low, &high, Colour::Sky)
    });
    let extremes = p.envelope.iter().flat_map(|ends| {
        let style = Style::new(Colour::Vermillion).dash(Dash::Dashed).width(1.0);
        split(ends).map(|side| Mark::line("extremes", &p.times, &side, style))
    });
    let style = Style::new(Colour::Blue);
    let found = Mark::line("prediction", &p.times, &p.displacement, style);
    let panel = Panel::of_time("displacement y", "m").title(&p.name);
    let panel = panel.marks(band).marks(extremes).mark(found);
    (p.times.len() > 1).then_some(panel)
}
