//! Memory that a render takes at its most, told before it is taken. Bytes are counted where they are known and measured
//! where they are not; `tests/memory.rs` holds the sum to what renders took.

use super::setup::Prepared;
use marmor::film::{Film, Window};
use marmor::integrator::{Integrator as _, View};
use marmor::math::Rgb;
use marmor::query::Backend;
use marmor::scene::Surface;
use serde::Serialize;

/// By what takes it [bytes].
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Need {
    /// Sums.
    pub film: u64,
    /// Samples of a pass, states that tell the error, the picture, and what goes into an EXR file.
    pub pictures: u64,
    /// Vertices, triangles and normals.
    pub meshes: u64,
    /// The rays' tree, and tables over the triangles.
    pub trees: u64,
    /// The picture of the environment and its table.
    pub environment: u64,
    /// Cached samples or photons of a pass.
    pub pass: u64,
    /// At the worst moment: while meshes are read, while trees are built, or while passes are rendered.
    pub peak: u64,
}

/// The program itself.
const PROGRAM: u64 = 12 << 20;
/// Of a pass, three states of the halves, the picture, and an EXR file: twelve bytes each.
const PER_PIXEL: u64 = 8 * size_of::<Rgb>() as u64;
/// Channels as they are read, and the picture; later the picture and its table, which is less.
const PER_PIXEL_OF_SKY: u64 = 3 * size_of::<Rgb>() as u64;
/// While a mesh is looked at: corners, edges, and what is sorted [bytes/triangle].
const LOOKING: u64 = 85;
/// A mesh as it was read, beside the one that is rendered [bytes/triangle].
const AS_READ: u64 = 45;

/// Of a scene that is loaded; `view` where there are rays, to tell what a pass takes.
pub fn of(prepared: &Prepared, window: Window, view: Option<View<'_>>) -> Need {
    let scene = &prepared.scene;
    let pixels = window.area() as u64;
    let triangles = |o: &marmor::scene::Object| o.mesh.triangles.len() as u64;
    let all: u64 = scene.objects.iter().map(triangles).sum();
    let largest = scene.objects.iter().map(triangles).max().unwrap_or(0);
    // Nodes and triangles; what is sorted while they are made.
    let (tree, building) = match prepared.backend {
        Backend::Bvh => (90, 180),
        Backend::Embree => (70, 110),
    };
    let table = |o: &marmor::scene::Object| match scene.materials[o.material].surface {
        Surface::Diffuse { .. } => 0,
        Surface::Emissive { .. } => 12 * triangles(o),
        Surface::Translucent(_) => prepared.method.bytes_per_triangle() * triangles(o) + (1 << 20),
    };
    let tables: u64 = scene.objects.iter().map(table).sum();
    let sky = scene.environment.image.as_ref().map_or(0, |image| image.pixels.len() as u64);
    let mut need = Need {
        film: pixels * Film::BYTES_PER_PIXEL as u64,
        pictures: pixels * PER_PIXEL,
        meshes: scene.objects.iter().map(|o| o.mesh.bytes() as u64).sum(),
        trees: all * tree + tables,
        environment: sky * PER_PIXEL_OF_SKY,
        pass: view.map_or(0, |view| prepared.method.pass_bytes(view)),
        peak: 0,
    };
    let fixed = PROGRAM + need.environment + need.meshes;
    let reading = all * AS_READ + largest * LOOKING;
    let rendering = need.film + need.pictures + need.trees + need.pass;
    need.peak = fixed + reading.max(all * building + tables).max(rendering);
    need
}
