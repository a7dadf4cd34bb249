//! marmor renders translucent objects with analytic BSSRDFs, and says how far to trust the picture.
//!
//! Rooms, from the bottom up; each uses only rooms below it (`tests/map.rs` holds that):
//!
//! | row | rooms |
//! |---|---|
//! | 8 | [`render`]: passes over tiles on all cores · [`report`]: records, plots |
//! | 7 | [`integrator`]: one file per method |
//! | 6 | [`cache`]: transmitted-light points of one pass and the estimators that gather over them |
//! | 5 | [`light`]: light arriving at a surface point |
//! | 4 | [`scene`]: the file as typed, and the checked world |
//! | 3 | [`query`]: nearest hit · [`bssrdf`]: one file per model · [`film`]: sums, EXR, PNG, metrics · [`surface`]: reflection and transmission |
//! | 2 | [`geometry`]: meshes, area table · [`optics`]: Fresnel, media · [`sampling`]: Owen-Sobol streams |
//! | 1 | [`math`], [`error`], [`memory`], [`input`], [`tally`], [`words`] |
//!
//! The command line is the binary's own room, `cli`, above all of these.
#![deny(unsafe_code)]
// Units [mm] and citation keys [JMLH01] stand in brackets; links are written out where they are meant.
#![allow(rustdoc::broken_intra_doc_links)]

#[cfg(not(any(feature = "bvh", feature = "embree")))]
compile_error!("marmor needs a ray backend: enable the feature `bvh` (pure Rust) or `embree` (system Embree)");

pub mod bssrdf;
pub mod cache;
pub mod error;
pub mod film;
pub mod geometry;
pub mod input;
pub mod integrator;
pub mod light;
pub mod math;
pub mod memory;
pub mod optics;
pub mod query;
pub mod render;
pub mod report;
pub mod sampling;
pub mod scene;
pub mod surface;
pub mod tally;
pub mod words;

pub use error::{Error, ErrorKind, Result};
