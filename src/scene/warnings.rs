//! Oddities that can be rendered but that a user should hear of, each with its numbers.

use super::file::SceneFile;
use super::options::MethodName;
use super::{ExitanceBy, ObstacleKind, Scene, Translucent, energy};
use crate::geometry::Solid;
use crate::optics::{ChannelOptics, Trust};
use crate::words::{albedo, short};

const CHANNELS: [&str; 3] = ["red", "green", "blue"];

/// All of them, in the order of the file.
pub(super) fn of(file: &SceneFile, scene: &Scene) -> Vec<String> {
    let mut said = Vec::new();
    if file.unit_in_mm.is_none() {
        said.push(format!("{}: no `unit`; millimetres are assumed. Add unit = \"mm\"", file.path.display()));
    }
    materials(file, scene, &mut said);
    objects(file, scene, &mut said);
    light(file, scene, &mut said);
    said.extend(shut_in(scene));
    said
}

fn materials(file: &SceneFile, scene: &Scene, said: &mut Vec<String>) {
    let mut used = vec![false; file.materials.len()];
    file.objects.iter().for_each(|o| used[o.material] = true);
    for (i, entry) in file.materials.iter().enumerate() {
        let head = format!("{}: material {:?}", entry.at, entry.name);
        if !used[i] {
            said.push(format!("{head} is used by no object"));
        } else if scene.materials[i].surface.clear.is_some() {
            said.extend(clear(file, scene).map(|what| format!("{head}: {what}")));
        } else if let Some(t) = &scene.materials[i].surface.inside {
            let first = if file.method.single == Some(false) { no_first_order(t) } else { None };
            if models_are_used(file) {
                // Paths that walk through a body do so in any medium.
                let mut own = (0..).zip(&scene.objects).filter(|(_, o)| scene.materials[o.material].name == entry.name);
                let by_model = own.any(|(object, _)| model_decides(file, scene, object));
                let outside = if by_model { outside_diffusion(t) } else { None };
                let all = nothing_there(t).into_iter().chain(outside).chain(first);
                said.extend(all.map(|what| format!("{head}: {what}")));
            }
        }
    }
}

/// What the method makes of a clear body.
fn clear(file: &SceneFile, scene: &Scene) -> Option<String> {
    let method = file.method.name.unwrap_or_else(|| scene.default_method());
    (method == MethodName::Direct).then(|| {
        "`direct` shows it black and lets no light through, for it has light straight from lights alone; take --method path, or \
         --method volume_path"
            .into()
    })
}

/// Whether a BSSRDF is part of what decides of a translucent material.
fn models_are_used(file: &SceneFile) -> bool {
    file.method.name.is_none_or(|name| name == MethodName::Subsurface)
}

/// Whether it alone says how much light leaves the object.
fn model_decides(file: &SceneFile, scene: &Scene, object: u32) -> bool {
    models_are_used(file) && scene.exitance_by(object, file.method.shape()) != ExitanceBy::Walks
}

/// Channels of a medium that is none: models have no light there, `volume_path` has clear glass.
fn nothing_there(t: &Translucent) -> Option<String> {
    let sigma = t.medium.sigma_t_prime();
    let empty: Vec<&str> = (0..3).filter(|&c| sigma[c] <= 0.0).map(|c| CHANNELS[c]).collect();
    (!empty.is_empty())
        .then(|| format!("no scattering and no absorption in {}: no light comes back there", empty.join(", ")))
}

/// Models of orders 2 and higher want single scattering beside them.
pub(super) fn no_first_order(t: &Translucent) -> Option<String> {
    let model = t.build().ok()?;
    (!model.claims().first_order).then(|| {
        let name = model.name().name();
        format!("`{name}` leaves out light scattered once, and `single = false` too: some 10 % of the light is missing")
    })
}

/// Where the medium leaves the range of diffusion theory, by the chart of `optics`.
fn outside_diffusion(t: &Translucent) -> Option<String> {
    if nothing_there(t).is_some() {
        return None;
    }
    let optics = ChannelOptics::of(&t.medium);
    let low: Vec<String> = (0..3)
        .filter(|&c| optics[c].outside_diffusion())
        .map(|c| format!("{} in {}", albedo(optics[c].alpha_prime), CHANNELS[c]))
        .collect();
    if !low.is_empty() {
        let low = low.join(", ");
        return Some(format!(
            "reduced albedo {low}, below 0.5: outside diffusion theory, light is absorbed before it spreads and every BSSRDF model errs; method `volume_path` needs none"
        ));
    }
    (Trust::of(&optics) == Trust::PathTracing).then(|| {
        let albedo = optics.map(|k| albedo(k.alpha)).join(", ");
        format!("g = {} with albedo {albedo}: light goes on too straight for a BSSRDF model, which errs; method `volume_path` needs none", t.medium.g)
    })
}

fn objects(file: &SceneFile, scene: &Scene, said: &mut Vec<String>) {
    for (index, object) in (0..).zip(&scene.objects) {
        let head = format!("{}: object {:?}", object.at, object.name);
        let found = scene.remarks(object).into_iter().filter(|r| r.warns).map(|r| r.text);
        said.extend(found.map(|what| format!("{head}: {what}")));
        if let Some(t) = &scene.materials[object.material].surface.inside
            && let Some(bounds) = object.mesh.bounds()
        {
            // Of a body that light hardly meets no model need be spoken.
            if let Some(what) = thin(t, bounds.extent().length()) {
                said.push(format!("{head}: {what}"));
            } else if model_decides(file, scene, index) && !scene.has(object, ObstacleKind::Sheet) {
                let material = &scene.materials[object.material].name;
                let found = energy::of(t, (scene.body(index).and_then(|b| b.shape()), object.sheet.is_some()), &|| {
                    scene.untraceable(index)
                });
                said.extend(found.into_iter().map(|what| format!("{head}: material {material:?}: {what}")));
            }
        }
    }
}

/// A mean free path longer than the object.
fn thin(t: &Translucent, diagonal: f64) -> Option<String> {
    let sigma = t.medium.sigma_t_prime();
    let (c, smallest) = (0..3).map(|c| (c, f64::from(sigma[c]))).min_by(|a, b| a.1.total_cmp(&b.1))?;
    (smallest > 0.0 && smallest * diagonal < 1.0).then(|| {
        format!(
            "the transport mean free path in {}, {} units, is longer than the object's diagonal, {} units: \
             it will look almost empty; check `unit` and the coefficients",
            CHANNELS[c],
            short(1.0 / smallest),
            short(diagonal)
        )
    })
}

fn light(file: &SceneFile, scene: &Scene, said: &mut Vec<String>) {
    if scene.is_dark() && file.method.name != Some(MethodName::AmbientOcclusion) {
        said.push(format!(
            "{}: no light: no emissive object, no [[light]] and no [environment]; all but ambient occlusion will be black",
            file.path.display()
        ));
    }
}

/// The camera in a closed body that lets no light in and has no lamp inside.
fn shut_in(scene: &Scene) -> Option<String> {
    let (eye, boxes) = (scene.camera.origin, scene.objects.iter().map(|o| o.mesh.bounds()));
    let boxes: Vec<_> = boxes.collect();
    let shines = |o: &super::Object| scene.materials[o.material].surface.shines();
    let holds_camera = |&i: &usize| {
        let (object, Some(own)) = (&scene.objects[i], boxes[i]) else { return false };
        let opaque = scene.materials[object.material].surface.is_opaque();
        let lamp_near = || {
            let mut others = scene.objects.iter().zip(&boxes);
            let mut points = scene.lights.iter().filter_map(|light| light.kind.position());
            others.any(|(o, b)| shines(o) && b.is_some_and(|b| b.is_near(&own, 0.0))) || points.any(|x| own.contains(x))
        };
        opaque
            && object.findings.open_edges == 0
            && own.contains(eye)
            && !lamp_near()
            && Solid::new(&object.mesh).winding(eye, |_| true).is_some_and(|w| w != 0)
    };
    let i = (0..scene.objects.len()).find(holds_camera)?;
    let (at, name) = (&scene.objects[i].at, &scene.objects[i].name);
    Some(format!(
        "{at}: object {name:?}: the camera is inside it, it is closed and no lamp is in it: all that is seen there is black"
    ))
}
