//! Oddities that can be rendered but that a user should hear of, each with its numbers.

use super::file::SceneFile;
use super::options::MethodName;
use super::{Object, Scene, Surface, Translucent, energy};
use crate::geometry::Solid;
use crate::optics::{ChannelOptics, Trust};

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
    said.extend(shut_in(file, scene));
    said
}

fn materials(file: &SceneFile, scene: &Scene, said: &mut Vec<String>) {
    let mut used = vec![false; file.materials.len()];
    scene.objects.iter().for_each(|o| used[o.material] = true);
    for (i, entry) in file.materials.iter().enumerate() {
        let head = format!("{}: material {:?}", entry.at, entry.name);
        if !used[i] {
            said.push(format!("{head} is used by no object"));
        } else if let Surface::Translucent(t) = &scene.materials[i].surface {
            let first = if file.method.single == Some(false) { no_first_order(t) } else { None };
            said.extend(outside_diffusion(t).into_iter().chain(first).map(|what| format!("{head}: {what}")));
        }
    }
}

/// Models of orders 2 and higher want single scattering beside them.
pub(super) fn no_first_order(t: &Translucent) -> Option<String> {
    let model = t.build().ok()?;
    (!energy::has_first_order(&model)).then(|| {
        let name = model.name().name();
        format!("`{name}` leaves out light scattered once, and `single = false` too: some 10 % of the light is missing")
    })
}

/// Where the medium leaves the range of diffusion theory, by the chart of `optics`.
fn outside_diffusion(t: &Translucent) -> Option<String> {
    let (optics, sigma) = (ChannelOptics::of(&t.medium), t.medium.sigma_t_prime());
    let empty: Vec<&str> = (0..3).filter(|&c| sigma[c] <= 0.0).map(|c| CHANNELS[c]).collect();
    if !empty.is_empty() {
        return Some(format!("no scattering and no absorption in {}: no light comes back there", empty.join(", ")));
    }
    let low: Vec<String> = (0..3)
        .filter(|&c| optics[c].outside_diffusion())
        .map(|c| format!("{:.3} in {}", optics[c].alpha_prime, CHANNELS[c]))
        .collect();
    if !low.is_empty() {
        let low = low.join(", ");
        return Some(format!(
            "reduced albedo {low}, below 0.5: outside diffusion theory, light is absorbed before it spreads and every BSSRDF model errs"
        ));
    }
    (Trust::of(&optics) == Trust::PathTracing).then(|| {
        let albedo = optics.map(|k| format!("{:.3}", k.alpha)).join(", ");
        format!("g = {:.3} with albedo {albedo}: light goes on too straight for a BSSRDF model, which errs", t.medium.g)
    })
}

fn objects(file: &SceneFile, scene: &Scene, said: &mut Vec<String>) {
    for ((index, object), entry) in (0..).zip(&scene.objects).zip(&file.objects) {
        let head = format!("{}: object {:?}", entry.at, entry.name);
        let found = scene.remarks(object).into_iter().filter(|r| r.warns).map(|r| r.text);
        said.extend(found.map(|what| format!("{head}: {what}")));
        if let Surface::Translucent(t) = &scene.materials[object.material].surface
            && let Some((lo, hi)) = object.mesh.bounds()
        {
            said.extend(thin(t, (hi - lo).length()).map(|what| format!("{head}: {what}")));
            if file.method.name.is_none_or(|name| name == MethodName::Subsurface) {
                let material = &scene.materials[object.material].name;
                let found = energy::of(t, object, &|| scene.untraceable(index));
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
            "the transport mean free path in {}, {:.4} units, is longer than the object's diagonal, {diagonal:.4} units: \
             it will look almost empty; check `unit` and the coefficients",
            CHANNELS[c],
            1.0 / smallest
        )
    })
}

fn light(file: &SceneFile, scene: &Scene, said: &mut Vec<String>) {
    let shines = |o: &Object| match &scene.materials[o.material].surface {
        Surface::Emissive { radiance, .. } => !radiance.is_black(),
        _ => false,
    };
    let dark = scene.environment.is_black() && !scene.objects.iter().any(shines);
    if dark && file.method.name != Some(MethodName::AmbientOcclusion) {
        said.push(format!(
            "{}: no light: no emissive object and no [environment]; all but ambient occlusion will be black",
            file.path.display()
        ));
    }
}

/// The camera in a closed body that lets no light in and has no lamp inside.
fn shut_in(file: &SceneFile, scene: &Scene) -> Option<String> {
    let (eye, boxes) = (scene.camera.origin, scene.objects.iter().map(|o| o.mesh.bounds()));
    let boxes: Vec<_> = boxes.collect();
    let shines = |o: &Object| matches!(&scene.materials[o.material].surface, Surface::Emissive { radiance, .. } if !radiance.is_black());
    let holds_camera = |&i: &usize| {
        let (object, Some((lo, hi))) = (&scene.objects[i], boxes[i]) else { return false };
        let opaque = matches!(scene.materials[object.material].surface, Surface::Diffuse { .. });
        let lamp_near = || {
            let mut others = scene.objects.iter().zip(&boxes);
            others.any(|(o, b)| shines(o) && b.is_some_and(|b| b.0.cmple(hi).all() && b.1.cmpge(lo).all()))
        };
        opaque
            && object.findings.open_edges == 0
            && eye.cmpge(lo).all()
            && eye.cmple(hi).all()
            && !lamp_near()
            && Solid::new(&object.mesh).winding(eye, |_| true).is_some_and(|w| w != 0)
    };
    let i = (0..scene.objects.len()).find(holds_camera)?;
    let (at, name) = (&file.objects[i].at, &scene.objects[i].name);
    Some(format!(
        "{at}: object {name:?}: the camera is inside it, it is closed and no lamp is in it: all that is seen there is black"
    ))
}
