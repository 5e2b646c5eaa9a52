//! Reconstruction of the response of one system from eight of its states.

use super::part;
use super::rows::{Steps, Values};
use crate::simd::{self, Arithmetic, Eight, Kernel, LANES, Row, window};
use crate::simulate::Trajectory;
use crate::system::{NodalCoefficients, State};

/// Computes the response of the system from displacements and velocities at the starts of its eight parts.
///
/// Returns true if it is bit-identical with sequential integration from `initial`: the first part starts there, and each
/// part ends in the initial state of the next. Otherwise the contents of `trajectory` are undefined.
pub(crate) fn reconstruct(
    nodal: &NodalCoefficients,
    initial: State,
    states: [Row; 2],
    step: f64,
    trajectory: &mut Trajectory,
) -> bool {
    if [states[0][0], states[1][0]] != [initial.displacement, initial.velocity] {
        return false;
    }
    let nodes = trajectory.nodes();
    let ends = simd::run(PartsReplay {
        functions: [&nodal.mass, &nodal.coefficients[0], &nodal.coefficients[1]],
        states,
        step,
        response: [&mut trajectory.displacement, &mut trajectory.velocity],
    });
    let parts = nodes.div_ceil(part(nodes));
    let joins = |ends: &Row, begins: &Row| ends[..parts - 1] == begins[1..parts];
    joins(&ends[0], &states[0]) && joins(&ends[1], &states[1])
}

/// Integration of the eight parts from their initial states, one per lane; returns their final states.
struct PartsReplay<'a> {
    /// Mass, damping, stiffness at the nodes.
    functions: [&'a [f64]; 3],
    /// Displacements and velocities at the starts of the parts.
    states: [Row; 2],
    step: f64,
    response: [&'a mut [f64]; 2],
}

impl Kernel for PartsReplay<'_> {
    type Output = [Row; 2];

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> [Row; 2] {
        let PartsReplay {
            functions,
            states,
            step,
            response,
        } = self;
        let nodes = functions[0].len();
        let part = part(nodes);
        let steps = Steps::of(arithmetic, step);
        let mut state = [
            Eight::load(arithmetic, &states[0]),
            Eight::load(arithmetic, &states[1]),
        ];
        let mut left = Values([state[0]; 3]);
        for (value, f) in left.0.iter_mut().zip(functions) {
            let mut row = [0.0; LANES];
            for (lane, x) in row.iter_mut().enumerate() {
                *x = f[(lane * part).min(nodes - 1)];
            }
            *value = Eight::load(arithmetic, &row);
        }
        let mut ends = [[0.0; LANES]; 2];
        for first in (0..=part).step_by(LANES) {
            let mut ahead = [[[0.0; LANES]; LANES]; 3];
            for (ahead, f) in ahead.iter_mut().zip(functions) {
                let mut rows = [[0.0; LANES]; LANES];
                for (lane, row) in rows.iter_mut().enumerate() {
                    *row = window(f, lane * part + first + 1);
                }
                *ahead = simd::transposed(arithmetic, &rows);
            }
            let mut seen = [[[0.0; LANES]; LANES]; 2];
            for j in 0..LANES {
                seen[0][j] = state[0].row();
                seen[1][j] = state[1].row();
                let mut right = left;
                for (value, ahead) in right.0.iter_mut().zip(&ahead) {
                    *value = Eight::load(arithmetic, &ahead[j]);
                }
                state = steps.step([left, right], state);
                left = right;
            }
            if part - first < LANES {
                ends = [seen[0][part - first], seen[1][part - first]];
            }
            for which in 0..2 {
                let columns = simd::transposed(arithmetic, &seen[which]);
                for (lane, column) in columns.iter().enumerate() {
                    let from = lane * part + first;
                    let count = LANES.min(part - first).min(nodes.saturating_sub(from));
                    if count == LANES {
                        response[which][from..from + LANES].copy_from_slice(column);
                    } else if count > 0 {
                        response[which][from..from + count].copy_from_slice(&column[..count]);
                    }
                }
            }
        }
        ends
    }
}
