//! Light that comes to a surface only through a clear body that refracts: no shadow ray passes it, so paths meet it by chance.

use crate::light::Lights;
use crate::scene::{Body, Object, Scene, Surface};
use crate::words::first_of;
use std::collections::HashSet;
use std::f64::consts::PI;
use std::sync::Arc;

/// A body is clear where more than exp(-3) = 5 % of the light in some channel goes straight through its thickness.
const CLEAR: f64 = 3.0;
/// A light is small where fewer than this share of the paths that leave a surface by the cosine meet it.
const SMALL: f64 = 0.01;
/// A picture's suns matter from this share of its light.
const SUNNY: f32 = 0.01;

/// Lights and bodies that are named in one sentence.
const MOST_NAMES: usize = 8;

/// What is to say of a scene before it is rendered; `None` where there is no such light.
/// `passes` tells of which objects paths go through the body.
pub fn warning(scene: &Scene, lights: &Lights, passes: impl Fn(usize) -> bool) -> Option<String> {
    let (mut kept, mut known) = ([Vec::new(), Vec::new()], [HashSet::new(), HashSet::new()]);
    let mut keep = |list: usize, name: &str| {
        let name = format!("{name:?}");
        if known[list].insert(name.clone()) {
            kept[list].push(name);
        }
    };
    // Those that no ray meets are in `never_met`.
    let small = lights.disks(scene).filter(|(_, solid_angle)| *solid_angle < SMALL * PI);
    let suns: Vec<String> = small.map(|(name, _)| name).collect();
    let sunny = lights.share_beside_suns() < 1.0 - SUNNY;
    for (i, body) in scene.bodies.iter().enumerate() {
        let (Some(body), name) = (body.as_ref().filter(|_| passes(i)), &scene.objects[i].name) else { continue };
        if !is_clear(scene, body) || !scene.objects.iter().enumerate().any(|(j, o)| i != j && receives(scene, o)) {
            continue;
        }
        for sun in suns.iter().filter(|_| sunny) {
            keep(0, sun);
            keep(1, name);
        }
        for lamp in scene.objects.iter().filter(|lamp| is_small(scene, lamp, body)) {
            keep(0, &lamp.name);
            keep(1, name);
        }
    }
    let [from, through] = kept.map(|names| first_of(&names, MOST_NAMES));
    (!from.is_empty()).then(|| {
        format!(
            "light of {from} that comes through {through} to diffuse surfaces or other bodies is met by chance alone, so seldom that \
             it may be missing from the picture and from the error that is told: no shadow ray passes through a body; take larger \
             or softer lights, many more samples, or leave the clear body out"
        )
    })
}

/// That paths through clear bodies never meet a light without size; `None` where there is none.
pub fn never_met(scene: &Scene, lights: &Lights, passes: impl Fn(usize) -> bool) -> Option<String> {
    let from: Vec<String> = lights.of_no_size(scene).map(|name| format!("{name:?}")).collect();
    let clear = |(i, body): (usize, &Option<Arc<Body>>)| {
        let body = body.as_ref().filter(|body| passes(i) && is_clear(scene, body))?;
        Some(format!("{:?}", scene.objects[body.object as usize].name))
    };
    let through: Vec<String> = scene.bodies.iter().enumerate().filter_map(clear).collect();
    let (from, through) = (first_of(&from, MOST_NAMES), first_of(&through, MOST_NAMES));
    (!from.is_empty() && !through.is_empty()).then(|| {
        format!(
            "light of {from}, which has no size, is not in the picture where {through} refracts it to another surface, or mirrors it inside \
             before it is scattered: no path meets it; give it one (type = \"sun\", or an emissive sphere)"
        )
    })
}

/// Whether light goes straight through it in some channel.
fn is_clear(scene: &Scene, body: &Body) -> bool {
    let Some(medium) = scene.surface(body.object).medium() else { return false };
    let sigma_t = medium.sigma_t();
    let least = f64::from(sigma_t.0.into_iter().fold(f32::INFINITY, f32::min));
    body.thickness.is_some_and(|thickness| least * thickness < CLEAR)
}

/// Whether it shows light that comes to it.
fn receives(scene: &Scene, object: &Object) -> bool {
    match &scene.materials[object.material].surface {
        surface if surface.is_body() => surface.medium().is_some_and(|m| !m.sigma_s.is_black()),
        Surface { bsdf, .. } => !bsdf.albedo().is_black(),
    }
}

/// Whether an object is a lamp that is seldom met from somewhere in `body`: from the corner of its box that is farthest.
fn is_small(scene: &Scene, lamp: &Object, body: &Body) -> bool {
    if !scene.materials[lamp.material].surface.shines() {
        return false;
    }
    let (Some(own), around) = (lamp.mesh.bounds(), body.bounds) else { return false };
    let middle = own.centre();
    let farthest = (around.lower - middle).abs().max((around.upper - middle).abs());
    let area: f64 = (0..lamp.mesh.triangles.len() as u32).map(|t| lamp.mesh.area(t)).sum();
    area > 0.0 && area < SMALL * PI * farthest.length_squared()
}
