//! Excitation of a system: force and base acceleration at the stages of the steps.

use super::TimePoint;
use super::integrator::StagePosition;
use serde::Serialize;
use std::ops::Range;
use std::sync::Arc;

/// A function of time at the left end, the middle and the right end of every step. The value at a right end is the limit from the
/// left, so a jump at a node belongs to the following step.
#[derive(Debug, Clone, PartialEq)]
pub struct StageSamples(Arc<Vec<[f64; 3]>>);

impl StageSamples {
    /// Values at the left end, middle and right end of each step.
    pub fn new(steps: Vec<[f64; 3]>) -> Self {
        Self(Arc::new(steps))
    }

    /// The piecewise linear function through `nodes`.
    pub fn linear(nodes: &[f64]) -> Self {
        let step = |w: &[f64]| [w[0], (w[1] + w[0]) * 0.5, w[1]];
        Self::new(nodes.windows(2).map(step).collect())
    }

    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.0.len()
    }

    /// The values of each step.
    pub fn values(&self) -> &[[f64; 3]] {
        &self.0
    }

    /// True if zero at all stages.
    pub fn is_zero(&self) -> bool {
        self.0.iter().flatten().all(|value| *value == 0.0)
    }

    /// Values at the nodes: left values of the steps, and the right value of the last step.
    pub fn at_nodes(&self) -> Vec<f64> {
        let last = self.0.last().map(|step| step[2]);
        self.0.iter().map(|step| step[0]).chain(last).collect()
    }

    #[inline(always)]
    pub(crate) fn at(&self, i: usize, position: StagePosition) -> f64 {
        self.0[i][match position {
            StagePosition::Left => 0,
            StagePosition::Middle => 1,
            StagePosition::Right => 2,
        }]
    }
}

/// Force and base acceleration of one experiment.
///
/// Under base excitation `y` is relative to the base `b(t)`, and the equation of motion is
/// `m (y'' + b'') + sum_j p_j phi_j(y, y') = f`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Excitation {
    /// Force, N; `None` for no force.
    pub force: Option<StageSamples>,
    /// Acceleration `b''` of the base, m/s^2; `None` for a base at rest.
    pub base: Option<StageSamples>,
}

impl Excitation {
    /// A force that is linear between its nodal values (N), with the base at rest.
    pub fn force_at_nodes(nodes: &[f64]) -> Self {
        Self {
            force: Some(StageSamples::linear(nodes)),
            base: None,
        }
    }

    /// True without force and base motion.
    pub fn is_zero(&self) -> bool {
        let zero = |part: &Option<StageSamples>| part.as_ref().is_none_or(StageSamples::is_zero);
        zero(&self.force) && zero(&self.base)
    }

    /// Excitation of the steps `steps` on steps of half the length: old stages become ends of new steps, with linear interpolation
    /// between them.
    #[must_use]
    pub fn halved(&self, steps: Range<usize>) -> Self {
        let halves = |part: &StageSamples| {
            let halves = part.0[steps.clone()]
                .iter()
                .flat_map(|&[left, middle, right]| {
                    [
                        [left, 0.5 * (left + middle), middle],
                        [middle, 0.5 * (middle + right), right],
                    ]
                });
            StageSamples::new(halves.collect())
        };
        Self {
            force: self.force.as_ref().map(halves),
            base: self.base.as_ref().map(halves),
        }
    }

    /// Force and base acceleration at a point, linear between the ends of its step.
    pub fn input_at(&self, place: TimePoint) -> InputSample {
        let at = |part: &Option<StageSamples>| {
            part.as_ref().map_or(0.0, |p| {
                let [left, _, right] = p.0[place.step];
                left * (1.0 - place.fraction) + right * place.fraction
            })
        };
        InputSample {
            force: at(&self.force),
            base: at(&self.base),
        }
    }

    /// The excitation with values at the nodes, linear between them, added to one of its quantities.
    #[must_use]
    pub(crate) fn plus(&self, quantity: InputQuantity, nodes: &[f64]) -> Self {
        let mut sum = self.clone();
        let part = match quantity {
            InputQuantity::Force => &mut sum.force,
            InputQuantity::BaseAcceleration => &mut sum.base,
        };
        let added = StageSamples::linear(nodes);
        *part = Some(match part {
            None => added,
            Some(part) => {
                let pairs = part.0.iter().zip(added.0.iter());
                let step = |(a, b): (&[f64; 3], &[f64; 3])| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
                StageSamples::new(pairs.map(step).collect())
            }
        });
        sum
    }

    /// True if the excitation covers a response over `nodes` nodes.
    pub(crate) fn covers(&self, nodes: usize) -> bool {
        let parts = [&self.force, &self.base];
        parts.into_iter().flatten().all(|p| p.steps() + 1 >= nodes)
    }
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

/// Force and acceleration of the base at one time.
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
        let whole = Excitation {
            force: Some(StageSamples::new(vec![[1.0, 4.0, 3.0], [-2.0, 0.0, 8.0]])),
            base: Some(StageSamples::new(vec![[0.5, 0.25, 1.0], [0.0; 3]])),
        };
        let halves = whole.halved(0..2);
        let force = halves.force.unwrap();
        let expected = [
            [1.0, 2.5, 4.0],
            [4.0, 3.5, 3.0],
            [-2.0, -1.0, 0.0],
            [0.0, 4.0, 8.0],
        ];
        assert_eq!(force.values(), expected);
        let base = halves.base.unwrap();
        let expected = [[0.5, 0.375, 0.25], [0.25, 0.625, 1.0]];
        assert_eq!(base.values()[..2], expected);
        let second = whole.halved(1..2).force.unwrap();
        assert_eq!(second.values(), &force.values()[2..]);
        assert_eq!(Excitation::default().halved(0..0), Excitation::default());
    }
}
