//! Memory that a render takes at its most, told before it is taken. Bytes are counted where they are known and measured
//! where they are not; `tests/memory.rs` holds the sum to what renders took.

use super::setup::{Method, Prepared};
use marmor::film::{Film, Window};
use marmor::integrator::{Integrator as _, View};
use marmor::math::Rgb;
use marmor::query::Backend;
use marmor::scene::{Geometry, Surface};
use marmor::surface::Texture;
use serde::Serialize;
use std::collections::HashSet;
use std::path::Path;

/// By what takes it [bytes].
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Need {
    /// Sums.
    pub film: u64,
    /// Samples of a pass, states that tell the error, the picture, and what goes into an EXR file.
    pub pictures: u64,
    /// Vertices, triangles, normals and texture coordinates.
    pub meshes: u64,
    /// The rays' tree, and tables over the triangles.
    pub trees: u64,
    /// The picture of the environment and its table.
    pub environment: u64,
    /// Pictures on surfaces.
    pub textures: u64,
    /// Cached samples or photons of a pass.
    pub pass: u64,
    /// At the worst moment: while meshes are read, while trees are built, or while passes are rendered.
    pub peak: u64,
}

/// The program itself, with its libraries.
const PROGRAM: u64 = 14_000_000;
/// Of a pass, three states of the halves, the picture, and an EXR file: twelve bytes each.
const PER_PIXEL: u64 = 8 * size_of::<Rgb>() as u64;
/// The picture, and its table.
const PER_PIXEL_OF_SKY: u64 = size_of::<Rgb>() as u64 + 4;
/// While it is read: channels as they are in the file, of three kinds, and the picture.
const PER_PIXEL_OF_EXR: u64 = 3 * size_of::<Rgb>() as u64;
/// Line by line, and turned the right way.
const PER_PIXEL_OF_HDR: u64 = 2 * size_of::<Rgb>() as u64;
/// While a picture on a surface is read from PNG or JPEG: codes and file beside the picture.
const PER_TEXEL_OF_CODES: u64 = size_of::<Rgb>() as u64 + 8;
/// Texture coordinates: as they are read, and as they are placed, beside the mesh [bytes/triangle].
const UV: [u64; 2] = [72, 28];
/// While a mesh file is read (measured of OBJ; others take no more): text, the reader's mesh and ours [bytes/triangle, bytes/vertex, and with normals bytes/triangle more].
/// Measured with 0.5 to 1 million triangles, with and without common vertices and normals.
const READING: [u64; 3] = [125, 90, 50];
/// While it is made out where the inside of a translucent mesh is [bytes/triangle]; measured likewise.
const LOOKING_INSIDE: u64 = 205;
/// While edges of any mesh are looked at, beside the mesh as it was placed [bytes/triangle].
const LOOKING: u64 = 110;

/// Blocks that Embree's builder takes ahead on each thread, on two of them; measured with 0.26 and 1 million triangles.
const EMBREE_BLOCKS: u64 = 18_000_000;

/// Of a scene that is loaded; `view` where there are rays, to tell what a pass takes.
pub fn of(prepared: &Prepared, window: Window, view: Option<View<'_>>) -> Need {
    let scene = &prepared.scene;
    let pixels = window.area() as u64;
    let triangles = |o: &marmor::scene::Object| o.mesh.triangles.len() as u64;
    let all: u64 = scene.objects.iter().map(triangles).sum();
    // Nodes and triangles; what is sorted while they are made.
    let (tree, building) = match prepared.backend {
        Backend::Bvh => (90, all * 190),
        Backend::Embree => (70, all * 120 + (all * 70).min(EMBREE_BLOCKS)),
    };
    let table = |o: &marmor::scene::Object| match scene.materials[o.material].surface {
        Surface { emission: Some(_), .. } => 12 * triangles(o),
        Surface { inside: None, .. } => 0,
        Surface { .. } => prepared.method.bytes_per_triangle() * triangles(o) + (1 << 20),
    };
    let tables: u64 = scene.objects.iter().map(table).sum();
    let sky = scene.environment.image.as_ref().map_or(0, |image| image.pixels.len() as u64);
    let mut textures: Vec<&Texture> = Vec::new();
    for texture in scene.materials.iter().flat_map(|m| m.surface.pictures()) {
        if !textures.iter().any(|known| std::ptr::eq(*known, &**texture)) {
            textures.push(texture);
        }
    }
    let mut need = Need {
        film: pixels * Film::BYTES_PER_PIXEL as u64,
        pictures: pixels * PER_PIXEL,
        meshes: scene.objects.iter().map(|o| o.mesh.bytes() as u64).sum(),
        trees: all * tree + tables,
        environment: sky * PER_PIXEL_OF_SKY,
        textures: textures.iter().map(|t| t.bytes() as u64).sum(),
        pass: view.map_or(0, |view| prepared.method.pass_bytes(view)),
        peak: 0,
    };
    // Beside all meshes; a file that is read has its own place already.
    let looks_inside = matches!(prepared.method, Method::Subsurface(_) | Method::VolumePath(_));
    let entries = prepared.file.objects.iter().filter(|entry| matches!(entry.geometry, Geometry::Mesh(_)));
    let from_files: HashSet<&str> = entries.map(|entry| entry.name.as_str()).collect();
    let loading = scene.objects.iter().map(|o| {
        let (mesh, faces) = (&o.mesh, triangles(o));
        let uv = |bytes: u64| if mesh.uv.is_some() { bytes } else { 0 };
        let read = match o.parts.iter().any(|name| from_files.contains(name.as_str())) {
            true => {
                let normals = if mesh.normals.is_some() { READING[2] } else { 0 };
                (faces * (READING[0] + normals + uv(UV[0])) + mesh.positions.len() as u64 * READING[1])
                    .saturating_sub(mesh.bytes() as u64)
            }
            false => 0,
        };
        let body = looks_inside && scene.materials[o.material].surface.is_body();
        read.max(faces * (uv(UV[1]) + if body { LOOKING_INSIDE } else { LOOKING }))
    });
    let rendering = need.film + need.pictures + need.trees + need.pass;
    let most = loading.max().unwrap_or(0).max(building + tables).max(rendering);
    // Before there are meshes.
    let per_pixel = |path: &Path| match path.extension() {
        Some(extension) if extension.eq_ignore_ascii_case("exr") => PER_PIXEL_OF_EXR,
        Some(extension) if ["png", "jpg", "jpeg"].iter().any(|e| extension.eq_ignore_ascii_case(e)) => {
            PER_TEXEL_OF_CODES
        }
        _ => PER_PIXEL_OF_HDR,
    };
    let reading = prepared.file.environment.image.as_ref().map_or(0, |path| sky * per_pixel(path));
    let beside = |t: &&Texture| {
        t.bytes() as u64 / size_of::<Rgb>() as u64 * (per_pixel(t.name().as_ref()) - size_of::<Rgb>() as u64)
    };
    let reading_texture = need.environment + need.textures + textures.iter().map(beside).max().unwrap_or(0);
    need.peak = PROGRAM + reading.max(reading_texture).max(need.environment + need.textures + need.meshes + most);
    need
}
