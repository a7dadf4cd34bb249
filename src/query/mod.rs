//! Where a ray first meets the scene. Not for: what is found there (`scene`).
//! Read first: [`RayQuery`]; each backend is one file behind it, and nothing else names a backend's types. `exact.rs` takes the
//! place of either where f32 cannot hold a scene.

use crate::error::{Error, Result, did_you_mean};
use crate::geometry::{Mesh, Precision};
use crate::math::{DVec3, Vec3};

#[cfg(feature = "bvh")]
mod bvh;
#[cfg(feature = "embree")]
#[allow(unsafe_code)] // the one room that talks to C; every block says what makes it sound
mod embree;
mod exact;

/// Points `origin + t * direction` with `t_min` < t < `t_max`.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Start [unit].
    pub origin: DVec3,
    /// Direction, of any length above 0; t counts in its lengths.
    pub direction: Vec3,
    /// Open lower end of the interval, at least 0.
    pub t_min: f32,
    /// Open upper end of the interval.
    pub t_max: f32,
}

impl Ray {
    /// From `origin` without end.
    #[inline]
    pub fn new(origin: DVec3, direction: Vec3) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
    }

    /// The segment between two points; t runs from 0 to 1.
    #[inline]
    pub fn between(from: DVec3, to: DVec3) -> Self {
        Self { origin: from, direction: (to - from).as_vec3(), t_min: 0.0, t_max: 1.0 }
    }
}

/// The first triangle along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter.
    pub t: f32,
    /// Index of the mesh among those the backend was built from.
    pub mesh: u32,
    /// Index of the triangle in its mesh.
    pub triangle: u32,
    /// Weight of the triangle's second corner.
    pub u: f64,
    /// Weight of the triangle's third corner.
    pub v: f64,
}

/// A ray tracer over fixed meshes. Both faces of a triangle are hit; triangles without area never are.
pub trait RayQuery: Send + Sync {
    /// The nearest hit in the ray's open interval.
    fn closest(&self, ray: &Ray) -> Option<Hit>;

    /// Whether anything is hit in the ray's open interval: cheaper than [`Self::closest`].
    fn occluded(&self, ray: &Ray) -> bool;

    /// [`Self::closest`] for each ray; a backend may do better than the loop.
    fn closest_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = self.closest(ray);
        }
    }

    /// [`Self::occluded`] for each ray; a backend may do better than the loop.
    fn occluded_batch(&self, rays: &[Ray], out: &mut [bool]) {
        for (ray, out) in rays.iter().zip(out) {
            *out = self.occluded(ray);
        }
    }

    /// Name and version, for logs and file headers.
    fn description(&self) -> String;

    /// Memory of the tree itself \[bytes\], where the backend knows it.
    fn bytes(&self) -> Option<usize> {
        None
    }
}

/// A ray backend by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    /// Pure Rust.
    Bvh,
    /// The system's Embree 3 or 4 through `wrapper/`.
    Embree,
}

impl Backend {
    /// All backends that marmor knows, in this build or not.
    pub const ALL: [Self; 2] = [Self::Bvh, Self::Embree];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bvh => "bvh",
            Self::Embree => "embree",
        }
    }

    /// Whether this build has it.
    pub fn is_built_in(self) -> bool {
        match self {
            Self::Bvh => cfg!(feature = "bvh"),
            Self::Embree => cfg!(feature = "embree"),
        }
    }

    /// Embree when built in, else the BVH.
    pub fn preferred() -> Self {
        if Self::Embree.is_built_in() { Self::Embree } else { Self::Bvh }
    }
}

impl std::str::FromStr for Backend {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|b| b.name() == name).ok_or_else(|| {
            let hint = did_you_mean(name, Self::ALL.map(Self::name));
            Error::usage(format!("no ray backend `{name}`{hint}; there are `bvh` and `embree`"))
        })
    }
}

/// Rays against `meshes` in f64, many times slower than the backends: for what f32 cannot hold, and to hold them against.
pub fn exact(meshes: &[&Mesh]) -> Box<dyn RayQuery> {
    Box::new(exact::Exact::new(meshes))
}

/// The corners of a triangle, rounded as the backends in f32 have them.
fn rounded(mesh: &Mesh, triangle: u32) -> [Vec3; 3] {
    mesh.corners(triangle).map(|p| p.as_vec3())
}

/// Whether rounded corners still span an area.
fn has_area(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    (b - a).cross(c - a).length() > 0.0
}

/// Builds a backend over `meshes`, which it copies: [`exact()`] where one of them asks for [`Precision::Double`].
///
/// # Errors
/// A usage error if the backend is not in this build, or a library does not work.
pub fn build(backend: Backend, meshes: &[&Mesh]) -> Result<Box<dyn RayQuery>> {
    match backend {
        _ if meshes.iter().any(|m| m.precision == Precision::Double) => Ok(exact(meshes)),
        #[cfg(feature = "bvh")]
        Backend::Bvh => Ok(Box::new(bvh::Bvh::new(meshes))),
        #[cfg(feature = "embree")]
        Backend::Embree => Ok(Box::new(embree::Embree::new(meshes)?)),
        #[cfg(not(all(feature = "bvh", feature = "embree")))]
        missing => {
            let name = missing.name();
            Err(Error::usage(format!("backend `{name}` is not in this build; rebuild with `--features {name}`")))
        }
    }
}
