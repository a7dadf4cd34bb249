//! marmor renders translucent objects with analytic BSSRDFs, and says how far to trust the picture.
//!
//! **S_d between two points.** [`bssrdf`] has the models, by name or by type; [`optics`] the media they are made of and a
//! catalogue of measured ones. Lengths are in whatever unit the medium's coefficients are per.
//!
//! ```
//! use marmor::bssrdf::{Bssrdf as _, Entry, Exit, ModelName, ModelOptions};
//! use marmor::{Vec3, optics};
//!
//! let marble = optics::find_or_explain("marble")?.medium(1.0); // coefficients per mm
//! let model = "directional".parse::<ModelName>()?.build(&marble, &ModelOptions::DEFAULT)?;
//! // Light comes in along the normal; `w` of an entry is its direction inside, after refraction.
//! let entry = Entry { x: Vec3::ZERO, n: Vec3::Z, w: -Vec3::Z };
//! let exit = |mm: f32| Exit { x: Vec3::new(mm, 0.0, 0.0), n: Vec3::Z, w: Vec3::Z };
//! let [near, far] = [1.0, 5.0].map(|mm| model.eval(&entry, &exit(mm))); // RGB, per mm² and sr
//! assert!(near[0] > 10.0 * far[0] && far[0] > 0.0);
//! # marmor::Result::Ok(())
//! ```
//!
//! **The medium of a colour.** [`optics::AlbedoCurve`] finds the coefficients whose half space has a wanted diffuse
//! reflectance by a model, at a transport mean free path of your choice; [`optics::Look`] those that transport itself gives that
//! colour.
//!
//! ```
//! use marmor::bssrdf::{Bssrdf as _, StandardDipole};
//! use marmor::optics::{AlbedoCurve, AlbedoLaw, Medium};
//! use marmor::Rgb;
//!
//! let (eta, mean_free_path) = (1.3, 0.5);
//! let reduced = AlbedoCurve::new(AlbedoLaw::Standard, eta).invert(0.8)?; // of extinction 1
//! let [s, a] = [reduced.sigma_s_prime, reduced.sigma_a].map(|v| Rgb::splat((v / mean_free_path) as f32));
//! let medium = Medium::reduced(s, a, eta as f32)?;
//! assert!((StandardDipole::new(&medium, true).total()[0] - 0.8).abs() < 1e-5);
//! # marmor::Result::Ok(())
//! ```
//!
//! **A picture.** [`scene::SceneFile`] is a scene as typed, read from a file or made in code; [`render()`] makes it an
//! [`Image`](film::Image) with the variance of each pixel. [`film::save`] writes it as EXR or PNG.
//!
//! ```
//! use marmor::{render, scene::SceneFile};
//!
//! let wax = SceneFile::parse(
//!     r#"
//!     unit = "mm"
//!     camera = { position = [0, 2, 6], look_at = [0, 0, 0], fov = 30, resolution = [24, 16] }
//!     object = [{ name = "ball", shape = "sphere", centre = [0, 0, 0], radius = 1, material = "wax" }]
//!     environment.radiance = 1
//!     [material.wax]
//!     type = "translucent"
//!     sigma_s_prime = [2, 3, 4]
//!     sigma_a = [0.05, 0.1, 0.2]
//!     eta = 1.3
//!     "#,
//!     "wax.toml".as_ref(), // for messages; meshes would lie beside it
//! )?;
//! let options = render::Options { spp: Some(16), ..Default::default() };
//! let picture = marmor::render(&wax, &options)?;
//! let directional = marmor::render(&wax.with(&["method.model=directional"])?, &options)?;
//! for picture in [&picture, &directional] {
//!     let red = picture.image.get(12, 8).unwrap()[0];
//!     let error = picture.variance.as_ref().unwrap().get(12, 8).unwrap()[0].sqrt();
//!     assert!(0.0 < red && red < 1.0 + 4.0 * error, "nothing outshines a sky of 1: {red} with standard error {error}");
//! }
//! assert!(picture.remarks.is_empty(), "{:?}", picture.remarks);
//! # marmor::Result::Ok(())
//! ```
//!
//! Features: `cli` (on) the command line program, `bvh` (on) and `embree` the ray backends; none changes a picture by more
//! than what a ray backend rounds. What is not listed below is for the program and its tests, and may change at any time;
//! `docs/design.md` has the map of all rooms.
#![deny(unsafe_code)]

#[cfg(not(any(feature = "bvh", feature = "embree")))]
compile_error!("marmor needs a ray backend: enable the feature `bvh` (pure Rust) or `embree` (system Embree)");

pub mod bssrdf;
pub mod film;
pub mod optics;
pub mod render;
pub mod scene;

#[doc(hidden)]
pub mod cache;
#[doc(hidden)]
pub mod error;
#[doc(hidden)]
pub mod geometry;
mod input;
#[doc(hidden)]
pub mod integrator;
#[doc(hidden)]
pub mod light;
#[doc(hidden)]
pub mod math;
#[doc(hidden)]
pub mod memory;
#[doc(hidden)]
pub mod query;
#[doc(hidden)]
pub mod report;
#[doc(hidden)]
pub mod sampling;
#[doc(hidden)]
pub mod surface;
#[doc(hidden)]
pub mod tally;
#[doc(hidden)]
pub mod words;

#[doc(inline)]
pub use error::{Error, ErrorKind, Result};
#[doc(inline)]
pub use math::{DVec3, Rgb, Vec3};
pub use render::render;

/// The README's program runs as it stands.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
