//! `marmor check`: what is in a scene, what will be built, and what is left out.

use super::files::{Files, Remedy};
use super::need;
use super::setup::{MethodArgs, prepare};
use marmor::Result;
use marmor::film::{Window, check_replaceable, write_atomically};
use marmor::geometry::{Mended, Mesh, load_obj, mended, write_obj};
use marmor::integrator::{LocalShape, TOLERANCE, Trustworthiness, View};
use marmor::optics::Medium;
use marmor::query;
use marmor::scene::{Geometry, Scene, Surface};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(clap::Args)]
pub struct Args {
    /// The scene file
    scene: PathBuf,
    #[command(flatten)]
    method: MethodArgs,
    /// Write a mended OBJ file of each mesh that can be mended into this folder, under the object's name
    #[arg(long, value_name = "FOLDER")]
    write_mended: Option<PathBuf>,
    /// What counts as wrong where models are judged, as a share of the light
    #[arg(long, value_name = "E", default_value_t = TOLERANCE, value_parser = tolerance)]
    tolerance: f64,
    /// Print one JSON object instead of a text
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: Args) -> Result<ExitCode> {
    let prepared = prepare(args.method.read(&args.scene)?, &args.method)?;
    let scene = &prepared.scene;
    if let Some(folder) = &args.write_mended {
        write_mended(&prepared, folder)?;
    }
    let parts = prepared.method.parts(scene);
    let [width, height] = scene.camera.resolution;
    let available = marmor::memory::available();
    // For the models and for what a pass takes; where nothing is translucent there is nothing to ask.
    let translucent = scene.materials.iter().any(|m| matches!(m.surface, Surface::Translucent(_)));
    let meshes = scene.meshes();
    let rays = translucent.then(|| query::build(prepared.backend, &meshes)).transpose()?;
    let view = rays.as_ref().map(|rays| View { scene, rays: &**rays });
    let need = need::of(&prepared, Window::full([width, height]), view);
    let trust = view.map_or(Vec::new(), |view| trust(view, args.tolerance));
    if args.json {
        let objects: Vec<Value> = scene.objects.iter().map(|o| object_json(scene, o)).collect();
        let report = json!({
            "scene": scene.name,
            "unit_in_mm": scene.unit_in_mm,
            "resolution": [width, height],
            "method": prepared.method.name(),
            "backend": prepared.backend.name(),
            "objects": objects,
            "parts": parts,
            "validity": trust.iter().map(|t| {
                let mut value = json!(t);
                value["sentence"] = t.sentence().into();
                value
            }).collect::<Vec<_>>(),
            "film_bytes": need.film,
            "picture_bytes": need.pictures,
            "memory": need,
            "available_bytes": available,
            "warnings": scene.warnings,
        });
        println!("{report:#}");
        return Ok(ExitCode::SUCCESS);
    }
    let unit = scene.unit_in_mm.map_or("unit not declared".into(), |mm| format!("1 unit = {mm} mm"));
    println!("{}: {unit}, {width}x{height} pixels", scene.name);
    let mega = |bytes: u64| format!("{:.1} MB", bytes as f64 / 1e6);
    println!(
        "memory: some {} at the most: film {}, passes and pictures {}, meshes {}, trees and tables {}, environment {}, cache or photons {}; \
         available {}",
        mega(need.peak),
        mega(need.film),
        mega(need.pictures),
        mega(need.meshes),
        mega(need.trees),
        mega(need.environment),
        mega(need.pass),
        available.map_or("unknown".into(), |bytes| marmor::memory::gigabytes(bytes.into()))
    );
    let backend = if scene.why_double.is_some() { "rays in double precision" } else { prepared.backend.name() };
    println!("method {} on {backend}", prepared.method.name());
    println!("\nobjects");
    for object in &scene.objects {
        let material = &scene.materials[object.material];
        let (area, size) = measures(&object.mesh);
        println!(
            "  {}: {} triangles, area {area:.6} unit², {:.6} x {:.6} x {:.6}; material {} ({})",
            object.name,
            object.mesh.triangles.len(),
            size[0],
            size[1],
            size[2],
            material.name,
            describe(&material.surface)
        );
        for remark in scene.remarks(object) {
            println!("    {}: {}", if remark.warns { "warning" } else { "note" }, remark.text);
        }
    }
    if !trust.is_empty() {
        println!("\nwhich model to trust");
        trust.iter().for_each(|t| println!("  {}", t.sentence()));
    }
    for (built, title) in [(true, "built"), (false, "left out")] {
        println!("\n{title}");
        for part in parts.iter().filter(|p| p.built == built) {
            println!("  {}: {}", part.name, part.why);
        }
    }
    if !scene.warnings.is_empty() {
        println!("\nwarnings");
        for warning in &scene.warnings {
            println!("  {warning}");
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// How far models can be trusted on each translucent object.
fn trust(view: View<'_>, tolerance: f64) -> Vec<Trustworthiness> {
    let scene = view.scene;
    let translucent = |object: &u32| matches!(scene.surface(*object), Surface::Translucent(_));
    let objects = (0..scene.objects.len() as u32).filter(translucent);
    let of = |object: u32| Trustworthiness::new(view, &LocalShape::new(scene, object)?, tolerance);
    objects.filter_map(of).collect()
}

/// Writes mended meshes, in their own space: before the object's transform, after its `flip`. Nothing is written over what
/// the scene is made of.
fn write_mended(prepared: &super::setup::Prepared, folder: &Path) -> Result<()> {
    let scene_folder = prepared.file.path.parent().unwrap_or(Path::new(""));
    let mut files = Files::default();
    files.reads_scene(&prepared.file);
    let mut all = Vec::new();
    for entry in &prepared.file.objects {
        let Geometry::Mesh(path) = &entry.geometry else { continue };
        let mesh = load_obj(&scene_folder.join(path))?;
        let (mesh, done) = mended(if entry.flip { mesh.flipped() } else { mesh });
        if done == Mended::default() {
            continue;
        }
        let name: String = entry.name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
        let target = folder.join(format!("{name}.obj"));
        check_replaceable(&target)?;
        let remedy = "give another folder to --write-mended, or other names to the objects";
        files.writes(format!("the mended mesh of object {:?}", entry.name), &target, Remedy::Say(remedy));
        all.push((entry, target, mesh, done));
    }
    files.check()?;
    for (entry, target, mesh, done) in all {
        write_atomically(&target, |out| write_obj(&mesh, out))?;
        eprintln!(
            "wrote {}: {done}{}",
            target.display(),
            if entry.flip { "; remove `flip` from the object" } else { "" }
        );
    }
    Ok(())
}

/// A share of the light.
fn tolerance(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(e) if e > 0.0 && e <= 1.0 => Ok(e),
        _ => Err("expected a share of the light above 0 and up to 1, such as 0.05".into()),
    }
}

/// Area [unit²] and edges of the bounding box [unit].
fn measures(mesh: &Mesh) -> (f64, [f64; 3]) {
    let area = (0..mesh.triangles.len() as u32).map(|t| mesh.area(t)).sum();
    let size = mesh.bounds().map_or([0.0; 3], |(lo, hi)| (hi - lo).to_array());
    (area, size)
}

fn describe(surface: &Surface) -> String {
    match surface {
        Surface::Diffuse { albedo } => format!("diffuse, albedo {:?}", albedo.0),
        Surface::Emissive { radiance, two_sided } => {
            format!("emissive, radiance {:?}{}", radiance.0, if *two_sided { ", two-sided" } else { "" })
        }
        Surface::Translucent(t) => {
            let Medium { eta, .. } = t.medium;
            let free_path = t.medium.sigma_t_prime().map(|s| 1.0 / s);
            format!(
                "translucent, {}, model {}, eta {eta}, reduced albedo {:.4?}, transport mean free path {:.4?} unit",
                t.source,
                t.model_text(),
                t.medium.alpha_prime().0,
                free_path.0
            )
        }
    }
}

fn object_json(scene: &Scene, object: &marmor::scene::Object) -> Value {
    let material = &scene.materials[object.material];
    let (area, size) = measures(&object.mesh);
    json!({
        "name": object.name,
        "triangles": object.mesh.triangles.len(),
        "area": area,
        "size": size,
        "material": material.name,
        "surface": describe(&material.surface),
        "findings": object.findings,
        "remarks": scene.remarks(object),
    })
}
