//! Stability of explicit steps: the largest rate of the linear terms, and the number of nodes that it requires.

use super::{Law, Method, NodalCoefficients, System};
use nalgebra::Complex;

/// Growth over the record, by the steps alone, from which on they are unstable.
const GROWTH: f64 = 1e3;

impl Method {
    /// Largest product of step and rate, `h |lambda|`, of a stable step, with a margin of a tenth. Decay is stable up to
    /// 2.785 (`rk4`) and 2 (`midpoint`), undamped oscillation with `rk4` up to 2.828. The midpoint rule amplifies undamped
    /// oscillations at every step, by `(h omega)^4 / 8`, which is part of its error. The implicit rule is stable with every step.
    pub(crate) fn stability_limit(self) -> f64 {
        match self {
            Method::Midpoint => 1.8,
            Method::Rk4 => 2.5,
            Method::ImplicitMidpoint => f64::INFINITY,
        }
    }

    /// The factor of a solution `exp(lambda t)` in one step, with `z = h lambda`.
    fn factor(self, z: Complex<f64>) -> Complex<f64> {
        let second = (z / 2.0 + 1.0) * z + 1.0;
        match self {
            Method::Midpoint => second,
            Method::Rk4 => second + (z / 4.0 + 1.0) * z * z * z / 6.0,
            Method::ImplicitMidpoint => (z / 2.0 + 1.0) / (-z / 2.0 + 1.0),
        }
    }
}

impl System {
    /// Smallest number of nodes with stable steps for the linear springs and dampers of `nodal`.
    pub fn stable_nodes(&self, nodal: &NodalCoefficients) -> usize {
        let steps = self.grid.duration() * self.largest_rate(nodal) / self.method.stability_limit();
        // The cast saturates.
        (steps.ceil() as usize).saturating_add(1)
    }

    /// True where steps beyond the limit of stability let a motion with the linear springs and dampers of `nodal` grow over some nodes by more
    /// than [`GROWTH`] beyond its own growth, the largest step left out. Steps beyond the limit at single nodes, between nodes at which the
    /// motion decays, or by a bound alone, need not.
    pub fn is_unstable(&self, nodal: &NodalCoefficients) -> bool {
        let (step, limit) = (self.grid.step(), self.method.stability_limit());
        if step * self.largest_rate(nodal) <= limit {
            return false;
        }
        let growth = |i: usize| {
            let values: Vec<f64> = nodal.functions().map(|f| f[i]).collect();
            let rates = self.structure.rates(&values);
            let own = rates.iter().fold(0.0, |most: f64, rate| most.max(rate.re));
            let factor = |rate: &Complex<f64>| self.method.factor(rate * step).norm();
            let growth = rates.iter().map(factor).fold(0.0, f64::max).ln() - step * own;
            // What a method adds within its limit is part of its error.
            let is_within = rates.iter().all(|rate| (rate * step).norm() <= limit);
            match is_within {
                true => growth.min(0.0),
                false => growth,
            }
        };
        let (mut sum, mut largest) = (0.0f64, 0.0f64);
        (0..self.grid.nodes()).map(growth).any(|growth| {
            (sum, largest) = match sum + growth > 0.0 {
                true => (sum + growth, largest.max(growth)),
                false => (0.0, 0.0),
            };
            sum - largest > GROWTH.ln()
        })
    }

    /// Of one coordinate the largest magnitude of a root of `m lambda^2 + c lambda + k` at the nodes, 1/s, where nodes at which it is not finite
    /// are omitted; of several ones a bound ([`Structure::largest_rate`](crate::structure::Structure::largest_rate)).
    fn largest_rate(&self, nodal: &NodalCoefficients) -> f64 {
        if !self.structure.is_one() {
            let rate = self.structure.largest_rate_of(nodal.functions());
            return rate.unwrap_or(0.0);
        }
        let sum = |is_meant: fn(&Law) -> bool, i: usize| -> f64 {
            let terms = self.laws().iter().zip(&nodal.coefficients);
            let values = terms.filter(|(law, _)| is_meant(law)).map(|(_, p)| p[i]);
            values.sum()
        };
        let rates = (nodal.inertias[0].iter().enumerate()).map(|(i, m)| {
            let damping = sum(|law| *law == Law::Damping, i);
            // A spring beyond a gap acts in part of the motion.
            let stiffness = sum(|law| matches!(law, Law::Stiffness | Law::Gap { .. }), i);
            rate(*m, damping, stiffness)
        });
        rates.filter(|rate| rate.is_finite()).fold(0.0, f64::max)
    }
}

/// Largest magnitude of a root of `m lambda^2 + c lambda + k`.
fn rate(m: f64, c: f64, k: f64) -> f64 {
    let (half, square) = (0.5 * c / m, k / m);
    let discriminant = half * half - square;
    match discriminant < 0.0 {
        true => square.sqrt(),
        false => half.abs() + discriminant.sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::{Ends, Structure};
    use crate::system::Grid;

    fn system(method: Method) -> System {
        System {
            grid: Grid::new(0.0, 2.0, 101).unwrap(),
            method,
            structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
        }
    }

    fn constant(m: f64, c: f64, k: f64) -> NodalCoefficients {
        NodalCoefficients {
            inertias: vec![vec![m; 101]],
            coefficients: vec![vec![c; 101], vec![k; 101]],
        }
    }

    /// Decay rates of 2 and 498 per second, and oscillation at 10 rad/s.
    #[test]
    fn the_number_of_nodes_follows_from_the_largest_rate() {
        let rk4 = system(Method::Rk4);
        assert_eq!(rk4.stable_nodes(&constant(1.0, 500.0, 996.0)), 400);
        assert_eq!(rk4.stable_nodes(&constant(2.0, 0.0, 200.0)), 9);
        let midpoint = system(Method::Midpoint);
        assert_eq!(midpoint.stable_nodes(&constant(2.0, 0.0, 200.0)), 13);
        assert_eq!(rk4.stable_nodes(&constant(0.0, 1.0, 1.0)), 1);
    }

    /// Steps of 0.02 s: undamped oscillation at the limits of both methods, decay at that of `rk4`, growth of the system itself, and a single
    /// node with a large stiffness.
    #[test]
    fn steps_are_unstable_where_they_let_a_motion_grow() {
        let is_unstable = |method, m, c, k| system(method).is_unstable(&constant(m, c, k));
        let square = |rate: f64| rate * rate / 4e-4;
        assert!(!is_unstable(Method::Rk4, 2.0, 0.0, 2.0 * square(2.82)));
        assert!(is_unstable(Method::Rk4, 2.0, 0.0, 2.0 * square(2.9)));
        assert!(!is_unstable(Method::Rk4, 1.0, 2.7 / 0.02, 1.0));
        assert!(is_unstable(Method::Rk4, 1.0, 3.0 / 0.02, 1.0));
        assert!(!is_unstable(Method::Midpoint, 1.0, 0.0, square(1.7)));
        assert!(is_unstable(Method::Midpoint, 1.0, 0.0, square(1.9)));
        assert!(!is_unstable(Method::Rk4, 1.0, 0.0, -square(3.0)));
        assert!(!is_unstable(
            Method::ImplicitMidpoint,
            1.0,
            0.0,
            square(50.0)
        ));
        let mut nodal = constant(1.0, 0.0, 1.0);
        nodal.coefficients[1][50] = square(4.0);
        assert!(!system(Method::Rk4).is_unstable(&nodal));
        nodal.coefficients[1][100] = square(1e3);
        assert!(!system(Method::Rk4).is_unstable(&nodal));
        // Between the nodes of a large stiffness the motion decays by more than it grows there.
        let mut nodal = constant(1.0, 60.0, 100.0);
        (0..101)
            .step_by(20)
            .for_each(|i| nodal.coefficients[1][i] = square(4.0));
        assert!(!system(Method::Rk4).is_unstable(&nodal));
    }

    /// Critical damping: the dampers alone would be unstable, which is the bound of the rates.
    #[test]
    fn a_bound_of_the_rates_refuses_nothing() {
        let coordinates =
            (0..2).flat_map(|j| [Law::Damping, Law::Stiffness].map(|law| (law, Ends::ground(j))));
        let inertias = vec![Ends::ground(0), Ends::ground(1)];
        let structure = Structure::new(2, 0, inertias, coordinates.collect()).unwrap();
        let two = System {
            structure,
            ..system(Method::Rk4)
        };
        let nodal = |rate: f64| {
            let both = [vec![2.0 * rate; 101], vec![rate * rate; 101]];
            NodalCoefficients {
                inertias: vec![vec![1.0; 101]; 2],
                coefficients: [both.clone(), both].concat(),
            }
        };
        assert!(two.stable_nodes(&nodal(75.0)) > 101);
        assert!(!two.is_unstable(&nodal(75.0)));
        assert!(two.is_unstable(&nodal(150.0)));
    }
}
