//! Pictures of what the camera sees first: colour, normal, place, distance, and how far models can be trusted there. One
//! round of rays at fixed places, without random numbers: the same for any number of passes.

use crate::film::{Image, Window};
use crate::integrator::{LocalShape, View};
use crate::math::Rgb;
use crate::optics::{ChannelOptics, HalfSpace};
use crate::query::Hit;
use crate::scene::{Scene, Surface};
use rayon::prelude::*;

/// Rays to each side of a square over a pixel.
const SIDE: u32 = 4;

/// What there is to see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// Reflectance of diffuse surfaces, of translucent ones that of a half space of their medium; 0 for lights and
    /// background. Mean over the pixel.
    Albedo,
    /// Shading normal, turned towards the camera. Mean over the pixel, so shorter than 1 along edges; 0 without a surface.
    Normal,
    /// Place in the scene file's coordinates [unit], through the pixel's middle; 0 without a surface.
    Place,
    /// Distance along the direction of view [unit] in all channels, through the pixel's middle; infinite without a surface.
    Depth,
    /// Expected error of the material's model, 0.05 for 5 %; its thickness and mean curvature in transport mean free paths of
    /// the channel that decides. Means over what is translucent in the pixel; 0 without. See
    /// [`crate::bssrdf::expected_error`].
    Validity,
    /// Share of the pixel where the camera meets a translucent object first, in all channels.
    Translucent,
}

/// A picture of `what` for the pixels of `window`.
pub fn first_hit(view: View<'_>, window: Window, what: Seen) -> Image {
    let shapes = if what == Seen::Validity { shapes(view.scene) } else { Vec::new() };
    let albedo = if what == Seen::Albedo { albedos(view.scene) } else { Vec::new() };
    let camera = &view.scene.camera;
    let look = |pixel: [u32; 2], offset: [f32; 2]| -> Option<Rgb> {
        let ray = camera.ray(pixel, offset);
        let hit = view.rays.closest(&ray)?;
        let mesh = &view.scene.objects[hit.mesh as usize].mesh;
        match what {
            Seen::Albedo => Some(albedo[hit.mesh as usize]),
            Seen::Normal => {
                let at = mesh.point(hit.triangle, hit.u, hit.v).facing(-ray.direction);
                Some(Rgb(at.normal_seen_from(-ray.direction).to_array()))
            }
            Seen::Place => {
                let x = mesh.point(hit.triangle, hit.u, hit.v).x + view.scene.centre;
                Some(Rgb(x.as_vec3().to_array()))
            }
            Seen::Depth => Some(Rgb::splat((ray.direction * hit.t).dot(camera.forward()))),
            Seen::Translucent => {
                let object = &view.scene.objects[hit.mesh as usize];
                let translucent = matches!(view.scene.materials[object.material].surface, Surface::Translucent(_));
                translucent.then(|| Rgb::splat(1.0))
            }
            Seen::Validity => validity(view, shapes[hit.mesh as usize].as_ref()?, &hit),
        }
    };
    let pixel = |pixel: [u32; 2]| {
        if matches!(what, Seen::Place | Seen::Depth) {
            let nothing = if what == Seen::Depth { f32::INFINITY } else { 0.0 };
            return look(pixel, [0.5, 0.5]).unwrap_or(Rgb::splat(nothing));
        }
        let place = |k: u32| (k as f32 + 0.5) / SIDE as f32;
        let (mut sum, mut found) = (Rgb::BLACK, 0);
        for value in (0..SIDE * SIDE).filter_map(|k| look(pixel, [place(k % SIDE), place(k / SIDE)])) {
            sum += value;
            found += 1;
        }
        let of = if what == Seen::Validity { found.max(1) } else { SIDE * SIDE };
        sum * (1.0 / of as f32)
    };
    let pixels = (0..window.area()).into_par_iter().map(|i| pixel(window.pixel(i))).collect();
    Image { resolution: camera.resolution, window, pixels }
}

/// The shapes of all translucent objects, each at the number of its object.
fn shapes(scene: &Scene) -> Vec<Option<LocalShape>> {
    (0..scene.objects.len() as u32).into_par_iter().map(|object| LocalShape::new(scene, object)).collect()
}

fn validity(view: View<'_>, shape: &LocalShape, hit: &Hit) -> Option<Rgb> {
    let local = shape.at(view, hit.triangle, hit.u, hit.v);
    let (error, place) = shape.expected_of_its_model(local)?;
    Some(Rgb([error.distribution, place.thickness.min(FARTHEST), place.curvature].map(|v| v as f32)))
}

/// What stands for no other side, so that means stay numbers [transport mean free paths].
const FARTHEST: f64 = 1e6;

fn albedos(scene: &Scene) -> Vec<Rgb> {
    let of = |object: &crate::scene::Object| match &scene.materials[object.material].surface {
        Surface::Diffuse { albedo } => *albedo,
        Surface::Emissive { .. } => Rgb::BLACK,
        Surface::Translucent(t) => {
            let (half_space, optics) = (HalfSpace::new(t.medium.eta.into()), ChannelOptics::of(&t.medium));
            Rgb::from_fn(|c| half_space.reflectance(optics[c].absorbed_prime) as f32)
        }
    };
    scene.objects.iter().map(of).collect()
}
