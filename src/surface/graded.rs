//! Surfaces whose roughness differs from point to point.

use super::{Bsdf, BsdfSample, Texture};
use crate::geometry::SurfacePoint;
use crate::math::{Rgb, Vec3};
use std::sync::Arc;

/// Steps between the smoothest and the roughest.
const STEPS: usize = 32;
/// The least roughness: a mirror is no member of the family, since lights are not asked for there.
const LEAST: f32 = 0.032;

/// Surfaces of one kind from smooth to rough, at each point a mixture of the two whose roughness is next to a picture's: what each of them has,
/// reciprocity and energy among it, a mixture has too.
#[derive(Clone, Debug)]
pub struct Graded {
    steps: Vec<Arc<dyn Bsdf>>,
    roughness: Arc<Texture>,
}

impl Graded {
    /// `of` makes the surface of a roughness in [0, 1], none of which is a delta; `roughness` is the red channel of a picture, below 0.032 as 0.032.
    pub fn new(roughness: Arc<Texture>, of: impl Fn(f32) -> Arc<dyn Bsdf>) -> Self {
        Self { steps: (0..=STEPS).map(|k| of((k as f32 / STEPS as f32).max(LEAST))).collect(), roughness }
    }

    /// The two surfaces, and the share of the second.
    fn there(&self, at: &SurfacePoint) -> ([&dyn Bsdf; 2], f32) {
        let place = self.roughness.at(at.uv)[0] * STEPS as f32;
        let low = (place as usize).min(STEPS - 1);
        ([&*self.steps[low], &*self.steps[low + 1]], (place - low as f32).clamp(0.0, 1.0))
    }
}

impl Bsdf for Graded {
    fn eval(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3) -> Rgb {
        let ([a, b], share) = self.there(at);
        a.eval(at, wo, wi) * (1.0 - share) + b.eval(at, wo, wi) * share
    }

    fn sample(&self, at: &SurfacePoint, wo: Vec3, [u, v, which]: [f32; 3]) -> Option<BsdfSample> {
        let ([a, b], share) = self.there(at);
        let (one, rest) = if which < share {
            (b, which / share)
        } else {
            (a, ((which - share) / (1.0 - share)).min(1.0_f32.next_down()))
        };
        let wi = one.sample(at, wo, [u, v, rest])?.wi;
        let pdf = self.pdf(at, wo, wi);
        // The cosine is the one that each of them has in its own weight.
        let cosine = at.normal_seen_from(wo).dot(wi).abs();
        (pdf > 0.0).then(|| BsdfSample { wi, weight: self.eval(at, wo, wi) * (cosine / pdf), pdf })
    }

    fn pdf(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3) -> f32 {
        let ([a, b], share) = self.there(at);
        a.pdf(at, wo, wi) * (1.0 - share) + b.pdf(at, wo, wi) * share
    }

    /// Of the mean roughness.
    fn albedo(&self) -> Rgb {
        let mean = (self.roughness.mean()[0] * STEPS as f32).round() as usize;
        self.steps[mean.min(STEPS)].albedo()
    }

    fn albedo_at(&self, at: &SurfacePoint) -> Rgb {
        let ([a, b], share) = self.there(at);
        a.albedo_at(at) * (1.0 - share) + b.albedo_at(at) * share
    }

    fn textures(&self) -> Vec<&Arc<Texture>> {
        let mut all = self.steps[0].textures();
        all.push(&self.roughness);
        all
    }

    fn text(&self) -> String {
        format!("{}, roughness by {}", self.steps[STEPS / 2].text(), self.roughness.text())
    }
}
