//! Rough surfaces as tiny mirrors: the distribution of Trowbridge and Reitz (GGX) with Smith's masking [WMLT07, Heitz 2014], normals
//! drawn among those that are seen [DB23], and what single reflections lose of the light [KC17].

use crate::math::{Rgb, Vec3, frame};
use rayon::prelude::*;
use std::f32::consts::{FRAC_1_PI, PI, TAU};

/// Roughness below which a surface is smooth: its mirror image is then blurred by less than rounding makes of densities.
const SMOOTH: f32 = 1e-3;
/// Directions of a table of albedo, evenly spaced in the root of the cosine.
const DIRECTIONS: usize = 128;
/// Points of the square that an entry of the table is the mean over: multiples of powers of the root of x³ = x + 1, evenly spread.
const POINTS: usize = 8192;
const SPREAD: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
/// Steps of an integral over each part of the table.
const STEPS: usize = 16;

/// Slopes of the tiny mirrors of a surface; isotropic.
#[derive(Clone, Copy, Debug)]
pub struct Microfacets {
    /// Width of the distribution of slopes, above 0; the square of the roughness that is typed.
    alpha: f32,
}

impl Microfacets {
    /// `roughness` in [0, 1], its square being the width of the distribution of slopes; `None` of a smooth surface.
    pub fn new(roughness: f32) -> Option<Self> {
        let alpha = roughness * roughness;
        (alpha >= SMOOTH).then_some(Self { alpha })
    }

    /// Density of normals D(m) [1/sr] about n.
    fn density(self, m: Vec3) -> f32 {
        if m.z <= 0.0 {
            return 0.0;
        }
        let a2 = self.alpha * self.alpha;
        // 1 - cos² (1 - α²), which keeps its digits where the cosine is near 1.
        let d = m.x * m.x + m.y * m.y + m.z * m.z * a2;
        a2 / (PI * d * d)
    }

    /// Smith's Λ for the cosine to n: what is masked over what is seen.
    fn lambda(self, cosine: f32) -> f32 {
        let c2 = cosine * cosine;
        let tan2 = (1.0 - c2).max(0.0) / c2.max(f32::MIN_POSITIVE);
        0.5 * ((1.0 + self.alpha * self.alpha * tan2).sqrt() - 1.0)
    }

    /// f cosθ_i of single reflections by mirrors of the reflectance `fresnel`, which is asked with cosines at the mirror, and the density of `wi`
    /// by [`Self::sample`] [1/sr]. In coordinates about n; both directions above the surface.
    pub fn reflection(self, wo: Vec3, wi: Vec3, fresnel: impl Fn(f32) -> Rgb) -> (Rgb, f32) {
        let h = (wo + wi).normalize_or_zero();
        let (scale, masked) = (self.density(h) / (4.0 * wo.z), self.lambda(wo.z));
        let f = fresnel(wo.dot(h).clamp(0.0, 1.0)) * (scale / (1.0 + masked + self.lambda(wi.z)));
        (f, scale / (1.0 + masked))
    }

    /// Density of mirrors of normal `m` among those seen from `wo` [1/sr], and the share of the light along `wi` that others do not mask.
    pub fn seen(self, wo: Vec3, m: Vec3, wi: Vec3) -> (f32, f32) {
        let density = self.density(m) * wo.dot(m).max(0.0) / (wo.z * (1.0 + self.lambda(wo.z)));
        (density, 1.0 / (1.0 + self.lambda(wi.z)))
    }

    /// Of the light from `wi` that mirrors seen from `wo` reflect into it, the share that no others mask.
    pub fn reflected(self, wo: Vec3, wi: Vec3) -> f32 {
        let masked = 1.0 + self.lambda(wo.z);
        masked / (masked + self.lambda(wi.z))
    }

    /// A direction of light by a mirror among those seen from `wo`; it may lie below the surface.
    pub fn sample(self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let m = self.normal(wo, u);
        m * (2.0 * wo.dot(m)) - wo
    }

    /// The normal of a mirror among those seen from `wo`.
    pub fn normal(self, wo: Vec3, [u, v]: [f32; 2]) -> Vec3 {
        // Stretched, the mirrors are those of a sphere: a cap of it is what the direction reaches.
        let stretched = Vec3::new(self.alpha * wo.x, self.alpha * wo.y, wo.z).normalize();
        let z = (1.0 - u) * (1.0 + stretched.z) - stretched.z;
        let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        let (sin, cos) = (TAU * v).sin_cos();
        let m = Vec3::new(r * cos, r * sin, z) + stretched;
        Vec3::new(self.alpha * m.x, self.alpha * m.y, m.z.max(0.0)).normalize_or(Vec3::Z)
    }
}

/// Share of light that leaves by one reflection at tiny mirrors of some reflectance, by the cosine of its direction, in one channel each.
#[derive(Clone, Debug)]
pub struct DirectionalAlbedo {
    /// At cosines ((i + 1/2) / n)² and between them.
    table: Vec<Rgb>,
    /// Mean over directions, weighted by the cosine.
    pub mean: Rgb,
}

impl DirectionalAlbedo {
    /// Of a surface without roughness if `facets` is `None`; `fresnel` is asked with cosines at the mirror.
    pub fn new(facets: Option<Microfacets>, fresnel: impl Fn(f32) -> Rgb + Sync) -> Self {
        Self::by(|mu| {
            let Some(facets) = facets else { return fresnel(mu) };
            let wo = Vec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu);
            let by_mirror = |u| {
                let wi = facets.sample(wo, u);
                if wi.z <= 0.0 {
                    return Rgb::BLACK;
                }
                let (f, pdf) = facets.reflection(wo, wi, &fresnel);
                f * (1.0 / pdf)
            };
            mean_over_square(by_mirror)
        })
    }

    /// By what leaves along the cosines of the table.
    pub fn by(entry: impl Fn(f32) -> Rgb + Sync) -> Self {
        let entry = |i: usize| {
            let root = (i as f32 + 0.5) / DIRECTIONS as f32;
            entry(root * root)
        };
        let table: Vec<Rgb> = (0..DIRECTIONS).into_par_iter().map(entry).collect();
        let mut albedo = Self { table, mean: Rgb::BLACK };
        // ∫ 2 μ E dμ with μ = t².
        let steps = STEPS * DIRECTIONS;
        let part = |i: usize| {
            let t = (i as f32 + 0.5) / steps as f32;
            albedo.at(t * t) * (4.0 * t * t * t / steps as f32)
        };
        albedo.mean = (0..steps).map(part).fold(Rgb::BLACK, |sum, part| sum + part);
        albedo
    }

    /// For the cosine `mu`.
    pub fn at(&self, mu: f32) -> Rgb {
        let place = mu.max(0.0).sqrt() * DIRECTIONS as f32 - 0.5;
        // Beyond its ends along the last slope.
        let i = (place.max(0.0) as usize).min(DIRECTIONS - 2);
        let t = place - i as f32;
        (self.table[i] * (1.0 - t) + self.table[i + 1] * t).map(|e| e.clamp(0.0, 1.0))
    }
}

/// Mean of `f` over the unit square.
pub fn mean_over_square(f: impl Fn([f32; 2]) -> Rgb) -> Rgb {
    let mut sum = [0.0_f64; 3];
    for k in 0..POINTS {
        let part = f(SPREAD.map(|step| (0.5 + k as f64 * step).fract() as f32));
        (0..3).for_each(|c| sum[c] += f64::from(part[c]));
    }
    Rgb(sum.map(|s| (s / POINTS as f64) as f32))
}

/// Where light goes that single reflections or refractions lose: by its share along each direction, which is all at grazing where a surface is nearly smooth.
#[derive(Clone, Debug)]
pub struct Lost {
    /// Share along directions up to the cosine ((i + 1) / n)².
    cumulative: Vec<f32>,
    /// Mean of what is lost over directions, weighted by the cosine; above 0.
    pub mean: f32,
}

impl Lost {
    /// `lost` is the share of light along the direction of a cosine.
    pub fn new(lost: impl Fn(f32) -> f32) -> Self {
        let mut sum = 0.0;
        let up_to = |i: usize| {
            let part = |k: usize| {
                let t = (i as f32 + (k as f32 + 0.5) / STEPS as f32) / DIRECTIONS as f32;
                lost(t * t) * t * t * t
            };
            sum += (0..STEPS).map(part).sum::<f32>();
            sum
        };
        let mut cumulative: Vec<f32> = (0..DIRECTIONS).map(up_to).collect();
        let sum = sum.max(f32::MIN_POSITIVE);
        cumulative.iter_mut().for_each(|c| *c /= sum);
        Self { cumulative, mean: 4.0 * sum / (STEPS * DIRECTIONS) as f32 }
    }

    /// Density of the direction of cosine `mu` by [`Self::sample`] [1/sr].
    pub fn pdf(&self, mu: f32) -> f32 {
        let i = ((mu.max(0.0).sqrt() * DIRECTIONS as f32) as usize).min(DIRECTIONS - 1);
        let [from, to] = [i, i + 1].map(|k| (k as f32 / DIRECTIONS as f32).powi(4));
        let part = self.cumulative[i] - if i == 0 { 0.0 } else { self.cumulative[i - 1] };
        part * mu * FRAC_1_PI / (to - from)
    }

    /// A direction above the surface.
    pub fn sample(&self, [u, v]: [f32; 2]) -> Vec3 {
        let i = self.cumulative.partition_point(|&c| c <= u).min(DIRECTIONS - 1);
        let below = if i == 0 { 0.0 } else { self.cumulative[i - 1] };
        let t = ((u - below) / (self.cumulative[i] - below).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        let [from, to] = [i, i + 1].map(|k| (k as f32 / DIRECTIONS as f32).powi(4));
        let z2 = from + (to - from) * t;
        let (r, (sin, cos)) = ((1.0 - z2).max(0.0).sqrt(), (TAU * v).sin_cos());
        Vec3::new(r * cos, r * sin, z2.sqrt())
    }
}

/// Reflection by tiny mirrors, and what they throw to one another: the light that single reflections of perfect mirrors would lose comes
/// back evenly, by reciprocal shares [KC17].
#[derive(Clone, Debug)]
pub struct RoughMirror {
    facets: Microfacets,
    /// Of perfect mirrors, alike in all channels.
    perfect: DirectionalAlbedo,
    /// Reflectance of what is reflected more than once.
    again: Rgb,
    /// Where that goes.
    lost: Lost,
}

impl RoughMirror {
    /// `mean_reflectance`: of a mirror, over all directions by the cosine.
    pub fn new(facets: Microfacets, mean_reflectance: Rgb) -> Self {
        let perfect = DirectionalAlbedo::new(Some(facets), |_| Rgb::WHITE);
        let kept = perfect.mean[0];
        let again = mean_reflectance.map(|f| f * f * kept / (1.0 - f * (1.0 - kept)));
        let lost = Lost::new(|mu| 1.0 - perfect.at(mu)[0]);
        Self { facets, perfect, again, lost }
    }

    /// Albedo of what is reflected more than once, over all directions by the cosine.
    pub fn mean_again(&self) -> Rgb {
        self.again * (1.0 - self.perfect.mean[0])
    }

    /// Share of the samples of `wo` that are of light reflected more than once.
    fn share_again(&self, wo: Vec3) -> f32 {
        1.0 - self.perfect.at(wo.z)[0]
    }

    /// f cosθ_i and the density [1/sr] of `wi`, in coordinates about n.
    pub fn eval(&self, wo: Vec3, wi: Vec3, fresnel: impl Fn(f32) -> Rgb) -> (Rgb, f32) {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return (Rgb::BLACK, 0.0);
        }
        let (once, pdf) = self.facets.reflection(wo, wi, fresnel);
        let share = self.share_again(wo);
        let lost = share * self.share_again(wi) / (1.0 - self.perfect.mean[0]).max(f32::MIN_POSITIVE);
        let again = self.again * (lost * wi.z * FRAC_1_PI);
        (once + again, (1.0 - share) * pdf + share * self.lost.pdf(wi.z))
    }

    /// A direction of light; it may lie below the surface, where its share is none.
    pub fn sample(&self, wo: Vec3, [u, v, which]: [f32; 3]) -> Vec3 {
        if which < self.share_again(wo) {
            return self.lost.sample([u, v]);
        }
        self.facets.sample(wo, [u, v])
    }
}

/// `w` in coordinates about the unit vector `n`.
pub fn local(n: Vec3, w: Vec3) -> Vec3 {
    frame(n).transpose() * w
}
