//! What a surface does with light that meets it, in the field's terms. Not for: what shines by itself (`light`), what happens
//! inside a body (`integrator/volume_path`). Read first: [`Bsdf`]; each kind is one file.

mod boundary;
mod colour;
mod conductor;
mod graded;
mod interface;
mod lambertian;
mod microfacets;
mod oren_nayar;
mod plastic;
mod relief;
mod rough_boundary;
mod texture;
mod textured;

use crate::geometry::SurfacePoint;
use crate::math::{Rgb, Vec3};
pub use boundary::Boundary;
pub use colour::Colour;
pub use conductor::{Conductor, METALS, Reflectance};
pub use graded::Graded;
pub use interface::{Interface, RoughReflection};
pub use lambertian::Lambertian;
pub use oren_nayar::OrenNayar;
pub use plastic::Plastic;
pub use relief::Relief;
pub use rough_boundary::RoughBoundary;
use std::sync::Arc;
pub use texture::{Texture, Wrap};
pub use textured::Textured;

/// Reflection and transmission at a point of a surface. Directions are unit vectors that lead away from it: `wo` to where light
/// goes, `wi` to where it comes from.
pub trait Bsdf: Send + Sync + std::fmt::Debug {
    /// f [1/sr], without the cosine at `wi`; black for light of a delta function.
    fn eval(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3) -> Rgb;

    /// A direction of light that goes on to `wo`, from numbers in [0, 1); `None` where there is none. It may lie below the shading or the true surface.
    fn sample(&self, at: &SurfacePoint, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample>;

    /// Density of `wi` [1/sr] by [`Self::sample`]; 0 for delta functions.
    fn pdf(&self, at: &SurfacePoint, wo: Vec3, wi: Vec3) -> f32;

    /// Whether all of it is delta functions, so that lights cannot be asked for.
    fn is_delta(&self) -> bool {
        false
    }

    /// Whether it reflects alike into all directions, whatever direction light comes from: by its albedo over π.
    fn is_lambertian(&self) -> bool {
        false
    }

    /// Share of even light that comes back from outside, in [0, 1]; black of what reflects nothing. Where it differs from point to
    /// point, its mean.
    fn albedo(&self) -> Rgb;

    /// The same at one point.
    fn albedo_at(&self, _: &SurfacePoint) -> Rgb {
        self.albedo()
    }

    /// The pictures on it, for which points need texture coordinates.
    fn textures(&self) -> Vec<&Arc<Texture>> {
        Vec::new()
    }

    /// What `check` says of it.
    fn text(&self) -> String;
}

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Unit direction of the light, away from the surface.
    pub wi: Vec3,
    /// f cosθ / pdf, each channel in [0, 1] but for rough surfaces, where it may be some times 1; of a part that is a delta function its share over its chance.
    pub weight: Rgb,
    /// Density [1/sr]; 0 of a delta function.
    pub pdf: f32,
}
