//! Order along a space-filling curve: neighbours in the list are neighbours in space.

use crate::math::{Aabb, DVec3};

/// 63-bit Morton code of `p` inside the box, 21 bits an axis.
pub fn morton_code(p: DVec3, bounds: &Aabb) -> u64 {
    let extent = bounds.extent().max_element();
    let cells = f64::from(1_u32 << 21) - 1.0;
    let cell = |offset: f64| {
        if extent > 0.0 { (offset / extent * cells) as u64 } else { 0 }
    };
    let q = p - bounds.lower;
    spread(cell(q.x)) | spread(cell(q.y)) << 1 | spread(cell(q.z)) << 2
}

/// Moves bit i of 21 to bit 3i.
fn spread(mut x: u64) -> u64 {
    x &= (1 << 21) - 1;
    x = (x | x << 32) & 0x001f_0000_0000_ffff;
    x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_interleave() {
        assert_eq!(spread(0b101), 0b1_000_001);
        let unit = Aabb { lower: DVec3::ZERO, upper: DVec3::ONE };
        let one = 1.0 / (f64::from(2_u16).powi(21) - 1.0);
        assert_eq!(morton_code(DVec3::ZERO, &unit), 0);
        assert_eq!(morton_code(DVec3::new(0.0, one * 1.5, 0.0), &unit), 0b010);
        assert_eq!(morton_code(DVec3::ONE, &unit), (1 << 63) - 1);
    }
}
