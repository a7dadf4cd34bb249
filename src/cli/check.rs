//! `marmor check`: what is in a scene, what will be built, and what is left out.

use super::advice::Advice;
use super::files::{Files, Remedy};
use super::need;
use super::setup::{MethodArgs, prepare};
use marmor::Result;
use marmor::film::{Window, check_replaceable, write_atomically};
use marmor::geometry::{Mended, mended, write_obj};
use marmor::integrator::{Integrator as _, TOLERANCE, View};
use marmor::math::Rgb;
use marmor::optics::{ChannelOptics, HalfSpace, Medium};
use marmor::scene::{Emission, FilterName, Object, Projection, Scene, SceneFile, Surface, Translucent};
use marmor::words::{albedo, counted, digits, percent, short};
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
    let window = Window::full([width, height]);
    let rays = scene.rays(prepared.backend)?;
    let view = View { scene, rays: &*rays };
    let need = need::of(&prepared, window, Some(view));
    let advice = Advice::new(&prepared, view, window, usize::MAX, args.tolerance);
    let warnings: Vec<String> = scene.warnings.iter().cloned().chain(advice.warning()).collect();
    if args.json {
        let objects = scene.objects.iter().zip(&advice.shares);
        let report = json!({
            "scene": scene.name,
            "unit_in_mm": scene.unit_in_mm,
            "resolution": [width, height],
            "camera": camera(&prepared.file),
            "method": prepared.method.name(),
            "backend": rays.description(),
            "objects": objects.map(|(object, share)| object_json(scene, object, *share)).collect::<Vec<_>>(),
            "lights": scene.lights.iter().map(|l| json!({ "name": l.name, "light": l.kind.text(scene.centre) })).collect::<Vec<_>>(),
            "parts": parts,
            "validity": advice.bodies.iter().map(|t| advice.json(t)).collect::<Vec<_>>(),
            "says": advice.lines(),
            "look_at": advice.empty.as_ref().map(|aim| aim.at.to_array()),
            "film_bytes": need.film,
            "picture_bytes": need.pictures,
            "memory": need,
            "available_bytes": available,
            "warnings": warnings,
        });
        println!("{report:#}");
        return Ok(ExitCode::SUCCESS);
    }
    let unit = scene.unit_in_mm.map_or("unit not declared".into(), |mm| format!("1 unit = {mm} mm"));
    println!("{}: {unit}, {width}x{height} pixels", scene.name);
    println!("method {} on {}", prepared.method.name(), rays.description());
    if let Some(line) = camera(&prepared.file) {
        println!("{line}");
    }
    if !warnings.is_empty() {
        println!("\nwarnings");
        warnings.iter().for_each(|warning| println!("  {warning}"));
    }
    if let Some(line) = advice.without_models() {
        println!("\n{line}");
    } else if !advice.bodies.is_empty() {
        println!(
            "\nwhich model to trust (error: light that is missing or too much where it comes out, added up; even light hides part of it)"
        );
        advice.bodies.iter().flat_map(|t| advice.paragraph(t)).for_each(|line| println!("  {line}"));
    }
    println!("\nobjects");
    for (object, share) in scene.objects.iter().zip(&advice.shares) {
        tell(scene, object, *share);
    }
    if !scene.lights.is_empty() {
        println!("\nlights");
        scene.lights.iter().for_each(|light| println!("  {}: {}", light.name, light.kind.text(scene.centre)));
    }
    for (built, title) in [(true, "built"), (false, "left out")] {
        println!("\n{title}");
        for part in parts.iter().filter(|p| p.built == built) {
            println!("  {}: {}", part.name, part.why);
        }
    }
    let mega = |bytes: u64| format!("{:.1} MB", bytes as f64 / 1e6);
    println!(
        "\nmemory: some {} at the most: film {}, passes and pictures {}, meshes {}, trees and tables {}, environment {}, textures {}, cache or photons {}; \
         available {}",
        mega(need.peak),
        mega(need.film),
        mega(need.pictures),
        mega(need.meshes),
        mega(need.trees),
        mega(need.environment),
        mega(need.textures),
        mega(need.pass),
        available.map_or("unknown".into(), |bytes| marmor::memory::gigabytes(bytes.into()))
    );
    Ok(ExitCode::SUCCESS)
}

/// What is not that of a pinhole with a box filter.
fn camera(file: &SceneFile) -> Option<String> {
    let mut parts = Vec::new();
    if let Projection::Orthographic { height } = file.camera.projection {
        parts.push(format!("parallel rays over {} units of height", short(height)));
    }
    if let Some(lens) = &file.camera.lens {
        let blades = if lens.blades == 0 { String::new() } else { format!(" of {} blades", lens.blades) };
        parts.push(format!(
            "a lens{blades} {} units wide, sharp {} units along the view",
            short(lens.aperture),
            short(lens.focus)
        ));
    }
    if let Some(filter) = file.render.filter.filter(|f| *f != FilterName::Box) {
        parts.push(format!("a {} filter", filter.name()));
    }
    (!parts.is_empty()).then(|| format!("camera: {}", parts.join("; ")))
}

/// An object in some lines: where and how large it is, how much of the picture it fills, what it is made of.
fn tell(scene: &Scene, object: &Object, share: f64) {
    let (material, Extent { area, size, bounds }) = (&scene.materials[object.material], Extent::new(scene, object));
    let lengths = |v: [f64; 3], by: &str| v.map(short).join(by);
    let mm = scene.unit_in_mm.filter(|mm| *mm != 1.0);
    let in_mm = mm.map_or(String::new(), |mm| format!(" ({} mm)", lengths(size.map(|s| s * mm), " x ")));
    let triangles = counted(object.mesh.triangles.len(), "triangle", "triangles");
    println!("  {}: {triangles}, {} units{in_mm}", object.name, lengths(size, " x "));
    if let [_, _, ..] = &object.parts[..] {
        println!("    one body of {}", object.parts.join(", "));
    }
    println!(
        "    from ({}) to ({}); {}",
        lengths(bounds[0], ", "),
        lengths(bounds[1], ", "),
        match share {
            0.0 => "not in the picture, or tiny in it".into(),
            share if share < 0.01 => "less than 1 % of the picture".into(),
            share => format!("{} of the picture", percent(share)),
        }
    );
    if let Some(thickness) = object.sheet {
        println!(
            "    a sheet {} units thick, its mesh the middle: both faces and the rim are counted",
            short(thickness)
        );
    }
    println!(
        "    area {} unit²; material {}: {}",
        short(area),
        material.name,
        describe(&material.surface).join("\n    ")
    );
    if let Some(t) = &material.surface.inside {
        odd_size(&t.medium, size).iter().for_each(|note| println!("    note: {note}"));
    }
    for remark in scene.remarks(object).iter().filter(|r| !r.warns) {
        println!("    note: {}", remark.text);
    }
}

/// As many transport mean free paths across, and light hardly spreads.
const LARGE: f64 = 1000.0;

/// A body so large for its medium that a unit may be wrong; the opposite is among the warnings.
fn odd_size(medium: &Medium, size: [f64; 3]) -> Option<String> {
    let paths = medium.transport_mean_free_path().0.map(f64::from);
    let path = paths.into_iter().filter(|l| l.is_finite()).fold(0.0, f64::max);
    let (length, times) = (size.into_iter().fold(0.0, f64::max), size.into_iter().fold(0.0, f64::max) / path);
    (path > 0.0 && times > LARGE).then(|| {
        format!(
            "{} units is {} transport mean free paths: light hardly spreads on it; if it should glow, check `unit` and \
             the coefficients",
            short(length),
            short(times)
        )
    })
}

/// Writes mended meshes, in their own space: before the object's transform, after its `flip`. Nothing is written over what
/// the scene is made of.
fn write_mended(prepared: &super::setup::Prepared, folder: &Path) -> Result<()> {
    let scene_folder = prepared.file.path.parent().unwrap_or(Path::new(""));
    let mut files = Files::default();
    files.reads_scene(&prepared.file);
    let mut all = Vec::new();
    for entry in &prepared.file.objects {
        let Some(mesh) = entry.read_mesh(scene_folder)? else { continue };
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

/// Where an object is, in the coordinates of the scene file.
struct Extent {
    /// [unit²].
    area: f64,
    /// Edges of the bounding box [unit].
    size: [f64; 3],
    /// Its corners [unit].
    bounds: [[f64; 3]; 2],
}

impl Extent {
    fn new(scene: &Scene, object: &Object) -> Self {
        let mesh = &object.mesh;
        let area = (0..mesh.triangles.len() as u32).map(|t| mesh.area(t)).sum();
        let bounds = mesh.bounds().unwrap_or_default();
        // Coordinates keep what rounding about the scene's centre leaves of them.
        let least = 1e-6 * bounds.extent().max_element().max(scene.centre.abs().max_element());
        let place = |v: f64| if v.abs() < least { 0.0 } else { v };
        let corners = [bounds.lower, bounds.upper].map(|p| (p + scene.centre).to_array().map(place));
        Self { area, size: bounds.extent().to_array(), bounds: corners }
    }
}

/// The kind of a surface, and its numbers.
fn describe(surface: &Surface) -> Vec<String> {
    match surface {
        Surface { emission: Some(Emission { radiance, two_sided }), .. } => {
            vec![format!("emissive, radiance {:?}{}", radiance.0, if *two_sided { ", two-sided" } else { "" })]
        }
        Surface { clear: Some(clear), .. } => {
            vec![format!("dielectric, eta {}, sigma_a {:?}", clear.eta, clear.sigma_a.0)]
        }
        Surface { inside: None, bsdf, .. } => vec![bsdf.text()],
        Surface { inside: Some(t), .. } => {
            let free_path = t.medium.sigma_t_prime().map(|s| 1.0 / s);
            vec![
                format!("translucent, {}, model {}", t.source, t.model_text()),
                format!(
                    "eta {}, reduced albedo [{}], transport mean free path [{}] unit",
                    t.medium.eta,
                    ChannelOptics::of(&t.medium).map(|k| albedo(k.alpha_prime)).join(", "),
                    free_path.0.map(|l| short(l.into())).join(", ")
                ),
                format!(
                    "colour [{}]: what a thick body of it gives back of even light, the mirror image aside{}",
                    colour(t).map(|v| digits(v, 3)).join(", "),
                    if t.medium.g == 0.0 { "" } else { " (as if g were 0)" }
                ),
            ]
        }
    }
}

/// Diffuse reflectance of a half space under even light, by pigment of the same place inwards and outwards.
fn colour(t: &Translucent) -> [f64; 3] {
    let half_space = HalfSpace::new(t.medium.eta.into());
    let tint = t.tint.as_ref().map_or(Rgb::WHITE, |tint| tint.map(|share| share * share).mean());
    let reflectance = ChannelOptics::of(&t.medium).map(|k| half_space.even_reflectance(k.absorbed_prime));
    std::array::from_fn(|c| reflectance[c] * f64::from(tint[c]))
}

fn object_json(scene: &Scene, object: &Object, share: f64) -> Value {
    let (material, Extent { area, size, bounds }) = (&scene.materials[object.material], Extent::new(scene, object));
    json!({
        "name": object.name,
        "made_of": object.parts,
        "triangles": object.mesh.triangles.len(),
        "area": area,
        "size": size,
        "from": bounds[0],
        "to": bounds[1],
        "in_picture": share,
        "material": material.name,
        "surface": describe(&material.surface).join(", "),
        "thickness": object.sheet,
        "findings": object.findings,
        "remarks": scene.remarks(object),
    })
}
