//! Eight numbers at a time, with whatever the processor offers for it.
//!
//! A kernel ([`Kernel`]) is written once, in terms of [`Eight`], and compiled for AVX-512, for
//! AVX2 and for plain numbers; which of them runs is decided when the program runs. All do the same IEEE
//! operations on the same eight lanes in the same order and none contracts a product and a sum, so
//! **all give the same bits**: the processor decides how fast an answer comes, never what it is.
//!
//! [`pulp`] proves the presence of instructions by its types, so there is no `unsafe` here.

mod portable;
pub(crate) mod sum;
#[cfg(target_arch = "x86_64")]
mod x86;

use portable::Portable;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// Number of lanes.
pub(crate) const LANES: usize = 8;

/// One value a lane, in memory.
pub(crate) type Row = [f64; LANES];

/// Arithmetic on [`LANES`] numbers at once.
pub(crate) trait Arithmetic: Copy {
    /// The numbers, in registers.
    type Registers: Copy;
    fn splat(self, x: f64) -> Self::Registers;
    fn load(self, row: &Row) -> Self::Registers;
    fn store(self, x: Self::Registers) -> Row;
    fn add(self, a: Self::Registers, b: Self::Registers) -> Self::Registers;
    fn sub(self, a: Self::Registers, b: Self::Registers) -> Self::Registers;
    fn mul(self, a: Self::Registers, b: Self::Registers) -> Self::Registers;
    fn div(self, a: Self::Registers, b: Self::Registers) -> Self::Registers;
    /// Rows to columns.
    fn transpose(self, rows: &[Row; LANES]) -> [Row; LANES];
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

    #[inline(always)]
    pub fn row(self) -> Row {
        self.arithmetic.store(self.registers)
    }
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

/// Work that is done in eight lanes.
pub(crate) trait Kernel {
    /// What it gives.
    type Output;

    /// Does it. Must be `#[inline(always)]`, like all that it calls, to be compiled for the
    /// instructions of `arithmetic`.
    fn run<A: Arithmetic>(self, arithmetic: A) -> Self::Output;
}

/// Runs a kernel with the widest arithmetic that this processor has.
pub(crate) fn run<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if let Some(avx512) = x86::Avx512::find() {
            return avx512.run(kernel);
        }
        if let Some(avx2) = x86::Avx2::find() {
            return avx2.run(kernel);
        }
    }
    kernel.run(Portable)
}

/// A plain loop over numbers that do not wait for each other, compiled for the widest arithmetic by
/// the compiler itself.
pub(crate) struct Elementwise<F: FnOnce()>(pub F);

impl<F: FnOnce()> Kernel for Elementwise<F> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, _: A) {
        (self.0)();
    }
}

/// The name of the arithmetic that [`run`] uses on this processor.
pub(crate) fn name() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        if x86::Avx512::find().is_some() {
            return "AVX-512";
        }
        if x86::Avx2::find().is_some() {
            return "AVX2";
        }
    }
    "scalar"
}
