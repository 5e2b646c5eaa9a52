//! The equation of motion at the stages of a step, for any number type.

use super::tableau::{At, Tableau};
use crate::simd::{Arithmetic, Eight, LANES, Real, window};
use crate::structure::{Law, Link};

/// Displacements and velocities of the coordinates.
pub(crate) type Pair<T, const N: usize> = [[T; N]; 2];

/// Values of a function of time at the left end, the middle and the right end of each step.
pub(crate) type AtStages<'a> = [&'a [f64]; 3];

/// Force on a coordinate (N) and acceleration of its frame (m/s^2).
#[derive(Clone, Copy, Default)]
pub(crate) struct Drive<'a> {
    pub force: Option<AtStages<'a>>,
    pub base: Option<AtStages<'a>>,
}

/// A structure of `N` coordinates and up to `E` elements over a record, with a method of `S` stages.
#[derive(Clone, Copy)]
pub(crate) struct Model<'a, const N: usize, const E: usize, const S: usize> {
    pub tableau: &'a Tableau<S>,
    pub elements: Elements<'a, N, E>,
    /// Nodal values.
    pub masses: [&'a [f64]; N],
    /// Nodal values; empty for zero.
    pub coefficients: [&'a [f64]; E],
    /// `None` for a free response.
    pub drives: Option<[Drive<'a>; N]>,
    /// Step, s.
    pub dt: f64,
}

/// One coordinate with a damper and a spring.
pub(crate) const LINEAR: &[Link] = &[Link::grounded(Law::Damping), Link::grounded(Law::Stiffness)];
/// The same with a cubic spring.
pub(crate) const DUFFING: &[Link] = &[
    Link::grounded(Law::Damping),
    Link::grounded(Law::Stiffness),
    Link::grounded(Law::CubicStiffness),
];

/// Up to `E` elements of `N` coordinates. Two and three of one coordinate are [`LINEAR`] and [`DUFFING`], known to the compiler, which unrolls
/// their loops.
#[derive(Clone, Copy)]
pub(crate) struct Elements<'a, const N: usize, const E: usize>(&'a [Link]);

impl<'a, const N: usize, const E: usize> Elements<'a, N, E> {
    const KNOWN: Option<&'static [Link]> = match (N, E) {
        (1, 2) => Some(LINEAR),
        (1, 3) => Some(DUFFING),
        _ => None,
    };

    /// # Panics
    /// If there are more than `E`, or others than the known ones.
    pub fn new(list: &'a [Link]) -> Self {
        let is_known = Self::KNOWN.is_none_or(|known| known == list);
        assert!(is_known && list.len() <= E, "a list of its own");
        Self(list)
    }
}

impl<'a, const N: usize, const E: usize, const S: usize> Model<'a, N, E, S> {
    #[inline(always)]
    pub fn elements(&self) -> &'a [Link] {
        match Elements::<N, E>::KNOWN {
            Some(known) => known,
            None => self.elements.0,
        }
    }

    /// True if no function changes from node `from` to the end of the second group of eight steps: the matrices of both groups are
    /// equal where the structure is linear.
    #[inline(always)]
    pub fn is_constant(&self, from: usize) -> bool {
        let mut is_constant = true;
        for values in self.masses.iter().chain(&self.coefficients) {
            match values.get(from..).and_then(<[f64]>::first_chunk) {
                Some(two_groups) => {
                    let [first, others @ ..]: &[f64; 2 * LANES + 1] = two_groups;
                    for value in others {
                        is_constant &= value.to_bits() == first.to_bits();
                    }
                }
                None => is_constant &= values.is_empty(),
            }
        }
        is_constant
    }

    #[inline(always)]
    fn nodal(&self, function: Function) -> &'a [f64] {
        match function {
            Function::Mass(j) => self.masses[j],
            Function::Coefficient(e) => self.coefficients[e],
        }
    }
}

/// A function of a model: the mass of a coordinate, or the coefficient of an element.
#[derive(Clone, Copy)]
pub(crate) enum Function {
    Mass(usize),
    Coefficient(usize),
}

/// Values of a model's functions in a step; of eight steps or trials, in lanes. Methods, as closures would not be compiled for the
/// instructions of the lanes.
pub(crate) trait Values<T: Real, const N: usize> {
    /// Value at the left node (side 0) or the right node.
    fn value(&self, function: Function, side: usize) -> T;

    /// Forces, and accelerations of the frames.
    fn drives(&self, at: At) -> Option<[[T; N]; 2]>;

    /// Value at a stage: the mean at the half step.
    #[inline(always)]
    fn at(&self, function: Function, at: At) -> T {
        match at {
            At::Left => self.value(function, 0),
            At::Middle => (self.value(function, 1) + self.value(function, 0)).scale(0.5),
            At::Right => self.value(function, 1),
        }
    }
}

/// Values from index `i` of eight neighbours; the last one repeated past the end.
#[inline(always)]
pub(crate) fn eight<A: Arithmetic>(arithmetic: A, values: &[f64], i: usize) -> Eight<A> {
    match values.get(i..).and_then(<[f64]>::first_chunk) {
        Some(row) => Eight::load(arithmetic, row),
        None => Eight::load(arithmetic, &window(values, i)),
    }
}

/// The steps `i` to `i + 7` of a model, one per lane; lanes past the end have values near it.
pub(crate) struct EightSteps<'a, A, const N: usize, const E: usize, const S: usize>(
    pub A,
    pub Model<'a, N, E, S>,
    pub usize,
);

impl<A: Arithmetic, const N: usize, const E: usize, const S: usize> Values<Eight<A>, N>
    for EightSteps<'_, A, N, E, S>
{
    #[inline(always)]
    fn value(&self, function: Function, side: usize) -> Eight<A> {
        match self.1.nodal(function) {
            [] => Eight::splat(self.0, 0.0),
            values => eight(self.0, values, self.2 + side),
        }
    }

    #[inline(always)]
    fn drives(&self, at: At) -> Option<[[Eight<A>; N]; 2]> {
        let drives = self.1.drives?;
        let mut all = [[Eight::splat(self.0, 0.0); N]; 2];
        for j in 0..N {
            if let Some(force) = drives[j].force {
                all[0][j] = eight(self.0, force[at as usize], self.2);
            }
            if let Some(base) = drives[j].base {
                all[1][j] = eight(self.0, base[at as usize], self.2);
            }
        }
        Some(all)
    }
}

/// Values at one stage.
#[derive(Clone, Copy)]
pub(crate) struct Stage<T, const N: usize, const E: usize> {
    pub inverse_masses: [T; N],
    pub p: [T; E],
    /// Forces, and accelerations of the frames.
    pub drives: Option<[[T; N]; 2]>,
}

impl<T: Real, const N: usize, const E: usize> Stage<T, N, E> {
    #[inline(always)]
    pub fn read(values: &impl Values<T, N>, elements: usize, at: At) -> Self {
        let first = values.at(Function::Mass(0), at);
        let (one, zero) = (first.like(1.0), first.like(0.0));
        let (mut inverse_masses, mut p) = ([one / first; N], [zero; E]);
        for j in 1..N {
            inverse_masses[j] = one / values.at(Function::Mass(j), at);
        }
        for (e, p) in p.iter_mut().enumerate().take(elements) {
            *p = values.at(Function::Coefficient(e), at);
        }
        let drives = values.drives(at);
        Stage {
            inverse_masses,
            p,
            drives,
        }
    }

    /// Accelerations `(f - sum_e row_e p_e phi_e)/m - b''`, each force by itself, and the forces `phi_e`.
    #[inline(always)]
    pub fn accelerations(&self, elements: &[Link], q: &[T; N], v: &[T; N]) -> ([T; N], [T; E]) {
        let zero = q[0].like(0.0);
        let (mut a, mut all) = ([zero; N], [zero; E]);
        if let Some([forces, _]) = &self.drives {
            for j in 0..N {
                a[j] = forces[j] * self.inverse_masses[j];
            }
        }
        for (e, element) in elements.iter().enumerate().take(E).rev() {
            let phi = element.law.phi(element.across(q), element.across(v));
            all[e] = phi;
            let force = self.p[e] * phi;
            let (i, to) = element.ends::<N>();
            a[i] = a[i] - force * self.inverse_masses[i];
            if let Some(j) = to {
                a[j] = a[j] + force * self.inverse_masses[j];
            }
        }
        if let Some([_, bases]) = &self.drives {
            for j in 0..N {
                a[j] = a[j] - bases[j];
            }
        }
        (a, all)
    }

    /// Derivatives of the elements' forces with respect to elongation and rate; `None` for zero.
    #[inline(always)]
    pub fn slopes(&self, elements: &[Link], q: &[T; N], v: &[T; N]) -> [[Option<T>; 2]; E] {
        let mut all = [[None; 2]; E];
        for (e, element) in elements.iter().enumerate().take(E) {
            let slopes = element.law.slopes(element.across(q), element.across(v));
            for k in 0..2 {
                if let Some(slope) = slopes[k] {
                    all[e][k] = Some(self.p[e] * slope);
                }
            }
        }
        all
    }

    /// Derivatives of the accelerations with respect to displacements and velocities, from [`Self::slopes`].
    #[inline(always)]
    pub fn matrices(
        &self,
        elements: &[Link],
        slopes: &[[Option<T>; 2]; E],
        matrices: &mut [[[T; N]; N]; 2],
        zero: T,
    ) {
        *matrices = [[[zero; N]; N]; 2];
        for (e, element) in elements.iter().enumerate().take(E) {
            let (i, to) = element.ends::<N>();
            for k in 0..2 {
                let Some(slope) = slopes[e][k] else { continue };
                let d = &mut matrices[k];
                let at_i = slope * self.inverse_masses[i];
                d[i][i] = d[i][i] - at_i;
                if let Some(j) = to {
                    let at_j = slope * self.inverse_masses[j];
                    d[i][j] = d[i][j] + at_i;
                    d[j][i] = d[j][i] + at_j;
                    d[j][j] = d[j][j] - at_j;
                }
            }
        }
    }
}

/// Accelerations at the stages of a step. Closures would not be compiled for the instructions of the lanes.
pub(crate) trait Stages<T, const N: usize> {
    fn accelerations(&mut self, s: usize, q: &[T; N], v: &[T; N]) -> [T; N];
}

/// `x + h d`.
#[inline(always)]
pub(crate) fn ahead<T: Real, const N: usize>(x: &[T; N], h: f64, d: &[T; N]) -> [T; N] {
    let mut y = *x;
    for j in 0..N {
        y[j] = x[j] + d[j].scale(h);
    }
    y
}

/// Increment of the state in one step.
#[inline(always)]
pub(crate) fn increment<T: Real, const N: usize, const S: usize>(
    tableau: &Tableau<S>,
    dt: f64,
    x: &Pair<T, N>,
    stages: &mut impl Stages<T, N>,
) -> Pair<T, N> {
    let [mut q, mut v] = *x;
    let mut sum: Option<Pair<T, N>> = None;
    for s in 0..S {
        let a = stages.accelerations(s, &q, &v);
        if tableau.end[s] != 0.0 {
            let h = dt * tableau.end[s];
            let mut d = [v, a];
            for k in 0..2 {
                for j in 0..N {
                    d[k][j] = d[k][j].scale(h);
                    if let Some(sum) = &sum {
                        d[k][j] = sum[k][j] + d[k][j];
                    }
                }
            }
            sum = Some(d);
        }
        if s + 1 < S {
            let h = dt * tableau.next[s];
            (q, v) = (ahead(&x[0], h, &v), ahead(&x[1], h, &a));
        }
    }
    sum.unwrap_or(*x)
}

/// The equation of motion in one step.
struct OneStep<'a, V, const E: usize, const S: usize> {
    tableau: &'a Tableau<S>,
    elements: &'a [Link],
    values: &'a V,
}

impl<T: Real, V: Values<T, N>, const N: usize, const E: usize, const S: usize> Stages<T, N>
    for OneStep<'_, V, E, S>
{
    #[inline(always)]
    fn accelerations(&mut self, s: usize, q: &[T; N], v: &[T; N]) -> [T; N] {
        let at = self.tableau.at[s];
        let stage = Stage::<T, N, E>::read(self.values, self.elements.len(), at);
        stage.accelerations(self.elements, q, v).0
    }
}

/// State after one step.
#[inline(always)]
pub(crate) fn step<T: Real, const N: usize, const E: usize, const S: usize>(
    tableau: &Tableau<S>,
    elements: &[Link],
    dt: f64,
    values: &impl Values<T, N>,
    x: &Pair<T, N>,
) -> Pair<T, N> {
    let mut motion = OneStep::<_, E, S> {
        tableau,
        elements,
        values,
    };
    let [dq, dv] = increment(tableau, dt, x, &mut motion);
    [ahead(&x[0], 1.0, &dq), ahead(&x[1], 1.0, &dv)]
}
