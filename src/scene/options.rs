//! What `[method]` and `[render]` may hold; the options of the command line override it.

use crate::bssrdf::ModelName;
use crate::sampling::PixelFilter;

/// Makes an enum of names: `ALL`, `name()`, `FromStr` with the nearest name in its message.
macro_rules! named {
    ($(#[$doc:meta])* $type:ident, $what:literal, $($(#[$variant_doc:meta])* $variant:ident = $name:literal),+) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[non_exhaustive]
        pub enum $type {
            $($(#[$variant_doc])* $variant),+
        }

        impl $type {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// The name in scene files and on the command line.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name),+
                }
            }
        }

        impl std::str::FromStr for $type {
            type Err = $crate::error::Error;

            fn from_str(name: &str) -> $crate::error::Result<Self> {
                Self::ALL.iter().copied().find(|v| v.name() == name).ok_or_else(|| {
                    let names = Self::ALL.iter().map(|v| v.name());
                    let hint = $crate::error::did_you_mean(name, names.clone());
                    let all = names.collect::<Vec<_>>().join(", ");
                    $crate::error::Error::usage(format!("no {} `{name}`{hint}; there are {all}", $what))
                })
            }
        }
    };
}
pub(super) use named;

named! {
    /// A method of light transport.
    MethodName, "method",
    /// The part of the hemisphere above each point that sees no surface.
    AmbientOcclusion = "ambient_occlusion",
    /// Light of area lights on diffuse surfaces.
    Direct = "direct",
    /// Light over opaque surfaces, by any number of reflections.
    Path = "path",
    /// Light through translucent materials.
    Subsurface = "subsurface",
    /// Paths traced through the media themselves.
    VolumePath = "volume_path"
}

named! {
    /// How often light may have been scattered in media.
    Orders, "range of scattering orders",
    /// Any number of times.
    All = "all",
    /// Never.
    None = "0",
    /// Once.
    Single = "1",
    /// Twice or more.
    Multiple = "2+"
}

named! {
    /// How the sample cache is summed.
    Estimator, "estimator",
    /// The plain loop over all samples with rejection control.
    Notes = "notes",
    /// Rejection control as in `notes`, its decisions taken on a tree.
    Thinned = "thinned",
    /// The vectorised sum over all samples.
    All = "all",
    /// One random member stands for each far node of a tree.
    Cut = "cut",
    /// The mean of its members stands for each far node of the same tree: biased, for comparison.
    Cluster = "cluster"
}

impl Estimator {
    /// Samples per pass and translucent object unless the scene says: a pass of `cut` costs little more with many, one of
    /// the loops costs in proportion.
    pub fn default_samples(self) -> u32 {
        match self {
            Self::Notes => 1024,
            Self::All => 4096,
            Self::Thinned => 2048,
            Self::Cut | Self::Cluster => 131_072,
        }
    }
}

/// [`MethodOptions::photons`] unless the scene says: one for every 16 pixels of the picture, within bounds. Found by measuring the error at
/// equal time: more cost more than they bring (docs/volume-path.md).
pub fn default_photons([width, height]: [u32; 2]) -> u32 {
    (u64::from(width) * u64::from(height) / 16).clamp(1 << 8, 1 << 18) as u32
}

named! {
    /// How the light arriving at a cached sample is found.
    EntrySampling, "way to sample light at the entry",
    /// Area lights by their own points, the environment by the cosine; half of the samples each if there are both.
    Light = "light",
    /// Everything by the cosine: the lecture's way.
    Cosine = "cosine"
}

named! {
    /// How the points of the cache are spread over a surface.
    Spread, "way to spread samples",
    /// More where light enters that the camera gets to see.
    Seen = "seen",
    /// Evenly.
    Area = "area"
}

named! {
    /// What decides how much light leaves a body where.
    Shape, "shape",
    /// Paths, where they can walk through a body and its material names no model; else the model alone.
    Auto = "auto",
    /// The model alone, as on a plane.
    HalfSpace = "half-space",
    /// Paths walked through the body itself, patch by patch; the model has what is finer than a patch.
    Walked = "walked"
}

/// `[method]`: what is computed. Everything may be absent; the integrator knows the defaults.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MethodOptions {
    /// Which method.
    pub name: Option<MethodName>,
    /// Ambient occlusion: surfaces beyond this distance do not count \[unit\], > 0.
    pub radius: Option<f64>,
    /// Ambient occlusion: rays per camera ray, 1 to 65536.
    pub rays: Option<u32>,
    /// Direct light: shadow rays per camera ray, 1 to 65536.
    pub light_samples: Option<u32>,
    /// Subsurface: samples per pass and translucent object, 1 to 2^24.
    pub cache_samples: Option<u32>,
    /// Subsurface: how the cache is summed.
    pub estimator: Option<Estimator>,
    /// Subsurface: the largest share of the sum that one node of a `cut` may be wrong by, 1e-4 to 1.
    pub cut_error: Option<f64>,
    /// Subsurface: the model of every translucent material, over the materials' own.
    pub model: Option<ModelName>,
    /// Subsurface: how light is sampled where it enters; by the scene if absent.
    pub entry: Option<EntrySampling>,
    /// Subsurface: how entry points are spread.
    pub spread: Option<Spread>,
    /// Subsurface: add light scattered once to models that leave it out.
    pub single: Option<bool>,
    /// Subsurface and path: surfaces that light may go over, 0 to 2^24; as many as it takes if absent.
    pub bounces: Option<u32>,
    /// Subsurface: what decides how much light leaves where.
    pub shape: Option<Shape>,
    /// Volume path: the scattering orders that are wanted.
    pub orders: Option<Orders>,
    /// Volume path: photons per pass and translucent object, 0 to 2^24.
    pub photons: Option<u32>,
    /// Subsurface and volume path: add the mirror reflection at the boundary.
    pub specular: Option<bool>,
}

impl MethodOptions {
    /// What decides how much light leaves where: what is asked for by name is taken as it is, an estimator or the lecture's entry too.
    pub fn shape(&self) -> Shape {
        let named = self.estimator.is_some() || self.entry == Some(EntrySampling::Cosine) || self.bounces == Some(0);
        self.shape.unwrap_or(if named { Shape::HalfSpace } else { Shape::Auto })
    }
}

named! {
    /// How the samples of a pixel lie around it.
    FilterName, "filter",
    /// Evenly over the pixel.
    Box = "box",
    /// A Gaussian, cut off at four standard deviations.
    Gaussian = "gaussian",
    /// The window of Blackman and Harris: narrower than it reaches, and smooth at its end.
    BlackmanHarris = "blackman-harris"
}

/// `[render]`: how long and how shown.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderOptions {
    /// Samples per pixel, 1 to 2^24.
    pub spp: Option<u32>,
    /// Seed of all random numbers, 0 to 2^63 - 1.
    pub seed: Option<u64>,
    /// Exposure of the PNG \[stops\], -64 to 64.
    pub exposure: Option<f64>,
    /// How the samples of a pixel lie around it; a box unless it says.
    pub filter: Option<FilterName>,
    /// How far a filter that is no box reaches from the pixel's middle \[pixels\], 0.25 to 8.
    pub filter_radius: Option<f64>,
}

impl RenderOptions {
    /// The filter asked for; without a radius a Gaussian reaches 2 pixels, the window of Blackman and Harris 1.5.
    pub fn filter(&self) -> PixelFilter {
        let radius = |default: f64| self.filter_radius.unwrap_or(default);
        match self.filter {
            None | Some(FilterName::Box) => PixelFilter::default(),
            Some(FilterName::Gaussian) => PixelFilter::gaussian(radius(2.0)),
            Some(FilterName::BlackmanHarris) => PixelFilter::blackman_harris(radius(1.5)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn photons_are_in_proportion_to_the_picture() {
        let sizes = [[1, 1], [48, 48], [64, 64], [128, 128], [512, 512], [2048, 2048], [65536, 65536]];
        assert_eq!(sizes.map(default_photons), [256, 256, 256, 1024, 16384, 1 << 18, 1 << 18]);
    }
}
