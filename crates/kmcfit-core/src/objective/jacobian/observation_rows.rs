//! Rows of the Jacobian for the samples of one channel, computed tile by tile.

use crate::objective::SimulatedRecord;
use crate::record::Channel;
use crate::simd::tall_qr::RowBlock;
use crate::simd::{self, Arithmetic, Eight, Kernel, LANES};
use crate::step::Observation;
use crate::step::nodal_observations::Accelerations;
use crate::step::tangents::{ConstantPerturbation, FunctionPerturbation, TILE, Tangents};
use crate::system::FUNCTIONS;
use std::ops::Range;

/// Computes the Jacobian rows of one channel's samples, tile by tile.
pub(super) struct JacobianRows<'a> {
    channel: &'a Channel,
    view: SimulatedRecord<'a>,
    /// Index of the next sample.
    next: usize,
    gain: f64,
    kind: ObservationKind,
    batch: SampleBatch,
}

/// Kind of the samples of a channel.
#[derive(Clone, Copy, PartialEq, Eq)]
enum ObservationKind {
    /// Displacements at nodes.
    Displacements,
    /// Accelerations, sample `i` at node `i`.
    Accelerations,
    /// Any other kind or times.
    Any,
}

/// Up to eight consecutive samples.
struct SampleBatch {
    count: usize,
    /// Node of each sample or, between nodes, the left node of its step, relative to the tile.
    nodes: [usize; LANES],
    states: [[f64; 4]; LANES],
    functions: [[[f64; FUNCTIONS]; 2]; LANES],
    /// True for samples that do not depend on the right node.
    at_left: [bool; LANES],
    /// Derivatives of accelerations at nodes.
    observed: Accelerations,
}

impl SampleBatch {
    const NOTHING: Self = Self {
        count: 0,
        nodes: [0; LANES],
        states: [[0.0; 4]; LANES],
        functions: [[[0.0; FUNCTIONS]; 2]; LANES],
        at_left: [false; LANES],
        observed: Accelerations::NOTHING,
    };

    fn set(&mut self, l: usize, sensed: &Observation) {
        self.states[l] = sensed.states;
        self.functions[l] = sensed.functions;
    }
}

impl<'a> JacobianRows<'a> {
    /// Starts at sample `next`.
    pub fn new(channel: &'a Channel, view: SimulatedRecord<'a>, next: usize) -> Self {
        let [gain, ..] = channel.sensor().values(view.scalars);
        Self {
            kind: match () {
                () if channel.is_displacement_at_nodes() => ObservationKind::Displacements,
                () if channel.is_acceleration_on_nodes() => ObservationKind::Accelerations,
                () => ObservationKind::Any,
            },
            channel,
            view,
            next,
            gain,
            batch: SampleBatch::NOTHING,
        }
    }

    /// Appends the rows of samples within `steps`, the current tile of the tangents, until `block` is full; returns true if
    /// samples may remain.
    pub fn read(&mut self, tangents: &Tangents, steps: Range<usize>, block: &mut RowBlock) -> bool {
        simd::run(Read {
            reader: self,
            tangents,
            steps,
            block: &mut *block,
        });
        block.is_full()
    }

    /// Collects up to `most` next samples within `steps` and returns their number.
    #[inline(always)]
    fn batch<A: Arithmetic>(&mut self, arithmetic: A, steps: &Range<usize>, most: usize) {
        let batch = &mut self.batch;
        let most = most.min(LANES).min(self.channel.len() - self.next);
        if self.channel.is_on_every_node() && self.kind != ObservationKind::Any {
            // The last node of the response belongs to its last step.
            let last = steps.end + 1 == self.view.response.nodes();
            let end = steps.end + usize::from(last);
            batch.count = most.min(end.saturating_sub(self.next));
            let from = self.next.saturating_sub(steps.start);
            for (l, node) in batch.nodes.iter_mut().enumerate() {
                *node = (from + l).min(TILE);
            }
        } else {
            batch.count = 0;
            for l in 0..most {
                let position = self.channel.position(self.view, self.next + l);
                if position.step >= steps.end {
                    break;
                }
                batch.count = l + 1;
                batch.nodes[l] = position.step - steps.start;
                if self.kind == ObservationKind::Displacements {
                    batch.nodes[l] += usize::from(position.fraction == 1.0);
                } else {
                    batch.at_left[l] = position.fraction == 0.0;
                    batch.set(l, &self.channel.sensed(self.view, self.next + l));
                }
            }
        }
        if self.kind == ObservationKind::Accelerations && batch.count > 0 {
            (self.channel).accelerations(arithmetic, self.view, self.next, &mut batch.observed);
        }
    }
}

/// Samples of a channel within a tile.
struct Read<'a, 'c> {
    reader: &'a mut JacobianRows<'c>,
    tangents: &'a Tangents,
    steps: Range<usize>,
    block: &'a mut RowBlock,
}

impl Kernel for Read<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let reader = self.reader;
        loop {
            reader.batch(arithmetic, &self.steps, self.block.room());
            if reader.batch.count == 0 {
                return;
            }
            let answer = BatchSensitivity {
                tangents: self.tangents,
                batch: &reader.batch,
                kind: reader.kind,
                gain: reader.gain,
            };
            answer.write(arithmetic, self.block);
            reader.next += reader.batch.count;
        }
    }
}

/// Derivatives of up to eight samples along all directions.
struct BatchSensitivity<'a> {
    tangents: &'a Tangents,
    batch: &'a SampleBatch,
    kind: ObservationKind,
    gain: f64,
}

impl BatchSensitivity<'_> {
    /// Writes the derivatives behind the rows of `block`, which must have space for them.
    #[inline(always)]
    fn write<A: Arithmetic>(&self, arithmetic: A, block: &mut RowBlock) {
        let gain = Eight::splat(arithmetic, self.gain);
        let count = self.batch.count;
        let begun = self.tangents.begun_groups() * LANES;
        let (row, positions) = (block.count, begun.min(block.positions()));
        block.widen(positions);
        block.count += count;
        for (g, first) in (0..positions).step_by(LANES).enumerate() {
            let mut answers = [Eight::splat(arithmetic, 0.0); LANES];
            if self.tangents.has_begun(g) {
                // Lanes without a sample are unused.
                match self.kind {
                    ObservationKind::Displacements => {
                        let states = self.tangents.states(g);
                        for (answer, node) in answers.iter_mut().zip(self.batch.nodes) {
                            *answer = Eight::load(arithmetic, &states[node][0]);
                        }
                    }
                    ObservationKind::Accelerations => {
                        let varies = self.tangents.changes(g).any(|change| change.varies());
                        for (l, answer) in answers.iter_mut().enumerate() {
                            *answer = self.at_acceleration(arithmetic, g, l, varies);
                        }
                    }
                    ObservationKind::Any => {
                        for (l, answer) in answers.iter_mut().enumerate().take(count) {
                            *answer = self.at_step(arithmetic, g, l);
                        }
                    }
                }
                answers = Eight::transpose(arithmetic, answers);
                if self.kind == ObservationKind::Accelerations {
                    self.add_constants(arithmetic, g, &mut answers);
                }
            }
            for (position, answer) in (first..positions).zip(&answers) {
                let answer = (gain * *answer).row();
                let rows = &mut block.column_mut(position)[row..];
                match rows.first_chunk_mut::<LANES>() {
                    // Entries below the last row are undefined.
                    Some(rows) => *rows = answer,
                    None => rows[..count].copy_from_slice(&answer[..count]),
                }
            }
        }
    }

    /// Adds the derivatives of accelerations with respect to constant functions, one direction per row.
    #[inline(always)]
    fn add_constants<A: Arithmetic>(
        &self,
        arithmetic: A,
        g: usize,
        answers: &mut [Eight<A>; LANES],
    ) {
        for change in self.tangents.changes(g) {
            if let Some(ConstantPerturbation { lane, value }) = change.steady {
                let slopes =
                    Eight::load(arithmetic, &self.batch.observed.functions[change.function]);
                answers[lane] += slopes * Eight::splat(arithmetic, value);
            }
        }
    }

    /// Derivative of an acceleration, without that with respect to constant functions.
    #[inline(always)]
    fn at_acceleration<A: Arithmetic>(
        &self,
        arithmetic: A,
        g: usize,
        l: usize,
        varies: bool,
    ) -> Eight<A> {
        let (node, observed) = (self.batch.nodes[l], &self.batch.observed);
        let mut answer = Eight::splat(arithmetic, 0.0);
        for (by, tangent) in observed.states.iter().zip(&self.tangents.states(g)[node]) {
            answer += Eight::splat(arithmetic, by[l]) * Eight::load(arithmetic, tangent);
        }
        if varies {
            for change in self
                .tangents
                .changes(g)
                .filter(FunctionPerturbation::varies)
            {
                let slope = Eight::splat(arithmetic, observed.functions[change.function][l]);
                answer += slope * Eight::load(arithmetic, &change.rows[node]);
            }
        }
        answer
    }

    /// Derivative of sample `l` along the directions of a group, before multiplication by the gain.
    #[inline(always)]
    fn at_step<A: Arithmetic>(&self, arithmetic: A, g: usize, l: usize) -> Eight<A> {
        let SampleBatch {
            nodes,
            states,
            functions,
            ..
        } = self.batch;
        let (node, by) = (nodes[l], &states[l]);
        let tangent = self.tangents.states(g);
        let mut answer = Eight::splat(arithmetic, 0.0);
        for side in 0..2 {
            if side == 1 && self.batch.at_left[l] {
                return answer;
            }
            let at = node + side;
            for state in 0..2 {
                answer += Eight::splat(arithmetic, by[2 * side + state])
                    * Eight::load(arithmetic, &tangent[at][state]);
            }
            for change in self.tangents.changes(g) {
                let slope = functions[l][side][change.function];
                if slope != 0.0 {
                    let row = Eight::load(arithmetic, &change.rows[at]);
                    answer += Eight::splat(arithmetic, slope) * row;
                }
            }
        }
        answer
    }
}
