//! The response of one system, made again from eight of its states.

use super::part;
use super::rows::{Steps, Values};
use crate::simd::{self, Arithmetic, Eight, Kernel, LANES, Row, window};
use crate::simulate::Trajectory;
use crate::system::{NodalCoefficients, State};

/// The response of `system` from the displacements and velocities where its eight parts begin, by divisions alone.
///
/// Whether it is the response that one step after the other gives from `initial`, to the last bit: the first part begins there, and
/// each ends where the next begins.
/// Otherwise what is in `trajectory` is of no use.
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
    let ends = simd::run(Replay {
        functions: [&nodal.mass, &nodal.coefficients[0], &nodal.coefficients[1]],
        states,
        step,
        response: [&mut trajectory.displacement, &mut trajectory.velocity],
    });
    let parts = nodes.div_ceil(part(nodes));
    let joins = |ends: &Row, begins: &Row| ends[..parts - 1] == begins[1..parts];
    joins(&ends[0], &states[0]) && joins(&ends[1], &states[1])
}

/// A response from its states at the beginning of its eight parts, a lane each; gives those at their ends.
struct Replay<'a> {
    /// Mass, damping, stiffness at the nodes.
    functions: [&'a [f64]; 3],
    /// Displacements and velocities where the parts begin.
    states: [Row; 2],
    step: f64,
    response: [&'a mut [f64]; 2],
}

impl Kernel for Replay<'_> {
    type Output = [Row; 2];

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> [Row; 2] {
        let Replay {
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
