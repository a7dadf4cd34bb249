//! Warps take numbers, not generators.

use crate::math::{Vec3, frame};
use std::f32::consts::FRAC_PI_4;

/// A point of the unit disk with constant density; concentric map [Shirley, Chiu 1997]. Without branches, so that loops
/// over it vectorise, and the same bits on every machine.
#[inline(always)]
pub fn disk([u, v]: [f32; 2]) -> [f32; 2] {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let steep = a.abs() <= b.abs();
    let (radius, other) = if steep { (b, a) } else { (a, b) };
    // The centre has no angle, and needs none.
    let slope = if radius == 0.0 { 0.0 } else { other / radius };
    let [sin, cos] = sin_cos(FRAC_PI_4 * slope);
    let (along, across) = (radius * cos, radius * sin);
    if steep { [across, along] } else { [along, across] }
}

/// Sine and cosine for |x| ≤ π/4: Taylor's series, which end there below half a unit in the last place.
#[inline(always)]
fn sin_cos(x: f32) -> [f32; 2] {
    let z = x * x;
    let sin = 1.0 / 362_880.0;
    let sin = sin * z - 1.0 / 5040.0;
    let sin = sin * z + 1.0 / 120.0;
    let sin = sin * z - 1.0 / 6.0;
    let cos = 1.0 / 40_320.0;
    let cos = cos * z - 1.0 / 720.0;
    let cos = cos * z + 1.0 / 24.0;
    let cos = cos * z - 0.5;
    [x + x * z * sin, 1.0 + z * cos]
}

/// A unit direction about z with density cosθ/π [1/sr]; z is above 0.
#[inline(always)]
pub fn hemisphere(u: [f32; 2]) -> [f32; 3] {
    let [x, y] = disk(u);
    // The rim of the disk is the horizon: rounding must not put a direction on or below it.
    let z2 = 1.0 - x * x - y * y;
    [x, y, if z2 > f32::EPSILON { z2 } else { f32::EPSILON }.sqrt()]
}

/// A unit direction about the unit normal `n` with density cosθ/π [1/sr]; its cosine is above 0.
#[inline]
pub fn cosine_hemisphere(n: Vec3, u: [f32; 2]) -> Vec3 {
    frame(n) * Vec3::from_array(hemisphere(u))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{hash, unit_f32};

    /// Bins of equal cosine-weighted measure: equal steps of sin²θ times equal sectors.
    fn chi_square(direction: impl Fn([f32; 2]) -> Vec3) -> f64 {
        const RINGS: usize = 8;
        const SECTORS: usize = 8;
        let draws = 200_000_u64;
        let mut counts = [0_u64; RINGS * SECTORS];
        for i in 0..draws {
            let u = [unit_f32((hash(2 * i) >> 32) as u32), unit_f32((hash(2 * i + 1) >> 32) as u32)];
            let w = direction(u);
            assert!(w.z > 0.0 && (w.length() - 1.0).abs() < 1e-5, "{w}");
            let ring = (((1.0 - w.z * w.z) * RINGS as f32) as usize).min(RINGS - 1);
            let turn = w.y.atan2(w.x) / std::f32::consts::TAU + 0.5;
            counts[ring * SECTORS + ((turn * SECTORS as f32) as usize).min(SECTORS - 1)] += 1;
        }
        let expected = draws as f64 / counts.len() as f64;
        counts.iter().map(|&c| (c as f64 - expected).powi(2) / expected).sum()
    }

    #[test]
    fn cosine_hemisphere_has_density_cosine_over_pi() {
        // 63 degrees of freedom: 121 is the 1e-5 tail.
        assert!(chi_square(|u| cosine_hemisphere(Vec3::Z, u)) < 121.0);
    }

    #[test]
    fn the_chi_square_refuses_a_uniform_hemisphere() {
        let uniform = |[u, v]: [f32; 2]| {
            let z = 1.0 - u * 0.999_999;
            let (sin, cos) = (std::f32::consts::TAU * v).sin_cos();
            let r = (1.0 - z * z).sqrt();
            Vec3::new(r * cos, r * sin, z)
        };
        assert!(chi_square(uniform) > 1e4);
    }

    #[test]
    fn sine_and_cosine_are_those_of_f64() {
        for i in -1000..=1000 {
            let x = i as f32 * (FRAC_PI_4 / 1000.0);
            let [sin, cos] = sin_cos(x).map(f64::from);
            let (sin64, cos64) = f64::from(x).sin_cos();
            assert!(
                (sin - sin64).abs() < 1e-7 * sin64.abs().max(1e-30) && (cos - cos64).abs() < 1e-7,
                "{x}: {sin} {cos}"
            );
        }
    }

    #[test]
    fn corners_of_the_square_stay_above_the_horizon() {
        for u in [[0.0, 0.0], [0.0, 0.999_999_94], [0.999_999_94, 0.0], [0.5, 0.5], [0.5, 0.0]] {
            for n in [Vec3::Z, -Vec3::Z, Vec3::X, Vec3::new(0.6, -0.8, 0.0)] {
                assert!(cosine_hemisphere(n, u).dot(n) > 0.0);
            }
        }
    }
}
