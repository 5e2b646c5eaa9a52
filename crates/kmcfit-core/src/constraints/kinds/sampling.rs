//! Times at which a constraint is imposed so that it holds at all times, and the affine forms at these times.

use super::All;
use super::linear_form::LinearForm;
use crate::functions::Basis;
use crate::rows::Rows;
use crate::system::Grid;

/// Largest distance of equal times, relative to the record; the same as in the bases.
const SAME_TIME: f64 = 1e-12;
/// Largest deviation of collinear values, relative to their size.
const STRAIGHT: f64 = 1e-13;

/// `factor * d^derivative p / dt^derivative` of one function.
#[derive(Debug, Clone, Copy)]
pub(super) struct DerivativeTerm {
    pub function: usize,
    pub derivative: usize,
    pub factor: f64,
}

/// Value of a function.
pub(super) fn value(function: usize, factor: f64) -> DerivativeTerm {
    DerivativeTerm {
        function,
        derivative: 0,
        factor,
    }
}

/// Slope of a function.
pub(super) fn slope(function: usize, factor: f64) -> DerivativeTerm {
    DerivativeTerm {
        function,
        derivative: 1,
        factor,
    }
}

/// Intervals on which a derivative of a function is linear.
enum Pieces {
    /// Between these times, at which it may jump.
    Linear { times: Vec<f64>, jumps: bool },
    /// None: the derivative is constrained at every node.
    Smooth,
}

/// One end of an interval: times for the evaluation of continuous parts and of parts that jump.
#[derive(Debug, Clone, Copy)]
struct FormSample {
    time: f64,
    inside: f64,
    span: [f64; 2],
}

impl All<'_> {
    fn pieces(&self, part: DerivativeTerm) -> Pieces {
        let function = self.list[part.function];
        let grid = self.grid;
        let linear = |times, jumps| Pieces::Linear { times, jumps };
        match &function.basis {
            None => {
                let times = self.breaks(&function.offset);
                let jumps = part.derivative > 0 && times.len() > 2;
                linear(times, jumps)
            }
            Some(basis @ (Basis::Nodal | Basis::PiecewiseLinear { .. })) => {
                linear(basis.knot_times(grid), part.derivative > 0)
            }
            Some(basis @ Basis::PiecewiseConstant { .. }) => linear(basis.knot_times(grid), true),
            Some(Basis::Constant) => linear(self.ends().to_vec(), false),
            Some(Basis::Polynomial { degree }) if *degree <= part.derivative + 1 => {
                linear(self.ends().to_vec(), false)
            }
            Some(basis @ Basis::BSpline { .. }) if part.derivative >= 2 => {
                linear(basis.knot_times(grid), false)
            }
            Some(Basis::Polynomial { .. } | Basis::BSpline { .. }) => Pieces::Smooth,
        }
    }

    /// Times between which nodal values are collinear: the ends, or all nodes.
    pub fn breaks(&self, nodal: &[f64]) -> Vec<f64> {
        let last = nodal.len() - 1;
        let size = nodal.iter().fold(0.0f64, |most, p| most.max(p.abs()));
        let off = |(i, p): (usize, &f64)| {
            let share = i as f64 / last as f64;
            let line = nodal[0] * (1.0 - share) + nodal[last] * share;
            (p - line).abs() > STRAIGHT * size
        };
        match nodal.iter().enumerate().any(off) {
            true => self.grid.times(),
            false => self.ends().to_vec(),
        }
    }

    /// Sum of `parts` at the ends of all intervals, which determine it everywhere; `also` are kinks of the bound.
    pub fn sum(&self, parts: &[DerivativeTerm], also: &[f64]) -> Vec<LinearForm> {
        let pieces: Vec<Pieces> = parts.iter().map(|part| self.pieces(*part)).collect();
        let samples = self.samples(&pieces, also);
        let mut sums: Vec<LinearForm> = samples.iter().map(LinearForm::at).collect();
        for (part, pieces) in parts.iter().zip(&pieces) {
            let jumps = matches!(pieces, Pieces::Linear { jumps: true, .. });
            let times: Vec<f64> = (samples.iter())
                .map(|s| if jumps { s.inside } else { s.time })
                .collect();
            let forms = self.forms(part.function, part.derivative, &times);
            for (sum, form) in sums.iter_mut().zip(&forms) {
                sum.add(part.factor, form);
            }
        }
        sums
    }

    /// Each of `parts` at the same times.
    pub fn each(&self, parts: &[DerivativeTerm]) -> Vec<Vec<LinearForm>> {
        let pieces: Vec<Pieces> = parts.iter().map(|part| self.pieces(*part)).collect();
        let samples = self.samples(&pieces, &[]);
        let one = |(part, pieces): (&DerivativeTerm, &Pieces)| {
            let jumps = matches!(pieces, Pieces::Linear { jumps: true, .. });
            let times: Vec<f64> = (samples.iter())
                .map(|s| if jumps { s.inside } else { s.time })
                .collect();
            let mut forms: Vec<LinearForm> = samples.iter().map(LinearForm::at).collect();
            let read = self.forms(part.function, part.derivative, &times);
            for (form, read) in forms.iter_mut().zip(&read) {
                form.add(part.factor, read);
            }
            forms
        };
        parts.iter().zip(&pieces).map(one).collect()
    }

    fn samples(&self, pieces: &[Pieces], also: &[f64]) -> Vec<FormSample> {
        let mut times = also.to_vec();
        let mut any_jumps = false;
        for pieces in pieces {
            match pieces {
                Pieces::Linear { times: own, jumps } => {
                    times.extend(own);
                    any_jumps |= jumps;
                }
                Pieces::Smooth => times.extend(self.grid.times()),
            }
        }
        times.sort_by(f64::total_cmp);
        let slack = SAME_TIME * self.grid.duration();
        times.dedup_by(|later, earlier| *later - *earlier <= slack);
        if !any_jumps {
            let at = |t: &f64| FormSample {
                time: *t,
                inside: *t,
                span: [*t, *t],
            };
            return times.iter().map(at).collect();
        }
        let ends = |cell: &[f64]| {
            let span = [cell[0], cell[1]];
            let inside = 0.5 * (cell[0] + cell[1]);
            span.map(|time| FormSample { time, inside, span })
        };
        times.windows(2).flat_map(ends).collect()
    }

    /// Derivative of a function at `times` (s).
    pub fn forms(&self, j: usize, derivative: usize, times: &[f64]) -> Vec<LinearForm> {
        let function = self.list[j];
        let first = self.functions.ranges()[j].start;
        let rows = function.basis.as_ref();
        let rows = rows.map(|basis| basis.rows(self.grid, times, derivative));
        let form = |(i, t): (usize, &f64)| LinearForm {
            entries: rows.as_ref().map_or(Vec::new(), |m| entries(m, i, first)),
            constant: match function.offset.as_slice() {
                [] => 0.0,
                offset => nodal(self.grid, offset, derivative, *t),
            },
            time: *t,
            span: [*t, *t],
        };
        times.iter().enumerate().map(form).collect()
    }

    /// Rows of a matrix in the parameters of function `j`, one form for each of `times` (s).
    pub fn matrix_forms(&self, j: usize, rows: &Rows, times: &[f64]) -> Vec<LinearForm> {
        let first = self.functions.ranges()[j].start;
        let form = |(i, t): (usize, &f64)| LinearForm {
            entries: entries(rows, i, first),
            constant: 0.0,
            time: *t,
            span: [*t, *t],
        };
        times.iter().enumerate().map(form).collect()
    }
}

impl LinearForm {
    /// Zero form at a sample.
    fn at(sample: &FormSample) -> Self {
        Self {
            entries: Vec::new(),
            constant: 0.0,
            time: sample.time,
            span: sample.span,
        }
    }
}

fn entries(rows: &Rows, i: usize, first: usize) -> Vec<(usize, f64)> {
    rows.row(i).map(|(j, a)| (first + j, a)).collect()
}

/// Derivative of the piecewise linear function with these nodal values.
pub(super) fn nodal(grid: &Grid, values: &[f64], derivative: usize, t: f64) -> f64 {
    let x = (t - grid.start()) / grid.step();
    // A time that differs from a node by rounding is that node.
    let near = x.round();
    let x = match (x - near).abs() <= SAME_TIME * values.len() as f64 {
        true => near,
        false => x,
    };
    let cell = (x.max(0.0) as usize).min(values.len() - 2);
    let share = (x - cell as f64).clamp(0.0, 1.0);
    match derivative {
        0 if share == 0.0 => values[cell],
        0 => values[cell] * (1.0 - share) + values[cell + 1] * share,
        1 => (values[cell + 1] - values[cell]) / grid.step(),
        _ => 0.0,
    }
}
