//! Metals: smooth mirrors, or rough.

use super::microfacets::{DirectionalAlbedo, Microfacets, RoughMirror, local};
use super::{Bsdf, BsdfSample};
use crate::geometry::SurfacePoint;
use crate::math::{Rgb, Vec3, frame};
use crate::optics::reflect;

/// What a metal reflects of unpolarised light that falls on a smooth piece of it from air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reflectance {
    /// By its complex index of refraction n + ik.
    Index {
        /// n.
        n: Rgb,
        /// k.
        k: Rgb,
    },
    /// By what it reflects at normal incidence, in [0, 1]: R + (1 - R) (1 - μ)⁵ [Schlick 1994].
    Normal(Rgb),
}

impl Reflectance {
    /// For the cosine of incidence `mu`.
    pub fn at(&self, mu: f32) -> Rgb {
        match *self {
            Self::Index { n, k } => Rgb::from_fn(|c| of_metal(n[c].into(), k[c].into(), mu.into()) as f32),
            Self::Normal(r) => {
                let rise = (1.0 - mu.clamp(0.0, 1.0)).powi(5);
                r.map(|r| r + (1.0 - r) * rise)
            }
        }
    }
}

/// Fresnel reflectance between air and n + ik, unpolarised.
fn of_metal(n: f64, k: f64, mu: f64) -> f64 {
    let mu = mu.clamp(0.0, 1.0);
    let (mu2, sine2, n2, k2) = (mu * mu, 1.0 - mu * mu, n * n, k * k);
    let t = n2 - k2 - sine2;
    let both = (t * t + 4.0 * n2 * k2).sqrt();
    let (t1, a) = (both + mu2, (0.5 * (both + t)).max(0.0).sqrt());
    let t2 = 2.0 * a * mu;
    let across = (t1 - t2) / (t1 + t2);
    let (t3, t4) = (mu2 * both + sine2 * sine2, t2 * sine2);
    0.5 * across * (1.0 + (t3 - t4) / (t3 + t4))
}

/// Measured metals: n and k at 610, 550 and 465 nm, between the rows of \[HGK74\].
pub const METALS: [(&str, Reflectance); 4] = [
    ("aluminium", index([1.250, 0.998, 0.688], [7.171, 6.508, 5.570])),
    ("copper", index([0.338, 0.943, 1.158], [3.096, 2.594, 2.451])),
    ("gold", index([0.509, 0.689, 1.640], [3.192, 2.459, 1.745])),
    ("silver", index([0.266, 0.251, 0.233], [4.093, 3.566, 2.787])),
];

const fn index(n: [f32; 3], k: [f32; 3]) -> Reflectance {
    Reflectance::Index { n: Rgb(n), k: Rgb(k) }
}

/// A metal. Points face the viewer; inside a medium it reflects as in air.
#[derive(Clone, Debug)]
pub struct Conductor {
    reflectance: Reflectance,
    roughness: f32,
    rough: Option<RoughMirror>,
    /// Over all directions, by the cosine.
    mean: Rgb,
}

impl Conductor {
    /// `roughness` in [0, 1].
    pub fn new(reflectance: Reflectance, roughness: f32) -> Self {
        let fresnel = |mu| reflectance.at(mu);
        let smooth = DirectionalAlbedo::new(None, fresnel).mean;
        let Some(facets) = Microfacets::new(roughness) else {
            return Self { reflectance, roughness, rough: None, mean: smooth };
        };
        let rough = RoughMirror::new(facets, smooth);
        let mean = DirectionalAlbedo::new(Some(facets), fresnel).mean + rough.mean_again();
        Self { reflectance, roughness, rough: Some(rough), mean }
    }
}

impl Bsdf for Conductor {
    fn eval(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3) -> Rgb {
        let Some(rough) = &self.rough else { return Rgb::BLACK };
        let n = at.normal_seen_from(wo);
        let (wo, wi) = (local(n, wo), local(n, wi));
        let (value, _) = rough.eval(wo, wi, |mu| self.reflectance.at(mu));
        if wi.z > 0.0 { value * (1.0 / wi.z) } else { Rgb::BLACK }
    }

    fn sample(&self, at: &SurfacePoint, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let Some(rough) = &self.rough else {
            let n = at.normal_seen_from(wo);
            return Some(BsdfSample { wi: reflect(wo, n), weight: self.reflectance.at(n.dot(wo)), pdf: 0.0 });
        };
        let n = at.normal_seen_from(wo);
        let own = local(n, wo);
        let wi = rough.sample(own, u);
        let (value, pdf) = rough.eval(own, wi, |mu| self.reflectance.at(mu));
        (pdf > 0.0).then(|| BsdfSample { wi: frame(n) * wi, weight: value * (1.0 / pdf), pdf })
    }

    fn pdf(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3) -> f32 {
        let Some(rough) = &self.rough else { return 0.0 };
        let n = at.normal_seen_from(wo);
        rough.eval(local(n, wo), local(n, wi), |_| Rgb::WHITE).1
    }

    fn is_delta(&self) -> bool {
        self.rough.is_none()
    }

    fn albedo(&self) -> Rgb {
        self.mean
    }

    fn text(&self) -> String {
        format!(
            "conductor, roughness {}, reflectance {:?} at normal incidence",
            self.roughness,
            self.reflectance.at(1.0).0
        )
    }
}
