//! The environment: the same radiance all around, or a picture of all directions with a table of where it shines.

use super::picture::Picture;
use super::{Light, LightBounds, LightEnd, LightSample, Reference};
use crate::math::{Rgb, Vec3};
use crate::sampling::cosine_hemisphere;
use crate::scene::{Environment, Scene};
use std::f32::consts::PI;
use std::sync::Arc;

/// Light from every direction that meets no surface. What is found by the directions of a surface needs no choice among lights.
pub struct Sky {
    radiance: Rgb,
    picture: Option<Arc<Picture>>,
}

/// Share of the directions that are picked by where a picture shines; the rest by the cosine, so that a picture's dark half,
/// and a wall before its bright one, cost at most twice the samples.
const BY_PICTURE: f32 = 0.5;

impl Sky {
    /// The environment of a scene; the table has 4 bytes for each pixel of its picture.
    pub fn new(environment: &Environment) -> Self {
        let picture = environment.image.clone().map(|image| Picture::new(image, environment.turn));
        let dark = environment.is_black() || picture.as_ref().is_some_and(Picture::is_black);
        let picture = picture.filter(|_| !dark).map(Arc::new);
        Self { radiance: if dark { Rgb::BLACK } else { environment.radiance }, picture }
    }

    /// Whether no light comes from it.
    pub fn is_black(&self) -> bool {
        self.radiance.is_black()
    }

    /// Its picture, and what each value of that stands for.
    pub(super) fn picture(&self) -> Option<(&Arc<Picture>, Rgb)> {
        Some((self.picture.as_ref()?, self.radiance))
    }

    /// A direction by the cosine about the unit vector `n`; under a picture, half of them by its light instead, which may
    /// lie below the horizon.
    pub fn direction(&self, n: Vec3, [u, v]: [f32; 2]) -> Vec3 {
        match &self.picture {
            None => cosine_hemisphere(n, [u, v]),
            Some(picture) if u < BY_PICTURE => picture.sample([u / BY_PICTURE, v]),
            Some(_) => cosine_hemisphere(n, [(u - BY_PICTURE) / (1.0 - BY_PICTURE), v]),
        }
    }

    /// Density [1/sr] of `w` by [`Self::direction`].
    pub fn density(&self, n: Vec3, w: Vec3) -> f32 {
        let cosine = n.dot(w).max(0.0) / PI;
        match &self.picture {
            None => cosine,
            Some(picture) => BY_PICTURE * picture.pdf(w) + (1.0 - BY_PICTURE) * cosine,
        }
    }

    /// Light from one of the directions of [`Self::direction`].
    pub fn towards(&self, n: Vec3, u: [f32; 2]) -> LightSample {
        let w = self.direction(n, u);
        let (end, pdf) = (LightEnd::Direction(w), self.density(n, w).into());
        LightSample { end, radiance: self.radiance(w), pdf, is_delta: false, object: None, light: 0 }
    }

    /// What there is, in words.
    pub fn text(&self) -> String {
        match &self.picture {
            None => "constant, sampled by the cosine".into(),
            Some(p) => format!("{} x {} pixels, sampled by what they send and by the cosine", p.width, p.height),
        }
    }
}

impl Light for Sky {
    fn name(&self, _: &Scene) -> String {
        "the environment".into()
    }

    fn power(&self) -> f64 {
        f64::from(self.mean_radiance() * PI)
    }

    fn mean_radiance(&self) -> f32 {
        self.radiance.mean() * self.picture.as_ref().map_or(1.0, |picture| picture.mean) as f32
    }

    fn bounds(&self) -> Option<LightBounds> {
        None
    }

    /// `None` in a medium: paths find it by themselves.
    fn sample(&self, _: &Scene, from: &Reference, _: f64, u: [f32; 2]) -> Option<LightSample> {
        Some(self.towards(from.n?, u))
    }

    fn pdf(&self, from: &Reference, w: Vec3) -> f64 {
        from.n.map_or(0.0, |n| self.density(n, w).into())
    }

    #[inline]
    fn radiance(&self, w: Vec3) -> Rgb {
        match &self.picture {
            None => self.radiance,
            Some(picture) => self.radiance * picture.at(w),
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::film::Image;
    use crate::math::{hash, unit_f32};
    use std::f64::consts::PI as PI64;
    use std::sync::Arc;

    fn numbers(seed: u64) -> [f32; 2] {
        [0, 1].map(|i| unit_f32((hash(2 * seed + i) >> 32) as u32))
    }

    pub fn sky(resolution: [u32; 2], turn: f32, pixel: impl FnMut(u32, u32) -> Rgb) -> Sky {
        let image = Some(Arc::new(Image::from_fn(resolution, pixel)));
        Sky::new(&Environment { radiance: Rgb::splat(2.0), image, turn })
    }

    #[test]
    fn directions_have_their_place_in_the_picture() {
        // Columns 0..8 from -z by +x, +z, -x and round; rows from +y down.
        let columns = sky([8, 4], 0.0, |x, _| Rgb::splat(x as f32));
        let turned = sky([8, 4], 0.25, |x, _| Rgb::splat(x as f32));
        for (x, z, across) in [(1.0, 0.0, 2.0), (0.0, 1.0, 4.0), (-1.0, 0.0, 6.0)] {
            // Between the centres of two pixels.
            let found = columns.radiance(Vec3::new(x, 0.0, z));
            assert!((found.mean() - 2.0 * (across - 0.5)).abs() < 1e-4, "{found:?}");
        }
        // Counterclockwise from above takes +z to +x.
        let (before, after) = (columns.radiance(Vec3::Z), turned.radiance(Vec3::X));
        assert!((before.mean() - after.mean()).abs() < 1e-4, "{before:?} {after:?}");
        let rows = sky([8, 4], 0.0, |_, y| Rgb::splat(y as f32));
        assert_eq!(rows.radiance(Vec3::Y).mean(), 0.0);
        assert_eq!(rows.radiance(-Vec3::Y).mean(), 6.0);
        assert!((rows.radiance(Vec3::X).mean() - 3.0).abs() < 1e-4);
    }

    #[test]
    fn a_picture_of_one_value_is_a_constant() {
        let sky = sky([6, 3], 0.1, |_, _| Rgb([0.5, 1.0, 1.5]));
        for seed in 0..100 {
            let w = sky.direction(Vec3::Y, numbers(seed));
            assert!((w.length() - 1.0).abs() < 1e-6);
            for c in 0..3 {
                assert!((sky.radiance(w)[c] - (c + 1) as f32).abs() < 1e-6);
            }
        }
    }

    /// Irradiance by the table against a sum over the picture: a small sun among dim, noisy pixels.
    #[test]
    fn sampled_irradiance_is_that_of_the_picture() {
        for (resolution, turn) in [([32, 16], 0.0), ([31, 7], 0.3), ([1, 1], -0.2), ([2, 300], 0.9)] {
            let pixel = |x: u32, y: u32| {
                let sun = if (x, y) == (5, 3) { 500.0 } else { 0.0 };
                Rgb::splat(sun + unit_f32((hash(u64::from(x * 1000 + y + 1)) >> 32) as u32))
            };
            let sky = sky(resolution, turn, pixel);
            let n = Vec3::new(0.3, 0.8, -0.5).normalize();
            let (mut exact, steps) = (0.0, 600);
            for i in 0..steps {
                for j in 0..2 * steps {
                    let (theta, phi) = (
                        (f64::from(i) + 0.5) / f64::from(steps) * PI64,
                        (f64::from(j) + 0.5) / f64::from(steps) * PI64,
                    );
                    let w = Vec3::new(
                        (theta.sin() * phi.cos()) as f32,
                        theta.cos() as f32,
                        (theta.sin() * phi.sin()) as f32,
                    );
                    let weight = theta.sin() * (PI64 / f64::from(steps)).powi(2);
                    exact += f64::from(sky.radiance(w).mean() * n.dot(w).max(0.0)) * weight;
                }
            }
            let count = 200_000;
            let (mut sum, mut squares, mut whole) = (0.0, 0.0, 0.0);
            for seed in 0..count {
                let w = sky.direction(n, numbers(seed));
                let value = f64::from(sky.radiance(w).mean() * n.dot(w).max(0.0) / sky.density(n, w));
                sum += value;
                squares += value * value;
                // One over the density of the picture's own directions is the whole sphere.
                if let Some(picture) = &sky.picture {
                    whole += 1.0 / f64::from(picture.pdf(picture.sample(numbers(seed))));
                }
            }
            let mean = sum / count as f64;
            let error = ((squares / count as f64 - mean * mean) / count as f64).sqrt();
            assert!((mean - exact).abs() < 6.0 * error + 1e-3 * exact, "{resolution:?}: {mean} +- {error}, {exact}");
            let sphere = whole / count as f64 / (4.0 * PI64);
            assert!((sphere - 1.0).abs() < 0.05, "{resolution:?}: {sphere}");
        }
    }

    #[test]
    fn a_black_picture_is_no_light() {
        assert!(sky([4, 2], 0.0, |_, _| Rgb::BLACK).is_black());
        let faint = sky([4, 2], 0.0, |x, y| if x + y == 0 { Rgb::splat(1e-30) } else { Rgb::BLACK });
        assert!(!faint.is_black() && faint.density(Vec3::Y, Vec3::Y).is_finite());
    }
}
