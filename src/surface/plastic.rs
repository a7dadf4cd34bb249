//! A matt body under a clear coat: plastic, glazed china, varnished wood.

use super::microfacets::{DirectionalAlbedo, Microfacets, local};
use super::{Bsdf, BsdfSample, Colour, Texture};
use crate::geometry::SurfacePoint;
use crate::math::{Rgb, Vec3, frame};
use crate::optics::{reflect, reflectance};
use crate::sampling::hemisphere;
use std::f32::consts::FRAC_1_PI;
use std::sync::Arc;

/// A dielectric coat, smooth or rough, over a matt body: what the coat does not mirror comes back by the body's albedo, in reciprocal
/// shares, so that a white one loses no light \[KSK01\]. Points face the viewer.
#[derive(Clone, Debug)]
pub struct Plastic {
    albedo: Colour,
    eta: f32,
    roughness: f32,
    /// Of the coat; `None` of a smooth one. What its tiny mirrors throw to one another goes into the body.
    facets: Option<Microfacets>,
    /// Of the coat alone.
    coat: DirectionalAlbedo,
}

impl Plastic {
    /// `albedo` of the matt body in [0, 1]; `eta` of the coat over air's, at least 1; `roughness` in [0, 1].
    pub fn new(albedo: impl Into<Colour>, eta: f32, roughness: f32) -> Self {
        let fresnel = |mu| Rgb::splat(reflectance(eta, mu));
        let facets = Microfacets::new(roughness);
        Self { albedo: albedo.into(), eta, roughness, facets, coat: DirectionalAlbedo::new(facets, fresnel) }
    }

    /// Share of even light that comes back, the body being of this albedo.
    fn with_coat(&self, albedo: Rgb) -> Rgb {
        let coat = self.coat.mean[0];
        albedo.map(|a| coat + a * (1.0 - coat))
    }

    fn fresnel(&self, mu: f32) -> Rgb {
        Rgb::splat(reflectance(self.eta, mu))
    }

    /// Share of light along a direction that the coat lets through.
    fn passed(&self, cosine: f32) -> f32 {
        1.0 - self.coat.at(cosine)[0]
    }

    /// f of the matt body of this albedo.
    fn body(&self, albedo: Rgb, wo: Vec3, wi: Vec3) -> Rgb {
        let shares = self.passed(wo.z) * self.passed(wi.z) / (1.0 - self.coat.mean[0]);
        albedo * (shares * FRAC_1_PI)
    }

    /// Share of the samples that are of the coat.
    fn by_coat(&self, albedo: Rgb, wo: Vec3) -> f32 {
        let coat = self.coat.at(wo.z)[0];
        let body = albedo.max() * (1.0 - coat);
        if coat + body > 0.0 { coat / (coat + body) } else { 0.0 }
    }

    /// f cosθ_i and the density of `wi` [1/sr], without what a smooth coat mirrors.
    fn value(&self, albedo: Rgb, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return (Rgb::BLACK, 0.0);
        }
        let share = self.by_coat(albedo, wo);
        let (body, by_body) = (self.body(albedo, wo, wi) * wi.z, (1.0 - share) * wi.z * FRAC_1_PI);
        match self.facets {
            None => (body, by_body),
            Some(facets) => {
                let (coat, by_coat) = facets.reflection(wo, wi, |mu| self.fresnel(mu));
                (body + coat, by_body + share * by_coat)
            }
        }
    }
}

impl Bsdf for Plastic {
    fn eval(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3) -> Rgb {
        let n = at.normal_seen_from(wo);
        let (wo, wi) = (local(n, wo), local(n, wi));
        if wi.z > 0.0 { self.value(self.albedo.at(at), wo, wi).0 * (1.0 / wi.z) } else { Rgb::BLACK }
    }

    fn sample(&self, at: &SurfacePoint, wo: Vec3, [u, v, which]: [f32; 3]) -> Option<BsdfSample> {
        let n = at.normal_seen_from(wo);
        let (own, albedo) = (local(n, wo), self.albedo.at(at));
        let share = self.by_coat(albedo, own);
        let wi = match self.facets {
            None if which < share => {
                let weight = self.fresnel(n.dot(wo)) * (1.0 / share);
                return Some(BsdfSample { wi: reflect(wo, n), weight, pdf: 0.0 });
            }
            Some(facets) if which < share => facets.sample(own, [u, v]),
            _ => Vec3::from_array(hemisphere([u, v])),
        };
        let (value, pdf) = self.value(albedo, own, wi);
        (pdf > 0.0).then(|| BsdfSample { wi: frame(n) * wi, weight: value * (1.0 / pdf), pdf })
    }

    fn pdf(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3) -> f32 {
        let n = at.normal_seen_from(wo);
        self.value(self.albedo.at(at), local(n, wo), local(n, wi)).1
    }

    fn albedo(&self) -> Rgb {
        self.with_coat(self.albedo.mean())
    }

    fn albedo_at(&self, at: &SurfacePoint) -> Rgb {
        self.with_coat(self.albedo.at(at))
    }

    fn textures(&self) -> Vec<&Arc<Texture>> {
        self.albedo.picture().into_iter().collect()
    }

    fn text(&self) -> String {
        format!("plastic, albedo {}, eta {}, roughness {}", self.albedo.text(), self.eta, self.roughness)
    }
}
