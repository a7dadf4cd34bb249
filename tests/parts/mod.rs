//! Parts of scene files and meshes, as text.
#![allow(dead_code)] // each test file uses its part

use std::fmt::Debug;

/// A camera, after the unit.
pub fn camera(position: [f64; 3], look_at: [f64; 3], fov: f64, resolution: [u32; 2]) -> String {
    format!(
        "unit = \"mm\"\n[camera]\nposition = {position:?}\nlook_at = {look_at:?}\nfov = {fov:?}\nresolution = {resolution:?}\n"
    )
}

/// A ball of `rings` and twice as many segments.
pub fn sphere(name: &str, centre: [f64; 3], radius: f64, rings: u32, material: &str) -> String {
    format!(
        "[[object]]\nname = \"{name}\"\nshape = \"sphere\"\ncentre = {centre:?}\nradius = {radius:?}\nrings = {rings}\nsegments = {}\n\
         material = \"{material}\"\n",
        2 * rings
    )
}

/// A rectangle of half edges `u` and `v`, which looks along u x v.
pub fn rectangle(name: &str, centre: [f64; 3], u: [f64; 3], v: [f64; 3], material: &str) -> String {
    format!(
        "[[object]]\nname = \"{name}\"\nshape = \"rectangle\"\ncentre = {centre:?}\nedge_u = {u:?}\nedge_v = {v:?}\n\
         material = \"{material}\"\n"
    )
}

/// The mesh in `file`.
pub fn mesh(name: &str, file: &str, material: &str) -> String {
    format!("[[object]]\nname = \"{name}\"\nmesh = \"{file}\"\nmaterial = \"{material}\"\n")
}

/// A material whose keys are `medium`. Of the model `standard`, unless `medium` names one: what is told of a model is told of that model.
pub fn translucent(name: &str, medium: &str) -> String {
    let model = if medium.contains("model =") { "" } else { "model = \"standard\"\n" };
    format!("[material.{name}]\ntype = \"translucent\"\n{model}{medium}\n")
}

/// Of one albedo, or of three.
pub fn diffuse(name: &str, albedo: impl Debug) -> String {
    format!("[material.{name}]\ntype = \"diffuse\"\nalbedo = {albedo:?}\n")
}

/// Of one radiance, or of three.
pub fn emissive(name: &str, radiance: impl Debug) -> String {
    format!("[material.{name}]\ntype = \"emissive\"\nradiance = {radiance:?}\n")
}

/// Light of one radiance from all around, or of three.
pub fn sky(radiance: impl Debug) -> String {
    format!("[environment]\nradiance = {radiance:?}\n")
}

/// The medium of wax in most tests.
pub const WAX: &str = "sigma_s_prime = [2, 3, 4]\nsigma_a = [0.05, 0.1, 0.2]\neta = 1.3";

/// A box between two corners as an OBJ file, six quadrilaterals that look outwards; the fourth is the one above, at the largest y.
pub fn cuboid(low: [f64; 3], high: [f64; 3]) -> String {
    let at = |i: usize, axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
    let corner = |i: usize| format!("v {} {} {}\n", at(i, 0), at(i, 1), at(i, 2));
    let corners: String = (0..8).map(corner).collect();
    corners + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"
}

/// A box about the origin.
pub fn centred(half: [f64; 3]) -> String {
    cuboid(half.map(|h| -h), half)
}
