//! SIMD arithmetic on x86-64: one register of AVX-512 or two of AVX2.

use super::{Arithmetic, Kernel, LANES, Row};
use pulp::NullaryFnOnce;
use pulp::bytemuck::cast;
use pulp::x86::{V3, V4};
use std::arch::x86_64::{__m256d, __m512d};

/// AVX-512.
#[derive(Clone, Copy)]
pub(crate) struct Avx512(V4);

/// AVX2.
#[derive(Clone, Copy)]
pub(crate) struct Avx2(V3);

/// A kernel to be run with the instructions of `A`.
struct Call<A, K>(A, K);

impl<A: Arithmetic, K: Kernel> NullaryFnOnce for Call<A, K> {
    type Output = K::Output;

    #[inline(always)]
    fn call(self) -> K::Output {
        self.1.run(self.0)
    }
}

impl Avx512 {
    /// `None` on a processor without AVX-512.
    #[inline]
    pub fn find() -> Option<Self> {
        V4::try_new().map(Self)
    }

    /// Runs a kernel compiled for AVX-512.
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        self.0.vectorize(Call(self, kernel))
    }
}

impl Avx2 {
    /// `None` on a processor without AVX2.
    #[inline]
    pub fn find() -> Option<Self> {
        V3::try_new().map(Self)
    }

    /// Runs a kernel compiled for AVX2.
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        self.0.vectorize(Call(self, kernel))
    }
}

/// Operators with one instruction per register: one for AVX-512, two halves for AVX2.
macro_rules! operators {
    (at_once $registers:ty; $($name:ident $instruction:ident),*) => {$(
        #[inline(always)]
        fn $name(self, a: $registers, b: $registers) -> $registers {
            self.0.avx512f.$instruction(a, b)
        }
    )*};
    (in_halves $registers:ty; $($name:ident $instruction:ident),*) => {$(
        #[inline(always)]
        fn $name(self, a: $registers, b: $registers) -> $registers {
            let f = self.0.avx;
            [f.$instruction(a[0], b[0]), f.$instruction(a[1], b[1])]
        }
    )*};
}

impl Arithmetic for Avx512 {
    type Registers = __m512d;

    #[inline(always)]
    fn splat(self, x: f64) -> __m512d {
        self.0.avx512f._mm512_set1_pd(x)
    }

    #[inline(always)]
    fn load(self, row: &Row) -> __m512d {
        cast(*row)
    }

    #[inline(always)]
    fn store(self, x: __m512d) -> Row {
        cast(x)
    }

    operators!(at_once __m512d; add _mm512_add_pd, sub _mm512_sub_pd, mul _mm512_mul_pd,
        div _mm512_div_pd);

    #[inline(always)]
    fn sqrt(self, a: __m512d) -> __m512d {
        self.0.avx512f._mm512_sqrt_pd(a)
    }

    #[inline(always)]
    fn abs(self, a: __m512d) -> __m512d {
        self.0.avx512f._mm512_abs_pd(a)
    }

    /// Transposes pairs within 128 bits, then 128-bit parts in two rounds.
    #[inline(always)]
    fn transpose(self, r: [__m512d; LANES]) -> [__m512d; LANES] {
        // Even and odd columns of two rows each.
        let (e0, o0) = self.pair(r[0], r[1]);
        let (e1, o1) = self.pair(r[2], r[3]);
        let (e2, o2) = self.pair(r[4], r[5]);
        let (e3, o3) = self.pair(r[6], r[7]);
        // Columns 0, 4 and 2, 6; 1, 5 and 3, 7, of four rows each.
        let ((e04, e26), (o15, o37)) = (self.sort(e0, e1), self.sort(o0, o1));
        let ((f04, f26), (p15, p37)) = (self.sort(e2, e3), self.sort(o2, o3));
        let ((c0, c4), (c2, c6)) = (self.sort(e04, f04), self.sort(e26, f26));
        let ((c1, c5), (c3, c7)) = (self.sort(o15, p15), self.sort(o37, p37));
        [c0, c1, c2, c3, c4, c5, c6, c7]
    }
}

impl Avx512 {
    #[inline(always)]
    fn pair(self, a: __m512d, b: __m512d) -> (__m512d, __m512d) {
        let f = self.0.avx512f;
        (f._mm512_unpacklo_pd(a, b), f._mm512_unpackhi_pd(a, b))
    }

    /// 128-bit parts 0 and 2 of both, and parts 1 and 3.
    #[inline(always)]
    fn sort(self, a: __m512d, b: __m512d) -> (__m512d, __m512d) {
        let f = self.0.avx512f;
        (
            f._mm512_shuffle_f64x2::<0x88>(a, b),
            f._mm512_shuffle_f64x2::<0xdd>(a, b),
        )
    }
}

impl Avx2 {
    /// Transposes a 4 x 4 block.
    #[inline(always)]
    fn transpose_four(self, r: [__m256d; 4]) -> [__m256d; 4] {
        let f = self.0.avx;
        let (e0, o0) = (
            f._mm256_unpacklo_pd(r[0], r[1]),
            f._mm256_unpackhi_pd(r[0], r[1]),
        );
        let (e1, o1) = (
            f._mm256_unpacklo_pd(r[2], r[3]),
            f._mm256_unpackhi_pd(r[2], r[3]),
        );
        [
            f._mm256_permute2f128_pd::<0x20>(e0, e1),
            f._mm256_permute2f128_pd::<0x20>(o0, o1),
            f._mm256_permute2f128_pd::<0x31>(e0, e1),
            f._mm256_permute2f128_pd::<0x31>(o0, o1),
        ]
    }
}

impl Arithmetic for Avx2 {
    type Registers = [__m256d; 2];

    #[inline(always)]
    fn splat(self, x: f64) -> [__m256d; 2] {
        [self.0.avx._mm256_set1_pd(x); 2]
    }

    #[inline(always)]
    fn load(self, row: &Row) -> [__m256d; 2] {
        cast(*row)
    }

    #[inline(always)]
    fn store(self, x: [__m256d; 2]) -> Row {
        cast(x)
    }

    operators!(in_halves [__m256d; 2]; add _mm256_add_pd, sub _mm256_sub_pd, mul _mm256_mul_pd,
        div _mm256_div_pd);

    #[inline(always)]
    fn sqrt(self, a: [__m256d; 2]) -> [__m256d; 2] {
        let f = self.0.avx;
        [f._mm256_sqrt_pd(a[0]), f._mm256_sqrt_pd(a[1])]
    }

    #[inline(always)]
    fn abs(self, a: [__m256d; 2]) -> [__m256d; 2] {
        let f = self.0.avx;
        let sign = f._mm256_set1_pd(-0.0);
        [
            f._mm256_andnot_pd(sign, a[0]),
            f._mm256_andnot_pd(sign, a[1]),
        ]
    }

    /// Transposes four 4 x 4 blocks and exchanges the two off the diagonal.
    #[inline(always)]
    fn transpose(self, r: [[__m256d; 2]; LANES]) -> [[__m256d; 2]; LANES] {
        let a = self.transpose_four([r[0][0], r[1][0], r[2][0], r[3][0]]);
        let b = self.transpose_four([r[4][0], r[5][0], r[6][0], r[7][0]]);
        let c = self.transpose_four([r[0][1], r[1][1], r[2][1], r[3][1]]);
        let d = self.transpose_four([r[4][1], r[5][1], r[6][1], r[7][1]]);
        [
            [a[0], b[0]],
            [a[1], b[1]],
            [a[2], b[2]],
            [a[3], b[3]],
            [c[0], d[0]],
            [c[1], d[1]],
            [c[2], d[2]],
            [c[3], d[3]],
        ]
    }
}
