//! The bright part of a picture of the environment: what is so small and bright that it is a lamp, not a sky.

use super::picture::Picture;
use super::{Light, LightBounds, LightEnd, LightSample, Reference, Sky};
use crate::math::{Rgb, Vec3};
use crate::scene::Scene;
use std::f64::consts::PI;
use std::sync::Arc;

/// A patch whose mean is more than this many times the picture's is of a sun. What remains adds no more than this to the
/// relative variance of a path that meets the sky by chance.
const BRIGHT: f64 = 4.0;
/// Suns that add less than this to it are no trouble: a smooth sky has none.
const TROUBLE: f64 = 0.5;

/// The patches of a picture that are brighter than `BRIGHT`, picked by what they send.
pub struct Suns {
    picture: Arc<Picture>,
    /// What each value of the picture stands for.
    scale: Rgb,
    /// Row and column.
    patches: Vec<[u32; 2]>,
    /// Chance of each and of all before it.
    cumulative: Vec<f64>,
    /// Means above this belong to suns.
    above: f64,
    /// Mean times solid angle, over all suns.
    power: f64,
    /// Share of the picture's light that comes from elsewhere.
    pub beside: f32,
    /// By what they send.
    mean_radiance: f32,
    /// Of an even light with the same power and the same square of radiance \[sr\].
    pub solid_angle: f32,
}

impl Suns {
    /// `None` where the sky is even enough for chance.
    pub fn new(sky: &Sky) -> Option<Self> {
        let (picture, scale) = sky.picture()?;
        let patches = || (0..=picture.height).flat_map(|k| (0..picture.width).map(move |i| (k, i)));
        let total: f64 = patches().map(|(k, i)| mean(picture.values(k, i)) * picture.solid_angle(k)).sum();
        let all = total / (4.0 * PI);
        let above = BRIGHT * all;
        let (mut power, mut squares, mut bright, mut cumulative) = (0.0, 0.0, Vec::new(), Vec::new());
        for (k, i) in patches() {
            let (value, solid) = (mean(picture.values(k, i)), picture.solid_angle(k));
            if value > above {
                power += value * solid;
                squares += value * value * solid;
                bright.push([k as u32, i as u32]);
                cumulative.push(power);
            }
        }
        cumulative.iter_mut().for_each(|c| *c /= power);
        let suns = Self {
            picture: picture.clone(),
            scale,
            patches: bright,
            cumulative,
            above,
            power,
            beside: (1.0 - power / total).max(0.0) as f32,
            mean_radiance: (squares / power) as f32 * scale.mean(),
            solid_angle: (power / squares * power) as f32,
        };
        (squares / (4.0 * PI * all * all) > TROUBLE).then_some(suns)
    }

    /// A direction: a patch by what it sends, in it a place by the values between its corners.
    fn direction(&self, pick: f64, [u, v]: [f32; 2]) -> Vec3 {
        let chosen = self.cumulative.partition_point(|&c| c <= pick).min(self.patches.len() - 1);
        let [k, i] = self.patches[chosen].map(|n| n as usize);
        let [a, b, c, d] = self.picture.values(k, i);
        let x = linear(u.into(), a + c, b + d);
        let y = linear(v.into(), a + (b - a) * x, c + (d - c) * x);
        self.picture.direction(k, i, [x, y])
    }

    /// Density [1/sr] of `w` among their directions; 0 where no sun is.
    fn density(&self, w: Vec3) -> f64 {
        let (k, i, [x, _]) = self.picture.patch(w);
        let values = self.picture.values(k, i);
        if mean(values) <= self.above {
            return 0.0;
        }
        let ([a, b, c, d], x, y) = (values, f64::from(x), self.picture.down(k, w.y));
        let (upper, lower) = (a + (b - a) * x, c + (d - c) * x);
        (upper + (lower - upper) * y) / self.power
    }
}

impl Light for Suns {
    fn name(&self, _: &Scene) -> String {
        "the bright part of the environment's picture".into()
    }

    fn power(&self) -> f64 {
        self.power * self.scale.mean_f64()
    }

    fn mean_radiance(&self) -> f32 {
        self.mean_radiance
    }

    fn bounds(&self) -> Option<LightBounds> {
        None
    }

    fn solid_angle(&self) -> f64 {
        self.solid_angle.into()
    }

    fn in_picture(&self) -> bool {
        true
    }

    fn sample(&self, _: &Scene, _: &Reference, pick: f64, u: [f32; 2]) -> Option<LightSample> {
        let w = self.direction(pick, u);
        // A direction within rounding of its patch's edge may be found in the next.
        let pdf = self.density(w);
        let radiance = self.scale * self.picture.at(w);
        let end = LightEnd::Direction(w);
        (pdf as f32 > 0.0).then_some(LightSample { end, radiance, pdf, is_delta: false, object: None, light: 0 })
    }

    fn pdf(&self, _: &Reference, w: Vec3) -> f64 {
        self.density(w)
    }
}

fn mean(values: [f64; 4]) -> f64 {
    values.iter().sum::<f64>() / 4.0
}

/// A number in [0, 1] whose density goes evenly from `from` to `to`, by an even one.
fn linear(u: f64, from: f64, to: f64) -> f64 {
    let end = (from * from + (to * to - from * from) * u).max(0.0).sqrt();
    if from + end > 0.0 { (u * (from + to) / (from + end)).min(1.0) } else { u }
}

#[cfg(test)]
#[allow(clippy::print_stdout)] // with --nocapture, the figures of a run
mod tests {
    use super::super::sky::tests::sky;
    use super::*;
    use crate::math::{hash, unit_f32};

    fn number(i: u64) -> f32 {
        unit_f32((hash(i + 1) >> 32) as u32)
    }

    #[test]
    fn a_smooth_sky_has_no_suns() {
        let has_suns = |sky| Suns::new(&sky).is_some();
        assert!(!has_suns(sky([16, 8], 0.0, |_, _| Rgb::WHITE)));
        assert!(!has_suns(sky([64, 32], 0.2, |_, y| Rgb::splat(3.0 - y as f32 / 16.0))));
        // A pixel five times as bright as the others, of two thousand.
        assert!(!has_suns(sky([64, 32], 0.2, |x, y| Rgb::splat(if [x, y] == [9, 9] { 5.0 } else { 1.0 }))));
    }

    /// Suns by their own table, the rest by all directions: together the flux of the picture, weighted by a function that waves
    /// within a patch, to 5 standard errors. And radiance over density is the same wherever a grey picture is not at a pole.
    #[test]
    fn suns_and_the_rest_are_the_picture() {
        let picture = |x: u32, y: u32| {
            let sun = if (20..22).contains(&x) && (5..7).contains(&y) || [x, y] == [0, 13] { 4000.0 } else { 0.0 };
            Rgb([1.0, 0.5, 0.2]) * (sun + number(u64::from(x * 100 + y)))
        };
        let sky = sky([32, 16], 0.3, picture);
        let suns = Suns::new(&sky).unwrap();
        assert!(suns.beside > 0.005 && suns.beside < 0.5);
        let n = 400_000;
        let sphere = |i: u64| {
            let (z, angle) = (1.0 - 2.0 * number(2 * i), std::f32::consts::TAU * number(2 * i + 1));
            let r = (1.0 - z * z).max(0.0).sqrt();
            Vec3::new(r * angle.cos(), r * angle.sin(), z)
        };
        let mean = |values: &mut dyn Iterator<Item = f64>| {
            let (sum, squares) = values.fold((0.0, 0.0), |(s, q), v| (s + v, q + v * v));
            let mean = sum / n as f64;
            (mean, ((squares / n as f64 - mean * mean) / n as f64).sqrt())
        };
        let around = 4.0 * std::f32::consts::PI;
        let wave = |w: Vec3| 1.5 + (20.0 * w.x).sin() * (20.0 * w.y).cos();
        let value = |w: Vec3| sky.radiance(w).mean() * wave(w);
        let of_suns = |w: Vec3| suns.density(w) > 0.0;
        let plain = mean(&mut (0..n).map(sphere).map(|w| f64::from(value(w) * around)));
        let rest = mean(&mut (0..n).map(sphere).map(|w| f64::from(if of_suns(w) { 0.0 } else { value(w) * around })));
        let drawn = |i: u64| {
            let [pick, u, v] = [0, 1, 2].map(|d| number(3 * i + d + 10_000_000));
            let w = suns.direction(pick.into(), [u, v]);
            (of_suns(w)).then(|| (w, suns.density(w) as f32))
        };
        let suns = mean(&mut (0..n).map(drawn).map(|s| s.map_or(0.0, |(w, pdf)| f64::from(value(w) / pdf))));
        let error = plain.1.hypot(rest.1).hypot(suns.1);
        println!("{plain:?}: {rest:?} and {suns:?}");
        assert!(error < 0.02 * plain.0, "{plain:?}");
        assert!((plain.0 - rest.0 - suns.0).abs() < 5.0 * error, "{plain:?}: {rest:?} and {suns:?}");
        let spread = (0..1000).filter_map(drawn).map(|(w, pdf)| sky.radiance(w).mean() / pdf);
        let (least, most) = spread.fold((f32::INFINITY, 0.0_f32), |(a, b), v| (a.min(v), b.max(v)));
        assert!(most < 2.0 * least, "{least} to {most}");
    }

    /// Three of the largest numbers of single precision have a sum beyond it.
    #[test]
    fn the_brightest_pixel_there_can_be_hides_no_other() {
        let pixel = |x, y| Rgb::splat(if [x, y] == [40, 20] { f32::MAX } else { 0.5 });
        let sky = sky([64, 32], 0.0, pixel);
        let suns = Suns::new(&sky).unwrap();
        let w = suns.direction(0.5, [0.5; 2]);
        assert!(!sky.is_black() && suns.density(w).is_finite() && suns.density(w) > 0.0);
        assert_eq!(sky.radiance(-w), Rgb::WHITE, "{w:?}");
    }
}
