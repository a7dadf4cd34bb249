//! The way from the file as typed to the checked world: meshes read, placed and recentred in f64, then rounded.

use std::path::Path;

use super::file::SceneFile;
use super::mesh_files::MeshFiles;
use super::objects::{Geometry, NormalsChoice, ObjectEntry, grouped};
use super::options::MethodName;
use super::textures::Loader;
use super::{
    Insides, LightSource, Object, Obstacle, ObstacleKind, Scene, Surface, Translucent, eye, precision, sheets, warnings,
};
use crate::error::{Error, Result};
use crate::geometry::{
    Findings, LOADING_BYTES, Mended, Mesh, Precision, RawMesh, Solid, examine, mended, rectangle, rectangle_uv, sphere,
    sphere_uv,
};
use crate::math::{Aabb, DVec3};
use crate::memory;
use crate::words::{counted, either};

impl Scene {
    /// Reads the meshes of a scene file (each file once) and makes the world from them. What is odd but can be
    /// rendered is in [`Scene::warnings`].
    ///
    /// # Errors
    /// A file error if a mesh cannot be read; a scene error if one is malformed or has no place in single precision.
    pub fn load(file: &SceneFile) -> Result<Self> {
        Self::load_with(file, false)
    }

    /// As [`Self::load`]; with `repair` meshes are mended first, as [`crate::geometry::mended`] says, and what was done
    /// is among the warnings.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_with(file: &SceneFile, repair: bool) -> Result<Self> {
        let mut said = Vec::new();
        let folder = file.path.parent().unwrap_or(Path::new(""));
        let environment = file.environment.load(folder, &mut said)?;
        let mut loader = Loader::new(folder, &mut said);
        let surfaces: Vec<Surface> = file.materials.iter().map(|m| m.pictured(&mut loader)).collect::<Result<_>>()?;
        let placed = meshes(file, folder, repair, &mut said)?;
        let (materials, of_objects) = sheets::materials(file, &surfaces, &mut said)?;
        let translucent = |entry: &ObjectEntry| file.materials[entry.material].surface.is_translucent();
        let body = |entry: &ObjectEntry| file.materials[entry.material].surface.is_body();
        let bodies = file.objects.iter().zip(&placed).filter(|(entry, _)| body(entry)).map(|(_, mesh)| mesh);
        let centre = centre(bodies).or_else(|| self::centre(&placed)).unwrap_or(DVec3::ZERO);
        let mut placed: Vec<Option<RawMesh>> = placed.into_iter().map(Some).collect();
        let mut objects = Vec::with_capacity(placed.len());
        for group in grouped(&file.objects) {
            let entry = &file.objects[group[0]];
            let alone = |i: usize| match (&placed[i], file.objects[i].normals) {
                (Some(mesh), NormalsChoice::Smooth) => mesh.sharing_no_corner(),
                _ => 0,
            };
            let alone = group.iter().map(|&i| alone(i)).sum();
            let meshes: Vec<RawMesh> = group.iter().filter_map(|&i| placed[i].take()).collect();
            let as_placed = one_mesh(meshes, centre);
            let mesh = as_placed.recentred(centre);
            drop(as_placed);
            if let Some(p) = mesh.positions.iter().find(|p| !p.as_vec3().is_finite()) {
                let what = format!("object {:?}: a vertex ({p}) is too far out for single precision", entry.name);
                return Err(Error::scene(format!("{}: {what}; use a larger `unit` or a smaller `scale`", entry.at)));
            }
            let findings = examine(&mesh);
            said.extend(smooths_nothing(entry, alone, &findings, translucent(entry)));
            let parts: Vec<String> = group.iter().map(|&i| file.objects[i].name.clone()).collect();
            let name = entry.body.as_ref().filter(|_| parts.len() > 1).unwrap_or(&entry.name).clone();
            let (at, flipped) = (entry.at.clone(), group.iter().any(|&i| file.objects[i].flip));
            let (material, priority, sheet) = (of_objects[group[0]], entry.priority, entry.thickness);
            objects.push(Object { name, parts, mesh, at, material, flipped, findings, priority, sheet });
        }
        let bodies = Self::bodies_of(&objects, &materials);
        let placed_light = |light: &LightSource| LightSource { kind: light.kind.relative_to(centre), ..light.clone() };
        let mut scene = Self {
            name: file.path.display().to_string(),
            unit_in_mm: file.unit_in_mm,
            centre,
            camera: file.camera.camera(&file.path, centre, file.render.filter())?,
            objects,
            bodies,
            materials,
            environment,
            lights: file.lights.iter().map(placed_light).collect(),
            why_double: None,
            warnings: Vec::new(),
            insides: Insides::default(),
        };
        lights_outside(&scene)?;
        let traced = file.method.name == Some(MethodName::VolumePath);
        let single = file.method.single != Some(false);
        let walks = |t: &Translucent| traced || single && warnings::no_first_order(t).is_some();
        let choice = precision::choose(&scene.objects, &scene.bodies, &scene.materials, walks);
        if choice.why_double.is_some() {
            scene.objects.iter_mut().for_each(|o| o.mesh.precision = Precision::Double);
        }
        scene.why_double = choice.why_double;
        for (group, object) in grouped(&file.objects).iter().zip(&scene.objects) {
            sheets::refuse_folds(&file.objects[group[0]], object, centre)?;
        }
        eye::refuse_cut(&file.camera, &scene)?;
        // From here on: the gap between two surfaces depends on what rays are traced in.
        said.extend(warnings::of(file, &scene));
        let method = file.method.name.unwrap_or_else(|| scene.default_method());
        let models_or_paths = matches!(method, MethodName::Subsurface | MethodName::VolumePath)
            || method == MethodName::Path && scene.has_clear_bodies();
        for (number, what) in choice.beyond {
            // What encloses nothing is not too thin besides, where that is said.
            let Object { name, at, .. } = &scene.objects[number];
            let sheet = |o: &Obstacle| o.kind == ObstacleKind::Sheet && o.objects.contains(name);
            let said_so = |o: &Obstacle| sheet(o) && o.warning(method).is_some();
            if !models_or_paths || !scene.obstacles().iter().any(said_so) {
                said.push(format!("{at}: object {name:?}: {what}"));
            }
        }
        if models_or_paths {
            said.extend(scene.obstacles().iter().filter_map(|o| o.warning(method)));
        }
        scene.warnings = said;
        Ok(scene)
    }

    /// The method where the file asks for none: subsurface with a translucent object, else paths through media with a clear one, else
    /// paths where there is light, else ambient occlusion.
    pub fn default_method(&self) -> MethodName {
        let any = |test: fn(&Surface) -> bool| self.objects.iter().any(|o| test(&self.materials[o.material].surface));
        if any(Surface::is_translucent) {
            MethodName::Subsurface
        } else if any(Surface::is_body) {
            MethodName::VolumePath
        } else if !self.environment.is_black() || !self.lights.is_empty() || any(|s| s.emission.is_some()) {
            MethodName::Path
        } else {
            MethodName::AmbientOcclusion
        }
    }

    /// All meshes, in the order of [`Scene::objects`]; what a ray backend is built from.
    pub fn meshes(&self) -> Vec<&Mesh> {
        self.objects.iter().map(|o| &o.mesh).collect()
    }
}

/// Refuses a light at a place inside a body: light reaches a body's medium from lamps with a surface, and through the body's boundary.
fn lights_outside(scene: &Scene) -> Result<()> {
    for light in &scene.lights {
        let Some(x) = light.kind.position() else { continue };
        if !x.as_vec3().is_finite() {
            let what = "is too far out for single precision; use a larger `unit`, or type = \"distant\"";
            return Err(Error::scene(format!("{}: light {:?} {what}", light.at, light.name)));
        }
        for (object, body) in scene.objects.iter().zip(&scene.bodies) {
            let near = body.as_ref().is_some_and(|body| body.bounds.contains(x));
            if near && Solid::new(&object.mesh).winding(x, |_| true).is_some_and(|w| w != 0) {
                return Err(Error::scene(format!(
                    "{}: light {:?} is inside object {:?}: a place without a surface is met by no path there; move it out, or take an \
                     emissive sphere",
                    light.at, light.name, object.name
                )));
            }
        }
    }
    Ok(())
}

/// The mesh of a body of several objects, or of one.
fn one_mesh(mut meshes: Vec<RawMesh>, centre: DVec3) -> RawMesh {
    if meshes.len() == 1 {
        return meshes.pop().unwrap_or_default();
    }
    let closed = |mesh: &RawMesh| {
        let found = examine(&mesh.recentred(centre));
        found.open_edges == 0 && found.mixed_edges == 0
    };
    RawMesh::joined(meshes.into_iter().map(|mesh| (closed(&mesh), mesh)).map(|(closed, mesh)| (mesh, closed)).collect())
}

/// The objects' meshes in the scene's space, in f64.
fn meshes(file: &SceneFile, folder: &Path, repair: bool, said: &mut Vec<String>) -> Result<Vec<RawMesh>> {
    let has_picture = |entry: &ObjectEntry| file.materials[entry.material].images().next().is_some();
    let mut files = MeshFiles::new(file, folder);
    let mut out = Vec::with_capacity(file.objects.len());
    let mut unasked = 0;
    for entry in &file.objects {
        let mut mesh = match &entry.geometry {
            Geometry::Rectangle { centre, edge_u, edge_v } => rectangle(*centre, *edge_u, *edge_v),
            Geometry::Sphere { centre, radius, rings, segments } => {
                let triangles = 2 * u128::from(rings - 1) * u128::from(*segments);
                let what = format!("{}: object {:?} of {triangles} triangles", entry.at, entry.name);
                // Asking the system takes longer than making a small sphere.
                unasked += triangles * LOADING_BYTES as u128;
                if unasked > 1 << 26 {
                    memory::require(unasked, memory::available(), &what, "use fewer rings and segments")?;
                    unasked = 0;
                }
                sphere(*centre, *radius, *rings, *segments)
            }
            Geometry::Mesh(path) => files.take(file, entry, &folder.join(path), said)?,
        };
        mesh.uv = match &entry.geometry {
            _ if !has_picture(entry) => None,
            Geometry::Rectangle { .. } => Some(rectangle_uv()),
            Geometry::Sphere { rings, segments, .. } => Some(sphere_uv(*rings, *segments)),
            Geometry::Mesh(_) => mesh.uv,
        };
        need_uv(file, entry, &mesh)?;
        out.push(sheets::body(entry, place(entry, mesh, repair, said), said)?);
    }
    Ok(out)
}

/// Refuses an object that has a picture and no coordinates for it.
fn need_uv(file: &SceneFile, entry: &ObjectEntry, mesh: &RawMesh) -> Result<()> {
    let (material, all) = (&file.materials[entry.material], mesh.triangles.len());
    let without = if material.images().next().is_some() { mesh.without_uv() } else { 0 };
    if without == 0 {
        return Ok(());
    }
    let mesh = match &entry.geometry {
        Geometry::Mesh(path) => path.display().to_string(),
        _ => "its shape".into(),
    };
    Err(Error::scene(format!(
        "{}: object {:?}: its material {:?} has a picture, but {without} of {} of {mesh} {} no texture coordinates; export them \
         (`vt` of OBJ, at each corner of each face; STL has none), or give the object another material",
        entry.at,
        entry.name,
        material.name,
        counted(all, "triangle", "triangles"),
        either(without, "has", "have")
    )))
}

fn place(entry: &ObjectEntry, mut mesh: RawMesh, repair: bool, said: &mut Vec<String>) -> RawMesh {
    if entry.normals != NormalsChoice::Auto {
        mesh.normals = None;
    }
    let (bare, all) = (mesh.without_normals(), mesh.triangles.len());
    if bare > 0 {
        said.push(format!(
            "{}: object {:?}: {bare} of {} {} shaded flat, without normals in the file or not at each corner; set `normals`",
            entry.at,
            entry.name,
            counted(all, "triangle", "triangles"),
            either(bare, "is", "are")
        ));
    }
    mesh = mesh.placed(entry.transform);
    if entry.flip {
        mesh = mesh.flipped();
    }
    if repair {
        let done;
        (mesh, done) = mended(mesh);
        if done != Mended::default() {
            said.push(format!("{}: object {:?} mended: {done}", entry.at, entry.name));
        }
    }
    // After the transform: a stretch changes the angles.
    if entry.normals != NormalsChoice::Smooth {
        return mesh;
    }
    mesh.with_smooth_normals()
}

/// That smooth normals were asked for, and `alone` triangles share no corner with another; where a remark on the mesh has the
/// cause and the remedy, nothing.
fn smooths_nothing(entry: &ObjectEntry, alone: usize, found: &Findings, translucent: bool) -> Option<String> {
    if 2 * alone <= found.triangles || found.triangles == 1 || translucent && found.seam.is_some() {
        return None;
    }
    let remedy = match found.seam {
        Some(_) => "weld them: --repair does",
        None => "weld corners that should be one",
    };
    Some(format!(
        "{}: object {:?}: normals = \"smooth\" smooths nothing on {alone} of {} triangles, which share no corner with another, so \
         they are shaded flat; {remedy}",
        entry.at, entry.name, found.triangles
    ))
}

/// Middle of the box around all meshes.
fn centre<'a>(meshes: impl IntoIterator<Item = &'a RawMesh>) -> Option<DVec3> {
    meshes.into_iter().filter_map(RawMesh::bounds).reduce(Aabb::join).map(|bounds| bounds.centre())
}
