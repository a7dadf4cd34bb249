//! Pictures of what the camera sees first: colour, normal, place, distance, and how far models can be trusted there. One
//! round of rays at fixed places, without random numbers: the same for any number of passes.

use crate::film::{Image, Window};
use crate::geometry::Curvature;
use crate::integrator::{Local, LocalShape, View};
use crate::math::Rgb;
use crate::optics::{ChannelOptics, HalfSpace};
use crate::query::{Hit, Ray};
use crate::scene::Scene;
use rayon::prelude::*;

/// Rays to each side of a square over a pixel.
const SIDE: u32 = 4;

/// An arbitrary output variable (AOV): a property of the surface that the camera sees first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aov {
    /// Reflectance of diffuse surfaces, of translucent ones that of a half space of their medium; 0 for lights and
    /// background. Mean over the pixel.
    Albedo,
    /// Shading normal, turned towards the camera. Mean over the pixel, so shorter than 1 along edges; 0 without a surface.
    Normal,
    /// Position in the scene file's coordinates \[unit\], through the pixel's middle; 0 without a surface.
    Position,
    /// Distance along the direction of view \[unit\] in all channels, through the pixel's middle; infinite without a surface.
    Depth,
    /// Expected error of the material's model, 0.05 for 5 %, NaN where it has not been measured; thickness in transport mean
    /// free paths of the channel that decides, NaN where there is no other side, and mean curvature. Means over what is
    /// translucent in the pixel and has the number; 0 without anything translucent. See [`crate::bssrdf::expected_error`].
    Validity,
    /// Share of the pixel where the camera meets a translucent object first, in all channels.
    Translucent,
}

/// A picture of `what` for the pixels of `window`.
pub fn first_hit(view: View<'_>, window: Window, what: Aov) -> Image {
    let shapes = if what == Aov::Validity { shapes(view.scene) } else { Vec::new() };
    let albedo = if what == Aov::Albedo { albedos(view.scene) } else { Vec::new() };
    let camera = &view.scene.camera;
    let look = |ray: Ray| -> Option<Rgb> {
        let hit = view.rays.closest(&ray)?;
        let mesh = &view.scene.objects[hit.mesh as usize].mesh;
        match what {
            Aov::Albedo => Some(albedo[hit.mesh as usize].unwrap_or_else(|| {
                view.scene.surface(hit.mesh).bsdf.albedo_at(&mesh.point(hit.triangle, hit.u, hit.v))
            })),
            Aov::Normal => {
                let at = mesh.point(hit.triangle, hit.u, hit.v).facing(-ray.direction);
                Some(Rgb(at.normal_seen_from(-ray.direction).to_array()))
            }
            Aov::Position => {
                let x = mesh.point(hit.triangle, hit.u, hit.v).x + view.scene.centre;
                Some(Rgb(x.as_vec3().to_array()))
            }
            Aov::Depth => Some(Rgb::splat((ray.direction * hit.t).dot(camera.forward()))),
            Aov::Translucent => {
                let object = &view.scene.objects[hit.mesh as usize];
                let translucent = view.scene.materials[object.material].surface.is_translucent();
                translucent.then(|| Rgb::splat(1.0))
            }
            Aov::Validity => Some(validity(view, shapes[hit.mesh as usize].as_ref()?, &hit)),
        }
    };
    let pixel = |pixel: [u32; 2]| {
        if matches!(what, Aov::Position | Aov::Depth) {
            let nothing = if what == Aov::Depth { f32::INFINITY } else { 0.0 };
            return look(camera.ray(pixel, [0.5, 0.5])).unwrap_or(Rgb::splat(nothing));
        }
        let place = |k: u32| (k as f32 + 0.5) / SIDE as f32;
        // Of a lens each through another place.
        let ray = |k: u32| camera.grid_ray(pixel, [place(k % SIDE), place(k / SIDE)], k);
        let looks = (0..SIDE * SIDE).filter_map(|k| look(ray(k)));
        if what == Aov::Validity {
            return mean_of_numbers(looks);
        }
        looks.fold(Rgb::BLACK, |sum, value| sum + value) * (1.0 / (SIDE * SIDE) as f32)
    };
    let pixels = (0..window.area()).into_par_iter().map(|i| pixel(window.pixel(i))).collect();
    Image { resolution: camera.resolution, window, pixels }
}

/// In each channel the mean of those that are numbers; NaN where none is, 0 of nothing.
fn mean_of_numbers(values: impl Iterator<Item = Rgb>) -> Rgb {
    let (mut sums, mut counts, mut all) = ([0.0_f32; 3], [0.0_f32; 3], 0);
    for value in values {
        all += 1;
        for c in (0..3).filter(|&c| !value[c].is_nan()) {
            sums[c] += value[c];
            counts[c] += 1.0;
        }
    }
    if all == 0 { Rgb::BLACK } else { Rgb::from_fn(|c| sums[c] / counts[c]) }
}

/// A translucent object with its curvature.
type Bent = (LocalShape, Curvature);

/// The shapes of all translucent objects, each at the number of its object. Curvature is averaged over the longest transport
/// mean free path of the three channels.
fn shapes(scene: &Scene) -> Vec<Option<Bent>> {
    let of = |object: u32| {
        let shape = LocalShape::new(scene, object)?;
        let curvature = Curvature::new(&scene.objects[object as usize].mesh, shape.longest_path() as f32);
        Some((shape, curvature))
    };
    (0..scene.objects.len() as u32).into_par_iter().map(of).collect()
}

fn validity(view: View<'_>, (shape, curvature): &Bent, hit: &Hit) -> Rgb {
    let mesh = &view.scene.objects[hit.mesh as usize].mesh;
    let thickness = shape.thickness(view, &mesh.point(hit.triangle, hit.u, hit.v));
    let local = Local { thickness, curvature: curvature.at(mesh, hit.triangle, hit.u, hit.v) };
    match shape.expected(shape.own(), local) {
        Ok((error, place)) => Rgb([error.distribution, place.thickness, place.curvature].map(|v| v as f32)),
        Err(_) => {
            let path = shape.longest_path() as f32;
            Rgb([f32::NAN, local.thickness / path, local.curvature * path])
        }
    }
}

/// Of each translucent object; others have the albedo of their surface at each point.
fn albedos(scene: &Scene) -> Vec<Option<Rgb>> {
    let of = |object: u32| {
        let t = scene.surface(object).inside.as_ref()?;
        let (half_space, optics) = (HalfSpace::new(t.medium.eta.into()), ChannelOptics::of(&t.medium));
        Some(Rgb::from_fn(|c| half_space.reflectance(optics[c].absorbed_prime) as f32))
    };
    (0..scene.objects.len() as u32).map(of).collect()
}
