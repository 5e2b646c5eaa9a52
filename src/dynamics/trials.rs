//! The costs of many devices along a ray, one a lane: the paper's trial steps.
//!
//! Every lane does the operations of [`Oscillator::forward`](super::Oscillator::forward) and of the
//! integral cost in their order, so that its cost has the bits that it would have by itself.

use super::{State, Trajectory};
use crate::lanes::{self, Aligned, Arithmetic, Eight, Kernel, LANES, Row};
use crate::threads::{self, Companion};

/// Devices `p - a g` in linear free motion by the midpoint rule, seen at every node.
#[derive(Clone, Copy)]
pub(crate) struct Ray<'a> {
    /// Mass, damping, stiffness at the nodes.
    pub functions: [&'a [f64]; 3],
    /// What is taken away from them, per unit of `a`.
    pub direction: [&'a [f64]; 3],
    /// State at the first node.
    pub initial: State,
    /// Displacements read at the nodes, m.
    pub readings: &'a [f64],
    /// Step, s.
    pub step: f64,
    /// Spacing of the readings, s: the step, as the record says it.
    pub spacing: f64,
}

/// Most rows at once: enough that the divisions of one row hide behind those of the others, and few
/// enough for the registers.
const ROWS: usize = 4;

/// Trials along a ray, and their motions: storage that is used again and again.
#[derive(Default)]
pub(crate) struct Trials {
    /// Trials before the first that has mass everywhere.
    without_mass: usize,
    batches: Vec<Batch>,
    /// Who does the last batch, once there was one that was worth it.
    companion: Option<Companion<'static, Owned>>,
    /// Whether the last batch is with the companion.
    is_shared: bool,
}

/// Nodes from which on another thread is asked for a batch: to hand it over takes about a microsecond, and a step
/// of four rows 20 ns.
const WORTH_SHARING: usize = 200;

/// A batch and its ray, in the hands of another thread.
#[derive(Default)]
struct Owned {
    functions: [Vec<f64>; 3],
    direction: [Vec<f64>; 3],
    readings: Vec<f64>,
    initial: State,
    step: f64,
    spacing: f64,
    batch: Batch,
}

impl Owned {
    fn set(&mut self, ray: Ray, lengths: &[Row]) {
        let copies = self.functions.iter_mut().zip(ray.functions);
        for (to, from) in copies.chain(self.direction.iter_mut().zip(ray.direction)) {
            to.clear();
            to.extend_from_slice(from);
        }
        if self.readings != ray.readings {
            ray.readings.clone_into(&mut self.readings);
        }
        (self.initial, self.step, self.spacing) = (ray.initial, ray.step, ray.spacing);
        self.batch.lengths.clear();
        self.batch.lengths.extend_from_slice(lengths);
    }

    fn run(&mut self) {
        self.batch.run(Ray {
            functions: self.functions.each_ref().map(Vec::as_slice),
            direction: self.direction.each_ref().map(Vec::as_slice),
            initial: self.initial,
            readings: &self.readings,
            step: self.step,
            spacing: self.spacing,
        });
    }
}

/// Some rows of trials.
#[derive(Default)]
struct Batch {
    lengths: Vec<Row>,
    /// Displacements and velocities, the rows of one node after those of the node before.
    motion: [Vec<Aligned<Row>>; 2],
    costs: Vec<Row>,
}

impl Trials {
    /// The cost `integral (y - y_obs)^2 dt` at every one of `lengths`, which fall; `None` where the mass is
    /// not positive or the motion leaves the finite numbers. The ray [`is_moderate`](Ray::is_moderate) as far as the
    /// longest of them.
    pub fn costs(&mut self, ray: Ray, lengths: &[f64]) -> Vec<Option<f64>> {
        self.without_mass = ray.first_with_mass(lengths);
        let lengths = &lengths[self.without_mass..];
        let rows: Vec<Row> = lengths
            .chunks(LANES)
            .map(|part| std::array::from_fn(|lane| *part.get(lane).unwrap_or(&part[0])))
            .collect();
        let count = rows.len().div_ceil(ROWS);
        let share = |b: usize| &rows[b * rows.len() / count..(b + 1) * rows.len() / count];
        self.is_shared = count > 1 && ray.readings.len() > WORTH_SHARING && self.has_companion();
        let here = count - usize::from(self.is_shared);
        self.batches.resize_with(here, Batch::default);
        for (b, batch) in self.batches.iter_mut().enumerate() {
            batch.lengths.clear();
            batch.lengths.extend_from_slice(share(b));
        }
        let batches = &mut self.batches;
        let mut run = || -> Vec<Row> {
            batches.iter_mut().for_each(|batch| batch.run(ray));
            batches.iter().flat_map(|b| &b.costs).copied().collect()
        };
        let costs = match self.companion.as_mut().filter(|_| self.is_shared) {
            Some(companion) => companion.with(
                |job| job.set(ray, share(count - 1)),
                &mut run,
                |mut costs, job| {
                    costs.extend_from_slice(&job.batch.costs);
                    costs
                },
            ),
            None => run(),
        };
        let lanes = costs.as_flattened().iter().take(lengths.len());
        let finite = |cost: &f64| cost.is_finite().then_some(*cost);
        std::iter::repeat_n(None, self.without_mass)
            .chain(lanes.map(finite))
            .collect()
    }

    fn has_companion(&mut self) -> bool {
        if self.companion.is_none() && threads::spare() {
            self.companion = Companion::new(Owned::default(), Owned::run);
        }
        self.companion.is_some()
    }

    /// The motion of trial `which` of the last call.
    pub fn motion_into(&self, which: usize, trajectory: &mut Trajectory) {
        let lane = which - self.without_mass;
        let (mut row, lane) = (lane / LANES, lane % LANES);
        for batch in &self.batches {
            if row < batch.lengths.len() {
                return batch.motion_into(row, lane, trajectory);
            }
            row -= batch.lengths.len();
        }
        if let Some(companion) = self.companion.as_ref().filter(|_| self.is_shared) {
            companion.look(|job| job.batch.motion_into(row, lane, trajectory));
        }
    }
}

impl Batch {
    fn motion_into(&self, row: usize, lane: usize, trajectory: &mut Trajectory) {
        let (rows, [y, v]) = (self.lengths.len(), &self.motion);
        let to = (trajectory.displacement.iter_mut()).zip(&mut trajectory.velocity);
        for (i, (to_y, to_v)) in to.enumerate() {
            *to_y = y[i * rows + row][lane];
            *to_v = v[i * rows + row][lane];
        }
    }

    fn run(&mut self, ray: Ray) {
        match self.lengths.len() {
            1 => self.of_rows::<1>(ray),
            2 => self.of_rows::<2>(ray),
            3 => self.of_rows::<3>(ray),
            _ => self.of_rows::<ROWS>(ray),
        }
    }

    fn of_rows<const R: usize>(&mut self, ray: Ray) {
        let mut lengths = [[0.0; LANES]; R];
        lengths.copy_from_slice(&self.lengths);
        let [y, v] = &mut self.motion;
        for rows in [&mut *y, &mut *v] {
            rows.resize(R * ray.readings.len(), Aligned([0.0; LANES]));
        }
        let costs = lanes::run(Rows {
            ray,
            lengths,
            motion: [y.as_chunks_mut().0, v.as_chunks_mut().0],
        });
        self.costs.clear();
        self.costs.extend_from_slice(&costs);
    }
}

impl Ray<'_> {
    /// The first of `lengths` whose device has mass at all nodes: then so has every shorter one, also
    /// after rounding.
    fn first_with_mass(self, lengths: &[f64]) -> usize {
        let has_mass = |a: &f64| self.masses(*a, |m| m > 0.0);
        lengths.iter().position(has_mass).unwrap_or(lengths.len())
    }

    /// Whether the masses of all devices as far as `longest` are so moderate, where they are positive, that
    /// [`Eight::quotients`] divides by them with the bits of a division. A positive difference is no smaller than the
    /// last place of what it is taken from.
    pub fn is_moderate(self, longest: f64) -> bool {
        const LIGHT: f64 = 1e-70;
        const HEAVY: f64 = 1e70;
        self.masses(0.0, |m| LIGHT < m && m < HEAVY) && self.masses(longest, |m| m < HEAVY)
    }

    /// Whether all masses at `a` are as they should be. All are looked at: a loop without a way out is the faster one.
    fn masses(self, a: f64, are: impl Fn(f64) -> bool) -> bool {
        let pairs = self.functions[0].iter().zip(self.direction[0]);
        pairs.fold(true, |so_far, (p, g)| so_far & are(p - a * g))
    }
}

/// `R` rows of devices.
struct Rows<'a, const R: usize> {
    ray: Ray<'a>,
    lengths: [Row; R],
    motion: [&'a mut [[Aligned<Row>; R]]; 2],
}

/// Mass, damping and stiffness of a row of devices.
#[derive(Clone, Copy)]
struct Values<A: Arithmetic>([Eight<A>; 3]);

impl<A: Arithmetic> Values<A> {
    #[inline(always)]
    fn at(ray: &Ray, arithmetic: A, length: Eight<A>, i: usize) -> Self {
        let mut values = [length; 3];
        let pairs = ray.functions.iter().zip(&ray.direction);
        for (value, (p, g)) in values.iter_mut().zip(pairs) {
            let (p, g) = (
                Eight::splat(arithmetic, p[i]),
                Eight::splat(arithmetic, g[i]),
            );
            *value = p - length * g;
        }
        Self(values)
    }

    /// Twice the values in the middle: halves of all three would change no bit of an acceleration.
    #[inline(always)]
    fn twice_middle(self, right: Self) -> Self {
        let mut values = self.0;
        for (value, right) in values.iter_mut().zip(right.0) {
            *value = right + *value;
        }
        Self(values)
    }

    /// `y'' = -k y/m - c v/m`, by the divider.
    #[inline(always)]
    fn acceleration(self, y: Eight<A>, v: Eight<A>, zero: Eight<A>) -> Eight<A> {
        let [m, c, k] = self.0;
        zero - k * y / m - c * v / m
    }

    /// The same, with the same bits, by multipliers for the most part: as of the two accelerations of a step one is
    /// made so, divider and multipliers are busy side by side.
    #[inline(always)]
    fn multiplied_acceleration(self, y: Eight<A>, v: Eight<A>, zero: Eight<A>) -> Eight<A> {
        let [m, c, k] = self.0;
        let [elastic, viscous] = Eight::quotients(k * y, c * v, m);
        zero - elastic - viscous
    }
}

impl<const R: usize> Kernel for Rows<'_, R> {
    type Output = [Row; R];

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> [Row; R] {
        let Rows {
            ray,
            lengths,
            motion: [displacement, velocity],
        } = self;
        let splat = |x| Eight::splat(arithmetic, x);
        let (zero, dt, half_dt) = (splat(0.0), splat(ray.step), splat(0.5 * ray.step));
        let (half_weight, weight) = (splat(ray.spacing * 0.5), splat(ray.spacing));
        let last = ray.readings.len() - 1;

        let mut y = [splat(ray.initial.displacement); R];
        let mut v = [splat(ray.initial.velocity); R];
        let mut left = [Values([zero; 3]); R];
        for r in 0..R {
            left[r] = Values::at(&ray, arithmetic, Eight::load(arithmetic, &lengths[r]), 0);
        }
        for i in 0..last {
            for r in 0..R {
                displacement[i][r].0 = y[r].row();
                velocity[i][r].0 = v[r].row();
                let length = Eight::load(arithmetic, &lengths[r]);
                let right = Values::at(&ray, arithmetic, length, i + 1);
                let a = left[r].multiplied_acceleration(y[r], v[r], zero);
                let (y_half, v_half) = (y[r] + half_dt * v[r], v[r] + half_dt * a);
                let a_half = left[r]
                    .twice_middle(right)
                    .acceleration(y_half, v_half, zero);
                y[r] += dt * v_half;
                v[r] += dt * a_half;
                left[r] = right;
            }
        }
        for r in 0..R {
            displacement[last][r].0 = y[r].row();
            velocity[last][r].0 = v[r].row();
        }

        let (first_reading, last_reading) = (splat(ray.readings[0]), splat(ray.readings[last]));
        let mut sums = [zero; R];
        for r in 0..R {
            let at_first = Eight::load(arithmetic, &displacement[0][r]) - first_reading;
            let at_last = y[r] - last_reading;
            // Zero, and not a number where the motion is not finite.
            let nothing = zero * y[r] + zero * v[r];
            sums[r] = half_weight * (at_first * at_first + at_last * at_last) + nothing;
        }
        let inner = displacement.iter().zip(ray.readings);
        for (rows, reading) in inner.take(last).skip(1) {
            let reading = splat(*reading);
            for r in 0..R {
                let residual = Eight::load(arithmetic, &rows[r]) - reading;
                sums[r] += weight * (residual * residual);
            }
        }
        let mut costs = [[0.0; LANES]; R];
        for r in 0..R {
            costs[r] = sums[r].row();
        }
        costs
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::quadrature::trapezoid;
    use crate::dynamics::{Device, Grid, Method, Oscillator, Term};

    /// A batch that is not worth sharing, and one that is.
    const NODES: [usize; 2] = [41, 241];

    /// Mass, damping and stiffness, and what is taken away from them.
    fn functions(nodes: usize) -> [[Vec<f64>; 3]; 2] {
        let of = |f: fn(f64) -> f64| -> Vec<f64> {
            (0..nodes)
                .map(|i| f(8.0 * i as f64 / nodes as f64))
                .collect()
        };
        [
            [
                of(|t| 2.0 + 0.3 * t.sin()),
                of(|t| 0.4 - 0.05 * t),
                of(|t| 3.0 + t.cos()),
            ],
            [
                of(|t| 1.0 + 0.1 * t),
                of(|t| 0.5 - 0.1 * t),
                of(|t| t.sin() - 0.5),
            ],
        ]
    }

    /// One by one, by the forward solve and the trapezoid rule: the motion and its cost.
    fn by_itself(ray: &Ray, length: f64) -> Option<(Trajectory, f64)> {
        let nodes = ray.readings.len();
        let oscillator = Oscillator {
            grid: Grid::new(0.0, ray.step * (nodes - 1) as f64, nodes).unwrap(),
            method: Method::Midpoint,
            terms: vec![Term::Damping, Term::Stiffness],
        };
        let [mass, damping, stiffness] = [0, 1, 2].map(|f| {
            let pairs = ray.functions[f].iter().zip(ray.direction[f]);
            pairs.map(|(p, g)| p - length * g).collect()
        });
        let device = Device {
            mass,
            coefficients: vec![damping, stiffness],
        };
        let motion = oscillator.forward(&device, ray.initial, None).ok()?;
        let pairs = motion.displacement.iter().zip(ray.readings);
        let squares: Vec<f64> = pairs.map(|(y, o)| (y - o) * (y - o)).collect();
        let cost = trapezoid(&squares, ray.spacing);
        Some((motion, cost))
    }

    #[test]
    fn every_trial_is_the_forward_solve_by_itself() {
        NODES.into_iter().for_each(every_trial);
    }

    fn every_trial(nodes: usize) {
        let [functions, direction] = functions(nodes);
        let readings: Vec<f64> = (0..nodes).map(|i| (0.3 * i as f64).cos()).collect();
        let ray = Ray {
            functions: functions.each_ref().map(Vec::as_slice),
            direction: direction.each_ref().map(Vec::as_slice),
            initial: State {
                displacement: 1.2,
                velocity: -0.7,
            },
            readings: &readings,
            step: 0.125,
            spacing: 0.125,
        };
        // One lane, part of a row, whole rows, and more rows than one batch has.
        for count in [1, 7, 8, 19, 32, 50] {
            // The longest leave no mass.
            let lengths: Vec<f64> = (1..=count).map(|i| 3.0 / i as f64).collect();
            let mut trials = Trials::default();
            let costs = trials.costs(ray, &lengths);
            assert_eq!(costs.len(), count);
            for (which, (&length, cost)) in lengths.iter().zip(costs).enumerate() {
                let Some((motion, expected)) = by_itself(&ray, length) else {
                    assert_eq!(cost, None, "trial {which} of {count}");
                    continue;
                };
                // The sums are in another order.
                let cost = cost.expect("a cost");
                assert!(
                    (cost / expected - 1.0).abs() < 1e-13,
                    "trial {which} of {count}: {cost} {expected}"
                );
                let mut stored = Trajectory::zeros(nodes);
                trials.motion_into(which, &mut stored);
                assert_eq!(stored, motion, "trial {which} of {count}");
            }
        }
    }
}
