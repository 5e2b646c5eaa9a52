//! Stability of explicit steps: the largest rate of the linear terms, and the number of nodes that it requires.

use super::{Method, NodalCoefficients, System, Term};

impl Method {
    /// Largest product of step and rate, `h |lambda|`, of a stable step, with a margin of a tenth. Decay is stable up to
    /// 2.785 (`rk4`) and 2 (`midpoint`), undamped oscillation with `rk4` up to 2.828. The midpoint rule amplifies undamped
    /// oscillations at every step, by `(h omega)^4 / 8`, which is part of its error.
    fn stability_limit(self) -> f64 {
        match self {
            Method::Midpoint => 1.8,
            Method::Rk4 => 2.5,
        }
    }
}

impl System {
    /// Smallest number of nodes with stable steps for mass, damping and stiffness of `nodal`.
    pub fn stable_nodes(&self, nodal: &NodalCoefficients) -> usize {
        let steps = self.grid.duration() * self.largest_rate(nodal) / self.method.stability_limit();
        // The cast saturates.
        (steps.ceil() as usize).saturating_add(1)
    }

    /// Smallest number of nodes with stable steps for Coulomb friction of this `width` (m/s): at rest it is a damping `F/width`, with
    /// the rate `F/(m width)`.
    pub fn nodes_for_friction(&self, nodal: &NodalCoefficients, width: f64) -> usize {
        let rate = self.friction_over_mass(nodal) / width;
        let steps = self.grid.duration() * rate / self.method.stability_limit();
        // The cast saturates.
        (steps.ceil() as usize).saturating_add(1)
    }

    /// Smallest width of Coulomb friction (m/s) with stable steps on `nodes` nodes.
    pub fn least_friction_width(&self, nodal: &NodalCoefficients, nodes: usize) -> f64 {
        let steps = nodes.saturating_sub(1).max(1) as f64;
        let force = self.friction_over_mass(nodal);
        self.grid.duration() * force / (self.method.stability_limit() * steps)
    }

    /// Largest ratio of Coulomb friction to mass at the nodes, N/kg; nodes where it is not finite are omitted.
    fn friction_over_mass(&self, nodal: &NodalCoefficients) -> f64 {
        let is_friction = |term: &Term| matches!(term, Term::CoulombFriction { .. });
        let Some(index) = self.terms.iter().position(is_friction) else {
            return 0.0;
        };
        let pairs = nodal.coefficients[index].iter().zip(&nodal.mass);
        let ratios = pairs.map(|(force, mass)| (force / mass).abs());
        ratios.filter(|ratio| ratio.is_finite()).fold(0.0, f64::max)
    }

    /// Largest magnitude of a root of `m lambda^2 + c lambda + k` at the nodes, 1/s; nodes where it is not finite are omitted.
    fn largest_rate(&self, nodal: &NodalCoefficients) -> f64 {
        let of = |wanted: Term| {
            let index = self.terms.iter().position(|term| *term == wanted);
            index.and_then(|index| nodal.coefficients.get(index))
        };
        let (damping, stiffness) = (of(Term::Damping), of(Term::Stiffness));
        let value = |f: Option<&Vec<f64>>, i: usize| f.map_or(0.0, |f| f[i]);
        let rates = (nodal.mass.iter().enumerate())
            .map(|(i, m)| rate(*m, value(damping, i), value(stiffness, i)));
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
    use crate::system::Grid;

    fn system(method: Method) -> System {
        System {
            grid: Grid::new(0.0, 2.0, 101).unwrap(),
            method,
            terms: vec![Term::Damping, Term::Stiffness],
        }
    }

    fn constant(m: f64, c: f64, k: f64) -> NodalCoefficients {
        NodalCoefficients {
            mass: vec![m; 101],
            coefficients: vec![vec![c; 101], vec![k; 101]],
        }
    }

    /// At rest a friction of 4 N on 2 kg over 0.01 m/s decays at 200 per second.
    #[test]
    fn the_number_of_nodes_for_friction_follows_from_its_rate_at_rest() {
        let mut rk4 = system(Method::Rk4);
        let mut nodal = constant(2.0, 0.0, 200.0);
        assert_eq!(rk4.nodes_for_friction(&nodal, 0.01), 1);
        rk4.terms.push(Term::CoulombFriction { width: 0.1 });
        nodal.coefficients.push(vec![4.0; 101]);
        assert_eq!(rk4.nodes_for_friction(&nodal, 0.01), 161);
        assert!((rk4.least_friction_width(&nodal, 161) - 0.01).abs() < 1e-15);
        assert_eq!(rk4.friction_width(), Some(0.1));
        rk4.set_friction_width(0.2);
        assert_eq!(rk4.friction_width(), Some(0.2));
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
