//! The figures of a study.

use super::{
    BandRecord, BandsRecord, EquivalentSystemRecord, ExtremesRecord, Numbers, PredictionRecord,
    ProfileRecord, StudyDocument,
};
use crate::report::chart::{Axis, Colour, Dash, Figure, Mark, Panel, Style, sides};
use crate::report::figures::truth;
use crate::report::main_figure::variation;
use kmcfit_core::study::ExtremeStatus;

fn gaps(numbers: &Numbers) -> Vec<f64> {
    numbers.iter().map(|x| x.unwrap_or(f64::NAN)).collect()
}

pub fn bands(study: &StudyDocument) -> Option<Figure> {
    let panels = band_panels(study).into_iter().map(|(_, panel)| panel);
    let figure = Figure::new(
        "bands",
        "Estimates with confidence bands",
        "Estimates with their pointwise confidence bands against time.",
    )
    .columns(2);
    figure.panels(panels).varying()
}

/// The panels of functions and ratios that vary, with their names.
fn band_panels(study: &StudyDocument) -> Vec<(&str, Panel)> {
    let bands = study.bands.iter();
    let panels = bands.flat_map(|all| all.bands.iter().map(move |band| (band, all)));
    let panels = panels.map(|(band, all)| (band.name.as_str(), band_panel(band, all)));
    panels.filter(|(_, panel)| !panel.is_constant()).collect()
}

/// The figure of the first screen: the function or ratio that varies most relative to its interval, with its extremes; without one the first
/// profile, else the fits from random starting points; `None` without any.
pub fn main(study: &StudyDocument) -> Option<Figure> {
    let panels = band_panels(study).into_iter();
    let scored = panels.filter_map(|(name, panel)| Some((variation(&panel)?, name, panel)));
    let most = scored.max_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, name, panel)) = most else {
        let name = "main".to_owned();
        let other = profiles(study).or_else(|| waterfall(study));
        return other.map(|figure| Figure { name, ..figure });
    };
    let converged = |e: &&ExtremesRecord| {
        let mut systems = e.systems.iter();
        e.name == name && systems.all(|s| s.status == ExtremeStatus::Converged)
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
    let real = gaps(&band.truth);
    let each = (&band.low, &band.high);
    Panel::of_time(&band.name, &band.unit)
        .marks(area(times, each, "confidence band", Colour::Sky))
        .mark(Mark::line(
            "estimate",
            times,
            &values,
            Style::new(Colour::Blue).width(1.6),
        ))
        .marks((!real.is_empty()).then(|| truth(times, &real)))
}

/// Numbers from 1.
fn ranks(count: usize) -> Vec<f64> {
    (1..=count).map(|i| i as f64).collect()
}

/// A figure with the panels of all records that have one.
fn each<T>(records: &[T], figure: Figure, panel: impl Fn(&T) -> Option<Panel>) -> Option<Figure> {
    let panels: Vec<Panel> = records.iter().filter_map(panel).collect();
    (!panels.is_empty()).then(|| figure.panels(panels))
}

pub fn profiles(study: &StudyDocument) -> Option<Figure> {
    let figure = Figure::new(
        "profiles",
        "Likelihood profiles",
        "Rise of the minimal cost with one quantity held at a value, against that value.",
    );
    each(&study.profiles, figure.columns(2), profile_panel)
}

fn profile_panel(p: &ProfileRecord) -> Option<Panel> {
    let least = p.costs.iter().copied().fold(f64::INFINITY, f64::min);
    let rise: Vec<f64> = p.costs.iter().map(|c| c - least).collect();
    let dashed = Style::new(Colour::Vermillion).dash(Dash::Dashed);
    let ends = p.interval.iter().flatten();
    let x = Axis::linear(&p.name, &p.unit);
    let panel = Panel::new(x, Axis::linear("rise of the cost", ""))
        .title(&p.verdict)
        .mark(Mark::line("", &p.values, &rise, Style::new(Colour::Blue)))
        .marks(ends.map(|end| Mark::vertical("interval", *end, dashed)));
    (p.values.len() > 1).then_some(panel)
}

pub fn extremes(study: &StudyDocument) -> Option<Figure> {
    let figure = Figure::new(
        "extremes",
        "Data-consistent extremes",
        "Smallest and largest value at each of the marked times among all systems within the misfit limit, each of another system.",
    );
    let panel = |e: &ExtremesRecord| extreme_panel(study, e);
    each(&study.extremes, figure.columns(2), panel)
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

pub fn predictions(study: &StudyDocument) -> Option<Figure> {
    let figure = Figure::new(
        "study-predictions",
        "Predicted responses",
        "Displacement with its 95 % confidence band, and the smallest and largest displacement of the extreme systems.",
    );
    each(&study.predictions, figure, prediction_panel)
}

fn prediction_panel(p: &PredictionRecord) -> Option<Panel> {
    let band = p.band.iter();
    let band = band.map(|ends| Mark::band_of("95 % band", &p.times, ends, Colour::Sky));
    let extremes = p.envelope.iter().flat_map(|ends| {
        let style = Style::new(Colour::Vermillion).dash(Dash::Dashed).width(1.0);
        sides(ends).map(|side| Mark::line("extremes", &p.times, &side, style))
    });
    let style = Style::new(Colour::Blue);
    let found = Mark::line("prediction", &p.times, &p.displacement, style);
    let panel = Panel::of_time("displacement y", "m").title(&p.name);
    let panel = panel.marks(band).marks(extremes).mark(found);
    (p.times.len() > 1).then_some(panel)
}
