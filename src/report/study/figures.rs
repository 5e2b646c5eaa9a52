//! The figures of a study.

use super::{BandRecord, BandsPiece, DirectionRecord, EquivalentRecord, Numbers, StudyDocument};
use crate::report::chart::{Axis, Colour, Dash, Figure, Mark, Panel, Style};
use crate::report::figures::truth;

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

/// All that the study has something for.
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
    let panels = bands.bands.iter().map(|band| band_panel(band, bands));
    Some(figure.columns(2).panels(panels))
}

/// The area between the ends of a band; where it has none it is not drawn: its note says so.
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

fn band_panel(band: &BandRecord, all: &BandsPiece) -> Panel {
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
        .marks(area(times, whole, "at all times at once", Colour::Grey))
        .marks(area(times, each, "at each time", Colour::Sky))
        .mark(Mark::line(
            "found",
            times,
            &values,
            Style::new(Colour::Blue).width(1.6),
        ))
        .marks((!real.is_empty()).then(|| truth(times, &real)))
        .marks((!anchors.is_empty()).then(|| {
            let style = Style::new(Colour::Black).width(4.0);
            Mark::points("fixed by the data", anchors, &anchored, style)
        }))
}

/// Numbers from 1.
fn ranks(count: usize) -> Vec<f64> {
    (1..=count).map(|i| i as f64).collect()
}

fn spectrum(study: &StudyDocument) -> Option<Figure> {
    let spectrum = study.spectrum.as_ref()?;
    let values = &spectrum.singular_values;
    let largest = values.first().copied().filter(|s| *s > 0.0)?;
    let relative: Vec<f64> = values.iter().map(|s| (s / largest).max(1e-20)).collect();
    let dashed = Style::new(Colour::Vermillion).dash(Dash::Dashed);
    let rank = spectrum.rank as f64;
    let panel = Panel::new(
        Axis::linear("direction, best first", ""),
        Axis::log("singular value relative to the largest", ""),
    )
    .marks([
        Mark::line(
            "",
            &ranks(values.len()),
            &relative,
            Style::new(Colour::Blue),
        ),
        Mark::vertical("last direction that is seen", rank, dashed),
    ]);
    let sentence = spectrum.sentence.as_str();
    Some(Figure::new("spectrum", "What the readings see", sentence).panel(panel))
}

fn directions(study: &StudyDocument) -> Vec<Figure> {
    let Some(spectrum) = &study.spectrum else {
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
            format!("The directions that are seen {name}"),
            "Changes of the functions against time, one panel for each function.",
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
        "Profiles",
        "The least cost with one number held, above the optimum's, against that number.",
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
            .marks((p.marks.iter()).map(|(x, _)| Mark::vertical("another bound", *x, dotted)))
    })
}

fn tubes(study: &StudyDocument) -> Option<Figure> {
    let figure = Figure::new(
        "tubes",
        "The widest tubes",
        "Smallest and largest values among all devices that fit as well as stated, at chosen times.",
    );
    let dots = |colour| Style::new(colour).width(4.0);
    each(&study.tubes, figure.columns(2), |tube| {
        let (t, low, high) = (&tube.times, &tube.low, &tube.high);
        Panel::of_time(&tube.name, &tube.unit).marks([
            Mark::band("", t, low, high, Colour::Sky),
            Mark::points("smallest", t, low, dots(Colour::Blue)),
            Mark::points("largest", t, high, dots(Colour::Vermillion)),
        ])
    })
}

fn equivalents(study: &StudyDocument) -> Option<Figure> {
    let figure = Figure::new(
        "equivalents",
        "Several devices, same motion",
        "Mass, damping and stiffness of devices that all move like the fit.",
    );
    type Pick = fn(&EquivalentRecord) -> &Vec<f64>;
    let parts: [(&str, &str, Pick); 3] = [
        ("mass m", "kg", |e| &e.mass),
        ("damping c", "N s/m", |e| &e.damping),
        ("stiffness k", "N/m", |e| &e.stiffness),
    ];
    let panels = parts.into_iter().map(|(label, unit, pick)| {
        let devices = study.equivalents.iter().enumerate();
        Panel::of_time(label, unit)
            .marks(devices.map(|(k, e)| Mark::line(&e.name, &e.times, pick(e), Style::nth(k))))
    });
    (!study.equivalents.is_empty()).then(|| figure.panels(panels))
}

fn waterfall(study: &StudyDocument) -> Option<Figure> {
    let multistart = study.multistart.as_ref()?;
    let costs: Vec<f64> = multistart.costs.iter().map(|c| c.max(1e-300)).collect();
    let dots = Style::new(Colour::Blue).width(4.0);
    let panel = Panel::new(Axis::linear("fit, best first", ""), Axis::log("cost J", ""));
    let panel = panel.mark(Mark::points("", &ranks(costs.len()), &costs, dots));
    let figure = Figure::new(
        "waterfall",
        "Fits from many starts",
        "Costs of all fits in rising order: steps are optima.",
    );
    (!costs.is_empty()).then(|| figure.panel(panel))
}

fn predictions(study: &StudyDocument) -> Option<Figure> {
    let figure = Figure::new(
        "study-predictions",
        "Motions from elsewhere",
        "The displacement of the fitted device, with its band, and the envelope over the extreme devices.",
    );
    each(&study.predictions, figure, |p| {
        let area = |ends: &Option<Vec<[f64; 2]>>, label: &str, colour| {
            let ends = ends.iter().flatten().map(|[low, high]| (*low, *high));
            let (low, high): (Vec<f64>, Vec<f64>) = ends.unzip();
            Mark::band(label, &p.times, &low, &high, colour)
        };
        let worst = p
            .worst
            .is_some()
            .then(|| area(&p.worst, "worst case", Colour::Orange));
        let band = p.band.is_some().then(|| area(&p.band, "band", Colour::Sky));
        let found = Mark::line("found", &p.times, &p.displacement, Style::new(Colour::Blue));
        Panel::of_time("displacement y", "m")
            .title(&p.name)
            .marks(worst.into_iter().chain(band).chain([found]))
    })
}
