//! Light arriving at a surface point or at a collision, before anything stands in its way.
//! Not for: what the surface does with it (`integrator`, `cache`). Read first: [`Lights`], which is what callers ask; then
//! [`Light`], one kind of light and one file each: `area.rs`, `point.rs`, `distant.rs`, `sun.rs`, `suns.rs` of a picture, `sky.rs`.

mod area;
mod bounds;
mod choice;
mod distant;
mod lights;
mod picture;
mod point;
mod sky;
mod sun;
mod suns;
mod tree;

use crate::geometry::SurfacePoint;
use crate::math::{Aabb, DVec3, Rgb, Vec3};
use crate::query::{Hit, Ray};
use crate::scene::{Emission, Scene};
pub use area::AreaLight;
pub use bounds::{Cone, LightBounds};
pub use choice::Choice;
pub use distant::Distant;
pub use lights::{Group, Lights};
pub use point::PointLight;
pub use sky::Sky;
pub use sun::Sun;
pub use suns::Suns;
pub use tree::Pick;

/// One light. Which of them is asked is the choice of [`Lights`].
pub trait Light: Send + Sync {
    /// What the user calls it.
    fn name(&self, scene: &Scene) -> String;

    /// What it sends, mean over the channels: flux [radiance unit x sr x unit²] of a light at a place, irradiance across its
    /// direction [radiance unit x sr] of one far away.
    fn power(&self) -> f64;

    /// Its radiance, mean over the channels and by what it sends. A delta light has that of one that would send the same and be no trouble to meet.
    fn mean_radiance(&self) -> f32;

    /// Where it is and into which directions it shines; `None` of a light far away.
    fn bounds(&self) -> Option<LightBounds>;

    /// The object whose surface it is.
    fn object(&self) -> Option<u32> {
        None
    }

    /// Area of its surface \[unit²\]; 0 without one.
    fn area(&self) -> f64 {
        0.0
    }

    /// Solid angle that a light far away fills, by an even light with the same power and mean square \[sr\]; 0 of a single direction.
    fn solid_angle(&self) -> f64 {
        0.0
    }

    /// Whether what it sends is part of the environment's picture.
    fn in_picture(&self) -> bool {
        false
    }

    /// Whether it is a single place or direction: no ray meets it by chance.
    fn is_delta(&self) -> bool {
        false
    }

    /// A point of it, or a direction to it, with its own density. `pick` and `u` in [0, 1), three numbers.
    fn sample(&self, scene: &Scene, from: &Reference, pick: f64, u: [f32; 2]) -> Option<LightSample>;

    /// Density by [`Self::sample`] of a point of it that was met [1/unit²], or, far away, of the unit direction `w` [1/sr]; 0
    /// where it is not.
    fn pdf(&self, from: &Reference, w: Vec3) -> f64;

    /// Radiance that a ray along `w` meets that leaves the scene; of suns none, for the sky's picture has theirs.
    fn radiance(&self, _w: Vec3) -> Rgb {
        Rgb::BLACK
    }
}

/// Where light is asked for.
#[derive(Clone, Copy, Debug)]
pub struct Reference {
    /// The place.
    pub x: DVec3,
    /// Unit normal of a surface that takes light from above it alone; `None` in a medium.
    pub n: Option<Vec3>,
    /// Light leaves lamps for places within this distance [unit]: of a collision, to which light is refracted somewhere on its body;
    /// 0 on a surface.
    pub reach: f32,
}

impl Reference {
    /// A point of a surface.
    #[inline]
    pub fn surface(at: &SurfacePoint) -> Self {
        Self { x: at.x, n: Some(at.n), reach: 0.0 }
    }

    /// A place in a medium that light comes to straight.
    #[inline]
    pub fn place(x: DVec3) -> Self {
        Self { x, n: None, reach: 0.0 }
    }

    /// A body within `bounds`, no place of it in particular.
    pub fn body(bounds: &Aabb) -> Self {
        Self::inside(bounds.centre(), bounds)
    }

    /// A collision in a body within `bounds`.
    #[inline]
    pub fn inside(x: DVec3, bounds: &Aabb) -> Self {
        let farthest = (bounds.lower - x).abs().max((bounds.upper - x).abs());
        Self { x, n: None, reach: farthest.length() as f32 }
    }
}

/// A point of a light, or a direction to it, that was drawn.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Which.
    pub end: LightEnd,
    /// Radiance from there; of a delta light intensity [radiance unit x unit²] or irradiance [radiance unit x sr].
    pub radiance: Rgb,
    /// Density of points [1/unit²] or of directions [1/sr]; of a delta light the chance that it is asked.
    pub pdf: f64,
    /// Whether the light is one of [`Light::is_delta`].
    pub is_delta: bool,
    /// The object whose surface it is.
    pub object: Option<u32>,
    /// The number of the light in the tally: see [`Lights::counted`].
    pub light: usize,
}

/// Where light comes from.
#[derive(Clone, Copy, Debug)]
pub enum LightEnd {
    /// A point of a surface, or a place without one; its geometric normal is the axis of what it sends.
    Point {
        /// The point.
        at: SurfacePoint,
        /// Where to.
        shines: Shines,
    },
    /// A unit direction, far away.
    Direction(Vec3),
}

/// Into which directions a point shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shines {
    /// Evenly as a surface does, to where its normal looks.
    Front,
    /// The same, to both sides.
    BothSides,
    /// Into all, without a surface.
    Everywhere,
    /// Into a cone around the axis, without a surface: cosines of the angles where it begins to fade and where it is dark.
    Cone([f32; 2]),
}

impl LightSample {
    /// Cosine at the light for what is seen along the unit vector `w`, from there to the light; not above 0 where it is dark.
    /// Of what has no area, the share of its intensity.
    #[inline]
    pub fn cosine(&self, w: Vec3) -> f32 {
        let LightEnd::Point { at, shines } = self.end else { return 1.0 };
        let cosine = -at.n_geometric.dot(w);
        match shines {
            Shines::Front => cosine,
            Shines::BothSides => cosine.abs(),
            Shines::Everywhere => 1.0,
            Shines::Cone([from, to]) => {
                let rise = ((cosine - to) / (from - to)).clamp(0.0, 1.0);
                rise * rise * (3.0 - 2.0 * rise)
            }
        }
    }

    /// Its light on a surface; `None` where it comes from behind the surface or leaves the light at its dark side.
    pub fn arrival(&self, at: &SurfacePoint) -> Option<Arrival> {
        let above = |w: Vec3| (at.n.dot(w) > 0.0 && at.n_geometric.dot(w) > 0.0).then_some(w);
        let (w, factor, pdf_angle) = match self.end {
            LightEnd::Point { at: light, .. } => {
                let to_light = (light.x - at.x).as_vec3();
                let distance = to_light.length();
                if distance <= 0.0 {
                    return None;
                }
                let w = above(to_light / distance)?;
                // Divided one length at a time: distance² leaves the range of f32 long before the quotient does.
                let per_pdf = self.cosine(w) / distance / distance / self.pdf as f32;
                (w, at.n.dot(w) * per_pdf, 1.0 / per_pdf)
            }
            LightEnd::Direction(w) => (above(w)?, at.n.dot(w) / self.pdf as f32, self.pdf as f32),
        };
        let shadow = self.shadow(at, w);
        (factor > 0.0).then(|| self.arriving(w, factor, pdf_angle, shadow))
    }

    /// Its light at the place `x` in a medium, over straight lines: of the [`Arrival`] the irradiance is that across its direction. `None`
    /// where it leaves the light at its dark side.
    pub fn arrival_in_medium(&self, x: DVec3) -> Option<Arrival> {
        let (w, per_pdf, shadow) = match &self.end {
            LightEnd::Point { at: light, .. } => {
                let to_light = (light.x - x).as_vec3();
                let distance = to_light.length();
                if distance <= 0.0 {
                    return None;
                }
                let w = to_light / distance;
                let per_pdf = self.cosine(w) / distance / distance / self.pdf as f32;
                (w, per_pdf, Ray::between(x, light.arrive(w, x, 0.0)))
            }
            LightEnd::Direction(w) => (*w, 1.0 / self.pdf as f32, Ray::new(x, *w)),
        };
        (per_pdf > 0.0).then(|| self.arriving(w, per_pdf, 1.0 / per_pdf, shadow))
    }

    fn arriving(&self, w: Vec3, factor: f32, pdf_angle: f32, shadow: Ray) -> Arrival {
        let pdf_angle = if self.is_delta { f32::INFINITY } else { pdf_angle };
        Arrival { w, irradiance: self.radiance * factor, pdf_angle, shadow, light: Some(self.light) }
    }

    /// From a surface, which light leaves against the unit vector `w`, to the light.
    #[inline]
    pub fn shadow(&self, at: &SurfacePoint, w: Vec3) -> Ray {
        match &self.end {
            LightEnd::Point { at: light, .. } => Ray::between(at.leave(w), light.arrive(w, at.x, at.error)),
            LightEnd::Direction(to) => Ray::new(at.leave(w), *to),
        }
    }
}

/// One sampled direction from which light may arrive.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// Unit direction towards the light.
    pub w: Vec3,
    /// L_i cosθ_i / pdf: this sample's estimate of irradiance if nothing stands in the way
    /// [radiance unit x sr].
    pub irradiance: Rgb,
    /// Density of `w` [1/sr]; infinite of a delta light.
    pub pdf_angle: f32,
    /// Light arrives if nothing is hit on this ray.
    pub shadow: Ray,
    /// The number of the light, where it is one that is counted: see [`Lights::counted`].
    pub light: Option<usize>,
}

impl Arrival {
    /// Its share by the balance heuristic [VG95] beside directions of the density `other` [1/sr].
    #[inline]
    pub fn mis_weight_beside(&self, other: f32) -> f32 {
        1.0 / (1.0 + other / self.pdf_angle)
    }
}

/// What a ray meets.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    /// Radiance from there.
    pub radiance: Rgb,
    /// The number of the light, where it is one that is counted.
    pub light: Option<usize>,
}

/// Lights of which it is counted how often they were asked for.
#[derive(Clone, Debug)]
pub struct CountedLight {
    /// Their number in the tally.
    pub number: usize,
    /// What the user calls them.
    pub name: String,
    /// Chance by power that one of them is asked for.
    pub chance: f64,
}

/// Radiance that the surface at `hit` sends back along a ray with direction `towards` of its own, by emission.
#[inline]
pub fn emitted(scene: &Scene, hit: &Hit, towards: Vec3) -> Rgb {
    let Some(Emission { radiance, two_sided }) = scene.surface(hit.mesh).emission else { return Rgb::BLACK };
    let n = scene.objects[hit.mesh as usize].mesh.geometric_normal(hit.triangle);
    if two_sided || n.dot(towards) < 0.0 { radiance } else { Rgb::BLACK }
}
