//! What the boundary of a body does to light, in parts: for methods that ask a model for what is inside.

use super::microfacets::local;
use super::rough_boundary::Side;
use super::{Bsdf, BsdfSample, Colour, RoughBoundary};
use crate::geometry::SurfacePoint;
use crate::math::{DVec3, Rgb, Vec3, frame};
use crate::optics::{reflect, reflectance, refract, transmittance};
use std::sync::Arc;

/// A smooth or a rough boundary, with or without pigment.
#[derive(Clone, Debug)]
pub struct Interface {
    /// n_inside / n_outside.
    pub eta: f32,
    /// If it is not smooth.
    pub rough: Option<Arc<RoughBoundary>>,
    /// Pigment on it: see [`Self::tint`].
    pub tint: Option<Colour>,
}

impl Interface {
    /// Share of what is let through at a point, inwards or outwards, that passes its pigment, each channel in [0, 1]. That is a layer too thin to scatter on
    /// the inner side, which what is reflected has not been through: light that enters at x and leaves at y is worth tint(x) tint(y) times what
    /// it is without, the same both ways round, and never more than has entered.
    #[inline]
    pub fn tint(&self, at: &SurfacePoint) -> Rgb {
        self.tint.as_ref().map_or(Rgb::WHITE, |tint| tint.at(at))
    }

    /// Share in [0, 1] of light along a direction outside, of this cosine to the normal, that goes in; by reciprocity, what of even light inside leaves
    /// along it.
    #[inline]
    pub fn passed(&self, cosine: f32) -> f32 {
        self.rough.as_ref().map_or_else(|| transmittance(self.eta, cosine), |rough| rough.passed(cosine))
    }

    /// Share of light from outside that is reflected.
    #[inline]
    pub fn reflected(&self, cosine: f32) -> f32 {
        self.rough.as_ref().map_or_else(|| reflectance(self.eta, cosine), |rough| 1.0 - rough.passed(cosine))
    }

    /// Share of light along a direction inside that is reflected.
    pub fn reflected_inside(&self, cosine: f32) -> f32 {
        let inside = || reflectance(1.0 / self.eta, cosine);
        self.rough.as_ref().map_or_else(inside, |rough| 1.0 - rough.passed_from_inside(cosine))
    }

    /// The direction inside that a model is told of light from the unit vector `w` outside, `n` being the unit normal; models of rough boundaries do not ask for
    /// it. `None` where light is totally reflected.
    pub fn told(&self, n: Vec3, w: Vec3) -> Option<Vec3> {
        if self.rough.is_some() { Some(-n) } else { refract(w, n, self.eta) }
    }

    /// A direction inside of light that gets in from `w`, by a rough boundary from three numbers in [0, 1); its weight has a mean of 1.
    pub fn enter(&self, n: Vec3, w: Vec3, mut number: impl FnMut() -> f32) -> Option<(Vec3, f32)> {
        let Some(rough) = &self.rough else { return Some((refract(w, n, self.eta)?, 1.0)) };
        let u = [number(), number(), number()];
        let next = rough.sample(&flat(n), w, u).filter(|next| next.wi.dot(n) < 0.0)?;
        Some((next.wi, next.weight[0] / rough.passed(w.dot(n))))
    }

    /// A direction of light that is reflected which comes from `w`, likewise.
    pub fn mirror(&self, n: Vec3, w: Vec3, mut number: impl FnMut() -> f32) -> Option<(Vec3, f32)> {
        let Some(rough) = &self.rough else { return Some((reflect(w, n), 1.0)) };
        let u = [number(), number(), number()];
        let next = RoughReflection(rough).sample(&flat(n), w, u).filter(|next| next.wi.dot(n) > 0.0)?;
        Some((next.wi, next.weight[0] / (1.0 - rough.passed(w.dot(n)))))
    }
}

fn flat(n: Vec3) -> SurfacePoint {
    SurfacePoint { x: DVec3::ZERO, n_geometric: n, n, uv: [0.0; 2], error: 0.0 }
}

/// What a rough boundary reflects, without what goes through.
#[derive(Clone, Copy, Debug)]
pub struct RoughReflection<'a>(pub &'a RoughBoundary);

impl RoughReflection<'_> {
    /// Share of the samples that are reflected once.
    fn once(side: &Side, cosine: f32) -> f32 {
        let (once, again) = (side.once.at(cosine)[0], side.again(cosine) * (1.0 - side.through));
        if once + again > 0.0 { once / (once + again) } else { 0.0 }
    }

    /// f cosθ_i and the density of `wi` [1/sr], about the normal on the side of `wo`.
    fn value(&self, side: &Side, wo: Vec3, wi: Vec3) -> (f32, f32) {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return (0.0, 0.0);
        }
        let [(once, by_mirror), (again, by_lost)] = self.0.reflection(side, wo, wi);
        let share = Self::once(side, wo.z);
        (once + again, share * by_mirror + (1.0 - share) * by_lost)
    }
}

impl Bsdf for RoughReflection<'_> {
    fn eval(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3) -> Rgb {
        let (side, _, n) = self.0.seen_from(at, wo);
        let wi = local(n, wi);
        if wi.z > 0.0 { Rgb::splat(self.value(side, local(n, wo), wi).0 / wi.z) } else { Rgb::BLACK }
    }

    fn sample(&self, at: &SurfacePoint, wo: Vec3, [u, v, which]: [f32; 3]) -> Option<BsdfSample> {
        let (side, _, n) = self.0.seen_from(at, wo);
        let own = local(n, wo);
        let wi = if which < Self::once(side, own.z) {
            self.0.facets().sample(own, [u, v])
        } else {
            side.lost.sample([u, v])
        };
        let (value, pdf) = self.value(side, own, wi);
        (pdf > 0.0).then(|| BsdfSample { wi: frame(n) * wi, weight: Rgb::splat(value / pdf), pdf })
    }

    fn pdf(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3) -> f32 {
        let (side, _, n) = self.0.seen_from(at, wo);
        self.value(side, local(n, wo), local(n, wi)).1
    }

    fn albedo(&self) -> Rgb {
        self.0.albedo()
    }

    fn text(&self) -> String {
        format!("what is reflected of a {}", self.0.text())
    }
}
