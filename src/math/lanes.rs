//! Eight numbers at once, for work that the compiler does not vectorise by itself: written once over [`F8`] and compiled
//! for each instruction set, as in `simd.rs`. Each lane does what scalar code does, without fused multiply-add: results are
//! the same bits on every instruction set.

use super::simd::Level;
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
        if let (Level::Avx2 | Level::Avx512, Some(simd)) = (level, Avx2::try_new()) {
            return Self(Choice::Avx2(simd));
        }
        let _ = level;
        Self(Choice::Baseline(Baseline::new()))
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
            Choice::Avx2(simd) => simd.vectorize(On { kernel, simd }),
        }
    }
}

#[cfg(target_arch = "x86_64")]
struct On<K, S> {
    kernel: K,
    simd: S,
}

#[cfg(target_arch = "x86_64")]
impl<K: LaneKernel, S: Simd> pulp::NullaryFnOnce for On<K, S> {
    type Output = K::Out;
    #[inline(always)]
    fn call(self) -> K::Out {
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

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::super::simd::sets::{Avx2, Sse2};
    use std::arch::x86_64::{__m128, __m256, _CMP_LE_OQ, _CMP_LT_OQ};

    /// Two SSE vectors.
    #[derive(Clone, Copy, Debug)]
    pub struct Baseline(Sse2);

    impl Baseline {
        pub fn new() -> Self {
            Self(Sse2::try_new().expect("SSE2 is a part of x86-64"))
        }
    }

    macro_rules! of_two {
        ($($name:ident = $sse:ident, $avx:ident;)*) => {
            impl super::Simd for Baseline {
                type Eight = [__m128; 2];

                #[inline(always)]
                fn fill(self, value: f32) -> Self::Eight {
                    [self.0.sse._mm_set1_ps(value); 2]
                }

                #[inline(always)]
                fn load(self, from: &[f32; 8]) -> Self::Eight {
                    pulp::cast(*from)
                }

                #[inline(always)]
                fn store(self, v: Self::Eight) -> [f32; 8] {
                    pulp::cast(v)
                }

                #[inline(always)]
                fn abs(self, a: Self::Eight) -> Self::Eight {
                    a.map(|a| self.0.sse._mm_andnot_ps(self.0.sse._mm_set1_ps(-0.0), a))
                }

                #[inline(always)]
                fn lt(self, a: Self::Eight, b: Self::Eight) -> u32 {
                    let sse = self.0.sse;
                    let [low, high] = [0, 1].map(|i| sse._mm_movemask_ps(sse._mm_cmplt_ps(a[i], b[i])) as u32);
                    low | high << 4
                }

                #[inline(always)]
                fn le(self, a: Self::Eight, b: Self::Eight) -> u32 {
                    let sse = self.0.sse;
                    let [low, high] = [0, 1].map(|i| sse._mm_movemask_ps(sse._mm_cmple_ps(a[i], b[i])) as u32);
                    low | high << 4
                }

                $(#[inline(always)]
                fn $name(self, a: Self::Eight, b: Self::Eight) -> Self::Eight {
                    [self.0.sse.$sse(a[0], b[0]), self.0.sse.$sse(a[1], b[1])]
                })*
            }

            /// One AVX vector.
            impl super::Simd for Avx2 {
                type Eight = __m256;

                #[inline(always)]
                fn fill(self, value: f32) -> __m256 {
                    self.avx._mm256_set1_ps(value)
                }

                #[inline(always)]
                fn load(self, from: &[f32; 8]) -> __m256 {
                    pulp::cast(*from)
                }

                #[inline(always)]
                fn store(self, v: __m256) -> [f32; 8] {
                    pulp::cast(v)
                }

                #[inline(always)]
                fn abs(self, a: __m256) -> __m256 {
                    self.avx._mm256_andnot_ps(self.avx._mm256_set1_ps(-0.0), a)
                }

                #[inline(always)]
                fn lt(self, a: __m256, b: __m256) -> u32 {
                    self.avx._mm256_movemask_ps(self.avx._mm256_cmp_ps::<_CMP_LT_OQ>(a, b)) as u32
                }

                #[inline(always)]
                fn le(self, a: __m256, b: __m256) -> u32 {
                    self.avx._mm256_movemask_ps(self.avx._mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u32
                }

                $(#[inline(always)]
                fn $name(self, a: __m256, b: __m256) -> __m256 {
                    self.avx.$avx(a, b)
                })*
            }
        };
    }

    of_two! {
        add = _mm_add_ps, _mm256_add_ps;
        sub = _mm_sub_ps, _mm256_sub_ps;
        mul = _mm_mul_ps, _mm256_mul_ps;
        div = _mm_div_ps, _mm256_div_ps;
        min = _mm_min_ps, _mm256_min_ps;
        max = _mm_max_ps, _mm256_max_ps;
    }
}

#[cfg(target_arch = "x86_64")]
use super::simd::sets::Avx2;
#[cfg(target_arch = "x86_64")]
use x86::Baseline;

/// What the target guarantees: loops that the compiler vectorises.
#[cfg(not(target_arch = "x86_64"))]
mod baseline {
    use std::array::from_fn;

    /// Plain Rust.
    #[derive(Clone, Copy, Debug)]
    pub struct Baseline;

    impl Baseline {
        pub fn new() -> Self {
            Self
        }
    }

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

#[cfg(not(target_arch = "x86_64"))]
use baseline::Baseline;

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
