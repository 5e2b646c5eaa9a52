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
        match lanes::sum::are_finite(jacobian.as_slice()) {
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
    let mut tangents = moving.tangents();
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
            reader.read(&tangents, &moving.order, from..to, jacobian);
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
    /// The parameter at each place, [`LANES`] of them a group: in the order in which they begin to matter, so
    /// that a group costs nothing before.
    order: Vec<usize>,
    /// Initial states that are sought: which, and their places.
    seeds: Vec<(usize, usize)>,
}

struct Part<'a> {
    design: &'a Design,
    /// The slots of its groups.
    slots: Vec<usize>,
    /// Slot and lane of each of its parameters.
    lanes: Vec<(usize, usize)>,
    constant: bool,
}

impl<'a> Moving<'a> {
    fn new(functions: &'a Functions, experiment: &Experiment) -> Self {
        let first = functions.first_nodes();
        let mut order: Vec<usize> = (0..functions.parameters()).collect();
        order.sort_by_key(|j| first[*j]);
        let mut places = vec![0; order.len()];
        for (place, j) in order.iter().enumerate() {
            places[*j] = place;
        }
        let scalars = functions.scalar_range().start;
        let sought = experiment.sought.into_iter().enumerate();
        let seeds = sought.filter_map(|(state, index)| Some((state, places[scalars + index?])));
        let assembly = functions.assembly(experiment.device);
        let slot_of = |function: usize, j: usize| Slot {
            group: places[j] / LANES,
            function,
        };
        let mut slots: Vec<Slot> = (assembly.iter().enumerate())
            .flat_map(|(function, f)| functions.ranges()[*f].clone().map(move |j| (function, j)))
            .map(|(function, j)| slot_of(function, j))
            .collect();
        slots.sort_unstable_by_key(|s| (s.group, s.function));
        slots.dedup();
        let find = |slot: Slot| {
            slots.partition_point(|s| (s.group, s.function) < (slot.group, slot.function))
        };
        let part = |(function, &f): (usize, &usize)| {
            let design = &functions.get(f).design;
            let lane = |j: usize| (find(slot_of(function, j)), places[j] % LANES);
            let own = (0..slots.len()).filter(|s| slots[*s].function == function);
            Part {
                design,
                slots: own.collect(),
                lanes: functions.ranges()[f].clone().map(lane).collect(),
                constant: functions.is_constant(f),
            }
        };
        Self {
            parts: assembly.iter().enumerate().map(part).collect(),
            seeds: seeds.collect(),
            slots,
            order,
        }
    }

    fn tangents(&self) -> Tangents {
        let mut initial = vec![[[0.0; LANES]; 2]; self.order.len().div_ceil(LANES)];
        for &(state, place) in &self.seeds {
            initial[place / LANES][state][place % LANES] = 1.0;
        }
        Tangents::new(self.slots.clone(), &initial)
    }

    /// How the functions change at the nodes of the tile from node `first` on.
    fn fill(&self, tangents: &mut Tangents, first: usize) {
        for part in &self.parts {
            if !part.constant || first == 0 {
                part.slots.iter().for_each(|slot| tangents.rest(*slot));
                part.fill(tangents, first);
            }
        }
    }
}

impl Part<'_> {
    fn fill(&self, tangents: &mut Tangents, first: usize) {
        let mut set = |node: usize, parameter: usize, value: f64| {
            let (slot, lane) = self.lanes[parameter];
            tangents.changes_mut(slot)[node][lane] = value;
        };
        match self.design {
            Design::Empty => {}
            Design::Identity => {
                for node in 0..TILE_NODES.min(self.lanes.len() - first) {
                    set(node, first + node, 1.0);
                }
            }
            Design::Sparse(matrix) => {
                let (offsets, columns, entries) = matrix.csr_data();
                let last = (first + TILE_NODES).min(matrix.nrows());
                for (node, ends) in offsets[first..=last].windows(2).enumerate() {
                    let range = ends[0]..ends[1];
                    for (j, b) in columns[range.clone()].iter().zip(&entries[range]) {
                        set(node, *j, *b);
                    }
                }
            }
        }
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
    fn read(
        &mut self,
        tangents: &Tangents,
        order: &[usize],
        steps: Range<usize>,
        jacobian: &mut DMatrix<f64>,
    ) {
        let height = jacobian.nrows();
        lanes::run(Read {
            reader: self,
            tangents,
            order,
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
    /// The parameter at each place.
    order: &'a [usize],
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
                order: self.order,
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
    order: &'a [usize],
    glance: &'a Glance,
    kind: Kind,
    gain: f64,
}

impl Answer<'_> {
    /// Writes them from `row` on into columns of `height` numbers each.
    #[inline(always)]
    fn write<A: Arithmetic>(&self, arithmetic: A, columns: &mut [f64], height: usize, row: usize) {
        let gain = Eight::splat(arithmetic, self.gain);
        let count = self.glance.count;
        for (g, parameters) in self.order.chunks(LANES).enumerate() {
            if !self.tangents.has_begun(g) {
                continue;
            }
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
            for (j, answer) in parameters.iter().zip(&answers) {
                let rows = &mut columns[j * height + row..][..count];
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
