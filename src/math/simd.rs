//! One source, several instruction sets: the same loop compiled for each, the widest that this machine has chosen at
//! run time. Loops in a [`Kernel`] are plain Rust over slices that the compiler vectorises: 4 lanes with SSE2, 8 with
//! AVX2, 16 with AVX-512.
//!
//! No fused multiply-add, no reordering: each lane does what the scalar code does, so results are the same bits on
//! every instruction set.

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
            // `std` looks once and remembers.
            if std::is_x86_feature_detected!("avx512f") && std::is_x86_feature_detected!("avx512dq") {
                return Self::Avx512;
            }
            if std::is_x86_feature_detected!("avx2") {
                return Self::Avx2;
            }
        }
        Self::Baseline
    }

    /// All that this machine has, the baseline first.
    pub fn available() -> Vec<Self> {
        let best = Self::best();
        let mut levels = vec![Self::Baseline];
        if best != Self::Baseline {
            levels.push(Self::Avx2);
        }
        if best == Self::Avx512 {
            levels.push(Self::Avx512);
        }
        levels
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
    {
        let best = Level::best();
        if level == Level::Avx512 && best == Level::Avx512 {
            // SAFETY: `Level::best` has just found every feature that the function enables (AVX-512 implies AVX2).
            return unsafe { with_avx512(kernel) };
        }
        if level != Level::Baseline && best != Level::Baseline {
            // SAFETY: `Level::best` has just found AVX2, alone or under AVX-512.
            return unsafe { with_avx2(kernel) };
        }
    }
    let _ = level;
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq")]
fn with_avx512<K: Kernel>(kernel: K) -> K::Out {
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
pub(super) fn with_avx2<K: Kernel>(kernel: K) -> K::Out {
    kernel.run()
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
