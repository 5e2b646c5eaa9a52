//! A structure as one table of inertias and elements.

use super::banded::Banded;
use super::{Ends, Law, Link, MOST_ELEMENTS};
use nalgebra::{Complex, DMatrix};
use thiserror::Error;

/// A structure of any number of coordinates:
///
/// ```text
/// sum_r b_r m_r(t) b_r (q'' + g'') + sum_e b_e p_e(t) phi_e(b_e q, b_e q') = f(t)
/// ```
///
/// with the coordinates `q` (m or rad), relative to frames that move by `g`, and supports whose motion is given; the rows `b` are [`Ends`].
/// Its functions of time are the inertias `m_r` (kg), then the coefficients `p_e` of the elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Structure {
    coordinates: usize,
    supports: usize,
    inertias: Vec<Ends>,
    laws: Vec<Law>,
    /// Rows of the elements.
    ends: Vec<Ends>,
    /// Places in a banded matrix, and values there, of `b b^T` for the row of each inertia and element.
    patterns: Vec<Vec<(usize, f64)>>,
    bandwidth: usize,
    /// Elements of a structure whose steps are compiled: of one coordinate with its mass, without supports.
    links: Option<Vec<Link>>,
}

/// A structure that cannot be made.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum StructureError {
    /// There is no coordinate.
    #[error("a structure has at least one coordinate")]
    Empty,
    /// An end is neither a coordinate nor a support.
    #[error(
        "end {index} of function {function}: there are {coordinates} coordinates and {supports} supports"
    )]
    UnknownEnd {
        /// Index of the function, inertias first.
        function: usize,
        /// Index of the end.
        index: usize,
        /// Number of coordinates.
        coordinates: usize,
        /// Number of supports.
        supports: usize,
    },
    /// An inertia or element acts on no coordinate.
    #[error("function {0} acts on no coordinate")]
    Unattached(usize),
    /// No inertia acts on a coordinate.
    #[error("no inertia acts on coordinate {0}")]
    Massless(usize),
}

impl Structure {
    /// A structure of `coordinates` coordinates and `supports` supports with the rows of its inertias and its elements.
    ///
    /// # Errors
    /// A [`StructureError`] for an end that does not exist, a row without one, or a coordinate without inertia.
    pub fn new(
        coordinates: usize,
        supports: usize,
        inertias: Vec<Ends>,
        elements: Vec<(Law, Ends)>,
    ) -> Result<Self, StructureError> {
        if coordinates == 0 {
            return Err(StructureError::Empty);
        }
        let (laws, ends): (Vec<Law>, Vec<Ends>) = elements.into_iter().unzip();
        let mut has_inertia = vec![false; coordinates];
        let mut bandwidth = 0;
        let rows = inertias.iter().chain(&ends);
        for (function, ends) in rows.clone().enumerate() {
            let beyond = ends
                .entries()
                .iter()
                .find(|(j, _)| *j >= coordinates + supports);
            if let Some((index, _)) = beyond {
                return Err(StructureError::UnknownEnd {
                    function,
                    index: *index,
                    coordinates,
                    supports,
                });
            }
            let (Some(first), Some(last)) = (
                free(ends, coordinates).map(|(j, _)| j).min(),
                free(ends, coordinates).map(|(j, _)| j).max(),
            ) else {
                return Err(StructureError::Unattached(function));
            };
            bandwidth = bandwidth.max(last - first);
            if function < inertias.len() {
                free(ends, coordinates).for_each(|(j, _)| has_inertia[j] = true);
            }
        }
        if let Some(j) = has_inertia.iter().position(|has| !has) {
            return Err(StructureError::Massless(j));
        }
        let pattern = |ends: &Ends| -> Vec<(usize, f64)> {
            let pairs = free(ends, coordinates).flat_map(|(i, a)| {
                let other = free(ends, coordinates).filter(move |(j, _)| *j <= i);
                other.map(move |(j, b)| (Banded::<f64>::position(bandwidth, i, j), a * b))
            });
            pairs.collect()
        };
        let patterns = rows.map(pattern).collect();
        let mut structure = Self {
            coordinates,
            supports,
            inertias,
            laws,
            ends,
            patterns,
            bandwidth,
            links: None,
        };
        structure.find_links();
        Ok(structure)
    }

    fn find_links(&mut self) {
        let ground = Ends::ground(0);
        let is_one = self.coordinates == 1
            && self.supports == 0
            && self.inertias == [Ends::ground(0)]
            && self.ends.iter().all(|ends| *ends == ground)
            && self.laws.len() <= MOST_ELEMENTS
            && self.internal_states() == 0;
        let links = self.laws.iter().map(|law| Link::grounded(*law));
        self.links = is_one.then(|| links.collect());
    }

    /// One coordinate with its mass, and an element of each law between it and the ground.
    pub fn one(laws: Vec<Law>) -> Self {
        let mut structure = Self {
            coordinates: 1,
            supports: 0,
            inertias: vec![Ends::ground(0)],
            ends: vec![Ends::ground(0); laws.len()],
            patterns: vec![vec![(0, 1.0)]; 1 + laws.len()],
            laws,
            bandwidth: 0,
            links: None,
        };
        structure.find_links();
        structure
    }

    /// Adds elements between the first coordinate and the ground.
    pub(crate) fn extend(&mut self, laws: impl IntoIterator<Item = Law>) {
        for law in laws {
            self.laws.push(law);
            self.ends.push(Ends::ground(0));
            self.patterns.push(vec![(0, 1.0)]);
        }
        self.find_links();
    }

    /// Sets the width of Coulomb friction, m/s.
    pub fn set_friction_width(&mut self, width: f64) {
        for law in &mut self.laws {
            if let Law::CoulombFriction { width: of_law } = law {
                *of_law = width;
            }
        }
        self.find_links();
    }

    /// Number of coordinates.
    pub fn coordinates(&self) -> usize {
        self.coordinates
    }

    /// True for one coordinate with its mass, and elements of the table between it and the ground: its explicit steps are compiled.
    pub fn is_one(&self) -> bool {
        self.links.is_some()
    }

    /// Elements of a structure whose steps are compiled.
    pub(crate) fn links(&self) -> Option<&[Link]> {
        self.links.as_deref()
    }

    /// Number of supports, whose indices follow those of the coordinates.
    pub fn supports(&self) -> usize {
        self.supports
    }

    /// Number of functions of time: inertias and coefficients of elements.
    pub fn functions(&self) -> usize {
        self.function_of(self.laws.len())
    }

    /// The first function of element `e`; the others of its law follow.
    pub fn function_of(&self, e: usize) -> usize {
        let before = self.laws[..e].iter().map(|law| law.coefficients());
        self.inertias.len() + before.sum::<usize>()
    }

    /// Number of internal states of elements, in the order of the elements.
    pub fn internal_states(&self) -> usize {
        self.laws
            .iter()
            .filter(|law| law.has_internal_state())
            .count()
    }

    /// Number of components of a state: displacements, velocities, internal states.
    pub fn components(&self) -> usize {
        2 * self.coordinates + self.internal_states()
    }

    /// Rows of the inertias.
    pub fn inertias(&self) -> &[Ends] {
        &self.inertias
    }

    /// Laws of the elements.
    pub fn laws(&self) -> &[Law] {
        &self.laws
    }

    /// Laws and rows of the elements.
    pub fn elements(&self) -> impl ExactSizeIterator<Item = (Law, &Ends)> {
        self.laws.iter().copied().zip(&self.ends)
    }

    /// Row of element `e`.
    pub(crate) fn ends(&self, e: usize) -> &Ends {
        &self.ends[e]
    }

    pub(crate) fn is_linear(&self) -> bool {
        self.laws.iter().all(|law| law.is_linear())
    }

    pub(crate) fn bandwidth(&self) -> usize {
        self.bandwidth
    }

    /// `b b^T` of inertia `f`, or of an element after the inertias, as places and values of a [`Banded`] matrix.
    pub(crate) fn pattern(&self, f: usize) -> &[(usize, f64)] {
        &self.patterns[f]
    }

    /// Squares of the natural frequencies, 1/s^2, in ascending order, for values of the functions, by the linear springs and the first slope of
    /// hysteresis; `None`
    /// where the mass matrix is not positive definite.
    pub fn eigenvalues(&self, functions: &[f64]) -> Option<Vec<f64>> {
        self.relative_to_mass(is_spring, functions)
    }

    /// A bound of the rates `|lambda|`, 1/s, of solutions `exp(lambda t)`: the square root of the largest eigenvalue of the linear springs, or
    /// the largest one of the linear dampers, whichever is larger. It holds for coefficients that are not negative, and for functions of
    /// time with the least inertias and the largest coefficients.
    pub fn largest_rate(&self, functions: &[f64]) -> Option<f64> {
        let largest = |is_meant: fn(Law) -> bool| {
            Some(self.relative_to_mass(is_meant, functions)?.last()?.max(0.0))
        };
        // A spring beyond a gap acts in part of the motion.
        let springs = largest(|law| is_spring(law) || matches!(law, Law::Gap { .. }))?;
        Some(springs.sqrt().max(largest(|law| law == Law::Damping)?))
    }

    /// [`Structure::largest_rate`] of functions of time, given by their values.
    pub(crate) fn largest_rate_of<'a>(
        &self,
        functions: impl Iterator<Item = &'a [f64]>,
    ) -> Option<f64> {
        let inertias = self.inertias.len();
        let extremes = functions.enumerate().map(|(f, values)| {
            let least = values.iter().copied().fold(f64::INFINITY, f64::min);
            let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if f < inertias { least } else { largest }
        });
        self.largest_rate(&extremes.collect::<Vec<f64>>())
    }

    /// The rates `lambda`, 1/s, of the solutions `exp(lambda t)` with linear springs and dampers; empty where the mass matrix is not positive
    /// definite or a value is not finite.
    pub(crate) fn rates(&self, functions: &[f64]) -> Vec<Complex<f64>> {
        let n = self.coordinates;
        let over_mass = |law| {
            let mass = self.mass_matrix(functions).cholesky()?;
            let matrix = mass.solve(&self.matrix_of(|of| of == law, functions));
            matrix.iter().all(|x| x.is_finite()).then_some(matrix)
        };
        let pair = over_mass(Law::Stiffness).zip(over_mass(Law::Damping));
        pair.map_or(Vec::new(), |(stiffness, damping)| {
            let mut first_order = DMatrix::zeros(2 * n, 2 * n);
            first_order.view_mut((0, n), (n, n)).fill_with_identity();
            first_order.view_mut((n, 0), (n, n)).copy_from(&-stiffness);
            first_order.view_mut((n, n), (n, n)).copy_from(&-damping);
            first_order.complex_eigenvalues().iter().copied().collect()
        })
    }

    fn mass_matrix(&self, functions: &[f64]) -> DMatrix<f64> {
        self.sum_of(self.inertias.iter().zip(functions.iter().copied()))
    }

    /// Matrix of all elements of some laws.
    fn matrix_of(&self, is_meant: impl Fn(Law) -> bool, functions: &[f64]) -> DMatrix<f64> {
        let elements = self.ends.iter().enumerate();
        let meant = elements.filter(|(e, _)| is_meant(self.laws[*e]));
        self.sum_of(meant.map(|(e, ends)| (ends, functions[self.function_of(e)])))
    }

    fn sum_of<'a>(&self, rows: impl Iterator<Item = (&'a Ends, f64)>) -> DMatrix<f64> {
        let n = self.coordinates;
        let mut matrix = DMatrix::zeros(n, n);
        for (ends, value) in rows {
            for (i, a) in free(ends, n) {
                free(ends, n).for_each(|(j, b)| matrix[(i, j)] += value * a * b);
            }
        }
        matrix
    }

    /// Eigenvalues of the matrix of all elements of some laws relative to the mass matrix, ascending.
    fn relative_to_mass(
        &self,
        is_meant: impl Fn(Law) -> bool,
        functions: &[f64],
    ) -> Option<Vec<f64>> {
        let mass = self.mass_matrix(functions).cholesky()?;
        let of_law = self.matrix_of(is_meant, functions);
        let half = mass.l().solve_lower_triangular(&of_law)?;
        let mut whole = mass.l().solve_lower_triangular(&half.transpose())?;
        whole = 0.5 * (&whole + whole.transpose());
        let mut values: Vec<f64> = whole.symmetric_eigenvalues().iter().copied().collect();
        values.sort_by(f64::total_cmp);
        Some(values)
    }
}

/// The entries of a row that are coordinates.
fn free(ends: &Ends, coordinates: usize) -> impl Iterator<Item = (usize, f64)> + Clone + '_ {
    let entries = ends.entries().iter().copied();
    entries.filter(move |(j, _)| *j < coordinates)
}

/// True for linear springs, and hysteresis by its first slope.
fn is_spring(law: Law) -> bool {
    law == Law::Stiffness || law.has_internal_state()
}
