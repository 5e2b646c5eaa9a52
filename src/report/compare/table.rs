//! The table: one row per quantity, one cell per run; terminal, CSV and page show the same rows.

use super::ROUNDING;
use super::errors::Errors;
use super::measures::Measures;
use crate::report::document::Prediction;

/// One quantity of all runs.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Row {
    /// What it is, in words and with its unit.
    pub label: String,
    /// Header in the CSV file, with its unit.
    pub header: String,
    /// One cell per run.
    pub cells: Vec<Cell>,
}

/// One quantity of one run.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Cell {
    /// A word or a sentence.
    Text(String),
    /// A count.
    Count(u64),
    /// A measured number; not known where `None`.
    Number(Option<f64>),
}

impl Cell {
    /// For people: four digits.
    pub fn short(&self) -> String {
        match self {
            Cell::Text(text) => text.clone(),
            Cell::Count(count) => count.to_string(),
            Cell::Number(None) => "–".into(),
            Cell::Number(Some(x)) => short(*x),
        }
    }

    /// For programs: all digits; empty where not known.
    pub fn exact(&self) -> String {
        match self {
            Cell::Text(text) => text.clone(),
            Cell::Count(count) => count.to_string(),
            Cell::Number(Some(x)) if x.is_finite() => match x.abs() {
                0.0 => "0".into(),
                size if (1e-5..1e15).contains(&size) => x.to_string(),
                _ => format!("{x:e}"),
            },
            Cell::Number(_) => String::new(),
        }
    }
}

/// A number with four digits; with one where it is rounding.
pub(super) fn short(x: f64) -> String {
    if x != 0.0 && x.abs() < ROUNDING {
        return format!("{x:.0e}");
    }
    let rounded = format!("{x:.3e}");
    let exponent = rounded.split_once('e').and_then(|(_, e)| e.parse().ok());
    match exponent {
        _ if x == 0.0 => "0".into(),
        Some(order @ -3..5) => format!("{x:.*}", (3 - order).max(0) as usize),
        _ => rounded,
    }
}

/// The quantities that are compared; the same ones for any runs, but for the initial states.
fn rows(runs: &[Measures]) -> Vec<Row> {
    let text = |label: &str, header: &str, of: fn(&Measures) -> String| {
        row(runs, label, header, |m| Cell::Text(of(m)))
    };
    let count = |label: &str, header: &str, of: fn(&Measures) -> u64| {
        row(runs, label, header, |m| Cell::Count(of(m)))
    };
    let number = |label: &str, header: &str, of: fn(&Measures) -> Option<f64>| {
        row(runs, label, header, |m| Cell::Number(of(m)))
    };
    let error = |label: &str, header: &str, of: fn(&Errors) -> f64| {
        row(runs, label, header, |m| {
            Cell::Number(m.errors.as_ref().map(of))
        })
    };
    let units = Units::of(runs);
    let Units {
        mass,
        damping,
        stiffness,
        metre,
        ..
    } = units;
    let of = |what: &str, unit: [&str; 2]| format!("{what} ({})", unit[0]);
    let under = |what: &str, unit: [&str; 2]| format!("{what}_{}", unit[1]);
    let mut rows = vec![
        text("status", "status", |m| m.status.clone()),
        text("method", "method", |m| m.method.clone()),
        count("nodes", "nodes", |m| m.nodes as u64),
        count("free values", "parameters", |m| m.parameters as u64),
        number(&misfit_label(runs, metre), "misfit", |m| Some(m.misfit)),
        number("worst fit of a channel (%)", "worst_fit_percent", |m| {
            m.worst_fit
        }),
        number("J/J0", "cost_ratio", |m| {
            m.has_ratio.then_some(m.cost_ratio)
        }),
        count("iterations", "iterations", |m| m.iterations),
        number("time (s)", "seconds_s", |m| Some(m.seconds)),
        error(
            &of("largest error of m", mass),
            &under("mass_error", mass),
            |e| e.mass,
        ),
        error(
            &of("  of c", damping),
            &under("damping_error", damping),
            |e| e.damping,
        ),
        error(
            &of("  of k", stiffness),
            &under("stiffness_error", stiffness),
            |e| e.stiffness,
        ),
        error("  of k/m (1/s²)", "k_over_m_error_per_s2", |e| e.k_over_m),
        error("  of c/m (1/s)", "c_over_m_error_per_s", |e| e.c_over_m),
        number(&of("smallest m", mass), &under("mass_min", mass), |m| {
            Some(m.smallest_mass)
        }),
        number(
            &of("smallest c", damping),
            &under("damping_min", damping),
            |m| Some(m.smallest_damping),
        ),
        number("largest violation (relative)", "max_violation", |m| {
            m.max_violation
        }),
        number(
            &of("∫(m″)² dt", units.mass_roughness),
            &under("mass_roughness", units.mass_roughness),
            |m| Some(m.roughness.mass),
        ),
        number(
            &of("∫(c′)² dt", units.damping_roughness),
            &under("damping_roughness", units.damping_roughness),
            |m| Some(m.roughness.damping),
        ),
        number(
            &of("∫(k′)² dt", units.stiffness_roughness),
            &under("stiffness_roughness", units.stiffness_roughness),
            |m| Some(m.roughness.stiffness),
        ),
    ];
    for (i, (y, v)) in shared_states(runs).into_iter().enumerate() {
        let first = match i {
            0 => format!("cost ({metre}² s) from"),
            _ => "  from".into(),
        };
        rows.push(row(
            runs,
            &format!("{first} y = {y} {metre}, v = {v} {metre}/s"),
            &format!("cost_from_{y}_{metre}_{v}_{metre}_per_s_{metre}2_s"),
            |m| Cell::Number(find(m, (y, v)).and_then(|p| p.cost)),
        ));
    }
    rows
}

/// The quantities that at least one run knows: those that people are shown.
pub(super) fn known_rows(runs: &[Measures]) -> Vec<Row> {
    let known = |row: &Row| row.cells.iter().any(|cell| *cell != Cell::Number(None));
    rows(runs).into_iter().filter(known).collect()
}

/// The rows of the CSV file: what the page and the terminal say elsewhere comes with it.
pub(super) fn csv_rows(runs: &[Measures]) -> Vec<Row> {
    let text =
        |header: &str, of: fn(&Measures) -> String| row(runs, "", header, |m| Cell::Text(of(m)));
    let error = |header: &str, of: fn(&Errors) -> f64| {
        row(runs, "", header, |m| {
            Cell::Number(m.errors.as_ref().map(of))
        })
    };
    let mut all = vec![
        text("name", |m| m.name.clone()),
        text("title", |m| m.title.clone()),
    ];
    for row in rows(runs) {
        let header = row.header.clone();
        all.push(row);
        match header.as_str() {
            "misfit" => all.push(text("misfit_unit", |m| m.misfit_unit.into())),
            "c_over_m_error_per_s" => {
                all.push(error("k_over_m_relative_error", |e| e.k_over_m_relative));
                all.push(error("c_over_m_relative_error", |e| e.c_over_m_relative));
            }
            _ => {}
        }
    }
    all.push(text("verdict", |m| m.verdict.clone()));
    all
}

fn row(runs: &[Measures], label: &str, header: &str, of: impl Fn(&Measures) -> Cell) -> Row {
    Row {
        label: label.into(),
        header: header.into(),
        cells: runs.iter().map(of).collect(),
    }
}

/// The units of the rows, as people and as headers have them: those of rotations where all runs are.
struct Units {
    metre: &'static str,
    mass: [&'static str; 2],
    damping: [&'static str; 2],
    stiffness: [&'static str; 2],
    mass_roughness: [&'static str; 2],
    damping_roughness: [&'static str; 2],
    stiffness_roughness: [&'static str; 2],
}

impl Units {
    fn of(runs: &[Measures]) -> Self {
        match !runs.is_empty() && runs.iter().all(|run| run.is_rotation) {
            true => Self {
                metre: "rad",
                mass: ["kg m²", "kg_m2"],
                damping: ["N m s/rad", "N_m_s_per_rad"],
                stiffness: ["N m/rad", "N_m_per_rad"],
                mass_roughness: ["kg² m⁴/s³", "kg2_m4_per_s3"],
                damping_roughness: ["N² m² s/rad²", "N2_m2_s_per_rad2"],
                stiffness_roughness: ["N² m²/(rad² s)", "N2_m2_per_rad2_s"],
            },
            false => Self {
                metre: "m",
                mass: ["kg", "kg"],
                damping: ["N s/m", "N_s_per_m"],
                stiffness: ["N/m", "N_per_m"],
                mass_roughness: ["kg²/s³", "kg2_per_s3"],
                damping_roughness: ["N² s/m²", "N2_s_per_m2"],
                stiffness_roughness: ["N²/(m² s)", "N2_per_m2_s"],
            },
        }
    }
}

fn misfit_label(runs: &[Measures], metre: &str) -> String {
    let chi_square = |m: &Measures| m.misfit_unit == "1";
    match (runs.iter().any(chi_square), runs.iter().all(chi_square)) {
        (_, true) => "misfit (chi-square)".into(),
        (false, _) => format!("misfit ({metre}² s)"),
        _ => format!("misfit ({metre}² s or chi-square)"),
    }
}

fn find(run: &Measures, state: (f64, f64)) -> Option<&Prediction> {
    let same = |p: &&Prediction| (p.displacement, p.velocity) == state;
    run.predictions.iter().find(same)
}

/// The initial states (m, m/s) from which at least two runs know the cost; of a single run, all.
fn shared_states(runs: &[Measures]) -> Vec<(f64, f64)> {
    let needed = runs.len().min(2);
    let mut states: Vec<(f64, f64)> = Vec::new();
    for prediction in runs.iter().flat_map(|m| &m.predictions) {
        let state = (prediction.displacement, prediction.velocity);
        let known = |m: &&Measures| find(m, state).is_some_and(|p| p.cost.is_some());
        if !states.contains(&state) && runs.iter().filter(known).count() >= needed {
            states.push(state);
        }
    }
    states
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits() {
        let shown = [
            0.0,
            0.995,
            0.099_999_99,
            139.8269,
            8.130155e-5,
            -0.0992,
            123_456.0,
            1e-3,
            -2.22e-15,
        ];
        let texts = shown.map(short);
        let expected = [
            "0", "0.9950", "0.1000", "139.8", "8.130e-5", "-0.09920", "1.235e5", "0.001000",
            "-2e-15",
        ];
        assert_eq!(texts, expected);
    }

    #[test]
    fn what_is_not_known_is_empty_in_a_file() {
        assert_eq!(Cell::Number(None).exact(), "");
        assert_eq!(Cell::Number(Some(f64::INFINITY)).exact(), "");
        assert_eq!(Cell::Number(Some(1e-300)).exact(), "1e-300");
    }
}
