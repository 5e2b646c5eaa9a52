//! SIMD arithmetic: eight numbers at a time, with the widest instruction set of the processor.
//!
//! A kernel ([`Kernel`]) is written once, in terms of [`Eight`], and compiled for AVX-512, AVX2 and scalar arithmetic; the choice is
//! made at run time. All variants do the same IEEE operations on the same eight lanes in the same order, without fused
//! multiply-add, so **results are bit-identical** on all processors.
//!
//! [`pulp`] proves the presence of instructions by its types, so no `unsafe` code is needed.

mod portable;
mod real;
pub(crate) mod sum;
pub(crate) mod tall_qr;
#[cfg(target_arch = "x86_64")]
mod x86;

#[cfg(test)]
pub(crate) mod tests;

pub(crate) use real::Real;

use portable::Portable;
use std::ffi::OsString;
use std::ops::{Add, AddAssign, Deref, DerefMut, Div, Mul, Neg, Sub};
use std::sync::LazyLock;

/// Number of SIMD lanes.
pub(crate) const LANES: usize = 8;

/// One value per lane, in memory.
pub(crate) type Row = [f64; LANES];

/// Value aligned to 64 bytes, so that no row spans two cache lines; reading a recently written row that does takes several times as
/// long.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub(crate) struct Aligned<T>(pub T);

impl<T> Deref for Aligned<T> {
    type Target = T;

    #[inline(always)]
    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T> DerefMut for Aligned<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut T {
        &mut self.0
    }
}

/// Arithmetic on [`LANES`] numbers at once.
pub(crate) trait Arithmetic: Copy {
    /// Register type.
    type Registers: Copy;
    fn splat(self, x: f64) -> Self::Registers;
    fn load(self, row: &Row) -> Self::Registers;
    fn store(self, x: Self::Registers) -> Row;
    fn add(self, a: Self::Registers, b: Self::Registers) -> Self::Registers;
    fn sub(self, a: Self::Registers, b: Self::Registers) -> Self::Registers;
    fn mul(self, a: Self::Registers, b: Self::Registers) -> Self::Registers;
    fn div(self, a: Self::Registers, b: Self::Registers) -> Self::Registers;
    fn sqrt(self, a: Self::Registers) -> Self::Registers;
    fn abs(self, a: Self::Registers) -> Self::Registers;
    /// Transposes eight rows.
    #[inline(always)]
    fn transpose(self, rows: [Self::Registers; LANES]) -> [Self::Registers; LANES] {
        let rows = rows.map(|row| self.store(row));
        std::array::from_fn(|i| self.load(&std::array::from_fn(|j| rows[j][i])))
    }
}

/// Eight numbers with operators.
#[derive(Clone, Copy)]
pub(crate) struct Eight<A: Arithmetic> {
    arithmetic: A,
    registers: A::Registers,
}

impl<A: Arithmetic> Eight<A> {
    #[inline(always)]
    pub fn splat(arithmetic: A, x: f64) -> Self {
        Self {
            arithmetic,
            registers: arithmetic.splat(x),
        }
    }

    #[inline(always)]
    pub fn load(arithmetic: A, row: &Row) -> Self {
        Self {
            arithmetic,
            registers: arithmetic.load(row),
        }
    }

    /// A constant, in the arithmetic of `self`.
    #[inline(always)]
    pub fn constant(self, x: f64) -> Self {
        Self::splat(self.arithmetic, x)
    }

    /// Square roots.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self {
            registers: self.arithmetic.sqrt(self.registers),
            ..self
        }
    }

    /// Absolute values.
    #[inline(always)]
    pub fn abs(self) -> Self {
        Self {
            registers: self.arithmetic.abs(self.registers),
            ..self
        }
    }

    #[inline(always)]
    pub fn row(self) -> Row {
        self.arithmetic.store(self.registers)
    }

    /// Transposes eight rows.
    #[inline(always)]
    pub fn transpose(arithmetic: A, rows: [Self; LANES]) -> [Self; LANES] {
        let mut registers = [rows[0].registers; LANES];
        for (registers, row) in registers.iter_mut().zip(rows) {
            *registers = row.registers;
        }
        let mut columns = rows;
        for (column, registers) in columns.iter_mut().zip(arithmetic.transpose(registers)) {
            column.registers = registers;
        }
        columns
    }
}

/// Transposes eight rows in memory.
#[inline(always)]
pub(crate) fn transposed<A: Arithmetic>(arithmetic: A, rows: &[Row; LANES]) -> [Row; LANES] {
    let mut eights = [Eight::splat(arithmetic, 0.0); LANES];
    for (eight, row) in eights.iter_mut().zip(rows) {
        *eight = Eight::load(arithmetic, row);
    }
    let mut columns = [[0.0; LANES]; LANES];
    for (column, eight) in columns.iter_mut().zip(Eight::transpose(arithmetic, eights)) {
        *column = eight.row();
    }
    columns
}

/// Values `from` to `from + 7`; the last value is repeated beyond the end.
#[inline(always)]
pub(crate) fn window(f: &[f64], from: usize) -> Row {
    if let Some(row) = f.get(from..).and_then(|f| f.first_chunk()) {
        return *row;
    }
    let mut row = [0.0; LANES];
    for (i, x) in (from..).zip(&mut row) {
        *x = f[i.min(f.len() - 1)];
    }
    row
}

macro_rules! operator {
    ($trait:ident, $name:ident) => {
        impl<A: Arithmetic> $trait for Eight<A> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self {
                    registers: self.arithmetic.$name(self.registers, other.registers),
                    ..self
                }
            }
        }
    };
}

operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl<A: Arithmetic> AddAssign for Eight<A> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<A: Arithmetic> Neg for Eight<A> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self::splat(self.arithmetic, -1.0) * self
    }
}

/// A computation in eight lanes.
pub(crate) trait Kernel {
    /// Result.
    type Output;

    /// Runs the computation. It must be `#[inline(always)]`, like all functions it calls, to be compiled for the instructions of
    /// `arithmetic`.
    fn run<A: Arithmetic>(self, arithmetic: A) -> Self::Output;
}

/// Environment variable that limits the instruction set to `AVX-512`, `AVX2` or `scalar`, for tests and for processors that are slower
/// with wide registers. Results do not depend on it.
pub const LIMIT: &str = "KMCFIT_ARITHMETIC";

/// Width of the registers.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Width {
    Scalar,
    Avx2,
    Avx512,
}

impl Width {
    const ALL: [Width; 3] = [Width::Scalar, Width::Avx2, Width::Avx512];

    fn name(self) -> &'static str {
        match self {
            Width::Scalar => "scalar",
            Width::Avx2 => "AVX2",
            Width::Avx512 => "AVX-512",
        }
    }

    /// Widest registers of the processor.
    fn here() -> Width {
        #[cfg(target_arch = "x86_64")]
        {
            if x86::Avx512::find().is_some() {
                return Width::Avx512;
            }
            if x86::Avx2::find().is_some() {
                return Width::Avx2;
            }
        }
        Width::Scalar
    }

    /// Width in use: the widest available, within a valid limit.
    fn used() -> Width {
        static USED: LazyLock<Width> = LazyLock::new(|| {
            limit()
                .ok()
                .flatten()
                .unwrap_or(Width::Avx512)
                .min(Width::here())
        });
        *USED
    }
}

/// Limit set by [`LIMIT`]; its text if it is invalid.
fn limit() -> Result<Option<Width>, String> {
    parse_limit(std::env::var_os(LIMIT))
}

/// Limit in a text. An empty text sets none, because shells and job files clear variables in this way.
fn parse_limit(text: Option<OsString>) -> Result<Option<Width>, String> {
    let Some(text) = text.filter(|text| !text.is_empty()) else {
        return Ok(None);
    };
    let named = |width: &Width| text.eq_ignore_ascii_case(width.name());
    match Width::ALL.into_iter().find(named) {
        Some(width) => Ok(Some(width)),
        None => Err(text.to_string_lossy().into_owned()),
    }
}

/// Checks that [`LIMIT`], if set, names an arithmetic.
///
/// # Errors
/// The text, if it is none of [`arithmetics`].
pub fn check_limit() -> Result<(), String> {
    limit().map(|_| ())
}

/// Names of all arithmetics.
pub fn arithmetics() -> [&'static str; 3] {
    Width::ALL.map(Width::name)
}

/// Runs a kernel with the widest arithmetic of the processor.
pub(crate) fn run<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        let width = Width::used();
        if width == Width::Avx512
            && let Some(avx512) = x86::Avx512::find()
        {
            return avx512.run(kernel);
        }
        if width >= Width::Avx2
            && let Some(avx2) = x86::Avx2::find()
        {
            return avx2.run(kernel);
        }
    }
    kernel.run(Portable)
}

/// A loop over independent numbers, vectorised by the compiler for the widest arithmetic.
pub(crate) struct Elementwise<F: FnOnce()>(pub F);

impl<F: FnOnce()> Kernel for Elementwise<F> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, _: A) {
        (self.0)();
    }
}

/// Name of the arithmetic of [`run`].
pub(crate) fn name() -> &'static str {
    Width::used().name()
}

/// Results of a kernel with every arithmetic of the processor.
#[cfg(test)]
pub(crate) fn on_each<K: Kernel>(kernel: impl Fn() -> K) -> Vec<K::Output> {
    let mut outputs = vec![kernel().run(Portable)];
    #[cfg(target_arch = "x86_64")]
    {
        outputs.extend(x86::Avx2::find().map(|avx2| avx2.run(kernel())));
        outputs.extend(x86::Avx512::find().map(|avx512| avx512.run(kernel())));
    }
    outputs
}
