//! Coefficient sets: the functions in the equation of motion of some records.

use std::ops::Deref;

/// One function for each inertia and one for each element, as indices into the list of functions, inertias first. It dereferences to
/// these indices.
///
/// A coefficient is its function plus its known parts: `m = m_0 + sum_i m_i`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CoefficientSet {
    functions: Vec<usize>,
    /// Number of inertias among them.
    inertias: usize,
    /// VariableRole of the coefficient (mass 0) and index of each known part.
    known_parts: Vec<(usize, usize)>,
}

impl CoefficientSet {
    /// The set with this number of inertias, which are its first functions; one unless stated.
    #[must_use]
    pub fn with_inertias(mut self, inertias: usize) -> Self {
        self.inertias = inertias;
        self
    }

    /// Number of inertias.
    pub fn inertias(&self) -> usize {
        self.inertias
    }

    /// The set with `known_parts`, each with the place of its coefficient (mass 0) and the index of its function.
    #[must_use]
    pub fn with_known_parts(mut self, known_parts: Vec<(usize, usize)>) -> Self {
        self.known_parts = known_parts;
        self
    }

    /// Known parts, each with the place of its coefficient (mass 0) and the index of its function.
    pub fn known_parts(&self) -> &[(usize, usize)] {
        &self.known_parts
    }

    /// Places and indices of all functions of the set, known parts last.
    pub fn parts(&self) -> impl Iterator<Item = (usize, usize)> + Clone + '_ {
        let functions = self.functions.iter().copied().enumerate();
        functions.chain(self.known_parts.iter().copied())
    }
}

impl From<Vec<usize>> for CoefficientSet {
    fn from(functions: Vec<usize>) -> Self {
        Self {
            functions,
            inertias: 1,
            known_parts: Vec::new(),
        }
    }
}

impl Deref for CoefficientSet {
    type Target = [usize];

    fn deref(&self) -> &[usize] {
        &self.functions
    }
}
