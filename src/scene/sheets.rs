//! Objects with a `thickness`: their open meshes become closed bodies, and their materials know how thick the slab is.

use super::file::SceneFile;
use super::objects::ObjectEntry;
use super::options::MethodName;
use super::{Material, Object, Surface};
use crate::bssrdf::ModelName;
use crate::error::{Error, Result};
use crate::geometry::{MITER_LIMIT, NoSheet, Precision, RawMesh, Seek, Solid, examine, meeting, thickened};
use crate::math::DVec3;
use crate::words::{counted, digits, percent, place, short};

/// Surfaces closer than this many of the distances that rays start away from a surface are as good as in one place.
const OFFSETS: f64 = 2.0;
/// Thicknesses that differ by a smaller share are the same.
const SAME: f64 = 1e-3;

/// The body of `entry`, whose mesh is `mesh`: the same mesh where it has no thickness.
pub(super) fn body(entry: &ObjectEntry, mesh: RawMesh, said: &mut Vec<String>) -> Result<RawMesh> {
    let Some(thickness) = entry.thickness else { return Ok(mesh) };
    let found = examine(&mesh.recentred(DVec3::ZERO));
    if found.duplicates > 0 {
        let n = counted(found.duplicates, "triangle repeats another", "triangles repeat another");
        return Err(refused(entry, format_args!("{n}"), "--repair removes what is there twice"));
    }
    if found.seam.is_some() {
        let what = "its triangles do not share their corners, which lie close together";
        return Err(refused(entry, what, "--repair welds them"));
    }
    let thick = thickened(&mesh, thickness).map_err(|why| no_sheet(entry, thickness, why))?;
    if let Some(blunted) = thick.blunted {
        said.push(format!(
            "{}: object {:?}: at {} the sheet bends by more than {:.0} degrees, and is thinner than its `thickness` there: {} of it \
             {}; bend it in more steps",
            entry.at,
            entry.name,
            counted(blunted.corners, "corner", "corners"),
            2.0 * (1.0 / MITER_LIMIT).acos().to_degrees(),
            percent(blunted.share),
            near(blunted.at)
        ));
    }
    Ok(thick.mesh)
}

fn near(at: DVec3) -> String {
    format!("near {}", place(at.to_array(), 1e-9 * at.abs().max_element()))
}

fn refused(entry: &ObjectEntry, what: impl std::fmt::Display, remedy: &str) -> Error {
    Error::scene(format!("{}: object {:?} makes no sheet: {what}; {remedy}", entry.at, entry.name))
}

fn no_sheet(entry: &ObjectEntry, thickness: f64, why: NoSheet) -> Error {
    match why {
        NoSheet::Empty => refused(entry, "no triangle of it has an area", "give it another mesh"),
        NoSheet::Closed(1, 1) => refused(
            entry,
            "its mesh is closed, and bounds a body by itself",
            "leave out `thickness`, which is for open meshes (a material has its own, for the model `slab`)",
        ),
        NoSheet::Closed(closed, all) => refused(
            entry,
            format_args!("{closed} of its {all} parts {} closed", if closed == 1 { "is" } else { "are" }),
            "leave out `thickness`, or make another object of what is open",
        ),
        NoSheet::ThreeFaces(edges, at) => refused(
            entry,
            format_args!(
                "{} to three triangles or more, one of them {}",
                counted(edges, "edge belongs", "edges belong"),
                near(at)
            ),
            "leave at most two at each edge: make objects of their own of the sheets that meet there",
        ),
        NoSheet::OneSided(at) => refused(
            entry,
            format_args!(
                "it has one side only, as a Möbius band: its faces cannot agree about their front {}",
                near(at)
            ),
            "cut it open along a line",
        ),
        NoSheet::Bends(at) => refused(
            entry,
            format_args!(
                "it bends with a radius below half its thickness, {} units, {}",
                short(0.5 * thickness),
                near(at)
            ),
            "take a smaller `thickness`, or bend it less there",
        ),
    }
}

/// Refuses a sheet that meets itself: folded onto itself, or thicker than what it bends around.
pub(super) fn refuse_folds(entry: &ObjectEntry, object: &Object, centre: DVec3) -> Result<()> {
    let Some(thickness) = entry.thickness else { return Ok(()) };
    let solid = Solid::new(&object.mesh);
    let farthest = object.mesh.bounds().map_or(0.0, |bounds| bounds.farthest());
    let gap = OFFSETS * Precision::Double.error(farthest).max(object.mesh.precision.error(farthest));
    if solid.is_convex(gap) {
        return Ok(());
    }
    // Leaves of one mesh that pass through each other are bodies that overlap, as others are.
    let found = meeting(&solid, &solid, gap, Seek::Crossing, |[a, b]| a == b);
    let Some(contact) = found.crossing.or(found.touching) else { return Ok(()) };
    let what = format!(
        "{} units thick it meets itself {}: it is folded onto itself, or bends with a radius below half its thickness",
        short(thickness),
        near(contact.at + centre)
    );
    Err(refused(entry, what, "take a smaller `thickness`, or pull its folds apart"))
}

/// All materials, whose `surfaces` are these, and which of them each object has: that of a sheet knows its thickness. Objects of one material and several
/// thicknesses have copies of it.
///
/// # Errors
/// A sheet that is too thin, or too thick, for the model `slab` of its material.
pub(super) fn materials(
    file: &SceneFile,
    surfaces: &[Surface],
    said: &mut Vec<String>,
) -> Result<(Vec<Material>, Vec<usize>)> {
    let made = file.materials.iter().zip(surfaces).map(|(m, surface)| {
        let mut surface = surface.clone();
        if let (Some(t), Some(model)) = (&mut surface.inside, file.method.model) {
            t.model = model;
        }
        Material { name: m.name.clone(), surface }
    });
    let mut all: Vec<Material> = made.collect();
    // Free for the first sheet: no object without a thickness has it.
    let mut free = vec![true; all.len()];
    file.objects.iter().filter(|o| o.thickness.is_none()).for_each(|o| free[o.material] = false);
    let mut sheets: Vec<(usize, f64, usize)> = Vec::new();
    let mut of_objects = Vec::with_capacity(file.objects.len());
    for entry in &file.objects {
        let (own, Some(thickness)) = (entry.material, entry.thickness) else {
            of_objects.push(entry.material);
            continue;
        };
        if let Some(known) = sheets.iter().find(|s| (s.0, s.1) == (own, thickness)) {
            of_objects.push(known.2);
            continue;
        }
        let mut material = Material { name: all[own].name.clone(), surface: surfaces[own].clone() };
        if let (Some(t), Some(asked)) = (&mut material.surface.inside, &all[own].surface.inside) {
            if let Some(other) = t.thickness.filter(|t| (f64::from(*t) / thickness - 1.0).abs() > SAME) {
                said.push(format!(
                    "{}: object {:?} is a sheet {} units thick: the thickness {} of its material {:?} is not used",
                    entry.at,
                    entry.name,
                    short(thickness),
                    digits(other.into(), 4),
                    material.name
                ));
            }
            (t.model, t.thickness) = (asked.model, Some(thickness as f32));
            if t.model == ModelName::SLAB && file.method.name != Some(MethodName::VolumePath) {
                let within = |e: Error| {
                    let other = "take another model, or method `volume_path`";
                    Error::scene(format!(
                        "{}: object {:?}: material {:?}: {e}; {other}",
                        entry.at, entry.name, material.name
                    ))
                };
                t.build().map_err(within)?;
            }
        }
        let number = if std::mem::take(&mut free[own]) { own } else { all.len() };
        if number == own {
            all[own] = material;
        } else {
            all.push(material);
        }
        sheets.push((own, thickness, number));
        of_objects.push(number);
    }
    Ok((all, of_objects))
}
