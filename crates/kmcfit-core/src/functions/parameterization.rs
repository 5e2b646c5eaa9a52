//! Parameterization of a problem: all functions and scalars, with their parameters in one vector.

use super::{CoefficientFunction, CoefficientSet, Design, Gram, Prior, ScalarParameter};
use crate::simd::sum::largest_difference;
use crate::system::NodalCoefficients;
use crate::system::quadrature::{trapezoid, trapezoid_weights};
use std::ops::Range;

/// Coefficient functions and scalar parameters. Their parameters form one vector `theta`, functions first.
///
/// The first functions of the list are the shared coefficient set: mass, then one per force term. Further functions belong to
/// single experiments, where they replace a shared one, or are known parts: each coefficient set is a list of indices
/// ([`CoefficientSet`]).
#[derive(Debug, Clone)]
pub struct Parameterization {
    list: Vec<CoefficientFunction>,
    ranges: Vec<Range<usize>>,
    grams: Vec<Gram>,
    coefficient_sets: Vec<CoefficientSet>,
    scalars: Vec<ScalarParameter>,
    nodes: usize,
    step: f64,
    /// First node affected by each parameter of a function.
    first_nodes: Vec<u32>,
    /// True for constant functions.
    constant: Vec<bool>,
    /// Fixed part and single design entry of each function that is equal at all nodes.
    flat: Vec<Option<[f64; 2]>>,
}

impl Parameterization {
    /// Parameterization with `list` (mass first) on `nodes` nodes of step `step` (s) as the shared coefficient set; `None` if a basis
    /// is linearly dependent on the grid or the list is empty.
    pub fn new(list: Vec<CoefficientFunction>, nodes: usize, step: f64) -> Option<Self> {
        let main: Vec<usize> = (0..list.len()).collect();
        Self::with_coefficient_sets(list, vec![main], nodes, step)
    }

    /// [`Parameterization::new`] with several coefficient sets, the shared one first.
    ///
    /// # Panics
    /// If there is no coefficient set, or a set has an index outside the list or twice, or a known part of a coefficient that it does not have.
    pub fn with_coefficient_sets(
        list: Vec<CoefficientFunction>,
        coefficient_sets: Vec<impl Into<CoefficientSet>>,
        nodes: usize,
        step: f64,
    ) -> Option<Self> {
        let coefficient_sets: Vec<CoefficientSet> =
            coefficient_sets.into_iter().map(Into::into).collect();
        let indices = |set: &CoefficientSet| set.parts().map(|(_, f)| f).collect::<Vec<_>>();
        let sets: Vec<Vec<usize>> = coefficient_sets.iter().map(indices).collect();
        assert!(!sets.is_empty(), "at least the shared coefficient set");
        assert!(
            sets.iter().flatten().all(|f| *f < list.len()),
            "coefficient sets with functions of the list"
        );
        let has_places = |set: &CoefficientSet| {
            let mut positions = set.known_parts().iter();
            positions.all(|(position, _)| *position < set.len())
        };
        assert!(
            coefficient_sets.iter().all(has_places),
            "known parts of coefficients of their set"
        );
        let is_once = |nodal: &Vec<usize>| {
            let first = |f: &usize| nodal.iter().position(|g| g == f);
            nodal.iter().enumerate().all(|(i, f)| first(f) == Some(i))
        };
        assert!(
            sets.iter().all(is_once),
            "each function once in a coefficient set"
        );
        let weights = trapezoid_weights(nodes, step);
        let grams: Option<Vec<Gram>> = list
            .iter()
            .map(|f| Gram::new(&f.design, &weights))
            .collect();
        let mut ranges = Vec::with_capacity(list.len());
        let mut first = 0;
        for function in &list {
            let end = first + function.parameters();
            ranges.push(first..end);
            first = end;
        }
        (!list.is_empty()).then_some(())?;
        let mut first_nodes = vec![0; first];
        for (function, range) in list.iter().zip(&ranges) {
            let own = &mut first_nodes[range.clone()];
            for i in (0..nodes).rev() {
                let row = function.design.row(i);
                row.for_each(|(j, _)| own[j] = i as u32);
            }
        }
        Some(Self {
            constant: list.iter().map(|f| f.design.is_constant()).collect(),
            flat: list.iter().map(CoefficientFunction::flat).collect(),
            first_nodes,
            list,
            ranges,
            grams: grams?,
            coefficient_sets,
            scalars: Vec::new(),
            nodes,
            step,
        })
    }

    /// Adds scalar parameters.
    #[must_use]
    pub fn with_scalars(mut self, scalars: Vec<ScalarParameter>) -> Self {
        self.scalars = scalars;
        self
    }

    /// Scalar parameters.
    pub fn scalars(&self) -> &[ScalarParameter] {
        &self.scalars
    }

    /// True without a function of several parameters.
    pub fn are_constants(&self) -> bool {
        self.iter().all(|f| f.parameters() <= 1)
    }

    /// Range of the scalars in `theta`.
    pub fn scalar_range(&self) -> Range<usize> {
        let first = self.function_parameters();
        first..first + self.scalars.len()
    }

    /// Coefficient sets; the first is the shared one.
    pub fn coefficient_sets(&self) -> &[CoefficientSet] {
        &self.coefficient_sets
    }

    /// Coefficient set `set`.
    pub fn coefficient_set(&self, set: usize) -> &CoefficientSet {
        &self.coefficient_sets[set]
    }

    /// Priors, with the indices of their parameters: of known values with a standard deviation, then of scalars.
    pub fn priors(&self) -> impl Iterator<Item = (usize, Prior)> + '_ {
        let functions = self.list.iter().zip(&self.ranges);
        let of_functions = functions.filter_map(|(f, range)| Some((range.start, f.prior?)));
        let scalars = self.scalar_range().zip(&self.scalars);
        of_functions.chain(scalars.filter_map(|(index, scalar)| Some((index, scalar.prior?))))
    }

    /// Sum of `((x - mean) / sigma)^2` of all priors at the parameters `theta`.
    pub(crate) fn prior_cost(&self, theta: &[f64]) -> f64 {
        self.priors().map(|(i, prior)| prior.price(theta[i])).sum()
    }

    /// Function `index` of the list.
    ///
    /// # Panics
    /// If there is no such function.
    pub fn get(&self, index: usize) -> &CoefficientFunction {
        &self.list[index]
    }

    /// The Gram matrix of function `index` of the list.
    ///
    /// # Panics
    /// If there is no such function.
    pub(crate) fn gram(&self, index: usize) -> &Gram {
        &self.grams[index]
    }

    /// All functions: those of the shared coefficient set, mass first, then those of single experiments.
    pub fn iter(&self) -> impl Iterator<Item = &CoefficientFunction> {
        self.list.iter()
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// Number of parameters, scalars included.
    pub fn parameters(&self) -> usize {
        self.function_parameters() + self.scalars.len()
    }

    fn function_parameters(&self) -> usize {
        self.ranges.last().map_or(0, |r| r.end)
    }

    /// Range of each function's parameters in `theta`.
    pub fn ranges(&self) -> &[Range<usize>] {
        &self.ranges
    }

    /// First node affected by each parameter; 0 for scalars.
    pub fn first_nodes(&self) -> Vec<u32> {
        let mut first = self.first_nodes.clone();
        first.resize(self.parameters(), 0);
        first
    }

    /// True if function `index` is equal at all nodes for every parameter value.
    pub fn is_constant(&self, index: usize) -> bool {
        self.constant[index]
    }

    /// Largest change at any node of function `index` between the parameters `from` and `after`.
    pub(crate) fn largest_change(&self, index: usize, from: &[f64], after: &[f64]) -> f64 {
        let design = &self.list[index].design;
        if matches!(design, Design::Identity) {
            return largest_difference(after, from);
        }
        let delta: Vec<f64> = after.iter().zip(from).map(|(a, b)| a - b).collect();
        match (self.flat[index], delta.as_slice()) {
            (Some([_, entry]), [delta]) => (entry * delta).abs(),
            (_, delta) => design.largest(delta),
        }
    }

    /// True if function `index` is constant or fixed.
    pub fn is_constant_or_known(&self, index: usize) -> bool {
        self.constant[index] || matches!(self.list[index].design, Design::Empty)
    }

    /// Start parameters.
    pub fn start(&self) -> Vec<f64> {
        let functions = self.list.iter().flat_map(|f| f.start.iter().copied());
        functions
            .chain(self.scalars.iter().map(|s| s.start))
            .collect()
    }

    /// The start with the parameters `theta` of another parameterisation in the functions and scalars of the same name and number.
    pub fn start_at(&self, other: &Self, theta: &[f64]) -> Vec<f64> {
        self.start_of(&other.named(theta))
    }

    /// Functions and scalars by name with their parameters.
    pub fn named(&self, theta: &[f64]) -> Vec<(String, Vec<f64>)> {
        let functions = self.list.iter().map(CoefficientFunction::name);
        let functions = functions.zip(self.ranges.iter().cloned());
        let scalars = self.scalars.iter().map(|scalar| scalar.name.clone());
        let scalars = scalars.zip(self.scalar_range().map(|i| i..i + 1));
        let all = functions.chain(scalars);
        all.map(|(name, range)| (name, theta[range].to_vec()))
            .collect()
    }

    /// The start with the parameters of functions and scalars of the same name and number.
    pub fn start_of(&self, named: &[(String, Vec<f64>)]) -> Vec<f64> {
        let own = self.named(&self.start()).into_iter();
        let values = own.flat_map(|(name, start)| {
            let same = |(other, values): &&(String, Vec<f64>)| {
                *other == name && values.len() == start.len()
            };
            let other = named.iter().find(same).map(|(_, values)| values.clone());
            other.unwrap_or(start)
        });
        values.collect()
    }

    /// Sets the start.
    ///
    /// # Panics
    /// If `theta` has a wrong number of parameters.
    pub fn set_start(&mut self, theta: &[f64]) {
        assert_eq!(theta.len(), self.parameters(), "one start per parameter");
        for (function, range) in self.list.iter_mut().zip(&self.ranges) {
            function.start.copy_from_slice(&theta[range.clone()]);
        }
        let scalars = self.scalar_range();
        for (scalar, start) in self.scalars.iter_mut().zip(&theta[scalars]) {
            scalar.start = *start;
        }
    }

    /// Nodal coefficients of the right shape, all zero.
    pub fn empty_nodal(&self) -> NodalCoefficients {
        let set = &self.coefficient_sets[0];
        NodalCoefficients::zeros(self.nodes, set.inertias(), set.len() - set.inertias())
    }

    /// Nodal values of the shared coefficient set at the parameters `theta`.
    pub fn nodal(&self, theta: &[f64]) -> NodalCoefficients {
        let mut nodal = self.empty_nodal();
        self.nodal_into(theta, 0, &mut nodal);
        nodal
    }

    /// Computes the nodal values of coefficient set `which` at the parameters `theta`, in existing storage.
    pub fn nodal_into(&self, theta: &[f64], which: usize, nodal: &mut NodalCoefficients) {
        for (&f, values) in self.coefficient_sets[which]
            .iter()
            .zip(nodal.functions_mut())
        {
            let theta = &theta[self.ranges[f].clone()];
            match (self.flat[f], theta) {
                (Some([offset, entry]), [theta]) => values.fill(offset + entry * theta),
                _ => self.list[f].values_into(theta, values),
            }
        }
        for &(position, f) in self.coefficient_sets[which].known_parts() {
            let values = nodal.functions_mut().nth(position);
            let values = values.expect("a coefficient for each known part");
            let part = &self.list[f];
            (values.iter_mut().zip(part.offset.iter())).for_each(|(value, known)| *value += known);
            part.design
                .multiply_add(&theta[self.ranges[f].clone()], values);
        }
    }

    /// Nodal values of all functions of the list at the parameters `theta`.
    pub fn values(&self, theta: &[f64]) -> Vec<Vec<f64>> {
        let each = self.ranges.iter().enumerate().map(|(index, range)| {
            let mut values = vec![0.0; self.nodes];
            self.list[index].values_into(&theta[range.clone()], &mut values);
            values
        });
        each.collect()
    }

    /// Values of all functions of the list at some nodes.
    pub(crate) fn values_at(&self, theta: &[f64], nodes: &[usize]) -> Vec<Vec<f64>> {
        let each = self.list.iter().zip(&self.ranges).map(|(function, range)| {
            let theta = &theta[range.clone()];
            let values = nodes.iter().map(|i| function.value_at(theta, *i));
            values.collect()
        });
        each.collect()
    }

    /// Linear part `B theta` of coefficient set `which`, without fixed parts: its change along a direction.
    pub fn direction(&self, theta: &[f64], which: usize) -> NodalCoefficients {
        let mut nodal = self.empty_nodal();
        for (position, f) in self.coefficient_sets[which].parts() {
            let values = nodal.functions_mut().nth(position);
            let values = values.expect("a coefficient for each part");
            let range = self.ranges[f].clone();
            self.list[f].design.multiply_add(&theta[range], values);
        }
        nodal
    }

    /// Adds `B^T` times the nodal values of coefficient set `which` to `out`, which converts Euclidean gradients from nodal values
    /// to parameters.
    pub fn add_transpose(&self, nodal: &NodalCoefficients, which: usize, out: &mut [f64]) {
        let values: Vec<&[f64]> = nodal.functions().collect();
        for (position, f) in self.coefficient_sets[which].parts() {
            let values = values[position];
            let out = &mut out[self.ranges[f].clone()];
            self.list[f].design.transpose_multiply_add(values, out);
        }
    }

    /// [`Parameterization::add_transpose`] of the shared coefficient set, added to zero.
    pub fn transpose(&self, nodal: &NodalCoefficients) -> Vec<f64> {
        let mut out = vec![0.0; self.parameters()];
        self.add_transpose(nodal, 0, &mut out);
        out
    }

    /// Length of the record, s, the weight of a scalar; it equals that of a constant function of the same value.
    fn duration(&self) -> f64 {
        self.step * (self.nodes - 1) as f64
    }

    /// Diagonal of `G`: squared L2 norms of the basis functions, s; the length of the record for scalars.
    pub fn gram_diagonal(&self) -> Vec<f64> {
        let scalars = self.scalars.iter().map(|_| self.duration());
        let functions = self.grams.iter().flat_map(Gram::diagonal);
        functions.chain(scalars).collect()
    }

    /// Diagonal of `sum_f 1/T integral (p_f / size_f)^2 dt + sum_s (x_s / size_s)^2` in the parameters, with a size for each
    /// function of the list and `T = duration`. A size of zero is replaced by the largest size.
    pub fn relative_metric(&self, sizes: &[f64], duration: f64) -> Vec<f64> {
        let largest = sizes
            .iter()
            .copied()
            .fold(f64::MIN_POSITIVE.sqrt(), f64::max);
        let mut metric = self.gram_diagonal();
        for (range, size) in self.ranges.iter().zip(sizes) {
            let size = if *size > 0.0 { *size } else { largest };
            for g in &mut metric[range.clone()] {
                *g /= duration * size * size;
            }
        }
        let scalars = self.scalar_range();
        for (g, scalar) in metric[scalars].iter_mut().zip(&self.scalars) {
            *g = 1.0 / (scalar.size * scalar.size);
        }
        metric
    }

    /// Product `G theta`, functions and scalars.
    pub fn gram_multiply(&self, theta: &[f64]) -> Vec<f64> {
        let mut out = self.each_gram(theta, Gram::multiply);
        let scalars = self.scalar_range();
        for (out, x) in out[scalars.clone()].iter_mut().zip(&theta[scalars]) {
            *out = x * self.duration();
        }
        out
    }

    /// Solution `G^-1 dual`, functions and scalars.
    pub fn gram_solve(&self, dual: &[f64]) -> Vec<f64> {
        let mut out = self.each_gram(dual, Gram::solve);
        let scalars = self.scalar_range();
        for (out, x) in out[scalars.clone()].iter_mut().zip(&dual[scalars]) {
            *out = x / self.duration();
        }
        out
    }

    fn each_gram(&self, input: &[f64], apply: fn(&Gram, &[f64], &mut [f64])) -> Vec<f64> {
        let mut out = vec![0.0; input.len()];
        for (gram, range) in self.grams.iter().zip(&self.ranges) {
            apply(gram, &input[range.clone()], &mut out[range.clone()]);
        }
        out
    }

    /// Squared norm `integral sum_j (B_j theta_j)^2 dt` by the trapezoid rule, plus `T x^2` for each scalar: G^2 of the paper if
    /// `theta` is the L2 gradient. Nodal functions are summed node by node.
    pub fn norm_squared(&self, theta: &[f64]) -> f64 {
        let mut squares = Vec::new();
        let mut others = 0.0;
        let list = self.list.iter().zip(&self.grams);
        for ((function, gram), range) in list.zip(&self.ranges) {
            let theta = &theta[range.clone()];
            if !matches!(function.design, Design::Identity) {
                others += gram.square(theta);
                continue;
            }
            squares.resize(self.nodes, 0.0);
            for (sum, value) in squares.iter_mut().zip(theta) {
                *sum += value * value;
            }
        }
        let scalars = theta[self.scalar_range()].iter().map(|x| x * x);
        let functions = others + trapezoid(&squares, self.step);
        match self.scalars.is_empty() {
            true => functions,
            false => functions + self.duration() * scalars.sum::<f64>(),
        }
    }
}
