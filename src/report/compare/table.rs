//! Table of a comparison: one row for each quantity, one cell for each run, for terminal, CSV and page.

use super::ROUNDING;
use super::likelihood::Likelihood;
use super::measures::Measures;
use crate::report::document::Prediction;
use kmcfit_core::internals::assessment::{Estimate, TruthErrors};

/// One quantity of all runs.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct QuantityRow {
    /// Label with its unit.
    pub label: String,
    /// Header in the CSV file, with its unit.
    pub header: String,
    /// One cell per run.
    pub cells: Vec<Cell>,
}

/// One quantity of one run.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Cell {
    /// A text.
    Text(String),
    /// A count.
    Count(u64),
    /// A number; `None` if it is not known.
    Number(Option<f64>),
}

impl Cell {
    /// The cell with four digits.
    pub fn short(&self) -> String {
        match self {
            Cell::Text(text) => text.clone(),
            Cell::Count(count) => count.to_string(),
            Cell::Number(None) => "–".into(),
            Cell::Number(Some(x)) => short(*x),
        }
    }

    /// The cell with all digits; empty if not known.
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

/// A number with four digits; with one if it is at the level of rounding errors.
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

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Cell::Text(text)
    }
}

impl From<u64> for Cell {
    fn from(count: u64) -> Self {
        Cell::Count(count)
    }
}

impl<N: Into<Option<f64>>> From<(N,)> for Cell {
    fn from((number,): (N,)) -> Self {
        Cell::Number(number.into())
    }
}

/// Builder of the rows.
struct RowBuilder<'a> {
    runs: &'a [Measures],
    rows: Vec<QuantityRow>,
}

impl<'a> RowBuilder<'a> {
    fn of(runs: &'a [Measures]) -> Self {
        let rows = Vec::new();
        Self { runs, rows }
    }

    /// A row of texts, of counts, or of numbers: `(x,)`.
    fn add<C: Into<Cell>>(&mut self, label: &str, header: &str, of: impl Fn(&Measures) -> C) {
        self.rows.push(QuantityRow {
            label: label.into(),
            header: header.into(),
            cells: self.runs.iter().map(|run| of(run).into()).collect(),
        });
    }

    /// A row of numbers with a unit, `unit[0]` in the label and `unit[1]` in the header.
    fn add_in<N: Into<Option<f64>>>(
        &mut self,
        unit: [&str; 2],
        label: &str,
        header: &str,
        of: impl Fn(&Measures) -> N,
    ) {
        let label = format!("{label} ({})", unit[0]);
        self.add(&label, &format!("{header}_{}", unit[1]), |m| (of(m),));
    }
}

/// The compared quantities; the rows of predictions depend on the runs.
fn rows(runs: &[Measures]) -> Vec<QuantityRow> {
    let units = TableUnits::of(runs);
    let metre = units.metre;
    let error = |of: fn(&TruthErrors) -> f64| move |m: &Measures| m.errors.as_ref().map(of);
    let mut t = RowBuilder::of(runs);
    t.add("status", "status", |m| m.status.name().to_owned());
    t.add("method", "method", |m| m.method.clone());
    t.add("nodes", "nodes", |m| m.nodes as u64);
    t.add("parameters", "parameters", |m| m.parameters as u64);
    t.add(&misfit_label(runs, metre), "misfit", |m| (m.misfit,));
    let worst = "worst fit of a channel (%)";
    t.add(worst, "worst_fit_percent", |m| (m.worst_fit,));
    let ratio = |m: &Measures| (m.has_ratio.then_some(m.cost_ratio),);
    t.add("J/J0", "cost_ratio", ratio);
    t.add("validation fit (%)", "validation_fit_percent", |m| {
        (m.validation_fit,)
    });
    let likelihood =
        |of: fn(&Likelihood) -> f64| move |m: &Measures| (m.likelihood.as_ref().map(of),);
    t.add(
        "log-likelihood",
        "log_likelihood",
        likelihood(|l| l.log_likelihood),
    );
    t.add("AICc", "aicc", likelihood(|l| l.aicc));
    t.add("BIC", "bic", likelihood(|l| l.bic));
    t.add("BIC - best", "bic_difference", |m| (m.bic_difference,));
    let hertz = ["Hz", "Hz"];
    let value = |e: &Option<Estimate>| e.as_ref().map(|e| e.value);
    let half = |e: &Option<Estimate>| e.as_ref()?.ci95.map(|[low, high]| 0.5 * (high - low));
    t.add_in(hertz, "f_n", "natural_frequency", |m| {
        value(&m.natural_frequency)
    });
    t.add_in(hertz, "  +- (95 %)", "natural_frequency_half_width", |m| {
        half(&m.natural_frequency)
    });
    t.add("zeta", "damping_ratio", |m| (value(&m.damping_ratio),));
    t.add("  +- (95 %)", "damping_ratio_half_width", |m| {
        (half(&m.damping_ratio),)
    });
    t.add("iterations", "iterations", |m| m.iterations);
    t.add_in(["s", "s"], "time", "seconds", |m| m.seconds);
    let (mass, damping, stiffness) = (units.mass, units.damping, units.stiffness);
    t.add_in(mass, "max error of m", "mass_error", error(|e| e.mass));
    t.add_in(damping, "  of c", "damping_error", error(|e| e.damping));
    t.add_in(
        stiffness,
        "  of k",
        "stiffness_error",
        error(|e| e.stiffness),
    );
    let per_s2 = ["1/s²", "per_s2"];
    t.add_in(per_s2, "  of k/m", "k_over_m_error", error(|e| e.k_over_m));
    let per_s = ["1/s", "per_s"];
    t.add_in(per_s, "  of c/m", "c_over_m_error", error(|e| e.c_over_m));
    t.add_in(mass, "smallest m", "mass_min", |m| m.smallest_mass);
    t.add_in(damping, "smallest c", "damping_min", |m| m.smallest_damping);
    let violation = "largest violation (relative)";
    t.add(violation, "max_violation", |m| (m.max_violation,));
    let [mass, damping, stiffness] = units.roughness;
    t.add_in(mass, "∫(m″)² dt", "mass_roughness", |m| {
        m.roughness.mass
    });
    t.add_in(damping, "∫(c′)² dt", "damping_roughness", |m| {
        m.roughness.damping
    });
    t.add_in(stiffness, "∫(k′)² dt", "stiffness_roughness", |m| {
        m.roughness.stiffness
    });
    for (i, (y, v)) in shared_states(runs).into_iter().enumerate() {
        let first = match i {
            0 => format!("cost ({metre}² s) from"),
            _ => "  from".into(),
        };
        t.add(
            &format!("{first} y = {y} {metre}, v = {v} {metre}/s"),
            &format!("cost_from_{y}_{metre}_{v}_{metre}_per_s_{metre}2_s"),
            |m| (find(m, (y, v)).and_then(|p| p.cost),),
        );
    }
    t.rows
}

/// The rows with a value for at least one run, for terminal and page.
pub(super) fn known_rows(runs: &[Measures]) -> Vec<QuantityRow> {
    let known = |row: &QuantityRow| row.cells.iter().any(|cell| *cell != Cell::Number(None));
    rows(runs).into_iter().filter(known).collect()
}

/// The rows of the CSV file, with names, titles, relative errors and the one-line summaries.
pub(super) fn csv_rows(runs: &[Measures]) -> Vec<QuantityRow> {
    let error = |of: fn(&TruthErrors) -> f64| move |m: &Measures| (m.errors.as_ref().map(of),);
    let mut all = RowBuilder::of(runs);
    all.add("", "name", |m| m.name.clone());
    all.add("", "title", |m| m.title.clone());
    for row in rows(runs) {
        let header = row.header.clone();
        all.rows.push(row);
        match header.as_str() {
            "misfit" => all.add("", "misfit_unit", |m| m.misfit_unit.to_owned()),
            "c_over_m_error_per_s" => {
                all.add(
                    "",
                    "k_over_m_relative_error",
                    error(|e| e.k_over_m_relative),
                );
                all.add(
                    "",
                    "c_over_m_relative_error",
                    error(|e| e.c_over_m_relative),
                );
            }
            _ => {}
        }
    }
    all.add("", "verdict", |m| m.verdict.clone());
    all.rows
}

/// Units of the rows in labels and headers; those of a rotation if all runs have angular displacements.
struct TableUnits {
    metre: &'static str,
    mass: [&'static str; 2],
    damping: [&'static str; 2],
    stiffness: [&'static str; 2],
    /// Of mass, damping and stiffness.
    roughness: [[&'static str; 2]; 3],
}

impl TableUnits {
    fn of(runs: &[Measures]) -> Self {
        match !runs.is_empty() && runs.iter().all(|run| run.is_rotation) {
            true => Self {
                metre: "rad",
                mass: ["kg m²", "kg_m2"],
                damping: ["N m s/rad", "N_m_s_per_rad"],
                stiffness: ["N m/rad", "N_m_per_rad"],
                roughness: [
                    ["kg² m⁴/s³", "kg2_m4_per_s3"],
                    ["N² m² s/rad²", "N2_m2_s_per_rad2"],
                    ["N² m²/(rad² s)", "N2_m2_per_rad2_s"],
                ],
            },
            false => Self {
                metre: "m",
                mass: ["kg", "kg"],
                damping: ["N s/m", "N_s_per_m"],
                stiffness: ["N/m", "N_per_m"],
                roughness: [
                    ["kg²/s³", "kg2_per_s3"],
                    ["N² s/m²", "N2_s_per_m2"],
                    ["N²/(m² s)", "N2_per_m2_s"],
                ],
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

/// Initial states (m, m/s) for which at least two runs have a cost; for a single run all its states.
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
    fn unknown_numbers_are_empty_fields() {
        assert_eq!(Cell::Number(None).exact(), "");
        assert_eq!(Cell::Number(Some(f64::INFINITY)).exact(), "");
        assert_eq!(Cell::Number(Some(1e-300)).exact(), "1e-300");
    }
}
