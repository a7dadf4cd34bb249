//! `marmor check`: what is in a scene, what will be built, and what is left out.

use super::setup::{MethodArgs, prepare};
use marmor::Result;
use marmor::film::Film;
use marmor::geometry::Mesh;
use marmor::optics::Medium;
use marmor::scene::{Scene, Surface};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(clap::Args)]
pub struct Args {
    /// The scene file
    scene: PathBuf,
    #[command(flatten)]
    method: MethodArgs,
    /// Print one JSON object instead of a text
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: Args) -> Result<ExitCode> {
    let prepared = prepare(&args.scene, &args.method)?;
    let scene = &prepared.scene;
    let parts = prepared.method.parts(scene);
    let [width, height] = scene.camera.resolution;
    let film_bytes = width as usize * height as usize * Film::BYTES_PER_PIXEL;
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
            "film_bytes": film_bytes,
            "warnings": scene.warnings,
        });
        println!("{report:#}");
        return Ok(ExitCode::SUCCESS);
    }
    let unit = scene.unit_in_mm.map_or("unit not declared".into(), |mm| format!("1 unit = {mm} mm"));
    println!("{}: {unit}, {width}x{height} pixels (film {:.1} MB)", scene.name, film_bytes as f64 / 1e6);
    println!("method {} on backend {}", prepared.method.name(), prepared.backend.name());
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

/// Area [unit²] and edges of the bounding box [unit].
fn measures(mesh: &Mesh) -> (f64, [f32; 3]) {
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
    })
}
