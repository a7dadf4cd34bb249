//! Eight numbers at once, for work that the compiler does not vectorise by itself: written once over [`F8`] and compiled
//! for each instruction set, as in `simd.rs`. Each lane does what scalar code does, without fused multiply-add: results are
//! the same bits on every instruction set.

#[cfg(target_arch = "x86_64")]
use super::simd::with_avx2;
use super::simd::{Kernel, Level};
use std::ops::{Add, Div, Mul, Sub};

/// Work on lanes of eight, to be compiled for several instruction sets.
pub trait LaneKernel {
    /// What the work yields.
    type Out;
    /// The work. Mark the implementation `#[inline(always)]`, and all it calls: code that is not inlined is compiled
    /// for the baseline, and slow. That goes for closures, too: none with an [`F8`] in it.
    fn run<S: Simd>(self, simd: S) -> Self::Out;
}

/// An instruction set that this machine has, chosen once: then a ray or a batch enters its code without looking again.
#[derive(Clone, Copy, Debug)]
pub struct Lanes(Choice);

#[derive(Clone, Copy, Debug)]
enum Choice {
    Baseline(Baseline),
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
}

impl Lanes {
    /// `level`, or the widest below it that this machine has. Eight lanes are 256 bits: AVX-512 adds nothing.
    pub fn at(level: Level) -> Self {
        #[cfg(target_arch = "x86_64")]
        if level != Level::Baseline && Level::best() != Level::Baseline {
            return Self(Choice::Avx2(Avx2(())));
        }
        let _ = level;
        Self(Choice::Baseline(Baseline))
    }

    /// The instruction set that was chosen.
    pub fn level(self) -> Level {
        match self.0 {
            Choice::Baseline(_) => Level::Baseline,
            #[cfg(target_arch = "x86_64")]
            Choice::Avx2(_) => Level::Avx2,
        }
    }

    /// Runs `kernel` with it.
    #[inline(always)]
    pub fn run<K: LaneKernel>(self, kernel: K) -> K::Out {
        match self.0 {
            Choice::Baseline(simd) => kernel.run(simd),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: an `Avx2` is made by `Lanes::at` alone, where the machine has the instruction set.
            Choice::Avx2(simd) => unsafe { with_avx2(On { kernel, simd }) },
        }
    }
}

struct On<K, S> {
    kernel: K,
    simd: S,
}

impl<K: LaneKernel, S: Simd> Kernel for On<K, S> {
    type Out = K::Out;
    #[inline(always)]
    fn run(self) -> K::Out {
        self.kernel.run(self.simd)
    }
}

/// What an instruction set does with eight numbers. A value of the type is the proof that the machine has it.
pub trait Simd: Copy {
    /// Eight numbers.
    type Eight: Copy;
    /// All eight `value`.
    fn fill(self, value: f32) -> Self::Eight;
    /// From memory.
    fn load(self, from: &[f32; 8]) -> Self::Eight;
    /// To memory.
    fn store(self, v: Self::Eight) -> [f32; 8];
    /// a + b.
    fn add(self, a: Self::Eight, b: Self::Eight) -> Self::Eight;
    /// a - b.
    fn sub(self, a: Self::Eight, b: Self::Eight) -> Self::Eight;
    /// a b.
    fn mul(self, a: Self::Eight, b: Self::Eight) -> Self::Eight;
    /// a / b.
    fn div(self, a: Self::Eight, b: Self::Eight) -> Self::Eight;
    /// The smaller; b if either is not a number.
    fn min(self, a: Self::Eight, b: Self::Eight) -> Self::Eight;
    /// The larger; b if either is not a number.
    fn max(self, a: Self::Eight, b: Self::Eight) -> Self::Eight;
    /// |a|.
    fn abs(self, a: Self::Eight) -> Self::Eight;
    /// Bit i: `a[i] < b[i]`.
    fn lt(self, a: Self::Eight, b: Self::Eight) -> u32;
    /// Bit i: `a[i] <= b[i]`.
    fn le(self, a: Self::Eight, b: Self::Eight) -> u32;
}

/// Eight numbers on the instruction set `S`.
#[derive(Clone, Copy)]
pub struct F8<S: Simd> {
    eight: S::Eight,
    simd: S,
}

impl<S: Simd> F8<S> {
    /// All eight `value`.
    #[inline(always)]
    pub fn splat(simd: S, value: f32) -> Self {
        Self { eight: simd.fill(value), simd }
    }

    /// From memory.
    #[inline(always)]
    pub fn load(simd: S, from: &[f32; 8]) -> Self {
        Self { eight: simd.load(from), simd }
    }

    /// Its instruction set.
    #[inline(always)]
    pub fn simd(self) -> S {
        self.simd
    }

    /// To memory.
    #[inline(always)]
    pub fn to_array(self) -> [f32; 8] {
        self.simd.store(self.eight)
    }

    /// The smaller; `b` where either is not a number.
    #[inline(always)]
    #[must_use]
    pub fn min(self, b: Self) -> Self {
        Self { eight: self.simd.min(self.eight, b.eight), ..self }
    }

    /// The larger; `b` where either is not a number.
    #[inline(always)]
    #[must_use]
    pub fn max(self, b: Self) -> Self {
        Self { eight: self.simd.max(self.eight, b.eight), ..self }
    }

    /// The size.
    #[inline(always)]
    #[must_use]
    pub fn abs(self) -> Self {
        Self { eight: self.simd.abs(self.eight), ..self }
    }

    /// Bit i: lane i is below `b`'s.
    #[inline(always)]
    pub fn lt(self, b: Self) -> u32 {
        self.simd.lt(self.eight, b.eight)
    }

    /// Bit i: lane i is at most `b`'s.
    #[inline(always)]
    pub fn le(self, b: Self) -> u32 {
        self.simd.le(self.eight, b.eight)
    }
}

/// [`F8::splat`] of three numbers.
#[inline(always)]
pub fn splat3<S: Simd>(simd: S, [x, y, z]: [f32; 3]) -> [F8<S>; 3] {
    [F8::splat(simd, x), F8::splat(simd, y), F8::splat(simd, z)]
}

macro_rules! operator {
    ($trait:ident, $function:ident) => {
        impl<S: Simd> $trait for F8<S> {
            type Output = Self;
            #[inline(always)]
            fn $function(self, b: Self) -> Self {
                Self { eight: self.simd.$function(self.eight, b.eight), ..self }
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

/// What the target guarantees: two SSE vectors on x86-64.
#[cfg(target_arch = "x86_64")]
mod baseline {
    use std::arch::x86_64::*;

    /// SSE2, a part of x86-64.
    #[derive(Clone, Copy, Debug)]
    pub struct Baseline;

    macro_rules! pairwise {
        ($($name:ident = $of:ident;)*) => {
            $(#[inline(always)]
            fn $name(self, a: Self::Eight, b: Self::Eight) -> Self::Eight {
                // SAFETY: every x86-64 has SSE2.
                unsafe { [$of(a[0], b[0]), $of(a[1], b[1])] }
            })*
        };
    }

    #[allow(unused_unsafe)] // whether an intrinsic of the baseline is safe to call depends on the compiler's version
    impl super::Simd for Baseline {
        type Eight = [__m128; 2];

        #[inline(always)]
        fn fill(self, value: f32) -> Self::Eight {
            // SAFETY: every x86-64 has SSE2.
            unsafe { [_mm_set1_ps(value); 2] }
        }

        #[inline(always)]
        fn load(self, from: &[f32; 8]) -> Self::Eight {
            // SAFETY: eight numbers lie at `from`; the load needs no alignment.
            unsafe { [_mm_loadu_ps(from.as_ptr()), _mm_loadu_ps(from[4..].as_ptr())] }
        }

        #[inline(always)]
        fn store(self, v: Self::Eight) -> [f32; 8] {
            let mut to = [0.0; 8];
            // SAFETY: there is room for eight numbers at `to`; the store needs no alignment.
            unsafe {
                _mm_storeu_ps(to.as_mut_ptr(), v[0]);
                _mm_storeu_ps(to[4..].as_mut_ptr(), v[1]);
            }
            to
        }

        pairwise! {
            add = _mm_add_ps;
            sub = _mm_sub_ps;
            mul = _mm_mul_ps;
            div = _mm_div_ps;
            min = _mm_min_ps;
            max = _mm_max_ps;
        }

        #[inline(always)]
        fn abs(self, a: Self::Eight) -> Self::Eight {
            // SAFETY: every x86-64 has SSE2.
            unsafe { a.map(|a| _mm_andnot_ps(_mm_set1_ps(-0.0), a)) }
        }

        #[inline(always)]
        fn lt(self, a: Self::Eight, b: Self::Eight) -> u32 {
            // SAFETY: every x86-64 has SSE2.
            let [low, high] = unsafe { [0, 1].map(|i| _mm_movemask_ps(_mm_cmplt_ps(a[i], b[i])) as u32) };
            low | high << 4
        }

        #[inline(always)]
        fn le(self, a: Self::Eight, b: Self::Eight) -> u32 {
            // SAFETY: every x86-64 has SSE2.
            let [low, high] = unsafe { [0, 1].map(|i| _mm_movemask_ps(_mm_cmple_ps(a[i], b[i])) as u32) };
            low | high << 4
        }
    }
}

/// What the target guarantees: loops that the compiler vectorises.
#[cfg(not(target_arch = "x86_64"))]
mod baseline {
    use std::array::from_fn;

    /// Plain Rust.
    #[derive(Clone, Copy, Debug)]
    pub struct Baseline;

    impl super::Simd for Baseline {
        type Eight = [f32; 8];

        #[inline(always)]
        fn fill(self, value: f32) -> Self::Eight {
            [value; 8]
        }

        #[inline(always)]
        fn load(self, from: &[f32; 8]) -> Self::Eight {
            *from
        }

        #[inline(always)]
        fn store(self, v: Self::Eight) -> [f32; 8] {
            v
        }

        #[inline(always)]
        fn add(self, a: Self::Eight, b: Self::Eight) -> Self::Eight {
            from_fn(|i| a[i] + b[i])
        }

        #[inline(always)]
        fn sub(self, a: Self::Eight, b: Self::Eight) -> Self::Eight {
            from_fn(|i| a[i] - b[i])
        }

        #[inline(always)]
        fn mul(self, a: Self::Eight, b: Self::Eight) -> Self::Eight {
            from_fn(|i| a[i] * b[i])
        }

        #[inline(always)]
        fn div(self, a: Self::Eight, b: Self::Eight) -> Self::Eight {
            from_fn(|i| a[i] / b[i])
        }

        #[inline(always)]
        fn min(self, a: Self::Eight, b: Self::Eight) -> Self::Eight {
            from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] })
        }

        #[inline(always)]
        fn max(self, a: Self::Eight, b: Self::Eight) -> Self::Eight {
            from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
        }

        #[inline(always)]
        fn abs(self, a: Self::Eight) -> Self::Eight {
            a.map(f32::abs)
        }

        #[inline(always)]
        fn lt(self, a: Self::Eight, b: Self::Eight) -> u32 {
            (0..8).map(|i| u32::from(a[i] < b[i]) << i).sum()
        }

        #[inline(always)]
        fn le(self, a: Self::Eight, b: Self::Eight) -> u32 {
            (0..8).map(|i| u32::from(a[i] <= b[i]) << i).sum()
        }
    }
}

use baseline::Baseline;

/// One AVX vector.
#[cfg(target_arch = "x86_64")]
mod avx2 {
    use std::arch::x86_64::*;

    /// Proof of AVX2.
    #[derive(Clone, Copy, Debug)]
    pub struct Avx2(pub(super) ());

    macro_rules! of_two {
        ($($name:ident = $of:ident;)*) => {
            $(#[inline(always)]
            fn $name(self, a: __m256, b: __m256) -> __m256 {
                // SAFETY: `self` proves AVX2, which includes AVX.
                unsafe { $of(a, b) }
            })*
        };
    }

    impl super::Simd for Avx2 {
        type Eight = __m256;

        #[inline(always)]
        fn fill(self, value: f32) -> __m256 {
            // SAFETY: `self` proves AVX2, which includes AVX.
            unsafe { _mm256_set1_ps(value) }
        }

        #[inline(always)]
        fn load(self, from: &[f32; 8]) -> __m256 {
            // SAFETY: as in `fill`; eight numbers lie at `from`, and the load needs no alignment.
            unsafe { _mm256_loadu_ps(from.as_ptr()) }
        }

        #[inline(always)]
        fn store(self, v: __m256) -> [f32; 8] {
            let mut to = [0.0; 8];
            // SAFETY: as in `fill`; there is room for eight numbers at `to`, and the store needs no alignment.
            unsafe { _mm256_storeu_ps(to.as_mut_ptr(), v) }
            to
        }

        of_two! {
            add = _mm256_add_ps;
            sub = _mm256_sub_ps;
            mul = _mm256_mul_ps;
            div = _mm256_div_ps;
            min = _mm256_min_ps;
            max = _mm256_max_ps;
        }

        #[inline(always)]
        fn abs(self, a: __m256) -> __m256 {
            // SAFETY: as in `fill`.
            unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), a) }
        }

        #[inline(always)]
        fn lt(self, a: __m256, b: __m256) -> u32 {
            // SAFETY: as in `fill`.
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b)) as u32 }
        }

        #[inline(always)]
        fn le(self, a: __m256, b: __m256) -> u32 {
            // SAFETY: as in `fill`.
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u32 }
        }
    }
}

#[cfg(target_arch = "x86_64")]
use avx2::Avx2;

#[cfg(test)]
mod tests {
    use super::*;

    /// Every operation on pairs of awkward numbers, as bits.
    struct All([f32; 8], [f32; 8]);

    impl LaneKernel for All {
        type Out = (Vec<[u32; 8]>, Vec<u32>);
        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Out {
            let (a, b) = (F8::load(simd, &self.0), F8::load(simd, &self.1));
            let values = [a + b, a - b, a * b, a / b, a.min(b), a.max(b), a.abs(), F8::splat(simd, self.0[3])];
            (values.iter().map(|v| v.to_array().map(f32::to_bits)).collect(), vec![a.lt(b), a.le(b)])
        }
    }

    #[test]
    fn every_instruction_set_does_what_scalars_do() {
        let awkward =
            [0.0, -0.0, 1.0, -1.5, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-40, 3e38, -7.25, 0.1, 1.000_000_1];
        for shift in 0..awkward.len() {
            let a: [f32; 8] = std::array::from_fn(|i| awkward[i]);
            let b: [f32; 8] = std::array::from_fn(|i| awkward[(i + shift) % awkward.len()]);
            let by = |f: fn(f32, f32) -> f32| -> [f32; 8] { std::array::from_fn(|i| f(a[i], b[i])) };
            let expected = [
                by(|a, b| a + b),
                by(|a, b| a - b),
                by(|a, b| a * b),
                by(|a, b| a / b),
                by(|a, b| if a < b { a } else { b }),
                by(|a, b| if a > b { a } else { b }),
                by(|a, _| a.abs()),
                [a[3]; 8],
            ];
            let bits = |f: fn(&f32, &f32) -> bool| (0..8).map(|i| u32::from(f(&a[i], &b[i])) << i).sum::<u32>();
            for level in Level::available() {
                let (values, masks) = Lanes::at(level).run(All(a, b));
                for (got, expected) in values.iter().zip(&expected) {
                    for (got, expected) in got.iter().zip(expected) {
                        let same = *got == expected.to_bits() || f32::from_bits(*got).is_nan() && expected.is_nan();
                        assert!(same, "{level:?}: {:e} instead of {expected:e}", f32::from_bits(*got));
                    }
                }
                assert_eq!(masks, [bits(|a, b| a < b), bits(|a, b| a <= b)], "{level:?}");
            }
        }
    }

    #[test]
    fn a_level_that_the_machine_has_is_taken() {
        for level in Level::available() {
            assert_eq!(Lanes::at(level).level(), level.min(Level::Avx2));
        }
    }
}
