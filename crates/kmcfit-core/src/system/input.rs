//! Excitation of a system: force and base acceleration at the stages of the steps.

use super::TimePoint;
use crate::structure::Structure;
use serde::Serialize;
use std::ops::Range;
use std::sync::Arc;

/// A function of time at the left end, the middle and the right end of every step. The value at a right end is the limit from the
/// left, so a jump at a node belongs to the following step.
#[derive(Debug, Clone, PartialEq)]
pub struct StageSamples(Arc<Stages>);

/// Values at the stages of each step; without jumps a right end is the next left end, and the last one follows the left ends.
#[derive(Debug, Default, PartialEq)]
struct Stages {
    left: Vec<f64>,
    middle: Vec<f64>,
    /// Empty without jumps.
    right: Vec<f64>,
}

impl StageSamples {
    /// Values at the left end, middle and right end of each step.
    pub fn new(steps: impl IntoIterator<Item = [f64; 3]>) -> Self {
        let steps = steps.into_iter();
        let mut stages = Stages::default();
        let Stages {
            left,
            middle,
            right,
        } = &mut stages;
        left.reserve_exact(steps.size_hint().0 + 1);
        middle.reserve_exact(steps.size_hint().0);
        let mut end: Option<f64> = None;
        for [at_left, at_middle, at_right] in steps {
            let jumps = end.is_some_and(|end| end.to_bits() != at_left.to_bits());
            if right.is_empty() && jumps {
                right.extend(left.get(1..).into_iter().flatten().chain(&end));
            }
            left.push(at_left);
            middle.push(at_middle);
            if !right.is_empty() {
                right.push(at_right);
            }
            end = Some(at_right);
        }
        if right.is_empty() {
            left.extend(end);
        }
        Self(Arc::new(stages))
    }

    /// The piecewise linear function through `nodes`.
    pub fn linear(nodes: &[f64]) -> Self {
        let step = |w: &[f64]| [w[0], (w[1] + w[0]) * 0.5, w[1]];
        Self::new(nodes.windows(2).map(step))
    }

    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.0.middle.len()
    }

    /// Values at the left ends, the middles and the right ends, of all steps; the first list may be longer.
    #[inline(always)]
    pub(crate) fn stages(&self) -> [&[f64]; 3] {
        let Stages {
            left,
            middle,
            right,
        } = &*self.0;
        match right.is_empty() {
            true => [left, middle, left.get(1..).unwrap_or_default()],
            false => [left, middle, right],
        }
    }

    /// Values of step `i`.
    ///
    /// # Panics
    /// If there is no such step.
    pub fn step(&self, i: usize) -> [f64; 3] {
        self.stages().map(|values| values[i])
    }

    /// Values of all steps.
    pub fn iter(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        (0..self.steps()).map(|i| self.step(i))
    }

    /// Value at a point, linear between the ends of its step.
    pub(crate) fn at(&self, position: TimePoint) -> f64 {
        let [left, _, right] = self.step(position.step);
        left * (1.0 - position.fraction) + right * position.fraction
    }

    /// True if zero at all stages.
    pub fn is_zero(&self) -> bool {
        let mut all = self.stages().into_iter().flatten();
        all.all(|value| *value == 0.0)
    }

    /// Values at the nodes: left values of the steps, and the right value of the last step.
    pub fn at_nodes(&self) -> Vec<f64> {
        let [left, _, right] = self.stages();
        let last = right.last().copied();
        left[..self.steps()].iter().copied().chain(last).collect()
    }
}

/// Motion of a support over time.
#[derive(Debug, Clone, PartialEq)]
pub struct SupportMotion {
    /// Displacement, m.
    pub displacement: StageSamples,
    /// Velocity, m/s.
    pub velocity: StageSamples,
    /// Acceleration, m/s^2: it acts through inertias that join coordinates and supports.
    pub acceleration: StageSamples,
}

/// Forces, accelerations of frames and motion of the supports in one experiment.
///
/// Under base excitation coordinates are relative to the base `b(t)`, their frame; the equation of motion of one coordinate is
/// `m (y'' + b'') + sum_j p_j phi_j(y, y') = f`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Excitation {
    /// Forces, N, with the coordinates on which they act; at most one on each.
    pub forces: Vec<(usize, StageSamples)>,
    /// Accelerations `b''`, m/s^2, of the frames relative to which coordinates are measured; at most one for each.
    pub frames: Vec<(usize, StageSamples)>,
    /// Motion of each support of the structure.
    pub supports: Vec<SupportMotion>,
}

impl Excitation {
    /// Of one coordinate: its force (N), and the acceleration of the base (m/s^2).
    pub fn one(force: Option<StageSamples>, base: Option<StageSamples>) -> Self {
        Self {
            forces: force.into_iter().map(|force| (0, force)).collect(),
            frames: base.into_iter().map(|base| (0, base)).collect(),
            supports: Vec::new(),
        }
    }

    /// A force on the first coordinate that is linear between its nodal values (N), with the base at rest.
    pub fn force_at_nodes(nodes: &[f64]) -> Self {
        Self::one(Some(StageSamples::linear(nodes)), None)
    }

    /// The force on a coordinate, if there is one.
    pub fn force(&self, coordinate: usize) -> Option<&StageSamples> {
        find(&self.forces, coordinate)
    }

    /// The acceleration of the frame of a coordinate, if it moves.
    pub fn frame(&self, coordinate: usize) -> Option<&StageSamples> {
        find(&self.frames, coordinate)
    }

    /// The samples of a quantity that acts on the first coordinate.
    pub(crate) fn quantity(&self, quantity: InputQuantity) -> Option<&StageSamples> {
        match quantity {
            InputQuantity::Force => self.force(0),
            InputQuantity::BaseAcceleration => self.frame(0),
        }
    }

    fn parts(&self) -> impl Iterator<Item = &StageSamples> {
        let supports = self.supports.iter();
        let supports = supports.flat_map(|s| [&s.displacement, &s.velocity, &s.acceleration]);
        let inputs = self.forces.iter().chain(&self.frames);
        inputs.map(|(_, samples)| samples).chain(supports)
    }

    /// The excitation with each of its functions of time replaced.
    fn map(&self, change: impl Fn(&StageSamples) -> StageSamples) -> Self {
        let supports = self.supports.iter().map(|s| SupportMotion {
            displacement: change(&s.displacement),
            velocity: change(&s.velocity),
            acceleration: change(&s.acceleration),
        });
        let each = |inputs: &[(usize, StageSamples)]| {
            let each = inputs.iter().map(|(on, samples)| (*on, change(samples)));
            each.collect()
        };
        Self {
            forces: each(&self.forces),
            frames: each(&self.frames),
            supports: supports.collect(),
        }
    }

    /// True without forces and motion of frames and supports.
    pub fn is_zero(&self) -> bool {
        self.parts().all(StageSamples::is_zero)
    }

    /// Excitation of the first `steps` steps.
    #[must_use]
    pub fn first(&self, steps: usize) -> Self {
        self.map(|part| StageSamples::new(part.iter().take(steps)))
    }

    /// Excitation of the steps `steps` on steps of half the length: old stages become ends of new steps, with linear interpolation
    /// between them.
    #[must_use]
    pub fn halved(&self, steps: Range<usize>) -> Self {
        self.map(|part| {
            let halves = steps.clone().flat_map(|i| {
                let [left, middle, right] = part.step(i);
                [
                    [left, 0.5 * (left + middle), middle],
                    [middle, 0.5 * (middle + right), right],
                ]
            });
            StageSamples::new(halves)
        })
    }

    /// The force on the first coordinate and the acceleration of the base at a point.
    pub fn input_at(&self, position: TimePoint) -> InputSample {
        let at = |part: Option<&StageSamples>| part.map_or(0.0, |part| part.at(position));
        InputSample {
            force: at(self.force(0)),
            base: at(self.frame(0)),
        }
    }

    /// The coordinates on which a quantity acts: that of the first force, or those whose frames move; the first one where there is none.
    pub(crate) fn acting(&self, quantity: InputQuantity) -> Vec<usize> {
        let on = |inputs: &[(usize, StageSamples)], most: usize| -> Vec<usize> {
            match inputs {
                [] => vec![0],
                inputs => inputs.iter().map(|(on, _)| *on).take(most).collect(),
            }
        };
        match quantity {
            InputQuantity::Force => on(&self.forces, 1),
            InputQuantity::BaseAcceleration => on(&self.frames, usize::MAX),
        }
    }

    /// The excitation with values at the nodes, linear between them, added to a quantity where it acts.
    #[must_use]
    pub(crate) fn plus(&self, quantity: InputQuantity, nodes: &[f64]) -> Self {
        let mut sum = self.clone();
        let inputs = match quantity {
            InputQuantity::Force => &mut sum.forces,
            InputQuantity::BaseAcceleration => &mut sum.frames,
        };
        let added = StageSamples::linear(nodes);
        for coordinate in self.acting(quantity) {
            match inputs.iter_mut().find(|(on, _)| *on == coordinate) {
                None => inputs.push((coordinate, added.clone())),
                Some((_, part)) => {
                    let pairs = part.iter().zip(added.iter());
                    let step =
                        |(a, b): ([f64; 3], [f64; 3])| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
                    *part = StageSamples::new(pairs.map(step));
                }
            }
        }
        sum
    }

    /// True if it has one force and one frame for each coordinate at most, and a motion for each support.
    pub(crate) fn acts_on(&self, structure: &Structure) -> bool {
        let is_once = |inputs: &[(usize, StageSamples)]| {
            let is_first = |i: usize| inputs[..i].iter().all(|(on, _)| *on != inputs[i].0);
            let mut each = inputs.iter().enumerate();
            each.all(|(i, (on, _))| *on < structure.coordinates() && is_first(i))
        };
        self.supports.len() == structure.supports()
            && is_once(&self.forces)
            && is_once(&self.frames)
    }

    /// True if the excitation covers a response over `nodes` nodes.
    pub(crate) fn covers(&self, nodes: usize) -> bool {
        self.parts().all(|part| part.steps() + 1 >= nodes)
    }
}

fn find(inputs: &[(usize, StageSamples)], coordinate: usize) -> Option<&StageSamples> {
    let found = inputs.iter().find(|(on, _)| *on == coordinate);
    found.map(|(_, samples)| samples)
}

/// A quantity that excites a system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum InputQuantity {
    /// Force, N.
    Force,
    /// Acceleration of the base, m/s^2.
    BaseAcceleration,
}

impl InputQuantity {
    /// Name, that of its column in a model file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Force => "force",
            Self::BaseAcceleration => "base_acceleration",
        }
    }

    /// SI unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Force => "N",
            Self::BaseAcceleration => "m/s^2",
        }
    }
}

/// Force on one coordinate and acceleration of the base at one time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct InputSample {
    /// Force, N.
    pub force: f64,
    /// Acceleration of the base, m/s^2.
    pub base: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_steps_meet_the_old_stages_and_are_linear_between() {
        let whole = Excitation::one(
            Some(StageSamples::new(vec![[1.0, 4.0, 3.0], [-2.0, 0.0, 8.0]])),
            Some(StageSamples::new(vec![[0.5, 0.25, 1.0], [0.0; 3]])),
        );
        let halves = whole.halved(0..2);
        let force = halves.force(0).unwrap();
        let expected = [
            [1.0, 2.5, 4.0],
            [4.0, 3.5, 3.0],
            [-2.0, -1.0, 0.0],
            [0.0, 4.0, 8.0],
        ];
        assert!(force.iter().eq(expected));
        let base = halves.frame(0).unwrap();
        let expected = [[0.5, 0.375, 0.25], [0.25, 0.625, 1.0]];
        assert!(base.iter().take(2).eq(expected));
        let second = whole.halved(1..2);
        assert!(second.force(0).unwrap().iter().eq(force.iter().skip(2)));
        assert_eq!(Excitation::default().halved(0..0), Excitation::default());
    }

    #[test]
    fn stages_are_those_of_each_step() {
        let smooth = vec![[1.0, 2.0, 3.0], [3.0, 0.5, 4.0], [4.0, -1.0, 5.0]];
        // Jumps after the first, the second and the last but one step.
        let mut jumps = vec![smooth.clone(); 2];
        jumps[0][1][0] = 7.0;
        jumps[1][2][0] = -0.0;
        for steps in jumps
            .into_iter()
            .chain([smooth, vec![[1.0, 4.0, 3.0]], vec![]])
        {
            let samples = StageSamples::new(steps.clone());
            assert_eq!(samples.steps(), steps.len());
            assert!(samples.iter().eq(steps.iter().copied()));
            let nodes = steps.iter().map(|step| step[0]);
            let nodes: Vec<f64> = nodes.chain(steps.last().map(|step| step[2])).collect();
            assert_eq!(samples.at_nodes(), nodes);
            for (i, step) in steps.iter().enumerate() {
                assert_eq!(samples.step(i), *step);
            }
        }
    }
}
