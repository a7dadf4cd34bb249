//! From what a scene asks for to the method that does it: every default of `[method]` is here.

use crate::error::Result;
use crate::integrator::{
    AmbientOcclusion, CameraRay, Direct, Integrator, KnownLights, Part, Path, Subsurface, SubsurfaceOptions, View,
    VolumePath, VolumePathOptions,
};
use crate::math::Rgb;
use crate::sampling::Points;
use crate::scene::{EntrySampling, Estimator, MethodName, MethodOptions, Scene, Spread, default_photons};
use crate::tally::Tally;
use std::any::Any;

/// A method with its tables, under its [`MethodName`].
#[allow(missing_docs)] // the variants are what they hold
pub enum Method {
    AmbientOcclusion(AmbientOcclusion),
    Direct(Box<Direct>),
    Path(Box<Path>),
    Subsurface(Box<Subsurface>),
    VolumePath(Box<VolumePath>),
}

/// How the cache is summed: as the scene says, or as the lecture does.
pub(super) fn estimator(options: &MethodOptions, as_notes: bool) -> Estimator {
    let asked = options.estimator.filter(|_| !as_notes);
    asked.unwrap_or(subsurface(as_notes).estimator)
}

/// What holds where a scene says nothing.
fn subsurface(as_notes: bool) -> SubsurfaceOptions {
    let options = SubsurfaceOptions::default();
    if !as_notes {
        return options;
    }
    let (entry, spread) = (EntrySampling::Cosine, Spread::Area);
    SubsurfaceOptions { estimator: Estimator::Notes, entry, spread, points: Points::Independent, ..options }
}

impl Method {
    /// What `options` ask for in `scene`; `as_notes`, the subsurface method is the lecture's, whatever they say of estimator,
    /// entry and spread.
    ///
    /// # Errors
    /// Those of [`Direct::new`], [`Path::new`], [`Subsurface::new`] and [`VolumePath::new`].
    pub fn new(scene: &Scene, options: &MethodOptions, as_notes: bool, seed: u64) -> Result<Self> {
        let light_samples = options.light_samples.unwrap_or(1);
        Ok(match options.name.unwrap_or_else(|| scene.default_method()) {
            MethodName::AmbientOcclusion => Self::AmbientOcclusion(AmbientOcclusion {
                radius: options.radius.map_or(f32::INFINITY, |r| r as f32),
                rays: options.rays.unwrap_or(4),
            }),
            MethodName::Direct => Self::Direct(Direct::new(scene, light_samples)?.into()),
            MethodName::Path => Self::Path(Path::new(scene, options.bounces, seed)?.into()),
            MethodName::Subsurface => {
                let start = subsurface(as_notes);
                let estimator = estimator(options, as_notes);
                let options = SubsurfaceOptions {
                    cache_samples: options.cache_samples.unwrap_or(estimator.default_samples()),
                    estimator,
                    cut_error: options.cut_error.map(|e| e as f32),
                    entry: options.entry.filter(|_| !as_notes).unwrap_or(start.entry),
                    spread: options.spread.filter(|_| !as_notes).unwrap_or(start.spread),
                    specular: options.specular.unwrap_or(start.specular),
                    single: options.single.unwrap_or(start.single),
                    light_samples,
                    shape: if as_notes { start.shape } else { options.shape() },
                    bounces: if as_notes { 0 } else { options.bounces.unwrap_or(start.bounces) },
                    seed,
                    ..start
                };
                Self::Subsurface(Subsurface::new(scene, options)?.into())
            }
            MethodName::VolumePath => {
                let start = VolumePathOptions::default();
                let options = VolumePathOptions {
                    orders: options.orders.unwrap_or(start.orders),
                    photons: options.photons.unwrap_or_else(|| default_photons(scene.camera.resolution)),
                    specular: options.specular.unwrap_or(start.specular),
                    seed,
                };
                Self::VolumePath(VolumePath::new(scene, options)?.into())
            }
        })
    }

    /// The name in scene files and on the command line.
    pub fn name(&self) -> &'static str {
        match self {
            Self::AmbientOcclusion(_) => MethodName::AmbientOcclusion.name(),
            Self::Direct(_) => MethodName::Direct.name(),
            Self::Path(_) => MethodName::Path.name(),
            Self::Subsurface(_) => MethodName::Subsurface.name(),
            Self::VolumePath(_) => MethodName::VolumePath.name(),
        }
    }

    /// Tables over the triangles of translucent objects [bytes/triangle].
    pub fn bytes_per_triangle(&self) -> u64 {
        match self {
            Self::AmbientOcclusion(_) | Self::Direct(_) | Self::Path(_) => 0,
            Self::Subsurface(subsurface) if subsurface.walks_any() => 160,
            Self::Subsurface(_) => 40,
            Self::VolumePath(_) => 90,
        }
    }
}

/// The same expression for whichever method it is.
macro_rules! each {
    ($self:expr, $method:ident => $value:expr) => {
        match $self {
            Method::AmbientOcclusion($method) => $value,
            Method::Direct($method) => $value,
            Method::Path($method) => $value,
            Method::Subsurface($method) => $value,
            Method::VolumePath($method) => $value,
        }
    };
}

/// What [`Method::begin_pass`] put there.
fn own<T: 'static>(pass: &(dyn Any + Sync)) -> &T {
    (pass as &dyn Any).downcast_ref().expect("a pass goes back to the method that began it")
}

impl Integrator for Method {
    /// That of the method itself.
    type Pass = Box<dyn Any + Sync>;

    #[allow(clippy::unit_arg)] // what pixels share may be nothing
    fn begin_pass(&self, view: View<'_>, pass: u32, tally: &mut Tally) -> Self::Pass {
        each!(self, method => Box::new(method.begin_pass(view, pass, tally)))
    }

    fn radiance(&self, view: View<'_>, pass: &Self::Pass, rays: &[CameraRay], out: &mut [Rgb], tally: &mut Tally) {
        each!(self, method => method.radiance(view, own(&**pass), rays, out, tally));
    }

    fn shares_tiles(&self) -> bool {
        each!(self, method => method.shares_tiles())
    }

    fn pass_bytes(&self, view: View<'_>) -> u64 {
        each!(self, method => method.pass_bytes(view))
    }

    fn parts(&self, scene: &Scene) -> Vec<Part> {
        let mut parts = each!(self, method => method.parts(scene));
        parts.push(Part::double_precision(scene));
        parts
    }

    fn lights(&self, scene: &Scene) -> KnownLights {
        each!(self, method => method.lights(scene))
    }
}
