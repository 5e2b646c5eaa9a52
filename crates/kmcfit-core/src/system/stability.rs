//! Stability of explicit steps: the largest rate of the linear terms, and the number of nodes that it requires.

use super::{Law, Method, NodalCoefficients, System};

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
}

impl System {
    /// Smallest number of nodes with stable steps for the linear springs and dampers of `nodal`.
    pub fn stable_nodes(&self, nodal: &NodalCoefficients) -> usize {
        let steps = self.grid.duration() * self.largest_rate(nodal) / self.method.stability_limit();
        // The cast saturates.
        (steps.ceil() as usize).saturating_add(1)
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
    use crate::structure::Structure;
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
}
