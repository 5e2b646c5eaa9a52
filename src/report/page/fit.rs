//! The page of a fit, `report.html`: first screen, contents, and the sections from the fit to the search.

use super::checks::checks;
use super::first_screen::first_screen;
use super::table::{list, number, paragraph, table};
use super::validation::validation;
use super::{Section, figures, overview, reproducibility, sectioned};
use crate::report::FittedModel;
use crate::report::chart::Figure;
use crate::report::document::ResultDocument;
use crate::report::equation::equation_residual;
use crate::report::figures::weight_path;
use crate::report::summary;
use crate::units::{self, Unit};
use kmcfit_core::finding::Finding;
use kmcfit_core::identifiability::Quantity;
use kmcfit_core::number_format::significant;

/// The page of a run.
pub(in crate::report) fn page(run: &FittedModel, document: &ResultDocument) -> String {
    let drawn = run.drawn();
    let sections: Vec<Section> = vec![
        ("fit", "Fit and residuals", fit_and_residuals(run, document)),
        ("functions", "Coefficients", coefficients(run, document)),
        ("input", "Input", figures(&drawn.inputs)),
        ("spectra", "Spectra", figures(&drawn.spectra)),
        ("tests", "Residual tests", figures(&drawn.tests)),
        ("checks", "Checks of step and terms", checks(document)),
        ("validation", "Validation", validation(run, document)),
        (
            "identifiability",
            "Identifiability",
            identifiability(run, document),
        ),
        ("constraints", "Constraints", constraints(run, document)),
        (
            "predictions",
            "Predicted free responses",
            predictions(document),
        ),
        ("data", "Data", data(document)),
        (
            "repeat",
            "Reproduce",
            reproducibility::reproducibility(run, document),
        ),
        ("solver", "Search", search(run, document)),
    ];
    sectioned(&document.title, &first_screen(run, document), sections)
}

/// Fit of each channel, key figures, and figures of records and residuals.
fn fit_and_residuals(run: &FittedModel, document: &ResultDocument) -> String {
    let mut drawn = run.channel_fits();
    // With constants the first screen has the samples.
    let main = run.main_figure(document);
    drawn.retain(|figure| (main.as_ref()).is_none_or(|main| main.title != figure.title));
    let equation = document.equation.iter();
    let equation =
        equation.map(|b| equation_residual(b, document.is_rotation(), document.model.mass_unknown));
    overview::records(document) + &list(&equation.collect::<Vec<_>>()) + &figures(&drawn)
}

/// Table of all coefficients, and figures of those that vary.
fn coefficients(run: &FittedModel, document: &ResultDocument) -> String {
    let drawn = run.drawn();
    let mut ratios = drawn.ratios.clone();
    // Ratios to a damping of zero to machine precision are rounding errors.
    if document
        .functions
        .get("damping")
        .is_some_and(|f| f.negligible)
    {
        let of_damping = ["c/m", "damping ratio ζ"];
        let panels = &mut ratios.panels;
        panels.retain(|panel| !of_damping.contains(&panel.y.label.as_str()));
    }
    let both = [drawn.functions.clone(), ratios].into_iter();
    // The start may be far from the estimate.
    let without_start = |mut figure: Figure| {
        for panel in &mut figure.panels {
            panel.marks.retain(|mark| mark.label != "start");
        }
        figure.varying()
    };
    let varying: Vec<Figure> = both.filter_map(without_start).collect();
    overview::functions(document) + &overview::ratios_of_records(run) + &figures(&varying)
}

/// Findings in the data and what was done with them, warnings, and automatic choices.
fn data(document: &ResultDocument) -> String {
    let lists = [
        ("Findings", &document.data),
        ("Warnings", &document.warnings),
        ("Automatic choices", &document.automatic),
    ];
    let lists = lists.iter().filter(|(_, findings)| !findings.is_empty());
    let lists = lists.map(|(heading, findings)| {
        format!("<h3>{heading}</h3>\n{}", list(&Finding::texts(findings)))
    });
    lists.collect()
}

/// End and convergence of the search, folded, and the cost that it minimises.
fn search(run: &FittedModel, document: &ResultDocument) -> String {
    let mut drawn: Vec<Figure> = run.weights.map(weight_path).into_iter().collect();
    // One iteration is no curve.
    if run.fit.history.len() > 1 {
        drawn.push(run.convergence());
    }
    for ((i, channel), of_channel) in run.channels().into_iter().zip(&run.drawn().channels) {
        let response = of_channel.response.as_ref().filter(|_| channel == 0);
        let response = response.filter(|_| !run.fit.snapshots.is_empty());
        drawn.extend(response.map(|figure| run.titled(figure.clone(), i, 0)));
    }
    let end =
        overview::state(document) + &paragraph(&format!("J: {}", document.model.cost_definition));
    let attempts = list(&summary::attempts(document));
    format!(
        "<details>\n<summary>End and convergence of the search</summary>\n{end}{attempts}{}</details>\n",
        figures(&drawn)
    )
}

fn constraints(run: &FittedModel, document: &ResultDocument) -> String {
    let problem = &run.model.problem;
    let asked =
        problem.constraints.groups.len() + problem.constraints.cones.len() + problem.soft.len();
    let worst = document.constraints.max_violation;
    let said = summary::constraints(document);
    let hold = match (asked, worst) {
        (0, _) => "The model has no constraints.".to_string(),
        (_, 0.0) => "All constraints are satisfied.".to_string(),
        _ => {
            format!("Largest constraint violation: {worst:.1e}, relative to the scale of its row.")
        }
    };
    let active = match (asked, document.constraints.active.is_empty()) {
        (1.., true) => paragraph("No constraint is active."),
        _ => String::new(),
    };
    paragraph(&hold) + &active + &list(&said)
}

/// Findings, assumptions, nuisance parameters, notes on the bands, and the command of a study.
fn identifiability(run: &FittedModel, document: &ResultDocument) -> String {
    let known = &document.identifiability;
    let notes: Vec<String> = document.notes().map(Finding::to_string).collect();
    let warnings = document.other_warnings(document.fit_warnings());
    let mut text = list(&notes) + &list(&warnings);
    text += &match known.assumptions.as_slice() {
        [] => String::new(),
        list => paragraph(&format!("Assumptions: {}.", list.join("; "))),
    };
    text += &list(&summary::nuisance_parameters(&in_shown_units(document)));
    if let Some(bands) = run.bands() {
        let notes = bands.functions.iter().chain(&bands.ratios);
        let notes = notes.flat_map(|b| b.notes.iter().map(|n| format!("{}: {n}", b.name)));
        text += &list(&bands.notes.iter().cloned().chain(notes).collect::<Vec<_>>());
    }
    if run.is_simulated() && document.model.parameters > 0 {
        text += &paragraph(
            "Likelihood profiles, equivalent systems and the most informative next experiment:",
        );
        text += &reproducibility::command("study", document);
    }
    text
}

/// The predictions: with a known true system their error, else the size of the response.
fn predictions(document: &ResultDocument) -> String {
    let all = &document.predictions;
    let m = if document.is_rotation() { "rad" } else { "m" };
    let has_truth = all.iter().any(|p| p.cost.is_some() || p.energy.is_some());
    let headings = match has_truth {
        true => [
            "initial state".to_owned(),
            format!("integral of the squared error ({m}² s)"),
            format!("integral of the squared true response ({m}² s)"),
        ],
        false => [
            "initial state".to_owned(),
            format!("largest |y| ({m})"),
            format!("y at the end ({m})"),
        ],
    };
    let state = |y: f64, v: f64| {
        let [y, v] = [y, v].map(|x| significant(x, 6).replace('-', "−"));
        format!("y = {y} {m}, v = {v} {m}/s")
    };
    let rows = all.iter().map(|p| {
        let numbers = match has_truth {
            true => [p.cost, p.energy],
            false => [p.largest, p.last],
        };
        let [one, other] = numbers.map(|x| x.map_or_else(|| "unknown".to_owned(), number));
        vec![state(p.displacement, p.velocity), one, other]
    });
    let rows: Vec<Vec<String>> = rows.collect();
    let failures = all.iter().filter_map(|p| {
        let failure = p.failure.as_ref()?;
        let state = state(p.displacement, p.velocity);
        Some(format!("{state}: no response: {failure}"))
    });
    let headings = headings.each_ref().map(String::as_str);
    table("Predicted free responses", &headings, &rows) + &list(&failures.collect::<Vec<_>>())
}

/// The nuisance parameters in the units of the channels of their quantity, where these have one unit.
fn in_shown_units(document: &ResultDocument) -> Vec<Quantity> {
    let unit_of = |kind: &str| {
        let mut units = document
            .channels()
            .filter(|c| c.kind == kind)
            .map(|c| &c.unit);
        let first = units.next()?;
        units.all(|unit| unit == first).then(|| first.clone())
    };
    let displacement = unit_of("displacement");
    let velocity = unit_of("velocity").or(displacement.as_ref().map(|unit| format!("{unit}/s")));
    let shown = |parameter: &Quantity| {
        let (quantity, unit) = match parameter.unit.as_str() {
            "m" | "rad" => (units::Measurand::Displacement, displacement.as_ref()?),
            "m/s" | "rad/s" => (units::Measurand::Velocity, velocity.as_ref()?),
            _ => return None,
        };
        Unit::recognise(quantity, unit).filter(|unit| !unit.is_arbitrary())
    };
    let each = document.nuisance_parameters.iter();
    each.map(|parameter| match shown(parameter) {
        None => parameter.clone(),
        Some(unit) => Quantity {
            unit: unit.symbol().to_owned(),
            value: parameter.value / unit.factor(),
            standard_error: parameter.standard_error / unit.factor(),
            ..parameter.clone()
        },
    })
    .collect()
}
