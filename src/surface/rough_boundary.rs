//! Rough boundaries between two media: ground glass, matt marble, skin.

use super::microfacets::{DirectionalAlbedo, Lost, Microfacets, local, mean_over_square};
use super::{Bsdf, BsdfSample};
use crate::geometry::SurfacePoint;
use crate::math::{Rgb, Vec3, frame};
use crate::optics::{FresnelMoments, reflectance, refract};
use std::f32::consts::FRAC_1_PI;
use std::sync::Arc;

/// A dielectric boundary of tiny smooth ones \[WMLT07\]. What single reflections and refractions lose of the light is what the tiny boundaries throw to
/// one another: it leaves evenly, on both sides, by reciprocal shares as \[KC17\] has them for reflection, so that no light is lost.
///
/// Radiance is over the square of the index throughout, as in [`super::Boundary`]: f is symmetric when cosines behind the boundary count η² times.
#[derive(Clone, Debug)]
pub struct RoughBoundary {
    eta: f32,
    roughness: f32,
    facets: Microfacets,
    /// Of light that comes from outside, and from inside.
    sides: Arc<[Side; 2]>,
}

/// Light that comes from one side.
#[derive(Debug)]
pub(super) struct Side {
    /// n behind over n before the boundary.
    pub eta: f32,
    /// Share that is reflected once, that is refracted once, and both together, by the cosine of its direction.
    pub once: DirectionalAlbedo,
    /// Where all other light goes that leaves on this side.
    pub lost: Lost,
    /// Share of all other light that goes through.
    pub through: f32,
}

impl Side {
    fn new(eta: f32, facets: Microfacets) -> Self {
        let once = DirectionalAlbedo::by(|mu| {
            let wo = Vec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu);
            mean_over_square(|u| {
                let m = facets.normal(wo, u);
                let cosine = wo.dot(m).clamp(0.0, 1.0);
                let mirrored = reflectance(eta, cosine);
                let back = m * (2.0 * cosine) - wo;
                let reflected = if back.z > 0.0 { mirrored * facets.reflected(wo, back) } else { 0.0 };
                let on = refract(wo, m, eta).filter(|wi| wi.z < 0.0);
                let refracted = on.map_or(0.0, |wi| (1.0 - mirrored) * facets.seen(wo, m, wi).1);
                Rgb([reflected, refracted, reflected + refracted])
            })
        });
        let lost = Lost::new(|mu| 1.0 - once.at(mu)[2]);
        Self { eta, once, lost, through: 0.0 }
    }

    /// Share of light along a direction that is neither reflected nor refracted but once.
    pub fn again(&self, cosine: f32) -> f32 {
        1.0 - self.once.at(cosine)[2]
    }

    /// Share of light along a direction that goes through.
    fn passed(&self, cosine: f32) -> f32 {
        self.once.at(cosine)[1] + self.again(cosine) * self.through
    }
}

/// Fresnel's reflectance of the tiny boundary that reflects `wi` into `wo`.
fn mirrored(side: &Side, wo: Vec3, wi: Vec3) -> f32 {
    reflectance(side.eta, wo.dot((wo + wi).normalize_or_zero()).clamp(0.0, 1.0))
}

impl RoughBoundary {
    /// `eta` = n_inside / n_outside, above 0; `roughness` in [0, 1], its square being the width of the distribution of slopes. `None` of a boundary that is smooth, or
    /// between equal media.
    pub fn new(eta: f32, roughness: f32) -> Option<Self> {
        let facets = Microfacets::new(roughness).filter(|_| eta != 1.0)?;
        let [mut outside, mut inside] = [eta, 1.0 / eta].map(|eta| Side::new(eta, facets));
        // Through it goes as much either way: η² times as much even light comes from inside.
        let mean = 1.0 - FresnelMoments::new(1.0 / f64::from(eta)).two_c1 as f32;
        let lost = [outside.lost.mean, inside.lost.mean];
        let (outer, inner) = (mean, mean / (eta * eta));
        let least = lost[0].min(lost[1]);
        (outside.through, inside.through) = (outer * least / lost[0], inner * least / lost[1]);
        Some(Self { eta, roughness, facets, sides: Arc::new([outside, inside]) })
    }

    /// Share of light along a direction outside, of this cosine to the normal, that goes in; by reciprocity, what of even light inside leaves along it.
    pub fn passed(&self, cosine: f32) -> f32 {
        self.sides[0].passed(cosine)
    }

    /// What diffusion asks of a boundary.
    pub fn moments(&self) -> FresnelMoments {
        let [outside, inside] = [0, 1].map(|side| {
            let side = &self.sides[side];
            (f64::from(side.once.mean[1] + side.lost.mean * side.through), side)
        });
        FresnelMoments::of_transmittance(outside.0, f64::from(self.eta), |mu| f64::from(inside.1.passed(mu as f32)))
    }

    /// f cosθ_i of what is reflected once, and more often, each with the density of `wi` where that is sampled [1/sr]; both directions above the
    /// surface.
    pub(super) fn reflection(&self, side: &Side, wo: Vec3, wi: Vec3) -> [(f32, f32); 2] {
        let m = (wo + wi).normalize_or_zero();
        let by_mirror = self.facets.seen(wo, m, wi).0 / (4.0 * wo.dot(m)).max(f32::MIN_POSITIVE);
        let once = by_mirror * mirrored(side, wo, wi) * self.facets.reflected(wo, wi);
        let again = side.again(wo.z) * (1.0 - side.through) * side.again(wi.z) / side.lost.mean * wi.z * FRAC_1_PI;
        [(once, by_mirror), (again, side.lost.pdf(wi.z))]
    }

    /// Slopes of the tiny boundaries.
    pub(super) fn facets(&self) -> Microfacets {
        self.facets
    }

    /// Share of light along a direction inside that goes out.
    pub fn passed_from_inside(&self, cosine: f32) -> f32 {
        self.sides[1].passed(cosine)
    }

    /// f cosθ_i and the density of `wi` [1/sr], about the normal on the side of `wo`.
    fn value(&self, side: &Side, other: &Side, wo: Vec3, wi: Vec3) -> (f32, f32) {
        if wo.z <= 0.0 || wi.z == 0.0 {
            return (0.0, 0.0);
        }
        let (again, even) = (side.again(wo.z), wi.z.abs() * FRAC_1_PI);
        if wi.z > 0.0 {
            let [(once, by_mirror), (more, by_lost)] = self.reflection(side, wo, wi);
            (once + more, (1.0 - again) * mirrored(side, wo, wi) * by_mirror + again * (1.0 - side.through) * by_lost)
        } else {
            let m = -(wo + wi * side.eta).normalize_or_zero();
            let m = if m.z < 0.0 { -m } else { m };
            let (a, b) = (wo.dot(m), wi.dot(m));
            let (f, pdf) = if a > 0.0 && b < 0.0 {
                let (density, open) = self.facets.seen(wo, m, wi);
                let narrowed = side.eta * side.eta * -b / (a + side.eta * b).powi(2);
                let pdf = density * (1.0 - reflectance(side.eta, a.min(1.0))) * narrowed;
                (pdf * open, pdf)
            } else {
                (0.0, 0.0)
            };
            let share = side.through;
            (
                f + again * share * other.again(-wi.z) / other.lost.mean * even,
                (1.0 - again) * pdf + again * share * other.lost.pdf(-wi.z),
            )
        }
    }

    /// The side of `wo`, the other, and the normal there.
    pub(super) fn seen_from(&self, at: &SurfacePoint, wo: Vec3) -> (&Side, &Side, Vec3) {
        let [outside, inside] = &*self.sides;
        if at.n.dot(wo) >= 0.0 { (outside, inside, at.n) } else { (inside, outside, -at.n) }
    }
}

impl Bsdf for RoughBoundary {
    fn eval(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3) -> Rgb {
        let (side, other, n) = self.seen_from(at, wo);
        let wi = local(n, wi);
        if wi.z == 0.0 { Rgb::BLACK } else { Rgb::splat(self.value(side, other, local(n, wo), wi).0 / wi.z.abs()) }
    }

    fn sample(&self, at: &SurfacePoint, wo: Vec3, [u, v, which]: [f32; 3]) -> Option<BsdfSample> {
        let (side, other, n) = self.seen_from(at, wo);
        let own = local(n, wo);
        let once = 1.0 - side.again(own.z);
        let wi = if which < once {
            let m = self.facets.normal(own, [u, v]);
            let cosine = own.dot(m).clamp(0.0, 1.0);
            if which < once * reflectance(side.eta, cosine) {
                Some(m * (2.0 * cosine) - own).filter(|wi| wi.z > 0.0)?
            } else {
                refract(own, m, side.eta).filter(|wi| wi.z < 0.0)?
            }
        } else {
            let reflected = which < once + (1.0 - once) * (1.0 - side.through);
            if reflected { side.lost.sample([u, v]) } else { -other.lost.sample([u, v]) }
        };
        let (value, pdf) = self.value(side, other, own, wi);
        (pdf > 0.0).then(|| BsdfSample { wi: frame(n) * wi, weight: Rgb::splat(value / pdf), pdf })
    }

    fn pdf(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3) -> f32 {
        let (side, other, n) = self.seen_from(at, wo);
        self.value(side, other, local(n, wo), local(n, wi)).1
    }

    /// Of what comes from outside and is reflected.
    fn albedo(&self) -> Rgb {
        let side = &self.sides[0];
        Rgb::splat(1.0 - side.once.mean[1] - side.lost.mean * side.through)
    }

    fn text(&self) -> String {
        format!("rough boundary, eta {}, roughness {}", self.eta, self.roughness)
    }
}
