//! Triangle-mesh area lights, and the environment beside them.

use super::{Arrival, CountedLight, LampPoint, Sky, SunDirection};
use crate::geometry::{AreaTable, SurfacePoint};
use crate::math::{Aabb, Rgb, Vec3};
use crate::query::{Hit, Ray};
use crate::sampling::cosine_hemisphere;
use crate::scene::{Emission, Scene};
use std::f32::consts::PI;

/// A lamp of this share of its area and that of a disk with its distance as radius: from there on the cosine has less noise
/// than points of the lamp. For the middle of a disk, (a² + h²)² / (3 a² h²) - 1 against h² / a², the relative variances
/// cross at h² = a²/2.
const NEAR: f32 = 2.0 / 3.0;

/// Everything that shines in a scene. Tables exist for emissive meshes only.
pub struct Lights {
    emitters: Vec<Emitter>,
    /// Chance of each emitter and of all before it, in proportion to emitted power.
    cumulative: Vec<f64>,
    sky: Sky,
}

struct Emitter {
    object: u32,
    table: AreaTable,
    radiance: Rgb,
    two_sided: bool,
    /// Chance of a point per area [1/unit²]: the emitter's own chance over its area.
    pdf_area: f32,
    bounds: Aabb,
}

impl Lights {
    /// The number of the suns; lamps have those after it.
    pub const SUNS: usize = 0;

    /// The lights of a scene; an emissive mesh without area or radiance is no light.
    pub fn new(scene: &Scene) -> Self {
        let mut emitters = Vec::new();
        let mut cumulative = Vec::new();
        let mut power = 0.0;
        for (object, o) in scene.objects.iter().enumerate() {
            let Some(Emission { radiance, two_sided }) = scene.materials[o.material].surface.emission else { continue };
            if radiance.is_black() {
                continue;
            }
            let (Some(table), Some(bounds)) = (AreaTable::new(&o.mesh), o.mesh.bounds()) else { continue };
            power += table.area() * radiance.mean_f64() * if two_sided { 2.0 } else { 1.0 };
            cumulative.push(power);
            emitters.push(Emitter { object: object as u32, table, radiance, two_sided, pdf_area: 0.0, bounds });
        }
        let mut below = 0.0;
        for (emitter, sum) in emitters.iter_mut().zip(&mut cumulative) {
            *sum /= power;
            emitter.pdf_area = ((*sum - below) / emitter.table.area()) as f32;
            below = *sum;
        }
        Self { emitters, cumulative, sky: Sky::new(&scene.environment) }
    }

    /// Whether there are area lights.
    pub fn has_emitters(&self) -> bool {
        !self.emitters.is_empty()
    }

    /// Whether light arrives from the environment.
    pub fn has_environment(&self) -> bool {
        !self.sky.is_black()
    }

    /// Each light that is counted: all that can be asked for. Others, such as an even sky, no path misses.
    pub fn counted(&self, scene: &Scene) -> Vec<CountedLight> {
        let name = "the bright part of the environment's picture".to_string();
        let suns = self.has_suns().then_some(CountedLight { number: Self::SUNS, name, chance: 1.0 });
        let mut below = 0.0;
        let lamp = |(i, (e, &sum)): (usize, (&Emitter, &f64))| {
            let chance = sum - std::mem::replace(&mut below, sum);
            CountedLight { number: Self::SUNS + 1 + i, name: scene.objects[e.object as usize].name.clone(), chance }
        };
        suns.into_iter().chain(self.emitters.iter().zip(&self.cumulative).enumerate().map(lamp)).collect()
    }

    /// The number of the object number `object`; `None` if it is no light.
    pub fn number(&self, object: u32) -> Option<usize> {
        self.emitters.iter().position(|e| e.object == object).map(|i| Self::SUNS + 1 + i)
    }

    /// The number of the suns, if one is in the direction `w`.
    pub fn number_of_sun(&self, w: Vec3) -> Option<usize> {
        (self.pdf_sun(w) > 0.0).then_some(Self::SUNS)
    }

    /// Whether a picture of the environment has suns: parts so bright that they are asked for like lamps.
    pub fn has_suns(&self) -> bool {
        self.sky.has_suns()
    }

    /// Share of the environment's light that comes from elsewhere than suns.
    pub fn share_beside_suns(&self) -> f32 {
        self.sky.share_beside_suns()
    }

    /// Mean radiance of the suns, by what they send; 0 without any.
    pub fn radiance_of_suns(&self) -> f32 {
        self.sky.radiance_of_suns()
    }

    /// Solid angle [sr] of an even light as hard to meet as the suns; 0 without any.
    pub fn solid_angle_of_suns(&self) -> f32 {
        self.sky.solid_angle_of_suns()
    }

    /// A direction of the suns, picked by what they send; `None` without any.
    pub fn sun(&self, u: [f32; 3]) -> Option<SunDirection> {
        self.sky.sun(u)
    }

    /// Chance per solid angle [1/sr] of `w` by [`Self::sun`]; 0 where no sun is.
    #[inline]
    pub fn pdf_sun(&self, w: Vec3) -> f32 {
        self.sky.pdf_sun(w)
    }

    /// Light from a direction of the suns; `None` where it comes from behind the surface.
    pub fn sample_sun(&self, at: &SurfacePoint, u: [f32; 3]) -> Option<Arrival> {
        let SunDirection { w, radiance, pdf_angle } = self.sun(u)?;
        let (w, shadow) = looking(at, w)?;
        let irradiance = radiance * (at.n.dot(w) / pdf_angle);
        Some(Arrival { w, irradiance, pdf_angle, shadow, light: Some(Self::SUNS) })
    }

    /// Radiance from outside the scene out of the direction of the unit vector `w`; black without an environment.
    #[inline]
    pub fn environment(&self, w: Vec3) -> Rgb {
        self.sky.radiance(w)
    }

    /// What is said of the environment in a list of parts.
    pub fn environment_text(&self) -> String {
        self.sky.text()
    }

    /// Mean radiance of the area lights, by power and over the channels; 0 without any.
    pub fn mean_radiance(&self) -> f32 {
        let mut below = 0.0;
        let weighted = self.emitters.iter().zip(&self.cumulative).map(|(emitter, &sum)| {
            let chance = sum - below;
            below = sum;
            emitter.radiance.mean() * chance as f32
        });
        weighted.sum()
    }

    /// Triangles in the light table.
    pub fn triangles(&self) -> usize {
        self.emitters.iter().map(|e| e.table.len()).sum()
    }

    /// Number of emissive meshes.
    pub fn emitters(&self) -> usize {
        self.emitters.len()
    }

    /// A random point of the area lights, picked by power and area; `None` without any.
    pub fn point(&self, scene: &Scene, u: [f32; 3]) -> Option<LampPoint> {
        let pick = f64::from(u[0]);
        let chosen = self.cumulative.partition_point(|&c| c <= pick).min(self.emitters.len().checked_sub(1)?);
        let emitter = &self.emitters[chosen];
        let below = if chosen == 0 { 0.0 } else { self.cumulative[chosen - 1] };
        let within = (pick - below) / (self.cumulative[chosen] - below);
        let sample = emitter.table.sample(within, [u[1], u[2]]);
        let at = scene.objects[emitter.object as usize].mesh.point(sample.triangle, sample.u, sample.v);
        let Emitter { object, radiance, two_sided, pdf_area, .. } = *emitter;
        Some(LampPoint { at, object, radiance, two_sided, pdf_area, light: Self::SUNS + 1 + chosen })
    }

    /// Chance per area [1/unit²] that [`Self::point`] picks a point of the object number `object`; 0 if it is no light.
    pub fn pdf_area(&self, object: u32) -> f32 {
        self.emitters.iter().find(|e| e.object == object).map_or(0.0, |e| e.pdf_area)
    }

    /// Light from a random point of the area lights, picked by power and area; `None` where it comes from behind
    /// the surface or leaves the light at its dark side.
    pub fn sample_emitter(&self, scene: &Scene, at: &SurfacePoint, u: [f32; 3]) -> Option<Arrival> {
        Self::from_point(&self.point(scene, u)?, at)
    }

    /// Light from `lamp`; `None` as in [`Self::sample_emitter`].
    pub fn from_point(lamp: &LampPoint, at: &SurfacePoint) -> Option<Arrival> {
        let to_light = (lamp.at.x - at.x).as_vec3();
        let distance = to_light.length();
        if distance <= 0.0 {
            return None;
        }
        let w = to_light / distance;
        let (cos, cos_light) = (at.n.dot(w), lamp.cosine(w));
        if cos <= 0.0 || cos_light <= 0.0 || at.n_geometric.dot(w) <= 0.0 {
            return None;
        }
        // Divided one length at a time: distance² leaves the range of f32 long before the quotient does.
        let solid_angle = cos_light / distance / distance / lamp.pdf_area;
        let shadow = Ray::between(at.leave(w), lamp.at.arrive(w, at.x, at.error));
        let irradiance = lamp.radiance * (cos * solid_angle);
        Some(Arrival { w, irradiance, pdf_angle: 1.0 / solid_angle, shadow, light: Some(lamp.light) })
    }

    /// Light of the environment from one of the directions of [`Self::look_around`].
    pub fn sample_environment(&self, at: &SurfacePoint, u: [f32; 2]) -> Option<Arrival> {
        let (w, shadow) = self.look_around(at, u)?;
        let pdf_angle = self.pdf_around(at, w);
        let irradiance = self.sky.radiance(w) * (at.n.dot(w) / pdf_angle);
        Some(Arrival { w, irradiance, pdf_angle, shadow, light: self.number_of_sun(w) })
    }

    /// Chance per solid angle [1/sr] that [`Self::sample_emitter`] looks from `x` along the unit vector `w` to `hit`.
    pub fn pdf_angle(&self, scene: &Scene, hit: &Hit, w: Vec3) -> f32 {
        let Some(emitter) = self.emitters.iter().find(|e| e.object == hit.mesh) else { return 0.0 };
        let cos = scene.objects[hit.mesh as usize].mesh.geometric_normal(hit.triangle).dot(w).abs();
        hit.t * emitter.pdf_area * hit.t / cos
    }

    /// Share of directions that are better picked by the cosine for a body within `bounds`: half with an environment, none
    /// without, unless an emitter is nearer than it is wide: from there its points have densities that differ without
    /// bound.
    pub fn cosine_share(&self, bounds: Aabb) -> f32 {
        if self.has_environment() {
            return if self.has_emitters() { 0.5 } else { 1.0 };
        }
        let seen = |e: &Emitter| {
            let gap = e.bounds.distance(&bounds) as f32;
            let area = e.table.area() as f32;
            area / (area + PI * gap * gap)
        };
        let largest = self.emitters.iter().map(seen).fold(0.0, f32::max);
        if largest > NEAR { 0.5 * largest } else { 0.0 }
    }

    /// A cosine-weighted direction about the surface's normal and the ray that looks there.
    pub fn look_up(at: &SurfacePoint, u: [f32; 2]) -> Option<(Vec3, Ray)> {
        looking(at, cosine_hemisphere(at.n, u))
    }

    /// As [`Self::look_up`], but under a picture of the environment half of the directions are those it shines from.
    pub fn look_around(&self, at: &SurfacePoint, u: [f32; 2]) -> Option<(Vec3, Ray)> {
        looking(at, self.sky.sample(at.n, u))
    }

    /// Chance per solid angle [1/sr] of the direction `w` by [`Self::look_around`].
    pub fn pdf_around(&self, at: &SurfacePoint, w: Vec3) -> f32 {
        self.sky.pdf(at.n, w)
    }
}

fn looking(at: &SurfacePoint, w: Vec3) -> Option<(Vec3, Ray)> {
    (at.n.dot(w) > 0.0 && at.n_geometric.dot(w) > 0.0).then(|| (w, Ray::new(at.leave(w), w)))
}
