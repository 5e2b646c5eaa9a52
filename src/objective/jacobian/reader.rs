//! The tangents of one channel's readings, tile by tile.

use crate::dynamics::{Accelerations, FUNCTIONS, Sensed, Sight, Tangents};
use crate::lanes::tall::Piece;
use crate::lanes::{self, Arithmetic, Eight, Kernel, LANES};
use crate::objective::{Channel, View};
use std::ops::Range;

/// Takes the tangents of one channel's readings, tile by tile.
pub(super) struct Reader<'a> {
    channel: &'a Channel,
    view: View<'a>,
    /// Reading to go on with.
    next: usize,
    gain: f64,
    kind: Kind,
}

/// How a channel's readings answer to the states.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Displacements, each at a node.
    Nodes,
    /// Accelerations, reading `i` on node `i`.
    Accelerations,
    /// Anything.
    Any,
}

/// Up to eight readings, a reading after the other.
struct Glance {
    count: usize,
    /// Left node of each reading's step, from the start of the tile.
    steps: [usize; LANES],
    states: [[f64; 4]; LANES],
    functions: [[[f64; FUNCTIONS]; 2]; LANES],
    /// Whether nothing at the right node is looked at.
    at_left: [bool; LANES],
    /// What accelerations on left nodes answer to.
    seen: Accelerations,
}

impl Glance {
    const NOTHING: Self = Self {
        count: 0,
        steps: [0; LANES],
        states: [[0.0; 4]; LANES],
        functions: [[[0.0; FUNCTIONS]; 2]; LANES],
        at_left: [false; LANES],
        seen: Accelerations::NOTHING,
    };

    fn set(&mut self, l: usize, sensed: &Sensed) {
        self.states[l] = sensed.states;
        self.functions[l] = sensed.functions;
    }
}

impl<'a> Reader<'a> {
    pub fn new(channel: &'a Channel, view: View<'a>) -> Self {
        let [gain, ..] = channel.sensor().values(view.scalars);
        Self {
            kind: match () {
                () if channel.is_displacement_at_nodes() => Kind::Nodes,
                () if channel.is_acceleration_on_nodes() => Kind::Accelerations,
                () => Kind::Any,
            },
            channel,
            view,
            next: 0,
            gain,
        }
    }

    /// Takes the readings in the steps `steps`, over which the tangents have just gone, until the `piece` is
    /// full: whether there may be more.
    pub fn read(&mut self, tangents: &Tangents, steps: Range<usize>, piece: &mut Piece) -> bool {
        lanes::run(Read {
            reader: self,
            tangents,
            steps,
            piece: &mut *piece,
        });
        piece.is_full()
    }

    /// Takes at most so many next readings within the steps `steps`: how many they are and where they stand.
    #[inline(always)]
    fn glance<A: Arithmetic>(
        &self,
        arithmetic: A,
        steps: &Range<usize>,
        most: usize,
        glance: &mut Glance,
    ) {
        let places = &self.channel.places()[self.next..];
        glance.count = 0;
        for (l, place) in places.iter().take(most.min(LANES)).enumerate() {
            if place.step >= steps.end {
                break;
            }
            glance.count = l + 1;
            glance.steps[l] = place.step - steps.start;
            glance.at_left[l] = place.fraction == 0.0;
            match self.kind {
                Kind::Nodes => glance.steps[l] += usize::from(place.fraction == 1.0),
                Kind::Accelerations if place.fraction == 0.0 => {}
                _ => glance.set(l, &self.channel.sensed(self.view, self.next + l)),
            }
        }
        if self.kind == Kind::Accelerations && glance.count > 0 {
            self.glance_at_accelerations(arithmetic, glance);
        }
    }

    #[inline(always)]
    fn glance_at_accelerations<A: Arithmetic>(&self, arithmetic: A, glance: &mut Glance) {
        let View {
            oscillator,
            device,
            excitation,
            motion,
            ..
        } = self.view;
        let sight = Sight {
            oscillator,
            device,
            states: motion,
        };
        let around = |i| self.channel.around_reading(excitation, i);
        sight.see(
            arithmetic,
            self.next,
            glance.count,
            around,
            &mut glance.seen,
        );
    }
}

/// The readings of a channel within a tile.
struct Read<'a, 'c> {
    reader: &'a mut Reader<'c>,
    tangents: &'a Tangents,
    steps: Range<usize>,
    piece: &'a mut Piece,
}

impl Kernel for Read<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let mut glance = Glance::NOTHING;
        loop {
            let room = self.piece.room();
            self.reader
                .glance(arithmetic, &self.steps, room, &mut glance);
            if glance.count == 0 {
                return;
            }
            let answer = Answer {
                tangents: self.tangents,
                glance: &glance,
                kind: self.reader.kind,
                gain: self.reader.gain,
            };
            answer.write(arithmetic, self.piece);
            self.reader.next += glance.count;
        }
    }
}

/// The answers of up to eight readings to all directions.
struct Answer<'a> {
    tangents: &'a Tangents,
    glance: &'a Glance,
    kind: Kind,
    gain: f64,
}

impl Answer<'_> {
    /// Writes them behind the rows of a piece that has room for them.
    #[inline(always)]
    fn write<A: Arithmetic>(&self, arithmetic: A, piece: &mut Piece) {
        let gain = Eight::splat(arithmetic, self.gain);
        let count = self.glance.count;
        let (row, places) = (piece.count, piece.places());
        piece.count += count;
        for (g, first) in (0..places).step_by(LANES).enumerate() {
            let mut answers = [[0.0; LANES]; LANES];
            if self.tangents.has_begun(g) {
                for (l, answer) in answers.iter_mut().enumerate().take(count) {
                    let sum = match self.kind {
                        Kind::Nodes => {
                            let step = self.glance.steps[l];
                            Eight::load(arithmetic, &self.tangents.states(g)[step][0])
                        }
                        Kind::Accelerations if self.glance.at_left[l] => {
                            self.at_acceleration(arithmetic, g, l)
                        }
                        Kind::Accelerations | Kind::Any => self.at_step(arithmetic, g, l),
                    };
                    *answer = (gain * sum).row();
                }
                answers = arithmetic.transpose(&answers);
            }
            for (place, answer) in (first..places).zip(&answers) {
                let rows = &mut piece.column_mut(place)[row..row + count];
                match rows.first_chunk_mut::<LANES>() {
                    Some(rows) => *rows = *answer,
                    None => rows.copy_from_slice(&answer[..count]),
                }
            }
        }
    }

    /// The answer of an acceleration on a left node.
    #[inline(always)]
    fn at_acceleration<A: Arithmetic>(&self, arithmetic: A, g: usize, l: usize) -> Eight<A> {
        let (step, seen) = (self.glance.steps[l], &self.glance.seen);
        let mut answer = Eight::splat(arithmetic, 0.0);
        for (by, tangent) in seen.states.iter().zip(&self.tangents.states(g)[step]) {
            answer += Eight::splat(arithmetic, by[l]) * Eight::load(arithmetic, tangent);
        }
        for (f, changes) in self.tangents.changes(g) {
            let slope = Eight::splat(arithmetic, seen.functions[f][l]);
            answer += slope * Eight::load(arithmetic, &changes[step]);
        }
        answer
    }

    /// The answer of reading `l` to the directions of a group, before the gain.
    #[inline(always)]
    fn at_step<A: Arithmetic>(&self, arithmetic: A, g: usize, l: usize) -> Eight<A> {
        let Glance {
            steps,
            states,
            functions,
            ..
        } = self.glance;
        let (step, by) = (steps[l], &states[l]);
        let tangent = self.tangents.states(g);
        let mut answer = Eight::splat(arithmetic, 0.0);
        for side in 0..2 {
            if side == 1 && self.glance.at_left[l] {
                return answer;
            }
            let at = step + side;
            for state in 0..2 {
                answer += Eight::splat(arithmetic, by[2 * side + state])
                    * Eight::load(arithmetic, &tangent[at][state]);
            }
            for (f, changes) in self.tangents.changes(g) {
                let slope = functions[l][side][f];
                if slope != 0.0 {
                    answer +=
                        Eight::splat(arithmetic, slope) * Eight::load(arithmetic, &changes[at]);
                }
            }
        }
        answer
    }
}
