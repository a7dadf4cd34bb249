//! A kernel in two parts that add up to it: what is near, and what is far.

/// S_d = S_d · near(r) + S_d · far(r): the part within a radius may be summed over other samples than the rest. Smooth, so
/// that neither part gets a step. A value of this type is one of the parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Partition {
    /// 1/radius² [1/unit²]; infinite where all is far.
    inverse: f32,
    /// Share at no distance: 1 of the near part, 0 of the far one.
    middle: f32,
}

impl Partition {
    /// Everything is far: the whole.
    pub const NONE: Self = Self { inverse: f32::INFINITY, middle: 0.0 };

    /// The far part, where nothing beyond `radius` > 0 \[unit\] is near.
    pub fn beyond(radius: f32) -> Self {
        Self { inverse: 1.0 / (radius * radius), middle: 0.0 }
    }

    /// The near part, nothing of it beyond `radius` > 0 \[unit\].
    pub fn within(radius: f32) -> Self {
        Self { middle: 1.0, ..Self::beyond(radius) }
    }

    /// The part's share of S_d at √`r2` \[unit\]. Of the far part 0 up to half the radius R, then t²(3 - 2t) with t the part
    /// of the way from R²/4 to R², then 1; of the near part what that leaves, beyond R exactly 0.
    #[inline(always)]
    pub fn share(self, r2: f32) -> f32 {
        let q = r2 * self.inverse;
        // Also where 0 · ∞ is not a number.
        let q = if q < 1.0 { q } else { 1.0 };
        let t = (q - 0.25) * (4.0 / 3.0);
        let t = if t > 0.0 { t } else { 0.0 };
        // Rounding of 4/3 must not leave a rest beyond the radius.
        let t = if q < 1.0 { t } else { 1.0 };
        (self.middle - t * t * (3.0 - 2.0 * t)).abs()
    }

    /// [`Self::share`] for a source that light reached along `travelled` \[unit\] inside: far where a surface point beyond the
    /// radius may be its entry.
    #[inline(always)]
    pub fn share_source(self, r2: f32, travelled: f32) -> f32 {
        let r = r2.sqrt() + travelled;
        self.share(r * r)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_add_up_and_end_at_the_radius() {
        let (near, far) = (Partition::within(3.0), Partition::beyond(3.0));
        for i in 0..100 {
            let r2 = 0.15 * i as f32;
            assert!((far.share(r2) + near.share(r2) - 1.0).abs() < 1e-6);
            assert!((0.0..=1.0).contains(&near.share(r2)));
            assert!(r2 < 9.0 || near.share(r2) == 0.0);
            assert!(i == 0 || far.share(r2) >= far.share(r2 - 0.15));
        }
        assert_eq!((far.share(0.0), near.share(0.0)), (0.0, 1.0));
        for r2 in [0.0, 1e-30, 1.0, 1e30] {
            assert_eq!(Partition::NONE.share(r2), 1.0);
        }
    }
}
