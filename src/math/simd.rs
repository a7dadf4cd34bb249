//! One source, several instruction sets: the same loop compiled for each, the widest that this machine has chosen at
//! run time. Loops in a [`Kernel`] are plain Rust over slices that the compiler vectorises: 4 lanes with SSE2, 8 with
//! AVX2, 16 with AVX-512.
//!
//! No fused multiply-add, no reordering: each lane does what the scalar code does, so results are the same bits on
//! every instruction set.

#[cfg(target_arch = "x86_64")]
use sets::{Avx2, Avx512};

/// Work to be compiled for several instruction sets.
pub trait Kernel {
    /// What the work yields.
    type Out;
    /// The work. Mark the implementation `#[inline(always)]`, and all it calls: code that is not inlined is compiled
    /// for the baseline.
    fn run(self) -> Self::Out;
}

/// An instruction set that a [`Kernel`] can be compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// What the target guarantees: SSE2 on x86-64, NEON on aarch64.
    Baseline,
    /// 256-bit vectors.
    Avx2,
    /// 512-bit vectors.
    Avx512,
}

impl Level {
    /// The widest of this machine.
    pub fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            // Looked for once and remembered.
            if Avx512::is_available() {
                return Self::Avx512;
            }
            if Avx2::is_available() {
                return Self::Avx2;
            }
        }
        Self::Baseline
    }

    /// All that this machine has, the baseline first.
    pub fn available() -> Vec<Self> {
        [Self::Baseline, Self::Avx2, Self::Avx512].into_iter().filter(|level| *level <= Self::best()).collect()
    }
}

/// Runs `kernel` with the widest instruction set of this machine.
#[inline]
pub fn dispatch<K: Kernel>(kernel: K) -> K::Out {
    dispatch_at(Level::best(), kernel)
}

/// Runs `kernel` with `level`, or the widest below it that this machine has.
#[inline]
pub fn dispatch_at<K: Kernel>(level: Level, kernel: K) -> K::Out {
    #[cfg(target_arch = "x86_64")]
    match (level, Avx512::try_new(), Avx2::try_new()) {
        (Level::Avx512, Some(simd), _) => return simd.vectorize(Call(kernel)),
        (Level::Avx512 | Level::Avx2, _, Some(simd)) => return simd.vectorize(Call(kernel)),
        _ => {}
    }
    let _ = level;
    kernel.run()
}

/// Proofs that the machine has an instruction set.
#[cfg(target_arch = "x86_64")]
pub(super) mod sets {
    pulp::simd_type! {
        /// Every x86-64 has it.
        pub struct Sse2 { pub sse: "sse", pub sse2: "sse2" }

        /// 256-bit vectors.
        pub struct Avx2 { pub avx: "avx", pub avx2: "avx2" }

        /// 512-bit vectors.
        pub struct Avx512 { pub avx512f: "avx512f", pub avx512dq: "avx512dq" }
    }
}

/// A kernel as `pulp` calls it: inlined, unlike a closure.
#[cfg(target_arch = "x86_64")]
struct Call<K>(K);

#[cfg(target_arch = "x86_64")]
impl<K: Kernel> pulp::NullaryFnOnce for Call<K> {
    type Output = K::Out;

    #[inline(always)]
    fn call(self) -> K::Out {
        self.0.run()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Sum<'a>(&'a [f32]);

    impl Kernel for Sum<'_> {
        type Out = f32;
        #[inline(always)]
        fn run(self) -> f32 {
            self.0.iter().map(|v| v.sqrt() * 1.1 + 0.3).sum()
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let values: Vec<f32> = (0..1000).map(|i| i as f32 * 0.37).collect();
        let expected = Sum(&values).run();
        for level in Level::available() {
            assert_eq!(dispatch_at(level, Sum(&values)).to_bits(), expected.to_bits(), "{level:?}");
        }
    }
}
