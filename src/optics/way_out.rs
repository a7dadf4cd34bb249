//! In which directions light leaves through a boundary, by the first moments of what leaves.

use super::transmittance;
use crate::math::{GaussLegendre, Rgb, Vec3};
use std::f64::consts::PI;

/// Panels of the integrals over the cosine, and points on each: the transmittance falls to 0 as a root at grazing.
const PANELS: usize = 32;
const POINTS: usize = 8;

/// Light that leaves through a boundary is T(c) L(w), c = n·w and w the direction outside. L, the radiance under the boundary, is here linear in w: the
/// only such function with the exitance ∫ T L c dω, its mean cosine and its moment along the surface.
///
/// Diffusion theory gives L as linear in the direction under the boundary, P1, which over the cone that gets out is nearly the same; that the moments are those of the light
/// itself and not of the theory counts where light has just entered, or passes a thin wall.
#[derive(Clone, Copy, Debug)]
pub struct WayOut {
    /// 1 / ∫ T c dω.
    even: f32,
    /// Mean cosine of even light that has passed.
    mean: f32,
    /// One over the variance of the cosine.
    steep: f32,
    /// 1 / ∫ T c (1 - c²) / 2 dω.
    along: f32,
}

/// Moments of light that leaves, over the area that it leaves from.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moments {
    /// ∫ T L c dω.
    pub exitance: Rgb,
    /// ∫ T L c² dω.
    pub normal: Rgb,
    /// ∫ T L (w - c n) c dω of each channel.
    pub along: [Vec3; 3],
}

impl WayOut {
    /// Of a boundary of relative index `eta` = n_inside / n_outside > 0.
    pub fn new(eta: f32) -> Self {
        // Below this cosine light from outside is totally reflected, and beside it T is a root.
        let least = (1.0 - f64::from(eta) * f64::from(eta)).max(0.0).sqrt();
        Self::of_transmittance(least, |c| transmittance(eta, c))
    }

    /// Of a boundary that lets the share `passed` of light through along a direction outside, by its cosine; none below the cosine `least`.
    pub fn of_transmittance(least: f64, passed: impl Fn(f32) -> f32) -> Self {
        let rule = GaussLegendre::new(POINTS);
        // c = least + (1 - least) s² puts points beside the root.
        let integral = |power: i32| {
            rule.integrate_panels(0.0, 1.0, PANELS, |s| {
                let c = least + (1.0 - least) * s * s;
                2.0 * s * (1.0 - least) * f64::from(passed(c as f32)) * c.powi(1 + power)
            })
        };
        let [whole, first, second] = [0, 1, 2].map(integral);
        let mean = first / whole;
        Self {
            even: (1.0 / (2.0 * PI * whole)) as f32,
            mean: mean as f32,
            steep: (1.0 / (second / whole - mean * mean)) as f32,
            along: (1.0 / (PI * (whole - second))) as f32,
        }
    }

    /// Radiance under the boundary, the same in all directions, whose exitance is `exitance`; in that one's unit over sr.
    #[inline]
    pub fn even(&self, exitance: Rgb) -> Rgb {
        exitance * self.even
    }

    /// What `moments` add to that in the unit direction `w` outside, `n` being the unit normal; below zero where more of them leaves to the other side.
    #[inline]
    pub fn lean(&self, moments: &Moments, n: Vec3, w: Vec3) -> Rgb {
        let c = n.dot(w).clamp(0.0, 1.0);
        let tangent = w - n * n.dot(w);
        let steep = self.even * self.steep * (c - self.mean);
        Rgb::from_fn(|k| {
            (moments.normal[k] - self.mean * moments.exitance[k]) * steep + self.along * moments.along[k].dot(tangent)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What was put in comes out: exitance and moments of the radiance, integrated over directions outside.
    #[test]
    fn its_moments_are_those_that_it_was_made_of() {
        for eta in [0.8, 1.0, 1.3, 1.5] {
            let way = WayOut::new(eta);
            let n = Vec3::Z;
            let along = [Vec3::new(0.3, -0.1, 0.0), Vec3::ZERO, Vec3::new(0.0, 0.2, 0.0)];
            let made_of = Moments { exitance: Rgb([1.0, 2.0, 0.5]), normal: Rgb([0.6, 1.5, 0.35]), along };
            let mut sum = [[0.0_f64; 4]; 3];
            let steps = (4000, 64);
            for i in 0..steps.0 {
                let c = ((f64::from(i) + 0.5) / f64::from(steps.0)).sqrt();
                for j in 0..steps.1 {
                    let (sin, cos) = (2.0 * PI * (f64::from(j) + 0.5) / f64::from(steps.1)).sin_cos();
                    let s = (1.0 - c * c).sqrt();
                    let w = Vec3::new((s * cos) as f32, (s * sin) as f32, c as f32);
                    let out = (way.even(made_of.exitance) + way.lean(&made_of, n, w)) * transmittance(eta, c as f32);
                    // cosθ dω = π du dv.
                    for k in 0..3 {
                        let part = f64::from(out[k]) * PI / f64::from(steps.0 * steps.1);
                        let by = [1.0, c, f64::from(w.x), f64::from(w.y)];
                        (0..4).for_each(|m| sum[k][m] += part * by[m]);
                    }
                }
            }
            for k in 0..3 {
                let along = made_of.along[k];
                let right = [made_of.exitance[k], made_of.normal[k], along.x, along.y];
                for m in 0..4 {
                    assert!((sum[k][m] - f64::from(right[m])).abs() < 1e-3, "{eta}: {sum:?}, right {right:?}");
                }
            }
        }
    }

    /// Even light under the boundary is even in all directions: it leans nowhere.
    #[test]
    fn even_light_leans_nowhere() {
        let way = WayOut::new(1.0);
        let moments = Moments { exitance: Rgb::WHITE, normal: Rgb::splat(2.0 / 3.0), along: [Vec3::ZERO; 3] };
        for c in [0.1_f32, 0.5, 1.0] {
            let lean = way.lean(&moments, Vec3::Z, Vec3::new((1.0 - c * c).sqrt(), 0.0, c));
            assert!(lean.max().abs() < 1e-5, "{lean:?}");
        }
        assert!((way.even(Rgb::WHITE)[0] - std::f32::consts::FRAC_1_PI).abs() < 1e-5);
    }
}
