//! A kernel in two parts that add up to it: what is near, and what is far.

/// S_d = S_d · near(r) + S_d · far(r): the part within a radius may be summed over other samples than the rest. Smooth, so
/// that neither part gets a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Partition {
    /// 1/radius² [1/unit²]; infinite where all is far.
    inverse: f32,
}

impl Partition {
    /// Everything is far.
    pub const NONE: Self = Self { inverse: f32::INFINITY };

    /// Nothing beyond `radius` > 0 [unit] is near.
    pub fn within(radius: f32) -> Self {
        Self { inverse: 1.0 / (radius * radius) }
    }

    /// The share of the far part at √`r2` [unit]: r²(2R² - r²)/R⁴ up to the radius R, then 1.
    #[inline(always)]
    pub fn far(self, r2: f32) -> f32 {
        let q = r2 * self.inverse;
        // Also where 0 · ∞ is not a number.
        let q = if q < 1.0 { q } else { 1.0 };
        q * (2.0 - q)
    }

    /// [`Self::far`] for a source that light reached along `travelled` [unit] inside: far where a surface point beyond the
    /// radius may be its entry.
    #[inline(always)]
    pub fn far_source(self, r2: f32, travelled: f32) -> f32 {
        let r = r2.sqrt() + travelled;
        self.far(r * r)
    }

    /// The share of the near part at √`r2` [unit], 1 - [`Self::far`].
    #[inline(always)]
    pub fn near(self, r2: f32) -> f32 {
        let q = r2 * self.inverse;
        let q = if q < 1.0 { q } else { 1.0 };
        (1.0 - q) * (1.0 - q)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_add_up_and_end_at_the_radius() {
        let partition = Partition::within(3.0);
        for i in 0..100 {
            let r2 = 0.15 * i as f32;
            assert!((partition.far(r2) + partition.near(r2) - 1.0).abs() < 1e-6);
            assert!(r2 < 9.0 || partition.near(r2) == 0.0);
        }
        assert_eq!((partition.far(0.0), partition.near(0.0)), (0.0, 1.0));
        for r2 in [0.0, 1e-30, 1.0, 1e30] {
            assert_eq!((Partition::NONE.far(r2), Partition::NONE.near(r2)), (1.0, 0.0));
        }
    }
}
