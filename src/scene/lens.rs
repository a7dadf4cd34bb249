//! A thin lens [PC81]: what lies in its focal plane is sharp, all else a spot of its own shape.

use crate::sampling::disk;
use std::f32::consts::TAU;

/// A thin lens in a plane perpendicular to the view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Half of its diameter; of one with blades to its corners \[unit\], above 0.
    pub radius: f32,
    /// Distance along the view of what is sharp \[unit\], above 0.
    pub focus: f32,
    /// Sides of the polygon that it is, 3 or more; 0 for a round one.
    pub blades: u32,
    /// Angle of the polygon's first corner, counterclockwise from upwards as seen from behind the camera \[radians\].
    pub turn: f32,
}

/// Places that stand for the rim of a round lens.
const AROUND: u32 = 16;

impl Lens {
    /// A place of it [radii, to the right and upwards], evenly over its area for numbers in [0,1)².
    #[inline]
    pub fn place(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        if self.blades == 0 {
            return disk([u, v]);
        }
        // One of the triangles between the middle and two corners, and a place in it.
        let pick = u * self.blades as f32;
        let blade = (pick as u32).min(self.blades - 1);
        let outwards = (pick - blade as f32).clamp(0.0, 1.0).sqrt();
        let [a, b] = [self.corner(blade, self.blades), self.corner(blade + 1, self.blades)];
        std::array::from_fn(|k| outwards * (a[k] + v * (b[k] - a[k])))
    }

    /// Places between which all of it lies, or but for 2 % of a round one's radius.
    pub fn rim(&self) -> impl Iterator<Item = [f32; 2]> + use<> {
        let (lens, count) = (*self, if self.blades == 0 { AROUND } else { self.blades });
        (0..count).map(move |k| lens.corner(k, count))
    }

    fn corner(&self, k: u32, of: u32) -> [f32; 2] {
        let (sin, cos) = (self.turn + TAU * k as f32 / of as f32).sin_cos();
        [-sin, cos]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{hash, unit_f32};

    fn lens(blades: u32, turn: f32) -> Lens {
        Lens { radius: 1.0, focus: 1.0, blades, turn }
    }

    /// Chi-square of 2^17 places over the cells of a grid by their shares of the lens, which a fine grid of the polygon's own sides tells.
    fn chi_square(lens: &Lens, numbers: impl Fn(u64) -> [f32; 2]) -> (f64, usize) {
        const CELLS: usize = 8;
        let corners: Vec<[f32; 2]> = if lens.blades == 0 { Vec::new() } else { lens.rim().collect() };
        let inside = |x: f64, y: f64| {
            let n = corners.len();
            n == 0 && x * x + y * y <= 1.0
                || n > 0
                    && (0..n).all(|k| {
                        let [a, b] = [corners[k], corners[(k + 1) % n]].map(|c| c.map(f64::from));
                        (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) >= 0.0
                    })
        };
        let cell = |v: f64| ((v + 1.0) * 0.5 * CELLS as f64) as usize;
        let mut shares = vec![0.0; CELLS * CELLS];
        let fine = 2048;
        for i in 0..fine * fine {
            let [x, y] = [i % fine, i / fine].map(|k| (k as f64 + 0.5) / fine as f64 * 2.0 - 1.0);
            if inside(x, y) {
                shares[cell(y) * CELLS + cell(x)] += 1.0;
            }
        }
        let all: f64 = shares.iter().sum();
        let draws = 1 << 17;
        let mut counts = vec![0.0; CELLS * CELLS];
        for i in 0..draws {
            let [x, y] = lens.place(numbers(i)).map(f64::from);
            assert!(x.hypot(y) <= 1.0 + 1e-6, "{x} {y}");
            counts[cell(y).min(CELLS - 1) * CELLS + cell(x).min(CELLS - 1)] += 1.0;
        }
        let expected: Vec<f64> = shares.iter().map(|s| s / all * draws as f64).collect();
        // Cells of a few draws go together.
        let (mut sum, mut rest, mut bins) = (0.0, [0.0; 2], 0);
        for (n, e) in counts.iter().zip(&expected) {
            if *e < 50.0 {
                rest = [rest[0] + n, rest[1] + e];
            } else {
                (sum, bins) = (sum + (n - e) * (n - e) / e, bins + 1);
            }
        }
        if rest[1] > 0.0 {
            sum += (rest[0] - rest[1]).powi(2) / rest[1];
        }
        (sum, bins)
    }

    fn random(i: u64) -> [f32; 2] {
        [unit_f32((hash(2 * i) >> 32) as u32), unit_f32((hash(2 * i + 1) >> 32) as u32)]
    }

    #[test]
    fn places_are_even_over_every_shape() {
        for (blades, turn) in [(0, 0.0), (3, 0.0), (4, 0.3), (5, 1.0), (6, 0.0), (9, -2.0)] {
            let (sum, bins) = chi_square(&lens(blades, turn), random);
            // Mean of a chi-square and 6 standard deviations.
            let most = bins as f64 + 6.0 * (2.0 * bins as f64).sqrt();
            assert!(sum < most, "{blades} blades: {sum} for {bins} bins");
        }
        // Without the root places would crowd in the middle.
        let crowded = |i: u64| {
            let [u, v] = random(i);
            let pick = u * 5.0;
            [(pick.floor() + pick.fract() * pick.fract()) / 5.0, v]
        };
        assert!(chi_square(&lens(5, 0.0), crowded).0 > 1e4);
    }

    #[test]
    fn the_first_corner_points_upwards_and_turns_to_the_left() {
        let near = |a: [f32; 2], b: [f32; 2]| (0..2).all(|k| (a[k] - b[k]).abs() < 1e-6);
        assert!(near(lens(6, 0.0).rim().next().unwrap_or_default(), [0.0, 1.0]));
        assert!(near(lens(6, TAU / 4.0).rim().next().unwrap_or_default(), [-1.0, 0.0]));
    }
}
