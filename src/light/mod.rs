//! Light arriving at a surface point, before anything stands in its way.
//! Not for: what the surface does with it (`integrator`, `cache`). Read first: [`Lights`].

mod emitters;
mod picture;
mod sky;
mod suns;

use crate::geometry::SurfacePoint;
use crate::math::{Rgb, Vec3};
use crate::query::{Hit, Ray};
use crate::scene::{Emission, Scene};
pub use emitters::Lights;
pub use sky::{Sky, SunDirection};

/// One sampled direction from which light may arrive.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// Unit direction towards the light.
    pub w: Vec3,
    /// L_i cosθ_i / pdf: this sample's estimate of irradiance if nothing stands in the way
    /// [radiance unit x sr].
    pub irradiance: Rgb,
    /// Chance of `w` per solid angle [1/sr].
    pub pdf_angle: f32,
    /// Light arrives if nothing is hit on this ray.
    pub shadow: Ray,
    /// The number of the light, where it is one that is counted: see [`Lights::counted`].
    pub light: Option<usize>,
}

/// A light of which it is counted how often it was asked for.
#[derive(Clone, Debug)]
pub struct CountedLight {
    /// Its number in the tally.
    pub number: usize,
    /// What the user calls it.
    pub name: String,
    /// Chance that it is the one that is asked for.
    pub chance: f64,
}

/// A point of an area light.
#[derive(Clone, Copy, Debug)]
pub struct LampPoint {
    /// The point.
    pub at: SurfacePoint,
    /// Index of the object.
    pub object: u32,
    /// What it sends into every direction that it shines to.
    pub radiance: Rgb,
    /// Whether it shines to both sides.
    pub two_sided: bool,
    /// Chance of the point per area [1/unit²].
    pub pdf_area: f32,
    /// The number of the light.
    pub light: usize,
}

impl LampPoint {
    /// Cosine at the lamp for light that is seen along the unit vector `w`, from there to the lamp; not above 0 where it is dark.
    #[inline]
    pub fn cosine(&self, w: Vec3) -> f32 {
        let cosine = -self.at.n_geometric.dot(w);
        if self.two_sided { cosine.abs() } else { cosine }
    }
}

/// Radiance that the surface at `hit` sends back along a ray with direction `towards` of its own, by emission.
#[inline]
pub fn emitted(scene: &Scene, hit: &Hit, towards: Vec3) -> Rgb {
    let Some(Emission { radiance, two_sided }) = scene.surface(hit.mesh).emission else { return Rgb::BLACK };
    let n = scene.objects[hit.mesh as usize].mesh.geometric_normal(hit.triangle);
    if two_sided || n.dot(towards) < 0.0 { radiance } else { Rgb::BLACK }
}
