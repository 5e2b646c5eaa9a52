//! The derivatives of all predictions with respect to all parameters, from tangents in lanes.

use super::{Channel, Evaluation, View};
use crate::dynamics::{
    Accelerations, Course, FUNCTIONS, Sensed, Sight, Slot, TILE, TILE_NODES, Tangents,
};
use crate::functions::{Design, Functions};
use crate::lanes::{self, Arithmetic, Eight, Kernel, LANES};
use crate::problem::{Experiment, Problem};
use nalgebra::DMatrix;
use std::ops::Range;

impl Problem {
    /// The change of every prediction (rows: readings of all channels of all experiments, in order)
    /// along every parameter: [`Problem::predictions_tangent`] of all unit vectors, to rounding.
    pub fn predictions_jacobian(&self, evaluation: &Evaluation) -> DMatrix<f64> {
        let mut jacobian = DMatrix::zeros(self.reading_count(), self.parameters());
        let mut row = 0;
        for (e, experiment) in self.experiments.iter().enumerate() {
            let count = experiment.reading_count();
            if count > 0 && self.parameters() > 0 {
                let view = self.view(evaluation, e);
                fill(self, experiment, view, &mut jacobian, row);
            }
            row += count;
        }
        let entries = jacobian.as_slice().iter();
        match entries.fold(true, |all, x| all & x.is_finite()) {
            true => jacobian,
            false => self.jacobian_by_columns(evaluation),
        }
    }

    /// One direction after the other: for numbers at the ends of their range, where the order of the
    /// operations decides what is still finite.
    fn jacobian_by_columns(&self, evaluation: &Evaluation) -> DMatrix<f64> {
        let mut jacobian = DMatrix::zeros(self.reading_count(), self.parameters());
        let mut unit = vec![0.0; self.parameters()];
        for (j, mut column) in jacobian.column_iter_mut().enumerate() {
            unit[j] = 1.0;
            let changes = self.predictions_tangent(evaluation, &unit);
            unit[j] = 0.0;
            let all = changes.iter().flatten().flatten();
            column
                .iter_mut()
                .zip(all)
                .for_each(|(a, change)| *a = *change);
        }
        jacobian
    }
}

/// Fills the rows of one experiment, from row `first` on.
fn fill(
    problem: &Problem,
    experiment: &Experiment,
    view: View,
    jacobian: &mut DMatrix<f64>,
    first: usize,
) {
    let parameters = problem.parameters();
    let moving = Moving::new(&problem.functions, experiment);
    let mut tangents = moving.tangents(parameters.div_ceil(LANES));
    let mut readers = Vec::with_capacity(experiment.channels.len());
    let mut row = first;
    for channel in &experiment.channels {
        readers.push(Reader::new(channel, view, row));
        row += channel.len();
    }
    let course = Course {
        oscillator: view.oscillator,
        device: view.device,
        excitation: view.excitation,
        motion: view.motion,
    };
    let steps = view.motion.nodes() - 1;
    let mut from = 0;
    while from < steps {
        let to = (from + TILE).min(steps);
        moving.fill(&mut tangents, from);
        tangents.advance(course, from..to);
        for reader in &mut readers {
            reader.read(&tangents, from..to, jacobian);
        }
        from = to;
    }
    for reader in &readers {
        reader.finish(jacobian, parameters);
    }
}

/// The functions of an experiment's device that have parameters, and where these stand.
struct Moving<'a> {
    parts: Vec<Part<'a>>,
    slots: Vec<Slot>,
    seeds: Vec<(usize, usize)>,
}

struct Part<'a> {
    design: &'a Design,
    columns: Range<usize>,
    /// The slots of its groups, in order; the first group.
    slots: Vec<usize>,
    constant: bool,
}

impl<'a> Moving<'a> {
    fn new(functions: &'a Functions, experiment: &Experiment) -> Self {
        let scalars = functions.scalar_range().start;
        let sought = experiment.sought.into_iter().enumerate();
        let seeds = sought.filter_map(|(state, index)| Some((state, scalars + index?)));
        let assembly = functions.assembly(experiment.device).iter();
        let columns = assembly.map(|f| functions.ranges()[*f].clone());
        let moving: Vec<_> = (columns.enumerate())
            .filter(|(_, c)| !c.is_empty())
            .collect();
        let groups = |c: &Range<usize>| c.start / LANES..=(c.end - 1) / LANES;
        let mut slots: Vec<Slot> = (moving.iter())
            .flat_map(|&(function, ref c)| groups(c).map(move |group| Slot { group, function }))
            .collect();
        slots.sort_by_key(|s| (s.group, s.function));
        let part = |(function, columns): (usize, Range<usize>)| {
            let index = functions.assembly(experiment.device)[function];
            let design = &functions.get(index).design;
            let own = (0..slots.len()).filter(|s| slots[*s].function == function);
            Part {
                design,
                columns,
                slots: own.collect(),
                constant: is_constant(design, functions.nodes()),
            }
        };
        Self {
            parts: moving.into_iter().map(part).collect(),
            seeds: seeds.collect(),
            slots,
        }
    }

    fn tangents(&self, groups: usize) -> Tangents {
        let mut initial = vec![[[0.0; LANES]; 2]; groups];
        for &(state, column) in &self.seeds {
            initial[column / LANES][state][column % LANES] = 1.0;
        }
        Tangents::new(self.slots.clone(), &initial)
    }

    /// How the functions change at the nodes of the tile from node `first` on.
    fn fill(&self, tangents: &mut Tangents, first: usize) {
        for part in &self.parts {
            if part.constant && first > 0 {
                continue;
            }
            for &slot in &part.slots {
                tangents.changes_mut(slot).fill([0.0; LANES]);
            }
            part.fill(tangents, first);
        }
    }
}

impl Part<'_> {
    fn fill(&self, tangents: &mut Tangents, first: usize) {
        let lowest = self.columns.start / LANES;
        let mut set = |node: usize, parameter: usize, value: f64| {
            let column = self.columns.start + parameter;
            let slot = self.slots[column / LANES - lowest];
            tangents.changes_mut(slot)[node][column % LANES] = value;
        };
        match self.design {
            Design::Empty => {}
            Design::Identity => {
                for node in 0..TILE_NODES.min(self.columns.len() - first) {
                    set(node, first + node, 1.0);
                }
            }
            Design::Sparse(matrix) => {
                for node in 0..TILE_NODES.min(matrix.nrows() - first) {
                    let row = matrix.row(first + node);
                    for (j, b) in row.col_indices().iter().zip(row.values()) {
                        set(node, *j, *b);
                    }
                }
            }
        }
    }
}

/// Whether a design has the same single entry at every node.
fn is_constant(design: &Design, nodes: usize) -> bool {
    match design {
        Design::Sparse(matrix) => {
            let values = matrix.values();
            let same = values.windows(2).all(|pair| pair[0] == pair[1]);
            matrix.ncols() == 1 && values.len() == nodes && same
        }
        _ => false,
    }
}

/// Takes the tangents of one channel's readings, tile by tile.
struct Reader<'a> {
    channel: &'a Channel,
    view: View<'a>,
    /// Row of the channel's first reading.
    row: usize,
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
}

impl Glance {
    const NOTHING: Self = Self {
        count: 0,
        steps: [0; LANES],
        states: [[0.0; 4]; LANES],
        functions: [[[0.0; FUNCTIONS]; 2]; LANES],
        at_left: [false; LANES],
    };

    fn set(&mut self, l: usize, sensed: &Sensed) {
        self.states[l] = sensed.states;
        self.functions[l] = sensed.functions;
    }
}

impl<'a> Reader<'a> {
    fn new(channel: &'a Channel, view: View<'a>, row: usize) -> Self {
        let [gain, ..] = channel.sensor().values(view.scalars);
        Self {
            kind: match () {
                () if channel.is_displacement_at_nodes() => Kind::Nodes,
                () if channel.is_acceleration_on_nodes() => Kind::Accelerations,
                () => Kind::Any,
            },
            channel,
            view,
            row,
            next: 0,
            gain,
        }
    }

    /// The readings in the steps `steps`, over which the tangents have just gone.
    fn read(&mut self, tangents: &Tangents, steps: Range<usize>, jacobian: &mut DMatrix<f64>) {
        let height = jacobian.nrows();
        lanes::run(Read {
            reader: self,
            tangents,
            steps,
            columns: jacobian.as_mut_slice(),
            height,
        });
    }

    /// Takes the next readings within the steps `steps`: how many they are and where they stand.
    #[inline(always)]
    fn glance<A: Arithmetic>(&self, arithmetic: A, steps: &Range<usize>, glance: &mut Glance) {
        let places = &self.channel.places()[self.next..];
        glance.count = 0;
        for (l, place) in places.iter().take(LANES).enumerate() {
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
        let mut seen = Accelerations::NOTHING;
        sight.see(arithmetic, self.next, glance.count, around, &mut seen);
        for l in 0..glance.count.min(LANES) {
            if !glance.at_left[l] {
                continue;
            }
            glance.states[l] = [seen.states[0][l], seen.states[1][l], 0.0, 0.0];
            for f in 0..=oscillator.terms.len() {
                glance.functions[l][0][f] = seen.functions[f][l];
            }
        }
    }

    /// What the sensor itself adds, and the filter.
    fn finish(&self, jacobian: &mut DMatrix<f64>, parameters: usize) {
        let channel = self.channel;
        let count = channel.len();
        let scalars = parameters - self.view.scalars.len();
        for (role, index) in channel.sensor().indices().into_iter().enumerate() {
            let Some(index) = index else {
                continue;
            };
            for i in 0..count {
                jacobian[(self.row + i, scalars + index)] += match role {
                    0 => channel.sensed(self.view, i).value,
                    1 => 1.0,
                    _ => channel.age(i),
                };
            }
        }
        if !channel.filter().is_empty() {
            for j in 0..parameters {
                let rows = &mut jacobian.column_mut(j);
                let mut part = rows.rows_range_mut(self.row..self.row + count);
                let filtered = channel.filtered(part.as_slice());
                part.copy_from_slice(&filtered);
            }
        }
    }
}

/// The readings of a channel within a tile.
struct Read<'a, 'c> {
    reader: &'a mut Reader<'c>,
    tangents: &'a Tangents,
    steps: Range<usize>,
    /// Columns of `height` numbers each.
    columns: &'a mut [f64],
    height: usize,
}

impl Kernel for Read<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let mut glance = Glance::NOTHING;
        loop {
            self.reader.glance(arithmetic, &self.steps, &mut glance);
            if glance.count == 0 {
                return;
            }
            let answer = Answer {
                tangents: self.tangents,
                glance: &glance,
                kind: self.reader.kind,
                gain: self.reader.gain,
            };
            let row = self.reader.row + self.reader.next;
            answer.write(arithmetic, self.columns, self.height, row);
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
    /// Writes them from `row` on into columns of `height` numbers each.
    #[inline(always)]
    fn write<A: Arithmetic>(&self, arithmetic: A, columns: &mut [f64], height: usize, row: usize) {
        let groups = (columns.len() / height).div_ceil(LANES);
        let gain = Eight::splat(arithmetic, self.gain);
        let count = self.glance.count;
        for g in 0..groups {
            let mut answers = [[0.0; LANES]; LANES];
            for (l, answer) in answers.iter_mut().enumerate().take(count) {
                let sum = match self.kind {
                    Kind::Nodes => {
                        let step = self.glance.steps[l];
                        Eight::load(arithmetic, &self.tangents.states(g)[step][0])
                    }
                    Kind::Accelerations | Kind::Any => self.at_step(arithmetic, g, l),
                };
                *answer = (gain * sum).row();
            }
            let answers = arithmetic.transpose(&answers);
            let columns = columns.chunks_exact_mut(height);
            for (column, answer) in columns.skip(g * LANES).zip(&answers) {
                let rows = &mut column[row..row + count];
                match rows.first_chunk_mut::<LANES>() {
                    Some(rows) => *rows = *answer,
                    None => rows.copy_from_slice(&answer[..count]),
                }
            }
        }
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
